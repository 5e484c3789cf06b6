"""Reads the files of an IMU and a GNSS receiver, and the log of the same run: tests/sensors/motion_sensors.

    motion_sensors.py FOLDER

FOLDER holds sensors.json, sensors.mcap and arrays as NPY and NPZ. Floats must be equal to the bit.
"""

import json
import sys
from pathlib import Path

import mcap.reader
import numpy as np
from mcap_ros2.decoder import DecoderFactory

RUN = Path(sys.argv[1])
DESCRIBED = {sensor["name"]: sensor for sensor in json.loads((RUN / "sensors.json").read_text())["sensors"]}
STEP = json.loads((RUN / "sensors.json").read_text())["step_seconds"]
IMU = np.dtype([("valid", "u1"), ("time", "<f8"), ("specific_force", "<f8", 3), ("angular_velocity", "<f8", 3)])
GNSS = np.dtype([("valid", "u1"), ("latitude", "<f8"), ("longitude", "<f8"), ("altitude", "<f8"),
                 ("has_velocity", "u1"), ("velocity", "<f8", 3)])


def readings(sensor, name, dtype):
    """By step; the archive has the same values."""
    found = {}
    for capture in DESCRIBED[sensor]["captures"]:
        step = capture["step"]
        records = np.load(RUN / sensor / f"{name}_{step:05}.npy")
        assert records.dtype == dtype and records.shape == (1,), records.dtype
        arrays = np.load(RUN / sensor / f"{step:05}.npz")
        assert sorted(arrays) == sorted(dtype.names)
        for field in dtype.names:
            assert arrays[field].tobytes() == records[field].tobytes(), field
        found[step] = records[0]
    return found


imu, gnss = readings("ego/unit", "imu", IMU), readings("ego/mast", "gnss", GNSS)
assert list(imu) == [0, 2, 4, 6, 8] and list(gnss) == [1, 4, 7]
unit, mast = DESCRIBED["ego/unit"], DESCRIBED["ego/mast"]
assert unit["axes"] == "X forward, Y left, Z up" and unit["delay_seconds"] == 2 * STEP
assert mast["geo_origin"]["latitude_degrees"] == 48.1
densities = np.array([0.02, 0.002], np.float32).astype(float)
sigmas = [unit["outputs"][name]["sigma"] for name in ("specific_force", "angular_velocity")]
assert np.allclose(sigmas, densities / np.sqrt(2 * STEP), rtol=1e-12), sigmas

with open(RUN / "sensors.mcap", "rb") as stream:
    reader = mcap.reader.make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
    messages = [(channel.topic, message.log_time, decoded) for _, channel, message, decoded in
                reader.iter_decoded_messages(log_time_order=False)]


def step_of(nanoseconds):
    return round(nanoseconds * 1e-9 / STEP)


def vector(message):
    return np.array([message.x, message.y, message.z])


counts = {"imu": 0, "fix": 0}
for topic, time, message in messages:
    kind = topic.rsplit("/", 1)[1]
    if kind not in counts:
        continue
    counts[kind] += 1
    stamp = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
    if kind == "imu":
        reading = imu[step_of(time)]
        assert topic == "/ego/unit/imu" and message.header.frame_id == "ego/unit"
        # Of an interval before.
        assert step_of(stamp) == step_of(time) - 2 and reading["valid"] == 1
        assert abs(reading["time"] - stamp * 1e-9) < 1e-12
        assert np.array_equal(vector(message.linear_acceleration), reading["specific_force"])
        assert np.array_equal(vector(message.angular_velocity), reading["angular_velocity"])
        for found, sigma in zip((message.linear_acceleration_covariance, message.angular_velocity_covariance), sigmas):
            assert np.allclose(np.reshape(found, (3, 3)), np.eye(3) * sigma**2, rtol=1e-12)
        assert message.orientation_covariance[0] == -1
        # Upright, with its bias: gravity along z.
        assert abs(reading["specific_force"][2] - 9.81) < 1
    else:
        reading = gnss[step_of(time)]
        assert topic == "/ego/mast/fix" and stamp == time
        assert (message.latitude, message.longitude, message.altitude) == tuple(
            reading[name] for name in ("latitude", "longitude", "altitude"))
        assert np.array_equal(np.reshape(message.position_covariance, (3, 3)), np.diag([4.0, 4.0, 0.0]))
        assert message.position_covariance_type == 3
        # The car is within 14 m of the origin, and errors of 2 m are at most 7.4 m in each direction.
        assert abs(message.latitude - 48.1) < 25 / 111_000 and abs(message.altitude - 500) < 0.01
assert [step for step, reading in imu.items() if not reading["valid"]] == [0, 2]
print(f"{counts['imu']} of imu, {counts['fix']} of fix")
