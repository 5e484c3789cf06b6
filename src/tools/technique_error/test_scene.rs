//! A world for the comparison: one figure twice, coarse as techniques have it and displaced, of which one is shown; a
//! sun, a lamp and a spot; a camera. All around is black, so that light passes add up.

use super::job::CompareJob;
use super::maps::Maps;
use crate::frames::FrameError;
use crate::renderer::{Gpu, Occlusion, OutputSet, Outputs, Settings, SingleView};
use crate::tools::compare::quarters;
use bevy_ecs::prelude::*;
use glam::{Mat3, Quat, Vec3};
use systems::Simulation;
use systems::assets::displace::{Displacement, displace};
use systems::assets::levels::LevelOfDetail;
use systems::assets::{Image, Library, Map, Material, MaterialId, Mesh, Shading, Technique};
use systems::draw::{Camera, Environment, Projection, ToneMap, View};
use systems::lights::{Light, LightKind};
use systems::space::{Hidden, Transform};

/// From the eye to the middle of the figure, metres.
const DISTANCE: f32 = 4.2;
const AMBIENT: Vec3 = Vec3::splat(0.06);
/// The sun's place among the lights.
pub(super) const SUN: usize = 0;
/// Light of the sun, as a sum of its colours, below which a surface counts as turned away from it.
pub(super) const FAINT: f32 = 0.01;

/// Lights that are on.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Lit {
    All,
    /// Only the light that comes from everywhere.
    Ambient,
    /// One light, and nothing from everywhere.
    Only(usize),
}

/// Figure that is seen, of the two.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Shown {
    Coarse(Technique),
    /// By its interpolated normals.
    Displaced,
}

impl Shown {
    fn technique(self) -> Technique {
        match self {
            Self::Coarse(technique) => technique,
            Self::Displaced => Technique::Off,
        }
    }
}

/// The world and what draws it.
pub(super) struct TestScene {
    pub simulation: Simulation,
    pub renderer: SingleView,
    /// Triangles of the displaced figure.
    pub triangles: usize,
    pub displaced: Mesh,
    coarse: Entity,
    fine: Entity,
    camera: Entity,
    lights: Vec<(Entity, Light)>,
    material: MaterialId,
}

impl TestScene {
    pub fn new(job: &CompareJob, maps: Maps) -> Result<Self, FrameError> {
        let mut renderer = SingleView::new(&Gpu::headless()?);
        renderer.time_passes();
        let mut simulation = Simulation::new();
        let mut library = simulation.world.resource_mut::<Library>();
        let by = Displacement { heights: &maps.heights, scale_uv: maps.scale, rest: Material::default().height_rest };
        let displaced = displace(&job.figure.fine(maps.heights.size()), &by);
        let coarse = library.add_mesh(job.figure.coarse());
        let fine = library.add_mesh_without_levels(displaced.clone());
        let material = material(&mut library, maps);
        let material = library.add_material(material);
        let world = &mut simulation.world;
        let coarse = world.spawn((coarse, material)).id();
        let fine = world.spawn((fine, material)).id();
        let lights = lights().map(|(light, place)| (world.spawn((light.clone(), place)).id(), light));
        let projection = Projection::Perspective { fov_y: 30f32.to_radians(), aspect: Some(4.0 / 3.0) };
        let camera =
            world.spawn((Camera { projection, ..Camera::default() }, camera_place(job.angle.to_radians()))).id();
        Ok(Self {
            triangles: displaced.triangle_count(),
            displaced,
            coarse,
            fine,
            camera,
            lights: lights.into(),
            material,
            renderer,
            simulation,
        })
    }

    /// The graphics adapter in words.
    pub fn adapter(&self) -> String {
        self.renderer.gpu().name()
    }

    /// Direction of the light's rays reversed, and how far away it is, seen from a point.
    pub fn toward_light(&self, light: usize, from: Vec3) -> (Vec3, f32) {
        let Some((entity, light)) = self.lights.get(light) else { return (Vec3::Y, f32::INFINITY) };
        let place = self.simulation.world.get::<Transform>(*entity).copied().unwrap_or_default();
        if light.kind == LightKind::Directional {
            return (-place.forward(), f32::INFINITY);
        }
        let way = place.translation - from;
        (way.normalize_or(Vec3::Y), way.length())
    }

    pub fn light_count(&self) -> usize {
        self.lights.len()
    }

    /// The view of a picture of that size.
    pub fn view(&self, size: (u32, u32)) -> View {
        crate::viewpoint::Viewpoint::from(self.camera).view(&self.simulation.world, size)
    }

    /// Makes the renderer ready to draw.
    pub fn prepare(&mut self, size: (u32, u32), shown: Shown, lit: Lit, samples: u32) -> Result<(), FrameError> {
        self.light(lit);
        let world = &mut self.simulation.world;
        let (seen, hidden) = match shown {
            Shown::Coarse(_) => (self.coarse, self.fine),
            Shown::Displaced => (self.fine, self.coarse),
        };
        if world.get::<Hidden>(hidden).is_none() {
            world.entity_mut(hidden).insert(Hidden);
        }
        world.entity_mut(seen).remove::<Hidden>();
        self.simulation.frame();
        let (occlusion, levels) = (Occlusion::Off, LevelOfDetail::OFF);
        let settings =
            Settings { technique: Some(shown.technique()), samples, occlusion, levels, ..Settings::default() };
        let view = self.view(size);
        self.simulation.with_frame(|frame| self.renderer.prepare(frame, &view, &settings))?;
        Ok(())
    }

