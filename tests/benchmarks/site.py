#!/usr/bin/env python3
"""Makes a site of 24 walks in three buildings of two storeys, two of them damaged, and measures its maps.

    tests/benchmarks/site.py make PLANS SITE [--slcmap build/bin/slcmap] [--whole] [--only NAME...]
    slcmap batch SITE/site.yaml -o SITE/out
    tests/benchmarks/site.py measure SITE

PLANS: a folder with floor_2.png, floor_3.png and floor_EG.png, drawings of real floors, 1 cm a pixel.
Two storeys of A are real floors that look alike about their lifts; those of B look alike throughout, and
two walks go over their stairs; C has an office below and a real floor above. All have control points. EuRoC's rig, with half its pixels but for --whole, 10 pairs a second. Needs gdal_translate
(gdal-bin) and numpy.
"""

import argparse
import json
import math
import pathlib
import random
import re
import shutil
import subprocess

import numpy

ROOT = pathlib.Path(__file__).resolve().parents[2]
LEFT, BOTTOM, WIDTH, HEIGHT = 13.0, 20.6, 29.4, 12.9  # metres of the floors that are used
PLACE = {"A": [691604.2, 5334750.6, 515.3], "B": [691660.5, 5334801.7, 514.8],
         "C": [691711.8, 5334702.4, 514.1]}
UPPER_M = 3.6  # from floor to floor
OFFICE = [(1.2, -0.99, 180), (4.4, -0.99, 180), (9.8, -0.99, 180), (11.8, -0.99, 180), (5.4, 0.99, 0),
          (8.0, 0.99, 0), (10.9, 0.99, 0), (13.6, 0.99, 0), (0.01, 0.4, 90)]
CORRIDOR = [(-7.4, 1.48, 0), (-10.6, 1.48, 0), (-4.5, 1.48, 0), (-10.4, -1.48, 180), (-7.2, -1.48, 180),
            (-4.5, -1.48, 180), (-12.98, 0.7, 90), (-2.6, 1.48, 0)]
REAL = {  # walks about the lifts
    "floor_2": [[(18.2, 26.5), (18.6, 23.8), (25.5, 23.6)], [(23.0, 23.5), (31.5, 23.7)],
                [(29.5, 23.6), (36.6, 23.6), (37.2, 26.0)], [(37.3, 24.2), (37.2, 29.6), (34.0, 30.1)]],
    "floor_3": [[(18.2, 26.5), (18.6, 23.8), (25.5, 23.6)], [(23.0, 23.5), (31.5, 23.7)],
                [(18.3, 25.4), (18.4, 29.6), (22.0, 30.0)], [(20.5, 29.9), (28.5, 30.0)]],
    "floor_EG": [[(16.4, 26.5), (16.9, 23.8), (24.0, 23.6)], [(21.5, 23.5), (30.0, 23.7)],
                 [(28.0, 23.6), (36.0, 23.6)], [(34.5, 23.6), (38.8, 23.8), (39.2, 27.0)]],
}
STAIRS = [(-5.5, -0.7, 1.5), (0.4, -0.8, 1.5), (3.4, -0.8, 3.2), (4.1, -0.5, 3.2), (4.1, 0.5, 3.2),
          (3.4, 0.8, 3.2), (0.6, 0.8, 4.9), (-5.5, 0.8, 4.9)]


def read_plan(path, folder):
    """True where a wall is, within a frame; rows from the bottom, 1 cm."""
    size = [round(100 * length) for length in (WIDTH, HEIGHT)]
    top = 4206 - round(100 * (BOTTOM + HEIGHT))
    raw = folder / (path.stem + ".raw")
    subprocess.run(["gdal_translate", "-q", "-of", "ENVI", "-srcwin", str(round(100 * LEFT)), str(top),
                    str(size[0]), str(size[1]), path, raw], check=True)
    walls = numpy.fromfile(raw, numpy.uint8).reshape(size[1], size[0])[::-1] < 128
    for edge in (walls[:25], walls[-25:], walls[:, :25], walls[:, -25:]):
        edge[:] = True
    return walls


