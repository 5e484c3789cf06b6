"""House types of the town: models/town_houses.glb, whose nodes are the parts of each type
(`a_wall`, `a_trim`, …). Scenes give each part a material of theirs.

A house stands with the middle of its front at the origin, facing +Z, and reaches 1.2 m into
the ground, for slopes. Parts: wall, trim (stone: sills, lintels, cornices, steps), frame
(window frames), paint (doors, shutters, shop fronts), roof, and the panes in four groups
`glass_0` … `glass_3`, so that some are lit and some are not; `shop` is the pane of a shop.
"""

import os
import numpy as np
from meshlib import Glb
from town_mesh import Faces
from town_plan import DEPTH

GROUND, UPPER = 3.4, 3.0        # storey heights
FOOT = -1.2
PARTS = ('wall', 'trim', 'frame', 'paint', 'roof', 'glass_0', 'glass_1', 'glass_2', 'glass_3', 'shop')

# width, storeys, style of the windows, roof, what the ground floor has, the side with windows (+X: 1)
TYPES = {
    'a': (6.0, 3, 'lintel', 'gable', 'door', 0),
    'b': (7.8, 3, 'surround', 'gable', 'shop', 0),
    'c': (5.4, 2, 'lintel', 'gable', 'door', 0),
    'd': (8.4, 4, 'surround', 'parapet', 'shop', 0),
    'e': (6.6, 3, 'shutters', 'gable', 'door', 0),
    'f': (7.2, 2, 'shutters', 'dormer', 'door', 0),
    'g': (9.0, 3, 'lintel', 'parapet', 'shop', 0),
    'h': (6.0, 4, 'surround', 'gable', 'door', 0),
    'k': (9.0, 3, 'lintel', 'gable', 'door', 1),
    'm': (9.0, 3, 'surround', 'gable', 'shop', 1),
    'n': (8.4, 4, 'surround', 'parapet', 'shop', 1),
    'p': (9.0, 3, 'lintel', 'gable', 'door', -1),
    'q': (9.0, 3, 'surround', 'gable', 'shop', -1),
    'r': (8.4, 4, 'surround', 'parapet', 'shop', -1),
}


class House:
    def __init__(self):
        self.parts = {p: Faces() for p in PARTS}

    def __getattr__(self, name):
        return self.parts[name]

    def add(self, other, yaw, at):
        for p in PARTS:
            self.parts[p].add(other.parts[p], yaw, at)


def top_of(storeys):
    return GROUND + UPPER * (storeys - 1)


def openings(width, storeys, kind, seed):
    """(what, x0, x1, y0, y1, group) of a front."""
    out = []
    bays = max(1, int(round(width / 2.6)))
    pitch = width / bays
    middles = [-width / 2 + pitch * (k + 0.5) for k in range(bays)]
    if kind == 'door':
        door = seed % bays if bays > 1 else 0
        for k, x in enumerate(middles):
            if k == door:
                out.append(('door', x - 0.52, x + 0.52, 0.15, 2.75, 0))
            else:
                out.append(('window', x - 0.55, x + 0.55, 0.95, 2.55, (k + seed) % 4))
    elif kind == 'shop':
        side = 1 if seed % 2 else -1
        x = side * (width / 2 - 0.95)
        out.append(('door', x - 0.50, x + 0.50, 0.15, 2.75, 0))
        a, b = sorted((-side * (width / 2 - 0.45), x - side * 0.95))
        out.append(('shop', a, b, 0.55, 2.75, 0))
    for s in range(1, storeys):
        y = GROUND + UPPER * (s - 1) + 0.85
        for k, x in enumerate(middles):
            out.append(('window', x - 0.52, x + 0.52, y, y + (1.65 if s < 3 else 1.35), (k + 2 * s + seed) % 4))
    if kind is None:                                            # a side: windows on the ground floor, too
        for k, x in enumerate(middles):
            out.append(('window', x - 0.52, x + 0.52, 0.95, 2.55, (k + seed) % 4))
    return out


