//! Scans and rays with known answers.

use super::{Random, Scene, at, lidar};
use crate::common::prelude::*;
use glam::DQuat;
use relief::sense::{Pose, lidar as lidars};
use std::f32::consts::{FRAC_PI_2, PI};
use systems::sensors::Beams;
use systems::sensors::philox::Noise;

/// Ranges end as floats, of which a half step is 2⁻²⁵; what was met is known in double precision, but for its mesh and
/// place, which are floats as well.
const RELATIVE: f64 = 1e-6;

fn close(found: f64, expected: f64, relative: f64) -> bool {
    (found - expected).abs() <= relative * expected.abs()
}

#[test]
fn a_plane_below_is_met_at_its_height_over_the_sine() {
    let degrees = [-60.0, -25.0, -10.0, -3.0, -1.0, 5.0];
    let lidar = lidar(&degrees, 90);
    let mut scene = Scene::new();
    let grey = scene.grey();
    let plane =
        scene.add(shapes::plane(Vec2::splat(400.0), UVec2::splat(40)), grey, Transform::from_xyz(0.0, 0.5, 0.0));
    let height = 1.73;
    let pose = Pose { rotation: DQuat::from_rotation_y(0.4), ..at(3.0, 0.5 + height, -7.0) };
    let scan = scene.scan(&lidar, pose);
    assert_eq!(scan.len(), 6 * 90);
    for i in 0..scan.len() {
        let ring = usize::from(scan.ring[i]);
        assert_eq!(ring, i % 6);
        let (column, sine) = (i / 6, -f64::from(degrees[ring]).to_radians().sin());
        assert_eq!((scan.hit[i], scan.entity[i] == plane.index_u32()), if sine > 0.0 { (1, true) } else { (0, false) });
        if scan.hit[i] == 0 {
            assert_eq!((scan.xyz[i], scan.range[i], scan.intensity[i], scan.entity[i]), ([0.0; 3], 0.0, 0.0, u32::MAX));
            continue;
        }
        let range = height / sine;
        assert!(close(scan.range[i].into(), range, RELATIVE), "{} instead of {range}", scan.range[i]);
        // Half of the light is reflected; it comes at the angle whose cosine is the elevation's sine.
        assert!(close(scan.intensity[i].into(), 0.5 * sine, RELATIVE));
        // Circles on the plane, clockwise from forward: x forward, y left, z up.
        let [x, y, z] = scan.xyz[i].map(f64::from);
        let (toward, radius) = ((column as f64 * 4.0).to_radians(), height / sine * (1.0 - sine * sine).sqrt());
        let expected = DVec3::new(radius * toward.cos(), -radius * toward.sin(), -height);
        assert!(DVec3::new(x, y, z).distance(expected) <= 2.0 * RELATIVE * range, "{x} {y} {z}: {expected}");
        assert!((f64::from(scan.time[i]) - column as f64 / 900.0).abs() < 1e-8);
    }
}

#[test]
fn a_sphere_is_met_within_the_sagitta_of_its_mesh() {
    let (radius, segments, rings) = (1.5f64, 128, 64);
    let mut scene = Scene::new();
    let white = scene.white();
    let center = DVec3::new(4.0, 1.0, 9.0);
    scene.add(shapes::sphere(radius as f32, segments, rings), white, Transform::from_translation(center.as_vec3()));
    let lidar = lidar(&[-6.0, -3.0, 0.0, 3.0, 6.0], 3600);
    let scan = scene.scan(&lidar, at(0.0, 1.0, 0.0));
    // The widest angle between neighbouring vertices is π/64 in both directions.
    let sagitta = radius * (1.0 - (std::f64::consts::PI / 64.0 / 2.0).cos()) * 2.0;
    let mut met = 0;
    for i in 0..scan.len() {
        let (toward, elevation) = ((i / 5) as f64 * 0.1, (i % 5) as f64 * 3.0 - 6.0);
        let ((sin, cos), (up, across)) = (toward.to_radians().sin_cos(), elevation.to_radians().sin_cos());
        let direction = DVec3::new(-sin * across, up, cos * across);
        let to_center = center - DVec3::Y;
        let along = to_center.dot(direction);
        let beside = (to_center.length_squared() - along * along).sqrt();
        if beside > radius || along < 0.0 {
            assert_eq!(scan.hit[i], 0, "{along} m along, beside by {}", beside - radius);
        } else if beside < radius - sagitta {
            let inside = |radius: f64| along - (radius * radius - beside * beside).sqrt();
            let (least, most) = (inside(radius), inside(radius - sagitta));
            let range = f64::from(scan.range[i]);
            assert!(range > least - 1e-5 && range < most + 1e-5, "{range} is not in {least} to {most}");
            met += 1;
        }
    }
    assert!(met > 500, "{met}");
}

