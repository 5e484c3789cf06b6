"""The car: a compact five-door of our own design."""

import os
from vehiclelib import *

HX, HUB, FRONT = 0.86, 0.305, 2.53                # half width; wheel radius; the front axle's z (the rear's is 0)
TRACK, ARCH, SILL = 0.735, 0.375, 0.20
CORNERS = [(3.20, 0.19), (3.315, 0.36), (3.30, 0.60), (3.15, 0.785), (2.22, 0.985), (1.36, 1.435), (0.50, 1.48),
           (-0.32, 1.40), (-0.62, 0.93), (-0.675, 0.66), (-0.68, 0.38), (-0.60, 0.21)]
ROUND = [0, 0.10, 0.35, 0.20, 0.22, 0.45, 1.6, 0.13, 0.22, 0.25, 0.10, 0]
O = Outline(CORNERS, ROUND, step=20, longest=0.5)

DLO = round_poly([(2.02, 0.965), (1.37, 1.345), (0.84, 1.388), (0.20, 1.345), (-0.16, 1.25), (-0.30, 1.045),
                  (0.30, 0.985)],
                 [0.02, 0.10, 0.5, 0.5, 0.06, 0.06, 0.5], 24)
S_SCREEN = (O.near(2.16, 1.02), O.near(1.41, 1.42))
S_BACK = (O.near(-0.36, 1.335), O.near(-0.60, 0.965))


def half(rows):
    """A half outline from (t, s) points on its outer side."""
    return np.array([(0.0, rows[0][1])] + rows + [(0.0, rows[-1][1])])


SCREEN = half([(0.70, S_SCREEN[0] + 0.012), (0.755, S_SCREEN[0] + 0.06), (0.765, S_SCREEN[1] - 0.10),
               (0.73, S_SCREEN[1] - 0.03), (0.60, S_SCREEN[1])])
BACK = half([(0.62, S_BACK[0]), (0.70, S_BACK[0] + 0.03), (0.72, S_BACK[1] - 0.06), (0.68, S_BACK[1])])


S_GRILLE = (O.near(3.28, 0.66), O.near(3.31, 0.36))
GRILLES = [half([(0.44, s - dy), (0.47 + dx, s - 0.6 * dy), (0.47 + dx, s + 0.6 * dy), (0.44, s + dy)])
           for s, dx, dy in ((S_GRILLE[0], 0.0, 0.056), (S_GRILLE[1], 0.03, 0.086))]


def fillet(p):
    z, y = p[..., 0], p[..., 1]
    r = 0.085 + 0.05 * smooth(2.6, 3.1, z) + 0.03 * smooth(0.2, -0.5, z) * smooth(1.0, 0.8, y)
    return r - 0.03 * smooth(0.36, 0.2, y)


def deform(p):
    x, y, z = p[..., 0], p[..., 1], p[..., 2]
    q = (x / HX) ** 2
    w = 1 - 0.215 * np.clip((y - 0.93) / 0.5, 0, 1.2) ** 1.15 - 0.05 * smooth(0.50, 0.20, y)
    w = w - 0.115 * smooth(2.35, 3.35, z) ** 1.3 - 0.075 * smooth(0.35, -0.72, z) ** 1.3
    w = w - 0.020 * smooth(0.82, 0.98, y) - 0.018 * smooth(0.74, 0.58, y) * smooth(0.30, 0.50, y)
    for az in (0, FRONT):                              # wings swell over the wheels
        w = w + 0.020 * np.exp(-((z - az) / 0.42) ** 2) * np.exp(-((y - 0.50) / 0.24) ** 2)
    nz = z - 0.20 * q ** 1.25 * smooth(2.3, 3.3, z) + 0.11 * q * smooth(0.3, -0.65, z)
    nz = nz - 0.13 * q * smooth(1.0, 1.6, z) * smooth(2.6, 2.1, z) * smooth(0.9, 1.05, y)
    ny = y + 0.030 * (1 - q) * smooth(1.15, 1.40, y) + 0.035 * (1 - q) * smooth(2.3, 2.8, z) * smooth(0.68, 0.85, y)
    return np.stack([x * w, ny, nz], -1)


SIDE = (0, 0, 512, 190)
STRIP = (0, 191, 512, 144)
ZX, SY = even(3.34, -0.70, SIDE[2])[::-1], even(1.52, 0.15, SIDE[3])
SX, TY = even(0.0, O.length, STRIP[2]), even(0.97, -0.03, STRIP[3])


