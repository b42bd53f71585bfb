#include "apps/evaluation/triangle_tree.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>

#include "data/error.h"
#include "data/ply.h"

namespace slcmap {
namespace {

constexpr int32_t kLeafSize = 4;
constexpr std::size_t kMaxDepth = 64;

Eigen::Vector3d Centre(const Triangle& triangle) {
  return (triangle[0] + triangle[1] + triangle[2]) / 3;
}

// T. Moeller and B. Trumbore, "Fast, minimum storage ray/triangle intersection", 1997.
double Hit_m(const Triangle& triangle, const Eigen::Vector3d& origin,
             const Eigen::Vector3d& direction) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  const Eigen::Vector3d side1 = triangle[1] - triangle[0], side2 = triangle[2] - triangle[0];
  const Eigen::Vector3d p = direction.cross(side2);
  const double determinant = side1.dot(p);
  if (std::abs(determinant) < 1e-14) return kNone;
  const Eigen::Vector3d from = origin - triangle[0];
  const double u = from.dot(p) / determinant;
  const Eigen::Vector3d q = from.cross(side1);
  const double v = direction.dot(q) / determinant;
  if (u < 0 || v < 0 || u + v > 1) return kNone;
  const double distance_m = side2.dot(q) / determinant;
  return distance_m > 0 ? distance_m : kNone;
}

// Where a ray enters a box; infinite where it misses it.
double Entry_m(const Eigen::AlignedBox3d& box, const Eigen::Vector3d& origin,
               const Eigen::Vector3d& inverse_direction) {
  double enter = 0, leave = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 3; ++i) {
    double near = (box.min()[i] - origin[i]) * inverse_direction[i];
    double far = (box.max()[i] - origin[i]) * inverse_direction[i];
    if (near > far) std::swap(near, far);
    if (near > enter) enter = near;  // false for a ray that lies in the box's face (not a number)
    if (far < leave) leave = far;
  }
  return enter <= leave ? enter : std::numeric_limits<double>::infinity();
}

double SquaredDistanceToSegment(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                const Eigen::Vector3d& b) {
  const Eigen::Vector3d way = b - a;
  const double length2 = way.squaredNorm();
  const double u = length2 > 0 ? std::clamp((p - a).dot(way) / length2, 0.0, 1.0) : 0.0;
  return (a + u * way - p).squaredNorm();
}

double SquaredDistance(const Eigen::Vector3d& p, const Triangle& triangle) {
  const Eigen::Vector3d normal =
      (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]).normalized();
  bool is_above = normal.squaredNorm() > 0.5;  // not of a triangle without area
  for (int i = 0; i < 3 && is_above; ++i) {
    const Eigen::Vector3d side = triangle[(i + 1) % 3] - triangle[i];
    is_above = normal.dot(side.cross(p - triangle[i])) >= 0;
  }
  if (is_above) return std::pow(normal.dot(p - triangle[0]), 2);
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 3; ++i) {
    least = std::min(least, SquaredDistanceToSegment(p, triangle[i], triangle[(i + 1) % 3]));
  }
  return least;
}

}  // namespace

TriangleTree::TriangleTree(std::vector<Triangle> triangles) : triangles_(std::move(triangles)) {
  nodes_.reserve(triangles_.size() + 1);
  if (!triangles_.empty()) Build(0, static_cast<int32_t>(triangles_.size()));
}

void TriangleTree::Build(int32_t begin, int32_t end) {
  const std::size_t index = nodes_.size();
  nodes_.push_back({{}, begin, end - begin});
  Eigen::AlignedBox3d centres;
  for (int32_t i = begin; i < end; ++i) {
    for (const Eigen::Vector3d& corner : triangles_[i]) nodes_[index].box.extend(corner);
    centres.extend(Centre(triangles_[i]));
  }
  if (end - begin <= kLeafSize) return;
  int axis = 0;
  centres.sizes().maxCoeff(&axis);
  const int32_t middle = begin + (end - begin) / 2;
  std::nth_element(
      triangles_.begin() + begin, triangles_.begin() + middle, triangles_.begin() + end,
      [axis](const Triangle& a, const Triangle& b) { return Centre(a)[axis] < Centre(b)[axis]; });
  Build(begin, middle);
  nodes_[index].first = static_cast<int32_t>(nodes_.size());
  nodes_[index].count = 0;
  Build(middle, end);
}

double TriangleTree::FirstHit_m(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                                double max_m) const {
  if (nodes_.empty()) return std::numeric_limits<double>::infinity();
  const Eigen::Vector3d inverse_direction = direction.cwiseInverse();
  double nearest_m = std::numeric_limits<double>::infinity();
  std::array<int32_t, kMaxDepth> stack;
  std::size_t waiting = 0;
  stack[waiting++] = 0;
  while (waiting > 0) {
    const int32_t index = stack[--waiting];
    const Node& node = nodes_[index];
    if (Entry_m(node.box, origin, inverse_direction) > std::min(nearest_m, max_m)) continue;
    for (int32_t i = node.first; i < node.first + node.count; ++i) {
      nearest_m = std::min(nearest_m, Hit_m(triangles_[i], origin, direction));
    }
    if (node.count > 0) continue;
    stack[waiting++] = node.first;
    stack[waiting++] = index + 1;
  }
  return nearest_m <= max_m ? nearest_m : std::numeric_limits<double>::infinity();
}

double TriangleTree::Distance_m(const Eigen::Vector3d& p, double max_m) const {
  if (nodes_.empty()) return max_m;
  double nearest2 = max_m * max_m;
  std::array<int32_t, kMaxDepth> stack;
  std::size_t waiting = 0;
  stack[waiting++] = 0;
  while (waiting > 0) {
    const int32_t index = stack[--waiting];
    const Node& node = nodes_[index];
    if (node.box.squaredExteriorDistance(p) >= nearest2) continue;
    for (int32_t i = node.first; i < node.first + node.count; ++i) {
      nearest2 = std::min(nearest2, SquaredDistance(p, triangles_[i]));
    }
    if (node.count > 0) continue;
    stack[waiting++] = node.first;
    stack[waiting++] = index + 1;
  }
  return std::sqrt(nearest2);
}

std::vector<Triangle> ReadSurfaces(const std::string& path) {
  const PlyFile file = ReadPly(path);
  const std::vector<Eigen::Vector3d> corners = Positions(file.Get("vertex", path), path);
  const auto corner = [&](std::size_t face, std::size_t i) {
    const auto vertex = static_cast<std::size_t>(file.faces[face][i]);
    if (vertex < corners.size()) return corners[vertex];
    throw DataError(fmt::format("{}: face row {}: found vertex {}, expected one of {}", path,
                                face + 1, vertex, corners.size()));
  };
  std::vector<Triangle> triangles;
  for (std::size_t face = 0; face < file.faces.size(); ++face) {
    for (std::size_t i = 2; i < file.faces[face].size(); ++i) {
      triangles.push_back({corner(face, 0), corner(face, i - 1), corner(face, i)});
    }
  }
  if (triangles.empty()) {
    throw DataError(path + ": found no faces, expected the surfaces of a building");
  }
  return triangles;
}

}  // namespace slcmap
