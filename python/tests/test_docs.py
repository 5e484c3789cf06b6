"""The programs of docs/python.md, one after the other as they stand there, and the package's own example."""

import doctest
import re

import relief
from conftest import ROOT


def test_the_page_runs_as_it_stands():
    page = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
    programs = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    assert len(programs) == 2
    names = {}
    for program in programs:
        exec(program, names)
    assert names["got"]["front"].depth.shape == (96, 128)
    assert names["pictures"].color.shape == (8, 96, 128, 3)


def test_the_packages_example():
    failed, tried = doctest.testmod(relief)
    assert failed == 0 and tried > 5
