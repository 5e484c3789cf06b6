//! `relief shadows`: shadows whose every sample is known, and pictures that have none.

use crate::common::prelude::*;
use crate::{common, frame_job};
use image::RgbImage;
use relief::tools::compare::PictureError;
use relief::tools::frame_error::FrameErrorJob;
use relief::tools::shadow_error::{ShadowReport, measure};
use systems::assets::color::linear_from_srgb;

const NONE: PictureError = PictureError { mean: 0.0, p99: 0.0, flip: 0.0 };
/// Pixels along a side.
const SIDE: u32 = 50;
/// Metres from the middle of the picture to its edge.
const HALF: f64 = 2.5;

/// Environment of a scene with no light but that of its lamps and suns.
const DARK: &str = "environment: (
        ambient: (0, 0, 0), zenith: (0, 0, 0), horizon: (0, 0, 0), ground: (0, 0, 0), tone_map: clamp,
    ),";

struct Measured {
    report: ShadowReport,
    truth: RgbImage,
    unshadowed: RgbImage,
    maps: RgbImage,
    perfect: RgbImage,
}

/// A white, matte floor of 8 m in the dark, seen from above, under a light; what `entities` adds.
fn scene(light: &str, entities: &str) -> String {
    format!(
        r#"(
    {DARK}
    materials: {{
        "white": (base_factor: (1, 1, 1), specular_factor: (0, 0, 0)),
        "hole": (base_factor: (1, 1, 1), specular_factor: (0, 0, 0), base_alpha: 0, alpha_mode: mask),
        "pane": (base_factor: (1, 1, 1), specular_factor: (0, 0, 0), base_alpha: 0.5, alpha_mode: blend),
    }},
    meshes: {{ "floor": plane(size: (8, 8)), "cube": cube(size: (1, 1, 1)) }},
    entities: [
        (camera: (orthographic_half_height: {HALF}, aspect: 1),
         transform: (translation: (0, 9, 0), rotation_degrees: (-90, 0, 0))),
        (mesh: "floor", material: "white"),
        ({light}),
        {entities}
    ],
)"#
    )
}

fn measured(scene: &str, technique: Option<Technique>) -> Measured {
    measured_in(scene, technique, (SIDE, SIDE))
}

fn measured_in(scene: &str, technique: Option<Technique>, size: (u32, u32)) -> Measured {
    let folder = common::scene_folder(scene);
    let path = folder.path().join("scene.ron");
    let job = FrameErrorJob { technique, ..frame_job(&path, &folder.path().join("out"), size) };
    let report = measure(&job, 32).expect("a report");
    let read = |name: &str| image::open(job.folder.join(name)).expect("a picture").into_rgb8();
    for name in ["unshadowed_error.png", "perfect_error.png"] {
        assert_eq!(read(name).dimensions(), size, "{name}");
    }
    let [truth, unshadowed, maps, perfect] =
        ["truth", "unshadowed", "maps", "perfect"].map(|name| read(&format!("{name}.png")));
    Measured { report, truth, unshadowed, maps, perfect }
}

/// Tells if the way from a point toward a light misses the cube of 1 m on the middle of the floor. `end`: distance of
/// the light, in lengths of `way`; infinite for a sun.
fn is_free(from: DVec3, way: DVec3, end: f64) -> bool {
    let (low, high) = (DVec3::new(-0.5, 0.0, -0.5), DVec3::new(0.5, 1.0, 0.5));
    let (first, second) = ((low - from) / way, (high - from) / way);
    let (enter, leave) = (first.min(second).max_element(), first.max(second).min_element());
    // Not the point itself, on a face.
    enter.max(1e-6) > leave.min(end)
}

#[derive(Clone, Copy)]
enum Lamp {
    At(DVec3),
    Toward(DVec3),
}

impl Lamp {
    fn is_seen(self, from: DVec3) -> bool {
        match self {
            Self::At(place) => is_free(from, place - from, 1.0),
            Self::Toward(direction) => is_free(from, direction, f64::INFINITY),
        }
    }
}

