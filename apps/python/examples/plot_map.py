#!/usr/bin/env python3
"""Draws a map from above: rooms, lines by axis, and the way of the rig. usage: plot_map.py MAP [PNG]"""
import sys

import slcmap

COLOURS = {"x": "tab:red", "y": "tab:green", "vertical": "tab:blue", "sloped": "tab:purple",
           "none": "tab:orange"}


def main():
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    try:
        import matplotlib
    except ImportError:
        sys.exit("matplotlib is needed to draw: apt install python3-matplotlib")
    if len(sys.argv) == 3:
        matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    building = slcmap.Map.load(sys.argv[1])
    print(building)
    for room in building.rooms:
        x_m, y_m = room["polygon"].T
        plt.fill(x_m, y_m, alpha=0.15, color="tab:gray")
        plt.text(x_m.mean(), y_m.mean(), f"{room['name']}\n{room['area_m2']:.1f} m²", ha="center")
    for line, axis in zip(building.lines, building.line_axes):
        plt.plot(line[[0, 3]], line[[1, 4]], color=COLOURS[axis], linewidth=1)
    plt.plot(*building.trajectory.positions[:, :2].T, color="black", linewidth=0.8)
    plt.axis("equal")
    plt.xlabel("x [m]")
    plt.ylabel("y [m]")
    if len(sys.argv) == 3:
        plt.savefig(sys.argv[2], dpi=150)
    else:
        plt.show()


if __name__ == "__main__":
    main()
