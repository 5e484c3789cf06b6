//! What is known of one entity, and the lights of an object.

use super::{panel, sensors};
use crate::name;
use bevy_ecs::prelude::*;
use egui::{Color32, Grid};
use glam::{DVec3, EulerRot, Vec3};
use std::collections::HashMap;
use systems::assets::{Library, MaterialId, MeshId, MeshVariants, bounds_of};
use systems::draw::pieces::{PieceOf, Pieces, WholeMesh};
use systems::draw::{Camera, Projection};
use systems::lights::{
    Light, LightKind, LightLists, LightPolicies, LightPolicy, LightSlot, LightTable, SelectedLights, Selection, score,
};
use systems::sensors::Sensor;
use systems::space::origin::Origin;
use systems::space::{GlobalTransform, Sphere, Transform};
use systems::vehicles::routes::Routes;
use systems::vehicles::{Motion, OnRoute, Vehicle, VehicleTypes};

/// The colours of an object's three lights, most relevant first: those of the debug view.
const LIGHT_COLORS: [Color32; 3] =
    [Color32::from_rgb(245, 90, 80), Color32::from_rgb(95, 210, 95), Color32::from_rgb(95, 155, 255)];
/// Of the lights beyond the three.
const OTHER_LIGHT_COLOR: Color32 = Color32::from_gray(190);

/// The colours of an object's lights, most relevant first.
pub fn colors() -> impl Iterator<Item = Color32> {
    LIGHT_COLORS.into_iter().chain(std::iter::repeat(OTHER_LIGHT_COLOR))
}

/// One of an object's lights.
#[derive(Clone, PartialEq, Debug)]
pub struct ObjectLight {
    /// The light.
    pub entity: Entity,
    /// Its selection weight, 0..1.
    pub weight: f32,
    /// The most irradiance it gives anywhere on the object: what the choice went by.
    pub score: f32,
    /// From the object's centre, metres; `None` where it is infinitely far away.
    pub distance: Option<f32>,
    /// Where it is, or towards it where it is infinitely far away; world space.
    pub place: Vec3,
    /// In the light table.
    pub slot: u32,
}

/// An object's place and its lights, most relevant first.
#[derive(Clone, PartialEq, Debug)]
pub struct ObjectLights {
    /// Around the object, world space.
    pub bounds: Sphere,
    /// Those that shade it.
    pub lights: Vec<ObjectLight>,
    /// How many lights reach the object.
    pub reaching: u32,
    /// Which of them shade it.
    pub policy: LightPolicy,
    /// What is left out of the sum of scores: [`Selection::dropped`].
    pub left_out: f32,
}

/// The lights of a drawn entity, of one in pieces those of the piece nearest to a point; `None` for others.
pub fn object_lights(world: &mut World, object: Entity, near: Vec3) -> Option<ObjectLights> {
    let distance = |piece: &Entity| bounds_of(world, *piece).map(|bounds| bounds.center.distance(near));
    let pieces = world.get::<Pieces>(object).into_iter().flat_map(|pieces| pieces.iter());
    let nearest = pieces.filter_map(|piece| Some((distance(&piece)?, piece))).min_by(|(a, _), (b, _)| a.total_cmp(b));
    let object = nearest.map_or(object, |(_, piece)| piece);
    let bounds = bounds_of(world, object)?;
    let selection = world.get::<SelectedLights>(object)?.unpack(world.resource());
    let Selection { reaching, dropped: left_out, .. } = selection;
    let lists = world.resource::<LightLists>();
    let further = world.get::<SelectedLights>(object).map(|selected| lists.of(selected).0).unwrap_or_default();
    let chosen: HashMap<u32, f32> = selection.lights.into_iter().zip(selection.weights).chain(further).collect();
    let policies = world.resource::<LightPolicies>();
    let is_piece = world.get::<PieceOf>(object).is_some();
    let of_kind = if is_piece { policies.pieces } else { policies.objects };
    let policy = policies.forced.or(world.get::<LightPolicy>(object).copied()).unwrap_or(of_kind);
    let mut found = ObjectLights { bounds, lights: Vec::new(), reaching, policy, left_out };
    let mut lights = world.query::<(Entity, &LightSlot, &Light, &GlobalTransform)>();
    let scored = world.resource::<LightTable>().scored();
    for (entity, slot, light, transform) in lights.iter(world) {
        let Some(&weight) = chosen.get(&slot.0) else { continue };
        let is_far = light.kind == LightKind::Directional;
        let toward = bounds.center + transform.back() * bounds.radius * 2.0;
        let place = if is_far { toward } else { transform.translation() };
        found.lights.push(ObjectLight {
            entity,
            weight,
            score: score(&scored[slot.0 as usize], bounds),
            distance: (!is_far).then(|| place.distance(bounds.center)),
            place,
            slot: slot.0,
        });
    }
    found.lights.sort_by(|a, b| b.score.total_cmp(&a.score).then(a.slot.cmp(&b.slot)));
    Some(found)
}

