// Runs the estimator on simulated tracks, without any image.
#pragma once

#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <random>
#include <unordered_set>
#include <vector>

#include "data/simulator/motion.h"
#include "odometry/options.h"
#include "odometry/window/estimator.h"
#include "tests/testing/example.h"
#include "tests/testing/line_track_simulator.h"
#include "tests/testing/track_simulator.h"

namespace slcmap {

// Plays simulated tracks to an estimator; what it removes stays away.
class SimulatedPoints final : public PointSource {
 public:
  // Each Detect() adds so many points that no other image has, but for the right one, which has
  // every other of them, as if it were there.
  explicit SimulatedPoints(int noise_points = 0) : noise_points_(noise_points) {}

  void Show(const SimulatedTrackFrame& frame, bool stereo, double outlier_share) {
    observations_.clear();
    stereo_ = stereo;
    for (const SimulatedTrack& track : frame.tracks) {
      if (removed_.count(track.id)) continue;
      PointObservation point;
      point.id = track.id;
      point.left_px = track.left_px;
      point.camera = track.camera;
      if (stereo) point.right_px = track.right_px;
      const int age = ages_[track.id]++;
      if (static_cast<double>(track.id % 1000) < 1000 * outlier_share) point.left_px.y() += age;
      observations_.push_back(point);
    }
  }
  void Blind() { observations_.clear(); }
  void Spoil() {
    if (observations_.empty()) return;
    observations_.front().left_px.x() = std::numeric_limits<double>::quiet_NaN();
  }
  const std::vector<PointObservation>& observations() const override { return observations_; }
  void Detect() override {
    std::uniform_real_distribution<double> x_px(60, 600), y_px(20, 400), disparity_px(3, 40);
    for (int i = 0; i < noise_points_; ++i) {
      PointObservation& point = observations_.emplace_back();
      point.id = next_noise_id_++;
      point.left_px.x() = x_px(generator_);
      point.left_px.y() = y_px(generator_);
      const Eigen::Vector2d to_right_px(-disparity_px(generator_), 0);
      if (stereo_ && i % 2 == 0) point.right_px = point.left_px + to_right_px;
    }
  }
  void Remove(const std::unordered_set<int64_t>& ids) override {
    removed_.insert(ids.begin(), ids.end());
    erased_ += std::erase_if(observations_,
                             [&](const PointObservation& p) { return ids.count(p.id) > 0; });
  }
  void Reset() override { observations_.clear(); }
  size_t removed() const { return erased_; }  // while they were visible

 private:
  const int noise_points_;
  bool stereo_ = false;
  int64_t next_noise_id_ = 1'000'000'000;  // beyond those of the tracks
  std::mt19937 generator_{1};
  std::vector<PointObservation> observations_;
  std::unordered_set<int64_t> removed_;
  std::map<int64_t, int> ages_;
  size_t erased_ = 0;
};

// Between the ids of an edge's tracks, where they break off.
inline constexpr int64_t kLineIdStep = 1'000'000;

// How the calibration that the estimator is given differs from the true one.
struct CalibrationFault {
  int64_t stamps_late_ns = 0;  // of the images
  // Claimed R_imu_camera = Exp(.) R_imu_camera, of both cameras, as if the IMU were turned.
  Eigen::Vector3d imu_rotation_rad = Eigen::Vector3d::Zero();
  // Claimed R_imu_right = R_imu_right Exp(.).
  Eigen::Vector3d right_rotation_rad = Eigen::Vector3d::Zero();
  double focal_length = 0;  // claimed longer by this share
  // What the IMU's readings are to be corrected for, unknown to the estimator.
  ImuErrors imu_errors = ImuErrors::Zero();
  // Claimed principal point of the right camera less its true one.
  Eigen::Vector2d right_centre_px = Eigen::Vector2d::Zero();
  double readout_s = 0;  // claimed less true

