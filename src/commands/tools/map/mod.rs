//! `relief map`: what is done with the arguments of each tool.
//!
//! Every tool goes the same way: outputs are tried before the work, inputs are read, the map is made and written, and
//! only then is the preview drawn, so that a map is not lost to a missing graphics adapter.

mod arguments;
mod bake;
mod made;

use crate::commands::common::failure::{Failure, say};
use crate::commands::common::progress;
use crate::tools::maps::files::{self, Bits, Channel};
use crate::tools::maps::preview::{self, Shape, add_map};
use crate::tools::maps::{
    Advance, MapError, NormalOptions, Raster, SpecularModel, SpecularOptions, height_from_color, horizon_from_height,
    normal_from_height, offset_from_height, specular_from,
};
use arguments::{CommonArgs, HeightArgs, HorizonArgs, NormalArgs, OffsetArgs, SpecularArgs};
use arguments::{HEIGHT_HELP, HORIZON_HELP, NORMAL_HELP, OFFSET_HELP, SPECULAR_HELP};
use bake::{BAKE_HELP, BakeArgs, TILE_HELP, TileArgs};
use clap::{Args, Subcommand};
use glam::{Vec3, Vec4};
use made::Made;
use std::path::{Path, PathBuf};
use systems::assets::{ImageKind, Library, Material, Shading, Technique};

#[derive(Args)]
#[command(arg_required_else_help = true)]
pub struct MapArgs {
    #[command(subcommand)]
    pub tool: MapTool,
}

#[derive(Subcommand)]
pub enum MapTool {
    /// Height map to tangent-space normal map
    #[command(after_help = NORMAL_HELP)]
    Normal(NormalArgs),
    /// Colour image to height map (approximation)
    #[command(after_help = HEIGHT_HELP)]
    Height(HeightArgs),
    /// Height map to two horizon maps, for self-shadowing
    #[command(after_help = HORIZON_HELP)]
    Horizon(HorizonArgs),
    /// Height map to offset map (du, dv), for perturbed reflections
    #[command(after_help = OFFSET_HELP)]
    Offset(OffsetArgs),
    /// Gloss or roughness map to specular map
    #[command(after_help = SPECULAR_HELP)]
    Specular(SpecularArgs),
    /// Bake the detail of a high-poly mesh into normal, height and occlusion maps of a low-poly mesh
    #[command(after_help = BAKE_HELP)]
    Bake(BakeArgs),
    /// Bake a repeating patch of geometry, seen from above, into tileable maps
    #[command(after_help = TILE_HELP)]
    Tile(TileArgs),
}

pub fn run(args: &MapArgs) -> Result<(), Failure> {
    let bar = progress::bar("{bar:40} {percent} %  {eta} left");
    let made = make(args, &|done, of| progress::show(&bar, done as u64, of as u64))?;
    bar.finish_and_clear();
    made.report.lines().try_for_each(say)?;
    Ok(made.written.iter().try_for_each(|path| say(&path.display().to_string()))?)
}

/// Makes a map. None is half-written; where only the preview could not be drawn, the map is there.
fn make(args: &MapArgs, advance: Advance) -> Result<Made, MapError> {
    let written = match &args.tool {
        MapTool::Normal(args) => normal(args, advance),
        MapTool::Height(args) => height(args, advance),
        MapTool::Horizon(args) => horizon(args, advance),
        MapTool::Offset(args) => offset(args, advance),
        MapTool::Specular(args) => specular(args, advance),
        MapTool::Bake(args) => return bake::bake(args, advance),
        MapTool::Tile(args) => return bake::tile(args, advance),
    };
    written.map(Made::from)
}

fn normal(args: &NormalArgs, advance: Advance) -> Result<Vec<PathBuf>, MapError> {
    let common = &args.common;
    common.begin(&[&args.heights.height], &[&common.output], args.bits)?;
    let bits = args.bits.unwrap_or(Bits::Eight);
    let heights = files::read_grey(&args.heights.height, args.heights.channel)?;
    let options = args.slopes.options(args.heights.relief());
    let map = normal_from_height(&heights, &options, advance);
    files::write(&common.output, &map, bits)?;
    finish(common, vec![common.output.clone()], Shape::plane_of(&map), |library| {
        let map = if options.flip_green { green_up(map) } else { map };
        let normal_map = Some(add_map(library, "normal", ImageKind::Normal, &map, bits));
        Material { normal_map, ..clay() }
    })
}

fn height(args: &HeightArgs, advance: Advance) -> Result<Vec<PathBuf>, MapError> {
    let common = &args.common;
    common.begin(&[&args.color], &[&common.output], args.bits)?;
    let bits = args.bits.unwrap_or(Bits::Sixteen);
    let color = files::read_color(&args.color)?;
    let map = height_from_color(&color, &args.options(), advance);
    files::write(&common.output, &map, bits)?;
    finish(common, vec![common.output.clone()], Shape::plane_of(&map), |library| {
        let height_map = Some(add_map(library, "height", ImageKind::Height, &map, bits));
        let base_map = Some(add_map(library, "color", ImageKind::Color, &color, Bits::Sixteen));
        let technique = Technique::PerturbedNormal;
        Material { technique, height_map, base_map, base_factor: Vec4::ONE, ..clay() }
    })
}

