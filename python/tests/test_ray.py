"""Ray clusters of two workers, one killed in the middle of its work, and one file cut short: nothing changes."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from conftest import ROOT, needed

needed("ray")
OPTIONS = ["--frames", "3..19", "--size", "320x180", "--outputs", "color,id", "--threads", "1"]
ENVIRONMENT = {**os.environ, "LP_NUM_THREADS": "1", "RAY_USAGE_STATS_ENABLED": "0"}


def run(*command):
    return subprocess.run(command, check=True, capture_output=True, text=True, env=ENVIRONMENT)


def files(folder):
    return {str(path.relative_to(folder)): path.read_bytes() for path in Path(folder).rglob("*") if path.is_file()}


def wait_for(condition, seconds=120):
    """What a condition gives, when it gives something."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if found := condition():
            return found
        time.sleep(0.02)
    raise AssertionError("nothing happened")


def processes_of(shard):
    """Ids of the processes that render a shard, with those of their parents."""
    for process in Path("/proc").glob("[0-9]*"):
        try:
            command = (process / "cmdline").read_bytes().split(b"\0")
            parent = int((process / "stat").read_text().rsplit(")", 1)[1].split()[1])
        except OSError:
            continue
        if shard.encode() in command:
            yield int(process.name), parent


def driver(*arguments, cwd=None):
    command = [sys.executable, "-m", "relief.ray", *arguments, "--workers", "2"]
    return subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=ENVIRONMENT, cwd=cwd
    )


def ended(*arguments, cwd=None):
    """Exit code, output and errors of a driver that runs to its end."""
    running = driver(*arguments, cwd=cwd)
    said, errors = running.communicate(timeout=300)
    return running.returncode, said, errors


