"""What tests share: worlds, and scenes as files."""

import importlib
import os
import pathlib

import pytest

import relief

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCENES = ROOT / "assets" / "scenes"

ROAD = """(
    vehicle_types: ["{types}"],
    routes: {{ "main": (points: [(0, 0, 0), (0, 0, 400)], lanes: 2, then: ["main"]) }},
    signals: {{ "crossing": (green_seconds: [10, 5], amber_seconds: 3, red_seconds: 2) }},
    materials: {{ "grey": (base_factor: (0.4, 0.4, 0.4)) }},
    meshes: {{ "land": plane(size: (900, 900)), "crate": cube(size: (1, 1, 1)) }},
    entities: [
        (light: directional(intensity: 1), transform: (translation: (30, 60, 20), look_at: (0, 0, 0))),
        (name: "land", mesh: "land", material: "grey", ground: true, class: "road", piece_metres: 0),
        (name: "crate", mesh: "crate", material: "grey", transform: (translation: (3, 0.5, 12)), instance: true),
    ],
    generators: [
        (name: "traffic", place: along(routes: ["main"], spacing: 20), entity: (), vehicles: ["car", "van"],
         choose: random),
    ],
)
"""


#: Whether tests fail that lack what they need, which are skipped otherwise.
STRICT = os.environ.get("RELIEF_STRICT", "0") != "0"


def needed(package):
    """A package that some tests need. Where it is missing they are skipped; in strict mode they fail."""
    if STRICT:
        return importlib.import_module(package)
    return pytest.importorskip(package)


@pytest.fixture(scope="session")
def program():
    """The program ``relief``: RELIEF, or the one that was built last."""
    built = [ROOT / "target" / kind / "relief" for kind in ("debug", "release")]
    found = [pathlib.Path(os.environ["RELIEF"])] if "RELIEF" in os.environ else [own for own in built if own.exists()]
    if not found:
        (pytest.fail if STRICT else pytest.skip)("skipped: no program; cargo build")
    return str(max(found, key=lambda path: path.stat().st_mtime))


@pytest.fixture
def road_file(tmp_path):
    """A road with traffic, as a file."""
    types = (relief.assets() / "vehicles.ron").resolve()
    path = tmp_path / "road.ron"
    path.write_text(ROAD.format(types=types.as_posix()))
    return path


@pytest.fixture
def road(road_file):
    """A world of it."""
    return relief.Sim(road_file)


@pytest.fixture
def field():
    """An open field."""
    return relief.Sim()
