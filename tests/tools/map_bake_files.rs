//! `relief map bake` and `relief map tile` as a user meets them, an independent bake in Python, and the picture.

use crate::common::{self, assert_fails, prelude::*, text};
use crate::models;
use relief::tools::maps::bake::{BakeOptions, Reach, Role, Surface, Target, Wanted, bake};
use std::f32::consts::TAU;
use std::ffi::OsStr;
use std::process::Output;
use systems::assets::tangents::compute_tangents;

fn relief(args: &[&str], folder: &Path) -> Output {
    common::relief(&[&["map"], args].concat(), folder)
}

/// Runs `relief map` as [`relief`] does, which succeeds, and returns what it says.
#[track_caller]
fn said(args: &[&str], folder: &Path) -> String {
    text(&common::succeeds(&[&["map"], args].concat(), folder).stdout)
}

fn named(name: &str, mesh: Mesh) -> Mesh {
    Mesh { name: name.into(), ..mesh }
}

fn write(folder: &Path, name: &str, meshes: &[(&Mesh, [f32; 3])]) {
    fs::write(folder.join(name), models::glb(meshes)).expect("written");
}

const ONE: [f32; 3] = [1.0; 3];

#[test]
fn maps_are_written_and_the_report_says_how() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    let (low, high) = (named("low", models::coarse_torus()), named("high", models::fine_torus(96, 48)));
    write(folder, "low.glb", &[(&low, ONE)]);
    write(folder, "high.glb", &[(&high, ONE)]);
    write(folder, "both.glb", &[(&low, ONE), (&high, ONE)]);
    let arguments = |low: &'static str, high: &'static str, out: &'static str| {
        vec!["bake", low, high, "-o", out, "--size", "96x48", "--cage", "0.15", "--rays", "4"]
    };
    let report = said(&arguments("low.glb", "high.glb", "one"), folder);
    assert_has(
        &report,
        &["96×48 texels, from 9216 triangles", "baked     4608", "missed    0", "million a second", "height_scale_uv"],
    );
    let kind = |name: &str| {
        let image = image::open(folder.join(name)).expect("an image");
        (image.width(), image.height(), image.color())
    };
    assert_eq!(kind("one/normal.png"), (96, 48, image::ColorType::Rgb8));
    assert_eq!(kind("one/height.png"), (96, 48, image::ColorType::L16));
    assert_eq!(kind("one/occlusion.png"), (96, 48, image::ColorType::L8));
    // The same from nodes of one file, with other threads; and other maps.
    let mut both = arguments("both.glb", "both.glb", "two");
    both.extend(["--node", "low", "--high-node", "high", "--threads", "3"]);
    said(&both, folder);
    for name in ["normal.png", "height.png", "occlusion.png"] {
        let read = |set: &str| fs::read(folder.join(set).join(name)).expect("written");
        assert!(read("one") == read("two"), "{name} differs");
    }
    let mut others = arguments("low.glb", "high.glb", "three");
    others.extend(["--maps", "normal,coverage", "--bits", "16", "--dilate", "all"]);
    said(&others, folder);
    assert_eq!(kind("three/normal.png").2, image::ColorType::Rgb16);
    assert_eq!(kind("three/coverage.png").2, image::ColorType::L8);
    assert_eq!(fs::read_dir(folder.join("three")).expect("a folder").count(), 2);

    let hills = models::landscape(2.0, 16, |x, z| 0.1 * (x * 3.0).sin() * z);
    write(folder, "hills.glb", &[(&hills, ONE)]);
    said(&["tile", "hills.glb", "-o", "tile", "--size", "32", "--rays", "2", "--period", "2"], folder);
    assert_eq!(kind("tile/height.png"), (32, 32, image::ColorType::L16));
}

