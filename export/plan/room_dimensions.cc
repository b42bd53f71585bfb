#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "export/plan/dimension.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;

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
    if (TextWidth(text.text, text.height) > room_m || !taken->HasRoomForText(MakeBox(text))) continue;
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

}  // namespace slcmap
