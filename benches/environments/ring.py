"""What all programs of this folder share: cars on a ring of three lanes, as boxes, and a loop that measures steps.

A step of an environment is 0.1 s in six steps of the simulation; then one camera's colours, depths and ids of what is
where, 84 by 84 pixels, and a reward. Axes are those of the program; lengths are metres.
"""

import argparse
import json
import time

import numpy as np

CARS = 50
LANES = (96.5, 100.0, 103.5)  # radii
BOX = (1.8, 1.5, 4.0)  # width, height, length
SIZE = 84
FOV_Y_DEGREES = 60.0
NEAR, FAR = 0.1, 400.0
EYE = (1.6, 0.5)  # of the first car's camera: height, and ahead of its middle
SECONDS, STEPS = 1 / 60, 6
LIMIT = 60 / 3.6


class Ring:
    """Cars that follow each other by the Intelligent Driver Model (Treiber, Hennecke, Helbing, 2000)."""

    def __init__(self, seed):
        random = np.random.default_rng(seed)
        self.lane = np.arange(CARS) % len(LANES)
        self.radius = np.array(LANES)[self.lane]
        per_lane = -(-CARS // len(LANES))
        self.angle = (np.arange(CARS) // len(LANES) + random.uniform(0, 0.3, CARS)) * 2 * np.pi / per_lane
        self.speed = random.uniform(5, 15, CARS)

    def step(self, throttle):
        """Takes a step of the simulation; the first car is driven."""
        acceleration = np.empty(CARS)
        for lane in range(len(LANES)):
            cars = np.flatnonzero(self.lane == lane)
            order = cars[np.argsort(self.angle[cars])]
            ahead = np.roll(order, -1)
            gap = ((self.angle[ahead] - self.angle[order]) % (2 * np.pi)) * LANES[lane] - BOX[2]
            speed, closing = self.speed[order], self.speed[order] - self.speed[ahead]
            wanted = 2 + np.maximum(0, 1.2 * speed + speed * closing / (2 * np.sqrt(1.5 * 2)))
            acceleration[order] = 1.5 * (1 - (speed / LIMIT) ** 4 - (wanted / np.maximum(gap, 0.1)) ** 2)
        acceleration[0] = 3 * throttle
        self.speed = np.maximum(self.speed + acceleration * SECONDS, 0)
        self.angle = (self.angle + self.speed / self.radius * SECONDS) % (2 * np.pi)

    def places(self):
        """Middles of the cars on the ground, (N, 2), and the ways that they go."""
        sin, cos = np.sin(self.angle), np.cos(self.angle)
        return np.stack([cos, sin], axis=1) * self.radius[:, None], self.angle + np.pi / 2


def run(program, make):
    """`make(environments)` gives a function that steps all of them once, and returns arrays and rewards."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--environments", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=3.0, help="how long a round takes at least")
    parser.add_argument("--rounds", type=int, default=3)
    args = parser.parse_args()
    step = make(args.environments)
    for _ in range(5):
        step()
    for number in range(args.rounds):
        steps, wall, processor = 0, time.perf_counter(), time.process_time()
        while steps == 0 or time.perf_counter() - wall < args.seconds:
            step()
            steps += args.environments
        wall, processor = time.perf_counter() - wall, time.process_time() - processor
        figures = {"program": program, "environments": args.environments, "round": number}
        print(json.dumps(figures | {"steps_per_second": steps / wall, "cpu_ms": 1e3 * processor / steps}), flush=True)
