"""The delivery van: a rounded snub-nosed panel van of our own design.

The shell is a rounded box bent by a few smooth functions. Each face of the box
is one chart: its points are triangulated in the plane it is projected on (so
that wheel arches and windows are true outlines), its normals come from the
function itself, and its texture is drawn in metres in the same plane. The coat is
the part below the belt line; the cream above it stays."""

import os
import sys
from vehiclelib import *

# ------------------------------------------------------------------ the shape

HX, L, Y0, Y1 = 0.93, 2.10, 0.30, 2.06
CY, HY = (Y0 + Y1) / 2, (Y1 - Y0) / 2
R = np.array([0.17, 0.17, 0.24])
AXLES = (1.30, -1.22)
HUB_Y, WHEEL_R, ARCH_R = 0.335, 0.335, 0.415
TRACK = 0.755                                # hub centre from the middle plane
REAR = -AXLES[1]                             # the file's origin is below the rear axle, this far behind the middle

_prof_y = np.array([0.20, 0.30, 0.42, 0.60, 0.78, 0.92, 1.03, 1.11, 1.165, 1.205, 1.26, 1.50, 1.75, 1.90, 2.00, 2.10,
                    2.30])
_prof_z = np.array([0.10, 0.07, 0.015, 0.0, 0.0, 0.025, 0.075, 0.16, 0.29, 0.435, 0.500, 0.605, 0.735, 0.83, 0.90, 0.98,
                    1.15])
_ty = np.linspace(0.2, 2.3, 421)
_tz = np.interp(_ty, _prof_y, _prof_z)
_k = np.exp(-0.5 * (np.arange(-20, 21) / 5.0) ** 2)
_tz = np.convolve(np.pad(_tz, 20, mode='edge'), _k / _k.sum(), 'valid')


def deform(p):
    x, y, z = p[..., 0].copy(), p[..., 1].copy(), p[..., 2].copy()
    s = np.clip((z - 0.05) / (L - 0.05), 0, 1) ** 1.35
    z = z - s * np.interp(y, _ty, _tz)
    # the tail leans in a little
    z = z + smooth(-0.6, -2.1, z) * 0.09 * smooth(0.8, 2.2, y)
    # tumblehome, rocker tuck, tapered nose and tail
    w = 1 - 0.085 * smooth(0.95, 2.2, y) - 0.030 * smooth(0.75, 0.28, y)
    w = w - 0.085 * np.clip((z - 0.9) / 1.2, 0, 1) ** 2 - 0.020 * np.clip((-z - 1.0) / 1.1, 0, 1) ** 2
    # gentle barrel so that highlights move over the flanks
    w = w + 0.012 * np.exp(-((y - 0.98) / 0.35) ** 2)
    x = x * w
    top = smooth(1.55, 2.06, y)
    y = y + top * (0.055 * (1 - (x / HX) ** 2) - 0.035 * ((z + 0.3) / 2.0) ** 2)
    # the bonnet is crowned
    nose = smooth(0.85, 1.15, y) * smooth(1.35, 1.15, y) * smooth(1.3, 1.7, z)
    y = y + 0.045 * nose * (1 - (x / HX) ** 2)
    # plan view: the front bows out in the middle, and so does the tail
    z = z + 0.060 * (1 - (x / HX) ** 2) * smooth(0.6, 2.0, z) - 0.020 * (1 - (x / HX) ** 2) * smooth(-1.5, -2.1, z)
    return np.stack([x, y, z], -1)


def rounded(p):
    q = p - np.array([0, CY, 0])
    h = np.array([HX, HY, L])
    inner = np.clip(q, -(h - R), h - R)
    d = (q - inner) / R
    n = np.linalg.norm(d, axis=-1, keepdims=True)
    d = d / np.where(n < 1e-9, 1, n)
    return inner + R * d + np.array([0, CY, 0])


FACES = {
    # face: (map of two parameters to the box, plane axes (i, j), sign of normal axis)
    'side': (lambda a, b: np.stack([np.full_like(a, HX), b, a], -1), (2, 1)),
    'front': (lambda a, b: np.stack([a, b, np.full_like(a, L)], -1), (0, 1)),
    'rear': (lambda a, b: np.stack([a, b, np.full_like(a, -L)], -1), (0, 1)),
    'roof': (lambda a, b: np.stack([b, np.full_like(a, Y1), a], -1), (2, 0)),
}
OUT = {'side': (0, 1), 'front': (2, 1), 'rear': (2, -1), 'roof': (1, 1)}


def surf(face, a, b):
    return deform(rounded(FACES[face][0](np.asarray(a, float), np.asarray(b, float))))


def surf_normal(face, a, b):
    e = 2e-3
    du = surf(face, a + e, b) - surf(face, a - e, b)
    dv = surf(face, a, b + e) - surf(face, a, b - e)
    n = np.cross(du, dv)
    n /= np.linalg.norm(n, axis=-1, keepdims=True)
    # the fillet's own direction tells outside from inside
    p = rounded(FACES[face][0](a, b))
    out = p - np.clip(p, [-HX + R[0], Y0 + R[1], -L + R[2]], [HX - R[0], Y1 - R[1], L - R[2]])
    flip = (n * out).sum(-1) < 0
    return np.where(flip[..., None], -n, n)


def invert(face, c):
    """Parameters of the surface points that project to plane points c."""
    i, j = FACES[face][1]
    a, b = c[:, 0].copy(), c[:, 1].copy()
    if face == 'side':
        a = np.clip(a + np.clip(a / L, 0, 1) ** 1.35 * np.interp(b, _ty, _tz), -L, L)
    lim = {'side': ((-L, L), (Y0, Y1)), 'front': ((-HX, HX), (Y0, Y1)), 'rear': ((-HX, HX), (Y0, Y1)),
           'roof': ((-L, L), (-HX, HX))}[face]
    e = 1e-4
    for _ in range(40):
        f = surf(face, a, b)[:, (i, j)] - c
        fa = (surf(face, a + e, b)[:, (i, j)] - surf(face, a - e, b)[:, (i, j)]) / (2 * e)
        fb = (surf(face, a, b + e)[:, (i, j)] - surf(face, a, b - e)[:, (i, j)]) / (2 * e)
        det = fa[:, 0] * fb[:, 1] - fa[:, 1] * fb[:, 0]
        det = np.where(np.abs(det) < 1e-6, 1e-6, det)
        da = (f[:, 0] * fb[:, 1] - f[:, 1] * fb[:, 0]) / det
        db = (fa[:, 0] * f[:, 1] - fa[:, 1] * f[:, 0]) / det
        a = np.clip(a - np.clip(da, -0.1, 0.1), *lim[0])
        b = np.clip(b - np.clip(db, -0.1, 0.1), *lim[1])
    return a, b


# ------------------------------------------------------------------- outlines

