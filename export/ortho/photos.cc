#include "export/ortho/photos.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <queue>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "data/core/parallel.h"
#include "export/scene/plane_canvas.h"
#include "mapping/map/point_index.h"

namespace slcmap::inline exporting {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kDepthStep_px = 8;  // of the rectified image to one of the depth
constexpr double kNearest_m = 0.1;
constexpr double kPoint_m = 0.06;    // edge of the cubes that dense points are thinned to
constexpr double kOnPlane_m = 0.06;  // nearer points are the plane's
constexpr double kMostDepth_m = 8;   // beyond it points hide little
constexpr double kCube_m = 2;        // that points are sought by

// Of the middle of a pixel of the depth, at depth 1.
Vector3d MakeRay(const Camera& rectified, int u, int v) {
  const double middle_px = 0.5 * (kDepthStep_px - 1);
  return {(u * kDepthStep_px + middle_px - rectified.cx_px) / rectified.fx_px,
          (v * kDepthStep_px + middle_px - rectified.cy_px) / rectified.fy_px, 1};
}

// A plane that hides what is behind it.
struct Blocker {
  const BuildingPlane* plane = nullptr;
  Canvas canvas;
  std::vector<Polygon> area;
  Eigen::AlignedBox2d box;

  bool Covers(const Vector3d& p) const {
    const Vector2d at = canvas.Of(p);
    return box.contains(at) &&
           std::ranges::any_of(area, [&](const Polygon& polygon) { return Contains(polygon, at); });
  }
};

std::vector<Blocker> ListBlockers(const Building& building) {
  std::vector<Blocker> blockers;
  for (const BuildingPlane& plane : building.planes) {
    if (plane.inferred || plane.kind == PlaneKind::kOther) continue;
    Blocker blocker{&plane, MakeFront(plane), {}, {}};
    blocker.area = AreaOn(blocker.canvas, plane, building);
    for (const Polygon& polygon : blocker.area) {
      for (const Vector2d& p : polygon.outline) blocker.box.extend(p);
    }
    blockers.push_back(std::move(blocker));
  }
  return blockers;
}

bool IsOnPlane(const Vector3d& p, const std::vector<Blocker>& blockers) {
  return std::ranges::any_of(blockers, [&](const Blocker& blocker) {
    if (std::abs(blocker.plane->normal.dot(p) - blocker.plane->offset_m) > kOnPlane_m) return false;
    return blocker.box.exteriorDistance(blocker.canvas.Of(p)) < kOnPlane_m;
  });
}

// What stands in the rooms: thinned points that are on no plane, by cubes. Those without another
// beside them are noise.
using Furniture = std::unordered_map<int64_t, std::vector<Vector3d>>;

Furniture FindFurniture(const MapResult& map, const std::vector<Blocker>& blockers) {
  std::unordered_set<int64_t> taken;
  std::vector<Vector3d> points;
  for (const DensePoint& point : map.dense) {
    if (!taken.insert(MakeKey(FindCube(point.p_world, kPoint_m))).second) continue;
    if (!IsOnPlane(point.p_world, blockers)) points.push_back(point.p_world);
  }
  Furniture furniture;
  for (const Vector3d& p : points) {
    const Eigen::Vector3i cube = FindCube(p, kPoint_m);
    int beside = -1;
    for (int i = 0; i < kCubesAround; ++i) beside += taken.contains(MakeKey(CubeAround(cube, i)));
    if (beside > 0) furniture[MakeKey(FindCube(p, kCube_m))].push_back(p);
  }
  return furniture;
}

// Draws what a photo's camera sees into its depth.
class DepthPainter {
 public:
  DepthPainter(const Camera& camera, Photo* photo)
      : camera_(camera),
        photo_(photo),
        T_world_camera_(photo->T_camera_world.Inverse()),
        depth_((camera.height_px + kDepthStep_px - 1) / kDepthStep_px,
               (camera.width_px + kDepthStep_px - 1) / kDepthStep_px, CV_32FC1,
               cv::Scalar(std::numeric_limits<float>::infinity())) {}

