"""What there is to do: a scene, where the vehicle begins, what it sees, and what is good.

A task has no state of its own. `Episode` has that of one run in one world. Environments of one world and of many call
the same functions, so that what environment i sees does not depend on how many there are.
"""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import inspect
import math
import operator
from collections.abc import Mapping, Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
from gymnasium import spaces

import relief
from relief import _relief, cuda

#: Simulated seconds of a step of the environment: as near as whole steps of the world's clock come.
FRAME_SECONDS = 0.1
#: Depths of uint8 pictures, metres: 1 to 254 are from the nearest to the farthest, by their logarithm.
DEPTH_RANGE = (0.5, 100.0)
#: Of routes on which vehicles begin, metres; and their speed limits, m/s: slower ones are footpaths.
SHORTEST_ROUTE, SLOWEST_ROAD = 40.0, 3.0
#: The names of the sensors on the vehicle.
CAMERA, LANE, TOUCH = "camera", "lane", "touch"


@dataclasses.dataclass
class Episode:
    """A run of a task in one world: its vehicle, and what is known of the step before."""

    sim: relief.Sim
    ego: relief.Vehicle
    speed_limits: list[float]  # of each route, m/s
    steer: float = 0.0
    pedal: float = 0.0
    turned: float = 0.0
    steps: int = 0

    @functools.cached_property
    def frame_steps(self) -> int:
        """Steps of the world's clock for one of the environment."""
        return frame_steps(self.sim)

    @functools.cached_property
    def frame_seconds(self) -> float:
        """Simulated seconds of a step of the environment."""
        return self.frame_steps * self.sim.step_seconds

    def speed_limit(self, lane: relief.LaneReading) -> float:
        """Of the road that the vehicle is on, m/s."""
        return self.speed_limits[lane.route] if lane.valid else max(self.speed_limits)


@dataclasses.dataclass(frozen=True)
class Outcome:
    """What a step led to."""

    reward: float
    terminated: bool
    truncated: bool
    info: dict[str, float]


class Seen:
    """What the sensors of several environments measured: pictures as arrays with the environments as their first axis,
    and of each environment its lane and contacts, as `Task.outcome` reads them. ``device``: that of the pictures, as
    `relief.capture` has it."""

    def __init__(self, sims: Sequence[relief.Sim], device: str = "cpu") -> None:
        names = [f"ego/{own}" for own in (CAMERA, LANE, TOUCH)]
        if device == "cpu":
            self.camera, lanes, contacts = relief.capture_columns(sims, names)
        else:
            self.camera = cuda.pictures(sims, names[0], device, scale=SCALE)
            lanes, contacts = relief.capture_columns(sims, names[1:], without=names[:1])
        rows = zip(*(column.tolist() for column in lanes.values()))
        self._each = [{names[1]: SimpleNamespace(**dict(zip(lanes, row))), names[2]: []} for row in rows]
        for world, depth in zip(contacts["world"].tolist(), contacts["depth"].tolist()):
            self._each[world][names[2]].append(SimpleNamespace(depth=depth))

    def __getitem__(self, i: int) -> dict[str, Any]:
        return self._each[i]

    @property
    def log_depth(self) -> Any:
        """Depths by `log_depth`, uint8 (N, H, W, 1)."""
        if isinstance(self.camera, cuda.CudaBatch):
            return self.camera.depth_steps.with_channel()
        return log_depth(self.camera.depth)[..., None]


def frame_steps(sim: relief.Sim) -> int:
    """Steps of a world's clock for one of an environment: 6 of 1/60 s; at least 1."""
    return max(1, round(FRAME_SECONDS / sim.step_seconds))


def check_actions(actions: object, shape: tuple[int, ...]) -> np.ndarray:
    """Actions as float32 of a shape. Raises ValueError."""
    try:
        asked = np.asarray(actions)
        if asked.dtype.kind not in "biuf":
            raise TypeError
        with np.errstate(over="ignore") if asked.dtype != np.float32 else contextlib.nullcontext():  # refused below
            given = asked.astype(np.float32)
    except (TypeError, ValueError):
        raise ValueError(f"actions: expected numbers of shape {shape}, found {type(actions).__name__}") from None
    if given.shape != shape:
        raise ValueError(f"actions: expected shape {shape}, found {given.shape}")
    if not np.isfinite(given).all():
        raise ValueError(f"actions: expected finite numbers, found {given.ravel()[~np.isfinite(given.ravel())][0]}")
    return given


