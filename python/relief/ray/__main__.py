"""The command line: ``python -m relief.ray``."""

from __future__ import annotations

import argparse
import os
import re
import sys
from collections.abc import Callable
from pathlib import Path

try:
    import ray
except ImportError:
    print("error: no Ray; expected pip install 'relief[ray]'", file=sys.stderr)
    sys.exit(2)

from .cluster import BadInput, TaskError, connect
from .shards import BAD_INPUT, INCOMPLETE, count_of_shards, merge, render

#: Exit code of programs that the keyboard has interrupted: 128, and the number of the signal.
INTERRUPTED = 130
#: Of a first episode: files hold seeds of 64 bits, and more episodes follow.
MOST_SEED = 2**62


def _show(things: str) -> Callable[[int, int], None]:
    """Reports how many are done."""
    return lambda done, of: print(f"{done} of {of} {things}", file=sys.stderr, flush=True)


def _render(args: argparse.Namespace) -> int:
    job = str(Path(args.job).absolute())
    count = count_of_shards(job)
    # Workers have folders of their own. A bare name is looked for in the path.
    relief = str(Path(args.relief).absolute()) if args.relief and os.sep in args.relief else args.relief
    _connect(args)
    code = INCOMPLETE
    for _ in range(args.rounds):
        # Those that are whole are no more than checked.
        render(job, range(count), relief, cpus=args.cpus, gpus=args.gpus, report=_show("shards"))
        code, said = merge(job, args.output, relief, ["--mixed"] if args.mixed else [])
        if said:
            print(said, file=sys.stderr, flush=True)
        if code != INCOMPLETE:
            break
    return code


def _rollouts(args: argparse.Namespace) -> int:
    try:
        from .rollouts import Settings, claim, policy_of, rollouts
    except ImportError as error:
        raise BadInput(str(error)) from None
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
    connect(args.address, args.workers, cpus=args.cpus, gpus=args.gpus)


def _count(text: str) -> int:
    value = int(text)
    if value < 1:
        raise ValueError
    return value


def _seed(text: str) -> int:
    value = int(text)
    if not 0 <= value <= MOST_SEED:
        raise ValueError
    return value


def _share(text: str) -> float:
    """Of processors or GPUs, as Ray takes it."""
    value = float(text)
    if not (0.0 <= value <= 1.0 or value > 1.0 and value.is_integer()):
        raise ValueError
    return value


def _cpus(text: str) -> float:
    value = _share(text)
    if value == 0.0:
        raise ValueError
    return value


def _size(text: str) -> tuple[int, int]:
    found = re.fullmatch(r"([1-9]\d{0,3})x([1-9]\d{0,3})", text)
    if not found:
        raise ValueError
    return int(found[1]), int(found[2])


# What argparse calls them where they are something else.
_count.__name__, _seed.__name__, _size.__name__ = "number of at least 1", f"number of 0 to {MOST_SEED}", "WIDTHxHEIGHT"
_share.__name__, _cpus.__name__ = "share (0 to 1) or whole number", "share (above 0, up to 1) or whole number"


def main(arguments: list[str] | None = None) -> int:
    """The command line. Returns the exit code."""
    cluster = argparse.ArgumentParser(add_help=False)
    which = cluster.add_mutually_exclusive_group()
    which.add_argument("--address", help="of the cluster: auto, HOST:PORT, ray://… [default: one on this machine]")
    which.add_argument("--workers", type=_count, help="CPUs of the cluster on this machine [default: all]")
    cluster.add_argument("--gpus", type=_share, default=0, help="GPUs that a task takes [default: 0]")
    parser = argparse.ArgumentParser(prog="python -m relief.ray", description="Work for a Ray cluster")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    of_render = commands.add_parser(
        "render", parents=[cluster], help="render the shards of a job, and put them together"
    )
    of_render.set_defaults(command=_render)
    of_render.add_argument("job", help="folder that relief split has made, seen by all machines")
    of_render.add_argument("-o", "--output", help="folder of what is put together [default: merged, in the job's]")
    of_render.add_argument("--cpus", type=_cpus, default=1, help="CPUs that a shard takes [default: 1]")
    of_render.add_argument("--relief", help="the program, on all machines [default: the package's]")
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
    except KeyboardInterrupt:
        print("interrupted; the same command goes on", file=sys.stderr)
        return INTERRUPTED
    finally:
        ray.shutdown()


if __name__ == "__main__":
    sys.exit(main())