#[test]
fn bad_input_is_one_clear_error_and_nothing_is_written() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    let sheet = named("sheet", shapes::plane(Vec2::ONE, UVec2::ONE));
    let mut far = sheet.clone();
    far.positions.iter_mut().for_each(|p| p.y += 5.0);
    let bare = Mesh { uvs: Default::default(), ..sheet.clone() };
    let mut folded = sheet.clone();
    folded.uvs[0].iter_mut().for_each(|uv| *uv = Vec2::splat(0.5));
    let mut repeated = sheet.clone();
    repeated.uvs[0].iter_mut().for_each(|uv| *uv *= 1e6);
    let mut point = sheet.clone();
    point.positions.iter_mut().for_each(|p| *p = Vec3::ZERO);
    let meshes = [
        ("sheet", &sheet),
        ("far", &far),
        ("bare", &bare),
        ("folded", &folded),
        ("repeated", &repeated),
        ("point", &point),
    ];
    for (name, mesh) in meshes {
        write(folder, &format!("{name}.glb"), &[(mesh, ONE)]);
    }
    fs::write(folder.join("empty.gltf"), r#"{"asset": {"version": "2.0"}, "scenes": [{}], "scene": 0}"#)
        .expect("written");
    fs::write(folder.join("broken.glb"), b"no model").expect("written");
    fs::write(folder.join("taken"), b"a file").expect("written");
    let before = common::names(folder);
    let cases: [(&[&str], &[&str]); 20] = [
        (&["bake", "bare.glb", "sheet.glb", "-o", "out"], &["bare.glb: ", "\"sheet\" has no UVs", "TEXCOORD_0"]),
        (&["bake", "sheet.glb", "bare.glb", "-o", "out", "--uv-set", "1"], &["sheet.glb: ", "TEXCOORD_1"]),
        (&["bake", "folded.glb", "sheet.glb", "-o", "out"], &["folded.glb: no triangle has an area in the UVs"]),
        (
            &["bake", "repeated.glb", "sheet.glb", "-o", "out"],
            &["repeated.glb: the UVs cover the map more than 256 times"],
        ),
        (&["bake", "sheet.glb", "far.glb", "-o", "out"], &["sheet.glb: none of ", "met far.glb", "--cage"]),
        (&["bake", "sheet.glb", "point.glb", "-o", "out"], &["point.glb: all triangles are at one point"]),
        (&["bake", "empty.gltf", "sheet.glb", "-o", "out"], &["empty.gltf: has no triangles"]),
        (&["bake", "sheet.glb", "empty.gltf", "-o", "out"], &["empty.gltf: has no triangles"]),
        (&["bake", "missing.glb", "sheet.glb", "-o", "out"], &["missing.glb: "]),
        (&["bake", "sheet.glb", "broken.glb", "-o", "out"], &["broken.glb: "]),
        (
            &["bake", "sheet.glb", "sheet.glb", "-o", "out", "--node", "shed"],
            &["sheet.glb: unknown node \"shed\" (did you mean \"sheet\"?)"],
        ),
        (&["bake", "sheet.glb", "sheet.glb", "-o", "out", "--size", "0"], &["expected a number of texels", "8192"]),
        (&["bake", "sheet.glb", "sheet.glb", "-o", "out", "--size", "9000"], &["expected a number of texels", "8192"]),
        (&["bake", "sheet.glb", "sheet.glb", "-o", "out", "--cage", "0"], &["expected metres above 0"]),
        (&["bake", "sheet.glb", "sheet.glb", "-o", "out", "--rays", "0"], &["--rays"]),
        (
            &["bake", "sheet.glb", "sheet.glb", "-o", "out", "--cage", "1", "--max-distance", "1"],
            &["cannot be used with"],
        ),
        (&["bake", "sheet.glb", "sheet.glb", "-o", "taken"], &["taken: not a directory"]),
        (
            &["bake", "sheet.glb", "sheet.glb", "-o", "out", "--preview", "a.jpg"],
            &["a.jpg", "expected a name that ends in .png"],
        ),
        (
            &["tile", "sheet.glb", "-o", "out", "--maps", "height", "--bits", "8"],
            &["--bits: only valid for the normal map", "--maps"],
        ),
        (&["tile", "sheet.glb", "-o", "out", "--period", "0.01"], &["--period: 0.01 m is too short"]),
    ];
    for (args, needles) in cases {
        assert_fails(&relief(args, folder), 2, needles);
        assert_eq!(common::names(folder), before, "{args:?} left something behind");
    }
    // What was there stays.
    fs::create_dir(folder.join("kept")).expect("a folder");
    fs::write(folder.join("kept/normal.png"), b"mine").expect("written");
    assert_eq!(relief(&["bake", "sheet.glb", "far.glb", "-o", "kept"], folder).status.code(), Some(2));
    assert_eq!(fs::read(folder.join("kept/normal.png")).expect("kept"), b"mine");
}

