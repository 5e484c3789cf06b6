"""Data sets: the files that the program writes, byte for byte, and what is refused."""

import os
import shutil
import subprocess
import sys
import warnings

import numpy as np
import pytest

import relief
from conftest import SCENES

#: Frames: most sensors are due at the first and the seventh, some at each.
FRAMES = 8
SENSORS = [f"ego/{name}" for name in ("bumper", "front", "lane", "mast", "rear", "right", "top", "unit")]
FORMATS = ["png", "npy", "npz", "exr", "mcap", "coco", "kitti", "nuscenes"] + ["video"] * bool(shutil.which("ffmpeg"))


def files(folder):
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def rendered(folder, scene, *options):
    """Files of the program, which comes with the package."""
    command = [sys.executable, "-m", "relief", "render", str(scene), "-o", str(folder), *options]
    subprocess.run(command, check=True, capture_output=True)
    return files(folder)


def write(data, sim, steps):
    for i in range(steps):
        if i > 0:
            sim.step()
        data.write(sim.capture())


def same(own, program):
    assert sorted(own) == sorted(program)
    assert [name for name in own if own[name] != program[name]] == []


def test_files_are_those_of_the_program(tmp_path):
    scene = SCENES / "sensors.ron"
    chosen = ["--sensors", ",".join(SENSORS), "--format", ",".join(FORMATS), "--frames", str(FRAMES)]
    program = rendered(tmp_path / "program", scene, *chosen)
    with warnings.catch_warnings():
        # Of numbers of things: the program logs them.
        warnings.simplefilter("ignore")
        with relief.Dataset(tmp_path / "own", formats=FORMATS, sensors=SENSORS) as data:
            write(data, relief.Sim(scene), FRAMES)
    own = files(tmp_path / "own")
    # So that it does not pass because nothing was written.
    expected = ["manifest.json", "sensors.json", "sensors.mcap", "coco/panoptic.json"]
    expected += ["ego/front/kitti/flow/000000.png", "ego/front/flow_flags_00000.npy"]
    expected += ["ego/top/00006.npz", "ego/right/00006.exr", "ego/lane/lane_00007.npy"]
    assert [name for name in expected if name not in own] == []
    same(own, program)


SMALL = """(
    meshes: {{ "box": cube(size: (1, 1, 1)) }},
    entities: [
        (name: "box", mesh: "box", instance: true, class: "car", transform: (translation: (0, 0, -4))),
        (name: "eye", sensor: camera(size: (16, 12), samples: 1, every: 2, outputs: [{outputs}])),
        (name: "eye left", sensor: camera(size: (16, 12), samples: 1, outputs: [depth])),
        (name: "unit", sensor: imu()),
    ],
)"""


@pytest.fixture
def small(tmp_path):
    path = tmp_path / "small.ron"
    path.write_text(SMALL.format(outputs="depth, instance, flow"))
    return path


def test_sensors_are_chosen_and_frames_are_those_that_are_written(small, tmp_path):
    options = ["--sensors", "eye,unit", "--format", "npy,mcap", "--frames", "2..6"]
    program = rendered(tmp_path / "program", small, *options)
    sim = relief.Sim(small)
    sim.capture()
    data = relief.Dataset(tmp_path / "own", formats=["mcap", "npy"], sensors=["unit", "eye"])
    for _ in range(2):
        sim.step()
        # The IMU measures by its places before, flow by the picture before.
        got = sim.capture()
    for step in range(2, 6):
        data.write(got)
        got = sim.step() and sim.capture()
    assert not (tmp_path / "own" / "manifest.json").exists()
    data.close()
    data.close()
    same(files(tmp_path / "own"), program)


def test_arrays_are_written_as_they_are(small, tmp_path):
    sim = relief.Sim(small)
    with relief.Dataset(tmp_path / "own", formats="npz", sensors="eye left") as data:
        got = sim.capture()
        got["eye left"].depth[:] = 7
        data.write(got)
    assert np.all(np.load(tmp_path / "own" / "eye left" / "00000.npz")["depth"] == 7)


def test_what_the_program_refuses_is_refused_with_its_words(small, tmp_path):
    def program(*options):
        command = [sys.executable, "-m", "relief", "render", str(small), "-o", "out", "--sensors", *options]
        # Without those of a validation layer.
        environment = {**os.environ, "WGPU_VALIDATION": "0"}
        done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, env=environment)
        assert done.returncode == 2
        return done.stderr.splitlines()[0].removeprefix("error: ")

    sim = relief.Sim(small)

    def own(**options):
        with pytest.raises(ValueError) as refused:
            relief.Dataset(tmp_path / "out", **options).write(sim.capture())
        return str(refused.value)

    assert own(sensors=["eyes"], formats="npy") == "sensors: " + program("eyes", "--format", "npy")
    assert own(sensors="unit") == "formats: " + program("unit")
    assert own(sensors="eye", formats=["npy", "coco"]) == "formats: " + program("eye", "--format", "npy,coco")
    assert own(formats=["jpg"]).startswith('formats: unknown format "jpg"')
    assert own(formats=[]) == "formats: expected at least one"
    assert not (tmp_path / "out").exists()


def test_a_capture_is_written_once_and_of_its_world_as_it_is(small, tmp_path):
    sim = relief.Sim(small)
    data = relief.Dataset(tmp_path / "own", formats="npy")
    first = sim.capture()
    data.write(first)

    def refused(capture, *words):
        with pytest.raises(ValueError) as error:
            data.write(capture)
        assert all(word in str(error.value) for word in words), error.value

    refused(first, "expected one after step 0")
    refused(sim.look(), "relief.capture_due")
    refused(relief.Sim(small).capture(), "of a world that is there")
    other = relief.Sim(small)
    refused(other.capture(), "whose captures were written before")
    sim.step()
    refused(first, "step 1", "step 0")
    got = sim.capture()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        got["eye left"].depth.dtype = np.uint32
    refused(got, "depth", "type and the shape")
    with pytest.raises(TypeError, match="capture: expected a Capture"):
        data.write(3)
    data.close()
    refused(sim.capture(), "has ended")


def test_after_an_exception_nothing_describes_what_was_written(small, tmp_path):
    sim = relief.Sim(small)
    with pytest.raises(KeyError, match="stop"):
        with relief.Dataset(tmp_path / "own", formats=["npy", "mcap"]) as data:
            data.write(sim.capture())
            raise KeyError("stop")
    assert not [path for path in (tmp_path / "own").iterdir() if path.is_file()]
    assert (tmp_path / "own" / "eye" / "depth_00000.npy").exists()
    # Nothing was written: nothing is there.
    with relief.Dataset(tmp_path / "none"):
        pass
    assert not (tmp_path / "none").exists()


def test_all_sensors_are_those_that_are_there_at_first(small, tmp_path):
    program = rendered(tmp_path / "program", small, "--sensors", "all", "--format", "npy", "--frames", "3")
    sim = relief.Sim(small)
    with relief.Dataset(tmp_path / "own", formats="npy") as data:
        write(data, sim, 3)
        sim.add_camera("late", size=(4, 4))
        sim.step()
        with pytest.raises(ValueError, match="sensor \"late\" was not there"):
            data.write(sim.capture())
    same(files(tmp_path / "own"), program)
