#include "odometry/frontend/line_tracker.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "odometry/frontend/line_detector.h"
#include "odometry/frontend/line_matcher.h"
#include "odometry/frontend/line_segment.h"

namespace slcmap::inline odometry {
namespace {

constexpr int kLineTrackerMaxMisses = 3;  // calls in a row without an observation or a prediction
constexpr double kGateSigmas = 3;         // across the line, about a prediction, and
constexpr double kMinGate_px = 1.5;       // added to them
constexpr double kPredictedAngle_rad = 0.04;
constexpr double kMaxParallax_px = 40;    // of a line without prediction, beyond the rotation
constexpr double kMovedAngle_rad = 0.15;  // the same of its direction

constexpr double kMaxAxisAngle_rad = 0.05;
constexpr double kAxisBonus = 2;        // in length
constexpr double kLongEnough_px = 150;  // beyond it more length counts less
constexpr double kNear_px = 12;         // nearly parallel ones so near say the same
constexpr double kNearDiscount = 0.4;
constexpr double kDirectionDiscount = 0.1;  // a line that is there already in this direction
constexpr int kDirectionBins = 6;           // of those that follow no axis

struct Ranked {
  int index = 0;
  int direction = 0;
  double score = 0;
};

// Axes first, then bins of the angle in the image.
int DirectionClass(const LineSegment& s, int axis, int axes) {
  if (axis >= 0) return axis;
  const Eigen::Vector2d d = Direction(s);
  const double turn = std::atan2(d.y(), d.x()) / M_PI + 1;  // 0 to 2; opposite ones are 1 apart
  return axes + static_cast<int>(std::fmod(turn, 1.0) * kDirectionBins);
}

bool IsNear(const LineSegment& a, const LineSegment& b) {
  const double angle = AngleBetween_rad(a, b);
  if (std::min(angle, M_PI - angle) > 0.15 || Overlap_px(a, b) < 0) return false;
  return std::abs(DistanceAcross_px(a, b.Midpoint())) < kNear_px;
}

double SoftLength(double length_px) {
  return length_px < kLongEnough_px ? length_px : std::sqrt(kLongEnough_px * length_px);
}

}  // namespace

int FindAxis(const LineSegment& segment, const Camera& camera,
             const std::vector<Eigen::Vector3d>& axes_camera) {
  const auto ray = [&](const Eigen::Vector2d& p) -> Eigen::Vector3d {
    return {(p.x() - camera.cx_px) / camera.fx_px, (p.y() - camera.cy_px) / camera.fy_px, 1};
  };
  int best = -1;
  double best_angle = kMaxAxisAngle_rad;
  const Eigen::Vector3d middle = ray(segment.Midpoint());
  const Eigen::Vector2d direction = (ray(segment.end) - ray(segment.start)).head<2>().normalized();
  for (size_t i = 0; i < axes_camera.size(); ++i) {
    // The direction in the image, at the segment's middle, of a line along the axis.
    const Eigen::Vector2d v = axes_camera[i].head<2>() - axes_camera[i].z() * middle.head<2>();
    if (v.norm() < 1e-3) continue;
    const double sine = std::abs(v.x() * direction.y() - v.y() * direction.x()) / v.norm();
    if (std::asin(std::min(1.0, sine)) < best_angle) {
      best_angle = std::asin(std::min(1.0, sine));
      best = static_cast<int>(i);
    }
  }
  return best;
}

std::vector<int> SelectSegments(const std::vector<LineSegment>& candidates,
                                const std::vector<LineSegment>& kept, const Camera& camera,
                                const std::vector<Eigen::Vector3d>& axes_camera, int room) {
  const int axes = static_cast<int>(axes_camera.size());
  std::vector<int> in_direction(axes + kDirectionBins + 1, 0);
  for (const auto& s : kept)
    ++in_direction[DirectionClass(s, FindAxis(s, camera, axes_camera), axes)];
  std::vector<Ranked> ranked;
  for (size_t i = 0; i < candidates.size(); ++i) {
    const int axis = FindAxis(candidates[i], camera, axes_camera);
    double score = SoftLength(candidates[i].Length()) * (axis >= 0 ? kAxisBonus : 1);
    for (const auto& s : kept) score *= IsNear(s, candidates[i]) ? kNearDiscount : 1;
    ranked.push_back({static_cast<int>(i), DirectionClass(candidates[i], axis, axes), score});
  }
  const auto worth = [&](const Ranked& r) {
    return r.score / (1 + kDirectionDiscount * in_direction[r.direction]);
  };
  std::vector<int> selected;
  while (static_cast<int>(selected.size()) < room && !ranked.empty()) {
    const auto best = std::max_element(ranked.begin(), ranked.end(),
                                       [&](auto& a, auto& b) { return worth(a) < worth(b); });
    const Ranked chosen = *best;
    ranked.erase(best);
    selected.push_back(chosen.index);
    ++in_direction[chosen.direction];
    for (auto& r : ranked) {
      if (IsNear(candidates[chosen.index], candidates[r.index])) r.score *= kNearDiscount;
    }
  }
  return selected;
}

namespace {

// Fewer new lines than this share of all are not worth a detection.
constexpr double kMinRoom = 0.2;
// A line that is known may be seen shorter, as a share of what is detected.
constexpr double kMinKept = 0.6;
// From pair to pair, of a line found without prediction.
constexpr double kMaxDisparityChange = 0.3;
constexpr double kMaxDisparityChange_px = 3;

struct KnownLine {
  LineSegment seen_px;      // in the left image, when seen last
  LineSegment expected_px;  // now: predicted, or as if the camera only rotated
  Eigen::VectorXf profile;  // when seen last
  cv::Mat descriptor;       // of the last observation; empty until the line is lost
  double gate_px = 0;       // 0 without a prediction
  int misses = 0;
  std::optional<double> disparity_px;  // when seen last, at the middle; of steep lines only
  bool unsure = false;                 // found without prediction in the pair at hand
};

// At the middle of the rows that both cover; nothing for lines along the rows.
std::optional<double> Disparity_px(const LineObservation& o) {
  if (!o.right_px || std::abs(Direction(o.left_px).y()) < 0.3) return std::nullopt;
  const double row = o.left_px.Midpoint().y();
  const auto x_at_row = [row](const LineSegment& s) {
    const Eigen::Vector2d d = s.end - s.start;
    return s.start.x() + (row - s.start.y()) * d.x() / d.y();
  };
  return x_at_row(o.left_px) - x_at_row(*o.right_px);
}

bool SimilarDisparity(double a_px, double b_px) {
  return std::abs(a_px - b_px) <
         kMaxDisparityChange_px + kMaxDisparityChange * std::max(a_px, b_px);
}

}  // namespace

class LineTracker::Impl {
 public:
  Impl(const LineTrackerOptions& options, const Rig& rig, const cv::Mat& mask_left,
       const cv::Mat& mask_right)
      : options_(options), camera_(rig.cameras[0]), masks_{mask_left, mask_right} {}

