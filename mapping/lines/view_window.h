// The images of the views around one, kept while they are needed.
#pragma once

#include <map>
#include <vector>

#include "mapping/lines/line_sweep.h"
#include "mapping/read_ahead.h"
#include "mapping/views/view.h"
#include "odometry/frontend/options.h"

namespace slcmap {

// A view's images, their edges, and the segments of its left one; of images that could not be read
// they are empty.
struct EdgeView {
  StereoImage images;
  cv::Mat edges[2];
  std::vector<LineSegment> segments;  // px

  const cv::Mat& image(int camera) const { return camera == 0 ? images.left : images.right; }
};

class ViewWindow {
 public:
  // Views to either side that are kept. `images` must outlive the window.
  ViewWindow(const ViewImages& images, size_t views, double min_gradient,
             const LineDetectorOptions& detector, int reach);

  // Reads what is needed around a view and forgets the rest; from the first view on, one by one.
  void MoveTo(int view);

  const EdgeView& at(int view) const { return kept_.at(view); }
  int first() const { return kept_.begin()->first; }
  int last() const { return kept_.rbegin()->first; }

 private:
  const int reach_;
  ReadAhead<EdgeView> coming_;
  std::map<int, EdgeView> kept_;
};

// The images that a segment of a view is looked for in: its own right one, and both of up to
// max_views others, those with different baselines first.
std::vector<SweepImage> ImagesAround(const ViewWindow& window, int view, const Views& all,
                                     const ViewCameras& cameras, const LineSweepOptions& options);

}  // namespace slcmap
