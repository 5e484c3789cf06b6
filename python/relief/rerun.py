"""A log of sensors in rerun, with its boxes: ``python -m relief.rerun sensors.mcap -o run.rrd``.

rerun reads the log by itself, but has no message of boxes. They are read here, and logged beside what it reads: at the
same entities and times, those of a camera's picture on the picture, those in space in the world.

This needs rerun and what decodes messages: ``pip install '.[rerun]'`` in a checkout.
"""

from __future__ import annotations

import argparse
import dataclasses
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

#: Messages of boxes in a picture and in space, as docs/sensors.md tells.
IN_PICTURE, IN_SPACE = "foxglove_msgs/msg/ImageAnnotations", "foxglove_msgs/msg/SceneUpdate"


@dataclasses.dataclass(frozen=True)
class PictureBoxes:
    """Boxes around what a camera sees of things.

    ``topic``: of the message. ``nanoseconds``: of the simulation. ``edges``: float64 (N, 4), left, top, right, bottom
    in pixels from the picture's corner. ``labels``: class and id of each. ``colors``: uint8 (N, 4), RGBA in sRGB.
    """

    topic: str
    nanoseconds: int
    edges: np.ndarray
    labels: list[str]
    colors: np.ndarray

    @property
    def frame(self) -> str:
        """What rerun calls the plane of the camera's picture."""
        return f"{self.topic.removeprefix('/').removesuffix('/boxes')}_image_plane"


@dataclasses.dataclass(frozen=True)
class SpaceBoxes:
    """Boxes of things in space.

    ``frame``: what they are in, the world with Z up. ``centers``, ``sizes``: float64 (N, 3), metres; sizes along their
    own axes. ``quaternions``: float64 (N, 4), x, y, z, w, from their axes to the frame's. ``labels``, ``colors``: as
    those of `PictureBoxes`.
    """

    topic: str
    nanoseconds: int
    frame: str
    centers: np.ndarray
    sizes: np.ndarray
    quaternions: np.ndarray
    labels: list[str]
    colors: np.ndarray


def _rows(rows: list[list[float]], width: int) -> np.ndarray:
    return np.array(rows, np.float64).reshape(-1, width)


def _bytes(colors: list[Any]) -> np.ndarray:
    rows = _rows([[color.r, color.g, color.b, color.a] for color in colors], 4)
    return np.rint(255.0 * rows).astype(np.uint8)


def boxes_in_picture(topic: str, nanoseconds: int, message: Any) -> PictureBoxes:
    """Of a decoded ``foxglove_msgs/ImageAnnotations``, whose boxes are loops of lines."""
    edges = []
    for loop in message.points:
        across, down = [point.x for point in loop.points], [point.y for point in loop.points]
        edges.append([min(across), min(down), max(across), max(down)])
    labels = [text.text for text in message.texts]
    colors = _bytes([loop.outline_color for loop in message.points])
    return PictureBoxes(topic, nanoseconds, _rows(edges, 4), labels, colors)


def boxes_in_space(topic: str, nanoseconds: int, message: Any) -> SpaceBoxes:
    """Of a decoded ``foxglove_msgs/SceneUpdate``, each entity of which has one cube."""
    cubes = [entity.cubes[0] for entity in message.entities]
    at, turned = [cube.pose.position for cube in cubes], [cube.pose.orientation for cube in cubes]
    labels = []
    for entity in message.entities:
        known = {pair.key: pair.value for pair in entity.metadata}
        labels.append(f"{known.get('class', 'unlabeled')} {entity.id}")
    return SpaceBoxes(
        topic,
        nanoseconds,
        frame=message.entities[0].frame_id if message.entities else "world",
        centers=_rows([[place.x, place.y, place.z] for place in at], 3),
        sizes=_rows([[cube.size.x, cube.size.y, cube.size.z] for cube in cubes], 3),
        quaternions=_rows([[turn.x, turn.y, turn.z, turn.w] for turn in turned], 4),
        labels=labels,
        colors=_bytes([cube.color for cube in cubes]),
    )


