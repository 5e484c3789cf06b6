//! Arguments that several commands share: view and loading of a scene, outputs of frames, files of a run.

use crate::commands::common::arguments::{self, MOST_FRAMES, ON_OFF, ThreadsArgs};
use crate::commands::common::progress;
use crate::frames::{FrameJob, Frames, OutputKind, RunJob};
use crate::recording::RunFiles;
use crate::renderer::{DebugView, Occlusion, Settings};
use crate::scene::weather_preset;
use crate::session::LoadOptions;
use clap::builder::TypedValueParser;
use clap::{ArgAction, Args};
use std::path::{Path, PathBuf};
use systems::assets::Technique;
use systems::assets::levels::LevelOfDetail;
use systems::assets::texture_memory::DEFAULT_MEGABYTES;
use systems::lights::LightPolicy;
use systems::weather::{PRESETS, Weather};

const LIGHTS_HELP: &str = "Light all objects by one policy instead of the scene's. ";
const DEBUG_HELP: &str = "Draw a debug view instead of the shaded picture: ";

#[derive(Args, Clone)]
pub struct ViewArgs {
    /// Size of the picture, or of the window, in pixels
    #[arg(long, default_value = "1280x720", value_name = "WxH", value_parser = arguments::parse_size)]
    pub size: (u32, u32),
    /// Name of the camera, or "chase NAME" or "driver NAME" of a vehicle [default: the first camera]
    #[arg(long, value_name = "NAME")]
    pub camera: Option<String>,
    #[arg(long, value_name = "POLICY")]
    #[arg(help = arguments::listed(LIGHTS_HELP, &LightPolicy::ALL, LightPolicy::lights_by))]
    #[arg(value_parser = arguments::named("light policy", &LightPolicy::ALL))]
    pub lights: Option<LightPolicy>,
    /// Override the bump technique of all materials: off, normal, relief, … (docs/techniques.md)
    #[arg(long, value_name = "NAME", value_parser = arguments::named("technique", &Technique::ALL))]
    pub technique: Option<Technique>,
    #[arg(long, value_name = "VIEW", default_value = "off")]
    #[arg(help = arguments::listed(DEBUG_HELP, &DebugView::ALL[1..], DebugView::shows))]
    #[arg(value_parser = arguments::named("debug view", &DebugView::ALL))]
    pub debug: DebugView,
    /// Levels of detail. on: distant meshes have fewer triangles where the error is below one pixel; off: full meshes,
    /// as cameras that are sensors always draw them, but for those of colours alone
    #[arg(long, value_name = "on | off", default_value = "on", value_parser = arguments::parse_levels)]
    pub levels: LevelOfDetail,
    /// Occlusion culling: on, off, or auto (on in a window with many objects). The picture is the same, except that
    /// the order of coplanar faces may depend on earlier frames
    #[arg(long, value_name = "auto | on | off", default_value = "auto")]
    #[arg(value_parser = arguments::named("value", &Occlusion::ALL))]
    pub occlusion: Occlusion,
    /// Samples per pixel of the picture: 4, or 1 without antialiasing. With 1, all outputs of opaque objects are drawn
    /// in one pass
    #[arg(long, default_value = "4", value_name = "1|4", value_parser = arguments::parse_samples)]
    pub samples: u32,
    /// Specular antialiasing: wider highlights where a pixel shows many normals, of bumps far away or of curved meshes
    #[arg(long, value_name = "on | off", default_value = "on", action = ArgAction::Set)]
    #[arg(value_parser = arguments::named("value", &ON_OFF))]
    pub specular_aa: bool,
    /// Point lights and spots that may have a shadow map at once, the most important ones of those that cast shadows,
    /// beside the four brightest directional lights; 0: no shadows
    #[arg(long, value_name = "K", default_value_t = Settings::default().shadow_maps)]
    #[arg(value_parser = arguments::whole(0u32..=Settings::MOST_SHADOW_MAPS))]
    pub shadows: u32,
    /// Compress textures to BC7, a quarter of the memory, where no loss is visible; kept in the cache
    #[arg(long, value_name = "on | off", default_value = "off", action = ArgAction::Set)]
    #[arg(value_parser = arguments::named("value", &ON_OFF))]
    pub compress: bool,
    /// Neither read nor write the cache of processed meshes and textures (RELIEF_CACHE_DIR, else the platform's cache
    /// directory; about 2 GiB at most)
    #[arg(long)]
    pub no_cache: bool,
    /// GPU memory limit for textures; above it, the largest textures are halved until they fit
    #[arg(long, value_name = "MB", default_value_t = DEFAULT_MEGABYTES)]
    #[arg(value_parser = arguments::whole(1u64..=1 << 20))]
    pub texture_memory: u64,
    #[arg(long, value_name = "NAME", value_parser = weather_preset)]
    #[arg(help = arguments::one_of("Weather in place of the scene's: ", PRESETS.map(|preset| preset.name)))]
    pub weather: Option<Weather>,
    #[command(flatten)]
    pub threads: ThreadsArgs,
}

impl ViewArgs {
    pub fn load(&self) -> LoadOptions {
        LoadOptions {
            compress: self.compress,
            cache: !self.no_cache,
            texture_bytes: self.texture_memory << 20,
            weather: self.weather.clone(),
            ..loading()
        }
    }

    /// All of a recording, else the first frame of a scene.
    pub fn run(&self, scene: &Path) -> RunJob {
        RunJob {
            frames: Frames::All,
            settings: self.settings(),
            lights: self.lights,
            load: self.load(),
            ..RunJob::new(scene)
        }
    }

