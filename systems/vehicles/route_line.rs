//! The centre line of a route: from points to samples at even steps of arc length, what these know of bends and limits
//! ahead, where a line crosses itself, and which routes are near a point.

use super::components::RouteId;
use super::routes::{Place, Route, RoutePlan, Routes};
use glam::{DVec2, DVec3, Vec2, Vec3Swizzles};
use std::collections::HashMap;

/// Metres between two samples: the first to begin with, at most the second where bends and limits allow it. A straight
/// line between samples is nowhere farther from the centre line than the third.
const STEP: (f64, f64, f64) = (1.0, 8.0, 0.01);

/// Samples of a route; of longer ones they are farther apart.
const MOST_SAMPLES: usize = 1 << 16;

/// Points per metre that a spline is measured with, and the most of a stretch between two of its points.
const FINE: (f64, usize) = (4.0, 4096);

/// m/s² that drivers brake with toward a lower speed limit.
const BRAKING: f32 = 1.5;

/// Ratio of the braking toward a bend to the sideways acceleration that a driver allows. One that takes bends gently
/// brakes gently too.
const BRAKING_FOR_BENDS: f32 = 0.8;

/// Metres of a route's centre line.
pub fn length(plan: &RoutePlan) -> f64 {
    measured(plan).1
}

/// The centre line from point to point, each with its distance from the beginning; and the length of all of it.
fn measured(plan: &RoutePlan) -> (Vec<(f64, DVec3)>, f64) {
    let mut fine =
        if plan.spline { spline(&distinct(plan), plan.closed) } else { polyline(&distinct(plan), plan.closed) };
    if fine.len() < 2 {
        let start = fine.first().copied().unwrap_or_default();
        fine = vec![start, start + DVec3::Z];
    }
    let mut along = 0.0f64;
    let mut measured = vec![(0.0f64, fine[0])];
    for pair in fine.windows(2) {
        along += pair[0].distance(pair[1]);
        measured.push((along, pair[1]));
    }
    (measured, along)
}

/// The samples of a route and its length.
pub(super) fn sample(plan: &RoutePlan) -> (Vec<Place>, f64) {
    let (measured, along) = measured(plan);
    let close = with_directions(plan, &spaced(&measured, along, STEP.0), along);
    let sharpest = f64::from(close.iter().map(|sample| sample.curvature.abs()).fold(1e-6, f32::max));
    let slopes = measured.windows(2).any(|pair| pair[0].1.y != pair[1].1.y);
    let wide = (8.0 * STEP.2 / sharpest).sqrt();
    if wide < 1.5 * STEP.0 || slopes || !plan.limits.is_empty() {
        return (close, along);
    }
    (with_directions(plan, &spaced(&measured, along, wide.min(STEP.1)), along), along)
}

/// Points that are so far apart, about, on a line of points with their distances from its beginning.
fn spaced(measured: &[(f64, DVec3)], along: f64, step: f64) -> Vec<DVec3> {
    let count = ((along / step).ceil() as usize).clamp(2, MOST_SAMPLES);
    let mut at = 0;
    let point = |i: usize| {
        let target = along * i as f64 / count as f64;
        while at + 2 < measured.len() && measured[at + 1].0 < target {
            at += 1;
        }
        let ((from, a), (to, b)) = (measured[at], measured[at + 1]);
        a.lerp(b, ((target - from) / (to - from).max(1e-12)).clamp(0.0, 1.0))
    };
    (0..=count).map(point).collect()
}

/// Neighbouring points that are the same count once.
fn distinct(plan: &RoutePlan) -> Vec<DVec3> {
    let mut points: Vec<DVec3> = plan.points.iter().copied().filter(|point| point.is_finite()).collect();
    points.dedup_by(|a, b| a.distance(*b) < 1e-3);
    if plan.closed && points.len() > 1 && points[0].distance(points[points.len() - 1]) < 1e-3 {
        points.pop();
    }
    points
}

fn polyline(points: &[DVec3], closed: bool) -> Vec<DVec3> {
    points.iter().copied().chain(points.first().copied().filter(|_| closed)).collect()
}

