"""Everything of the yard except the van: lamps, figure, barrel, crate,
container, gate, pipes and the brick facade."""

import os
import sys
import numpy as np
from PIL import Image
from meshlib import *
import texlib as tx
from texlib import smooth, mix, rgb

HERE = os.path.dirname(os.path.abspath(__file__))
TEX = os.path.join(HERE, '..', 'textures')
OUT = os.path.join(HERE, '..', 'models')


def spline(pts, n):
    """Catmull-Rom through the points, n samples in all."""
    p = np.asarray(pts, float)
    p = np.concatenate([[2 * p[0] - p[1]], p, [2 * p[-1] - p[-2]]])
    t = np.linspace(0, len(pts) - 1, n)
    i = np.minimum(t.astype(int), len(pts) - 2)
    f = (t - i)[:, None]
    a, b, c, d = p[i], p[i + 1], p[i + 2], p[i + 3]
    return 0.5 * (2 * b + (c - a) * f + (2 * a - 5 * b + 4 * c - d) * f ** 2 + (3 * b - a - 3 * c + d) * f ** 3)


def load(name, size):
    im = Image.open(os.path.join(TEX, name)).convert('RGB')
    return np.asarray(im.resize((size, size), Image.BOX) if im.width != size else im)


def load_normal(name, size):
    a = load(name + '_normal.png', Image.open(os.path.join(TEX, name + '_normal.png')).width) / 127.5 - 128 / 127.5
    k = a.shape[0] // size
    a = a.reshape(size, k, size, k, 3).mean((1, 3))
    a /= np.linalg.norm(a, axis=-1, keepdims=True)
    return tx.encode_normal(a)


def iron(g, color='2a332f', seed=600, n=256, chips=1.0, name='iron'):
    """Painted cast iron, chipped and rusting: base, normal, roughness-metallic."""
    mid, hi, lo = tx.noise(n, seed, 1.1, 6, 60), tx.noise(n, seed + 1, 0.6, 30, 120), tx.noise(n, seed + 2, 1.7, 1, 8)
    paint = rgb(color) * (1 + 0.10 * lo + 0.05 * mid)[..., None]
    chip = smooth(2.0, 2.2, tx.noise(n, seed + 3, 1.0, 4, 90) + 0.25 * hi) * chips
    rust = smooth(1.65, 2.1, tx.noise(n, seed + 4, 1.4, 2, 60) + 0.25 * hi) * chips
    ru = mix(rgb('7a4324'), rgb('4b2c1e'), tx.uniform_noise(n, seed + 5, beta=0.8, lo=6, hi=100))
    base = mix(paint, rgb('5d4030'), np.clip(tx.blur(rust, 3), 0, 1) * 0.5)
    base = mix(mix(base, ru, rust), rgb('9a9a96'), chip * (1 - rust))
    h = 0.0010 * (0.22 * mid + 0.15 * hi - 0.5 * chip + 0.35 * rust * (1 + 0.5 * hi))
    rough = np.clip(0.46 + 0.05 * mid + 0.05 * lo, 0, 1) * (1 - rust) + 0.9 * rust
    met = np.clip(chip * (1 - rust), 0, 1)
    tb = g.image(tx.to8(np.clip(base, 0, 1)), 'jpg', 88, name + '_base')
    tn = g.image(tx.encode_normal(tx.normal_from_height(h, 0.5, 1.0)), 'jpg', 92, name + '_normal')
    to = g.image(tx.to8(np.stack([np.ones_like(h), rough, met], -1)), 'jpg', 86, name + '_roughness_metallic')
    return g.material(name, tb, tn, to)


def metres(part, s=2.0):
    """UVs of a swept or turned part in metres (s repeats per metre)."""
    return part.uvmap(lambda P, UV: UV * s)


def turned(profile, seg, angle=35, s=2.0):
    """Lathe with UVs near real size, whole repeats around."""
    pr = np.asarray(profile, float)
    ln = np.linalg.norm(np.diff(pr, axis=0), axis=1).sum()
    rep = max(1, round(2 * np.pi * pr[:, 0].max() * s))
    p = lathe(pr, seg, angle, u_repeat=rep)
    p.UV[:, 1] *= ln * s
    return p


def swept(path, r, seg=10, s=2.0, **k):
    path = np.asarray(path, float)
    ln = np.linalg.norm(np.diff(path, axis=0), axis=1).sum()
    rep = max(1, round(2 * np.pi * np.max(r) * s))
    p = tube(path, r, seg, **k)
    p.UV = p.UV * (rep, ln * s)
    return p


def torus(R, r, n=24, m=10):
    a = np.arange(n) / n * 2 * np.pi
    return tube(np.stack([R * np.cos(a), np.zeros(n), R * np.sin(a)], 1), r, m, closed=True)


# ---------------------------------------------------------------- the figure

def kettle():
    g = Glb()
    m = g.material('glaze', color=(0.80, 0.78, 0.74, 1), metallic=0, roughness=0.35)
    body = spline([(0.0, -0.60), (0.30, -0.60), (0.44, -0.575), (0.47, -0.54), (0.60, -0.42), (0.70, -0.20),
                   (0.69, 0.04), (0.58, 0.25), (0.43, 0.36),
                   (0.375, 0.385), (0.365, 0.415), (0.38, 0.435), (0.34, 0.450), (0.25, 0.505), (0.13, 0.55),
                   (0.075, 0.58), (0.065, 0.625), (0.105, 0.675),
                   (0.112, 0.725), (0.070, 0.775), (0.0, 0.79)], 61)
    body[:, 0] = np.maximum(body[:, 0], 0)
    body[0, 0] = body[-1, 0] = 0
    # UVs: one image covers about 1.4 units everywhere, so that relief has one grain
    parts = [lathe(body, 48, 60, u_repeat=3).uvmap(lambda P, UV: UV * (1, 1.8))]
    path = spline([(0.50, -0.30, 0), (0.72, -0.24, 0), (0.875, -0.05, 0), (0.945, 0.17, 0), (1.055, 0.335, 0)], 22)
    rad = np.interp(np.linspace(0, 1, 22), [0, 0.25, 0.6, 0.9, 1], [0.21, 0.165, 0.105, 0.082, 0.095])
    # the mouth turns in, so the spout is closed and shows a hollow
    d = path[-1] - path[-2]; d /= np.linalg.norm(d)
    path = np.concatenate([path, [path[-1] + d * 0.012, path[-1] + d * 0.008, path[-1] - d * 0.05,
                                  path[-1] - d * 0.10]])
    rad = np.concatenate([rad, [0.090, 0.078, 0.066, 0.060]])
    parts.append(sweep_open(path, rad, 20).uvmap(lambda P, UV: UV * (0.6, 0.75)))
    hp = spline([(-0.48, 0.27, 0), (-0.66, 0.36, 0), (-0.88, 0.36, 0), (-1.03, 0.20, 0), (-1.02, -0.04, 0),
                 (-0.88, -0.24, 0), (-0.60, -0.33, 0)], 34)
    parts.append(tube(hp, np.interp(np.linspace(0, 1, 34), [0, 0.15, 0.5, 0.85, 1],
                                    [0.085, 0.062, 0.058, 0.062, 0.080]), 14, 70,
                      squash=1.35).uvmap(lambda P, UV: UV * (0.32, 1.6)))
    k = merge(parts)
    c = np.array([0, (k.P[:, 1].max() + k.P[:, 1].min()) / 2, 0])
    k.P -= c
    k.P *= 0.99 / np.linalg.norm(k.P, axis=1).max()
    g.node('kettle', g.mesh('kettle', [(k, m)]))
    g.save(os.path.join(OUT, 'kettle.glb'))


