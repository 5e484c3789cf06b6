"""What programs of traffic without pictures share: a loop that measures simulated seconds a second."""

import argparse
import json
import time

VEHICLES = 50


def run(program, make):
    """`make()` gives a function that simulates a while, and returns how many seconds."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--seconds", type=float, default=3.0, help="how long a round takes at least")
    parser.add_argument("--rounds", type=int, default=3)
    args = parser.parse_args()
    step = make()
    for _ in range(5):
        step()
    for number in range(args.rounds):
        simulated, wall, processor = 0.0, time.perf_counter(), time.process_time()
        while simulated == 0.0 or time.perf_counter() - wall < args.seconds:
            simulated += step()
        wall, processor = time.perf_counter() - wall, time.process_time() - processor
        figures = {"program": program, "round": number, "simulated_seconds_per_second": simulated / wall}
        print(json.dumps(figures | {"cpu_ms_per_second": 1e3 * processor / simulated}), flush=True)
