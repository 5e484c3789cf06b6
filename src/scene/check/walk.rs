//! The walk over a file that all checks are made with: where it is, what it found, numbers and names.

#[cfg(feature = "vehicles")]
use super::route_lengths::driven_length;
use crate::scene::format::scene::Scene;
use crate::scene::format::values::{Named, Scale};
use crate::scene::read::files::Files;
use crate::scene::text::faults::unknown;
use glam::{Affine3A, Vec3};
use std::fmt::Display;
use systems::assets::color_text::Color;
use systems::describe::{Described, Fault, Step, Trail, faults};
use systems::space::{FARTHEST, LARGEST};

/// Metres; also factors of scale.
pub const SIZES: (f32, f32) = (1e-5, LARGEST as f32);
/// Entities of a scene.
pub const MOST_ENTITIES: u64 = 4_000_000;

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

    pub fn number(&mut self, name: &'static str, value: f32, min: f32, max: f32) {
        self.field(name, |c| c.in_range(value, min, max));
    }

    pub fn in_range(&mut self, value: f32, min: f32, max: f32) {
        if !(min..=max).contains(&value) {
            self.fault(format_args!("expected a number from {min} to {max}, found {value}"));
        }
    }

    pub fn numbers(&mut self, name: &'static str, values: &[f32], min: f32, max: f32) {
        self.field(name, |c| {
            for (i, &value) in values.iter().enumerate() {
                c.inside(Step::Index(i), "", |c| c.in_range(value, min, max));
            }
        });
    }

    pub fn position(&mut self, name: &'static str, value: &[f64; 3]) {
        self.field(name, |c| {
            for (i, value) in value.iter().enumerate() {
                if !(-FARTHEST..=FARTHEST).contains(value) {
                    let message = format!("expected a number from -{FARTHEST} to {FARTHEST}, found {value}");
                    c.inside(Step::Index(i), "", |c| c.fault(message));
                }
            }
        });
    }

    pub(super) fn count(&mut self, name: &'static str, value: u32, min: u32, max: u32) {
        if !(min..=max).contains(&value) {
            self.field(name, |c| c.fault(format_args!("expected a count from {min} to {max}, found {value}")));
        }
    }

    pub fn color(&mut self, name: &'static str, color: Color, max: f32) {
        match color.0 {
            Ok(rgb) => self.numbers(name, &rgb.to_array(), 0.0, max),
            Err(bad) => self.field(name, |c| c.fault(bad)),
        }
    }

    pub(super) fn scale(&mut self, name: &'static str, scale: Scale, mirrored_too: bool) {
        let (min, max) = SIZES;
        let check = |c: &mut Self, s: f32| {
            if mirrored_too && s < 0.0 {
                c.in_range(s, -max, -min);
            } else {
                c.in_range(s, min, max);
            }
        };
        self.field(name, |c| match scale {
            Scale::Uniform(s) => check(c, s),
            Scale::PerAxis(axes) => {
                for (i, s) in axes.into_iter().enumerate() {
                    c.inside(Step::Index(i), "", |c| check(c, s));
                }
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
        let length = Vec3::from_array(value).length();
        if !(1e-6..=1e6).contains(&length) {
            self.field(name, |c| c.fault(format_args!("expected a direction, found one of length {length}")));
        }
    }
}
