//! A picture of a map as the renderer shows it: on a square that lies in raking light, or on a sphere.

use super::files::Bits;
use super::{MapError, Raster};
use crate::frames::{FrameError, Headless};
use crate::output;
use glam::{UVec2, Vec2, Vec3, Vec4};
use std::path::Path;
use systems::Simulation;
use systems::assets::{Image, ImageKind, Library, Map, Material, Mesh, shapes, texture_memory};
use systems::draw::Camera;
use systems::lights::Light;
use systems::space::Transform;

/// Pixels along a side.
pub const SIDE: u32 = 512;
/// Larger maps are drawn from their smaller mip levels.
const TEXTURE_BYTES: u64 = 256 << 20;

/// Surface that the map lies on.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Shape {
    /// A rectangle seen from the front and above, as wide and high as the map.
    Plane {
        /// Height over width.
        aspect: f32,
    },
    /// A sphere with the map twice around it.
    Sphere,
}

impl Shape {
    /// A plane of the map's shape.
    pub fn plane_of(map: &Raster) -> Self {
        Self::Plane { aspect: map.height as f32 / map.width as f32 }
    }

    fn mesh(self) -> Mesh {
        match self {
            Self::Plane { aspect } => shapes::plane(Vec2::new(1.0, aspect) * (2.0 / aspect.max(1.0)), UVec2::ONE),
            Self::Sphere => shapes::with_uv_scale(shapes::sphere(0.95, 128, 64), Vec2::new(2.0, 1.0)),
        }
    }

    fn eye(self) -> Transform {
        let (eye, target) = match self {
            Self::Plane { .. } => (Vec3::new(0.0, 2.4, 1.9), Vec3::Z * 0.15),
            Self::Sphere => (Vec3::new(0.0, 0.9, 3.0), Vec3::ZERO),
        };
        Transform::from_translation(eye).looking_at(target, Vec3::Y)
    }
}

/// Adds a map of 1, 3 or 4 channels to a library, with the values that a file of so many bits holds. Values are linear.
pub fn add_map(library: &mut Library, name: &str, kind: ImageKind, map: &Raster, bits: Bits) -> Map {
    let largest = if bits == Bits::Eight { 255.0 } else { 65535.0 };
    let stored = |v: f32| (v.clamp(0.0, 1.0) * largest).round() / largest;
    let texel = |t: &[f32]| match *t {
        [r, g, b, a] => Vec4::new(r, g, b, a),
        [r, g, b] => Vec4::new(r, g, b, 1.0),
        [v, ..] => Vec3::splat(v).extend(1.0),
        [] => Vec4::ZERO,
    };
    let texels: Vec<Vec4> =
        map.values.chunks_exact(map.channels).map(|t| Vec4::from_array(texel(t).to_array().map(stored))).collect();
    let (width, height) = (map.width as u32, map.height as u32);
    let image = if kind == ImageKind::Height {
        Image::heights(name, width, height, &texels.iter().map(|texel| texel.x).collect::<Vec<_>>())
    } else {
        Image::rgba16(name, width, height, kind, &texels)
    };
    Map::new(library.add_image(image))
}

/// Draws a material that `material` makes in a library, and writes the picture.
///
/// # Errors
/// [`MapError::Preview`], [`MapError::Output`].
pub fn write(path: &Path, shape: Shape, material: impl FnOnce(&mut Library) -> Material) -> Result<(), MapError> {
    let picture = draw(shape, material).map_err(|source| MapError::Preview { path: path.to_owned(), source })?;
    Ok(output::write_png(path, &picture.into())?)
}

fn draw(shape: Shape, material: impl FnOnce(&mut Library) -> Material) -> Result<image::RgbaImage, FrameError> {
    let mut headless = Headless::new()?;
    let mut simulation = Simulation::new();
    let mut library = simulation.world.resource_mut::<Library>();
    let material = material(&mut library);
    let (mesh, material) = (library.add_mesh(shape.mesh()), library.add_material(material));
    texture_memory::limit(&mut library, TEXTURE_BYTES);
    let world = &mut simulation.world;
    world.spawn((mesh, material));
    // From image-up and left, low: what faces it is raised. The other is weak and from the opposite side.
    let lamp = Light { attenuation: Vec3::X, ..Light::point(1.9, f32::INFINITY) };
    world.spawn((lamp.with_color(Vec3::new(1.0, 0.93, 0.82)), Transform::from_xyz(-2.2, 1.3, -1.6)));
    let fill = Transform::from_xyz(2.0, 1.5, 2.5).looking_at(Vec3::ZERO, Vec3::Y);
    world.spawn((Light::directional(0.25).with_color(Vec3::new(0.7, 0.82, 1.0)), fill));
    let camera = world.spawn((Camera::default(), shape.eye())).id();
    headless.draw(&mut simulation, camera, (SIDE, SIDE))
}