#[test]
fn no_ray_leaks_out_of_closed_boxes() {
    // One mesh of many triangles; six planes of a mesh each; the same where floats are millimetres apart.
    for (center, apart) in
        [(Vec3::ZERO, false), (Vec3::new(2.0, -1.0, 3.0), true), (Vec3::new(65_536.0, 8.0, -65_536.0), true)]
    {
        let mut scene = Scene::new();
        let white = scene.white();
        let turned = Quat::from_euler(glam::EulerRot::YXZ, 0.3, 0.5, -0.2);
        let size = Vec3::new(4.0, 2.5, 7.0);
        if apart {
            // A little wider than their distance, as walls are.
            let wall = |scene: &mut Scene, rotation: Quat, half: f32, wide: Vec2| {
                let normal = rotation * Vec3::Y;
                let place = Transform::from_translation(center + normal * half).with_rotation(rotation);
                scene.add(shapes::plane(wide * 1.01, UVec2::new(3, 5)), white, place);
            };
            for sign in [1.0f32, -1.0] {
                let half = size * 0.5;
                wall(
                    &mut scene,
                    Quat::from_rotation_x(if sign > 0.0 { 0.0 } else { PI }),
                    half.y,
                    Vec2::new(size.x, size.z),
                );
                wall(&mut scene, Quat::from_rotation_x(sign * FRAC_PI_2), half.z, Vec2::new(size.x, size.y));
                wall(&mut scene, Quat::from_rotation_z(-sign * FRAC_PI_2), half.x, Vec2::new(size.y, size.z));
            }
        } else {
            let place = Transform { translation: center, rotation: turned, scale: size };
            scene.add(shapes::cube(Vec3::ONE), white, place);
        }
        let rays = scene.rays();
        let mut random = Random(5);
        let count = if apart { 250_000 } else { 500_000 };
        let mut leaks = 0;
        for _ in 0..count {
            let mut inside = || random.next() - 0.5;
            let from = DVec3::new(inside() * 3.0, inside() * 2.0, inside() * 6.0);
            let origin = center.as_dvec3() + if apart { from } else { turned.as_dquat() * from };
            leaks += usize::from(rays.nearest(origin, random.direction(), 0.01, 50.0).is_none());
        }
        assert_eq!(leaks, 0, "around {center}");
    }
}

#[test]
fn no_ray_slips_between_pieces_of_a_mesh() {
    let mut scene = Scene::new();
    let white = scene.white();
    let road = shapes::plane(Vec2::new(60.0, 60.0), UVec2::splat(60));
    let turned = Quat::from_euler(glam::EulerRot::YXZ, 0.7, 0.02, -0.03);
    let entity = scene.add(road, white, Transform::from_rotation(turned));
    systems::draw::pieces::draw_in_pieces(&mut scene.simulation.world, entity, 7.0);
    let rays = scene.rays();
    assert!(rays.objects() > 60, "{}", rays.objects());
    let mut random = Random(9);
    for i in 0..200_000 {
        // On the cuts, and anywhere; at the cuts' crossings in places.
        let mut coordinate = || {
            if random.next() < 0.7 { (random.next() * 8.0).floor() * 6.0 - 24.0 } else { random.next() * 58.0 - 29.0 }
        };
        let target = DVec3::new(coordinate(), 0.0, coordinate());
        let target = turned.as_dquat() * target;
        let origin = DVec3::new(random.next() * 80.0 - 40.0, 5.0 + random.next() * 60.0, 30.0);
        let met = rays.nearest(origin, (target - origin).normalize(), 0.1, 200.0);
        assert_eq!(met.map(|met| met.entity), Some(entity.index_u32()), "ray {i}");
    }
}

