//! Contacts of a vehicle: convex bodies that overlap, by the separating axis test.
//!
//! Two convex bodies are apart where there is an axis along which they are; it is enough to look along the normals of
//! their faces and across pairs of their edges (Gottschalk, Lin, Manocha: "OBBTree: A Hierarchical Structure for Rapid
//! Interference Detection", SIGGRAPH 1996). The axis along which they overlap least says how deep, and the way out.

use crate::describe::check::Described;
use glam::{DAffine3, DVec3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A sensor that says what the thing that it is mounted on touches.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CollisionSensor {
    /// Distance within which something counts as touched. Physical bodies are kept apart and hardly ever overlap.
    #[schemars(range(min = 0.0, max = 10.0), extend("unit" = "m"))]
    pub margin: f32,
}

impl Default for CollisionSensor {
    fn default() -> Self {
        Self { margin: 0.02 }
    }
}

impl Described for CollisionSensor {}
impl Described for Collision {}

/// Contact with the thing that a sensor is mounted on.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize, JsonSchema)]
pub struct Collision {
    /// Number of the other, as sensors' outputs call things.
    #[schemars(extend("unit" = "number of the other"))]
    pub instance: u32,
    /// Its semantic class; 0 for none.
    #[schemars(extend("unit" = "class id of the other"))]
    pub class: u8,
    /// Metres that the two would have to be moved apart to be beside each other; negative where they are apart by it.
    #[schemars(extend("unit" = "metres of overlap; negative: apart"))]
    pub depth: f64,
    /// The way from the other, unit, in the sensor's axes: forward, left, up.
    #[schemars(with = "[f64; 3]", extend("unit" = "unit vector from the other, sensor axes"))]
    pub normal: DVec3,
    /// m/s at which they come nearer along it.
    #[schemars(extend("unit" = "m/s nearer along the normal"))]
    pub speed: f64,
}

/// Contact of two bodies.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Touch {
    /// Metres by which the first would have to move to be beside the other; negative where it is apart by as much.
    pub depth: f64,
    /// The way in which it would: from the other to it, unit.
    pub normal: DVec3,
}

/// A box or a triangle somewhere in the world, metres.
#[derive(Clone, PartialEq, Debug)]
pub struct Convex {
    corners: Vec<DVec3>,
    normals: Vec<DVec3>,
    edges: Vec<DVec3>,
}

impl Convex {
    /// A box from one corner to the other along some axes.
    pub fn of_box(world_from_box: &DAffine3, min: DVec3, max: DVec3) -> Self {
        let corner = |i: usize| {
            let pick = |axis: usize| if i >> axis & 1 == 1 { max[axis] } else { min[axis] };
            world_from_box.transform_point3(DVec3::new(pick(0), pick(1), pick(2)))
        };
        let edges = [0, 1, 2].map(|axis| world_from_box.matrix3.col(axis));
        let normals = [edges[1].cross(edges[2]), edges[2].cross(edges[0]), edges[0].cross(edges[1])];
        Self { corners: (0..8).map(corner).collect(), normals: normals.to_vec(), edges: edges.to_vec() }
    }

    /// A triangle by its corners.
    pub fn of_triangle([a, b, c]: [DVec3; 3]) -> Self {
        let edges = vec![b - a, c - b, a - c];
        Self { corners: vec![a, b, c], normals: vec![edges[0].cross(edges[1])], edges }
    }

    /// The middle of its corners, and how far they are from it at most.
    pub fn sphere(&self) -> (DVec3, f64) {
        let middle = self.corners.iter().sum::<DVec3>() / self.corners.len() as f64;
        (middle, self.corners.iter().map(|corner| corner.distance(middle)).fold(0.0, f64::max))
    }

    /// Finds the contact with another body; `None` where they do not touch. `margin`: metres that it may be away along
    /// every axis of the test.
    pub fn touch(&self, other: &Self, margin: f64) -> Option<Touch> {
        let across = self.edges.iter().flat_map(|own| other.edges.iter().map(|edge| own.cross(*edge)));
        let axes = self.normals.iter().chain(&other.normals).copied().chain(across);
        let mut least: Option<Touch> = None;
        for axis in axes.filter_map(DVec3::try_normalize) {
            let [(low, high), (other_low, other_high)] = [self.along(axis), other.along(axis)];
            let (forward, back) = (other_high - low, high - other_low);
            let touch = if forward <= back {
                Touch { depth: forward, normal: axis }
            } else {
                Touch { depth: back, normal: -axis }
            };
            if touch.depth < -margin {
                return None;
            }
            if least.is_none_or(|least| touch.depth < least.depth) {
                least = Some(touch);
            }
        }
        least
    }