fn horizon(args: &HorizonArgs, advance: Advance) -> Result<Vec<PathBuf>, MapError> {
    let common = &args.common;
    let paths = [numbered(&common.output, 0), numbered(&common.output, 1)];
    common.begin(&[&args.heights.height], &[&paths[0], &paths[1]], args.bits)?;
    let bits = args.bits.unwrap_or(Bits::Eight);
    let heights = files::read_grey(&args.heights.height, args.heights.channel)?;
    let options = args.options();
    let maps = horizon_from_height(&heights, &options, advance);
    for (path, map) in paths.iter().zip(&maps) {
        files::write(path, map, bits)?;
    }
    finish(common, paths.into(), Shape::plane_of(&heights), |library| {
        let slopes = NormalOptions { relief: options.relief, ..NormalOptions::default() };
        let normal = normal_from_height(&heights, &slopes, &|_, _| {});
        let normal_map = Some(add_map(library, "normal", ImageKind::Normal, &normal, Bits::Sixteen));
        let horizon_maps = maps.map(|map| Some(add_map(library, "horizon", ImageKind::Data, &map, bits)));
        let height_scale_uv = args.heights.height_scale;
        Material { technique: Technique::Horizon, normal_map, horizon_maps, height_scale_uv, ..clay() }
    })
}

fn offset(args: &OffsetArgs, advance: Advance) -> Result<Vec<PathBuf>, MapError> {
    let common = &args.common;
    common.begin(&[&args.heights.height], &[&common.output], None)?;
    let heights = files::read_grey(&args.heights.height, args.heights.channel)?;
    let options = args.slopes.options(args.heights.relief());
    let map = offset_from_height(&heights, &options, advance);
    files::write(&common.output, &map, Bits::Eight)?;
    finish(common, vec![common.output.clone()], Shape::Sphere, |library| {
        let map = if options.flip_green { offset_up(map) } else { map };
        let offset_map = Some(add_map(library, "offset", ImageKind::Data, &map, Bits::Eight));
        Material { technique: Technique::PerturbedUv, offset_map, ..clay() }
    })
}

fn specular(args: &SpecularArgs, advance: Advance) -> Result<Vec<PathBuf>, MapError> {
    let common = &args.common;
    let inputs: Vec<&Path> =
        std::iter::once(&args.polish).chain(&args.base).chain(&args.metallic).map(PathBuf::as_path).collect();
    common.begin(&inputs, &[&common.output], args.bits)?;
    let bits = args.bits.unwrap_or(Bits::Eight);
    let polish = files::read_grey(&args.polish, args.channel)?;
    let metal = match (&args.base, &args.metallic) {
        (Some(base), Some(metallic)) => {
            let (base_map, metallic_map) = (files::read_color(base)?, files::read_channel(metallic, Channel::B)?);
            same_size((&args.polish, &polish), (base, &base_map))?;
            same_size((&args.polish, &polish), (metallic, &metallic_map))?;
            Some((base_map, metallic_map))
        }
        _ => None,
    };
    let options = SpecularOptions {
        from: args.from,
        model: args.shading,
        dielectric: args.dielectric,
        metal: metal.as_ref().map(|(base, metallic)| (base, metallic)),
    };
    let map = specular_from(&polish, &options, advance);
    files::write(&common.output, &map, bits)?;
    finish(common, vec![common.output.clone()], Shape::Sphere, |library| {
        let shading = match args.shading {
            SpecularModel::Phong => Shading::Blinn,
            SpecularModel::SpecularGlossiness => Shading::SpecularGlossiness,
        };
        let specular_map = Some(add_map(library, "specular", ImageKind::Data, &map, bits));
        Material { shading, specular_map, specular_factor: Vec3::ONE, base_factor: dark(), ..Material::default() }
    })
}

/// The preview, if one is wanted; and the list of what was written.
fn finish(
    common: &CommonArgs,
    mut written: Vec<PathBuf>,
    shape: Shape,
    material: impl FnOnce(&mut Library) -> Material,
) -> Result<Vec<PathBuf>, MapError> {
    if let Some(path) = &common.preview {
        preview::write(path, shape, material)?;
        written.push(path.clone());
    }
    Ok(written)
}

/// A dull surface, so that light shows the bumps and nothing else.
fn clay() -> Material {
    let base_factor = Vec4::new(0.6, 0.55, 0.5, 1.0);
    Material { base_factor, specular_factor: Vec3::splat(0.08), ..Material::default() }
}

/// So that highlights are what is seen.
fn dark() -> Vec4 {
    Vec4::new(0.08, 0.08, 0.09, 1.0)
}

fn green_up(mut map: Raster) -> Raster {
    map.values.chunks_exact_mut(3).for_each(|texel| texel[1] = 1.0 - texel[1]);
    map
}

/// Offsets are mirrored about 128 of 255.
fn offset_up(mut map: Raster) -> Raster {
    map.values.chunks_exact_mut(3).for_each(|texel| texel[1] = 256.0 / 255.0 - texel[1]);
    map
}

fn same_size((path, map): (&Path, &Raster), (other_path, other): (&Path, &Raster)) -> Result<(), MapError> {
    let ((width, height), found) = ((map.width, map.height), (other.width, other.height));
    if (width, height) == found {
        return Ok(());
    }
    let message = format!("expected {width}×{height} texels as {} has, found {}×{}", path.display(), found.0, found.1);
    Err(MapError::refused(other_path, message))
}

/// NAME.png to NAME_0.png; NAME is taken for NAME.png.
fn numbered(path: &Path, number: usize) -> PathBuf {
    let mut name = path.file_stem().unwrap_or_default().to_owned();
    name.push(format!("_{number}."));
    name.push(path.extension().unwrap_or("png".as_ref()));
    path.with_file_name(name)
}
