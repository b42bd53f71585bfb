// Whether what the images show agrees with the calibration: left with right by the epipolar
// constraint, and one image with the next by the rotation that the gyroscope measured.
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/features2d.hpp>
#include <optional>

#include "data/calibration.h"
#include "data/check/check.h"

namespace slcmap {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr size_t kStereoSamples = 12;
constexpr size_t kTurnSamples = 10;
constexpr int kFeatures = 400;
constexpr double kMaxDescriptorDistance = 48;   // of 256 bits
constexpr int kMinMatches = 60;                 // in all, for a judgement
constexpr double kAgree_px = 2.5;               // across the epipolar line
constexpr double kMinAgree = 0.5;               // share of the matches; wrong ones are among them
constexpr double kBlur_px = 1.2;                // median of those that agree, in a poor calibration
constexpr double kMinTurn_rad = 0.8 * kDegree;  // between two images, for a judgement
constexpr double kMaxTurnError = 0.5;           // of the turn

// The rays of one feature in two images, each in its camera's frame.
struct RayPair {
  Eigen::Vector3d first, second;
};

std::vector<RayPair> MatchRays(const cv::Mat& first, const Camera& first_camera,
                               const cv::Mat& second, const Camera& second_camera) {
  std::vector<RayPair> rays;
  if (first.empty() || second.empty()) return rays;
  const auto orb = cv::ORB::create(kFeatures);
  std::vector<cv::KeyPoint> first_points, second_points;
  cv::Mat first_descriptors, second_descriptors;
  orb->detectAndCompute(first, cv::noArray(), first_points, first_descriptors);
  orb->detectAndCompute(second, cv::noArray(), second_points, second_descriptors);
  if (first_points.empty() || second_points.empty()) return rays;
  std::vector<cv::DMatch> matches;
  cv::BFMatcher(cv::NORM_HAMMING, true).match(first_descriptors, second_descriptors, matches);
  for (const cv::DMatch& match : matches) {
    if (match.distance > kMaxDescriptorDistance) continue;
    const cv::Point2f a = first_points[match.queryIdx].pt, b = second_points[match.trainIdx].pt;
    const auto ray_a = first_camera.Unproject({a.x, a.y});
    const auto ray_b = second_camera.Unproject({b.x, b.y});
    if (ray_a && ray_b) rays.push_back({*ray_a, *ray_b});
  }
  return rays;
}

// How far, in radians, a match is off the epipolar plane of a stereo pair; nothing where the point
// would lie behind a camera.
std::optional<double> EpipolarError_rad(const RayPair& rays, const RigidTransform& T_first_second) {
  const Eigen::Vector3d second = T_first_second.rotation * rays.second;
  const Eigen::Vector3d t = T_first_second.translation.normalized();
  const double angle_rad =
      std::asin(std::clamp(t.cross(second).normalized().dot(rays.first), -1.0, 1.0));
  // In front of both: the first ray lies between the baseline and the second ray.
  constexpr double kFarSlack_rad = 2e-3;
  if (std::acos(std::clamp(t.dot(second), -1.0, 1.0)) <
      std::acos(std::clamp(t.dot(rays.first), -1.0, 1.0)) - kFarSlack_rad) {
    return std::nullopt;
  }
  return std::abs(angle_rad);
}

struct Agreement {
  double share = 0;      // of the matches
  double median_px = 0;  // of those
};

Agreement StereoAgreement(const std::vector<RayPair>& matches, const RigidTransform& T_first_second,
                          double focal_px) {
  std::vector<double> errors_px;
  for (const RayPair& rays : matches) {
    const std::optional<double> error_rad = EpipolarError_rad(rays, T_first_second);
    if (error_rad && *error_rad * focal_px < kAgree_px) errors_px.push_back(*error_rad * focal_px);
  }
  return {static_cast<double>(errors_px.size()) / static_cast<double>(matches.size()),
          Median(errors_px)};
}

std::vector<RayPair> StereoMatches(const SequenceSource& source, bool swapped,
                                   const Progress& progress) {
  const auto& cameras = source.info().rig.cameras;
  const size_t pairs = source.info().pair_stamps_ns.size();
  std::vector<RayPair> matches;
  for (size_t i = 0; i < pairs; i += std::max<size_t>(1, pairs / kStereoSamples)) {
    progress.ReportOrStop(static_cast<double>(i) / static_cast<double>(pairs));
    const cv::Mat first = source.ReadImage(i, swapped ? 1 : 0).image;
    const cv::Mat second = source.ReadImage(i, swapped ? 0 : 1).image;
    const auto added = MatchRays(first, cameras[0], second, cameras[1]);
    matches.insert(matches.end(), added.begin(), added.end());
  }
  return matches;
}

void CheckStereo(const SequenceSource& source, const Progress& progress, CheckReport* report) {
  const Rig& rig = source.info().rig;
  const auto& poses = rig.T_imu_camera;
  const double focal_px = rig.cameras[0].fx_px;
  const std::vector<RayPair> matches = StereoMatches(source, false, progress.Part(0, 0.5));
  report->AddFigure("features matched left to right", static_cast<double>(matches.size()), "");
  if (matches.size() < kMinMatches) {
    report->Warn("texture", fmt::format("only {} features matched left to right", matches.size()),
                 "check focus, light and that both cameras see the same");
    return;
  }
  const Agreement given = StereoAgreement(matches, poses[0].Inverse() * poses[1], focal_px);
  report->AddFigure("matches that agree with calibration", 100 * given.share, "%");
  report->AddFigure("their median distance from the row", given.median_px, "px");
  const std::string found =
      fmt::format("{:.0f} % of the features matched left to right agree with the calibration",
                  100 * given.share);
  if (given.share >= kMinAgree) {
    if (given.median_px > kBlur_px) {
      report->Warn("calibration",
                   fmt::format("matches are {:.1f} px off their rows", given.median_px),
                   "calibrate the cameras anew");
    }
    return;
  }
  const std::vector<RayPair> swapped = StereoMatches(source, true, progress.Part(0.5, 1));
  const Agreement if_swapped =
      swapped.empty() ? Agreement()
                      : StereoAgreement(swapped, poses[0].Inverse() * poses[1], focal_px);
  const Agreement if_inverted = StereoAgreement(matches, poses[0] * poses[1].Inverse(), focal_px);
  if (if_swapped.share >= kMinAgree) {
    report->Fail(
        "left-right",
        found + fmt::format(", {:.0f} % if left and right are swapped", 100 * if_swapped.share),
        "swap the images of cam0 and cam1");
  } else if (if_inverted.share >= kMinAgree) {
    report->Fail(
        "extrinsics-direction",
        found + fmt::format(", {:.0f} % with inverted transforms", 100 * if_inverted.share),
        "invert T_BS or T_cam_imu (T_BS and T_imu_cam map camera to IMU)");
  } else {
    report->Warn("calibration", found,
                 "calibrate the cameras anew, and check their synchronisation");
  }
}

// Two images in a row with the rotation between them by the gyroscope, in the IMU frame.
struct Turn {
  size_t first = 0;
  Eigen::Quaterniond R_second_first;
  Eigen::Quaterniond R_second_first_as_deg;  // if the gyroscope is in deg/s
};

Eigen::Quaterniond Integrate(const std::vector<ImuSample>& imu, int64_t from_ns, int64_t to_ns,
                             double unit_rad_s) {
  Eigen::Quaterniond R_first_second = Eigen::Quaterniond::Identity();
  auto sample =
      std::lower_bound(imu.begin(), imu.end(), from_ns,
                       [](const ImuSample& s, int64_t stamp_ns) { return s.stamp_ns < stamp_ns; });
  for (; sample != imu.end() && sample + 1 != imu.end() && sample->stamp_ns < to_ns; ++sample) {
    const double step_s = ToSeconds(std::min((sample + 1)->stamp_ns, to_ns) - sample->stamp_ns);
    R_first_second =
        R_first_second * ExpRotation(sample->angular_velocity_rad_s * (unit_rad_s * step_s));
  }
  return R_first_second.conjugate();
}

// The steps from image to image that turn most.
std::vector<Turn> LargestTurns(const SourceInfo& info, const std::vector<ImuSample>& imu) {
  const int64_t offset_ns = ToNanoseconds(info.rig.camera_time_offset_s);
  std::vector<Turn> turns;
  for (size_t i = 0; i + 1 < info.pair_stamps_ns.size(); ++i) {
    const int64_t from_ns = info.pair_stamps_ns[i] + offset_ns;
    const int64_t to_ns = info.pair_stamps_ns[i + 1] + offset_ns;
    if (from_ns < imu.front().stamp_ns || to_ns > imu.back().stamp_ns) continue;
    turns.push_back(
        {i, Integrate(imu, from_ns, to_ns, 1), Integrate(imu, from_ns, to_ns, kDegree)});
  }
  const auto angle = [](const Turn& turn) { return LogRotation(turn.R_second_first).norm(); };
  std::stable_sort(turns.begin(), turns.end(),
                   [&](const Turn& a, const Turn& b) { return angle(a) > angle(b); });
  if (turns.size() > kTurnSamples) turns.resize(kTurnSamples);
  return turns;
}

double TurnError_rad(const std::vector<RayPair>& matches, const Eigen::Quaterniond& R_imu,
                     const Eigen::Quaterniond& R_imu_camera) {
  const Eigen::Quaterniond R = R_imu_camera.conjugate() * R_imu * R_imu_camera;
  std::vector<double> errors_rad;
  for (const RayPair& rays : matches) {
    errors_rad.push_back((R * rays.first - rays.second).norm());
  }
  return Median(errors_rad);
}

void CheckTurns(const SequenceSource& source, const std::vector<ImuSample>& imu,
                const Progress& progress, CheckReport* report) {
  const Camera& camera = source.info().rig.cameras[0];
  const Eigen::Quaterniond R_given = source.info().rig.T_imu_camera[0].rotation;
  std::vector<double> still, given, inverted, as_deg;  // errors if nothing turned, and if so
  for (const Turn& turn : LargestTurns(source.info(), imu)) {
    progress.ReportOrStop(static_cast<double>(still.size()) / kTurnSamples);
    const auto matches = MatchRays(source.ReadImage(turn.first, 0).image, camera,
                                   source.ReadImage(turn.first + 1, 0).image, camera);
    if (matches.size() < kMinMatches / 2) continue;
    still.push_back(TurnError_rad(matches, Eigen::Quaterniond::Identity(), R_given));
    given.push_back(TurnError_rad(matches, turn.R_second_first, R_given));
    inverted.push_back(TurnError_rad(matches, turn.R_second_first, R_given.conjugate()));
    as_deg.push_back(TurnError_rad(matches, turn.R_second_first_as_deg, R_given));
  }
  const double seen_rad = Median(still), error_rad = Median(given);
  if (seen_rad < kMinTurn_rad) return;
  report->AddFigure("largest turns between images, as seen", seen_rad / kDegree, "deg");
  report->AddFigure("their difference from the gyroscope", error_rad / kDegree, "deg");
  if (error_rad < kMaxTurnError * seen_rad) return;
  const std::string found =
      fmt::format("images turn by {:.2f} deg, which the gyroscope explains up to {:.2f} deg",
                  seen_rad / kDegree, error_rad / kDegree);
  if (Median(inverted) < kMaxTurnError * error_rad) {
    report->Fail("extrinsics-direction", found + ", and better with inverted transforms",
                 "invert T_BS or T_cam_imu (T_BS and T_imu_cam map camera to IMU)");
  } else if (Median(as_deg) < kMaxTurnError * error_rad) {
    report->Fail("imu-units", found + ", and better in deg/s",
                 "the gyroscope seems to be in deg/s: multiply by pi / 180");
  } else {
    report->Warn("imu-camera", found,
                 "check the rotation between IMU and camera, the axes of the IMU, and the time "
                 "offset between the two");
  }
}

}  // namespace

void CheckGeometry(const SequenceSource& source, const std::vector<ImuSample>& samples,
                   const Progress& progress, CheckReport* report) {
  if (IsStereo(source.info().rig)) CheckStereo(source, progress.Part(0, 0.6), report);
  CheckTurns(source, samples, progress.Part(0.6, 1), report);
}

}  // namespace slcmap
