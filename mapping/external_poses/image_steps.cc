#include "mapping/external_poses/image_steps.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/features2d.hpp>
#include <optional>

#include "data/check/view_geometry.h"
#include "data/core/error.h"
#include "data/core/math.h"
#include "data/core/parallel.h"
#include "mapping/views/recorded_views.h"
#include "mapping/views/stereo_depth.h"
#include "odometry/geometry/pinhole.h"

namespace slcmap::inline mapping {
namespace {

using Eigen::Vector2d;

constexpr size_t kMostSteps = 40, kLeastPreferred = 10;
constexpr int kFeatures = 1000;
constexpr float kMostAlike = 0.8F;  // distance of the best place over that of the next
constexpr double kRansac_px = 2;
constexpr size_t kLeastPlaced = 20;
constexpr double kMostTurn_rad = 1.2;

struct PlacedFeatures {
  std::vector<PlacedRay> rays;
  std::vector<cv::Point3f> points;
  std::vector<cv::Point2f> px;
};

PlacedFeatures MatchFeatures(const StereoImage& from, const StereoImage& to,
                             const ViewImages& images) {
  const auto orb = cv::ORB::create(kFeatures);
  std::vector<cv::KeyPoint> first, second;
  cv::Mat of_first, of_second;
  orb->detectAndCompute(from.left, images.mask(0), first, of_first);
  orb->detectAndCompute(to.left, images.mask(0), second, of_second);
  PlacedFeatures placed;
  if (of_first.empty() || of_second.empty()) return placed;
  std::vector<std::vector<cv::DMatch>> matches;
  cv::BFMatcher(cv::NORM_HAMMING).knnMatch(of_first, of_second, matches, 2);
  const DepthGrid depth = StereoDepth(from, images.mask(0), images.rig(), DenseOptions());
  const Camera& camera = images.rig().cameras[0];
  for (const std::vector<cv::DMatch>& best : matches) {
    if (best.size() < 2 || best[0].distance > kMostAlike * best[1].distance) continue;
    const cv::Point2f &a = first[static_cast<size_t>(best[0].queryIdx)].pt,
                      &b = second[static_cast<size_t>(best[0].trainIdx)].pt;
    Vector2d offset_px;
    const DepthNode* node = depth.KnownNear({a.x, a.y}, &offset_px);
    if (!node) continue;
    const double inverse_depth =
        node->inverse_depth + node->slope_x * offset_px.x() + node->slope_y * offset_px.y();
    if (!(inverse_depth > 0)) continue;
    const Eigen::Vector3d p =
        PlaneFromPixel(camera, Vector2d(a.x, a.y)).homogeneous() / inverse_depth;
    placed.rays.push_back(
        {p, PlaneFromPixel(camera, Vector2d(b.x, b.y)).homogeneous().normalized()});
    placed.points.emplace_back(p.x(), p.y(), p.z());
    placed.px.push_back(b);
  }
  return placed;
}

// Of the camera, by what each half of the points says alone: where these are few or beside each
// other, both differ.
BodyStep WithSpread(const RigidTransform& T_from_to, const std::vector<PlacedRay>& rays) {
  BodyStep step{.T_from_to = T_from_to, .turn_sigma_rad = INFINITY, .way_sigma_m = INFINITY};
  std::array<std::vector<PlacedRay>, 2> halves;
  for (size_t i = 0; i < rays.size(); ++i) halves[i % 2].push_back(rays[i]);
  const auto first = SolvePlaced(halves[0], T_from_to), second = SolvePlaced(halves[1], T_from_to);
  if (!first || !second) return step;
  const RigidTransform apart = first->T_first_second.Inverse() * second->T_first_second;
  step.turn_sigma_rad = LogRotation(apart.rotation).norm() / 2;
  step.way_sigma_m = apart.translation.norm() / 2;
  return step;
}

std::optional<BodyStep> CameraStep(const StereoImage& from, const StereoImage& to,
                                   const ViewImages& images) {
  if (from.left.empty() || from.right.empty() || to.left.empty()) return std::nullopt;
  const PlacedFeatures placed = MatchFeatures(from, to, images);
  if (placed.rays.size() < kLeastPlaced) return std::nullopt;
  const Camera& camera = images.rig().cameras[0];
  const cv::Matx33d K(camera.fx_px, 0, camera.cx_px, 0, camera.fy_px, camera.cy_px, 0, 0, 1);
  cv::Vec3d turn, way;
  std::vector<int> inliers;
  if (!cv::solvePnPRansac(placed.points, placed.px, K, cv::noArray(), turn, way, false, 300,
                          kRansac_px, 0.999, inliers, cv::SOLVEPNP_P3P) ||
      inliers.size() < kLeastPlaced) {
    return std::nullopt;
  }
  std::vector<PlacedRay> rays;
  for (const int i : inliers) rays.push_back(placed.rays[static_cast<size_t>(i)]);
  // A solution behind the camera projects alike; features look alike over small turns only.
  const RigidTransform T_second_first{ExpRotation({turn[0], turn[1], turn[2]}),
                                      {way[0], way[1], way[2]}};
  const bool is_near = LogRotation(T_second_first.rotation).norm() < kMostTurn_rad;
  const auto motion = SolvePlaced(rays, is_near ? T_second_first.Inverse() : RigidTransform());
  if (!motion || LogRotation(motion->T_first_second.rotation).norm() > kMostTurn_rad) {
    return std::nullopt;
  }
  const RigidTransform back = motion->T_first_second.Inverse();
  const bool are_before = std::ranges::all_of(
      rays, [&](const PlacedRay& ray) { return (back * ray.p_first).dot(ray.second) > 0; });
  if (!are_before) return std::nullopt;
  return WithSpread(motion->T_first_second, rays);
}

}  // namespace

std::vector<std::pair<size_t, size_t>> PairsToCompare(const std::vector<StereoEntry>& images,
                                                      const std::vector<int64_t>& preferred_ns,
                                                      double spacing_s) {
  constexpr double kLeastApart = 0.8;  // times the spacing
  std::vector<size_t> among, all;
  for (size_t i = 0; i < images.size(); ++i) {
    all.push_back(i);
    if (std::ranges::binary_search(preferred_ns, images[i].stamp_ns)) among.push_back(i);
  }
  if (among.size() < kLeastPreferred) among = all;
  std::vector<std::pair<size_t, size_t>> pairs;
  for (size_t first = 0; first + 1 < among.size(); ++first) {
    for (size_t second = first + 1; second < among.size(); ++second) {
      const double apart_s =
          ToSeconds(images[among[second]].stamp_ns - images[among[first]].stamp_ns);
      if (apart_s < kLeastApart * spacing_s) continue;
      if (apart_s < kMostStepsApart * spacing_s) pairs.emplace_back(among[first], among[second]);
      break;
    }
  }
  if (pairs.size() <= kMostSteps) return pairs;
  std::vector<std::pair<size_t, size_t>> chosen;
  for (size_t i = 0; i < kMostSteps; ++i) {
    chosen.push_back(pairs[i * (pairs.size() - 1) / (kMostSteps - 1)]);
  }
  return chosen;
}

std::vector<BodyStep> StepsOfImages(const Sequence& recording,
                                    const std::vector<std::pair<size_t, size_t>>& pairs,
                                    const Progress& progress) {
  std::vector<size_t> entries;
  for (const auto& [first, second] : pairs) entries.insert(entries.end(), {first, second});
  const std::unique_ptr<ViewImages> images = OpenImages(recording, entries);
  const RigidTransform& T_imu_camera = images->rig().T_imu_camera[0];
  std::vector<std::optional<BodyStep>> found(pairs.size());
  const auto measure = [&](size_t i) {
    found[i] = CameraStep(images->Read(2 * i), images->Read(2 * i + 1), *images);
  };
  if (!ForEachWatched(pairs.size(), progress, measure, 4)) throw StoppedError("interrupted");
  std::vector<BodyStep> steps;
  for (size_t i = 0; i < pairs.size(); ++i) {
    if (!found[i]) continue;
    BodyStep step = *found[i];
    step.from_ns = recording.images[pairs[i].first].stamp_ns;
    step.to_ns = recording.images[pairs[i].second].stamp_ns;
    step.T_from_to = T_imu_camera * step.T_from_to * T_imu_camera.Inverse();
    steps.push_back(step);
  }
  return steps;
}

namespace {

constexpr double kBetweenPoses_s = 0.25, kNearPose_s = 0.005;  // between poses, to the nearest one

}  // namespace

std::vector<StepPair> PairsAt(const Trajectory& trajectory, const std::vector<BodyStep>& steps,
                              int64_t offset_ns) {
  std::vector<StepPair> pairs;
  for (const BodyStep& step : steps) {
    const auto from = PoseNear(trajectory, step.from_ns - offset_ns, kBetweenPoses_s, kNearPose_s);
    if (!from) continue;
    const auto to = PoseNear(trajectory, step.to_ns - offset_ns, kBetweenPoses_s, kNearPose_s);
    if (to) pairs.push_back({step, from->Inverse() * *to, to->rotation});
  }
  return pairs;
}

double EstimateScale(const std::vector<StepPair>& pairs, double* sigma) {
  std::vector<std::pair<double, double>> ratios;  // with weights
  double sum = 0;
  for (const StepPair& pair : pairs) {
    const double way2 = pair.posed.translation.squaredNorm();
    if (way2 < 1e-12) continue;
    ratios.emplace_back(pair.known.T_from_to.translation.dot(pair.posed.translation) / way2,
                        pair.known.T_from_to.translation.norm());
    sum += ratios.back().second;
  }
  *sigma = INFINITY;
  if (ratios.size() < kLeastSteps || !(sum > 0)) return 1;
  std::ranges::sort(ratios);
  const auto quantile = [&](double share) {
    double below = 0;
    for (const auto& [ratio, weight] : ratios) {
      if ((below += weight) >= share * sum) return ratio;
    }
    return ratios.back().first;
  };
  const double spread = 0.74 * (quantile(0.75) - quantile(0.25));
  *sigma = 1.25 * spread / std::sqrt(static_cast<double>(ratios.size()));
  return quantile(0.5);
}

PoseOff ComputePoseOffsets(const std::vector<StepPair>& pairs, double scale) {
  PoseOff off;
  std::vector<double> turns_rad, ways_m;
  double sum = 0;
  for (const StepPair& pair : pairs) {
    turns_rad.push_back(pair.known.T_from_to.rotation.angularDistance(pair.posed.rotation));
    ways_m.push_back((pair.known.T_from_to.translation - scale * pair.posed.translation).norm());
    sum += std::min(kMostStepSigmas,
                    std::hypot(turns_rad.back() / kTurnSigma_rad, ways_m.back() / kWaySigma_m));
  }
  off.steps = static_cast<int>(std::ssize(pairs));
  off.turn_rad = Quantile(turns_rad, 0.5);
  off.way_m = Quantile(ways_m, 0.5);
  off.cost = pairs.empty() ? kMostStepSigmas : sum / static_cast<double>(pairs.size());
  return off;
}

}  // namespace slcmap::mapping
