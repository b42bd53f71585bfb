#!/usr/bin/env python3
"""Copies a recording with a calibration that is off, or with a gross fault.

OUT becomes a recording in ASL layout whose images are links to those of SEQ (a folder with mav0/),
so it takes no space to speak of. What is off is what the calibration claims: sensor.yaml; only
stamps and IMU samples change where the fault is in the data. truth/ stays what it is. Needs numpy:
run it by /usr/bin/python3, with Debian's python3-numpy, where another python3 comes first.

  tests/benchmarks/miscalibrate.py SEQ OUT --time-offset-ms 10 --right-rotation-deg 0.05 0.05 0
  tests/benchmarks/miscalibrate.py SEQ OUT --imu-rotation-deg 1 0 0 --focal-scale 1.003
  tests/benchmarks/miscalibrate.py SEQ OUT --fault gyro-y-negated
  tests/benchmarks/miscalibrate.py SEQ OUT --all-faults      # OUT/NAME of each
  tests/benchmarks/miscalibrate.py --list-faults

What an estimator should find (T_imu_camera as sensor.yaml's T_BS says it):

  --time-offset-ms X          cameras stamp X ms late: an image stamped t was taken at t - X, so
                              timeshift_cam_imu (Kalibr: t_imu = t_camera + shift) is -X ms. Ground
                              truth follows the cameras' clock, as trajectories of slcmap do, unless
                              --truth-clock imu
  --timeshift-ms X            claimed timeshift_cam_imu, with --time-offset-ms -X a right one
  --right-rotation-deg X Y Z  claimed R_imu_right = true R_imu_right * Exp(X Y Z)
  --imu-rotation-deg X Y Z    claimed R_imu_camera = Exp(X Y Z) * true R_imu_camera, of all cameras,
                              and so for their translations: the IMU turned, about itself
  --lever-m X Y Z             claimed translations of both cameras = true ones + X Y Z
  --focal-scale S             claimed fx, fy = true ones * S, of both cameras
  --principal-px X Y          claimed cx, cy = true ones + X Y, of both cameras
  --baseline-scale S          claimed translation from left to right camera = true one * S
  --gyro-bias-rad-s X Y Z     biases that are added to the samples of the IMU
  --accel-bias-m-s2 X Y Z
  --imu-bias-seed N           such biases as the simulator draws for each rig: normally distributed,
                              by 0.02 rad/s and 0.05 m/s^2 an axis. No two IMUs have the same, nor
                              one on two days: figures of one draw say little
"""

import argparse
from decimal import Decimal
import math
import pathlib
import random
import re

import numpy as np

CAMERAS, SENSORS = ["cam0", "cam1"], ["cam0", "cam1", "imu0"]
KEYS = ["data", "intrinsics", "distortion_coefficients"]  # of a camera's sensor.yaml
NUMBERS = r"\[([^\]]*)\]"
GYRO, ACCEL = [1, 2, 3], [4, 5, 6]  # columns of imu0/data.csv
IMU_BIASES = [0.02] * 3 + [0.05] * 3  # standard deviations of these, in rad/s and m/s^2
G_M_S2 = 9.80665


def exp_rotation(vector_deg):
    """The rotation by a vector in degrees (Rodrigues' formula)."""
    vector = np.radians(vector_deg)
    angle = math.sqrt(sum(vector * vector))
    cross = np.cross(np.eye(3), vector / (angle or 1))  # [axis]x
    return np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * (cross @ cross)


def numbers(yaml, key):
    return np.array(re.search(key + r":\s*" + NUMBERS, yaml)[1].split(","), float)


class Table:
    """Comments, and rows of fields as text, the first of which is a stamp: ns, or s in .tum."""

    def __init__(self, path):
        self.separator, self.ns = (" ", Decimal("1e-9")) if path.suffix == ".tum" else (",", 1)
        lines = [line for line in path.read_text().splitlines() if line.strip()]
        self.comments = [line for line in lines if line.startswith("#")]
        rows = [line.split(self.separator) for line in lines if not line.startswith("#")]
        self.rows = np.array(rows, object)

    def restamp(self, change):
        self.rows[:, 0] = [f"{change(Decimal(stamp)):f}" for stamp in self.rows[:, 0]]

    def write(self, path):
        lines = self.comments + [self.separator.join(row) for row in self.rows]
        path.write_text("".join(line + "\n" for line in lines))


