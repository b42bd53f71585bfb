#include "odometry/frontend/line_segment.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

namespace slcmap::inline odometry {

Eigen::Vector2d Direction(const LineSegment& segment) {
  return (segment.end - segment.start).normalized();
}

Eigen::Vector2d Normal(const LineSegment& segment) {
  const Eigen::Vector2d d = Direction(segment);
  return {d.y(), -d.x()};
}

LineSegment Reversed(const LineSegment& segment) { return {segment.end, segment.start}; }

double AngleBetween_rad(const LineSegment& a, const LineSegment& b) {
  const Eigen::Vector2d p = Direction(a), q = Direction(b);
  return std::atan2(std::abs(p.x() * q.y() - p.y() * q.x()), p.dot(q));
}

double DistanceAcross_px(const LineSegment& line, const Eigen::Vector2d& point_px) {
  return Normal(line).dot(point_px - line.start);
}

double PlaceAlong_px(const LineSegment& line, const Eigen::Vector2d& point_px) {
  return Direction(line).dot(point_px - line.start);
}

double Overlap_px(const LineSegment& a, const LineSegment& b) {
  const double s = PlaceAlong_px(a, b.start), e = PlaceAlong_px(a, b.end);
  return std::min(a.Length(), std::max(s, e)) - std::max(0.0, std::min(s, e));
}

double LargestDistance_px(const LineSegment& a, const LineSegment& b) {
  const double s = PlaceAlong_px(a, b.start), e = PlaceAlong_px(a, b.end);
  const double ds = DistanceAcross_px(a, b.start), de = DistanceAcross_px(a, b.end);
  if (std::abs(e - s) < 1e-9) return std::max(std::abs(ds), std::abs(de));
  const auto distance_at = [&](double along) {
    const double clamped = std::clamp(along, std::min(s, e), std::max(s, e));
    return std::abs(ds + (de - ds) * (clamped - s) / (e - s));
  };
  const double low = std::clamp(std::min(s, e), 0.0, a.Length());
  const double high = std::clamp(std::max(s, e), 0.0, a.Length());
  return std::max(distance_at(low), distance_at(high));
}

namespace {

constexpr double kRefinementStep_px = 3;  // between profiles, along the segment
constexpr double kMinSupport = 0.6;       // share of profiles that agree with the line
constexpr double kMaxResidual_px = 1;     // of a profile that agrees

constexpr double kShadingMaxShift_px = 0.7;
constexpr size_t kMinProfiles = 4;

double At(const EdgeProfile& profile, int place) {
  return profile[static_cast<size_t>(place + kEdgeReach)];
}

// The slope on a side (-1 or 1), out of the reach of the blurred step. Where it changes there is
// another edge: then the smaller one.
double SlopeBeside(const EdgeProfile& profile, int side) {
  const double near = side * (At(profile, 3 * side) - At(profile, 2 * side));
  const double far = side * (At(profile, 4 * side) - At(profile, 3 * side));
  if (near * far <= 0) return 0;
  return std::abs(near) < std::abs(far) ? near : far;
}

// Between the slopes at some distance from the edge on both sides.
double SlopeDifference(const EdgeProfile& profile) {
  const double before = At(profile, -2) - At(profile, -4);
  const double behind = At(profile, 4) - At(profile, 2);
  return 0.5 * (behind - before);
}

}  // namespace

double ShadingShift_px(const std::vector<EdgeProfile>& profiles) {
  if (profiles.size() < kMinProfiles) return 0;
  const auto count = static_cast<double>(profiles.size());
  EdgeProfile mean{};
  double sum = 0, sum_squared = 0;
  for (const EdgeProfile& profile : profiles) {
    for (size_t i = 0; i < mean.size(); ++i) mean[i] += profile[i] / count;
    const double difference = SlopeDifference(profile);
    sum += difference;
    sum_squared += difference * difference;
  }
  const double before = SlopeBeside(mean, -1), behind = SlopeBeside(mean, 1);
  const double step = At(mean, 3) - At(mean, -3) - 3 * (before + behind);
  const double peak = 0.5 * (At(mean, 1) - At(mean, -1)) - 0.5 * (before + behind);
  if (step <= 0 || peak <= 0) return 0;
  // A step of h, blurred by sigma, rises by h / (sigma sqrt(2 pi)) at most.
  const double variance_px2 = step * step / (2 * std::numbers::pi * peak * peak);
  const double difference = behind - before;
  const double noise =
      (sum_squared - sum * sum / count) / (count * (count - 1));  // of the mean's, squared
  const double believed = std::max(0.0, 1 - noise / std::max(difference * difference, 1e-12));
  return std::clamp(believed * difference * variance_px2 / step, -kShadingMaxShift_px,
                    kShadingMaxShift_px);
}

namespace {

constexpr int kMaxProfiles = 60;
constexpr int kMaxReach = 12;
constexpr int kFits = 4;

// Where one profile has its edge.
struct ProfileEdge {
  double along_px = 0;
  double across_px = 0;
  double gradient = 0;
  bool agrees = true;
};

// across = offset + slope * along.
struct Fit {
  double offset_px = 0;
  double slope = 0;
  double At(double along_px) const { return offset_px + slope * along_px; }
};

bool Inside(const cv::Mat& image, double x, double y) {
  return x >= 0 && y >= 0 && x < image.cols - 1 && y < image.rows - 1;
}

double SampleAt(const cv::Mat& image, double x, double y) {
  const int u = static_cast<int>(x), v = static_cast<int>(y);
  const double a = x - u, b = y - v;
  const uchar* top = image.ptr<uchar>(v) + u;
  const uchar* bottom = image.ptr<uchar>(v + 1) + u;
  return (1 - b) * ((1 - a) * top[0] + a * top[1]) + b * ((1 - a) * bottom[0] + a * bottom[1]);
}

// The strongest rise of brightness towards `normal` within reach of `center`, by a parabola through
// the gradients; nothing at the end of the reach or the image.
std::optional<ProfileEdge> FindEdge(const cv::Mat& image, const Eigen::Vector2d& center,
                                    const Eigen::Vector2d& normal, int reach) {
  const Eigen::Vector2d low = center - (reach + 2) * normal, high = center + (reach + 2) * normal;
  if (!Inside(image, low.x(), low.y()) || !Inside(image, high.x(), high.y())) return std::nullopt;
  std::array<double, 2 * kMaxReach + 5> values;
  const int count = 2 * reach + 5;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector2d p = low + i * normal;
    values[i] = SampleAt(image, p.x(), p.y());
  }
  const auto gradient = [&](int i) { return 0.5 * (values[i + 1] - values[i - 1]); };
  int best = 2;
  for (int i = 2; i < count - 2; ++i) {
    if (gradient(i) > gradient(best)) best = i;
  }
  const double before = gradient(best - 1), peak = gradient(best), after = gradient(best + 1);
  const double curvature = before - 2 * peak + after;
  if (peak < before || peak < after || curvature >= 0) return std::nullopt;
  return ProfileEdge{0, best - (reach + 2) + 0.5 * (before - after) / curvature, peak, true};
}

// Least squares over the edges that agree.
std::optional<Fit> FitEdges(const std::vector<ProfileEdge>& edges) {
  double n = 0, t = 0, tt = 0, o = 0, to = 0;
  for (const auto& e : edges) {
    if (!e.agrees) continue;
    n += 1;
    t += e.along_px;
    tt += e.along_px * e.along_px;
    o += e.across_px;
    to += e.along_px * e.across_px;
  }
  const double determinant = n * tt - t * t;
  if (n < 4 || determinant < 1e-6) return std::nullopt;
  const double slope = (n * to - t * o) / determinant;
  return Fit{(o - slope * t) / n, slope};
}

// The line that most pairs of edges far apart agree on; starts the fit where outliers are many.
std::optional<Fit> FitByConsensus(const std::vector<ProfileEdge>& edges, double max_residual_px) {
  const int n = static_cast<int>(edges.size());
  std::optional<Fit> best;
  int most = 0;
  const int step = std::max(1, n / 12);
  for (int i = 0; i < n; i += step) {
    for (int j = i + std::max(2, n / 3); j < n; j += step) {
      const double slope =
          (edges[j].across_px - edges[i].across_px) / (edges[j].along_px - edges[i].along_px);
      const Fit fit{edges[i].across_px - slope * edges[i].along_px, slope};
      const int votes = static_cast<int>(std::count_if(edges.begin(), edges.end(), [&](auto& e) {
        return std::abs(e.across_px - fit.At(e.along_px)) < max_residual_px;
      }));
      if (votes > most) {
        most = votes;
        best = fit;
      }
    }
  }
  return best;
}

struct Agreement {
  int count = 0;
  double sum_squared = 0;
  double sum_gradient = 0;
  double first_px = 0, last_px = 0;
};

Agreement Agree(const Fit& fit, double max_residual_px, std::vector<ProfileEdge>* edges) {
  Agreement all;
  for (auto& e : *edges) {
    const double residual = e.across_px - fit.At(e.along_px);
    e.agrees = std::abs(residual) < max_residual_px;
    if (!e.agrees) continue;
    if (all.count == 0) all.first_px = e.along_px;
    all.last_px = e.along_px;
    ++all.count;
    all.sum_squared += residual * residual;
    all.sum_gradient += e.gradient;
  }
  return all;
}

std::vector<ProfileEdge> FindEdges(const cv::Mat& image, const LineSegment& segment, int reach,
                                   int profiles, double min_gradient) {
  const double length = segment.Length();
  const Eigen::Vector2d direction = Direction(segment), normal = Normal(segment);
  std::vector<ProfileEdge> edges;
  edges.reserve(profiles);
  for (int i = 0; i < profiles; ++i) {
    const double along = length * i / (profiles - 1);
    auto edge = FindEdge(image, segment.start + along * direction, normal, reach);
    if (!edge || edge->gradient < min_gradient) continue;
    edge->along_px = along;
    edges.push_back(*edge);
  }
  return edges;
}

// The profiles across a line that agree with it, from some place along it to another.
std::vector<EdgeProfile> ProfilesAcross(const cv::Mat& image, const LineSegment& segment,
                                        const Fit& fit, const std::vector<ProfileEdge>& edges,
                                        double from_px, double to_px) {
  const Eigen::Vector2d direction = Direction(segment), normal = Normal(segment);
  std::vector<EdgeProfile> profiles;
  for (const ProfileEdge& edge : edges) {
    if (!edge.agrees || edge.along_px < from_px || edge.along_px > to_px) continue;
    const Eigen::Vector2d center =
        segment.start + edge.along_px * direction + fit.At(edge.along_px) * normal;
    const Eigen::Vector2d low = center - kEdgeReach * normal, high = center + kEdgeReach * normal;
    if (!Inside(image, low.x(), low.y()) || !Inside(image, high.x(), high.y())) continue;
    EdgeProfile& profile = profiles.emplace_back();
    for (size_t i = 0; i < profile.size(); ++i) {
      const Eigen::Vector2d p = low + static_cast<double>(i) * normal;
      profile[i] = SampleAt(image, p.x(), p.y());
    }
  }
  return profiles;
}

// By how much the line is off the edge because of light that fades beside it: of both halves, since
// what recedes has it more at its far end.
Fit FitShading(const cv::Mat& image, const LineSegment& segment, const Fit& fit,
               const std::vector<ProfileEdge>& edges, const Agreement& agreement) {
  const double first_px = agreement.first_px, last_px = agreement.last_px;
  const double middle_px = 0.5 * (first_px + last_px);
  const double near_px =
      ShadingShift_px(ProfilesAcross(image, segment, fit, edges, first_px, middle_px));
  const double far_px =
      ShadingShift_px(ProfilesAcross(image, segment, fit, edges, middle_px, last_px));
  const double slope = (far_px - near_px) / std::max(middle_px - first_px, 1.0);
  return {0.5 * (near_px + far_px) - slope * middle_px, slope};
}

// The point beyond the segment's end up to which its edge goes on. side: 1 where the bright side is
// on the left of the segment, else -1.
Eigen::Vector2d Extend(const cv::Mat& image, const LineSegment& segment, int side,
                       double min_gradient, const LineRefinementOptions& options) {
  constexpr int kMaxMisses = 2;
  const Eigen::Vector2d direction = Direction(segment), normal = side * Normal(segment);
  Eigen::Vector2d end = segment.end;
  int misses = 0;
  for (double along = kRefinementStep_px; along <= options.max_extension_px && misses <= kMaxMisses;
       along += kRefinementStep_px) {
    const Eigen::Vector2d p = segment.end + along * direction;
    const auto edge = FindEdge(image, p, normal, 1);
    if (edge && edge->gradient >= min_gradient && std::abs(edge->across_px) < kMaxResidual_px) {
      end = p;
      misses = 0;
    } else {
      ++misses;
    }
  }
  return end;
}

}  // namespace

