#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "apps/evaluation/map_metrics.h"
#include "apps/evaluation/report.h"
#include "data/calibration/calibration.h"
#include "data/io/ply.h"
#include "mapping/map/point_index.h"

namespace slcmap::inline evaluation {
namespace {

constexpr double kCell_m = 0.05;  // a sample of the surfaces a cube of this edge
constexpr std::array kTolerances_m = {0.02, 0.05, 0.1, 0.2};
constexpr std::array kRanges_m = {4.0, 8.0};  // at most what views were cast to
constexpr double kNearby_m = 0.12;            // some samples, and less than most walls are thick

double ShareWithin(const std::vector<double>& distances_m, double tolerance_m) {
  const auto is_within = [&](double distance_m) { return distance_m <= tolerance_m; };
  return ComputeShare(std::count_if(distances_m.begin(), distances_m.end(), is_within),
                      std::ssize(distances_m));
}

std::vector<double> DistancesToSurfaces(const TriangleTree& surfaces, const EvaluatedCloud& cloud,
                                        double max_m) {
  std::vector<double> distances_m;
  for (const Eigen::Vector3d& p : cloud.points) {
    distances_m.push_back(surfaces.Distance_m(p, max_m));
  }
  return distances_m;
}

// Of values of the points of a cloud.
template <typename Value>
std::vector<Value> OfFilled(const std::vector<Value>& values, const EvaluatedCloud& cloud) {
  std::vector<Value> filled;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (cloud.sources[i] == 1) filled.push_back(values[i]);
  }
  return filled;
}

// Of points to the nearest of others.
std::vector<double> Distances(const std::vector<Eigen::Vector3d>& points,
                              const std::vector<Eigen::Vector3d>& others) {
  if (others.empty()) return std::vector<double>(points.size(), HUGE_VAL);
  std::vector<Eigen::Vector3f> places;
  for (const Eigen::Vector3d& p : others) places.push_back(p.cast<float>());
  const PointTree tree(places);
  std::vector<double> distances_m;
  PointTree::Found found;
  for (const Eigen::Vector3d& point : points) {
    tree.FindNearest(point.cast<float>(), 1, &found);
    distances_m.push_back(std::sqrt(static_cast<double>(found.squared_m2.front())));
  }
  return distances_m;
}

std::vector<Eigen::Vector3d> CollectPlaces(const std::vector<SeenSample>& samples) {
  std::vector<Eigen::Vector3d> places;
  for (const SeenSample& sample : samples) places.push_back(sample.p);
  return places;
}

double RmsBelow(const std::vector<double>& distances_m, double limit_m) {
  double sum = 0;
  int64_t count = 0;
  for (const double distance_m : distances_m) {
    if (distance_m >= limit_m) continue;
    sum += distance_m * distance_m;
    ++count;
  }
  return std::sqrt(ComputeShare(sum, static_cast<double>(count)));
}

// Of shares; 0 where one of them is, whatever the other.
double HarmonicMean(double a, double b) { return a == 0 || b == 0 ? 0 : 2 * a * b / (a + b); }

}  // namespace

EvaluatedCloud ReadEvaluatedCloud(const std::string& path) {
  const PlyFile file = ReadPly(path);
  const PlyElement& vertices = file.Get("vertex", path);
  EvaluatedCloud cloud{Positions(vertices, path), std::vector<int>(vertices.size(), 0)};
  for (const PlyProperty& property : vertices.properties) {
    if (property.name != "source") continue;
    for (std::size_t i = 0; i < cloud.sources.size(); ++i) {
      cloud.sources[i] = static_cast<int>(property.values[i]);
    }
  }
  return cloud;
}

EvaluatedCloud Aligned(const Alignment& alignment, EvaluatedCloud cloud) {
  for (Eigen::Vector3d& p : cloud.points) p = alignment.Position(p);
  return cloud;
}

