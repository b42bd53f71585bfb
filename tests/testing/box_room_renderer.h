// A renderer for tests that has nothing in common with the real one: a bare room around the motion,
// its walls covered with smooth noise, seen through the rig's cameras with no blur and no noise.
#pragma once

#include <Eigen/Geometry>

#include "data/simulator/pair_renderer.h"

namespace slcmap {

class BoxRoomRenderer : public PairRenderer {
 public:
  // The walls are wall_distance_m from the motion's outermost positions.
  BoxRoomRenderer(const RenderTask& task, double wall_distance_m);

  RenderedPair Render(int frame, bool with_depth) override;
  void WriteTruth(const std::string& folder, int frames) override;

 private:
  void Paint(int camera, int frame, cv::Mat* image, cv::Mat* depth_m) const;

  RenderTask task_;
  Eigen::AlignedBox3d room_;
  std::vector<std::vector<Eigen::Vector3f>> rays_camera_;  // of each pixel's centre, by camera
};

}  // namespace slcmap
