// A map as a model of COLMAP's: its images as they are numbered, its points with their tracks, and
// images as the rectified cameras would have taken them.
#pragma once

#include <cstdint>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "data/core/progress.h"
#include "data/source/sequence_source.h"
#include "export/scene/options.h"
#include "mapping/map/map.h"

namespace slcmap::inline exporting {

// May be asked by several threads.
class RecordedImages {
 public:
  // Opens them. Throws DataError where one is missing, ConfigError where a merged map is to be read
  // elsewhere than it says.
  RecordedImages(const MapResult& map, const RecordingOptions& options);

  std::size_t size() const { return recordings_.size(); }

  // Which recording an image of the map is of; size() where it is of none.
  std::size_t FindRecordingAt(int64_t stamp_ns) const;

  // The cameras as they are.
  const Rig& rig(std::size_t recording) const { return recordings_[recording].source->info().rig; }

  // An image as it was taken, by the map's stamp; empty where there is none or it cannot be read.
  cv::Mat Read(std::size_t recording, int64_t stamp_ns, int camera) const;

  // Throws DataError: so many images were looked for, and none can be read.
  [[noreturn]] void Refuse(std::size_t recording, std::size_t count) const;

 private:
  struct Recording {
    std::string path;
    std::unique_ptr<SequenceSource> source;
    int64_t stamps_moved_ns = 0;
    std::optional<StampSpan> poses_ns;  // when its poses are; none: all
  };
  std::vector<Recording> recordings_;
};

// Of each pixel of a rectified image of a camera, the raw camera's (CV_32FC2);
// beyond the image where there is none. The origin of pixels is the centre of the first.
cv::Mat RectifyingMap(const Rig& rectified, const Rig& raw, int camera);

// The index of the recording's image at a stamp, which may be rounded to a thousandth of a second;
// its size where there is none.
std::size_t ImageAt(const std::vector<int64_t>& stamps_ns, int64_t stamp_ns);

// A map as a model of COLMAP's: its images as they are numbered, its points with their tracks, and
// images as the rectified cameras would have taken them.

struct ModelImage {
  int id = 0;  // from 1
  int64_t stamp_ns = 0;
  int camera = 0;  // of the rig
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

// The points of a map with their tracks, as COLMAP's model has them.

// A point in an image of the model, by its place there.
struct ModelObservation {
  std::size_t image = 0;  // its place among the model's images
  Eigen::Vector2d px = Eigen::Vector2d::Zero();
};

struct ModelPoint {
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();
  double error_px = -1;  // mean distance of its sights from its projections; -1 without any
  std::vector<ModelObservation> track;
};

// A point for each track of each of the map's points, put where the model's images and poses see it
// best: points that the map has fused of several features are beside all of them. Sights that are
// then more than 4 px off are left out, and tracks of which less than two images are left. A point
// without tracks comes as it is, and is seen by none.
std::vector<ModelPoint> ModelPoints(const MapResult& map, const std::vector<ModelImage>& images);

// Writes the images of the model under their names into a folder, out of the recordings that the
// map was made of, as the map's rectified cameras would have taken them, and returns their paths;
// those that cannot be read are left out, with a warning that counts them. Throws DataError where a
// recording is missing or holds none of its images.
std::vector<std::string> WriteRectifiedImages(const std::string& folder, const MapResult& map,
                                              const std::vector<ModelImage>& images,
                                              const RecordingOptions& options,
                                              const Progress& progress);

}  // namespace slcmap::exporting
