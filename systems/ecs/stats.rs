//! Counts and stage times of a frame: one value that the panel, the benchmark and the tests read.

use bevy_ecs::prelude::*;
use std::time::Instant;

/// A part of the frame schedule.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Stage {
    /// World transforms.
    Transforms,
    /// Tangents of new meshes.
    Tangents,
    /// Levels of detail of new meshes.
    Levels,
    /// Material records, texture arrays and classes.
    Materials,
    /// Light table and light selection.
    Lights,
    /// Instance records.
    Instances,
    /// Batches.
    Batches,
}

impl Stage {
    /// All stages in the order they run, with their names.
    pub const ALL: [(&'static str, Self); 7] = [
        ("transforms", Self::Transforms),
        ("tangents", Self::Tangents),
        ("levels", Self::Levels),
        ("materials", Self::Materials),
        ("lights", Self::Lights),
        ("instances", Self::Instances),
        ("batches", Self::Batches),
    ];
}

/// Duration of a system of the frame schedule.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct SystemTime {
    /// Stage that it is part of.
    pub stage: Stage,
    /// Its function's name.
    pub name: &'static str,
    /// Milliseconds since the frame began.
    pub start_ms: f64,
    /// Milliseconds.
    pub ms: f64,
}

/// Measurements of the last frame on the CPU. Times come from the wall clock and are for people only: nothing reads
/// them back.
#[derive(Resource, Clone, Debug)]
pub struct FrameStats {
    /// Milliseconds of each [`Stage`].
    pub stage_ms: [f64; Stage::ALL.len()],
    /// Times of the systems, in the order they ran.
    pub systems: Vec<SystemTime>,
    /// Drawn objects.
    pub objects: usize,
    /// Objects whose lights were chosen again in this frame.
    pub selected: usize,
    /// Lights whose way through portals was searched for in this frame.
    pub floods: usize,
    /// Objects with more than three lights, and how many they have beyond the three.
    pub listed_objects: usize,
    /// See [`Self::listed_objects`].
    pub listed_lights: u64,
    /// Instance records written in this frame.
    pub instances_written: usize,
    /// Instanced draws, before blended objects.
    pub batches: usize,
    /// Blended objects.
    pub transparent: usize,
    began: Instant,
    lap_started: Instant,
}

impl Default for FrameStats {
    fn default() -> Self {
        Self {
            stage_ms: Default::default(),
            systems: Vec::new(),
            objects: 0,
            selected: 0,
            floods: 0,
            listed_objects: 0,
            listed_lights: 0,
            instances_written: 0,
            batches: 0,
            transparent: 0,
            began: Instant::now(),
            lap_started: Instant::now(),
        }
    }
}

impl FrameStats {
    /// Milliseconds of all stages together.
    pub fn cpu_ms(&self) -> f64 {
        self.stage_ms.iter().sum()
    }
}

pub(crate) fn begin(mut stats: ResMut<FrameStats>) {
    stats.stage_ms = Default::default();
    stats.systems.clear();
    stats.began = Instant::now();
    stats.lap_started = stats.began;
}

/// A system that books the time since the last lap on a stage, and on the system before it.
pub(crate) fn lap(stage: Stage, name: &'static str) -> impl FnMut(ResMut<FrameStats>) {
    move |mut stats| {
        let stats = &mut *stats;
        let started = std::mem::replace(&mut stats.lap_started, Instant::now());
        let ms = (stats.lap_started - started).as_secs_f64() * 1e3;
        stats.stage_ms[stage as usize] += ms;
        let start_ms = (started - stats.began).as_secs_f64() * 1e3;
        stats.systems.push(SystemTime { stage, name, start_ms, ms });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulation::Simulation;

    #[test]
    fn the_times_of_a_stage_are_those_of_its_systems() {
        let mut simulation = Simulation::new();
        // Twice: times are of one frame, not added up.
        for _ in 0..2 {
            simulation.frame();
            let stats = simulation.world.resource::<FrameStats>();
            for (name, stage) in Stage::ALL {
                let systems = stats.systems.iter().filter(|system| system.stage == stage);
                assert!(systems.clone().count() > 0, "{name}");
                assert_eq!(systems.map(|system| system.ms).sum::<f64>(), stats.stage_ms[stage as usize], "{name}");
            }
            assert!(stats.systems.windows(2).all(|pair| pair[0].start_ms <= pair[1].start_ms));
        }
    }
}
