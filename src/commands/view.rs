//! What several commands take: how a scene is seen and loaded, what is made of frames, what a run is kept in.

use super::arguments::{self, MOST_FRAMES, ON_OFF};
use super::progress;
use clap::builder::TypedValueParser;
use clap::{ArgAction, Args};
use relief::frames::{FrameJob, Frames, LoadOptions, OutputKind};
use relief::recording::RunFiles;
use relief::renderer::{DebugView, Occlusion, Settings};
use std::path::{Path, PathBuf};
use systems::assets::Technique;
use systems::assets::levels::LevelOfDetail;
use systems::assets::texture_memory::DEFAULT_MEGABYTES;
use systems::lights::LightPolicy;

#[derive(Args, Clone)]
pub struct ViewArgs {
    /// Pixels
    #[arg(long, default_value = "1280x720", value_name = "WxH", value_parser = arguments::parse_size)]
    pub size: (u32, u32),
    /// Camera of the scene, by name; its first if left out
    #[arg(long, value_name = "NAME")]
    pub camera: Option<String>,
    /// How objects are lit. three: by their three most relevant lights, which fade as they change, and a remainder
    /// for the others; hard: by the three alone; all: by every light that reaches them, slow, the reference
    #[arg(long, value_name = "POLICY", default_value = "three")]
    #[arg(value_parser = arguments::named("light policy", &LightPolicy::ALL))]
    pub lights: LightPolicy,
    /// Draw every material with this bump technique: off, normal, relief, … (docs/techniques.md)
    #[arg(long, value_name = "NAME", value_parser = arguments::named("technique", &Technique::ALL))]
    pub technique: Option<Technique>,
    /// Show something else than light: base, normal, tangent; light_count: how many lights reach each object, 1 blue to
    /// 64 red, none grey; three_lights: what an object's three give, as red, green and blue; error_bound: brightness
    /// that an object lit by three lights alone may miss, 0.001 blue to 10 red, nothing grey
    #[arg(long, value_name = "VIEW", default_value = "off")]
    #[arg(value_parser = arguments::named("debug view", &DebugView::ALL))]
    pub debug: DebugView,
    /// Levels of detail: on, meshes far away have fewer triangles where the difference is less than a pixel; off, every
    /// mesh as it is
    #[arg(long, value_name = "on | off", default_value = "on", value_parser = arguments::parse_levels)]
    pub levels: LevelOfDetail,
    /// Leave out objects that others hide: on, off, or auto: in a window, where there are many. The picture is the
    /// same, but which of two faces in one plane is in front may depend on the frames before
    #[arg(long, value_name = "auto | on | off", default_value = "auto")]
    #[arg(value_parser = arguments::named("choice", &Occlusion::ALL))]
    pub occlusion: Occlusion,
    /// Textures in blocks (BC7), a quarter of the memory, where that does not show; made once and kept in the cache
    #[arg(long, value_name = "on | off", default_value = "off", action = ArgAction::Set)]
    #[arg(value_parser = arguments::named("choice", &ON_OFF))]
    pub compress: bool,
    /// Neither read nor write the cache: what took long to work out of meshes and textures, for the next start
    /// (RELIEF_CACHE_DIR, else the platform's folder for caches; about 2 GiB at most)
    #[arg(long)]
    pub no_cache: bool,
    /// Most memory that textures take on the GPU; where they are larger, the largest are drawn at half their size and
    /// less
    #[arg(long, value_name = "MB", default_value_t = DEFAULT_MEGABYTES)]
    #[arg(value_parser = arguments::whole(1u64..=1 << 20))]
    pub texture_memory: u64,
    /// Worker threads; pictures are the same for any number [default: one per core]
    #[arg(long, value_name = "N", value_parser = arguments::whole(1u16..=256))]
    pub threads: Option<u16>,
}

impl ViewArgs {
    pub fn load(&self) -> LoadOptions {
        LoadOptions {
            compress: self.compress,
            cache: !self.no_cache,
            texture_bytes: self.texture_memory << 20,
            ..loading()
        }
    }

    pub fn set_threads(&self) {
        systems::set_threads(self.threads.map(usize::from));
    }

    pub fn settings(&self) -> Settings {
        Settings {
            technique: self.technique,
            debug: self.debug,
            levels: self.levels,
            occlusion: self.occlusion,
            ..Settings::default()
        }
    }
}

/// A scene for one renderer, under a bar.
pub fn loading() -> LoadOptions {
    LoadOptions { watch: Some(progress::of_loading), ..LoadOptions::for_one_renderer() }
}

/// What is made of frames.
#[derive(Args, Clone)]
pub struct PictureArgs {
    /// Kinds of pictures, separated by commas. Where a blended object hides less than half of what is behind it, depth,
    /// normal and id show that, else the object
    #[arg(long, value_delimiter = ',', default_value = "color", value_parser = output_kind())]
    pub outputs: Vec<OutputKind>,
    /// Also make a film of the colour frames, one per step of the scene's clock: with ffmpeg, or an animated picture if
    /// the name ends in .apng or .gif; where there is no ffmpeg, an .apng beside it
    #[arg(long, value_name = "FILE.mp4")]
    pub video: Option<PathBuf>,
    /// Go on after an interruption: leave frames alone whose pictures are there in that size
    #[arg(long)]
    pub resume: bool,
    /// Take the steps at the speed of the scene's clock rather than as fast as possible
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
            scene: scene.to_owned(),
            folder: folder.to_owned(),
            frames: Frames::All,
            size: view.size,
            camera: view.camera.clone(),
            outputs,
            settings: view.settings(),
            lights: view.lights,
            resume: self.resume,
            load: view.load(),
            video: self.video.clone(),
            run: RunFiles::default(),
            realtime: self.realtime,
        }
    }
}

fn output_kind() -> impl TypedValueParser<Value = OutputKind> {
    arguments::choice(&OutputKind::ALL, |kind| match kind {
        OutputKind::Color => "The tone-mapped picture, 8-bit sRGB",
        OutputKind::Depth => {
            "Distance along the viewing direction: 16-bit grey, 1/256 m per step, 0 where there is nothing or it is \
             farther than 255.99 m (the convention of the KITTI data set)"
        }
        OutputKind::Normal => "World-space shading normal, 8 bits: 0.5 + 0.5·n",
        OutputKind::Id => "Entity ids as 24-bit colour (red lowest byte), 0 for nothing; `ids.json` names them",
    })
}

/// What a run is kept in and begins from.
#[derive(Args, Clone)]
pub struct FileArgs {
    /// Write a line for each step: its number and a hash of the whole state after it
    #[arg(long, value_name = "FILE")]
    pub hash: Option<PathBuf>,
    /// Record the run, for relief replay
    #[arg(long, value_name = "FILE")]
    pub record: Option<PathBuf>,
    /// Go on from a snapshot of this scene rather than from its beginning
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
