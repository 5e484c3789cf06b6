//! Values of a scene file, in the components that they become.

use super::*;

#[test]
fn an_empty_scene_has_all_defaults_and_a_camera() {
    let (mut simulation, scene) = load("()");
    assert_eq!((scene.name.as_str(), scene.cameras.len(), scene.warnings.len()), ("scene", 1, 0));
    assert_eq!(*simulation.world.resource::<Environment>(), Environment::default());
    assert_eq!(*simulation.world.resource::<Clock>(), Clock::default());
    assert!(all::<Light>(&mut simulation.world).is_empty());
}

#[test]
fn values_reach_their_components() {
    let (mut simulation, scene) = load(
        r##"(
        environment: (ambient: srgb("#fff"), exposure: 2, tone_map: clamp),
        clock: (step_seconds: 0.5, speed: 3, paused: true),
        entities: [
            (name: "a", light: point()),
            (name: "b", light: spot(cutoff_degrees: 30, exponent: 4, range: 9, on: false)),
            (name: "c", light: spot(outer_degrees: 30, ambient: (1, 2, 3), attenuation: (1, 2, 3))),
            (name: "c2", light: point(color: kelvin(2700), attenuation: inverse_square, range: 9)),
            (name: "c3", light: point(temperature_kelvin: 2700, attenuation: inverse_square, range: 9)),
            (name: "d", light: directional(color: (1, 0, 0), intensity: 2)),
            (name: "e", camera: (orthographic_half_height: 3, aspect: 2, near: 1)),
            (name: "f", camera: (fov_y_degrees: 90, far: 50, aspect: 2), transform: (look_at: (5, 0, 0))),
            (name: "g", transform: (rotation_degrees: (0, 90, 0), translation: (1, 2, 3), scale: (1, -2, 3)),
             spin: (axis: (0, 0, 9), degrees_per_second: 180)),
            (name: "h", hidden: true, children: [(name: "i")]),
        ])"##,
    );
    let world = &mut simulation.world;
    let environment = world.resource::<Environment>();
    assert_eq!((environment.ambient, environment.exposure), (Vec3::ONE, 2.0));
    assert_eq!(environment.tone_map, ToneMap::Clamp);
    let clock = world.resource::<Clock>();
    assert_eq!((clock.step_seconds, clock.speed, clock.paused), (0.5, 3.0, true));
    let a = named(world, "a");
    assert_eq!(world.get::<Light>(a), Some(&Light::point(1.0, f32::INFINITY)));
    let light = |world: &mut World, name| {
        let entity = named(world, name);
        world.get::<Light>(entity).expect("a light").clone()
    };
    let b = light(world, "b");
    let classic = LightKind::Spot { outer: 30f32.to_radians(), inner: None, exponent: 4.0 };
    assert_eq!((b.kind, b.range, b.enabled), (classic, 9.0, false));
    let c = light(world, "c");
    let cone = LightKind::Spot { outer: 30f32.to_radians(), inner: Some(24f32.to_radians()), exponent: 0.0 };
    assert_eq!((c.kind, c.ambient, c.attenuation), (cone, Vec3::new(1.0, 2.0, 3.0), Vec3::new(1.0, 2.0, 3.0)));
    let lamp = Light::point(1.0, 9.0).with_kelvin(2700.0).with_attenuation(Light::INVERSE_SQUARE);
    assert_eq!([light(world, "c2"), light(world, "c3")], [lamp.clone(), lamp.clone()]);
    assert_eq!(lamp.attenuation, Vec3::Z, "1 / d²");
    assert_eq!(light(world, "d"), Light::directional(2.0).with_color(Vec3::X));
    let cameras: Vec<&str> = scene.cameras.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(cameras, ["e", "f"]);
    let parallel =
        Camera { projection: Projection::Orthographic { half_height: 3.0, aspect: Some(2.0) }, near: 1.0, far: 1001.0 };
    assert_eq!(world.get::<Camera>(scene.cameras[0].1), Some(&parallel));
    let projection = Projection::Perspective { fov_y: 90f32.to_radians(), aspect: Some(2.0) };
    assert_eq!(world.get::<Camera>(scene.cameras[1].1), Some(&Camera { projection, near: 0.1, far: 50.0 }));
    let looking = world.get::<Transform>(scene.cameras[1].1).expect("placed");
    assert!((looking.rotation * Vec3::NEG_Z).distance(Vec3::X) < 1e-6);
    let g = named(world, "g");
    let at = *world.get::<Transform>(g).expect("placed");
    assert_eq!((at.translation, at.scale), (Vec3::new(1.0, 2.0, 3.0), Vec3::new(1.0, -2.0, 3.0)));
    assert!((at.rotation * Vec3::Z).distance(Vec3::X) < 1e-6);
    let spin = world.get::<Spin>(g).expect("spins");
    assert_eq!((spin.axis, spin.rate, spin.start), (Vec3::Z, std::f32::consts::PI, at.rotation));
    let (h, i) = (named(world, "h"), named(world, "i"));
    assert!(world.entity(h).contains::<Hidden>() && !world.entity(i).contains::<Hidden>());
    simulation.frame();
    let is_hidden = |entity: Entity| simulation.world.entity(entity).contains::<InheritedHidden>();
    assert_eq!([a, h, i].map(is_hidden), [false, true, true]);
}

