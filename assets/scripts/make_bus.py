"""The bus: a 12 m city bus of our own design, doors on the right, ribbon windows that can be lit from inside."""

import os
from vehiclelib import *

HX, HUB, FRONT = 1.275, 0.48, 5.90
TRACK, REAR_TRACK, ARCH, SILL = 1.075, 0.94, 0.575, 0.33
NOSE, END, TOP = 8.66, -3.34, 3.04
O = Outline([(8.56, 0.31), (NOSE, 0.46), (NOSE, 1.10), (8.55, 2.62), (8.34, TOP - 0.02), (-3.20, TOP), (END, 2.70),
             (END, 0.60), (-3.27, 0.33)],
            [0, 0.10, 1.2, 0.5, 0.24, 0.16, 1.2, 0.12, 0], step=22, longest=3.0)
R_EDGE = 0.17

SIDE = (0, 0, 1024, 240)
STRIP = (0, 242, 1024, 130)
S_FRONT, S_REAR = O.near(8.20, TOP), O.near(-3.10, TOP)
ZX, SY = even(8.72, -3.40, SIDE[2])[::-1], even(3.10, 0.27, SIDE[3])
SX, TY = knots([0.0, S_FRONT, S_REAR, O.length], [300, 424, 300]), even(1.40, -0.04, STRIP[3])

BELT, HEAD_Y = 1.22, 2.50
BAND = round_poly([(-2.75, BELT), (7.62, BELT), (8.10, 1.02), (8.02, HEAD_Y), (-2.75, HEAD_Y)],
                  [0.12, 0.2, 0.12, 0.10, 0.12])
PANES = [(-2.68, -1.42), (-1.36, 0.16), (0.22, 1.74), (1.80, 3.32), (3.38, 4.90), (4.96, 6.48), (6.54, 7.55)]
DOORS = [(7.02, 8.28), (2.22, 3.60)]
DOOR_Y = (0.36, 2.52)
S_SCREEN = (O.find(1.06), O.find(2.72))
SCREEN = np.array([(0.0, S_SCREEN[0]), (0.95, S_SCREEN[0] + 0.02), (1.08, S_SCREEN[0] + 0.12),
                   (1.09, S_SCREEN[1] - 0.1), (1.04, S_SCREEN[1]), (0.0, S_SCREEN[1])])
S_BACK = (O.find(2.52, False), O.find(1.62, False))
BACK = np.array([(0.0, S_BACK[0]), (0.88, S_BACK[0]), (0.94, S_BACK[0] + 0.06), (0.94, S_BACK[1] - 0.06),
                 (0.88, S_BACK[1]), (0.0, S_BACK[1])])


def deform(p):
    x, y, z = p[..., 0], p[..., 1], p[..., 2]
    q = (x / HX) ** 2
    w = (1 - 0.035 * np.clip((y - 1.0) / 2.0, 0, 1) - 0.015 * smooth(0.6, 0.3, y) - 0.035 * smooth(7.2, NOSE, z) ** 1.5
         - 0.012 * smooth(-2.6, END, z))
    nz = z - 0.24 * q ** 1.3 * smooth(7.0, NOSE, z) + 0.07 * q * smooth(-2.4, END, z)
    ny = y + 0.035 * (1 - q) * smooth(2.6, 3.0, y)
    return np.stack([x * w, ny, nz], -1)


