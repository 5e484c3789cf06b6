"""The node that publishes what sensors measured, and drives vehicles by the velocities that come in."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from types import TracebackType
from typing import Any

import numpy as np
import rclpy
from geometry_msgs.msg import TransformStamped, Twist
from numpy.typing import NDArray
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import QoSProfile, qos_profile_sensor_data
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, Image, PointCloud2

from .._relief import CameraCapture, LidarCapture, Sim, Vehicle
from ..velocity import VelocityController
from . import messages

try:
    # Every installation of ROS has it; the package index has no wheel.
    from tf2_msgs.msg import TFMessage
except ImportError:
    TFMessage = None

_RELIABLE = QoSProfile(depth=10)
_LATEST = QoSProfile(depth=1)


class Bridge:
    """A node of ROS 2 for a world: sensors that are due become messages, velocities drive vehicles.

    >>> with Bridge(sim) as bridge:                                                                # doctest: +SKIP
    ...     bridge.step(60)

    Topics, frames and encodings are those of the log (docs/ros2.md). Time is the simulation's; nothing waits for
    anything. Velocities come in on ``/NAME/cmd_vel`` for each vehicle that is under manual control now. One counts
    until the next; before the first, the vehicle is left alone. Vehicles that come to be later need another bridge.

    Args:
        sim: the world.
        node: name of the node.
        controllers: by the names of vehicles, how each follows velocities. Others have those of their types.

    Raises:
        ValueError: a name that no vehicle under manual control has; two names that are one in ROS.
    """

    def __init__(
        self,
        sim: Sim,
        *,
        node: str = "relief",
        controllers: Mapping[str, VelocityController] | None = None,
    ) -> None:
        self.sim = sim
        driven = [vehicle for vehicle in sim.vehicles if vehicle.manual]
        topics = _distinct_topics([vehicle.name for vehicle in driven])
        vehicles = {vehicle.name: vehicle for vehicle in driven}
        controllers = controllers or {}
        for name in controllers:
            if name not in vehicles:
                raise ValueError(f'controllers: no vehicle "{name}" is under manual control, but {sorted(vehicles)}')
        self._frames: dict[str, str] = {messages.WORLD: ""}
        self._publishers: dict[str, Any] = {}
        self._placed: dict[str, tuple[int, NDArray[np.float64]]] = {}
        self._wanted: dict[str, tuple[float, float]] = {}
        self._driven = {
            name: (vehicle, controllers.get(name) or VelocityController.of_type(sim.vehicle_type(vehicle.type_)))
            for name, vehicle in vehicles.items()
        }

        # A context of its own: what else a program does with rclpy is not touched.
        self._context = Context()
        rclpy.init(context=self._context)
        self.node = rclpy.create_node(node, context=self._context)
        """The node of rclpy."""
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        for name, topic in topics.items():
            self.node.create_subscription(Twist, topic, self._receiver(name), _LATEST)
        self._publish_clock = self._publisher(Clock, "/clock", _RELIABLE)

    def step(self, n: int = 1) -> int:
        """Takes steps of the clock. Before each, velocities that came are taken in; after each, sensors that are due
        are captured and published, and the clock. Returns the number of the last step. Raises ValueError; RuntimeError
        once it is closed."""
        if n < 0:
            raise ValueError(f"n: expected at least 0 steps, found {n}")
        for _ in range(n):
            self.spin()
            for name, (wanted, yaw_rate) in self._wanted.items():
                vehicle, controller = self._driven[name]
                if vehicle.alive:
                    controller.drive(vehicle, wanted, yaw_rate)
            self.sim.step()
            self.publish()
        self.spin()
        return self.sim.steps

    def publish(self) -> None:
        """Publishes the clock and what sensors measured that are due now: for a world that something else steps, and
        for sensors that are due before the first step. Raises ValueError; RuntimeError once it is closed."""
        self._check_open()
        capture = self.sim.capture()
        stamp = capture.nanoseconds
        self._publish_clock(messages.clock(stamp))
        places = []
        for name, reading in capture.items():
            frame = self._frame(name)
            if isinstance(reading, LidarCapture) and reading.sweep and not self._has_told_begin(frame, reading):
                places.append(messages.transform(reading.nanoseconds, frame, reading.world_from_sensor_before))
                self._publisher(TransformStamped, f"/{frame}/transform", _RELIABLE)(places[-1])
            places.append(messages.transform(stamp, frame, reading.world_from_sensor))
            self._publisher(TransformStamped, f"/{frame}/transform", _RELIABLE)(places[-1])
            self._placed[frame] = (stamp, reading.world_from_sensor)
            self._publish_reading(frame, stamp, reading)
        if TFMessage is not None and places:
            self._publisher(TFMessage, "/tf", _RELIABLE)(TFMessage(transforms=places))

    def spin(self) -> None:
        """Takes in velocities that have come; does not wait for any. Raises RuntimeError once it is closed."""
        self._check_open()
        for _ in self._driven:
            self._executor.spin_once(timeout_sec=0.0)

    def close(self) -> None:
        """Ends the node. The world stays."""
        if self._context.ok():
            self._executor.shutdown()
            self.node.destroy_node()
            rclpy.shutdown(context=self._context)

    def __enter__(self) -> Bridge:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _check_open(self) -> None:
        if not self._context.ok():
            raise RuntimeError("the bridge is closed")

    def _has_told_begin(self, frame: str, scan: LidarCapture) -> bool:
        """Whether a capture tells where a scan began: not so at another time, or over a jump."""
        if len(scan) == 0:
            return True
        stamp, place = self._placed.get(frame, (-1, scan.world_from_sensor))
        # The place is the same but for a rounding of its turn.
        return stamp == scan.nanoseconds and bool(np.allclose(place, scan.world_from_sensor_before, rtol=0, atol=1e-6))

    def _publish_reading(self, frame: str, stamp: int, reading: Any) -> None:
        of = messages.header(stamp, frame)
        if isinstance(reading, CameraCapture):
            for output, (topic, encoding) in messages.IMAGES.items():
                if output in reading:
                    picture = messages.image(of, reading[output], encoding)
                    self._sensor(Image, f"/{frame}/{topic}", picture)
            if reading.K is not None:
                self._sensor(CameraInfo, f"/{frame}/camera_info", messages.camera_info(of, reading))
        elif isinstance(reading, LidarCapture):
            # Of the time of its first column; what does not sweep measures all at the capture.
            of = messages.header(reading.nanoseconds if reading.sweep else stamp, frame)
            self._sensor(PointCloud2, f"/{frame}/points", messages.points(of, reading))
        else:
            for topic, message in messages.of_reading(frame, reading):
                self._sensor(type(message), f"/{frame}/{topic}", message)

    def _sensor(self, kind: type[Any], topic: str, message: Any) -> None:
        self._publisher(kind, topic, qos_profile_sensor_data)(message)

    def _publisher(self, kind: type[Any], topic: str, quality: QoSProfile) -> Callable[[Any], None]:
        """What publishes on a topic, which is made when it is first needed."""
        if topic not in self._publishers:
            self._publishers[topic] = self.node.create_publisher(kind, topic, quality)
        publish: Callable[[Any], None] = self._publishers[topic].publish
        return publish

    def _frame(self, name: str) -> str:
        """The frame of a sensor, which no other has."""
        frame = messages.frame_name(name)
        other = self._frames.setdefault(frame, name)
        if other != name:
            whose = f'sensor "{other}"' if other else "the world"
            raise ValueError(f'sensor "{name}": its name in ROS, "{frame}", is that of {whose} already')
        return frame

    def _receiver(self, name: str) -> Callable[[Twist], None]:
        def receive(velocity: Twist) -> None:
            wanted = (velocity.linear.x, velocity.angular.z)
            if all(map(math.isfinite, wanted)):
                self._wanted[name] = wanted
            else:
                self.node.get_logger().warning(f"velocity of {name}: expected finite numbers, found {wanted}; left out")

        return receive


def _distinct_topics(names: Sequence[str]) -> dict[str, str]:
    """The topic on which each vehicle's velocities come in."""
    topics: dict[str, str] = {}
    for name in names:
        topic = f"/{messages.frame_name(name)}/cmd_vel"
        for other, taken in topics.items():
            if taken == topic:
                raise ValueError(f'vehicle "{name}": its topic, {topic}, is that of vehicle "{other}" already')
        topics[name] = topic
    return topics
