//! `relief bench` as a user runs it: its figures make sense, its suite writes what it says, its scene is always the
//! same.

use crate::common::{self, prelude::*, text};
use relief::tools::bench::{Grid, GridMesh, GridPlan, GridView};
use std::process::Output;

const SMALL: [&str; 7] =
    ["--objects=60", "--lights=5", "--size=64x36", "--frames=4", "--warm-up=2", "--seconds=60", "--threads=2"];

/// The arguments of a small scene with further ones, which replace what they name too.
fn small<'a>(more: &[&'a str]) -> Vec<&'a str> {
    let name = |arg: &str| arg.split('=').next().unwrap_or_default().to_owned();
    let kept = SMALL.into_iter().filter(|arg| more.iter().all(|other| name(other) != name(arg)));
    kept.chain(more.iter().copied()).collect()
}

fn bench(args: &[&str], folder: &Path) -> Output {
    common::relief(&[&["bench"], args].concat(), folder)
}

/// Output of a benchmark that succeeds.
#[track_caller]
fn done(args: &[&str], folder: &Path) -> Output {
    common::succeeds(&[&["bench"], args].concat(), folder)
}

/// The figures of a small scene, with further arguments.
#[track_caller]
fn figures(more: &[&str]) -> Value {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let line = text(&done(&[small(more), vec!["--json"]].concat(), folder.path()).stdout);
    assert_eq!(line.trim_end().lines().count(), 1, "{line}");
    serde_json::from_str(&line).expect("JSON")
}

#[track_caller]
fn number(figures: &Value, field: &str) -> f64 {
    figures[field].as_f64().unwrap_or_else(|| panic!("{field} is no number: {figures}"))
}

