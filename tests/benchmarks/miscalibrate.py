#!/usr/bin/env python3
"""Copies a recording with a calibration that is off, or with a gross fault.

OUT becomes a recording in ASL layout whose images are links to those of SEQ (a folder with mav0/),
so it takes no space to speak of. What is off is what the calibration claims: sensor.yaml; only
stamps and IMU samples change where the fault is in the data. truth/ stays what it is.

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
                              by 0.02 rad/s and 0.05 m/s^2 an axis. No two IMUs have the same, nor one
                              on two days: figures of one draw say little
"""

import argparse
import math
import pathlib
import random
import re
import sys

NUMBERS = r"\[([^\]]*)\]"
GYRO_BIAS_RAD_S, ACCEL_BIAS_M_S2 = 0.02, 0.05  # standard deviations an axis


# Rotations as three rows.

def multiply(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(3)) for j in range(3)] for i in range(3)]


def transpose(a):
    return [list(row) for row in zip(*a)]


def rotate(a, v):
    return [sum(a[i][k] * v[k] for k in range(3)) for i in range(3)]


def add(a, b, scale=1):
    return [x + scale * y for x, y in zip(a, b)]


def exp_rotation(vector_deg):
    """The rotation by a vector in degrees (Rodrigues' formula)."""
    vector = [math.radians(x) for x in vector_deg]
    angle = math.sqrt(sum(x * x for x in vector))
    if angle == 0:
        return [[float(i == j) for j in range(3)] for i in range(3)]
    x, y, z = (component / angle for component in vector)
    cross = [[0, -z, y], [z, 0, -x], [-y, x, 0]]
    square = multiply(cross, cross)
    return [[(i == j) + math.sin(angle) * cross[i][j] + (1 - math.cos(angle)) * square[i][j]
             for j in range(3)] for i in range(3)]


class Camera:
    """Calibration, images and stamps of one camera."""

    def __init__(self, folder):
        self.text = (folder / "sensor.yaml").read_text()
        self.rows = read_rows(folder / "data.csv")
        self.images = (folder / "data").resolve()
        flat = self.numbers("data")
        self.rotation = [flat[4 * i:4 * i + 3] for i in range(3)]
        self.translation = [flat[4 * i + 3] for i in range(3)]
        self.intrinsics = self.numbers("intrinsics")
        self.coefficients = self.numbers("distortion_coefficients")
        self.timeshift_s = None

    def numbers(self, key):
        return [float(x) for x in re.search(key + r":\s*" + NUMBERS, self.text)[1].split(",")]

    def write(self, folder):
        flat = []
        for row, offset in zip(self.rotation, self.translation):
            flat += row + [offset]
        text = self.text
        for key, values in [("data", flat + [0, 0, 0, 1]), ("intrinsics", self.intrinsics),
                            ("distortion_coefficients", self.coefficients)]:
            if values != self.numbers(key):
                numbers = ", ".join(f"{value:.15g}" for value in values)
                text = re.sub(r"(\b" + key + r":\s*)" + NUMBERS, rf"\g<1>[{numbers}]", text, 1)
        if self.timeshift_s is not None:
            text += f"\ntimeshift_cam_imu: {self.timeshift_s}\n"
        folder.mkdir(parents=True)
        (folder / "sensor.yaml").write_text(text)
        write_rows(folder / "data.csv", self.rows)
        (folder / "data").symlink_to(self.images)


def read_rows(path):
    """The fields of each row as text; comments keep their line as one field."""
    lines = path.read_text().splitlines()
    return [[line] if line.startswith("#") else line.split(",") for line in lines if line.strip()]


def write_rows(path, rows):
    path.write_text("".join(",".join(row) + "\n" for row in rows))


def samples(rows):
    return [row for row in rows if not row[0].startswith("#")]


