"""Reads the data set of tests/sensor_files.rs: equal arrays in all forms, and points where the scene has its planes."""

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
    assert set(arrays.files) == set(front["outputs"]), arrays.files
    shape = (front["height"], front["width"])
    for name, output in front["outputs"].items():
        own = np.load(folder / "front" / f"{name}_{step:05}.npy")
        assert own.dtype == np.dtype(output["type"]), (name, own.dtype)
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
