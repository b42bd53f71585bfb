#include "odometry/frontend/line_detector.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/ximgproc/edge_drawing.hpp>
#include <opencv2/ximgproc/fast_line_detector.hpp>
#include <vector>

#include "odometry/frontend/line_matcher.h"
#include "odometry/frontend/line_segment.h"

namespace slcmap::inline odometry {
namespace {

constexpr double kMaxJoinAngle_rad = 0.03;
constexpr double kMaxJoinDistance_px = 1.2;
constexpr double kMinContrast = 4;  // grey values from side to side

std::vector<cv::Vec4f> RunDetector(const cv::Mat& image, LineDetectorKind kind,
                                   double min_length_px) {
  std::vector<cv::Vec4f> lines;
  switch (kind) {
    case LineDetectorKind::kLsd:
      cv::createLineSegmentDetector(cv::LSD_REFINE_STD)->detect(image, lines);
      break;
    case LineDetectorKind::kFld:
      cv::ximgproc::createFastLineDetector(static_cast<int>(min_length_px), 1.41421356f, 30, 60, 3,
                                           false)
          ->detect(image, lines);
      break;
    case LineDetectorKind::kEd: {
      const auto detector = cv::ximgproc::createEdgeDrawing();
      detector->params.EdgeDetectionOperator = cv::ximgproc::EdgeDrawing::SOBEL;
      detector->params.GradientThresholdValue = 24;
      detector->params.AnchorThresholdValue = 4;
      detector->params.MinLineLength = static_cast<int>(min_length_px);
      detector->params.NFAValidation = false;
      detector->detectEdges(image);
      detector->detectLines(lines);
      break;
    }
  }
  return lines;
}

bool Valid(const cv::Mat& mask, const Eigen::Vector2d& p) {
  const int u = static_cast<int>(std::lround(p.x())), v = static_cast<int>(std::lround(p.y()));
  return u >= 0 && v >= 0 && u < mask.cols && v < mask.rows && mask.at<uchar>(v, u) != 0;
}

// The longest part of the segment that, with a margin on both sides, is valid: edges that leave the
// image are among the longest ones, and go on to its border.
LineSegment CutToMask(const cv::Mat& mask, const LineSegment& segment) {
  if (mask.empty()) return segment;
  constexpr double kMargin_px = 3, kStep_px = 4;
  const Eigen::Vector2d margin = kMargin_px * Normal(segment);
  const int steps = std::max(1, static_cast<int>(std::ceil(segment.Length() / kStep_px)));
  const auto at = [&](int i) -> Eigen::Vector2d {
    return segment.start + static_cast<double>(i) / steps * (segment.end - segment.start);
  };
  int from = 0, best_from = 0, best_to = 0;
  for (int i = 0; i <= steps; ++i) {
    if (!Valid(mask, at(i) + margin) || !Valid(mask, at(i) - margin)) {
      from = i + 1;
    } else if (i - from > best_to - best_from) {
      best_from = from;
      best_to = i;
    }
  }
  return {at(best_from), at(best_to)};
}

// A segment with what joining asks for again and again.
struct Piece {
  explicit Piece(const LineSegment& s)
      : segment(s), direction(Direction(s)), normal(Normal(s)), length_px(s.Length()) {}
  LineSegment segment;
  Eigen::Vector2d direction, normal;
  double length_px;
};

// `piece` continues or lies upon the longer `edge`.
bool SameEdge(const Piece& edge, const Piece& piece, double max_gap_px) {
  const Eigen::Vector2d start = piece.segment.start - edge.segment.start;
  const Eigen::Vector2d end = piece.segment.end - edge.segment.start;
  if (std::abs(edge.normal.dot(start)) >= kMaxJoinDistance_px ||
      std::abs(edge.normal.dot(end)) >= kMaxJoinDistance_px) {
    return false;
  }
  if (edge.direction.dot(piece.direction) < 0 ||
      std::abs(edge.normal.dot(piece.direction)) >
          std::max(kMaxJoinAngle_rad, 1 / piece.length_px)) {
    return false;
  }
  const double gap = std::max(edge.direction.dot(start) - edge.length_px, -edge.direction.dot(end));
  return gap <= std::min(max_gap_px, piece.length_px + 0.3 * edge.length_px);
}

// The segment over both, on the line of least squares through the four ends weighted by length.
LineSegment Join(const LineSegment& a, const LineSegment& b) {
  const double wa = a.Length(), wb = b.Length();
  const Eigen::Vector2d center = (wa * a.Midpoint() + wb * b.Midpoint()) / (wa + wb);
  Eigen::Matrix2d scatter = Eigen::Matrix2d::Zero();
  for (const auto& [p, w] : {std::pair(a.start, wa), {a.end, wa}, {b.start, wb}, {b.end, wb}}) {
    scatter += w * (p - center) * (p - center).transpose();
  }
  const double angle = 0.5 * std::atan2(2 * scatter(0, 1), scatter(0, 0) - scatter(1, 1));
  Eigen::Vector2d direction(std::cos(angle), std::sin(angle));
  if (direction.dot(a.end - a.start) < 0) direction = -direction;
  double low = 0, high = 0;
  for (const auto& p : {a.start, a.end, b.start, b.end}) {
    low = std::min(low, direction.dot(p - center));
    high = std::max(high, direction.dot(p - center));
  }
  return {center + low * direction, center + high * direction};
}

void SortByLength(std::vector<LineSegment>* segments) {
  std::stable_sort(segments->begin(), segments->end(),
                   [](const auto& a, const auto& b) { return a.Length() > b.Length(); });
}

// Joins what continues the first piece of `rest`; what doesn't stays in `rest`.
LineSegment TakeEdge(double max_gap_px, std::vector<Piece>* rest) {
  Piece edge = rest->front();
  rest->erase(rest->begin());
  for (bool grown = true; grown;) {
    grown = false;
    std::erase_if(*rest, [&](const Piece& piece) {
      if (!SameEdge(edge, piece, max_gap_px)) return false;
      edge = Piece(Join(edge.segment, piece.segment));
      return grown = true;
    });
  }
  return edge.segment;
}

// What the small image told less surely: where an edge is, and where it ends.
LineRefinementOptions RefinementAfter(double scale) {
  constexpr double kEnd_px = 6;  // of the small image
  LineRefinementOptions refinement;
  refinement.reach_px += 1 / scale - 1;
  refinement.max_extension_px = kEnd_px * (1 / scale - 1);
  return refinement;
}

// True where the segment lies on one of `segments`: pieces that were not joined may end on one
// edge.
bool IsAmong(const std::vector<LineSegment>& segments, const LineSegment& s) {
  return std::any_of(segments.begin(), segments.end(), [&](const LineSegment& other) {
    return Overlap_px(other, s) > 0.5 * s.Length() &&
           LargestDistance_px(other, s) < kMaxJoinDistance_px &&
           AngleBetween_rad(other, s) < kMaxJoinAngle_rad;
  });
}

}  // namespace

std::vector<LineSegment> DetectRawSegments(const cv::Mat& image, const LineDetectorOptions& options,
                                           double min_length_px) {
  cv::Mat small = image;
  if (options.scale < 1) {
    cv::resize(image, small, cv::Size(), options.scale, options.scale, cv::INTER_AREA);
  }
  // By the scale, not by the sizes, which are rounded: cv::resize() does so too.
  const auto in_whole = [&options](double x, double y) -> Eigen::Vector2d {
    return (Eigen::Array2d(x, y) + 0.5) / options.scale - 0.5;
  };
  std::vector<LineSegment> segments;
  for (const auto& l : RunDetector(small, options.kind, min_length_px * options.scale)) {
    const LineSegment segment{in_whole(l[0], l[1]), in_whole(l[2], l[3])};
    if (segment.Length() >= min_length_px) segments.push_back(segment);
  }
  return segments;
}

std::vector<LineSegment> JoinSegments(std::vector<LineSegment> segments, double max_gap_px) {
  SortByLength(&segments);
  std::vector<Piece> pieces(segments.begin(), segments.end());
  std::vector<LineSegment> joined;
  while (!pieces.empty()) joined.push_back(TakeEdge(max_gap_px, &pieces));
  SortByLength(&joined);
  return joined;
}

std::vector<LineSegment> DetectSegments(const cv::Mat& image, const cv::Mat& mask,
                                        const LineDetectorOptions& options) {
  const double min_piece_px = std::min(12.0, options.min_length_px);
  std::vector<LineSegment> pieces;
  for (const auto& raw : DetectRawSegments(image, options, min_piece_px)) {
    const LineSegment piece = CutToMask(mask, raw);
    if (piece.Length() < min_piece_px) continue;
    const double contrast = MeanContrast(image, piece);
    if (std::abs(contrast) < kMinContrast) continue;
    pieces.push_back(contrast > 0 ? piece : Reversed(piece));
  }
  const LineRefinementOptions refinement = RefinementAfter(options.scale);
  std::vector<LineSegment> segments;
  for (const auto& joined : JoinSegments(std::move(pieces), options.max_join_gap_px)) {
    const bool full = static_cast<int>(segments.size()) >= options.max_segments;
    if (full || joined.Length() < options.min_length_px) break;
    const auto refined = RefineSegment(image, joined, refinement);
    if (!refined) continue;
    const LineSegment segment = CutToMask(mask, refined->segment);
    if (segment.Length() < options.min_length_px || IsAmong(segments, segment)) continue;
    segments.push_back(segment);
  }
  SortByLength(&segments);
  return segments;
}

namespace {

constexpr double kMaxExtension_px = 60;
constexpr double kTiltLoss = 0.15;  // of correlation, while the tilt is not found
constexpr double kMinLead = 0.05;   // of the best place before another
constexpr int kOtherPlace_px = 3;   // that is another place

// The shift across, in whole pixels, at which the profile is found.
std::optional<int> FindShift(const cv::Mat& image, const LineSegment& expected,
                             const Eigen::VectorXf& profile, int gate_px, double min_correlation) {
  const Eigen::VectorXf wide = MeanProfile(image, expected, kProfileReach_px + gate_px);
  std::vector<double> correlations;
  for (int i = 0; i <= 2 * gate_px; ++i) {
    correlations.push_back(ProfileCorrelation(profile, wide.segment(i, profile.size())));
  }
  const auto best = std::max_element(correlations.begin(), correlations.end());
  if (*best < min_correlation) return std::nullopt;
  for (auto it = correlations.begin(); it != correlations.end(); ++it) {
    if (std::abs(it - best) >= kOtherPlace_px && *it > *best - kMinLead) return std::nullopt;
  }
  return static_cast<int>(best - correlations.begin()) - gate_px;
}

}  // namespace

std::optional<LineSegment> FollowEdge(const cv::Mat& image, const LineSegment& expected,
                                      const Eigen::VectorXf& profile, double gate_px,
                                      double min_correlation) {
  const auto shift = FindShift(image, expected, profile, static_cast<int>(std::ceil(gate_px)),
                               min_correlation - kTiltLoss);
  if (!shift) return std::nullopt;
  const Eigen::Vector2d offset = *shift * Normal(expected);
  LineRefinementOptions options;
  options.max_extension_px = kMaxExtension_px;
  const auto refined =
      RefineSegment(image, {expected.start + offset, expected.end + offset}, options);
  if (!refined) return std::nullopt;
  const Eigen::VectorXf found = MeanProfile(image, refined->segment);
  if (ProfileCorrelation(profile, found) < min_correlation) return std::nullopt;
  return refined->segment;
}

}  // namespace slcmap::odometry
