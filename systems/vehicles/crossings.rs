//! Where lanes of different routes come into each other's way, worked out once from their centre lines.
//!
//! Lanes whose middles cross have a [`Conflict`]: a stretch of each in which a vehicle would be in the way of one in the
//! other. So have lanes that lead into one, where the place is a crossing, too; where it is not, as on a ramp, vehicles
//! follow each other into the lane ([`super::traffic`]). Conflicts of a lane that are so near to each other that nobody
//! should stand between them make a [`Block`], before whose line vehicles wait ([`super::yielding`]).

use super::route_line::{HEADROOM, crossing};
use super::routes::{Route, RouteId, Routes};
use glam::Vec3;
use std::collections::BTreeMap;

/// Metres between two conflicts in which one may stand.
const STANDING_ROOM: f32 = 15.0;
/// Of half of both lanes' width: middles that are nearer are in each other's way. Neighbouring lanes are not.
const NEAR: f32 = 0.9;
/// Metres that a conflict reaches from the crossing at most, either way; and steps that its end is looked for in.
const REACH: (f32, f32) = (30.0, 1.0);
/// Metres: ends of lanes that are as near are one place.
const JOINED: f32 = 1.0;
/// Metres of the cells that crossings are looked for in. Longer stretches between samples, which only routes of more
/// than a thousand kilometres have, cross nothing.
const CELL: (f32, f32) = (8.0, 32.0);

/// A stretch of a lane, and that of another lane which it is in the way of; metres along their routes.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Conflict {
    pub from: f32,
    pub to: f32,
    /// The other lane, and its stretch.
    pub other: u32,
    pub other_from: f32,
    pub other_to: f32,
    /// The block of the other lane that the stretch is of.
    pub other_block: (f32, f32),
}

/// Conflicts that are passed in one go.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Block {
    /// Where the first begins: one waits before it.
    pub line: f32,
    /// Where the last ends.
    pub end: f32,
    pub conflicts: Box<[Conflict]>,
}

/// A lane that is in the way of others.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct CrossedLane {
    /// Among the lanes of all routes.
    pub lane: u32,
    /// Ascending.
    pub blocks: Box<[Block]>,
}

/// What the crossings of routes come to.
#[derive(Clone, PartialEq, Debug, Default)]
pub(super) struct Crossings {
    /// By lane.
    pub lanes: Vec<CrossedLane>,
    /// Routes whose end is in a conflict with others that lead to the same place.
    pub guarded: Vec<RouteId>,
    /// Routes that begin together with others, and how far along they are still in each other's way.
    pub parting: Vec<(RouteId, f32)>,
}

/// The middle of a lane.
struct Line<'a> {
    lane: u32,
    number: u8,
    id: RouteId,
    route: &'a Route,
    offset: f32,
    /// At the samples of the route.
    points: Vec<Vec3>,
}

impl Line<'_> {
    fn point(&self, at: f32) -> Vec3 {
        self.route.place(at).beside(self.offset)
    }

    fn is_within(&self, at: f32) -> bool {
        self.route.closed || (0.0..=self.route.length).contains(&at)
    }

    /// The place nearest to a point, near another place.
    fn nearest(&self, mut at: f32, point: Vec3) -> f32 {
        for _ in 0..2 {
            let place = self.route.place(at);
            let off = point - place.beside(self.offset);
            at += off.x * place.tangent.x + off.z * place.tangent.y;
            at = if self.route.closed { at } else { at.clamp(0.0, self.route.length) };
        }
        at
    }

    /// From where to where around a place it is in another's way, whose place there is `near`.
    fn stretch(&self, at: f32, other: &Self, near: f32) -> (f32, f32) {
        let reach = NEAR * 0.5 * (self.route.lane_width() + other.route.lane_width());
        let walk = |step: f32| {
            let (mut last, mut near) = (at, near);
            while (last - at).abs() < REACH.0 {
                let next = last + step;
                if !self.is_within(next) {
                    return if step < 0.0 { 0.0 } else { self.route.length };
                }
                let point = self.point(next);
                near = other.nearest(near, point);
                last = next;
                if point.distance(other.point(near)) > reach {
                    break;
                }
            }
            last
        };
        (walk(-REACH.1), walk(REACH.1))
    }

    /// The ends that a stretch contains.
    fn ends(&self, (from, to): (f32, f32)) -> impl Iterator<Item = Vec3> {
        let length = self.route.length;
        let ends = [(from <= 0.0, 0.0), (to >= length, length)];
        let open = !self.route.closed;
        ends.into_iter().filter(move |(is_in, _)| *is_in && open).map(|(_, at)| self.point(at))
    }
}

