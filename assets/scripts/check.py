"""Load every GLB back and check it: indices in range, no NaN, unit normals, UVs
present, images decode, winding agrees with the normals. Prints a table."""

import glob
import io
import json
import os
import struct
import sys
import numpy as np
from PIL import Image

TYPES = {5121: '<u1', 5123: '<u2', 5125: '<u4', 5126: '<f4'}
WIDTH = {'SCALAR': 1, 'VEC2': 2, 'VEC3': 3, 'VEC4': 4}


def read(path):
    d = open(path, 'rb').read()
    magic, version, total = struct.unpack('<III', d[:12])
    assert magic == 0x46546C67 and version == 2 and total == len(d), path
    n, kind = struct.unpack('<II', d[12:20])
    assert kind == 0x4E4F534A
    j = json.loads(d[20:20 + n])
    m, kind = struct.unpack('<II', d[20 + n:28 + n])
    assert kind == 0x004E4942 and m == j['buffers'][0]['byteLength']
    return j, d[28 + n:28 + n + m]


def array(j, b, i):
    a = j['accessors'][i]
    v = j['bufferViews'][a['bufferView']]
    w = WIDTH[a['type']]
    x = np.frombuffer(b, TYPES[a['componentType']], a['count'] * w, v['byteOffset'])
    assert v['byteOffset'] % 4 == 0 and v['byteOffset'] + v['byteLength'] <= len(b)
    return x.reshape(-1, w) if w > 1 else x


def rotate(q, p):
    v = np.array(q[:3]); w = q[3]
    t = 2 * np.cross(v, p)
    return p + w * t + np.cross(v, t)


def check(path):
    j, b = read(path)
    faults = []
    tri_of = []
    for m in j['meshes']:
        tris = 0
        for p in m['primitives']:
            P, N, UV = (array(j, b, p['attributes'][k]) for k in ('POSITION', 'NORMAL', 'TEXCOORD_0'))
            F = array(j, b, p['indices']).astype(int).reshape(-1, 3)
            if not (np.isfinite(P).all() and np.isfinite(N).all() and np.isfinite(UV).all()):
                faults.append('not finite')
            if F.max() >= len(P):
                faults.append('index out of range')
            if np.abs(np.linalg.norm(N, axis=1) - 1).max() > 1e-3:
                faults.append('normal not unit')
            fn = np.cross(P[F[:, 1]] - P[F[:, 0]], P[F[:, 2]] - P[F[:, 0]])
            area = np.linalg.norm(fn, axis=1)
            against = ((fn / np.maximum(area, 1e-20)[:, None] * N[F].mean(1)).sum(1) < -0.2) & (area > 2e-7)
            if against.sum():
                faults.append('%s: %d of %d faces turned against their normals'
                              % (j['materials'][p['material']]['name'], against.sum(), len(F)))
            u = UV[F]
            du, dv = u[:, 1] - u[:, 0], u[:, 2] - u[:, 0]
            flat = np.abs(du[:, 0] * dv[:, 1] - du[:, 1] * dv[:, 0]) < 1e-12
            mat = j['materials'][p['material']]
            if flat.sum() and 'normalTexture' in mat:
                faults.append('%s: %d of %d faces without UV area' % (mat['name'], flat.sum(), len(F)))
            tris += len(F)
        tri_of.append(tris)
    for i in j.get('images', []):
        v = j['bufferViews'][i['bufferView']]
        Image.open(io.BytesIO(b[v['byteOffset']:v['byteOffset'] + v['byteLength']])).load()
    lo, hi, tris = np.full(3, 1e9), np.full(3, -1e9), 0
    names = []

    def walk(k, parents):
        nonlocal lo, hi, tris
        n = j['nodes'][k]
        chain = parents + [(np.array(n.get('translation', (0, 0, 0)), float), n.get('rotation', (0, 0, 0, 1)))]
        names.append(n['name'])
        if 'mesh' in n:
            tris += tri_of[n['mesh']]
            for p in j['meshes'][n['mesh']]['primitives']:
                P = array(j, b, p['attributes']['POSITION']).astype(float)
                for t, q in reversed(chain):
                    P = rotate(q, P) + t
                lo, hi = np.minimum(lo, P.min(0)), np.maximum(hi, P.max(0))
        for c in n.get('children', []):
            walk(c, chain)
    for r in j['scenes'][0]['nodes']:
        walk(r, [])
    return dict(file=os.path.basename(path), bytes=os.path.getsize(path), triangles=tris, lo=np.round(lo, 3).tolist(),
                hi=np.round(hi, 3).tolist(),
                materials=len(j['materials']), nodes=names, faults=faults)


PAIR = lambda *names: ['%s_%s' % (n, side) for n in names for side in ('left', 'right')]
ROAD = ['body', 'wheel_front', 'wheel_rear', 'lamp_head', 'lamp_tail']
FOUR = (['body'] + PAIR('wheel_front', 'wheel_rear', 'lamp_head', 'lamp_indicator_front', 'lamp_tail',
                        'lamp_indicator_rear', 'lamp_reverse'))
