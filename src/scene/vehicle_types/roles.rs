//! Roles that a type gives to nodes of its model.

use crate::scene::format::vehicle_types::{Lamps, VehicleType as Source};
use std::collections::HashMap;
use systems::vehicles::parts::Movement;

/// The role of a node of the model in the vehicle.
#[derive(Default, Clone)]
pub struct Role<'a> {
    pub movement: Option<Movement>,
    /// A wheel that the vehicle stands on.
    pub carries: bool,
    pub lamp: Option<&'a Lamps>,
}

/// The roles of nodes by their index; `named` finds one by its name.
pub fn roles<'a>(source: &'a Source, named: &impl Fn(&str) -> Option<usize>) -> HashMap<usize, Role<'a>> {
    let mut roles: HashMap<usize, Role> = HashMap::new();
    for wheels in &source.wheels {
        let movement = Some(Movement::Wheel { radius: wheels.radius.unwrap_or(0.0), steers: wheels.steers });
        for index in wheels.nodes.iter().filter_map(|node| named(node)) {
            roles.insert(index, Role { movement, carries: true, lamp: None });
        }
    }
    let mut moves = |node: &str, movement: Movement| {
        if let Some(index) = named(node) {
            roles.entry(index).or_default().movement = Some(movement);
        }
    };
    for cranks in &source.cranks {
        let movement = Movement::Wheel { radius: cranks.radius, steers: false };
        cranks.nodes.iter().for_each(|node| moves(node, movement));
    }
    source.forks.iter().for_each(|node| moves(node, Movement::Fork));
    for swing in &source.swings {
        let movement =
            Movement::Swing { angle: swing.degrees.to_radians(), stride: swing.stride_metres, phase: swing.phase };
        moves(&swing.node, movement);
    }
    if let Some(trailer) = &source.trailer {
        moves(&trailer.node, Movement::Trailer);
    }
    for lamps in &source.lamps {
        for index in lamps.nodes.iter().filter_map(|node| named(node)) {
            roles.entry(index).or_default().lamp = Some(lamps);
        }
    }
    roles
}
