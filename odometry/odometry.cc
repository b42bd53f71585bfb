#include "odometry/odometry.h"

#include <algorithm>
#include <chrono>
#include <deque>
#include <mutex>
#include <utility>

#include "data/calibration/calibration.h"
#include "data/core/error.h"
#include "odometry/frontend/line_tracker.h"
#include "odometry/frontend/point_tracker.h"
#include "odometry/frontend/rectifier.h"
#include "odometry/run/run_journal.h"
#include "odometry/run/run_queries.h"
#include "odometry/window/estimator.h"

namespace slcmap::inline odometry {
namespace {

constexpr size_t kMaxPending = 100;  // pairs that wait for their IMU samples

Rig CheckedRig(const Rig& rig, const OdometryOptions& options) {
  options.Check();
  rig.cameras[0].Check("left camera");
  if (HasTwoCameras(rig)) rig.cameras[1].Check(IsStereo(rig) ? "right camera" : "second camera");
  return rig;
}

struct Pending {
  StereoImage image;
  std::function<cv::Mat()> decode_right;
};

// The pair in process. Its right image is decoded and rectified once it is asked for; points and
// lines may ask at the same time.
class RectifiedPair {
 public:
  void Set(cv::Mat left, std::function<cv::Mat()> rectify_right) {
    left_ = std::move(left);
    right_.release();
    rectify_right_ = std::move(rectify_right);
  }
  const cv::Mat& left() const { return left_; }
  const cv::Mat& right() {
    const std::lock_guard lock(mutex_);
    if (rectify_right_) right_ = std::exchange(rectify_right_, nullptr)();
    return right_;
  }

 private:
  cv::Mat left_;
  std::mutex mutex_;  // guards what follows
  cv::Mat right_;
  std::function<cv::Mat()> rectify_right_;
};

// Of two cameras that look apart each is followed by a tracker of its own. Outside, what the first
// one follows has even ids and what the second one does odd ones.
int64_t OutsideId(int64_t id, int camera) { return 2 * id + camera; }
int CameraOfId(int64_t outside_id) { return static_cast<int>(outside_id % 2); }
int64_t IdInTracker(int64_t outside_id) { return outside_id / 2; }

std::unordered_set<int64_t> IdsInTracker(const std::unordered_set<int64_t>& ids, int camera) {
  std::unordered_set<int64_t> own;
  for (const int64_t id : ids) {
    if (CameraOfId(id) == camera) own.insert(IdInTracker(id));
  }
  return own;
}

// One tracker, or two of cameras that look apart, whose observations it joins.
template <typename Tracker, typename Observation>
class Trackers {
 public:
  // The rotation of the second camera from the first.
  Trackers(const Rig& rig, bool two)
      : R_second_first_(rig.T_imu_camera[1].rotation.conjugate() * rig.T_imu_camera[0].rotation),
        two_(two) {}

  template <typename... Arguments>
  void Add(const Arguments&... arguments) {
    trackers_.push_back(std::make_unique<Tracker>(arguments...));
  }

  bool two() const { return two_; }
  Tracker& of(int camera) { return *trackers_[camera]; }
  // Turns of the second camera, and directions in it, from those of the first.
  Eigen::Quaterniond ToSecond(const Eigen::Quaterniond& turn_of_first) const {
    return R_second_first_ * turn_of_first * R_second_first_.conjugate();
  }
  std::vector<Eigen::Vector3d> ToSecond(std::vector<Eigen::Vector3d> directions) const {
    for (Eigen::Vector3d& direction : directions) direction = R_second_first_ * direction;
    return directions;
  }

  const std::vector<Observation>& observations() const {
    return two_ ? joined_ : trackers_[0]->observations();
  }
  // Once they have seen their images; `sees_second`: there was one of the second camera.
  void Join(bool sees_second) {
    joined_.clear();
    for (int camera = 0; camera < (sees_second ? 2 : 1); ++camera) {
      for (Observation seen : trackers_[camera]->observations()) {
        seen.id = OutsideId(seen.id, camera);
        seen.camera = camera;
        joined_.push_back(seen);
      }
    }
    std::ranges::sort(joined_, {}, &Observation::id);
  }

