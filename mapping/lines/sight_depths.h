// What surfaces hide from the views.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "data/progress.h"
#include "mapping/dense/dense_point.h"
#include "mapping/lines/view_cameras.h"

namespace slcmap {

// The depth of the nearest surface, where one is known, in coarse images of all views.
class SightDepths {
 public:
  SightDepths() = default;  // hides nothing

  // Each point of the cloud is a piece of surface of `size_m`. The same points give the same
  // depths, whatever the number of threads. Once progress says so, nothing is hidden from later
  // views.
  SightDepths(const std::vector<DensePoint>& cloud, double size_m, const ViewCameras& views,
              const Progress& progress = {});

  // Whether a surface is clearly nearer than depth_m at a pixel of a view's camera (0 left, 1
  // right). What is not known hides nothing.
  bool Hides(int view, int camera, const Eigen::Vector2d& px, double depth_m) const;

  // The same of a place on a surface, in the frame of that camera, whose model is given: what lies
  // on the surface itself does not hide it, however slantingly it is seen.
  bool HidesSurface(int view, int camera, const Camera& model, const Eigen::Vector3d& p_camera,
                    const Eigen::Vector3d& normal_camera) const;

 private:
  using DepthImage = std::vector<float>;  // cell by cell; infinite: not known; or empty

  void Render(const std::vector<DensePoint>& cloud, double size_m, const Camera& camera,
              const RigidTransform& T_camera_world, DepthImage* image) const;

  double size_m_ = 0;
  int columns_ = 0, rows_ = 0;
  std::vector<std::array<DepthImage, 2>> images_;  // by view and camera
};

}  // namespace slcmap
