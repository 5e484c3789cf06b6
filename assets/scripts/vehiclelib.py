"""What the vehicles share: bodies from a side view, their texture atlas, wheels, lamps.

A body (`Shell`) is drawn as on paper: an outline of the side view, from the front's lower
edge over bonnet and roof to the rear's, is extruded across, its edges are rounded, and the
whole is bent by a smooth function. It has two charts, each flat and in metres, in which
outlines (windows, wheel arches) are triangulated and the texture is drawn:

- `side`: (z, y), both flanks, mirrored;
- `strip`: (t, s), s metres along the outline, t metres across from the middle, over the
  rounded edge; both halves, mirrored.

Windows are parts of the surface with a material of their own; lamps (`Shell.patch`) are
pieces of it, lifted. All materials of a vehicle share the atlas's three images."""

import numpy as np
import bpy  # noqa: F401  (brings mathutils)
from mathutils.geometry import delaunay_2d_cdt
from PIL import Image, ImageDraw, ImageFont
from meshlib import *
import texlib as tx
from texlib import smooth, mix, rgb


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
        grid = np.concatenate([np.stack([np.full(len(lines), 0) + lines * ar, np.full(len(lines), s)], 1) for ar, s in zip(a[1:-1], rows[1:-1])])
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
        grid = np.stack(np.meshgrid(np.linspace(lo[0], hi[0], nx + 2)[1:-1], np.linspace(lo[1], hi[1], ny + 2)[1:-1]), -1).reshape(-1, 2)
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
        F = [(ring[k], ring[(k + 1) % m], n + (k + 1) % m) for k in range(m)] + [(ring[k], n + (k + 1) % m, n + k) for k in range(m)]
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
             for t in ((j * k + i, j * k + i + 1, (j + 1) * k + i + 1), (j * k + i, (j + 1) * k + i + 1, (j + 1) * k + i))]
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


# --------------------------------------------------------------------- atlas

