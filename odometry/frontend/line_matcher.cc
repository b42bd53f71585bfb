#include "odometry/frontend/line_matcher.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/line_descriptor.hpp>

#include "odometry/frontend/line_segment.h"

namespace slcmap::inline odometry {
namespace {

using cv::line_descriptor::KeyLine;

constexpr int kMaxDescriptorBits = 60;          // of 256, between observations of one line
constexpr double kMinLeadBits = 10;             // of the best match before the second best
constexpr double kMinStereoCorrelation = 0.85;  // of the pictures beside the left and right segment
constexpr double kMinStereoLead = 0.03;         // of the best correlation before the second best
constexpr double kMatcherMaxDisparity = 0.25;   // of the image's width

// Of the image that is described: a fifth of the time that the whole image takes.
constexpr double kScale = 0.5;
constexpr int kBandWidth_px = 4;  // there; nine bands make up the neighbourhood

LineSegment InSmallImage(const LineSegment& s) {
  const auto scaled = [](const Eigen::Vector2d& p) -> Eigen::Vector2d {
    return kScale * (p.array() + 0.5) - 0.5;
  };
  return {scaled(s.start), scaled(s.end)};
}

KeyLine ToKeyLine(const LineSegment& segment, int index, const cv::Size& size) {
  KeyLine line;
  line.class_id = index;
  line.octave = 0;
  line.startPointX = line.sPointInOctaveX = static_cast<float>(segment.start.x());
  line.startPointY = line.sPointInOctaveY = static_cast<float>(segment.start.y());
  line.endPointX = line.ePointInOctaveX = static_cast<float>(segment.end.x());
  line.endPointY = line.ePointInOctaveY = static_cast<float>(segment.end.y());
  line.pt = cv::Point2f(static_cast<float>(segment.Midpoint().x()),
                        static_cast<float>(segment.Midpoint().y()));
  const Eigen::Vector2d d = Direction(segment);
  line.angle = static_cast<float>(std::atan2(d.y(), d.x()));
  line.lineLength = static_cast<float>(segment.Length());
  line.numOfPixels = static_cast<int>(std::lround(segment.Length()));
  line.response = line.lineLength / static_cast<float>(std::max(size.width, size.height));
  line.size = line.lineLength;
  return line;
}

}  // namespace

cv::Mat DescribeSegments(const cv::Mat& image, const std::vector<LineSegment>& segments) {
  if (segments.empty()) return {};
  cv::Mat small;
  cv::resize(image, small, cv::Size(), kScale, kScale, cv::INTER_AREA);
  std::vector<KeyLine> lines;
  lines.reserve(segments.size());
  for (const auto& s : segments) {
    lines.push_back(ToKeyLine(InSmallImage(s), static_cast<int>(lines.size()), small.size()));
  }
  cv::line_descriptor::BinaryDescriptor::Params params;
  params.widthOfBand_ = kBandWidth_px;
  cv::Mat descriptors;
  cv::line_descriptor::BinaryDescriptor::createBinaryDescriptor(params)->compute(small, lines,
                                                                                 descriptors);
  return descriptors;
}

int DescriptorDistance(const cv::Mat& a, const cv::Mat& b) {
  return static_cast<int>(cv::norm(a, b, cv::NORM_HAMMING));
}

namespace {

constexpr int kWidth = 2 * kProfileReach_px + 1;
constexpr int kSide = kProfileReach_px + 3;  // one side, with the edge itself
constexpr int kRows = 12;

// A column of it is a row of the strip.
using Strip = Eigen::Matrix<float, kWidth, kRows>;

float SampleStrip(const cv::Mat& image, float x, float y) {
  return SampleBetween(image, std::clamp(x, 0.f, static_cast<float>(image.cols) - 1.01f),
                       std::clamp(y, 0.f, static_cast<float>(image.rows) - 1.01f));
}

// Calls take(i, r, value) for each sample i of each row r.
template <typename Take>
void SampleRows(const cv::Mat& image, const LineSegment& segment, const Eigen::Vector2d& across,
                int reach_px, Take take) {
  const Eigen::Vector2f step = across.cast<float>();
  for (int r = 0; r < kRows; ++r) {
    const Eigen::Vector2d center =
        segment.start + (r + 0.5) / kRows * (segment.end - segment.start);
    Eigen::Vector2f p = (center - reach_px * across).cast<float>();
    for (int i = 0; i <= 2 * reach_px; ++i, p += step) take(i, r, SampleStrip(image, p.x(), p.y()));
  }
}

template <typename A, typename B>
double Correlation(const A& a, const B& b) {
  const float mean_a = a.mean(), mean_b = b.mean();
  const float ab = ((a.array() - mean_a) * (b.array() - mean_b)).sum();
  const float norm =
      std::sqrt((a.array() - mean_a).square().sum() * (b.array() - mean_b).square().sum());
  return norm < 1e-3f ? -1 : ab / norm;
}

template <typename A, typename B>
double BestCorrelation(const A& a, const B& b) {
  return std::max({Correlation(a, b),
                   Correlation(a.template topRows<kSide>(), b.template topRows<kSide>()),
                   Correlation(a.template bottomRows<kSide>(), b.template bottomRows<kSide>())});
}

}  // namespace

Eigen::VectorXf MeanProfile(const cv::Mat& image, const LineSegment& segment, int reach_px) {
  Eigen::VectorXf profile = Eigen::VectorXf::Zero(2 * reach_px + 1);
  SampleRows(image, segment, Normal(segment), reach_px,
             [&](int i, int, float value) { profile[i] += value / kRows; });
  return profile;
}

double ProfileCorrelation(const Eigen::VectorXf& a, const Eigen::VectorXf& b) {
  return BestCorrelation(a, b);
}

double StripCorrelation(const cv::Mat& image_a, const LineSegment& a, const cv::Mat& image_b,
                        const LineSegment& b, const Eigen::Vector2d& across) {
  Strip strip_a, strip_b;
  SampleRows(image_a, a, across, kProfileReach_px,
             [&](int i, int r, float v) { strip_a(i, r) = v; });
  SampleRows(image_b, b, across, kProfileReach_px,
             [&](int i, int r, float v) { strip_b(i, r) = v; });
  return BestCorrelation(strip_a, strip_b);
}

namespace {

constexpr double kMinLengthRatio = 0.2;
constexpr double kBitsPerGate = 12;  // what a distance of a whole gate costs, in descriptor bits
constexpr double kMaxStereoAngle_rad = 0.5;
constexpr double kMinRowOverlap = 0.5;  // of the shorter segment's rows

constexpr double kRejected = std::numeric_limits<double>::infinity();

// Costs of all pairs; kRejected where a gate rejects the pair.
class CostTable {
 public:
  CostTable(size_t rows, size_t columns) : columns_(columns), costs_(rows * columns, kRejected) {}
  double& operator()(size_t row, size_t column) { return costs_[row * columns_ + column]; }

