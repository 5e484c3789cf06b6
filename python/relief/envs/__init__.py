"""Driving as environments of Gymnasium: ``import relief.envs`` registers them. In place of the import, the module may be
named with the environment: ``gymnasium.make("relief.envs:relief/LaneFollow-v0")``.

>>> import gymnasium, relief.envs
>>> env = gymnasium.make("relief/LaneFollow-v0")
>>> observation, info = env.reset(seed=1)
>>> observation.shape
(84, 84, 3)
>>> env.close()

``relief.make_vec`` makes many of one kind, whose worlds are stepped on all threads and drawn in one submission. Those
of ``gymnasium.make_vec`` are the same where its mode is left to this package.
"""

from __future__ import annotations

import gymnasium

from .driving import DrivingEnv
from .tasks import TASKS, Task
from .vector import DrivingVectorEnv, make_vec

__all__ = ["DrivingEnv", "DrivingVectorEnv", "TASKS", "Task", "make_vec"]

for _id in TASKS:
    if _id not in gymnasium.registry:
        gymnasium.register(
            _id,
            entry_point="relief.envs.driving:DrivingEnv",
            vector_entry_point="relief.envs.vector:DrivingVectorEnv",
            kwargs={"task": _id},
        )
