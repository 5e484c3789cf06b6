"""The truck: a tractor with its cab over the engine, and a curtain-sided semi-trailer, of our own design."""

import os
from vehiclelib import *

HX, HUB, FRONT, HITCH = 1.25, 0.50, 3.70, 0.55
TRACK, REAR_TRACK, ARCH, SILL = 1.03, 0.925, 0.60, 0.58
NOSE, BACK_Z = 5.10, 2.86
CAB = Outline([(4.98, 0.44), (NOSE, 0.60), (NOSE, 1.55), (4.98, 2.78), (4.66, 3.20), (3.70, 3.64), (BACK_Z, 3.66),
               (BACK_Z - 0.02, 0.62)],
              [0, 0.10, 1.4, 0.5, 0.6, 0.8, 0.12, 0], step=28, longest=0.9)
# the trailer, seen from its hitch: 13.6 m long
T0, T1, FLOOR, ROOF = 1.60, -12.00, 1.16, 3.98
AXLES = (-6.39, -7.70, -9.01)
BOX = Outline([(T0, FLOOR), (T0, ROOF), (T1, ROOF), (T1, FLOOR)], [0, 0.05, 0.05, 0], step=45, longest=7.0)

TRAILER_SIDE, CAB_SIDE, CAB_STRIP, TRAILER_STRIP = (
    (0, 0, 1024, 160), (0, 162, 240, 218), (242, 162, 420, 218), (664, 162, 360, 218))
TZ, TY_ = even(T0 + 0.05, T1 - 0.05, 1024)[::-1], even(ROOF + 0.02, FLOOR - 0.04, 160)
CZ, CY_ = even(NOSE + 0.05, BACK_Z - 0.06, 240)[::-1], even(3.70, 0.40, 218)
S_TOP, S_BACK = CAB.near(4.70, 3.15), CAB.near(BACK_Z, 3.55)
CS, CT = knots([0, S_TOP, S_BACK, CAB.length], [280, 70, 70]), even(1.38, -0.04, 218)
B_ROOF, B_REAR = BOX.near(T0, ROOF), BOX.near(T1, ROOF - 0.02)
BS, BT = knots([0, B_ROOF, B_REAR, BOX.length], [50, 60, 250]), even(1.32, -0.04, 218)

WINDOW = round_poly([(3.56, 1.82), (4.30, 1.74), (4.80, 1.58), (4.70, 2.42), (4.58, 2.66), (3.56, 2.66)],
                    [0.06, 0.3, 0.08, 0.3, 0.10, 0.06])
GRILLE = np.array([(0.0, CAB.find(1.0)), (0.74, CAB.find(1.0)), (0.80, CAB.find(1.06)), (0.80, CAB.find(1.54)),
                   (0.74, CAB.find(1.595)), (0.0, CAB.find(1.595))])
S_SCREEN = (CAB.find(1.66), CAB.find(2.74))
SCREEN = np.array([(0.0, S_SCREEN[0]), (0.92, S_SCREEN[0] + 0.02), (1.06, S_SCREEN[0] + 0.10),
                   (1.06, S_SCREEN[1] - 0.1), (1.02, S_SCREEN[1]), (0.0, S_SCREEN[1])])


def deform(p):
    x, y, z = p[..., 0], p[..., 1], p[..., 2]
    q = (x / HX) ** 2
    w = (1 - 0.05 * np.clip((y - 1.5) / 1.8, 0, 1.2) - 0.045 * smooth(4.3, NOSE, z) ** 1.5
         - 0.10 * smooth(2.75, 3.66, y) * smooth(2.9, 4.6, z))
    nz = z - 0.27 * q ** 1.3 * smooth(4.2, NOSE, z)
    ny = y + 0.05 * (1 - q) * smooth(3.0, 3.5, y)
    return np.stack([x * w, ny, nz], -1)


