//! Height map to horizon maps (Sloan, Cohen: "Interactive Horizon Mapping", Rendering Techniques 2000; Max: "Horizon
//! Mapping", 1988): in eight directions, how high the surface around a texel rises above its horizontal.
//!
//! In direction i, 45°·i from image-right toward image-up, the elevation is
//!
//! ```text
//! max over k ≥ 1 of atan(S · W · (h(x + k·dx, y + k·dy) − h(x, y)) / (k · |(dx, dy)|)), and never below 0
//! ```
//!
//! over a right angle, 0..1; S the height scale, W the width in texels. Lines in these eight directions go from texel
//! centre to texel centre, so nothing is interpolated and every texel of a line counts. On a tile a line goes around
//! until it comes back to itself; else it ends at the edge, and nothing beyond rises.
//!
//! Along a line, the texel that makes the horizon is the next corner of the upper hull of all that lie ahead. Keeping
//! that hull while going along (Andrew's monotone chain) costs about the same per texel however long the line is;
//! looking at every texel ahead would cost its length.

use super::{Advance, Edges, Raster, Relief};
use std::f32::consts::{FRAC_PI_2, SQRT_2};

/// Settings of the search for horizons.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct HorizonOptions {
    /// Meaning of the heights.
    pub relief: Relief,
    /// Only what is at most so many texels away counts; `None`: all of the line.
    pub max_distance: Option<usize>,
}

/// The directions of four families of lines; the other four are the same lines backward. x right, y down.
const STEPS: [(isize, isize); 4] = [(1, 0), (1, -1), (0, -1), (-1, -1)];

/// The two horizon maps (4 channels each) of the first channel of a height map: 0°, 45°, 90°, 135° and 180° to 315°,
/// from image-right toward image-up. `advance` is told the lines finished, and of how many.
pub fn horizon_from_height(heights: &Raster, options: &HorizonOptions, advance: Advance) -> [Raster; 2] {
    let (width, height) = (heights.width, heights.height);
    let mut maps = [Raster::new(width, height, 4), Raster::new(width, height, 4)];
    let families = STEPS.map(|step| Family::new((width, height), step, options.relief.edges));
    let of: usize = families.iter().map(|family| family.starts.len()).sum();
    let scale = options.relief.slope_per_texel(width);
    let mut before = 0;
    for (channel, family) in families.iter().enumerate() {
        let step_length = if channel % 2 == 1 { SQRT_2 } else { 1.0 };
        let is_closed = options.relief.edges == Edges::Wrap;
        let steps = options.max_distance.map_or(usize::MAX, |texels| (texels as f32 / step_length) as usize);
        let elevation = |slope: f32| (slope / step_length).atan() / FRAC_PI_2;
        let fill = |line: usize, row: &mut [f32]| {
            let mut line: Vec<f32> = family.texels(line).map(|(x, y)| scale * heights.values[y * width + x]).collect();
            let forward = steepest_ahead(&line, steps, is_closed);
            line.reverse();
            let backward = steepest_ahead(&line, steps, is_closed);
            for (pair, (f, b)) in row.chunks_exact_mut(2).zip(forward.iter().zip(backward.iter().rev())) {
                pair.copy_from_slice(&[elevation(*f), elevation(*b)]);
            }
        };
        let lines = Raster::from_rows((family.longest, family.starts.len(), 2), fill, &|n| advance(before + n, of));
        before += family.starts.len();
        for (line, row) in lines.values.chunks_exact((family.longest * 2).max(1)).enumerate() {
            for ((x, y), pair) in family.texels(line).zip(row.chunks_exact(2)) {
                let texel = (y * width + x) * 4 + channel;
                maps[0].values[texel] = pair[0];
                maps[1].values[texel] = pair[1];
            }
        }
    }
    maps
}

/// Parallel lines that pass each texel exactly once.
struct Family {
    size: (usize, usize),
    step: (isize, isize),
    starts: Vec<(usize, usize)>,
    /// Texels of the longest line; on a tile all are as long.
    longest: usize,
    edges: Edges,
}

impl Family {
    fn new(size: (usize, usize), step: (isize, isize), edges: Edges) -> Self {
        let (width, height) = size;
        let texels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let (starts, longest): (Vec<_>, usize) = match (edges, step) {
            // Diagonals go around both ways until both counts are done at once.
            (Edges::Wrap, (_, 0)) => ((0..height).map(|y| (0, y)).collect(), width),
            (Edges::Wrap, (0, _)) => ((0..width).map(|x| (x, 0)).collect(), height),
            (Edges::Wrap, _) => {
                let lines = greatest_common_divisor(width, height);
                ((0..lines).map(|x| (x, 0)).collect(), width / lines.max(1) * height)
            }
            (Edges::Clamp, _) => {
                let begins = |(x, y): &(usize, usize)| stepped((*x, *y), (-step.0, -step.1), size).is_none();
                let longest = match step {
                    (_, 0) => width,
                    (0, _) => height,
                    _ => width.min(height),
                };
                (texels.filter(begins).collect(), longest)
            }
        };
        Self { size, step, starts, longest, edges }
    }

