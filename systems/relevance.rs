//! How much a light matters to an object: its record for the shaders, its relevance score, its irradiance at a point.
//!
//! [`light_record`] makes the record of a light entity, [`ScoredLight::new`] folds it into what [`score`] reads.
//! [`irradiance`] is the shader's formula on the CPU; [`score`] bounds it over a sphere.

use crate::bounds::Sphere;
use crate::components::{Light, LightKind};
use crate::draw_list::LightRecord;
use bevy_transform::components::GlobalTransform;
use glam::{Vec3, Vec4};

/// Rec. 709 luminance of linear RGB.
pub const LUMINANCE: Vec3 = Vec3::new(0.2126, 0.7152, 0.0722);
/// The attenuation's denominator is at least this, here and in the shader.
const MIN_DENOMINATOR: f32 = 1e-4;
/// Light beyond this is no light: sums of a hundred million such lights at the least denominator stay finite.
const MAX_LUMINANCE: f32 = 1e26;
/// Difference of the cosines of inner and outer cone, at least; the shader divides by it.
const MIN_CONE_STEP: f32 = 1e-4;
/// A classic spot ends at its outer angle all at once. Its score must not, or weights would jump as an object leaves
/// the cone: it goes to 0 from there to this many times the angle's tangent.
const SOFT_EDGE: f32 = 1.25;
/// The sphere grows by this part of its distance, so that what rounding takes from the score is less than this gives.
const ROUNDING: f32 = 1e-6;

/// A light as [`score`] reads it: one per slot, folded from its [`LightRecord`].
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ScoredLight {
    /// World space, metres.
    pub position: Vec3,
    /// Metres; infinite where the light has no end, 0 for an empty slot.
    pub range: f32,
    /// Denominator of the attenuation over luminance, as a polynomial in the distance: constant, linear, quadratic and,
    /// last, its least value.
    pub denominator: Vec4,
    /// World space, unit: the way the light shines.
    pub axis: Vec3,
    /// 1 / range², 0 where the light has no range.
    pub inverse_range_squared: f32,
    /// As in [`LightRecord`].
    pub kind: u32,
    /// Luminance of the magnitude of its colour or of its ambient colour, whichever is larger.
    pub luminance: f32,
    /// Tangent of the outer half angle (spot with exponent).
    pub tan_outer: f32,
    /// h of the bound 1 / (1 + h·tan²) ≥ cos^exponent (spot with exponent).
    pub falloff: f32,
    /// Cosine of the outer half angle, rounded down (spot with inner cone).
    pub cos_outer: f32,
    /// 1 / (cos inner − cos outer) (spot with inner cone).
    pub inverse_cone: f32,
}

impl ScoredLight {
    /// An empty slot: reaches nothing.
    pub const OFF: Self = Self {
        position: Vec3::ZERO,
        range: 0.0,
        denominator: Vec4::ONE,
        axis: Vec3::NEG_Z,
        inverse_range_squared: 0.0,
        kind: LightRecord::OFF,
        luminance: 0.0,
        tan_outer: 0.0,
        falloff: 0.0,
        cos_outer: 0.0,
        inverse_cone: 0.0,
    };

    /// Folds a record; [`Self::OFF`] where it gives no light that can be computed with.
    pub fn new(record: &LightRecord) -> Self {
        // The ambient part reaches as far as the rest and may be the larger one.
        let brightness = |rgb: [f32; 3]| Vec3::from(rgb).abs().dot(LUMINANCE);
        let luminance = brightness(record.color).max(brightness(record.ambient));
        let denominator = Vec3::from(record.attenuation).extend(MIN_DENOMINATOR) / luminance;
        let is_bright = luminance > 0.0 && luminance < MAX_LUMINANCE && denominator.is_finite();
        if record.kind == LightRecord::OFF || !is_bright || !record.inverse_range_squared.is_finite() {
            return Self::OFF;
        }
        let is_parallel = record.kind == LightRecord::DIRECTIONAL;
        let cos_squared = f64::from(record.cos_outer).powi(2).max(1e-9);
        let tan_squared = (1.0 / cos_squared - 1.0).max(1e-9);
        // For e ≥ 2, (1 + x)^(e/2) ≥ 1 + x·e/2 (Bernoulli); below, the function is concave and lies above its chord.
        let half_exponent = f64::from(record.exponent) * 0.5;
        let chord = ((1.0 + tan_squared).powf(half_exponent) - 1.0) / tan_squared * 0.9999;
        Self {
            position: record.position.into(),
            range: if is_parallel { f32::INFINITY } else { record.inverse_range_squared.sqrt().recip() },
            denominator,
            axis: record.direction.into(),
            inverse_range_squared: record.inverse_range_squared,
            kind: record.kind,
            luminance,
            tan_outer: tan_squared.sqrt() as f32 * (1.0 + ROUNDING),
            falloff: if half_exponent >= 1.0 { half_exponent } else { chord } as f32,
            cos_outer: record.cos_outer - ROUNDING,
            inverse_cone: 1.0 / (record.cos_inner - record.cos_outer).max(MIN_CONE_STEP),
        }
    }

