"""Mesh building blocks and a plain glTF-binary writer (numpy only)."""

import io
import json
import struct
import numpy as np
from PIL import Image


class Part:
    """Triangles with positions, unit normals and UVs."""

    def __init__(self, P, N, UV, F):
        self.P = np.asarray(P, float).reshape(-1, 3)
        self.N = np.asarray(N, float).reshape(-1, 3)
        self.UV = np.asarray(UV, float).reshape(-1, 2)
        self.F = np.asarray(F, int).reshape(-1, 3)

    def copy(self):
        return Part(self.P.copy(), self.N.copy(), self.UV.copy(), self.F.copy())

    def move(self, x=0, y=0, z=0):
        p = self.copy()
        p.P += (x, y, z)
        return p

    def mat(self, m):
        """Apply a 3x3 matrix (rotation, scale, mirror)."""
        m = np.asarray(m, float)
        p = self.copy()
        p.P = p.P @ m.T
        p.N = p.N @ np.linalg.inv(m)
        p.N /= np.linalg.norm(p.N, axis=1, keepdims=True)
        if np.linalg.det(m) < 0:
            p.F = p.F[:, ::-1].copy()
        return p

    def scale(self, x, y, z):
        return self.mat(np.diag([x, y, z]))

    def rot(self, axis, deg):
        return self.mat(rotation(axis, deg))

    def swatch(self, u, v):
        """Put every UV on one spot of an atlas, keeping a tiny spread so that
        tangents stay defined."""
        p = self.copy()
        # an oblique projection: no face of a simple shape is seen edge-on
        w = p.P @ np.array([[0.83, 0.21], [0.37, -0.79], [0.41, 0.58]])
        w = w - w.min(0)
        p.UV = np.array([u, v]) + (w / max(w.max(), 1e-9) - 0.5) * 0.008
        return p

    def uvmap(self, f):
        p = self.copy()
        p.UV = np.asarray(f(p.P, p.UV), float)
        return p

    def flip(self):
        p = self.copy()
        p.N = -p.N
        p.F = p.F[:, ::-1].copy()
        return p


def rotation(axis, deg):
    a = np.radians(deg)
    c, s = np.cos(a), np.sin(a)
    return {'x': np.array([[1, 0, 0], [0, c, -s], [0, s, c]]),
            'y': np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]),
            'z': np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])}[axis]


def merge(*parts):
    flat = []
    for p in parts:
        flat.extend(p if isinstance(p, (list, tuple)) else [p])
    P, N, UV, F, o = [], [], [], [], 0
    for p in flat:
        P.append(p.P); N.append(p.N); UV.append(p.UV); F.append(p.F + o)
        o += len(p.P)
    return Part(np.concatenate(P), np.concatenate(N), np.concatenate(UV), np.concatenate(F))


def mirror_x(part):
    return part.scale(-1, 1, 1)


def clean(part):
    """Drop triangles without area."""
    a, b, c = (part.P[part.F[:, i]] for i in range(3))
    ok = np.linalg.norm(np.cross(b - a, c - a), axis=1) > 1e-10
    part.F = part.F[ok]
    return part


def cut(part, axis, at):
    """The two halves of a part below and above a plane across an axis. What the plane
    crosses is cut there; places, normals and UVs are interpolated, so nothing shows."""
    P, N, UV = (list(a) for a in (part.P, part.N, part.UV))
    d = part.P[:, axis] - at
    d[np.abs(d) < 1e-6] = 0.0
    made = {}

    def between(a, b):
        a, b = min(a, b), max(a, b)
        if (a, b) not in made:
            t = d[a] / (d[a] - d[b])
            n = N[a] + (N[b] - N[a]) * t
            made[(a, b)] = len(P)
            P.append(P[a] + (P[b] - P[a]) * t)
            N.append(n / np.linalg.norm(n))
            UV.append(UV[a] + (UV[b] - UV[a]) * t)
        return made[(a, b)]

    halves = ([], [])
    for tri in part.F:
        for faces, side in zip(halves, (-1, 1)):
            s = d[tri] * side
            if s.min() >= 0:
                if s.max() > 0 or side < 0:      # what lies in the plane goes below
                    faces.append(tuple(tri))
                continue
            if s.max() <= 0:
                continue
            ring = []
            for a, b in zip(tri, np.roll(tri, -1)):
                if d[a] * side >= 0:
                    ring.append(a)
                if d[a] * d[b] < 0:
                    ring.append(between(a, b))
            faces.extend((ring[0], ring[i], ring[i + 1]) for i in range(1, len(ring) - 1))
    return [Part(P, N, UV, faces) for faces in halves]


