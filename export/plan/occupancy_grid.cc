#include <spdlog/fmt/fmt.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "data/core/error.h"
#include "data/io/file.h"
#include "export/scene/formats.h"
#include "export/scene/georeference_note.h"

namespace slcmap::inline exporting {
namespace {

using Eigen::Vector2i;

constexpr char kGridOccupied = 0, kGridFree = static_cast<char>(254),
               kGridUnknown = static_cast<char>(205);
constexpr int64_t kMostCells = 200'000'000;

// Voxels as cells of the smallest size: from `low` to `high`, without that.
struct CellBox {
  Vector2i low, high;
};

// Of the voxels that reach into the band.
std::vector<CellBox> BoxesInBand(const std::vector<Voxel>& voxels, double resolution_m,
                                 double low_m, double high_m) {
  std::vector<CellBox> boxes;
  for (const Voxel& voxel : voxels) {
    const double half_m = 0.5 * voxel.size_m, z_m = voxel.centre_world.z();
    if (z_m + half_m <= low_m || z_m - half_m >= high_m) continue;
    const auto cell = [&](double sign) -> Vector2i {
      return ((voxel.centre_world.head<2>().array() + sign * half_m) / resolution_m)
          .round()
          .cast<int>();
    };
    boxes.push_back({cell(-1), cell(1)});
  }
  return boxes;
}

// Cells from `low` on, by rows from the lowest y.
class Grid {
 public:
  explicit Grid(const Eigen::AlignedBox2i& box) : low_(box.min()), size_(box.sizes()) {
    const int64_t cells = static_cast<int64_t>(size_.x()) * size_.y();
    if (cells > kMostCells) {
      throw DataError(fmt::format(
          "grid: found a map of {} by {} cells, expected at most {} of them: map with a coarser "
          "mapping.occupancy.resolution_m, or leave the grid out by --format",
          size_.x(), size_.y(), kMostCells));
    }
    cells_.assign(static_cast<std::size_t>(cells), kGridUnknown);
  }

  void Fill(const CellBox& box, char value) {
    for (int y = box.low.y(); y < box.high.y(); ++y) {
      const auto row = cells_.begin() + static_cast<int64_t>(y - low_.y()) * size_.x() - low_.x();
      std::fill(row + box.low.x(), row + box.high.x(), value);
    }
  }

  // Binary PGM, whose first row is the uppermost.
  std::string Pgm() const {
    std::string text = fmt::format("P5\n# slcmap\n{} {}\n255\n", size_.x(), size_.y());
    for (int y = size_.y() - 1; y >= 0; --y) {
      text.append(cells_, static_cast<std::size_t>(y) * static_cast<std::size_t>(size_.x()),
                  static_cast<std::size_t>(size_.x()));
    }
    return text;
  }

  // The origin is the lower left corner of the lower left cell. `note` is a comment, "" for none.
  std::string Yaml(const std::string& image, double resolution_m, const std::string& note) const {
    return fmt::format(
        "{}image: {}\nmode: trinary\nresolution: {:.6f}\norigin: [{:.6f}, {:.6f}, 0.0]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.196\n",
        note.empty() ? "" : "# " + note + "\n", image, resolution_m, resolution_m * low_.x(),
        resolution_m * low_.y());
  }

 private:
  Vector2i low_, size_;
  std::string cells_;
};

// One grid has a cell, as readers refuse images without.
Grid MakeGrid(const std::vector<CellBox>& free, const std::vector<CellBox>& occupied) {
  Eigen::AlignedBox2i box;
  for (const auto* boxes : {&free, &occupied}) {
    for (const CellBox& cells : *boxes) box.extend(cells.low).extend(cells.high);
  }
  if (box.isEmpty()) box = {Vector2i(0, 0), Vector2i(1, 1)};
  Grid grid(box);
  for (const CellBox& cells : free) grid.Fill(cells, kGridFree);
  for (const CellBox& cells : occupied) grid.Fill(cells, kGridOccupied);
  return grid;
}

// Names and floors of the grids.
std::vector<std::pair<std::string, double>> ListFloors(const MapResult& map,
                                                       const std::vector<Voxel>& free,
                                                       const std::vector<Voxel>& occupied) {
  std::vector<std::pair<std::string, double>> floors;
  for (const Storey& storey : map.building.storeys) {
    floors.emplace_back(fmt::format("storey_{}", storey.id), storey.floor_m);
  }
  if (!floors.empty()) return floors;
  double least_m = std::numeric_limits<double>::infinity();
  for (const auto* voxels : {&free, &occupied}) {
    for (const Voxel& voxel : *voxels) {
      least_m = std::min(least_m, voxel.centre_world.z() - 0.5 * voxel.size_m);
    }
  }
  return {{"no_storey", std::isfinite(least_m) ? least_m : 0}};
}

}  // namespace

std::vector<std::string> WriteGrids(const GridOptions& options, const std::string& folder,
                                    const MapResult& map, const Progress&) {
  const double resolution_m = map.occupancy.resolution_m();
  const std::vector<Voxel> free = map.occupancy.FreeVoxels();
  const std::vector<Voxel> occupied = map.occupancy.OccupiedVoxels();
  MakeFolder(folder + "/grid");
  std::vector<std::string> paths;
  for (const auto& [name, floor_m] : ListFloors(map, free, occupied)) {
    const double low_m = floor_m + options.low_m, high_m = floor_m + options.high_m;
    const Grid grid = MakeGrid(BoxesInBand(free, resolution_m, low_m, high_m),
                               BoxesInBand(occupied, resolution_m, low_m, high_m));
    const std::string path = folder + "/grid/" + name;
    WriteFile(path + ".pgm", grid.Pgm());
    WriteFile(path + ".yaml",
              grid.Yaml(name + ".pgm", resolution_m, GeoreferenceNote(map.source.georeference)));
    paths.push_back(path + ".pgm");
    paths.push_back(path + ".yaml");
  }
  return paths;
}

}  // namespace slcmap::exporting