@pytest.mark.skipif(sys.platform != "linux", reason="skipped: looks for processes in /proc")
def test_a_killed_worker_and_a_cut_file_change_nothing(program, tmp_path):
    scene = str(ROOT / "assets/scenes/shapes.ron")
    one, job = tmp_path / "one", tmp_path / "job"
    run(program, "render", scene, "-o", str(one), *OPTIONS)
    run(program, "split", scene, "-o", str(job), "--shards", "6", *OPTIONS)
    running = driver("render", str(job), "--relief", program)
    try:
        # Shard 0 is the first that is whole; a picture of it loses its end. Its like: shard 3 has begun.
        wait_for(lambda: (job / "00").is_dir())
        picture = job / "00/data/color_00004.png"
        whole = picture.read_bytes()
        picture.write_bytes(whole[: len(whole) // 2])
        wait_for(lambda: list(job.glob("03.*.part/data/*.png")))
        ((process, worker),) = wait_for(lambda: list(processes_of(f"{job}/shards.json:3")))
        os.kill(worker, signal.SIGKILL)
        # With it what it has begun.
        wait_for(lambda: process not in [found for found, _ in processes_of(f"{job}/shards.json:3")])
        assert not (job / "03").exists()
        said, errors = running.communicate(timeout=300)
    finally:
        running.kill()
    assert running.returncode == 0, errors
    assert "attempt" not in errors, "a lost worker is no failure of the shard"
    assert said.strip().endswith(str(job / "merged")), said
    assert "shard 0: data/color_00004.png is damaged" in errors
    assert errors.count("6 of 6 shards") == 2
    assert files(job / "merged") == files(one)
    assert len(files(one)) == 2 * 16 + 1
    # What was killed could not tidy up: it is removed when shard 3 is rendered a day later.
    assert {path.name.split(".")[0] for path in job.glob("*.part")} <= {"03"}


def test_bad_input_is_said_at_once(program, tmp_path):
    job = tmp_path / "job"
    code, _, errors = ended("render", str(job), "--relief", program)
    assert code == 2 and f"error: {job}/shards.json: No such file" in errors
    scene = tmp_path / "scene.ron"
    scene.write_text('(entities: [(name: "eye", camera: ())])')
    run(program, "split", str(scene), "-o", str(job), "--shards", "2", "--frames", "2", "--size", "16x12")
    scene.write_text('(entities: [(name: "other", camera: ())])')
    code, _, errors = ended("render", str(job), "--relief", program)
    assert code == 2 and "error: shard " in errors and "scene.ron has changed" in errors, errors
    assert "attempt" not in errors


POLICY = """import contextlib, os, pathlib, threading, time

STOP = pathlib.Path({stop!r})


def drive(observations, random):
    # The first task of all waits until it is killed. Two may come at once: one of them makes the file.
    with contextlib.suppress(FileExistsError), STOP.open("x") as file:
        file.write(str(os.getpid()))
        file.flush()
        time.sleep(600)
    return [(own.uniform(-1, 1), 0.5) for own in random]


def fails(observations, random):
    return {{}}["way"]


LOCK = threading.Lock()


def locked(observations, random):
    return LOCK
"""


@pytest.mark.skipif(sys.platform != "linux", reason="skipped: kills workers by their number")
def test_rollouts_of_a_killed_worker_and_a_cut_file_are_those_of_one_process(tmp_path):
    needed("gymnasium")
    from relief.envs.rollouts import Worlds, read

    stop, folder = tmp_path / "stop", tmp_path / "data"
    (tmp_path / "own.py").write_text(POLICY.format(stop=str(stop)))
    options = ["rollouts", "relief/LaneFollow-v0", "-o", str(folder), "--size", "16x12", "--steps", "30"]
    options += ["--episodes", "10", "--seed", "3", "--together", "2", "--by-task", "3"]
    running = driver(*options, "--policy", "own:drive", cwd=tmp_path)
    try:
        os.kill(int(wait_for(lambda: stop.exists() and stop.read_text())), signal.SIGKILL)
        said, errors = running.communicate(timeout=300)
    finally:
        running.kill()
    assert running.returncode == 0, errors
    assert "attempt" not in errors
    assert "10 episodes" in said and "4 of 4 tasks" in errors
    paths = sorted((folder / "episodes").iterdir())
    assert [path.name for path in paths] == [f"{number:06}.npz" for number in range(10)]

    namespace = {}
    exec(compile(POLICY.format(stop=str(stop)), "own.py", "exec"), namespace)
    worlds = Worlds("relief/LaneFollow-v0", 5, size=(16, 12))
    rows = (folder / "episodes.csv").read_text().splitlines()
    for rollout in worlds.episodes(namespace["drive"], range(3, 13), most_steps=30):
        number = rollout.seed - 3
        found = read(paths[number])
        np.testing.assert_array_equal(found.observations, rollout.observations)
        np.testing.assert_array_equal(found.actions, rollout.actions)
        assert rows[1 + number].startswith(f"{number},{rollout.seed},{len(rollout.rewards)},")
    worlds.close()

    # What is whole stays; what is cut short, or not there, is driven again; more may follow.
    whole = [path.read_bytes() for path in paths]
    paths[4].write_bytes(whole[4][:-9])
    paths[7].unlink()
    times = {path: path.stat().st_mtime_ns for path in paths if path.exists()}
    code, said, errors = ended(*options, "--policy", "own:drive", "--episodes", "11", cwd=tmp_path)
    assert code == 0 and "11 episodes" in said, errors
    assert [path.read_bytes() for path in paths] == whole
    assert [path for path in times if path.stat().st_mtime_ns != times[path]] == [paths[4]]

    for more, words in [
        (["--policy", "own:drive", "--seed", "4"], "has episodes of seed 3, not 4"),
        (["--policy", "own:nothing"], "policy 'own:nothing': own has no function 'nothing'"),
        (["--policy", "nowhere:drive"], "No module named 'nowhere'"),
        (["--policy", "own:fails", "-o", str(tmp_path / "other")], "own.py:16: KeyError: 'way'"),
        (["--policy", "own:locked"], "policy 'own:locked': cannot be sent to workers: cannot pickle '_thread.lock'"),
        (["--policy", "own:drive", "-o", str(tmp_path)], "expected a new or empty folder"),
        (["-o", str(tmp_path / "large"), "--size", "4097x1"], "error: size: expected 1 to 4096 pixels"),
        (["-o", str(tmp_path / "far"), "--seed", str(2**63)], "argument --seed: invalid number of 0 to 46116"),
        (["-o", str(tmp_path / "whole"), "--gpus", "1.5"], "argument --gpus: invalid share"),
        (["-o", str(tmp_path / "nan"), "--gpus", "nan"], "argument --gpus: invalid share"),
        (["-o", str(tmp_path / "own"), "--address", "auto"], "not allowed with argument"),
        # Nobody adds such a machine to a cluster of this one.
        (["-o", str(tmp_path / "slow"), "--cpus", "3"], "error: no machine has 3 CPUs and 0 GPUs, which a task takes"),
    ]:
        code, _, errors = ended(*options, *more, cwd=tmp_path)
        assert code == 2 and words in errors, errors


@pytest.mark.skipif(sys.platform != "linux", reason="skipped: looks for processes in /proc")
def test_interrupted_rollouts_end_with_their_cluster_and_go_on(tmp_path):
    needed("gymnasium")
    stop, folder = tmp_path / "stop", tmp_path / "of two words"
    (tmp_path / "own.py").write_text(POLICY.format(stop=str(stop)))
    options = ["rollouts", "relief/LaneFollow-v0", "-o", folder.name, "--size", "16x12", "--steps", "3"]
    options += ["--episodes", "2", "--policy", "own:drive"]
    running = driver(*options, cwd=tmp_path)
    try:
        worker = Path("/proc", wait_for(lambda: stop.exists() and stop.read_text()))
        running.send_signal(signal.SIGINT)
        _, errors = running.communicate(timeout=120)
    finally:
        running.kill()
    assert running.returncode == 130, errors
    assert errors.endswith("interrupted; the same command goes on\n") and "Traceback" not in errors
    wait_for(lambda: not worker.exists())
    # What a killed worker left is removed when nothing can write to it any more.
    old, new = (folder / "episodes" / f"000000.npz.{name}.part" for name in ("old", "new"))
    for path in (old, new):
        path.write_bytes(b"PK")
    os.utime(old, (time.time() - 90_000,) * 2)
    code, said, errors = ended(*options, cwd=tmp_path)
    assert code == 0 and f"{folder}: 2 episodes, 6 steps" in said, errors
    assert not old.exists() and new.exists()


def test_of_drivers_that_begin_at_once_one_claims_the_folder(tmp_path, monkeypatch):
    needed("gymnasium")
    from relief.ray.cluster import BadInput
    from relief.ray.rollouts import Settings, claim

    own, other = (Settings("relief/LaneFollow-v0", "own:drive", seed=seed) for seed in (0, 1))
    folder = tmp_path / "data"
    claim(folder, own)
    first = (folder / "rollouts.json").read_bytes()
    # The other has looked before this one wrote.
    monkeypatch.setattr(Path, "exists", lambda path: False)
    monkeypatch.setattr(Path, "iterdir", lambda path: iter(()))
    with pytest.raises(BadInput, match="has episodes of seed 0, not 1"):
        claim(folder, other)
    claim(folder, own)
    assert (folder / "rollouts.json").read_bytes() == first


def test_a_new_cluster_is_one_of_its_own(monkeypatch):
    import ray
    from relief.ray.cluster import BadInput, connect

    asked = []
    monkeypatch.setattr(ray, "init", lambda address, **options: asked.append((address, options)))
    monkeypatch.setattr(ray, "nodes", lambda: [{"Alive": True, "Resources": {"CPU": 2.0}}])
    connect(None, 2, cpus=2, gpus=0)
    connect("auto", None, cpus=1, gpus=0)
    # Others may add a machine to theirs.
    connect("auto", None, cpus=3, gpus=0)
    assert [(address, options.get("num_cpus")) for address, options in asked] == [
        ("local", 2), ("auto", None), ("auto", None),
    ]  # fmt: skip
    for cpus, gpus in [(3, 0), (1, 0.5)]:
        with pytest.raises(BadInput, match=f"no machine has {cpus} CPUs and {gpus} GPUs"):
            connect(None, 2, cpus=cpus, gpus=gpus)

    def refuse(address, **options):
        raise ConnectionError("Could not find any running Ray instance.\nMore of it.")

    monkeypatch.setattr(ray, "init", refuse)
    with pytest.raises(BadInput, match="^address 'auto': Could not find any running Ray instance.$"):
        connect("auto", None, cpus=1, gpus=0)


def test_the_program_is_found_from_any_folder(tmp_path, monkeypatch):
    from relief.ray import __main__ as command

    (tmp_path / "job").mkdir()
    (tmp_path / "job/shards.json").write_text('{"shards": [0]}')
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(command, "connect", lambda *of, **takes: None)
    asked = []
    monkeypatch.setattr(command, "render", lambda job, shards, relief, **options: asked.append((job, relief)))
    monkeypatch.setattr(command, "merge", lambda job, output, relief, more: (0, ""))
    assert command.main(["render", "job", "--relief", "bin/relief"]) == 0
    assert command.main(["render", "job"]) == 0
    assert asked == [(str(tmp_path / "job"), str(tmp_path / "bin/relief")), (str(tmp_path / "job"), None)]
