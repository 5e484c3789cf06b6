"""Weather: its fields, changes of it, and that it is state; and what a camera sees of it."""

import numpy as np
import pytest

import relief

DEFAULTS = {
    "sky": "gradient",
    "date": "2026-06-21T12:00:00Z",
    "time_speed": 1.0,
    "sun_azimuth_degrees": None,
    "sun_elevation_degrees": None,
    "moon_azimuth_degrees": None,
    "moon_elevation_degrees": None,
    "haze": 40000.0,
    "clouds": 0.0,
    "glow": 0.0002,
}
#: Clear noon's and overcast's: azimuth and elevation of the sun, haze, clouds.
NOON, OVERCAST = (150.0, 55.0, 40000.0, 0.0), (150.0, 40.0, 20000.0, 1.0)


@pytest.fixture
def munich():
    """An open field with a place on Earth."""
    return relief.Sim(geo_origin={"latitude_degrees": 48.1, "longitude_degrees": 11.6})


def values(sim):
    names = ("sun_azimuth_degrees", "sun_elevation_degrees", "haze", "clouds")
    return tuple(sim.weather[name] for name in names)


def test_a_scene_without_weather_has_the_default_one(field):
    assert field.weather == DEFAULTS
    # What is shown is a copy.
    field.weather["clouds"] = 1.0
    assert field.weather == DEFAULTS


def test_a_preset_and_fields_of_its_own(field):
    field.set_weather("clear_noon")
    assert field.weather["sky"] == "atmosphere" and values(field) == NOON
    field.set_weather("overcast", haze=5000, glow=0.1)
    assert values(field) == (150, 40, 5000, 1) and field.weather["glow"] == 0.1
    # What is not given stays.
    field.set_weather(clouds=0.5)
    assert values(field) == (150, 40, 5000, 0.5) and field.weather["glow"] == 0.1
    field.set_weather(sky="gradient", moon_azimuth_degrees=20, moon_elevation_degrees=10)
    assert field.weather["sky"] == "gradient" and field.weather["moon_azimuth_degrees"] == 20
    field.set_weather(moon_azimuth_degrees=None, moon_elevation_degrees=None)
    assert field.weather["moon_azimuth_degrees"] is None and field.weather["moon_elevation_degrees"] is None


def test_a_change_is_linear_in_the_steps(field):
    second = round(1 / field.step_seconds)
    field.set_weather("clear_noon")
    field.set_weather("overcast", over_seconds=2)
    for part in (0, 0.5, 1, 1):
        expected = [a + (b - a) * part for a, b in zip(NOON, OVERCAST)]
        # Numbers of 64 bits.
        assert values(field) == pytest.approx(expected, rel=1e-12)
        field.step(second)
    assert values(field) == OVERCAST
    # The sky itself changes at once.
    field.set_weather(sky="gradient", over_seconds=10)
    assert field.weather["sky"] == "gradient"


def test_the_date_goes_on(munich):
    second = round(1 / munich.step_seconds)
    munich.step(second)
    assert munich.weather["date"] == "2026-06-21T12:00:01Z"
    munich.set_weather(date="2026-11-28T07:30+01:00", time_speed=3600)
    assert munich.weather["date"] == "2026-11-28T06:30:00Z"
    munich.step(second)
    assert munich.weather["date"] == "2026-11-28T07:30:00Z"
    # A preset leaves the date alone, and how fast it goes on.
    munich.set_weather("dusk")
    assert munich.weather["date"] == "2026-11-28T07:30:00Z" and munich.weather["time_speed"] == 3600


def test_a_sun_by_date_needs_a_place_on_earth(field, munich):
    munich.set_weather(sky="atmosphere", date="2026-06-21T12:00+02:00")
    assert munich.weather["sky"] == "atmosphere" and munich.weather["sun_azimuth_degrees"] is None
    munich.set_weather("golden_hour")
    assert munich.weather["sun_elevation_degrees"] == 6
    munich.set_weather(sun_azimuth_degrees=None, sun_elevation_degrees=None)
    assert munich.weather["sun_elevation_degrees"] is None
    with pytest.raises(ValueError, match="expected sun_azimuth_degrees and sun_elevation_degrees, .* geo_origin"):
        field.set_weather(sky="atmosphere")
    field.set_weather("golden_hour")
    before = field.weather
    with pytest.raises(ValueError, match="geo_origin"):
        field.set_weather(sun_azimuth_degrees=None, sun_elevation_degrees=None)
    assert field.weather == before


