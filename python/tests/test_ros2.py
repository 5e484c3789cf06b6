"""The bridge to ROS 2 on loopback: what a second node receives, against captures of a world in the same state."""

import os
import sys
import time
from types import SimpleNamespace

import numpy as np
import pytest

import relief
from conftest import ROOT

# Not `conftest.needed`: the packages are 250 MB, and CI does not have them, in strict mode either.
rclpy = pytest.importorskip("rclpy", reason="no rclpy: too large for CI")
os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
# Runs beside each other do not hear each other. Every system has ports for the domains 0 to 101.
os.environ["ROS_DOMAIN_ID"] = str(os.getpid() % 102)

from geometry_msgs.msg import TransformStamped, Twist  # noqa: E402
from rclpy.qos import qos_profile_sensor_data  # noqa: E402
from rosgraph_msgs.msg import Clock  # noqa: E402
from sensor_msgs.msg import CameraInfo, Image, Imu, PointCloud2  # noqa: E402

from relief.ros2 import Bridge, messages  # noqa: E402
from relief.velocity import VelocityController  # noqa: E402

IMU = "/ego/imu/imu"
DISTORTION = (-0.1, 0.01, 0.001, -0.002, 0.003)
TYPES = {
    "/clock": Clock,
    "/ego/front/camera_info": CameraInfo,
    "/ego/front/class": Image,
    "/ego/front/depth": Image,
    "/ego/front/image_raw": Image,
    "/ego/front/instance": Image,
    "/ego/front/transform": TransformStamped,
    IMU: Imu,
    "/ego/top/points": PointCloud2,
}


class Peer:
    """Another node, which keeps what it receives."""

    def __init__(self):
        self.context = rclpy.Context()
        rclpy.init(context=self.context)
        self.node = rclpy.create_node("peer", context=self.context)
        self.executor = rclpy.executors.SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)
        self.got = {topic: [] for topic in TYPES}
        for topic, kind in TYPES.items():
            self.node.create_subscription(kind, topic, self.got[topic].append, qos_profile_sensor_data)

    def until(self, condition, meanwhile=lambda: None):
        """Receives until something is so. The bound is for a test that fails."""
        end = time.monotonic() + 60
        while not condition():
            assert time.monotonic() < end, {topic: len(got) for topic, got in self.got.items()}
            meanwhile()
            self.executor.spin_once(timeout_sec=0.05)
            # One call takes one message. The queues hold five of each topic.
            for _ in range(5 * len(TYPES)):
                self.executor.spin_once(timeout_sec=0.0)

    def by_time(self, topic):
        """What came on a topic, by its stamp."""
        stamp = lambda message: message.clock if topic == "/clock" else message.header.stamp
        return {nanoseconds(stamp(message)): message for message in self.got[topic]}

    def complete(self):
        """Stamps with which something came on every topic; an IMU's are of earlier times."""
        return bool(self.got[IMU]) and set.intersection(*(set(self.by_time(topic)) for topic in TYPES if topic != IMU))

    def close(self):
        self.executor.shutdown()
        self.node.destroy_node()
        rclpy.shutdown(context=self.context)


@pytest.fixture
def peer(tmp_path, monkeypatch):
    monkeypatch.setenv("ROS_LOG_DIR", str(tmp_path))
    peer = Peer()
    yield peer
    peer.close()


@pytest.fixture
def world():
    """A car with sensors before a van."""
    sim = relief.Sim()
    ego = sim.spawn_vehicle("car", at=(0, 0, 0), name="ego", manual=True)
    sim.spawn_vehicle("van", at=(0.5, 0, 12), name="van")
    k = (30.0, 31.0, 23.5, 15.0)
    outputs = ("color", "depth", "class", "instance", "range")
    ego.add_camera("front", size=(48, 32), K=k, distortion=DISTORTION, at=(0, 1.4, 1.8), outputs=outputs, every=6)
    ego.add_lidar("top", beams="vlp16", at=(0.1, 1.9, 0.2), every=6)
    ego.add_imu("imu", every=6)
    return sim


