"""What there is in a world: classes, types of vehicles, what is mounted on nothing, lenses and noise."""

import numpy as np
import pytest

import relief

OWN_CLASSES = """(
    classes: {
        "lamp": (id: 7, color: srgb("#102030"), thing: true),
        "floor": (id: 200, color: srgb("#ff8000")),
    },
    environment: (ambient: (0.1, 0.2, 0.3), exposure: 2, tone_map: clamp),
    entities: [
        (name: "eye", sensor: camera(size: (8, 8), noise: (full_well: 5000, bits: 8))),
        (name: "scan", sensor: lidar(noise: (drop_rate: 0.25))),
        (name: "imu", sensor: imu(noise: (gyroscope_density: 0.5, gyroscope_bias: (1, 2, 3)))),
    ],
)"""


@pytest.fixture
def own(tmp_path):
    path = tmp_path / "own.ron"
    path.write_text(OWN_CLASSES)
    return relief.Sim(path)


def test_classes_are_those_of_the_scene(field, own):
    # Cityscapes' labels.py.
    assert field.class_info["car"] == {"id": 26, "color": (0, 0, 142), "is_thing": True, "train_id": 13}
    assert field.class_info["road"] == {"id": 7, "color": (128, 64, 128), "is_thing": False, "train_id": 0}
    assert {name: info["id"] for name, info in field.class_info.items()} == field.classes
    assert own.classes["lamp"] == 7 and own.class_info["lamp"]["color"] == (0x10, 0x20, 0x30)
    assert own.class_info["lamp"]["is_thing"] and not own.class_info["floor"]["is_thing"]


def test_a_palette_paints_classes(field, own):
    palette = own.palette
    assert palette.shape == (256, 3) and palette.dtype == np.uint8
    named = {info["id"]: info["color"] for info in own.class_info.values()}
    np.testing.assert_array_equal(palette, [named.get(id, (0, 0, 0)) for id in range(256)])
    field.add_camera("eye", size=(8, 8), at=(0, 2, 0), pitch=-0.6, outputs="class")
    picture = field.palette[field.capture()["eye"].cls]
    assert picture.shape == (8, 8, 3)
    assert tuple(picture[7, 4]) == field.class_info[field["ground"].class_]["color"]


def test_light_and_look_are_told(field, own):
    look = own.environment
    assert look["exposure"] == 2 and look["tone_map"] == "clamp"
    np.testing.assert_allclose(look["ambient"], (0.1, 0.2, 0.3), rtol=1e-6)
    colors = {"ambient", "zenith", "horizon", "ground"}
    assert set(look) == set(field.environment) == colors | {"exposure", "auto_exposure", "tone_map", "lux"}
    assert look["auto_exposure"] is True and look["lux"] == 30


def test_types_of_vehicles_tell_what_they_can(field):
    car = field.vehicle_type("car")
    assert car["name"] == car["class"] == "car" and len(car["size"]) == 3
    ego = field.spawn_vehicle("car", at=(0, 0, 0), name="ego")
    ego.drive(throttle=1, steer=1)
    field.step(1)
    # From a standstill, the whole throttle.
    assert ego.acceleration == pytest.approx(car["acceleration"], rel=1e-6)
    ego.drive(throttle=0)
    field.step(300)
    assert ego.steering == pytest.approx(car["steering"], rel=1e-6)
    assert set(field.vehicle_types) >= {field.vehicle_type(name)["name"] for name in field.vehicle_types}
    with pytest.raises(KeyError, match=r'unknown vehicle type "trcuk" \(did you mean "truck"'):
        field.vehicle_type("trcuk")
    with pytest.raises(TypeError, match="name: expected a string, found 5"):
        field.vehicle_type(5)


def test_roots_are_things_without_their_parts(field):
    before = field.roots
    car = field.spawn_vehicle("car", at=(0, 0, 0), name="ego")
    camera = car.add_camera("front", at=(0, 1, 1))
    lamp = field.spawn_light(relief.Light.point(1), at=(0, 3, 0))
    assert field.roots == [*before, car, lamp]
    assert camera in field.entities and camera not in field.roots
    assert len(field.entities) > 2 * len(field.roots)
    assert all(thing.parent is None for thing in field.roots)
    car.despawn()
    assert field.roots == [*before, lamp]


@pytest.mark.parametrize(
    ("lens", "model", "coefficients"),
    [
        ({}, "plumb_bob", [0, 0, 0, 0, 0]),
        ({"K": (9, 9, 3.5, 3.5)}, "plumb_bob", [0, 0, 0, 0, 0]),
        ({"K": (9, 9, 3.5, 3.5), "distortion": (-0.01, 0.002, 0.001)}, "plumb_bob", [-0.01, 0.002, 0.001, 0, 0]),
        (
            {"K": (9, 9, 3.5, 3.5), "distortion": (0.01, 0, 0, 0, 0, 0.02)},
            "rational_polynomial",
            [0.01, 0, 0, 0, 0, 0.02, 0, 0],
        ),
        ({"K": (9, 9, 3.5, 3.5), "fisheye": (0.01, 0.02)}, "equidistant", [0.01, 0.02, 0, 0]),
    ],
)
def test_cameras_and_captures_tell_the_lens(field, lens, model, coefficients):
    camera = field.add_camera("eye", size=(8, 8), **lens)
    for of in (camera, field.capture()["eye"]):
        assert of.distortion_model == model
        np.testing.assert_array_equal(of.D, coefficients)
        assert of.D.dtype == np.float64
    # Another array each time.
    camera.D[:] = 5
    np.testing.assert_array_equal(camera.D, coefficients)


def test_what_has_no_lens_tells_none(field):
    flat = field.add_camera("flat", size=(8, 8), half_height=3)
    lidar = field.add_lidar("lidar", columns=36)
    capture = field.capture()["flat"]
    for of in (flat, lidar, capture):
        assert getattr(of, "K", None) is None and of.D is None and of.distortion_model is None


def test_sensors_tell_their_noise(field, own):
    assert own["eye"].noise == {"full_well": 5000, "read": 3, "dark": 0, "gain": 1, "bits": 8, "black": 64}
    assert own["scan"].noise == {"range_sigma": 0, "drop_rate": 0.25, "drop_below": 0}
    assert own["imu"].noise["gyroscope_density"] == 0.5 and own["imu"].noise["gyroscope_bias"] == (1, 2, 3)
    assert field.add_camera("eye", size=(8, 8)).noise is None
    car = field.spawn_vehicle("car", at=(0, 0, 0))
    assert car.add_lane("lane").noise is None and car.add_collision("touch").noise is None
    imu = field.add_imu("imu", accelerometer_density=0.5, every=2)
    assert imu.noise["accelerometer_density"] == 0.5
    field.step(2)
    # A density over the root of the seconds between readings: 30 a second.
    assert field.capture()["imu"].sigmas == pytest.approx((0.5 * np.sqrt(30), 0))