    fn light(&mut self, lit: Lit) {
        for (i, (entity, light)) in self.lights.iter().enumerate() {
            let enabled = lit == Lit::All || lit == Lit::Only(i);
            if let Some(mut own) = self.simulation.world.get_mut::<Light>(*entity) {
                own.set_if_neq(Light { enabled, ..light.clone() });
            }
        }
        let ambient = if matches!(lit, Lit::Only(_)) { Vec3::ZERO } else { AMBIENT };
        let dark = Environment {
            ambient,
            zenith: Vec3::ZERO,
            horizon: Vec3::ZERO,
            ground: Vec3::ZERO,
            exposure: 1.0,
            tone_map: ToneMap::Clamp,
            ..Environment::default()
        };
        self.simulation.world.insert_resource(dark);
    }

    /// The picture in linear light, before it is cut at 1: the mean of as many samples as pictures have.
    pub fn linear(&mut self, size: (u32, u32), shown: Shown, lit: Lit) -> Result<Vec<Vec3>, FrameError> {
        self.linear_of_samples(size, shown, lit, Settings::default().samples)
    }

    /// The same with so many samples in a pixel.
    pub fn linear_of_samples(
        &mut self,
        size: (u32, u32),
        shown: Shown,
        lit: Lit,
        samples: u32,
    ) -> Result<Vec<Vec3>, FrameError> {
        self.prepare(size, shown, lit, samples)?;
        self.renderer.draw_picture();
        let pixels = self.renderer.read_linear().unwrap_or_default();
        self.renderer.gpu().check()?;
        Ok(pixels.into_iter().map(|[r, g, b, _]| Vec3::new(r, g, b)).collect())
    }

    /// Depth and the like of the figure shown; `None` does not happen.
    pub fn outputs(&mut self, size: (u32, u32), shown: Shown) -> Result<Option<Outputs>, FrameError> {
        self.prepare(size, shown, Lit::All, 1)?;
        Ok(self.renderer.draw_outputs(OutputSet::ALL.beside_color()))
    }

    /// Counts for each pixel those of its 2 × 2 parts that show the coarse figure.
    pub fn coverage(&mut self, (width, height): (u32, u32)) -> Result<Vec<u8>, FrameError> {
        let outputs = self.outputs((2 * width, 2 * height), Shown::Coarse(Technique::Off))?;
        let shows = outputs.map(|outputs| outputs.entities()).unwrap_or_default();
        self.renderer.gpu().check()?;
        Ok(quarters(&shows, width).map(|parts| parts.iter().flatten().count() as u8).collect())
    }

    /// Tells for each pixel if a technique hides the sun: `None` where the surface turns away from it.
    pub fn sun_shadow(&mut self, size: (u32, u32), technique: Technique) -> Result<Vec<Option<bool>>, FrameError> {
        let shown = Shown::Coarse(technique);
        self.self_shadow(0.0);
        let open = self.linear(size, shown, Lit::Only(SUN))?;
        self.self_shadow(1.0);
        let shadowed = self.linear(size, shown, Lit::Only(SUN))?;
        let is_dark = |(open, shadowed): (Vec3, &Vec3)| {
            let (open, shadowed) = (open.element_sum(), shadowed.element_sum());
            (open > FAINT).then_some(shadowed < 0.5 * open)
        };
        Ok(open.into_iter().zip(&shadowed).map(is_dark).collect())
    }

    fn self_shadow(&mut self, share: f32) {
        let mut library = self.simulation.world.resource_mut::<Library>();
        library.edit_material(self.material, |material| material.self_shadow = share);
    }
}

/// Above the figure and in front of it, by an angle from the vertical.
fn camera_place(angle: f32) -> Transform {
    let (sin, cos) = angle.sin_cos();
    let (back, up) = (Vec3::new(0.0, cos, sin), Vec3::new(0.0, sin, -cos));
    let rotation = Quat::from_mat3(&Mat3::from_cols(up.cross(back), up, back));
    Transform::from_translation(back * DISTANCE).with_rotation(rotation)
}

/// A sun, a lamp and a spot, from three sides and low enough that bumps have shadows.
fn lights() -> [(Light, Transform); 3] {
    let from = |place: Vec3| Transform::from_translation(place).looking_at(Vec3::ZERO, Vec3::Z);
    let cone = LightKind::Spot { outer: 32f32.to_radians(), inner: Some(18f32.to_radians()), exponent: 0.0 };
    let spot = Light { kind: cone, ..Light::point(7.0, 8.0) };
    [
        (Light::directional(0.55).with_color(Vec3::new(1.0, 0.95, 0.85)), from(Vec3::new(-2.0, 1.5, 0.6))),
        (Light::point(1.3, 6.0).with_color(Vec3::new(0.55, 0.75, 1.0)), from(Vec3::new(1.5, 1.0, 0.9))),
        (spot.with_color(Vec3::new(1.0, 0.6, 0.4)), from(Vec3::new(0.7, 2.0, -2.2))),
    ]
}

fn material(library: &mut Library, maps: Maps) -> Material {
    let mut map = |image: Image| Some(Map::new(library.add_image(image)));
    let [first, second] = maps.horizon;
    // A colour of its own where there is none: bumps show on grey.
    let base_factor = if maps.base.is_some() { Vec3::ONE } else { Vec3::splat(0.6) };
    let specular = Vec3::splat(if maps.specular.is_some() { 0.8 } else { 0.15 });
    Material {
        shininess: 40.0,
        base_factor: base_factor.extend(1.0),
        base_map: maps.base.and_then(&mut map),
        specular_factor: specular,
        specular_map: maps.specular.and_then(&mut map),
        normal_map: map(maps.normal),
        height_scale_uv: maps.scale,
        height_map: map(maps.height),
        horizon_maps: [map(first), map(second)],
        offset_map: map(maps.offset),
        environment_map: map(maps.environment),
        ..Material::new(Shading::Blinn)
    }
}
