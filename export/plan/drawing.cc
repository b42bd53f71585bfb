#include "export/plan/drawing.h"

#include <algorithm>
#include <cmath>

namespace slcmap {
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

}  // namespace slcmap