#[test]
fn a_box_at_twenty_metres_has_the_points_that_its_solid_angle_says() {
    let mut scene = Scene::new();
    let white = scene.white();
    // Its front is 19 m away, and hides the rest.
    let cube = scene.add(shapes::cube(Vec3::splat(2.0)), white, Transform::from_xyz(0.0, 0.0, 20.0));
    let step = 0.1f64;
    let grid = Beams::Grid { rows: 200, horizontal_degrees: 20.0, vertical_degrees: 20.0 };
    let lidar = LidarSensor { beams: grid, columns: 200, range: (0.1, 50.0), ..LidarSensor::default() };
    let scan = scene.scan(&lidar, at(0.0, 0.0, 0.0));
    let found = scan.entity.iter().filter(|&&entity| entity == cube.index_u32()).count() as f64;
    // The area of the front in degrees of azimuth and elevation: within atan(1/19), up and down by atan(cos a / 19).
    let half = (1.0f64 / 19.0).atan().to_degrees();
    let slices = 10_000;
    let at = |i: i32| (f64::from(i) + 0.5) / f64::from(slices) * 2.0 * half - half;
    let high = |azimuth: f64| 2.0 * (azimuth.to_radians().cos() / 19.0).atan().to_degrees();
    let area: f64 = (0..slices).map(|i| high(at(i)) * 2.0 * half / f64::from(slices)).sum();
    let (expected, perimeter) = (area / (step * step), 8.0 * half / step);
    assert!((found - expected).abs() <= perimeter, "{found} points, {expected} ± {perimeter} expected");
    assert!(found > 3000.0);
}

#[test]
fn far_from_the_origin_ranges_are_the_same() {
    let lidar = lidar(&[-20.0, -8.0, 0.0, 8.0], 360);
    let around = |center: DVec3| {
        let mut scene = Scene::new();
        let white = scene.white();
        for i in 0..12 {
            // Places that floats have exactly at either origin.
            let place = Vec3::new((i % 4) as f32 * 6.5 - 9.0, (i % 3) as f32 - 0.75, (i / 4) as f32 * 7.25 - 8.0);
            let place =
                Transform::from_translation(center.as_vec3() + place).with_rotation(Quat::from_rotation_y(i as f32));
            scene.add(shapes::cube(Vec3::new(1.5, 1.0, 3.0)), white, place);
        }
        scene.scan(&lidar, Pose { translation: center + DVec3::new(0.3, 0.1, 0.2), ..Pose::default() })
    };
    let (near, far) = (around(DVec3::ZERO), around(DVec3::new(65_536.0, 0.0, -65_536.0)));
    assert!(near.hit.iter().filter(|&&hit| hit == 1).count() > 100);
    assert_eq!(near.hit, far.hit);
    for (a, b) in near.range.iter().zip(&far.range) {
        assert!(close(f64::from(*a), f64::from(*b), RELATIVE), "{a} {b}");
    }
}

