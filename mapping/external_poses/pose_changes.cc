#include "mapping/external_poses/pose_changes.h"

#include <spdlog/fmt/fmt.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "data/core/math.h"
#include "mapping/views/recorded_views.h"
#include "odometry/geometry/pinhole.h"

namespace slcmap::inline mapping {
namespace {

// Right-handed and left-handed axes along others.
std::vector<Eigen::Matrix3d> AxesAlongOthers() {
  std::vector<Eigen::Matrix3d> all;
  std::array<int, 3> order = {0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Eigen::Matrix3d axes = Eigen::Matrix3d::Zero();
      for (int i = 0; i < 3; ++i) axes(order[i], i) = (signs >> i) % 2 == 0 ? 1 : -1;
      all.push_back(axes);
    }
  } while (std::ranges::next_permutation(order).found);
  return all;
}

std::string AxesInWords(const Eigen::Matrix3d& axes) {
  std::vector<std::string> names;
  for (int i = 0; i < 3; ++i) {
    Eigen::Index along = 0;
    axes.col(i).cwiseAbs().maxCoeff(&along);
    names.push_back(fmt::format("{}{}", axes(along, i) < 0 ? "-" : "", "xyz"[along]));
  }
  return fmt::format("{}", fmt::join(names, ", "));
}

// The steps in a frame of other axes, which may be left-handed.
std::vector<BodyStep> StepsInAxes(std::vector<BodyStep> steps, const Eigen::Matrix3d& axes) {
  for (BodyStep& step : steps) {
    const RigidTransform& T = step.T_from_to;
    const Eigen::Matrix3d R = axes.transpose() * T.rotation.toRotationMatrix() * axes;
    step.T_from_to = {Eigen::Quaterniond(R), axes.transpose() * T.translation};
  }
  return steps;
}

PoseOff OffIn(const Trajectory& poses, const std::vector<BodyStep>& steps, const PoseForm& given) {
  const std::vector<StepPair> pairs = PairsAt(poses, steps, std::llround(given.offset_s * 1e9));
  double sigma = 0;
  const double scale = EstimateScale(pairs, &sigma);
  return ComputePoseOffsets(pairs, std::isfinite(sigma) && scale > 0 ? scale : given.scale);
}

Trajectory WithPositionsIn(const Eigen::Matrix3d& axes, Trajectory poses) {
  for (StampedPose& pose : poses) {
    pose.T_world_imu.translation = axes.transpose() * pose.T_world_imu.translation;
  }
  return poses;
}

}  // namespace

std::string WordsOfOtherAxes(const std::vector<Reading>& readings, const PoseForm& given,
                             const PoseOff& otherwise) {
  constexpr double kFits = 1.5;  // standard deviations
  double least = std::min(kFits, kMuchBetter * otherwise.cost);
  std::string words;
  const auto compare = [&](const PoseOff& off, const std::string& of_it) {
    if (off.cost >= least || off.steps < kLeastSteps || 2 * off.steps < otherwise.steps) return;
    least = off.cost;
    words = of_it;
  };
  for (const Reading& reading : readings) {
    for (const Eigen::Matrix3d& axes : AxesAlongOthers()) {
      const bool is_mirrored = axes.determinant() < 0;
      compare(OffIn(reading.poses, StepsInAxes(reading.steps, axes), given),
              fmt::format("{} (axes x, y, z that are {} of the {})",
                          is_mirrored ? "the poses are mirrored, in left-handed axes"
                                      : "the poses are those of a body that is turned",
                          AxesInWords(axes), reading.form.IsOfCamera() ? "left camera" : "IMU"));
      if (!is_mirrored) continue;
      compare(OffIn(WithPositionsIn(axes, reading.poses), reading.steps, given),
              fmt::format("the positions are mirrored, in left-handed axes (x, y, z are {} of the "
                          "world that the rotations are in)",
                          AxesInWords(axes.transpose())));
    }
  }
  return words;
}

