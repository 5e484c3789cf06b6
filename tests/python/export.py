"""Reads exported files with others' programs, and compares with what was to be in them: tests/sensors/export/mod.rs.

    export.py FOLDER

FOLDER holds expected.json, a list of {"reader", "file", "content"}. An array in a content is {"raw", "dtype", "shape"}:
the values as they are, in a file of their own. Floats must be equal to the bit.
"""

import io
import json
import sys
from contextlib import redirect_stdout
from pathlib import Path

import mcap.reader
import numpy as np
import OpenEXR
import pycocotools.mask
from mcap_ros2.decoder import DecoderFactory
from pycocotools.coco import COCO
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

FOLDER = Path(sys.argv[1])


def array(said):
    return np.fromfile(FOLDER / said["raw"], said["dtype"]).reshape(said["shape"])


def same(found, wanted, place):
    assert found.dtype == wanted.dtype, f"{place}: {found.dtype}, not {wanted.dtype}"
    assert found.shape == wanted.shape, f"{place}: {found.shape}, not {wanted.shape}"
    assert found.tobytes() == wanted.tobytes(), f"{place}: other values"


def equal(found, wanted, place):
    assert found == wanted, f"{place}: {found!r}, not {wanted!r}"


def npy(path, content):
    same(np.load(path), array(content), path.name)


def npz(path, content):
    with np.load(path) as arrays:
        equal(sorted(arrays), sorted(content), path.name)
        for name, said in content.items():
            same(arrays[name], array(said), f"{path.name} {name}")


def records(path, content):
    found = np.load(path)
    equal(sorted(found.dtype.names), sorted(content), path.name)
    equal(found.dtype.itemsize, sum(found.dtype[name].itemsize for name in content), path.name)
    for name, said in content.items():
        same(np.ascontiguousarray(found[name]), array(said), f"{path.name} {name}")


def exr(path, content):
    with OpenEXR.File(str(path), separate_channels=True) as file:
        equal(file.header()["compression"], OpenEXR.ZIP_COMPRESSION, path.name)
        names = [name for group in content for name in group.split()]
        equal(sorted(file.channels()), sorted(names), path.name)
        for group, said in content.items():
            pixels = np.stack([file.channels()[name].pixels for name in group.split()], axis=-1)
            same(pixels, array(said), f"{path.name} {group}")


def fields(found, wanted, place):
    """A decoded message against a dict of all its fields."""
    if isinstance(wanted, dict) and "raw" in wanted:
        same(np.frombuffer(bytes(found), "u1"), array(wanted), place)
    elif isinstance(wanted, dict):
        equal({name for name in found.__slots__ if not name.startswith("_")}, set(wanted), place)
        for name, value in wanted.items():
            fields(getattr(found, name), value, f"{place}.{name}")
    elif isinstance(wanted, list):
        equal(len(found), len(wanted), place)
        for index, (one, value) in enumerate(zip(found, wanted)):
            fields(one, value, f"{place}[{index}]")
    else:
        equal(found, wanted, place)


def log(path, content):
    ros = get_typestore(Stores.ROS2_HUMBLE)
    with open(path, "rb") as stream:
        reader = mcap.reader.make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        equal(reader.get_header().profile, "ros2", path.name)
        summary = reader.get_summary()
        equal(summary.statistics.message_count, len(content), path.name)
        assert summary.statistics.chunk_count > 2, "the log is one chunk"
        for schema in summary.schemas.values():
            equal(schema.encoding, "ros2msg", schema.name)
            for name, definition in get_types_from_msg(schema.data.decode(), schema.name).items():
                if name not in ros.fielddefs:
                    ros.register({name: definition})
                # Constants are not needed to decode.
                equal(definition[1], ros.fielddefs[name][1], name)
        times = sorted({message["time"] for message in content})
        late = [message for message in content if message["time"] == times[-1]]
        found = list(reader.iter_messages(start_time=times[-1], log_time_order=False))
        equal([channel.topic for _, channel, _ in found], [message["topic"] for message in late], path.name)
        found = reader.iter_decoded_messages(log_time_order=False)
        for (schema, channel, message, decoded), wanted in zip(found, content, strict=True):
            place = f"{channel.topic} at {message.log_time}"
            equal(channel.message_encoding, "cdr", place)
            said = [channel.topic, message.log_time, message.publish_time, message.sequence]
            equal(said, [wanted["topic"], wanted["time"], wanted["time"], wanted["sequence"]], place)
            fields(decoded, wanted["content"], place)
            # A second implementation puts what it decodes into the same bytes.
            again = ros.serialize_cdr(ros.deserialize_cdr(message.data, schema.name), schema.name)
            equal(bytes(again), bytes(message.data), f"{place}, encoded again")


