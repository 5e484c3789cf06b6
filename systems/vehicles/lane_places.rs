//! Place of a point in a lane: the foot of the perpendicular on a route's centre line, and the lane beside it.

use super::components::{OnRoute, RouteId};
use super::route_line::angle;
use super::routes::{Route, Routes};
use crate::sensors::lane::LaneReading;
use glam::{DVec2, DVec3, Vec3Swizzles};
use std::f64::consts::FRAC_PI_2;

/// Steps toward the foot; on a circle each leaves a hundredth of what is left, on a line nothing.
const STEPS: usize = 32;
/// Metres along, below which the foot is found.
const NEAR: f64 = 1e-9;

impl Routes {
    /// Finds the lane of a point that looks some way. It is the nearest of the route that it is `on`, or else the
    /// nearest of all routes near by. Their centre lines are within `reach` metres and no more than 3 m higher or
    /// lower. Of these, one that goes its way comes before those that go against it. `None`: there is no lane near.
    ///
    /// Beyond its end a route goes on straight, for what is on it; for others it ends there.
    pub fn lane_at(&self, on: Option<&OnRoute>, point: DVec3, forward: DVec3, reach: f64) -> Option<LaneReading> {
        let is_near = |(_, off): &(LaneReading, f64)| *off <= reach;
        if let Some(on) = on {
            let found = self.read(self.get(on.route)?, on.route, on.at, point, forward).filter(is_near);
            return found.map(|(reading, _)| reading);
        }
        let mut near = Vec::new();
        self.cells().near(self, point, &mut near);
        let found = near.into_iter().filter_map(|(id, sample, _)| {
            let route = self.get(id)?;
            let found = self.read(route, id, route.metres_of(sample as usize), point, forward).filter(is_near);
            found.filter(|(reading, _)| route.closed || (0.0..=route.length).contains(&reading.along))
        });
        let against = |reading: &LaneReading| reading.heading_error.abs() > FRAC_PI_2;
        let found = found.map(|(reading, _)| reading);
        found.min_by(|a, b| against(a).cmp(&against(b)).then(a.offset.abs().total_cmp(&b.offset.abs())))
    }

    /// The place on its route of a vehicle under manual control: at the nearest place of it, where the route would
    /// take it up again, and in the nearest of its lanes, however far away that is.
    pub fn beside_route(&self, on: &OnRoute, point: DVec3, forward: DVec3) -> Option<LaneReading> {
        let route = self.get(on.route)?;
        self.read(route, on.route, route.nearest(point), point, forward).map(|(reading, _)| reading)
    }

    /// The reading on a route, looked for from `at` metres along it; and how far the centre line is, metres.
    fn read(&self, route: &Route, id: RouteId, at: f64, point: DVec3, forward: DVec3) -> Option<(LaneReading, f64)> {
        let at = foot(route, at, point);
        let place = route.place(at);
        let across = place.off(point).1;
        let lanes = (0..route.lanes()).map(|lane| (lane, f64::from(self.offset(route, lane))));
        let (lane, middle) = lanes.min_by(|a, b| (across - a.1).abs().total_cmp(&(across - b.1).abs()))?;
        let heading = DVec2::new(forward.x, forward.z).as_vec2();
        let curvature = f64::from(place.curvature);
        let reading = LaneReading {
            valid: true,
            route: id.0.into(),
            lane: lane.into(),
            offset: across - middle,
            heading_error: angle(place.tangent, heading).into(),
            // A circle of radius R is one of R − d, d to the side of its centre.
            curvature: curvature / (1.0 - curvature * middle).max(1e-3),
            width: route.lane_width().into(),
            along: if route.closed { at.rem_euclid(route.length) } else { at },
            speed: 0.0,
        };
        Some((reading, (point - place.position).xz().length()))
    }
}

/// Metres along a route to where a point is beside it, looked for from `at`.
fn foot(route: &Route, mut at: f64, point: DVec3) -> f64 {
    for _ in 0..STEPS {
        let place = route.place(at);
        let (along, across) = place.off(point);
        let step = along / (1.0 - f64::from(place.curvature) * across).clamp(0.2, 5.0);
        at += step;
        if step.abs() < NEAR {
            break;
        }
    }
    at
}

#[cfg(test)]
mod tests {
    use super::super::routes::RoutePlan;
    use super::*;
    use std::f64::consts::{PI, TAU};

    fn straight(name: &str, from: DVec3, to: DVec3) -> RoutePlan {
        RoutePlan { name: name.into(), points: vec![from, to], ..RoutePlan::default() }
    }

