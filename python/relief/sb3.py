"""Environments for Stable-Baselines3: many worlds, stepped and drawn together, as its ``VecEnv``.

>>> from relief.sb3 import VecEnv                                                                  # doctest: +SKIP
>>> model = stable_baselines3.PPO("CnnPolicy", VecEnv("relief/LaneFollow-v0", 8))                 # doctest: +SKIP

This needs Stable-Baselines3, which needs PyTorch.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from .extras import missing

try:
    from stable_baselines3.common import vec_env
except ImportError as error:
    raise missing(error, "sb3") from None

from .envs import Task, make_vec


class VecEnv(vec_env.VecEnv):
    """What ``DummyVecEnv`` of as many single environments gives, bit for bit, with all cameras in one submission.

    ``task``: an id of `relief.envs.TASKS`, or a task. ``options``: of the task. `VecMonitor` of Stable-Baselines3
    around it adds the returns of episodes. Raises ValueError.
    """

    def __init__(self, task: str | Task = "relief/LaneFollow-v0", num_envs: int = 1, **options: Any) -> None:
        self.envs = make_vec(task, num_envs, autoreset_mode="SameStep", **options)
        self._actions: Any = None
        super().__init__(num_envs, self.envs.single_observation_space, self.envs.single_action_space)

    def reset(self) -> Any:
        """Begins episodes in all environments, with the seeds of `seed` if it was called."""
        observation, _ = self.envs.reset(seed=list(self._seeds))
        self._reset_seeds()
        self._reset_options()
        return observation

    def step_async(self, actions: npt.NDArray[np.float32]) -> None:
        """Notes the actions, float32 (N, 2), of the next `step_wait`."""
        self._actions = actions

    def step_wait(self) -> tuple[Any, npt.NDArray[np.float32], npt.NDArray[np.bool_], list[dict[str, Any]]]:
        """Drives for a tenth of a second. Episodes that end begin anew at once: ``terminal_observation`` is what was
        seen last, ``TimeLimit.truncated`` whether time alone has ended them."""
        observation, rewards, terminated, truncated, told = self.envs.step(self._actions)
        dones = terminated | truncated
        infos: list[dict[str, Any]] = []
        for i in range(self.num_envs):
            info = _of(told.get("final_info", {}) if dones[i] else told, i)
            info["TimeLimit.truncated"] = bool(truncated[i] and not terminated[i])
            if dones[i]:
                info["terminal_observation"] = told["final_obs"][i]
            infos.append(info)
        return observation, rewards.astype(np.float32), dones, infos

    def close(self) -> None:
        """Gives back what the worlds take on the graphics device."""
        self.envs.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """``sim``, ``task`` or ``render_mode`` of environments. Raises AttributeError."""
        count = self.num_envs
        own: dict[str, list[Any]] = {
            "render_mode": [None] * count, "sim": list(self.envs.sims), "task": [self.envs.task] * count
        }
        if attr_name not in own:
            raise AttributeError(f"expected one of {', '.join(own)}, found {attr_name!r}")
        return [own[attr_name][i] for i in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Nothing can be set. Raises AttributeError."""
        raise AttributeError(f"{attr_name!r}: environments have nothing to be set")

    def env_method(self, method_name: str, *arguments: Any, indices: Any = None, **options: Any) -> list[Any]:
        """Environments have no methods by themselves. Raises AttributeError."""
        raise AttributeError(f"{method_name!r}: environments have no methods by themselves")

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        """None is."""
        return [False for _ in self._get_indices(indices)]


def _of(told: dict[str, Any], i: int) -> dict[str, Any]:
    """What a dictionary of arrays tells of environment i."""
    own: dict[str, Any] = {}
    for name, values in told.items():
        mask: Sequence[bool] | None = told.get(f"_{name}")
        if not name.startswith("_") and name not in ("final_obs", "final_info") and mask is not None and mask[i]:
            own[name] = values[i]
    return own
