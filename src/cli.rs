//! What the command line takes, and its help.

use clap::{ArgAction, Args, Parser, Subcommand};
use relief::arguments::{
    MOST_FRAMES, parse_levels, parse_lights, parse_occlusion, parse_on_off, parse_size, parse_speed, parse_technique,
    whole,
};
use relief::bench::BenchArgs;
use relief::frames::{Frames, LoadOptions, OutputKind};
use relief::gallery::{self, GalleryArgs};
use relief::maps::command::MapArgs;
use relief::recording::RunFiles;
use relief::renderer::{DebugView, Occlusion, Settings};
use relief::technique_error::{self, CompareArgs};
use std::path::PathBuf;
use systems::assets::Technique;
use systems::assets::levels::LevelOfDetail;
use systems::assets::texture_memory::DEFAULT_MEGABYTES;
use systems::lights::LightPolicy;

/// A simulation renderer for scenes of many bump-mapped objects, each lit by its three most relevant lights.
///
/// Without a subcommand: `relief run`.
#[derive(Parser)]
#[command(version, args_conflicts_with_subcommands = true, after_help = EXAMPLES)]
pub struct Cli {
    #[command(subcommand)]
    pub command: Option<Command>,
    #[command(flatten)]
    pub run: RunArgs,
}

pub const EXAMPLES: &str = "\
Examples:
  relief                                          the demo, in a window
  relief model.glb                                a model, with its own lights and cameras
  relief render scene.ron -o frames --frames 60   frames/color_00000.png … color_00059.png
  relief run scene.ron --record drive.rec         and relief replay drive.rec: the same run again
  relief lights scene.ron -o out                  how far three lights per object are from all lights
  relief gallery -o out                           every bump technique on four shapes
  relief compare -o out                           how far each of them is from real geometry
  relief bench --objects 100000                   what many objects cost
  relief map normal height.png -o normal.png      a normal map from a height map
  relief check scene.ron model.glb                everything that is wrong with the files

Exit codes: 0 done, 2 bad input or usage, 3 no usable graphics adapter, 1 anything else.";

#[derive(Subcommand)]
pub enum Command {
    /// Show a scene in a window; without a display, render pictures instead
    Run(RunArgs),
    /// Render frames to PNG files, without a window
    Render(RenderArgs),
    /// Show a recorded run again, in a window or as pictures
    #[command(after_help = REPLAY_HELP)]
    Replay(ReplayArgs),
    /// Say how far a frame lit by three lights per object is from one lit by all, in figures and pictures
    #[command(after_help = LIGHTS_HELP)]
    Lights(LightsArgs),
    /// Draw a scene once for each shape of its figures, and all on one sheet: every bump technique, if no scene is
    /// named
    #[command(after_help = gallery::HELP)]
    Gallery(GalleryArgs),
    /// Say how far each bump technique is from real geometry, and what it costs, in figures and pictures
    #[command(after_help = technique_error::HELP)]
    Compare(CompareArgs),
    /// Measure a grid of many bump-mapped objects under many lights, or any scene
    #[command(after_help = BENCH_HELP)]
    Bench(BenchArgs),
    /// Make normal, height, horizon and other maps from images
    Map(MapArgs),
    /// Say everything that is wrong with scenes, models and images; exit code 2 if anything is
    Check {
        /// Scenes (.ron), models (.gltf, .glb), images
        #[arg(required = true, value_name = "FILE")]
        files: Vec<PathBuf>,
    },
    /// Print the graphics adapter, its driver and limits
    Info,
}

#[derive(Args)]
pub struct RunArgs {
    /// Scene (.ron) or model (.gltf, .glb); the demo scene if left out
    pub scene: Option<PathBuf>,
    #[command(flatten)]
    pub view: ViewArgs,
    #[command(flatten)]
    pub files: FileArgs,
    /// Simulated seconds per real second, 0.1 to 100 [default: the scene's]
    #[arg(long, value_name = "X", value_parser = parse_speed)]
    pub speed: Option<f64>,
    /// Start with the clock stopped
    #[arg(long)]
    pub paused: bool,
    /// Start with the panel hidden (Tab shows it)
    #[arg(long)]
    pub no_panel: bool,
}