/// A centripetal Catmull-Rom spline (Barry, Goldman, "A recursive evaluation algorithm for a class of Catmull-Rom
/// splines", SIGGRAPH 1988; Yuksel, Schaefer, Keyser, "Parameterization and applications of Catmull-Rom curves", 2011:
/// the centripetal one has neither cusps nor loops within a stretch).
fn spline(points: &[DVec3], closed: bool) -> Vec<DVec3> {
    let n = points.len();
    if n < 3 {
        return polyline(points, closed);
    }
    let point = |i: isize| {
        let wrapped = points[i.rem_euclid(n as isize) as usize];
        match i {
            _ if closed => wrapped,
            -1 => points[0] * 2.0 - points[1],
            i if i == n as isize => points[n - 1] * 2.0 - points[n - 2],
            _ => wrapped,
        }
    };
    let mut fine = vec![points[0]];
    for i in 0..if closed { n } else { n - 1 } as isize {
        let p = [point(i - 1), point(i), point(i + 1), point(i + 2)];
        let steps = ((p[1].distance(p[2]) * FINE.0).ceil() as usize).clamp(8, FINE.1);
        fine.extend((1..=steps).map(|k| on_spline(&p, k as f64 / steps as f64)));
    }
    fine
}

/// The point `t` of the way from `p[1]` to `p[2]`.
fn on_spline(p: &[DVec3; 4], t: f64) -> DVec3 {
    let knot = |a: DVec3, b: DVec3| a.distance(b).sqrt().max(1e-4);
    let t1 = knot(p[0], p[1]);
    let t2 = t1 + knot(p[1], p[2]);
    let t3 = t2 + knot(p[2], p[3]);
    let t = t1 + (t2 - t1) * t;
    let mix = |a: DVec3, b: DVec3, from: f64, to: f64| a * ((to - t) / (to - from)) + b * ((t - from) / (to - from));
    let (a1, a2, a3) = (mix(p[0], p[1], 0.0, t1), mix(p[1], p[2], t1, t2), mix(p[2], p[3], t2, t3));
    mix(mix(a1, a2, 0.0, t2), mix(a2, a3, t1, t3), t1, t2)
}

fn with_directions(plan: &RoutePlan, positions: &[DVec3], length: f64) -> Vec<Place> {
    let (last, step) = (positions.len() - 1, length / (positions.len() - 1) as f64);
    let flat = |i: usize| positions[i].xz();
    // Of a closed route the first sample is the last, too.
    let before = |i: usize| {
        if i > 0 {
            i - 1
        } else if plan.closed {
            last - 1
        } else {
            0
        }
    };
    let after = |i: usize| {
        if i < last {
            i + 1
        } else if plan.closed {
            1
        } else {
            last
        }
    };
    let tangent = |i: usize| (flat(after(i)) - flat(before(i))).normalize_or(DVec2::Y).as_vec2();
    let limit = |at: f64| {
        let stretch = plan.limits.iter().rev().find(|(from, _)| f64::from(*from) <= at);
        stretch.map_or(plan.speed_limit, |(_, limit)| *limit)
    };
    let sample = |i: usize| {
        let turned = angle(tangent(before(i)), tangent(after(i)));
        let apart = if before(i) == i || after(i) == i { step } else { 2.0 * step };
        let curvature = turned / apart as f32;
        let bend = 1.0 / curvature.abs().max(1e-9);
        Place { position: positions[i], tangent: tangent(i), curvature, limit: limit(i as f64 * step), bend }
    };
    (0..=last).map(sample).collect()
}

/// From one direction to another, radians, left positive.
pub(super) fn angle(from: Vec2, to: Vec2) -> f32 {
    (from.y * to.x - from.x * to.y).atan2(from.dot(to))
}

/// Heading at the end against that at the beginning, with whole turns counted.
pub(super) fn turn(samples: &[Place]) -> f32 {
    samples.windows(2).map(|pair| angle(pair[0].tangent, pair[1].tangent)).sum()
}

/// Lowers limits and bends so that one may brake in time for those ahead; `after`: those at the end.
pub(super) fn brake_ahead(samples: &mut [Place], step: f32, after: (f32, f32)) {
    let (mut limit_squared, mut bend) = (after.0 * after.0, after.1);
    for sample in samples.iter_mut().rev() {
        limit_squared = (sample.limit * sample.limit).min(limit_squared);
        bend = sample.bend.min(bend);
        (sample.limit, sample.bend) = (limit_squared.sqrt(), bend);
        limit_squared += 2.0 * BRAKING * step;
        bend += 2.0 * BRAKING_FOR_BENDS * step;
    }
}

