//! Rays for the texels of a map, and what they give.

use super::bands::{BAND, Band};
use super::dilate::dilate;
use super::occlusion::Sky;
use super::options::{AUTO_CAGE, BakeOptions, MAX_SIDE, Reach};
use super::report::{Baked, Coverage, Report};
use super::surface::Surface;
use super::target::{Hit, Sides, Target};
use super::unwrap::{Texel, Unwrap};
use crate::tools::maps::raster::share_out;
use crate::tools::maps::{MapError, Raster};
use glam::{Vec2, Vec3};
use std::num::NonZero;
use std::thread::available_parallelism;
use std::time::Instant;

/// Floats have more digits than a ray is exact to. Rounded to this, a flat surface gives the same byte everywhere,
/// rather than now one and now the next.
const STEP: f32 = 1.0 / (1 << 20) as f32;
/// Rays of a texel at the most.
const MAX_RAYS: usize = 65536;
/// Places of missed texels that a report names.
const NAMED: usize = 5;

/// Results of a texel's rays.
pub(super) struct Sample {
    /// Unit, tangent space.
    pub normal: Vec3,
    /// Metres.
    pub height: f32,
    /// Open share of the sky.
    pub occlusion: f32,
}

/// Outcome of baking a texel.
pub(super) enum Outcome {
    Outside,
    Missed,
    Baked(Sample),
}

