"""Errors: their types, their words, and a process that is forked."""

import multiprocessing
import os
import re
import subprocess
import sys
import textwrap

import numpy as np
import pytest

import relief


def test_a_scene_with_faults_names_them_all(tmp_path):
    path = tmp_path / "broken.ron"
    path.write_text('(\n    entities: [\n        (mesh: "none"),\n        (light: point(intensity: -1)),\n    ],\n)\n')
    with pytest.raises(relief.SceneError) as caught:
        relief.Sim(path)
    error = caught.value
    assert isinstance(error, ValueError) and isinstance(error, relief.Error)
    assert error.path == str(path) and error.line == 3 and error.column > 1
    assert error.field == "entities[0].mesh"
    assert len(error.problems) == 2 and error.problems[0] in str(error) and "1 more problem" in str(error)
    assert str(error).startswith(f"{path}:3:{error.column}: entities[0].mesh: unknown mesh")


def test_a_scene_that_is_not_there(tmp_path):
    with pytest.raises(relief.SceneError, match="No such file") as caught:
        relief.Sim(tmp_path / "none.ron")
    assert caught.value.line is None
    with pytest.raises(relief.SceneError, match=r'relief.assets\(\) / "scenes/town.ron"'):
        relief.Sim("town.ron")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"outputs": ("colour",)}, r'outputs: unknown value "colour" \(did you mean "color"\?\)'),
        ({"outputs": ()}, "outputs: expected at least one output"),
        ({"size": (0, 4)}, r"size\[0\]: expected pixels from 1 to 16384, found 0"),
        ({"samples": 3}, "samples: expected 1 or 4, found 3"),
        ({"K": (1, 2, 3)}, "K: expected"),
        ({"K": (50, 50, 8, 8), "fov_y_degrees": 60}, "expected one of K, fov_y_degrees, fov_x_degrees and half_height"),
        ({"fov_y_degrees": 180}, "fov_y_degrees: expected a number"),
        ({"every": 2, "phase": 2}, "phase: expected less than every, which is 2, found 2"),
        ({"near": -1}, "near: expected a number from 0.00001"),
        ({"at": (float("nan"), 0, 0)}, "expected finite numbers, found (nan|NaN)"),
        ({"at": (0, 0)}, r"at: expected 3 numbers, found \(0, 0\)"),
        ({"look_at": (0, 0, 0)}, "look_at: expected another point than at"),
        ({"look_at": (0, 0, 5), "yaw": 0.5}, "expected either look_at, or yaw and pitch"),
    ],
)
def test_cameras_that_are_refused(field, arguments, message):
    with pytest.raises(ValueError, match=message):
        field.add_camera("camera", **arguments)
    assert field.sensors == []


def test_arguments_that_are_refused(field):
    with pytest.raises(TypeError, match='unexpected argument "sise"'):
        field.add_camera("camera", sise=(4, 4))
    with pytest.raises(ValueError, match=r'unknown vehicle type "trcuk" \(did you mean "truck"\?\)'):
        field.spawn_vehicle("trcuk", at=(0, 0, 0))
    with pytest.raises(ValueError, match="expected one of at and route"):
        field.spawn_vehicle("car")
    with pytest.raises(ValueError, match="unknown route"):
        field.spawn_vehicle("car", route="main")
    car = field.spawn_vehicle("car", at=(0, 0, 0), name="ego")
    with pytest.raises(ValueError, match="throttle: expected a number from -1 to 1, found 2"):
        car.drive(throttle=2)
    with pytest.raises(ValueError, match="unknown headlights"):
        car.drive(headlights="dim")
    with pytest.raises(KeyError, match="did you mean"):
        field["egon"]
    with pytest.raises(ValueError, match="beams: unknown variant"):
        car.add_lidar("top", beams="vlp17")
    with pytest.raises(ValueError, match=r"expected at most 16777216 beams in a capture, found \d+"):
        car.add_lidar("top", hz=10_000, columns=1 << 20, every=100)
    with pytest.raises(ValueError, match="geo_origin"):
        car.add_gnss("gnss")
    with pytest.raises(ValueError, match="color: expected"):
        relief.Light.point(1, color="red")
    with pytest.raises(ValueError, match="like: expected an entity that the scene began with"):
        field.spawn_mesh(car, at=(0, 0, 0))
    with pytest.raises(relief.GoneError):
        field.entity(100_000)
    with pytest.raises(OverflowError):
        field.step(-1)


