//! Measures wheels: where the hub is, and how far a wheel reaches from its axle.
//!
//! A wheel is looked at along its axle, the vehicle's X. The outline of what is drawn there (its convex hull) is a
//! circle, but for what sticks out; the circle's middle is the hub, and its outermost corner stands on the road.
//! Nothing depends on how the node is turned about its axle, or where its origin is.

use glam::{DVec2, Vec3};

/// Corners of an outline may be off its circle by this part of the radius.
const ROUND: f64 = 0.02;
/// A circle has at least so many corners: fewer are a box.
const LEAST_CORNERS: usize = 6;
/// The widest gap between two corners of a circle, radians.
const WIDEST_GAP: f64 = std::f64::consts::TAU / 3.0;
/// Divisor of the remaining corners removed per pass, so that the time does not grow with the square of their number.
/// Up to twice as many corners go one by one.
const AT_A_TIME: usize = 64;
/// Largest reach of a wheel with something on it, in radii; beyond, it is something with a wheel on it.
const MOSTLY_WHEEL: f32 = 1.5;
/// Height over length of what may be a wheel that is not round.
const SQUARE: f32 = 1.5;

/// Outline of what is drawn at a wheel's node and below, along the vehicle's X.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Shape {
    /// Nothing.
    Nothing,
    /// A wheel; metres.
    Round {
        /// The middle of the wheel, vehicle space.
        hub: Vec3,
        /// Half of its width.
        half_width: f32,
        /// Distance of the circle's outermost corner from the axle.
        radius: f32,
        /// Distance from the axle to the farthest corner that sticks out of the circle; the radius where none does.
        reach: f32,
    },
    /// Not round, but about as high as it is long.
    Uneven {
        /// The middle of the box around it, vehicle space.
        middle: Vec3,
        /// Half its height.
        half_height: f32,
        /// From its middle to the nearest and the farthest of its outline.
        reach: [f32; 2],
    },
    /// Something else than a wheel, as high and as long as this.
    Other([f32; 2]),
}

/// The shape of drawn parts: vertices of each, vehicle space.
pub fn measure(parts: &[Vec<Vec3>]) -> Shape {
    let whole = parts.concat();
    let outline = outline(&whole);
    if outline.is_empty() {
        return Shape::Nothing;
    }
    let around_all = circle(&outline).map(|circle| (circle, &whole));
    let each = || parts.iter().filter_map(|part| Some((circle(&self::outline(part))?, part)));
    let larger = |a: (Circle, _), b: (Circle, _)| if b.0.radius > a.0.radius { b } else { a };
    let (low, high) = bounds(&outline);
    let size = (high - low).as_vec2();
    if let Some((circle, points)) = around_all.or_else(|| each().reduce(larger)) {
        let reach = outline.iter().map(|p| p.distance(circle.center)).fold(circle.radius, f64::max);
        let (radius, reach) = (circle.radius as f32, reach as f32);
        if reach > MOSTLY_WHEEL * radius {
            return Shape::Other(size.into());
        }
        let (left, right) = width(points);
        let hub = Vec3::new((left + right) / 2.0, circle.center.x as f32, circle.center.y as f32);
        let reach = if reach > radius * (1.0 + ROUND as f32) { reach } else { radius };
        return Shape::Round { hub, half_width: (right - left) / 2.0, radius, reach };
    }
    if size.max_element() > SQUARE * size.min_element() {
        return Shape::Other(size.into());
    }
    let middle = (low + high) / 2.0;
    let nearest = edges(&outline).map(|(a, b)| distance(middle, a, b)).fold(f64::MAX, f64::min);
    let farthest = outline.iter().map(|p| p.distance(middle)).fold(0.0, f64::max);
    let (left, right) = width(&whole);
    let middle = Vec3::new((left + right) / 2.0, middle.x as f32, middle.y as f32);
    Shape::Uneven { middle, half_height: size.x / 2.0, reach: [nearest as f32, farthest as f32] }
}

