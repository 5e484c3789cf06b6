"""Shards of a run, rendered on a Ray cluster.

``relief split`` makes the job; every machine of the cluster sees its folder. Each shard is a task that runs the program
``relief``. A shard is there when it is whole. At the end ``relief merge`` checks everything and puts it together; what
it finds missing or damaged is rendered again.
"""

from __future__ import annotations

import ctypes
import json
import signal
import subprocess
import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import ray

from ..__main__ import COMMAND
from .cluster import LOST_WORKERS, BadInput, results

#: Exit code of ``relief`` for what no machine can do.
BAD_INPUT = 2
#: Exit code of ``relief merge`` where shards are missing or damaged.
INCOMPLETE = 4


def _ending_with_parent() -> Callable[[], object] | None:
    """What a child does first, so that it ends when its parent does: else it would go on where a worker is killed."""
    if sys.platform != "linux":
        return None
    # Found before the fork: after it, as little as can be.
    prctl = ctypes.CDLL(None).prctl
    of_death = 1  # PR_SET_PDEATHSIG of prctl(2)
    return lambda: prctl(of_death, signal.SIGKILL)


def _program(relief: str | None) -> tuple[str, ...]:
    """The command that starts the program on this machine."""
    return COMMAND if relief is None else (relief,)


@ray.remote(max_retries=LOST_WORKERS)
def _render(relief: str | None, job: str, shard: int) -> None:
    """Renders a shard. Raises BadInput; RuntimeError with what was said."""
    command = [*_program(relief), "render", "--shard", f"{job}/shards.json:{shard}", "--resume"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, preexec_fn=_ending_with_parent())
    except OSError as error:
        raise RuntimeError(f"{command[0]}: {error.strerror}") from None
    if done.returncode:
        said = done.stderr.strip() or f"relief ended with exit code {done.returncode}"
        raise (BadInput if done.returncode == BAD_INPUT else RuntimeError)(said)


def render(
    job: str,
    shards: Iterable[int],
    relief: str | None = None,
    *,
    cpus: float = 1,
    gpus: float = 0,
    attempts: int = 3,
    report: Callable[[int, int], None] = lambda done, of: None,
) -> None:
    """Renders shards of a job on the cluster that Ray is connected to. Those that are there and whole stay.

    Args:
        job: folder of ``relief split``, the same path on all machines.
        shards: numbers of shards.
        relief: the program, on all machines; ``None``: that of the package.
        cpus, gpus: what a shard takes of a machine; numbers below 1 share a GPU.
        attempts: how often a shard is tried that fails by itself; one whose machine is lost is begun anew besides.
        report: called after each shard with how many are done, and of how many.

    Raises:
        BadInput: at once.
        TaskError: after all attempts.
    """
    task = _render.options(num_cpus=cpus, num_gpus=gpus)
    start = lambda shard: task.remote(relief, job, shard)
    for _ in results(shards, start, attempts=attempts, name=lambda shard: f"shard {shard}", report=report):
        pass


def merge(
    job: str, output: str | None = None, relief: str | None = None, more: Sequence[str] = ()
) -> tuple[int, str]:
    """Puts the shards of a job together. Returns the exit code, and what was said on standard error.

    Args:
        output: folder, new or empty; by default ``JOB/merged``.
        more: options of ``relief merge``.
    """
    command = [*_program(relief), "merge", job, *(["-o", output] if output else []), *more]
    done = subprocess.run(command, stderr=subprocess.PIPE, text=True)
    return done.returncode, done.stderr.strip()


def count_of_shards(job: str) -> int:
    """How many shards a job has. Raises BadInput."""
    path = Path(job, "shards.json")
    try:
        return len(json.loads(path.read_text(encoding="utf-8"))["shards"])
    except OSError as error:
        raise BadInput(f"{path}: {error.strerror}") from None
    except (ValueError, KeyError, TypeError):
        raise BadInput(f"{path}: expected what relief split writes") from None
