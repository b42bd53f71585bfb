#include "odometry/odometry.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <chrono>
#include <deque>
#include <utility>

#include "data/calibration/calibration.h"
#include "data/core/error.h"
#include "odometry/frontend/rectifier.h"
#include "odometry/run/run_journal.h"
#include "odometry/run/run_queries.h"
#include "odometry/tracked_cameras.h"
#include "odometry/window/estimator.h"

namespace slcmap::inline odometry {
namespace {

constexpr size_t kMaxPending = 100;  // pairs that wait for their IMU samples

Rig CheckedRig(const Rig& rig, const OdometryOptions& options) {
  options.Check();
  for (const auto& [first, is_pair] : CameraGroups(rig)) {
    const auto name = [](int camera, const char* of_two) {
      return camera < 2 ? std::string(of_two) : fmt::format("camera {}", camera);
    };
    rig.cameras[first].Check(name(first, first == 0 ? "left camera" : "second camera"));
    if (is_pair) rig.cameras[first + 1].Check(name(first + 1, "right camera"));
  }
  return rig;
}

struct Pending {
  StereoImage image;
  DeferredImages decode;
};

// The cameras that a method uses.
std::vector<CameraGroup> UsedGroups(Method method, const Rig& rig) {
  if (!UsesTwoCameras(method, rig)) return {{0, false}};
  return CameraGroups(rig);
}

// One camera tells nothing of another, and what errs alike along the track of a line moves the
// scale: there its ends are twice as uncertain.
OdometryOptions ForRig(OdometryOptions options, const Rig& rig) {
  if (UsesRight(options.method, rig)) return options;
  options.line_landmarks.sigma_px *= 2;
  options.calibration.right_rotation = options.calibration.right_centre = false;
  return options;
}

}  // namespace

class Odometry::Impl {
 public:
  Impl(const Rig& rig, const OdometryOptions& options, int threads)
      : options_(ForRig(options, rig)),
        rig_(CheckedRig(rig, options)),
        rectifier_(rig, options.rectifier),
        groups_(UsedGroups(options.method, rig)),
        repeated_(rig.cameras.size()),
        points_(options.points, rectifier_, groups_, &images_),
        lines_(UsesLines(options.method)
                   ? std::make_unique<TrackedLines>(options.lines, rectifier_, groups_, &images_)
                   : nullptr),
        estimator_(options_, rectifier_.rectified_rig(), &points_, lines_.get(), threads) {
    estimator_.SetLensShifts(ComputeLensShifts(rig, rectifier_.rectified_rig()));
    estimator_.SetRowTimes(
        RowTimes(rig_, rectifier_.rectified_rig(), options_.calibration.readout));
  }

  void AddImu(const ImuSample& sample) {
    if (estimator_.AddImu(sample)) {
      imu_.push_back(sample);
    } else {
      Warn("IMU samples dropped (not finite, absurd, repeated or out of order)");
    }
  }

  std::vector<OnlineState> AddStereo(const StereoImage& image, DeferredImages decode) {
    if (Acceptable(image)) pending_.push_back({image, std::move(decode)});
    if (pending_.size() > kMaxPending) {
      Warn("images dropped whose IMU samples did not arrive");
      pending_.pop_front();
    }
    while (!pending_.empty() && estimator_.imu().Covers(StampOnImuClock(pending_.front().image) +
                                                        estimator_.LooksAhead_ns())) {
      current_ = std::move(pending_.front());
      pending_.pop_front();
      Process();
    }
    return NewStates();
  }

  double ImuAhead_s() const { return ToSeconds(estimator_.LooksAhead_ns()); }

  std::vector<OnlineState> Finish() {
    Take(estimator_.FinishKeyframe());
    return NewStates();
  }

  OdometryRun Run() {
    Take(estimator_.FinishKeyframe());
    OdometryRun run;
    run.method = MethodName(options_.method);
    run.rectified_rig = rectifier_.rectified_rig();
    if (const auto& longer_s = estimator_.window().model().readout) {
      for (double& readout_s : run.rectified_rig.readout_s) readout_s += *longer_s;
    }
    run.imu = imu_;
    run.warnings = warnings_;
    if (!pending_.empty())
      run.warnings["images whose IMU samples did not arrive"] = std::ssize(pending_);
    estimator_.Describe(&run);
    ToCameraClock(&run);
    run.states = states_;
    run.timings.stages = estimator_.clock()->Stages();
    return WithoutNonFinite(std::move(run));
  }

  OdometryRun TakeFinished() {
    OdometryRun run;
    run.rectified_rig = rectifier_.rectified_rig();
    estimator_.DescribeFinished(&taken_, &run);
    ToCameraClock(&run);
    TakeNew(states_, &taken_states_, &run.states);
    TakeNew(imu_, &taken_imu_, &run.imu);
    return run;
  }

  OdometryRun Window() {
    Take(estimator_.FinishKeyframe());
    OdometryRun run;
    run.rectified_rig = rectifier_.rectified_rig();
    estimator_.DescribeWindow(&run);
    for (const auto& [kind, count] : warnings_) run.warnings[kind] += count;
    ToCameraClock(&run);
    return run;
  }

