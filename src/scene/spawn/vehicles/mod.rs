//! Spawning of vehicles, routes and signals. A build without vehicles has `no_vehicles.rs` instead.
//!
//! ```text
//! roads          routes and signals; places along routes
//! overlaps       vehicles in each other
//! room           where a generator has put vehicles already
//! road_warnings  what is doubtful of roads
//! ```

mod overlaps;
mod road_warnings;
mod roads;
mod room;

pub use roads::{along, insert};
pub use room::Room;

use super::below::descendants;
use super::physical;
use super::placement::OnRoute;
use super::spawner::Spawner;
use crate::name;
use crate::scene::format::roads as format;
use crate::scene::text::faults;
use bevy_ecs::name::Name;
use bevy_ecs::prelude::*;
use glam::Affine3A;
use std::collections::BTreeSet;
use systems::sensors::Classes;
use systems::space::origin::Origin;
use systems::vehicles::ground::Ground;
use systems::vehicles::routes::Routes;
use systems::vehicles::signals::Signals;
use systems::vehicles::{
    Controls, Headlights, ManualControl, Motion, NextVehicleNumber, Vehicle, VehicleTypeId, VehicleTypes,
};

/// Has vehicles stand on an entity.
pub fn make_ground(entity: &mut EntityWorldMut) {
    entity.insert(Ground);
}

/// Warnings of vehicles once all are there.
pub fn warnings(world: &mut World) -> Vec<String> {
    let mut warnings = overlaps::warnings(world);
    warnings.extend(physical::warnings(world));
    warnings.extend(unknown_classes(world));
    if world.query::<&OnRoute>().iter(world).next().is_some() {
        let origin = world.resource::<Origin>().0;
        warnings.extend(road_warnings::of_beginning_anew(world.resource::<Routes>(), origin));
    }
    warnings
}

/// A word about each class of a vehicle's type that is none of the scene's.
fn unknown_classes(world: &mut World) -> Vec<String> {
    let kinds: BTreeSet<_> = world.query::<&Vehicle>().iter(world).map(|vehicle| vehicle.kind).collect();
    let (types, classes) = (world.resource::<VehicleTypes>(), world.resource::<Classes>());
    let of = kinds.into_iter().map(|kind| types.get(kind));
    let unknown = of.filter(|of| !of.class.is_empty() && classes.find(&of.class).is_none());
    unknown
        .map(|of| format!("vehicle type {:?}: unknown class {:?}; sensors see none there", of.name, of.class))
        .collect()
}

impl Spawner<'_> {
    /// Spawns a vehicle of a type, with the settings of the entity's `vehicle`, if it has one.
    pub(super) fn vehicle(
        &mut self,
        name: &str,
        source: Option<&format::Vehicle>,
        on_route: Option<OnRoute>,
        entity: Entity,
        world_from_entity: &Affine3A,
    ) {
        let types = self.world.resource::<VehicleTypes>();
        let kind = types.find(name);
        if kind.is_none() && !self.unknown_types.iter().any(|known| known == name) {
            let names: Vec<&str> = types.iter().map(|(_, known)| known.name.as_str()).collect();
            let hint = faults::suggestion(name, &names);
            self.found.warnings.push(format!("unknown vehicle type {name:?}{hint}; a box is drawn instead"));
            self.unknown_types.push(name.to_owned());
        }
        let kind = kind.unwrap_or(VehicleTypeId::STAND_IN);
        let bounds = types.get(kind).bounds();
        let routes = self.world.resource::<Routes>();
        let own_route = source.and_then(|source| {
            let id = routes.find(source.route.as_deref()?)?;
            Some(OnRoute::new(id, source.lane, source.at.min(routes.get(id)?.length)))
        });
        let on_route = own_route.or(on_route);
        let stands = on_route.map(|on| routes.stand(&on));
        let place = on_route.map(|on| routes.stand_at(&on).0).unwrap_or_default();
        let world_from_vehicle = stands.map_or(*world_from_entity, |stands| stands.compute_affine());
        self.enclose(bounds.transformed(&world_from_vehicle));
        let number = self.world.resource::<NextVehicleNumber>().0;
        let mut entity = self.world.entity_mut(entity);
        if !entity.contains::<Name>() {
            entity.insert(Name::new(format!("{name} {}", number + 1)));
        }
        let headlights = source.map_or_else(Default::default, |source| source.headlights.into());
        let controls = Controls { headlights, ..Controls::default() };
        let speed = source.map_or(0.0, |source| f64::from(source.speed_kmh) / 3.6);
        // Paints in turn where none is asked for.
        let paint = source.and_then(|source| source.paint).unwrap_or(number);
        if let Some((on, stands)) = on_route.zip(stands) {
            entity.insert((stands, on));
        }
        let motion = Motion { place, speed, ..Motion::default() };
        entity.insert((controls, motion, Vehicle::of(kind).painted(paint)));
        if source.is_some_and(|source| source.manual || source.by_hand) {
            entity.insert(ManualControl);
        }
        if let Some(physical) = source.and_then(|source| source.physical) {
            physical::make_physical(&mut entity, physical);
        }
        self.found.has_lights = true;
    }

    pub(super) fn signal_head(&mut self, source: &format::SignalHead, entity: Entity) {
        let Some(head) = self.world.resource::<Signals>().head(&source.signal, source.group) else { return };
        let below = descendants(self.world, entity);
        if !self.glass.make_head(self.world, entity, &below, head) {
            let name = name::of_entity(self.world, entity);
            self.found.warnings.push(format!("{name}: no node lamp_red, lamp_amber or lamp_green: it shows no signal"));
        }
    }
}

impl From<format::Headlights> for Headlights {
    fn from(headlights: format::Headlights) -> Self {
        match headlights {
            format::Headlights::Off => Self::Off,
            format::Headlights::Low => Self::Low,
            format::Headlights::High => Self::High,
        }
    }
}
