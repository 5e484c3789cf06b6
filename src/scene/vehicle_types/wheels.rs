//! Finds the wheels of a model among the nodes that a type names as such.

use super::outline::{Shape, measure};
use super::placed_model::PlacedModel;
use super::roles::Role;
use glam::Vec3;
use std::collections::HashMap;
use systems::vehicles::parts::Movement;

/// Distance from a wheel's node to its hub that counts as none, in radii: no more than models are rounded.
const OFF_AXLE: f32 = 0.02;
/// Distance between the hubs of two nodes that count as one wheel, in the larger radius.
const SAME_HUB: f32 = 0.1;

/// Nodes that are one wheel together: they turn about one hub.
pub struct Wheel {
    /// Model space.
    pub hub: Vec3,
    /// Metres.
    pub radius: f32,
    /// By itself, not with a fork.
    pub steers: bool,
    /// Its node with a movement of its own that is nearest above, a fork or a trailer.
    pub hangs_from: Option<usize>,
    /// Rim and tyre, for instance.
    pub nodes: Vec<usize>,
    /// The node's origin is the hub.
    pub is_at_origin: bool,
    /// Part that turns, once it is made.
    pub part: Option<usize>,
}

/// The wheels with their hubs, and the radii of those that say none. Nodes that are no wheels after all lose that role.
/// Warnings go to `warnings`.
pub fn find(placed: &PlacedModel, roles: &mut HashMap<usize, Role>, warnings: &mut Vec<String>) -> Vec<Wheel> {
    let mut wheels: Vec<Wheel> = Vec::new();
    let mut open: Vec<(usize, Option<usize>)> = placed.model.roots.iter().rev().map(|&root| (root, None)).collect();
    while let Some((index, hangs_from)) = open.pop() {
        let movement = roles.get(&index).and_then(|role| role.movement.filter(|_| role.carries));
        let below =
            if roles.get(&index).is_some_and(|role| role.movement.is_some()) { Some(index) } else { hangs_from };
        open.extend(placed.model.nodes[index].children.iter().rev().map(|&child| (child, below)));
        let Some(Movement::Wheel { radius, steers }) = movement else { continue };
        let given = Some(radius).filter(|radius| *radius > 0.0);
        // A tyre below its rim is turned by that.
        let is_on_wheel = hangs_from.and_then(|above| roles.get(&above)).is_some_and(|role| role.carries);
        let measured = if is_on_wheel { None } else { measured(placed, index, given, warnings) };
        let Some((hub, radius)) = measured else {
            roles.entry(index).and_modify(|role| (role.movement, role.carries) = (None, false));
            continue;
        };
        let is_at_origin = hub == placed.origin(index);
        let wheel = Wheel { hub, radius, steers, hangs_from, nodes: vec![index], is_at_origin, part: None };
        match wheels.iter_mut().find(|other| other.is_one_with(&wheel, given)) {
            Some(other) => other.join(wheel),
            None => wheels.push(wheel),
        }
    }
    let model_from_vehicle = placed.vehicle_from_model.inverse();
    wheels.iter_mut().for_each(|wheel| wheel.hub = model_from_vehicle.transform_point3(wheel.hub));
    wheels
}

impl Wheel {
    /// Tells if another node is a part of this wheel: hubs in one place, and no radius given that says otherwise.
    fn is_one_with(&self, other: &Self, given: Option<f32>) -> bool {
        let (apart, radius) = (self.hub - other.hub, self.radius.max(other.radius));
        self.hangs_from == other.hangs_from
            && apart.with_x(0.0).length() < SAME_HUB * radius
            && apart.x.abs() < radius
            && (given.is_none() || self.radius == other.radius)
    }

    fn join(&mut self, other: Self) {
        if other.radius > self.radius {
            (self.hub, self.radius) = (other.hub, other.radius);
        }
        self.steers |= other.steers;
        self.nodes.extend(other.nodes);
    }
}

/// Hub (vehicle space) and radius of a wheel's node; none where it is no wheel.
fn measured(placed: &PlacedModel, index: usize, given: Option<f32>, warnings: &mut Vec<String>) -> Option<(Vec3, f32)> {
    let (name, origin) = (&placed.model.nodes[index].name, placed.origin(index));
    match measure(&placed.vertices_below(index)) {
        Shape::Round { hub, half_width, radius, reach } => {
            let is_off_axle = (hub - origin).with_x(0.0).length() > OFF_AXLE * radius;
            let is_beside = (hub.x - origin.x).abs() > half_width + radius / 2.0;
            if reach > radius {
                warnings.push(format!(
                    "parts that stick out of wheel {name:?} turn with it, up to {reach:.2} m from the axle; the \
                     wheel's own radius is {radius:.2} m"
                ));
            }
            Some((if is_off_axle || is_beside { hub } else { origin }, given.unwrap_or(radius)))
        }
        Shape::Uneven { middle, half_height, reach: [near, far] } => {
            if given.is_none() {
                warnings.push(format!(
                    "wheel {name:?} is not round about the vehicle's X: its outline is {near:.2} to {far:.2} m from \
                     its middle; its radius is half its height, {half_height:.2} m"
                ));
            }
            let is_off = (middle - origin).with_x(0.0).length() > OFF_AXLE * half_height;
            Some((if is_off { middle } else { origin }, given.unwrap_or(half_height)))
        }
        Shape::Other([height, length]) => {
            warnings.push(format!(
                "node {name:?} is not a wheel and is not turned: its geometry, {height:.2} m high and {length:.2} m \
                 long, is not round about the vehicle's X; a wheel needs a node of its own, separate from the body"
            ));
            None
        }
        Shape::Nothing => {
            let radius = given.unwrap_or((origin.y - placed.bounds_of_all(None).min.y).max(0.01));
            if given.is_none() {
                warnings.push(format!(
                    "nothing is drawn at wheel {name:?}: its radius is its height above the lowest point, \
                     {radius:.2} m; expected a radius"
                ));
            }
            Some((origin, radius))
        }
    }
}
