"""The night town: scenes/town.ron and its models. `make_town.py --still FILE.ron` writes a scene
of the same town without traffic, its vehicles standing where they start, for a first look."""

import os
import sys
import numpy as np
import texlib as tx
import town_houses
import town_streets
import town_things
from town_plan import *
from town_scene import Scene, place
from town_traffic import AHEAD, Traffic, check, right_of

HERE = os.path.dirname(os.path.abspath(__file__))
# types for the beginning of a row, and for its end: their windows are in the side that is seen
FIRST, LAST = 'kmn', 'pqr'


def rooms(path, n=128):
    """Four lit rooms behind old glass: curtains and a lamp; a picture and a shelf; a blind half
    down; a shop's shelves."""
    u, v = tx.coords(n)
    near = lambda x, y, r: np.exp(-(((u - x) / r) ** 2 + ((v - y) / r) ** 2))
    out = []
    wall = tx.mix(tx.rgb('6e3f1e'), tx.rgb('ffd9a0'), near(0.5, 0.25, 0.45))
    drape = (tx.smooth(0.30, 0.20, np.minimum(u, 1 - u) * (1 + 0.4 * v))
             * (0.8 + 0.2 * np.sin(u * 80 + 2 * np.sin(v * 5))))
    out.append(tx.mix(wall, tx.rgb('7a3a24') * (0.5 + 0.6 * near(0.5, 0.25, 0.5))[..., None],
                      0.8 * np.clip(drape, 0, 1)))
    wall = tx.mix(tx.rgb('70502c'), tx.rgb('ffdfae'), near(0.75, 0.35, 0.4))
    shelf = ((np.abs(v - 0.55) < 0.03) | (np.abs(v - 0.8) < 0.03)) & (u < 0.55)
    books = (u < 0.55) & (v > 0.6) & (v < 0.78) & (np.sin(u * 90 + 3 * np.sin(u * 31)) > -0.4)
    art = (np.abs(u - 0.28) < 0.16) & (np.abs(v - 0.28) < 0.13)
    wall = np.where((shelf | books)[..., None], wall * 0.35, wall)
    out.append(np.where(art[..., None], wall * np.array([0.5, 0.6, 0.75]), wall))
    blind = v < 0.48 + 0.004 * np.sin(u * 60)
    wall = tx.mix(tx.rgb('7c4d22'), tx.rgb('ffcf8a'), near(0.4, 0.7, 0.5))
    out.append(np.where(blind[..., None], tx.rgb('d8b078') * (0.55 + 0.25 * near(0.45, 0.4, 0.5))[..., None]
                        * (1 + 0.05 * np.sin(v * 150))[..., None], wall))
    wall = tx.mix(tx.rgb('9a6a38'), tx.rgb('fff0d0'), np.clip(near(0.3, 0.1, 0.35) + near(0.75, 0.1, 0.35), 0, 1))
    boards = np.zeros((n, n), bool)
    goods = np.zeros((n, n))
    for k, y in enumerate((0.36, 0.56, 0.76, 0.95)):
        boards |= np.abs(v - y) < 0.012
        col = np.floor(u * (14 + 3 * k))
        tall = 0.06 + 0.09 * tx.hash01(col.astype(int), k, 5)
        goods = np.where((v < y - 0.012) & (v > y - tall) & (tx.hash01(col.astype(int), k, 6) > 0.2), 1 + col + 40 * k,
                         goods)
    hue = np.stack([tx.hash01(goods.astype(int), 1, 7 + c) for c in range(3)], -1)
    wall = np.where((goods > 0)[..., None], wall * (0.25 + 0.6 * hue), wall)
    out.append(np.where(boards[..., None], wall * 0.4, wall))
    image = np.concatenate([np.concatenate(out[:2], 1), np.concatenate(out[2:], 1)])
    tx.save_jpg(path, np.clip(image * (1 + 0.03 * tx.noise(2 * n, 901, 1.2, 2, 30))[..., None], 0, 1))


# ------------------------------------------------------------------ houses

WALLS = {'lintel': ['brick red', 'brick brown', 'brick red', 'brick yellow'],
         'surround': ['plaster cream', 'plaster ochre', 'plaster rose', 'plaster grey', 'brick brown'],
         'shutters': ['plaster cream', 'plaster rose', 'plaster blue', 'brick red']}
PAINTS = ['paint green', 'paint red', 'paint blue', 'paint black', 'paint brown']
DARK = ['glass dark'] * 11
LIT = ['glass warm'] * 5 + ['glass dim'] * 3 + ['glass white', 'glass blue']


