// The images of the views around one, kept while they are needed.
#pragma once

#include <map>
#include <vector>

#include "mapping/lines/line_sweep.h"
#include "mapping/views/view.h"

namespace slcmap {

// A view's images and their edges; those that could not be read are empty.
struct EdgeView {
  StereoImage images;
  cv::Mat edges[2];

  const cv::Mat& image(int camera) const { return camera == 0 ? images.left : images.right; }
};

class ViewWindow {
 public:
  // All must outlive the window.
  ViewWindow(const ViewImages& images, const Views& views, double min_gradient, int reach)
      : images_(images), views_(views), min_gradient_(min_gradient), reach_(reach) {}

  // Reads what is needed around a view and forgets the rest; views in rising order.
  void MoveTo(int view);

  const EdgeView& at(int view) const { return kept_.at(view); }
  int first() const { return kept_.begin()->first; }
  int last() const { return kept_.rbegin()->first; }

 private:
  const ViewImages& images_;
  const Views& views_;
  const double min_gradient_;
  const int reach_;  // views to either side
  std::map<int, EdgeView> kept_;
};

// The images that a segment of a view is looked for in: its own right one, and both of up to
// max_views others, those with different baselines first.
std::vector<SweepImage> ImagesAround(const ViewWindow& window, int view, const Views& all,
                                     const ViewCameras& cameras, const LineSweepOptions& options);

}  // namespace slcmap
