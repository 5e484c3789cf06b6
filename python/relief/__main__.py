"""The program ``relief``, as a script of the package and as ``python -m relief``."""

from __future__ import annotations

import signal
import sys
from pathlib import Path

from ._relief import run_program

#: Starts the program on this machine, whatever is on the path, and whatever modules lie where it is started.
COMMAND = (
    sys.executable,
    "-c",
    "import sys; sys.path[:] = filter(None, sys.path); from relief.__main__ import main; sys.exit(main())",
)


def main() -> int:
    """Does what the command line says. Returns the exit code."""
    # As any other program it ends at once: the interpreter would wait until the command has ended.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return run_program(list(COMMAND), sys.argv[1:], Path(__file__).resolve().parent)


if __name__ == "__main__":
    sys.exit(main())