    /// From where to where it reaches along an axis.
    fn along(&self, axis: DVec3) -> (f64, f64) {
        let places = self.corners.iter().map(|corner| corner.dot(axis));
        places.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), at| (low.min(at), high.max(at)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::describe::check::check;
    use glam::DQuat;
    use proptest::prelude::*;
    use std::f64::consts::FRAC_PI_4;

    fn cube_at(place: DVec3, turn: DQuat) -> Convex {
        Convex::of_box(&DAffine3::from_rotation_translation(turn, place), DVec3::NEG_ONE, DVec3::ONE)
    }

    #[test]
    fn boxes_overlap_by_what_they_share() {
        let still = cube_at(DVec3::ZERO, DQuat::IDENTITY);
        let touch = |place: DVec3, turn, margin| cube_at(place, turn).touch(&still, margin);
        let beside = touch(DVec3::new(1.75, 0.5, 0.25), DQuat::IDENTITY, 0.0);
        assert_eq!(beside, Some(Touch { depth: 0.25, normal: DVec3::X }));
        let below = touch(DVec3::new(0.5, -1.5, 0.25), DQuat::IDENTITY, 0.0);
        assert_eq!(below, Some(Touch { depth: 0.5, normal: DVec3::NEG_Y }));
        // Apart by 1/8: only with that much room.
        let apart = |margin| touch(DVec3::new(0.0, 0.0, 2.125), DQuat::IDENTITY, margin);
        assert_eq!((apart(0.12), apart(0.125)), (None, Some(Touch { depth: -0.125, normal: DVec3::Z })));
        // An edge to the face: half a diagonal, √2, and 1.
        let diamond = DQuat::from_rotation_y(FRAC_PI_4);
        let reach = 1.0 + 2f64.sqrt();
        assert!(touch(DVec3::X * (reach + 1e-9), diamond, 0.0).is_none());
        let found = touch(DVec3::X * (reach - 0.1), diamond, 0.0).expect("an overlap");
        assert!((found.depth - 0.1).abs() < 1e-12 && found.normal.abs_diff_eq(DVec3::X, 1e-12), "{found:?}");
        // Edge to edge, crossed: boxes around both overlap, and no face tells that they are apart.
        let [about_x, about_z] = [DQuat::from_rotation_x(FRAC_PI_4), DQuat::from_rotation_z(FRAC_PI_4)];
        let lower = cube_at(DVec3::ZERO, about_x);
        assert!(cube_at(DVec3::Y * 2.9, about_z).touch(&lower, 0.0).is_none());
        let found = cube_at(DVec3::Y * 2.8, about_z).touch(&lower, 0.0).expect("an overlap");
        assert!((found.depth - (2.0 * 2f64.sqrt() - 2.8)).abs() < 1e-12 && found.normal.y > 0.999, "{found:?}");
    }

    #[test]
    fn a_triangle_is_touched_where_its_surface_is() {
        let [a, b, c] = [DVec3::new(4.0, 0.0, 0.0), DVec3::new(0.0, 0.0, 4.0), DVec3::new(4.0, 0.0, 4.0)];
        let triangle = Convex::of_triangle([a, b, c]);
        // In the corner that the triangle leaves out: x + z = 4 is 4/√2 away, a cube's edge √2 nearer.
        let touch = |place| cube_at(place, DQuat::IDENTITY).touch(&triangle, 0.0);
        assert!(touch(DVec3::new(0.9, 0.0, 0.9)).is_none());
        let found = touch(DVec3::new(1.1, 0.0, 1.1)).expect("an overlap");
        assert!((found.depth - 0.2 / 2f64.sqrt()).abs() < 1e-12, "{found:?}");
        assert!(touch(DVec3::new(3.0, 1.01, 3.0)).is_none() && touch(DVec3::new(3.0, -0.99, 3.0)).is_some());
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]
        /// Against what depth and way out mean: moved so far, they are apart, and moved less, they are not.
        #[test]
        fn moved_out_by_its_depth_a_body_is_beside_the_other(
            place in [-2.0f64..2.0, -2.0f64..2.0, -2.0f64..2.0], angles in [-3.0f64..3.0, -1.5f64..1.5, -3.0f64..3.0],
        ) {
            let turn = DQuat::from_euler(glam::EulerRot::YXZ, angles[0], angles[1], angles[2]);
            let (place, still) = (DVec3::from_array(place), cube_at(DVec3::ZERO, DQuat::IDENTITY));
            if let Some(Touch { depth, normal }) = cube_at(place, turn).touch(&still, 0.0) {
                prop_assert!(cube_at(place + normal * (depth + 1e-9), turn).touch(&still, 0.0).is_none());
                prop_assert!(cube_at(place + normal * (depth - 1e-9).max(0.0), turn).touch(&still, 1e-12).is_some());
                let back = still.touch(&cube_at(place, turn), 0.0).expect("an overlap");
                prop_assert!((back.depth - depth).abs() < 1e-12);
            } else {
                // Apart: no corner of one is in the other.
                let inside = |convex: &Convex| {
                    convex.corners.iter().any(|corner| corner.abs().max_element() < 1.0 - 1e-9)
                };
                prop_assert!(!inside(&cube_at(place, turn)));
            }
        }
    }

    #[test]
    fn faults_are_named() {
        let sensor = CollisionSensor { margin: f32::NAN };
        let fault = check(&sensor).expect_err("out of range");
        assert_eq!(fault.to_string(), "margin: expected a number from 0 to 10, found NaN");
    }
}
