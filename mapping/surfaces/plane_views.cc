#include "mapping/surfaces/plane_views.h"

#include <algorithm>
#include <cmath>

#include "data/core/math.h"
#include "odometry/geometry/pinhole.h"

namespace slcmap::inline mapping {
namespace {

// What has to be measured around a cell.
constexpr int kNeighbours = 8;         // of the measured points nearest to it along the plane
constexpr double kAgree_m = 0.015;     // from their median, of those that are on one surface
constexpr double kMinShare = 0.75;     // of them, that is on one
constexpr double kBlankClear_m = 0.1;  // from what was measured beside the plane
// What cameras have to see of it.
constexpr double kMaxRange_m = 8;
constexpr double kMinCosine = 0.0872;  // 85 degrees
constexpr double kBehind_m = 0.1;      // where they end behind it

constexpr double kSigmas = 3;

}  // namespace

cv::Mat1i CountPasses(const PlaneGrid& grid, const std::vector<ViewRays>& rays) {
  cv::Mat1i passes(grid.rows, grid.columns, 0);
  for (const ViewRays& view : rays) {
    const double before_m = grid.DistanceTo(view.p_world_camera);
    if (before_m == 0) continue;
    for (size_t i = 0; i < view.p_world.size(); ++i) {
      const Eigen::Vector3d end = view.p_world[i].cast<double>();
      const double after_m = grid.DistanceTo(end);
      if (before_m * after_m >= 0) continue;
      if (std::abs(after_m) <= std::max<double>(kBehind_m, kSigmas * view.sigma_m[i])) {
        continue;
      }
      const Eigen::Vector3d at =
          view.p_world_camera + before_m / (before_m - after_m) * (end - view.p_world_camera);
      const int column = grid.FindColumn(at), row = grid.FindRow(at);
      if (grid.Contains(column, row)) ++passes(row, column);
    }
  }
  return passes;
}

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kMinDepth_m = 0.3;  // of a place from a camera
constexpr double kMargin_px = 2;     // of the image's border

}  // namespace

PlaneWatch::PlaneWatch(const ViewCameras& cameras, const std::vector<VisibilityDepths>& depths)
    : cameras_(cameras), depths_(depths) {
  for (size_t view = 0; view < cameras_.T_camera_world.size(); ++view) {
    centres_.push_back(cameras_.Centre(static_cast<int>(view)));
  }
}

bool PlaneWatch::Sees(const Vector3d& p_world, const Vector3d& normal_world) {
  const int count = static_cast<int>(centres_.size());
  for (int i = 0; i < count; ++i) {
    const int view = (last_ + i) % count;
    if (!SeesFrom(view, p_world, normal_world)) continue;
    last_ = view;
    return true;
  }
  return false;
}

bool PlaneWatch::SeesFrom(int view, const Vector3d& p_world, const Vector3d& normal_world) const {
  const Vector3d way = centres_[view] - p_world;
  const double range_m = way.norm();
  if (range_m > kMaxRange_m || normal_world.dot(way) < kMinCosine * range_m) return false;
  const RigidTransform& T_camera_world = cameras_.T_camera_world[view][0];
  const Vector3d p_camera = T_camera_world * p_world;
  if (p_camera.z() < kMinDepth_m) return false;
  const Camera& camera = cameras_.cameras[0];
  const Vector2d px = PixelFromPlane(camera, Vector2d(p_camera.hnormalized()));
  if (!camera.Contains(px, kMargin_px)) return false;
  const Vector3d normal_camera = T_camera_world.rotation * normal_world;
  return std::ranges::none_of(depths_, [&](const VisibilityDepths& depths) {
    return depths.HidesSurface(view, 0, camera, p_camera, normal_camera);
  });
}

namespace {

constexpr double kMinFacing = 0.7;                             // cosine between normals
constexpr double kLeastBehind_m = 0.045, kMostBehind_m = 0.4;  // of leaves and panes behind a wall

// In the axes of the plane, from its first corner: small numbers, which the tree holds as floats.
Eigen::Vector3f Along(const PlaneGrid& grid, const Eigen::Vector3d& p) {
  return {static_cast<float>(grid.u.dot(p) - grid.from_u_m),
          static_cast<float>(grid.v.dot(p) - grid.from_v_m), 0};
}

using Places = std::vector<Eigen::Vector3f>;

// Places of a line that lies in the plane, at its border, where it meets others: there the plane is
// on the inner side. Of lines elsewhere, as those around a pane, nobody knows on which side it is.
void AddBorderPlaces(const PlaneGrid& grid, const MapLine& line, double max_offset_m,
                     Places* places) {
  constexpr double kBorder_m = 0.12;  // skirtings are as high
  if (line.kind == LineKind::kPipe || std::abs(grid.DistanceTo(line.start_world)) > max_offset_m ||
      std::abs(grid.DistanceTo(line.end_world)) > max_offset_m) {
    return;
  }
  const auto width_m = static_cast<float>(grid.columns * grid.cell_m);
  const auto height_m = static_cast<float>(grid.rows * grid.cell_m);
  const Eigen::Vector3d way = line.end_world - line.start_world;
  const int count = static_cast<int>(way.norm() / grid.cell_m) + 1;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3f place = Along(grid, line.start_world + (i + 0.5) / count * way);
    const float from_border_m =
        std::min({place.x(), place.y(), width_m - place.x(), height_m - place.y()});
    if (std::abs(from_border_m) < kBorder_m) places->push_back(place);
  }
}

