"""Tileable texture sets of the demo scene (base, normal, specular, height)."""

import json
import os
import sys
import numpy as np
from texlib import *
from town_tiles import asphalt, paving, tiles


def halved(a):
    """Every 2 × 2 pixels as one."""
    return a.reshape(a.shape[0] // 2, 2, a.shape[1] // 2, 2, *a.shape[2:]).mean((1, 3))


def brick():
    n, size, depth = 1024, 1.8, 0.014
    rows, cols = 24, 8
    u, v = coords(n)
    # wobble of the laying and of each edge
    wx = noise(n, 1, 1.6, 2, 12) * 0.0010 + noise(n, 2, 1.0, 20, 120) * 0.0009
    wy = noise(n, 3, 1.6, 2, 12) * 0.0010 + noise(n, 4, 1.0, 20, 120) * 0.0009
    uu, vv = (u + wx) % 1.0, (v + wy) % 1.0
    y = vv * rows
    row = np.floor(y).astype(int) % rows
    x = uu * cols + 0.5 * (row % 2) + (hash01(row, 0, 5) - 0.5) * 0.10
    col = np.floor(x).astype(int) % cols
    fx, fy = x - np.floor(x) - 0.5, y - np.floor(y) - 0.5
    bw, bh = size / cols, size / rows
    r = lambda s: hash01(col, row, s)
    # brick half sizes in metres with a joint of about 10 mm, a little different each
    hx = bw / 2 - 0.0050 - 0.0014 * r(11)
    hy = bh / 2 - 0.0050 - 0.0012 * r(12)
    ang = (r(13) - 0.5) * 0.022
    px = fx * bw + (r(14) - 0.5) * 0.0015
    py = fy * bh + (r(15) - 0.5) * 0.0015
    qx, qy = px * np.cos(ang) - py * np.sin(ang), px * np.sin(ang) + py * np.cos(ang)
    rad = 0.006
    ex, ey = np.abs(qx) - hx + rad, np.abs(qy) - hy + rad
    sdf = np.hypot(np.maximum(ex, 0), np.maximum(ey, 0)) + np.minimum(np.maximum(ex, ey), 0) - rad
    # chipped edges: a thresholded noise eats into the outline
    chip = np.maximum(noise(n, 20, 1.2, 10, 90) - 0.75, 0) * 0.0036
    chip += np.maximum(noise(n, 21, 0.8, 40, 200) - 1.1, 0) * 0.0016
    sdf = sdf + chip
    face = smooth(0.0008, -0.0042, sdf)
    # face relief: drag marks, pits, a slight dishing and tilt
    fine = noise(n, 22, 0.8, 50, 220)
    mid = noise(n, 23, 1.1, 14, 90)
    drag = noise(n, 24, 0.8, 30, 200, ax=0.25, ay=1.2)
    pits = smooth(1.3, 2.4, noise(n, 25, 0.5, 50, 150))
    tilt = (r(16) - 0.5) * 2 * qx / bw + (r(17) - 0.5) * 1.2 * qy / bh
    hb = 0.88 + 0.10 * (r(18) - 0.5) + 0.05 * tilt + 0.016 * mid + 0.011 * fine + 0.010 * drag - 0.14 * pits
    sand = noise(n, 26, 0.5, 70, 230)
    trowel = noise(n, 27, 1.3, 6, 60)
    hm = 0.25 + 0.035 * trowel + 0.022 * sand - 0.10 * smooth(0.004, 0.0, np.abs(sdf - 0.0015) * 1.0)
    h = hm * (1 - face) + hb * face

    # colour: a palette by brick, clouds inside each brick, burnt ends, lime bloom
    pal = np.array([rgb(c) for c in ('96503c', 'a35a41', '8a4535', '7d3f35', 'ab6a49', '6d3a35', 'b07a58', '8f5546',
                                     '5c3936')])
    weights = np.cumsum([.20, .18, .17, .12, .11, .08, .05, .06, .03])
    pick = np.searchsorted(weights, np.clip(r(30), 0, 0.9999))
    colr = pal[pick]
    colr = colr * (0.90 + 0.22 * r(31))[..., None]
    cloud = noise(n, 32, 1.3, 5, 60)
    colr = colr * (1 + 0.075 * cloud)[..., None]
    burnt = smooth(0.55, 1.6, noise(n, 33, 1.2, 6, 40) + (r(34) - 0.5) * 2.2)
    colr = mix(colr, colr * np.array([0.60, 0.58, 0.64]), burnt * 0.75)
    speck = smooth(1.3, 2.2, noise(n, 35, 0.3, 90, 260))
    colr = mix(colr, rgb('c79a77'), speck * 0.35)
    dark = smooth(1.4, 2.4, noise(n, 36, 0.3, 80, 260))
    colr = mix(colr, rgb('3a2a28'), dark * 0.5)
    colr = colr * (1 + 0.06 * fine)[..., None]
    mort = mix(rgb('9b9184'), rgb('7c7266'), uniform_noise(n, 37, beta=1.2, lo=3, hi=80))
    mort = mort * (1 + 0.09 * sand)[..., None]
    edge_dust = smooth(-0.009, 0.0, sdf) * uniform_noise(n, 38, beta=0.9, lo=8, hi=150)
    colr = mix(colr, rgb('a3968a'), edge_dust * 0.40)
    base = mix(mort, colr, face)
    bloom = smooth(0.7, 2.1, noise(n, 39, 1.5, 2, 30)) * uniform_noise(n, 40, beta=0.6, lo=20, hi=250)
    base = mix(base, rgb('bdb2a6'), bloom * 0.38)
    soot = smooth(0.2, 2.2, noise(n, 41, 1.8, 1, 14))
    base = base * (1 - 0.28 * soot)[..., None]
    base = base * cavity(h, 7, 0.55)
    spec = 0.05 + face * (0.07 + 0.05 * burnt + 0.02 * fine + 0.05 * r(42)) - 0.05 * pits
    # drawn at twice the size it is kept at: chipped edges stay crisp
    return halved(base), halved(spec), halved(h), size, depth


def cobble():
    n, size, depth = 512, 1.44, 0.032
    rows = 13
    u, v = coords(n)
    wx = noise(n, 101, 1.8, 1, 8) * 0.0045 + noise(n, 102, 1.0, 14, 70) * 0.0008
    wy = noise(n, 103, 1.8, 1, 8) * 0.0060 + noise(n, 104, 1.0, 20, 90) * 0.0008
    y = ((v + wy) % 1.0) * rows
    row = np.floor(y).astype(int) % rows
    fy = y - np.floor(y)
    xx = (u + wx) % 1.0
    # each course has its own stones of unequal length
    left = np.zeros((n, n)); right = np.ones((n, n)); ident = np.zeros((n, n), int)
    g = rng(105)
    for k in range(rows):
        count = int(g.integers(9, 12))
        w = 0.75 + 0.6 * g.random(count)
        edge = np.concatenate([[0], np.cumsum(w / w.sum())])
        off = g.random()
        m = row == k
        t = (xx[m] - off) % 1.0
        i = np.clip(np.searchsorted(edge, t, side='right') - 1, 0, count - 1)
        left[m] = t - edge[i]
        right[m] = edge[i + 1] - t
        ident[m] = k * 64 + i
    r = lambda s: hash01(ident, 0, s)
    hx = (left + right) / 2 * size
    hy = size / rows / 2
    px = (left - right) / 2 * size
    py = (fy - 0.5) * size / rows
    ang = (r(110) - 0.5) * 0.16
    qx, qy = px * np.cos(ang) - py * np.sin(ang), px * np.sin(ang) + py * np.cos(ang)
    ax = hx - 0.0025 - 0.003 * r(111)
    ay = hy - 0.002 - 0.003 * r(112)
    rad = 0.020 + 0.012 * r(113)
    ex, ey = np.abs(qx) - ax + rad, np.abs(qy) - ay + rad
    sdf = np.hypot(np.maximum(ex, 0), np.maximum(ey, 0)) + np.minimum(np.maximum(ex, ey), 0) - rad
    sdf = sdf + np.maximum(noise(n, 114, 1.2, 10, 90) - 0.4, 0) * 0.0025
    # rounded crown: steep at the rim, almost flat in the middle
    t = np.clip(-sdf / 0.038, 0, 1)
    dome = np.sqrt(np.clip(1 - (1 - t) ** 2.2, 0, 1))
    stone = smooth(-0.001, -0.006, sdf)
    mid = noise(n, 115, 1.2, 10, 70)
    fine = noise(n, 116, 0.8, 36, 230)
    tilt = (r(117) - 0.5) * qx / 0.12 + (r(118) - 0.5) * qy / 0.1
    hs = 0.24 + 0.60 * dome + 0.14 * (r(119) - 0.5) + 0.10 * tilt + 0.017 * mid + 0.0065 * fine
    chipped = smooth(0.9, 1.8, noise(n, 120, 1.0, 18, 100))
    hs = hs - 0.045 * chipped
    dirt = noise(n, 121, 1.0, 12, 140)
    grit = noise(n, 122, 0.5, 60, 240)
    hj = 0.16 + 0.035 * dirt + 0.020 * grit
    moss = smooth(-0.1, 1.1, noise(n, 123, 1.4, 2, 24)) * smooth(0.004, -0.011, -(-sdf) - 0.004)
    moss_tuft = noise(n, 124, 0.6, 40, 230)
    hj = hj + 0.07 * moss * (1 + 0.35 * moss_tuft)
    h = np.maximum(hs * stone + (1 - stone) * 0, hj)
    joint = smooth(0.03, -0.03, hs * stone - hj)

    pal = np.array([rgb(c) for c in ('6f6b68', '7d7771', '626061', '837a6d', '6b6e70', '8b8580', '575250', '7a6a60')])
    pick = (r(130) * len(pal)).astype(int) % len(pal)
    col = pal[pick] * (0.84 + 0.34 * r(131))[..., None]
    col = col * (1 + 0.07 * noise(n, 132, 1.2, 6, 60) + 0.06 * fine)[..., None]
    white = smooth(1.2, 2.0, noise(n, 133, 0.3, 80, 250))
    black = smooth(1.1, 1.9, noise(n, 134, 0.3, 80, 250))
    col = mix(col, rgb('b9b4ad'), white * 0.42)
    col = mix(col, rgb('312f30'), black * 0.5)
    rust = smooth(0.9, 2.2, noise(n, 135, 1.4, 3, 30))
    col = mix(col, rgb('7b6049'), rust * 0.35)
    # worn and lighter on the crown, dark at the foot
    col = col * (0.70 + 0.36 * dome)[..., None]
    soil = mix(rgb('453b31'), rgb('2b2722'), uniform_noise(n, 136, beta=1.0, lo=6, hi=120))
    soil = soil * (1 + 0.12 * grit)[..., None]
    green = mix(rgb('4b5a2a'), rgb('6b7434'), uniform_noise(n, 137, beta=0.7, lo=20, hi=260))
    soil = mix(soil, green * (1 + 0.16 * moss_tuft)[..., None], np.clip(moss, 0, 1) * 0.85)
    base = mix(col, soil, joint)
    wet = smooth(-0.3, 1.3, noise(n, 138, 1.7, 1, 12) - (blur(h, 3) - 0.6) * 1.3)
    base = base * (1 - 0.30 * wet * (1 - 0.4 * joint))[..., None]
    base = base * cavity(h, 9, 0.45)
    spec = ((1 - joint) * (0.12 + 0.52 * wet + 0.10 * dome + 0.05 * fine * (1 - wet) - 0.06 * chipped)
            + joint * (0.02 + 0.22 * wet * (1 - moss)))
    spec = spec + white * 0.06 * (1 - joint)
    return base, spec, h, size, depth


def metal():
    """Painted sheet panels, rivets along the seams, scratches to bare metal, rust."""
    n, size, depth = 512, 1.0, 0.009
    u, v = coords(n)
    nx, ny = 2, 2
    wob = noise(n, 201, 1.5, 2, 10) * 0.0004
    x, y = u * nx, (v + wob) * ny
    ix, iy = np.floor(x).astype(int) % nx, np.floor(y).astype(int) % ny
    px, py = (x - np.floor(x) - 0.5) * size / nx, (y - np.floor(y) - 0.5) * size / ny
    edge = size / nx / 2 - np.maximum(np.abs(px), np.abs(py))      # metres from the seam
    gap = smooth(0.0035, 0.0012, edge)
    # a raised field inside each panel (pressed swage)
    rr = 0.03
    ex, ey = np.abs(px) - 0.185 + rr, np.abs(py) - 0.185 + rr
    fs = np.hypot(np.maximum(ex, 0), np.maximum(ey, 0)) + np.minimum(np.maximum(ex, ey), 0) - rr
    swage = smooth(0.008, -0.008, fs)
    # rivets every 62.5 mm, 20 mm inside the seam
    rivet = np.zeros((n, n)); ring = np.zeros((n, n))
    step = 0.0625
    for (a, b) in ((px, py), (py, px)):
        s = (a / step + 0.5) % 1.0 - 0.5
        d = np.hypot(s * step, np.abs(b) - 0.226)
        keep = np.abs(a) < 0.235
        d = np.where(keep, d, 1.0)
        rivet = np.maximum(rivet, np.sqrt(np.clip(1 - (d / 0.0100) ** 2, 0, 1)))
        ring = np.maximum(ring, smooth(0.019, 0.009, d))
    dents = noise(n, 202, 2.2, 1, 8)
    peel = noise(n, 203, 0.7, 40, 160)
    # rust grows from seams, rivets and scratches, and runs down a little
    seed = 1.6 * gap + 0.9 * ring * smooth(0.2, 0.8, hash01(ix, iy, 7)) + 0.5 * smooth(0.03, 0.0, edge)
    run = sum(np.roll(seed, k, 0) * np.exp(-k / 22.0) for k in range(0, 72, 3)) / 7
    rn = noise(n, 204, 1.1, 3, 120)
    rust = smooth(1.02, 1.55, 0.62 * seed + 0.55 * run + 0.48 * rn + 0.30 * noise(n, 205, 0.6, 30, 200))
    # scratches: thin, long, in a few directions
    g = rng(206)
    scr = np.zeros((n, n))
    for _ in range(60):
        cx, cy = g.random(2)
        a = g.normal(0.25, 0.5) if g.random() < 0.7 else g.random() * np.pi
        ln = 0.02 + 0.13 * g.random() ** 2
        w = 0.0005 + 0.0008 * g.random()
        dx, dy = (u - cx + 0.5) % 1 - 0.5, (v - cy + 0.5) % 1 - 0.5
        s, t = dx * np.cos(a) + dy * np.sin(a), -dx * np.sin(a) + dy * np.cos(a) + 0.06 * (dx * np.cos(a)) ** 2
        scr = np.maximum(scr, smooth(w * 1.6, w * 0.3, np.abs(t)) * smooth(ln, ln * 0.7, np.abs(s))
                         * (0.4 + 0.6 * g.random()))
    scr *= smooth(-0.8, 0.4, noise(n, 207, 0.8, 10, 120))
    chips = smooth(2.35, 2.6, noise(n, 208, 1.0, 10, 110) + 1.0 * smooth(0.015, 0, edge) + 0.5 * ring)
    bare = np.clip(np.maximum(scr, chips), 0, 1) * (1 - rust)
    h = 0.47 + 0.22 * swage - 0.45 * gap + 0.30 * rivet + 0.010 * dents + 0.0035 * peel
    h = h - 0.045 * bare + rust * (0.035 * noise(n, 209, 0.7, 30, 200) - 0.01)
    paint = mix(rgb('5f7a80'), rgb('54696d'), uniform_noise(n, 210, beta=1.5, lo=2, hi=30))
    paint = paint * (0.94 + 0.10 * hash01(ix, iy, 12))[..., None]
    fade = uniform_noise(n, 211, beta=1.3, lo=3, hi=60, ax=2.0, ay=0.4)
    paint = mix(paint, rgb('8a9a9a'), 0.28 * fade)
    grime = (np.clip(0.55 * run + 0.55 * smooth(0.05, 0, edge) + 0.25 * ring, 0, 1)
             * uniform_noise(n, 212, beta=1.0, lo=4, hi=80, ax=2, ay=0.5))
    paint = mix(paint, rgb('3d4340'), 0.55 * grime)
    steel = rgb('b4b3ae') * (1 + 0.06 * noise(n, 213, 0.6, 20, 200))[..., None]
    ru = mix(rgb('7a3f22'), rgb('a5602f'), uniform_noise(n, 214, beta=0.9, lo=8, hi=160))
    ru = mix(ru, rgb('43281d'), smooth(0.3, 1.6, noise(n, 215, 0.9, 8, 140)))
    halo = np.clip(blur(rust, 4) * 1.2, 0, 1) * (1 - rust)
    base = mix(paint, rgb('7b5238'), halo * 0.45)
    base = mix(base, steel, bare)
    base = mix(base, ru, rust)
    base = base * (1 - 0.6 * gap)[..., None] * cavity(h, 4, 0.5)
    gloss = uniform_noise(n, 216, beta=1.2, lo=2, hi=60)
    spec = 0.30 + 0.16 * gloss - 0.18 * grime + 0.10 * rivet
    spec = spec * (1 - bare) + bare * 0.92
    spec = spec * (1 - rust) + rust * 0.05
    spec = spec * (1 - 0.8 * gap)
    return base, spec, h, size, depth


def corrugated():
    """Galvanised corrugated sheet, ribs vertical: spangle, seams, streaks of rust."""
    n, size, depth = 512, 1.0, 0.022
    u, v = coords(n)
    ribs = 10
    lap = smooth(0.006, 0.002, np.abs((v * 1.0 + 0.5) % 1.0 - 0.5))   # one horizontal lap
    ph = np.cos(2 * np.pi * ribs * (u + noise(n, 251, 1.8, 1, 4) * 0.0006))
    prof = 0.5 + 0.5 * np.sign(ph) * np.abs(ph) ** 0.72
    dents = noise(n, 252, 2.0, 1, 10)
    _, _, cid = worley(n, 56, 253, 1.0)
    spangle = hash01(cid, 3, 254)
    f1 = (v * 4 + 0.5) % 1.0 - 0.5
    rib = (u * ribs * 0.5) % 1.0 - 0.5
    d = np.hypot((rib) * size * 2 / ribs, f1 * size / 4)
    bolt = np.sqrt(np.clip(1 - (d / 0.010) ** 2, 0, 1))
    washer = smooth(0.017, 0.0155, d)
    h = (0.10 + 0.62 * prof + 0.018 * dents + 0.10 * smooth(0.0, 0.004, (v % 1.0)) * smooth(0.03, 0.0, v)
         + 0.05 * washer + 0.12 * bolt)
    seed = washer * 0.9 + lap
    run = sum(np.roll(seed, k, 0) * np.exp(-k / 40.0) for k in range(0, 120, 4)) / 8
    rn = noise(n, 255, 1.1, 2, 120, ax=1.0, ay=0.6)
    rust = smooth(0.95, 1.6, 0.7 * run + 0.62 * rn + 0.25 * noise(n, 256, 0.6, 30, 200))
    zinc = mix(rgb('878d90'), rgb('a3a7a7'), spangle)
    zinc = zinc * (0.92 + 0.10 * uniform_noise(n, 257, beta=1.5, lo=1, hi=16))[..., None]
    dull = uniform_noise(n, 258, beta=1.2, lo=2, hi=60, ax=2.5, ay=0.4)
    zinc = mix(zinc, rgb('71726d'), 0.5 * dull)
    ru = mix(rgb('6d3a21'), rgb('9a5a30'), uniform_noise(n, 259, beta=0.9, lo=6, hi=160))
    base = mix(zinc, rgb('765440'), np.clip(blur(rust, 6) + 0.6 * run * dull, 0, 1) * 0.5)
    base = mix(base, ru, rust)
    base = base * (0.72 + 0.34 * prof)[..., None] * (1 - 0.4 * lap)[..., None]
    spec = (0.42 + 0.28 * (spangle - 0.5) - 0.22 * dull + 0.2 * bolt) * (1 - rust) + 0.05 * rust
    h = h + 0.012 * rust * noise(n, 260, 0.7, 40, 200)
    return base, spec, h, size, depth


def plaster():
    n, size, depth = 512, 2.0, 0.012
    trowel = noise(n, 301, 1.2, 3, 70, ax=0.8, ay=1.1)
    grain = noise(n, 302, 0.4, 80, 220)
    broad = noise(n, 303, 2.0, 1, 6)
    # cracks: edges of a warped cell pattern, only where a mask allows
    wx, wy = noise(n, 304, 1.5, 3, 60) * 9, noise(n, 305, 1.5, 3, 60) * 9
    f1, f2, _ = worley(n, 5, 306, 1.0)
    u, v = coords(n)
    e = sample(f2 - f1, u * n - 0.5 + wx, v * n - 0.5 + wy)
    mask = smooth(0.1, 0.9, noise(n, 307, 1.6, 1, 10))
    crack = smooth(0.020, 0.004, e) * mask
    # patches where the top coat has come off
    pn = noise(n, 308, 1.5, 1, 40) + 0.12 * noise(n, 309, 0.8, 20, 150) + 0.5 * (mask - 0.5)
    off = smooth(1.72, 1.80, pn)
    lip = smooth(1.55, 1.75, pn) * (1 - off)
    h = 0.72 + 0.035 * trowel + 0.020 * grain + 0.03 * broad - 0.30 * crack
    h = h + 0.04 * lip
    h = h * (1 - off) + off * (0.30 + 0.05 * noise(n, 310, 0.9, 10, 200) + 0.03 * grain)
    tone = uniform_noise(n, 311, beta=1.7, lo=1, hi=20)
    col = mix(rgb('c9bba0'), rgb('b7a88e'), tone)
    col = mix(col, rgb('d5cab4'), 0.5 * uniform_noise(n, 312, beta=1.2, lo=4, hi=60))
    streak = uniform_noise(n, 313, beta=1.2, lo=3, hi=90, ax=2.2, ay=0.25) * smooth(0.0, 1.5, noise(n, 314, 1.8, 1, 8))
    col = mix(col, rgb('7d7262'), 0.62 * streak)
    col = col * (1 + 0.030 * grain + 0.022 * trowel)[..., None]
    col = mix(col, rgb('5d5346'), 0.75 * crack)
    under = (mix(rgb('948671'), rgb('a79982'), uniform_noise(n, 315, beta=0.9, lo=6, hi=140))
             * (1 + 0.10 * grain)[..., None])
    base = mix(col, under, off)
    base = base * cavity(h, 4, 0.8)
    spec = (0.07 + 0.03 * trowel * 0.3 + 0.05 * tone) * (1 - off) + 0.03 * off - 0.03 * crack
    return base, spec, h, size, depth


def planks():
    """Five weathered boards running vertically, nail heads, knots."""
    n, size, depth = 512, 0.8, 0.008
    boards = 5
    u, v = coords(n)
    x = u * boards + noise(n, 401, 1.6, 1, 8) * 0.006
    ib = np.floor(x).astype(int) % boards
    fx = x - np.floor(x) - 0.5
    bw = size / boards
    r = lambda s: hash01(ib, 0, 400 + s)
    joint = (v + r(1)) % 1.0                                    # one butt joint per board
    ey = np.minimum(joint, 1 - joint) * size
    ex = (0.5 - np.abs(fx)) * bw
    edge = np.minimum(ex - 0.0022, ey - 0.0016)
    edge = edge + np.minimum(noise(n, 402, 1.0, 8, 90, ax=2, ay=0.5) + 0.6, 0) * 0.0016
    board = smooth(-0.0006, 0.0020, edge)
    # rings: distance from a wandering pith, stretched along the board
    shift = noise(n, 403, 2.0, 1, 6, ax=3.0, ay=0.6)
    cx = (r(2) - 0.5) * 1.6
    knots = np.zeros((n, n)); kx = np.zeros((n, n))
    g = rng(404)
    for b in range(boards):
        for _ in range(2):
            if g.random() < 0.25:
                continue
            kc, kv, kr = (g.random() - 0.5) * 0.5, g.random(), 0.007 + 0.009 * g.random()
            dy = ((v - kv + 0.5) % 1.0 - 0.5) * size
            dx = (fx - kc) * bw
            m = ib == b
            d = np.hypot(dx, dy * 0.62)
            knots = np.where(m, np.maximum(knots, smooth(kr * 1.25, kr * 0.75, d)), knots)
            # grain flows round the knot
            kx = np.where(m, kx + np.sign(dx) * kr * 4.2 * np.exp(-(dx / (kr * 2.0)) ** 2 - (dy / (kr * 4.6)) ** 2)
                          * np.minimum(np.abs(dx) / kr, 1), kx)
    rad = (fx - cx) * bw * (1 + 0.5 * r(3)) - kx + shift * 0.006 + 0.010 * np.sin(2 * np.pi * (v + r(4)))
    ring = (rad / 0.0075 + 0.35 * noise(n, 405, 1.2, 2, 60, ax=4, ay=0.25))
    rr = ring - np.floor(ring)
    late = smooth(0.35, 0.93, rr) * (1 - smooth(0.93, 1.0, rr))   # dark late wood, sharp end
    fibre = noise(n, 406, 0.5, 20, 256, ax=0.9, ay=0.05)
    pores = smooth(1.2, 2.2, noise(n, 407, 0.3, 60, 256, ax=1.0, ay=0.10))
    crackn = noise(n, 408, 1.0, 6, 200, ax=1.6, ay=0.07)
    split = smooth(2.05, 2.6, crackn) * board
    dn = np.hypot((np.abs(fx) - 0.30) * bw, (((v + r(1) + 0.04) % 0.5) - 0.04 - 0.0) * size)
    nail = smooth(0.0040, 0.0030, dn)
    h = (0.68 + 0.10 * (r(5) - 0.5) + 0.055 * late + 0.035 * fibre - 0.07 * pores - 0.45 * split + 0.10 * knots
         - 0.04 * np.abs(fx) * 2)
    h = h * board + (1 - board) * 0.04
    h = h * (1 - nail) + nail * 0.60
    tone = r(6)
    early = mix(rgb('a07c58'), rgb('8f7258'), tone)
    lat = mix(rgb('6a4a33'), rgb('5d4535'), tone)
    col = mix(early, lat, late * 0.85) * (0.86 + 0.26 * r(7))[..., None]
    col = col * (1 + 0.07 * fibre)[..., None]
    grey = smooth(-0.4, 1.6, noise(n, 409, 1.5, 2, 40, ax=1.8, ay=0.4) + 0.8 * (r(8) - 0.5))
    silver = rgb('8e867b') * (0.9 + 0.12 * fibre - 0.25 * late)[..., None]
    col = mix(col, silver, grey * 0.62)
    col = mix(col, rgb('3b281d') * (1 + 0.3 * fibre)[..., None], knots * 0.8)
    col = mix(col, rgb('2c211a'), np.clip(split + 0.4 * pores, 0, 1))
    col = mix(col, rgb('241c17'), 1 - board)
    stain = sum(np.roll(nail, k, 0) * np.exp(-k / 14.0) for k in range(0, 40, 2)) / 4
    col = mix(col, rgb('3a2c28'), np.clip(stain, 0, 1) * 0.6)
    col = mix(col, rgb('6b6a6a'), nail)
    base = col * cavity(h, 4, 0.5)
    spec = (0.10 + 0.10 * late - 0.05 * grey + 0.03 * fibre) * board * (1 - split) + nail * 0.5
    return base, spec, h, size, depth


def concrete():
    """Cast concrete: board marks, pin holes, stains."""
    n, size, depth = 512, 1.5, 0.008
    u, v = coords(n)
    grain = noise(n, 551, 0.4, 60, 220)
    mid = noise(n, 552, 1.2, 5, 60)
    k = 6
    y = v * k + noise(n, 553, 1.6, 1, 10) * 0.01
    row = np.floor(y).astype(int) % k
    seam = smooth(0.035, 0.0, np.abs((y + 0.5) % 1.0 - 0.5))
    f1, _, ident = worley(n, 34, 554, 1.0)
    hole = smooth(0.20, 0.10, f1 / (0.45 + hash01(ident, 0, 555))) * (hash01(ident, 1, 556) < 0.22)
    fibre = noise(n, 557, 0.8, 8, 120, ax=0.15, ay=1.0)
    h = (0.66 + 0.05 * (hash01(row, 0, 558) - 0.5) + 0.03 * mid + 0.022 * grain + 0.022 * fibre
         + 0.16 * seam * smooth(-0.5, 1, mid) - 0.5 * hole)
    base = mix(rgb('8d8982'), rgb('a39e94'), uniform_noise(n, 559, beta=1.5, lo=1, hi=40))
    base = base * (0.95 + 0.08 * hash01(row, 0, 560) + 0.035 * grain + 0.02 * fibre)[..., None]
    stain = uniform_noise(n, 561, beta=1.2, lo=2, hi=60, ax=2.0, ay=0.3) * smooth(-0.2, 1.6, noise(n, 562, 1.6, 1, 8))
    base = mix(base, rgb('57524a'), 0.6 * stain)
    base = mix(base, rgb('3c3935'), 0.7 * hole) * cavity(h, 4, 0.7)
    spec = 0.08 + 0.05 * uniform_noise(n, 563, beta=1.2, lo=2, hi=40) + 0.02 * grain - 0.05 * hole
    return base, spec, h, size, depth


def copper():
    """Hammered copper: shallow round dents that meet in soft ridges, dark in the hollows
    and polished on the ridges, with a little verdigris."""
    n, size, depth = 512, 1.4, 0.012
    f1, f2, ident = worley(n, 22, 701, 0.75)
    deep = 0.75 + 0.25 * hash01(ident, 0, 702)
    dent = np.clip(f1 / 0.72, 0, 1) ** 2 * deep
    ridge = smooth(0.16, 0.0, f2 - f1)
    h = blur(0.30 + 0.62 * dent, 1.1) + 0.012 * noise(n, 703, 1.2, 6, 90)
    tone = uniform_noise(n, 704, beta=1.5, lo=1, hi=30)
    base = mix(rgb('d98a60'), rgb('c46f48'), tone) * (0.94 + 0.08 * hash01(ident, 1, 705))[..., None]
    base = mix(base, rgb('f0b48c'), 0.45 * ridge)
    aged = smooth(0.9, 2.2, noise(n, 706, 1.3, 2, 60) + 0.6 * (1 - ridge))
    base = mix(base, rgb('5b3526'), 0.6 * aged)
    green = smooth(1.75, 2.5, noise(n, 707, 1.2, 3, 120)) * (1 - ridge)
    base = mix(base, rgb('6fa090'), 0.7 * green)
    spec = np.clip(0.85 + 0.15 * ridge - 0.35 * aged - 0.6 * green, 0, 1)
    return base, spec, h, size, depth

ALL = dict(asphalt=asphalt, paving=paving, tiles=tiles, brick=brick, copper=copper, cobble=cobble, metal=metal,
           corrugated=corrugated,
           plaster=plaster, planks=planks, concrete=concrete)


def main(out, names=None, preview=None):
    os.makedirs(out, exist_ok=True)
    index_path = os.path.join(out, 'textures.json')
    index = json.load(open(index_path)) if os.path.exists(index_path) else {}
    for name in names or ALL:
        base, spec, h, size, depth = ALL[name]()
        index[name] = save_set(out, name, base, spec, h, size, depth,
                               {'metal': 1, 'corrugated': 1, 'copper': 1, 'brick': 3, 'tiles': 3, 'asphalt': 3,
                                'paving': 3}.get(name, 2))
        print('texture', name, 'height %.2f..%.2f' % (h.min(), h.max()))
        if preview:
            nrm = normal_from_height(np.clip(h, 0, 1), size, depth)
            save_jpg(os.path.join(preview, name + '.jpg'), relight(base, nrm, spec, tile=2 if len(h) < 1000 else 1))
    with open(index_path, 'w') as f:
        json.dump(dict(sorted(index.items())), f, indent=1)
        f.write('\n')


if __name__ == '__main__':
    here = os.path.dirname(os.path.abspath(__file__))
    args = sys.argv[1:]
    preview = None
    if args and args[0] == '--preview':
        preview = args[1]
        args = args[2:]
        os.makedirs(preview, exist_ok=True)
    main(os.path.join(here, '..', 'textures'), args, preview)
