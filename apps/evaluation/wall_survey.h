// How flat and straight walls are, by lines and by points near them.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "apps/evaluation/reference_observations.h"
#include "mapping/map/building.h"
#include "mapping/map/map.h"

namespace slcmap::inline evaluation {

inline constexpr double kSurveyStorey_m = 2.75;  // that verticality is told for

inline constexpr std::array kSurveyStraightedges_m = {1.0, 4.0, 10.0, 15.0};

// What is measured of a wall: one face of it.
struct SurveyedPoints {
  int64_t wall = 0;
  Eigen::Vector3d seen_from_world = Eigen::Vector3d::Zero();  // a place before the face
  std::vector<PlacedInWorld> points;
};

// How far the face is from the plane fitted to it, at one place along it.
struct ProfilePlace {
  double along_m = 0, off_m = 0, sigma_m = 0;
};

struct StraightedgeGap {
  double length_m = 0;
  double gap_m = 0;  // the largest, wherever it is laid along the wall
};

struct SurveyedFace {
  int64_t wall = 0;
  int64_t points = 0;
  Eigen::Vector3d middle_world = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal_world = Eigen::Vector3d::UnitX();  // towards where it was seen from
  double length_m = 0, height_m = 0;
  double rms_m = 0;    // of its points from its plane
  double sigma_m = 0;  // of its plane's distance; kNoFigure where the profile has one place
  // Straightedges that are not longer than it, on its profile. What lies beneath is told without a
  // side: the least distance of two parallels that hold the profile between them.
  std::vector<StraightedgeGap> gaps;
  std::optional<double> lean_m;  // over a storey's height, away from the vertical
  std::vector<ProfilePlace> profile;
};

// Between two faces that face each other, at the middle of what they have in common.
struct FaceDistance {
  int64_t first = 0, second = 0;  // walls
  double distance_m = 0;
  double bound_95_m = 0;  // the half of the interval that holds it with 95 %
};

// Between two faces at about a right angle that are near each other.
struct FaceAngle {
  int64_t first = 0, second = 0;
  double off_deg = 0;  // from 90
  double off_m = 0;    // at the end of the shorter one
  double leg_m = 0;    // its length
};

struct Survey {
  std::vector<SurveyedFace> walls;
  std::vector<FaceDistance> distances;
  std::vector<FaceAngle> angles;
};

// `up_world`: unit, against gravity.
Survey SurveyWalls(const std::vector<SurveyedPoints>& walls, const Eigen::Vector3d& up_world);

// Adds the angles between the walls of a survey.
void AddAngles(const Eigen::Vector3d& up_world, Survey* survey);

// What poses bent of walls beyond what true poses show of the same points: each point of a wall on
// the plane fitted to it with true poses, but for the difference between how far it is from its
// plane with either. So neither what the building has of itself nor the noise of single points is
// in it. Walls are told by their numbers; those without the same number of points are left out.
std::vector<SurveyedPoints> BendsAdded(const std::vector<SurveyedPoints>& walls,
                                       const std::vector<SurveyedPoints>& true_walls,
                                       const Eigen::Vector3d& up_world);

// The largest gap of a straightedge anywhere along a profile that is sorted by along_m; nothing
// where it is longer than the profile, or less than 70 % of the places beneath it are known.
std::optional<double> GapUnder_m(const std::vector<ProfilePlace>& profile, double length_m,
                                 double step_m);

// The walls of a map, to be surveyed from its cloud: from points that nothing laid on a plane.

// The points of the cloud, as stereo measured it, that lie over each plane of a wall, within the
// extents of its outline. Walls have the numbers
// that plans, the page and IFC give them, and may have several faces; planes of none have -1.
std::vector<SurveyedPoints> WallsOfMap(const Building& building,
                                       const std::vector<DensePoint>& cloud);

}  // namespace slcmap::evaluation
