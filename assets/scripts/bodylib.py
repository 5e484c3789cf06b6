"""Bodies from a side view.

A body (`Shell`) is drawn as on paper: an outline of the side view, from the front's lower
edge over bonnet and roof to the rear's, is extruded across, its edges are rounded, and the
whole is bent by a smooth function. It has two charts, each flat and in metres, in which
outlines (windows, wheel arches) are triangulated and the texture is drawn:

- `side`: (z, y), both flanks, mirrored;
- `strip`: (t, s), s metres along the outline, t metres across from the middle, over the
  rounded edge; both halves, mirrored.

Windows are parts of the surface with a material of their own; lamps (`Shell.patch`) are
pieces of it, lifted."""

import numpy as np
import bpy  # noqa: F401  (brings mathutils)
from mathutils.geometry import delaunay_2d_cdt
from meshlib import *


# ------------------------------------------------------------------ outlines

def arc_points(p, a, b, r, step):
    """The corner p between neighbours a and b, rounded with radius r, a point each `step` degrees."""
    u, v = (a - p) / np.linalg.norm(a - p), (b - p) / np.linalg.norm(b - p)
    half = np.arccos(np.clip(u @ v, -1, 1)) / 2
    if r <= 0 or half > np.radians(89.5):
        return np.array([p])
    reach = min(r / np.tan(half), 0.48 * np.linalg.norm(a - p), 0.48 * np.linalg.norm(b - p))
    r = reach * np.tan(half)
    c = p + (u + v) / np.linalg.norm(u + v) * r / np.sin(half)
    a0 = np.arctan2(*(p + u * reach - c)[::-1])
    turn = (np.arctan2(*(p + v * reach - c)[::-1]) - a0 + np.pi) % (2 * np.pi) - np.pi
    n = max(2, int(np.ceil(abs(np.degrees(turn)) / step)) + 1)
    ang = a0 + turn * np.linspace(0, 1, n)
    return c + r * np.stack([np.cos(ang), np.sin(ang)], 1)


def round_poly(points, r, step=30.0):
    """A closed polygon with rounded corners."""
    q = np.asarray(points, float)
    r = np.broadcast_to(r, (len(q),))
    return np.concatenate([arc_points(q[k], q[k - 1], q[(k + 1) % len(q)], r[k], step) for k in range(len(q))])


class Outline:
    """A rounded open curve (z, y) with arc length, from the front's lower edge over the top to the rear's."""

    def __init__(self, corners, radii, step=22.0, longest=0.5):
        q = np.asarray(corners, float)

        def curve(step):
            mid = [arc_points(q[k], q[k - 1], q[k + 1], radii[k], step) for k in range(1, len(q) - 1)]
            return np.concatenate([q[:1]] + mid + [q[-1:]])
        dense = curve(1.0)
        fine = [dense[0]]
        for a, b in zip(dense[:-1], dense[1:]):
            n = max(1, int(np.linalg.norm(b - a) / 0.02))
            fine += [a + (b - a) * (k + 1) / n for k in range(n)]
        self.P = np.array(fine)
        self.s = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(self.P, axis=0), axis=1))])
        t = np.gradient(self.P, axis=0)
        t /= np.linalg.norm(t, axis=1, keepdims=True)
        self.N = np.stack([t[:, 1], -t[:, 0]], 1)
        self.length = self.s[-1]
        # where the mesh has a row: at the points of the coarse arcs, and along straights
        rows = []
        for p in curve(step):
            rows.append(self.s[np.argmin(((self.P - p) ** 2).sum(1))])
        rows = np.unique(np.round(rows, 4))
        self.rows = [rows[0]]
        for a, b in zip(rows[:-1], rows[1:]):
            n = max(1, int(np.ceil((b - a) / longest)))
            self.rows += [a + (b - a) * (k + 1) / n for k in range(n)]
        self.rows = np.array(self.rows)

    def at(self, s):
        p = np.stack([np.interp(s, self.s, self.P[:, k]) for k in (0, 1)], -1)
        n = np.stack([np.interp(s, self.s, self.N[:, k]) for k in (0, 1)], -1)
        return p, n / np.linalg.norm(n, axis=-1, keepdims=True)

    def find(self, y, front=True):
        """Arc length of the first (last) point at height y."""
        over = np.nonzero(self.P[:, 1] >= y)[0]
        return self.s[over[0] if front else over[-1]]

    def near(self, z, y):
        """Arc length of the point nearest to (z, y)."""
        return self.s[np.argmin(((self.P - (z, y)) ** 2).sum(1))]