    #[test]
    fn on_a_straight_road_the_offset_is_the_shift() {
        let road = RoutePlan { lanes: 2, lane_width: 3.0, ..straight("road", DVec3::ZERO, DVec3::Z * 100.0) };
        for (left_hand, [right, left]) in [(false, [0, 1]), (true, [1, 0])] {
            let routes = Routes::new(vec![road.clone()], left_hand, 0);
            // +X is left; the middles of the lanes are 1.5 m from that of the road.
            for (shift, lane, offset) in [(-1.5, right, 0.0), (-1.1, right, 0.4), (2.0, left, 0.5), (-4.0, right, -2.5)]
            {
                let forward = DVec3::new(0.3f64.sin(), 0.0, 0.3f64.cos());
                let found = routes.lane_at(None, DVec3::new(shift, 0.2, 40.25), forward, 10.0).expect("a lane");
                let LaneReading { valid, route, lane: found_lane, curvature, width, along, speed, .. } = found;
                assert_eq!((valid, route, found_lane, curvature, width, speed), (true, 0, lane, 0.0, 3.0, 0.0));
                // 64 bits, but for angles.
                assert!((found.offset - offset).abs() < 1e-12 && (along - 40.25).abs() < 1e-9, "{found:?}");
                assert!((found.heading_error - 0.3).abs() < 1e-6, "{found:?}");
            }
        }
    }

    #[test]
    fn on_a_circle_the_curvature_is_that_of_the_lane_s_own() {
        // To the left about the centre: vertices a little less than a metre apart, which become the samples.
        let (radius, count) = (50.0, 315);
        let at = |i: f64| {
            let (sin, cos) = (TAU * i / f64::from(count)).sin_cos();
            DVec3::new(-radius * cos, 0.0, radius * sin)
        };
        let plan = RoutePlan {
            points: (0..count).map(|i| at(f64::from(i))).collect(),
            closed: true,
            lanes: 2,
            lane_width: 4.0,
            // A limit keeps the samples a metre apart.
            limits: vec![(0.0, 10.0)],
            ..RoutePlan::default()
        };
        let routes = Routes::new(vec![plan], false, 0);
        let half = PI / f64::from(count);
        // Directions at three vertices turn by θ each over chords of 2R sin(θ/2).
        let sampled = half / half.sin() / radius;
        for i in [3.0, 17.0, 200.0] {
            // The middle of lane 1, 2 m nearer to the centre than the vertex, and 0.5 m to its right.
            let point = at(i) * (1.0 - 1.5 / radius);
            let tangent = (at(i + 1.0) - at(i - 1.0)).normalize();
            let found = routes.lane_at(None, point, tangent, 10.0).expect("a lane");
            assert_eq!(found.lane, 1);
            // Places in 64 bits, directions in 32: 6e-8 of 50 m, over a metre.
            assert!((found.offset + 0.5).abs() < 1e-5, "{found:?}");
            assert!((found.curvature - sampled / (1.0 - sampled * 2.0)).abs() < 1e-6, "{found:?}");
            assert!((found.curvature * (radius - 2.0) - 1.0).abs() < 1e-4, "1/R: {found:?}");
            assert!(found.heading_error.abs() < 1e-6);
            let chord = 2.0 * radius * half.sin();
            assert!((found.along - i * chord).abs() < 1e-4, "{found:?}");
        }
    }

    #[test]
    fn of_several_routes_the_nearest_that_goes_the_same_way_counts() {
        let north = straight("north", DVec3::ZERO, DVec3::Z * 50.0);
        let south = straight("south", DVec3::new(3.0, 0.0, 50.0), DVec3::X * 3.0);
        let routes = Routes::new(vec![north, south], false, 0);
        let found = |on: Option<&OnRoute>, x: f64, z: f64, forward, reach| {
            routes.lane_at(on, DVec3::new(x, 0.0, z), forward, reach).map(|found| (found.route, found.offset))
        };
        // Nearer to the lane of those that come, but on the way north.
        assert_eq!(found(None, 2.0, 20.0, DVec3::Z, 10.0), Some((0, 2.0)));
        assert_eq!(found(None, 2.0, 20.0, DVec3::NEG_Z, 10.0), Some((1, 1.0)));
        // What is on a route is on none else, beyond its end, too.
        let on = OnRoute::new(RouteId(0), 0, 49.0);
        assert_eq!(found(Some(&on), 2.0, 51.0, DVec3::NEG_Z, 10.0), Some((0, 2.0)));
        // No lane is near: beside, beyond the ends, and above.
        assert_eq!(found(None, 2.0, 20.0, DVec3::Z, 0.5), None);
        assert_eq!(found(None, -12.0, 20.0, DVec3::Z, 10.0), None);
        assert_eq!(found(None, 0.0, 51.0, DVec3::Z, 10.0), None);
        assert_eq!(routes.lane_at(None, DVec3::new(0.0, 5.0, 20.0), DVec3::Z, 10.0), None);
        assert_eq!(Routes::default().lane_at(Some(&on), DVec3::ZERO, DVec3::Z, 10.0), None);
    }
}