namespace {

PoseOff OffStep(const StepPair& pair, double scale) {
  return {.turn_rad = pair.known.T_from_to.rotation.angularDistance(pair.posed.rotation),
          .way_m = (pair.known.T_from_to.translation - scale * pair.posed.translation).norm()};
}

bool IsOff(const StepPair& pair, double scale, const PoseOff& usual) {
  constexpr double kLeast_rad = 0.015, kLeast_m = 0.04, kSigmas = 5, kTimes = 3;
  constexpr double kTurnShare = 0.03, kWayShare = 0.1;
  const PoseOff off = OffStep(pair, scale);
  const double turned_rad = LogRotation(pair.known.T_from_to.rotation).norm(),
               moved_m = pair.known.T_from_to.translation.norm();
  return off.turn_rad > kLeast_rad + kSigmas * pair.known.turn_sigma_rad + kTimes * usual.turn_rad +
                            kTurnShare * turned_rad ||
         off.way_m > kLeast_m + kSigmas * pair.known.way_sigma_m + kTimes * usual.way_m +
                         kWayShare * moved_m;
}

// The longest of several steps on end that are off.
std::string DescribeLongestInterval(const std::vector<StepPair>& pairs, double scale,
                                    const PoseOff& usual, const std::string& who) {
  constexpr size_t kLeastOff = 3;
  size_t longest = 0, end = 0, here = 0;
  for (size_t i = 0; i < pairs.size(); ++i) {
    here = IsOff(pairs[i], scale, usual) ? here + 1 : 0;
    if (here > longest) longest = here, end = i + 1;
  }
  if (longest < kLeastOff) return "";
  PoseOff most;
  for (size_t i = end - longest; i < end; ++i) {
    const PoseOff off = OffStep(pairs[i], scale);
    most.turn_rad = std::max(most.turn_rad, off.turn_rad);
    most.way_m = std::max(most.way_m, off.way_m);
  }
  return fmt::format(
      "from {:.3f} to {:.3f} s the poses are off by up to {:.1f} degrees and {:.3f} m (by {} {}; "
      "in the median of all by {:.1f} degrees and {:.3f} m)",
      ToSeconds(pairs[end - longest].known.from_ns), ToSeconds(pairs[end - 1].known.to_ns),
      kDegreesPerRadian * most.turn_rad, most.way_m, longest, who,
      kDegreesPerRadian * usual.turn_rad, usual.way_m);
}

// By the turns that poses make more than the steps, about axes of their world.
std::string WordsOfDrift(const std::vector<StepPair>& pairs) {
  constexpr double kLeast_rad = 3 * M_PI / 180, kSigmas = 6;
  std::array<std::vector<double>, 3> rates_rad_s;
  for (const StepPair& pair : pairs) {
    const Eigen::Vector3d more_rad =
        pair.R_world_to *
        LogRotation(pair.known.T_from_to.rotation.conjugate() * pair.posed.rotation);
    const double apart_s = ToSeconds(pair.known.to_ns - pair.known.from_ns);
    for (int i = 0; i < 3; ++i) rates_rad_s[i].push_back(more_rad[i] / apart_s);
  }
  Eigen::Vector3d rate_rad_s, sigma_rad_s;
  for (int i = 0; i < 3; ++i) {
    const double spread = 0.74 * (Quantile(rates_rad_s[i], 0.75) - Quantile(rates_rad_s[i], 0.25));
    rate_rad_s[i] = Quantile(rates_rad_s[i], 0.5);
    sigma_rad_s[i] = 1.25 * spread / std::sqrt(static_cast<double>(pairs.size()));
  }
  const double span_s = ToSeconds(pairs.back().known.to_ns - pairs.front().known.from_ns);
  if (rate_rad_s.norm() * span_s < kLeast_rad || rate_rad_s.norm() < kSigmas * sigma_rad_s.norm()) {
    return "";
  }
  const Eigen::Vector3d turned = kDegreesPerRadian * span_s * rate_rad_s;
  return fmt::format(
      "they drift by {:.1f} degrees over {:.1f} s (about x, y, z of their world by {:.1f}, {:.1f}, "
      "{:.1f})",
      turned.norm(), span_s, turned.x(), turned.y(), turned.z());
}

// Of both sides of where they differ most.
std::string WordsOfScales(const std::vector<StepPair>& pairs, double scale) {
  constexpr double kLeast = 0.06, kSigmas = 5;     // images alone have 0.035 in EuRoC MH_01
  constexpr double kLeastWay_m = 3 * kWaySigma_m;  // of usual steps: what rests tells no scale
  const auto moves = [](const auto& from, const auto& to) {
    std::vector<double> ways_m;
    for (auto at = from; at != to; ++at) ways_m.push_back(at->known.T_from_to.translation.norm());
    return Quantile(ways_m, 0.5) >= kLeastWay_m;
  };
  double most = kSigmas;
  std::string words;
  for (auto at = pairs.begin() + kLeastSteps; at + kLeastSteps <= pairs.end(); ++at) {
    std::array<double, 2> sigmas{};
    const double first = EstimateScale({pairs.begin(), at}, sigmas.data()),
                 second = EstimateScale({at, pairs.end()}, &sigmas[1]);
    const double change = std::abs(second - first) / scale;
    const double in_sigmas = change * scale / std::hypot(sigmas[0], sigmas[1]);
    if (!(change > kLeast && in_sigmas > most && first > 0 && second > 0)) continue;
    if (!moves(pairs.begin(), at) || !moves(at, pairs.end())) continue;
    most = in_sigmas;
    words = fmt::format(
        "their scale changes: lengths are {:.3f} times what they should be before {:.3f} s, {:.3f} "
        "times from there",
        scale / first, ToSeconds(at->known.from_ns), scale / second);
  }
  return words;
}

}  // namespace

