#include "tests/testing/simulated_odometry.h"

#include <Eigen/Cholesky>
#include <cmath>

namespace slcmap {
namespace {

// Plays simulated line tracks to an estimator, whatever it predicts; what it removes stays away.
class SimulatedLines final : public LineSource {
 public:
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
    const int64_t first_id = life_ > 0 ? kLineIdStep * (calls_++ / life_) : 0;
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

// What a frame's covariance owes to the prior of the first one's position and heading: that of a
// shift (1 mm) and a turn about the vertical (0.1 mrad).
Matrix15d GaugeCovariance(const FrameState& frame) {
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
void MeasureFinalNees(const MotionSpline& motion, const SlidingWindow& window,
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

void MeasureFinalSlope(const MotionSpline& motion, const LineTrackSimulatorOptions& lines,
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

void MeasureCalibration(const SlidingWindow& window, const CalibrationFault& fault,
                        SimulatedRun* run) {
  const CalibrationState& state = window.calibration();
  const CalibrationMatrix covariance =
      WindowCovariance(window.information()).Of({state.imu.data(), state.cameras.data()});
  run->calibration_error = AsVector(state) - fault.Expected();
  run->calibration_sigma = covariance.diagonal().cwiseSqrt();
  run->calibration_nees =
      run->calibration_error.dot(covariance.ldlt().solve(run->calibration_error));
}

}  // namespace

Rig CalibrationFault::Claimed(Rig rig) const {
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

ImuSample CalibrationFault::Misread(ImuSample sample) const {
  const ImuCorrection correction = MakeCorrection(imu_errors);
  sample.angular_velocity_rad_s = correction.gyro.inverse() * sample.angular_velocity_rad_s;
  sample.specific_force_m_s2 = correction.accel.inverse() * sample.specific_force_m_s2;
  return sample;
}

CalibrationVector CalibrationFault::Expected() const {
  CalibrationVector expected;
  expected << imu_rotation_rad, Eigen::Vector3d::Zero(),
      -1e-9 * static_cast<double>(stamps_late_ns), imu_errors, -right_rotation_rad,
      1 / (1 + focal_length) - 1, -right_centre_px;
  return expected;
}

RigidTransform GaugeBetween(const RigidTransform& truth, const RigidTransform& estimate) {
  const Eigen::Quaterniond d = truth.rotation * estimate.rotation.conjugate();
  const double yaw_rad = 2 * std::atan2(d.z(), d.w());
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()));
  return {turn, truth.translation - turn * estimate.translation};
}

RigidTransform GaugeFrom(const SimulatedRun& run, size_t state) {
  return GaugeBetween(run.truth[state], run.states[state].T_world_imu);
}

SimulatedRun RunOnSimulatedTracks(const SimulatedRunOptions& options,
                                  const MotionSpline* given_motion,
                                  const std::function<void(Estimator*)>& after_image) {
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

double LargestPositionError(const SimulatedRun& run) {
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
