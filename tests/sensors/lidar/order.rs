//! Hits of rays are a function of the state: not of the trees, nor of where searches begin.

use super::{Random, Scene, at, lidar};
use crate::common::prelude::*;
use glam::DQuat;
use relief::sense::{LidarScan, Pose, RayScene, lidar as lidars};
use systems::sensors::philox::Noise;
use systems::sensors::{Beams, Columns};

/// Cubes on a grid, whose sides touch, with a second in every third place: on rays along the axes and through the
/// middles of sides much is equally near.
fn crowd(scene: &mut Scene) -> Vec<(Entity, Transform)> {
    let white = scene.white();
    let mut random = Random(11);
    let mut cubes = Vec::new();
    for i in 0..600 {
        let mut whole = || (random.next() * 12.0).floor() as f32 - 6.0;
        let place = Transform::from_xyz(whole(), whole(), whole());
        for _ in 0..1 + usize::from(i % 3 == 0) {
            cubes.push((scene.add(shapes::cube(Vec3::ONE), white, place), place));
        }
    }
    cubes
}

#[test]
fn of_what_lies_in_one_place_the_first_entity_is_met_whatever_the_trees() {
    let mut scene = Scene::new();
    let cubes = crowd(&mut scene);
    // Two trees: some stood elsewhere when the first was made.
    let elsewhere = |i: usize| Transform::from_xyz(200.0 + i as f32, 0.0, 0.0);
    for (i, (cube, _)) in cubes.iter().enumerate().filter(|(i, _)| i % 4 == 1) {
        scene.simulation.world.entity_mut(*cube).insert(elsewhere(i));
    }
    let mut moved = scene.rays();
    for (cube, place) in &cubes {
        scene.simulation.world.entity_mut(*cube).insert(*place);
    }
    let anew = scene.rays();
    moved.update(&scene.simulation);
    assert_eq!((anew.objects(), moved.objects()), (cubes.len(), cubes.len()));
    let mut random = Random(12);
    let mut met = 0;
    for i in 0..60_000 {
        let mut whole = || (random.next() * 12.0).floor() - 6.0;
        let target = DVec3::new(whole(), whole(), whole());
        let direction = match i % 4 {
            3 => random.direction(),
            axis => DVec3::AXES[axis],
        };
        let origin = target - direction * 30.0;
        let found = anew.nearest(origin, direction, 0.1, 100.0);
        assert_eq!(found, moved.nearest(origin, direction, 0.1, 100.0), "ray {i}");
        let Some(found) = found.filter(|_| i % 4 != 3) else { continue };
        // The middles of sides: the first of all that are there.
        let middle = origin + direction * (found.range + 0.5);
        let there = cubes.iter().filter(|(_, place)| place.translation.as_dvec3().distance(middle) < 1e-3);
        assert_eq!(Some(found.entity), there.map(|(cube, _)| cube.index_u32()).min(), "ray {i}");
        met += 1;
    }
    assert!(met > 10_000, "{met}");
}

/// But for times, which count from the first column.
fn of_columns(rays: &RayScene, lidar: &LidarSensor, pose: Pose, columns: Columns) -> LidarScan {
    let scan = lidars::scan(rays, lidar, &[pose; 2], columns, Noise::new(0, 0, 0));
    LidarScan { time: Vec::new(), ..scan }
}

#[test]
fn a_beam_meets_the_same_after_others_and_alone() {
    let mut scene = Scene::new();
    crowd(&mut scene);
    let white = scene.white();
    // A road in pieces below, and a wall that beams pass by closely.
    let road =
        scene.add(shapes::plane(Vec2::splat(90.0), UVec2::splat(30)), white, Transform::from_xyz(0.0, -7.0, 0.0));
    systems::draw::pieces::draw_in_pieces(&mut scene.simulation.world, road, 8.0);
    let wall = Transform::from_xyz(9.0, -2.0, 3.0).with_rotation(Quat::from_rotation_y(0.01));
    scene.add(shapes::cube(Vec3::new(0.2, 8.0, 20.0)), white, wall);
    let lidar = LidarSensor { beams: Beams::Os1With64, columns: 512, range: (0.1, 60.0), ..lidar(&[], 512) };
    let pose = Pose { rotation: DQuat::from_rotation_y(0.3), ..at(8.5, 1.0, -12.0) };
    let rays = scene.rays();
    let together = of_columns(&rays, &lidar, pose, lidar.revolution());
    let mut met = 0;
    for first in 0..512 {
        let mut column = lidar.revolution();
        (column.first, column.count) = (first, 1);
        let alone = of_columns(&rays, &lidar, pose, column);
        for ring in 0..64 {
            let i = first as usize * 64 + ring;
            let of = |scan: &LidarScan, i: usize| {
                (scan.xyz[i], scan.range[i], scan.intensity[i], scan.entity[i], scan.hit[i])
            };
            assert_eq!(of(&together, i), of(&alone, ring), "column {first}, ring {ring}");
            met += usize::from(alone.hit[ring]);
        }
    }
    assert!(met > 10_000, "{met}");
}

#[test]
fn worlds_that_change_often_are_met_as_they_are() {
    let mut scene = Scene::new();
    let cubes = crowd(&mut scene);
    let mut kept = scene.rays();
    let mut random = Random(13);
    // Few move, then all, then most rest: the trees are shared out anew.
    for share in [0.05, 1.0, 0.0, 0.3, 0.0, 0.02] {
        for (cube, place) in &cubes {
            if random.next() < share {
                let shift = Vec3::new(random.next() as f32, random.next() as f32, 0.0);
                let moved = Transform { translation: place.translation + shift, ..*place };
                scene.simulation.world.entity_mut(*cube).insert(moved);
            }
        }
        let anew = scene.rays();
        kept.update(&scene.simulation);
        assert_eq!((kept.objects(), kept.warnings()), (anew.objects(), anew.warnings()));
        for i in 0..3000 {
            let direction = random.direction();
            let origin = direction * -20.0 + random.direction() * 5.0;
            let met = anew.nearest(origin, direction, 0.1, 100.0);
            assert_eq!(kept.nearest(origin, direction, 0.1, 100.0), met, "{share}, ray {i}");
        }
    }
}
