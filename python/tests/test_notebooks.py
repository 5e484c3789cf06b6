"""The notebooks of examples/python: they run as they stand, and carry no outputs.

Their cells are executed one after the other in one namespace, in a process of its own: that needs no Jupyter.
"""

import json
import re
import subprocess
import sys

import numpy as np
import pytest

from conftest import ROOT, needed

FOLDER = ROOT / "examples" / "python"
NOTEBOOKS = ["first_picture", "dataset", "lidar", "drive", "learn"]

RUN = """
import json, linecache, sys

name = sys.argv[1]
names = {"__name__": "__main__"}
for number, cell in enumerate(json.load(open(name, encoding="utf-8"))["cells"]):
    if cell["cell_type"] == "code":
        place, source = f"{name}, cell {number}", "".join(cell["source"])
        linecache.cache[place] = (len(source), None, source.splitlines(True), place)
        exec(compile(source, place, "exec"), names)
"""


def test_there_are_no_others():
    assert sorted(path.stem for path in FOLDER.glob("*.ipynb")) == sorted(NOTEBOOKS)


@pytest.mark.parametrize("name", NOTEBOOKS)
def test_the_notebook_runs(name):
    needed("PIL")
    if name == "learn":
        needed("gymnasium")
    run = subprocess.run(
        [sys.executable, "-c", RUN, f"{name}.ipynb"],
        cwd=FOLDER, capture_output=True, text=True, encoding="utf-8",
    )
    assert run.returncode == 0, run.stderr


@pytest.mark.parametrize("name", NOTEBOOKS)
def test_the_notebook_is_valid_and_has_no_outputs(name):
    notebook = json.loads((FOLDER / f"{name}.ipynb").read_text(encoding="utf-8"))
    assert set(notebook) == {"cells", "metadata", "nbformat", "nbformat_minor"}
    assert (notebook["nbformat"], notebook["nbformat_minor"]) == (4, 5)
    assert set(notebook["metadata"]) == {"kernelspec", "language_info"}
    # What editors add to them would change with each run.
    assert notebook["metadata"]["language_info"] == {"name": "python"}
    cells = notebook["cells"]
    ids = [cell["id"] for cell in cells]
    assert len(set(ids)) == len(ids) and all(re.fullmatch(r"[a-zA-Z0-9_-]{1,64}", id) for id in ids)
    assert cells[0]["cell_type"] == "markdown" and cells[0]["source"][0].startswith("# ")
    for cell in cells:
        if cell["cell_type"] == "code":
            assert set(cell) == {"cell_type", "execution_count", "id", "metadata", "outputs", "source"}
            assert cell["execution_count"] is None and cell["outputs"] == []
        else:
            assert cell["cell_type"] == "markdown" and set(cell) == {"cell_type", "id", "metadata", "source"}
        assert cell["metadata"] == {} and cell["source"]
        # Each line but the last ends in a line break, as editors write them.
        assert all(line.endswith("\n") for line in cell["source"][:-1]) and not cell["source"][-1].endswith("\n")
        assert all(len(line) <= 121 for line in cell["source"]), "lines of at most 120 characters"


def test_depths_beyond_the_farthest_are_dark():
    needed("PIL")
    from relief import pictures

    dark, near = (30, 10, 50), (253, 231, 37)
    for depth in (np.inf, 60.0, 100.0):
        assert pictures.of_depth(np.full((1, 2), depth), far=60).getpixel((0, 0)) == dark
    picture = pictures.of_depth(np.array([[2.0, np.inf]]), far=60)
    assert [picture.getpixel((u, 0)) for u in (0, 1)] == [near, dark]


def test_notebooks_lead_on():
    for name, after in zip(NOTEBOOKS, NOTEBOOKS[1:]):
        assert f"({after}.ipynb)" in (FOLDER / f"{name}.ipynb").read_text(encoding="utf-8")
