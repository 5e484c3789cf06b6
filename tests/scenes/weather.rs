//! Weather of scene files: presets and fields, and what is refused.

use super::*;
use relief::recording::RunFiles;
use systems::weather::{SkyModel, Weather, WeatherTimeline};

/// Weather that a scene begins with.
fn weather(text: &str) -> Weather {
    let (simulation, scene) = load(text);
    assert_eq!(scene.warnings, Vec::<String>::new(), "{text}");
    let timeline = simulation.world.resource::<WeatherTimeline>();
    let weather = timeline.now(simulation.world.resource::<Clock>());
    assert_eq!(*timeline, WeatherTimeline::new(weather.clone()), "{text}");
    weather
}

fn sun_at(azimuth: f64, elevation: f64) -> Weather {
    Weather {
        sky: SkyModel::Atmosphere,
        sun_azimuth_degrees: Some(azimuth),
        sun_elevation_degrees: Some(elevation),
        ..Weather::default()
    }
}

#[test]
fn weather_is_a_preset_or_fields() {
    assert_eq!(weather("()"), Weather::default());
    assert_eq!(weather("(weather: (sky: gradient))"), Weather::default());
    for name in ["clear_noon", "overcast", "golden_hour", "dusk", "night"] {
        assert_eq!(weather(&format!("(weather: \"{name}\")")), Weather::preset(name).expect("a preset"));
    }
    let golden = weather("(weather: \"golden_hour\")");
    assert_eq!((golden.sky, golden.sun_elevation_degrees), (SkyModel::Atmosphere, Some(6.0)));
    let fields = "(sky: atmosphere, sun_azimuth_degrees: 90, sun_elevation_degrees: 30, haze: 20000)";
    let expected = Weather { haze: 20_000.0, ..sun_at(90.0, 30.0) };
    assert_eq!(weather(&format!("(weather: {fields})")), expected);
    let all = "(sky: atmosphere, date: \"2026-11-28T07:30+01:00\", time_speed: 60, sun_azimuth_degrees: -90,
        sun_elevation_degrees: 0.5, moon_azimuth_degrees: 10, moon_elevation_degrees: 20, haze: 2000, clouds: 0.25,
        glow: 0.05)";
    let expected = Weather {
        date: "2026-11-28T06:30Z".parse().expect("a date"),
        time_speed: 60.0,
        moon_azimuth_degrees: Some(10.0),
        moon_elevation_degrees: Some(20.0),
        haze: 2000.0,
        clouds: 0.25,
        glow: 0.05,
        ..sun_at(-90.0, 0.5)
    };
    assert_eq!(weather(&format!("(weather: {all})")), expected);
    let by_date = "(geo_origin: (latitude_degrees: 48, longitude_degrees: 11), weather: (sky: atmosphere))";
    assert_eq!(weather(by_date), Weather { sky: SkyModel::Atmosphere, ..Weather::default() });
}