/// The one line that a refusal is.
#[track_caller]
fn refusal(output: &Output, code: i32) -> String {
    let error = text(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{error}");
    assert!(output.stdout.is_empty());
    error
}

#[test]
fn a_line_has_every_figure_and_all_are_plausible() {
    let Some(_) = common::gpu() else { return };
    let still = figures(&[]);
    let echoed =
        [("objects", 60.0), ("lights", 5.0), ("moving", 0.0), ("frames", 4.0), ("samples", 4.0), ("threads", 2.0)];
    for (field, value) in echoed {
        assert_eq!(number(&still, field), value, "{field}");
    }
    assert_eq!(still["size"], serde_json::json!([64, 36]));
    assert_eq!((&still["mesh"], &still["view"]), (&"cube".into(), &"wide".into()));
    assert_eq!((&still["lights_policy"], &still["technique"]), (&"three".into(), &Value::Null));
    for what in ["frame_ms", "cpu_ms", "gpu_ms"] {
        let [low, median, high] = ["p05", "median", "p95"].map(|at| number(&still, &format!("{what}_{at}")));
        assert!(0.0 < low && low <= median && median <= high, "{what}: {low} {median} {high}");
    }
    assert!(number(&still, "frame_ms_p95") >= number(&still, "cpu_ms_p05"));
    for field in ["select_ms_median", "simulate_ms_median", "prepare_ms_median", "encode_ms_median", "mutate_ms_median"]
    {
        assert!(number(&still, field) >= 0.0, "{field}");
    }
    for (table, name) in
        [("stages", "transforms"), ("stages", "lights"), ("systems", "select_lights"), ("systems", "update_instances")]
    {
        assert!(number(&still[table], name) >= 0.0, "{table} {name}");
    }
    if !still["gpu_passes"].is_null() {
        assert!(number(&still["gpu_passes"], "forward") > 0.0);
    }
    assert_eq!(still["floor_ms_median"], Value::Null, "nobody asked");
    assert_eq!(number(&still, "upload_bytes_median"), 0.0, "nothing moves");
    assert!(number(&still, "draws") >= 1.0);
    assert_eq!(number(&still, "drawn_objects"), 60.0, "the whole grid is in view");
    assert_eq!(number(&still, "culled_objects"), 0.0);
    assert_eq!(number(&still, "triangles"), 720.0);
    // 16 materials with three maps of 256², a third more for their mip levels; and maps of one texel for what is
    // missing.
    assert_eq!(number(&still, "texture_bytes"), 48.0 * 4.0 * f64::from((4 * 256 * 256 - 1) / 3) + 24.0);
    let first = number(&still, "first_frame_ms");
    let parts: f64 = still["start_ms"].as_object().expect("parts").values().filter_map(Value::as_f64).sum();
    assert!(first > 1.0 && (first - parts).abs() < 1e-6 * first, "{first} {parts}");
    if cfg!(target_os = "linux") {
        assert!((10.0..4000.0).contains(&number(&still, "rss_mb")));
        assert!(number(&still, "bytes_per_object") >= 0.0);
        let many = figures(&["--objects=30000", "--frames=1"]);
        let each = number(&many, "bytes_per_object");
        assert!((150.0..3000.0).contains(&each), "{each} bytes per object");
        assert_eq!(figures(&["--objects=1", "--frames=1"])["bytes_per_object"], Value::Null, "compared with nothing");
    }
    for field in ["adapter", "driver"] {
        assert!(!still[field].as_str().unwrap_or_default().is_empty(), "{field}");
    }
    assert_eq!(still["build"]["version"], env!("CARGO_PKG_VERSION"));
    assert!(["debug", "release"].map(Value::from).contains(&still["build"]["profile"]));
    assert!(still.as_object().is_some_and(|fields| fields.contains_key("levels")));
}

#[test]
fn what_moves_is_uploaded() {
    let Some(_) = common::gpu() else { return };
    let all = number(&figures(&["--moving=1"]), "upload_bytes_median");
    let record = size_of::<systems::draw::InstanceRecord>() as f64;
    assert!(all >= 60.0 * record, "{all} bytes for 60 records of {record}");
    let some = number(&figures(&["--moving=0.1", "--objects=4000"]), "upload_bytes_median");
    assert!((400.0 * record..4500.0 * record).contains(&some), "{some} bytes for 400 records of {record}");
}

#[test]
fn other_meshes_are_drawn_as_often() {
    let Some(_) = common::gpu() else { return };
    let sphere = figures(&["--mesh=sphere", "--floor"]);
    assert!(number(&sphere, "floor_ms_median") > 0.0);
    assert_eq!(number(&sphere, "drawn_objects"), 60.0);
    // Levels of detail may take some away.
    let triangles = number(&sphere, "triangles") / 60.0;
    assert!((4.0..=1024.0).contains(&triangles), "{triangles}");
    let model = concat!("--mesh=", env!("CARGO_MANIFEST_DIR"), "/assets/models/crate.glb");
    let model = figures(&[model]);
    assert_eq!(number(&model, "drawn_objects"), 60.0);
    assert!(number(&model, "triangles") > 0.0);
    assert!(model["mesh"].as_str().is_some_and(|name| name.ends_with("crate.glb")));
}

#[test]
fn the_same_arguments_give_the_same_picture() {
    let Some(folder) = with_gpu(Folder::new) else { return };
    let picture = |name: &str, more: &[&str]| {
        let file = format!("--picture={name}.png");
        done(&[small(&["--size=160x90", &file]), more.to_vec()].concat(), folder.path());
        image::open(folder.path().join(format!("{name}.png"))).expect("a picture").into_rgb8()
    };
    let first = picture("first", &["--moving=0.5"]);
    assert_eq!(first.dimensions(), (160, 90));
    assert!(first == picture("second", &["--moving=0.5"]));
    assert!(first != picture("still", &[]), "what moved shows");
}

/// Measured pictures are those that other commands draw, by default.
#[test]
fn a_scene_is_drawn_as_render_draws_it() {
    let Some(folder) = with_gpu(Folder::new) else { return };
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/scenes/shapes.ron");
    let size = "--size=160x90";
    let measured = ["--scene", scene, size, "--warm-up=1", "--frames=2", "--seconds=60", "--picture=bench.png"];
    done(&measured, folder.path());
    // A step before each frame: of one to warm up and two that are measured, the last is number 3.
    let render = ["render", scene, size, "--frames=3..4", "--output=frames"];
    let rendered = text(&common::succeeds(&render, folder.path()).stdout);
    let [measured, rendered] = ["bench.png", rendered.trim()]
        .map(|file| image::open(folder.path().join(file)).expect("a picture").into_rgb8());
    assert!(measured == rendered, "the pictures differ");
}

#[test]
fn a_trace_shows_frames_systems_and_passes() {
    let Some(folder) = with_gpu(Folder::new) else { return };
    done(&small(&["--trace=t.json"]), folder.path());
    let trace: Value = serde_json::from_slice(&fs::read(folder.path().join("t.json")).expect("a trace")).expect("JSON");
    let events = trace["traceEvents"].as_array().expect("events");
    let of = |category: &str| -> Vec<&Value> { events.iter().filter(|event| event["cat"] == category).collect() };
    let frames = of("frame");
    assert_eq!(frames.len(), 4);
    let end = |event: &Value| number(event, "ts") + number(event, "dur");
    assert!(frames.windows(2).all(|pair| end(pair[0]) <= number(pair[1], "ts") + 0.01), "frames follow one another");
    for category in ["part", "stage", "system"] {
        let inner = of(category);
        assert!(!inner.is_empty(), "{category}");
        for event in inner {
            let within =
                |frame: &&&Value| number(frame, "ts") <= number(event, "ts") + 0.01 && end(event) <= end(frame) + 50.0;
            assert!(frames.iter().any(|frame| within(&frame)), "{event} is in no frame");
        }
    }
    assert!(of("system").iter().any(|event| event["name"] == "select_lights"));
}

#[test]
fn a_suite_writes_everything_and_compares() {
    let Some(folder) = with_gpu(Folder::new) else { return };
    let suite =
        ["--suite", "--quick", "--objects=50", "--lights=4", "--size=32x18", "--frames=2", "--warm-up=1", "-o", "out"];
    done(&suite, folder.path());
    let out = folder.path().join("out");
    let names = ["lights.svg", "moving.svg", "objects.svg", "report.md", "results.jsonl"];
    assert_eq!(common::names(&out), names);
    let lines = fs::read_to_string(out.join("results.jsonl")).expect("results");
    let results: Vec<Value> = lines.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    let has = |field: &str, value: Value| results.iter().any(|result| result[field] == value);
    assert!(has("objects", 5.into()) && has("objects", 50.into()) && has("lights", 4.into()));
    assert!(has("moving", 1.0.into()) && has("view", "inside".into()) && has("view", "wide".into()));
    for chart in ["objects.svg", "lights.svg", "moving.svg"] {
        let svg = fs::read_to_string(out.join(chart)).expect("a chart");
        assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>") && svg.contains("polyline"), "{chart}");
    }

    // Once more into the same folder, against results that were a hundred times faster.
    let mut faster = results.clone();
    for result in &mut faster {
        result["frame_ms_median"] = (number(result, "frame_ms_median") / 100.0).into();
    }
    let faster: String = faster.iter().map(|result| format!("{result}\n")).collect();
    fs::write(folder.path().join("faster.jsonl"), faster).expect("a file");
    let output = done(&[&suite, ["--compare=faster.jsonl"].as_slice()].concat(), folder.path());
    assert_eq!(text(&output.stderr).matches(": frame ").count(), results.len());
    let report = fs::read_to_string(out.join("report.md")).expect("a report");
    assert!(report.contains("## Compared with faster.jsonl") && report.contains("**slower**"), "{report}");
    assert_eq!(common::names(&out), names);
    // What is compared with is not lost.
    let before = fs::read(out.join("results.jsonl")).expect("results");
    let error = refusal(&bench(&[&suite, ["--compare=./out/results.jsonl"].as_slice()].concat(), folder.path()), 2);
    assert!(error.contains("./out/results.jsonl: an output would overwrite this input file"), "{error}");
    assert!(fs::read(out.join("results.jsonl")).expect("results") == before);
}

#[test]
fn bad_arguments_are_refused_in_a_line() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let cases: [(&[&str], &str); 13] = [
        (&["--picture=p.jpg"], "expected a name that ends in .png"),
        (&["--objects=0"], "--objects"),
        (&["--objects=11000000"], "--objects"),
        (&["--lights=-1"], "--lights"),
        (&["--moving=2.0"], "from 0 to 1"),
        (&["--moving=nan"], "from 0 to 1"),
        (&["--mesh=torus"], "expected cube, sphere"),
        (&["--samples=3"], "expected 1 or 4"),
        (&["--size=0x0"], "WIDTHxHEIGHT"),
        (&["--technique=nomral"], "did you mean \"normal\""),
        (&["--suite"], "--output"),
        (&["-o", "out"], "--suite"),
        (&["--suite", "-o", "out", "--json"], "--json"),
    ];
    for (args, needle) in cases {
        let error = refusal(&bench(args, folder.path()), 2);
        assert!(error.contains(needle), "{args:?}: {error}");
    }
    assert_eq!(fs::read_dir(folder.path()).expect("a folder").count(), 0, "nothing was written");
}