def pixels(message, dtype, *channels):
    shape = (message.height, message.width, *channels)
    assert message.step * message.height == len(message.data)
    assert message.is_bigendian == (sys.byteorder == "big")
    return np.frombuffer(message.data, dtype).reshape(shape)


def nanoseconds(stamp):
    return stamp.sec * 1_000_000_000 + stamp.nanosec


def test_every_array_is_that_of_the_capture(world, peer):
    world["ego"].drive(throttle=0.1, steer=0.5)
    alone = world.fork()
    with Bridge(world) as bridge:
        # Best effort reaches those that are known when something is published, and may lose it: steps go on until all
        # of one time has come through.
        peer.until(peer.complete, lambda: bridge.step(6))
    captures = {}
    while alone.steps < world.steps:
        alone.step(6)
        capture = alone.capture()
        captures[capture.nanoseconds] = capture
    stamp = max(peer.complete())
    capture = captures[stamp]
    got = {topic: peer.by_time(topic)[stamp] for topic in TYPES if topic != IMU}

    front, of = capture["ego/front"], "/ego/front/"
    assert [got[of + name].encoding for name in ("image_raw", "depth", "class", "instance")] == [
        "rgb8",
        "32FC1",
        "mono8",
        "32SC1",
    ]
    np.testing.assert_array_equal(pixels(got[of + "image_raw"], np.uint8, 3), front.color)
    np.testing.assert_array_equal(pixels(got[of + "depth"], np.float32), front.depth)
    np.testing.assert_array_equal(pixels(got[of + "class"], np.uint8), front.cls)
    np.testing.assert_array_equal(pixels(got[of + "instance"], np.int32).view(np.uint32), front.instance)
    assert len(np.unique(front.instance)) > 1 and len(np.unique(front.depth)) > 10
    info = got[of + "camera_info"]
    assert (info.width, info.height, info.distortion_model, tuple(info.d)) == (48, 32, "plumb_bob", DISTORTION)
    np.testing.assert_array_equal(info.k.reshape(3, 3), front.K)
    np.testing.assert_array_equal(info.r.reshape(3, 3), np.eye(3))
    np.testing.assert_array_equal(info.p.reshape(3, 4), np.hstack([front.K, np.zeros((3, 1))]))

    top, cloud = capture["ego/top"], got["/ego/top/points"]
    assert [field.name for field in cloud.fields] == ["x", "y", "z", "intensity", "ring", "time", "instance", "class"]
    # Datatypes of sensor_msgs/PointField: 7 float32, 4 uint16, 6 uint32, 2 uint8.
    assert [(field.offset, field.datatype) for field in cloud.fields] == [
        (0, 7), (4, 7), (8, 7), (12, 7), (16, 4), (18, 7), (22, 6), (26, 2)
    ]  # fmt: skip
    form = [("xyz", "f4", 3), ("intensity", "f4"), ("ring", "u2"), ("time", "f4"), ("instance", "u4"), ("class", "u1")]
    points, hit = np.frombuffer(cloud.data, form), top.hit == 1
    assert 0 < len(points) < len(hit) and (cloud.width, cloud.height, cloud.point_step) == (len(points), 1, 27)
    assert (cloud.row_step, cloud.is_dense, cloud.is_bigendian) == (27 * len(points), True, sys.byteorder == "big")
    for name in ("xyz", "intensity", "ring", "instance", "class"):
        np.testing.assert_array_equal(points[name], top[name][hit])
    # What does not sweep measures all at the stamp.
    assert not top.sweep and not points["time"].any()

    readings = {reading.nanoseconds: reading for each in captures.values() if (reading := each["ego/imu"]).valid}
    (when, imu), *_ = peer.by_time(IMU).items()
    force, rate = imu.linear_acceleration, imu.angular_velocity
    assert (force.x, force.y, force.z) == tuple(readings[when].specific_force)
    assert (rate.x, rate.y, rate.z) == tuple(readings[when].angular_velocity)
    assert imu.orientation_covariance[0] == -1.0

    assert got["/ego/front/depth"].header.frame_id == "ego/front" and cloud.header.frame_id == "ego/top"


