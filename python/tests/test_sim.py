"""Worlds: what is spawned, changed and driven; steps, hashes, snapshots, forks and recordings."""

import copy
import gc
import math
import pickle
import re
import threading
import time

import numpy as np
import pytest

import relief


def test_a_vehicle_is_driven_by_hand(field):
    car = field.spawn_vehicle("car", at=(1, 0, 5), yaw=0.5, name="ego", manual=True)
    assert isinstance(car, relief.Vehicle) and field["ego"] == car and "ego" in field
    assert car.type_ == "car" and car.alive and car.class_ == "car" and car.manual
    np.testing.assert_allclose(car.position, [1, 0, 5])
    assert car.yaw == pytest.approx(0.5, abs=1e-6)
    car.drive(throttle=0.5)
    assert field.step(60) == 60 and field.steps == 60
    assert field.seconds == pytest.approx(60 * field.step_seconds)
    assert car.speed > 0.5
    # It goes the way that it looks: yaw is about +Y, 0 along +Z, left (+X) positive.
    way = car.position - [1, 0, 5]
    assert np.arctan2(way[0], way[2]) == pytest.approx(0.5, abs=1e-3)
    car.drive(throttle=0.0, brake=1.0)
    field.step(120)
    assert car.speed == pytest.approx(0, abs=1e-3)
    assert car.controls["brake"] == 1 and car.controls["headlights"] == "low"


def test_lights_are_spawned_and_changed(field):
    lamp = field.spawn_light(relief.Light.point(intensity=4, range=12, color="#ff8000"), at=(1.5, 2, 1.5), name="lamp")
    assert lamp.kind == "point" and lamp.intensity == 4 and lamp.range == 12
    # sRGB 0x80 is linear 0.2158.
    np.testing.assert_allclose(lamp.color, (1, 0.21586, 0), atol=1e-4)
    lamp.intensity = 6
    lamp.color = (0.1, 0.2, 0.3)
    lamp.enabled = False
    assert lamp.intensity == 6 and not lamp.enabled
    np.testing.assert_allclose(lamp.color, (0.1, 0.2, 0.3))
    lamp.change(relief.Light.spot(2, 5, outer_degrees=20))
    assert lamp.kind == "spot" and lamp.enabled
    assert lamp in field.lights


def test_meshes_are_copied_and_moved(field):
    box = field.spawn_mesh("box", at=(0, 1, 20), yaw=0.3, scale=(2, 1, 4), name="wall")
    np.testing.assert_allclose(box.position, [0, 1, 20])
    box.position = (1, 2, 3)
    matrix = box.transform
    np.testing.assert_allclose(matrix[:3, 3], [1, 2, 3])
    np.testing.assert_allclose(np.linalg.norm(matrix[:3, :3], axis=0), [2, 1, 4], rtol=1e-6)
    matrix[0, 3] = 9
    box.transform = matrix
    np.testing.assert_allclose(box.transform, matrix, atol=1e-6)
    assert not box.hidden
    box.hidden = True
    assert box.hidden
    box.despawn()
    assert not box.alive
    with pytest.raises(relief.GoneError, match="is gone from its world"):
        box.position


def test_what_is_mounted_moves_with_what_it_is_on(field):
    car = field.spawn_vehicle("car", at=(0, 0, 0), yaw=np.pi / 2)
    camera = car.add_camera("front", at=(0, 1.5, 2))
    assert camera.parent == car and camera in car.children and camera in field.sensors
    # Forward of a car that looks along +X.
    np.testing.assert_allclose(camera.world_from_entity[:3, 3], [2, 1.5, 0], atol=1e-6)
    # A camera's entity looks along its own -Z.
    np.testing.assert_allclose(-camera.world_from_entity[:3, 2], [1, 0, 0], atol=1e-6)


def test_equal_runs_have_equal_hashes(road):
    other = road.fresh()
    assert road.hash() == other.hash()
    road.step(100)
    assert road.hash() != other.hash()
    other.step(100)
    assert road.hash() == other.hash()
    assert road.fresh(seed=8).hash() != road.fresh(seed=9).hash()


def test_several_worlds_are_stepped_as_one_by_one(road):
    worlds = [road.fresh(seed=i) for i in range(4)]
    plain = [road.fresh(seed=i) for i in range(4)]
    assert relief.step(worlds, 50) == [50] * 4
    for world in plain:
        world.step(50)
    assert [w.hash() for w in worlds] == [w.hash() for w in plain]
    with pytest.raises(ValueError, match="sims: expected every world once"):
        relief.step([road, road])


