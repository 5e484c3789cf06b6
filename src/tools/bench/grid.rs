//! The benchmark scene: so many equal objects on a square grid, 3 m apart, under point lights of 10 m range.
//! Bump-mapped in sixteen materials with maps of their own. Everything is seeded: the same plan gives the same world.
//!
//! Grid, sizes, lights, cameras and the shape of the motion are those of the programs that other engines are measured
//! with (docs/benchmarks.md), down to the random numbers.

use super::maps;
use crate::import;
use crate::name::named;
use crate::tools::error::ToolError;
use bevy_ecs::prelude::*;
use glam::{Quat, Vec3};
use serde::{Deserialize, Serialize};
use std::f32::consts::TAU;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use systems::Simulation;
use systems::assets::{Library, Map, Material, MaterialId, Mesh, MeshId, Shading, shapes};
use systems::draw::{Camera, Environment, Projection, ToneMap};
use systems::lights::Light;
use systems::space::Transform;

/// Metres between objects.
const SPACING: f32 = 3.0;
/// Metres: the side of a cube, the diameter of a sphere, the longest side of a model.
const SIZE: f32 = 1.5;

/// The mesh of all objects.
#[derive(Clone, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub enum GridMesh {
    /// 24 vertices, 12 triangles.
    #[default]
    Cube,
    /// 594 vertices, 1,024 triangles.
    Sphere,
    /// The largest mesh of a glTF file, scaled to the cube's size.
    Model(PathBuf),
}

impl GridMesh {
    /// Its name, or the path of its model.
    pub fn name(&self) -> String {
        match self {
            Self::Cube => "cube".into(),
            Self::Sphere => "sphere".into(),
            Self::Model(path) => path.display().to_string(),
        }
    }
}

impl FromStr for GridMesh {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        const SHAPES: [(&str, GridMesh); 2] = [("cube", GridMesh::Cube), ("sphere", GridMesh::Sphere)];
        let path = Path::new(text);
        let is_model =
            path.extension().is_some_and(|e| e.eq_ignore_ascii_case("glb") || e.eq_ignore_ascii_case("gltf"));
        match SHAPES.into_iter().find(|(name, _)| *name == text) {
            Some((_, shape)) => Ok(shape),
            None if is_model => Ok(Self::Model(path.into())),
            None => Err("expected cube, sphere or a .glb or .gltf file".to_owned()),
        }
    }
}

named! {
    /// Place of the camera.
    #[derive(Default, Serialize, Deserialize)]
    pub enum GridView {
        /// Outside and above, with the whole grid in view
        #[default]
        Wide = "wide",
        /// Between the rows at 2 m, about a sixth of the grid in view
        Inside = "inside",
    }
}

/// Contents of a yard.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct GridPlan {
    /// At least 1.
    pub objects: u32,
    /// Point lights.
    pub lights: u32,
    /// 0..1: how many of the objects move, spread evenly.
    pub moving: f32,
    /// The mesh of all objects.
    pub mesh: GridMesh,
    /// Place of the camera.
    pub view: GridView,
    /// Lights cast shadows.
    pub shadows: bool,
}

/// A world to measure.
pub struct Grid {
    /// The world.
    pub simulation: Simulation,
    /// Sees it.
    pub camera: Entity,
    movers: Vec<Mover>,
}

/// Mesh and materials of a yard's objects.
pub struct GridKit {
    mesh: MeshId,
    materials: Vec<MaterialId>,
}

struct Mover {
    entity: Entity,
    /// Place on the ground.
    foot: Vec3,
    phase: f32,
}

/// The random numbers of the other engines' programs (the generator of Numerical Recipes).
struct Numbers(u32);

impl Numbers {
    fn unit(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (self.0 >> 8) as f32 / (1 << 24) as f32
    }
}

/// Turning and bobbing; `seconds` 0 is where everything starts.
fn pose(foot: Vec3, phase: f32, seconds: f32) -> Transform {
    let height = 0.75 + 0.25 * (1.0 + (2.0 * seconds + phase).sin());
    Transform {
        translation: foot + Vec3::Y * height,
        rotation: Quat::from_rotation_y(phase + seconds),
        ..Transform::IDENTITY
    }
}

impl Grid {
    /// The world of a plan: [`Self::empty`], filled.
    ///
    /// # Errors
    /// [`ToolError`] where the model cannot be read or is empty.
    pub fn new(plan: &GridPlan) -> Result<Self, ToolError> {
        let (mut yard, kit) = Self::empty(plan)?;
        yard.fill(plan, &kit);
        Ok(yard)
    }

