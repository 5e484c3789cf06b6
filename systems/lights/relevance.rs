//! Relevance of a light for an object: its record for the shaders, its score, its irradiance at a point.
//!
//! [`light_record`] makes the record of a light entity, [`ScoredLight::new`] folds it into what [`score`] reads.
//! [`irradiance`] is the shader's formula on the CPU; [`score`] bounds it over a sphere.

use super::components::{Light, LightKind};
use super::record::LightRecord;
use crate::space::bounds::Sphere;
use crate::space::transform::GlobalTransform;
use glam::{Vec3, Vec4};

/// Rec. 709 luminance of linear RGB.
pub const LUMINANCE: Vec3 = Vec3::new(0.2126, 0.7152, 0.0722);
/// The attenuation's denominator is at least this, here and in the shader.
const MIN_DENOMINATOR: f32 = 1e-4;
/// Light beyond this is no light: sums of a hundred million such lights at the least denominator stay finite.
const MAX_LUMINANCE: f32 = 1e26;
/// From the inner cone's versine to the outer one's, at least, as a part of the latter: sixteen steps of single
/// precision. A spot whose cones are closer than that has a hard edge.
const LEAST_CONE_STEP: f64 = 1.0 / (1 << 20) as f64;
/// Half angles that a spot's outer cone may have, radians.
const CONES: [f32; 2] = [1e-3, 85.0 * std::f32::consts::PI / 180.0];
/// The sphere grows by this part of its distance, so that what rounding takes from the score is less than this gives.
pub(crate) const ROUNDING: f32 = 1e-6;
/// A classic spot ends at its outer angle all at once. Its score must not, or weights would jump as an object leaves
/// the cone: it goes to 0 from there to this many times the angle's tangent.
const SOFT_EDGE: f32 = 1.25;

/// A light as the search reads it: one per slot, folded from its [`LightRecord`]. Two cache lines: the first is all
/// that
/// [`score`] reads.
#[derive(Clone, Copy, PartialEq, Debug)]
#[repr(C, align(64))]
pub struct ScoredLight {
    /// World space, metres; of a directional light as in [`LightRecord`].
    pub position: Vec3,
    /// 1 / range², 0 where the light has no range.
    pub inverse_range_squared: f32,
    /// Denominator of the attenuation over luminance, as a polynomial in the distance: constant, linear, quadratic and,
    /// last, its least value.
    pub denominator: Vec4,
    /// World space, unit: the way the light shines.
    pub axis: Vec3,
    /// 1 − cosine of the half angle at which the score ends, rounded up: the outer one, or a little more for a spot
    /// with exponent.
    pub versine_outer: f32,
    /// 1 / (versine of the half angle at which the score ends − versine of the one within which it is full).
    pub inverse_cone: f32,
    /// h of the bound 1 / (1 + h·tan²) ≥ cos^exponent; 0 for a spot with inner cone.
    pub falloff: f32,
    /// The same as in [`LightRecord`].
    pub kind: u32,
    /// Luminance of the magnitude of its colour or of its ambient colour, whichever is larger.
    pub luminance: f32,
    /// Part of the ambient cube's irradiance per irradiance of luminance 1: colour and four times the ambient colour,
    /// over luminance.
    pub tint: Vec3,
    /// Part of the ambient cube's direction: luminance of the (signed) colour over luminance.
    pub directed: f32,
    /// Part of each side of the ambient cube, wherever the light comes from: twice the luminance of the ambient colour
    /// over luminance.
    pub even: f32,
    /// Exponent of the classic spot.
    pub exponent: f32,
    /// Cosine and sine of the outer half angle; read of classic spots.
    pub edge: [f32; 2],
    /// Metres; infinite where the light has no end, 0 for an empty slot.
    pub range: f32,
}

impl ScoredLight {
    /// An empty slot: reaches nothing.
    pub const OFF: Self = Self {
        position: Vec3::ZERO,
        inverse_range_squared: 0.0,
        denominator: Vec4::ONE,
        axis: Vec3::NEG_Z,
        versine_outer: 0.0,
        inverse_cone: 0.0,
        falloff: 0.0,
        kind: LightRecord::OFF,
        luminance: 0.0,
        tint: Vec3::ZERO,
        directed: 0.0,
        even: 0.0,
        exponent: 0.0,
        edge: [0.0, 1.0],
        range: 0.0,
    };

