// Rows that are exposed before or after the stamp.
#include "odometry/geometry/exposure.h"

#include <gtest/gtest.h>

#include "data/core/rigid_transform.h"
#include "odometry/frontend/rectifier.h"
#include "odometry/geometry/pinhole.h"
#include "tests/testing/example.h"
#include "tests/testing/pinhole_camera.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

const BodyMotion kMotion{{0.4, -1.1, 0.7}, {3, 2, -4}, {0.8, -0.5, 0.3}, {1.5, -2, 1}};

Rig RollingRig() {
  Rig rig = ExampleStereoRig();
  rig.readout_s = {0.02, -0.01};
  rig.right_time_offset_s = 0.008;
  return rig;
}

TimedPlace See(const Vector3d& p_body, const RigidTransform& T_body_camera, double after_s) {
  return {((kMotion.At(after_s) * T_body_camera).Inverse() * p_body).hnormalized(), after_s};
}

TEST(RowTimes, AreThoseOfTheRowsThatWereRecorded) {
  Rig rig = RollingRig();
  for (Camera& camera : rig.cameras) {
    camera.distortion = Distortion::kRadialTangential;
    camera.coefficients << -0.283, 0.074, 0.0002, 1.8e-5;
  }
  rig.T_imu_camera[1].rotation = rig.T_imu_camera[1].rotation * ExpRotation({0.01, 0, 0.02});
  const Rectifier rectifier(rig, {});
  const RowTimes times(rig, rectifier.rectified_rig());
  EXPECT_FALSE(times.at_once());
  EXPECT_NEAR(times.reach_s(), 0.013, 1e-12);
  for (const int camera : {0, 1}) {
    const Vector2d recorded_px(300, 77);
    const Vector3d ray =
        rig.T_imu_camera[camera].rotation * *rig.cameras[camera].Unproject(recorded_px);
    const Vector3d rectified =
        rectifier.rectified_rig().T_imu_camera[camera].rotation.conjugate() * ray;
    const double expected_s =
        (camera == 0 ? 0.02 : -0.01) * (77.5 / 480 - 0.5) + (camera == 0 ? 0 : 0.008);
    EXPECT_NEAR(times.Of(camera, rectified.hnormalized()).after_s, expected_s, 1e-7);
  }
  EXPECT_TRUE(RowTimes(ExampleStereoRig(), ExampleStereoRig()).at_once());
}

TEST(BodyMotion, IsThatOfTheMotionItWasFeltIn) {
  constexpr int64_t kStamp_ns = 5'000'000'000;
  const MotionSpline motion = ExampleFlight(ExampleStereoRig(), 8);
  ImuSimulatorOptions options;
  options.with_noise = false;
  ImuBuffer imu;
  for (const ImuSample& sample : SimulateImu(motion, options).samples) imu.Add(sample);
  const FeltMotion felt = FeltAround(imu, kStamp_ns, 0.01);
  const RigidTransform T_world_imu = motion.PoseAt(5);
  const Eigen::Quaterniond R_imu_world = T_world_imu.rotation.conjugate();
  const BodyMotion body{felt.rate_rad_s, felt.rate_change_rad_s2,
                        R_imu_world * motion.VelocityAt(5),
                        felt.force_m_s2 + R_imu_world * Vector3d(0, 0, -kGravity_m_s2)};
  for (const double after_s : {-0.02, -0.01, 0.0, 0.01, 0.02}) {
    const RigidTransform error =
        (T_world_imu * body.At(after_s)).Inverse() * motion.PoseAt(5 + after_s);
    EXPECT_LT(error.translation.norm(), 2e-5) << after_s;
    EXPECT_LT(LogRotation(error.rotation).norm(), 1e-4) << after_s;
  }
}

