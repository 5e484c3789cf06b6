"""Random calls with sound and unsound arguments: each gives a value or raises an error of its kind, never a panic."""

import math
import os
import random

import relief

CALLS = int(os.environ.get("RELIEF_RANDOM_CALLS", "100000"))
FINE = (relief.Error, ValueError, TypeError, KeyError, AttributeError, OverflowError, IndexError)


def number(r):
    return r.choice([0, 1, -1, 0.5, r.uniform(-50, 50), 1e30, -1e300, math.nan, math.inf, 2**40, "x", None, 3, 7, 12])


def point(r):
    if r.random() < 0.7:
        return (r.uniform(-40, 40), r.uniform(0, 3), r.uniform(-40, 40))
    return r.choice([(0, 0), "abc", None, (1, 2, "3"), tuple(number(r) for _ in range(r.randrange(5))), 5, {}])


def any_of(r, things):
    return r.choice(things) if things else None


class Calls:
    def __init__(self, r):
        self.r, self.sim, self.shots = r, relief.Sim(), []

    def entity(self):
        return any_of(self.r, self.sim.entities)

    def spawn(self):
        r, sim = self.r, self.sim
        if len(sim.entities) > 400:
            sim.reset()
        kind = r.choice(["vehicle", "vehicle", "light", "mesh"])
        if kind == "vehicle":
            types = [*sim.vehicle_types, "cat", ""]
            sim.spawn_vehicle(r.choice(types), point(r), yaw=number(r), manual=r.random() < 0.5, paint=r.randrange(9))
        elif kind == "light":
            make = r.choice([relief.Light.point, relief.Light.spot, relief.Light.directional])
            sim.spawn_light(make(number(r)), point(r), pitch=number(r))
        else:
            sim.spawn_mesh(r.choice(["box", "ball", "sun", "none", self.entity()]), point(r), scale=point(r))

    def mount(self):
        r = self.r
        on = r.choice([self.sim, self.entity() or self.sim])
        add = r.choice(["camera", "lidar", "imu", "gnss", "collision", "lane"])
        arguments = {"at": point(r), "every": r.choice([1, 2, 0, 7, "a"]), "phase": r.choice([0, 0, 1, 9])}
        if add == "camera":
            arguments |= r.choice([{}, {"K": (20, 20, number(r), 8)}, {"fov_y_degrees": number(r)}])
            arguments |= {"size": (r.randrange(0, 20), 12), "outputs": r.sample(
                ["color", "depth", "range", "normal", "instance", "class", "part", "boxes", "flow", "bad"][: r.randrange(1, 11)], 1)}
        elif add == "lidar":
            arguments |= {"columns": r.choice([36, 10, 0, -1]), "beams": r.choice(["vlp16", "os1_64", "?"])}
        getattr(on, f"add_{add}")(r.choice(["a", "b", "c", ""]), **arguments)

    def change(self):
        r, entity = self.r, self.entity()
        name = r.choice(["position", "transform", "hidden", "intensity", "range", "color", "enabled", "open", "manual"])
        value = r.choice([point(r), number(r), True, False, "#ff00ff", [[1, 0, 0, number(r)]] * 4, entity])
        if name == "transform" and r.random() < 0.5:
            value = entity.transform
        setattr(entity, name, value)

    def drive(self):
        r, vehicle = self.r, any_of(self.r, self.sim.vehicles)
        vehicle.drive(throttle=number(r), steer=number(r), brake=r.choice([0, 1, number(r)]))

    def read(self):
        r, entity = self.r, self.entity()
        name = r.choice([n for n in dir(entity) if not n.startswith("_")])
        value = getattr(entity, name)
        if callable(value) and name in ("place", "despawn"):
            value(*([point(r)] if name == "place" else []))

    def step(self):
        self.sim.step(self.r.choice([0, 1, 2, 5]))

    def capture(self):
        r = self.r
        capture = r.choice([self.sim.capture, self.sim.look])(*r.choice([(), ("a",), ("none",)]))
        for sensor in capture.values():
            getattr(sensor, r.choice(["color", "depth", "xyz", "valid", "boxes", "name"]))

    def keep(self):
        r = self.r
        what = r.randrange(6)
        if what == 0 or not self.shots:
            self.shots = [*self.shots[-3:], self.sim.snapshot()]
        elif what == 1:
            self.sim.restore(r.choice(self.shots))
        elif what == 2:
            shot = bytearray(r.choice(self.shots))
            shot[r.randrange(len(shot))] ^= 1 << r.randrange(8)
            self.sim.restore(bytes(shot))
        elif what == 3:
            self.sim = self.sim.fork()
        elif what == 4:
            self.sim.hash()
        else:
            self.sim.reset(seed=r.randrange(4))

    def one(self):
        calls = [self.spawn, self.mount, self.change, self.change, self.drive, self.read, self.read, self.step]
        weights = [3, 2, 4, 4, 6, 6, 6, 4]
        # Pictures and new worlds take longer than all else.
        call = self.r.choices([*calls, self.capture, self.keep], [*weights, 0.4, 0.8])[0]
        try:
            call()
        except FINE:
            pass


def test_random_calls_make_no_panic():
    r = random.Random(5)
    calls = Calls(r)
    for _ in range(CALLS):
        calls.one()
    assert calls.sim.step() >= 1