def sweep_open(path, rad, seg):
    """A tube that may turn back on itself (explicit frame in the XY plane)."""
    t = np.zeros_like(path)
    t[:-4] = np.gradient(path[:-4], axis=0)
    t[-4:] = t[-5]
    t /= np.linalg.norm(t, axis=1, keepdims=True)
    e1 = np.array([0, 0, 1.0])
    ang = np.arange(seg + 1) / seg * 2 * np.pi
    P, UV = [], []
    for i in range(len(path)):
        e2 = np.cross(t[i], e1)
        ring = path[i] + rad[i] * (np.cos(ang)[:, None] * e1 + np.sin(ang)[:, None] * e2)
        ring[-1] = ring[0]
        P.append(ring)
        UV.append(np.stack([ang / (2 * np.pi), np.full(seg + 1, i / (len(path) - 1))], 1))
    P, UV = list(np.concatenate(P)), list(np.concatenate(UV))
    k = seg + 1
    F = []
    for i in range(len(path) - 1):
        for j in range(seg):
            a, b, c, d = i * k + j, i * k + j + 1, (i + 1) * k + j + 1, (i + 1) * k + j
            F += [(a, b, c), (a, c, d)]
    for row, rev in ((0, True), (len(path) - 1, False)):
        b = len(P)
        P.append(path[row]); UV.append((0.5, row / (len(path) - 1)))
        for j in range(seg):
            q = (b, row * k + j, row * k + j + 1)
            F.append(q[::-1] if rev else q)
    return creased(P, UV, F, 60)


# -------------------------------------------------------------------- lamps

def lamp_glass(g, power=1.0):
    return g.material('lamp_glass', color=(1.0, 0.93, 0.80, 1), metallic=0, roughness=0.25, emissive=(1.0, 0.78, 0.48))


def enamel(g):
    return g.material('enamel', color=(0.78, 0.76, 0.70, 1), metallic=0, roughness=0.4)


def bell(r=0.24):
    """A bell shade hanging from the origin downward: outside (iron) and inside (enamel)."""
    o = [(r * 1.000, -0.205), (r * 1.03, -0.212), (r * 1.02, -0.196), (r * 0.93, -0.165), (r * 0.72, -0.110),
         (r * 0.46, -0.070), (r * 0.30, -0.045), (r * 0.26, -0.020), (r * 0.24, 0.035), (r * 0.14, 0.050), (0.0, 0.052)]
    i = [(0.0, -0.055), (r * 0.30, -0.058), (r * 0.46, -0.080), (r * 0.72, -0.120), (r * 0.93, -0.172),
         (r * 1.00, -0.205)]
    outer = turned(o, 28, 40)
    inner = lathe(i, 28, 60)
    if inner.N[:, 1].mean() > 0:
        inner = inner.flip()
    return outer, inner


def bulb(r=0.075):
    return lathe([(0.0, -0.075 - 2.1 * r), (r * 0.5, -0.075 - 2.0 * r), (r * 0.88, -0.075 - 1.6 * r),
                  (r, -0.075 - 1.1 * r), (r * 0.86, -0.075 - 0.55 * r), (r * 0.5, -0.06), (r * 0.45, -0.04)], 20, 80)


def lamp_post():
    g = Glb()
    mi = iron(g, '27332f', 610)
    me, mg = enamel(g), lamp_glass(g)
    base = turned([(0.0, 0.0), (0.20, 0.0), (0.20, 0.06), (0.185, 0.075), (0.17, 0.09), (0.17, 0.50), (0.18, 0.52),
                   (0.18, 0.56), (0.14, 0.60), (0.105, 0.66), (0.095, 0.72), (0.105, 0.74), (0.105, 0.77),
                   (0.085, 0.79)], 24, 32)
    shaft = turned([(0.078, 0.78), (0.066, 2.0), (0.058, 2.38), (0.075, 2.40), (0.080, 2.43), (0.075, 2.46),
                    (0.056, 2.48), (0.048, 3.25), (0.060, 3.27), (0.064, 3.30), (0.060, 3.33), (0.042, 3.35)], 16, 30)
    parts = [base, shaft]
    # flutes on the plinth
    for k in range(8):
        a = k * 45
        parts.append(box(0.045, 0.34, 0.02, 0.008, 2.0).move(0, 0.29, 0.170).rot('y', a + 22.5))
    neck = spline([(0, 3.30, 0), (0, 3.62, 0.0), (0, 3.88, 0.10), (0, 4.02, 0.36), (0, 4.00, 0.66), (0, 3.86, 0.82),
                   (0, 3.78, 0.84)], 26)
    parts.append(swept(neck, np.interp(np.linspace(0, 1, 26), [0, 1], [0.040, 0.026]), 12))
    scroll = []
    for t in np.linspace(0, 1.6 * np.pi, 18):
        rr = 0.16 * (1 - t / (2.4 * np.pi))
        scroll.append((0, 3.66 + rr * np.sin(t - 0.4), 0.30 - rr * np.cos(t - 0.4) * 1.0))
    parts.append(swept(scroll, 0.012, 6))
    parts.append(swept([(0, 3.42, 0.035), (0, 3.50, 0.10), (0, 3.58, 0.155)], 0.012, 6))
    parts.append(swept([(0, 3.76, 0.37), (0, 3.90, 0.40), (0, 4.01, 0.42)], 0.010, 6))
    parts.append(turned([(0.045, 3.33), (0.050, 3.35), (0.043, 3.37)], 12).move(0, 0, 0))
    # ladder bar
    parts.append(swept([(-0.30, 3.05, 0), (0.30, 3.05, 0)], 0.014, 8))
    for x in (-0.30, 0.30):
        parts.append(turned([(0.0, -0.024), (0.017, -0.016), (0.024, 0), (0.017, 0.016), (0.0, 0.024)], 10,
                            70).move(x, 3.05, 0))
    o, i = bell(0.27)
    at = (0, 3.74, 0.84)
    parts.append(o.move(*at))
    # door of the plinth
    parts.append(box(0.13, 0.26, 0.02, 0.006, 2.0).move(0, 0.29, -0.165))
    mesh = g.mesh('lamp_post', [(merge(parts), mi), (i.move(*at), me), (bulb(0.085).move(*at), mg)])
    root = g.node('lamp_post', mesh)
    g.node('lamp', None, (0, 3.56, 0.84), aim((0, -1, 0)), root)
    g.save(os.path.join(OUT, 'lamp_post.glb'))