std::string WordsOfChange(std::vector<StepPair> pairs, double scale, const std::string& who) {
  constexpr double kKnown_rad = 0.01, kKnown_m = 0.03;
  constexpr ptrdiff_t kLeastPairs = 2 * kLeastSteps;
  std::erase_if(pairs, [](const StepPair& pair) {
    return pair.known.turn_sigma_rad > kKnown_rad || pair.known.way_sigma_m > kKnown_m;
  });
  if (std::ssize(pairs) < kLeastPairs) return "";
  const PoseOff usual = ComputePoseOffsets(pairs, scale);
  std::vector<std::string> words = {DescribeLongestInterval(pairs, scale, usual, who)};
  std::erase_if(pairs, [&](const StepPair& pair) { return IsOff(pair, scale, usual); });
  if (std::ssize(pairs) >= kLeastPairs) {
    words.push_back(WordsOfScales(pairs, scale));
    words.push_back(WordsOfDrift(pairs));
  }
  std::erase(words, "");
  return fmt::format("{}", fmt::join(words, "; "));
}

namespace {

using Eigen::Vector3d;

constexpr size_t kMostImages = 16, kLinesOfImage = 40;
constexpr double kMostOff = 0.02;  // sine of the angle between an edge's plane and a direction

// The plane through a camera and an edge that it sees, and how long that is.
struct EdgePlane {
  Vector3d normal;  // unit, in the world
  double length_px;
};

void AddEdges(const cv::Mat& image, const cv::Mat& mask, const Camera& camera,
              const Eigen::Quaterniond& R_world_camera, std::vector<EdgePlane>* edges) {
  constexpr double kLeast_px = 40;
  std::vector<cv::Vec4f> found;
  cv::createLineSegmentDetector(cv::LSD_REFINE_STD)->detect(image, found);
  std::vector<EdgePlane> of_image;
  for (const cv::Vec4f& line : found) {
    const Eigen::Vector2d a(line[0], line[1]), b(line[2], line[3]), middle = 0.5 * (a + b);
    const cv::Point at(static_cast<int>(middle.x()), static_cast<int>(middle.y()));
    if ((a - b).norm() < kLeast_px || mask.at<uint8_t>(at) == 0) continue;
    const Vector3d normal =
        PlaneFromPixel(camera, a).homogeneous().cross(PlaneFromPixel(camera, b).homogeneous());
    of_image.push_back({R_world_camera * normal.normalized(), (a - b).norm()});
  }
  std::ranges::sort(of_image, std::greater(), &EdgePlane::length_px);
  of_image.resize(std::min(of_image.size(), kLinesOfImage));
  edges->insert(edges->end(), of_image.begin(), of_image.end());
}

double LengthAlong(const std::vector<EdgePlane>& edges, const Vector3d& direction) {
  double length_px = 0;
  for (const EdgePlane& edge : edges) {
    if (std::abs(edge.normal.dot(direction)) < kMostOff) length_px += edge.length_px;
  }
  return length_px;
}

// Of the edges that follow a direction.
Vector3d Refined(const std::vector<EdgePlane>& edges, const Vector3d& direction) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const EdgePlane& edge : edges) {
    if (std::abs(edge.normal.dot(direction)) < kMostOff) {
      sum += edge.length_px * edge.normal * edge.normal.transpose();
    }
  }
  const Vector3d refined =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(sum).eigenvectors().col(0);
  return refined.dot(direction) < 0 ? -refined : refined;
}

}  // namespace