def draw_cab_side(atlas):
    c = Canvas(atlas, CAB_SIDE, CZ, CY_, 1100, rough=0.25)
    Z, Y = c.x, c.y
    door = round_poly([(3.47, 1.22), (4.40, 1.22), (4.86, 1.45), (4.74, 2.74), (3.47, 2.74)],
                      [0.06, 0.12, 0.1, 0.12, 0.06])
    c.line(seg_dist(door, Z, Y), 0.009)
    c.ridge(Y - 1.52 + 0.10 * (4.4 - Z), 0.014, 0.05)
    c.line(np.where(Z < 3.47, Y - 1.20, 1), 0.008)
    c.line(np.where(Z > 4.45, Y - 1.02, 1), 0.008)
    c.line(np.where(Y < 1.2, Z - 3.02, 1), 0.008)
    for y in (0.66, 0.92):                                                  # steps in the fairing behind the wheel
        c.fill(rr(Z, Y, 4.72, y, 0.17, 0.075, 0.04), '0e0e0f', 0.6)
    c.raise_(rr(Z, Y, 3.66, 1.64, 0.085, 0.035, 0.03), -0.015, 0.012)
    c.fill(rr(Z, Y, 3.66, 1.65, 0.075, 0.014, 0.01), '17181a', 0.4)
    c.raise_(rr(Z, Y, 3.15, 2.2, 0.17, 0.55, 0.08), -0.02, 0.02)
    d = np.hypot(Z - FRONT, Y - HUB) - ARCH
    c.raise_(np.abs(d - 0.03) - 0.05, 0.014, 0.02)
    c.fill(Y - 0.50, '1c1d1e', 0.7)
    d = poly_sdf(WINDOW, Z, Y)
    c.glass(d, 1.6, 2.66, np.minimum(rr(Z, Y, 3.85, 2.05, 0.11, 0.32, 0.06), np.hypot(Z - 4.25, (Y - 1.80)) - 0.17),
            rim=0.03)
    c.fill(np.maximum(np.abs(Z - 4.48 - 0.12 * (2.2 - Y)) - 0.014, d), '0d0d0e', 0.4)
    c.weather(np.clip(0.9 * smooth(1.1, 0.45, Y), 0, 1), 0.55)
    c.put()


def draw_cab_strip(atlas):
    c = Canvas(atlas, CAB_STRIP, CS, CT, 1120, rough=0.25)
    S, T = c.x, c.y
    at = CAB.find
    face = rr(S, T, (at(0.92) + at(1.60)) / 2, 0, (at(1.60) - at(0.92)) / 2, 0.86, 0.08)
    c.line(face, 0.009)
    c.fill(poly_sdf(np.concatenate([GRILLE, GRILLE[::-1] * (-1, 1)]), T, S) - 0.01, '1a1b1c', 0.45, 0, flat=True)
    c.grille(rr(S, T, at(1.27), 0, 0.24, 0.74, 0.06), 0.085, bar='3c3e40', metal=0.5)
    c.fill(np.maximum(np.abs(S - at(1.27)) - 0.012, T - 0.72), 'c2c4c6', 0.2, 1)
    badge = rr(S, T, at(1.55), 0, 0.04, 0.22, 0.03)
    c.fill(badge, 'cfd1d2', 0.2, 1)
    c.raise_(badge, 0.008)
    c.line(S - at(0.92), 0.008)
    c.grille(rr(S, T, at(0.76), 0, 0.085, 0.60, 0.05), 0.06, bar='2a2b2c', metal=0.1)
    c.fill(rr(S, T, at(0.745), 0.98, 0.135, 0.34, 0.06), '0f1011', 0.3, 0, flat=True)
    c.fill(S - at(0.52), '191a1b', 0.7)
    d = poly_sdf(np.concatenate([SCREEN, SCREEN[::-1] * (-1, 1)]), T, S)
    c.fill(d - 0.012, '0d0e0f', 0.3, 0)
    c.glass(d, 0, 1, rim=0.03)
    k = smooth(S_SCREEN[0], S_SCREEN[1], S)
    c.base = mix(c.base, mix(rgb('080b0d'), rgb('222b31'), k), c.soft(d + 0.04))
    c.line(np.where(T < 1.1, S - at(2.98), 1), 0.010)
    c.raise_(rr(S, T, at(3.38), 0, 0.14, 0.55, 0.10), 0.02, 0.03)
    for tt in (0.30, 0.80):                                                 # marker lamps
        c.fill(rr(S, T, at(3.02), tt, 0.018, 0.055, 0.015), 'd98a20', 0.15, flat=True)
    c.ridge(np.where(S > S_BACK, np.abs(T - 0.5) - 0.2, 1), 0.01, 0.06)
    c.weather(np.clip(0.9 * smooth(0.6, 0.0, S) + 0.5 * (S > S_BACK), 0, 1), 0.55)
    c.put()