  void Remove(const std::unordered_set<int64_t>& ids) {
    if (!two_) return trackers_[0]->Remove(ids);
    for (int camera = 0; camera < 2; ++camera) trackers_[camera]->Remove(IdsInTracker(ids, camera));
    std::erase_if(joined_, [&](const Observation& seen) { return ids.contains(seen.id); });
  }
  void Reset() {
    for (const auto& tracker : trackers_) tracker->Reset();
    joined_.clear();
  }

 private:
  Eigen::Quaterniond R_second_first_;
  bool two_;
  std::vector<std::unique_ptr<Tracker>> trackers_;
  std::vector<Observation> joined_;  // of two, by id
};

class TrackedPoints final : public PointSource {
 public:
  TrackedPoints(PointTrackerOptions options, const Rectifier& rectifier, bool two,
                RectifiedPair* pair)
      : trackers_(rectifier.rectified_rig(), two), pair_(pair) {
    if (two) options.max_points = (options.max_points + 1) / 2;  // all in all as many
    for (int camera = 0; camera < (two ? 2 : 1); ++camera) {
      trackers_.Add(options, rectifier.rectified_rig(), rectifier.mask(camera));
    }
  }
  void Track(const Eigen::Quaterniond& R_now_previous) {
    trackers_.of(0).Track(pair_->left(), R_now_previous);
    if (!trackers_.two()) return;
    const cv::Mat& second = pair_->right();
    if (second.empty()) {
      trackers_.of(1).Reset();
    } else {
      trackers_.of(1).Track(second, trackers_.ToSecond(R_now_previous));
    }
    trackers_.Join(true);
  }
  const std::vector<PointObservation>& observations() const override {
    return trackers_.observations();
  }
  void Detect() override {
    if (!trackers_.two()) return trackers_.of(0).Detect(pair_->right(), rows_move_px_);
    trackers_.of(0).Detect(cv::Mat());
    if (!pair_->right().empty()) trackers_.of(1).Detect(cv::Mat());
    trackers_.Join(true);
  }
  // By how much points may be off their rows in right images.
  void SetRowsMove(double rows_move_px) { rows_move_px_ = rows_move_px; }
  void Remove(const std::unordered_set<int64_t>& ids) override { trackers_.Remove(ids); }
  void Reset() override { trackers_.Reset(); }

 private:
  Trackers<PointTracker, PointObservation> trackers_;
  RectifiedPair* pair_;
  double rows_move_px_ = 0;
};

class TrackedLines final : public LineSource {
 public:
  TrackedLines(const LineTrackerOptions& options, const Rectifier& rectifier, bool two,
               RectifiedPair* pair)
      : trackers_(rectifier.rectified_rig(), two), pair_(pair) {
    for (int camera = 0; camera < (two ? 2 : 1); ++camera) {
      trackers_.Add(options, rectifier.rectified_rig(), rectifier.mask(camera), rectifier.mask(1));
    }
  }
  void Track(const Eigen::Quaterniond& R_now_previous,
             const std::vector<LinePrediction>& predictions,
             const std::vector<Eigen::Vector3d>& axes_camera) override {
    if (!trackers_.two()) {
      trackers_.of(0).Track(pair_->left(), pair_->right(), R_now_previous, predictions,
                            axes_camera);
      return;
    }
    trackers_.of(0).Track(pair_->left(), cv::Mat(), R_now_previous, OfCamera(0, predictions),
                          axes_camera);
    turn_of_second_ = trackers_.ToSecond(R_now_previous) * turn_of_second_;
    const bool sees_second = !pair_->right().empty();
    if (sees_second) {
      trackers_.of(1).Track(pair_->right(), cv::Mat(), turn_of_second_, OfCamera(1, predictions),
                            trackers_.ToSecond(axes_camera));
      turn_of_second_.setIdentity();
    }
    trackers_.Join(sees_second);
  }
  const std::vector<LineObservation>& observations() const override {
    return trackers_.observations();
  }
  void Remove(const std::unordered_set<int64_t>& ids) override { trackers_.Remove(ids); }
  void Reset() override { trackers_.Reset(); }

