#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "export/plan/dimension.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;

bool IsAlong(const WallSolid& solid, int axis) {
  return std::abs(solid.Direction()[1 - axis]) < std::sin(M_PI / 180);
}

// Whether no other wall is between a wall across the axis and the outside, but for one that it ends
// at.
bool IsSeenFrom(const Outside& outside, const WallSolid& solid,
                const std::vector<WallSolid>& solids) {
  constexpr double kEndsAt_m = 1.2;  // its last part may be unseen
  const int across = 1 - outside.axis;
  const double sign = outside.upper ? 1 : -1;
  const double end_m = std::max(sign * solid.start[across], sign * solid.end[across]);
  const double at_m = solid.At(0.5 * solid.Length(), 0.5 * solid.Thickness())[outside.axis];
  return std::none_of(solids.begin(), solids.end(), [&](const WallSolid& other) {
    if (!IsAlong(other, outside.axis) || sign * other.start[across] < end_m + kEndsAt_m) {
      return false;
    }
    const auto [from_m, to_m] = std::minmax(other.start[outside.axis], other.end[outside.axis]);
    return at_m > from_m && at_m < to_m;
  });
}

constexpr double kLeastWall_m = 0.5, kOnLine_m = 0.1;

// Whether a wall has a side on the line across the axis at at_m, and is there at across_m.
bool HasSideAt(const WallSolid& solid, int axis, double at_m, double across_m) {
  const auto [from_m, to_m] = std::minmax(solid.start[1 - axis], solid.end[1 - axis]);
  if (!IsAlong(solid, 1 - axis) || across_m < from_m || across_m > to_m) return false;
  const double along_m = 0.5 * solid.Length();
  return std::abs(solid.At(along_m, 0)[axis] - at_m) < kOnLine_m ||
         std::abs(solid.At(along_m, solid.Thickness())[axis] - at_m) < kOnLine_m;
}

// Whether the outermost border of a room on the line across the axis at at_m is one at whose middle
// no wall was seen: a chain there shows the room's width, which is then only known of the wall that
// goes on along the line elsewhere.
bool IsUnseenBorder(const Outside& outside, double at_m, const std::vector<WallSolid>& solids,
                    const std::vector<Polygon>& rooms) {
  const double sign = outside.upper ? 1 : -1;
  double outermost_m = -std::numeric_limits<double>::infinity();  // outwards
  for (const Polygon& room : rooms) {
    const PlanPoints& ring = room.outline;
    for (size_t i = 0; i < ring.size(); ++i) {
      const Vector2d &a = ring[i], &b = ring[(i + 1) % ring.size()];
      if (std::abs(a[outside.axis] - at_m) > kOnLine_m ||
          std::abs(b[outside.axis] - at_m) > kOnLine_m || (b - a).norm() < kLeastWall_m) {
        continue;
      }
      outermost_m = std::max(outermost_m, sign * 0.5 * (a + b)[1 - outside.axis]);
    }
  }
  return std::isfinite(outermost_m) &&
         std::none_of(solids.begin(), solids.end(), [&](const WallSolid& solid) {
           return HasSideAt(solid, outside.axis, at_m, sign * outermost_m);
         });
}

// The sides of walls across the axis.
std::vector<ChainMark> MarksFrom(const Outside& outside, const std::vector<WallSolid>& solids,
                                 const std::vector<Polygon>& rooms) {
  std::vector<ChainMark> marks;
  for (const WallSolid& solid : solids) {
    if (!IsAlong(solid, 1 - outside.axis) || solid.Length() < kLeastWall_m) continue;
    if (!IsSeenFrom(outside, solid, solids)) continue;
    for (const double behind_m : {0.0, solid.Thickness()}) {
      const double at_m = solid.At(0.5 * solid.Length(), behind_m)[outside.axis];
      marks.push_back({at_m, solid.Length(), solid.wall,
                       (behind_m > 0 && solid.wall->thickness_assumed) ||
                           IsUnseenBorder(outside, at_m, solids, rooms)});
    }
  }
  return marks;
}

// Those between which there is room for a text, in their order along the axis.
std::vector<ChainMark> ClearMarks(std::vector<ChainMark> marks, double text_m) {
  std::stable_sort(marks.begin(), marks.end(),
                   [](const ChainMark& a, const ChainMark& b) { return a.weight_m > b.weight_m; });
  std::vector<ChainMark> clear;
  for (const ChainMark& mark : marks) {
    const bool is_clear = std::all_of(clear.begin(), clear.end(), [&](const ChainMark& other) {
      return std::abs(mark.at_m - other.at_m) >= text_m || mark.wall == other.wall;
    });
    if (is_clear) clear.push_back(mark);
  }
  std::stable_sort(clear.begin(), clear.end(),
                   [](const ChainMark& a, const ChainMark& b) { return a.at_m < b.at_m; });
  return clear;
}

