"""Routes, signals and vehicles of the town, and what must hold for them (`check`).

Every direction of a street between two junctions is a route, along the middle of its lanes;
every way through a junction is one, too. Bicycles go round the blocks beside the kerb, people
on the pavements. Headings: 0 east, 1 south, 2 west, 3 north; a turn to the right adds 1.
"""

import numpy as np
from town_mesh import outline, steps
from town_plan import *
from town_streets import STOP_LINE, climbs, junction_kind, parking_bays

EAST, SOUTH, WEST, NORTH = range(4)
AHEAD = np.array([(1, 0), (0, 1), (-1, 0), (0, -1)], float)
WORDS = ('east', 'south', 'west', 'north')
SPEED = {'asphalt': 50, 'cobble': 30}
TURN = {0: 'straight', 1: 'right', 3: 'left'}
# how far vehicles reach before and behind their rear axle, which is what their place on a route means
FRONT = dict(car=3.5, van=3.7, bus=8.8, truck=5.3, motorcycle=2.0, bicycle=1.6, person=0.3)
BEHIND = dict(car=0.9, van=1.1, bus=3.4, truck=11.6, motorcycle=0.5, bicycle=0.5, person=0.3)
STOP_AT = STOP_LINE + 0.4 + 0.5         # metres before the end of a route: half a metre before the line


class Route:
    def __init__(self, name, points, street=None, heading=None, **fields):
        self.name, self.street, self.heading, self.fields = name, street, heading, fields
        self.points = np.asarray(points, float)         # x, z
        self.shape, self.closed, self.lift = 'polyline', False, 0.0
        self.stops, self.then = [], []

    def length(self):
        line = np.concatenate([self.points, self.points[:1]]) if self.closed else self.points
        return np.linalg.norm(np.diff(line, axis=0), axis=1).sum()

    def place(self, at):
        """Point (x, z) and direction at a distance along its points."""
        line = np.concatenate([self.points, self.points[:1]]) if self.closed else self.points
        d = np.linalg.norm(np.diff(line, axis=0), axis=1)
        s = np.concatenate([[0], np.cumsum(d)])
        k = int(np.clip(np.searchsorted(s, at, side='right') - 1, 0, len(d) - 1))
        t = (line[k + 1] - line[k]) / d[k]
        return line[k] + t * (at - s[k]), t


def right_of(h):
    return AHEAD[(h + 1) % 4]


def street_routes():
    """{(heading, column, row) of the junction it leaves from: route}, and the same by arrival."""
    leaving, arriving = {}, {}
    for street, along, k, a, b in segments():
        index = (ROWS if along == 'x' else COLUMNS).index(street)
        for way in (1, -1):
            h = (EAST if way > 0 else WEST) if along == 'x' else (SOUTH if way > 0 else NORTH)
            s = steps(a, b, 4.0) if climbs(street, along, k) else np.array([a, b])
            s = s if way > 0 else s[::-1]
            o = street.at + street.line * (right_of(h)[1] if along == 'x' else right_of(h)[0])
            points = [(v, o) if along == 'x' else (o, v) for v in s]
            r = Route('%s %s %d' % (street.name, WORDS[h], k + 1), points, street, h, lanes=street.lanes,
                      lane_width=LANE,
                      speed_limit_kmh=SPEED[street.surface])
            first, last = ((k, index), (k + 1, index)) if along == 'x' else ((index, k), (index, k + 1))
            start, end = (first, last) if way > 0 else (last, first)
            leaving[(h, *start)], arriving[(h, *end)] = r, r
    return leaving, arriving


def through(start, h0, end, h1, lead_in=1.2, part=1.0):
    """A way through a junction: straight, an arc, straight; all ends have collinear points, so
    that a spline through them leaves and arrives along the streets."""
    start, end, d0, d1 = np.asarray(start), np.asarray(end), AHEAD[h0], AHEAD[h1]
    if h0 == h1:
        return [start + (end - start) * t for t in (0, 0.25, 0.5, 0.75, 1)]
    ahead, aside = (end - start) @ d0, (end - start) @ d1
    r = part * (min(ahead, aside) - lead_in)
    begin, finish = start + d0 * (ahead - r), end - d1 * (aside - r)
    centre = begin + d1 * r
    angle = np.linspace(0, np.pi / 2, max(6, int(r * 1.5) + 1))
    bend = [centre - d1 * r * np.cos(t) + d0 * r * np.sin(t) for t in angle]
    lead = [start + (begin - start) * t for t in (0, 0.33, 0.67)]
    tail = [finish + (end - finish) * t for t in (0.33, 0.67, 1)]
    return lead + bend + tail


