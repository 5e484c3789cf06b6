//! The layer of a point light or a spot: where in it a direction is, and what the light reaches.
//!
//! A spot of up to 60° fills its layer. Another light has six faces of a quarter turn, packed without a gap: the one
//! below the light, which lamps shine at, is two thirds wide, each of the others a third.
//!
//! ```text
//! +-----------+-----+
//! |           | +x  |
//! |    −y     +-----+
//! |           | −x  |
//! +-----+-----+-----+
//! | +z  | −z  | +y  |
//! +-----+-----+-----+
//! ```

use super::shadow::Shadow;
use super::shadow_layers::{Face, Turn, fade_bits, filter_of, rounding, upper_half};
use glam::Vec3;
use systems::lights::LightRecord;
use systems::space::Sphere;

/// Texels on each side of a face beyond what it shows: filters read no other face.
pub(crate) const GUTTER: f32 = 2.0;
/// Versine of the widest spot that is drawn through one perspective projection: 60° from its axis.
const WIDEST_SPOT: f32 = 0.5;

/// Parameters of a point light or a spot that decide the content of its layer.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Lamp {
    /// World space.
    pub position: Vec3,
    /// Metres: where depths are 1.
    near: f32,
    /// Metres.
    range: f32,
    /// Metres: the radius of what shines.
    size: f32,
    /// Texels along a side of its layer.
    side: u32,
    /// `None` for a point light.
    cone: Option<Cone>,
}

/// The cone of a spot.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Cone {
    /// The way it shines, unit.
    axis: Vec3,
    /// Cosine and sine of its outer half angle.
    edge: [f32; 2],
    /// Turn, and texels of a slope of one; `None` unless it fills its layer with one projection.
    fills: Option<(Turn, f32)>,
}

impl Lamp {
    /// The light of a record; `near` is [`systems::lights::Light::shadow_near`], `side` that of its layer.
    pub fn new(light: &LightRecord, near: f32, side: u32) -> Self {
        let is_spot = matches!(light.kind, LightRecord::SPOT_CONE | LightRecord::SPOT_EXPONENT);
        let cone = is_spot.then(|| {
            let versine = light.versine_outer;
            let axis = Vec3::from(light.direction).normalize_or(Vec3::NEG_Z);
            let (cos, sin) = (1.0 - versine, (versine * (2.0 - versine)).max(0.0).sqrt());
            let fills = versine > 0.0 && versine <= WIDEST_SPOT;
            let fills = fills.then(|| (Turn::new(axis), upper_half((0.5 * side as f32 - GUTTER) / (sin / cos))));
            Cone { axis, edge: [cos, sin], fills }
        });
        let range = 1.0 / light.inverse_range_squared.sqrt();
        Self { position: light.position.into(), near, range, size: light.size, side, cone }
    }

    /// The record that shaders read of the light's layer: quaternion, and the layer's number in the place of its z; in
    /// one word the size and texels of a slope of one (0 for six faces), and in one how much of the shadow is seen, in
    /// parts of 65,535, and the near distance. Of each of these floats it is the upper half of its bits.
    pub fn record(&self, fade: f32, layer: u32) -> [u32; 4] {
        let ([x, y], scale) = self.fills().map_or(([0; 2], 0.0), |(turn, scale)| (turn.words(), scale));
        [x, y | layer, scale.to_bits() | self.size.to_bits() >> 16, self.near().to_bits() | fade_bits(fade)]
    }

    fn fills(&self) -> Option<(Turn, f32)> {
        self.cone.and_then(|cone| cone.fills)
    }

    /// The near distance as shaders have it.
    pub fn near(&self) -> f32 {
        upper_half(self.near)
    }

    /// Texels around a caster that a look-up may read it from.
    pub fn filter(&self) -> f32 {
        filter_of(self.size)
    }

    /// The faces of its layer.
    pub fn faces(&self) -> Vec<Face> {
        if let Some((turn, scale)) = self.fills() {
            let k = scale / (0.5 * self.side as f32);
            let [x, y, z] = turn.rows();
            return vec![Face { right: k * x, up: -k * y, toward: -z, corner: [0, 0], size: self.side }];
        }
        let third = self.side / 3;
        // By the axis, whether it points down it, and the upper left texel in thirds.
        let small = [(0, 1.0, [2, 0]), (0, -1.0, [2, 1]), (1, 1.0, [2, 2]), (2, 1.0, [0, 2]), (2, -1.0, [1, 2])];
        let faces = small.map(|(axis, sign, thirds)| (axis, sign, thirds.map(|at: u32| at * third), third));
        let faces = [(1, -1.0, [0, 0], 2 * third)].into_iter().chain(faces);
        let face = |(axis, sign, corner, size): (usize, f32, [u32; 2], u32)| {
            let half = 0.5 * size as f32;
            let scale = (half - GUTTER) / half;
            let [right, down] = [[1, 2], [0, 2], [0, 1]][axis].map(|across| scale * Vec3::AXES[across]);
            Face { right, up: -down, toward: sign * Vec3::AXES[axis], corner, size }
        };
        faces.map(face).collect()
    }

    /// Tells if a box, world space, may reach into its range.
    pub fn may_reach(&self, min: Vec3, max: Vec3) -> bool {
        let nearest = self.position.clamp(min, max);
        nearest.distance(self.position) <= self.range * 1.001 + rounding(nearest, self.position)
    }