 private:
  // The current pair, stage by stage. Until its points are tracked, the keyframe before may still
  // be in optimisation.
  void Process() {
    const StereoImage& image = current_.image;
    const int64_t stamp_ns = StampOnImuClock(image);
    if (estimator_.imu().first_stamp_ns() > stamp_ns) {
      Warn("images dropped that came before the first IMU sample");
      return;
    }
    const bool repeats = repeated_[0].Repeats(image.left);
    if (repeats) Take(estimator_.FinishKeyframe());
    if (repeats && !estimator_.RestsUntil(stamp_ns)) {  // at rest images may be the same
      Warn("images dropped that repeat the one before while the rig moves");
      return;
    }
    Take(estimator_.CheckGaps(stamp_ns));
    images_.Set(RectifiedLeft(), CameraCount(rig_),
                [this](int camera) { return RectifiedImage(camera); });
    TrackPoints(stamp_ns);
    Take(estimator_.FinishKeyframe());
    CorrectRightRectification(stamp_ns);
    Take(estimator_.AddImage(stamp_ns));
  }

  // Follows what is known of the right camera, so that points are found along the rows.
  void CorrectRightRectification(int64_t stamp_ns) {
    if (!groups_[0].is_pair) return;
    if (rig_.right_time_offset_s != 0) {
      TurnRightBack(stamp_ns);
      return;
    }
    constexpr double kMaxRowError_px = 0.3;
    if (estimator_.RightRowsOff_px() < kMaxRowError_px) return;
    const RightCorrection known = estimator_.KnownRight();
    rectifier_.CorrectRight(known);
    estimator_.SetRightRectification(known);
  }

  // A right image that is taken later is rectified as if it were turned as at the stamp; how far it
  // moves is left.
  void TurnRightBack(int64_t stamp_ns) {
    late_right_ = estimator_.KnownRight();
    late_right_->rotation_rad =
        LogRotation(estimator_.RightTurnSince(stamp_ns) * ExpRotation(late_right_->rotation_rad));
    estimator_.SetRightRectification(*late_right_);
    points_.SetRowsMove(estimator_.RightRowsMove_px());
  }

  void Take(std::optional<OnlineState> state) {
    if (!state) return;
    state->stamp_ns = StampOnCameraClock(state->stamp_ns);
    states_.push_back(*state);
  }

  // All stamps that the estimator gives a run.
  void ToCameraClock(OdometryRun* run) const {
    for (Keyframe& keyframe : run->keyframes) {
      keyframe.stamp_ns = StampOnCameraClock(keyframe.stamp_ns);
    }
    for (CalibrationEstimate& estimate : run->calibration) {
      estimate.stamp_ns = StampOnCameraClock(estimate.stamp_ns);
    }
    for (ManhattanWorld& world : run->manhattan_worlds) {
      world.found_at_ns = StampOnCameraClock(world.found_at_ns);
    }
    for (SlopedDirection& slope : run->sloped_directions) {
      slope.found_at_ns = StampOnCameraClock(slope.found_at_ns);
    }
  }

  // Those that were not returned yet.
  std::vector<OnlineState> NewStates() {
    const auto first_new = states_.begin() + static_cast<std::ptrdiff_t>(returned_);
    returned_ = states_.size();
    return {first_new, states_.end()};
  }

  cv::Mat RectifiedLeft() {
    const auto timed = estimator_.clock()->Time("rectification");
    return rectifier_.Rectify(current_.image.left, 0);
  }

  // Of another camera than the left one; empty where there is none. Called once, of right cameras
  // on keyframes only, in the thread of the points or of the lines; of others while points are
  // tracked.
  cv::Mat RectifiedImage(int camera) {
    const auto& [image, decode] = current_;
    const auto deferred = static_cast<size_t>(camera) - 1;
    const auto decode_it = deferred < decode.size() ? decode[deferred] : nullptr;
    cv::Mat found = camera < image.cameras() ? image.of(camera) : cv::Mat();
    if (found.empty() && !decode_it) return found;
    if (found.empty()) found = decode_it();
    if (!Fits(found, camera)) {
      Warn("right images left out that were damaged");
      return cv::Mat();
    }
    const bool repeats = repeated_[static_cast<size_t>(camera)].Repeats(found);
    const bool is_tracked = std::ranges::count(groups_, camera, &CameraGroup::first) > 0;
    if (repeats && is_tracked) Take(estimator_.FinishKeyframe());
    if (repeats && !estimator_.RestsUntil(StampOnImuClock(image))) {
      Warn("right images ignored that repeat the one before while the rig moves");
      return cv::Mat();
    }
    if (camera == 1 && late_right_) rectifier_.CorrectRight(*late_right_);
    return rectifier_.Rectify(found, camera);
  }

