#!/usr/bin/env python3
"""Prints BENCHMARK.md from the compare.json of `slcmap compare`.

usage: tests/benchmarks/benchmark.py REPORT/compare.json > BENCHMARK.md
"""
import json
import sys

# What each method stands for in the paper: SLC-VIO, Robotica 2022, doi 10.1017/S0263574721001958.
SYSTEMS = {"points-mono": "VINS-Mono", "points": "VINS-Fusion", "points-lines": "PL-VIO",
           "structural": "SL-VIO", "slc": "SLC-VIO"}

# How the sequences of these names are made.
SCENES = "config/scenes/"
SIMULATED = {
    "corridor": "office_corridor.yaml",
    "office": "office_floor.yaml",
    "hall_MH_04": "machine_hall.yaml --trajectory MH_04 --from 20 --duration 40",
    "hall_MH_05": "machine_hall.yaml --trajectory MH_05 --from 25 --duration 40",
    "corridor_inexact": "office_corridor.yaml --inexact 1 --inexact-seed 1",
    "office_inexact": "office_floor.yaml --inexact 1 --inexact-seed 2 --seed 3",
}

PAPER_EUROC = [  # position RMSE in m after alignment
    ("MH_01_easy", {"points": 0.194, "points-mono": 0.206, "points-lines": 0.095,
                    "structural": 0.130, "slc": 0.120}),
    ("MH_02_easy", {"points": 0.182, "points-mono": 0.172, "points-lines": 0.207,
                    "structural": 0.238, "slc": 0.166}),
    ("MH_03_medium", {"points": 0.130, "points-mono": 0.140, "points-lines": 0.106,
                      "structural": 0.103, "slc": 0.089}),
    ("MH_04_difficult", {"points": 0.306, "points-mono": 0.352, "points-lines": 0.223,
                         "structural": 0.215, "slc": 0.182}),
    ("MH_05_difficult", {"points": 0.203, "points-mono": 0.346, "points-lines": 0.256,
                         "structural": 0.229, "slc": 0.179})]
PAPER_CORRIDORS = {"points": 0.306, "points-lines": 0.235, "slc": 0.219}  # TUM VI, m
PAPER_LOOP = {"points": 24.63, "points-lines": 2.06, "slc": 1.08}  # % of 50 m
PAPER_TIME = {"points": 55, "points-lines": 96, "slc": 70}  # ms a frame


def cell(method, figure, digits):
    found = method["figures"].get(figure)
    if found is None:
        return "-"
    text = f"{found['mean']:.{digits}f}"
    if found["deviation"] is not None:
        text += f" ± {found['deviation']:.{digits}f}"
    return text


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "| " + " | ".join(["---"] * len(head)) + " |"]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows]) + "\n"


def ours(report, methods, figure, digits):
    """A row a sequence of this project."""
    rows = []
    for sequence in report["sequences"]:
        by_name = {m["name"]: m for m in sequence["methods"]}
        rows.append([f"{sequence['name']} (simulated, {sequence['length_m']:.0f} m)"
                     if sequence["true_edges"] else sequence["name"]] +
                    [cell(by_name[m], figure, digits) if m in by_name else "-" for m in methods])
    return rows


def paper_row(name, values, methods, digits):
    return [name] + [f"{values[m]:.{digits}f}" if m in values else "-" for m in methods]


def losses(report, subject):
    """Where the subject is not the best, in words."""
    lines = []
    for sequence in report["sequences"]:
        by_name = {m["name"]: m["figures"] for m in sequence["methods"]}
        own = by_name.get(subject, {})
        for key, info in report["figures"].items():
            sign = 1 if info["less_is_better"] else -1
            if key not in own:
                continue
            better = sorted((sign * f[key]["mean"], n) for n, f in by_name.items()
                            if key in f and sign * f[key]["mean"] < sign * own[key]["mean"])
            if better:
                value = sign * better[0][0]
                lines.append(f"- {sequence['name']}, {info['label']}: {own[key]['mean']:.3g} "
                             f"{info['unit']}, {better[0][1]} {value:.3g}")
    return "\n".join(lines) + "\n" if lines else "Nowhere in these figures.\n"


def ratio_rows(report, figure, a, b):
    rows = []
    for sequence in report["sequences"]:
        by_name = {m["name"]: m["figures"] for m in sequence["methods"]}
        if figure not in by_name.get(a, {}) or figure not in by_name.get(b, {}):
            continue
        first, second = by_name[a][figure]["mean"], by_name[b][figure]["mean"]
        if second > 0:
            rows.append([sequence["name"], report["figures"][figure]["label"], f"{first:.2f}",
                         f"{second:.2f}", f"{first / second:.2f}"])
    return rows


