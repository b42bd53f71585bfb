#!/usr/bin/env python3
"""The Python module on a simulated recording: its arrays, its errors, and the program's bytes."""
import ast
import gc
import logging
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

try:
    import numpy as np
except ImportError:
    print("skipped: the Python module: no numpy")
    sys.exit(77)
import slcmap

PROGRAM = os.environ["SLCMAP_PROGRAM"]
# Written anew each time, as what they measure is.
TIMES = {"timings.json", "run.json"}

SCENE = """name: small_room
objects:
  - {kind: wall, points: [[0, 0], [5, 0], [5, 4], [0, 4]], closed: true, material: brick}
  - {kind: slab, at: [0, 0, 0], size: [5, 4], material: carpet}
  - {kind: lamp, at: [2, 2, 2.9], size: [1, 0.5], radiance: 30}
  - {kind: box, at: [3.5, 3.2, 0], size: [0.8, 0.6, 1.8]}
  - {kind: box, at: [3.8, 0.4, 0], size: [1.0, 0.6, 0.75]}
trajectory:
  kind: robot
  waypoints_m: [[0.8, 2, 1.2], [2, 1.2, 1.2], [3, 2, 1.2], [2, 2.8, 1.2]]
  stand_still_s: 0.5
"""


def make_rig():
    """376 x 240 px; the IMU looks along x with z up, the cameras are beside it."""
    camera = slcmap.Camera(376, 240, [200, 200, 187.5, 119.5])
    poses = [[[0, 0, 1, 0], [-1, 0, 0, y], [0, -1, 0, 0], [0, 0, 0, 1]] for y in (0.05, -0.05)]
    return slcmap.Rig([camera, camera], poses)


def setUpModule():
    global FOLDER, RECORDING, SHARES
    FOLDER = pathlib.Path(tempfile.mkdtemp(prefix="slcmap-test-"))
    (FOLDER / "scene.yaml").write_text(SCENE)
    make_rig().save(FOLDER / "rig.yaml")
    SHARES = []
    RECORDING = slcmap.simulate(FOLDER / "scene.yaml", FOLDER / "seq", rig=FOLDER / "rig.yaml",
                                duration=4, seed=3,
                                progress=lambda label, share: SHARES.append((label, share)))


def tearDownModule():
    shutil.rmtree(FOLDER)


def files(folder):
    return {path.relative_to(folder): path.read_bytes() for path in sorted(folder.rglob("*"))
            if path.is_file() and path.name not in TIMES}


