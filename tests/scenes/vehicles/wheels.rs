//! Wheels of every make: where their hubs are, and what turns.

use super::*;

/// A disc about the X axis.
fn disc(radius: f32) -> Mesh {
    moved(shapes::cylinder(radius, 0.2, 24), Affine3A::from_rotation_z(std::f32::consts::FRAC_PI_2))
}

/// World positions of the vertices of each wheel's tyre, in the order in which these were spawned.
fn tyres(world: &mut World) -> Vec<Vec<Vec3>> {
    let mut drawn = world.query::<(Entity, &MeshId, &MaterialId, &GlobalTransform)>();
    let mut drawn: Vec<_> =
        drawn.iter(world).map(|(entity, &mesh, &material, &at)| (entity, mesh, material, at)).collect();
    drawn.sort_by_key(|(entity, ..)| *entity);
    let library = world.resource::<Library>();
    let is_tyre = |material: MaterialId| library.material(material).is_some_and(|material| material.name == "tyre");
    let vertices = |mesh: MeshId, at: GlobalTransform| {
        let entry = library.mesh(mesh).expect("a mesh");
        entry.mesh.positions.iter().map(|&p| at.transform_point(p)).collect()
    };
    drawn.into_iter().filter(|d| is_tyre(d.2)).map(|(_, mesh, _, at)| vertices(mesh, at)).collect()
}

fn middle(points: &[Vec3]) -> Vec3 {
    let low = points.iter().fold(Vec3::INFINITY, |a, &b| a.min(b));
    (low + points.iter().fold(Vec3::NEG_INFINITY, |a, &b| a.max(b))) / 2.0
}

