"""A building of thirty rooms on two floors, and the street before it: `scenes/rooms.ron`.

Cells meet in the middle of walls and floors. Each face of a wall is an object of its own that lies well within one
cell, so that light of the other side never reaches it. What goes through a wall (frames, sills, doors) is in both.
"""

import os
import random

HERE = os.path.dirname(os.path.abspath(__file__))

BAYS, BAY = 8, 5.0
CORRIDOR, DEPTH = 2.4, 5.5           # between the middles of walls
STOREY, CLEAR = 3.1, 2.8             # from floor to floor, from floor to ceiling
FLOOR = 0.15                         # from a cell's end to the floor in it, and to the ceiling
HALF = 0.10                          # from a cell's end to the wall's face in it
SHEET = 0.04                         # thickness of what is seen of a wall
OUT = 0.30                           # from the inner to the outer face of an outer wall
DOOR = (0.92, 2.06)
WINDOW = (1.9, 0.9, 2.2)             # width, sill, top
STREET = -0.25                       # its height
STAIRS = 3                           # the bay of the stairs, on the street's side

rnd = random.Random(33)
entities, meshes, cells, portals, globes = [], {}, [], [], set()


def n(x):
    s = '%.4f' % x
    return s.rstrip('0').rstrip('.') if '.' in s else s


def vec(v):
    return '(%s)' % ', '.join(n(x) if abs(x) > 5e-5 else '0' for x in v)


def mesh(size, tile):
    name = 'box %s / %s' % (' '.join(n(x) for x in size), n(tile))
    meshes[name] = 'cube(size: %s, tile_metres: %s)' % (vec(size), n(tile))
    return name


TILE = {'plaster': 2, 'warm plaster': 2, 'green plaster': 2, 'brick': 1.8, 'planks': 0.8, 'tiles': 1.8,
        'concrete': 1.5, 'cobble': 1.44, 'paving': 2.4, 'asphalt': 3.2, 'wood': 0.8, 'white': 1, 'cloth': 1, 'metal': 1,
        'copper': 1.4}


def box(lo, hi, material, name=None, more=''):
    """A box by two corners."""
    size = [b - a for a, b in zip(lo, hi)]
    mid = [(a + b) / 2 for a, b in zip(lo, hi)]
    entities.append('        (%smesh: "%s", material: "%s", transform: (translation: %s)%s),' % (
        'name: "%s", ' % name if name else '', mesh(size, TILE[material]), material, vec(mid), more))


def model(name, at, yaw=0, scale=1):
    turn = ', rotation_degrees: (0, %s, 0)' % n(yaw) if yaw else ''
    size = ', scale: %s' % n(scale) if scale != 1 else ''
    entities.append('        (mesh: "%s", transform: (translation: %s%s%s)),' % (name, vec(at), turn, size))


def lamp(at, kind, color, intensity, reach, name=None):
    entities.append('        (%stransform: (translation: %s), light: %s(color: %s, intensity: %s, range: %s, '
                    'shadows: true)),' % (
                        'name: "%s", ' % name if name else '', vec(at), kind, color, n(intensity), n(reach)))


def side_box(axis, at, along, height, material, thick):
    """A box across an axis: from `at` on by `thick`, along the other axis and upward."""
    a, b = sorted((at, at + thick))
    if axis == 'x':
        box((a, height[0], along[0]), (b, height[1], along[1]), material)
    else:
        box((along[0], height[0], a), (along[1], height[1], b), material)


def wall(axis, at, inward, along, height, material, holes, insets=(0.06, 0.06), reach=HALF - 0.04):
    """The face of a wall: it lies `HALF` within the cell that ends at `at`, and has holes (from, to, low, high).
    It goes on behind the faces of its neighbours, and behind floor and ceiling."""
    face = at + inward * HALF
    low, high = height[0] - reach, height[1] + reach
    start, end = along[0] + insets[0], along[1] - insets[1]
    holes = sorted((a - 0.02, b + 0.02, sill - 0.02, top + 0.02) for a, b, sill, top in holes)
    for a, b, sill, top in holes:
        side_box(axis, face, (start, a), (low, high), material, -inward * SHEET)
        if sill > low + 0.005:
            side_box(axis, face, (a, b), (low, sill), material, -inward * SHEET)
        side_box(axis, face, (a, b), (top, high), material, -inward * SHEET)
        start = b
    # Long walls in pieces as long as a bay.
    count = max(1, round((end - start) / 5.2))
    for i in range(count):
        part = (start + (end - start) * i / count, start + (end - start) * (i + 1) / count)
        side_box(axis, face, part, (low, high), material, -inward * SHEET)


