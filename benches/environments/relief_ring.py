"""Relief's environment of traffic, all environments together: python relief_ring.py [--environments N]."""

import numpy as np

import relief
import ring
from relief.envs.tasks import Traffic


class Ring(Traffic):
    """What the other programs give: colours, depths in metres, ids, and a reward."""

    outputs = ("color", "depth", "instance")

    def observation_space(self):
        from gymnasium import spaces

        height, width = self.size[1], self.size[0]
        return spaces.Dict(
            {
                "color": spaces.Box(0, 255, (height, width, 3), np.uint8),
                "depth": spaces.Box(0.0, np.inf, (height, width), np.float32),
                "instance": spaces.Box(0, 2**32 - 1, (height, width), np.uint32),
            }
        )

    def observe(self, episode, capture):
        camera = capture["ego/camera"]
        return {"color": camera.color, "depth": camera.depth, "instance": camera.instance}


def make(count):
    env = relief.make_vec(Ring(size=(ring.SIZE, ring.SIZE)), count)
    env.reset(seed=0)
    actions = np.tile(np.array([0.0, 0.2], np.float32), (count, 1))
    return lambda: env.step(actions)


ring.run("relief", make)
