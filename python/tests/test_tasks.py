"""What a step of a task leads to, and what is told of it, of readings that are made up."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from conftest import needed

needed("gymnasium")

from relief.envs import Task  # noqa: E402
from relief.envs.tasks import Episode, Traffic  # noqa: E402


def episode(**known):
    sim = SimpleNamespace(step_seconds=known.pop("step_seconds", 1 / 60))
    return Episode(sim=sim, ego=None, speed_limits=[10.0, 20.0], **known)


def capture(touch=(), **lane):
    of_lane = {
        "valid": True, "route": 1, "lane": 2, "offset": 0.0, "heading_error": 0.0, "curvature": 0.0, "width": 4.0,
        "speed": 0.0,
    }  # fmt: skip
    pixels = SimpleNamespace(color=np.zeros((2, 3, 3), np.uint8), depth=np.full((2, 3), np.inf, np.float32))
    contacts = [SimpleNamespace(depth=depth) for depth in touch]
    return {"ego/camera": pixels, "ego/lane": SimpleNamespace(**{**of_lane, **lane}), "ego/touch": contacts}


@pytest.mark.parametrize(
    "turned, lane, reward",
    [
        (0.0, {"speed": 5.0}, 0.25),
        (0.0, {"speed": 5.0, "route": 0}, 0.5),
        # Faster than the limit is not better.
        (0.0, {"speed": 30.0}, 1.0),
        (0.0, {"speed": 10.0, "heading_error": math.pi / 3}, 0.25),
        (0.0, {"speed": -5.0}, -0.25),
        (0.0, {"speed": 5.0, "offset": -1.0}, 0.0),
        (2.0, {"speed": 5.0}, 0.15),
        (0.0, {"speed": 5.0, "valid": False}, -0.5),
    ],
)
def test_rewards(turned, lane, reward):
    outcome = Task().outcome(episode(turned=turned), capture(**lane))
    # Some roundings of numbers up to 1.
    assert outcome.reward == pytest.approx(reward, abs=1e-15)


def test_progress_is_metres_along_the_lane_in_a_step():
    outcome = Task().outcome(episode(), capture(speed=5.0, heading_error=math.pi / 3, offset=0.5))
    assert outcome.info == {"speed": 5.0, "offset": 0.5, "progress": pytest.approx(0.25, abs=1e-15)}


@pytest.mark.parametrize("step_seconds, steps", [(1 / 60, 6), (0.05, 2), (0.01, 10), (0.03, 3), (0.5, 1)])
def test_times_are_those_of_the_worlds_clock(step_seconds, steps):
    of_clock = episode(step_seconds=step_seconds)
    assert of_clock.frame_steps == steps
    outcome = Task().outcome(of_clock, capture(speed=5.0))
    assert outcome.info["progress"] == pytest.approx(5.0 * steps * step_seconds, rel=1e-12)
    # A minute is over with the first step that ends at 60 s or later.
    last = math.ceil(60.0 / (steps * step_seconds) - 1e-6)
    ends = [Task().outcome(episode(step_seconds=step_seconds, steps=own), capture()) for own in (last - 1, last)]
    assert [end.truncated for end in ends] == [False, True]


@pytest.mark.parametrize(
    "seconds, given, ended",
    [
        (1.0, capture(), (False, False)),
        (1.0, capture(offset=1.99), (False, False)),
        (1.0, capture(offset=-2.0), (True, False)),
        (1.0, capture(valid=False), (True, False)),
        (1.0, capture(touch=[0.0]), (False, False)),
        (1.0, capture(touch=[0.0, 0.01]), (True, False)),
        (59.9, capture(), (False, False)),
        (60.0, capture(), (False, True)),
        # What has ended by itself is not cut.
        (60.0, capture(touch=[0.01]), (True, False)),
    ],
)
def test_ends(seconds, given, ended):
    outcome = Task().outcome(episode(steps=round(10 * seconds)), given)
    assert (outcome.terminated, outcome.truncated) == ended


def test_state_is_of_shares():
    lane = {"speed": 5.0, "offset": -1.0, "heading_error": math.pi / 4, "curvature": 0.01}
    seen = Traffic().observe(episode(steer=-0.5, pedal=0.75), capture(**lane))
    np.testing.assert_allclose(seen["state"], [0.25, -0.5, 0.25, 0.2, 0.5, -0.5, 0.75, 1.0], rtol=1e-6)
    far = {"speed": 90.0, "offset": 9.0, "curvature": -1.0, "lane": 9, "valid": False}
    seen = Traffic().observe(episode(), capture(**far))
    np.testing.assert_array_equal(seen["state"], np.float32([1.0, 0.0, 0.0, -1.0, 1.0, 0.0, 0.0, -1.0]))
    assert seen["depth"].shape == (2, 3, 1) and (seen["depth"] == 255).all()