def draw_side(atlas):
    c = Canvas(atlas, SIDE, ZX, SY, 900, rough=0.24)
    Z, Y = c.x, c.y
    c.fill(Y - 0.265, '202122', 0.62)                                        # sill cladding
    c.line(Y - 0.268, 0.006, 0.006)
    # a pressed line under the handles and a fold above the sill
    c.ridge(Y - (0.845 + 0.018 * Z), 0.010, 0.035)
    c.ridge(Y - (0.815 + 0.018 * Z), -0.005, 0.035)
    c.ridge(Y - (0.415 + 0.025 * (Z - 1.2)), 0.012, 0.05)
    top = 1.43
    front = round_poly([(1.06, 0.29), (1.93, 0.29), (2.03, 0.46), (2.01, 0.70), (2.00, 0.965), (1.35, top),
                        (1.06, top)], [0.02, 0.08, 0.1, 0.2, 0.04, 0.1, 0.02])
    rear = round_poly([(0.55, 0.29), (1.05, 0.29), (1.05, top), (0.15, top), (-0.05, 1.02), (0.10, 0.76), (0.36, 0.58)],
                      [0.12, 0.02, 0.02, 0.1, 0.15, 0.12, 0.15])
    c.line(seg_dist(front, Z, Y))
    c.line(seg_dist(rear, Z, Y))
    # Bonnet shut line.
    c.line(seg_dist(np.array([(1.99, 0.93), (2.40, 0.92), (2.90, 0.83), (3.05, 0.77)]), Z, Y, False))
    c.line(seg_dist(np.array([(2.93, 0.62), (2.905, 0.50), (2.92, 0.2)]), Z, Y, False))          # bumpers
    c.line(seg_dist(np.array([(2.93, 0.62), (3.3, 0.64)]), Z, Y, False))
    c.line(seg_dist(np.array([(-0.345, 0.2), (-0.37, 0.50), (-0.36, 0.60), (-0.7, 0.61)]), Z, Y, False))
    flap = rr(Z, Y, -0.22, 0.83, 0.075, 0.075, 0.02)
    c.line(flap)
    for hz in (1.22, 0.22):                                                  # handles lie in bowls
        c.raise_(rr(Z, Y, hz, 0.885, 0.075, 0.028, 0.025), -0.014, 0.010)
    for az in (0, FRONT):
        d = np.hypot(Z - az, Y - HUB) - ARCH
        c.raise_(np.abs(d - 0.02) - 0.035, 0.010, 0.014)
        c.gap = np.maximum(c.gap, 0.5 * smooth(0.02, 0.0, np.abs(d)))
    d = poly_sdf(DLO, Z, Y)
    seats = np.minimum(rr(Z, Y, 1.13, 1.05, 0.11, 0.16, 0.05), rr(Z, Y, 0.20, 1.02, 0.10, 0.12, 0.05))
    seats = np.minimum(seats, np.minimum(rr(Z, Y, 1.10, 1.27, 0.065, 0.07, 0.03), np.hypot(Z - 1.72, Y - 0.97) - 0.14))
    c.fill(np.abs(d) - 0.012, '141415', 0.35, 0)
    c.glass(d, 0.98, 1.38, seats)
    for bar, wid in ((np.abs(Z - 1.055 + 0.06 * (Y - 1)), 0.040), (np.abs(Z - 0.07 - 0.10 * (Y - 1)), 0.018),
                     (np.abs(Z - 1.78), 0.014)):
        c.fill(np.maximum(bar - wid, d), '101011', 0.25, 0)
    spray = sum(smooth(0.22, 0.0, np.hypot((Z - az + 0.10) / 1.25, Y - HUB) - ARCH) for az in (0, FRONT))
    c.weather(np.clip(0.85 * smooth(0.55, 0.18, Y) + 0.5 * spray * smooth(0.9, 0.3, Y), 0, 1), 0.5)
    c.put()


