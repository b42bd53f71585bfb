#include "mapping/dense/dense_map.h"

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
  while (!window.is_done()) {
    const double share = static_cast<double>(window.read()) / static_cast<double>(selected.size());
    if (!progress.Report(share)) break;
    for (const DepthWindow::ConfirmedView& confirmed : window.Next()) {
      fusion.Add(WorldFromCamera(views[confirmed.view], rig), rig.cameras[0], confirmed.depth);
      if (sink) sink(confirmed.view, confirmed.depth);
    }
  }
  DenseMap map;
  map.points = fusion.Points();
  map.views = static_cast<int64_t>(window.read());
  map.views_without_images = window.without_images();
  return map;
}

}  // namespace slcmap
