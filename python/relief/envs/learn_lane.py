"""Learns to keep a lane, with no more than numpy beside Gymnasium.

python -m relief.envs.learn_lane [--seconds 60] [--environments 32]

The cross-entropy method (Rubinstein, 1999; for policies Szita and Lörincz, 2006): policies are drawn from a normal
distribution, each drives once, and the distribution moves to the best of them. A policy is linear in how much greener
a picture of 16 × 16 pixels is on its left than on its right: it turns the wheel, and brakes where it turns much.

Prints the mean reward and how far the best policies of each generation came, then how far the mean policy comes from
other places, and what share of them it keeps the lane from; beside it what driving straight ahead comes to.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable

import numpy as np

import relief

from .vector import DrivingVectorEnv

SIDE = 16
#: Pixels of the lower part of the picture: what is above the horizon tells nothing. They are averaged by fours.
ROWS = slice(6, 16)
FEATURES = (ROWS.stop - ROWS.start) // 2 * SIDE // 4


def features(pictures: np.ndarray) -> np.ndarray:
    """How much greener the left half of pictures (N, 16, 16, 3) is than the right one, mirrored: (N, FEATURES).

    Grass is much greener than asphalt, but hardly brighter. The mirrored road asks for the mirrored steering, so one
    weight does for both sides.
    """
    green = pictures[:, ROWS, :, 1].astype(np.float32) - pictures[:, ROWS, :, 2]
    differences = (green - green[:, :, ::-1])[:, :, : SIDE // 2] / 64.0
    means: np.ndarray = differences.reshape(len(pictures), -1, 2, SIDE // 4, 2).mean(axis=(2, 4))
    return means.reshape(len(pictures), -1)


def act(policies: np.ndarray, pictures: np.ndarray, speeds: np.ndarray) -> np.ndarray:
    """Steering and pedal of policies (N, FEATURES) that see pictures (N, 16, 16, 3): (N, 2)."""
    steer = np.tanh((policies * features(pictures)).sum(axis=1))
    # A target speed, lower in bends.
    pedal = np.clip(0.3 * (7.0 - 3.0 * np.abs(steer) - speeds), -1.0, 1.0)
    return np.stack([steer, pedal], axis=1).astype(np.float32)


def drive(
    env: DrivingVectorEnv, policies: np.ndarray, seed: int | list[int], steps: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Each policy drives in an environment of its own. Their rewards, how many metres they came, and whether they kept
    the lane to the end: (N,) each."""
    pictures, _ = env.reset(seed=seed)
    drives = np.ones(env.num_envs, dtype=bool)
    rewards, metres, speeds = (np.zeros(env.num_envs) for _ in range(3))
    for _ in range(steps):
        pictures, reward, terminated, truncated, info = env.step(act(policies, pictures, speeds))
        speeds = np.where(drives, info.get("speed", speeds), 0.0)
        rewards += np.where(drives, reward, 0.0)
        metres += np.where(drives, info.get("progress", 0.0), 0.0)
        drives &= ~(terminated | truncated)
        if not drives.any():
            break
    return rewards, metres, drives


def learn(
    env: DrivingVectorEnv,
    steps: int,
    *,
    seconds: float = np.inf,
    generations: float = np.inf,
    seed: int = 0,
    report: Callable[[str], object] = print,
) -> np.ndarray:
    """The mean policy after so many seconds, or so many generations: whichever comes first."""
    random = np.random.default_rng(seed)
    mean, deviation = np.zeros(FEATURES), np.full(FEATURES, 0.1)
    began, generation = time.perf_counter(), 0
    while generation < generations and time.perf_counter() - began < seconds:
        policies = mean + deviation * random.standard_normal((env.num_envs, FEATURES))
        # All from the same place, or luck would choose.
        rewards, metres, _ = drive(env, policies, [seed + 1 + generation] * env.num_envs, steps)
        best = np.argsort(rewards)[-max(env.num_envs // 5, 2) :]
        mean = policies[best].mean(axis=0)
        deviation = policies[best].std(axis=0) + 0.03 * 0.9**generation
        generation += 1
        report(
            f"{time.perf_counter() - began:5.1f} s, generation {generation}: mean reward {rewards.mean():7.1f}, "
            f"best {rewards[best].mean():7.1f}, {metres[best].mean():5.0f} m"
        )
    return mean


def main() -> None:
    parser = argparse.ArgumentParser(description="Learns to keep a lane from pictures")
    parser.add_argument("--seconds", type=float, default=60.0, help="how long to learn")
    parser.add_argument("--environments", type=int, default=32)
    parser.add_argument("--steps", type=int, default=300, help="of an episode, a tenth of a second each")
    args = parser.parse_args()
    env = relief.make_vec("relief/LaneFollow-v0", args.environments, size=(SIDE, SIDE))
    mean = learn(env, args.steps, seconds=args.seconds)
    tested = np.tile(mean, (env.num_envs, 1))
    for name, policies in [("learned", tested), ("straight ahead", np.zeros_like(tested))]:
        rewards, metres, kept = drive(env, policies, 1_000_000, args.steps)
        print(
            f"{name}: {np.median(metres):.0f} m in the median of {env.num_envs} starts, reward {rewards.mean():.1f}, "
            f"{kept.mean():.0%} keep the lane"
        )
    env.close()


if __name__ == "__main__":
    main()
