#include "odometry/structure/points_on_lines.h"

#include <algorithm>
#include <cmath>

namespace slcmap::inline odometry {
namespace {

constexpr double kMaxDistance_px = 1.2;    // across the line, in both images
constexpr double kMinApart_px = 2.0;       // farther away, a point is not on the line
constexpr double kMaxBeyond_px = 8;        // along the line, from its nearer end
constexpr double kMinCrossing_rad = 0.35;  // between lines that share a point
constexpr int kMinKeyframes = 4;           // in a row, until a membership is verified
constexpr int kMaxUnseenKeyframes = 20;    // then a candidate is forgotten
constexpr double kArea_px = 48;  // side of the areas that points and lines are sorted into

enum class Alignment { kOn, kOff, kUnclear };

double Across_px(const Eigen::Vector2d& point, const LineSegment& segment) {
  const Eigen::Vector2d direction = (segment.end - segment.start).normalized();
  const Eigen::Vector2d from_start = point - segment.start;
  return std::abs(from_start.x() * direction.y() - from_start.y() * direction.x());
}

Alignment ClassifyAlignment(const Eigen::Vector2d& point, const LineSegment& segment) {
  const Eigen::Vector2d direction = (segment.end - segment.start).normalized();
  const double along_px = (point - segment.start).dot(direction);
  if (std::max(-along_px, along_px - segment.Length()) > kMaxBeyond_px) return Alignment::kUnclear;
  const double across_px = Across_px(point, segment);
  if (across_px > kMinApart_px) return Alignment::kOff;
  return across_px <= kMaxDistance_px ? Alignment::kOn : Alignment::kUnclear;
}

// In both images; what one of them did not see is unclear. Of one camera, in its image.
Alignment ClassifyAlignment(const PointObservation& point, const LineObservation& line,
                            const std::set<int>& lone_cameras) {
  if (point.camera != line.camera) return Alignment::kUnclear;
  const Alignment left = ClassifyAlignment(point.left_px, line.left_px);
  if (lone_cameras.contains(point.camera)) return left;
  if (!point.right_px || !line.right_px)
    return left == Alignment::kOff ? left : Alignment::kUnclear;
  const Alignment right = ClassifyAlignment(*point.right_px, *line.right_px);
  if (left == Alignment::kOff || right == Alignment::kOff) return Alignment::kOff;
  return left == right ? left : Alignment::kUnclear;
}

// Lines by areas of the left image.
class Areas {
 public:
  Areas(const std::vector<LineObservation>& lines) : side_px_(kArea_px) {
    const double reach_px = std::max(kMaxDistance_px, kMaxBeyond_px);
    for (size_t i = 0; i < lines.size(); ++i) Add(lines[i].left_px, reach_px, i);
  }

  // Indices of the lines that may come near the pixel, in rising order.
  const std::vector<size_t>& LinesNear(const Eigen::Vector2d& px) const {
    static const std::vector<size_t> kNone;
    const auto it = lines_.find(Key(px.x(), px.y()));
    return it == lines_.end() ? kNone : it->second;
  }

 private:
  using Area = std::pair<int, int>;

  Area Key(double x, double y) const {
    return {static_cast<int>(std::floor(x / side_px_)), static_cast<int>(std::floor(y / side_px_))};
  }

  void Add(const LineSegment& segment, double reach_px, size_t index) {
    const Eigen::Vector2d low = segment.start.cwiseMin(segment.end).array() - reach_px;
    const Eigen::Vector2d high = segment.start.cwiseMax(segment.end).array() + reach_px;
    const Area first = Key(low.x(), low.y()), last = Key(high.x(), high.y());
    const double near_px = reach_px + std::sqrt(0.5) * side_px_;
    for (int x = first.first; x <= last.first; ++x) {
      for (int y = first.second; y <= last.second; ++y) {
        const Eigen::Vector2d centre = {(x + 0.5) * side_px_, (y + 0.5) * side_px_};
        if (Across_px(centre, segment) <= near_px) lines_[{x, y}].push_back(index);
      }
    }
  }