def draw_strip(atlas):
    c = Canvas(atlas, STRIP, SX, TY, 920, rough=0.24)
    S, T = c.x, c.y
    at = O.near
    # bonnet: shut line, two folds, a shallow bulge
    s0, s1 = at(3.24, 0.72), at(2.30, 0.97)
    c.line(np.where(T < 0.745, S - s0, 1))
    c.line(np.where((S > s0) & (S < s1), T - 0.745 - 0.03 * (S - s0), 1))
    c.ridge(np.where((S > s0 + 0.03) & (S < s1), T - 0.36 - 0.12 * (S - s0), 1), 0.012, 0.06)
    c.fill(np.maximum(np.abs(S - s1 - 0.03) - 0.05, T - 0.74), '141516', 0.65)       # scuttle
    # face: upper slot, lower grille, plate bed, fog-lamp pockets
    su, sl = S_GRILLE
    c.grille(rr(S, T, su, 0, 0.055, 0.47, 0.05), 0.032, upright=True, bar='9a9c9e')
    c.ridge(rr(S, T, su, 0, 0.060, 0.475, 0.05), 0.008, 0.014)
    c.grille(rr(S, T, sl, 0, 0.085, 0.50, 0.05), 0.045, upright=True)
    pocket = rr(S, T, sl, 0.68, 0.055, 0.10, 0.03)
    c.fill(pocket, '121213', 0.6, flat=True)
    c.ridge(pocket, 0.008, 0.016)
    c.fill(S - at(3.24, 0.24), '1b1c1d', 0.65)                                       # lip under the bumper
    c.line(np.where(T > 0.47, S - at(3.30, 0.56), 1))
    badge = np.hypot(S - su, T) - 0.045
    c.fill(badge, 'd8d9da', 0.15, 1, flat=True)
    c.fill(np.abs(badge + 0.014) - 0.004, '20262c', 0.3, 0)
    c.raise_(badge, 0.008, 0.01)
    # dark where the lamps sit
    c.fill(rr(S, T, at(3.245, 0.725), 0.72, 0.085, 0.26, 0.05), '101112', 0.3, 0.0, flat=True)
    # screens with black borders
    d = poly_sdf(np.concatenate([SCREEN, SCREEN[::-1] * (-1, 1)]), T, S)
    c.fill(d - 0.004, '0e0f10', 0.3, 0)
    c.glass(d, 0, 1, rim=0.03)
    k = smooth(S_SCREEN[0], S_SCREEN[1], S)
    c.base = mix(c.base, mix(rgb('0a0d0f'), rgb('28333a'), k), c.soft(d + 0.04))
    c.line(np.where((S > S_SCREEN[1]) & (S < S_BACK[0]), T - 0.70, 1), 0.010, 0.006)
    c.line(np.where(T < 0.72, S - at(-0.30, 1.395), 1))
    c.ridge(np.where((S > S_SCREEN[1] + 0.25) & (S < S_BACK[0] - 0.3), T - 0.22, 1), -0.004, 0.05)
    d = poly_sdf(np.concatenate([BACK, BACK[::-1] * (-1, 1)]), T, S)
    c.fill(d - 0.004, '0e0f10', 0.3, 0)
    c.glass(d, 0, 1, rim=0.025)
    for k in range(7):                                                               # heating wires
        c.fill(np.maximum(np.abs(S - S_BACK[0] - 0.10 - 0.045 * k) - 0.0015, d + 0.05), '2a2422', 0.2)
    # tailgate: shut line, plate bed, handle; bumper
    st, sb = S_BACK[1], at(-0.68, 0.56)
    c.line(np.where((S > S_BACK[0]) & (S < sb), T - 0.74 + 0.10 * smooth(st, sb, S), 1))
    c.line(np.where(T < 0.645, S - sb, 1))
    bed = rr(S, T, at(-0.675, 0.735), 0, 0.075, 0.29, 0.03)
    c.raise_(bed, -0.012, 0.012)
    c.fill(rr(S, T, at(-0.655, 0.825), 0, 0.012, 0.27, 0.01), '1b1c1d', 0.4)
    c.fill(rr(S, T, at(-0.64, 0.33), 0, 0.075, 0.62, 0.04), '1b1c1d', 0.62)
    c.fill(rr(S, T, at(-0.675, 0.47), 0.62, 0.022, 0.10, 0.012), '7c120e', 0.2, flat=True)
    low = np.maximum(smooth(0.45, 0.0, S), smooth(O.length - 0.55, O.length, S))
    c.weather(np.clip(0.7 * low, 0, 1), 0.5)
    c.put()


def details(shell, uv, atlas):
    """Small things: (painted, not painted)."""
    paint, trim = [], []
    for hz in (1.22, 0.22):                            # door handles
        P, N = shell.on_side(hz, 0.893)
        paint += both(box(0.022, 0.022, 0.15, 0.008).move(P[0, 0] + 0.012, P[0, 1], P[0, 2]).swatch(*uv['coat']))
    P, N = shell.on_side(1.85, 1.00)                   # mirrors
    m = P[0] + (0.115, 0.045, 0.0)
    cap = box(0.19, 0.125, 0.085, 0.032).rot('y', -8)
    glass = on_rect(box(0.155, 0.095, 0.008, 0.0), uv['mirror'], flip=True).rot('y', -8)
    paint += both(cap.move(*m).swatch(*uv['coat']))
    trim += both(glass.move(m[0], m[1], m[2] - 0.041))
    trim += both(tube([P[0] + (-0.02, -0.01, 0.03), m + (-0.03, -0.045, 0.02)], 0.022, 6,
                      squash=0.6).swatch(*uv['plastic']))
    for x0, x1, lag in ((-0.62, 0.02, 0.03), (-0.02, 0.58, 0.0)):   # wipers
        s = S_SCREEN[0] + 0.035 + lag
        P, N = shell.on_strip(np.array([x0, (x0 + x1) / 2, x1]), np.array([s, s + 0.010, s + 0.045]), 0.014)
        trim.append(tube(P, 0.009, 4, caps=False).swatch(*uv['plastic']))
    P, N = shell.on_strip(0.0, S_BACK[0] - 0.09)
    trim.append(tube([P[0], P[0] + (0, 0.05, -0.13)], [0.012, 0.004], 5).swatch(*uv['plastic']))   # aerial
    P, N = shell.on_strip(0.0, O.near(3.31, 0.50))
    trim.append(plate(atlas, P[0] + (0, 0, 0.012), tilt=0))
    P, N = shell.on_strip(0.0, O.near(-0.675, 0.735))
    trim.append(plate(atlas, P[0] + (0, 0, -0.004), True, tilt=6))
    trim.append(lathe([(0.034, -0.10), (0.034, 0.03), (0.028, 0.03), (0.026, -0.05)], 8,
                      40).rot('x', -90).move(-0.42, 0.235, -0.60).swatch(*uv['chrome']))
    return paint, trim


