"""A vehicle that follows a speed and a yaw rate, against the bicycle model."""

import math

import numpy as np
import pytest

from relief.velocity import VelocityController

CAR = VelocityController()


@pytest.mark.parametrize("speed", [6.0, -3.0])
@pytest.mark.parametrize("yaw_rate", [0.4, -0.25, 0.0])
def test_a_car_reaches_the_speed_and_the_yaw_rate(field, speed, yaw_rate):
    car = field.spawn_vehicle("car", at=(0, 0, 0), manual=True)
    # What is missing falls by 2/s once pedals are not at their ends, which takes 2 s: e^−16 in 8 s more.
    for _ in range(600):
        CAR.drive(car, speed, yaw_rate)
        field.step()
    assert car.speed == pytest.approx(speed, abs=1e-4)
    yaw = car.yaw
    field.step(30)
    turned = math.remainder(car.yaw - yaw, 2 * math.pi)
    # The wheelbase of the type is measured from its model: 2.53 m to 1e-6 of it; single precision of the angle.
    assert turned / 0.5 == pytest.approx(yaw_rate, rel=1e-3, abs=1e-6)


def test_numbers_of_a_type_are_its_own(field):
    car = VelocityController.of_type(field.vehicle_type("car"), gain=3)
    # The default has them rounded to three digits.
    for name in ("wheelbase", "steering_degrees", "acceleration", "braking"):
        assert getattr(car, name) == pytest.approx(getattr(CAR, name), rel=1e-3)
    assert car.gain == 3
    assert VelocityController.of_type(field.vehicle_type("truck")).wheelbase > 3


def test_a_car_stops_and_stays_and_turns_back(field):
    car = field.spawn_vehicle("car", at=(0, 0, 0), manual=True)
    car.drive(throttle=1.0, steer=0.5)
    field.step(60)
    assert car.speed > 2.0
    for _ in range(300):
        CAR.drive(car, 0.0, 1.0)
        field.step()
    assert (car.speed, car.steering) == (0.0, 0.0)
    assert CAR.controls(4.0, -1.0, 0.0) == (0.0, 1.0, 0.0)
    assert CAR.controls(0.0, -1.0, 0.0)[0] == pytest.approx(-2.0 / 3.2)


@pytest.mark.parametrize(
    "speed, wanted, throttle, brake",
    [
        # 2/s of what is missing, of 3.2 m/s² of throttle or 8.5 m/s² of brake.
        (1.0, 2.0, 2.0 / 3.2, 0.0),
        (2.0, 1.0, 0.0, 2.0 / 8.5),
        (-2.0, -1.0, 0.0, 2.0 / 8.5),
        # The other way: first to a stand, then on.
        (0.5, -0.5, 0.0, 2.0 / 8.5),
        (0.1, -0.5, -1.2 / 3.2, 0.0),
        # What stands is held.
        (0.0, 0.0, 0.0, 0.1),
        (1.7, 0.0, 0.0, 0.4),
    ],
)
def test_pedals_are_shares_of_what_is_missing(speed, wanted, throttle, brake):
    assert CAR.controls(speed, wanted, 0.0)[:2] == pytest.approx((throttle, brake), rel=1e-12)


def test_steering_is_a_part_of_what_tyres_hold():
    # A circle of 7 m/s² sideways is the whole of it, whatever the speed.
    assert CAR.controls(20.0, 20.0, 7.0 / 20.0)[2] == pytest.approx(1.0)
    assert CAR.controls(20.0, 20.0, -3.0)[2] == -1.0
    small = CAR.controls(20.0, 20.0, 0.07)[2]
    assert small == pytest.approx(math.atan(2.53 * 0.07 / 20.0) / math.atan(7.0 * 2.53 / 400.0))
    # Backward the wheels are turned the other way.
    assert CAR.controls(-2.0, -2.0, 0.2)[2] < 0.0


def test_what_is_no_number_is_refused():
    with pytest.raises(ValueError, match="wheelbase: expected a number above 0, found 0"):
        VelocityController(wheelbase=0)
    VelocityController(gain=np.float32(2.0))
    with pytest.raises(ValueError, match="gain: expected a number above 0, found 'much'"):
        VelocityController(gain="much")
    with pytest.raises(ValueError, match="steering_degrees: expected less than 90, found 400"):
        VelocityController(steering_degrees=400)
    with pytest.raises(ValueError, match="velocity: expected finite numbers"):
        CAR.controls(0.0, math.nan, 0.0)
