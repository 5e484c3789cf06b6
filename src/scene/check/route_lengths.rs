//! Lengths of routes as they are driven, which places along them are checked by.

use crate::scene::format::roads::{LONGEST, MOST_POINTS, Route, Shape};
use glam::DVec3;
use systems::space::FARTHEST;
use systems::vehicles::route_line;
use systems::vehicles::routes::RoutePlan;

/// The length of a route as it is driven, metres; `None` for one that is refused for its points.
pub fn driven_length(route: &Route) -> Option<f64> {
    let is_far = |x: &f64| !(-FARTHEST..=FARTHEST).contains(x);
    let is_one_place = route.points.iter().all(|point| Some(point) == route.points.first());
    let is_refused = route.points.len() > MOST_POINTS
        || route.points.iter().flatten().any(is_far)
        || is_one_place
        || route.closed && route.points.len() < 3
        || straight_length(route) > LONGEST;
    if is_refused {
        return None;
    }
    let points = route.points.iter().map(|&point| DVec3::from_array(point)).collect();
    let spline = route.shape == Shape::Spline;
    Some(route_line::length(&RoutePlan { points, spline, closed: route.closed, ..RoutePlan::default() }))
}

/// The length of the lines between a route's points, metres.
pub fn straight_length(route: &Route) -> f64 {
    let points = route.points.iter().chain(route.points.first().filter(|_| route.closed));
    let points: Vec<DVec3> = points.map(|&point| DVec3::from_array(point)).collect();
    points.windows(2).map(|pair| pair[0].distance(pair[1])).sum()
}
