#include "mapping/dense/depth_fusion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <utility>

#include "data/core/parallel.h"
#include "mapping/views/stereo_depth.h"

namespace slcmap::inline mapping {
namespace {

constexpr int kMinViews = 3;            // that agree, itself among them
constexpr double kMinBaseline_m = 0.1;  // between those that count
constexpr double kAgreeSigmas = 2;

constexpr double kContrarySigmas = 3;
constexpr double kFloor = 0.008;  // of inverse depth, as a share: planes bend between nodes

enum class Opinion { kNone, kAgrees, kContradicts };

class Confirmer {
 public:
  Confirmer(const PlacedGrid& view, const std::vector<PlacedGrid>& others, const Camera& camera,
            const DenseOptions& options)
      : others_(others), camera_(camera), options_(options) {
    for (const PlacedGrid& other : others) {
      T_other_view_.push_back(other.T_world_camera.Inverse() * view.T_world_camera);
    }
  }

  bool IsConfirmed(int u, int v, const DepthNode& node) const {
    const Eigen::Vector3d p_view = node.depth_m() * PinholeRay(camera_, u, v);
    std::vector<Eigen::Vector3d> places = {Eigen::Vector3d::Zero()};  // of views that agree
    int contrary = 0;
    for (std::size_t i = 0; i < others_.size(); ++i) {
      const Opinion opinion = Ask(i, p_view, node);
      if (opinion == Opinion::kContradicts) ++contrary;
      if (opinion != Opinion::kAgrees) continue;
      const Eigen::Vector3d place = T_other_view_[i].Inverse().translation;
      const bool is_apart = std::all_of(places.begin(), places.end(), [&](const auto& other) {
        return (place - other).norm() >= kMinBaseline_m;
      });
      if (is_apart) places.push_back(place);
    }
    const int agreeing = static_cast<int>(places.size());
    return agreeing >= kMinViews && agreeing > contrary;
  }

 private:
  Opinion Ask(std::size_t other, const Eigen::Vector3d& p_view, const DepthNode& node) const {
    const Eigen::Vector3d p = T_other_view_[other] * p_view;
    if (p.z() < options_.min_depth_m) return Opinion::kNone;
    const Eigen::Vector2d pixel_px(camera_.fx_px * p.x() / p.z() + camera_.cx_px,
                                   camera_.fy_px * p.y() / p.z() + camera_.cy_px);
    Eigen::Vector2d offset_px;
    const DepthNode* seen = others_[other].grid->KnownNear(pixel_px, &offset_px);
    if (!seen) return Opinion::kNone;
    const double seen_inverse =
        seen->inverse_depth + offset_px.x() * seen->slope_x + offset_px.y() * seen->slope_y;
    const double inverse = 1 / p.z();
    // A displacement along the view's ray moves the point about as much in depth of the other one.
    const double sigma = node.sigma * std::pow(inverse / node.inverse_depth, 2);
    const double floor = kFloor * inverse;
    const double both = std::sqrt(sigma * sigma + seen->sigma * seen->sigma + floor * floor);
    if (std::abs(seen_inverse - inverse) <= kAgreeSigmas * both) return Opinion::kAgrees;
    return seen_inverse < inverse - kContrarySigmas * both ? Opinion::kContradicts : Opinion::kNone;
  }

