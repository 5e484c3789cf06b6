"""The plan of the night town: streets, blocks, heights. Metres, +X east, +Z south, +Y up.

Five streets run north-south (columns) and four east-west (rows); the outermost ones are a
ring, so that no street ends. Row 1 is the main street. The north-east corner is a hill.
"""

import numpy as np

LANE = 3.2              # width of a lane
MARGIN = 0.7            # between the outer lane and the kerb or the parked cars: bicycles
PARKING = 2.4           # width of a row of parked cars
KERB = 0.12             # height of the pavements
CORNER = 5.0            # radius of the kerb at corners
BLOCK_X, BLOCK_Z = 70.2, 55.2       # of a block, from house front to house front
DEPTH = 9.0             # of a house
HILL = 4.5              # how high the hill is


class Street:
    """A street along x (a row) or z (a column). `low` and `high` are how far its carriageway
    reaches from the centre line toward the lower and the higher coordinate."""

    def __init__(self, name, lanes=1, surface='asphalt', parking=None):
        self.name, self.lanes, self.surface, self.parking = name, lanes, surface, parking
        half = lanes * LANE + MARGIN
        self.low = half + (PARKING if parking == 'low' else 0)
        self.high = half + (PARKING if parking == 'high' else 0)
        self.pavement = 4.0 if lanes > 1 else 3.0
        self.at = 0.0

    @property
    def line(self):
        """From the centre line to the middle of the lanes of one direction."""
        return self.lanes * LANE / 2


COLUMNS = [Street('West Ring'), Street('Mill Street', surface='cobble', parking='high'),
           Street('Church Street', surface='cobble'),
           Street('Castle Street', surface='cobble', parking='low'), Street('East Ring')]
ROWS = [Street('North Ring'), Street('Main Street', lanes=2), Street('Market Street', surface='cobble', parking='high'),
        Street('South Ring')]


def lay(streets, block, zero):
    for a, b in zip(streets, streets[1:]):
        b.at = a.at + a.high + a.pavement + block + b.pavement + b.low
    shift = streets[zero].at
    for s in streets:
        s.at = round(s.at - shift, 3)


lay(COLUMNS, BLOCK_X, 2)
lay(ROWS, BLOCK_Z, 1)


def ramp(t):
    """From 0 at t = 0 to 1 at t = 1: straight, with rounded ends; its slope is at most 1.25."""
    t, r = np.clip(t, 0, 1), 0.2
    middle = (t - r / 2) / (1 - r)
    return np.where(t < r, t ** 2 / (2 * r * (1 - r)),
                    np.where(t > 1 - r, 1 - (1 - t) ** 2 / (2 * r * (1 - r)), middle))


# where the two climbs begin and end: between the junctions, which are level
CLIMB_X = (COLUMNS[3].at + COLUMNS[3].high + CORNER + 4, COLUMNS[4].at - COLUMNS[4].low - CORNER - 4)
CLIMB_Z = (ROWS[1].at - ROWS[1].low - CORNER - 3, ROWS[0].at + ROWS[0].high + CORNER + 3)


def height(x, z):
    """Of the road's surface or, 0.12 m lower, the pavement's."""
    a = ramp((np.asarray(x, float) - CLIMB_X[0]) / (CLIMB_X[1] - CLIMB_X[0]))
    b = ramp((np.asarray(z, float) - CLIMB_Z[0]) / (CLIMB_Z[1] - CLIMB_Z[0]))
    return HILL * a * b


class Block:
    """Column i, row j of the 4 × 3 blocks. x0..z1: the fronts of its houses; kx0..kz1: its kerb."""

    def __init__(self, i, j):
        w, e, n, s = COLUMNS[i], COLUMNS[i + 1], ROWS[j], ROWS[j + 1]
        self.i, self.j = i, j
        self.kx0, self.kx1 = w.at + w.high, e.at - e.low
        self.kz0, self.kz1 = n.at + n.high, s.at - s.low
        self.x0, self.x1 = self.kx0 + w.pavement, self.kx1 - e.pavement
        self.z0, self.z1 = self.kz0 + n.pavement, self.kz1 - s.pavement
        self.hilly = (i, j) == (3, 0)
        self.square = (i, j) == (1, 1)

    @property
    def middle(self):
        return (self.kx0 + self.kx1) / 2, (self.kz0 + self.kz1) / 2


BLOCKS = [Block(i, j) for j in range(3) for i in range(4)]

# the square takes the north-east corner of its block
SQUARE_X, SQUARE_Z = 33.0, 31.2


def square():
    """x0, x1, z0, z1 of the open square."""
    b = next(b for b in BLOCKS if b.square)
    return b.x1 - SQUARE_X, b.x1, b.z0, b.z0 + SQUARE_Z


def segments():
    """The carriageways between junctions: (street, along, k, from, to); along is 'x' or 'z'."""
    for street in ROWS:
        for k, (a, b) in enumerate(zip(COLUMNS, COLUMNS[1:])):
            yield street, 'x', k, a.at + a.high + CORNER, b.at - b.low - CORNER
    for street in COLUMNS:
        for k, (a, b) in enumerate(zip(ROWS, ROWS[1:])):
            yield street, 'z', k, a.at + a.high + CORNER, b.at - b.low - CORNER


def climbs(street, along, k):
    return (along == 'x' and street is ROWS[0] and k == 3) or (along == 'z' and street is COLUMNS[4] and k == 0)
