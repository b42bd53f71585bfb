#include "mapping/dense/dense_map.h"

#include <future>
#include <utility>

#include "mapping/dense/depth_fusion.h"
#include "mapping/dense/depth_window.h"

namespace slcmap {

DenseMap BuildDense(const Views& views, const ViewImages& images, const DenseOptions& options,
                    const Progress& progress, const DepthSink& sink) {
  options.Check();
  const std::vector<std::size_t> selected = SelectDenseViews(views, options);
  const Rig& rig = images.rig();
  DepthWindow window(views, selected, images, options);
  DepthFusion fusion(options);
  const auto fuse = [&](const std::vector<DepthWindow::ConfirmedView>& confirmed) {
    for (const auto& [view, depth] : confirmed) {
      fusion.Add(WorldFromCamera(views[view], rig), rig.cameras[0], depth);
      if (sink) sink(view, depth);
    }
  };
  // Views are fused in their order, on a thread of their own while the next are read and matched.
  const auto policy = options.threads > 1 ? std::launch::async : std::launch::deferred;
  std::future<void> fused;
  while (!window.is_done()) {
    const double share = static_cast<double>(window.read()) / static_cast<double>(selected.size());
    if (!progress.Report(share)) break;
    std::vector<DepthWindow::ConfirmedView> confirmed = window.Next();
    if (fused.valid()) fused.get();
    fused = std::async(policy, fuse, std::move(confirmed));
  }
  if (fused.valid()) fused.get();
  DenseMap map;
  map.points = fusion.Points();
  map.views = static_cast<int64_t>(window.read());
  map.views_without_images = window.without_images();
  return map;
}

}  // namespace slcmap
