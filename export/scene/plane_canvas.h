// Planes of a building as flat areas to draw on, and images that lie on them.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "data/core/polygon.h"
#include "mapping/map/building.h"

namespace slcmap::inline exporting {

// A plane in space: x and y of a polygon go along two directions, which are square to each other.
struct Canvas {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  Eigen::Vector3d x = Eigen::Vector3d::UnitX(), y = Eigen::Vector3d::UnitY();

  Eigen::Vector3d At(const Eigen::Vector2d& p) const { return origin + p.x() * x + p.y() * y; }
  Eigen::Vector2d Of(const Eigen::Vector3d& p) const {
    return {(p - origin).dot(x), (p - origin).dot(y)};
  }
  Eigen::Vector3d Normal() const { return x.cross(y); }
};

PlanPoints PointsOn(const Canvas& canvas, const std::vector<Eigen::Vector3d>& points_world);

// The front of a plane as somebody before it sees it: x to the right and y up, which is the height
// of upright planes. x of level ones is that of the world, and so is y of floors.
Canvas MakeFront(const BuildingPlane& plane);

// What a plane covers: its outline, or that of its room, without its openings.
std::vector<Polygon> AreaOn(const Canvas& canvas, const BuildingPlane& plane,
                            const Building& building);

// An image that lies on a plane, for formats that can show it.
struct FaceTexture {
  std::string name;
  int64_t plane_id = 0;
  std::string png;
  Canvas canvas;  // its origin is the image's lower left corner
  Eigen::Vector2d size_m = Eigen::Vector2d::Zero();
};

}  // namespace slcmap::exporting
