//! Subject of a measurement: a yard, or a scene of the user's.

use super::grid::Grid;
use super::job::BenchJob;
use crate::frames::{self, FrameError};
use crate::output;
use crate::session::{LoadOptions, Session};
use crate::viewpoint::Viewpoint;
use bevy_ecs::prelude::*;
use systems::Simulation;
use systems::assets::MeshId;

/// A world that changes before every frame.
pub(super) enum Subject {
    /// A grid of objects, some of which are moved from outside.
    Grid(Box<Grid>),
    /// A scene, whose clock steps.
    Scene(Box<Session>),
}

impl Subject {
    /// Loads the scene of a job.
    pub fn scene(path: &std::path::Path, job: &BenchJob) -> Result<Self, FrameError> {
        // The figures of a start must not depend on those before.
        let options = LoadOptions { cache: false, ..job.load.clone() };
        let stage = frames::load_session(path, job.camera.as_deref(), &options)?;
        let outputs = || job.picture.iter().chain(&job.trace);
        frames::check_outputs(&stage.scene.files, |path| outputs().any(|output| output::is_same(path, output)))?;
        Ok(Self::Scene(Box::new(stage)))
    }

    pub fn simulation(&mut self) -> &mut Simulation {
        match self {
            Self::Grid(yard) => &mut yard.simulation,
            Self::Scene(stage) => &mut stage.simulation,
        }
    }

    pub fn viewpoint(&self) -> Viewpoint {
        match self {
            Self::Grid(yard) => Viewpoint::Camera(yard.camera),
            Self::Scene(stage) => stage.viewpoint,
        }
    }

    /// Moves objects of the yard, or steps the scene's clock, before a frame.
    pub fn advance(&mut self, frame: u32) {
        match self {
            Self::Grid(yard) => yard.advance(frame),
            Self::Scene(stage) => stage.simulation.step(),
        }
    }

    /// Objects that are drawn, and lights.
    pub fn counts(&mut self) -> (u32, u32) {
        let world = &mut self.simulation().world;
        let objects = world.query_filtered::<(), With<MeshId>>().iter(world).count();
        let lights = world.query::<&systems::lights::Light>().iter(world).filter(|light| light.enabled).count();
        (objects as u32, lights as u32)
    }
}
