#include "odometry/odometry.h"

#include <deque>
#include <utility>

#include "data/calibration.h"
#include "data/error.h"
#include "odometry/finite_run.h"
#include "odometry/frontend/line_tracker.h"
#include "odometry/frontend/point_tracker.h"
#include "odometry/frontend/rectifier.h"
#include "odometry/frontend/repeated_images.h"
#include "odometry/window/estimator.h"

namespace slcmap {
namespace {

constexpr size_t kMaxPending = 100;  // pairs that wait for their IMU samples

Rig CheckedRig(const Rig& rig, const OdometryOptions& options) {
  options.Check();
  rig.cameras[0].Check("left camera");
  if (IsStereo(rig)) {
    rig.cameras[1].Check("right camera");
  } else if (options.method != Method::kPointsMono) {
    throw ConfigError("method: found " + MethodName(options.method) +
                      " with one camera, expected points-mono");
  }
  return rig;
}

class TrackedPoints final : public PointSource {
 public:
  explicit TrackedPoints(PointTracker* tracker) : tracker_(tracker) {}
  const std::vector<PointObservation>& observations() const override {
    return tracker_->observations();
  }
  void Detect() override { tracker_->Detect(); }
  void Remove(const std::unordered_set<int64_t>& ids) override { tracker_->Remove(ids); }
  void Reset() override { tracker_->Reset(); }

 private:
  PointTracker* tracker_;
};

// Tracks lines in the pair that was last shown.
class TrackedLines final : public LineSource {
 public:
  TrackedLines(const LineTrackerOptions& options, const Rectifier& rectifier)
      : tracker_(options, rectifier.rectified_rig(), rectifier.mask(0), rectifier.mask(1)) {}
  void Show(const StereoImage& rectified) { image_ = rectified; }
  void Track(const Eigen::Quaterniond& R_now_previous,
             const std::vector<LinePrediction>& predictions,
             const std::vector<Eigen::Vector3d>& axes_camera) override {
    tracker_.Track(image_.left, image_.right, R_now_previous, predictions, axes_camera);
  }
  const std::vector<LineObservation>& observations() const override {
    return tracker_.observations();
  }
  void Remove(const std::unordered_set<int64_t>& ids) override { tracker_.Remove(ids); }
  void Reset() override { tracker_.Reset(); }

 private:
  LineTracker tracker_;
  StereoImage image_;
};

}  // namespace

class Odometry::Impl {
 public:
  Impl(const Rig& rig, const OdometryOptions& options)
      : options_(options),
        rig_(CheckedRig(rig, options)),
        rectifier_(rig, options.rectifier),
        tracker_(options.points, rectifier_.rectified_rig(), rectifier_.mask(0)),
        points_(&tracker_),
        lines_(UsesLines(options.method) ? std::make_unique<TrackedLines>(options.lines, rectifier_)
                                         : nullptr),
        estimator_(options, rectifier_.rectified_rig(), &points_, lines_.get()) {}

  void AddImu(const ImuSample& sample) {
    if (!estimator_.AddImu(sample)) {
      Warn("IMU samples dropped (not finite, absurd, repeated or out of order)");
    }
  }

  std::vector<OnlineState> AddStereo(const StereoImage& image) {
    if (Acceptable(image)) pending_.push_back(image);
    if (pending_.size() > kMaxPending) {
      Warn("images dropped whose IMU samples did not arrive");
      pending_.pop_front();
    }
    std::vector<OnlineState> states;
    while (!pending_.empty() && estimator_.imu().Covers(StampOnImuClock(pending_.front()))) {
      if (const auto state = Process(pending_.front())) states.push_back(*state);
      pending_.pop_front();
    }
    states_.insert(states_.end(), states.begin(), states.end());
    return states;
  }

  OdometryRun Run() const {
    OdometryRun run;
    run.method = MethodName(options_.method);
    run.rectified_rig = rectifier_.rectified_rig();
    run.states = states_;
    run.warnings = warnings_;
    if (!pending_.empty())
      run.warnings["images whose IMU samples did not arrive"] = std::ssize(pending_);
    estimator_.Describe(&run);
    run.timings.stages = estimator_.clock().Stages();
    return WithoutNonFinite(std::move(run));
  }

