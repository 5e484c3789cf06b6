"""Episodes that a policy drives, on a Ray cluster: data to learn from, or to judge a policy by.

Episode n begins with seed ``seed + n``. Each task drives some episodes and writes each as a file of its own below
``episodes``; ``rollouts.json`` says what they are of, and ``episodes.csv``, once all are there, how each went. A folder
may be gone on with: episodes that are there and whole stay.
"""

from __future__ import annotations

import contextlib
import csv
import dataclasses
import functools
import importlib
import importlib.metadata
import json
import sys
import time
import traceback
from collections.abc import Callable
from pathlib import Path

import ray

import relief

from ..envs.rollouts import Policy, Rollout, Worlds, read, whole_file
from ..envs.tasks import TASKS
from .cluster import LOST_WORKERS, BadInput, results


#: Seconds after which nothing writes to a file any more.
ABANDONED = 24 * 3600.0


@dataclasses.dataclass(frozen=True)
class Settings:
    """What episodes follow from, beside their seeds."""

    environment: str
    policy: str
    seed: int = 0
    size: tuple[int, int] = (84, 84)
    most_steps: int | None = None
    #: How many are driven at a time, and by a task. Sums of some policies depend on how many pictures they are given.
    together: int = 16
    by_task: int = 32


@dataclasses.dataclass(frozen=True)
class Summary:
    """How an episode went."""

    episode: int
    seed: int
    steps: int
    reward: float  # the sum
    terminated: bool
    truncated: bool

    @staticmethod
    def of(number: int, rollout: Rollout) -> Summary:
        """Of an episode with its number."""
        return Summary(
            episode=number,
            seed=rollout.seed,
            steps=len(rollout.rewards),
            reward=float(rollout.rewards.sum()),
            terminated=bool(rollout.terminations[-1]),
            truncated=bool(rollout.truncations[-1]),
        )


def policy_of(name: str) -> Policy:
    """The function that ``module:function`` names. Workers are sent it, and need no such module. Raises BadInput."""
    module_name, _, function_name = name.partition(":")
    if not module_name or not function_name:
        raise BadInput(f"policy {name!r}: expected MODULE:FUNCTION")
    try:
        module = importlib.import_module(module_name)
    except Exception as error:
        raise BadInput(f"policy {name!r}: {_told(error)}") from None
    policy: Policy | None = getattr(module, function_name, None)
    if policy is None or not callable(policy):
        raise BadInput(f"policy {name!r}: {module_name} has no function {function_name!r}")
    if module_name.partition(".")[0] != "relief":
        ray.cloudpickle.register_pickle_by_value(module)
    try:
        ray.cloudpickle.dumps(policy)
    except Exception as error:
        raise BadInput(f"policy {name!r}: cannot be sent to workers: {error}") from None
    return policy


def _told(error: BaseException) -> str:
    """An error in one line, with the place at which it was raised."""
    place = traceback.extract_tb(error.__traceback__)[-1]
    return f"{place.filename}:{place.lineno}: {type(error).__name__}: {error}"


def file_of(folder: Path, number: int) -> Path:
    """The file of an episode."""
    return folder / "episodes" / f"{number:06}.npz"


@functools.lru_cache(maxsize=1)
def _worlds(environment: str, size: tuple[int, int], together: int) -> Worlds:
    """A worker keeps its worlds from task to task."""
    return Worlds(environment, together, size=size)


@ray.remote(max_retries=LOST_WORKERS)
def _drive(settings: Settings, policy: Policy, folder: str, numbers: range, cpus: int) -> tuple[str, list[Summary]]:
    """Drives those of the episodes that are not there. Returns the adapter, and how all went. Raises BadInput."""
    relief.set_threads(cpus)
    done: dict[int, Summary] = {}
    for number in numbers:
        try:
            found = read(file_of(Path(folder), number))
        except (OSError, ValueError):
            continue
        if found.seed == settings.seed + number:
            done[number] = Summary.of(number, found)
    seeds = [settings.seed + number for number in numbers if number not in done]
    worlds = _worlds(settings.environment, settings.size, settings.together)
    try:
        for rollout in worlds.episodes(policy, seeds, most_steps=settings.most_steps):
            number = rollout.seed - settings.seed
            rollout.save(file_of(Path(folder), number))
            done[number] = Summary.of(number, rollout)
    except (OSError, relief.GpuError):
        # Another machine may do better.
        raise
    except Exception as error:
        raise BadInput(f"policy {settings.policy!r}: {_told(error)}") from None
    return relief.adapter(), [done[number] for number in numbers]