def test_the_clock_is_that_of_the_steps(field, peer):
    with Bridge(field) as bridge:
        peer.until(lambda: any(peer.got["/clock"]), bridge.publish)
        for _ in range(7):
            count = len(peer.got["/clock"])
            step = bridge.step()
            peer.until(lambda count=count: len(peer.got["/clock"]) > count)
            # A sixtieth of a second, to half a nanosecond.
            assert nanoseconds(peer.got["/clock"][-1].clock) == round(step * 1e9 / 60)
    assert step == 7 and field.steps == 7


def test_a_velocity_drives_the_car(world, peer):
    ego = world["ego"]
    with Bridge(world) as bridge:
        assert bridge.step(30) == 30 and ego.speed == 0.0
        publisher = peer.node.create_publisher(Twist, "/ego/cmd_vel", 1)
        peer.until(publisher.get_subscription_count)
        # It has come when a step has moved the car.
        peer.until(lambda: ego.speed > 0.0, lambda: (publisher.publish(velocity(4.0, 0.3)), bridge.step()))
        bridge.step(500)
        assert ego.speed == pytest.approx(4.0, abs=1e-4)
        before = ego.yaw
        bridge.step(60)
        # To the left is positive, in ROS as here; by the wheelbase, and the step's sums.
        assert (ego.yaw - before + np.pi) % (2 * np.pi) - np.pi == pytest.approx(0.3, rel=1e-3)
        assert world["van"].speed == 0.0


def test_velocities_are_followed_as_the_type_of_vehicle_can(world):
    truck = world.spawn_vehicle("truck", at=(9, 0, 0), name="truck", manual=True)
    own = VelocityController(gain=3)
    with Bridge(world, controllers={"ego": own}) as bridge:
        controllers = {name: controller for name, (_, controller) in bridge._driven.items()}
    assert controllers["ego"] is own and controllers["truck"].wheelbase > own.wheelbase
    assert controllers["truck"] == VelocityController.of_type(world.vehicle_type(truck.type_))


