// Whether left and right images agree with the calibration, by the epipolar constraint; where they
// do not, which mistake would explain it.
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <opencv2/features2d.hpp>
#include <optional>

#include "data/calibration/calibration.h"
#include "data/check/check.h"
#include "data/check/row_alignment.h"
#include "data/check/view_geometry.h"
#include "data/core/math.h"
#include "data/source/asl_files.h"

namespace slcmap::inline data {
namespace {

constexpr size_t kStereoSamples = 12, kRowSamples = 24;
constexpr int kStereoFeatures = 400;
constexpr double kMaxDescriptorDistance = 48;  // of 256 bits
constexpr size_t kMinMatches = 60;             // in all, for a judgement
constexpr double kMinAgree = 0.5;              // share of the matches; wrong ones are among them
constexpr double kStereoMuchBetter = 1.3;      // times the share, for a mistake to be named
constexpr double kBlur_px = 1.2;               // median of those that agree, in a poor calibration
constexpr double kMaxRowsTurn_rad = 0.02 * kDegree, kGrossTurn_rad = 1 * kDegree;
constexpr double kStereoClear = 6;  // standard deviations
constexpr int kMinFineMatches = 150;
constexpr double kPoorRows_px = 0.55;      // once mended: the intrinsics are wrong
constexpr double kIntrinsicsBetter = 0.6;  // of that, for a mistake to be named

// One feature in both images.
struct PixelPair {
  Eigen::Vector2d left_px, right_px;
};

void MatchFeatures(const cv::Mat& left, const cv::Mat& right, const std::vector<cv::Mat>& masks,
                   std::vector<PixelPair>* pairs) {
  if (left.empty() || right.empty()) return;
  const auto orb = cv::ORB::create(kStereoFeatures);
  std::vector<cv::KeyPoint> left_points, right_points;
  cv::Mat left_descriptors, right_descriptors;
  orb->detectAndCompute(left, masks[0], left_points, left_descriptors);
  orb->detectAndCompute(right, masks[1], right_points, right_descriptors);
  if (left_points.empty() || right_points.empty()) return;
  std::vector<cv::DMatch> matches;
  cv::BFMatcher(cv::NORM_HAMMING, true).match(left_descriptors, right_descriptors, matches);
  for (const cv::DMatch& match : matches) {
    if (match.distance > kMaxDescriptorDistance) continue;
    const cv::Point2f a = left_points[match.queryIdx].pt, b = right_points[match.trainIdx].pt;
    pairs->push_back({{a.x, a.y}, {b.x, b.y}});
  }
}

// Of left images with right ones that are so many pairs later.
std::vector<PixelPair> Matches(const SequenceSource& source, int later, const Progress& progress) {
  const auto all = static_cast<int>(source.info().pair_stamps_ns.size());
  std::vector<PixelPair> pairs;
  for (int i = 0; i < all; i += std::max(1, all / static_cast<int>(kStereoSamples))) {
    progress.ReportOrStop(static_cast<double>(i) / static_cast<double>(all));
    if (i + later < 0 || i + later >= all) continue;
    MatchFeatures(source.ReadImage(i, 0).image, source.ReadImage(i + later, 1).image,
                  source.info().rig.masks, &pairs);
  }
  return pairs;
}

std::vector<RayPair> CollectRays(const std::vector<PixelPair>& pairs, const Rig& rig) {
  std::vector<RayPair> rays;
  for (const PixelPair& pair : pairs) {
    const auto left = rig.cameras[0].Unproject(pair.left_px);
    const auto right = rig.cameras[1].Unproject(pair.right_px);
    if (left && right) rays.push_back({*left, *right});
  }
  return rays;
}

// How far, in radians, a match is off the epipolar plane; nothing where the point would lie behind
// a camera.
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

Agreement ComputeAgreement(const std::vector<PixelPair>& pairs, const Rig& rig) {
  const RigidTransform T_left_right = LeftRight(rig);
  std::vector<double> errors_px;
  for (const RayPair& rays : CollectRays(pairs, rig)) {
    const std::optional<double> error_rad = EpipolarError_rad(rays, T_left_right);
    if (error_rad && *error_rad * rig.cameras[0].MiddleFocal_px() < kAgree_px) {
      errors_px.push_back(*error_rad * rig.cameras[0].MiddleFocal_px());
    }
  }
  return {static_cast<double>(errors_px.size()) /
              static_cast<double>(std::max<size_t>(1, pairs.size())),
          Median(errors_px)};
}

// A mistake that could explain images which do not agree, and the rig or images without it.
struct Mistake {
  const char* name;
  const char* words;
  const char* remedy;
  Rig rig;
  bool swap_images = false;
};

Rig Changed(const Rig& rig, void (*change)(Rig*)) {
  Rig changed = rig;
  change(&changed);
  return changed;
}

void NegateBaseline(Rig* rig) {
  auto& poses = rig->T_imu_camera;
  poses[1].translation = 2 * poses[0].translation - poses[1].translation;
}

// A change of both cameras.
template <typename Change>
Rig BothChanged(Rig rig, Change change) {
  for (Camera& camera : rig.cameras) change(&camera);
  return rig;
}

void ScaleFocal(Camera* camera, double scale) {
  camera->fx_px *= scale;
  camera->fy_px *= scale;
}

void ReorderIntrinsics(Camera* camera) { std::swap(camera->fy_px, camera->cx_px); }

void ScaleIntrinsics(Camera* camera, double scale) {
  for (double* value : {&camera->fx_px, &camera->fy_px, &camera->cx_px, &camera->cy_px}) {
    *value *= scale;
  }
}

std::vector<Mistake> ExtrinsicMistakes(const Rig& rig) {
  const char* const direction =
      "T_BS and T_imu_cam map camera to IMU, T_cam_imu maps IMU to camera; invert what is given";
  return {
      {"left-right", "the images of left and right swapped", "swap the images of cam0 and cam1",
       rig, true},
      {"extrinsics-direction", "inverted transforms of both cameras", direction,
       Changed(rig,
               [](Rig* r) {
                 for (auto& T : r->T_imu_camera) T = T.Inverse();
               })},
      {"extrinsics-direction", "transposed rotations of both cameras",
       "transpose the rotations of T_BS (T_imu_cam, T_cam_imu): its rows are those of the file",
       Changed(rig,
               [](Rig* r) {
                 for (auto& T : r->T_imu_camera) T.rotation = T.rotation.conjugate();
               })},
      {"extrinsics-direction", "an inverted transform of the right camera", direction,
       Changed(rig, [](Rig* r) { r->T_imu_camera[1] = r->T_imu_camera[1].Inverse(); })},
      {"extrinsics-direction", "an inverted transform of the left camera", direction,
       Changed(rig, [](Rig* r) { r->T_imu_camera[0] = r->T_imu_camera[0].Inverse(); })},
      {"baseline", "the right camera on the other side of the left one",
       "correct the sign of the translation between cam0 and cam1", Changed(rig, NegateBaseline)}};
}

std::vector<Mistake> IntrinsicMistakes(const Rig& rig) {
  const auto scaled = [&](double scale) {
    return BothChanged(rig, [&](Camera* c) { ScaleIntrinsics(c, scale); });
  };
  const auto longer = [&](double scale) {
    return BothChanged(rig, [&](Camera* c) { ScaleFocal(c, scale); });
  };
  return {
      {"intrinsics", "intrinsics in the order fx, fy, cx, cy", "write intrinsics as fx, fy, cx, cy",
       BothChanged(rig, ReorderIntrinsics)},
      {"intrinsics", "intrinsics of twice the size",
       "calibrate for images of this size: multiply the intrinsics by 2", scaled(2)},
      {"intrinsics", "intrinsics of half the size",
       "calibrate for images of this size: multiply the intrinsics by 0.5", scaled(0.5)},
      {"focal-length", "focal lengths twice as long", "multiply the focal lengths by 2", longer(2)},
      {"focal-length", "focal lengths half as long", "multiply the focal lengths by 0.5",
       longer(0.5)},
      {"distortion", "the signs of the distortion coefficients changed",
       "copy the distortion coefficients anew, with their signs", BothChanged(rig, [](Camera* c) {
         c->coefficients *= -1;
         c->higher_coefficients *= -1;
       })}};
}

// The mistake whose mending makes the images agree best, where that is clearly better than `given`.
const Mistake* BestMistake(const std::vector<Mistake>& mistakes,
                           const std::vector<PixelPair>& pairs, const Agreement& given,
                           Agreement* best) {
  std::vector<PixelPair> swapped;
  for (const PixelPair& pair : pairs) swapped.push_back({pair.right_px, pair.left_px});
  const Mistake* found = nullptr;
  *best = {std::max(kMinAgree, kStereoMuchBetter * given.share), 0};
  for (const Mistake& mistake : mistakes) {
    const Agreement mended = ComputeAgreement(mistake.swap_images ? swapped : pairs, mistake.rig);
    if (mended.share <= best->share) continue;
    *best = mended;
    found = &mistake;
  }
  return found;
}

std::string InDegrees(const Eigen::Vector3d& turn_rad) {
  const Eigen::Vector3d turn = turn_rad / kDegree;
  return fmt::format("({:.3f}, {:.3f}, {:.3f}) degrees about its x, y, z", turn.x(), turn.y(),
                     turn.z());
}

Rig WithRightTurned(Rig rig, const Eigen::Vector3d& turn_rad) {
  Eigen::Quaterniond& rotation = rig.T_imu_camera[1].rotation;
  rotation = (rotation * ExpRotation(turn_rad)).normalized();
  return rig;
}

// Of what rows are off: a mend that leaves more is none.
constexpr double kMendedShare = 0.9;

bool IsTurnClear(const RowAlignment& rows) {
  for (int axis = 0; axis < 3; ++axis) {
    const double least_rad = std::max(kMaxRowsTurn_rad, kStereoClear * rows.turn_sigma_rad[axis]);
    if (std::abs(rows.turn_rad[axis]) > least_rad) return true;
  }
  return false;
}

std::string InPercent(double right_focal) { return fmt::format("{:+.2f} %", 100 * right_focal); }

void JudgeTurn(const RowAlignment& rows, const std::string& found, const Rig& given,
               const Rig& mended, CheckReport* report) {
  const Eigen::Matrix3d R = mended.T_imu_camera[1].rotation.toRotationMatrix();
  const Eigen::Quaterniond T =
      (given.T_imu_camera[0].rotation.conjugate() * mended.T_imu_camera[1].rotation);
  const std::string remedy = fmt::format(
      "calibrate the cameras anew, or give cam1 this rotation to the IMU: [{:.6f}, {:.6f}, {:.6f}; "
      "{:.6f}, {:.6f}, {:.6f}; {:.6f}, {:.6f}, {:.6f}] ({:.3f} degrees from cam0's)",
      R(0, 0), R(0, 1), R(0, 2), R(1, 0), R(1, 1), R(1, 2), R(2, 0), R(2, 1), R(2, 2),
      LogRotation(T).norm() / kDegree);
  if (rows.turn_rad.norm() > kGrossTurn_rad) {
    report->Fail("rectification", found, remedy);
    return;
  }
  report->Warn("rectification", found, remedy);
  report->corrections.push_back({kRightTurnCorrection,
                                 {rows.turn_rad.x(), rows.turn_rad.y(), rows.turn_rad.z()},
                                 "right camera turned by " + InDegrees(rows.turn_rad)});
}

void JudgeRows(const RowAlignment& rows, const Rig& given, const Rig& mended, CheckReport* report) {
  if (rows.mended_rows_px > kMendedShare * rows.rows_px) return;
  const std::string found =
      fmt::format(
          "matches are {:.2f} px off their rows, {:.2f} px with the right camera turned by "
          "{}",
          rows.rows_px, rows.mended_rows_px, InDegrees(rows.turn_rad)) +
      (rows.right_focal == 0 ? ""
                             : " and its focal lengths " + InPercent(rows.right_focal) + " longer");
  if (IsTurnClear(rows)) JudgeTurn(rows, found, given, mended, report);
  if (rows.right_focal == 0) return;
  report->Warn("focal-lengths", found,
               fmt::format("calibrate the cameras anew, or multiply fx and fy of cam1 by {:.5f}",
                           1 + rows.right_focal));
  const double half = 0.5 * rows.right_focal;
  report->corrections.push_back({kFocalCorrection,
                                 {-half, half},
                                 fmt::format("focal lengths longer by {} (left) and {} (right)",
                                             InPercent(-half), InPercent(half))});
}

// The same features as other cameras would see them.
std::vector<RayPair> Reprojected(const std::vector<RayPair>& matches, const Rig& from,
                                 const Rig& to) {
  std::vector<PixelPair> pairs;
  for (const RayPair& rays : matches) {
    const auto left_px = from.cameras[0].Project(rays.first);
    const auto right_px = from.cameras[1].Project(rays.second);
    if (left_px && right_px) pairs.push_back({*left_px, *right_px});
  }
  return CollectRays(pairs, to);
}

// Whether rows that no turn brings together are the fault of the intrinsics.
bool JudgeIntrinsics(const std::vector<RayPair>& matches, const RowAlignment& rows, const Rig& rig,
                     CheckReport* report) {
  const std::string found =
      fmt::format("matches are {:.2f} px off their rows, {:.2f} px with the right camera turned",
                  rows.rows_px, rows.turned_rows_px);
  double best_px = kIntrinsicsBetter * rows.mended_rows_px;
  std::vector<CheckFinding> better;
  for (const Mistake& mistake : IntrinsicMistakes(rig)) {
    const auto changed = AlignRows(Reprojected(matches, rig, mistake.rig), LeftRight(mistake.rig),
                                   rig.cameras[0].MiddleFocal_px());
    if (changed.matches < kMinFineMatches || changed.mended_rows_px > best_px) continue;
    best_px = changed.mended_rows_px;
    better = {{Severity::kError, mistake.name,
               fmt::format("{}, {:.2f} px with {}", found, best_px, mistake.words),
               mistake.remedy}};
  }
  const bool no_distortion =
      rows.mended_rows_px > kPoorRows_px &&
      std::any_of(rig.cameras.begin(), rig.cameras.end(), [](const Camera& camera) {
        const bool has_coefficients = camera.distortion == Distortion::kRadialTangential ||
                                      camera.distortion == Distortion::kEquidistant;
        return has_coefficients && camera.coefficients.isZero() &&
               camera.higher_coefficients.isZero();
      });
  if (no_distortion) {  // whatever else may seem to make up for it
    better = {{Severity::kError, "distortion",
               found + "; the coefficients of its distortion model are all zero",
               "calibrate the cameras, and write the distortion coefficients"}};
  }
  report->findings.insert(report->findings.end(), better.begin(), better.end());
  return !better.empty();
}

// Adds what the rows say, once the right camera is turned by `coarse_rad`.
void CheckRows(const SequenceSource& source, const Eigen::Vector3d& coarse_rad,
               const Progress& progress, CheckReport* report) {
  const Rig& rig = source.info().rig;
  const double focal_px = rig.cameras[0].MiddleFocal_px();
  const Rig near = WithRightTurned(rig, coarse_rad);
  const std::vector<RayPair> matches = MatchFinely(source, near, kRowSamples, progress);
  RowAlignment rows =
      AlignRows(matches, LeftRight(near), focal_px, LongerRays(matches, near.cameras[1]));
  report->AddFigure("features followed left to right", rows.matches, "");
  if (rows.matches < kMinFineMatches || rows.agreeing_share < kMinAgree) return;
  const Rig mended = WithRightTurned(near, rows.turn_rad);
  rows.turn_rad =
      LogRotation(rig.T_imu_camera[1].rotation.conjugate() * mended.T_imu_camera[1].rotation);
  if (coarse_rad.norm() > 0) rows.rows_px = AlignRows(matches, LeftRight(rig), focal_px).rows_px;
  report->AddFigure("their median distance from the row", rows.rows_px, "px");
  report->AddFigure("right camera, turn found about x", rows.turn_rad.x() / kDegree, "deg");
  report->AddFigure("right camera, turn found about y", rows.turn_rad.y() / kDegree, "deg");
  report->AddFigure("right camera, turn found about z", rows.turn_rad.z() / kDegree, "deg");
  report->AddFigure("right camera, focal length found", 100 * rows.right_focal, "% longer");
  if (rows.turned_rows_px > kPoorRows_px && JudgeIntrinsics(matches, rows, near, report)) return;
  JudgeRows(rows, rig, mended, report);
  if (rows.mended_rows_px > kBlur_px) {
    report->Warn("calibration",
                 fmt::format("matches are {:.1f} px off their rows at best", rows.mended_rows_px),
                 "calibrate the cameras anew, and check their synchronisation");
  }
}

// Right images that belong to a pair before or after, where those agree clearly better than
// `share`.
bool JudgeSynchronisation(const SequenceSource& source, const std::string& found, double share,
                          const Progress& progress, CheckReport* report) {
  double best = std::max(kMinAgree, kStereoMuchBetter * share);
  int best_later = 0;
  for (const int later : {1, -1, 2, -2}) {
    const Agreement agreement =
        ComputeAgreement(Matches(source, later, progress), source.info().rig);
    if (agreement.share <= best) continue;
    best = agreement.share;
    best_later = later;
  }
  if (best_later == 0) return false;
  const char* const which = best_later > 0 ? "after" : "before";
  report->Fail("synchronisation",
               fmt::format("{}, {:.0f} % with the right images of {} pair {}", found, 100 * best,
                           std::abs(best_later) == 1 ? "the" : "the second", which),
               fmt::format("the images of cam1 are {} {}: pair those of cam0 with them by their "
                           "true stamps, as {} rows {} in cam1/data.csv",
                           std::abs(best_later), best_later > 0 ? "late" : "early",
                           std::abs(best_later), best_later > 0 ? "further down" : "further up"));
  return true;
}

// Images that do not agree with the calibration. Returns a turn of the right camera that would
// explain it, or nothing once it is judged.
std::optional<Eigen::Vector3d> JudgeDisagreement(const SequenceSource& source,
                                                 const std::vector<PixelPair>& pairs,
                                                 const Agreement& given, const Progress& progress,
                                                 CheckReport* report) {
  const Rig& rig = source.info().rig;
  const std::string found =
      fmt::format("{:.0f} % of the features matched left to right agree with the calibration",
                  100 * given.share);
  const RowAlignment rows =
      AlignRows(CollectRays(pairs, rig), LeftRight(rig), rig.cameras[0].MiddleFocal_px());
  const Agreement turned = ComputeAgreement(pairs, WithRightTurned(rig, rows.turn_rad));
  std::vector<Mistake> mistakes = ExtrinsicMistakes(rig);
  const std::vector<Mistake> intrinsic = IntrinsicMistakes(rig);
  mistakes.insert(mistakes.end(), intrinsic.begin(), intrinsic.end());
  Agreement best;
  const Mistake* mistake = BestMistake(mistakes, pairs, given, &best);
  if (JudgeSynchronisation(source, found,
                           std::max(given.share, mistake != nullptr ? best.share : 0), progress,
                           report)) {
    return std::nullopt;
  }
  if (turned.share >= kMinAgree && turned.share > kStereoMuchBetter * given.share &&
      turned.share > (mistake != nullptr ? best.share : 0) - 0.05 &&
      rows.turn_rad.norm() < 10 * kDegree) {
    return rows.turn_rad;
  }
  if (mistake != nullptr) {
    report->Fail(mistake->name,
                 fmt::format("{}, {:.0f} % with {}", found, 100 * best.share, mistake->words),
                 mistake->remedy);
  } else if (given.share < kMinAgree) {
    report->Warn("calibration", found,
                 "calibrate the cameras anew, and check their synchronisation");
  }
  return std::nullopt;
}

}  // namespace

void CheckStereo(const SequenceSource& source, const Progress& progress, CheckReport* report) {
  const Rig& rig = source.info().rig;
  const std::vector<PixelPair> pairs = Matches(source, 0, progress.Part(0, 0.4));
  report->AddFigure("features matched left to right", static_cast<double>(pairs.size()), "");
  if (pairs.size() < kMinMatches) {
    report->Warn("texture", fmt::format("only {} features matched left to right", pairs.size()),
                 "check focus, light and that both cameras see the same");
    return;
  }
  const Agreement given = ComputeAgreement(pairs, rig);
  report->AddFigure(kAgreeingMatches, 100 * given.share, "%");
  // In images of two times, what turned meanwhile would look like a turned camera.
  if (rig.right_time_offset_s != 0) return;
  Eigen::Vector3d coarse_rad = Eigen::Vector3d::Zero();
  if (given.share < kMinAgree || given.median_px > kBlur_px) {
    const auto turn_rad = JudgeDisagreement(source, pairs, given, progress.Part(0.4, 0.5), report);
    if (turn_rad) coarse_rad = *turn_rad;
    if (!turn_rad && (given.share < kMinAgree || !report->Usable())) return;
  }
  CheckRows(source, coarse_rad, progress.Part(0.5, 1), report);
}

}  // namespace slcmap::data
