//! Placement by generators.

use super::*;

fn generated(simulation: &mut Simulation, prefix: &str) -> Vec<(String, Transform, MeshId, MaterialId)> {
    let world = &mut simulation.world;
    let mut query = world.query::<(&Name, &Transform, &MeshId, &MaterialId)>();
    let found = query.iter(world).filter(|(name, ..)| name.starts_with(prefix));
    found.map(|(name, transform, mesh, material)| (name.to_string(), *transform, *mesh, *material)).collect()
}

#[test]
fn grids_have_their_counts_and_every_pair_of_alternatives() {
    let scene = r#"(materials: {"a": (), "b": (), "c": (), "d": ()}, meshes: {"x": cube(), "y": sphere()}, generators: [(
        name: "thing", place: grid(counts: (4, 2, 3), spacing: (2, 3, 4), center: (100, 0, 0)),
        entity: (transform: (translation: (0, 1, 0)), mesh: "x"), meshes: ["x", "y"], materials: ["a", "b", "c", "d"],
    )])"#;
    let (mut simulation, _) = load(scene);
    let things = generated(&mut simulation, "thing");
    assert_eq!(things.len(), 24);
    let place = |i: usize| things[i].1.translation;
    assert_eq!(place(0), Vec3::new(97.0, -0.5, -4.0));
    assert_eq!(place(1) - place(0), Vec3::new(2.0, 0.0, 0.0));
    assert_eq!(place(4) - place(0), Vec3::new(0.0, 0.0, 4.0));
    assert_eq!(place(12) - place(0), Vec3::new(0.0, 3.0, 0.0));
    for mesh in [0, 1].map(MeshId::from_slot) {
        for material in [1, 2, 3, 4] {
            let count = things.iter().filter(|t| t.2 == mesh && t.3 == MaterialId::from_slot(material)).count();
            assert_eq!(count, 3, "{mesh:?} with material {material}");
        }
    }
}

#[test]
fn the_seed_alone_decides_what_is_generated() {
    let scene = |seed: u32| {
        format!(
            r#"(seed: {seed}, materials: {{"a": (), "b": ()}}, meshes: {{"x": cube(), "y": sphere()}}, generators: [
            (name: "grid", place: grid(counts: (5, 1, 5), spacing: (3, 3, 3), jitter: (1, 0, 1)), meshes: ["x", "y"],
             materials: ["a", "b"], choose: random, random_yaw: true, random_scale: (0.5, 2)),
            (name: "own", place: scatter(region: box(min: (-1, -2, -3), max: (1, 2, 3)), count: 50),
             entity: (mesh: "x"), seed: 9),
        ])"#
        )
    };
    let things = |seed, name: &str| generated(&mut load(&scene(seed)).0, name);
    let (first, again, other) = (things(1, "grid"), things(1, "grid"), things(2, "grid"));
    assert_eq!(first, again);
    assert!(first != other);
    assert_eq!(things(1, "own"), things(2, "own"), "a seed of its own");
    for (i, (_, at, ..)) in first.iter().enumerate() {
        let cell = Vec3::new((i % 5) as f32, 0.0, (i / 5) as f32) * 3.0 - Vec3::new(6.0, 0.0, 6.0);
        assert!((at.translation - cell).abs().max_element() <= 1.0 && at.translation.y == 0.0);
        assert!((0.5..=2.0).contains(&at.scale.x) && at.scale == Vec3::splat(at.scale.x));
    }
    assert!(first.iter().any(|t| t.1.rotation.y.abs() > 0.5) && first.iter().any(|t| t.2 != first[0].2));
    let inside = |t: &Transform| t.translation.abs().cmple(Vec3::new(1.0, 2.0, 3.0)).all();
    assert!(things(1, "own").iter().all(|t| inside(&t.1)));
    // The same on every platform: SplitMix64's first three numbers from 9, computed by another program.
    let place = things(1, "own")[0].1.translation.to_array().map(f32::to_bits);
    assert_eq!(place, PINNED_PLACE);
}

const PINNED_PLACE: [u32; 3] = [1_052_425_544, 1_065_376_532, 3_216_259_967];

#[test]
fn scattered_things_keep_their_distance_and_say_when_there_is_no_room() {
    let scene = |count: u32| {
        format!(
            "(generators: [(name: \"lamp\", place: scatter(region: disc(center: (5, 1, 0), radius: 4), count: {count},
                min_distance: 1), lights: [point(intensity: 1), point(intensity: 2)])])"
        )
    };
    let (mut simulation, scene_10) = load(&scene(10));
    let lights: Vec<f32> = all::<Light>(&mut simulation.world).iter().map(|l| l.intensity).collect();
    assert_eq!(lights, [1.0, 2.0].repeat(5));
    let mut places = simulation.world.query_filtered::<&Transform, With<Light>>();
    let places: Vec<Vec3> = places.iter(&simulation.world).map(|t| t.translation).collect();
    for (i, a) in places.iter().enumerate() {
        assert!(a.distance(Vec3::new(5.0, 1.0, 0.0)) <= 4.0 && a.y == 1.0);
        assert!(places[..i].iter().all(|b| a.distance(*b) >= 1.0));
    }
    assert!(scene_10.warnings.is_empty());
    let (mut simulation, crowded) = load(&scene(1000));
    let placed = all::<Light>(&mut simulation.world).len();
    assert!((20..64).contains(&placed), "{placed}");
    assert_eq!(crowded.warnings, [format!("lamp: {placed} of 1000 placed: min_distance leaves no room")]);
}
