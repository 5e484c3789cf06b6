"""Vehicles of a few boxes: for pictures of some dozen pixels, of which many are drawn each second."""

import os
import sys

from meshlib import Glb, box, merge

MODELS = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', 'models')

# Metres: width, height and length of the whole; the cabin's roof as parts of the length from the rear; of the body's
# height what is below the windows; wheels along the vehicle, and their radius.
SHAPES = {
    'block_car': dict(size=(1.8, 1.45, 4.2), cabin=(0.12, 0.62), body=0.60, axles=(0.19, 0.80), radius=0.32),
    'block_van': dict(size=(1.95, 2.2, 4.9), cabin=(0.66, 0.84), body=0.95, axles=(0.18, 0.82), radius=0.34),
    'block_truck': dict(size=(2.5, 3.2, 8.0), cabin=(0.80, 0.97), body=0.95, axles=(0.16, 0.85), radius=0.50),
}


def build(name):
    shape = SHAPES[name]
    width, height, length = shape['size']
    radius, low = shape['radius'], 0.25
    rear = -shape['axles'][0] * length
    body_top = low + (height - low) * shape['body']
    start, end = (rear + part * length for part in shape['cabin'])
    middle = rear + length / 2
    paint = [box(width, body_top - low, length).move(0, (body_top + low) / 2, middle)]
    dark = []
    if body_top < height - 0.2:
        paint.append(box(width * 0.86, 0.10, end - start - 0.3).move(0, height - 0.05, (start + end) / 2))
        dark.append(box(width * 0.88, height - body_top, end - start).move(0, (height + body_top) / 2 - 0.06, (start + end) / 2))
    else:
        # A windscreen in front, and windows at the sides of it.
        dark.append(box(width * 0.86, height * 0.26, 0.06).move(0, height * 0.68, rear + length))
        dark.append(box(width * 1.01, height * 0.22, end - start).move(0, height * 0.70, (start + end) / 2))
    for part in shape['axles']:
        for side in (-1, 1):
            dark.append(box(0.24, 2 * radius, 2 * radius * 0.92).move(side * (width / 2 - 0.10), radius, rear + part * length))
    g = Glb()
    paint_material = g.material('paint', color=(0.5, 0.05, 0.05, 1), metallic=0.0, roughness=0.5)
    dark_material = g.material('dark', color=(0.03, 0.03, 0.035, 1), metallic=0.0, roughness=0.4)
    g.node(name, g.mesh(name, [(merge(*paint), paint_material), (merge(*dark), dark_material)]))
    g.save(os.path.join(MODELS, name + '.glb'))


def main():
    for name in SHAPES:
        build(name)


if __name__ == '__main__':
    sys.exit(main())
