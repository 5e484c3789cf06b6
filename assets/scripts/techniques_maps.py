"""The maps that follow from the gallery's height map, by `relief map`."""

import os
import shutil
import subprocess
import tempfile
import numpy as np
from PIL import Image
from texlib import blur

BUILT = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', '..', 'target', 'release', 'relief')


def program():
    """What RELIEF names, or else what is built, or else what is installed."""
    found = os.environ.get('RELIEF') or (BUILT if os.path.exists(BUILT) else shutil.which('relief'))
    if not found:
        raise SystemExit('relief: not found; build it (cargo build --release), or name it by RELIEF')
    return found


def make(name, height, out, depth):
    """A map of a height map's file; `depth` from black to white, in widths of the image."""
    subprocess.run([program(), 'map', name, height, '-o', out, '--height-scale', str(depth)],
                   check=True, stdout=subprocess.DEVNULL)


def make_half(name, height, out, depth, sigma=0.0):
    """The same of half the size, after a blur over `sigma` texels."""
    h = np.asarray(Image.open(height), float)
    h = blur(h, sigma) if sigma else h
    h = h.reshape(h.shape[0] // 2, 2, h.shape[1] // 2, 2).mean((1, 3))
    with tempfile.TemporaryDirectory() as folder:
        half = os.path.join(folder, 'half.png')
        Image.fromarray(np.clip(np.round(h), 0, 65535).astype(np.uint16)).save(half)
        make(name, half, out, depth)
