"""Worlds, entities, sensors and their captures, in Rust."""

import sys
from os import PathLike
from pathlib import Path
from typing import Any, Dict, Iterator, List, Literal, Optional, Sequence, Tuple, TypedDict, Union, final, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray
from typing_extensions import NotRequired, Self, Unpack, disjoint_base

from relief.cuda import CudaBatch

__version__: str

__all__ = [
    "BarometerReading",
    "CameraBatch",
    "CameraCapture",
    "Capture",
    "Collisions",
    "Contact",
    "Dataset",
    "Entity",
    "GnssReading",
    "ImuReading",
    "LaneReading",
    "LidarCapture",
    "Light",
    "LightEntity",
    "Portal",
    "Reading",
    "Recording",
    "Route",
    "Sensor",
    "Sim",
    "Vehicle",
    "__version__",
    "adapter",
    "capture",
    "capture_columns",
    "capture_due",
    "depth_steps",
    "descriptions",
    "look",
    "replay",
    "run_program",
    "set_threads",
    "step",
]

if sys.platform == "linux":
    __all__ += [
        "SharedPictures",
        "dlpack_capsule",
        "set_shared_memory_limit",
        "share",
        "shared_memory_numbers",
        "sharing_device",
    ]

_Path = Union[str, PathLike[str]]
_Point = Union[Tuple[float, float, float], Sequence[float], NDArray[Any]]
_Color = Union[str, Tuple[float, float, float], Sequence[float], NDArray[Any]]
_Rgb = Tuple[float, float, float]
_DistortionModel = Literal["plumb_bob", "rational_polynomial", "equidistant"]

class _ClassInfo(TypedDict):
    id: int
    color: Tuple[int, int, int]
    is_thing: bool
    train_id: int

class _GeoOrigin(TypedDict, total=False):
    latitude_degrees: float
    longitude_degrees: float
    altitude: float
    at: _Point

class _GivenEnvironment(TypedDict, total=False):
    ambient: _Color
    zenith: _Color
    horizon: _Color
    ground: _Color
    exposure: float
    auto_exposure: bool
    tone_map: Literal["clamp", "aces", "agx"]
    lux: float

class _Environment(TypedDict):
    ambient: _Rgb
    zenith: _Rgb
    horizon: _Rgb
    ground: _Rgb
    exposure: float
    auto_exposure: bool
    tone_map: Literal["clamp", "aces", "agx"]
    lux: float

# Keywords of sensors.
class _SensorArguments(TypedDict, total=False):
    at: Optional[_Point]
    yaw: Optional[float]
    pitch: Optional[float]
    roll: Optional[float]
    look_at: Optional[_Point]
    every: Optional[int]
    phase: Optional[int]

# Other ways to write a camera's lens.
class _LensArguments(_SensorArguments, total=False):
    K: Optional[ArrayLike]
    fov_y_degrees: Optional[float]
    fov_x_degrees: Optional[float]
    half_height: Optional[float]
    distortion: Optional[Union[Sequence[float], NDArray[Any]]]
    fisheye: Optional[Union[Sequence[float], NDArray[Any]]]
    largest_degrees: Optional[float]

# described: arguments
class _CameraExposureFixedChoice(TypedDict):
    fixed: float

class _CameraExposureMetered(TypedDict, total=False):
    key: float
    stops: float

class _CameraExposureMeteredChoice(TypedDict):
    metered: _CameraExposureMetered

class _CameraLensFieldOfView(TypedDict, total=False):
    x_degrees: float
    y_degrees: float

class _CameraLensFieldOfViewChoice(TypedDict):
    field_of_view: _CameraLensFieldOfView

class _CameraLensPinhole(TypedDict):
    cx: float
    cy: float
    fx: float
    fy: float

class _CameraLensPinholeChoice(TypedDict):
    pinhole: _CameraLensPinhole

class _CameraLensBrownConrady(TypedDict):
    cx: float
    cy: float
    fx: float
    fy: float
    k1: NotRequired[float]
    k2: NotRequired[float]
    k3: NotRequired[float]
    k4: NotRequired[float]
    k5: NotRequired[float]
    k6: NotRequired[float]
    p1: NotRequired[float]
    p2: NotRequired[float]