 private:
  // One image, stage by stage.
  std::optional<OnlineState> Process(const StereoImage& image) {
    const int64_t stamp_ns = StampOnImuClock(image);
    if (estimator_.imu().first_stamp_ns() > stamp_ns) {
      Warn("images dropped that came before the first IMU sample");
      return std::nullopt;
    }
    const RepeatedImages::Repeats hangs = WhatHangs(image, stamp_ns);
    if (hangs.left) return std::nullopt;
    estimator_.CheckGaps(stamp_ns);
    const StereoImage rectified = Rectify(image, hangs.right);
    TrackPoints(rectified, stamp_ns);
    if (lines_) lines_->Show(rectified);
    std::optional<OnlineState> state = estimator_.AddImage(stamp_ns);
    if (state) state->stamp_ns = image.stamp_ns;
    return state;
  }

  // The cameras that repeat their last image although the rig moves. At rest images may be the
  // same.
  RepeatedImages::Repeats WhatHangs(const StereoImage& image, int64_t stamp_ns) {
    const RepeatedImages::Repeats repeats = repeated_images_.Compare(image);
    if (!(repeats.left || repeats.right) || estimator_.RestsUntil(stamp_ns)) return {};
    if (repeats.left) {
      Warn("images dropped that repeat the one before while the rig moves");
    } else {
      Warn("right images ignored that repeat the one before while the rig moves");
    }
    return repeats;
  }

  StereoImage Rectify(const StereoImage& image, bool without_right) {
    const auto timed = estimator_.clock()->Time("rectification");
    const bool stereo =
        !without_right && options_.method != Method::kPointsMono && !image.right.empty();
    return {image.stamp_ns, rectifier_.Rectify(image.left, 0),
            stereo ? rectifier_.Rectify(image.right, 1) : cv::Mat()};
  }

  void TrackPoints(const StereoImage& rectified, int64_t stamp_ns) {
    const auto timed = estimator_.clock()->Time("point tracking");
    tracker_.Track(rectified.left, rectified.right, estimator_.PredictedCameraRotation(stamp_ns));
  }

  bool Acceptable(const StereoImage& image) {
    const auto fits = [&](const cv::Mat& m, int camera) {
      return m.type() == CV_8UC1 && m.cols == rig_.cameras[camera].width_px &&
             m.rows == rig_.cameras[camera].height_px;
    };
    if (last_image_ns_ && image.stamp_ns <= *last_image_ns_) {
      Warn("images dropped that were repeated or out of order");
      return false;
    }
    if (!fits(image.left, 0) || (!image.right.empty() && !fits(image.right, 1))) {
      Warn("images dropped that were empty or not of the calibrated size and type");
      return false;
    }
    last_image_ns_ = image.stamp_ns;
    return true;
  }

  int64_t StampOnImuClock(const StereoImage& image) const {
    return image.stamp_ns + ToNanoseconds(rig_.camera_time_offset_s);
  }

  void Warn(const std::string& kind) { ++warnings_[kind]; }

  OdometryOptions options_;
  Rig rig_;
  RepeatedImages repeated_images_;
  Rectifier rectifier_;
  PointTracker tracker_;
  TrackedPoints points_;
  std::unique_ptr<TrackedLines> lines_;  // null for methods on points alone
  Estimator estimator_;
  std::deque<StereoImage> pending_;  // whose IMU samples have not all arrived
  std::optional<int64_t> last_image_ns_;
  std::vector<OnlineState> states_;
  std::map<std::string, int64_t> warnings_;
};

Odometry::Odometry(const Rig& rig, const OdometryOptions& options)
    : impl_(std::make_unique<Impl>(rig, options)) {}
Odometry::~Odometry() = default;
void Odometry::AddImu(const ImuSample& sample) { impl_->AddImu(sample); }
std::vector<OnlineState> Odometry::AddStereo(const StereoImage& image) {
  return impl_->AddStereo(image);
}
OdometryRun Odometry::Run() const { return impl_->Run(); }

}  // namespace slcmap
