//! The layers of the shadow maps: what of a light fills one, where in it, and what is drawn there already.
//!
//! A layer is a square of [`SIZE`] texels that one light has at a time. A spot of up to 60° fills it. Another light has
//! six faces of a quarter turn, packed without a gap: the one below the light, which lamps shine at, is two thirds
//! wide, each of the others a third.
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
//!
//! What a face holds depends on its light and on the casters before it, and on no view. It is kept as a list of these;
//! a face is drawn anew where the list that it should have is another one. `shaders/shadows.wgsl` has the twins of the
//! formulas.

use bytemuck::{Pod, Zeroable};
use glam::{Quat, Vec3, Vec4};
use systems::assets::MeshId;
use systems::lights::LightRecord;
use systems::space::Sphere;

/// Texels along a side of a layer; a multiple of 3.
pub(super) const SIZE: u32 = 768;
/// Texels on each side of a face beyond what it shows: filters read no other face.
pub(super) const GUTTER: f32 = 2.0;
/// Most layers: their number, counted from 1, has eight bits in a light's record.
pub(super) const MOST_LAYERS: usize = 240;
/// Versine of the widest spot that is drawn through one perspective projection: 60° from its axis.
const WIDEST_SPOT: f32 = 0.5;

/// What of a light decides what its layer holds.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct LayerLight {
    /// World space.
    position: Vec3,
    /// Metres: where depths are 1.
    near: f32,
    cone: Option<Cone>,
}

/// A spot that fills its layer.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Cone {
    /// Turns the world so that the spot shines along −Z: a quaternion in parts of 32,767.
    turn: [i16; 4],
    /// Texels of a slope of one.
    scale: f32,
}

/// A perspective projection from the light into a part of its layer. Mirrors `ShadowFace` of shaders/shadow_pass.wgsl,
/// which has no use for the last two.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Face {
    /// What goes out from the light, times these, is the clip position: x, y and w.
    right: Vec3,
    up: Vec3,
    toward: Vec3,
    /// The upper left texel, and texels along a side.
    pub corner: [u32; 2],
    pub size: u32,
}

/// As shaders/shadow_pass.wgsl reads a face.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct ShadowFaceRecord {
    /// The light's place, world space.
    pub light: [f32; 3],
    /// Metres.
    pub near: f32,
    /// World space, scaled: what goes out from the light times this is x of the clip position.
    pub right: [f32; 3],
    /// Room for 16-byte alignment.
    pub pad0: u32,
    /// The same for y.
    pub up: [f32; 3],
    /// Room for 16-byte alignment.
    pub pad1: u32,
    /// The same for w: the face's axis, unit.
    pub toward: [f32; 3],
    /// Room for 16-byte alignment.
    pub pad2: u32,
}

/// A caster as it is drawn into a face. Faces of equal casters have equal depths.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct FaceCaster {
    pub mesh: MeshId,
    /// Of detail.
    pub level: u32,
    pub slot: u32,
    /// Columns of its matrix.
    pub place: [Vec3; 4],
    /// Of a mask: its material, and how often materials have changed.
    pub mask: Option<(u32, u64)>,
}

impl LayerLight {
    /// The light of a record; `near` is [`systems::lights::Light::shadow_near`].
    pub fn new(light: &LightRecord, near: f32) -> Self {
        let is_spot = matches!(light.kind, LightRecord::SPOT_CONE | LightRecord::SPOT_EXPONENT);
        let versine = light.versine_outer;
        let cone = (is_spot && versine > 0.0 && versine <= WIDEST_SPOT).then(|| {
            let turn = Quat::from_rotation_arc(Vec3::from(light.direction).normalize_or(Vec3::NEG_Z), Vec3::NEG_Z);
            let tan = (versine * (2.0 - versine)).sqrt() / (1.0 - versine);
            Cone {
                turn: turn.to_array().map(|part| (part * f32::from(i16::MAX)).round() as i16),
                scale: (0.5 * SIZE as f32 - GUTTER) / tan,
            }
        });
        Self { position: light.position.into(), near, cone }
    }

    /// The record that shaders read of the light's layer: quaternion, texels of a slope of one (0 for six faces), and in
    /// one word how much of the shadow is seen, in parts of 65,535, and the upper half of the near distance's bits.
    pub fn record(&self, fade: f32) -> [u32; 4] {
        let turn = self.cone.map_or([0; 4], |cone| cone.turn).map(|part| u32::from(part as u16));
        let scale = self.cone.map_or(0.0, |cone| cone.scale);
        let fade = (fade.clamp(0.0, 1.0) * f32::from(u16::MAX)).round() as u32;
        [turn[0] | turn[1] << 16, turn[2] | turn[3] << 16, scale.to_bits(), self.near().to_bits() | fade]
    }