  bool AnyInColumn(size_t column) const { return std::isfinite(At(BestOfColumn(column), column)); }

  // The column that is the row's best and whose best is the row, where the row's second best costs
  // at least min_lead more. `alike(a, b)` columns don't compete.
  template <typename Alike>
  std::optional<int> MutualBest(size_t row, double min_lead, Alike alike) const {
    const int best = BestOfRow(row);
    if (best < 0 || BestOfColumn(best) != static_cast<int>(row)) return std::nullopt;
    for (size_t c = 0; c < columns_; ++c) {
      if (static_cast<int>(c) == best || alike(best, static_cast<int>(c))) continue;
      if (At(row, c) < At(row, best) + min_lead) return std::nullopt;
    }
    return best;
  }

 private:
  double At(size_t row, size_t column) const { return costs_[row * columns_ + column]; }
  int BestOfRow(size_t row) const {
    int best = -1;
    for (size_t c = 0; c < columns_; ++c) {
      if (std::isfinite(At(row, c)) && (best < 0 || At(row, c) < At(row, best)))
        best = static_cast<int>(c);
    }
    return best;
  }
  int BestOfColumn(size_t column) const {
    int best = 0;
    for (size_t r = 1; r < costs_.size() / columns_; ++r) {
      if (At(r, column) < At(best, column)) best = static_cast<int>(r);
    }
    return best;
  }

