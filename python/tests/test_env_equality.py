"""Environments at once, against each alone: observations, rewards and states, bit for bit.

The number of threads is set before the first world, so runs are processes of their own: ``test_env_equality.py N``
drives with N threads and prints what came of it. Observations are compared by their hashes.

Of 64 environments the `FEW` are compared. Environments end their episodes at steps of their own and are reset by the
next one, so resets come in many orders.
"""

import hashlib
import json
import subprocess
import sys

import numpy as np
import pytest

from conftest import needed

needed("gymnasium")

import relief  # noqa: E402
from relief.envs import DrivingEnv  # noqa: E402

TASK, SIZE, SEED = "relief/Traffic-v0", (16, 16), 11
#: How many environments at once, and how many steps of each.
COUNTS, STEPS = (1, 3, 64), 200
#: Of the environments those that are compared.
FEW = [0, 1, 2, 31, 63]


def compared(count):
    return [i for i in FEW if i < count]


def actions(i):
    """Of environment i, float32 (STEPS, 2): each drives its own way, and leaves the road sooner or later."""
    random = np.random.default_rng(i)
    steer = np.clip(np.cumsum(random.normal(0.0, 0.02, STEPS)), -1.0, 1.0)
    return np.stack([steer, random.uniform(0.3, 1.0, STEPS)], axis=1).astype(np.float32)


def digest(observation):
    arrays = [observation[name].tobytes() for name in sorted(observation)]
    return hashlib.sha256(b"".join(arrays)).hexdigest()[:16]


def alone(i):
    """Of each step of one environment: observation, reward, whether it ended, state. What has ended is reset by the
    next step, as in many at once."""
    env = DrivingEnv(TASK, size=SIZE)
    observation, _ = env.reset(seed=SEED + i)
    rows, ended = [[digest(observation), 0.0, False, env.sim.hash()]], False
    for action in actions(i):
        if ended:
            (observation, _), reward, ended = env.reset(), 0.0, False
        else:
            observation, reward, terminated, truncated, _ = env.step(action)
            ended = terminated or truncated
        rows.append([digest(observation), reward, ended, env.sim.hash()])
    env.close()
    return rows


def together(count):
    """The same of several environments at once, by their indices. They drive elsewhere first, then are reset one after
    the other, the last one first."""
    env = relief.make_vec(TASK, count, size=SIZE)
    env.reset(seed=SEED + 1000)
    env.step(np.ones((count, 2), np.float32))
    for i in reversed(compared(count)):
        seeds = [SEED + k for k in range(count)]
        observation, _ = env.reset(seed=seeds, options={"reset_mask": np.arange(count) == i})
    moves = np.stack([actions(i) for i in range(count)], axis=1)
    rewards, ended = np.zeros(count), np.zeros(count, dtype=bool)
    rows = {i: [] for i in compared(count)}
    for step in range(STEPS + 1):
        for i in rows:
            own = {name: array[i] for name, array in observation.items()}
            rows[i].append([digest(own), float(rewards[i]), bool(ended[i]), env.sims[i].hash()])
        if step < STEPS:
            observation, rewards, terminated, truncated, _ = env.step(moves[step])
            ended = terminated | truncated
    env.close()
    return rows


@pytest.fixture(scope="module")
def runs():
    """What came of it with 1 and 2 threads: the rows of `together` by the number of environments."""
    found = {}
    for threads in (1, 2):
        run = subprocess.run([sys.executable, __file__, str(threads)], capture_output=True, text=True)
        assert run.returncode == 0, run.stderr
        found[threads] = json.loads(run.stdout)
    return found


@pytest.fixture(scope="module")
def expected():
    """Of each environment by itself, the last one first."""
    return {i: alone(i) for i in reversed(FEW)}


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("count", COUNTS)
def test_many_at_once_are_what_each_is_alone(runs, expected, count, threads):
    found = runs[threads][str(count)]
    assert sorted(map(int, found)) == compared(count)
    for i in compared(count):
        rows = found[str(i)]
        assert len(rows) == STEPS + 1
        for step, row in enumerate(rows):
            assert row == expected[i][step], f"environment {i}, step {step}: observation, reward, ended, state"


def test_some_episodes_end_on_the_way(expected):
    """Or resets by steps were not compared."""
    assert all(any(ended for _, _, ended, _ in expected[i]) for i in FEW)


if __name__ == "__main__":
    relief.set_threads(int(sys.argv[1]))
    print(json.dumps({count: together(count) for count in COUNTS}))