/// Compares how much of its light each pixel has with what is known of its four samples. Pixels with a sample within a
/// millimetre of an edge do not count.
fn assert_known(found: &Measured, known: impl Fn(DVec2) -> f64) {
    let (mut partly, mut dark, mut skipped) = (0, 0, 0);
    for (x, y, truth) in found.truth.enumerate_pixels() {
        let sample = |dx: f64, dy: f64| {
            let at = DVec2::new(f64::from(x) + dx, f64::from(y) + dy) / f64::from(SIDE);
            (at * 2.0 - 1.0) * HALF
        };
        let samples = [sample(0.25, 0.25), sample(0.75, 0.25), sample(0.25, 0.75), sample(0.75, 0.75)];
        let around = [DVec2::ONE, DVec2::NEG_ONE, DVec2::new(1.0, -1.0), DVec2::new(-1.0, 1.0)];
        let is_sure = |&at: &DVec2| around.iter().all(|corner| known(at + corner * 1e-3) == known(at));
        if !samples.iter().all(is_sure) {
            skipped += 1;
            continue;
        }
        let light = |pixel: &image::Rgb<u8>| f64::from(linear_from_srgb(f32::from(pixel.0[1]) / 255.0));
        let (open, lit) = (light(found.unshadowed.get_pixel(x, y)), light(truth));
        let expected: f64 = samples.into_iter().map(&known).sum::<f64>() / 4.0;
        // Bytes of sRGB are half a step off, at 0.05 and more of linear light less than a fiftieth of it. The four
        // samples have different light: within a pixel of 0.1 m, 2 m from the lamp at least, a tenth more or less.
        assert!(open > 0.05, "pixel {x}, {y} is lit");
        assert!((lit / open - expected).abs() < 0.1, "pixel {x}, {y}: {} of {expected}", lit / open);
        partly += u32::from(0.2 < expected && expected < 0.8);
        dark += u32::from(expected == 0.0);
    }
    assert!(partly > 10 && dark > 20 && skipped < SIDE * SIDE / 50, "{partly} {dark} {skipped}");
    assert!(found.truth == found.perfect, "a list that has all lights");
    assert_eq!(found.report.perfect, NONE);
    assert!(found.report.unshadowed.mean > 0.01 && found.report.unshadowed.flip > 0.01, "{:?}", found.report);
    assert_eq!(found.report.unmet_samples, 0);
}

const POINT: (&str, Lamp) = (
    "light: point(intensity: 8, attenuation: inverse_square), transform: (translation: (-2, 3.1, 0.4))",
    Lamp::At(DVec3::new(-2.0, 3.1, 0.4)),
);
const SUN: (&str, Lamp) = (
    "light: directional(intensity: 0.9, angle_degrees: 0), transform: (translation: (-3, 4, 1), look_at: (0, 0, 0))",
    Lamp::Toward(DVec3::new(-3.0, 4.0, 1.0)),
);
const SPOT: (&str, Lamp) = (
    "light: spot(intensity: 14, attenuation: inverse_square, inner_degrees: 50, outer_degrees: 70), \
     transform: (translation: (-1, 4, 0.3), rotation_degrees: (-90, 0, 0))",
    Lamp::At(DVec3::new(-1.0, 4.0, 0.3)),
);
const CUBE: &str = r#"(mesh: "cube", material: "white", transform: (translation: (0, 0.5, 0))),"#;

fn on_cube(at: DVec2) -> bool {
    at.abs().max_element() < 0.5
}

#[test]
fn the_shadow_of_a_cube_is_where_geometry_has_it() {
    let Some(_) = common::gpu() else { return };
    for (light, lamp) in [POINT, SUN, SPOT] {
        let known = |at: DVec2| f64::from(u8::from(on_cube(at) || lamp.is_seen(DVec3::new(at.x, 0.0, at.y))));
        assert_known(&measured(&scene(light, CUBE), None), known);
    }
}

/// The share of its light that each pixel of a picture has.
fn shares(lit: &RgbImage, open: &RgbImage) -> Vec<f64> {
    let light = |pixel: &image::Rgb<u8>| f64::from(linear_from_srgb(f32::from(pixel.0[1]) / 255.0));
    lit.pixels().zip(open.pixels()).map(|(lit, open)| light(lit) / light(open)).collect()
}

