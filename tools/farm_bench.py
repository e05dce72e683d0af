#!/usr/bin/env python3
"""What `tools/farm` costs beside the builds themselves: many models of 1,000 faces, with one worker and with more.

    tools/farm_bench.py target/release/silmap [--models 10000] [--workers 1 2]

Prints a row of Markdown for each number of workers: seconds of the whole, of all builds together as they count themselves, the
overhead (seconds of the whole times workers over those of the builds, less one), and the most memory of the server, of a worker and
of a process that reads the list, each in the first tenth of the run and in the rest. Exit code 1 when the overhead is over 3 % or
memory grows by more than 8 MiB. One build more than there are cores changes the builds' own times: measure on a machine that has
nothing else to do. The builds are as small as they get, a seventh of a second each, which is hardest on the farm.
"""
import argparse
import json
import re
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
sys.dont_write_bytecode = True
import farm_models  # noqa: E402

TOOLS = Path(__file__).resolve().parent
FACES = 1000
OPTIONS = (
    "--views 16 --keep 8 --resolution 64 --faces 60 --texture-views 2 --texture-size 16 --atlas-size 16 --backend cpu"
).split()
MOST_OVERHEAD, MOST_GROWTH = 0.03, 8 << 20
KINDS = ("server", "worker", "reader")


class Memory(threading.Thread):
    """The most memory of each kind of process, in spans of time."""

    def __init__(self, process):
        super().__init__(daemon=True)
        self.process, self.seen = process, []

    def run(self):
        started = time.time()
        while self.process.poll() is None:
            held = dict.fromkeys(KINDS, 0)
            for folder in Path("/proc").iterdir():
                kind = self.kind(folder)
                if kind:
                    held[kind] = max(held[kind], resident(folder))
            self.seen.append((time.time() - started, held))
            time.sleep(0.5)

    def kind(self, folder):
        if folder.name == str(self.process.pid):
            return "server"
        try:
            words = (folder / "cmdline").read_bytes().split(b"\0")
        except OSError:
            return None
        if b"--worker" in words and any(word.endswith(b"tools/farm") for word in words):
            return "worker"
        return "reader" if b"--manifest" in words and b"--threads" in words else None

    def first_and_rest(self):
        """The most of each kind in the first tenth of the run, and after it."""
        end = self.seen[-1][0] if self.seen else 0.0
        first = [held for at, held in self.seen if at <= end / 10] or [dict.fromkeys(KINDS, 0)]
        rest = [held for at, held in self.seen if at > end / 10] or first
        return {kind: (max(h[kind] for h in first), max(h[kind] for h in rest)) for kind in KINDS}


def resident(folder):
    try:
        found = re.search(r"VmRSS:\s*(\d+)", (folder / "status").read_text())
    except OSError:
        return 0
    return int(found[1]) * 1024 if found else 0


def measure(silmap, listed, out, workers):
    command = [sys.executable, TOOLS / "farm", listed, "-o", out, "--workers", str(workers), "--silmap", silmap, "--", *OPTIONS]
    farm = subprocess.Popen(command)
    memory = Memory(farm)
    memory.start()
    if farm.wait():
        raise RuntimeError(f"the farm ended in {farm.returncode}")
    memory.join()
    facts = json.loads((out / "run.json").read_text())
    with open(out / "table.jsonl") as table:
        work = sum(json.loads(line)["seconds"]["total"] for line in table)
    return facts["wall_seconds"], work, facts["parts"], memory.first_and_rest()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("silmap", type=Path)
    parser.add_argument("--models", type=int, default=10_000)
    parser.add_argument("--workers", type=int, nargs="+", default=[1, 2])
    args = parser.parse_args()
    is_wrong = False
    with tempfile.TemporaryDirectory(prefix="silmap-farm-bench-") as work:
        listed = farm_models.write(Path(work) / "models", [farm_models.closed] * args.models, FACES)
        print("| models | workers | parts | whole | builds | overhead | server | worker | reader of the list |")
        print("|---|---|---|---|---|---|---|---|---|", flush=True)
        for workers in args.workers:
            wall, seconds, parts, memory = measure(args.silmap.resolve(), listed, Path(work) / f"out-{workers}", workers)
            overhead = wall * workers / seconds - 1
            spans = " | ".join("{:.0f}, {:.0f} MiB".format(*(n / 2**20 for n in memory[kind])) for kind in KINDS)
            print(
                f"| {args.models:,} | {workers} | {parts} | {wall:,.0f} s | {seconds:,.0f} s | {100 * overhead:.1f} % | {spans} |",
                flush=True,
            )
            is_wrong |= overhead > MOST_OVERHEAD or any(rest > first + MOST_GROWTH for first, rest in memory.values())
    return 1 if is_wrong else 0


if __name__ == "__main__":
    sys.exit(main())