    /// A cheap test that implies score 0: the sphere lies beyond the range, with a margin for rounding.
    pub(crate) fn is_out_of_range(&self, sphere: Sphere) -> bool {
        let reach = (self.range + sphere.radius.max(0.0)) * 1.00001;
        sphere.center.distance_squared(self.position) > reach * reach
    }
}

/// The record of a light; kind [`LightRecord::OFF`] where it is disabled, has no colour, range or cone, or is not finite.
///
/// Negative attenuation coefficients count as 0: attenuation that grows with distance has no bound. A spot's outer angle
/// is at most 85° and its inner angle a little less than the outer.
pub fn light_record(light: &Light, world_from_light: &GlobalTransform) -> LightRecord {
    let off = LightRecord { kind: LightRecord::OFF, ..LightRecord::default() };
    let color = light.color * light.intensity;
    let position = world_from_light.translation();
    let direction = Vec3::from(-world_from_light.affine().matrix3.z_axis).normalize_or_zero();
    // Negative colours count by magnitude, a negative intensity is no light.
    let luminance = (color.abs() + light.ambient.abs()).dot(LUMINANCE) * light.intensity.signum();
    let is_finite = [color, position, direction, light.ambient, light.attenuation].iter().all(|v| v.is_finite());
    let is_lit = luminance > 0.0 && light.range > 0.0 && light.ambient.abs().max_element() < MAX_LUMINANCE;
    let points_somewhere = light.kind == LightKind::Point || direction != Vec3::ZERO;
    if !light.enabled || !is_finite || !is_lit || !points_somewhere {
        return off;
    }
    let mut record = LightRecord {
        position: position.into(),
        direction: direction.into(),
        inverse_range_squared: (light.range * light.range).recip(),
        color: color.into(),
        attenuation: light.attenuation.max(Vec3::ZERO).into(),
        ambient: light.ambient.into(),
        ..off
    };
    record.kind = match light.kind {
        LightKind::Point => LightRecord::POINT,
        LightKind::Directional => LightRecord::DIRECTIONAL,
        LightKind::Spot { outer, inner, exponent } => {
            if !(outer > 0.0 && outer.is_finite() && exponent.is_finite() && inner.is_none_or(f32::is_finite)) {
                return off;
            }
            let outer = outer.clamp(1e-3, 85f32.to_radians());
            record.cos_outer = outer.cos();
            record.cos_inner = inner.unwrap_or(0.0).clamp(0.0, outer).cos().max(record.cos_outer + MIN_CONE_STEP);
            record.exponent = if inner.is_some() { 0.0 } else { exponent.max(0.0) };
            if inner.is_some() { LightRecord::SPOT_CONE } else { LightRecord::SPOT_EXPONENT }
        }
    };
    if ScoredLight::new(&record).kind == LightRecord::OFF { off } else { record }
}