/// A plate with an edge along Z above the middle of the floor, or turned, seen from below it.
fn plate(light: &str, height: f64, aside: f64, turned_degrees: f64) -> String {
    let plate = format!(
        r#"(transform: (translation: ({aside}, {height}, 0), rotation_degrees: (0, {turned_degrees}, 0)), children: [
            (mesh: "cube", material: "white", transform: (translation: (-4, 0, 0), scale: (8, 0.002, 16)))]),"#
    );
    scene(light, &plate).replace("translation: (0, 9, 0)", "translation: (0, 0.3, 0)")
}

/// Behind a straight edge the penumbra of a disc is as wide as similar triangles have it. A quarter of the disc is seen
/// where the edge crosses it at 0.404 of its radius: (acos t − t √(1 − t²)) / π = ¼.
#[test]
fn penumbrae_are_as_wide_as_geometry_has_them() {
    let Some(_) = common::gpu() else { return };
    let lamp = "light: point(intensity: 8, attenuation: inverse_square, radius: 0.4), \
                transform: (translation: (0, 4, 0))";
    let sun = "light: directional(intensity: 0.9, angle_degrees: 20), transform: (rotation_degrees: (-90, 0, 0))";
    let side = 200;
    for height in [1.0, 1.4, 1.8, 2.2] {
        let of_lamp = 2.0 * 0.4 * height / (4.0 - height);
        let of_sun = 2.0 * 10f64.to_radians().tan() * height;
        for (light, width) in [(lamp, of_lamp), (sun, of_sun)] {
            // A strip across the edge, a tenth as high as it is wide.
            let half = |metres: f64| format!("orthographic_half_height: {metres}");
            let strip = plate(light, height, 0.0, 0.0).replace(&half(HALF), &half(HALF / 10.0));
            let found = measured_in(&strip, None, (side, side / 10));
            let shares = shares(&found.truth, &found.unshadowed);
            let rows = 0..side as usize / 10;
            let share = |x: usize| rows.clone().map(|y| shares[y * side as usize + x]).sum::<f64>() / rows.len() as f64;
            let crosses = |wanted: f64| {
                let x = (0..side as usize - 1).find(|&x| share(x + 1) >= wanted).expect("it is lit beyond the edge");
                x as f64 + (wanted - share(x)) / (share(x + 1) - share(x))
            };
            let between = (crosses(0.75) - crosses(0.25)) * 2.0 * HALF / f64::from(side);
            let found = between / 0.404;
            assert!((found - width).abs() < 0.1 * width, "{height} m, {light}: {found} of {width}");
        }
    }
}

/// The largest difference of the shares of light of two pixels that are so many apart, row by row.
fn largest_step(picture: &RgbImage, open: &RgbImage, step: usize) -> f64 {
    let (shares, width) = (shares(picture, open), picture.width() as usize);
    assert!(shares.iter().all(|share| share.is_finite()));
    let inner = (0..shares.len() - step).filter(|at| at % width + 1 < width);
    inner.map(|at| (shares[at] - shares[at + step]).abs()).fold(0.0, f64::max)
}

/// A plate's shadow on a floor in grazing light, wider than a texel and askew to the texels: from pixel to pixel no
/// step is larger than one and a half times the largest that rays find, along the edge and across it.
#[test]
fn penumbrae_of_maps_have_no_steps_of_texels() {
    let Some(_) = common::gpu() else { return };
    let side = 200;
    for (elevation, angle, turned) in [(15f64, 2.0, 10.0), (25.0, 3.0, -33.0), (60.0, 10.0, 4.0)] {
        // The sun is at −X.
        let aside = -1.0 / elevation.to_radians().tan();
        let light = format!(
            "light: directional(intensity: 0.9, angle_degrees: {angle}, shadows: true), \
             transform: (translation: ({aside}, 1, 0), look_at: (0, 0, 0))"
        );
        let found = measured_in(&plate(&light, 1.0, aside, turned), None, (side, side));
        for step in [1, side as usize] {
            let [rays, maps] =
                [&found.truth, &found.maps].map(|picture| largest_step(picture, &found.unshadowed, step));
            // A byte of sRGB is 0.01 of the light that there is.
            assert!(rays < 0.2 && maps <= 1.5 * rays + 0.01, "{elevation}°, {step}: {maps}, by rays {rays}");
        }
        assert!(found.report.maps.mean < 0.2 * found.report.unshadowed.mean, "{:?}", found.report);
    }
}

