#include "mapping/planes/plane_rays.h"

#include <algorithm>
#include <cmath>

namespace slcmap {
namespace {

constexpr double kSigmas = 3;

}  // namespace

cv::Mat1i CountPasses(const PlaneGrid& grid, const std::vector<Sights>& sights,
                      const PlaneOptions& options) {
  cv::Mat1i passes = cv::Mat1i::zeros(grid.rows, grid.columns);
  for (const Sights& view : sights) {
    const double before_m = grid.DistanceTo(view.p_world_camera);
    if (before_m == 0) continue;
    for (size_t i = 0; i < view.p_world.size(); ++i) {
      const Eigen::Vector3d end = view.p_world[i].cast<double>();
      const double after_m = grid.DistanceTo(end);
      if (before_m * after_m >= 0) continue;
      if (std::abs(after_m) <= std::max<double>(options.behind_m, kSigmas * view.sigma_m[i])) {
        continue;
      }
      const Eigen::Vector3d at =
          view.p_world_camera + before_m / (before_m - after_m) * (end - view.p_world_camera);
      const int column = grid.ColumnOf(at), row = grid.RowOf(at);
      if (grid.Contains(column, row)) ++passes(row, column);
    }
  }
  return passes;
}

}  // namespace slcmap