def test_what_cannot_be_written(field, tmp_path):
    with pytest.raises(relief.OutputError) as caught:
        field.record(tmp_path / "none" / "run.rec")
    assert isinstance(caught.value, OSError)
    with pytest.raises(relief.RecordingError):
        relief.replay(tmp_path / "none.rec")


def test_an_output_that_a_camera_does_not_give(field):
    field.add_camera("camera", size=(8, 8), outputs=("depth",), at=(0, 1, 0))
    capture = field.capture()
    with pytest.raises(AttributeError, match='does not give "color"; its outputs are: depth'):
        capture["camera"].color
    with pytest.raises(KeyError):
        capture["camera"]["color"]
    with pytest.raises(KeyError, match="did you mean"):
        capture["camra"]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
def test_a_forked_process_raises_and_does_not_hang():
    program = """
        import os, sys, relief
        sim = relief.Sim()
        camera = sim.add_camera("camera", size=(8, 8), at=(0, 1, 0))
        sim.capture()
        child = os.fork()
        if child == 0:
            code = 0
            for what in (sim.step, sim.capture, relief.Sim, relief.adapter, lambda: sim.entities, lambda: camera.name):
                try:
                    what()
                    code = 1
                except relief.ForkedError as error:
                    if "spawn" not in str(error):
                        code = 2
            os._exit(code)
        _, status = os.waitpid(child, 0)
        sim.step()
        sys.exit(os.waitstatus_to_exitcode(status))
    """
    done = subprocess.run([sys.executable, "-W", "ignore", "-c", textwrap.dedent(program)], timeout=120)
    assert done.returncode == 0


def worlds_hash(seed):
    sim = relief.Sim(seed=seed)
    sim.spawn_vehicle("car", at=(0, 0, 0))
    sim.step(10)
    return sim.hash()


def test_processes_that_are_spawned_agree():
    with multiprocessing.get_context("spawn").Pool(2) as pool:
        first, second = pool.map(worlds_hash, [1, 1])
    assert first == second == worlds_hash(1)


def test_a_sheared_matrix_is_refused(field):
    sheared = np.eye(4)
    sheared[0, 1] = 0.1
    box = field.spawn_mesh("box", at=(0, 1, 5))
    with pytest.raises(ValueError, match="right angles"):
        box.transform = sheared
    box.transform = np.diag([2.0, 1.0, 1.0, 1.0])


def test_sensors_have_names_of_their_own(road):
    one, two = (road.spawn_vehicle("car", at=(40 * i, 0, 0), name=f"car {i}", manual=True) for i in (1, 2))
    front = one.add_camera("front", size=(8, 8))
    assert front.name == "front" and front.full_name == "car 1/front"
    assert two.add_camera("front", size=(8, 8)).full_name == "car 2/front"
    assert road.add_camera("front", size=(8, 8)).full_name == "front"
    before = road.hash()
    with pytest.raises(ValueError, match='name: there is a sensor "car 1/front"'):
        one.add_imu("front")
    with pytest.raises(ValueError, match='name: there is a sensor "front"'):
        road.add_lidar("front", beams="vlp16")
    assert road.hash() == before
    front.despawn()
    assert one.add_imu("front").full_name == "car 1/front"
    assert sorted(road.look().keys()) == ["car 1/front", "car 2/front", "front"]


def test_names_are_not_empty(road):
    with pytest.raises(ValueError, match="name: expected one, or None"):
        road.spawn_vehicle("car", at=(0, 0, 0), name="")
    with pytest.raises(ValueError, match="name: expected one, or None"):
        road.spawn_light(relief.Light.point(intensity=1.0, range=2.0), at=(0, 1, 0), name="")