def draw_side(atlas):
    c = Canvas(atlas, SIDE, ZX, SY, 1000, rough=0.27)
    Z, Y = c.x, c.y
    for z in np.arange(-2.05, 7.9, 1.02):                                    # skirt flaps
        if min(abs(z - a) for a in (0, FRONT)) > 0.72:
            c.line(np.where(Y < 0.86, Z - z, 1))
    c.line(Y - 0.86)
    c.ridge(Y - 1.05, 0.010, 0.05)
    c.ridge(Y - 0.99, -0.006, 0.04)
    c.line(Y - 2.66, 0.008, 0.008)
    c.fill(Y - 0.37, '222324', 0.7)
    c.line(seg_dist(np.array([(8.02, 0.3), (8.02, 1.0)]), Z, Y, False))
    for k in range(6):                                                       # engine louvres
        c.fill(rr(Z, Y, -2.45, 1.02 - 0.07 * k - 0.06, 0.40, 0.018, 0.015), '101011', 0.6)
    for az in (0, FRONT):
        d = np.hypot(Z - az, Y - HUB) - ARCH
        c.raise_(np.abs(d - 0.03) - 0.05, 0.012, 0.02)
        c.gap = np.maximum(c.gap, 0.5 * smooth(0.03, 0.0, np.abs(d)))
    d = poly_sdf(BAND, Z, Y)
    seats = np.full_like(Z, 1.0)
    for z in np.arange(-2.3, 6.8, 0.78):
        seats = np.minimum(seats, rr(Z, Y, z, 1.35, 0.07, 0.30, 0.07))
    c.glass(d, BELT, HEAD_Y, seats, rim=0.03)
    for a, b in PANES:
        c.fill(np.maximum(np.minimum(np.abs(Z - a + 0.03), np.abs(Z - b - 0.03)) - 0.03, d), '0c0d0e', 0.3, 0)
        if b - a > 1.3:                                                      # sliding upper light
            c.fill(np.maximum(np.abs(Y - 2.16) - 0.012, np.abs(Z - (a + b) / 2) - (b - a) / 2), '151617', 0.4)
    spray = sum(smooth(0.30, 0.0, np.hypot((Z - az + 0.15) / 1.3, Y - HUB) - ARCH) for az in (0, FRONT))
    c.weather(np.clip(0.9 * smooth(0.85, 0.25, Y) + 0.5 * spray * smooth(1.2, 0.4, Y), 0, 1), 0.55)
    c.put()


def draw_strip(atlas):
    c = Canvas(atlas, STRIP, SX, TY, 1020, rough=0.27)
    S, T = c.x, c.y
    at = lambda y, front=True: O.find(y, front)
    # face: bumper, flap with a badge, wide grille low down
    c.line(S - at(0.56))
    c.line(np.where(T < 1.0, S - at(0.98), 1))
    c.grille(rr(S, T, at(0.46), 0, 0.06, 0.62, 0.04), 0.05)
    c.fill(S - at(0.35), '1b1c1d', 0.7)
    c.fill(rr(S, T, at(0.74), 0.98, 0.13, 0.34, 0.06), '111213', 0.3, 0, flat=True)
    badge = rr(S, T, at(0.80), 0, 0.035, 0.16, 0.03)
    c.fill(badge, 'c9cbcc', 0.2, 1)
    c.raise_(badge, 0.008)
    c.fill(np.maximum(np.abs(S - S_SCREEN[1] - 0.02) - 0.30, T - 1.12), '0d0e0f', 0.15, 0, flat=True)      # sign box
    d = poly_sdf(np.concatenate([SCREEN, SCREEN[::-1] * (-1, 1)]), T, S)
    c.fill(d - 0.01, '0d0e0f', 0.3, 0)
    c.glass(d, 0, 1, rim=0.03)
    k = smooth(S_SCREEN[0], S_SCREEN[1], S)
    c.base = mix(c.base, mix(rgb('090c0e'), rgb('232c32'), k), c.soft(d + 0.04))
    # roof: hatches' seams and gutters
    roof = (S > S_FRONT) & (S < S_REAR)
    c.line(np.where(roof, T - 1.02, 1), 0.012, 0.008)
    for s in np.linspace(S_FRONT + 0.4, S_REAR - 0.3, 7):
        c.ridge(np.where(T < 1.1, S - s, 1), 0.006, 0.05)
    # rear: window, engine flap with louvres, bumper, lamp column
    d = poly_sdf(np.concatenate([BACK, BACK[::-1] * (-1, 1)]), T, S)
    c.fill(d - 0.01, '0d0e0f', 0.3, 0)
    c.glass(d, 0, 1, rim=0.03)
    flap = rr(S, T, (at(1.45, False) + at(0.66, False)) / 2, 0, 0.40, 0.86, 0.05)
    c.line(flap)
    c.grille(rr(S, T, at(1.18, False), 0, 0.20, 0.62, 0.03), 0.07, color='0e0e0f', bar='2b2c2d', metal=0.1)
    c.line(np.where(S > S_REAR, S - at(0.58, False), 1))
    c.fill(np.where(S > S_REAR, rr(S, T, at(0.45, False), 0, 0.05, 1.0, 0.03), 1), '1d1e1f', 0.7)
    c.fill(np.where(S > S_REAR, rr(S, T, at(1.12, False), 1.055, 0.46, 0.125, 0.04), 1), '111213', 0.3, 0, flat=True)
    low = np.maximum(smooth(0.7, 0.0, S), smooth(O.length - 1.6, O.length, S))
    c.weather(np.clip(0.85 * low, 0, 1), 0.5)
    c.put()


