"""The program that the package brings: ``python -m relief`` does what ``relief`` does."""

import os
import re
import signal
import subprocess
import sys
import time

import pytest

from conftest import ROOT

OWN = [sys.executable, "-m", "relief"]
SHAPES = str(ROOT / "assets" / "scenes" / "shapes.ron")


def ended(*command, **options):
    """Exit code, output and errors, without those of a validation layer, which name addresses."""
    options["env"] = {**options.get("env", os.environ), "WGPU_VALIDATION": "0"}
    done = subprocess.run(command, capture_output=True, text=True, **options)
    return done.returncode, done.stdout, done.stderr


def files(folder):
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_it_renders_what_the_program_renders(program, tmp_path):
    options = ["--frames", "2", "--size", "64x36", "--outputs", "color,depth"]
    render = ["render", SHAPES, "-o", "made", *options]
    said = [ended(*own, *render, cwd=folder) for own, folder in both(program, tmp_path)]
    assert said[0] == said[1] and said[0][0] == 0, said
    own, other = [files(folder) for _, folder in both(program, tmp_path)]
    assert len(own) == 4 and own == other


def both(program, folder):
    """The package's and the program, each with a folder of its own."""
    for name, command in (("own", OWN), ("other", [program])):
        (folder / name).mkdir(exist_ok=True)
        yield command, folder / name


@pytest.mark.parametrize(
    "arguments, code",
    [
        (["--version"], 0),
        (["render", "--help"], 0),
        (["render", "none.ron"], 2),
        (["render", SHAPES, "--frames", "-1"], 2),
        (["merge", "none"], 2),
        (["--sise", "3"], 2),
        (["check", SHAPES], 0),
    ],
)
def test_codes_and_words_are_those_of_the_program(program, arguments, code):
    own, other = ended(*OWN, *arguments), ended(program, *arguments)
    assert own == other and own[0] == code


def test_what_cannot_be_drawn_with_has_its_code(tmp_path):
    nothing = {**os.environ, "VK_DRIVER_FILES": "/nonexistent", "VK_ICD_FILENAMES": "/nonexistent"}
    code, said, errors = ended(*OWN, "render", SHAPES, "-o", str(tmp_path / "made"), env=nothing)
    # Vulkan has its own to say before.
    assert (code, said) == (3, "") and re.search("^error: ", errors, re.MULTILINE)


def test_scenes_of_the_package_are_sound(tmp_path):
    code, _, errors = ended(*OWN, "check", str(ROOT / "python/relief/assets/scenes/sensors.ron"), cwd=tmp_path)
    assert code == 0, errors


@pytest.mark.skipif(sys.platform == "win32", reason="skipped: signals of Unix")
def test_the_keyboard_ends_it(tmp_path):
    options = ["-o", str(tmp_path / "made"), "--frames", "100000", "--size", "64x36"]
    running = subprocess.Popen([*OWN, "render", SHAPES, *options], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    try:
        end = time.monotonic() + 120
        while not list(tmp_path.glob("made/*.png")) and running.poll() is None and time.monotonic() < end:
            time.sleep(0.05)
        running.send_signal(signal.SIGINT)
        _, errors = running.communicate(timeout=60)
    finally:
        running.kill()
    # As the shell has it of any program: by the signal, and without a word of Python.
    assert running.returncode == -signal.SIGINT and b"Traceback" not in errors


def test_the_program_loads_nothing_from_where_it_is_started(tmp_path):
    from relief.__main__ import COMMAND

    (tmp_path / "relief.py").write_text("raise SystemExit('not the package')")
    done = subprocess.run([*COMMAND, "--version"], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0 and done.stdout.startswith("relief "), done.stderr