#[test]
fn bad_files_are_refused_before_anything_is_measured() {
    let Some(folder) = with_gpu(Folder::new) else { return };
    fs::write(folder.path().join("broken.glb"), b"no model").expect("a file");
    fs::write(folder.path().join("words.jsonl"), b"not JSON\n").expect("a file");
    fs::write(folder.path().join("other.jsonl"), b"{}\n").expect("a file");
    fs::write(folder.path().join("empty.jsonl"), b"").expect("a file");
    fs::write(folder.path().join("taken"), b"").expect("a file");
    let cases: [(&[&str], &str); 12] = [
        (&["--picture=both.png", "--trace=./both.png"], "both.png: the run already reads or writes this file"),
        (&["--picture=nowhere/p.png"], "nowhere/p.png: no such directory: nowhere"),
        (&["--trace=nowhere/t.json"], "nowhere/t.json: no such directory: nowhere"),
        (&["--mesh=broken.glb", "--trace=./broken.glb"], "broken.glb: an output would overwrite this input file"),
        (&["--mesh=missing.glb"], "missing.glb: "),
        (&["--mesh=broken.glb"], "broken.glb: "),
        (&["--suite", "-o", "out", "--compare", "missing.jsonl"], "missing.jsonl: "),
        (&["--suite", "-o", "out", "--compare", "words.jsonl"], "words.jsonl: line 1: "),
        (&["--suite", "-o", "out", "--compare", "other.jsonl"], "other.jsonl: line 1: "),
        (&["--suite", "-o", "out", "--compare", "empty.jsonl"], "empty.jsonl: "),
        (&["--suite", "-o", "taken"], "taken: not a directory"),
        (&["--suite", "--quick", "-o", "out", "--mesh=missing.glb"], "missing.glb: "),
    ];
    for (args, needle) in cases {
        let error = refusal(&bench(args, folder.path()), 2);
        // Drivers and their validation may have said something before.
        let line = error.lines().last().unwrap_or_default();
        assert!(line.starts_with("error: ") && line.contains(needle), "{args:?}: {error}");
        assert_eq!(error.matches(needle).count(), 1, "{error}");
    }
}

