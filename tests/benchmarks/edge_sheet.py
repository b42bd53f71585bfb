#!/usr/bin/env python3
"""Draws places of a map's lines into the images, for people to say which are edges.

    edge_sheet.py MAP SEQUENCE -o FOLDER [--count 200] [--seed 1]

Places are drawn at random by length from lines.ply (what the map calls edges). Each is shown in the
keyframe that sees it best and nothing of the dense cloud hides it in: between two pairs of ticks
that leave the line itself free, twice as large as in the image, and once more as a small view of
the surroundings. Writes sheet_1.png ... with numbered places, 20 each, and places.csv (number,
line, length in all, probability); a reader answers edge, mark or nothing for each number.
SEQUENCE is an ASL folder; the calibration is the map's. Images are made for people to look at,
not to be kept with the project.
"""
import argparse
import csv
import json
import pathlib

import cv2
import numpy as np
import yaml


def read_ply(path):
    """The elements of a binary PLY file, as structured arrays by name."""
    kinds = {"float": "<f4", "double": "<f8", "uchar": "u1", "int": "<i4", "uint": "<u4",
             "char": "i1", "short": "<i2", "ushort": "<u2"}
    data = pathlib.Path(path).read_bytes()
    end = data.index(b"end_header\n") + len(b"end_header\n")
    elements = []
    for words in (line.split() for line in data[:end].decode("latin1").splitlines()):
        if words and words[0] == "element":
            elements.append((words[1], int(words[2]), []))
        elif words and words[0] == "property":
            elements[-1][2].append((words[2], kinds[words[1]]))
    read = {}
    for name, count, fields in elements:
        read[name] = np.frombuffer(data, np.dtype(fields), count, end)
        end += count * np.dtype(fields).itemsize
    return read


def rotation(q):
    x, y, z, w = q
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


class Views:
    """The left images at keyframes, and the camera that took them."""

    def __init__(self, map_folder, sequence):
        chain = yaml.safe_load((map_folder / "calibration.yaml").read_text())["cam0"]
        fx, fy, cx, cy = chain["intrinsics"]
        self.K = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]])
        self.is_fisheye = chain["distortion_model"] == "equidistant"
        self.coefficients = np.array(chain["distortion_coeffs"], float)
        self.width, self.height = chain["resolution"]
        T_camera_imu = np.array(chain["T_cam_imu"], float)
        self.poses = []
        for row in np.atleast_2d(np.loadtxt(map_folder / "keyframes.tum")):
            T_world_imu = np.eye(4)
            T_world_imu[:3, :3], T_world_imu[:3, 3] = rotation(row[4:]), row[1:4]
            self.poses.append((row[0], T_camera_imu @ np.linalg.inv(T_world_imu)))
        folder = sequence / "mav0" if (sequence / "mav0").is_dir() else sequence
        with open(folder / "cam0" / "data.csv") as file:
            rows = [row for row in csv.reader(file) if row and not row[0].startswith("#")]
        self.files = {int(row[0]): folder / "cam0" / "data" / row[1].strip() for row in rows}
        self.stamps = np.array(sorted(self.files))

    def image(self, view):
        stamp = self.stamps[np.argmin(np.abs(self.stamps - self.poses[view][0] * 1e9))]
        return cv2.imread(str(self.files[int(stamp)]), cv2.IMREAD_GRAYSCALE)

    def project(self, view, points):
        """Pixels of points in the world, and how far before the camera they are."""
        T = self.poses[view][1]
        local = points @ T[:3, :3].T + T[:3, 3]
        ahead = np.maximum(local[:, 2:], 1e-3)
        rays = np.ascontiguousarray((local / ahead)[:, None, :])
        zero = np.zeros(3)
        if self.is_fisheye:
            pixels, _ = cv2.fisheye.projectPoints(rays, zero, zero, self.K, self.coefficients[:4])
        else:
            pixels, _ = cv2.projectPoints(rays, zero, zero, self.K, self.coefficients)
        # Beyond the image distortion may fold back into it.
        wide = np.hypot(rays[:, 0, 0], rays[:, 0, 1]) > 2.5
        pixels = pixels[:, 0]
        pixels[wide] = -1e6
        return pixels, local[:, 2]


def is_seen(views, view, place, cloud):
    """Whether no two points of the cloud stand before a place in a view."""
    pixel, depth = views.project(view, place[None])
    pixels, depths = views.project(view, cloud)
    near = np.hypot(*(pixels - pixel[0]).T) < 6
    return np.count_nonzero(near & (depths > 0.2) & (depths < depth[0] - 0.15)) < 2