    /// A world with the mesh and the materials, a camera, and nothing to see yet.
    ///
    /// # Errors
    /// [`ToolError`] where the model cannot be read or is empty.
    pub fn empty(plan: &GridPlan) -> Result<(Self, GridKit), ToolError> {
        let mut simulation = Simulation::new();
        let mesh = yard_mesh(&plan.mesh)?;
        let world = &mut simulation.world;
        let mut library = world.resource_mut::<Library>();
        let kit = GridKit { mesh: library.add_mesh(mesh), materials: add_materials(&mut library) };
        // Nothing between the light and the screen but what the screen needs, and a plain background.
        let dusk = Vec3::new(0.03, 0.04, 0.07);
        world.insert_resource(Environment {
            ambient: Vec3::splat(0.12),
            zenith: dusk,
            horizon: dusk,
            ground: dusk,
            tone_map: ToneMap::Clamp,
            ..Environment::default()
        });
        let camera = world.spawn(camera(plan.view, half_width(plan.objects))).id();
        Ok((Self { simulation, camera, movers: Vec::new() }, kit))
    }

    /// Spawns the objects and lights.
    pub fn fill(&mut self, plan: &GridPlan, kit: &GridKit) {
        let world = &mut self.simulation.world;
        let bundle = |(foot, number, phase): (Vec3, f32, f32)| {
            let material = kit.materials[(number * kit.materials.len() as f32) as usize];
            (kit.mesh, material, pose(foot, phase, 0.0))
        };
        // Lists of a million elements on the way would count as memory of the engine: the places are worked out twice.
        let spawned = world.spawn_batch(places(plan.objects).map(bundle)).zip(places(plan.objects));
        let moving = spawned.zip(0..).filter(|(_, i)| moves(*i, plan.moving));
        self.movers = moving.map(|((entity, (foot, _, phase)), _)| Mover { entity, foot, phase }).collect();
        let (mut numbers, half) = (Numbers(2), half_width(plan.objects));
        world.spawn_batch((0..plan.lights).map(|_| {
            let (light, place) = lamp(&mut numbers, half);
            (Light { shadows: plan.shadows, ..light }, place)
        }));
    }

    /// Number of objects that move.
    pub fn moving(&self) -> usize {
        self.movers.len()
    }

    /// Gives every moving object its place in that frame, 60 to the second.
    pub fn advance(&mut self, frame: u32) {
        if self.movers.is_empty() {
            return;
        }
        let seconds = frame as f32 / 60.0;
        let world = &mut self.simulation.world;
        let mut transforms = world.query::<&mut Transform>();
        for mover in &self.movers {
            if let Ok(mut transform) = transforms.get_mut(world, mover.entity) {
                *transform = pose(mover.foot, mover.phase, seconds);
            }
        }
    }
}

/// Generates for every object its place on the ground, a number 0..1 that chooses its material, and its phase.
fn places(objects: u32) -> impl Iterator<Item = (Vec3, f32, f32)> {
    let (side, half) = (side(objects), half_width(objects));
    let mut numbers = Numbers(1);
    (0..objects).map(move |i| {
        let foot = Vec3::new((i % side) as f32 * SPACING - half, 0.0, (i / side) as f32 * SPACING - half);
        (foot, numbers.unit(), numbers.unit() * TAU)
    })
}

/// Objects along a side of the grid.
fn side(objects: u32) -> u32 {
    (f64::from(objects).sqrt().ceil() as u32).max(1)
}

/// From the middle of the grid to the middle of its outermost objects, metres.
fn half_width(objects: u32) -> f32 {
    (side(objects) - 1) as f32 * SPACING / 2.0
}

/// Tells if the object of that number moves; moving ones are spread evenly over all.
fn moves(index: u32, fraction: f32) -> bool {
    let before = |i: u32| (f64::from(i) * f64::from(fraction)).round();
    before(index + 1) > before(index)
}

fn yard_mesh(mesh: &GridMesh) -> Result<Mesh, ToolError> {
    match mesh {
        GridMesh::Cube => Ok(shapes::cube(Vec3::splat(SIZE))),
        GridMesh::Sphere => Ok(shapes::sphere(SIZE / 2.0, 32, 17)),
        GridMesh::Model(path) => {
            // A library of its own: the model's materials and images are not drawn.
            let mut library = Library::default();
            import::load_model(path, &mut library)?;
            let meshes = library.meshes().map(|(_, entry)| &entry.mesh);
            let largest = meshes.max_by_key(|mesh| mesh.triangle_count()).filter(|mesh| mesh.triangle_count() > 0);
            largest.map(fitted).ok_or_else(|| ToolError::NoMesh(path.clone()))
        }
    }
}

