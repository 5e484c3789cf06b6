"""Tiles of the town: asphalt, pavement slabs, roof tiles. Made with the others by make_textures.py."""

from texlib import *


def asphalt():
    """Rolled asphalt after rain: chippings in bitumen, tracks worn smooth, hairline
    cracks."""
    n, size, depth = 512, 3.2, 0.010
    f1, f2, ident = worley(n, 150, 801, 0.95)
    stone = smooth(0.62, 0.25, f1) * (hash01(ident, 0, 802) < 0.72)
    tone = hash01(ident, 1, 803)
    mid, low = noise(n, 804, 1.1, 5, 60), noise(n, 805, 1.0, 4, 30)
    worn = smooth(-0.8, 1.4, noise(n, 806, 1.2, 3, 24))
    wander = noise(n, 807, 1.3, 2, 60)
    crack = smooth(0.05, 0.012, np.abs(wander)) * smooth(0.5, 1.2, noise(n, 808, 1.6, 1, 6))
    h = 0.52 + 0.20 * stone * (0.6 + 0.4 * tone) * (1 - 0.45 * worn) + 0.05 * mid + 0.06 * low - 0.42 * crack
    base = mix(rgb('34343a'), rgb('232328'), uniform_noise(n, 809, beta=1.3, lo=2, hi=60))
    pebble = mix(rgb('5a5650'), rgb('86807a'), tone)
    base = mix(base, pebble, 0.75 * stone * (0.35 + 0.65 * worn))
    base = base * (1 + 0.07 * mid + 0.05 * low)[..., None]
    base = mix(base, rgb('141417'), 0.85 * crack) * cavity(h, 3, 0.8)
    wet = smooth(0.1, 1.5, -low + 0.35 * mid)
    base = base * (1 - 0.14 * wet)[..., None]
    spec = 0.20 + 0.06 * worn + 0.22 * wet + 0.06 * stone - 0.10 * crack
    return base, np.clip(spec, 0, 1), h, size, depth


def paving():
    """Pavement slabs in broken bond, each a little tilted, chipped and stained."""
    n, size, depth = 512, 2.4, 0.014
    rows, cols = 4, 3
    u, v = coords(n)
    y = v * rows + noise(n, 821, 1.2, 4, 60) * 0.004
    row = np.floor(y).astype(int) % rows
    x = u * cols + 0.5 * (row % 2) + noise(n, 822, 1.2, 4, 60) * 0.003
    col = np.floor(x).astype(int) % cols
    fx, fy = x - np.floor(x) - 0.5, y - np.floor(y) - 0.5
    r = lambda s: hash01(col, row, s)
    edge = np.minimum((0.5 - np.abs(fx)) * size / cols, (0.5 - np.abs(fy)) * size / rows)
    edge = edge + np.minimum(noise(n, 823, 1.1, 8, 110) + 0.9, 0) * 0.006
    slab = smooth(0.001, 0.011, edge)
    fine, mid, low = noise(n, 824, 0.6, 40, 220), noise(n, 825, 1.1, 6, 70), noise(n, 826, 1.8, 1, 6)
    pits = smooth(1.5, 2.3, noise(n, 827, 0.6, 30, 160))
    split = smooth(0.045, 0.008, np.abs(noise(n, 828, 1.4, 2, 50))) * (r(829) < 0.18)
    h = (0.66 + 0.14 * (r(830) - 0.5) + 0.16 * ((r(831) - 0.5) * fx + (r(832) - 0.5) * fy) + 0.025 * mid + 0.014 * fine
         - 0.12 * pits - 0.30 * split)
    h = h * slab + 0.22 * (1 - slab)
    base = mix(rgb('8b8578'), rgb('a09a90'), r(833)) * (0.86 + 0.22 * r(834))[..., None]
    base = base * (1 + 0.05 * mid + 0.03 * fine)[..., None]
    dirt = uniform_noise(n, 835, beta=1.2, lo=2, hi=80) * smooth(-0.9, 1.6, mid)
    base = mix(base, rgb('4c473f'), 0.35 * dirt)
    gum = smooth(0.10, 0.07, worley(n, 26, 836, 1.0)[0]) * 0.5
    base = mix(base, rgb('5d5a55'), gum)
    base = mix(rgb('3b3a30'), base, slab)
    base = mix(base, rgb('2f2c28'), np.clip(0.8 * split + 0.3 * pits, 0, 1)) * cavity(h, 5, 0.6)
    wet = smooth(-0.3, 1.6, 0.6 * mid + 1.6 * (r(837) - 0.5))
    base = base * (1 - 0.22 * wet)[..., None]
    spec = (0.10 + 0.06 * r(838) + 0.02 * fine + 0.38 * wet) * slab
    return base, np.clip(spec, 0, 1), h, size, depth


def tiles():
    """Clay roof tiles: courses that lap over each other, mossy below."""
    n, size, depth = 256, 1.8, 0.030
    rows, cols = 10, 8
    u, v = coords(n)
    y = v * rows
    row = np.floor(y).astype(int) % rows
    x = u * cols + 0.5 * (row % 2)
    col = np.floor(x).astype(int) % cols
    fx, fy = x - np.floor(x) - 0.5, y - np.floor(y)
    r = lambda s: hash01(col, row, s)
    fy = np.clip(fy + 0.05 * (r(841) - 0.5), 0, 1)
    gap = smooth(0.46, 0.492, np.abs(fx))
    fine, mid = noise(n, 842, 0.6, 20, 120), noise(n, 843, 1.1, 3, 40)
    lap = smooth(1.0, 0.93, fy)
    h = (0.30 + 0.55 * fy + 0.10 * (r(844) - 0.5) - 0.12 * (2 * fx) ** 2 + 0.02 * mid) * lap - 0.25 * gap
    pal = np.array([rgb(c) for c in ('7d4634', '8c5038', '6d3c30', '94593e', '5f3a33', '7a4a3c')])
    base = (pal[(r(845) * 5.999).astype(int)] * (0.85 + 0.3 * r(846))[..., None]
            * (1 + 0.06 * mid + 0.04 * fine)[..., None])
    moss = smooth(0.9, 2.0, noise(n, 847, 1.2, 2, 60) + 0.8 * (fy < 0.2))
    base = mix(base, rgb('4c5034'), 0.6 * moss)
    base = mix(base, rgb('241b18'), np.clip(0.8 * gap + 0.8 * (1 - lap), 0, 1)) * cavity(h, 3, 0.4)
    spec = (0.16 + 0.10 * r(848) + 0.03 * fine - 0.10 * moss) * (1 - gap)
    return base, np.clip(spec, 0, 1), h, size, depth