def best_view(views, start, end, place, cloud):
    """The view that looks across the line from nearby, with the place well inside the image."""
    order = []
    for view in range(len(views.poses)):
        pixels, depths = views.project(view, np.array([start, end, place]))
        u, v = pixels[2]
        if not (60 < u < views.width - 60 and 60 < v < views.height - 60):
            continue
        if depths.min() < 0.3 or depths[2] > 6:
            continue
        length_px = np.hypot(*(pixels[1] - pixels[0]))
        if length_px >= 12:
            order.append((-length_px, view))
    for _, view in sorted(order)[:12]:
        if is_seen(views, view, place, cloud):
            return view
    return None


def draw_cell(views, view, start, end, number, side=240):
    image = views.image(view)
    pixels, _ = views.project(view, np.linspace(start, end, 9))
    centre = pixels[4]
    large = cv2.cvtColor(cv2.getRectSubPix(image, (side // 2, side // 2), tuple(map(float, centre))),
                         cv2.COLOR_GRAY2BGR)
    large = cv2.resize(large, (side, side), interpolation=cv2.INTER_CUBIC)
    way = (pixels[-1] - pixels[0]) / np.hypot(*(pixels[-1] - pixels[0]))
    across = np.array([-way[1], way[0]])
    for p in (pixels[0], pixels[-1]):
        at = 2 * (p - centre) + side / 2
        for sign in (-1, 1):
            a, b = at + sign * 6 * across, at + sign * 16 * across
            cv2.line(large, tuple(map(int, a)), tuple(map(int, b)), (0, 0, 255), 2, cv2.LINE_AA)
    around = cv2.cvtColor(image, cv2.COLOR_GRAY2BGR)
    ends = pixels[0] - 8 * way, pixels[-1] + 8 * way
    cv2.line(around, tuple(map(int, ends[0])), tuple(map(int, ends[1])), (0, 0, 255), 3)
    around = cv2.resize(around, (side, side * image.shape[0] // image.shape[1]),
                        interpolation=cv2.INTER_AREA)
    cell = np.vstack([large, around])
    cv2.putText(cell, str(number), (5, 24), cv2.FONT_HERSHEY_SIMPLEX, 0.8, (0, 255, 255), 2)
    return cv2.copyMakeBorder(cell, 3, 3, 3, 3, cv2.BORDER_CONSTANT, value=(255, 255, 255))


def draw_places(lines, vertices, count, random):
    """Pieces of up to 0.4 m around places that are drawn by length."""
    starts = np.stack([vertices[axis][lines["vertex1"]] for axis in "xyz"], 1).astype(float)
    ends = np.stack([vertices[axis][lines["vertex2"]] for axis in "xyz"], 1).astype(float)
    lengths = np.linalg.norm(ends - starts, axis=1)
    for line in random.choice(len(lines), 4 * count, p=lengths / lengths.sum()):
        way = (ends[line] - starts[line]) / lengths[line]
        along = random.uniform(0, lengths[line])
        low, high = max(0, along - 0.2), min(lengths[line], along + 0.2)
        yield line, lengths[line], starts[line] + low * way, starts[line] + high * way


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("map", type=pathlib.Path)
    parser.add_argument("sequence", type=pathlib.Path)
    parser.add_argument("-o", "--output", type=pathlib.Path, required=True)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    random = np.random.default_rng(arguments.seed)
    views = Views(arguments.map, arguments.sequence)
    ply = read_ply(arguments.map / "lines.ply")
    dense = read_ply(arguments.map / "dense.ply")["vertex"]
    cloud = np.stack([dense[axis] for axis in "xyz"], 1).astype(float)
    arguments.output.mkdir(parents=True, exist_ok=True)
    cells, rows, unseen = [], [], 0
    for line, length, start, end in draw_places(ply["edge"], ply["vertex"], arguments.count, random):
        if len(cells) == arguments.count:
            break
        view = best_view(views, start, end, 0.5 * (start + end), cloud)
        if view is None:
            unseen += 1
            continue
        cells.append(draw_cell(views, view, start, end, len(cells) + 1))
        rows.append([len(cells), int(line), f"{length:.3f}",
                     f"{ply['edge']['edge_probability'][line]:.3f}"])
    for sheet, first in enumerate(range(0, len(cells), 20), 1):
        some = cells[first:first + 20]
        some += [np.full_like(some[0], 255)] * (-len(some) % 5)
        rows_of_cells = [np.hstack(some[i:i + 5]) for i in range(0, len(some), 5)]
        cv2.imwrite(str(arguments.output / f"sheet_{sheet}.png"), np.vstack(rows_of_cells))
    with open(arguments.output / "places.csv", "w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["number", "line", "length_m", "edge_probability"])
        writer.writerows(rows)
    print(json.dumps({"places": len(cells), "without_a_view": unseen}))


if __name__ == "__main__":
    main()
