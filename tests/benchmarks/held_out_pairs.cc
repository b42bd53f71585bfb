// A map of nine stereo pairs in ten against the tenth: how far its lines and points, reprojected,
// are from what the pairs that it was not made of show. Needs no truth but the poses.
//
//   held_out_pairs SEQ POSES.tum [CONFIG.yaml [OUTPUT]]     writes the map folder OUTPUT
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "data/core/camera.h"
#include "data/core/error.h"
#include "data/core/math.h"
#include "data/io/trajectory.h"
#include "mapping/external_poses/pose_adjustment.h"
#include "mapping/map/map_folder.h"
#include "mapping/mapping.h"
#include "mapping/views/recorded_views.h"
#include "mapping/views/stereo_depth.h"
#include "odometry/frontend/line_detector.h"
#include "odometry/geometry/pinhole.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr size_t kEvery = 10;        // of the pairs is held out
constexpr double kNear_px = 10;      // of an edge that may be a line's
constexpr double kParallel = 0.985;  // cosine, 10 degrees
constexpr double kThrough_px = 2;    // of disparity
constexpr double kStep_px = 5;       // along a reprojected line
constexpr double kMinDepth_m = 0.3;
constexpr double kBehind = 0.05;  // of its depth: hidden by what is so much nearer

double Cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

// What one held-out pair shows, and how far the map is from it.
class HeldOutPair {
 public:
  HeldOutPair(const StereoImage& pair, const ViewImages& images, const RigidTransform& T_world_imu)
      : camera_(images.rig().cameras[0]),
        baseline_m_(
            (images.rig().T_imu_camera[1].translation - images.rig().T_imu_camera[0].translation)
                .norm()),
        T_camera_world_((T_world_imu * images.rig().T_imu_camera[0]).Inverse()),
        depth_(StereoDepth(pair, images.mask(0), images.rig(), DenseOptions())) {
    LineDetectorOptions detector;
    detector.scale = 1;
    detector.max_segments = 1000;
    segments_ = DetectSegments(pair.left, images.mask(0), detector);
  }

  // Adds the distances (px) of a line's places in the image to the nearest edge along it, and
  // counts places that could be seen.
  void AddLine(const MapLine& line, std::vector<double>* distances_px, int64_t* seen) const {
    const Vector3d start = T_camera_world_ * line.start_world;
    const Vector3d end = T_camera_world_ * line.end_world;
    if (start.z() < kMinDepth_m || end.z() < kMinDepth_m) return;
    const Vector2d a = Pixel(start), b = Pixel(end);
    const int steps = static_cast<int>((b - a).norm() / kStep_px);
    for (int i = 0; i < steps; ++i) {
      // Inverse depth is linear over the image.
      const double share = (i + 0.5) / steps;
      const Vector2d place = a + share * (b - a);
      const double inverse_depth = (1 - share) / start.z() + share / end.z();
      if (!IsInside(place) || IsHidden(place, inverse_depth)) continue;
      ++*seen;
      const double distance_px = DistanceToEdge(place, (b - a).normalized());
      if (distance_px <= kNear_px) distances_px->push_back(distance_px);
    }
  }

  // Adds the errors (px) of the disparities that the nearest points of the map have where the pair
  // has one, positive where the pair looks through what the map has there; of those of filled
  // planes to filled_px.
  void AddPoints(const MapResult& map, std::vector<double>* errors_px,
                 std::vector<double>* filled_px) const {
    std::vector<double> nearest(depth_.nodes.size(), 0);  // inverse depth
    std::vector<char> is_filled(depth_.nodes.size(), 0);
    for (std::size_t i = 0; i < CountDense(map); ++i) {
      const Vector3d p = T_camera_world_ * DenseAt(map, i).p_world;
      if (p.z() < kMinDepth_m) continue;
      const Vector2d place = Pixel(p);
      const int column = static_cast<int>(place.x() / depth_.step_px);
      const int row = static_cast<int>(place.y() / depth_.step_px);
      if (!IsInside(place) || !depth_.Contains(column, row)) continue;
      const int node = row * depth_.columns + column;
      if (1 / p.z() <= nearest[node]) continue;
      nearest[node] = 1 / p.z();
      is_filled[node] = IsFilled(map, i);
    }
    for (size_t i = 0; i < nearest.size(); ++i) {
      if (nearest[i] == 0 || !depth_.nodes[i].is_known()) continue;
      (is_filled[i] ? filled_px : errors_px)
          ->push_back((nearest[i] - depth_.nodes[i].inverse_depth) * baseline_m_ * camera_.fx_px);
    }
  }

 private:
  Vector2d Pixel(const Vector3d& p) const {
    return PixelFromPlane(camera_, Vector2d(p.hnormalized()));
  }

  bool IsInside(const Vector2d& place) const {
    return place.x() >= 0 && place.y() >= 0 && place.x() < camera_.width_px &&
           place.y() < camera_.height_px;
  }