/// Along X: y and z.
#[derive(Clone, Copy, Debug)]
struct Circle {
    center: DVec2,
    radius: f64,
}

/// The circle that most corners of an outline lie on; none where it is not round. Up to a third of the corners may
/// stick out: the farthest from the circle are left out, one by one; of many corners, several at a time.
fn circle(outline: &[DVec2]) -> Option<Circle> {
    let mut kept = outline.to_vec();
    let least = LEAST_CORNERS.max(outline.len() * 2 / 3);
    while kept.len() >= least {
        let center = center(&kept)?;
        let distances = || kept.iter().map(|p| p.distance(center));
        let mean = distances().sum::<f64>() / kept.len() as f64;
        let off = |distance: f64| (distance - mean).abs();
        let (worst, error) = distances().map(off).enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
        if error <= ROUND * mean {
            let gap = edges(&kept).map(|(a, b)| (a - center).angle_to(b - center).abs()).fold(0.0, f64::max);
            let radius = distances().fold(0.0, f64::max);
            return (radius > 0.0 && gap <= WIDEST_GAP).then_some(Circle { center, radius });
        }
        // Not past the least that a circle may have: each count below is looked at.
        let mut count = (kept.len() / AT_A_TIME).min(kept.len() - least);
        if count < 2 {
            kept.remove(worst);
            continue;
        }
        let mut errors: Vec<f64> = distances().map(off).collect();
        let first = kept.len() - count;
        let bound = *errors.select_nth_unstable_by(first, f64::total_cmp).1;
        kept.retain(|p| {
            let goes = count > 0 && off(p.distance(center)) >= bound;
            count -= usize::from(goes);
            !goes
        });
    }
    None
}

/// The middle of the circle that is nearest to points, by least squares of (p − c)² − r², which is linear in c and r² −
/// c² (Kåsa: "A circle fitting procedure and its error analysis", IEEE Transactions on Instrumentation and Measurement,
/// 1976).
fn center(points: &[DVec2]) -> Option<DVec2> {
    let middle = points.iter().sum::<DVec2>() / points.len() as f64;
    let (mut xx, mut xy, mut yy, mut right) = (0.0, 0.0, 0.0, DVec2::ZERO);
    for p in points.iter().map(|p| *p - middle) {
        (xx, xy, yy) = (xx + p.x * p.x, xy + p.x * p.y, yy + p.y * p.y);
        right += p * p.length_squared() / 2.0;
    }
    let determinant = xx * yy - xy * xy;
    let c = DVec2::new(yy * right.x - xy * right.y, xx * right.y - xy * right.x) / determinant;
    // Points in a line have no circle.
    (determinant > 1e-9 * (xx + yy).powi(2)).then_some(middle + c)
}

/// The convex hull of points seen along X, counter-clockwise (Andrew: "Another efficient algorithm for convex hulls in
/// two dimensions", Information Processing Letters, 1979); fewer than three where they have no extent.
fn outline(points: &[Vec3]) -> Vec<DVec2> {
    let mut sorted: Vec<DVec2> =
        points.iter().filter(|p| p.is_finite()).map(|p| DVec2::new(p.y.into(), p.z.into())).collect();
    sorted.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    sorted.dedup();
    if sorted.len() < 3 {
        return sorted;
    }
    let mut hull: Vec<DVec2> = Vec::new();
    let half = |points: &mut dyn Iterator<Item = DVec2>, hull: &mut Vec<DVec2>| {
        let first = hull.len();
        for p in points {
            while hull.len() >= first + 2 {
                let [a, b] = [hull[hull.len() - 2], hull[hull.len() - 1]];
                if (b - a).perp_dot(p - a) > 0.0 {
                    break;
                }
                hull.pop();
            }
            hull.push(p);
        }
        hull.pop();
    };
    half(&mut sorted.iter().copied(), &mut hull);
    half(&mut sorted.iter().rev().copied(), &mut hull);
    hull
}

