// A floor plan as faces of walls and openings, whatever file it was drawn in. Metres, in the plan's
// coordinates, x right, y up.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "data/core/polygon.h"

namespace slcmap::inline mapping {

// A straight piece of a wall's face: seen from the free side it goes from left to right.
struct PlannedFace {
  Eigen::Vector2d start = Eigen::Vector2d::Zero(), end = Eigen::Vector2d::Zero();
  double sigma_m = 0;      // of its offset, as it is drawn or measured
  bool two_sided = false;  // a drawn line of which it is not known which side is free

  double Length() const { return (end - start).norm(); }
  Eigen::Vector2d Along() const { return (end - start).normalized(); }
  Eigen::Vector2d Normal() const { return {Along().y(), -Along().x()}; }  // to the free side
  Eigen::Vector2d Middle() const { return 0.5 * (start + end); }
};

// A gap in a wall, from jamb to jamb, in the middle of the wall's thickness.
struct PlannedOpening {
  Eigen::Vector2d start = Eigen::Vector2d::Zero(), end = Eigen::Vector2d::Zero();
};

// A storey.
struct BuildingPlan {
  std::string name;
  std::vector<PlannedFace> faces;
  std::vector<PlannedOpening> openings;
};

// Adds the faces of an area: of a wall, or of the room where free_inside.
void AddFaces(const Polygon& area, bool free_inside, BuildingPlan* plan);

// Adds lines as they are drawn: what they enclose is a wall where it is as narrow as one; lines
// that enclose none are added as faces, one-sided where another at one side tells it.
void AddLines(const std::vector<PlanPoints>& lines, BuildingPlan* plan);

// Adds gaps of a door's or window's width between faces that look at each other, open at both
// sides.
void FindOpenings(BuildingPlan* plan);

// The mean width of a long area.
double MeanWidth(const Polygon& area);
inline constexpr double kThickestWall_m = 0.8;

// The plan with x and y so many times as large; where one is less than zero, as seen from below.
BuildingPlan StretchPlan(const BuildingPlan& plan, const Eigen::Vector2d& times);

// The faces near a place.
class FaceIndex {
 public:
  static constexpr double kReach_m = 0.5;  // that queries may ask for

  explicit FaceIndex(const std::vector<PlannedFace>& faces);

  // The index of the nearest one that looks about the same way and is no farther across, if any.
  std::optional<std::size_t> FindNearest(const Eigen::Vector2d& p, const Eigen::Vector2d& normal,
                                         double reach_m) const;

 private:
  const std::vector<PlannedFace>& faces_;
  std::unordered_map<int64_t, std::vector<std::size_t>> cells_;
};

// Whether two pieces of straight lines cross.
bool Cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c,
           const Eigen::Vector2d& d);

}  // namespace slcmap::mapping
