// The rigs of real recordings, as published with them.
#pragma once

#include "data/core/types.h"

namespace slcmap {

inline Rig EurocRig() {
  Rig rig;
  rig.cameras[0] = {Distortion::kRadialTangential,
                    752,
                    480,
                    458.654,
                    457.296,
                    367.215,
                    248.375,
                    {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05}};
  rig.cameras[1] = {Distortion::kRadialTangential,
                    752,
                    480,
                    457.587,
                    456.134,
                    379.999,
                    255.238,
                    {-0.28368365, 0.07451284, -0.00010473, -3.55590700e-05}};
  Eigen::Matrix4d left, right;
  left << 0.0148655429818, -0.999880929698, 0.00414029679422, -0.0216401454975, 0.999557249008,
      0.0149672133247, 0.025715529948, -0.064676986768, -0.0257744366974, 0.00375618835797,
      0.999660727178, 0.00981073058949, 0, 0, 0, 1;
  right << 0.0125552670891, -0.999755099723, 0.0182237714554, -0.0198435579556, 0.999598781151,
      0.0130119051815, 0.0251588363115, 0.0453689425024, -0.0253898008918, 0.0179005838253,
      0.999517347078, 0.00786212447038, 0, 0, 0, 1;
  rig.T_imu_camera = {RigidTransformFromMatrix(left, "left"),
                      RigidTransformFromMatrix(right, "right")};
  return rig;
}

// TUM VI, 512 x 512; the extrinsics of its Kalibr calibration to four digits.
inline Rig TumViRig() {
  Rig rig;
  rig.cameras[0] = {Distortion::kEquidistant,
                    512,
                    512,
                    190.978,
                    190.973,
                    254.932,
                    256.897,
                    {0.0034824, 0.00071503, -0.0020532, 0.00020294}};
  rig.cameras[1] = {Distortion::kEquidistant,
                    512,
                    512,
                    190.442,
                    190.434,
                    252.598,
                    254.917,
                    {0.0034003, 0.00176694, -0.0026632, 0.00032995}};
  const Eigen::Quaterniond R_imu_left = ExpRotation({-1.6, 0.02, -0.03}) * ExpRotation({0, 0, 3.1});
  rig.T_imu_camera[0] = {R_imu_left, {0.0456, -0.0710, -0.0413}};
  const RigidTransform T_left_right(ExpRotation({-0.0007, -0.0480, 0.0108}),
                                    {0.1009, 0.0019, 0.0011});
  rig.T_imu_camera[1] = rig.T_imu_camera[0] * T_left_right;
  return rig;
}

}  // namespace slcmap
