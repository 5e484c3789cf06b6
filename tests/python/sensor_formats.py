"""Reads the data sets of tests/sensors/sensor_formats.rs: COCO's labels, KITTI's folders and nuScenes' tables against
the arrays beside them.
"""

import copy
import io
import json
import sys
from contextlib import redirect_stdout
from pathlib import Path

import cv2
import numpy as np
from panopticapi.evaluation import pq_compute_single_core
from panopticapi.utils import rgb2id
from pycocotools.coco import COCO

folder = Path(sys.argv[1])
described = json.loads((folder / "sensors.json").read_text())
sensors = {sensor["name"]: sensor for sensor in described["sensors"]}
classes = {entry["id"]: entry for entry in described["classes"]}


def picture(path):
    read = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    assert read is not None, path
    # Blue first.
    return read[..., ::-1] if read.ndim == 3 else read


def array(sensor, name, step):
    return np.load(folder / sensor / f"{name}_{step:05}.npy")


# Things: as pycocotools has them.
with redirect_stdout(io.StringIO()):
    coco = COCO(str(folder / "coco" / "instances.json"))
images = coco.loadImgs(coco.getImgIds())
assert [image["file_name"] for image in images] == [f"ego/front/color_{step:05}.png" for step in [0, 2, 4]]
assert {entry["name"] for entry in coco.loadCats(coco.getCatIds())} == {
    entry["name"] for entry in classes.values() if entry["thing"]
}
things = 0
for image, step in zip(images, [0, 2, 4]):
    assert picture(folder / image["file_name"]).shape == (image["height"], image["width"], 3)
    assert np.array_equal(picture(folder / image["file_name"]), array("ego/front", "color", step))
    instance, semantic = array("ego/front", "instance", step), array("ego/front", "class", step)
    wanted = [int(n) for n in np.unique(instance) if n and classes[int(semantic[instance == n][0])]["thing"]]
    annotations = coco.loadAnns(coco.getAnnIds(imgIds=[image["id"]]))
    assert len(annotations) == len(wanted) == 2, (annotations, wanted)
    for annotation, number in zip(annotations, wanted):
        mask = instance == number
        assert np.array_equal(coco.annToMask(annotation), mask)
        assert annotation["area"] == mask.sum()
        rows, columns = np.nonzero(mask)
        box = [columns.min(), rows.min(), np.ptp(columns) + 1, np.ptp(rows) + 1]
        assert annotation["bbox"] == [int(side) for side in box]
        assert {annotation["category_id"]} == set(semantic[mask].tolist())
        things += 1
assert {classes[entry["category_id"]]["name"] for entry in coco.anns.values()} == {"car", "truck"}

# All pixels: as panopticapi has them.
panoptic = json.loads((folder / "coco" / "panoptic.json").read_text())
assert panoptic["images"] == [dict(image) for image in images]
assert {entry["id"]: entry["isthing"] for entry in panoptic["categories"]} == {
    number: int(entry["thing"]) for number, entry in classes.items() if number
}
for annotation, step in zip(panoptic["annotations"], [0, 2, 4], strict=True):
    assert annotation["file_name"] == f"ego/front/{step:05}.png"
    ids = rgb2id(picture(folder / "coco" / "panoptic" / annotation["file_name"]))
    instance, semantic = array("ego/front", "instance", step), array("ego/front", "class", step)
    # Sky and wall have no class, and are in no segment.
    assert np.array_equal(ids == 0, semantic == 0) and (ids == 0).any()
    assert {segment["id"] for segment in annotation["segments_info"]} == set(np.unique(ids).tolist()) - {0}
    assert sum(segment["area"] for segment in annotation["segments_info"]) + (ids == 0).sum() == ids.size
    for segment in annotation["segments_info"]:
        inside = ids == segment["id"]
        assert segment["area"] == inside.sum()
        assert {segment["category_id"]} == set(semantic[inside].tolist())
        if classes[segment["category_id"]]["thing"]:
            assert np.array_equal(inside, instance == segment["id"] - 256)
        else:
            assert segment["id"] == segment["category_id"]