def draw_door(atlas, x, y, w=76, h=128):
    """A pair of glazed door leaves, 1.3 by 2.2 m."""
    c = Canvas(atlas, (x, y, w, h), even(-0.66, 0.66, w), even(2.2, 0.0, h), 1040, coat='141516', rough=0.35)
    c.line(c.x, 0.02)
    for sx in (-1, 1):
        d = rr(c.x, c.y, sx * 0.32, 1.17, 0.26, 0.93, 0.08)
        c.glass(d, 0.3, 2.1, rim=0.02)
        rail = rr(c.x, c.y, sx * 0.09, 1.1, 0.016, 0.55, 0.015)
        c.fill(rail, 'd2a520', 0.3)
    c.weather(0.6 * smooth(0.5, 0.0, c.y), 0.5)
    c.put()
    atlas.uv['door'] = atlas.rect(x, y, w, h)


def draw_interior(atlas, x, y, w=430, h=86):
    """What the lit windows show: warm light from above, seats, people, a standing one here and there. It mirrors like
    metal, so that by day it is dark glass."""
    u, v = np.meshgrid(even(PANES[0][0], DOORS[0][1], w), even(HEAD_Y, BELT, h))
    light = 0.32 + 0.30 * smooth(1.3, 2.45, v) + 0.22 * np.exp(-((v - 2.38) / 0.06) ** 2)
    col = rgb('ffdca4') * light[..., None]
    r = tx.rng(1060)
    shade = np.full_like(u, 1.0)
    people = np.full_like(u, 1.0)
    for z in np.arange(-2.35, 7.0, 0.78):
        shade = np.minimum(shade, rr(u, v, z, 1.32, 0.085, 0.36, 0.07))      # seat backs
        if r.random() < 0.55:
            lean = 0.04 * r.standard_normal()
            tall = 0.06 * r.standard_normal()
            people = np.minimum(people, np.hypot((u - z - 0.19 - lean) / 0.085, (v - 1.80 - tall) / 0.12) - 1)
            people = np.minimum(people, rr(u, v, z + 0.20, 1.42 + tall, 0.17, 0.28, 0.12))
    for z in (0.9, 2.7, 4.35):                                               # standing
        z = z + 0.3 * r.standard_normal()
        people = np.minimum(people, np.hypot((u - z) / 0.09, (v - 2.16) / 0.13) - 1)
        people = np.minimum(people, rr(u, v, z, 1.62, 0.20, 0.44, 0.14))
        people = np.minimum(people, rr(u, v, z + 0.24, 2.1, 0.035, 0.30, 0.03))
    for z in np.arange(-1.0, 7.0, 1.6):                                      # grab poles
        col = mix(col, rgb('8a5a1c'), 0.8 * smooth(0.03, 0.01, np.abs(u - z)))
    col = mix(col, rgb('4a2a1c'), smooth(0.03, -0.03, shade))
    tint = 0.75 + 0.5 * tx.noise(512, 1061, beta=1.0, lo=6, hi=40)[:h, :w]
    col = mix(col, rgb('2c1a14') * np.clip(tint, 0.5, 1.6)[..., None], smooth(0.10, -0.10, people))
    atlas.put(x, y, col, 0.08, 1.0, name='interior')


def draw_sign(atlas, x, y, text, w=200, h=34):
    im = Image.new('RGB', (w * 4, h * 4), (13, 14, 15))
    d = ImageDraw.Draw(im)
    d.text((w * 2, h * 2), text, fill=(255, 176, 44), font=ImageFont.load_default(104), anchor='mm')
    a = np.asarray(im.resize((w, h), Image.LANCZOS)) / 255.0
    atlas.put(x, y, a, 0.12, 0.0, name='sign')