# side windows, in (z, y)
WIN_DOOR = round_poly([(0.66, 1.235), (1.30, 1.235), (0.985, 1.79), (0.66, 1.79)], [0.05, 0.06, 0.09, 0.05], 45)
WIN_LOAD = round_poly([(-0.17, 1.235), (0.54, 1.235), (0.54, 1.79), (-0.17, 1.79)], 0.06, 45)
WINDSCREEN = round_poly([(-0.735, 1.275), (0.735, 1.275), (0.645, 1.815), (-0.645, 1.815)], [0.10, 0.10, 0.12, 0.12])
WIN_REAR = [round_poly([(0.06, 1.28), (0.60, 1.28), (0.56, 1.76), (0.06, 1.76)], [0.05, 0.08, 0.09, 0.05], 45)]
WIN_REAR.append(WIN_REAR[0][::-1] * (-1, 1))

ZP = [-2.10, -2.02, -1.94, -1.86, -1.0, 0.05, 0.80, 1.25, 1.60, 1.86, 1.94, 2.02, 2.10]
YP = [0.30, 0.385, 0.47, 0.78, 0.98, 1.099, 1.19, 1.26, 1.45, 1.70, 1.89, 1.975, 2.06]
XP = [-0.93, -0.845, -0.76, -0.40, 0.0, 0.40, 0.76, 0.845, 0.93]
BELT, EDGE = 1.135, 0.036                    # the colour break; the coat begins EDGE below it, under the pin stripe


def swoop(x):
    """Height of the colour break on the front."""
    return BELT - 0.43 * (1 - smooth(0.0, 0.86, np.abs(x)))


LEVEL = np.array([(-3.0, BELT - EDGE), (3.0, BELT - EDGE)])
SWOOP = np.stack([np.linspace(-1.2, 1.2, 25), swoop(np.linspace(-1.2, 1.2, 25)) - EDGE], 1)
GRILLE = round_poly([(-0.375, 0.63), (0.375, 0.63), (0.375, 0.84), (-0.375, 0.84)], 0.10)


def chart(face, A, B, windows=(), arches=(), belt=None, plain=()):
    """Triangulate one face: (coat, everything else). belt: the line below which it is painted (None: nowhere);
    plain: outlines below the belt that are not."""
    A, B = np.array(A), np.array(B)
    i, j = FACES[face][1]
    edge = ([(a, B[0]) for a in A] + [(A[-1], b) for b in B[1:]] + [(a, B[-1]) for a in A[::-1][1:]]
            + [(A[0], b) for b in B[::-1][1:-1]])
    edge = np.array(edge)
    rim3 = surf(face, edge[:, 0], edge[:, 1])
    border = rim3[:, (i, j)]
    ga, gb = np.meshgrid(A[1:-1], B[1:-1], indexing='ij')
    grid = np.stack([ga.ravel(), gb.ravel()], 1)
    gp = surf(face, grid[:, 0], grid[:, 1])[:, (i, j)]
    keep = np.ones(len(gp), bool)
    loops = list(windows) + list(arches) + list(plain)
    for w in windows:
        keep &= seg_dist(w, gp[:, 0], gp[:, 1]) > 0.030
    for c in arches:
        keep &= poly_sdf(c, gp[:, 0], gp[:, 1]) > 0.030
    for c in plain:
        keep &= seg_dist(c, gp[:, 0], gp[:, 1]) > 0.030
    if belt is not None:
        keep &= seg_dist(belt, gp[:, 0], gp[:, 1], False) > 0.030
    grid, gp = grid[keep], gp[keep]
    verts = [tuple(p) for p in border] + [tuple(p) for p in gp]
    edges = [(k, (k + 1) % len(border)) for k in range(len(border))]
    for c in loops:
        s = len(verts)
        verts += [tuple(p) for p in c]
        edges += [(s + k, s + (k + 1) % len(c)) for k in range(len(c))]
    if belt is not None:
        s = len(verts)
        verts += [tuple(p) for p in belt]
        edges += [(s + k, s + k + 1) for k in range(len(belt) - 1)]
    vo, _, fo, vorig, _, _ = delaunay_2d_cdt([(float(x), float(y)) for x, y in verts], edges, [], 0, 1e-6)
    V = np.array([tuple(v) for v in vo])
    T = np.array([tuple(f) for f in fo])
    nb, ng = len(border), len(gp)
    par = np.zeros((len(V), 2))
    todo = np.ones(len(V), bool)
    for k, o in enumerate(vorig):
        for s in o:
            if s < nb:
                par[k], todo[k] = edge[s], False
            elif s < nb + ng:
                par[k], todo[k] = grid[s - nb], False
    a, b = invert(face, V[todo])
    par[todo] = np.stack([a, b], 1)
    P = surf(face, par[:, 0], par[:, 1])
    N = surf_normal(face, par[:, 0], par[:, 1])
    cen = V[T].mean(1)
    ok = inside(border, cen)
    for c in arches:
        ok &= ~inside(c, cen)
    T, cen = T[ok], cen[ok]
    # outward winding
    fn = np.cross(P[T[:, 1]] - P[T[:, 0]], P[T[:, 2]] - P[T[:, 0]])
    flip = (fn * N[T].mean(1)).sum(1) < 0
    T[flip] = T[flip][:, ::-1]
    UV = uv_of(face, P)
    glass_sel = np.zeros(len(T), bool)
    extra = []
    for w in windows:
        glass_sel |= inside(w, cen)
        # a sunk pane with a rounded rubber rim
        wa, wb = invert(face, w)
        wp, wn = surf(face, wa, wb), surf_normal(face, wa, wb)
        k = len(w)
        ctr = wp.mean(0)
        outw = wp - ctr
        outw = outw - wn * (outw * wn).sum(1, keepdims=True)
        outw /= np.linalg.norm(outw, axis=1, keepdims=True)
        rings = [(0.020, 0.000, (wn * 0.5 + outw)), (0.006, 0.012, wn), (-0.008, -0.012, (wn * 0.4 - outw))]
        RP = np.concatenate([wp + outw * o + wn * d for o, d, _ in rings])
        RN = np.concatenate([n / np.linalg.norm(n, axis=1, keepdims=True) for *_, n in rings])
        F = []
        for r in range(len(rings) - 1):
            for q in range(k):
                q2 = (q + 1) % k
                F += [(r * k + q, r * k + q2, (r + 1) * k + q2), (r * k + q, (r + 1) * k + q2, (r + 1) * k + q)]
        F = np.array(F)
        fn = np.cross(RP[F[:, 1]] - RP[F[:, 0]], RP[F[:, 2]] - RP[F[:, 0]])
        fl = (fn * RN[F].mean(1)).sum(1) < 0
        F[fl] = F[fl][:, ::-1]
        t = np.tile(np.arange(k) / k, len(rings))
        ruv = np.stack([t, np.repeat(np.arange(len(rings)) / 2.0, k)], 1)
        extra.append(Part(RP, RN, ruv, F).swatch(*SW['rubber']))
    coat = np.zeros(len(T), bool)
    if belt is not None:
        coat = ~glass_sel & (cen[:, 1] < np.interp(cen[:, 0], belt[:, 0], belt[:, 1]))
        for c in plain:
            coat &= ~inside(c, cen)
    return Part(P, N, UV, T[coat]), [Part(P, N, UV, T[~glass_sel & ~coat]),
                                     Part(P - N * 0.010, N, UV, T[glass_sel])] + extra