# Its evaluation reads the pictures itself; the areas of one side it takes from the labels. The set against itself:
pictures = str(folder / "coco" / "panoptic")
categories = {entry["id"]: entry for entry in panoptic["categories"]}
with redirect_stdout(io.StringIO()):
    pairs = [(annotation, copy.deepcopy(annotation)) for annotation in panoptic["annotations"]]
    quality, _ = pq_compute_single_core(0, pairs, pictures, pictures, categories).pq_average(categories, isthing=None)
assert quality == {"pq": 1, "sq": 1, "rq": 1, "n": 3}, quality


def scan(home, lidar, step):
    """The points of a scan, which are the returns of the lidar's own array."""
    points = np.load(folder / lidar / f"points_{step:05}.npy")
    hit = points[points["hit"] == 1]
    velodyne = np.fromfile(home / "velodyne" / f"{step:06}.bin", "<f4").reshape(-1, 4)
    assert np.array_equal(velodyne, np.column_stack([hit["xyz"], hit["intensity"]]))
    labels = np.fromfile(home / "labels" / f"{step:06}.label", "<u4")
    assert np.array_equal(labels & 0xFFFF, hit["class"]) and np.array_equal(labels >> 16, hit["instance"])
    return velodyne, hit["class"]


home = folder / "ego" / "front" / "kitti"
front = sensors["ego/front"]
scans = 0
for step in [0, 2, 4]:
    name = f"{step:06}"
    assert np.array_equal(picture(home / "image_2" / f"{name}.png"), array("ego/front", "color", step))
    assert np.array_equal(picture(home / "semantic" / f"{name}.png"), array("ego/front", "class", step))
    depth = array("ego/front", "depth", step)
    metres = np.where(depth < 255.99, np.floor(depth * 256 + 0.5), 0)
    assert np.array_equal(picture(home / "depth" / f"{name}.png"), metres)
    calib = dict(line.split(":", 1) for line in (home / "calib" / f"{name}.txt").read_text().splitlines())
    calib = {key: np.array(numbers.split(), np.float64) for key, numbers in calib.items()}
    p2, tr = calib["P2"].reshape(3, 4), calib["Tr_velo_to_cam"].reshape(3, 4)
    assert np.array_equal(p2[:, :3], front["K"]) and np.array_equal(p2[:, 3], [0, 0, 0])
    assert np.array_equal(calib["R0_rect"].reshape(3, 3), np.eye(3))
    # The box of the scene, of 1.8 × 1.5 × 4 m with the middle of its lower face at (0.5, 0, 10), looks along +Z.
    lines = [line.split() for line in (home / "label_2" / f"{name}.txt").read_text().splitlines()]
    assert [line[0] for line in lines] == ["Car", "Truck"] and all(len(line) == 15 for line in lines), lines
    truncated, occluded, alpha, *numbers = map(float, lines[0][1:])
    capture = next(capture for capture in front["captures"] if capture["step"] == step)
    camera_from_world = np.linalg.inv(np.array(capture["world_from_entity"]) @ np.array(front["entity_from_sensor"]))
    location = (camera_from_world @ [0.5, 0, 10, 1])[:3]
    forward = camera_from_world[:3, :3] @ [0, 0, 1]
    turn = np.arctan2(-forward[2], forward[0])
    # Numbers have four places behind the point; those of the program came through floats of some metres.
    assert np.allclose(numbers[4:], [1.5, 1.8, 4, *location, turn], atol=2e-4), (numbers, location)
    assert np.isclose(alpha, turn - np.arctan2(location[0], location[2]), atol=2e-4)
    # All of it is seen: its outline goes around its pixels, half a pixel more at most, and it is in the picture.
    rows, columns = np.nonzero(array("ego/front", "class", step) == 26)
    seen = [columns.min(), rows.min(), columns.max(), rows.max()]
    assert np.abs(np.subtract(numbers[:4], seen)).max() <= 0.5 + 1e-3, (numbers[:4], seen)
    assert truncated == 0 and occluded == 0
    # Behind it is the truck, a part of which it hides.
    assert int(lines[1][2]) in [1, 2], lines[1]
    if step < 4:
        flow, flags = array("ego/front", "flow", step), array("ego/front", "flow_flags", step)
        steps = np.floor(flow * 64 + 32768 + 0.5)
        fits = (flags & 1 == 1) & ((steps >= 0) & (steps <= 65535)).all(-1)
        wanted = np.where(fits[..., None], np.concatenate([steps, np.ones_like(steps[..., :1])], -1), 0)
        assert np.array_equal(picture(home / "flow" / f"{name}.png"), wanted) and fits.any()
    else:
        assert not (home / "flow" / f"{name}.png").exists()
    points, found = scan(home, "ego/top", step)
    # Nothing is fired before the first step.
    assert (len(points) == 0) == (step == 0)
    if step == 0:
        continue
    scans += 1
    # Points of the lidar lie where the camera sees their distances: those of the ground and the boxes, a pixel from
    # others at least.
    camera = np.column_stack([points[:, :3], np.ones(len(points))]) @ tr.T
    camera, seen = camera[camera[:, 2] > 1], found[camera[:, 2] > 1]
    pixels = np.column_stack([camera, np.ones(len(camera))]) @ p2.T
    u, v = np.rint(pixels[:, :2] / pixels[:, 2:]).astype(int).T
    inside = (u > 0) & (u < front["width"] - 1) & (v > 0) & (v < front["height"] - 1)
    u, v, camera, seen = u[inside], v[inside], camera[inside], seen[inside]
    semantic = array("ego/front", "class", step)
    around = [semantic[v + down, u + right] for down in [-1, 0, 1] for right in [-1, 0, 1]]
    clear = np.all([one == seen for one in around], axis=0) & np.isin(seen, [26, 27])
    assert clear.sum() > 30, clear.sum()
    # Faces are nearly square to the view: within half a pixel, 1/160 of the distance, depths hardly change; a beam may
    # graze a flank, where a pixel more is 0.1 m.
    assert np.abs(depth[v, u] - camera[:, 2])[clear].max() < 0.1, np.abs(depth[v, u] - camera[:, 2])[clear].max()