def draw_trailer_side(atlas):
    """A curtain: folds hanging from the rail, straps with buckles, a name in large letters."""
    c = Canvas(atlas, TRAILER_SIDE, TZ, TY_, 1140, coat='d9d5c6', rough=0.55)
    Z, Y = c.x, c.y
    wave = tx.noise(512, 1141, beta=1.3, lo=3, hi=40, ax=1.0, ay=0.03)[:160, :512]
    wave = np.concatenate([wave, wave[:, ::-1]], 1)
    cloth = (Y > FLOOR + 0.14) & (Y < ROOF - 0.13)
    straps = np.arange(T1 + 0.55, T0 - 0.3, 0.62)
    near = np.min([np.abs(Z - s) for s in straps], 0)
    c.h += np.where(cloth, 0.004 * wave * smooth(ROOF - 0.1, FLOOR + 0.6, Y) - 0.012 * np.exp(-(near / 0.05) ** 2)
                    + 0.012 * smooth(0.31, 0.12, np.abs(near - 0.31)), 0)
    # Three slanting bands, and one along the foot.
    slant = Z + 0.9 * (Y - 2.5)
    for z, width, color in ((-3.2, 0.85, 'a8341f'), (-4.55, 0.34, 'd08a2c'), (-5.25, 0.17, '23405c')):
        c.fill(np.abs(slant - z) - width, color, 0.5)
    c.fill(np.abs(Y - 1.52) - 0.13, '23405c', 0.5)
    c.base = c.base * (1 + 0.02 * np.where(cloth, wave, 0))[..., None]
    c.fill(np.where(Y < ROOF - 0.13, near - 0.020, 1), 'b9bab8', 0.6)
    c.raise_(np.where(Y < ROOF - 0.13, near - 0.020, 1), 0.004)
    c.fill(np.where(Y < FLOOR + 0.30, np.maximum(near - 0.028, np.abs(Y - FLOOR - 0.22) - 0.06), 1), '6d7072', 0.4, 0.8)
    for lo, hi in ((FLOOR - 0.1, FLOOR + 0.12), (ROOF - 0.11, ROOF + 0.1)):  # rails
        c.fill(np.abs(Y - (lo + hi) / 2) - (hi - lo) / 2, '8e9193', 0.4, 0.7, flat=True)
        c.line(Y - (lo if hi > 3 else hi), 0.01)
    for z in (T0 - 0.06, T1 + 0.06):
        c.fill(np.abs(Z - z) - 0.075, '8e9193', 0.4, 0.7, flat=True)
    for z in np.arange(T1 + 0.8, T0, 2.4):                                   # side markers
        c.fill(rr(Z, Y, z, FLOOR + 0.03, 0.06, 0.025, 0.02), 'e08a1e', 0.15)
    c.weather(np.clip(0.6 * smooth(2.3, FLOOR, Y) + 0.12, 0, 1), 0.8)
    c.put()


def draw_trailer_strip(atlas):
    c = Canvas(atlas, TRAILER_STRIP, BS, BT, 1160, coat='dfdfdb', rough=0.45)
    S, T = c.x, c.y
    at = lambda y: BOX.find(y, False)
    rear = S > B_REAR
    c.line(np.where(rear, T, 1), 0.02)
    c.line(np.where(rear, T - 1.17, 1), 0.014)
    c.fill(np.where(rear, 1.18 - T, 1), '8e9193', 0.4, 0.7)
    for tt in (0.38, 0.85):                                                  # locking bars with handles and guides
        c.fill(np.where(rear, np.abs(T - tt) - 0.020, 1), 'a5a8aa', 0.35, 0.9)
        c.ridge(np.where(rear, T - tt, 1), 0.03, 0.03)
        for y in (1.30, 1.75, 2.55, 3.35, 3.85):
            c.fill(rr(S, T, at(y), tt, 0.035, 0.055, 0.015), '8b8e90', 0.45, 0.8)
        c.fill(rr(S, T, at(1.62), tt - 0.14, 0.018, 0.15, 0.015), '777a7c', 0.4, 0.9)
    for y in (1.45, 2.15, 2.95, 3.65):                                       # hinges
        c.fill(rr(S, T, at(y), 1.16, 0.06, 0.07, 0.02), '8b8e90', 0.5, 0.7)
    chevron = np.where(rear, np.abs(S - at(1.26)) - 0.045, 1)                # reflecting board
    c.fill(np.maximum(chevron, np.abs(T - 0.62) - 0.17), 'd9b21a', 0.35)
    c.fill(np.maximum(np.maximum(chevron, np.abs(T - 0.62) - 0.17), np.abs((T * 9 + S * 9) % 1 - 0.5) - 0.22), 'b01d14',
           0.35)
    c.weather(np.clip(np.where(rear, 0.9 * smooth(BOX.length - 1.3, BOX.length, S) + 0.1, 0.1), 0, 1), 0.9)
    c.put()