# -------------------------------------------------------------------- atlas

SIZE = 1024                                  # drawn at this size, saved at half of it
# name: pixel rectangle (x, y, w, h) and the plane extents (left, right, bottom, top)
RECT = {
    'side': ((0, 0, 1024, 464), (-2.2, 2.2, 0.21, 2.2037)),
    'front': ((0, 464, 400, 400), (-1.0, 1.0, 0.21, 2.21)),
    'rear': ((400, 464, 400, 400), (1.0, -1.0, 0.21, 2.21)),     # seen from behind
    'roof': ((0, 864, 760, 160), (-2.2, 2.2, 1.0, -1.0)),
}
SW_PX = {'rubber': (816, 480), 'chrome': (880, 480), 'cream': (944, 480), 'teal': (1000, 480),
         'under': (816, 544), 'steel': (880, 544), 'black': (944, 544), 'wood': (1000, 544),
         'plate': (808, 600), 'lens': (808, 664), 'red': (912, 664), 'amber': (968, 664), 'white': (912, 728)}
SW = {k: ((x + (12 if x == 1000 else 24)) / SIZE, (y + (12 if x == 1000 else 24)) / SIZE)
      for k, (x, y) in SW_PX.items()}
LENS = (808 / SIZE, 664 / SIZE, 96 / SIZE)


def uv_of(face, P):
    (x, y, w, h), (l, r, b, t) = RECT[face]
    i, j = FACES[face][1]
    u = (P[:, i] - l) / (r - l)
    v = (t - P[:, j]) / (t - b)
    return np.stack([(x + u * w) / SIZE, (y + v * h) / SIZE], 1)


TEAL, CREAM, COAT = rgb('2f6f73'), rgb('e4d9bf'), rgb('f0f0ee')
TEAL_LINEAR = (rgb('307074') / COAT) ** 2.2   # the factor that makes the coat teal


class Chart:
    def __init__(self, face, seed):
        (px, py, w, h), (l, r, b, t) = RECT[face]
        self.rect = (px, py, w, h)
        self.x, self.y = np.meshgrid(l + (np.arange(w) + 0.5) / w * (r - l), t - (np.arange(h) + 0.5) / h * (t - b))
        self.size = (abs(r - l), abs(t - b))
        self.base = np.ones((h, w, 3))
        self.h = np.zeros((h, w))                      # metres
        self.met = np.zeros((h, w)); self.rough = np.full((h, w), 0.34)
        self.gap = np.zeros((h, w))
        sy = h / self.size[1]
        n = lambda s, **k: np.tile(tx.noise(512, s, **k), (2, 2))[:h, :w]
        self.n_lo, self.n_mid, self.n_hi = (n(seed, beta=1.7, lo=1, hi=14), n(seed + 1, beta=1.2, lo=6, hi=90),
                                            n(seed + 2, beta=0.6, lo=40, hi=220))
        self.streak = n(seed + 3, beta=1.1, lo=4, hi=160, ax=1.6, ay=0.12)
        if face == 'roof':
            self.streak = self.n_mid

    def line(self, d, width=0.006, depth=0.006):
        """A panel gap along distance field d."""
        k = smooth(width, width * 0.35, np.abs(d))
        self.gap = np.maximum(self.gap, k)
        self.h -= depth * smooth(width * 1.7, width * 0.3, np.abs(d))

    def raise_(self, d, height, edge):
        """A pressed area: inside where d < 0."""
        self.h += height * smooth(edge, -edge, d)

    def fill(self, mask, color=None, metal=None, rough=None):
        if color is not None:
            self.base = mix(self.base, np.asarray(color, float), mask)
        if metal is not None:
            self.met = self.met * (1 - mask) + metal * mask
        if rough is not None:
            self.rough = self.rough * (1 - mask) + rough * mask

    def paint(self, belt):
        """The coat, light so that a factor can colour it, and cream above; belt: height above the colour break."""
        col = mix(COAT, CREAM, smooth(-0.004, 0.0, belt + EDGE))
        col = col * (1 + 0.025 * self.n_lo + 0.012 * self.n_mid)[..., None]
        self.base = col
        self.base = mix(self.base, rgb('3f4443'), smooth(0.006, 0.003, np.abs(belt)))
        self.rough = 0.30 + 0.03 * self.n_lo + 0.02 * self.n_mid
        self.h += 0.0035 * smooth(0.020, 0.008, np.abs(belt - 0.004))     # trim bead on the break

    def weather(self, low, glass=None):
        """Dust and splashes toward the ground, rust at gaps, streaks below them."""
        clean = 1.0 if glass is None else 1 - 0.7 * glass
        self.base = mix(self.base, rgb('121312'), self.gap * 0.88)
        self.rough = self.rough + self.gap * 0.4
        drip = sum(np.roll(self.gap, k, 0) * np.exp(-k / 9.0) for k in range(1, 30, 2)) / 5
        drip = np.clip(drip, 0, 1) * smooth(-0.6, 1.2, self.streak)
        self.base = mix(self.base, rgb('4c4234'), drip * 0.42 * clean)
        near = np.clip(tx.blur(np.pad(self.gap, 16, mode='edge'), 3)[16:-16, 16:-16] * 1.6, 0, 1)
        rust = near * smooth(1.25, 1.9, self.n_mid + 0.7 * self.n_hi * 0.6 + 0.5 * low) * clean
        self.base = mix(self.base, rgb('7c4526') * (1 + 0.15 * self.n_hi)[..., None], rust)
        self.rough = mix(self.rough, 0.85, rust)
        dirt = np.clip(low * (0.62 + 0.30 * self.n_lo + 0.22 * self.n_mid + 0.10 * self.n_hi), 0, 1)
        self.base = mix(self.base, rgb('6e6353') * (1 + 0.05 * self.n_hi)[..., None], dirt * 0.78)
        self.rough = mix(self.rough, 0.85, dirt * 0.9)
        self.met = self.met * (1 - dirt * 0.8)
        film = np.clip(0.10 + 0.08 * self.streak + 0.05 * self.n_lo, 0, 1) * clean
        self.base = mix(self.base, rgb('8b8272'), film * 0.45)
        self.rough = self.rough + film * 0.22 * clean

    def glass(self, sdf, tint=0.0, wiper=None):
        """Dark glass with a hint of the cabin and a dusty border."""
        m = smooth(0.002, -0.002, sdf)
        y = self.y
        g = smooth(1.25, 1.80, y)
        col = mix(rgb('0d1113'), rgb('27343b'), g)
        dust = smooth(-0.10, 0.0, sdf) * np.clip(0.55 + 0.3 * self.n_mid, 0, 1)
        if wiper is not None:
            dust = np.clip(dust + 0.35 + 0.1 * self.n_mid, 0, 1) * (1 - 0.92 * wiper)
        col = mix(col, rgb('6f685c'), dust * 0.32)
        self.fill(m, rough=0.06)
        self.base = mix(self.base, col, m)
        self.rough = np.where(m > 0.5, 0.06 + 0.35 * dust, self.rough)
        self.h = np.where(m > 0.5, 0.0, self.h)
        return m

    def put(self, atlas):
        px, py, w, h = self.rect
        nrm = tx.normal_from_height(self.h, self.size, 1.0, wrap=False)
        occ = np.clip(1 - self.gap * 0.7, 0, 1)
        atlas.base[py:py + h, px:px + w] = np.clip(self.base, 0, 1)
        atlas.nrm[py:py + h, px:px + w] = nrm
        atlas.orm[py:py + h, px:px + w] = np.stack([occ, np.clip(self.rough, 0.05, 1), np.clip(self.met, 0, 1)], -1)


