"""Pictures of what cameras give, for notebooks: arrays as images of Pillow.

This needs Pillow: ``pip install 'relief[notebooks]'``.
"""

from __future__ import annotations

import colorsys
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .extras import missing

try:
    from PIL import Image
except ImportError as error:
    raise missing(error, "notebooks") from None


def of_color(color: NDArray[Any]) -> Image.Image:
    """Colours, uint8 (H, W, 3)."""
    return Image.fromarray(color)


def of_depth(depth: NDArray[Any], far: float = 100.0) -> Image.Image:
    """Distances in metres, (H, W): near is yellow, ``far`` and beyond dark blue, by their logarithm."""
    near = min(max(float(depth.min()), 0.1), far / 2)
    at = np.log(np.clip(depth, near, far) / near) / max(np.log(far / near), 1e-6)
    stops = np.array([[253, 231, 37], [94, 201, 98], [33, 145, 140], [59, 82, 139], [30, 10, 50]], np.float64)
    place = np.linspace(0.0, 1.0, len(stops))
    return Image.fromarray(np.stack([np.interp(at, place, stops[:, i]) for i in range(3)], axis=-1).astype(np.uint8))


def hue(number: int) -> tuple[int, int, int]:
    """A colour for a number; neighbours lie far apart, 0 is black."""
    if number == 0:
        return (0, 0, 0)
    r, g, b = colorsys.hsv_to_rgb(number * 0.618034 % 1.0, 0.65, 0.95)
    return (round(255 * r), round(255 * g), round(255 * b))


def of_ids(ids: NDArray[Any]) -> Image.Image:
    """Whole numbers, (H, W): each in its own colour."""
    values, place = np.unique(ids, return_inverse=True)
    table = np.array([hue(int(value)) for value in values], np.uint8)
    return Image.fromarray(table[place.reshape(ids.shape)])


def of_normals(normals: NDArray[Any]) -> Image.Image:
    """Unit vectors, (H, W, 3): 0.5 + 0.5 n."""
    return Image.fromarray(np.rint(255 * (0.5 + 0.5 * normals)).astype(np.uint8))


def grid(*pictures: Image.Image, columns: int = 2, gap: int = 4) -> Image.Image:
    """Pictures of one size beside and below each other, on white."""
    columns = min(columns, len(pictures))
    rows = -(-len(pictures) // columns)
    width, height = pictures[0].width + gap, pictures[0].height + gap
    sheet = Image.new("RGB", (columns * width - gap, rows * height - gap), "white")
    for i, picture in enumerate(pictures):
        sheet.paste(picture, (i % columns * width, i // columns * height))
    return sheet
