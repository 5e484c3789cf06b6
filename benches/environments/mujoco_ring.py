"""The ring in MuJoCo: python mujoco_ring.py [--environments N], with --renderer as its class Renderer draws.

By default drawn with MuJoCo's functions themselves: depth is read from the pass that draws the colours, where
`mujoco.Renderer` draws once more for it.
"""

import os
import sys

os.environ.setdefault("MUJOCO_GL", "egl")

import mujoco
import numpy as np

import ring


def model(seed):
    random = np.random.default_rng(seed)
    width, height, length = (side / 2 for side in ring.BOX)
    cars = ""
    for number in range(ring.CARS):
        color = " ".join(f"{part:.3f}" for part in random.uniform(0.2, 1, 3))
        eye = f"{length + ring.EYE[1]} 0 {ring.EYE[0] - height}"
        camera = f'<camera pos="{eye}" xyaxes="0 -1 0 0 0 1" fovy="{ring.FOV_Y_DEGREES}"/>'
        cars += f"""<body mocap="true" pos="0 0 {height}">
            <geom type="box" size="{length} {width} {height}" rgba="{color} 1"/>{camera if number == 0 else ""}</body>"""
    return mujoco.MjModel.from_xml_string(
        f"""<mujoco>
        <option timestep="{ring.SECONDS}"/>
        <statistic extent="1"/>
        <visual>
            <global offwidth="{ring.SIZE}" offheight="{ring.SIZE}"/>
            <quality shadowsize="0" offsamples="0"/>
            <map znear="{ring.NEAR}" zfar="{ring.FAR}"/>
            <headlight active="0"/>
        </visual>
        <worldbody>
            <light type="directional" dir="0.4 0.3 -1" castshadow="false" ambient="0.3 0.3 0.3"/>
            <geom type="plane" size="200 200 200" rgba="0.5 0.5 0.5 1"/>
            {cars}
        </worldbody>
        </mujoco>"""
    )


class Drawing:
    """What draws, for all environments."""

    def __init__(self, built):
        self.gl = mujoco.GLContext(ring.SIZE, ring.SIZE)
        self.gl.make_current()
        self.scene = mujoco.MjvScene(built, maxgeom=ring.CARS + 16)
        self.context = mujoco.MjrContext(built, mujoco.mjtFontScale.mjFONTSCALE_100.value)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self.context)
        self.context.readDepthMap = mujoco.mjtDepthMap.mjDEPTH_ZEROFAR
        flags = mujoco.mjtRndFlag
        for flag in (flags.mjRND_SHADOW, flags.mjRND_REFLECTION, flags.mjRND_SKYBOX, flags.mjRND_HAZE):
            self.scene.flags[flag] = False
        self.camera = mujoco.MjvCamera()
        self.camera.type = mujoco.mjtCamera.mjCAMERA_FIXED
        self.camera.fixedcamid = 0

    def draw(self, built, data):
        size, flags = ring.SIZE, mujoco.mjtRndFlag
        rect, category = mujoco.MjrRect(0, 0, size, size), mujoco.mjtCatBit.mjCAT_ALL.value
        mujoco.mjv_updateScene(built, data, mujoco.MjvOption(), None, self.camera, category, self.scene)
        color, depth = np.empty((size, size, 3), np.uint8), np.empty((size, size), np.float32)
        mujoco.mjr_render(rect, self.scene, self.context)
        mujoco.mjr_readPixels(color, depth, rect, self.context)
        with np.errstate(divide="ignore"):
            depth = ring.NEAR * ring.FAR / (ring.NEAR + depth[::-1] * (ring.FAR - ring.NEAR))
        self.scene.flags[flags.mjRND_SEGMENT] = self.scene.flags[flags.mjRND_IDCOLOR] = True
        mujoco.mjr_render(rect, self.scene, self.context)
        self.scene.flags[flags.mjRND_SEGMENT] = self.scene.flags[flags.mjRND_IDCOLOR] = False
        codes = np.empty((size, size, 3), np.uint8)
        mujoco.mjr_readPixels(codes, None, rect, self.context)
        return color[::-1], depth, codes[::-1] @ np.array([1, 1 << 8, 1 << 16])


class RendererDrawing:
    """The same by `mujoco.Renderer`."""

    def __init__(self, built):
        self.renderer = mujoco.Renderer(built, ring.SIZE, ring.SIZE)
        flags = mujoco.mjtRndFlag
        for flag in (flags.mjRND_SHADOW, flags.mjRND_REFLECTION, flags.mjRND_SKYBOX, flags.mjRND_HAZE):
            self.renderer.scene.flags[flag] = False

    def draw(self, built, data):
        self.renderer.update_scene(data, 0)
        color = self.renderer.render()
        self.renderer.enable_depth_rendering()
        depth = self.renderer.render()
        self.renderer.disable_depth_rendering()
        self.renderer.enable_segmentation_rendering()
        ids = self.renderer.render()[:, :, 0]
        self.renderer.disable_segmentation_rendering()
        return color, depth, ids


class Environment:
    def __init__(self, seed):
        self.model = model(seed)
        self.data = mujoco.MjData(self.model)
        self.cars = ring.Ring(seed)
        self.random = np.random.default_rng(seed)

    def step(self, drawing):
        throttle = self.random.uniform(-0.2, 0.6)
        for _ in range(ring.STEPS):
            self.cars.step(throttle)
            places, turned = self.cars.places()
            self.data.mocap_pos[:, :2] = places
            self.data.mocap_quat[:, 0], self.data.mocap_quat[:, 3] = np.cos(turned / 2), np.sin(turned / 2)
            mujoco.mj_step(self.model, self.data)
        # The places of the last step.
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_camlight(self.model, self.data)
        return (*drawing.draw(self.model, self.data), self.cars.speed[0] / ring.LIMIT)


def making(drawing_of):
    def make(count):
        environments = [Environment(seed) for seed in range(count)]
        drawing = drawing_of(environments[0].model)
        return lambda: [environment.step(drawing) for environment in environments]

    return make


if "--renderer" in sys.argv:
    sys.argv.remove("--renderer")
    ring.run("mujoco-renderer", making(RendererDrawing))
else:
    ring.run("mujoco", making(Drawing))