/// Four wheels of half a metre, as in many models: whatever their nodes are like, they stand on the road, turn about
/// their hubs and steer about them.
#[test]
fn wheels_of_every_make_stand_on_the_road_and_turn_about_their_hubs() {
    let hubs = [("fl", 0.8, 2.0), ("fr", -0.8, 2.0), ("rl", 0.8, 0.0), ("rr", -0.8, 0.0)];
    let turn = |degrees: f32| json!([(degrees.to_radians() / 2.0).sin(), 0.0, 0.0, (degrees.to_radians() / 2.0).cos()]);
    let flat = |nodes: Vec<Value>| Value::Array(nodes);
    let tyre = || vec![disc(0.5)];
    let each = |node: &dyn Fn(&str, f32, f32) -> Value| flat(hubs.iter().map(|&(n, x, z)| node(n, x, z)).collect());
    let at = |x: f32, z: f32| json!([x, 0.5, z]);
    // Hubs as they are in the model; the meshes of wheels whose nodes have their origins elsewhere.
    let baked =
        |by: Vec3| hubs.map(|(_, x, z)| vec![moved(disc(0.5), Affine3A::from_translation(Vec3::new(x, 0.5, z) - by))]);
    let caliper = block(Vec3::new(0.1, 0.2, 0.1), Vec3::new(0.0, 0.3, 0.1));
    let below = |parent: Value, children: Value| {
        let mut nodes = vec![parent];
        nodes.extend(children.as_array().expect("nodes").iter().cloned());
        nodes[0]["children"] = json!([1, 2, 3, 4]);
        Value::Array(nodes)
    };
    let plain = each(&|n, x, z| json!({ "name": n, "mesh": 0, "translation": at(x, z) }));
    let mut makes: Vec<(&str, Vec<Vec<Mesh>>, Value)> = Vec::new();
    for degrees in [0.0, 10.0, 33.0, 45.0] {
        let nodes =
            each(&|n, x, z| json!({ "name": n, "mesh": 0, "translation": at(x, z), "rotation": turn(degrees) }));
        makes.push(("turned about the axle", vec![tyre()], nodes));
    }
    let number = |n: &str| hubs.iter().position(|hub| hub.0 == n);
    let nodes = each(&|n, _, _| json!({ "name": n, "mesh": number(n) }));
    makes.push(("origins at the model's", baked(Vec3::ZERO).to_vec(), nodes));
    let nodes = each(
        &|n, _, _| json!({ "name": n, "mesh": number(n), "translation": [0.1, 0.2, -0.3], "rotation": turn(0.0) }),
    );
    makes.push(("origins beside the hub", baked(Vec3::new(0.1, 0.2, -0.3)).to_vec(), nodes));
    let mirrored = each(
        &|n, x, z| json!({ "name": n, "mesh": 0, "translation": at(x, z), "scale": [x.signum(), 1, 1], "rotation": turn(20.0) }),
    );
    makes.push(("mirrored", vec![tyre()], mirrored));
    let scaled = each(
        &|n, x, z| json!({ "name": n, "mesh": 0, "translation": at(x, z), "scale": [3.0, 2.5, 2.5], "rotation": turn(15.0) }),
    );
    makes.push(("scaled unevenly", vec![vec![disc(0.2)]], scaled));
    let parent = json!({ "scale": [0.01, 0.01, 0.01], "rotation": [0, 1, 0, 0] });
    let small = each(&|n, x, z| json!({ "name": n, "mesh": 0, "translation": [-x * 100.0, 50.0, -z * 100.0] }));
    makes.push(("below a turned parent in centimetres", vec![vec![disc(50.0)]], below(parent, small)));
    let parent = json!({ "scale": [-1, 1, 2] });
    let squeezed =
        each(&|n, x, z| json!({ "name": n, "mesh": 0, "translation": [-x, 0.5, z / 2.0], "scale": [1.0, 1.0, 0.5] }));
    makes.push(("below a mirrored parent of uneven scale", vec![tyre()], below(parent, squeezed)));
    makes.push(("tyre and rim in one mesh", vec![vec![disc(0.5), disc(0.3), caliper.clone()]], plain.clone()));
    // A rim with its tyre below it.
    let nested = flat(
        (0..4)
            .flat_map(|i| {
                let (n, x, z) = hubs[i];
                let tyre = json!({ "name": format!("tyre {n}"), "mesh": 0, "rotation": turn(12.0) });
                [json!({ "name": n, "mesh": 1, "translation": at(x, z), "children": [2 * i + 1] }), tyre]
            })
            .collect(),
    );
    makes.push(("tyre below the rim", vec![tyre(), vec![block(Vec3::ONE * 0.01, Vec3::ZERO), disc(0.3)]], nested));
    for (make, meshes, nodes) in makes {
        let folder = Folder::with_cart();
        folder.file("made.gltf", model(&meshes, nodes));
        let types = r#"(types: { "made": (model: "made.gltf", wheels: [(nodes: ["fl", "fr"], steers: true), (nodes: ["rl", "rr"])]) })"#;
        let (mut simulation, warnings) = folder.types(types);
        assert_eq!(warnings, [] as [String; 0], "{make}");
        let (kind, made) = find(&simulation, "made");
        assert!((made.wheelbase - 2.0).abs() < 1e-3 && (made.track - 1.6).abs() < 1e-3, "{make}: {made:?}");
        let radii: Vec<f32> = made.parts.iter().filter_map(|part| part.movement.map(|_| radius(part))).collect();
        assert!(radii.len() == 4 && radii.iter().all(|r| (r - 0.5).abs() < 1e-3), "{make}: {radii:?}");
        let vehicle = simulation.world.spawn(Vehicle::of(kind)).id();
        simulation.frame();
        let before: Vec<Vec<Vec3>> = tyres(&mut simulation.world).into_iter().filter(|t| t.len() > 40).collect();
        assert_eq!(before.len(), 4, "{make}");
        let mut motion = simulation.world.get_mut::<Motion>(vehicle).expect("moves");
        (motion.rolled, motion.steering) = (0.4, 0.3);
        simulation.frame();
        let after = tyres(&mut simulation.world).into_iter().filter(|t| t.len() > 40);
        for (before, after) in before.into_iter().zip(after) {
            let hub = middle(&before);
            let lowest = before.iter().map(|p| p.y).fold(f32::MAX, f32::min);
            // A corner of the disc is at most half a corner's angle from the lowest place.
            assert!((-1e-3..0.5 * (1.0 - 7.5f32.to_radians().cos()) + 1e-3).contains(&lowest), "{make}: {lowest}");
            let steers = if hub.z > 1.0 { Quat::from_rotation_y(0.3) } else { Quat::IDENTITY };
            let turned = steers * Quat::from_rotation_x(0.4 / 0.5);
            for (&from, to) in before.iter().zip(after) {
                let expected = hub + turned * (from - hub);
                assert!(to.distance(expected) < 3e-3, "{make}: {from} came to {to}, expected {expected}");
            }
        }
    }
}