TEST(AtMoment, HasTheResidualOfTheMeasurementsOwnTime) {
  const Rig rig = RollingRig();
  const Vector3d p_body = rig.T_imu_camera[0] * Vector3d(0.7, -0.4, 2.1);
  const Vector2d error(0.003, -0.002);
  for (const int camera : {0, 1}) {
    const RigidTransform& T_body_camera = rig.T_imu_camera[camera];
    for (const double after_s : {-0.01, 0.0, 0.013}) {
      TimedPlace seen = See(p_body, T_body_camera, after_s);
      const Vector2d then = See(p_body, T_body_camera, 0).on_plane;
      const double inverse_depth =
          1 / ((kMotion.At(after_s) * T_body_camera).Inverse() * p_body).z();
      EXPECT_LT((AtMoment(seen, T_body_camera, kMotion, inverse_depth) - then).norm(), 1e-12);
      seen.on_plane += error;
      const auto placed = AtMoment(seen, T_body_camera, kMotion, p_body);
      ASSERT_TRUE(placed);
      EXPECT_LT((*placed - then - error).norm(), 1e-12) << after_s;
    }
    EXPECT_FALSE(AtMoment({}, T_body_camera, kMotion, T_body_camera * Vector3d(0, 0, -1)));
  }
}

TEST(InverseDepth, IsToldByImagesOfTwoTimes) {
  const Rig rig = RollingRig();
  const Vector3d p_body = rig.T_imu_camera[0] * Vector3d(0.7, -0.4, 2.1);
  const TimedPlace left = See(p_body, rig.T_imu_camera[0], -0.004);
  const TimedPlace right = See(p_body, rig.T_imu_camera[1], 0.009);
  const double depth_m = ((kMotion.At(-0.004) * rig.T_imu_camera[0]).Inverse() * p_body).z();
  EXPECT_NEAR(InverseDepth(left, right, rig.T_imu_camera[0], rig.T_imu_camera[1], kMotion),
              1 / depth_m, 1e-9);
}

constexpr double kLonger = 0.003;

Camera Pinhole() { return testing::PinholeCamera(752, 480, 458, 370, 245); }

// Places on the rectified plane, as they are measured through a camera that is longer than given
// and off its principal point.
void ExpectPlaces(const Camera& given, const Vector3d& turn_rad) {
  const Camera rectified = Pinhole();
  const Eigen::Quaterniond R = ExpRotation(turn_rad);
  const Vector2d off_px(0.8, -0.5);
  Camera is = given;
  is.fx_px *= 1 + kLonger;
  is.fy_px *= 1 + kLonger;
  is.cx_px += off_px.x();
  is.cy_px += off_px.y();
  const LensShift shift(given, R, rectified);
  for (double x_px = 30; x_px < 720; x_px += 37) {
    for (double y_px = 30; y_px < 450; y_px += 41) {
      const Vector2d place = PlaneFromPixel(rectified, Vector2d(x_px, y_px));
      const Vector2d pixel = *is.Project(R * place.homogeneous());
      const Vector2d measured = (R.conjugate() * *given.Unproject(pixel)).hnormalized();
      const Vector2d by_centre = shift.ByCentre(measured) * off_px;
      const Vector2d found = measured - by_centre -
                             kLonger / (1 + kLonger) * shift.ByFocalLength(measured - by_centre);
      EXPECT_LT(rectified.fx_px * (found - place).norm(), 0.01) << place.transpose();
    }
  }
}

TEST(LensShift, TellsPlacesThroughLensesAndTurnedCameras) {
  Camera camera = Pinhole();
  ExpectPlaces(camera, Vector3d::Zero());
  ExpectPlaces(camera, {0.004, -0.014, 0.01});
  camera.distortion = Distortion::kRadialTangential;
  camera.coefficients << -0.283, 0.074, 0.0002, 1.8e-5;
  ExpectPlaces(camera, {0.004, -0.014, 0.01});
  camera.distortion = Distortion::kEquidistant;
  camera.coefficients << 0.003, 0.0007, -0.002, 0.0002;
  ExpectPlaces(camera, {0.004, -0.014, 0.01});
}

TEST(LensShift, ItsGradientIsThatOfItsDifferences) {
  Camera camera = Pinhole();
  camera.distortion = Distortion::kEquidistant;
  const LensShift shift(camera, ExpRotation({0.004, -0.014, 0.01}), Pinhole());
  constexpr double kStep = 1e-4;
  const Vector2d at(0.31, -0.22);
  for (int axis = 0; axis < 2; ++axis) {
    const Vector2d step = kStep * Vector2d::Unit(axis);
    const Vector2d difference =
        (shift.ByFocalLength(at + step) - shift.ByFocalLength(at - step)) / (2 * kStep);
    EXPECT_LT((shift.GradientAt(at).col(axis) - difference).norm(), 1e-6);
  }
  EXPECT_GT(shift.GradientAt(at)(0, 0), 1.1);
  EXPECT_EQ(LensShift().GradientAt(at), Eigen::Matrix2d::Identity());
}

