"""Curves of learning: from the CSV files of several seeds to a table. test_sb3.py has the picture."""

import runpy

from conftest import ROOT

FILES = {
    "seed0.csv": """policy,seed,steps,seconds,metres,least,most,speed,reward,kept
random,0,0,0.0,5.0,3.0,9.0,0.5,-9.0,1.0
straight,0,0,0.0,18.0,9.0,38.0,5.0,11.0,0.0
ppo,0,0,0.0,20.0,9.0,40.0,5.0,12.0,0.0
ppo,0,5120,20.0,100.0,9.0,150.0,7.0,80.0,0.25
""",
    "seed1.csv": """policy,seed,steps,seconds,metres,least,most,speed,reward,kept
random,1,0,0.0,7.0,3.0,9.0,0.7,-7.0,1.0
straight,1,0,0.0,18.0,9.0,38.0,5.0,11.0,0.0
ppo,1,0,0.0,10.0,9.0,40.0,5.0,-2.0,0.0
ppo,1,5120,21.0,120.0,9.0,150.0,8.0,90.0,0.75
""",
}
# Policies that learn nothing come first. Cells: the mean over seeds, the least and the most.
TABLE = """\
| policy | steps | metres | m/s | reward | lane kept |
|---|---|---|---|---|---|
| straight ahead | 0 | 18 (18 to 18) | 5.0 (5.0 to 5.0) | 11 (11 to 11) | 0 (0 to 0) |
| at random | 0 | 6 (5 to 7) | 0.6 (0.5 to 0.7) | −8 (−9 to −7) | 100 (100 to 100) |
| PPO | 0 | 15 (10 to 20) | 5.0 (5.0 to 5.0) | 5 (−2 to 12) | 0 (0 to 0) |
| PPO | 5,120 | 110 (100 to 120) | 7.5 (7.0 to 8.0) | 85 (80 to 90) | 50 (25 to 75) |"""


def test_files_of_two_seeds_are_a_table(tmp_path):
    example = runpy.run_path(str(ROOT / "examples" / "python" / "plot_curve.py"))
    for name, text in FILES.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    tests = example["read"]([str(tmp_path / name) for name in FILES])
    assert "\n".join(example["table"](tests)) == TABLE