/// Two lines (numbers in a list, the lower first), and where they meet on each.
type Meeting = (usize, usize, f32, f32);

impl Crossings {
    pub fn new(routes: &Routes) -> Self {
        let lines = lines(routes);
        let mut found: Vec<(usize, Conflict)> = Vec::new();
        let mut note = |(a, b, at_a, at_b): Meeting, (from, to): (f32, f32)| {
            let (other_from, other_to) = lines[b].stretch(at_b, &lines[a], at_a);
            let other_block = (0.0, 0.0);
            let (lane_a, lane_b) = (lines[a].lane, lines[b].lane);
            found.push((a, Conflict { from, to, other: lane_b, other_from, other_to, other_block }));
            let back =
                Conflict { from: other_from, to: other_to, other: lane_a, other_from: from, other_to: to, other_block };
            found.push((b, back));
        };
        let cells = cells(&lines);
        let crossed = distinct(&lines, meetings(&lines, &cells, cross, |_| true));
        // Where ways across a crossing come near each other, as left turns do from opposite sides.
        let mut spots: Vec<Vec<f32>> = vec![Vec::new(); routes.iter().count()];
        for (a, b, at_a, at_b) in &crossed {
            spots[usize::from(lines[*a].id.0)].push(*at_a);
            spots[usize::from(lines[*b].id.0)].push(*at_b);
        }
        let is_crossed: Vec<bool> = spots.iter().map(|spots| !spots.is_empty()).collect();
        let mut touching = meetings(&lines, &cells, touch, |line| is_crossed[usize::from(line.id.0)]);
        let is_there =
            |line: usize, at: f32| spots[usize::from(lines[line].id.0)].iter().any(|spot| (spot - at).abs() < REACH.0);
        touching.retain(|&(a, b, at_a, at_b)| is_there(a, at_a) && is_there(b, at_b));
        let mut known: BTreeMap<(usize, usize), Vec<(f32, f32)>> = BTreeMap::new();
        for meeting in crossed.into_iter().chain(distinct(&lines, touching)) {
            let (a, b, at_a, at_b) = meeting;
            let stretch = lines[a].stretch(at_a, &lines[b], at_b);
            let known = known.entry((a, b)).or_default();
            if !known.iter().any(|(from, to)| (*from..=*to).contains(&at_a)) {
                note(meeting, stretch);
                known.push(stretch);
            }
        }
        let merges = merges(routes, &lines, &is_crossed);
        for meeting in merges.iter().copied().chain(narrowings(routes, &lines)) {
            let (a, b, at_a, at_b) = meeting;
            note(meeting, lines[a].stretch(at_a, &lines[b], at_b));
        }
        let mut guarded: Vec<RouteId> = merges.iter().flat_map(|m| [lines[m.0].id, lines[m.1].id]).collect();
        guarded.sort_unstable();
        guarded.dedup();
        Self { lanes: blocks(routes, &lines, found), guarded, parting: partings(routes, &lines) }
    }
}

fn lines(routes: &Routes) -> Vec<Line<'_>> {
    let of_route = |(id, route): (RouteId, &'_ Route)| (0..route.lanes()).map(move |number| (id, number));
    let line = |(id, number): (RouteId, u8)| {
        let route = routes.get(id)?;
        let offset = routes.offset(route, number);
        let points = (0..route.samples().len()).map(|i| route.place(route.metres_of(i)).beside(offset)).collect();
        Some(Line { lane: routes.lane(route, number), number, id, route, offset, points })
    };
    routes.iter().flat_map(of_route).filter_map(line).collect()
}

/// Stretches between samples, by the cells that they are in or near.
type Cells = Vec<([i32; 2], u32, u32)>;

fn cells(lines: &[Line]) -> Cells {
    let mut cells: Cells = Vec::new();
    for (index, line) in lines.iter().enumerate() {
        let margin = Vec3::splat(NEAR * 0.5 * line.route.lane_width());
        for (segment, ends) in line.points.windows(2).enumerate() {
            let cell = |point: Vec3| [point.x, point.z].map(|v| (v / CELL.0).floor() as i32);
            let (low, high) = (cell(ends[0].min(ends[1]) - margin), cell(ends[0].max(ends[1]) + margin));
            if ends[0].distance(ends[1]) + margin.x < CELL.1 {
                let around = (low[0]..=high[0]).flat_map(|x| (low[1]..=high[1]).map(move |z| [x, z]));
                cells.extend(around.map(|cell| (cell, index as u32, segment as u32)));
            }
        }
    }
    cells.sort_unstable();
    cells
}

