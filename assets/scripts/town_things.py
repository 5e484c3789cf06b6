"""What stands about in the town: signal, tree, bus shelter, fountain, bench. Each a model of
its own, models/town_NAME.glb, plain materials, origin on the ground, front toward +Z."""

import os
import numpy as np
from meshlib import Glb, aim, arc, box, lathe, merge, rotation, tube, Part

OUT = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', 'models')


def iron(g):
    return g.material('iron', color=(0.022, 0.026, 0.026, 1), metallic=0, roughness=0.45)


def signal():
    """A post with a head of three lamps at 2.6 to 3.3 m; they shine toward +Z."""
    g = Glb()
    m, border = iron(g), g.material('border', color=(0.55, 0.55, 0.52, 1), metallic=0, roughness=0.6)
    post = [lathe([(0.0, 0.0), (0.13, 0.0), (0.13, 0.05), (0.075, 0.10), (0.065, 0.9), (0.055, 0.95), (0.055, 3.45),
                   (0.0, 3.50)], 12, 40)]
    y = [3.22, 2.92, 2.62]
    post += [box(0.28, 0.98, 0.16, 0.03).move(0, 2.92, 0.14), box(0.50, 1.20, 0.02, 0.0).move(0, 2.92, 0.06)]
    for h in y:                                                     # hoods: the upper part of a tube
        a = np.radians(np.linspace(-20, 200, 9))
        P, N, UV, F = [], [], [], []
        for s, inward in ((1, 1), (-1, -1)):
            base = len(P)
            for k, t in enumerate(a):
                for z, e in ((0.21, 0.0), (0.40, -0.0)):
                    P.append((0.122 * np.cos(t), h + 0.122 * np.sin(t), z - 0.06 * (1 - np.sin(t)) * (z > 0.3)))
                    N.append((s * np.cos(t), s * np.sin(t), 0)); UV.append((k * 0.05, z))
            for k in range(8):
                q = base + 2 * k
                f = [(q, q + 1, q + 3), (q, q + 3, q + 2)]
                F += f if s < 0 else [t[::-1] for t in f]
        post.append(Part(P, N, UV, F))
    rim = [box(0.50, 0.03, 0.012).move(0, 2.92 + s * 0.585, 0.076) for s in (-1, 1)]
    rim += [box(0.03, 1.14, 0.012).move(s * 0.235, 2.92, 0.076) for s in (-1, 1)]
    root = g.node('signal', g.mesh('post', [(merge(post), m), (merge(rim), border)]))
    for name, h, colour in zip(('red', 'amber', 'green'), y,
                               ((0.30, 0.012, 0.008), (0.32, 0.12, 0.008), (0.01, 0.22, 0.09))):
        glass = g.material('glass_' + name, color=(*colour, 1), metallic=0, roughness=0.2)
        # in the node's space: a dome toward -Z
        dome = lathe([(0.105, 0.0), (0.095, 0.022), (0.06, 0.042), (0.0, 0.05)], 14, 80).rot('x', -90)
        g.node('lamp_' + name, g.mesh('glass_' + name, [(dome, glass)]), (0, h, 0.222), aim((0, 0, 1)), root)
    g.save(os.path.join(OUT, 'town_signal.glb'))


