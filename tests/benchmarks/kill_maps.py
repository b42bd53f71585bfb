#!/usr/bin/env python3
"""Stops `slcmap map` at random moments, makes the map again, and compares it with an undisturbed one.

    tests/benchmarks/kill_maps.py RUN [--times 10] [--seed 1] [--slcmap build/bin/slcmap] [-- OPTION...]

Every second time it is stopped by Ctrl-C, which may leave a partial map; else it is killed. What the
next `slcmap map` into the same folder writes must have the bytes of the undisturbed map. Ends with 1
where it has others. Options behind -- go to `slcmap map`.
"""

import argparse
import hashlib
import pathlib
import random
import signal
import subprocess
import sys
import tempfile
import time


def contents(folder):
    """The SHA-256 of each file by its name in the folder."""
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
            for path in sorted(folder.rglob("*")) if path.is_file()}


def differences(expected, found):
    return sorted(name for name in expected.keys() | found.keys()
                  if expected.get(name) != found.get(name))


def stop_after(command, seconds, how):
    """Starts a command and stops it; whether it was still running then."""
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        process.wait(timeout=seconds)
        return False
    except subprocess.TimeoutExpired:
        process.send_signal(how)
        process.wait()
        return True


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("run", type=pathlib.Path)
    parser.add_argument("--times", type=int, default=10)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--slcmap", default="build/bin/slcmap")
    parser.add_argument("options", nargs="*")
    arguments = parser.parse_args()
    moments = random.Random(arguments.seed)
    failures = stops = 0
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        command = [arguments.slcmap, "-q", "map", arguments.run, *arguments.options, "-o"]
        start = time.monotonic()
        subprocess.run([*command, folder / "undisturbed"], check=True)
        whole_s = time.monotonic() - start
        expected = contents(folder / "undisturbed")
        for i in range(arguments.times):
            stop_s = moments.uniform(0, whole_s)
            how = signal.SIGINT if i % 2 else signal.SIGKILL
            stopped = stop_after([*command, folder / "map"], stop_s, how)
            subprocess.run([*command, folder / "map"], check=True)
            wrong = differences(expected, contents(folder / "map"))
            failures += bool(wrong)
            stops += stopped
            print(f"{i + 1:3}: {how.name} after {stop_s:5.2f} of {whole_s:.2f} s"
                  f"{'' if stopped else ' (was done)'}: "
                  f"{'other bytes: ' + ', '.join(wrong) if wrong else 'same bytes'}", flush=True)
    print(f"{stops} of {arguments.times} times stopped, {failures} with other bytes")
    return 1 if failures or not stops else 0


if __name__ == "__main__":
    sys.exit(main())