rear = folder / "ego" / "rear" / "kitti"
assert sorted(path.name for path in rear.iterdir()) == ["calib", "image_2", "labels", "velodyne"]
assert (rear / "velodyne" / "000004.bin").read_bytes() == (home / "velodyne" / "000004.bin").read_bytes()
post = folder / "post" / "kitti"
assert sorted(path.name for path in post.iterdir()) == ["labels", "velodyne"]
scan(post, "post", 2)
scans += 1
assert not (folder / "ego" / "top" / "kitti").exists()

# Tables, as the development kit of nuScenes goes through them: rows by tokens, and frames from one to the next.
tables = {path.stem: json.loads(path.read_text()) for path in sorted((folder / "nuscenes").glob("*.json"))}
assert len(tables) == 13
known = {name: {row["token"]: row for row in rows} for name, rows in tables.items()}
assert all(len(known[name]) == len(rows) for name, rows in tables.items())
aliases = {"first_annotation": "sample_annotation", "last_annotation": "sample_annotation"}
aliases.update({"first_sample": "sample", "last_sample": "sample"})
aliases.update({"log_tokens": "log", "attribute_tokens": "attribute"})
for name, rows in tables.items():
    for row in rows:
        for field, value in row.items():
            of = aliases.get(field.removesuffix("_token"), aliases.get(field, field.removesuffix("_token")))
            if field in ("prev", "next"):
                assert value == "" or known[name][value][{"prev": "next", "next": "prev"}[field]] == row["token"]
            elif field.endswith("_token"):
                assert value in known[of], (name, field)
            elif field.endswith("_tokens"):
                assert all(token in known[of] for token in value), (name, field)