def inside(poly, p):
    x, y = p[:, 0], p[:, 1]
    r = np.zeros(len(p), bool)
    for (x0, y0), (x1, y1) in zip(np.roll(poly, 1, 0), poly):
        if y0 != y1:
            r ^= ((y0 > y) != (y1 > y)) & (x < (x1 - x0) * (y - y0) / (y1 - y0) + x0)
    return r


def seg_dist(poly, x, y, closed=True):
    """Distance to a polyline."""
    poly = np.asarray(poly, float)
    d = np.full(np.shape(x), 1e9)
    for k in range(0 if closed else 1, len(poly)):
        a, ab = poly[k - 1], poly[k] - poly[k - 1]
        t = np.clip(((x - a[0]) * ab[0] + (y - a[1]) * ab[1]) / (ab @ ab + 1e-12), 0, 1)
        d = np.minimum(d, np.hypot(x - a[0] - t * ab[0], y - a[1] - t * ab[1]))
    return d


def poly_sdf(poly, x, y):
    """Signed distance to a polygon, negative inside."""
    poly = np.asarray(poly, float)
    d = seg_dist(poly, x, y)
    s = inside(poly, np.stack([np.ravel(x), np.ravel(y)], 1)).reshape(np.shape(x))
    return np.where(s, -d, d)


def rr(x, y, cx, cy, hx, hy, r):
    """Signed distance to a rectangle with round corners."""
    ex, ey = np.abs(x - cx) - hx + r, np.abs(y - cy) - hy + r
    return np.hypot(np.maximum(ex, 0), np.maximum(ey, 0)) + np.minimum(np.maximum(ex, ey), 0) - r


def triangulate(border, grid, loops):
    """Constrained triangulation of a polygon; returns points and counter-clockwise triangles."""
    verts = [tuple(map(float, p)) for p in border]
    edges = [(k, (k + 1) % len(border)) for k in range(len(border))]
    for loop in loops:
        s = len(verts)
        verts += [tuple(map(float, p)) for p in loop]
        edges += [(s + k, s + (k + 1) % len(loop)) for k in range(len(loop))]
    verts += [tuple(map(float, p)) for p in grid]
    vo, _, fo, *_ = delaunay_2d_cdt(verts, edges, [], 0, 1e-5)
    V, T = np.array([tuple(v) for v in vo]), np.array([tuple(f) for f in fo])
    a, b = V[T[:, 1]] - V[T[:, 0]], V[T[:, 2]] - V[T[:, 0]]
    area = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    T = np.where((area < 0)[:, None], T[:, ::-1], T)
    T = T[np.abs(area) > 1e-7]
    return V, T[inside(border, V[T].mean(1))]


# --------------------------------------------------------------------- shell