  void Track(const cv::Mat& left, const cv::Mat& right, const Eigen::Quaterniond& R_now_previous,
             const std::vector<LinePrediction>& predictions,
             const std::vector<Eigen::Vector3d>& axes_camera) {
    previous_left_ = std::move(left_);
    left_ = left.clone();
    right_ = right;
    observations_.clear();
    Expect(R_now_previous.toRotationMatrix(), predictions);
    FollowPredicted(predictions);
    if (Room() > kMinRoom * options_.max_lines) {
      std::vector<LineSegment> segments = DetectSegments(left_, masks_[0], options_.detector);
      std::erase_if(segments, [&](const LineSegment& s) { return IsObserved(s); });
      FindLost(&segments);
      AddNew(axes_camera, segments);
    }
    if (!right_.empty()) FindRight();
    RenameImplausible();
    right_.release();
    std::sort(observations_.begin(), observations_.end(),
              [](const auto& a, const auto& b) { return a.id < b.id; });
    std::erase_if(known_,
                  [&](const auto& entry) { return entry.second.misses > kLineTrackerMaxMisses; });
  }

  void Remove(const std::unordered_set<int64_t>& ids) {
    std::erase_if(known_, [&](const auto& entry) { return ids.contains(entry.first); });
    std::erase_if(observations_, [&](const auto& o) { return ids.contains(o.id); });
  }

  void Reset() {
    known_.clear();
    observations_.clear();
  }

  const std::vector<LineObservation>& observations() const { return observations_; }

 private:
  int Room() const { return options_.max_lines - static_cast<int>(observations_.size()); }

