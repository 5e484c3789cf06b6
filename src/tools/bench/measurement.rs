//! Output of `relief bench`: one scene's figures, as a line of JSON or a table.

use super::machine::Build;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;

/// The figures of one scene. Times are milliseconds; what is counted per frame is a median over the frames measured.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
#[allow(missing_docs)]
pub struct Measurement {
    /// The file, where a scene of one was measured and not a grid.
    pub scene: Option<String>,
    pub objects: u32,
    pub lights: u32,
    pub mesh: String,
    pub moving: f32,
    pub view: String,
    pub size: [u32; 2],
    pub samples: u32,
    pub lights_policy: String,
    pub technique: Option<String>,
    /// Levels of detail: meshes are drawn with fewer triangles where they are small.
    pub levels: bool,
    /// Occlusion culling: auto, on or off.
    pub occlusion: String,
    /// Lights that had a shadow map in the last frame.
    pub shadow_layers: u32,
    /// Layers of shadow maps drawn in a frame.
    pub shadow_passes_median: f64,
    /// Textures are compressed into blocks.
    pub compress: bool,
    /// Tone mapping in a pass of its own, which is always done now. Earlier programs could do without, and some said
    /// nothing of it.
    #[serde(default = "kept_linear")]
    pub hdr: bool,
    pub threads: u32,
    pub frames: u32,
    /// From the first change of an object to an idle GPU.
    pub frame_ms_median: f64,
    pub frame_ms_p05: f64,
    pub frame_ms_p95: f64,
    /// Simulation, prepare and encoding: all of the engine's work, up to handing in.
    pub cpu_ms_median: f64,
    pub cpu_ms_p05: f64,
    pub cpu_ms_p95: f64,
    /// From handing in to an idle GPU.
    pub gpu_ms_median: f64,
    pub gpu_ms_p05: f64,
    pub gpu_ms_p95: f64,
    /// The triangles in view by themselves, with the plainest shader; `None`: not asked for.
    pub floor_ms_median: Option<f64>,
    /// Light table and choice of lights.
    pub select_ms_median: f64,
    pub simulate_ms_median: f64,
    pub prepare_ms_median: f64,
    #[serde(alias = "record_ms_median")]
    pub encode_ms_median: f64,
    /// Giving the moving objects their transforms, of a file's scene a step of its clock: in the frame, not in the
    /// engine's time.
    pub mutate_ms_median: f64,
    /// Median of each stage of the simulation.
    pub stages: BTreeMap<String, f64>,
    /// Median of each system.
    pub systems: BTreeMap<String, f64>,
    /// Median of each pass by the GPU's own clock; `None` where the adapter has no timestamps.
    pub gpu_passes: Option<BTreeMap<String, f64>>,
    pub upload_bytes_median: u64,
    pub draws: u32,
    pub drawn_objects: u32,
    pub triangles: u64,
    /// Objects that were not drawn, because they are out of view or behind others.
    pub culled_objects: u32,
    /// GPU memory of textures, with all their mip levels.
    pub texture_bytes: u64,
    /// The most memory the process ever had resident, in units of 2²⁰ bytes; `None` where the system does not say.
    pub rss_mb: Option<f64>,
    /// Peak memory that each object adds: see [`super::bytes_per_object`], which finds it.
    pub bytes_per_object: Option<f64>,
    /// From the start of the program to the first frame finished.
    pub first_frame_ms: f64,
    /// Parts of that, one after the other.
    pub start_ms: BTreeMap<String, f64>,
    pub adapter: String,
    pub driver: String,
    pub build: Build,
}

/// Median and the values that 5 % of all are below and above.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Spread {
    /// 5 % are below.
    pub p05: f64,
    /// Half are below.
    pub median: f64,
    /// 5 % are above.
    pub p95: f64,
}

impl Spread {
    /// Computes the spread of some values; zeros where there are none.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Self {
        let mut sorted: Vec<f64> = values.into_iter().collect();
        sorted.sort_by(f64::total_cmp);
        let at = |share: f64| {
            // Between the two nearest ranks.
            let place = share * sorted.len().saturating_sub(1) as f64;
            let (low, high) = (sorted.get(place.floor() as usize), sorted.get(place.ceil() as usize));
            let (low, high) = (low.copied().unwrap_or_default(), high.copied().unwrap_or_default());
            low + (high - low) * place.fract()
        };
        Self { p05: at(0.05), median: at(0.5), p95: at(0.95) }
    }
}

impl Measurement {
    /// The scene in a few words.
    pub fn title(&self) -> String {
        let (Self { objects, lights, view, .. }, [width, height]) = (self, self.size);
        if let Some(scene) = &self.scene {
            return format!("{scene}: {objects} objects, {lights} lights, {view} {width}x{height}");
        }
        format!("{objects} objects, {lights} lights, {} % moving, {view} {width}x{height}", self.moving_percent())
    }