/// Metres of height that two stretches of a route are apart at least where one is a bridge over the other.
const HEADROOM: f64 = 3.0;

/// Place at which the centre line crosses itself in one level, if it does.
pub fn self_crossing(route: &Route) -> Option<DVec3> {
    let samples = route.samples();
    let count = samples.len() - 1;
    let mut cells: HashMap<[i32; 2], Vec<usize>> = HashMap::new();
    let longest = samples.windows(2).map(|p| p[0].position.distance(p[1].position)).fold(1.0, f64::max);
    for i in 0..count {
        let (a, b) = (samples[i].position, samples[i + 1].position);
        let middle = (a + b) * 0.5 / (2.0 * longest);
        let cell = [middle.x.floor() as i32, middle.z.floor() as i32];
        for near in around(cell).filter_map(|cell| cells.get(&cell)).flatten().copied() {
            let is_next = i - near < 2 || (route.closed && near + count - i < 2);
            let (c, d) = (samples[near].position, samples[near + 1].position);
            if !is_next
                && (a.y - c.y).abs() < HEADROOM
                && let Some(part) = crossing(a, b, c, d)
            {
                // No −0.
                return Some(a.lerp(b, part) + DVec3::ZERO);
            }
        }
        cells.entry(cell).or_default().push(i);
    }
    None
}

fn around([x, z]: [i32; 2]) -> impl Iterator<Item = [i32; 2]> {
    (-1..=1).flat_map(move |i| (-1..=1).map(move |j| [x.saturating_add(i), z.saturating_add(j)]))
}

/// Place on a–b, 0..1, at which c–d crosses it, seen from above.
fn crossing(a: DVec3, b: DVec3, c: DVec3, d: DVec3) -> Option<f64> {
    let side = |a: DVec3, b: DVec3, p: DVec3| (b.x - a.x) * (p.z - a.z) - (b.z - a.z) * (p.x - a.x);
    // A point on the other line counts to one side, so that lines that cross at their points do cross.
    let apart = |p: f64, q: f64| (p > 0.0) != (q > 0.0);
    let (before, behind) = (side(c, d, a), side(c, d, b));
    (apart(side(a, b, c), side(a, b, d)) && apart(before, behind)).then(|| before / (before - behind))
}

/// Metres.
const CELL: f64 = 16.0;

/// Routes through the cells of a grid, and their samples there.
#[derive(Clone, PartialEq, Debug, Default)]
pub(super) struct Cells(HashMap<[i32; 2], Vec<(RouteId, u32)>>);

impl Cells {
    pub fn new(routes: &[Route]) -> Self {
        let mut cells: HashMap<[i32; 2], Vec<(RouteId, u32)>> = HashMap::new();
        for (id, route) in routes.iter().enumerate() {
            for (index, sample) in route.samples().iter().enumerate() {
                cells.entry(cell(sample.position)).or_default().push((RouteId(id as u16), index as u32));
            }
        }
        Self(cells)
    }

    /// The nearest sample of each route that has some within a cell's length; by route.
    pub fn near(&self, routes: &Routes, point: DVec3, found: &mut Vec<(RouteId, u32, f64)>) {
        found.clear();
        for &(id, index) in around(cell(point)).filter_map(|cell| self.0.get(&cell)).flatten() {
            let Some(sample) = routes.get(id).and_then(|route| route.samples().get(index as usize)) else {
                continue;
            };
            let off = sample.position - point;
            if off.y.abs() < HEADROOM {
                found.push((id, index, off.x * off.x + off.z * off.z));
            }
        }
        found.sort_by(|a, b| a.0.cmp(&b.0).then(a.2.total_cmp(&b.2)).then(a.1.cmp(&b.1)));
        found.dedup_by_key(|found| found.0);
    }
}

fn cell(point: DVec3) -> [i32; 2] {
    [(point.x / CELL).floor() as i32, (point.z / CELL).floor() as i32]
}