    /// Folds a record; [`Self::OFF`] where it gives no light that can be computed with.
    pub fn new(record: &LightRecord) -> Self {
        let (color, ambient) = (Vec3::from(record.color), Vec3::from(record.ambient));
        // The ambient part reaches as far as the rest and may be the larger one.
        let luminance = color.abs().dot(LUMINANCE).max(ambient.abs().dot(LUMINANCE));
        let denominator = Vec3::from(record.attenuation).extend(MIN_DENOMINATOR) / luminance;
        let is_bright = luminance > 0.0 && luminance < MAX_LUMINANCE && denominator.is_finite();
        if record.kind == LightRecord::OFF || !is_bright || !record.inverse_range_squared.is_finite() {
            return Self::OFF;
        }
        let is_parallel = record.kind == LightRecord::DIRECTIONAL;
        let has_exponent = record.kind == LightRecord::SPOT_EXPONENT;
        let versine = record.versine_outer;
        let (cos_outer, sin_outer) = (1.0 - versine, (versine * (2.0 - versine)).max(0.0).sqrt());
        let (end, inverse_cone) = if has_exponent {
            let tan = SOFT_EDGE * sin_outer / cos_outer.max(1e-3);
            let secant = (1.0 + tan * tan).sqrt();
            let end = tan * tan / (secant * (1.0 + secant));
            (end, 1.0 / (end - versine).max(end * ROUNDING))
        } else {
            (versine, record.exponent_or_cone_slope)
        };
        Self {
            position: record.position.into(),
            inverse_range_squared: record.inverse_range_squared,
            denominator,
            axis: record.direction.into(),
            versine_outer: end * (1.0 + ROUNDING),
            inverse_cone,
            falloff: if has_exponent { exponent_bound(record) } else { 0.0 },
            kind: record.kind,
            luminance,
            tint: (color + 4.0 * ambient) / luminance,
            directed: color.dot(LUMINANCE) / luminance,
            even: 2.0 * ambient.dot(LUMINANCE) / luminance,
            exponent: if has_exponent { record.exponent_or_cone_slope } else { 0.0 },
            edge: [cos_outer, sin_outer],
            range: if is_parallel { f32::INFINITY } else { record.inverse_range_squared.sqrt().recip() },
        }
    }
}

/// Least h with 1 / (1 + h·tan²) ≥ cos^exponent within the cone. For e ≥ 2, (1 + x)^(e/2) ≥ 1 + x·e/2 (Bernoulli);
/// below, the function is concave and lies above its chord.
fn exponent_bound(record: &LightRecord) -> f32 {
    let half = f64::from(record.exponent_or_cone_slope) * 0.5;
    if half >= 1.0 {
        return half as f32;
    }
    let cos_squared = (1.0 - f64::from(record.versine_outer)).powi(2).max(1e-9);
    let tan_squared = (1.0 / cos_squared - 1.0).max(1e-9);
    (((1.0 + tan_squared).powf(half) - 1.0) / tan_squared * 0.9999) as f32
}

/// The record of a light; kind [`LightRecord::OFF`] where it is disabled, has no colour, range or cone, or is not
/// finite.
///
/// Negative attenuation coefficients count as 0: attenuation that grows with distance has no bound. A spot's outer
/// angle is from 0.057° to 85° and its inner angle at most the outer.
///
/// Cones are kept as versines, 1 − cosine: the cosines of narrow ones lie too close to 1 for single precision to tell
/// them apart.
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
        size: light.size().max(0.0),
        ..off
    };
    record.kind = match light.kind {
        LightKind::Point => LightRecord::POINT,
        LightKind::Directional => {
            record.position = (-direction).into();
            LightRecord::DIRECTIONAL
        }
        LightKind::Spot { outer, inner, exponent } => {
            if !(outer > 0.0 && outer.is_finite() && exponent.is_finite() && inner.is_none_or(f32::is_finite)) {
                return off;
            }
            let outer = outer.clamp(CONES[0], CONES[1]);
            let edge = versine(outer);
            // A little steeper, so that the axis is full light however this and the edge are rounded.
            let steeper = 1.0 + 1.0 / f64::from(1 << 22);
            let slope = |inner: f32| steeper / (edge - versine(inner.clamp(0.0, outer))).max(edge * LEAST_CONE_STEP);
            record.versine_outer = edge as f32;
            record.exponent_or_cone_slope = inner.map_or(exponent.max(0.0), |inner| slope(inner) as f32);
            if inner.is_some() { LightRecord::SPOT_CONE } else { LightRecord::SPOT_EXPONENT }
        }
    };
    if ScoredLight::new(&record).kind == LightRecord::OFF { off } else { record }
}

