"""The gallery of bump techniques: its maps, and `scenes/techniques.ron` with one figure per technique."""

import os
import numpy as np
from PIL import Image, ImageDraw, ImageFont
from techniques_maps import make, make_half
from techniques_scene import LABELS, scene
from texlib import *

HERE = os.path.dirname(os.path.abspath(__file__))
TEXTURES = os.path.join(HERE, '..', 'textures')
SIZE = 512
# From black to white, in widths of the image: the scene's height_scale_uv.
DEPTH = 0.06
LABEL_PIXELS = (768, 96)


def path(name):
    return os.path.join(TEXTURES, 'techniques_' + name)


def rounded_box(x, y, half, radius):
    """Signed distance to a square with round corners, negative inside."""
    ex, ey = np.abs(x) - half + radius, np.abs(y) - half + radius
    return np.hypot(np.maximum(ex, 0), np.maximum(ey, 0)) + np.minimum(np.maximum(ex, ey), 0) - radius


def letter(x, y, text, height):
    """How far (x, y), in tiles, lies within a letter as high as `height`: 0 outside, 1 inside, soft over its edge."""
    pixels = 512
    image = Image.new('L', (pixels, pixels), 0)
    ImageDraw.Draw(image).text((pixels / 2, pixels / 2), text, 255, ImageFont.load_default(pixels), anchor='mm',
                               stroke_width=6)
    # Capitals are 0.7 of the font's size.
    at = lambda t: np.clip(t / (height / 0.7) + 0.5, 0, 1) * (pixels - 1)
    return sample(blur(np.asarray(image, float) / 255, 5.0), at(x), at(y))


def pebbles(x, y):
    """Four round stones in a square of ±0.2."""
    top = np.zeros_like(x)
    places = ((-0.098, -0.100, 0.102), (0.106, -0.094, 0.094), (-0.104, 0.104, 0.093), (0.098, 0.100, 0.101))
    for cx, cy, radius in places:
        # Between a circle and a square.
        r = (np.abs(x - cx) ** 2.6 + np.abs(y - cy) ** 2.6) ** (1 / 2.6) / radius
        top = np.maximum(top, np.sqrt(np.clip(1 - r ** 2.4, 0, 1)))
    return top


def surface():
    """Four blocks in a running bond: a stud in a field, a letter, rings, pebbles. Returns base colour, specular and
    height."""
    u, v = coords(SIZE)
    wobble = lambda seed: noise(SIZE, seed, 1.6, 2, 14) * 0.0016
    row = (v >= 0.5).astype(int)
    across = (u + wobble(1) + 0.25 * row) % 1.0
    x, y = across % 0.5 - 0.25, (v + wobble(2)) % 0.5 - 0.25
    # The wobble may carry a texel across a border, within the joint: the row is taken anew.
    row = (((v + wobble(2)) % 1.0) >= 0.5).astype(int)
    kind = (across >= 0.5).astype(int) + 2 * row
    is_kind = lambda k: kind == k

    chips = np.maximum(noise(SIZE, 3, 1.2, 8, 60) - 1.0, 0) * 0.006
    block = rounded_box(x, y, 0.222, 0.04) + chips
    inside = smooth(0.004, -0.006, block)
    field = smooth(0.004, -0.004, rounded_box(x, y, 0.172, 0.02))
    r = np.hypot(x, y)
    step = lambda edge: smooth(edge + 0.004, edge - 0.004, r)

    grain = noise(SIZE, 4, 0.7, 40, 170)
    soft = noise(SIZE, 5, 1.3, 4, 40)
    rim = 0.96 - 0.14 * (1 - np.sqrt(np.clip(1 - np.clip(1 + block / 0.03, 0, 1) ** 2, 0, 1)))
    stud = np.sqrt(np.clip(1 - (r / 0.135) ** 2, 0, 1))
    glyph = letter(x, y, 'R', 0.24)
    stones = pebbles(x, y)
    heights = [
        mix(rim, 0.40 + 0.60 * stud, field),
        mix(rim, 0.44 + 0.54 * glyph, field),
        rim - 0.62 * step(0.19) + 0.50 * step(0.148) - 0.62 * step(0.100) + 0.72 * step(0.052),
        0.26 + 0.72 * stones,
    ]
    polished = np.select([is_kind(0)], [smooth(0.0, 0.05, stud)], 0.0)
    roughness = 0.009 * (1 - 0.9 * polished)
    top = np.select([is_kind(k) for k in range(4)], heights) + roughness * grain + 0.006 * soft * (1 - polished)
    joint = 0.07 + 0.022 * noise(SIZE, 6, 0.8, 20, 150) + 0.02 * noise(SIZE, 7, 1.2, 4, 40)
    height = np.clip(mix(joint, top, inside), 0, 1)

    sand, slate, clay, cream = rgb('b3946a'), rgb('69798a'), rgb('a8664a'), rgb('cfc3a4')
    paint = [
        mix(mix(sand, sand * 0.72, field), rgb('c9a24b'), polished),
        mix(slate, mix(slate * 0.62, cream, smooth(0.3, 0.7, glyph)), field),
        mix(clay, clay * np.array([0.62, 0.60, 0.66]),
            step(0.19) * (1 - step(0.148)) + step(0.100) * (1 - step(0.052))),
        mix(rgb('6d6558'), mix(rgb('8d9079'), rgb('a79d8c'), ((x > 0) ^ (y > 0)).astype(float)),
            smooth(0.05, 0.3, stones)),
    ]
    colour = np.select([is_kind(k)[..., None] for k in range(4)], paint)
    cloud = noise(SIZE, 8, 1.2, 3, 60)
    colour = colour * (1 + (0.07 * cloud + 0.055 * grain) * (1 - 0.8 * polished))[..., None]
    mortar = rgb('4c4741') * (1 + 0.10 * noise(SIZE, 9, 0.7, 20, 200))[..., None]
    base = mix(mortar, colour, inside)

    reflects = np.select([is_kind(k) for k in range(4)],
                         [0.22 + 0.6 * polished, 0.30 + 0.25 * field * glyph, 0.18, 0.40 * stones])
    specular = mix(0.03, reflects * (1 - 0.12 * grain * (1 - polished)), inside)
    return np.clip(base, 0, 1), np.clip(specular, 0, 1), height