/// Bakes the detail of a fine mesh into maps of a coarse one. `progress(done, of)` is called now and then, from any
/// thread.
///
/// # Errors
/// The coarse mesh has no usable UVs, nothing is met, or an option makes no sense.
pub fn bake(
    low: &Surface,
    target: &Target,
    options: &BakeOptions,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Baked, MapError> {
    check_options(options)?;
    let reach = options.reach.unwrap_or_else(|| auto_cage(low));
    let metres = reach.metres();
    if !(metres > 0.0 && metres.is_finite()) {
        return Err(MapError::option("reach", format!("expected metres above 0, found {metres}")));
    }
    let unwrap = Unwrap::new(low, options.size).map_err(|message| MapError::refused(&low.source, message))?;
    let sky = Sky::new(options.rays, options.occlusion_distance);
    let sample = |x: usize, y: usize, rays: &mut u64| {
        let Some(texel) = unwrap.texel(low, x, y) else { return Outcome::Outside };
        let frame = Frame::new(low, texel);
        *rays += if matches!(reach, Reach::Cage(_)) { 1 } else { 2 };
        let Some((hit, height)) = meet(target, &frame, reach) else { return Outcome::Missed };
        let surface = target.surface;
        let side = if surface.face_normal(hit.triangle).dot(frame.normal) < 0.0 { -1.0 } else { 1.0 };
        let normal = side * surface.normal(hit.triangle, hit.weights);
        let mut occlusion = 1.0;
        if options.wanted.occlusion {
            *rays += sky.rays() as u64;
            let above = side * surface.face_normal(hit.triangle);
            let at = frame.position + frame.normal * height + above * target.step_off();
            occlusion = sky.open_share(target, at, above, (x, y));
        }
        Outcome::Baked(Sample { normal: frame.to_tangent_space(normal), height, occlusion })
    };
    let mut baked = cast(options, sample, progress);
    baked.report.overlapping = unwrap.overlapping;
    baked.report.flat_triangles = unwrap.flat;
    baked.report.metres_per_width = metres_per_width(low, baked.report.size);
    baked.report.triangles = target.surface.triangles.len();
    if baked.report.baked == 0 {
        return Err(MapError::NothingMet {
            path: low.source.clone(),
            rays: baked.report.missed,
            fine: target.surface.source.clone(),
            metres,
        });
    }
    finish(&mut baked, options, (-metres, metres));
    Ok(baked)
}

/// Refuses options that make no sense whatever the meshes.
pub(super) fn check_options(options: &BakeOptions) -> Result<(), MapError> {
    check_size(options.size)?;
    if !(1..=MAX_RAYS).contains(&options.rays) {
        let message = format!("expected 1 to {MAX_RAYS} rays for each texel, found {}", options.rays);
        return Err(MapError::option("rays", message));
    }
    if options.occlusion_distance.is_nan() || options.occlusion_distance <= 0.0 {
        let message = format!("expected metres above 0, found {}", options.occlusion_distance);
        return Err(MapError::option("occlusion_distance", message));
    }
    Ok(())
}

/// Checks that maps can be so large.
///
/// # Errors
/// Names the limit.
pub fn check_size((width, height): (usize, usize)) -> Result<(), MapError> {
    if (1..=MAX_SIDE).contains(&width) && (1..=MAX_SIDE).contains(&height) {
        return Ok(());
    }
    Err(MapError::option("size", format!("expected 1 to {MAX_SIDE} texels along each side, found {width}×{height}")))
}

fn auto_cage(low: &Surface) -> Reach {
    let aabb = low.aabb();
    Reach::Cage(AUTO_CAGE * (aabb.max - aabb.min).length())
}

/// The frame of the coarse mesh at a texel, as `tangent_frame` in `bump.wgsl` makes it: unit, orthogonal.
struct Frame {
    position: Vec3,
    tangent: Vec3,
    bitangent: Vec3,
    normal: Vec3,
}

impl Frame {
    fn new(low: &Surface, Texel { triangle, weights }: Texel) -> Self {
        let [a, b, c] = low.triangles[triangle as usize].map(|vertex| vertex as usize);
        let blend = |values: [Vec3; 3]| values[0] * weights.x + values[1] * weights.y + values[2] * weights.z;
        let position = blend([a, b, c].map(|vertex| low.positions[vertex]));
        let normal = low.normal(triangle, weights);
        let along = blend([a, b, c].map(|vertex| low.tangents[vertex].truncate()));
        let across = along - normal * normal.dot(along);
        let tangent = across.try_normalize().unwrap_or_else(|| normal.any_orthonormal_vector());
        Self { position, tangent, bitangent: normal.cross(tangent) * low.tangents[a].w, normal }
    }

    fn to_tangent_space(&self, normal: Vec3) -> Vec3 {
        Vec3::new(self.tangent.dot(normal), self.bitangent.dot(normal), self.normal.dot(normal))
    }
}

/// Hit of a texel's ray, and its height above the coarse mesh, metres.
fn meet(target: &Target, frame: &Frame, reach: Reach) -> Option<(Hit, f32)> {
    let &Frame { position, normal, .. } = frame;
    match reach {
        Reach::Cage(cage) => {
            let hit = target.first_hit(position + normal * cage, -normal, 2.0 * cage, Sides::Front)?;
            Some((hit, cage - hit.distance))
        }
        Reach::MaxDistance(most) => {
            // What lies outside is met from within.
            let outside = target.first_hit(position, normal, most, Sides::Back).map(|hit| (hit, hit.distance));
            let nearest = outside.map_or(most, |(_, height)| height);
            let inside = target.first_hit(position, -normal, nearest, Sides::Front).map(|hit| (hit, -hit.distance));
            inside.or(outside)
        }
    }
}

/// Samples every texel, on all threads. Normals stay vectors and heights metres until [`finish`].
pub(super) fn cast(
    options: &BakeOptions,
    sample: impl Fn(usize, usize, &mut u64) -> Outcome + Sync,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Baked {
    let started = Instant::now();
    let (width, height) = options.size;
    let raster = |wanted: bool, channels| Raster::new(if wanted { width } else { 0 }, height, channels);
    let mut normal = raster(options.wanted.normal, 3);
    let mut heights = raster(options.wanted.height, 1);
    let mut occlusion = raster(options.wanted.occlusion, 1);
    let mut coverage = vec![Coverage::Outside; width * height];
    let of = height.div_ceil(BAND);
    let bands = {
        let mut rest = (&mut *normal.values, &mut *heights.values, &mut *occlusion.values, &mut *coverage);
        let bands = (0..of).map(|band| Band {
            first_row: band * BAND,
            width,
            normal: take(&mut rest.0, 3 * BAND * width),
            height: take(&mut rest.1, BAND * width),
            occlusion: take(&mut rest.2, BAND * width),
            coverage: take(&mut rest.3, BAND * width),
        });
        bands.collect::<Vec<_>>()
    };
    let work = |band| fill(band, &sample);
    let threads = options.threads.or_else(|| available_parallelism().ok()).map_or(1, NonZero::get);
    let tallies = share_out(bands.into_iter(), threads, work, &|done| progress(done, of));
    let mut report = Report { size: options.size, casting: started.elapsed(), ..Report::default() };
    let mut met = (f32::INFINITY, f32::NEG_INFINITY);
    for tally in tallies {
        report.rays += tally.rays;
        met = (met.0.min(tally.lowest), met.1.max(tally.highest));
    }
    report.heights_met = met;
    let count = |wanted| coverage.iter().filter(|&&coverage| coverage == wanted).count();
    (report.baked, report.missed) = (count(Coverage::Baked), count(Coverage::Missed));
    let missed = coverage.iter().enumerate().filter(|&(_, &coverage)| coverage == Coverage::Missed);
    let uv = |index: usize| {
        (Vec2::new((index % width) as f32, (index / width) as f32) + 0.5) / Vec2::new(width as f32, height as f32)
    };
    report.first_missed = missed.take(NAMED).map(|(index, _)| uv(index)).collect();
    let kept = |raster: Raster| (raster.width > 0).then_some(raster);
    Baked { normal: kept(normal), height: kept(heights), occlusion: kept(occlusion), coverage, report }
}

/// The first so many of a slice, or fewer.
fn take<'a, T>(rest: &mut &'a mut [T], count: usize) -> &'a mut [T] {
    let count = count.min(rest.len());
    rest.split_off_mut(..count).unwrap_or_default()
}

