// From tracked points and IMU samples to states, keyframes and landmarks.
#pragma once

#include <cmath>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <unordered_set>
#include <vector>

#include "data/core/types.h"
#include "odometry/geometry/exposure.h"
#include "odometry/geometry/imu.h"
#include "odometry/geometry/lines.h"
#include "odometry/geometry/pinhole.h"
#include "odometry/run/run.h"
#include "odometry/window/initializer.h"
#include "odometry/window/options.h"
#include "odometry/window/run_monitor.h"
#include "odometry/window/sliding_window.h"

namespace slcmap::inline odometry {

// Where the estimator's points come from: a tracker on images, or a simulation. With several
// threads, Detect() runs beside LineSource::Track(); all else is called from one thread.
class PointSource {
 public:
  virtual ~PointSource() = default;
  virtual const std::vector<PointObservation>& observations() const = 0;  // of the newest image
  virtual void Detect() = 0;  // fills up with new points, and looks into the right image
  virtual void Remove(const std::unordered_set<int64_t>& ids) = 0;
  virtual void Reset() = 0;
};

// Where the estimator's lines come from.
class LineSource {
 public:
  virtual ~LineSource() = default;
  // Finds lines in the newest image. R_now_previous turns the left camera's coordinates at the
  // image where this was last called into those at this one.
  virtual void Track(const Eigen::Quaterniond& R_now_previous,
                     const std::vector<LinePrediction>& predictions,
                     const std::vector<Eigen::Vector3d>& axes_camera) = 0;
  virtual const std::vector<LineObservation>& observations() const = 0;
  virtual void Remove(const std::unordered_set<int64_t>& ids) = 0;
  virtual void Reset() = 0;
};

// How much of what has left the window was described before.
struct FinishedMarks {
  size_t keyframes = 0, landmarks = 0, lines = 0, calibration = 0;
};

class Estimator {
 public:
  // The sources must outlive the estimator; lines may be null. With one thread everything is done
  // one after the other. With more, lines are tracked beside the points, and the window is still
  // optimised when AddImage() returns for a keyframe; the results are the same.
  Estimator(const EstimatorOptions& options, const Rig& rectified_rig, PointSource* source,
            LineSource* lines = nullptr, int threads = 1);

  // False where the sample is not finite or not later than the last one; it is then dropped.
  bool AddImu(const ImuSample& sample) { return imu_.Add(sample); }
  const ImuBuffer& imu() const { return imu_; }
  // How images move with what the lenses are; ideal pinholes without.
  void SetLensShifts(const std::vector<LensShift>& shifts);

  // When rows of images are exposed; all at the stamp without. Samples have to be there for so much
  // after an image's stamp (0 where all is exposed at it).
  void SetRowTimes(const RowTimes& times) { row_times_ = times; }
  int64_t LooksAhead_ns() const { return ToNanoseconds(row_times_.LooksAhead_s()); }

  // How the right camera turns, in its rectified frame, from a stamp until its image is taken, and
  // by how much it moves across rows at most meanwhile.
  Eigen::Quaterniond RightTurnSince(int64_t stamp_ns) const;
  double RightRowsMove_px() const {
    constexpr double kNear_m = 0.7;
    return rig_.cameras[1].fx_px * last_speed_m_s_ * std::abs(row_times_.right_offset_s()) /
           kNear_m;
  }

  // What the window knows of the right camera, and how far the rows of right images are off by that
  // as they are rectified now.
  RightCorrection KnownRight() const;
  double RightRowsOff_px() const { return rectifications_[1].RowsOff_px(KnownRight()); }

  // Right images are from now on rectified so.
  void SetRightRectification(const RightCorrection& correction) {
    rectifications_[1].Set(correction);
  }

  // The left camera at a stamp from the left camera at the last image, by the gyroscope. Does not
  // wait for a keyframe's optimisation.
  Eigen::Quaterniond PredictedCameraRotation(int64_t stamp_ns) const;

  // Starts anew where the IMU or the images have a gap up to the stamp that cannot be bridged.
  // Called before the points are tracked to it. Returns what FinishKeyframe() does, which it calls
  // only where there is a gap.
  std::optional<OnlineState> CheckGaps(int64_t stamp_ns);

  // Takes the source's observations as those of an image. stamp_ns is on the IMU's clock, and its
  // samples have arrived. Returns the state once initialised; with several threads, that of a
  // keyframe comes from FinishKeyframe().
  std::optional<OnlineState> AddImage(int64_t stamp_ns);