def log_depth(depth: np.ndarray) -> np.ndarray:
    """Depths in metres, of any shape, as uint8: 1 at the nearest of `DEPTH_RANGE` and nearer, 254 at its farthest and
    farther, even steps of the logarithm between; 255 where there is nothing."""
    return _relief.depth_steps(depth, SCALE) if depth.dtype == np.float32 else _log_depth(depth)


def _log_depth(depth: np.ndarray) -> np.ndarray:
    near, far = DEPTH_RANGE
    share = np.log(np.clip(depth, near, far) / near) * (1.0 / math.log(far / near))
    return np.where(np.isfinite(depth), 1.0 + np.rint(253.0 * share), 255.0).astype(np.uint8)


def _scale() -> np.ndarray:
    """By bisection: positive numbers are in the order of their bits."""
    low, high = (np.full(253, own, np.float32).view(np.uint32) for own in DEPTH_RANGE)
    while (high - low > 1).any():
        middle = (low + high) // 2
        is_there = _log_depth(middle.view(np.float32)) >= np.arange(2, 255)
        low, high = np.where(is_there, low, middle), np.where(is_there, middle, high)
    return high.view(np.float32)


#: Of each byte from 2 to 254 the least depth that is it, float32.
SCALE = _scale()


class Task:
    """To drive along a lane, as far as possible.

    Actions: steering and pedal, float32 (2,), −1 to 1: left is positive; above 0 the throttle, below 0 the brake.

    Rewards: speed along the lane / speed limit, at most 1, − ½ · |offset from the middle| / (half a lane) − 0.05 ·
    |change of the steering|. A step is `FRAME_SECONDS`. The episode is terminated where the vehicle leaves its lane or touches
    something, and truncated after a minute.
    """

    #: The scene's file below ``relief.assets()``.
    scene = "envs/lane_follow.ron"
    #: Where it may begin: names of routes; empty: any.
    routes: tuple[str, ...] = ()
    #: Seconds until an episode is truncated.
    seconds = 60.0
    #: The camera's outputs.
    outputs: tuple[str, ...] = ("color",)
    #: From the middle of the vehicle's rear axle: left, up and forward, metres.
    eye = (0.0, 1.3, 3.5)
    #: Of the camera, downward, and from the upper to the lower edge of its picture, degrees.
    down_degrees, fov_y_degrees = 8.0, 70.0
    #: Whether it may begin in any lane, not in the rightmost alone.
    all_lanes = False

    def __init__(self, *, size: tuple[int, int] = (84, 84)) -> None:
        try:
            width, height = (operator.index(side) for side in size)
        except (TypeError, ValueError):
            raise ValueError(f"size: expected width and height in whole pixels, found {size!r}") from None
        if not (1 <= width <= 4096 and 1 <= height <= 4096):
            raise ValueError(f"size: expected 1 to 4096 pixels along each side, found {size}")
        self.size = (width, height)

    def load(self) -> relief.Sim:
        """The world that all others are made from."""
        return relief.Sim(relief.assets() / self.scene)

    def observation_space(self) -> spaces.Space[Any]:
        """Of one environment."""
        width, height = self.size
        return spaces.Box(0, 255, (height, width, 3), np.uint8)

    def action_space(self) -> spaces.Space[Any]:
        """Of one environment."""
        return spaces.Box(-1.0, 1.0, (2,), np.float32)

    def begin(self, sim: relief.Sim, random: np.random.Generator) -> Episode:
        """Begins an episode in a world: the same numbers, the same episode."""
        sim.reset(seed=int(random.integers(2**31)))
        unknown = set(self.routes) - {route.name for route in sim.routes}
        if unknown:
            known = ", ".join(route.name for route in sim.routes)
            raise ValueError(f"{sim.name}: no route {min(unknown)!r}; expected one of: {known}")
        routes = [route for route in sim.routes if self.is_road(route)]
        if not routes:
            raise ValueError(f"{sim.name}: expected a route for cars, of {SHORTEST_ROUTE:g} m and more")
        route = routes[int(random.integers(len(routes)))]
        lane = int(random.integers(route.lanes)) if self.all_lanes else 0
        along = self.free_place(sim, route, lane, random)
        every = frame_steps(sim)
        ego = sim.spawn_vehicle("car", route=route.name, lane=lane, along=along, name="ego", manual=True)
        ego.add_camera(
            CAMERA,
            size=self.size,
            at=self.eye,
            pitch=-math.radians(self.down_degrees),
            fov_y_degrees=self.fov_y_degrees,
            outputs=self.outputs,
            samples=1,
            every=every,
        )
        ego.add_lane(LANE, at=(0.0, 0.0, 0.0), every=every)
        ego.add_collision(TOUCH, every=every)
        return Episode(sim, ego, speed_limits=[max(route.speed_limit, SLOWEST_ROAD) for route in sim.routes])

    def is_road(self, route: relief.Route) -> bool:
        """Whether a vehicle may begin there: long enough, and no footpath."""
        is_wanted = not self.routes or route.name in self.routes
        return is_wanted and route.length >= SHORTEST_ROUTE and route.speed_limit >= SLOWEST_ROAD

    def free_place(self, sim: relief.Sim, route: relief.Route, lane: int, random: np.random.Generator) -> float:
        """Metres along a route at which nothing is near: of 64 places at random the one farthest from all others."""
        length = route.length if route.closed else route.length - SHORTEST_ROUTE / 2.0
        along = random.uniform(0.0, length, 64)
        others = np.array([vehicle.position for vehicle in sim.vehicles]).reshape(-1, 3)
        if not len(others):
            return float(along[0])
        places = route.points(along.tolist(), lane)
        nearest = np.linalg.norm(places[:, None] - others[None], axis=2).min(axis=1)
        # The first with room enough, so that some begin close behind others.
        free = np.flatnonzero(nearest > 14.0)
        return float(along[free[0] if len(free) else nearest.argmax()])

    def act(self, episode: Episode, action: np.ndarray) -> None:
        """Asks the vehicle for an action."""
        steer, pedal = (min(max(part, -1.0), 1.0) for part in check_actions(action, (2,)).tolist())
        episode.turned = abs(steer - episode.steer)
        episode.steer, episode.pedal = steer, pedal
        episode.ego.drive(steer=steer, throttle=max(pedal, 0.0), brake=max(-pedal, 0.0))
        episode.steps += 1

    def observe(self, episode: Episode, capture: relief.Capture) -> object:
        """What the vehicle sees, in arrays that nothing else has."""
        return capture[f"ego/{CAMERA}"].color

    def observe_all(self, episodes: Sequence[Episode], seen: Seen) -> object:
        """The same of several environments, in arrays with these as their first axis. Of a task that has another
        `observe`, and no `observe_all` of its own, each environment is asked."""
        return seen.camera.color

    @property
    def is_seen_together(self) -> bool:
        """Whether arrays of all environments tell what captures of each would: `outcome` needs no more, and
        `observe_all` is as new as `observe`."""
        kinds = [vars(self), *map(vars, type(self).__mro__)]
        newest = {name: next(i for i, own in enumerate(kinds) if name in own) for name in ("observe", "observe_all")}
        is_own = getattr(self.outcome, "__func__", None) is Task.outcome
        return is_own and newest["observe_all"] <= newest["observe"]

    def outcome(self, episode: Episode, capture: relief.Capture | Mapping[str, Any]) -> Outcome:
        """What the last step led to."""
        lane = capture[f"ego/{LANE}"]
        half_width = lane.width / 2.0 if lane.valid else 1.0
        off = min(abs(lane.offset) / half_width, 1.0) if lane.valid else 1.0
        along = lane.speed * math.cos(lane.heading_error) if lane.valid else 0.0
        # Faster than the limit is not better.
        reward = min(along / episode.speed_limit(lane), 1.0) - 0.5 * off - 0.05 * episode.turned
        touches = any(contact.depth > 0.0 for contact in capture[f"ego/{TOUCH}"])
        # Where there are several lanes the sensor tells the nearest: beyond its edge is beside the road.
        left = not lane.valid or off >= 1.0
        info = {"speed": lane.speed, "offset": lane.offset, "progress": along * episode.frame_seconds}
        # The last step that ends within the seconds, though its end is rounded.
        late = episode.steps >= self.seconds / episode.frame_seconds - 1e-6
        terminated = bool(left or touches)
        return Outcome(float(reward), terminated, bool(late and not terminated), info)


