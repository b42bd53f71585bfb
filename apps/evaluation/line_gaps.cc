#include "apps/evaluation/line_gaps.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>

#include "data/core/math.h"

namespace slcmap::inline evaluation {
namespace {

constexpr double kMinGap_m = 0.5;  // of two edges on one line
constexpr double kMaxGap_m = 3;
constexpr double kMinApart_m = 0.04;  // of two edges beside each other
constexpr double kMaxApart_m = 0.081;
constexpr double kMinShared_m = 0.3;  // length that these lie beside each other
constexpr double kWithin_m = 0.05;    // of an edge or a gap a line is its, and
constexpr double kGapMaxAngle_deg = 10;
constexpr double kMaxBridged = 1.0 / 3;  // share of a gap that lines may cover
constexpr double kMinClear = 0.5;        // share of what edges share that was seen clearly
// of upright edges from the side of an opening, whose jamb they are
constexpr double kJamb_m = 0.1;

constexpr double kSpacing_m = 0.1;    // of the points that stand for a segment in the tree
constexpr double kRounding_m = 1e-3;  // beyond that of the tree's floats

double Distance(const PlySegment& segment, const Eigen::Vector3d& point) {
  const Eigen::Vector3d along = segment.end_world - segment.start_world;
  const double place = (point - segment.start_world).dot(along) / along.squaredNorm();
  return (segment.start_world + std::clamp(place, 0.0, 1.0) * along - point).norm();
}

double Angle(const PlySegment& segment, const Eigen::Vector3d& direction) {
  return LineAngle_rad(segment.end_world - segment.start_world, direction);
}

// Points along the segments, none further than half the spacing from a place on its segment, and
// which one each is of.
std::vector<Eigen::Vector3f> PointsAlong(const std::vector<PlySegment>& segments,
                                         std::vector<std::size_t>* segment_of) {
  std::vector<Eigen::Vector3f> points;
  for (std::size_t i = 0; i < segments.size(); ++i) {
    const Eigen::Vector3d along = segments[i].end_world - segments[i].start_world;
    const double count = std::max(std::ceil(along.norm() / kSpacing_m), 1.0);
    for (double k = 0.5; k < count; ++k) {
      points.push_back((segments[i].start_world + k / count * along).cast<float>());
      segment_of->push_back(i);
    }
  }
  return points;
}

}  // namespace

SegmentIndex::SegmentIndex(std::vector<PlySegment> segments)
    : segments_(std::move(segments)), tree_(PointsAlong(segments_, &segment_of_)) {}

std::optional<SegmentIndex::Match> SegmentIndex::Nearest(const Eigen::Vector3d& point,
                                                         const Eigen::Vector3d& direction,
                                                         double max_distance_m,
                                                         double max_angle_rad) const {
  PointTree::Found near;
  tree_.FindWithin(point.cast<float>(), max_distance_m + kSpacing_m / 2 + kRounding_m, &near);
  std::vector<int>& found = near.items;
  for (int& index : found) index = static_cast<int>(segment_of_[index]);
  // In the order of segments, so that the first of equally near ones is chosen.
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
  std::optional<Match> best;
  for (const int index : found) {
    const PlySegment& segment = segments_[static_cast<std::size_t>(index)];
    const Match match{Distance(segment, point), Angle(segment, direction),
                      static_cast<std::size_t>(index)};
    if (match.distance_m > max_distance_m || match.angle_rad > max_angle_rad) continue;
    if (!best || match.distance_m < best->distance_m) best = match;
  }
  return best;
}

namespace {

using Eigen::Vector3d;

constexpr double kSample_m = 0.02;
constexpr double kCollinear_m = 0.01, kCollinear_rad = 1 * kDegree;
constexpr double kBeside_m = 0.3;  // of an edge next to a gap
constexpr double kOnEdge_m = 1e-3;
constexpr double kSame_m = 0.005;  // middles of gaps that are one

// An edge as a point, a direction and a length.
struct Edge {
  explicit Edge(const PlySegment& segment)
      : start(segment.start_world),
        length_m((segment.end_world - segment.start_world).norm()),
        direction((segment.end_world - segment.start_world) / length_m) {}

  double Along(const Vector3d& p) const { return direction.dot(p - start); }
  Vector3d At(double along_m) const { return start + along_m * direction; }
  double Across(const Vector3d& p) const { return (p - At(Along(p))).norm(); }
  bool IsParallel(const Edge& other) const {
    return direction.cross(other.direction).norm() < std::sin(kCollinear_rad);
  }