def slabs(prims, axis, places):
    """A mesh, a list of (Part, material), cut across an axis."""
    out, rest = [], prims
    for at in sorted(places):
        halves = [(cut(part, axis, at), material) for part, material in rest]
        out.append([(below, material) for (below, _), material in halves])
        rest = [(above, material) for (_, above), material in halves]
    return out + [rest]


def pieces(prims, planes):
    """A mesh cut at planes {axis: [places]}: a list of meshes, one for each block that
    holds something. The renderer lights a mesh by its three most relevant lights, so what
    is larger than a pool of light has to come in pieces."""
    blocks = [prims]
    for axis, places in planes.items():
        blocks = [slab for block in blocks for slab in slabs(block, axis, places)]
    blocks = [[(clean(part), material) for part, material in block] for block in blocks]
    blocks = [[(part, material) for part, material in block if len(part.F)] for block in blocks]
    return [block for block in blocks if block]


def creased(P, UV, F, angle=35.0):
    """Normals from the faces (weighted by area and corner angle), smooth below
    the crease angle. P, UV, F index the same vertices; vertices at one place
    share their normals even across a UV seam."""
    P, UV, F = np.asarray(P, float), np.asarray(UV, float), np.asarray(F, int)
    a, b, c = P[F[:, 0]], P[F[:, 1]], P[F[:, 2]]
    fn = np.cross(b - a, c - a)
    area = np.linalg.norm(fn, axis=1)
    ok = area > 1e-12
    F, fn, area = F[ok], fn[ok], area[ok]
    unit = fn / area[:, None]
    key = np.round(P, 6)
    _, place = np.unique(key, axis=0, return_inverse=True)
    place = place.reshape(-1)
    around = {}
    for f in range(len(F)):
        for k in range(3):
            around.setdefault(place[F[f, k]], []).append(f)
    cosa = np.cos(np.radians(angle))
    out, index, oP, oN, oU = {}, [], [], [], []
    for f in range(len(F)):
        tri = []
        for k in range(3):
            v = F[f, k]
            near = np.array(around[place[v]])
            sel = near[unit[near] @ unit[f] >= cosa]
            n = fn[sel].sum(0)
            n /= np.linalg.norm(n) + 1e-30
            key = (v, tuple(np.round(n, 4)))
            if key not in out:
                out[key] = len(oP)
                oP.append(P[v]); oN.append(n); oU.append(UV[v])
            tri.append(out[key])
        index.append(tri)
    return Part(oP, oN, oU, index)


def lathe(profile, seg=32, angle=35.0, u_repeat=1.0, phase=0.0):
    """Revolve (radius, y) points, listed from the bottom up along the outside, around Y."""
    pr = np.asarray(profile, float)
    t = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(pr, axis=0), axis=1))])
    t = t / t[-1]
    k = len(pr)
    ang = np.arange(seg + 1) / seg * 2 * np.pi + phase
    P = np.zeros((seg + 1, k, 3)); UV = np.zeros((seg + 1, k, 2))
    P[..., 0] = np.cos(ang)[:, None] * pr[:, 0]
    P[..., 2] = -np.sin(ang)[:, None] * pr[:, 0]
    P[..., 1] = pr[:, 1]
    P[-1] = P[0]
    UV[..., 0] = (np.arange(seg + 1) / seg * u_repeat)[:, None]
    UV[..., 1] = 1 - t
    F = []
    for i in range(seg):
        for j in range(k - 1):
            a, b, c, d = i * k + j, (i + 1) * k + j, (i + 1) * k + j + 1, i * k + j + 1
            F += [(a, b, c), (a, c, d)]
    return creased(P.reshape(-1, 3), UV.reshape(-1, 2), F, angle)