  void Expect(const Eigen::Matrix3d& R, const std::vector<LinePrediction>& predictions) {
    for (auto& [id, line] : known_) {
      line.expected_px = Rotate(R, line.expected_px);
      line.gate_px = 0;
      line.unsure = false;
      ++line.misses;
    }
    for (const auto& p : predictions) {
      const auto known = known_.find(p.id);
      if (known == known_.end() || p.left_px.Length() < 1) continue;
      KnownLine& line = known->second;
      line.expected_px = AlignedTo(line.expected_px, p.left_px);
      line.gate_px = Gate_px(p);
      line.misses = 0;
    }
  }

  double Gate_px(const LinePrediction& p) const { return kMinGate_px + kGateSigmas * p.sigma_px; }

  static LineSegment AlignedTo(const LineSegment& oriented, const LineSegment& s) {
    return Direction(s).dot(Direction(oriented)) < 0 ? Reversed(s) : s;
  }

  // Where the segment is if the camera only rotated; itself where that is behind the camera.
  LineSegment Rotate(const Eigen::Matrix3d& R, const LineSegment& segment) const {
    const auto rotate = [&](const Eigen::Vector2d& p) -> Eigen::Vector3d {
      return R * Eigen::Vector3d((p.x() - camera_.cx_px) / camera_.fx_px,
                                 (p.y() - camera_.cy_px) / camera_.fy_px, 1);
    };
    const Eigen::Vector3d a = rotate(segment.start), b = rotate(segment.end);
    if (a.z() < 0.1 || b.z() < 0.1) return segment;
    const Eigen::Vector2d f(camera_.fx_px, camera_.fy_px), c(camera_.cx_px, camera_.cy_px);
    return {f.cwiseProduct(a.head<2>() / a.z()) + c, f.cwiseProduct(b.head<2>() / b.z()) + c};
  }

  void FollowPredicted(const std::vector<LinePrediction>& predictions) {
    for (const auto& p : predictions) {
      const auto known = known_.find(p.id);
      if (Room() <= 0 || known == known_.end() || known->second.gate_px == 0) continue;
      const KnownLine& line = known->second;
      const auto found =
          FollowEdge(left_, line.expected_px, line.profile, line.gate_px, kMatcherMinCorrelation);
      if (!found || found->Length() < kMinKept * options_.detector.min_length_px) continue;
      if (IsObserved(*found)) continue;
      Observe(p.id, *found);
      if (p.right_px && !right_.empty()) FollowRight(p, &observations_.back());
    }
  }

  void FollowRight(const LinePrediction& p, LineObservation* o) const {
    const LineSegment expected = AlignedTo(o->left_px, *p.right_px);
    const auto found =
        FollowEdge(right_, expected, known_.at(o->id).profile, Gate_px(p), kMatcherMinCorrelation);
    if (found && IsStereoMatch(left_, right_, o->left_px, *found)) {
      o->right_px = found;
    }
  }

  // True where the segment lies on a line that is observed already.
  bool IsObserved(const LineSegment& s) const {
    return std::any_of(observations_.begin(), observations_.end(), [&](const auto& o) {
      return AngleBetween_rad(o.left_px, s) < 0.05 && Overlap_px(o.left_px, s) > -20 &&
             LargestDistance_px(o.left_px, s) < 2;
    });
  }

  // Finds lines among the segments that were detected, and takes those away.
  void FindLost(std::vector<LineSegment>* segments) {
    std::vector<int64_t> ids;
    for (const auto& [id, line] : known_) {
      if (!WasObserved(id)) ids.push_back(id);
    }
    DescribeLost(ids);
    std::vector<ExpectedSegment> expected;
    for (const int64_t id : ids) expected.push_back(ExpectedNow(known_.at(id)));
    const auto matches = MatchExpected(left_, expected, *segments);
    std::vector<char> taken(segments->size(), 0);
    for (size_t i = 0; i < ids.size() && Room() > 0; ++i) {
      if (!matches[i]) continue;
      KnownLine& line = known_.at(ids[i]);
      const LineSegment& found = (*segments)[*matches[i]];
      line.unsure = line.gate_px == 0;
      Observe(ids[i], found);
      taken[*matches[i]] = 1;
    }
    size_t index = 0;
    std::erase_if(*segments, [&](const LineSegment&) { return taken[index++] != 0; });
  }

