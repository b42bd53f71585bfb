#!/usr/bin/env python3
"""Damages run and map folders at random and looks at what slcmap makes of them.

Of each file of a run folder, and of each of a map folder, N seeded mutations are read by
`slcmap map --sparse` and `slcmap export`. Each ends in one of these classes:

  crash      ended by a signal
  hang       took more than 10 s
  memory     needed more than 2 GB (its allocation failed)
  words      refused, but not by exactly one line of error with exit code 1 or 2
  refused    refused by one line
  warned     accepted with a warning that the good folder does not give
  same       accepted, with the same output as that of the good folder
  rounding   accepted, and numbers of the output differ by at most 1e-3 of their size
  silent     accepted without a word, with other output

The first four and `silent` should not be; their mutations are listed, and can be made again with
--only FILE:NUMBER.

A map with pipes, and one that was merged, let more be damaged than others do: a list of no pipes
has little that can be wrong.

Of a run that was killed the journal is read: --killed takes the folder of one. What its finished.csv
says beyond the last state.json may change in silence; nothing else may.

  tests/benchmarks/mutate_folders.py RUN MAP [-n 1000] [--jobs 2] [--slcmap build/bin/slcmap]
      [--killed RUN] [--files pipes.json point_observations.csv] [--accept-changed]
"""

import argparse
import collections
import concurrent.futures
import hashlib
import pathlib
import random
import re
import resource
import shutil
import struct
import subprocess
import sys
import tempfile

SECONDS = 10
MEMORY_BYTES = 2 << 30
NUMBERS = ["0", "-1", "1e30", "nan", "inf", "-1e300", "2147483648", "9223372036854775807",
           "1e-30", "", "99999", "0.5"]
