//! Sixteen surfaces with maps of their own: bricks, plates, weaves and pebbles in four colours each. Made by code, so
//! that a benchmark needs no files; every image tiles.
//!
//! A surface is a function from a place on it to height, colour and gloss. The normal map is the slope of the height.

use glam::{IVec2, Vec2, Vec3};
use systems::assets::{Image, ImageKind};
use systems::ecs::parallel::map_in_parallel;

/// Texels along a side of every map.
const SIDE: u32 = 256;
/// Surfaces.
pub const SURFACES: u32 = 16;
/// Depth from the lowest to the highest place of a surface, in texels.
const RELIEF: f32 = 10.0;

/// The images of one surface.
pub struct Surface {
    /// sRGB colour.
    pub base: Image,
    /// Tangent space, green up.
    pub normal: Image,
    /// Share that is reflected, grey.
    pub specular: Image,
}

/// Properties of a surface at one place.
#[derive(Clone, Copy)]
struct Texel {
    /// 0 lowest, 1 highest.
    height: f32,
    /// sRGB-encoded.
    color: Vec3,
    /// 0 matt, 1 glossy.
    gloss: f32,
}

/// sRGB colours, one per surface of a kind: bricks, plates, weaves, pebbles.
const COLORS: [[u32; 4]; 4] = [
    [0xa8553f, 0xc79263, 0x8c5b4a, 0xbda98a],
    [0x87939c, 0xb5724a, 0x5f8264, 0xcba23c],
    [0x4f72a5, 0x3f8782, 0x7d65a8, 0xa84a55],
    [0x96918a, 0xad8f60, 0x72836d, 0x5b5f66],
];

/// All surfaces, made in parallel.
pub fn surfaces() -> Vec<Surface> {
    systems::set_threads(None);
    let noise = noise_tile();
    let noise = &noise;
    map_in_parallel(0..SURFACES, |index| surface(index, noise))
}

fn surface(index: u32, noise: &[f32]) -> Surface {
    let (kind, variant) = (index % 4, index / 4);
    let stones = stones(variant);
    let texels: Vec<Texel> = (0..SIDE * SIDE)
        .map(|i| {
            let at = IVec2::new((i % SIDE) as i32, (i / SIDE) as i32);
            // A shift of its own lets surfaces share one tile of noise.
            let grain = noise[texel_index(at + IVec2::new(67, 29) * index as i32)];
            let uv = (at.as_vec2() + 0.5) / SIDE as f32;
            let color = rgb(COLORS[kind as usize][variant as usize]);
            match kind {
                0 => bricks(uv, variant, color, grain),
                1 => plates(uv, variant, color, grain),
                2 => weave(uv, variant, color, grain),
                _ => pebbles(uv, &stones, color, grain),
            }
        })
        .collect();
    let image = |what: &str, kind, texel: &dyn Fn(u32) -> Vec3| {
        let rgba = (0..SIDE * SIDE).map(|i| {
            let [r, g, b] = (texel(i).clamp(Vec3::ZERO, Vec3::ONE) * 255.0 + 0.5).to_array().map(|v| v as u8);
            [r, g, b, 255]
        });
        let bytes = rgba.collect::<Vec<[u8; 4]>>().into_flattened();
        Image::rgba8(format!("surface {index} {what}"), SIDE, SIDE, kind, bytes)
    };
    let height = |at: IVec2| texels[texel_index(at)].height;
    Surface {
        base: image("base", ImageKind::Color, &|i| texels[i as usize].color),
        normal: image("normal", ImageKind::Normal, &|i| {
            let at = IVec2::new((i % SIDE) as i32, (i / SIDE) as i32);
            let right = (height(at + IVec2::X) - height(at - IVec2::X)) * 0.5 * RELIEF;
            // Rows run down the image, green is up.
            let up = (height(at - IVec2::Y) - height(at + IVec2::Y)) * 0.5 * RELIEF;
            Vec3::new(-right, -up, 1.0).normalize() * 0.5 + 0.5
        }),
        specular: image("specular", ImageKind::Data, &|i| Vec3::splat(texels[i as usize].gloss)),
    }
}

fn rgb(hex: u32) -> Vec3 {
    let [b, g, r, _] = hex.to_le_bytes();
    Vec3::new(r.into(), g.into(), b.into()) / 255.0
}