  bool IsHidden(const Vector2d& place, double inverse_depth) const {
    Vector2d offset;
    const DepthNode* node = depth_.KnownNear(place, &offset);
    return node && node->inverse_depth > inverse_depth * (1 + kBehind);
  }

  // Across the line, to edges of its direction that pass beside the place.
  double DistanceToEdge(const Vector2d& place, const Vector2d& along) const {
    double nearest_px = 2 * kNear_px;
    for (const LineSegment& segment : segments_) {
      const Vector2d way = segment.end - segment.start;
      const double length_px = way.norm();
      if (std::abs(along.dot(way)) < kParallel * length_px) continue;
      const double at_px = (place - segment.start).dot(way) / length_px;
      if (at_px < 0 || at_px > length_px) continue;
      nearest_px = std::min(nearest_px, std::abs(Cross(place - segment.start, way)) / length_px);
    }
    return nearest_px;
  }

  const Camera camera_;
  const double baseline_m_;
  const RigidTransform T_camera_world_;
  const DepthGrid depth_;
  std::vector<LineSegment> segments_;
};

void Print(const char* what, const std::vector<double>& errors_px) {
  std::vector<double> sizes_px;
  for (const double error_px : errors_px) sizes_px.push_back(std::abs(error_px));
  fmt::print("{}: {} places, median {:.2f} px, 75 % within {:.2f} px\n", what, sizes_px.size(),
             Quantile(sizes_px, 0.5), Quantile(sizes_px, 0.75));
}

void PrintDisparities(const char* what, const std::vector<double>& errors_px) {
  Print(what, errors_px);
  const auto share = [&](auto is_counted) {
    return 100.0 * static_cast<double>(std::ranges::count_if(errors_px, is_counted)) /
           std::max(1.0, static_cast<double>(errors_px.size()));
  };
  fmt::print("  looked through by more than {} px: {:.1f} %, behind what is nearer: {:.1f} %\n",
             kThrough_px, share([](double error_px) { return error_px > kThrough_px; }),
             share([](double error_px) { return error_px < -kThrough_px; }));
}

int Main(const std::string& sequence, const std::string& poses, const MappingOptions& options,
         const std::string& output) {
  OdometryRun run = RunAtPoses(sequence, {}, ReadTrajectory(poses));
  // Of all pairs: where the tenth was taken from is found by points, which no line is made of.
  AdjustExternalPoses(*KeyframeImages(run, sequence), options.given_poses, &run);
  const RecordedViews all = ViewsOfRun(run, sequence);
  std::vector<size_t> held_out;
  std::vector<Keyframe> kept;
  for (size_t i = 0; i < run.keyframes.size(); ++i) {
    if (i % kEvery == kEvery / 2) {
      held_out.push_back(i);
    } else {
      kept.push_back(run.keyframes[i]);
    }
  }
  // Lines are looked for between keyframes, too.
  for (const size_t i : held_out) {
    std::erase_if(run.states, [&](const OnlineState& state) {
      return state.stamp_ns == run.keyframes[i].stamp_ns;
    });
  }
  run.keyframes = std::move(kept);
  const RecordedViews recorded = ViewsOfRun(run, sequence);
  const MapResult map = MapRun(run, &recorded, options);
  if (!output.empty()) WriteMapFolder(output, map);
  std::vector<double> line_px, point_px, filled_px;
  int64_t seen = 0;
  for (const size_t i : held_out) {
    const HeldOutPair pair(all.images->Read(i), *all.images, all.views[i].T_world_imu);
    for (const MapLine& line : map.lines) pair.AddLine(line, &line_px, &seen);
    pair.AddPoints(map, &point_px, &filled_px);
  }
  if (line_px.empty() || point_px.empty())
    throw DataError("found nothing to compare: too few views");
  fmt::print("{} views, {} held out: {} lines, {} points\n", recorded.views.size(), held_out.size(),
             map.lines.size(), CountDense(map));
  Print("lines", line_px);
  fmt::print(
      "  with an edge within {} px: {:.0f} % of {} places that are not hidden\n", kNear_px,
      100.0 * static_cast<double>(line_px.size()) / static_cast<double>(std::max<int64_t>(seen, 1)),
      seen);
  PrintDisparities("points (disparity)", point_px);
  if (!filled_px.empty()) PrintDisparities("points of filled planes (disparity)", filled_px);
  return EXIT_SUCCESS;
}

}  // namespace
}  // namespace slcmap

int main(int argc, char** argv) {
  if (argc < 3 || argc > 5) {
    fmt::print(stderr, "usage: held_out_pairs SEQ POSES.tum [CONFIG.yaml [OUTPUT]]\n");
    return EXIT_FAILURE;
  }
  try {
    const auto options =
        argc > 3 ? slcmap::MappingOptions::FromYaml(argv[3]) : slcmap::MappingOptions();
    return slcmap::Main(argv[1], argv[2], options, argc > 4 ? argv[4] : "");
  } catch (const std::exception& error) {
    fmt::print(stderr, "error: {}\n", error.what());
    return EXIT_FAILURE;
  }
}