def ribs(c, x0, x1, ys, r=0.010, height=0.010):
    """Pressed horizontal ribs with round ends."""
    for yy in ys:
        d = np.hypot(np.maximum(np.abs(c.x - (x0 + x1) / 2) - (x1 - x0) / 2, 0), c.y - yy)
        t = np.clip(d / (r * 1.7), 0, 1)
        c.h += height * (0.5 + 0.5 * np.cos(np.pi * t))


def paint_atlas():
    atlas = Atlas(SIZE, SIZE)

    # ---- side: x = z of the van (forward), y = height
    c = Chart('side', 700)
    Z, Y = c.x, c.y
    belt = Y - BELT
    c.paint(belt)
    # ribs of the load space and the lower door, in the van's own rhythm
    ys = np.arange(0.56, 1.05, 0.066)
    ribs(c, -0.20 + 0.06, 0.56 - 0.06, ys)
    for yy in ys:
        for s0, s1 in ((-1.98, -0.30),):
            lo = s0 + 0.04
            dz = ARCH_R + 0.075
            cut = np.sqrt(max(dz ** 2 - (yy - HUB_Y) ** 2, 0)) if abs(yy - HUB_Y) < dz else 0
            if cut:
                ribs(c, AXLES[1] + cut + 0.01, s1, [yy])
                if AXLES[1] - cut - 0.01 - lo > 0.06:
                    ribs(c, lo, AXLES[1] - cut - 0.01, [yy])
            else:
                ribs(c, lo, s1, [yy])
            # front door: short ribs between its edge and the wheel arch
            cutf = np.sqrt(max(dz ** 2 - (yy - HUB_Y) ** 2, 0)) if abs(yy - HUB_Y) < dz else 0
            x1 = AXLES[0] - cutf - 0.02 if cutf else 1.16
            if x1 - 0.74 > 0.05:
                ribs(c, 0.72, x1, [yy])
    # a large pressed field above the belt of the load space
    c.raise_(rr(Z, Y, -1.12, 1.515, 0.80, 0.285, 0.07), -0.007, 0.008)
    ribs(c, -1.80, -0.44, (1.36, 1.44, 1.52, 1.60, 1.68), 0.012, 0.008)
    # doors
    door = round_poly([(0.60, 0.44), (0.94, 0.44), (0.955, 0.60), (1.05, 0.76), (1.22, 0.84), (1.42, 0.90),
                       (1.43, 1.20), (1.06, 1.865), (0.60, 1.865)],
                      [0.03, 0.03, 0.12, 0.12, 0.08, 0.06, 0.06, 0.10, 0.06])
    c.line(seg_dist(door, Z, Y), 0.0075, 0.007)
    slide = round_poly([(-0.25, 0.44), (0.585, 0.44), (0.585, 1.865), (-0.25, 1.865)], [0.04, 0.02, 0.04, 0.06])
    c.line(seg_dist(slide, Z, Y), 0.0075, 0.007)
    # sliding rail behind the door, fuel flap, sill seam, drip rail
    rail = rr(Z, Y, -1.10, 1.185, 0.80, 0.014, 0.012)
    c.raise_(rail, -0.008, 0.004)
    c.fill(smooth(0.003, -0.003, rail), rgb('2a2b2a'), 0.6, 0.5)
    c.line(np.abs(rr(Z, Y, -1.78, 0.93, 0.075, 0.075, 0.02)), 0.006, 0.005)
    c.line(Y - 0.425, 0.006, 0.006)
    c.line(Y - 1.915, 0.008, 0.006)
    # wheel arch lips
    for az in AXLES:
        d = np.hypot(Z - az, Y - HUB_Y) - ARCH_R
        c.raise_(np.abs(d - 0.025) - 0.030, 0.012, 0.012)
        c.gap = np.maximum(c.gap, 0.6 * smooth(0.012, 0.0, np.abs(d + 0.004)))
    # door handle recesses
    for hz in (0.70, 0.48):
        d = rr(Z, Y, hz, 1.075, 0.065, 0.026, 0.02)
        c.raise_(d, -0.010, 0.006)
    # glass
    gl = np.zeros_like(Z)
    for w in (WIN_DOOR, WIN_LOAD):
        s = poly_sdf(w, Z, Y)
        c.raise_(np.abs(s - 0.022) - 0.012, 0.004, 0.006)
        gl = np.maximum(gl, c.glass(s))
    split = smooth(0.012, 0.008, np.abs(Z - 1.115)) * smooth(0.0, -0.005, poly_sdf(WIN_DOOR, Z, Y))
    c.fill(split, rgb('141414'), 0, 0.6)                       # quarter light bar
    split = smooth(0.010, 0.007, np.abs(Z - 0.185)) * smooth(0.0, -0.005, poly_sdf(WIN_LOAD, Z, Y))
    c.fill(split, rgb('8c8c88'), 0.9, 0.35)
    spray = np.zeros_like(Z)
    for az in AXLES:
        d = np.hypot((Z - az + 0.14) / 1.25, Y - HUB_Y) - ARCH_R
        spray = np.maximum(spray, smooth(0.26, 0.0, d) * smooth(1.05, 0.45, Y))
    low = np.clip(0.95 * smooth(0.80, 0.34, Y) + 0.75 * spray, 0, 1)
    c.weather(low, gl)
    c.put(atlas)

    # ---- front
    c = Chart('front', 720)
    X, Y = c.x, c.y
    c.paint(Y - swoop(X))
    # bonnet outline and its centre ridge
    bon = round_poly([(-0.50, 0.885), (0.50, 0.885), (0.60, 1.205), (-0.60, 1.205)], [0.07, 0.07, 0.05, 0.05])
    c.line(seg_dist(bon, X, Y), 0.0075, 0.006)
    c.raise_(np.abs(X) - 0.035 * smooth(0.6, 1.2, Y) - 0.02, 0.006, 0.02)
    # grille: a chromed frame and slats over darkness
    g = rr(X, Y, 0, 0.735, 0.375, 0.105, 0.10)
    slat = 0.5 + 0.5 * np.cos(2 * np.pi * (Y - 0.735) / 0.042)
    m = smooth(0.002, -0.002, g)
    c.raise_(g, -0.012, 0.006)
    c.h += m * 0.012 * slat ** 0.7
    c.fill(m, rgb('0b0c0c'), 0, 0.7)
    c.fill(m * smooth(0.45, 0.62, slat), rgb('c9c9c4'), 1.0, 0.28)
    for xx in (-0.2, 0.0, 0.2):
        c.fill(m * smooth(0.012, 0.008, np.abs(X - xx)), rgb('b5b5b0'), 1.0, 0.3)
    # emblem: a bar across a disc
    e = np.hypot(X, Y - 0.735) - 0.072
    c.fill(smooth(0.002, -0.002, e), CREAM, 0, 0.3)
    c.fill(smooth(0.007, 0.004, np.abs(e)), rgb('d8d8d4'), 1, 0.2)
    c.raise_(e, 0.014, 0.006)
    bar = np.maximum(np.abs(X) - 0.058, np.abs(Y - 0.735) - 0.016)
    c.fill(smooth(0.002, -0.002, bar), TEAL * 0.9, 0, 0.3)
    c.raise_(bar, 0.005, 0.004)
    # sockets of the lamps
    for sx in (-1, 1):
        c.line(np.hypot(X - sx * 0.625, Y - 0.80) - 0.145, 0.007, 0.004)
    # cooling slots under the grille, joint above the bumper
    for k in range(9):
        d = rr(X, Y, (k - 4) * 0.075, 0.555, 0.026, 0.010, 0.009)
        c.raise_(d, -0.01, 0.004)
        c.fill(smooth(0.003, -0.002, d), rgb('0d0d0d'), 0, 0.8)
    c.line(Y - 0.455, 0.006, 0.005)
    # scuttle vents below the screen
    for k in range(-6, 7):
        d = rr(X, Y, k * 0.07, 1.222, 0.024, 0.006, 0.005)
        c.fill(smooth(0.003, -0.001, d), rgb('101010'), 0, 0.8)
    s = poly_sdf(WINDSCREEN, X, Y)
    c.raise_(np.abs(s - 0.022) - 0.012, 0.004, 0.006)
    wip = np.zeros_like(X)
    for cx in (-0.36, 0.30):
        rad = np.hypot(X - cx, (Y - 1.25))
        wip = np.maximum(wip, smooth(0.50, 0.49, rad) * smooth(0.09, 0.10, rad))
    gl = c.glass(s, wiper=wip)
    low = np.clip(0.85 * smooth(0.62, 0.32, Y), 0, 1)
    c.weather(low, gl)
    c.put(atlas)

    # ---- rear
    c = Chart('rear', 740)
    X, Y = c.x, c.y
    c.paint(Y - BELT)
    outline = round_poly([(-0.74, 0.50), (0.74, 0.50), (0.69, 1.87), (-0.69, 1.87)], [0.06, 0.06, 0.12, 0.12])
    c.line(seg_dist(outline, X, Y), 0.0075, 0.007)
    c.line(np.where((Y > 0.50) & (Y < 1.87), X, 1), 0.0075, 0.007)
    for sx in (-1, 1):
        ribs(c, *(sorted((sx * 0.09, sx * 0.52))), np.arange(0.62, 1.07, 0.066))
        for yy in (0.66, 1.02, 1.62):                          # hinges
            d = rr(X, Y, sx * 0.725, yy, 0.035, 0.030, 0.01)
            c.raise_(d, 0.012, 0.005)
            c.line(np.abs(d), 0.004, 0.002)
    gl = np.zeros_like(X)
    for w in WIN_REAR:
        s = poly_sdf(w, X, Y)
        c.raise_(np.abs(s - 0.022) - 0.012, 0.004, 0.006)
        gl = np.maximum(gl, c.glass(s))
    c.line(Y - 0.455, 0.006, 0.005)
    low = np.clip(1.05 * smooth(0.95, 0.34, Y), 0, 1)
    c.weather(low, gl)
    c.put(atlas)

    # ---- roof: x = z of the van, y = x of the van
    c = Chart('roof', 760)
    Z, X = c.x, c.y
    c.paint(np.ones_like(Z))
    for xx in np.arange(-0.60, 0.61, 0.20):
        d = np.hypot(np.maximum(np.abs(Z + 0.42) - 1.30, 0), (X - xx) * 1.0)
        c.h += 0.012 * (0.5 + 0.5 * np.cos(np.pi * np.clip(d / 0.045, 0, 1)))
    c.line(np.abs(X) - 0.80, 0.012, 0.006)
    c.weather(np.clip(0.10 + 0.10 * c.n_lo, 0, 1))
    c.put(atlas)

    # ---- swatches
    def sw(name, color, metal, rough, size=48, grain=0.04):
        x, y = SW_PX[name]
        n = tx.noise(64, 800 + x, 0.8, 4, 30)[:size, :size]
        atlas.base[y:y + size, x:x + size] = np.clip(np.asarray(color) * (1 + grain * n)[..., None], 0, 1)[:, :SIZE - x]
        atlas.orm[y:y + size, x:x + size] = (1, rough, metal)
    sw('rubber', rgb('17181a'), 0, 0.72)
    sw('chrome', rgb('d6d6d2'), 1, 0.16, grain=0.02)
    sw('cream', CREAM * 0.95, 0, 0.36, grain=0.02)
    sw('teal', TEAL * 0.95, 0, 0.36, 24, grain=0.02)
    sw('under', rgb('1b1a18'), 0, 0.95)
    sw('steel', rgb('8d8e8c'), 1, 0.42)
    sw('black', rgb('0c0c0d'), 0, 0.55)
    sw('wood', rgb('a47c4c'), 0, 0.6, 24, grain=0.06)
    draw_wheel(atlas)
    # number plate
    x, y = SW_PX['plate']
    im = Image.new('RGB', (192, 44), (232, 206, 96))
    d = ImageDraw.Draw(im)
    d.rectangle((2, 2, 189, 41), outline=(20, 20, 20), width=2)
    d.text((96, 22), 'RLF 303', fill=(18, 18, 18), font=ImageFont.load_default(34), anchor='mm')
    atlas.base[y:y + 44, x:x + 192] = np.asarray(im) / 255.0
    atlas.orm[y:y + 44, x:x + 192] = (1, 0.5, 0)
    # headlamp lens: reflector rings, vertical flutes
    x, y = SW_PX['lens']
    s = 96
    u, v = np.meshgrid((np.arange(s) + 0.5) / s * 2 - 1, (np.arange(s) + 0.5) / s * 2 - 1)
    r = np.hypot(u, v)
    flute = 0.5 + 0.5 * np.cos(u * 34)
    glow = np.exp(-(r / 0.42) ** 2)
    col = mix(rgb('d9d3c4'), rgb('fffdf4'), np.clip(glow * 1.2, 0, 1)) * (0.70 + 0.22 * flute + 0.25 * glow)[..., None]
    col = col * (1 - 0.45 * smooth(0.80, 1.0, r))[..., None]
    atlas.base[y:y + s, x:x + s] = np.clip(col, 0, 1)
    atlas.nrm[y:y + s, x:x + s] = tx.normal_from_height(flute * 0.0012 + np.sqrt(np.clip(1.2 - r * r, 0, 1)) * 0.004,
                                                        (0.2, 0.2), 1.0, wrap=False)
    atlas.orm[y:y + s, x:x + s] = (1, 0.10, 0)
    for name, colr in (('red', 'b3241c'), ('amber', 'e08a1e'), ('white', 'efece4')):
        x, y = SW_PX[name]
        s = 48
        u, v = np.meshgrid(np.arange(s), np.arange(s))
        cell = (0.5 + 0.5 * np.cos(u * 2 * np.pi / 8)) * (0.5 + 0.5 * np.cos(v * 2 * np.pi / 8))
        atlas.base[y:y + s, x:x + s] = np.clip(rgb(colr) * (0.72 + 0.4 * cell)[..., None], 0, 1)
        atlas.nrm[y:y + s, x:x + s] = tx.normal_from_height(cell * 0.003, (0.12, 0.12), 1.0, wrap=False)
        atlas.orm[y:y + s, x:x + s] = (1, 0.15, 0)
    return atlas


