"""Put the suggested yard together and render it with Cycles, to judge the
composition: python preview_yard.py out.png [width height samples]"""

import math
import os
import sys
import bpy
from mathutils import Vector, Matrix

HERE = os.path.dirname(os.path.abspath(__file__))
A = os.path.join(HERE, '..')
C = Matrix(((1, 0, 0, 0), (0, 0, -1, 0), (0, 1, 0, 0), (0, 0, 0, 1)))     # +Y up -> +Z up

# name, position, yaw in degrees (about +Y), scale
MODELS = [
    ('facade', (0, 0, -4), 0, 1), ('vehicle_van', (-1.7, 0, 1.5), 74, 1),
    ('lamp_post', (4.3, 0, -1.9), -50, 1), ('lamp_post', (-5.1, 0, 4.6), 100, 1),
    ('wall_lamp', (-3.1, 3.50, -3.9), 0, 1), ('wall_lamp', (1.35, 2.95, -4.0), 0, 1),
    ('container', (-7.3, 0, -0.2), 0, 1), ('pipes', (7.6, 0, -2.0), 0, 1), ('gate', (11.3, 0, -2.6), 0, 1),
    ('barrel', (5.15, 0, 1.1), 20, 1), ('barrel', (5.85, 0, 0.75), 140, 1), ('barrel', (5.25, 0, 0.35), 250, 1), ('barrel', (6.6, 0, -1.2), 80, 1),
    ('crate', (3.35, 0, -3.2), 8, 1), ('crate', (2.45, 0, -3.25), -5, 1), ('crate', (2.95, 0.8, -3.2), 17, 1), ('crate', (6.5, 0, 1.9), 33, 1),
    ('kettle', (3.1, 1.22, 2.9), 25, 0.7),
]
# texture, size, centre
BOXES = [
    ('cobble', (34, 0.2, 26), (0, -0.1, 3)), ('brick', (5, 4.2, 0.36), (-8.5, 2.1, -4.18)),
    ('plaster', (3.2, 3.3, 2.2), (7.6, 1.65, -3.1)), ('corrugated', (3.5, 0.06, 2.5), (7.6, 3.36, -3.1)),
    ('concrete', (0.95, 0.80, 0.95), (3.1, 0.40, 2.9)), ('brick', (0.36, 3.0, 12), (-9.0, 1.5, 2.0)),
    ('planks', (1.9, 0.06, 0.9), (5.0, 0.45, -3.35)), ('metal', (0.75, 1.5, 0.4), (-0.82, 0.75, -3.78)),
]
CAMERA, TARGET = (3.9, 1.6, 9.0), (0.1, 1.65, -0.6)


def material(tex):
    m = bpy.data.materials.new(tex)
    m.use_nodes = True
    t, p = m.node_tree, m.node_tree.nodes['Principled BSDF']
    def img(kind, ext, raw):
        n = t.nodes.new('ShaderNodeTexImage')
        n.image = bpy.data.images.load(os.path.join(A, 'textures', '%s_%s.%s' % (tex, kind, ext)))
        if raw:
            n.image.colorspace_settings.name = 'Non-Color'
        return n
    t.links.new(img('base', 'jpg', False).outputs[0], p.inputs['Base Color'])
    nm = t.nodes.new('ShaderNodeNormalMap')
    t.links.new(img('normal', 'png', True).outputs[0], nm.inputs['Color'])
    t.links.new(nm.outputs[0], p.inputs['Normal'])
    mr = t.nodes.new('ShaderNodeMapRange')
    mr.inputs[3].default_value, mr.inputs[4].default_value = 0.9, 0.25
    t.links.new(img('specular', 'png', True).outputs[0], mr.inputs[0])
    t.links.new(mr.outputs[0], p.inputs['Roughness'])
    return m


