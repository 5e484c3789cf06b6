"""The text of `scenes/techniques.ron`: a wall of figures, one per technique, under one light that goes round."""

ROWS = [
    ['off', 'emboss', 'emboss_multipass', 'dot3', 'dot3_constant', 'normal'],
    ['perturbed_normal', 'perturbed_uv', 'perturbed_uv, refracting', 'parallax', 'relief', 'horizon'],
    ['parallax_horizon', 'relief_horizon', 'z_correct_parallax', 'z_correct', 'combined'],
]
LABELS = [name for row in ROWS for name in row]
REFRACTING = 'perturbed_uv, refracting'
CELL = (1.7, 1.92)
# Texels: enough for emboss to show on the sheet, where the maps are small.
EMBOSS_STEP = 12
# Times the offset map: more, and what is mirrored, or seen through the glass, cannot be made out.
OFFSET = 0.5
GLASS_OFFSET = 0.6

HEAD = '''\
// One figure, once for each bump technique, under one light that goes round. `make_techniques.py` writes this file.
// In the window: F changes the figure (torus, sphere, cube, quad), B switches bump mapping off and on.
(
    environment: (
        ambient: (0.045, 0.05, 0.06),
        zenith: (0.10, 0.16, 0.28), horizon: (0.32, 0.36, 0.42), ground: (0.06, 0.055, 0.05),
        tone_map: aces,
    ),

    meshes: {
        // The image repeats so that texels are about square.
        "torus": torus(major: 0.53, minor: 0.24, segments: 128, sides: 64, uv_scale: (4, 2)),
        "sphere": sphere(radius: 0.66, segments: 128, rings: 64, uv_scale: (4, 2)),
        "cube": cube(size: 1.0),
        // A plane would lie down.
        "quad": cube(size: (1.3, 1.3, 0.01), uv_scale: (2, 2)),
        "label": plane(size: (1.4, 0.175)),
        "panel": plane(size: (1.66, 1.5)),
        "wall": plane(size: (40, 24)),
    },
'''

MATERIAL = '''\
        "%(name)s": (
            shading: blinn, shininess: 40, specular_factor: (0.8, 0.8, 0.8), technique: %(technique)s,
            %(base)snormal_map: "../textures/techniques_normal.png",
            specular_map: "../textures/techniques_specular.png",
            height_map: "../textures/techniques_height.png", height_scale_uv: %(depth)s,
            horizon_map_0: "../textures/techniques_horizon_0.png",
            horizon_map_1: "../textures/techniques_horizon_1.png",
            offset_map: "../textures/techniques_offset.png", offset_matrix: ((%(offset)s, 0), (0, %(offset)s)),
            emboss_step_texels: %(step)s,
            environment_map: "../textures/techniques_environment.jpg",
        ),
'''
STONE = 'base_map: "../textures/techniques_base.jpg",\n            '
GLASS = 'alpha_mode: blend, base_factor: (0.75, 0.90, 0.95), base_alpha: 0.25,\n            '

LABEL = '''\
        "%(name)s, label": (
            shading: unlit, sampler: (wrap: clamp),
            base_map: (file: "../textures/techniques_labels.png", uv: (scale: (1, %(scale).6f), offset: (0, %(offset).6f))),
        ),
'''

CELL_ENTITY = '''\
        (name: "%(name)s", transform: (translation: (%(x).2f, %(y).2f, 0)), children: [
            (
                name: "%(name)s, figure", material: "%(name)s", figure: ["torus", "sphere", "cube", "quad"],
                transform: (translation: (0, 0.16, 0), rotation_degrees: (32, -22, 0)),
            ),
            (
                name: "%(name)s, label", mesh: "label", material: "%(name)s, label",
                transform: (translation: (0, -0.78, 0.3), rotation_degrees: (90, 0, 0)),
            ),
%(more)s        ]),
'''
PANEL = '''\
            // What is refracted.
            (
                name: "panel", mesh: "panel", material: "panel",
                transform: (translation: (0, 0.16, -0.75), rotation_degrees: (90, 0, 0)),
            ),
'''

TAIL = '''\
        (
            name: "wall", mesh: "wall", material: "wall",
            transform: (translation: (0, 0, -1), rotation_degrees: (90, 0, 0)),
        ),
        // Far enough away to shine on all figures from about the same side.
        (name: "around", spin: (axis: (0, 0, -1), degrees_per_second: 18), children: [
            (
                name: "lamp", transform: (translation: (-9, 8, 12)),
                light: point(color: kelvin(5200), intensity: 1.35, attenuation: (1, 0, 0)),
            ),
        ]),
        (
            name: "fill", transform: (translation: (4, -1, 8), look_at: (0, 0, 0)),
            light: directional(color: (0.6, 0.75, 1.0), intensity: 0.12),
        ),
'''

CAMERA = '''\
        (name: "%s", transform: (translation: (%.2f, %.2f, %.2f), look_at: (%.2f, %.2f, 0)), camera: (fov_y_degrees: %s)),
'''


def places():
    """The name of each cell and where its middle is."""
    for row, names in enumerate(ROWS):
        for column, name in enumerate(names):
            yield name, (column - (len(names) - 1) / 2) * CELL[0], ((len(ROWS) - 1) / 2 - row) * CELL[1]


def cameras():
    at = {name: (x, y) for name, x, y in places()}
    yield 'sheet', 0, 0, 36, 0, 0, 9.35
    for camera, name in (('close', 'combined'), ('close relief', 'relief'), ('close normal', 'normal'),
                         ('close refracting', REFRACTING)):
        x, y = at[name]
        yield camera, x, y, 5, x, y, 21


def scene(depth):
    materials = []
    for row, name in enumerate(LABELS):
        glass = name == REFRACTING
        technique = name.split(',')[0]
        materials.append(MATERIAL % {
            'name': name, 'technique': technique, 'base': GLASS if glass else STONE, 'depth': depth,
            'offset': GLASS_OFFSET if glass else OFFSET, 'step': EMBOSS_STEP,
        })
        materials.append(LABEL % {'name': name, 'scale': 1 / len(LABELS), 'offset': row / len(LABELS)})
    materials.append('''\
        "panel": (specular_factor: (0, 0, 0), base_factor: (0.65, 0.65, 0.65), base_map: "../textures/techniques_pattern.png"),
        "wall": (specular_factor: (0, 0, 0), base_factor: srgb("#464b54")),
''')
    entities = [CELL_ENTITY % {'name': name, 'x': x, 'y': y, 'more': PANEL if name == REFRACTING else ''}
                for name, x, y in places()]
    return ''.join([HEAD, '\n    materials: {\n', *materials, '    },\n\n    entities: [\n', *entities, TAIL,
                    *(CAMERA % camera for camera in cameras()), '    ],\n)\n'])
