"""Shards with a real Slurm on this machine: see ``scripts/slurm/test``."""

import os
import subprocess

import pytest

from conftest import ROOT


def test_killed_and_lost_shards_change_nothing(program):
    # What cannot be had everywhere (Slurm's packages, mount namespaces) is no failure.
    environment = {name: value for name, value in os.environ.items() if name != "RELIEF_STRICT"}
    done = subprocess.run(
        [ROOT / "scripts/slurm/test", program], capture_output=True, text=True, env=environment, timeout=900
    )
    last = (done.stdout.strip().splitlines() or [""])[-1]
    if last.startswith("skipped"):
        pytest.skip(last)
    assert done.returncode == 0, done.stdout + done.stderr
    assert last == "4 shards, two killed, one lost, one damaged: equal", done.stdout
