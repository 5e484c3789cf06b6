//! Everything about a scene that its types cannot say: names that must be known, numbers that must make sense.
//!
//! One walk over the whole file collects every fault with its place, so that `relief check` shows all at once. The
//! limits are wide: they keep arithmetic finite and memory bounded, not scenes tasteful.

pub mod names;
#[cfg(feature = "vehicles")]
mod roads;
mod sensor_names;
mod surfaces;

use super::faults::{Fault, Trail, unknown};
use super::files::{self, Files};
use super::format::{Camera, Entity, Generator, Grid, Lights, MeshSource, Place, Region, Scatter, Scene, Transform};
use super::places::Step;
use super::spawn;
use super::values::{Color, Named, Scale};
use glam::{Affine3A, DVec3, Vec3};
use std::fmt::Display;
use systems::lights::LightPolicy;
use systems::space::{FARTHEST, LARGEST};

/// Metres; also factors of scale.
pub const SIZES: (f32, f32) = (1e-5, LARGEST as f32);
pub const BRIGHTEST: f32 = 1e9;
/// About: a body, wheels and lamps.
const PARTS_OF_A_VEHICLE: u64 = 24;
/// Entities of a scene.
const MOST_ENTITIES: u64 = 4_000_000;

/// Seconds: a longer step of drivers and physics would be computed for minutes, and shows nothing of them.
const LONGEST_WITH_VEHICLES: f64 = 1.0;

fn has_vehicles(scene: &Scene) -> bool {
    let of_generator = |g: &Generator| !g.vehicles.is_empty() || g.entity.vehicle.is_some();
    scene.entities.iter().any(|e| e.vehicle.is_some()) || scene.generators.iter().any(of_generator)
}

/// All faults of a scene whose files have been read.
pub fn faults(scene: &Scene, files: &Files) -> Vec<Fault> {
    let mut check = Check::new(scene, files);
    check.scene();
    check.faults.extend(sensor_names::duplicates(scene));
    check.faults
}

/// A walk over a file: where it is, and what it found.
pub struct Check<'a> {
    pub(super) scene: &'a Scene,
    files: &'a Files,
    /// Of the scene's routes, metres; `None` where one is refused for its points.
    #[cfg(feature = "vehicles")]
    route_lengths: Vec<Option<f64>>,
    at: Trail,
    /// Scale and place of the entity that is looked at, from the transforms above it.
    place: Affine3A,
    /// Names of meshes, materials and classes are not known: they are those of whatever scene takes what is checked.
    pub is_of_any_scene: bool,
    pub faults: Vec<Fault>,
}

impl<'a> Check<'a> {
    pub fn new(scene: &'a Scene, files: &'a Files) -> Self {
        Self {
            scene,
            files,
            #[cfg(feature = "vehicles")]
            route_lengths: scene.routes.entries().iter().map(|(_, route)| roads::driven_length(route)).collect(),
            at: Trail::default(),
            place: Affine3A::IDENTITY,
            is_of_any_scene: false,
            faults: Vec::new(),
        }
    }

    pub fn fault(&mut self, message: impl Display) {
        self.faults.push(self.at.fault(message));
    }

    pub fn inside(&mut self, step: Step, key: &str, check: impl FnOnce(&mut Self)) {
        let inner = self.at.enter(step, key);
        let outer = std::mem::replace(&mut self.at, inner);
        check(self);
        self.at = outer;
    }

    pub fn field(&mut self, name: &'static str, check: impl FnOnce(&mut Self)) {
        self.inside(Step::Field(name), "", check);
    }

