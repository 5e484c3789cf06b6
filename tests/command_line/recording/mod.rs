//! Runs that can be had again: recorded, replayed, cut short, damaged, continued from snapshots; in the library and by
//! the binary.

mod own;
mod program;

use crate::common::{self, prelude::*, text};
use proptest::prelude::*;
use relief::recording::{Identity, Recorder, Recording, RecordingError, RunFiles};
use serde::{Deserialize, Serialize};
use std::sync::LazyLock;
use systems::run::inputs::SavedInput;
use systems::run::spawn::Spawn;
use systems::run::standard_inputs::{Despawn, SetTransform};

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
        let mut session = Session::load(&self.at("scene.ron"), &options).expect("a scene");
        session.begin(files, from)?;
        Ok(Run { session })
    }

    /// A run of so many steps with inputs of several kinds; its hashes, and the file of its recording.
    fn recorded(&self, steps: u64) -> (Vec<u128>, PathBuf) {
        let path = self.at("run.rec");
        let mut run = self.begin(&record(&path), 0).expect("a recording");
        let hashes = (0..steps).map(|step| run.act_and_step(step)).collect();
        run.session.finish().expect("an end");
        (hashes, path)
    }
}

struct Run {
    session: Session,
}

impl Run {
    fn step(&mut self) -> u128 {
        self.session.step().expect("a step");
        self.session.hash().0
    }

    fn step_number(&self) -> u64 {
        self.session.step_number()
    }