def tube(path, radius, seg=10, angle=50.0, caps=True, closed=False, squash=1.0, uv_len=None):
    """Sweep a circle along a path; radius may vary per point."""
    path = np.asarray(path, float)
    n = len(path)
    rad = np.broadcast_to(np.asarray(radius, float), (n,))
    if closed:
        tan = np.roll(path, -1, 0) - np.roll(path, 1, 0)
    else:
        tan = np.gradient(path, axis=0)
    tan /= np.linalg.norm(tan, axis=1, keepdims=True)
    up = np.array([0, 1.0, 0]) if abs(tan[0] @ [0, 1, 0]) < 0.95 else np.array([1.0, 0, 0])
    frames = []
    x = np.cross(up, tan[0]); x /= np.linalg.norm(x)
    for i in range(n):
        x = x - tan[i] * (x @ tan[i]); x /= np.linalg.norm(x)
        frames.append((x.copy(), np.cross(tan[i], x)))
    ang = np.arange(seg + 1) / seg * 2 * np.pi
    rows = n + 1 if closed else n
    P, UV = [], []
    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    for r in range(rows):
        i = r % n
        e1, e2 = frames[i]
        ring = path[i] + rad[i] * (np.cos(ang)[:, None] * e1 + squash * np.sin(ang)[:, None] * e2)
        ring[-1] = ring[0]
        P.append(ring)
        l = length[i] if r < n else length[-1] + np.linalg.norm(path[0] - path[-1])
        UV.append(np.stack([ang / (2 * np.pi), np.full(seg + 1, l / (uv_len or max(length[-1], 1e-9)))], 1))
    P, UV = np.concatenate(P), np.concatenate(UV)
    F = []
    k = seg + 1
    for i in range(rows - 1):
        for j in range(seg):
            a, b, c, d = i * k + j, i * k + j + 1, (i + 1) * k + j + 1, (i + 1) * k + j
            F += [(a, b, c), (a, c, d)]
    P, UV = list(P), list(UV)
    if caps and not closed:
        for end, row in ((0, 0), (n - 1, rows - 1)):
            base = len(P)
            P.append(path[end]); UV.append((0.5, 0.5))
            for j in range(k):
                P.append(P[row * k + j])
                UV.append((0.5 + 0.5 * np.cos(ang[j]), 0.5 + 0.5 * np.sin(ang[j])))
            for j in range(seg):
                t = (base, base + 2 + j, base + 1 + j)
                F.append(t if end == 0 else t[::-1])
    return creased(P, UV, F, angle)


def box(sx, sy, sz, bevel=0.0, uv_scale=1.0):
    """A box around the origin with flat, 45-degree bevels. The faces keep their
    true normals and the bevels are shaded between them, which reads as a round
    edge. UVs: metres times uv_scale on each face."""
    h = np.array([sx, sy, sz]) / 2
    b = min(bevel, h.min() * 0.98)
    P, N, UV, F = [], [], [], []
    corner = {}
    for ax in range(3):
        for sg in (-1, 1):
            e1, e2 = (ax + 1) % 3, (ax + 2) % 3
            n = np.zeros(3); n[ax] = sg
            ids = []
            for s1, s2 in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
                p = np.zeros(3)
                p[ax] = sg * h[ax]
                p[e1] = s1 * (h[e1] - b)
                p[e2] = s2 * (h[e2] - b)
                # image right / image up on each face
                if ax == 0:
                    uv = (-sg * p[2], -p[1])
                elif ax == 1:
                    uv = (p[0], sg * p[2])
                else:
                    uv = (sg * p[0], -p[1])
                ids.append(len(P))
                signs = [0, 0, 0]; signs[ax], signs[e1], signs[e2] = sg, s1, s2
                corner[(ax, tuple(signs))] = len(P)
                P.append(p); N.append(n)
                UV.append(((uv[0] + 0.0137 * ax) * uv_scale, (uv[1] + 0.0071 * ax * sg) * uv_scale))
            q = ids if sg > 0 else ids[::-1]
            F += [(q[0], q[1], q[2]), (q[0], q[2], q[3])]
    if b > 0:
        def add(ids):
            a = np.array([P[i] for i in ids])
            n = np.cross(a[1] - a[0], a[2] - a[0])
            if n @ a.mean(0) < 0:
                ids = ids[::-1]
            for i in range(1, len(ids) - 1):
                F.append((ids[0], ids[i], ids[i + 1]))
        for ax in range(3):
            e1, e2 = (ax + 1) % 3, (ax + 2) % 3
            for s1 in (-1, 1):
                for s2 in (-1, 1):
                    def sign(s):
                        t = [0, 0, 0]; t[ax], t[e1], t[e2] = s, s1, s2
                        return tuple(t)
                    add([corner[(e1, sign(-1))], corner[(e1, sign(1))], corner[(e2, sign(1))], corner[(e2, sign(-1))]])
        for s in np.ndindex(2, 2, 2):
            t = tuple(2 * np.array(s) - 1)
            t = tuple(int(i) for i in t)
            add([corner[(0, t)], corner[(1, t)], corner[(2, t)]])
    return Part(P, N, UV, F)


