"""A person on foot: arms and legs are nodes of their own, hanging straight down."""

import os
from humanlib import *

HIP, SHOULDER = (0.092, 0.900, 0.0), (0.178, 1.392, -0.012)


def build(out):
    atlas = Atlas(256, 256)
    draw_human(atlas, 0, 0, 1200)
    uv = atlas.uv
    v = Vehicle('person', atlas, (0.30, 0.075, 0.045))
    trunk = torso((0, 0.93, 0.0), (0, 1.26, 0.012), (0, 1.485, -0.012), uv)
    g = v.g
    skull = head((0, 1.50, -0.008), (0, 1.632, 0.012), uv)
    shaped(v, 'body', (0, 0, 0), [trunk], skull)
    for side, sx in (('left', 1), ('right', -1)):
        hip, shoulder = np.array(HIP), np.array(SHOULDER)
        down = [leg(hip, (0.100, 0.480, 0.012), (0.100, 0.095, -0.012), uv),
                shoe((0.102, 0.092, -0.012), (0.06, 0.0, 1.0), uv)]
        coat = [arm(shoulder, (0.226, 1.120, -0.030), (0.232, 0.880, 0.012), uv)]
        palm = [hand((0.232, 0.890, 0.012), (0.228, 0.775, 0.035), uv['skin_rect'])]
        turn = (lambda ps: ps) if sx > 0 else (lambda ps: [mirror_x(p) for p in ps])
        shaped(v, 'leg_' + side, hip * (sx, 1, 1), [], turn(down))
        shaped(v, 'arm_' + side, shoulder * (sx, 1, 1), turn(coat), turn(palm))
    g.save(out)


def shaped(v, name, origin, paint, trim):
    """A node at `origin` with parts given in the root's space."""
    move = lambda ps: [p.move(*-np.asarray(origin)) for p in ps]
    v.body(move(paint), move(trim), None, name, t=origin)


if __name__ == '__main__':
    here = os.path.dirname(os.path.abspath(__file__))
    build(os.path.join(here, '..', 'models', 'person.glb'))