def tree():
    """A small lime tree, 7 m: a forked trunk, and leaves as squares that are lit as a crown."""
    g = Glb()
    bark = g.material('bark', color=(0.075, 0.055, 0.04, 1), metallic=0, roughness=0.9)
    leaf = [g.material('leaf_%d' % k, color=(*c, 1), metallic=0, roughness=0.75, double=True)
            for k, c in enumerate(((0.10, 0.13, 0.03), (0.20, 0.15, 0.03), (0.26, 0.11, 0.02)))]
    rng = np.random.default_rng(77)
    wood = [tube([(0, 0, 0), (0.02, 1.2, 0.03), (-0.03, 2.4, 0.0), (0.05, 3.8, 0.05), (0.0, 5.6, 0.0)],
                 [0.17, 0.13, 0.11, 0.07, 0.02], 8)]
    tips = []
    for k in range(9):
        a, h = k * 2.4, 2.2 + 0.32 * k
        reach = 1.9 - 0.13 * k
        end = np.array([reach * np.cos(a), h + 1.1, reach * np.sin(a)])
        wood.append(tube([(0, h, 0), (0.5 * end[0], h + 0.45, 0.5 * end[2]), end], [0.055, 0.04, 0.012], 5))
        tips.append(end)
    centre = np.array([0, 4.6, 0])
    parts = [[], [], []]
    n = 620
    for k in range(n):
        if k % 3:
            p = tips[rng.integers(len(tips))] + rng.normal(0, 0.48, 3)
        else:
            d = rng.normal(0, 1, 3)
            p = centre + d / np.linalg.norm(d) * np.array([2.0, 2.3, 2.0]) * rng.uniform(0.5, 1.0) ** 0.5
        p[1] = max(p[1], 2.5)
        out = p - centre + (0, 0.6, 0)
        out /= np.linalg.norm(out)
        u = rng.normal(0, 1, 3); u /= np.linalg.norm(u)
        v = np.cross(u, rng.normal(0, 1, 3)); v /= np.linalg.norm(v)
        if np.cross(u, v) @ out < 0:
            v = -v
        s = rng.uniform(0.10, 0.16)
        q = [p + s * (-u - 0.6 * v), p + s * (u - 0.6 * v), p + s * (u + 0.6 * v), p + s * (-u + 0.6 * v)]
        face = np.cross(u, v)
        lit = out * 0.6 + face * 0.4
        lit /= np.linalg.norm(lit)
        parts[min(2, int(rng.random() ** 1.6 * 3))].append(Part(q, [lit] * 4, [(0, 1), (1, 1), (1, 0), (0, 0)],
                                                                [(0, 1, 2), (0, 2, 3)]))
    g.node('tree', g.mesh('tree', [(merge(wood), bark)] + [(merge(p), m) for p, m in zip(parts, leaf) if p]))
    g.save(os.path.join(OUT, 'town_tree.glb'))


def shelter():
    """A bus shelter, 4.2 m wide, open toward +Z, with a bench and a lit poster at its end."""
    g = Glb()
    m = iron(g)
    wood = g.material('wood', color=(0.20, 0.10, 0.045, 1), metallic=0, roughness=0.6)
    glass = g.material('pane', color=(0.05, 0.07, 0.08, 1), metallic=0, roughness=0.08)
    poster = g.material('poster', color=(0.85, 0.90, 0.95, 1), metallic=0, roughness=0.4, emissive=(0.62, 0.72, 0.80))
    print_ = g.material('print', color=(0.45, 0.05, 0.04, 1), metallic=0, roughness=0.4, emissive=(0.35, 0.03, 0.02))
    tubes = g.material('tube', color=(1, 0.95, 0.85, 1), metallic=0, roughness=0.4, emissive=(1.0, 0.92, 0.75))
    frame = [box(4.4, 0.10, 1.7, 0.02).move(0, 2.45, -0.75), box(4.2, 0.06, 0.06, 0.01).move(0, 0.35, -1.5)]
    for x in (-2.1, -0.7, 0.7, 2.1):
        frame.append(box(0.07, 2.4, 0.07, 0.01).move(x, 1.2, -1.5))
    frame += [box(0.07, 2.4, 0.07, 0.01).move(x, 1.2, -0.1) for x in (-2.1,)]
    frame += [box(0.10, 2.2, 1.30, 0.02).move(2.1, 1.30, -0.78)]
    frame += [lathe([(0.0, 0), (0.05, 0), (0.035, 0.05), (0.035, 2.7), (0.0, 2.72)], 8).move(-2.9, 0, 0.2),
              box(0.50, 0.50, 0.04, 0.01).move(-2.9, 2.75, 0.2)]
    panes = ([box(1.32, 1.9, 0.02).move(x, 1.38, -1.5) for x in (-1.4, 0, 1.4)]
             + [box(0.02, 1.9, 1.2).move(-2.1, 1.38, -0.8)])
    bench = [box(2.6, 0.045, 0.11, 0.01).move(-0.4, 0.48, -1.30 + 0.13 * k) for k in range(3)]
    bench += [box(0.06, 0.46, 0.34, 0.01).move(x, 0.23, -1.17) for x in (-1.5, 0.7)]
    lit = [box(0.03, 1.75, 1.05).move(2.035, 1.35, -0.78), box(0.03, 1.75, 1.05).move(2.165, 1.35, -0.78)]
    red = [box(0.012, 0.5, 0.7).move(2.012, 1.65, -0.78), box(0.012, 0.5, 0.7).move(2.188, 1.65, -0.78),
           box(0.36, 0.36, 0.012).move(-2.9, 2.75, 0.226)]
    light = [box(2.6, 0.035, 0.08).move(0, 2.375, -0.75)]
    root = g.node('shelter', g.mesh('shelter', [(merge(frame), m), (merge(panes), glass), (merge(bench), wood),
                                                (merge(lit), poster), (merge(red), print_), (merge(light), tubes)]))
    g.node('lamp', None, (0, 2.25, -0.6), aim((0, -1, 0)), root)
    g.save(os.path.join(OUT, 'town_shelter.glb'))