  void AddPlanes(const std::vector<Blocker>& blockers) {
    for (int v = 0; v < depth_.rows; ++v) {
      for (int u = 0; u < depth_.cols; ++u) AddPlanesAt(u, v, blockers);
    }
  }

  void AddFurniture(const Furniture& furniture) {
    const Eigen::Vector3i middle = FindCube(T_world_camera_.translation, kCube_m);
    const int reach = static_cast<int>(std::ceil(kMostDepth_m / kCube_m));
    for (int x = -reach; x <= reach; ++x) {
      for (int y = -reach; y <= reach; ++y) {
        for (int z = -reach; z <= reach; ++z) {
          const auto found = furniture.find(MakeKey(middle + Eigen::Vector3i(x, y, z)));
          if (found == furniture.end()) continue;
          for (const Vector3d& p : found->second) AddPoint(photo_->T_camera_world * p);
        }
      }
    }
  }

  void Finish() { photo_->depth_m = depth_; }

 private:
  void AddPlanesAt(int u, int v, const std::vector<Blocker>& blockers) {
    const Vector3d ray = T_world_camera_.rotation * MakeRay(camera_, u, v);
    const Vector3d& centre = T_world_camera_.translation;
    float& depth_m = depth_.at<float>(v, u);
    for (const Blocker& blocker : blockers) {
      const double along = blocker.plane->normal.dot(ray);
      if (std::abs(along) < 1e-6) continue;
      const double at_m = (blocker.plane->offset_m - blocker.plane->normal.dot(centre)) / along;
      if (at_m < kNearest_m || at_m >= depth_m || !blocker.Covers(centre + at_m * ray)) continue;
      depth_m = static_cast<float>(at_m);
    }
  }

  // As large as its cube, and at least a pixel more on all sides.
  void AddPoint(const Vector3d& p_camera) {
    if (p_camera.z() < kNearest_m || p_camera.z() > kMostDepth_m) return;
    const auto pixel_px = camera_.Project(p_camera);
    if (!pixel_px || !camera_.Contains(*pixel_px)) return;
    const int reach =
        static_cast<int>(std::ceil(0.5 * kPoint_m * camera_.fx_px / p_camera.z() / kDepthStep_px));
    const int u = static_cast<int>(pixel_px->x()) / kDepthStep_px;
    const int v = static_cast<int>(pixel_px->y()) / kDepthStep_px;
    const cv::Rect all(0, 0, depth_.cols, depth_.rows);
    cv::Mat part = depth_(cv::Rect(u - reach, v - reach, 2 * reach + 1, 2 * reach + 1) & all);
    part = cv::min(part, p_camera.z());
  }

  const Camera& camera_;
  Photo* photo_;
  const RigidTransform T_world_camera_;
  cv::Mat depth_;
};

// How fast the rig was at a stamp: from the pose before to that after it.
void SetMotion(const Trajectory& trajectory, Photo* photo) {
  const auto at = std::lower_bound(
      trajectory.begin(), trajectory.end(), photo->stamp_ns,
      [](const StampedPose& pose, int64_t stamp_ns) { return pose.stamp_ns < stamp_ns; });
  if (at == trajectory.begin() || at == trajectory.end()) return;
  const StampedPose& before = *std::prev(at);
  const StampedPose& after = std::next(at) == trajectory.end() ? *at : *std::next(at);
  constexpr double kMostGap_s = 0.5;  // longer ones tell nothing of the moment
  const double between_s = ToSeconds(after.stamp_ns - before.stamp_ns);
  if (between_s <= 0 || between_s > kMostGap_s) return;
  const RigidTransform step = before.T_world_imu.Inverse() * after.T_world_imu;
  photo->speed_m_s = step.translation.norm() / between_s;
  photo->turn_rad_s = LogRotation(step.rotation).norm() / between_s;
}

}  // namespace

