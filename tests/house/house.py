#!/usr/bin/env python3
"""Counts the rooms of this house and fails where a count is above its limit.

house.py ROOT [LIMITS]: without limits, the counts alone. Counted is the C++ of data, odometry, mapping, export and apps;
words of the README and kilobytes of Markdown are of the whole tree. LIMITS holds rows of a name and a number."""
import os
import re
import sys
from collections import Counter, defaultdict

STAGES = ("data", "odometry", "mapping", "export", "apps")
MADE = {".git", "build", "build-sanitize", "build-tsan", "build-odr", "node_modules", "out"}


def read_tree(root):
    """Text by path of all sources, and the paths of all Markdown files."""
    sources, markdown = {}, []
    for folder, below, names in os.walk(root):
        below[:] = sorted(b for b in below if b not in MADE)
        for name in names:
            path = os.path.relpath(os.path.join(folder, name), root)
            if name.endswith(".md"):
                markdown.append(path)
            if name.endswith((".cc", ".h")) and path.split(os.sep)[0] in STAGES:
                with open(os.path.join(root, path), encoding="utf-8") as file:
                    sources[path] = file.read()
    return sources, markdown


def included(text):
    return set(re.findall(r'^#include "([^"]+)"', text, re.M))


def without_unnamed(text):
    """What other files may see: a type in two of them, of one stage, is one type to the linker."""
    return re.sub(r"^namespace \{\n.*?^\}  // namespace\n", "", text, flags=re.M | re.S)


def arrows_between_folders(sources):
    arrows = defaultdict(set)
    for path, text in sources.items():
        for header in included(text) & sources.keys():
            a, b = os.path.dirname(path), os.path.dirname(header)
            if a != b:
                arrows[a].add(b)
    return arrows


def folders_in_circles(arrows):
    """Folders from which arrows lead back to themselves."""
    def reached(start):
        seen, left = set(), list(arrows[start])
        while left:
            folder = left.pop()
            if folder not in seen:
                seen.add(folder)
                left += arrows.get(folder, ())
        return seen
    return sorted(folder for folder in list(arrows) if folder in reached(folder))


def count_settings(text):
    """Numbers, switches and texts with a default in structs named ...Options."""
    kinds = r"(?:double|float|int|bool|std::size_t|size_t|int64_t|std::string)"
    bodies = re.findall(r"struct \w*Options\w*[^{;]*\{(.*?)\n\};", text, re.S)
    rows = [r for body in bodies for r in re.findall(rf"^\s+{kinds}\s+([^;()]*=[^;()]*);", body, re.M)]
    return sum(row.count("=") for row in rows)


def count_constants(text):
    kinds = r"(?:double|float|int|size_t|std::size_t|int64_t|auto)"
    rows = re.findall(rf"(?:static |inline )?const(?:expr)? {kinds} ([^;]*);", text)
    return sum(row.count("=") for row in rows if re.search(r"=\s*-?[\d.]", row))


def count(root):
    sources, markdown = read_tree(root)
    code = {path: re.sub(r"//[^\n]*", "", text) for path, text in sources.items()}
    headers = [path for path in sources if path.endswith(".h")]
    users = Counter(header for path, text in sources.items() for header in included(text)
                    if os.path.splitext(header)[0] != os.path.splitext(path)[0])
    lines = {path: text.count("\n") for path, text in sources.items()}
    types = [(path.split(os.sep)[0], name) for path, text in code.items()
             for name in set(re.findall(r"^(?:struct|class) (\w+)(?: final)?\s*(?::[^:][^;{]*)?\{", without_unnamed(sources[path]), re.M))]
    numbers = {path: count_settings(text) + count_constants(text) for path, text in code.items()}
    twice = [name for name, n in Counter(types).items() if n > 1]
    for stage, name in twice:
        print(f"in two files of {stage}, of which the program would take one for both: {name}")
    circles = folders_in_circles(arrows_between_folders(sources))
    for folder in circles:
        print("in a circle:", folder)
    with open(os.path.join(root, "README.md"), encoding="utf-8") as file:
        words = len(file.read().split())
    return {
        "files": len(sources),
        "lines": sum(lines.values()),
        "mapping_lines": sum(n for path, n in lines.items() if path.startswith("mapping")),
        "headers_to_30_lines": sum(lines[path] <= 30 for path in headers),
        "headers_with_one_user": sum(users[path] <= 1 for path in headers),
        "types": sum(len(re.findall(r"^\s*(?:struct|class) \w+[^;]*\{", text, re.M)) for text in code.values()),
        "settings": sum(map(count_settings, code.values())),
        "constants": sum(map(count_constants, code.values())),
        "mapping_numbers": sum(n for path, n in numbers.items() if path.startswith("mapping")),
        "folders_in_circles": len(circles),
        "types_of_one_name": len(twice),
        "functions_ending_in_Of": sum(len(set(re.findall(r"\b[A-Z]\w*Of(?=\()", text))) for text in code.values()),
        "longest_file": max(lines.values()),
        "readme_words": words,
        "markdown_kb": sum(os.path.getsize(os.path.join(root, path)) for path in markdown) // 1000,
    }


def read_limits(path):
    with open(path, encoding="utf-8") as file:
        rows = [row.split() for row in file if row.strip() and not row.startswith("#")]
    return {name: int(limit) for name, limit in rows}


def main():
    counts = count(sys.argv[1])
    limits = read_limits(sys.argv[2]) if len(sys.argv) > 2 else {}
    unknown = limits.keys() - counts.keys()
    if unknown:
        sys.exit(f"{sys.argv[2]}: found {sorted(unknown)}, expected names of counts: {sorted(counts)}")
    for name, value in counts.items():
        limit = limits.get(name)
        print(f"{name:30} {value:7}", "" if limit is None else f"of {limit}{'  ABOVE' if value > limit else ''}")
    sys.exit(any(counts[name] > limit for name, limit in limits.items()))


main()
