#include "mapping/external_poses/read_poses.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>

#include "data/core/error.h"
#include "data/core/math.h"
#include "mapping/external_poses/pose_changes.h"

namespace slcmap::inline mapping {
namespace {

constexpr double kLeastForce_m_s2 = 8;  // of gravity's, else samples are no m/s^2

Clock CollectStamps(const Sequence& recording) {
  Clock stamps_ns;
  for (const StereoEntry& pair : recording.images) stamps_ns.push_back(pair.stamp_ns);
  return stamps_ns;
}

// Images at a pose, or between two near ones.
std::vector<int64_t> StampsWithPose(const Clock& clock, const Trajectory& trajectory) {
  constexpr double kGap_s = 0.1, kNear_s = 0.005;
  std::vector<int64_t> stamps_ns;
  std::ranges::copy_if(clock, std::back_inserter(stamps_ns), [&](int64_t stamp_ns) {
    return PoseNear(trajectory, stamp_ns, kGap_s, kNear_s).has_value();
  });
  return stamps_ns;
}

[[noreturn]] void Refuse(const std::string& path, const std::string& words,
                         const std::string& remedy) {
  throw DataError(
      fmt::format("{}: found poses that do not fit the recording: {}; {}", path, words, remedy));
}

std::string FormatRemedy(const PoseForm& form) { return "give " + FormatOptions(form); }

// Velocity of the poses about a place in the trajectory.
Eigen::Vector3d VelocityAt(const Trajectory& trajectory, bool at_end) {
  constexpr double kSpan_s = 0.1;
  const StampedPose& here = at_end ? trajectory.back() : trajectory.front();
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  for (size_t i = 0; i < trajectory.size(); ++i) {
    const StampedPose& there = at_end ? trajectory[trajectory.size() - 1 - i] : trajectory[i];
    const double span_s = ToSeconds(there.stamp_ns - here.stamp_ns);
    if (std::abs(span_s) < kSpan_s) continue;
    velocity = (there.T_world_imu.translation - here.T_world_imu.translation) / span_s;
    break;
  }
  return velocity;
}

// The mean of the accelerometer's readings in the world of the poses. None where few poses have a
// sample, or samples are no m/s^2.
std::optional<Eigen::Vector3d> MeanForce(const std::vector<ImuSample>& imu, int64_t ahead_ns,
                                         const Trajectory& trajectory) {
  constexpr int64_t kNear_ns = 20'000'000;
  constexpr int kLeastPoses = 40;  // whose accelerations average out
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double norms_m_s2 = 0;
  int count = 0;
  for (const StampedPose& pose : trajectory) {
    const int64_t at_ns = pose.stamp_ns + ahead_ns;
    const auto sample = std::ranges::lower_bound(imu, at_ns, {}, &ImuSample::stamp_ns);
    if (sample == imu.end() || sample->stamp_ns - at_ns > kNear_ns) continue;
    if (!sample->specific_force_m_s2.allFinite()) continue;
    sum += pose.T_world_imu.rotation * sample->specific_force_m_s2;
    norms_m_s2 += sample->specific_force_m_s2.norm();
    ++count;
  }
  if (count < kLeastPoses || norms_m_s2 < kLeastForce_m_s2 * count) return std::nullopt;
  return sum / count;
}

}  // namespace

std::optional<Eigen::Vector3d> UpByForce(const Sequence& recording, const Trajectory& trajectory) {
  constexpr double kLeastSpan_s = 2;
  if (recording.imu.empty()) return std::nullopt;
  const int64_t ahead_ns = ToNanoseconds(recording.rig.camera_time_offset_s);
  Trajectory covered = trajectory;
  std::erase_if(covered, [&](const StampedPose& pose) {
    return pose.stamp_ns + ahead_ns < recording.imu.front().stamp_ns ||
           pose.stamp_ns + ahead_ns > recording.imu.back().stamp_ns;
  });
  if (covered.empty()) return std::nullopt;
  const double span_s = ToSeconds(covered.back().stamp_ns - covered.front().stamp_ns);
  const auto force = MeanForce(recording.imu, ahead_ns, covered);
  if (!force || span_s < kLeastSpan_s) return std::nullopt;
  const Eigen::Vector3d gravity =
      *force - (VelocityAt(covered, true) - VelocityAt(covered, false)) / span_s;
  if (gravity.norm() < kLeastForce_m_s2) return std::nullopt;
  return gravity.normalized();
}

namespace {

// Poses that the images agree with may still be in a world that lies on its side.
void RefuseOtherUp(const std::string& path, const PoseForm& form, const Sequence& recording,
                   const Trajectory& trajectory) {
  constexpr double kMostTilt_rad = 5 * kDegree;
  std::string by = "the accelerometer";
  std::optional<Eigen::Vector3d> up = UpByForce(recording, trajectory);
  if (!up && recording.imu.empty()) {
    up = UpByImages(recording, trajectory);
    by = "upright edges in the images, which are taken to be seen the right way up";
  }
  if (!up || up->z() > std::cos(kMostTilt_rad)) return;
  // In the world of the file, which `form` has turned.
  const Eigen::Vector3d in_file = TurnUp(form.Up()).conjugate() * *up;
  PoseForm remedy = form;
  remedy.up = UpInWords(in_file);
  Refuse(path,
         fmt::format("up is {} in their world, not {} ({:.1f} degrees off, by {})", remedy.up,
                     form.up, kDegreesPerRadian * std::acos(std::clamp(up->z(), -1.0, 1.0)), by),
         FormatRemedy(remedy));
}

}  // namespace

ExternalPoses ReadExternalPoses(const std::string& path, const PoseForm& form,
                                const Sequence& recording, bool refuses_unexplained,
                                const Progress& progress) {
  const Clock clock = CollectStamps(recording);
  const PoseTable table = ReadPoseTable(path, form, clock);
  const RigidTransform& T_imu_camera = recording.rig.T_imu_camera[0];
  ExternalPoses given;
  given.trajectory = CollectPoses(table, form, T_imu_camera);
  if (IsStereo(recording.rig)) {
    const double spacing_s = std::max(kStepOfPoses_s, MedianPeriod_s(given.trajectory));
    const auto pairs =
        PairsToCompare(recording.images, StampsWithPose(clock, given.trajectory), spacing_s);
    const std::vector<BodyStep> steps = StepsOfImages(recording, pairs, progress);
    given.reading = ClassifyReading(table, form, steps, T_imu_camera, "pairs of images");
    const PoseReading& reading = given.reading;
    if (!reading.agrees && reading.is_explained) {
      Refuse(path, reading.words, FormatRemedy(reading.form));
    }
    if (!reading.agrees && refuses_unexplained) {
      Refuse(path, reading.words,
             "expected poses of the IMU or the left camera of this recording, in one world");
    }
  }
  if (!given.reading.change.empty()) {
    spdlog::warn("{}: poses and images disagree: {}", path, given.reading.change);
  }
  if (given.reading.agrees) RefuseOtherUp(path, form, recording, given.trajectory);
  given.world_offset_m = MoveNearOrigin(&given.trajectory);
  if (!given.world_offset_m.isZero()) {
    const Eigen::Vector3d& o = given.world_offset_m;
    spdlog::warn(
        "{}: poses are {:.0f} km from the origin of their world: the map's is moved there, to "
        "{:.0f}, "
        "{:.0f}, {:.0f} m, and its files say so (world_offset_m)",
        path, 1e-3 * o.norm(), o.x(), o.y(), o.z());
  }
  return given;
}

std::string TooFarMoved(const ExternalPoseFigures& figures, double off_by_pairs_rad,
                        double off_by_pairs_m) {
  // What a tracker's own calibration is off, and what pairs of images leave open.
  constexpr double kMost_rad = 0.02, kMost_m = 0.05, kTimes = 3;
  const double turned_rad = figures.body_turned_rad + figures.turned_rad,
               moved_m = figures.body_shifted_m + figures.moved_m;
  if (turned_rad <= kMost_rad + kTimes * off_by_pairs_rad &&
      moved_m <= kMost_m + kTimes * off_by_pairs_m) {
    return "";
  }
  return fmt::format(
      "poses were moved by {:.1f} degrees and {:.0f} mm, of which single pairs of images show "
      "{:.1f} degrees and {:.0f} mm",
      kDegreesPerRadian * turned_rad, 1e3 * moved_m, kDegreesPerRadian * off_by_pairs_rad,
      1e3 * off_by_pairs_m);
}

}  // namespace slcmap::mapping
