// How probably a line is an edge, lines by where they are, and those that are one of many beside
// each other.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <unordered_map>
#include <vector>

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

inline constexpr int kLineVotes = 17;

// What speaks for a line being an edge, and against it: whether surfaces of the cloud beside it are
// one plane (SurfacesBeside), the step of brightness across it and how far from it that lasts, how
// many lines run beside it and whether it is the top of a skirting (CountParallels), and how well
// it is known. The first is 1.
std::array<double, kLineVotes> CountVotes(const TrackedLine& line);

// That a line is an edge, where surfaces meet or one ends, rather than a mark on a surface: grain,
// a joint, print, a shadow. From the votes, as logistic regression weighs them.
double ComputeEdgeProbability(const TrackedLine& line);

// Counts, for each line, those that run beside it in one plane with it, as the joints of a brick
// wall do: within reach_m (half a metre at most), parallel, each at its own distance; the plane is
// the one that has most of them, give or take 3 cm. The median over places every 10 to 20 cm, as
// TrackedLine::parallels. Of level lines also how much of a crease is 3 to 16 cm beneath them, as
// TrackedLine::trim.
void CountParallels(double reach_m, std::vector<TrackedLine>* lines);

}  // namespace slcmap::mapping
