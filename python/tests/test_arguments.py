"""Arguments of wrong types and values: every error names the argument and what was expected, and numbers of numpy are
numbers."""

import inspect
import math
import re

import numpy as np
import pytest

import relief
from conftest import SCENES

#: Kinds of arguments, and values that none of the kind takes.
WRONG = {
    "number": ["abc", "", [], (1, 2), {}, object(), np.zeros(3), 10**400, math.nan, None],
    "count": ["abc", 1.5, math.nan, math.inf, [], -1, 2**70, np.zeros(3), np.float32(2), object(), None],
    "index": ["abc", 1.5, [], np.zeros(3), object()],
    "flag": ["abc", "", 1, 0.0, [], np.zeros(3), object(), None],
    "text": [1, 1.5, b"abc", ["abc"], np.zeros(3), object(), None],
    "path": [1, 1.5, ["abc"], np.zeros(3), object(), None],
    "point": ["abc", 5, (), (1, 2), (1, 2, 3, 4), (1, 2, "3"), (0, math.nan, 0), (1e300, 0, 0), np.zeros((3, 3)),
              np.array("abc"), {}, object(), None],
    "matrix": ["abc", 5, (), np.zeros((3, 3)), np.eye(5), [[1, 2], "ab"], np.full((4, 4), math.inf), np.zeros((4, 4)),
               object(), None],
    "size": ["abc", 5, (), (1,), (1, 2, 3), (4.5, 4), (-1, 4), (2**40, 4), np.zeros((2, 2)), object()],
    "names": [5, 1.5, [1], np.zeros(3), object()],
    "numbers": ["abc", 5, {}, ["a"], [math.nan], [math.inf], np.zeros((2, 2, 2)), object(), None],
    "few numbers": ["abc", 5, {}, ["a"], [math.nan], [0.0] * 20, np.zeros((2, 2, 2)), object()],
    "pair": ["abc", 5, (1,), (1, 2, 3), ("a", "b"), (math.nan, 1), np.zeros((2, 2)), object()],
    "K": ["abc", 5, (), (1, 2, 3), ("a",) * 4, (math.nan, 1, 1, 1), np.zeros((3, 3)), np.eye(4), np.ones((3, 3)),
          object()],
    "color": ["red", "#12", 5, (), (1, 2), (-1, 0, 0), (math.nan, 0, 0), object()],
    "light": ["point", 5, (), object(), None],
    "like": [5, 1.5, (), object(), None],
    "worlds": [5, "abc", None, object(), [1], ["abc"]],
    "bytes": ["abc", 5, 1.5, object(), None],
    "fields": ["abc", 5, [], object(), {"nonsense": 1}, {1: 2}, {"at": object()}],
    "exposure": ["abc", [], (1, 2), {}, {"metered": {"kee": 1}}, object(), np.zeros(3), -1, math.nan],
    "beams": [1, 1.5, b"abc", ["abc"], np.zeros(3), object(), "vlp17", {"grid": {"rows": 4}}, {"list": []}],
}
#: Arguments that may be left out take None for that.
OPTIONAL = object()