fn radius(part: &Part) -> f32 {
    match part.movement {
        Some(Movement::Wheel { radius, .. }) => radius,
        _ => 0.0,
    }
}

/// Rim and tyre are nodes beside each other: one wheel, as large as the tyre, that physics counts once.
#[test]
fn nodes_with_one_hub_are_one_wheel() {
    let node =
        |name: &str, mesh: u32, x: f32, z: f32| json!({ "name": name, "mesh": mesh, "translation": [x, 0.5, z] });
    let names = ["fl", "fr", "rl", "rr"];
    let places = [(0.8, 2.0), (-0.8, 2.0), (0.8, 0.0), (-0.8, 0.0)];
    let of = |kind: &str, mesh| {
        names.iter().zip(places).map(|(n, (x, z))| node(&format!("{kind} {n}"), mesh, x, z)).collect::<Vec<_>>()
    };
    let folder = Folder::with_cart();
    let nodes = [of("rim", 0), of("tyre", 1)].concat();
    folder.file("made.gltf", model(&[vec![disc(0.3)], vec![disc(0.5)]], Value::Array(nodes)));
    let wheels = r#"(nodes: ["rim fl", "rim fr", "tyre fl", "tyre fr"], steers: true), (nodes: ["rim rl", "rim rr", "tyre rl", "tyre rr"])"#;
    let (simulation, warnings) =
        folder.types(&format!(r#"(types: {{ "made": (model: "made.gltf", wheels: [{wheels}]) }})"#));
    assert_eq!(warnings, [] as [String; 0]);
    let (_, made) = find(&simulation, "made");
    let wheels = physics::wheels(&made);
    assert_eq!(wheels.iter().map(|wheel| wheel.steers).collect::<Vec<_>>(), [true, true, false, false]);
    assert!(wheels.iter().all(|wheel| (wheel.radius - 0.5).abs() < 1e-5), "{wheels:?}");
    assert!(
        wheels.iter().all(|wheel| (wheel.hub.y - 0.5).abs() < 1e-5 && (wheel.hub.x.abs() - 0.8).abs() < 1e-5),
        "{wheels:?}"
    );
    let drawn = made.parts.iter().filter(|part| part.drawn.is_some());
    assert!(drawn.clone().count() == 8 && drawn.clone().all(|part| part.parent.is_some() && part.movement.is_none()));
}

/// The trailer's node and a fork's are turned and scaled: what turns in them turns about the vehicle's axles.
#[test]
fn wheels_below_moving_parts_turn_about_the_vehicles_axles() {
    let folder = Folder::with_cart();
    let half = (0.4f32 / 2.0).sin_cos();
    let nodes = json!([
        { "name": "trailer", "rotation": [0, 1, 0, 0], "scale": [2, 2, 2], "children": [1] },
        { "name": "tl", "mesh": 1, "translation": [0.4, 0.25, 2.0] },
        // A rake of 23° about X.
        { "name": "fork", "rotation": [half.0, 0, 0, half.1], "translation": [0.0, 0.9, 2.0], "children": [3] },
        { "name": "front", "mesh": 0, "translation": [0, -0.4, 0] },
        { "name": "rear", "mesh": 0, "translation": [0, 0.5, 0] },
    ]);
    folder.file("made.gltf", model(&[vec![disc(0.5)], vec![disc(0.25)]], nodes));
    let (mut simulation, _) = folder.types(
        r#"(types: { "made": (model: "made.gltf", wheels: [(nodes: ["tl", "front", "rear"])], forks: ["fork"], trailer: (node: "trailer", length: 4)) })"#,
    );
    let (kind, _) = find(&simulation, "made");
    let vehicle = simulation.world.spawn(Vehicle::of(kind)).id();
    simulation.frame();
    let before = tyres(&mut simulation.world);
    simulation.world.get_mut::<Motion>(vehicle).expect("moves").rolled = 0.4;
    simulation.frame();
    assert_eq!(before.len(), 3);
    for (before, after) in before.into_iter().zip(tyres(&mut simulation.world)) {
        let hub = middle(&before);
        for (from, to) in before.into_iter().zip(after) {
            let expected = hub + Quat::from_rotation_x(0.4 / 0.5) * (from - hub);
            assert!(to.distance(expected) < 3e-3, "{hub}: {from} came to {to}, expected {expected}");
        }
    }
}

#[test]
fn what_is_no_round_wheel_is_said_with_what_was_measured() {
    let folder = Folder::with_cart();
    let body = || block(Vec3::new(1.8, 1.2, 4.0), Vec3::new(0.0, 1.0, 1.2));
    let wheel = |x: f32, z: f32| moved(disc(0.5), Affine3A::from_translation(Vec3::new(x, 0.5, z)));
    let whole = [(0.8, 0.0), (-0.8, 0.0), (0.8, 2.5), (-0.8, 2.5)].map(|(x, z)| wheel(x, z));
    let sticks_out = vec![disc(0.5), block(Vec3::splat(0.1), Vec3::new(0.0, 0.0, 0.6))];
    let nodes = json!([
        { "name": "car", "mesh": 0 },
        { "name": "square", "mesh": 1, "translation": [0, 0.5, 0] },
        { "name": "empty", "translation": [0, 0.4, 0] },
        { "name": "brake", "mesh": 2, "translation": [0, 0.5, 1] },
    ]);
    let mut car = vec![body()];
    car.extend(whole);
    folder.file("made.gltf", model(&[car, vec![block(Vec3::ONE, Vec3::ZERO)], sticks_out], nodes));
    let of = |wheels: &str| format!(r#"(types: {{ "t": (model: "made.gltf", wheels: [{wheels}]) }})"#);
    let said = |wheels: &str| folder.problems_of(&of(wheels));
    let cases = [
        (
            r#"(nodes: ["car"])"#,
            r#"node "car" is not a wheel and is not turned: its geometry, 1.60 m high and 4.00 m long, is not round about the vehicle's X; a wheel needs a node of its own, separate from the body"#,
        ),
        (r#"(nodes: ["car"], radius: 0.5)"#, r#"node "car" is not a wheel and is not turned"#),
        (
            r#"(nodes: ["square"])"#,
            r#"wheel "square" is not round about the vehicle's X: its outline is 0.50 to 0.71 m from its middle; its radius is half its height, 0.50 m"#,
        ),
        (
            r#"(nodes: ["empty"])"#,
            r#"nothing is drawn at wheel "empty": its radius is its height above the lowest point, 0.40 m; expected a radius"#,
        ),
        (
            r#"(nodes: ["brake"])"#,
            r#"parts that stick out of wheel "brake" turn with it, up to 0.65 m from the axle; the wheel's own radius is 0.50 m"#,
        ),
    ];
    for (wheels, expected) in cases {
        let found = said(wheels);
        let message = format!("vehicle type \"t\": {expected}");
        assert!(found.len() == 1 && found[0].contains(&message), "{found:?} is not {expected}");
        // As a person hears when it is loaded, too.
        let (simulation, warnings) = folder.types(&of(wheels));
        assert!(warnings.len() == 1 && warnings[0].starts_with(&message), "{warnings:?}");
        let turning = find(&simulation, "t").1.parts.iter().filter(|part| part.movement.is_some()).count();
        assert_eq!(turning, usize::from(!wheels.contains("car")), "{wheels}");
    }
    // A radius that is given stays as it is, and nothing more is to be said.
    for (wheel, radius) in [("square", 0.6f32), ("empty", 0.3)] {
        let (simulation, warnings) = folder.types(&of(&format!("(nodes: [{wheel:?}], radius: {radius})")));
        assert_eq!(warnings, [] as [String; 0]);
        let parts = find(&simulation, "t").1.parts;
        assert_eq!(parts.iter().map(self::radius).fold(0.0, f32::max), radius);
    }
}
