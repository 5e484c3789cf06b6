//! Objects in rooms, of which windows show some.

use super::*;

/// Rooms of 4 m in a row and in rows, some with doors between them and windows, with faces of their walls and things in
/// them. No lights: what is drawn is what is seen.
fn building(random: &mut TestRng) -> (Scene, Cells) {
    let mut scene = Scene::new();
    // Of which cells keep some out.
    scene.simulation.world.despawn(scene.light);
    let (columns, rows) = (2 + (unit(random) * 3.0) as u32, 1 + (unit(random) * 3.0) as u32);
    let number = |column: u32, row: u32| row * columns + column + 1;
    let (mut cells, mut openings) = (Vec::new(), Vec::new());
    let face = |scene: &mut Scene, min: Vec3, max: Vec3| {
        let material = if (min.x + min.z) as i32 % 2 == 0 { 0 } else { 1 };
        let place = Transform { scale: max - min, ..Transform::from_translation((min + max) * 0.5) };
        scene.spawn(0, material, place);
    };
    let mut doors = std::collections::BTreeMap::new();
    for row in 0..rows {
        for column in 0..columns {
            let min = Vec3::new(column as f32 * 4.0, 0.0, row as f32 * 4.0);
            cells.push(Cell::new_box("", Aabb { min, max: min + Vec3::new(4.0, 3.0, 4.0) }));
            face(&mut scene, min + Vec3::new(0.06, 0.06, 0.06), min + Vec3::new(3.94, 0.1, 3.94));
            face(&mut scene, min + Vec3::new(0.06, 2.9, 0.06), min + Vec3::new(3.94, 2.94, 3.94));
            for (across_x, far) in [(true, false), (true, true), (false, false), (false, true)] {
                let edge = if across_x { column } else { row } + u32::from(far);
                let has = *doors.entry((across_x, edge, if across_x { row } else { column })).or_insert_with(|| {
                    let last = if across_x { columns } else { rows };
                    let beyond = |edge: Option<u32>| match edge.filter(|&edge| edge < last) {
                        Some(edge) if across_x => number(edge, row),
                        Some(edge) => number(column, edge),
                        None => OUTSIDE,
                    };
                    let has = unit(random) < 0.6;
                    if has {
                        let at = edge as f32 * 4.0;
                        let corner = |(along, y): (f32, f32)| {
                            if across_x { Vec3::new(at, y, min.z + along) } else { Vec3::new(min.x + along, y, at) }
                        };
                        let polygon = [(1.5, 0.1), (2.5, 0.1), (2.5, 2.1), (1.5, 2.1)].map(corner).to_vec();
                        let between = [beyond(edge.checked_sub(1)), beyond(Some(edge))];
                        openings.push(Opening { between, polygon, portal: None });
                    }
                    has
                });
                let mut part = |thin: [f32; 2], along: [f32; 2], y: [f32; 2]| {
                    let at = |i: usize| {
                        let v = if across_x { [thin[i], y[i], along[i]] } else { [along[i], y[i], thin[i]] };
                        min + Vec3::from(v)
                    };
                    face(&mut scene, at(0), at(1));
                };
                let inner = if far { [3.9, 3.94] } else { [0.06, 0.1] };
                let outer = if far { [4.06, 4.1] } else { [-0.1, -0.06] };
                let is_last = edge == 0 || edge == if across_x { columns } else { rows };
                let faces = [(inner, 0.06, [0.06, 2.94]), (outer, -0.1, [-0.1, 3.1])];
                for (thin, end, [low, high]) in faces.into_iter().take(if is_last { 2 } else { 1 }) {
                    if has {
                        part(thin, [end, 1.5], [low, high]);
                        part(thin, [2.5, 4.0 - end], [low, high]);
                        part(thin, [1.5, 2.5], [2.1, high]);
                        part(thin, [1.5, 2.5], [low, 0.1]);
                    } else {
                        part(thin, [end, 4.0 - end], [low, high]);
                    }
                }
            }
            for _ in 0..12 {
                let at = Vec3::new(0.5 + 3.0 * unit(random), 0.4 + 2.0 * unit(random), 0.5 + 3.0 * unit(random));
                let turn = Quat::from_rotation_y(unit(random) * 6.0);
                let size = Vec3::splat(0.1 + 0.4 * unit(random));
                let mesh = (unit(random) * 3.0) as usize;
                let place = Transform::from_translation(min + at).with_rotation(turn).with_scale(size);
                scene.spawn(mesh, (unit(random) * 4.0) as usize, place);
            }
        }
    }
    let extent = Vec3::new(columns as f32 * 4.0, 0.0, rows as f32 * 4.0) + Vec3::new(0.1, 0.0, 0.1);
    for y in [-0.1, 3.06] {
        face(&mut scene, Vec3::new(-0.1, y, -0.1), extent + Vec3::Y * (y + 0.04));
    }
    // The wall's cavities are closed at doors, by frames that go through it.
    for opening in &openings {
        let (low, high) = opening.polygon.iter().fold((Vec3::MAX, Vec3::MIN), |(a, b), p| (a.min(*p), b.max(*p)));
        let across = if high.x == low.x { Vec3::X } else { Vec3::Z } * 0.1;
        let along = if high.x == low.x { Vec3::Z } else { Vec3::X };
        face(&mut scene, low - across - along * 0.05, Vec3::new(low.x, high.y, low.z) + across);
        face(&mut scene, Vec3::new(high.x, low.y, high.z) - across, high + across + along * 0.05);
        face(&mut scene, Vec3::new(low.x, high.y, low.z) - across, high + across + Vec3::Y * 0.05);
        face(&mut scene, low - across - Vec3::Y * 0.05, Vec3::new(high.x, low.y, high.z) + across);
    }
    for _ in 0..20 {
        let at = Vec3::new(unit(random) * 30.0 - 8.0, unit(random) * 4.0, -6.0 * unit(random) - 1.0);
        scene.spawn(1, 0, Transform::from_translation(at));
    }
    (scene, Cells::new(cells, openings))
}

