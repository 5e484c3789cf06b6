"""A city bicycle with its rider."""

import os
from humanlib import *

R, FRONT = 0.345, 1.06
BOTTOM = np.array([0, 0.285, 0.44])               # the cranks' axle
STEER = np.array([0, R, 1.02])                    # the steering axis at hub height
CRANK, PEDAL_X = 0.17, 0.135


def rod(a, b, r, seg=6, caps=False):
    return tube([a, b], r, seg, caps=caps)


def spoked_wheel(uv, seg=26, spokes=14):
    t = [(R - 0.034, -0.012), (R - 0.020, -0.018), (R - 0.004, -0.011), (R, 0.0), (R - 0.004, 0.011),
         (R - 0.020, 0.018), (R - 0.034, 0.012)]
    rim = [(R - 0.034, 0.013), (R - 0.052, 0.008), (R - 0.052, -0.008), (R - 0.034, -0.013)]
    parts = [lathe(t, seg, 50).swatch(*uv['rubber']), lathe(rim, seg, 30).swatch(*uv['alloy'])]
    parts.append(lathe([(0.0, -0.045), (0.024, -0.045), (0.014, -0.03), (0.014, 0.03), (0.024, 0.045), (0.0, 0.045)], 8,
                       40).swatch(*uv['steel']))
    for k in range(spokes):
        for sy, lag in ((1, 0.0), (-1, np.pi / spokes)):
            a = 2 * np.pi * k / spokes + lag
            b = a + (0.32 if k % 2 else -0.32)
            parts.append(rod((0.022 * np.cos(b), sy * 0.036, 0.022 * np.sin(b)),
                             ((R - 0.05) * np.cos(a), 0, (R - 0.05) * np.sin(a)), 0.0018, 3).swatch(*uv['steel']))
    return merge(*parts).mat(TURN)


def mudguard(centre, a0, a1, uv, n=9, r=R + 0.022, half=0.028):
    a = np.radians(np.linspace(a0, a1, n))
    P, F = [], []
    for k in a:
        for x, d in ((-half, -0.012), (0, 0.006), (half, -0.012)):
            P.append((centre[0] + x, centre[1] + (r + d) * np.sin(k), centre[2] + (r + d) * np.cos(k)))
    for i in range(n - 1):
        for j in (0, 1):
            q = 3 * i + j
            F += [(q, q + 1, q + 4), (q, q + 4, q + 3)]
    P, F = np.array(P), np.array(F)
    out = P - centre
    F = outward(P, out / np.linalg.norm(out, axis=1, keepdims=True), F)
    top = creased(P, np.zeros((len(P), 2)), F, 60)
    return [top.swatch(*uv), creased(P - out * 0.006, np.zeros((len(P), 2)), F[:, ::-1], 60).swatch(*uv)]


def frame(uv):
    """(painted, not painted)"""
    head0, head1, seat = np.array([0, 0.76, 0.880]), np.array([0, 0.94, 0.818]), np.array([0, 0.84, 0.255])
    top = between(BOTTOM, seat, 0.80)
    paint = [rod(head0, head1, 0.020, 8, True), rod(head0 + (0, 0.03, -0.01), BOTTOM, 0.019),
             rod(head1 - (0, 0.04, 0), top, 0.015), rod(BOTTOM, seat, 0.016, 6, True)]
    for sx in (1, -1):
        hub = np.array([sx * 0.06, R, 0])
        paint += [rod(BOTTOM + (sx * 0.03, 0, -0.02), hub, 0.009, 5), rod(top + (sx * 0.02, 0, 0), hub, 0.008, 5)]
    paint = [p.swatch(*uv['coat']) for p in paint]
    paint += mudguard(np.array([0, R, 0]), 30, 195, uv['coat'])
    trim = [rod(seat, seat + (0, 0.11, -0.036), 0.013, 6).swatch(*uv['alloy'])]
    s = seat + (0, 0.135, -0.04)
    saddle = skin([s + (0, -0.005, -0.13), s + (0, 0.008, -0.10), s + (0, 0.005, -0.02), s + (0, -0.004, 0.08),
                   s + (0, -0.012, 0.15)],
                  [(0.05, 0.02), (0.085, 0.035), (0.07, 0.032), (0.028, 0.024), (0.016, 0.014)], uv['shoe'], 8)
    trim.append(saddle)
    # chain guard, rack, stand, rear lamp's housing
    trim.append(box(0.012, 0.075, 0.52, 0.005).rot('x', -8).move(-0.062, 0.325, 0.235).swatch(*uv['plastic']))
    for sx in (1, -1):
        trim += [rod((sx * 0.055, 0.735, 0.19), (sx * 0.055, 0.735, -0.30), 0.006, 4).swatch(*uv['steel']),
                 rod((sx * 0.065, R, -0.01), (sx * 0.055, 0.735, -0.18), 0.006, 4).swatch(*uv['steel'])]
    for z in (0.10, -0.08, -0.27):
        trim.append(rod((-0.055, 0.735, z), (0.055, 0.735, z), 0.006, 4).swatch(*uv['steel']))
    trim.append(box(0.085, 0.05, 0.03, 0.012).move(0, 0.712, -0.315).swatch(*uv['plastic']))
    trim.append(rod(BOTTOM - (0.045, 0, 0), BOTTOM + (0.045, 0, 0), 0.024, 8, True).swatch(*uv['steel']))
    return paint, trim


