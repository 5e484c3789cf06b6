"""Flat faces put together into meshes whose UVs are metres; planes of a block's outline."""

import numpy as np
from meshlib import Part


class Faces:
    """Quads and triangles with flat normals. UVs are the metres along the face as its image
    stands upright on it: right and down."""

    def __init__(self):
        self.corners, self.P, self.N, self.UV, self.F = {}, [], [], [], []

    def vertex(self, p, n, uv):
        key = tuple(np.round(np.concatenate([p, n, uv]), 4))
        if key not in self.corners:
            self.corners[key] = len(self.P)
            self.P.append(p); self.N.append(n); self.UV.append(uv)
        return self.corners[key]

    def face(self, points, uv=None):
        """A convex face, counter-clockwise seen from the front."""
        p = np.asarray(points, float)
        n = np.cross(p[1] - p[0], p[2] - p[0])
        if np.linalg.norm(n) < 1e-9:
            n = np.cross(p[2] - p[0], p[3] - p[0])
        n = n / np.linalg.norm(n)
        if uv is None:
            uv = self.metres(p, n)
        ids = [self.vertex(q, n, np.asarray(t, float)) for q, t in zip(p, uv)]
        self.F += [(ids[0], ids[i], ids[i + 1]) for i in range(1, len(ids) - 1)]

    @staticmethod
    def metres(p, n):
        if abs(n[1]) > 0.95:
            return np.stack([p[:, 0], p[:, 2] * np.sign(n[1])], 1)
        right = np.array([n[2], 0, -n[0]])
        right = right / np.linalg.norm(right)
        down = -np.cross(n, right)
        return np.stack([p @ right, p @ down], 1)

    def box(self, x0, x1, y0, y1, z0, z1, sides='xXyYzZ'):
        """A box; of its sides (lower-case: toward the lower coordinate) those named."""
        q = self.face
        if 'Z' in sides: q([(x0, y0, z1), (x1, y0, z1), (x1, y1, z1), (x0, y1, z1)])
        if 'z' in sides: q([(x1, y0, z0), (x0, y0, z0), (x0, y1, z0), (x1, y1, z0)])
        if 'X' in sides: q([(x1, y0, z1), (x1, y0, z0), (x1, y1, z0), (x1, y1, z1)])
        if 'x' in sides: q([(x0, y0, z0), (x0, y0, z1), (x0, y1, z1), (x0, y1, z0)])
        if 'Y' in sides: q([(x0, y1, z1), (x1, y1, z1), (x1, y1, z0), (x0, y1, z0)])
        if 'y' in sides: q([(x0, y0, z0), (x1, y0, z0), (x1, y0, z1), (x0, y0, z1)])

    def prism(self, x, z, r, y0, y1, n=6, r1=None, top=True):
        """An upright prism with n sides, tapering to r1, smooth around."""
        r1 = r if r1 is None else r1
        a = np.arange(n + 1) / n * 2 * np.pi
        ring = [np.array([np.cos(t), 0, -np.sin(t)]) for t in a]
        c = np.array([x, 0, z])
        ids = [(self.vertex(c + r * d + (0, y0, 0), d, np.array([k * r, -y0])),
                self.vertex(c + r1 * d + (0, y1, 0), d, np.array([k * r, -y1]))) for k, d in zip(a, ring)]
        for (p, q), (s, t) in zip(ids, ids[1:]):
            self.F += [(p, s, t), (p, t, q)]
        if top:
            self.face([c + r1 * d + (0, y1, 0) for d in ring[:-1]])

    def add(self, other, yaw=0.0, at=(0, 0, 0)):
        """Another's faces, turned about Y (degrees) and moved."""
        c, s = np.cos(np.radians(yaw)), np.sin(np.radians(yaw))
        m = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
        ids = [self.vertex(m @ p + at, m @ n, uv) for p, n, uv in zip(other.P, other.N, other.UV)]
        self.F += [tuple(ids[i] for i in f) for f in other.F]

    def part(self):
        return Part(self.P, self.N, self.UV, self.F)

    def __bool__(self):
        return bool(self.F)


def steps(a, b, most):
    """From a to b in equal steps of at most so many metres, both ends included."""
    return np.linspace(a, b, max(1, int(np.ceil((b - a) / most - 1e-6))) + 1)


def sheet(faces, xs, zs, height, lift):
    """A surface seen from above over a grid of lines, `lift` above `height`. Its normals
    are those of the height function, so that a slope is smooth."""
    e = 0.05

    def vertex(x, z):
        slope_x = (height(x + e, z) - height(x - e, z)) / (2 * e)
        slope_z = (height(x, z + e) - height(x, z - e)) / (2 * e)
        n = np.array([-slope_x, 1.0, -slope_z])
        return faces.vertex(np.array([x, height(x, z) + lift, z]), n / np.linalg.norm(n), np.array([x, z]))
    for x0, x1 in zip(xs, xs[1:]):
        for z0, z1 in zip(zs, zs[1:]):
            a, b, c, d = vertex(x0, z1), vertex(x1, z1), vertex(x1, z0), vertex(x0, z0)
            faces.F += [(a, b, c), (a, c, d)]


def outline(x0, x1, z0, z1, r, arc=7, step=1e9):
    """A rounded rectangle as a closed line, clockwise on the map (east along the north side)."""
    pts = []
    for cx, cz, a0 in ((x1 - r, z0 + r, -90), (x1 - r, z1 - r, 0), (x0 + r, z1 - r, 90), (x0 + r, z0 + r, 180)):
        corner = [(cx + r * np.cos(np.radians(a)), cz + r * np.sin(np.radians(a)))
                  for a in np.linspace(a0, a0 + 90, arc)]
        if pts:
            pts += between(pts[-1], corner[0], step)
        pts += corner
    return np.array(pts + between(pts[-1], pts[0], step))


def between(a, b, step):
    a, b = np.array(a), np.array(b)
    n = int(np.ceil(np.linalg.norm(b - a) / step - 1e-6))
    return [tuple(a + (b - a) * k / n) for k in range(1, n)]


def kerb(faces, line, closed, height, top, width=0.15, bottom=-0.06):
    """A kerb along a line of (x, z) whose left side, in the sense of travel on the map, is the road:
    its face toward the road, a bevel, its top."""
    line = np.asarray(line, float)
    n = len(line)
    tangent = np.roll(line, -1, 0) - np.roll(line, 1, 0) if closed else np.gradient(line, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    out = np.stack([tangent[:, 1], -tangent[:, 0]], 1)
    profile = [(0.0, bottom, (1, 0)), (0.0, top - 0.025, (1, 0)), (0.0, top - 0.025, (0.7, 0.7)),
               (-0.025, top, (0.7, 0.7)), (-0.025, top, (0, 1)), (-width, top, (0, 1))]
    along = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(np.concatenate([line, line[:1]]), axis=0), axis=1))])
    rows = []
    for k in range(n + 1 if closed else n):
        i = k % n
        row, across = [], 0.0
        for m, (o, y, (no, ny)) in enumerate(profile):
            if m:
                across += np.hypot(o - profile[m - 1][0], y - profile[m - 1][1])
            p = line[i] + out[i] * o
            normal = np.array([out[i][0] * no, ny, out[i][1] * no])
            row.append(faces.vertex(np.array([p[0], height(p[0], p[1]) + y, p[1]]), normal / np.linalg.norm(normal),
                                    np.array([along[k], -across])))
        rows.append(row)
    for a, b in zip(rows, rows[1:]):
        for m in (0, 2, 4):
            faces.F += [(b[m], a[m], a[m + 1]), (b[m], a[m + 1], b[m + 1])]
