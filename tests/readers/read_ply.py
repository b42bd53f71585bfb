# What Open3D reads of the PLY files of an export: a line each of its folder and name, what it holds,
# its least and greatest coordinates and whether it has colours.
#
#   read_ply.py FILE...
import sys

import open3d

LINES = (open3d.io.read_line_set, "lines")
MESH = (open3d.io.read_triangle_mesh, "triangles")
READERS = {"lines": LINES, "trajectory": LINES, "voxels": MESH, "line_bars": MESH}
POINTS = (open3d.io.read_point_cloud, "points")


def bounds(geometry):
    ends = list(geometry.get_min_bound()) + list(geometry.get_max_bound())
    return " ".join(f"{value:.3f}" for value in ends)


def has_colours(geometry):
    asked = getattr(geometry, "has_vertex_colors", None) or geometry.has_colors
    return "coloured" if asked() else "plain"


for path in sys.argv[1:]:
    folder, name = path.split("/")[-2:]
    read, parts = READERS.get(name.removesuffix(".ply"), POINTS)
    read_back = read(path)
    count = len(getattr(read_back, parts))
    print(f"{folder}/{name}", count, bounds(read_back), has_colours(read_back))
