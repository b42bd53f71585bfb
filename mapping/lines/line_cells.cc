#include "mapping/lines/line_cells.h"

#include <algorithm>
#include <cmath>

namespace slcmap {
namespace {

constexpr double kCell_m = 0.5;

}  // namespace

void LineCells::Add(int line) {
  for (const Cell& cell : CellsOf(line)) members_[cell].push_back(line);
}

size_t LineCells::CellHash::operator()(const Cell& cell) const {
  uint64_t hash = 0;
  for (const int64_t at : cell) {
    hash = (hash ^ static_cast<uint64_t>(at)) * 0x9e3779b97f4a7c15;  // Knuth's golden ratio
    hash ^= hash >> 32;
  }
  return hash;
}

std::vector<int> LineCells::Near(int line) const {
  std::vector<int> near;
  for (const Cell& cell : CellsAround(line)) {
    const auto found = members_.find(cell);
    if (found == members_.end()) continue;
    near.insert(near.end(), found->second.begin(), found->second.end());
  }
  std::sort(near.begin(), near.end());
  near.erase(std::unique(near.begin(), near.end()), near.end());
  return near;
}

std::vector<LineCells::Cell> LineCells::CellsAround(int line) const {
  std::vector<Cell> around;
  for (const Cell& cell : CellsOf(line)) {
    for (int64_t dx = -1; dx <= 1; ++dx) {
      for (int64_t dy = -1; dy <= 1; ++dy) {
        for (int64_t dz = -1; dz <= 1; ++dz) {
          around.push_back({cell[0] + dx, cell[1] + dy, cell[2] + dz});
        }
      }
    }
  }
  std::sort(around.begin(), around.end());
  around.erase(std::unique(around.begin(), around.end()), around.end());
  return around;
}

std::vector<LineCells::Cell> LineCells::CellsOf(int index) const {
  const TrackedLine& line = lines_[index];
  std::vector<Cell> cells;
  for (const Stretch& interval : line.intervals) {
    for (double along_m = interval.from_m;; along_m += kCell_m) {
      const Eigen::Vector3d p =
          line.line.point_world + std::min(along_m, interval.to_m) * line.line.direction_world;
      const auto of = [](double x) { return static_cast<int64_t>(std::floor(x / kCell_m)); };
      const Cell cell{of(p.x()), of(p.y()), of(p.z())};
      if (cells.empty() || cells.back() != cell) cells.push_back(cell);
      if (along_m >= interval.to_m) break;
    }
  }
  return cells;
}

}  // namespace slcmap