  const std::vector<PlacedGrid>& others_;
  const Camera& camera_;
  const DenseOptions& options_;
  std::vector<RigidTransform> T_other_view_;
};

}  // namespace

DepthGrid ConfirmedDepth(const PlacedGrid& view, const std::vector<PlacedGrid>& others,
                         const Camera& camera, const DenseOptions& options) {
  const Confirmer confirmer(view, others, camera, options);
  DepthGrid confirmed = *view.grid;
  for (int row = 0; row < confirmed.rows; ++row) {
    for (int column = 0; column < confirmed.columns; ++column) {
      DepthNode& node = confirmed.At(column, row);
      if (!node.is_known()) continue;
      if (!confirmer.IsConfirmed(confirmed.ColumnPixel(column), confirmed.RowPixel(row), node)) {
        node.inverse_depth = 0;
      }
    }
  }
  return confirmed;
}

namespace {

constexpr float kIndependent = 10;       // observations of a place share what is wrong with it
constexpr float kMinSigma_m = 0.001F;    // of one view's depth: what its model deserves
constexpr double kMaxSigmaVoxels = 1.5;  // of a point, in voxels
constexpr int kSurfelReach = 2;          // voxels around one that its plane is fitted to
constexpr double kMinFacing = 0.7;       // cosine between normals of one surface
constexpr double kSameSigmas = 3;        // along the normal, between points of one surface
constexpr double kBesides = 0.6;         // voxels across it, at which they are two points

// 20 bits a coordinate, which begins half of them below 0, and 3 for where the surface faces.
constexpr int64_t kMask = (1 << 20) - 1, kLowest = 1 << 19;
constexpr int kFacings = 8, kColumnBits = 23;  // what is beneath the column of a key

int64_t Facing(const Eigen::Vector3f& normal) {
  int axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  return 2 * axis + (normal[axis] < 0 ? 1 : 0);
}

int64_t MakeKey(const std::array<int64_t, 3>& voxel, int64_t facing) {
  const auto bits = [](int64_t coordinate) { return (coordinate + kLowest) & kMask; };
  return (bits(voxel[0]) << 43) | (bits(voxel[1]) << kColumnBits) | (bits(voxel[2]) << 3) | facing;
}

std::array<int64_t, 3> FindVoxel(const Eigen::Vector3d& p, double voxel_m) {
  const auto index = [&](double x) { return static_cast<int64_t>(std::floor(x / voxel_m)); };
  return {index(p.x()), index(p.y()), index(p.z())};
}

// A voxel's point before surfaces are drawn together.
struct Surfel {
  int64_t key = 0;
  int64_t facing = 0;
  std::array<int64_t, 3> voxel = {};
  Eigen::Vector3d p = Eigen::Vector3d::Zero(), normal = Eigen::Vector3d::Zero();
  double sigma_m = 0;
  float weight = 0, grey = 0;
};

// Surfels, sorted by key, by their columns of voxels.
class SurfelIndex {
 public:
  explicit SurfelIndex(const std::vector<Surfel>& surfels) : surfels_(surfels) {
    for (std::size_t i = 0; i < surfels.size(); ++i) {
      columns_.try_emplace(surfels[i].key >> kColumnBits, i, i).first->second.second = i + 1;
    }
  }

  // Those near a surfel that face as it does; itself among them.
  template <typename Visit>
  void ForEachNear(const Surfel& surfel, int reach, const Visit& visit) const {
    for (int x = -reach; x <= reach; ++x) {
      for (int y = -reach; y <= reach; ++y) {
        const std::array<int64_t, 3> lowest = {surfel.voxel[0] + x, surfel.voxel[1] + y,
                                               surfel.voxel[2] - reach};
        ForEachUpTo(MakeKey(lowest, 0), 2 * reach, [&](std::size_t i, const Surfel& other) {
          const bool is_alike =
              other.facing == surfel.facing && other.normal.dot(surfel.normal) >= kMinFacing;
          if (is_alike) visit(i, other);
        });
      }
    }
  }

 private:
  // Those from a key on and in so many voxels above.
  template <typename Visit>
  void ForEachUpTo(int64_t lowest, int voxels, const Visit& visit) const {
    const auto column = columns_.find(lowest >> kColumnBits);
    if (column == columns_.end()) return;
    const auto begin = surfels_.begin() + static_cast<std::ptrdiff_t>(column->second.first);
    const auto end = surfels_.begin() + static_cast<std::ptrdiff_t>(column->second.second);
    const int64_t beyond = lowest + kFacings * (voxels + 1);
    const auto is_below = [](const Surfel& surfel, int64_t key) { return surfel.key < key; };
    auto at = std::lower_bound(begin, end, lowest, is_below);
    for (; at != end && at->key < beyond; ++at) {
      visit(static_cast<std::size_t>(at - surfels_.begin()), *at);
    }
  }

