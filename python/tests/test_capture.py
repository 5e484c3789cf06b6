"""Captures: arrays with their shapes, types and memory, known answers, and several worlds together."""

import numpy as np
import pytest

import relief

OUTPUTS = ("color", "linear", "depth", "range", "normal", "instance", "part", "class", "panoptic", "boxes", "flow",
           "flow_back")


def test_every_output_has_its_shape_and_type(field):
    car = field.spawn_vehicle("car", at=(0, 0, 0), manual=True, name="ego")
    field.spawn_vehicle("van", at=(0, 0, 15), name="ahead")
    car.add_camera("front", size=(40, 30), at=(0, 1.5, 2.2), outputs=OUTPUTS)
    field.capture()
    field.step()
    capture = field.capture()
    front = capture["front"]
    assert capture.keys() == ["ego/front"] and "front" in capture and len(capture) == 1 and list(capture) == ["ego/front"]
    assert front.name == "ego/front" and front.step == 1 and capture.step == 1 and front.size == (40, 30)
    assert front.seconds == pytest.approx(field.step_seconds)
    wanted = {
        "color": ((30, 40, 3), np.uint8), "linear": ((30, 40, 3), np.float16), "depth": ((30, 40), np.float32),
        "range": ((30, 40), np.float32), "normal": ((30, 40, 3), np.float32), "instance": ((30, 40), np.uint32),
        "part": ((30, 40), np.uint32), "class": ((30, 40), np.uint8), "panoptic": ((30, 40), np.uint32),
        "flow": ((30, 40, 2), np.float32), "flow_flags": ((30, 40), np.uint8),
        "flow_back": ((30, 40, 2), np.float32), "flow_back_flags": ((30, 40), np.uint8),
    }
    assert set(front.keys()) == set(wanted) | {"boxes"}
    for name, (shape, dtype) in wanted.items():
        array = front[name]
        assert array.shape == shape and array.dtype == dtype, name
        assert array.flags.c_contiguous and array.flags.writeable, name
    assert front.color is front.color
    np.testing.assert_array_equal(front.cls, front["class"])
    ids = np.unique(front.instance)
    assert field["ahead"].id in ids
    boxes = front.boxes
    assert boxes["id"].tolist() == [field["ahead"].id] and boxes["visible"][0] > 0.9
    assert (front.cls[front.instance == field["ahead"].id] == field.classes["car"]).all()


def test_a_plane_at_a_known_distance(field):
    # The face of a box of 4 m that is turned to the camera, 10 m away; K and depth give its points back.
    field.spawn_mesh("box", at=(0, 2, 12), scale=(4, 4, 4))
    field.add_camera("camera", size=(64, 48), K=(60, 60, 31.5, 23.5), at=(0, 2, 0), outputs=("depth", "instance"))
    camera = field.capture()["camera"]
    np.testing.assert_array_equal(camera.K, [[60, 0, 31.5], [0, 60, 23.5], [0, 0, 1]])
    seen = camera.instance == field.entities[-2].id
    np.testing.assert_allclose(camera.depth[seen], 10, rtol=1e-5)
    # 4 m at 10 m with f = 60 are 24 pixels.
    assert seen.sum() == 24 * 24
    v, u = np.nonzero(seen)
    points = np.linalg.inv(camera.K) @ np.stack([u, v, np.ones_like(u)]) * camera.depth[seen]
    points = camera.world_from_sensor @ np.vstack([points, np.ones(points.shape[1])])
    np.testing.assert_allclose(points[2], 10, atol=2e-4)
    assert points[0].min() >= -2 - 1e-3 and points[0].max() <= 2 + 1e-3
    assert points[1].min() >= -1e-3 and points[1].max() <= 4 + 1e-3
    # Left in the picture is +X, where the camera looks along +Z.
    assert points[0][np.argmin(u)] > 1.5


def test_arrays_own_their_memory(field):
    field.add_camera("camera", size=(16, 16), at=(0, 2, 0), outputs=("color", "depth"))
    first = field.capture()["camera"]
    kept, before = first.color, first.color.copy()
    del first
    field["sun"].intensity = 0
    second = field.capture()["camera"].color
    assert not np.shares_memory(kept, second)
    np.testing.assert_array_equal(kept, before)
    assert (second != before).any()
    shared = np.from_dlpack(kept)
    assert np.shares_memory(shared, kept)


def test_sensors_are_due_in_their_phases(field):
    field.add_camera("slow", size=(8, 8), every=3, phase=1, outputs=("depth",))
    field.add_camera("fast", size=(8, 8), outputs=("depth",))
    found = []
    for _ in range(6):
        found.append("slow" in field.capture())
        field.step()
    assert found == [False, True, False, False, True, False]
    assert field.steps == 6 and "slow" not in field.capture() and "slow" in field.look("slow")
    assert field.capture("fast").keys() == ["fast"]


def test_a_lidar_meets_the_ground(field):
    car = field.spawn_vehicle("car", at=(0, 0, 0))
    lidar = car.add_lidar("top", beams="vlp16", at=(0, 2.5, 0), columns=360, range=(2.0, 100.0))
    assert lidar.kind == "lidar"
    field.step()
    top = field.capture()["top"]
    assert top.xyz.shape == (len(top), 3) and top.xyz.dtype == np.float32 and top.ring.dtype == np.uint16
    assert len(top) == 16 * 60
    hit = top.hit == 1
    ground = hit & (top.cls == field.classes["terrain"])
    assert ground.sum() > 100
    # Z is up in the sensor's axes.
    np.testing.assert_allclose(top.xyz[ground, 2], -2.5, atol=1e-3)
    # Its beams begin up to 12 mm above and below its origin.
    np.testing.assert_allclose(np.linalg.norm(top.xyz[hit], axis=1), top.range[hit], atol=0.012)


