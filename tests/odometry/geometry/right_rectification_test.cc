#include <gtest/gtest.h>

#include "data/core/rigid_transform.h"
#include "odometry/frontend/rectifier.h"
#include "odometry/geometry/pinhole.h"
#include "tests/testing/example.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;

class RightRectificationTest : public ::testing::Test {
 protected:
  RightRectificationTest() {
    given_ = ExampleStereoRig();
    Camera& right = given_.cameras[1];
    right.distortion = Distortion::kEquidistant;
    right.coefficients << 0.003, 0.0007, -0.002, 0.0002;
    given_.cameras[0].distortion = right.distortion;
    given_.cameras[0].coefficients = right.coefficients;
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
