"""The map tools once more, from their formulas alone (docs/maps.md), in numpy: what tests/tools/map_oracle.rs compares
with.

    maps.py FOLDER

FOLDER holds jobs.json, a list of {"tool", "input", "options", "output"}. Inputs and outputs are raw little-endian
32-bit floats, rows from the top; "shape" of an input is [height, width, channels]. Plain and slow on purpose: every
definition is written down as it is stated, without the short cuts that the program takes.
"""

import json
import math
import sys
from pathlib import Path

import numpy as np


def beyond(image, reach, edges):
    """The image with `reach` texels more on each side."""
    mode = {"wrap": "wrap", "clamp": "edge"}[edges]
    return np.pad(image, reach, mode=mode)


def correlate(image, kernel, edges):
    reach = kernel.shape[0] // 2
    padded = beyond(image, reach, edges)
    height, width = image.shape
    total = np.zeros_like(image)
    for row in range(kernel.shape[0]):
        for column in range(kernel.shape[1]):
            total += kernel[row, column] * padded[row : row + height, column : column + width]
    return total


SMOOTH = {"central": [0.0, 1.0, 0.0], "sobel": [0.25, 0.5, 0.25], "scharr": [3 / 16, 10 / 16, 3 / 16]}


def slopes(heights, o):
    """Rise per length, toward image-right and image-up."""
    across = np.array(SMOOTH[o["filter"]])
    difference = np.array([-0.5, 0.0, 0.5])
    depth = (1.0 - heights if o["invert"] else heights) * o["height_scale"] * heights.shape[1]
    right = correlate(depth, np.outer(across, difference), o["edges"])
    up = -correlate(depth, np.outer(difference, across), o["edges"])
    return o["strength"] * right, o["strength"] * up * (-1.0 if o["flip_green"] else 1.0)


def normal(heights, o):
    right, up = slopes(heights[..., 0], o)
    n = np.stack([-right, -up, np.ones_like(right)], axis=-1)
    return 0.5 + 0.5 * n / np.linalg.norm(n, axis=-1, keepdims=True)


def offset(heights, o):
    right, up = slopes(heights[..., 0], o)
    d = np.clip(np.stack([-right, -up], axis=-1), -1.0, 1.0)
    return np.concatenate([(128.0 + 127.0 * d) / 255.0, np.zeros_like(d[..., :1])], axis=-1)


def horizon(heights, o):
    depth = (1.0 - heights[..., 0] if o["invert"] else heights[..., 0]) * o["height_scale"] * heights.shape[1]
    height, width = depth.shape
    y, x = np.mgrid[0:height, 0:width]
    around = math.lcm(height, width) if o["edges"] == "wrap" else max(height, width)
    maps = []
    for right, up in [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)]:
        highest = np.zeros_like(depth)
        for k in range(1, around + 1):
            distance = k * math.hypot(right, up)
            if o["max_distance"] is not None and distance > o["max_distance"]:
                break
            there_x, there_y = x + k * right, y - k * up
            inside = (there_x >= 0) & (there_x < width) & (there_y >= 0) & (there_y < height)
            rise = depth[there_y % height, there_x % width] - depth
            if o["edges"] == "clamp":
                if not inside.any():
                    break
                rise = np.where(inside, rise, 0.0)
            highest = np.maximum(highest, np.arctan(rise / distance) / (math.pi / 2))
        maps.append(highest)
    return np.stack(maps, axis=-1)


def blurred(image, sigma, edges):
    if sigma == 0:
        return image
    reach = math.ceil(3 * sigma)
    k = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma) ** 2)
    k /= k.sum()
    padded = beyond(image, reach, edges)
    rows = np.apply_along_axis(np.convolve, 1, padded, k, mode="valid")
    return np.apply_along_axis(np.convolve, 0, rows, k, mode="valid")


def height(color, o):
    v = color @ np.array([0.2126, 0.7152, 0.0722])
    if o["remove_shading"] > 0:
        v = v - blurred(v, o["remove_shading"], o["edges"])
    v = blurred(v, o["blur"], o["edges"])
    v = v + o["sharpen"] * (v - blurred(v, 2.0, o["edges"]))
    v = -v if o["invert"] else v
    return np.clip(0.5 + o["contrast"] * (v - v.mean()), 0.0, 1.0)[..., None]


def specular(image, o):
    """The channels of the input: gloss or roughness, base colour, metallic."""
    gloss = image[..., 0] if o["from"] == "gloss" else 1.0 - image[..., 0]
    base, metallic = image[..., 1:4], image[..., 4:5]
    f0 = o["dielectric"] * (1.0 - metallic) + base * metallic
    if o["model"] == "phong":
        alpha = (1.0 - gloss[..., None]) ** 2
        with np.errstate(divide="ignore"):
            # Blinn's exponent and the peak of its normalised form: 2/α² − 2 and F0·(n + 2)/8.
            exponent = 2.0 / alpha**2 - 2.0
            f0 = f0 * (exponent + 2.0) / 8.0
    return np.concatenate([np.clip(f0, 0.0, 1.0), gloss[..., None]], axis=-1)


TOOLS = {"normal": normal, "offset": offset, "horizon": horizon, "height": height, "specular": specular}


def main():
    folder = Path(sys.argv[1])
    for job in json.loads((folder / "jobs.json").read_text()):
        image = np.fromfile(folder / job["input"], dtype="<f4").astype(np.float64).reshape(job["shape"])
        TOOLS[job["tool"]](image, job["options"]).astype("<f4").tofile(folder / job["output"])


if __name__ == "__main__":
    main()
