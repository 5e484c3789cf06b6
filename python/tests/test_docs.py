"""The programs of the pages about Python, one after the other as they stand there, the package's own example, and
whether every public name says what it is."""

import ast
import doctest
import inspect
import pydoc
import re

import pytest

import relief
from conftest import ROOT, needed

#: Pages for users of other programs. What is fenced as "py" there is theirs, and not run.
GUIDES = ["from_carla", "from_mujoco", "from_isaac_lab"]


def run_page(name):
    """Runs the programs of a page in one namespace. How many there were, and the namespace."""
    page = (ROOT / "docs" / f"{name}.md").read_text(encoding="utf-8")
    programs = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    names = {}
    for number, program in enumerate(programs):
        exec(compile(program, f"{name}.md, program {number}", "exec"), names)
    return len(programs), names


def test_the_page_runs_as_it_stands():
    count, names = run_page("python")
    assert count == 2
    assert names["got"]["front"].depth.shape == (96, 128)
    assert names["pictures"].color.shape == (8, 96, 128, 3)


def test_the_policy_of_many_machines_drives():
    needed("gymnasium")
    from relief.envs.rollouts import Worlds

    count, names = run_page("many_machines")
    assert count == 1
    worlds = Worlds("relief/LaneFollow-v0", 2, size=(8, 8))
    assert len(list(worlds.episodes(names["drive"], range(3), most_steps=3))) == 3
    worlds.close()


def test_the_program_of_environments_runs():
    """With fewer of them."""
    gymnasium = needed("gymnasium")
    import relief.envs

    page = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
    (program,) = [text for text in re.findall(r"```text\n(.*?)```", page, re.DOTALL) if "make_vec" in text]
    assert '"relief/Traffic-v0", 64,' in program
    names = {"gymnasium": gymnasium, "relief": relief}
    exec(program.replace("64,", "2,"), names)
    assert names["observation"]["camera"].shape == (2, 84, 84, 3)
    for name in ("env", "envs"):
        names[name].close()


@pytest.mark.parametrize("name", GUIDES)
def test_guides_run_as_they_stand(name):
    count, names = run_page(name)
    assert count >= 4 and isinstance(names["sim"], relief.Sim)


@pytest.mark.parametrize("name", GUIDES)
def test_what_others_run_is_python_at_least(name):
    page = (ROOT / "docs" / f"{name}.md").read_text(encoding="utf-8")
    programs = re.findall(r"```py\n(.*?)```", page, re.DOTALL)
    assert programs
    for program in programs:
        ast.parse(program)


def test_guides_name_what_there_is():
    """Methods and properties after a dot, of worlds and what is in them, are those of the package."""
    owners = {
        "sim": relief.Sim, "vehicle": relief.Vehicle, "entity": relief.Entity, "relief": relief, "route": relief.Route,
        "camera": relief.Sensor,
    }
    for name in GUIDES:
        page = (ROOT / "docs" / f"{name}.md").read_text(encoding="utf-8")
        ours = "\n".join(
            [line.split("|")[2] for line in page.splitlines() if line.startswith("|")]
            + re.findall(r"```python\n(.*?)```", page, re.DOTALL)
        )
        found = re.findall(r"(?<![\w./])(sim|vehicle|entity|relief|route|camera)\.([a-z_A-Z]+)", ours)
        assert len(found) > 10
        for owner, attribute in found:
            assert hasattr(owners[owner], attribute) or attribute == "envs", f"{name}.md: {owner}.{attribute}"


def test_the_packages_example():
    failed, tried = doctest.testmod(relief)
    assert failed == 0 and tried > 5


def public_names():
    """All that users meet: names of the package, and what its classes have."""
    for name in relief.__all__:
        thing = getattr(relief, name)
        yield name, thing
        if inspect.isclass(thing) and not issubclass(thing, Exception):
            for attribute, member in vars(thing).items():
                if not attribute.startswith("_"):
                    yield f"{name}.{attribute}", member


def test_every_public_name_says_what_it_is():
    names = dict(public_names())
    assert len(names) > 150 and "Sim.add_camera" in names and "Route.points" in names
    silent = [name for name, thing in names.items() if not (getattr(thing, "__doc__", None) or "").strip()]
    assert not silent


def test_every_name_of_the_package_is_on_the_page():
    page = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
    missing = [name for name in relief.__all__ if not re.search(rf"`[^`\n]*\b{name}\b[^`\n]*`", page)]
    assert not missing


def test_help_has_every_name():
    """What `help()` shows of each class has all of its methods and properties."""
    for name in relief.__all__:
        thing = getattr(relief, name)
        if inspect.isclass(thing):
            shown = pydoc.render_doc(thing, renderer=pydoc.plaintext)
            names = [attribute for attribute in vars(thing) if not attribute.startswith("_")]
            missing = [attribute for attribute in names if attribute not in shown]
            assert not missing, name
