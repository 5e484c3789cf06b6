"""Reads a log of sensors with others' programs, and compares it with other files of the same run:
tests/sensors/sensor_log.rs.

    sensor_log.py FOLDER

FOLDER holds expected.json, and in run/ sensors.json, sensors.mcap, and arrays as NPY. Floats must be equal to the bit.
"""

import importlib.util
import json
import sys
from pathlib import Path
from types import SimpleNamespace

import mcap.reader
import numpy as np
from mcap_ros2.decoder import DecoderFactory

RUN = Path(sys.argv[1]) / "run"
EXPECTED = json.loads((RUN.parent / "expected.json").read_text())
FRAMES = EXPECTED["frames"]
DESCRIBED = json.loads((RUN / "sensors.json").read_text())
# What reads boxes for rerun, from its file alone: the package has a module that is not built here.
OF_RERUN = importlib.util.spec_from_file_location(
    "boxes_for_rerun", Path(__file__).resolve().parents[2] / "python" / "relief" / "rerun.py"
)
FOR_RERUN = importlib.util.module_from_spec(OF_RERUN)
sys.modules["boxes_for_rerun"] = FOR_RERUN
OF_RERUN.loader.exec_module(FOR_RERUN)
# (x, y, z) are the scene's (Z, X, Y).
ROS_FROM_SCENE = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]])
PICTURES = {
    "image_raw": ("color", "rgb8", "u1"), "depth": ("depth", "32FC1", "<f4"), "class": ("class", "mono8", "u1"),
    "instance": ("instance", "32SC1", "<u4"),
}
POINTS = [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("intensity", "<f4"), ("ring", "<u2"), ("time", "<f4"),
          ("instance", "<u4"), ("class", "u1")]
# Numbers of sensor_msgs/PointField.
KINDS = {"u1": 2, "<u2": 4, "<u4": 6, "<f4": 7}


def equal(found, wanted, place):
    assert found == wanted, f"{place}: {found!r}, not {wanted!r}"


def same(found, wanted, place):
    equal(found.dtype.newbyteorder("="), wanted.dtype.newbyteorder("="), place)
    equal(found.shape, wanted.shape, place)
    assert found.tobytes() == wanted.tobytes(), f"{place}: other values"


def rotation(q):
    """The matrix of a unit quaternion."""
    x, y, z, w = q.x, q.y, q.z, q.w
    assert abs(x * x + y * y + z * z + w * w - 1) < 1e-12, q
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])


def nanoseconds(step):
    return round(step * DESCRIBED["step_seconds"] * 1e9)


def transforms(message, step):
    """Each sensor's frame in the world, which is to be where sensors.json has it; before these the frames of lidars that
    sweep, of when their first columns were fired."""
    due = [(one, at, "nanoseconds", "world_from_entity") for one in DESCRIBED["sensors"] for at in one["captures"]
           if at["step"] == step]
    begun = [(one, at, "first_column_nanoseconds", "world_from_entity_before") for one, at, *_ in due
             if "world_from_entity_before" in at]
    equal([one.child_frame_id for one in message.transforms], [FRAMES[one["name"]] for one, *_ in begun + due], "/tf")
    places = {}
    for said, (sensor, at, when, where) in zip(message.transforms, begun + due):
        equal(said.header.frame_id, "world", "/tf")
        equal(said.header.stamp.sec * 10**9 + said.header.stamp.nanosec, at[when], "/tf")
        turn, move = said.transform.rotation, said.transform.translation
        world_from_sensor = np.array(at[where]) @ np.array(sensor["entity_from_sensor"])
        place = rotation(turn), np.array([move.x, move.y, move.z])
        # The axes of entities are of single precision, of 2^-24 each, and so are not quite a rotation's.
        assert np.abs(place[0] - ROS_FROM_SCENE @ world_from_sensor[:3, :3]).max() < 1e-6, said.child_frame_id
        assert np.array_equal(place[1], ROS_FROM_SCENE @ world_from_sensor[:3, 3]), said.child_frame_id
        places.setdefault(said.child_frame_id, []).append((at[when], *place))
    return {frame: Frame(known) for frame, known in places.items()}