def test_other_sensors(road):
    car = road.spawn_vehicle("car", route="main", along=200, lane=0, speed=8, name="ego")
    other = road.spawn_vehicle("van", at=(40, 0, 0), name="van")
    inside = road.spawn_vehicle("car", at=(40, 0, 0.5), name="inside")
    car.add_lane("lane")
    car.add_imu("imu")
    other.add_collision("bumper")
    road.step(3)
    for _ in range(3):
        road.step()
        capture = road.capture()
    lane = capture["lane"]
    assert lane.valid and lane.lane == 0 and abs(lane.offset) < 0.3 and lane.speed > 5
    imu = capture["imu"]
    assert imu.valid and imu.specific_force[2] == pytest.approx(9.81, abs=0.3)
    contacts = capture["bumper"]
    assert len(contacts) == 1 and contacts[0].instance == inside.id and contacts[-1].depth > 0
    assert contacts[0].class_ == "car"
    with pytest.raises(IndexError):
        contacts[1]


def test_pictures_of_several_worlds_are_those_of_each_alone(road):
    ego = road.spawn_vehicle("car", route="main", along=40, lane=0, manual=True, name="ego")
    ego.add_camera("front", size=(48, 32), at=(0, 1.5, 2.2), outputs=("color", "depth", "instance", "boxes"))
    worlds = [road.fork() for _ in range(3)]
    for i, world in enumerate(worlds):
        world["ego"].drive(throttle=0.3 * i, steer=0.2 * i)
    for _ in range(2):
        relief.step(worlds, 20)
        together = relief.capture(worlds, "front")
        assert len(together) == 3 and together.steps == [w.steps for w in worlds]
        assert together.color.shape == (3, 32, 48, 3) and together.depth.shape == (3, 32, 48)
        for i, world in enumerate(worlds):
            alone = world.fork().capture()["front"]
            for name in ("color", "depth", "instance"):
                np.testing.assert_array_equal(together[name][i], alone[name], err_msg=name)
            for field in ("id", "box_visible", "box_full", "visible", "pixels"):
                np.testing.assert_array_equal(together.boxes[i][field], alone.boxes[field], err_msg=field)
        assert (together.color[0] != together.color[2]).any()
    with pytest.raises(KeyError, match='world 0: expected one sensor "back", found 0'):
        relief.capture(worlds, "back")
    with pytest.raises(KeyError, match="world 1"):
        relief.capture([worlds[0], road.fresh()], "front")


def test_columns_of_several_worlds_are_what_each_measures(road):
    ego = road.spawn_vehicle("car", route="main", along=90, lane=0, manual=True, name="ego")
    ego.add_camera("front", size=(12, 8), at=(0, 1.5, 2.2), outputs=("color", "depth"))
    ego.add_lane("lane", at=(0, 0, 0))
    ego.add_collision("touch", at=(0, 0, 0))
    ego.add_lidar("top", at=(0, 2, 0), columns=4)
    worlds = [road.fork() for _ in range(3)]
    # The last one has two others in it, the one before none.
    for i, along in ((0, 93), (2, 92), (2, 89)):
        worlds[i].spawn_vehicle("car", route="main", along=along, lane=0)
    front, lane, touch = relief.capture_columns(worlds, ["ego/front", "ego/lane", "ego/touch"])
    each = relief.capture_due([world.fork() for world in worlds])
    for i, own in enumerate(each):
        np.testing.assert_array_equal(front.color[i], own["front"].color)
        np.testing.assert_array_equal(front.depth[i], own["front"].depth)
        for name, column in lane.items():
            assert column[i] == (i if name == "world" else getattr(own["lane"], name)), name
        contacts = [(contact.instance, contact.depth, contact.normal) for contact in own["touch"]]
        mine = touch["world"] == i
        rows = zip(touch["instance"][mine], touch["depth"][mine], map(tuple, touch["normal"][mine]))
        assert list(rows) == contacts, i
    assert [len(own["touch"]) for own in each] == [1, 0, 2]
    with pytest.raises(KeyError, match='world 0: no sensor "lane" was captured; it is not due, or there is none'):
        relief.capture_columns(worlds, "lane")
    with pytest.raises(ValueError, match='expected "ego/top" to be a camera or .* found a lidar'):
        relief.capture_columns(worlds, "ego/top")
    with pytest.raises(ValueError, match="sims: expected at least one"):
        relief.capture_columns([], "ego/lane")


def test_a_picture_after_a_restore_is_that_of_the_state(road):
    ego = road.spawn_vehicle("car", route="main", along=40, lane=0, name="ego")
    ego.add_camera("front", size=(32, 24), at=(0, 1.5, 2.2), outputs=("color", "depth"))
    road.step(10)
    shot, before = road.snapshot(), road.capture()["front"]
    road.step(60)
    assert (road.capture()["front"].depth != before.depth).any()
    road.restore(shot)
    after = road.capture()["front"]
    np.testing.assert_array_equal(before.color, after.color)
    np.testing.assert_array_equal(before.depth, after.depth)


def test_the_adapter_is_named():
    assert "(" in relief.adapter()


def test_a_world_that_was_closed_opens_again(field):
    field.add_camera("camera", size=(8, 8), at=(0, 1, 0))
    with field:
        first = field.capture()["camera"].color
    np.testing.assert_array_equal(field.capture()["camera"].color, first)