#[test]
fn a_bake_by_brute_force_in_python_agrees() {
    const SIZE: usize = 16;
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = |name: &str| folder.path().join(name);
    let mut low = shapes::torus(1.0, 0.4, 10, 6);
    compute_tangents(&mut low);
    let high =
        models::displaced(shapes::torus(1.0, 0.4, 20, 12), |uv| 0.06 * (uv.x * 31.5).sin() * (uv.y * 18.9).cos());
    for scale in [ONE, [-1.0, 1.3, 0.7]] {
        write(folder.path(), "low.glb", &[(&low, scale)]);
        write(folder.path(), "high.glb", &[(&high, scale)]);
        let out = path("out.bin");
        let (low_path, high_path) = (path("low.glb"), path("high.glb"));
        let args = [
            low_path.as_os_str(),
            high_path.as_os_str(),
            OsStr::new("16"),
            "0.3".as_ref(),
            "400".as_ref(),
            out.as_ref(),
        ];
        if common::python("bake.py", &["numpy"], &args).is_none() {
            return;
        }
        let bytes = fs::read(&out).expect("computed");
        let theirs: Vec<f32> = bytes.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect();

        let load = |name: &str, role| Surface::load(&path(name), &[], role).expect("a mesh");
        let (low, high) = (load("low.glb", Role::Low { uv_set: 0 }), load("high.glb", Role::High));
        let options =
            BakeOptions { size: (SIZE, SIZE), rays: 400, reach: Some(Reach::Cage(0.3)), ..BakeOptions::default() };
        let map = bake(&low, &Target::new(&high).expect("a surface"), &options, &|_, _| {}).expect("baked");
        let (normals, heights, shares) = (
            map.normal.expect("wanted").values,
            map.height.expect("wanted").values,
            map.occlusion.expect("wanted").values,
        );
        let mut compared = 0;
        for (i, texel) in theirs.as_chunks::<6>().0.iter().enumerate().filter(|(_, texel)| texel[5] == 1.0) {
            let normal = Vec3::from_slice(&normals[3 * i..]) * 2.0 - 1.0;
            let height = (heights[i] - 0.5) * 0.6;
            assert!(normal.distance(Vec3::from_slice(texel)) < 2e-4, "texel {i}: {normal} and {texel:?}");
            assert!((height - texel[3]).abs() < 2e-5, "texel {i}: {height} and {texel:?}");
            // Of 400 rays each: theirs are a grid of 20 by 20, of which an edge may take half a row more, 0.025; ours
            // are evenly spread and have a standard error of ½ · 400^(−3/4), 0.0056.
            assert!((shares[i] - texel[4]).abs() < 0.04, "texel {i}: {} and {texel:?}", shares[i]);
            compared += 1;
        }
        assert_eq!(compared, SIZE * SIZE - map.report.missed, "{}", map.report);
    }
}

#[test]
fn the_picture_shows_the_maps_on_the_right() {
    let Some(folder) = with_gpu(Folder::new) else { return };
    write(folder.path(), "low.glb", &[(&models::coarse_torus(), ONE)]);
    write(folder.path(), "high.glb", &[(&models::fine_torus(384, 192), ONE)]);
    let args = ["bake", "low.glb", "high.glb", "-o", "out", "--size", "512", "--cage", "0.15", "--preview", "look.png"];
    said(&args, folder.path());
    let picture = image::open(folder.path().join("look.png")).expect("a picture").into_luma8();
    assert_eq!(picture.dimensions(), (1536, 768));
    // Bumps are differences between neighbours, which the coarse torus has fewer of.
    let rough = |from: u32| {
        let steps = (0..768).flat_map(|y| (from + 1..from + 768).map(move |x| (x, y)));
        steps
            .map(|(x, y)| u64::from(picture.get_pixel(x, y).0[0].abs_diff(picture.get_pixel(x - 1, y).0[0])))
            .sum::<u64>()
    };
    assert!(rough(768) > 2 * rough(0), "{} left, {} right", rough(0), rough(768));
    if let Some(path) = std::env::var_os("RELIEF_CONTACT_SHEET") {
        fs::copy(folder.path().join("look.png"), path).expect("copied");
    }
}

