"""The text of scenes/town.ron: materials, meshes, light, cameras, and what the other scripts place."""

import os
import re
import numpy as np
from check import read
from town_houses import PARTS
from town_plan import LANE, height
from town_traffic import right_of

HEAD = '''// A town at night, with its traffic. Written by assets/scripts/make_town.py; change it there.
(
    seed: 11,
    piece_metres: 6,
    environment: (
        ambient: (0.040, 0.052, 0.090),
        zenith: (0.002, 0.007, 0.034), horizon: (0.060, 0.085, 0.150), ground: (0.008, 0.011, 0.020),
        exposure: 1.5, tone_map: aces,
    ),
'''

# tiles: metres that one covers, its depth in widths
TILES = {'cobble': (1.44, 0.033), 'asphalt': (3.2, 0.0031), 'paving': (2.4, 0.0058), 'concrete': (1.5, 0.0053),
         'brick': (1.8, 0.0117), 'plaster': (2.0, 0.006), 'tiles': (1.8, 0.0167)}
# name: (tiles or None, base factor, specular factor, shininess, normal scale)
MATERIALS = {
    'cobble': ('cobble', (1, 1, 1), 1.3, 48, 1.5),
    'asphalt': ('asphalt', (1.9, 1.9, 2.0), 1.5, 44, 1.6),
    'paving': ('paving', (0.85, 0.85, 0.85), 0.7, 30, 1.3),
    'kerb': ('concrete', (0.75, 0.76, 0.80), 0.5, 24, 1.5),
    'lines': (None, (0.52, 0.51, 0.47), 0.25, 30, 1),
    'stone': ('concrete', (1.0, 0.95, 0.86), 0.3, 16, 1.2),
    'stone dark': ('concrete', (0.55, 0.52, 0.48), 0.3, 16, 1.2),
    'brick red': ('brick', (1, 1, 1), 0.35, 20, 1.6),
    'brick brown': ('brick', (0.70, 0.62, 0.58), 0.35, 20, 1.6),
    'brick yellow': ('brick', (1.15, 1.25, 1.05), 0.35, 20, 1.6),
    'plaster cream': ('plaster', (1.0, 0.95, 0.82), 0.2, 12, 1.5),
    'plaster ochre': ('plaster', (0.95, 0.70, 0.40), 0.2, 12, 1.5),
    'plaster rose': ('plaster', (0.90, 0.58, 0.50), 0.2, 12, 1.5),
    'plaster grey': ('plaster', (0.66, 0.68, 0.70), 0.2, 12, 1.5),
    'plaster blue': ('plaster', (0.50, 0.62, 0.74), 0.2, 12, 1.5),
    'tiles red': ('tiles', (0.9, 0.85, 0.85), 0.6, 24, 1.5),
    'tiles grey': ('tiles', (0.42, 0.55, 0.75), 0.8, 30, 1.5),
    'frame white': (None, (0.62, 0.60, 0.55), 0.2, 30, 1),
    'frame dark': (None, (0.045, 0.055, 0.045), 0.3, 40, 1),
    'paint green': (None, (0.025, 0.075, 0.045), 0.35, 50, 1),
    'paint red': (None, (0.16, 0.020, 0.016), 0.35, 50, 1),
    'paint blue': (None, (0.020, 0.045, 0.11), 0.35, 50, 1),
    'paint black': (None, (0.018, 0.018, 0.020), 0.4, 60, 1),
    'paint brown': (None, (0.10, 0.045, 0.020), 0.35, 40, 1),
}
EXTRA = '''        "glass dark": (shading: blinn, base_factor: (0.012, 0.016, 0.024), specular_factor: (0.9, 0.9, 0.9), shininess: 90, technique: off),
        // Panes glow by themselves and hardly show the lamps outside.
        "glass warm": (shading: metallic_roughness, metallic: 0, roughness: 0.15, base_factor: (0.02, 0.02, 0.02), technique: off, emissive_map: "../textures/town_rooms.jpg", emissive_factor: (1.0, 0.74, 0.42)),
        "glass dim": (shading: metallic_roughness, metallic: 0, roughness: 0.15, base_factor: (0.02, 0.02, 0.02), technique: off, emissive_map: "../textures/town_rooms.jpg", emissive_factor: (0.34, 0.20, 0.09)),
        "glass white": (shading: metallic_roughness, metallic: 0, roughness: 0.15, base_factor: (0.02, 0.02, 0.02), technique: off, emissive_map: "../textures/town_rooms.jpg", emissive_factor: (0.62, 0.56, 0.46)),
        "glass blue": (shading: metallic_roughness, metallic: 0, roughness: 0.15, base_factor: (0.02, 0.02, 0.02), technique: off, emissive_map: "../textures/town_rooms.jpg", emissive_factor: (0.20, 0.32, 0.55)),
        "glass shop": (shading: metallic_roughness, metallic: 0, roughness: 0.15, base_factor: (0.02, 0.02, 0.02), technique: off, emissive_map: "../textures/town_rooms.jpg", emissive_factor: (0.95, 0.80, 0.56)),
        "copper": (
            shading: metallic_roughness, metallic: 1, roughness: 0.34,
            base_map: "../textures/copper_base.jpg", normal_map: "../textures/copper_normal.png",
            height_map: "../textures/copper_height.png", height_scale_uv: 0.0086,
        ),
        "earth": (shading: blinn, base_factor: (0.02, 0.022, 0.018), specular_factor: (0, 0, 0), technique: off),
'''
CAMERAS = '''        (name: "town", camera: (fov_y_degrees: 38), transform: (translation: (0.9, 4.7, 52.5), look_at: (-3.2, 3.3, 6))),
        (name: "street", camera: (fov_y_degrees: 46), transform: (translation: (-15.0, 1.6, -9.0), look_at: (-45, 2.3, -5.4))),
        (name: "square", camera: (fov_y_degrees: 48), transform: (translation: (-14.6, 1.7, 37.6), look_at: (-25.2, 3.1, 21))),
        (name: "above", camera: (fov_y_degrees: 46), transform: (translation: (14, 40, 108), look_at: (-8, 0, 18))),
        (name: "hill", camera: (fov_y_degrees: 32), transform: (translation: (84, 2.0, -68.2), look_at: (166, 5.2, -74))),
'''
LIGHTS = {
    'low lamp': 'spot(color: (1.0, 0.60, 0.26), intensity: 42, range: 15, inner_degrees: 30, outer_degrees: 80, '
                'shadows: true)',
    'tall lamp': 'spot(color: (1.0, 0.62, 0.29), intensity: 85, range: 21, inner_degrees: 30, outer_degrees: 78, '
                 'shadows: true)',
    'shop': 'point(color: (1.0, 0.74, 0.44), intensity: 5, range: 6, shadows: true)',
    'fountain': 'point(color: (1.0, 0.82, 0.58), intensity: 2.2, range: 5)',
    'shelter': 'point(color: (1.0, 0.90, 0.72), intensity: 5, range: 6, shadows: true)',
}
# What shines in a lamp, and is in its light's way.
GLASS = {'lamp_post': 'lamp_glass', 'wall_lamp': 'lamp_glass', 'town_shelter': 'tube'}
THINGS = ('signal', 'tree', 'shelter', 'bench', 'basin')


