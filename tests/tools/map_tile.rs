//! Maps of patches that repeat.

use crate::common::prelude::*;
use crate::models;
use relief::tools::maps::bake::{BakeOptions, Baked, Role, Surface, Target, TileOptions, Wanted, bake_tile};
use relief::tools::maps::{Edges, Raster};
use std::f32::consts::TAU;
use std::num::NonZero;

fn tiled(meshes: &[(Mesh, Vec3)], size: (usize, usize), period: Option<f32>, rays: usize) -> Baked {
    let mut patch = Surface::default();
    for (mesh, at) in meshes {
        let part = Surface::of_mesh(mesh, &Affine3A::from_translation(*at), Role::High).expect("a mesh");
        let first = patch.positions.len() as u32;
        patch.positions.extend(&part.positions);
        patch.normals.extend(&part.normals);
        patch.triangles.extend(part.triangles.iter().map(|corners| corners.map(|vertex| vertex + first)));
    }
    let options = TileOptions { bake: BakeOptions { size, rays, ..BakeOptions::default() }, period };
    bake_tile(&Target::new(&patch).expect("a surface"), &options, &|_, _| {}).expect("baked")
}

/// Hills that repeat after 2 m.
fn hills() -> Mesh {
    models::landscape(2.0, 128, |x, z| 0.1 * (x * TAU / 2.0).sin() * (z * TAU / 2.0).cos() + 0.03 * (z * TAU).sin())
}

/// The greatest difference between neighbours: across the map's edges, and within it.
fn steps(map: &Raster) -> (f32, f32) {
    let (mut across, mut within) = (0.0f32, 0.0f32);
    for (x, y) in (0..map.height as isize).flat_map(|y| (0..map.width as isize).map(move |x| (x, y))) {
        for (right, below) in [(1, 0), (0, 1)] {
            for channel in 0..map.channels {
                let here = map.at(x, y, channel, Edges::Wrap);
                let step = (map.at(x + right, y + below, channel, Edges::Wrap) - here).abs();
                let is_edge = x + right == map.width as isize || y + below == map.height as isize;
                let most = if is_edge { &mut across } else { &mut within };
                *most = most.max(step);
            }
        }
    }
    (across, within)
}

#[test]
fn a_tile_goes_on_across_its_edges() {
    let map = tiled(&[(hills(), Vec3::ZERO)], (64, 64), None, 512);
    assert_eq!((map.report.missed, map.report.baked), (0, 64 * 64));
    for raster in [&map.normal, &map.height, &map.occlusion] {
        let (across, within) = steps(raster.as_ref().expect("wanted"));
        assert!(across <= within * 1.05 && within > 0.0, "{across} across the edges, {within} within");
    }
    let report = &map.report;
    let (black, white) = report.height_range;
    // The most of 0.1 cos(t) + 0.03 sin(2t).
    assert!((black + 0.1136).abs() < 1e-3 && (white - 0.1136).abs() < 1e-3, "{black} to {white}");
    assert!((report.height_scale_uv() - (white - black) / 2.0).abs() < 1e-6);
    assert!((report.height_rest() - 0.5).abs() < 1e-2);
}

#[test]
fn heights_and_normals_are_those_of_the_hills() {
    let map = tiled(&[(hills(), Vec3::new(5.0, 1.0, -3.0))], (32, 32), Some(2.0), 1);
    let (heights, normals) = (map.height.expect("wanted"), map.normal.expect("wanted"));
    let (black, white) = map.report.height_range;
    for (x, y) in (0..32).flat_map(|y| (0..32).map(move |x| (x, y))) {
        let (at, down) = ((x as f32 + 0.5) / 16.0 - 1.0, (y as f32 + 0.5) / 16.0 - 1.0);
        let (k, l) = (TAU / 2.0, TAU);
        let height = 1.0 + 0.1 * (at * k).sin() * (down * k).cos() + 0.03 * (down * l).sin();
        let got = black + (white - black) * heights.at(x, y, 0, Edges::Wrap);
        assert!((got - height).abs() < 5e-4, "{got} instead of {height}");
        let along = 0.1 * k * (at * k).cos() * (down * k).cos();
        let across = -0.1 * k * (at * k).sin() * (down * k).sin() + 0.03 * l * (down * l).cos();
        let wanted = Vec3::new(-along, across, 1.0).normalize();
        let n = Vec3::from_array([0, 1, 2].map(|channel| normals.at(x, y, channel, Edges::Wrap))) * 2.0 - 1.0;
        assert!(n.angle_between(wanted).to_degrees() < 1.0, "{n} instead of {wanted}");
    }
}

