"""People, standing or riding: limbs and trunk are skins over rings along a bent line; clothes are drawn on an atlas
block of 256 by 256 pixels. A pose is the places of the joints."""

from vehiclelib import *


def skin(path, radii, rect, seg=12, side=(1, 0, 0), power=2.0, close=(True, True), bend=60):
    """A closed skin. path: ring centres; radii: (across, deep) of each ring. u runs around, 0.5 in front; v along.
    side: the direction that counts as across at the end. power: 2 an ellipse, more is boxier."""
    path, radii = np.asarray(path, float), np.asarray(radii, float)
    tan = np.gradient(path, axis=0)
    tan /= np.linalg.norm(tan, axis=1, keepdims=True)
    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    ang = -np.pi / 2 - np.arange(seg + 1) / seg * 2 * np.pi
    c, s = np.cos(ang), np.sin(ang)
    c, s = np.sign(c) * np.abs(c) ** (2 / power), np.sign(s) * np.abs(s) ** (2 / power)
    P, UV = [], []
    x, y, w, h = rect
    turns, e1 = [], np.asarray(side, float)
    for t in tan[::-1]:                                # carried along from the end, so that it follows any bend
        e1 = e1 - t * (e1 @ t)
        e1 /= np.linalg.norm(e1)
        turns.append(e1)
    for p, t, e1, (a, b), l in zip(path, tan, turns[::-1], radii, length):
        e2 = np.cross(t, e1)
        e2 = e2 if e2 @ (0, 0.3, 1) > 0 else -e2
        ring = p + a * c[:, None] * e1 + b * s[:, None] * e2
        ring[-1] = ring[0]
        P.append(ring)
        UV.append(np.stack([x + w * np.arange(seg + 1) / seg, np.full(seg + 1, y + h * l / length[-1])], 1))
    n, k = len(path), seg + 1
    F = [f for i in range(n - 1) for j in range(seg)
         for f in ((i * k + j, i * k + j + 1, (i + 1) * k + j + 1), (i * k + j, (i + 1) * k + j + 1, (i + 1) * k + j))]
    P, UV = [q for ring in P for q in ring], [q for ring in UV for q in ring]
    for end, i, shut in ((0, 0, close[0]), (-1, n - 1, close[1])):
        if shut:
            m = len(P)
            for j in range(seg):                       # a point for each triangle: UVs keep their area
                P.append(path[end])
                UV.append((UV[i * k + j] + UV[i * k + j + 1]) / 2 + (0, (-0.02 if end == 0 else 0.02) * h))
                F.append((i * k + j + 1, i * k + j, m + j) if end == 0 else (i * k + j, i * k + j + 1, m + j))
    P, F = np.array(P), np.array(F)
    q = P[F[seg * (n // 2)]]
    out = q.mean(0) - path[min(n - 1, n // 2)]
    if np.cross(q[1] - q[0], q[2] - q[0]) @ out < 0:
        F = F[:, ::-1]
    return creased(P, np.array(UV), F, bend)


def between(a, b, t):
    return np.asarray(a, float) * (1 - t) + np.asarray(b, float) * t


def limb(a, b, c, radii, rect, seg=10, side=(1, 0, 0), top=None):
    """Two bones a-b-c. radii: at a, the first middle, before b, b, after b, the second middle, c; top: where the skin
    begins, narrow, before a."""
    pts = [a, between(a, b, 0.45), between(a, b, 0.88), np.asarray(b, float), between(b, c, 0.12), between(b, c, 0.4),
           c]
    pts[3] = pts[3] + 0.25 * (np.asarray(b) - (pts[2] + pts[4]) / 2)
    radii = [(r, r * 1.06) for r in radii]
    if top is not None:
        pts, radii = [top] + pts, [(0.5 * radii[0][0], 0.5 * radii[0][1])] + radii
    return skin(pts, radii, rect, seg, side)


def leg(hip, knee, ankle, uv, seg=10):
    hip = np.asarray(hip, float)
    top = hip + 0.5 * (hip - between(hip, knee, 0.15))
    return limb(hip, knee, ankle, (0.088, 0.084, 0.067, 0.064, 0.062, 0.062, 0.052), uv['trousers'], seg, top=top)


def knee(hip, ankle, thigh=0.44, shin=0.44, out=0.0):
    """Where the knee is, bent forward, `out` of 1 also outward (+X)."""
    h, a = np.asarray(hip, float), np.asarray(ankle, float)
    d = np.linalg.norm(a - h)
    t = (a - h) / d
    along = (thigh ** 2 - shin ** 2 + d * d) / (2 * d)
    pole = np.array([out, 0.25, 1.0])
    pole -= t * (pole @ t)
    return h + t * along + pole / np.linalg.norm(pole) * np.sqrt(max(thigh ** 2 - along ** 2, 0.0))


def shoe(ankle, forward, uv, seg=8, size=1.0):
    """A shoe from the heel to the toe below an ankle."""
    f = np.asarray(forward, float) / np.linalg.norm(forward)
    down = np.array([0, -1.0, 0]) - f * (-f[1])
    down /= np.linalg.norm(down)
    a = np.asarray(ankle, float)
    along = np.array([-0.075, -0.06, 0.0, 0.07, 0.13, 0.175, 0.190]) * size
    drop = np.array([0.055, 0.045, 0.035, 0.052, 0.064, 0.070, 0.072]) * size
    rad = [(0.020, 0.020), (0.036, 0.042), (0.042, 0.054), (0.045, 0.038), (0.046, 0.028), (0.036, 0.020),
           (0.012, 0.010)]
    path = a + along[:, None] * f + drop[:, None] * down
    return skin(path, np.array(rad) * size, uv['shoe'], seg)


def arm(shoulder, elbow, wrist, uv, seg=10):
    """The sleeve: out of the trunk, round the shoulder, down to the wrist."""
    s, b, c = (np.asarray(p, float) for p in (shoulder, elbow, wrist))
    d = (b - s) / np.linalg.norm(b - s)
    inward = np.array([-1.0, 0, 0])
    pts = [s + inward * 0.110 + d * 0.016, s + inward * 0.055 + d * 0.002, s + inward * 0.014 + d * 0.008,
           s + d * 0.055, between(s, b, 0.5), between(s, b, 0.88), b,
           between(b, c, 0.12), between(b, c, 0.4), c]
    pts[6] = b + 0.25 * (b - (pts[5] + pts[7]) / 2)
    radii = [0.034, 0.050, 0.059, 0.061, 0.055, 0.050, 0.049, 0.047, 0.043, 0.036]
    return skin(pts, [(r, r * 1.06) for r in radii], uv['sleeve'], seg)


def hand(wrist, tip, rect, seg=8, fist=False):
    w, t = np.asarray(wrist, float), np.asarray(tip, float)
    k = ([(0.026, 0.024), (0.030, 0.040), (0.030, 0.046), (0.020, 0.030)] if not fist
         else [(0.030, 0.030), (0.044, 0.044), (0.046, 0.046), (0.030, 0.030)])
    return skin([w, between(w, t, 0.35), between(w, t, 0.75), t], k, rect, seg)


def torso(pelvis, chest, neck, uv, seg=16):
    """From below the hips over the chest to the collar."""
    pelvis, chest, neck = (np.asarray(p, float) for p in (pelvis, chest, neck))
    up = (chest - pelvis) / np.linalg.norm(chest - pelvis)
    top = (neck - chest) / np.linalg.norm(neck - chest)
    pts = [pelvis - up * 0.10, pelvis - up * 0.03, between(pelvis, chest, 0.25), between(pelvis, chest, 0.55), chest,
           between(chest, neck, 0.42), between(chest, neck, 0.72), between(chest, neck, 0.90), neck, neck + top * 0.035]
    rad = [(0.188, 0.138), (0.184, 0.136), (0.170, 0.124), (0.163, 0.118), (0.184, 0.130), (0.198, 0.118),
           (0.168, 0.098), (0.108, 0.082), (0.070, 0.070), (0.066, 0.066)]
    return skin(pts, rad, uv['jacket'], seg, power=2.35)


def head(neck, centre, uv, seg=14, hair=True):
    """(face and neck, hair). centre: between the ears."""
    n, c = np.asarray(neck, float), np.asarray(centre, float)
    k = np.radians([-78, -55, -32, -10, 12, 34, 56, 76])
    up = np.array([0, 1.0, 0])
    fore = np.array([0.006, 0.020, 0.016, 0.008, 0.0, -0.004, -0.006, -0.006])
    path = c + up * (0.118 * np.sin(k))[:, None] + np.array([0, 0, 1.0]) * fore[:, None]
    rad = np.stack([0.078 * np.cos(k) ** 0.75, 0.096 * np.cos(k) ** 0.8], 1)
    rad[1] *= (0.86, 0.92)
    parts = [skin(path, rad, uv['face'], seg, power=2.1)]
    parts.append(skin([n - up * 0.03, between(n, c, 0.5), c - up * 0.04 - (0, 0, 0.01)],
                      [(0.058, 0.058), (0.054, 0.056), (0.056, 0.06)], uv['skin_rect'], 8, close=(False, False)))
    nose = box(0.024, 0.042, 0.024, 0.010).rot('x', 20).move(c[0], c[1] - 0.012, c[2] + 0.101)
    parts.append(nose.swatch(*uv['skin']))
    for sx in (1, -1):
        parts.append(box(0.018, 0.055, 0.034, 0.007)
                     .move(c[0] + sx * 0.079, c[1] - 0.005, c[2] - 0.008).swatch(*uv['skin']))
    if not hair:
        return parts
    k = np.radians([-26, 0, 24, 46, 66, 84])
    back = np.array([-0.034, -0.024, -0.014, -0.010, -0.009, -0.008])
    path = c + up * (0.008 + 0.125 * np.sin(k))[:, None] + np.array([0, 0, 1.0]) * back[:, None]
    rad = np.stack([0.086 * np.cos(k) ** 0.7, 0.098 * np.cos(k) ** 0.72], 1)
    rad[0] *= (0.92, 0.78)
    rad[1] *= (0.99, 0.93)
    return parts + [skin(path, rad, uv['hair'], seg, power=2.1)]


def helmet(centre, uv, tilt=0.0, seg=14, open_=False):
    """(shell, visor and dark parts) around a head. open_: a cyclist's."""
    c = np.asarray(centre, float)
    if open_:
        k = np.radians([4, 18, 36, 54, 72, 86])
        path = [(0, 0.018 + 0.135 * np.sin(a), -0.018 - 0.02 * np.cos(a)) for a in k]
        rad = [(0.098 * np.cos(a) ** 0.7 + 0.004, 0.132 * np.cos(a) ** 0.7 + 0.004) for a in k]
        shell = skin(path, rad, uv['helmet'], seg)
        return shell.rot('x', tilt).move(*c), []
    k = np.radians([-62, -42, -20, 0, 20, 42, 62, 82])
    path = [(0, 0.012 + 0.152 * np.sin(a), 0.004 + 0.030 * (a < 0) * np.sin(-a)) for a in k]
    rad = [(0.122 * np.cos(a) ** 0.62, 0.152 * np.cos(a) ** 0.62) for a in k]
    shell = skin(path, rad, uv['helmet'], seg + 2, power=2.15)
    t, y = np.meshgrid(np.radians(np.linspace(-66, 66, 9)), np.linspace(-0.045, 0.060, 4))
    r = np.cos(np.arcsin(np.clip((y - 0.012) / 0.152, -1, 1))) ** 0.62
    P = np.stack([0.131 * r * np.sin(t), y, 0.006 + 0.162 * r * np.cos(t)], -1).reshape(-1, 3)
    F = np.array([f for i in range(3) for j in range(8)
                  for f in ((i * 9 + j, i * 9 + j + 1, i * 9 + j + 10), (i * 9 + j, i * 9 + j + 10, i * 9 + j + 9))])
    N = P / np.linalg.norm(P, axis=1, keepdims=True)
    visor = Part(P, N, np.zeros((len(P), 2)), outward(P, N, F)).swatch(*uv['gloss'])
    return shell.rot('x', tilt).move(*c), [visor.rot('x', tilt).move(*c)]


# --------------------------------------------------------------------- looks

def draw_human(atlas, x, y, seed, trousers='2b3442', jacket='dcdcd8', hair='2c2018', shoes='1d1714', rider=False):
    """Clothes, skin and hair in a block of 256 by 256 pixels."""
    r = lambda *a: atlas.rect(x + a[0], y + a[1], a[2], a[3], 2)
    atlas.uv.update(jacket=r(0, 0, 128, 128), trousers=r(128, 0, 64, 128), sleeve=r(192, 0, 64, 128),
                    face=r(0, 128, 96, 96), hair=r(96, 128, 64, 64), shoe=r(160, 128, 48, 64),
                    helmet=r(96, 192, 112, 64), skin_rect=r(208, 128, 48, 64))
    cloth(atlas, x, y, 128, 128, jacket, seed, 0.62, draw_jacket, rider)
    cloth(atlas, x + 128, y, 64, 128, trousers, seed + 10, 0.75, draw_trousers, rider)
    cloth(atlas, x + 192, y, 64, 128, jacket, seed + 20, 0.62, draw_sleeve, rider)
    draw_face(atlas, x, y + 128, seed + 30)
    strands = tx.noise(128, seed + 40, beta=0.7, lo=3, hi=60, ax=1.0, ay=0.10)[:64, :64]
    atlas.put(x + 96, y + 128, rgb(hair) * np.clip(1 + 0.25 * strands, 0.4, 1.8)[..., None], 0.5, 0, 0.0015 * strands,
              (0.004, 0.004))
    n = tx.noise(64, seed + 50, beta=1.0, lo=2, hi=20)[:, :48]
    sole = smooth(0.0, 1.0, np.abs(np.linspace(-1, 1, 48)))[None, :] * np.ones((64, 1))
    atlas.put(x + 160, y + 128, mix(rgb(shoes), rgb('0e0d0c'), sole * 0.6) * (1 + 0.1 * n)[..., None], 0.5, 0)
    atlas.put(x + 208, y + 128, np.tile(rgb('b98a6c'), (64, 48, 1)) * (1 + 0.02 * n)[..., None], 0.6, 0)
    atlas.uv['skin'] = ((x + 232) / atlas.w, (y + 160) / atlas.h)
    u, v = np.meshgrid(even(0, 1, 112), even(0, 1, 64))
    stripe = smooth(0.05, 0.045, np.abs(np.abs(u - 0.5) - 0.11)) * smooth(0.55, 0.60, v)
    col = mix(rgb('e4e4e0'), rgb('1c1d1f'), stripe * (0.9 if rider else 0.0))
    vents = (smooth(0.02, 0.0, np.abs(((u * 10) % 1) - 0.5) - 0.16) * smooth(0.08, 0.14, v) * smooth(0.85, 0.75, v)
             * (0 if rider else 1))
    atlas.put(x + 96, y + 192, mix(col, rgb('17181a'), vents), 0.22 + 0.5 * vents, 0, -0.006 * vents, (0.006, 0.004))


def cloth(atlas, x, y, w, h, color, seed, rough, draw, rider):
    """Folds of a size that fits the garment; u around (0.5 in front), v from its beginning to its end."""
    u, v = np.meshgrid(even(0, 1, w), even(0, 1, h))
    big = tx.noise(128, seed, beta=1.6, lo=2, hi=14, ax=1.0, ay=0.5)[:h, :w]
    cross = tx.noise(128, seed + 1, beta=1.4, lo=3, hi=20, ax=0.45, ay=1.0)[:h, :w]
    height = 0.004 * big
    col = (np.tile(rgb(color), (h, w, 1))
           * (1 + 0.05 * big + 0.02 * tx.noise(128, seed + 2, beta=0.3, lo=20, hi=64)[:h, :w])[..., None])
    height, col = draw(u, v, height, cross, col, rider)
    atlas.put(x, y, col, rough, 0, height, (0.9 / w, 0.75 / h), np.clip(1 + 30 * (height - height.mean()), 0.6, 1))


def draw_jacket(u, v, h, cross, col, rider):
    # v 0: hem, 1: collar
    zip_ = smooth(0.012, 0.004, np.abs(u - 0.5))
    h = h + 0.004 * cross * smooth(0.5, 0.15, v) - 0.004 * zip_
    col = mix(col, rgb('3a3a38'), zip_ * 0.8)
    for c in (0.36, 0.64):
        pocket = smooth(0.010, 0.003, np.abs(u - c)) * smooth(0.13, 0.15, v) * smooth(0.34, 0.32, v)
        h, col = h - 0.004 * pocket, mix(col, rgb('44443f'), pocket * 0.6)
    hem = smooth(0.05, 0.04, v)
    col = mix(col, rgb('2c2d2d'), 0.75 * hem)
    collar = smooth(0.92, 0.94, v)
    col = mix(col, rgb('3a3b3a'), 0.7 * collar)
    seam = smooth(0.008, 0.002, np.abs(v - 0.70 - 0.08 * np.abs(u - 0.5))) * (v < 0.9)
    col, h = mix(col, rgb('55554f'), 0.5 * seam), h - 0.003 * seam
    if rider:
        band = smooth(0.03, 0.022, np.abs(v - 0.42))
        col = mix(col, rgb('2b2d2e'), band * 0.9)
    return h, col


def draw_sleeve(u, v, h, cross, col, rider):
    h = h + 0.006 * cross * np.exp(-((v - 0.52) / 0.16) ** 2) + 0.003 * cross * smooth(0.8, 1.0, v)
    cuff = smooth(0.93, 0.95, v)
    return h, mix(col, rgb('323331'), 0.7 * cuff)


def draw_trousers(u, v, h, cross, col, rider):
    h = h + 0.006 * cross * np.exp(-((v - 0.5) / 0.13) ** 2) + 0.005 * cross * smooth(0.82, 1.0, v)
    seam = smooth(0.02, 0.006, np.abs(np.abs(u - 0.5) - 0.25))
    worn = np.exp(-((v - 0.48) / 0.12) ** 2) * np.exp(-((u - 0.5) / 0.16) ** 2)
    if rider:
        pad = smooth(0.14, 0.12, np.hypot((u - 0.5) * 0.6, v - 0.5))
        h, col = h + 0.006 * pad, mix(col, rgb('17181a'), 0.7 * pad)
    return h - 0.002 * seam, mix(col, col * 1.35, 0.5 * worn[..., None] * np.ones(3))


def draw_face(atlas, x, y, seed, s=96):
    """Unrolled head: u 0.5 in front, v 0 below the chin, 1 the crown."""
    u, v = np.meshgrid(even(0, 1, s), even(0, 1, s))
    n = tx.noise(s, seed, beta=1.2, lo=2, hi=40)
    col = np.tile(rgb('be8f70'), (s, s, 1)) * (1 + 0.02 * n)[..., None]
    du = np.abs(u - 0.5)
    cheek = np.exp(-(((du - 0.10) / 0.05) ** 2 + ((v - 0.42) / 0.08) ** 2))
    col = mix(col, rgb('b5715a'), 0.45 * cheek)
    eye = np.hypot((du - 0.066) / 0.026, (v - 0.545) / 0.018)
    socket = np.exp(-(((du - 0.066) / 0.05) ** 2 + ((v - 0.555) / 0.045) ** 2))
    col = mix(col, rgb('7d573f'), 0.5 * socket)
    col = mix(col, rgb('e4ddd2'), smooth(1.1, 0.9, eye))
    col = mix(col, rgb('2a1c14'), smooth(0.020, 0.014, np.hypot(du - 0.066, v - 0.545)))
    brow = np.hypot((du - 0.068) / 0.045, (v - 0.600) / 0.012)
    col = mix(col, rgb('33241a'), 0.85 * smooth(1.1, 0.8, brow))
    mouth = np.hypot(du / 0.050, (v - 0.285) / 0.013)
    col = mix(col, rgb('8c4a40'), 0.8 * smooth(1.2, 0.7, mouth))
    col = mix(col, rgb('8a6148'), 0.45 * smooth(0.35, 0.15, v) * smooth(0.0, 0.2, du))
    hair = np.maximum(smooth(0.74, 0.78, v), smooth(0.20, 0.24, du) * smooth(0.42, 0.50, v))
    col = mix(col, rgb('2c2018'), hair)
    h = (0.006 * np.exp(-((v - 0.60) / 0.03) ** 2) * (du < 0.12) - 0.006 * socket
         + 0.004 * np.exp(-(((v - 0.30) / 0.03) ** 2 + (du / 0.05) ** 2)))
    atlas.put(x, y, col, 0.55, 0, h, (0.55 / s, 0.24 / s))
