#!/usr/bin/env python3
"""200 small models through a real HyperQueue server with two workers, one of which is killed in the middle: nothing is lost.

    tools/farm_check.py target/release/silmap

Some models are bad, and one has no time. Every good one must end in the bytes of a plain `silmap build`, every model once in the
table and in its class. The recipes for Slurm and Kubernetes are run with the variables that those would set. Exit code 1 when
something is wrong.
"""
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
sys.dont_write_bytecode = True
import farm_models  # noqa: E402
import farm_page  # noqa: E402

TOOLS = Path(__file__).resolve().parent
MODELS, FACES = 200, 200
OPTIONS = (
    "--views 32 --keep 10 --resolution 48 --faces 60 --texture-views 2 --texture-size 16 --atlas-size 16 --backend cpu"
).split()
# The model that has no time, by its line.
HURRIED = 150
# Kubernetes' own schemas, from PyPI.
SCHEMAS = "1.37.0"
# Assets that are there when a worker is killed.
MIDDLE = 60


def kind_of(number):
    return {7: farm_models.broken, 23: farm_models.opened}.get(number % 40, farm_models.closed)


def expected(number):
    if number + 1 == HURRIED:
        return "resources"
    return "done" if kind_of(number) is farm_models.closed else "bad-input"


def workers_of(process):
    """Worker processes that a farm has started."""
    found = []
    for folder in Path("/proc").iterdir():
        try:
            words = (folder / "cmdline").read_bytes().split(b"\0")
            parent = int(re.search(r"PPid:\s*(\d+)", (folder / "status").read_text())[1])
        except (OSError, TypeError):
            continue
        if parent == process and b"--worker" in words:
            found.append(int(folder.name))
    return found


def run_and_kill(silmap, listed, out):
    """Runs the farm; one worker is killed when some models are done. Gives its exit code."""
    command = [sys.executable, TOOLS / "farm", listed, "-o", out, "--workers", "2", "--shards", "16", "--silmap", silmap]
    farm = subprocess.Popen([*command, "--", *OPTIONS])
    killed = None
    while farm.poll() is None:
        if killed is None and len(list((out / "assets").glob("*.glb"))) >= MIDDLE:
            killed = workers_of(farm.pid)[0]
            os.kill(killed, signal.SIGKILL)
            print(f"killed worker {killed} in the middle", flush=True)
        time.sleep(0.05)
    if killed is None:
        raise RuntimeError("the farm ended before a worker could be killed")
    return farm.returncode


def plain_builds(silmap, folder, work):
    """What `silmap build` makes of each good model, by number."""
    made = {}
    for number in range(MODELS):
        if expected(number) == "done":
            out = work / "plain.glb"
            model = folder / f"{number:05}.obj"
            subprocess.run([silmap, "build", model, "-o", out, *OPTIONS], check=True, stderr=subprocess.DEVNULL)
            made[number] = out.read_bytes()
    return made


def check(out, plain):
    """What is wrong with a farm's results, a sentence each."""
    wrong = []
    rows = [json.loads(line) for line in (out / "table.jsonl").read_text().splitlines()]
    counted = Counter(row["line"] for row in rows)
    if sorted(counted) != list(range(1, MODELS + 1)) or set(counted.values()) != {1}:
        wrong.append("not every model is in the table once")
    for row in rows:
        number = row["line"] - 1
        status = "done" if row["status"] == "kept" else row["status"]
        if status != expected(number):
            wrong.append(f"model {number} ended as {row['status']}: {row['message']}")
        if (row["message"] is None) != (expected(number) == "done"):
            wrong.append(f"model {number} has the sentence {row['message']}")
    names = sorted(path.name for path in (out / "assets").iterdir())
    good = sorted(f"{number:05}.glb" for number in plain)
    if [name for name in names if name.endswith(".glb")] != good:
        wrong.append("the assets are not those of the good models")
    if any("part" in name for name in names):
        wrong.append("something half-written is left")
    for number, made in plain.items():
        asset = out / "assets" / f"{number:05}.glb"
        if asset.exists() and asset.read_bytes() != made:
            wrong.append(f"{asset.name} is not what a plain build makes")
    page = (out / "report.html").read_text()
    if re.search(r"(src|href)\s*=|https?:", page) or "out of resources" not in page:
        wrong.append("the page is not whole, or loads something")
    return wrong


def check_negative_controls(out, plain):
    """The same check with something taken away or changed must fail."""
    asset = out / "assets" / f"{min(plain):05}.glb"
    table = out / "table.jsonl"
    kept_asset, kept_table = asset.read_bytes(), table.read_text()
    wrong = []

    def must_fail(what):
        if not check(out, plain):
            wrong.append(f"the check does not see {what}")
        asset.write_bytes(kept_asset)
        table.write_text(kept_table)

    asset.unlink()
    must_fail("a missing asset")
    asset.write_bytes(kept_asset[:-1] + bytes([kept_asset[-1] ^ 1]))
    must_fail("a changed asset")
    table.write_text(kept_table.split("\n", 1)[1])
    must_fail("a missing row")
    table.write_text(kept_table + kept_table.split("\n", 1)[0] + "\n")
    must_fail("a model that is there twice")
    return wrong


