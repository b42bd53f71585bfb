// The stereo pairs that mapping looks at again, with their poses.
#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "data/types.h"

namespace slcmap {

struct View {
  int64_t stamp_ns = 0;  // on the camera's clock
  int segment = 0;       // of the run: between segments poses may jump
  // Of the body that the rig's T_imu_camera refers to.
  RigidTransform T_world_imu;
};

using Views = std::vector<View>;  // by stamp

// The images of views, rectified: both of one ideal pinhole, a point has the same row in both.
class ViewImages {
 public:
  virtual ~ViewImages() = default;

  // The rig that the rectified images belong to.
  virtual const Rig& rig() const = 0;

  // 255 where the rectified image of a camera (0 left, 1 right) has true pixels, else 0.
  virtual const cv::Mat& mask(int camera) const = 0;

  // The pair of the view with that index. An image that cannot be read is empty. May be called from
  // several threads.
  virtual StereoImage Read(size_t view) const = 0;
};

inline RigidTransform WorldFromCamera(const View& view, const Rig& rig, int camera = 0) {
  return view.T_world_imu * rig.T_imu_camera[camera];
}

}  // namespace slcmap