  void TrackPoints(int64_t stamp_ns) {
    const auto timed = estimator_.clock()->Time("point tracking");
    points_.Track(estimator_.PredictedCameraRotation(stamp_ns));
  }

  bool Fits(const cv::Mat& image, int camera) const {
    return image.type() == CV_8UC1 && image.cols == rig_.cameras[camera].width_px &&
           image.rows == rig_.cameras[camera].height_px;
  }

  bool Acceptable(const StereoImage& image) {
    if (last_image_ns_ && image.stamp_ns <= *last_image_ns_) {
      Warn("images dropped that were repeated or out of order");
      return false;
    }
    bool fits =
        Fits(image.left, 0) && (image.others.empty() || image.cameras() <= CameraCount(rig_));
    for (int i = 1; fits && i < image.cameras(); ++i) {
      fits = image.of(i).empty() || Fits(image.of(i), i);
    }
    if (!fits) {
      Warn("images dropped that were empty or not of the calibrated size and type");
      return false;
    }
    last_image_ns_ = image.stamp_ns;
    return true;
  }

  int64_t StampOnImuClock(const StereoImage& image) const {
    return image.stamp_ns + CameraTimeOffset_ns();
  }
  int64_t StampOnCameraClock(int64_t imu_stamp_ns) const {
    return imu_stamp_ns - CameraTimeOffset_ns();
  }

  int64_t CameraTimeOffset_ns() const { return ToNanoseconds(rig_.camera_time_offset_s); }

  void Warn(const std::string& kind) { ++warnings_[kind]; }

  OdometryOptions options_;
  Rig rig_;
  Rectifier rectifier_;
  std::optional<RightCorrection> late_right_;  // of the current pair, where it is taken later
  RectifiedImages images_;
  std::vector<CameraGroup> groups_;       // that are used
  std::vector<RepeatedImages> repeated_;  // by camera
  TrackedPoints points_;
  std::unique_ptr<TrackedLines> lines_;  // null for methods on points alone
  Estimator estimator_;
  Pending current_;              // in process
  std::deque<Pending> pending_;  // whose IMU samples have not all arrived
  std::optional<int64_t> last_image_ns_;
  std::vector<OnlineState> states_;
  std::vector<ImuSample> imu_;
  size_t returned_ = 0;  // of states_
  size_t taken_states_ = 0, taken_imu_ = 0;
  FinishedMarks taken_;
  std::map<std::string, int64_t> warnings_;
};

Odometry::Odometry(const Rig& rig, const OdometryOptions& options, int threads)
    : impl_(std::make_unique<Impl>(rig, options, threads)) {}
Odometry::~Odometry() = default;
void Odometry::AddImu(const ImuSample& sample) { impl_->AddImu(sample); }
std::vector<OnlineState> Odometry::AddStereo(const StereoImage& image, DeferredImages decode) {
  return impl_->AddStereo(image, std::move(decode));
}
double Odometry::ImuAhead_s() const { return impl_->ImuAhead_s(); }
std::vector<OnlineState> Odometry::Finish() { return impl_->Finish(); }
OdometryRun Odometry::Run() { return impl_->Run(); }
OdometryRun Odometry::TakeFinished() { return impl_->TakeFinished(); }
OdometryRun Odometry::Window() { return impl_->Window(); }

RunRecorder::RunRecorder(const std::string& run_folder, const OdometryRun& header,
                         Odometry* odometry, std::function<Warnings()> source_warnings)
    : odometry_(odometry),
      source_warnings_(std::move(source_warnings)),
      journal_(std::make_unique<RunJournal>(run_folder, header)),
      window_written_(std::chrono::steady_clock::now()) {}

RunRecorder::~RunRecorder() = default;

void RunRecorder::Update() {
  constexpr std::chrono::milliseconds kWindowEvery(500);
  const OdometryRun finished = odometry_->TakeFinished();
  const bool new_direction = std::ranges::any_of(finished.lines, [&](const Line& line) {
    return line.world >= (line.axis == LineAxis::kSloped ? slopes_ : worlds_);
  });
  if (new_direction || std::chrono::steady_clock::now() - window_written_ >= kWindowEvery) {
    UpdateWindow(finished);
  } else {
    journal_->Append(finished);
  }
}

// What leaves the window is in the journal before it is no longer in the window's file.
void RunRecorder::UpdateWindow(OdometryRun finished) {
  OdometryRun window = odometry_->Window();
  const Warnings warnings = source_warnings_();
  for (const auto& [kind, entry] : warnings.entries()) window.warnings[kind] += entry.count;
  finished.manhattan_worlds = window.manhattan_worlds;  // lines in both refer to them
  finished.sloped_directions = window.sloped_directions;
  journal_->Append(finished);
  journal_->Append(odometry_->TakeFinished());  // by the end of what Window() waited for
  journal_->SetWindow(window);
  worlds_ = static_cast<int>(window.manhattan_worlds.size());
  slopes_ = static_cast<int>(window.sloped_directions.size());
  window_written_ = std::chrono::steady_clock::now();
}

}  // namespace slcmap::odometry
