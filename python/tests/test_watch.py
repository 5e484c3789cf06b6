"""Sensors measure since they were due before: where that was not captured, it is said."""

import warnings

import numpy as np
import pytest

import relief


def told(act):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        act()
    return [str(warning.message) for warning in caught if warning.category is UserWarning]


def test_captures_that_were_left_out_are_told_once_for_each_sensor():
    sim = relief.Sim()
    ego = sim.spawn_vehicle("car", at=(0, 0, 0), name="ego", manual=True)
    ego.add_imu("unit")
    ego.add_lidar("top")
    ego.add_lidar("whole", every=6)
    ego.add_camera("eye", size=(8, 6), outputs=("depth",))
    sim.step(6)
    found = told(sim.capture)
    assert len(found) == 2, found
    assert 'sensor "ego/unit" was not captured after step 5' in found[0] and "not valid" in found[0]
    assert "every=6" in found[0] and 'sensor "ego/top"' in found[1]
    sim.step(6)
    assert told(sim.capture) == []


def test_captures_and_looks_of_others_note_where_sensors_are():
    sim = relief.Sim(geo_origin={"latitude_degrees": 48.1, "longitude_degrees": 11.6})
    ego = sim.spawn_vehicle("car", at=(0, 0, 0), name="ego", manual=True)
    ego.add_imu("unit")
    ego.add_gnss("fix")
    ego.add_lidar("part")
    ego.add_lidar("swept", hz=60, sweep=True, columns=90)
    ego.add_camera("eye", size=(8, 6), outputs=("depth",))
    ego.drive(throttle=1.0)

    def drive():
        for act in (sim.capture, sim.look):
            sim.step()
            act("eye")
        for act in (relief.capture, relief.look):
            sim.step()
            act([sim], "eye")
        sim.step()
        return sim.capture()

    found = []
    got = [told(lambda: found.append(drive()))]
    assert len(got[0]) == 1 and '"ego/part"' in got[0][0] and "one interval" in got[0][0], got
    assert found[0]["unit"].valid and found[0]["fix"].has_velocity

    sim.step(6)
    got = told(lambda: found.append(sim.capture()))
    assert len(got) == 3 and "not valid" in got[0] and "no velocity" in got[1] and "one place" in got[2], got
    assert not found[1]["unit"].valid and not found[1]["fix"].has_velocity


def test_a_loop_that_captures_every_step_is_told_nothing_wherever_it_begins():
    sim = relief.Sim()
    ego = sim.spawn_vehicle("car", at=(0, 0, 0), name="ego", manual=True)
    ego.add_imu("unit")

    def drive():
        for _ in range(3):
            sim.step()
            sim.capture()

    assert told(drive) == []
    state = sim.snapshot()
    ego.add_lidar("late", sweep=True)
    assert told(drive) == []
    sim.step(20)
    sim.restore(state)
    assert told(drive) == []
    sim.reset()
    sim.step(9)
    assert told(lambda: relief.capture_due([sim.fork()])) == []


def test_capture_takes_what_is_due_and_look_takes_any():
    sims = [relief.Sim() for _ in range(2)]
    for sim in sims:
        sim.add_camera("eye", size=(8, 6), outputs=("depth",), every=6)
    relief.step(sims, 6)
    due = relief.capture(sims, "eye")
    np.testing.assert_array_equal(due.depth, relief.look(sims, "eye").depth)
    relief.step(sims, 1)
    assert relief.look(sims, "eye").steps == [7, 7]
    assert list(sims[0].capture()) == []
    with pytest.raises(ValueError, match='world 0: "eye" is not due after step 7; relief.look takes it all the same'):
        relief.capture(sims, "eye")


def test_a_scan_has_the_places_of_its_first_column_and_of_its_end():
    sim = relief.Sim()
    ego = sim.spawn_vehicle("car", at=(0, 0, 0), name="ego", manual=True)
    ego.add_lidar("swept", every=6, sweep=True, columns=90)
    ego.add_lidar("still", every=6, columns=90)
    ego.drive(throttle=1.0)
    before = sim.capture()["swept"].world_from_sensor
    sim.step(6)
    got = sim.capture()
    swept, still = got["swept"], got["still"]
    assert (swept.nanoseconds, still.nanoseconds, swept.sweep, still.sweep) == (0, 0, True, False)
    # Turns are interpolated, which rounds.
    np.testing.assert_allclose(swept.world_from_sensor_before, before, rtol=0, atol=1e-12)
    assert np.abs(swept.world_from_sensor - before).max() > 1e-3
    np.testing.assert_allclose(still.world_from_sensor_before, still.world_from_sensor, rtol=0, atol=1e-12)
    sim.step(6)
    assert sim.capture()["swept"].nanoseconds == got.nanoseconds
