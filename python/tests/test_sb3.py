"""Environments for Stable-Baselines3, against its own of single ones.

PyTorch has some gigabytes, so these tests run where it is, and are skipped elsewhere, in strict mode, too.
"""

import warnings

import gymnasium
import numpy as np
import pytest

pytest.importorskip("stable_baselines3", reason="skipped: no stable_baselines3")

from stable_baselines3.common.env_checker import check_env  # noqa: E402
from stable_baselines3.common.vec_env import DummyVecEnv  # noqa: E402

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
