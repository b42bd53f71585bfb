// The rays of a camera's pixels, several a pixel, laid out to be traced in packets.
#pragma once

#include <vector>

#include "data/camera.h"
#include "data/simulator/ray_scene.h"

namespace slcmap {

// The image is cut into blocks of 4 x 4 pixels. The pixels of one colour of a block's chequerboard
// make up a packet; it is traced once for each of the kSamples rays of a pixel, each time at
// another instant of the exposure. Both colours have the same mean instant.
class CameraRays {
 public:
  static constexpr int kSamples = 4;
  static constexpr int kInstants = 2 * kSamples;  // equally long parts of the exposure
  static constexpr int kBlockColumns = 4, kBlockRows = 4;

  // Unit vectors in the camera frame; all zero where the camera has no ray.
  struct Packet {
    float x[RayScene::kLanes], y[RayScene::kLanes], z[RayScene::kLanes];
  };

  // The rays through the pixels' areas, jittered in strata, the same in each image.
  explicit CameraRays(const Camera& camera);

  int blocks_across() const { return across_; }
  int blocks_down() const { return down_; }
  const Packet& Of(int block, int colour, int sample) const {
    return packets_[(block * 2 + colour) * kSamples + sample];
  }
  float pixel_angle_rad() const { return pixel_angle_rad_; }  // near the axis

  static int Instant(int colour, int sample) { return 2 * sample + ((sample + colour) & 1); }
  // Of a lane, from the block's first.
  static int Row(int lane) { return lane >> 1; }
  static int Column(int lane, int colour) { return 2 * (lane & 1) + ((Row(lane) + colour) & 1); }

 private:
  int across_, down_;
  float pixel_angle_rad_;
  std::vector<Packet> packets_;
};

}  // namespace slcmap
