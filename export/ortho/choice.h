// Which photos a face is made of, and which of them each place of it.
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "export/ortho/face.h"
#include "export/ortho/photos.h"

namespace slcmap::inline exporting {

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
