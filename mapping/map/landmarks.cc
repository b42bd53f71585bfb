#include "mapping/map/landmarks.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <tuple>
#include <unordered_map>
#include <utility>

#include "data/io/file.h"
#include "mapping/map/point_index.h"
#include "odometry/factors/calibration_estimate.h"
#include "odometry/factors/factor.h"
#include "odometry/factors/point_residual.h"
#include "odometry/geometry/pinhole.h"
#include "odometry/run/run_queries.h"
#include "odometry/run/run_rows.h"

namespace slcmap::inline mapping {
namespace {

// Landmarks seen from far apart can be more certain than their model deserves.
constexpr double kMinSigma_m = 1e-3;
constexpr double kMaxDistance_m = 1e7;  // of a landmark from the origin; the Earth's radius is less
constexpr std::size_t kReportEvery = 1024;

using VoxelIndex = std::array<int64_t, 3>;

VoxelIndex FindVoxel(const Eigen::Vector3d& p_world, double voxel_m) {
  const auto index = [&](double coordinate) {
    return static_cast<int64_t>(std::floor(coordinate / voxel_m));
  };
  return {index(p_world.x()), index(p_world.y()), index(p_world.z())};
}

MapPoint Fuse(const std::vector<const Landmark*>& landmarks) {
  MapPoint point;
  double weight_sum = 0;
  for (const Landmark* landmark : landmarks) {
    const double sigma_m = std::max(landmark->sigma_m, kMinSigma_m);
    const double weight = 1 / (sigma_m * sigma_m);
    point.p_world += weight * landmark->p_world;
    point.observations += landmark->observations;
    point.landmark_ids.push_back(landmark->id);
    weight_sum += weight;
  }
  point.p_world /= weight_sum;
  point.sigma_m = 1 / std::sqrt(weight_sum);
  return point;
}

double Share(std::size_t done, std::size_t all) {
  return static_cast<double>(done) / static_cast<double>(all);
}

// The mean distance of each point to its `count` nearest neighbours; of the first ones only, once
// progress says so. Not PCL's own filter, which cannot be ended early.
std::vector<float> NeighbourDistances(const std::vector<MapPoint>& points, int count,
                                      const Progress& progress) {
  std::vector<Eigen::Vector3f> places;
  for (const MapPoint& point : points) places.push_back(point.p_world.cast<float>());
  const PointTree tree(places);
  std::vector<float> distances_m;
  PointTree::Found found;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (i % kReportEvery == 0 && !progress.Report(Share(i, points.size()))) break;
    tree.FindNearest(places[i], count + 1, &found);  // the first is itself
    double sum_m = 0;
    for (std::size_t k = 1; k < found.squared_m2.size(); ++k) {
      sum_m += std::sqrt(found.squared_m2[k]);
    }
    distances_m.push_back(static_cast<float>(sum_m / count));
  }
  return distances_m;
}

// `sigmas` standard deviations above the mean.
double OutlierLimit(const std::vector<float>& distances_m, double sigmas) {
  double sum = 0, squared_sum = 0;
  for (const double distance_m : distances_m) {
    sum += distance_m;
    squared_sum += distance_m * distance_m;
  }
  const double count = static_cast<double>(distances_m.size());
  const double variance = (squared_sum - sum * sum / count) / (count - 1);
  return sum / count + sigmas * std::sqrt(std::max(variance, 0.0));
}

}  // namespace

std::vector<Landmark> SelectLandmarks(const std::vector<Landmark>& landmarks,
                                      const CloudOptions& options) {
  std::vector<Landmark> selected;
  std::copy_if(landmarks.begin(), landmarks.end(), std::back_inserter(selected),
               [&](const Landmark& landmark) {
                 return landmark.p_world.norm() <= kMaxDistance_m &&
                        landmark.sigma_m <= options.max_sigma_m &&
                        landmark.observations >= options.min_observations;
               });
  return selected;
}

std::vector<MapPoint> FuseLandmarks(const std::vector<Landmark>& landmarks,
                                    const CloudOptions& options, const Progress& progress) {
  std::map<std::pair<int, VoxelIndex>, std::vector<const Landmark*>> voxels;
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    if (i % kReportEvery == 0 && !progress.Report(Share(i, landmarks.size()))) break;
    const Landmark& landmark = landmarks[i];
    voxels[{landmark.segment, FindVoxel(landmark.p_world, options.voxel_m)}].push_back(&landmark);
  }
  std::vector<MapPoint> points;
  for (const auto& [index, members] : voxels) points.push_back(Fuse(members));
  return points;
}