def find_tags(walls, walks):
    """Places on straight walls beside the walks, some metres from each other: x, y, yaw_deg."""
    tags = []
    for x, y in (point for walk in walks for point in densify(walk, 0.5)):
        for dx, dy, yaw_deg in ((0, 1, 0), (0, -1, 180), (1, 0, -90), (-1, 0, 90)):
            def reach(side):
                column, row = round(100 * (x - dy * side)), round(100 * (y + dx * side))
                for step in range(400):
                    if walls[row + dy * step, column + dx * step]:
                        return step
                return 400
            steps = {reach(side) for side in (-0.25, 0, 0.25)}
            if max(steps) - min(steps) > 1 or not 60 < min(steps) < 350:
                continue
            far = min(steps) / 100 - 0.02
            at = (x + dx * far, y + dy * far, yaw_deg)
            if all(math.dist(at[:2], other[:2]) > 2.4 for other in tags):
                tags.append(at)
    return tags


def densify(walk, step_m):
    points = []
    for a, b in zip(walk, walk[1:]):
        count = max(1, round(math.dist(a, b) / step_m))
        points += [tuple(p + (q - p) * i / count for p, q in zip(a, b)) for i in range(count)]
    return points + [walk[-1]]


def tag_objects(tags, first, floor_m=0):
    return [{"kind": "tag", "name": f"tag36h11:{first + i}", "at": [x, y, floor_m + 1.45 + 0.3 * (i % 2)],
             "yaw_deg": yaw_deg, "size": 0.4} for i, (x, y, yaw_deg) in enumerate(tags)]


def real_floor(name, plans, folder, first_tag):
    """A scene of a drawing and its walks, from its lower left corner."""
    walls = read_plan(plans / (name + ".png"), folder)
    (folder / (name + ".pgm")).write_bytes(
        b"P5 %d %d 255\n" % walls.shape[::-1] + numpy.where(walls[::-1], 0, 255).astype("u1").tobytes())
    walks = [[(x - LEFT, y - BOTTOM) for x, y in walk] for walk in REAL[name]]
    way = [point for walk in walks for point in densify(walk, 0.3)]
    (folder / (name + ".tum")).write_text(
        "".join(f"{i} {x} {y} 1.5 0 0 0 1\n" for i, (x, y) in enumerate(way)))
    plan = {"image": name + ".pgm", "pixel_m": 0.01, "walls": ["plaster"], "glazed_m": 0, "furniture": 0.35,
            "keep_clear": name + ".tum", "seed": first_tag}
    plaster = {"plaster": {"texture": "plaster", "albedo": 0.7, "contrast": 0.5, "seed": first_tag}}
    return {"ambient": 0.12, "materials": plaster, "plan": plan, "objects": tag_objects(find_tags(walls, walks), first_tag)}, \
        [[(x, y, 1.5) for x, y in walk] for walk in walks]


def write_scene(folder, name, scene, walk, speed_m_s=0.85):
    walk = {"kind": "walk", "speed_m_s": speed_m_s, "corner_m": 0.3, "stand_still_s": 0.6,
            "waypoints_m": walk}
    path = folder / (name + ".yaml")
    path.write_text(json.dumps({**scene, "name": name, "trajectory": walk}))  # JSON is YAML
    return path


