#include <spdlog/fmt/fmt.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <set>

#include "export/plan/drawing.h"

namespace slcmap::inline exporting {
namespace {

using Eigen::Vector2d;

Vector2d TurnLeft(const Vector2d& direction) { return {-direction.y(), direction.x()}; }

// A short stroke across the end of a dimension's line.
DrawnPath Tick(const Vector2d& at, const Vector2d& along, double size_m) {
  const Vector2d slash = 0.5 * size_m * (along + TurnLeft(along)).normalized();
  return {Pen::kDimension, {at - slash, at + slash}};
}

}  // namespace

std::string LengthText(double length_m, bool in_mm) {
  return in_mm ? fmt::format("{:.0f}", 1e3 * length_m) : fmt::format("{:.2f}", length_m);
}

PlanTextSizes::PlanTextSizes(int scale, bool millimetres) : in_mm(millimetres) {
  const double metres_of_mm = 1e-3 * scale;
  name_m = 3 * metres_of_mm;
  figure_m = 2 * metres_of_mm;
  small_m = 1.6 * metres_of_mm;
  gap_m = 0.8 * metres_of_mm;
  row_m = 7 * metres_of_mm;
}

Vector2d Dimension::LineEnd() const { return to + offset_m * TurnLeft((to - from).normalized()); }

std::string Dimension::Text() const {
  return fmt::format("{}{}", is_about ? "~" : "", LengthText(Length(), in_mm));
}

DrawnText DimensionText(const Dimension& dimension, const PlanTextSizes& sizes) {
  const Vector2d along = (dimension.to - dimension.from).normalized();
  const double angle_rad = ReadableAngle(along);
  const Vector2d up(-std::sin(angle_rad), std::cos(angle_rad));
  // The next row is as far from the text below as that is from the line.
  const double over_m = dimension.text_row * (sizes.figure_m + sizes.gap_m) +
                        (dimension.text_row < 0 ? 0 : sizes.gap_m);
  const Vector2d on_line = dimension.from + dimension.text_at * (dimension.to - dimension.from) +
                           dimension.offset_m * TurnLeft(along);
  return {dimension.Text(), on_line + over_m * up, sizes.figure_m, angle_rad};
}

Drawing DrawDimension(const Dimension& dimension, const PlanTextSizes& sizes) {
  const Vector2d along = (dimension.to - dimension.from).normalized();
  const Vector2d aside = dimension.offset_m * TurnLeft(along);
  const Vector2d start = dimension.from + aside, end = dimension.to + aside;
  Drawing drawing;
  drawing.paths = {{Pen::kDimension, {start, end}},
                   Tick(start, along, sizes.figure_m),
                   Tick(end, along, sizes.figure_m)};
  if (std::abs(dimension.offset_m) > 2 * sizes.gap_m) {
    const Vector2d beyond = aside.normalized() * sizes.gap_m;
    for (const Vector2d& point : {dimension.from, dimension.to}) {
      drawing.paths.push_back({Pen::kDimension, {point + beyond, point + aside + beyond}});
    }
  }
  drawing.texts = {DimensionText(dimension, sizes)};
  return drawing;
}

namespace {

constexpr double kLeastSide_m = 0.5;

// A side of a room, which is to its left.
struct Side {
  Vector2d start, end;
  int line = 0;  // of the sides that go on along one line, the first