  bool WasObserved(int64_t id) const {
    return std::any_of(observations_.begin(), observations_.end(),
                       [&](const auto& o) { return o.id == id; });
  }

  // Those lost just now are described in the image that showed them last.
  void DescribeLost(const std::vector<int64_t>& ids) {
    std::vector<KnownLine*> lines;
    std::vector<LineSegment> segments;
    for (const int64_t id : ids) {
      KnownLine& line = known_.at(id);
      if (!line.descriptor.empty()) continue;
      lines.push_back(&line);
      segments.push_back(line.seen_px);
    }
    const cv::Mat descriptors = DescribeSegments(previous_left_, segments);
    for (size_t i = 0; i < lines.size(); ++i) {
      lines[i]->descriptor = descriptors.row(static_cast<int>(i)).clone();
    }
  }

  ExpectedSegment ExpectedNow(const KnownLine& line) const {
    if (line.gate_px == 0) {
      return {line.expected_px, line.profile,    line.descriptor,
              kMaxParallax_px,  kMaxParallax_px, kMovedAngle_rad};
    }
    return {line.expected_px,
            line.profile,
            line.descriptor,
            line.gate_px,
            0,
            kPredictedAngle_rad + line.gate_px / line.expected_px.Length()};
  }

  void AddNew(const std::vector<Eigen::Vector3d>& axes_camera,
              const std::vector<LineSegment>& candidates) {
    std::vector<LineSegment> kept;
    for (const auto& o : observations_) kept.push_back(o.left_px);
    for (const int c : SelectSegments(candidates, kept, camera_, axes_camera, Room())) {
      Observe(next_id_++, candidates[c]);
    }
  }

  void Observe(int64_t id, const LineSegment& segment) {
    KnownLine& line = known_[id];
    line.seen_px = line.expected_px = segment;
    line.profile = MeanProfile(left_, segment);
    line.descriptor.release();
    line.misses = 0;
    observations_.push_back({id, segment, std::nullopt});
  }

  // Of the lines that have no right segment yet.
  void FindRight() {
    std::vector<LineObservation*> lines;
    std::vector<LineSegment> left;
    for (auto& o : observations_) {
      if (o.right_px) continue;
      lines.push_back(&o);
      left.push_back(o.left_px);
    }
    if (left.empty()) return;
    const auto right = DetectSegments(right_, masks_[1], options_.detector);
    const auto matches = MatchStereo(left_, right_, left, right);
    for (size_t i = 0; i < lines.size(); ++i) {
      if (matches[i]) lines[i]->right_px = right[*matches[i]];
    }
  }

  // A line found without prediction that is suddenly much nearer or farther is another one.
  void RenameImplausible() {
    for (auto& o : observations_) {
      const auto disparity = Disparity_px(o);
      const auto known = known_.find(o.id);
      const auto before = std::exchange(known->second.disparity_px, disparity);
      if (!known->second.unsure || !before || !disparity) continue;
      if (SimilarDisparity(*before, *disparity)) continue;
      o.id = next_id_++;
      known_[o.id] = std::move(known->second);
      known_.erase(known);
    }
  }

  LineTrackerOptions options_;
  Camera camera_;
  std::array<cv::Mat, 2> masks_;
  cv::Mat left_, right_, previous_left_;
  std::map<int64_t, KnownLine> known_;
  std::vector<LineObservation> observations_;
  int64_t next_id_ = 0;
};

LineTracker::LineTracker(const LineTrackerOptions& options, const Rig& rectified_rig,
                         const cv::Mat& mask_left, const cv::Mat& mask_right)
    : impl_(std::make_unique<Impl>(options, rectified_rig, mask_left, mask_right)) {}
LineTracker::~LineTracker() = default;

void LineTracker::Track(const cv::Mat& left, const cv::Mat& right,
                        const Eigen::Quaterniond& R_now_previous,
                        const std::vector<LinePrediction>& predictions,
                        const std::vector<Eigen::Vector3d>& axes_camera) {
  impl_->Track(left, right, R_now_previous, predictions, axes_camera);
}
void LineTracker::Remove(const std::unordered_set<int64_t>& ids) { impl_->Remove(ids); }
void LineTracker::Reset() { impl_->Reset(); }
const std::vector<LineObservation>& LineTracker::observations() const {
  return impl_->observations();
}

}  // namespace slcmap::odometry
