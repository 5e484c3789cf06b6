//! Random lights and scenes for the light tests.

#![allow(dead_code)]

use glam::{DVec3, Quat, Vec3};
use proptest::prelude::*;
use proptest::test_runner::FileFailurePersistence;
use systems::lights::search::{Found, Level, Scratch};
use systems::lights::{
    Light, LightKind, LightPolicy, LightRecord, LightTree, ListedLights, Policies, ScoredLight, Selection, brute_force,
    search,
};
use systems::space::{GlobalTransform, Sphere, Transform};

pub const LUMINANCE: DVec3 = DVec3::new(0.2126, 0.7152, 0.0722);

pub fn any_direction() -> impl Strategy<Value = Vec3> {
    [-1.0f32..1.0, -1.0f32..1.0, -1.0f32..1.0].prop_map(|v| Vec3::from(v).try_normalize().unwrap_or(Vec3::Y))
}

pub fn any_place(extent: f32) -> impl Strategy<Value = Vec3> {
    [-extent..extent, -extent..extent, -extent..extent].prop_map(Vec3::from)
}

pub fn any_kind() -> impl Strategy<Value = LightKind> {
    prop_oneof![
        2 => Just(LightKind::Point),
        1 => Just(LightKind::Directional),
        2 => (prop_oneof![3 => 0.03f32..1.6, 1 => 1e-3f32..0.03], prop::option::of(0.0f32..1.0), 0.0f32..40.0).prop_map(|(outer, inner, exponent)| {
            LightKind::Spot { outer, inner: inner.map(|part| outer * part), exponent }
        }),
    ]
}

prop_compose! {
    pub fn any_light()(
        kind in any_kind(),
        color in [0.0f32..1.0, 0.0f32..1.0, 0.01f32..1.0],
        intensity in 0.1f32..100.0,
        ambient in prop_oneof![3 => Just(0.0f32), 1 => 0.0f32..0.1],
        range in prop_oneof![4 => 1.0f32..60.0, 1 => Just(f32::INFINITY), 1 => Just(1e6)],
        attenuation in (prop_oneof![Just(0.0f32), Just(1.0)], prop_oneof![Just(0.0f32), 0.0f32..1.0], 0.0f32..1.0),
    ) -> Light {
        let (color, attenuation) = (Vec3::from(color), Vec3::from(attenuation));
        Light { kind, color, ambient: Vec3::splat(ambient), range, attenuation, ..Light::point(intensity, range) }
    }
}

/// A light, or one with a value that makes it none, or makes it dark.
pub fn any_odd_light() -> impl Strategy<Value = Light> {
    let odd = prop::sample::select(vec![f32::NAN, f32::INFINITY, -f32::INFINITY, -1.0, 0.0, 1e-42, 1e38]);
    (any_light(), 0..20usize, odd).prop_map(|(mut light, field, value)| {
        match field {
            0 => light.color.x = value,
            1 => light.intensity = value,
            2 => light.range = value,
            3 => light.attenuation.y = value,
            4 => light.enabled = false,
            5 => light.ambient.z = value,
            6 => light.kind = LightKind::Spot { outer: value, inner: None, exponent: 1.0 },
            7 => light.kind = LightKind::Spot { outer: 0.5, inner: Some(value), exponent: 1.0 },
            8 => light.kind = LightKind::Spot { outer: 0.5, inner: None, exponent: value },
            _ => {}
        }
        light
    })
}

pub fn placed(position: Vec3, direction: Vec3) -> GlobalTransform {
    let rotation = Quat::from_rotation_arc(Vec3::NEG_Z, direction);
    Transform { translation: position, rotation, scale: Vec3::ONE }.into()
}

#[derive(Clone, Debug)]
pub struct Scene {
    pub records: Vec<LightRecord>,
    pub scored: Vec<ScoredLight>,
    pub spheres: Vec<Sphere>,
}

/// Lights as they come out of the table.
pub fn scene(records: Vec<LightRecord>, spheres: Vec<Sphere>) -> Scene {
    let records: Vec<LightRecord> = records.iter().map(|record| record.packed().unpacked()).collect();
    Scene { scored: records.iter().map(ScoredLight::new).collect(), records, spheres }
}

impl Scene {
    pub fn select(&self, policy: LightPolicy) -> Vec<Selection> {
        self.select_each(Policies::Same(policy)).0
    }