    pub fn set_threads(&self) {
        self.threads.set();
    }

    pub fn settings(&self) -> Settings {
        Settings {
            technique: self.technique,
            debug: self.debug,
            levels: self.levels,
            occlusion: self.occlusion,
            samples: self.samples,
            specular_aa: self.specular_aa,
            shadow_maps: self.shadows,
            ..Settings::default()
        }
    }
}

/// A scene for one renderer, under a bar.
pub fn loading() -> LoadOptions {
    LoadOptions { watch: Some(progress::of_loading), ..LoadOptions::for_one_renderer() }
}

/// Outputs of frames.
#[derive(Args, Clone)]
pub struct PictureArgs {
    /// Outputs, separated by commas. Depth, normal and id show a blended object where its opacity is at least one half,
    /// else the surface behind it
    #[arg(long, value_delimiter = ',', default_value = "color", value_parser = output_kind())]
    pub outputs: Vec<OutputKind>,
    /// Also encode the colour frames as a video, one per simulation step: with ffmpeg, or as an animated picture if the
    /// name ends in .apng or .gif; without ffmpeg, an .apng is written instead
    #[arg(long, value_name = "FILE.mp4")]
    pub video: Option<PathBuf>,
    /// Resume after an interruption: skip frames whose pictures exist in that size, and captures of sensors whose files
    /// exist
    #[arg(long)]
    pub resume: bool,
    /// Run at the speed of the simulation clock instead of as fast as possible
    #[arg(long)]
    pub realtime: bool,
}

impl PictureArgs {
    /// The first frame of a scene.
    pub fn job(&self, scene: &Path, folder: &Path, view: &ViewArgs) -> FrameJob {
        let mut outputs = self.outputs.clone();
        if self.video.is_some() && !outputs.contains(&OutputKind::Color) {
            outputs.push(OutputKind::Color);
        }
        FrameJob {
            run: RunJob { realtime: self.realtime, ..view.run(scene) },
            folder: folder.to_owned(),
            size: view.size,
            camera: view.camera.clone(),
            outputs,
            resume: self.resume,
            video: self.video.clone(),
        }
    }
}

fn output_kind() -> impl TypedValueParser<Value = OutputKind> {
    arguments::choice(&OutputKind::ALL, |kind| match kind {
        OutputKind::Color => "The tone-mapped picture, 8-bit sRGB",
        OutputKind::Depth => {
            "Distance along the viewing direction: 16-bit grey, 1/256 m per unit, 0 for the background and beyond \
             255.99 m (as in the KITTI data set)"
        }
        OutputKind::Normal => "World-space shading normal, 8 bits: 0.5 + 0.5·n",
        OutputKind::Id => "Entity ids as 24-bit colour (red lowest byte), 0 for the background; names in `ids.json`",
    })
}

/// Files that a run is kept in and begins from.
#[derive(Args, Clone)]
pub struct FileArgs {
    /// Write the step number and a hash of the whole state after each step, one line per step
    #[arg(long, value_name = "FILE")]
    pub hash: Option<PathBuf>,
    /// Record the run, for relief replay
    #[arg(long, value_name = "FILE")]
    pub record: Option<PathBuf>,
    /// Start from a snapshot of this scene instead of its initial state
    #[arg(long, value_name = "FILE")]
    pub from_snapshot: Option<PathBuf>,
}

impl FileArgs {
    pub fn run_files(&self) -> RunFiles {
        let Self { hash, record, from_snapshot } = self.clone();
        RunFiles { hash, record, from_snapshot, ..RunFiles::default() }
    }
}

pub fn parse_frames(text: &str) -> Result<Frames, String> {
    let number = |text: &str| text.parse::<u64>().ok().filter(|number| *number <= MOST_FRAMES);
    let frames = match text.split_once("..") {
        Some((first, end)) => match number(first).zip(number(end)) {
            Some((first, end)) if first > end => {
                return Err(format!("the range runs backward; expected {end}..{first}"));
            }
            Some((first, end)) if first == end => {
                return Err(format!("the range is empty, since {end} is not in it; expected {first}..{}", end + 1));
            }
            range => range.map(|(first, end)| Frames::Range(first..end)),
        },
        None => number(text).filter(|count| *count > 0).map(Frames::First),
    };
    frames.ok_or_else(|| {
        let expected = format!("expected a count like 60, or a range like 30..60, ending at {MOST_FRAMES} at the most");
        // As others write ranges.
        let apart = ["..=", "-", ":", ","].iter().find_map(|dash| text.split_once(dash));
        match apart.and_then(|(first, last)| number(first).zip(number(last))).filter(|(first, last)| first <= last) {
            Some((first, last)) => format!("{expected}; {first}..{} is from {first} to {last}", last + 1),
            None => expected,
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_read_strictly() {
        assert_eq!(parse_frames("60"), Ok(Frames::First(60)));
        assert_eq!(parse_frames("30..60"), Ok(Frames::Range(30..60)));
        for bad in ["", "0", "5..5", "6..5", "-1", "a..b", "99999999999", "1,5", "3-9", "3..=9"] {
            assert!(parse_frames(bad).is_err(), "{bad}");
        }
        let refusal = |text| parse_frames(text).expect_err("refused");
        assert_eq!(refusal("9..3"), "the range runs backward; expected 3..9");
        assert_eq!(refusal("5..5"), "the range is empty, since 5 is not in it; expected 5..6");
        assert!(
            refusal("3..=9").ends_with("; 3..10 is from 3 to 9") && refusal("3-9").ends_with("; 3..10 is from 3 to 9")
        );
    }
}
