"""The command line: ``python -m relief.ray``."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Callable
from pathlib import Path

try:
    import ray
except ImportError:
    print("error: no Ray; expected pip install 'relief[ray]'", file=sys.stderr)
    sys.exit(2)

from .cluster import BadInput, TaskError
from .shards import BAD_INPUT, INCOMPLETE, count_of_shards, merge, render


def _show(things: str) -> Callable[[int, int], None]:
    """Reports how many are done."""
    return lambda done, of: print(f"{done} of {of} {things}", file=sys.stderr, flush=True)


def _render(args: argparse.Namespace) -> int:
    job = str(Path(args.job).absolute())
    count = count_of_shards(job)
    _connect(args)
    code = INCOMPLETE
    for _ in range(args.rounds):
        # Those that are whole are no more than checked.
        render(job, range(count), args.relief, cpus=args.cpus, gpus=args.gpus, report=_show("shards"))
        code, said = merge(job, args.output, args.relief, ["--mixed"] if args.mixed else [])
        if said:
            print(said, file=sys.stderr, flush=True)
        if code != INCOMPLETE:
            break
    return code


def _rollouts(args: argparse.Namespace) -> int:
    try:
        from .rollouts import Settings, claim, policy_of, rollouts
    except ImportError as error:
        raise BadInput(f"{error}; expected pip install 'relief[gym]'") from None
    settings = Settings(
        environment=args.environment,
        policy=args.policy,
        seed=args.seed,
        size=args.size,
        most_steps=args.steps,
        together=args.together,
        by_task=args.by_task,
    )
    folder = Path(args.output).absolute()
    policy = policy_of(settings.policy)
    claim(folder, settings)
    _connect(args)
    summaries = rollouts(settings, policy, args.episodes, folder, cpus=args.cpus, gpus=args.gpus, report=_show("tasks"))
    rewards = [summary.reward for summary in summaries]
    steps = sum(summary.steps for summary in summaries)
    print(f"{folder}: {len(summaries)} episodes, {steps} steps, mean reward {sum(rewards) / len(rewards):.2f}")
    return 0


def _connect(args: argparse.Namespace) -> None:
    """To the cluster asked for, or to one of this machine."""
    ray.init(log_to_driver=False, **({"address": args.address} if args.address else {"num_cpus": args.workers}))


def _count(text: str) -> int:
    value = int(text)
    if value < 1:
        raise ValueError
    return value


def _seed(text: str) -> int:
    value = int(text)
    if value < 0:
        raise ValueError
    return value


def _size(text: str) -> tuple[int, int]:
    found = re.fullmatch(r"([1-9]\d{0,3})x([1-9]\d{0,3})", text)
    if not found:
        raise ValueError
    return int(found[1]), int(found[2])


# What argparse calls them where they are something else.
_count.__name__, _seed.__name__, _size.__name__ = "number of at least 1", "number of at least 0", "WIDTHxHEIGHT"


def main(arguments: list[str] | None = None) -> int:
    """The command line. Returns the exit code."""
    cluster = argparse.ArgumentParser(add_help=False)
    cluster.add_argument("--address", help="of the cluster: auto, HOST:PORT, ray://… [default: one on this machine]")
    cluster.add_argument("--workers", type=_count, help="CPUs of the cluster on this machine [default: all]")
    cluster.add_argument("--gpus", type=float, default=0, help="GPUs that a task takes [default: 0]")
    parser = argparse.ArgumentParser(prog="python -m relief.ray", description="Work for a Ray cluster")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    of_render = commands.add_parser(
        "render", parents=[cluster], help="render the shards of a job, and put them together"
    )
    of_render.set_defaults(command=_render)
    of_render.add_argument("job", help="folder that relief split has made, seen by all machines")
    of_render.add_argument("-o", "--output", help="folder of what is put together [default: merged, in the job's]")
    of_render.add_argument("--cpus", type=float, default=1, help="CPUs that a shard takes [default: 1]")
    of_render.add_argument("--relief", default="relief", help="the program, on all machines [default: relief]")
    of_render.add_argument("--rounds", type=_count, default=3, help="how often damaged ones are rendered [default: 3]")
    of_render.add_argument("--mixed", action="store_true", help="take shards of different kinds of machines")

    of_rollouts = commands.add_parser("rollouts", parents=[cluster], help="let a policy drive episodes")
    of_rollouts.set_defaults(command=_rollouts)
    of_rollouts.add_argument("environment", help="such as relief/LaneFollow-v0")
    of_rollouts.add_argument("-o", "--output", required=True, help="folder that all machines see: new, or to go on")
    of_rollouts.add_argument("--episodes", type=_count, required=True, help="how many")
    of_rollouts.add_argument(
        "--policy",
        default="relief.envs.rollouts:at_random",
        help="MODULE:FUNCTION of observations (N, …) and N random generators; returns actions (N, 2) "
        "[default: at random]",
    )
    of_rollouts.add_argument("--seed", type=_seed, default=0, help="of the first episode; each next has one more")
    of_rollouts.add_argument("--size", type=_size, default=(84, 84), help="of pictures, pixels [default: 84x84]")
    of_rollouts.add_argument("--steps", type=_count, help="of an episode, at most [default: as the environment has it]")
    of_rollouts.add_argument("--together", type=_count, default=16, help="episodes driven at a time [default: 16]")
    of_rollouts.add_argument("--by-task", type=_count, default=32, help="episodes of a task [default: 32]")
    of_rollouts.add_argument("--cpus", type=_count, default=1, help="CPUs that a task takes [default: 1]")

    args = parser.parse_args(arguments)
    try:
        code: int = args.command(args)
        return code
    except BadInput as error:
        print(f"error: {error}", file=sys.stderr)
        return BAD_INPUT
    except (TaskError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    finally:
        ray.shutdown()


if __name__ == "__main__":
    sys.exit(main())
