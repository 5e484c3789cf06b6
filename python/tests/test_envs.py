"""Environments of Gymnasium: its own checks, resets of many at once, and errors."""

import os
import subprocess
import sys
import textwrap
import warnings

import numpy as np
import pytest

from conftest import needed

gymnasium = needed("gymnasium")

from gymnasium.utils.env_checker import check_env  # noqa: E402

import relief  # noqa: E402
from relief.envs import DrivingEnv, DrivingVectorEnv  # noqa: E402
from relief.envs.tasks import LaneFollow, Traffic, check_actions, log_depth  # noqa: E402

SIZE = (40, 36)
IDS = ["relief/LaneFollow-v0", "relief/Traffic-v0"]


def parts(observation):
    """The arrays of an observation by name."""
    return observation if isinstance(observation, dict) else {"all": observation}


@pytest.mark.parametrize("id", IDS)
def test_gymnasium_finds_nothing_wrong(id):
    env = gymnasium.make(id, size=SIZE)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped)
    env.close()


def test_gymnasium_finds_them_without_an_import():
    program = """
        import gymnasium, sys
        env = gymnasium.make("relief.envs:relief/LaneFollow-v0", size=(8, 8))
        print(env.spec.id, env.reset(seed=1)[0].shape)
        many = gymnasium.make_vec("relief.envs:relief/Traffic-v0", 2, size=(8, 8))
        print(many.spec.id, many.reset(seed=1)[0]["state"].shape)
    """
    done = subprocess.run([sys.executable, "-c", textwrap.dedent(program)], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    assert done.stdout == "relief/LaneFollow-v0 (8, 8, 3)\nrelief/Traffic-v0 (2, 8)\n"


class Asked(Traffic):
    """Asks each environment: of what it observes there are no arrays of all."""

    def observe(self, episode, capture):
        return super().observe(episode, capture)


def leaves(value):
    """The arrays and numbers of something nested."""
    if isinstance(value, dict):
        return [leaf for key in sorted(value) for leaf in [key, *leaves(value[key])]]
    if isinstance(value, tuple) or isinstance(value, np.ndarray) and value.dtype == object:
        return [leaf for own in value for leaf in leaves(own)]
    return [value]


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_arrays_of_all_are_what_captures_of_each_are(mode):
    assert Traffic().is_seen_together and not Asked().is_seen_together
    envs = [DrivingVectorEnv(kind(size=SIZE), 3, autoreset_mode=mode) for kind in (Traffic, Asked)]
    np.testing.assert_equal(*(leaves(env.reset(seed=5)) for env in envs))
    random, ends = np.random.default_rng(7), 0
    for step in range(120):
        moves = random.uniform((-0.3, 0.3), (0.3, 1.0), (3, 2)).astype(np.float32)
        given = [env.step(moves) for env in envs]
        np.testing.assert_equal(*(leaves(own) for own in given), err_msg=f"step {step}")
        assert [sim.hash() for sim in envs[0].sims] == [sim.hash() for sim in envs[1].sims], step
        ends += int((given[0][2] | given[0][3]).sum())
    assert ends > 3, "no episode ended: resets were not compared"
    for env in envs:
        env.close()


def test_the_town_is_the_same_again():
    env = gymnasium.make("relief/Town-v0", size=SIZE)
    observation, _ = env.reset(seed=4)
    assert env.unwrapped.sim["ego"].speed == 0.0
    *_, terminated, _, _ = env.step(np.zeros(2, np.float32))
    assert not terminated
    again, _ = env.reset(seed=4)
    assert all(np.array_equal(array, parts(again)[name]) for name, array in parts(observation).items())
    env.close()


def until_one_ends(env):
    """Steps until an episode ends; what the step gave."""
    moves = np.tile(np.array([1.0, 1.0], np.float32), (env.num_envs, 1))
    # The last environment stays where it is.
    moves[-1] = 0.0
    for _ in range(80):
        given = env.step(moves)
        if given[2].any():
            return moves, given
    raise AssertionError("no episode ended")


def test_what_has_ended_is_reset_by_the_next_step():
    env = relief.make_vec("relief/LaneFollow-v0", 2, size=SIZE)
    env.reset(seed=3)
    moves, (_, _, terminated, _, _) = until_one_ends(env)
    assert terminated.tolist() == [True, False]
    observation, rewards, terminated, truncated, _ = env.step(moves)
    assert not terminated.any() and not truncated.any() and rewards[0] == 0.0
    assert [sim.steps for sim in env.sims][0] == 0
    # Its picture is that of the reset world.
    assert np.array_equal(observation[0], env.sims[0].look("camera")["camera"].color)
    env.close()


def test_what_has_ended_is_reset_in_the_same_step():
    env = relief.make_vec("relief/LaneFollow-v0", 2, size=SIZE, autoreset_mode="SAME_STEP")
    env.reset(seed=3)
    # Gymnasium has names of its own for modes since 1.1.
    modes = getattr(gymnasium.vector, "AutoresetMode", None)
    assert env.metadata["autoreset_mode"] == ("SameStep" if modes is None else modes.SAME_STEP)
    _, (observation, _, terminated, _, infos) = until_one_ends(env)
    assert terminated.tolist() == [True, False]
    assert infos["_final_obs"].tolist() == [True, False]
    assert infos["_speed"].tolist() == [False, True] and infos["final_info"]["_speed"].tolist() == [True, False]
    assert infos["final_obs"][0].shape == observation[0].shape and infos["final_obs"][1] is None
    assert not np.array_equal(infos["final_obs"][0], observation[0])
    assert env.sims[0].steps == 0 and env.sims[1].steps > 0
    env.close()


def test_what_has_ended_waits_for_a_reset():
    env = relief.make_vec("relief/LaneFollow-v0", 2, size=SIZE, autoreset_mode="Disabled")
    env.reset(seed=3)
    moves, _ = until_one_ends(env)
    with pytest.raises(gymnasium.error.ResetNeeded, match=r"\[0\]"):
        env.step(moves)
    steps = env.sims[1].steps
    env.reset(options={"reset_mask": np.array([True, False])})
    assert [sim.steps for sim in env.sims] == [0, steps]
    env.step(moves)
    env.close()


def test_an_episode_ends_beside_the_road():
    env = DrivingEnv("relief/Traffic-v0", size=SIZE)
    env.reset(seed=2)
    env.sim["ego"].drive(steer=0.0)
    for _ in range(120):
        *_, terminated, _, info = env.step(np.array([-1.0, 0.6], np.float32))
        if terminated:
            break
    assert terminated
    # Half a lane, and what is driven in a step.
    assert abs(info["offset"]) < 1.75 + 0.1 * abs(info["speed"]) + 0.1
    env.close()


def test_no_array_is_given_twice():
    env = relief.make_vec("relief/Traffic-v0", 2, size=SIZE)
    before, _ = env.reset(seed=1)
    copies = {name: array.copy() for name, array in before.items()}
    after, *_ = env.step(np.full((2, 2), 0.5, np.float32))
    for name, array in before.items():
        assert not np.shares_memory(array, after[name])
        assert np.array_equal(array, copies[name])
    env.close()


def test_what_is_rendered_is_what_was_seen():
    env = DrivingEnv("relief/LaneFollow-v0", render_mode="rgb_array", size=SIZE)
    assert env.render() is None
    observation, _ = env.reset(seed=1)
    first, second = env.render(), env.render()
    assert np.array_equal(first, observation)
    assert not np.shares_memory(first, observation) and not np.shares_memory(first, second)
    env.close()
    silent = DrivingEnv("relief/LaneFollow-v0", size=SIZE)
    silent.reset(seed=1)
    assert silent.render() is None
    silent.close()


def test_what_many_render_is_what_they_saw():
    env = gymnasium.make_vec("relief/LaneFollow-v0", 2, render_mode="rgb_array", size=SIZE)
    assert env.render() is None and "rgb_array" in env.metadata["render_modes"]
    env.reset(seed=1)
    observation, *_ = env.step(np.zeros((2, 2), np.float32))
    pictures = env.render()
    assert isinstance(pictures, tuple) and np.array_equal(np.stack(pictures), observation)
    assert not any(np.shares_memory(picture, observation) for picture in pictures)
    env.close()
    with pytest.raises(ValueError, match="render_mode: expected None or 'rgb_array', found 'human'"):
        relief.make_vec("relief/LaneFollow-v0", 2, render_mode="human")


ASYNC = """
import gymnasium, numpy, relief.envs
env = gymnasium.make_vec("relief/LaneFollow-v0", 2, vectorization_mode="async", size=(8, 8))
observation, _ = env.reset(seed=5)
stepped, *_ = env.step(numpy.zeros((2, 2), numpy.float32))
env.close()
own = relief.make_vec("relief/LaneFollow-v0", 2, size=(8, 8))
assert (own.reset(seed=5)[0] == observation).all()
assert (own.step(numpy.zeros((2, 2), numpy.float32))[0] == stepped).all()
own.close()
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="skipped: no fork")
def test_environments_in_forked_processes_are_those_of_one(tmp_path):
    """In a process that has no world yet, as programs that train have it. Python 3.14 and macOS spawn by default."""
    program = tmp_path / "own.py"
    fork = "import multiprocessing; multiprocessing.set_start_method('fork')\n"
    program.write_text(fork + ASYNC)
    done = subprocess.run([sys.executable, str(program)], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr


def test_worlds_are_loaded_by_the_first_reset():
    class Nowhere(LaneFollow):
        scene = "envs/none.ron"

    for env in (DrivingEnv(Nowhere(size=SIZE)), DrivingVectorEnv(Nowhere(size=SIZE), 2)):
        assert env.observation_space.shape[-3:] == (SIZE[1], SIZE[0], 3)
        env.close()
        with pytest.raises(relief.SceneError, match="none.ron"):
            env.reset(seed=1)


def test_another_clock_is_that_of_times(tmp_path):
    class Slow(LaneFollow):
        def load(self):
            return relief.Sim(relief.assets() / self.scene, step_seconds=0.05)

    env = DrivingEnv(Slow(size=(8, 8)))
    env.reset(seed=1)
    for _ in range(3):
        *_, info = env.step(np.array([0.0, 0.5], np.float32))
    assert env.sim.steps == 6 and env.sim.seconds == pytest.approx(0.3)
    assert info["progress"] == pytest.approx(info["speed"] * 0.1, rel=0.01)
    env.close()


def test_what_is_missing_is_named_with_its_extra(tmp_path):
    (tmp_path / "gymnasium.py").write_text("raise ImportError('none', name='gymnasium')")
    (tmp_path / "PIL.py").write_text("raise ImportError('none', name='PIL')")
    program = "import {0}"
    for module, extra in (("relief.envs", "gym"), ("relief.pictures", "notebooks")):
        path = os.pathsep.join([str(tmp_path), *filter(None, [os.environ.get("PYTHONPATH")])])
        done = subprocess.run(
            [sys.executable, "-c", program.format(module)], capture_output=True, text=True,
            env={**os.environ, "PYTHONPATH": path},
        )  # fmt: skip
        assert f"ImportError: none; expected pip install 'relief[{extra}]'" in done.stderr, done.stderr


def test_depths_of_a_byte_are_even_steps_of_the_logarithm():
    near, far = 0.5, 100.0
    metres = near * (far / near) ** (np.arange(254) / 253)
    assert log_depth(metres).tolist() == list(range(1, 255))
    assert log_depth(np.array([0.1, 1e6, np.inf])).tolist() == [1, 254, 255]


def test_what_is_wrong_is_said():
    with pytest.raises(ValueError, match="unknown environment 'relief/Lane'; expected a Task, or one of: relief/LaneFollow-v0"):
        relief.make_vec("relief/Lane", 2)
    for count in (0, -1, 2.5, "2", True, None):
        with pytest.raises(ValueError, match=f"num_envs: expected a whole number from 1, found {count!r}"):
            relief.make_vec("relief/Traffic-v0", count)
    with pytest.raises(ValueError, match="autoreset_mode: expected one of NextStep, SameStep, Disabled, found 'never'"):
        relief.make_vec("relief/Traffic-v0", 1, autoreset_mode="never")
    with pytest.raises(ValueError, match="expected no options beside a task"):
        DrivingVectorEnv(Traffic(), 1, size=SIZE)
    env = DrivingVectorEnv(LaneFollow(size=SIZE), 2)
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(np.zeros((2, 2), np.float32))
    env.reset(seed=0)
    with pytest.raises(ValueError, match=r"actions: expected shape \(2, 2\), found \(3, 2\)"):
        env.step(np.zeros((3, 2), np.float32))
    with pytest.raises(ValueError, match="actions: expected finite numbers, found nan"):
        env.step([[0.5, 0.5], [np.nan, 0.0]])
    # Nothing of it was done.
    assert np.isfinite(env.step(np.zeros((2, 2), np.float32))[1]).all()
    with pytest.raises(ValueError, match="size: expected 1 to 4096 pixels along each side"):
        LaneFollow(size=(0, 36))
    for size in ("ab", 8, (1, 2, 3), (8.5, 8), None):
        with pytest.raises(ValueError, match="size: expected width and height in whole pixels, found"):
            LaneFollow(size=size)
    with pytest.raises(ValueError, match="unknown option 'sise' of relief/Traffic-v0; expected one of: size"):
        relief.make_vec("relief/Traffic-v0", 1, sise=(8, 8))
    for task in (LaneFollow, ["relief/Traffic-v0"], None):
        with pytest.raises(ValueError, match="unknown environment .*; expected a Task, or one of:"):
            relief.make_vec(task, 1)
    env.close()


def test_routes_of_a_task_are_those_of_its_scene():
    class Elsewhere(LaneFollow):
        routes = ("road", "rode")

    env = DrivingEnv(Elsewhere(size=(8, 8)))
    with pytest.raises(ValueError, match="no route 'rode'; expected one of: road"):
        env.reset(seed=1)
    env.close()


@pytest.mark.parametrize("action", ["12", ["0", "1"], [1j, 0], [1e300, 0.0], [[0.0], [0.0]], None])
def test_actions_are_finite_numbers(action):
    with pytest.raises(ValueError, match="actions: expected"):
        check_actions(action, (2,))


def test_resets_that_are_refused_begin_nothing():
    env = relief.make_vec("relief/LaneFollow-v0", 2, size=(4, 4))
    with pytest.raises(ValueError, match="reset_mask: expected a reset of all environments first"):
        env.reset(seed=0, options={"reset_mask": np.array([True, False])})
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(np.zeros((2, 2), np.float32))
    env.reset(seed=0)
    for _ in range(2):
        env.step(np.zeros((2, 2), np.float32))
    for seed, message in [
        ([1], r"a whole number, or 2 of them, found \[1\]"),
        ("a", "a whole number, or 2 of them, found 'a'"),
        ([1, -1], "whole numbers from 0, found -1"),
        ([1, 0.5], "whole numbers from 0, found 0.5"),
        (-1, "whole numbers from 0, found -1"),
    ]:
        with pytest.raises(ValueError, match=f"seed: expected {message}"):
            env.reset(seed=seed)
    # Indices are no mask.
    for mask in ([0, 1], [True], True):
        with pytest.raises(ValueError, match="reset_mask: expected 2 booleans, found"):
            env.reset(options={"reset_mask": mask})
    with pytest.raises(ValueError, match="options: expected no other than reset_mask, found 'mask'"):
        env.reset(options={"mask": np.array([True, False])})
    assert [sim.steps for sim in env.sims] == [12, 12]
    env.close()


def test_what_was_refused_can_be_closed():
    """As versions of Gymnasium do by themselves, where it is deleted."""
    env = DrivingVectorEnv.__new__(DrivingVectorEnv)
    with pytest.raises(ValueError):
        env.__init__("relief/LaneFollow-v0", 0)
    env.close()


def test_seeds_of_any_kind_of_whole_numbers_are_the_same():
    env = relief.make_vec("relief/LaneFollow-v0", 2, size=(4, 4))
    expected, hashes = env.reset(seed=3)[0], [sim.hash() for sim in env.sims]
    for seed in (np.int64(3), [3, 4], (3, 4), range(3, 5), np.array([3, 4])):
        assert np.array_equal(env.reset(seed=seed)[0], expected) and [sim.hash() for sim in env.sims] == hashes
    env.close()
