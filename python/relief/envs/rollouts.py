"""Episodes that a policy drives, some at a time, and files of them.

An episode follows from its task, the policy and its seed, so it does not matter where and when it is driven. Its names
are Minari's: ``minari.data_collector.EpisodeBuffer`` takes them as they are.
"""

from __future__ import annotations

import contextlib
import dataclasses
import secrets
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium.utils import seeding

import relief

from .tasks import Episode, Task, check_actions, task_of

#: What drives: of the observations of N environments, stacked, and the random numbers of each, N actions. It has no
#: memory of its own.
Policy = Callable[[Any, Sequence[np.random.Generator]], Any]


def at_random(observations: Any, random: Sequence[np.random.Generator]) -> npt.NDArray[np.float32]:
    """The policy that looks at nothing: actions from −1 to 1, all equally likely."""
    return np.stack([own.uniform(-1.0, 1.0, 2).astype(np.float32) for own in random])


@contextlib.contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Where a file is written until it is whole, and then takes its place. No other process, on any machine, has it."""
    part = path.with_name(f"{path.name}.{secrets.token_hex(8)}.part")
    try:
        yield part
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


@dataclasses.dataclass(frozen=True)
class Rollout:
    """An episode of T steps.

    ``observations``: (T + 1, …), or a dictionary of such; ``actions``: float32 (T, 2), as the policy gave them: what is
    beyond −1 or 1 acts as these; ``rewards``: float64 (T,); ``terminations`` and ``truncations``: bool (T,), true at
    the end alone; ``infos``: float64 (T,) of each name.
    """

    seed: int
    observations: Any
    actions: npt.NDArray[np.float32]
    rewards: npt.NDArray[np.float64]
    terminations: npt.NDArray[np.bool_]
    truncations: npt.NDArray[np.bool_]
    infos: dict[str, npt.NDArray[np.float64]]

    def save(self, path: Path) -> None:
        """Writes it as ``.npz``, whole or not at all: dictionaries as ``infos/speed``. Raises OSError."""
        arrays: dict[str, Any] = {"seed": np.int64(self.seed)}
        for field in dataclasses.fields(self)[1:]:
            value = getattr(self, field.name)
            named = {f"{field.name}/{key}": own for key, own in value.items()} if isinstance(value, dict) else None
            arrays.update({field.name: value} if named is None else named)
        with whole_file(path) as part, open(part, "wb") as file:
            np.savez_compressed(file, **arrays)


def read(path: Path) -> Rollout:
    """An episode that was saved. Raises OSError; ValueError where the file is damaged."""
    fields: dict[str, Any] = {}
    try:
        with np.load(path, allow_pickle=False) as file:
            for name in file.files:
                field, _, key = name.partition("/")
                if key:
                    fields.setdefault(field, {})[key] = file[name]
                else:
                    fields[field] = file[name]
        return Rollout(seed=int(fields.pop("seed")), **fields)
    except OSError:
        raise
    except Exception as error:
        # Decoders of zip files raise what they like.
        raise ValueError(f"{path}: expected an episode: {error}") from None


@dataclasses.dataclass
class _Run:
    """An episode under way."""

    seed: int
    episode: Episode
    random: np.random.Generator
    observations: list[Any]
    actions: list[npt.NDArray[np.float32]] = dataclasses.field(default_factory=list)
    rewards: list[float] = dataclasses.field(default_factory=list)
    infos: list[dict[str, float]] = dataclasses.field(default_factory=list)

    def ended(self, terminated: bool, truncated: bool) -> Rollout:
        """What it was."""
        terminations, truncations = (np.zeros(len(self.actions), dtype=bool) for _ in range(2))
        terminations[-1], truncations[-1] = terminated, truncated
        return Rollout(
            seed=self.seed,
            observations=_stacked(self.observations),
            actions=np.stack(self.actions),
            rewards=np.array(self.rewards),
            terminations=terminations,
            truncations=truncations,
            infos={key: np.array([info[key] for info in self.infos], np.float64) for key in self.infos[0]},
        )


def _stacked(observations: Sequence[Any]) -> Any:
    """Observations as arrays with an axis more."""
    if isinstance(observations[0], dict):
        return {key: np.stack([own[key] for own in observations]) for key in observations[0]}
    return np.stack(observations)


class Worlds:
    """Worlds of a task in which episodes are driven, ``together`` of them at a time.

    ``task``: an id of `TASKS`, or a task. ``options``: of the task. Raises ValueError.
    """

    def __init__(self, task: str | Task, together: int = 16, **options: Any) -> None:
        if together < 1:
            raise ValueError(f"together: expected at least 1, found {together}")
        self.task = task_of(task, **options)
        first = self.task.load()
        self._sims = [first, *(first.fresh() for _ in range(together - 1))]
        #: Of the call that drives in them.
        self._turn = object()

    def episodes(self, policy: Policy, seeds: Iterable[int], *, most_steps: int | None = None) -> Iterator[Rollout]:
        """Episodes that begin with seeds, in the order in which they end. As soon as one has ended, the next begins.

        The episode of a seed is that of an environment which was reset with it. ``most_steps``: after so many an
        episode is truncated. Raises ValueError for actions that are none; RuntimeError where the next call has taken
        the worlds before all episodes of this one were there.
        """
        if most_steps is not None and most_steps < 1:
            raise ValueError(f"most_steps: expected at least 1, found {most_steps}")
        turn = self._turn = object()
        waiting, idle = deque(seeds), list(reversed(self._sims))
        running: list[_Run] = []
        while waiting or running:
            if turn is not self._turn:
                raise RuntimeError("another call of episodes() drives in these worlds")
            begun = [self._begin(idle.pop(), waiting.popleft()) for _ in range(min(len(waiting), len(idle)))]
            for run, capture in zip(begun, relief.capture_due([run.episode.sim for run in begun]) if begun else []):
                run.observations.append(self.task.observe(run.episode, capture))
            running += begun
            actions = policy(_stacked([run.observations[-1] for run in running]), [run.random for run in running])
            actions = check_actions(actions, (len(running), 2))
            sims = [run.episode.sim for run in running]
            for run, action in zip(running, actions):
                self.task.act(run.episode, action)
                run.actions.append(action)
            relief.step(sims, [run.episode.frame_steps for run in running])
            going = []
            for run, capture in zip(running, relief.capture_due(sims)):
                outcome = self.task.outcome(run.episode, capture)
                run.observations.append(self.task.observe(run.episode, capture))
                run.rewards.append(outcome.reward)
                run.infos.append(outcome.info)
                late = not outcome.terminated and len(run.actions) == most_steps
                if outcome.terminated or outcome.truncated or late:
                    idle.append(run.episode.sim)
                    yield run.ended(outcome.terminated, outcome.truncated or late)
                else:
                    going.append(run)
            running = going

    def _begin(self, sim: relief.Sim, seed: int) -> _Run:
        random, _ = seeding.np_random(seed)
        # Those of the policy are others: what it draws must not change the episode.
        return _Run(seed, self.task.begin(sim, random), np.random.default_rng([seed, 1]), [])

    def close(self) -> None:
        """Gives back what the worlds take on the graphics device."""
        for sim in self._sims:
            sim.close()