class _CameraLensBrownConradyChoice(TypedDict):
    brown_conrady: _CameraLensBrownConrady

class _CameraLensKannalaBrandt(TypedDict):
    cx: float
    cy: float
    fx: float
    fy: float
    k1: NotRequired[float]
    k2: NotRequired[float]
    k3: NotRequired[float]
    k4: NotRequired[float]
    largest_degrees: NotRequired[float]

class _CameraLensKannalaBrandtChoice(TypedDict):
    kannala_brandt: _CameraLensKannalaBrandt

class _CameraLensOrthographic(TypedDict):
    half_height: float

class _CameraLensOrthographicChoice(TypedDict):
    orthographic: _CameraLensOrthographic

class _CameraNoise(TypedDict, total=False):
    bits: Literal[8, 12]
    black: int
    dark: float
    full_well: float
    gain: float
    read: float

class _LidarBeamsGrid(TypedDict):
    horizontal_degrees: float
    rows: int
    vertical_degrees: float

class _LidarBeamsGridChoice(TypedDict):
    grid: _LidarBeamsGrid

class _LidarBeamsList(TypedDict):
    azimuth_degrees: NotRequired[float]
    delay: NotRequired[float]
    elevation_degrees: float
    height: NotRequired[float]

class _LidarBeamsListChoice(TypedDict):
    list: Sequence[_LidarBeamsList]

class _CameraArguments(_LensArguments, total=False):
    exposure: Optional[Union[Literal["scene"], float, _CameraExposureFixedChoice, Literal["metered"], _CameraExposureMeteredChoice]]
    far: Optional[float]
    lens: Optional[Union[Literal["field_of_view"], _CameraLensFieldOfViewChoice, _CameraLensPinholeChoice, _CameraLensBrownConradyChoice, _CameraLensKannalaBrandtChoice, _CameraLensOrthographicChoice]]
    near: Optional[float]
    noise: Optional[_CameraNoise]
    outputs: Optional[Union[str, Sequence[str], NDArray[Any]]]
    samples: Optional[Literal[1, 4]]
    size: Optional[Union[Sequence[int], NDArray[Any]]]

class _LidarArguments(_SensorArguments, total=False):
    attenuation: Optional[float]
    beams: Optional[Union[Literal["vlp16"], Literal["hdl32"], Literal["hdl64"], Literal["os1_64"], Literal["os1_128"], _LidarBeamsGridChoice, _LidarBeamsListChoice]]
    columns: Optional[int]
    hz: Optional[float]
    drop_below: Optional[float]
    drop_rate: Optional[float]
    range_sigma: Optional[float]
    range: Optional[Union[Sequence[float], NDArray[Any]]]
    sweep: Optional[bool]

class _ImuArguments(_SensorArguments, total=False):
    accelerometer_bias: Optional[_Point]
    accelerometer_density: Optional[float]
    gyroscope_bias: Optional[_Point]
    gyroscope_density: Optional[float]

class _GnssArguments(_SensorArguments, total=False):
    horizontal_sigma: Optional[float]
    velocity_sigma: Optional[float]
    vertical_sigma: Optional[float]

class _CollisionArguments(_SensorArguments, total=False):
    margin: Optional[float]

class _LaneArguments(_SensorArguments, total=False):
    reach: Optional[float]

class _BarometerArguments(_SensorArguments, total=False):
    pressure_bias: Optional[float]
    pressure_sigma: Optional[float]
    sea_level_pressure: Optional[float]
    sea_level_temperature: Optional[float]

class _PointLight(TypedDict, total=False):
    ambient: Optional[_Color]
    attenuation: Optional[Union[_Point, Literal["inverse_square"]]]
    color: Optional[_Color]
    on: Optional[bool]
    radius: Optional[float]
    shadow_near: Optional[float]
    shadows: Optional[bool]
    temperature_kelvin: Optional[int]

class _SpotLight(TypedDict, total=False):
    ambient: Optional[_Color]
    attenuation: Optional[Union[_Point, Literal["inverse_square"]]]
    color: Optional[_Color]
    cutoff_degrees: Optional[float]
    exponent: Optional[float]
    inner_degrees: Optional[float]
    on: Optional[bool]
    outer_degrees: Optional[float]
    radius: Optional[float]
    shadow_near: Optional[float]
    shadows: Optional[bool]
    temperature_kelvin: Optional[int]