class RecordingTest(unittest.TestCase):
    def test_arrays_have_shapes_and_values(self):
        rig = RECORDING.rig
        self.assertEqual((rig.cameras[0].width_px, rig.cameras[1].height_px), (376, 240))
        self.assertEqual(rig.T_imu_camera.shape, (2, 4, 4))
        np.testing.assert_allclose(rig.T_imu_camera[:, 1, 3], [0.05, -0.05], atol=1e-9)
        imu = RECORDING.imu
        self.assertEqual(imu["stamps_ns"].dtype, np.int64)
        self.assertEqual(imu["gyro"].shape, (len(imu["stamps_ns"]), 3))
        np.testing.assert_allclose(imu["accel"][:40].mean(axis=0)[2], 9.81, atol=0.3)
        self.assertTrue((np.diff(imu["stamps_ns"]) == 5_000_000).all())
        self.assertGreater(len(RECORDING.truth), 70)
        self.assertIn("pairs", repr(RECORDING))
        self.assertGreater(len(SHARES), 3)
        self.assertTrue(all(0 <= share <= 1 for _, share in SHARES), SHARES)

    def test_every_pass_gives_the_same_images(self):
        passes = [[(s.stamp_ns, s.left.copy(), s.right.copy()) for s in RECORDING] for _ in range(2)]
        self.assertEqual(len(passes[0]), len(RECORDING))
        self.assertEqual([s[0] for s in passes[0]], RECORDING.stamps_ns.tolist())
        for i in (0, 7, -1):
            stamp_ns, left, right = passes[1][i]
            self.assertEqual((left.shape, left.dtype), ((240, 376), np.uint8))
            self.assertEqual(stamp_ns, RECORDING[i].stamp_ns)
            for image, other in ((left, passes[0][i][1]), (left, RECORDING[i].left),
                                 (right, RECORDING[i].right)):
                np.testing.assert_array_equal(image, other)
        for index in (len(RECORDING), -len(RECORDING) - 1):
            with self.assertRaisesRegex(IndexError, f"found index {index}, expected"):
                RECORDING[index]
        for part in (slice(2, 5), slice(-1, None, -20), slice(7, 2)):
            self.assertEqual([s.stamp_ns for s in RECORDING[part]], RECORDING.stamps_ns[part].tolist())

    def test_arrays_keep_what_they_look_at(self):
        left = next(iter(slcmap.open(FOLDER / "seq"))).left
        gyro = slcmap.open(FOLDER / "seq").imu["gyro"]
        gc.collect()
        np.testing.assert_array_equal(left, RECORDING[0].left)
        np.testing.assert_array_equal(gyro, RECORDING.imu["gyro"])
        with self.assertRaises(ValueError):
            gyro[0] = 0  # it is the recording's

    def test_cameras_and_trajectories_go_both_ways(self):
        camera = RECORDING.rig.cameras[0]
        points = np.array([[0.1, -0.2, 2.0], [0, 0, -1]])
        pixels = camera.project(points)
        np.testing.assert_allclose(pixels[0], [187.5 + 10, 119.5 - 20])
        self.assertTrue(np.isnan(pixels[1]).all())
        np.testing.assert_allclose(camera.unproject(pixels[:1])[0] * np.linalg.norm(points[0]), points[0])
        truth = RECORDING.truth
        same = slcmap.Trajectory(truth.stamps_ns, truth.positions, truth.quaternions_wxyz)
        np.testing.assert_allclose(same.T_world_imu, truth.T_world_imu, atol=1e-12)
        np.testing.assert_allclose(truth.at(int(truth.stamps_ns[5])), truth.T_world_imu[5])
        self.assertIsNone(truth.at(0))

    def test_rigs_are_within_the_ranges_of_calibrations(self):
        rig = make_rig()
        for numbers in ({"imu_noise": {"gyro_noise_rad_s_sqrthz": float("nan")}},
                        {"imu_noise": {"rate_hz": -1}}, {"imu_noise": {"accel_walk_m_s3_sqrthz": 0}},
                        {"imu_noise": {"rate": 200}}, {"right_time_offset_s": 5}, {"readout_s": [0, 5]}):
            with self.assertRaisesRegex(ValueError, list(numbers)[0]):
                slcmap.Rig(rig.cameras, rig.T_imu_camera, **numbers)
        rates = slcmap.Rig(rig.cameras, rig.T_imu_camera, imu_noise={**rig.imu_noise, "rate_hz": 400}).imu_noise
        self.assertEqual(rates, {**rig.imu_noise, "rate_hz": 400})


class OdometryTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.live = slcmap.Odometry(RECORDING.rig)
        imu, fed = RECORDING.imu, 0
        start_s = time.process_time()
        for sample in RECORDING:
            until = np.searchsorted(imu["stamps_ns"], sample.stamp_ns) + 1
            cls.live.add_imu(imu["stamps_ns"][fed:until], imu["gyro"][fed:until], imu["accel"][fed:until])
            cls.state = cls.live.add_stereo(sample.stamp_ns, sample.left, sample.right)
            fed = until
        cls.frame_s = (time.process_time() - start_s) / len(RECORDING)
        run_folder = FOLDER / "live-run"
        cls.commanded = slcmap.odometry(RECORDING, run_folder, no_check=True)

    def test_fed_live_it_is_the_commands(self):
        live, run = self.live.trajectory, self.commanded.trajectory
        self.assertGreater(len(live), 40)
        np.testing.assert_array_equal(live.stamps_ns, run.stamps_ns)
        np.testing.assert_allclose(live.positions, run.positions, atol=1e-6)
        self.assertEqual(self.state.stamp_ns, live.stamps_ns[-1])
        np.testing.assert_allclose(self.state.T_world_imu, live.T_world_imu[-1], atol=1e-12)
        self.assertEqual(self.live.lines.shape[1], 6)
        self.assertGreater(len(self.live.points), 50)
        figures = slcmap.evaluate(RECORDING.truth, live)
        self.assertLess(figures["ape"]["posyaw"]["position_m"]["rmse"], 0.05)

    def test_a_call_costs_little(self):
        sample, calls = RECORDING[0], 300  # of the past: not taken
        left, right = sample.left, sample.right
        start_s = time.process_time()
        for _ in range(calls):
            for _ in range(10):
                self.live.add_imu(0, [0, 0, 0], [0, 0, 9.81])
            self.live.add_stereo(sample.stamp_ns, left, right)
        call_s = (time.process_time() - start_s) / calls
        print(f"figure: Python costs {1e6 * call_s:.0f} us of CPU an image with ten samples of the IMU, "
              f"{100 * call_s / self.frame_s:.2f} % of {1e3 * self.frame_s:.1f} ms")

    def test_wrong_arrays_are_refused(self):
        with self.assertRaisesRegex(slcmap.ConfigError, "left: found float64 of shape"):
            self.live.add_stereo(0, np.zeros((240, 376)), None)
        right = np.zeros((240, 376), np.uint8)
        for left in (None, right[:, 1:], right[:0], right[None]):
            with self.assertRaisesRegex(slcmap.ConfigError, r"left: found .*expected uint8 .*\(240, 376\)"):
                self.live.add_stereo(0, left, right)
        with self.assertRaisesRegex(slcmap.ConfigError, "others: found an image of camera 2"):
            self.live.add_stereo(0, right, right, [right])
        with self.assertRaisesRegex(slcmap.ConfigError, "add_imu: found 2 stamps"):
            self.live.add_imu(np.arange(2), np.zeros((3, 3)), np.zeros((2, 3)))
        for seconds in (1600000000.5, np.array([0.1, 0.2])):
            with self.assertRaisesRegex(slcmap.ConfigError, "expected whole nanoseconds"):
                self.live.add_imu(seconds, np.zeros(3), np.zeros(3))
        with self.assertRaisesRegex(slcmap.ConfigError, "expected nanoseconds that fit int64"):
            self.live.add_imu(np.array([2**63], np.uint64), np.zeros(3), np.zeros(3))

    def test_stamps_are_of_any_type_of_whole_numbers(self):
        live = slcmap.Odometry(RECORDING.rig)
        for stamps in (np.arange(2, dtype=np.uint64), np.arange(2, 4, dtype=np.int16),
                       np.arange(4, 6, dtype=">u4"), [6, 7]):
            live.add_imu(stamps, np.zeros((2, 3)), np.zeros((2, 3)))
        self.assertEqual(live.warnings, {})

    def test_options_count_as_those_of_a_run(self):
        self.assertEqual(slcmap.Odometry(RECORDING.rig).method, "slc")
        options = {"method": "points", "points": {"max_points": np.int64(90)}}
        self.assertEqual(slcmap.Odometry(RECORDING.rig, options=options).method, "points")
        self.assertEqual(slcmap.Odometry(RECORDING.rig, "structural", options).method, "structural")
        for wrong in ({"mapping": {"foo": {}}}, {"verdict": {"foo": 1}}, {"points": {"max_points": self}}):
            with self.assertRaisesRegex(slcmap.ConfigError, "options: .*(foo|found)"):
                slcmap.Odometry(RECORDING.rig, options=wrong)
        with self.assertRaisesRegex(slcmap.ConfigError, "threads: found 1000, expected 1 or 2"):
            slcmap.Odometry(RECORDING.rig, threads=1000)


