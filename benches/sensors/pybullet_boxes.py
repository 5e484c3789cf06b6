"""The boxes in PyBullet, drawn by its TinyRenderer: python pybullet_boxes.py DIR [--mode …] [--write].

Every picture comes with depth, whatever the mode.
"""

from importlib.metadata import version

import numpy as np
import pybullet as bullet

import common


def make(scene, mode):
    bullet.connect(bullet.DIRECT)

    def add(size, center, color):
        half = [side / 2 for side in size]
        shape = bullet.createVisualShape(bullet.GEOM_BOX, halfExtents=half, rgbaColor=[*color, 1])
        return bullet.createMultiBody(0, -1, shape, list(center))

    bodies = [add(*solid) for solid in scene.solids()]
    if bodies != list(range(len(bodies))):
        common.give_up(f"expected bodies with numbers in the order of their making, found {bodies}")

    def view_matrix(world_from_camera):
        return np.linalg.inv(world_from_camera).T.ravel().tolist()

    views = [view_matrix(view) for view in scene.views]
    near, far, size = scene.near, scene.far, scene.size
    projection = list(bullet.computeProjectionMatrixFOV(scene.fov_y_degrees, 1.0, near, far))
    # TinyRenderer samples the corners of pixels, half a pixel off their middles: 1/size of the picture from −1 to 1.
    projection[8] += 1 / size
    projection[9] += 1 / size
    settings = {
        "projectionMatrix": projection,
        "renderer": bullet.ER_TINY_RENDERER,
        "flags": 0 if "instance" in mode else bullet.ER_NO_SEGMENTATION_MASK,
        "shadow": 0,
        "lightDirection": [-part for part in scene.sun_direction],
    }

    def draw(view):
        _, _, color, depth, mask = bullet.getCameraImage(size, size, viewMatrix=views[view], **settings)
        color = np.asarray(color, np.uint8).reshape(size, size, 4)[:, :, :3]
        if "depth" in mode:
            # Of a depth buffer: 0 at the near plane, 1 at the far plane.
            depth = np.asarray(depth, np.float32).reshape(size, size)
            depth = np.where(depth >= 1, np.float32(np.inf), near * far / (far - (far - near) * depth))
        else:
            depth = None
        mask = np.asarray(mask, np.int32).reshape(size, size) if "instance" in mode else None
        return color, depth, mask

    return "TinyRenderer", draw


common.run("pybullet", version("pybullet"), make)
