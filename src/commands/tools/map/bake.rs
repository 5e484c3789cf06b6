//! `relief map bake` and `relief map tile`: what they take, and what they do with it.

use super::made::Made;
use crate::commands::common::arguments::{self, ThreadsArgs, choice};
use crate::name::{self, named};
use crate::output;
use crate::tools::maps::bake::{
    BakeOptions, Baked, MAX_SIDE, Reach, Role, Surface, Target, TileOptions, Wanted, bake as bake_maps, bake_tile,
    preview,
};
use crate::tools::maps::files::{self, Bits};
use crate::tools::maps::{Advance, MapError};
use clap::Args;
use glam::{Affine3A, UVec2, Vec2};
use std::num::NonZero;
use std::path::{Path, PathBuf};
use systems::assets::shapes;

named! {
    /// A map that a bake makes; its file is named after it.
    pub enum BakedMap {
        /// Tangent-space normals, green up
        Normal = "normal",
        /// Distance from the low-poly mesh, 16 bits
        Height = "height",
        /// Ambient occlusion: unoccluded share of the sky, 8 bits
        Occlusion = "occlusion",
        /// White baked, grey missed, black outside the UV charts, 8 bits
        Coverage = "coverage",
    }
}

/// Arguments of both tools.
#[derive(Args)]
pub struct CommonArgs {
    /// Output directory for normal.png, height.png, occlusion.png, created if missing; existing files are replaced
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Maps to write, separated by commas
    #[arg(long, value_delimiter = ',', default_value = "normal,height,occlusion", value_name = "MAPS")]
    #[arg(value_parser = choice(&BakedMap::ALL, BakedMap::help))]
    pub maps: Vec<BakedMap>,
    /// Rays per texel for the occlusion map: more are slower and less noisy
    #[arg(long, default_value_t = 24, value_name = "N", value_parser = arguments::whole(1u32..=65536))]
    pub rays: u32,
    /// Maximum distance of occluders [default: unlimited]
    #[arg(long, value_name = "METRES", value_parser = parse_metres)]
    pub occlusion_distance: Option<f32>,
    /// Bits per channel of the normal map [default: 8]
    #[arg(long, value_name = "8|16", value_parser = choice(&Bits::ALL, Bits::help))]
    pub bits: Option<Bits>,
    /// Also draw a lit preview of the mesh without and with the maps, 1536x768; needs a graphics adapter
    #[arg(long, value_name = "FILE.png", value_parser = arguments::png())]
    pub preview: Option<PathBuf>,
    #[command(flatten)]
    pub threads: ThreadsArgs,
}

/// `relief map bake`.
#[derive(Args)]
pub struct BakeArgs {
    /// Low-poly mesh, with UVs (.gltf, .glb)
    #[arg(value_name = "LOW")]
    pub low: PathBuf,
    /// High-poly mesh, at the same position (.gltf, .glb); may be the same file
    #[arg(value_name = "HIGH")]
    pub high: PathBuf,
    /// Size in texels, one number or WIDTHxHEIGHT
    #[arg(long, default_value = "2048", value_name = "N[xM]", value_parser = parse_texels)]
    pub size: (usize, usize),
    /// Cage distance: search so far above and below the low-poly mesh and take the first hit from above [default: 1/50
    /// of the bounding box diagonal]
    #[arg(long, value_name = "METRES", value_parser = parse_metres, conflicts_with = "max_distance")]
    pub cage: Option<f32>,
    /// Search at most so far above and below and take the nearest hit
    #[arg(long, value_name = "METRES", value_parser = parse_metres)]
    pub max_distance: Option<f32>,
    /// Dilate the UV charts by so many texels, or all
    #[arg(long, default_value = "16", value_name = "TEXELS | all", value_parser = parse_dilate)]
    pub dilate: Dilate,
    /// UV set of the maps
    #[arg(long, default_value_t = 0, value_name = "0|1", value_parser = arguments::whole(0u8..=1))]
    pub uv_set: u8,
    /// Only this node of LOW with its descendants; may be repeated
    #[arg(long, value_name = "NAME")]
    pub node: Vec<String>,
    /// Only this node of HIGH with its descendants; may be repeated
    #[arg(long, value_name = "NAME")]
    pub high_node: Vec<String>,
    #[command(flatten)]
    pub common: CommonArgs,
}

