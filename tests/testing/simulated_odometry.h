// Runs the estimator on simulated tracks, without any image.
#pragma once

#include <Eigen/LU>
#include <algorithm>
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

// Plays simulated line tracks to an estimator, whatever it predicts; what it removes stays away.
class SimulatedLines final : public LineSource {
 public:
  static constexpr int64_t kIdStep = 1'000'000;  // between the ids of an edge's tracks

  // life: calls of Track() after which all tracks break off and start again; 0 for never.
  explicit SimulatedLines(int life) : life_(life) {}
  // The frame that the next Track() looks at, which must outlive it.
  void Show(const SimulatedTrackFrame& frame, double outlier_share) {
    frame_ = &frame;
    outlier_share_ = outlier_share;
    for (const SimulatedLineTrack& track : frame.lines) ++ages_[track.id];
  }
  void Blind() { frame_ = nullptr; }
  void Track(const Eigen::Quaterniond&, const std::vector<LinePrediction>&,
             const std::vector<Eigen::Vector3d>&) override {
    observations_.clear();
    const int64_t first_id = life_ > 0 ? kIdStep * (calls_++ / life_) : 0;
    if (!frame_) return;
    for (const SimulatedLineTrack& track : frame_->lines) {
      if (removed_.count(first_id + track.id)) continue;
      const double slid_px = Slides(track.id) ? ages_.at(track.id) - 1 : 0;
      LineObservation& line = observations_.emplace_back();
      line.id = first_id + track.id;
      line.left_px = Slid(track.left, slid_px);
      if (track.right) line.right_px = Slid(*track.right, slid_px);
    }
  }
  const std::vector<LineObservation>& observations() const override { return observations_; }
  void Remove(const std::unordered_set<int64_t>& ids) override {
    removed_.insert(ids.begin(), ids.end());
    std::erase_if(observations_, [&](const LineObservation& l) { return ids.count(l.id) > 0; });
  }
  void Reset() override { observations_.clear(); }
  bool Slides(int64_t id) const { return static_cast<double>(id % 100) < 100 * outlier_share_; }

 private:
  // Moved across itself, alike in both images, as a thing that moves is.
  static LineSegment Slid(const SimulatedSegment& segment, double by_px) {
    const Eigen::Vector2d along = (segment.end_px - segment.start_px).normalized();
    const Eigen::Vector2d across = by_px * Eigen::Vector2d(-along.y(), along.x());
    return {segment.start_px + across, segment.end_px + across};
  }

  int life_ = 0, calls_ = 0;
  const SimulatedTrackFrame* frame_ = nullptr;
  double outlier_share_ = 0;
  std::vector<LineObservation> observations_;
  std::unordered_set<int64_t> removed_;
  std::map<int64_t, int> ages_;
};

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

  Rig Claimed(Rig rig) const {
    const RigidTransform turn(ExpRotation(imu_rotation_rad), Eigen::Vector3d::Zero());
    for (int i = 0; i < 2; ++i) {
      rig.T_imu_camera[i] = turn * rig.T_imu_camera[i];
      rig.cameras[i].fx_px *= 1 + focal_length;
      rig.cameras[i].fy_px *= 1 + focal_length;
      rig.readout_s[i] += readout_s;
    }
    rig.cameras[1].cx_px += right_centre_px.x();
    rig.cameras[1].cy_px += right_centre_px.y();
    rig.T_imu_camera[1].rotation = rig.T_imu_camera[1].rotation * ExpRotation(right_rotation_rad);
    return rig;
  }
  // What the IMU reads instead.
  ImuSample Misread(ImuSample sample) const {
    const ImuCorrection correction = MakeCorrection(imu_errors);
    sample.angular_velocity_rad_s = correction.gyro.inverse() * sample.angular_velocity_rad_s;
    sample.specific_force_m_s2 = correction.accel.inverse() * sample.specific_force_m_s2;
    return sample;
  }
  // What the estimator should find.
  CalibrationVector Expected() const {
    CalibrationVector expected;
    expected << imu_rotation_rad, Eigen::Vector3d::Zero(),
        -1e-9 * static_cast<double>(stamps_late_ns), imu_errors, -right_rotation_rad,
        1 / (1 + focal_length) - 1, -right_centre_px;
    return expected;
  }
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

// The turn about z and the shift that take an estimated pose to the true one.
inline RigidTransform GaugeBetween(const RigidTransform& truth, const RigidTransform& estimate) {
  const Eigen::Quaterniond d = truth.rotation * estimate.rotation.conjugate();
  const double yaw_rad = 2 * std::atan2(d.z(), d.w());
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()));
  return {turn, truth.translation - turn * estimate.translation};
}

inline RigidTransform GaugeFrom(const SimulatedRun& run, size_t state) {
  return GaugeBetween(run.truth[state], run.states[state].T_world_imu);
}

inline RigidTransform GaugeFromFirst(const SimulatedRun& run) { return GaugeFrom(run, 0); }