class _DirectionalLight(TypedDict, total=False):
    ambient: Optional[_Color]
    angle_degrees: Optional[float]
    color: Optional[_Color]
    on: Optional[bool]
    shadows: Optional[bool]
    temperature_kelvin: Optional[int]

class _WeatherArguments(TypedDict, total=False):
    clouds: Optional[float]
    date: Optional[str]
    glow: Optional[float]
    haze: Optional[float]
    moon_azimuth_degrees: Optional[float]
    moon_elevation_degrees: Optional[float]
    sky: Optional[Literal["gradient", "atmosphere"]]
    sun_azimuth_degrees: Optional[float]
    sun_elevation_degrees: Optional[float]
    time_speed: Optional[float]

class _Weather(TypedDict):
    clouds: float
    date: str
    glow: float
    haze: float
    moon_azimuth_degrees: Optional[float]
    moon_elevation_degrees: Optional[float]
    sky: Literal["gradient", "atmosphere"]
    sun_azimuth_degrees: Optional[float]
    sun_elevation_degrees: Optional[float]
    time_speed: float
# end of described

# described: kinds
_SensorKind = Literal["camera", "lidar", "imu", "gnss", "collision", "lane", "barometer"]
# end of described

# "class" is a word of the language.
_VehicleType = TypedDict(
    "_VehicleType",
    {
        "name": str,
        # Width, height, length: along X, Y, Z. Of boxes it is length, width, height.
        "size": Tuple[float, float, float],
        "rear_overhang": float,
        "wheelbase": float,
        "track": float,
        "mass": float,
        "speed": float,
        "reverse_speed": float,
        "acceleration": float,
        "braking": float,
        "steering": float,
        "steering_rate": float,
        "lateral_acceleration": float,
        "paints": int,
        "class": Optional[str],
    },
)

