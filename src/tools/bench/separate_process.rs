//! Scenes measured in a process of their own, by a program that the caller starts: peak memory and the time to the
//! first frame mean nothing in a process that has drawn others.

use super::grid::{GridPlan, GridView};
use super::job::BenchJob;
use super::measurement::Measurement;
use crate::name;
use crate::renderer::Occlusion;
use crate::tools::error::ToolError;
use std::io;
use std::process::Command;

/// Makes the command that measures a grid in a process of its own. It prints the [`Measurement`] as a line of JSON, or
/// `error: ` and why not.
pub type Launch<'a> = &'a dyn Fn(&BenchJob) -> io::Result<Command>;

/// A yard.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Scene {
    pub objects: u32,
    pub lights: u32,
    pub moving: f32,
    pub view: GridView,
    pub size: (u32, u32),
}

impl Scene {
    /// Tells if the figures are of this scene.
    pub fn is_of(&self, m: &Measurement) -> bool {
        let view = name::of(&GridView::ALL, self.view);
        (m.objects, m.lights, m.moving, m.size) == (self.objects, self.lights, self.moving, self.size.into())
            && m.view == view
    }
}

/// Bytes that each object of a yard adds to the peak memory of its process. The peak of a process that draws a single
/// object in the same way is subtracted, so that driver, shaders, maps and targets do not count. `None` for a scene of
/// one's own, a single object, and where the system does not say.
///
/// # Errors
/// [`ToolError`].
pub fn bytes_per_object(job: &BenchJob, measured: &Measurement, launch: Launch) -> Result<Option<f64>, ToolError> {
    let (objects, Some(peak)) = (measured.objects, measured.rss_mb) else { return Ok(None) };
    if job.scene.is_some() || objects < 2 {
        return Ok(None);
    }
    let one = Scene { objects: 1, lights: job.plan.lights, moving: 0.0, view: job.plan.view, size: job.size };
    // With what is there for many objects, and nothing to be measured besides.
    let occlusion = if job.occlusion.is_on(objects) { Occlusion::On } else { Occlusion::Off };
    let job = BenchJob { occlusion, floor: false, frames: 1, warm_up: 4, ..job.clone() };
    let one = measure_apart(&job, &one, "a single object", launch)?;
    Ok(one.rss_mb.map(|one| (peak - one).max(0.0) * f64::from(1 << 20) / f64::from(objects - 1)))
}

/// Measures a scene in a process of its own.
pub(super) fn measure_apart(
    job: &BenchJob,
    scene: &Scene,
    what: &str,
    launch: Launch,
) -> Result<Measurement, ToolError> {
    let failed = |code, message: String| ToolError::SeparateProcess { what: what.to_owned(), message, code };
    let Scene { objects, lights, moving, view, size } = *scene;
    let (mesh, shadows) = (job.plan.mesh.clone(), job.plan.shadows);
    let plan = GridPlan { objects, lights, moving, view, mesh, shadows };
    let alone = BenchJob { plan, size, picture: None, trace: None, ..job.clone() };
    let output = launch(&alone).and_then(|mut command| command.output());
    let output = output.map_err(|error| failed(1, error.to_string()))?;
    if !output.status.success() {
        let message = String::from_utf8_lossy(&output.stderr);
        // The last: drivers have things to say, too, and say them first.
        let said = message.lines().rev().find_map(|line| line.strip_prefix("error: "));
        let message = said.unwrap_or("unexpected end of the process");
        return Err(failed(output.status.code().and_then(|code| u8::try_from(code).ok()).unwrap_or(1), message.into()));
    }
    serde_json::from_slice(&output.stdout).map_err(|error| failed(1, error.to_string()))
}