/// An upper bound of the irradiance (luminance, at normal incidence) that the light gives anywhere in the sphere; 0 out
/// of its range or cone (classic spots: a little beyond the cone, so that it ends smoothly).
///
/// Attenuation and window fall with the distance, so the sphere's nearest point bounds them. The spot's factor falls
/// with the angle from the axis, and the sphere fits in a cylinder along the axis: no point of it is further along than
/// A = t + r or nearer to the axis than B = q − r (t, q: the centre's place along and off the axis), so no angle's
/// tangent is less than B/A. A larger sphere around this one never scores lower: a packet's sphere bounds its members.
pub fn score(light: &ScoredLight, sphere: Sphere) -> f32 {
    match light.kind {
        LightRecord::OFF => return 0.0,
        LightRecord::DIRECTIONAL => return light.luminance,
        _ => {}
    }
    let v = sphere.center - light.position;
    let distance = v.length();
    // Too far to square, 10¹⁹ m.
    if !distance.is_finite() {
        return 0.0;
    }
    let r = sphere.radius.max(0.0) + distance * ROUNDING;
    let d = (distance - r).max(0.0);
    let window = range_window(d * d, light.inverse_range_squared);
    let [constant, linear, quadratic, least] = light.denominator.to_array();
    let irradiance = window / (constant + d * (linear + d * quadratic)).max(least);
    if light.kind == LightRecord::POINT || window == 0.0 {
        return irradiance;
    }
    let t = v.dot(light.axis);
    let q = (v - light.axis * t).length();
    let along = t + r;
    if along <= 0.0 {
        return 0.0;
    }
    let tan = (q - r).max(0.0) / along;
    irradiance
        * match light.kind {
            LightRecord::SPOT_EXPONENT => {
                let edge =
                    ((SOFT_EDGE * light.tan_outer - tan) / ((SOFT_EDGE - 1.0) * light.tan_outer)).clamp(0.0, 1.0);
                edge * edge / (1.0 + light.falloff * (tan * tan))
            }
            _ => cone_step(1.0 / (1.0 + tan * tan).sqrt(), light.cos_outer, light.inverse_cone),
        }
}

/// 1 at the light, exactly 0 from the range on, smooth at both: (1 − d⁴/R⁴)².
fn range_window(distance_squared: f32, inverse_range_squared: f32) -> f32 {
    let x = distance_squared * inverse_range_squared;
    let window = (1.0 - x * x).max(0.0);
    window * window
}

/// KHR_lights_punctual's step between outer and inner cone.
fn cone_step(cos: f32, cos_outer: f32, inverse_cone: f32) -> f32 {
    let step = ((cos - cos_outer) * inverse_cone).clamp(0.0, 1.0);
    step * step
}

/// The irradiance (linear RGB, at normal incidence, unshadowed) that the light gives at a point: what the lighting
/// shader computes, attenuation · spot · window times the light's colour.
pub fn irradiance(light: &LightRecord, point: Vec3) -> Vec3 {
    Vec3::from(light.color) * falloff(light, point).0
}

/// [`falloff`] at the centre of a sphere, but a classic spot counts by how far the sphere is in its cone, so that the
/// edge does not pass the whole object at once: 0 where it is outside, 1 where it is inside, a smooth step between.
pub(crate) fn falloff_around(light: &LightRecord, sphere: Sphere) -> (f32, Vec3) {
    if light.kind != LightRecord::SPOT_EXPONENT {
        return falloff(light, sphere.center);
    }
    let (reach, toward) = falloff(&LightRecord { kind: LightRecord::POINT, ..*light }, sphere.center);
    let direction = Vec3::from(light.direction);
    let v = sphere.center - Vec3::from(light.position);
    let along = v.dot(direction);
    let (cos_outer, sin_outer) = (light.cos_outer, (1.0 - light.cos_outer * light.cos_outer).sqrt());
    // Distance of the centre from the cone's surface, over the radius.
    let inside = (along * sin_outer - (v - direction * along).length() * cos_outer) / sphere.radius.max(1e-6);
    let part = (inside * 0.5 + 0.5).clamp(0.0, 1.0);
    let spot = direction.dot(-toward).max(0.0).powf(light.exponent);
    (reach * spot * part * part * (3.0 - 2.0 * part), toward)
}

/// Attenuation · spot · window at a point, and the unit vector towards the light (zero at the light itself).
pub(crate) fn falloff(light: &LightRecord, point: Vec3) -> (f32, Vec3) {
    let direction = Vec3::from(light.direction);
    match light.kind {
        LightRecord::OFF => return (0.0, Vec3::ZERO),
        LightRecord::DIRECTIONAL => return (1.0, -direction),
        _ => {}
    }
    let v = Vec3::from(light.position) - point;
    let distance = v.length();
    let toward = if distance > 0.0 { v / distance } else { Vec3::ZERO };
    let [constant, linear, quadratic] = light.attenuation;
    let attenuation = 1.0 / (constant + distance * (linear + distance * quadratic)).max(MIN_DENOMINATOR);
    let window = range_window(distance * distance, light.inverse_range_squared);
    let cos = direction.dot(-toward);
    let spot = match light.kind {
        LightRecord::POINT => 1.0,
        LightRecord::SPOT_EXPONENT if cos <= light.cos_outer => 0.0,
        LightRecord::SPOT_EXPONENT => cos.powf(light.exponent),
        _ => cone_step(cos, light.cos_outer, 1.0 / (light.cos_inner - light.cos_outer)),
    };
    (attenuation * window * spot, toward)
}
