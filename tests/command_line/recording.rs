//! Runs that can be had again: recorded, replayed, cut short, damaged, continued from snapshots; in the library and by
//! the binary.

use crate::common::{self, Folder, prelude::*, text};
use proptest::prelude::*;
use relief::frames::{self, Stage};
use relief::recording::{Identity, Recorder, Recording, RecordingError, RunFiles, Stepper};
use serde::{Deserialize, Serialize};
use systems::run::inputs::SavedInput;
use systems::run::spawn::Spawn;
use systems::run::standard_inputs::{Despawn, SetTransform};
use systems::run::state_hash::hash;

const SCENE: &str = r#"(
    seed: 7,
    clock: (step_seconds: 0.1),
    materials: { "red": (base_map: "red.png") },
    meshes: { "ball": sphere(radius: 0.5, segments: 12, rings: 6), "floor": plane(size: (30, 30)) },
    entities: [
        (name: "floor", mesh: "floor", material: "red"),
        (name: "van", vehicle: (type: "box"), transform: (translation: (0, 0, 3))),
        (name: "front", camera: (), transform: (translation: (0, 4, 9), look_at: (0, 0, 0))),
    ],
    generators: [
        (name: "arms", place: scatter(region: disc(center: (0, 1, 0), radius: 8), count: 60),
         entity: (spin: (degrees_per_second: 70), mesh: "ball", children: [
            (transform: (translation: (1, 0.5, 0)), light: point(intensity: 1, range: 4)),
         ])),
    ],
)"#;

/// A folder with the scene and its texture.
fn place() -> Folder {
    let folder = common::scene_folder(SCENE);
    image::RgbImage::from_pixel(4, 4, image::Rgb([200, 40, 30])).save(folder.at("red.png")).expect("a texture");
    folder
}

fn record(path: &Path) -> RunFiles {
    RunFiles { record: Some(path.to_owned()), ..RunFiles::default() }
}

fn replay(path: &Path) -> RunFiles {
    RunFiles { replay: Some(path.to_owned()), ..RunFiles::default() }
}

impl Folder {
    fn begin(&self, files: &RunFiles, from: u64) -> Result<Run, RecordingError> {
        self.begin_in(Simulation::new, files, from)
    }

    /// By a program with more state or inputs.
    fn begin_in(&self, simulation: fn() -> Simulation, files: &RunFiles, from: u64) -> Result<Run, RecordingError> {
        let options = LoadOptions { simulation, cache: false, ..LoadOptions::default() };
        let mut stage = frames::load_stage(&self.at("scene.ron"), None, &options).expect("a scene");
        let scene = self.at("scene.ron");
        let stepper = Stepper::begin(files, (&scene, &stage.scene.files), from, &mut stage.simulation)?;
        Ok(Run { stage, stepper })
    }

    /// A run of so many steps with inputs of several kinds; its hashes, and the file of its recording.
    fn recorded(&self, steps: u64) -> (Vec<u128>, PathBuf) {
        let path = self.at("run.rec");
        let mut run = self.begin(&record(&path), 0).expect("a recording");
        let hashes = (0..steps).map(|step| run.act_and_step(step)).collect();
        run.stepper.finish(&mut run.stage.simulation).expect("an end");
        (hashes, path)
    }
}

struct Run {
    stage: Stage,
    stepper: Stepper,
}

impl Run {
    fn step(&mut self) -> u128 {
        self.stepper.step(&mut self.stage.simulation).expect("a step");
        hash(&mut self.stage.simulation.world).0
    }

    fn step_number(&self) -> u64 {
        self.stage.simulation.world.resource::<Clock>().step
    }

    fn act_and_step(&mut self, step: u64) -> u128 {
        let mut inputs = self.stage.simulation.world.resource_mut::<Inputs>();
        let at = |x: f32| Transform::from_xyz(x, 2.0, 0.0);
        if step % 20 == 3 {
            let (name, light) = (format!("lamp {step}"), Light::point(3.0, 6.0));
            inputs.push(Spawn::Light { name, transform: at(step as f32 * 0.01), light });
        }
        if step % 50 == 9 {
            inputs.push(SetTransform { entity: StateId(1), transform: at(-1.0) });
            inputs.push(Despawn(StateId(3 + step as u32 / 10)));
        }
        self.step()
    }
}