def test_a_snapshot_is_restored_in_place(road):
    ego = road.spawn_vehicle("van", route="main", lane=1, along=3, speed=5, manual=True)
    road.step(30)
    shot, then = road.snapshot(), road.hash()
    later = road.spawn_vehicle("car", at=(30, 0, 0))
    ego.drive(throttle=1)
    road.step(30)
    gone = road["crate"]
    road.restore(shot)
    assert road.hash() == then and road.steps == 30
    assert ego.alive and not later.alive
    # What the scene began with comes back, too.
    gone.despawn()
    assert not gone.alive
    road.restore(shot)
    assert gone.alive and road.hash() == then
    # And what was spawned.
    ego.despawn()
    road.restore(shot)
    assert ego.alive and ego.speed > 0 and road.hash() == then
    road.step(10)
    fork = road.fork()
    road.restore(shot)
    road.step(10)
    assert road.hash() == fork.hash()


def test_a_snapshot_of_another_scene_or_seed(road, field):
    other = road.fresh(seed=99)
    other.step(5)
    shot, hash_ = other.snapshot(), other.hash()
    road.restore(shot)
    assert road.seed == 99 and road.hash() == hash_
    before = field.hash()
    with pytest.raises(relief.RecordingError, match="made with another scene"):
        field.restore(shot)
    for broken in (b"", b"nonsense", shot[:-3], shot[:50], shot[:60] + b"x" + shot[61:]):
        with pytest.raises(relief.RecordingError):
            road.restore(broken)
    assert field.hash() == before and road.hash() == hash_


def test_a_fork_goes_its_own_way(road):
    road.step(20)
    other = road.fork()
    assert other.hash() == road.hash() and other.steps == 20
    vehicle = road.vehicles[0]
    same = other.entity(vehicle.id)
    np.testing.assert_array_equal(vehicle.position, same.position)
    assert vehicle != same
    other.step(30)
    np.testing.assert_allclose(road.fork().vehicles[0].position, vehicle.position)
    road.step(30)
    assert other.hash() == road.hash()


def test_a_run_is_recorded_and_replayed(road, tmp_path):
    path = tmp_path / "run.rec"
    lamp = road.spawn_light(relief.Light.point(1), at=(0, 3, 0))
    with road.record(path):
        ego = road.spawn_vehicle("car", at=(20, 0, 0), manual=True)
        ego.drive(throttle=0.7, steer=0.2)
        road.step(60)
        lamp.intensity = 3
        ego.drive(brake=1, throttle=0)
        road.step(60)
        with pytest.raises(ValueError, match="not while the run is recorded"):
            road.reset()
        with pytest.raises(relief.RecordingError, match="being recorded"):
            road.record(tmp_path / "other.rec")
    again = relief.replay(path)
    assert again.hash() == road.hash() and again.steps == 120
    # A seed of the run's own.
    other = road.fresh(seed=1234)
    path = tmp_path / "seeded.rec"
    with other.record(path):
        other.step(70)
    assert relief.replay(path).hash() == other.hash()
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 255
    path.write_bytes(bytes(data))
    with pytest.raises(relief.RecordingError, match="corrupt"):
        relief.replay(path)


def test_an_old_recording_does_not_end_a_new_one(road, tmp_path):
    old = road.record(tmp_path / "old.rec")
    old.close()
    road.reload()
    with road.record(tmp_path / "new.rec"):
        road.step(10)
        old.close()
        road.step(10)
    assert relief.replay(tmp_path / "new.rec").steps == 20


def test_a_run_is_reset(road):
    begun = road.hash()
    road.spawn_vehicle("car", at=(50, 0, 0))
    road.step(10)
    road.reset()
    assert road.hash() == begun and road.steps == 0
    road.reset(seed=5)
    assert road.seed == 5 and road.hash() == road.fresh(seed=5).hash()
    road.reload()
    assert road.seed == 5


