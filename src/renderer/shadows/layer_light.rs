//! Lights of the layers of the shadow maps: what one reaches, and where its shadows fall.

use super::lamp_layers::Lamp;
use super::shadow::Shadow;
use super::shadow_layers::{Face, ShadowFaceRecord};
use super::sun_levels::SunLayer;
use glam::Vec3;
use systems::space::Sphere;

/// A light as it decides, with the casters, what a layer holds.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum LayerLight {
    Lamp(Lamp),
    Sun(SunLayer),
}

impl LayerLight {
    /// The faces of its layer.
    pub fn faces(&self) -> Vec<Face> {
        match self {
            Self::Lamp(lamp) => lamp.faces(),
            Self::Sun(level) => vec![level.face()],
        }
    }

    /// A face as the shader reads it.
    pub fn face_record(&self, face: &Face) -> ShadowFaceRecord {
        let (origin, near) = match self {
            Self::Lamp(lamp) => (lamp.position, lamp.near()),
            Self::Sun(level) => (level.origin, 0.0),
        };
        ShadowFaceRecord {
            origin: origin.into(),
            near,
            right: face.right.into(),
            up: face.up.into(),
            toward: face.toward.into(),
            ..ShadowFaceRecord::default()
        }
    }

    /// Tells whether something of a box, world space, may be reached; if not, nor is any sphere in it.
    pub fn may_reach(&self, min: Vec3, max: Vec3) -> bool {
        match self {
            Self::Lamp(lamp) => lamp.may_reach(min, max),
            Self::Sun(level) => level.may_reach(min, max),
        }
    }

    /// Tells whether some of a sphere, world space, may stand in the way to what the layer serves.
    pub fn reaches(&self, sphere: Sphere) -> bool {
        match self {
            Self::Lamp(lamp) => lamp.reaches(sphere),
            Self::Sun(level) => level.reaches(sphere),
        }
    }

    /// Tells whether some of a sphere that is reached may be in a face.
    pub fn holds(&self, face: &Face, sphere: Sphere) -> bool {
        match self {
            Self::Lamp(lamp) => lamp.holds(face, sphere),
            Self::Sun(_) => true,
        }
    }

    /// The shadow that a caster can be seen to cast; `None`: anywhere.
    pub fn shadow(&self, sphere: Sphere) -> Option<Shadow> {
        match self {
            Self::Lamp(lamp) => lamp.shadow(sphere),
            Self::Sun(level) => Some(level.shadow(sphere)),
        }
    }

    /// Tells whether a view, by its eye, may look up here what lies in the shadow of a sphere.
    pub fn serves(&self, eye: Vec3, sphere: Sphere) -> bool {
        match self {
            Self::Lamp(_) => true,
            Self::Sun(level) => level.serves(eye, sphere),
        }
    }

    /// Measures for a caster's level of detail: metres to its nearest point, and texels that a metre covers at a
    /// distance of one.
    pub fn detail(&self, face: &Face, sphere: Sphere) -> (f32, f32) {
        match self {
            Self::Lamp(lamp) => lamp.detail(face, sphere),
            Self::Sun(level) => (1.0, 1.0 / level.texel()),
        }
    }
}
