"""Many environments at once: their worlds are stepped on all threads, and their cameras drawn in one submission."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector.utils import batch_space

import relief

from .tasks import CAMERA, FRAME_SECONDS, Episode, Seen, Task, check_actions, task_of

#: What becomes of environments whose episode has ended, by Gymnasium's names: reset by the next step, whose action does
#: not count; within the step itself, with the last observation in ``info["final_obs"]``; or by `reset` alone.
MODES = ("NextStep", "SameStep", "Disabled")


def _mode(mode: Any) -> str:
    """By name, or as Gymnasium's enumeration, which versions before 1.1 lack."""
    name = str(getattr(mode, "value", mode)).replace("_", "").lower()
    found = next((known for known in MODES if known.lower() == name), None)
    if found is None:
        raise ValueError(f"autoreset_mode: expected one of {', '.join(MODES)}, found {mode!r}")
    return found


def _arrays(observations: Any) -> dict[str, np.ndarray]:
    """Observations by their keys; those of one array by one of its own."""
    return observations if isinstance(observations, dict) else {"": observations}


def make_vec(
    task: str | Task, num_envs: int = 1, *, autoreset_mode: Any = "NextStep", **options: Any
) -> DrivingVectorEnv:
    """Environments of a task, such as ``relief.make_vec("relief/LaneFollow-v0", 64)``. ``options``: those of
    `DrivingVectorEnv`, and of the task."""
    return DrivingVectorEnv(task, num_envs=num_envs, autoreset_mode=autoreset_mode, **options)


