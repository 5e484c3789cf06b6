//! The suite of `relief bench`: how cost grows with the objects, the lights, and the share that moves.
//!
//! Every scene is measured in a process of its own: peak memory and the time to the first frame
//! mean nothing in a process that has drawn others.

use super::grid::GridView;
use super::job::SuiteJob;
use super::report::{self, Earlier};
use super::run::BenchError;
use super::separate_process::{Launch, Scene, measure_apart};
use crate::frames;
use crate::output;

/// The size that shows the engine's own cost.
const SMALL: (u32, u32) = (64, 36);

/// What is on the horizontal axis.
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

/// Measures every scene of the sweeps and writes results, report and plots into the folder. `progress` is called before
/// each scene with how many are done, how many there are, and which it is. Returns what got slower than in the file
/// that was compared with, in words.
///
/// # Errors
/// [`BenchError`]; nothing is written then.
pub fn run_suite(
    suite: &SuiteJob,
    launch: Launch,
    mut progress: impl FnMut(usize, usize, &str),
) -> Result<Vec<String>, BenchError> {
    // What can be refused is refused before minutes of measuring.
    let earlier = suite.earlier.as_deref().map(Earlier::read).transpose()?;
    let results = suite.folder.join(report::RESULTS);
    frames::check_outputs(suite.earlier.as_slice(), |path| output::is_same(path, &results))?;
    output::make_folder(&suite.folder)?;
    output::check_writable(&suite.folder)?;
    let sweeps = sweeps(suite);
    let mut scenes: Vec<Scene> = Vec::new();
    for scene in sweeps.iter().flat_map(|sweep| &sweep.scenes) {
        if !scenes.contains(scene) {
            scenes.push(*scene);
        }
    }
    let mut results = Vec::new();
    for (done, scene) in scenes.iter().enumerate() {
        let (width, height) = scene.size;
        let Scene { objects, lights, .. } = scene;
        let what = format!("{objects} objects, {lights} lights, {width}x{height} {:?}", scene.view);
        progress(done, scenes.len(), &what);
        results.push(measure_apart(&suite.most, scene, &what, launch)?);
    }
    let report = report::Report::new(&sweeps, &results, earlier.as_ref());
    for (name, text) in report.files()? {
        output::write_whole(&suite.folder.join(name), text.as_bytes())?;
    }
    Ok(report.slower().to_vec())
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