fn plan(objects: u32, view: GridView) -> GridPlan {
    GridPlan { objects, lights: 3, moving: 0.0, mesh: GridMesh::Cube, view, shadows: false }
}

/// The share of the objects whose middle is in view.
fn share_in_view(objects: u32, view: GridView) -> f64 {
    let mut yard = Grid::new(&plan(objects, view)).expect("a yard");
    yard.simulation.frame();
    let clip_from_world = Viewpoint::Camera(yard.camera).view(&yard.simulation.world, (1280, 720)).clip_from_world();
    let mut drawn =
        yard.simulation.world.query_filtered::<&systems::space::GlobalTransform, bevy_ecs::prelude::With<MeshId>>();
    let inside = |place: Vec3| {
        let clip = clip_from_world * place.extend(1.0);
        clip.w > 0.0 && clip.x.abs() < clip.w && clip.y.abs() < clip.w
    };
    let seen = drawn.iter(&yard.simulation.world).filter(|place| inside(place.translation())).count();
    seen as f64 / f64::from(objects)
}

#[test]
fn the_views_hold_all_and_about_a_sixth() {
    for objects in [1, 2, 100, 10_000] {
        assert_eq!(share_in_view(objects, GridView::Wide), 1.0, "{objects}");
    }
    for objects in [1_000, 10_000, 100_000] {
        let share = share_in_view(objects, GridView::Inside);
        assert!((0.14..0.2).contains(&share), "{objects}: {share}");
    }
}