/// Roll, then pitch, then yaw, as a camera on a tripod is turned.
#[test]
fn angles_are_applied_z_then_x_then_y() {
    let (mut simulation, _) = load("(entities: [(name: \"a\", transform: (rotation_degrees: (20, 30, 40)))])");
    let a = named(&mut simulation.world, "a");
    let [x, y, z] = [20f32, 30.0, 40.0].map(f32::to_radians);
    let expected = Quat::from_rotation_y(y) * Quat::from_rotation_x(x) * Quat::from_rotation_z(z);
    let found = simulation.world.get::<Transform>(a).expect("placed").rotation;
    // An arccosine knows small angles to √(2 · 2⁻²⁴), and half of them are taken.
    assert!(found.angle_between(expected) < 1e-3, "{found}");
}

#[test]
fn materials_and_their_maps_arrive() {
    let textures = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/textures");
    let map = |name: &str| format!("{:?}", textures.join(name).display().to_string());
    let (base, normal, height) = (map("brick_base.jpg"), map("brick_normal.png"), map("brick_height.png"));
    let (simulation, _) = load(&format!(
        "(materials: {{
            \"a\": (base_map: {base}, normal_map: {normal}, height_map: (file: {height}, uv: (set: 1, scale: (2, 3))),
                uv: (offset: (0.5, 0)), sampler: (wrap: clamp, wrap_u: None), shading: blinn,
                technique: perturbed_normal, base_factor: (1, 2, 3), base_alpha: 0.5, height_scale_uv: 0.1),
            \"b\": (base_map: {base}, emissive_map: {base}, specular_map: {base}),
        }})"
    ));
    let library = simulation.library();
    let [a, b] = [1, 2].map(|id| library.material(MaterialId::from_slot(id)).expect("in file order"));
    assert_eq!((a.name.as_str(), a.shading, a.technique), ("a", Shading::Blinn, Technique::PerturbedNormal));
    assert_eq!((a.base_factor, a.height_scale_uv), (glam::Vec4::new(1.0, 2.0, 3.0, 0.5), 0.1));
    let (base_map, height_map) = (a.base_map.expect("has it"), a.height_map.expect("has it"));
    assert_eq!(base_map.image_from_mesh_uv.translation, glam::Vec2::new(0.5, 0.0));
    assert_eq!((base_map.sampler.wrap_u, base_map.sampler.wrap_v), (Wrap::Clamp, Wrap::Clamp));
    assert_eq!((height_map.uv_set, height_map.image_from_mesh_uv.translation), (1, glam::Vec2::ZERO));
    assert_eq!(height_map.image_from_mesh_uv.matrix2.col(1), glam::Vec2::new(0.0, 3.0));
    let kind = |map: systems::assets::Map| library.image(map.image).expect("in the library").kind;
    assert_eq!(kind(base_map), ImageKind::Color);
    assert_eq!(a.normal_map.map(kind), Some(ImageKind::Normal));
    assert_eq!(kind(height_map), ImageKind::Height);
    // Once as colour and once as data, however many materials and fields name it.
    assert_eq!(b.base_map.map(|m| m.image), Some(base_map.image));
    assert_eq!(b.emissive_map.map(|m| m.image), Some(base_map.image));
    assert_eq!(library.images().count(), 5 + 4);
}

#[test]
fn a_technique_brings_its_maps_and_factors_or_a_word_about_them() {
    let textures = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/textures");
    let map = format!("{:?}", textures.join("brick_height.png").display().to_string());
    let (simulation, scene) = load(&format!(
        "(materials: {{
            \"all\": (technique: combined, height_map: {map}, horizon_map_0: {map}, horizon_map_1: {map}, height_rest: 0.5,
                self_shadow: 0.75, emboss_step_texels: 3, offset_map: {map}, offset_matrix: ((1, 2), (3, 4)),
                environment_map: {map}),
            \"plain\": (technique: relief_horizon),
            \"default\": (),
        }})"
    ));
    let library = simulation.library();
    let [all, plain] = [1, 2].map(|id| library.material(MaterialId::from_slot(id)).expect("in file order"));
    assert_eq!((all.height_rest, all.self_shadow, all.emboss_step_texels), (0.5, 0.75, 3.0));
    // Rows in the file, and in what it does.
    assert_eq!(all.offset_matrix * glam::Vec2::X, glam::Vec2::new(1.0, 3.0));
    let kind = |map: Option<systems::assets::Map>| library.image(map.expect("given").image).expect("there").kind;
    assert_eq!([all.horizon_maps[0], all.horizon_maps[1], all.offset_map].map(kind), [ImageKind::Data; 3]);
    assert_eq!(kind(all.environment_map), ImageKind::Color);
    assert_eq!(plain.technique, Technique::ReliefHorizon);
    let word = "material \"plain\": technique relief_horizon has no effect without height_map and horizon_map_0 and horizon_map_1";
    assert_eq!(scene.warnings, [word]);
}

