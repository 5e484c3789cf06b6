"""The example that learns to keep a lane learns it in few generations."""

import numpy as np

from conftest import needed

needed("gymnasium")

import relief  # noqa: E402
from relief.envs import learn_lane  # noqa: E402

#: Episodes of 7 s.
ENVIRONMENTS, STEPS, GENERATIONS = 16, 70, 4
#: The share of starts from which the lane is kept to the end. Straight ahead keeps it from none. Of thirty seeds the
#: least came to 0.56, all but two to 0.8 and more. Roundings of drivers change which policies are chosen, as a seed
#: does, so the bar is well below.
BAR = 0.3


def test_the_lane_is_kept_where_straight_ahead_leaves_it():
    env = relief.make_vec("relief/LaneFollow-v0", ENVIRONMENTS, size=(learn_lane.SIDE, learn_lane.SIDE))
    mean = learn_lane.learn(env, STEPS, generations=GENERATIONS, seed=0)
    shares = []
    for policy in (np.zeros_like(mean), mean):
        # Starts that were not learned from.
        _, _, kept = learn_lane.drive(env, np.tile(policy, (ENVIRONMENTS, 1)), 1_000_000, STEPS)
        shares.append(float(kept.mean()))
    env.close()
    assert shares[0] == 0.0 and shares[1] >= BAR, f"straight ahead {shares[0]:.0%}, learned {shares[1]:.0%}"
