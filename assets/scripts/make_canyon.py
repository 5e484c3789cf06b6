"""Writes assets/scenes/canyon.ron: a street between houses, with a bridge, a passage and parked cars."""

import random
from pathlib import Path

SCENE = Path(__file__).resolve().parents[1] / "scenes/canyon.ron"

HEAD = """\
// A street between houses under a clear sky, with a bridge, a passage and parked cars: how much of the sky each place
// sees. `relief sky assets/scenes/canyon.ron -o out` compares that with rays; docs/weather.md says how it is found.
// `make_canyon.py` writes this file.
(
    vehicle_types: ["../vehicles.ron"],
    weather: (sky: atmosphere, sun_azimuth_degrees: 30, sun_elevation_degrees: 25, haze: 20000),
    environment: (ambient: (0, 0, 0)),
    materials: {
        "asphalt": (base_map: "../textures/asphalt_base.jpg", normal_map: "../textures/asphalt_normal.png", specular_map: "../textures/asphalt_specular.png"),
        "brick": (base_map: "../textures/brick_base.jpg", normal_map: "../textures/brick_normal.png", specular_map: "../textures/brick_specular.png"),
        "plaster": (base_map: "../textures/plaster_base.jpg", normal_map: "../textures/plaster_normal.png", specular_map: "../textures/plaster_specular.png"),
        "concrete": (base_factor: (0.4, 0.4, 0.38)),
    },
    meshes: {
        "ground": plane(size: (200, 300), tile_metres: 3.2),
"""

CAMERAS = """\
        (name: "street", transform: (translation: (-1.6, 1.4, -45), look_at: (-0.6, 2.2, 0)), camera: (fov_y_degrees: 60)),
        (name: "bridge", transform: (translation: (1.6, 1.4, 28), look_at: (0, 2.5, 60)), camera: (fov_y_degrees: 60)),
        (name: "passage", transform: (translation: (3, 1.6, 34), look_at: (20, 1.8, 44)), camera: (fov_y_degrees: 60)),
        (name: "ground", mesh: "ground", material: "asphalt", ground: true, transform: (translation: (0, 0, 30))),
"""

# Metres from the middle of the street to the middle of the houses, and how deep these are.
ASIDE, DEPTH = 13, 12


class Boxes:
    """Meshes and entities of boxes that stand on a height."""

    def __init__(self):
        self.meshes, self.entities = {}, []

    def add(self, name, place, size, material):
        (x, y, z), (width, height, length) = place, size
        mesh = f"{width:g}x{height:g}x{length:g}"
        self.meshes[mesh] = f"cube(size: ({width:g}, {height:g}, {length:g}), tile_metres: 2)"
        at = f"({x:g}, {y + height / 2:g}, {z:g})"
        self.entities.append(
            f'        (name: "{name}", mesh: "{mesh}", material: "{material}", transform: (translation: {at})),'
        )


def houses(boxes, rng):
    number = 0
    for side in (-1, 1):
        z, has_passage = -60, False
        while z < 120:
            length, height = rng.choice([12, 16, 20, 24]), rng.choice([7, 10, 13, 16, 20])
            if side == 1 and 20 < z < 60 and not has_passage and length >= 16:
                # Of 4 by 4 m.
                part, has_passage = (length - 4) / 2, True
                size = (DEPTH, height, part)
                boxes.add(f"house {number}a", (ASIDE, 0, z + part / 2), size, "plaster")
                boxes.add(f"house {number}b", (ASIDE, 0, z + length - part / 2), size, "plaster")
                over = (ASIDE, 4, z + length / 2)
                boxes.add(f"house {number} over the passage", over, (DEPTH, height - 4, 4), "plaster")
            else:
                size, material = (DEPTH, height, length), rng.choice(["plaster", "brick"])
                boxes.add(f"house {number}", (side * ASIDE, 0, z + length / 2), size, material)
            number += 1
            z += length + (8 if rng.random() < 0.3 else 0)


def main():
    boxes = Boxes()
    houses(boxes, random.Random(5))
    boxes.add("bridge", (0, 5, 45), (14, 1, 8), "concrete")
    lines = [f'        "{name}": {mesh},' for name, mesh in sorted(boxes.meshes.items())]
    lines += ["    },", "    entities: [", CAMERAS.rstrip("\n"), *boxes.entities]
    for car in range(14):
        x, yaw = (-5.2 if car % 2 == 0 else 5.2), (180 if car % 2 == 0 else 0)
        place = f"translation: ({x:g}, 0, {car * 11 - 44}), rotation_degrees: (0, {yaw}, 0)"
        lines.append(f'        (name: "car {car + 1}", vehicle: (type: "car"), transform: ({place})),')
    SCENE.write_text(HEAD + "\n".join([*lines, "    ],", ")", ""]), encoding="utf-8")


if __name__ == "__main__":
    main()