def fork(uv):
    """What steers, in the root's space."""
    paint, trim = [], []
    crown = np.array([0, 0.735, 0.888])
    paint.append(rod(crown - (0.055, 0, 0), crown + (0.055, 0, 0), 0.018, 6, True).swatch(*uv['coat']))
    for sx in (1, -1):
        paint.append(tube([crown + (sx * 0.05, 0, 0), (sx * 0.056, 0.50, 0.972), (sx * 0.056, R, FRONT)],
                          [0.014, 0.012, 0.008], 5, caps=False).swatch(*uv['coat']))
    paint += mudguard(np.array([0, R, FRONT]), 25, 175, uv['coat'], 8)
    stem = np.array([0, 1.035, 0.800])
    trim.append(tube([(0, 0.92, 0.826), stem, stem + (0, 0.015, 0.05)], 0.013, 6).swatch(*uv['alloy']))
    bar = [(sx * x, y, z) for sx, x, y, z in ((1, 0.295, 1.065, 0.655), (1, 0.27, 1.07, 0.76), (1, 0.16, 1.075, 0.845),
                                              (1, 0.0, 1.05, 0.85),
                                              (-1, 0.16, 1.075, 0.845), (-1, 0.27, 1.07, 0.76),
                                              (-1, 0.295, 1.065, 0.655))]
    trim.append(tube(bar, 0.011, 6).swatch(*uv['alloy']))
    for sx in (1, -1):
        trim.append(rod((sx * 0.296, 1.065, 0.645), (sx * 0.275, 1.069, 0.745), 0.017, 6, True).swatch(*uv['rubber']))
        trim.append(tube([(sx * 0.25, 1.055, 0.80), (sx * 0.275, 1.045, 0.74), (sx * 0.30, 1.045, 0.68)], 0.005, 4,
                         caps=False).swatch(*uv['steel']))
    trim.append(lathe([(0.0, -0.05), (0.030, -0.045), (0.036, 0.0), (0.036, 0.02), (0.030, 0.02)], 10,
                      40).rot('x', 90).move(0, 0.80, 0.935).swatch(*uv['plastic']))
    # Bell.
    trim.append(lathe([(0.0, -0.01), (0.020, -0.01), (0.022, 0.008), (0.0, 0.02)], 8,
                      50).move(-0.10, 1.085, 0.85).swatch(*uv['chrome']))
    return paint, trim


def cranks(uv):
    parts = [lathe([(0.0, -0.004), (0.088, -0.004), (0.094, 0.0), (0.088, 0.004), (0.0, 0.004)], 14,
                   30).mat(TURN).move(-0.055, 0, 0).swatch(*uv['steel'])]
    for sx in (1, -1):
        tip = np.array([sx * 0.085, 0, sx * CRANK])
        parts.append(rod((sx * 0.05, 0, 0), tip, 0.013, 5, True).swatch(*uv['alloy']))
        parts.append(rod(tip, tip + (sx * 0.10, 0, 0), 0.006, 4).swatch(*uv['steel']))
        parts.append(box(0.085, 0.024, 0.09, 0.006).move(*(tip + (sx * 0.055, 0, 0))).swatch(*uv['rubber']))
    return parts