def wall_lamp():
    g = Glb()
    mi = iron(g, '3a2f2a', 620)
    me, mg = enamel(g), lamp_glass(g)
    plate = turned([(0.0, 0.0), (0.075, 0.0), (0.075, 0.012), (0.065, 0.020), (0.030, 0.030), (0.022, 0.045)][0:], 20,
                   35).rot('x', 90)
    arm = spline([(0, 0, 0.03), (0, 0.05, 0.12), (0, 0.17, 0.22), (0, 0.22, 0.34), (0, 0.17, 0.43), (0, 0.07, 0.45)],
                 22)
    parts = [plate, swept(arm, 0.014, 10)]
    for k in range(3):
        a = np.radians(90 + 120 * k)
        parts.append(turned([(0.0, 0.0), (0.010, 0.0), (0.008, 0.007), (0.0, 0.009)], 8,
                            40).rot('x', 90).move(0.052 * np.cos(a), 0.052 * np.sin(a), 0.016))
    o, i = bell(0.20)
    at = (0, 0.04, 0.45)
    parts.append(o.move(*at))
    mesh = g.mesh('wall_lamp', [(merge(parts), mi), (i.move(*at), me), (bulb(0.062).move(*at), mg)])
    root = g.node('wall_lamp', mesh)
    g.node('lamp', None, (0, -0.09, 0.45), aim((0, -1, 0)), root)
    g.save(os.path.join(OUT, 'wall_lamp.glb'))


# -------------------------------------------------------------------- props