def straight(p):
    return p


def chassis(uv):
    parts = []
    for sx in (1, -1):
        parts.append(box(0.09, 0.27, 5.5).move(sx * 0.40, 0.86, 2.05).swatch(*uv['under']))
        tank = lathe([(0.0, -0.62), (0.27, -0.62), (0.31, -0.58), (0.31, 0.58), (0.27, 0.62), (0.0, 0.62)], 12,
                     40).rot('x', 90)
        parts.append(tank.move(sx * 0.86, 0.72, 1.62).swatch(*uv['steel']))
        for z in (1.25, 1.99):
            parts.append(lathe([(0.316, -0.03), (0.316, 0.03)], 12,
                               40).rot('x', 90).move(sx * 0.86, 0.72, z).swatch(*uv['plastic']))
        a = np.radians(np.linspace(15, 165, 9))                              # mudguards of the driven wheels
        ring = np.stack([0.60 * np.cos(a), HUB + 0.02 + 0.60 * np.sin(a)], 1)
        for r, flip in ((1.0, False), (0.97, True)):
            P = np.array([(x, HUB + (y - HUB) * r, z * r) for z, y in ring for x in (sx * 0.62, sx * 1.24)])
            F = [t for i in range(8) for t in ((2 * i, 2 * i + 1, 2 * i + 3), (2 * i, 2 * i + 3, 2 * i + 2))]
            out = P - (0, HUB, 0)
            out[:, 0] = 0
            N = out / np.linalg.norm(out, axis=1, keepdims=True) * (-1 if flip else 1)
            parts.append(Part(P, N, np.zeros((len(P), 2)), outward(P, N, np.array(F))).swatch(*uv['plastic']))
    parts.append(box(0.95, 0.16, 0.10).move(0, 0.92, -0.72).swatch(*uv['under']))
    parts.append(tube([(-0.9, HUB, 0), (0.9, HUB, 0)], 0.09, 6, caps=False).swatch(*uv['under']))
    parts.append(tube([(-0.9, HUB, FRONT), (0.9, HUB, FRONT)], 0.06, 5, caps=False).swatch(*uv['under']))
    parts.append(lathe([(0.0, 1.02), (0.48, 1.05), (0.50, 1.10), (0.46, 1.13), (0.0, 1.13)], 14,
                       40).move(0, 0, HITCH).swatch(*uv['steel']))
    # Intake and hoses.
    parts.append(box(2.1, 0.9, 0.30, 0.03).move(0, 1.25, 2.64).swatch(*uv['plastic']))
    parts.append(box(1.15, 0.5, 1.9).move(0, 0.75, 3.9).swatch(*uv['under']))
    for x in (-0.35, 0.0, 0.35):
        parts.append(tube([(x, 1.6, 2.50), (x * 0.7, 1.35, 2.30), (x * 0.6, 1.5, 2.18)], 0.022, 4,
                          caps=False).swatch(*uv['dark_red' if x else 'plastic']))
    return parts