@final
class Sim:
    """A world of a scene, and its run."""

    def __new__(
        cls,
        scene: Optional[_Path] = None,
        *,
        seed: Optional[int] = None,
        step_seconds: Optional[float] = None,
        geo_origin: Optional[_GeoOrigin] = None,
        environment: Optional[_GivenEnvironment] = None,
    ) -> Sim: ...
    def step(self, n: int = 1) -> int: ...
    def capture(self, *names: str) -> Capture: ...
    def look(self, *names: str) -> Capture: ...
    def spawn_vehicle(
        self,
        kind: str,
        at: Optional[_Point] = None,
        *,
        yaw: float = 0.0,
        name: Optional[str] = None,
        manual: bool = False,
        paint: int = 0,
        route: Optional[str] = None,
        lane: int = 0,
        along: float = 0.0,
        speed: float = 0.0,
    ) -> Vehicle: ...
    def spawn_light(
        self,
        light: Light,
        at: Optional[_Point] = None,
        *,
        yaw: float = 0.0,
        pitch: float = 0.0,
        look_at: Optional[_Point] = None,
        name: Optional[str] = None,
    ) -> LightEntity: ...
    def spawn_mesh(
        self,
        like: Union[str, Entity],
        at: _Point,
        *,
        yaw: float = 0.0,
        pitch: float = 0.0,
        roll: float = 0.0,
        scale: Optional[_Point] = None,
        name: Optional[str] = None,
    ) -> Entity: ...
    # described: methods
    def add_camera(self, name: str, **arguments: Unpack[_CameraArguments]) -> Sensor: ...
    def add_lidar(self, name: str, **arguments: Unpack[_LidarArguments]) -> Sensor: ...
    def add_imu(self, name: str, **arguments: Unpack[_ImuArguments]) -> Sensor: ...
    def add_gnss(self, name: str, **arguments: Unpack[_GnssArguments]) -> Sensor: ...
    def add_collision(self, name: str, **arguments: Unpack[_CollisionArguments]) -> Sensor: ...
    def add_lane(self, name: str, **arguments: Unpack[_LaneArguments]) -> Sensor: ...
    def add_barometer(self, name: str, **arguments: Unpack[_BarometerArguments]) -> Sensor: ...
    # end of described
    def entity(self, id: int) -> Any: ...
    def set_signal(self, name: str, shows: Optional[Union[str, Sequence[str]]]) -> None: ...
    def set_weather(
        self,
        preset: Optional[str] = None,
        *,
        over_seconds: Optional[float] = None,
        **fields: Unpack[_WeatherArguments],
    ) -> None: ...
    @property
    def weather(self) -> _Weather: ...
    def vehicle_type(self, name: str) -> _VehicleType: ...
    def next_mesh_variant(self) -> None: ...
    def hash(self) -> str: ...
    def snapshot(self) -> bytes: ...
    def restore(self, snapshot: Union[bytes, bytearray, memoryview]) -> None: ...
    def fork(self) -> Sim: ...
    def __copy__(self) -> Sim: ...
    def __deepcopy__(self, memo: Any) -> Sim: ...
    def fresh(self, *, seed: Optional[int] = None) -> Sim: ...
    def reset(self, *, seed: Optional[int] = None) -> None: ...
    def reload(self) -> None: ...
    def record(self, path: _Path) -> Recording: ...
    def close(self) -> None: ...
    @property
    def entities(self) -> List[Any]: ...
    @property
    def roots(self) -> List[Any]: ...
    @property
    def vehicles(self) -> List[Vehicle]: ...
    @property
    def lights(self) -> List[LightEntity]: ...
    @property
    def sensors(self) -> List[Sensor]: ...
    @property
    def portals(self) -> List[Portal]: ...
    @property
    def names(self) -> List[str]: ...
    @property
    def meshes(self) -> List[str]: ...
    @property
    def routes(self) -> List[Route]: ...
    @property
    def signals(self) -> Dict[str, List[Tuple[str, float]]]: ...
    @property
    def classes(self) -> Dict[str, int]: ...
    @property
    def class_info(self) -> Dict[str, _ClassInfo]: ...
    @property
    def palette(self) -> NDArray[np.uint8]: ...
    @property
    def environment(self) -> _Environment: ...
    @property
    def vehicle_types(self) -> List[str]: ...
    @property
    def name(self) -> str: ...
    @property
    def warnings(self) -> List[str]: ...
    @property
    def files(self) -> List[Path]: ...
    @property
    def seed(self) -> int: ...
    @property
    def steps(self) -> int: ...
    @property
    def step_seconds(self) -> float: ...
    @property
    def seconds(self) -> float: ...
    def __getitem__(self, name: str, /) -> Any: ...
    def __contains__(self, name: str, /) -> bool: ...
    def __enter__(self) -> Sim: ...
    def __exit__(self, *_exception: Any) -> None: ...

@final
class Recording:
    """A recording that is being written."""

    def close(self) -> None: ...
    def __enter__(self) -> Recording: ...
    def __exit__(self, *_exception: Any) -> None: ...

@final
class Dataset:
    """A data set that is written capture by capture."""

    def __new__(
        cls,
        folder: _Path,
        *,
        formats: Optional[Union[str, Sequence[str]]] = None,
        sensors: Optional[Union[str, Sequence[str]]] = None,
    ) -> Dataset: ...
    def write(self, capture: Capture) -> None: ...
    def close(self) -> None: ...
    def __enter__(self) -> Dataset: ...
    def __exit__(self, *exception: Any) -> None: ...

