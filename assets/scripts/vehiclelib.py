"""What the vehicles share besides bodies (`bodylib`) and textures (`atlaslib`): wheels, lamps,
plates, and the file with the names that code relies on."""

from atlaslib import *
from bodylib import *


# -------------------------------------------------------------------- wheels

TURN = np.array([[0, 1, 0], [0, 0, -1], [-1, 0, 0]], float)      # axis +Y -> +X, image up stays up


def tyre(atlas, R, rim_r, width, seg, offset=0.0, rows=None):
    """A tyre around X; its tile repeats, mirrored, with each segment."""
    w = width / 2
    # section (radius, axis, v of the tile) from the inner bead over the tread to the outer
    sec = rows or [(rim_r, -w + 0.012, 0.0), (rim_r + 0.45 * (R - rim_r), -w, 0.12),
                   (R - 0.10 * (R - rim_r) - 0.004, -w + 0.012, 0.23),
                   (R, -w + 0.22 * width, 0.32), (R, w - 0.22 * width, 0.68),
                   (R - 0.10 * (R - rim_r) - 0.004, w - 0.012, 0.77),
                   (rim_r + 0.45 * (R - rim_r), w, 0.88), (rim_r, w - 0.012, 1.0)]
    k = len(sec)
    ang = np.arange(seg + 1) / seg * 2 * np.pi
    ang[-1] = 0
    P = np.array([[(r * np.cos(a), y + offset, -r * np.sin(a)) for r, y, _ in sec] for a in ang])
    x, y, tw, th = atlas.uv['tyre']
    UV = np.array([[(x + tw * (i % 2), y + th * v) for *_, v in sec] for i in range(seg + 1)])
    F = [t for i in range(seg) for j in range(k - 1)
         for t in ((i * k + j, (i + 1) * k + j, (i + 1) * k + j + 1), (i * k + j, (i + 1) * k + j + 1, i * k + j + 1))]
    return creased(P.reshape(-1, 3), UV.reshape(-1, 2), F, 60).mat(TURN)


