#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "export/plan/dimension.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;

// A side of a wall across an axis.
struct Mark {
  double at_m = 0;      // along the axis
  double weight_m = 0;  // length of the wall
  const PlanWall* wall = nullptr;
};

// The measured sides of walls across an axis (0 x, 1 y), those of the longest walls first.
std::vector<Mark> MarksAlong(const std::vector<WallSolid>& solids, int axis) {
  constexpr double kLeastWall_m = 0.5;
  const double most_along = std::sin(M_PI / 180);
  std::vector<Mark> marks;
  for (const WallSolid& solid : solids) {
    if (std::abs(solid.Direction()[axis]) > most_along || solid.Length() < kLeastWall_m) continue;
    const double middle_m = 0.5 * solid.Length();
    marks.push_back({solid.At(middle_m, 0)[axis], solid.Length(), solid.wall});
    if (solid.wall->thickness_assumed) continue;
    marks.push_back({solid.At(middle_m, solid.Thickness())[axis], solid.Length(), solid.wall});
  }
  std::stable_sort(marks.begin(), marks.end(),
                   [](const Mark& a, const Mark& b) { return a.weight_m > b.weight_m; });
  return marks;
}

// Those between which there is room for a text, in their order along the axis.
std::vector<Mark> ClearMarks(const std::vector<Mark>& marks, double text_m) {
  std::vector<Mark> clear;
  for (const Mark& mark : marks) {
    const bool is_clear = std::all_of(clear.begin(), clear.end(), [&](const Mark& other) {
      return std::abs(mark.at_m - other.at_m) >= text_m || mark.wall == other.wall;
    });
    if (is_clear) clear.push_back(mark);
  }
  std::stable_sort(clear.begin(), clear.end(),
                   [](const Mark& a, const Mark& b) { return a.at_m < b.at_m; });
  return clear;
}

Dimension Between(double from_m, double to_m, int axis, const Vector2d& corner, double offset_m) {
  Dimension dimension;
  dimension.from = dimension.to = corner;
  dimension.from[axis] = from_m;
  dimension.to[axis] = to_m;
  dimension.offset_m = axis == 0 ? -offset_m : offset_m;  // away from the walls
  return dimension;
}

}  // namespace

std::vector<Dimension> OuterChains(const std::vector<WallSolid>& solids,
                                   const PlanTextSizes& sizes) {
  Eigen::AlignedBox2d extent;
  for (const WallSolid& solid : solids) {
    for (const Vector2d& p : {solid.start, solid.end, solid.back_start, solid.back_end}) {
      extent.extend(p);
    }
  }
  std::vector<Dimension> chains;
  const double text_m = TextWidth("00.00", sizes.figure_m);
  for (const int axis : {0, 1}) {
    const std::vector<Mark> marks = ClearMarks(MarksAlong(solids, axis), text_m);
    for (size_t i = 0; i + 1 < marks.size(); ++i) {
      chains.push_back(Between(marks[i].at_m, marks[i + 1].at_m, axis, extent.min(), sizes.row_m));
      chains.back().is_below = chains.back().Length() < text_m;
    }
    if (marks.size() <= 2) continue;
    chains.push_back(
        Between(marks.front().at_m, marks.back().at_m, axis, extent.min(), 2 * sizes.row_m));
  }
  return chains;
}

}  // namespace slcmap
