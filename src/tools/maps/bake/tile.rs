//! Maps that tile, of a patch seen straight from above.
//!
//! The patch repeats with a period along X and Z. Rays go down −Y in the square of one period; what hangs over its
//! border comes in again on the other side. A ray that meets a copy of the patch is the same as one, moved by whole
//! periods the other way, that meets the patch itself: so there is one BVH, and each ray is cast once for every copy
//! whose box it crosses.
//!
//! u runs along +X and v along +Z, as on the plane of [`systems::assets::shapes`]: T = +X, B = −Z, N = +Y.

use super::occlusion::Sky;
use super::options::BakeOptions;
use super::report::Baked;
use super::target::{Sides, Target};
use super::texels::{Outcome, Sample, cast, check_options, finish};
use crate::tools::maps::MapError;
use glam::{Vec2, Vec3, Vec3Swizzles};
use std::ops::RangeInclusive;
use systems::space::Aabb;

/// Largest width of a patch, in periods: each asks for as many rays again.
const MOST_PERIODS: f32 = 8.0;
/// Distance up to which geometry shades, in periods.
const SHADING_PERIODS: f32 = 4.0;

/// Settings of [`bake_tile`].
#[derive(Clone, PartialEq, Debug, Default)]
pub struct TileOptions {
    /// Settings of a bake, except the reach: rays start above everything and go through to the bottom.
    pub bake: BakeOptions,
    /// Metres after which the patch repeats; `None`: the longer side of its box.
    pub period: Option<f32>,
}

/// Bakes a patch that repeats, seen from above. `progress(done, of)` is called now and then, from any thread.
///
/// # Errors
/// Nothing is met, or an option makes no sense.
pub fn bake_tile(
    target: &Target,
    options: &TileOptions,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Baked, MapError> {
    // There is no chart whose border could be kept: all holes are filled.
    let bake = BakeOptions { dilate: None, ..options.bake.clone() };
    check_options(&bake)?;
    let patch = Patch::new(target, options.period)?;
    let sky = Sky::new(bake.rays, bake.occlusion_distance.min(SHADING_PERIODS * patch.period));
    let size = Vec2::new(bake.size.0 as f32, bake.size.1 as f32);
    let sample = |x: usize, y: usize, rays: &mut u64| {
        let at = patch.corner + (Vec2::new(x as f32, y as f32) + 0.5) / size * patch.period;
        let Some((place, normal, face)) = patch.seen_at(at, rays) else { return Outcome::Missed };
        let mut occlusion = 1.0;
        if bake.wanted.occlusion {
            let from = place + face * target.step_off();
            let is_open = |direction| patch.is_open(from, direction, sky.distance());
            occlusion = sky.open_share_by(face, (x, y), is_open);
            *rays += sky.rays() as u64;
        }
        let normal = Vec3::new(normal.x, -normal.z, normal.y);
        Outcome::Baked(Sample { normal, height: place.y, occlusion })
    };
    let mut baked = cast(&bake, sample, progress);
    baked.report.triangles = target.surface.triangles.len();
    // As wide as an image of square texels that covers as much.
    let width = patch.period * (size.x / size.y).sqrt();
    baked.report.metres_per_width = (width, width, width);
    if baked.report.baked == 0 {
        let message = "nothing is visible from above: expected faces that point up (+Y)";
        return Err(MapError::refused(&target.surface.source, message));
    }
    let range = baked.report.heights_met;
    finish(&mut baked, &bake, range);
    Ok(baked)
}

struct Patch<'a> {
    target: &'a Target<'a>,
    aabb: Aabb,
    period: f32,
    /// Least X and Z of the square that is baked.
    corner: Vec2,
}

impl<'a> Patch<'a> {
    fn new(target: &'a Target<'a>, period: Option<f32>) -> Result<Self, MapError> {
        let aabb = target.surface.aabb();
        let extent = (aabb.max - aabb.min).xz();
        let period = period.unwrap_or(extent.max_element());
        if !(period > 0.0 && period.is_finite()) {
            return Err(MapError::option("period", format!("expected metres above 0, found {period}")));
        }
        if extent.max_element() > MOST_PERIODS * period {
            let message = format!(
                "{period} m is too short for a patch of {} m by {} m: expected at least an eighth of that",
                extent.x, extent.y
            );
            return Err(MapError::option("period", message));
        }
        let corner = aabb.center().xz() - period * 0.5;
        Ok(Self { target, aabb, period, corner })
    }

    /// The highest place over (x, z) that faces up, the normal there and that of its face.
    fn seen_at(&self, at: Vec2, rays: &mut u64) -> Option<(Vec3, Vec3, Vec3)> {
        let margin = self.period;
        let (from, distance) = (self.aabb.max.y + margin, self.aabb.max.y - self.aabb.min.y + 2.0 * margin);
        let mut highest = None;
        for shift in self.shifts(at, at) {
            *rays += 1;
            let origin = (at + shift).extend(from).xzy();
            let Some(hit) = self.target.first_hit(origin, Vec3::NEG_Y, distance, Sides::Front) else { continue };
            if highest.is_none_or(|(known, _)| hit.distance < known) {
                highest = Some((hit.distance, hit));
            }
        }
        let (distance, hit) = highest?;
        let surface = self.target.surface;
        let face = surface.face_normal(hit.triangle);
        let side = if face.y < 0.0 { -1.0 } else { 1.0 };
        let place = at.extend(from - distance).xzy();
        Some((place, side * surface.normal(hit.triangle, hit.weights), side * face))
    }

    /// Tells if a ray meets no copy of the patch.
    fn is_open(&self, from: Vec3, direction: Vec3, distance: f32) -> bool {
        // Above the patch there is nothing more.
        let room = if direction.y > 0.0 { self.aabb.max.y - from.y } else { from.y - self.aabb.min.y };
        let leaves = (room.max(0.0) + self.target.step_off()) / direction.y.abs();
        let distance = distance.min(leaves);
        let to = from.xz() + direction.xz() * distance;
        let mut shifts = self.shifts(from.xz().min(to), from.xz().max(to));
        !shifts.any(|shift| self.target.is_hit(from + shift.extend(0.0).xzy(), direction, distance))
    }

    /// Moves by whole periods that bring some of a rectangle over the patch.
    fn shifts(&self, least: Vec2, most: Vec2) -> impl Iterator<Item = Vec2> + use<> {
        let first = ((self.aabb.min.xz() - most) / self.period).ceil();
        let last = ((self.aabb.max.xz() - least) / self.period).floor();
        let range = |first: f32, last: f32| -> RangeInclusive<i32> { first as i32..=last as i32 };
        let (columns, period) = (range(first.x, last.x), self.period);
        range(first.y, last.y)
            .flat_map(move |row| columns.clone().map(move |column| Vec2::new(column as f32, row as f32) * period))
    }
}
