"""Whether every program drew the same: python compare.py DIR, after the programs have written their pictures there.

Compares depth and masks of every program with Relief's, and Relief's with arithmetic: rays through the middles of
pixels against boxes and the plane. Prints a line of JSON for each program. `agrees` is false where the median
difference of depths is more than a centimetre or the masks' intersection over union is below 0.97: a program that draws
something else has no figures.
"""

import argparse
import json
import sys
from pathlib import Path

import numpy as np

from common import Scene

MOST_METRES = 0.01
LEAST_OVERLAP = 0.97

# Arithmetic is slow: it looks from so many places only.
VIEWS = 4


def arithmetic(scene):
    """Depth and mask of the first views, by slabs (Kay and Kajiya, "Ray Tracing Complex Scenes", SIGGRAPH 1986)."""
    size = scene.size
    focal = size / (2 * np.tan(np.radians(scene.fov_y_degrees) / 2))
    across = (np.arange(size) - (size - 1) / 2) / focal
    # Camera axes, 1 along the optical axis, so that how far along a ray is depth.
    rays = np.stack(np.broadcast_arrays(across[None, :], -across[:, None], -1.0), axis=-1)
    half, side = np.array(scene.box_metres) / 2, scene.ground_metres / 2
    depths, masks = [], []
    for view in scene.views[:VIEWS]:
        with np.errstate(divide="ignore", invalid="ignore"):
            eye, inverse = view[:3, 3], 1 / (rays @ view[:3, :3].T)
            depth = -eye[1] * inverse[:, :, 1]
            foot = eye + depth[:, :, None] / inverse
            on_ground = (depth > scene.near) & (np.abs(foot[:, :, [0, 2]]) <= side).all(axis=-1)
            depth = np.where(on_ground, depth, np.inf)
            mask = np.where(on_ground, 0, -1)
            for number, center in enumerate(scene.boxes, 1):
                slabs = np.sort([(center - half - eye) * inverse, (center + half - eye) * inverse], axis=0)
                enters, leaves = slabs[0].max(axis=-1), slabs[1].min(axis=-1)
                nearer = (enters <= leaves) & (enters > scene.near) & (enters < depth)
                depth[nearer], mask[nearer] = enters[nearer], number
        depths.append(depth)
        masks.append(mask)
    return {"depth": np.array(depths), "mask": np.array(masks)}


def pictures(folder, program):
    paths = {name: folder / f"{program}-{name}.npy" for name in ("depth", "mask")}
    return {name: np.load(path) for name, path in paths.items() if path.exists()}


def compared(own, other):
    """How far depths are apart where both have something, and how much of the boxes' pixels is the same box's."""
    figures = {"agrees": True}
    if "depth" in own:
        both = np.isfinite(own["depth"]) & np.isfinite(other["depth"])
        apart = np.abs(own["depth"][both].astype(np.float64) - other["depth"][both])
        figures["depth_median_m"] = float(np.median(apart)) if apart.size else float("inf")
        figures["depth_99_m"] = float(np.quantile(apart, 0.99)) if apart.size else float("inf")
        figures["agrees"] &= figures["depth_median_m"] <= MOST_METRES
    if "mask" in own:
        boxes = (own["mask"] > 0) | (other["mask"] > 0)
        same = own["mask"] == other["mask"]
        # Where the boxes differ, a pixel is in the union of both.
        differ = (own["mask"] > 0) & (other["mask"] > 0) & ~same
        union = int(boxes.sum() + differ.sum())
        figures["mask_iou"] = int((boxes & same).sum()) / union if union else 1.0
        figures["agrees"] &= figures["mask_iou"] >= LEAST_OVERLAP
        figures["ground_iou"] = iou(own["mask"] == 0, other["mask"] == 0)
    return figures


def iou(a, b):
    return int((a & b).sum()) / max(int((a | b).sum()), 1)


def compare(folder):
    """Figures by program; Relief's are against arithmetic."""
    programs = sorted({path.name.rsplit("-", 1)[0] for path in folder.glob("*-mask.npy")} - {"relief"})
    ours = pictures(folder, "relief")
    if len(ours) != 2:
        sys.exit(f"{folder}: expected relief-depth.npy and relief-mask.npy; cargo bench --bench sensors -- --write DIR")
    first = {name: array[:VIEWS] for name, array in ours.items()}
    results = {"relief": compared(first, arithmetic(Scene.read(folder)))}
    return results | {program: compared(pictures(folder, program), ours) for program in programs}


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    for program, figures in compare(parser.parse_args().folder).items():
        print(json.dumps({"program": program} | figures))