def rollouts(
    settings: Settings,
    policy: Policy,
    episodes: int,
    folder: Path,
    *,
    cpus: int = 1,
    gpus: float = 0,
    attempts: int = 3,
    report: Callable[[int, int], None] = lambda done, of: None,
) -> list[Summary]:
    """Drives episodes on the cluster that Ray is connected to, into a folder that all machines see.

    Args:
        settings: what the episodes follow from.
        policy: that of the settings.
        episodes: how many.
        folder: that was claimed for the settings.
        cpus, gpus: what a task takes of a machine; numbers below 1 share a GPU.
        attempts: how often a task is tried that fails by itself; one whose machine is lost is begun anew besides.
        report: called after each task with how many are done, and of how many.

    Raises:
        BadInput: at once, where the policy fails.
        TaskError: after all attempts.
        OSError: the folder cannot be written.
    """
    sent = ray.put(policy)
    task = _drive.options(num_cpus=cpus, num_gpus=gpus)
    parts = [
        range(first, min(first + settings.by_task, episodes)) for first in range(0, episodes, settings.by_task)
    ]
    start = lambda part: task.remote(settings, sent, str(folder), part, cpus)
    name = lambda part: f"episodes {part.start} to {part.stop - 1}"
    adapters, summaries = set(), []
    for adapter, some in results(parts, start, attempts=attempts, name=name, report=report):
        adapters.add(adapter)
        summaries += some
    if len(adapters) > 1:
        print(f"warning: pictures of different adapters: {', '.join(sorted(adapters))}", file=sys.stderr)
    summaries.sort(key=lambda summary: summary.episode)
    names = [field.name for field in dataclasses.fields(Summary)]
    with whole_file(folder / "episodes.csv") as part, open(part, "w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, names, lineterminator="\n")
        writer.writeheader()
        writer.writerows({**dataclasses.asdict(summary), "reward": round(summary.reward, 6)} for summary in summaries)
    return summaries


def claim(folder: Path, settings: Settings) -> None:
    """Makes a folder that of some settings. Raises BadInput where it is another's, or there is no such environment;
    OSError."""
    if settings.environment not in TASKS:
        raise BadInput(f"unknown environment {settings.environment!r}; expected one of: {', '.join(TASKS)}")
    try:
        TASKS[settings.environment](size=settings.size)
    except ValueError as error:
        raise BadInput(str(error)) from None
    try:
        version = importlib.metadata.version("relief")
    except importlib.metadata.PackageNotFoundError:
        version = "unknown"
    told = json.dumps({"relief": version, **dataclasses.asdict(settings)}, indent=4) + "\n"
    path, episodes = folder / "rollouts.json", folder / "episodes"
    folder.mkdir(parents=True, exist_ok=True)
    if any(folder.iterdir()) and not path.exists():
        raise BadInput(f"{folder}: expected a new or empty folder, or one of rollouts")
    try:
        # Of several that begin at once, one writes it.
        with open(path, "x", encoding="utf-8") as file:
            file.write(told)
    except FileExistsError:
        try:
            known = dict(json.loads(path.read_text(encoding="utf-8")))
        except (ValueError, TypeError):
            raise BadInput(f"{path}: expected what rollouts writes") from None
        wanted = json.loads(told)
        differ = [f"{name} {known.get(name)!r}, not {own!r}" for name, own in wanted.items() if known.get(name) != own]
        if differ:
            raise BadInput(f"{folder}: has episodes of {', '.join(differ)}; expected the same, or another folder")
    episodes.mkdir(exist_ok=True)
    for part in episodes.glob("*.part"):
        # What was killed could not tidy up; what is younger may be written still.
        with contextlib.suppress(FileNotFoundError):
            if time.time() - part.stat().st_mtime > ABANDONED:
                part.unlink()
