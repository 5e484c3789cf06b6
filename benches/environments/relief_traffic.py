"""Traffic without pictures in Relief, one world on one thread: python relief_traffic.py [--rounds N].

The ring road of `relief/Traffic-v0`, some 50 vehicles with lane changes and signals, in steps of 1/60 s.
"""

import relief

import traffic


def make():
    relief.set_threads(1)
    sim = relief.Sim(relief.assets() / "envs" / "traffic.ron")
    assert len(sim.vehicles) >= traffic.VEHICLES

    def step():
        sim.step(60)
        return 1.0

    return step


traffic.run("relief", make)
