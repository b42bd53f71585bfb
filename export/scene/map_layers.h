// A map in layers for programs that draw it: what CAD files and objects are written from.
//
// Metres in the world frame. Names are of capitals, digits and _ and have at most 31 characters.
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "data/core/types.h"
#include "mapping/map/map.h"

namespace slcmap::inline exporting {

// The lines of one storey, axis and kind, such as "S0_X_EDGE"; without storeys "X_EDGE".
struct LinesOfLayer {
  std::string name;
  LineAxis axis = LineAxis::kNone;
  std::vector<std::array<Eigen::Vector3d, 2>> lines;
};

// The planes of one storey and kind, such as "S0_WALL_PLANE", without their openings.
struct PlanesOfLayer {
  std::string name;
  PlaneKind kind = PlaneKind::kOther;
  std::vector<std::array<Eigen::Vector3d, 3>> triangles;  // counter-clockwise before the plane
  std::vector<std::vector<Eigen::Vector3d>> outlines;     // of planes and openings
};

// Lines, marks and the axes of pipes by storey, axis and kind; only layers that hold something.
// Lines belong to the storey in which their middle is.
std::vector<LinesOfLayer> LineLayers(const MapResult& map);

// By storey and kind; only layers that hold something. Throws DataError for outlines that are not
// finite.
std::vector<PlanesOfLayer> PlaneLayers(const Building& building);

// The refined trajectory in pieces between its gaps (TrajectoryGap_s), of two positions or more.
std::vector<std::vector<Eigen::Vector3d>> TrajectoryPieces(const Trajectory& trajectory);

// "S0" and so on.
std::string StoreyPrefix(int64_t storey);

// What plans and pages write beside what was not built as planned: by how many millimetres it is
// off, "missing", "closed" or "new".
std::string WriteDeviation(const WallDeviation& wall);
std::string WriteDeviation(const OpeningDeviation& opening);

// What axes and kinds of lines are called in files.

inline const char* AxisName(LineAxis axis) {
  return std::array{"along x", "along y", "vertical", "of no axis",
                    "sloped"}[static_cast<std::size_t>(axis)];
}

inline const char* GetName(LineKind kind) {
  return std::array{"unknown", "edge", "", "mark", "pipe"}[static_cast<std::size_t>(kind)];
}

}  // namespace slcmap::exporting