/// Things on the floor, and something in the air.
const FURNITURE: &str = r#"
        (mesh: "cube", material: "white", transform: (translation: (0, 0.5, 0))),
        (mesh: "cube", material: "white",
         transform: (translation: (1.4, 0.3, -1.2), rotation_degrees: (0, 30, 0), scale: 0.6)),
        (mesh: "cube", material: "white",
         transform: (translation: (-1.3, 0.2, 1.5), rotation_degrees: (0, 70, 0), scale: 0.4)),
        (mesh: "cube", material: "white",
         transform: (translation: (1.1, 1.2, 1.3), rotation_degrees: (20, 10, 40), scale: 0.3)),"#;

/// One lamp and one tap: the light of a picture with a map is off by a hundredth at the most.
#[test]
fn a_map_is_near_the_truth() {
    let Some(_) = common::gpu() else { return };
    for (light, _) in [POINT, SPOT] {
        let light = light.replace("inverse_square", "inverse_square, shadows: true");
        let report = measured_in(&scene(&light, FURNITURE), None, (200, 200)).report;
        assert!(report.mapped == 1 && report.unshadowed.mean > 0.05 && report.perfect == NONE, "{report:?}");
        assert!(report.maps.mean <= 0.01, "{report:?}");
    }
}

/// A cube of holes: its solid shape casts the shadow, and what is seen through it has one.
#[test]
fn masks_cast_as_if_they_were_solid_and_shadows_are_seen_through_them() {
    let Some(_) = common::gpu() else { return };
    let (light, lamp) = POINT;
    let holes = CUBE.replace("white", "hole");
    let known = |at: DVec2| f64::from(u8::from(!on_cube(at) && lamp.is_seen(DVec3::new(at.x, 0.0, at.y))));
    assert_known(&measured(&scene(light, &holes), None), known);
}

#[test]
fn blended_objects_have_shadows_and_cast_none() {
    let Some(_) = common::gpu() else { return };
    let (light, lamp) = SUN;
    let pane = r#"(mesh: "floor", material: "pane", transform: (translation: (0, 0.3, 0))),"#;
    // The sun lights both alike, and the pane hides half of the floor.
    let known = |at: DVec2| {
        let seen = [0.0, 0.3].map(|y| f64::from(u8::from(lamp.is_seen(DVec3::new(at.x, y, at.y)))));
        if on_cube(at) { 1.0 } else { (seen[0] + seen[1]) / 2.0 }
    };
    assert_known(&measured(&scene(light, &(pane.to_owned() + CUBE)), None), known);
    let alone = measured(&scene(light, pane), None);
    assert_eq!((alone.report.unshadowed, alone.report.perfect), (NONE, NONE));
}

/// With each way in which a light is added up.
#[test]
fn a_lamp_in_a_closed_box_lights_nothing_outside() {
    let Some(_) = common::gpu() else { return };
    let lamp = "light: point(intensity: 8, attenuation: inverse_square), transform: (translation: (0.1, 1, 0))";
    let closed = r#"(mesh: "cube", material: "white", transform: (translation: (0, 1, 0), scale: 1.2)),"#;
    let techniques =
        [Technique::Off, Technique::Normal, Technique::Dot3, Technique::Emboss, Technique::EmbossMultipass];
    for technique in techniques {
        let found = measured(&scene(lamp, closed), Some(technique));
        assert_eq!(found.report.mean_luminance, 0.0, "{technique:?}");
        assert_eq!((found.report.unshadowed.mean, found.report.perfect), (f64::INFINITY, NONE), "{technique:?}");
        assert!(found.truth.iter().all(|&channel| channel == 0), "{technique:?}");
    }
}