def bench():
    g = Glb()
    m, wood = iron(g), g.material('wood', color=(0.17, 0.085, 0.04, 1), metallic=0, roughness=0.6)
    legs = [box(0.06, 0.44, 0.06, 0.01).move(x, 0.22, z) for x in (-0.75, 0.75) for z in (-0.2, 0.2)]
    legs += [box(0.05, 0.5, 0.05, 0.01).rot('x', -12).move(x, 0.66, -0.26) for x in (-0.75, 0.75)]
    planks = [box(1.8, 0.04, 0.10, 0.01).move(0, 0.46, -0.18 + 0.125 * k) for k in range(4)]
    planks += [box(1.8, 0.10, 0.035, 0.01).rot('x', -12).move(0, 0.62 + 0.15 * k, -0.235 - 0.032 * k) for k in range(2)]
    g.node('bench', g.mesh('bench', [(merge(legs), m), (merge(planks), wood)]))
    g.save(os.path.join(OUT, 'town_bench.glb'))


def basin():
    """A round basin of stone with water in it and a plinth in the middle, 1.35 m high."""
    g = Glb()
    stone = g.material('stone', color=(0.36, 0.34, 0.31, 1), metallic=0, roughness=0.85)
    water = g.material('water', color=(0.010, 0.018, 0.022, 1), metallic=0, roughness=0.05)
    rim = lathe([(2.75, 0.0), (2.75, 0.10), (2.55, 0.14), (2.50, 0.42), (2.62, 0.46), (2.62, 0.55), (2.56, 0.58),
                 (2.22, 0.58), (2.18, 0.55), (2.18, 0.20)], 40, 30)
    foot = lathe([(0.80, 0.2), (0.80, 0.55), (0.62, 0.62), (0.50, 0.72), (0.46, 1.10), (0.54, 1.20), (0.66, 1.24),
                  (0.66, 1.34), (0.62, 1.36), (0.0, 1.36)], 28, 30)
    pool = lathe([(2.2, 0.44), (0.7, 0.44)], 40)
    if pool.N[:, 1].mean() < 0:
        pool = pool.flip()
    g.node('basin', g.mesh('basin', [(merge([rim, foot]), stone), (pool, water)]))
    g.save(os.path.join(OUT, 'town_basin.glb'))


def build():
    for make in (signal, tree, shelter, bench, basin):
        make()


if __name__ == '__main__':
    build()