class Shell:
    def __init__(self, outline, half_width, fillet, deform, side_uv, strip_uv, fillet_steps=3):
        """fillet: radius of the rounded edge at outline points (n, 2) -> (n,); deform: (n, 3) -> (n, 3);
        side_uv: (z, y) -> UV; strip_uv: (s, t) -> UV."""
        self.o, self.hx, self.fillet, self.deform = outline, half_width, fillet, deform
        self.side_uv, self.steps = side_uv, fillet_steps
        self.strip_uv = lambda t, s: strip_uv(s, t)

    def bend(self, P, N):
        """Points and normals after the deformation."""
        e = 1e-4
        J = np.stack([(self.deform(P + d) - self.deform(P - d)) / (2 * e) for d in np.eye(3) * e], -1)
        n = np.einsum('nji,nj->ni', np.linalg.inv(J), N)
        return self.deform(P), n / np.linalg.norm(n, axis=1, keepdims=True)

    def radius(self, s):
        return self.fillet(self.o.at(s)[0])

    def widest(self, s):
        """The t at which the rounded edge ends and the flank begins."""
        r = self.radius(s)
        return self.hx - r + r * np.pi / 2

    def on_strip(self, t, s, lift=0.0):
        t, s = np.broadcast_arrays(np.asarray(t, float), np.asarray(s, float))
        (p, n), r = self.o.at(s), self.radius(s)
        a = self.hx - r
        th = np.clip((np.abs(t) - a) / r, 0, np.pi / 2)
        x = np.sign(t) * np.where(np.abs(t) <= a, np.abs(t), a + r * np.sin(th))
        p = p - n * (r * (1 - np.cos(th)))[..., None]
        P = np.stack([x, p[..., 1], p[..., 0]], -1)
        N = np.stack([np.sign(t) * np.sin(th), np.cos(th) * n[..., 1], np.cos(th) * n[..., 0]], -1)
        P, N = self.bend(P.reshape(-1, 3), N.reshape(-1, 3))
        return P + N * lift, N

    def on_side(self, z, y, lift=0.0):
        z, y = np.broadcast_arrays(np.asarray(z, float), np.asarray(y, float))
        P = np.stack([np.full(z.shape, self.hx), y, z], -1).reshape(-1, 3)
        P, N = self.bend(P, np.tile([1.0, 0, 0], (len(P), 1)))
        return P + N * lift, N

    def _split(self, V, T, regions):
        """Triangles outside of all regions, and those in each."""
        cen = V[T].mean(1)
        which = np.full(len(T), -1)
        for k, loop in enumerate(regions):
            which[inside(loop, cen)] = k
        return which

    def side(self, zs, ys, windows=(), holes=()):
        """The left flank: (paint, [windows]). zs, ys: inner grid lines."""
        rows = self.o.rows
        (p, n), r = self.o.at(rows), self.radius(rows)
        border = p - n * r[:, None]
        floor = border[-1][1] + (border[0][1] - border[-1][1]) * np.linspace(0, 1, 14)[1:-1]
        foot = np.stack([np.linspace(border[-1][0], border[0][0], 14)[1:-1], floor], 1)
        border = np.concatenate([border, foot])
        grid = np.stack(np.meshgrid(zs, ys), -1).reshape(-1, 2)
        keep = poly_sdf(border, grid[:, 0], grid[:, 1]) < -0.03
        for loop in windows:
            keep &= seg_dist(loop, grid[:, 0], grid[:, 1]) > 0.05
        for loop in holes:
            keep &= poly_sdf(loop, grid[:, 0], grid[:, 1]) > 0.05
        V, T = triangulate(border, grid[keep], list(windows) + list(holes))
        T = T[:, ::-1]                                   # (z, y) seen from +X is mirrored
        which = self._split(V, T, list(windows) + list(holes))
        P, N = self.on_side(V[:, 0], V[:, 1])
        UV = self.side_uv(V[:, 0], V[:, 1])
        return Part(P, N, UV, T[which == -1]), [Part(P, N, UV, T[which == k]) for k in range(len(windows))]

    def strip(self, across, windows=()):
        """The left half of the strip between the rounded edges: (paint, [windows]). across: fractions of the flat
        half width with inner grid lines. Windows: half outlines (t, s) that begin and end on t = 0."""
        rows = self.o.rows
        a = self.hx - self.radius(rows)
        lines = np.asarray(across, float)
        foot0 = np.stack([lines * a[0], np.full(len(lines), rows[0])], 1)
        foot1 = np.stack([lines[::-1] * a[-1], np.full(len(lines), rows[-1])], 1)
        border = np.concatenate([np.stack([a, rows], 1), foot1, np.stack([0 * rows, rows], 1)[::-1], foot0])
        grid = np.concatenate([np.stack([np.full(len(lines), 0) + lines * ar, np.full(len(lines), s)], 1)
                               for ar, s in zip(a[1:-1], rows[1:-1])])
        keep = np.ones(len(grid), bool)
        for loop in windows:
            keep &= seg_dist(loop, grid[:, 0], grid[:, 1]) > 0.04
        V, T = triangulate(border, grid[keep], windows)
        which = self._split(V, T, windows)
        P, N = self.on_strip(np.maximum(V[:, 0], 1e-9), V[:, 1])
        P[V[:, 0] < 1e-6, 0] = 0.0
        UV = self.strip_uv(V[:, 0], V[:, 1])
        T = outward(P, N, T)
        return Part(P, N, UV, T[which == -1]), [Part(P, N, UV, T[which == k]) for k in range(len(windows))]

    def edge(self):
        """The left rounded edge between strip and flank."""
        rows, k = self.o.rows, self.steps
        r = self.radius(rows)
        t = (self.hx - r)[:, None] + r[:, None] * np.linspace(0, np.pi / 2, k + 1)
        s = np.repeat(rows[:, None], k + 1, 1)
        P, N = self.on_strip(t.ravel(), s.ravel())
        F = []
        for i in range(len(rows) - 1):
            for j in range(k):
                q = i * (k + 1) + j
                F += [(q, q + 1, q + k + 2), (q, q + k + 2, q + k + 1)]
        return Part(P, N, self.strip_uv(t.ravel(), s.ravel()), outward(P, N, np.array(F)))

    def patch(self, loop, rect, where='strip', lift=0.005, dome=0.0, skirt=0.03, fine=0.15):
        """A piece of the surface inside a loop, lifted, its edge turned down. UVs: the loop's bounding box on `rect`
        of the atlas, upright."""
        loop = divided(np.asarray(loop, float), 0.75 * fine)
        lo, hi = loop.min(0), loop.max(0)
        nx, ny = (max(1, int((hi - lo)[k] / fine)) for k in (0, 1))
        grid = np.stack(np.meshgrid(np.linspace(lo[0], hi[0], nx + 2)[1:-1], np.linspace(lo[1], hi[1], ny + 2)[1:-1]),
                        -1).reshape(-1, 2)
        far = -poly_sdf(loop, grid[:, 0], grid[:, 1])
        grid = grid[far > 0.2 * min((hi - lo).min(), fine)]
        V, T = triangulate(loop, grid, [])
        deep = np.clip(-poly_sdf(loop, V[:, 0], V[:, 1]), 0, None)
        on = self.on_strip if where == 'strip' else self.on_side
        P, N = on(V[:, 0], V[:, 1])
        T = outward(P, N, T)
        up = lift + dome * (1 - (1 - deep / max(deep.max(), 1e-9)) ** 2) if deep.max() > 1e-6 else lift
        top = P + N * np.reshape(up, (-1, 1))
        uv = (V - lo) / (hi - lo)
        if where == 'strip':
            uv = np.stack([uv[:, 0], 1 - uv[:, 1] if P[:, 2].mean() > self.o.P[:, 0].mean() else uv[:, 1]], 1)
        else:
            uv = np.stack([uv[:, 0], 1 - uv[:, 1]], 1)
        ring = [int(np.argmin(((V - p) ** 2).sum(1))) for p in loop]
        ring = [a for a, b in zip(ring, ring[1:] + ring[:1]) if a != b]
        low = P[ring] - N[ring] * skirt
        n, m = len(top), len(ring)
        F = ([(ring[k], ring[(k + 1) % m], n + (k + 1) % m) for k in range(m)]
             + [(ring[k], n + (k + 1) % m, n + k) for k in range(m)])
        F = np.array(F)
        allP = np.concatenate([top, low])
        mid = allP[F].mean(1) - top.mean(0)
        fn = np.cross(allP[F[:, 1]] - allP[F[:, 0]], allP[F[:, 2]] - allP[F[:, 0]])
        if (fn * mid).sum() < 0:
            F = F[:, ::-1]
        x, y, w, h = rect
        UV = np.concatenate([uv, uv[ring] * 0.96 + 0.02])
        return creased(allP, np.stack([x + UV[:, 0] * w, y + UV[:, 1] * h], 1), np.concatenate([T, F]), 45)

    def arch(self, az, hub, r, sill, inner, uv_lip, uv_dark, segments=14, proud=0.012):
        """The lip and the dark inside of a wheel arch in the left flank."""
        low = np.degrees(np.arcsin(np.clip((hub - sill) / r, -1, 1)))
        a = np.radians(np.linspace(-low, 180 + low, segments + 1))
        z, y = az + r * np.cos(a), hub + r * np.sin(a)
        P, N = self.on_side(z, np.maximum(y, sill))
        out = np.stack([0 * a, np.sin(a), np.cos(a)], 1)
        k = len(a)
        rings = [P + out * 0.045 + N * 0.001, P + out * 0.032 + N * proud, P + N * proud, P - N * 0.03]
        F = [t for j in range(len(rings) - 1) for i in range(k - 1)
             for t in ((j * k + i, j * k + i + 1, (j + 1) * k + i + 1),
                       (j * k + i, (j + 1) * k + i + 1, (j + 1) * k + i))]
        G = np.concatenate(rings)
        F = np.array(F)
        fn = np.cross(G[F[:, 1]] - G[F[:, 0]], G[F[:, 2]] - G[F[:, 0]])
        if fn[len(F) // 2, 0] < 0:
            F = F[:, ::-1]
        lip = creased(G, np.zeros((len(G), 2)), F, 50).swatch(*uv_lip)
        A, B = P - N * 0.004, P.copy()
        B[:, 0] = inner
        C = np.concatenate([A, B, [[inner, hub, az]]])
        F = [t for i in range(k - 1) for t in ((i, i + 1, k + i + 1), (i, k + i + 1, k + i))]
        F = np.array(F + [(k + i, k + i + 1, 2 * k) for i in range(k - 1)])
        inn = np.array([1.0, hub, az]) - C[F].mean(1)
        fn = np.cross(C[F[:, 1]] - C[F[:, 0]], C[F[:, 2]] - C[F[:, 0]])
        F = np.where(((fn * inn).sum(1) < 0)[:, None], F[:, ::-1], F)
        return lip, creased(C, np.zeros((len(C), 2)), F, 50).swatch(*uv_dark)


def divided(loop, longest):
    """A closed polygon with points added so that no side is longer."""
    out = []
    for a, b in zip(loop, np.roll(loop, -1, 0)):
        n = max(1, int(np.ceil(np.linalg.norm(b - a) / longest)))
        out += [a + (b - a) * k / n for k in range(n)]
    return np.array(out)


def outward(P, N, F):
    fn = np.cross(P[F[:, 1]] - P[F[:, 0]], P[F[:, 2]] - P[F[:, 0]])
    return np.where(((fn * N[F].mean(1)).sum(1) < 0)[:, None], F[:, ::-1], F)


def arch_loop(az, hub, r, segments=14):
    """A wheel arch as a hole in the side: a circle, open downward."""
    a = np.radians(np.linspace(-50, 230, int(segments * 280 / 200)))
    ring = np.stack([az + r * np.cos(a), hub + r * np.sin(a)], 1)
    return np.concatenate([ring, [[ring[-1, 0], -0.2], [ring[0, 0], -0.2]]])


def both(part):
    return [part, mirror_x(part)]
