"""What all programs share: the scene that Relief wrote, and a loop that measures or writes pictures of it.

Axes are Relief's in every program: Y up, cameras look along their −Z, the ground is the plane y = 0. Things have
numbers: 0 the ground, 1 and on the boxes in their order, −1 nothing.
"""

import argparse
import json
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

MODES = ("color", "color+depth", "color+depth+instance")

WARM_UP = 5


@dataclass
class Scene:
    """What `cargo bench --bench sensors -- --write DIR` leaves; metres and linear RGB."""

    boxes: np.ndarray  # (K, 3), middles
    colors: np.ndarray  # (K, 3)
    views: np.ndarray  # (N, 4, 4), world from camera
    size: int  # pixels along both sides of a picture
    fov_y_degrees: float
    near: float
    far: float
    box_metres: tuple  # along X, Y and Z
    ground_metres: float  # side of a square around the origin
    ground_color: tuple
    sky_color: tuple
    ambient: tuple
    sun_direction: tuple  # the way that light goes

    @classmethod
    def read(cls, folder):
        arrays = {name: np.load(folder / f"{name}.npy").astype(np.float64) for name in ("boxes", "colors", "views")}
        return cls(**arrays, **json.loads((folder / "scene.json").read_text()))

    def solids(self):
        """Size, middle and colour of each thing in the order of their numbers. The ground is the top of a slab."""
        side, thick = self.ground_metres, 0.2
        yield (side, thick, side), (0, -thick / 2, 0), self.ground_color
        for center, color in zip(self.boxes, self.colors):
            yield tuple(self.box_metres), tuple(center), tuple(color)


def run(program, version, make):
    """Reads the command line, draws and prints or writes.

    `make(scene, mode)` gives the device's name and a function from the number of a view to its color (H, W, 3) u8,
    depth (H, W) f32 in metres along the optical axis, infinite where there is nothing, and mask (H, W) of numbers of
    things; None for what the mode has not, or the program cannot give.
    """
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path, help="what Relief wrote")
    parser.add_argument("--mode", choices=MODES, default=MODES[-1])
    parser.add_argument("--seconds", type=float, default=3.0, help="how long a round takes at least")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--write", action="store_true", help="write pictures beside Relief's, and measure nothing")
    args = parser.parse_args()
    try:
        scene = Scene.read(args.folder)
    except OSError as error:
        give_up(f"expected a scene that Relief wrote: {error}")
    device, draw = make(scene, args.mode)
    if args.write:
        write(args.folder, program, [draw(view) for view in range(len(scene.views))])
        return
    for view in range(WARM_UP):
        draw(view % len(scene.views))
    for number in range(args.rounds):
        figures = {
            "program": program,
            "version": version,
            "device": device,
            "boxes": len(scene.boxes),
            "size": scene.size,
            "views": len(scene.views),
            "mode": args.mode,
            "round": number,
        }
        print(json.dumps(figures | measure(draw, len(scene.views), args.seconds)), flush=True)


def measure(draw, views, seconds):
    """Views in turn, all of them as often; processor time of all threads and wall clock of each, milliseconds."""
    observations = 0
    wall, processor = time.perf_counter(), time.process_time()
    while observations == 0 or time.perf_counter() - wall < seconds:
        for view in range(views):
            draw(view)
        observations += views
    wall, processor = time.perf_counter() - wall, time.process_time() - processor
    return {
        "observations": observations,
        "cpu_ms": 1e3 * processor / observations,
        "wall_ms": 1e3 * wall / observations,
    }


def write(folder, program, pictures):
    for name, arrays in zip(("color", "depth", "mask"), zip(*pictures)):
        if all(array is not None for array in arrays):
            kind = {"color": np.uint8, "depth": np.float32, "mask": np.int32}[name]
            np.save(folder / f"{program}-{name}.npy", np.stack(arrays).astype(kind))


def give_up(reason):
    """Ends with what is missing."""
    sys.exit(f"{Path(sys.argv[0]).name}: {reason}")
