// The keyframes' images as photos of a building's faces: where they were taken, how fast the camera
// moved, what stands before the faces, and which photos a face is made of.
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "data/core/progress.h"
#include "export/ortho/face.h"
#include "export/sfm/model.h"
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

// Which photos a face is made of, and which of them each place of it.

// A face in cells, as an image has pixels.
struct FaceCells {
  int step_px = 0;  // pixels of the face to a cell
  cv::Size size;
};

// A photo that a face is made of.
struct ChosenPhoto {
  std::size_t photo = 0;  // index
  // How well it sees each cell (CV_32FC1, 0 to 1): from near, straight on, at rest. 0 where it does
  // not see it.
  cv::Mat quality;
};

struct PhotoChoice {
  FaceCells cells;
  std::vector<ChosenPhoto> photos;
  cv::Mat labels;  // CV_32SC1, by cell: an index of photos, -1 of what none saw
};

// As few photos as show all of the face about as well as all photos would.
PhotoChoice ChoosePhotos(const OrthoFace& face, const std::vector<Photo>& photos,
                         const Camera& rectified);

}  // namespace slcmap::exporting