// What a frame's covariance owes to the prior of the first one's position and heading: that of a
// shift (1 mm) and a turn about the vertical (0.1 mrad).
inline Matrix15d GaugeCovariance(const FrameState& frame) {
  const RigidTransform T = frame.T_world_imu();
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
  Eigen::Matrix<double, 15, 4> moved = Eigen::Matrix<double, 15, 4>::Zero();
  moved.topLeftCorner<3, 3>().setIdentity();
  moved.block<3, 1>(0, 3) = z.cross(T.translation);
  moved.block<3, 1>(3, 3) = T.rotation.conjugate() * z;
  moved.block<3, 1>(6, 3) = z.cross(frame.velocity());
  const Eigen::Vector4d variances(1e-6, 1e-6, 1e-6, 1e-8);
  return moved * variances.asDiagonal() * moved.transpose();
}

// The errors of the newest keyframe against the motion, counted from the position and heading of
// the first (which nothing but their prior tells), normalised by the covariance claimed.
inline void MeasureFinalNees(const MotionSpline& motion, const SlidingWindow& window,
                             const CalibrationFault& fault, SimulatedRun* run) {
  const FrameState& newest = window.newest();
  const double t_s = ToSeconds(newest.stamp_ns - fault.stamps_late_ns);
  const Keyframe& first = run->run.keyframes.front();
  const RigidTransform inverse =
      GaugeBetween(motion.PoseAt(ToSeconds(first.stamp_ns - fault.stamps_late_ns)),
                   first.T_world_imu)
          .Inverse();
  const RigidTransform truth = inverse * motion.PoseAt(t_s);
  const auto sample =
      std::lower_bound(run->imu.samples.begin(), run->imu.samples.end(), newest.stamp_ns,
                       [](const ImuSample& s, int64_t stamp_ns) { return s.stamp_ns < stamp_ns; });
  const ImuBias& bias = run->imu.biases[static_cast<size_t>(sample - run->imu.samples.begin())];
  Eigen::Matrix<double, 15, 1> error;
  error << newest.T_world_imu().translation - truth.translation,
      LogRotation(truth.rotation.conjugate() * newest.T_world_imu().rotation),
      newest.velocity() - inverse.rotation * motion.VelocityAt(ToSeconds(newest.cut_stamp_ns())),
      newest.gyro_bias() - bias.gyro_rad_s, newest.accel_bias() - bias.accel_m_s2;
  const Matrix15d covariance =
      WindowCovariance(window.information()).Of({newest.pose.data(), newest.speed_bias.data()}) -
      GaugeCovariance(newest);
  run->final_nees = error.dot(covariance.ldlt().solve(error));
  const Eigen::Matrix<double, 6, 6> of_pose = covariance.topLeftCorner<6, 6>();
  run->final_pose_nees = error.head<6>().dot(of_pose.ldlt().solve(error.head<6>()));
}

inline void MeasureFinalSlope(const MotionSpline& motion, const LineTrackSimulatorOptions& lines,
                              const SlidingWindow& window, SimulatedRun* run) {
  const WindowCovariance covariance(window.information());
  if (window.state().slopes.empty()) return;
  const SlopeState& slope = window.state().slopes.front();
  if (!covariance.Knows(slope.angles_rad.data())) return;
  const Keyframe& first = run->run.keyframes.front();
  const RigidTransform gauge =
      GaugeBetween(motion.PoseAt(ToSeconds(first.stamp_ns)), first.T_world_imu);
  const double yaw_rad = 2 * std::atan2(gauge.rotation.z(), gauge.rotation.w());
  run->final_slope_error_rad =
      Eigen::Vector2d(std::remainder(slope.angles_rad[0] + yaw_rad - lines.slope_azimuth_rad, M_PI),
                      slope.angles_rad[1] - lines.slope_elevation_rad);
  constexpr double kGaugeVariance_rad2 = 1e-8;
  Eigen::Matrix2d variance_rad2 = covariance.Of({slope.angles_rad.data()});
  variance_rad2(0, 0) -= kGaugeVariance_rad2;
  run->final_slope_nees =
      run->final_slope_error_rad.dot(variance_rad2.ldlt().solve(run->final_slope_error_rad));
}

inline void MeasureCalibration(const SlidingWindow& window, const CalibrationFault& fault,
                               SimulatedRun* run) {
  const CalibrationState& state = window.calibration();
  const CalibrationMatrix covariance =
      WindowCovariance(window.information()).Of({state.imu.data(), state.cameras.data()});
  run->calibration_error = AsVector(state) - fault.Expected();
  run->calibration_sigma = covariance.diagonal().cwiseSqrt();
  run->calibration_nees =
      run->calibration_error.dot(covariance.ldlt().solve(run->calibration_error));
}