# ------------------------------------------------------------------ details

def arches():
    out = []
    for az in AXLES:
        a = np.radians(np.linspace(-40, 220, 20))
        ring = np.stack([az + ARCH_R * np.cos(a), HUB_Y + ARCH_R * np.sin(a)], 1)
        out.append(np.concatenate([ring, [[az - ARCH_R * 0.76, 0.0], [az + ARCH_R * 0.76, 0.0]]]))
    return out


def wheel_well(az, sx):
    """Dark inner arch for one wheel, and the flange round its opening."""
    a = np.radians(np.linspace(-12, 192, 10))
    zc, yc = az + ARCH_R * np.cos(a), HUB_Y + ARCH_R * np.sin(a)
    yq = np.maximum(yc, 0.345)
    pa, pb = invert('side', np.stack([zc, yq], 1))
    p = surf('side', pa, pb)
    n = surf_normal('side', pa, pb)
    lip = p.copy(); lip[:, 1] = yc; lip[:, 2] = zc
    lip = lip + n * 0.004
    radial = np.stack([np.zeros_like(a), np.sin(a), np.cos(a)], 1)
    # flange: a half-round bead standing proud of the side
    prof = [(0.040, -0.004), (0.030, 0.018), (0.006, 0.022), (-0.004, -0.03)]
    P = np.stack([lip + radial * r + n * o for r, o in prof], 1)
    k = len(prof)
    UV = np.stack(np.meshgrid(np.linspace(0, 1, len(a)), np.linspace(0, 1, k), indexing='ij'), -1)
    F = []
    for i in range(len(a) - 1):
        for j in range(k - 1):
            q = (i * k + j, (i + 1) * k + j, (i + 1) * k + j + 1, i * k + j + 1)
            F += [(q[0], q[1], q[2]), (q[0], q[2], q[3])]
    F = np.array(F)
    bead = creased(P.reshape(-1, 3), UV.reshape(-1, 2), F, 60)
    if (bead.N * np.tile([1, 0, 0], (len(bead.N), 1))).sum() < 0:
        bead = creased(P.reshape(-1, 3), UV.reshape(-1, 2), F[:, ::-1], 60)
    # inner tub
    xin = 0.50
    A = lip - radial * 0.004 + n * -0.006
    B = A.copy(); B[:, 0] = xin
    P = np.concatenate([A, B]); m = len(a)
    N = np.concatenate([-radial, -radial])
    F = [t for i in range(m - 1) for t in ((i, i + 1, m + i + 1), (i, m + i + 1, m + i))]
    F = np.array(F)
    fn = np.cross(P[F[:, 1]] - P[F[:, 0]], P[F[:, 2]] - P[F[:, 0]])
    fl = (fn * N[F].mean(1)).sum(1) < 0
    F[fl] = F[fl][:, ::-1]
    tub = Part(P, N, np.tile([[0.0, 0.0], [1, 1]], (m, 1)), F)
    C = np.concatenate([B, [[xin, HUB_Y, az]]])
    F = np.array([(i, i + 1, m) for i in range(m - 1)])
    fn = np.cross(C[F[0, 1]] - C[F[0, 0]], C[F[0, 2]] - C[F[0, 0]])
    if fn[0] < 0:
        F = F[:, ::-1]
    disc = Part(C, np.tile([1.0, 0, 0], (len(C), 1)), C[:, 1:], F)
    part = merge(bead.swatch(*SW['black']), tub.swatch(*SW['under']), disc.swatch(*SW['under']))
    return part if sx > 0 else mirror_x(part)


