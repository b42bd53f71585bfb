// Triangles in a tree of boxes: what a ray hits first, and how far a point is from the nearest.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace slcmap {

using Triangle = std::array<Eigen::Vector3d, 3>;  // metres in world

class TriangleTree {
 public:
  explicit TriangleTree(std::vector<Triangle> triangles);

  // The distance along a ray (unit direction) to the first triangle, seen from either side;
  // infinite where there is none up to max_m.
  double FirstHit_m(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                    double max_m = std::numeric_limits<double>::infinity()) const;

  // The distance of a point to the nearest triangle; max_m where none is nearer.
  double Distance_m(const Eigen::Vector3d& p, double max_m) const;

 private:
  // Leaves hold the triangles [first, first + count); inner nodes have count 0, their left child
  // next to them, and the right one at `first`.
  struct Node {
    Eigen::AlignedBox3d box;
    int32_t first = 0, count = 0;
  };

  void Build(int32_t begin, int32_t end);

  std::vector<Triangle> triangles_;
  std::vector<Node> nodes_;
};

// The faces of a PLY mesh, cut into triangles. Throws DataError naming file and face when there are
// none, or one refers to no vertex.
std::vector<Triangle> ReadSurfaces(const std::string& path);

}  // namespace slcmap