CloudMetrics EvaluateCloud(const TriangleTree& surfaces, const std::vector<SeenSample>& seen,
                           const EvaluatedCloud& cloud) {
  const double largest_m = kTolerances_m.back();
  const std::vector<double> to_surfaces_m =
      DistancesToSurfaces(surfaces, cloud, std::nextafter(largest_m, HUGE_VAL));
  const std::vector<double> filled_m = OfFilled(to_surfaces_m, cloud);
  const std::vector<Eigen::Vector3d> samples = CollectPlaces(seen);
  const std::vector<double> to_cloud_m = Distances(samples, cloud.points);
  std::array<std::vector<double>, kRanges_m.size()> to_cloud_of_range_m;
  for (std::size_t k = 0; k < kRanges_m.size(); ++k) {
    for (std::size_t i = 0; i < seen.size(); ++i) {
      if (seen[i].range_m <= kRanges_m[k]) to_cloud_of_range_m[k].push_back(to_cloud_m[i]);
    }
  }
  CloudMetrics metrics;
  metrics.points = static_cast<int64_t>(cloud.points.size());
  metrics.filled = static_cast<int64_t>(filled_m.size());
  metrics.filled_seen = ShareWithin(Distances(OfFilled(cloud.points, cloud), samples), kNearby_m);
  metrics.rms_m = RmsBelow(to_surfaces_m, largest_m);
  for (const double tolerance_m : kTolerances_m) {
    CloudScore score;
    score.tolerance_m = tolerance_m;
    score.accuracy = ShareWithin(to_surfaces_m, tolerance_m);
    score.filled_accuracy = ShareWithin(filled_m, tolerance_m);
    for (std::size_t k = 0; k < kRanges_m.size(); ++k) {
      score.completeness[k] = ShareWithin(to_cloud_of_range_m[k], tolerance_m);
      score.f[k] = HarmonicMean(score.accuracy, score.completeness[k]);
    }
    metrics.scores.push_back(score);
  }
  return metrics;
}

