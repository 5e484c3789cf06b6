//! Optical flow: where what a pixel shows is in the picture of another time.
//!
//! All that is drawn is rigid, so depths and numbers of pixels are enough. With M the place of an entity
//! (world_from_object), V that of the camera (world_from_camera), both at captures k and j, and π the lens:
//!
//! ```text
//! X = V_k · π⁻¹(u, v, range_k(u, v))      x' = π(V_j⁻¹ · M_j · M_k⁻¹ · X)      flow = x' − (u, v)
//! ```
//!
//! The sky is infinitely far: it moves as the camera turns, and not as it moves. What was put elsewhere in between has
//! no flow, and a camera that was sees none.

use super::drawn_parts::Places;
use crate::sense::camera::lens_map::LensMap;
use crate::sense::captures::flow::{Flow, flags};
use glam::{DAffine3, DVec2, DVec3};
use std::collections::BTreeMap;
use std::sync::Arc;
use systems::ecs::parallel::in_parallel;
use systems::sensors::CameraSensor;

/// Share by which two distances may differ where the same is seen: what a pixel covers of a slanted surface.
const SAME_RANGE: f64 = 0.01;

/// Picture of a camera at a time, as far as flow asks.
#[derive(Default)]
pub(super) struct FlowFrame {
    /// From camera axes, X right, Y down, Z forward, to the scene's coordinates.
    pub world_from_camera: DAffine3,
    /// Number of the camera's jumps.
    pub jumps: u32,
    /// Places of what is drawn.
    pub places: Arc<Places>,
    /// By pixel: metres from the optical centre, infinite where there is nothing.
    pub range: Vec<f32>,
    /// By pixel: numbers of drawn entities.
    pub part: Vec<u32>,
}

/// The flow of the pixels of one picture into another of the same camera; `map`: of a lens that bends.
pub(super) fn flow(camera: &CameraSensor, map: Option<&LensMap>, from: &FlowFrame, to: &FlowFrame) -> Flow {
    let width = camera.size.0 as usize;
    let camera_from_world = to.world_from_camera.inverse();
    // By number, from one camera's axes to the other's.
    let still = camera_from_world * from.world_from_camera;
    let mut moves: BTreeMap<u32, Option<DAffine3>> = BTreeMap::new();
    for part in from.part.chunk_by(|a, b| a == b).map(|run| run[0]) {
        moves.entry(part).or_insert_with(|| {
            let (before, after) = (from.places.parts.get(&part)?, to.places.parts.get(&part)?);
            let (was, is) = (before.world_from_object, after.world_from_object);
            let moved = if was == is { DAffine3::IDENTITY } else { is * was.inverse() };
            (before.jumps == after.jumps).then_some(camera_from_world * moved * from.world_from_camera)
        });
    }
    let has_center = camera.intrinsics().is_some();
    // What a pixel shows, so far away.
    let point = |u: usize, v: usize, range: f64| match map {
        // Known, and as exact as a float is of a pixel; to find it anew takes a search.
        Some(map) => Some(map.direction(v * width + u)?.normalize() * range),
        None => camera.unproject(u as f64, v as f64, range),
    };
    let pixels = from.part.len();
    let mut flow = Flow { pixels: vec![[0.0; 2]; pixels], flags: vec![0; pixels] };
    if from.jumps != to.jumps {
        return flow;
    }
    let rows = flow.pixels.chunks_mut(width).zip(flow.flags.chunks_mut(width)).enumerate();
    let rows: Vec<_> = rows.collect();
    in_parallel(rows.into_iter(), |(v, (shifts, flags))| {
        // Neighbours are mostly of one entity.
        let mut last = (0, None);
        for u in 0..shifts.len() {
            let (part, range) = (from.part[v * width + u], from.range[v * width + u]);
            let at = DVec2::new(u as f64, v as f64);
            let is_sky = part == 0;
            let place = if is_sky {
                // Where the projection is parallel, nothing tells where it is.
                point(u, v, 1.0).filter(|_| has_center).map(|ahead| still.transform_vector3(ahead))
            } else {
                if last.0 != part {
                    last = (part, moves.get(&part).copied().flatten());
                }
                last.1.zip(point(u, v, range.into())).map(|(moved, point)| moved.transform_point3(point))
            };
            let Some((place, found)) = place.and_then(|place| Some((place, camera.project(place)?))) else { continue };
            shifts[u] = (found - at).as_vec2().to_array();
            flags[u] = flags::VALID | if is_sky { flags::SKY } else { 0 };
            if let Some(other) = nearest_pixel(camera, found) {
                flags[u] |= flags::INSIDE;
                let is_seen = to.part.get(other) == Some(&part)
                    && (is_sky || is_same(to.range[other].into(), range_of(camera, place)));
                flags[u] |= if is_seen { flags::SEEN } else { 0 };
            }
        }
    });
    flow
}

/// The pixel whose area a place of the picture is in.
fn nearest_pixel(camera: &CameraSensor, place: DVec2) -> Option<usize> {
    let pixel = place.round();
    let size = DVec2::new(camera.size.0.into(), camera.size.1.into());
    let is_inside = pixel.cmpge(DVec2::ZERO).all() && pixel.cmplt(size).all();
    is_inside.then(|| pixel.y as usize * camera.size.0 as usize + pixel.x as usize)
}

/// From the optical centre; where the projection is parallel, along the axis.
fn range_of(camera: &CameraSensor, place: DVec3) -> f64 {
    if camera.intrinsics().is_some() { place.length() } else { place.z }
}

fn is_same(found: f64, expected: f64) -> bool {
    (found - expected).abs() <= SAME_RANGE * expected
}