class Recording:
    """Tables, and the calibration of both cameras, in arrays whose first index is the camera."""

    def __init__(self, folder):
        self.folder = folder.resolve()
        mav = self.folder / "mav0"
        self.tables = {name: Table(mav / name / "data.csv") for name in SENSORS}
        self.imu = self.tables["imu0"].rows
        self.images = [(mav / name / "data").resolve() for name in CAMERAS]
        self.yamls = [(mav / name / "sensor.yaml").read_text() for name in CAMERAS]
        matrices, self.intrinsics, self.coefficients = (
            np.array([numbers(yaml, key) for yaml in self.yamls]) for key in KEYS)
        self.poses = matrices[:, :12].reshape(2, 3, 4)
        self.rotations, self.translations = self.poses[..., :3], self.poses[..., 3]  # views
        self.timeshift_s = None
        self.truth_shift_ns = 0

    def write(self, out):
        mav = out / "mav0"
        for name, table in self.tables.items():
            (mav / name).mkdir(parents=True)
            table.write(mav / name / "data.csv")
        for i, name in enumerate(CAMERAS):
            (mav / name / "sensor.yaml").write_text(self.camera_yaml(i))
            (mav / name / "data").symlink_to(self.images[i])
        (mav / "imu0" / "sensor.yaml").symlink_to(self.folder / "mav0" / "imu0" / "sensor.yaml")
        for name in ("mav0/state_groundtruth_estimate0", "truth"):
            for path in (self.folder / name).glob("*"):
                self.write_truth(path, out / name / path.name)

    def camera_yaml(self, i):
        yaml = self.yamls[i]
        matrix = np.append(self.poses[i], [0, 0, 0, 1])
        for key, values in zip(KEYS, [matrix, self.intrinsics[i], self.coefficients[i]]):
            if not np.array_equal(values, numbers(yaml, key)):
                text = ", ".join(f"{value:.15g}" for value in values)
                yaml = re.sub(r"(\b" + key + r":\s*)" + NUMBERS, rf"\g<1>[{text}]", yaml, 1)
        if i == 0 and self.timeshift_s is not None:
            yaml += f"\ntimeshift_cam_imu: {self.timeshift_s}\n"
        return yaml

    def write_truth(self, source, target):
        target.parent.mkdir(exist_ok=True)
        if self.truth_shift_ns and source.name in ("data.csv", "trajectory.tum"):
            table = Table(source)
            table.restamp(lambda stamp: stamp + self.truth_shift_ns * table.ns)
            table.write(target)
        else:
            target.symlink_to(source)


# What options and faults are made of: changes of a recording.

def claim(recording, name, change):
    """What the calibration of both cameras says becomes change(what it said)."""
    getattr(recording, name)[...] = change(getattr(recording, name))


def scale_intrinsics(recording, *scales):
    """By one for each, or one for all."""
    recording.intrinsics *= scales


def scale_baseline(recording, scale):
    left, right = recording.translations
    right[:] = left + scale * (right - left)


def turn_right(recording, *vector_deg):
    recording.rotations[1] = recording.rotations[1] @ exp_rotation(vector_deg)


def turn_imu(recording, *vector_deg):
    """Claims Exp(vector) * T_imu_camera, of both cameras."""
    recording.poses[:] = exp_rotation(vector_deg) @ recording.poses


def axes(recording, *order):
    """Claims these axes of the IMU, from 1 and negated where negative, as its x, y and z."""
    matrix = np.array([np.sign(axis) * np.eye(3)[abs(axis) - 1] for axis in order])
    recording.poses[:] = matrix @ recording.poses


def invert(recording, *cameras):
    for pose in (recording.poses[i] for i in cameras):
        rotation = pose[:, :3].T
        pose[:] = np.hstack([rotation, -(rotation @ pose[:, 3:])])