def calls(sim):
    """Each call of the package: its name, the call, the name of its argument, the kind, and whether it may be None."""
    lamp = sim.spawn_light(relief.Light.spot(1), at=(0, 3, 0), name="lamp")
    car = sim.spawn_vehicle("car", at=(0, 0, 0), name="ego")
    box = sim.spawn_mesh("crate", at=(0, 1, 5))
    portal = relief.Sim(SCENES / "rooms.ron").portals[0]
    car.add_camera("front", size=(8, 8))
    car.add_collision("touch")
    car.add_lidar("top", columns=36)
    sim.step()
    capture = sim.capture()
    route = sim.routes[0]

    def setter(entity, name):
        return lambda value: setattr(entity, name, value)

    yield relief.Sim, "scene", "path", OPTIONAL
    yield relief.Sim, "step_seconds", "number", OPTIONAL
    yield relief.Sim, "geo_origin", "fields", OPTIONAL
    yield relief.Sim, "environment", "fields", OPTIONAL
    for method in (relief.Sim, sim.fresh, sim.reset):
        yield method, "seed", "count", OPTIONAL
    yield sim.step, "n", "count", OPTIONAL
    yield sim.restore, "snapshot", "bytes", None
    yield sim.record, "path", "path", None
    yield sim.entity, "id", "count", None
    for thing in (sim, capture, capture["front"], capture["top"]):
        yield thing.__getitem__, 0, "text", ("name", "missing")
    yield capture["touch"].__getitem__, 0, "index", ("index", "missing")
    yield sim.capture, 0, "text", ("names", "missing")
    yield sim.look, 0, "text", ("names", "missing")

    spawn_vehicle = lambda **given: sim.spawn_vehicle(given.pop("kind", "car"), **given)
    yield spawn_vehicle, "kind", "text", None
    yield spawn_vehicle, "at", "point", OPTIONAL
    at = lambda **given: spawn_vehicle(at=(0, 0, 0), **given)
    for name, kind in [("yaw", "number"), ("name", "text"), ("manual", "flag"), ("paint", "count"), ("route", "text")]:
        yield at, name, kind, OPTIONAL
    on = lambda **given: spawn_vehicle(**{"route": "main", **given})
    for name, kind in [("lane", "count"), ("along", "number"), ("speed", "number"), ("route", "text")]:
        yield on, name, kind, OPTIONAL

    light = lambda **given: sim.spawn_light(given.pop("light", relief.Light.spot(1)), **given)
    for name, kind in [("at", "point"), ("yaw", "number"), ("pitch", "number"), ("look_at", "point"), ("name", "text")]:
        yield light, name, kind, OPTIONAL
    yield light, "light", "light", None
    mesh = lambda **given: sim.spawn_mesh(**{"like": "crate", "at": (0, 0, 0), **given})
    yield mesh, "like", "like", None
    yield mesh, "at", "point", None
    turn = [("yaw", "number"), ("pitch", "number"), ("roll", "number")]
    for name, kind in [*turn, ("scale", "point"), ("name", "text")]:
        yield mesh, name, kind, OPTIONAL

    for make in (relief.Light.point, relief.Light.spot, relief.Light.directional):
        intensity = lambda make=make, **given: make(**{"intensity": 1, **given})
        yield intensity, "intensity", "number", None
        yield intensity, "color", "color", OPTIONAL
        yield intensity, "shadows", "flag", OPTIONAL
    for make in (relief.Light.point, relief.Light.spot):
        for name in ("range", "radius"):
            yield lambda make=make, **given: make(1, **given), name, "number", OPTIONAL
    yield lambda **given: relief.Light.directional(1, **given), "angle_degrees", "number", OPTIONAL
    for name in ("outer_degrees", "inner_degrees"):
        yield lambda **given: relief.Light.spot(1, **given), name, "number", OPTIONAL
    for name, kind in [("intensity", "number"), ("range", "number"), ("color", "color"), ("on", "flag")]:
        yield setter(lamp, name), 0, kind, (name, "missing")
    yield setter(lamp, "shadows"), 0, "flag", ("shadows", "missing")
    yield setter(lamp, "radius"), 0, "number", ("radius", "missing")
    yield lamp.change, "light", "light", None
    yield setter(portal, "open"), 0, "number", ("open", "missing")
    signal = lambda **given: sim.set_signal(**{"name": "crossing", "shows": "red", **given})
    yield signal, "name", "text", None
    yield signal, "shows", "names", OPTIONAL
    weather = lambda **given: sim.set_weather(
        **{"sun_azimuth_degrees": 90, "sun_elevation_degrees": 30, **given}
    )
    yield weather, "preset", "text", OPTIONAL
    yield weather, "date", "text", OPTIONAL
    for name in ("over_seconds", "time_speed", "haze", "clouds", "glow"):
        yield weather, name, "number", OPTIONAL

    for name, kind in [("position", "point"), ("transform", "matrix"), ("hidden", "flag")]:
        yield setter(box, name), 0, kind, (name, "missing")
    place = lambda **given: box.place(given.pop("at", (0, 1, 5)), **given)
    yield place, "at", "point", None
    for name, kind in [*turn, ("look_at", "point")]:
        yield place, name, kind, OPTIONAL
    yield setter(car, "manual"), 0, "flag", ("manual", "missing")
    move = lambda **given: car.move(given.pop("at", (0, 0, 0)), **given)
    yield move, "at", "point", None
    for name in ("yaw", "pitch", "roll", "yaw_rate", "stamp"):
        yield move, name, "number", OPTIONAL
    yield move, "velocity", "point", OPTIONAL
    for name in ("throttle", "brake", "steer"):
        yield car.drive, name, "number", OPTIONAL
    for name in ("headlights", "indicator"):
        yield car.drive, name, "text", OPTIONAL

    place = [("at", "point"), *turn, ("look_at", "point"), ("every", "count"), ("phase", "count")]
    own = {
        "camera": [("size", "size"), ("near", "number"), ("far", "number"), ("samples", "count"), ("outputs", "names"),
                   ("exposure", "exposure"), ("noise", "fields"), ("K", "K"), ("fov_y_degrees", "number"),
                   ("fov_x_degrees", "number"), ("half_height", "number"),
                   ("distortion", "few numbers"), ("fisheye", "few numbers"), ("largest_degrees", "number")],
        "lidar": [("beams", "beams"), ("hz", "number"), ("columns", "count"), ("range", "pair"),
                  ("attenuation", "number"), ("sweep", "flag"), ("range_sigma", "number"), ("drop_rate", "number"),
                  ("drop_below", "number")],
        "imu": [("accelerometer_density", "number"), ("gyroscope_density", "number"), ("accelerometer_bias", "point"),
                ("gyroscope_bias", "point")],
        "gnss": [("horizontal_sigma", "number"), ("vertical_sigma", "number"), ("velocity_sigma", "number")],
        "collision": [("margin", "number")],
        "lane": [("reach", "number")],
    }
    for sensor, arguments in own.items():
        for mounted_on in (car, sim) if hasattr(sim, f"add_{sensor}") else (car,):
            add = lambda add=getattr(mounted_on, f"add_{sensor}"), **given: add(**{"name": "a", **given})
            yield add, "name", "text", None
            for name, kind in [*place, *arguments]:
                fisheye = lambda add=add, **given: add(K=(9, 9, 4, 4), fisheye=(0, 0), **given)
                yield fisheye if name == "largest_degrees" else add, name, kind, OPTIONAL

    yield route.points, "along", "numbers", None
    yield lambda **given: route.points([1.0], **given), "lane", "count", OPTIONAL
    yield route.yaw, "along", "number", None
    pictures = [lambda take=take, **given: take(sensor="front", **given) for take in (relief.capture, relief.look)]
    columns = lambda **given: relief.capture_columns(names="front", **given)
    for function in (relief.step, relief.capture_due, columns, *pictures):
        yield function, "sims", "worlds", None
    yield lambda **given: relief.step([sim], **given), "n", "count", OPTIONAL
    yield lambda **given: relief.capture([sim], **given), "sensor", "text", None
    yield lambda **given: relief.capture_columns([sim], **given), "names", "names", None
    yield lambda **given: relief.capture_columns([sim], "front", **given), "without", "names", OPTIONAL
    for take in (relief.capture, relief.look):
        yield lambda take=take, **given: take([sim], "front", **given), "device", "text", OPTIONAL
    yield relief.replay, "recording", "path", None
    yield lambda **given: relief.replay("none.rec", **given), "scene", "path", OPTIONAL
    yield relief.set_threads, "threads", "count", None