def coco(path, content):
    with redirect_stdout(io.StringIO()):
        file = COCO(str(path))
    instance = array(content["instance"])
    things = [int(thing) for thing in np.unique(instance) if thing]
    equal(sorted(file.getImgIds()), content["pictures"], path.name)
    for picture in content["pictures"]:
        annotations = file.loadAnns(file.getAnnIds(imgIds=[picture]))
        equal(len(annotations), len(things), path.name)
        for annotation, thing in zip(annotations, things):
            place = f"{path.name}: {thing} in {picture}"
            mask = file.annToMask(annotation)
            assert np.array_equal(mask, instance == thing), f"{place}: another mask"
            packed = file.annToRLE(annotation)
            equal(annotation["area"], int(pycocotools.mask.area(packed)), place)
            equal(annotation["bbox"], pycocotools.mask.toBbox(packed).tolist(), place)
            equal(annotation["category_id"], content["category"], place)


def panoptic(path, content):
    """By `rgb2id` of panopticapi, which is on GitHub only, as its documentation states it."""
    rgb = array(content["rgb"]).astype(np.uint32)
    ids = rgb[..., 0] + 256 * rgb[..., 1] + 256 * 256 * rgb[..., 2]
    instance, classes = array(content["instance"]), array(content["class"])
    (annotation,) = json.loads(path.read_text())["annotations"]
    equal(sum(segment["area"] for segment in annotation["segments_info"]), ids.size, path.name)
    equal({segment["id"] for segment in annotation["segments_info"]}, set(np.unique(ids).tolist()), path.name)
    for segment in annotation["segments_info"]:
        inside = ids == segment["id"]
        equal(segment["area"], int(inside.sum()), path.name)
        equal({segment["category_id"]}, set(classes[inside].tolist()), path.name)
        equal(len(np.unique(instance[inside])), 1, path.name)
        rows, columns = np.nonzero(inside)
        box = [columns.min(), rows.min(), np.ptp(columns) + 1, np.ptp(rows) + 1]
        equal(segment["bbox"], [int(side) for side in box], path.name)


def velodyne(path, content):
    scan = np.fromfile(path, np.float32).reshape(-1, 4)
    same(np.ascontiguousarray(scan[:, :3]), array(content["points"]), path.name)
    same(np.ascontiguousarray(scan[:, 3]), array(content["intensity"]), path.name)


def semantic_kitti(path, content):
    label = np.fromfile(path, np.uint32)
    assert np.array_equal(label & 0xFFFF, array(content["class"])), path.name
    assert np.array_equal(label >> 16, array(content["instance"])), path.name


def label_2(path, content):
    lines = path.read_text().splitlines()
    equal([[line.split()[0], *map(float, line.split()[1:])] for line in lines], content, path.name)


def calib(path, content):
    lines = (line.split(":", 1) for line in path.read_text().splitlines())
    equal({name: [float(value) for value in values.split()] for name, values in lines}, content, path.name)


def flo(path, content):
    tag, width, height = np.fromfile(path, "<f4,<i4,<i4", count=1)[0]
    equal(float(tag), 202021.25, path.name)
    same(np.fromfile(path, "<f4", offset=12).reshape(height, width, 2), array(content), path.name)


READERS = {
    "npy": npy, "npz": npz, "records": records, "exr": exr, "mcap": log, "coco": coco, "panoptic": panoptic,
    "velodyne": velodyne, "semantic_kitti": semantic_kitti, "label_2": label_2,
    "calib": calib, "flo": flo,
}

expected = json.loads((FOLDER / "expected.json").read_text())
for one in expected:
    READERS[one["reader"]](FOLDER / one["file"], one["content"])
print(f"{len(expected)} files")
