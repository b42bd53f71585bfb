#include "data/check/image_motion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>
#include <optional>

#include "data/calibration/calibration.h"
#include "data/check/view_geometry.h"
#include "data/core/parallel.h"
#include "data/core/types.h"
#include "data/source/asl_files.h"

namespace slcmap::inline data {
namespace {

constexpr double kPart_s = 4;
constexpr double kMinRate_hz = 20;
constexpr int kFeatures = 220, kRefillBelow = 160;
constexpr double kFeatureDistance_px = 18, kFeatureQuality = 0.005;
const cv::Size kPatch_px(15, 15);
constexpr int kLevels = 3, kStereoLevels = 4;
const cv::TermCriteria kUntil(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 20, 0.01);
constexpr double kBorder_px = 4;
constexpr double kStereoStep_s = 0.2;
constexpr double kMaxOffPlane_px = 2;   // of a stereo match, from its epipolar plane
constexpr double kMinDisparity_px = 2;  // of a point that tells a movement
constexpr double kMaxNoise_px = 0.6;    // beyond, features are no features but grain and shadows

struct Followed {
  cv::Point2f pixel;
  Eigen::Vector3d ray;
  // In the left camera at the last pair, and at the pair at which the current step began.
  std::optional<Eigen::Vector3d> p_last = std::nullopt, p_step = std::nullopt;
};

std::optional<Eigen::Vector3d> ComputeRay(const Camera& camera, const cv::Point2f& pixel) {
  return camera.Unproject({pixel.x, pixel.y});
}

// Follows features from each left image to the next.
class Follower {
 public:
  explicit Follower(const Rig& rig) : rig_(rig), like_left_(rig) {}

  // The rays of what was followed from the image before; none for the first.
  std::vector<RayPair> Follow(const cv::Mat& image) {
    std::vector<RayPair> rays;
    if (!image_.empty() && !points_.empty()) rays = FollowPoints(image);
    image_ = image;
    if (points_.size() < kRefillBelow) Refill();
    return rays;
  }

  // The points that the last pair, or that at which the step began, placed, with their rays now.
  std::vector<PlacedRay> PlacedByLast() const { return Placed(&Followed::p_last); }
  std::vector<PlacedRay> PlacedByStep() const { return Placed(&Followed::p_step); }

  void BeginStep() {
    for (Followed& point : points_) point.p_step = point.p_last;
  }

  // Places points with the right image.
  void PlaceAnew(const cv::Mat& right) {
    const RigidTransform T_left_right = rig_.T_imu_camera[0].Inverse() * rig_.T_imu_camera[1];
    std::vector<cv::Point2f> left, guess;
    std::vector<Followed*> points;
    for (Followed& point : points_) {
      point.p_last.reset();
      const auto pixel =
          rig_.cameras[1].Project(T_left_right.Inverse() * (kUsualDepth_m * point.ray));
      if (!pixel || !rig_.cameras[1].Contains(*pixel)) continue;
      points.push_back(&point);
      left.push_back(point.pixel);
      guess.push_back(
          like_left_.FromRight({static_cast<float>(pixel->x()), static_cast<float>(pixel->y())}));
    }
    if (right.empty() || points.empty()) return;
    std::vector<uchar> found;
    std::vector<float> error;
    cv::calcOpticalFlowPyrLK(like_left_.Left(image_), like_left_.Right(right), left, guess, found,
                             error, kPatch_px, kStereoLevels, kUntil, cv::OPTFLOW_USE_INITIAL_FLOW);
    for (size_t i = 0; i < points.size(); ++i) {
      const cv::Point2f right_px = like_left_.ToRight(guess[i]);
      if (!found[i] || !rig_.cameras[1].Contains({right_px.x, right_px.y}, kBorder_px)) continue;
      const auto ray = ComputeRay(rig_.cameras[1], right_px);
      if (ray) points[i]->p_last = ComputePoint(points[i]->ray, *ray, T_left_right);
    }
  }

 private:
  std::vector<PlacedRay> Placed(std::optional<Eigen::Vector3d> Followed::*place) const {
    std::vector<PlacedRay> rays;
    for (const Followed& point : points_) {
      if (point.*place) rays.push_back({*(point.*place), point.ray});
    }
    return rays;
  }

  std::vector<RayPair> FollowPoints(const cv::Mat& image) {
    std::vector<cv::Point2f> before, after;
    for (const Followed& point : points_) before.push_back(point.pixel);
    std::vector<uchar> found;
    std::vector<float> error;
    cv::calcOpticalFlowPyrLK(image_, image, before, after, found, error, kPatch_px, kLevels,
                             kUntil);
    const Camera& camera = rig_.cameras[0];
    std::vector<RayPair> rays;
    std::vector<Followed> kept;
    for (size_t i = 0; i < points_.size(); ++i) {
      if (!found[i] || !camera.Contains({after[i].x, after[i].y}, kBorder_px)) continue;
      const auto ray = ComputeRay(camera, after[i]);
      if (!ray) continue;
      rays.push_back({points_[i].ray, *ray});
      kept.push_back({after[i], *ray, points_[i].p_last, points_[i].p_step});
    }
    points_ = std::move(kept);
    return rays;
  }