class Frame:
    """Where a frame is between the first and the last time at which that is known."""

    def __init__(self, known):
        self.known = known
        self.last = known[-1][1:]

    def at(self, stamp):
        """As tf2 has it: straight ahead, and turned evenly."""
        (begin, turn, move), (end, last_turn, last_move) = self.known[0], self.known[-1]
        assert begin - 1 <= stamp <= end, (begin, stamp, end)
        part = (stamp - begin) / (end - begin) if end > begin else 1.0
        between = turn.T @ last_turn
        angle = np.arccos(np.clip((np.trace(between) - 1) / 2, -1, 1))
        if angle < 1e-9:
            return last_turn, move + part * (last_move - move)
        skew = (between - between.T) / (2 * np.sin(angle))
        step = np.eye(3) + np.sin(part * angle) * skew + (1 - np.cos(part * angle)) * skew @ skew
        return turn @ step, move + part * (last_move - move)


def on_planes(points, classes, place):
    """How many points of each class there are, which are to lie in its plane. Depths are off by 1e-5 of themselves at
    most; places of single precision within 40 m of the origin by 4e-6 m an operation, of which there are some."""
    turn, move = place
    distance = np.linalg.norm(points, axis=-1)
    counts = []
    for one, normal, offset in EXPECTED["planes"]:
        seen = classes == one
        away = (points[seen] @ turn.T + move) @ np.array(normal) - offset
        assert (np.abs(away) < 1e-5 * distance[seen] + 5e-5).all(), f"class {one}: {np.abs(away).max()} m away"
        counts.append(seen.sum())
    return counts


def image(message, sensor, topic, step):
    output, encoding, dtype = PICTURES[topic]
    wanted = np.load(RUN / sensor["name"] / f"{output}_{step:05}.npy")
    equal((message.encoding, message.is_bigendian), (encoding, 0), topic)
    equal((message.height, message.width), wanted.shape[:2], topic)
    equal(message.step, wanted[0].nbytes, topic)
    found = np.frombuffer(bytes(message.data), dtype).reshape(wanted.shape)
    same(found, wanted, f"{topic} after {step}")
    return found


def camera_info(message, sensor):
    equal((message.height, message.width), (sensor["height"], sensor["width"]), "size")
    k = np.array(sensor["K"])
    distortion = [message.distortion_model, list(message.d)]
    equal(distortion, EXPECTED["distortions"][sensor["name"]], "distortion")
    equal(distortion, [sensor["distortion_model"], sensor["D"]], "distortion")
    equal(list(message.k), k.ravel().tolist(), "K")
    equal(list(message.r), np.eye(3).ravel().tolist(), "R")
    equal(list(message.p), np.hstack([k, np.zeros((3, 1))]).ravel().tolist(), "P")


def pixels_are_places(info, seen, place):
    """Of a camera whose last message this is: its pixels as points on the planes that they show."""
    v, u = np.indices((info.height, info.width))
    rays = np.stack([u, v, np.ones_like(u)], axis=-1) @ np.linalg.inv(np.reshape(info.k, (3, 3))).T
    depth, classes = seen["depth"], seen["class"]
    inside = np.isfinite(depth)
    counts = on_planes(rays[inside] * depth[inside][:, None].astype(float), classes[inside], place)
    equal([count > 300 for count in counts], [True] * 2, "places of pixels")


def points(message, sensor, step):
    dtype = np.dtype(POINTS)
    fields, offsets = [], [dtype.fields[name][1] for name, _ in POINTS]
    for (name, kind), offset in zip(POINTS, offsets):
        fields.append((name, offset, KINDS[kind], 1))
    equal([(field.name, field.offset, field.datatype, field.count) for field in message.fields], fields, "fields")
    scan = np.load(RUN / sensor["name"] / f"points_{step:05}.npy")
    scan = scan[scan["hit"] == 1]
    equal((message.height, message.width, message.point_step), (1, len(scan), dtype.itemsize), "points")
    equal((message.row_step, message.is_bigendian, message.is_dense), (len(message.data), False, True), "points")
    found = np.frombuffer(bytes(message.data), dtype)
    for i, axis in enumerate("xyz"):
        same(found[axis], np.ascontiguousarray(scan["xyz"][:, i]), axis)
    for name, _ in POINTS[3:]:
        # What does not sweep measures all at the capture.
        since = np.float32(sensor["sweep"] if name == "time" else 1)
        same(found[name], scan[name] * since if name == "time" else scan[name], name)
    return np.stack([found[axis] for axis in "xyz"], axis=-1).astype(float), found["class"], found["time"]


