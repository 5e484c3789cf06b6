//! Boxes: where things are in pictures, and how much of them is seen.

use super::studio::{BARREL, FISHEYE, K, SIZE, Studio};
use crate::common::prelude::*;

/// Floats of places of some ten metres, 1e-6 of a metre, a metre and more before the camera: 150 pixels times that; and
/// those of edges at hundreds of pixels, 3e-5.
const EDGES: f64 = 2e-4;

fn assert_edges(found: [f32; 4], expected: [f64; 4]) {
    let off = found.iter().zip(expected).map(|(found, expected)| (f64::from(*found) - expected).abs());
    assert!(off.fold(0.0, f64::max) < EDGES, "{found:?} for {expected:?}");
}

#[test]
fn a_box_seen_face_on_is_where_its_nearest_face_is() {
    let Some(mut studio) = Studio::new() else { return };
    // The face at 9.5 is larger in the picture than all behind it.
    let thing = studio.thing(Vec3::new(2.0, 1.0, 1.0), Vec3::new(0.0, 0.0, -10.0));
    let capture = studio.capture();
    let found = studio.box_of(&capture, thing).expect("in the picture");
    let [x, y] = [K.fx * 1.0 / 9.5, K.fy * 0.5 / 9.5];
    // From the corner of the picture, half a pixel from the middle of the first.
    let (cx, cy) = (K.cx + 0.5, K.cy + 0.5);
    let full = [cx - x, cy - y, cx + x, cy + y];
    assert_edges(found.box_full, full);
    // Pixels whose middles are within.
    let first = |edge: f64| (edge - 0.5).ceil();
    assert_eq!(found.box_visible, full.map(first).map(|edge| edge as f32));
    assert_eq!((found.visible, found.truncated, found.class), (1.0, Some(0.0), 26));
    let [left, top, right, bottom] = found.box_visible;
    assert_eq!(found.pixels, ((right - left) * (bottom - top)) as u32);
    // Length, width, height; camera axes.
    assert_eq!((found.size, found.center), ([1.0, 2.0, 1.0], [0.0, 0.0, 10.0]));
    // Its y, up, is down in the picture; its z, towards the camera, is back.
    assert_eq!(found.quaternion.map(f64::abs), [0.0, 1.0, 0.0, 0.0]);
    assert_eq!((found.world_center, found.world_quaternion), ([0.0, 0.0, -10.0], [1.0, 0.0, 0.0, 0.0]));
    // Corners as K has them, half a pixel further.
    let corner = |x: f64, y: f64, z: f64| [(K.fx * x / z + cx) as f32, (-K.fy * y / z + cy) as f32];
    let expected = [(-1.0, -0.5, 10.5), (-1.0, -0.5, 9.5), (-1.0, 0.5, 10.5), (-1.0, 0.5, 9.5)];
    for (found, (x, y, z)) in found.corners_uv.iter().zip(expected) {
        let [u, v] = found.expect("before the camera");
        let [expected_u, expected_v] = corner(x, y, z);
        assert!(
            (u - expected_u).abs() < 1e-3 && (v - expected_v).abs() < 1e-3,
            "{u} {v} for {expected_u} {expected_v}"
        );
    }
    assert_eq!(found.motion, None);
}

#[test]
fn what_a_wall_hides_and_what_is_out_of_the_picture_are_told_apart() {
    let Some(mut studio) = Studio::new() else { return };
    let behind_wall = studio.thing(Vec3::new(2.0, 1.0, 1.0), Vec3::new(0.0, 0.0, -10.0));
    // Hides what is left of the axis.
    let wall = Transform::from_xyz(-2.0, 0.0, -5.0).with_scale(Vec3::new(4.0, 4.0, 0.01));
    let wall = studio.simulation.world.spawn((studio.cube, studio.material, wall)).id();
    // A plate whose middle is on the picture's left edge, and one beyond it.
    let edge = -((K.cx + 0.5) / K.fx) as f32 * 4.0;
    let half_out = studio.thing(Vec3::new(1.0, 1.0, 1e-4), Vec3::new(edge, 1.2, -4.0));
    let out = studio.thing(Vec3::new(1.0, 1.0, 1e-4), Vec3::new(edge - 0.6, -1.2, -4.0));
    let hidden = studio.thing(Vec3::ONE, Vec3::new(-4.0, 0.0, -12.0));
    let capture = studio.capture();
    let found = studio.box_of(&capture, behind_wall).expect("in the picture");
    // A column of pixels, of 33.
    assert!((found.visible - 0.5).abs() <= 1.0 / 31.0, "{}", found.visible);
    assert_eq!(found.truncated, Some(0.0));
    let found = studio.box_of(&capture, half_out).expect("in the picture");
    let truncated = found.truncated.expect("known");
    assert!((truncated - 0.5).abs() < 1e-4, "{truncated}");
    assert_eq!(found.visible, 1.0);
    assert!(found.box_full[0] < 0.0 && found.box_visible[0] == 0.0);
    assert_eq!(studio.box_of(&capture, out), None);
    let found = studio.box_of(&capture, hidden).expect("in the picture");
    assert_eq!((found.visible, found.pixels, found.box_visible), (0.0, 0, [0.0; 4]));
    // It is no thing: it has neither a class nor is it said to be one.
    assert_eq!(studio.box_of(&capture, wall), None);
}

