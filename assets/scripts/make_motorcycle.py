"""A roadster motorcycle with its rider."""

import os
from make_bicycle import dome, mudguard, rod
from humanlib import *

R, FRONT = 0.31, 1.43
STEER = np.array([0, R, 1.34])                    # the steering axis at hub height
AXIS = np.array([0, 0.885, -0.435]) / np.hypot(0.885, 0.435)      # up along the fork


def on_fork(x, up, ahead=0.0):
    """A point `up` metres along the fork from the front hub."""
    return np.array([x, R, FRONT]) + AXIS * up + np.array([0, 0.0, ahead])


def mag_wheel(atlas, seg=20):
    width, rim_r = 0.135, 0.225
    rows = [(rim_r, -0.055, 0.0), (0.27, -0.066, 0.12), (0.296, -0.055, 0.25), (R, -0.015, 0.40), (R, 0.015, 0.60),
            (0.296, 0.055, 0.75), (0.27, 0.066, 0.88), (rim_r, 0.055, 1.0)]
    face = [(rim_r, 0.055), (0.88 * rim_r, 0.036), (0.30 * rim_r, 0.034), (0.22 * rim_r, 0.060), (0.0, 0.060)]
    half = disc(atlas, face, seg, rim_r)
    brake = lathe([(0.150, 0.0), (0.105, 0.0)], 14, 30).mat(TURN).move(0.072, 0, 0).swatch(*atlas.uv['steel'])
    return merge(tyre(atlas, R, rim_r, width, seg, 0.0, rows), half, [p.rot('y', 180) for p in half], brake,
                 brake.rot('y', 180))


def tank_and_tail(uv):
    tank = skin([(0, 0.865, 1.03), (0, 0.870, 0.98), (0, 0.872, 0.88), (0, 0.858, 0.74), (0, 0.830, 0.60),
                 (0, 0.805, 0.50), (0, 0.800, 0.47)],
                [(0.05, 0.04), (0.105, 0.085), (0.158, 0.112), (0.168, 0.118), (0.140, 0.098), (0.105, 0.062),
                 (0.06, 0.03)], uv['tank'], 14, power=2.5)
    tail = skin([(0, 0.800, 0.12), (0, 0.812, 0.02), (0, 0.835, -0.14), (0, 0.862, -0.28), (0, 0.872, -0.34)],
                [(0.130, 0.045), (0.142, 0.062), (0.125, 0.056), (0.080, 0.040), (0.060, 0.030)], uv['tank'], 12,
                power=2.8)
    return [tank, tail]


def seat(uv):
    return skin([(0, 0.800, 0.53), (0, 0.808, 0.48), (0, 0.806, 0.34), (0, 0.808, 0.18), (0, 0.850, 0.04),
                 (0, 0.880, -0.10), (0, 0.890, -0.20)],
                [(0.06, 0.03), (0.100, 0.05), (0.140, 0.055), (0.150, 0.058), (0.135, 0.052), (0.105, 0.036),
                 (0.06, 0.02)], uv['shoe'], 10, power=2.6)


