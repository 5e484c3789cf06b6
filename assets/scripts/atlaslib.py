"""The texture atlas of a vehicle: one set of base colour, normal and occlusion/roughness/
metallic images for all of its materials.

`Canvas` draws one chart of a body in metres: colour, roughness and a relief, from which the
normals come. `furniture` draws what every vehicle needs: wheels, lenses, a number plate and
plain surfaces."""

import numpy as np
from PIL import Image, ImageDraw, ImageFont
import texlib as tx
from texlib import smooth, mix, rgb


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
        orm = np.stack(np.broadcast_arrays(occ, np.clip(rough, 0.04, 1), np.clip(metal, 0, 1), np.zeros((h, w)))[:3],
                       -1)
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

    def soft(self, d):
        """1 where d < 0, with an edge as wide as a pixel."""
        return smooth(0.6 * self.pixel, -0.6 * self.pixel, d)

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
        """Another surface where d < 0; flat: without what was pressed into it before."""
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
        return np.where(v < at[0], to[0] + (v - at[0]) * a,
                        np.where(v > at[-1], to[-1] + (v - at[-1]) * b, np.interp(v, at, to)))
    return lambda u, v: np.stack([spread(u, x[ox], cols[ox]) / atlas.w, spread(v, y[oy], rows[oy]) / atlas.h], -1)


def even(a, b, n):
    """n pixel centres from edge a to edge b."""
    return a + (np.arange(n) + 0.5) / n * (b - a)


def knots(places, pixels):
    """Pixel centres whose density changes: places[i]..places[i+1] take pixels[i] pixels."""
    return np.concatenate([even(a, b, n) for a, b, n in zip(places[:-1], places[1:], pixels)])


# ------------------------------------------------------------ atlas furniture

SWATCHES = [('plastic', '1a1b1c', 0.62, 0), ('rubber', '151515', 0.85, 0), ('under', '131211', 0.95, 0),
            ('chrome', 'd2d3d3', 0.14, 1),
            ('steel', '8c8d8e', 0.40, 1), ('gloss', '0a0a0b', 0.10, 0), ('grey', '55575a', 0.55, 0),
            ('alloy', 'a9acb0', 0.30, 1), ('dark_red', '5a1512', 0.4, 0), ('dial', 'b9c6b4', 0.3, 0)]


def furniture(atlas, x, y, rim, plate, seed):
    """Draw what every vehicle needs into a block of 512 by 128 pixels: rim, tyre, lenses, plate, plain surfaces."""
    draw_rim(atlas, x, y, 128, rim, seed)
    draw_tyre(atlas, x + 128, y, seed + 1)
    for k, (name, color) in enumerate((('glass_clear', 'efeee8'), ('glass_red', 'c21810'), ('glass_amber', 'f08c14'))):
        draw_lens(atlas, x + 166 + 66 * k, y, color, name, name == 'glass_clear')
    draw_plate(atlas, x + 432, y, plate)
    draw_mirror(atlas, x + 432, y + 22)
    for k, (name, color, rough, metal) in enumerate(SWATCHES):
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
    lug = (smooth(0.16, 0.06, np.abs(((u + 1 + c * 1.5) % 0.5) * 2 - 0.5))
           * smooth(0.155, 0.17, c) * smooth(0.225, 0.205, c))
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
        across = np.abs(turn(5)) * r                                     # five broad spokes, each with a groove
        split = 0.035 - across * smooth(0.5, 0.8, r)
        open_ = smooth(-0.02, 0.02, across - (0.15 - 0.05 * r)) * smooth(0.25, 0.29, r) * smooth(0.88, 0.84, r)
        col, met, rough = np.tile(rgb('b4b7ba'), (s, s, 1)), np.full_like(r, 0.9), np.full_like(r, 0.3)
        h = (-0.02 * open_ + 0.004 * smooth(0.05, 0.0, np.abs(r - 0.93))
             - 0.004 * smooth(0.02, 0.0, np.abs(split - 0.03)) * (1 - open_))
        bolts = smooth(0.045, 0.030, np.hypot(r - 0.20, turn(5, 0.5) * r))
    elif style == 'truck':
        open_ = smooth(0.08, 0.055, np.hypot(r - 0.72, turn(10) * r))
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
