//! Planes, convex polygons and convex solids, and their parts on one side of a plane.

use glam::Vec3;

/// A half space: the points p with normal · p ≥ offset.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Plane {
    /// Unit, into the half space.
    pub normal: Vec3,
    /// Metres.
    pub offset: f32,
}

impl Plane {
    /// Metres from the plane to a point, positive within the half space.
    pub fn distance(&self, point: Vec3) -> f32 {
        self.normal.dot(point) - self.offset
    }

    /// Metres from the plane to the point of a box that is farthest within the half space.
    #[inline(always)]
    pub fn farthest(&self, center: Vec3, half: Vec3) -> f32 {
        self.normal.dot(center) - self.offset + self.normal.abs().dot(half)
    }

    /// Metres from the plane to the point of a box that is least within the half space.
    pub fn nearest(&self, center: Vec3, half: Vec3) -> f32 {
        self.normal.dot(center) - self.offset - self.normal.abs().dot(half)
    }

    /// The other half space.
    pub fn flipped(self) -> Self {
        Self { normal: -self.normal, offset: -self.offset }
    }
}

/// 0 at 0 and below, 1 from 1 on, smooth at both.
pub(crate) fn smooth_step(x: f32) -> f32 {
    let t = x.clamp(0.0, 1.0);
    (t * t) * (3.0 - 2.0 * t)
}

/// The part of a convex polygon within a half space (Sutherland, Hodgman: "Reentrant Polygon Clipping", 1974).
pub(crate) fn clip(polygon: &[Vec3], plane: &Plane) -> Vec<Vec3> {
    let mut out = Vec::with_capacity(polygon.len() + 1);
    for (i, &a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let (from, to) = (plane.distance(a), plane.distance(b));
        if from >= 0.0 {
            out.push(a);
        }
        if (from >= 0.0) != (to >= 0.0) {
            out.push(a + (b - a) * (from / (from - to)));
        }
    }
    out
}

/// Twice a polygon's area, along its normal.
pub(crate) fn area_vector(polygon: &[Vec3]) -> Vec3 {
    let Some(&first) = polygon.first() else { return Vec3::ZERO };
    polygon.windows(2).map(|edge| (edge[0] - first).cross(edge[1] - first)).sum()
}

/// The mean of a polygon's corners.
pub(crate) fn middle(polygon: &[Vec3]) -> Vec3 {
    polygon.iter().sum::<Vec3>() / polygon.len().max(1) as f32
}

/// A convex solid by its faces.
#[derive(Clone, Debug)]
pub(crate) struct Solid(Vec<Vec<Vec3>>);

impl Solid {
    /// A box around the origin.
    pub fn new_box(half: Vec3) -> Self {
        let corner = |bits: usize| {
            let sign = |axis: usize| if bits >> axis & 1 == 0 { -1.0 } else { 1.0 };
            half * Vec3::new(sign(0), sign(1), sign(2))
        };
        let faces = [[0, 2, 6, 4], [1, 3, 7, 5], [0, 1, 5, 4], [2, 3, 7, 6], [0, 1, 3, 2], [4, 5, 7, 6]];
        Self(faces.map(|face| face.map(corner).to_vec()).to_vec())
    }

    /// Its part within a half space; `None` where there is none.
    pub fn clip(&self, plane: &Plane) -> Option<Self> {
        let distances = || self.0.iter().flatten().map(|&corner| plane.distance(corner));
        if distances().all(|distance| distance >= 0.0) {
            return Some(self.clone());
        }
        let mut faces: Vec<Vec<Vec3>> = self.0.iter().map(|face| clip(face, plane)).collect();
        faces.retain(|face| face.len() > 2);
        let on_plane = |corner: &Vec3| plane.distance(*corner).abs() < ON_PLANE;
        let mut cap: Vec<Vec3> = faces.iter().flatten().copied().filter(on_plane).collect();
        let (center, across) = (middle(&cap), plane.normal.any_orthonormal_pair());
        cap.sort_by(|a, b| around(*a - center, across).total_cmp(&around(*b - center, across)));
        cap.dedup_by(|a, b| a.distance_squared(*b) < ON_PLANE * ON_PLANE);
        if cap.len() > 2 {
            faces.push(cap);
        }
        (faces.len() > 3).then_some(Self(faces))
    }

    /// Extent of the box around it, metres.
    pub fn extent(&self) -> Vec3 {
        let (min, max) = self.bounds();
        max - min
    }

    fn bounds(&self) -> (Vec3, Vec3) {
        let corners = self.0.iter().flatten().copied();
        corners.fold((Vec3::MAX, Vec3::MIN), |(min, max), p| (min.min(p), max.max(p)))
    }

    /// Metres by which the box around this reaches into a box around the origin, on the axis on which it does least;
    /// negative: metres between them.
    pub fn reaches(&self, half: Vec3) -> f32 {
        let (min, max) = self.bounds();
        (max.min(half) - min.max(-half)).min_element()
    }
}

/// Metres: nearer to a plane than this, a point is on it.
const ON_PLANE: f32 = 1e-5;

/// Grows with the angle of a vector about an axis, from 0 to 4.
fn around(v: Vec3, (x, y): (Vec3, Vec3)) -> f32 {
    let (x, y) = (v.dot(x), v.dot(y));
    let part = y.abs() / (x.abs() + y.abs()).max(f32::MIN_POSITIVE);
    match (x >= 0.0, y >= 0.0) {
        (true, true) => part,
        (false, true) => 2.0 - part,
        (false, false) => 2.0 + part,
        (true, false) => 4.0 - part,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clipped_box_reaches_as_far_as_what_is_left() {
        let plane = |normal: Vec3, offset: f32| Plane { normal: normal.normalize(), offset };
        let solid = Solid::new_box(Vec3::splat(2.0));
        assert_eq!(solid.reaches(Vec3::ONE), 2.0);
        let right = solid.clip(&plane(Vec3::X, 1.5)).unwrap();
        assert_eq!((right.reaches(Vec3::ONE), right.reaches(Vec3::splat(1.75))), (-0.5, 0.25));
        assert!(right.clip(&plane(Vec3::NEG_X, -1.4)).is_none());
        // The corner beyond x + y + z = 5: the least coordinate of its points is 1.
        let corner = solid.clip(&plane(Vec3::ONE, 5.0 / 3f32.sqrt())).unwrap();
        assert!((corner.reaches(Vec3::splat(0.5)) + 0.5).abs() < 1e-5, "{corner:?}");
        // Three cuts, the last through an edge that the first two made.
        let cut = corner.clip(&plane(Vec3::new(1.0, -1.0, 0.0), 0.0)).unwrap();
        let cut = cut.clip(&plane(Vec3::new(1.0, 0.0, -1.0), 0.0)).unwrap();
        // Where x = y = z = 5/3 is a corner of it now.
        let is_corner = |p: &Vec3| p.abs_diff_eq(Vec3::splat(5.0 / 3.0), 1e-4);
        assert!(cut.0.iter().flatten().any(is_corner), "{cut:?}");
    }
}
