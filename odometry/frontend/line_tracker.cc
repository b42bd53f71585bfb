#include "odometry/frontend/line_tracker.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "odometry/frontend/line_descriptor.h"
#include "odometry/frontend/line_detector.h"
#include "odometry/frontend/line_geometry.h"
#include "odometry/frontend/line_matcher.h"
#include "odometry/frontend/line_selection.h"

namespace slcmap {
namespace {

struct KnownLine {
  LineSegment left_px;  // last seen, or where it is by now if the camera only rotated
  cv::Mat descriptor;
  int misses = 0;
};

// A pair's segments and which of them are taken.
struct PairSegments {
  DescribedSegments left;
  std::vector<LineSegment> right;
  std::vector<std::optional<int>> right_of_left;
  std::vector<char> free;
};

}  // namespace

class LineTracker::Impl {
 public:
  Impl(const LineTrackerOptions& options, const Rig& rig, const cv::Mat& mask_left,
       const cv::Mat& mask_right)
      : options_(options), camera_(rig.cameras[0]), masks_{mask_left, mask_right} {}

  void Track(const cv::Mat& left, const cv::Mat& right, const Eigen::Quaterniond& R_now_previous,
             const std::vector<LinePrediction>& predictions,
             const std::vector<Eigen::Vector3d>& axes_camera) {
    PairSegments pair = Detect(left, right);
    observations_.clear();
    Rotate(R_now_previous.toRotationMatrix());
    for (auto& [id, line] : known_) ++line.misses;
    FollowPredicted(predictions, &pair);
    FollowMoved(&pair);
    AddNew(axes_camera, &pair);
    std::sort(observations_.begin(), observations_.end(),
              [](const auto& a, const auto& b) { return a.id < b.id; });
    std::erase_if(known_,
                  [&](const auto& entry) { return entry.second.misses > options_.max_misses; });
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
  PairSegments Detect(const cv::Mat& left, const cv::Mat& right) const {
    PairSegments pair;
    pair.left.segments = DetectSegments(left, masks_[0], options_.detector);
    pair.left.descriptors = DescribeSegments(left, pair.left.segments);
    pair.free.assign(pair.left.segments.size(), 1);
    pair.right_of_left.resize(pair.left.segments.size());
    if (right.empty()) return pair;
    pair.right = DetectSegments(right, masks_[1], options_.detector);
    pair.right_of_left = MatchStereo(left, right, pair.left.segments, pair.right, options_.matcher);
    return pair;
  }

  // Moves all known lines as if the camera only rotated; those that leave the view are forgotten.
  void Rotate(const Eigen::Matrix3d& R) {
    const auto rotate = [&](Eigen::Vector2d* p) {
      const Eigen::Vector3d ray((p->x() - camera_.cx_px) / camera_.fx_px,
                                (p->y() - camera_.cy_px) / camera_.fy_px, 1);
      const Eigen::Vector3d r = R * ray;
      if (r.z() < 0.1) return false;
      *p = {camera_.fx_px * r.x() / r.z() + camera_.cx_px,
            camera_.fy_px * r.y() / r.z() + camera_.cy_px};
      return true;
    };
    for (auto& [id, line] : known_) {
      LineSegment rotated = line.left_px;
      if (rotate(&rotated.start) && rotate(&rotated.end)) line.left_px = rotated;
    }
  }

  void FollowPredicted(const std::vector<LinePrediction>& predictions, PairSegments* pair) {
    std::vector<int64_t> ids;
    std::vector<ExpectedSegment> expected;
    for (const auto& p : predictions) {
      const auto known = known_.find(p.id);
      if (known == known_.end() || p.left_px.Length() < 1) continue;
      LineSegment segment = p.left_px;
      if (Direction(segment).dot(Direction(known->second.left_px)) < 0) segment = Reversed(segment);
      known->second.left_px = segment;
      known->second.misses = 0;
      const double gate = options_.min_gate_px + options_.gate_sigmas * p.sigma_px;
      ids.push_back(p.id);
      expected.push_back({segment, known->second.descriptor, gate, 0,
                          options_.predicted_angle_rad + gate / segment.Length()});
    }
    Observe(ids, MatchExpected(expected, pair->left, pair->free, options_.matcher), pair);
  }

  void FollowMoved(PairSegments* pair) {
    std::vector<int64_t> ids;
    std::vector<ExpectedSegment> expected;
    for (const auto& [id, line] : known_) {
      if (line.misses == 0) continue;
      ids.push_back(id);
      expected.push_back({line.left_px, line.descriptor, options_.max_parallax_px,
                          options_.max_parallax_px, options_.moved_angle_rad});
    }
    Observe(ids, MatchExpected(expected, pair->left, pair->free, options_.matcher), pair);
  }

  void AddNew(const std::vector<Eigen::Vector3d>& axes_camera, PairSegments* pair) {
    std::vector<LineSegment> kept;
    for (const auto& o : observations_) kept.push_back(o.left_px);
    std::vector<int> indices;
    std::vector<LineSegment> candidates;
    for (size_t i = 0; i < pair->left.segments.size(); ++i) {
      if (!pair->free[i]) continue;
      indices.push_back(static_cast<int>(i));
      candidates.push_back(pair->left.segments[i]);
    }
    const int room = options_.max_lines - static_cast<int>(kept.size());
    for (const int c : SelectSegments(candidates, kept, camera_, axes_camera, room)) {
      Observe(next_id_++, indices[c], pair);
    }
  }

  void Observe(const std::vector<int64_t>& ids, const std::vector<std::optional<int>>& matches,
               PairSegments* pair) {
    for (size_t i = 0; i < ids.size(); ++i) {
      const bool full = static_cast<int>(observations_.size()) >= options_.max_lines;
      if (matches[i] && !full) Observe(ids[i], *matches[i], pair);
    }
  }

  void Observe(int64_t id, int index, PairSegments* pair) {
    pair->free[index] = 0;
    KnownLine& line = known_[id];
    line.left_px = pair->left.segments[index];
    line.descriptor = pair->left.descriptors.row(index).clone();
    line.misses = 0;
    LineObservation o{id, line.left_px, std::nullopt};
    if (const auto right = pair->right_of_left[index]) o.right_px = pair->right[*right];
    observations_.push_back(o);
  }

  LineTrackerOptions options_;
  Camera camera_;
  std::array<cv::Mat, 2> masks_;
  std::map<int64_t, KnownLine> known_;
  std::vector<LineObservation> observations_;
  int64_t next_id_ = 0;
};

LineTracker::LineTracker(const LineTrackerOptions& options, const Rig& rectified_rig,
                         const cv::Mat& mask_left, const cv::Mat& mask_right) {
  options.Check();
  impl_ = std::make_unique<Impl>(options, rectified_rig, mask_left, mask_right);
}
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

}  // namespace slcmap