def swap_images(recording):
    recording.images.reverse()
    tables = recording.tables
    tables["cam0"], tables["cam1"] = tables["cam1"], tables["cam0"]


def delay_right_images(recording):
    names = recording.tables["cam1"].rows[:, 1]
    names[1:] = names[:-1].copy()


def restamp(recording, sensors, change):
    for name in sensors:
        recording.tables[name].restamp(change)


def stamp_late(recording, late_ns, with_truth=True):
    """The cameras' stamps."""
    restamp(recording, CAMERAS, lambda ns: ns + late_ns)
    recording.truth_shift_ns += late_ns if with_truth else 0


def change_imu(recording, columns, change):
    values = change(recording.imu[:, columns].astype(float))
    recording.imu[:, columns] = [[f"{value:.10g}" for value in row] for row in values]


def scale_imu(recording, columns, factor):
    change_imu(recording, columns, lambda values: values * factor)


def freeze_imu(recording, columns, from_share=0):
    first = int(from_share * len(recording.imu))
    recording.imu[first:, columns] = recording.imu[first, columns]


def permute_imu(recording, *order):
    recording.imu[:, 1:7] = recording.imu[:, order]


# {name: (what is wrong, the change, its arguments after the recording)}
FAULTS = {
    "imu-swapped-xy": ("camera-IMU rotation: the IMU's x and y swapped, z negated", axes, 2, 1, -3),
    "imu-swapped-yz": ("camera-IMU rotation: the IMU's y and z swapped, x negated", axes, -1, 3, 2),
    "imu-swapped-xz": ("camera-IMU rotation: the IMU's x and z swapped, y negated", axes, 3, -2, 1),
    "imu-cycled": ("camera-IMU rotation: the IMU's y, z, x for x, y, z", axes, 2, 3, 1),
    "imu-quarter-x": ("camera-IMU rotation: turned by 90 degrees about x", turn_imu, 90, 0, 0),
    "imu-half-x": ("camera-IMU rotation: two axes negated, a half turn about x", axes, 1, -2, -3),
    "imu-quarter-y": ("camera-IMU rotation: turned by 90 degrees about y", turn_imu, 0, 90, 0),
    "imu-half-y": ("camera-IMU rotation: two axes negated, a half turn about y", axes, -1, 2, -3),
    "imu-quarter-z": ("camera-IMU rotation: turned by 90 degrees about z", turn_imu, 0, 0, 90),
    "imu-half-z": ("camera-IMU rotation: two axes negated, a half turn about z", axes, -1, -2, 3),
    "imu-inverse": ("T_BS of both cameras is its inverse", invert, 0, 1),
    "imu-transposed": ("rotation of T_BS of both cameras is transposed, translations are right",
                       claim, "rotations", lambda stack: stack.swapaxes(1, 2)),
    "imu-mirrored-x": ("rotation of T_BS mirrored: the IMU's x negated (determinant -1)",
                       axes, -1, 2, 3),
    "imu-swapped-mirrored": ("rotation of T_BS: two rows swapped (determinant -1)", axes, 2, 1, 3),
    "imu-identity": ("rotation of T_BS of both cameras left as the identity",
                     claim, "rotations", lambda stack: np.eye(3)),
    "imu-10-degrees": ("camera-IMU rotation 10 degrees off", turn_imu, 6, -5, 6.2),
    "right-inverse": ("T_BS of the right camera is its inverse", invert, 1),
    "right-2-degrees": ("right camera turned by 2 degrees about its x", turn_right, 2, 0, 0),

    "gyro-x-dead": ("gyro x is always zero", scale_imu, [1], 0),
    "gyro-x-frozen": ("gyro x keeps its first value", freeze_imu, [1]),
    "gyro-x-negated": ("gyro x is negated", scale_imu, [1], -1),
    "gyro-y-dead": ("gyro y is always zero", scale_imu, [2], 0),
    "gyro-y-frozen": ("gyro y keeps its first value", freeze_imu, [2]),
    "gyro-y-negated": ("gyro y is negated", scale_imu, [2], -1),
    "gyro-z-dead": ("gyro z is always zero", scale_imu, [3], 0),
    "gyro-z-frozen": ("gyro z keeps its first value", freeze_imu, [3]),
    "gyro-z-negated": ("gyro z is negated", scale_imu, [3], -1),
    "gyro-negated": ("gyro negated in all axes", scale_imu, GYRO, -1),
    "gyro-dead": ("gyro is always zero", scale_imu, GYRO, 0),
    "gyro-stuck-halfway": ("gyro keeps one value in the second half", freeze_imu, GYRO, 0.5),
    "accel-x-dead": ("accel x is always zero", scale_imu, [4], 0),
    "accel-x-frozen": ("accel x keeps its first value", freeze_imu, [4]),
    "accel-x-negated": ("accel x is negated", scale_imu, [4], -1),
    "accel-y-dead": ("accel y is always zero", scale_imu, [5], 0),
    "accel-y-frozen": ("accel y keeps its first value", freeze_imu, [5]),
    "accel-y-negated": ("accel y is negated", scale_imu, [5], -1),
    "accel-z-dead": ("accel z is always zero", scale_imu, [6], 0),
    "accel-z-frozen": ("accel z keeps its first value", freeze_imu, [6]),
    "accel-z-negated": ("accel z is negated", scale_imu, [6], -1),
    "accel-negated": ("accel negated in all axes", scale_imu, ACCEL, -1),
    "accel-dead": ("accel is always zero", scale_imu, ACCEL, 0),
    "accel-stuck-halfway": ("accel keeps one value in the second half", freeze_imu, ACCEL, 0.5),

    "gyro-swapped-xy": ("gyro: columns x and y swapped", permute_imu, 2, 1, 3, 4, 5, 6),
    "accel-swapped-xy": ("accel: columns x and y swapped", permute_imu, 1, 2, 3, 5, 4, 6),
    "gyro-accel-swapped": ("columns of gyro and accel swapped", permute_imu, 4, 5, 6, 1, 2, 3),
    "gyro-degrees": ("gyro in deg/s", scale_imu, GYRO, math.degrees(1)),
    "gyro-double": ("gyro twice too large", scale_imu, GYRO, 2),
    "accel-g": ("accel in g", scale_imu, ACCEL, 1 / G_M_S2),
    "accel-milli-g": ("accel in mg", scale_imu, ACCEL, 1000 / G_M_S2),

    "stamps-s": ("all stamps in seconds", restamp, SENSORS, lambda ns: ns.scaleb(-9)),
    "stamps-us": ("all stamps in microseconds", restamp, SENSORS, lambda ns: ns // 1000),
    "imu-stamps-us": ("stamps of the IMU in microseconds",
                      restamp, ["imu0"], lambda ns: ns // 1000),
    "stamps-late-100ms": ("cameras stamp 100 ms late", stamp_late, 100_000_000),
    "stamps-early-100ms": ("cameras stamp 100 ms early", stamp_late, -100_000_000),
    "stamps-late-1s": ("cameras stamp 1 s late", stamp_late, 1_000_000_000),
    "stamps-late-3s": ("cameras stamp 3 s late", stamp_late, 3_000_000_000),
    "timeshift-5s": ("timeshift_cam_imu of 5 s", setattr, "timeshift_s", 5.0),
    "timeshift-ms": ("timeshift_cam_imu in milliseconds, -10 for -0.01 "
                     "(and cameras that stamp 10 ms late)",
                     lambda r: (stamp_late(r, 10_000_000), setattr(r, "timeshift_s", -10.0))),

    "lever-mm": ("translations of T_BS in millimetres", claim, "translations", lambda t: 1000 * t),
    "lever-metres": ("both cameras 2 m from where they are",
                     claim, "translations", lambda t: t + [2, -1, 0.5]),
    "baseline-zero": ("left and right camera at one place", scale_baseline, 0),
    "baseline-half": ("baseline half as long", scale_baseline, 0.5),
    "baseline-double": ("baseline twice as long", scale_baseline, 2),
    "baseline-negated": ("right camera left of the left one", scale_baseline, -1),
    "cameras-swapped": ("images of the left camera as those of the right, and the reverse",
                        swap_images),
    "right-one-image-late": ("images of the right camera one late", delay_right_images),

    "focal-double": ("focal lengths twice too long", scale_intrinsics, 2, 2, 1, 1),
    "focal-half": ("focal lengths half as long", scale_intrinsics, 0.5, 0.5, 1, 1),
    "focal-10-percent": ("focal lengths 10 % too long", scale_intrinsics, 1.1, 1.1, 1, 1),
    "intrinsics-half-size": ("intrinsics of images of half the size", scale_intrinsics, 0.5),
    "intrinsics-order": ("intrinsics as fx, cx, fy, cy",
                         claim, "intrinsics", lambda k: k[:, [0, 2, 1, 3]]),
    "distortion-zero": ("distortion coefficients all zero", claim, "coefficients", np.zeros_like),
    "distortion-negated": ("distortion coefficients negated", claim, "coefficients", np.negative),
}


def arguments():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("seq", nargs="?", type=pathlib.Path)
    parser.add_argument("out", nargs="?", type=pathlib.Path)
    parser.add_argument("--time-offset-ms", type=float, default=0)
    parser.add_argument("--timeshift-ms", type=float)
    parser.add_argument("--truth-clock", choices=["camera", "imu"], default="camera")
    parser.add_argument("--right-rotation-deg", type=float, nargs=3, default=[0] * 3)
    parser.add_argument("--imu-rotation-deg", type=float, nargs=3, default=[0] * 3)
    parser.add_argument("--lever-m", type=float, nargs=3, default=[0] * 3)
    parser.add_argument("--focal-scale", type=float, default=1)
    parser.add_argument("--principal-px", type=float, nargs=2, default=[0] * 2)
    parser.add_argument("--baseline-scale", type=float, default=1)
    parser.add_argument("--gyro-bias-rad-s", type=float, nargs=3, default=[0] * 3)
    parser.add_argument("--accel-bias-m-s2", type=float, nargs=3, default=[0] * 3)
    parser.add_argument("--imu-bias-seed", type=int)
    parser.add_argument("--fault", action="append", default=[])
    parser.add_argument("--all-faults", action="store_true")
    parser.add_argument("--list-faults", action="store_true")
    options = parser.parse_args()
    if options.list_faults:
        for name, (words, *_) in FAULTS.items():
            print(f"{name:24}{words}")
        parser.exit()
    if options.out is None:
        parser.error("expected SEQ and OUT")
    if not (options.seq / "mav0" / "cam1").is_dir():
        parser.error(f"{options.seq}: found no mav0/cam1, expected a recording as EuRoC's")
    if options.out.exists():
        parser.error(f"{options.out} exists already")
    for name in options.fault:
        if name not in FAULTS:
            parser.error(f"no fault '{name}', see --list-faults")
    return options


def apply_options(recording, options):
    stamp_late(recording, round(options.time_offset_ms * 1e6), options.truth_clock == "camera")
    if options.timeshift_ms is not None:
        recording.timeshift_s = 1e-3 * options.timeshift_ms
    turn_right(recording, *options.right_rotation_deg)
    turn_imu(recording, *options.imu_rotation_deg)
    scale_intrinsics(recording, options.focal_scale, options.focal_scale, 1, 1)
    recording.intrinsics += [0, 0, *options.principal_px]
    scale_baseline(recording, options.baseline_scale)
    recording.translations += options.lever_m
    biases = [options.gyro_bias_rad_s + options.accel_bias_m_s2]
    if options.imu_bias_seed is not None:
        draw = random.Random(options.imu_bias_seed)
        biases.append([draw.gauss(0, sigma) for sigma in IMU_BIASES])
    for bias in filter(any, biases):
        change_imu(recording, GYRO + ACCEL, lambda values: values + bias)


def main():
    options = arguments()
    runs = {name: [name] for name in FAULTS} if options.all_faults else {"": []}
    for folder, faults in runs.items():
        recording = Recording(options.seq)
        apply_options(recording, options)
        for fault in options.fault + faults:
            _, change, *values = FAULTS[fault]
            change(recording, *values)
        recording.write(options.out / folder)


if __name__ == "__main__":
    main()