def boxes_of(path: Path | str) -> Iterator[PictureBoxes | SpaceBoxes]:
    """All boxes of a log, in its order. Raises OSError; of a log that is broken, what its decoders raise."""
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    with open(path, "rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for schema, channel, message, decoded in reader.iter_decoded_messages():
            if schema is not None and schema.name == IN_PICTURE:
                yield boxes_in_picture(channel.topic, message.log_time, decoded)
            elif schema is not None and schema.name == IN_SPACE:
                yield boxes_in_space(channel.topic, message.log_time, decoded)


def log(recording: Any, path: Path | str) -> int:
    """Logs a log of sensors and its boxes to a ``rerun.RecordingStream``. Returns how many captures have boxes. Raises
    what `boxes_of` raises."""
    import rerun

    recording.log_file_from_path(path)
    captures, cameras = 0, dict[str, None]()
    for boxes in boxes_of(path):
        captures += 1
        cameras[boxes.topic.rpartition("/")[0]] = None
        # Those that rerun has for the messages themselves.
        for timeline in ("message_log_time", "message_publish_time", "ros2_timestamp"):
            recording.set_time(timeline, timestamp=np.datetime64(boxes.nanoseconds, "ns"))
        drawn: Any
        if isinstance(boxes, PictureBoxes):
            drawn = rerun.Boxes2D(
                array=boxes.edges, array_format=rerun.Box2DFormat.XYXY, labels=boxes.labels, colors=boxes.colors
            )
        else:
            drawn = rerun.Boxes3D(
                centers=boxes.centers,
                sizes=boxes.sizes,
                quaternions=boxes.quaternions,
                labels=boxes.labels,
                colors=boxes.colors,
                show_labels=False,
            )
        recording.log(boxes.topic, rerun.CoordinateFrame(boxes.frame), drawn)
    recording.send_blueprint(_views(list(cameras)))
    return captures


def _views(cameras: list[str]) -> Any:
    """A view of the world, beside one of each camera's picture with its boxes."""
    from rerun import blueprint

    left_out = [f"- {camera}/{image}" for camera in cameras for image in ("class", "instance")]
    world = blueprint.Spatial3DView(name="world", contents=["/**", *left_out])
    pictures = [
        blueprint.Spatial2DView(
            name=camera, origin=f"{camera}/image_raw", contents=[f"{camera}/image_raw", f"{camera}/boxes"]
        )
        for camera in cameras
    ]
    return blueprint.Blueprint(blueprint.Horizontal(world, blueprint.Grid(*pictures)), collapse_panels=True)


def main(arguments: list[str] | None = None) -> int:
    """The command line. Returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m relief.rerun", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("log", help="sensors.mcap of relief render --format mcap")
    parser.add_argument("-o", "--output", help="file for rerun, such as run.rrd [default: opens rerun's window]")
    args = parser.parse_args(arguments)
    try:
        import mcap_ros2.decoder  # noqa: F401
        import rerun
    except ImportError as error:
        return _refused(f"{error}; expected pip install '.[rerun]' in a checkout of relief")
    try:
        # Read through first: nothing half-written is left of a log that is broken.
        for _ in boxes_of(args.log):
            pass
    except OSError as error:
        return _refused(f"{args.log}: {error.strerror}")
    except Exception as error:
        # Of a broken log, decoders raise anything; where it ends too early there are no words.
        return _refused(f"{args.log}: cannot be read: {str(error) or 'truncated'}")
    if args.output is not None and Path(args.output).exists() and Path(args.output).samefile(args.log):
        return _refused(f"{args.output}: expected another file than the log")
    recording = rerun.RecordingStream("relief")
    try:
        if args.output is None:
            recording.spawn()
        else:
            recording.save(args.output)
    except RuntimeError as error:
        return _refused(f"{args.output or 'window'}: {error}")
    captures = log(recording, args.log)
    recording.flush()
    print(f"{args.output or args.log}: boxes of {captures} captures")
    return 0


def _refused(message: str) -> int:
    print(f"error: {message}", file=sys.stderr)
    return 2


if __name__ == "__main__":
    sys.exit(main())