def in_world(points, times, stamp, frame):
    """Each where the frame was when it was measured, its time after the stamp."""
    whole = np.empty_like(points)
    for time in np.unique(times):
        turn, move = frame.at(stamp + float(time) * 1e9)
        whole[times == time] = points[times == time] @ turn.T + move
    return whole


def boxes(message, topic, kind, step):
    """Boxes as `relief.rerun` reads them are those of the run's arrays."""
    wanted = np.load(RUN / "ego/front" / f"boxes_{step:05}.npy")
    if kind == "boxes":
        found, wanted = FOR_RERUN.boxes_in_picture(topic, step, message), wanted[wanted["pixels"] > 0]
        equal(found.frame, "ego/front_image_plane", topic)
        same(found.edges.astype("f4"), wanted["box_visible"].astype("f4"), topic)
    else:
        found = FOR_RERUN.boxes_in_space(topic, step, message)
        equal(found.frame, "world", topic)
        same(found.centers, wanted["world_center"].astype("f8") @ ROS_FROM_SCENE.T, topic)
        # Boxes have length, width and height; along their own axes these are width, height and length.
        same(found.sizes.astype("f4"), np.ascontiguousarray(wanted["size"][:, [1, 2, 0]]), topic)
        for q, (w, x, y, z) in zip(found.quaternions, wanted["world_quaternion"].astype("f8")):
            turned = rotation(SimpleNamespace(x=q[0], y=q[1], z=q[2], w=q[3]))
            # Quaternions of double precision, made of matrices and back.
            assert np.abs(turned - ROS_FROM_SCENE @ rotation(SimpleNamespace(x=x, y=y, z=z, w=w))).max() < 1e-6
    equal(found.labels, [f"car {one['id']}" for one in wanted], topic)
    return len(wanted)


with open(RUN / "sensors.mcap", "rb") as stream:
    reader = mcap.reader.make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
    equal(reader.get_header().profile, "ros2", "profile")
    messages = list(reader.iter_decoded_messages(log_time_order=False))

steps = {nanoseconds(step): step for steps in EXPECTED["messages"].values() for step in steps}
sensors = {FRAMES[sensor["name"]]: sensor for sensor in DESCRIBED["sensors"]}
found, places, turns, seen, counts = {}, {}, [], {}, []
for schema, channel, message, decoded in messages:
    topic, step = channel.topic, steps[message.log_time]
    equal(message.publish_time, message.log_time, topic)
    equal(message.sequence, len(found.setdefault(topic, [])), topic)
    found[topic].append(step)
    stamp = decoded.clock if topic == "/clock" else None
    if topic == "/tf":
        places = transforms(decoded, step)
        turns += [frame.last[0] for name, frame in places.items() if name == "ego/front"]
        stamp = decoded.transforms[-1].header.stamp
    elif topic != "/clock":
        frame, kind = topic[1:].rsplit("/", 1)
        if kind in ("boxes", "objects"):
            counts.append(boxes(decoded, topic, kind, step))
            continue
        equal(decoded.header.frame_id, frame, topic)
        stamp, sensor = decoded.header.stamp, sensors[frame]
        if kind == "points":
            xyz, classes, times = points(decoded, sensor, step)
            capture = next(at for at in sensor["captures"] if at["step"] == step)
            began = capture["first_column_nanoseconds" if sensor["sweep"] else "nanoseconds"]
            equal(stamp.sec * 10**9 + stamp.nanosec, began, topic)
            placed = in_world(xyz, times, began, places[frame])
            of_planes = on_planes(placed, classes, (np.eye(3), np.zeros(3)))
            equal([count > 100 for count in of_planes], [True] * 2, topic)
            continue
        elif kind == "camera_info":
            camera_info(decoded, sensor)
            if not any(decoded.d):
                pixels_are_places(decoded, seen, places[frame].last)
        else:
            seen[kind] = image(decoded, sensor, kind, step)
    equal(stamp.sec * 10**9 + stamp.nanosec, message.log_time, topic)
equal(found, EXPECTED["messages"], "messages")
# The box on the floor, as it is seen and as it is.
equal(min(counts), 1, "boxes")
# The rig turns by ten degrees a step.
for before, after in zip(turns, turns[1:]):
    cosine = (np.trace(before.T @ after) - 1) / 2
    assert abs(np.degrees(np.arccos(cosine)) - 10) < 1e-3, cosine
print(f"{len(messages)} messages")