/// Where stretches of different routes on one level meet, by lines and along the first. `meet` has the parts of both at
/// which they do.
fn meetings(
    lines: &[Line],
    cells: &Cells,
    meet: impl Fn([Vec3; 2], [Vec3; 2], f32) -> Option<(f32, f32)>,
    matters: impl Fn(&Line) -> bool,
) -> Vec<Meeting> {
    let mut found: Vec<Meeting> = Vec::new();
    for cell in cells.chunk_by(|a, b| a.0 == b.0) {
        for (i, &(_, first, i_segment)) in cell.iter().enumerate().filter(|(_, c)| matters(&lines[c.1 as usize])) {
            let a = &lines[first as usize];
            let others = &cell[i + 1..];
            for &(_, second, j_segment) in &others[others.partition_point(|o| lines[o.1 as usize].id == a.id)..] {
                let b = &lines[second as usize];
                let ends = |line: &Line, segment: u32| [0, 1].map(|i| line.points[segment as usize + i]);
                let (p, q) = (ends(a, i_segment), ends(b, j_segment));
                let reach = NEAR * 0.5 * (a.route.lane_width() + b.route.lane_width());
                if (p[0].y - q[0].y).abs() < HEADROOM
                    && matters(b)
                    && let Some((on_a, on_b)) = meet(p, q, reach)
                {
                    let at = |line: &Line, segment: u32, part: f32| (segment as f32 + part) * line.route.metres_of(1);
                    found.push((first as usize, second as usize, at(a, i_segment, on_a), at(b, j_segment, on_b)));
                }
            }
        }
    }
    found.sort_by(|a, b| (a.0, a.1).cmp(&(b.0, b.1)).then(a.2.total_cmp(&b.2)).then(a.3.total_cmp(&b.3)));
    found.dedup();
    found
}

/// The parts of two stretches at which they cross.
fn cross(p: [Vec3; 2], q: [Vec3; 2], _: f32) -> Option<(f32, f32)> {
    crossing(p[0], p[1], q[0], q[1]).zip(crossing(q[0], q[1], p[0], p[1]))
}

/// The parts of two stretches at which the beginning of one is near the other.
fn touch(p: [Vec3; 2], q: [Vec3; 2], reach: f32) -> Option<(f32, f32)> {
    let part = |point: Vec3, [from, to]: [Vec3; 2]| {
        let along = to - from;
        let part = ((point - from).dot(along) / along.length_squared().max(1e-12)).clamp(0.0, 1.0);
        (from.lerp(to, part).distance_squared(point) < reach * reach).then_some(part)
    };
    part(p[0], q).map(|on_q| (0.0, on_q)).or_else(|| part(q[0], p).map(|on_p| (on_p, 0.0)))
}

/// Meetings that are no part of another, and not where lines lead to, or come from, one place.
fn distinct(lines: &[Line], mut meetings: Vec<Meeting>) -> Vec<Meeting> {
    let mut last = (usize::MAX, usize::MAX, f32::MIN);
    meetings.retain(|&(a, b, at_a, at_b)| {
        if (a, b) == (last.0, last.1) && at_a <= last.2 {
            return false;
        }
        let stretch = lines[a].stretch(at_a, &lines[b], at_b);
        last = (a, b, stretch.1);
        !is_joint(&lines[a], stretch, &lines[b], lines[b].stretch(at_b, &lines[a], at_a))
    });
    meetings
}

/// Whether two lines meet because they lead to, or come from, one place.
fn is_joint(a: &Line, on_a: (f32, f32), b: &Line, on_b: (f32, f32)) -> bool {
    a.ends(on_a).any(|end| b.ends(on_b).any(|other| end.distance(other) < JOINED))
}

/// Lines that lead into one lane, two of each, where any of them is crossed; with their ends.
fn merges(routes: &Routes, lines: &[Line], is_crossed: &[bool]) -> Vec<Meeting> {
    let mut into: Vec<(RouteId, u8, usize)> = Vec::new();
    for (index, line) in lines.iter().enumerate().filter(|(_, line)| !line.route.closed) {
        let lane_of = |next: RouteId| routes.get(next).map(|route| line.number.min(route.lanes() - 1));
        into.extend(line.route.then.iter().filter_map(|&next| Some((next, lane_of(next)?, index))));
    }
    into.sort_unstable();
    into.dedup();
    let mut found = Vec::new();
    for group in into.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        if group.iter().any(|(_, _, line)| is_crossed[usize::from(lines[*line].id.0)]) {
            for (i, &(_, _, a)) in group.iter().enumerate() {
                for &(_, _, b) in &group[i + 1..] {
                    let ends = (lines[a].route.length, lines[b].route.length);
                    if lines[a].id != lines[b].id && lines[a].point(ends.0).distance(lines[b].point(ends.1)) < JOINED {
                        found.push((a, b, ends.0, ends.1));
                    }
                }
            }
        }
    }
    found.sort_by_key(|m| (m.0, m.1));
    found.dedup();
    found
}