  Edge Reversed() const { return Edge({At(length_m), start}); }

  Vector3d start;
  double length_m;
  Vector3d direction;
};

// A stretch along an edge.
struct Part {
  double from_m = 0, to_m = 0;
  double length_m() const { return to_m - from_m; }
};

Part PartBeside(const Edge& edge, const Edge& other) {
  const double a = edge.Along(other.start), b = edge.Along(other.At(other.length_m));
  return {std::max(0.0, std::min(a, b)), std::min(edge.length_m, std::max(a, b))};
}

std::vector<PlySegment> WithLength(std::vector<PlySegment> segments) {
  std::erase_if(segments, [](const PlySegment& s) { return s.start_world == s.end_world; });
  return segments;
}

std::vector<PlySegment> CollectSegments(const std::vector<MapLine>& lines) {
  std::vector<PlySegment> segments;
  for (const MapLine& line : lines) segments.push_back({line.start_world, line.end_world});
  return WithLength(std::move(segments));
}

std::vector<PlySegment> AllEdges(const TrueEdges& truth) {
  std::vector<PlySegment> all = truth.whole;
  all.insert(all.end(), truth.unseen.begin(), truth.unseen.end());
  return WithLength(std::move(all));
}

// Within the rectangle of an outline, up to half the thickness of a wall from its plane.
bool IsBehind(const std::vector<Vector3d>& outline, const Vector3d& place) {
  constexpr double kOffPlane_m = 0.1, kMargin_m = 0.02;
  const Vector3d along = (outline[1] - outline[0]).normalized();
  const Vector3d normal = along.cross(outline[2] - outline[1]).normalized();
  if (std::abs(normal.dot(place - outline[0])) > kOffPlane_m) return false;
  for (const Vector3d& axis : {along, Vector3d(normal.cross(along))}) {
    double from_m = axis.dot(outline[0]), to_m = from_m;
    for (const Vector3d& corner : outline) {
      from_m = std::min(from_m, axis.dot(corner));
      to_m = std::max(to_m, axis.dot(corner));
    }
    const double at_m = axis.dot(place);
    if (at_m < from_m - kMargin_m || at_m > to_m + kMargin_m) return false;
  }
  return true;
}

// Beside one of the sides of an opening's outline, which starts along its foot.
bool IsAtSide(const std::vector<Vector3d>& outline, const Vector3d& place, double within_m) {
  const double low_m = outline[0].z() - within_m, high_m = outline[2].z() + within_m;
  if (place.z() < low_m || place.z() > high_m) return false;
  return (place - outline[0]).head<2>().norm() <= within_m ||
         (place - outline[1]).head<2>().norm() <= within_m;
}

class GapCounter {
 public:
  GapCounter(const TrueEdges& truth, const std::vector<MapLine>& lines)
      : mapped_(CollectSegments(lines)),
        all_(AllEdges(truth)),
        doorways_(truth.doorways),
        openings_(truth.openings),
        clear_(WithLength(truth.clear.value_or(std::vector<PlySegment>()))) {
    for (const PlySegment& segment : WithLength(truth.whole)) edges_.emplace_back(segment);
  }

  LineGaps Count() const {
    LineGaps out;
    std::vector<Vector3d> counted;  // middles of gaps: each is behind the ends of two edges
    for (const Edge& edge : edges_) {
      CountGap(edge, &counted, &out);
      CountGap(edge.Reversed(), &counted, &out);
    }
    for (size_t i = 0; i < edges_.size(); ++i) {
      for (size_t k = i + 1; k < edges_.size(); ++k) CountPair(edges_[i], edges_[k], &out);
    }
    return out;
  }

 private:
  // The gap behind the end of an edge up to the next one on its line, along the edge.
  std::optional<Part> GapBehind(const Edge& edge) const {
    double next_m = edge.length_m + kMaxGap_m;
    bool found = false;
    for (const Edge& other : edges_) {
      const double a = edge.Along(other.start), b = edge.Along(other.At(other.length_m));
      if (std::min(a, b) <= edge.length_m || std::min(a, b) > next_m) continue;
      if (!edge.IsParallel(other) || edge.Across(other.start) > kCollinear_m) continue;
      next_m = std::min(a, b);
      found = true;
    }
    const Part gap{edge.length_m, next_m};
    if (!found || gap.length_m() < kMinGap_m) return std::nullopt;
    return gap;
  }

