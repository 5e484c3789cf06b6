//! Places in 64 bits: what counts from where, and what is far from it.

use super::*;

/// A scene with everything that has places, moved by that much.
fn on_a_map(x: f64, z: f64) -> String {
    let at = |dx: f64, y: f64, dz: f64| format!("({}, {y}, {})", decimal(x, dx), decimal(z, dz));
    format!(
        r#"(
    meshes: {{ "cube": cube(), "land": plane(size: (300, 300)) }},
    routes: {{
        "r": (points: [{}, {}, {}], shape: spline, then: ["s"]),
        "s": (points: [{}, {}], then: ["s"]),
    }},
    entities: [
        (light: directional(), transform: (look_at: (1, -2, 0.5))),
        (mesh: "land", ground: true, transform: (translation: {})),
        (name: "cube", mesh: "cube", transform: (translation: {}, look_at: {}),
            children: [(mesh: "cube", transform: (translation: (0, 1.1, 0)))]),
        (vehicle: (type: "box", route: "r", at: 5.3, speed_kmh: 30)),
        (vehicle: (type: "box", route: "r", at: 40, physical: ())),
        (vehicle: (type: "box", manual: true, speed_kmh: 9), transform: (translation: {})),
        (name: "eye", camera: (), transform: (translation: {}, look_at: {})),
    ],
    generators: [
        (place: grid(counts: (3, 1, 3), spacing: (2, 0, 2), center: {}, jitter: (0.3, 0, 0.3)), meshes: ["cube"]),
        (place: scatter(region: disc(center: {}, radius: 9), count: 9), meshes: ["cube"]),
        (place: scatter(region: box(min: {}, max: {}), count: 9), meshes: ["cube"]),
        (place: along(routes: ["r"], spacing: 20, beside: 4), meshes: ["cube"]),
    ],
)"#,
        at(0.0, 0.0, 0.0),
        at(12.3, 0.0, 60.7),
        at(-3.1, 0.0, 120.003),
        at(-3.1, 0.0, 120.003),
        at(-3.1, 0.0, 240.1),
        at(0.0, 0.0, 100.0),
        at(-4.7, 1.25, 0.1),
        at(0.001, 0.3, 77.7),
        at(20.2, 0.1, 30.4),
        at(-14.6, 9.0, -11.9),
        at(0.0, 0.0, 20.0),
        at(40.9, 0.5, 7.7),
        at(-40.9, 0.5, 7.7),
        at(30.1, 1.0, 60.6),
        at(39.9, 2.0, 71.3),
    )
}

/// The sum of a whole number and one of three decimals, as one would write it.
fn decimal(whole: f64, part: f64) -> f64 {
    let thousandths = (whole as i64) * 1000 + (part * 1e3).round() as i64;
    format!("{thousandths}e-3").parse().expect("a number")
}

/// All places that are kept, of what is drawn, what drives and what looks.
fn places(simulation: &mut Simulation) -> Vec<[u32; 10]> {
    let mut all = simulation.world.query::<&Transform>();
    let bits = |at: &Transform| {
        let mut bits = [0; 10];
        let values = at.translation.to_array().into_iter().chain(at.rotation.to_array()).chain(at.scale.to_array());
        bits.iter_mut().zip(values).for_each(|(bits, value)| *bits = value.to_bits());
        bits
    };
    all.iter(&simulation.world).map(bits).collect()
}

#[test]
fn a_scene_on_a_map_is_the_same_scene_at_zero_to_the_bit() {
    let (mut here, scene) = load(&on_a_map(0.0, 0.0));
    assert_eq!(scene.warnings, Vec::<String>::new());
    for (x, z, explicit) in [(5e5, 5e6, false), (512e3, -5403e3, false), (-9_990_017.0, 123_456.0, true)] {
        let text = on_a_map(x, z);
        let text = if explicit { text.replacen('(', &format!("(origin: ({x}, 0, {z}),"), 1) } else { text };
        let (mut there, scene) = load(&text);
        assert_eq!(there.world.resource::<Origin>().0, glam::DVec3::new(x, 0.0, z));
        match &scene.warnings[..] {
            [] if explicit => {}
            [one] if !explicit => assert!(one.contains(&format!("origin: ({x}, 0, {z})")), "{one}"),
            warnings => panic!("{warnings:?}"),
        }
        let (mut at_zero, _) = load(&on_a_map(0.0, 0.0));
        assert!(places(&mut at_zero).len() > 40);
        for step in 0..300 {
            assert!(places(&mut there) == places(&mut at_zero), "({x}, {z}), step {step}");
            [&mut there, &mut at_zero].into_iter().for_each(Simulation::step);
        }
    }
    let before = places(&mut here);
    (0..300).for_each(|_| here.step());
    assert!(places(&mut here) != before, "it drives");
}

#[test]
fn what_is_far_from_the_origin_is_a_warning_with_the_error_to_expect() {
    let warnings = |text: &str| load(text).1.warnings;
    let far = warnings(
        r#"(meshes: { "c": cube() }, origin: (0, 0, 0), entities: [
            (mesh: "c", transform: (translation: (0, 0, 19999))),
            (mesh: "c", transform: (translation: (0, 0, 50000))),
            (mesh: "c", transform: (translation: (1000000, 0, 0))),
        ])"#,
    );
    // From 2^19 to 2^20 m numbers of 24 bits are 2^−4 m apart.
    assert_has(only(&far), &["entities[2]", "1 other position are", "1000.0 km", "(0, 0, 0)", "6.2e-2 m", "20 km"]);
    let near =
        warnings(r#"(meshes: { "c": cube() }, entities: [(mesh: "c", transform: (translation: (0, 0, 19999)))])"#);
    assert_eq!(near, Vec::<String>::new());
}