  const std::vector<Surfel>& surfels_;
  std::unordered_map<int64_t, std::pair<std::size_t, std::size_t>> columns_;  // begin and end
};

// Where a surfel's own line along its normal meets the plane of those around it.
Surfel OntoPlane(const Surfel& surfel, const SurfelIndex& index, double voxel_m) {
  const Eigen::Vector3d across = surfel.normal.unitOrthogonal();
  const Eigen::Vector3d up = surfel.normal.cross(across);
  SlopeFit fit;
  double weight = 0;
  index.ForEachNear(surfel, kSurfelReach, [&](std::size_t, const Surfel& other) {
    const Eigen::Vector3d way = other.p - surfel.p;
    const double offset_m = way.dot(surfel.normal);
    const double same_m = kSameSigmas * std::hypot(other.sigma_m, surfel.sigma_m) + 0.3 * voxel_m;
    if (std::abs(offset_m) > same_m) return;
    fit.Add(way.dot(across) / voxel_m, way.dot(up) / voxel_m, offset_m, other.weight);
    weight += other.weight;
  });
  const auto plane = fit.count() >= 5 ? fit.Solve() : std::nullopt;
  if (!plane) return surfel;
  Surfel moved = surfel;
  moved.p += (*plane)[0] * surfel.normal;
  moved.normal =
      (surfel.normal - (*plane)[1] / voxel_m * across - (*plane)[2] / voxel_m * up).normalized();
  // Neighbours on a narrow strip do not tell how the plane is turned about it.
  return moved.normal.dot(surfel.normal) >= kMinFacing ? moved : surfel;
}

// Whether one of two surfels would stand along the normal of the other if both stayed.
bool Shadows(const Surfel& other, const Surfel& surfel, double voxel_m) {
  const Eigen::Vector3d way = surfel.p - other.p;
  const double along_m = way.dot(other.normal);
  const double across_m = (way - along_m * other.normal).norm();
  return across_m < kBesides * voxel_m &&
         std::abs(along_m) < kSameSigmas * surfel.sigma_m + 0.5 * voxel_m;
}

// Of the surfels along a normal the best known stays. Those that stay, in their order.
std::vector<Surfel> ThinnedOut(const std::vector<Surfel>& surfels, const SurfelIndex& index,
                               double voxel_m) {
  const auto comes_first = [&](std::size_t a, std::size_t b) {
    if (surfels[a].weight != surfels[b].weight) return surfels[a].weight > surfels[b].weight;
    return surfels[a].key < surfels[b].key;
  };
  std::vector<std::vector<std::size_t>> shadowed_by(surfels.size());
  ParallelFor(surfels.size(), [&](std::size_t i) {
    index.ForEachNear(surfels[i], kSurfelReach, [&](std::size_t j, const Surfel& other) {
      if (comes_first(j, i) && Shadows(other, surfels[i], voxel_m)) shadowed_by[i].push_back(j);
    });
  });
  std::vector<std::size_t> order(surfels.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), comes_first);
  std::vector<char> stays(surfels.size(), 0);
  for (const std::size_t i : order) {
    stays[i] = std::none_of(shadowed_by[i].begin(), shadowed_by[i].end(),
                            [&](std::size_t j) { return stays[j] != 0; });
  }
  std::vector<Surfel> left;
  for (std::size_t i = 0; i < surfels.size(); ++i) {
    if (stays[i]) left.push_back(surfels[i]);
  }
  return left;
}

}  // namespace

void DepthFusion::Add(const RigidTransform& T_world_camera, const Camera& camera,
                      const DepthGrid& grid) {
  const Eigen::Matrix3d R = T_world_camera.rotation.toRotationMatrix();
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const DepthNode& node = grid.At(column, row);
      if (!node.is_known() || node.depth_sigma_m() > options_.max_sigma_m) continue;
      const Eigen::Vector3d ray = PinholeRay(camera, grid.ColumnPixel(column), grid.RowPixel(row));
      const Eigen::Vector3d p = R * (node.depth_m() * ray) + T_world_camera.translation;
      Add(p, (R * ComputeNormal(node, camera, ray)).cast<float>(),
          static_cast<float>(node.depth_sigma_m()), node.grey);
    }
  }
}

void DepthFusion::Add(const Eigen::Vector3d& p, const Eigen::Vector3f& normal, float sigma_m,
                      float grey) {
  const float known_m = std::max(sigma_m, kMinSigma_m), weight = 1 / (known_m * known_m);
  Sums& sums = voxels_[MakeKey(FindVoxel(p, options_.voxel_m), Facing(normal))];
  sums.weighted_p += weight * p;
  sums.weighted_normal += weight * normal;
  sums.weight += weight;
  sums.weighted_grey += weight * grey;
  ++sums.count;
}

std::vector<DensePoint> DepthFusion::Points() const {
  std::vector<Surfel> surfels;
  for (const auto& [key, sums] : voxels_) {
    Surfel surfel;
    surfel.key = key;
    surfel.p = sums.weighted_p / sums.weight;
    surfel.voxel = FindVoxel(surfel.p, options_.voxel_m);
    surfel.facing = key & 7;
    surfel.normal = sums.weighted_normal.cast<double>().normalized();
    const float shared = std::max(1.0F, static_cast<float>(sums.count) / kIndependent);
    surfel.sigma_m = std::sqrt(shared / sums.weight);
    if (surfel.sigma_m > kMaxSigmaVoxels * options_.voxel_m) continue;
    surfel.weight = sums.weight / shared;
    surfel.grey = sums.weighted_grey / sums.weight;
    surfels.push_back(surfel);
  }
  std::sort(surfels.begin(), surfels.end(),
            [](const Surfel& a, const Surfel& b) { return a.key < b.key; });
  const SurfelIndex index(surfels);
  std::vector<Surfel> flat(surfels.size());
  ParallelFor(surfels.size(),
              [&](std::size_t i) { flat[i] = OntoPlane(surfels[i], index, options_.voxel_m); });
  std::vector<DensePoint> points;
  const SurfelIndex flat_index(flat);
  for (const Surfel& surfel : ThinnedOut(flat, flat_index, options_.voxel_m)) {
    points.push_back(
        {surfel.p, surfel.normal, surfel.sigma_m, static_cast<uint8_t>(std::lround(surfel.grey))});
  }
  return points;
}

}  // namespace slcmap::mapping