#[test]
fn a_replay_is_the_run_and_a_seek_is_the_replay() {
    let place = place();
    let (hashes, path) = place.recorded(260);
    assert!(fs::metadata(&path).expect("a file").len() < 100_000, "compact");
    for from in [0, 1, 99, 100, 101, 230, 260] {
        let mut again = place.begin(&replay(&path), from).expect("a recording");
        // There are snapshots every ten seconds.
        assert_eq!(again.step_number(), from / 100 * 100);
        while again.step_number() < 260 {
            let step = again.step_number();
            assert_eq!(again.step(), hashes[step as usize], "step {step} from {from}");
        }
        assert!(again.stepper.is_at_end(&again.stage.simulation));
    }
}

#[test]
fn who_sits_before_a_replay_changes_nothing() {
    let place = place();
    let (hashes, path) = place.recorded(30);
    let mut again = place.begin(&replay(&path), 0).expect("a recording");
    let inputs: Vec<u128> = (0..30).map(|step| again.act_and_step(step * 10 + 3)).collect();
    assert_eq!(inputs, hashes);
}

#[test]
fn a_world_that_moves_otherwise_is_noticed() {
    let place = place();
    let (_, path) = place.recorded(40);
    let mut again = place.begin(&replay(&path), 0).expect("a recording");
    let world = &mut again.stage.simulation.world;
    world.query::<&mut Light>().iter_mut(world).next().expect("a lamp").intensity = 5.0;
    let error = loop {
        if let Err(error) = again.stepper.step(&mut again.stage.simulation) {
            break error;
        }
    };
    // Marks are a second apart; the first is at once.
    assert!(error.to_string().contains("step 1 differs from the recording"), "{error}");
}

#[test]
fn a_recording_cut_anywhere_replays_up_to_the_cut() {
    let place = place();
    let (hashes, path) = place.recorded(130);
    let whole = fs::read(&path).expect("a file");
    let cut = place.at("cut.rec");
    let last_of = |bytes: &[u8]| {
        fs::write(&cut, bytes).expect("a file");
        Recording::open(&cut, &Inputs::default()).map(|recording| (recording.steps().1, recording.is_whole()))
    };
    assert_eq!(last_of(&whole).expect("whole"), (130, true));
    let mut before = 130;
    for end in (whole.len() - 600..whole.len()).rev() {
        let (last, is_whole) = last_of(&whole[..end]).expect("truncated");
        assert!(!is_whole && last <= before && last >= 91, "cut at {end}: {last}");
        before = last;
    }
    let mut again = place.begin(&replay(&cut), 0).expect("a recording");
    while !again.stepper.is_at_end(&again.stage.simulation) {
        let step = again.step_number();
        assert_eq!(again.step(), hashes[step as usize]);
    }
    for end in [0, 5, 12, 20, 100] {
        assert!(last_of(&whole[..end]).is_err(), "nothing is in it: {end}");
    }
    // What comes after the end was not written by a run.
    for more in [&b"\0"[..], b"as many bytes as a head, or more", &whole[12..]] {
        let error = last_of(&[&whole, more].concat()).expect_err("more than a recording").to_string();
        assert!(error.contains(&format!("corrupt at byte {}: unexpected data after the end", whole.len())), "{error}");
    }
}

#[test]
fn damage_in_the_middle_is_refused_with_its_place() {
    let place = place();
    let (_, path) = place.recorded(130);
    let whole = fs::read(&path).expect("a file");
    for at in (12..whole.len()).step_by(31) {
        let mut damaged = whole.clone();
        damaged[at] ^= 0x10;
        fs::write(&path, &damaged).expect("a file");
        let error = Recording::open(&path, &Inputs::default()).expect_err("damaged").to_string();
        let offset = error.split("corrupt at byte ").nth(1).and_then(|rest| rest.split(':').next());
        let offset: usize = offset.and_then(|offset| offset.parse().ok()).unwrap_or_else(|| panic!("{error}"));
        assert!(offset <= at && error.contains("run.rec"), "damaged at {at}: {error}");
    }
}

