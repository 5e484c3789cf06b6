"""Render a GLB with Cycles on the CPU, to look at it:
    python preview.py model.glb out.png [azimuth elevation distance target_y]"""

import sys
import math
import bpy
from mathutils import Vector


def main(path, out, az=35.0, el=12.0, dist=6.5, ty=0.95, w=720, h=405, samples=20):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=path)
    sc = bpy.context.scene
    sc.render.engine = 'CYCLES'
    sc.cycles.device = 'CPU'
    sc.cycles.samples = samples
    sc.cycles.use_denoising = False
    sc.cycles.max_bounces = 4
    sc.render.threads_mode = 'FIXED'
    sc.render.threads = 2
    sc.render.resolution_x, sc.render.resolution_y = w, h
    sc.view_settings.view_transform = 'AgX'
    world = bpy.data.worlds.new('w')
    sc.world = world
    world.use_nodes = True
    nt = world.node_tree
    bg = nt.nodes['Background']
    # a sky gradient so that glossy parts have something to show
    tc = nt.nodes.new('ShaderNodeTexCoord')
    sep = nt.nodes.new('ShaderNodeSeparateXYZ')
    ramp = nt.nodes.new('ShaderNodeValToRGB')
    mp = nt.nodes.new('ShaderNodeMapRange')
    mp.inputs[1].default_value = -1
    nt.links.new(tc.outputs['Generated'], sep.inputs[0])
    nt.links.new(sep.outputs[2], mp.inputs[0])
    nt.links.new(mp.outputs[0], ramp.inputs[0])
    nt.links.new(ramp.outputs[0], bg.inputs[0])
    e = ramp.color_ramp.elements
    e[0].position, e[0].color = 0.46, (0.06, 0.055, 0.05, 1)
    e[1].position, e[1].color = 0.52, (0.75, 0.72, 0.70, 1)
    x = e.new(0.9); x.color = (0.18, 0.28, 0.5, 1)
    bg.inputs[1].default_value = 0.9
    low = min((o.matrix_world @ Vector(c)).z for o in sc.objects if o.type == 'MESH' for c in o.bound_box)
    bpy.ops.mesh.primitive_plane_add(size=60, location=(0, 0, low))
    pm = bpy.data.materials.new('g'); pm.use_nodes = True
    pm.node_tree.nodes['Principled BSDF'].inputs['Base Color'].default_value = (0.12, 0.12, 0.12, 1)
    bpy.context.object.data.materials.append(pm)
    sun = bpy.data.lights.new('s', 'SUN'); sun.energy = 2.8; sun.angle = 0.1; sun.color = (1, 0.88, 0.74)
    so = bpy.data.objects.new('s', sun); sc.collection.objects.link(so)
    so.rotation_euler = (math.radians(52), 0, math.radians(float(az) + 30 - 40))
    cam = bpy.data.cameras.new('c'); cam.sensor_width = 36; cam.lens = 36 / (2 * math.tan(math.radians(38) / 2))
    co = bpy.data.objects.new('c', cam); sc.collection.objects.link(co); sc.camera = co
    a, b = math.radians(az), math.radians(el)
    # azimuth 0 looks at the front (+Z in the file, -Y here)
    tgt = Vector((0, 0, ty))
    pos = tgt + Vector((math.sin(a) * math.cos(b), -math.cos(a) * math.cos(b), math.sin(b))) * dist
    co.location = pos
    co.rotation_euler = (tgt - pos).to_track_quat('-Z', 'Y').to_euler()
    sc.render.filepath = out
    sc.render.image_settings.file_format = 'PNG'
    bpy.ops.render.render(write_still=True)


if __name__ == '__main__':
    a = sys.argv[1:]
    main(a[0], a[1], *[float(x) for x in a[2:6]])
