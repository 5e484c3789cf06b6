//! Place of an entity: [`Transform`] among its siblings, [`GlobalTransform`] in the world.
//!
//! Both follow `bevy_transform`'s components of these names, with two differences that matter to systems of a frame.
//! Each column has a summary tick: a table in which nothing moved is passed over in one comparison, whatever its size.
//! And a place in the world takes 48 bytes, not 64. `propagation.rs` derives the one from the other.

use bevy_ecs::prelude::*;
use glam::{Affine3, Affine3A, Mat3, Mat4, Quat, Vec3};
use serde::{Deserialize, Serialize};
use std::ops::Mul;

/// Metres from the origin of the scene's coordinates along an axis: as far as scenes, inputs and calls put things.
pub const FARTHEST: f64 = 1e7;
/// Factors of scale, as large as scenes, inputs and calls have them.
pub const LARGEST: f64 = 1e6;

/// Place, direction and size of an entity in the coordinates of its parent; in the world's for one that has none. A
/// point p of the entity is at translation + rotation · (scale · p).
///
/// An entity looks along its −Z, with Y up and X to the right.
#[derive(Component, Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[component(summary_tick)]
#[require(GlobalTransform)]
pub struct Transform {
    /// Metres.
    pub translation: Vec3,
    /// Unit quaternion.
    pub rotation: Quat,
    /// Along the entity's own axes; negative ones mirror.
    pub scale: Vec3,
}

impl Default for Transform {
    fn default() -> Self {
        Self::IDENTITY
    }
}

impl Transform {
    /// At the origin, looking along −Z, of its own size.
    pub const IDENTITY: Self = Self { translation: Vec3::ZERO, rotation: Quat::IDENTITY, scale: Vec3::ONE };

    /// At a place, in metres.
    pub const fn from_xyz(x: f32, y: f32, z: f32) -> Self {
        Self::from_translation(Vec3::new(x, y, z))
    }

    /// At a place, in metres.
    pub const fn from_translation(translation: Vec3) -> Self {
        Self { translation, ..Self::IDENTITY }
    }

    /// Turned about the origin.
    pub const fn from_rotation(rotation: Quat) -> Self {
        Self { rotation, ..Self::IDENTITY }
    }

    /// Scaled about the origin.
    pub const fn from_scale(scale: Vec3) -> Self {
        Self { scale, ..Self::IDENTITY }
    }

    /// The same elsewhere.
    #[must_use]
    pub const fn with_translation(self, translation: Vec3) -> Self {
        Self { translation, ..self }
    }

    /// The same turned otherwise.
    #[must_use]
    pub const fn with_rotation(self, rotation: Quat) -> Self {
        Self { rotation, ..self }
    }

    /// The same in another size.
    #[must_use]
    pub const fn with_scale(self, scale: Vec3) -> Self {
        Self { scale, ..self }
    }

    /// The same, looking at a point of the parent's coordinates; see [`Self::looking_to`].
    #[must_use]
    pub fn looking_at(self, target: Vec3, up: Vec3) -> Self {
        self.looking_to(target - self.translation, up)
    }

    /// The same, looking along a direction of the parent's coordinates, with `up` as near to its own Y as can be. A
    /// direction without length, or with an infinite one, counts as −Z and such an `up` as Y. Where the two are
    /// parallel, it looks as if the direction were a little toward +Z: straight down with +Z above, straight up with
    /// −Z above. Where `up` is +Z or −Z itself, any Y at a right angle is taken.
    #[must_use]
    pub fn looking_to(self, direction: Vec3, up: Vec3) -> Self {
        let back = -unit(direction).unwrap_or(Vec3::NEG_Z);
        let up = unit(up).unwrap_or(Vec3::Y);
        let right = up.cross(back).try_normalize().or_else(|| Vec3::Z.cross(up).try_normalize());
        let right = right.unwrap_or_else(|| up.any_orthonormal_vector());
        let own_up = back.cross(right);
        self.with_rotation(Quat::from_mat3(&Mat3::from_cols(right, own_up, back)))
    }

    /// Turns it further, about its place and the parent's axes.
    pub fn rotate(&mut self, rotation: Quat) {
        self.rotation = rotation * self.rotation;
    }

    /// Affine map of points from the entity's coordinates to its parent's.
    #[inline(always)]
    pub fn compute_affine(&self) -> Affine3A {
        Affine3A::from_scale_rotation_translation(self.scale, self.rotation, self.translation)
    }

