#!/usr/bin/env python3
"""Writes the tables of real recordings into BENCHMARK.md, from the compare.json of `slcmap compare`;
for real.sh.

usage: tests/benchmarks/benchmark.py REPORT/compare.json --real BENCHMARK.md
"""
import json
import os
import re
import sys

# What each method stands for in the paper: SLC-VIO, Robotica 2022, doi 10.1017/S0263574721001958.
SYSTEMS = {"points-mono": "VINS-Mono", "points": "VINS-Fusion", "points-lines": "PL-VIO",
           "structural": "SL-VIO", "slc": "SLC-VIO"}

PAPER_EUROC = {  # position RMSE in m after alignment
    "MH_01_easy": {"points": 0.194, "points-mono": 0.206, "points-lines": 0.095,
                    "structural": 0.130, "slc": 0.120},
    "MH_02_easy": {"points": 0.182, "points-mono": 0.172, "points-lines": 0.207,
                    "structural": 0.238, "slc": 0.166},
    "MH_03_medium": {"points": 0.130, "points-mono": 0.140, "points-lines": 0.106,
                      "structural": 0.103, "slc": 0.089},
    "MH_04_difficult": {"points": 0.306, "points-mono": 0.352, "points-lines": 0.223,
                         "structural": 0.215, "slc": 0.182},
    "MH_05_difficult": {"points": 0.203, "points-mono": 0.346, "points-lines": 0.256,
                         "structural": 0.229, "slc": 0.179}}
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


def methods_of(report):
    """Those of the paper that are present, then other systems and variants."""
    present = list(dict.fromkeys(m["name"] for s in report["sequences"] for m in s["methods"]))
    return [m for m in SYSTEMS if m in present] + [m for m in present if m not in SYSTEMS]


def head_of(methods):
    return [""] + [f"`{m}` ({SYSTEMS[m]})" if m in SYSTEMS else m for m in methods]


def made_by(report, commands):
    text = (f"Made on {report['date']} with slcmap {report['slcmap']} on {report['machine']}, a shared "
            f"machine, by\n\n{commands}\n")
    repeats = report["repeats"]
    text += ("One run each: nothing says how far they scatter, so differences of a quarter mean little, and "
             "nothing is called best.\n\n" if repeats < 2 else
             f"Mean and standard deviation of {repeats} runs with other numbers of points.\n\n")
    return text + "".join(f"- {s['name']}, {m['name']}: {remark}\n" for s in report["sequences"]
                          for m in s["methods"] for remark in m["remarks"])


def loop_and_time(report, methods):
    head = head_of(methods)
    return ("## Loop (Table V)\n\nFrom start to end where they are one place, % of the path.\n\n" +
            table(head, [paper_row("paper: corridor of 50 m", PAPER_LOOP, methods, 2)] +
                  ours(report, methods, "loop_percent", 3)) +
            "\n## Time\n\nThe paper: ms a frame on a desktop; here: CPU ms a pair of images of the whole "
            "process, on a machine that others used too.\n\n" +
            table(head, [paper_row("paper: EuRoC", PAPER_TIME, methods, 0)] +
                  ours(report, methods, "cpu_ms_a_pair", 1)))


def true_thickness(sequence):
    """That of edges by true poses, unless a method's are thinner: then these are no floor."""
    true = sequence["with_true_poses"].get("edge_thickness_mm", float("inf"))
    found = [m["figures"]["edge_thickness_mm"]["mean"] for m in sequence["methods"]
             if "edge_thickness_mm" in m["figures"]]
    return [true] if found and true <= min(found) else []