#[test]
fn maps_that_are_hardly_what_they_should_be_are_told() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let write = |name: &str, side: u32, texel: fn(u32) -> [u8; 3]| {
        image::RgbImage::from_fn(side, side, |x, _| image::Rgb(texel(x)))
            .save(folder.path().join(name))
            .expect("saved");
    };
    write("colour.png", 4, |x| [x as u8 * 60, 10, 200]);
    write("grey.png", 4, |x| [x as u8 * 60; 3]);
    write("small.png", 2, |_| [0; 3]);
    let path = folder.path().join("s.ron");
    let load = |material: &str| {
        std::fs::write(&path, format!("(materials: {{ \"m\": ({material}) }})")).expect("written");
        scene::load(&path, &mut Simulation::new())
    };
    let words = |material: &str| load(material).map(|scene| scene.warnings).expect("a scene");
    assert_eq!(words("height_map: \"grey.png\", normal_map: \"colour.png\""), Vec::<String>::new());
    assert_eq!(words("height_map: \"colour.png\"").len(), 1);
    assert_eq!(words("normal_map: \"grey.png\"").len(), 1);
    let unlike =
        load("horizon_map_0: \"grey.png\", horizon_map_1: \"small.png\"").expect_err("of two sizes").to_string();
    assert!(unlike.contains("expected 4×4 texels, as horizon_map_0 has, found 2×2"), "{unlike}");
    let alone = load("horizon_map_1: \"grey.png\"").expect_err("one of two").to_string();
    assert!(alone.contains("missing horizon_map_0"), "{alone}");
}

#[test]
fn lights_are_chosen_as_the_scene_says_or_an_entity() {
    let policies = |text| *load(text).0.world.resource::<LightPolicies>();
    assert_eq!(policies("()"), LightPolicies::default());
    assert_eq!(policies("(lights: (policy: three))"), LightPolicies::same(LightPolicy::Three));
    assert_eq!(policies("(lights: (tolerance: 0.02))"), LightPolicies::same(LightPolicy::Enough(0.02)));
    assert_eq!(policies("(lights: ())"), LightPolicies::same(LightPolicy::ENOUGH));
    let (mut simulation, _) = load(
        r#"(
        meshes: { "road": plane(size: (2, 40)), "box": cube() },
        entities: [
            (name: "road", mesh: "road", lights: (policy: hard), children: [(name: "beside", mesh: "box")]),
            (light: point()), (light: point()), (light: point()), (light: point()),
        ],
        generators: [(place: grid(counts: (2, 1, 1), spacing: (2, 1, 2)), entity: (mesh: "box", lights: (policy: all)))],
        )"#,
    );
    simulation.frame();
    let world = &mut simulation.world;
    let own = all::<LightPolicy>(world);
    let count = |policy| own.iter().filter(|own| **own == policy).count();
    let road = named(world, "road");
    let pieces = world.get::<systems::draw::pieces::Pieces>(road).expect("it is long").len();
    assert!(pieces > 3);
    assert_eq!(
        (count(LightPolicy::Hard), count(LightPolicy::All)),
        (1 + pieces, 2),
        "what is beside the road has none"
    );
    // Pieces follow their object.
    world.entity_mut(road).insert(LightPolicy::Three);
    world.flush();
    assert_eq!(all::<LightPolicy>(world).iter().filter(|own| **own == LightPolicy::Three).count(), 1 + pieces);
    world.entity_mut(road).remove::<LightPolicy>();
    world.flush();
    assert_eq!(all::<LightPolicy>(world).len(), 2);
}

