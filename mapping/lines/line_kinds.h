// What a line is of, lines by where they are, and those that are one of many beside each other.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "data/io/map_line.h"
#include "mapping/lines/line_store.h"
#include "mapping/lines/options.h"

namespace slcmap::inline mapping {

// Lines by the cells of half a metre that their intervals pass.
class LineCells {
 public:
  // The lines must outlive it.
  explicit LineCells(const std::vector<TrackedLine>& lines) : lines_(lines) {}

  void Add(int line);

  // Those of the added lines that pass a line's cells or their neighbours: all that are up to half
  // a metre from it. In order, each once.
  std::vector<int> Near(int line) const;

 private:
  std::vector<Eigen::Vector3i> FindCells(int line) const;

  const std::vector<TrackedLine>& lines_;
  std::unordered_map<int64_t, std::vector<int>> members_;  // by the key of a cell
};

// By the surfaces beside it: an edge where they end or bend. What is on a flat surface is the
// outline of a thing on it if its step of brightness is large against how bright it is, and lasts
// unless it is larger still, as of narrow trims; else a mark: beside grain, joints and print the
// image is soon as bright as on the other side. A step that only grows away from the line is none
// of an edge, but of a shadow. What hardly stands out among many lines beside each other is a mark,
// where surfaces are known. Where the surfaces are not known, a line whose step lasts is of
// unknown kind.
LineKind FindKind(const TrackedLine& line);

// Counts, for each line, those that run beside it in one plane with it, as the joints of a brick
// wall do: within reach_m (half a metre at most), parallel, each at its own distance; the plane is
// the one that has most of them, give or take 3 cm. The median over places every 10 to 20 cm, as
// TrackedLine::parallels.
void CountParallels(double reach_m, std::vector<TrackedLine>* lines);

}  // namespace slcmap::mapping