def order_lines(report, figure):
    """The methods of each sequence from the best mean on."""
    lines = []
    for sequence in report["sequences"]:
        values = sorted((m["figures"][figure]["mean"], m["name"]) for m in sequence["methods"]
                        if figure in m["figures"])
        lines.append(f"- {sequence['name']}: " + ", ".join(f"{name} {value:.2f}"
                                                          for value, name in values))
        lines.append(f"  - what the spread bears: {sequence['order'].get(figure, 'nothing')}")
    return "\n".join(lines) + "\n"


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    with open(sys.argv[1], encoding="utf-8") as file:
        report = json.load(file)
    present = {m["name"] for s in report["sequences"] for m in s["methods"]}
    methods = [m for m in SYSTEMS if m in present]
    head = [""] + [f"`{m}` ({SYSTEMS[m]})" for m in methods]
    repeats = report["repeats"]
    print("# Benchmark\n")
    print("The tables of the paper that the method is of, beside this project's figures. The paper's are of real "
          "recordings (EuRoC, TUM VI, its own loop); this project's are of simulated ones, so that "
          "rows are to be compared within themselves, method with method, and not with each other. "
          "A method stands for the system in brackets, with which it shares sensors and landmarks but no "
          "code: all methods here share one estimator.\n")
    print(f"Made on {report['date']} with slcmap {report['slcmap']} on {report['machine']}, a shared "
          "machine, by\n")
    for name in (sequence["name"] for sequence in report["sequences"]):
        if name in SIMULATED:
            print(f"    build/bin/slcmap simulate {SCENES}{SIMULATED[name]} -o {name}")
    print(f"    build/bin/{report['command']} -o REPORT\n"
          "    tests/benchmarks/benchmark.py REPORT/compare.json > BENCHMARK.md\n")
    print("One run each: nothing says how far they scatter, so differences of a quarter mean little, and nothing "
          "is called best.\n" if repeats < 2 else
          f"Mean and standard deviation of {repeats} runs with other numbers of points.\n")
    for sequence in report["sequences"]:
        for method in sequence["methods"]:
            for remark in method["remarks"]:
                print(f"- {sequence['name']}, {method['name']}: {remark}")
    print("## Position error\n\nRMSE after alignment, m. The paper aligns as its tools do; here it is by "
          "translation and yaw, of final poses.\n")
    rows = [paper_row(f"paper: EuRoC {name}", values, methods, 3) for name, values in PAPER_EUROC]
    rows.append(paper_row("paper: TUM VI corridors", PAPER_CORRIDORS, methods, 3))
    print(table(head, rows + ours(report, methods, "ape_final_m", 4)))
    print("## Loop (Table V)\n\nFrom start to end where they are one place, % of the path.\n")
    print(table(head, [paper_row("paper: corridor of 50 m", PAPER_LOOP, methods, 2)] +
                ours(report, methods, "loop_percent", 3)))
    print("## Time\n\nThe paper: ms a frame on a desktop; here: CPU ms a pair of images of the whole process, "
          "on a machine that others used too.\n")
    print(table(head, [paper_row("paper: EuRoC", PAPER_TIME, methods, 0)] +
                ours(report, methods, "cpu_ms_a_pair", 1)))
    print("## Straightness (figures 13 and 14)\n\nThe paper judges maps by eye: the lines of SLC-VIO follow the "
          "building, those of PL-VIO are disordered, the points of VINS-Fusion drift. Here with the "
          "same observations for all, each placed alone (README.md, \"Compare\").\n")
    for figure, digits, text in (
            ("edge_thickness_mm", 2, "Thickness of re-triangulated edges, mm"),
            ("edge_thickness_beyond_mm", 2, "The same without what true poses show, mm"),
            ("edge_apart_over_30s_mm", 2, "Observations of an edge more than 30 s apart, mm"),
            ("dispersion_deg", 3, "Directions off three axes, degrees"),
            ("bend_10m_mm", 1, "Bent by the poses under a straightedge of 10 m, worst wall, mm"),
            ("distance_95_mm", 1, "Face-to-face distances, 95 % of the errors below, mm"),
            ("line_precision_5cm_percent", 1, "Lines within 5 cm of a true edge, %")):
        rows = ours(report, methods, figure, digits)
        if any(value != "-" for row in rows for value in row[1:]):
            print(f"{text}:\n\n" + table(head, rows))
    print("By the thickness of edges (mm), from the thinnest on:\n\n" +
          order_lines(report, "edge_thickness_mm"))
    print("With true poses edges are " + ", ".join(
        f"{s['with_true_poses']['edge_thickness_mm']:.2f} mm thick in {s['name']}"
        for s in report["sequences"] if "edge_thickness_mm" in s["with_true_poses"]) +
        ": what stereo and the building have of their own. A real wall may bend by 20 mm over 10 m (DIN 18202): less "
        "cannot be blamed on a map of one.\n")
    if {"slc", "points"} <= present:
        rows = [row for figure in ("edge_thickness_mm", "edge_thickness_beyond_mm")
                for row in ratio_rows(report, figure, "slc", "points")]
        print("The thickness of a sequence in which all methods drift little is mostly that of single "
              "stereo observations, which all have: there the ratio of the two kinds differs.\n")
        print(table(["", "", "`slc`", "`points`", "ratio"], rows))
    print("## Where `slc` is not the best\n\n" + losses(report, "slc"), end="")


if __name__ == "__main__":
    main()