double MeanContrast(const cv::Mat& image, const LineSegment& segment) {
  const int samples = std::clamp(static_cast<int>(segment.Length() / 4), 3, 20);
  const Eigen::Vector2d normal = Normal(segment);
  double sum = 0;
  for (int i = 0; i < samples; ++i) {
    const Eigen::Vector2d p = segment.start + (i + 0.5) / samples * (segment.end - segment.start);
    const Eigen::Vector2d left = p + 1.5 * normal, right = p - 1.5 * normal;
    if (!Inside(image, left.x(), left.y()) || !Inside(image, right.x(), right.y())) continue;
    sum += SampleAt(image, left.x(), left.y()) - SampleAt(image, right.x(), right.y());
  }
  return sum / samples;
}

std::optional<RefinedSegment> RefineSegment(const cv::Mat& image, const LineSegment& segment,
                                            const LineRefinementOptions& options) {
  const int reach = std::clamp(static_cast<int>(std::ceil(options.reach_px)), 1, kMaxReach);
  const int profiles =
      std::clamp(static_cast<int>(segment.Length() / kRefinementStep_px) + 1, 6, kMaxProfiles);
  auto edges = FindEdges(image, segment, reach, profiles, options.min_gradient);
  std::optional<Fit> fit = FitByConsensus(edges, kMaxResidual_px);
  if (!fit) return std::nullopt;
  Agreement agreement = Agree(*fit, kMaxResidual_px, &edges);
  for (int i = 0; i < kFits; ++i) {
    fit = FitEdges(edges);
    if (!fit) return std::nullopt;
    agreement = Agree(*fit, i == 0 ? kMaxResidual_px : 0.5 * kMaxResidual_px, &edges);
  }
  RefinedSegment refined;
  refined.support = static_cast<double>(agreement.count) / profiles;
  if (agreement.count < 4 || refined.support < kMinSupport) return std::nullopt;
  refined.gradient = agreement.sum_gradient / agreement.count;
  refined.rms_px = std::sqrt(agreement.sum_squared / agreement.count);
  const Fit shading = FitShading(image, segment, *fit, edges, agreement);
  const auto at = [&](double along) -> Eigen::Vector2d {
    return segment.start + along * Direction(segment) +
           (fit->At(along) - shading.At(along)) * Normal(segment);
  };
  const LineSegment fitted{at(agreement.first_px), at(agreement.last_px)};
  const double weak = std::max(options.min_gradient, 0.4 * refined.gradient);
  refined.segment = {Extend(image, Reversed(fitted), -1, weak, options),
                     Extend(image, fitted, 1, weak, options)};
  return refined;
}

}  // namespace slcmap::odometry
