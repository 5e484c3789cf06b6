//! `relief compare`: what must hold between techniques and real geometry, on height maps small enough for any
//! rasteriser.

use crate::common::{self, assert_fails, prelude::*};
use image::{ImageBuffer, Luma, Rgb, RgbImage};
use relief::tools::technique_error::{BaseMesh, CompareJob, Report, Row, measure};
use std::process::Output;

const TEXELS: u32 = 64;

/// A folder with a height map.
fn heights_folder(of: impl Fn(f32, f32) -> f32) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    write_heights(&folder.path().join("heights.png"), of);
    folder
}

/// Writes a height map of 16 bits.
fn write_heights(path: &Path, of: impl Fn(f32, f32) -> f32) {
    let texel = |x: u32, y: u32| {
        let uv = [x, y].map(|at| (at as f32 + 0.5) / TEXELS as f32);
        Luma([(of(uv[0], uv[1]) * 65535.0).round() as u16])
    };
    let map: ImageBuffer<Luma<u16>, Vec<u16>> = ImageBuffer::from_fn(TEXELS, TEXELS, texel);
    map.save(path).expect("a map");
}

/// Four round studs with flanks of a few texels.
fn studs(u: f32, v: f32) -> f32 {
    let [x, y] = [u, v].map(|at| at * 2.0 % 1.0 - 0.5);
    let inside = ((0.34 - x.hypot(y)) / 0.14).clamp(0.0, 1.0);
    0.1 + 0.9 * inside * inside * (3.0 - 2.0 * inside)
}

fn compare(folder: &Path, change: impl FnOnce(&mut CompareJob)) -> Report {
    let mut job = CompareJob {
        folder: folder.join("out"),
        figure: BaseMesh::Plane,
        height: Some(folder.join("heights.png")),
        normal: None,
        base: None,
        height_scale: Some(0.1),
        angle: 45.0,
        size: (160, 120),
        techniques: Vec::new(),
    };
    change(&mut job);
    let report = measure(&job, |_, _, _| {}).expect("a report");
    eprintln!("{report}");
    report
}

#[track_caller]
fn row<'a>(report: &'a Report, technique: &str) -> &'a Row {
    report.row(technique).unwrap_or_else(|| panic!("{technique} is not in the report"))
}

/// Tells if a technique is the nearest to the truth, without shadows.
fn is_nearest(report: &Report, technique: &str) -> bool {
    let nearest = row(report, technique).unshadowed.mean;
    report.rows.iter().all(|row| row.technique == technique || row.unshadowed.mean > nearest)
}

#[test]
fn the_more_a_technique_does_the_nearer_it_is_to_real_geometry() {
    let Some(folder) = with_gpu(|| heights_folder(studs)) else { return };
    let report = compare(folder.path(), |_| {});
    assert_eq!(report.rows.len(), Technique::ALL.len() + 1);
    let shadowed = |technique: &str| row(&report, technique).shadowed;
    for pair in ["relief", "parallax_horizon", "parallax", "normal", "off"].windows(2) {
        let (nearer, farther) = (shadowed(pair[0]), shadowed(pair[1]));
        assert!(nearer.mean < farther.mean && nearer.flip < farther.flip, "{pair:?}: {nearer:?} {farther:?}");
    }
    // Shadows help alone, and with relief still more.
    assert!(shadowed("horizon").mean < shadowed("normal").mean);
    assert!(shadowed("relief_horizon").mean < shadowed("horizon").mean);
    for (technique, same) in
        [("z_correct", "relief"), ("combined", "relief_horizon"), ("z_correct_parallax", "parallax")]
    {
        // Two shaders may round to neighbouring half floats, 2⁻¹⁰ apart.
        assert!((shadowed(technique).mean - shadowed(same).mean).abs() < 1e-3, "depth alone changes no colour");
    }
    // Without shadows the truth is the displaced figure itself, up to how edges are smoothed.
    let geometry = row(&report, "geometry");
    assert!(geometry.unshadowed.mean < geometry.shadowed.mean, "{geometry:?}");
    assert!(is_nearest(&report, "geometry"), "{report}");
    assert!(report.triangles == 2 * 128 * 128 && report.pixels > 5000, "{report:?}");
}