    /// With what the objects have beyond their three.
    pub fn select_each(&self, policies: Policies) -> (Vec<Selection>, ListedLights) {
        let mut out = vec![Selection::default(); self.spheres.len()];
        let further = brute_force::select(&self.scored, policies, &self.spheres, &mut out);
        (out, further)
    }

    pub fn search<F: Found>(&self, level: Level, policies: Policies) -> (Vec<F>, ListedLights) {
        let mut out = vec![F::default(); self.spheres.len()];
        let tree = LightTree::new(&self.scored);
        let work = (&self.spheres[..], &mut out[..]);
        let mut scratch = Scratch::default();
        search::select(level, &tree, &self.scored, policies, work, &mut scratch);
        (out, scratch.further)
    }
}

/// Any policy, with tolerances from nothing to everything.
pub fn any_policy() -> impl Strategy<Value = LightPolicy> {
    let tolerance = prop::sample::select(vec![0.0f32, 1e-5, 1e-3, 0.01, 0.2, 0.7, 1.0]);
    prop_oneof![
        Just(LightPolicy::Three),
        Just(LightPolicy::Hard),
        Just(LightPolicy::All),
        Just(LightPolicy::ENOUGH),
        tolerance.prop_map(LightPolicy::Enough),
    ]
}

/// Attenuation · spot · window in double precision, from the formulas of the lighting model.
pub fn true_falloff(light: &LightRecord, point: DVec3) -> f64 {
    if light.kind >= LightRecord::DIRECTIONAL {
        return f64::from(u8::from(light.kind == LightRecord::DIRECTIONAL));
    }
    let v = point - Vec3::from(light.position).as_dvec3();
    let d = v.length();
    let [kc, kl, kq] = light.attenuation.map(f64::from);
    let x = d * d * f64::from(light.inverse_range_squared);
    let reach = (1.0 - x * x).max(0.0).powi(2) / (kc + kl * d + kq * d * d).max(1e-4);
    let axis = Vec3::from(light.direction).as_dvec3().normalize_or_zero();
    // At the light itself, nowhere.
    let versine = v.try_normalize().map_or(1.0, |along| (axis - along).length_squared() / 2.0);
    let (outer, softness) = (f64::from(light.versine_outer), f64::from(light.exponent_or_cone_slope));
    match light.kind {
        LightRecord::SPOT_EXPONENT if versine >= outer => 0.0,
        LightRecord::SPOT_EXPONENT => reach * (1.0 - versine).powf(softness),
        LightRecord::SPOT_CONE => reach * ((outer - versine) * softness).clamp(0.0, 1.0).powi(2),
        _ => reach,
    }
}

/// By how much a spot's factor at a point may be off where the way from one unit vector to another, along the spot's
/// axis and to the point, is off by `way` (radians; ε below) and other operations round to single precision.
///
/// The versine is v = m² / 2, |m| = 2 sin(θ/2): it is off by |m| ε + ε² / 2. Between the cones s = (v_outer − v) ·
/// slope, in which v_outer is a rounded number and the slope another: it is off by slope · (that + v_outer · 2⁻²³) +
/// 2⁻²¹. The factor is s², s ≤ 1: off by twice that and its square. A classic factor (1 − v)^e changes by at most e ·
/// (1 − v)^(e−1) per v, and by itself at its edge.
pub fn spot_error(light: &LightRecord, point: DVec3, way: f64) -> f64 {
    let v = point - Vec3::from(light.position).as_dvec3();
    let between = Vec3::from(light.direction).as_dvec3().normalize_or_zero() - v.normalize_or_zero();
    let versine = between.length_squared() / 2.0;
    let versine_error = between.length() * way + way * way / 2.0;
    let (outer, softness) = (f64::from(light.versine_outer), f64::from(light.exponent_or_cone_slope));
    let step_error = softness * (versine_error + outer / f64::from(1 << 23)) + 1.0 / f64::from(1 << 21);
    match light.kind {
        LightRecord::SPOT_CONE => (2.0 * step_error + step_error * step_error).min(1.0),
        LightRecord::SPOT_EXPONENT if (versine - outer).abs() <= versine_error + outer / f64::from(1 << 23) => 1.0,
        LightRecord::SPOT_EXPONENT => (softness * versine_error).min(1.0),
        _ => 0.0,
    }
}

/// Failing inputs are kept beside this file, and tried first from then on.
pub fn cases(cases: u32) -> ProptestConfig {
    let persistence = FileFailurePersistence::WithSource("regressions");
    ProptestConfig { failure_persistence: Some(Box::new(persistence)), ..ProptestConfig::with_cases(cases) }
}
