// The keyframes' images as photos of a building's faces: where they were taken, how fast the camera
// moved, and what stands before the faces.
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "data/core/progress.h"
#include "export/sfm/recorded_images.h"
#include "mapping/map/map.h"

namespace slcmap::inline exporting {

// What the left camera saw at a keyframe.
struct Photo {
  int64_t stamp_ns = 0;
  std::size_t recording = 0;
  RigidTransform T_camera_world;  // of the rectified camera
  double speed_m_s = 0, turn_rad_s = 0;
  // Of the nearest surface along z of the rectified camera, coarse (CV_32FC1, metres).
  cv::Mat depth_m;

  Eigen::Vector3d Centre() const { return T_camera_world.Inverse().translation; }
};

// Of all keyframes that are of a recording. The depth is that of the walls, floors and ceilings of
// the building, of what is dense and before them. Throws StoppedError when progress says so.
std::vector<Photo> TakePhotos(const MapResult& map, const RecordedImages& images,
                              const Progress& progress);

// How far before a plane that is which a photo shows at a pixel of its rectified camera, in metres.
// Where it shows nothing that is known, far behind.
double HeightBefore(const BuildingPlane& plane, const Photo& photo, const Camera& rectified,
                    const Eigen::Vector2d& pixel_px);

}  // namespace slcmap::exporting