FIELD = re.compile(rb"[^\s,:\[\]{}\"]+")
NUMBER = re.compile(rb"-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
BAD = ["crash", "hang", "memory", "words", "silent"]


# Mutations: each takes a generator and bytes, and returns other bytes and its name.

def flip_bit(rng, data):
    place = rng.randrange(len(data))
    return data[:place] + bytes([data[place] ^ (1 << rng.randrange(8))]) + data[place + 1:]


def delete_bytes(rng, data):
    place = rng.randrange(len(data))
    return data[:place] + data[place + rng.randint(1, 16):]


def insert_bytes(rng, data):
    place = rng.randrange(len(data) + 1)
    return data[:place] + rng.randbytes(rng.randint(1, 16)) + data[place:]


def overwrite_bytes(rng, data):
    place = rng.randrange(len(data))
    size = rng.randint(1, 64)
    return data[:place] + bytes([rng.choice([0, 255])]) * size + data[place + size:]


def truncate(rng, data):
    return data[:rng.randrange(len(data))]


def empty(_, __):
    return b""


def append(rng, data):
    return data + data[-rng.randint(1, len(data)):]


def change_rows(change):
    def mutate(rng, data):
        rows = data.splitlines(keepends=True)
        change(rng, rows)
        return b"".join(rows)
    mutate.__name__ = change.__name__
    return mutate


def remove_row(rng, rows):
    del rows[rng.randrange(len(rows))]


def remove_rows(rng, rows):
    start = rng.randrange(len(rows))
    del rows[start:start + rng.randint(1, len(rows))]


def duplicate_row(rng, rows):
    rows.insert(rng.randrange(len(rows) + 1), rows[rng.randrange(len(rows))])


def swap_rows(rng, rows):
    a, b = rng.randrange(len(rows)), rng.randrange(len(rows))
    rows[a], rows[b] = rows[b], rows[a]


def shuffle_rows(rng, rows):
    body = rows[1:]
    rng.shuffle(body)
    rows[1:] = body


def change_number(rng, data):
    found = list(NUMBER.finditer(data))
    if not found:
        return flip_bit(rng, data)
    match = rng.choice(found)
    text = match.group().decode()
    near = str(float(text) * (1 + rng.choice([-0.5, 0.1, 1.0]))) if rng.random() < 0.3 else None
    value = near or rng.choice(NUMBERS)
    return data[:match.start()] + value.encode() + data[match.end():]


def swap_fields(rng, data):
    found = list(FIELD.finditer(data))
    if len(found) < 2:
        return flip_bit(rng, data)
    first = rng.randrange(len(found) - 1)
    a, b = found[first], found[min(len(found) - 1, first + rng.randint(1, 6))]
    return (data[:a.start()] + b.group() + data[a.end():b.start()] + a.group() + data[b.end():])


def change_float(rng, data):
    """A float or an integer of a binary file, behind its header."""
    start = data.find(b"end_header\n")
    start = 0 if start < 0 else start + 11
    if len(data) - start < 4:
        return flip_bit(rng, data)
    place = start + 4 * rng.randrange((len(data) - start) // 4)
    value = rng.choice([struct.pack("<f", f) for f in (0, -1, 1e30, float("nan"), float("inf"))] +
                       [struct.pack("<i", i) for i in (-1, 1, 2**31 - 1, -2**31)])
    return data[:place] + value + data[place + 4:]


BINARY = [flip_bit, delete_bytes, insert_bytes, overwrite_bytes, truncate, empty, append,
          change_float, change_float, change_float]
TEXT = [flip_bit, delete_bytes, insert_bytes, overwrite_bytes, truncate, empty, append,
        change_rows(remove_row), change_rows(remove_rows), change_rows(duplicate_row),
        change_rows(swap_rows), change_rows(shuffle_rows),
        change_number, change_number, change_number, change_number, swap_fields, swap_fields]


def mutate(path, number, data):
    """The mutation of that number: the same bytes each time, and what was done."""
    seed = hashlib.sha256(f"{path}:{number}".encode()).digest()
    rng = random.Random(seed)
    kinds = BINARY if path.endswith((".ply", ".bt", ".glb", ".bin")) else TEXT
    if not data:
        return rng.randbytes(rng.randint(1, 64)), "filled"
    names = []
    for _ in range(rng.choice([1, 1, 1, 2])):
        kind = rng.choice(kinds)
        data = kind(rng, data) if data else data
        names.append(kind.__name__)
    return data, "+".join(names)


# Output.

def numbers_and_rest(data):
    return [float(n) for n in NUMBER.findall(data)], NUMBER.sub(b"#", data)


def binary_close(old, new):
    """True where a PLY of the same header differs in its floats by rounding only."""
    end = old.find(b"end_header\n")
    if end < 0 or old[:end] != new[:end] or len(old) != len(new):
        return False
    different = [i for i in range(end, len(old)) if old[i] != new[i]]
    for i in different:  # the float may start up to three bytes before
        ok = False
        for start in range(i - 3, i + 1):
            a, b = (struct.unpack_from("<f", d, start)[0] for d in (old, new)
                    ) if start + 4 <= len(old) else (0.0, 1.0)
            ok = ok or abs(a - b) <= 1e-3 * max(1e-3, abs(a), abs(b))
        if not ok:
            return False
    return True


def close(name, old, new):
    if old == new:
        return True
    if name.endswith(".ply"):
        return binary_close(old, new)
    if name.endswith((".bt", ".glb", ".bin")):
        return False
    (old_numbers, old_rest), (new_numbers, new_rest) = numbers_and_rest(old), numbers_and_rest(new)
    return (old_rest == new_rest and len(old_numbers) == len(new_numbers) and
            all(abs(a - b) <= 1e-3 * max(1e-3, abs(a), abs(b))
                for a, b in zip(old_numbers, new_numbers)))


def files_of(folder):
    return {str(p.relative_to(folder)): p.read_bytes()
            for p in sorted(folder.rglob("*")) if p.is_file()}


# Of an output folder, what may differ between two runs on the same input.
VARYING = re.compile(rb'"(?:wall_s|cpu_s|id|created|map_id|export_id|sha256|bytes|crc32)": *'
                     rb'(?:"[^"]*"|[-+0-9.e]+)')


def without_varying(files):
    return {name: VARYING.sub(b'""', data) if name.endswith(".json") else data
            for name, data in files.items() if not name.endswith(("timings.json", ".lock"))}


def limit_memory():
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


Result = collections.namedtuple("Result", "kind text output")


class Stage:
    """`slcmap map` or `slcmap export` on a folder."""

    def __init__(self, slcmap, command, options, folder, scratch):
        self.slcmap, self.command, self.options, self.scratch = slcmap, command, options, scratch
        self.files = files_of(pathlib.Path(folder))
        good = self.run(self.files)
        if good.kind != "accepted":
            sys.exit(f"{folder}: found a folder that `slcmap {command}` refuses, expected a good "
                     f"one: {good.text}")
        self.good = good

    def run(self, files):
        with tempfile.TemporaryDirectory(dir=self.scratch) as name:
            folder = pathlib.Path(name)
            for path, data in files.items():
                (folder / "in" / path).parent.mkdir(parents=True, exist_ok=True)
                (folder / "in" / path).write_bytes(data)
            try:
                done = subprocess.run(
                    [self.slcmap, self.command, "in", "-o", "out", *self.options], cwd=folder,
                    capture_output=True, timeout=SECONDS, preexec_fn=limit_memory)
            except subprocess.TimeoutExpired:
                return Result("hang", "", {})
            text = done.stderr.decode(errors="replace")
            if done.returncode < 0:
                return Result("crash", f"signal {-done.returncode}", {})
            if done.returncode > 0:
                errors = [line for line in text.splitlines() if "error: " in line]
                if "out of memory" in text:
                    return Result("memory", text.strip(), {})
                good = len(errors) == 1 and done.returncode in (1, 2)
                return Result("refused" if good else "words", text.strip(), {})
            output = files_of(folder / "out") if (folder / "out").exists() else {}
            return Result("accepted", text, without_varying(output))

    def judge(self, path, number):
        data, name = mutate(path, number, self.files[path])
        if data == self.files[path]:
            return "same", name, ""
        result = self.run({**self.files, path: data})
        if result.kind != "accepted":
            return result.kind, name, result.text
        return self.judge_output(result), name, self.changed_files(result)

    def judge_output(self, result):
        old, new = self.good.output, result.output
        if old == new:
            return "same"
        if self.warnings(result.text) - self.warnings(self.good.text):
            return "warned"
        if old.keys() == new.keys() and all(close(n, old[n], new[n]) for n in old):
            return "rounding"
        return "silent"

    @staticmethod
    def warnings(text):
        return {line for line in text.splitlines() if "warning" in line}

    def changed_files(self, result):
        old, new = self.good.output, result.output
        return " ".join(n for n in sorted(old.keys() | new.keys()) if old.get(n) != new.get(n))


def is_wanted(args, name):
    if args.only:
        return args.only.rsplit(":", 1)[0] == name
    return not args.files or name in args.files


def measure(stage, args, bad, path):
    numbers = range(args.mutations)
    if args.only:
        numbers = [int(args.only.rsplit(":", 1)[1])]
    with concurrent.futures.ThreadPoolExecutor(args.jobs) as pool:
        results = list(pool.map(lambda n: stage.judge(path, n), numbers))
    counts = collections.Counter(kind for kind, _, _ in results)
    print(f"{stage.command:7}{path:24}" +
          "".join(f"{kind} {count}  " for kind, count in sorted(counts.items())), flush=True)
    for number, (kind, name, text) in zip(numbers, results):
        if kind in bad or args.only:
            print(f"    {kind}: {path}:{number} {name}: {text[:160]}", flush=True)
    return counts


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", help="folder of `slcmap odometry`; a short one")
    parser.add_argument("map", help="folder of `slcmap map`")
    parser.add_argument("--killed", help="folder of a run that was killed", metavar="RUN")
    parser.add_argument("-n", "--mutations", type=int, default=1000, help="of each file")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--slcmap", default="build/bin/slcmap")
    parser.add_argument("--only", help="FILE:NUMBER, as printed")
    parser.add_argument("--files", nargs="+", metavar="NAME", help="of all folders, these alone")
    parser.add_argument("--accept-changed", action="store_true",
                        help="past the checksums, which refuse whatever else is valid; accepting "
                             "it with other output is then as it should be")
    args = parser.parse_args()
    options = ["--accept-changed"] if args.accept_changed else []
    bad = [kind for kind in BAD if kind != "silent" or not args.accept_changed]
    slcmap = str(pathlib.Path(args.slcmap).resolve())
    scratch = tempfile.mkdtemp(prefix="slcmap_mutations_")
    total = collections.Counter()
    try:
        folders = [("map", args.run), ("export", args.map)]
        if args.killed:
            folders.append(("map", args.killed))
        for command, folder in folders:
            wanted = [name for name in files_of(pathlib.Path(folder)) if is_wanted(args, name)]
            if not wanted:
                continue
            # What is read is the same without images, and a map of them takes long.
            sparse = ["--sparse"] if command == "map" else []
            stage = Stage(slcmap, command, options + sparse, folder, scratch)
            for path in wanted:
                total += measure(stage, args, bad, path)
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
    print("total  " + "  ".join(f"{kind} {count}" for kind, count in sorted(total.items())))
    sys.exit(1 if any(total[kind] for kind in bad) else 0)


if __name__ == "__main__":
    main()