  void Refill() {
    cv::Mat mask = rig_.masks[0].empty() ? cv::Mat(image_.size(), CV_8U, cv::Scalar(255))
                                         : rig_.masks[0].clone();
    for (const Followed& point : points_) {
      cv::circle(mask, point.pixel, static_cast<int>(kFeatureDistance_px), 0, cv::FILLED);
    }
    std::vector<cv::Point2f> added;
    cv::goodFeaturesToTrack(image_, added, kFeatures - static_cast<int>(points_.size()),
                            kFeatureQuality, kFeatureDistance_px, mask);
    for (const cv::Point2f& pixel : added) {
      const auto ray = ComputeRay(rig_.cameras[0], pixel);
      if (ray) points_.push_back({pixel, *ray});
    }
  }

  // The point of a stereo match, in the left camera; nothing where its rays miss each other or are
  // nearly parallel.
  std::optional<Eigen::Vector3d> ComputePoint(const Eigen::Vector3d& left,
                                              const Eigen::Vector3d& right,
                                              const RigidTransform& T_left_right) const {
    const double pixel_rad = 1 / rig_.cameras[0].MiddleFocal_px();
    const Eigen::Vector3d ray = T_left_right.rotation * right, &t = T_left_right.translation;
    const double parallax_rad = left.cross(ray).norm();
    if (parallax_rad < kMinDisparity_px * pixel_rad) return std::nullopt;
    if (std::abs(left.dot(t.cross(ray).normalized())) > kMaxOffPlane_px * pixel_rad) {
      return std::nullopt;
    }
    // depth * left ~ t + depth_right * ray, in the least squares sense.
    Eigen::Matrix<double, 3, 2> A;
    A << left, -ray;
    const Eigen::Vector2d depths = (A.transpose() * A).inverse() * (A.transpose() * t);
    if (depths.minCoeff() <= 0) return std::nullopt;
    return depths[0] * left;
  }

  const Rig rig_;
  const LikeLeft like_left_;
  cv::Mat image_;
  std::vector<Followed> points_;
};

size_t ComputeStride(const SourceInfo& info) {
  const double step_s = MedianStep_s(info.pair_stamps_ns);
  if (step_s <= 0) return 1;
  return std::max<size_t>(1, static_cast<size_t>(1 / (kMinRate_hz * step_s) + 1e-3));
}

// Follows features through one part of a recording.
class PartFollower {
 public:
  PartFollower(const Rig& rig, ImageMotion* motion)
      : stereo_(IsStereo(rig)),
        max_noise_rad_(kMaxNoise_px / rig.cameras[0].MiddleFocal_px()),
        follower_(rig),
        motion_(*motion) {}

  // `right` is empty of one camera.
  void Follow(int64_t stamp_ns, const cv::Mat& left, const cv::Mat& right) {
    const std::vector<RayPair> rays = follower_.Follow(left);
    if (!rays.empty() && !AddPlacedTurn(stamp_ns)) AddTurn(stamp_ns, rays);
    before_ns_ = stamp_ns;
    if (!stereo_) return;
    follower_.PlaceAnew(right);
    if (step_ns_ && ToSeconds(stamp_ns - *step_ns_) < kStereoStep_s) return;
    if (step_ns_) motion_.steps.push_back({*step_ns_, stamp_ns, follower_.PlacedByStep()});
    follower_.BeginStep();
    step_ns_ = stamp_ns;
  }

 private:
  // The turn since the image before, by points that a stereo pair placed: better where the camera
  // moves, as a turn cannot be taken for a movement.
  bool AddPlacedTurn(int64_t stamp_ns) {
    const auto seen = SolvePlaced(follower_.PlacedByLast(), RigidTransform());
    if (!seen) return false;
    if (seen->noise_rad > max_noise_rad_) return true;
    motion_.turns.push_back({before_ns_, stamp_ns, LogRotation(seen->T_first_second.rotation),
                             seen->rotation_covariance});
    return true;
  }

  void AddTurn(int64_t stamp_ns, const std::vector<RayPair>& rays) {
    const auto seen = SolveTwoView(rays, direction_);
    if (!seen) return;
    direction_ = seen->direction;
    if (seen->noise_rad > max_noise_rad_) return;
    motion_.turns.push_back(
        {before_ns_, stamp_ns, LogRotation(seen->R_first_second), seen->covariance});
  }