#[test]
fn what_hangs_over_the_border_comes_in_again() {
    let floor = shapes::plane(glam::Vec2::splat(2.0), glam::UVec2::ONE);
    let stone = || shapes::sphere(0.5, 64, 32);
    let at = |x: f32, z: f32| {
        let meshes = [(floor.clone(), Vec3::ZERO), (stone(), Vec3::new(x, 0.1, z))];
        tiled(&meshes, (32, 32), Some(2.0), 1024)
    };
    let middle = at(0.0, 0.0);
    // Over a border, over a corner, and a whole period away: the same map, moved.
    for (x, z) in [(1.0f32, 0.0f32), (1.0, 1.0), (-3.0, 1.0)] {
        let moved = at(x, z);
        // 16 texels to a metre; the square that is baked moves with the middle of the box, which grows with the stone.
        let centre = |at: f32| ((at + 0.5).max(1.0) + (at - 0.5).min(-1.0)) / 2.0;
        let (dx, dy) = ((16.0 * (x - centre(x))) as isize, (16.0 * (z - centre(z))) as isize);
        // 1,024 rays that are evenly spread have a standard error of ½ · 1024^(−3/4) = 0.003, in either map.
        for (a, b, near) in [
            (&middle.height, &moved.height, 2e-3),
            (&middle.normal, &moved.normal, 0.02),
            (&middle.occlusion, &moved.occlusion, 0.05),
        ] {
            let (a, b) = (a.as_ref().expect("wanted"), b.as_ref().expect("wanted"));
            for (px, py) in (0..32).flat_map(|y| (0..32).map(move |x| (x, y))) {
                for channel in 0..a.channels {
                    let (wanted, got) =
                        (a.at(px, py, channel, Edges::Wrap), b.at(px + dx, py + dy, channel, Edges::Wrap));
                    assert!((wanted - got).abs() < near, "({px}, {py}) of ({x}, {z}): {got} instead of {wanted}");
                }
            }
        }
    }
}

#[test]
fn neighbouring_tiles_shade() {
    // Walls at the border of every tile: seen from its middle, all round.
    let floor = shapes::plane(glam::Vec2::splat(2.0), glam::UVec2::ONE);
    let wall = shapes::cube(Vec3::new(0.1, 1.0, 2.0));
    let map = tiled(&[(floor, Vec3::ZERO), (wall, Vec3::new(-0.95, 0.5, 0.0))], (64, 2), Some(2.0), 4096);
    let occlusion = map.occlusion.expect("wanted");
    for x in 3..64isize {
        // Walls without end along z, at both sides; the one at the right is the next tile's.
        let at = (x as f32 + 0.5) / 32.0;
        let shut = |from: f32| 0.5 * (1.0 - from / from.hypot(1.0));
        let wanted = 1.0 - shut(at - 0.1) - shut(2.0 - at);
        let got = occlusion.at(x, 0, 0, Edges::Wrap);
        // Of 4,096 rays, a standard error of ½ · 4096^(−3/4) = 0.001.
        assert!((got - wanted).abs() < 0.02, "column {x}: {got} instead of {wanted}");
    }
}

#[test]
fn a_flat_patch_and_any_number_of_threads() {
    let floor = shapes::plane(glam::Vec2::splat(2.0), glam::UVec2::ONE);
    let map = tiled(&[(floor, Vec3::Y)], (16, 16), None, 8);
    let all = |map: &Option<Raster>, wanted: &[f32]| {
        map.as_ref().is_some_and(|map| map.values.chunks_exact(map.channels).all(|texel| texel == wanted))
    };
    assert!(all(&map.normal, &[0.5, 0.5, 1.0]) && all(&map.height, &[0.5]) && all(&map.occlusion, &[1.0]));

    let patch = Surface::of_mesh(&hills(), &Affine3A::IDENTITY, Role::High).expect("a mesh");
    let target = Target::new(&patch).expect("a surface");
    let by = |threads: usize| {
        let wanted = Wanted::default();
        let bake =
            BakeOptions { size: (40, 40), rays: 4, wanted, threads: NonZero::new(threads), ..BakeOptions::default() };
        let map = bake_tile(&target, &TileOptions { bake, period: None }, &|_, _| {}).expect("baked");
        (map.normal, map.height, map.occlusion)
    };
    let one = by(1);
    assert!(one == by(2) && one == by(3));
}
