"""The picture of docs/sensors.md and README.md: what a camera, a fisheye and a lidar of assets/scenes/sensors.ron see.

    relief render assets/scenes/sensors.ron -o data --sensors ego/front,ego/right,ego/top --format npy --frames 300..301
    python3 assets/scripts/make_sensor_picture.py data 300 docs/images/sensors.jpg

Needs numpy and Pillow. Above: colours with boxes in space (things of which nothing is seen have none), depths on a
logarithmic scale from 2 m, yellow, to 120 m, blue; in the middle: normals as 0.5 + 0.5·n with Y up and Z backward,
classes in their colours; below: flow to the capture before with directions as hues, and the fisheye beside the lidar's
points from above, in the colours of classes.
"""

import json
import sys
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

folder, step, picture = Path(sys.argv[1]), int(sys.argv[2]), sys.argv[3]
described = json.loads((folder / "sensors.json").read_text())
palette = np.zeros((256, 3))
for entry in described["classes"]:
    palette[entry["id"]] = entry["color"]


def output(name, sensor="front"):
    return np.load(folder / "ego" / sensor / f"{name}_{step:05}.npy")


def with_boxes(colors, boxes):
    shown = Image.fromarray(colors)
    draw = ImageDraw.Draw(shown)
    for box in boxes[boxes["pixels"] > 0]:
        corners = box["corners_uv"]
        # Corners are numbered by bits: along an edge one of them changes.
        edges = [(a, a | bit) for a in range(8) for bit in (1, 2, 4) if not a & bit]
        for a, b in edges:
            if np.isfinite(corners[[a, b]]).all():
                draw.line([tuple(corners[a]), tuple(corners[b])], fill=(255, 230, 60))
    return np.asarray(shown)


def hues(flow):
    length = np.hypot(flow[..., 0], flow[..., 1])
    turn = np.arctan2(flow[..., 1], flow[..., 0]) / (2 * np.pi) % 1
    bright = np.clip(length / np.percentile(length, 99), 0, 1) ** 0.5
    hsv = np.stack([turn * 255, np.full_like(turn, 255), bright * 255], -1)
    return np.asarray(Image.fromarray(hsv.astype(np.uint8), "HSV").convert("RGB"))


def from_above(points, width, height, reach):
    seen = points[points["hit"] == 1]
    seen = seen[np.argsort(seen["xyz"][:, 2], kind="stable")]
    x = (width / 2 - seen["xyz"][:, 1] * height / 2 / reach).astype(int)
    y = (height / 2 - seen["xyz"][:, 0] * height / 2 / reach).astype(int)
    inside = (x >= 0) & (x < width) & (y >= 0) & (y < height)
    shown = np.zeros((height, width, 3))
    shown[y[inside], x[inside]] = palette[seen["class"][inside]] * 0.8 + 50
    return shown


depth = output("depth")
height, width = depth.shape
is_there = np.isfinite(depth)[..., None]
near = np.clip(1 - np.log(np.where(is_there[..., 0], depth, 1e9) / 2) / np.log(60), 0, 1)
depths = np.stack([near, near**1.5, 1 - near], -1) * 255 * is_there
normals = (output("normal") * [0.5, -0.5, -0.5] + 0.5) * 255 * is_there
fisheye = Image.fromarray(output("color", "right"))
fisheye = np.asarray(fisheye.resize((fisheye.width * height // fisheye.height, height), Image.LANCZOS))
scan = from_above(output("points", "top"), width - fisheye.shape[1], height, 22)
rows = [
    [with_boxes(output("color"), output("boxes")), depths],
    [normals, palette[output("class")]],
    [hues(output("flow_back")), fisheye, scan],
]
shown = np.vstack([np.hstack(row) for row in rows]).astype(np.uint8)
Image.fromarray(shown).save(picture, optimize=True, quality=90)