def straightness(report, methods):
    text = ("## Straightness (figures 13 and 14)\n\nThe paper judges maps by eye: the lines of SLC-VIO "
            "follow the building, those of PL-VIO are disordered, the points of VINS-Fusion drift. Here "
            "with the same observations for all, each placed alone (apps/README.md, \"Compare\").\n")
    for figure, digits, label in (
            ("edge_thickness_mm", 2, "Thickness of re-triangulated edges, mm"),
            ("edge_thickness_beyond_mm", 2, "The same without what true poses show, mm"),
            ("edge_apart_over_30s_mm", 2, "Observations of an edge more than 30 s apart, mm"),
            ("dispersion_deg", 3, "Directions off three axes, degrees"),
            ("line_precision_5cm_percent", 1, "Lines within 5 cm of a true edge, %")):
        rows = ours(report, methods, figure, digits)
        if any(value != "-" for row in rows for value in row[1:]):
            text += f"\n{label}:\n\n" + table(head_of(methods), rows)
    text += ("\nBy the thickness of edges (mm), from the thinnest on:\n\n" +
             order_lines(report, "edge_thickness_mm"))
    true = [f"{thickness:.2f} mm thick in {s['name']}" for s in report["sequences"]
            for thickness in true_thickness(s)]
    if true:
        text += ("\nWith true poses edges are " + ", ".join(true) + ": what stereo and the building have of "
                 "their own.\n")
    rows = [row for figure in ("edge_thickness_mm", "edge_thickness_beyond_mm")
            for row in ratio_rows(report, figure, "slc", "points")]
    if rows:
        text += ("\nThe thickness of a sequence in which all methods drift little is mostly that of single "
                 "stereo observations, which all have: there the ratio of the two kinds differs.\n\n" +
                 table(["", "", "`slc`", "`points`", "ratio"], rows))
    return text


def mean_row(name, rows):
    """Of the first figure in each cell; - where one is missing."""
    columns = [[value.split()[0] for value in column] for column in list(zip(*rows))[1:]]
    return [name] + ["-" if "-" in c else f"{sum(map(float, c)) / len(c):.3f}" for c in columns]


def real_positions(report, methods, figure):
    """Each sequence below what the paper has for it, and the mean of TUM VI's corridors below its."""
    rows, corridors = [], []
    for row in ours(report, methods, figure, 3):
        if row[0] in PAPER_EUROC:
            rows.append(paper_row(f"paper: {row[0]}", PAPER_EUROC[row[0]], methods, 3))
        rows.append(row)
        if "corridor" in row[0]:
            corridors.append(row)
    if corridors:
        rows.append(paper_row("paper: TUM VI corridors", PAPER_CORRIDORS, methods, 3))
        rows.append(mean_row("mean of corridors", corridors))
    return table(head_of(methods), rows)


REAL_HEAD = "# EuRoC and TUM VI\n"


def real_half(report):
    methods = methods_of(report)
    text = (REAL_HEAD + "\nReal recordings with their published truth, beside the figures of the SLC-VIO paper. "
            "A method stands for the system in brackets, with which it shares sensors and landmarks but "
            "no code; columns without brackets are trajectories of other systems.\n\n" +
            made_by(report, "    tests/benchmarks/real.sh FOLDER\n") +
            "\n## Position error\n\nRMSE, m, of final poses after alignment by rotation and "
            "translation (SE(3)).\n\n" +
            real_positions(report, methods, "ape_se3_final_m") +
            "\nOf online poses after alignment by translation and yaw, and the share of images with a pose:\n\n")
    for figure, digits in (("ape_online_m", 3), ("coverage_percent", 1)):
        text += table(head_of(methods), ours(report, methods, figure, digits)) + "\n"
    return text + loop_and_time(report, methods) + "\n" + straightness(report, methods)


def replace_section(path, head, text):
    """Puts a chapter in the place of the one of its name, or at the end."""
    old = ""
    if os.path.exists(path):
        with open(path, encoding="utf-8") as file:
            old = file.read()
    found = re.search(r"^" + re.escape(head) + r".*?(?=^# |\Z)", old, re.M | re.S)
    begin, end = found.span() if found else (len(old), len(old))
    before, behind = old[:begin].rstrip("\n"), old[end:]
    with open(path, "w", encoding="utf-8") as file:
        file.write((before + "\n\n" if before else "") + text + ("\n" + behind if behind else ""))


def main():
    if {"-h", "--help"} & set(sys.argv[1:]):
        return print(__doc__.strip())
    if len(sys.argv) != 4 or sys.argv[2] != "--real":
        sys.exit(__doc__)
    try:
        with open(sys.argv[1], encoding="utf-8") as file:
            report = json.load(file)
    except OSError as error:
        sys.exit(f"{sys.argv[1]}: {error.strerror}, expected a compare.json")
    replace_section(sys.argv[3], REAL_HEAD, real_half(report))


if __name__ == "__main__":
    main()