def test_routes_and_signals(road):
    (route,) = road.routes
    assert route.name == "main" and route.lanes == 2 and not route.closed and route.then == ["main"]
    assert route.length == pytest.approx(400, abs=0.1)
    points = route.points([0, 100.0], lane=0)
    assert points.shape == (2, 3)
    np.testing.assert_allclose(points[1] - points[0], [0, 0, 100], atol=1e-3)
    assert route.yaw(50) == pytest.approx(0, abs=1e-6)
    assert road.signals == {"crossing": [("green", 10.0), ("red", 15.0)]}
    vehicle = road.spawn_vehicle("car", route="main", lane=1, along=50)
    assert vehicle.route == "main" and vehicle.lane == 1 and vehicle.offset == pytest.approx(0, abs=1e-3)
    assert vehicle.along == pytest.approx(50)


def test_signals_are_held_and_released(road, tmp_path):
    aspects = lambda sim: [aspect for aspect, _ in sim.signals["crossing"]]
    begun = road.hash()
    with road.record(tmp_path / "held.rec"):
        # It shows at once, and does not change.
        road.set_signal("crossing", ["red", "green"])
        assert road.signals == {"crossing": [("red", math.inf), ("green", math.inf)]}
        assert road.hash() != begun
        saved = road.snapshot()
        road.step(60 * 11)
        assert aspects(road) == ["red", "green"]
        road.set_signal("crossing", "amber")
        assert aspects(road) == ["amber", "amber"]
        road.step()
        road.set_signal("crossing", ["green", "amber"])
        end = road.hash()
    # By its times, 12 s on, the first group is amber.
    fresh = road.fresh()
    fresh.step(60 * 11 + 60)
    road.step(59)
    road.set_signal("crossing", None)
    assert road.signals == fresh.signals
    # It is state, and in recordings, also after the last step.
    other = road.fresh()
    for world in (road, other, other.fork()):
        world.restore(saved)
        assert world.snapshot() == saved and aspects(world) == ["red", "green"]
        world.step(60 * 11)
        assert aspects(world) == ["red", "green"]
    other.reset()
    assert other.signals == road.fresh().signals
    replay = relief.replay(tmp_path / "held.rec")
    assert replay.hash() == end and aspects(replay) == ["green", "amber"]


@pytest.mark.parametrize(
    "name, shows, error, message",
    [
        ("crosing", "red", KeyError, 'unknown signal "crosing" (did you mean "crossing"?)'),
        ("crosing", None, KeyError, "unknown signal"),
        ("crossing", "blue", ValueError, 'shows: unknown aspect "blue"; expected one of: red, amber, green'),
        ("crossing", ["red", "Green"], ValueError, 'shows: unknown aspect "Green" (did you mean "green"?)'),
        ("crossing", ["red"] * 3, ValueError, "shows: expected one name, or 2, one for each group, found 3"),
        ("crossing", [], ValueError, "shows: expected one name, or 2, one for each group, found 0"),
        ("crossing", {"red", "green"}, TypeError, "shows: expected a string, or a list of strings, found {"),
        ("crossing", {"red": 1, "green": 2}, TypeError, "shows: expected a string, or a list of strings, found {"),
        ("crossing", 1, TypeError, "shows: expected a string, or a list of strings, found 1"),
    ],
)
def test_signals_that_cannot_be_held(road, name, shows, error, message):
    begun = road.hash()
    with pytest.raises(error, match=re.escape(message)):
        road.set_signal(name, shows)
    assert road.hash() == begun


def test_doors_are_opened():
    from conftest import SCENES

    rooms = relief.Sim(SCENES / "rooms.ron")
    door = rooms.portals[0]
    door.open = 0.25
    rooms.step()
    assert door.open == 0.25
    with pytest.raises(ValueError, match="open: expected a number from 0 to 1, found 2"):
        door.open = 2


def test_another_thread_runs_while_steps_are_taken(road):
    counted = 0
    done = threading.Event()

    def count():
        nonlocal counted
        while not done.is_set():
            counted += 1
            time.sleep(0)

    thread = threading.Thread(target=count)
    thread.start()
    road.step(500)
    done.set()
    thread.join()
    assert counted > 10