    /// Rounded, because 0.01 as a float is not quite a hundredth.
    pub fn moving_percent(&self) -> f64 {
        (f64::from(self.moving) * 1e4).round() / 1e2
    }
}

impl fmt::Display for Measurement {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        writeln!(f, "{}", self.title())?;
        let mesh = if self.scene.is_some() { String::new() } else { format!("mesh {}, ", self.mesh) };
        writeln!(f, "{mesh}{} sample(s) per pixel, lights: {}", self.samples, self.lights_policy)?;
        let levels = if self.levels { "on" } else { "off" };
        let blocks = if self.compress { "on" } else { "off" };
        let occlusion = &self.occlusion;
        writeln!(f, "levels of detail: {levels}, occlusion: {occlusion}, textures in blocks: {blocks}")?;
        if self.shadow_layers > 0 {
            let (layers, passes) = (self.shadow_layers, self.shadow_passes_median);
            writeln!(f, "{layers} shadow maps, {passes} drawn per frame")?;
        }
        writeln!(f, "{}, {}", self.adapter, self.driver)?;
        writeln!(f, "{:28}{:>10}{:>10}{:>10}", format!("ms, of {} frames", self.frames), "median", "5 %", "95 %")?;
        let mut row = |name: &str, median: f64, low: f64, high: f64| {
            writeln!(f, "{name:28}{median:>10.3}{low:>10.3}{high:>10.3}")
        };
        row("frame", self.frame_ms_median, self.frame_ms_p05, self.frame_ms_p95)?;
        row("engine (CPU)", self.cpu_ms_median, self.cpu_ms_p05, self.cpu_ms_p95)?;
        row("until the GPU is idle", self.gpu_ms_median, self.gpu_ms_p05, self.gpu_ms_p95)?;
        let moving = if self.scene.is_some() { "a step of the clock" } else { "moving the objects" };
        writeln!(f, "{moving:28}{:>10.3}", self.mutate_ms_median)?;
        if let Some(floor) = self.floor_ms_median {
            writeln!(f, "{:28}{floor:>10.3}", "floor: triangles alone")?;
        }
        let parts = [
            ("simulation", self.simulate_ms_median),
            ("prepare", self.prepare_ms_median),
            ("encode", self.encode_ms_median),
        ];
        list(f, "engine", parts.map(|(name, ms)| (name.to_owned(), ms)))?;
        list(f, "systems", by_cost(&self.systems))?;
        match &self.gpu_passes {
            Some(passes) => list(f, "GPU passes", by_cost(passes))?,
            None => writeln!(f, "GPU passes: this adapter has no timestamps")?,
        }
        writeln!(f, "first frame {:.0} ms after the start", self.first_frame_ms)?;
        list(f, "first frame", by_cost(&self.start_ms))?;
        let (drawn, culled) = (self.drawn_objects, self.culled_objects);
        let s = |count: u32| if count == 1 { "" } else { "s" };
        write!(f, "{} draw{}, {drawn} object{} drawn, {culled} culled, ", self.draws, s(self.draws), s(drawn))?;
        writeln!(f, "{} triangles", self.triangles)?;
        writeln!(f, "{} bytes uploaded per frame", self.upload_bytes_median)?;
        writeln!(f, "{:.1} MB of textures", self.texture_bytes as f64 / f64::from(1 << 20))?;
        match (self.rss_mb, self.bytes_per_object) {
            (Some(peak), Some(each)) => writeln!(f, "{peak:.0} MB of memory at most, {each:.0} bytes per object"),
            (Some(peak), None) => writeln!(f, "{peak:.0} MB of memory at most"),
            _ => writeln!(f, "memory: not reported by this system"),
        }
    }
}

/// Default of [`Measurement::hdr`] where nothing is said of it.
fn kept_linear() -> bool {
    true
}

/// Names and times, the slowest first.
fn by_cost(times: &BTreeMap<String, f64>) -> Vec<(String, f64)> {
    let mut sorted: Vec<_> = times.iter().map(|(name, ms)| (name.clone(), *ms)).collect();
    sorted.sort_by(|a, b| b.1.total_cmp(&a.1));
    sorted
}

/// One line of names and times; those that would be 0.000 are left out.
fn list(f: &mut fmt::Formatter, what: &str, times: impl IntoIterator<Item = (String, f64)>) -> fmt::Result {
    let shown = times.into_iter().filter(|(_, ms)| *ms >= 0.000_5);
    let texts: Vec<String> = shown.map(|(name, ms)| format!("{name} {ms:.3}")).collect();
    writeln!(f, "  {what}: {}", texts.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_lie_between_the_nearest_ranks() {
        assert_eq!(Spread::of((0..=100).rev().map(f64::from)), Spread { p05: 5.0, median: 50.0, p95: 95.0 });
        assert_eq!(Spread::of([1.0, 2.0]).median, 1.5);
        assert_eq!(Spread::of([3.0]), Spread { p05: 3.0, median: 3.0, p95: 3.0 });
        assert_eq!(Spread::of([]), Spread::default());
    }
}
