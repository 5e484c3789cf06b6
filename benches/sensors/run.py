"""Measures Relief's cameras and those of other programs in turn, and prints a table: python3 run.py [--help].

Needs Cargo, and pip for the other programs, each of which gets an environment of its own below the folder of what is
built. What cannot be installed or does not start is left out, aloud. README.md says what is measured.
"""

import argparse
import itertools
import json
import os
import shutil
import statistics
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
REPOSITORY = HERE.parent.parent
MODES = ("color", "color+depth", "color+depth+instance")

# By name in figures and files: script, further arguments, environment, modes that it has.
PROGRAMS = {
    "mujoco": ("mujoco_boxes.py", [], "mujoco", MODES),
    "mujoco-renderer": ("mujoco_boxes.py", ["--renderer"], "mujoco", MODES),
    "pybullet": ("pybullet_boxes.py", [], "pybullet", MODES),
    "pyrender": ("pyrender_boxes.py", [], "pyrender", MODES),
    "panda3d": ("panda3d_boxes.py", [], "panda3d", MODES),
    "panda3d-tiny": ("panda3d_boxes.py", ["--tiny"], "panda3d", MODES[:1]),
}


def say(text):
    print(text, file=sys.stderr, flush=True)


class Failed(Exception):
    """What a program said last."""


def output_of(commands):
    """Runs commands at the same time; the lines of JSON that each printed."""
    environment = os.environ | {"NODEVICE_SELECT": "1", "PYTHONDONTWRITEBYTECODE": "1"}
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    started = [subprocess.Popen([str(part) for part in command], env=environment, **pipes) for command in commands]
    ended = [(process.communicate(), process.returncode) for process in started]
    for command, ((_, complaint), code) in zip(commands, ended):
        if code != 0:
            last = complaint.strip().splitlines()[-1:] or [f"exit code {code}"]
            raise Failed(f"{command[1] if len(command) > 1 else command[0]}: {last[0]}")
    return [[json.loads(line) for line in out.splitlines() if line.startswith("{")] for (out, _), _ in ended]


