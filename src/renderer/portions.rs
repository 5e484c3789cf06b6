//! Drawing in portions: a driver on the processor is not handed all triangles of a large scene at once.
//!
//! Such a driver first lists the triangles in each part of the picture, then fills their pixels. Mesa's llvmpipe keeps
//! about 400 bytes of each triangle that may have pixels, in lists of 36 MB at most, and begins new ones before the old
//! ones are drawn: of 100,000 cubes it holds up to 150 MB at a time. So
//!
//! - a pass over many triangles is cut into several: between two of them the driver finishes what it has, which bounds
//!   the memory;
//! - within a pass, lists are handed over after every few triangles, by noting the time there: to do so, the driver
//!   ends a list without waiting for it. So one thread works on vertices while the others fill pixels.
//!
//! The lists of visible objects are drawn in the same order in any case, to the same picture.

use super::culling::Phase;
use std::ops::Range;

/// How passes are cut.
#[derive(Clone, Debug)]
pub(super) struct Portions {
    /// The adapter is a driver on the processor.
    pub on_processor: bool,
    /// Triangles of a pass; `None`: passes stay whole.
    pub of_pass: Option<u32>,
    /// Where the times go that lists are handed over at; nothing reads them. `None` where the device cannot note any in
    /// a pass.
    hand_overs: Option<wgpu::QuerySet>,
}

/// What is drawn without a break: of each phase, some of the arguments of the draws.
pub(super) type Portion = Vec<(Phase, Range<usize>)>;

/// Triangles of a pass on a driver on the processor.
const OF_PASS: u32 = 1 << 16;

/// Portions that a pass is handed over in, if the draws can be cut so finely.
const PORTIONS_OF_PASS: u32 = 8;

/// A pass has fewer portions: two that follow each other hold more triangles than a portion may.
const MOST_HAND_OVERS: u32 = 2 * PORTIONS_OF_PASS;

impl Portions {
    pub fn new(gpu: &super::Gpu) -> Self {
        let on_processor = gpu.adapter.get_info().device_type == wgpu::DeviceType::Cpu;
        let needed = wgpu::Features::TIMESTAMP_QUERY | wgpu::Features::TIMESTAMP_QUERY_INSIDE_PASSES;
        let hand_overs = (on_processor && gpu.device.features().contains(needed)).then(|| {
            gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("hand-overs"),
                ty: wgpu::QueryType::Timestamp,
                count: MOST_HAND_OVERS,
            })
        });
        Self { on_processor, of_pass: on_processor.then_some(OF_PASS), hand_overs }
    }

    /// Triangles of a portion.
    pub fn of_portion(&self) -> Option<u32> {
        let parts = if self.hand_overs.is_some() { PORTIONS_OF_PASS } else { 1 };
        self.of_pass.map(|triangles| (triangles / parts).max(1))
    }

    /// Has the driver fill the pixels of what was drawn in a pass so far; `number` is that of the portion that follows.
    pub fn hand_over(&self, pass: &mut wgpu::RenderPass<'_>, number: u32) {
        if let Some(queries) = self.hand_overs.as_ref().filter(|_| number < MOST_HAND_OVERS) {
            pass.write_timestamp(queries, number);
        }
    }
}

/// Cuts a pass that draws in some phases all of so many arguments, `triangles` of each: where a portion would have more
/// triangles than the second of `most`, another begins, and where a pass would have more than the first, another pass.
/// At least one.
pub(super) fn cut(
    most: (u32, u32),
    phases: impl Iterator<Item = Phase>,
    arguments: usize,
    triangles: impl Fn(Phase, usize) -> u64,
) -> Vec<Vec<Portion>> {
    let (mut passes, mut pass, mut portion) = (Vec::new(), Vec::new(), Portion::new());
    let (mut of_pass, mut of_portion) = (0, 0);
    for phase in phases {
        portion.push((phase, 0..0));
        for argument in 0..arguments {
            let more = triangles(phase, argument);
            let ends = |sum, most| sum > 0 && sum + more > u64::from(most);
            if ends(of_pass, most.0) || ends(of_portion, most.1) {
                pass.push(std::mem::replace(&mut portion, vec![(phase, argument..argument)]));
                of_portion = 0;
            }
            if ends(of_pass, most.0) {
                passes.push(std::mem::take(&mut pass));
                of_pass = 0;
            }
            of_pass += more;
            of_portion += more;
            if let Some((_, range)) = portion.last_mut() {
                range.end = argument + 1;
            }
        }
    }
    pass.push(portion);
    passes.push(pass);
    passes
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cut_all(most: (u32, u32), triangles: [&[u64]; 2]) -> Vec<Vec<Portion>> {
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
        let passes = cut_all((10, 10), [early, late]);
        assert_eq!(passes, wanted.map(|portion| vec![portion]), "what is too much by itself has a pass of its own");
        assert_eq!(cut_all((1000, 1000), [early, late]), [[[(Early, 0..5), (Late, 0..5)]]]);
        assert_eq!(cut_all((10, 10), [&[], &[]]), [[[(Early, 0..0), (Late, 0..0)]]], "a pass without objects");
    }

    #[test]
    fn portions_of_a_pass_are_cut_more_finely() {
        use Phase::{Early, Late};
        let passes = cut_all((10, 4), [&[2, 2, 3, 3, 1], &[0, 4, 0, 0, 9]]);
        let wanted: [Vec<Portion>; 3] = [
            vec![vec![(Early, 0..2)], vec![(Early, 2..3)], vec![(Early, 3..4)]],
            vec![vec![(Early, 4..5), (Late, 0..1)], vec![(Late, 1..4)]],
            vec![vec![(Late, 4..5)]],
        ];
        assert_eq!(passes, wanted);
    }
}
