#include "mapping/planes/asked_planes.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/core.hpp>

#include "mapping/planes/plane_rays.h"

namespace slcmap {
namespace {

constexpr double kMeasured_m = 0.045;    // from a measured point, nothing is filled
constexpr double kMostMisfit = 20;       // of a patch for its neighbours: one does not outvote all
constexpr double kSure = 4;              // a best place that beats others by as much is one
constexpr double kLeastSolid = 0.9;      // share of a patch that no ray goes through
constexpr double kMostSaturated = 0.02;  // of a patch: lamps and panes show no surface
constexpr double kMostContrary = 40;     // misfit of a patch's own images on the plane

using Place = std::pair<int, int>;

// What a patch and those beside it say together.
std::vector<double> Pooled(const AskedPatch& asked,
                           const std::map<Place, const AskedPatch*>& by_place) {
  std::vector<double> pooled = asked.sweep.misfit;
  for (int i = 0; i < 9; ++i) {
    const auto found = by_place.find({asked.column + i % 3 - 1, asked.row + i / 3 - 1});
    if (i == 4 || found == by_place.end()) continue;
    const std::vector<double>& other = found->second->sweep.misfit;
    for (size_t k = 0; k < pooled.size(); ++k) pooled[k] += std::min(other[k], kMostMisfit);
  }
  return pooled;
}

bool Agrees(const AskedPatch& asked, const std::map<Place, const AskedPatch*>& by_place,
            const PlaneOptions& options) {
  if (asked.sweep.misfit.empty() || asked.sweep.saturated > kMostSaturated) return false;
  const SweptPlace own = BestPlace(asked.sweep.misfit, options);
  const SweptPlace pooled = BestPlace(Pooled(asked, by_place), options);
  return std::abs(pooled.offset_m) <= options.max_offset_m &&
         asked.sweep.misfit[asked.sweep.misfit.size() / 2] <= kMostContrary &&
         (std::abs(own.offset_m) <= options.max_offset_m || own.margin < kSure) &&
         asked.sweep.correlation[asked.sweep.correlation.size() / 2] >= options.min_correlation;
}

}  // namespace

int CellsOfPatch(const PlaneOptions& options) {
  return std::max(1, static_cast<int>(std::lround(options.patch_m / options.cell_m)));
}

AskedPlane AskPlane(SuggestedPlane suggested, const PointIndex& measured,
                    const std::vector<Sights>& sights, const PlaneOptions& options) {
  AskedPlane plane{std::move(suggested), {}, {}, {}};
  const PlaneGrid& grid = plane.suggested.grid;
  const cv::Mat1i passes = CountPasses(grid, sights, options);
  plane.solid = plane.suggested.near & (passes == 0);
  plane.open = plane.suggested.near.clone();
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      uint8_t& open = plane.open(row, column);
      if (open && (passes(row, column) > options.max_passes ||
                   measured.HasNear(grid.At(column + 0.5, row + 0.5), kMeasured_m))) {
        open = 0;
      }
    }
  }
  const int side = CellsOfPatch(options);
  for (int row = 0; (row + 1) * side <= grid.rows; ++row) {
    for (int column = 0; (column + 1) * side <= grid.columns; ++column) {
      const cv::Rect cells(column * side, row * side, side, side);
      if (cv::countNonZero(plane.open(cells)) < side ||
          cv::countNonZero(plane.solid(cells)) < kLeastSolid * side * side) {
        continue;
      }
      AskedPatch asked;
      asked.column = column;
      asked.row = row;
      asked.patch = {grid.At((column + 0.5) * side, (row + 0.5) * side), grid.normal, grid.u,
                     grid.v, side * grid.cell_m};
      plane.patches.push_back(std::move(asked));
    }
  }
  return plane;
}

void JudgePatches(const PlaneOptions& options, AskedPlane* plane) {
  std::map<Place, const AskedPatch*> by_place;
  for (const AskedPatch& asked : plane->patches) {
    if (!asked.sweep.misfit.empty()) by_place[{asked.column, asked.row}] = &asked;
  }
  int agreeing = 0;
  for (AskedPatch& asked : plane->patches) {
    asked.agrees = Agrees(asked, by_place, options);
    agreeing += asked.agrees;
  }
  if (agreeing >= options.min_patches &&
      agreeing >= options.min_plane_share * static_cast<double>(by_place.size())) {
    return;
  }
  for (AskedPatch& asked : plane->patches) asked.agrees = false;
}

}  // namespace slcmap
