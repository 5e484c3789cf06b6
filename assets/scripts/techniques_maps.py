"""The maps that follow from the gallery's height map: by `relief map` where there is one, else here."""

import os
import shutil
import subprocess
import tempfile
import numpy as np
from PIL import Image
from texlib import encode_normal, normal_from_height, save_png

# The program; RELIEF names another one.
RELIEF = os.environ.get('RELIEF') or shutil.which('relief') or ''


def tool(name, height, out, depth):
    """Whether `relief map NAME` made the map."""
    if not RELIEF:
        return False
    known = subprocess.run([RELIEF, 'map', '--help'], capture_output=True, text=True)
    # A program without the command takes it for a scene, and shows the help of showing scenes.
    if known.returncode != 0 or 'relief map' not in known.stdout:
        return False
    subprocess.run([RELIEF, 'map', name, height, '-o', out, '--height-scale', str(depth)], check=True)
    return True


def read(height):
    return np.asarray(Image.open(height), float) / 65535


def normal_map(height, out, depth):
    """Tangent space, green up."""
    if not tool('normal', height, out, depth):
        save_png(out, encode_normal(normal_from_height(read(height), 1.0, depth)))


def offset_map(height, out, depth):
    """128 + 127·d, d the x and y of the normal whose z is 1: red toward image-right, green toward image-up."""
    if not tool('offset', height, out, depth):
        n = normal_from_height(read(height), 1.0, depth)
        d = np.clip(n[..., :2] / n[..., 2:], -1, 1)
        blue = np.zeros_like(d[..., :1])
        save_png(out, np.concatenate([np.floor(128.5 + 127 * d), blue], -1).astype(np.uint8))


def horizon_maps(height, out, depth):
    """Elevation of the horizon over a right angle in eight directions, two images of half the size (Sloan, Cohen 2000)."""
    h = read(height)
    h = h.reshape(h.shape[0] // 2, 2, h.shape[1] // 2, 2).mean((1, 3))
    with tempfile.NamedTemporaryFile(suffix='.png') as half:
        Image.fromarray(np.round(h * 65535).astype(np.uint16)).save(half.name)
        if tool('horizon', half.name, out, depth):
            return
    angles = [np.arctan(steepest(h, np.radians(45 * k), depth)) / (np.pi / 2) for k in range(8)]
    stem, extension = os.path.splitext(out)
    for image in range(2):
        maps = np.stack(angles[4 * image:4 * image + 4], -1)
        save_png('%s_%d%s' % (stem, image, extension), np.floor(maps * 255 + 0.5).astype(np.uint8))


def steepest(h, azimuth, depth):
    """The steepest rise from each texel to any other in that direction from image-right toward image-up."""
    n = h.shape[0]
    dx, dy = int(np.round(np.cos(azimuth))), -int(np.round(np.sin(azimuth)))
    length = np.hypot(dx, dy)
    best = np.zeros_like(h)
    for k in range(1, n // 2):
        distance = k * length / n
        if (depth / distance <= best).all():
            break
        there = np.roll(h, (-k * dy, -k * dx), (0, 1))
        best = np.maximum(best, (there - h) * depth / distance)
    return best
