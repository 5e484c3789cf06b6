//! Lamps: which are on, their light, and the glow of their glass.
//!
//! [`switch_lamps`] works out the [`Switches`] of each vehicle from how it moves and what its driver wants; only where
//! these changed does [`light_lamps`] touch those of its [`Lamps`] that are another way now.

use super::components::{Controls, Headlights, Indicator, Motion, Vehicle, VehicleNumber};
use crate::assets::material::MaterialId;
use crate::ecs::changes::{LIGHT_ROWS, rows_per_task};
use crate::ecs::clock::Clock;
use crate::ecs::columns::Column;
use crate::ecs::parallel::in_parallel;
use crate::lights::components::Light;
use bevy_ecs::lifecycle::HookContext;
use bevy_ecs::prelude::*;
use bevy_ecs::world::DeferredWorld;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// When a lamp is on.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[serde(rename_all = "snake_case")]
pub enum LampKind {
    /// With low or high beam.
    Head,
    /// With the head lamps: before the vehicle, low.
    Fog,
    /// While the head lamps are off.
    Daytime,
    /// With the head lamps, dimly; brightly while braking.
    Tail,
    /// While braking.
    Brake,
    /// Blinking, to turn left.
    IndicatorLeft,
    /// Blinking, to turn right.
    IndicatorRight,
    /// In reverse.
    Reverse,
    /// With the head lamps: a cabin, a sign.
    Interior,
}

/// A lamp of a vehicle. Its entity, or entities below the vehicle, carry its [`Light`] and its glass.
#[derive(Component, Clone, Copy, PartialEq, Debug)]
#[component(immutable, on_insert = enlist, on_discard = strike_off)]
pub struct Lamp {
    /// The vehicle; it has to be one when the lamp comes.
    pub vehicle: Entity,
    /// When it is on.
    pub kind: LampKind,
    /// Intensity of its light while it is on: low beam for head lamps, braking for tail lamps.
    pub intensity: f32,
    /// Material of its glass while it is off, and while it is on.
    pub glass: Option<(MaterialId, MaterialId)>,
}

/// The lamps of a vehicle, so that nothing has to look for them. Follows from the [`Lamp`]s; nothing else writes it.
#[derive(Component, Clone, PartialEq, Debug, Default)]
#[component(clone_behavior = Ignore)]
pub struct Lamps(Vec<(LampKind, Entity)>);

/// Enters a lamp into its vehicle's list. All lamps are brought in line at the next chance, this one among them.
fn enlist(mut world: DeferredWorld, context: HookContext) {
    let Some(&lamp) = world.get::<Lamp>(context.entity) else { return };
    if let Some(mut lamps) = world.get_mut::<Lamps>(lamp.vehicle) {
        lamps.0.push((lamp.kind, context.entity));
    }
    if let Some(mut switches) = world.get_mut::<Switches>(lamp.vehicle) {
        switches.shown = Switches::UNKNOWN;
    }
}

fn strike_off(mut world: DeferredWorld, context: HookContext) {
    let Some(&lamp) = world.get::<Lamp>(context.entity) else { return };
    if let Some(mut lamps) = world.get_mut::<Lamps>(lamp.vehicle) {
        lamps.0.retain(|(_, entity)| *entity != context.entity);
    }
}

impl Lamp {
    /// State of its light: on or off, and its intensity.
    pub fn light(&self, switches: Switches) -> (bool, f32) {
        let level = switches.level(self.kind);
        (level > 0.0, self.intensity * level)
    }

    /// Its glass: dark or lit.
    pub fn glass(&self, switches: Switches) -> Option<MaterialId> {
        self.glass.map(|(dark, lit)| if switches.level(self.kind) > 0.0 { lit } else { dark })
    }
}

/// Ratio of the intensity of high beam to that of low beam.
const HIGH_BEAM: f32 = 2.5;

/// Ratio of the intensity of a tail lamp that does not brake to that of one that does.
const TAIL: f32 = 0.25;

/// m/s²: slowing down more than this is done with the brakes.
const BRAKES: f64 = -0.6;

/// Seconds an indicator is on, and then off: 90 a minute (UN Regulation 48: 60 to 120).
const BLINK: f64 = 1.0 / 3.0;

/// Switches of the lamps of a vehicle. State that follows from the rest; kept to see what changes.
#[derive(Component, Clone, Copy, Debug, Default, serde::Serialize, serde::Deserialize)]
#[serde(from = "u8", into = "u8")]
#[component(summary_tick)]
pub struct Switches {
    on: u8,
    /// Switches that the lamps were last brought in line with.
    shown: u8,
}

impl PartialEq for Switches {
    fn eq(&self, other: &Self) -> bool {
        self.on == other.on
    }
}

