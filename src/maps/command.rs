//! `relief map`: the arguments of each tool, and what is done with them.
//!
//! Every tool goes the same way: outputs are tried before the work, inputs are read, the map is made and written, and
//! only then is the preview drawn, so that a map is not lost to a missing graphics adapter.

use super::files::{self, Bits, Channel};
use super::preview::{self, Shape};
use super::{Edges, Filter, MapError, NormalOptions, Raster, Relief, normal_from_height};
use clap::{Args, Subcommand};
use std::path::{Path, PathBuf};
use systems::images::ImageKind;
use systems::library::{Material, Technique};

/// Which map to make.
#[derive(Args, Clone, Debug)]
#[command(arg_required_else_help = true)]
pub struct MapArgs {
    /// The tool.
    #[command(subcommand)]
    pub tool: MapTool,
}

/// The map tools.
#[derive(Subcommand, Clone, Debug)]
pub enum MapTool {
    /// Height map to tangent-space normal map
    #[command(after_help = NORMAL_HELP)]
    Normal(NormalArgs),
}

/// What every tool takes.
#[derive(Args, Clone, Debug)]
pub struct CommonArgs {
    /// The map to write: .png, or .exr for 32-bit floats; what is there is replaced
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// Also draw the map lit, 512x512; needs a graphics adapter
    #[arg(long, value_name = "FILE.png")]
    pub preview: Option<PathBuf>,
    /// Worker threads; the map is the same for any number [default: one per core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256))]
    pub threads: Option<u16>,
}

impl CommonArgs {
    /// Whether all that is to be written can be: `maps` and the preview.
    ///
    /// # Errors
    /// [`MapError::Refused`], [`MapError::Output`].
    pub fn check_outputs(&self, maps: &[&Path]) -> Result<(), MapError> {
        maps.iter().try_for_each(|path| files::check_output(path))?;
        let Some(preview) = &self.preview else { return Ok(()) };
        if preview.extension().is_none_or(|ending| !ending.eq_ignore_ascii_case("png")) {
            return Err(MapError::refused(preview, "previews are PNG; expected a name that ends in .png"));
        }
        if maps.contains(&preview.as_path()) {
            return Err(MapError::refused(preview, "expected another name for the preview than for the map"));
        }
        Ok(crate::output::check_file(preview)?)
    }
}

/// How heights are read and understood.
#[derive(Args, Clone, Debug)]
pub struct HeightArgs {
    /// Height map: 0 deepest, 1 highest; grey of 8 or 16 bits, or floats (.exr)
    pub height: PathBuf,
    /// Which channel of a colour image holds the heights
    #[arg(long, value_enum, value_name = "CHANNEL")]
    pub channel: Option<Channel>,
    /// Depth from black to white in widths of the image, as a material's height_scale_uv; texels are square
    #[arg(long, value_name = "S", default_value_t = 0.02, value_parser = parse_factor)]
    pub height_scale: f32,
    /// Beyond the edges: wrap, the map again, as on a tile; clamp, the edge's texel
    #[arg(long, value_enum, default_value_t, value_name = "wrap|clamp")]
    pub edges: Edges,
    /// Dents for bumps
    #[arg(long)]
    pub invert: bool,
}

impl HeightArgs {
    fn relief(&self) -> Relief {
        Relief { height_scale: self.height_scale, edges: self.edges, invert: self.invert }
    }
}

/// `relief map normal`.
#[derive(Args, Clone, Debug)]
pub struct NormalArgs {
    #[command(flatten)]
    /// Heights.
    pub heights: HeightArgs,
    #[command(flatten)]
    /// Outputs.
    pub common: CommonArgs,
    /// How differences of neighbouring heights are taken
    #[arg(long, value_enum, default_value_t, value_name = "FILTER")]
    pub filter: Filter,
    /// Times every slope: 1, as the heights say; 2, twice as steep
    #[arg(long, value_name = "X", default_value_t = 1.0, value_parser = parse_factor)]
    pub strength: f32,
    /// Green toward image-down, for programs that read it so; Relief and glTF read it up
    #[arg(long)]
    pub flip_green: bool,
    /// Bits of a PNG's values
    #[arg(long, value_enum, default_value_t, value_name = "8|16")]
    pub bits: Bits,
}

const NORMAL_HELP: &str = "\
n = normalize(-S·W·dh/dx, -S·W·dh/dy, 1), h 0..1, x right and y up in texels, W texels wide,
S the height scale: the normals of the surface that the same map and scale give by parallax,
relief or displacement. Written as 0.5 + 0.5·n; flat is (128, 128, 255), or the like in 16 bits.

Examples:
  relief map normal rock_height.png -o rock_normal.png
  relief map normal rock_height.png -o rock_normal.png --height-scale 0.05 --preview look.png
  relief map normal terrain.exr -o terrain.png --edges clamp --filter scharr --bits 16
  relief map normal depth.png -o normal.png --invert        where white is deep

docs/maps.md has all map tools, with formulas and limits.";

/// How far a tool is: rows done, of how many.
pub type Advance<'a> = &'a (dyn Fn(usize, usize) + Sync);

/// Makes a map; returns the files written.
///
/// # Errors
/// [`MapError`]. No map is half-written; where only the preview could not be drawn, the map is there.
pub fn run(args: &MapArgs, advance: Advance) -> Result<Vec<PathBuf>, MapError> {
    match &args.tool {
        MapTool::Normal(args) => normal(args, advance),
    }
}

fn set_threads(common: &CommonArgs) {
    systems::set_threads(common.threads.map(usize::from));
}

fn normal(args: &NormalArgs, advance: Advance) -> Result<Vec<PathBuf>, MapError> {
    let common = &args.common;
    set_threads(common);
    common.check_outputs(&[&common.output])?;
    let heights = files::read_grey(&args.heights.height, args.heights.channel)?;
    let relief = args.heights.relief();
    let options = NormalOptions { relief, filter: args.filter, strength: args.strength, flip_green: args.flip_green };
    let map = normal_from_height(&heights, &options, &|rows| advance(rows, heights.height));
    files::write(&common.output, &map, args.bits)?;
    finish(common, Shape::plane_of(&map), |library| {
        let map = if args.flip_green { green_up(&map) } else { map };
        let map = preview::add_map(library, "normal", ImageKind::Normal, &map, args.bits);
        Material { technique: Technique::Normal, normal_map: Some(map), ..clay() }
    })
}

/// The preview, if one is wanted; and the list of what was written.
fn finish(
    common: &CommonArgs,
    shape: Shape,
    material: impl FnOnce(&mut systems::library::Library) -> Material,
) -> Result<Vec<PathBuf>, MapError> {
    let mut written = vec![common.output.clone()];
    if let Some(path) = &common.preview {
        preview::write(path, shape, material)?;
        written.push(path.clone());
    }
    Ok(written)
}

/// A dull surface, so that light shows the bumps and nothing else.
fn clay() -> Material {
    Material {
        base_factor: glam::Vec4::new(0.6, 0.55, 0.5, 1.0),
        specular_factor: glam::Vec3::splat(0.08),
        ..Material::default()
    }
}

fn green_up(map: &Raster) -> Raster {
    let mut map = map.clone();
    map.values.chunks_exact_mut(3).for_each(|texel| texel[1] = 1.0 - texel[1]);
    map
}

/// A scale or strength.
///
/// # Errors
/// What was expected.
pub fn parse_factor(text: &str) -> Result<f32, String> {
    let factor = text.parse().ok().filter(|factor| (0.0..=1000.0).contains(factor));
    factor.ok_or_else(|| "expected a number from 0 to 1000".to_owned())
}