def num(x):
    return (('%.3f' % x).rstrip('0').rstrip('.').replace('-0', '0') if abs(x) < 5e-4
            else ('%.3f' % x).rstrip('0').rstrip('.'))


def vec(v):
    return '(%s)' % ', '.join(num(float(x)) for x in v)


def place(x, y, z, yaw=0.0, scale=1.0):
    yaw = (yaw + 180) % 360 - 180
    out = 'transform: (translation: %s' % vec((x, y, z))
    if abs(yaw) > 1e-3:
        out += ', rotation_degrees: %s' % vec((0, yaw, 0))
    if scale != 1:
        out += ', scale: %s' % num(scale)
    return out + ')'


def material(name):
    tile, base, spec, shine, bump = MATERIALS[name]
    head = ('        "%s": (shading: blinn, base_factor: %s, specular_factor: %s, shininess: %d'
            % (name, vec(base), vec((spec,) * 3), shine))
    if tile is None:
        return head + ', technique: off),\n'
    size, depth = TILES[tile]
    t = '../textures/' + tile
    return (head + ', normal_scale: %s, uv: (scale: (%.5f, %.5f)),\n' % (num(bump), 1 / size, 1 / size)
            + '            base_map: "%s_base.jpg", normal_map: "%s_normal.png", specular_map: "%s_specular.png",\n'
            % (t, t, t)
            + '            height_map: "%s_height.png", height_scale_uv: %s),\n' % (t, depth))