/// A slanted floor in pieces, under three lights of which a sun stands 3° above it: no surface is in its own way. Here,
/// and 65 km from the origin.
#[test]
fn without_anything_in_the_way_traced_shadows_change_no_bit() {
    let Some(_) = common::gpu() else { return };
    for origin in ["0", "65000"] {
        let scene = format!(
            r#"(
    environment: (ambient: (0.1, 0.1, 0.1), zenith: (0, 0, 0), horizon: (0, 0, 0), ground: (0, 0, 0)),
    materials: {{ "white": (base_factor: (0.7, 0.6, 0.5)) }},
    meshes: {{ "floor": plane(size: (80, 80)) }},
    entities: [(transform: (translation: ({origin}, 0, {origin}), rotation_degrees: (17, 35, 8)), children: [
        (mesh: "floor", material: "white", piece_metres: 9),
        (camera: (fov_y_degrees: 50), transform: (translation: (0, 2, 6), look_at: (0, 0, -2))),
        (light: directional(intensity: 0.7), transform: (translation: (-20, 1.05, 0), look_at: (0, 0, 0))),
        (light: point(intensity: 3, range: 9), transform: (translation: (1, 0.2, -1))),
        (light: spot(intensity: 9, range: 20, inner_degrees: 20, outer_degrees: 30),
         transform: (translation: (-3, 3, 0), look_at: (0, 0, -3))),
    ])],
)"#
        );
        let found = measured(&scene, None);
        assert_eq!((found.report.unshadowed, found.report.perfect), (NONE, NONE), "{origin}");
        assert!(found.truth == found.unshadowed && found.truth == found.perfect, "{origin}");
        assert!(found.report.mean_luminance > 0.05, "{:?}", found.report);
    }
}

#[test]
fn on_the_shipped_scene_perfect_maps_are_nearer_than_none() {
    let Some(folder) = with_gpu(Folder::new) else { return };
    let scene = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("assets/scenes/lights.ron");
    let found = measure(&frame_job(&scene, folder.path(), (160, 90)), 32).expect("a report");
    assert_eq!(found.lights, 44);
    let ShadowReport { unshadowed, perfect, .. } = &found;
    assert!(perfect.mean < unshadowed.mean && perfect.p99 < unshadowed.p99, "{found:?}");
    assert!(perfect.flip < unshadowed.flip && unshadowed.flip < 1.0, "{found:?}");
    // Vertices are moved by a sixteenth of a pixel at the most.
    assert!(found.unmet_samples < 4 * 160 * 90 / 500, "{found:?}");
}