  size_t columns_;
  std::vector<double> costs_;
};

bool SameLine(const LineSegment& a, const LineSegment& b) {
  return AngleBetween_rad(a, b) < 0.05 && std::abs(DistanceAcross_px(a, b.start)) < 2 &&
         std::abs(DistanceAcross_px(a, b.end)) < 2;
}

// The distance across, as a share of the gate; nothing where a gate rejects the pair.
std::optional<double> GatedDistance(const ExpectedSegment& expected, const LineSegment& found) {
  const double shorter = std::min(expected.segment.Length(), found.Length());
  const double longer = std::max(expected.segment.Length(), found.Length());
  if (shorter < kMinLengthRatio * longer) return std::nullopt;
  if (AngleBetween_rad(expected.segment, found) > expected.max_angle_rad) return std::nullopt;
  if (Overlap_px(expected.segment, found) + expected.slack_px < 0.3 * shorter) return std::nullopt;
  const double distance = LargestDistance_px(expected.segment, found);
  if (distance > expected.gate_px) return std::nullopt;
  return distance / expected.gate_px;
}

// Leaves the pairs whose profiles are alike: a tenth of what comparing descriptors costs.
void RejectOtherProfiles(const cv::Mat& image, const std::vector<ExpectedSegment>& expected,
                         const std::vector<LineSegment>& segments, double min_correlation,
                         CostTable* costs) {
  for (size_t s = 0; s < segments.size(); ++s) {
    if (!costs->AnyInColumn(s)) continue;
    const Eigen::VectorXf profile = MeanProfile(image, segments[s]);
    for (size_t e = 0; e < expected.size(); ++e) {
      double& cost = (*costs)(e, s);
      if (std::isfinite(cost) &&
          ProfileCorrelation(expected[e].profile, profile) < min_correlation) {
        cost = kRejected;
      }
    }
  }
}

// The descriptors of the segments that have a finite cost; empty elsewhere.
std::vector<cv::Mat> DescribePlausible(const cv::Mat& image,
                                       const std::vector<LineSegment>& segments,
                                       const CostTable& costs) {
  std::vector<LineSegment> plausible;
  std::vector<size_t> indices;
  for (size_t i = 0; i < segments.size(); ++i) {
    if (!costs.AnyInColumn(i)) continue;
    plausible.push_back(segments[i]);
    indices.push_back(i);
  }
  const cv::Mat descriptors = DescribeSegments(image, plausible);
  std::vector<cv::Mat> all(segments.size());
  for (size_t i = 0; i < indices.size(); ++i)
    all[indices[i]] = descriptors.row(static_cast<int>(i));
  return all;
}

// The x of the infinite line at a row.
double XAtRow(const LineSegment& line, double row) {
  return line.start.x() +
         (row - line.start.y()) * (line.end.x() - line.start.x()) / (line.end.y() - line.start.y());
}

struct Rows {
  double low, high;
  double size() const { return high - low; }
};

Rows CollectRows(const LineSegment& s) {
  return {std::min(s.start.y(), s.end.y()), std::max(s.start.y(), s.end.y())};
}

// 1 - correlation of two segments that cross the rows steeply enough to have a disparity.
std::optional<double> SteepCost(const cv::Mat& left_image, const cv::Mat& right_image,
                                const LineSegment& left, const LineSegment& right,
                                double max_disparity_px) {
  const Rows a = CollectRows(left), b = CollectRows(right);
  const Rows both{std::max(a.low, b.low), std::min(a.high, b.high)};
  if (both.size() < kMinRowOverlap * std::min(a.size(), b.size()) || both.size() < 4) {
    return std::nullopt;
  }
  const LineSegment l{{XAtRow(left, both.low), both.low}, {XAtRow(left, both.high), both.high}};
  const LineSegment r{{XAtRow(right, both.low), both.low}, {XAtRow(right, both.high), both.high}};
  for (const double d : {l.start.x() - r.start.x(), l.end.x() - r.end.x()}) {
    if (d < -1 || d > max_disparity_px) return std::nullopt;
  }
  return 1 - StripCorrelation(left_image, l, right_image, r, {1, 0});
}

// The same of two segments that run along the rows: no place on one is known on the other, so that
// their mean profiles are compared.
std::optional<double> FlatCost(const cv::Mat& left_image, const cv::Mat& right_image,
                               const LineSegment& left, const LineSegment& right,
                               double max_disparity_px) {
  const auto columns = [](const LineSegment& s) {
    return Rows{std::min(s.start.x(), s.end.x()), std::max(s.start.x(), s.end.x())};
  };
  const Rows a = columns(left), b = columns(right);
  if (std::min(a.high, b.high + max_disparity_px) - std::max(a.low, b.low) <
      kMinRowOverlap * std::min(a.size(), b.size())) {
    return std::nullopt;
  }
  const Rows rows = CollectRows(left);
  const double middle = right.Midpoint().y();
  if (middle < rows.low - 0.1 * left.Length() - 2 || middle > rows.high + 0.1 * left.Length() + 2) {
    return std::nullopt;
  }
  return 1 - ProfileCorrelation(MeanProfile(left_image, left), MeanProfile(right_image, right));
}

bool IsFlat(const LineSegment& s) { return std::abs(Direction(s).y()) < 0.15; }

std::optional<double> StereoCost(const cv::Mat& left_image, const cv::Mat& right_image,
                                 const LineSegment& left, const LineSegment& right,
                                 double max_disparity_px) {
  if (AngleBetween_rad(left, right) > kMaxStereoAngle_rad) return std::nullopt;
  const auto cost = IsFlat(left) || IsFlat(right) ? FlatCost : SteepCost;
  return cost(left_image, right_image, left, right, max_disparity_px);
}

}  // namespace

std::vector<std::optional<int>> MatchExpected(const cv::Mat& image,
                                              const std::vector<ExpectedSegment>& expected,
                                              const std::vector<LineSegment>& segments) {
  std::vector<std::optional<int>> matches(expected.size());
  if (expected.empty() || segments.empty()) return matches;
  CostTable costs(expected.size(), segments.size());
  for (size_t e = 0; e < expected.size(); ++e) {
    for (size_t s = 0; s < segments.size(); ++s) {
      const auto distance = GatedDistance(expected[e], segments[s]);
      if (distance) costs(e, s) = kBitsPerGate * *distance;
    }
  }
  RejectOtherProfiles(image, expected, segments, kMatcherMinCorrelation, &costs);
  const std::vector<cv::Mat> descriptors = DescribePlausible(image, segments, costs);
  for (size_t e = 0; e < expected.size(); ++e) {
    for (size_t s = 0; s < segments.size(); ++s) {
      if (!std::isfinite(costs(e, s))) continue;
      const int bits = DescriptorDistance(expected[e].descriptor, descriptors[s]);
      costs(e, s) = bits <= kMaxDescriptorBits ? costs(e, s) + bits : kRejected;
    }
  }
  const auto alike = [&](int a, int b) { return SameLine(segments[a], segments[b]); };
  for (size_t e = 0; e < expected.size(); ++e) {
    matches[e] = costs.MutualBest(e, kMinLeadBits, alike);
  }
  return matches;
}

bool IsStereoMatch(const cv::Mat& left_image, const cv::Mat& right_image, const LineSegment& left,
                   const LineSegment& right) {
  const auto cost =
      StereoCost(left_image, right_image, left, right, kMatcherMaxDisparity * left_image.cols);
  return cost && *cost <= 1 - kMinStereoCorrelation;
}

std::vector<std::optional<int>> MatchStereo(const cv::Mat& left_image, const cv::Mat& right_image,
                                            const std::vector<LineSegment>& left,
                                            const std::vector<LineSegment>& right) {
  std::vector<std::optional<int>> matches(left.size());
  if (left.empty() || right.empty()) return matches;
  const double max_disparity_px = kMatcherMaxDisparity * left_image.cols;
  CostTable costs(left.size(), right.size());
  for (size_t l = 0; l < left.size(); ++l) {
    for (size_t r = 0; r < right.size(); ++r) {
      const auto cost = StereoCost(left_image, right_image, left[l], right[r], max_disparity_px);
      if (cost && *cost <= 1 - kMinStereoCorrelation) costs(l, r) = *cost;
    }
  }
  const auto alike = [&](int a, int b) { return SameLine(right[a], right[b]); };
  for (size_t l = 0; l < left.size(); ++l) {
    matches[l] = costs.MutualBest(l, kMinStereoLead, alike);
  }
  return matches;
}

}  // namespace slcmap::odometry