std::vector<MapPoint> RemoveOutliers(std::vector<MapPoint> points, const CloudOptions& options,
                                     const Progress& progress) {
  if (points.size() <= static_cast<std::size_t>(options.outlier_neighbours)) return points;
  const std::vector<float> distances_m =
      NeighbourDistances(points, options.outlier_neighbours, progress);
  if (distances_m.size() < points.size()) return points;
  const double limit_m = OutlierLimit(distances_m, options.outlier_sigmas);
  std::vector<MapPoint> inliers;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (distances_m[i] <= limit_m) inliers.push_back(std::move(points[i]));
  }
  return inliers;
}

// Written without PCL's own writer, which refuses clouds without points and brings in all of VTK.
void WritePcd(const std::string& path, const std::vector<MapPoint>& points) {
  std::string bytes = fmt::format(
      "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\n"
      "FIELDS x y z sigma_m observations line_id\nSIZE 4 4 4 4 4 4\nTYPE F F F F I I\n"
      "COUNT 1 1 1 1 1 1\n"
      "WIDTH {0}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {0}\nDATA binary\n",
      points.size());
  for (const MapPoint& point : points) {
    for (const double value : point.p_world) AppendBytes(static_cast<float>(value), &bytes);
    AppendBytes(static_cast<float>(point.sigma_m), &bytes);
    AppendBytes(static_cast<int32_t>(point.observations), &bytes);
    AppendBytes(static_cast<int32_t>(point.line_id), &bytes);
  }
  WriteFile(path, bytes);
}

namespace {

using Eigen::Vector3d;

constexpr double kMost_m = 0.04, kSigmas = 3;
constexpr double kLeastOff_m = 0.002;  // of anything that images tell

double DistanceTo(const MapLine& line, const Vector3d& p) {
  const Vector3d way = line.end_world - line.start_world;
  const double squared_m2 = way.squaredNorm();
  const double share =
      squared_m2 > 0 ? std::clamp(way.dot(p - line.start_world) / squared_m2, 0.0, 1.0) : 0;
  return (line.start_world + share * way - p).norm();
}

double Reach(const MapLine& line, const MapPoint& point) {
  return std::min(kMost_m, kSigmas * std::hypot(line.sigma_m, point.sigma_m, kLeastOff_m));
}

}  // namespace

void FindLinesOfPoints(const std::vector<MapLine>& lines, std::vector<MapPoint>* points) {
  constexpr double kStep_m = 0.05;
  const double near_m = std::hypot(kMost_m, kStep_m / 2);  // of the nearest step
  PointIndex index(near_m);
  for (size_t i = 0; i < points->size(); ++i) {
    (*points)[i].line_id = -1;
    index.Add((*points)[i].p_world, i);
  }
  std::vector<double> nearest_m(points->size(), std::numeric_limits<double>::infinity());
  for (const MapLine& line : lines) {
    const Vector3d way = line.end_world - line.start_world;
    const int steps = 1 + static_cast<int>(way.norm() / kStep_m);
    for (int step = 0; step <= steps; ++step) {
      index.AnyNear(line.start_world + step * way / steps, near_m, [&](size_t i) {
        MapPoint& point = (*points)[i];
        const double distance_m = DistanceTo(line, point.p_world);
        if (distance_m <= Reach(line, point) && distance_m < nearest_m[i]) {
          nearest_m[i] = distance_m;
          point.line_id = line.id;
        }
        return false;  // on to the next
      });
    }
  }
}

namespace {

using Eigen::Vector2d;

// Brings a pixel of the run's images, which were rectified as its cameras were given, into those of
// another rig, by what the run has found of its cameras.
class PixelsOfRun {
 public:
  PixelsOfRun(const OdometryRun& run, const Rig& rig)
      : from_(run.rectified_rig), to_(rig), geometry_(run.rectified_rig.T_imu_camera, 1) {
    if (run.calibration.empty() || !run.source) return;
    geometry_.lens_shifts = std::make_shared<const std::vector<LensShift>>(
        ComputeLensShifts(run.source->raw_rig, run.rectified_rig));
    const CalibrationEstimate& found = run.calibration.back();
    const CameraCalibrationBlock block = MakeCameraBlock(found);
    geometry_ = geometry_.CorrectedBy(block.data());
  }

  Vector2d Moved(int camera, const Vector2d& px) const {
    const Vector2d true_plane =
        geometry_.OnTruePlane(camera, PlaneFromPixel(from_.cameras[camera], px));
    const Eigen::Vector3d ray =
        to_.T_imu_camera[camera].rotation.conjugate() *
        (geometry_.T_imu_camera[camera].rotation * true_plane.homogeneous());
    return PixelFromPlane(to_.cameras[camera], Vector2d(ray.hnormalized()));
  }