/// `relief map tile`.
#[derive(Args)]
pub struct TileArgs {
    /// Patch (.gltf, .glb), +Y up
    #[arg(value_name = "PATCH")]
    pub patch: PathBuf,
    /// Size in texels, one number or WIDTHxHEIGHT
    #[arg(long, default_value = "2048", value_name = "N[xM]", value_parser = parse_texels)]
    pub size: (usize, usize),
    /// Period of the patch along X and Z [default: the longer side of its bounding box]
    #[arg(long, value_name = "METRES", value_parser = parse_metres)]
    pub period: Option<f32>,
    /// Only this node with its descendants; may be repeated
    #[arg(long, value_name = "NAME")]
    pub node: Vec<String>,
    #[command(flatten)]
    pub common: CommonArgs,
}

/// Number of texels that are filled around charts; `None`: all.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Dilate(pub Option<usize>);

pub const BAKE_HELP: &str = "\
For each texel a ray is cast along the low-poly mesh's interpolated normal, from --cage above it to
as far below, to the front of the high-poly mesh. The normal at the hit is stored in the low-poly
mesh's tangent space (MikkTSpace, or the tangents of the file), its distance in the height map (0.5
at the low-poly mesh), its ambient occlusion in the occlusion map. Printed: missed texels, texels
covered by several triangles, height_scale_uv and height_rest for the material, rays per second.

Examples:
  relief map bake low.glb high.glb -o maps --cage 0.02 --preview look.png
  relief map bake crate.glb crate.glb -o maps --node low --high-node high --size 1024
  relief map bake low.glb high.glb -o maps --maps normal,coverage --max-distance 0.01
  relief map bake low.glb high.glb -o maps --rays 128        a smoother occlusion map
A material then has: normal_map: \"maps/normal.png\", occlusion_map: \"maps/occlusion.png\", ...";

pub const TILE_HELP: &str = "\
The patch is seen from above (-Y) in a square of one period around the centre of its bounding box; u
runs along +X, v along +Z. Geometry beyond the border wraps around to the other side, and occludes
there. Heights: black is the lowest visible point, white the highest. Holes are filled.

Examples:
  relief map tile cobbles.glb -o maps --preview look.png
  relief map tile cobbles.glb -o maps --period 2 --size 1024";

/// Runs `relief map bake`. Where it fails, no map is written, unless the preview alone could not be drawn.
pub(super) fn bake(args: &BakeArgs, advance: Advance) -> Result<Made, MapError> {
    let outputs = Outputs::begin(&args.common)?;
    let reach = args.cage.map(Reach::Cage).or(args.max_distance.map(Reach::MaxDistance));
    let options = BakeOptions { reach, dilate: args.dilate.0, ..args.common.options(args.size) };
    let low = Surface::load(&args.low, &args.node, Role::Low { uv_set: args.uv_set.into() })?;
    let high = Surface::load(&args.high, &args.high_node, Role::High)?;
    let baked = bake_maps(&low, &Target::new(&high)?, &options, advance)?;
    outputs.write(&baked, &low)
}

/// Runs `relief map tile`.
pub(super) fn tile(args: &TileArgs, advance: Advance) -> Result<Made, MapError> {
    let outputs = Outputs::begin(&args.common)?;
    let options = TileOptions { bake: args.common.options(args.size), period: args.period };
    let patch = Surface::load(&args.patch, &args.node, Role::High)?;
    let baked = bake_tile(&Target::new(&patch)?, &options, advance)?;
    // Two by two tiles, so that seams would show.
    let (width, height) = baked.report.size;
    let period = baked.report.metres_per_width.1 / (width as f32 / height as f32).sqrt();
    let plane = shapes::with_uv_scale(shapes::plane(Vec2::splat(2.0 * period), UVec2::ONE), Vec2::splat(2.0));
    let plane = Surface::of_mesh(&plane, &Affine3A::IDENTITY, Role::Low { uv_set: 0 });
    outputs.write(&baked, &plane.unwrap_or_default())
}

impl CommonArgs {
    fn wants(&self, map: BakedMap) -> bool {
        self.maps.contains(&map)
    }

    fn options(&self, size: (usize, usize)) -> BakeOptions {
        BakeOptions {
            size,
            wanted: Wanted {
                normal: self.wants(BakedMap::Normal),
                height: self.wants(BakedMap::Height),
                occlusion: self.wants(BakedMap::Occlusion),
            },
            rays: self.rays as usize,
            occlusion_distance: self.occlusion_distance.unwrap_or(f32::INFINITY),
            threads: self.threads.count().and_then(NonZero::new),
            ..BakeOptions::default()
        }
    }
}

