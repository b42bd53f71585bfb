// Which places of a drawing are taken, so that texts do not lie over each other.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "export/plan/drawing.h"

namespace slcmap {

// A rectangle, in the drawing's unit.
struct Box {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  Eigen::Vector2d half = Eigen::Vector2d::Zero();  // along its own axes
  double angle_rad = 0;                            // from x to the first of them
};

bool Overlap(const Box& a, const Box& b);

// Around a centred text.
Box MakeBox(const DrawnText& text);

// Around a line, that far at each side.
Box MakeBox(const Eigen::Vector2d& start, const Eigen::Vector2d& end, double reach);

// Lines may cross lines, but neither texts nor walls; texts keep clear of everything.
class TakenPlaces {
 public:
  void AddWall(const Box& box) { walls_.push_back(box); }
  void AddText(const Box& box) { texts_.push_back(box); }
  void AddLine(const Box& box) { lines_.push_back(box); }

  bool HasRoomForText(const Box& box) const;
  // Both ends may reach into a wall by that much.
  bool HasRoomForLine(const Box& box, double into_walls) const;

  // Whether a wall is no farther from a point than that.
  bool IsAtWall(const Eigen::Vector2d& point, double reach) const;

 private:
  std::vector<Box> texts_, lines_, walls_;
};

}  // namespace slcmap