def wall(h, width, top, holes):
    """A wall in the plane z = 0 with holes, and their reveals."""
    xs = sorted({-width / 2, width / 2} | {v for o in holes for v in o[1:3]})
    ys = sorted({FOOT, top} | {v for o in holes for v in o[3:5]})
    for x0, x1 in zip(xs, xs[1:]):
        for y0, y1 in zip(ys, ys[1:]):
            x, y = (x0 + x1) / 2, (y0 + y1) / 2
            if not any(o[1] < x < o[2] and o[3] < y < o[4] for o in holes):
                h.wall.face([(x0, y0, 0), (x1, y0, 0), (x1, y1, 0), (x0, y1, 0)])
    for what, x0, x1, y0, y1, _ in holes:
        d = -0.30 if what == 'door' else -0.18
        h.wall.face([(x0, y0, 0), (x0, y0, d), (x0, y1, d), (x0, y1, 0)][::-1])
        h.wall.face([(x1, y0, d), (x1, y0, 0), (x1, y1, 0), (x1, y1, d)][::-1])
        h.wall.face([(x0, y1, d), (x1, y1, d), (x1, y1, 0), (x0, y1, 0)][::-1])


def rect(faces, x0, x1, y0, y1, z, uv=None):
    faces.face([(x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z)], uv)