/// The mesh centred and scaled to the size of a cube, in one colour.
fn fitted(mesh: &Mesh) -> Mesh {
    let bounds = mesh.aabb();
    let (center, size) = ((bounds.min + bounds.max) * 0.5, (bounds.max - bounds.min).max_element());
    let scale = SIZE / size.max(f32::MIN_POSITIVE);
    let mut mesh = mesh.clone();
    mesh.colors.clear();
    mesh.positions.iter_mut().for_each(|p| *p = (*p - center) * scale);
    mesh
}

fn add_materials(library: &mut Library) -> Vec<MaterialId> {
    let surfaces = maps::surfaces().into_iter().enumerate();
    surfaces
        .map(|(i, surface)| {
            let mut map = |image| Some(Map::new(library.add_image(image)));
            let material = Material {
                name: format!("surface {i}"),
                base_map: map(surface.base),
                normal_map: map(surface.normal),
                specular_map: map(surface.specular),
                specular_factor: Vec3::ONE,
                ..Material::new(Shading::Blinn)
            };
            library.add_material(material)
        })
        .collect()
}

/// A lamp over the grid.
fn lamp(numbers: &mut Numbers, half: f32) -> (Light, Transform) {
    let (x, z) = ((numbers.unit() * 2.0 - 1.0) * half, (numbers.unit() * 2.0 - 1.0) * half);
    let y = 2.0 + numbers.unit() * 2.0;
    let hue = numbers.unit();
    // HSL of that hue, saturation 0.6, lightness 0.7, decoded to linear light.
    let channel = |n: f32| (0.7 - 0.18 * triangle((n / 12.0 + hue).fract() * 12.0)).powf(2.2);
    let color = Vec3::new(channel(0.0), channel(8.0), channel(4.0));
    let light = Light::point(14.0, 10.0).with_attenuation(Light::INVERSE_SQUARE).with_color(color);
    (light, Transform::from_xyz(x, y, z))
}

/// The wave of a channel in the conversion from HSL to RGB: −1 to 1, period 12.
fn triangle(k: f32) -> f32 {
    (k - 3.0).min(9.0 - k).clamp(-1.0, 1.0)
}

fn camera(view: GridView, half: f32) -> (Camera, Transform) {
    let projection = Projection::Perspective { fov_y: 60f32.to_radians(), aspect: None };
    let camera = Camera { projection, ..Camera::default() };
    let at = match view {
        GridView::Wide => {
            let radius = half * 2f32.sqrt() + SIZE;
            let eye = Vec3::new(0.0, 1.0, 1.0).normalize() * radius * 2.0;
            Transform::from_translation(eye).looking_at(Vec3::ZERO, Vec3::Y)
        }
        GridView::Inside => {
            // Between rows, so that the view down them holds about a sixth of the grid.
            let between = |v: f32| ((v + half) / SPACING).floor() * SPACING - half + SPACING / 2.0;
            let eye = Vec3::new(between(0.194 * half), 2.0, between(0.0));
            Transform::from_translation(eye).looking_to(Vec3::X, Vec3::Y)
        }
    };
    (camera, at)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fraction_of_the_objects_moves_spread_evenly() {
        for fraction in [0.0, 0.01, 0.1, 0.37, 1.0] {
            let moving: Vec<u32> = (0..1000).filter(|&i| moves(i, fraction)).collect();
            assert_eq!(moving.len(), (1000.0 * fraction).round() as usize, "{fraction}");
            let gaps = moving.windows(2).map(|pair| pair[1] - pair[0]);
            let (least, most) = (gaps.clone().min().unwrap_or(0), gaps.max().unwrap_or(0));
            assert!(most - least <= 1, "{fraction}: gaps {least} to {most}");
        }
    }

    #[test]
    fn meshes_are_of_the_size_that_is_said() {
        for (mesh, vertices, triangles) in [(GridMesh::Cube, 24, 12), (GridMesh::Sphere, 594, 1024)] {
            let mesh = yard_mesh(&mesh).expect("a mesh");
            assert_eq!((mesh.positions.len(), mesh.triangle_count()), (vertices, triangles));
            let longest = |mesh: &Mesh| (mesh.aabb().max - mesh.aabb().min).max_element();
            assert!((longest(&mesh) - SIZE).abs() < 1e-6);
            let mut large = mesh.clone();
            large.positions.iter_mut().for_each(|p| *p = *p * 40.0 + Vec3::X);
            assert!((longest(&fitted(&large)) - SIZE).abs() < 1e-4);
        }
    }

    #[test]
    fn meshes_are_named_or_files() {
        assert_eq!("sphere".parse(), Ok(GridMesh::Sphere));
        assert_eq!("a/b.GLB".parse(), Ok(GridMesh::Model("a/b.GLB".into())));
        assert!("torus".parse::<GridMesh>().is_err());
    }
}
