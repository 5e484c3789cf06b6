//! Optical flow: where what pixels show is at another capture.

use super::studio::{K, SIZE, Studio};
use crate::common::prelude::*;
use glam::{DAffine3, DMat3};
use relief::sense::{Flow, flags};
use systems::space::Interpolated;

/// A plane before the camera that fills the picture, its front toward it, at a distance.
fn backdrop(studio: &mut Studio, distance: f32) -> Entity {
    let plane =
        studio.simulation.world.resource_mut::<Library>().add_mesh(shapes::plane(Vec2::splat(60.0), UVec2::ONE));
    let upright = Quat::from_rotation_x(std::f32::consts::FRAC_PI_2);
    let at = Transform::from_xyz(0.0, 0.0, -distance).with_rotation(upright);
    studio.simulation.world.spawn((plane, studio.material, at)).id()
}

/// Pixels with their flow and flags.
fn pixels(flow: &Flow) -> impl Iterator<Item = (DVec2, DVec2, u8)> + '_ {
    let place = |i: usize| DVec2::new((i % SIZE.0 as usize) as f64, (i / SIZE.0 as usize) as f64);
    let all = flow.pixels.iter().zip(&flow.flags).enumerate();
    all.map(move |(i, ([u, v], flags))| (place(i), DVec2::new((*u).into(), (*v).into()), *flags))
}

/// Depths are exact to 1e-5 of themselves; a place moves over the picture by no more than that of its distance from
/// where the camera goes, some hundred pixels.
const SHIFT: f64 = 3e-3;

#[test]
fn flow_of_a_plane_is_that_of_its_equation() {
    let (distance, sideways, forward) = (5.0, 0.2, 0.5);
    let Some(mut studio) = Studio::new() else { return };
    backdrop(&mut studio, distance as f32);
    let first = studio.capture();
    assert!(first.flow.flags.is_empty() && first.flow_back.flags.is_empty(), "there was no capture before");
    let camera = studio.camera;
    studio.place(camera).translation.x += sideways as f32;
    let found = studio.next();
    for (at, flow, flags) in pixels(&found.flow) {
        let expected = DVec2::new(-K.fx * sideways / distance, 0.0);
        assert!(flow.abs_diff_eq(expected, SHIFT), "{at}: {flow} for {expected}");
        let there = at + expected;
        let is_inside = there.x > -0.5 && there.x < f64::from(SIZE.0) - 0.5;
        assert_eq!(flags, flags::VALID | if is_inside { flags::INSIDE | flags::SEEN } else { 0 }, "{at}");
    }
    for (at, flow, _) in pixels(&found.flow_back) {
        assert!(flow.abs_diff_eq(DVec2::new(K.fx * sideways / distance, 0.0), SHIFT), "{at}: {flow}");
    }
    studio.place(camera).translation.z -= forward as f32;
    let found = studio.next();
    for (at, flow, _) in pixels(&found.flow) {
        let expected = (at - DVec2::new(K.cx, K.cy)) * forward / (distance - forward);
        assert!(flow.abs_diff_eq(expected, SHIFT), "{at}: {flow} for {expected}");
    }
}

#[test]
fn a_camera_that_turns_moves_everything_by_a_homography_the_sky_too() {
    let Some(mut studio) = Studio::new() else { return };
    // Below the horizon.
    let plane = backdrop(&mut studio, 5.0);
    *studio.place(plane) = Transform::from_xyz(0.0, -1.0, -15.0);
    let first = studio.capture();
    let camera = studio.camera;
    let turn = Quat::from_euler(EulerRot::YXZ, 0.05, 0.02, 0.03);
    studio.place(camera).rotation = turn;
    let found = studio.next();
    // From the old camera's axes to the new one's; y down, z forward.
    let flip = DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));
    let homography = K.matrix() * flip * DMat3::from_quat(turn.as_dquat().inverse()) * flip * K.matrix().inverse();
    let mut sky = 0;
    for ((at, flow, flags), part) in pixels(&found.flow).zip(&first.part) {
        let there = homography * at.extend(1.0);
        let expected = there.truncate() / there.z - at;
        // Rotations of floats: 1e-7, of a few hundred pixels; depths do not matter, but along the axis.
        assert!(flow.abs_diff_eq(expected, 1e-3), "{at}: {flow} for {expected}");
        assert_eq!(flags & flags::SKY != 0, *part == 0, "{at}");
        sky += u32::from(*part == 0);
    }
    assert!(sky > 2000 && sky < SIZE.0 * SIZE.1 - 2000, "{sky}");
}

#[test]
fn what_moves_under_a_camera_at_rest_moves_alone() {
    let Some(mut studio) = Studio::new() else { return };
    backdrop(&mut studio, 12.0);
    let thing = studio.thing(Vec3::new(1.0, 1.0, 1e-4), Vec3::new(-1.0, 0.0, -6.0));
    let first = studio.capture();
    studio.place(thing).translation += Vec3::new(0.4, 0.2, 0.0);
    let found = studio.next();
    let number = studio.number(thing);
    let moved = DVec2::new(K.fx * 0.4, -K.fy * 0.2) / 6.0;
    for ((at, flow, flags), part) in pixels(&found.flow).zip(&first.part) {
        let (expected, room) = if *part == number { (moved, SHIFT) } else { (DVec2::ZERO, 1e-9) };
        assert!(flow.abs_diff_eq(expected, room), "{at}: {flow} for {expected}");
        // What the thing covers next is still there, but is not seen.
        let there = (at.y * f64::from(SIZE.0) + at.x) as usize;
        let is_covered = *part != number && found.part[there] == number;
        assert!(!is_covered || flags & flags::SEEN == 0, "{at} is covered");
    }
    // There and back again, for what is seen in both.
    let mut both = 0;
    for (at, flow, flags) in pixels(&found.flow).filter(|(_, _, flags)| flags & flags::SEEN != 0) {
        let there = (at + flow).round();
        let place = there.y as usize * SIZE.0 as usize + there.x as usize;
        let [u, v] = found.flow_back.pixels[place].map(f64::from);
        assert!((flow + DVec2::new(u, v)).length() < 0.02, "{at}: {flow}, and back by {u} {v}, {flags}");
        both += 1;
    }
    assert!(both > 10_000, "{both}");
    // What is gone leads nowhere.
    studio.simulation.world.despawn(thing);
    let next = studio.next();
    assert!(
        pixels(&next.flow)
            .zip(&found.part)
            .all(|((_, flow, flags), part)| *part != number || (flow, flags) == (DVec2::ZERO, 0))
    );
}

