"""The package on a machine where nobody is logged in."""

import os
import subprocess
import sys
import textwrap

KEPT = ("PATH", "HOME", "LD_LIBRARY_PATH", "SYSTEMROOT", "VK_DRIVER_FILES", "VK_ICD_FILENAMES", "PYTHONPATH")


def test_drawing_asks_no_display_and_says_nothing():
    program = """
        import os, relief
        sim = relief.Sim()
        sim.add_camera("camera", size=(8, 8), at=(0, 1, 0))
        print(sim.capture()["camera"].color.shape, os.environ["NODEVICE_SELECT"])
    """
    environment = {name: value for name, value in os.environ.items() if name in KEPT}
    command = [sys.executable, "-c", textwrap.dedent(program)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120)
    assert (done.returncode, done.stdout) == (0, "(8, 8, 3) 1\n"), done.stderr
    # A driver may say what it likes of itself.
    assert not any(word in done.stderr for word in ("XDG_RUNTIME_DIR", "DISPLAY", "display", "ayland")), done.stderr