def test_vehicles_are_not_pitched(road):
    car = road.spawn_vehicle("car", at=(40, 0, 0))
    for turn in ({"pitch": 0.3}, {"roll": 0.1}):
        with pytest.raises(ValueError, match="pitch, roll: expected 0, since a vehicle stands as its ground does"):
            car.place((41, 0, 0), **turn)
    car.place((41, 0, 0), yaw=0.5)
    assert car.yaw == pytest.approx(0.5, abs=1e-6)  # through float32
    # Toward a point above it is turned by yaw alone: (3, 4) to the side and ahead.
    car.place((40, 0, 0), look_at=(43, 9, 4))
    np.testing.assert_allclose(car.transform[:3, 2], [0.6, 0, 0.8], atol=1e-6)
    np.testing.assert_allclose(car.transform[:3, 1], [0, 1, 0], atol=1e-6)
    with pytest.raises(ValueError, match="look_at: expected no point straight above or below at, for a vehicle"):
        car.place((40, 0, 0), look_at=(40, 3, 0))


def test_errors_of_lenses_name_their_arguments(field):
    wanted = [
        ({"K": (0, 9, 3.5, 3.5)}, "K: fx: expected pixels from 0.001"),
        ({"K": (50, 50, 32, 24), "distortion": (-5, 0)}, "K, distortion: folds"),
        ({"K": (50, 50, 32, 24), "fisheye": (-5, 5)}, "K, fisheye: folds"),
        ({"K": (50, 50, 32, 24), "fisheye": (0, 0), "largest_degrees": 200}, "^largest_degrees: expected a number"),
    ]
    for given, message in wanted:
        with pytest.raises(ValueError, match=message):
            field.add_camera("a", size=(64, 48), **given)


def test_names_of_sensors_and_files(field):
    with pytest.raises(TypeError, match=re.escape("names[0]: expected a string, found []")):
        field.capture([])
    with pytest.raises(TypeError, match=re.escape("names[1]: expected a string, found 3")):
        field.look("front", 3)
    for path in ("", "/", ".."):
        with pytest.raises(ValueError, match="path: expected the name of a file, found"):
            field.record(path)


def test_no_worlds_have_no_pictures():
    with pytest.raises(ValueError, match="sims: expected at least one"):
        relief.capture([], "front")


def test_threads_are_set_before_worlds():
    """In a process of its own."""
    program = "import relief; relief.set_threads(3); relief.Sim(); relief.set_threads(3); relief.set_threads(2)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.returncode == 1
    last = "ValueError: threads: expected to be set before the first world; they are 3 in this process"
    assert done.stderr.strip().endswith(last), done.stderr


def test_sensors_that_need_no_picture_need_no_adapter():
    """In a process in which Vulkan's loader finds no driver."""
    program = """
        import relief
        sim = relief.Sim()
        car = sim.spawn_vehicle("car", at=(0, 0, 0), name="ego", manual=True)
        sim.spawn_vehicle("van", at=(0, 0, 12))
        car.add_imu("imu")
        car.add_lidar("top", at=(0, 2.2, 0), every=6)
        car.add_collision("bumper")
        other = sim.fork()
        for _ in range(6):
            sim.step()
            got = sim.capture()
        assert got["imu"].valid and got["top"].hit.any() and got["top"].intensity.max() > 0, got
        relief.step([sim, other], 6)
        assert [len(capture) for capture in relief.capture_due([sim, other])] == [3, 3]
        car.add_camera("front", size=(8, 8))
        for draw in (lambda: sim.look("front"), relief.adapter):
            try:
                draw()
            except relief.errors.GpuError as error:
                assert "no graphics adapter" in str(error), error
            else:
                raise SystemExit("a picture without an adapter")
    """
    environment = {**os.environ, "VK_DRIVER_FILES": "/nonexistent"}
    run = [sys.executable, "-c", textwrap.dedent(program)]
    done = subprocess.run(run, capture_output=True, text=True, env=environment)
    assert done.returncode == 0, done.stderr