def fill(length, rng, first=None, last=None):
    """Types of houses side by side, of this length together, no two alike in a row."""
    width = {k: int(round(v[0] / 0.6)) for k, v in town_houses.TYPES.items()}
    names = [k for k in width if k not in FIRST + LAST]

    def go(rest, row):
        if rest == 0:
            return row
        for k in rng.permutation(names):
            if width[k] <= rest and (not row or row[-1] != k):
                found = go(rest - width[k], row + [k])
                if found is not None:
                    return found
        return None
    ends = [k for k in (first, last) if k]
    middle = go(int(round(length / 0.6)) - sum(width[k] for k in ends), [first] if first else [])
    return middle + ([last] if last else [])


def row(scene, start, heading, length, rng, first=None, last=None):
    """A terrace: from `start` (x, z) along a heading, its fronts to the left of that."""
    d = np.array(heading, float)
    left = np.array([d[1], -d[0]])
    yaw = np.degrees(np.arctan2(left[0], left[1]))
    at, before = 0.0, None
    for kind in fill(length, rng, first, last):
        width, _, style, _, ground, _ = town_houses.TYPES[kind]
        p = np.array(start) + d * (at + width / 2)
        ends = [np.array(start) + d * (at + t * width) for t in (0, 0.5, 1)]
        y = max(float(height(*e)) for e in ends) + KERB
        wall = rng.choice([w for w in WALLS[style] if w != before])
        paint, before = rng.choice(PAINTS), wall
        frame = 'frame white' if rng.random() < 0.75 else 'frame dark'
        materials = dict(wall=wall, trim='stone' if rng.random() < 0.7 else 'stone dark', frame=frame, paint=paint,
                         roof='tiles red' if rng.random() < 0.6 else 'tiles grey', shop='glass shop')
        for k in range(4):
            materials['glass_%d' % k] = rng.choice(DARK + LIT)
        lights = []
        if ground == 'shop':
            side = 1 if ord(kind) % 2 else -1
            lights = ['(transform: (translation: (%g, 2.1, 0.9)), light: "shop")' % (-side * 0.7)]
        scene.house(kind, materials, place(p[0], y, p[1], yaw), lights)
        at += width


def block_rows(scene, b, rng):
    ends = lambda: (str(rng.choice(list(FIRST))), str(rng.choice(list(LAST))))
    inner = BLOCK_Z - 2 * DEPTH
    if b.square:
        sx0, _, _, sz1 = square()
        row(scene, (b.x0, b.z0), (1, 0), BLOCK_X - SQUARE_X, rng, *ends())
        row(scene, (sx0, b.z0 + DEPTH), (0, 1), SQUARE_Z - DEPTH, rng)
        row(scene, (sx0, sz1), (1, 0), SQUARE_X - DEPTH, rng)
        row(scene, (b.x1 - DEPTH, sz1), (1, 0), DEPTH, rng, None, 'p')
        row(scene, (b.x1, sz1 + DEPTH), (0, 1), inner - SQUARE_Z, rng)
    else:
        row(scene, (b.x0, b.z0), (1, 0), BLOCK_X, rng, *ends())
        row(scene, (b.x1, b.z0 + DEPTH), (0, 1), inner, rng)
    row(scene, (b.x1, b.z1), (-1, 0), BLOCK_X, rng, *ends())
    if (b.i, b.j) == (2, 1):
        brick_fronts(scene, b)
    else:
        row(scene, (b.x0, b.z1 - DEPTH), (0, -1), inner, rng)


def brick_fronts(scene, b):
    """The row with all its relief, beside the opening view."""
    z = b.z0 + DEPTH
    for k in range(3):
        scene.facade(place(b.x0, KERB, z + 12.4 * (k + 0.5), -90))


def houses(scene, rng):
    for b in BLOCKS:
        block_rows(scene, b, rng)
    w, e = (COLUMNS[0].at - COLUMNS[0].low - COLUMNS[0].pavement,
            COLUMNS[-1].at + COLUMNS[-1].high + COLUMNS[-1].pavement)
    n, s = ROWS[0].at - ROWS[0].low - ROWS[0].pavement, ROWS[-1].at + ROWS[-1].high + ROWS[-1].pavement
    row(scene, (e, n), (-1, 0), round((e - w) / 0.6) * 0.6, rng)
    row(scene, (w, s), (1, 0), round((e - w) / 0.6) * 0.6, rng)
    row(scene, (w, n), (0, 1), round((s - n) / 0.6) * 0.6, rng)
    row(scene, (e, s), (0, -1), round((s - n) / 0.6) * 0.6, rng)


# ------------------------------------------------------------------ streets and what stands there

