#include "export/plan/taken_places.h"

#include <algorithm>
#include <cmath>

namespace slcmap {
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

}  // namespace slcmap