def room(group):
    """Where a group's room is in the picture of lit rooms: u0, v0 of a quarter."""
    return 0.5 * (group % 2), 0.5 * (group // 2)


def pane(h, x0, x1, y0, y1, z, group):
    u, v = room(group)
    rect(h.parts['glass_%d' % group], x0, x1, y0, y1, z,
         [(u + 0.01, v + 0.49), (u + 0.49, v + 0.49), (u + 0.49, v + 0.01), (u + 0.01, v + 0.01)])


def window(h, x0, x1, y0, y1, group, style):
    z = -0.14
    pane(h, x0, x1, y0, y1, z - 0.02, group)
    f, m = 0.075, (x0 + x1) / 2
    rect(h.frame, x0, x1, y0, y0 + f, z); rect(h.frame, x0, x1, y1 - f, y1, z)
    rect(h.frame, x0, x0 + f, y0 + f, y1 - f, z); rect(h.frame, x1 - f, x1, y0 + f, y1 - f, z)
    rect(h.frame, m - 0.03, m + 0.03, y0 + f, y1 - f, z)
    for t in ((0.36, 0.68) if style == 'lintel' else (0.66,)):
        y = y0 + (y1 - y0) * t
        rect(h.frame, x0 + f, x1 - f, y - 0.02, y + 0.02, z + 0.006)
    h.trim.box(x0 - 0.10, x1 + 0.10, y0 - 0.10, y0 + 0.015, -0.16, 0.09, 'xXYZ')
    if style == 'lintel':
        h.trim.box(x0 - 0.14, x1 + 0.14, y1 + 0.002, y1 + 0.24, -0.01, 0.03, 'xXyZ')
    elif style == 'surround':
        h.trim.box(x0 - 0.14, x0, y0 + 0.015, y1 + 0.14, -0.01, 0.045, 'xZ')
        h.trim.box(x1, x1 + 0.14, y0 + 0.015, y1 + 0.14, -0.01, 0.045, 'XZ')
        h.trim.box(x0, x1, y1 + 0.002, y1 + 0.14, -0.01, 0.045, 'yZ')
        h.trim.box(x0 - 0.20, x1 + 0.20, y1 + 0.14, y1 + 0.22, -0.01, 0.12, 'xXyZ')
    else:
        for s, x in ((-1, x0), (1, x1)):
            a, b = sorted((x + s * 0.04, x + s * 0.56))
            h.paint.box(a, b, y0 + 0.02, y1, 0.0, 0.045, 'xXyZ')
            for t in range(2):
                y = y0 + 0.14 + t * (y1 - y0 - 0.16) / 2
                h.paint.box(a + 0.08, b - 0.08, y, y + (y1 - y0) / 2 - 0.2, 0.04, 0.062, 'yZ')


def door(h, x0, x1, y0, y1, lit):
    z, head = -0.26, y0 + 2.1
    rect(h.paint, x0, x1, y0, head, z)
    m = (x0 + x1) / 2
    for a, b in ((x0 + 0.12, m - 0.06), (m + 0.06, x1 - 0.12)):
        for c, d in ((y0 + 0.2, y0 + 0.85), (y0 + 1.0, head - 0.15)):
            h.paint.box(a, b, c, d, z, z + 0.025, 'xXYZ')
    h.frame.box(x0, x1, head, head + 0.07, z - 0.02, z + 0.06, 'yYZ')
    for a in (x0, x1 - 0.07):
        h.frame.box(a, a + 0.07, y0, y1, z - 0.02, z + 0.05, 'xXZ')
    rect(h.frame, x0 + 0.07, x1 - 0.07, y1 - 0.06, y1, z + 0.02)
    pane(h, x0, x1, head + 0.07, y1, z - 0.01, 0)
    h.trim.box(x0 - 0.20, x1 + 0.20, FOOT, y0, -0.30, 0.32, 'xXYZ')
    h.trim.box(x0 - 0.16, x1 + 0.16, y1 + 0.002, y1 + 0.26, -0.01, 0.07, 'xXyYZ')
    h.trim.box(x0 - 0.24, x1 + 0.24, y1 + 0.26, y1 + 0.34, -0.01, 0.20, 'xXyYZ')


def shop_front(h, x0, x1, y0, y1, width):
    z, n = -0.14, max(2, int(round((x1 - x0) / 1.4)))
    u0, v0 = room(3)
    k = (x1 - x0) / n
    for i in range(n):
        a = x0 + i * k
        rect(h.shop, a, a + k, y0, y1, z,
             [(u0 + 0.01, v0 + 0.49), (u0 + 0.49, v0 + 0.49), (u0 + 0.49, v0 + 0.01), (u0 + 0.01, v0 + 0.01)])
        if i:
            h.paint.box(a - 0.04, a + 0.04, y0, y1, z, z + 0.06, 'xXZ')
    h.paint.box(x0, x1, y1 - 0.50, y1 - 0.44, z, z + 0.05, 'yYZ')
    for a in (x0, x1 - 0.08):
        h.paint.box(a, a + 0.08, y0, y1, z, z + 0.07, 'xXZ')
    h.paint.box(x0 - 0.02, x1 + 0.02, FOOT, y0 + 0.002, -0.1, 0.05, 'xXYZ')         # below the pane
    h.trim.box(x0 - 0.06, x1 + 0.06, y0, y0 + 0.05, -0.1, 0.10, 'xXyYZ')
    w = width / 2 - 0.12
    h.paint.box(-w, w, y1 + 0.08, y1 + 0.58, 0.0, 0.14, 'xXyYZ')                     # the sign board
    h.trim.box(-w - 0.06, w + 0.06, y1 + 0.58, y1 + 0.66, 0.0, 0.26, 'xXyYZ')
    h.frame.box(x0 + 0.1, (x0 + x1) / 2 + 0.9, y1 + 0.24, y1 + 0.42, 0.13, 0.155, 'xXyYZ')   # its lettering, as a bar


def front(width, storeys, style, roof, kind, seed):
    """Everything in and before one wall."""
    h = House()
    top = top_of(storeys)
    holes = openings(width, storeys, kind, seed)
    wall(h, width, top + (0.75 if roof == 'parapet' else 0), holes)
    for what, x0, x1, y0, y1, group in holes:
        if what == 'window':
            window(h, x0, x1, y0, y1, group, style)
        elif what == 'door':
            door(h, x0, x1, y0, y1, True)
        else:
            shop_front(h, x0, x1, y0, y1, width)
    w = width / 2
    if kind != 'shop' and style != 'shutters':
        h.trim.box(-w, w, GROUND - 0.08, GROUND + 0.08, 0, 0.06, 'yYZ')
    if kind == 'door':
        gap = [o for o in holes if o[0] == 'door'][0]
        for a, b in ((-w, gap[1] - 0.2), (gap[2] + 0.2, w)):
            h.trim.box(a, b, FOOT, 0.42, 0, 0.05, 'xXYZ')
    elif kind is None:
        h.trim.box(-w, w, FOOT, 0.42, 0, 0.05, 'YZ')
    if roof == 'parapet':
        h.trim.box(-w, w, top - 0.12, top + 0.06, 0, 0.16, 'xXyYZ')
        h.trim.box(-w, w, top + 0.06, top + 0.18, 0, 0.30, 'xXyYZ')
        for k in range(int(width / 0.9)):
            x = -w + 0.45 + 0.9 * k
            h.trim.box(x - 0.10, x + 0.10, top - 0.36, top - 0.12, 0, 0.13, 'xXZ')
        h.trim.box(-w, w, top + 0.75, top + 0.85, -0.34, 0.06, 'xXyYZz')
    elif kind is not None:
        h.trim.box(-w, w, top - 0.30, top - 0.12, 0, 0.10, 'xXyYZ')
        h.trim.box(-w, w, top - 0.12, top, 0, 0.24, 'xXyYZ')
    return h


def gable_roof(h, width, top, dormer):
    w, over, pitch = width / 2, 0.34, np.tan(np.radians(38))
    ridge = top + DEPTH / 2 * pitch
    eave = top - over * pitch
    for z0, z1 in ((over, -DEPTH / 2), (-DEPTH - over, -DEPTH / 2)):
        a, b = ((-w, eave, z0), (w, eave, z0)) if z0 > z1 else ((w, eave, z0), (-w, eave, z0))
        c, d = ((w, ridge, z1), (-w, ridge, z1)) if z0 > z1 else ((-w, ridge, z1), (w, ridge, z1))
        down = (DEPTH / 2 + over) / np.cos(np.radians(38))
        h.roof.face([a, b, c, d], [(0, down), (width, down), (width, 0), (0, 0)])
    h.trim.box(-w, w, eave - 0.10, eave + 0.05, over - 0.03, over + 0.11, 'xXyYZz')          # gutters
    h.trim.box(-w, w, eave - 0.10, eave + 0.05, -DEPTH - over - 0.11, -DEPTH - over + 0.03, 'xXyYZz')
    h.wall.box(-w, w, ridge - 0.08, ridge + 0.10, -DEPTH / 2 - 0.13, -DEPTH / 2 + 0.13, 'xXYZz')
    for s in (-1, 1):                                                                         # gables
        x = s * w
        tri = [(x, top, 0), (x, top, -DEPTH), (x, ridge, -DEPTH / 2)]
        h.wall.face(tri if s > 0 else tri[::-1])
    if dormer:
        for x in (-width / 4, width / 4):
            y, z = top + 0.25, -0.65
            h.frame.box(x - 0.62, x + 0.62, y, y + 1.35, -2.6, z, 'xXZ')
            pane(h, x - 0.42, x + 0.42, y + 0.12, y + 1.2, z + 0.015, 2)
            rect(h.frame, x - 0.03, x + 0.03, y + 0.12, y + 1.2, z + 0.025)
            for s in (-1, 1):
                slope = [(x, y + 1.95, z + 0.2), (x + s * 0.8, y + 1.27, z + 0.2), (x + s * 0.8, y + 1.27, -3.2),
                         (x, y + 1.95, -3.2)]
                h.roof.face(slope if s > 0 else slope[::-1], [(0, 0), (0, 1.05), (2.6, 1.05), (2.6, 0)] if s > 0
                            else [(2.6, 0), (2.6, 1.05), (0, 1.05), (0, 0)])
            h.frame.face([(x - 0.62, y + 1.35, z), (x + 0.62, y + 1.35, z), (x, y + 1.9, z)])
    return ridge


def chimney(h, x, z, y0, y1, pots):
    h.wall.box(x - 0.55, x + 0.55, y0, y1, z - 0.32, z + 0.32, 'xXzZ')
    h.trim.box(x - 0.62, x + 0.62, y1, y1 + 0.14, z - 0.39, z + 0.39)
    for k in range(pots):
        h.roof.prism(x + (k - (pots - 1) / 2) * 0.34, z, 0.13, y1 + 0.14, y1 + 0.60, 5, 0.10)


def house(name):
    width, storeys, style, roof, kind, side = TYPES[name]
    seed = ord(name)
    h = front(width, storeys, style, roof, kind, seed)
    w, top = width / 2, top_of(storeys)
    if side:
        h.add(front(DEPTH, storeys, style, roof, None, seed), 90 * side, (side * w, 0, -DEPTH / 2))
    h.wall.box(-w, w, FOOT, top + (0.75 if roof == 'parapet' else 0), -DEPTH, 0, {0: 'xX', 1: 'x', -1: 'X'}[side])
    h.add(back(width, storeys, style, roof, seed), 180, (0, 0, -DEPTH))
    if roof == 'parapet':
        h.roof.face([(-w, top + 0.3, 0), (w, top + 0.3, 0), (w, top + 0.3, -DEPTH), (-w, top + 0.3, -DEPTH)])
        h.wall.box(-w, w, top, top + 0.75, -0.34, 0.0, 'z')
        chimney(h, w - 1.0, -DEPTH + 1.2, top, top + 2.0, 3)
        h.wall.box(-w + 0.8, -w + 3.0, top, top + 2.0, -DEPTH + 1, -DEPTH + 3.5, 'xXzZY')
    else:
        ridge = gable_roof(h, width, top, roof == 'dormer')
        chimney(h, w - 0.75, -DEPTH / 2 - 0.6, top + 1, ridge + 0.9, 3)
        if storeys > 2:
            chimney(h, -w + 0.75, -DEPTH / 2 + 0.7, top + 1, ridge + 0.7, 2)
    return h


def back(width, storeys, style, roof, seed):
    """The wall toward the court: panes in it, and no more."""
    h = House()
    top = top_of(storeys) + (0.75 if roof == 'parapet' else 0)
    w = width / 2
    rect(h.wall, -w, w, FOOT, top, 0)
    for s in range(storeys):
        y = 0.9 + (GROUND + UPPER * (s - 1) if s else 0)
        for x in (-w / 2, w / 2):
            pane(h, x - 0.5, x + 0.5, y, y + 1.5, 0.02, (s + seed) % 4)
            for a, b, c, d in ((-0.56, 0.56, -0.06, 0.04), (-0.56, 0.56, 1.46, 1.56), (-0.03, 0.03, 0.04, 1.46),
                               (-0.5, 0.5, 0.95, 1.0)):
                rect(h.frame, x + a, x + b, y + c, y + d, 0.035)
    return h


def build(path):
    g = Glb()
    names = PARTS
    material = {p: g.material(p, color=(0.5, 0.5, 0.5, 1), metallic=0, roughness=0.8) for p in names}
    counts = {}
    root = g.node('town_houses')
    for k, name in enumerate(TYPES):
        h = house(name)
        counts[name] = [p for p in PARTS if h.parts[p]]
        at = g.node(name, None, (12.0 * k, 0, 0), None, root)       # side by side, to look at them
        for p in counts[name]:
            g.node('%s_%s' % (name, p), g.mesh('%s_%s' % (name, p), [(h.parts[p].part(), material[p])]), parent=at)
    front_roof = House()                    # for the model facade.glb, which is a front alone
    ridge = gable_roof(front_roof, 12.4, 6.3, False)
    for x in (-5.4, 5.4):
        chimney(front_roof, x, -DEPTH / 2 - 0.7, 7, ridge + 0.9, 3)
    for p in ('wall', 'trim', 'roof'):
        g.node('front_' + p, g.mesh('front_' + p, [(front_roof.parts[p].part(), material[p])]),
               (12.0 * len(TYPES) + 4, 0, 0), parent=root)
    g.save(path)
    return counts


if __name__ == '__main__':
    here = os.path.dirname(os.path.abspath(__file__))
    print(build(os.path.join(here, '..', 'models', 'town_houses.glb')))