  bool IsInDoorway(const Vector3d& place) const {
    return std::any_of(doorways_.begin(), doorways_.end(), [&](const auto& outline) {
      return outline.size() >= 3 && IsBehind(outline, place);
    });
  }

  void CountGap(const Edge& edge, std::vector<Vector3d>* counted, LineGaps* out) const {
    const std::optional<Part> gap = GapBehind(edge);
    if (!gap) return;
    const Vector3d middle = edge.At(0.5 * (gap->from_m + gap->to_m));
    const auto is_it = [&](const Vector3d& other) { return (other - middle).norm() < kSame_m; };
    if (!IsInDoorway(middle) || std::any_of(counted->begin(), counted->end(), is_it)) return;
    counted->push_back(middle);
    const Part inside{gap->from_m + kWithin_m, gap->to_m - kWithin_m};
    if (ShareBeside(all_, edge, inside, kWithin_m) > 0) return;
    const Part before{std::max(0.0, gap->from_m - kBeside_m), gap->from_m};
    const Part behind{gap->to_m, gap->to_m + kBeside_m};
    for (const Part& part : {before, behind}) {
      if (ShareBeside(mapped_, edge, part, kWithin_m) < 0.5) return;
    }
    ++out->gaps;
    out->gaps_kept += ShareBeside(mapped_, edge, inside, kWithin_m) <= kMaxBridged ? 1 : 0;
  }

  void CountPair(const Edge& a, const Edge& b, LineGaps* out) const {
    if (!a.IsParallel(b)) return;
    const Part of_a = PartBeside(a, b), of_b = PartBeside(b, a);
    if (std::min(of_a.length_m(), of_b.length_m()) < kMinShared_m) return;
    const double apart_m = b.Across(a.At(0.5 * (of_a.from_m + of_a.to_m)));
    if (apart_m < kMinApart_m || apart_m > kMaxApart_m) return;
    for (const auto& [edge, part] : {std::pair(&a, of_a), std::pair(&b, of_b)}) {
      if (ShareBeside(clear_, *edge, part, kOnEdge_m) < kMinClear) return;
    }
    const bool a_shown = ShareBeside(mapped_, a, of_a, apart_m / 3) >= 0.5;
    const bool b_shown = ShareBeside(mapped_, b, of_b, apart_m / 3) >= 0.5;
    if (!a_shown && !b_shown) return;
    const bool kept = a_shown && b_shown;
    const bool is_jamb = IsAtJamb(a, of_a) && IsAtJamb(b, of_b);
    ++out->pairs;
    out->pairs_kept += kept ? 1 : 0;
    out->jambs += is_jamb ? 1 : 0;
    out->jambs_kept += is_jamb && kept ? 1 : 0;
  }

  bool IsAtJamb(const Edge& edge, const Part& part) const {
    if (std::abs(edge.direction.z()) < std::cos(kCollinear_rad)) return false;
    const Vector3d middle = edge.At(0.5 * (part.from_m + part.to_m));
    return std::any_of(openings_.begin(), openings_.end(), [&](const auto& outline) {
      return outline.size() >= 3 && IsAtSide(outline, middle, kJamb_m);
    });
  }

  // The share of a part of an edge that segments lie beside.
  double ShareBeside(const SegmentIndex& segments, const Edge& edge, const Part& part,
                     double within_m) const {
    const int count = std::max(1, static_cast<int>(part.length_m() / kSample_m));
    int beside = 0;
    for (int i = 0; i < count; ++i) {
      const Vector3d place = edge.At(part.from_m + (i + 0.5) / count * part.length_m());
      beside +=
          segments.Nearest(place, edge.direction, within_m, kGapMaxAngle_deg * kDegree) ? 1 : 0;
    }
    return static_cast<double>(beside) / count;
  }

  const SegmentIndex mapped_, all_;
  const std::vector<std::vector<Vector3d>>&doorways_, &openings_;
  const SegmentIndex clear_;
  std::vector<Edge> edges_;
};

}  // namespace

LineGaps EvaluateLineGaps(const TrueEdges& truth, const std::vector<MapLine>& lines) {
  return GapCounter(truth, lines).Count();
}

}  // namespace slcmap::evaluation
