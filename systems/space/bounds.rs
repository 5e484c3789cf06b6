//! Bounding volumes: boxes and spheres.

use bytemuck::{Pod, Zeroable};
use glam::{Affine3A, Vec3};

/// An axis-aligned box.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Aabb {
    /// Smallest corner.
    pub min: Vec3,
    /// Largest corner.
    pub max: Vec3,
}

impl Aabb {
    /// The smallest box around the points; a point at the origin for none.
    pub fn around(points: &[Vec3]) -> Self {
        let Some(&first) = points.first() else { return Self::default() };
        points.iter().fold(Self { min: first, max: first }, |b, &p| Self { min: b.min.min(p), max: b.max.max(p) })
    }

    /// The smallest box around both.
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Its middle.
    pub fn center(self) -> Vec3 {
        (self.min + self.max) * 0.5
    }

    /// The smallest axis-aligned box around the transformed box.
    pub fn transformed(self, target_from_source: &Affine3A) -> Self {
        let center = target_from_source.transform_point3(self.center());
        let half = (self.max - self.min) * 0.5;
        let m = target_from_source.matrix3;
        let half = Vec3::from(m.x_axis.abs() * half.x + m.y_axis.abs() * half.y + m.z_axis.abs() * half.z);
        Self { min: center - half, max: center + half }
    }
}

/// A sphere: four numbers.
#[derive(Clone, Copy, PartialEq, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct Sphere {
    /// Its centre.
    pub center: Vec3,
    /// Its radius.
    pub radius: f32,
}

impl Sphere {
    /// A sphere around the points: centred on their box, which is at most √3 times the smallest radius.
    pub fn around(points: &[Vec3]) -> Self {
        let center = Aabb::around(points).center();
        let squared = points.iter().map(|p| p.distance_squared(center)).fold(0.0, f32::max);
        Self { center, radius: squared.sqrt() }
    }

    /// A sphere around the transformed sphere, exact for rotation, translation and scale, mirrored or not.
    ///
    /// The radius grows by the largest stretch of the matrix, bounded by Gershgorin's theorem on MᵀM: exact where the
    /// columns are orthogonal, a little too large under shear.
    pub fn transformed(self, target_from_source: &Affine3A) -> Self {
        let m = target_from_source.matrix3;
        let (x, y, z) = (m.x_axis, m.y_axis, m.z_axis);
        let (xy, yz, zx) = (x.dot(y).abs(), y.dot(z).abs(), z.dot(x).abs());
        let rows = [x.dot(x) + xy + zx, y.dot(y) + xy + yz, z.dot(z) + yz + zx];
        let stretch = rows.into_iter().fold(0.0, f32::max).sqrt();
        Self { center: target_from_source.transform_point3(self.center), radius: self.radius * stretch }
    }
}

/// Box around the centres and largest radius; nothing where no sphere is finite.
pub(crate) fn around(spheres: &[Sphere]) -> Option<(Vec3, Vec3, f32)> {
    let finite = spheres.iter().filter(|sphere| sphere.center.is_finite() && sphere.radius.is_finite());
    finite.fold(None, |bounds, sphere| {
        let (min, max, radius) = bounds.unwrap_or((Vec3::MAX, Vec3::MIN, 0.0f32));
        Some((min.min(sphere.center), max.max(sphere.center), radius.max(sphere.radius)))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Quat;

    #[test]
    fn a_transformed_sphere_encloses_every_transformed_point() {
        let points: Vec<Vec3> = (0..200)
            .map(|i| Vec3::new((i as f32 * 0.7).sin() * 3.0, (i as f32 * 1.3).cos(), (i as f32 * 2.1).sin() * 0.5))
            .collect();
        let sphere = Sphere::around(&points);
        let parent = Affine3A::from_scale(Vec3::new(1.0, 5.0, -0.2));
        let child = Affine3A::from_scale_rotation_translation(Vec3::splat(2.0), Quat::from_rotation_z(0.6), Vec3::X);
        let sheared = parent * child;
        let world = sphere.transformed(&sheared);
        for point in points {
            assert!(sheared.transform_point3(point).distance(world.center) <= world.radius * 1.0001);
        }
    }

    #[test]
    fn a_scaled_sphere_is_exact() {
        let unit = Sphere { center: Vec3::X, radius: 1.0 };
        let scaled = unit.transformed(&Affine3A::from_scale(Vec3::new(-1.0, 3.0, 2.0)));
        assert_eq!(scaled, Sphere { center: -Vec3::X, radius: 3.0 });
    }
}