std::optional<Vector3d> UpByImages(const Sequence& recording, const Trajectory& trajectory) {
  constexpr double kMostFromGuess = 0.77, kSame = 0.5;  // cosines: 40 and 60 degrees
  constexpr double kClearly = 2;                        // times the edges along z
  const RigidTransform& T_imu_camera = recording.rig.T_imu_camera[0];
  Vector3d guess = Vector3d::Zero();
  std::vector<size_t> with_pose;
  std::vector<Eigen::Quaterniond> R_world_imu;
  for (size_t i = 0; i < recording.images.size(); ++i) {
    const auto pose = PoseAt(trajectory, recording.images[i].stamp_ns, 0.1);
    if (!pose) continue;
    with_pose.push_back(i);
    R_world_imu.push_back(pose->rotation);
    guess -= pose->rotation * T_imu_camera.rotation * Vector3d::UnitY();
  }
  if (with_pose.empty() || guess.norm() < kSame * static_cast<double>(with_pose.size())) {
    return std::nullopt;
  }
  guess.normalize();
  if (guess.z() > kSame) return std::nullopt;
  std::vector<size_t> pairs, chosen;
  const size_t count = std::min(kMostImages, with_pose.size());
  for (size_t i = 0; i < count; ++i) {
    chosen.push_back(i * with_pose.size() / count);
    pairs.push_back(with_pose[chosen.back()]);
  }
  const auto images = OpenImages(recording, pairs);
  const Rig& rig = images->rig();
  std::vector<EdgePlane> edges;
  for (size_t i = 0; i < count; ++i) {
    const cv::Mat left = images->Read(i).left;
    if (left.empty()) continue;
    AddEdges(left, images->mask(0), rig.cameras[0],
             R_world_imu[chosen[i]] * rig.T_imu_camera[0].rotation, &edges);
  }
  Vector3d best = guess;
  double most_px = 0;
  for (size_t i = 0; i < edges.size(); ++i) {
    for (size_t j = i + 1; j < edges.size(); j += 7) {  // of different images as a rule
      Vector3d direction = edges[i].normal.cross(edges[j].normal);
      if (direction.norm() < 0.1) continue;
      direction.normalize();
      if (std::abs(direction.dot(guess)) < kMostFromGuess) continue;
      const double length_px = LengthAlong(edges, direction);
      if (length_px <= most_px) continue;
      most_px = length_px;
      best = direction.dot(guess) < 0 ? Vector3d(-direction) : direction;
    }
  }
  if (most_px == 0) return std::nullopt;
  for (int i = 0; i < 3; ++i) best = Refined(edges, best);
  const bool is_upside_down = guess.z() < -kSame;
  if (!is_upside_down &&
      LengthAlong(edges, best) < kClearly * LengthAlong(edges, Vector3d::UnitZ())) {
    return std::nullopt;
  }
  return best;
}

}  // namespace slcmap::mapping