def test_threads_share_a_world(road):
    threads = [threading.Thread(target=road.step, args=(20,)) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert road.steps == 80
    other = road.fresh()
    other.step(80)
    assert road.hash() == other.hash()


def test_handles_of_what_is_gone_are_not_of_what_gets_their_ids(field):
    shot = field.snapshot()
    car = field.spawn_vehicle("car", at=(0, 0, 0))
    kept = field["sun"]
    field.restore(shot)
    box = field.spawn_mesh("box", at=(0, 1, 0))
    assert box.id == car.id and box != car
    assert not car.alive and box.alive and kept.alive
    for use in (car.despawn, lambda: car.speed, lambda: car.drive(throttle=1.0), lambda: car.position):
        with pytest.raises(relief.GoneError):
            use()
    assert box.alive
    field.reset()
    assert not box.alive and kept.alive


def test_a_recording_ends_once_and_with_its_world(tmp_path):
    sim = relief.Sim()
    first = sim.record(tmp_path / "first.rec")
    sim.step(2)
    first.close()
    sim.record(tmp_path / "second.rec")
    first.close()
    sim.step(500)
    del sim, first
    gc.collect()
    assert relief.replay(tmp_path / "second.rec", scene=relief.assets() / "field.ron").steps == 502


def test_unknown_sensors_are_named(field):
    field.spawn_vehicle("car", at=(0, 0, 0), name="ego").add_lane("lane")
    with pytest.raises(KeyError, match='unknown sensor "lame"'):
        field.capture("lame")
    with pytest.raises(KeyError, match='unknown sensor "front"'):
        field.look("front")


def test_what_looks_at_a_point_can_be_rolled(field):
    # Looking along +Z, with the right side (−X) down: what is to the right in the picture, −Y.
    level = field.add_camera("level", size=(8, 8), at=(0, 1, 0), look_at=(0, 1, 5)).transform
    rolled = field.add_camera("rolled", size=[8, 8], at=(0, 1, 0), look_at=(0, 1, 5), roll=np.pi / 2).transform
    # Cameras have +X to the right. 2⁻²³ times the terms of two rotations.
    np.testing.assert_allclose(level[:3, 0], [-1, 0, 0], atol=1e-6)
    np.testing.assert_allclose(rolled[:3, 0], [0, -1, 0], atol=1e-6)
    turned = field.add_camera("turned", size=np.array([8, 8]), at=(0, 1, 0), roll=np.pi / 2).transform
    np.testing.assert_allclose(turned, rolled, atol=1e-6)


def test_a_vehicle_on_its_route_is_not_driven_in_vain(road):
    car = road.spawn_vehicle("car", route="main", lane=1, along=50, name="ego")
    for asked in ({"throttle": 1}, {"brake": 0}, {"steer": 0.5}, {"indicator": "left"}):
        with pytest.raises(ValueError, match='"ego" goes by its route, "main"; set manual to True to drive it'):
            car.drive(**asked)
    # Its lamps are its own.
    car.drive(headlights="high", indicator="hazard")
    road.step(60)
    assert car.controls["headlights"] == "high" and car.controls["indicator"] == "hazard"
    car.manual = True
    car.drive(throttle=0, brake=1)
    road.step(300)
    assert car.speed == 0
    car.manual = False
    road.step(60)
    assert car.speed > 1
    with pytest.raises(ValueError, match="goes by its route"):
        car.drive(throttle=1)


def test_a_vehicle_without_a_route_is_driven_at_once(road):
    car = road.spawn_vehicle("car", at=(50, 0, 0))
    assert car.route is None and not car.manual
    car.drive(throttle=1)
    road.step(60)
    assert car.speed > 1


def test_what_has_no_direction_is_not_turned(field):
    lamp = field.spawn_light(relief.Light.point(1), at=(0, 3, 0))
    for turned in ({"look_at": (0, 0, 5)}, {"yaw": 1}, {"pitch": np.float32(0.5)}):
        with pytest.raises(ValueError, match="a point light shines in all directions"):
            field.spawn_light(relief.Light.point(1), at=(0, 3, 0), **turned)
        with pytest.raises(ValueError, match="a point light shines in all directions"):
            lamp.place((1, 3, 0), **turned)
    lamp.place((1, 3, 0))
    np.testing.assert_allclose(lamp.position, (1, 3, 0))
    lamp.change(relief.Light.spot(1))
    lamp.place((1, 3, 0), look_at=(1, 0, 0))
    assert len(field.lights) == 2  # with the sun


def test_arguments_that_would_count_for_nothing_are_refused(road):
    with pytest.raises(ValueError, match="yaw: expected at beside it"):
        road.spawn_vehicle("car", route="main", yaw=1)
    with pytest.raises(ValueError, match="largest_degrees: expected fisheye beside it"):
        road.add_camera("a", K=(9, 9, 4, 4), largest_degrees=80)


LOOKING = [(0, -1, 0), (0, 1, 0), (0.001, -1, 0), (0, -1, 0.001), (-0.03, -1, 0.01), (0.04, 1, -0.01), (1, -2, 3)]


@pytest.mark.parametrize("direction", LOOKING)
def test_what_looks_at_a_point_does_so_as_in_a_scene_file(tmp_path, field, direction):
    at, to = np.array([3.0, 20.0, -7.0]), np.array([3.0, 20.0, -7.0]) + 10 * np.array(direction)
    path = tmp_path / "looking.ron"
    path.write_text(f"""(entities: [
        (name: "eye", camera: (), transform: (translation: {tuple(map(float, at))}, look_at: {tuple(map(float, to))})),
    ])""")
    theirs = relief.Sim(path)["eye"].world_from_entity
    for ours in (field.add_camera("a", at=at, look_at=to), field.spawn_light(relief.Light.spot(1), at, look_at=to)):
        # Places of single floats: 2⁻²² metres of 20, 10 metres and (at 0.001) 0.01 metres beside the pole away.
        np.testing.assert_allclose(ours.world_from_entity, theirs, atol=1e-4)


def test_what_looks_down_has_its_top_as_far_up_as_can_be(field):
    def axes(direction):
        camera = field.add_camera("a", at=(0, 9, 0), look_at=np.add((0, 9, 0), direction))
        looking = camera.transform
        camera.despawn()
        # A camera's entity has +X to the right, +Y to the top of the picture, and looks along −Z.
        return looking[:3, 0], looking[:3, 1], -looking[:3, 2]

    # The nearer to straight down, the same: the top is where it is looked to, to the right its right.
    for lean in (1.0, 0.1, 0.04, 0.01, 1e-3, 1e-5):
        for around in np.linspace(0, 2 * np.pi, 7):
            way = np.array([np.sin(around), 0, np.cos(around)])
            for down in (-1, 1):
                right, top, forward = axes(lean * way + (0, down, 0))
                expected = np.add(lean * way, (0, down, 0)) / np.hypot(lean, 1)
                # From places of single floats.
                np.testing.assert_allclose(forward, expected, atol=1e-6)
                np.testing.assert_allclose(right, np.cross(way, (0, 1, 0)), atol=1e-6)
                np.testing.assert_allclose(top, np.cross(right, forward), atol=1e-6)
    # Straight down and up, as with pitch and a yaw of 0.
    for down, pitch in ((-1, -np.pi / 2), (1, np.pi / 2)):
        found = np.array(axes((0, down, 0)))
        np.testing.assert_allclose(found, [(-1, 0, 0), (0, 0, -down), (0, down, 0)], atol=1e-6)
        turned = field.add_camera(f"pitched {down}", at=(0, 9, 0), pitch=pitch).transform
        np.testing.assert_allclose(np.array([turned[:3, 0], turned[:3, 1], -turned[:3, 2]]), found, atol=1e-6)


def test_copies_are_forks_and_pickling_names_what_to_use():
    sim = relief.Sim(seed=3)
    sim.spawn_vehicle("car", at=(0, 0, 0), name="ego")
    sim.step(5)
    shallow, (deep,) = copy.copy(sim), copy.deepcopy([sim])
    assert shallow.hash() == deep.hash() == sim.hash()
    sim.step(1)
    assert shallow.hash() == deep.hash() != sim.hash()
    for text in (r"fork\(\)", r"snapshot\(\)"):
        with pytest.raises(TypeError, match=text):
            pickle.dumps(sim)


def test_a_barometer_measures_the_air_at_its_height():
    sim = relief.Sim()
    sim.add_barometer("air", at=(0, 100, 0), pressure_bias=5, pressure_sigma=0)
    sim.step()
    reading = sim.capture()["air"]
    assert isinstance(reading, relief.BarometerReading) and isinstance(reading, relief.Reading)
    # The standard atmosphere at 100 m has 100,129.4 Pa.
    assert reading.pressure == pytest.approx(100_134.4, abs=0.5)
    assert (reading.name, reading.step, reading.sigma) == ("air", 1, 0.0)
    assert [sensor.kind for sensor in sim.sensors] == ["barometer"]
    with pytest.raises(ValueError, match="pressure_sigma: expected a number from 0 to 10000, found -1"):
        sim.add_barometer("other", at=(0, 0, 0), pressure_sigma=-1)