def main(out, w=960, h=540, samples=48):
    import json
    sizes = json.load(open(os.path.join(A, 'textures', 'textures.json')))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    sc = bpy.context.scene
    mats, lights = {}, []
    for name, pos, yaw, s in MODELS:
        before = set(sc.objects)
        bpy.ops.import_scene.gltf(filepath=os.path.join(A, 'models', name + '.glb'))
        new = [o for o in sc.objects if o not in before]
        m = C @ Matrix.Translation(pos) @ Matrix.Rotation(math.radians(yaw), 4, 'Y') @ Matrix.Scale(s, 4) @ C.inverted()
        for o in new:
            if o.parent is None:
                o.matrix_world = m @ o.matrix_world
        bpy.context.view_layer.update()
        for o in new:
            n = o.name.split('.')[0]
            if o.type == 'EMPTY' and n in ('lamp', 'lamp_head_left', 'lamp_head_right', 'lamp_window_ground', 'lamp_tail_left', 'lamp_tail_right'):
                lights.append((n, o.matrix_world.copy()))
    for tex, size, pos in BOXES:
        x, y, z = (v / 2 for v in size)
        P, F, UV = [], [], []
        k = sizes[tex]['size_m']
        for ax in range(3):
            for sg in (-1, 1):
                e = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
                base = len(P)
                for a, b in e:
                    if ax == 0:
                        p, uv = (sg * x, b * y, -sg * a * z), (a * z / k, b * y / k)
                    elif ax == 1:
                        p, uv = (a * x, sg * y, -sg * b * z), (a * x / k, b * z / k)
                    else:
                        p, uv = (sg * a * x, b * y, sg * z), (a * x / k, b * y / k)
                    P.append(C @ (Vector(p) + Vector(pos))); UV.append(uv)
                F.append((base, base + 1, base + 2, base + 3))
        me = bpy.data.meshes.new(tex)
        me.from_pydata(P, [], F)
        ul = me.uv_layers.new()
        for i, l in enumerate(me.loops):
            ul.data[i].uv = UV[l.vertex_index]
        mats.setdefault(tex, None)
        mats[tex] = mats[tex] or material(tex)
        me.materials.append(mats[tex])
        sc.collection.objects.link(bpy.data.objects.new(tex, me))
    spec = {'lamp': ('POINT', 330, (1, 0.70, 0.38)), 'lamp_head_left': ('SPOT', 700, (1, 0.90, 0.74)), 'lamp_head_right': ('SPOT', 700, (1, 0.90, 0.74)),
            'lamp_window_ground': ('SPOT', 150, (1, 0.72, 0.4)), 'lamp_tail_left': ('POINT', 8, (1, 0.05, 0.03)), 'lamp_tail_right': ('POINT', 8, (1, 0.05, 0.03))}
    for n, mat in lights:
        kind, watts, col = spec[n]
        l = bpy.data.lights.new(n, kind)
        l.energy, l.color = watts, col
        l.shadow_soft_size = 0.05
        if kind == 'SPOT':
            l.spot_size = math.radians(62)
            l.spot_blend = 0.7
        o = bpy.data.objects.new(n, l)
        # the importer turns local axes too: the file's -Z is +Y here
        o.matrix_world = mat @ Matrix.Rotation(math.radians(90), 4, 'X') @ Matrix.Translation((0, 0, -0.06))
        sc.collection.objects.link(o)
    wd = bpy.data.worlds.new('w'); sc.world = wd; wd.use_nodes = True
    t = wd.node_tree
    tc, sp, rp = t.nodes.new('ShaderNodeTexCoord'), t.nodes.new('ShaderNodeSeparateXYZ'), t.nodes.new('ShaderNodeValToRGB')
    t.links.new(tc.outputs['Generated'], sp.inputs[0]); t.links.new(sp.outputs[2], rp.inputs[0]); t.links.new(rp.outputs[0], t.nodes['Background'].inputs[0])
    e = rp.color_ramp.elements
    e[0].position, e[0].color = 0.0, (0.55, 0.30, 0.20, 1)
    e[1].position, e[1].color = 0.5, (0.06, 0.10, 0.22, 1)
    x = e.new(0.16); x.color = (0.20, 0.20, 0.32, 1)
    t.nodes['Background'].inputs[1].default_value = 0.42
    cam = bpy.data.cameras.new('c'); cam.sensor_fit = 'VERTICAL'; cam.angle = math.radians(45)
    co = bpy.data.objects.new('c', cam); sc.collection.objects.link(co); sc.camera = co
    p, q = C @ Vector(CAMERA), C @ Vector(TARGET)
    co.location = p
    co.rotation_euler = (q - p).to_track_quat('-Z', 'Y').to_euler()
    sc.render.engine = 'CYCLES'
    sc.cycles.samples = samples
    sc.cycles.max_bounces = 3
    sc.cycles.use_denoising = True
    sc.render.threads_mode = 'FIXED'; sc.render.threads = 2
    sc.render.resolution_x, sc.render.resolution_y = w, h
    sc.view_settings.view_transform = 'AgX'
    sc.view_settings.exposure = 1.0
    sc.render.filepath = out
    sc.render.image_settings.file_format = 'PNG'
    bpy.ops.render.render(write_still=True)


if __name__ == '__main__':
    main(sys.argv[1], *[int(a) for a in sys.argv[2:5]])
