//! Drawing in portions: where the adapter is a driver on the processor, it is not handed more triangles at once than it has
//! room for.
//!
//! Such a driver first makes lists of the triangles in each part of the picture, then fills their pixels. Mesa's llvmpipe
//! keeps some hundred bytes for each triangle until then, begins new lists after 36 MB, and does not wait for the old ones:
//! of 100,000 cubes it holds up to 150 MB at a time, of more objects more. So a pass over many triangles is cut into several
//! with a wait between them. The lists of visible objects are drawn in the same order either way, to the same picture.

use super::culling::Phase;
use std::ops::Range;

/// How passes are cut.
#[derive(Debug)]
pub(super) struct Portions {
    /// Of a portion; `None`: passes stay whole.
    pub triangles: Option<u32>,
}

/// What a pass draws: of each phase, some of the arguments of the draws.
pub(super) type Portion = Vec<(Phase, Range<usize>)>;

/// Triangles of a portion on a driver on the processor.
const FEW_TRIANGLES: u32 = 1 << 16;

impl Portions {
    pub fn new(gpu: &super::Gpu) -> Self {
        let on_processor = gpu.adapter.get_info().device_type == wgpu::DeviceType::Cpu;
        Self { triangles: std::env::var("PT").ok().map_or(on_processor.then_some(FEW_TRIANGLES), |v| v.parse().ok().filter(|n| *n > 0)) }
    }

    /// Cuts a pass that draws in some phases all of so many arguments, `triangles` of each. At least one portion.
    pub fn cut(
        &self,
        phases: impl Iterator<Item = Phase>,
        arguments: usize,
        triangles: impl Fn(Phase, usize) -> u64,
    ) -> Vec<Portion> {
        let Some(most) = self.triangles else { return vec![phases.map(|phase| (phase, 0..arguments)).collect()] };
        let (mut portions, mut portion, mut sum) = (Vec::new(), Portion::new(), 0);
        for phase in phases {
            let mut start = 0;
            for argument in 0..arguments {
                let more = triangles(phase, argument);
                if sum > 0 && sum + more > u64::from(most) {
                    portion.push((phase, start..argument));
                    portions.push(std::mem::take(&mut portion));
                    (start, sum) = (argument, 0);
                }
                sum += more;
            }
            portion.push((phase, start..arguments));
        }
        portions.push(portion);
        portions
    }
}
