//! The walk over a file that all checks are made with: where it is, what it found, numbers and names.

#[cfg(feature = "vehicles")]
use super::route_lengths::driven_length;
use crate::scene::format::scene::Scene;
use crate::scene::format::values::Named;
use crate::scene::read::files::Files;
use crate::scene::text::faults::unknown;
use glam::{Affine3A, Vec3};
use std::fmt::Display;
use systems::describe::{Described, Fault, Step, Trail, faults, whole_faults};

/// A walk over a file: where it is, and what it found.
pub struct Check<'a> {
    pub(super) scene: &'a Scene,
    pub(super) files: &'a Files,
    /// Lengths of the scene's routes, metres; `None` where one is refused for its points.
    #[cfg(feature = "vehicles")]
    pub(super) route_lengths: Vec<Option<f64>>,
    at: Trail,
    /// Scale and place of the entity that is looked at, from the transforms above it.
    pub(super) place: Affine3A,
    /// Names of meshes, materials and classes are not known: they are those of whatever scene takes what is checked.
    pub is_of_any_scene: bool,
    pub faults: Vec<Fault>,
}

impl<'a> Check<'a> {
    pub fn new(scene: &'a Scene, files: &'a Files) -> Self {
        Self {
            scene,
            files,
            #[cfg(feature = "vehicles")]
            route_lengths: scene.routes.entries().iter().map(|(_, route)| driven_length(route)).collect(),
            at: Trail::default(),
            place: Affine3A::IDENTITY,
            is_of_any_scene: false,
            faults: Vec::new(),
        }
    }

    pub fn fault(&mut self, message: impl Display) {
        self.faults.push(self.at.fault(message));
    }

    /// Faults of a value that is described on itself.
    pub fn described<T: Described>(&mut self, value: &T) {
        self.within(&faults(value));
    }

    /// Faults of a described value that is there, or not.
    pub(super) fn part<T: Described>(&mut self, name: &'static str, value: Option<&T>) {
        value.into_iter().for_each(|value| self.field(name, |c| c.described(value)));
    }

    /// Faults of a described value as a whole. Ranges of what it is in have been checked.
    #[cfg_attr(not(feature = "vehicles"), allow(dead_code))]
    pub fn whole<T: Described>(&mut self, value: &T) {
        self.within(&whole_faults(value));
    }

    /// Faults of the value here, by their places in it.
    pub fn within(&mut self, faults: &[Fault]) {
        self.faults.extend(faults.iter().map(|fault| self.at.around(fault)));
    }

    pub fn inside(&mut self, step: Step, key: &str, check: impl FnOnce(&mut Self)) {
        let inner = self.at.enter(step, key);
        let outer = std::mem::replace(&mut self.at, inner);
        check(self);
        self.at = outer;
    }

    pub fn field(&mut self, name: &'static str, check: impl FnOnce(&mut Self)) {
        self.inside(Step::Field(name), "", check);
    }

    pub fn each<'b, T>(&mut self, name: &'static str, items: &'b [T], mut check: impl FnMut(&mut Self, &'b T)) {
        self.field(name, |c| {
            for (i, item) in items.iter().enumerate() {
                c.inside(Step::Index(i), "", |c| check(c, item));
            }
        });
    }

    pub fn entries<'b, T>(&mut self, named: &'b Named<T>, mut check: impl FnMut(&mut Self, &'b T)) {
        for (i, (name, value)) in named.entries().iter().enumerate() {
            self.inside(Step::Entry(i), name, |c| {
                if named.position(name) != Some(i) {
                    c.fault(format_args!("duplicate name {name:?}"));
                }
                check(c, value);
            });
        }
    }

    pub(super) fn known_material(&mut self, name: &str) {
        if self.scene.materials.get(name).is_none() && !self.is_of_any_scene {
            let message = unknown("material", name, self.scene.materials.names());
            self.fault(message);
        }
    }

    pub(super) fn known_mesh(&mut self, name: &str) {
        if self.scene.meshes.get(name).is_none() && !self.is_of_any_scene {
            let message = unknown("mesh", name, self.scene.meshes.names());
            self.fault(message);
        }
    }

    pub(super) fn direction(&mut self, name: &'static str, value: [f32; 3]) {
        let length = Vec3::from_array(value).as_dvec3().length();
        // Numbers that are none are said by themselves.
        if length.is_finite() && !(1e-6..=1e6).contains(&length) {
            self.field(name, |c| c.fault(format_args!("expected a direction, found one of length {length}")));
        }
    }
}