def build(out):
    atlas = Atlas()
    draw_side(atlas)
    draw_strip(atlas)
    furniture(atlas, 0, 336, 'alloy', 'RL 1978', 940)
    atlas.swatch('coat', 166 + 24 * 13, 336 + 92, 'e6e6e3', 0.30)
    uv = atlas.uv
    shell = Shell(O, HX, fillet, deform, chart(SIDE, atlas, ZX, SY), chart(STRIP, atlas, SX, TY), 3)
    arches = [arch_loop(az, HUB, ARCH) for az in (0, FRONT)]
    side, glass = shell.side(np.arange(-0.4, 3.2, 0.30), [0.32, 0.46, 0.60, 0.74, 0.84, 0.92, 1.02, 1.18, 1.33], [DLO],
                             arches)
    top, screens = shell.strip([0, 0.28, 0.56, 0.80], [SCREEN, BACK] + GRILLES)
    paint = both(side) + both(top) + both(shell.edge())
    trim = [m for p in glass + screens for m in both(p)]
    for az in (0, FRONT):
        lip, tub = shell.arch(az, HUB, ARCH, SILL, 0.50, uv['plastic'], uv['under'], 12, 0.006)
        trim += both(lip) + both(tub)
    # Floor, narrow between the wheels.
    for sx, sz, z in ((0.98, 3.5, 1.30), (1.50, 1.68, 1.265), (1.34, 0.16, 3.0), (1.40, 0.16, -0.48)):
        trim.append(box(sx, 0.05, sz).move(0, 0.23 - 0.005 * sx, z).swatch(*uv['under']))
    p, t = details(shell, uv, atlas)
    v = Vehicle('car', atlas, (0.30, 0.035, 0.030))
    v.body(paint + p, trim + t)
    v.wheels(wheel(atlas, HUB, 0.195, 0.215, 20), {'wheel_front': (TRACK, HUB, FRONT), 'wheel_rear': (TRACK, HUB, 0)})
    lamps(v, shell, uv)
    v.g.save(out)


def lamps(v, shell, uv):
    s = O.near
    s0, s1 = s(3.275, 0.655), s(3.20, 0.775)
    edge = shell.widest(s0) - 0.005
    head = round_poly([(0.50, s0), (edge, s0 + 0.035), (edge, s1 + 0.03), (0.60, s1)], [0.03, 0.02, 0.03, 0.03])
    v.lamps('lamp_head', shell.patch(head, uv['glass_clear'], lift=0.008, dome=0.014), 'glass_clear', HEAD)
    s0, s1 = s(3.30, 0.60), s(3.285, 0.645)
    amber = round_poly([(0.56, s0), (edge, s0 + 0.03), (edge, s1 + 0.028), (0.53, s1)], 0.012)
    v.lamps('lamp_indicator_front', shell.patch(amber, uv['glass_amber'], lift=0.006, dome=0.004), 'glass_amber',
            tilted(0, 1, 19))
    # rear cluster, from the top: tail and brake, indicator, reversing lamp
    rows = [s(-0.625, 0.915), s(-0.665, 0.755), s(-0.673, 0.685), s(-0.676, 0.625)]
    edge = min(shell.widest(r) for r in rows) - 0.004
    for name, kind, a, b, way in (('lamp_tail', 'glass_red', 0, 1, TAIL),
                                  ('lamp_indicator_rear', 'glass_amber', 1, 2, tilted(0, -1, 19)),
                                  ('lamp_reverse', 'glass_clear', 2, 3, TAIL)):
        loop = round_poly([(0.60, rows[a] + 0.004), (edge, rows[a] + 0.004), (edge, rows[b] - 0.004),
                           (0.60, rows[b] - 0.004)], 0.014)
        v.lamps(name, shell.patch(loop, uv[kind], lift=0.007, dome=0.008), kind, way)


if __name__ == '__main__':
    here = os.path.dirname(os.path.abspath(__file__))
    build(os.path.join(here, '..', 'models', 'vehicle_car.glb'))