  double Length() const { return (end - start).norm(); }
  Vector2d Direction() const { return (end - start).normalized(); }
  Vector2d Inward() const { return {-Direction().y(), Direction().x()}; }
};

double CosineOfADegree() { return std::cos(M_PI / 180); }

bool GoOnAlongOneLine(const Side& a, const Side& b) {
  constexpr double kAside_m = 0.02;
  return a.Direction().dot(b.Direction()) > CosineOfADegree() &&
         std::abs((b.start - a.start).dot(a.Inward())) < kAside_m;
}

void AddSides(const PlanPoints& ring, std::vector<Side>* sides) {
  for (size_t i = 0; i < ring.size(); ++i) {
    Side side = {ring[i], ring[(i + 1) % ring.size()]};
    if (side.Length() == 0) continue;
    side.line = static_cast<int>(sides->size());
    for (const Side& other : *sides) {
      if (GoOnAlongOneLine(other, side)) side.line = std::min(side.line, other.line);
    }
    sides->push_back(side);
  }
}

// How far a side is from a point in a direction; nothing where it is not there.
std::optional<double> DistanceTo(const Side& side, const Vector2d& from,
                                 const Vector2d& direction) {
  const Vector2d along = side.end - side.start;
  const double determinant = along.x() * direction.y() - along.y() * direction.x();
  if (std::abs(determinant) < 1e-9) return std::nullopt;
  const Vector2d between = from - side.start;
  const double at = (between.x() * direction.y() - between.y() * direction.x()) / determinant;
  const double distance_m = (between.x() * along.y() - between.y() * along.x()) / determinant;
  if (at < 0 || at > 1 || distance_m < 1e-6) return std::nullopt;
  return distance_m;
}

struct Opposite {
  const Side* side = nullptr;
  double distance_m = 0;
};

// What is first met across the room.
Opposite FindOpposite(const std::vector<Side>& sides, const Side& side, const Vector2d& from) {
  Opposite nearest;
  for (const Side& other : sides) {
    const std::optional<double> distance_m = DistanceTo(other, from, side.Inward());
    if (distance_m && (nearest.side == nullptr || *distance_m < nearest.distance_m)) {
      nearest = {&other, *distance_m};
    }
  }
  return nearest;
}

// Places the text where nothing is in its way; false where there is no such place, or where no wall
// is at either end.
bool Place(const PlanTextSizes& sizes, TakenPlaces* taken, Dimension* dimension) {
  const Box line = MakeBox(dimension->from, dimension->to, sizes.gap_m);
  constexpr double kIntoWalls_m = 0.1;  // sides of rooms are about where the walls are
  for (const Vector2d& end : {dimension->from, dimension->to}) {
    if (!taken->IsAtWall(end, kIntoWalls_m)) return false;
  }
  if (!taken->HasRoomForLine(line, kIntoWalls_m)) return false;
  for (const double at : {0.5, 0.35, 0.65, 0.2, 0.8}) {
    dimension->text_at = at;
    const DrawnText text = DimensionText(*dimension, sizes);
    const double room_m = 2 * std::min(at, 1 - at) * dimension->Length();
    if (TextWidth(text.text, text.height) > room_m || !taken->HasRoomForText(MakeBox(text)))
      continue;
    taken->AddText(MakeBox(text));
    taken->AddLine(line);
    return true;
  }
  return false;
}

// Two lines of sides, the first the smaller one.
using LinePair = std::pair<int, int>;

struct Crossing {
  LinePair lines;
  Dimension dimension;
};

// From a place on a side to what is across, where that is parallel to it.
std::optional<Crossing> Across(const std::vector<Side>& sides, const Side& side, double at) {
  const Vector2d from = side.start + at * (side.end - side.start);
  const Opposite opposite = FindOpposite(sides, side, from);
  if (opposite.side == nullptr || opposite.side->Length() < kLeastSide_m ||
      -opposite.side->Direction().dot(side.Direction()) < CosineOfADegree()) {
    return std::nullopt;
  }
  return Crossing{std::minmax({side.line, opposite.side->line}),
                  {from, from + opposite.distance_m * side.Inward()}};
}

}  // namespace

std::vector<Dimension> RoomDimensions(const Polygon& room, const PlanTextSizes& sizes,
                                      TakenPlaces* taken) {
  std::vector<Side> sides;
  AddSides(room.outline, &sides);
  for (const PlanPoints& hole : room.holes) AddSides(hole, &sides);
  std::vector<Dimension> dimensions;
  std::set<LinePair> known;
  for (const Side& side : sides) {
    if (side.Length() < kLeastSide_m) continue;
    for (const double at : {0.5, 0.4, 0.6, 0.3, 0.7, 0.2, 0.8, 0.1, 0.9}) {
      std::optional<Crossing> crossing = Across(sides, side, at);
      if (!crossing || known.contains(crossing->lines)) continue;
      crossing->dimension.in_mm = sizes.in_mm;
      if (!Place(sizes, taken, &crossing->dimension)) continue;
      known.insert(crossing->lines);
      dimensions.push_back(crossing->dimension);
    }
  }
  return dimensions;
}

namespace {

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

}  // namespace slcmap::exporting