@disjoint_base
class Entity:
    """Something in a world."""

    @property
    def id(self) -> int: ...
    @property
    def name(self) -> str: ...
    @property
    def alive(self) -> bool: ...
    @property
    def position(self) -> NDArray[np.float64]: ...
    @position.setter
    def position(self, position: _Point) -> None: ...
    @property
    def transform(self) -> NDArray[np.float64]: ...
    @transform.setter
    def transform(self, transform: ArrayLike) -> None: ...
    @property
    def world_from_entity(self) -> NDArray[np.float64]: ...
    @property
    def hidden(self) -> bool: ...
    @hidden.setter
    def hidden(self, hidden: bool) -> None: ...
    @property
    def class_(self) -> Optional[str]: ...
    @property
    def parent(self) -> Any: ...
    @property
    def children(self) -> List[Any]: ...
    def despawn(self) -> None: ...
    def place(
        self,
        at: _Point,
        *,
        yaw: float = 0.0,
        pitch: float = 0.0,
        roll: float = 0.0,
        look_at: Optional[_Point] = None,
    ) -> None: ...
    # described: methods
    def add_camera(self, name: str, **arguments: Unpack[_CameraArguments]) -> Sensor: ...
    def add_lidar(self, name: str, **arguments: Unpack[_LidarArguments]) -> Sensor: ...
    def add_imu(self, name: str, **arguments: Unpack[_ImuArguments]) -> Sensor: ...
    def add_gnss(self, name: str, **arguments: Unpack[_GnssArguments]) -> Sensor: ...
    def add_collision(self, name: str, **arguments: Unpack[_CollisionArguments]) -> Sensor: ...
    def add_lane(self, name: str, **arguments: Unpack[_LaneArguments]) -> Sensor: ...
    def add_barometer(self, name: str, **arguments: Unpack[_BarometerArguments]) -> Sensor: ...
    # end of described
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __reduce__(self) -> Any: ...

@final
class Vehicle(Entity):
    """A vehicle: +Z forward, +X left, +Y up, its origin on the ground below the middle of its rear axle."""

    @property
    def type_(self) -> str: ...
    @property
    def speed(self) -> float: ...
    @property
    def acceleration(self) -> float: ...
    @property
    def yaw(self) -> float: ...
    @property
    def steering(self) -> float: ...
    @property
    def rolled(self) -> float: ...
    @property
    def route(self) -> Optional[str]: ...
    @property
    def lane(self) -> Optional[int]: ...
    @property
    def along(self) -> Optional[float]: ...
    @property
    def offset(self) -> Optional[float]: ...
    @property
    def manual(self) -> bool: ...
    @manual.setter
    def manual(self, manual: bool) -> None: ...
    @property
    def by_hand(self) -> bool: ...
    @by_hand.setter
    def by_hand(self, by_hand: bool) -> None: ...
    @property
    def motion_source(self) -> Literal["route", "manual", "external"]: ...
    def move(
        self,
        at: _Point,
        *,
        yaw: float = 0.0,
        pitch: Optional[float] = None,
        roll: Optional[float] = None,
        velocity: _Point = (0, 0, 0),
        yaw_rate: float = 0.0,
        stamp: Optional[float] = None,
    ) -> None: ...
    def release(self) -> None: ...
    @property
    def controls(self) -> Dict[str, Any]: ...
    def drive(
        self,
        *,
        throttle: Optional[float] = None,
        brake: Optional[float] = None,
        steer: Optional[float] = None,
        headlights: Optional[Literal["off", "low", "high"]] = None,
        indicator: Optional[Literal["off", "left", "right", "hazard"]] = None,
    ) -> None: ...

@final
class Light:
    """What a light shines like."""

    @staticmethod
    def point(intensity: float, range: Optional[float] = None, **fields: Unpack[_PointLight]) -> Light: ...
    @staticmethod
    def spot(intensity: float, range: Optional[float] = None, **fields: Unpack[_SpotLight]) -> Light: ...
    @staticmethod
    def directional(intensity: float, **fields: Unpack[_DirectionalLight]) -> Light: ...