def frame(axis, at, through, along, height, material, wide=0.05, sill=False):
    """Jambs and lintel of an opening, a little wider than the wall, from through[0] to through[1]."""
    a, b = along
    low, high = height
    lo, hi = at + through[0], at + through[1]
    side_box(axis, lo, (a - wide, a), (low, high + wide), material, hi - lo)
    side_box(axis, lo, (b, b + wide), (low, high + wide), material, hi - lo)
    side_box(axis, lo, (a, b), (high, high + wide), material, hi - lo)
    if sill:
        side_box(axis, lo, (a - wide, b + wide), (low - wide, low), material, hi - lo)


def portal(axis, at, along, height, between, door='', name=None, opening=1):
    (a, b), (low, high) = along, height
    corners = [(a, low), (b, low), (b, high), (a, high)]
    polygon = [(at, y, s) if axis == 'x' else (s, y, at) for s, y in corners]
    extra = ', name: "%s"' % name if name else ''
    extra += ', open: %s' % n(opening) if opening != 1 else ''
    portals.append('        (between: ("%s", "%s"), polygon: [%s]%s%s),' % (
        *between, ', '.join(vec(p) for p in polygon), extra, door))


def deep_opening(at, out, along, height, inside, name, door='', opening=1):
    """An opening of an outer wall across z. In the wall's depth it is a cell of its own, with a portal at either end:
    so light at a grazing angle ends at its sides, and does not reach into the cell `inside`."""
    (a, b), (low, high) = along, height
    face = at + out * (OUT - HALF)
    lo, hi = (a, low, min(at, face)), (b, high, max(at, face))
    cells.append('        "%s": (box: (%s, %s)),' % (name, vec(lo), vec(hi)))
    portal('z', at, along, height, (inside, name), door, name, opening)
    portal('z', face, along, height, (name, 'outside'))


def leaf(name, hinge, yaw, width, height, material='wood'):
    """A door that hangs on its edge."""
    door = mesh((width, height, 0.045), TILE[material])
    knob = mesh((0.12, 0.03, 0.12), 1)
    entities.append('        (name: "%s", transform: (translation: %s, rotation_degrees: (0, %s, 0)), children: ['
                    '(mesh: "%s", material: "%s", transform: (translation: %s)), '
                    '(mesh: "%s", material: "copper", transform: (translation: %s))]),' % (
                        name, vec(hinge), n(yaw), door, material, vec((width / 2, height / 2, 0)),
                        knob, vec((width - 0.1, 1.0, 0))))


def table(at, size, height, material='planks'):
    x, y, z = at
    w, d = size
    box((x - w / 2, y + height - 0.05, z - d / 2), (x + w / 2, y + height, z + d / 2), material)
    for sx in (-1, 1):
        for sz in (-1, 1):
            cx, cz = x + sx * (w / 2 - 0.07), z + sz * (d / 2 - 0.07)
            box((cx - 0.035, y, cz - 0.035), (cx + 0.035, y + height - 0.05, cz + 0.035), material)


def chair(at, toward):
    x, y, z = at
    box((x - 0.22, y + 0.42, z - 0.22), (x + 0.22, y + 0.46, z + 0.22), 'planks')
    for sx in (-1, 1):
        for sz in (-1, 1):
            cx, cz = x + sx * 0.19, z + sz * 0.19
            box((cx - 0.02, y, cz - 0.02), (cx + 0.02, y + 0.42, cz + 0.02), 'planks')
    back = z - toward * 0.2
    box((x - 0.22, y + 0.46, back - 0.02), (x + 0.22, y + 0.95, back + 0.02), 'planks')


def shelf(lo, hi):
    """An open shelf with boards."""
    x0, y0, z0 = lo
    x1, y1, z1 = hi
    for i in range(5):
        y = y0 + (y1 - y0 - 0.03) * i / 4
        box((x0, y, z0), (x1, y + 0.03, z1), 'planks')
    if x1 - x0 > z1 - z0:
        box((x0 - 0.03, y0, z0), (x0, y1, z1), 'planks')
        box((x1, y0, z0), (x1 + 0.03, y1, z1), 'planks')
    else:
        box((x0, y0, z0 - 0.03), (x1, y1, z0), 'planks')
        box((x0, y0, z1), (x1, y1, z1 + 0.03), 'planks')