#[test]
fn what_does_not_belong_together_is_refused_by_name() {
    let place = place();
    let (_, path) = place.recorded(20);
    let check = ["replay", "run.rec", "--check", "--scene", "scene.ron"];
    assert!(text(&place.relief(&check).stdout).contains("steps 0 to 20 come out as recorded"));
    assert!(
        text(&place.relief(&[&check[..], &["--from", "19"]].concat()).stdout).contains("to 20 come out as recorded")
    );
    place.is_refused(&[&check[..], &["--from", "20"]].concat(), &["--from 20", "ends with step 20"]);
    fs::copy(place.at("scene.ron"), place.at("renamed.ron")).expect("a copy");
    let renamed = place.relief(&["replay", "run.rec", "--check", "--scene", "renamed.ron"]);
    assert!(text(&renamed.stdout).contains("come out as recorded"), "{}", text(&renamed.stderr));
    place.file("another.ron", "()");
    let another = [&check[..4], &["another.ron"]].concat();
    place.is_refused(&another, &["run.rec", "made with another scene", "scene.ron", "another.ron"]);
    place.is_refused(&["replay", "nowhere.rec", "--check"], &["nowhere.rec"]);
    place.is_refused(&["replay", "scene.ron", "--check"], &["scene.ron", "not a Relief recording"]);
    place.is_refused(&["render", "scene.ron", "-o", "o", "--from-snapshot", "run.rec"], &["not a Relief snapshot"]);
    let whole = fs::read(&path).expect("a file");
    let mut other = whole.clone();
    other[8] = 9;
    place.file("other.rec", other);
    place.is_refused(&["replay", "other.rec", "--check"], &["recording version", "expected 4, found 9"]);
    let recording = Recording::open(&path, &Inputs::default()).expect("a recording");
    let mut moved = recording.identity().clone();
    moved.origin = [5e5, 0.0, 5e6];
    let error = recording.identity().check(&path, &moved).expect_err("another origin").to_string();
    assert!(error.contains("made with the origin (0, 0, 0)") && error.contains("(500000, 0, 5000000)"), "{error}");
    place.file("red.png", place.read("run.rec"));
    let red = image::RgbImage::from_pixel(4, 4, image::Rgb([20, 40, 30]));
    red.save(place.at("red.png")).expect("a texture");
    place.is_refused(&check, &["run.rec", "red.png has changed"]);
    place.file("scene.ron", SCENE.replace("base_map: \"red.png\"", ""));
    place.is_refused(&check, &["run.rec", "scene"]);
}

#[test]
fn a_run_goes_on_from_a_snapshot_and_can_be_recorded_on() {
    let place = place();
    let (hashes, path) = place.recorded(600);
    let mut until = place.begin(&replay(&path), 0).expect("a recording");
    (0..90).for_each(|_| _ = until.step());
    let file = place.at("at 90.snapshot");
    until.stepper.save_snapshot(&file, &mut until.stage.simulation).expect("a snapshot");
    let record = place.at("rest.rec");
    let files = RunFiles { from_snapshot: Some(file.clone()), record: Some(record.clone()), ..RunFiles::default() };
    let mut rest = place.begin(&files, 0).expect("a snapshot");
    assert_eq!(rest.step_number(), 90);
    (90..600).for_each(|step| assert_eq!(rest.act_and_step(step), hashes[step as usize], "step {step}"));
    rest.stepper.finish(&mut rest.stage.simulation).expect("an end");
    let mut again = place.begin(&replay(&record), 0).expect("a recording that begins with a snapshot");
    assert_eq!(again.step_number(), 90);
    (90..600).for_each(|step| assert_eq!(again.step(), hashes[step as usize], "step {step}"));
}