def check_slurm(silmap, folder, work):
    """The recipe for Slurm, a task after the other with the variables that Slurm sets, and `scontrol` that notes its words."""
    bin_folder = work / "bin"
    bin_folder.mkdir()
    noted = work / "requeued"
    (bin_folder / "scontrol").write_text(f'#!/bin/sh\necho "$@" >> {noted}\n')
    (bin_folder / "scontrol").chmod(0o755)
    lines = (folder / "list.jsonl").read_text().splitlines()[:6]
    hurried = json.dumps({"model": "00000.obj", "out": "hurried", "options": {"timeout": 0.001}})
    (folder / "six.jsonl").write_text("\n".join([*lines, hurried]) + "\n")
    codes = []
    for task in (3, 5, 7):
        variables = {
            "PATH": f"{bin_folder}:{os.environ['PATH']}", "SILMAP": str(silmap), "SLURM_ARRAY_JOB_ID": "99",
            "SLURM_ARRAY_TASK_ID": str(task), "SLURM_ARRAY_TASK_MIN": "3", "SLURM_ARRAY_TASK_STEP": "2",
            "SLURM_ARRAY_TASK_COUNT": "3", "SLURM_CPUS_PER_TASK": "1",
        }  # fmt: skip
        command = ["bash", TOOLS / "farm-recipes" / "slurm.sh", folder / "six.jsonl", work / "slurm", *OPTIONS]
        codes.append(subprocess.run(command, env={**os.environ, **variables}, stderr=subprocess.DEVNULL).returncode)
    rows = list(farm_page.Found(list(range(1, 8)), work / "slurm" / "lines"))
    statuses = [row["status"] for row in rows]
    wrong = []
    if statuses != ["done"] * 6 + ["resources"] or sorted(codes) != [0, 0, 4]:
        wrong.append(f"the Slurm recipe ends in {codes} and {statuses}")
    # The seventh model is in the part whose number leaves 1 by 3, which is the second task.
    if noted.read_text() != "requeue 99_5\n":
        wrong.append(f"the Slurm recipe queues again: {noted.read_text()}")
    return wrong


def check_kubernetes(silmap, folder, work):
    """The recipe for Kubernetes: what it says fits together, and the command of its pods with the variables that they get."""
    target = work / "kubernetes-validate"
    install = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--target", target]
    subprocess.run([*install, f"kubernetes-validate=={SCHEMAS}"], check=True)
    sys.path.insert(0, str(target))
    import kubernetes_validate
    import yaml

    job = yaml.safe_load((TOOLS / "farm-recipes" / "kubernetes.yaml").read_text())
    kubernetes_validate.validate(job, SCHEMAS.rsplit(".", 1)[0], strict=True)
    spec, wrong = job["spec"], []
    container = spec["template"]["spec"]["containers"][0]
    environment = {entry["name"]: entry["value"] for entry in container["env"]}
    if (job["kind"], spec["completionMode"], str(spec["completions"])) != ("Job", "Indexed", environment["SHARDS"]):
        wrong.append("the Kubernetes recipe has as many parts as pods in no sense")
    place = work / "kubernetes"
    place.mkdir()
    for path in folder.glob("0000?.obj"):
        shutil.copy(path, place)
    (place / "list.jsonl").write_text("".join(json.dumps({"model": f"0000{i}.obj"}) + "\n" for i in range(5)))
    shell, flag, script = container["command"]
    script = script.replace("/work/", f"{place}/").replace("exec silmap build", f"exec {silmap} build {' '.join(OPTIONS)}")
    for index in range(2):
        variables = {**os.environ, **environment, "SHARDS": "2", "JOB_COMPLETION_INDEX": str(index)}
        done = subprocess.run([shell, flag, script], env=variables, stderr=subprocess.PIPE, text=True)
        if done.returncode:
            wrong.append(f"the Kubernetes recipe's command ends in {done.returncode}: {done.stderr}")
    statuses = [row["status"] for row in farm_page.Found(list(range(1, 6)), place / "lines")]
    if statuses != ["done"] * 5:
        wrong.append(f"the Kubernetes recipe's command ends in {statuses}")
    return wrong


def main():
    silmap = Path(sys.argv[1]).resolve()
    with tempfile.TemporaryDirectory(prefix="silmap-farm-check-") as work:
        work = Path(work)
        folder, out = work / "models", work / "out"
        listed = farm_models.write(folder, [kind_of(number) for number in range(MODELS)], FACES)
        lines = listed.read_text().splitlines()
        lines[HURRIED - 1] = json.dumps({**json.loads(lines[HURRIED - 1]), "options": {"timeout": 0.001}})
        listed.write_text("\n".join(lines) + "\n")
        started = time.time()
        code = run_and_kill(silmap, listed, out)
        print(f"{MODELS} models in {time.time() - started:.0f} s with a worker killed", flush=True)
        plain = plain_builds(silmap, folder, work)
        wrong = check(out, plain)
        if code != 4:
            wrong.append(f"the farm ends in {code}, not 4")
        started_twice = [path for path in (out / "lines").glob("0-*.jsonl") if not path.name.endswith(".0.jsonl")]
        if not started_twice:
            wrong.append("no part was given to another worker")
        wrong += check_negative_controls(out, plain)
        # Everything but the model without time is kept, and the table made again is the same.
        before = (out / "table.csv").read_bytes()
        subprocess.run([sys.executable, TOOLS / "farm", "--collect", listed, "-o", out], check=False)
        if (out / "table.csv").read_bytes() != before:
            wrong.append("collecting again gives another table")
        wrong += check_slurm(silmap, folder, work)
        wrong += check_kubernetes(silmap, folder, work)
    for sentence in wrong:
        print(f"wrong: {sentence}")
    if not wrong:
        print(f"{len(plain)} assets as plain builds make them, {MODELS - len(plain)} models in their class, nothing lost")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