fn texel_index(at: IVec2) -> usize {
    let at = at.rem_euclid(IVec2::splat(SIDE as i32));
    (at.y * SIDE as i32 + at.x) as usize
}

/// 0 at `edge` and below, 1 at `edge + width` and above.
fn ramp(edge: f32, width: f32, x: f32) -> f32 {
    let t = ((x - edge) / width).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

fn bricks(uv: Vec2, variant: u32, color: Vec3, grain: f32) -> Texel {
    let rows = [8, 6, 8, 4][variant as usize];
    let columns = rows / 2;
    let row = (uv.y * rows as f32) as i32;
    let along = uv.x * columns as f32 + if row % 2 == 0 { 0.0 } else { 0.5 };
    let brick = IVec2::new(along as i32 % columns, row);
    let inside = Vec2::new(along.fract(), (uv.y * rows as f32).fract());
    let (to_edge, aspect) = ((Vec2::splat(0.5) - (inside - 0.5).abs()), Vec2::new(2.0, 1.0));
    let stone = ramp(0.05, 0.14, (to_edge * aspect).min_element());
    let tint = 0.8 + 0.35 * hash(brick + IVec2::splat(31 * variant as i32));
    let mortar = Vec3::new(0.66, 0.63, 0.58) * (0.75 + 0.4 * grain);
    Texel {
        height: stone * (0.72 + 0.1 * tint) + 0.22 * grain,
        color: mortar.lerp(color * tint * (0.75 + 0.4 * grain), stone),
        gloss: stone * (0.1 + 0.25 * grain),
    }
}

fn plates(uv: Vec2, variant: u32, color: Vec3, grain: f32) -> Texel {
    let panels = [2.0, 3.0, 2.0, 4.0][variant as usize];
    let inside = (uv * panels).fract();
    let to_edge = (Vec2::splat(0.5) - (inside - 0.5).abs()).min_element();
    let plate = ramp(0.01, 0.04, to_edge);
    // Four rivets along each side, and those at the corners are shared.
    let rivet_at = (inside * 4.0).fract() - 0.5;
    let beside_edge = ((inside * 4.0).floor() - 1.5).abs().max_element() > 1.0;
    let dome = (1.0 - rivet_at.length_squared() / 0.04).max(0.0).sqrt();
    let rivet = if beside_edge { dome } else { 0.0 };
    let worn = ramp(0.45, 0.3, grain);
    Texel {
        height: plate * 0.5 + rivet * 0.35 + 0.05 * grain,
        color: color * (0.35 + 0.65 * plate) * (0.7 + 0.4 * worn) + 0.12 * rivet,
        gloss: plate * (0.35 + 0.5 * worn) + 0.15 * rivet,
    }
}

fn weave(uv: Vec2, variant: u32, color: Vec3, grain: f32) -> Texel {
    let threads = [8, 12, 6, 10][variant as usize];
    let (cell, inside) = ((uv * threads as f32).as_ivec2(), (uv * threads as f32).fract() - 0.5);
    // Threads of the two directions lie on top in turn.
    let lengthwise = (cell.x + cell.y) % 2 == 0;
    let (across, along) = if lengthwise { (inside.x, inside.y) } else { (inside.y, inside.x) };
    let round = (1.0 - (across * 2.1).powi(2)).max(0.0).sqrt();
    let bend = (along * std::f32::consts::PI).cos();
    let height = round * (0.35 + 0.55 * bend) + 0.12 * grain;
    let side = if lengthwise { 1.0 } else { 0.72 };
    Texel { height, color: color * side * (0.35 + 0.75 * height), gloss: 0.12 + 0.4 * round * bend }
}

/// Square cells with a stone in each: along a side, the name of each, and where its stone lies in it. With a rim of the
/// cells beyond the sides, which are those of the other side: row by row from (−1, −1) on.
fn stones(variant: u32) -> (i32, Vec<(IVec2, Vec2)>) {
    let cells = [8, 6, 10, 7][variant as usize];
    let side = cells + 2;
    let stone = |i: i32| {
        let cell = IVec2::new(i % side - 1, i / side - 1);
        let name = cell.rem_euclid(IVec2::splat(cells)) + IVec2::splat(17 * variant as i32);
        (name, Vec2::new(hash(name), hash(name + IVec2::new(101, 57))) * 0.7 + 0.15)
    };
    (cells, (0..side * side).map(stone).collect())
}

fn pebbles(uv: Vec2, (cells, stones): &(i32, Vec<(IVec2, Vec2)>), color: Vec3, grain: f32) -> Texel {
    let at = uv * *cells as f32;
    let home = at.as_ivec2();
    let (mut nearest, mut second, mut stone) = (f32::INFINITY, f32::INFINITY, IVec2::ZERO);
    for i in 0..9 {
        let cell = home + IVec2::new(i % 3 - 1, i / 3 - 1);
        let (name, jitter) = stones[((cell.y + 1) * (cells + 2) + cell.x + 1) as usize];
        let distance = (cell.as_vec2() + jitter).distance(at);
        if distance < nearest {
            (second, nearest, stone) = (nearest, distance, name);
        } else {
            second = second.min(distance);
        }
    }
    let round = ramp(0.02, 0.45, second - nearest).sqrt();
    let tint = 0.65 + 0.5 * hash(stone + IVec2::splat(7));
    Texel {
        height: round * (0.7 + 0.15 * tint) + 0.1 * grain,
        color: color * tint * (0.25 + 0.75 * round) * (0.8 + 0.35 * grain),
        gloss: round * (0.15 + 0.45 * hash(stone)),
    }
}

/// A number 0..1 of a cell, always the same.
fn hash(cell: IVec2) -> f32 {
    let mut h = (cell.x as u32).wrapping_mul(0x9e37_79b1) ^ (cell.y as u32).wrapping_mul(0x85eb_ca77);
    h = (h ^ (h >> 15)).wrapping_mul(0x2c1b_3c6d);
    h = (h ^ (h >> 12)).wrapping_mul(0x297a_2d39);
    ((h ^ (h >> 15)) >> 8) as f32 / (1 << 24) as f32
}

/// Value noise of four octaves, 0..1, on a tile of the maps' size.
fn noise_tile() -> Vec<f32> {
    let mut tile = vec![0.0; (SIDE * SIDE) as usize];
    for octave in 0..4 {
        let cells = 8 << octave;
        let weight = 0.5f32.powi(octave) / 1.875;
        let lattice: Vec<f32> =
            (0..cells * cells).map(|i| hash(IVec2::new(i % cells, i / cells + 1000 * octave))).collect();
        let corner = |x: i32, y: i32| lattice[((y % cells) * cells + x % cells) as usize];
        for (i, value) in tile.iter_mut().enumerate() {
            let at = Vec2::new((i as u32 % SIDE) as f32, (i as u32 / SIDE) as f32) * (cells as f32 / SIDE as f32);
            let (cell, t) = (at.as_ivec2(), at.fract());
            let t = t * t * (3.0 - 2.0 * t);
            let row = |y| corner(cell.x, y) * (1.0 - t.x) + corner(cell.x + 1, y) * t.x;
            *value += weight * (row(cell.y) * (1.0 - t.y) + row(cell.y + 1) * t.y);
        }
    }
    tile
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn surfaces_tile_and_are_bumped_and_always_the_same() {
        let all = surfaces();
        assert_eq!(all.len(), SURFACES as usize);
        let again = surfaces();
        for (surface, same) in all.iter().zip(&again) {
            assert_eq!(surface.normal, same.normal);
            assert!(surface.base == same.base && surface.specular == same.specular);
            let texels: Vec<&[u8]> = surface.normal.levels[0].chunks_exact(4).collect();
            let steep = texels.iter().filter(|n| n[2] < 230).count();
            assert!(steep > texels.len() / 50, "{}: {steep} steep texels", surface.normal.name);
            // Neighbours across the border differ no more than neighbours within.
            let height = |x: usize, y: usize| i32::from(surface.base.levels[0][(y * SIDE as usize + x) * 4]);
            let step =
                |a: usize, b: usize| (0..SIDE as usize).map(|y| (height(a, y) - height(b, y)).abs()).sum::<i32>();
            let within = (0..255).map(|x| step(x, x + 1)).max().unwrap_or(0);
            assert!(step(255, 0) <= within, "{}: {} > {within}", surface.base.name, step(255, 0));
        }
        assert!(all[0].base != all[4].base);
    }
}