#[test]
fn a_camera_has_no_box_of_what_it_is_on_and_boxes_through_its_plane_are_cut() {
    let Some(mut studio) = Studio::new() else { return };
    let car = studio.thing(Vec3::new(2.0, 1.0, 4.0), Vec3::ZERO);
    *studio.place(car) = Transform::IDENTITY;
    let camera = studio.camera;
    studio.simulation.world.entity_mut(camera).insert(ChildOf(car));
    let long = studio.thing(Vec3::new(1.0, 1.0, 40.0), Vec3::new(1.5, 0.0, 0.0));
    let behind = studio.thing(Vec3::ONE, Vec3::new(0.0, 0.0, 6.0));
    register_all(&mut studio.simulation.world);
    let name = format!("{}/eye", studio.simulation.world.get::<Name>(car).map_or(String::new(), ToString::to_string));
    let capture = studio.suite.capture(&mut studio.simulation).expect("captured");
    let name = capture.sensors.first().map_or(name, |sensor| sensor.name.clone());
    let capture = capture[name.as_str()].camera().expect("a camera");
    assert_eq!(studio.box_of(capture, car), None);
    assert_eq!(studio.box_of(capture, behind), None);
    let found = studio.box_of(capture, long).expect("in the picture");
    // At the near plane, 0.1 m before the eye, it goes to 2 m on the right; its far end is at 20 m.
    let (cx, near) = (K.cx + 0.5, 0.1);
    assert!((f64::from(found.box_full[2]) - (cx + K.fx * 2.0 / near)).abs() < 1.0, "{:?}", found.box_full);
    assert!((f64::from(found.box_full[0]) - (cx + K.fx * 1.0 / 20.0)).abs() < EDGES, "{:?}", found.box_full);
    assert!(found.truncated.expect("known") > 0.9 && found.corners_uv.iter().any(Option::is_none));
}

/// Compares the visible pixels of random things, in parts and blended, with a capture of each thing alone.
#[test]
fn how_much_is_seen_is_what_is_left_of_the_thing_alone() {
    let random = &mut random();
    let mut not_known = 0;
    for lens in [Lens::Pinhole(K), BARREL, FISHEYE].into_iter().flat_map(|lens| [lens; 3]) {
        let Some(mut studio) = Studio::with_lens(lens) else { return };
        let mut library = studio.simulation.world.resource_mut::<Library>();
        let ball = library.add_mesh(shapes::sphere(0.6, 24, 12));
        let glass = Material {
            base_factor: Vec3::ONE.extend(0.7),
            alpha: AlphaMode::Blend,
            shading: Shading::Unlit,
            ..Material::default()
        };
        let glass = library.add_material(glass);
        let mut things = Vec::new();
        for i in 0..24 {
            let mut number = || random.random::<f32>() * 2.0 - 1.0;
            let at = Vec3::new(number() * 4.0, number() * 3.0, -6.0 + 4.0 * number());
            let turned = Quat::from_euler(EulerRot::XYZ, number() * 3.0, number() * 3.0, number() * 3.0);
            let thing = studio.thing(Vec3::ONE, at);
            studio.place(thing).rotation = turned;
            let material = if i % 3 == 0 { glass } else { studio.material };
            studio.simulation.world.spawn((
                ball,
                material,
                Transform::from_xyz(number(), number(), number()),
                ChildOf(thing),
            ));
            things.push(thing);
        }
        let whole = studio.capture();
        let (mut partly, mut many) = (0, 0);
        for thing in things.clone() {
            let Some(found) = studio.box_of(&whole, thing) else { continue };
            let number = found.id;
            let here: Vec<usize> = (0..whole.instance.len()).filter(|&i| whole.instance[i] == number).collect();
            assert_eq!(found.pixels as usize, here.len());
            let columns = here.iter().map(|i| i % SIZE.0 as usize);
            let rows = here.iter().map(|i| i / SIZE.0 as usize);
            if !here.is_empty() {
                let edges = [columns.clone().min(), rows.clone().min(), columns.max(), rows.max()].map(Option::unwrap);
                let expected = [edges[0], edges[1], edges[2] + 1, edges[3] + 1].map(|edge| edge as f32);
                assert_eq!(found.box_visible, expected);
                // Of what is seen nothing is out of the outline, but for how far the rasterizer may move a vertex.
                let [left, top, right, bottom] = found.box_full;
                assert!(expected[0] >= left - 1.0 && expected[1] >= top - 1.0, "{expected:?} {:?}", found.box_full);
                assert!(expected[2] <= right + 1.0 && expected[3] <= bottom + 1.0, "{expected:?} {:?}", found.box_full);
            }
            // Nothing else is drawn.
            for other in things.iter().filter(|other| **other != thing) {
                studio.simulation.world.entity_mut(*other).insert(systems::space::Hidden);
            }
            let alone = studio.capture();
            for other in &things {
                studio.simulation.world.entity_mut(*other).remove::<systems::space::Hidden>();
            }
            let all = alone.instance.iter().filter(|id| **id == number).count();
            let expected = if here.is_empty() { 0.0 } else { here.len() as f32 / all as f32 };
            assert_eq!(found.visible, expected, "{} of {all}", here.len());
            partly += usize::from(found.visible > 0.0 && found.visible < 1.0);
            many += 1;
        }
        assert!(partly > 5 && many > 10, "{partly} of {many}");
        // A pinhole sees all that is before it.
        let is_known = whole.boxes.iter().all(|one| one.truncated.is_some());
        assert!(is_known || lens.has_distortion(), "{lens:?}");
        not_known += usize::from(!is_known);
    }
    assert!(not_known >= 3, "{not_known}");
}

