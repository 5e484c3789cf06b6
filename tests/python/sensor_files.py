"""Reads the data set of tests/sensors/sensor_files.rs: equal arrays in all forms, and points where the scene has its
planes.
"""

import json
import sys
from pathlib import Path

import cv2
import numpy as np
import OpenEXR

folder = Path(sys.argv[1])
described = json.loads((folder / "sensors.json").read_text())
sensors = {sensor["name"]: sensor for sensor in described["sensors"]}
assert sorted(sensors) == ["front", "top"], sensors
front, top = sensors["front"], sensors["top"]
assert [capture["step"] for capture in front["captures"]] == [0, 2, 4, 6]
assert [capture["step"] for capture in top["captures"]] == [0, 6]
assert [capture["nanoseconds"] for capture in front["captures"]] == [0, 33333333, 66666667, 100000000]


def world_from_sensor(sensor, capture):
    return np.array(capture["world_from_entity"]) @ np.array(sensor["entity_from_sensor"])


def transformed(matrix, points):
    return points @ matrix[:3, :3].T + matrix[:3, 3]


for capture in front["captures"]:
    step = capture["step"]
    arrays = np.load(folder / "front" / f"{step:05}.npz")
    # Flow is between two captures: the first has no other before it, and the last none after it.
    flows = {"flow_back", "flow_back_flags"} if step > 0 else set()
    held = set(front["outputs"]) - {"flow", "flow_back"} | flows
    assert set(arrays.files) == held, arrays.files
    shape = (front["height"], front["width"])
    for name in sorted(held):
        own = np.load(folder / "front" / f"{name}_{step:05}.npy")
        if name == "boxes":
            # Not known before the second capture.
            assert np.isnan(own["velocity"]).all() == (step == 0)
            assert all(np.array_equal(own[field], arrays[name][field], equal_nan=True) for field in own.dtype.names)
            continue
        kind = "uint8" if name.endswith("_flags") else front["outputs"][name]["type"]
        assert own.dtype == np.dtype(kind), (name, own.dtype)
        assert own.shape[:2] == shape
        assert np.array_equal(own, arrays[name])

    def picture(name):
        read = cv2.imread(str(folder / "front" / f"{name}_{step:05}.png"), cv2.IMREAD_UNCHANGED)
        # Blue first.
        return read[..., ::-1] if read.ndim == 3 else read

    assert np.array_equal(picture("color"), arrays["color"])
    assert np.array_equal(picture("class"), arrays["class"])
    assert np.array_equal(picture("panoptic"), arrays["panoptic"])
    for name in ["instance", "part"]:
        r, g, b = np.moveaxis(picture(name).astype(np.uint32), -1, 0)
        assert np.array_equal(r + 256 * g + 65536 * b, arrays[name])
    metres = np.where(arrays["depth"] < 255.99, np.floor(arrays["depth"] * 256 + 0.5), 0)
    assert np.array_equal(picture("depth"), metres)
    # Channels are compared one by one, whatever the reader makes of their names.
    with OpenEXR.File(str(folder / "front" / f"{step:05}.exr"), separate_channels=True) as file:
        channels = {name: channel.pixels for name, channel in file.channels().items()}
    for place, name in enumerate(["R", "G", "B"]):
        assert np.array_equal(channels[name], arrays["linear"][..., place])
    for place, name in enumerate(["N.X", "N.Y", "N.Z"]):
        assert np.array_equal(channels[name], arrays["normal"][..., place])
    assert np.array_equal(channels["Z"], arrays["depth"])
    for name in ["range", "instance", "part", "class", "panoptic"]:
        assert np.array_equal(channels[name], arrays[name]), name

    for flow, at in [("flow", step), ("flow_back", step)]:
        is_there = (folder / "front" / f"{flow}_{at:05}.npy").exists()
        assert is_there == (step < 6 if flow == "flow" else step > 0), (flow, at)
        if is_there:
            shift = np.load(folder / "front" / f"{flow}_{at:05}.npy").astype(np.float64)
            steps = cv2.imread(str(folder / "front" / f"{flow}_{at:05}.png"), cv2.IMREAD_UNCHANGED)[..., ::-1]
            # As the development kit of KITTI reads it; steps were rounded from floats of some 2¹⁵.
            assert (steps[..., 2] == 1).all()
            assert np.abs((steps[..., :2].astype(np.float64) - 2**15) / 64 - shift).max() <= (0.5 + 2**-8) / 64
    if step > 0:
        assert np.array_equal(channels["flow_back.U"], arrays["flow_back"][..., 0])
        assert np.array_equal(channels["flow_back.V"], arrays["flow_back"][..., 1])

    # Rays by K, points by the poses: the ground is at y = 0, the car's front at z = −10.
    k = np.array(front["K"])
    v, u = np.mgrid[0 : shape[0], 0 : shape[1]]
    rays = np.stack([u, v, np.ones_like(u)], -1).astype(np.float64) @ np.linalg.inv(k).T
    depth = arrays["depth"].astype(np.float64)
    seen = np.isfinite(depth)
    assert np.allclose(arrays["range"][seen], (depth * np.linalg.norm(rays, axis=-1))[seen], rtol=1e-6)
    points = transformed(world_from_sensor(front, capture), rays[seen] * depth[seen][:, None])
    classes = arrays["class"][seen]
    names = {entry["id"]: entry["name"] for entry in described["classes"]}
    assert {names[number] for number in np.unique(classes)} == {"road", "car"}
    # Metres at 100 m and more, of floats.
    near = depth[seen] < 100
    ground = (classes == 7) & near
    assert ground.sum() > 1000 and np.abs(points[ground][:, 1]).max() < 2e-3
    car = points[classes == 26]
    assert len(car) > 100 and (np.abs(car - [0, 0.75, -12]) < np.array([0.9, 0.75, 2]) + 1e-3).all()
    # Nothing moves but the camera, which turns: where each point and each direction of the sky is in the other picture.
    for flow, other in [("flow", 2), ("flow_back", -2)]:
        there = [found for found in front["captures"] if found["step"] == step + other]
        if there:
            camera_from_world = np.linalg.inv(world_from_sensor(front, there[0]))
            found = rays @ world_from_sensor(front, capture)[:3, :3].T @ camera_from_world[:3, :3].T
            found[seen] = transformed(camera_from_world, points)
            place = found @ k.T
            expected = place[..., :2] / place[..., 2:] - np.stack([u, v], -1)
            shift = np.load(folder / "front" / f"{flow}_{step:05}.npy")
            # Floats of the depth buffer at 1e-5 of distances hardly count where a camera turns; those of places do.
            assert np.abs(shift - expected).max() < 5e-3, np.abs(shift - expected).max()
            flags = np.load(folder / "front" / f"{flow}_flags_{step:05}.npy")
            assert (flags & 1 == 1).all() and np.array_equal(flags & 8 == 8, ~seen)

    # The only thing.
    boxes = arrays["boxes"]
    assert len(boxes) == 1 and boxes["class"][0] == 26, boxes
    box = boxes[0]
    mask = arrays["instance"] == box["id"]
    assert mask.sum() == box["pixels"] > 100
    rows, columns = np.nonzero(mask)
    assert box["box_visible"].tolist() == [columns.min(), rows.min(), columns.max() + 1, rows.max() + 1]
    assert box["visible"] == 1 and box["truncated"] == 0
    assert np.allclose(box["size"], [4, 1.8, 1.5], atol=1e-5)
    assert np.allclose(box["world_center"], [0, 0.75, -12], atol=1e-5)
    camera_from_world = np.linalg.inv(world_from_sensor(front, capture))
    assert np.allclose(transformed(camera_from_world, box["world_center"]), box["center"], atol=1e-5)
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    corners = transformed(camera_from_world, box["world_center"] + signs * [0.9, 0.75, 2])
    projected = corners @ k.T
    projected = projected[:, :2] / projected[:, 2:] + 0.5
    assert np.abs(projected - box["corners_uv"]).max() < 1e-3
    # A box has no other vertices.
    around = np.concatenate([projected.min(0), projected.max(0)])
    assert np.abs(around - box["box_full"]).max() < 1e-3, (around, box["box_full"])

    # Normals of the ground, in the world's axes: up.
    normals = arrays["normal"][seen][ground] @ world_from_sensor(front, capture)[:3, :3].T
    assert np.allclose(normals, [0, 1, 0], atol=2e-3)

