"""Shards of a run, rendered on a Ray cluster: ``python -m relief.ray render JOB``.

``relief split`` makes the job; every machine of the cluster sees its folder. Each shard is a task that runs the program
``relief``, so Ray hands them out as machines get free, and begins those anew whose machines are lost. A shard is there
when it is whole; doing one twice is harmless. At the end ``relief merge`` checks everything and puts it together; what
it finds missing or damaged is rendered again. See docs/many_machines.md.

This needs Ray (``pip install ray``) and the program.
"""

import argparse
import ctypes
import signal
import subprocess
import sys
from collections import deque
from pathlib import Path

import ray

BAD_INPUT = 2
"""Exit code of ``relief`` for what no machine can do."""
INCOMPLETE = 4
"""Exit code of ``relief merge`` where shards are missing or damaged."""


class ShardError(RuntimeError):
    """A shard that could not be rendered, with the message of ``relief``."""


def _ending_with_parent():
    """What a child does first, so that it ends when its parent does: else it would go on where a worker is killed."""
    if sys.platform != "linux":
        return None
    # Found before the fork: after it, as little as can be.
    prctl = ctypes.CDLL(None).prctl
    of_death = 1  # PR_SET_PDEATHSIG of prctl(2)
    return lambda: prctl(of_death, signal.SIGKILL)


@ray.remote(max_retries=5)
def _render(relief, job, shard):
    """Renders a shard. Returns the exit code and what was said."""
    command = [relief, "render", "--shard", f"{job}/shards.json:{shard}", "--resume"]
    done = subprocess.run(command, capture_output=True, text=True, preexec_fn=_ending_with_parent())
    return done.returncode, done.stderr.strip()


def render(job, shards, relief="relief", cpus=1, gpus=0, attempts=3, report=lambda done, of: None):
    """Renders shards of a job on the cluster that Ray is connected to. Those that are there and whole stay.

    Args:
        job: folder of ``relief split``, the same path on all machines.
        shards: numbers of shards.
        relief: the program, on all machines.
        cpus, gpus: what a shard takes of a machine; numbers below 1 share a GPU.
        attempts: how often a shard is tried that fails by itself; one whose machine is lost is begun anew besides.
        report: called after each shard with how many are done, and of how many.

    Raises:
        ShardError: bad input, at once; anything else after all attempts.
    """
    task = _render.options(num_cpus=cpus, num_gpus=gpus)
    waiting = deque((shard, 1) for shard in shards)
    running = {}
    done, of = 0, len(waiting)
    # So many at once that a cluster which grows has always some to take; not all of 10,000, which are asked about often.
    most = max(64, 4 * int(ray.cluster_resources().get("CPU", 1)))
    while waiting or running:
        while waiting and len(running) < most:
            shard, attempt = waiting.popleft()
            running[task.remote(relief, job, shard)] = (shard, attempt)
        for ready in ray.wait(list(running), num_returns=1)[0]:
            shard, attempt = running.pop(ready)
            try:
                code, said = ray.get(ready)
            except ray.exceptions.RayError as error:
                code, said = 1, str(error)
            if code == 0:
                done += 1
                report(done, of)
            elif code == BAD_INPUT or attempt >= attempts:
                for other in running:
                    ray.cancel(other, force=True)
                raise ShardError(f"shard {shard}: {said or f'relief ended with exit code {code}'}")
            else:
                print(f"shard {shard}, attempt {attempt} of {attempts}: {said}", file=sys.stderr, flush=True)
                waiting.append((shard, attempt + 1))


def merge(job, output=None, relief="relief", more=()):
    """Puts the shards of a job together. Returns the exit code, and what was said on standard error.

    Args:
        output: folder, new or empty; by default ``JOB/merged``.
        more: options of ``relief merge``.
    """
    command = [relief, "merge", job, *(["-o", output] if output else []), *more]
    done = subprocess.run(command, stderr=subprocess.PIPE, text=True)
    return done.returncode, done.stderr.strip()


def count_of_shards(job):
    """How many shards a job has."""
    import json

    return len(json.loads(Path(job, "shards.json").read_text())["shards"])


def main(arguments=None):
    """The command line. Returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m relief.ray", description=__doc__.split("\n")[0])
    commands = parser.add_subparsers(required=True)
    of_render = commands.add_parser("render", help="render the shards of a job, and put them together")
    of_render.add_argument("job", help="folder that relief split has made, seen by all machines")
    of_render.add_argument("-o", "--output", help="folder of what is put together [default: merged, in the job's]")
    of_render.add_argument("--address", help="of the cluster: auto, HOST:PORT, ray://… [default: one on this machine]")
    of_render.add_argument("--workers", type=int, help="CPUs of the cluster on this machine [default: all]")
    of_render.add_argument("--cpus", type=float, default=1, help="CPUs that a shard takes [default: 1]")
    of_render.add_argument("--gpus", type=float, default=0, help="GPUs that a shard takes [default: 0]")
    of_render.add_argument("--relief", default="relief", help="the program, on all machines [default: relief]")
    of_render.add_argument("--rounds", type=int, default=3, help="how often what is damaged is rendered [default: 3]")
    of_render.add_argument("--mixed", action="store_true", help="take shards of different kinds of machines")
    args = parser.parse_args(arguments)

    job = str(Path(args.job).absolute())
    try:
        count = count_of_shards(job)
    except (OSError, ValueError, KeyError, TypeError) as error:
        print(f"error: {job}/shards.json: {error}", file=sys.stderr)
        return BAD_INPUT
    of_cluster = {"address": args.address} if args.address else {"num_cpus": args.workers}
    ray.init(log_to_driver=False, **of_cluster)
    show = lambda done, of: print(f"{done} of {of} shards", file=sys.stderr, flush=True)
    try:
        for _ in range(args.rounds):
            # Those that are whole are no more than checked.
            render(job, range(count), args.relief, args.cpus, args.gpus, report=show)
            code, said = merge(job, args.output, args.relief, ["--mixed"] if args.mixed else [])
            if said:
                print(said, file=sys.stderr, flush=True)
            if code != INCOMPLETE:
                break
        return code
    except ShardError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    finally:
        ray.shutdown()


if __name__ == "__main__":
    sys.exit(main())
