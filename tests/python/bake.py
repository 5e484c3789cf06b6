"""A bake by brute force: every texel's ray against every triangle, in double precision.

    python3 bake.py LOW.glb HIGH.glb SIZE CAGE RAYS OUT

Written from the definition of the maps, not from the program's source. Both files hold one mesh of triangles with 32-bit
indices at nodes that may be scaled; the coarse one brings tangents and UVs. OUT receives, for each texel, six 32-bit
floats: normal x, y, z in tangent space, height in metres, open share of the sky, and 1 where the texel's centre lies in
a triangle and its ray met something, else 0.
"""

import json
import struct
import sys

import numpy as np


def read_glb(path):
    """Positions, normals, tangents, UVs and triangles of the first mesh, placed by its node's scale."""
    data = open(path, "rb").read()
    (json_length,) = struct.unpack_from("<I", data, 12)
    document = json.loads(data[20 : 20 + json_length])
    binary = data[20 + json_length + 8 :]

    def accessor(index):
        entry = document["accessors"][index]
        view = document["bufferViews"][entry["bufferView"]]
        width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}[entry["type"]]
        kind = {5126: np.float32, 5125: np.uint32}[entry["componentType"]]
        values = np.frombuffer(binary, kind, entry["count"] * width, view["byteOffset"])
        return values.reshape(-1, width).astype(np.float64 if kind == np.float32 else np.int64)

    node = next(node for node in document["nodes"] if "mesh" in node)
    scale = np.array(node.get("scale", [1, 1, 1]), dtype=np.float64)
    primitive = document["meshes"][node["mesh"]]["primitives"][0]
    attributes = {name: accessor(index) for name, index in primitive["attributes"].items()}
    triangles = accessor(primitive["indices"]).reshape(-1, 3)
    flips = np.prod(scale) < 0
    # Normals by the inverse transpose, tangents as directions; where space is mirrored the sign changes.
    attributes["POSITION"] = attributes["POSITION"] * scale
    attributes["NORMAL"] = unit(attributes["NORMAL"] / scale)
    if "TANGENT" in attributes:
        tangent = attributes["TANGENT"]
        sign = -tangent[:, 3:] if flips else tangent[:, 3:]
        attributes["TANGENT"] = np.hstack([unit(tangent[:, :3] * scale), sign])
    if flips:
        triangles = triangles[:, [0, 2, 1]]
    return attributes, triangles


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def first_hit(origin, direction, corners, most, front_only):
    """Möller and Trumbore. Distance and barycentric weights of the nearest triangle, or None."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    ab, ac = b - a, c - a
    p = np.cross(direction, ac)
    determinant = np.einsum("ij,ij->i", ab, p)
    with np.errstate(divide="ignore", invalid="ignore"):
        s = origin - a
        u = np.einsum("ij,ij->i", s, p) / determinant
        q = np.cross(s, ab)
        v = q @ direction / determinant
        t = np.einsum("ij,ij->i", ac, q) / determinant
        hit = (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1 + 1e-9) & (t > 0) & (t <= most)
    if front_only:
        hit &= determinant > 0
    if not hit.any():
        return None
    nearest = np.argmin(np.where(hit, t, np.inf))
    return t[nearest], nearest, np.array([1 - u[nearest] - v[nearest], u[nearest], v[nearest]])


def sky(rays):
    """Directions around +Z, cosine-weighted: a grid of equal cells on the disc's radius squared and angle."""
    side = int(np.sqrt(rays))
    i, j = np.meshgrid(np.arange(side), np.arange(side))
    squared = ((i + 0.5) / side).ravel()
    angle = ((j + 0.5) / side * 2 * np.pi).ravel()
    radius = np.sqrt(squared)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), np.sqrt(1 - squared)], axis=1)


def open_share(place, normal, corners, directions):
    """Of all directions at once: the same test as in first_hit."""
    right = unit(np.cross(normal, [1.0, 0, 0] if abs(normal[0]) < 0.6 else [0, 1.0, 0]))
    directions = directions @ np.stack([right, np.cross(normal, right), normal])
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    ab, ac, s = b - a, c - a, place + normal * 1e-6 - a
    # Triple products, the direction first: rows of directions, columns of triangles.
    q = np.cross(s, ab)
    with np.errstate(divide="ignore", invalid="ignore"):
        determinant = directions @ np.cross(ac, ab).T
        u = directions @ np.cross(ac, s).T / determinant
        v = directions @ q.T / determinant
        t = np.einsum("ij,ij->i", ac, q) / determinant
        hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)
    return 1 - np.mean(hit.any(axis=1))


def main():
    low_path, high_path, size, cage, rays, out = sys.argv[1:]
    size, cage = int(size), float(cage)
    low, low_triangles = read_glb(low_path)
    high, high_triangles = read_glb(high_path)
    corners = high["POSITION"][high_triangles]
    directions = sky(int(rays))
    texels = np.zeros((size, size, 6), dtype=np.float32)
    for y in range(size):
        for x in range(size):
            at = np.array([(x + 0.5) / size, (y + 0.5) / size])
            found = locate(at, low["TEXCOORD_0"], low_triangles)
            if found is None:
                continue
            vertices, weights = found
            normal = unit(weights @ low["NORMAL"][vertices])
            tangent = weights @ low["TANGENT"][vertices, :3]
            tangent = unit(tangent - normal * (normal @ tangent))
            bitangent = np.cross(normal, tangent) * low["TANGENT"][vertices[0], 3]
            place = weights @ low["POSITION"][vertices]
            met = first_hit(place + normal * cage, -normal, corners, 2 * cage, True)
            if met is None:
                continue
            distance, triangle, share = met
            seen = unit(share @ high["NORMAL"][high_triangles[triangle]])
            a, b, c = corners[triangle]
            shade = open_share(share @ corners[triangle], unit(np.cross(b - a, c - a)), corners, directions)
            frame = np.stack([tangent, bitangent, normal])
            texels[y, x] = [*(frame @ seen), cage - distance, shade, 1]
    texels.tofile(out)


def locate(at, uvs, triangles):
    """The triangle of the UVs that a point lies in, and its weights there; the first, if there are several."""
    for vertices in triangles:
        a, b, c = uvs[vertices]
        area = np.cross(b - a, c - a)
        if area == 0:
            continue
        weights = np.array([np.cross(b - at, c - at), np.cross(c - at, a - at), np.cross(a - at, b - at)]) / area
        if (weights >= 0).all():
            return vertices, weights
    return None


main()