    pub fn each<'b, T>(&mut self, name: &'static str, items: &'b [T], mut check: impl FnMut(&mut Self, &'b T)) {
        self.field(name, |c| {
            for (i, item) in items.iter().enumerate() {
                c.inside(Step::Index(i), "", |c| check(c, item));
            }
        });
    }

    pub fn number(&mut self, name: &'static str, value: f32, min: f32, max: f32) {
        self.field(name, |c| c.in_range(value, min, max));
    }

    pub fn in_range(&mut self, value: f32, min: f32, max: f32) {
        if !(min..=max).contains(&value) {
            self.fault(format_args!("expected a number from {min} to {max}, found {value}"));
        }
    }

    pub fn numbers(&mut self, name: &'static str, values: &[f32], min: f32, max: f32) {
        self.field(name, |c| {
            for (i, &value) in values.iter().enumerate() {
                c.inside(Step::Index(i), "", |c| c.in_range(value, min, max));
            }
        });
    }

    pub fn position(&mut self, name: &'static str, value: &[f64; 3]) {
        self.field(name, |c| {
            for (i, value) in value.iter().enumerate() {
                if !(-FARTHEST..=FARTHEST).contains(value) {
                    let message = format!("expected a number from -{FARTHEST} to {FARTHEST}, found {value}");
                    c.inside(Step::Index(i), "", |c| c.fault(message));
                }
            }
        });
    }

    fn count(&mut self, name: &'static str, value: u32, min: u32, max: u32) {
        if !(min..=max).contains(&value) {
            self.field(name, |c| c.fault(format_args!("expected a count from {min} to {max}, found {value}")));
        }
    }

    pub fn color(&mut self, name: &'static str, color: Color, max: f32) {
        match color.0 {
            Ok(rgb) => self.numbers(name, &rgb.to_array(), 0.0, max),
            Err(bad) => self.field(name, |c| c.fault(bad)),
        }
    }

    fn scale(&mut self, name: &'static str, scale: Scale, mirrored_too: bool) {
        let (min, max) = SIZES;
        let check = |c: &mut Self, s: f32| {
            if mirrored_too && s < 0.0 {
                c.in_range(s, -max, -min);
            } else {
                c.in_range(s, min, max);
            }
        };
        self.field(name, |c| match scale {
            Scale::Uniform(s) => check(c, s),
            Scale::PerAxis(axes) => {
                for (i, s) in axes.into_iter().enumerate() {
                    c.inside(Step::Index(i), "", |c| check(c, s));
                }
            }
        });
    }

    fn known_material(&mut self, name: &str) {
        if self.scene.materials.get(name).is_none() && !self.is_of_any_scene {
            let message = unknown("material", name, self.scene.materials.names());
            self.fault(message);
        }
    }

    fn known_mesh(&mut self, name: &str) {
        if self.scene.meshes.get(name).is_none() && !self.is_of_any_scene {
            let message = unknown("mesh", name, self.scene.meshes.names());
            self.fault(message);
        }
    }

    fn lights(&mut self, lights: Option<&Lights>) {
        let Some((lights, tolerance)) = lights.and_then(|lights| Some((lights, lights.tolerance?))) else { return };
        self.field("lights", |c| {
            c.number("tolerance", tolerance, 0.0, 1.0);
            if !matches!(lights.policy(), LightPolicy::Enough(_)) {
                c.field("tolerance", |c| c.fault("only allowed with the policy enough"));
            }
        });
    }

    fn scene(&mut self) {
        let scene = self.scene;
        self.number("piece_metres", scene.piece_metres, 0.0, SIZES.1);
        self.lights(scene.lights.as_ref());
        scene.origin.iter().for_each(|origin| self.position("origin", origin));
        scene.geo_origin.iter().for_each(|origin| self.geo_origin(origin));
        self.field("environment", |c| {
            let e = &scene.environment;
            c.color("ambient", e.ambient, BRIGHTEST);
            c.color("zenith", e.zenith, BRIGHTEST);
            c.color("horizon", e.horizon, BRIGHTEST);
            c.color("ground", e.ground, BRIGHTEST);
            c.number("exposure", e.exposure, 0.0, 1e6);
        });
        self.field("clock", |c| {
            c.number("step_seconds", scene.clock.step_seconds as f32, 1e-6, 1e3);
            let (seconds, most) = (scene.clock.step_seconds, LONGEST_WITH_VEHICLES);
            if seconds > most && has_vehicles(scene) {
                let message = format!("expected at most {most} where vehicles drive, found {seconds}");
                c.field("step_seconds", |c| c.fault(message));
            }
            c.number("speed", scene.clock.speed as f32, 0.0, 1e3);
        });
        self.field("materials", |c| {
            c.entries(&scene.materials, Self::material);
        });
        self.field("meshes", |c| {
            c.entries(&scene.meshes, Self::mesh);
        });
        self.classes(&scene.classes);
        self.cells();
        self.roads();
        let mut entities = 0u64;
        self.each("entities", &scene.entities, |c, e| entities = entities.saturating_add(c.entity(e, &[], false)));
        self.each("generators", &scene.generators, |c, g| entities = entities.saturating_add(c.generator(g)));
        // A count that is refused by itself need not be refused twice.
        if entities > MOST_ENTITIES && self.faults.is_empty() {
            let message = format!("expected at most {MOST_ENTITIES} entities, found {entities}");
            self.field("generators", |c| c.fault(message));
        }
    }

    pub fn entries<'b, T>(&mut self, named: &'b Named<T>, mut check: impl FnMut(&mut Self, &'b T)) {
        for (i, (name, value)) in named.entries().iter().enumerate() {
            self.inside(Step::Entry(i), name, |c| {
                if named.position(name) != Some(i) {
                    c.fault(format_args!("duplicate name {name:?}"));
                }
                check(c, value);
            });
        }
    }

    /// Returns how many entities it becomes. `alternatives`: the meshes that a generator may give it.
    pub(super) fn entity(&mut self, e: &'a Entity, alternatives: &'a [String], attached: bool) -> u64 {
        if let (Some(_), false) = (&e.node, attached) {
            self.field("node", |c| c.fault("only allowed for entities in `attach`"));
        }
        self.field("transform", |c| c.transform(&e.transform));
        let above = self.place;
        self.nested_place(e);
        let meshes: Vec<&str> = e.mesh.iter().chain(alternatives).map(String::as_str).collect();
        if let Some(mesh) = &e.mesh {
            self.field("mesh", |c| c.known_mesh(mesh));
        }
        if let Some(material) = &e.material {
            self.field("material", |c| c.known_material(material));
        }
        if let Some(metres) = e.piece_metres {
            self.number("piece_metres", metres, 0.0, SIZES.1);
        }
        self.lights(e.lights.as_ref());
        if !e.casts_shadows.0 {
            self.no_shadow(e, meshes.is_empty());
        }
        if let Some(light) = &e.light {
            self.field("light", |c| c.light(light));
        }
        if let Some(camera) = &e.camera {
            self.field("camera", |c| c.camera(camera));
        }
        if let Some(sensor) = &e.sensor {
            self.field("sensor", |c| c.sensor(sensor, e.name.is_some()));
        }
        if let Some(class) = &e.class {
            self.field("class", |c| c.known_class(class));
        }
        if let Some(spin) = &e.spin {
            self.field("spin", |c| {
                c.direction("axis", spin.axis);
                c.number("degrees_per_second", spin.degrees_per_second, -1e6, 1e6);
            });
        }
        if e.vehicle.is_some() && (!meshes.is_empty() || !e.figure.is_empty()) {
            self.field("vehicle", |c| c.fault("expected either a vehicle, which has a model of its own, or a mesh"));
        }
        if e.vehicle.is_some() && e.piece_metres.is_some() {
            self.field("piece_metres", |c| c.fault("not allowed with a vehicle, which is drawn as a whole"));
        }
        if e.vehicle.is_some() && (e.ground || e.obstacle.is_some() || e.spin.is_some()) {
            self.field("vehicle", |c| {
                c.fault("ground, obstacle and spin are not allowed with a vehicle, which moves by itself")
            });
        }
        for (field, below) in [("children", &e.children), ("attach", &e.attach)] {
            for (i, _) in below.iter().enumerate().filter(|(_, item)| item.vehicle.is_some()) {
                self.field(field, |c| {
                    let message = "vehicles are only allowed at the top level of the scene: they move by themselves";
                    c.inside(Step::Index(i), "", |c| c.field("vehicle", |c| c.fault(message)));
                });
            }
        }
        if let Some(vehicle) = &e.vehicle {
            self.field("vehicle", |c| c.vehicle(e, vehicle));
        }
        if let Some(head) = &e.signal_head {
            self.field("signal_head", |c| c.known_group(&head.signal, head.group));
        }
        if !e.figure.is_empty() && !meshes.is_empty() {
            self.field("figure", |c| c.fault("expected either mesh or figure"));
        }
        self.each("figure", &e.figure, |c, mesh| c.figure(mesh));
        let mut entities = meshes.iter().map(|mesh| self.entities_of(mesh)).max().unwrap_or(1);
        if e.vehicle.is_some() {
            entities += PARTS_OF_A_VEHICLE;
        }
        self.each("attach", &e.attach, |c, item| {
            c.attached(item, &meshes);
            entities = entities.saturating_add(c.entity(item, &[], true));
        });
        self.each("children", &e.children, |c, child| {
            entities = entities.saturating_add(c.entity(child, &[], false));
        });
        self.place = above;
        entities.saturating_add(self.mounted_on(e))
    }

    /// Combines an entity's transform with those above it: each of them may be sound, and all together not. What is
    /// attached counts as if its node were at the model's origin.
    fn nested_place(&mut self, e: &Entity) {
        let is_nested = self.place != Affine3A::IDENTITY;
        self.place *= spawn::transform(&e.transform).compute_affine();
        if !is_nested {
            return;
        }
        let place = self.place.translation.as_dvec3();
        let columns = [self.place.matrix3.x_axis, self.place.matrix3.y_axis, self.place.matrix3.z_axis];
        let scale = columns.map(|axis| axis.abs().max_element()).into_iter().fold(0.0, f32::max);
        let message = if !place.abs().cmple(DVec3::splat(FARTHEST)).all() {
            format!("expected a place within {FARTHEST} m, found {place} with the transforms above it")
        } else if scale > SIZES.1 {
            format!("expected scales of at most {} together, found {scale} with the transforms above it", SIZES.1)
        } else {
            return;
        };
        self.field("transform", |c| c.fault(message));
        // What is below is as far away for the same reason.
        self.place = Affine3A::IDENTITY;
    }

    fn no_shadow(&mut self, e: &Entity, has_no_mesh: bool) {
        let message = match &e.light {
            _ if e.vehicle.is_some() => "not allowed with a vehicle, which casts shadows as a whole",
            Some(_) if has_no_mesh && e.figure.is_empty() => {
                "expected a mesh beside it; whether a light casts shadows is said by its own field `shadows`"
            }
            None if has_no_mesh && e.figure.is_empty() => {
                "expected a mesh beside it; what is below an entity says so itself"
            }
            _ => return,
        };
        self.field("casts_shadows", |c| c.fault(message));
    }

    /// How many entities something with that mesh is: a model has one for each node and instance.
    pub(super) fn entities_of(&self, mesh: &str) -> u64 {
        let Some(MeshSource::Model(source)) = self.scene.meshes.get(mesh) else { return 1 };
        let Some(model) = self.files.model(&source.file) else { return 1 };
        let nodes = files::nodes(model, source.node.as_deref());
        1 + nodes.map(|n| (1 + n.parts.len() * n.instances.len().max(1)) as u64).sum::<u64>()
    }

    fn attached(&mut self, item: &'a Entity, meshes: &[&str]) {
        let Some(node) = &item.node else {
            return self.fault("missing field `node`: the node of the model that this is attached to");
        };
        if meshes.is_empty() {
            return self.fault("expected `mesh` to be a model beside `attach`");
        }
        for mesh in meshes {
            match self.scene.meshes.get(mesh) {
                Some(MeshSource::Model(source)) => {
                    // A file that cannot be read has been complained about already.
                    let Some(model) = self.files.model(&source.file) else { continue };
                    let mut nodes = files::nodes(model, source.node.as_deref());
                    if !nodes.any(|n| n.name == *node) {
                        let nodes = files::nodes(model, source.node.as_deref());
                        let message = unknown("node", node, nodes.map(|n| n.name.as_str()));
                        self.field("node", |c| c.fault(message));
                    }
                }
                Some(_) => self.fault(format_args!("mesh {mesh:?} is not a model and has no nodes")),
                None => {}
            }
        }
    }

    pub(super) fn figure(&mut self, mesh: &'a str) {
        self.known_mesh(mesh);
        let Some(MeshSource::Model(source)) = self.scene.meshes.get(mesh) else { return };
        let Some(model) = self.files.model(&source.file) else { return };
        let parts: usize = files::nodes(model, source.node.as_deref()).map(|n| n.parts.len()).sum();
        if parts != 1 {
            self.fault(format_args!("expected a model with one mesh, found {parts} in {mesh:?}"));
        }
    }

    pub fn transform(&mut self, t: &Transform) {
        t.translation.iter().for_each(|translation| self.position("translation", translation));
        self.scale("scale", t.scale, true);
        let given = [t.rotation_degrees.is_some(), t.quaternion.is_some(), t.look_at.is_some()];
        if given.into_iter().filter(|&given| given).count() > 1 {
            self.fault("expected one of rotation_degrees, quaternion and look_at");
        }
        if let Some(degrees) = &t.rotation_degrees {
            self.numbers("rotation_degrees", degrees, -1e6, 1e6);
        }
        if let Some(q) = &t.quaternion {
            let length = q.iter().map(|c| c * c).sum::<f32>().sqrt();
            self.field("quaternion", |c| {
                if !(0.5..=2.0).contains(&length) {
                    c.fault(format_args!("expected a unit quaternion (x, y, z, w), found one of length {length}"));
                }
            });
        }
        if let Some(target) = &t.look_at {
            self.position("look_at", target);
            let translation = DVec3::from_array(t.translation.unwrap_or_default());
            if DVec3::from_array(*target).distance(translation) < 1e-6 {
                self.field("look_at", |c| c.fault("expected a point other than the translation"));
            }
        }
    }

    fn direction(&mut self, name: &'static str, value: [f32; 3]) {
        let length = Vec3::from_array(value).length();
        if !(1e-6..=1e6).contains(&length) {
            self.field(name, |c| c.fault(format_args!("expected a direction, found one of length {length}")));
        }
    }

    fn camera(&mut self, camera: &Camera) {
        if let Some(fov) = camera.fov_y_degrees {
            self.number("fov_y_degrees", fov, 0.1, 170.0);
        }
        if let Some(aspect) = camera.aspect {
            self.number("aspect", aspect, 1e-3, 1e3);
        }
        if let Some(half_height) = camera.orthographic_half_height {
            self.number("orthographic_half_height", half_height, SIZES.0, SIZES.1);
            if camera.fov_y_degrees.is_some() {
                self.fault("expected either fov_y_degrees or orthographic_half_height");
            }
        }
        self.number("near", camera.near, SIZES.0, SIZES.1);
        if let Some(far) = camera.far {
            self.number("far", far, camera.near.max(SIZES.0) * 1.001, FARTHEST as f32);
        }
    }

    fn generator(&mut self, g: &'a Generator) -> u64 {
        let mut copies = 0;
        self.field("place", |c| match &g.place {
            Place::Grid(grid) => copies = c.grid(grid),
            Place::Scatter(scatter) => copies = c.scatter(scatter),
            Place::Along(along) => copies = c.along(along),
        });
        let mut each = 0;
        self.field("entity", |c| {
            each = c.entity(&g.entity, &g.meshes, false);
            if !g.vehicles.is_empty() && g.entity.vehicle.is_none() {
                each += PARTS_OF_A_VEHICLE;
            }
            if g.entity.camera.is_some() {
                c.field("camera", |c| c.fault("cameras are not allowed in generators"));
            }
        });
        if !g.vehicles.is_empty() {
            self.field("vehicles", Self::generated_vehicles);
        }
        self.each("meshes", &g.meshes, |c, mesh| c.known_mesh(mesh));
        self.each("materials", &g.materials, |c, material| c.known_material(material));
        self.each("lights", &g.lights, Self::light);
        self.numbers("random_scale", &g.random_scale, SIZES.0, SIZES.1);
        let [least, most] = g.random_scale;
        if least > most {
            let message = format!("expected (least, most), found ({least}, {most}); write ({most}, {least})");
            self.field("random_scale", |c| c.fault(message));
        }
        copies.saturating_mul(each)
    }

    fn grid(&mut self, grid: &Grid) -> u64 {
        let copies = grid.counts.iter().fold(1u64, |product, &n| product.saturating_mul(n.into()));
        if copies == 0 || copies > MOST_ENTITIES {
            let message = format!("expected from 1 to {MOST_ENTITIES} copies in all, found {copies}");
            self.field("counts", |c| c.fault(message));
        }
        self.numbers("spacing", &grid.spacing, -FARTHEST as f32, FARTHEST as f32);
        grid.center.iter().for_each(|center| self.position("center", center));
        self.numbers("jitter", &grid.jitter, 0.0, FARTHEST as f32);
        copies
    }

    fn scatter(&mut self, scatter: &Scatter) -> u64 {
        self.count("count", scatter.count, 1, MOST_ENTITIES as u32);
        self.number("min_distance", scatter.min_distance, 0.0, FARTHEST as f32);
        self.field("region", |c| match &scatter.region {
            Region::Box { min, max } => {
                c.position("min", min);
                c.position("max", max);
                if min.iter().zip(max).any(|(min, max)| min > max) {
                    c.fault(format_args!("expected min to be at most max on every axis, found {min:?} and {max:?}"));
                }
            }
            Region::Disc { center, radius } => {
                c.position("center", center);
                c.number("radius", *radius, SIZES.0, FARTHEST as f32);
            }
        });
        scatter.count.into()
    }
}
