#!/usr/bin/env python3
"""Fits the weights of the votes that tell edges from marks (mapping/lines/line_kinds.cc).

    fit_line_votes.py NAME=votes.csv... [--held-out NAME=votes.csv...]

Each file is what line_votes printed of one recording; all of them count the same. Prints precision
and recall of each, by length, of the lines before they were told apart: with the present weights,
and with weights fitted to the other files (to all, of those held out); then the weights of all.
Outlines of pipes are left aside.
"""
import argparse

import numpy as np
from scipy.optimize import minimize


def read(path):
    rows = np.loadtxt(path, delimiter=",", skiprows=1, ndmin=2)
    return rows[rows[:, 2] < 0.5]


def fit(files, shrink=2.0):
    """Weighted by length, each file as much as 300 m; votes are scaled before they are shrunk."""
    rows = np.concatenate(files)
    length = np.concatenate([f[:, 0] * 300 / f[:, 0].sum() for f in files])
    edge, votes = rows[:, 1], rows[:, 4:]
    scale = votes.std(axis=0) + 1e-9
    scale[0] = 1
    mean = votes.mean(axis=0)
    mean[0] = 0
    z = (votes - mean) / scale

    def loss(w):
        u = z @ w
        value = (length * (np.logaddexp(0, u) - edge * u)).sum() + shrink * (w[1:] ** 2).sum()
        slope = z.T @ (length * (1 / (1 + np.exp(-u)) - edge))
        slope[1:] += 2 * shrink * w[1:]
        return value, slope

    w = minimize(loss, np.zeros(z.shape[1]), jac=True).x / scale
    w[0] -= (w[1:] * mean[1:]).sum()
    return w


def score(rows, is_edge):
    length, edge = rows[:, 0], rows[:, 1]
    right = (length * edge * is_edge).sum()
    return "P %5.1f  kept %5.1f  marks called edges %4.1f %%" % (
        100 * right / max((length * is_edge).sum(), 1e-9), 100 * right / (length * edge).sum(),
        100 * (length * (1 - edge) * is_edge).sum() / max((length * (1 - edge)).sum(), 1e-9))


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="+")
    parser.add_argument("--held-out", nargs="*", default=[])
    given = parser.parse_args()
    files = {entry.split("=")[0]: read(entry.split("=")[1]) for entry in given.files}
    held_out = {entry.split("=")[0]: read(entry.split("=")[1]) for entry in given.held_out}
    weights = fit(list(files.values()))
    for name, rows in {**files, **held_out}.items():
        others = fit([f for n, f in files.items() if n != name]) if name in files else weights
        print("%-18s as it is %s | fitted to %s %s" % (
            name, score(rows, rows[:, 3] >= 0.5), "others" if name in files else "all   ",
            score(rows, rows[:, 4:] @ others >= 0)))
    print(", ".join("%.3f" % weight for weight in weights))


if __name__ == "__main__":
    main()