@pytest.mark.parametrize(
    "given, error, message",
    [
        ({"preset": "golden_our"}, ValueError, r'unknown weather "golden_our" \(did you mean "golden_hour"\?\)'),
        ({"preset": 3}, TypeError, "preset: expected a string, found 3"),
        ({"hase": 3000}, TypeError, r'unexpected argument "hase" \(did you mean "haze"\?\)'),
        ({"sky": "atmosfere"}, ValueError, r'sky: unknown value "atmosfere" \(did you mean "atmosphere"\?\)'),
        ({"haze": 1000}, ValueError, "haze: expected a number from 2000 to 200000, found 1000"),
        ({"haze": float("nan")}, ValueError, "haze: expected a finite number"),
        ({"haze": "thick"}, TypeError, "haze: expected a number, found 'thick'"),
        ({"clouds": 2}, ValueError, "clouds: expected a number from 0 to 1, found 2"),
        ({"glow": -1}, ValueError, "glow: expected a number from 0 to 10, found -1"),
        ({"time_speed": -1}, ValueError, "time_speed: expected a number from 0 to 10000, found -1"),
        ({"sun_azimuth_degrees": 90}, ValueError, "sun_elevation_degrees is missing"),
        (
            {"sun_azimuth_degrees": 90, "sun_elevation_degrees": 91},
            ValueError,
            "sun_elevation_degrees: expected a number from -90 to 90, found 91",
        ),
        ({"date": "2026-06-21T12:00"}, ValueError, "date: expected a date from 1900 to 2100 with its offset from UTC"),
        ({"date": "2026-02-31T12:00Z"}, ValueError, "date: expected a date from 1900 to 2100"),
        ({"date": "1899-12-31T00:00Z"}, ValueError, "date: expected a date from 1900 to 2100"),
        ({"over_seconds": -1}, ValueError, "over_seconds: expected seconds from 0 to 86400, found -1"),
        ({"over_seconds": float("inf")}, ValueError, "over_seconds: expected seconds from 0 to 86400, found inf"),
        ({"over_seconds": float("nan")}, ValueError, "over_seconds: expected seconds from 0 to 86400, found NaN"),
    ],
)
def test_what_is_refused(field, given, error, message):
    before = field.hash()
    with pytest.raises(error, match=message):
        field.set_weather(**given)
    assert field.weather == DEFAULTS and field.hash() == before


def test_weather_is_in_recordings(field, tmp_path):
    path = tmp_path / "run.rec"
    with field.record(path):
        field.set_weather("overcast", over_seconds=1)
        field.step(30)
        field.set_weather(clouds=0.25, over_seconds=0.1)
        field.step(30)
    again = relief.replay(path)
    assert again.hash() == field.hash() and again.weather == field.weather
    assert again.weather["clouds"] == 0.25


def test_weather_is_in_snapshots_in_the_middle_of_a_change(field):
    begun = field.hash()
    field.set_weather("clear_noon")
    assert field.hash() != begun
    field.set_weather("overcast", over_seconds=2)
    field.step(45)
    shot, then, weather = field.snapshot(), field.hash(), field.weather
    field.step(60)
    later = field.hash()
    field.set_weather("night")
    for sim in (field, field.fresh()):
        sim.restore(shot)
        assert sim.hash() == then and sim.weather == weather
        fork = sim.fork()
        for own in (sim, fork):
            own.step(60)
            assert own.hash() == later
    field.reset()
    assert field.hash() == begun and field.weather == DEFAULTS


def test_captures_leave_the_state_alone(field):
    field.add_camera("eye", size=(16, 12), at=(0, 2, 0), outputs=("color",))
    field.set_weather("clear_noon")
    before, entities = field.hash(), len(field.entities)
    field.capture()
    assert field.hash() == before and len(field.entities) == entities


def test_a_sky_is_blue_at_noon_and_dark_at_night(field):
    # Half up and away from the sun: nothing but sky.
    field.add_camera("up", size=(16, 12), at=(0, 2, 0), look_at=(30, 32, 0), outputs=("color", "linear"))
    # And level with the ground, whose upper rows are sky.
    field.add_camera("ahead", size=(16, 12), at=(0, 2, 0), look_at=(30, 2, 0), outputs=("color",))
    field.set_weather("clear_noon")
    noon = field.capture()
    linear = noon["up"].linear.astype(float)
    assert np.isfinite(linear).all()
    assert (linear[..., 2] > 1.2 * linear[..., 0]).all()
    for name in ("up", "ahead"):
        upper = noon[name].color[:3].astype(int)
        assert (upper[..., 2] > upper[..., 0]).all(), name
    # An overcast sky is grey.
    field.set_weather("overcast")
    grey = field.capture()["up"].linear.astype(float)
    np.testing.assert_allclose(grey[..., 2], grey[..., 0], rtol=0.01)
    field.set_weather("night")
    night = field.capture()["up"].linear.astype(float)
    # By a full moon a sky is some 400,000 times as dark; exposure gives most of that back.
    assert 0 < night.mean() < linear.mean() / 10
