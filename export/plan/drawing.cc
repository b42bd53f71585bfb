#include "export/plan/drawing.h"

#include <algorithm>
#include <cmath>

namespace slcmap::inline exporting {
namespace {

void Place(PlanPoints* points, double scale, const Eigen::Vector2d& offset) {
  for (Eigen::Vector2d& point : *points) point = scale * point + offset;
}

}  // namespace

void Drawing::Add(const Drawing& other) {
  Append(other.areas, &areas);
  Append(other.paths, &paths);
  Append(other.texts, &texts);
}

Drawing Placed(const Drawing& drawing, double scale, const Eigen::Vector2d& offset) {
  Drawing placed = drawing;
  for (DrawnArea& area : placed.areas) {
    Place(&area.polygon.outline, scale, offset);
    for (PlanPoints& hole : area.polygon.holes) Place(&hole, scale, offset);
  }
  for (DrawnPath& path : placed.paths) Place(&path.points, scale, offset);
  for (DrawnText& text : placed.texts) {
    text.position = scale * text.position + offset;
    text.height *= scale;
  }
  return placed;
}

double ReadableAngle(const Eigen::Vector2d& direction) {
  constexpr double kSlack_rad = 0.05;  // what is about upright is read from the right
  const double angle_rad = std::atan2(direction.y(), direction.x());
  if (angle_rad > M_PI / 2 + kSlack_rad) return angle_rad - M_PI;
  if (angle_rad <= -M_PI / 2 + kSlack_rad) return angle_rad + M_PI;
  return angle_rad;
}

double TextWidth(const std::string& text, double height) {
  constexpr double kWidthOfACharacter = 0.87;  // DejaVu Sans, among the widest, over its capitals
  const auto characters = std::count_if(text.begin(), text.end(), [](char c) {
    return (static_cast<unsigned char>(c) & 0xC0) != 0x80;  // what goes on in UTF-8 does not count
  });
  return kWidthOfACharacter * height * static_cast<double>(characters);
}

namespace {

using Eigen::Vector2d;

Vector2d Axis(const Box& box, int index) {
  const double angle_rad = box.angle_rad + (index == 0 ? 0 : M_PI / 2);
  return {std::cos(angle_rad), std::sin(angle_rad)};
}

double HalfAlong(const Box& box, const Vector2d& direction) {
  return box.half.x() * std::abs(Axis(box, 0).dot(direction)) +
         box.half.y() * std::abs(Axis(box, 1).dot(direction));
}

bool Parted(const Box& a, const Box& b, const Vector2d& direction) {
  const double between = std::abs((b.centre - a.centre).dot(direction));
  return between >= HalfAlong(a, direction) + HalfAlong(b, direction);
}

bool IsFree(const std::vector<Box>& taken, const Box& box) {
  return std::none_of(taken.begin(), taken.end(),
                      [&](const Box& other) { return Overlap(other, box); });
}

}  // namespace

bool Overlap(const Box& a, const Box& b) {
  for (const int index : {0, 1}) {
    if (Parted(a, b, Axis(a, index)) || Parted(a, b, Axis(b, index))) return false;
  }
  return true;
}

Box MakeBox(const DrawnText& text) {
  constexpr double kAround = 0.3;  // of its height
  const Vector2d up(-std::sin(text.angle_rad), std::cos(text.angle_rad));
  return {text.position + 0.5 * text.height * up,
          {0.5 * TextWidth(text.text, text.height), (0.5 + kAround) * text.height},
          text.angle_rad};
}

Box MakeBox(const Vector2d& start, const Vector2d& end, double reach) {
  const Vector2d along = end - start;
  return {0.5 * (start + end), {0.5 * along.norm(), reach}, std::atan2(along.y(), along.x())};
}

bool TakenPlaces::HasRoomForText(const Box& box) const {
  return IsFree(texts_, box) && IsFree(lines_, box) && IsFree(walls_, box);
}

bool TakenPlaces::HasRoomForLine(const Box& box, double into_walls) const {
  Box within = box;
  within.half.x() = std::max(0.0, box.half.x() - into_walls);
  return IsFree(texts_, box) && IsFree(walls_, within);
}

bool TakenPlaces::IsAtWall(const Vector2d& point, double reach) const {
  return !IsFree(walls_, {point, {reach, reach}, 0});
}

}  // namespace slcmap::exporting
