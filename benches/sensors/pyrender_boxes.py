"""The boxes in pyrender: python pyrender_boxes.py DIR [--mode …] [--write].

Every picture comes with depth, whatever the mode; what is where in it takes a second pass.
"""

import os

os.environ.setdefault("PYOPENGL_PLATFORM", "egl")

import numpy as np
import pyrender
import trimesh

import common


def one_sample():
    """pyrender asks for four samples of a pixel and gives the depth of the first, which is not in its middle."""
    from pyrender import renderer

    storage = renderer.glRenderbufferStorageMultisample
    renderer.glRenderbufferStorageMultisample = lambda target, samples, *rest: storage(target, 0, *rest)


def make(scene, mode):
    one_sample()
    world = pyrender.Scene(ambient_light=scene.ambient, bg_color=[*scene.sky_color, 1.0])

    def add(size, center, color):
        mesh = trimesh.creation.box(size)
        mesh.visual.face_colors = [round(255 * part) for part in color] + [255]
        pose = trimesh.transformations.translation_matrix(center)
        return world.add(pyrender.Mesh.from_trimesh(mesh, smooth=False), pose=pose)

    nodes = [add(*solid) for solid in scene.solids()]
    lens = pyrender.PerspectiveCamera(np.radians(scene.fov_y_degrees), scene.near, scene.far, aspectRatio=1.0)
    camera = world.add(lens)
    # It shines along its −Z.
    sun = np.eye(4)
    back = -np.array(scene.sun_direction)
    right = np.cross([0, 1, 0], back)
    right /= np.linalg.norm(right)
    sun[:3, :3] = np.column_stack([right, np.cross(back, right), back])
    world.add(pyrender.DirectionalLight(intensity=3.0), pose=sun)
    # Codes from 1 on; black is where there is nothing.
    codes = {node: [code & 255, code >> 8 & 255, code >> 16] for code, node in enumerate(nodes, 1)}
    renderer = pyrender.OffscreenRenderer(scene.size, scene.size)

    def draw(view):
        world.set_pose(camera, scene.views[view])
        color, depth = renderer.render(world)
        mask = None
        if "instance" in mode:
            coded, _ = renderer.render(world, pyrender.RenderFlags.SEG, codes)
            mask = coded[:, :, :3].astype(np.int32) @ np.array([1, 1 << 8, 1 << 16]) - 1
        depth = np.where(depth == 0, np.float32(np.inf), depth) if "depth" in mode else None
        return color, depth, mask

    draw(0)
    renderer._platform.make_current()
    from OpenGL import GL

    return GL.glGetString(GL.GL_RENDERER).decode(), draw


common.run("pyrender", pyrender.__version__, make)
