//! Entities: their places, cameras, and what else is on them. Lights, sensors and vehicles are beside this.

use super::custom::{self, Custom};
use super::lights::Lights;
use super::roads::{SignalHead, Vehicle};
use super::sensors::Mounted;
use super::values::{PieceMetres, SMALLEST, Scale, place};
use glam::{EulerRot, Quat, Vec3};
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use systems::describe::Described;
use systems::lights::LightDescription;
use systems::space::{FARTHEST, LARGEST};
use systems::{draw, space};

/// One entity, or one kind of entity for a generator.
#[derive(Serialize, Deserialize, JsonSchema, Debug, Default)]
#[serde(default, remote = "Self")]
#[schemars(deny_unknown_fields)]
pub struct Entity {
    /// Name for people; that of a camera selects it on the command line.
    pub name: Option<String>,
    /// Name of the model's node below which it is; required within `attach`, and allowed there only.
    pub node: Option<String>,
    /// Place relative to the parent.
    #[schemars(extend("see" = "[transform](#transform)"))]
    pub transform: Transform,
    /// Name of a mesh.
    pub mesh: Option<String>,
    /// Name of a material; replaces all of a model's own. Without one: neutral grey, or the model's own.
    pub material: Option<String>,
    /// Length beyond which its mesh or model is drawn in [pieces](#large-objects); by default the scene's.
    pub piece_metres: Option<PieceMetres>,
    /// Choice of the lights in reach that shade its mesh or model, and the pieces of these; by default the scene's.
    #[schemars(extend("see" = "[`(policy, tolerance)`](#lights)"))]
    pub lights: Option<Lights>,
    /// Light.
    #[schemars(extend("see" = "[light](#lights)"))]
    pub light: Option<LightDescription>,
    /// Camera.
    #[schemars(extend("see" = "[camera](#camera)"))]
    pub camera: Option<Camera>,
    /// Sensor, captured by `relief render --sensors`.
    #[schemars(extend("see" = "[sensor](sensors.md)"))]
    pub sensor: Option<Mounted>,
    /// Name of its [semantic class](sensors.md#classes), and of those below it; by default that above.
    pub class: Option<String>,
    /// Counts as one thing with all below it; by default vehicles, models at the top level, and takers of rigs do.
    pub instance: Option<bool>,
    /// Even turning.
    #[schemars(extend("see" = "[spin](#spin)"))]
    pub spin: Option<Spin>,
    /// Vehicle of some type, with its model, wheels and lamps.
    #[schemars(extend("see" = "[vehicle](vehicles.md#in-a-scene)"))]
    pub vehicle: Option<Vehicle>,
    /// Traffic light that the lamps of its model show.
    #[schemars(extend("see" = "[signal head](#signal-head)"))]
    pub signal_head: Option<SignalHead>,
    /// Carries vehicles on its mesh, and on those below it.
    pub ground: bool,
    /// Shape that [physical](vehicles.md#physical) vehicles bump into: the box around its mesh, or every triangle.
    pub obstacle: Option<Obstacle>,
    /// Hides it and all below it; lights shine on.
    pub hidden: bool,
    /// Casts shadows by its mesh or model, not by its children. `false`: the glass of a lamp, a dome with a sky.
    pub casts_shadows: CastsShadows,
    /// Names of mesh variants, instead of `mesh`; key F switches to the next. A model among them has exactly one mesh.
    pub figure: Vec<String>,
    /// Path of a [rig](sensors.md#rigs), whose entities are below it, too.
    #[schemars(extend("see" = "path"))]
    pub rig: Option<String>,
    /// Entities at named nodes of its model, each with a `node`.
    #[schemars(extend("see" = "list of entities"))]
    pub attach: Vec<Entity>,
    /// Entities that move with this one.
    #[schemars(extend("see" = "list of entities"))]
    pub children: Vec<Entity>,
    #[serde(skip)]
    pub custom: Custom,
}

impl Described for Entity {}

impl Entity {
    /// Names of the fields that make it a sensor: at most one where it is as it should be.
    pub fn sensors(&self) -> impl Iterator<Item = &'static str> {
        self.sensor.iter().map(|_| "sensor").chain(self.custom.sensors())
    }
}

