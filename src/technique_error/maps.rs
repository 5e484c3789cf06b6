//! The maps that all techniques are given: one height map, and what follows from it.

use super::CompareArgs;
use crate::demo;
use crate::import::{self, ImportError};
use crate::maps::Raster;
use glam::{Vec2, Vec3};
use std::f32::consts::FRAC_PI_2;
use std::path::Path;
use systems::displace::HeightMap;
use systems::images::{Image, ImageKind};
use systems::library::Sampler;

/// The depth that the shipped maps are made for.
const SHIPPED_SCALE: f32 = 0.06;
/// Texels along a side of a height map.
const MOST_TEXELS: u32 = 4096;
/// Texels along a side of the horizon maps: lower frequencies do, and each texel looks far around.
const HORIZON_TEXELS: usize = 512;
/// Right and up, in the order of the horizon maps' channels.
const DIRECTIONS: [(f32, f32); 8] =
    [(1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (-1.0, 1.0), (-1.0, 0.0), (-1.0, -1.0), (0.0, -1.0), (1.0, -1.0)];

/// Images of a material.
pub(super) struct Maps {
    pub scale: f32,
    pub heights: HeightMap,
    pub height: Image,
    pub base: Option<Image>,
    pub specular: Option<Image>,
    pub normal: Image,
    pub horizon: [Image; 2],
    pub offset: Image,
    pub environment: Image,
}

/// Reads what the arguments name, and makes the rest.
pub(super) fn load(args: &CompareArgs) -> Result<Maps, ImportError> {
    let shipped =
        |name: &str, kind| import::load_image(&demo::shipped(&format!("assets/textures/techniques_{name}")), kind);
    let scale = args.height_scale.unwrap_or(SHIPPED_SCALE);
    let path = args.height.clone().unwrap_or_else(|| demo::shipped("assets/textures/techniques_height.png"));
    let height = import::load_image(&path, ImageKind::Data)?;
    if height.width.max(height.height) > MOST_TEXELS {
        return Err(unfit(&path, &height, &format!("expected at most {MOST_TEXELS} texels along a side")));
    }
    let Some(heights) = HeightMap::new(&height, &Sampler::default()) else {
        return Err(unfit(&path, &height, "expected an image that is not compressed in blocks"));
    };
    let own_heights = args.height.is_some();
    let (base, specular) = match &args.base {
        Some(path) => (Some(import::load_image(path, ImageKind::Color)?), None),
        None if own_heights => (None, None),
        None => (Some(shipped("base.jpg", ImageKind::Color)?), Some(shipped("specular.png", ImageKind::Data)?)),
    };
    let made = own_heights || args.height_scale.is_some();
    let normal = match &args.normal {
        Some(path) => import::load_image(path, ImageKind::Normal)?,
        None if made => image("normal", ImageKind::Normal, &normals(&heights, scale)),
        None => shipped("normal.png", ImageKind::Normal)?,
    };
    let (horizon, offset) = if made {
        let horizon = horizons(&heights, scale).map(|map| image("horizon", ImageKind::Data, &map));
        (horizon, image("offset", ImageKind::Data, &offsets(&heights, scale)))
    } else {
        let horizon = [shipped("horizon_0.png", ImageKind::Data)?, shipped("horizon_1.png", ImageKind::Data)?];
        (horizon, shipped("offset.png", ImageKind::Data)?)
    };
    let environment = shipped("environment.jpg", ImageKind::Color)?;
    Ok(Maps { scale, heights, height, base, specular, normal, horizon, offset, environment })
}

fn unfit(path: &Path, image: &Image, message: &str) -> ImportError {
    let message = format!("the height map has {}×{} texels; {message}", image.width, image.height);
    ImportError::Invalid { path: path.to_owned(), place: "size".into(), message }
}

fn image(name: &str, kind: ImageKind, map: &Raster) -> Image {
    let byte = |v: f32| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
    let texel = |t: &[f32]| [t[0], t[1], t[2], t.get(3).copied().unwrap_or(1.0)].map(byte);
    let texels = map.values.chunks_exact(map.channels).flat_map(texel).collect();
    Image::rgba8(name, map.width as u32, map.height as u32, kind, texels)
}

/// ∂z/∂u and ∂z/∂(image-up) at a texel, in widths of the image: Sobel's differences.
fn slope(heights: &HeightMap, scale: f32, x: usize, y: usize) -> Vec2 {
    let (width, height) = heights.size();
    let at = |right: i64, down: i64| heights.texel(x as i64 + right, y as i64 + down);
    let sum = |f: &dyn Fn(i64) -> f32| f(-1) + 2.0 * f(0) + f(1);
    let right = sum(&|down| at(1, down) - at(-1, down)) / 8.0;
    let up = sum(&|right| at(right, -1) - at(right, 1)) / 8.0;
    scale * Vec2::new(right * width as f32, up * height as f32)
}

fn normals(heights: &HeightMap, scale: f32) -> Raster {
    of_texels(heights, |x, y| (-slope(heights, scale, x, y)).extend(1.0).normalize() * 0.5 + 0.5)
}

fn offsets(heights: &HeightMap, scale: f32) -> Raster {
    let encoded = |offset: Vec2| (offset.clamp(Vec2::NEG_ONE, Vec2::ONE) * 127.0 + 128.0) / 255.0;
    of_texels(heights, |x, y| encoded(-slope(heights, scale, x, y)).extend(0.0))
}

fn of_texels(heights: &HeightMap, of: impl Fn(usize, usize) -> Vec3 + Sync) -> Raster {
    let (width, height) = heights.size();
    let fill = |y: usize, row: &mut [f32]| {
        row.chunks_exact_mut(3).enumerate().for_each(|(x, texel)| texel.copy_from_slice(&of(x, y).to_array()));
    };
    Raster::from_rows((width, height, 3), fill, &|_| {})
}

/// The elevation of the horizon over a right angle, in eight directions, half the image around at the most.
fn horizons(heights: &HeightMap, scale: f32) -> [Raster; 2] {
    let (width, height) = heights.size();
    let (width, height) = (width.min(HORIZON_TEXELS), height.min(HORIZON_TEXELS));
    let center = |i: usize| Vec2::new((i % width) as f32 + 0.5, (i / width) as f32 + 0.5);
    let size = Vec2::new(width as f32, height as f32);
    let grid: Vec<f32> = (0..width * height).map(|i| heights.at(center(i) / size)).collect();
    let around = |at: f32, side: usize| (at as i64).rem_euclid(side as i64) as usize;
    // Texels that a step goes in either direction, where it goes as far in U as in V.
    let longest = size.max_element();
    let step = size / longest;
    let steepest = |x: usize, y: usize, (right, up): (f32, f32)| {
        let (here, mut steepest) = (grid[y * width + x], 0.0f32);
        let uv_step = Vec2::new(right, up).length() / longest;
        for k in 1..(longest as usize / 2).max(2) {
            let k = k as f32;
            let distance = k * uv_step;
            if (1.0 - here) * scale <= steepest * distance {
                break;
            }
            let there = Vec2::new(x as f32 + (k * right * step.x).round(), y as f32 - (k * up * step.y).round());
            let rise = grid[around(there.y, height) * width + around(there.x, width)] - here;
            steepest = steepest.max(rise * scale / distance);
        }
        steepest
    };
    [0, 4].map(|first| {
        let fill = |y: usize, row: &mut [f32]| {
            for (i, value) in row.iter_mut().enumerate() {
                *value = steepest(i / 4, y, DIRECTIONS[first + i % 4]).atan() / FRAC_PI_2;
            }
        };
        Raster::from_rows((width, height, 4), fill, &|_| {})
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The shipped maps were made by another program.
    #[test]
    fn maps_made_here_are_those_that_are_shipped() {
        let shipped = |name: &str| {
            let path = demo::shipped(&format!("assets/textures/techniques_{name}.png"));
            import::load_image(&path, ImageKind::Data).expect("a map")
        };
        let height = shipped("height");
        let heights = HeightMap::new(&height, &Sampler::default()).expect("heights");
        let made = [("normal", normals(&heights, SHIPPED_SCALE)), ("offset", offsets(&heights, SHIPPED_SCALE))];
        for (name, map) in made {
            let made = image(name, ImageKind::Data, &map);
            let worst = made.levels[0].iter().zip(&shipped(name).levels[0]).map(|(a, b)| a.abs_diff(*b)).max();
            assert!(worst <= Some(3), "{name}: {worst:?}");
        }
        // Those were made from heights of half the size.
        let half = Image { width: 256, height: 256, levels: vec![height.levels[1].clone()], ..height };
        let heights = HeightMap::new(&half, &Sampler::default()).expect("heights");
        let made = horizons(&heights, SHIPPED_SCALE).map(|map| image("horizon", ImageKind::Data, &map));
        for (made, name) in made.iter().zip(["horizon_0", "horizon_1"]) {
            let worst = made.levels[0].iter().zip(&shipped(name).levels[0]).map(|(a, b)| a.abs_diff(*b)).max();
            assert!(worst <= Some(3), "{name}: {worst:?}");
        }
    }
}