  const bool stereo_;
  const double max_noise_rad_;
  Follower follower_;
  ImageMotion& motion_;
  int64_t before_ns_ = 0;
  std::optional<int64_t> step_ns_;  // when the current step began
  Eigen::Vector3d direction_ = Eigen::Vector3d::UnitZ();
};

// True where either camera shows what it showed before, to the last bit.
bool AreSame(const std::array<cv::Mat, 2>& images, const std::array<cv::Mat, 2>& before) {
  for (size_t i = 0; i < 2; ++i) {
    if (images[i].empty() || images[i].size() != before[i].size()) continue;
    if (cv::norm(images[i], before[i], cv::NORM_INF) == 0) return true;
  }
  return false;
}

void FollowPart(const SequenceSource& source, const Rig& rig, const IndexRange& part,
                const Progress& progress, ImageMotion* motion) {
  auto follower = std::make_unique<PartFollower>(rig, motion);
  std::array<cv::Mat, 2> last;
  int64_t last_ns = 0;
  constexpr double kMostGap_s = 0.5;
  const size_t stride = ComputeStride(source.info());
  const size_t count = (part.end - part.first + stride - 1) / stride;
  const bool is_stereo = IsStereo(source.info().rig);
  // The next pair is decoded while the one before is looked at.
  ReadAhead<std::array<cv::Mat, 2>> coming(
      count,
      [&](size_t i) -> std::array<cv::Mat, 2> {
        const size_t index = part.first + i * stride;
        return {source.ReadImage(index, 0).image,
                is_stereo ? source.ReadImage(index, 1).image : cv::Mat()};
      },
      1);
  for (size_t i = 0; i < count; ++i) {
    const auto [left, right] = coming.Next();
    progress.ReportOrStop(static_cast<double>(i) / static_cast<double>(count));
    if (left.empty() || AreSame({left, right}, last)) continue;
    // A camera that hung has shown no motion where there was some.
    const int64_t stamp_ns = source.info().pair_stamps_ns[part.first + i * stride];
    if (!last[0].empty() && ToSeconds(stamp_ns - last_ns) > kMostGap_s) {
      follower = std::make_unique<PartFollower>(rig, motion);
    }
    last = {left, right};
    last_ns = stamp_ns;
    follower->Follow(stamp_ns, left, right);
  }
}

// How much the turn rate varies within a part.
double Liveliness(const std::vector<ImuSample>& imu, int64_t from_ns, int64_t to_ns) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double squares = 0, count = 0;
  auto sample =
      std::lower_bound(imu.begin(), imu.end(), from_ns,
                       [](const ImuSample& s, int64_t stamp_ns) { return s.stamp_ns < stamp_ns; });
  for (; sample != imu.end() && sample->stamp_ns < to_ns; ++sample) {
    if (!IsPlausible(*sample)) continue;
    sum += sample->angular_velocity_rad_s;
    squares += sample->angular_velocity_rad_s.squaredNorm();
    ++count;
  }
  return count == 0 ? 0 : squares - sum.squaredNorm() / count;
}

}  // namespace

std::vector<IndexRange> LiveliestParts(const SourceInfo& info, const std::vector<ImuSample>& imu,
                                       double duration_s, double skipped_s) {
  struct Rated {
    IndexRange part;
    double liveliness;
  };
  const std::vector<int64_t>& stamps_ns = info.pair_stamps_ns;
  const int64_t offset_ns = ToNanoseconds(info.rig.camera_time_offset_s);
  std::vector<Rated> rated;
  for (size_t first = 0; first < stamps_ns.size();) {
    size_t end = first;
    while (end < stamps_ns.size() && ToSeconds(stamps_ns[end] - stamps_ns[first]) < kPart_s) ++end;
    rated.push_back(
        {{first, end},
         Liveliness(imu, stamps_ns[first] + offset_ns, stamps_ns[end - 1] + offset_ns)});
    first = end;
  }
  std::stable_sort(rated.begin(), rated.end(),
                   [](const Rated& a, const Rated& b) { return a.liveliness > b.liveliness; });
  const auto count = [](double s) { return static_cast<size_t>(std::ceil(s / kPart_s)); };
  const size_t first = count(skipped_s), end = std::min(rated.size(), first + count(duration_s));
  std::vector<IndexRange> parts;
  for (size_t i = first; i < end; ++i) parts.push_back(rated[i].part);
  std::sort(parts.begin(), parts.end(),
            [](const IndexRange& a, const IndexRange& b) { return a.first < b.first; });
  return parts;
}

void Append(const ImageMotion& other, ImageMotion* motion) {
  const auto add = [](const auto& items, auto* all) {
    all->insert(all->end(), items.begin(), items.end());
    std::stable_sort(all->begin(), all->end(),
                     [](const auto& a, const auto& b) { return a.from_ns < b.from_ns; });
  };
  add(other.turns, &motion->turns);
  add(other.steps, &motion->steps);
}

ImageMotion FollowImages(const SequenceSource& source, const Rig& rig,
                         const std::vector<IndexRange>& parts, const Progress& progress) {
  ImageMotion motion;
  for (size_t i = 0; i < parts.size(); ++i) {
    const double count = static_cast<double>(parts.size());
    FollowPart(source, rig, parts[i],
               progress.Part(static_cast<double>(i) / count, static_cast<double>(i + 1) / count),
               &motion);
  }
  return motion;
}

}  // namespace slcmap::data