 private:
  const Rig &from_, &to_;
  StereoGeometry geometry_;
};

// The point that a landmark went into, and which of its tracks it is.
struct Track {
  int64_t point;
  int number;
};

std::unordered_map<int64_t, Track> IndexTracks(const std::vector<MapPoint>& points) {
  std::unordered_map<int64_t, Track> tracks;
  for (std::size_t i = 0; i < points.size(); ++i) {
    int number = 0;
    for (const int64_t id : points[i].landmark_ids) {
      tracks[id] = {static_cast<int64_t>(i), number++};
    }
  }
  return tracks;
}

// What files take for one.
bool IsPixel(const Vector2d& px) {
  return std::abs(px.x()) <= kMaxPixel && std::abs(px.y()) <= kMaxPixel;
}

// Of landmarks that no keyframe says it saw there is no track.
void NumberTracks(std::vector<MapPointObservation>* observations) {
  int64_t point = -1;
  int landmark = -1, track = -1;
  for (MapPointObservation& seen : *observations) {
    if (seen.point != point) track = -1;
    if (seen.point != point || seen.track != landmark) ++track;
    point = seen.point;
    landmark = std::exchange(seen.track, track);
  }
}

}  // namespace

std::vector<MapPointObservation> CollectObservations(const std::vector<MapPoint>& points,
                                                     const OdometryRun& run, const Rig& rig) {
  const PixelsOfRun pixels(run, rig);
  const std::unordered_map<int64_t, Track> tracks = IndexTracks(points);
  std::vector<MapPointObservation> observations;
  for (const Keyframe& keyframe : run.keyframes) {
    for (const KeyframeObservation& seen : keyframe.observations) {
      const auto track = tracks.find(seen.landmark_id);
      if (track == tracks.end()) continue;
      const auto add = [&](int camera, const Vector2d& px) {
        const Vector2d moved_px = pixels.Moved(camera, px);
        if (!IsPixel(moved_px)) return;
        observations.push_back(
            {track->second.point, track->second.number, keyframe.stamp_ns, camera, moved_px});
      };
      add(seen.camera, seen.left_px);
      if (seen.right_px) add(seen.camera + 1, *seen.right_px);
    }
  }
  std::ranges::sort(observations, {},
                    [](const MapPointObservation& seen) { return MakeKey(seen); });
  NumberTracks(&observations);
  return observations;
}

namespace {

constexpr double kMostTurn_rad = 1;  // larger standard deviations of a direction say nothing of it

// Whether the run knows how well it knows a line; of the direction of one without an axis it says
// nothing.
bool HasCovariance(const Line& line) {
  return line.axis != LineAxis::kNone && line.deviation_sigma_rad < kMostTurn_rad &&
         line.covariance_m2.diagonal().minCoeff() >= 0;
}

LineCovariance ComputeCovariance(const Line& line) {
  const Eigen::Vector3d half = 0.5 * (line.end_world - line.start_world);
  const Eigen::Vector3d along = half.normalized();
  const double turn_m = half.norm() * line.deviation_sigma_rad;  // what turning moves an end by
  const Eigen::Matrix3d turn_m2 =
      turn_m * turn_m * (Eigen::Matrix3d::Identity() - along * along.transpose());
  const Eigen::Matrix3d end_m2 = line.covariance_m2 + turn_m2;
  return {line.id, 0, end_m2, end_m2, line.covariance_m2 - turn_m2};
}

void AddSupports(const Keyframe& keyframe, const LineObservation& seen,
                 std::vector<LineSupport>* supports) {
  supports->push_back({seen.id, 0, keyframe.stamp_ns, seen.camera, seen.left_px});
  if (!seen.right_px) return;
  supports->push_back({seen.id, 0, keyframe.stamp_ns, seen.camera + 1, *seen.right_px});
}

}  // namespace

std::vector<MapLine> SelectLines(const OdometryRun& run, const RunLineOptions& options) {
  std::vector<MapLine> selected;
  for (const MapLine& line : MapLines(run)) {
    // Comparisons with a value that is not finite fail.
    const bool has_extent = (line.end_world - line.start_world).squaredNorm() > 0;
    if (has_extent && line.sigma_m <= options.max_sigma_m &&
        line.observations >= options.min_observations) {
      selected.push_back(line);
    }
  }
  return selected;
}

LineEvidence CollectEvidence(const std::vector<MapLine>& lines, const OdometryRun& run) {
  std::map<int64_t, const Line*> of_run;
  for (const Line& line : run.lines) of_run[line.id] = &line;
  LineEvidence evidence;
  std::map<int64_t, const Line*> chosen;
  for (const MapLine& line : lines) chosen.insert(*of_run.find(line.id));
  for (const auto& [id, line] : chosen) {
    if (HasCovariance(*line)) evidence.covariances.push_back(ComputeCovariance(*line));
  }
  for (const Keyframe& keyframe : run.keyframes) {
    for (const LineObservation& seen : keyframe.lines) {
      if (chosen.contains(seen.id)) AddSupports(keyframe, seen, &evidence.supports);
    }
  }
  std::ranges::sort(evidence.supports, {}, [](const LineSupport& support) {
    return std::tuple(support.line_id, support.stamp_ns, support.camera);
  });
  return evidence;
}

}  // namespace slcmap::mapping