    /// Homogeneous matrix from the entity's coordinates to its parent's.
    pub fn to_matrix(&self) -> Mat4 {
        Mat4::from_scale_rotation_translation(self.scale, self.rotation, self.translation)
    }

    /// Maps a point from the entity's coordinates to its parent's.
    pub fn transform_point(&self, point: Vec3) -> Vec3 {
        self.rotation * (self.scale * point) + self.translation
    }

    /// Transform of a child of this one, in the coordinates of this one's parent. It leaves out the shear that a turned
    /// child has in a parent of uneven scale.
    #[must_use]
    pub fn mul_transform(&self, child: Self) -> Self {
        Self {
            translation: self.transform_point(child.translation),
            rotation: self.rotation * child.rotation,
            scale: self.scale * child.scale,
        }
    }

    /// Direction in which it looks; a unit vector, like those of the other sides.
    pub fn forward(&self) -> Vec3 {
        -self.back()
    }

    /// Its own Z.
    pub fn back(&self) -> Vec3 {
        self.rotation * Vec3::Z
    }

    /// Its own X.
    pub fn right(&self) -> Vec3 {
        self.rotation * Vec3::X
    }

    /// Its own −X.
    pub fn left(&self) -> Vec3 {
        -self.right()
    }

    /// Its own Y.
    pub fn up(&self) -> Vec3 {
        self.rotation * Vec3::Y
    }

    /// Its own −Y.
    pub fn down(&self) -> Vec3 {
        -self.up()
    }

    /// Tells if all of it is finite and within the bounds of scenes and calls. Places of the world count from an origin
    /// that may be [`FARTHEST`] away itself.
    pub fn is_valid(&self) -> bool {
        let is_near = self.translation.as_dvec3().abs().max_element() <= 2.0 * FARTHEST;
        self.is_finite() && is_near && self.scale.as_dvec3().abs().max_element() <= LARGEST
    }

    /// Tells if all of it is finite.
    pub fn is_finite(&self) -> bool {
        self.translation.is_finite() && self.rotation.is_finite() && self.scale.is_finite()
    }
}

/// [`Transform::mul_transform`].
impl Mul for Transform {
    type Output = Self;

    fn mul(self, child: Self) -> Self {
        self.mul_transform(child)
    }
}

/// Normalizes a vector; `None` without a direction.
fn unit(vector: Vec3) -> Option<Vec3> {
    let length = vector.length();
    (length.is_finite() && length > 0.0).then(|| vector / length)
}

/// From an entity's coordinates to the world's. Derived in each frame from its [`Transform`] and those above; what is
/// written here by others is lost when they next change.
#[derive(Component, Clone, Copy, PartialEq, Debug)]
#[component(summary_tick)]
pub struct GlobalTransform(Affine3);

impl Default for GlobalTransform {
    fn default() -> Self {
        Self::IDENTITY
    }
}

impl GlobalTransform {
    /// The world's own coordinates.
    pub const IDENTITY: Self = Self(Affine3::IDENTITY);

    /// Affine map of points from the entity's coordinates to the world's.
    #[inline(always)]
    pub fn affine(&self) -> Affine3A {
        self.0.into()
    }

    /// Homogeneous matrix from the entity's coordinates to the world's.
    pub fn to_matrix(&self) -> Mat4 {
        self.affine().into()
    }

    /// The entity's place, in metres.
    pub fn translation(&self) -> Vec3 {
        self.0.translation
    }

    /// Its parts; of shear, what they can show.
    pub fn to_scale_rotation_translation(&self) -> (Vec3, Quat, Vec3) {
        self.affine().to_scale_rotation_translation()
    }

    /// Its parts, as the transform of an entity without parent; of shear, what they can show.
    pub fn compute_transform(&self) -> Transform {
        let (scale, rotation, translation) = self.to_scale_rotation_translation();
        Transform { translation, rotation, scale }
    }

    /// Maps a point from the entity's coordinates to the world's.
    pub fn transform_point(&self, point: Vec3) -> Vec3 {
        self.affine().transform_point3(point)
    }

    /// Global transform of a child of this one.
    #[must_use]
    #[inline(always)]
    pub fn mul_transform(&self, child: Transform) -> Self {
        (self.affine() * child.compute_affine()).into()
    }