/// Lines of different ways that begin at one place, where more lanes than these have lead there: side by side, vehicles
/// would come into each other.
fn narrowings(routes: &Routes, lines: &[Line]) -> Vec<Meeting> {
    let of = |id: RouteId| lines.partition_point(|line| line.id < id)..lines.partition_point(|line| line.id <= id);
    let mut found: Vec<Meeting> = Vec::new();
    for (_, route) in routes.iter().filter(|(_, route)| route.then.len() > 1 && route.lanes() > 1) {
        for a in route.then.iter().flat_map(|&id| of(id)) {
            for b in route.then.iter().filter(|&&id| id > lines[a].id).flat_map(|&id| of(id)) {
                let fewest = lines[a].route.lanes().min(lines[b].route.lanes());
                if fewest < route.lanes() && lines[a].points[0].distance(lines[b].points[0]) < JOINED {
                    found.push((a, b, 0.0, 0.0));
                }
            }
        }
    }
    found.sort_by_key(|m| (m.0, m.1));
    found.dedup();
    found
}

/// How far ways that begin together are in each other's way.
fn partings(routes: &Routes, lines: &[Line]) -> Vec<(RouteId, f32)> {
    let first = |id: RouteId| lines.get(lines.partition_point(|line| line.id < id));
    let mut found: Vec<(RouteId, f32)> = Vec::new();
    for (_, route) in routes.iter().filter(|(_, route)| route.then.len() > 1) {
        for &id in &route.then {
            let others = route.then.iter().filter(|&&other| other != id);
            let far = others.filter_map(|&other| Some(first(id)?.stretch(0.0, first(other)?, 0.0).1));
            found.push((id, far.fold(0.0, f32::max)));
        }
    }
    found
}

/// The conflicts of each line in blocks. Lanes of a route have the same blocks, and ways that begin together the same
/// first line: who waits is not in the way of those behind who might go.
fn blocks(routes: &Routes, lines: &[Line], mut found: Vec<(usize, Conflict)>) -> Vec<CrossedLane> {
    found.sort_by(|(a, x), (b, y)| a.cmp(b).then(x.from.total_cmp(&y.from)).then(x.other.cmp(&y.other)));
    let mut spans: Vec<Vec<(f32, f32)>> = vec![Vec::new(); routes.iter().count()];
    for of_route in found.chunk_by(|a, b| lines[a.0].id == lines[b.0].id) {
        let mut all: Vec<(f32, f32)> = of_route.iter().map(|(_, conflict)| (conflict.from, conflict.to)).collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        let spans = &mut spans[usize::from(lines[of_route[0].0].id.0)];
        for (from, to) in all {
            match spans.last_mut().filter(|span| from - span.1 < STANDING_ROOM) {
                Some(span) => span.1 = span.1.max(to),
                None => spans.push((from, to)),
            }
        }
    }
    for (_, fork) in routes.iter().filter(|(_, route)| route.then.len() > 1) {
        let first = |id: &RouteId| spans[usize::from(id.0)].first().map(|span| span.0).filter(|line| *line < REACH.0);
        let Some(line) = fork.then.iter().filter_map(first).reduce(f32::min) else { continue };
        for id in fork.then.iter().filter(|id| first(id).is_some()).copied().collect::<Vec<_>>() {
            spans[usize::from(id.0)][0].0 = line;
        }
    }
    let around = |line: &Line, from: f32| {
        let spans = &spans[usize::from(line.id.0)];
        spans.iter().rfind(|span| span.0 <= from).copied().unwrap_or((from, from))
    };
    let line_of = |lane: u32| &lines[lines.partition_point(|line| line.lane < lane)];
    for (_, conflict) in &mut found {
        conflict.other_block = around(line_of(conflict.other), conflict.other_from);
    }
    let of_line = |all: &[(usize, Conflict)]| {
        let line = &lines[all[0].0];
        let block = |all: &[(usize, Conflict)]| {
            let (from, end) = around(line, all[0].1.from);
            Block { line: from, end, conflicts: all.iter().map(|(_, conflict)| *conflict).collect() }
        };
        let blocks = all.chunk_by(|a, b| around(line, a.1.from) == around(line, b.1.from)).map(block);
        CrossedLane { lane: line.lane, blocks: blocks.collect() }
    };
    found.chunk_by(|a, b| a.0 == b.0).map(of_line).collect()
}