def environment_of(name, folder):
    """Python with the packages of a file of requirements; None where they cannot be had."""
    wanted, home = HERE / "requirements" / f"{name}.txt", folder / "python" / name
    installed = home / "requirements.txt"
    python = home / "bin" / "python"
    if installed.exists() and installed.read_text() == wanted.read_text():
        return python
    say(f"installing {name} into {home}")
    shutil.rmtree(home, ignore_errors=True)
    install = [python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-deps"]
    for command in ([sys.executable, "-m", "venv", home], [*install, "--requirement", wanted]):
        if subprocess.run([str(part) for part in command]).returncode != 0:
            return None
    shutil.copy(wanted, installed)
    return python


def build():
    """Relief's benchmark as an executable."""
    say("building Relief")
    command = ["cargo", "bench", "--bench", "sensors", "--no-run", "--message-format", "json"]
    built = subprocess.run(command, cwd=REPOSITORY, stdout=subprocess.PIPE, text=True, check=True)
    messages = [json.loads(line) for line in built.stdout.splitlines() if line.startswith("{")]
    found = [
        message["executable"]
        for message in messages
        if message.get("reason") == "compiler-artifact"
        and message["target"]["name"] == "sensors"
        and "bench" in message["target"]["kind"]
    ]
    return Path(found[-1])


def arguments():
    parser = argparse.ArgumentParser(description="Measures cameras of Relief and of other programs in turn.")
    parser.add_argument("--boxes", type=int, nargs="+", default=[50])
    parser.add_argument("--sizes", type=int, nargs="+", default=[84, 128], help="pixels along both sides")
    parser.add_argument("--views", type=int, nargs="+", default=[1, 64], help="that Relief captures together")
    parser.add_argument("--modes", nargs="+", choices=MODES, default=MODES)
    parser.add_argument("--processes", type=int, nargs="+", default=[1], help="of the same program at the same time")
    parser.add_argument("--programs", nargs="*", choices=PROGRAMS, default=list(PROGRAMS), help="beside Relief")
    parser.add_argument("--seconds", type=float, default=2.0, help="how long each program draws in a round")
    parser.add_argument("--rounds", type=int, default=3)
    target = Path(os.environ.get("CARGO_TARGET_DIR", REPOSITORY / "target"))
    parser.add_argument("--folder", type=Path, default=target / "sensors", help="where everything is written")
    parser.add_argument("--relief", type=Path, help="Relief's benchmark, already built")
    return parser.parse_args()


class Bench:
    def __init__(self, args):
        self.args = args
        self.left_out = {}
        args.folder.mkdir(parents=True, exist_ok=True)
        self.relief = args.relief or build()
        needed = {PROGRAMS[name][2] for name in args.programs}
        self.pythons = {name: environment_of(name, args.folder) for name in sorted(needed)}
        # Also compares, since it has numpy.
        self.python = next((python for python in self.pythons.values() if python), None)
        for name in args.programs:
            if self.pythons[PROGRAMS[name][2]] is None:
                self.left_out[name] = "its packages cannot be had"

    def command(self, name, folder):
        script, further, environment, _ = PROGRAMS[name]
        return [self.pythons[environment], HERE / script, folder, *further]

    def draw(self, boxes, size):
        """Pictures of all programs, and how they compare, by program."""
        folder = self.args.folder / f"{boxes}-boxes-{size}"
        shutil.rmtree(folder, ignore_errors=True)
        views = max(self.args.views)
        shape = ["--boxes", boxes, "--size", size, "--views", views]
        output_of([[self.relief, *shape, "--write", folder]])
        for name in self.args.programs:
            if name not in self.left_out:
                try:
                    output_of([[*self.command(name, folder), "--write"]])
                except Failed as failed:
                    self.left_out[name] = str(failed)
        if self.python is None:
            return folder, {}
        [lines] = output_of([[self.python, HERE / "compare.py", folder]])
        return folder, {line["program"]: line for line in lines}

    def runs(self, boxes, size, folder, agree):
        """What is measured of a size: key of the row, mode, command."""
        for mode in self.args.modes:
            for views in self.args.views:
                shape = ["--boxes", boxes, "--size", size, "--views", views]
                yield ("relief", views), mode, [self.relief, *shape, "--mode", mode]
            for name in self.args.programs:
                if name not in self.left_out and agree.get(name, {}).get("agrees") and mode in PROGRAMS[name][3]:
                    yield (name, 1), mode, [*self.command(name, folder), "--mode", mode]

    def measure(self, boxes, size, processes, folder, agree):
        """Pairs of CPU milliseconds of an observation and observations a second, by row and mode."""
        figures = {}
        drawn = ["--rounds", 1, "--seconds", self.args.seconds]
        for number in range(self.args.rounds):
            say(f"{boxes} boxes, {size}×{size}, processes {processes}: round {number + 1} of {self.args.rounds}")
            for row, mode, command in self.runs(boxes, size, folder, agree):
                lines = [line for lines in output_of([[*command, *drawn]] * processes) for line in lines]
                with open(self.args.folder / "figures.jsonl", "a") as file:
                    file.writelines(json.dumps(line | {"processes": processes}) + "\n" for line in lines)
                processor = statistics.mean(line["cpu_ms"] for line in lines)
                rate = sum(1e3 / line["wall_ms"] for line in lines)
                figures.setdefault(row, {}).setdefault(mode, []).append((processor, rate))
        return figures


def cell(pairs):
    """Median and range of processor time, and the median rate."""
    if not pairs:
        return "–"
    processor, rates = zip(*pairs)
    median, low, high = statistics.median(processor), min(processor), max(processor)
    return f"{median:.2f} ({low:.2f}–{high:.2f}), {statistics.median(rates):,.0f}/s"


def table(title, modes, figures, agree, left_out):
    lines = [f"**{title}**", "", "| program | views together | " + " | ".join(modes) + " |"]
    lines.append("|---" * (2 + len(modes)) + "|")
    for (name, views), cells in figures.items():
        lines.append(f"| {name} | {views} | " + " | ".join(cell(cells.get(mode)) for mode in modes) + " |")
    lines.append("")
    for name, figure in agree.items():
        apart = f"depths {figure['depth_median_m']:.1e} m apart, " if "depth_median_m" in figure else ""
        others = "arithmetic" if name == "relief" else "Relief"
        verdict = "agrees with" if figure["agrees"] else "**does not draw the same as**"
        lines.append(f"- {name} {verdict} {others}: {apart}masks {figure['mask_iou']:.3f}")
    lines += [f"- {name} is left out: {reason}" for name, reason in left_out.items()]
    return "\n".join(lines) + "\n"


def main():
    args = arguments()
    try:
        bench = Bench(args)
        print("CPU milliseconds of an observation: median (range) of the rounds; observations a second by the clock.")
        print(f"{os.cpu_count()} cores; load before: {os.getloadavg()[0]:.1f}\n")
        for boxes, size in itertools.product(args.boxes, args.sizes):
            folder, agree = bench.draw(boxes, size)
            for processes in args.processes:
                figures = bench.measure(boxes, size, processes, folder, agree)
                title = f"{boxes} boxes, {size}×{size}, processes: {processes}"
                print(table(title, args.modes, figures, agree, bench.left_out), flush=True)
        print(f"Load after: {os.getloadavg()[0]:.1f}")
    except (Failed, subprocess.CalledProcessError) as failed:
        sys.exit(f"run.py: {failed}")


if __name__ == "__main__":
    main()