def matrix(row):
    """From the frame that a row is of to that which it is in."""
    w, x, y, z = row["rotation"]
    turned = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])
    return np.block([[turned, np.reshape(row["translation"], (3, 1))], [np.zeros((1, 3)), np.ones((1, 1))]])


# Z is up: X of the global frame is the scene's Z.
global_from_world = np.array([[0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1.0]])
samples = sorted(tables["sample"], key=lambda row: row["timestamp"])
assert [row["timestamp"] for row in samples] == [0, 33_333, 66_666]
(scene,) = tables["scene"]
assert scene["nbr_samples"] == 3 and scene["first_sample_token"] == samples[0]["token"]
assert scene["last_sample_token"] == samples[2]["token"]
countable = [entry["name"] for entry in classes.values() if entry["thing"]]
assert [entry["name"] for entry in tables["category"]] == countable
for measured in tables["sample_data"]:
    calibrated = known["calibrated_sensor"][measured["calibrated_sensor_token"]]
    channel = known["sensor"][calibrated["sensor_token"]]["channel"]
    sensor = sensors[channel]
    step = int(Path(measured["filename"]).name.split("_")[1][:5])
    capture = next(capture for capture in sensor["captures"] if capture["step"] == step)
    world_from_outputs = np.array(capture["world_from_entity"]) @ np.array(sensor["entity_from_sensor"])
    global_from_outputs = matrix(known["ego_pose"][measured["ego_pose_token"]]) @ matrix(calibrated)
    assert np.allclose(global_from_outputs, global_from_world @ world_from_outputs, atol=1e-9)
    if channel != "ego/front":
        points = np.load(folder / channel / f"points_{step:05}.npy")
        hit = points[points["hit"] == 1]
        found = np.fromfile(folder / measured["filename"], "<f4").reshape(-1, 5)
        wanted = np.column_stack([hit["xyz"], hit["intensity"] * np.float32(255), hit["ring"].astype("<f4")])
        assert np.array_equal(found, wanted)
        continue
    assert calibrated["camera_intrinsic"] == sensor["K"] and measured["width"] == sensor["width"]
    assert np.array_equal(picture(folder / measured["filename"]), array("ego/front", "color", step))
    # Each box is where the camera's own array has it.
    boxes = {classes[int(box["class"])]["name"]: box for box in array("ego/front", "boxes", step)}
    lidars = [folder / name / f"points_{step:05}.npy" for name in ("ego/top", "post")]
    returns = np.concatenate([np.load(path)["instance"] for path in lidars if path.exists()])
    for annotation in tables["sample_annotation"]:
        if annotation["sample_token"] != measured["sample_token"]:
            continue
        instance = known["instance"][annotation["instance_token"]]
        box = boxes[known["category"][instance["category_token"]]["name"]]
        camera_from_box = np.linalg.inv(global_from_outputs) @ matrix(annotation)
        assert np.allclose(camera_from_box[:3, 3], box["center"], atol=1e-9)
        length, width, height = box["size"].tolist()
        assert np.allclose(annotation["size"], [width, length, height])
        w, x, y, z = box["quaternion"]
        ahead = [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)]
        assert np.allclose(camera_from_box[:3, 0], ahead, atol=1e-9)
        level = 1 + sum(box["visible"] >= np.float32(least) for least in (0.4, 0.6, 0.8))
        assert annotation["visibility_token"] == str(level)
        assert annotation["num_lidar_pts"] == (returns == box["id"]).sum()
        assert instance["nbr_annotations"] == 3
assert any(annotation["num_lidar_pts"] > 30 for annotation in tables["sample_annotation"])

manifest = json.loads((folder / "manifest.json").read_text())
files = {str(path.relative_to(folder)).replace("\\", "/") for path in folder.rglob("*") if path.is_file()}
assert set(manifest["blake3"]) == files - {"manifest.json"}, files ^ set(manifest["blake3"])
annotations = len(tables["sample_annotation"])
print(f"{len(images)} pictures, {things} things, {scans} folders of scans, {annotations} annotations")
