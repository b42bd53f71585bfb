// How flat and straight walls are, by lines and by points near them.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "apps/evaluation/reference_observations.h"

namespace slcmap::inline evaluation {

inline constexpr std::array kSurveyStraightedges_m = {4.0, 10.0};

// What is measured of a wall: one face of it.
struct SurveyedPoints {
  int64_t wall = 0;
  Eigen::Vector3d seen_from_world = Eigen::Vector3d::Zero();  // a place before the face
  std::vector<PlacedInWorld> points;
};

// How far the face is from the plane fitted to it, at one place along it.
struct ProfilePlace {
  double along_m = 0, off_m = 0;
};

struct StraightedgeGap {
  double length_m = 0;
  double gap_m = 0;  // the largest, wherever it is laid along the wall
};

struct SurveyedFace {
  int64_t wall = 0;
  Eigen::Vector3d middle_world = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal_world = Eigen::Vector3d::UnitX();  // towards where it was seen from
  double length_m = 0;
  // Straightedges that are not longer than it, on its profile. What lies beneath is told without a
  // side: the least distance of two parallels that hold the profile between them.
  std::vector<StraightedgeGap> gaps;
};

// Between two faces that face each other, at the middle of what they have in common.
struct FaceDistance {
  int64_t first = 0, second = 0;  // walls
  double distance_m = 0;
};

struct Survey {
  std::vector<SurveyedFace> walls;
  std::vector<FaceDistance> distances;
};

// `up_world`: unit, against gravity.
Survey SurveyWalls(const std::vector<SurveyedPoints>& walls, const Eigen::Vector3d& up_world);

// The largest gap under straightedges of a length on any wall; nothing where none can be laid.
std::optional<double> WorstGap_m(const Survey& survey, double length_m);

// Of the distances that the survey with true poses has too: the error that 95 % are below.
std::optional<double> DistanceError95_m(const Survey& survey, const Survey& truth);

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

// DIN 18202 (finished walls), by interpolation between the lengths that it lists: the gap under a
// straightedge of a length (3, 5, 10, 20, 25 mm at 0.1, 1, 4, 10, 15 m). A real wall may bend by as
// much: less cannot be blamed on a map.
double AllowedGap_m(double length_m);

}  // namespace slcmap::evaluation