class Recording:
    def __init__(self, folder):
        self.folder = folder.resolve()
        self.mav = self.folder / "mav0"
        self.cameras = [Camera(self.mav / f"cam{i}") for i in range(2)]
        self.imu = read_rows(self.mav / "imu0" / "data.csv")
        self.truth_shift_ns = 0

    def write(self, out):
        (out / "mav0" / "imu0").mkdir(parents=True)
        for i, camera in enumerate(self.cameras):
            camera.write(out / "mav0" / f"cam{i}")
        write_rows(out / "mav0" / "imu0" / "data.csv", self.imu)
        (out / "mav0" / "imu0" / "sensor.yaml").symlink_to(self.mav / "imu0" / "sensor.yaml")
        for name in ("mav0/state_groundtruth_estimate0", "truth"):
            if (self.folder / name).is_dir():
                self.write_truth(self.folder / name, out / name)

    def write_truth(self, source, target):
        target.mkdir(parents=True)
        for path in sorted(source.iterdir()):
            if self.truth_shift_ns and path.name in ("data.csv", "trajectory.tum"):
                (target / path.name).write_text(shifted_truth(path, self.truth_shift_ns))
            else:
                (target / path.name).symlink_to(path)

    # What options and faults are made of.

    def stamp_cameras_late(self, late_ns, with_truth=True):
        for camera in self.cameras:
            for row in samples(camera.rows):
                row[0] = str(int(row[0]) + late_ns)
        if with_truth:
            self.truth_shift_ns += late_ns

    def turn_right(self, vector_deg):
        right = self.cameras[1]
        right.rotation = multiply(right.rotation, exp_rotation(vector_deg))

    def turn_imu(self, matrix, with_lever=True):
        """Claims matrix * R_imu_camera, of all cameras."""
        for camera in self.cameras:
            camera.rotation = multiply(matrix, camera.rotation)
            if with_lever:
                camera.translation = rotate(matrix, camera.translation)

    def each_camera(self, change):
        for camera in self.cameras:
            change(camera)

    def scale_intrinsics(self, scales):
        for camera in self.cameras:
            camera.intrinsics = [x * s for x, s in zip(camera.intrinsics, scales)]

    def shift_principal(self, dx_px, dy_px):
        for camera in self.cameras:
            camera.intrinsics = add(camera.intrinsics, [0, 0, dx_px, dy_px])

    def scale_baseline(self, scale):
        left, right = (camera.translation for camera in self.cameras)
        self.cameras[1].translation = add(left, add(right, left, -1), scale)

    def scale_imu(self, columns, factors):
        """Columns 1 to 3 are the gyroscope's, 4 to 6 the accelerometer's."""
        for row in samples(self.imu):
            for column, factor in zip(columns, factors):
                row[column] = f"{float(row[column]) * factor:.10g}"

    def add_imu_bias(self, biases):
        """Six, in the order of the columns."""
        if not any(biases):
            return
        for row in samples(self.imu):
            row[1:7] = [f"{float(value) + bias:.10g}" for value, bias in zip(row[1:7], biases)]

    def freeze_imu(self, columns, from_share=0):
        rows = samples(self.imu)
        first = int(from_share * len(rows))
        for row in rows[first:]:
            for column in columns:
                row[column] = rows[first][column]

    def permute_imu(self, order):
        for row in samples(self.imu):
            row[1:7] = [row[column] for column in order]

    def rewrite_stamps(self, tables, per_s):
        """Stamps in units of which a second has per_s; 1e9 in the files."""
        for rows in tables:
            for row in samples(rows):
                digits = str(int(row[0]))
                decimals = 9 - round(math.log10(per_s))
                row[0] = digits[:-decimals] + ("." + digits[-decimals:] if per_s <= 1000 else "")

    def all_tables(self):
        return [self.imu] + [camera.rows for camera in self.cameras]

    def swap_images(self):
        left, right = self.cameras
        left.images, right.images = right.images, left.images
        left.rows, right.rows = right.rows, left.rows

    def delay_right_images(self):
        rows = samples(self.cameras[1].rows)
        names = [row[1] for row in rows]
        for row, name in zip(rows[1:], names):
            row[1] = name


