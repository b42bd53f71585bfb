"""Whether page, SVG, DXF, IFC and OBJ show the same walls at the same places, with one number each.

    same_walls.py FOLDER PAGE_JSON    # what write_walls and read_page.mjs wrote

Each is read by a reader of its own. Prints what differs, and fails.
"""
import json
import math
import re
import sys

STEP_M = 0.04  # of the points that are looked at
FAULTS = []


def expect(holds, text):
    if not holds:
        FAULTS.append(text)


# Areas are lists of segments, within which a point is where a ray from it crosses an odd number.
def segments(ring):
    return list(zip(ring, ring[1:] + ring[:1]))


def inside(area, p):
    odd = False
    for (ax, ay), (bx, by) in area:
        if (ay > p[1]) != (by > p[1]) and p[0] < ax + (p[1] - ay) / (by - ay) * (bx - ax):
            odd = not odd
    return odd


def distance(segment, p):
    (ax, ay), (bx, by) = segment
    length2 = (bx - ax) ** 2 + (by - ay) ** 2
    at = max(0, min(1, ((p[0] - ax) * (bx - ax) + (p[1] - ay) * (by - ay)) / max(length2, 1e-12)))
    return math.hypot(ax + at * (bx - ax) - p[0], ay + at * (by - ay) - p[1])


def box(points):
    return [f(p[k] for p in points) for f in (min, max) for k in (0, 1)]


def read_page(path):
    with open(path) as file:
        return json.load(file)["walls"]


def read_svg(path):
    text = open(path, encoding="utf-8").read()
    scale = int(re.search(r"1:(\d+)", text)[1]) / 1000
    places = lambda d: [(float(x) * scale, -float(y) * scale)
                        for x, y in re.findall(r"(-?[\d.]+) (-?[\d.]+)", d)]
    group = lambda name: re.search(f'<g id="{name}".*?</g>', text, re.S)[0]
    # Areas that were measured on both sides are drawn again over all others.
    rings = [places(ring) for ring in re.findall(r"M[^MZ]*Z", group("assumed_areas"))]
    # The legend is in the title block, the lowest 38 mm of the sheet.
    height_mm = float(re.search(r'height="([\d.]+)mm"', text)[1])
    in_plan = lambda p: p[1] > -(height_mm - 38) * scale
    rings = [ring for ring in rings if all(map(in_plan, ring))]
    strokes = [places(d) for name in ("openings", "overhead")
               for d in re.findall(r'd="(.*?)"', group(name))]
    strokes = [stroke for stroke in strokes if all(map(in_plan, stroke))]
    texts = [(places(at)[0], name) for at, name in
             re.findall(r'translate\((.*?)\)[^>]*>(W\d+ ~?[\d.]+)<', text)]
    return {"area": [s for ring in rings for s in segments(ring)], "strokes": strokes,
            "texts": [(at, name) for at, name in texts if in_plan(at)]}


def read_dxf(path):
    rows = open(path, encoding="latin-1").read().split("\n")
    pairs = list(zip(rows[0::2], rows[1::2]))
    area, texts, now = [], [], {}
    section = ""
    for code, value in ((int(c), v) for c, v in pairs if c.strip()):
        if code == 2 and now.get(0) == "SECTION":
            section = value
        if code != 0:
            now[code] = value
            continue
        xy = lambda c: (float(now[c]), float(now[c + 10]))
        if section == "ENTITIES" and now.get(0) == "LINE" and now[8].startswith("S0_WALL"):
            area.append((xy(10), xy(11)))
        if section == "ENTITIES" and now.get(0) == "TEXT" and re.match(r"W\d+ ", now[1]):
            texts.append((xy(11 if 11 in now else 10), now[1]))
        now = {0: value}
    return {"area": area, "texts": texts}


