"""Tasks on a Ray cluster: handed out as machines get free, begun anew where machines are lost, and where they fail.

A task is a pure function that writes whole files or none, so doing it twice is harmless. Ray itself begins those anew
whose worker died; what a task raises is tried again here, but `BadInput`, which no machine can do.
"""

from __future__ import annotations

import sys
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from typing import Any, TypeVar

import ray

#: How often Ray begins a task anew whose worker died.
LOST_WORKERS = 5

Part = TypeVar("Part")


class BadInput(Exception):
    """What no machine can do, with what is wrong in one line."""


class TaskError(RuntimeError):
    """A part that could not be done, with the message of its last attempt."""


def connect(address: str | None, workers: int | None, *, cpus: float, gpus: float) -> None:
    """Connects to the cluster of an address, or to a new one of this machine's processors.

    Args:
        address: as ``ray.init`` takes it; ``None``: a new cluster, also where another runs.
        workers: processors of the new cluster; ``None``: all.
        cpus, gpus: what a task takes of a machine. A cluster that others look after may get such a machine later; a new
            one does not.

    Raises:
        BadInput: no cluster is there, or the new one is too small for a task.
    """
    try:
        if address:
            ray.init(address, log_to_driver=False)
        else:
            # A new one, whatever runs on this machine or stands in RAY_ADDRESS.
            ray.init("local", num_cpus=workers, log_to_driver=False)
    except (ConnectionError, ValueError) as error:
        raise BadInput(f"address {address or 'local'!r}: {str(error).splitlines()[0]}") from None
    machines = [node["Resources"] for node in ray.nodes() if node["Alive"]]
    if not any(own.get("CPU", 0) >= cpus and own.get("GPU", 0) >= gpus for own in machines):
        said = f"no machine has {cpus:g} CPUs and {gpus:g} GPUs, which a task takes"
        if not address:
            raise BadInput(said)
        print(f"waiting: {said}", file=sys.stderr, flush=True)


def results(
    parts: Iterable[Part],
    start: Callable[[Part], Any],
    *,
    attempts: int = 3,
    name: Callable[[Part], str] = str,
    report: Callable[[int, int], None] = lambda done, of: None,
) -> Iterator[Any]:
    """What the tasks of parts return, in the order in which they end.

    Args:
        parts: what there is to do.
        start: hands the task of a part to Ray; returns its reference.
        attempts: how often a part is tried whose task raises; one whose worker died is begun anew besides.
        name: of a part, for messages.
        report: called after each part with how many are done, and of how many.

    Raises:
        BadInput: at once, with the part's name.
        TaskError: after all attempts.
    """
    waiting = deque((part, 1) for part in parts)
    running: dict[Any, tuple[Part, int]] = {}
    done, of = 0, len(waiting)
    # So many at once that a cluster which grows has some to take; not all of 10,000, which are asked about often.
    most = max(64, 4 * int(ray.cluster_resources().get("CPU", 1)))
    try:
        while waiting or running:
            while waiting and len(running) < most:
                part, attempt = waiting.popleft()
                running[start(part)] = (part, attempt)
            for ready in ray.wait(list(running), num_returns=1)[0]:
                part, attempt = running.pop(ready)
                try:
                    result = ray.get(ready)
                except BadInput as error:
                    raise BadInput(f"{name(part)}: {_said(error)}") from None
                except ray.exceptions.RayError as error:
                    if attempt >= attempts:
                        raise TaskError(f"{name(part)}: {_said(error)}") from None
                    print(
                        f"{name(part)}, attempt {attempt} of {attempts}: {_said(error)}", file=sys.stderr, flush=True
                    )
                    waiting.append((part, attempt + 1))
                    continue
                done += 1
                report(done, of)
                yield result
    finally:
        for other in running:
            ray.cancel(other, force=True)


def _said(error: Exception) -> str:
    """The message of what a task raised, without Ray's account of where."""
    cause = getattr(error, "cause", None)
    return str(error) if cause is None else str(cause) or type(cause).__name__