def ground(scene):
    for street, along, k, a, b in segments():
        name = town_streets.segment_name(street, along, k)
        if climbs(street, along, k):
            scene.ground('hill_' + along, street.surface, (0, 0, 0))
        else:
            middle, across = (a + b) / 2, street.at + (street.high - street.low) / 2
            x, z = (middle, across) if along == 'x' else (across, middle)
            scene.plane(street.low + street.high, b - a, street.surface, (x, 0, z), 90 if along == 'x' else 0)
        scene.lines('lines_' + name)
    for i, c in enumerate(COLUMNS):
        for j, r in enumerate(ROWS):
            x0, x1, z0, z1 = c.at - c.low, c.at + c.high, r.at - r.low, r.at + r.high
            x0, x1 = x0 - CORNER * (i > 0), x1 + CORNER * (i < len(COLUMNS) - 1)
            z0, z1 = z0 - CORNER * (j > 0), z1 + CORNER * (j < len(ROWS) - 1)
            y = float(height((x0 + x1) / 2, (z0 + z1) / 2))
            surface = 'asphalt' if 'asphalt' in (c.surface, r.surface) else 'cobble'
            scene.plane(x1 - x0, z1 - z0, surface, ((x0 + x1) / 2, y, (z0 + z1) / 2), 0)
    for b in BLOCKS:
        name = 'hill' if b.hilly else ('north', 'middle', 'south')[b.j]
        x, z = (0, 0) if b.hilly else b.middle
        scene.ground('pavement_' + name, 'paving', (x, 0, z))
        scene.ground('kerb_' + name, 'kerb', (x, 0, z))
    for side in 'nesw':
        scene.ground('pavement_outer_' + side, 'paving', (0, 0, 0))
        scene.ground('kerb_outer_' + side, 'kerb', (0, 0, 0))
    x0, x1, z0, z1 = square()
    scene.plane(x1 - x0, z1 - z0, 'cobble', ((x0 + x1) / 2, KERB + 0.012, (z0 + z1) / 2), 0)
    for x in np.linspace(x0 + 0.6, x1 - 0.6, 6):                    # bands of slabs in the cobbles
        scene.plane(0.8, z1 - z0, 'paving', (x, KERB + 0.02, (z0 + z1) / 2), 0)
    for z in np.linspace(z0 + 0.6, z1 - 0.6, 6):
        scene.plane(0.8, x1 - x0, 'paving', ((x0 + x1) / 2, KERB + 0.028, z), 90)


def land(scene):
    """Dark fields around the outer houses."""
    w, e = (COLUMNS[0].at - COLUMNS[0].low - COLUMNS[0].pavement - 4,
            COLUMNS[-1].at + COLUMNS[-1].high + COLUMNS[-1].pavement + 4)
    n, s = ROWS[0].at - ROWS[0].low - ROWS[0].pavement - 4, ROWS[-1].at + ROWS[-1].high + ROWS[-1].pavement + 4
    wide = 70
    for x0, x1, z0, z1 in ((w - wide, e + wide, n - wide, n), (w - wide, e + wide, s, s + wide), (w - wide, w, n, s),
                           (e, e + wide, n, s)):
        name = scene.mesh('land %gx%g' % (x1 - x0, z1 - z0), 'plane(size: (%g, %g))' % (x1 - x0, z1 - z0))
        scene.raw('(mesh: "%s", material: "earth", piece_metres: 12, %s),'
                  % (name, place((x0 + x1) / 2, -0.15, (z0 + z1) / 2)))


def lamps(scene):
    for street, along, _, a, b in segments():
        tall = street.lanes > 1
        n = max(2, int(round((b - a - 11) / (20 if tall else 14))))
        for m, s in enumerate(np.linspace(a + 5.5, b - 5.5, n + 1)):
            for side in ((-1, 1) if tall else ((-1,) if m % 2 else (1,))):
                o = street.at + (-street.low - 0.5 if side < 0 else street.high + 0.5)
                x, z = (s, o) if along == 'x' else (o, s)
                yaw = {(-1, 'x'): 0, (1, 'x'): 180, (-1, 'z'): 90, (1, 'z'): -90}[(side, along)]
                scene.lamp(place(x, float(height(x, z)) + KERB, z, yaw), tall)
    for b in BLOCKS:                                                # at two corners of every block
        for x, z, yaw in ((b.kx0, b.kz0, -135), (b.kx1, b.kz1, 45), (b.kx1, b.kz0, 135), (b.kx0, b.kz1, -45)):
            main = (z == b.kz0) == (b.j == 1) and b.j < 2
            if not main and (x, z) not in ((b.kx0, b.kz0), (b.kx1, b.kz1)):
                continue
            d = (CORNER - (CORNER - 0.5) / np.sqrt(2))
            px, pz = x + d * (1 if x == b.kx0 else -1), z + d * (1 if z == b.kz0 else -1)
            scene.lamp(place(px, float(height(px, pz)) + KERB, pz, yaw), main)


