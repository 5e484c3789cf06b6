//! Details of one entity.

use crate::app::sensors::choice::description;
use bevy_ecs::prelude::*;
use egui::Grid;
use glam::{DVec3, EulerRot, Vec3};
use systems::assets::{Library, MaterialId, MeshId, MeshVariants, bounds_of};
use systems::draw::pieces::{Pieces, WholeMesh};
use systems::draw::{Camera, Projection};
use systems::lights::{Light, LightKind};
use systems::sensors::Sensor;
use systems::space::origin::Origin;
use systems::space::{GlobalTransform, Transform};
use systems::vehicles::routes::Routes;
use systems::vehicles::{Motion, OnRoute, Vehicle, VehicleTypes};

/// Shows everything about an entity but its name.
pub fn show(ui: &mut egui::Ui, world: &World, entity: Entity) {
    Grid::new("details").num_columns(2).striped(true).min_col_width(70.0).show(ui, |ui| {
        let mut row = |name: &str, value: String| self::row(ui, name, &value);
        row("entity", entity.index().to_string());
        if let Some(global) = world.get::<GlobalTransform>(entity) {
            row("position", meters(world, global.translation()));
        }
        if let Some(local) = world.get::<Transform>(entity) {
            let (y, x, z) = local.rotation.to_euler(EulerRot::YXZ);
            row("rotation", format!("{}°", triple(Vec3::new(x, y, z).map(f32::to_degrees), 1)));
            row("scale", triple(local.scale, 2));
        }
        let library = world.resource::<Library>();
        let whole = world.get::<WholeMesh>(entity).map(|whole| whole.mesh);
        if let Some(mesh) = whole.or(world.get::<MeshId>(entity).copied()).and_then(|id| library.mesh(id)) {
            row("mesh", format!("{} ({} triangles)", named(&mesh.mesh.name), mesh.mesh.triangle_count()));
        }
        if let Some(bounds) = bounds_of(world, entity) {
            row("radius", format!("{:.2} m", bounds.radius));
        }
        if let Some(pieces) = world.get::<Pieces>(entity) {
            row("pieces", pieces.len().to_string());
        }
        if let Some(material) = world.get::<MaterialId>(entity).and_then(|id| library.material(*id)) {
            row("material", named(&material.name).to_owned());
            row("shading", format!("{:?}, {:?}", material.shading, material.technique));
        }
        if let Some(figure) = world.get::<MeshVariants>(entity) {
            row("mesh variant", format!("{} of {}", figure.shown + 1, figure.meshes.len()));
        }
        if let Some(light) = world.get::<Light>(entity) {
            row("light", light_kind(light));
            row("intensity", format!("{:.2} × ({})", light.intensity, triple(light.color, 2)));
            row("range", if light.range.is_finite() { format!("{:.1} m", light.range) } else { "unlimited".into() });
        }
        if let Some(camera) = world.get::<Camera>(entity) {
            row("camera", projection(camera));
        }
        if let Some(sensor) = world.get::<Sensor>(entity) {
            row("sensor", description(sensor));
        }
        if let Some((vehicle, motion)) = world.get::<Vehicle>(entity).zip(world.get::<Motion>(entity)) {
            row("vehicle", world.resource::<VehicleTypes>().get(vehicle.kind).name.clone());
            row("speed", kilometres_per_hour(motion));
            row("steering", format!("{:.1}°", motion.steering.to_degrees()));
        }
        if let Some(on) = world.get::<OnRoute>(entity)
            && let Some(route) = world.resource::<Routes>().get(on.route)
        {
            row("route", route.plan.name.clone());
            row("on route", format!("{:.1} m, lane {}", on.at, on.lane));
        }
    });
}

/// A name and its value in a grid.
pub fn row(ui: &mut egui::Ui, name: &str, value: &str) {
    ui.weak(name);
    ui.add(egui::Label::new(value).truncate());
    ui.end_row();
}

/// A vehicle's speed.
pub fn kilometres_per_hour(motion: &Motion) -> String {
    // No −0.
    format!("{:.0} km/h", motion.speed * 3.6 + 0.0)
}

fn light_kind(light: &Light) -> String {
    let mut text = light.kind.name().to_owned();
    if let LightKind::Spot { outer, .. } = light.kind {
        text += &format!(", {:.0}° to its edge", outer.to_degrees());
    }
    if light.enabled { text } else { text + ", off" }
}

fn projection(camera: &Camera) -> String {
    match camera.projection {
        Projection::Perspective { fov_y, .. } => format!("{:.1}° high", fov_y.to_degrees()),
        Projection::Pinhole { intrinsics, .. } => format!("fx {:.1}, fy {:.1} pixels", intrinsics.fx, intrinsics.fy),
        Projection::Orthographic { half_height, .. } => format!("orthographic, {:.2} m high", half_height * 2.0),
    }
}

fn named(name: &str) -> &str {
    if name.is_empty() { "(no name)" } else { name }
}

fn triple(v: impl Into<DVec3>, digits: usize) -> String {
    // No −0.
    let v = v.into() + DVec3::ZERO;
    format!("{:.digits$}, {:.digits$}, {:.digits$}", v.x, v.y, v.z)
}

/// A place, metres, in the coordinates of the scene's file.
pub fn meters(world: &World, place: Vec3) -> String {
    format!("{} m", triple(world.resource::<Origin>().file_from_world(place), 2))
}