/// By what serde derives, which is a function of that name.
impl Serialize for Entity {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        Self::serialize(self, serializer)
    }
}

/// Reads custom fields beside its own, as [`Scene`](super::scene::Scene) does.
impl<'de> Deserialize<'de> for Entity {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let (entity, custom) = custom::beside(deserializer, |deserializer| Self::deserialize(deserializer))?;
        Ok(Self { custom, ..entity })
    }
}

/// True unless a scene says otherwise.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Copy, Debug)]
pub struct CastsShadows(pub bool);

impl Default for CastsShadows {
    fn default() -> Self {
        Self(true)
    }
}

/// Place, turn and scale; at most one of the three ways to turn.
#[derive(Serialize, Deserialize, JsonSchema, Debug, Default)]
#[serde(default, deny_unknown_fields)]
pub struct Transform {
    /// Place; by default the parent's, or the scene's `origin`.
    #[schemars(inner(range(min = -FARTHEST, max = FARTHEST)), extend("unit" = "m"))]
    pub translation: Option<[f64; 3]>,
    /// Turns about each axis: first z (roll), then x (pitch), then y (yaw).
    #[schemars(inner(range(min = -1e6, max = 1e6)), extend("unit" = "°"))]
    pub rotation_degrees: Option<[f32; 3]>,
    /// Unit quaternion (x, y, z, w).
    pub quaternion: Option<[f32; 4]>,
    /// Point of the parent's space that −Z turns to, while +Y stays up. Straight down +Y is toward +Z, straight up
    /// toward −Z.
    #[schemars(inner(range(min = -FARTHEST, max = FARTHEST)), extend("unit" = "m"))]
    pub look_at: Option<[f64; 3]>,
    /// Scale; negative mirrors; not 0.
    #[schemars(extend("minimum" = -LARGEST, "maximum" = LARGEST))]
    pub scale: Scale,
}

impl Described for Transform {}

/// Shape that physical vehicles collide with.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Copy, Debug)]
#[serde(rename_all = "snake_case")]
pub enum Obstacle {
    /// The box around the mesh.
    Box,
    /// Every triangle.
    Mesh,
}

/// Perspective with `fov_y_degrees`, or orthographic with `orthographic_half_height`; either may have a shape.
#[derive(Serialize, Deserialize, JsonSchema, Debug)]
#[serde(default, deny_unknown_fields)]
pub struct Camera {
    /// Vertical field of view; by default 45.
    #[schemars(range(min = 0.01, max = 179.0), extend("unit" = "°"))]
    pub fov_y_degrees: Option<f32>,
    /// Width over height, all of which is seen; pictures of other shapes show more beside it. By default the picture's.
    #[schemars(range(min = 0.001, max = 1000.0))]
    pub aspect: Option<f32>,
    /// Half the height of the view in parallel projection, instead of a field of view.
    #[schemars(range(min = SMALLEST, max = LARGEST), extend("unit" = "m"))]
    pub orthographic_half_height: Option<f32>,
    /// Distance within which nothing is seen.
    #[schemars(range(min = SMALLEST, max = LARGEST), extend("unit" = "m"))]
    pub near: f32,
    /// Distance beyond which nothing is seen; orthographic: by default 1000 m beyond `near`.
    #[schemars(range(max = 1e9), extend("unit" = "m"))]
    pub far: Option<f32>,
}

impl Described for Camera {}

impl Default for Camera {
    fn default() -> Self {
        let near = draw::Camera::default().near;
        Self { fov_y_degrees: None, aspect: None, orthographic_half_height: None, near, far: None }
    }
}

/// Even turning about an axis through the entity's origin.
#[derive(Serialize, Deserialize, JsonSchema, Debug)]
#[serde(default, deny_unknown_fields)]
pub struct Spin {
    /// Axis in the parent's space, of any length.
    pub axis: [f32; 3],
    /// Speed, counter-clockwise seen against the axis.
    #[schemars(range(min = -1e6, max = 1e6), extend("unit" = "°/s"))]
    pub degrees_per_second: f32,
}

impl Described for Spin {}

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