def pendant(x, z, y, color, intensity, reach):
    """A lamp on a cord below a ceiling at y: a globe around the light."""
    box((x - 0.008, y - 0.5, z - 0.008), (x + 0.008, y, z + 0.008), 'metal')
    globe((x, y - 0.6, z), 'point', color, intensity, reach)


def globe(at, kind, color, intensity, reach):
    """A light within a glowing globe."""
    name = color.replace('"', '')
    entities.append('        (mesh: "globe", casts_shadows: false, material: "%s globe", transform: (translation: %s), '
                    'light: %s(color: %s, intensity: %s, range: %s, shadows: true)),' % (
                        name, vec(at), kind, color, n(intensity), n(reach)))
    globes.add(color)


def desk_lamp(at, color, intensity, reach):
    x, y, z = at
    box((x - 0.09, y, z - 0.09), (x + 0.09, y + 0.02, z + 0.09), 'metal')
    box((x - 0.01, y + 0.02, z - 0.01), (x + 0.01, y + 0.3, z + 0.01), 'metal')
    globe((x, y + 0.38, z), 'point', color, intensity, reach)


WALLS = ['plaster', 'warm plaster', 'green plaster', 'brick', 'plaster', 'warm plaster']
FLOORS = ['planks', 'tiles', 'planks', 'concrete', 'planks', 'tiles']
COLORS = ['kelvin(2600)', 'kelvin(3000)', 'kelvin(4200)', 'kelvin(2400)', 'srgb("#ffc4a0")', 'srgb("#bfd4ff")']


def room(storey, bay, side, connected):
    """side: 1 toward the street, −1 away from it."""
    y = storey * STOREY
    x0, x1 = bay * BAY, (bay + 1) * BAY
    near, far = side * CORRIDOR / 2, side * (CORRIDOR / 2 + DEPTH)
    z0, z1 = sorted((near, far))
    number = 100 * (storey + 1) + (1 if side > 0 else 11) + bay
    name = 'room %d' % number
    cells.append('        "%s": (box: (%s, %s)),' % (name, vec((x0, y - FLOOR, z0)), vec((x1, y + CLEAR + FLOOR, z1))))
    height = (y, y + CLEAR)
    style = rnd.randrange(len(WALLS))
    walls, floor = WALLS[style], FLOORS[rnd.randrange(len(FLOORS))]
    # Floor and ceiling go on behind the walls.
    box((x0 + 0.06, y - SHEET, z0 + 0.06), (x1 - 0.06, y, z1 - 0.06), floor)
    box((x0 + 0.06, y + CLEAR, z0 + 0.06), (x1 - 0.06, y + CLEAR + SHEET, z1 - 0.06), 'white')

    # The door to the corridor; its leaf opens into the room.
    a = x0 + rnd.choice((0.7, 1.6, 3.2))
    b, top = a + DOOR[0], y + DOOR[1]
    wall('z', near, side, (x0, x1), height, walls, [(a, b, y - 0.06, top)])
    wall('z', near, -side, (x0, x1), height, 'plaster', [(a, b, y - 0.06, top)], ends(bay))
    frame('z', near, (-HALF - 0.02, HALF + 0.02), (a, b), (y, top), 'wood')
    box((a, y - SHEET, near - HALF + 0.02), (b, y + 0.004, near + HALF - 0.02), 'wood')
    leaf_name = 'door %d' % number
    kind = rnd.random()
    move = ''
    opening = 1
    if kind < 0.3:
        move = ', period_seconds: %s, phase_seconds: %s' % (n(rnd.uniform(9, 16)), n(rnd.uniform(0, 9)))
    elif kind < 0.6:
        opening = 0
    # It stands in the middle of the wall, in the light of both sides. Those that are seen open slide into the wall:
    # a leaf that swings would stand in the light of one side.
    lamp_x = (x0 + x1) / 2 + rnd.uniform(-0.4, 0.4)
    leaf(leaf_name, (a, y, near), 0, *DOOR)
    way = 'swing_degrees: %d' % (-90 * side) if opening == 0 else 'slide: (%s, 0, 0)' % n(-DOOR[0] + 0.02)
    portal('z', near, (a, b), (y, top), ('corridor %d' % (storey + 1), name),
           ', door: (leaf: "%s", %s%s)' % (leaf_name, way, move), leaf_name, opening)

    # The window.
    middle = (x0 + x1) / 2 + rnd.uniform(-0.5, 0.5)
    w, sill, head = WINDOW
    wa, wb = middle - w / 2, middle + w / 2
    hole = (wa, wb, y + sill, y + head)
    wall('z', far, -side, (x0, x1), height, walls, [hole])
    through = (-side * (HALF + 0.06), side * (OUT - HALF + 0.02))
    frame('z', far, through, (wa, wb), (y + sill, y + head), 'white', sill=True)
    for x in (middle,):
        box((x - 0.03, y + sill, far - 0.03), (x + 0.03, y + head, far + 0.03), 'white')
    box((wa, y + sill + 0.85, far - 0.025), (wb, y + sill + 0.9, far + 0.025), 'white')
    portal('z', far, (wa, wb), (y + sill, y + head), (name, 'outside'), '', 'window %d' % number)
    outer(far, side, (x0, x1), y, hole)

    # Walls to the neighbours, of which each builds its own face.
    for at, inward, neighbour in ((x0, 1, bay - 1), (x1, -1, bay)):
        holes = []
        if connected.get((storey, neighbour, side)):
            holes = [passage(storey, side, y)]
        wall('x', at, inward, (z0, z1), height, walls, holes)
    if connected.get((storey, bay, side)):
        za, zb, low, high = passage(storey, side, y)
        frame('x', x1, (-HALF - 0.02, HALF + 0.02), (za, zb), (y, high), 'wood')
        box((x1 - HALF + 0.02, y - SHEET, za), (x1 + HALF - 0.02, y + 0.004, zb), 'wood')
        portal('x', x1, (za, zb), (y, high), (name, 'room %d' % (number + 1)), '', 'passage %d' % number)

    furnish(y, x0, x1, near, far, side, lamp_x)