def shifted_truth(path, shift_ns):
    lines = []
    for line in path.read_text().splitlines():
        if line.startswith("#"):
            lines.append(line)
        elif path.suffix == ".tum":
            stamp, rest = line.split(" ", 1)
            seconds, _, decimals = stamp.partition(".")
            stamp_ns = int(seconds) * 10**9 + int(decimals.ljust(9, "0")[:9]) + shift_ns
            lines.append(f"{stamp_ns // 10**9}.{stamp_ns % 10**9:09d} {rest}")
        else:
            stamp, rest = line.split(",", 1)
            lines.append(f"{int(stamp) + shift_ns},{rest}")
    return "\n".join(lines) + "\n"


def invert(camera):
    camera.rotation = transpose(camera.rotation)
    camera.translation = [-x for x in rotate(camera.rotation, camera.translation)]


def set_translation(camera, translation):
    camera.translation = translation


def zero_distortion(camera):
    camera.coefficients = [0, 0, 0, 0]


def negate_distortion(camera):
    camera.coefficients = [-x for x in camera.coefficients]


def reorder_intrinsics(camera):
    fx, fy, cx, cy = camera.intrinsics
    camera.intrinsics = [fx, cx, fy, cy]


def identity_rotation(camera):
    camera.rotation = exp_rotation([0, 0, 0])


def transpose_rotation(camera):
    camera.rotation = transpose(camera.rotation)


def scale_lever(camera):
    camera.translation = [1000 * x for x in camera.translation]


def set_timeshift(recording, shift_s):
    recording.cameras[0].timeshift_s = shift_s


def drawn_biases(seed):
    """Of gyroscope and accelerometer, as the simulator draws them."""
    draw = random.Random(seed)
    return [draw.gauss(0, sigma) for sigma in [GYRO_BIAS_RAD_S] * 3 + [ACCEL_BIAS_M_S2] * 3]


def diagonal(*signs):
    return [[signs[i] * (i == j) for j in range(3)] for i in range(3)]


SWAP_XY = [[0, 1, 0], [1, 0, 0], [0, 0, -1]]
SWAP_YZ = [[-1, 0, 0], [0, 0, 1], [0, 1, 0]]
SWAP_XZ = [[0, 0, 1], [0, -1, 0], [1, 0, 0]]
CYCLE = [[0, 1, 0], [0, 0, 1], [1, 0, 0]]
GYRO, ACCEL = (1, 2, 3), (4, 5, 6)
G_M_S2 = 9.80665


