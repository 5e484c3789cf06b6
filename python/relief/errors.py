"""Exceptions of Relief. Messages are those of the command line, word for word."""

from __future__ import annotations

from typing import List, Optional


class Error(Exception):
    """Everything that Relief raises of its own."""


class SceneError(Error, ValueError):
    """A scene, or a file that it names, is refused."""

    #: The file of the first problem.
    path: Optional[str] = None
    #: Its line and column, both from 1; ``None`` where the whole file is meant.
    line: Optional[int] = None
    column: Optional[int] = None
    #: The field, as ``entities[3].light.range``; empty where there is none.
    field: str = ""
    #: All problems in the order of the file, a line each.
    problems: List[str] = []


class GpuError(Error, RuntimeError):
    """There is no graphics adapter, it was lost, or something is too large for it."""


class RecordingError(Error, ValueError):
    """A recording or snapshot that is refused, or a replay that comes out otherwise."""


class OutputError(Error, OSError):
    """A file that cannot be written."""


class GoneError(Error, LookupError):
    """An entity that is gone from its world."""


class ForkedError(Error, RuntimeError):
    """This process was forked from one that had begun to simulate: its threads and device are not here."""


__all__ = [
    "Error",
    "ForkedError",
    "GoneError",
    "GpuError",
    "OutputError",
    "RecordingError",
    "SceneError",
]
