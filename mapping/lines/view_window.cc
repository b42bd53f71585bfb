#include "mapping/lines/view_window.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core/utility.hpp>

#include "mapping/lines/edge_directions.h"

namespace slcmap {

void ViewWindow::MoveTo(int view) {
  const int first = std::max(0, view - reach_);
  const int last = std::min(static_cast<int>(views_.size()) - 1, view + reach_);
  std::erase_if(kept_, [&](const auto& entry) { return entry.first < first; });
  std::vector<int> missing;
  for (int i = first; i <= last; ++i) {
    if (kept_.try_emplace(i).second) missing.push_back(i);
  }
  cv::parallel_for_({0, static_cast<int>(missing.size())}, [&](const cv::Range& range) {
    for (int i = range.start; i < range.end; ++i) {
      EdgeView& kept = kept_.at(missing[i]);
      kept.images = images_.Read(missing[i]);
      for (int camera : {0, 1}) {
        if (kept.image(camera).empty()) continue;
        kept.edges[camera] = EdgeDirections(kept.image(camera), min_gradient_);
      }
    }
  });
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