    /// Direction in which the entity looks, along its −Z; a unit vector, like those of the other sides.
    pub fn forward(&self) -> Vec3 {
        -self.back()
    }

    /// Its own Z.
    pub fn back(&self) -> Vec3 {
        (self.affine().matrix3 * Vec3::Z).normalize()
    }

    /// Its own X.
    pub fn right(&self) -> Vec3 {
        (self.affine().matrix3 * Vec3::X).normalize()
    }

    /// Its own Y.
    pub fn up(&self) -> Vec3 {
        (self.affine().matrix3 * Vec3::Y).normalize()
    }
}

impl From<Affine3A> for GlobalTransform {
    #[inline(always)]
    fn from(world_from_local: Affine3A) -> Self {
        Self(world_from_local.into())
    }
}

impl From<Transform> for GlobalTransform {
    #[inline(always)]
    fn from(transform: Transform) -> Self {
        transform.compute_affine().into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_looks_somewhere_has_its_forward_there_and_its_up_as_near_as_can_be() {
        let from = Transform::from_xyz(1.0, 2.0, 3.0).with_scale(Vec3::splat(2.0));
        let looking = from.looking_at(Vec3::new(1.0, 2.0, -5.0), Vec3::new(0.0, 3.0, 1.0));
        assert_eq!((looking.translation, looking.scale), (from.translation, from.scale));
        assert!(looking.forward().abs_diff_eq(Vec3::NEG_Z, 1e-6) && looking.up().abs_diff_eq(Vec3::Y, 1e-6));
        let right = from.looking_to(Vec3::X, Vec3::Y);
        assert!(right.forward().abs_diff_eq(Vec3::X, 1e-6) && right.right().abs_diff_eq(Vec3::Z, 1e-6));
        // Nothing to go by: as it stands, or any that is at a right angle.
        assert_eq!(from.looking_to(Vec3::ZERO, Vec3::NAN), from);
        let above = from.looking_to(Vec3::NEG_Z, Vec3::Z);
        assert!(above.forward().abs_diff_eq(Vec3::NEG_Z, 1e-6) && above.rotation.is_normalized());
    }

    #[test]
    fn what_looks_straight_up_or_down_does_so_as_if_a_little_toward_z() {
        let looking = |direction| Transform::IDENTITY.looking_to(direction, Vec3::Y);
        for (y, up) in [(-1.0, Vec3::Z), (1.0, Vec3::NEG_Z)] {
            let upright = looking(Vec3::new(0.0, y, 0.0));
            assert!(upright.forward().abs_diff_eq(Vec3::Y * y, 1e-6) && upright.up().abs_diff_eq(up, 1e-6));
            // Turned by the angle whose tangent is 1e-4, the rest is rounding.
            let leaning = looking(Vec3::new(0.0, y, 1e-4));
            assert!(leaning.up().abs_diff_eq(up, 1.1e-4) && leaning.right().abs_diff_eq(upright.right(), 1e-6));
        }
    }

    #[test]
    fn products_map_points_as_one_after_the_other_does() {
        let turned = |angle: f32| Transform::from_rotation(Quat::from_rotation_y(angle));
        let parent = turned(0.5).with_translation(Vec3::new(3.0, -1.0, 2.0)).with_scale(Vec3::splat(1.5));
        let child = turned(-2.0).with_translation(Vec3::new(0.0, 4.0, 1.0)).with_scale(Vec3::new(1.0, -2.0, 3.0));
        let point = Vec3::new(0.3, 0.7, -0.2);
        let expected = parent.transform_point(child.transform_point(point));
        let global = GlobalTransform::from(parent).mul_transform(child);
        for found in [(parent * child).transform_point(point), global.transform_point(point)] {
            assert!(found.abs_diff_eq(expected, 1e-5), "{found} {expected}");
        }
        assert!(global.affine().abs_diff_eq((parent * child).compute_affine(), 1e-5));
        assert!(GlobalTransform::from(parent).compute_transform().to_matrix().abs_diff_eq(parent.to_matrix(), 1e-5));
    }

    #[test]
    fn a_still_table_is_passed_over_and_a_place_takes_48_bytes() {
        assert_eq!(size_of::<GlobalTransform>(), 48);
        let mut world = World::new();
        for id in [world.register_component::<Transform>(), world.register_component::<GlobalTransform>()] {
            assert!(world.components().get_info(id).is_some_and(|info| info.summary_tick()));
        }
    }
}