/// Tries to go on from bytes that may be anything.
fn try_snapshot(place: &Folder, bytes: &[u8]) -> bool {
    let path = place.at("any.snapshot");
    fs::write(&path, bytes).expect("a file");
    let begun = place.begin(&RunFiles { from_snapshot: Some(path), ..RunFiles::default() }, 0);
    begun.is_ok_and(|mut run| run.step() > 0)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn files_that_are_anything_are_errors(
        bytes in proptest::collection::vec(any::<u8>(), 0..300),
        magic in proptest::sample::select(vec![&b""[..], b"RELIEFRC\x03\0\0\0", b"RELIEFSN\x02\0\0\0"]),
    ) {
        let place = place();
        let bytes = [magic, &bytes].concat();
        prop_assert!(!try_snapshot(&place, &bytes));
        prop_assert!(Recording::open(&place.at("any.snapshot"), &Inputs::default()).is_err());
    }
}

#[test]
fn snapshots_that_are_damaged_or_cut_are_refused() {
    let place = place();
    let mut run = place.begin(&RunFiles::default(), 0).expect("a run");
    let file = place.at("a.snapshot");
    run.stepper.save_snapshot(&file, &mut run.stage.simulation).expect("a snapshot");
    let whole = fs::read(&file).expect("a file");
    assert!(try_snapshot(&place, &whole));
    for more in [&b"\0"[..], b"rubbish", &whole] {
        assert!(!try_snapshot(&place, &[&whole, more].concat()), "{} bytes too many", more.len());
    }
    for at in (0..whole.len()).step_by(whole.len() / 23) {
        assert!(!try_snapshot(&place, &whole[..at]), "cut at {at}");
        let mut damaged = whole.clone();
        damaged[at] ^= 1;
        assert!(!try_snapshot(&place, &damaged), "damaged at {at}");
    }
}

#[test]
fn the_binary_records_and_replays_the_same_pictures_and_hashes() {
    let Some(_) = common::gpu() else { return };
    let place = place();
    let size = ["--size", "48x27", "--no-cache"];
    let run = |args: &[&str]| text(&place.succeeds(&[args, &size].concat()).stderr);
    run(&["render", "scene.ron", "-o", "a", "--frames", "120..123", "--record", "a.rec", "--hash", "a.txt"]);
    run(&["replay", "a.rec", "-o", "b", "--frames", "120..123", "--hash", "b.txt"]);
    let pictures = ["color_00120.png", "color_00121.png", "color_00122.png"];
    for name in pictures {
        assert!(place.read(&format!("a/{name}")) == place.read(&format!("b/{name}")), "{name}");
    }
    let (whole, part) = (text(&place.read("a.txt")), text(&place.read("b.txt")));
    assert!(whole.starts_with("0 ") && part.starts_with("100 ") && whole.ends_with(&part), "{part}");
    assert_eq!(whole.lines().count(), 123);
    run(&["replay", "a.rec", "-o", "c", "--outputs", "id"]);
    assert_eq!(fs::read_dir(place.at("c")).expect("a folder").count(), 124, "all frames, and the names");
    let beyond = ["replay", "a.rec", "-o", "d", "--frames", "120..124"];
    place.is_refused(&beyond, &["120..124", "ends with frame 122"]);

    run(&["render", "scene.ron", "-o", "e", "--frames", "100", "--save-snapshot", "at 99"]);
    run(&["render", "scene.ron", "-o", "f", "--frames", "122..123", "--from-snapshot", "at 99"]);
    assert!(place.read("a/color_00122.png") == place.read("f/color_00122.png"));
    let before = ["render", "scene.ron", "-o", "g", "--frames", "98..101", "--from-snapshot", "at 99"];
    place.is_refused(&before, &["98..101", "begins with frame 99"]);
    assert!(!place.at("g").exists());

    let cut = place.read("a.rec");
    place.file("a.rec", &cut[..cut.len() - 9]);
    let said = run(&["replay", "a.rec", "-o", "h", "--frames", "120..121"]);
    assert!(said.contains("truncated") && said.contains("step 121"), "{said}");
}

