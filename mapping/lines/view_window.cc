#include "mapping/lines/view_window.h"

#include <algorithm>
#include <cmath>

#include "mapping/lines/edge_directions.h"
#include "odometry/frontend/line_detector.h"

namespace slcmap {

namespace {

EdgeView ReadEdges(const ViewImages& images, size_t view, double min_gradient,
                   const LineDetectorOptions& detector) {
  EdgeView read;
  read.images = images.Read(view);
  for (const int camera : {0, 1}) {
    if (read.image(camera).empty()) continue;
    read.edges[camera] = EdgeDirections(read.image(camera), min_gradient);
  }
  if (!read.images.left.empty()) {
    read.segments = DetectSegments(read.images.left, images.mask(0), detector);
  }
  return read;
}

}  // namespace

ViewWindow::ViewWindow(const ViewImages& images, size_t views, double min_gradient,
                       const LineDetectorOptions& detector, int reach)
    : reach_(reach), coming_(views, [&images, min_gradient, detector](size_t view) {
        return ReadEdges(images, view, min_gradient, detector);
      }) {}

void ViewWindow::MoveTo(int view) {
  std::erase_if(kept_, [&](const auto& entry) { return entry.first < view - reach_; });
  int next = kept_.empty() ? 0 : last() + 1;
  for (; next <= view + reach_ && !coming_.is_done(); ++next) kept_[next] = coming_.Next();
}

std::vector<SweepImage> ImagesAround(const ViewWindow& window, int view, const Views& all,
                                     const ViewCameras& cameras, const LineSweepOptions& options) {
  // By how far the baseline is from those taken already, relative to it.
  std::vector<std::pair<double, int>> others;  // baseline and view
  for (int other = window.first(); other <= window.last(); ++other) {
    if (other == view || all[other].segment != all[view].segment) continue;
    const double baseline_m = (cameras.Centre(other) - cameras.Centre(view)).norm();
    const double turn_rad = cameras.T_camera_world[other][0].rotation.angularDistance(
        cameras.T_camera_world[view][0].rotation);
    if (baseline_m < options.min_baseline_m || baseline_m > options.max_baseline_m) continue;
    if (turn_rad < options.max_turn_rad) others.push_back({baseline_m, other});
  }
  std::sort(others.begin(), others.end());
  std::vector<SweepImage> images;
  const auto add = [&](int v, int camera) {
    const cv::Mat& edges = window.at(v).edges[camera];
    if (!edges.empty()) images.push_back({v, camera, edges});
  };
  add(view, 1);
  const int count = std::min(options.max_views, static_cast<int>(others.size()));
  for (int i = 0; i < count; ++i) {  // spread evenly over the baselines
    const size_t k = count == 1 ? 0 : i * (others.size() - 1) / (count - 1);
    add(others[k].second, 0);
    add(others[k].second, 1);
  }
  return images;
}

}  // namespace slcmap
