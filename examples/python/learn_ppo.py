"""Learns to keep a lane from pictures, with PPO of Stable-Baselines3 (``pip install '.[sb3]'``).

python examples/python/learn_ppo.py [--seed 0] [--steps 60000] [--environments 16] [-o curve.csv]

Proximal policy optimization (Schulman et al., 2017) with the network for Atari games of Mnih et al., 2015, which
Stable-Baselines3 calls ``CnnPolicy``. It sees a picture of 48 × 48 pixels, and asks for a steering and a speed; a
cruise control moves the pedal.

From time to time, and at the end, the mean policy drives from starts that were not learned from, for 20 s or until its
episode ends. Prints how far and how fast it came, beside driving straight ahead and at random, and writes it as CSV.
plot_curve.py draws several such files.
"""

import argparse
import csv
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecEnvWrapper

import relief
from relief.sb3 import VecEnv

SIZE = (48, 48)
#: Of tests: how many places to start from, from which seed on, and how many steps of a tenth of a second.
STARTS, FIRST_SEED, STEPS = 16, 3_000_000, 200
COLUMNS = ("policy", "seed", "steps", "seconds", "metres", "least", "most", "speed", "reward", "kept")
#: The most that a policy can ask for, m/s. The speed limit of the road is 11.1; tyres hold 8 in its sharpest bends.
FASTEST = 9.0


class Cruise(VecEnvWrapper):
    """Actions are steering and speed, of which −1 is to stand and 1 is `FASTEST`.

    A picture does not tell the speed, and a pedal held at one half leads ever faster, until a bend is missed.
    """

    def reset(self) -> Any:
        self.speeds = np.zeros(self.num_envs)
        return self.venv.reset()

    def step_async(self, actions: npt.NDArray[np.float32]) -> None:
        wanted = (actions[:, 1] + 1.0) / 2.0 * FASTEST
        pedal = np.clip(0.3 * (wanted - self.speeds), -1.0, 1.0)
        self.venv.step_async(np.stack([actions[:, 0], pedal], axis=1).astype(np.float32))

    def step_wait(self) -> tuple[Any, npt.NDArray[np.float32], npt.NDArray[np.bool_], list[dict[str, Any]]]:
        pictures, rewards, dones, infos = self.venv.step_wait()
        # Those that ended have begun anew, at a standstill.
        self.speeds = np.where(dones, 0.0, [info["speed"] for info in infos])
        return pictures, rewards, dones, infos


def environments(count: int) -> Cruise:
    """So many of them."""
    return Cruise(VecEnv("relief/LaneFollow-v0", count, size=SIZE))


def drive(env: Cruise, act: Callable[[Any], npt.NDArray[np.float32]]) -> dict[str, float]:
    """How a policy drives from all starts. Metres along the lane are the mean, the least and the most; their speed is
    that of all together. Rewards are the mean sum. What is kept is the share of starts whose lane is, to the end."""
    env.seed(FIRST_SEED)
    pictures: Any = env.reset()
    drives = np.ones(env.num_envs, dtype=bool)
    rewards, metres, seconds = (np.zeros(env.num_envs) for _ in range(3))
    for _ in range(STEPS):
        pictures, reward, done, infos = env.step(act(pictures))
        rewards += np.where(drives, reward, 0.0)
        metres += np.where(drives, [info["progress"] for info in infos], 0.0)
        seconds += 0.1 * drives
        drives &= ~done
        if not drives.any():
            break
    return {
        "metres": metres.mean(),
        "least": metres.min(),
        "most": metres.max(),
        "speed": metres.sum() / seconds.sum(),
        "reward": rewards.mean(),
        "kept": drives.mean(),
    }


class Curve(BaseCallback):
    """Tests the policy between rollouts, each time that so many steps were learned from."""

    def __init__(self, env: Cruise, every: int, report: Callable[[str, int, float, dict[str, float]], None]) -> None:
        super().__init__()
        self.env, self.every, self.report = env, every, report
        self.seconds, self.tested = 0.0, -1

    def _on_training_start(self) -> None:
        self.since = time.perf_counter()

    def _on_rollout_start(self) -> None:
        if self.num_timesteps // self.every > self.tested:
            self.test()

    def _on_training_end(self) -> None:
        self.test()

    def _on_step(self) -> bool:
        return True

    def test(self) -> None:
        """Tests the policy. The time that this takes is not counted."""
        self.seconds += time.perf_counter() - self.since
        self.tested = self.num_timesteps // self.every
        came = drive(self.env, lambda pictures: self.model.predict(pictures, deterministic=True)[0])
        self.report("ppo", self.num_timesteps, self.seconds, came)
        self.since = time.perf_counter()


def main() -> None:
    parser = argparse.ArgumentParser(description="Learns to keep a lane from pictures, with PPO")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--steps", type=int, default=60_000, help="of all environments together")
    parser.add_argument("--every", type=int, default=5_000, help="steps between two tests")
    parser.add_argument("--environments", type=int, default=16)
    parser.add_argument("--threads", type=int, default=2, help="of worlds and of the network")
    parser.add_argument("-o", "--output", help="a CSV file")
    args = parser.parse_args()
    relief.set_threads(args.threads)
    torch.set_num_threads(args.threads)
    rows: list[dict[str, Any]] = []

    def report(policy: str, steps: int, seconds: float, came: dict[str, float]) -> None:
        rows.append({"policy": policy, "seed": args.seed, "steps": steps, "seconds": round(seconds, 1), **came})
        print(
            f"{policy:8} {steps:8} {seconds:7.0f} {came['metres']:8.1f} {came['least']:7.1f} {came['most']:7.1f} "
            f"{came['speed']:7.1f} {came['reward']:8.1f} {came['kept']:6.0%}",
            flush=True,
        )

    print("policy      steps seconds   metres   least    most   speed   reward   kept")
    tested = environments(STARTS)
    random = np.random.default_rng(args.seed)
    report("random", 0, 0.0, drive(tested, lambda _: random.uniform(-1.0, 1.0, (STARTS, 2)).astype(np.float32)))
    report("straight", 0, 0.0, drive(tested, lambda _: np.tile(np.array([0.0, 0.0], np.float32), (STARTS, 1))))
    learned = environments(args.environments)
    model = PPO(
        "CnnPolicy",
        learned,
        learning_rate=lambda left: 5e-4 * left,
        n_steps=1024 // args.environments,
        batch_size=256,
        n_epochs=4,
        # Looks ahead some three seconds: what leads off the lane shows by then.
        gamma=0.97,
        gae_lambda=0.95,
        # At a deviation of 1 the wheel would be turned to and fro, and no lane kept.
        policy_kwargs={"log_std_init": -1.0},
        seed=args.seed,
        device="cpu",
    )
    model.learn(args.steps, callback=Curve(tested, args.every, report))
    if args.output:
        with open(args.output, "w", encoding="utf-8", newline="") as file:
            writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
            writer.writeheader()
            for row in rows:
                writer.writerow({name: round(v, 3) if isinstance(v := row[name], float) else v for name in COLUMNS})
    for env in (learned, tested):
        env.close()


if __name__ == "__main__":
    main()
