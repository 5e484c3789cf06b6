"""Traffic without pictures in highway-env: python highway_traffic.py [--rounds N].

50 vehicles of its `highway-v0`, whose step is a second in 15 steps of its simulation; observations are the places and
speeds of the five nearest.
"""

import gymnasium
import highway_env  # noqa: F401, registers the environment

import traffic


def make():
    env = gymnasium.make("highway-v0", config={"vehicles_count": traffic.VEHICLES, "duration": 10_000})
    env.reset(seed=0)

    def step():
        _, _, terminated, truncated, _ = env.step(1)
        if terminated or truncated:
            env.reset()
        return 1.0

    return step


traffic.run("highway-env", make)