class CommandTest(unittest.TestCase):
    def test_bytes_are_the_programs(self):
        result = slcmap.run(RECORDING, FOLDER / "out", method="slc", format="ply",
                            options={"points": {"max_points": 120}})
        python = FOLDER / "python-out"
        (FOLDER / "out").rename(python)
        (FOLDER / "options.yaml").write_text("points: {max_points: 120}\n")
        subprocess.run([PROGRAM, "-q", "run", FOLDER / "seq", "-o", FOLDER / "out", "--method", "slc",
                        "--format", "ply", "--config", FOLDER / "options.yaml"], check=True,
                       stdout=subprocess.DEVNULL)
        mine, others = files(python), files(FOLDER / "out")
        self.assertEqual(mine.keys(), others.keys())
        different = [str(name) for name in mine if mine[name] != others[name]]
        self.assertEqual(different, [])
        self.check_map(slcmap.Result(python))
        self.assertEqual(result.folder, str(FOLDER / "out"))

    def check_map(self, result):
        map_ = result.map
        self.assertGreater(len(map_.lines), 10)
        count = len(map_.lines)
        self.assertEqual(map_.lines.shape, (count, 6))
        for column in (map_.line_probability, map_.line_ids, map_.line_kinds, map_.line_axes):
            self.assertEqual(len(column), count)
        self.assertLessEqual(set(map_.line_axes), {"x", "y", "vertical", "none", "sloped"})
        self.assertEqual(map_.points.shape[1], 3)
        self.assertEqual(map_.dense.shape, map_.dense_normals.shape)
        self.assertEqual(map_.dense_grey.dtype, np.uint8)
        np.testing.assert_allclose(np.linalg.norm(map_.dense_normals, axis=1), 1, atol=1e-3)
        self.assertEqual(map_.occupied.shape[1], 4)
        for plane in map_.planes:
            off_m = plane["outline"] @ plane["normal"] - plane["offset_m"]
            np.testing.assert_allclose(off_m, 0, atol=1e-3)
        for room in map_.rooms:
            self.assertEqual(room["polygon"].shape[1], 2)
        self.assertIn(f"{count} lines", repr(map_))
        self.assertEqual(len(result.trajectory), len(map_.trajectory))
        lines = map_.lines
        del map_, result
        gc.collect()
        self.assertTrue(np.isfinite(lines).all())

    def test_errors_have_types_and_places(self):
        nowhere = FOLDER / "nowhere"
        with self.assertRaisesRegex(slcmap.DataError, "nowhere: found no such folder"):
            slcmap.odometry(nowhere, FOLDER / "none")
        for load in (slcmap.open, slcmap.Map.load, slcmap.Run.load, slcmap.Trajectory.load):
            with self.assertRaises(ValueError) as raised:
                load(nowhere)
            self.assertIsInstance(raised.exception, slcmap.DataError)
        for call in (lambda options: slcmap.odometry(RECORDING, FOLDER / "none", options=options),
                     lambda options: slcmap.Odometry(RECORDING.rig, options=options)):
            with self.assertRaisesRegex(slcmap.ConfigError, r"options: .*max_pionts"):
                call({"points": {"max_pionts": 3}})
        with self.assertRaisesRegex(slcmap.DataError, "^(truth|estimate)"):
            slcmap.evaluate(RECORDING.truth, slcmap.Trajectory([1, 2], np.zeros((2, 3)), [[1, 0, 0, 0]] * 2))
        with self.assertRaisesRegex(slcmap.ConfigError, "did you mean '--duration'"):
            slcmap.odometry(RECORDING, FOLDER / "none", duratoin=3)
        (FOLDER / "file").touch()
        with self.assertRaises(OSError) as raised:
            RECORDING.truth.save_tum(FOLDER / "file" / "poses.tum")
        self.assertIsInstance(raised.exception, slcmap.OutputError)
        with self.assertRaises(slcmap.ConfigError):
            slcmap.command("compare", FOLDER / "seq", "-o", FOLDER / "none")
        self.assertFalse((FOLDER / "none").exists())

    def test_ctrl_c_and_errors_of_progress_end_it_with_the_results_so_far(self):
        def press(label, share):
            if label == "odometry":
                os.kill(os.getpid(), signal.SIGINT)
        with self.assertRaises(KeyboardInterrupt):
            slcmap.odometry(RECORDING, FOLDER / "stopped", no_check=True, progress=press)
        self.assertFalse(slcmap.Run.load(FOLDER / "stopped").complete)

        def fail(label, share):
            raise LookupError(label)
        with self.assertRaises(LookupError):
            slcmap.odometry(RECORDING, FOLDER / "failed", no_check=True, progress=fail)
        # The next one knows nothing of it.
        with self.assertLogs("slcmap", logging.INFO) as log:
            run = slcmap.odometry(RECORDING, FOLDER / "after", no_check=True)
        self.assertTrue(run.complete)
        self.assertIn("wrote", "".join(log.output))

    def test_commands_print_to_the_caller(self):
        self.assertIn("usage", slcmap.command("help", "odometry").lower())
        report = slcmap.check(RECORDING)
        self.assertIn("findings", report)


class StubsTest(unittest.TestCase):
    stub = pathlib.Path(slcmap.__file__).with_name("_slcmap.pyi")

    def test_they_say_what_is_there(self):
        for node in ast.parse(self.stub.read_text()).body:
            if not isinstance(node, ast.ClassDef):
                continue
            names = {n.target.id if isinstance(n, ast.AnnAssign) else n.name for n in node.body
                     if isinstance(n, (ast.AnnAssign, ast.FunctionDef))} - {"__init__"}
            there = {n for n in vars(getattr(slcmap._slcmap, node.name))
                     if not n.startswith("__") or n in ("__len__", "__getitem__", "__iter__", "__next__")}
            self.assertEqual(names, there if names else set(), node.name)

    def test_mypy_has_nothing_to_say(self):
        mypy = [sys.executable, "-m", "mypy"]
        if subprocess.run(mypy + ["--version"], capture_output=True).returncode != 0:
            print("skipped: types of the Python module: no mypy")
            self.skipTest("no mypy")
        done = subprocess.run(mypy + ["--strict", "--cache-dir", FOLDER / "mypy", self.stub.parent],
                              capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)


if __name__ == "__main__":
    unittest.main()