class DrivingVectorEnv(gymnasium.vector.VectorEnv):
    """A task in several worlds. What environment i sees is, bit for bit, what a single one sees that was reset with the
    seed of environment i, which is the seed given plus i: whatever the number of environments and of threads.

    ``device="cuda"``: pictures are arrays of CUDA (`relief.cuda.CudaArray`), ``"auto"``: where they can be; what is no
    picture is numpy's. Gymnasium's ``SameStep`` and `render` need them on the CPU, and tasks have to be seen together
    (`Task.is_seen_together`).

    ``render_mode="rgb_array"``: `render` gives what the cameras saw last. Worlds are loaded by the first `reset`: until
    then the process may be forked.
    """

    def __init__(
        self,
        task: str | Task = "relief/LaneFollow-v0",
        num_envs: int = 1,
        *,
        autoreset_mode: Any = "NextStep",
        render_mode: str | None = None,
        device: str = "cpu",
        **options: Any,
    ) -> None:
        # Gymnasium closes what is deleted, also where nothing came of it.
        self._sims: list[relief.Sim] = []
        if isinstance(num_envs, bool) or not isinstance(num_envs, (int, np.integer)) or num_envs < 1:
            raise ValueError(f"num_envs: expected a whole number from 1, found {num_envs!r}")
        if render_mode not in (None, "rgb_array"):
            raise ValueError(f"render_mode: expected None or 'rgb_array', found {render_mode!r}")
        self.num_envs = num_envs = int(num_envs)
        self.render_mode = render_mode
        self._pictures: dict[int, np.ndarray] = {}
        self.task = task_of(task, **options)
        self._together = self.task.is_seen_together
        self.mode = _mode(autoreset_mode)
        self.device = self._checked_device(device)
        modes = getattr(gymnasium.vector, "AutoresetMode", None)
        mode = modes(self.mode) if modes is not None else self.mode
        self.metadata = {"render_modes": ["rgb_array"], "render_fps": round(1 / FRAME_SECONDS), "autoreset_mode": mode}
        self.single_observation_space = self.task.observation_space()
        self.single_action_space = self.task.action_space()
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._random: dict[int, np.random.Generator] = {}
        self._episodes: dict[int, Episode] = {}
        self._ended = np.zeros(num_envs, dtype=bool)

    def _checked_device(self, device: Any) -> str:
        if device not in ("cpu", "cuda", "auto"):
            raise ValueError(f"device: expected 'cpu', 'cuda' or 'auto', found {device!r}")
        if device != "cpu":
            if self.mode == "SameStep":
                raise ValueError(f"autoreset_mode: expected NextStep or Disabled with device={device!r}, not SameStep")
            if self.render_mode is not None:
                raise ValueError(f"render_mode: expected None with device={device!r}, found {self.render_mode!r}")
            if not self._together:
                raise ValueError(
                    f"device: expected 'cpu', found {device!r}: {type(self.task).__name__} looks at each environment "
                    "by itself; expected a task with observe_all and without an outcome of its own"
                )
        return str(device)

    @property
    def sims(self) -> list[relief.Sim]:
        """The worlds, which are loaded if they are not there yet."""
        if not self._sims:
            first = self.task.load()
            self._sims = [first, *(first.fresh() for _ in range(self.num_envs - 1))]
        return list(self._sims)

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begins episodes: in all environments, or, as ``options={"reset_mask": …}`` says, in some. ``seed``: of the
        first environment, those of the others count on from it; or one for each. Raises ValueError."""
        seeds, which = self._seeds(seed), self._mask(options or {})
        if not all(begins or i in self._episodes for i, begins in enumerate(which)):
            raise ValueError("reset_mask: expected a reset of all environments first")
        for i in np.flatnonzero(which).tolist():
            self._begin(i, seeds[i])
        self._ended &= ~which
        every = range(self.num_envs)
        return self._observations(every, self._capture(every)), {}

    def _seeds(self, seed: int | Sequence[int | None] | None) -> list[int | None]:
        whole = (int, np.integer)
        if seed is None or isinstance(seed, whole):
            seeds = [None if seed is None else int(seed) + i for i in range(self.num_envs)]
        elif isinstance(seed, (list, tuple, range, np.ndarray)) and len(seed) == self.num_envs:
            seeds = [int(own) if isinstance(own, whole) else own for own in seed]
        else:
            raise ValueError(f"seed: expected a whole number, or {self.num_envs} of them, found {seed!r}")
        for own in seeds:
            if own is not None and (not isinstance(own, int) or own < 0):
                raise ValueError(f"seed: expected whole numbers from 0, found {own!r}")
        return seeds

    def _mask(self, options: dict[str, Any]) -> np.ndarray:
        for name in options:
            if name != "reset_mask":
                raise ValueError(f"options: expected no other than reset_mask, found {name!r}")
        mask = np.asarray(options.get("reset_mask", np.ones(self.num_envs, dtype=bool)))
        if mask.shape != (self.num_envs,) or mask.dtype != bool:
            raise ValueError(f"reset_mask: expected {self.num_envs} booleans, found {mask.dtype} of shape {mask.shape}")
        return mask

    def _begin(self, i: int, seed: int | None = None) -> None:
        if seed is not None or i not in self._random:
            self._random[i], _ = seeding.np_random(seed)
        self._episodes[i] = self.task.begin(self.sims[i], self._random[i])

    def step(self, actions: Any) -> tuple[Any, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Drives all vehicles for a step of the task."""
        actions = check_actions(actions, (self.num_envs, 2))
        if len(self._episodes) < self.num_envs:
            raise gymnasium.error.ResetNeeded("expected reset() before step()")
        begun = self._ended.copy() if self.mode == "NextStep" else np.zeros(self.num_envs, dtype=bool)
        if self.mode == "Disabled" and self._ended.any():
            ended = np.flatnonzero(self._ended).tolist()
            raise gymnasium.error.ResetNeeded(f"expected reset() of the environments whose episode has ended: {ended}")
        for i, action in enumerate(actions):
            if begun[i]:
                self._begin(i)
            else:
                self.task.act(self._episodes[i], action)
        relief.step(self._sims, [0 if begun[i] else self._episodes[i].frame_steps for i in range(self.num_envs)])
        captures = self._capture(range(self.num_envs))
        outcomes = [
            None if begun[i] else self.task.outcome(self._episodes[i], captures[i]) for i in range(self.num_envs)
        ]
        observations = self._observations(range(self.num_envs), captures)
        rewards = np.array([0.0 if outcome is None else outcome.reward for outcome in outcomes], dtype=np.float64)
        terminated = np.array([outcome is not None and outcome.terminated for outcome in outcomes])
        truncated = np.array([outcome is not None and outcome.truncated for outcome in outcomes])
        self._ended = terminated | truncated
        # In the same step, what was known of an episode that has ended is in its final info alone.
        is_final = self._ended & (self.mode == "SameStep")
        infos: dict[str, Any] = {}
        final: dict[str, Any] = {}
        for i, outcome in enumerate(outcomes):
            if outcome is not None and is_final[i]:
                final = self._add_info(final, outcome.info, i)
            elif outcome is not None:
                infos = self._add_info(infos, outcome.info, i)
        if is_final.any():
            infos["final_info"], infos["_final_info"] = final, is_final.copy()
            self._begin_ended(observations, infos)
        return observations, rewards, terminated, truncated, infos

    def _begin_ended(self, observations: Any, infos: dict[str, Any]) -> None:
        """Begins the episodes of environments whose last has ended. Their last observations go to `infos`."""
        which = np.flatnonzero(self._ended).tolist()
        final = np.full(self.num_envs, None, dtype=object)
        arrays = _arrays(observations)
        for i in which:
            final[i] = {key: own[i].copy() for key, own in arrays.items()} if "" not in arrays else arrays[""][i].copy()
            self._begin(i)
        infos["final_obs"], infos["_final_obs"] = final, self._ended.copy()
        begun = _arrays(self._observations(which, self._capture(which)))
        for key, own in arrays.items():
            own[which] = begun[key]
        self._ended[:] = False

    def _capture(self, which: Sequence[int]) -> Any:
        """What tells outcomes and observations of environments, in their order."""
        sims = self.sims
        sims = [sims[i] for i in which]
        return Seen(sims, self.device) if self._together else relief.capture_due(sims)

    def _observations(self, which: Sequence[int], captures: Any) -> Any:
        """Of environments, in arrays that nothing else has."""
        episodes = [self._episodes[i] for i in which]
        if self.render_mode is not None:
            colors = captures.camera.color if self._together else [own[f"ego/{CAMERA}"].color for own in captures]
            self._pictures.update(zip(which, (color.copy() for color in colors)))
        if self._together:
            return self.task.observe_all(episodes, captures)
        each: list[Any] = [self.task.observe(episode, capture) for episode, capture in zip(episodes, captures)]
        if isinstance(self.single_observation_space, gymnasium.spaces.Dict):
            return {key: np.stack([own[key] for own in each]) for key in self.single_observation_space}
        return np.stack(each)

    def render(self) -> tuple[np.ndarray, ...] | None:
        """What each camera saw last: uint8 (H, W, 3); ``None`` without a render mode."""
        return tuple(self._pictures[i].copy() for i in range(self.num_envs)) if self._pictures else None

    def close_extras(self, **kwargs: Any) -> None:
        """Gives back what the worlds take on the graphics device."""
        for sim in self._sims:
            sim.close()