#[derive(Args)]
pub struct RenderArgs {
    /// Scene (.ron) or model (.gltf, .glb)
    pub scene: PathBuf,
    /// Folder for the pictures; made if missing
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// How many frames, or a range of frame numbers A..B (B not included)
    #[arg(long, default_value = "1", value_name = "N | A..B", value_parser = parse_frames)]
    pub frames: Frames,
    #[command(flatten)]
    pub pictures: PictureArgs,
    #[command(flatten)]
    pub files: FileArgs,
    /// Write a snapshot of the state after the last frame, to go on from with --from-snapshot
    #[arg(long, value_name = "FILE")]
    pub save_snapshot: Option<PathBuf>,
    #[command(flatten)]
    pub view: ViewArgs,
}

/// What is made of frames.
#[derive(Args, Clone)]
pub struct PictureArgs {
    /// Kinds of pictures, separated by commas. Where a blended object hides less than half of what is behind it, depth,
    /// normal and id show that, else the object
    #[arg(long, value_enum, value_delimiter = ',', default_value = "color")]
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

pub const REPLAY_HELP: &str = "\
Examples:
  relief replay drive.rec                               in a window
  relief replay drive.rec --from 3600                   from step 3600 on
  relief replay drive.rec -o frames --frames 600..660   ten seconds in, a second of pictures
  relief replay drive.rec --check                       no pictures: does every step come out as recorded?

docs/simulation.md says what a recording holds.";

#[derive(Args)]
pub struct ReplayArgs {
    /// A recording, by relief run --record or relief render --record
    pub recording: PathBuf,
    /// Folder for pictures, made if missing; without it, a window
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,
    /// Which frames [default: all]
    #[arg(long, value_name = "N | A..B", value_parser = parse_frames, requires = "output")]
    pub frames: Option<Frames>,
    #[command(flatten)]
    pub pictures: PictureArgs,
    /// Take the steps without drawing anything, and compare them with what was recorded
    #[arg(long, conflicts_with = "output")]
    pub check: bool,
    /// The step that the window, or the check, begins after [default: the first]
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = whole(0..=MOST_FRAMES))]
    #[arg(conflicts_with = "output")]
    pub from: u64,
    /// The scene, if it is no longer where it was
    #[arg(long, value_name = "FILE")]
    pub scene: Option<PathBuf>,
    /// Write a line for each step: its number and a hash of the whole state after it
    #[arg(long, value_name = "FILE")]
    pub hash: Option<PathBuf>,
    /// Start with the clock stopped
    #[arg(long)]
    pub paused: bool,
    /// Start with the panel hidden (Tab shows it)
    #[arg(long)]
    pub no_panel: bool,
    #[command(flatten)]
    pub view: ViewArgs,
}

#[derive(Args)]
pub struct LightsArgs {
    /// Scene (.ron) or model (.gltf, .glb)
    pub scene: PathBuf,
    /// Folder for the pictures; made if missing
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Which frame: steps of the scene's clock before the picture
    #[arg(long, default_value_t = 0, value_name = "N", value_parser = whole(0..=MOST_FRAMES - 1))]
    pub frame: u64,
    /// Pixels; 16 million at the most
    #[arg(long, default_value = "1280x720", value_name = "WxH", value_parser = parse_size)]
    pub size: (u32, u32),
    /// Camera of the scene, by name; its first if left out
    #[arg(long, value_name = "NAME")]
    pub camera: Option<String>,
    /// Draw every material with this bump technique: off, normal, relief, … (docs/techniques.md)
    #[arg(long, value_name = "NAME", value_parser = parse_technique)]
    pub technique: Option<Technique>,
    /// Worker threads; pictures are the same for any number [default: one per core]
    #[arg(long, value_name = "N", value_parser = whole(1u16..=256))]
    pub threads: Option<u16>,
    /// Print one line of JSON rather than a table
    #[arg(long)]
    pub json: bool,
}

pub const LIGHTS_HELP: &str = "\
The frame is drawn with --lights all (the reference), three and hard. L: linear luminance.
  mean   over pixels that show objects, the mean of |L - L_all|, over the mean of L_all there
  p99    99 % of those pixels have |L - L_all| / mean L_all of at most this
  FLIP   what a viewer notices who flips between the pictures: 0 nothing to 1

Files: all.png, three.png, hard.png as relief render writes them; three_error.png, hard_error.png:
|L - L_all| / mean L_all of each pixel, from 0 black over violet and orange to 1 and more pale
yellow, the same scale in both. docs/lights.md has the definitions in full.";

