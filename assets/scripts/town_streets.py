"""What lies on the ground of the town: models/town_streets.glb. Pavements and kerbs of the
blocks (nodes `pavement_…`, `kerb_…`; all but the hill's around the block's middle), the two
streets that climb (`hill_x`, `hill_z`) and the lines painted on the streets (`lines_…`).
Level carriageways are plain rectangles in the scene file."""

import os
import numpy as np
from meshlib import Glb
from town_mesh import Faces, kerb, outline, sheet, steps
from town_plan import *

KERB_WIDTH = 0.15
PAINT = 0.008           # how far the lines lie above the road
ZEBRA = (0.5, 3.5)      # from the junction's edge
STOP_LINE = 4.3
FLAT = lambda x, z: 0.0


def junction_kind(i, j):
    """'bend', 'tee' or 'cross': column i, row j."""
    sides = (0 < i < len(COLUMNS) - 1) + (0 < j < len(ROWS) - 1)
    return ('bend', 'tee', 'cross')[sides]


def pavement(x0, x1, z0, z1, height, step):
    """Ring of slabs inside a block's kerb, and the kerb."""
    slabs, stone = Faces(), Faces()
    r, w = CORNER, KERB_WIDTH
    for xs, zs in (((x0 + r, x1 - r), (z0 + w, z0 + r)), ((x0 + r, x1 - r), (z1 - r, z1 - w)),
                   ((x0 + w, x0 + r), (z0 + r, z1 - r)), ((x1 - r, x1 - w), (z0 + r, z1 - r))):
        sheet(slabs, steps(*xs, step), steps(*zs, step), height, KERB)
    edge = outline(x0, x1, z0, z1, r, 9, step)
    inner = outline(x0 + w, x1 - w, z0 + w, z1 - w, r - w, 9)
    for k in range(4):
        arc = inner[9 * k:9 * k + 9]
        cx, cz = ((x1 - r, z0 + r), (x1 - r, z1 - r), (x0 + r, z1 - r), (x0 + r, z0 + r))[k]
        centre = (cx, height(cx, cz) + KERB, cz)
        for a, b in zip(arc, arc[1:]):
            slabs.face([centre, (b[0], height(*b) + KERB, b[1]), (a[0], height(*a) + KERB, a[1])])
    kerb(stone, edge, True, height, KERB)
    return slabs, stone


def outer(side):
    """The pavement outside of the ring, with its kerb: side n, e, s or w."""
    slabs, stone = Faces(), Faces()
    w, e = COLUMNS[0].at - COLUMNS[0].low, COLUMNS[-1].at + COLUMNS[-1].high
    n, s = ROWS[0].at - ROWS[0].low, ROWS[-1].at + ROWS[-1].high
    p, k = COLUMNS[0].pavement, KERB_WIDTH
    xs, zs = steps(w - p, e + p, 2.5), steps(n - k, s + k, 2.5)
    if side in 'ns':
        z = (n - p, n - k) if side == 'n' else (s + k, s + p)
        sheet(slabs, xs, z, height, KERB)
        line = [(x, n if side == 'n' else s) for x in steps(w, e, 2.5)]
        kerb(stone, line[::-1] if side == 'n' else line, False, height, KERB)
    else:
        x = (w - p, w - k) if side == 'w' else (e + k, e + p)
        sheet(slabs, x, zs, height, KERB)
        line = [(w if side == 'w' else e, z) for z in steps(n, s, 2.5)]
        kerb(stone, line if side == 'w' else line[::-1], False, height, KERB)
    return slabs, stone


class Lines:
    """Paint on a street: places along it, offsets across it."""

    def __init__(self, street, along):
        self.street, self.along, self.faces = street, along, Faces()

    def rect(self, s0, s1, o0, o1):
        s, o = steps(s0, s1, 2.0), sorted((self.street.at + o0, self.street.at + o1))
        xs, zs = (s, o) if self.along == 'x' else (o, s)
        sheet(self.faces, xs, zs, height, PAINT)

    def dashes(self, s0, s1, offset, on, off, width=0.12):
        n = int((s1 - s0 + off) / (on + off))
        start = (s0 + s1 - n * (on + off) + off) / 2
        for k in range(n):
            a = start + k * (on + off)
            self.rect(a, a + on, offset - width / 2, offset + width / 2)