#[test]
fn a_wall_is_straight_for_a_lidar_that_moves() {
    let mut scene = Scene::new();
    let white = scene.white();
    // 20 m ahead at first, across the way.
    scene.add(shapes::cube(Vec3::new(400.0, 20.0, 2.0)), white, Transform::from_xyz(0.0, 0.0, 21.0));
    // A tenth of a second at 30 m/s, turning by 10°.
    let end = Pose { rotation: DQuat::from_rotation_y(10f64.to_radians()), ..at(0.5, 0.0, 3.0) };
    let poses = [at(0.0, 0.0, 0.0), end];
    let lidar = LidarSensor { sweep: true, ..lidar(&[-5.0, 0.0, 5.0], 720) };
    let rays = scene.rays();
    let columns = lidar.revolution();
    let scan = lidars::scan(&rays, &lidar, &poses, columns, Noise::new(0, 0, 0));
    let off = |pose: &dyn Fn(u64) -> Pose| {
        let met = (0..scan.len()).filter(|&i| scan.hit[i] == 1);
        let off = met.map(|i| {
            let pose = pose(i as u64 / 3);
            pose.world_from_points().transform_point3(DVec3::from(scan.xyz[i].map(f64::from))).z - 20.0
        });
        off.fold(0.0, |most: f64, off| most.max(off.abs()))
    };
    assert!(scan.hit.iter().filter(|&&hit| hit == 1).count() > 900);
    // Points up to 200 m away, as floats.
    assert!(off(&|i| Pose::of_column(&poses, &lidar, &columns, i)) < 4e-5);
    assert!(off(&|_| end) > 1.0);
    // Without a sweep all are fired from the end.
    let still = LidarSensor { sweep: false, ..lidar.clone() };
    let at_end = lidars::scan(&rays, &still, &[end; 2], columns, Noise::new(0, 0, 0));
    assert_eq!(lidars::scan(&rays, &still, &poses, columns, Noise::new(0, 0, 0)), at_end);
}

#[test]
fn what_is_nearer_or_further_than_the_range_is_not_met() {
    let mut scene = Scene::new();
    let white = scene.white();
    let walls = [2.0f32, 5.0, 30.0]
        .map(|z| scene.add(shapes::cube(Vec3::new(9.0, 9.0, 0.5)), white, Transform::from_xyz(0.0, 0.0, z)));
    let mut first = |range| {
        let lidar = LidarSensor { range, ..lidar(&[0.0], 4) };
        let scan = scene.scan(&lidar, at(0.0, 0.0, 0.0));
        (scan.entity[0], scan.range[0])
    };
    let index = walls.map(|wall| wall.index_u32());
    assert_eq!(first((0.1, 50.0)), (index[0], 1.75));
    // Out of what it begins in: the back of the first wall, and its front from within.
    assert_eq!(first((2.0, 50.0)), (index[0], 2.25));
    assert_eq!(first((3.0, 50.0)), (index[1], 4.75));
    assert_eq!(first((6.0, 29.7)), (u32::MAX, 0.0));
    assert_eq!(first((6.0, 29.8)), (index[2], 29.75));
}

/// A search over boxes that are not finite ends, and what lies beside such a mesh is met as ever.
#[test]
fn a_mesh_without_end_is_met_by_no_beam_and_keeps_none_from_what_is_there() {
    let sound = {
        let mut scene = Scene::new();
        let white = scene.white();
        scene.add(shapes::plane(Vec2::splat(40.0), UVec2::splat(5)), white, Transform::IDENTITY);
        scene.scan(&lidar(&[-45.0, -20.0, 0.0], 36), at(0.0, 2.0, 0.0))
    };
    for far in [1e14, 1e16, 1e19, 1e20, 1e30, 1e38, f32::MAX, f32::INFINITY, f32::NAN] {
        let mut scene = Scene::new();
        let white = scene.white();
        scene.add(shapes::plane(Vec2::splat(40.0), UVec2::splat(5)), white, Transform::IDENTITY);
        let mut torn = shapes::plane(Vec2::splat(5.0), UVec2::splat(5));
        torn.positions.iter_mut().for_each(|position| position.y -= 1.0);
        torn.positions[8].x = far;
        scene.add(torn, white, Transform::IDENTITY);
        let scan = scene.scan(&lidar(&[-45.0, -20.0, 0.0], 36), at(0.0, 2.0, 0.0));
        assert_eq!(scan.len(), sound.len(), "{far}");
        if far.is_nan() || far > 1e15 {
            assert!(scan.range == sound.range, "{far}");
            assert!(far.is_nan() || scene.rays().warnings().left_out == 1, "{far}");
        }
    }
}