std::vector<Photo> TakePhotos(const MapResult& map, const RecordedImages& images,
                              const Progress& progress) {
  std::vector<Photo> photos;
  for (const StampedPose& pose : map.keyframes) {
    Photo photo;
    photo.stamp_ns = pose.stamp_ns;
    photo.recording = images.FindRecordingAt(pose.stamp_ns);
    if (photo.recording == images.size()) continue;
    photo.T_camera_world = (pose.T_world_imu * map.rectified_rig.T_imu_camera[0]).Inverse();
    SetMotion(map.trajectory, &photo);
    photos.push_back(photo);
  }
  const std::vector<Blocker> blockers = ListBlockers(map.building);
  const Furniture furniture = FindFurniture(map, blockers);
  const auto paint = [&](std::size_t i) {
    DepthPainter painter(map.rectified_rig.cameras[0], &photos[i]);
    painter.AddPlanes(blockers);
    painter.AddFurniture(furniture);
    painter.Finish();
  };
  if (!ForEachWatched(photos.size(), progress, paint)) throw StoppedError("interrupted");
  return photos;
}

namespace {

// How far before a plane that is which a photo shows at a pixel of its rectified camera, in metres.
// Where it shows nothing that is known, far behind.
double HeightBefore(const BuildingPlane& plane, const Photo& photo, const Camera& rectified,
                    const Vector2d& pixel_px) {
  const int u =
      std::clamp(static_cast<int>(pixel_px.x()) / kDepthStep_px, 0, photo.depth_m.cols - 1);
  const int v =
      std::clamp(static_cast<int>(pixel_px.y()) / kDepthStep_px, 0, photo.depth_m.rows - 1);
  const double depth_m = photo.depth_m.at<float>(v, u);
  if (!std::isfinite(depth_m)) return -INFINITY;
  const Vector3d p = photo.T_camera_world.Inverse() * (depth_m * MakeRay(rectified, u, v));
  return plane.normal.dot(p) - plane.offset_m;
}

constexpr double kCell_m = 0.05;
constexpr double kMostFaceCells = 60000;  // of a face
constexpr double kMostDistance_m = 8;
constexpr double kLeastCosine = 0.17;    // 80 degrees from straight on
constexpr double kHides_m = 0.08;        // what stands farther before the face hides it
constexpr double kSeenThrough_m = 0.25;  // what is farther behind shows that there is no surface
constexpr double kBorder_px = 12;        // of images, that is not used
constexpr double kExposure_s = 0.005;    // of an image indoors
constexpr double kBetter = 1.25;         // that a photo has to be, to take a cell from another
constexpr double kLeastGain = 0.002;     // of all photos' quality, that is worth another photo
constexpr std::size_t kMostPhotos = 120;

FaceCells MakeCells(const OrthoFace& face) {
  const double area_m2 = face.box.volume();
  const double cell_m = std::max(kCell_m, std::sqrt(area_m2 / kMostFaceCells));
  FaceCells cells;
  cells.step_px = std::max(1, static_cast<int>(std::lround(cell_m / face.pixel_m)));
  cells.size = {(face.size.width + cells.step_px - 1) / cells.step_px,
                (face.size.height + cells.step_px - 1) / cells.step_px};
  return cells;
}

// The part of a face that a photo may see, judged cell by cell.
class PhotoJudge {
 public:
  PhotoJudge(const OrthoFace& face, const Photo& photo, const Camera& rectified)
      : face_(face), photo_(photo), camera_(rectified), centre_(photo.Centre()) {}

  bool IsBefore() const {
    const double height_m = face_.plane->normal.dot(centre_) - face_.plane->offset_m;
    if (height_m < kHides_m || height_m > kMostDistance_m) return false;
    return face_.box.exteriorDistance(face_.canvas.Of(centre_)) < kMostDistance_m;
  }

  float QualityAt(const Vector3d& p) const {
    const Vector3d way = centre_ - p;
    const double distance_m = way.norm();
    const double cosine = way.dot(face_.plane->normal) / distance_m;
    if (distance_m > kMostDistance_m || cosine < kLeastCosine) return 0;
    const auto pixel_px = camera_.Project(photo_.T_camera_world * p);
    if (!pixel_px || !camera_.Contains(*pixel_px, kBorder_px)) return 0;
    const double height_m = HeightBefore(*face_.plane, photo_, camera_, *pixel_px);
    if (height_m > kHides_m || height_m < -kSeenThrough_m) return 0;
    const double fine_px_m = camera_.fx_px / distance_m * cosine;
    const double blur_px =
        camera_.fx_px * kExposure_s * (photo_.speed_m_s / distance_m + photo_.turn_rad_s);
    const double sharp_px_m = fine_px_m / std::sqrt(1 + blur_px * blur_px);
    return static_cast<float>(sharp_px_m / (sharp_px_m + 1 / face_.pixel_m));
  }