/// Destinations of the maps. A folder that was made for them goes again if there are none.
struct Outputs<'a> {
    args: &'a CommonArgs,
    made_folder: bool,
}

impl<'a> Outputs<'a> {
    /// Finds out before the work whether all that is to be written can be.
    fn begin(args: &'a CommonArgs) -> Result<Self, MapError> {
        if args.bits.is_some() && !args.wants(BakedMap::Normal) {
            return Err(MapError::option("bits", "only valid for the normal map; expected normal among --maps"));
        }
        args.threads.set();
        let outputs = Self { args, made_folder: !args.output.exists() };
        output::make_folder(&args.output)?;
        args.maps.iter().try_for_each(|&map| files::check_output(&outputs.path(map), None))?;
        if let Some(preview) = &args.preview {
            if args.maps.iter().any(|&map| outputs.path(map) == *preview) {
                return Err(MapError::refused(preview, "expected another name for the preview than for a map"));
            }
            output::check_file(preview)?;
        }
        Ok(outputs)
    }

    fn path(&self, map: BakedMap) -> PathBuf {
        self.args.output.join(name::of(&BakedMap::ALL, map)).with_extension("png")
    }

    /// The maps, then the preview.
    fn write(self, baked: &Baked, low: &Surface) -> Result<Made, MapError> {
        let coverage = self.args.wants(BakedMap::Coverage).then(|| baked.coverage_map());
        let maps = [
            (BakedMap::Normal, &baked.normal, self.args.bits.unwrap_or_default()),
            (BakedMap::Height, &baked.height, Bits::Sixteen),
            (BakedMap::Occlusion, &baked.occlusion, Bits::Eight),
            (BakedMap::Coverage, &coverage, Bits::Eight),
        ];
        let mut written = Vec::new();
        for (map, raster, bits) in maps {
            let Some(raster) = raster else { continue };
            files::write(&self.path(map), raster, bits)?;
            written.push(self.path(map));
        }
        if let Some(path) = &self.args.preview {
            let drawn = preview(low, baked).map_err(|source| MapError::Preview { path: path.clone(), source })?;
            output::write_png(path, &drawn.into())?;
            written.push(path.clone());
        }
        Ok(Made { written, report: baked.report.to_string() })
    }
}

impl Drop for Outputs<'_> {
    fn drop(&mut self) {
        if self.made_folder {
            // Only an empty folder can be removed so.
            let _ = std::fs::remove_dir(Path::new(&self.args.output));
        }
    }
}

fn parse_texels(text: &str) -> Result<(usize, usize), String> {
    let side = |text: &str| text.parse().ok().filter(|side| (1..=MAX_SIDE).contains(side));
    let size = match text.split_once(['x', 'X', '×']) {
        Some((width, height)) => side(width).zip(side(height)),
        None => side(text).map(|side| (side, side)),
    };
    size.ok_or_else(|| format!("expected a number of texels like 1024, or two like 1024x512, each 1 to {MAX_SIDE}"))
}

fn parse_metres(text: &str) -> Result<f32, String> {
    let metres = text.parse().ok().filter(|metres: &f32| *metres > 0.0 && metres.is_finite());
    metres.ok_or_else(|| format!("expected metres above 0, like 0.05{}", arguments::pointed(text)))
}

fn parse_dilate(text: &str) -> Result<Dilate, String> {
    if text == "all" {
        return Ok(Dilate(None));
    }
    let texels = text.parse().ok().filter(|texels| *texels <= MAX_SIDE);
    texels.map(|texels| Dilate(Some(texels))).ok_or_else(|| format!("expected 0 to {MAX_SIDE} texels, or all"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_read_strictly() {
        assert_eq!((parse_texels("512"), parse_texels("64x32")), (Ok((512, 512)), Ok((64, 32))));
        assert!(["0", "0x4", "8193", "x", "-1", ""].iter().all(|bad| parse_texels(bad).is_err()));
        assert_eq!((parse_dilate("all"), parse_dilate("3")), (Ok(Dilate(None)), Ok(Dilate(Some(3)))));
        assert!(["some", "-1", "9999"].iter().all(|bad| parse_dilate(bad).is_err()));
        assert!(["0", "-1", "NaN", "inf", "x"].iter().all(|bad| parse_metres(bad).is_err()));
    }
}