def panes(shell, atlas, side):
    """The windows of one flank as the mesh that can be lit; `side` 1 left, -1 right (where doors are)."""
    x, y, w, h = atlas.uv['interior']
    z0 = PANES[0][0]
    spans = [(a + 0.02, b - 0.02, BELT + 0.05, HEAD_Y - 0.06, 0.006) for a, b in PANES]
    if side < 0:
        for door in DOORS:                                   # what the doors leave of each pane
            rest = []
            for a, b, *more in spans:
                rest += [(lo, hi, *more) for lo, hi in ((a, min(b, door[0] - 0.05)), (max(a, door[1] + 0.05), b))
                         if hi - lo > 0.1]
            spans = rest
        spans += [(a + k * (b - a) / 2 + 0.14, a + (k + 1) * (b - a) / 2 - 0.14, 0.62, 2.35, 0.026) for a, b in DOORS
                  for k in (0, 1)]
    parts = []
    for a, b, lo, hi, lift in spans:
        zz, yy = np.meshgrid([a, b], [lo, (lo + hi) / 2, hi])
        P, N = shell.on_side(zz.ravel(), yy.ravel(), lift)
        uv = np.stack([x + w * (0.01 + 0.98 * (zz.ravel() - z0) / (DOORS[0][1] - z0)),
                       y + h * np.clip((HEAD_Y - yy.ravel()) / (HEAD_Y - BELT + 0.5 * (lift > 0.01)), 0.01, 0.99)], 1)
        F = np.array([(0, 1, 3), (0, 3, 2), (2, 3, 5), (2, 5, 4)])
        parts.append(Part(P, N, uv, outward(P, N, F)))
    part = merge(*parts)
    return part if side > 0 else mirror_x(part)


def sign(shell, uv):
    """The destination over the windscreen."""
    s0, s1 = S_SCREEN[1] - 0.19, S_SCREEN[1] + 0.12
    return shell.patch([(-0.85, s0), (0.85, s0), (0.85, s1), (-0.85, s1)], uv['sign'], lift=0.030, skirt=0.0, fine=0.38)


def details(shell, uv, atlas):
    paint, trim = [], []
    for a, b in DOORS:
        loop = [(a, DOOR_Y[0]), (b, DOOR_Y[0]), (b, DOOR_Y[1]), (a, DOOR_Y[1])]
        trim.append(mirror_x(shell.patch(loop, uv['door'], 'side', lift=0.018, skirt=0.02, fine=0.9)))
    for sx in (1, -1):                                                       # mirrors on arms before the corners
        P, _ = shell.on_strip(sx * 1.20, O.find(2.60))
        m = P[0] + (sx * 0.20, -0.35, 0.30)
        arm = tube([P[0] + (-sx * 0.03, 0.06, -0.05), P[0] + (sx * 0.10, 0.09, 0.20), m + (0, 0.27, -0.02),
                    m + (0, 0.10, 0)], 0.022, 6)
        trim.append(arm.swatch(*uv['plastic']))
        trim.append(box(0.20, 0.40, 0.10, 0.04).move(*m).swatch(*uv['plastic']))
        trim.append(on_rect(box(0.165, 0.35, 0.008), uv['mirror'], flip=True).move(m[0], m[1], m[2] - 0.05))
    for x0, x1 in ((-1.0, -0.08), (-0.02, 0.9)):
        s = S_SCREEN[0] + 0.06
        P, _ = shell.on_strip(np.array([x0, (x0 + x1) / 2, x1]), np.array([s, s + 0.012, s + 0.05]), 0.02)
        trim.append(tube(P, 0.012, 4, caps=False).swatch(*uv['plastic']))
    top = TOP + 0.035
    for z, dz, hx in ((4.6, 1.3, 0.80), (-1.6, 1.9, 0.85)):                  # air conditioning, roof pod
        paint.append(box(2 * hx, 0.26, dz, 0.10).move(0, top + 0.06, z).swatch(*uv['coat']))
    paint.append(box(0.75, 0.08, 0.75).move(0, top, 1.4).swatch(*uv['coat']))
    P, _ = shell.on_strip(0.0, O.find(0.58))
    trim.append(plate(atlas, P[0] + (0, 0.0, 0.012)))
    P, _ = shell.on_strip(0.0, O.find(0.76, False))
    trim.append(plate(atlas, P[0] + (0, 0, -0.012), True))
    # Floor, narrow between the wheels.
    for sx, sz, z in ((1.2, 11.3, 2.65), (2.2, 4.6, 2.95), (2.2, 1.9, 7.45), (2.2, 2.6, -1.95)):
        trim.append(box(sx, 0.06, sz).move(0, 0.37 - 0.005 * sx, z).swatch(*uv['under']))
    return paint, trim


