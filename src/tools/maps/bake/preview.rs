//! A mesh drawn without and with its maps, side by side, by the project's own renderer.

use super::{Baked, Surface};
use crate::frames::{FrameError, Headless};
use crate::tools::maps::Raster;
use glam::{Quat, Vec3, Vec4};
use image::{GenericImage, RgbaImage};
use systems::Simulation;
use systems::assets::{Image, ImageKind, Library, Map, Material, Mesh, Shading, Technique};
use systems::draw::{Camera, Environment, Projection};
use systems::lights::Light;
use systems::space::Transform;

/// Pixels of each of the two pictures along a side.
const SIDE: u32 = 768;

/// Draws the coarse mesh twice, left as it is, right with the maps.
///
/// # Errors
/// [`FrameError`]: there is no graphics adapter.
pub fn preview(low: &Surface, baked: &Baked) -> Result<RgbaImage, FrameError> {
    let mut headless = Headless::new()?;
    let mut simulation = Simulation::new();
    let mut library = simulation.world.resource_mut::<Library>();
    let mesh = library.add_mesh(mesh(low));
    // Of clay: light shows the bumps and nothing else. Metallic-roughness, for Phong has no occlusion maps.
    let base_factor = Vec4::new(0.6, 0.55, 0.5, 1.0);
    let shading = Shading::MetallicRoughness;
    let plain = Material { shading, base_factor, roughness: 0.6, metallic: 0.0, ..Material::default() };
    let with_maps = mapped(&plain, baked, &mut library);
    let materials = [plain, with_maps].map(|material| library.add_material(material));
    let object = simulation.world.spawn((mesh, materials[0], Transform::IDENTITY)).id();
    let eye = eye(low);
    let camera = simulation.world.spawn((lens(low), eye)).id();
    // From the left above the eye, so that bumps are seen by their shades, and weaker from the other side.
    for (intensity, yaw, pitch) in [(1.0, -0.8, -0.7), (0.15, 1.2, 0.2)] {
        let turn = eye.rotation * Quat::from_rotation_y(yaw) * Quat::from_rotation_x(pitch);
        simulation.world.spawn((Light::directional(intensity), Transform::from_rotation(turn)));
    }
    simulation.world.insert_resource(Environment { ambient: Vec3::splat(0.12), ..Environment::default() });
    let mut picture = RgbaImage::new(2 * SIDE, SIDE);
    for (column, material) in (0..).zip(materials) {
        simulation.world.entity_mut(object).insert(material);
        let half = headless.draw(&mut simulation, camera, (SIDE, SIDE))?;
        // It fits: two halves of the same size.
        let _ = picture.copy_from(&half, column * SIDE, 0);
    }
    Ok(picture)
}

fn mesh(low: &Surface) -> Mesh {
    Mesh {
        name: "baked".into(),
        positions: low.positions.clone(),
        normals: low.normals.clone(),
        tangents: low.tangents.clone(),
        uvs: [low.uvs.clone(), Vec::new()],
        indices: low.triangles.as_flattened().to_vec(),
        ..Mesh::default()
    }
}

/// The material with all maps that there are; heights alone bump it without a normal map.
fn mapped(plain: &Material, baked: &Baked, library: &mut Library) -> Material {
    let mut add = |raster: &Raster, kind| Map::new(library.add_image(image(raster, kind)));
    let normal_map = baked.normal.as_ref().map(|raster| add(raster, ImageKind::Normal));
    let height_map = baked.height.as_ref().map(|raster| add(raster, ImageKind::Height));
    let occlusion_map = baked.occlusion.as_ref().map(|raster| add(raster, ImageKind::Data));
    let technique = match (normal_map, height_map) {
        (None, Some(_)) => Technique::PerturbedNormal,
        _ => Technique::Normal,
    };
    let (height_scale_uv, height_rest) = (baked.report.height_scale_uv(), baked.report.height_rest());
    Material { technique, normal_map, height_map, occlusion_map, height_scale_uv, height_rest, ..plain.clone() }
}

fn image(raster: &Raster, kind: ImageKind) -> Image {
    if kind != ImageKind::Height {
        return raster.rgba8("baked", kind);
    }
    let heights: Vec<f32> = raster.values.iter().map(|height| height.clamp(0.0, 1.0)).collect();
    Image::heights("baked", raster.width as u32, raster.height as u32, &heights)
}

/// From where an open sheet is seen face on, and a closed thing a little from above and the right.
fn eye(low: &Surface) -> Transform {
    let (mut facing, mut area) = (Vec3::ZERO, 0.0);
    for triangle in 0..low.triangles.len() as u32 {
        let [a, b, c] = low.corners(triangle);
        let across = (b - a).cross(c - a);
        (facing, area) = (facing + across, area + across.length());
    }
    let open = facing.length() > 0.5 * area;
    let toward = if open { facing.normalize_or(Vec3::Z) } else { Vec3::new(0.5, 0.45, 1.0).normalize() };
    let (centre, radius) = sphere(low);
    let up = if toward.y.abs() > 0.99 { Vec3::NEG_Z } else { Vec3::Y };
    Transform::from_translation(centre + toward * radius * 4.0).looking_at(centre, up)
}

fn lens(low: &Surface) -> Camera {
    let radius = sphere(low).1;
    // The angle under which the sphere is seen from four radii away, and a little more.
    let fov_y = 2.0 * 0.26f32.asin();
    let near = radius * 0.1;
    Camera { projection: Projection::Perspective { fov_y, aspect: None }, near, ..Camera::default() }
}

/// Around all of it: middle and radius.
fn sphere(low: &Surface) -> (Vec3, f32) {
    let centre = low.aabb().center();
    let radius = low.positions.iter().fold(1e-6f32, |radius, place| radius.max(place.distance(centre)));
    (centre, radius)
}
