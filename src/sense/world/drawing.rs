//! Rendering of cameras' views, of one world or of several together.

use super::sensors::{Measured, Planned, WorldSensors};
use crate::renderer::{
    Gpu, Outputs, RenderError, Renderer, Settings, SlotSet, ViewBatches, ViewPlan, keep_freed_memory,
};
use crate::sense::captures::capture::Capture;
use bevy_ecs::prelude::*;
use std::sync::Arc;
use systems::Simulation;
use systems::ecs::parallel::map_in_parallel;

/// A renderer, and what views keep from capture to capture.
#[derive(Default)]
pub struct Drawing {
    /// `None`: no view was drawn yet.
    renderer: Option<Renderer>,
    keeps_worlds: bool,
    batches: ViewBatches,
}

/// Choice of a world's sensors that are captured.
pub enum Wanted<'a> {
    /// Those that are due, of the names that pass.
    Due(&'a (dyn Fn(&str) -> bool + Sync)),
    /// These, whether they are due or not.
    Look(&'a [Entity]),
}

/// A world, what is kept of its sensors, and which are captured.
pub type Captured<'a> = (&'a mut Simulation, &'a mut WorldSensors, Wanted<'a>);

impl Drawing {
    /// For one world after the other: what is uploaded of one is thrown away when another one is drawn. Without a
    /// device, as by default, one is opened when a view is first drawn: sensors that need no picture need no adapter.
    pub fn new(gpu: &Gpu) -> Self {
        Self { renderer: Some(Renderer::new(gpu)), ..Self::default() }
    }

    /// For several worlds. What is uploaded of each stays until it is [forgotten](Self::forget); worlds of one
    /// [template](crate::scene::Template) share meshes and textures. `None`: as [`Self::new`] says.
    pub fn of_many(gpu: Option<&Gpu>) -> Self {
        // Pictures of all worlds at once are freed and made anew in each capture.
        keep_freed_memory();
        let mut renderer = gpu.map(Renderer::new);
        renderer.iter_mut().for_each(Renderer::keep_worlds);
        Self { renderer, keeps_worlds: true, ..Self::default() }
    }

    /// The device it draws with, once it has one.
    pub fn gpu(&self) -> Option<&Gpu> {
        self.renderer.as_ref().map(Renderer::gpu)
    }

    /// The device it draws with, which is opened where it has none yet.
    ///
    /// # Errors
    /// [`RenderError`]: no adapter, or none that will do.
    pub fn open(&mut self) -> Result<&Gpu, RenderError> {
        Ok(self.renderer()?.0.gpu())
    }

    pub(super) fn renderer(&mut self) -> Result<(&mut Renderer, &mut ViewBatches), RenderError> {
        let renderer = match &mut self.renderer {
            Some(renderer) => renderer,
            none => {
                let renderer = none.insert(Renderer::new(&Gpu::headless()?));
                if self.keeps_worlds {
                    renderer.keep_worlds();
                }
                renderer
            }
        };
        Ok((renderer, &mut self.batches))
    }

    /// Gives up what is uploaded of a world, by [`DrawList::world`](systems::draw::DrawList::world).
    pub fn forget(&mut self, world: u64) {
        self.renderer.iter_mut().for_each(|renderer| renderer.forget_world(world));
    }

    /// Captures sensors of several worlds, with the views of all cameras in one submission, as far as they agree in
    /// size and outputs. What is measured is what each world gives alone, to the bit.
    ///
    /// # Errors
    /// [`RenderError`].
    pub fn capture(&mut self, settings: &Settings, worlds: &mut [Captured<'_>]) -> Result<Vec<Capture>, RenderError> {
        // Worlds are brought up to date, and measured, several at a time; they are drawn together.
        let planned = map_in_parallel(worlds.iter_mut(), |(simulation, sensors, wanted)| {
            let due = match wanted {
                Wanted::Due(is_wanted) => sensors.due(simulation, |name| is_wanted(name)),
                Wanted::Look(looked_at) => sensors.looked_at(simulation, |sensor| looked_at.contains(&sensor)),
            };
            sensors.plan(settings, due)
        });
        let planned = planned.into_iter().collect::<Result<Vec<Planned>, _>>()?;
        let views: Vec<Vec<ViewPlan>> = planned.iter().map(Planned::all_views).collect();
        let drawn = match (&views[..], &mut *worlds) {
            ([views], [(simulation, ..)]) => vec![self.draw(simulation, views)?],
            (views, _) if views.iter().all(Vec::is_empty) => vec![Vec::new(); views.len()],
            (views, worlds) => {
                let (renderer, batches) = self.renderer()?;
                renderer
                    .draw_worlds(batches, views, &mut |world, read| worlds[world].0.with_frame(|frame| read(frame)))?
            }
        };
        let parts: Vec<_> = worlds.iter_mut().zip(planned.into_iter().zip(drawn)).collect();
        let measured = map_in_parallel(parts.into_iter(), |((simulation, sensors, _), (planned, drawn))| {
            sensors.measure(simulation, planned, &drawn)
        });
        let parts = measured.into_iter().zip(worlds);
        parts.map(|(measured, (simulation, sensors, _))| self.finish(simulation, sensors, measured)).collect()
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
        let measured = sensors.measure(simulation, planned, &drawn);
        self.finish(simulation, sensors, measured)
    }

    /// Draws alone what boxes need so, and gives cameras their boxes.
    fn finish(
        &mut self,
        simulation: &mut Simulation,
        sensors: &mut WorldSensors,
        measured: Measured,
    ) -> Result<Capture, RenderError> {
        let (views, only) = measured.alone();
        let drawn = self.draw_alone(simulation, (&views, &only))?;
        Ok(sensors.finish(&simulation.world, measured, &drawn))
    }

    fn draw(&mut self, simulation: &mut Simulation, views: &[ViewPlan]) -> Result<Vec<Outputs>, RenderError> {
        self.draw_alone(simulation, (views, &[]))
    }

    /// [`Renderer::draw_alone`].
    ///
    /// # Errors
    /// [`RenderError`].
    fn draw_alone(
        &mut self,
        simulation: &mut Simulation,
        views: (&[ViewPlan], &[Arc<SlotSet>]),
    ) -> Result<Vec<Outputs>, RenderError> {
        if views.0.is_empty() {
            return Ok(Vec::new());
        }
        let (renderer, batches) = self.renderer()?;
        simulation.with_frame(|frame| renderer.draw_alone(frame, batches, views.0, views.1))
    }
}
