"""The ring in PyBullet, drawn by its TinyRenderer: python pybullet_ring.py [--environments N]."""

import numpy as np
import pybullet as bullet

import ring


class Environment:
    def __init__(self, seed):
        self.client = bullet.connect(bullet.DIRECT)
        bullet.setTimeStep(ring.SECONDS, self.client)
        self.cars = ring.Ring(seed)
        half = [ring.BOX[0] / 2, ring.BOX[2] / 2, ring.BOX[1] / 2]
        random = np.random.default_rng(seed)
        own = {"physicsClientId": self.client}
        ground = bullet.createCollisionShape(bullet.GEOM_BOX, halfExtents=[200, 200, 0.1], **own)
        seen = bullet.createVisualShape(bullet.GEOM_BOX, halfExtents=[200, 200, 0.1], rgbaColor=[0.5, 0.5, 0.5, 1], **own)
        bullet.createMultiBody(0, ground, seen, [0, 0, -0.1], **own)
        shape = bullet.createCollisionShape(bullet.GEOM_BOX, halfExtents=half, **own)
        self.bodies = []
        for _ in range(ring.CARS):
            color = [*random.uniform(0.2, 1, 3), 1]
            seen = bullet.createVisualShape(bullet.GEOM_BOX, halfExtents=half, rgbaColor=color, **own)
            # Moved from outside, as the other programs' cars are.
            self.bodies.append(bullet.createMultiBody(0, shape, seen, [0, 0, half[2]], **own))
        self.projection = bullet.computeProjectionMatrixFOV(ring.FOV_Y_DEGREES, 1.0, ring.NEAR, ring.FAR)
        self.random = random

    def step(self):
        throttle = self.random.uniform(-0.2, 0.6)
        for _ in range(ring.STEPS):
            self.cars.step(throttle)
            places, turned = self.cars.places()
            for body, (x, y), angle in zip(self.bodies, places.tolist(), (turned - np.pi / 2).tolist()):
                turn = [0, 0, np.sin(angle / 2), np.cos(angle / 2)]
                bullet.resetBasePositionAndOrientation(body, [x, y, ring.BOX[1] / 2], turn, self.client)
            bullet.stepSimulation(self.client)
        (x, y), ahead = places[0], turned[0]
        along = np.array([np.cos(ahead), np.sin(ahead)])
        eye = [*(places[0] + along * (ring.BOX[2] / 2 + ring.EYE[1])), ring.EYE[0]]
        target = [eye[0] + along[0], eye[1] + along[1], ring.EYE[0]]
        view = bullet.computeViewMatrix(eye, target, [0, 0, 1])
        _, _, color, depth, mask = bullet.getCameraImage(
            ring.SIZE, ring.SIZE, view, self.projection, shadow=0, renderer=bullet.ER_TINY_RENDERER,
            physicsClientId=self.client,
        )
        size = (ring.SIZE, ring.SIZE)
        color = np.asarray(color, np.uint8).reshape(*size, 4)[:, :, :3]
        depth = np.asarray(depth, np.float32).reshape(size)
        depth = ring.NEAR * ring.FAR / (ring.FAR - (ring.FAR - ring.NEAR) * depth)
        return color, depth, np.asarray(mask, np.int32).reshape(size), self.cars.speed[0] / ring.LIMIT


def make(count):
    environments = [Environment(seed) for seed in range(count)]
    return lambda: [environment.step() for environment in environments]


ring.run("pybullet", make)