TEST(LensShift, OfAnIdealPinholeIsAScale) {
  const Vector2d at(0.3, -0.2), outside(2, 2);
  EXPECT_EQ(LensShift().ByFocalLength(at), at);
  EXPECT_TRUE(LensShift().ByCentre(at).isZero(0));
  const LensShift pinhole(Pinhole(), Eigen::Quaterniond::Identity(), Pinhole());
  EXPECT_LT((pinhole.ByFocalLength(at) - at).norm(), 1e-9);
  // Outside the image, as a pinhole that is nearly one has it.
  EXPECT_LT((pinhole.ByFocalLength(outside) - outside).norm(), 1e-6);
}

class RightRectificationTest : public ::testing::Test {
 protected:
  RightRectificationTest() {
    given_ = ExampleStereoRig();
    for (Camera& camera : given_.cameras) {
      camera.distortion = Distortion::kEquidistant;
      camera.coefficients << 0.003, 0.0007, -0.002, 0.0002;
    }
    rectified_ = Rectifier(given_, {}).rectified_rig();
    lens_ = ComputeLensShifts(given_, rectified_)[1];
  }

  // Where the true right camera's image, rectified with what is known of it, shows a direction of
  // the rectified frame, and where it would be as it was given.
  Vector2d GivenPlaneOf(const Vector2d& px, const RightCorrection& is) const {
    const Eigen::Quaterniond R_camera_rectified =
        given_.T_imu_camera[1].rotation.conjugate() * rectified_.T_imu_camera[1].rotation;
    Camera camera = given_.cameras[1];
    camera.cx_px += is.centre_px.x();
    camera.cy_px += is.centre_px.y();
    const Eigen::Vector3d ray = PlaneFromPixel(rectified_.cameras[1], px).homogeneous();
    const Vector2d recorded_px =
        *camera.Project(R_camera_rectified * (ExpRotation(-is.rotation_rad) * ray));
    return (R_camera_rectified.conjugate() * *given_.cameras[1].Unproject(recorded_px))
        .hnormalized();
  }

  Rig given_, rectified_;
  LensShift lens_;
};

TEST_F(RightRectificationTest, TellsPlacesAsTheGivenCameraHasThem) {
  RightRectification right(rectified_.cameras[1], lens_);
  const Camera& camera = rectified_.cameras[1];
  const RightCorrection is{{0.004, -0.006, 0.003}, {1.5, -0.8}};
  for (const RightCorrection& known : {RightCorrection(), is}) {
    right.Set(known);
    for (const auto& [x, y] : {std::pair{0.5, 0.5}, {0.2, 0.3}, {0.8, 0.7}}) {
      const Vector2d px(x * camera.width_px, y * camera.height_px);
      const double off_px = camera.fx_px * (right.GivenPlane(px) - GivenPlaneOf(px, known)).norm();
      EXPECT_LT(off_px, 0.03) << px.transpose();
    }
  }
}

TEST_F(RightRectificationTest, RowsAreOffByWhatImagesWereNotRectifiedWith) {
  RightRectification right(rectified_.cameras[1], lens_);
  const double focal_px = rectified_.cameras[1].fy_px;
  EXPECT_LT(right.RowsOff_px({}), 1e-9);
  const RightCorrection turned{{0.002, 0, 0}, Vector2d::Zero()};
  EXPECT_GT(right.RowsOff_px(turned), 0.9 * 0.002 * focal_px);
  const RightCorrection lower{Eigen::Vector3d::Zero(), {0, 1}};
  EXPECT_GT(right.RowsOff_px(lower), 0.9);
  const double middle_px = rectified_.cameras[1].fy_px / given_.cameras[1].fy_px;
  // A turn that stands for a principal point leaves the middle's rows where they are.
  const RightCorrection both{{-middle_px / focal_px, 0, 0}, {0, 1}};
  EXPECT_LT(right.RowsOff_px(both), 0.5 * right.RowsOff_px(lower));
  right.Set(turned);
  EXPECT_LT(right.RowsOff_px(turned), 1e-9);
  right.Set(lower);
  EXPECT_LT(right.RowsOff_px(lower), 0.01);
}

}  // namespace
}  // namespace slcmap