for capture in top["captures"]:
    step = capture["step"]
    points = np.load(folder / "top" / f"points_{step:05}.npy")
    arrays = np.load(folder / "top" / f"{step:05}.npz")
    for name in points.dtype.names:
        assert np.array_equal(points[name], arrays[name]), name
    # Nothing is fired before the first step.
    assert len(points) == (0 if step == 0 else 1800 * 16)
    hit = points[points["hit"] == 1]
    if step > 0:
        assert 0.2 < len(hit) / len(points) < 0.8
        # Every column from where the sensor was, which turned evenly: 3 degrees from one capture to the next.
        before = np.array(capture["world_from_entity_before"]) @ np.array(top["entity_from_sensor"])
        after = world_from_sensor(top, capture)
        turn = after[:3, :3] @ before[:3, :3].T
        angle = np.arctan2(turn[0, 2], turn[0, 0])
        assert abs(np.degrees(angle)) > 1, angle
        assert np.allclose(before[:3, 3], after[:3, 3], atol=1e-6)
        fraction = hit["time"] / 0.1
        c, s = np.cos(angle * fraction), np.sin(angle * fraction)
        first = hit["xyz"].astype(np.float64) @ before[:3, :3].T
        places = np.stack([c * first[:, 0] + s * first[:, 2], first[:, 1], c * first[:, 2] - s * first[:, 0]], -1)
        places = places + before[:3, 3]
        car = places[hit["class"] == 26]
        assert (np.abs(car - [0, 0.75, -12]) < np.array([0.9, 0.75, 2]) + 0.01).all(), np.abs(car - [0, 0.75, -12]).max(0)
        ground = hit["class"] == 7
        assert np.abs(places[ground][:, 1]).max() < 2e-3
        assert (hit["class"] == 26).sum() > 20
        assert np.allclose(np.linalg.norm(hit["xyz"], axis=1), hit["range"], atol=0.2)

manifest = json.loads((folder / "manifest.json").read_text())
files = {str(path.relative_to(folder)).replace("\\", "/") for path in folder.rglob("*") if path.is_file()}
assert set(manifest["blake3"]) == files - {"manifest.json"}, files ^ set(manifest["blake3"])
print("read", len(files))