def faults():
    """{name: (what is wrong, the change to a Recording)}"""
    table = {}

    def fault(name, words, change):
        table[name] = (words, change)

    fault("imu-swapped-xy", "camera-IMU rotation: the IMU's x and y swapped, z negated",
          lambda r: r.turn_imu(SWAP_XY))
    fault("imu-swapped-yz", "camera-IMU rotation: the IMU's y and z swapped, x negated",
          lambda r: r.turn_imu(SWAP_YZ))
    fault("imu-swapped-xz", "camera-IMU rotation: the IMU's x and z swapped, y negated",
          lambda r: r.turn_imu(SWAP_XZ))
    fault("imu-cycled", "camera-IMU rotation: the IMU's y, z, x for x, y, z",
          lambda r: r.turn_imu(CYCLE))
    for axis, letter in enumerate("xyz"):
        quarter = [90 * (i == axis) for i in range(3)]
        signs = [1 if i == axis else -1 for i in range(3)]
        fault(f"imu-quarter-{letter}", f"camera-IMU rotation: turned by 90 degrees about {letter}",
              lambda r, v=quarter: r.turn_imu(exp_rotation(v)))
        fault(f"imu-half-{letter}", f"camera-IMU rotation: two axes negated, a half turn about "
              f"{letter}", lambda r, s=signs: r.turn_imu(diagonal(*s)))
    fault("imu-inverse", "T_BS of both cameras is its inverse", lambda r: r.each_camera(invert))
    fault("imu-transposed", "rotation of T_BS of both cameras is transposed, translations are right",
          lambda r: r.each_camera(transpose_rotation))
    fault("imu-mirrored-x", "rotation of T_BS mirrored: the IMU's x negated (determinant -1)",
          lambda r: r.turn_imu(diagonal(-1, 1, 1)))
    fault("imu-swapped-mirrored", "rotation of T_BS: two rows swapped (determinant -1)",
          lambda r: r.turn_imu([[0, 1, 0], [1, 0, 0], [0, 0, 1]]))
    fault("imu-identity", "rotation of T_BS of both cameras left as the identity",
          lambda r: r.each_camera(identity_rotation))
    fault("imu-10-degrees", "camera-IMU rotation 10 degrees off",
          lambda r: r.turn_imu(exp_rotation([6, -5, 6.2])))
    fault("right-inverse", "T_BS of the right camera is its inverse",
          lambda r: invert(r.cameras[1]))
    fault("right-2-degrees", "right camera turned by 2 degrees about its x",
          lambda r: r.turn_right([2, 0, 0]))

    for sensor, columns in [("gyro", GYRO), ("accel", ACCEL)]:
        for letter, column in zip("xyz", columns):
            fault(f"{sensor}-{letter}-dead", f"{sensor} {letter} is always zero",
                  lambda r, c=column: r.scale_imu([c], [0]))
            fault(f"{sensor}-{letter}-frozen", f"{sensor} {letter} keeps its first value",
                  lambda r, c=column: r.freeze_imu([c]))
            fault(f"{sensor}-{letter}-negated", f"{sensor} {letter} is negated",
                  lambda r, c=column: r.scale_imu([c], [-1]))
        fault(f"{sensor}-negated", f"{sensor} negated in all axes",
              lambda r, c=columns: r.scale_imu(c, [-1] * 3))
        fault(f"{sensor}-dead", f"{sensor} is always zero",
              lambda r, c=columns: r.scale_imu(c, [0] * 3))
        fault(f"{sensor}-stuck-halfway", f"{sensor} keeps one value in the second half",
              lambda r, c=columns: r.freeze_imu(c, 0.5))
    fault("gyro-swapped-xy", "gyro: columns x and y swapped",
          lambda r: r.permute_imu([2, 1, 3, 4, 5, 6]))
    fault("accel-swapped-xy", "accel: columns x and y swapped",
          lambda r: r.permute_imu([1, 2, 3, 5, 4, 6]))
    fault("gyro-accel-swapped", "columns of gyro and accel swapped",
          lambda r: r.permute_imu([4, 5, 6, 1, 2, 3]))
    fault("gyro-degrees", "gyro in deg/s",
          lambda r: r.scale_imu(GYRO, [math.degrees(1)] * 3))
    fault("gyro-double", "gyro twice too large", lambda r: r.scale_imu(GYRO, [2] * 3))
    fault("accel-g", "accel in g", lambda r: r.scale_imu(ACCEL, [1 / G_M_S2] * 3))
    fault("accel-milli-g", "accel in mg", lambda r: r.scale_imu(ACCEL, [1000 / G_M_S2] * 3))

    fault("stamps-s", "all stamps in seconds", lambda r: r.rewrite_stamps(r.all_tables(), 1))
    fault("stamps-us", "all stamps in microseconds",
          lambda r: r.rewrite_stamps(r.all_tables(), 10**6))
    fault("imu-stamps-us", "stamps of the IMU in microseconds",
          lambda r: r.rewrite_stamps([r.imu], 10**6))
    fault("stamps-late-100ms", "cameras stamp 100 ms late",
          lambda r: r.stamp_cameras_late(100_000_000))
    fault("stamps-early-100ms", "cameras stamp 100 ms early",
          lambda r: r.stamp_cameras_late(-100_000_000))
    fault("stamps-late-1s", "cameras stamp 1 s late",
          lambda r: r.stamp_cameras_late(1_000_000_000))
    fault("stamps-late-3s", "cameras stamp 3 s late",
          lambda r: r.stamp_cameras_late(3_000_000_000))
    fault("timeshift-5s", "timeshift_cam_imu of 5 s", lambda r: set_timeshift(r, 5.0))
    fault("timeshift-ms", "timeshift_cam_imu in milliseconds, -10 for -0.01 (and cameras that "
          "stamp 10 ms late)",
          lambda r: (r.stamp_cameras_late(10_000_000), set_timeshift(r, -10.0)))

    fault("lever-mm", "translations of T_BS in millimetres",
          lambda r: r.each_camera(scale_lever))
    fault("lever-metres", "both cameras 2 m from where they are",
          lambda r: r.each_camera(lambda c: set_translation(c, add(c.translation, [2, -1, 0.5]))))
    fault("baseline-zero", "left and right camera at one place", lambda r: r.scale_baseline(0))
    fault("baseline-half", "baseline half as long", lambda r: r.scale_baseline(0.5))
    fault("baseline-double", "baseline twice as long", lambda r: r.scale_baseline(2))
    fault("baseline-negated", "right camera left of the left one",
          lambda r: r.scale_baseline(-1))
    fault("cameras-swapped", "images of the left camera as those of the right, and the reverse",
          Recording.swap_images)
    fault("right-one-image-late", "images of the right camera one late",
          Recording.delay_right_images)

    fault("focal-double", "focal lengths twice too long",
          lambda r: r.scale_intrinsics([2, 2, 1, 1]))
    fault("focal-half", "focal lengths half as long",
          lambda r: r.scale_intrinsics([0.5, 0.5, 1, 1]))
    fault("focal-10-percent", "focal lengths 10 % too long",
          lambda r: r.scale_intrinsics([1.1, 1.1, 1, 1]))
    fault("intrinsics-half-size", "intrinsics of images of half the size",
          lambda r: r.scale_intrinsics([0.5] * 4))
    fault("intrinsics-order", "intrinsics as fx, cx, fy, cy",
          lambda r: r.each_camera(reorder_intrinsics))
    fault("distortion-zero", "distortion coefficients all zero",
          lambda r: r.each_camera(zero_distortion))
    fault("distortion-negated", "distortion coefficients negated",
          lambda r: r.each_camera(negate_distortion))
    return table


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
    if not options.list_faults:
        if options.out is None:
            parser.error("expected SEQ and OUT")
        if not (options.seq / "mav0" / "cam1").is_dir():
            parser.error(f"{options.seq}: found no mav0/cam1, expected a recording as EuRoC's")
        if options.out.exists():
            parser.error(f"{options.out} exists already")
        for name in options.fault:
            if name not in faults():
                parser.error(f"no fault '{name}', see --list-faults")
    return options