namespace {

constexpr double kBehind_m = 0.5;
constexpr std::size_t kEveryRay = 20;
constexpr int kMarginCells = 2;       // of ends: walls are not where cells begin
constexpr double kSkin_m = 1e-4;      // by which a ray to a point on a surface ends before it
constexpr std::size_t kLookouts = 4;  // one view in as many is looked from at what is behind ends

bool IsOccupiedNearby(const OccupancyMap& occupancy, const Eigen::Vector3d& p) {
  for (int i = 0; i < 27; ++i) {
    const Eigen::Vector3d offset(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
    if (occupancy.IsOccupied(p + occupancy.resolution_m() * offset)) return true;
  }
  return false;
}

// Counts over all rays.
class Counter {
 public:
  Counter(const TriangleTree& surfaces, const std::vector<ReferenceView>& views,
          const OccupancyMap& occupancy, const RigidTransform& T_map_truth)
      : surfaces_(surfaces),
        occupancy_(occupancy),
        T_map_truth_(T_map_truth),
        cell_m_(occupancy.resolution_m()) {
    for (std::size_t i = 0; i < views.size(); i += kLookouts) {
      lookouts_.push_back(views[i].p_camera);
    }
  }

  void Count(const Eigen::Vector3d& p_camera, const Eigen::Vector3d& end) {
    const Eigen::Vector3d p_map = T_map_truth_ * end;
    ++rays_;
    occupied_ends_ += occupancy_.IsOccupied(p_map);
    nearby_ends_ += IsOccupiedNearby(occupancy_, p_map);
    const double range_m = (end - p_camera).norm(), margin_m = kMarginCells * cell_m_;
    const Eigen::Vector3d direction = (end - p_camera) / range_m;
    for (double at_m = 0; at_m <= range_m - margin_m; at_m += cell_m_) {
      CountPassage(p_camera + at_m * direction);
    }
    for (double at_m = margin_m; at_m <= kBehind_m; at_m += 2 * cell_m_) {
      CountBehind(end + at_m * direction);
    }
  }

  OccupancyMetrics Metrics() const {
    return {rays_,
            ComputeShare(occupied_ends_, rays_),
            ComputeShare(nearby_ends_, rays_),
            ComputeShare(known_, passages_),
            ComputeShare(free_, known_),
            behind_,
            ComputeShare(behind_free_, behind_)};
  }

 private:
  void CountPassage(const Eigen::Vector3d& p) {
    const bool is_free = occupancy_.IsFree(T_map_truth_ * p);
    ++passages_;
    known_ += is_free || occupancy_.IsOccupied(T_map_truth_ * p);
    free_ += is_free;
  }

  void CountBehind(const Eigen::Vector3d& p) {
    // What is near a surface shares a cell with what is before it.
    if (surfaces_.Distance_m(p, cell_m_) < cell_m_) return;
    if (std::any_of(lookouts_.begin(), lookouts_.end(),
                    [&](const Eigen::Vector3d& lookout) { return IsSeen(lookout, p); })) {
      return;
    }
    ++behind_;
    behind_free_ += occupancy_.IsFree(T_map_truth_ * p);
  }

  bool IsSeen(const Eigen::Vector3d& lookout, const Eigen::Vector3d& p) const {
    const double range_m = (p - lookout).norm() - kSkin_m;
    return !std::isfinite(surfaces_.FirstHit_m(lookout, (p - lookout).normalized(), range_m));
  }

  const TriangleTree& surfaces_;
  const OccupancyMap& occupancy_;
  const RigidTransform T_map_truth_;
  const double cell_m_;
  std::vector<Eigen::Vector3d> lookouts_;
  int64_t rays_ = 0, occupied_ends_ = 0, nearby_ends_ = 0;
  int64_t passages_ = 0, known_ = 0, free_ = 0, behind_ = 0, behind_free_ = 0;
};

}  // namespace

OccupancyMetrics EvaluateOccupancy(const TriangleTree& surfaces,
                                   const std::vector<ReferenceView>& views,
                                   const OccupancyMap& occupancy, const Alignment& alignment,
                                   const Progress& progress) {
  Counter counter(surfaces, views, occupancy, alignment.T_truth_estimate.Inverse());
  std::size_t next = 0, ray = 0;
  for (std::size_t i = 0; i < views.size(); ++i) {
    progress.ReportOrStop(static_cast<double>(i) / static_cast<double>(views.size()));
    for (const Eigen::Vector3d& end : views[i].ends) {
      if (ray++ != next) continue;
      next += kEveryRay;
      counter.Count(views[i].p_camera, end);
    }
  }
  return counter.Metrics();
}

namespace {

using Json = nlohmann::ordered_json;

constexpr double kCast = 0.4;  // share of the time, about, that casting rays takes

Rig TrueRig(const SurfaceInputs& inputs) {
  const std::string path =
      inputs.rig.empty()
          ? std::filesystem::path(inputs.true_surfaces).replace_filename("rig.yaml").string()
          : inputs.rig;
  Warnings warnings;
  return ReadCalibration(path, &warnings).rig;
}

Json ScoreJson(const CloudScore& score) {
  Json json = {{"tolerance_m", score.tolerance_m},
               {"accuracy", score.accuracy},
               {"filled_accuracy", score.filled_accuracy}};
  for (std::size_t i = 0; i < score.f.size(); ++i) {
    json["ranges"].push_back({{"seen_within_m", kRanges_m[i]},
                              {"completeness", score.completeness[i]},
                              {"f", score.f[i]}});
  }
  return json;
}

Json OccupancyJson(const OccupancyMetrics& metrics) {
  return {{"rays", metrics.rays},
          {"ends_occupied", metrics.ends_occupied},
          {"ends_occupied_nearby", metrics.ends_occupied_nearby},
          {"passages_known", metrics.passages_known},
          {"passages_free", metrics.passages_free},
          {"behind_samples", metrics.behind},
          {"behind_called_free", metrics.behind_called_free}};
}

}  // namespace

SurfaceMetrics EvaluateSurfaces(const SurfaceInputs& inputs, const Trajectory& truth,
                                const Alignment& alignment, const VisibilityOptions& visibility,
                                const Progress& progress) {
  visibility.Check();
  const TriangleTree surfaces(ReadSurfaces(inputs.true_surfaces));
  const std::vector<ReferenceView> views =
      ReferenceViews(surfaces, truth, TrueRig(inputs), visibility, progress.Part(0, kCast));
  SurfaceMetrics metrics;
  if (!inputs.cloud.empty()) {
    const EvaluatedCloud cloud = Aligned(alignment, ReadEvaluatedCloud(inputs.cloud));
    metrics.cloud = EvaluateCloud(surfaces, SeenSurfaces(views, kCell_m), cloud);
  }
  if (!inputs.occupancy.empty()) {
    metrics.occupancy = EvaluateOccupancy(surfaces, views, OccupancyMap::Read(inputs.occupancy),
                                          alignment, progress.Part(kCast, 1));
  }
  return metrics;
}

Json SurfaceJson(const SurfaceInputs& inputs, const SurfaceMetrics& metrics) {
  Json json = {{"true_surfaces", inputs.true_surfaces}};
  if (metrics.cloud) {
    json["cloud"] = {{"file", inputs.cloud},
                     {"points", metrics.cloud->points},
                     {"filled", metrics.cloud->filled},
                     {"filled_seen", metrics.cloud->filled_seen},
                     {"rms_m", metrics.cloud->rms_m}};
    for (const CloudScore& score : metrics.cloud->scores) {
      json["cloud"]["scores"].push_back(ScoreJson(score));
    }
  }
  if (metrics.occupancy) {
    json["occupancy"] = OccupancyJson(*metrics.occupancy);
    json["occupancy"]["file"] = inputs.occupancy;
  }
  return json;
}

}  // namespace slcmap::evaluation
