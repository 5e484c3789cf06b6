"""Vehicles that something outside moves."""

import math

import numpy as np
import pytest

import relief


def lead(sim, car, seconds, way, every=6):
    """Steps for so long, with a pose of the way every so many steps."""
    for step in range(round(seconds * 60)):
        if step % every == 0:
            car.move(**way(sim.seconds))
        sim.step()


def straight(seconds):
    return {"at": (40, 0, 10 + 8 * seconds), "velocity": (0, 0, 8)}


def circle(seconds):
    yaw = 0.4 * seconds
    at = (50 - 20 * math.cos(yaw), 0, 20 * math.sin(yaw))
    return {"at": at, "yaw": yaw, "velocity": (8 * math.sin(yaw), 0, 8 * math.cos(yaw)), "yaw_rate": 0.4}


def test_a_vehicle_follows_poses_from_outside(field):
    car = field.spawn_vehicle("car", at=(0, 0, 0))
    assert car.motion_source == "manual"
    lead(field, car, 1, straight)
    assert car.motion_source == "external" and not car.manual
    # Sums of steps; a position is of single floats, 2⁻²³ of 40 m.
    assert car.speed == pytest.approx(8, abs=1e-9) and car.rolled == pytest.approx(8, abs=1e-9)
    np.testing.assert_allclose(car.position, (40, 0, 10 + 8 * field.seconds), atol=1e-5)
    lead(field, car, 2, circle)
    assert car.yaw == pytest.approx(0.4 * field.seconds, abs=1e-9)
    assert car.steering == pytest.approx(math.atan(field.vehicle_type("car")["wheelbase"] / 20), abs=1e-5)
    car.release()
    assert car.motion_source == "manual"
    car.drive(brake=1)
    field.step(180)
    assert car.speed == 0


def test_a_pose_may_be_above_the_ground_and_tilted(field):
    car = field.spawn_vehicle("car", at=(0, 0, 0))
    car.move((1, 5, 2), yaw=0.3, pitch=0.1, stamp=field.seconds)
    field.step()
    np.testing.assert_allclose(car.position, (1, 5, 2), atol=1e-6)
    expected = field.spawn_mesh("box", at=(1, 5, 2), yaw=0.3, pitch=0.1).transform
    # Rotations of single floats: some 2⁻²³.
    np.testing.assert_allclose(car.transform, expected, atol=1e-6)


def test_what_drives_it_is_refused_and_its_lamps_are_not(road):
    car = road.spawn_vehicle("car", route="main", lane=1, along=50, name="ego")
    assert car.motion_source == "route"
    car.move((0, 0, 60))
    with pytest.raises(ValueError, match=r'"ego" is moved from outside; call release\(\) to drive it'):
        car.drive(throttle=1)
    car.drive(indicator="left", headlights="high")
    road.step(30)
    assert car.controls["indicator"] == "left"
    car.release()
    road.step(60)
    # It goes on among the traffic there.
    assert car.motion_source == "route" and 59 < car.along < 80


def test_values_and_stamps_are_checked(field):
    car = field.spawn_vehicle("car", at=(0, 0, 0))
    field.step(60)
    for given, message in [
        ({"yaw": 1e5}, "yaw: expected radians from -10000 to 10000, found 100000"),
        ({"yaw_rate": -200}, "yaw_rate: expected radians per second from -100 to 100, found -200"),
        ({"velocity": (0, 0, 600)}, "velocity: expected at most 555.6 m/s, found 600"),
        ({"stamp": 10}, r"stamp: expected seconds of the clock from -1.000 to 3.000, found 10"),
    ]:
        with pytest.raises(ValueError, match=message):
            car.move((0, 0, 0), **given)
    assert car.motion_source == "manual"
    car.move((0, 0, 0), stamp=0.5)
    with pytest.raises(ValueError, match="stamp: expected more than 0.5, the one before, found 0.25"):
        car.move((0, 0, 0), stamp=0.25)


def test_a_source_that_falls_silent_is_told_once(field):
    car = field.spawn_vehicle("car", at=(0, 0, 0), name="ego")
    car.move((0, 0, 0), velocity=(0, 0, 5))
    with pytest.warns(UserWarning, match="ego: no pose has come from outside for 2 s; it brakes to a standstill") as told:
        field.step(600)
    assert len(told) == 1 and car.speed == 0
    car.move((0, 0, 100), velocity=(0, 0, 5))
    with pytest.warns(UserWarning, match="ego: no pose"):
        relief.step([field], 130)


def test_recordings_and_snapshots_have_it(field, tmp_path):
    car = field.spawn_vehicle("car", at=(0, 0, 0))
    with field.record(tmp_path / "run.rec"):
        lead(field, car, 1, circle)
        saved, seconds = field.snapshot(), field.seconds
        lead(field, car, 1, circle)
        expected = field.hash()
    assert relief.replay(tmp_path / "run.rec").steps == field.steps
    field.restore(saved)
    assert field.seconds == seconds
    lead(field, car, 1, circle)
    assert field.hash() == expected


def test_the_old_name_of_manual_is_deprecated(field):
    with pytest.warns(DeprecationWarning, match="by_hand is deprecated; use manual"):
        car = field.spawn_vehicle("car", at=(0, 0, 0), by_hand=True)
    assert car.manual
    with pytest.warns(DeprecationWarning, match="use manual"):
        car.by_hand = False
    with pytest.warns(DeprecationWarning, match="use manual"):
        assert car.by_hand is False
    assert not car.manual