def ends(bay):
    """Where the corridor's faces end: at its ends they go on behind the others."""
    return (0.06 if bay == 0 else 0, 0.06 if bay == BAYS - 1 else 0)


def passage(storey, side, y):
    at = side * (CORRIDOR / 2 + 2.1)
    return (min(at, at + side * 1.3), max(at, at + side * 1.3), y - 0.06, y + 2.2)


def outer(far, side, along, y, hole):
    """The outer face of a bay."""
    face = far + side * (OUT - HALF)
    low, high = y - (0.15 if y else 0.3), y + CLEAR + (0.4 if y else 0.15)
    a, b, sill, top = hole
    for part, (lo, hi) in (((along[0], a), (low, high)), ((b, along[1]), (low, high)),
                           ((a, b), (low, sill)), ((a, b), (top, high))):
        side_box('z', face, part, (lo, hi), 'brick', -side * SHEET)


def furnish(y, x0, x1, near, far, side, lamp_x):
    cx, cz = (x0 + x1) / 2, (near + far) / 2
    color = COLORS[rnd.randrange(len(COLORS))]
    pendant(lamp_x, cz + side * 0.3, y + CLEAR, color, rnd.uniform(5, 8), 11)
    kind = rnd.randrange(4)
    # At the window.
    wz = far - side * (HALF + 0.55)
    if kind == 0:
        table((cx - 1.2, y, wz), (1.6, 0.75), 0.74)
        chair((cx - 1.2, y, wz - side * 0.7), side)
        desk_lamp((cx - 1.7, y + 0.74, wz), 'kelvin(2300)', 1.6, 8)
        model('kettle', (cx - 0.75, y + 0.88, wz), rnd.uniform(0, 360), 0.22)
        shelf((x1 - HALF - 0.35, y, cz - 0.9), (x1 - HALF - 0.01, y + 1.9, cz + 0.9))
    elif kind == 1:
        table((cx, y, cz + side * 0.4), (1.9, 0.9), 0.74)
        for dx in (-0.5, 0.5):
            chair((cx + dx, y, cz + side * 0.4 - 0.75), 1)
            chair((cx + dx, y, cz + side * 0.4 + 0.75), -1)
        model('kettle', (cx + 0.3, y + 0.89, cz + side * 0.4), rnd.uniform(0, 360), 0.24)
        desk_lamp((x0 + 0.55, y + 1.3, wz), 'kelvin(2500)', 1.8, 8)
        box((x0 + 0.4, y, wz - 0.15), (x0 + 0.7, y + 1.3, wz + 0.15), 'wood')
    elif kind == 2:
        # A bed and a chest.
        foot, head = sorted((far - side * 2.3, far - side * 0.3))
        box((x1 - HALF - 1.1, y + 0.2, foot), (x1 - HALF - 0.05, y + 0.5, head), 'cloth')
        box((x1 - HALF - 1.15, y, foot - 0.05), (x1 - HALF - 0.02, y + 0.2, head + 0.05), 'planks')
        box((x0 + HALF + 0.02, y, cz - 0.7), (x0 + HALF + 0.5, y + 0.95, cz + 0.7), 'planks')
        desk_lamp((x0 + 0.38, y + 0.95, cz + 0.4), 'kelvin(2300)', 1.5, 8)
        model('kettle', (x0 + 0.4, y + 1.09, cz - 0.3), rnd.uniform(0, 360), 0.22)
    else:
        # A store.
        for i in range(3):
            model('crate', (x1 - 0.7 - 0.9 * (i % 2), y + (0.8 if i == 2 else 0), wz - side * 0.2), rnd.uniform(-9, 9))
        for i in range(2):
            model('barrel', (x0 + 0.55 + 0.65 * i, y, wz), rnd.uniform(0, 360))
        shelf((x0 + HALF + 0.01, y, cz - 0.9), (x0 + HALF + 0.36, y + 1.9, cz + 0.9))
        globe((cx + 1.0, y + 1.9, far - side * (HALF + 0.1)), 'point', 'kelvin(3400)', 1.5, 8)
    # A rug before the door.
    box((cx - 0.9, y, cz - 0.6), (cx + 0.9, y + 0.012, cz + 0.6), 'cloth')