/// The least and the greatest x.
fn width(points: &[Vec3]) -> (f32, f32) {
    points.iter().fold((f32::MAX, f32::MIN), |(low, high), p| (low.min(p.x), high.max(p.x)))
}

fn bounds(points: &[DVec2]) -> (DVec2, DVec2) {
    points.iter().fold((DVec2::MAX, DVec2::MIN), |(low, high), &p| (low.min(p), high.max(p)))
}

/// Each corner of an outline and the next.
fn edges(outline: &[DVec2]) -> impl Iterator<Item = (DVec2, DVec2)> {
    outline.iter().copied().zip(outline.iter().copied().cycle().skip(1))
}

/// From a point to a line segment.
fn distance(p: DVec2, a: DVec2, b: DVec2) -> f64 {
    let along = b - a;
    let t = ((p - a).dot(along) / along.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    p.distance(a + along * t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;
    use std::f32::consts::TAU;

    /// A disc about X in a number of corners.
    fn disc(hub: Vec3, radius: f32, corners: u32, turn: f32) -> Vec<Vec3> {
        let corner = |i: u32| {
            let (sin, cos) = (turn + TAU * i as f32 / corners as f32).sin_cos();
            [-0.1, 0.1].map(|x| hub + Vec3::new(x, radius * cos, radius * sin))
        };
        (0..corners).flat_map(corner).collect()
    }

    fn cuboid(middle: Vec3, half: Vec3) -> Vec<Vec3> {
        let sign = |i: u32, bit: u32| if i >> bit & 1 == 0 { -1.0 } else { 1.0 };
        (0..8).map(|i| middle + half * Vec3::new(sign(i, 0), sign(i, 1), sign(i, 2))).collect()
    }

    #[test]
    fn a_disc_has_its_hub_and_radius_however_it_is_turned() {
        let at = Vec3::new(0.7, 0.4, -1.3);
        for corners in [6, 7, 12, 48, 301] {
            for turn in [0.0, 0.1, 0.26, std::f32::consts::FRAC_PI_4] {
                let Shape::Round { hub, radius, reach, .. } = measure(&[disc(at, 0.35, corners, turn)]) else {
                    panic!("{corners} corners are round")
                };
                assert!(hub.distance(at) < 1e-5 && (radius - 0.35).abs() < 1e-5 && reach == radius, "{corners}: {hub}");
            }
        }
    }

    #[test]
    fn what_is_on_a_wheel_changes_neither_hub_nor_radius() {
        let at = Vec3::new(0.7, 0.4, 0.0);
        let tyre = disc(at, 0.35, 48, 0.05);
        let rim = disc(at, 0.2, 20, 0.0);
        // A caliper within the tyre, one that sticks out, and one in the tyre's own mesh.
        let (inside, outside) =
            (cuboid(at + Vec3::Y * 0.2, Vec3::splat(0.05)), cuboid(at + Vec3::Z * 0.4, Vec3::splat(0.05)));
        let merged = [tyre.clone(), outside.clone()].concat();
        for (parts, sticks_out) in
            [(vec![rim.clone(), tyre.clone(), inside], false), (vec![tyre, outside, rim], true), (vec![merged], true)]
        {
            let Shape::Round { hub, radius, reach, .. } = measure(&parts) else { panic!("round") };
            assert!(hub.with_x(at.x).distance(at) < 1e-3 && (radius - 0.35).abs() < 1e-3, "{hub} {radius}");
            assert_eq!(reach > 0.44, sticks_out);
        }
    }

    /// [`circle`] by its definition: one by one.
    fn circle_one_by_one(outline: &[DVec2]) -> Option<Circle> {
        let mut kept = outline.to_vec();
        while kept.len() >= LEAST_CORNERS.max(outline.len() * 2 / 3) {
            let center = center(&kept)?;
            let distances: Vec<f64> = kept.iter().map(|p| p.distance(center)).collect();
            let mean = distances.iter().sum::<f64>() / kept.len() as f64;
            let errors = distances.iter().map(|distance| (distance - mean).abs()).enumerate();
            let (worst, error) = errors.max_by(|a, b| a.1.total_cmp(&b.1))?;
            if error <= ROUND * mean {
                let gap = edges(&kept).map(|(a, b)| (a - center).angle_to(b - center).abs()).fold(0.0, f64::max);
                let radius = distances.into_iter().fold(0.0, f64::max);
                return (gap <= WIDEST_GAP).then_some(Circle { center, radius });
            }
            kept.remove(worst);
        }
        None
    }

    proptest! {
        #![proptest_config(ProptestConfig {
            cases: 64,
            failure_persistence: None,
            rng_seed: RngSeed::Fixed(0),
            ..ProptestConfig::default()
        })]

        #[test]
        fn several_corners_at_a_time_leave_the_circle_that_one_by_one_leaves(
            corners in 6usize..3000, part in 0.0f64..0.33, bump in 0.05f64..0.4, turn in 0.0f64..6.0,
            spread: bool,
        ) {
            // A wheel of radius 1 with a bump over a part of its corners.
            let out = (corners as f64 * part) as usize;
            let corner = |i: usize| {
                let sticks_out = if spread { i * out % corners < out } else { i < out };
                let radius = if sticks_out { 1.0 + bump } else { 1.0 };
                DVec2::from_angle(turn + std::f64::consts::TAU * i as f64 / corners as f64) * radius
            };
            let outline: Vec<DVec2> = (0..corners).map(corner).collect();
            let (found, plain) = (circle(&outline), circle_one_by_one(&outline));
            // One in 2,000 of these: with a bump over a sixth of the circle, corners across from it go as well. One by
            // one leaves a gap that is too wide then, where several at a time do not.
            prop_assert!(found.is_some() || plain.is_none());
            let Some((found, plain)) = found.zip(plain) else { return Ok(()) };
            // What is kept is on either circle to `ROUND`, and few go one by one.
            let most = if corners < 2 * AT_A_TIME { 0.0 } else { ROUND };
            prop_assert!(found.center.distance(plain.center) <= most, "{:?} {:?}", found, plain);
            prop_assert!((found.radius - plain.radius).abs() <= most, "{:?} {:?}", found, plain);
        }
    }

    #[test]
    fn what_is_no_wheel_is_said_to_be_none() {
        assert_eq!(measure(&[]), Shape::Nothing);
        let body = cuboid(Vec3::new(0.0, 1.0, 1.0), Vec3::new(0.9, 0.5, 2.0));
        assert_eq!(measure(std::slice::from_ref(&body)), Shape::Other([1.0, 4.0]));
        // Four wheels in one mesh; a body with a wheel.
        let four: Vec<Vec3> = [0.0, 2.5].iter().flat_map(|&z| disc(Vec3::Z * z, 0.3, 24, 0.0)).collect();
        assert!(matches!(measure(&[four]), Shape::Other([h, l]) if (h - 0.6).abs() < 1e-3 && (l - 3.1).abs() < 1e-3));
        assert!(matches!(measure(&[body, disc(Vec3::ZERO, 0.3, 24, 0.0)]), Shape::Other(_)));
        let square = measure(&[cuboid(Vec3::Y, Vec3::splat(0.5))]);
        let Shape::Uneven { half_height, reach: [near, far], .. } = square else { panic!("{square:?}") };
        assert!(half_height == 0.5 && (near - 0.5).abs() < 1e-6 && (far - 0.5f32.hypot(0.5)).abs() < 1e-6);
        let oval = disc(Vec3::ZERO, 1.0, 48, 0.0).into_iter().map(|p| p * Vec3::new(1.0, 1.0, 0.8)).collect();
        let oval = measure(&[oval]);
        assert!(matches!(oval, Shape::Uneven { half_height: 1.0, reach: [near, _], .. } if near < 0.81), "{oval:?}");
    }
}