def beside_middle(street, lane):
    """Metres from the middle of a street's lanes to that of one, to the left."""
    return (lane - (street.street.lanes - 1) / 2) * LANE


def junctions(leaving, arriving):
    """Ways through every junction, joined to the streets; the signals."""
    ways, signals = [], {}
    for j in range(len(ROWS)):
        for i in range(len(COLUMNS)):
            coming = [h for h in range(4) if (h, i, j) in arriving]
            signal = None
            if junction_kind(i, j) != 'bend':
                signal = '%s and %s' % (ROWS[j].name, COLUMNS[i].name)
                busy = [14 if arriving[(h, i, j)].street.lanes > 1 else 10 for h in coming]
                signals[signal] = (busy, (7 * i + 11 * j) % 30)
            for group, h in enumerate(coming):
                street, across = arriving[(h, i, j)], []
                for turn, word in TURN.items():
                    out = leaving.get(((h + turn) % 4, i, j))
                    if out is None:
                        continue
                    lanes = min(street.street.lanes, out.street.lanes) if turn == 0 else 1
                    # a turn leads from the middle of the lane at its side to that of the lane at the edge
                    lane = street.street.lanes - 1 if turn == 3 else 0
                    start, end = street.points[-1], out.points[0]
                    if turn:
                        start, end = (start - right_of(h) * beside_middle(street, lane),
                                      end - right_of(out.heading) * beside_middle(out, 0))
                    # in bends, where both directions meet, they keep away from each other
                    shape = () if signal else (0.4,) if turn == 1 else (1.2, 0.7)
                    points = through(start, h, end, out.heading, *shape)
                    way = Route('%s %s' % (street.name, word), points,
                                lanes=lanes, lane_width=LANE,
                                speed_limit_kmh=SPEED[street.street.surface] if turn == 0 else 25)
                    ways_on = [t for t in TURN if ((h + t) % 4, i, j) in leaving]
                    # where nobody goes straight on, both lanes turn left
                    if turn and street.street.lanes > 1 and (turn == 1 or 0 in ways_on):
                        way.fields['from_lanes'] = [lane]
                    # longer ones would swing over the lane of those who come from there
                    if turn == 1 and len(ways_on) > 1:
                        way.fields['longest_vehicle'] = 7
                    way.shape, way.then = 'spline', [out.name]
                    street.then.append(way.name)
                    across.append(way)
                if signal:
                    clear = STOP_AT + max(way.length() for way in across)
                    street.stops.append((street.length() - STOP_AT, signal, group, round(clear, 1)))
                ways += across
    return ways, signals


def beside(block, side):
    """How far parked cars keep from the kerb of a block: side w, e, n, s."""
    street = {'w': COLUMNS[block.i], 'e': COLUMNS[block.i + 1], 'n': ROWS[block.j], 's': ROWS[block.j + 1]}[side]
    return PARKING if street.parking == ('high' if side in 'wn' else 'low') else 0.0


def cycle_route(block, arriving):
    """Clockwise round a block, in the margin between lanes and kerb, with the signals of the streets."""
    o = {s: beside(block, s) + MARGIN / 2 for s in 'wens'}
    line = outline(block.kx0 - o['w'], block.kx1 + o['e'], block.kz0 - o['n'], block.kz1 + o['s'], CORNER + 1.5, 9, 8.0)
    r = Route('cycle round %d %d' % (block.i + 1, block.j + 1), line, lanes=1, lane_width=0.7, speed_limit_kmh=16)
    r.shape, r.closed = 'spline', True
    along = np.arange(0, r.length(), 0.25)
    there = np.array([r.place(s)[0] for s in along])
    for h, i, j in ((EAST, block.i + 1, block.j), (SOUTH, block.i + 1, block.j + 1), (WEST, block.i, block.j + 1),
                    (NORTH, block.i, block.j)):
        for at, signal, group, _ in arriving[(h, i, j)].stops:
            p = arriving[(h, i, j)].place(at)[0]
            off = np.abs((there - p) @ AHEAD[h]) + 0.1 * np.linalg.norm(there - p, axis=1)
            r.stops.append((float(along[np.argmin(off)]), signal, group, 0))
    r.stops.sort()
    return r


