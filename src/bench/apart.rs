//! Scenes measured in a process of their own, this program again: peak memory and the time to the first frame mean
//! nothing in a process that has drawn others.

use super::args::BenchArgs;
use super::measurement::Measurement;
use super::run::BenchError;
use super::yard::YardView;
use crate::renderer::Occlusion;
use std::process::Command;
use systems::assets::Technique;
use systems::lights::LightPolicy;

/// A yard.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Scene {
    pub objects: u32,
    pub lights: u32,
    pub moving: f32,
    pub view: YardView,
    pub size: (u32, u32),
}

impl Scene {
    /// Whether the figures are of this scene.
    pub fn is_of(&self, m: &Measurement) -> bool {
        let view = format!("{:?}", self.view).to_lowercase();
        (m.objects, m.lights, m.moving, m.size) == (self.objects, self.lights, self.moving, self.size.into())
            && m.view == view
    }
}

/// What each object of a yard adds to the most memory of its process: that of the measured one less that of one that
/// draws a single object in the same way, so that driver, shaders, maps and targets do not count. `None` for a scene of
/// one's own, a single object, and where the system does not say.
///
/// # Errors
/// [`BenchError`]. It is for this program alone: others have no such command line.
pub fn bytes_per_object(args: &BenchArgs, measured: &Measurement) -> Result<Option<f64>, BenchError> {
    let (objects, Some(peak)) = (measured.objects, measured.rss_mb) else { return Ok(None) };
    if args.scene.is_some() || objects < 2 {
        return Ok(None);
    }
    let one = Scene { objects: 1, lights: args.lights(), moving: 0.0, view: args.view, size: args.size() };
    // With what is there for many objects, and nothing to be measured besides.
    let occlusion = if args.occlusion.is_on(objects) { Occlusion::On } else { Occlusion::Off };
    let args = BenchArgs { occlusion, floor: false, ..args.clone() };
    let one = measure_apart(&args, &one, (1, 4), "a single object")?;
    Ok(one.rss_mb.map(|one| (peak - one).max(0.0) * f64::from(1 << 20) / f64::from(objects - 1)))
}

/// Measures a scene in a process of its own: so many frames after so many to warm up.
pub(super) fn measure_apart(
    args: &BenchArgs,
    scene: &Scene,
    frames: (u32, u32),
    what: &str,
) -> Result<Measurement, BenchError> {
    let failed = |code, message: String| BenchError::Apart { what: what.to_owned(), message, code };
    let program = std::env::current_exe().map_err(|error| failed(1, error.to_string()))?;
    let output = Command::new(program).args(arguments(args, scene, frames)).output();
    let output = output.map_err(|error| failed(1, error.to_string()))?;
    if !output.status.success() {
        let message = String::from_utf8_lossy(&output.stderr);
        // The last: drivers have things to say, too, and say them first.
        let said = message.lines().rev().find_map(|line| line.strip_prefix("error: "));
        let message = said.unwrap_or("it stopped unexpectedly");
        return Err(failed(output.status.code().and_then(|code| u8::try_from(code).ok()).unwrap_or(1), message.into()));
    }
    serde_json::from_slice(&output.stdout).map_err(|error| failed(1, error.to_string()))
}

/// The command line that measures one scene.
fn arguments(args: &BenchArgs, scene: &Scene, (frames, warm_up): (u32, u32)) -> Vec<String> {
    let mut line = vec!["bench".to_owned(), "--json".to_owned()];
    let mut add = |name: &str, value: String| line.push(format!("--{name}={value}"));
    add("objects", scene.objects.to_string());
    add("lights", scene.lights.to_string());
    add("moving", scene.moving.to_string());
    add("view", format!("{:?}", scene.view).to_lowercase());
    add("size", format!("{}x{}", scene.size.0, scene.size.1));
    add("mesh", args.mesh.name());
    add("frames", frames.to_string());
    add("warm-up", warm_up.to_string());
    add("seconds", args.seconds().to_string());
    add("samples", args.samples.to_string());
    let on_off = |on| if on { "on" } else { "off" }.to_owned();
    add("levels", on_off(args.levels.enabled));
    add("compress", on_off(args.compress));
    add("hdr", on_off(args.hdr));
    if let Some((name, _)) = Occlusion::ALL.iter().find(|(_, occlusion)| *occlusion == args.occlusion) {
        add("occlusion", (*name).to_owned());
    }
    if let Some((name, _)) = LightPolicy::ALL.iter().find(|(_, policy)| *policy == args.lights_policy) {
        add("lights-policy", (*name).to_owned());
    }
    if let Some((name, _)) = Technique::ALL.iter().find(|(_, technique)| Some(*technique) == args.technique) {
        add("technique", (*name).to_owned());
    }
    if let Some(threads) = args.threads {
        add("threads", threads.to_string());
    }
    if args.floor {
        line.push("--floor".to_owned());
    }
    line
}
