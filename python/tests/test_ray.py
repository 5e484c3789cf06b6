"""Shards on a Ray cluster of two workers, one killed in the middle of a shard, and one file cut short."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

ray = pytest.importorskip("ray", reason="skipped: no ray")
ROOT = Path(__file__).resolve().parents[2]
# As `python -m relief.ray` does, but without what else is in the package.
DRIVER = f"import runpy; runpy.run_path({str(ROOT / 'python/relief/ray.py')!r}, run_name='__main__')"
OPTIONS = ["--frames", "3..19", "--size", "320x180", "--outputs", "color,id", "--threads", "1"]
ENVIRONMENT = {**os.environ, "LP_NUM_THREADS": "1", "RAY_USAGE_STATS_ENABLED": "0"}


@pytest.fixture(scope="module")
def relief():
    """The program: RELIEF, or the one that was built last."""
    built = [ROOT / "target" / kind / "relief" for kind in ("debug", "release")]
    found = [Path(os.environ["RELIEF"])] if "RELIEF" in os.environ else [path for path in built if path.exists()]
    if not found:
        pytest.skip("skipped: no program; cargo build")
    return str(max(found, key=lambda path: path.stat().st_mtime))


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


def driver(relief, *arguments):
    command = [sys.executable, "-c", DRIVER, "render", *arguments, "--workers", "2", "--relief", relief]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=ENVIRONMENT)


@pytest.mark.skipif(sys.platform != "linux", reason="skipped: looks for processes in /proc")
def test_a_killed_worker_and_a_cut_file_change_nothing(relief, tmp_path):
    scene = str(ROOT / "assets/scenes/shapes.ron")
    one, job = tmp_path / "one", tmp_path / "job"
    run(relief, "render", scene, "-o", str(one), *OPTIONS)
    run(relief, "split", scene, "-o", str(job), "--shards", "6", *OPTIONS)
    running = driver(relief, str(job))
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
    assert said.strip().endswith(str(job / "merged")), said
    assert "shard 0: data/color_00004.png is damaged" in errors
    assert errors.count("6 of 6 shards") == 2
    assert files(job / "merged") == files(one)
    assert len(files(one)) == 2 * 16 + 1
    assert not list(job.glob("*.part"))


def test_bad_input_is_said_at_once(relief, tmp_path):
    job = tmp_path / "job"
    running = driver(relief, str(job))
    _, errors = running.communicate(timeout=120)
    assert running.returncode == 2 and "shards.json" in errors
    scene = tmp_path / "scene.ron"
    scene.write_text('(entities: [(name: "eye", camera: ())])')
    run(relief, "split", str(scene), "-o", str(job), "--shards", "2", "--frames", "2", "--size", "16x12")
    scene.write_text('(entities: [(name: "other", camera: ())])')
    running = driver(relief, str(job))
    _, errors = running.communicate(timeout=120)
    assert running.returncode == 1 and "scene.ron has changed" in errors, errors
    assert "attempt" not in errors