// Calls `after_image` after each image, where one is given.
inline SimulatedRun RunOnSimulatedTracks(
    const SimulatedRunOptions& options, const MotionSpline* given_motion = nullptr,
    const std::function<void(Estimator*)>& after_image = nullptr) {
  SimulatedRun out;
  out.rig = ExampleStereoRig();
  if (options.looks_apart) {
    out.rig.cameras[1] = out.rig.cameras[0];
    out.rig.T_imu_camera[1] =
        out.rig.T_imu_camera[0] * RigidTransform(ExpRotation({0, M_PI, 0}), {0, 0, -0.04});
  }
  out.rig.right_time_offset_s = options.right_offset_s;
  std::ranges::fill(out.rig.readout_s, options.readout_s);
  const MotionSpline motion =
      given_motion ? *given_motion
                   : ExampleFlight(out.rig, options.duration_s, options.stand_still_s);
  ImuSimulatorOptions imu;
  imu.noise = out.rig.imu_noise;
  imu.noise.rate_hz = options.imu_rate_hz;
  imu.with_noise = options.imu_noise;
  imu.initial_gyro_bias_rad_s = options.gyro_bias_rad_s;
  imu.initial_accel_bias_m_s2 = options.accel_bias_m_s2;
  imu.seed = options.seed;
  out.imu = SimulateImu(motion, imu);
  TrackSimulatorOptions tracks;
  tracks.sigma_px = options.pixel_sigma_px;
  tracks.max_tracks = options.tracks > 0 ? options.tracks : options.odometry.points.max_points;
  tracks.seed = options.seed;
  tracks.image_rate_hz = options.image_rate_hz;
  SimulatedTracks simulated = SimulateTracks(motion, out.rig, tracks);
  if (options.lines) {
    LineTrackSimulatorOptions lines = *options.lines;
    lines.sigma_px = options.pixel_sigma_px;
    lines.seed = options.seed;
    AddLineTracks(out.rig, lines, &simulated);
  }
  out.edges = simulated.edges;
  out.landmarks_world = simulated.landmarks_world;
  out.motion = motion;

  SimulatedPoints points(options.noise_points);
  SimulatedLines lines(options.line_life);
  const Rig claimed = options.fault.Claimed(out.rig);
  Estimator estimator(options.odometry, claimed, &points,
                      UsesLines(options.odometry.method) ? &lines : nullptr);
  estimator.SetLensShifts(ComputeLensShifts(claimed, claimed));
  if (!options.takes_rows_at_once) {
    estimator.SetRowTimes(RowTimes(claimed, claimed, options.odometry.calibration.readout));
  }
  size_t next = 0;
  for (const SimulatedTrackFrame& frame : simulated.frames) {
    while (
        next < out.imu.samples.size() &&
        (next == 0 || out.imu.samples[next - 1].stamp_ns <
                          std::max(frame.stamp_ns, frame.stamp_ns + options.fault.stamps_late_ns) +
                              estimator.LooksAhead_ns())) {
      ImuSample sample = out.imu.samples[next++];
      const double t_s = ToSeconds(sample.stamp_ns);
      if (t_s > options.lift_from_s && t_s < options.lift_to_s) {
        sample.specific_force_m_s2 += sample.specific_force_m_s2.normalized();
      }
      if (t_s > options.imu_gap_from_s && t_s < options.imu_gap_to_s) continue;
      estimator.AddImu(options.fault.Misread(sample));
    }
    const int64_t stamp_ns = frame.stamp_ns + options.fault.stamps_late_ns;
    if (!estimator.imu().Covers(stamp_ns + estimator.LooksAhead_ns())) continue;
    const double t_s = ToSeconds(frame.stamp_ns);
    if (t_s > options.image_gap_from_s && t_s < options.image_gap_to_s) continue;
    estimator.CheckGaps(stamp_ns);
    points.Show(frame, options.odometry.method != Method::kPointsMono, options.outlier_share);
    lines.Show(frame, options.line_outlier_share);
    if (t_s > options.nan_from_s && t_s < options.nan_to_s) points.Spoil();
    if (t_s > options.blind_from_s && t_s < options.blind_to_s) {
      points.Blind();
      lines.Blind();
    }
    const auto state = estimator.AddImage(stamp_ns);
    if (after_image) after_image(&estimator);
    if (!state) continue;
    out.states.push_back(*state);
    out.truth.push_back(frame.T_world_imu);
  }
  estimator.Describe(&out.run);
  out.removed_points = points.removed();
  if (!out.states.empty() && !estimator.window().empty()) {
    MeasureFinalNees(motion, estimator.window(), options.fault, &out);
    if (options.lines) MeasureFinalSlope(motion, *options.lines, estimator.window(), &out);
    MeasureCalibration(estimator.window(), options.fault, &out);
  }
  return out;
}

// Largest distance in metres between estimate and truth, once the first poses are laid together.
inline double LargestPositionError(const SimulatedRun& run) {
  const RigidTransform gauge = GaugeFromFirst(run);
  double largest_m = 0;
  for (size_t i = 0; i < run.states.size(); ++i) {
    largest_m =
        std::max(largest_m,
                 (gauge * run.states[i].T_world_imu.translation - run.truth[i].translation).norm());
  }
  return largest_m;
}

}  // namespace slcmap