 private:
  const OrthoFace& face_;
  const Photo& photo_;
  const Camera& camera_;
  const Vector3d centre_;
};

cv::Mat JudgePhoto(const OrthoFace& face, const FaceCells& cells, const Photo& photo,
                   const Camera& rectified) {
  const PhotoJudge judge(face, photo, rectified);
  if (!judge.IsBefore()) return {};
  cv::Mat quality(cells.size, CV_32FC1);
  const double middle_px = 0.5 * (cells.step_px - 1);
  for (int row = 0; row < quality.rows; ++row) {
    for (int column = 0; column < quality.cols; ++column) {
      quality.at<float>(row, column) = judge.QualityAt(
          face.At(column * cells.step_px + middle_px, row * cells.step_px + middle_px));
    }
  }
  return cv::countNonZero(quality) > 0 ? quality : cv::Mat();
}

// What a photo adds to what is there, over all cells.
double Gain(const cv::Mat& quality, const cv::Mat& best) {
  return cv::sum(cv::max(quality - best, 0))[0];
}

// The photos that add most, one after the other. What one adds never grows, so that only those that
// seemed to add most have to be looked at again.
std::vector<ChosenPhoto> TakeBest(const std::vector<ChosenPhoto>& seen, const cv::Size& size) {
  cv::Mat best(size, CV_32FC1, cv::Scalar(0)), all = best.clone();
  std::priority_queue<std::pair<double, std::ptrdiff_t>> queue;  // of equal ones the first
  for (std::size_t i = 0; i < seen.size(); ++i) {
    cv::max(all, seen[i].quality, all);
    queue.emplace(Gain(seen[i].quality, best), -static_cast<std::ptrdiff_t>(i));
  }
  const double enough = kLeastGain * cv::sum(all)[0];
  std::vector<ChosenPhoto> chosen;
  while (!queue.empty() && chosen.size() < kMostPhotos) {
    const std::ptrdiff_t i = queue.top().second;
    queue.pop();
    const ChosenPhoto& photo = seen[static_cast<std::size_t>(-i)];
    const double gain = Gain(photo.quality, kBetter * best);
    if (!queue.empty() && gain < queue.top().first) {
      if (gain > enough) queue.emplace(gain, i);
      continue;
    }
    if (gain <= enough) break;
    chosen.push_back(photo);
    cv::max(best, photo.quality, best);
  }
  return chosen;
}

cv::Mat LabelCells(const std::vector<ChosenPhoto>& photos, const cv::Size& size) {
  cv::Mat labels(size, CV_32SC1, cv::Scalar(-1)), best(size, CV_32FC1, cv::Scalar(0));
  for (std::size_t i = 0; i < photos.size(); ++i) {
    const cv::Mat is_better = photos[i].quality > kBetter * best;
    labels.setTo(static_cast<int>(i), is_better);
    photos[i].quality.copyTo(best, is_better);
  }
  return labels;
}

}  // namespace

PhotoChoice ChoosePhotos(const OrthoFace& face, const std::vector<Photo>& photos,
                         const Camera& rectified) {
  PhotoChoice choice;
  choice.cells = MakeCells(face);
  std::vector<ChosenPhoto> seen;
  for (std::size_t i = 0; i < photos.size(); ++i) {
    const cv::Mat quality = JudgePhoto(face, choice.cells, photos[i], rectified);
    if (!quality.empty()) seen.push_back({i, quality});
  }
  choice.photos = TakeBest(seen, choice.cells.size);
  choice.labels = LabelCells(choice.photos, choice.cells.size);
  return choice;
}

}  // namespace slcmap::exporting