#[test]
fn lights_and_objects_cast_shadows_as_the_scene_says() {
    let folder = Folder::with_model();
    // Both of its parts are of glass, and one node shines.
    let lit = MODEL
        .replace(
            "\"scene\": 0",
            "\"extensionsUsed\": [\"KHR_lights_punctual\"], \"scene\": 0, \"extensions\": {\"KHR_lights_punctual\": \
             {\"lights\": [{\"type\": \"point\"}]}}, \"materials\": [{\"name\": \"glass\"}]",
        )
        .replace("\"indices\": 1}", "\"indices\": 1, \"material\": 0}")
        .replace("\"name\": \"lamp\"", "\"name\": \"lamp\", \"extensions\": {\"KHR_lights_punctual\": {\"light\": 0}}");
    folder.file("lit.gltf", lit);
    let (mut simulation, scene) = folder.load(
        r#"(
        meshes: {
            "road": plane(size: (2, 40)), "box": cube(), "model": model(file: "model.gltf"),
            "lit": model(file: "lit.gltf", shadows: true, casts_no_shadow: ["glass"]),
            "dark": model(file: "lit.gltf"),
        },
        entities: [
            (name: "road", mesh: "road", casts_shadows: false, children: [(name: "beside", mesh: "box")]),
            (name: "model", mesh: "model", casts_shadows: false),
            (name: "plain", mesh: "model", casts_shadows: true),
            (name: "bulb", mesh: "box", casts_shadows: false, light: point(range: 5, shadows: true, shadow_near: 0.2)),
            (name: "sun", light: directional(shadows: true)),
            (name: "wide", light: directional(angle_degrees: 20)),
            (name: "spot", light: spot(range: 5, outer_degrees: 30, shadows: true, radius: 0.25)),
            (name: "none", light: spot(outer_degrees: 30)),
            (name: "lit", mesh: "lit"), (name: "dark", mesh: "dark"),
        ],
        generators: [(place: grid(counts: (2, 1, 1), spacing: (2, 1, 2)), entity: (mesh: "box", casts_shadows: false))],
        )"#,
    );
    // The model's light has no range.
    let expected =
        "lamp casts shadows and has no range: whatever is in the scene is drawn for its shadows; set `range`";
    assert_eq!(scene.warnings, [expected]);
    let world = &mut simulation.world;
    let light = |world: &mut World, name: &str| {
        let entity = named(world, name);
        let light = world.get::<Light>(entity).expect("a light");
        (light.shadows, light.shadow_near, light.radius, (light.angle.to_degrees() * 100.0).round() / 100.0)
    };
    assert_eq!(light(world, "bulb"), (true, 0.2, 0.0, 0.0));
    assert_eq!(light(world, "spot"), (true, 0.05, 0.25, 0.0));
    assert_eq!(light(world, "none"), (false, 0.05, 0.0, 0.0));
    // The sun's disc, if nothing else is said.
    assert_eq!(light(world, "sun"), (true, 0.05, 0.0, 0.53));
    assert_eq!(light(world, "wide"), (false, 0.05, 0.0, 20.0));
    let road = named(world, "road");
    let pieces = world.get::<systems::draw::pieces::Pieces>(road).expect("it is long").len();
    assert!(pieces > 3);
    let shine: Vec<bool> = all::<Light>(world).iter().filter(|l| l.range.is_infinite()).map(|l| l.shadows).collect();
    assert_eq!(shine.iter().filter(|shadows| **shadows).count(), 2, "the sun, one model's, not the other's: {shine:?}");
    let mut marked = world.query_filtered::<(), (With<NoShadow>, With<MeshId>)>();
    // The road's pieces, two models' two parts, the bulb, the generator's.
    assert_eq!(marked.iter(world).count(), pieces + 2 + 2 + 1 + 2);
    let beside = named(world, "beside");
    assert!(!world.entity(beside).contains::<NoShadow>(), "what is beside the road casts one");
    // Pieces follow their object.
    world.entity_mut(road).remove::<NoShadow>();
    world.flush();
    assert_eq!(marked.iter(world).count(), 2 + 2 + 1 + 2);
    world.entity_mut(road).insert(NoShadow);
    world.flush();
    assert_eq!(marked.iter(world).count(), pieces + 2 + 2 + 1 + 2);
}

#[test]
fn sensors_that_will_give_nothing_are_told() {
    let sensor = "(name: \"eye\", sensor: camera(outputs: [class, panoptic, boxes]))";
    let told = |others: &str| {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let scene = folder.path().join("scene.ron");
        let text = format!("(meshes: {{ \"box\": cube() }}, entities: [{sensor}, {others}])");
        std::fs::write(&scene, text).expect("written");
        relief::scene::check(&scene, systems::Simulation::new).iter().map(ToString::to_string).collect::<Vec<_>>()
    };
    let plain = told("(mesh: \"box\")");
    assert_eq!(plain.len(), 3, "{plain:?}");
    assert!(plain[0].contains("sensor \"eye\": class: nothing in the scene has a class"), "{plain:?}");
    assert!(plain[2].contains("sensor \"eye\": boxes: there will be none"), "{plain:?}");
    assert_eq!(told("(mesh: \"box\", class: \"road\")").len(), 1);
    assert_eq!(told("(mesh: \"box\", class: \"car\")"), [""; 0]);
    assert_eq!(told("(mesh: \"box\", class: \"road\", instance: true)"), [""; 0]);
}
