"""Episodes that a policy drives: those of single environments, in files that are whole or not there."""

import numpy as np
import pytest

from conftest import needed

gymnasium = needed("gymnasium")

from relief.envs import DrivingEnv  # noqa: E402
from relief.envs.rollouts import Worlds, at_random, read  # noqa: E402

SIZE = (16, 12)


def weaving(observations, random):
    """Turns the wheel at random, and drives on: most episodes end within seconds."""
    camera = observations["camera"] if isinstance(observations, dict) else observations
    assert camera.shape == (len(random), SIZE[1], SIZE[0], 3)
    return [(own.uniform(-1.0, 1.0), 0.4 + camera[i].mean() / 1000.0) for i, own in enumerate(random)]


@pytest.mark.parametrize("task", ["relief/LaneFollow-v0", "relief/Traffic-v0"])
def test_episodes_are_those_of_single_environments(task):
    worlds = Worlds(task, 3, size=SIZE)
    rollouts = {own.seed: own for own in worlds.episodes(weaving, range(7, 12), most_steps=40)}
    assert sorted(rollouts) == [7, 8, 9, 10, 11]
    assert len({len(own.rewards) for own in rollouts.values()}) > 1, "all ended at once: none began while others drove"
    env = DrivingEnv(task, size=SIZE)
    for seed, rollout in rollouts.items():
        seen = [env.reset(seed=seed)[0]]
        for step, action in enumerate(rollout.actions):
            observation, reward, terminated, truncated, info = env.step(action)
            seen.append(observation)
            late = step == 39
            assert reward == rollout.rewards[step]
            assert terminated == rollout.terminations[step]
            assert (truncated or (late and not terminated)) == rollout.truncations[step]
            assert {name: own[step] for name, own in rollout.infos.items()} == info
        assert rollout.terminations[-1] or rollout.truncations[-1]
        if isinstance(rollout.observations, dict):
            for name, own in rollout.observations.items():
                np.testing.assert_array_equal(own, np.stack([one[name] for one in seen]))
        else:
            np.testing.assert_array_equal(rollout.observations, np.stack(seen))
    env.close()
    worlds.close()


def test_an_episode_does_not_depend_on_others():
    worlds = Worlds("relief/LaneFollow-v0", 2, size=SIZE)
    (alone,) = worlds.episodes(at_random, [5], most_steps=12)
    (among,) = (own for own in worlds.episodes(at_random, [3, 4, 5], most_steps=12) if own.seed == 5)
    np.testing.assert_array_equal(alone.actions, among.actions)
    np.testing.assert_array_equal(alone.observations, among.observations)
    (other,) = worlds.episodes(at_random, [6], most_steps=12)
    assert (alone.actions != other.actions).all()
    worlds.close()


def test_files_are_whole_or_not_there(tmp_path, monkeypatch):
    worlds = Worlds("relief/Traffic-v0", 1, size=SIZE)
    (rollout,) = worlds.episodes(at_random, [1], most_steps=4)
    worlds.close()
    path = tmp_path / "1.npz"
    rollout.save(path)
    first = path.read_bytes()
    again = read(path)
    assert again.seed == 1 and again.observations.keys() == {"camera", "depth", "state"}
    np.testing.assert_array_equal(again.observations["camera"], rollout.observations["camera"])
    np.testing.assert_array_equal(again.infos["progress"], rollout.infos["progress"])
    again.save(path)
    assert path.read_bytes() == first, "the same episode is the same file"
    for cut in (0, 10, len(first) // 2, len(first) - 1):
        path.write_bytes(first[:cut])
        with pytest.raises(ValueError, match="1.npz: expected an episode"):
            read(path)
    # Some bytes of a zip file are dates and the like, which tell nothing.
    damaged = 0
    for at in range(0, len(first), len(first) // 97):
        path.write_bytes(first[:at] + bytes([first[at] ^ 0x55]) + first[at + 1 :])
        try:
            again = read(path)
            assert (again.observations["camera"] == rollout.observations["camera"]).all()
            assert (again.rewards == rollout.rewards).all() and (again.actions == rollout.actions).all()
        except ValueError as error:
            assert "1.npz: expected an episode" in str(error)
            damaged += 1
        except OSError:  # of places that are not in the file
            damaged += 1
    assert damaged > 40
    with pytest.raises(FileNotFoundError):
        rollout.save(tmp_path / "nowhere" / "1.npz")

    def full(file, **arrays):
        file.write(b"PK")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np, "savez_compressed", full)
    with pytest.raises(OSError, match="No space"):
        rollout.save(path)
    assert [found.name for found in tmp_path.iterdir()] == ["1.npz"]


def test_errors():
    with pytest.raises(ValueError, match="together: expected at least 1, found 0"):
        Worlds("relief/LaneFollow-v0", 0)
    worlds = Worlds("relief/LaneFollow-v0", 2, size=SIZE)
    with pytest.raises(ValueError, match=r"actions: expected shape \(2, 2\), found \(2,\)"):
        list(worlds.episodes(lambda seen, random: np.zeros(2), [1, 2]))
    assert list(worlds.episodes(at_random, [])) == []
    with pytest.raises(ValueError, match="most_steps: expected at least 1, found 0"):
        list(worlds.episodes(at_random, [1], most_steps=0))
    # A call that has given its worlds to the next one does not go on in them.
    first = worlds.episodes(at_random, [1, 2, 3], most_steps=2)
    next(first)
    assert len(list(worlds.episodes(at_random, [4, 5], most_steps=2))) == 2
    with pytest.raises(RuntimeError, match="another call of episodes"):
        list(first)
    worlds.close()
