#include "odometry/geometry/right_rectification.h"

#include <algorithm>
#include <cmath>

#include "data/rigid_transform.h"
#include "odometry/geometry/pinhole.h"

namespace slcmap {

using Eigen::Vector2d;

Vector2d RightRectification::GivenPlane(const Vector2d& px) const {
  const Vector2d turned_back =
      (ExpRotation(-correction_.rotation_rad) * PlaneFromPixel(camera_, px).homogeneous())
          .hnormalized();
  // See lens_shift.h: m - H(m) d is this.
  const Vector2d near = turned_back + lens_.ByCentre(turned_back) * correction_.centre_px;
  return turned_back + lens_.ByCentre(near) * correction_.centre_px;
}

double RightRectification::RowsOff_px(const RightCorrection& is) const {
  const Eigen::Quaterniond R_rectified_is = ExpRotation(is.rotation_rad);
  double off_px = 0;
  for (const auto& [x, y] : {std::pair{0.5, 0.5}, {0.1, 0.1}, {0.9, 0.1}, {0.1, 0.9}, {0.9, 0.9}}) {
    const Vector2d px(x * camera_.width_px, y * camera_.height_px);
    const Vector2d given = GivenPlane(px);
    const Vector2d through_lens = given - lens_.ByCentre(given) * is.centre_px;
    const Vector2d turned = (R_rectified_is * through_lens.homogeneous()).hnormalized();
    off_px = std::max(off_px, std::abs(PixelFromPlane(camera_, turned).y() - px.y()));
  }
  return off_px;
}

}  // namespace slcmap