    /// The texels of a line, in the direction of its step.
    fn texels(&self, line: usize) -> impl Iterator<Item = (usize, usize)> {
        let next = |&(x, y): &(usize, usize)| match self.edges {
            Edges::Clamp => stepped((x, y), self.step, self.size),
            Edges::Wrap => Some((around(x, self.step.0, self.size.0), around(y, self.step.1, self.size.1))),
        };
        std::iter::successors(Some(self.starts[line]), next).take(self.longest)
    }
}

/// One step further around a side.
fn around(at: usize, step: isize, side: usize) -> usize {
    match at as isize + step {
        -1 => side - 1,
        at if at as usize == side => 0,
        at => at as usize,
    }
}

fn stepped((x, y): (usize, usize), step: (isize, isize), size: (usize, usize)) -> Option<(usize, usize)> {
    let (x, y) = (x.checked_add_signed(step.0)?, y.checked_add_signed(step.1)?);
    (x < size.0 && y < size.1).then_some((x, y))
}

fn greatest_common_divisor(a: usize, b: usize) -> usize {
    if b == 0 { a } else { greatest_common_divisor(b, a % b) }
}

/// For each height of a line, the steepest slope per step to one of the next `steps`; at least 0. The line goes around
/// if `is_closed`.
///
/// It is cut into blocks of that many texels. Ahead of a texel lie the rest of its own block, whose hull grows as the
/// texel goes backward, and the beginning of the next, whose hull grows as it goes forward.
fn steepest_ahead(line: &[f32], steps: usize, is_closed: bool) -> Vec<f32> {
    // Once around is enough: what comes again is farther away.
    let steps = steps.min(line.len());
    let mut slopes = vec![0.0f32; line.len()];
    if steps == 0 {
        return slopes;
    }
    let end = if is_closed { line.len() + steps } else { line.len() };
    let corner = |i: usize| Corner { at: i, height: line[if i < line.len() { i } else { i - line.len() }] };
    let mut hull: Vec<Corner> = Vec::new();
    for start in (0..line.len()).step_by(steps) {
        let next = start + steps;
        hull.clear();
        for i in (start..next.min(end)).rev() {
            let here = corner(i);
            while let [.., second, first] = hull.as_slice()
                && here.slope_to(second) >= here.slope_to(first)
            {
                hull.pop();
            }
            if let (Some(slope), Some(first)) = (slopes.get_mut(i), hull.last()) {
                *slope = here.slope_to(first).max(0.0);
            }
            hull.push(here);
        }
        hull.clear();
        let mut highest = f32::NEG_INFINITY;
        for (i, slope) in slopes.iter_mut().enumerate().take(next).skip(start) {
            let here = corner(i);
            if i + steps < end {
                let last = corner(i + steps);
                highest = highest.max(last.height);
                while let [.., second, first] = hull.as_slice()
                    && second.slope_to(&last) >= second.slope_to(first)
                {
                    hull.pop();
                }
                hull.push(last);
            }
            // Nearly always the own block hides the next.
            if highest - here.height > *slope * (next - i) as f32 {
                // Slopes to the corners of a hull rise, then fall.
                let rising = |pair: &[Corner]| here.slope_to(&pair[1]) > here.slope_to(&pair[0]);
                let top = partition_point(hull.len() - 1, |k| rising(&hull[k..k + 2]));
                *slope = slope.max(here.slope_to(&hull[top]));
            }
        }
    }
    slopes
}

#[derive(Clone, Copy)]
struct Corner {
    at: usize,
    height: f32,
}

impl Corner {
    /// Per step, to one farther along the line.
    fn slope_to(self, other: &Self) -> f32 {
        (other.height - self.height) / (other.at - self.at) as f32
    }
}

/// Number of items in 0..count that satisfy a condition: the first of them do, the others do not.
fn partition_point(count: usize, holds: impl Fn(usize) -> bool) -> usize {
    let (mut low, mut high) = (0, count);
    while low < high {
        let middle = low.midpoint(high);
        if holds(middle) { low = middle + 1 } else { high = middle }
    }
    low
}