def place(part, p, n):
    """Stand a part whose axis is +Y on point p, axis along n."""
    n = np.asarray(n, float) / np.linalg.norm(n)
    up = np.array([0, 1.0, 0])
    x = np.cross(up, n)
    if np.linalg.norm(x) < 1e-6:
        x = np.array([1.0, 0, 0])
    x /= np.linalg.norm(x)
    # local y -> n, local x -> x, local z -> x cross n, so that the image of a lens stays upright
    z = np.cross(x, n)
    q = part.mat(np.stack([x, n, z], 1))
    q.P += p
    return q


def at(face, c1, c2):
    a, b = invert(face, np.array([[c1, c2]]))
    return surf(face, a, b)[0], surf_normal(face, a, b)[0]


def lens_uv(part, r):
    """Planar lens image over a lathe of radius r (axis +Y, image up = -Z)."""
    u0, v0, s = LENS
    return part.uvmap(lambda P, UV: np.stack([u0 + s * (0.5 + 0.48 * P[:, 0] / r), v0 + s * (0.5 + 0.48 * P[:, 2] / r)],
                                             1))


def bumper(zsign):
    """A rounded bar that follows the end of the van in plan."""
    xs = np.array([-0.90, -0.88, -0.80, -0.66, -0.38, 0, 0.38, 0.66, 0.80, 0.88, 0.90])
    if zsign > 0:
        z = 2.215 - 0.10 * np.abs(xs / 0.9) ** 2 - 0.30 * np.clip((np.abs(xs) - 0.55) / 0.35, 0, 1) ** 2.4
    else:
        z = 2.185 - 0.03 * np.abs(xs / 0.9) ** 2 - 0.26 * np.clip((np.abs(xs) - 0.60) / 0.30, 0, 1) ** 2.6
    prof = [(-0.054, -0.03), (-0.054, 0.010), (-0.022, 0.032), (0.022, 0.032), (0.054, 0.010), (0.054, -0.03)]
    path = np.stack([xs, z], 1)
    tan = np.gradient(path, axis=0); tan /= np.linalg.norm(tan, axis=1, keepdims=True)
    nor = np.stack([-tan[:, 1], tan[:, 0]], 1)
    P = np.array([[(xs[i] + nor[i, 0] * o, 0.425 + y, z[i] + nor[i, 1] * o) for y, o in prof] for i in range(len(xs))])
    if zsign < 0:
        P[..., 2] *= -1
    k = len(prof)
    UV = np.stack(np.meshgrid(np.linspace(0, 1, len(xs)), np.linspace(0, 1, k), indexing='ij'), -1)
    F = []
    for i in range(len(xs) - 1):
        for j in range(k):
            j2 = (j + 1) % k
            q = (i * k + j, (i + 1) * k + j, (i + 1) * k + j2, i * k + j2)
            F += [(q[0], q[1], q[2]), (q[0], q[2], q[3])]
    for i, rev in ((0, False), (len(xs) - 1, True)):
        for j in range(1, k - 1):
            t = (i * k, i * k + j, i * k + j + 1)
            F.append(t[::-1] if rev else t)
    F = np.array(F)
    if zsign < 0:
        F = F[:, ::-1]
    bar = creased(P.reshape(-1, 3), UV.reshape(-1, 2), F, 50)
    # check the winding on the outermost face
    k2 = np.argmax(bar.P[:, 2] * zsign)
    if bar.N[k2, 2] * zsign < 0:
        bar = creased(P.reshape(-1, 3), UV.reshape(-1, 2), F[:, ::-1], 50)
    return bar