def grey16(height):
    """As 16-bit levels. Every 32nd only: half floats, in which they are drawn, hold no more, and the file halves."""
    return np.minimum(np.round(height * 2047) * 32.016, 65535).astype(np.uint16)


def halved(a):
    """Every 2 × 2 pixels as one."""
    return a.reshape(a.shape[0] // 2, 2, a.shape[1] // 2, 2, *a.shape[2:]).mean((1, 3))


def environment(width=1024):
    """A studio at evening, all around: sky, a low sun, a wall of windows, a striped floor."""
    u, v = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(width // 2) + 0.5) / (width // 2))
    azimuth, elevation = u * 360 - 180, 90 - v * 180
    sky = mix(rgb('e8cfa8'), rgb('2f5a94'), smooth(0, 55, elevation))
    off_sun = np.hypot((azimuth - 70) * np.cos(np.radians(elevation)), elevation - 22)
    sky = (sky + np.array([1.0, 0.80, 0.45]) * (0.75 * np.exp(-(off_sun / 16) ** 2)
                                                + 2.0 * smooth(6.5, 5.0, off_sun))[..., None])
    # The floor: boards toward the horizon, by the foot of each line of sight.
    foot = 1.0 / np.tan(np.radians(np.maximum(-elevation, 1.0)))
    across, along = foot * np.sin(np.radians(azimuth)), foot * np.cos(np.radians(azimuth))
    far = smooth(9.0, 2.0, foot)
    boards = 0.5 + far * ((np.floor(across * 1.2) + np.floor(along * 1.2)) % 2 - 0.5)
    floor = mix(mix(rgb('3a302a'), rgb('8d7a66'), boards), rgb('6b5b50'), smooth(4.0, 12.0, foot))
    picture = mix(floor, sky, smooth(-0.6, 0.6, elevation))
    panel = lambda a, e, w, h: (smooth(1.0, -1.0, np.abs(azimuth - a) - w)
                                * smooth(1.0, -1.0, np.abs(elevation - e) - h))[..., None]
    for at in (-150, -120, -90, -60):
        frame, glass = panel(at, 32, 13, 24), panel(at, 32, 11, 22)
        bars = np.maximum(panel(at, 32, 0.8, 22), panel(at, 36, 11, 0.8))
        picture = mix(picture, rgb('22262b'), frame[..., 0])
        picture = mix(picture, np.array([1.0, 0.98, 0.93]), (glass * (1 - bars))[..., 0])
    picture = mix(picture, rgb('c8452f'), panel(0, 14, 7, 14)[..., 0])
    picture = mix(picture, rgb('2c7f78'), panel(150, 16, 10, 16)[..., 0])
    return np.clip(picture, 0, 1)


def pattern(size=256):
    """What stands behind the refracting figure: a checkerboard with a line around every other square."""
    u, v = coords(size)
    column, row = np.floor(u * 8), np.floor(v * 8)
    edge = np.maximum(np.abs(u * 8 % 1 - 0.5), np.abs(v * 8 % 1 - 0.5))
    colour = mix(rgb('e9e2cf'), rgb('274b73'), (column + row) % 2)
    colour = mix(colour, rgb('c8502f'), smooth(0.30, 0.26, edge) * ((column + 2 * row) % 4 == 0))
    return to8(colour)


def labels():
    """The names, one row of the image each."""
    width, height = LABEL_PIXELS
    image = Image.new('RGB', (width, height * len(LABELS)), (34, 38, 44))
    draw = ImageDraw.Draw(image)
    font = ImageFont.load_default(58)
    for row, text in enumerate(LABELS):
        draw.text((width / 2, (row + 0.5) * height), text, (236, 232, 222), font, anchor='mm')
    return image.quantize(16, dither=Image.Dither.NONE)


def main():
    base, specular, height = surface()
    save_jpg(path('base.jpg'), base)
    save_png(path('specular.png'), to8(np.round(halved(specular) * 31) / 31))
    save_png(path('height.png'), grey16(height))
    make('normal', path('height.png'), path('normal.png'), DEPTH)
    # A mirror shows every grain, and slopes of more than 45 degrees are all the same to it.
    make_half('offset', path('height.png'), path('offset.png'), DEPTH, sigma=4)
    # Horizons change slowly, and there are eight of them.
    make_half('horizon', path('height.png'), path('horizon.png'), DEPTH)
    save_jpg(path('environment.jpg'), environment())
    save_png(path('pattern.png'), pattern())
    labels().save(path('labels.png'), optimize=True)
    with open(os.path.join(HERE, '..', 'scenes', 'techniques.ron'), 'w', newline='\n') as file:
        file.write(scene(DEPTH))


if __name__ == '__main__':
    main()
