"""The boxes in MuJoCo: python mujoco_boxes.py DIR [--mode …] [--write], with --renderer as its class Renderer draws.

By default drawn with MuJoCo's functions themselves: depth is read from the pass that draws the colours, where
`mujoco.Renderer` draws once more for it. Only what is where in the picture takes a second pass either way.
"""

import os
import sys

os.environ.setdefault("MUJOCO_GL", "egl")

import mujoco
import numpy as np

import common


def model(scene):
    numbers = lambda values: " ".join(f"{value:.9g}" for value in values)
    half = np.array(scene.box_metres) / 2
    boxes = "".join(
        f'<geom type="box" size="{numbers(half)}" pos="{numbers(center)}" rgba="{numbers(color)} 1"/>'
        for center, color in zip(scene.boxes, scene.colors)
    )
    fov = f'fovy="{scene.fov_y_degrees}"'
    cameras = "".join(
        f'<camera pos="{numbers(view[:3, 3])}" xyaxes="{numbers(view[:3, :2].T.ravel())}" {fov}/>'
        for view in scene.views
    )
    # The third size of a plane is the distance of the lines by which it is cut: a ground of one piece.
    side = scene.ground_metres / 2
    return mujoco.MjModel.from_xml_string(
        f"""<mujoco>
        <statistic extent="1"/>
        <visual>
            <global offwidth="{scene.size}" offheight="{scene.size}"/>
            <quality shadowsize="0" offsamples="0"/>
            <map znear="{scene.near}" zfar="{scene.far}"/>
            <headlight active="0"/>
        </visual>
        <worldbody>
            <light type="directional" dir="{numbers(scene.sun_direction)}" castshadow="false"
                ambient="{numbers(scene.ambient)}"/>
            <geom type="plane" size="{side} {side} {side}" zaxis="0 1 0" rgba="{numbers(scene.ground_color)} 1"/>
            {boxes}
            {cameras}
        </worldbody>
        </mujoco>"""
    )


def metres(depth, near, far):
    """Of a reversed depth buffer: 1 at the near plane, 0 at the far plane, where there is nothing."""
    with np.errstate(divide="ignore"):
        return np.where(depth == 0, np.float32(np.inf), near * far / (near + depth * (far - near))).astype(np.float32)


def device():
    from OpenGL import GL

    return GL.glGetString(GL.GL_RENDERER).decode()


def direct(scene, mode):
    built = model(scene)
    data = mujoco.MjData(built)
    mujoco.mj_forward(built, data)
    size = scene.size
    context = mujoco.GLContext(size, size)
    context.make_current()
    drawn = mujoco.MjvScene(built, maxgeom=len(scene.boxes) + 16)
    option, rect = mujoco.MjvOption(), mujoco.MjrRect(0, 0, size, size)
    target = mujoco.MjrContext(built, mujoco.mjtFontScale.mjFONTSCALE_100.value)
    mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, target)
    target.readDepthMap = mujoco.mjtDepthMap.mjDEPTH_ZEROFAR
    flags = mujoco.mjtRndFlag
    for flag in (flags.mjRND_SHADOW, flags.mjRND_REFLECTION, flags.mjRND_SKYBOX, flags.mjRND_HAZE):
        drawn.flags[flag] = False
    camera = mujoco.MjvCamera()
    camera.type = mujoco.mjtCamera.mjCAMERA_FIXED
    category = mujoco.mjtCatBit.mjCAT_ALL.value

    def draw(view):
        camera.fixedcamid = view
        mujoco.mjv_updateScene(built, data, option, None, camera, category, drawn)
        color = np.empty((size, size, 3), np.uint8)
        depth = np.empty((size, size), np.float32) if "depth" in mode else None
        mujoco.mjr_render(rect, drawn, target)
        mujoco.mjr_readPixels(color, depth, rect, target)
        mask = None
        if depth is not None:
            depth = metres(depth[::-1], scene.near, scene.far)
        if "instance" in mode:
            drawn.flags[flags.mjRND_SEGMENT] = drawn.flags[flags.mjRND_IDCOLOR] = True
            mujoco.mjr_render(rect, drawn, target)
            drawn.flags[flags.mjRND_SEGMENT] = drawn.flags[flags.mjRND_IDCOLOR] = False
            codes = np.empty((size, size, 3), np.uint8)
            mujoco.mjr_readPixels(codes, None, rect, target)
            # Of the geoms of the scene by their places in it, counted from 1.
            things = np.full(drawn.ngeom + 1, -1, np.int32)
            for geom in drawn.geoms[: drawn.ngeom]:
                things[geom.segid + 1] = geom.objid
            mask = things[codes[::-1] @ np.array([1, 1 << 8, 1 << 16])]
        return color[::-1], depth, mask

    draw.keeps = context
    return device(), draw


def by_renderer(scene, mode):
    built = model(scene)
    data = mujoco.MjData(built)
    mujoco.mj_forward(built, data)
    renderer = mujoco.Renderer(built, scene.size, scene.size)
    for flag in (mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_REFLECTION, mujoco.mjtRndFlag.mjRND_SKYBOX):
        renderer.scene.flags[flag] = False

    def draw(view):
        renderer.update_scene(data, view)
        color, depth, mask = renderer.render(), None, None
        if "depth" in mode:
            renderer.enable_depth_rendering()
            depth = renderer.render()
            depth[depth >= scene.far * 0.999] = np.inf
            renderer.disable_depth_rendering()
        if "instance" in mode:
            renderer.enable_segmentation_rendering()
            mask = renderer.render()[:, :, 0]
            renderer.disable_segmentation_rendering()
        return color, depth, mask

    return device(), draw


if "--renderer" in sys.argv:
    sys.argv.remove("--renderer")
    common.run("mujoco-renderer", mujoco.__version__, by_renderer)
else:
    common.run("mujoco", mujoco.__version__, direct)