  Rig Claimed(Rig rig) const;
  ImuSample Misread(ImuSample sample) const;  // what the IMU reads instead
  CalibrationVector Expected() const;         // what the estimator should find
};

struct SimulatedRunOptions {
  // Readings of the simulated IMU have the right scale and axes unless a test says otherwise, which
  // then asks for their estimate.
  SimulatedRunOptions() { odometry.calibration.imu_scale = odometry.calibration.imu_axes = false; }

  double duration_s = 20;
  double stand_still_s = 2;
  double pixel_sigma_px = 0;
  bool imu_noise = false;
  double imu_rate_hz = 200;
  Eigen::Vector3d gyro_bias_rad_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_bias_m_s2 = Eigen::Vector3d::Zero();
  uint64_t seed = 1;
  double blind_from_s = 0, blind_to_s = 0;      // nothing is seen
  double imu_gap_from_s = 0, imu_gap_to_s = 0;  // no samples arrive
  double image_gap_from_s = 0, image_gap_to_s = 0;
  double lift_from_s = 0, lift_to_s = 0;  // the IMU feels 1 m/s^2 upwards, images do not tell it
  double nan_from_s = 0, nan_to_s = 0;    // one point's observation is not a number
  double image_rate_hz = 20;
  double outlier_share = 0;  // of the tracks, that slide 1 px a frame
  int tracks = 0;            // of points at once, at most; 0: as many as the tracker may have
  int noise_points = 0;      // detected at each keyframe; see SimulatedPoints
  // Edges and landmarks on them, beside the other landmarks. The landmarks are seen by all methods,
  // the edges by those that use lines.
  std::optional<LineTrackSimulatorOptions> lines;
  double line_outlier_share = 0;  // of the edges, whose tracks slide 1 px a frame
  int line_life = 0;              // see SimulatedLines
  // Of points, both cameras'; lines are as if exposed at once. See Rig.
  double right_offset_s = 0, readout_s = 0;
  bool takes_rows_at_once = false;  // the estimator, though they are not
  bool looks_apart = false;         // the second camera looks backwards, from 4 cm behind the first
  CalibrationFault fault;
  OdometryOptions odometry;
};

struct SimulatedRun {
  Rig rig;
  std::vector<OnlineState> states;
  std::vector<RigidTransform> truth;  // beside the states
  SimulatedImu imu;
  std::vector<Eigen::Vector3d> landmarks_world;  // row: id of the point
  std::vector<SimulatedEdge> edges;              // row: id of the line
  std::optional<MotionSpline> motion;
  OdometryRun run;
  size_t removed_points = 0;
  // Normalised squared errors of the last keyframe: of its pose (6 dimensions) and all (15).
  double final_pose_nees = 0, final_nees = 0;
  // At the end, of the first slope found: the errors of its azimuth and elevation, counted from the
  // first pose, and its normalised squared error (2); 0 where there is none.
  Eigen::Vector2d final_slope_error_rad = Eigen::Vector2d::Zero();
  double final_slope_nees = 0;
  // At the end: estimate less truth of the calibration, what is claimed of it, and the normalised
  // squared error of all (26).
  CalibrationVector calibration_error, calibration_sigma;
  double calibration_nees = 0;
};

// The turn about z and the shift that take an estimated pose to the true one: of any two, of a
// run's state, of its first.
RigidTransform GaugeBetween(const RigidTransform& truth, const RigidTransform& estimate);
RigidTransform GaugeFrom(const SimulatedRun& run, size_t state);
inline RigidTransform GaugeFromFirst(const SimulatedRun& run) { return GaugeFrom(run, 0); }

// Calls `after_image` after each image, where one is given.
SimulatedRun RunOnSimulatedTracks(const SimulatedRunOptions& options,
                                  const MotionSpline* given_motion = nullptr,
                                  const std::function<void(Estimator*)>& after_image = nullptr);

// Largest distance in metres between estimate and truth, once the first poses are laid together.
double LargestPositionError(const SimulatedRun& run);

}  // namespace slcmap
