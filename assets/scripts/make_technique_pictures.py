"""The pictures of `docs/techniques.md`: small scenes, drawn with one technique after the other, side by side.

`make_technique_pictures.py relief horizon` makes some of them.
"""

import os
import subprocess
import sys
import tempfile
import numpy as np
from PIL import Image, ImageDraw, ImageFont
from techniques_maps import program

HERE = os.path.dirname(os.path.abspath(__file__))
ASSETS = os.path.join(HERE, '..')
IMAGES = os.path.join(HERE, '..', '..', 'docs', 'images')
# Of all panes of a picture; drawn twice as large.
WIDTH = 780
GAP, BAR = 6, 24

SCENE = '''\
(
    environment: (ambient: (0.09, 0.10, 0.12), zenith: (0.10, 0.16, 0.28), horizon: (0.32, 0.36, 0.42), tone_map: aces),
    materials: {
        "stone": (
            shading: blinn, shininess: %(shininess)s, specular_factor: (0.8, 0.8, 0.8), %(stone)s
            normal_map: "%(maps)snormal.png", %(specular)s
            height_map: "%(height)s", height_scale_uv: 0.06, emboss_step_texels: 8,
            horizon_map_0: "%(maps)shorizon_0.png", horizon_map_1: "%(maps)shorizon_1.png",
            offset_map: "%(maps)soffset.png", environment_map: "%(maps)senvironment.jpg",
        ),
        "smooth": (shading: blinn, shininess: %(shininess)s, specular_factor: (0.6, 0.6, 0.6), base_factor: (0.5, 0.3, 0.05)),
        "plain": (specular_factor: (0.1, 0.1, 0.1), base_factor: srgb("#d8d2c4"), technique: off),
        "panel": (shading: unlit, base_map: (file: "%(maps)spattern.png", uv: (scale: (3, 2)))),
    },
    meshes: {
        "floor": plane(size: (6, 6), tile_metres: 1.5),
        "torus": torus(major: 0.53, minor: 0.24, segments: 128, sides: 64, uv_scale: (4, 2)),
        "ball": sphere(radius: 0.33, segments: 24, rings: 12, uv_scale: (2, 1)),
        "fine ball": sphere(radius: 0.33, segments: 256, rings: 128),
        "globe": sphere(radius: 0.5, segments: 128, rings: 64, uv_scale: (2, 1)),
        "pane": cube(size: (1.3, 1.0, 0.01)),
        "slab": cube(size: (0.9, 0.7, 0.06)),
        "panel": plane(size: (4.5, 3)),
    },
    entities: [
        %(things)s
        (transform: (translation: %(eye)s, look_at: %(at)s), camera: (fov_y_degrees: %(fov)s)),
    ],
)
'''
TEXTURED = 'base_map: "%sbase.jpg",'
# Fields of a scene that most pictures share: a floor, seen from half above, under a lamp on the left.
USUAL = {
    'stone': TEXTURED, 'specular': 'specular_map: "%sspecular.png",', 'shininess': 40,
    'things': '(mesh: "floor", material: "stone"), %s', 'eye': '(0.15, 1.05, 1.5)', 'at': '(0.1, 0, 0.12)', 'fov': 38,
}
LAMP = '''(
            light: directional(color: (1, 0.95, 0.86), intensity: 1.1),
            transform: (translation: (-%s, %s, -0.9), look_at: (0, 0, 0)),
        ),'''
HIGH, LOW = LAMP % (2.0, 2.4), LAMP % (2.4, 0.95)
NEAR = '''(
            light: point(color: (1, 0.95, 0.86), intensity: 1.3, attenuation: (1, 0, 0.2)),
            transform: (translation: (-0.2, 0.6, 1.2)),
        ),'''


def pane_size(count, shape):
    width = (WIDTH + GAP) // count - GAP
    return width, round(width * shape)


def draw(technique, folder, size, **fields):
    """A pane."""
    maps = os.path.abspath(os.path.join(ASSETS, 'textures', 'techniques_'))
    values = {**USUAL, 'light': HIGH, 'maps': maps, 'height': maps + 'height.png', **fields}
    for field in ('stone', 'specular'):
        values[field] = values[field].replace('%s', maps)
    values['things'] = values['things'].replace('%s', values['light'])
    scene = os.path.join(folder, 'scene.ron')
    with open(scene, 'w') as file:
        file.write(SCENE % values)
    width, height = size
    command = [program(), 'render', scene, '-o', folder, '--size', '%dx%d' % (2 * width, 2 * height)]
    subprocess.run(command + ['--technique', technique], check=True, stdout=subprocess.DEVNULL)
    picture = Image.open(os.path.join(folder, 'color_00000.png')).convert('RGB')
    return picture.resize((width, height), Image.Resampling.LANCZOS)


def beside(panes, names):
    """Panes in a row, the name of each below it."""
    width, height = panes[0].size
    sheet = Image.new('RGB', (len(panes) * (width + GAP) - GAP, height + BAR), (22, 25, 30))
    pen, font = ImageDraw.Draw(sheet), ImageFont.load_default(15)
    for i, (pane, name) in enumerate(zip(panes, names)):
        x = i * (width + GAP)
        sheet.paste(pane, (x, 0))
        pen.text((x + width / 2, height + BAR / 2), name, (236, 232, 222), font, anchor='mm')
    return sheet


def techniques(*names, shape=0.62, **fields):
    """The same scene by each of these techniques. `shape`: height of a pane over its width."""
    def picture(folder):
        return beside([draw(name, folder, pane_size(len(names), shape), **fields) for name in names], names)
    return picture