def list_walks(plans, folder):
    """Of each walk: name, building, storey, scene, way and speed."""
    def placed(building, upper):
        origin_m = [*PLACE[building][:2], PLACE[building][2] + (UPPER_M if upper else 0)]
        return {"crs": "EPSG:25832", "origin_m": origin_m, "turn_deg": 33}
    office = {"base": str(ROOT / "config/scenes/office_floor.yaml"), "objects": tag_objects(OFFICE, 200)}
    office_walks = [[(0.9, 0, 1.5), (8.2, 0.1, 1.5)], [(6.4, 0, 1.5), (14.8, 0, 1.5)],
                    [(5.5, 0, 1.5), (3.3, -0.1, 1.5), (2.9, -0.6, 1.5), (2.9, -2.4, 1.5), (2.3, -3.3, 1.5)],
                    [(9.5, 0, 1.5), (11.6, 0, 1.5), (12.1, 0.5, 1.5), (12.1, 2.4, 1.5), (11.5, 3.1, 1.5)]]
    storeys = [("A", "2", *real_floor("floor_2", plans, folder, 1), False),
               ("A", "3", *real_floor("floor_3", plans, folder, 100), True),
               ("C", "ground", office, office_walks, False),
               ("C", "first", *real_floor("floor_EG", plans, folder, 300), True)]
    walks = []
    for building, storey, scene, ways, upper in storeys:
        scene = {**scene, "georeference": placed(building, upper)}
        walks += [(f"{building}_{storey}_{i}", building, storey, scene, way, 0.85)
                  for i, way in enumerate(ways)]
    corridors = {"base": str(ROOT / "config/scenes/identical_storeys.yaml"),
                 "objects": tag_objects(CORRIDOR, 400) + tag_objects(CORRIDOR, 450, 3.4),
                 "georeference": placed("B", False)}
    for storey, z in (("lower", 1.5), ("upper", 4.9)):
        ways = [[(-4.6, -0.6, z), (-11.3, -0.7, z)], [(-11.5, -0.3, z), (-11.2, 0.6, z), (-4.8, 0.6, z)],
                [(-10.0, 0.4, z), (-3.6, 0.6 if z > 3 else -0.5, z)]]
        walks += [(f"B_{storey}_{i}", "B", storey, corridors, way, 0.85) for i, way in enumerate(ways)]
    walks += [("B_up", "B", "", corridors, STAIRS, 1.2), ("B_down", "B", "", corridors, STAIRS[::-1], 1.2)]
    return walks


def write_small_rig(path):
    """EuRoC's with half the pixels along each side."""
    def halved(match):
        fx, fy, cx, cy = (float(value) for value in match[1].split(","))
        return f"intrinsics: [{fx / 2}, {fy / 2}, {(cx + 0.5) / 2 - 0.5}, {(cy + 0.5) / 2 - 0.5}]"
    text = (ROOT / "config/rigs/euroc.yaml").read_text().replace("[752, 480]", "[376, 240]")
    path.write_text(re.sub(r"intrinsics: \[(.*?)\]", halved, text))
    return path


def damage(folder):
    """One recording that was cut off as it began, and one whose IMU was not recorded."""
    cut = folder / "walks/A_2_3/mav0"
    for camera in ("cam0", "cam1"):
        rows = (cut / camera / "data.csv").read_text().splitlines(True)
        (cut / camera / "data.csv").write_text("".join(rows[:8]))
    imu = folder / "walks/C_ground_3/mav0/imu0/data.csv"
    imu.write_text(imu.read_text().splitlines(True)[0])


def write_control(folder, building, names):
    """What all walks of a building have in truth, 5 mm off."""
    noise, rows = random.Random(5), {}
    for name in names:
        header, *lines = (folder / "walks" / name / "truth/control.csv").read_text().splitlines()
        rows.update({line.split(",")[0]: line.split(",") for line in lines})
    text = header + "\n"
    for row in rows.values():
        text += ",".join([row[0], *(f"{float(value) + noise.gauss(0, 0.005):.4f}" for value in row[1:4]),
                          *row[4:]]) + "\n"
    (folder / f"control_{building}.csv").write_text(text)