@final
class LightEntity(Entity):
    """A light of a world."""

    @property
    def kind(self) -> Literal["point", "spot", "directional"]: ...
    # described: light
    @property
    def ambient(self) -> _Rgb: ...
    @ambient.setter
    def ambient(self, value: _Color) -> None: ...
    @property
    def angle_degrees(self) -> float: ...
    @angle_degrees.setter
    def angle_degrees(self, value: float) -> None: ...
    @property
    def attenuation(self) -> Tuple[float, float, float]: ...
    @attenuation.setter
    def attenuation(self, value: Union[_Point, Literal["inverse_square"]]) -> None: ...
    @property
    def color(self) -> _Rgb: ...
    @color.setter
    def color(self, value: _Color) -> None: ...
    @property
    def cutoff_degrees(self) -> Optional[float]: ...
    @cutoff_degrees.setter
    def cutoff_degrees(self, value: float) -> None: ...
    @property
    def exponent(self) -> Optional[float]: ...
    @exponent.setter
    def exponent(self, value: float) -> None: ...
    @property
    def inner_degrees(self) -> Optional[float]: ...
    @inner_degrees.setter
    def inner_degrees(self, value: float) -> None: ...
    @property
    def intensity(self) -> float: ...
    @intensity.setter
    def intensity(self, value: float) -> None: ...
    @property
    def on(self) -> bool: ...
    @on.setter
    def on(self, value: bool) -> None: ...
    @property
    def outer_degrees(self) -> Optional[float]: ...
    @outer_degrees.setter
    def outer_degrees(self, value: float) -> None: ...
    @property
    def radius(self) -> float: ...
    @radius.setter
    def radius(self, value: float) -> None: ...
    @property
    def range(self) -> float: ...
    @range.setter
    def range(self, value: float) -> None: ...
    @property
    def shadow_near(self) -> float: ...
    @shadow_near.setter
    def shadow_near(self, value: float) -> None: ...
    @property
    def shadows(self) -> bool: ...
    @shadows.setter
    def shadows(self, value: bool) -> None: ...
    @property
    def temperature_kelvin(self) -> Optional[int]: ...
    @temperature_kelvin.setter
    def temperature_kelvin(self, value: int) -> None: ...
    @property
    def enabled(self) -> bool: ...
    @enabled.setter
    def enabled(self, value: bool) -> None: ...
    # end of described
    def change(self, light: Light) -> None: ...

@final
class Portal(Entity):
    """An opening between two rooms, or a room and outside."""

    @property
    def open(self) -> float: ...
    @open.setter
    def open(self, open: float) -> None: ...

@final
class Sensor(Entity):
    """A sensor of a world."""

    @property
    def kind(self) -> _SensorKind: ...
    @property
    def full_name(self) -> str: ...
    @property
    def every(self) -> int: ...
    @property
    def phase(self) -> int: ...
    @property
    def outputs(self) -> List[str]: ...
    @property
    def size(self) -> Optional[Tuple[int, int]]: ...
    @property
    def K(self) -> Optional[NDArray[np.float64]]: ...
    @property
    def D(self) -> Optional[NDArray[np.float64]]: ...
    @property
    def distortion_model(self) -> Optional[_DistortionModel]: ...
    @property
    def settings(self) -> Dict[str, Any]: ...
    @property
    def noise(self) -> Optional[Dict[str, Any]]: ...

@final
class Capture:
    """What every sensor measured that was due after a step, by name."""

    @property
    def step(self) -> int: ...
    @property
    def nanoseconds(self) -> int: ...
    @property
    def seconds(self) -> float: ...
    def keys(self) -> List[str]: ...
    def values(self) -> List[Any]: ...
    def items(self) -> List[Tuple[str, Any]]: ...
    def __getitem__(self, name: str, /) -> Any: ...
    def __contains__(self, name: str, /) -> bool: ...
    def __len__(self) -> int: ...
    def __iter__(self) -> Iterator[str]: ...

class _Measured:
    """What captures of all sensors have."""

    @property
    def name(self) -> str: ...
    @property
    def step(self) -> int: ...
    @property
    def seconds(self) -> float: ...
    @property
    def world_from_sensor(self) -> NDArray[np.float64]: ...

class _Arrays:
    """Arrays by their names."""

    def keys(self) -> List[str]: ...
    def __contains__(self, name: str, /) -> bool: ...

class _Outputs(_Arrays):
    """Outputs of a camera."""

    @property
    def color(self) -> NDArray[np.uint8]: ...
    @property
    def linear(self) -> NDArray[np.float16]: ...
    @property
    def depth(self) -> NDArray[np.float32]: ...
    @property
    def range(self) -> NDArray[np.float32]: ...
    @property
    def normal(self) -> NDArray[np.float32]: ...
    @property
    def instance(self) -> NDArray[np.uint32]: ...
    @property
    def part(self) -> NDArray[np.uint32]: ...
    @property
    def cls(self) -> NDArray[np.uint8]: ...
    @property
    def panoptic(self) -> NDArray[np.uint32]: ...
    @property
    def flow(self) -> NDArray[np.float32]: ...
    @property
    def flow_flags(self) -> NDArray[np.uint8]: ...
    @property
    def flow_back(self) -> NDArray[np.float32]: ...
    @property
    def flow_back_flags(self) -> NDArray[np.uint8]: ...