/// 1 − cosine of an angle in radians, exact also where the angle is small.
fn versine(angle: f32) -> f64 {
    2.0 * (f64::from(angle) * 0.5).sin().powi(2)
}

/// An upper bound of the irradiance (luminance, at normal incidence) that the light gives anywhere in the sphere; 0 out
/// of its range or cone (classic spots: a little beyond the cone, so that it ends smoothly).
///
/// Attenuation and window fall with the distance, so the sphere's nearest point bounds them. The spot's factor falls
/// with the angle from the axis, and the sphere fits in a cylinder along the axis: no point of it is further along than
/// A = t + r or nearer to the axis than B = q − √(r² − min(t, 0)²) (t, q: the centre's place along and off the axis),
/// so no angle's tangent is less than B/A. A larger sphere around this one never scores lower.
pub fn score(light: &ScoredLight, sphere: Sphere) -> f32 {
    match light.kind {
        LightRecord::OFF => return 0.0,
        LightRecord::DIRECTIONAL => return light.luminance,
        _ => {}
    }
    // The order of operations is the vector search's (search/lanes.rs): the two give the same bits.
    let v = sphere.center - light.position;
    let distance = v.dot(v).sqrt();
    let radius = sphere.radius.max(0.0);
    let r = radius + distance * ROUNDING;
    let d = (distance * (1.0 - ROUNDING) - radius).max(0.0);
    let window = range_window(d * d, light.inverse_range_squared);
    let [constant, linear, quadratic, least] = light.denominator.to_array();
    let denominator = (constant + d * (linear + d * quadratic)).max(least);
    let score = if light.kind == LightRecord::POINT {
        window / denominator
    } else {
        let t = v.dot(light.axis);
        let off_axis = v - light.axis * t;
        let along = t + r;
        // Only the part of the sphere before the light counts: it is narrower where the centre is behind.
        let behind = t.min(0.0);
        let reach = (r * r - behind * behind).max(0.0).sqrt();
        let off = (off_axis.dot(off_axis).sqrt() - reach).max(0.0);
        let hypotenuse = (along * along + off * off).sqrt();
        // 1 − cos without the difference: sin² / (1 + cos).
        let versine = off * off / (hypotenuse * (hypotenuse + along));
        let cos = 1.0 - versine;
        let cos_squared = cos * cos;
        let cone = window * (cone_step(versine, light.versine_outer, light.inverse_cone) * cos_squared);
        // 1 / (1 + h·tan²), times cos² above and below; sin² = versine · (2 − versine).
        let score = cone / (denominator * (cos_squared + light.falloff * (versine * (2.0 - versine))));
        if along > 0.0 { score } else { 0.0 }
    };
    // Not a number where something is too far away to be squared, 10¹⁹ m.
    if score > 0.0 { score } else { 0.0 }
}

/// 1 at the light, exactly 0 from the range on, smooth at both: (1 − d⁴/R⁴)².
fn range_window(distance_squared: f32, inverse_range_squared: f32) -> f32 {
    let x = distance_squared * inverse_range_squared;
    let window = (1.0 - x * x).max(0.0);
    window * window
}

/// KHR_lights_punctual's step between outer and inner cone, with versines for its cosines.
fn cone_step(versine: f32, versine_outer: f32, inverse_cone: f32) -> f32 {
    let step = ((versine_outer - versine) * inverse_cone).clamp(0.0, 1.0);
    step * step
}

/// The irradiance (linear RGB, at normal incidence, unshadowed) that the light gives at a point: what the lighting
/// shader computes, attenuation · spot · window times the light's colour.
pub fn irradiance(light: &LightRecord, point: Vec3) -> Vec3 {
    Vec3::from(light.color) * falloff(light, point).0
}

