//! Real geometry from a height map: what the bump techniques imitate.
//!
//! ```text
//! mesh, fine enough for the map → vertices that lie at one place found → moved along the normal
//! → normals of the new faces
//! ```
//!
//! A vertex goes to p + n · (h(uv) − rest) · D. D is metres from black to white: [`Displacement::scale_uv`] times the
//! metres in a unit of UV, the square root of the area that a unit square of UV covers there, as
//! `shaders/height_field.wgsl` has it of a pixel. Nothing is cut: a mesh shows what of the map its vertices are near
//! enough together for.

use super::image::{Image, Texels};
use super::material::{Sampler, Wrap};
use super::mesh::Mesh;
use super::tangents::bits;
use glam::{Vec2, Vec3};
use std::collections::HashMap;

/// The heights of an image, 0 deepest to 1 highest: its red, as it is drawn where a pixel is as large as a texel.
#[derive(Clone, Debug)]
pub struct HeightMap {
    width: usize,
    height: usize,
    heights: Vec<f32>,
    wrap: [Wrap; 2],
}

impl HeightMap {
    /// `None` for an image in blocks, or whose texels a renderer has taken.
    pub fn new(image: &Image, sampler: &Sampler) -> Option<Self> {
        let texels = image.levels.first()?;
        let heights = match image.texels {
            Texels::Rgba8 => texels.chunks_exact(4).map(|texel| f32::from(texel[0]) / 255.0).collect(),
            Texels::Rgba16Float => {
                texels.chunks_exact(8).map(|t| half::f16::from_le_bytes([t[0], t[1]]).to_f32()).collect()
            }
            Texels::R32Float => texels.as_chunks::<4>().0.iter().map(|&height| f32::from_le_bytes(height)).collect(),
            Texels::Bc7 => return None,
        };
        let (width, height) = (image.width as usize, image.height as usize);
        Some(Self { width, height, heights, wrap: [sampler.wrap_u, sampler.wrap_v] })
    }

    /// Texels along U and V.
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// The height at a place in the image's UV, between four texels.
    pub fn at(&self, uv: Vec2) -> f32 {
        let place = uv * Vec2::new(self.width as f32, self.height as f32) - 0.5;
        let (corner, part) = (place.floor(), place - place.floor());
        let texel = |right: i64, down: i64| self.texel(corner.x as i64 + right, corner.y as i64 + down);
        let above = texel(0, 0) * (1.0 - part.x) + texel(1, 0) * part.x;
        let below = texel(0, 1) * (1.0 - part.x) + texel(1, 1) * part.x;
        above * (1.0 - part.y) + below * part.y
    }

    /// The height of a texel, which may lie beyond the image's edges.
    pub fn texel(&self, x: i64, y: i64) -> f32 {
        let inside = |at: i64, side: usize, wrap: Wrap| {
            let side = side as i64;
            match wrap {
                Wrap::Repeat => at.rem_euclid(side),
                Wrap::Mirror => {
                    let at = at.rem_euclid(2 * side);
                    at.min(2 * side - 1 - at)
                }
                Wrap::Clamp => at.clamp(0, side - 1),
            }
        };
        let (x, y) = (inside(x, self.width, self.wrap[0]), inside(y, self.height, self.wrap[1]));
        self.heights[y as usize * self.width + x as usize]
    }
}

/// Displacement of a mesh by a height map. The fields are those of a [`crate::assets::Material`].
#[derive(Clone, Copy, Debug)]
pub struct Displacement<'a> {
    /// Read at the mesh's first UV set.
    pub heights: &'a HeightMap,
    /// From black to white, in widths of the image, whose texels are square.
    pub scale_uv: f32,
    /// The height that stays where it is.
    pub rest: f32,
}

/// The mesh with its bumps as geometry; a mesh without UVs as it is.
///
/// Vertices at one place stay at one place, moved by the mean of what each would be, and share a normal, the mean of
/// the faces around by their areas: no gap and no crease opens along a seam of the UVs. A mesh with sharp edges loses
/// them.
pub fn displace(mesh: &Mesh, by: &Displacement) -> Mesh {
    let mut bumped = mesh.clone();
    let places = Places::new(mesh);
    let metres_per_uv = places.metres_per_uv(mesh);
    // Of an image whose texels are square, which covers as much.
    let (width, height) = by.heights.size();
    let widths = (width as f32 / height.max(1) as f32).sqrt();
    let mut moved = vec![(Vec3::ZERO, 0.0f32); places.count];
    for ((&place, &normal), &uv) in places.of_vertices.iter().zip(&mesh.normals).zip(&mesh.uvs[0]) {
        let (sum, count) = &mut moved[place];
        *sum += normal * ((by.heights.at(uv) - by.rest) * by.scale_uv * widths * metres_per_uv[place]);
        *count += 1.0;
    }
    for (position, &place) in bumped.positions.iter_mut().zip(&places.of_vertices) {
        let (sum, count) = moved[place];
        *position += sum / count.max(1.0);
    }
    places.smooth_normals(&mut bumped);
    // Of no use to a surface without a normal map; without any they would be worked out, which takes long.
    bumped.tangents = bumped.normals.iter().map(|normal| normal.any_orthonormal_vector().extend(1.0)).collect();
    bumped
}

/// Vertices of a mesh grouped by position.
struct Places {
    of_vertices: Vec<usize>,
    count: usize,
}

impl Places {
    fn new(mesh: &Mesh) -> Self {
        let mut known = HashMap::with_capacity(mesh.positions.len());
        let place = |&position: &Vec3| {
            let next = known.len();
            *known.entry(bits(position)).or_insert(next)
        };
        let of_vertices = mesh.positions.iter().map(place).collect();
        Self { of_vertices, count: known.len() }
    }

    /// Length of a UV unit at each place, metres, from the triangles around it.
    fn metres_per_uv(&self, mesh: &Mesh) -> Vec<f32> {
        let mut areas = vec![Vec2::ZERO; self.count];
        if mesh.uvs[0].is_empty() {
            return vec![0.0; self.count];
        }
        for triangle in mesh.indices.as_chunks::<3>().0 {
            let [a, b, c] = triangle.map(|index| mesh.uvs[0][index as usize]);
            let area = Vec2::new(face(mesh, triangle).length(), (b - a).perp_dot(c - a).abs());
            triangle.iter().for_each(|&index| areas[self.of_vertices[index as usize]] += area);
        }
        let metres = |area: &Vec2| if area.y > 0.0 { (area.x / area.y).sqrt() } else { 0.0 };
        areas.iter().map(metres).collect()
    }

    fn smooth_normals(&self, mesh: &mut Mesh) {
        let mut sums = vec![Vec3::ZERO; self.count];
        for triangle in mesh.indices.as_chunks::<3>().0 {
            let face = face(mesh, triangle);
            triangle.iter().for_each(|&index| sums[self.of_vertices[index as usize]] += face);
        }
        for (normal, &place) in mesh.normals.iter_mut().zip(&self.of_vertices) {
            *normal = sums[place].try_normalize().unwrap_or(*normal);
        }
    }
}

/// A triangle's normal, as long as twice its area.
fn face(mesh: &Mesh, triangle: &[u32; 3]) -> Vec3 {
    let [a, b, c] = triangle.map(|index| mesh.positions[index as usize]);
    (b - a).cross(c - a)
}