pub const BENCH_HELP: &str = "\
The scene: equal objects 3 m apart on a square grid, in 16 materials with base, normal and specular
maps of their own, under coloured point lights; the same for the same arguments. No shadows; colours
above 1 are cut. Each frame is drawn until the GPU is idle.
  frame   from the first change of an object until the GPU is idle
  engine  the CPU's work on that: simulation, uploads, recording; not the driver's, nor the moving
  GPU     from handing the commands in until it is idle, and for each pass by its own clock

Examples:
  relief bench --objects 100000 --size 64x36             the engine's cost of many objects
  relief bench --objects 100000 --moving 1 --json        all of them moving, as one line of JSON
  relief bench --view inside --picture yard.png          what it looks like
  relief bench --scene town.ron --camera \"chase car 7\"   a scene of yours, a step of its clock per frame
  relief bench --trace frames.json                       open it in chrome://tracing
  relief bench --suite -o before                         everything, with a report (minutes)
  relief bench --suite -o after --compare before/results.jsonl

docs/benchmarks.md says what other engines take for the same scenes.";

#[derive(Args, Clone)]
pub struct ViewArgs {
    /// Pixels
    #[arg(long, default_value = "1280x720", value_name = "WxH", value_parser = parse_size)]
    pub size: (u32, u32),
    /// Camera of the scene, by name; its first if left out
    #[arg(long, value_name = "NAME")]
    pub camera: Option<String>,
    /// How objects are lit. three: by their three most relevant lights, which fade as they change, and a remainder
    /// for the others; hard: by the three alone; all: by every light that reaches them, slow, the reference
    #[arg(long, value_name = "POLICY", default_value = "three", value_parser = parse_lights)]
    pub lights: LightPolicy,
    /// Draw every material with this bump technique: off, normal, relief, … (docs/techniques.md)
    #[arg(long, value_name = "NAME", value_parser = parse_technique)]
    pub technique: Option<Technique>,
    /// Show something else than light: base, normal, tangent; light_count: how many lights reach each object, 1 blue to
    /// 64 red, none grey; three_lights: what an object's three give, as red, green and blue; error_bound: brightness
    /// that an object lit by three lights alone may miss, 0.001 blue to 10 red, nothing grey
    #[arg(long, value_name = "VIEW", default_value = "off", value_parser = parse_debug)]
    pub debug: DebugView,
    /// Levels of detail: on, meshes far away have fewer triangles where the difference is less than a pixel; off, every
    /// mesh as it is
    #[arg(long, value_name = "on | off", default_value = "on", value_parser = parse_levels)]
    pub levels: LevelOfDetail,
    /// Leave out objects that others hide: on, off, or auto: in a window, where there are many. The picture is the
    /// same, but which of two faces in one plane is in front may depend on the frames before
    #[arg(long, value_name = "auto | on | off", default_value = "auto", value_parser = parse_occlusion)]
    pub occlusion: Occlusion,
    /// Textures in blocks (BC7), a quarter of the memory, where that does not show; made once and kept in the cache
    #[arg(long, value_name = "on | off", default_value = "off", action = ArgAction::Set, value_parser = parse_on_off)]
    pub compress: bool,
    /// Neither read nor write the cache: what took long to work out of meshes and textures, for the next start
    /// (RELIEF_CACHE_DIR, else the platform's folder for caches; about 2 GiB at most)
    #[arg(long)]
    pub no_cache: bool,
    /// Most memory that textures take on the GPU; where they are larger, the largest are drawn at half their size and
    /// less
    #[arg(long, value_name = "MB", default_value_t = DEFAULT_MEGABYTES, value_parser = whole(1u64..=1 << 20))]
    pub texture_memory: u64,
    /// Worker threads; pictures are the same for any number [default: one per core]
    #[arg(long, value_name = "N", value_parser = whole(1u16..=256))]
    pub threads: Option<u16>,
}

impl ViewArgs {
    pub fn load(&self) -> LoadOptions {
        LoadOptions {
            compress: self.compress,
            cache: !self.no_cache,
            texture_bytes: self.texture_memory << 20,
            ..LoadOptions::for_one_renderer()
        }
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

pub fn parse_debug(text: &str) -> Result<DebugView, String> {
    relief::name::find("debug view", &DebugView::ALL, text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        use clap::CommandFactory;
        Cli::command().debug_assert();
    }

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