#[test]
fn what_jumps_has_neither_flow_nor_velocity_and_a_camera_that_does_sees_none() {
    let Some(mut studio) = Studio::new() else { return };
    backdrop(&mut studio, 12.0);
    let thing = studio.thing(Vec3::new(1.0, 1.0, 1.0), Vec3::new(-1.0, 0.0, -6.0));
    let camera = studio.camera;
    for entity in [thing, camera] {
        studio.simulation.world.entity_mut(entity).insert(Interpolated::default());
    }
    let jump = |studio: &mut Studio, entity| {
        studio.simulation.world.get_mut::<Interpolated>(entity).expect("moves").jump();
    };
    let first = studio.capture();
    let number = studio.number(thing);
    // By 2.4 m/s, which it might have moved at.
    studio.place(thing).translation.x += 0.04;
    jump(&mut studio, thing);
    let found = studio.next();
    let mut own = 0;
    for ((at, flow, flags), part) in pixels(&found.flow).zip(&first.part) {
        own += u32::from(*part == number);
        let is_known = flags & flags::VALID != 0;
        assert!(is_known != (*part == number) && (is_known || flow == DVec2::ZERO), "{at}: {flow}, {flags}");
    }
    assert!(own > 100, "{own}");
    assert!(studio.box_of(&found, thing).is_some_and(|thing| thing.motion.is_none()));
    studio.place(thing).translation.x += 0.04;
    let found = studio.next();
    let motion = studio.box_of(&found, thing).expect("seen").motion.expect("it moved");
    // Places of 32 bits, some metres: 5e-7 m, by 1/60 s.
    assert!((motion.velocity[0] - 2.4).abs() < 6e-5, "{motion:?}");
    jump(&mut studio, camera);
    let found = studio.next();
    for flow in [&found.flow, &found.flow_back] {
        assert!(pixels(flow).all(|(_, flow, flags)| (flow, flags) == (DVec2::ZERO, 0)));
        assert_eq!(flow.flags.len(), (SIZE.0 * SIZE.1) as usize);
    }
    assert!(studio.box_of(&found, thing).is_some_and(|thing| thing.motion.is_some()));
}

/// Everything moves: against places taken from the world, depth and K.
#[test]
fn flow_of_random_scenes_is_that_of_rigid_bodies() {
    let random = &mut random();
    for _ in 0..20 {
        let Some(mut studio) = Studio::new() else { return };
        let mut number = || random.random::<f32>() * 2.0 - 1.0;
        let mut things = Vec::new();
        for _ in 0..12 {
            let thing = studio
                .thing(Vec3::new(1.0, 0.7, 1.4), Vec3::new(number() * 3.0, number() * 2.0, -7.0 + 3.0 * number()));
            things.push(thing);
        }
        let places = |studio: &Studio| -> BTreeMap<u32, DAffine3> {
            let world = &studio.simulation.world;
            let place = |entity: Entity| {
                let affine = world.get::<GlobalTransform>(entity).expect("lives").affine();
                DAffine3 { matrix3: affine.matrix3.as_dmat3(), translation: affine.translation.as_dvec3() }
            };
            let all = things.iter().map(|thing| (studio.number(*thing), place(*thing)));
            all.chain([(0, place(studio.camera))]).collect()
        };
        let first = studio.capture();
        let before = places(&studio);
        for thing in things.iter().copied().chain([studio.camera]) {
            let mut place = studio.place(thing);
            place.translation += Vec3::new(number(), number(), number()) * 0.2;
            place.rotation *= Quat::from_euler(EulerRot::XYZ, number() * 0.1, number() * 0.1, number() * 0.1);
        }
        let found = studio.next();
        let after = places(&studio);
        let flip = DAffine3::from_scale(DVec3::new(1.0, -1.0, -1.0));
        let cameras = [&before, &after].map(|places| places[&0] * flip);
        let mut compared = 0;
        for (i, (at, flow, flags)) in pixels(&found.flow).enumerate().filter(|(i, _)| first.part[*i] != 0) {
            let part = first.part[i];
            let camera = K.matrix().inverse() * at.extend(1.0) * f64::from(first.depth[i]);
            let object = before[&part].inverse().transform_point3(cameras[0].transform_point3(camera));
            let there = cameras[1].inverse().transform_point3(after[&part].transform_point3(object));
            if there.z < 0.5 {
                continue;
            }
            let expected = (K.matrix() * there / there.z).truncate() - at;
            // Places are floats of some ten metres: 1e-6 of a metre, of 150 pixels.
            assert!(flow.abs_diff_eq(expected, 1e-3), "{at}: {flow} for {expected}");
            assert!(flags & flags::VALID != 0);
            compared += 1;
        }
        assert!(compared > 1000, "{compared}");
    }
}
