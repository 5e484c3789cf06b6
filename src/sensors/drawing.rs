//! What draws the views of cameras, of one world or of several together.

use super::capture::Capture;
use super::world_sensors::{Planned, WorldSensors};
use crate::renderer::{Gpu, Outputs, RenderError, Renderer, Settings, SlotSet, ViewBatches, ViewPlan};
use bevy_ecs::prelude::*;
use std::sync::Arc;
use systems::Simulation;

/// A renderer, and what views keep from capture to capture.
pub struct Drawing {
    renderer: Renderer,
    batches: ViewBatches,
}

/// Which sensors of a world are captured.
pub enum Wanted<'a> {
    /// Those that are due, of the names that pass.
    Due(&'a dyn Fn(&str) -> bool),
    /// These, whether they are due or not.
    Look(&'a [Entity]),
}

/// A world, what is kept of its sensors, and which are captured.
pub type Captured<'a> = (&'a mut Simulation, &'a mut WorldSensors, Wanted<'a>);

impl Drawing {
    /// For one world after the other: what is uploaded of one is thrown away when another one is drawn.
    pub fn new(gpu: &Gpu) -> Self {
        Self { renderer: Renderer::new(gpu), batches: ViewBatches::default() }
    }

    /// For several worlds. What is uploaded of each stays until it is [forgotten](Self::forget); worlds of one
    /// [template](crate::scene::Template) share meshes and textures.
    pub fn of_many(gpu: &Gpu) -> Self {
        let mut drawing = Self::new(gpu);
        drawing.renderer.keep_worlds();
        drawing
    }

    /// The device it draws with.
    pub fn gpu(&self) -> &Gpu {
        self.renderer.gpu()
    }

    /// Gives up what is uploaded of a world, by [`DrawList::world`](systems::draw::DrawList::world).
    pub fn forget(&mut self, world: u64) {
        self.renderer.forget_world(world);
    }

    /// Captures sensors of several worlds, with the views of all cameras in one submission, as far as they agree in size
    /// and outputs. What is measured is what each world gives alone, to the bit.
    ///
    /// # Errors
    /// [`RenderError`].
    pub fn capture(&mut self, settings: &Settings, worlds: &mut [Captured<'_>]) -> Result<Vec<Capture>, RenderError> {
        let mut planned = Vec::with_capacity(worlds.len());
        for (simulation, sensors, wanted) in &mut *worlds {
            let due = match wanted {
                Wanted::Due(is_wanted) => sensors.due(simulation, |name| is_wanted(name)),
                Wanted::Look(looked_at) => sensors.looked_at(simulation, |sensor| looked_at.contains(&sensor)),
            };
            planned.push(sensors.plan(settings, due)?);
        }
        let views: Vec<Vec<ViewPlan>> = planned.iter().map(Planned::all_views).collect();
        let drawn = match (&views[..], &mut *worlds) {
            ([views], [(simulation, ..)]) => vec![self.draw(simulation, views)?],
            (views, worlds) => self.renderer.draw_worlds(&mut self.batches, views, &mut |world, read| {
                worlds[world].0.with_frame(|frame| read(frame))
            })?,
        };
        let mut captures = Vec::with_capacity(worlds.len());
        for ((planned, drawn), (simulation, sensors, _)) in planned.into_iter().zip(drawn).zip(worlds) {
            captures.push(sensors.finish(simulation, planned, &drawn, self)?);
        }
        Ok(captures)
    }

    /// Captures planned sensors of a world.
    ///
    /// # Errors
    /// [`RenderError`].
    pub(super) fn capture_planned(
        &mut self,
        simulation: &mut Simulation,
        sensors: &mut WorldSensors,
        planned: Planned,
    ) -> Result<Capture, RenderError> {
        let drawn = self.draw(simulation, &planned.all_views())?;
        sensors.finish(simulation, planned, &drawn, self)
    }

    fn draw(&mut self, simulation: &mut Simulation, views: &[ViewPlan]) -> Result<Vec<Outputs>, RenderError> {
        simulation.with_frame(|frame| self.renderer.draw_views(frame, &mut self.batches, views))
    }

    /// [`Renderer::draw_alone`].
    ///
    /// # Errors
    /// [`RenderError`].
    pub(super) fn draw_alone(
        &mut self,
        simulation: &mut Simulation,
        views: (&[ViewPlan], &[Arc<SlotSet>]),
    ) -> Result<Vec<Outputs>, RenderError> {
        simulation.with_frame(|frame| self.renderer.draw_alone(frame, &mut self.batches, views))
    }
}
