//! The sensors of a world, captured together.

use super::drawing::Drawing;
use super::due::Due;
use super::sensors::WorldSensors;
use crate::renderer::{Gpu, RenderError, Settings};
use crate::sense::captures::capture::Capture;
use crate::sense::rays::scene::RayWarnings;
use bevy_ecs::prelude::*;
use systems::Simulation;

/// Resources to capture the sensors of a world: what draws, and what is kept from capture to capture. By default it
/// has no device, and opens one when a camera is first drawn.
#[derive(Default)]
pub struct SensorSuite {
    /// Settings of cameras, but for what a sensor says itself: samples and outputs. Levels of detail are those of
    /// colours; all else is measured of every mesh as it is.
    pub settings: Settings,
    drawing: Drawing,
    own: WorldSensors,
}

impl SensorSuite {
    /// For the worlds that are captured with a device.
    pub fn new(gpu: &Gpu) -> Self {
        Self { drawing: Drawing::new(gpu), ..Self::default() }
    }

    /// Captures all sensors that are due after the clock's step. Brings the world's draw list up to date.
    ///
    /// # Errors
    /// [`RenderError`].
    pub fn capture(&mut self, simulation: &mut Simulation) -> Result<Capture, RenderError> {
        self.capture_some(simulation, |_| true)
    }

    /// [`Self::capture`] of the sensors whose names are wanted. What they measure does not depend on which these are.
    ///
    /// # Errors
    /// [`RenderError`].
    pub fn capture_some(
        &mut self,
        simulation: &mut Simulation,
        wanted: impl Fn(&str) -> bool,
    ) -> Result<Capture, RenderError> {
        let due = self.due(simulation, wanted);
        self.capture_due(simulation, due)
    }

    /// Captures sensors of the state at hand to look at them, whether they are due or not. Those that are due measure
    /// what [`Self::capture`] gives, but for lidars in the first steps of a run: before one was due for the second time
    /// it fires here as many columns as it does later. A lidar that sweeps and is not due is fired as if it stood
    /// still.
    ///
    /// # Errors
    /// [`RenderError`].
    pub fn look(
        &mut self,
        simulation: &mut Simulation,
        wanted: impl Fn(Entity) -> bool,
    ) -> Result<Capture, RenderError> {
        let looked_at = self.own.looked_at(simulation, wanted);
        self.capture_due(simulation, looked_at)
    }

    /// The sensors that are due after the clock's step and wanted; where there are any, brings the world up to date.
    pub(crate) fn due(&mut self, simulation: &mut Simulation, wanted: impl Fn(&str) -> bool) -> Vec<Due> {
        self.own.due(simulation, wanted)
    }

    /// Captures sensors that [`Self::due`] has found in the state at hand.
    ///
    /// # Errors
    /// [`RenderError`].
    pub(crate) fn capture_due(&mut self, simulation: &mut Simulation, due: Vec<Due>) -> Result<Capture, RenderError> {
        let planned = self.own.plan(&self.settings, due)?;
        self.drawing.capture_planned(simulation, &mut self.own, planned)
    }

    /// Objects that the last capture's rays do not meet as they are drawn.
    pub fn ray_warnings(&self) -> RayWarnings {
        self.own.ray_warnings()
    }

    /// The device it draws with, once it has one.
    pub fn gpu(&self) -> Option<&Gpu> {
        self.drawing.gpu()
    }
}