/// A camera in a room of a building of two by two, with a lamp in each, and a doorway to two of them.
fn building(cells: &str) -> String {
    let mut entities = String::new();
    let mut face = |min: [f64; 3], max: [f64; 3]| {
        let at: Vec<f64> = (0..3).map(|i| 0.5 * (min[i] + max[i])).collect();
        let size: Vec<f64> = (0..3).map(|i| max[i] - min[i]).collect();
        entities += &format!(
            "(mesh: \"cube\", material: \"white\", transform: (translation: ({}, {}, {}), scale: ({}, {}, {}))),\n",
            at[0], at[1], at[2], size[0], size[1], size[2]
        );
    };
    for (x, z) in [(0.0, 0.0), (4.0, 0.0), (0.0, 4.0), (4.0, 4.0)] {
        // Walls are 20 cm thick, and each face of them is 4 cm. Doorways are from 1.5 to 2.5 m, 2 m high.
        face([x + 0.06, -0.04, z + 0.06], [x + 3.94, 0.0, z + 3.94]);
        face([x + 0.06, 2.6, z + 0.06], [x + 3.94, 2.64, z + 3.94]);
        let inner = |at: f64| at > 3.0 && at < 5.0;
        for (at, inward) in [(x, 1.0), (x + 4.0, -1.0)] {
            let (a, b) = (at + 0.06 * inward, at + 0.1 * inward);
            let mut part = |from: f64, to: f64, low: f64, high: f64| {
                face([a.min(b), low, z + from], [a.max(b), high, z + to]);
            };
            if inner(at) {
                part(0.06, 1.5, -0.04, 2.64);
                part(2.5, 3.94, -0.04, 2.64);
                part(1.5, 2.5, 2.0, 2.64);
            } else {
                part(0.06, 3.94, -0.04, 2.64);
            }
        }
        for (at, inward) in [(z, 1.0), (z + 4.0, -1.0)] {
            let (a, b) = (at + 0.06 * inward, at + 0.1 * inward);
            let mut part = |from: f64, to: f64, low: f64, high: f64| {
                face([x + from, low, a.min(b)], [x + to, high, a.max(b)]);
            };
            // One of the walls across Z has no doorway.
            if inner(at) && x < 1.0 {
                part(0.06, 1.5, -0.04, 2.64);
                part(2.5, 3.94, -0.04, 2.64);
                part(1.5, 2.5, 2.0, 2.64);
            } else {
                part(0.06, 3.94, -0.04, 2.64);
            }
        }
    }
    // Frames, through the walls.
    for z in [0.0, 4.0] {
        face([3.9, 0.0, z + 1.44], [4.1, 2.06, z + 1.5]);
        face([3.9, 0.0, z + 2.5], [4.1, 2.06, z + 2.56]);
        face([3.9, 2.0, z + 1.5], [4.1, 2.06, z + 2.5]);
        face([3.9, -0.04, z + 1.5], [4.1, 0.0, z + 2.5]);
    }
    face([1.44, 0.0, 3.9], [1.5, 2.06, 4.1]);
    face([2.5, 0.0, 3.9], [2.56, 2.06, 4.1]);
    face([1.5, 2.0, 3.9], [2.5, 2.06, 4.1]);
    face([1.5, -0.04, 3.9], [2.5, 0.0, 4.1]);
    for (x, z) in [(1.0, 1.2), (6.8, 1.0), (0.8, 6.5), (6.0, 6.2), (3.0, 3.0), (7.0, 3.2)] {
        entities += &format!("(transform: (translation: ({x}, 2.2, {z})), light: point(intensity: 3, range: 14)),\n");
    }
    format!(
        r#"(
    {DARK}
    materials: {{ "white": (base_factor: (1, 1, 1), specular_factor: (0, 0, 0)) }},
    meshes: {{ "cube": cube(size: (1, 1, 1)) }},
    piece_metres: 1.3,
    {cells}
    entities: [
        (camera: (fov_y_degrees: 75), transform: (translation: (0.4, 1.6, 0.4), look_at: (4, 1, 3.4))),
        {entities}
    ],
)"#
    )
}

const BUILDING_CELLS: &str = r#"
    cells: {
        "a": (box: ((0, -0.1, 0), (4, 2.7, 4))), "b": (box: ((4, -0.1, 0), (8, 2.7, 4))),
        "c": (box: ((0, -0.1, 4), (4, 2.7, 8))), "d": (box: ((4, -0.1, 4), (8, 2.7, 8))),
    },
    portals: [
        (between: ("a", "b"), polygon: [(4, 0, 1.5), (4, 0, 2.5), (4, 2, 2.5), (4, 2, 1.5)]),
        (between: ("c", "d"), polygon: [(4, 0, 5.5), (4, 0, 6.5), (4, 2, 6.5), (4, 2, 5.5)]),
        (between: ("a", "c"), polygon: [(1.5, 0, 4), (2.5, 0, 4), (2.5, 2, 4), (1.5, 2, 4)]),
    ],"#;

/// Cells leave out lights behind walls, and none that a ray finds; the picture is far nearer to the truth.
#[test]
fn cells_leave_out_what_walls_hide() {
    let Some(_) = common::gpu() else { return };
    let with = measured(&building(BUILDING_CELLS), None).report;
    let without = measured(&building(""), None).report;
    let cells = with.cells.expect("there are cells");
    assert_eq!(without.cells, None);
    // The same pictures but for cells.
    assert_eq!((with.mean_luminance, cells.without), (without.mean_luminance, without.unshadowed));
    assert_eq!(cells.left_out, 0, "{cells:?}");
    // All six are in reach; two are in the room, and some shine in here and there.
    assert_eq!(cells.lights_per_object_without, 6.0);
    assert!(cells.lights_per_object < 4.5, "{cells:?}");
    assert!(with.unshadowed.mean < 0.5 * without.unshadowed.mean, "{with:?}");
}
