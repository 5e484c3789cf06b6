"""The picture of docs/sensors.md: colour, depth, normals and classes of a camera of assets/scenes/sensors.ron.

    relief render assets/scenes/sensors.ron -o data --sensors ego/front --format npy --frames 30..31
    python3 assets/scripts/make_sensor_picture.py data docs/images/sensors.png

Needs numpy and Pillow. Depths are painted on a logarithmic scale from 2 m, yellow, to 120 m, blue; normals as
0.5 + 0.5·n with Y up and Z backward; classes in their colours.
"""

import json
import sys
from pathlib import Path

import numpy as np
from PIL import Image

folder, picture = Path(sys.argv[1]), sys.argv[2]
described = json.loads((folder / "sensors.json").read_text())


def output(name):
    return np.load(folder / "ego" / "front" / f"{name}_00030.npy")


depth = output("depth")
seen = np.isfinite(depth)[..., None]
near = np.clip(1 - np.log(np.where(seen[..., 0], depth, 1e9) / 2) / np.log(60), 0, 1)
depths = np.stack([near, near**1.5, 1 - near], -1) * 255 * seen
normals = (output("normal") * [0.5, -0.5, -0.5] + 0.5) * 255 * seen
palette = np.zeros((256, 3))
for entry in described["classes"]:
    palette[entry["id"]] = entry["color"]
classes = palette[output("class")]
rows = [np.hstack([output("color"), depths]), np.hstack([normals, classes])]
Image.fromarray(np.vstack(rows).astype(np.uint8)).save(picture, optimize=True)
