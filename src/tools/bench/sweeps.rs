//! Sweeps of a suite: scenes that differ in one thing.

use super::grid::GridView;
use super::job::SuiteJob;
use super::separate_process::Scene;

/// The size that shows the engine's own cost.
const SMALL: (u32, u32) = (64, 36);

/// Quantity on the horizontal axis.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Axis {
    Objects,
    Lights,
    Moving,
}

/// Scenes that differ in one thing.
#[derive(Clone, Debug)]
pub(super) struct Sweep {
    pub axis: Axis,
    pub scenes: Vec<Scene>,
}

/// The sweeps that a suite consists of.
pub(super) fn sweeps(suite: &SuiteJob) -> Vec<Sweep> {
    let (plan, size) = (&suite.most.plan, suite.most.size);
    let most = Scene { objects: plan.objects, lights: plan.lights, moving: 0.0, view: GridView::Wide, size };
    let objects = if suite.quick { tenths(most.objects, 2) } else { tenths(most.objects, 4) };
    let lights = if suite.quick { tenths(most.lights, 2) } else { tenths(most.lights, 4) };
    let moving: &[f32] = if suite.quick { &[0.0, 1.0] } else { &[0.0, 0.01, 0.1, 1.0] };
    let over_objects = |base: Scene| Sweep {
        axis: Axis::Objects,
        scenes: objects.iter().map(|&objects| Scene { objects, ..base }).collect(),
    };
    let mut sweeps = vec![
        over_objects(Scene { size: SMALL, ..most }),
        over_objects(most),
        over_objects(Scene { view: GridView::Inside, ..most }),
        Sweep { axis: Axis::Lights, scenes: lights.iter().map(|&lights| Scene { lights, ..most }).collect() },
        Sweep {
            axis: Axis::Moving,
            scenes: moving.iter().map(|&moving| Scene { moving, size: SMALL, ..most }).collect(),
        },
    ];
    sweeps.dedup_by(|a, b| a.axis == b.axis && a.scenes == b.scenes);
    sweeps
}

/// `most` and so many tenths of it, ascending, none below 1 except `most` itself.
fn tenths(most: u32, count: u32) -> Vec<u32> {
    let mut values: Vec<u32> = (0..count).map(|i| most / 10u32.pow(i)).filter(|&n| n >= 1 || n == most).collect();
    values.reverse();
    values.dedup();
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tenths_end_at_the_most() {
        assert_eq!(tenths(100_000, 4), [100, 1000, 10_000, 100_000]);
        assert_eq!(tenths(25, 4), [2, 25]);
        assert_eq!(tenths(0, 4), [0]);
    }
}
