#!/usr/bin/env python3
"""Feeds odometry as a rig would, from any recording, and compares it with its true poses, if it has
some. usage: live.py SEQ"""
import sys

import numpy as np

import slcmap


def main():
    recording = slcmap.open(sys.argv[1] if len(sys.argv) == 2 else sys.exit(__doc__))
    print(recording, recording.rig)
    odometry = slcmap.Odometry(recording.rig, threads=2)
    imu, fed = recording.imu, 0
    for sample in recording:
        # The samples up to the first one that is not before the image.
        until = int(np.searchsorted(imu["stamps_ns"], sample.stamp_ns)) + 1
        odometry.add_imu(imu["stamps_ns"][fed:until], imu["gyro"][fed:until], imu["accel"][fed:until])
        fed = until
        state = odometry.add_stereo(sample.stamp_ns, sample.left, sample.right)
        if state is not None:
            print(state)
    odometry.finish()
    print(odometry)
    if recording.truth is not None:
        error = slcmap.evaluate(recording.truth, odometry.trajectory)["ape"]["posyaw"]
        print(f"off by {error['position_m']['rmse']:.4f} m (RMSE)")


if __name__ == "__main__":
    main()