/// Contribution of a light to the ambient cube at an object's centre: the irradiance (luminance), and a vector of that
/// length towards the light.
///
/// A classic spot counts by how far the sphere is in its cone, so that the hard edge does not pass the whole object at
/// once: 0 where it is outside, 1 where it is inside, a smooth step between.
pub(crate) fn at_center(light: &ScoredLight, Sphere { center, radius }: Sphere) -> (f32, Vec3) {
    match light.kind {
        LightRecord::OFF => return (0.0, Vec3::ZERO),
        LightRecord::DIRECTIONAL => return (light.luminance, light.axis * -light.luminance),
        _ => {}
    }
    // In the order of the vector search, as in `score`. One division serves irradiance and direction.
    let v = center - light.position;
    let squared = v.dot(v);
    let distance = squared.sqrt();
    let d = distance.max(MIN_RADIUS);
    let window = range_window(squared, light.inverse_range_squared);
    let [constant, linear, quadratic, least] = light.denominator.to_array();
    let denominator = (constant + distance * (linear + distance * quadratic)).max(least);
    let over_distance = window / (denominator * d);
    let spot = if light.kind == LightRecord::POINT {
        1.0
    } else {
        let along = v.dot(light.axis);
        let off_axis = v - light.axis * along;
        let off = off_axis.dot(off_axis).sqrt();
        if light.kind == LightRecord::SPOT_CONE {
            let step = cone_step(off * off / (d * (d + along)), light.versine_outer, light.inverse_cone);
            if along > 0.0 { step } else { 0.0 }
        } else {
            let cos = along / d;
            let [cos_edge, sin_edge] = light.edge;
            let inside = along * sin_edge - off * cos_edge;
            let part = (0.5 + inside * (0.5 / radius.max(MIN_RADIUS))).clamp(0.0, 1.0);
            power(cos.max(0.0), light.exponent) * (part * part * (3.0 - 2.0 * part))
        }
    };
    let over_distance = over_distance * spot;
    (over_distance * d, v * -over_distance)
}

/// Metres; what smaller objects and distances count as where something is divided by them.
pub(crate) const MIN_RADIUS: f32 = 1e-6;
/// x^e for x in 0..=1 and e ≥ 0 from basic operations only, which round alike everywhere: within 1e-4 from x = 0.08 on,
/// within a hundredth below.
///
/// The whole part of e by squaring; the rest from exp(f · ln x), ln x = 4 ln x^¼ by the series of the inverse
/// hyperbolic tangent, exp by its own and [`SQUARINGS`] squarings.
fn power(x: f32, e: f32) -> f32 {
    let (whole, fraction) = split_exponent(e);
    let (mut result, mut square, mut bits) = (1.0, x, whole);
    while bits > 0 {
        if bits & 1 == 1 {
            result *= square;
        }
        square *= square;
        bits >>= 1;
    }
    if fraction > 0.0 {
        let root = x.sqrt().sqrt();
        let z = (root - 1.0) / (root + 1.0);
        let z2 = z * z;
        let series = 1.0 + z2 * (1.0 / 3.0 + z2 * (1.0 / 5.0 + z2 * (1.0 / 7.0 + z2 * (1.0 / 9.0))));
        let y = fraction * EXPONENT_SCALE * (z * series);
        let mut power = 1.0 + y * (1.0 + y * (0.5 + y * (1.0 / 6.0 + y * (1.0 / 24.0))));
        for _ in 0..SQUARINGS {
            power *= power;
        }
        result *= if x > 0.0 { power } else { 0.0 };
    }
    result
}

/// Squarings of [`power`].
pub(crate) const SQUARINGS: u32 = 4;
/// 8 from the series of ln x, over 2^[`SQUARINGS`].
pub(crate) const EXPONENT_SCALE: f32 = 8.0 / (1 << SQUARINGS) as f32;

/// Whole part and rest of an exponent.
pub(crate) fn split_exponent(e: f32) -> (u32, f32) {
    let whole = e.min(1e6).floor();
    (whole as u32, (e - whole).min(1.0))
}

/// Attenuation · spot · window at a point, and the unit vector towards the light (zero at the light itself).
fn falloff(light: &LightRecord, point: Vec3) -> (f32, Vec3) {
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
    // Half the square of the way between the ends of two unit vectors is 1 − the cosine of their angle, and exact where
    // that is small.
    let versine = if distance > 0.0 { 0.5 * (direction + toward).length_squared() } else { 1.0 };
    let spot = match light.kind {
        LightRecord::POINT => 1.0,
        LightRecord::SPOT_EXPONENT if versine >= light.versine_outer => 0.0,
        LightRecord::SPOT_EXPONENT => (1.0 - versine).max(0.0).powf(light.exponent_or_cone_slope),
        _ => cone_step(versine, light.versine_outer, light.exponent_or_cone_slope),
    };
    (attenuation * window * spot, toward)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn power_is_close_to_the_real_one() {
        for i in 0..=1000 {
            let x = 0.085 + 0.915 * i as f32 / 1000.0;
            for e in [0.0, 0.3, 1.0, 2.0, 8.0, 40.0, 128.0] {
                let truth = f64::from(x).powf(f64::from(e));
                let error = (f64::from(power(x, e)) - truth).abs();
                assert!(error <= 1e-4 * truth + 1e-6, "{x}^{e}: {} for {truth}", power(x, e));
            }
        }
    }
}