  // Waits until the last keyframe's optimisation is done, where it still runs, and draws its
  // conclusions: the sources forget what did not fit, and a failure starts a new segment. Returns
  // the keyframe's state, if there is one that was not returned yet. Throws what the optimisation
  // threw. With several threads it is called before AddImage(), RestsUntil(), Describe() and
  // window(), and after the points are tracked to the next image: those that it removes were
  // tracked in vain, but changed nothing for the others.
  std::optional<OnlineState> FinishKeyframe();

  // Whether the IMU and the last state say that the rig rests from the last image to the stamp.
  bool RestsUntil(int64_t stamp_ns) const;

  // What was estimated so far; `run` holds all but states and timings. Stamps are on the IMU's
  // clock.
  void Describe(OdometryRun* run) const;
  // What has left the window beyond the marks, which are moved. May be called while a keyframe is
  // optimised.
  void DescribeFinished(FinishedMarks* marks, OdometryRun* run) const;
  // What is in the window, and the Manhattan worlds of the whole run.
  void DescribeWindow(OdometryRun* run) const;
  const SlidingWindow& window() const { return window_; }
  StageClock* clock() { return &clock_; }

 private:
  std::unique_ptr<FrameState> NewFrame(int64_t stamp_ns);
  ImuCut NewCut(int64_t stamp_ns) const;
  void CutAgain(int64_t stamp_ns);
  int64_t OldestSampleNeeded(int64_t stamp_ns) const;
  void TakeMeasurements(FrameState* frame) const;
  void UpdateForTracking();
  void AppendImu(int64_t from_ns, int64_t to_ns, Preintegration* imu) const;
  std::vector<Eigen::Vector3d> RoughVertical(int64_t stamp_ns) const;
  std::optional<OnlineState> Initialize(int64_t stamp_ns);
  std::optional<OnlineState> Estimate(int64_t stamp_ns);
  void Follow(const FrameState& frame);
  void StartKeyframe(std::unique_ptr<FrameState> frame);
  std::future<void> StartLines(const Eigen::Quaterniond& R_now_previous,
                               std::vector<LinePrediction> predictions,
                               std::vector<Eigen::Vector3d> axes_camera);
  void TakeLines(std::future<void> tracked, FrameState* frame) const;
  std::optional<OnlineState> Judge(const OnlineState& state, int points_visible);
  bool StandsStill(const FrameState& frame) const;
  bool ViewIsCarried(const FrameState& frame) const;
  bool BeginsRest(const FrameState& frame) const;
  bool IsKeyframe(const FrameState& frame) const;
  std::string FindGap(int64_t stamp_ns) const;
  std::string FindFailure(const OnlineState& state, int points_visible);
  void Restart(const std::string& reason, bool calibration_is_good);
  OnlineState GetState(const FrameState& frame) const;

  // A keyframe whose optimisation was started.
  struct StartedKeyframe {
    std::vector<int64_t> point_ids;  // visible
    std::future<FinishedIds> optimized;
  };

  EstimatorOptions options_;
  Rig rig_;
  std::launch policy_;
  PointSource* source_;
  LineSource* lines_;
  ImuBuffer imu_;
  Initializer initializer_;
  SlidingWindow window_;
  StageClock clock_;
  FigureCollector figures_;

  std::unique_ptr<Preintegration> since_keyframe_;  // up to the last image that was no keyframe
  // Points of the image after the last keyframe, once it has come.
  std::optional<std::unordered_set<int64_t>> followed_;
  // At the last image; of a keyframe, as it was before its optimisation.
  Eigen::Vector3d gyro_bias_rad_s_ = Eigen::Vector3d::Zero();
  // What tracking takes as known of the calibration: like the bias.
  struct {
    int64_t offset_ns = 0;
    Eigen::Quaterniond R_body_imu = Eigen::Quaterniond::Identity();
    ImuErrors errors = ImuErrors::Zero();
  } tracking_;
  int64_t cut_offset_ns_ = 0;  // of cuts; of new ones as far as it is not ahead
  int64_t last_cut_ns_ = 0;    // of the last image
  std::vector<RightRectification> rectifications_;  // by camera; used of right ones
  RowTimes row_times_;
  std::optional<int64_t> last_stamp_ns_, lost_since_ns_, last_report_ns_;
  std::optional<RigidTransform> start_pose_;  // where a new segment starts
  double last_speed_m_s_ = 0;
  int64_t next_frame_id_ = 0;
  int segment_ = 0;
  OdometryRun run_;                          // what has left the window
  std::optional<StartedKeyframe> keyframe_;  // last: its end is waited for before all else goes
};

}  // namespace slcmap::odometry
