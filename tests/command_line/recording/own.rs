//! Inputs and state of a program of one's own, and files of another one.

use super::*;

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
            let mut inputs = run.session.simulation.world.resource_mut::<Inputs>();
            turns.iter().filter(|(at, _)| *at == step).for_each(|(_, turn)| inputs.push(turn.clone()));
            run.act_and_step(step)
        };
        let hashes: Vec<u128> = (0..20).map(|step| act(step, &mut run)).collect();
        run.session.finish().expect("an end");
        let mut again = place.begin_in(with_turns, &replay(&place.at("run.rec")), 0).expect("a recording");
        let replayed: Vec<u128> = (0..20).map(|_| again.step()).collect();
        prop_assert_eq!(replayed, hashes);
        let applied = |run: &Run| run.session.simulation.world.resource::<Turned>().0.clone();
        let sound = (0..20).flat_map(|step| turns.iter().filter(move |(at, turn)| *at == step && turn.is_valid()));
        let sound: Vec<Turn> = sound.map(|(_, turn)| turn.clone()).collect();
        prop_assert_eq!(&applied(&run), &sound);
        prop_assert_eq!(&applied(&again), &sound);
    }
}

/// A recording whose only block of inputs holds this one.
fn recording_of(place: &Folder, input: SavedInput) -> PathBuf {
    let path = place.at("one.rec");
    let Run { mut session } = place.begin_in(with_turns, &RunFiles::default(), 0).expect("a run");
    let identity = Identity { scene: "scene.ron".into(), ..session.identity().expect("files") };
    let mut recorder = Recorder::create(&path, identity, &mut session.simulation).expect("a recording");
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