def lamps(v, shell, uv):
    s = O.find(0.74)
    head = round_poly([(0.70, s - 0.085), (0.98, s - 0.085), (0.98, s + 0.085), (0.70, s + 0.085)], 0.05)
    v.lamps('lamp_head', shell.patch(head, uv['glass_clear'], lift=0.012, dome=0.03, fine=0.3), 'glass_clear', HEAD)
    e = 1.29
    amber = round_poly([(1.02, s - 0.07), (e, s - 0.07), (e, s + 0.07), (1.02, s + 0.07)], 0.03)
    v.lamps('lamp_indicator_front', shell.patch(amber, uv['glass_amber'], lift=0.012, dome=0.015, fine=0.3),
            'glass_amber', tilted(0, 1, 19))
    for name, kind, y0, y1, way in (('lamp_tail', 'glass_red', 1.50, 1.12, TAIL),
                                    ('lamp_indicator_rear', 'glass_amber', 1.09, 0.90, tilted(0, -1, 19)),
                                    ('lamp_reverse', 'glass_clear', 0.87, 0.72, TAIL)):
        a, b = O.find(y0, False), O.find(y1, False)
        loop = round_poly([(0.955, a), (1.155, a), (1.155, b), (0.955, b)], 0.03)
        v.lamps(name, shell.patch(loop, uv[kind], lift=0.012, dome=0.015, fine=0.3), kind, way)


def build(out):
    atlas = Atlas(1024, 512)
    draw_side(atlas)
    draw_strip(atlas)
    furniture(atlas, 0, 378, 'truck', 'RL 512', 1050)
    atlas.swatch('coat', 166 + 24 * 13, 378 + 92, 'e6e6e3', 0.30)
    draw_door(atlas, 514, 378)
    draw_sign(atlas, 592, 376, '7  HARBOUR')
    draw_interior(atlas, 592, 416)
    uv = atlas.uv
    shell = Shell(O, HX, lambda p: np.full(p.shape[:-1], R_EDGE), deform, chart(SIDE, atlas, ZX, SY),
                  chart(STRIP, atlas, SX, TY), 3)
    arches = [arch_loop(az, HUB, ARCH) for az in (0, FRONT)]
    side, glass = shell.side([-2.95, -1.6, 1.6, 3.0, 4.4, 6.8, 7.5, 7.9, 8.25], [0.7, 1.0, 1.85, 2.68], [BAND], arches)
    top, screens = shell.strip([0, 0.4, 0.75], [SCREEN, BACK])
    paint = both(side) + both(top) + both(shell.edge())
    trim = [m for p in glass + screens for m in both(p)]
    for az in (0, FRONT):
        lip, tub = shell.arch(az, HUB, ARCH, SILL, 0.62, uv['plastic'], uv['under'], 12, 0.010)
        trim += both(lip) + both(tub)
    p, t = details(shell, uv, atlas)
    v = Vehicle('bus', atlas, (0.66, 0.30, 0.025))
    v.body(paint + p, trim + t, (-0.3, 2.7, 5.7))
    v.wheels(heavy_wheel(atlas, HUB, 0.28, 0.285, 18), {'wheel_front': (TRACK, HUB, FRONT)})
    double = v.g.mesh('wheel_double', [(double_wheel(atlas, HUB, 0.27, 0.285, 18), v.trim)])
    v.more_wheels(double, {'wheel_rear': (REAR_TRACK, HUB, 0)})
    lamps(v, shell, uv)
    inside = v.g.material('glass_interior', *v.images, occlusion=False)
    v.g.node('lamp_interior',
             v.g.mesh('lamp_interior', [(merge(panes(shell, atlas, 1), panes(shell, atlas, -1), sign(shell, uv)),
                                         inside)]), parent=v.root)
    v.g.save(out)


if __name__ == '__main__':
    here = os.path.dirname(os.path.abspath(__file__))
    build(os.path.join(here, '..', 'models', 'vehicle_bus.glb'))
