//! Directions and positions of the lamps of a type.
//!
//! A lamp shines the way its kind says, unless its node has a light of its own, or its entry a direction. A node that
//! is turned about that way, as the dipped beam of a head lamp is, is followed.

use glam::{Affine3A, Mat3A, Vec3, Vec3A};
use std::collections::HashMap;
use systems::assets::Library;
use systems::lights::{Light, LightKind};
use systems::space::{Sphere, Transform};
use systems::vehicles::lamps::LampKind;
use systems::vehicles::parts::{Part, PartLamp};

/// Metres that a lamp's light is moved ahead of its glass, at most.
const AHEAD: f32 = 1.0;
/// Metres: what is nearer to a light of the model casts no shadow. Bodies are no farther behind their lamps' glass.
const NEAR: f32 = 0.15;
/// Cosine of the angle between a node's way and its kind's, up to which the node is followed: 45°.
const FOLLOWED: f32 = std::f32::consts::FRAC_1_SQRT_2;
/// Cosine of the angle between the way of a lamp and its kind's, below which that is said: just over 90°.
const WRONG: f32 = -0.01;

/// Sources of a lamp's direction beside its kind.
#[derive(Clone, Copy, Default)]
pub struct Aim {
    /// Direction of its entry, vehicle space.
    pub direction: Option<Vec3>,
    /// The node has a light of its own, whose way is the node's.
    pub has_own_light: bool,
    /// The node has no volume, so that nothing points anywhere in it.
    pub is_flat: bool,
}

/// The way of a kind in the vehicle's space; none for a kind that has none.
fn way(kind: LampKind) -> Option<(Vec3, &'static str, &'static str)> {
    match kind {
        LampKind::Head => Some((Vec3::Z, "head", "to the rear")),
        LampKind::Fog => Some((Vec3::Z, "fog", "to the rear")),
        LampKind::Daytime => Some((Vec3::Z, "daytime", "to the rear")),
        LampKind::Tail => Some((Vec3::NEG_Z, "tail", "ahead")),
        LampKind::Brake => Some((Vec3::NEG_Z, "brake", "ahead")),
        LampKind::Reverse => Some((Vec3::NEG_Z, "reverse", "ahead")),
        LampKind::IndicatorLeft => Some((Vec3::X, "left indicator", "to the right")),
        LampKind::IndicatorRight => Some((Vec3::NEG_X, "right indicator", "to the left")),
        LampKind::Interior => None,
    }
}

/// A node's own light, which the type gives shadows or none.
pub fn with_shadows(light: Light, shadows: bool) -> Light {
    Light { shadows, shadow_near: NEAR, ..light }
}

/// Tells if a transform has no volume: a scale of 0, its own or that of something above.
pub fn is_flat(place: &Affine3A) -> bool {
    let Mat3A { x_axis, y_axis, z_axis } = place.matrix3;
    let most = x_axis.length() * y_axis.length() * z_axis.length();
    place.matrix3.determinant().abs() <= 1e-5 * most
}

/// Gives the lights of lamps their way, by parts of their own below the lamps' where that is not the lamp's −Z. Moves
/// spot lights ahead, so that the vehicle's own parts are behind them and not, by their bounding spheres, among what
/// they light: its own lights do nothing for it, and would take the room of others. `aims`: by part. Returns what is
/// probably not meant.
pub fn aim(parts: &mut Vec<Part>, aims: &HashMap<usize, Aim>, library: &Library) -> Vec<String> {
    let mut warnings = Vec::new();
    let mut places: Vec<Affine3A> = Vec::new();
    for part in &*parts {
        let parent = part.parent.and_then(|index| places.get(index).copied()).unwrap_or_default();
        places.push(parent * part.rest.compute_affine());
    }
    let drawn = parts.iter().zip(&places).flat_map(|(part, place)| {
        let proxies = part.proxies.iter().map(|proxy| proxy.mesh);
        part.drawn.map(|(mesh, _)| mesh).into_iter().chain(proxies).map(move |mesh| (mesh, place))
    });
    let spheres: Vec<Sphere> =
        drawn.filter_map(|(mesh, place)| Some(library.mesh(mesh)?.bounds.transformed(place))).collect();
    for (index, place) in places.iter().enumerate() {
        let Some(&aim) = aims.get(&index) else { continue };
        let name = parts[index].name.clone();
        let Some(lamp) = &mut parts[index].lamp else { continue };
        let kind = lamp.kind;
        let is_aimed = |kind| matches!(kind, LightKind::Spot { .. } | LightKind::Directional);
        if !lamp.light.as_ref().is_some_and(|light| is_aimed(light.kind)) {
            if aim.direction.is_some() {
                warnings
                    .push(format!("the direction of lamp {name:?} has no effect: it has no spot or directional light"));
            }
            continue;
        }
        if aim.is_flat {
            lamp.light = None;
            warnings.push(format!("lamp {name:?} has a scale of 0 at its node or above: its light is left out"));
            continue;
        }
        let own = -place.matrix3.z_axis.normalize_or_zero();
        let ahead = match (aim.direction, way(kind)) {
            (Some(direction), _) => Vec3A::from(direction.normalize_or_zero()),
            (None, Some((way, ..))) if !aim.has_own_light && own.dot(way.into()) < FOLLOWED => way.into(),
            _ => own,
        };
        if let Some((way, what, wrong)) = way(kind)
            && ahead.dot(way.into()) < WRONG
        {
            let by = if aim.direction.is_some() { "its direction says" } else { "the light at its node is turned" };
            warnings.push(format!("{what} lamp {name:?} shines {wrong}, as {by}"));
        }
        let is_spot = lamp.light.as_ref().is_some_and(|light| matches!(light.kind, LightKind::Spot { .. }));
        if !is_spot && ahead == own {
            continue;
        }
        let beyond = |sphere: &Sphere| (Vec3A::from(sphere.center) - place.translation).dot(ahead) + sphere.radius;
        let needed = spheres.iter().map(beyond).fold(0.0, f32::max) + 0.01;
        let shift = if is_spot { needed.min(AHEAD) } else { 0.0 };
        let rest = if ahead == own {
            // The part may be scaled.
            Transform::from_xyz(0.0, 0.0, -shift / place.matrix3.z_axis.length().max(1e-6))
        } else {
            let part_from_vehicle = place.inverse();
            let to = |v: Vec3A| Vec3::from(part_from_vehicle.matrix3 * v);
            Transform::from_translation(to(ahead * shift)).looking_to(to(ahead), to(Vec3A::Y))
        };
        let light = lamp.light.take();
        let lamp = Some(PartLamp { kind, light, lit: None });
        parts.push(Part { name, parent: Some(index), rest, lamp, ..Part::default() });
    }
    warnings
}
