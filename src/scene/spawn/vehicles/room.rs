//! Room for the vehicles that a generator puts on routes: where it has put some already.

use super::overlaps::{Outline, Outlines};
use crate::scene::spawn::placement::Placement;
use bevy_ecs::prelude::*;
use systems::vehicles::routes::Routes;
use systems::vehicles::{RouteId, VehicleTypes};

/// Places of the vehicles of a generator.
#[derive(Default)]
pub struct Room {
    lane: Option<Lane>,
    outlines: Outlines,
    /// Vehicles that found no room.
    pub full: usize,
}

/// The lane that is being filled.
struct Lane {
    of: (RouteId, u8),
    /// Metres along to the rear of the first one on it, and to the front of the last one.
    first: f64,
    last: f64,
}

impl Room {
    /// Metres between two vehicles of a lane at least.
    const GAP: f64 = 2.0;

    /// Tells if a vehicle has room behind the one before it and, on a closed route, the first one has before it; and is
    /// in none of the others, as where routes flow into each other.
    pub fn take(&mut self, placement: &Placement, world: &World) -> bool {
        let (types, routes) = (world.resource::<VehicleTypes>(), world.resource::<Routes>());
        let Some((on, name)) = placement.on_route.zip(placement.vehicle) else { return true };
        let kind = types.get(types.find(name).unwrap_or_default());
        let (rear, front) = (on.at - f64::from(kind.rear()), on.at + f64::from(kind.front()));
        let round = routes.get(on.route).filter(|route| route.closed).map_or(f64::INFINITY, |route| route.length);
        let lane = self.lane.as_mut().filter(|lane| lane.of == (on.route, on.lane));
        let (place, yaw) = routes.stand_at(&on);
        let outline = Outline::new(place, yaw, kind);
        let has_gaps =
            lane.as_ref().is_none_or(|lane| rear > lane.last + Self::GAP && front + Self::GAP < lane.first + round);
        if !has_gaps || !self.outlines.around(&outline).is_empty() {
            self.full += 1;
            return false;
        }
        match lane {
            Some(lane) => lane.last = front,
            None => self.lane = Some(Lane { of: (on.route, on.lane), first: rear, last: front }),
        }
        self.outlines.add(outline);
        true
    }
}