// To the nearest of the places, whose index is found's first; none where there are none.
std::optional<double> Nearest_m(const PointTree& tree, const Eigen::Vector3f& place,
                                PointTree::Found* found) {
  tree.FindNearest(place, 1, found);
  if (found->items.empty()) return std::nullopt;
  return std::sqrt(static_cast<double>(found->squared_m2.front()));
}

}  // namespace

MeasuredAround::MeasuredAround(const PlaneGrid& grid, const std::vector<DensePoint>& cloud,
                               const std::vector<MapLine>& lines, double beside_m)
    : grid_(grid), cloud_(cloud) {
  Places off_plane, behind;
  for (size_t i = 0; i < cloud.size(); ++i) {
    const DensePoint& point = cloud[i];
    if (point.normal_world.dot(grid.normal) < kMinFacing) continue;
    const double before_m = grid.DistanceTo(point.p_world), offset_m = std::abs(before_m);
    if (before_m < -kLeastBehind_m && before_m > -kMostBehind_m) {
      behind.push_back(Along(grid, point.p_world));
    }
    if (offset_m > beside_m) continue;
    beside_.push_back(i);
    places_.push_back(Along(grid, point.p_world));
    const bool is_in = offset_m <= kFilledMaxOffset_m;
    (is_in ? in_plane_ : off_plane).push_back(Along(grid, point.p_world));
    grey_ += is_in ? point.grey : 0;
  }
  grey_ /= static_cast<double>(std::max<size_t>(in_plane_.size(), 1));
  for (const MapLine& line : lines) AddBorderPlaces(grid, line, kFilledMaxOffset_m, &in_plane_);
  places_tree_ = std::make_unique<PointTree>(places_);
  in_plane_tree_ = std::make_unique<PointTree>(in_plane_);
  off_plane_tree_ = std::make_unique<PointTree>(off_plane);
  behind_tree_ = std::make_unique<PointTree>(behind);
}

std::optional<SurfaceAround> MeasuredAround::At(double column, double row) const {
  if (std::ssize(beside_) < kNeighbours) return std::nullopt;
  PointTree::Found near;
  places_tree_->FindNearest(Along(grid_, grid_.At(column, row)), kNeighbours, &near);
  const std::vector<int>& found = near.items;
  std::vector<double> offsets_m;
  for (const int i : found) {
    offsets_m.push_back(grid_.DistanceTo(cloud_[beside_[i]].p_world));
  }
  const double median_m = Quantile(offsets_m, 0.5);
  SurfaceAround around;
  int agreeing = 0;
  for (size_t i = 0; i < found.size(); ++i) {
    if (std::abs(offsets_m[i] - median_m) > kAgree_m) continue;
    around.offset_m += offsets_m[i];
    around.grey += cloud_[beside_[found[i]]].grey;
    ++agreeing;
  }
  if (agreeing < kMinShare * kNeighbours) return std::nullopt;
  around.nearest = places_[found.front()].head<2>().cast<double>() / grid_.cell_m;
  around.nearest_m = std::sqrt(static_cast<double>(near.squared_m2.front()));
  around.offset_m /= agreeing;
  around.grey /= agreeing;
  return around;
}

std::optional<SurfaceAround> MeasuredAround::OnPlane(double column, double row) const {
  const Eigen::Vector3f place = Along(grid_, grid_.At(column, row));
  PointTree::Found found, elsewhere;
  const auto nearest_m = Nearest_m(*in_plane_tree_, place, &found);
  if (!nearest_m) return std::nullopt;
  const auto other_m = Nearest_m(*off_plane_tree_, place, &elsewhere);
  if (other_m && *other_m < kBlankClear_m) return std::nullopt;
  const auto behind_m = Nearest_m(*behind_tree_, place, &elsewhere);
  if (behind_m && *behind_m < *nearest_m) return std::nullopt;
  SurfaceAround around;
  around.nearest = in_plane_[found.items.front()].head<2>().cast<double>() / grid_.cell_m;
  around.nearest_m = *nearest_m;
  around.grey = grey_;
  return around;
}

}  // namespace slcmap::mapping
