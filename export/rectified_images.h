// Images of a recording as a map's rectified cameras would have taken them.
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "data/progress.h"
#include "export/colmap_options.h"
#include "export/model_images.h"

namespace slcmap {

// Of each pixel of a rectified image of a camera (0 left, 1 right), the raw camera's (CV_32FC2);
// beyond the image where there is none. The origin of pixels is the centre of the first.
cv::Mat RectifyingMap(const Rig& rectified, const Rig& raw, int camera);

// The index of the recording's image at a stamp, which may be rounded to a thousandth of a second;
// its size where there is none.
std::size_t ImageAt(const std::vector<int64_t>& stamps_ns, int64_t stamp_ns);

// Writes the images of the model under their names into a folder, out of the recordings that the
// map was made of, and returns their paths; those that cannot be read are left out, with a warning
// that counts them. Throws DataError where a recording is missing or holds none of its images.
std::vector<std::string> WriteRectifiedImages(const std::string& folder, const MapResult& map,
                                              const std::vector<ModelImage>& images,
                                              const ColmapOptions& options,
                                              const Progress& progress);

}  // namespace slcmap
