"""Environments for Stable-Baselines3, against its own of single ones.

PyTorch has some gigabytes, so these tests run where it is, and are skipped elsewhere, in strict mode, too.
"""

import runpy
import sys
import warnings

import gymnasium
import numpy as np
import pytest

pytest.importorskip("stable_baselines3", reason="no stable_baselines3: too large for CI")

from stable_baselines3.common.env_checker import check_env  # noqa: E402
from stable_baselines3.common.vec_env import DummyVecEnv  # noqa: E402

from conftest import ROOT  # noqa: E402
from relief.envs import TASKS  # noqa: E402
from relief.sb3 import VecEnv  # noqa: E402

COUNT, SIZE = 3, (48, 48)


@pytest.mark.parametrize("id", list(TASKS))
def test_its_checks_find_nothing(id):
    env = gymnasium.make(id, size=SIZE)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped)
    env.close()


def assert_same(found, expected, place):
    if isinstance(expected, dict):
        assert sorted(found) == sorted(expected), place
        for name in expected:
            assert_same(found[name], expected[name], (*place, name))
    else:
        assert np.asarray(found).dtype == np.asarray(expected).dtype, place
        assert np.array_equal(found, expected), place


@pytest.mark.parametrize("id", ["relief/LaneFollow-v0", "relief/Traffic-v0"])
def test_all_at_once_are_what_single_ones_are(id):
    single = DummyVecEnv([lambda: gymnasium.make(id, size=SIZE).unwrapped for _ in range(COUNT)])
    many = VecEnv(id, COUNT, size=SIZE)
    assert many.observation_space == single.observation_space and many.action_space == single.action_space
    for env in (single, many):
        env.seed(5)
    assert_same(many.reset(), single.reset(), ("reset",))
    assert many.reset_infos == single.reset_infos
    random, ends = np.random.default_rng(0), 0
    steer = random.uniform(-0.6, 0.6, COUNT)
    for step in range(60):
        actions = np.stack([steer, random.uniform(0.3, 1.0, COUNT)], axis=1).astype(np.float32)
        found, expected = many.step(actions), single.step(actions)
        for part, name in enumerate(("observation", "reward", "done")):
            assert_same(found[part], expected[part], (step, name))
        ends += int(expected[2].sum())
        for i in range(COUNT):
            assert_same(found[3][i], expected[3][i], (step, i, "info"))
    assert ends > 0, "no episode has ended"
    single.close()
    many.close()


def test_what_there_is_not_is_told():
    env = VecEnv("relief/LaneFollow-v0", 2, size=SIZE)
    assert env.get_attr("render_mode") == [None, None] and len(env.get_attr("sim", [1])) == 1
    with pytest.raises(AttributeError, match="expected one of render_mode, sim, task, found 'speed'"):
        env.get_attr("speed")
    with pytest.raises(AttributeError, match="nothing to be set"):
        env.set_attr("task", None)
    env.close()


def example_of(name):
    """The functions of an example. They see each other in the globals of each."""
    return runpy.run_path(str(ROOT / "examples" / "python" / name))["main"].__globals__


def test_the_cruise_control_holds_a_speed():
    example = example_of("learn_ppo.py")
    env, wanted = example["Cruise"](VecEnv("relief/LaneFollow-v0", 2, size=SIZE)), 0.25 * example["FASTEST"]
    env.seed(5)
    env.reset()
    actions, speeds = np.float32([[0.25, -1.0], [0.0, -0.5]]), np.zeros(2)
    for _ in range(10):
        infos = env.step(actions)[3]
        # What is missing to a standstill and to a quarter of the fastest, by 0.3; steering as it is.
        pedal = np.float32(np.clip(0.3 * (np.array([0.0, wanted]) - speeds), -1.0, 1.0))
        assert np.array_equal(env.venv._actions, np.stack([actions[:, 0], pedal], axis=1))
        speeds = np.array([info["speed"] for info in infos])
    assert abs(speeds[0]) < 0.01 and 0.4 * wanted < speeds[1] < wanted, speeds


def test_the_example_learns_tests_and_draws(tmp_path, monkeypatch, capsys):
    learn, plot = example_of("learn_ppo.py"), example_of("plot_curve.py")
    for name, value in (("STARTS", 2), ("STEPS", 4)):
        monkeypatch.setitem(learn, name, value)
    curve, picture = tmp_path / "curve.csv", tmp_path / "curve.png"
    monkeypatch.setattr(sys, "argv", f"learn_ppo --steps 64 --every 64 --environments 16 -o {curve}".split())
    learn["main"]()
    assert len(capsys.readouterr().out.splitlines()) == 5
    monkeypatch.setattr(sys, "argv", ["plot_curve", str(curve), "-o", str(picture)])
    plot["main"]()
    table = capsys.readouterr().out.splitlines()
    policies = ["straight ahead", "at random", "PPO", "PPO"]
    assert [row.split(" | ")[0] for row in table[2:]] == [f"| {name}" for name in policies]
    assert picture.read_bytes().startswith(b"\x89PNG")