class Ifc:
    """Solids of walls and openings seen from above."""

    def __init__(self, path):
        text = open(path, encoding="latin-1").read()
        self.rows = {number: (kind, self.split(arguments)) for number, kind, arguments in
                     re.findall(r"^(#\d+)\s*=\s*(\w+)\((.*)\);", text, re.M)}

    @staticmethod
    def split(text):
        parts, depth, quoted, part = [], 0, False, ""
        for c in text:
            quoted ^= c == "'"
            depth += 0 if quoted else (c == "(") - (c == ")")
            if c == "," and depth == 0 and not quoted:
                parts.append(part)
                part = ""
            else:
                part += c
        return parts + [part]

    def numbers(self, reference):
        return [float(n) for n in re.findall(r"-?\d+\.?\d*(?:E-?\d+)?", self.rows[reference][1][0])]

    def turned(self, axes, points):
        """Points in what an axis placement is in."""
        origin, *directions = self.rows[axes][1]
        x, y = self.numbers(origin)[:2]
        along = directions[-1]
        c, s = self.numbers(along)[:2] if along != "$" else (1, 0)
        return [(x + c * px - s * py, y + s * px + c * py) for px, py in points]

    def placed(self, placement, points):
        parent, axes = self.rows[placement][1]
        points = self.turned(axes, points)
        return points if parent == "$" else self.placed(parent, points)

    def profile(self, reference):
        kind, arguments = self.rows[reference]
        if kind == "IFCRECTANGLEPROFILEDEF":
            x, y = (0.5 * float(n) for n in arguments[3:5])
            return self.turned(arguments[2], [(-x, -y), (x, -y), (x, y), (-x, y)])
        expect(kind == "IFCARBITRARYCLOSEDPROFILEDEF", f"IFC: profile {kind}")
        points = re.findall(r"#\d+", self.rows[arguments[2]][1][0])
        return [tuple(self.numbers(p)[:2]) for p in points][:-1]

    def solids(self, kind):
        for name, arguments in self.rows.values():
            if name != kind:
                continue
            shapes = re.findall(r"#\d+", self.rows[arguments[6]][1][2])
            for shape in shapes:
                item = re.findall(r"#\d+", self.rows[shape][1][3])[0]
                if self.rows[item][0] != "IFCEXTRUDEDAREASOLID":
                    continue
                outline = self.profile(self.rows[item][1][0])
                position = self.rows[item][1][1]
                outline = outline if position == "$" else self.turned(position, outline)
                yield arguments[2].strip("'"), self.placed(arguments[5], outline)


def read_obj(path):
    vertices, faces, current = [], [], ""
    for row in open(path):
        kind, *values = row.split() or [""]
        if kind == "o":
            current = values[0]
        elif kind == "v":
            vertices.append(tuple(float(v) for v in values[:3]))
        elif kind == "f" and "WALL_PLANE" in current:
            faces.append([vertices[int(v.split("/")[0]) - 1] for v in values])
    return faces


def check_numbers(what, texts, walls):
    """A wall's number stands beside it, and no other is nearer."""
    for at, text in texts:
        near = {wall["id"]: min(distance(s, at) for part in wall["parts"] for s in segments(part))
                for wall in walls}
        number = int(re.match(r"W(\d+)", text)[1])
        nearest = min(near, key=near.get)
        expect(number == nearest and near[number] < 0.6, f"{what}: {text} is beside wall {nearest}")
    numbers = sorted(int(re.match(r"W(\d+)", text)[1]) for _, text in texts)
    expect(numbers == [wall["id"] for wall in walls], f"{what}: walls {numbers}")


def check_area(what, area, page, corners_m2):
    """Corners are closed in some outputs, and left open in others."""
    points = [p for s in page for p in s]
    low_x, low_y, high_x, high_y = box(points)
    only = {"page": 0, what: 0}
    both = 0
    for i in range(math.ceil((high_x - low_x + 1) / STEP_M)):
        for j in range(math.ceil((high_y - low_y + 1) / STEP_M)):
            p = (low_x - 0.5 + i * STEP_M, low_y - 0.5 + j * STEP_M)
            here, there = inside(page, p), inside(area, p)
            both += here and there
            only["page"] += here and not there
            only[what] += there and not here
    cell = STEP_M * STEP_M
    expect(both * cell > 5, f"{what}: walls of {both * cell:.2f} m2, expected more than 5")
    expect(only["page"] * cell < 0.15, f"{what}: {only['page'] * cell:.2f} m2 is on the page only")
    expect(only[what] * cell < corners_m2 + 0.15,
           f"{what}: {only[what] * cell:.2f} m2 is not on the page")