def rider(uv):
    """(jacket, head and hands, left leg, right leg); the left pedal is in front."""
    paint = [torso((0, 1.035, 0.215), (0, 1.345, 0.325), (0, 1.550, 0.445), uv)]
    trim = head((0, 1.555, 0.45), (0, 1.690, 0.505), uv, hair=False)
    shell, dark = helmet((0, 1.700, 0.505), uv, 6, open_=True)
    wrist = np.array([0.290, 1.085, 0.640])
    paint += both(arm((0.175, 1.475, 0.405), (0.288, 1.255, 0.440), wrist, uv))
    trim += both(hand(wrist, (0.288, 1.068, 0.715), uv['skin_rect'], 6, True)) + [shell] + dark
    legs = []
    for sx in (1, -1):
        hip = np.array([0.092, 1.000, 0.235])
        ankle = np.array([0.112, BOTTOM[1] + 0.112, BOTTOM[2] + sx * CRANK - 0.055])
        parts = [leg(hip, knee(hip, ankle, out=0.08), ankle, uv), shoe(ankle + (0.004, 0.0, 0), (0.05, -0.08, 1.0), uv)]
        legs.append([p if sx > 0 else mirror_x(p) for p in parts])
    return paint, trim, legs


def dome(r, depth, uv_rect, seg=10):
    """A round glass around +Y, its image over the disc."""
    part = lathe([(r, -0.012), (r, 0.0), (0.75 * r, 0.6 * depth), (0.40 * r, 0.92 * depth), (0.0, depth)], seg, 70)
    x, y, w, h = uv_rect
    return part.uvmap(lambda P, UV: np.stack([x + w * (0.5 + 0.46 * P[:, 0] / r),
                                              y + h * (0.5 + 0.46 * P[:, 2] / r + 0.3 * np.minimum(P[:, 1], 0))], 1))


def build(out):
    atlas = Atlas(512, 512)
    draw_human(atlas, 0, 0, 1300, trousers='3a3d42', jacket='dededa')
    furniture(atlas, 0, 260, 'steel', 'RELIEF', 1340)
    atlas.swatch('coat', 166 + 24 * 13, 260 + 92, 'dcdcd8', 0.25)
    uv = atlas.uv
    v = Vehicle('bicycle', atlas, (0.035, 0.17, 0.10))
    paint, trim = frame(uv)
    coat, skin_, legs = rider(uv)
    v.body(paint + coat, trim + skin_)
    wheel_ = v.g.mesh('wheel', [(spoked_wheel(uv), v.trim)])
    v.g.node('wheel_rear', wheel_, (0, R, 0), parent=v.root)
    p, t = fork(uv)
    away = lambda ps, o: [q.move(*-np.asarray(o)) for q in ps]
    steering = v.body(away(p, STEER), away(t, STEER), None, 'steering', t=STEER)
    v.g.node('wheel_front', wheel_, np.array([0, R, FRONT]) - STEER, parent=steering)
    v.body([], cranks(uv), None, 'cranks', t=BOTTOM)
    for (side, sx), parts in zip((('left', 1), ('right', -1)), legs):
        hip = np.array([sx * 0.092, 1.000, 0.235])
        v.body([], away(parts, hip), None, 'leg_' + side, t=hip)
    lens = dome(0.031, 0.012, uv['glass_clear']).rot('x', 90).move(0, 0.80, 0.955)
    v.lamp('lamp_head', lens.move(*-STEER), 'glass_clear', tilted(5), steering)
    v.lamp('lamp_tail', lens_box((0.07, 0.035, 0.012), uv['glass_red'], (0, 0.712, -0.333), True), 'glass_red', TAIL)
    v.g.save(out)


if __name__ == '__main__':
    here = os.path.dirname(os.path.abspath(__file__))
    build(os.path.join(here, '..', 'models', 'vehicle_bicycle.glb'))
