// The images of a map as COLMAP's model numbers them, which others refer to.
#pragma once

#include <string>
#include <vector>

#include "mapping/map.h"

namespace slcmap {

struct ModelImage {
  int id = 0;  // from 1
  int64_t stamp_ns = 0;
  int camera = 0;  // 0 left, 1 right
  RigidTransform T_camera_world;
  // As recordings in EuRoC's layout have it, cam0/data/STAMP.png with the number of the camera that
  // was used; in a merged map with the stamp of
  // the recording, in a folder of the run.
  std::string name;
};

// Both images of each keyframe, and of each other image with a pose in which lines were seen, by
// stamp; without those of cameras that are not calibrated.
std::vector<ModelImage> ModelImages(const MapResult& map);

bool IsCalibrated(const Camera& camera);

// Formats of others have the origin of pixels at the corner of the first, not at its centre.
inline constexpr double kCornerOrigin_px = 0.5;

}  // namespace slcmap