class Scene:
    def __init__(self, models):
        self.models, self.meshes, self.entities = models, {}, []

    def mesh(self, name, definition):
        self.meshes[name] = definition
        return name

    def model(self, file, node=None):
        name = node or file
        fields = ', node: "%s"' % node if node else ''
        if file in GLASS:
            fields += ', casts_no_shadow: ["%s"]' % GLASS[file]
        return self.mesh(name, 'model(file: "../models/%s.glb"%s)' % (file, fields))

    def raw(self, text):
        self.entities.append(text)

    def ground(self, node, material, at):
        self.raw('(mesh: "%s", material: "%s", ground: true, piece_metres: 2.5, %s),'
                 % (self.model('town_streets', node), material, place(*at)))

    def lines(self, node):
        self.raw('(mesh: "%s", material: "lines", piece_metres: 3),' % self.model('town_streets', node))

    def plane(self, x, z, material, at, yaw):
        name = self.mesh('plane %sx%s' % (num(x), num(z)), 'plane(size: (%s, %s), tile_metres: 1)' % (num(x), num(z)))
        self.raw('(mesh: "%s", material: "%s", ground: true, piece_metres: 2.5, %s),'
                 % (name, material, place(*at, yaw)))

    def house(self, kind, materials, at, lights):
        parts = [p for p in PARTS if p in self.parts(kind)]
        name = lambda p: self.model('town_houses', '%s_%s' % (kind, p))
        children = ['(mesh: "%s", material: "%s")' % (name(p), materials[p]) for p in parts if p != 'wall'] + lights
        self.raw('(mesh: "%s", material: "%s", %s, children: [%s]),'
                 % (name('wall'), materials['wall'], at, ', '.join(children)))

    def parts(self, kind):
        if not hasattr(self, 'known'):
            self.known = {n['name'] for n in read(os.path.join(self.models, 'town_houses.glb'))[0]['nodes']}
        return [p for p in PARTS if '%s_%s' % (kind, p) in self.known]

    def facade(self, at):
        self.model('facade')
        self.mesh('behind a front', 'cube(size: (12.4, 6.55, 8.6), tile_metres: 1)')
        self.model('wall_lamp')
        for p in ('wall', 'trim', 'roof'):
            self.model('town_houses', 'front_' + p)
        self.raw('(mesh: "facade", %s, children: [(mesh: "front_wall", material: "brick red"), '
                 '(mesh: "front_roof", material: "tiles red"), (mesh: "front_trim", material: "stone dark"), '
                 '(mesh: "behind a front", material: "brick red", transform: (translation: (0, 3.275, -4.67))), '
                 '(mesh: "wall_lamp", transform: (translation: (1.35, 3.0, 0)), '
                 'attach: [(node: "lamp", light: "shop")]), '
                 '(mesh: "wall_lamp", transform: (translation: (-3.1, 3.5, 0.1)), '
                 'attach: [(node: "lamp", light: "shop")])]),' % at)

    def lamp(self, at, tall):
        self.model('lamp_post')
        if tall:
            at = at[:-1] + ', scale: 1.4)'
        self.raw('(mesh: "lamp_post", %s, attach: [(node: "lamp", light: "%s")]),'
                 % (at, 'tall lamp' if tall else 'low lamp'))

    def signal(self, at, signal, group):
        self.raw('(mesh: "%s", signal_head: (signal: "%s", group: %d), %s),'
                 % (self.model('town_signal'), signal, group, at))

    def thing(self, name, at, attach=None):
        self.raw('(mesh: "%s", %s%s),' % (self.model('town_' + name), at, ', attach: [%s]' % attach if attach else ''))

    def write(self, path, traffic, still):
        self.model('kettle')
        self.raw('(name: "evening sky", light: directional(color: (0.34, 0.50, 1.0), intensity: 0.14, shadows: true), '
                 'transform: (translation: (-6, 7, 5), look_at: (0, 0, 0))),')
        vehicles = self.standing(traffic) if still else self.driving(traffic)
        text = HEAD + '    vehicle_types: ["../vehicles.ron"],\n' + ('' if still else self.roads(traffic))
        text += '    materials: {\n' + ''.join(material(m) for m in MATERIALS) + EXTRA + '    },\n'
        body = '\n'.join('        ' + e for e in self.entities + vehicles)
        if still:
            body = re.sub(r' ground: true,| signal_head: \([^)]*\),', '', body)
        for name, light in LIGHTS.items():
            body = body.replace('light: "%s"' % name, 'light: ' + light)
        text += '    meshes: {\n' + ''.join('        "%s": %s,\n' % m for m in self.meshes.items()) + '    },\n'
        text += '    entities: [\n' + CAMERAS + body + '\n    ],\n)\n'
        with open(path, 'w') as f:
            f.write(text)

    def roads(self, traffic):
        out = '    signals: {\n'
        for name, (greens, offset) in traffic.signals.items():
            out += ('        "%s": (green_seconds: %s, amber_seconds: 3, red_seconds: 1, offset_seconds: %d),\n'
                    % (name, greens, offset))
        out += '    },\n    routes: {\n'
        for r in traffic.routes:
            points = ', '.join(vec((x, height(x, z) + r.lift, z)) for x, z in r.points)
            fields = ['points: [%s]' % points, 'shape: ' + r.shape] + (['closed: true'] if r.closed else [])
            fields += ['%s: %s' % (k, v) for k, v in r.fields.items()]
            if r.stops:
                clear = lambda metres: ', keep_clear: %s' % num(metres) if metres else ''
                stops = ['(at: %s, signal: "%s", group: %d%s)' % (num(a), s, g, clear(c)) for a, s, g, c in r.stops]
                fields.append('stops: [%s]' % ', '.join(stops))
            if r.then:
                fields.append('then: [%s]' % ', '.join('"%s"' % t for t in r.then))
            out += '        "%s": (%s),\n' % (r.name, ', '.join(fields))
        return out + '    },\n'

    def driving(self, traffic):
        out = []
        for kind, paint, r, at, lane, kmh in traffic.vehicles:
            lamps = '' if kind == 'person' else ', headlights: low'
            out.append('(vehicle: (type: "%s", paint: %d, route: "%s", at: %s, lane: %d, speed_kmh: %d%s)),'
                       % (kind, paint, r.name, num(at), lane, kmh, lamps))
        return out + self.parked(traffic)

    def standing(self, traffic):
        """Everybody where they start, without routes."""
        out = []
        for kind, paint, r, at, lane, _ in traffic.vehicles:
            p, t = r.place(at)
            if r.fields['lanes'] > 1:
                p = p + right_of(r.heading) * LANE * (0.5 - lane)
            yaw = np.degrees(np.arctan2(t[0], t[1]))
            out.append('(vehicle: (type: "%s", paint: %d), %s),'
                       % (kind, paint, place(p[0], float(height(*p)) + r.lift, p[1], yaw)))
        return out + self.parked(traffic)

    def parked(self, traffic):
        return ['(vehicle: (type: "%s", paint: %d, headlights: off), %s),' % (kind, paint, place(x, 0, z, yaw))
                for kind, paint, x, z, yaw in traffic.parked()]