def arc(cx, cy, r, a0, a1, n):
    a = np.radians(np.linspace(a0, a1, n))
    return np.stack([cx + r * np.cos(a), cy + r * np.sin(a)], 1)


# ---------------------------------------------------------------- glTF writer

class Glb:
    def __init__(self):
        self.bin = bytearray()
        self.j = {'asset': {'version': '2.0', 'generator': 'Relief asset scripts',
                            'copyright': 'MIT OR Apache-2.0'},
                  'scene': 0, 'scenes': [{'nodes': []}], 'nodes': [], 'meshes': [],
                  'accessors': [], 'bufferViews': [], 'materials': [], 'textures': [],
                  'images': [], 'samplers': [{'magFilter': 9729, 'minFilter': 9987, 'wrapS': 10497, 'wrapT': 10497}]}

    def view(self, data, target=None):
        while len(self.bin) % 4:
            self.bin.append(0)
        v = {'buffer': 0, 'byteOffset': len(self.bin), 'byteLength': len(data)}
        if target:
            v['target'] = target
        self.bin += data
        self.j['bufferViews'].append(v)
        return len(self.j['bufferViews']) - 1

    def image(self, arr, kind='jpg', quality=90, name=None):
        """Embed an image (uint8 array); returns a texture index."""
        im = Image.fromarray(arr)
        f = io.BytesIO()
        if kind == 'jpg':
            im.save(f, 'JPEG', quality=quality, subsampling=0, optimize=True)
        else:
            im.save(f, 'PNG', optimize=True)
        rec = {'bufferView': self.view(f.getvalue()), 'mimeType': 'image/jpeg' if kind == 'jpg' else 'image/png'}
        if name:
            rec['name'] = name
        self.j['images'].append(rec)
        self.j['textures'].append({'source': len(self.j['images']) - 1, 'sampler': 0})
        return len(self.j['textures']) - 1

    def material(self, name, base=None, normal=None, orm=None, color=(1, 1, 1, 1), metallic=1.0, roughness=1.0,
                 emissive=None, emissive_tex=None, double=False, normal_scale=1.0, occlusion=False):
        m = {'name': name, 'pbrMetallicRoughness': {'baseColorFactor': [float(c) for c in color],
                                                    'metallicFactor': float(metallic),
                                                    'roughnessFactor': float(roughness)}}
        if base is not None:
            m['pbrMetallicRoughness']['baseColorTexture'] = {'index': base}
        if orm is not None:
            m['pbrMetallicRoughness']['metallicRoughnessTexture'] = {'index': orm}
            if occlusion:
                m['occlusionTexture'] = {'index': orm}
        if normal is not None:
            m['normalTexture'] = {'index': normal}
            if normal_scale != 1.0:
                m['normalTexture']['scale'] = normal_scale
        if emissive is not None:
            m['emissiveFactor'] = [float(c) for c in emissive]
            if emissive_tex is not None:
                m['emissiveTexture'] = {'index': emissive_tex}
        if double:
            m['doubleSided'] = True
        self.j['materials'].append(m)
        return len(self.j['materials']) - 1

    def accessor(self, a, ctype, kind, target, bounds=False):
        rec = {'bufferView': self.view(a.tobytes(), target), 'componentType': ctype, 'count': len(a), 'type': kind}
        if bounds:
            rec['min'] = [float(x) for x in a.min(0)]
            rec['max'] = [float(x) for x in a.max(0)]
        self.j['accessors'].append(rec)
        return len(self.j['accessors']) - 1

    def mesh(self, name, prims):
        """prims: list of (Part, material index)."""
        out = []
        for part, mat in prims:
            part = clean(part.copy())
            used = np.unique(part.F)
            remap = np.full(len(part.P), -1)
            remap[used] = np.arange(len(used))
            P = part.P[used].astype('<f4')
            N = part.N[used]
            N = (N / np.linalg.norm(N, axis=1, keepdims=True)).astype('<f4')
            UV = part.UV[used].astype('<f4')
            F = remap[part.F].reshape(-1)
            big = len(P) > 65535
            out.append({'attributes': {'POSITION': self.accessor(P, 5126, 'VEC3', 34962, True),
                                       'NORMAL': self.accessor(N, 5126, 'VEC3', 34962),
                                       'TEXCOORD_0': self.accessor(UV, 5126, 'VEC2', 34962)},
                        'indices': self.accessor(F.astype('<u4' if big else '<u2'), 5125 if big else 5123, 'SCALAR',
                                                 34963),
                        'material': mat, 'mode': 4})
        self.j['meshes'].append({'name': name, 'primitives': out})
        return len(self.j['meshes']) - 1

    def node(self, name, mesh=None, t=None, q=None, parent=None):
        n = {'name': name}
        if mesh is not None:
            n['mesh'] = mesh
        if t is not None:
            n['translation'] = [float(x) for x in t]
        if q is not None:
            n['rotation'] = [float(x) for x in q]
        self.j['nodes'].append(n)
        i = len(self.j['nodes']) - 1
        if parent is None:
            self.j['scenes'][0]['nodes'].append(i)
        else:
            self.j['nodes'][parent].setdefault('children', []).append(i)
        return i

    def piece_nodes(self, name, prims, planes, parent):
        """A mesh in pieces (see `pieces`), as nodes NAME_0, NAME_1, … below a parent."""
        for i, block in enumerate(pieces(prims, planes)):
            self.node('%s_%d' % (name, i), self.mesh('%s_%d' % (name, i), block), parent=parent)

    def save(self, path):
        while len(self.bin) % 4:
            self.bin.append(0)
        j = {k: v for k, v in self.j.items() if v != []}
        if 'textures' not in j:
            j.pop('samplers', None)
        j['buffers'] = [{'byteLength': len(self.bin)}]
        txt = json.dumps(j, separators=(',', ':')).encode()
        txt += b' ' * (-len(txt) % 4)
        total = 12 + 8 + len(txt) + 8 + len(self.bin)
        with open(path, 'wb') as f:
            f.write(struct.pack('<III', 0x46546C67, 2, total))
            f.write(struct.pack('<II', len(txt), 0x4E4F534A) + txt)
            f.write(struct.pack('<II', len(self.bin), 0x004E4942) + bytes(self.bin))


def aim(direction, up=(0, 1, 0)):
    """Quaternion (x, y, z, w) that turns local -Z into `direction`."""
    z = -np.asarray(direction, float)
    z /= np.linalg.norm(z)
    up = np.asarray(up, float)
    if abs(up @ z) > 0.99:
        up = np.array([0, 0, 1.0])
    x = np.cross(up, z); x /= np.linalg.norm(x)
    y = np.cross(z, x)
    m = np.stack([x, y, z], 1)
    t = m.trace()
    if t > 0:
        s = 2 * np.sqrt(t + 1)
        return ((m[2, 1] - m[1, 2]) / s, (m[0, 2] - m[2, 0]) / s, (m[1, 0] - m[0, 1]) / s, s / 4)
    i = int(np.argmax(np.diag(m)))
    j, k = (i + 1) % 3, (i + 2) % 3
    s = 2 * np.sqrt(max(1 + m[i, i] - m[j, j] - m[k, k], 1e-12))
    q = [0, 0, 0, (m[k, j] - m[j, k]) / s]
    q[i] = s / 4
    q[j] = (m[j, i] + m[i, j]) / s
    q[k] = (m[k, i] + m[i, k]) / s
    return tuple(q)