def corridor(storey):
    y = storey * STOREY
    name = 'corridor %d' % (storey + 1)
    x0, x1, z = 0.0, BAYS * BAY, CORRIDOR / 2
    cells.append('        "%s": (box: (%s, %s)),' % (name, vec((x0, y - FLOOR, -z)), vec((x1, y + CLEAR + FLOOR, z))))
    for bay in range(BAYS):
        a, b = bay * BAY + (0.06 if bay == 0 else 0), (bay + 1) * BAY - (0.06 if bay == BAYS - 1 else 0)
        box((a, y - SHEET, -z + 0.06), (b, y, z - 0.06), 'tiles')
        box((a, y + CLEAR, -z + 0.06), (b, y + CLEAR + SHEET, z - 0.06), 'white')
        pendant(bay * BAY + BAY / 2, 0, y + CLEAR, 'kelvin(3000)', 3.2, 9)
        if bay % 3 == 1:
            model('bench', (bay * BAY + 4.2, y, z - 0.42), 180)
    # A window at either end.
    for at, inward in ((x0, 1), (x1, -1)):
        hole = (-0.6, 0.6, y + 0.9, y + 2.2)
        wall('x', at, inward, (-z, z), (y, y + CLEAR), 'plaster', [hole])
        through = (inward * (HALF + 0.06), -inward * (OUT - HALF + 0.02))
        frame('x', at, through, (-0.6, 0.6), (y + 0.9, y + 2.2), 'white', sill=True)
        portal('x', at, (-0.6, 0.6), (y + 0.9, y + 2.2), (name, 'outside'), '', 'end %d %d' % (storey + 1, at))
        gable(at, -inward, (-z, z), y, hole)


def gable(at, out, along, y, hole=None):
    face = at + out * (OUT - HALF)
    low, high = y - (0.15 if y else 0.3), y + CLEAR + (0.4 if y else 0.15)
    parts = [(along, (low, high))]
    if hole:
        a, b, sill, top = hole
        parts = [((along[0], a), (low, high)), ((b, along[1]), (low, high)),
                 ((a, b), (low, sill)), ((a, b), (top, high))]
    for part, h in parts:
        side_box('x', face, part, h, 'brick', -out * SHEET)


