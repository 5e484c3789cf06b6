//! Scans of worlds that change, by any number of threads, with noise.

use super::{Random, Scene, at, lidar};
use crate::common::prelude::*;
use bevy_tasks::TaskPoolBuilder;
use glam::DQuat;
use relief::sense::{Pose, RayScene, lidar as lidars};
use systems::sensors::philox::Noise;
use systems::sensors::{Beams, LidarNoise};

#[test]
fn any_number_of_threads_makes_the_same_bytes() {
    let mut scene = Scene::new();
    let white = scene.white();
    let mut random = Random(3);
    scene.add(shapes::plane(Vec2::splat(100.0), UVec2::splat(9)), white, Transform::IDENTITY);
    for i in 0..200 {
        let place = Vec3::new(random.next() as f32 * 60.0 - 30.0, 1.0, random.next() as f32 * 60.0 - 30.0);
        let place = Transform::from_translation(place).with_rotation(Quat::from_rotation_y(i as f32));
        let mesh = if i % 2 == 0 { shapes::cube(Vec3::new(1.0, 2.0, 3.0)) } else { shapes::sphere(1.0, 16, 8) };
        scene.add(mesh, white, place);
    }
    let noise = LidarNoise { range_sigma: 0.02, drop_rate: 0.1, drop_below: 0.01 };
    let lidar = LidarSensor { beams: Beams::Os1With64, columns: 500, sweep: true, noise, ..LidarSensor::default() };
    let poses = [at(0.0, 2.0, 0.0), Pose { rotation: DQuat::from_rotation_y(0.1), ..at(0.5, 2.0, 1.0) }];
    let rays = scene.rays();
    let columns = lidar.columns_between(7, 12, 1.0 / 60.0);
    let scans = [1, 2, 4].map(|threads| {
        let pool = TaskPoolBuilder::new().num_threads(threads).build();
        lidars::scan_on(&pool, &rays, &lidar, &poses, columns, Noise::new(1, 2, 3))
    });
    assert_eq!(scans[0].len() as u64, columns.count * 64);
    assert!(scans[0].hit.iter().filter(|&&hit| hit == 1).count() > 10_000);
    assert_eq!(scans[0], scans[1]);
    assert_eq!(scans[0], scans[2]);
    let pool = TaskPoolBuilder::new().num_threads(1).build();
    assert_ne!(scans[0], lidars::scan_on(&pool, &rays, &lidar, &poses, columns, Noise::new(1, 2, 4)));
}

#[test]
fn a_scene_kept_for_many_captures_follows_the_world() {
    let mut scene = Scene::new();
    let white = scene.white();
    let cube = scene.add(shapes::cube(Vec3::splat(2.0)), white, Transform::from_xyz(0.0, 0.0, 10.0));
    let sphere = scene.add(shapes::sphere(1.0, 64, 32), white, Transform::from_xyz(10.0, 0.0, 0.0));
    let mut rays = RayScene::default();
    let mut ahead = |scene: &mut Scene| {
        scene.simulation.frame();
        rays.update(&scene.simulation);
        let kept = rays.nearest(DVec3::ZERO, DVec3::Z, 0.1, 100.0).map(|met| (met.entity, met.range));
        let mut anew = RayScene::default();
        anew.update(&scene.simulation);
        assert_eq!(kept, anew.nearest(DVec3::ZERO, DVec3::Z, 0.1, 100.0).map(|met| (met.entity, met.range)));
        (kept, rays.objects())
    };
    let (cube_index, sphere_index) = (cube.index_u32(), sphere.index_u32());
    assert_eq!(ahead(&mut scene), (Some((cube_index, 9.0)), 2));
    // It moves.
    scene.simulation.world.entity_mut(cube).insert(Transform::from_xyz(0.0, 0.0, 30.0));
    assert_eq!(ahead(&mut scene), (Some((cube_index, 29.0)), 2));
    // Its mesh is replaced by another.
    let mesh = *scene.simulation.world.get::<MeshId>(cube).expect("a mesh");
    scene.simulation.world.resource_mut::<Library>().replace_mesh(mesh, shapes::cube(Vec3::splat(4.0)));
    assert_eq!(ahead(&mut scene), (Some((cube_index, 28.0)), 2));
    // It goes; another comes, with a mesh in the same slot.
    scene.simulation.world.despawn(cube);
    scene.simulation.world.resource_mut::<Library>().remove_mesh(mesh);
    assert_eq!(ahead(&mut scene), (None, 1));
    let next = scene.add(shapes::cube(Vec3::splat(6.0)), white, Transform::from_xyz(0.0, 0.0, 40.0));
    assert_eq!(ahead(&mut scene), (Some((next.index_u32(), 37.0)), 2));
    // Out of range.
    scene.simulation.world.entity_mut(next).insert(Transform::from_xyz(0.0, 0.0, 400.0));
    scene.simulation.world.entity_mut(sphere).insert(Transform::from_xyz(0.0, 0.0, 50.0));
    let (met, objects) = ahead(&mut scene);
    assert_eq!((met.map(|met| met.0), objects), (Some(sphere_index), 2));
    scene.simulation.world.despawn(sphere);
    assert_eq!(ahead(&mut scene), (None, 1));
}