def engine(uv):
    parts = []
    parts.append(lathe([(0.0, -0.20), (0.10, -0.20), (0.135, -0.15), (0.135, 0.15), (0.10, 0.20), (0.0, 0.20)], 12, 40)
                 .mat(TURN).move(0, 0.405, 0.62).swatch(*uv['steel']))
    parts.append(box(0.30, 0.20, 0.34).move(0, 0.40, 0.50).swatch(*uv['steel']))
    block = box(0.31, 0.30, 0.24)
    x, y, w, h = uv['fins']
    block = block.uvmap(lambda P, UV: np.stack([x + w * (0.5 + (P[:, 0] + 0.7 * P[:, 2]) * 1.3),
                                                y + h * (0.5 - (P[:, 1] + 0.07 * P[:, 2] + 0.05 * P[:, 0]) * 2.4)], 1))
    parts.append(block.rot('x', 14).move(0, 0.61, 0.70))
    parts.append(box(0.29, 0.075, 0.23, 0.03).rot('x', 14).move(0, 0.785, 0.745).swatch(*uv['plastic']))
    cover = lathe([(0.075, -0.03), (0.075, -0.018), (0.06, 0.0), (0.0, 0.0)], 10, 40).mat(TURN).move(0.225, 0.41, 0.56)
    parts += both(cover.swatch(*uv['chrome']))
    for sx in (1, -1):
        pipe = tube([(sx * 0.09, 0.60, 0.83), (sx * 0.10, 0.55, 0.92), (sx * 0.11, 0.38, 0.91), (sx * 0.13, 0.25, 0.76),
                     (sx * 0.17, 0.245, 0.45), (sx * 0.20, 0.27, 0.28)],
                    [0.022, 0.022, 0.022, 0.022, 0.022, 0.030], 6, caps=False)
        parts.append(pipe.swatch(*uv['chrome']))
        parts.append(lathe([(0.028, 0.0), (0.054, 0.06), (0.056, 0.42), (0.046, 0.50), (0.030, 0.49)], 8,
                           40).rot('x', -82).move(sx * 0.205, 0.272, 0.30).swatch(*uv['chrome']))
    return parts


def chassis(uv):
    parts = []
    for sx in (1, -1):
        parts.append(tube([(sx * 0.04, 0.90, 1.08), (sx * 0.14, 0.55, 0.93), (sx * 0.15, 0.27, 0.82)], 0.017, 5,
                          caps=False).swatch(*uv['plastic']))
        parts.append(tube([(sx * 0.12, 0.80, 0.48), (sx * 0.15, 0.46, 0.42), (sx * 0.14, 0.28, 0.46)], 0.018, 5,
                          caps=False).swatch(*uv['plastic']))
        parts.append(rod((sx * 0.13, 0.55, 0.42), (sx * 0.11, 0.80, -0.02), 0.013, 5).swatch(*uv['plastic']))
        parts.append(box(0.035, 0.055, 0.50).rot('x', 11).move(sx * 0.125, 0.355, 0.22).swatch(*uv['alloy']))
        shock = lathe([(0.020, 0.0), (0.034, 0.03), (0.034, 0.24), (0.016, 0.40)], 6, 40).rot('x', 24)
        parts.append(shock.move(sx * 0.155, 0.38, -0.02).swatch(*uv['dark_red']))
        parts.append(rod((sx * 0.13, 0.37, 0.40), (sx * 0.29, 0.355, 0.38), 0.014, 6, True).swatch(*uv['rubber']))
    parts.append(lathe([(0.0, -0.16), (0.02, -0.16), (0.02, 0.16), (0.0, 0.16)], 8,
                       40).mat(TURN).move(0, R, 0).swatch(*uv['steel']))
    parts += mudguard(np.array([0, R, 0]), 60, 168, uv['plastic'], 9, R + 0.035, 0.085)
    parts.append(box(0.030, 0.30, 0.05).rot('x', 30).move(0, 0.70, -0.36).swatch(*uv['plastic']))
    parts.append(box(0.11, 0.07, 0.05).move(0, 0.815, -0.355).swatch(*uv['plastic']))
    parts.append(tube([(0.0, 0.93, 1.04), (0.0, 0.80, 1.10)], 0.035, 8).swatch(*uv['plastic']))
    for sx in (1, -1):
        parts.append(rod((sx * 0.05, 0.80, -0.32), (sx * 0.15, 0.80, -0.33), 0.010, 5).swatch(*uv['plastic']))
        parts.append(box(0.065, 0.05, 0.045).move(sx * 0.165, 0.80, -0.335).swatch(*uv['plastic']))
    return parts