impl From<u8> for Switches {
    /// Lamps come with their switches.
    fn from(on: u8) -> Self {
        Self { on, shown: on }
    }
}

impl From<Switches> for u8 {
    fn from(switches: Switches) -> Self {
        switches.on
    }
}

impl Switches {
    const LOW: u8 = 1;
    const HIGH: u8 = 2;
    const BRAKE: u8 = 4;
    const LEFT: u8 = 8;
    const RIGHT: u8 = 16;
    const REVERSE: u8 = 32;
    /// Some lamps may be any way.
    const UNKNOWN: u8 = 128;

    /// Finds the lamps that are on at a time, seconds since the start.
    pub fn of(number: VehicleNumber, motion: &Motion, controls: &Controls, seconds: f64) -> Self {
        let mut bits = match controls.headlights {
            Headlights::Off => 0,
            Headlights::Low => Self::LOW,
            Headlights::High => Self::HIGH,
        };
        // A vehicle that stands is held by its brakes.
        let is_slowing = f64::from(motion.acceleration) * motion.speed.signum() < BRAKES;
        if is_slowing || motion.speed == 0.0 || controls.brake > 0.0 {
            bits |= Self::BRAKE;
        }
        if motion.speed < 0.0 || controls.throttle < 0.0 {
            bits |= Self::REVERSE;
        }
        // Not all in step.
        if ((seconds / BLINK + f64::from(number.0) * 0.37) as u64).is_multiple_of(2) {
            bits |= match controls.indicator {
                Indicator::Off => 0,
                Indicator::Left => Self::LEFT,
                Indicator::Right => Self::RIGHT,
                Indicator::Hazard => Self::LEFT | Self::RIGHT,
            };
        }
        bits.into()
    }

    fn has(self, bit: u8) -> bool {
        self.on & bit != 0
    }

    /// Part of a lamp's full intensity; more than 1 for high beam.
    pub fn level(self, kind: LampKind) -> f32 {
        let on = |is_on: bool| f32::from(u8::from(is_on));
        let beam = self.has(Self::LOW | Self::HIGH);
        match kind {
            LampKind::Head if self.has(Self::HIGH) => HIGH_BEAM,
            LampKind::Tail if self.has(Self::BRAKE) => 1.0,
            LampKind::Tail if beam => TAIL,
            LampKind::Tail => 0.0,
            LampKind::Head | LampKind::Fog | LampKind::Interior => on(beam),
            LampKind::Daytime => on(!beam),
            LampKind::Brake => on(self.has(Self::BRAKE)),
            LampKind::IndicatorLeft => on(self.has(Self::LEFT)),
            LampKind::IndicatorRight => on(self.has(Self::RIGHT)),
            LampKind::Reverse => on(self.has(Self::REVERSE)),
        }
    }
}

/// Works out which lamps are on.
#[allow(clippy::type_complexity)]
pub fn switch_lamps(
    clock: Res<Clock>,
    mut vehicles: Query<(&VehicleNumber, &Motion, &Controls, &mut Switches), With<Vehicle>>,
) {
    let seconds = clock.seconds();
    for (numbers, motions, controls, switches) in vehicles.contiguous_iter_mut().into_iter().flatten() {
        let mut switches = Column::new(switches);
        let rows = rows_per_task(switches.len(), LIGHT_ROWS);
        in_parallel(switches.parts(0, rows), |mut part| {
            for row in part.rows() {
                let now = Switches::of(numbers[row], &motions[row], &controls[row], seconds);
                let shown = part.get(row).shown;
                part.set_if_neq(row, Switches { shown, ..now });
            }
        });
    }
}

/// Brings lights and glass in line with switches that changed.
pub fn light_lamps(
    mut changed: Query<(&mut Switches, &Lamps), Changed<Switches>>,
    mut lamps: Query<(&Lamp, Option<&mut Light>, Option<&mut MaterialId>)>,
) {
    for (mut switches, list) in &mut changed {
        let now = *switches;
        let shown = Switches::from(now.shown);
        let differ = |kind: LampKind| now.shown == Switches::UNKNOWN || shown.level(kind) != now.level(kind);
        // Nothing follows that.
        switches.bypass_change_detection().shown = now.on;
        for &(kind, entity) in list.0.iter().filter(|(kind, _)| differ(*kind)) {
            let Ok((lamp, light, material)) = lamps.get_mut(entity) else { continue };
            debug_assert_eq!(lamp.kind, kind);
            if let Some(mut light) = light {
                let (enabled, intensity) = lamp.light(now);
                if light.enabled != enabled || enabled && light.intensity != intensity {
                    (light.enabled, light.intensity) = (enabled, intensity);
                }
            }
            if let (Some(glass), Some(mut material)) = (lamp.glass(now), material) {
                material.set_if_neq(glass);
            }
        }
    }
}
