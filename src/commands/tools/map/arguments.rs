//! Arguments of each map tool, and its help.

use crate::commands::common::arguments::{self, ThreadsArgs, choice, number};
use crate::output;
use crate::tools::maps::files::{self, Bits, Channel};
use crate::tools::maps::{
    Edges, Filter, HeightOptions, HorizonOptions, MapError, NormalOptions, Polish, Relief, SpecularModel,
};
use clap::Args;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

/// Scales and strengths.
const FACTORS: RangeInclusive<f32> = 0.0..=1000.0;
/// Standard deviations of a blur: beyond these it would take minutes.
const RADII: RangeInclusive<f32> = 0.0..=512.0;

/// Arguments of all tools.
#[derive(Args)]
pub struct CommonArgs {
    /// Output file: .png, or .exr for 32-bit floats; an existing file is replaced
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// Also draw a lit preview of the map, 512x512; needs a graphics adapter
    #[arg(long, value_name = "FILE.png", value_parser = arguments::png())]
    pub preview: Option<PathBuf>,
    #[command(flatten)]
    pub threads: ThreadsArgs,
}

impl CommonArgs {
    /// Before the work: sets the threads, and finds out whether all that is to be written can be, `maps` of so many
    /// `bits`, if that was said, and the preview, and is none of `inputs`.
    pub fn begin(&self, inputs: &[&Path], maps: &[&Path], bits: Option<Bits>) -> Result<(), MapError> {
        self.threads.set();
        maps.iter().try_for_each(|path| files::check_output(path, bits))?;
        let written = maps.iter().copied().chain(self.preview.as_deref());
        if let Some(path) = written.into_iter().find(|path| inputs.iter().any(|input| output::is_same(path, input))) {
            return Err(MapError::refused(path, "the output would overwrite the input; expected another name"));
        }
        let Some(preview) = &self.preview else { return Ok(()) };
        let is_preview = |path: &&Path| output::is_same(path, preview);
        if maps.iter().any(is_preview) {
            return Err(MapError::refused(preview, "expected another name for the preview than for the map"));
        }
        Ok(output::check_file(preview)?)
    }
}

/// Reading of heights, and their meaning.
#[derive(Args)]
pub struct HeightsArgs {
    /// Height map: 0 deepest, 1 highest; grey of 8 or 16 bits, or floats (.exr)
    pub height: PathBuf,
    /// Channel of a colour image that holds the heights
    #[arg(long, value_name = "CHANNEL", value_parser = choice(&Channel::ALL, Channel::help))]
    pub channel: Option<Channel>,
    /// Depth from black to white as a fraction of the image width, like height_scale_uv; texels are square
    #[arg(long, value_name = "S", default_value_t = 0.02, value_parser = number(FACTORS))]
    pub height_scale: f32,
    /// Values beyond the edges
    #[arg(long, default_value = "wrap", value_name = "EDGES", value_parser = choice(&Edges::ALL, Edges::help))]
    pub edges: Edges,
    /// Invert the heights, for maps in which white is deep
    #[arg(long)]
    pub invert: bool,
}

impl HeightsArgs {
    /// Converts to the options of the tools.
    pub fn relief(&self) -> Relief {
        Relief { height_scale: self.height_scale, edges: self.edges, invert: self.invert }
    }
}

/// Derivation of slopes from heights.
#[derive(Args)]
pub struct SlopeArgs {
    /// Derivative filter
    #[arg(long, default_value = "sobel", value_name = "FILTER", value_parser = choice(&Filter::ALL, Filter::help))]
    pub filter: Filter,
    /// Factor of all slopes
    #[arg(long, value_name = "X", default_value_t = 1.0, value_parser = number(FACTORS))]
    pub strength: f32,
    /// Green points down the image, as in DirectX; Relief and glTF expect up
    #[arg(long)]
    pub flip_green: bool,
}

impl SlopeArgs {
    /// Converts to the options of the tools.
    pub fn options(&self, relief: Relief) -> NormalOptions {
        let Self { filter, strength, flip_green } = *self;
        NormalOptions { relief, filter, strength, flip_green }
    }
}