#[test]
fn noise_takes_no_return_beyond_the_range_and_none_to_0() {
    let mut scene = Scene::new();
    let white = scene.white();
    scene.add(shapes::plane(Vec2::splat(60.0), UVec2::splat(6)), white, Transform::IDENTITY);
    let columns = 20_000;
    // Straight down from a height: least and most range, deviation, and the share that is measured between them, of a
    // normal distribution's.
    let cases = [
        (0.6, (0.5, 100.0), 0.5, 0.579_26),
        (0.1, (0.0, 100.0), 0.5, 0.579_26),
        (99.95, (0.5, 100.0), 0.1, 0.691_46),
        (2.0, (1.0, 3.0), 1.0, 0.682_69),
    ];
    for (height, range, range_sigma, share) in cases {
        let noise = LidarNoise { range_sigma, ..LidarNoise::default() };
        let lidar = LidarSensor { range, noise, ..lidar(&[-90.0], columns) };
        let scan = scene.scan(&lidar, at(0.0, height, 0.0));
        let hits = (0..scan.len()).filter(|&i| scan.hit[i] == 1);
        for i in hits.clone() {
            assert!(scan.range[i] > 0.0 && (range.0..=range.1).contains(&scan.range[i]), "{}", scan.range[i]);
        }
        // Four deviations of a binomial; the table of normal numbers is coarser than that by far less.
        let (found, count) = (hits.count() as f64, f64::from(columns));
        assert!((found - share * count).abs() < 4.0 * (count * share * (1.0 - share)).sqrt(), "{height}: {found}");
        let is_nothing = |i: usize| scan.range[i] == 0.0 && scan.xyz[i] == [0.0; 3] && scan.entity[i] == u32::MAX;
        assert!((0..scan.len()).filter(|&i| scan.hit[i] == 0).all(is_nothing));
    }
    // What the sensor touches is at no distance.
    let scan = scene.scan(&LidarSensor { range: (0.0, 9.0), ..lidar(&[-90.0], 4) }, at(0.0, 0.0, 0.0));
    assert_eq!(scan.hit, [0; 4]);
}

#[test]
fn noise_has_the_deviation_and_the_losses_that_it_is_given() {
    let mut scene = Scene::new();
    let white = scene.white();
    scene.add(shapes::plane(Vec2::splat(60.0), UVec2::splat(6)), white, Transform::IDENTITY);
    let quiet = LidarSensor { columns: 20_000, ..lidar(&[-30.0], 1) };
    let pose = at(0.0, 5.0, 0.0);
    let truth = scene.scan(&quiet, pose);
    assert!(truth.hit.iter().all(|&hit| hit == 1));
    let noise = LidarNoise { range_sigma: 0.1, drop_rate: 0.25, drop_below: 0.0 };
    let noisy = scene.scan(&LidarSensor { noise, ..quiet.clone() }, pose);
    let kept: Vec<usize> = (0..noisy.len()).filter(|&i| noisy.hit[i] == 1).collect();
    let (n, count) = (kept.len() as f64, truth.len() as f64);
    // Three deviations of a binomial, of a mean and of a variance (whose own is σ² √(1.99/n)).
    assert!((n - 0.75 * count).abs() < 3.0 * (count * 0.75 * 0.25).sqrt(), "{n}");
    let off: Vec<f64> = kept.iter().map(|&i| f64::from(noisy.range[i]) - f64::from(truth.range[i])).collect();
    let mean = off.iter().sum::<f64>() / n;
    let variance = off.iter().map(|off| (off - mean).powi(2)).sum::<f64>() / n;
    assert!(mean.abs() < 3.0 * 0.1 / n.sqrt(), "{mean}");
    assert!((variance / 0.01 - 1.0).abs() < 3.0 * (1.99 / n).sqrt(), "{variance}");
    for &i in kept.iter().step_by(100) {
        let [x, y, z] = noisy.xyz[i];
        assert!((Vec3::new(x, y, z).length() - noisy.range[i]).abs() < 1e-5);
    }
    // White at 60° reflects a half.
    let faint = |drop_below| LidarSensor { noise: LidarNoise { drop_below, ..LidarNoise::default() }, ..quiet.clone() };
    assert!(scene.scan(&faint(0.499), pose).hit.iter().all(|&hit| hit == 1));
    assert!(scene.scan(&faint(0.501), pose).hit.iter().all(|&hit| hit == 0));
}
