#include <gtest/gtest.h>

#include "data/core/rigid_transform.h"
#include "odometry/geometry/pinhole.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kLonger = 0.003;

Camera Pinhole() {
  Camera camera;
  camera.width_px = 752;
  camera.height_px = 480;
  camera.fx_px = camera.fy_px = 458;
  camera.cx_px = 370;
  camera.cy_px = 245;
  return camera;
}

// What is measured of a place on the rectified plane, through a camera that is longer than given.
Vector2d Measured(const Camera& given, const Eigen::Quaterniond& R, const Vector2d& place) {
  Camera longer = given;
  longer.fx_px *= 1 + kLonger;
  longer.fy_px *= 1 + kLonger;
  const Vector2d pixel = *longer.Project(R * place.homogeneous());
  return (R.conjugate() * *given.Unproject(pixel)).hnormalized();
}

void ExpectPlaces(const Camera& given, const Vector3d& turn_rad) {
  const Camera rectified = Pinhole();
  const Eigen::Quaterniond R = ExpRotation(turn_rad);
  const LensShift shift(given, R, rectified);
  for (double x_px = 30; x_px < 720; x_px += 37) {
    for (double y_px = 30; y_px < 450; y_px += 41) {
      const Vector2d place = PlaneFromPixel(rectified, Vector2d(x_px, y_px));
      const Vector2d measured = Measured(given, R, place);
      const Vector2d found = measured - kLonger / (1 + kLonger) * shift.ByFocalLength(measured);
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

// A principal point that is off, seen through a lens of each kind and a turned camera.
TEST(LensShift, TellsPlacesByThePrincipalPoint) {
  const Camera rectified = Pinhole();
  const Eigen::Quaterniond R = ExpRotation({0.004, -0.014, 0.01});
  const Vector2d off_px(0.8, -0.5);
  Camera given = Pinhole();
  for (const Distortion lens : {Distortion::kNone, Distortion::kEquidistant}) {
    given.distortion = lens;
    if (lens == Distortion::kEquidistant) given.coefficients << 0.003, 0.0007, -0.002, 0.0002;
    Camera is = given;
    is.cx_px += off_px.x();
    is.cy_px += off_px.y();
    const LensShift shift(given, R, rectified);
    for (double x_px = 30; x_px < 720; x_px += 87) {
      for (double y_px = 30; y_px < 450; y_px += 91) {
        const Vector2d place = PlaneFromPixel(rectified, Vector2d(x_px, y_px));
        const Vector2d pixel = *is.Project(R * place.homogeneous());
        const Vector2d measured = (R.conjugate() * *given.Unproject(pixel)).hnormalized();
        const Vector2d found = measured - shift.ByCentre(measured) * off_px;
        EXPECT_LT(rectified.fx_px * (found - place).norm(), 0.01) << place.transpose();
      }
    }
  }
  EXPECT_TRUE(LensShift().ByCentre({0.1, 0.2}).isZero(0));
}

TEST(LensShift, OfAnIdealPinholeIsAScale) {
  const LensShift ideal;
  const Vector2d at(0.3, -0.2);
  EXPECT_EQ(ideal.ByFocalLength(at), at);
  EXPECT_LT((LensShift(Pinhole(), Eigen::Quaterniond::Identity(), Pinhole()).ByFocalLength(at) - at)
                .norm(),
            1e-9);
  // Outside the image, as a pinhole that is nearly one has it.
  EXPECT_LT((LensShift(Pinhole(), Eigen::Quaterniond::Identity(), Pinhole()).ByFocalLength({2, 2}) -
             Vector2d(2, 2))
                .norm(),
            1e-6);
}

}  // namespace
}  // namespace slcmap