#[test]
fn a_thousand_steps_hash_the_same_for_any_number_of_threads() {
    let Some(_) = common::gpu() else { return };
    let place = place();
    let hashes = |threads: &str| {
        let args = ["render", "scene.ron", "-o", "o", "--frames", "1000..1001", "--size", "8x8", "--no-cache"];
        place.succeeds(&[&args[..], &["--hash", "h.txt", "--threads", threads]].concat());
        text(&place.read("h.txt"))
    };
    let one = hashes("1");
    let mut distinct: Vec<&str> = one.lines().filter_map(|line| line.split(' ').nth(1)).collect();
    distinct.sort_unstable();
    distinct.dedup();
    assert_eq!(distinct.len(), 1001);
    assert!(one == hashes("1"), "another run");
    assert!(one == hashes("2"), "two threads");
}

/// A physical car that jumps over a ramp and stands at last, one on the springs beside a signal, a bus that stands on a
/// slope.
const BODIES: &str = r#"(
    vehicle_types: ["ASSETS/vehicles.ron"],
    meshes: {
        "road": plane(size: (300, 300)), "ramp": cube(size: (6, 0.4, 12)), "wall": cube(size: (6, 2, 1)),
        "signal": model(file: "ASSETS/models/town_signal.glb"),
    },
    signals: { "cross": (green_seconds: [1, 1], amber_seconds: 1, red_seconds: 1) },
    routes: { "ring": (points: [(60, 0, 0), (0, 0, 60), (-60, 0, 0), (0, 0, -60)], closed: true, lanes: 2,
        stops: [(at: 30, signal: "cross", group: 0), (at: 2, seconds: 1)]) },
    entities: [
        (mesh: "road", ground: true),
        (mesh: "ramp", ground: true, transform: (translation: (0, 0.7, 24), rotation_degrees: (-12, 0, 0))),
        (mesh: "ramp", ground: true, transform: (translation: (20, 0.7, 0), rotation_degrees: (-12, 0, 0), scale: (1, 1, 3))),
        (mesh: "wall", obstacle: box, transform: (translation: (0, 1, 70))),
        (mesh: "signal", signal_head: (signal: "cross", group: 0), transform: (translation: (3, 0, -4))),
        (vehicle: (type: "car", physical: (), speed_kmh: 60)),
        (vehicle: (type: "van", physical: ()), transform: (translation: (-5, 1, 0))),
        (vehicle: (type: "bus"), transform: (translation: (20, 3, -4))),
        (camera: (), transform: (translation: (9, 3, -12), look_at: (0, 1, 6))),
    ],
    generators: [(place: along(routes: ["ring"], spacing: 15, jitter: 3), vehicles: ["car", "bus", "motorcycle", "truck"])],
)"#;

/// Steps with all that moves: the same hashes for any number of threads and when they go on from a snapshot, and the
/// same picture at the snapshot's own step.
fn assert_repeatable(scene: &str) {
    let place = place();
    let run = |folder: &str, from: u64, more: &[&str]| {
        let frames = format!("{from}..{}", from + 1);
        let args = ["render", scene, "-o", folder, "--frames", &frames, "--size", "64x36", "--hash", "h.txt"];
        place.succeeds(&[&args[..], more].concat());
        text(&place.read("h.txt"))
    };
    let whole = run("a", 1000, &["--threads", "1"]);
    assert!(whole.lines().count() == 1001 && whole == run("b", 1000, &["--threads", "2"]), "two threads");
    run("c", 400, &["--save-snapshot", "s.snapshot"]);
    let continued = run("d", 1000, &["--from-snapshot", "s.snapshot"]);
    assert!(continued.lines().count() > 500 && whole.ends_with(&continued), "from a snapshot");
    run("e", 400, &["--from-snapshot", "s.snapshot"]);
    assert!(place.read("c/color_00400.png") == place.read("e/color_00400.png"), "the picture of the snapshot's step");
    assert!(place.read("a/color_01000.png") == place.read("d/color_01000.png"), "the last picture");
}

#[test]
fn a_town_is_repeatable() {
    if common::gpu().is_some() {
        assert_repeatable(concat!(env!("CARGO_MANIFEST_DIR"), "/assets/scenes/town.ron"));
    }
}

#[test]
fn bodies_signals_and_slopes_are_repeatable() {
    if common::gpu().is_some() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let scene = folder.path().join("bodies.ron");
        let assets = concat!(env!("CARGO_MANIFEST_DIR"), "/assets");
        fs::write(&scene, BODIES.replace("ASSETS", assets)).expect("a scene");
        assert_repeatable(&scene.display().to_string());
    }
}

