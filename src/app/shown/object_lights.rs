//! Lights of an object: which they are, and what they leave out.

use crate::name;
use bevy_ecs::prelude::*;
use egui::{Color32, Grid};
use glam::Vec3;
use std::collections::HashMap;
use systems::assets::bounds_of;
use systems::draw::pieces::{PieceOf, Pieces};
use systems::lights::{
    Light, LightKind, LightLists, LightPolicies, LightPolicy, LightSlot, LightTable, SelectedLights, Selection, score,
};
use systems::space::{GlobalTransform, Sphere};

/// The colours of an object's three lights, most relevant first: those of the debug view.
const LIGHT_COLORS: [Color32; 3] =
    [Color32::from_rgb(245, 90, 80), Color32::from_rgb(95, 210, 95), Color32::from_rgb(95, 155, 255)];
/// Colour of the lights beyond the three.
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
    /// Position, or a point towards it where it is infinitely far away; world space.
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
    /// Number of lights that reach the object.
    pub reaching: u32,
    /// Policy that selects those that shade it.
    pub policy: LightPolicy,
    /// Sum of the scores of lights that are left out: [`Selection::dropped`].
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

/// Formats what an object's lights leave out, in a line.
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

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{UVec2, Vec2};
    use systems::Simulation;
    use systems::assets::{Library, shapes};
    use systems::space::Transform;

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