/// Scenes that reach far, from near the origin.
const FAR: &str = r##"
    ## Below a parent that is turned and scaled: 15 km along X, which is twice as far along −Z.
    entities: [(transform: (scale: 2, rotation_degrees: (0, 90, 0)), children: [(children: [
        (transform: (translation: (15000, 0, 0)))])])]
    → entities[0] is up to 30.0 km
    ## 101 of 500 m each have 50 km between the first and the last, half of them on either side.
    generators: [(place: grid(counts: (101, 1, 1), spacing: (500, 0, 0)), meshes: ["c"])]
    → generators[0] is up to 25.0 km
    generators: [(place: grid(counts: (1, 1, 1), jitter: (0, 0, 30000)), meshes: ["c"])]
    → generators[0] is up to 30.0 km
    generators: [(place: scatter(region: disc(center: (15000, 0, 0), radius: 6000), count: 1), meshes: ["c"])]
    → generators[0] is up to 21.0 km
    generators: [(place: scatter(region: box(min: (-9, 0, -22000), max: (9, 0, 0)), count: 1), meshes: ["c"])]
    → generators[0] is up to 22.0 km
    ## A copy's child, which may be turned any way.
    generators: [(place: grid(counts: (1, 1, 1)), random_yaw: true, random_scale: (1, 3),
        entity: (children: [(transform: (translation: (6000, 0, 8000)))]))]
    → generators[0] is up to 30.0 km
"##;

#[test]
fn what_reaches_far_from_the_origin_from_near_it_is_a_warning() {
    let warnings = |text: &str| load(text).1.warnings;
    for (text, part) in cases(FAR) {
        let found = warnings(&format!("(meshes: {{ \"c\": cube() }}, origin: (0, 0, 0), {text})"));
        assert!(found.len() == 1 && found[0].starts_with(&part), "{text}: {found:?}");
    }
    for near in [
        "(children: [(transform: (translation: (0, 0, 19999)))])",
        "(transform: (translation: (0, 0, -10000)), children: [(transform: (translation: (0, 0, 29999)))])",
    ] {
        assert_eq!(warnings(&format!("(entities: [{near}])")), Vec::<String>::new(), "{near}");
    }
}

#[test]
fn what_looks_far_away_without_a_place_is_a_warning() {
    let of = |what: &str| load(&format!("(origin: (0, 0, 0), entities: [(), ({what})])")).1.warnings;
    for what in ["camera: ()", "light: spot(outer_degrees: 30)"] {
        let found = of(&format!("{what}, transform: (look_at: (0, 0, 500000))"));
        assert_has(only(&found), &["entities[1].transform.look_at is 500.0 km", "without a `translation`"]);
        assert_eq!(of(&format!("{what}, transform: (look_at: (0, 0, 20000))")), Vec::<String>::new());
    }
    assert_eq!(of("light: directional(), transform: (look_at: (0, 0, 500000))"), Vec::<String>::new(), "a sun");
}

#[test]
fn a_model_that_reaches_far_from_its_own_origin_is_a_warning() {
    let folder = Folder::with_model();
    let far = MODEL.replace("[0, 0, 3]", "[500000, 0, 5000000]");
    folder.file("far.gltf", &far);
    for problems in [
        folder.problems(r#"(meshes: { "m": model(file: "far.gltf") }, entities: [(mesh: "m")])"#),
        scene::check(&folder.file("far.gltf", &far), Simulation::new).iter().map(ToString::to_string).collect(),
    ] {
        assert_has(only(&problems), &["5000.0 km", "5.0e-1 m"]);
    }
}

#[test]
fn transforms_that_are_too_much_together_are_refused() {
    let folder = Folder::with_model();
    let nested = |outer: &str, inner: &str| {
        folder.problems(&format!(
            "(origin: (0, 0, 0), entities: [(transform: ({outer}), children: [(transform: ({inner}))])])"
        ))
    };
    let far = nested("scale: 1000", "translation: (0, 0, 20000)");
    assert!(far.iter().any(|p| p.contains("children[0].transform: expected a place within 10000000 m")), "{far:?}");
    let large = nested("scale: 10000", "scale: 1000");
    assert!(large.iter().any(|p| p.contains("expected scales of at most 1000000 together")), "{large:?}");
    assert_eq!(nested("scale: 1000", "scale: 1000"), Vec::<String>::new());
}

#[test]
fn five_suns_of_one_brightness_are_told_which_cast() {
    let told = |last: f32| {
        let sun = |intensity: f32| format!("(light: directional(intensity: {intensity}, shadows: true))");
        let suns = [0.1, 0.1, 0.1, 0.1, last].map(sun).join(", ");
        load(&format!("(entities: [{suns}])")).1.warnings.join("; ")
    };
    let begin = "5 directional lights are to cast shadows; only the 4 brightest do";
    assert_eq!(told(0.1), format!("{begin}, of equally bright ones those that come first"));
    // 1 − (1/2)⁴ is 0.9375.
    assert_eq!(told(0.05), format!("{begin}; the shadow of the faintest of these counts by 93 %"));
    assert_eq!(told(0.01), begin);
}