    /// Tells if a sphere, world space, may reach into its range and its cone.
    pub fn reaches(&self, sphere: Sphere) -> bool {
        let v = sphere.center - self.position;
        let radius = sphere.radius * 1.001 + rounding(sphere.center, self.position);
        v.length() <= self.range * 1.001 + radius
            && self.cone.is_none_or(|Cone { axis, edge: [cos, sin], .. }| {
                // From the cone's surface, or from less than that behind its tip.
                let along = v.dot(axis);
                let across = (v.dot(v) - along * along).max(0.0).sqrt();
                across * cos - along * sin <= radius + 1e-6 * v.length()
            })
    }

    /// Tells if a sphere, world space, may reach into a face.
    pub fn holds(&self, face: &Face, sphere: Sphere) -> bool {
        let v = sphere.center - self.position;
        let radius = sphere.radius * 1.001 + rounding(sphere.center, self.position);
        let m = face.toward.dot(v);
        let outside = |side: Vec3| {
            let plane = side - face.toward;
            plane.dot(v) > radius * plane.length()
        };
        m + radius >= self.near() && ![face.right, -face.right, face.up, -face.up].into_iter().any(outside)
    }

    /// The shadow of a sphere, with room for what filters read; `None` where it is at the light.
    pub fn shadow(&self, sphere: Sphere) -> Option<Shadow> {
        let v = sphere.center - self.position;
        let distance = v.length();
        // Texels of a slope of one in the smaller faces; wherever else there are more.
        let scale = self.side as f32 / 6.0 - GUTTER;
        let room = self.filter() * distance / scale + rounding(sphere.center, self.position);
        let start = Sphere { center: sphere.center, radius: sphere.radius * 1.001 + room };
        let growth = start.radius / distance;
        // What is lit at the cone's edge touches a sphere that is farther away by its angle's cosine.
        let length = (self.range * 1.001 / (1.0 - growth * growth).max(0.0).sqrt() - distance).max(0.0);
        let shadow = Shadow { start, along: v / distance, growth, length };
        (distance > start.radius).then_some(shadow)
    }

    /// Metres to the nearest point of a sphere, and texels that a metre covers at a distance of one.
    pub fn detail(&self, face: &Face, sphere: Sphere) -> (f32, f32) {
        let texels = face.right.length() * 0.5 * face.size as f32;
        (sphere.center.distance(self.position) - sphere.radius, texels)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::renderer::shadows::sides::SIDES;

    fn light(kind: u32, direction: Vec3) -> LightRecord {
        LightRecord {
            position: [1.0, 4.0, -2.0],
            kind,
            direction: direction.into(),
            versine_outer: 0.25,
            ..LightRecord::default()
        }
    }

    /// Projects a vector from the light into a face, texels; `None` outside the face.
    fn texel(face: &Face, v: Vec3) -> Option<[f32; 2]> {
        let m = face.toward.dot(v);
        let clip = [face.right.dot(v) / m, face.up.dot(v) / m];
        let inside = m > 0.0 && clip.iter().all(|c| c.abs() <= 1.0);
        let at = |axis: usize, c: f32| face.corner[axis] as f32 + (0.5 + 0.5 * c) * face.size as f32;
        inside.then(|| [at(0, clip[0]), at(1, -clip[1])])
    }

    #[test]
    fn faces_fill_their_layer_and_none_covers_another() {
        for side in SIDES {
            let faces = Lamp::new(&light(LightRecord::POINT, Vec3::ZERO), 0.05, side).faces();
            let mut covered = vec![0; (side * side) as usize];
            for face in &faces {
                for y in face.corner[1]..face.corner[1] + face.size {
                    let row = (y * side + face.corner[0]) as usize;
                    covered[row..row + face.size as usize].iter_mut().for_each(|count| *count += 1);
                }
            }
            assert!(covered.iter().all(|&count| count == 1), "{side}");
        }
    }

    #[test]
    fn every_direction_is_in_a_face_and_whatever_is_seen_there_is_held() {
        let [_, side, _] = SIDES;
        let point = Lamp::new(&light(LightRecord::POINT, Vec3::ZERO), 0.05, side);
        let spot = Lamp::new(&light(LightRecord::SPOT_CONE, Vec3::new(0.3, -1.0, 0.2).normalize()), 0.05, side);
        for i in 0..2000 {
            let z = 1.0 - 2.0 * (i as f32 + 0.5) / 2000.0;
            let (sin, cos) = (i as f32 * 2.4).sin_cos();
            let v = 3.0 * Vec3::new(cos * (1.0 - z * z).sqrt(), sin * (1.0 - z * z).sqrt(), z);
            let sphere = Sphere { center: point.position + v, radius: 0.0 };
            let faces = point.faces();
            assert!(faces.iter().any(|face| texel(face, v).is_some()), "{v}");
            for face in faces.iter().filter(|face| texel(face, v).is_some()) {
                assert!(point.holds(face, sphere), "{v}");
            }
            let face = &spot.faces()[0];
            let direction = Vec3::new(0.3, -1.0, 0.2).normalize();
            let in_cone = 1.0 - v.normalize().dot(direction) < 0.25;
            let at = texel(face, v);
            // A spot's cone touches the sides of its square, less the gutter.
            assert!(!in_cone || at.is_some_and(|at| at.iter().all(|c| (1.9..side as f32 - 1.9).contains(c))), "{at:?}");
            assert!(at.is_none() || spot.holds(face, sphere));
        }
        // What is beside a face by more than its radius is not held.
        let below = &point.faces()[0];
        let beside = |x: f32| Sphere { center: point.position + Vec3::new(x, -2.0, 0.0), radius: 0.5 };
        assert!(point.holds(below, beside(2.6)) && !point.holds(below, beside(2.9)));
        assert!(!point.holds(below, Sphere { center: point.position + Vec3::Y, radius: 0.5 }));
    }
}
