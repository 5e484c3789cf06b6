"""Boxes of a log, as rerun gets them of its messages, and what its command line refuses."""

import sys
import types

import numpy as np
import pytest

from conftest import needed
from relief import rerun
from relief.rerun import boxes_in_picture, boxes_in_space


def made(**fields):
    return types.SimpleNamespace(**fields)


COLOR = made(r=0.0, g=1.0, b=0.5, a=0.4)


def picture_message():
    corners = [made(x=x, y=y) for x, y in [(3.0, 4.0), (10.0, 4.0), (10.0, 9.0), (3.0, 9.0)]]
    return made(points=[made(points=corners, outline_color=COLOR)], texts=[made(text="car 37")])


def space_message():
    pose = made(position=made(x=1.0, y=2.0, z=0.7), orientation=made(x=0.0, y=0.0, z=1.0, w=0.0))
    cube = made(pose=pose, size=made(x=2.0, y=1.5, z=4.0), color=COLOR)
    entity = made(id="37", frame_id="world", metadata=[made(key="class", value="car")], cubes=[cube])
    return made(entities=[entity])


def test_a_picture_has_edges_names_and_colours():
    boxes = boxes_in_picture("/ego/front/boxes", 7, picture_message())
    assert boxes.frame == "ego/front_image_plane"
    np.testing.assert_array_equal(boxes.edges, [[3, 4, 10, 9]])
    np.testing.assert_array_equal(boxes.colors, [[0, 255, 128, 102]])
    assert boxes.labels == ["car 37"]


def test_space_has_places_sizes_and_turns():
    boxes = boxes_in_space("/ego/front/objects", 7, space_message())
    assert (boxes.frame, boxes.labels) == ("world", ["car 37"])
    np.testing.assert_array_equal(boxes.centers, [[1, 2, 0.7]])
    np.testing.assert_array_equal(boxes.sizes, [[2, 1.5, 4]])
    np.testing.assert_array_equal(boxes.quaternions, [[0, 0, 1, 0]])


def test_nothing_seen_is_no_box():
    assert boxes_in_picture("/eye/boxes", 7, made(points=[], texts=[])).edges.shape == (0, 4)
    assert boxes_in_space("/eye/objects", 7, made(entities=[])).centers.shape == (0, 3)


@pytest.fixture
def log(tmp_path, monkeypatch):
    """A log without boxes, and something in the place of rerun, which writes a file."""

    def save(path):
        try:
            open(path, "w").close()
        except OSError as error:
            raise RuntimeError(f"cannot create: {error}") from None

    stream = made(save=save, flush=lambda: None)
    monkeypatch.setitem(sys.modules, "rerun", made(RecordingStream=lambda name: stream))
    monkeypatch.setitem(sys.modules, "mcap_ros2", made())
    monkeypatch.setitem(sys.modules, "mcap_ros2.decoder", made())
    monkeypatch.setattr(rerun, "log", lambda recording, path: 0)
    monkeypatch.setattr(rerun, "boxes_of", lambda path: iter(open(path)))
    path = tmp_path / "sensors.mcap"
    path.write_text("a log")
    return path


def test_a_log_is_not_written_over(log, capsys):
    assert rerun.main([str(log), "-o", str(log.parent / "." / "sensors.mcap")]) == 2
    assert "sensors.mcap: expected another file than the log" in capsys.readouterr().err
    assert log.read_text() == "a log"
    assert rerun.main([str(log), "-o", str(log.parent / "run.rrd")]) == 0


@pytest.mark.parametrize(
    "error, said",
    [(ValueError("crc validation failed"), "crc validation failed"), (KeyError(7), "7"), (EOFError(), "truncated")],
)
def test_a_broken_log_is_one_line(log, capsys, monkeypatch, error, said):
    def boxes_of(path):
        raise error
        yield

    monkeypatch.setattr(rerun, "boxes_of", boxes_of)
    assert rerun.main([str(log), "-o", str(log.parent / "run.rrd")]) == 2
    assert capsys.readouterr().err == f"error: {log}: cannot be read: {said}\n"
    assert not (log.parent / "run.rrd").exists()


def test_files_that_are_not_there_are_named(log, capsys):
    assert rerun.main([str(log.parent / "no.mcap"), "-o", str(log.parent / "run.rrd")]) == 2
    assert capsys.readouterr().err == f"error: {log.parent / 'no.mcap'}: No such file or directory\n"
    assert rerun.main([str(log), "-o", str(log.parent / "no" / "run.rrd")]) == 2
    assert capsys.readouterr().err.startswith(f"error: {log.parent / 'no' / 'run.rrd'}: ")


def test_a_byte_that_has_changed_is_found(tmp_path):
    writer = needed("mcap.writer")
    needed("mcap_ros2")
    path = tmp_path / "sensors.mcap"
    with open(path, "wb") as file:
        log = writer.Writer(file, compression=writer.CompressionType.NONE)
        log.start("ros2")
        schema = log.register_schema("std_msgs/msg/String", "ros2msg", b"string data")
        channel = log.register_channel("/said", "cdr", schema)
        log.add_message(channel, 0, b"\0\1\0\0\6\0\0\0hello\0", 0)
        log.finish()
    assert list(rerun.boxes_of(path)) == []
    path.write_bytes(path.read_bytes().replace(b"hello", b"hallo"))
    with pytest.raises(ValueError, match="crc"):
        list(rerun.boxes_of(path))
