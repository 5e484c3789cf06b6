//! In place of `vehicles.rs` in a build without vehicles: a scene with any is refused.

use super::check::Check;
use super::faults::Fault;
use super::format::{self, Along, Scene};
use super::generate::Random;
use super::spawn::{Placement, Spawner};
use crate::problem::Problem;
use bevy_ecs::prelude::*;
use glam::Affine3A;
use std::path::{Path, PathBuf};
use systems::assets::Library;
use systems::space::Transform;

/// None.
#[derive(Default)]
pub struct Types;

/// What a scene's files of types hold.
#[derive(Default)]
pub struct Loaded {
    pub types: Types,
    pub warnings: Vec<String>,
    pub files: Vec<PathBuf>,
}

pub fn read_types(_: &Scene, _: &Path, _: &mut Library, _: &mut Vec<Fault>) -> Loaded {
    Loaded::default()
}

pub fn check_types(_: &Path) -> Option<Vec<Problem>> {
    None
}

pub fn add_types(_: &Types, _: &mut World) {}

/// There is none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum OnRoute {}

#[derive(Default)]
pub struct VehiclesFound {}

#[derive(Default)]
pub struct Room {
    pub full: usize,
}

impl Room {
    pub fn take(&mut self, _: &Placement, _: &World) -> bool {
        true
    }
}

impl Check<'_> {
    /// Refuses what is of vehicles, beside those of entities.
    pub(super) fn roads(&mut self) {
        let scene = self.scene;
        let found = [
            ("vehicle_types", scene.vehicle_types.is_empty()),
            ("signals", scene.signals.entries().is_empty()),
            ("routes", scene.routes.entries().is_empty()),
        ];
        for (field, _) in found.into_iter().filter(|(_, is_empty)| !is_empty) {
            self.field(field, |c| c.fault(REFUSED));
        }
    }

    pub(super) fn vehicle(&mut self, _: &format::Entity, _: &format::Vehicle) {
        self.fault(REFUSED);
    }

    pub(super) fn generated_vehicles(&mut self) {
        self.fault(REFUSED);
    }

    pub(super) fn known_group(&mut self, _: &str, _: usize) {
        self.fault(REFUSED);
    }

    pub(super) fn along(&mut self, _: &Along) -> u64 {
        self.fault(REFUSED);
        0
    }
}

const REFUSED: &str = "this build has no vehicles (feature `vehicles`)";

pub fn insert(_: &Scene, _: u64, _: &mut World) -> Vec<String> {
    Vec::new()
}

pub fn warnings(_: &mut World) -> Vec<String> {
    Vec::new()
}

pub fn along(_: &Along, _: &World, _: &mut Random) -> Vec<(Transform, OnRoute)> {
    Vec::new()
}

pub fn make_ground(_: &mut EntityWorldMut) {}

impl Spawner<'_> {
    pub(super) fn vehicle(
        &mut self,
        _: &str,
        _: Option<&format::Vehicle>,
        _: Option<OnRoute>,
        _: Entity,
        _: &Affine3A,
    ) {
    }

    pub(super) fn signal_head(&mut self, _: &format::SignalHead, _: Entity) {}
}
