//! Warnings of a scene's roads that can be driven on nevertheless: lines that do not meet, stray points, and vehicles
//! that stand in each other. Each with its place in the file's coordinates.

use glam::DVec3;
use systems::vehicles::forks::{APART, Gap, Next, gap};
use systems::vehicles::route_line::self_crossing;
use systems::vehicles::routes::{Route, Routes};

/// Largest gap between the ends of lanes that meet, in widths of the wider lane: one may go over into its neighbour.
const MEETS: f64 = 0.65;
/// Metres, and how often as long as the line past it the way over a point is, where that point is hardly meant.
const SPIKE: (f64, f64) = (50.0, 10.0);
/// Metres, and of the lines before and behind it, from where on a line that turns sharply at both ends is hardly meant.
const STRAY: (f64, f64) = (300.0, 30.0);
/// Metres, and of the longest line between two points, from where on the last one of a closed route is hardly meant.
const OPEN: (f64, f64) = (100.0, 4.0);
/// Cosine of 60°.
const SHARP: f64 = 0.5;
/// Degrees: a route that turns off by more where another ends heads back along it.
const BACK: f64 = 100.0;

/// Warnings of routes; `origin`: of the world's coordinates.
pub fn of_routes(routes: &Routes, origin: DVec3) -> Vec<String> {
    let told = Told { origin };
    let mut warnings = Vec::new();
    for (_, route) in routes.iter() {
        warnings.extend(told.crossing(route));
        warnings.extend(told.stray_point(route));
        warnings.extend(told.open_end(route));
        warnings.extend(route.plan.then.iter().filter_map(|&id| {
            let following = routes.get(id).filter(|following| !std::ptr::eq(*following, route))?;
            let gap = gap(routes, route, &Next::new(id, &following.plan));
            told.gap(route, following, &gap).or_else(|| told.heading_back(route, following, &gap))
        }));
    }
    warnings
}

/// Warning that vehicles drive on routes that begin anew. Naming the route itself says that it is meant.
pub fn of_beginning_anew(routes: &Routes, origin: DVec3) -> Option<String> {
    let told = Told { origin };
    let ends = |route: &Route| (route.place(route.length).position, route.place(0.0).position);
    let jumps = |route: &&Route| {
        let (end, beginning) = ends(route);
        !route.closed && route.plan.then.is_empty() && end.distance(beginning) > APART
    };
    let all: Vec<&Route> = routes.iter().map(|(_, route)| route).filter(jumps).collect();
    let metres = |route: &Route| ends(route).0.distance(ends(route).1);
    let farthest = all.iter().copied().max_by(|a, b| metres(a).total_cmp(&metres(b)))?;
    let (end, beginning) = ends(farthest);
    let others = if all.len() > 1 { format!("; the same holds for {} more", all.len() - 1) } else { String::new() };
    Some(format!(
        "routes[{:?}] is open and has no `then`: vehicles that reach its end, {}, are moved to its beginning, {}, \
         {:.1} m away{others}; if this is intended, put its own name in `then`",
        farthest.plan.name,
        told.place(end),
        told.place(beginning),
        metres(farthest),
    ))
}

struct Told {
    origin: DVec3,
}

impl Told {
    fn place(&self, at: DVec3) -> String {
        // No −0.
        let at = at + self.origin + DVec3::ZERO;
        format!("({:.1}, {:.1}, {:.1})", at.x, at.y, at.z)
    }

    fn crossing(&self, route: &Route) -> Option<String> {
        let (name, at) = (&route.plan.name, self.place(self_crossing(route)?));
        Some(format!("routes[{name:?}] crosses itself at {at}: vehicles there do not see each other"))
    }

    fn gap(&self, route: &Route, following: &Route, gap: &Gap) -> Option<String> {
        let lanes = f64::from(route.lane_width().max(following.lane_width()));
        if gap.metres <= MEETS * lanes {
            return None;
        }
        let becomes = match () {
            () if gap.metres <= APART => "vehicles cross the gap off the road",
            () if route.is_dead_end => "vehicles stop at the end",
            () => "no vehicle takes it",
        };
        Some(format!(
            "routes[{:?}] ends at {}, and {:?}, which may follow, begins {:.1} m from there, at {}: {becomes}",
            route.plan.name,
            self.place(gap.end),
            following.plan.name,
            gap.metres,
            self.place(gap.beginning),
        ))
    }

    fn heading_back(&self, route: &Route, following: &Route, gap: &Gap) -> Option<String> {
        let (before, after) = (route.place(route.length).tangent, following.place(0.0).tangent);
        let degrees = f64::from(before.angle_to(after).to_degrees().abs());
        (degrees > BACK).then(|| {
            format!(
                "routes[{:?}] ends at {}, and {:?}, which may follow, turns back there, by {degrees:.0}°: \
                 vehicles leave the road",
                route.plan.name,
                self.place(gap.end),
                following.plan.name,
            )
        })
    }

    /// The first point that is hardly meant: far to the side of its neighbours, or where a long line turns at both
    /// ends.
    fn stray_point(&self, route: &Route) -> Option<String> {
        let (name, points) = (&route.plan.name, &route.plan.points);
        let is_spike = |[a, b, c]: [DVec3; 3]| {
            let (there, back) = (a.distance(b), b.distance(c));
            there.min(back) > SPIKE.0 && there + back > SPIKE.1 * a.distance(c)
        };
        let is_stray = |[a, b, c, d]: [DVec3; 4]| {
            let (before, line, after) = (b - a, c - b, d - c);
            let turns = |from: DVec3, to: DVec3| from.dot(to) < SHARP * from.length() * to.length();
            line.length() > STRAY.0.max(STRAY.1 * before.length().max(after.length()))
                && turns(before, line)
                && turns(line, after)
        };
        let spike = points.array_windows().position(|window| is_spike(*window));
        let stray = || points.array_windows().position(|window| is_stray(*window)).map(|i| i + 1);
        let index = spike.or_else(stray)? + 1;
        let metres = points[index - 1].distance(points[index]);
        let at = self.place(points[index]);
        Some(format!(
            "routes[{name:?}].points[{index}] is {metres:.1} m from the point before it, at {at}, \
             where the route turns back: is this intended?"
        ))
    }

    /// The line that closes a route, where it is much longer than the others.
    fn open_end(&self, route: &Route) -> Option<String> {
        let (plan, points) = (&route.plan, &route.plan.points);
        let longest = points.windows(2).map(|pair| pair[0].distance(pair[1])).fold(0.0, f64::max);
        let (first, last) = points.first().zip(points.last()).filter(|_| plan.closed)?;
        let metres = first.distance(*last);
        (metres > OPEN.0.max(OPEN.1 * longest)).then(|| {
            let line = if plan.spline { "in a curve" } else { "straight" };
            format!(
                "routes[{:?}] is closed, and its last point, {}, is {metres:.1} m from its first, {}: vehicles drive \
                 there {line}",
                plan.name,
                self.place(*last),
                self.place(*first),
            )
        })
    }
}
