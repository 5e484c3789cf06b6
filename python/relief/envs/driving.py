"""One environment of Gymnasium: a world with a vehicle to drive."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np

import relief

from .tasks import CAMERA, FRAME_SECONDS, Episode, Task, check_actions, task_of


class DrivingEnv(gymnasium.Env):
    """A task in a world of its own.

    ``task``: an id of `TASKS`, or a task. ``options``: of the task, such as ``size=(84, 84)``, the camera's width and
    height in pixels. ``render_mode="rgb_array"``: `render` gives what the camera saw last.

    The world is loaded by the first `reset`: until then the process may be forked.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": round(1 / FRAME_SECONDS)}

    def __init__(
        self, task: str | Task = "relief/LaneFollow-v0", *, render_mode: str | None = None, **options: Any
    ) -> None:
        if render_mode not in (None, "rgb_array"):
            raise ValueError(f"render_mode: expected None or 'rgb_array', found {render_mode!r}")
        self.render_mode = render_mode
        self.task = task_of(task, **options)
        self.observation_space = self.task.observation_space()
        self.action_space = self.task.action_space()
        self._sim: relief.Sim | None = None
        self._episode: Episode | None = None
        self._picture: np.ndarray | None = None

    @property
    def sim(self) -> relief.Sim:
        """The world, which is loaded if it is not there yet."""
        if self._sim is None:
            self._sim = self.task.load()
        return self._sim

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Begins an episode. The same seed, the same episode."""
        super().reset(seed=seed)
        self._episode = self.task.begin(self.sim, self.np_random)
        return self._look(self._episode, self.sim.capture()), {}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Drives for a step of the task."""
        if self._episode is None:
            raise gymnasium.error.ResetNeeded("expected reset() before step()")
        self.task.act(self._episode, check_actions(action, (2,)))
        self.sim.step(self._episode.frame_steps)
        capture = self.sim.capture()
        observation = self._look(self._episode, capture)
        outcome = self.task.outcome(self._episode, capture)
        return observation, outcome.reward, outcome.terminated, outcome.truncated, outcome.info

    def _look(self, episode: Episode, capture: relief.Capture) -> Any:
        if self.render_mode is not None:
            self._picture = capture[f"ego/{CAMERA}"].color
        return self.task.observe(episode, capture)

    def render(self) -> np.ndarray | None:
        """What the camera saw last: uint8 (H, W, 3); ``None`` without a render mode."""
        return None if self._picture is None else self._picture.copy()

    def close(self) -> None:
        """Gives back what the world takes on the graphics device."""
        if self._sim is not None:
            self._sim.close()