@pytest.fixture
def all_calls(road):
    return list(calls(road))


def test_what_is_refused_is_named_and_what_was_expected(all_calls):
    faults, count = [], 0
    for function, name, kind, optional in all_calls:
        for value in WRONG[kind]:
            if value is None and optional is OPTIONAL:
                continue
            if isinstance(optional, tuple):
                name = optional[0]
            count += 1
            try:
                function(value) if isinstance(optional, tuple) else function(**{name: value})
            except (TypeError, ValueError, OverflowError) as error:
                message = str(error)
                if not re.match(rf".*\b{name}\b.*\bexpected\b", message) and not re.search("unknown|missing field", message):
                    faults.append(f"{name} = {value!r}: {type(error).__name__}: {message}")
            except Exception as error:  # What is not of these kinds is at fault, too.
                faults.append(f"{name} = {value!r}: {type(error).__name__}: {error}")
            else:
                faults.append(f"{name} = {value!r}: accepted")
    assert count > 900
    assert not faults, f"{len(faults)} of {count}:\n" + "\n".join(faults)


def test_every_argument_of_the_package_is_among_these(all_calls):
    tried = {name for _, name, _, optional in all_calls if not isinstance(optional, tuple)}
    owners = [relief, relief.Sim, relief.Entity, relief.Vehicle, relief.LightEntity, relief.Light, relief.Route]
    for owner in owners:
        for name, member in vars(owner).items():
            of_rust = getattr(member, "__module__", None) in (None, "relief._relief", "builtins")
            if name.startswith("_") or not callable(member) or inspect.isclass(member) or not of_rust:
                continue
            for parameter in inspect.signature(member).parameters.values():
                is_single = parameter.kind not in (parameter.VAR_KEYWORD, parameter.VAR_POSITIONAL)
                if is_single and parameter.name != "self":
                    assert parameter.name in tried, f"{owner.__name__}.{name}: {parameter.name}"