    fn act_and_step(&mut self, step: u64) -> u128 {
        let mut inputs = self.session.simulation.world.resource_mut::<Inputs>();
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
        assert!(again.session.is_at_end());
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
    let world = &mut again.session.simulation.world;
    world.query::<&mut Light>().iter_mut(world).next().expect("a lamp").intensity = 5.0;
    let error = loop {
        if let Err(error) = again.session.step() {
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
    while !again.session.is_at_end() {
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
    until.session.save_snapshot(&file).expect("a snapshot");
    let record = place.at("rest.rec");
    let files = RunFiles { from_snapshot: Some(file.clone()), record: Some(record.clone()), ..RunFiles::default() };
    let mut rest = place.begin(&files, 0).expect("a snapshot");
    assert_eq!(rest.step_number(), 90);
    (90..600).for_each(|step| assert_eq!(rest.act_and_step(step), hashes[step as usize], "step {step}"));
    rest.session.finish().expect("an end");
    let mut again = place.begin(&replay(&record), 0).expect("a recording that begins with a snapshot");
    assert_eq!(again.step_number(), 90);
    (90..600).for_each(|step| assert_eq!(again.step(), hashes[step as usize], "step {step}"));
}

#[test]
fn sessions_fork_go_back_and_begin_anew() {
    let place = place();
    let mut run = place.begin(&RunFiles::default(), 0).expect("a run");
    let steps = |run: &mut Run, steps: std::ops::Range<u64>| steps.map(|step| run.act_and_step(step)).collect();
    let first: Vec<u128> = steps(&mut run, 0..40);
    let snapshot = run.session.snapshot().expect("a snapshot");
    let mut fork = Run { session: run.session.fork().expect("a scene that is still there") };
    let then: Vec<u128> = steps(&mut run, 40..60);
    assert_eq!(steps(&mut fork, 40..60), then, "a fork");
    run.session.restore(&snapshot).expect("its own snapshot");
    assert_eq!(steps(&mut run, 40..60), then, "the state of before");
    run.session.reset(None).expect("nothing is recorded");
    assert_eq!(steps(&mut run, 0..40), first, "the run from its beginning");
    fork.session.reset(Some(8)).expect("nothing is recorded");
    assert_ne!(steps(&mut fork, 0..40), first, "another seed");
    fork.session.restore(&snapshot).expect("a snapshot of another seed");
    assert_eq!(steps(&mut fork, 40..60), then, "a world of the snapshot's seed");
    fork.session.record(&place.at("fork.rec")).expect("a recording");
    let refused = [fork.session.reset(None), fork.session.restore(&snapshot)];
    assert!(refused.iter().all(|refused| matches!(refused, Err(RecordingError::Misused(_)))), "{refused:?}");
}

#[test]
fn sessions_of_a_scene_that_has_changed_are_refused_and_stay_as_they_are() {
    let place = place();
    let mut run = place.begin(&RunFiles::default(), 0).expect("a run");
    (0..5).for_each(|step| _ = run.act_and_step(step));
    let snapshot = run.session.snapshot().expect("a snapshot");
    place.file("scene.ron", SCENE.replace("radius: 8", "radius: 6"));
    // Its world does not take the snapshot any more.
    let world = &mut run.session.simulation.world;
    let van = world.resource::<EntityRegistry>().entity(StateId(1)).expect("the van");
    world.despawn(van);
    let before = (run.session.hash(), run.session.simulation.draw_list().world);
    let restored = run.session.restore(&snapshot).err();
    assert_eq!((run.session.hash(), run.session.simulation.draw_list().world), before, "{restored:?}");
    for error in [restored, run.session.fork().err()] {
        assert_has(&error.expect("another scene").to_string(), &["scene.ron: scene.ron has changed since it was"]);
    }
}

#[test]
fn another_world_of_a_session_is_seen_from_the_same_place() {
    let place = place();
    let scene = SCENE.replace("(name: \"front\"", "(name: \"top\", camera: ()), (name: \"front\"");
    place.file("scene.ron", &scene);
    let mut run = place.begin(&RunFiles::default(), 0).expect("a run");
    let name = |session: &Session| {
        let Viewpoint::Camera(camera) = session.viewpoint else { panic!("expected a camera") };
        session.simulation.world.get::<Name>(camera).expect("a camera of the scene").to_string()
    };
    let snapshot = run.session.snapshot().expect("a snapshot");
    assert_eq!(name(&run.session), "top");
    run.session.viewpoint = run.session.scene.cameras[1].1.into();
    assert_eq!(name(&run.session.fresh(Some(3)).expect("a world")), "front");
    assert_eq!(name(&run.session.fork().expect("a world")), "front");
    run.session.reset(Some(3)).expect("nothing is recorded");
    assert_eq!(name(&run.session), "front", "after a reset");
    run.session.restore(&snapshot).expect("a snapshot of another seed");
    assert_eq!(name(&run.session), "front", "after a snapshot of another seed");
    place.file("scene.ron", scene.replace("entities: [", "entities: [(name: \"new\"), "));
    assert_eq!(name(&run.session.reloaded().expect("a world")), "front", "in a scene that has changed");
}

#[test]
fn a_run_that_is_kept_is_let_go_by_its_end_alone() {
    let place = place();
    let hash = place.at("hashes");
    let mut run = place.begin(&RunFiles { hash: Some(hash.clone()), ..RunFiles::default() }, 0).expect("a run");
    let state = (40, run.session.hash());
    let is_kept = |done: Result<(), RecordingError>| matches!(done, Err(RecordingError::Misused(_)));
    assert!(is_kept(run.session.reset(None)), "hashes are written");
    assert!(is_kept(run.session.begin(&RunFiles::default(), 0)), "hashes are written");
    run.session.finish().expect("an end");
    run.session.reset(None).expect("nothing is kept any more");
    run.session.begin(&RunFiles { states: vec![state], ..RunFiles::default() }, 0).expect("a run");
    assert!(is_kept(run.session.reset(None)), "a state is expected");
    // A run that cannot be begun is not kept.
    let (_, path) = place.recorded(3);
    fs::create_dir(place.at("folder")).expect("a folder");
    let mut run = place.begin(&RunFiles::default(), 0).expect("a run");
    let files = RunFiles { hash: Some(place.at("folder")), ..replay(&path) };
    run.session.begin(&files, 0).expect_err("a folder");
    assert!(!run.session.is_replay());
    run.session.begin(&replay(&path), 0).expect("nothing is kept");
    assert!(is_kept(run.session.apply(Despawn(StateId(1)))), "a replay takes no inputs");
}

#[test]
fn snapshots_belong_to_the_files_that_a_run_began_with() {
    let place = place();
    let path = place.at("scene.ron");
    let options = LoadOptions { cache: false, ..LoadOptions::default() };
    let mut session = Session::load(&path, &options).expect("a scene");
    fs::remove_file(&path).expect("a file");
    session.begin(&RunFiles::default(), 0).expect("a run that needs no files");
    place.file("scene.ron", SCENE.replace("seed: 7", "seed: 7 "));
    let expected = "could not be read when the run began";
    let a = place.at("a.snapshot");
    assert_has(&session.save_snapshot(&a).expect_err("refused").to_string(), &["a.snapshot", expected]);
    assert_has(&session.record(&place.at("a.rec")).expect_err("refused").to_string(), &[expected]);
    assert!(!a.exists());
}

/// Tries to go on from bytes that may be anything.
fn try_snapshot(place: &Folder, bytes: &[u8]) -> bool {
    let path = place.at("any.snapshot");
    fs::write(&path, bytes).expect("a file");
    let begun = place.begin(&RunFiles { from_snapshot: Some(path), ..RunFiles::default() }, 0);
    begun.is_ok_and(|mut run| run.step() > 0)
}

/// Magic numbers and versions of a recording and a snapshot.
static PRELUDES: LazyLock<[Vec<u8>; 2]> = LazyLock::new(|| {
    let place = place();
    let mut run = place.begin(&record(&place.at("a.rec")), 0).expect("a recording");
    run.session.save_snapshot(&place.at("a.snapshot")).expect("a snapshot");
    ["a.rec", "a.snapshot"].map(|name| place.read(name)[..12].to_vec())
});

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn files_that_are_anything_are_errors(
        bytes in proptest::collection::vec(any::<u8>(), 0..300),
        prelude in proptest::option::of(proptest::sample::select(vec![0, 1])),
    ) {
        let place = place();
        let bytes = [prelude.map_or(&[][..], |which| &PRELUDES[which]), &bytes].concat();
        prop_assert!(!try_snapshot(&place, &bytes));
        let recording = Recording::open(&place.at("any.snapshot"), &Inputs::default());
        let error = recording.expect_err("not a recording").to_string();
        // Those of a recording get beyond its beginning.
        prop_assert_eq!(prelude != Some(0), error.contains("not a Relief recording"), "{}", error);
        prop_assert!(!error.contains("version"), "{}", error);
    }
}

#[test]
fn snapshots_that_are_damaged_or_cut_are_refused() {
    let place = place();
    let mut run = place.begin(&RunFiles::default(), 0).expect("a run");
    let file = place.at("a.snapshot");
    run.session.save_snapshot(&file).expect("a snapshot");
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
fn what_happens_after_the_last_step_does_not_make_a_recording_differ() {
    let place = place();
    let path = place.at("run.rec");
    let mut run = place.begin(&record(&path), 0).expect("a recording");
    (0..5).for_each(|step| _ = run.act_and_step(step));
    run.session.simulation.world.resource_mut::<Inputs>().push(Despawn(StateId(0)));
    run.session.finish().expect("an end");
    let mut again = place.begin(&replay(&path), 0).expect("a replay");
    (0..5).for_each(|_| again.session.step().expect("as recorded"));
    let state = |run: &mut Run| run.session.hash();
    assert_ne!(state(&mut again), state(&mut run), "it came later");
    again.session.finish().expect("as recorded");
    assert_eq!(state(&mut again), state(&mut run), "at the end of the run it is there");
}