def eight_bits(image):
    return Image.fromarray(np.round(np.asarray(image) / 257).astype(np.uint8))


def maps(folder):
    """The gallery's own."""
    names = ('height', 'normal', 'horizon_0', 'offset')
    panes, size = [], pane_size(4, 1)[0]
    for name in names:
        image = Image.open(os.path.join(ASSETS, 'textures', 'techniques_%s.png' % name))
        if name == 'height':
            image = eight_bits(image)
        # Without its alpha, which is the fourth direction.
        image = Image.merge('RGB', (image.split() * 3)[:3])
        panes.append(image.resize((size, size), Image.Resampling.LANCZOS))
    return beside(panes, ('height', 'normal', 'horizon, 0° 45° 90°', 'offset'))


TORUS = '(mesh: "torus", material: "stone", transform: (rotation_degrees: (32, -22, 0))), %s'
FRONT = {'eye': '(0, 0, 5)', 'at': '(0, 0, 0)', 'fov': 15}
FROM_FRONT = LAMP.replace('-0.9', '1.6') % (2.0, 2.4)
MIRROR = 'base_factor: (0.05, 0.05, 0.055), offset_matrix: ((%s, 0), (0, %s)),'
GLASS = 'alpha_mode: blend, base_factor: (0.75, 0.90, 0.95), base_alpha: 0.15, offset_matrix: ((%s, 0), (0, %s)),'
GLOBE = '(mesh: "globe", material: "stone", transform: (rotation_degrees: (20, 40, 0))), %s'
PANES = '''(mesh: "pane", material: "stone", transform: (rotation_degrees: (10, 20, 0))), %s
        (mesh: "panel", material: "panel", transform: (translation: (0, 0, -0.8), rotation_degrees: (90, 0, 0))),'''
BALL = '(mesh: "ball", material: "stone", transform: (rotation_degrees: (0, 60, 0))), %s'
FINE_BALL = '(mesh: "fine ball", material: "smooth"), %s'
CUT = '''(mesh: "floor", material: "stone"),
        (mesh: "slab", material: "plain", transform: (translation: (0.1, 0.1, 0.1), rotation_degrees: (-35, 25, 0))), %s'''


def perturbed_uv(folder):
    """A mirror and a glass, without and with offsets."""
    panes = []
    for things, material, amounts in ((GLOBE, MIRROR, (0, 0.3)), (PANES, GLASS, (0, 0.5))):
        for amount in amounts:
            # The maps' folder stands where there is %s in the fields.
            stone = material.replace('%s', str(amount))
            panes.append(draw('perturbed_uv', folder, pane_size(4, 0.8), things=things, stone=stone, specular='',
                              light=FROM_FRONT, **FRONT))
    return beside(panes, ('reflection, no offset', 'with offset', 'refraction, no offset', 'with offset'))


def dot3(folder):
    """A ball of few triangles, and the highlight of one of many."""
    size, lamp = pane_size(4, 0.8), {'light': NEAR, 'shininess': 80}
    bumpy = [draw(name, folder, size, things=BALL, **lamp, **{**FRONT, 'fov': 8.6}) for name in ('normal', 'dot3')]
    near = {'eye': '(0, 0, 5)', 'at': '(-0.05, 0.08, 0.3)', 'fov': 3}
    shiny = [draw(name, folder, size, things=FINE_BALL, **lamp, **near) for name in ('dot3', 'dot3_constant')]
    return beside(bumpy + shiny, ('normal', 'dot3', 'dot3, a highlight', 'dot3_constant, the same'))


def perturbed_normal(folder):
    """From near by, and from very near with heights of 16 and of 8 bits."""
    coarse = os.path.join(folder, 'height.png')
    eight_bits(Image.open(os.path.join(ASSETS, 'textures', 'techniques_height.png'))).save(coarse)
    size = pane_size(4, 0.8)
    by = {'eye': '(-0.1, 0.5, 0.75)', 'at': '(-0.12, 0, 0.2)'}
    panes = [draw(name, folder, size, **by) for name in ('normal', 'perturbed_normal')]
    near = {'eye': '(0.35, 0.2, 0.5)', 'at': '(0.33, 0, 0.33)', 'fov': 25}
    panes.append(draw('perturbed_normal', folder, size, **near))
    panes.append(draw('perturbed_normal', folder, size, height=coarse, **near))
    return beside(panes, ('normal', 'perturbed_normal', 'the same, very near', '8-bit heights'))


PICTURES = {
    'maps': maps,
    'emboss': techniques('off', 'emboss', 'normal'),
    'dot3': dot3,
    'normal': techniques('off', 'normal'),
    'perturbed_normal': perturbed_normal,
    'perturbed_uv': perturbed_uv,
    'parallax': techniques('normal', 'parallax', 'relief', eye='(0.15, 0.42, 1.5)', at='(0.1, 0, 0.1)', fov=30),
    'relief': techniques('normal', 'relief', light=LOW),
    'horizon': techniques('normal', 'horizon', light=LOW),
    'z_correct': techniques('relief', 'z_correct', things=CUT, light=FROM_FRONT),
    'combined': techniques('off', 'normal', 'combined', things=TORUS, light=FROM_FRONT, **FRONT),
}


def main():
    for name in sys.argv[1:] or PICTURES:
        with tempfile.TemporaryDirectory() as folder:
            picture = PICTURES[name](folder)
        picture.save(os.path.join(IMAGES, 'technique_%s.jpg' % name), quality=88, optimize=True)


if __name__ == '__main__':
    main()