#[test]
fn what_happens_after_the_last_step_does_not_make_a_recording_differ() {
    let place = place();
    let path = place.at("run.rec");
    let mut run = place.begin(&record(&path), 0).expect("a recording");
    (0..5).for_each(|step| _ = run.act_and_step(step));
    run.stage.simulation.world.resource_mut::<Inputs>().push(Despawn(StateId(0)));
    run.stepper.finish(&mut run.stage.simulation).expect("an end");
    let mut again = place.begin(&replay(&path), 0).expect("a replay");
    (0..5).for_each(|_| again.stepper.step(&mut again.stage.simulation).expect("as recorded"));
    let state = |run: &mut Run| hash(&mut run.stage.simulation.world);
    assert_ne!(state(&mut again), state(&mut run), "it came later");
    again.stepper.finish(&mut again.stage.simulation).expect("as recorded");
    assert_eq!(state(&mut again), state(&mut run), "at the end of the run it is there");
}

#[test]
fn nothing_that_a_run_reads_is_overwritten() {
    let place = place();
    let before = place.read("scene.ron");
    let args = ["render", "scene.ron", "-o", "o", "--size", "8x8"];
    for more in [["--record", "scene.ron"], ["--hash", "./scene.ron"]] {
        place.is_refused(&[&args[..], &more].concat(), &["scene.ron", "already reads or writes this file"]);
    }
    place.is_refused(&[&args[..], &["--record", "q", "--hash", "q"]].concat(), &["q", "already"]);
    place.is_refused(&[&args[..], &["--record", "q", "--hash", "./q"]].concat(), &["q", "already"]);
    for name in ["scene.ron", "red.png"] {
        place.is_refused(&[&args[..], &["--save-snapshot", name]].concat(), &[name, "already"]);
    }
    assert!(place.read("scene.ron") == before);
}

#[test]
fn what_a_run_begins_from_stays_as_it_is() {
    let Some(_) = common::gpu() else { return };
    let place = place();
    let size = ["--size", "8x8"];
    let files = ["--frames", "4", "--record", "a.rec", "--save-snapshot", "a.snap"];
    place.succeeds(&[&["render", "scene.ron", "-o", "o"], &size[..], &files].concat());
    for (from, to) in [("a.rec", "color_00002.png"), ("a.rec", "a.apng"), ("a.snap", "color_00004.png")] {
        fs::copy(place.at(from), place.at(to)).expect("a copy");
    }
    let before = ["color_00002.png", "a.apng", "color_00004.png"].map(|name| place.read(name));
    let refused = "an output would overwrite this input file";
    place.is_refused(&[&["replay", "color_00002.png", "-o", "."], &size[..]].concat(), &["color_00002.png", refused]);
    let film = ["replay", "a.apng", "-o", "o", "--video", "a.apng"];
    place.is_refused(&[&film, &size[..]].concat(), &["a.apng", refused]);
    let on = ["render", "scene.ron", "-o", ".", "--from-snapshot", "color_00004.png", "--frames", "2"];
    place.is_refused(&[&on, &size[..]].concat(), &["color_00004.png", refused]);
    assert!(before == ["color_00002.png", "a.apng", "color_00004.png"].map(|name| place.read(name)));
    // A file of the run may be another name of what is read: it gets a file of its own.
    let read = ["scene.ron", "a.rec"].map(|name| place.read(name));
    for (name, link) in [("scene.ron", "link"), ("a.rec", "link.rec")] {
        fs::hard_link(place.at(name), place.at(link)).expect("a link");
    }
    #[cfg(unix)]
    std::os::unix::fs::symlink("link.rec", place.at("soft.rec")).expect("a link");
    #[cfg(not(unix))]
    fs::rename(place.at("link.rec"), place.at("soft.rec")).expect("another name");
    let written = ["-o", "o", "--hash", "link", "--record", "soft.rec"];
    place.succeeds(&[&["render", "scene.ron"], &written[..], &size].concat());
    assert!(read == ["scene.ron", "a.rec"].map(|name| place.read(name)));
    assert!(place.read("link") != read[0] && place.read("soft.rec") != read[1]);
}