def lines(street, along, k, a, b):
    out = Lines(street, along)
    index = (ROWS if along == 'x' else COLUMNS).index(street)
    ends = [(k, index), (k + 1, index)] if along == 'x' else [(index, k), (index, k + 1)]
    half = street.lanes * LANE
    for (i, j), at, way in ((ends[0], a, 1), (ends[1], b, -1)):
        if junction_kind(i, j) == 'bend':
            continue
        o = -street.low + 0.45
        while o + 0.5 < street.high - 0.2:                            # zebra
            out.rect(*sorted((at + way * ZEBRA[0], at + way * ZEBRA[1])), o, o + 0.5)
            o += 1.0
        # traffic that leaves the segment here keeps to its right
        right = -1 if (along == 'x') == (way > 0) else 1
        out.rect(*sorted((at + way * STOP_LINE, at + way * (STOP_LINE + 0.4))), *sorted((right * 0.1, right * half)))
    s0, s1 = a + 5.2, b - 5.2
    if street.surface == 'asphalt':
        if street.lanes == 1:
            out.dashes(s0, s1, 0, 2.0, 2.0)
        else:
            out.rect(s0, s1, -0.17, -0.06)
            out.rect(s0, s1, 0.06, 0.17)
            for o in (-LANE, LANE):
                out.dashes(s0, s1, o, 3.0, 3.0)
        for o in (-half, half):
            out.dashes(s0, s1, o, 1.0, 1.0, 0.10)
    if street.parking:
        sign = -1 if street.parking == 'low' else 1
        inner, kerb_at = sign * (half + MARGIN), -street.low if sign < 0 else street.high
        out.rect(a + 9, b - 9, inner - 0.05, inner + 0.05)
        for s in parking_bays(a, b):
            out.rect(s - 0.05, s + 0.05, *sorted((inner, kerb_at)))
    return out.faces


def parking_bays(a, b):
    """Where bays of 6 m meet along a segment."""
    n = int((b - a - 18) / 6)
    start = (a + b - 6 * n) / 2
    return [start + 6 * k for k in range(n + 1)]


def segment_name(street, along, k):
    return '%s_%d_%d' % ('row' if along == 'x' else 'column', (ROWS if along == 'x' else COLUMNS).index(street), k)


def build(path):
    g = Glb()
    material = {n: g.material(n, color=(0.5, 0.5, 0.5, 1), metallic=0, roughness=0.8)
                for n in ('paving', 'kerb', 'asphalt', 'paint')}
    root = g.node('town_streets')

    def add(name, faces, kind):
        g.node(name, g.mesh(name, [(faces.part(), material[kind])]), parent=root)
    names = ['north', 'middle', 'south']
    for j, name in enumerate(names):
        b = BLOCKS[4 * j]
        x, z = (b.kx1 - b.kx0) / 2, (b.kz1 - b.kz0) / 2
        slabs, stone = pavement(-x, x, -z, z, FLAT, 1e9)
        add('pavement_' + name, slabs, 'paving')
        add('kerb_' + name, stone, 'kerb')
    b = next(b for b in BLOCKS if b.hilly)
    slabs, stone = pavement(b.kx0, b.kx1, b.kz0, b.kz1, height, 2.0)
    add('pavement_hill', slabs, 'paving')
    add('kerb_hill', stone, 'kerb')
    for side in 'nesw':
        slabs, stone = outer(side)
        add('pavement_outer_' + side, slabs, 'paving')
        add('kerb_outer_' + side, stone, 'kerb')
    for street, along, k, a, b in segments():
        if climbs(street, along, k):
            road = Faces()
            across = steps(street.at - street.low, street.at + street.high, 4.0)
            xs, zs = (steps(a, b, 2.0), across) if along == 'x' else (across, steps(a, b, 2.0))
            sheet(road, xs, zs, height, 0.0)
            add('hill_' + along, road, 'asphalt')
        painted = lines(street, along, k, a, b)
        if painted:
            add('lines_' + segment_name(street, along, k), painted, 'paint')
    g.save(path)


if __name__ == '__main__':
    build(os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', 'models', 'town_streets.glb'))