def cab_details(shell, uv, atlas):
    trim = []
    for sx in (1, -1):
        P, _ = shell.on_strip(sx * 1.21, CAB.find(2.45))
        m = P[0] + (sx * 0.20, -0.12, 0.02)
        trim.append(tube([P[0] + (-sx * 0.05, 0.16, -0.1), m + (0, 0.34, 0.02)], 0.025, 5).swatch(*uv['plastic']))
        trim.append(box(0.24, 0.62, 0.13, 0.045).move(*m).swatch(*uv['plastic']))
        trim.append(on_rect(box(0.19, 0.34, 0.008), uv['mirror'], flip=True).move(m[0], m[1] + 0.10, m[2] - 0.064))
        trim.append(on_rect(box(0.19, 0.17, 0.008), uv['mirror'], flip=True).move(m[0], m[1] - 0.20, m[2] - 0.064))
    t = np.linspace(-1.08, 1.08, 7)                                          # sun visor
    s = CAB.find(2.80)
    P, N = shell.on_strip(t, np.full(7, s), 0.02)
    Q, _ = shell.on_strip(t, np.full(7, s - 0.16), 0.20)
    for top, bottom, lift in ((P, Q, 0.0), (Q, P, -0.012)):
        V = np.concatenate([top + (0, lift, 0), bottom + (0, lift, 0)])
        F = np.array([f for i in range(6) for f in ((i, i + 1, 8 + i), (i, 8 + i, 7 + i))])
        fn = np.cross(V[F[0, 1]] - V[F[0, 0]], V[F[0, 2]] - V[F[0, 0]])
        up = 1 if lift == 0 else -1
        trim.append(creased(V, np.zeros((14, 2)), F if fn[1] * up > 0 else F[:, ::-1], 60).swatch(*uv['gloss']))
    for x0, x1 in ((-0.95, -0.10), (-0.05, 0.80)):
        s = S_SCREEN[0] + 0.05
        P, _ = shell.on_strip(np.array([x0, (x0 + x1) / 2, x1]), np.array([s, s + 0.012, s + 0.05]), 0.02)
        trim.append(tube(P, 0.012, 4, caps=False).swatch(*uv['plastic']))
    P, _ = shell.on_strip(0.0, CAB.find(0.60))
    trim.append(plate(atlas, P[0] + (0, 0, 0.012)))
    return trim


def trailer_frame(uv, atlas):
    parts = []
    for sx in (1, -1):
        parts.append(box(0.10, 0.30, 12.6).move(sx * 0.45, 1.0, -5.5).swatch(*uv['under']))
        parts.append(box(0.14, 0.75, 0.16).move(sx * 0.75, 0.62, -2.5).swatch(*uv['grey']))               # landing legs
        parts.append(box(0.30, 0.04, 0.30).move(sx * 0.75, 0.24, -2.5).swatch(*uv['grey']))
        for y in (0.62, 0.88):                                                                           # side guards
            parts.append(box(0.03, 0.11, 2.7).move(sx * 1.20, y, -4.35).swatch(*uv['alloy']))
        for z in (-3.2, -4.35, -5.5):
            parts.append(box(0.04, 0.60, 0.06).move(sx * 1.16, 0.86, z).swatch(*uv['grey']))
        parts.append(box(0.42, 0.42, 0.02).move(sx * 1.02, 0.62, -9.75).swatch(*uv['rubber']))             # flaps
        parts.append(box(0.40, 0.035, 4.1).move(sx * 1.03, 1.09, -7.7).swatch(*uv['plastic']))             # mudguards
        parts.append(box(0.09, 0.40, 0.09).move(sx * 0.55, 0.80, -11.82).swatch(*uv['under']))
    for z in AXLES:
        parts.append(tube([(-0.95, HUB, z), (0.95, HUB, z)], 0.07, 6, caps=False).swatch(*uv['under']))
    parts.append(box(1.0, 0.12, 2.4).move(0, 1.10, 0.3).swatch(*uv['under']))
    parts.append(box(2.45, 0.13, 0.10, 0.02).move(0, 0.60, -11.88).swatch(*uv['alloy']))                  # underrun bar
    parts.append(box(2.50, 0.19, 0.07, 0.02).move(0, 1.03, -11.96).swatch(*uv['plastic']))                # lamp board
    parts.append(box(0.55, 0.5, 0.9).move(-0.95, 0.80, -3.2).swatch(*uv['grey']))            # pallet box
    return parts + [plate(atlas, (0, 1.03, -12.005), True)]


def rear_lamps(v, uv, trailer):
    for name, kind, x, w, way in (('lamp_tail', 'glass_red', 1.00, 0.26, TAIL),
                                  ('lamp_indicator_rear', 'glass_amber', 0.80, 0.12, tilted(0, -1, 19)),
                                  ('lamp_reverse', 'glass_clear', 0.67, 0.11, TAIL)):
        part = lens_box((w, 0.13, 0.04), uv[kind], (x, 1.03, -12.0), True)
        v.lamps(name, part, kind, way, trailer)


