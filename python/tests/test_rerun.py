"""Boxes of a log, as rerun gets them of its messages."""

import types

import numpy as np

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
