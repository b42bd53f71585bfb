# What Open3D reads of PLY files: a line each of its name, what it holds, its least and greatest
# coordinates and whether it has colours.
#
#   read_ply.py points|lines|mesh FILE...
import os
import sys

import open3d

READERS = {
    "points": (open3d.io.read_point_cloud, "points"),
    "lines": (open3d.io.read_line_set, "lines"),
    "mesh": (open3d.io.read_triangle_mesh, "triangles"),
}


def bounds(geometry):
    ends = list(geometry.get_min_bound()) + list(geometry.get_max_bound())
    return " ".join(f"{value:.3f}" for value in ends)


def has_colours(geometry):
    asked = getattr(geometry, "has_vertex_colors", None) or geometry.has_colors
    return "coloured" if asked() else "plain"


read, parts = READERS[sys.argv[1]]
for path in sys.argv[2:]:
    read_back = read(path)
    count = len(getattr(read_back, parts))
    print(os.path.basename(path), count, bounds(read_back), has_colours(read_back))