/// Faults of weather with their places.
const FAULTS: &str = r##"
    (weather: "golden_our") → 1:12: unknown weather "golden_our" (did you mean "golden_hour"?)
    (weather: (hase: 3000)) → 1:12: unknown field "hase"; did you mean "haze"?
    (weather: (sky: atmosfere)) → 1:17: unknown variant "atmosfere"; did you mean "atmosphere"?
    (
     weather: (clouds: 0,5),
    )
    → 2:20: weather.clouds: found `0,5`; use a decimal point, not a comma: 0.5
    (weather: (sky: atmosphere))
    → 1:11: weather: expected sun_azimuth_degrees and sun_elevation_degrees, or the scene's geo_origin, by which the sun
      stands at its date
    (weather: (sun_azimuth_degrees: 90))
    → 1:33: weather.sun_azimuth_degrees: expected azimuth and elevation of the sun, or none of them;
      sun_elevation_degrees is missing
    (weather: (moon_elevation_degrees: 5))
    → 1:36: weather.moon_elevation_degrees: expected azimuth and elevation of the moon, or none of them;
      moon_azimuth_degrees is missing
    (weather: (clouds: 2)) → 1:20: weather.clouds: expected a number from 0 to 1, found 2
    (weather: (haze: 1000)) → 1:18: weather.haze: expected a number from 2000 to 200000, found 1000
    (weather: (haze: NaN)) → 1:18: weather.haze: expected a number from 2000 to 200000, found NaN
    (weather: (glow: -1)) → 1:18: weather.glow: expected a number from 0 to 10, found -1
    (weather: (time_speed: inf)) → 1:24: weather.time_speed: expected a number from 0 to 10000, found inf
    (weather: (sun_azimuth_degrees: 400, sun_elevation_degrees: 5))
    → 1:33: weather.sun_azimuth_degrees: expected a number from -360 to 360, found 400
    (weather: (sun_azimuth_degrees: 40, sun_elevation_degrees: 91))
    → 1:60: weather.sun_elevation_degrees: expected a number from -90 to 90, found 91
    (weather: (date: "1899-12-31T00:00Z"))
    → 1:19: weather.date: expected a date from 1900 to 2100 with its offset from UTC, as "2026-06-21T12:00+02:00"
"##;

#[test]
fn faults_of_weather_are_told_with_their_places() {
    let folder = Folder::with_model();
    for (text, expected) in cases(FAULTS) {
        assert_eq!(folder.problems(&text), [expected], "{text}");
    }
    // The end is told by the library that reads dates.
    let start = "1:19: weather.date: expected a date from 1900 to 2100 with its offset from UTC, as \
                 \"2026-06-21T12:00+02:00\": ";
    for (date, words) in [("2026-06-21T12:00", "offset"), ("2026-02-31T12:00Z", "not valid"), ("noon", "year")] {
        let problems = folder.problems(&format!("(weather: (date: \"{date}\"))"));
        let problem = only(&problems);
        assert!(problem.starts_with(start) && problem[start.len()..].contains(words), "{problem}");
    }
    // A name without quotes, too, which is no fault where a choice is expected.
    for text in ["(weather: 3)", "(weather: [1, 2])", "(weather: true)", "(weather: dusk)"] {
        assert_has(only(&folder.problems(text)), &["1:", "the name of a preset in quotes"]);
    }
}

/// Weather of a command line or a window begins a run as an input: a recording has it, and a replay needs it no more.
#[test]
fn weather_of_a_run_is_an_input() {
    let folder = Folder::with_model();
    let scene = folder.file("scene.ron", "(entities: [(light: point())])");
    let overcast = Weather::preset("overcast").expect("a preset");
    let session = |weather: Option<Weather>, files: &RunFiles| {
        let options = LoadOptions { weather, cache: false, ..LoadOptions::default() };
        let mut session = Session::load(&scene, &options).expect("a scene");
        session.begin(files, 0).expect("a run");
        session
    };
    let now = |session: &Session| {
        let world = &session.simulation.world;
        world.resource::<WeatherTimeline>().now(world.resource::<Clock>())
    };
    let plain = session(None, &RunFiles::default());
    assert_eq!(now(&plain), Weather::default());
    let path = folder.at("run.rec");
    let mut run = session(Some(overcast.clone()), &RunFiles { record: Some(path.clone()), ..RunFiles::default() });
    assert_eq!(now(&run), overcast);
    (0..10).for_each(|_| run.step().expect("a step"));
    let end = run.hash();
    run.finish().expect("an end");
    // Its own weather has no effect on a replay.
    for weather in [None, Weather::preset("night")] {
        let mut again = session(weather, &RunFiles { replay: Some(path.clone()), ..RunFiles::default() });
        (0..10).for_each(|_| again.step().expect("a step"));
        assert_eq!(again.hash(), end);
        assert_eq!(now(&again).clouds, 1.0);
    }
}