def stairs():
    """A cell on each floor, with a doorway to its corridor; the well between them is a portal. Below is the way out to
    the street."""
    x0, x1 = STAIRS * BAY, (STAIRS + 1) * BAY
    near, far = CORRIDOR / 2, CORRIDOR / 2 + DEPTH
    top = STOREY + CLEAR
    between = STOREY - FLOOR
    for storey, (low, high) in enumerate(((-FLOOR, between), (between, top + FLOOR))):
        cells.append('        "stairs %d": (box: (%s, %s)),' % (storey + 1, vec((x0, low, near)), vec((x1, high, far))))
    box((x0 + 0.06, -SHEET, near + 0.06), (x1 - 0.06, 0, far - 0.06), 'paving')
    box((x0 + 0.06, top, near + 0.06), (x1 - 0.06, top + SHEET, far - 0.06), 'white')
    way = (x0 + 0.5, x0 + 2.1)
    holes = [(*way, -0.06, 2.3)]
    for storey in (0, 1):
        y = storey * STOREY
        hole = (*way, y - 0.06, y + 2.3)
        # The face toward the stairs; above each other.
        face_low, face_high = (-0.06, CLEAR + 0.06) if storey == 0 else (STOREY - 0.06, top + 0.06)
        for a, b, lo, hi in ((x0 + 0.06, way[0], face_low, face_high), (way[1], x1 - 0.06, face_low, face_high),
                             (*way, y + 2.3, face_high)):
            side_box('z', near + HALF, (a, b), (lo, hi), 'warm plaster', -SHEET)
        wall('z', near, -1, (x0, x1), (y, y + CLEAR), 'plaster', [hole], ends(STAIRS))
        frame('z', near, (-HALF - 0.02, HALF + 0.02), way, (y, y + 2.3), 'wood')
        box((way[0], y - SHEET, near - HALF + 0.02), (way[1], y + 0.004, near + HALF - 0.02), 'wood')
        portal('z', near, way, (y, y + 2.3), ('corridor %d' % (storey + 1), 'stairs %d' % (storey + 1)), '',
               'stairs %d' % (storey + 1))
    for at, inward in ((x0, 1), (x1, -1)):
        wall('x', at, inward, (near, far), (0, top), 'warm plaster', [])
    # The entrance, with a door of its own, and a window above it.
    a, b = x0 + 1.9, x0 + 3.1
    entrance, upper = (a, b, -0.06, 2.3), (x0 + 1.2, x0 + 3.8, STOREY + 0.9, STOREY + 2.2)
    for lo, hi, hole in ((-0.06, STOREY - 0.06, entrance), (STOREY - 0.06, top + 0.06, upper)):
        ha, hb, sill, head = hole
        for pa, pb, plo, phi in ((x0 + 0.06, ha, lo, hi), (hb, x1 - 0.06, lo, hi),
                                 (ha, hb, lo, sill), (ha, hb, head, hi)):
            if phi - plo > 0.005:
                side_box('z', far - HALF, (pa, pb), (plo, phi), 'warm plaster', SHEET)
    frame('z', far, (-HALF - 0.02, OUT - HALF + 0.02), (a, b), (0, 2.3), 'wood')
    box((a, -SHEET, far - HALF + 0.02), (b, 0.004, far + OUT - HALF + 0.3), 'paving')
    leaf('front door', (a, 0, far), 0, b - a, 2.3)
    deep_opening(far, 1, (a, b), (0, 2.3), 'stairs 1', 'front door',
                 ', door: (leaf: "front door", swing_degrees: 90, period_seconds: 14, phase_seconds: 5)', 0)
    frame('z', far, (-HALF - 0.06, OUT - HALF + 0.02), upper[:2], upper[2:], 'white', sill=True)
    deep_opening(far, 1, upper[:2], upper[2:], 'stairs 2', 'stairs window')
    outer(far, 1, (x0, x1), 0, (a, b, -0.05, 2.3))
    outer(far, 1, (x0, x1), STOREY, upper)
    # Two flights at the far side of a landing, each 1.3 m wide; steps of 17 cm.
    count, rise, run = 18, STOREY / 18, 0.27
    sx = x0 + 2.6
    for i in range(9):
        z = near + 0.5 + 1.6 + i * run * 0.85
        box((sx, 0, z), (x1 - HALF - 0.02, (i + 1) * rise, z + run * 0.85), 'concrete')
    # The landing, and back up along the other wall.
    lz = near + 0.5 + 1.6 + 9 * run * 0.85
    box((x0 + HALF + 0.02, 9 * rise - 0.15, lz), (x1 - HALF - 0.02, 9 * rise, far - HALF - 0.35), 'concrete')
    for i in range(9):
        z = lz - (i + 1) * run * 0.85
        y = (9 + i + 1) * rise
        box((x0 + HALF + 0.02, y - 0.2, z), (sx - 0.15, y, z + run * 0.85), 'concrete')
    # The floor above has a face for each cell, and an edge at the well, which is all that is open.
    well = lz - 9 * run * 0.85
    box((x0 + 0.06, STOREY - SHEET, near + 0.06), (x1 - 0.06, STOREY, well - 0.03), 'planks')
    box((x0 + 0.06, CLEAR, near + 0.06), (x1 - 0.06, CLEAR + SHEET, well - 0.03), 'white')
    box((x0 + 0.06, CLEAR, well - 0.03), (x1 - 0.06, STOREY, well), 'planks')
    corners = [(x0, between, well), (x1, between, well), (x1, between, far), (x0, between, far)]
    portals.append('        (between: ("stairs 1", "stairs 2"), polygon: [%s], name: "stairwell"),' % (
        ', '.join(vec(p) for p in corners)))
    pendant(x0 + 3.7, near + 3.4, top, 'kelvin(2700)', 5, 13)
    globe((x0 + 1.2, 2.2, far - HALF - 0.1), 'point', 'kelvin(2700)', 3, 9)