/// The share of pixels is of those that face the sun. The wrong ones lie along the edges of shadows: a soft edge counts
/// where it is half as bright, and horizons are known in eight directions only.
#[test]
fn shadows_are_where_rays_through_the_geometry_have_them() {
    let Some(folder) = with_gpu(|| heights_folder(studs)) else { return };
    let report = compare(folder.path(), |job| {
        job.techniques = vec![Technique::Relief, Technique::Horizon, Technique::ReliefHorizon];
        job.angle = 0.0;
    });
    let wrong = |technique: &str| row(&report, technique).shadows.expect("a share");
    // That much of it is in shadow.
    assert!(wrong("off") > 0.05, "{report}");
    // A march is half a texel of 64 off along the outlines of four shadows, each no longer than a stud's, 2π · 0.17.
    assert!(wrong("relief") < 0.034, "{report}");
    assert!(wrong("relief_horizon") < wrong("off") && wrong("horizon") < wrong("off"), "{report}");
}

/// Straight from above, where no ray slants much, what remains of the error is how edges are smoothed.
#[test]
fn relief_at_full_depth_is_the_displaced_geometry_seen_from_above() {
    let Some(folder) = with_gpu(|| heights_folder(studs)) else { return };
    let report = compare(folder.path(), |job| {
        job.techniques = vec![Technique::Relief, Technique::Normal];
        job.angle = 0.0;
    });
    let (relief, normal) = (row(&report, "relief"), row(&report, "normal"));
    let (relief, normal) = (relief.shadowed, normal.shadowed);
    assert!(relief.mean < normal.mean && relief.p99 < normal.p99 && relief.flip < normal.flip, "{relief:?} {normal:?}");
}

#[test]
fn a_flat_map_leaves_nothing_to_tell_techniques_apart() {
    let Some(folder) = with_gpu(|| heights_folder(|_, _| 1.0)) else { return };
    let report = compare(folder.path(), |job| job.size = (80, 60));
    assert!(report.silhouette_pixels == 0.0, "{report}");
    for row in &report.rows {
        let bound = match row.technique {
            // Without highlights; with those of the quad's corners, or of its middle; with a mirror image.
            "emboss" | "emboss_multipass" | "dot3" | "dot3_constant" | "perturbed_uv" => 0.1,
            // Neighbouring half floats, 2⁻¹⁰ apart, and light that bends over a pixel.
            "off" | "perturbed_normal" | "geometry" => 0.0015,
            // A normal of 8 bits leans by 1/255 along both axes, 0.0055, times the tangent of a light's angle, which is
            // about 60° at the most; and the same rounding.
            _ => 0.012,
        };
        assert!(row.shadowed.mean < bound && row.unshadowed.mean < bound, "{row:?}");
        assert_eq!(row.shadows.unwrap_or(0.0), 0.0, "{row:?}");
    }
}

/// A grey map is a plane that lies deeper: its picture moves and shrinks, which only the techniques with parallax show.
#[test]
fn a_sunken_plane_is_seen_where_it_lies() {
    let Some(folder) = with_gpu(|| heights_folder(|_, _| 0.25)) else { return };
    let checkers = |x: u32, y: u32| Rgb([if (x / 8 + y / 8).is_multiple_of(2) { 230 } else { 40 }; 3]);
    RgbImage::from_fn(64, 64, checkers).save(folder.path().join("base.png")).expect("a map");
    let report = compare(folder.path(), |job| {
        job.base = Some(folder.path().join("base.png"));
        job.techniques = vec![Technique::Normal, Technique::Relief, Technique::Combined];
        job.angle = 35.0;
    });
    let mean = |technique: &str| row(&report, technique).unshadowed.mean;
    assert!(mean("normal") > 0.3, "{report}");
    // What is moved by a quarter of a texel along both axes changes at the edges of checkers of 8 texels, by 1.9 of the
    // mean.
    let quarter = 2.0 * 0.25 / 8.0 * 1.9;
    assert!(mean("relief") < quarter && mean("combined") < quarter, "{report}");
}