#[test]
fn what_a_run_is_kept_in_is_none_of_its_pictures() {
    let place = place();
    let args = ["render", "scene.ron", "--size", "8x8", "--frames", "2", "--outputs", "color,id", "--video", "a.gif"];
    for folder in ["new", "there"] {
        for option in ["--hash", "--record", "--save-snapshot"] {
            for name in ["color_00001.png", "id_00000.png", "ids.json"] {
                let file = format!("./{folder}/{name}");
                let more = ["-o", folder, option, &file];
                place.is_refused(&[&args[..], &more].concat(), &[name, "already reads or writes this file"]);
            }
            place.is_refused(&[&args[..], &["-o", folder, option, "./a.gif"]].concat(), &["a.gif", "already"]);
        }
        fs::create_dir_all(place.at("there")).expect("a folder");
    }
    assert!(!place.at("new").exists(), "nothing is begun");
    let film =
        ["render", "scene.ron", "--size", "8x8", "--frames", "2", "-o", "there", "--video", "there/color_00001.png"];
    place.is_refused(&film, &["color_00001.png", "already"]);
    if common::gpu().is_some() {
        let others = ["-o", "there", "--hash", "there/depth_00000.png", "--save-snapshot", "there/color_1.png"];
        place.succeeds(&[&args[..], &others].concat());
        let again = ["-o", "there", "--from-snapshot", "there/color_1.png", "--save-snapshot", "there/color_1.png"];
        place.succeeds(&[&args[..], &again].concat());
    }
}

/// An input of a program of one's own: arms turn otherwise.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
struct Turn {
    arms: Vec<StateId>,
    rate: f32,
    why: Option<String>,
}

/// All that were applied.
#[derive(Resource, Default)]
struct Turned(Vec<Turn>);

impl Input for Turn {
    const NAME: &'static str = "turn";

    fn apply(&self, world: &mut World) {
        for arm in &self.arms {
            let Some(arm) = world.resource::<EntityRegistry>().entity(*arm) else { continue };
            if let Some(mut spin) = world.get_mut::<Spin>(arm) {
                spin.rate = self.rate;
            }
        }
        world.resource_mut::<Turned>().0.push(self.clone());
    }

    fn is_valid(&self) -> bool {
        self.rate.is_finite()
    }
}

fn with_turns() -> Simulation {
    let mut simulation = Simulation::new();
    simulation.world.init_resource::<Turned>();
    simulation.world.resource_mut::<Inputs>().register::<Turn>();
    simulation
}

fn turns() -> impl Strategy<Value = Vec<(u64, Turn)>> {
    let arms = proptest::collection::vec((0u32..200).prop_map(StateId), 0..4);
    let turn =
        (arms, proptest::num::f32::ANY, any::<Option<String>>()).prop_map(|(arms, rate, why)| Turn { arms, rate, why });
    proptest::collection::vec((0u64..20, turn), 0..12)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn inputs_of_ones_own_are_replayed_like_the_others(turns in turns()) {
        let place = place();
        let mut run = place.begin_in(with_turns, &record(&place.at("run.rec")), 0).expect("a recording");
        let act = |step: u64, run: &mut Run| {
            let mut inputs = run.stage.simulation.world.resource_mut::<Inputs>();
            turns.iter().filter(|(at, _)| *at == step).for_each(|(_, turn)| inputs.push(turn.clone()));
            run.act_and_step(step)
        };
        let hashes: Vec<u128> = (0..20).map(|step| act(step, &mut run)).collect();
        run.stepper.finish(&mut run.stage.simulation).expect("an end");
        let mut again = place.begin_in(with_turns, &replay(&place.at("run.rec")), 0).expect("a recording");
        let replayed: Vec<u128> = (0..20).map(|_| again.step()).collect();
        prop_assert_eq!(replayed, hashes);
        let applied = |run: &Run| run.stage.simulation.world.resource::<Turned>().0.clone();
        let sound = (0..20).flat_map(|step| turns.iter().filter(move |(at, turn)| *at == step && turn.is_valid()));
        let sound: Vec<Turn> = sound.map(|(_, turn)| turn.clone()).collect();
        prop_assert_eq!(&applied(&run), &sound);
        prop_assert_eq!(&applied(&again), &sound);
    }
}