def underside():
    parts = [wheel_well(az, sx) for sx in (1, -1) for az in AXLES]
    for sx, sy, sz, y, z in ((1.30, 0.10, 3.9, 0.36, -0.05), (1.62, 0.06, 1.60, 0.352, 0.04),
                             (1.55, 0.06, 0.36, 0.36, 1.80), (1.60, 0.06, 0.34, 0.36, -1.82)):
        parts.append(box(sx, sy, sz).move(0, y, z).swatch(*SW['under']))
    for az in AXLES:                                        # axle tubes
        parts.append(tube([(-0.68, HUB_Y, az), (0.68, HUB_Y, az)], 0.035, 6, caps=False).swatch(*SW['under']))
    parts.append(tube([(0.45, 0.30, -1.5), (0.45, 0.29, -2.0), (0.45, 0.28, -2.17)], 0.028, 8).swatch(*SW['steel']))
    return parts


def fittings():
    """Bumpers, handles, mirrors, wipers, plates."""
    parts = [bumper(1).swatch(*SW['chrome']), bumper(-1).swatch(*SW['chrome'])]
    for x in (-0.42, 0.42):                                 # rubber over-riders
        parts.append(box(0.075, 0.17, 0.06).move(x, 0.435, 2.225).swatch(*SW['rubber']))
        parts.append(box(0.075, 0.17, 0.06).move(x, 0.435, -2.205).swatch(*SW['rubber']))
    for hz in (0.70, 0.48):
        p, n = at('side', hz, 1.075)
        parts += both(box(0.028, 0.022, 0.125).move(p[0] + 0.018, p[1], p[2]).swatch(*SW['chrome']))
    p, n = at('side', 1.315, 1.165)                         # mirrors on bent arms
    arm = [p + n * -0.01, p + n * 0.07 + (0, 0.02, 0.01), p + n * 0.115 + (0, 0.10, 0.01),
           p + n * 0.12 + (0, 0.20, 0.0)]
    parts += both(tube(arm, 0.010, 5, caps=False).swatch(*SW['chrome']))
    head = lathe([(0.0, -0.030), (0.055, -0.022), (0.088, 0.0), (0.086, 0.016)], 10, 60).scale(0.85, 1, 1.35)
    glass = lathe([(0.087, 0.014), (0.0, 0.014)], 10, 50).scale(0.85, 1, 1.35)
    mp, dirn = p + n * 0.145 + np.array([0, 0.27, 0.005]), np.array([-0.22, 0, -1.0])
    parts += both(place(head, mp, dirn).swatch(*SW['black'])) + both(place(glass, mp, dirn).swatch(*SW['chrome']))
    for cx in (-0.36, 0.30):                                # wipers
        p0, n0 = at('front', cx, 1.262)
        pts = []
        for t in np.linspace(0, 1, 4):
            q, nn = at('front', cx + 0.015 + 0.40 * t, 1.287 + 0.035 * t)
            pts.append(q + nn * (0.018 if t in (0, 1) else 0.020))
        parts.append(tube(pts, 0.007, 4, caps=False).swatch(*SW['black']))
        parts.append(tube([p0 + n0 * 0.002, p0 + n0 * 0.03, pts[2] + (0, 0.004, 0.006)], 0.008, 4,
                          caps=False).swatch(*SW['black']))
    x, y = SW_PX['plate']

    def plate_uv(sign):
        return lambda P, UV: np.stack([(x + 96 + sign * (P[:, 0] + 0.15 * P[:, 2]) / 0.445 * 188) / SIZE,
                                       (y + 22 - (P[:, 1] + 0.1 * P[:, 2]) / 0.107 * 42) / SIZE], 1)
    board = box(0.44, 0.105, 0.016)
    parts.append(board.uvmap(plate_uv(1)).move(0, 0.425, 2.262))
    p, n = at('rear', 0.30, 0.585)
    parts.append(board.uvmap(plate_uv(-1)).move(-0.30, 0.585, p[2] - 0.006))
    p, n = at('rear', 0.07, 1.16)
    parts.append(box(0.03, 0.16, 0.03, 0.010).move(0.06, 1.14, p[2] - 0.02).swatch(*SW['chrome']))
    return parts


def rack():
    """Roof rails with cross bars, and a ladder tied on."""
    parts = []
    zz = np.linspace(-1.55, 0.75, 9)
    for sx in (1, -1):
        rail = np.array([at('roof', z, sx * 0.60)[0] + (0, 0.085, 0) for z in zz])
        ends = [at('roof', z, sx * 0.60)[0] - (0, 0.01, 0) for z in (zz[0] - 0.05, zz[-1] + 0.05)]
        parts.append(tube(np.concatenate([ends[:1], rail[::2], ends[1:]]), 0.016, 4, caps=False))
        for k in (2, 4, 6):
            parts.append(tube([at('roof', zz[k], sx * 0.60)[0] - (0, 0.01, 0), rail[k]], 0.012, 4, caps=False))
    for k in (1, 3, 5, 7):
        parts.append(tube([rail[k] * (-1, 1, 1), rail[k]], 0.013, 4, caps=False))
    top = rail[:, 1].max() + 0.04
    parts += [tube([(0.08, top, z), (0.42, top, z)], 0.013, 4, caps=False) for z in np.arange(-1.65, 0.90, 0.28)]
    wood = [box(0.032, 0.06, 2.75, 0.008).move(x, top, -0.42).swatch(*SW['wood']) for x in (0.08, 0.42)]
    return [p.swatch(*SW['steel']) for p in parts] + wood


