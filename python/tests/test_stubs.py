"""Keywords of sensors: the stubs have those that the calls take, no more and no fewer."""

import ast
import re
import subprocess
import sys

import pytest

import relief
from conftest import ROOT, needed
from described_stubs import STUBS as PATH, written
from relief.described import DESCRIPTIONS, kinds

STUBS = ast.parse((ROOT / "python/relief/_relief.pyi").read_text(encoding="utf-8"))
CLASSES = {own.name: own for own in STUBS.body if isinstance(own, ast.ClassDef)}
KINDS = list(kinds(DESCRIPTIONS["sensor"]))


def keys(name):
    """The keys of a dictionary of the stubs, with those of what it extends."""
    own = [entry.target.id for entry in CLASSES[name].body if isinstance(entry, ast.AnnAssign)]
    bases = [base.id for base in CLASSES[name].bases if base.id != "TypedDict"]
    return own + [key for base in bases for key in keys(base)]


def known(call, *arguments, **given):
    """The keywords that a call names when it refuses one."""
    with pytest.raises(TypeError, match="unexpected argument") as refused:
        call(*arguments, **given)
    return re.search("expected one of: (.*)$", str(refused.value))[1].split(", ")


@pytest.mark.parametrize("kind", KINDS)
def test_keywords_are_those_that_the_calls_take(field, kind):
    car = field.spawn_vehicle("car", at=(0, 0, 0))
    for owner, class_ in ((car, "Entity"), (field, "Sim")):
        (method,) = [own for own in CLASSES[class_].body if getattr(own, "name", "") == f"add_{kind}"]
        dictionary = method.args.kwarg.annotation.slice.id
        taken = known(getattr(owner, f"add_{kind}"), "a", nonsense=5)
        assert sorted(keys(dictionary)) == sorted(taken)
        # Help names them all, too.
        said = getattr(type(owner), f"add_{kind}").__doc__
        assert not [name for name in keys(dictionary) if f"`{name}`" not in said]


def test_stubs_are_those_of_what_is_described():
    text = PATH.read_text(encoding="utf-8")
    assert written(text) == text, "run python/tests/described_stubs.py"


def test_fields_of_lights_are_properties_that_are_read_and_set(field):
    for kind in ("point", "spot", "directional"):
        light = field.spawn_light(getattr(relief.Light, kind)(2.0), at=(0, 5, 0))
        for name, own in DESCRIPTIONS["light"]["properties"].items():
            value = getattr(light, name)
            if kind in own.get("kinds", [kind]) and value is not None:
                setattr(light, name, value)
                assert getattr(light, name) == value, (kind, name)
    light.color = "#ff0000"
    assert light.color == (1.0, 0.0, 0.0)
    light.color = {"kelvin": 2700}
    assert light.color[0] == 1.0 > light.color[2] and light.temperature_kelvin == 2700
    light.temperature_kelvin = 10_000
    assert light.color[2] == 1.0 > light.color[0] and light.temperature_kelvin == 10_000
    light.intensity = 3
    assert light.temperature_kelvin == 10_000
    light.color = (1, 0.5, 0.5)
    assert light.temperature_kelvin is None
    lamp = field.spawn_light(relief.Light.point(1, temperature_kelvin=2700), at=(0, 5, 0))
    assert lamp.temperature_kelvin == 2700
    with pytest.raises(ValueError, match="temperature_kelvin: expected either color or temperature_kelvin"):
        relief.Light.point(1, color="#ff0000", temperature_kelvin=2700)
    lamp = field.spawn_light(relief.Light.point(1, 5, attenuation="inverse_square", ambient=(0.1, 0, 0)), at=(0, 5, 0))
    assert lamp.attenuation == (0, 0, 1) and lamp.range == 5 and lamp.ambient[0] == pytest.approx(0.1)
    lamp.range = float("inf")
    assert lamp.range == float("inf") and lamp.shadow_near == pytest.approx(0.05)
    with pytest.raises(ValueError, match="shadow_near: expected a number from 0.001 to 10000000, found 0"):
        lamp.shadow_near = 0


def test_fields_of_noise_are_those_that_are_taken(field):
    assert sorted(keys("_CameraNoise")) == sorted(known(field.add_camera, "a", noise={"nonsense": 5}))
    assert sorted(keys("_CameraNoise")) == sorted(field.add_camera("b", size=(8, 8), noise={}).noise)


def test_mypy_knows_them(tmp_path):
    needed("mypy")
    program = tmp_path / "own.py"
    program.write_text(
        "import relief\n"
        "sim = relief.Sim(step_seconds=0.01)\n"
        "sim.add_camera('a', size=(8, 8), noise={'gain': 2.0}, exposure='metered', at=(0, 1, 2))\n"
        "sim.add_lidar('b', beams={'grid': {'rows': 4, 'horizontal_degrees': 90, 'vertical_degrees': 20}})\n"
        "sim.add_camera('x', nonsense=5)\n"
        "sim.add_lidar('y', hz='ten')\n"
    )
    command = [sys.executable, "-m", "mypy", "--no-incremental", "--cache-dir", str(tmp_path / "cache")]
    mypy = subprocess.run([*command, str(program)], capture_output=True, text=True, cwd=tmp_path)
    found = re.findall(r"own\.py:(\d+): error", mypy.stdout)
    assert found == ["5", "6"] and "nonsense" in mypy.stdout, mypy.stdout + mypy.stderr