# root: (most triangles, the nodes that code relies on)
VEHICLES = {
    'car': (5000, FOUR), 'van': (6000, FOUR), 'bus': (5000, FOUR + ['lamp_interior']),
    'truck': (6500, FOUR + ['trailer'] + PAIR('wheel_trailer_1', 'wheel_trailer_2', 'wheel_trailer_3')),
    'motorcycle': (5000, ROAD + ['steering'] + PAIR('lamp_indicator_front', 'lamp_indicator_rear')),
    'bicycle': (4500, ROAD + ['steering', 'cranks'] + PAIR('leg')),
    'person': (3000, ['body'] + PAIR('leg', 'arm')),
}
GLASS = {'lamp_head': 'glass_clear', 'lamp_reverse': 'glass_clear', 'lamp_tail': 'glass_red',
         'lamp_indicator': 'glass_amber', 'lamp_interior': 'glass_interior'}


def check_vehicle(path, report):
    """What is wrong with a vehicle: its nodes, wheels, lamps and sizes."""
    j, b = read(path)
    root = j['nodes'][j['scenes'][0]['nodes'][0]]['name']
    if root not in VEHICLES:
        return []
    most, wanted = VEHICLES[root]
    nodes = {n['name']: n for n in j['nodes']}
    faults = ['no node ' + name for name in wanted if name not in nodes]
    if report['triangles'] > most:
        faults.append('%d triangles, at most %d' % (report['triangles'], most))
    if report['bytes'] > 700_000:
        faults.append('%d bytes, at most 700,000' % report['bytes'])
    if abs(report['lo'][1]) > 0.02:
        faults.append('stands %.3f m above the ground' % report['lo'][1])
    for k, image in enumerate(j['images']):
        v = j['bufferViews'][image['bufferView']]
        size = Image.open(io.BytesIO(b[v['byteOffset']:v['byteOffset'] + v['byteLength']])).size
        if max(size) > (1024 if root in ('bus', 'truck') else 512) or min(size) > 512:
            faults.append('image %d has %d x %d pixels' % (k, *size))
    for name, n in nodes.items():
        if name.startswith('wheel_'):
            faults += check_wheel(j, b, name, n)
        if name.startswith('lamp_'):
            faults += check_lamp(j, name, n)
    return faults


def points(j, b, n):
    return np.concatenate([array(j, b, p['attributes']['POSITION']) for p in j['meshes'][n['mesh']]['primitives']])


def check_wheel(j, b, name, n):
    """The axle is the node's X: round about it, the hub in the middle; the right-hand one turned half round."""
    P = points(j, b, n)
    lo, hi = P.min(0), P.max(0)
    faults = []
    if (np.abs((lo + hi)[1:]).max() > 0.02 * (hi - lo)[1] or abs((hi - lo)[1] - (hi - lo)[2]) > 0.02 * (hi - lo)[1]
        or (hi - lo)[0] > 0.9 * (hi - lo)[1]):
        faults.append(name + ' does not turn about its X')
    turned = n.get('rotation', (0, 0, 0, 1)) != (0, 0, 0, 1)
    if turned != name.endswith('_right'):
        faults.append(name + ' is turned the wrong way')
    return faults


def check_lamp(j, name, n):
    """A lamp has a glass of the right colour that does not glow by itself, and light leaves forward or backward."""
    if 'mesh' not in n:
        return [name + ' has no glass']
    faults = []
    material = j['materials'][j['meshes'][n['mesh']]['primitives'][0]['material']]
    kind = next(k for key, k in GLASS.items() if name.startswith(key))
    if material['name'] != kind or 'emissiveFactor' in material:
        faults.append('%s is of %s' % (name, material['name']))
    if name != 'lamp_interior':
        ahead = rotate(n['rotation'], np.array([0, 0, -1.0]))
        forward = 1 if 'head' in name or 'front' in name else -1
        if ahead[2] * forward < 0.9 or ('head' in name and not -0.1 < ahead[1] < -0.05):
            faults.append('%s shines along %s' % (name, np.round(ahead, 3)))
    return faults


if __name__ == '__main__':
    here = os.path.dirname(os.path.abspath(__file__))
    bad = False
    for f in sorted(glob.glob(os.path.join(here, '..', 'models', '*.glb'))):
        r = check(f)
        print('%-18s %7d bytes %6d triangles %2d materials  %s .. %s'
              % (r['file'], r['bytes'], r['triangles'], r['materials'], r['lo'], r['hi']))
        print('    nodes: ' + ', '.join(r['nodes']))
        for x in r['faults'] + check_vehicle(f, r):
            print('    FAULT', x)
            bad = True
    sys.exit(bad)
