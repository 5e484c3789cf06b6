//! Assets: creation, cutting and simplification of meshes, and a library that changes.

mod displace;
mod levels;
mod library;
mod proxies;
mod split;
mod tangents;

use glam::{UVec2, UVec3, Vec2, Vec4};
use proptest::prelude::*;
use systems::Simulation;
use systems::assets::split::{Grid, split};
use systems::assets::tangents::compute_tangents;
use systems::assets::{Image, ImageKind, Library, Mesh, Sampler, Wrap, shapes};

use glam::Vec3;
use std::collections::HashMap;

fn bits(v: Vec3) -> [u32; 3] {
    (v + 0.0).to_array().map(f32::to_bits)
}

/// Triangles along each edge by the bits of its ends, +1 one way and −1 the other; edges at 0 are left out. A closed
/// surface has none. A vertex on one side of an edge that the other side does not have would leave three.
fn open_edges(triangles: impl IntoIterator<Item = [Vec3; 3]>) -> HashMap<[[u32; 3]; 2], i32> {
    let mut edges = HashMap::new();
    for triangle in triangles {
        let [a, b, c] = triangle.map(bits);
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let (key, way) = if from <= to { ([from, to], 1) } else { ([to, from], -1) };
            if from != to {
                *edges.entry(key).or_default() += way;
            }
        }
    }
    edges.retain(|_, ways| *ways != 0);
    edges
}