/// A recording whose only block of inputs holds this one.
fn recording_of(place: &Folder, input: SavedInput) -> PathBuf {
    let path = place.at("one.rec");
    let Run { mut stage, .. } = place.begin_in(with_turns, &RunFiles::default(), 0).expect("a run");
    let scene = PathBuf::from("scene.ron");
    let identity = Identity::of(&place.at("scene.ron"), &stage.scene.files, &stage.simulation).expect("files");
    let identity = Identity { scene: scene.to_string_lossy().into_owned(), ..identity };
    let mut recorder = Recorder::create(&path, identity, &mut stage.simulation).expect("a recording");
    recorder.inputs(0, vec![input]).expect("written");
    path
}

#[test]
fn an_input_that_the_program_does_not_know_is_refused_by_name() {
    let place = place();
    let turn = Turn { arms: vec![StateId(3)], rate: 1.0, why: None };
    let path = recording_of(&place, SavedInput::of(&turn));
    place.begin_in(with_turns, &replay(&path), 0).expect("known");
    let refused = "unknown input \"turn\", which this program does not register";
    let error = place.begin(&replay(&path), 0).err().expect("refused").to_string();
    assert!(error.contains("one.rec: at byte ") && error.ends_with(refused), "{error}");
    for more in [&["--check", "--hash", "h.txt"][..], &["-o", "frames"]] {
        place.is_refused(&[&["replay", "one.rec"], more].concat(), &["one.rec: at byte ", refused]);
    }
    assert!(!place.at("h.txt").exists() && !place.at("frames").exists(), "nothing is begun");
}

#[test]
fn inputs_of_files_that_are_no_values_are_refused_by_name() {
    let place = place();
    // As many arms as a length can say, too many to be there.
    let long = [0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0x01];
    let whole = SavedInput::of(&Turn { arms: Vec::new(), rate: f32::NAN, why: None }).value;
    let cases = [
        ("turn", &long[..], "corrupt at byte ", "input \"turn\": "),
        ("turn", &[], "corrupt at byte ", "input \"turn\": "),
        ("turn", &whole, "corrupt at byte ", "input \"turn\": invalid value"),
        ("turn", &[&whole[..], &[0]].concat(), "corrupt at byte ", "input \"turn\": unexpected data after the end"),
        ("edit light", &[0, 9], "corrupt at byte ", "input \"edit light\": "),
        ("Turn", &whole, "at byte ", "unknown input \"Turn\""),
    ];
    for (name, value, at, what) in cases {
        let path = recording_of(&place, SavedInput { name: name.into(), value: value.to_vec() });
        let error = place.begin_in(with_turns, &replay(&path), 0).err().expect("refused").to_string();
        assert!(error.contains(&format!("one.rec: {at}")) && error.contains(what), "{error}");
    }
}

#[derive(Component, Clone, Serialize, Deserialize)]
struct Fuel(f32);

fn with_fuel() -> Simulation {
    let mut simulation = Simulation::new();
    simulation.world.resource_mut::<StateList>().add_component::<Fuel>("fuel");
    simulation
}

#[test]
fn a_recording_of_a_program_with_other_state_is_refused_by_name() {
    let place = place();
    for (simulation, name) in [(with_fuel as fn() -> Simulation, "more.rec"), (Simulation::new, "less.rec")] {
        drop(place.begin_in(simulation, &record(&place.at(name)), 0).expect("a recording"));
    }
    let error = place.begin(&replay(&place.at("more.rec")), 0).err().expect("refused").to_string();
    assert!(error.ends_with("more.rec: made by a program with the state \"fuel\", which this program does not have"));
    let error = place.begin_in(with_fuel, &replay(&place.at("less.rec")), 0).err().expect("refused").to_string();
    assert!(error.ends_with("less.rec: made by a program without the state \"fuel\", which this program has"));
    place.begin_in(with_fuel, &replay(&place.at("more.rec")), 0).expect("the same");
}