/// `relief map normal`.
#[derive(Args)]
pub struct NormalArgs {
    #[command(flatten)]
    pub heights: HeightsArgs,
    #[command(flatten)]
    pub common: CommonArgs,
    #[command(flatten)]
    pub slopes: SlopeArgs,
    /// Bits per channel of a PNG [default: 8]
    #[arg(long, value_name = "8|16", value_parser = choice(&Bits::ALL, Bits::help))]
    pub bits: Option<Bits>,
}

pub(super) const NORMAL_HELP: &str = "\
n = normalize(-S·W·dh/dx, -S·W·dh/dy, 1), h 0..1, x right and y up in texels, W texels wide,
S the height scale: the normals of the surface that parallax, relief and displacement show for the
same map and scale. Stored as 0.5 + 0.5·n; flat is (128, 128, 255), or the like in 16 bits.

Examples:
  relief map normal rock_height.png -o rock_normal.png
  relief map normal rock_height.png -o rock_normal.png --height-scale 0.05 --preview look.png
  relief map normal terrain.exr -o terrain.png --edges clamp --filter scharr --bits 16
  relief map normal depth.png -o normal.png --invert        if white is deep

See docs/maps.md for all map tools, with formulas and limits.";

/// `relief map height`.
#[derive(Args)]
pub struct HeightArgs {
    /// Colour image; integers are sRGB, floats (.exr) linear
    pub color: PathBuf,
    #[command(flatten)]
    pub common: CommonArgs,
    /// High-pass radius in texels, to remove shading from a photograph; 0: off
    #[arg(long, value_name = "TEXELS", default_value_t = 0.0, value_parser = number(RADII))]
    pub remove_shading: f32,
    /// Blur radius in texels, against noise; 0: off
    #[arg(long, value_name = "TEXELS", default_value_t = 0.0, value_parser = number(RADII))]
    pub blur: f32,
    /// Amount of sharpening; 1 is strong
    #[arg(long, value_name = "X", default_value_t = 0.0, value_parser = number(FACTORS))]
    pub sharpen: f32,
    /// Factor of the distance from mid grey
    #[arg(long, value_name = "X", default_value_t = 1.0, value_parser = number(FACTORS))]
    pub contrast: f32,
    /// Invert: dark is high
    #[arg(long)]
    pub invert: bool,
    /// Values beyond the edges
    #[arg(long, default_value = "wrap", value_name = "EDGES", value_parser = choice(&Edges::ALL, Edges::help))]
    pub edges: Edges,
    /// Bits per channel of a PNG; 8 cause visible steps in normals [default: 16]
    #[arg(long, value_name = "8|16", value_parser = choice(&Bits::ALL, Bits::help))]
    pub bits: Option<Bits>,
}

impl HeightArgs {
    /// Converts to the options of the tool.
    pub fn options(&self) -> HeightOptions {
        let Self { remove_shading, blur, sharpen, contrast, invert, edges, .. } = *self;
        HeightOptions { remove_shading, blur, sharpen, contrast, invert, edges }
    }
}

pub(super) const HEIGHT_HELP: &str = "\
An approximation: colour is not height. The height is the linear luminance, shifted to a mean of mid
grey. It works where brightness follows shape, as with joints between bricks; a dark stone becomes a
hole. Measured or modelled heights are better (relief map bake).

Examples:
  relief map height brick.jpg -o brick_height.png --preview look.png
  relief map height rock.png -o rock_height.png --remove-shading 64 --blur 1 --contrast 2
  relief map height tiles.png -o tiles_height.png --invert     for light joints
  relief map normal brick_height.png -o brick_normal.png       the next step";

/// `relief map horizon`.
#[derive(Args)]
pub struct HorizonArgs {
    #[command(flatten)]
    pub heights: HeightsArgs,
    #[command(flatten)]
    pub common: CommonArgs,
    /// Maximum search distance in texels [default: the whole map]
    #[arg(long, value_name = "TEXELS", value_parser = arguments::whole(1..=u32::MAX))]
    pub max_distance: Option<u32>,
    /// Bits per channel of a PNG [default: 8]
    #[arg(long, value_name = "8|16", value_parser = choice(&Bits::ALL, Bits::help))]
    pub bits: Option<Bits>,
}

