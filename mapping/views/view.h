// The stereo pairs that mapping looks at again, with their poses and cameras; and images of a
// recording that are not there, or cannot be read.
#pragma once

#include <array>
#include <cstdint>
#include <mutex>
#include <opencv2/core/mat.hpp>
#include <set>
#include <string>
#include <vector>

#include "data/core/types.h"

namespace slcmap::inline mapping {

struct View {
  int64_t stamp_ns = 0;  // on the camera's clock
  int segment = 0;       // of the run: between segments poses may jump
  // Of the body that the rig's T_imu_camera refers to.
  RigidTransform T_world_imu;
  int left_camera = 0;  // of the rig: that of the pair, whose right one is the next
};

// By stamp; those of a further pair of cameras come behind those of the one before.
using Views = std::vector<View>;

// The images of views, rectified: both of one ideal pinhole, a point has the same row in both.
class ViewImages {
 public:
  virtual ~ViewImages() = default;

  // The rig that the rectified images belong to; all cameras have the same intrinsics.
  virtual const Rig& rig() const = 0;

  // 255 where the rectified image of a camera of the rig has true pixels, else 0.
  virtual const cv::Mat& mask(int camera) const = 0;

  // The left camera of the view with that index, and the mask of its left (0) or right image.
  virtual int left_camera(size_t) const { return 0; }
  const cv::Mat& mask_of(size_t view, int camera) const { return mask(left_camera(view) + camera); }

  // The pair of the view with that index. An image that cannot be read is empty. May be called from
  // several threads.
  virtual StereoImage Read(size_t view) const = 0;
};

// camera: 0 left, 1 right.
inline RigidTransform WorldFromCamera(const View& view, const Rig& rig, int camera = 0) {
  return view.T_world_imu * rig.T_imu_camera[view.left_camera + camera];
}

// From the left to the right camera of a pair.
inline RigidTransform RightFromLeft(const Rig& rig, int left_camera) {
  return rig.T_imu_camera[left_camera + 1].Inverse() * rig.T_imu_camera[left_camera];
}

// Where the rectified cameras of all views are.

struct ViewCameras {
  std::array<Camera, 2> cameras;
  std::vector<std::array<RigidTransform, 2>> T_camera_world;  // by view, left and right
  cv::Mat left_mask;  // as ViewImages has it; empty: the whole image is true

  ViewCameras(const Views& views, const Rig& rig) : cameras{rig.cameras[0], rig.cameras[1]} {
    for (const View& view : views) {
      T_camera_world.push_back(
          {WorldFromCamera(view, rig, 0).Inverse(), WorldFromCamera(view, rig, 1).Inverse()});
    }
  }

  Eigen::Vector3d Centre(int view, int camera = 0) const {
    return T_camera_world[view][camera].Inverse().translation;
  }
};

// Images of a recording that are not there, or cannot be read.

// Each file once, however often it is asked for. Files may be added from several threads.
class LostImages {
 public:
  void Add(const std::string& path) {
    const std::lock_guard lock(mutex_);
    paths_.insert(path);
  }

  std::set<std::string> paths() const {
    const std::lock_guard lock(mutex_);
    return paths_;
  }

 private:
  mutable std::mutex mutex_;
  std::set<std::string> paths_;
};

}  // namespace slcmap::mapping