/// Errors that remain: slopes are steeper than the normal map says where the image is squeezed, as at poles.
#[test]
fn round_figures_are_compared_too() {
    let Some(folder) = with_gpu(|| heights_folder(studs)) else { return };
    for figure in [BaseMesh::Sphere, BaseMesh::Torus] {
        let report = compare(folder.path(), |job| {
            job.figure = figure;
            job.height_scale = Some(0.03);
            job.techniques = vec![Technique::Normal, Technique::Relief];
        });
        let mean = |technique: &str| row(&report, technique).shadowed.mean;
        assert!(mean("relief") < mean("normal") && mean("normal") < mean("off"), "{report}");
        assert!(is_nearest(&report, "geometry"), "{report}");
    }
}

fn relief(folder: &Path, args: &[&str]) -> Output {
    common::relief(&[&["compare", "-o", "out"], args].concat(), folder)
}

#[test]
fn the_command_writes_figures_and_pictures_or_nothing() {
    let Some(folder) = with_gpu(|| heights_folder(studs)) else { return };
    let small = ["--height", "heights.png", "--size", "64x48", "--technique", "relief,normal"];
    let output = relief(folder.path(), &[&small[..], &["--json"]].concat());
    assert!(output.status.success(), "{}", common::text(&output.stderr));
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let techniques: Vec<&str> =
        report["rows"].as_array().expect("rows").iter().filter_map(|row| row["technique"].as_str()).collect();
    assert_eq!(techniques, ["off", "normal", "relief", "geometry"]);
    let out = folder.path().join("out");
    for name in techniques.iter().flat_map(|name| [format!("{name}.png"), format!("{name}_error.png")]) {
        assert_eq!(image::open(out.join(&name)).expect("a picture").into_rgb8().dimensions(), (64, 48), "{name}");
    }
    let truth = ["truth.png", "truth_unshadowed.png"].map(|name| image::open(out.join(name)).expect("a picture"));
    assert_ne!(truth[0], truth[1]);
    assert!(image::open(out.join("compare.png")).expect("a sheet").width() > 64 * 2);
    let csv = fs::read_to_string(out.join("compare.csv")).expect("figures");
    assert!(csv.lines().count() == 5 && csv.contains("\nrelief,0."), "{csv}");
    let chart = fs::read_to_string(out.join("compare.svg")).expect("a chart");
    assert!(techniques.iter().all(|name| chart.contains(name)), "{chart}");

    fs::remove_dir_all(&out).expect("a folder");
    fs::write(folder.path().join("broken.png"), b"\x89PNG\r\n\x1a\nnot one").expect("a file");
    let cases = [
        (&["--height", "broken.png"][..], "broken.png"),
        (&["--height", "missing.png"], "missing.png"),
        (&["--normal", "broken.png"], "broken.png"),
        (&["--technique", "bumpy"], "unknown technique \"bumpy\""),
        (&["--height-scale", "2"], "expected a number from 0 to 1"),
        (&["--angle", "90"], "expected degrees from 0 to 85"),
        (&["--size", "9000x9000"], "expected at most 4194304 pixels"),
    ];
    for (args, message) in cases {
        assert_fails(&relief(folder.path(), args), 2, &[message]);
        assert!(!out.exists(), "{args:?}");
    }
}

#[test]
fn no_input_is_overwritten() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().join("out");
    fs::create_dir(&out).expect("a folder");
    let names = [
        "truth.png",
        "truth_unshadowed.png",
        "off.png",
        "relief.png",
        "relief_error.png",
        "geometry.png",
        "compare.png",
    ];
    for (name, option) in names.into_iter().zip(["--height", "--normal", "--base"].into_iter().cycle()) {
        write_heights(&out.join(name), studs);
        let before = fs::read(out.join(name)).expect("an input");
        let path = format!("./out/{name}");
        let output = relief(folder.path(), &[option, &path, "--size", "8x8", "--technique", "relief"]);
        assert_fails(&output, 2, &[&format!("{path}: an output would overwrite this input file")]);
        assert!(fs::read(out.join(name)).expect("the input") == before, "{path}");
        fs::remove_file(out.join(name)).expect("the input");
        assert!(fs::read_dir(&out).expect("a folder").next().is_none(), "nothing is written");
    }
}
