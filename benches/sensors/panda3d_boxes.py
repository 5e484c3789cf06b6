"""The boxes in Panda3D: python panda3d_boxes.py DIR [--mode …] [--write], by its software renderer with --tiny.

TinyDisplay gives no depth. What is where takes a second pass in flat colours, as in the other programs.
"""

import sys
from importlib.metadata import version

import numpy as np
from panda3d import core

import common

TINY = "--tiny" in sys.argv
if TINY:
    sys.argv.remove("--tiny")


def box(size):
    """A box with four vertices on each side."""
    data = core.GeomVertexData("box", core.GeomVertexFormat.get_v3n3(), core.Geom.UH_static)
    vertices, normals = core.GeomVertexWriter(data, "vertex"), core.GeomVertexWriter(data, "normal")
    triangles = core.GeomTriangles(core.Geom.UH_static)
    half = np.array(size) / 2
    for axis in range(3):
        for sign in (-1, 1):
            normal = np.eye(3)[axis] * sign
            right = np.roll(normal, 1)
            up = np.cross(normal, right)
            first = vertices.get_write_row()
            for across, along in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
                vertices.add_data3(*((normal + across * right + along * up) * half))
                normals.add_data3(*normal)
            triangles.add_vertices(first, first + 1, first + 2)
            triangles.add_vertices(first, first + 2, first + 3)
    geom = core.Geom(data)
    geom.add_primitive(triangles)
    node = core.GeomNode("box")
    node.add_geom(geom)
    return node


def flat(code):
    """A colour for a number from 1 to 4095, four bits in the middle of each channel: TinyDisplay rounds down."""
    return [((code >> bits & 15) * 16 + 8) / 255 for bits in (0, 4, 8)]


def codes(colors):
    """The numbers of such colours; 0 of black."""
    return (colors >> 4).astype(np.int32) @ np.array([1, 1 << 4, 1 << 8])


def make(scene, mode):
    display = "p3tinydisplay" if TINY else "p3headlessgl"
    core.load_prc_file_data("", f"load-display {display}\ncoordinate-system yup-right\naudio-library-name null")
    size, has_depth = scene.size, "depth" in mode and not TINY
    engine = core.GraphicsEngine.get_global_ptr()
    pipe = core.GraphicsPipeSelection.get_global_ptr().make_default_pipe()
    asked = core.FrameBufferProperties()
    asked.set_rgba_bits(8, 8, 8, 8)
    asked.set_depth_bits(24)
    square, flags = core.WindowProperties.size(size, size), core.GraphicsPipe.BF_refuse_window

    def target(sort, host):
        """A picture that is read back after each frame, and the texture that it is read into."""
        gsg = host.get_gsg() if host else None
        buffer = engine.make_output(pipe, f"picture {sort}", sort, asked, square, flags, gsg, host)
        if buffer is None:
            common.give_up(f"{display} gives no picture of {size} pixels")
        color = core.Texture()
        buffer.add_render_texture(color, core.GraphicsOutput.RTM_copy_ram, core.GraphicsOutput.RTP_color)
        return buffer, color

    world = core.NodePath("world")
    lens = core.PerspectiveLens()
    lens.set_fov(scene.fov_y_degrees, scene.fov_y_degrees)
    lens.set_near_far(scene.near, scene.far)

    def watch(buffer, clear):
        """A camera whose picture begins with a colour."""
        buffer.set_clear_color((*clear, 1))
        camera = world.attach_new_node(core.Camera("camera", lens))
        buffer.make_display_region().set_camera(camera)
        return camera

    def add(size, center, color, code):
        node = world.attach_new_node(box(size))
        node.set_pos(*center)
        node.set_color(*color, 1)
        node.set_tag("code", str(code))
        return node

    for code, solid in enumerate(scene.solids(), 1):
        add(*solid, code)
    sun, sky = core.DirectionalLight("sun"), core.AmbientLight("sky")
    sun.set_direction(core.Vec3(*scene.sun_direction))
    sky.set_color((*scene.ambient, 1))
    for light in (sun, sky):
        world.set_light(world.attach_new_node(light))

    buffer, color = target(0, None)
    cameras = [watch(buffer, scene.sky_color)]
    depth = mask = None
    if has_depth:
        depth = core.Texture()
        depth.set_format(core.Texture.F_depth_component)
        depth.set_component_type(core.Texture.T_float)
        buffer.add_render_texture(depth, core.GraphicsOutput.RTM_copy_ram, core.GraphicsOutput.RTP_depth)
    if "instance" in mode:
        coded, mask = target(1, buffer)
        cameras.append(watch(coded, (0, 0, 0)))
        plain = cameras[-1].node()
        plain.set_tag_state_key("code")
        for code in range(1, len(scene.boxes) + 2):
            own = core.NodePath("state")
            own.set_light_off(10)
            own.set_color(*flat(code), 1, 10)
            plain.set_tag_state(str(code), own.get_state())

    places = [core.LMatrix4(*view.T.ravel()) for view in scene.views]

    def texels(texture, kind):
        """From the top."""
        return np.frombuffer(texture.get_ram_image(), kind).reshape(size, size, -1)[::-1]

    near, far = scene.near, scene.far

    def draw(view):
        for camera in cameras:
            camera.set_mat(places[view])
        engine.render_frame()
        # Blue first.
        picture = texels(color, np.uint8)[:, :, 2::-1].copy()
        metres = None
        if depth is not None:
            window = texels(depth, np.float32)[:, :, 0]
            metres = np.where(window >= 1, np.float32(np.inf), near * far / (far - (far - near) * window))
        things = None if mask is None else codes(texels(mask, np.uint8)[:, :, 2::-1]) - 1
        return picture, metres, things

    draw(0)
    device = "TinyDisplay" if TINY else buffer.get_gsg().get_driver_renderer()
    return device, draw


common.run("panda3d-tiny" if TINY else "panda3d", version("panda3d"), make)
