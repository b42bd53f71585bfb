// The images of the recordings that a map was made of, and how its rectified cameras would have
// taken them.
#pragma once

#include <cstdint>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

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

}  // namespace slcmap::exporting