#[test]
fn a_moving_thing_is_where_its_box_is_at_every_step() {
    let Some(mut studio) = Studio::new() else { return };
    let thing = studio.thing(Vec3::new(1.0, 0.6, 0.8), Vec3::new(-3.0, 0.2, -6.0));
    studio.capture();
    let seconds = studio.simulation.world.resource::<Clock>().step_seconds;
    for step in 1..20 {
        let moved = Vec3::new(0.3, 0.01, -0.05);
        let mut place = studio.place(thing);
        place.translation += moved;
        place.rotation = Quat::from_rotation_y(0.02) * place.rotation;
        let capture = studio.next();
        let Some(found) = studio.box_of(&capture, thing) else { panic!("{step}: there is no box") };
        let number = studio.number(thing);
        let [left, top, right, bottom] = found.box_visible.map(|edge| edge as usize);
        let seen = |u: usize, v: usize| capture.instance[v * SIZE.0 as usize + u] == number;
        // The box of the mask and that of the record: their intersection over union is 1.
        let mask: Vec<(usize, usize)> = (0..SIZE.1 as usize)
            .flat_map(|v| (0..SIZE.0 as usize).map(move |u| (u, v)))
            .filter(|(u, v)| seen(*u, *v))
            .collect();
        let columns = mask.iter().map(|(u, _)| *u);
        let rows = mask.iter().map(|(_, v)| *v);
        let around = (columns.clone().min(), rows.clone().min(), columns.max(), rows.max());
        assert_eq!(around, (Some(left), Some(top), Some(right - 1), Some(bottom - 1)), "{step}");
        let motion = found.motion.expect("known");
        let expected = moved.as_dvec3() / seconds;
        // Places are floats: a few of 6 m, over a step.
        let room = 4.0 * 6.0 * f64::from(f32::EPSILON) / seconds;
        let velocity = DVec3::from(motion.velocity.map(f64::from));
        assert!(velocity.abs_diff_eq(expected, room), "{velocity} for {expected}");
        assert!((f64::from(motion.yaw_rate) - 0.02 / seconds).abs() < 1e-4, "{}", motion.yaw_rate);
    }
    // Put elsewhere: 3,000 m/s is no velocity.
    studio.place(thing).translation += Vec3::new(0.0, 0.0, -50.0);
    let capture = studio.next();
    assert_eq!(studio.box_of(&capture, thing).expect("in the picture").motion, None);
}

#[test]
fn a_lens_that_sees_no_pixel_is_refused() {
    let beside = Intrinsics { cx: -4000.0, ..K };
    let lens = Lens::KannalaBrandt { intrinsics: beside, coefficients: [0.0; 4], largest_angle: 0.5 };
    let Some(mut studio) = Studio::with_lens(lens) else { return };
    register_all(&mut studio.simulation.world);
    let refusal = studio.suite.capture(&mut studio.simulation).expect_err("it sees nothing").to_string();
    assert!(refusal.contains("eye") && refusal.contains("sees no pixel"), "{refusal}");
}
