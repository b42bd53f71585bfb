# write_maps.py FOLDER: the same points, lines and box by open3d and ezdxf in each of their formats.
import sys

import ezdxf
import numpy as np
import open3d as o3d

folder = sys.argv[1] + "/"
i = np.arange(5000)
cloud = o3d.geometry.PointCloud()
cloud.points = o3d.utility.Vector3dVector(np.stack([0.001 * i, np.sin(0.1 * i), i % 7], 1))
o3d.io.write_point_cloud(folder + "a.ply", cloud)
o3d.io.write_point_cloud(folder + "ascii.ply", cloud, write_ascii=True)
o3d.io.write_point_cloud(folder + "a.pcd", cloud)
o3d.io.write_point_cloud(folder + "ascii.pcd", cloud, write_ascii=True)
o3d.io.write_point_cloud(folder + "packed.pcd", cloud, compressed=True)

ends = np.array([[0, 0, 0], [1, 0, 0], [1, 2, 3], [4, 5, 6.5]])
lines = o3d.geometry.LineSet()
lines.points = o3d.utility.Vector3dVector(ends)
lines.lines = o3d.utility.Vector2iVector([[0, 1], [2, 3]])
o3d.io.write_line_set(folder + "lines.ply", lines)
for name, unit, metres in (("metres", 6, 1), ("feet", 2, 0.3048)):
    drawing = ezdxf.new("R2010")
    drawing.header["$INSUNITS"] = unit
    drawing.modelspace().add_line(ends[0] / metres, ends[1] / metres)
    drawing.modelspace().add_polyline3d(ends[2:] / metres)
    drawing.saveas(folder + name + ".dxf")

box = o3d.geometry.TriangleMesh.create_box()
o3d.io.write_triangle_mesh(folder + "mesh.ply", box)
o3d.io.write_triangle_mesh(folder + "mesh.obj", box)
