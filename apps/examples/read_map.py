#!/usr/bin/env python3
"""Reads a map with numpy alone: its lines by axis, and its rooms.

usage: read_map.py MAP
"""
import json
import sys

import numpy as np

TYPES = {"char": "i1", "uchar": "u1", "short": "<i2", "ushort": "<u2", "int": "<i4", "uint": "<u4",
         "float": "<f4", "double": "<f8"}


def read_ply(path):
    """The elements of a binary PLY file without lists, as arrays with the properties' names."""
    elements = []
    with open(path, "rb") as file:
        while (row := file.readline().decode().split()) != ["end_header"]:
            if row[0] == "element":
                elements.append((row[1], int(row[2]), []))
            elif row[0] == "property":
                elements[-1][2].append((row[2], TYPES[row[1]]))
        return {name: np.fromfile(file, np.dtype(properties), count)
                for name, count, properties in elements}


def main():
    folder = sys.argv[1] if len(sys.argv) == 2 else sys.exit(__doc__)
    lines = read_ply(folder + "/lines.ply")
    points_m = np.stack([lines["vertex"][axis] for axis in "xyz"], axis=1)
    edges = lines["edge"]
    lengths_m = np.linalg.norm(points_m[edges["vertex2"]] - points_m[edges["vertex1"]], axis=1)
    for axis, name in enumerate(["x", "y", "vertical", "no axis", "sloped"]):
        of_axis = edges["axis"] == axis
        print(f"{name}: {of_axis.sum()} lines, {lengths_m[of_axis].sum():.1f} m")
    with open(folder + "/rooms.json", encoding="utf-8") as file:
        for room in json.load(file):
            print(f"room {room['id']}: {room['area_m2']:.1f} m2")


if __name__ == "__main__":
    main()