/// Objects that no window shows are not drawn, and no pixel misses them: from rooms, from doorways, from outside.
#[test]
fn rooms_look_the_same_if_only_what_windows_show_is_drawn() {
    let Some(mut renderer) = renderer() else { return };
    let mut random = random();
    let (mut drawn, mut without) = (0, 0);
    // SwiftShader rounds vertices to sixteenths of a pixel and extends depths from there: a face that is seen edge-on
    // may come before the wall that hides it, in a sample beside the edge. No more than an edge is long.
    let allowed = if renderer.gpu().vertex_rounding() > 1.0 / 128.0 { SIZE.1 as usize } else { 0 };
    for _ in 0..12 {
        let (mut scene, cells) = building(&mut random);
        scene.simulation.frame();
        for eye in 0..12 {
            let extent = cells.bounds().max + Vec3::new(8.0, 1.0, 8.0);
            let mut at =
                Vec3::new(unit(&mut random), unit(&mut random), unit(&mut random)) * extent - Vec3::new(4.0, 0.0, 4.0);
            if let (1, Some(opening)) = (eye % 4, cells.openings().get(eye)) {
                at = opening.polygon.iter().sum::<Vec3>() / opening.polygon.len() as f32;
            }
            if eye % 4 > 1 {
                // In a room, and not in its walls.
                let room = cells.cells()[eye % cells.cells().len()].aabb();
                at = room.min + Vec3::new(0.5 + 3.0 * unit(&mut random), 1.5, 0.5 + 3.0 * unit(&mut random));
            }
            let turn = Quat::from_rotation_y(unit(&mut random) * 6.3) * Quat::from_rotation_x(unit(&mut random) - 0.5);
            scene.look(Transform::from_translation(at).with_rotation(turn));
            scene.simulation.world.insert_resource(Cells::default());
            scene.simulation.frame();
            let (expected, all) = scene.draw(&mut renderer, Occlusion::Off);
            scene.simulation.world.insert_resource(cells.clone());
            scene.simulation.frame();
            for occlusion in [Occlusion::Off, Occlusion::On] {
                let (found, few) = scene.draw(&mut renderer, occlusion);
                let differing = found.pixels().zip(expected.pixels()).filter(|(a, b)| a != b).count();
                assert!(differing <= allowed, "from {at}: {differing} pixels");
                if occlusion == Occlusion::Off {
                    (drawn, without) = (drawn + few.objects, without + all.objects);
                }
            }
        }
    }
    assert!(drawn * 10 < without * 9, "{drawn} of {without}");
}