def street():
    z = CORRIDOR / 2 + DEPTH + OUT - HALF
    box((-40, STREET - 0.2, z - 0.3), (80, STREET, z + 3), 'paving', 'pavement')
    box((-40, STREET - 0.3, z + 3), (80, STREET - 0.1, z + 11), 'asphalt', 'road')
    box((-40, STREET - 0.2, z + 11), (80, STREET, z + 15), 'paving', 'far pavement')
    back = -(CORRIDOR / 2 + DEPTH + OUT - HALF)
    box((-40, STREET - 0.2, back - 14), (80, STREET, back + 0.3), 'cobble', 'yard')
    for x in range(-24, 70, 16):
        model('lamp post', (x, STREET, z + 2.4))
        lamp((x, STREET + 3.5, z + 3.2), 'point', 'kelvin(2200)', 9, 13)
        lamp((x + 6, STREET + 3.6, back - 8), 'point', 'kelvin(4500)', 4, 11)
    for x in (-9.5, 49):
        model('container', (x, STREET, z + 1.6), 90)
    # A wall along the other side.
    box((-40, STREET, z + 15), (80, 7, z + 15.4), 'brick', 'other side')
    # The roof.
    far = CORRIDOR / 2 + DEPTH + 0.35
    box((-0.35, 2 * STOREY + 0.05, -far), (BAYS * BAY + 0.35, 2 * STOREY + 0.3, far), 'concrete', 'roof')


HEAD = '''\
// A building of thirty rooms on two floors, at night, with a street before it. Its rooms are cells, its doors and
// windows portals: lamps light the rooms that they shine into, and no others. `make_rooms.py` writes this file.
(
    seed: 7,
    // As wide as a door: what shines through it should not light a whole wall.
    piece_metres: 0.9,
    vehicle_types: ["../vehicles.ron"],
    environment: (
        ambient: (0.004, 0.005, 0.008),
        zenith: (0.001, 0.004, 0.016), horizon: (0.020, 0.030, 0.055), ground: (0.004, 0.004, 0.006),
        exposure: 1.2, tone_map: aces,
    ),

    materials: {
'''

MATERIALS = [
    # name, texture, height in units of UV, factor of colour, shininess, factor of highlights
    ('plaster', 'plaster', 0.006, (1, 1, 1), 12, 0.2),
    ('warm plaster', 'plaster', 0.006, (1, 0.8, 0.6), 12, 0.2),
    ('green plaster', 'plaster', 0.006, (0.66, 0.82, 0.62), 12, 0.2),
    ('white', 'plaster', 0.003, (1.0, 0.98, 0.94), 20, 0.25),
    ('cloth', 'plaster', 0.006, (0.55, 0.13, 0.11), 6, 0.08),
    ('brick', 'brick', 0.0117, (1, 1, 1), 20, 0.35),
    ('planks', 'planks', 0.01, (1, 1, 1), 40, 0.5),
    ('wood', 'planks', 0.004, (0.62, 0.45, 0.34), 50, 0.5),
    ('tiles', 'paving', 0.0058, (1, 0.93, 0.84), 60, 0.8),
    ('concrete', 'concrete', 0.0053, (1, 1, 1), 16, 0.3),
    ('cobble', 'cobble', 0.033, (1, 1, 1), 48, 1.0),
    ('paving', 'paving', 0.0058, (1, 1, 1), 30, 0.5),
    ('asphalt', 'asphalt', 0.0031, (1, 1, 1), 30, 0.6),
    ('metal', 'metal', 0.009, (0.5, 0.5, 0.5), 90, 1.0),
]


