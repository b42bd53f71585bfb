#!/usr/bin/env python3
"""Kills `slcmap run` at random moments, and checks that every later stage works on what is there.

    tests/benchmarks/kill_runs.py SEQ [--runs 50] [--seed 1] [--slcmap build/bin/slcmap]

SEQ is a recording with true poses. It is played at its own pace (--realtime), so that the moment of
the kill says which poses should be there: all up to the image that was due then. After each kill,
map, export and evaluate must end with 0, or with an error of one line that says why. Ends with 1
where one does not, or where more than a second of poses is lost.
"""

import argparse
import json
import pathlib
import random
import signal
import subprocess
import sys
import tempfile
import time

MAX_LOSS_S = 1.0
POLL_S = 0.005


def last_stamp_s(path):
    """The stamp of the last whole row of a TUM file; None where there is none."""
    try:
        rows = path.read_text().split("\n")[:-1]
    except FileNotFoundError:
        return None
    rows = [row for row in rows if not row.startswith("#")]
    return float(rows[-1].split()[0]) if rows else None


def run_and_kill(command, trajectory, kill_after_s):
    """Returns the stamp that was due when the process was killed (None before the first pose)."""
    start = time.monotonic()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    lead_s = None  # wall clock minus stamp, of the pose that came with the least delay
    while time.monotonic() - start < kill_after_s and process.poll() is None:
        stamp_s = last_stamp_s(trajectory)
        if stamp_s is not None:
            found_s = time.monotonic() - stamp_s
            lead_s = found_s if lead_s is None else min(lead_s, found_s)
        time.sleep(POLL_S)
    killed_s = time.monotonic()
    process.send_signal(signal.SIGKILL)
    process.wait()
    return None if lead_s is None else killed_s - lead_s


class Checks:
    def __init__(self):
        self.failures = []

    def stage(self, name, command):
        """Whether a stage succeeded; it must say in one line why not."""
        result = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
        errors = [line for line in result.stderr.splitlines() if "error:" in line]
        if result.returncode == 0:
            return True
        if result.returncode != 1 or len(errors) != 1:
            self.failures.append(f"{name}: exit code {result.returncode}: {result.stderr.strip()}")
        else:
            print(f"    {name}: {errors[0]}")
        return False

    def expect(self, condition, what):
        if not condition:
            self.failures.append(what)


def check_after_kill(slcmap, sequence, truth, folder, checks):
    """Runs the later stages; returns the stamp of the last mapped pose and whether one was made."""
    run, again = folder / "out/run", folder / "again"
    mapped = checks.stage("map", [slcmap, "-q", "map", run, "-o", again / "map"])
    if not mapped:
        return None
    summary = json.loads((again / "map/map.json").read_text())
    whole = (run / "run.json").exists()
    checks.expect(summary["complete"] == whole, "map: a run that was cut off is marked as complete")
    exported = checks.stage("export", [slcmap, "-q", "export", again / "map", "-o", again / "export"])
    checks.expect(exported, "export: failed on a map that was made")
    for estimate in (run / "trajectory.tum", again / "map/trajectory.tum"):
        checks.stage("evaluate", [slcmap, "evaluate", "--truth", truth, "--estimate", estimate])
    return last_stamp_s(again / "map/trajectory.tum")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("sequence", type=pathlib.Path)
    parser.add_argument("--runs", type=int, default=50)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=12, help="kills come within this time")
    parser.add_argument("--slcmap", default="build/bin/slcmap")
    arguments = parser.parse_args()
    asl = arguments.sequence / "mav0"
    asl = asl if asl.exists() else arguments.sequence
    truth = asl / "state_groundtruth_estimate0/data.csv"
    moments = random.Random(arguments.seed)
    losses_s, unmapped, checks = [], 0, Checks()
    for i in range(arguments.runs):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            kill_after_s = moments.uniform(0, arguments.seconds)
            due_s = run_and_kill(
                [arguments.slcmap, "-q", "run", arguments.sequence, "-o", folder / "out",
                 "--realtime"], folder / "out/run/trajectory.tum", kill_after_s)
            whole = (folder / "out/run/run.json").exists()
            last_s = check_after_kill(arguments.slcmap, arguments.sequence, truth, folder, checks)
            unmapped += last_s is None
            loss_s = 0 if due_s is None or whole else due_s - (last_s or 0)
            losses_s.append(loss_s)
            checks.expect(loss_s <= MAX_LOSS_S, f"{loss_s:.2f} s of poses were lost")
            print(f"{i + 1:3}: killed after {kill_after_s:5.2f} s, "
                  f"{'whole' if whole else 'cut off'}, lost {loss_s:.3f} s", flush=True)
    losses_s.sort()
    print(f"{arguments.runs} runs: {unmapped} without a map and why, lost poses: "
          f"median {losses_s[len(losses_s) // 2]:.3f} s, at most {losses_s[-1]:.3f} s, "
          f"{len(checks.failures)} failures")
    for failure in checks.failures:
        print(f"failed: {failure}")
    return 1 if checks.failures else 0


if __name__ == "__main__":
    sys.exit(main())
