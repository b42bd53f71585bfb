// Lines of a map as what they may be: outlines of pipes.
//
// The outlines of a pipe are no lines of the world: they move over it with the view. But a plane
// through a camera and one of them touches the pipe: its distance from the axis is the radius.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "data/core/math.h"
#include "mapping/map/map.h"
#include "odometry/geometry/lines.h"

namespace slcmap::inline mapping {

// Where an image has a line.
struct OutlineSight {
  int image = 0;
  Eigen::Vector3d centre_world = Eigen::Vector3d::Zero();  // of the camera
  Eigen::Vector3d start_world = Eigen::Vector3d::UnitZ();  // unit, from the camera to its ends
  Eigen::Vector3d end_world = Eigen::Vector3d::UnitZ();
  double pixel_m = 0;  // of the image, at the line
};

// A line of the map, with all of its pieces.
struct Outline {
  int64_t line_id = 0;
  int segment = 0;
  LineAxis axis = LineAxis::kNone;
  int world = -1;
  PointAndDirection line;  // its point in the middle
  double half_m = 0;       // from there to its ends
  std::vector<Interval> pieces;
  double sigma_m = 0;
  std::vector<OutlineSight> sights;
};

// Those of the lines and marks that images show. Images are numbered by their order in the
// evidence.
std::vector<Outline> CollectOutlines(const MapResult& map);

// As seen along an axis, which is at the origin: places x of the plane across it with
// normal . x = offset_m are on the plane through the camera and the outline.
struct TangentLine {
  Eigen::Vector2d normal = Eigen::Vector2d::UnitX();
  double offset_m = 0;
  double side = 1;     // of the axis that it passes on: -1 or 1
  double sigma_m = 0;  // of the outline in the image
  int image = 0, outline = 0;
  Eigen::Vector2d to_camera = Eigen::Vector2d::UnitX();  // unit, from the axis
};

// Along the columns of `across`. What runs along the axis in the image is left out.
std::vector<TangentLine> FindTangents(const PointAndDirection& axis,
                                      const Eigen::Matrix<double, 3, 2>& across,
                                      const std::vector<const Outline*>& outlines);

}  // namespace slcmap::mapping
