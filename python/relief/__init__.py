"""Relief: a simulation renderer. Worlds of vehicles and lights, and sensors in them, as numpy arrays.

>>> import relief
>>> sim = relief.Sim()
>>> car = sim.spawn_vehicle("car", at=(0, 0, 0), manual=True)
>>> camera = car.add_camera("front", size=(64, 48), at=(0, 1.4, 1.8), outputs=("color", "depth"))
>>> car.drive(throttle=0.4)
>>> sim.step(10)
10
>>> sim.capture()["front"].depth.shape
(48, 64)

Lengths are metres, times seconds, angles radians unless a name says degrees. The world is right-handed with +Y up;
vehicles have +Z forward and +X to the left. Pictures have rows from the top.
"""

from __future__ import annotations

import os
import pathlib
from typing import TYPE_CHECKING, Any

# Nothing is drawn to a display. Mesa's Vulkan layer that sorts adapters would ask for one all the same, and say on
# standard error that there is none; it is kept where it is told to choose an adapter, as it asks for none then.
if not any(name in os.environ for name in ("MESA_VK_DEVICE_SELECT", "DRI_PRIME")):
    os.environ.setdefault("NODEVICE_SELECT", "1")

from . import cuda, described, errors
from ._relief import (
    __version__,
    BarometerReading,
    CameraBatch,
    CameraCapture,
    Capture,
    Collisions,
    Contact,
    Dataset,
    Entity,
    GnssReading,
    ImuReading,
    LaneReading,
    LidarCapture,
    Light,
    LightEntity,
    Portal,
    Reading,
    Recording,
    Route,
    Sensor,
    Sim,
    Vehicle,
    adapter,
    capture,
    capture_columns,
    capture_due,
    look,
    replay,
    set_threads,
    step,
)
from .errors import Error, ForkedError, GoneError, GpuError, OutputError, RecordingError, SceneError

if TYPE_CHECKING:
    from .envs import DrivingVectorEnv, Task


def make_vec(task: str | Task, num_envs: int = 1, **options: Any) -> DrivingVectorEnv:
    """Environments of Gymnasium for many worlds at once: see ``relief.envs.make_vec``. Needs gymnasium."""
    from .envs import make_vec as make

    return make(task, num_envs, **options)


def assets() -> pathlib.Path:
    """The folder of what comes with the package: scenes, vehicle types, rigs of sensors, models and textures."""
    return pathlib.Path(__file__).resolve().parent / "assets"



def __dir__() -> list[str]:
    return sorted(__all__)


__all__ = [
    "BarometerReading",
    "CameraBatch",
    "CameraCapture",
    "Capture",
    "Collisions",
    "Contact",
    "Dataset",
    "Entity",
    "Error",
    "ForkedError",
    "GnssReading",
    "GoneError",
    "GpuError",
    "ImuReading",
    "LaneReading",
    "LidarCapture",
    "Light",
    "LightEntity",
    "OutputError",
    "Portal",
    "Reading",
    "Recording",
    "RecordingError",
    "Route",
    "SceneError",
    "Sensor",
    "Sim",
    "Vehicle",
    "__version__",
    "adapter",
    "assets",
    "capture",
    "capture_columns",
    "capture_due",
    "cuda",
    "errors",
    "look",
    "make_vec",
    "replay",
    "set_threads",
    "step",
]
