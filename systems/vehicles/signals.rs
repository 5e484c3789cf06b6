//! Traffic signals: what they show is a function of the clock's time, but for those that are held.
//!
//! A [`Signal`] lets its groups drive one after another: green, amber, and then all red before the next group's turn.
//! One of [`HeldSignals`] shows what it was told until it is released, whatever the time. [`Signals::tick`] works out
//! once per step what every group's head shows; [`light_heads`] switches the lamps of [`SignalHead`]s when that
//! changed.

use crate::assets::material::MaterialId;
use crate::ecs::clock::Clock;
use crate::ecs::sub_steps::SubStep;
use crate::lights::components::Light;
use bevy_ecs::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Times of a signal, seconds.
#[derive(Clone, PartialEq, Debug)]
pub struct Signal {
    /// Name in scenes.
    pub name: String,
    /// Seconds of green of each group, in turn.
    pub green: Vec<f32>,
    /// After every green.
    pub amber: f32,
    /// All red after every amber.
    pub red: f32,
    /// Position in the cycle at time 0, seconds.
    pub offset: f32,
}

/// Colour of the head of a group.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default, Serialize, Deserialize)]
pub enum Aspect {
    /// Stop.
    #[default]
    Red,
    /// Stop if it can be done.
    Amber,
    /// Go.
    Green,
}

impl Signal {
    /// Seconds until everything repeats.
    pub fn cycle(&self) -> f64 {
        self.green.iter().map(|green| f64::from(green + self.amber + self.red)).sum()
    }

    /// Aspect of a group, and the seconds that it lasts still (of red: until its own green).
    pub fn aspect(&self, group: usize, seconds: f64) -> (Aspect, f32) {
        let cycle = self.cycle();
        // A signal without a cycle never lets anything go.
        if cycle.is_nan() || cycle <= 0.0 {
            return (Aspect::Red, f32::INFINITY);
        }
        let before: f64 = self.green.iter().take(group).map(|green| f64::from(green + self.amber + self.red)).sum();
        let green = f64::from(self.green.get(group).copied().unwrap_or(0.0));
        let amber = green + f64::from(self.amber);
        let since = (seconds + f64::from(self.offset) - before).rem_euclid(cycle);
        if since < green {
            (Aspect::Green, (green - since) as f32)
        } else if since < amber {
            (Aspect::Amber, (amber - since) as f32)
        } else {
            (Aspect::Red, (cycle - since) as f32)
        }
    }
}

/// Signals that are controlled from outside: by name, what each of their groups shows. State, and set by the input
/// [`SetSignal`](crate::run::standard_inputs::SetSignal).
#[derive(Resource, Clone, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct HeldSignals(pub BTreeMap<String, Vec<Aspect>>);

/// All signals, and what their heads show in this step.
#[derive(Resource, Clone, PartialEq, Debug, Default)]
pub struct Signals {
    signals: Vec<Signal>,
    /// The first head of each signal among `shown`.
    first: Vec<u32>,
    /// Aspect of every group of every signal, and the seconds that it lasts still; infinite where it is held.
    shown: Vec<(Aspect, f32)>,
}

impl Signals {
    /// Signals, whose places in the list name them.
    pub fn new(signals: Vec<Signal>) -> Self {
        let mut first = Vec::with_capacity(signals.len());
        let mut heads = 0;
        for signal in &signals {
            first.push(heads);
            heads += signal.green.len() as u32;
        }
        let mut all = Self { signals, first, shown: vec![(Aspect::Red, 0.0); heads as usize] };
        all.tick(0.0, &HeldSignals::default());
        all
    }

    /// All signals.
    pub fn iter(&self) -> impl Iterator<Item = &Signal> {
        self.signals.iter()
    }

    /// The index among [`Signals::heads`] of a signal's group; `None` if there is no such.
    pub fn head(&self, signal: &str, group: usize) -> Option<u32> {
        let index = self.signals.iter().position(|s| s.name == signal)?;
        (group < self.signals[index].green.len()).then(|| self.first[index] + group as u32)
    }

    /// Aspect of every group of every signal in this step, and the seconds that it lasts still; infinite where it is
    /// held.
    pub fn heads(&self) -> &[(Aspect, f32)] {
        &self.shown
    }

    /// The heads of the other groups of a head's signal.
    pub(super) fn others(&self, head: u32) -> impl Iterator<Item = u32> {
        let signal = self.first.partition_point(|&first| first <= head).saturating_sub(1);
        let first = self.first.get(signal).copied().unwrap_or(0);
        let end = self.first.get(signal + 1).copied().unwrap_or(self.shown.len() as u32);
        (first..end).filter(move |&other| other != head)
    }

    /// Works out what they show at a time. What is held with another number of groups than it has is not held.
    pub fn tick(&mut self, seconds: f64, held: &HeldSignals) {
        for (signal, &first) in self.signals.iter().zip(&self.first) {
            let held = held.0.get(&signal.name).filter(|shows| shows.len() == signal.green.len());
            for group in 0..signal.green.len() {
                self.shown[first as usize + group] = match held {
                    Some(shows) => (shows[group], f32::INFINITY),
                    None => signal.aspect(group, seconds),
                };
            }
        }
    }
}

/// Brings signals to the time of a step, or of a part of one.
pub fn tick_signals(now: Res<SubStep>, held: Res<HeldSignals>, mut signals: ResMut<Signals>) {
    if !signals.signals.is_empty() {
        signals.tick(now.time, &held);
    }
}

/// Works out what signals show between two steps, where something other than the time changed it.
pub(crate) fn tick_signals_now(world: &mut World) {
    let seconds = world.resource::<Clock>().seconds();
    world.resource_scope(|world, mut signals: Mut<Signals>| signals.tick(seconds, world.resource::<HeldSignals>()));
}

/// Shows what a group of a signal does, by the lamps below it. State, as its lamps are: it says what they were last
/// switched to.
#[derive(Component, Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct SignalHead {
    /// An index of [`Signals::heads`].
    pub head: u32,
    /// Aspect that its lamps show; `None` before the first step.
    pub shown: Option<Aspect>,
}

/// A lamp of a [`SignalHead`]; the entity may carry a [`Light`] and its glass.
#[derive(Component, Clone, Copy, PartialEq, Debug)]
pub struct SignalLamp {
    /// When it is on.
    pub aspect: Aspect,
    /// Materials of its glass, off and on.
    pub glass: Option<(MaterialId, MaterialId)>,
}

/// Switches the lamps below heads whose signal changed.
pub fn light_heads(
    signals: Res<Signals>,
    mut heads: Query<(Entity, &mut SignalHead)>,
    children: Query<&Children>,
    mut lamps: Query<(&SignalLamp, Option<&mut Light>, Option<&mut MaterialId>)>,
) {
    for (entity, mut head) in &mut heads {
        let aspect = signals.shown.get(head.head as usize).map(|shown| shown.0);
        if aspect == head.shown {
            continue;
        }
        head.shown = aspect;
        for below in children.iter_descendants(entity) {
            if let Ok((lamp, light, glass)) = lamps.get_mut(below) {
                let is_on = aspect == Some(lamp.aspect);
                if let Some(mut light) = light
                    && light.enabled != is_on
                {
                    light.enabled = is_on;
                }
                if let (Some((dark, lit)), Some(mut material)) = (lamp.glass, glass) {
                    material.set_if_neq(if is_on { lit } else { dark });
                }
            }
        }
    }
}