def test_frames_have_z_up():
    sim = relief.Sim()
    sim.add_camera("eye", size=(8, 6), at=(2.0, 3.0, 1.0))
    sim.add_lidar("top", beams="vlp16", at=(2.0, 3.0, 1.0))
    sim.step()
    capture = sim.capture()
    of_lidar = messages.transform(0, "top", capture["top"].world_from_sensor).transform
    assert (of_lidar.translation.x, of_lidar.translation.y, of_lidar.translation.z) == (1.0, 2.0, 3.0)
    assert (of_lidar.rotation.x, of_lidar.rotation.w) == (0.0, 1.0)
    # A matrix from a quaternion (Diebel 2006, 125): single precision of places, 1e-6.
    for name in ("eye", "top"):
        message = messages.transform(0, name, capture[name].world_from_sensor)
        q = message.transform.rotation
        x, y, z, w = q.x, q.y, q.z, q.w
        found = [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
        expected = capture[name].world_from_sensor[[2, 0, 1], :3]
        np.testing.assert_allclose(found, expected, atol=1e-6)


@pytest.mark.parametrize("axis", np.vstack([np.eye(3), -np.eye(3), np.ones((1, 3)) / np.sqrt(3)]))
@pytest.mark.parametrize("angle", [0.0, 1.0, 2.5, np.pi])
def test_a_quaternion_is_that_of_its_matrix(axis, angle):
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    # Rodrigues' formula.
    turn = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    expected = np.array([*(np.sin(angle / 2) * axis), np.cos(angle / 2)])
    # q and −q are one turn. Some roundings of numbers up to 4.
    assert abs(np.dot(messages.quaternion(turn), expected)) == pytest.approx(1.0, abs=1e-14)


def test_tf_has_all_that_are_due(world, monkeypatch):
    # The package index has no tf2_msgs: something in the place of the message and of what publishes it.
    monkeypatch.setattr("relief.ros2.bridge.TFMessage", lambda transforms: transforms)
    got = []
    with Bridge(world) as bridge:
        bridge._publishers["/tf"] = SimpleNamespace(publish=got.append)
        bridge.step(12)
    assert [[place.child_frame_id for place in places] for places in got] == [["ego/front", "ego/top", "ego/imu"]] * 2
    assert [nanoseconds(places[0].header.stamp) for places in got] == [100_000_000, 200_000_000]
    assert {place.header.frame_id for places in got for place in places} == {"world"}


@pytest.fixture
def published(monkeypatch):
    """What bridges publish, by topic, without the way to another node."""
    got = {}
    monkeypatch.setattr(Bridge, "_publisher", lambda self, kind, topic, quality: got.setdefault(topic, []).append)
    return got


def test_each_sensor_has_its_topics_and_each_lens_its_model(tmp_path, published):
    scene = tmp_path / "earth.ron"
    scene.write_text("(geo_origin: (latitude_degrees: 48.137, longitude_degrees: 11.575, altitude: 519))")
    sim = relief.Sim(scene)
    k = (9.0, 9.0, 4.0, 3.0)
    sim.add_camera("plain", size=(8, 6), K=k)
    sim.add_camera("bent", size=(8, 6), K=k, distortion=(0.1, 0.02, 0.001, -0.002, 0.003, 0.04))
    sim.add_camera("round", size=(8, 6), K=k, fisheye=(0.1, 0.02))
    sim.add_camera("parallel", size=(8, 6), half_height=2.0)
    sim.add_gnss("mast", at=(0.0, 0.0, 0.0))
    sim.add_imu("unit")
    with Bridge(sim) as bridge:
        # Of the first step, before an IMU measures.
        bridge.publish()
    infos = {name: published[f"/{name}/camera_info"][0] for name in ("plain", "bent", "round")}
    assert {name: (info.distortion_model, list(info.d)) for name, info in infos.items()} == {
        "plain": ("plumb_bob", [0.0] * 5),
        "bent": ("rational_polynomial", [0.1, 0.02, 0.001, -0.002, 0.003, 0.04, 0.0, 0.0]),
        "round": ("equidistant", [0.1, 0.02, 0.0, 0.0]),
    }
    assert "/parallel/camera_info" not in published and len(published["/parallel/image_raw"]) == 1
    assert len(published["/mast/fix"]) == 1 and "/unit/imu" not in published


def velocity(speed, yaw_rate):
    message = Twist()
    message.linear.x, message.angular.z = speed, yaw_rate
    return message


def test_each_vehicle_follows_by_its_controller(field, published):
    car = field.spawn_vehicle("car", at=(0, 0, 0), name="car", manual=True)
    van = field.spawn_vehicle("van", at=(9, 0, 0), name="van", manual=True)
    slow = VelocityController(gain=0.5, wheelbase=3.7)
    with Bridge(field, controllers={"van": slow}) as bridge:
        for name in ("car", "van"):
            bridge._receiver(name)(velocity(1.0, 0.2))
            # Those that are no numbers are left out.
            bridge._receiver(name)(velocity(float("nan"), 0.2))
        bridge.step()
        own = VelocityController.of_type(field.vehicle_type("car"))
        for vehicle, controller in ((car, own), (van, slow)):
            asked = vehicle.controls
            # Single precision of what vehicles are asked for.
            expected = pytest.approx(controller.controls(0.0, 1.0, 0.2), rel=1e-6)
            assert (asked["throttle"], asked["brake"], asked["steer"]) == expected
        van.despawn()
        assert bridge.step() == 2


def test_a_fix_is_that_of_the_receiver(tmp_path):
    scene = tmp_path / "earth.ron"
    scene.write_text("(geo_origin: (latitude_degrees: 48.137, longitude_degrees: 11.575, altitude: 519))")
    sim = relief.Sim(scene)
    sim.add_gnss("mast", at=(0.0, 0.0, 0.0))
    sim.add_gnss("noisy", at=(0.0, 0.0, 0.0), horizontal_sigma=1.5, vertical_sigma=2)
    sim.step()
    capture = sim.capture()
    reading = capture["mast"]
    ((topic, fix),) = messages.of_reading("mast", reading)
    assert topic == "fix"
    assert (fix.latitude, fix.longitude, fix.altitude) == (reading.latitude, reading.longitude, reading.altitude)
    # At the origin itself: a metre is 1e-5 degrees.
    assert (fix.latitude, fix.longitude) == (pytest.approx(48.137, abs=1e-7), pytest.approx(11.575, abs=1e-7))
    assert (fix.status.status, fix.status.service, fix.position_covariance_type) == (0, 1, 3)
    assert not np.any(fix.position_covariance)
    ((_, noisy),) = messages.of_reading("noisy", capture["noisy"])
    np.testing.assert_array_equal(noisy.position_covariance, np.diag([2.25, 2.25, 4]).ravel())
    assert (fix.header.stamp.sec, fix.header.stamp.nanosec, fix.header.frame_id) == (0, 16_666_667, "mast")


def test_an_imu_tells_its_noise(field):
    # A density of 0.5 at 60 readings a second.
    field.add_imu("imu", at=(0, 1, 0), accelerometer_density=0.5, gyroscope_density=0.25)
    for _ in range(3):
        field.step()
        capture = field.capture()
    ((_, imu),) = messages.of_reading("imu", capture["imu"])
    np.testing.assert_allclose(imu.linear_acceleration_covariance, np.diag([15.0] * 3).ravel())
    np.testing.assert_allclose(imu.angular_velocity_covariance, np.diag([3.75] * 3).ravel())


def test_the_page_runs_as_it_stands():
    """For a fraction of the time."""
    page = (ROOT / "docs" / "ros2.md").read_text(encoding="utf-8")
    program = page.split("```text\n")[1].split("```")[0]
    assert "bridge.step(600)" in program
    names = {}
    exec(program.replace("bridge.step(600)", "bridge.step(12)"), names)
    assert names["sim"].steps == 12


def test_names():
    sim = relief.Sim()
    assert [messages.frame_name(name) for name in ("ego/front", "Car 2/left eye", "2/3", "größe/", "")] == [
        "ego/front",
        "Car_2/left_eye",
        "_2/_3",
        "gr__e/_",
        "_",
    ]
    sim.spawn_vehicle("car", at=(0, 0, 0), name="ego", manual=True)
    with pytest.raises(ValueError, match='no vehicle "eg" is under manual control'):
        Bridge(sim, controllers={"eg": VelocityController()})
    sim.add_camera("a b", size=(8, 6), at=(0, 1, 0))
    sim.add_camera("a_b", size=(8, 6), at=(0, 1, 0))
    with Bridge(sim) as bridge, pytest.raises(ValueError, match='its name in ROS, "a_b", is that of sensor "a'):
        bridge.step()


def test_two_vehicles_of_one_name_are_refused(field):
    for x in (0, 9):
        field.spawn_vehicle("car", at=(x, 0, 0), name="ego", manual=True)
    with pytest.raises(ValueError, match='its topic, /ego/cmd_vel, is that of vehicle "ego"'):
        Bridge(field)


def test_what_is_closed_takes_no_steps(field):
    bridge = Bridge(field)
    with pytest.raises(ValueError, match="n: expected at least 0 steps, found -1"):
        bridge.step(-1)
    bridge.close()
    bridge.close()
    for call in (bridge.step, bridge.publish, bridge.spin):
        with pytest.raises(RuntimeError, match="the bridge is closed"):
            call()
    assert field.steps == 0
