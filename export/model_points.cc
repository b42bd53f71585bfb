#include "export/model_points.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "odometry/geometry/pinhole.h"

namespace slcmap {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Matrix23d = Eigen::Matrix<double, 2, 3>;

constexpr double kMaxError_px = 4;  // as COLMAP's own filter has it
constexpr double kLoss_px = 1;      // beyond it a sight counts less (Huber)
constexpr double kLeastDepth_m = 0.05;
constexpr int kIterations = 10;
constexpr std::size_t kLeastImages = 2;

// Cameras of the model's images.
class ModelCameras {
 public:
  ModelCameras(const Rig& rig, const std::vector<ModelImage>& images) : rig_(rig), images_(images) {
    for (std::size_t i = 0; i < images.size(); ++i) {
      places_[{images[i].stamp_ns, images[i].camera}] = i;
    }
  }

  // The place of an image among the model's; its end where it is none of them.
  std::size_t PlaceOf(int64_t stamp_ns, int camera) const {
    const auto found = places_.find({stamp_ns, camera});
    return found == places_.end() ? images_.size() : found->second;
  }
  std::size_t size() const { return images_.size(); }

  Vector3d InCamera(std::size_t image, const Vector3d& p_world) const {
    return images_[image].T_camera_world * p_world;
  }
  Vector2d ProjectToPixel(std::size_t image, const Vector3d& p_camera) const {
    return PixelFromPlane(rig_.cameras[images_[image].camera], Vector2d(p_camera.hnormalized()));
  }
  // Of the pixel by p_world.
  Matrix23d PixelByPoint(std::size_t image, const Vector3d& p_camera) const {
    const Camera& camera = rig_.cameras[images_[image].camera];
    const double z = p_camera.z();
    Matrix23d by_camera;
    by_camera << camera.fx_px / z, 0, -camera.fx_px * p_camera.x() / (z * z), 0, camera.fy_px / z,
        -camera.fy_px * p_camera.y() / (z * z);
    return by_camera * images_[image].T_camera_world.rotation.toRotationMatrix();
  }

  // How far a sight is from where the point is seen; far where that is behind the camera.
  double Error_px(const ModelSight& sight, const Vector3d& p_world) const {
    const Vector3d p_camera = InCamera(sight.image, p_world);
    if (p_camera.z() < kLeastDepth_m) return 1e3;
    return (ProjectToPixel(sight.image, p_camera) - sight.px).norm();
  }

 private:
  const Rig& rig_;
  const std::vector<ModelImage>& images_;
  std::map<std::pair<int64_t, int>, std::size_t> places_;  // by stamp and camera
};

double HuberCost(double error_px) {
  return error_px <= kLoss_px ? 0.5 * error_px * error_px : kLoss_px * (error_px - 0.5 * kLoss_px);
}

double CostOf(const ModelCameras& cameras, const std::vector<ModelSight>& track,
              const Vector3d& p_world) {
  double cost = 0;
  for (const ModelSight& sight : track) cost += HuberCost(cameras.Error_px(sight, p_world));
  return cost;
}

// A step of Gauss and Newton towards the least cost.
Vector3d StepFrom(const ModelCameras& cameras, const std::vector<ModelSight>& track,
                  const Vector3d& p_world) {
  Matrix3d information = Matrix3d::Zero();
  Vector3d gradient = Vector3d::Zero();
  for (const ModelSight& sight : track) {
    const Vector3d p_camera = cameras.InCamera(sight.image, p_world);
    if (p_camera.z() < kLeastDepth_m) continue;
    const Vector2d off_px = cameras.ProjectToPixel(sight.image, p_camera) - sight.px;
    const Matrix23d J = cameras.PixelByPoint(sight.image, p_camera);
    const double weight = kLoss_px / std::max(kLoss_px, off_px.norm());
    information += weight * J.transpose() * J;
    gradient += weight * J.transpose() * off_px;
  }
  information.diagonal() *= 1 + 1e-6;  // a point that nearly all directions fit stays where it is
  return -information.ldlt().solve(gradient);
}

// Where the sights of a track see a point best, from where it is about.
Vector3d PointOf(const ModelCameras& cameras, const std::vector<ModelSight>& track,
                 Vector3d p_world) {
  double cost = CostOf(cameras, track, p_world);
  for (int i = 0; i < kIterations; ++i) {
    const Vector3d next = p_world + StepFrom(cameras, track, p_world);
    if (!next.allFinite()) break;
    const double next_cost = CostOf(cameras, track, next);
    if (!(next_cost < cost)) break;
    const bool is_done = cost - next_cost < 1e-9 * cost;
    p_world = next;
    cost = next_cost;
    if (is_done) break;
  }
  return p_world;
}

// The point of a track; without sights where too few agree.
ModelPoint FitTrack(const ModelCameras& cameras, std::vector<ModelSight> track,
                    const Vector3d& p_world) {
  ModelPoint point;
  point.p_world = PointOf(cameras, track, p_world);
  const auto is_off = [&](const ModelSight& sight) {
    return cameras.Error_px(sight, point.p_world) > kMaxError_px;
  };
  while (std::erase_if(track, is_off) > 0) point.p_world = PointOf(cameras, track, point.p_world);
  if (track.size() < kLeastImages) return point;
  double sum_px = 0;
  for (const ModelSight& sight : track) sum_px += cameras.Error_px(sight, point.p_world);
  point.error_px = sum_px / static_cast<double>(track.size());
  point.track = std::move(track);
  return point;
}

}  // namespace

std::vector<ModelPoint> ModelPoints(const MapResult& map, const std::vector<ModelImage>& images) {
  const ModelCameras cameras(map.rectified_rig, images);
  std::vector<ModelPoint> points;
  auto seen = map.point_observations.begin();
  const auto end = map.point_observations.end();
  for (std::size_t i = 0; i < map.points.size(); ++i) {
    const std::size_t before = points.size();
    const auto is_seen = [&] { return seen != end && seen->point == static_cast<int64_t>(i); };
    while (is_seen()) {
      std::vector<ModelSight> track;
      for (const int number = seen->track; is_seen() && seen->track == number; ++seen) {
        const std::size_t image = cameras.PlaceOf(seen->stamp_ns, seen->camera);
        if (image < cameras.size()) track.push_back({image, seen->px});
      }
      ModelPoint point = FitTrack(cameras, std::move(track), map.points[i].p_world);
      if (!point.track.empty()) points.push_back(std::move(point));
    }
    if (points.size() == before) points.push_back({map.points[i].p_world, -1, {}});
  }
  return points;
}

}  // namespace slcmap