@final
class CameraCapture(_Measured, _Outputs):
    """What a camera captured."""

    @property
    def size(self) -> Tuple[int, int]: ...
    @property
    def exposure(self) -> float: ...
    @property
    def K(self) -> Optional[NDArray[np.float64]]: ...
    @property
    def D(self) -> Optional[NDArray[np.float64]]: ...
    @property
    def distortion_model(self) -> Optional[_DistortionModel]: ...
    # `size` is length, width, height: along Z, X, Y. That of vehicle types is width, height, length.
    @property
    def boxes(self) -> NDArray[np.void]: ...
    def arrays(self) -> Dict[str, NDArray[Any]]: ...
    def __getitem__(self, name: str, /) -> NDArray[Any]: ...

@final
class CameraBatch(_Outputs):
    """What the same camera of several worlds captured: the worlds are the first axis."""

    @property
    def steps(self) -> List[int]: ...
    @property
    def size(self) -> Tuple[int, int]: ...
    @property
    def boxes(self) -> List[NDArray[np.void]]: ...
    def arrays(self) -> Dict[str, Any]: ...
    def __getitem__(self, name: str, /) -> Any: ...
    def __len__(self) -> int: ...

@final
class LidarCapture(_Measured, _Arrays):
    """What a lidar captured since it was due before."""

    @property
    def nanoseconds(self) -> int: ...
    @property
    def sweep(self) -> bool: ...
    @property
    def world_from_sensor_before(self) -> NDArray[np.float64]: ...
    @property
    def xyz(self) -> NDArray[np.float32]: ...
    @property
    def range(self) -> NDArray[np.float32]: ...
    @property
    def intensity(self) -> NDArray[np.float32]: ...
    @property
    def ring(self) -> NDArray[np.uint16]: ...
    @property
    def time(self) -> NDArray[np.float32]: ...
    @property
    def instance(self) -> NDArray[np.uint32]: ...
    @property
    def cls(self) -> NDArray[np.uint8]: ...
    @property
    def hit(self) -> NDArray[np.uint8]: ...
    def arrays(self) -> Dict[str, NDArray[Any]]: ...
    def __getitem__(self, name: str, /) -> NDArray[Any]: ...
    def __len__(self) -> int: ...

@disjoint_base
class Reading(_Measured):
    """Measurement of a sensor without pictures."""

    def __new__(cls, reading: Reading) -> Self: ...
    def _field(self, name: str) -> Any: ...
    def _messages(self, frame: str) -> List[Tuple[str, str, bytes]]: ...

# described: readings
class BarometerReading(Reading):
    """Measurement of a barometer."""

    @property
    def pressure(self) -> float: ...
    @property
    def sigma(self) -> float: ...

class GnssReading(Reading):
    """Measurement of a receiver of satellite navigation."""

    @property
    def altitude(self) -> float: ...
    @property
    def has_velocity(self) -> bool: ...
    @property
    def latitude(self) -> float: ...
    @property
    def longitude(self) -> float: ...
    @property
    def sigmas(self) -> Tuple[float, float]: ...
    @property
    def valid(self) -> bool: ...
    @property
    def velocity(self) -> Tuple[float, float, float]: ...

class ImuReading(Reading):
    """Measurement of an inertial measurement unit, for the time that it was due before."""

    @property
    def angular_velocity(self) -> Tuple[float, float, float]: ...
    @property
    def nanoseconds(self) -> int: ...
    @property
    def sigmas(self) -> Tuple[float, float]: ...
    @property
    def specific_force(self) -> Tuple[float, float, float]: ...
    @property
    def valid(self) -> bool: ...

