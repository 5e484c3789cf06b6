//! Vehicles as state of the simulation.

use super::state::{Component, StateList};
use crate::assets::material::MaterialId;
use crate::vehicles::components::{
    Controls, ManualControl, Motion, NextVehicleNumber, OnRoute, Stalled, VehicleNumber, Wanted,
};
use crate::vehicles::external::External;
use crate::vehicles::ground::Ground;
use crate::vehicles::lamps::{Lamp, Switches};
use crate::vehicles::signals::{HeldSignals, SignalHead, SignalLamp};
use bevy_ecs::prelude::*;

impl StateList {
    pub(super) fn add_vehicles(&mut self) {
        self.add_resource::<NextVehicleNumber>("next vehicle");
        self.add_component::<VehicleNumber>("vehicle");
        self.add(Component::<Motion>::checked("motion", Motion::is_valid));
        self.add(Component::<Controls>::checked("controls", Controls::is_valid));
        self.add_component::<ManualControl>("by hand");
        self.add(Component::<OnRoute>::checked("on route", OnRoute::is_valid));
        self.add(Component::<External>::checked("external", External::is_valid).optional());
        self.add_component::<Stalled>("stalled");
        self.add_resource::<HeldSignals>("held signals");
        self.add_component::<SignalHead>("signal head");
        self.add_component::<Switches>("lamps");
        self.add(Component::<MaterialId, Or<(With<Lamp>, With<SignalLamp>)>>::new("glass"));
        #[cfg(feature = "physics")]
        self.add_component::<crate::physics::physical::Physical>("physical");
        self.add_component::<Wanted>("wanted");
        self.add_component::<Ground>("ground");
        #[cfg(feature = "physics")]
        self.add_physics();
    }
}
