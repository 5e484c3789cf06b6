//! Entities, and what is below and on them.

use super::walk::Check;
use crate::scene::format::entities::{self, Camera, Entity, Transform};
use crate::scene::format::surfaces::MeshSource;
use crate::scene::format::values::{SMALLEST, Scale};
use crate::scene::read::files;
use crate::scene::text::faults::unknown;
use glam::{Affine3A, DVec3};
use systems::describe::Step;
use systems::space::{FARTHEST, LARGEST};

/// About: a body, wheels and lamps.
pub const PARTS_OF_A_VEHICLE: u64 = 24;

impl<'a> Check<'a> {
    /// Returns how many entities it becomes. `alternatives`: the meshes that a generator may give it.
    pub(super) fn entity(&mut self, e: &'a Entity, alternatives: &'a [String], attached: bool) -> u64 {
        if let (Some(_), false) = (&e.node, attached) {
            self.field("node", |c| c.fault("only allowed for entities in `attach`"));
        }
        self.field("transform", |c| {
            c.described(&e.transform);
            c.transform(&e.transform);
        });
        let above = self.place;
        self.nested_place(e);
        let meshes: Vec<&str> = e.mesh.iter().chain(alternatives).map(String::as_str).collect();
        if let Some(mesh) = &e.mesh {
            self.field("mesh", |c| c.known_mesh(mesh));
        }
        if let Some(material) = &e.material {
            self.field("material", |c| c.known_material(material));
        }
        self.part("piece_metres", e.piece_metres.as_ref());
        self.part("lights", e.lights.as_ref());
        if !e.casts_shadows.0 {
            self.no_shadow(e, meshes.is_empty());
        }
        self.part("light", e.light.as_ref());
        if let Some(camera) = &e.camera {
            self.field("camera", |c| c.camera(camera));
        }
        for (i, field) in e.sensors().enumerate() {
            self.field(field, |c| c.sensor_field(i, e.name.is_some()));
        }
        if let Some(sensor) = &e.sensor {
            self.field("sensor", |c| c.sensor(sensor));
        }
        if let Some(class) = &e.class {
            self.field("class", |c| c.known_class(class));
        }
        if let Some(spin) = &e.spin {
            self.field("spin", |c| {
                c.described(spin);
                c.direction("axis", spin.axis);
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
        self.place *= entities::transform(&e.transform).compute_affine();
        if !is_nested {
            return;
        }
        let place = self.place.translation.as_dvec3();
        let columns = [self.place.matrix3.x_axis, self.place.matrix3.y_axis, self.place.matrix3.z_axis];
        let scale = columns.map(|axis| axis.abs().max_element()).into_iter().fold(0.0, f32::max);
        let message = if !place.abs().cmple(DVec3::splat(FARTHEST)).all() {
            format!("expected a place within {FARTHEST} m, found {place} with the transforms above it")
        } else if f64::from(scale) > LARGEST {
            format!("expected scales of at most {LARGEST} together, found {scale} with the transforms above it")
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

    /// Number of entities that an entity with that mesh becomes: a model has one for each node and instance.
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

    /// Faults of a transform beside ranges.
    pub fn transform(&mut self, t: &Transform) {
        self.field("scale", |c| match t.scale {
            Scale::Uniform(factor) => c.is_no_plane(factor),
            Scale::PerAxis(factors) => {
                for (i, factor) in factors.into_iter().enumerate() {
                    c.inside(Step::Index(i), "", |c| c.is_no_plane(factor));
                }
            }
        });
        let given = [t.rotation_degrees.is_some(), t.quaternion.is_some(), t.look_at.is_some()];
        if given.into_iter().filter(|&given| given).count() > 1 {
            self.fault("expected one of rotation_degrees, quaternion and look_at");
        }
        if let Some(q) = &t.quaternion {
            let length = q.iter().map(|&c| f64::from(c).powi(2)).sum::<f64>().sqrt();
            self.field("quaternion", |c| {
                if length.is_finite() && !(0.5..=2.0).contains(&length) {
                    c.fault(format_args!("expected a unit quaternion (x, y, z, w), found one of length {length}"));
                }
            });
        }
        if let Some(target) = &t.look_at {
            let translation = DVec3::from_array(t.translation.unwrap_or_default());
            if DVec3::from_array(*target).distance(translation) < 1e-6 {
                self.field("look_at", |c| c.fault("expected a point other than the translation"));
            }
        }
    }

    /// Refuses factors near 0, mirrored or not.
    fn is_no_plane(&mut self, factor: f32) {
        if factor.abs() < SMALLEST as f32 {
            let least =
                if factor < 0.0 { format!("-{LARGEST} to -{SMALLEST}") } else { format!("{SMALLEST} to {LARGEST}") };
            self.fault(format_args!("expected a number from {least}, found {factor}"));
        }
    }

    fn camera(&mut self, camera: &Camera) {
        self.described(camera);
        if camera.orthographic_half_height.is_some() && camera.fov_y_degrees.is_some() {
            self.fault("expected either fov_y_degrees or orthographic_half_height");
        }
        let least = camera.near.max(SMALLEST as f32) * 1.001;
        if let Some(far) = camera.far.filter(|far| *far < least) {
            self.field("far", |c| c.fault(format_args!("expected a number of at least {least}, found {far}")));
        }
    }
}