def signals(scene, traffic):
    for (h, _, _), r in traffic.arriving.items():
        for _, signal, group, _ in r.stops:
            street = r.street
            edge = {0: street.high, 1: street.low, 2: street.low, 3: street.high}[h]
            p = r.points[-1] - AHEAD[h] * (town_streets.STOP_LINE + 0.6) + right_of(h) * (edge - street.line + 0.42)
            yaw = np.degrees(np.arctan2(-AHEAD[h][0], -AHEAD[h][1]))
            scene.signal(place(p[0], float(height(*p)) + KERB, p[1], yaw), signal, group)


def yards(scene, rng):
    """Behind the houses: a yard with a lamp and trees."""
    for b in BLOCKS:
        x, z = (b.x0 + b.x1) / 2, (b.z0 + b.z1) / 2
        w, d = BLOCK_X - 2 * DEPTH, BLOCK_Z - 2 * DEPTH
        y = 0.06
        if b.square:
            w, x = BLOCK_X - SQUARE_X - 2 * DEPTH, b.x0 + (BLOCK_X - SQUARE_X) / 2
        scene.raw('(mesh: "%s", material: "stone dark", piece_metres: 6, %s),'
                  % (scene.mesh('yard %gx%g' % (w, d), 'plane(size: (%g, %g), tile_metres: 1)' % (w, d)),
                     place(x, y, z)))
        for k in range(3):
            tx_, tz = x + (rng.random() - 0.5) * (w - 8), z + (rng.random() - 0.5) * (d - 8)
            scene.thing('tree', place(tx_, max(y, float(height(tx_, tz))), tz, 360 * rng.random(),
                                      0.8 + 0.4 * rng.random()))
        scene.lamp(place(x + w / 4, y, z, 90), False)


def furniture(scene, traffic):
    x0, x1, z0, z1 = square()
    cx, cz, y = (x0 + x1) / 2, (z0 + z1) / 2 + 1, KERB + 0.012
    scene.thing('basin', place(cx, y, cz))
    scene.raw('(name: "kettle", mesh: "kettle", material: "copper", spin: (degrees_per_second: 12), '
              'transform: (translation: (%g, %g, %g), scale: 1.3)),' % (cx, y + 2.10, cz))
    for k in range(4):
        a = np.radians(45 + 90 * k)
        scene.thing('bench', place(cx + 5.2 * np.sin(a), y, cz + 5.2 * np.cos(a), 45 + 90 * k + 180))
    for k, (px, pz) in enumerate([(x0 + 4, z0 + 4.5), (x0 + 4, z0 + 11), (x1 - 4, z0 + 21), (x0 + 4, z1 - 7),
                                  (x0 + 4, z1 - 15), (x0 + 14, z1 - 4.5)]):
        scene.thing('tree', place(px, y, pz, 77 * k, 0.85 + 0.05 * (k * 3 % 7)))
    for k in range(3):
        a = np.radians(120 * k + 20)
        scene.raw('(light: "fountain", transform: (translation: (%.3f, %.3f, %.3f))),'
                  % (cx + 1.75 * np.sin(a), y + 0.75, cz + 1.75 * np.cos(a)))
    for px, pz, yaw in ((x0 + 9, z0 + 5, 0), (x1 - 6, z0 + 5, 0), (x0 + 4, z1 - 4, 135), (x1 - 4, z1 - 4, -135),
                        (cx - 7, cz, 90), (cx + 7, cz, -90), (cx, cz - 7.5, 0), (cx, cz + 7.5, 180)):
        scene.lamp(place(px, y, pz, yaw), False)
    for r, at in traffic.bus_stops:
        p = r.place(at)[0] + right_of(r.heading) * (r.street.high - r.street.line + 2.1)
        yaw = np.degrees(np.arctan2(-right_of(r.heading)[0], -right_of(r.heading)[1]))
        scene.thing('shelter', place(p[0], KERB, p[1], yaw), '(node: "lamp", light: "shelter")')


def town(path, still, models):
    traffic = Traffic()
    check(traffic)
    scene = Scene(models)
    rng = np.random.default_rng(1897)
    houses(scene, rng)
    ground(scene)
    lamps(scene)
    signals(scene, traffic)
    furniture(scene, traffic)
    yards(scene, rng)
    land(scene)
    scene.write(path, traffic, still)


def main():
    models = os.path.join(HERE, '..', 'models')
    rooms(os.path.join(HERE, '..', 'textures', 'town_rooms.jpg'))
    town_houses.build(os.path.join(models, 'town_houses.glb'))
    town_streets.build(os.path.join(models, 'town_streets.glb'))
    town_things.build()
    town(os.path.join(HERE, '..', 'scenes', 'town.ron'), False, models)


if __name__ == '__main__':
    if sys.argv[1:2] == ['--still']:
        town(sys.argv[2], True, os.path.join(HERE, '..', 'models'))
    else:
        main()