class Atlas:
    """Base colour, tangent-space normals and occlusion/roughness/metallic of one vehicle."""

    def __init__(self, width=512, height=512):
        self.w, self.h = width, height
        self.base = np.full((height, width, 3), 0.08)
        self.nrm = np.zeros((height, width, 3))
        self.nrm[..., 2] = 1
        self.orm = np.ones((height, width, 3))
        self.orm[..., 2] = 0
        self.uv = {}                                     # name: centre of a swatch, or (x, y, w, h), in UV

    def rect(self, x, y, w, h, inset=1.0):
        return ((x + inset) / self.w, (y + inset) / self.h, (w - 2 * inset) / self.w, (h - 2 * inset) / self.h)

    def put(self, x, y, base, rough, metal, height=None, metres=None, occ=1.0, name=None):
        h, w = base.shape[:2]
        self.base[y:y + h, x:x + w] = np.clip(base, 0, 1)
        orm = np.stack(np.broadcast_arrays(occ, np.clip(rough, 0.04, 1), np.clip(metal, 0, 1), np.zeros((h, w)))[:3], -1)
        self.orm[y:y + h, x:x + w] = orm
        if height is not None:
            self.nrm[y:y + h, x:x + w] = slopes(height, *metres)
        if name:
            self.uv[name] = self.rect(x, y, w, h)

    def swatch(self, name, x, y, color, rough, metal=0.0, size=22):
        self.put(x, y, np.tile(rgb(color), (size, size, 1)), rough, metal)
        self.uv[name] = ((x + size / 2) / self.w, (y + size / 2) / self.h)

    def images(self, g, name, half_orm=True, quality=86):
        """Embed the three; returns texture indices (base, normal, orm)."""
        orm = self.orm
        if half_orm:
            orm = orm.reshape(self.h // 2, 2, self.w // 2, 2, 3).mean((1, 3))
        return (g.image(tx.to8(self.base), 'jpg', quality, name + '_base'),
                g.image(tx.encode_normal(self.nrm, 2), 'png', name=name + '_normal'),
                g.image(tx.to8(orm), 'jpg', quality, name + '_occlusion_roughness_metallic'))


def slopes(h, dx, dy):
    """Normals of a height field in metres; dx, dy: metres per pixel (numbers or arrays)."""
    p = np.pad(h, 1, mode='edge')
    r, c = h.shape
    s = lambda j, i: p[1 + j:1 + j + r, 1 + i:1 + i + c]
    gx = ((s(-1, 1) - s(-1, -1)) + 2 * (s(0, 1) - s(0, -1)) + (s(1, 1) - s(1, -1))) / 8 / dx
    gy = ((s(1, -1) - s(-1, -1)) + 2 * (s(1, 0) - s(-1, 0)) + (s(1, 1) - s(-1, 1))) / 8 / dy
    n = np.stack([-gx, gy, np.ones_like(h)], -1)
    return n / np.linalg.norm(n, axis=-1, keepdims=True)


class Canvas:
    """One chart of the body, drawn in metres. x: metres per column (array), y: metres per row, falling."""

    def __init__(self, atlas, rect, x, y, seed, coat='e9e9e6', rough=0.30):
        self.atlas, self.px = atlas, rect
        self.x, self.y = np.meshgrid(x, y)
        self.dx, self.dy = np.abs(np.gradient(x))[None, :], np.abs(np.gradient(y))[:, None]
        self.pixel = max(float(np.median(self.dx)), float(np.median(self.dy)))
        h, w = self.x.shape
        n = lambda k, **kw: np.tile(tx.noise(512, seed + k, **kw), (2, 2))[:h, :w]
        self.lo, self.mid = n(0, beta=1.7, lo=1, hi=14), n(1, beta=1.2, lo=6, hi=90)
        self.streak = n(2, beta=1.1, lo=4, hi=160, ax=1.6, ay=0.12)
        self.base = np.tile(rgb(coat), (h, w, 1)) * (1 + 0.012 * self.lo)[..., None]
        self.rough = np.full((h, w), rough) + 0.015 * self.mid
        self.met, self.h, self.gap = np.zeros((h, w)), np.zeros((h, w)), np.zeros((h, w))

    def soft(self, d, least=0.0):
        """1 where d < 0, with an edge as wide as a pixel."""
        e = max(0.6 * self.pixel, least)
        return smooth(e, -e, d)

    def line(self, d, width=0.007, depth=0.006, dark=0.9):
        """A panel gap along d = 0; never thinner than the pixels can show."""
        w = max(width, 0.75 * self.pixel)
        d = np.abs(d)
        self.gap = np.maximum(self.gap, dark * smooth(w, 0.3 * w, d) * min(1.0, 1.6 * width / w))
        self.h -= depth * smooth(1.9 * w, 0.2 * w, d)

    def ridge(self, d, height, width):
        """A rounded bead (height > 0) or groove along d = 0."""
        self.h += height * (0.5 + 0.5 * np.cos(np.pi * np.clip(np.abs(d) / width, 0, 1)))

    def raise_(self, d, height, edge=0.012):
        """A pressed area where d < 0."""
        e = max(edge, self.pixel)
        self.h += height * smooth(e, -e, d)

    def fill(self, d, color=None, rough=None, metal=None, flat=False):
        """Another surface where d < 0."""
        m = self.soft(d)
        if color is not None:
            self.base = mix(self.base, rgb(color) if isinstance(color, str) else color, m)
        if rough is not None:
            self.rough = self.rough * (1 - m) + rough * m
        if metal is not None:
            self.met = self.met * (1 - m) + metal * m
        if flat:
            self.h = np.where(d < 0, 0, self.h)
            self.gap *= 1 - m
        return m

    def glass(self, d, y0, y1, seats=None, rim=0.018):
        """Dark glass where d < 0, lighter toward the top as if the sky shone through, in a black rubber rim."""
        self.fill(d, '0b0c0d', 0.5, 0, flat=True)
        self.ridge(d + rim, 0.006, 0.02)
        k = np.clip((self.y - y0) / max(y1 - y0, 1e-6), 0, 1)
        col = mix(rgb('07090a'), rgb('1b242a'), k)
        if seats is not None:
            col = mix(col, rgb('030404'), 0.75 * self.soft(seats))
        dust = smooth(-0.16, -rim, d) * np.clip(0.5 + 0.25 * self.mid, 0, 1)
        col = mix(col, rgb('55524b'), 0.16 * dust)
        m = self.soft(d + rim)
        self.base = mix(self.base, col, m)
        self.rough = self.rough * (1 - m) + (0.06 + 0.2 * dust) * m

    def grille(self, d, pitch, upright=False, color='0c0c0d', bar='3a3b3c', metal=0.6, depth=0.02):
        """Slats over darkness where d < 0."""
        m = self.soft(d)
        k = self.x if upright else self.y
        w = 0.5 + 0.5 * np.cos(2 * np.pi * k / pitch)
        self.h = self.h * (1 - m) + m * depth * (w - 1)
        self.base = mix(self.base, mix(rgb(color), rgb(bar), smooth(0.45, 0.7, w)), m)
        self.rough = self.rough * (1 - m) + m * 0.4
        self.met = self.met * (1 - m) + m * metal * smooth(0.45, 0.7, w)
        self.gap *= 1 - m

    def weather(self, low, amount=1.0):
        """Gaps become dark, dust rises from below (low: 0..1), a film over all."""
        self.base = mix(self.base, rgb('101111'), self.gap * 0.92)
        self.rough = self.rough + 0.4 * self.gap
        drip = sum(np.roll(self.gap, k, 0) * np.exp(-k / 5.0) for k in range(1, 14, 2)) / 4
        self.base = mix(self.base, rgb('4c463c'), np.clip(drip, 0, 1) * smooth(-0.4, 1.2, self.streak) * 0.25 * amount)
        dirt = np.clip(low * (0.6 + 0.28 * self.lo + 0.25 * self.mid), 0, 1) * amount
        self.base = mix(self.base, rgb('6e665a'), dirt * 0.7)
        self.rough = mix(self.rough, 0.85, dirt * 0.9)
        self.met = self.met * (1 - dirt * 0.8)
        film = np.clip(0.06 + 0.05 * self.streak + 0.04 * self.lo, 0, 1) * amount
        self.base = mix(self.base, rgb('8b857a'), film * 0.35)
        self.rough = self.rough + film * 0.25

    def put(self):
        x, y = self.px[:2]
        self.atlas.put(x, y, self.base, self.rough, self.met, self.h, (self.dx, self.dy), 1 - 0.7 * self.gap)


def chart(rect, atlas, x, y):
    """UV function of a chart: coordinates per pixel (x along columns rising or falling, y along rows)."""
    px, py, w, h = rect
    cols, rows = px + np.arange(w) + 0.5, py + np.arange(h) + 0.5
    ox, oy = np.argsort(x), np.argsort(y)

    def spread(v, at, to):                               # linear beyond the ends, too
        a, b = (to[1] - to[0]) / (at[1] - at[0]), (to[-1] - to[-2]) / (at[-1] - at[-2])
        return np.where(v < at[0], to[0] + (v - at[0]) * a, np.where(v > at[-1], to[-1] + (v - at[-1]) * b, np.interp(v, at, to)))
    return lambda u, v: np.stack([spread(u, x[ox], cols[ox]) / atlas.w, spread(v, y[oy], rows[oy]) / atlas.h], -1)


def even(a, b, n):
    """n pixel centres from edge a to edge b."""
    return a + (np.arange(n) + 0.5) / n * (b - a)


def knots(places, pixels):
    """Pixel centres whose density changes: places[i]..places[i+1] take pixels[i] pixels."""
    return np.concatenate([even(a, b, n) for a, b, n in zip(places[:-1], places[1:], pixels)])


# ------------------------------------------------------------ atlas furniture

SWATCHES = [('plastic', '1a1b1c', 0.62, 0), ('rubber', '151515', 0.85, 0), ('under', '131211', 0.95, 0), ('chrome', 'd2d3d3', 0.14, 1),
            ('steel', '8c8d8e', 0.40, 1), ('gloss', '0a0a0b', 0.10, 0), ('grey', '55575a', 0.55, 0), ('white', 'e6e6e2', 0.40, 0),
            ('alloy', 'a9acb0', 0.30, 1), ('leather', '2a211b', 0.6, 0), ('dark_red', '5a1512', 0.4, 0), ('dial', 'b9c6b4', 0.3, 0)]


def furniture(atlas, x, y, rim, plate, seed, swatches=()):
    """Draw what every vehicle needs into a block of 512 by 128 pixels: rim, tyre, lenses, plate, plain surfaces."""
    draw_rim(atlas, x, y, 128, rim, seed)
    draw_tyre(atlas, x + 128, y, seed + 1)
    for k, (name, color) in enumerate((('glass_clear', 'efeee8'), ('glass_red', 'c21810'), ('glass_amber', 'f08c14'), ('lens_white', 'e8e8e4'))):
        draw_lens(atlas, x + 166 + 66 * k, y, color, name, name == 'glass_clear')
    draw_plate(atlas, x + 432, y, plate)
    draw_mirror(atlas, x + 432, y + 22)
    for k, (name, color, rough, metal) in enumerate(SWATCHES + list(swatches)):
        atlas.swatch(name, x + 166 + 24 * (k % 14), y + 68 + 24 * (k // 14), color, rough, metal)


def draw_lens(atlas, x, y, color, name, bowl):
    """A lamp's glass: a bright bowl behind fine flutes, or prisms, darker toward the rim."""
    s = 64
    u, v = np.meshgrid(even(-1, 1, s), even(-1, 1, s))
    edge = np.maximum(np.abs(u), np.abs(v))
    if bowl:
        r = np.hypot(u, v * 0.9)
        flute = 0.5 + 0.5 * np.cos(u * 30)
        light = 0.30 + 0.70 * np.exp(-(r / 0.55) ** 2) + 0.10 * flute * np.exp(-(r / 0.8) ** 2)
        light -= 0.25 * smooth(0.06, 0.0, np.abs(r - 0.72))
        h = flute * 0.0006
    else:
        cell = (0.5 + 0.5 * np.cos(u * 25)) * (0.5 + 0.5 * np.cos(v * 25))
        light = 0.45 + 0.40 * np.exp(-(u * u + v * v) / 0.5) + 0.25 * cell
        h = cell * 0.0012
    light = light * (1 - 0.55 * smooth(0.86, 1.0, edge))
    col = np.clip(rgb(color) * light[..., None] + 0.10 * np.clip(light - 0.8, 0, 1)[..., None], 0, 1)
    atlas.put(x, y, col, 0.10, 0.0, h, (0.15 / s, 0.15 / s), name=name)


def draw_plate(atlas, x, y, text, w=80, h=20):
    im = Image.new('RGB', (w * 4, h * 4), (236, 236, 230))
    d = ImageDraw.Draw(im)
    d.rectangle((3, 3, w * 4 - 4, h * 4 - 4), outline=(18, 18, 18), width=4)
    d.text((w * 2, h * 2), text, fill=(16, 16, 18), font=ImageFont.load_default(58), anchor='mm')
    atlas.put(x, y, np.asarray(im.resize((w, h), Image.LANCZOS)) / 255.0, 0.45, 0.0, name='plate')


def draw_mirror(atlas, x, y, w=80, h=40):
    """A looking glass: it shows a sky over the street."""
    v = np.linspace(1, 0, h)[:, None] * np.ones((1, w))
    col = mix(rgb('35383a'), rgb('8f9aa3'), smooth(0.35, 0.8, v))
    atlas.put(x, y, col, 0.06, 0.85, name='mirror')


def draw_tyre(atlas, x, y, seed):
    """One segment of a tyre: across it lie inner wall, tread, outer wall (v 0..1); 24 by 128 pixels and
    7 more on both sides, so that no neighbour bleeds in."""
    u, v = np.meshgrid(even(-7 / 24, 31 / 24, 38), even(0, 1, 128))
    c = np.abs(v - 0.5)
    tread = smooth(0.26, 0.24, c)
    groove = np.maximum(smooth(0.016, 0.008, np.abs(c - 0.06)), smooth(0.016, 0.008, np.abs(c - 0.15)))
    lug = smooth(0.16, 0.06, np.abs(((u + 1 + c * 1.5) % 0.5) * 2 - 0.5)) * smooth(0.155, 0.17, c) * smooth(0.225, 0.205, c)
    cut = tread * np.maximum(groove, lug)
    n = tx.noise(128, seed, beta=0.9, lo=2, hi=60)[:, :38]
    h = -0.006 * cut + 0.003 * smooth(0.012, 0.004, np.abs(c - 0.30)) + 0.002 * smooth(0.012, 0.004, np.abs(c - 0.44))
    col = mix(rgb('1e1e1f'), rgb('181818'), tread) * (1 + 0.08 * n)[..., None]
    col = mix(col, rgb('090909'), cut)
    dust = np.clip(0.22 + 0.15 * n, 0, 1) * (0.45 + 0.55 * smooth(0.1, 0.3, c))
    col = mix(col, rgb('5d564a'), dust * 0.45)
    atlas.put(x, y, col, 0.82 + 0.1 * dust, 0.0, h, (0.08 / 24, 0.5 / 128))
    atlas.uv['tyre'] = atlas.rect(x + 7, y, 24, 128)


def draw_rim(atlas, x, y, s, style, seed):
    """A wheel's face seen from outside, the rim's radius at 0.98 of the half image. style: alloy, steel or truck."""
    u, v = np.meshgrid(even(-1, 1, s), even(1, -1, s))
    r, a = np.hypot(u, v) / 0.98, np.arctan2(v, u)
    n = tx.noise(s, seed, beta=1.2, lo=2, hi=50)
    turn = lambda k, off=0.0: ((a / (2 * np.pi) * k + off) % 1.0 - 0.5) * 2 * np.pi / k
    if style == 'alloy':
        ca = turn(5)
        spoke = np.abs(ca) * r - (0.15 - 0.05 * r)                       # five broad spokes
        split = 0.035 - np.abs(ca) * r * smooth(0.5, 0.8, r)
        hole = np.maximum(np.maximum(-spoke * -1, 0.26 - r), r - 0.86)
        hole = np.where((r > 0.26) & (r < 0.86), spoke, -1)
        open_ = smooth(-0.02, 0.02, hole) * smooth(0.25, 0.29, r) * smooth(0.88, 0.84, r)
        col, met, rough = np.tile(rgb('b4b7ba'), (s, s, 1)), np.full_like(r, 0.9), np.full_like(r, 0.3)
        h = -0.02 * open_ + 0.004 * smooth(0.05, 0.0, np.abs(r - 0.93)) - 0.004 * smooth(0.02, 0.0, np.abs(split - 0.03)) * (1 - open_)
        bolts = smooth(0.045, 0.030, np.hypot(r - 0.20, turn(5, 0.5) * r))
    elif style == 'truck':
        open_ = smooth(0.08, 0.055, np.hypot((r - 0.72) * 1.0, turn(10) * r))
        col, met, rough = np.tile(rgb('c4c5c4'), (s, s, 1)), np.full_like(r, 0.25), np.full_like(r, 0.45)
        h = -0.02 * open_ + 0.006 * smooth(0.06, 0.0, np.abs(r - 0.92)) - 0.01 * smooth(0.06, 0.0, np.abs(r - 0.58))
        bolts = smooth(0.045, 0.030, np.hypot(r - 0.46, turn(10, 0.5) * r))
    else:
        open_ = smooth(0.09, 0.06, np.hypot((r - 0.62) * 1.15, turn(9) * r))
        col, met, rough = np.tile(rgb('9a9c9d'), (s, s, 1)), np.full_like(r, 0.5), np.full_like(r, 0.42)
        h = -0.012 * open_ + 0.004 * smooth(0.05, 0.0, np.abs(r - 0.84))
        bolts = smooth(0.05, 0.035, np.hypot(r - 0.32, turn(5) * r))
    h = h + 0.006 * bolts
    col = col * (1 + 0.03 * n)[..., None]
    col = mix(col, rgb('3c3d3e'), bolts * 0.7)
    grime = np.clip(smooth(0.45, 0.95, r) * (0.35 + 0.2 * n) + 0.25 * smooth(0.12, 0.02, np.abs(h)), 0, 1)
    col = mix(col, rgb('4d4438'), 0.25 * grime)
    col = mix(col, rgb('0a0a0a'), open_)
    met, rough = met * (1 - open_) * (1 - 0.4 * grime), rough * (1 - open_) + 0.9 * open_ + 0.2 * grime
    cap = smooth(0.17, 0.15, r)
    col, rough = mix(col, rgb('77797b'), cap * 0.6), np.clip(rough, 0, 1)
    atlas.put(x, y, col, rough, met, h, (0.4 / s, 0.4 / s), name='rim')


# -------------------------------------------------------------------- wheels

TURN = np.array([[0, 1, 0], [0, 0, -1], [-1, 0, 0]], float)      # axis +Y -> +X, image up stays up


def tyre(atlas, R, rim_r, width, seg, offset=0.0, rows=None):
    """A tyre around X; its tile repeats, mirrored, with each segment."""
    w = width / 2
    # section (radius, axis, v of the tile) from the inner bead over the tread to the outer
    sec = rows or [(rim_r, -w + 0.012, 0.0), (rim_r + 0.45 * (R - rim_r), -w, 0.12), (R - 0.10 * (R - rim_r) - 0.004, -w + 0.012, 0.23),
                   (R, -w + 0.22 * width, 0.32), (R, w - 0.22 * width, 0.68), (R - 0.10 * (R - rim_r) - 0.004, w - 0.012, 0.77),
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
    face = face.uvmap(lambda P, UV: np.stack([x + w * (0.5 + 0.49 * P[:, 0] / rim_r), y + h * (0.5 + 0.49 * P[:, 2] / rim_r)], 1))
    parts = [face.mat(TURN)]
    if back is not None:
        plate = lathe([(0.0, back), (rim_r, back)], seg // 2, 30)
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
    profile = [(rim_r, w - 0.012), (0.90 * rim_r, w - 0.05), (0.62 * rim_r, w - 0.035), (0.50 * rim_r, w + 0.015), (0.24 * rim_r, w + 0.03), (0.0, w + 0.03)]
    return merge(tyre(atlas, R, rim_r, width, seg), *disc(atlas, profile, seg, rim_r, -w + 0.04))


def double_wheel(atlas, R, width, rim_r, seg=20, gap=0.05):
    """Two tyres side by side, one mesh: the face lies deep in the outer one."""
    w = width / 2
    out = w + gap / 2
    profile = [(rim_r, out + w - 0.012), (0.94 * rim_r, out + w - 0.05), (0.86 * rim_r, out - 0.06), (0.50 * rim_r, out - 0.08), (0.44 * rim_r, out + 0.02), (0.0, out + 0.03)]
    inner = [(rim_r, -w + 0.012, 0.0), (R - 0.02, -w + 0.01, 0.2), (R, -w + 0.22 * width, 0.32), (R, w - 0.22 * width, 0.68), (R - 0.03, w, 0.8)]
    return merge(tyre(atlas, R, rim_r, width, seg, out), tyre(atlas, R, rim_r, width, 12, -out, inner), *disc(atlas, profile, seg, rim_r, -out - w + 0.04))


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
                self.g.node('%s_%s' % (name, side), mesh, (sx * x, y, z), None if sx > 0 else (0, 1, 0, 0), self.root if parent is None else parent)

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
