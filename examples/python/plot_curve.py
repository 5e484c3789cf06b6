"""Draws what learn_ppo.py has written of several seeds, and prints it as a table.

python examples/python/plot_curve.py seed0.csv seed1.csv seed2.csv -o curve.png

The line is the mean over seeds, the band reaches from the least to the most of them, and dashed lines are the policies
that learn nothing. Drawing needs matplotlib, which Stable-Baselines3 brings.
"""

import argparse
import csv
from collections import defaultdict

#: Columns of the table beside the policy and its steps: their names in the files, factors and forms.
CELLS = [("metres", 1, ".0f"), ("speed", 1, ".1f"), ("reward", 1, ".0f"), ("kept", 100, ".0f")]
FLOOR = {"straight": "straight ahead", "random": "at random"}


def read(paths: list[str]) -> dict[str, dict[int, list[dict[str, float]]]]:
    """The tests of each policy by how many steps it had learned from: one of each file."""
    tests: dict[str, dict[int, list[dict[str, float]]]] = defaultdict(lambda: defaultdict(list))
    for path in paths:
        with open(path, encoding="utf-8", newline="") as file:
            for row in csv.DictReader(file):
                policy = row.pop("policy")
                tests[policy][int(row["steps"])].append({name: float(value) for name, value in row.items()})
    return tests


def spread(rows: list[dict[str, float]], name: str) -> tuple[float, float, float]:
    """Mean, least and most over seeds."""
    values = [row[name] for row in rows]
    return sum(values) / len(values), min(values), max(values)


def table(tests: dict[str, dict[int, list[dict[str, float]]]]) -> list[str]:
    """All tests as lines of Markdown."""
    lines = ["| policy | steps | metres | m/s | reward | lane kept |", "|---|---|---|---|---|---|"]
    for policy in [*FLOOR, "ppo"]:
        for steps, rows in sorted(tests[policy].items()):
            cells = [FLOOR.get(policy, "PPO"), f"{steps:,}"]
            for name, factor, form in CELLS:
                mean, least, most = (factor * value for value in spread(rows, name))
                cells.append(f"{mean:{form}} ({least:{form}} to {most:{form}})")
            lines.append("| " + " | ".join(cells).replace("-", "−") + " |")
    return lines


def draw(tests: dict[str, dict[int, list[dict[str, float]]]], path: str) -> None:
    """Draws how far the policies come."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(6.4, 3.6), dpi=110, layout="constrained")
    learned = sorted(tests["ppo"].items())
    steps = [at / 1000.0 for at, _ in learned]
    means, least, most = zip(*(spread(rows, "metres") for _, rows in learned))
    axes.fill_between(steps, least, most, color="#2a6fbb", alpha=0.2, linewidth=0)
    axes.plot(steps, means, color="#2a6fbb", marker="o", markersize=3)
    axes.annotate("PPO", (steps[-1], means[-1]), (6, 0), textcoords="offset points", va="center", color="#2a6fbb")
    # The upper line has its name above, the lower one below.
    floor = sorted((spread(tests[policy][0], "metres")[0], name) for policy, name in FLOOR.items())
    for (metres, name), off, side in zip(floor, (-3, 3), ("top", "bottom")):
        axes.axhline(metres, color="#666666", linestyle="--", linewidth=1)
        axes.annotate(
            name, (steps[-1], metres), (0, off), textcoords="offset points",
            ha="right", va=side, color="#666666", fontsize=9,
        )
    axes.set(xlabel="steps learned from, thousands", ylabel="metres along the lane in 20 s", ylim=(0, None))
    axes.spines[["top", "right"]].set_visible(False)
    axes.margins(x=0.02)
    figure.savefig(path)


def main() -> None:
    parser = argparse.ArgumentParser(description="Draws curves of learning")
    parser.add_argument("files", nargs="+", help="CSV files of learn_ppo.py, one of each seed")
    parser.add_argument("-o", "--output", required=True, help="a picture, such as curve.png")
    args = parser.parse_args()
    tests = read(args.files)
    print("\n".join(table(tests)))
    draw(tests, args.output)


if __name__ == "__main__":
    main()