def walks(block):
    """Two closed ways on the pavement of a block, one in each direction."""
    out = []
    for k, inset in enumerate((1.15, 1.75)):
        line = outline(block.kx0 + inset, block.kx1 - inset, block.kz0 + inset, block.kz1 - inset, CORNER - inset, 7,
                       8.0)
        r = Route('walk %d %d %s' % (block.i + 1, block.j + 1, 'out' if k else 'in'), line[::-1] if k else line,
                  lanes=1, lane_width=0.6, speed_limit_kmh=5)
        r.shape, r.closed, r.lift = 'spline', True, KERB
        out.append(r)
    return out


def can_stop(kind, route, at):
    """km/h at which a vehicle there can still stop at the next line, braking with 2 m/s²."""
    ahead = [s[0] - at - FRONT[kind] for s in route.stops if s[0] > at]
    return int(3.6 * np.sqrt(4 * max(0.0, min(ahead) - 1))) if ahead else 99


def paint(rng):
    """Which of a type's paints (counted round): light ones more often, since they show at night."""
    return int(rng.choice([0, 0, 1, 2, 2, 3, 4, 4, 5, 6, 7, 7]))


class Traffic:
    def __init__(self):
        self.leaving, self.arriving = street_routes()
        self.streets = list(self.leaving.values())
        self.ways, self.signals = junctions(self.leaving, self.arriving)
        self.cycles = [cycle_route(b, self.arriving) for b in BLOCKS]
        self.walks = [w for b in BLOCKS for w in walks(b)]
        self.bus_stops = []
        for name, at in (('Main Street east 2', 0.45), ('Main Street west 3', 0.45), ('Main Street east 4', 0.5),
                         ('Main Street west 1', 0.5)):
            r = self.by_name(name)
            self.bus_stops.append((r, r.length() * at))
        self.vehicles = self.spread()

    @property
    def routes(self):
        return self.streets + self.ways + self.cycles + self.walks

    def by_name(self, name):
        return next(r for r in self.routes if r.name == name)

    def spread(self):
        """(type, paint, route, at, lane, km/h): where everybody starts."""
        rng = np.random.default_rng(2024)
        out = []
        main = [r for r in self.streets if r.street.lanes > 1]
        heavy = ['bus', 'truck', 'bus', 'van'] * 4 + ['truck', 'van']
        places = [(r, lane) for lane in (0, 1) for r in main]
        light = ['car'] * 120 + ['van'] * 20 + ['motorcycle'] * 15
        rng.shuffle(light)
        free = []
        for k, (r, lane) in enumerate(places):
            L = r.length()
            big = heavy.pop(0) if heavy else None
            if big:
                out.append((big, paint(rng), r, L - STOP_AT - FRONT[big] - 1 - 2 * rng.random(), lane,
                            0 if k % 3 == 0 else 20))
            if len(heavy) > len(places) - 1 - k:
                out.append((heavy.pop(0), paint(rng), r, 18, lane, 20))
            else:
                free.append((r, lane, 12 if big else 30))
                free.append((r, lane, 22 if big else 44))
        for r in self.streets:
            if r.street.lanes == 1:
                n = max(2, int((r.length() - 10) // 12))
                for v in np.linspace(5, r.length() - STOP_AT - FRONT['van'] - 1.5, n):
                    free.append((r, 0, v + 2 * (rng.random() - 0.5)))
        # what the opening view shows is filled first
        order = sorted(rng.permutation(len(free)),
                       key=lambda k: not free[k][0].name.startswith(('Church Street north 2', 'Church Street south 1',
                                                                     'Church Street south 2')))
        for k, kind in zip(order, light):
            r, lane, at = free[k]
            out.append((kind, paint(rng), r, float(at), lane, int(rng.integers(12, 28))))
        for k in range(15):
            r = self.cycles[k % 12]
            out.append(('bicycle', paint(rng), r, float(10 + r.length() * (0.5 * (k // 12) + 0.4 * rng.random())), 0,
                        12))
        for k in range(30):
            r = self.walks[k % 24]
            out.append(('person', paint(rng), r, float(5 + r.length() * (0.5 * (k // 24) + 0.4 * rng.random())), 0, 4))
        # where there is room left
        for k, kind in zip(order[len(light):], ['car', 'car', 'van', 'car', 'car', 'motorcycle', 'car'] * 2):
            r, lane, at = free[k]
            out.append((kind, paint(rng), r, float(at), lane, int(rng.integers(12, 28))))
        return [(*v[:5], min(v[5], can_stop(v[0], v[2], v[3]))) for v in out]

    def parked(self):
        """(type, paint, x, z, yaw degrees) of the cars in the bays."""
        rng = np.random.default_rng(31)
        out = []
        for street, along, k, a, b in segments():
            if not street.parking:
                continue
            side = 1 if street.parking == 'high' else -1
            edge = street.high if side > 0 else street.low
            o = street.at + side * (edge - 1.08)
            # parked as the lane beside goes
            h = (EAST if side > 0 else WEST) if along == 'x' else (NORTH if side > 0 else SOUTH)
            for s in parking_bays(a, b)[:-1]:
                if rng.random() < 0.55:
                    continue
                p = np.array([s + 3, o] if along == 'x' else [o, s + 3]) - AHEAD[h] * (1.25 + 0.3 * rng.random())
                yaw = np.degrees(np.arctan2(AHEAD[h][0], AHEAD[h][1])) + 2 * (rng.random() - 0.5)
                out.append(('van' if rng.random() < 0.2 else 'car', paint(rng), p[0], p[1], yaw))
        return out


def spline_end(points, end):
    """Direction of a Catmull-Rom spline at its first (0) or last (1) point: its first three
    points are in one line, so that this is the direction of the first two."""
    return points[1] - points[0] if end == 0 else points[-1] - points[-2]


def check(traffic):
    """Every route leads on, without a step or a corner; every way through a junction is there."""
    routes = {r.name: r for r in traffic.routes}
    assert len(routes) == len(traffic.routes), 'two routes of one name'
    for r in traffic.routes:
        assert r.closed or r.then, '%s ends' % r.name
        assert np.linalg.norm(np.diff(r.points, axis=0), axis=1).min() > 0.05, '%s: points coincide' % r.name
        if r.closed:
            turn = [np.degrees(np.arccos(np.clip(unit(b - a) @ unit(c - b), -1, 1))) for a, b, c in
                    zip(r.points, np.roll(r.points, -1, 0), np.roll(r.points, -2, 0))]
            assert max(turn) < 25, '%s: a corner of %.0f degrees' % (r.name, max(turn))
        for name in r.then:
            n = routes[name]
            assert np.linalg.norm(r.points[-1] - n.points[0]) < 0.01 + LANE / 2, '%s -> %s: a step' % (r.name, name)
            c = unit(spline_end(r.points, 1)) @ unit(spline_end(n.points, 0))
            assert c > np.cos(np.radians(1)), '%s -> %s: a corner' % (r.name, name)
        for at, signal, group, _ in r.stops:
            assert 0 < at < r.length() and group < len(traffic.signals[signal][0]), r.name
    for (h, i, j), r in traffic.arriving.items():
        ways = [t for t in TURN if ((h + t) % 4, i, j) in traffic.leaving]
        assert len(r.then) == len(ways) > 0, '%s: ways through its junction' % r.name
        assert bool(r.stops) == (junction_kind(i, j) != 'bend')
    # from everywhere to everywhere
    for start in traffic.streets[:1]:
        seen, todo = set(), [start.name]
        while todo:
            n = todo.pop()
            if n not in seen:
                seen.add(n)
                todo += routes[n].then
        missing = {r.name for r in traffic.streets + traffic.ways} - seen
        assert not missing, missing
    gaps = {}
    for kind, _, r, at, lane, _ in traffic.vehicles:
        assert 0 <= at <= r.length() and lane < r.fields['lanes'], (kind, r.name, at)
        gaps.setdefault((r.name, lane), []).append((at, kind))
    for key, there in gaps.items():
        there.sort()
        for (a, first), (b, second) in zip(there, there[1:]):
            assert b - a > FRONT[first] + BEHIND[second] + 1.5, 'two vehicles at one place: %s %.0f %.0f' % (key, a, b)


def unit(v):
    return v / np.linalg.norm(v)


if __name__ == '__main__':
    t = Traffic()
    check(t)
    kinds = [v[0] for v in t.vehicles]
    print(len(t.streets), 'streets', len(t.ways), 'ways', len(t.signals), 'signals',
          {k: kinds.count(k) for k in sorted(set(kinds))}, len(t.parked()), 'parked')