#[test]
fn pass_times_come_late_and_nobody_needs_to_take_them() {
    let Some(_) = common::gpu() else { return };
    let gpu = Gpu::headless_with(wgpu::Features::TIMESTAMP_QUERY).expect("an adapter");
    let mut yard = Grid::new(&plan(20, GridView::Wide)).expect("a yard");
    let mut renderer = SingleView::new(&gpu);
    renderer.time_passes();
    let mut draw = |renderer: &mut SingleView| {
        yard.simulation.frame();
        let view = Viewpoint::Camera(yard.camera).view(&yard.simulation.world, (64, 36));
        yard.simulation.with_frame(|frame| renderer.prepare(frame, &view, &Settings::default())).expect("it fits");
        renderer.draw_picture();
    };
    if !gpu.device.features().contains(wgpu::Features::TIMESTAMP_QUERY) {
        draw(&mut renderer);
        assert_eq!(renderer.pass_times(), None);
        return common::skip_always("the adapter has no timestamps");
    }
    assert_eq!(renderer.pass_times(), None, "nothing was drawn");
    // More frames than are kept, and twice, to see that what was kept is free again.
    for _ in 0..2 {
        (0..10).for_each(|_| draw(&mut renderer));
        let mut frames = 0;
        while let Some(passes) = renderer.pass_times() {
            let names: Vec<&str> = passes.iter().map(|pass| pass.name).collect();
            assert!(names.contains(&"forward") && names.contains(&"tone map"), "{names:?}");
            assert!(passes.iter().all(|pass| pass.start_ms >= 0.0 && (0.0..60_000.0).contains(&pass.ms)), "{passes:?}");
            assert!(passes.iter().any(|pass| pass.ms > 0.0), "{passes:?}");
            frames += 1;
        }
        assert!((1..=10).contains(&frames), "{frames}");
    }
    // Nobody asked, or the device has none.
    let (mut unasked, mut plain) = (
        SingleView::new(&gpu),
        Gpu::headless_with(wgpu::Features::empty()).map(|gpu| SingleView::new(&gpu)).expect("an adapter"),
    );
    plain.time_passes();
    for renderer in [&mut unasked, &mut plain] {
        draw(renderer);
        assert_eq!(renderer.pass_times(), None);
    }
    // Another world.
    yard = Grid::new(&plan(20, GridView::Wide)).expect("a yard");
    let view = Viewpoint::Camera(yard.camera).view(&yard.simulation.world, (64, 36));
    yard.simulation.frame();
    yard.simulation.with_frame(|frame| renderer.prepare(frame, &view, &Settings::default())).expect("it fits");
    renderer.draw_picture();
    assert!(renderer.pass_times().is_some());
}
