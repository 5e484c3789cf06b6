"""Messages of ROS 2 from captures, as the log has them (``--format mcap``). There is no node here.

Times are nanoseconds of the simulation. The frame ``world`` has Z up: (x, y, z) are the scene's (Z, X, Y). Arrays are
copied once, into the ``array.array`` that a message keeps.
"""

from __future__ import annotations

import re
import sys
from array import array
from importlib import import_module
from typing import Any

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Quaternion, TransformStamped, Vector3
from numpy.typing import NDArray
from rclpy.serialization import deserialize_message
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, Image, PointCloud2, PointField
from std_msgs.msg import Header

from .._relief import CameraCapture, LidarCapture, Reading

WORLD = "world"
"""The frame that all others are in."""
IMAGES = {
    "color": ("image_raw", "rgb8"),
    "depth": ("depth", "32FC1"),
    "class": ("class", "mono8"),
    "instance": ("instance", "32SC1"),
}
"""Outputs of a camera that have a topic: its last part, and the encoding."""
ROS_FROM_WORLD = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
"""(x, y, z) of ROS from the scene's coordinates."""

_DATATYPES = {
    "u1": PointField.UINT8,
    "u2": PointField.UINT16,
    "u4": PointField.UINT32,
    "f4": PointField.FLOAT32,
}
_BIG_ENDIAN = sys.byteorder == "big"


def frame_name(name: str) -> str:
    """The name of a sensor or vehicle as that of a frame and within those of topics. These have letters and digits of
    ASCII and ``_``, none first a digit: all else becomes ``_``."""
    parts = [re.sub(r"[^A-Za-z0-9_]", "_", part) for part in name.split("/")]
    return "/".join(f"_{part}" if not part or part[0].isdigit() else part for part in parts)


def time(nanoseconds: int) -> Time:
    """A time of the simulation."""
    seconds, rest = divmod(nanoseconds, 1_000_000_000)
    return Time(sec=seconds, nanosec=rest)


def clock(nanoseconds: int) -> Clock:
    """The time of the simulation, as ``rosgraph_msgs/Clock``."""
    return Clock(clock=time(nanoseconds))


def header(nanoseconds: int, frame: str) -> Header:
    """When something was measured, and in which frame."""
    return Header(stamp=time(nanoseconds), frame_id=frame)


def image(of: Header, pixels: NDArray[Any], encoding: str) -> Image:
    """A picture (H, W) or (H, W, channels), rows from the top. ``32SC1`` has the bits of uint32."""
    height, width = pixels.shape[:2]
    return Image(
        header=of,
        height=height,
        width=width,
        encoding=encoding,
        is_bigendian=_BIG_ENDIAN,
        step=pixels.nbytes // height,
        data=_bytes(pixels),
    )


def camera_info(of: Header, camera: CameraCapture) -> CameraInfo:
    """The camera, as one that is no part of a stereo pair: R is the identity, P is K.

    Args:
        camera: one with K: not of a parallel projection.
    """
    assert camera.K is not None and camera.D is not None and camera.distortion_model is not None
    k = np.asarray(camera.K, dtype=np.float64)
    width, height = camera.size
    return CameraInfo(
        header=of,
        height=height,
        width=width,
        distortion_model=camera.distortion_model,
        d=camera.D.tolist(),
        k=k.ravel(),
        r=np.eye(3).ravel(),
        p=np.hstack([k, np.zeros((3, 1))]).ravel(),
    )


def points(of: Header, lidar: LidarCapture) -> PointCloud2:
    """What came back to a lidar, in one row: x, y, z, intensity, ring, time, instance, class, without gaps. Times are
    seconds after the stamp: 0 of what does not sweep, which measures all at once."""
    arrays = lidar.arrays()
    if not lidar.sweep:
        arrays["time"] = np.zeros_like(arrays["time"])
    hit = arrays["hit"] == 1
    columns = {axis: arrays["xyz"][:, index] for index, axis in enumerate("xyz")}
    columns |= {name: arrays[name] for name in ("intensity", "ring", "time", "instance", "class")}
    form = np.dtype([(name, values.dtype) for name, values in columns.items()])
    count = int(np.count_nonzero(hit))
    data = array("B", bytes(count * form.itemsize))
    records: NDArray[np.void] = np.frombuffer(data, dtype=form)
    for name, values in columns.items():
        records[name] = values[hit]
    fields = [
        PointField(name=name, offset=form.fields[name][1], datatype=_DATATYPES[values.dtype.str[1:]], count=1)
        for name, values in columns.items()
        if form.fields is not None
    ]
    return PointCloud2(
        header=of,
        height=1,
        width=count,
        fields=fields,
        is_bigendian=_BIG_ENDIAN,
        point_step=form.itemsize,
        row_step=count * form.itemsize,
        data=data,
        is_dense=bool(np.isfinite(arrays["xyz"][hit]).all()),
    )


def of_reading(frame: str, reading: Reading) -> list[tuple[str, Any]]:
    """Messages of a sensor without pictures, as the log has them: the last part of the topic, and the message. None of
    a reading that is not valid, and of kinds that have no message.

    Args:
        frame: that of the sensor.
    """
    messages = []
    for topic, kind, data in reading._messages(frame):
        package, name = kind.split("/msg/")
        messages.append((topic, deserialize_message(data, getattr(import_module(f"{package}.msg"), name))))
    return messages


def transform(nanoseconds: int, frame: str, world_from_sensor: NDArray[np.float64]) -> TransformStamped:
    """Where a sensor's frame is in ``world``.

    Args:
        world_from_sensor: (4, 4), from the axes of the sensor's outputs to the scene's coordinates.
    """
    ros_from_sensor = ROS_FROM_WORLD @ world_from_sensor[:3]
    x, y, z = (float(number) for number in ros_from_sensor[:, 3])
    message = TransformStamped(header=header(nanoseconds, WORLD), child_frame_id=frame)
    message.transform.translation = Vector3(x=x, y=y, z=z)
    x, y, z, w = quaternion(ros_from_sensor[:, :3])
    message.transform.rotation = Quaternion(x=x, y=y, z=z, w=w)
    return message


def quaternion(turn: NDArray[np.float64]) -> tuple[float, float, float, float]:
    """x, y, z, w of a rotation matrix (3, 3).

    The matrix 4·q·qᵀ follows from the matrix by sums and differences; the row of the largest of the four has the
    fewest roundings (Shepperd, *Journal of Guidance and Control* 1 (3), 1978).
    """
    r = turn
    products = np.array(
        [
            [1 + r[0, 0] - r[1, 1] - r[2, 2], r[0, 1] + r[1, 0], r[0, 2] + r[2, 0], r[2, 1] - r[1, 2]],
            [r[0, 1] + r[1, 0], 1 - r[0, 0] + r[1, 1] - r[2, 2], r[1, 2] + r[2, 1], r[0, 2] - r[2, 0]],
            [r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], 1 - r[0, 0] - r[1, 1] + r[2, 2], r[1, 0] - r[0, 1]],
            [r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], 1 + r[0, 0] + r[1, 1] + r[2, 2]],
        ]
    )
    row = products[int(np.argmax(np.diag(products)))]
    x, y, z, w = (float(number) for number in row / np.linalg.norm(row))
    return x, y, z, w


def _bytes(values: NDArray[Any]) -> array[int]:
    """An array's bytes as messages keep them: other forms of them would be copied twice."""
    data = array("B")
    data.frombytes(np.ascontiguousarray(values).reshape(-1).view(np.uint8).data)
    return data