/// A torus whose normals lean to and fro, on a surface that is smooth.
fn leaning(segments: u32, sides: u32) -> Mesh {
    let mut torus = shapes::torus(1.0, 0.4, segments, sides);
    for (normal, uv) in torus.normals.iter_mut().zip(&torus.uvs[0]) {
        let (u, v) = (uv.x * TAU, uv.y * TAU);
        let lean = Vec3::new((5.0 * u).sin(), (4.0 * v).cos(), (3.0 * u + 2.0 * v).sin());
        *normal = (*normal + 0.5 * lean).normalize();
    }
    torus
}

/// Drawn normals of the coarse mesh with the map must be those of the fine mesh: in unevenly stretched space, in
/// mirrored space, and with mirrored UVs.
#[test]
fn the_renderer_shows_the_normals_that_were_baked() {
    let Some(gpu) = common::gpu() else { return };
    let mut headless = Headless { renderer: SingleView::new(&gpu), settings: Settings::default() };
    headless.settings =
        Settings { debug: DebugView::Normal, samples: 1, levels: LevelOfDetail::OFF, ..headless.settings };
    let fine = leaning(600, 300);
    for (scale, mirrored_uvs) in
        [(Vec3::ONE, false), (Vec3::new(1.4, 0.8, 1.0), true), (Vec3::new(-1.2, 1.5, 0.9), false)]
    {
        let mut coarse = shapes::torus(1.0, 0.4, 150, 75);
        if mirrored_uvs {
            coarse.uvs[0].iter_mut().for_each(|uv| uv.x = -uv.x);
        }
        let place = Transform::from_rotation(Quat::from_rotation_x(0.8)).with_scale(scale);
        let surface = |mesh, role| Surface::of_mesh(mesh, &place.compute_affine(), role).expect("UVs");
        let (low, high) = (surface(&coarse, Role::Low { uv_set: 0 }), surface(&fine, Role::High));
        let wanted = Wanted { occlusion: false, ..Wanted::default() };
        let reach = Some(Reach::Cage(0.02));
        let options = BakeOptions { size: (1024, 512), wanted, reach, ..BakeOptions::default() };
        let map = bake(&low, &Target::new(&high).expect("a surface"), &options, &|_, _| {}).expect("baked");
        let texels: Vec<Vec4> = map
            .normal
            .expect("wanted")
            .values
            .as_chunks::<3>()
            .0
            .iter()
            .map(|&[r, g, b]| Vec4::new(r, g, b, 1.0))
            .collect();

        let mut simulation = Simulation::new();
        let camera = simulation.world.spawn((Camera::default(), Transform::from_xyz(0.0, 0.0, 4.5))).id();
        let mut library = simulation.world.resource_mut::<Library>();
        let image = library.add_image(Image::rgba16("normal", 1024, 512, ImageKind::Normal, &texels));
        let mapped = library.add_material(Material { normal_map: Some(Map::new(image)), ..Material::default() });
        let (coarse, fine) = (library.add_mesh(coarse), library.add_mesh(fine.clone()));
        let mut normals = |mesh: MeshId, material: MaterialId| {
            let object = simulation.world.spawn((mesh, material, place)).id();
            headless.draw(&mut simulation, camera, (400, 300)).expect("a picture");
            simulation.world.despawn(object);
            headless.renderer.read_linear().expect("linear colours")
        };
        let (got, wanted) = (normals(coarse, mapped), normals(fine, MaterialId::DEFAULT));
        let direction = |pixel: &[f32; 4]| Vec3::from_slice(pixel) * 2.0 - 1.0;
        let is_shown = |pixel: &[f32; 4]| (direction(pixel).length() - 1.0).abs() < 0.02;
        let mut angles: Vec<f32> = got
            .iter()
            .zip(&wanted)
            .filter(|(a, b)| is_shown(a) && is_shown(b))
            .map(|(a, b)| direction(a).angle_between(direction(b)).to_degrees())
            .collect();
        angles.sort_by(f32::total_cmp);
        let (mean, most) = (angles.iter().sum::<f32>() / angles.len() as f32, angles[angles.len() * 95 / 100]);
        assert!(
            angles.len() > 10_000 && mean < 0.5 && most < 1.5,
            "{} pixels, {mean}° mean, {most}° of 95 %, at {scale}",
            angles.len()
        );
    }
}
