"""The ring in Relief, all environments together: python relief_ring.py [--environments N].

Vehicles are one box each, as in the other programs, on a ground of two triangles; they have Relief's own traffic.
"""

import pathlib
import sys
import tempfile

import numpy as np

import relief
import ring
from relief.envs.tasks import Traffic

sys.path.append(str(pathlib.Path(__file__).resolve().parents[2] / "assets" / "scripts"))
from meshlib import Glb, box  # noqa: E402

SCENE = """(
    vehicle_types: ["ring.vehicles.ron"],
    environment: (ambient: (0.35, 0.35, 0.38), zenith: (0.2, 0.35, 0.65), horizon: (0.6, 0.7, 0.8), ground: (0.2, 0.2, 0.2)),
    materials: {{ "grey": (base_factor: (0.5, 0.5, 0.5)) }},
    meshes: {{ "land": plane(size: (400, 400)) }},
    routes: {{ "ring": (points: [{points}], shape: spline, closed: true, lanes: 3, lane_width: 3.5, speed_limit_kmh: 60) }},
    entities: [
        (light: directional(intensity: 1.5), transform: (translation: (40, 60, -25), look_at: (0, 0, 0))),
        (name: "land", mesh: "land", material: "grey", class: "terrain", ground: true, piece_metres: 0),
    ],
    generators: [
        (name: "traffic", place: along(routes: ["ring"], spacing: {spacing}, jitter: 8), vehicles: ["car"]),
    ],
)"""
TYPES = """(
    types: {{ "car": (
        model: "box.glb", class: "car", mass: 1250, wheelbase: 2.5, track: 1.5,
        limits: (speed_kmh: 170, acceleration: 3, braking: 8),
        driver: (acceleration: 1.5, braking: 2, headway_seconds: 1.2),
        paint: (materials: ["paint"], colors: [{colors}]),
    ) }},
)"""


class Ring(Traffic):
    """What the other programs give: colours, depths in metres, ids, and a reward."""

    outputs = ("color", "depth", "instance")
    eye = (0.0, ring.EYE[0], ring.BOX[2] - 0.75 + ring.EYE[1])
    down_degrees, fov_y_degrees = 0.0, ring.FOV_Y_DEGREES

    def load(self):
        random = np.random.default_rng(0)
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            width, height, length = ring.BOX
            glb = Glb()
            paint = glb.material("paint", color=(0.5, 0.5, 0.5, 1), metallic=0.0, roughness=0.5)
            middle = box(width, height, length).move(0, height / 2, length / 2 - 0.75)
            glb.node("box", glb.mesh("box", [(middle, paint)]))
            glb.save(str(folder / "box.glb"))
            colors = [", ".join(f"{part:.3f}" for part in random.uniform(0.2, 1, 3)) for _ in range(50)]
            (folder / "ring.vehicles.ron").write_text(TYPES.format(colors=", ".join(f"({color})" for color in colors)))
            turns = np.arange(24) * 2 * np.pi / 24
            points = ", ".join(f"({100 * np.sin(turn):.3f}, 0, {100 * np.cos(turn):.3f})" for turn in turns)
            spacing = 2 * np.pi * 100 * 3 / (ring.CARS - 1)
            (folder / "ring.ron").write_text(SCENE.format(points=points, spacing=spacing))
            return relief.Sim(folder / "ring.ron")

    def observation_space(self):
        from gymnasium import spaces

        height, width = self.size[1], self.size[0]
        return spaces.Dict(
            {
                "color": spaces.Box(0, 255, (height, width, 3), np.uint8),
                "depth": spaces.Box(0.0, np.inf, (height, width), np.float32),
                "instance": spaces.Box(0, 2**32 - 1, (height, width), np.uint32),
            }
        )

    def observe(self, episode, capture):
        return self.pictures(capture["ego/camera"])

    def observe_all(self, episodes, seen):
        return self.pictures(seen.camera)

    @staticmethod
    def pictures(camera):
        return {"color": camera.color, "depth": camera.depth, "instance": camera.instance}


def make(count):
    env = relief.make_vec(Ring(size=(ring.SIZE, ring.SIZE)), count)
    env.reset(seed=0)
    actions = np.tile(np.array([0.0, 0.2], np.float32), (count, 1))
    return lambda: env.step(actions)


ring.run("relief", make)