def lamps():
    """What holds the glasses, and the glasses of the left: name, part, material, direction."""
    bezel = lathe([(0.152, -0.06), (0.150, 0.012), (0.135, 0.032), (0.119, 0.026), (0.113, 0.006)], 16, 40)
    dome = lens_uv(lathe([(0.115, 0.010), (0.092, 0.027), (0.050, 0.039), (0.0, 0.043)], 12, 80), 0.115)
    ring = lathe([(0.060, -0.04), (0.057, 0.010), (0.044, 0.008)], 12, 40)
    cap = lathe([(0.045, 0.006), (0.035, 0.022), (0.0, 0.033)], 12, 80)
    p, n = at('front', 0.625, 0.80)
    n = np.array([n[0] * 0.35, 0.0, n[2]]); n /= np.linalg.norm(n)
    p = p + n * 0.012
    held = both(place(bezel, p, n).swatch(*SW['chrome']))
    glass = [('lamp_head', place(dome, p, n), 'glass_clear', HEAD)]
    p, n = at('front', 0.655, 0.575)
    n = np.array([n[0] * 0.7, 0.0, n[2]]); n /= np.linalg.norm(n)
    held += both(place(ring, p, n).swatch(*SW['chrome']))
    glass.append(('lamp_indicator_front', planar(place(cap, p, n), 'amber'), 'glass_amber', tilted(0, 1, 19)))
    p, n = at('side', 1.56, 1.00)                           # side repeater, not lit
    held += both(planar(place(cap.scale(0.5, 0.5, 0.8), p - n * 0.002, n).rot('y', 90), 'amber').rot('y', -90))
    p, n = at('rear', 0.80, 0.80)                           # a tall pod on the rear corner
    n = np.array([n[0] * 0.45, 0.0, n[2]]); n /= np.linalg.norm(n)
    held += both(place(box(0.125, 0.09, 0.36, 0.03), p, n).swatch(*SW['chrome']))
    for name, color, kind, h, o, way in (('lamp_tail', 'red', 'glass_red', 0.155, 0.052, TAIL),
                                         ('lamp_indicator_rear', 'amber', 'glass_amber', 0.080, -0.085,
                                          tilted(0, -1, 19)),
                                         ('lamp_reverse', 'white', 'glass_clear', 0.045, -0.152, TAIL)):
        glass.append((name, planar(place(box(0.095, 0.05, h, 0.018).move(0, 0.035, o), p, n), color), kind, way))
    return held, glass


def planar(part, name):
    """Cover a lamp with its lens swatch, seen along Z."""
    x, y = SW_PX[name]

    def f(P, UV):
        q = P[:, :2] + P[:, 2:] * (0.35, 0.21)
        q = (q - q.min(0)) / np.maximum(np.ptp(q, axis=0), 1e-9)
        return np.stack([(x + 3 + q[:, 0] * 42) / SIZE, (y + 45 - q[:, 1] * 42) / SIZE], 1)
    return part.uvmap(f)


def draw_wheel(atlas):
    """The rim, seen from outside, and a tyre's segment."""
    draw_tyre(atlas, 934, 872, 900)
    px, py, s = 768, 866, 156
    X, Y = np.meshgrid(even(-0.225, 0.225, s), even(0.225, -0.225, s))
    r, a = np.hypot(X, Y), np.arctan2(Y, X)
    ca = ((a / (2 * np.pi) * 10) % 1.0 - 0.5) * 2 * np.pi / 10
    hole = np.hypot((r - 0.142) / 0.020, ca * r / 0.024) - 1
    holes = smooth(0.06, -0.06, hole)
    bolt_a = ((a / (2 * np.pi) * 5) % 1.0 - 0.5) * 2 * np.pi / 5
    bolt = np.hypot(r - 0.088, bolt_a * r)
    bolts = smooth(0.0125, 0.011, bolt)
    hh = 0.004 * smooth(0.35, 0.0, hole) - 0.012 * holes + 0.006 * bolts
    hh = hh + 0.004 * smooth(0.012, 0.0, np.abs(r - 0.176)) - 0.003 * smooth(0.006, 0.002, np.abs(r - 0.070))
    nn = tx.noise(256, 910, 1.2, 2, 80)[:s, :s]
    col = CREAM * 0.92 * (1 + 0.03 * nn)[..., None]
    met, ro = np.zeros_like(r), np.full_like(r, 0.42)
    cap = smooth(0.0675, 0.066, r)
    col = mix(col, rgb('d8d8d4'), cap); met = met + cap; ro = ro * (1 - cap) + 0.15 * cap
    col = mix(col, TEAL, smooth(0.010, 0.008, np.abs(r - 0.192)))
    col = mix(col, rgb('8a8a86'), bolts); met = np.maximum(met, bolts)
    col = mix(col, rgb('0b0b0b'), holes); ro = ro * (1 - holes) + 0.9 * holes
    grime = (np.clip(smooth(0.10, 0.2, r) * (0.35 + 0.25 * nn) + smooth(0.03, 0.012, bolt) * (1 - bolts) * 0.5
                     + 0.4 * smooth(0.25, 0.0, hole) * (1 - holes), 0, 1) * (1 - cap))
    col = mix(col, rgb('584a3a'), grime * 0.55); ro = ro + 0.3 * grime
    atlas.put(px, py, col, ro, met, hh, (0.45 / s, 0.45 / s), name='rim')


def wheel_part(atlas):
    """Tyre and rim around the X axis, outside toward +X."""
    profile = [(0.205, 0.055), (0.212, 0.082), (0.172, 0.040), (0.125, 0.052), (0.070, 0.048), (0.060, 0.075),
               (0.0, 0.097)]
    rim = lathe(profile, 18, 38)
    x, y, w, h = atlas.uv['rim']
    rim = rim.uvmap(lambda P, UV: np.stack([x + w * (0.5 + P[:, 0] / 0.45), y + h * (0.5 + P[:, 2] / 0.45)], 1))
    back = lathe([(0.0, -0.02), (0.205, -0.0775)], 9, 30)
    back = back if back.N[:, 1].mean() < 0 else back.flip()
    return merge(tyre(atlas, WHEEL_R, 0.205, 0.195, 18), rim.mat(TURN), back.mat(TURN).swatch(*SW['under']))


def halved(atlas):
    """The atlas at half its size."""
    small = Atlas(atlas.w // 2, atlas.h // 2)
    small.uv = atlas.uv
    shrink = lambda a: a.reshape(small.h, 2, small.w, 2, 3).mean((1, 3))
    small.base, small.orm, n = shrink(atlas.base), shrink(atlas.orm), shrink(atlas.nrm)
    small.nrm = n / np.linalg.norm(n, axis=-1, keepdims=True)
    return small


def build(out):
    atlas = paint_atlas()
    coat, rest = [], []
    coat_side, rest_side = chart('side', ZP, YP, [WIN_DOOR, WIN_LOAD], arches(), LEVEL)
    coat += both(coat_side)
    rest += [m for p in rest_side for m in both(p)]
    for face, grid, windows, belt, plain in (('front', (XP, YP), [WINDSCREEN], SWOOP, [GRILLE]),
                                             ('rear', (XP, YP), WIN_REAR, LEVEL, []), ('roof', (ZP, XP), [], None, [])):
        c, r = chart(face, *grid, windows, (), belt, plain)
        coat.append(c)
        rest += r
    held, glass = lamps()
    back = lambda parts: [p.move(0, 0, REAR) for p in parts if len(p.F)]
    v = Vehicle('van', halved(atlas), tuple(TEAL_LINEAR))
    v.body(back(coat), back(rest + underside() + fittings() + rack() + held))
    v.wheels(wheel_part(atlas), {'wheel_front': (TRACK, HUB_Y, AXLES[0] + REAR), 'wheel_rear': (TRACK, HUB_Y, 0)})
    for name, part, kind, way in glass:
        v.lamps(name, part.move(0, 0, REAR), kind, way)
    v.g.save(out)


if __name__ == '__main__':
    here = os.path.dirname(os.path.abspath(__file__))
    build(os.path.join(here, '..', 'models', 'vehicle_van.glb'))