    /// The near distance as shaders have it.
    fn near(&self) -> f32 {
        f32::from_bits(self.near.to_bits() & !u32::from(u16::MAX))
    }

    /// The faces of its layer.
    pub fn faces(&self) -> Vec<Face> {
        if let Some(cone) = self.cone {
            return vec![cone.face()];
        }
        let third = SIZE / 3;
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

    /// A face as the shader reads it.
    pub fn face_record(&self, face: &Face) -> ShadowFaceRecord {
        ShadowFaceRecord {
            light: self.position.into(),
            near: self.near(),
            right: face.right.into(),
            up: face.up.into(),
            toward: face.toward.into(),
            ..ShadowFaceRecord::default()
        }
    }

    /// Whether some of a sphere, world space, may be in a face.
    pub fn holds(&self, face: &Face, sphere: Sphere) -> bool {
        let v = sphere.center - self.position;
        // Room for rounding, which grows with the distance from the origin.
        let radius = sphere.radius * 1.001 + 1e-6 * (sphere.center.length() + self.position.length());
        let m = face.toward.dot(v);
        let outside = |side: Vec3| {
            let plane = side - face.toward;
            plane.dot(v) > radius * plane.length()
        };
        m + radius >= self.near() && ![face.right, -face.right, face.up, -face.up].into_iter().any(outside)
    }

    /// Metres to the nearest point of a sphere, and texels that a metre covers at a distance of one.
    pub fn detail(&self, face: &Face, sphere: Sphere) -> (f32, f32) {
        let texels = face.right.length() * 0.5 * face.size as f32;
        (sphere.center.distance(self.position) - sphere.radius, texels)
    }
}

impl Cone {
    fn face(&self) -> Face {
        let k = self.scale / (0.5 * SIZE as f32);
        // The shader's formula, which is linear, for each axis: what it holds is drawn by the same numbers.
        let [x, y, z] = Vec3::AXES.map(|axis| self.turned(axis));
        let row = |i: usize| Vec3::new(x[i], y[i], z[i]);
        Face { right: k * row(0), up: -k * row(1), toward: -row(2), corner: [0, 0], size: SIZE }
    }

    fn turned(&self, v: Vec3) -> Vec3 {
        let q = Vec4::from(self.turn.map(|part| f32::from(part) / f32::from(i16::MAX)));
        let t = 2.0 * q.truncate().cross(v);
        v + q.w * t + q.truncate().cross(t)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn light(kind: u32, direction: Vec3) -> LightRecord {
        LightRecord {
            position: [1.0, 4.0, -2.0],
            kind,
            direction: direction.into(),
            versine_outer: 0.25,
            ..LightRecord::default()
        }
    }

    /// Where a face puts what goes out from the light, texels; `None` where it is not before the face.
    fn texel(face: &Face, v: Vec3) -> Option<[f32; 2]> {
        let m = face.toward.dot(v);
        let clip = [face.right.dot(v) / m, face.up.dot(v) / m];
        let inside = m > 0.0 && clip.iter().all(|c| c.abs() <= 1.0);
        let at = |axis: usize, c: f32| face.corner[axis] as f32 + (0.5 + 0.5 * c) * face.size as f32;
        inside.then(|| [at(0, clip[0]), at(1, -clip[1])])
    }

    #[test]
    fn faces_fill_their_layer_and_none_covers_another() {
        let faces = LayerLight::new(&light(LightRecord::POINT, Vec3::ZERO), 0.05).faces();
        let mut covered = vec![0; (SIZE * SIZE) as usize];
        for face in &faces {
            for y in face.corner[1]..face.corner[1] + face.size {
                let row = (y * SIZE + face.corner[0]) as usize;
                covered[row..row + face.size as usize].iter_mut().for_each(|count| *count += 1);
            }
        }
        assert!(covered.iter().all(|&count| count == 1));
    }

    #[test]
    fn every_direction_is_in_a_face_and_whatever_is_seen_there_is_held() {
        let point = LayerLight::new(&light(LightRecord::POINT, Vec3::ZERO), 0.05);
        let spot = LayerLight::new(&light(LightRecord::SPOT_CONE, Vec3::new(0.3, -1.0, 0.2).normalize()), 0.05);
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
            assert!(!in_cone || at.is_some_and(|at| at.iter().all(|c| (1.9..SIZE as f32 - 1.9).contains(c))), "{at:?}");
            assert!(at.is_none() || spot.holds(face, sphere));
        }
        // What is beside a face by more than its radius is not held.
        let below = &point.faces()[0];
        let beside = |x: f32| Sphere { center: point.position + Vec3::new(x, -2.0, 0.0), radius: 0.5 };
        assert!(point.holds(below, beside(2.6)) && !point.holds(below, beside(2.9)));
        assert!(!point.holds(below, Sphere { center: point.position + Vec3::Y, radius: 0.5 }));
    }
}