def test_numbers_of_numpy_are_numbers(road):
    for kind in (np.float16, np.float32, np.float64, np.int8, np.int32, np.int64, np.uint8):
        one = kind(1)
        car = road.spawn_vehicle("car", at=(one, one, one), yaw=one, paint=int(one), manual=np.True_)
        car.drive(throttle=one, brake=one, steer=one)
        assert car.controls["steer"] == 1
        camera = car.add_camera(
            "camera", at=np.full(3, one), K=np.diag([one] * 3), near=one, far=kind(9), exposure=one, size=(8, 8)
        )
        assert camera.K[0, 0] == 1
        lamp = road.spawn_light(relief.Light.spot(one, one, outer_degrees=kind(9), color=np.full(3, one)))
        lamp.intensity = one
        lamp.shadows = np.bool_(True)
        road.routes[0].points(np.arange(3).astype(kind), lane=0)
        assert isinstance(road.routes[0].yaw(one), float)
    for kind in (np.int8, np.int32, np.int64, np.uint8, np.uint64):
        two = kind(2)
        assert road.step(two) == road.steps
        camera = road.add_camera(f"of {kind.__name__}", size=np.full(2, two), every=two, phase=kind(1), samples=kind(4))
        assert camera.size == (2, 2) and camera.every == 2
        relief.step([road], two)
        relief.step((road,), np.full(1, two))
        assert road.entity(two).id == 2
    lidar = road.add_lidar("lidar", range=[np.float32(1), 50], columns=np.int32(36), beams=np.str_("vlp16"))
    assert lidar.kind == "lidar"


def test_one_output_needs_no_tuple(field):
    assert field.add_camera("a", outputs="depth").outputs == ["depth"]
    assert field.add_camera("b", outputs=["depth"]).outputs == ["depth"]
    assert field.add_camera("c", outputs=np.array(["depth", "color"])).outputs == ["color", "depth"]
    with pytest.raises(ValueError, match=r'outputs: unknown value "colour" \(did you mean "color"\?\); expected one of: color'):
        field.add_camera("d", outputs="colour")


def test_arguments_that_there_are_not(field):
    car = field.spawn_vehicle("car", at=(0, 0, 0))
    known = "expected one of: at, yaw, .*size"
    with pytest.raises(TypeError, match=rf'unexpected argument "width" \(did you mean "size"\?\); {known}'):
        field.add_camera("a", width=64)
    with pytest.raises(TypeError, match=r'unexpected argument "sise" \(did you mean "size"\?\); expected one of'):
        car.add_camera("a", sise=(4, 4))
    with pytest.raises(TypeError, match=r'unexpected argument "colums" \(did you mean "columns"\?\)'):
        car.add_lidar("a", colums=4)
    with pytest.raises(TypeError, match="unexpected keyword argument 'naem'"):
        field.spawn_vehicle("car", at=(0, 0, 0), naem="ego")


def test_what_was_found_is_shown(field):
    def message(call):
        with pytest.raises((TypeError, ValueError, OverflowError)) as caught:
            call()
        return str(caught.value)

    sim = field
    found = 'sims: expected a list of Sim, found <Sim of "field", step 0>'
    assert message(lambda: relief.capture(sim, "front")) == found
    assert message(lambda: relief.step([sim, 5])) == "sims[1]: expected a Sim, found 5"
    whole = f"expected a whole number from 0 to {2**64 - 1}"
    assert message(lambda: relief.step([sim], n=[1.5])) == f"n[0]: {whole}, found 1.5"
    assert message(lambda: sim.add_lidar("top", beams=64)) == "beams: expected a string or a dictionary, found 64"
    assert message(lambda: sim.step(-1)) == f"n: {whole}, found -1"
    assert message(lambda: sim.add_camera("a", at=(0, 0))) == "at: expected 3 numbers, found (0, 0)"
    found = "at: expected 3 numbers, found ndarray of shape (2, 2)"
    assert message(lambda: sim.add_camera("a", at=np.zeros((2, 2)))) == found
    assert message(lambda: sim.add_camera("a", size=64)) == "size: expected (width, height) in whole pixels, found 64"
    long = message(lambda: sim.add_camera("a", yaw="long" * 100))
    assert long == "yaw: expected a number, found '" + ("long" * 100)[:59] + "…"


def test_errors_of_a_values_own_code_come_through(field):
    class Interrupted:
        def __float__(self):
            raise KeyboardInterrupt

        def __repr__(self):
            raise RuntimeError

    with pytest.raises(KeyboardInterrupt):
        field.add_camera("a", yaw=Interrupted())
    with pytest.raises(TypeError, match="seed: expected a whole number .*, found Interrupted"):
        field.fresh(seed=Interrupted())