class LaneReading(Reading):
    """Pose in a lane. All is 0 where no lane is near."""

    @property
    def along(self) -> float: ...
    @property
    def curvature(self) -> float: ...
    @property
    def heading_error(self) -> float: ...
    @property
    def lane(self) -> int: ...
    @property
    def offset(self) -> float: ...
    @property
    def route(self) -> int: ...
    @property
    def speed(self) -> float: ...
    @property
    def valid(self) -> bool: ...
    @property
    def width(self) -> float: ...
# end of described

@final
class Contact:
    """What something touches."""

    @property
    def instance(self) -> int: ...
    @property
    def class_(self) -> Optional[str]: ...
    @property
    def depth(self) -> float: ...
    @property
    def normal(self) -> Tuple[float, float, float]: ...
    @property
    def speed(self) -> float: ...

@final
class Collisions(Reading):
    """All that something touches."""

    def __len__(self) -> int: ...
    def __getitem__(self, index: int, /) -> Contact: ...

@final
class Route:
    """A road to follow."""

    @property
    def name(self) -> str: ...
    @property
    def length(self) -> float: ...
    @property
    def lanes(self) -> int: ...
    @property
    def lane_width(self) -> float: ...
    @property
    def closed(self) -> bool: ...
    @property
    def speed_limit(self) -> float: ...
    @property
    def then(self) -> List[str]: ...
    def points(
        self, along: Union[Sequence[float], NDArray[Any]], lane: Optional[int] = None
    ) -> NDArray[np.float64]: ...
    def yaw(self, along: float) -> float: ...

def depth_steps(depths: NDArray[np.float32], scale: NDArray[np.float32]) -> NDArray[np.uint8]: ...
def descriptions() -> str: ...
def adapter() -> str: ...
@overload
def capture(sims: Sequence[Sim], sensor: str, *, device: Literal["cpu"] = "cpu") -> CameraBatch: ...
@overload
def capture(sims: Sequence[Sim], sensor: str, *, device: Literal["cuda"]) -> CudaBatch: ...
@overload
def capture(sims: Sequence[Sim], sensor: str, *, device: str) -> Union[CameraBatch, CudaBatch]: ...
def capture_columns(
    sims: Sequence[Sim], names: Union[str, Sequence[str]], *, without: Union[str, Sequence[str]] = ()
) -> List[Any]: ...
def capture_due(sims: Sequence[Sim]) -> List[Capture]: ...
@overload
def look(sims: Sequence[Sim], sensor: str, *, device: Literal["cpu"] = "cpu") -> CameraBatch: ...
@overload
def look(sims: Sequence[Sim], sensor: str, *, device: Literal["cuda"]) -> CudaBatch: ...
@overload
def look(sims: Sequence[Sim], sensor: str, *, device: str) -> Union[CameraBatch, CudaBatch]: ...
def run_program(command: Sequence[_Path], arguments: Sequence[_Path], package: _Path) -> int: ...
def replay(recording: _Path, *, scene: Optional[_Path] = None) -> Sim: ...
def set_threads(threads: int) -> None: ...
def step(sims: Sequence[Sim], n: Union[int, Sequence[int], NDArray[Any]] = 1) -> List[int]: ...

if sys.platform == "linux":
    @final
    class SharedPictures:
        """Pictures of the same camera of several worlds, in memory of the graphics device."""

        @property
        def arrays(self) -> List[Tuple[str, str, List[int], List[int], int]]: ...
        @property
        def device_name(self) -> str: ...
        @property
        def device_uuid(self) -> bytes: ...
        @property
        def memory(self) -> int: ...
        @property
        def memory_bytes(self) -> int: ...
        @property
        def size(self) -> Tuple[int, int]: ...
        @property
        def steps(self) -> List[int]: ...
        def open_fd(self) -> int: ...

    def dlpack_capsule(
        address: int,
        device: Tuple[int, int],
        kind: Tuple[int, int],
        shape: Sequence[int],
        strides: Sequence[int],
        owner: object,
    ) -> object: ...
    def set_shared_memory_limit(bytes: int) -> None: ...
    def shared_memory_numbers() -> List[int]: ...
    def sharing_device() -> Tuple[bytes, str]: ...
    def share(
        sims: Sequence[Sim], sensor: str, due: bool, *, scale: Optional[NDArray[np.float32]] = None
    ) -> SharedPictures: ...
