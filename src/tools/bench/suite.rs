//! The suite of `relief bench`: how cost grows with the objects, the lights, and the share that moves.
//!
//! Every scene is measured in a process of its own: peak memory and the time to the first frame
//! mean nothing in a process that has drawn others.

use super::job::SuiteJob;
use super::report::{self, Earlier};
use super::separate_process::{Launch, Scene, measure_apart};
use super::sweeps::sweeps;
use crate::frames;
use crate::output;
use crate::tools::error::ToolError;

/// Measures every scene of the sweeps and writes results, report and plots into the folder. `progress` is called before
/// each scene with how many are done, how many there are, and which it is. Returns what got slower than in the file
/// that was compared with, in words.
///
/// # Errors
/// [`ToolError`]; nothing is written then.
pub fn run_suite(
    suite: &SuiteJob,
    launch: Launch,
    mut progress: impl FnMut(usize, usize, &str),
) -> Result<Vec<String>, ToolError> {
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
