"""What to ask of a vehicle so that it goes at a speed and a yaw rate."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from numbers import Real
from typing import Any

from ._relief import Vehicle

_GRIP = 7.0
"""m/s² sideways, the most that steering gets under manual control (docs/simulation_traffic.md)."""
_STANDING = 0.2
"""m/s: slower than that, pedals for the other direction change it."""


@dataclass(frozen=True)
class VelocityController:
    """Pedals and steering from a speed and a yaw rate. The numbers are those of the vehicle's type; by default those of
    ``"car"``; `of_type` takes those of any.

    The speed: a = ``gain`` · (wanted − speed), as throttle a / ``acceleration`` or brake a / ``braking``. Without air
    drag (all vehicles that are not physical) nothing of the difference remains.

    The steering: the bicycle model with the rear axle as reference has dψ/dt = v·tan δ / L (Rajamani, *Vehicle Dynamics
    and Control*, 2.2). So δ = atan(L · yaw rate / wanted speed): the circle is the wanted one at every speed, the yaw
    rate once the speed is reached. Nothing turns where it stands: without a speed the wheels are straight.
    """

    wheelbase: float = 2.53
    """Metres from the rear axle to the front axle."""
    steering_degrees: float = 36.0
    """The largest steering angle."""
    acceleration: float = 3.2
    """m/s² of the whole throttle."""
    braking: float = 8.5
    """m/s² of the whole brake."""
    gain: float = 2.0
    """1/s: how much acceleration is asked for, for each m/s that is missing."""

    @classmethod
    def of_type(cls, limits: Mapping[str, Any], gain: float = 2.0) -> VelocityController:
        """That of vehicles of a type: ``VelocityController.of_type(sim.vehicle_type("truck"))``."""
        return cls(
            wheelbase=limits["wheelbase"],
            steering_degrees=math.degrees(limits["steering"]),
            acceleration=limits["acceleration"],
            braking=limits["braking"],
            gain=gain,
        )

    def __post_init__(self) -> None:
        for field in fields(self):
            number = getattr(self, field.name)
            if not (isinstance(number, Real) and math.isfinite(number) and float(number) > 0.0):
                raise ValueError(f"VelocityController: {field.name}: expected a number above 0, found {number!r}")
        if (angle := self.steering_degrees) >= 90.0:
            raise ValueError(f"VelocityController: steering_degrees: expected less than 90, found {angle}")

    def controls(self, speed: float, wanted: float, yaw_rate: float) -> tuple[float, float, float]:
        """What ``Vehicle.drive`` takes: throttle, brake and steer.

        Args:
            speed: of the vehicle, m/s, negative in reverse.
            wanted: speed, m/s.
            yaw_rate: rad/s about +Y, to the left positive.

        Raises:
            ValueError: a number that is not finite.
        """
        if not all(map(math.isfinite, (speed, wanted, yaw_rate))):
            raise ValueError(f"velocity: expected finite numbers, found {wanted} m/s, {yaw_rate} rad/s at {speed} m/s")
        throttle, brake = self._pedals(speed, wanted)
        return throttle, brake, self._steer(speed, wanted, yaw_rate)

    def drive(self, vehicle: Vehicle, wanted: float, yaw_rate: float) -> None:
        """Asks it of a vehicle, for the next step: call it before each."""
        throttle, brake, steer = self.controls(vehicle.speed, wanted, yaw_rate)
        vehicle.drive(throttle=throttle, brake=brake, steer=steer)

    def _pedals(self, speed: float, wanted: float) -> tuple[float, float]:
        if wanted == 0.0:
            # At least enough to hold it.
            return 0.0, max(0.1, min(self.gain * abs(speed) / self.braking, 1.0))
        if speed * wanted < 0.0 and abs(speed) > _STANDING:
            return 0.0, min(self.gain * abs(wanted - speed) / self.braking, 1.0)
        # Forward of what is wanted.
        missing = self.gain * (wanted - speed) * math.copysign(1.0, wanted)
        if missing >= 0.0:
            return math.copysign(min(missing / self.acceleration, 1.0), wanted), 0.0
        return 0.0, min(-missing / self.braking, 1.0)

    def _steer(self, speed: float, wanted: float, yaw_rate: float) -> float:
        if wanted == 0.0:
            return 0.0
        angle = math.atan(self.wheelbase * yaw_rate / wanted)
        held = math.atan(_GRIP * self.wheelbase / max(speed * speed, 0.01))
        return max(-1.0, min(angle / min(math.radians(self.steering_degrees), held), 1.0))