impl HorizonArgs {
    /// Converts to the options of the tool.
    pub fn options(&self) -> HorizonOptions {
        HorizonOptions { relief: self.heights.relief(), max_distance: self.max_distance.map(|texels| texels as usize) }
    }
}

pub(super) const HORIZON_HELP: &str = "\
Two maps, -o NAME.png for NAME_0.png and NAME_1.png. A channel is the elevation of the horizon
over a right angle, 0 level to 1 straight up, in one direction, counted from image-right toward
image-up: r, g, b, a of the first 0°, 45°, 90°, 135°; of the second 180°, 225°, 270°, 315°.
They are valid for one height scale, which must be that of the material.
With --edges clamp, there is no occluder beyond the edge.

Examples:
  relief map horizon rock_height.png -o rock_horizon.png --height-scale 0.05
  relief map horizon terrain.exr -o terrain_horizon.png --edges clamp --bits 16
A material then has: height_scale_uv: 0.05, horizon_map_0: \"rock_horizon_0.png\",
horizon_map_1: \"rock_horizon_1.png\"";

/// `relief map offset`.
#[derive(Args)]
pub struct OffsetArgs {
    #[command(flatten)]
    pub heights: HeightsArgs,
    #[command(flatten)]
    pub common: CommonArgs,
    #[command(flatten)]
    pub slopes: SlopeArgs,
}

pub(super) const OFFSET_HELP: &str = "\
(du, dv) = (-S·W·dh/dx, -S·W·dh/dy): x and y of the normal of relief map normal, before it is
normalised. Red is du, toward image-right, green dv, toward image-up: 128 is none, 1 and 255
are -1 and 1, steeper slopes too; blue is 0.

Examples:
  relief map offset ripples.png -o ripples_offset.png --height-scale 0.05 --preview look.png
A material then has: technique: perturbed_uv, offset_map: \"ripples_offset.png\"";

/// `relief map specular`.
#[derive(Args)]
pub struct SpecularArgs {
    /// Gloss or roughness map, grey
    #[arg(value_name = "MAP")]
    pub polish: PathBuf,
    /// Channel of a colour image that holds the map; glTF stores roughness in green
    #[arg(long, value_name = "CHANNEL", value_parser = choice(&Channel::ALL, Channel::help))]
    pub channel: Option<Channel>,
    /// Meaning of the map
    #[arg(long, value_name = "WHAT", value_parser = choice(&Polish::ALL, Polish::help))]
    pub from: Polish,
    /// Lighting model of the material
    #[arg(long, default_value = "phong", value_name = "MODEL")]
    #[arg(value_parser = choice(&SpecularModel::ALL, SpecularModel::help))]
    pub shading: SpecularModel,
    /// Reflectance of dielectrics at normal incidence
    #[arg(long, value_name = "F0", default_value_t = 0.04, value_parser = number(0.0f32..=1.0))]
    pub dielectric: f32,
    /// Base colour map, for metals
    #[arg(long, value_name = "COLOR", requires = "metallic")]
    pub base: Option<PathBuf>,
    /// Metallic map, 1 for metals, which reflect the base colour; blue channel of a colour image
    #[arg(long, value_name = "MAP", requires = "base")]
    pub metallic: Option<PathBuf>,
    #[command(flatten)]
    pub common: CommonArgs,
    /// Bits per channel of a PNG [default: 8]
    #[arg(long, value_name = "8|16", value_parser = choice(&Bits::ALL, Bits::help))]
    pub bits: Option<Bits>,
}

pub(super) const SPECULAR_HELP: &str = "\
rgb: specular reflectance. For phong (and Blinn) the peak of the highlight, F0/(4·α²) up to 1, with
α the roughness squared: high for glossy, low for rough surfaces. For specular_glossiness F0 alone.
F0: 0.04, or a metal's base colour. Alpha: glossiness, 1 - roughness.

Examples:
  relief map specular sword_gloss.png -o sword_specular.png --from gloss --preview look.png
  relief map specular orm.png -o s.png --from roughness --channel g --base color.png --metallic orm.png
A Phong material then has: specular_map: \"sword_specular.png\", specular_factor: (1, 1, 1)";
