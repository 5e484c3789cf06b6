//! Drawing in portions: a driver on the processor is not handed all triangles of a large scene at once.
//!
//! Such a driver first lists the triangles in each part of the picture, then fills their pixels. Mesa's llvmpipe keeps about
//! 400 bytes of each triangle that faces the eye, in lists of 36 MB at most, and begins new ones before the old ones are
//! drawn: of 100,000 cubes it holds up to 150 MB at a time. So a pass over many triangles is cut into several: between
//! two of them the driver finishes what it has. The lists of visible objects are drawn in the same order either way, to the
//! same picture. It takes time where a picture is mostly vertices, which are worked on by one thread: the next ones wait until
//! the pixels are filled.

use super::culling::Phase;
use std::ops::Range;

/// How passes are cut.
#[derive(Clone, Copy, Debug)]
pub(super) struct Portions {
    /// The adapter is a driver on the processor.
    pub on_processor: bool,
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
        Self { on_processor, triangles: on_processor.then_some(FEW_TRIANGLES) }
    }
}

/// Cuts a pass that draws in some phases all of so many arguments, `triangles` of each: where a portion would have more
/// than `most` triangles, another begins. At least one.
pub(super) fn cut(
    most: u32,
    phases: impl Iterator<Item = Phase>,
    arguments: usize,
    triangles: impl Fn(Phase, usize) -> u64,
) -> Vec<Portion> {
    let (mut portions, mut portion, mut sum) = (Vec::new(), Portion::new(), 0);
    for phase in phases {
        portion.push((phase, 0..0));
        for argument in 0..arguments {
            let more = triangles(phase, argument);
            if sum > 0 && sum + more > u64::from(most) {
                portions.push(std::mem::replace(&mut portion, vec![(phase, argument..argument)]));
                sum = 0;
            }
            sum += more;
            if let Some((_, range)) = portion.last_mut() {
                range.end = argument + 1;
            }
        }
    }
    portions.push(portion);
    portions
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cut_all(most: u32, triangles: [&[u64]; 2]) -> Vec<Portion> {
        let of = |phase: Phase, argument: usize| triangles[phase as usize][argument];
        cut(most, [Phase::Early, Phase::Late].into_iter(), triangles[0].len(), of)
    }

    #[test]
    fn passes_are_cut_where_there_would_be_more_triangles_than_wanted() {
        use Phase::{Early, Late};
        let (early, late): (&[u64], &[u64]) = (&[4, 4, 4, 9, 1], &[3, 0, 0, 30, 2]);
        let wanted: [Portion; 6] = [
            vec![(Early, 0..2)],
            vec![(Early, 2..3)],
            vec![(Early, 3..5), (Late, 0..0)],
            vec![(Late, 0..3)],
            vec![(Late, 3..4)],
            vec![(Late, 4..5)],
        ];
        assert_eq!(cut_all(10, [early, late]), wanted, "what is too much by itself has a portion of its own");
        assert_eq!(cut_all(1000, [early, late]), [[(Early, 0..5), (Late, 0..5)]]);
        assert_eq!(cut_all(10, [&[], &[]]), [[(Early, 0..0), (Late, 0..0)]], "a pass without objects");
    }
}