class LaneFollow(Task):
    """One car on a road of many bends. Observations: what it sees, uint8 (H, W, 3).

    Tyres hold 7 m/s² sideways: in the sharpest bends, of 9 m, no more than 8 m/s. The speed limit is 11.1 m/s.
    """


class Traffic(Task):
    """Three lanes with traffic, and signals.

    Observations: a dictionary of ``camera`` uint8 (H, W, 3), ``depth`` uint8 (H, W, 1) by `log_depth`, and ``state``
    float32 (8,), each from −1 to 1: speed / limit, offset / half a lane, heading error / π, curvature · 20 m, lane / 4,
    the last steering and pedal, and whether there is a lane.
    """

    scene = "envs/traffic.ron"
    outputs = ("color", "depth")
    all_lanes = True

    def observation_space(self) -> spaces.Space[Any]:
        width, height = self.size
        return spaces.Dict(
            {
                "camera": spaces.Box(0, 255, (height, width, 3), np.uint8),
                "depth": spaces.Box(0, 255, (height, width, 1), np.uint8),
                "state": spaces.Box(-1.0, 1.0, (8,), np.float32),
            }
        )

    def observe(self, episode: Episode, capture: relief.Capture) -> object:
        camera = capture[f"ego/{CAMERA}"]
        state = np.array(self._state(episode, capture), np.float32)
        return self._observation(camera.color, log_depth(camera.depth)[..., None], state)

    def observe_all(self, episodes: Sequence[Episode], seen: Seen) -> object:
        states = [self._state(episode, seen[i]) for i, episode in enumerate(episodes)]
        return self._observation(seen.camera.color, seen.log_depth, np.array(states, np.float32))

    def _state(self, episode: Episode, capture: relief.Capture | Mapping[str, Any]) -> list[float]:
        lane = capture[f"ego/{LANE}"]
        return [
            lane.speed / episode.speed_limit(lane),
            2.0 * lane.offset / lane.width if lane.valid else 0.0,
            lane.heading_error / math.pi,
            20.0 * lane.curvature,
            lane.lane / 4.0,
            episode.steer,
            episode.pedal,
            1.0 if lane.valid else -1.0,
        ]

    def _observation(self, color: Any, depth: Any, states: np.ndarray) -> dict[str, Any]:
        return {"camera": color, "depth": depth, "state": np.clip(states, -1.0, 1.0)}


class Town(Traffic):
    """A town with its traffic at night, for benchmarks: any street, any lane."""

    scene = "scenes/town.ron"


#: All tasks by the ids of their environments.
TASKS: dict[str, type[Task]] = {
    "relief/LaneFollow-v0": LaneFollow,
    "relief/Traffic-v0": Traffic,
    "relief/Town-v0": Town,
}


def task_of(task: str | Task, **options: Any) -> Task:
    """A task by the id of its environment. Raises ValueError."""
    if isinstance(task, Task):
        if options:
            raise ValueError(f"expected no options beside a task, found {', '.join(options)}")
        return task
    kind = TASKS.get(task) if isinstance(task, str) else None
    if kind is None:
        raise ValueError(f"unknown environment {task!r}; expected a Task, or one of: {', '.join(TASKS)}")
    known = list(inspect.signature(kind).parameters)
    for name in options:
        if name not in known:
            raise ValueError(f"unknown option {name!r} of {task}; expected one of: {', '.join(known)}")
    return kind(**options)
