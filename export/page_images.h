// Pictures of keyframes for a page.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "data/progress.h"
#include "data/source/sequence_source.h"
#include "mapping/map.h"

namespace slcmap {

// What the left camera saw at a keyframe, as the map's rectified camera would have.
struct PageImage {
  std::size_t keyframe = 0;  // its index in the map's
  std::string jpeg;
};

struct PageImageOptions {
  int most = 200;      // every n-th keyframe has a picture, so that there are at most as many
  int width_px = 400;  // at most; with `most` it keeps the pictures of a page below 8 MB
  int quality = 75;    // of JPEG, 1 to 100
  void Check() const;  // throws ConfigError
};

// The pictures of a map's keyframes out of the recording that it was made of; those of images that
// cannot be read are left out. Throws DataError where none can be, and StoppedError when progress
// says so.
std::vector<PageImage> ReadPageImages(const MapResult& map, const SequenceSource& recording,
                                      const PageImageOptions& options,
                                      const Progress& progress = {});

}  // namespace slcmap