def steering(uv):
    """(painted, not painted), in the root's space."""
    paint = mudguard(np.array([0, R, FRONT]), 20, 145, uv['coat'], 9, R + 0.025, 0.070)
    trim = []
    for sx in (1, -1):
        trim.append(tube([on_fork(sx * 0.095, -0.02), on_fork(sx * 0.095, 0.36), on_fork(sx * 0.095, 0.37),
                          on_fork(sx * 0.095, 0.72)], [0.032, 0.032, 0.021, 0.021], 6,
                         caps=False).swatch(*uv['chrome']))
        # Brake caliper.
        trim.append(box(0.03, 0.10, 0.05).move(*on_fork(sx * 0.075, 0.10, -0.09)).swatch(*uv['plastic']))
        bar = [(0, 1.010, 1.115), (sx * 0.08, 1.020, 1.120), (sx * 0.16, 1.060, 1.080), (sx * 0.26, 1.075, 1.010),
               (sx * 0.38, 1.055, 0.905)]
        trim.append(tube(bar, 0.013, 6).swatch(*uv['chrome']))
        trim.append(rod((sx * 0.275, 1.073, 1.000), (sx * 0.385, 1.054, 0.900), 0.019, 6, True).swatch(*uv['rubber']))
        trim.append(tube([(sx * 0.25, 1.07, 1.03), (sx * 0.31, 1.062, 1.035), (sx * 0.40, 1.045, 0.955)], 0.006, 4,
                         caps=False).swatch(*uv['steel']))
        trim.append(tube([(sx * 0.24, 1.08, 1.02), (sx * 0.27, 1.16, 1.03), (sx * 0.34, 1.21, 1.00)], 0.007, 5,
                         caps=False).swatch(*uv['plastic']))
        trim.append(box(0.13, 0.085, 0.03, 0.014).move(sx * 0.36, 1.225, 1.00).swatch(*uv['plastic']))
        trim.append(on_rect(box(0.105, 0.062, 0.006), uv['mirror'], flip=True).move(sx * 0.36, 1.225, 0.984))
        trim.append(rod((sx * 0.08, 0.87, 1.21), (sx * 0.17, 0.86, 1.21), 0.010, 5).swatch(*uv['plastic']))
        trim.append(box(0.065, 0.05, 0.045).move(sx * 0.185, 0.86, 1.215).swatch(*uv['plastic']))
        dial = lathe([(0.030, -0.03), (0.046, 0.0), (0.046, 0.028), (0.040, 0.030)], 8,
                     40).rot('x', -38).move(sx * 0.055, 1.035, 1.165)
        trim.append(dial.swatch(*uv['plastic']))
        face = lathe([(0.040, 0.029), (0.0, 0.029)], 8, 40).rot('x', -38).move(sx * 0.055, 1.035, 1.165)
        trim.append(face.swatch(*uv['dial']))
    for up in (0.50, 0.70):
        trim.append(box(0.25, 0.035, 0.075).rot('x', -26).move(*on_fork(0, up, -0.02)).swatch(*uv['steel']))
    bowl = lathe([(0.0, -0.085), (0.055, -0.080), (0.088, -0.045), (0.098, 0.0), (0.098, 0.022), (0.090, 0.026)], 12,
                 50)
    trim.append(bowl.rot('x', 90).move(0, 0.880, 1.255).swatch(*uv['chrome']))
    return paint, trim


def rider(uv):
    parts = [torso((0, 0.935, 0.215), (0, 1.245, 0.355), (0, 1.450, 0.490), uv, 12)]
    shell, dark = helmet((0, 1.590, 0.560), uv, 4, 12)
    wrist = np.array([0.330, 1.078, 0.900])
    parts += both(arm((0.180, 1.375, 0.450), (0.330, 1.160, 0.620), wrist, uv, 8))
    parts += both(hand(wrist, (0.330, 1.064, 0.975), uv['shoe'], 6, True)) + dark
    parts.append(skin([(0, 1.43, 0.47), (0, 1.53, 0.53)], [(0.075, 0.075), (0.08, 0.08)], uv['shoe'], 8,
                      close=(False, False)))
    hip, ankle = np.array([0.100, 0.895, 0.245]), np.array([0.205, 0.470, 0.335])
    parts += both(leg(hip, knee(hip, ankle, out=0.30), ankle, uv, 8))
    parts += both(shoe(ankle + (0.005, -0.015, 0), (0.06, -0.10, 1.0), uv, 7, size=1.05))
    return [shell], parts