// The chain in a row outside of the extent.
class Chain {
 public:
  Chain(const Outside& outside, const Eigen::AlignedBox2d& extent, const PlanTextSizes& sizes)
      : outside_(outside), corner_(outside.upper ? extent.max() : extent.min()), sizes_(sizes) {}

  Dimension Between(const ChainMark& from, const ChainMark& to, int row) const {
    Dimension dimension;
    dimension.from = dimension.to = corner_;
    dimension.from[outside_.axis] = from.at_m;
    dimension.to[outside_.axis] = to.at_m;
    // To the left of its direction is y of x, but -x of y.
    const bool is_left = outside_.upper == (outside_.axis == 0);
    dimension.offset_m = (is_left ? 1 : -1) * row * sizes_.row_m;
    dimension.is_about = from.assumed || to.assumed;
    dimension.in_mm = sizes_.in_mm;
    return dimension;
  }

  // A text that is longer than what it is of: farther out than the others, where no line goes but
  // those of the whole length at both ends. Of a chain along x it is beyond those, along y between
  // them: so they do not meet at corners.
  void PlaceLong(bool is_first, bool is_last, Dimension* dimension) const {
    const double length_m = dimension->Length();
    const double text_m = TextWidth(dimension->Text(), sizes_.figure_m);
    if (text_m <= length_m) return;
    const double from_end = (0.5 * text_m + sizes_.gap_m) / length_m;
    const bool is_beyond = outside_.axis == 0;
    if (is_first) dimension->text_at = is_beyond ? -from_end : from_end;
    if (is_last && !is_first) dimension->text_at = is_beyond ? 1 + from_end : 1 - from_end;
    if (is_beyond && (is_first || is_last)) return;
    // Texts are read from below and from the right: there is outside above or below them.
    dimension->text_row = outside_.upper == (outside_.axis == 0) ? 1 : -1;
  }

 private:
  Outside outside_;
  Vector2d corner_;
  const PlanTextSizes& sizes_;
};

// By which the longest wall lies along x, if none is along an axis, as in maps that are far away
// and keep the axes of their poses; else 0.
double TurnToAxes(const std::vector<WallSolid>& solids) {
  const WallSolid* longest = nullptr;
  for (const WallSolid& solid : solids) {
    if (IsAlong(solid, 0) || IsAlong(solid, 1)) return 0;
    if (longest == nullptr || solid.Length() > longest->Length()) longest = &solid;
  }
  if (longest == nullptr) return 0;
  const Vector2d along = longest->Direction();
  return -std::remainder(std::atan2(along.y(), along.x()), M_PI / 2);
}

}  // namespace

std::vector<Dimension> ChainsOutside(const Outside& outside, const Eigen::AlignedBox2d& extent,
                                     const std::vector<ChainMark>& marks,
                                     const PlanTextSizes& sizes) {
  const Chain chain(outside, extent, sizes);
  const double text_m = TextWidth(sizes.in_mm ? "~00000" : "~00.00", sizes.figure_m);
  const std::vector<ChainMark> clear = ClearMarks(marks, text_m);
  std::vector<Dimension> dimensions;
  for (size_t i = 0; i + 1 < clear.size(); ++i) {
    dimensions.push_back(chain.Between(clear[i], clear[i + 1], 1));
    chain.PlaceLong(i == 0, i + 2 == clear.size(), &dimensions.back());
  }
  if (clear.size() > 2) dimensions.push_back(chain.Between(clear.front(), clear.back(), 2));
  return dimensions;
}

std::vector<Dimension> OuterChains(std::vector<WallSolid> solids, std::vector<Polygon> rooms,
                                   const PlanTextSizes& sizes) {
  const Eigen::Rotation2Dd turn(TurnToAxes(solids));
  Eigen::AlignedBox2d extent;
  const auto turn_point = [&](Vector2d* p) {
    *p = turn * *p;
    extent.extend(*p);
  };
  for (WallSolid& solid : solids) {
    for (Vector2d* p : {&solid.start, &solid.end, &solid.back_start, &solid.back_end}) {
      turn_point(p);
    }
  }
  for (Polygon& room : rooms) {
    for (Vector2d& p : room.outline) turn_point(&p);
  }
  std::vector<Dimension> dimensions;
  for (const int axis : {0, 1}) {
    for (const bool upper : {false, true}) {
      const Outside outside = {axis, upper};
      Append(ChainsOutside(outside, extent, MarksFrom(outside, solids, rooms), sizes), &dimensions);
    }
  }
  for (Dimension& dimension : dimensions) {
    for (Vector2d* p : {&dimension.from, &dimension.to}) *p = turn.inverse() * *p;
  }
  return dimensions;
}

}  // namespace slcmap
