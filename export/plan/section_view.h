// From where sections and elevations are seen, as options say it.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "export/scene/options.h"
#include "mapping/map/building.h"

namespace slcmap::inline exporting {

// What an upright plane cuts of a building, and what is beyond it. Metres in the plan's frame.
struct SectionView {
  std::string name;                                  // of its files: "section_1"
  std::string title;                                 // "Section 1-1"
  std::string place;                                 // "x = 3.20, towards larger x"
  std::string mark;                                  // "1", as plans show it; "" of elevations
  Eigen::Vector2d origin = Eigen::Vector2d::Zero();  // on the plane, where the drawing has x = 0
  Eigen::Vector2d right = Eigen::Vector2d::UnitX();  // the drawing's x, of length 1
  // What is drawn, along that, and how far beyond the plane.
  double from_m = -std::numeric_limits<double>::infinity();
  double to_m = std::numeric_limits<double>::infinity();
  double depth_m = std::numeric_limits<double>::infinity();
  std::optional<int64_t> storey;  // that alone

  bool Shows(int64_t of_storey) const { return !storey || *storey == of_storey; }
  // The direction in which one looks: to the left of `right`.
  Eigen::Vector2d Ahead() const { return {-right.y(), right.x()}; }
  // Along the drawing's x, and beyond the plane.
  Eigen::Vector2d At(const Eigen::Vector2d& point) const {
    return {(point - origin).dot(right), (point - origin).dot(Ahead())};
  }
};

// Of an option --section: "x=3.2" or "y=1" with ",back" to look the other way, or "1,2:8,2", whose
// first point is to the left of the drawing; `number` counts from 1. Throws ConfigError.
SectionView ParseSection(const std::string& text, int number);

// Throws ConfigError for sections and elevations that cannot be.
void CheckSections(const PlanOptions& options);

// Those of the options: the sections, then elevations, as the sides of the building, and of rooms,
// are seen. Throws ConfigError, also for a building without walls and rooms, and sections that cut
// none.
std::vector<SectionView> SectionViews(const Building& building, const PlanOptions& options);

}  // namespace slcmap::exporting