def apply_options(recording, options):
    recording.stamp_cameras_late(round(options.time_offset_ms * 1e6),
                                 options.truth_clock == "camera")
    if options.timeshift_ms is not None:
        set_timeshift(recording, 1e-3 * options.timeshift_ms)
    recording.turn_right(options.right_rotation_deg)
    recording.turn_imu(exp_rotation(options.imu_rotation_deg))
    recording.scale_intrinsics([options.focal_scale] * 2 + [1, 1])
    recording.shift_principal(*options.principal_px)
    recording.scale_baseline(options.baseline_scale)
    for camera in recording.cameras:
        camera.translation = add(camera.translation, options.lever_m)
    recording.add_imu_bias(options.gyro_bias_rad_s + options.accel_bias_m_s2)
    if options.imu_bias_seed is not None:
        recording.add_imu_bias(drawn_biases(options.imu_bias_seed))
    for name in options.fault:
        faults()[name][1](recording)


def main():
    options = arguments()
    if options.list_faults:
        for name, (words, _) in faults().items():
            print(f"{name:24}{words}")
        return 0
    for name in faults() if options.all_faults else [None]:
        recording = Recording(options.seq)
        apply_options(recording, options)
        if name:
            faults()[name][1](recording)
        recording.write(options.out / name if name else options.out)
    return 0


if __name__ == "__main__":
    sys.exit(main())