def material(name, texture, height, color, shininess, specular):
    tint = 'base_factor: %s, ' % vec(color) if color != (1, 1, 1) else ''
    return '''\
        "%s": (
            shading: blinn, shininess: %d, specular_factor: %s, normal_scale: 1.5, %s
            base_map: "../textures/%s_base.jpg", normal_map: "../textures/%s_normal.png",
            specular_map: "../textures/%s_specular.png", height_map: "../textures/%s_height.png",
            height_scale_uv: %s,
        ),
''' % (name, shininess, vec((specular,) * 3), tint, texture, texture, texture, texture, n(height))


COPPER = '''\
        "copper": (
            shading: metallic_roughness, metallic: 1, roughness: 0.34,
            base_map: "../textures/copper_base.jpg", normal_map: "../textures/copper_normal.png",
            height_map: "../textures/copper_height.png", height_scale_uv: 0.0086,
        ),
'''

GLOBE = '''\
        "%s globe": (shading: unlit, base_factor: %s),
'''

MODELS = {'kettle': 'kettle', 'crate': 'crate', 'barrel': 'barrel', 'bench': 'town_bench', 'lamp post': 'lamp_post',
          'container': 'container'}

GLASS = {'lamp_post': ', casts_no_shadow: ["lamp_glass"]'}

CAMERAS = '''\
        (name: "room", transform: (translation: %s, look_at: %s), camera: (fov_y_degrees: 52)),
        (name: "corridor", transform: (translation: %s, look_at: %s), camera: (fov_y_degrees: 52)),
        (name: "stairs", transform: (translation: %s, look_at: %s), camera: (fov_y_degrees: 58)),
        (name: "street", transform: (translation: %s, look_at: %s), camera: (fov_y_degrees: 45)),
        (name: "above", transform: (translation: %s, look_at: %s), camera: (fov_y_degrees: 40)),
'''


def main():
    connected = {(0, 0, 1): True, (0, 5, 1): True, (0, 2, -1): True, (0, 6, -1): True,
                 (1, 1, 1): True, (1, 5, 1): True, (1, 0, -1): True, (1, 4, -1): True}
    for storey in (0, 1):
        corridor(storey)
        for side in (1, -1):
            for bay in range(BAYS):
                if side > 0 and bay == STAIRS:
                    continue
                room(storey, bay, side, connected)
            for at, out in ((0.0, -1), (BAYS * BAY, 1)):
                z = sorted((side * CORRIDOR / 2, side * (CORRIDOR / 2 + DEPTH + OUT - HALF)))
                gable(at, out, z, storey * STOREY)
    stairs()
    street()
    road = CORRIDOR / 2 + DEPTH + OUT - HALF + 7
    text = HEAD + ''.join(material(*m) for m in MATERIALS) + COPPER
    text += ''.join(GLOBE % (color.replace('"', ''), color) for color in sorted(globes))
    text += '    },\n\n    meshes: {\n        "globe": sphere(radius: 0.08, segments: 24, rings: 12),\n'
    text += ''.join('        "%s": model(file: "../models/%s.glb"%s),\n' % (name, file, GLASS.get(file, ''))
                    for name, file in MODELS.items())
    text += ''.join('        "%s": %s,\n' % item for item in sorted(meshes.items()))
    text += '    },\n\n    routes: {\n'
    for name, xs, z in (('east', (-38, 78), road + 2), ('west', (78, -38), road - 2)):
        points = ', '.join('(%d, %s, %s)' % (x, n(STREET - 0.1), n(z)) for x in xs)
        text += '        "%s": (points: [%s], then: ["%s"]),\n' % (name, points, name)
    text += '    },\n\n    cells: {\n' + '\n'.join(cells)
    text += '\n    },\n\n    portals: [\n' + '\n'.join(portals) + '\n    ],\n\n'
    text += '    entities: [\n' + '\n'.join(entities) + '\n'
    text += CAMERAS % tuple(vec(v) for v in (
        (0.55, 1.65, 5.9), (6.2, 1.0, 2.3), (1.2, 1.6, 0.3), (20, 1.1, -0.1),
        (15.7, 4.7, 2.0), (18.4, 1.6, 6.4), (4, 1.7, 20.5), (19, 2.6, 6), (-12, 14, 30), (18, 1, 3)))
    text += '    ],\n\n    generators: [\n'
    text += '        (name: "traffic", place: along(routes: ["east", "west"], spacing: 21, jitter: 5), '
    text += 'vehicles: ["car", "van", "car", "bus"]),\n'
    text += '    ],\n)\n'
    with open(os.path.join(HERE, '..', 'scenes', 'rooms.ron'), 'w') as f:
        f.write(text)


if __name__ == '__main__':
    main()
