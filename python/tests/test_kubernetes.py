"""What Kubernetes would run of ``scripts/kubernetes/render.yaml``, run here: the shards of an Indexed Job."""

import filecmp
import subprocess

from conftest import ROOT, needed

yaml = needed("yaml")


def run(*command):
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_shards_of_the_manifest_are_together_what_one_process_writes(program, tmp_path):
    manifest = yaml.safe_load((ROOT / "scripts/kubernetes/render.yaml").read_text())
    job = manifest["spec"]
    assert (manifest["apiVersion"], manifest["kind"], job["completionMode"]) == ("batch/v1", "Job", "Indexed")
    pod = job["template"]["spec"]
    (container,) = pod["containers"]
    # An action on exit codes needs a pod that is not begun again in its place.
    assert pod["restartPolicy"] == "Never"
    (codes,) = (rule["onExitCodes"] for rule in job["podFailurePolicy"]["rules"] if "onExitCodes" in rule)
    assert codes["containerName"] == container["name"] and codes["values"] == [2]
    (mounted,) = container["volumeMounts"]
    assert [mounted["name"]] == [volume["name"] for volume in pod["volumes"]]

    scene = ROOT / "assets/scenes/shapes.ron"
    options = ["--frames", "3", "--size", "32x18"]
    folder = tmp_path / "job"
    run(program, "render", scene, "-o", tmp_path / "one", *options)
    run(program, "split", scene, "-o", folder, "--shards", "2", *options)
    for index in range(2):
        args = [arg.replace("$(JOB_COMPLETION_INDEX)", str(index)) for arg in container["args"]]
        assert args[-1] == f"{mounted['mountPath']}/job/shards.json:{index}"
        run(program, *(arg.replace(mounted["mountPath"], str(tmp_path)) for arg in args))
    run(program, "merge", folder)
    names = sorted(path.name for path in (tmp_path / "one").iterdir())
    assert len(names) == 3
    assert filecmp.cmpfiles(tmp_path / "one", folder / "merged", names, shallow=False) == (names, [], [])
