#include "odometry/frontend/rectifier.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <utility>

#include "data/core/error.h"
#include "tests/testing/example.h"

namespace slcmap {
namespace {

// As those of EuRoC and of TUM VI: lenses, and how the right camera is turned.
Rig WithLenses(Distortion distortion, const Eigen::Vector4d& coefficients,
               const Eigen::Vector3d& right_turn_rad) {
  Rig rig = ExampleStereoRig();
  for (Camera& camera : rig.cameras) {
    camera.distortion = distortion;
    camera.coefficients = coefficients;
  }
  rig.cameras[1].cx_px += 12.8;
  rig.cameras[1].cy_px += 6.9;
  rig.cameras[1].fx_px -= 1.1;
  rig.T_imu_camera[1].rotation = rig.T_imu_camera[1].rotation * ExpRotation(right_turn_rad);
  return rig;
}

Rig EurocRig() {
  return WithLenses(Distortion::kRadialTangential, {-0.2834, 0.07396, 0.000194, 1.76e-05},
                    {0.007, -0.014, -0.002});
}

Rig TumViRig() {
  Rig rig = WithLenses(Distortion::kEquidistant, {0.0034824, 0.00071503, -0.0020532, 0.00020294},
                       {-0.0007, -0.0480, 0.0108});
  for (Camera& camera : rig.cameras) {
    camera.width_px = camera.height_px = 512;
    camera.fx_px = camera.fy_px = 190.978;
    camera.cx_px = 254.932;
    camera.cy_px = 256.897;
  }
  return rig;
}

// A rig that was held turned about its axes by so many right angles: both images are turned.
Rig Turned(Rig rig, int quarters) {
  for (int i = 0; i < 2; ++i) {
    Camera& camera = rig.cameras[i];
    for (int k = 0; k < (quarters + 4) % 4; ++k) {
      std::swap(camera.fx_px, camera.fy_px);
      std::swap(camera.cx_px, camera.cy_px);
      std::swap(camera.width_px, camera.height_px);
      camera.cx_px = camera.width_px - 1 - camera.cx_px;
      const Eigen::Vector2d p = camera.coefficients.tail<2>();
      camera.coefficients.tail<2>() << p[1], -p[0];
    }
    rig.T_imu_camera[i].rotation =
        rig.T_imu_camera[i].rotation * ExpRotation({0, 0, -0.5 * 3.14159265358979 * quarters});
  }
  return rig;
}

Rig Exchanged(Rig rig) {
  std::swap(rig.cameras[0], rig.cameras[1]);
  std::swap(rig.T_imu_camera[0], rig.T_imu_camera[1]);
  return rig;
}

// The second camera stands above the first.
Rig Upright(Rig rig) {
  const RigidTransform& left = rig.T_imu_camera[0];
  rig.T_imu_camera[1].translation =
      left.translation + left.rotation * Eigen::Vector3d(0.002, -0.11, 0.001);
  return rig;
}

class RectifierTest : public ::testing::TestWithParam<Rig> {
 protected:
  Rectifier rectifier_{GetParam(), RectifierOptions()};
};

std::string GetName(const ::testing::TestParamInfo<Rig>& info) {
  constexpr const char* kNames[] = {"Euroc",         "TumVi",     "Clockwise", "UpsideDown",
                                    "Anticlockwise", "Exchanged", "Upright"};
  return kNames[info.index];
}

INSTANTIATE_TEST_SUITE_P(Rigs, RectifierTest,
                         ::testing::Values(EurocRig(), TumViRig(), Turned(EurocRig(), 1),
                                           Turned(EurocRig(), 2), Turned(EurocRig(), -1),
                                           Exchanged(EurocRig()), Upright(EurocRig())),
                         GetName);

TEST_P(RectifierTest, APointHasTheSameRowInBothAndTheDisparityOfItsDepth) {
  const Rig& rig = rectifier_.rectified_rig();
  const double baseline_m =
      (rig.T_imu_camera[1].translation - rig.T_imu_camera[0].translation).norm();
  for (const double depth_m : {0.5, 3.0, 40.0}) {
    for (const double x : {-0.3, 0.0, 0.4}) {
      const Eigen::Vector3d p_left = depth_m * Eigen::Vector3d(x, 0.2 - x, 1);
      const Eigen::Vector3d p_imu = rig.T_imu_camera[0] * p_left;
      const auto left = rig.cameras[0].Project(p_left);
      const auto right = rig.cameras[1].Project(rig.T_imu_camera[1].Inverse() * p_imu);
      ASSERT_TRUE(left && right);
      EXPECT_NEAR(left->y(), right->y(), 1e-6);
      EXPECT_NEAR(left->x() - right->x(), rig.cameras[0].fx_px * baseline_m / depth_m, 1e-6);
    }
  }
}

TEST_P(RectifierTest, KeepsTheCamerasWhereTheyAreAndTheirScaleInTheMiddle) {
  for (int i : {0, 1}) {
    const Rig& rig = rectifier_.rectified_rig();
    EXPECT_EQ(rig.T_imu_camera[i].translation, GetParam().T_imu_camera[i].translation);
    EXPECT_EQ(rig.cameras[i].distortion, Distortion::kNone);
    EXPECT_NEAR(rig.cameras[i].fx_px / GetParam().cameras[i].fx_px, RectifierOptions().scale, 0.01);
    EXPECT_EQ(rig.cameras[i].fx_px, rig.cameras[i].fy_px);
  }
}

// An image that encodes where it was taken: the brightness grows along x (camera 0) or y (camera
// 1).
TEST_P(RectifierTest, ContentMovesAsTheGeometrySays) {
  for (int i : {0, 1}) {
    const Camera& camera = GetParam().cameras[i];
    const Camera& pinhole = rectifier_.rectified_rig().cameras[i];
    cv::Mat ramp(camera.height_px, camera.width_px, CV_8UC1);
    for (int v = 0; v < ramp.rows; ++v) {
      for (int u = 0; u < ramp.cols; ++u)
        ramp.at<uchar>(v, u) = static_cast<uchar>((i == 0 ? u : v) / 4);
    }
    const cv::Mat rectified = rectifier_.Rectify(ramp, i);
    ASSERT_EQ(rectified.size(), cv::Size(pinhole.width_px, pinhole.height_px));
    const Eigen::Quaterniond R_camera_rectified =
        GetParam().T_imu_camera[i].rotation.conjugate() *
        rectifier_.rectified_rig().T_imu_camera[i].rotation;
    int checked = 0;
    for (int v = 5; v < rectified.rows; v += 23) {
      for (int u = 5; u < rectified.cols; u += 23) {
        if (!rectifier_.mask(i).at<uchar>(v, u)) continue;
        const auto ray = pinhole.Unproject({u, v});
        const auto source = camera.Project(R_camera_rectified * *ray);
        ASSERT_TRUE(source);
        EXPECT_NEAR(rectified.at<uchar>(v, u), (*source)[i] / 4, 1.1);
        ++checked;
      }
    }
    EXPECT_GT(checked, 300);
  }
}

TEST_P(RectifierTest, TheMaskHoldsOnlyTruePixelsAndMostOfTheImage) {
  const cv::Mat white(GetParam().cameras[0].height_px, GetParam().cameras[0].width_px, CV_8UC1,
                      255);
  for (int i : {0, 1}) {
    cv::Mat wrong;
    cv::bitwise_and(rectifier_.mask(i), rectifier_.Rectify(white, i) != 255, wrong);
    EXPECT_EQ(cv::countNonZero(wrong), 0);
    EXPECT_GT(cv::countNonZero(rectifier_.mask(i)),
              0.85 * static_cast<double>(rectifier_.mask(i).total()));
  }
}

TEST(Rectifier, LimitsTheFieldOfViewOfAFisheye) {
  RectifierOptions options;
  options.max_field_of_view_rad = 1.5;
  const Rectifier rectifier(TumViRig(), options);
  const Camera& pinhole = rectifier.rectified_rig().cameras[0];
  const double angle_rad = std::atan(pinhole.cx_px / pinhole.fx_px) +
                           std::atan((pinhole.width_px - 1 - pinhole.cx_px) / pinhole.fx_px);
  EXPECT_LE(angle_rad, 1.5);
  EXPECT_GT(angle_rad, 1.45);
}

TEST(Rectifier, CamerasThatLookApartKeepTheirOrientations) {
  Rig rig = TumViRig();
  rig.T_imu_camera[1].rotation = rig.T_imu_camera[1].rotation * ExpRotation({0, 3.14, 0});
  const Rectifier rectifier(rig, RectifierOptions());
  const Rig& rectified = rectifier.rectified_rig();
  EXPECT_FALSE(IsStereo(rectified));
  for (int i = 0; i < 2; ++i) {
    EXPECT_TRUE(rectified.T_imu_camera[i].rotation.isApprox(rig.T_imu_camera[i].rotation, 1e-12));
    EXPECT_EQ(rectified.cameras[i].fx_px, rectified.cameras[0].fx_px);
    const cv::Size size(rectified.cameras[i].width_px, rectified.cameras[i].height_px);
    EXPECT_EQ(rectifier.mask(i).size(), size);
    EXPECT_GT(cv::countNonZero(rectifier.mask(i)), 0.8 * size.area());
  }
}

TEST(Rectifier, CamerasThatStandBehindEachOtherAreAnError) {
  Rig rig = EurocRig();
  const RigidTransform& left = rig.T_imu_camera[0];
  rig.T_imu_camera[1].translation =
      left.translation + left.rotation * Eigen::Vector3d(0.01, 0, 0.1);
  EXPECT_THROW(Rectifier(rig, RectifierOptions()), DataError);
}

TEST(Rectifier, OneCameraKeepsItsOrientation) {
  Rig rig = EurocRig();
  rig.cameras[1] = Camera();
  const Rectifier rectifier(rig, RectifierOptions());
  EXPECT_TRUE(rectifier.rectified_rig().T_imu_camera[0].rotation.isApprox(
      rig.T_imu_camera[0].rotation, 1e-12));
  EXPECT_EQ(rectifier.rectified_rig().cameras[1].width_px, 0);
}

}  // namespace
}  // namespace slcmap
