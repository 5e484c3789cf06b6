//! Entities: their places, cameras, and what else is on them. Lights, sensors and vehicles are beside this.

use super::custom::{self, Custom};
use super::lights::Lights;
use super::roads::{SignalHead, Vehicle};
use super::sensors::Mounted;
use super::values::{Scale, place};
use glam::{EulerRot, Quat, Vec3};
use serde::{Deserialize, Deserializer};
use systems::lights::LightDescription;
use systems::{draw, space};

/// One entity, or one kind of entity for a generator. `node` counts only within `attach`.
#[derive(Deserialize, Debug, Default)]
#[serde(default, remote = "Self")]
pub struct Entity {
    pub name: Option<String>,
    pub node: Option<String>,
    pub transform: Transform,
    pub mesh: Option<String>,
    pub material: Option<String>,
    pub piece_metres: Option<f32>,
    pub lights: Option<Lights>,
    pub light: Option<LightDescription>,
    pub camera: Option<Camera>,
    pub sensor: Option<Mounted>,
    pub class: Option<String>,
    pub instance: Option<bool>,
    pub spin: Option<Spin>,
    pub vehicle: Option<Vehicle>,
    pub signal_head: Option<SignalHead>,
    pub ground: bool,
    pub obstacle: Option<Obstacle>,
    pub hidden: bool,
    pub casts_shadows: CastsShadows,
    pub figure: Vec<String>,
    pub rig: Option<String>,
    pub attach: Vec<Entity>,
    pub children: Vec<Entity>,
    #[serde(skip)]
    pub custom: Custom,
}

/// Reads custom fields beside its own, as [`Scene`](super::scene::Scene) does.
impl<'de> Deserialize<'de> for Entity {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let (entity, custom) = custom::beside(deserializer, |deserializer| Self::deserialize(deserializer))?;
        Ok(Self { custom, ..entity })
    }
}

/// So unless a scene says otherwise.
#[derive(Deserialize, Clone, Copy, Debug)]
pub struct CastsShadows(pub bool);

impl Default for CastsShadows {
    fn default() -> Self {
        Self(true)
    }
}

#[derive(Deserialize, Debug, Default)]
#[serde(default, deny_unknown_fields)]
pub struct Transform {
    pub translation: Option<[f64; 3]>,
    pub rotation_degrees: Option<[f32; 3]>,
    pub quaternion: Option<[f32; 4]>,
    pub look_at: Option<[f64; 3]>,
    pub scale: Scale,
}

/// Shape that physical vehicles collide with.
#[derive(Deserialize, Clone, Copy, Debug)]
#[serde(rename_all = "snake_case")]
pub enum Obstacle {
    Box,
    Mesh,
}

/// Perspective with `fov_y_degrees`, or orthographic with `orthographic_half_height`; either may have a shape.
#[derive(Deserialize, Debug)]
#[serde(default, deny_unknown_fields)]
pub struct Camera {
    pub fov_y_degrees: Option<f32>,
    pub aspect: Option<f32>,
    pub orthographic_half_height: Option<f32>,
    pub near: f32,
    pub far: Option<f32>,
}

impl Default for Camera {
    fn default() -> Self {
        let near = draw::Camera::default().near;
        Self { fov_y_degrees: None, aspect: None, orthographic_half_height: None, near, far: None }
    }
}

#[derive(Deserialize, Debug)]
#[serde(default, deny_unknown_fields)]
pub struct Spin {
    pub axis: [f32; 3],
    pub degrees_per_second: f32,
}

impl Default for Spin {
    fn default() -> Self {
        Self { axis: [0.0, 1.0, 0.0], degrees_per_second: 30.0 }
    }
}

/// The transform of a checked scene.
pub fn transform(source: &Transform) -> space::Transform {
    let translation = place(source.translation.unwrap_or_default());
    let unrotated = space::Transform { translation, scale: source.scale.vec3(), ..space::Transform::IDENTITY };
    if let Some([x, y, z]) = source.rotation_degrees.map(|degrees| degrees.map(f32::to_radians)) {
        // Roll about the entity's own Z, then pitch, then yaw: what one expects of a camera.
        unrotated.with_rotation(Quat::from_euler(EulerRot::YXZ, y, x, z))
    } else if let Some(quaternion) = source.quaternion {
        unrotated.with_rotation(Quat::from_array(quaternion).normalize())
    } else if let Some(target) = source.look_at {
        unrotated.looking_at(place(target), Vec3::Y)
    } else {
        unrotated
    }
}

/// A camera as a component.
pub fn camera(source: &Camera) -> draw::Camera {
    let default = draw::Camera::default();
    match (source.orthographic_half_height, source.fov_y_degrees) {
        (Some(half_height), _) => draw::Camera {
            projection: draw::Projection::Orthographic { half_height, aspect: source.aspect },
            near: source.near,
            // A parallel projection has to end somewhere.
            far: source.far.unwrap_or(source.near + 1000.0),
        },
        (None, fov_y) => draw::Camera {
            projection: draw::Projection::Perspective {
                fov_y: fov_y.unwrap_or(45.0).to_radians(),
                aspect: source.aspect,
            },
            near: source.near,
            far: source.far.unwrap_or(default.far),
        },
    }
}