  double side_px_;
  std::map<Area, std::vector<size_t>> lines_;
};

double AngleBetween(const LineSegment& a, const LineSegment& b) {
  const Eigen::Vector2d u = (a.end - a.start).normalized(), v = (b.end - b.start).normalized();
  return std::acos(std::min(1.0, std::abs(u.dot(v))));
}

struct Candidate {
  const LineObservation* line = nullptr;
  bool verified = false;
  double across_px = 0;
};

// Keeps the verified and nearest ones, and of the others those that cross all of them.
std::vector<Candidate> WithoutRivals(std::vector<Candidate> candidates, double min_crossing_rad) {
  std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
    if (a.verified != b.verified) return a.verified;
    if (a.across_px != b.across_px) return a.across_px < b.across_px;
    return a.line->id < b.line->id;
  });
  std::vector<Candidate> kept;
  for (const Candidate& c : candidates) {
    const bool crosses_all = std::all_of(kept.begin(), kept.end(), [&](const Candidate& k) {
      return AngleBetween(c.line->left_px, k.line->left_px) >= min_crossing_rad;
    });
    if (crosses_all) kept.push_back(c);
  }
  return kept;
}

template <typename Observation>
const Observation* Find(const std::map<int64_t, const Observation*>& by_id, int64_t id) {
  const auto it = by_id.find(id);
  return it == by_id.end() ? nullptr : it->second;
}

template <typename Observation>
std::map<int64_t, const Observation*> ById(const std::vector<Observation>& observations) {
  std::map<int64_t, const Observation*> out;
  for (const Observation& observation : observations) out[observation.id] = &observation;
  return out;
}

}  // namespace

void PointsOnLines::AddKeyframe(const std::vector<PointObservation>& points,
                                const std::vector<LineObservation>& lines) {
  ++keyframe_;
  BreakApart(points, lines);
  const Areas areas(lines);
  for (const PointObservation& point : points) {
    std::vector<Candidate> candidates;
    for (const size_t index : areas.LinesNear(point.left_px)) {
      const LineObservation& line = lines[index];
      if (ClassifyAlignment(point, line, lone_cameras_) != Alignment::kOn) continue;
      candidates.push_back({&line, verified_.count({point.id, line.id}) > 0,
                            Across_px(point.left_px, line.left_px)});
    }
    for (const Candidate& c : WithoutRivals(std::move(candidates), kMinCrossing_rad)) {
      Count({point.id, c.line->id});
    }
  }
  RemoveUnseen();
}

void PointsOnLines::BreakApart(const std::vector<PointObservation>& points,
                               const std::vector<LineObservation>& lines) {
  const auto points_by_id = ById(points);
  const auto lines_by_id = ById(lines);
  for (auto it = records_.begin(); it != records_.end();) {
    const PointObservation* point = Find(points_by_id, it->first.point_id);
    const LineObservation* line = Find(lines_by_id, it->first.line_id);
    const bool apart = point != nullptr && line != nullptr && !it->second.barred &&
                       ClassifyAlignment(*point, *line, lone_cameras_) == Alignment::kOff;
    if (apart) verified_.erase(it->first);
    it = apart ? records_.erase(it) : std::next(it);
  }
}

void PointsOnLines::Count(const PointOnLine& pair) {
  Record& record = records_[pair];
  record.last_keyframe = keyframe_;
  if (record.barred || ++record.together < kMinKeyframes) return;
  verified_.insert(pair);
}

void PointsOnLines::RemoveUnseen() {
  std::erase_if(records_, [&](const auto& entry) {
    return keyframe_ - entry.second.last_keyframe > kMaxUnseenKeyframes &&
           verified_.count(entry.first) == 0;
  });
}

std::vector<int64_t> PointsOnLines::CollectPoints(int64_t line_id) const {
  std::vector<int64_t> ids;
  for (const PointOnLine& pair : verified_) {
    if (pair.line_id == line_id) ids.push_back(pair.point_id);
  }
  return ids;
}

void PointsOnLines::Release(const PointOnLine& pair) {
  verified_.erase(pair);
  Record& record = records_[pair];
  record.barred = true;
  record.last_keyframe = keyframe_;
}

void PointsOnLines::ReleasePoint(int64_t point_id) {
  std::erase_if(verified_, [&](const PointOnLine& p) { return p.point_id == point_id; });
  std::erase_if(records_, [&](const auto& entry) { return entry.first.point_id == point_id; });
}

void PointsOnLines::ReleaseLine(int64_t line_id) {
  std::erase_if(verified_, [&](const PointOnLine& p) { return p.line_id == line_id; });
  std::erase_if(records_, [&](const auto& entry) { return entry.first.line_id == line_id; });
}

void PointsOnLines::MergeLine(int64_t line_id, int64_t into_line_id) {
  for (const int64_t point_id : CollectPoints(line_id)) {
    const PointOnLine pair = {point_id, into_line_id};
    Record& record = records_[pair];
    if (record.barred) continue;
    record.together = std::max(record.together, kMinKeyframes);
    record.last_keyframe = keyframe_;
    verified_.insert(pair);
  }
  ReleaseLine(line_id);
}

}  // namespace slcmap::odometry