def draw_tank(atlas, x, y, w=128, h=64):
    """The tank's coat with a badge and a stripe on each side; u around (0.5 on top), v from the front."""
    c = Canvas(atlas, (x, y, w, h), even(-0.5, 0.5, w), even(0.3, -0.3, h), 1420, rough=0.16)
    for sx in (-1, 1):
        d = np.abs(c.x - sx * 0.235 - 0.05 * sx * c.y) - 0.028
        c.fill(np.maximum(d, np.abs(c.y) - 0.26), '1b1c1e', 0.2)
        c.fill(np.abs(d) - 0.004, 'b8babb', 0.2, 0.9)
    c.fill(np.hypot(c.x * 1.6, c.y - 0.10) - 0.05, 'c9cacb', 0.15, 1)
    c.line(np.hypot(c.x * 1.6, c.y - 0.10) - 0.065)
    c.weather(np.zeros_like(c.x), 0.5)
    c.put()
    atlas.uv['tank'] = atlas.rect(x, y, w, h)


def draw_fins(atlas, x, y, w=64, h=64):
    c = Canvas(atlas, (x, y, w, h), even(0, 0.4, w), even(0.4, 0, h), 1430, coat='8b8d8f', rough=0.45)
    k = 0.5 + 0.5 * np.cos(2 * np.pi * c.y / 0.036)
    c.h += 0.02 * k
    c.base = mix(rgb('121212'), c.base, smooth(0.25, 0.65, k))
    c.met = 0.9 * smooth(0.25, 0.65, k)
    c.put()
    atlas.uv['fins'] = atlas.rect(x, y, w, h)


def build(out):
    atlas = Atlas(512, 512)
    draw_human(atlas, 0, 0, 1400, trousers='1f2023', jacket='2b2c30', shoes='161514', rider=True)
    furniture(atlas, 0, 260, 'alloy', 'RL 885', 1440)
    atlas.swatch('coat', 166 + 24 * 13, 260 + 92, 'e4e4e0', 0.18)
    draw_tank(atlas, 260, 0)
    draw_fins(atlas, 392, 0)
    uv = atlas.uv
    v = Vehicle('motorcycle', atlas, (0.42, 0.035, 0.025))
    cap, person = rider(uv)
    body = [seat(uv)] + engine(uv) + chassis(uv) + person
    body.append(plate(atlas, (0, 0.655, -0.430), True, tilt=16, size=(0.21, 0.13)))
    v.body(tank_and_tail(uv) + cap, body)
    wheel_ = v.g.mesh('wheel', [(mag_wheel(atlas), v.trim)])
    v.g.node('wheel_rear', wheel_, (0, R, 0), parent=v.root)
    paint, trim = steering(uv)
    away = lambda ps: [q.move(*-STEER) for q in ps]
    turn = v.body(away(paint), away(trim), None, 'steering', t=STEER)
    v.g.node('wheel_front', wheel_, np.array([0, R, FRONT]) - STEER, parent=turn)
    lens = dome(0.092, 0.028, uv['glass_clear'], 12).rot('x', 90).move(0, 0.880, 1.278)
    v.lamp('lamp_head', away([lens])[0], 'glass_clear', tilted(5), turn)
    v.lamp('lamp_tail', lens_box((0.10, 0.055, 0.02), uv['glass_red'], (0, 0.815, -0.385), True), 'glass_red', TAIL)
    front = lens_box((0.055, 0.042, 0.016), uv['glass_amber'], (0.185, 0.86, 1.243))
    v.lamps('lamp_indicator_front', away([front])[0], 'glass_amber', tilted(0, 1, 19), turn)
    rear = lens_box((0.055, 0.042, 0.016), uv['glass_amber'], (0.165, 0.80, -0.363), True)
    v.lamps('lamp_indicator_rear', rear, 'glass_amber', tilted(0, -1, 19))
    v.g.save(out)


if __name__ == '__main__':
    here = os.path.dirname(os.path.abspath(__file__))
    build(os.path.join(here, '..', 'models', 'vehicle_motorcycle.glb'))