#[derive(Default)]
struct Tally {
    rays: u64,
    lowest: f32,
    highest: f32,
}

fn fill(band: Band, sample: &impl Fn(usize, usize, &mut u64) -> Outcome) -> Tally {
    let mut tally = Tally { rays: 0, lowest: f32::INFINITY, highest: f32::NEG_INFINITY };
    for (x, y, index) in band.texels() {
        band.coverage[index] = match sample(x, y, &mut tally.rays) {
            Outcome::Outside => Coverage::Outside,
            Outcome::Missed => Coverage::Missed,
            Outcome::Baked(sample) => {
                if let Some(normal) = band.normal.get_mut(3 * index..3 * index + 3) {
                    normal.copy_from_slice(&sample.normal.to_array());
                }
                if let Some(height) = band.height.get_mut(index) {
                    *height = sample.height;
                }
                if let Some(occlusion) = band.occlusion.get_mut(index) {
                    *occlusion = sample.occlusion;
                }
                tally.lowest = tally.lowest.min(sample.height);
                tally.highest = tally.highest.max(sample.height);
                Coverage::Baked
            }
        };
    }
    tally
}

/// Fills texels around the charts, and makes 0..1 of normals and heights.
pub(super) fn finish(baked: &mut Baked, options: &BakeOptions, height_range: (f32, f32)) {
    baked.report.height_range = height_range;
    let mut filled: Vec<bool> = baked.coverage.iter().map(|&coverage| coverage == Coverage::Baked).collect();
    let maps = [&mut baked.normal, &mut baked.height, &mut baked.occlusion];
    let mut maps: Vec<&mut Raster> = maps.into_iter().flatten().collect();
    baked.report.dilated = dilate(&mut maps, &mut filled, options.size.0, options.dilate);
    let rounded = |value: f32| (value / STEP).round() * STEP;
    for normal in baked.normal.iter_mut().flat_map(|map| map.values.as_chunks_mut::<3>().0) {
        let unit = Vec3::from_array(*normal).try_normalize().unwrap_or(Vec3::Z);
        *normal = (unit * 0.5 + 0.5).to_array().map(rounded);
    }
    let (black, white) = height_range;
    let rest = baked.report.height_rest();
    if let Some(map) = &mut baked.height {
        for (height, &filled) in map.values.iter_mut().zip(&filled) {
            let share = if white > black { (*height - black) / (white - black) } else { rest };
            *height = if filled { rounded(share.clamp(0.0, 1.0)) } else { rest };
        }
    }
    if let Some(map) = &mut baked.occlusion {
        map.values.iter_mut().zip(&filled).filter(|&(_, &filled)| !filled).for_each(|(open, _)| *open = 1.0);
    }
}

/// Metres of a width of the image, were its texels square where they are, with the area that they have there: of a
/// twentieth of the map less than the first, of a twentieth more than the last; the mean over the map between them.
fn metres_per_width(low: &Surface, (width, height): (usize, usize)) -> (f32, f32, f32) {
    let mut widths = Vec::with_capacity(low.triangles.len());
    for triangle in 0..low.triangles.len() as u32 {
        let [a, b, c] = low.corners(triangle);
        let [ua, ub, uc] = low.triangles[triangle as usize].map(|vertex| low.uvs[vertex as usize]);
        let (ub, uc) = (ub - ua, uc - ua);
        let area = ub.perp_dot(uc);
        let metres = ((b - a).cross(c - a).length() / area.abs() * width as f32 / height as f32).sqrt();
        if metres.is_finite() {
            widths.push((metres, f64::from(area.abs())));
        }
    }
    widths.sort_by(|a, b| a.0.total_cmp(&b.0));
    let whole: f64 = widths.iter().map(|(_, area)| area).sum();
    let mean = widths.iter().map(|&(metres, area)| f64::from(metres) * area).sum::<f64>() / whole;
    let at = |share: f64| {
        let mut below = 0.0;
        let reaches = |&&(_, area): &&(f32, f64)| {
            below += area;
            below >= share * whole
        };
        widths.iter().find(reaches).map_or(1.0, |&(metres, _)| metres)
    };
    if mean.is_finite() { (at(0.05), mean as f32, at(0.95)) } else { (1.0, 1.0, 1.0) }
}
