// A renderer for tests that has nothing in common with the real one: a bare room around the motion,
// its walls covered with smooth noise, seen through the rig's cameras with no blur and no noise.
#pragma once

#include <Eigen/Geometry>

#include "data/simulator/sequence_writer.h"
#include "tests/testing/example.h"
#include "tests/testing/pinhole_camera.h"

namespace slcmap {

// The example rig with images so small that tests are quick.
inline Rig SmallRig() {
  Rig rig = ExampleStereoRig();
  rig.cameras.assign(2, testing::PinholeCamera(300, 192, 174, 149.5, 95.5));
  return rig;
}

class BoxRoomRenderer : public PairRenderer {
 public:
  // The walls are wall_distance_m from the motion's outermost positions. With a panel_m, panels of
  // this size are in turn bright and dark, which gives straight edges along the walls.
  BoxRoomRenderer(const RenderTask& task, double wall_distance_m, double panel_m = 0);

  const Eigen::AlignedBox3d& room() const { return room_; }  // in world, metres

  RenderedPair Render(int frame, bool with_depth) override;
  void WriteTruth(const std::string& folder, int frames) override;

 private:
  uchar Grey(const Eigen::Vector3d& p_world, double pixel_m) const;
  void Paint(int camera, int frame, cv::Mat* image, cv::Mat* depth_m) const;

  RenderTask task_;
  double panel_m_;
  Eigen::AlignedBox3d room_;
  std::vector<std::vector<Eigen::Vector3f>> rays_camera_;  // of each pixel's centre, by camera
};

}  // namespace slcmap