/// Shows everything about an entity but its name.
pub fn show(ui: &mut egui::Ui, world: &World, entity: Entity) {
    Grid::new("details").num_columns(2).striped(true).min_col_width(70.0).show(ui, |ui| {
        let mut row = |name: &str, value: String| panel::row(ui, name, &value);
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
            row("sensor", sensors::description(sensor));
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

/// Shows an object's lights: name, weight, score and distance. Returns the one whose name was clicked.
pub fn show_lights(ui: &mut egui::Ui, world: &World, lights: &ObjectLights) -> Option<Entity> {
    let mut clicked = None;
    if lights.reaching == 0 {
        ui.weak("No light reaches it.");
        return clicked;
    }
    Grid::new("lights of the object").num_columns(4).spacing([8.0, 2.0]).show(ui, |ui| {
        for title in ["weight", "score", "distance", "light"] {
            ui.weak(title);
        }
        ui.end_row();
        for (light, color) in lights.lights.iter().zip(colors()).take(MOST_SHOWN) {
            ui.horizontal(|ui| {
                let (space, _) = ui.allocate_exact_size(egui::Vec2::splat(10.0), egui::Sense::hover());
                ui.painter().circle_filled(space.center(), 4.0, color);
                ui.label(format!("{:.3}", light.weight));
            });
            ui.label(format!("{:.3}", light.score));
            ui.label(light.distance.map_or_else(|| "∞".to_owned(), |distance| format!("{distance:.2} m")));
            let name = egui::Button::selectable(false, name::of_entity(world, light.entity)).truncate();
            if ui.add(name).clicked() {
                clicked = Some(light.entity);
            }
            ui.end_row();
        }
    });
    if let Some(more @ 1..) = lights.lights.len().checked_sub(MOST_SHOWN) {
        ui.weak(format!("and {more} more"));
    }
    ui.weak(left_out(lights));
    clicked
}

/// What an object's lights leave out, in a line.
fn left_out(lights: &ObjectLights) -> String {
    let others = lights.reaching.saturating_sub(lights.lights.len() as u32);
    // Kept to two digits, see `systems::lights::SelectedLights`.
    let score = two_digits(lights.left_out);
    match lights.policy {
        LightPolicy::Enough(tolerance) => {
            let sum: f32 = lights.lights.iter().map(|light| light.score * light.weight).sum::<f32>() + lights.left_out;
            let share = if sum > 0.0 { two_digits(100.0 * lights.left_out / sum) } else { 0.0 };
            format!(
                "{others} of {} left out: {share} % of the scores, at most {} %",
                lights.reaching,
                100.0 * tolerance
            )
        }
        LightPolicy::All => "nothing left out".to_owned(),
        LightPolicy::Three | LightPolicy::Hard if others == 0 => "nothing left out".to_owned(),
        LightPolicy::Three | LightPolicy::Hard => {
            format!("{others} of {} left out: scores about {score} in all", lights.reaching)
        }
    }
}

/// Lights that a card lists at most.
const MOST_SHOWN: usize = 12;

/// A number as it is written with two digits that count.
fn two_digits(value: f32) -> f32 {
    format!("{value:.1e}").parse().unwrap_or(value)
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

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{UVec2, Vec2};
    use systems::Simulation;
    use systems::assets::shapes;

    #[test]
    fn an_objects_lights_are_found_in_order_with_their_places() {
        let mut simulation = Simulation::new();
        let cube = simulation.world.resource_mut::<Library>().add_mesh(shapes::cube(Vec3::ONE));
        let object = simulation.world.spawn(cube).id();
        let mut light =
            |x: f32| simulation.world.spawn((Light::point(1.0, 50.0), Transform::from_xyz(x, 0.0, 0.0))).id();
        let (far, near) = (light(9.0), light(-3.0));
        simulation.frame();
        let found = object_lights(&mut simulation.world, object, Vec3::ZERO).expect("a drawn object");
        let order: Vec<_> = found.lights.iter().map(|light| (light.entity, light.place.x)).collect();
        assert_eq!(order, [(near, -3.0), (far, 9.0)]);
        let near_light = &found.lights[0];
        assert_eq!((near_light.distance, near_light.weight, found.reaching), (Some(3.0), 1.0, 2));
        let nearest = 3.0 - 0.75f32.sqrt();
        assert!((near_light.score * (1.0 + nearest * nearest) - 1.0).abs() < 1e-3, "{}", near_light.score);
        assert_eq!(object_lights(&mut simulation.world, near, Vec3::ZERO), None, "a light is no object");
    }

    #[test]
    fn a_card_lists_all_lights_of_an_object_and_says_what_is_left_out() {
        let mut simulation = Simulation::new();
        let cube = simulation.world.resource_mut::<Library>().add_mesh(shapes::cube(Vec3::ONE));
        let object = simulation.world.spawn(cube).id();
        let place = |i: usize| Transform::from_xyz(3.0 + i as f32, 0.0, 0.0);
        (0..6).for_each(|i| _ = simulation.world.spawn((Light::point(1.0, 50.0), place(i))));
        let mut card = |policy| {
            simulation.world.entity_mut(object).insert(policy);
            simulation.frame();
            let found = object_lights(&mut simulation.world, object, Vec3::ZERO).expect("a drawn object");
            assert!(found.lights.is_sorted_by(|a, b| a.score >= b.score));
            (found.lights.len(), left_out(&found))
        };
        assert_eq!(card(LightPolicy::All), (6, "nothing left out".to_owned()));
        let (lights, line) = card(LightPolicy::Three);
        assert!(lights == 3 && line.starts_with("3 of 6 left out: scores about 0."), "{line}");
        let (lights, line) = card(LightPolicy::Enough(0.25));
        assert!((3..6).contains(&lights) && line.ends_with("% of the scores, at most 25 %"), "{lights}: {line}");
    }

    #[test]
    fn an_object_in_pieces_shows_the_lights_of_the_piece_pointed_at() {
        let mut simulation = Simulation::new();
        let road = shapes::plane(Vec2::new(1.0, 100.0), UVec2::ONE);
        let road = simulation.world.resource_mut::<Library>().add_mesh(road);
        let road = simulation.world.spawn(road).id();
        systems::draw::pieces::draw_in_pieces(&mut simulation.world, road, 10.0);
        let mut light =
            |z: f32| simulation.world.spawn((Light::point(1.0, 8.0), Transform::from_xyz(0.0, 2.0, z))).id();
        let (back, front) = (light(-44.0), light(44.0));
        simulation.frame();
        let mut at = |z| {
            let found = object_lights(&mut simulation.world, road, Vec3::Z * z).expect("a drawn object");
            assert!(found.bounds.center.distance(Vec3::Z * z) < 5.1);
            found.lights.iter().map(|light| light.entity).collect::<Vec<_>>()
        };
        assert_eq!((at(-42.0), at(0.0), at(42.0)), (vec![back], vec![], vec![front]));
    }
}