def painted(g, n, color, seed, name, size_m=1.0, drips=None, kind_n='jpg', worn=1.0, rows=None):
    """A worn paint set with optional extra height (metres) and rust seeds, n x n."""
    mid, hi, lo = tx.noise(n, seed, 1.1, 5, 70), tx.noise(n, seed + 1, 0.6, 40, 200), tx.noise(n, seed + 2, 1.7, 1, 8)
    streak = tx.uniform_noise(n, seed + 6, beta=1.1, lo=3, hi=120, ax=1.8, ay=0.15)
    d = np.zeros((n, n)) if drips is None else drips
    run = sum(np.roll(d, k, 0) * np.exp(-k / (n * 0.05)) for k in range(0, n // 5, 3)) / 8
    rust = smooth(1.15, 1.6, (0.55 * d + 0.75 * run) + 0.55 * worn * tx.noise(n, seed + 3, 1.1, 3, 120) + 0.25 * hi)
    base = rgb(color) * (1 + 0.06 * lo + 0.03 * mid)[..., None]
    base = mix(base, np.clip(rgb(color) * 1.25 + 0.08, 0, 1), 0.4 * streak * smooth(-0.5, 1.0, lo))
    base = mix(base, rgb('33302b'), 0.35 * (1 - streak) * smooth(0.0, 1.5, mid + lo))
    ru = mix(rgb('8a4c28'), rgb('4d2c1d'), tx.uniform_noise(n, seed + 4, beta=0.9, lo=6, hi=140))
    base = mix(base, rgb('6b442e'), np.clip(tx.blur(rust, n / 100) + 0.6 * run * streak, 0, 1) * 0.55)
    base = mix(base, ru, rust)
    chip = smooth(1.9, 2.1, tx.noise(n, seed + 5, 1.0, 6, 130) + 0.3 * hi + 0.4 * d) * (1 - rust)
    base = mix(base, rgb('a9a8a3'), chip)
    h = 0.0012 * (0.12 * mid + 0.05 * hi - 0.4 * chip + rust * (0.3 + 0.3 * hi))
    rough = (0.42 + 0.05 * mid + 0.10 * (1 - streak)) * (1 - rust) + 0.92 * rust
    return base, h, np.clip(rough, 0, 1), np.clip(chip, 0, 1)


def embed(g, name, base, h, rough, met, size_m, q=88, kind_n='jpg', **mat):
    tb = g.image(tx.to8(np.clip(base, 0, 1)), 'jpg', q, name + '_base')
    tn = g.image(tx.encode_normal(tx.normal_from_height(h, size_m, 1.0)), kind_n, 92, name + '_normal')
    to = g.image(tx.to8(np.stack([np.ones_like(h), rough, met], -1)), 'jpg', 86, name + '_roughness_metallic')
    return g.material(name, tb, tn, to, **mat)


def barrel():
    """A 200-litre drum."""
    g = Glb()
    n = 512
    u, v = tx.coords(n)
    # the lower 60 % of the image is the wall, above it the two lids
    hoop = sum(smooth(0.020, 0.0, np.abs(v - c)) for c in (0.41, 0.60, 0.80, 0.985))
    base, h, rough, met = painted(g, n, '2f5d86', 630, 'drum', drips=np.clip(hoop, 0, 1) * 0.9)
    wall = v > 0.40
    # a stencilled band
    band = smooth(0.004, 0.0, np.abs(v - 0.70) - 0.035) * wall
    base = mix(base, mix(rgb('d8cfb8'), base, 0.25), band * 0.8 * smooth(-1.6, 0.2, tx.noise(n, 640, 1.0, 8, 120)))
    # lids: discs at (0.2, 0.2) and (0.6, 0.2)
    for cx in (0.20, 0.60):
        r = np.hypot(u - cx, v - 0.20)
        h = h + np.where(wall, 0, 0.004 * smooth(0.008, 0.0, np.abs(r - 0.165))
                         + 0.003 * smooth(0.006, 0.0, np.abs(r - 0.12)))
    for (bx, by, br) in ((0.20, 0.085, 0.026), (0.20, 0.30, 0.016)):
        r = np.hypot(u - bx, v - by)
        h = h + 0.008 * smooth(br, br - 0.008, r) - 0.005 * smooth(br * 0.55, br * 0.4, r)
        base = mix(base, rgb('8a8984'), smooth(br, br - 0.003, r))
    seam = smooth(0.004, 0.001, np.abs(u - 0.5)) * wall
    h = h + 0.002 * seam
    m = embed(g, 'drum', base, h, rough, met, (1.83, 1.47), 86)
    R, H = 0.286, 0.88
    prof = [(R - 0.010, 0.004), (R + 0.006, 0.0), (R + 0.010, 0.010), (R + 0.004, 0.022), (R, 0.030)]
    for c in (0.30, 0.58):
        prof += [(R, c - 0.030), (R + 0.007, c - 0.016), (R + 0.013, c), (R + 0.007, c + 0.016), (R, c + 0.030)]
    prof += [(R, H - 0.030), (R + 0.004, H - 0.022), (R + 0.010, H - 0.010), (R + 0.006, H), (R - 0.010, H - 0.002),
             (R - 0.012, H - 0.022)]
    wallp = lathe(prof, 32, 42)
    wallp.UV[:, 1] = 0.995 - (wallp.P[:, 1] / H) * 0.59
    top = lathe([(R - 0.012, H - 0.022), (0.18, H - 0.020), (0.0, H - 0.020)], 32, 42)
    top.UV = np.stack([0.20 + top.P[:, 0] / R * 0.185, 0.20 + top.P[:, 2] / R * 0.185], 1)
    bot = lathe([(0.0, 0.004), (R - 0.010, 0.004)], 32, 42)
    bot.UV = np.stack([0.60 + bot.P[:, 0] / R * 0.185, 0.20 + bot.P[:, 2] / R * 0.185], 1)
    bung = lathe([(0.038, H - 0.021), (0.036, H - 0.006), (0.028, H - 0.005), (0.0, H - 0.005)], 12,
                 40).move(0, 0, -0.178)
    bung.UV = np.stack([0.20 + bung.P[:, 0] / R * 0.185, 0.20 + bung.P[:, 2] / R * 0.185], 1)
    g.node('barrel', g.mesh('barrel', [(merge(wallp, top, bot, bung), m)]))
    g.save(os.path.join(OUT, 'barrel.glb'))


def planks_material(g, size=512):
    base = load('planks_base.jpg', size)
    tb = g.image(base, 'jpg', 80, 'planks_base')
    tn = g.image(load_normal('planks', size), 'jpg', 85, 'planks_normal')
    return g.material('planks', tb, tn, None, metallic=0, roughness=0.8)


def board(length, width, thick, k, axis):
    """One board along `axis`; its faces take plank number k of the texture."""
    b = box(width, length, thick, 0.004, 1.0)
    r = tx.rng(650 + k)
    off = r.random()
    b = b.uvmap(lambda P, UV: np.stack([(k % 5 + 0.5) / 5 + np.clip(UV[:, 0], -0.075, 0.075) / 0.8,
                                        UV[:, 1] / 0.8 + off], 1))
    if axis == 'x':
        b = b.rot('z', 90)
    elif axis == 'z':
        b = b.rot('x', 90)
    return b


def crate():
    """A slatted wooden crate, 0.8 m."""
    g = Glb()
    m = planks_material(g, 256)
    S, t = 0.80, 0.022
    parts, k = [], 0
    w = (S - 2 * t) / 5 - 0.006
    for side in range(6):
        face = []
        for i in range(5):
            c = (i - 2) * (S - 2 * t) / 5
            face.append(board(S - 2.2 * t, w, t, k, 'y').move(c, 0, S / 2 - 1.5 * t)); k += 1
        # the frame lies on the slats; two opposite sides cover the corners, the
        # others fit between them, so that no two faces share a plane
        span = S if side in (0, 2) else S - 2 * t
        tall = S if side < 4 else S - 2 * t
        for y in (-1, 1):
            face.append(board(span, 0.085, t, k, 'x').move(0, y * (tall / 2 - 0.0425), S / 2 - t / 2)); k += 1
        for x in (-1, 1):
            face.append(board(tall - 0.17, 0.085, t, k, 'y').move(x * (span / 2 - 0.0425), 0, S / 2 - t / 2)); k += 1
        if side < 4:
            face.append(board(0.84, 0.085, t * 0.86, k, 'y')
                        .rot('z', 45 if side % 2 else -45).move(0, 0, S / 2 - t * 0.58))
            k += 1
        f = merge(face)
        parts.append(f.rot('y', 90 * side) if side < 4 else f.rot('x', 90 if side == 4 else -90))
    p = merge(parts).move(0, S / 2, 0)
    g.node('crate', g.mesh('crate', [(p, m)]))
    g.save(os.path.join(OUT, 'crate.glb'))


def container():
    """A 20-foot shipping container; doors toward +Z."""
    g = Glb()
    n = 512
    u, v = tx.coords(n)
    drips = np.clip(smooth(0.03, 0.0, v) + smooth(0.97, 1.0, v), 0, 1) * 0.8
    base, h, rough, met = painted(g, n, '8d3b2c', 660, 'container', drips=drips)
    m = embed(g, 'container', base, h, rough, met, 2.6, 86)
    md = g.material('container_steel', color=(0.32, 0.31, 0.30, 1), metallic=0.8, roughness=0.5)
    W, H, D = 2.44, 2.59, 6.06
    uvs = 1 / 2.6
    parts, steel = [], []
    def corr(length, height, pitch, depth):
        """Trapezoid sheet in the XY plane, facing +Z, lower left at the origin."""
        k = max(1, round(length / pitch))
        p = length / k
        xs, zs = [], []
        for i in range(k):
            for f, z in ((0.0, 0), (0.28, 0), (0.46, -depth), (0.82, -depth)):
                xs.append((i + f) * p); zs.append(z)
        xs.append(length); zs.append(0)
        P, UV, F = [], [], []
        run = np.concatenate([[0], np.cumsum(np.hypot(np.diff(xs), np.diff(zs)))])
        for x, z, s in zip(xs, zs, run):
            P += [(x, 0, z), (x, height, z)]
            UV += [(s * uvs, 1.0), (s * uvs, 1.0 - height * uvs)]
        for i in range(len(xs) - 1):
            a = 2 * i
            F += [(a, a + 2, a + 3), (a, a + 3, a + 1)]
        return creased(P, UV, F, 20)
    side = corr(D - 0.30, H - 0.32, 0.275, 0.036).move(-(D - 0.30) / 2, 0.17, 0)
    parts.append(side.rot('y', 90).move(W / 2 - 0.025, 0, 0))
    parts.append(side.rot('y', -90).move(-W / 2 + 0.025, 0, 0))
    parts.append(corr(W - 0.30, H - 0.32, 0.25, 0.036)
                 .move(-(W - 0.30) / 2, 0.17, 0).rot('y', 180).move(0, 0, -D / 2 + 0.03))
    roof = (corr(D - 0.2, W - 0.2, 0.21, 0.018).move(-(D - 0.2) / 2, -(W - 0.2) / 2, 0)
            .rot('x', -90).rot('y', 90).move(0, H - 0.03, 0))
    parts.append(roof)
    bx = lambda sx, sy, sz, x, y, z, b=0.012: parts.append(box(sx, sy, sz, b, uvs).move(x, y, z))
    for sx in (-1, 1):
        for sz in (-1, 1):
            bx(0.16, H, 0.16, sx * (W / 2 - 0.08), H / 2, sz * (D / 2 - 0.08))
            for yy in (0.06, H - 0.06):
                steel.append(box(0.178, 0.122, 0.178, 0.010).move(sx * (W / 2 - 0.083), yy, sz * (D / 2 - 0.083)))
        bx(0.10, 0.17, D - 0.3, sx * (W / 2 - 0.05), 0.095, 0)
        bx(0.08, 0.09, D - 0.3, sx * (W / 2 - 0.04), H - 0.05, 0)
    for sz in (-1, 1):
        bx(W - 0.3, 0.16, 0.12, 0, 0.09, sz * (D / 2 - 0.06))
        bx(W - 0.3, 0.11, 0.12, 0, H - 0.06, sz * (D / 2 - 0.06))
    # doors: two panels with pressed fields, bars, handles, hinges
    for sx in (-1, 1):
        w = (W - 0.34) / 2
        cx = sx * (w / 2 + 0.005)
        bx(w - 0.01, H - 0.30, 0.05, cx, H / 2, D / 2 - 0.055, 0.015)
        for k in range(5):
            bx(w - 0.12, 0.30, 0.03, cx, 0.40 + k * 0.445, D / 2 - 0.030, 0.014)
        for bxx in (0.24, 0.80):
            x = sx * bxx
            steel.append(tube([(x, 0.10, D / 2 + 0.012), (x, H - 0.10, D / 2 + 0.012)], 0.017, 8))
            for yy in (0.22, 0.95, 1.65, H - 0.22):
                steel.append(box(0.09, 0.05, 0.05, 0.01).move(x, yy, D / 2 - 0.002))
            steel.append(box(0.34, 0.030, 0.018, 0.006).move(x + sx * 0.13, 1.12 if bxx < 0.5 else 1.05, D / 2 + 0.040))
        for yy in (0.35, 0.95, 1.6, 2.25):
            steel.append(box(0.10, 0.10, 0.05, 0.012).move(sx * (W / 2 - 0.16), yy, D / 2 - 0.012))
    root = g.node('container')
    g.piece_nodes('part', [(merge(parts), m), (merge(steel), md)], {0: (0.0,), 2: (-1.0, 1.0)}, root)
    g.save(os.path.join(OUT, 'container.glb'))


def gate():
    """A double-leaf steel gate, 4 m between its posts, facing +Z."""
    g = Glb()
    m = iron(g, '2e3b45', 670, chips=0.6)
    s = 1.0
    leaf = []
    Wl, Hh = 1.94, 2.30
    for x in (0.03, Wl - 0.03):
        leaf.append(box(0.06, Hh, 0.05, 0.008, s).move(x, Hh / 2 + 0.08, 0))
    for y in (0.11, 0.95, Hh + 0.03):
        leaf.append(box(Wl - 0.10, 0.06, 0.045, 0.008, s).move(Wl / 2, y, 0))
    sheet = box(Wl - 0.10, 0.80, 0.008, 0.002, s).move(Wl / 2, 0.53, 0)
    leaf.append(sheet)
    leaf.append(box(0.055, 1.10, 0.024, 0.006, s).rot('z', 52).move(Wl / 2 - 0.45, 0.53, 0.012))
    leaf.append(box(0.055, 1.10, 0.024, 0.006, s).rot('z', -52).move(Wl / 2 + 0.45, 0.53, 0.012))
    nb = 13
    for k in range(1, nb):
        x = 0.03 + k * (Wl - 0.06) / nb
        top = Hh + 0.22
        leaf.append(tube([(x, 0.96, 0), (x, top - 0.09, 0)], 0.011, 6, caps=False).uvmap(lambda P, UV: UV * (1, 3)))
        leaf.append(lathe([(0.011, top - 0.10), (0.022, top - 0.085), (0.020, top - 0.06), (0.0, top)], 6, 40))
    for k in range(1, nb, 2):
        x = 0.03 + (k + 0.5) * (Wl - 0.06) / nb
        leaf.append(torus(0.052, 0.008, 14, 5).rot('x', 90).move(x, 2.16, 0))
    leaf = merge(leaf)
    leaf_l = leaf.move(-Wl - 0.02, 0, 0)
    leaf_r = mirror_x(leaf).move(Wl + 0.02, 0, 0)
    lock = [box(0.10, 0.20, 0.075, 0.012, s).move(-0.06, 1.15, 0.0),
            swept([(-0.06, 1.15, 0.03), (-0.06, 1.15, 0.085), (-0.15, 1.15, 0.09)], 0.010, 8)]
    posts = []
    for sx in (-1, 1):
        posts.append(box(0.14, 2.75, 0.14, 0.015, s).move(sx * 2.08, 1.375, 0))
        posts.append(lathe([(0.10, 2.74), (0.105, 2.78), (0.07, 2.80), (0.055, 2.83), (0.085, 2.88), (0.085, 2.93),
                            (0.05, 2.98), (0.0, 2.99)], 16, 50).uvmap(lambda P, UV: UV * 2).move(sx * 2.08, 0, 0))
        for y in (0.35, 1.2, 2.15):
            posts.append(turned([(0.0, -0.06), (0.026, -0.06), (0.026, 0.06), (0.0, 0.06)],
                                10).move(sx * 1.985, y, 0.0))
    g.node('gate', g.mesh('gate', [(merge(leaf_l, leaf_r, lock, posts), m)]))
    g.save(os.path.join(OUT, 'gate.glb'))


def elbowed(points, r, bend, seg=12):
    """A pipe along a polyline with round elbows."""
    pts = [np.asarray(p, float) for p in points]
    path = [pts[0]]
    for a, b, c in zip(pts, pts[1:], pts[2:]):
        u, v = (a - b) / np.linalg.norm(a - b), (c - b) / np.linalg.norm(c - b)
        s, e = b + u * bend, b + v * bend
        ctr = b + (u + v) * bend
        for t in np.linspace(0, np.pi / 2, 6):
            path.append(ctr - v * bend * np.cos(t) - u * bend * np.sin(t))
    path.append(pts[-1])
    return swept(path, r, seg)


def pipes():
    """A run of wall pipes with flanges, brackets and a valve; the wall is z = 0."""
    g = Glb()
    m1 = iron(g, '6a6f70', 680, name='pipe')
    m2 = g.material('valve', color=(0.55, 0.07, 0.05, 1), metallic=0, roughness=0.45)
    A, B = [], []
    def flange(p, axis, r):
        f = turned([(0.0, -0.022), (r, -0.022), (r, -0.003), (r * 0.97, 0.0), (r, 0.003), (r, 0.022), (0.0, 0.022)], 18,
                   30)
        for k in range(6):
            a = np.radians(60 * k)
            f = merge(f, turned([(0.0, -0.034), (0.011, -0.034), (0.011, 0.034), (0.0, 0.034)], 6,
                                30).move(r * 0.82 * np.cos(a), 0, r * 0.82 * np.sin(a)))
        if axis == 'x':
            f = f.rot('z', 90)
        elif axis == 'z':
            f = f.rot('x', 90)
        A.append(f.move(*p))
    z = 0.16
    A.append(elbowed([(-1.2, 0.0, z), (-1.2, 2.45, z), (1.15, 2.45, z), (1.15, 2.45, -0.05)], 0.072, 0.16, 14))
    A.append(elbowed([(-0.86, 0.0, z), (-0.86, 1.30, z), (0.55, 1.30, z), (0.55, 3.0, z)], 0.045, 0.11))
    A.append(elbowed([(-1.45, 0.0, z * 0.6), (-1.45, 3.0, z * 0.6)], 0.026, 0.05, 8))
    for p, ax, r in (((-1.2, 0.35, z), 'y', 0.125), ((-1.2, 1.72, z), 'y', 0.125), ((-0.45, 2.45, z), 'x', 0.125),
                     ((0.75, 2.45, z), 'x', 0.125),
                     ((-0.86, 0.35, z), 'y', 0.085), ((0.25, 1.30, z), 'x', 0.085), ((0.55, 2.05, z), 'y', 0.085)):
        flange(p, ax, r)
    A.append(turned([(0.12, -0.01), (0.12, 0.0), (0.085, 0.012), (0.0, 0.012)], 20).rot('x', 90).move(1.15, 2.45, 0.0))
    # valve on the small pipe
    A.append(turned([(0.0, -0.09), (0.055, -0.085), (0.078, -0.04), (0.082, 0.0), (0.078, 0.04), (0.055, 0.085),
                     (0.0, 0.09)], 16, 60).rot('z', 90).move(-0.30, 1.30, z))
    A.append(turned([(0.030, 0.05), (0.030, 0.14), (0.045, 0.15), (0.045, 0.175), (0.014, 0.18), (0.014, 0.26),
                     (0.0, 0.262)], 12).rot('x', 90).move(-0.30, 1.30, z))
    w = torus(0.105, 0.013, 22, 8)
    for k in range(5):
        a = np.radians(72 * k)
        w = merge(w, tube([(0, 0, 0), (0.1 * np.cos(a), 0, 0.1 * np.sin(a))], 0.009, 6, caps=False))
    w = merge(w, lathe([(0.0, -0.016), (0.024, -0.016), (0.024, 0.014), (0.0, 0.02)], 10, 40))
    B.append(w.rot('x', 90).move(-0.30, 1.30, z + 0.235))
    # brackets
    for y in (0.75, 1.95):
        A.append(box(0.92 if y < 1.3 else 0.62, 0.045, 0.045, 0.006, 2.0).move(-1.17 if y < 1.3 else -1.30, y, 0.05))
    for x in (-0.85, 0.30):
        A.append(box(0.05, 0.05, 0.12, 0.006, 2.0).move(x, 2.36, 0.06))
        A.append(box(0.07, 0.02, 0.16, 0.004, 2.0).move(x, 2.375, z - 0.02))
    for x in (0.10,):
        A.append(box(0.05, 0.05, 0.14, 0.006, 2.0).move(x, 1.235, 0.07))
    g.node('pipes', g.mesh('pipes', [(merge(A), m1), (merge(B), m2)]))
    g.save(os.path.join(OUT, 'pipes.glb'))


# ------------------------------------------------------------------ facade

def window_images(n=128):
    """A lit room seen through old glass: one image, emissive."""
    u, v = tx.coords(n)
    lamp = np.exp(-(((u - 0.5) / 0.35) ** 2 + ((v - 0.25) / 0.4) ** 2))
    curtain = (smooth(0.30, 0.22, np.minimum(u, 1 - u) * (1 + 0.5 * v))
               * (0.75 + 0.25 * np.sin(u * 70 + 2 * np.sin(v * 5))))
    col = mix(rgb('8a4f22'), rgb('ffd490'), lamp)
    col = mix(col, rgb('7a3a24') * (0.5 + 0.7 * lamp)[..., None], np.clip(curtain, 0, 1) * 0.75)
    pot = np.clip(smooth(0.10, 0.08, np.abs(u - 0.62)) * smooth(0.80, 0.83, v)
                  + smooth(0.115, 0.10, np.hypot(u - 0.62, (v - 0.70) * 0.8)), 0, 1)
    col = mix(col, rgb('2a1710'), pot * 0.85)
    return np.clip(col * (1 + 0.03 * tx.noise(n, 690, 1.2, 2, 30))[..., None], 0, 1)


def facade():
    """A two-storey brick front, 12 m wide, facing +Z, wall plane z = 0."""
    g = Glb()
    nb = load_normal('brick', 512)
    tb = g.image(load('brick_base.jpg', 512), 'jpg', 85, 'brick_base')
    tn = g.image(nb, 'jpg', 86, 'brick_normal')
    m_brick = g.material('brick', tb, tn, None, metallic=0, roughness=0.80, normal_scale=1.6)
    cb = g.image(load('concrete_base.jpg', 256), 'jpg', 82, 'concrete_base')
    cn = g.image(load_normal('concrete', 256), 'jpg', 86, 'concrete_normal')
    m_con = g.material('concrete', cb, cn, None, metallic=0, roughness=0.85)
    # shutter: slats 75 mm
    n = 256
    u, v = tx.coords(n)
    ph = (v * 8) % 1.0
    prof = np.sqrt(np.clip(1 - ((ph - 0.5) / 0.46) ** 2, 0, 1))
    base, h, rough, met = painted(g, n, '5b6b58', 700, 'shutter', drips=smooth(0.12, 0.0, np.abs(ph - 0.02)) * 0.5,
                                  worn=1.0)
    base = base * (0.55 + 0.45 * prof)[..., None]
    m_sh = embed(g, 'shutter', base, h + prof * 0.016, rough, met, 0.6, 86)
    m_wood = g.material('door_paint', color=(0.17, 0.055, 0.045, 1), metallic=0, roughness=0.45)
    m_frame = g.material('frame', color=(0.62, 0.60, 0.54, 1), metallic=0, roughness=0.5)
    lit = g.image(tx.to8(window_images()), 'jpg', 86, 'lit_window')
    m_lit = g.material('window_lit', lit, None, None, metallic=0, roughness=0.12, emissive=(1.0, 0.85, 0.6),
                       emissive_tex=lit)
    m_dark = g.material('window_dark', color=(0.020, 0.026, 0.034, 1), metallic=0, roughness=0.06)
    m_iron = iron(g, '23282a', 710, 128, name='ironwork')

    W, H = 12.0, 6.6
    # kind, x0, x1, y0, y1
    op = [('shutter', -4.70, -1.50, 0.0, 3.0), ('door', -0.15, 0.90, 0.15, 2.55), ('lit', 2.00, 3.40, 1.05, 2.55),
          ('dark', 4.15, 5.55, 1.05, 2.55)]
    for k, x in enumerate((-4.5, -1.9, 0.8, 3.4)):
        op.append((('dark', 'lit', 'dark', 'dark')[k], x - 0.55 + 0.0, x + 0.55, 3.90, 5.40))
    brick, con, frame, iron_p = [], [], [], []
    depth = 0.24
    s = 1 / 1.8
    xs = sorted({-W / 2, W / 2} | {o[1] for o in op} | {o[2] for o in op} | {-3.0, 0.0, 3.0})
    ys = sorted({0.0, H} | {o[3] for o in op} | {o[4] for o in op})
    P, UV, F = [], [], []
    idx = {}
    def vtx(x, y):
        if (x, y) not in idx:
            idx[(x, y)] = len(P)
            P.append((x, y, 0.0)); UV.append((x * s, -y * s))
        return idx[(x, y)]
    for i in range(len(xs) - 1):
        for j in range(len(ys) - 1):
            cx, cy = (xs[i] + xs[i + 1]) / 2, (ys[j] + ys[j + 1]) / 2
            if any(o[1] < cx < o[2] and o[3] < cy < o[4] for o in op):
                continue
            a, b, c, d = vtx(xs[i], ys[j]), vtx(xs[i + 1], ys[j]), vtx(xs[i + 1], ys[j + 1]), vtx(xs[i], ys[j + 1])
            F += [(a, b, c), (a, c, d)]
    brick.append(Part(P, np.tile([0, 0, 1.0], (len(P), 1)), UV, F))
    def quad(p, nrm, uv):
        q = Part(p, np.tile(nrm, (4, 1)).astype(float), uv, [(0, 1, 2), (0, 2, 3)])
        fn = np.cross(q.P[1] - q.P[0], q.P[2] - q.P[0])
        return q if fn @ np.asarray(nrm, float) > 0 else Part(q.P, q.N, q.UV, q.F[:, ::-1])
    for kind, x0, x1, y0, y1 in op:
        d = depth
        brick.append(quad([(x0, y0, 0), (x0, y0, -d), (x0, y1, -d), (x0, y1, 0)], (1, 0, 0),
                          [(0, -y0 * s), (d * s, -y0 * s), (d * s, -y1 * s), (0, -y1 * s)]))
        brick.append(quad([(x1, y0, -d), (x1, y0, 0), (x1, y1, 0), (x1, y1, -d)], (-1, 0, 0),
                          [(0, -y0 * s), (d * s, -y0 * s), (d * s, -y1 * s), (0, -y1 * s)]))
        brick.append(quad([(x0, y1, 0), (x0, y1, -d), (x1, y1, -d), (x1, y1, 0)], (0, -1, 0),
                          [(x0 * s, 0), (x0 * s, d * s), (x1 * s, d * s), (x1 * s, 0)]))
        w = x1 - x0
        cx = (x0 + x1) / 2
        # lintel
        con.append(box(w + 0.36, 0.24, 0.16, 0.015, 0.66).move(cx, y1 + 0.12, -0.045))
        if kind in ('lit', 'dark'):
            con.append(box(w + 0.24, 0.09, depth + 0.11, 0.015, 0.66).move(cx, y0 - 0.02, -depth / 2 + 0.045))
            hgt = y1 - y0
            z = -depth + 0.05
            fr = lambda sx, sy, x, y, t=0.06: frame.append(box(sx, sy, t, 0.008, 1.0).move(x, y, z))
            y00 = y0 + 0.025
            fr(w, 0.07, cx, y1 - 0.035); fr(w, 0.07, cx, y00 + 0.035)
            fr(0.07, hgt, x0 + 0.035, (y0 + y1) / 2); fr(0.07, hgt, x1 - 0.035, (y0 + y1) / 2)
            fr(0.055, hgt - 0.1, cx, (y0 + y1) / 2, 0.05)
            for f in (0.36, 0.68):
                fr(w - 0.1, 0.035, cx, y0 + hgt * f, 0.045)
            for sx in (-1, 1):
                fr(0.03, hgt - 0.1, cx + sx * w / 4, (y0 + y1) / 2, 0.04)
            pane = quad([(x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z)], (0, 0, 1),
                        [(0, 1), (1, 1), (1, 0), (0, 0)])
            (LIT if kind == 'lit' else DARK).append(pane)
        elif kind == 'shutter':
            z = -depth + 0.04
            SH.append(quad([(x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z)], (0, 0, 1),
                           [(x0 / 0.6, -y0 / 0.6), (x1 / 0.6, -y0 / 0.6), (x1 / 0.6, -y1 / 0.6),
                            (x0 / 0.6, -y1 / 0.6)]))
            for sx in (-1, 1):
                iron_p.append(box(0.09, y1 - y0, 0.10, 0.01, 2.0)
                              .move(cx + sx * (w / 2 - 0.045), (y0 + y1) / 2, z + 0.03))
            iron_p.append(box(w - 0.1, 0.10, 0.05, 0.01, 2.0).move(cx, 0.06, z + 0.025))
            iron_p.append(box(w, 0.30, 0.16, 0.02, 2.0).move(cx, y1 - 0.15, z + 0.07))
            iron_p.append(swept([(cx - 0.1, 0.30, z), (cx - 0.1, 0.30, z + 0.06), (cx + 0.1, 0.30, z + 0.06),
                                 (cx + 0.1, 0.30, z)], 0.010, 6))
            for sx in (-1, 1):        # guard stones
                con.append(lathe([(0.19, 0.0), (0.17, 0.25), (0.13, 0.42), (0.07, 0.50), (0.0, 0.52)], 12,
                                 50).move(cx + sx * (w / 2 + 0.12), 0, 0.10))
        elif kind == 'door':
            z = -depth + 0.05
            h = y1 - y0 - 0.42
            WOOD.append(box(w, h, 0.05, 0.006, 1.0).move(cx, y0 + h / 2, z))
            for fx in (-1, 1):
                for fy, fh in ((0.30, 0.40), (0.72, 0.36)):
                    WOOD.append(box(w * 0.33, h * fh, 0.035, 0.014, 1.0)
                                .move(cx + fx * w * 0.215, y0 + h * fy, z + 0.022))
            frame.append(box(w, 0.05, 0.09, 0.008, 1.0).move(cx, y0 + h + 0.02, z))
            LIT.append(quad([(x0, y0 + h, z), (x1, y0 + h, z), (x1, y1, z), (x0, y1, z)], (0, 0, 1),
                            [(0.1, 0.5), (0.9, 0.5), (0.9, 0.1), (0.1, 0.1)]))
            for sx in (-1, 1):
                frame.append(box(0.06, y1 - y0, 0.10, 0.008, 1.0).move(cx + sx * (w / 2 - 0.03), (y0 + y1) / 2, z))
            frame.append(box(w, 0.06, 0.10, 0.008, 1.0).move(cx, y1 - 0.03, z))
            for k in range(-1, 2):
                frame.append(box(0.025, 0.36, 0.04, 0.005, 1.0).move(cx + k * w / 4, y1 - 0.2, z))
            iron_p.append(lathe([(0.0, 0.0), (0.030, 0.0), (0.030, 0.010), (0.012, 0.020), (0.012, 0.04),
                                 (0.028, 0.055), (0.028, 0.07), (0.0, 0.08)], 12,
                                40).rot('x', 90).move(cx + w * 0.40, y0 + 1.02, z + 0.025))
            con.append(box(w + 0.5, 0.15, 0.75, 0.02, 0.66).move(cx, 0.075, 0.13))
    # plinth between the openings, string course, cornice, coping
    segs = [(-6.0, -4.70), (-1.50, -0.15), (0.90, 6.0)]
    for a, b in segs:
        con.append(box(b - a, 0.45, 0.10, 0.015, 0.66).move((a + b) / 2, 0.225, 0.02))
    con.append(box(W, 0.16, 0.14, 0.02, 0.66).move(0, 3.48, 0.0))
    con.append(box(W + 0.10, 0.14, 0.24, 0.03, 0.66).move(0, H - 0.62, 0.0))
    con.append(box(W + 0.16, 0.12, 0.50, 0.03, 0.66).move(0, H + 0.06, -0.12))
    # returns and back, so that the piece is a solid wall 0.36 m thick
    t = 0.36
    for sx in (-1, 1):
        x = sx * W / 2
        brick.append(quad([(x, 0, 0), (x, 0, -t), (x, H, -t), (x, H, 0)], (sx, 0, 0),
                          [(0, 0), (t * s, 0), (t * s, -H * s), (0, -H * s)]))
    brick.append(quad([(-W / 2, 0, -t), (W / 2, 0, -t), (W / 2, H, -t), (-W / 2, H, -t)], (0, 0, -1),
                      [(W * s, 0), (0, 0), (0, -H * s), (W * s, -H * s)]))
    # dentils of brick under the cornice
    for k in range(27):
        brick.append(box(0.215, 0.15, 0.10, 0.0, s).move(-5.85 + k * 0.45, H - 0.765, 0.05))
    # gutter pipe with hopper and brackets
    x = 5.80
    iron_p.append(swept([(x, 0.30, 0.10), (x, H - 0.95, 0.10)], 0.05, 12))
    iron_p.append(swept([(x, 0.32, 0.10), (x, 0.20, 0.12), (x, 0.10, 0.22)], 0.05, 12))
    iron_p.append(box(0.26, 0.24, 0.20, 0.03, 2.0).move(x, H - 0.92, 0.12))
    for y in (0.8, 2.4, 4.2):
        iron_p.append(box(0.15, 0.05, 0.13, 0.01, 2.0).move(x, y, 0.075))
    # a sign board bracket and wall anchors
    for xx in (-5.3, -3.1, -0.5, 2.1, 4.9):
        iron_p.append(box(0.045, 0.40, 0.022, 0.008, 2.0).rot('z', 35).move(xx, 3.72, 0.012))
        iron_p.append(box(0.045, 0.40, 0.022, 0.008, 2.0).rot('z', -35).move(xx, 3.72, 0.016))
    prims = [(merge(brick), m_brick), (merge(con), m_con), (merge(frame), m_frame), (merge(SH), m_sh),
             (merge(WOOD), m_wood), (merge(iron_p), m_iron), (merge(LIT), m_lit), (merge(DARK), m_dark)]
    root = g.node('facade')
    g.piece_nodes('front', prims, {0: (-4.0, -2.0, 0.0, 2.0, 4.0), 1: (1.7, 3.45, 5.0)}, root)
    g.node('lamp_window_ground', None, (2.7, 1.9, 0.35), aim((0, -0.35, 1)), root)
    g.node('mount_shutter', None, (-3.1, 3.42, 0.08), None, root)
    g.node('mount_door', None, (1.35, 2.75, 0.0), None, root)
    for l in (LIT, DARK, SH, WOOD):
        l.clear()
    g.save(os.path.join(OUT, 'facade.glb'))


LIT, DARK, SH, WOOD = [], [], [], []

ALL = dict(kettle=kettle, lamp_post=lamp_post, wall_lamp=wall_lamp, barrel=barrel, crate=crate,
           container=container, gate=gate, pipes=pipes, facade=facade)


def main(names=None):
    os.makedirs(OUT, exist_ok=True)
    for n in names or ALL:
        ALL[n]()
        print('model', n)


if __name__ == '__main__':
    main(sys.argv[1:])