def make(arguments):
    folder = arguments.site
    (folder / "scenes").mkdir(parents=True, exist_ok=True)
    walks = list_walks(arguments.plans, folder / "scenes")
    rig = ROOT / "config/rigs/euroc.yaml" if arguments.whole else write_small_rig(folder / "scenes/rig.yaml")
    for seed, (name, _, _, scene, way, speed_m_s) in enumerate(walks):
        output = folder / "walks" / name
        path = write_scene(folder / "scenes", name, scene, way, speed_m_s)
        if output.exists() or (arguments.only and name not in arguments.only):
            continue
        made = output.with_suffix(".made")
        shutil.rmtree(made, ignore_errors=True)
        subprocess.run([arguments.slcmap, "-q", "simulate", path, "-o", made, "--rate", "10", "--rig", rig,
                        "--seed", str(seed + 1)], check=True)
        made.rename(output)
    if arguments.only:
        return
    for building in PLACE:
        write_control(folder, building, [walk[0] for walk in walks if walk[1] == building])
    damage(folder)
    site = {"recordings": [{"path": f"walks/{name}", "building": building, "storey": storey,
                            "date": f"2026-03-{day + 1:02}"}
                           for day, (name, building, storey, *_) in enumerate(walks)],
            "control": [{"building": building, "points": f"control_{building}.csv", "crs": "EPSG:25832"}
                        for building in PLACE],
            "exports": ["page", "las", "gpkg"]}
    (folder / "site.yaml").write_text(json.dumps(site, indent=1))


def read_poses(path):
    return numpy.array([[float(value) for value in line.split()[:4]] for line in
                        path.read_text().splitlines() if not line.startswith("#")])


def errors_of(poses, runs, folder):
    """Places of a map and where they truly are, by the name of their walk."""
    places = {}
    for run in runs:
        sequence = pathlib.Path(run["sequence"])
        name = (sequence.parent if sequence.name == "mav0" else sequence).name
        shift_s = run["stamps_moved_ns"] / 1e9
        is_own = (poses[:, 0] > run["first_pose_ns"] / 1e9 - 1e-3) & (poses[:, 0] < run["last_pose_ns"] / 1e9 + 1e-3)
        truth = read_poses(folder / "walks" / name / "truth/trajectory.tum")
        own = poses[is_own]
        at = [numpy.interp(own[:, 0] - shift_s, truth[:, 0], truth[:, axis]) for axis in (1, 2, 3)]
        upper = name.startswith(("A_3", "C_first"))
        places[name] = own[:, 1:], numpy.stack(at, 1) + [0, 0, UPPER_M if upper else 0]
    return places


def align(found, true):
    """Found places as a turn about z and a shift bring them nearest to the true ones."""
    a, b = found - found.mean(0), true - true.mean(0)
    turn = math.atan2((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum(), (a[:, :2] * b[:, :2]).sum())
    c, s = math.cos(turn), math.sin(turn)
    return a @ numpy.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) + true.mean(0)


def measure(arguments):
    out = arguments.site / "out"
    status = json.loads((out / "status.json").read_text())
    for state in ("done", "failed"):
        names = [entry["name"] for entry in status["recordings"] if entry["state"] == state]
        print(f"{state}: {len(names)} {'' if state == 'done' else names}")
    for path in sorted({entry["map"] for entry in status["recordings"] if entry["map"]}):
        description = json.loads((out / path / "map.json").read_text())
        runs = description.get("merged", [])
        places = errors_of(read_poses(out / path / "trajectory.tum"), runs, arguments.site)
        if not places:
            print(f"{path}: one walk")
            continue
        found, true = (numpy.concatenate([pair[i] for pair in places.values()]) for i in (0, 1))
        off = align(found, true) - true
        rms = lambda e: math.sqrt((e ** 2).sum(1).mean())
        ends = numpy.cumsum([len(pair[0]) for pair in places.values()])[:-1]
        each = {name: rms(part) for name, part in zip(places, numpy.split(off, ends))}
        worst = max(each, key=each.get)
        print(f"{path}: {len(places)} walks, APE in one frame {rms(off):.4f} m, worst {worst} {each[worst]:.4f} m")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    commands = parser.add_subparsers(required=True)
    command = commands.add_parser("make")
    command.add_argument("plans", type=pathlib.Path)
    command.add_argument("site", type=pathlib.Path)
    command.add_argument("--slcmap", default="build/bin/slcmap")
    command.add_argument("--whole", action="store_true", help="images with all their pixels")
    command.add_argument("--only", nargs="*", default=[])
    command.set_defaults(do=make)
    command = commands.add_parser("measure")
    command.add_argument("site", type=pathlib.Path)
    command.set_defaults(do=measure)
    arguments = parser.parse_args()
    arguments.do(arguments)


if __name__ == "__main__":
    main()