def disc(atlas, profile, seg, rim_r, back=None):
    """The wheel's face: (radius, axis) points from the rim inward, textured with the rim image; a dark back."""
    face = lathe(profile, seg, 38)
    x, y, w, h = atlas.uv['rim']
    face = face.uvmap(lambda P, UV: np.stack([x + w * (0.5 + 0.49 * P[:, 0] / rim_r),
                                              y + h * (0.5 + 0.49 * P[:, 2] / rim_r)], 1))
    parts = [face.mat(TURN)]
    if back is not None:
        plate = lathe([(0.0, back), (1.07 * rim_r, back)], seg // 2, 30)
        if plate.N[:, 1].mean() > 0:
            plate = plate.flip()
        parts.append(plate.mat(TURN).swatch(*atlas.uv['under']))
    return parts


def wheel(atlas, R, width, rim_r, seg=24, dish=0.035, hub=0.02):
    """A single wheel around X, outside toward +X."""
    w = width / 2
    profile = [(rim_r, w - 0.012), (0.93 * rim_r, w - 0.020), (0.84 * rim_r, w - dish), (0.24 * rim_r, w - dish + hub),
               (0.15 * rim_r, w - dish + hub + 0.012), (0.0, w - dish + hub + 0.014)]
    return merge(tyre(atlas, R, rim_r, width, seg), *disc(atlas, profile, seg, rim_r, -w + 0.03))


def heavy_wheel(atlas, R, width, rim_r, seg=20):
    """The front wheel of a truck or bus: its face bulges outward."""
    w = width / 2
    profile = [(rim_r, w - 0.012), (0.90 * rim_r, w - 0.05), (0.62 * rim_r, w - 0.035), (0.50 * rim_r, w + 0.015),
               (0.24 * rim_r, w + 0.03), (0.0, w + 0.03)]
    return merge(tyre(atlas, R, rim_r, width, seg), *disc(atlas, profile, seg, rim_r, -w + 0.04))


def double_wheel(atlas, R, width, rim_r, seg=20, gap=0.05):
    """Two tyres side by side, one mesh: the face lies deep in the outer one."""
    w = width / 2
    out = w + gap / 2
    profile = [(rim_r, out + w - 0.012), (0.94 * rim_r, out + w - 0.05), (0.86 * rim_r, out - 0.06),
               (0.50 * rim_r, out - 0.08), (0.44 * rim_r, out + 0.02), (0.0, out + 0.03)]
    inner = [(rim_r, -w + 0.012, 0.0), (R - 0.02, -w + 0.01, 0.2), (R, -w + 0.22 * width, 0.32),
             (R, w - 0.22 * width, 0.68), (R - 0.03, w, 0.8)]
    return merge(tyre(atlas, R, rim_r, width, seg, out), tyre(atlas, R, rim_r, width, 12, -out, inner),
                 *disc(atlas, profile, seg, rim_r, -out - w + 0.04))


# --------------------------------------------------------------------- lamps

def local(part, origin, direction):
    """A part seen from a node at `origin` whose -Z points in `direction`; with that node's rotation."""
    q = np.array(aim(direction))
    x, y, z, w = q
    R = np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                  [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                  [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])
    p = part.copy()
    p.P, p.N = (p.P - origin) @ R, p.N @ R
    return p, tuple(q)


def tilted(degrees, sign=1, outward=0.0):
    """A direction forward (sign 1) or backward, so much down, so much outward."""
    d, o = np.radians(degrees), np.radians(outward)
    return np.array([np.sin(o) * np.cos(d), -np.sin(d), sign * np.cos(o) * np.cos(d)])


HEAD, TAIL = tilted(3.4), tilted(0, -1)


class Vehicle:
    """The file: root, materials on one atlas, body, wheels and lamps by the names that code relies on."""

    def __init__(self, name, atlas, coat, quality=86):
        self.g, self.atlas = Glb(), atlas
        self.images = base, nrm, orm = atlas.images(self.g, name, quality=quality)
        mat = lambda n, color=(1, 1, 1, 1): self.g.material(n, base, nrm, orm, color=color, occlusion=True)
        self.paint, self.trim = mat('paint', (*coat, 1)), mat('trim')
        self._mat, self.mats = mat, {}
        self.root = self.g.node(name)

    def glass(self, kind):
        if kind not in self.mats:
            self.mats[kind] = self._mat(kind)
        return self.mats[kind]

    def body(self, paint, trim, cuts=None, name='body', parent=None, t=None):
        prims = [(merge(*p), m) for p, m in ((paint, self.paint), (trim, self.trim)) if p]
        parent = self.root if parent is None else parent
        if cuts is None:
            return self.g.node(name, self.g.mesh(name, prims), t, parent=parent)
        node = self.g.node(name, None, t, parent=parent)
        self.g.piece_nodes(name, prims, {2: cuts}, node)
        return node

    def wheels(self, part, places, parent=None):
        """places: name without side -> (x, y, z); one mesh for all, the right-hand ones turned half round."""
        mesh = self.g.mesh('wheel', [(part, self.trim)])
        self.wheel_mesh = mesh
        self.more_wheels(mesh, places, parent)

    def more_wheels(self, mesh, places, parent=None):
        for name, (x, y, z) in places.items():
            for side, sx in (('left', 1), ('right', -1)):
                self.g.node('%s_%s' % (name, side), mesh, (sx * x, y, z), None if sx > 0 else (0, 1, 0, 0),
                            self.root if parent is None else parent)

    def lamp(self, name, part, kind, direction, parent=None):
        """A lamp's glass as a mesh of its own: origin in the middle, light along local -Z."""
        a, b, c = (part.P[part.F[:, k]] for k in range(3))
        seen = np.clip(np.cross(b - a, c - a) @ direction, 0, None)[:, None]
        origin = ((a + b + c) / 3 * seen).sum(0) / seen.sum()
        p, q = local(part, origin, direction)
        mesh = self.g.mesh(name, [(p, self.glass(kind))])
        self.g.node(name, mesh, origin, q, self.root if parent is None else parent)

    def lamps(self, name, part, kind, direction, parent=None):
        """The same left and right; the part is the left one."""
        for side, sx in (('left', 1), ('right', -1)):
            self.lamp('%s_%s' % (name, side), part if sx > 0 else mirror_x(part), kind, direction * (sx, 1, 1), parent)


def on_rect(part, rect, axes=(0, 1), flip=False):
    """Map a part's extent along two axes on a rectangle of the atlas (image up = second axis)."""
    x, y, w, h = rect

    def f(P, UV):
        q = P[:, axes].astype(float)
        third = [k for k in range(3) if k not in axes][0]
        q = q + P[:, [third]] * (0.05, 0.05)             # faces seen edge-on keep an area
        q = (q - q.min(0)) / np.maximum(np.ptp(q, axis=0), 1e-9)
        u = 1 - q[:, 0] if flip else q[:, 0]
        return np.stack([x + w * u, y + h * (1 - q[:, 1])], 1)
    return part.uvmap(f)


def lens_box(size, rect, at, backward=False):
    """A lamp's glass as a box, seen from the front or the back."""
    return on_rect(box(*size), rect, flip=backward).move(*at)


def plate(atlas, at, backward=False, tilt=0.0, size=(0.46, 0.11)):
    """A number plate at a point, facing forward or backward."""
    p = box(size[0], size[1], 0.012, 0.0)
    p = on_rect(p, atlas.uv['plate'], flip=backward)
    return p.rot('x', tilt).move(*at)