def main(folder, page_json):
    walls = read_page(page_json)
    page = [s for wall in walls for part in wall["parts"] for s in segments(part)]
    corners_m2 = 4 * 0.2 * 0.2

    dxf = read_dxf(folder + "/export/plan.dxf")
    check_area("DXF", dxf["area"], page, corners_m2)
    check_numbers("DXF", dxf["texts"], walls)

    svg = read_svg(folder + "/export/plan/storey_0.svg")
    # A sheet does not say where it lies: the walls' box of the DXF file does.
    low = [a - b for a, b in zip(box([p for s in dxf["area"] for p in s]),
                                 box([p for s in svg["area"] for p in s]))]
    moved = lambda p: (p[0] + low[0], p[1] + low[1])
    check_area("SVG", [(moved(a), moved(b)) for a, b in svg["area"]], page, corners_m2)
    check_numbers("SVG", [(moved(at), text) for at, text in svg["texts"]], walls)
    strokes = [s for stroke in svg["strokes"] for s in zip(map(moved, stroke), map(moved, stroke[1:]))]
    for wall in walls:
        for stroke in wall["openings"]:
            for p in stroke:
                far = min(distance(s, p) for s in strokes)
                expect(far < 0.01, f"page: opening of wall {wall['id']}: {far:.3f} m off the SVG's")

    ifc = Ifc(folder + "/export/map.ifc")
    solids = list(ifc.solids("IFCWALL"))
    holes = [outline for _, outline in ifc.solids("IFCOPENINGELEMENT")]
    names = sorted(name for name, _ in solids)
    expect(names == [f"Wall {wall['id']}" for wall in walls], f"IFC: {names}")
    for wall in walls:
        outline = [o for name, o in solids if name == f"Wall {wall['id']}"][0]
        for end in wall["face"]:
            far = min(math.dist(end, p) for p in outline)
            expect(far < 0.01, f"IFC: wall {wall['id']} ends {far:.3f} m off that of the page")
    in_ifc = lambda p: (any(inside(segments(o), p) for _, o in solids) and
                        not any(inside(segments(h), p) for h in holes))
    checked = [0, 0]
    for wall in walls:
        for part in wall["parts"]:
            middle = [sum(p[k] for p in part) / len(part) for k in (0, 1)]
            checked[in_ifc(middle)] += 1
    expect(checked[0] == 0 and checked[1] >= 7, f"IFC: walls of the page outside, within: {checked}")

    faces = read_obj(folder + "/export/map.obj")
    expect(len(faces) >= 10, f"OBJ: {len(faces)} triangles of walls")
    for a, b, c in faces:
        middle = [(a[k] + b[k] + c[k]) / 3 for k in (0, 1)]
        u, v = ([q[k] - p[k] for k in range(3)] for p, q in ((a, b), (a, c)))
        normal = (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2])
        length = math.hypot(*normal)
        at = lambda m: (middle[0] + m * normal[0] / length, middle[1] + m * normal[1] / length)
        gaps = [wall for wall in walls if distance(tuple(wall["face"]), middle) < 1e-3]
        expect(len(gaps) == 1, f"OBJ: {len(gaps)} faces of the page at {middle}")
        expect(not inside(page, at(0.05)), f"OBJ: a wall is before its face at {middle}")
        opens = any(distance(s, middle) < 0.02 for wall in walls for o in wall["openings"]
                    for s in zip(o[0::2], o[1::2]))
        expect(opens or inside(page, at(-0.05)), f"OBJ: no wall behind its face at {middle}")

    print("\n".join(FAULTS) or "the same walls")
    return 1 if FAULTS else 0


sys.exit(main(*sys.argv[1:]))