 private:
  static std::vector<LinePrediction> OfCamera(int camera,
                                              const std::vector<LinePrediction>& predictions) {
    std::vector<LinePrediction> own;
    for (LinePrediction prediction : predictions) {
      if (prediction.camera != camera) continue;
      prediction.id = IdInTracker(prediction.id);
      own.push_back(prediction);
    }
    return own;
  }

  Trackers<LineTracker, LineObservation> trackers_;
  RectifiedPair* pair_;
  // Since the second camera's last image.
  Eigen::Quaterniond turn_of_second_ = Eigen::Quaterniond::Identity();
};

// One camera tells nothing of another.
OdometryOptions ForRig(OdometryOptions options, const Rig& rig) {
  if (UsesRight(options.method, rig)) return options;
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
        two_apart_(UsesTwoCameras(options.method, rig) && LooksApart(rig)),
        points_(options.points, rectifier_, two_apart_, &pair_),
        lines_(UsesLines(options.method)
                   ? std::make_unique<TrackedLines>(options.lines, rectifier_, two_apart_, &pair_)
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

  std::vector<OnlineState> AddStereo(const StereoImage& image,
                                     std::function<cv::Mat()> decode_right) {
    if (Acceptable(image)) pending_.push_back({image, std::move(decode_right)});
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
    estimator_.DescribeFinished(&taken_, &run);
    ToCameraClock(&run);
    TakeNew(states_, &taken_states_, &run.states);
    TakeNew(imu_, &taken_imu_, &run.imu);
    return run;
  }

  OdometryRun Window() {
    Take(estimator_.FinishKeyframe());
    OdometryRun run;
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
    const bool repeats = repeated_left_.Repeats(image.left);
    if (repeats) Take(estimator_.FinishKeyframe());
    if (repeats && !estimator_.RestsUntil(stamp_ns)) {  // at rest images may be the same
      Warn("images dropped that repeat the one before while the rig moves");
      return;
    }
    Take(estimator_.CheckGaps(stamp_ns));
    pair_.Set(RectifiedLeft(), [this] { return RectifiedRight(); });
    TrackPoints(stamp_ns);
    Take(estimator_.FinishKeyframe());
    CorrectRightRectification(stamp_ns);
    Take(estimator_.AddImage(stamp_ns));
  }

  // Follows what is known of the right camera, so that points are found along the rows.
  void CorrectRightRectification(int64_t stamp_ns) {
    if (two_apart_) return;
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

  // Of the current pair; empty where there is none. Called on keyframes only, once, in the
  // thread of the points or of the lines; of cameras that look apart, while points are tracked.
  cv::Mat RectifiedRight() {
    if (!UsesTwoCameras(options_.method, rig_)) return cv::Mat();
    const auto& [image, decode_right] = current_;
    const cv::Mat right = image.right.empty() && decode_right ? decode_right() : image.right;
    if (right.empty() && !decode_right) return right;
    if (!Fits(right, 1)) {
      Warn("right images left out that were damaged");
      return cv::Mat();
    }
    const bool repeats = repeated_right_.Repeats(right);
    if (repeats && two_apart_) Take(estimator_.FinishKeyframe());
    if (repeats && !estimator_.RestsUntil(StampOnImuClock(image))) {
      Warn("right images ignored that repeat the one before while the rig moves");
      return cv::Mat();
    }
    if (late_right_) rectifier_.CorrectRight(*late_right_);
    return rectifier_.Rectify(right, 1);
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
    if (!Fits(image.left, 0) || (!image.right.empty() && !Fits(image.right, 1))) {
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
  RepeatedImages repeated_left_, repeated_right_;
  Rectifier rectifier_;
  std::optional<RightCorrection> late_right_;  // of the current pair, where it is taken later
  RectifiedPair pair_;
  bool two_apart_;  // cameras, both of which are used
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
std::vector<OnlineState> Odometry::AddStereo(const StereoImage& image,
                                             std::function<cv::Mat()> decode_right) {
  return impl_->AddStereo(image, std::move(decode_right));
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