def build(out):
    atlas = Atlas(1024, 512)
    draw_trailer_side(atlas)
    draw_cab_side(atlas)
    draw_cab_strip(atlas)
    draw_trailer_strip(atlas)
    furniture(atlas, 0, 384, 'truck', 'RL 40 T', 1180)
    uv = atlas.uv
    cab = Shell(CAB, HX, lambda p: np.full(p.shape[:-1], 0.15), deform, chart(CAB_SIDE, atlas, CZ, CY_),
                chart(CAB_STRIP, atlas, CS, CT), 3)
    arch = arch_loop(FRONT, HUB, ARCH)
    side, glass = cab.side([3.1, 3.5, 4.0, 4.45, 4.8], [0.9, 1.25, 1.6, 2.2, 2.75, 3.1, 3.4], [WINDOW], [arch])
    top, screens = cab.strip([0, 0.4, 0.75], [SCREEN, GRILLE])
    paint = both(side) + both(top) + both(cab.edge())
    trim = [m for p in glass + screens for m in both(p)]
    lip, tub = cab.arch(FRONT, HUB, ARCH, SILL, 0.60, uv['plastic'], uv['under'], 12, 0.010)
    trim += both(lip) + both(tub) + chassis(uv)
    trim += cab_details(cab, uv, atlas)
    v = Vehicle('truck', atlas, (0.40, 0.045, 0.028), quality=84)
    v.body(paint, trim, (2.4,))
    wheel_front = heavy_wheel(atlas, HUB, 0.31, 0.30, 16)
    v.wheels(wheel_front, {'wheel_front': (TRACK, HUB, FRONT)})
    double = v.g.mesh('wheel_double', [(double_wheel(atlas, HUB, 0.30, 0.30, 16), v.trim)])
    v.more_wheels(double, {'wheel_rear': (REAR_TRACK, HUB, 0)})
    head = round_poly([(0.72, CAB.find(0.64)), (1.02, CAB.find(0.64)), (1.02, CAB.find(0.85)), (0.72, CAB.find(0.85))],
                      0.05)
    v.lamps('lamp_head', cab.patch(head, uv['glass_clear'], lift=0.012, dome=0.03, fine=0.3), 'glass_clear', HEAD)
    amber = round_poly([(1.06, CAB.find(0.66)), (1.27, CAB.find(0.66)), (1.27, CAB.find(0.83)), (1.06, CAB.find(0.83))],
                       0.03)
    v.lamps('lamp_indicator_front', cab.patch(amber, uv['glass_amber'], lift=0.012, dome=0.012, fine=0.3),
            'glass_amber', tilted(0, 1, 19))
    # the trailer turns about the hitch
    trailer = v.g.node('trailer', None, (0, 0, HITCH), parent=v.root)
    hold = Shell(BOX, 1.275, lambda p: np.full(p.shape[:-1], 0.045), straight, chart(TRAILER_SIDE, atlas, TZ, TY_),
                 chart(TRAILER_STRIP, atlas, BS, BT), 2)
    side, _ = hold.side([-8, -4, 0], [2.5])
    top, _ = hold.strip([0])
    floor = box(2.5, 0.02, T0 - T1 - 0.1).move(0, FLOOR + 0.02, (T0 + T1) / 2).swatch(*uv['under'])
    v.body([], both(side) + both(top) + both(hold.edge()) + [floor] + trailer_frame(uv, atlas), (-8.37, -5.03, -1.83),
           'trailer_body', trailer)
    wheel_trailer = v.g.mesh('wheel_trailer', [(trailer_wheel(atlas), v.trim)])
    v.more_wheels(wheel_trailer, {'wheel_trailer_%d' % (k + 1): (1.02, HUB, z) for k, z in enumerate(AXLES)}, trailer)
    rear_lamps(v, uv, trailer)
    v.g.save(out)


def trailer_wheel(atlas, R=HUB, width=0.36, rim_r=0.30, seg=16):
    w = width / 2
    rows = [(rim_r, -w + 0.012, 0.0), (R - 0.03, -w, 0.2), (R, -w + 0.06, 0.32), (R, w - 0.06, 0.68),
            (R - 0.03, w, 0.8), (rim_r, w - 0.012, 1.0)]
    face = [(rim_r, w - 0.012), (0.52 * rim_r, w - 0.09), (0.42 * rim_r, w - 0.01), (0.0, w)]
    return merge(tyre(atlas, R, rim_r, width, seg, 0.0, rows), *disc(atlas, face, seg, rim_r, -w + 0.04))


if __name__ == '__main__':
    here = os.path.dirname(os.path.abspath(__file__))
    build(os.path.join(here, '..', 'models', 'vehicle_truck.glb'))
