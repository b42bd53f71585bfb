#include "odometry/structure/manhattan_detector.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace slcmap::inline odometry {
namespace {

constexpr double kTiltSigma_rad = 0.003;     // of the camera's poses against the vertical
constexpr double kFullWeight_px = 200;       // a longer segment counts as this long
constexpr double kMinVerticalSigmas = 4;     // closer to the vertical than this it may be vertical
constexpr double kMaxVoteSigma_rad = 0.035;  // of the heading that a segment says
// The search.
constexpr int kMemoryImages = 30;            // keyframes whose votes are taken together
constexpr double kSearchStep_rad = 0.002;    // of the histogram
constexpr double kSearchSigma_rad = 0.004;   // added to that of a vote
constexpr double kMinSeparation_rad = 0.04;  // between headings
// Closer to a heading, what is next to it are flanks of its own.
constexpr double kRunnerUpSeparation_rad = 0.14;
constexpr double kMinImageShare = 0.4;      // of the segments that vote, by length
constexpr double kMinOverheadShare = 0.05;  // above the camera; less is nearly all below
constexpr double kMaxRunnerUp = 0.6;        // share of the next best heading over its own
constexpr double kMinOneAxisShare = 0.75;
constexpr double kMinSpread = 0.45;  // 0: lines all to one side, 1: all around
constexpr int kMinImagesOneAxis = 25;
constexpr double kMaxRunnerUpOneAxis = 0.3;

// What detectors and lenses leave uncorrected, however long the segment is.
constexpr double kDirectionSigma_rad = 0.004;  // of the building's directions in the camera
constexpr double kSystematicSigma_rad = 0.001;

}  // namespace

InterpretationPlane InterpretationPlane::Rotated(const Eigen::Matrix3d& R_other_this) const {
  InterpretationPlane out = *this;
  out.middle = R_other_this * middle;
  out.along = R_other_this * along;
  out.normal = R_other_this * normal;
  return out;
}

InterpretationPlane PlaneOfSegment(const LineSegment& segment, double end_sigma) {
  const Eigen::Vector3d start = segment.start.homogeneous().normalized();
  const Eigen::Vector3d end = segment.end.homogeneous().normalized();
  InterpretationPlane plane;
  plane.middle = (start + end).normalized();
  plane.along = (end - start).normalized();
  plane.normal = plane.middle.cross(plane.along);
  plane.length_rad = std::atan2(start.cross(end).norm(), start.dot(end));
  // Seen from the camera, a length on the plane z = 1 shrinks by at most cos^2 of the angle to the
  // optical axis, along the radius; an end's error shrinks with the segment.
  const double shrink = plane.length_rad / std::max(segment.Length(), 1e-12);
  const double ends_rad = std::sqrt(2.0) * end_sigma * shrink / std::max(plane.length_rad, 1e-12);
  plane.sigma_rad = std::hypot(ends_rad, kSystematicSigma_rad);
  return plane;
}

VanishingAngle AngleToVanishingPoint(const InterpretationPlane& plane,
                                     const Eigen::Vector3d& direction, double direction_sigma_rad) {
  const double across = direction.dot(plane.normal);
  const double along = direction.dot(plane.along);
  // Seen from the segment, the vanishing point is so far away; an error of the direction turns the
  // ray to it by the error over this distance.
  const double distance = std::max(std::hypot(across, along), 1e-9);
  return {std::atan2(std::abs(across), std::abs(along)),
          std::hypot(plane.sigma_rad, direction_sigma_rad / distance)};
}

namespace {

using Vote = ManhattanDetector::Vote;
constexpr double kQuarterTurn_rad = std::numbers::pi / 2;

// The remainder of an angle in [-period / 2, period / 2).
double Wrap(double angle_rad, double period_rad) {
  return angle_rad - period_rad * std::floor(angle_rad / period_rad + 0.5);
}

// Nothing for what could be vertical, for planes so level that their lines could have any heading,
// and for short segments.
std::optional<Vote> MakeVote(const ManhattanOptions& options, const InterpretationPlane& plane,
                             double length_px) {
  if (length_px < options.min_length_px) return std::nullopt;
  const VanishingAngle to_vertical =
      AngleToVanishingPoint(plane, Eigen::Vector3d::UnitZ(), kTiltSigma_rad);
  if (to_vertical.angle_rad < kMinVerticalSigmas * to_vertical.sigma_rad) {
    return std::nullopt;
  }
  const Eigen::Vector3d& n = plane.normal;
  const double horizontal = std::max(n.head<2>().norm(), 1e-9);
  const Eigen::Vector3d d = Eigen::Vector3d(-n.y(), n.x(), 0) / horizontal;
  // A turn of the plane about `middle` moves the normal along `along`; a tilt of the world moves it
  // along the heading by as much as the plane is level.
  const double turn_rad = plane.sigma_rad * std::abs(plane.along.dot(d)) / horizontal;
  const double tilt_rad = kTiltSigma_rad * std::abs(n.z()) / horizontal;
  Vote vote;
  vote.plane = plane;
  vote.sigma_rad = std::hypot(turn_rad, tilt_rad);
  if (vote.sigma_rad > kMaxVoteSigma_rad) return std::nullopt;
  vote.heading_rad =
      Wrap(std::atan2(d.y(), d.x()) - kQuarterTurn_rad, 2 * kQuarterTurn_rad) + kQuarterTurn_rad;
  vote.weight_px = std::min(length_px, kFullWeight_px);
  vote.pencil_rad = std::atan2(horizontal, n.z());
  vote.above = plane.middle.z() > 0;
  return vote;
}

// How much of a vote a heading gets (Tukey's biweight), for the angle between them in units of the
// vote's sigma.
double Kernel(double sigmas, double max_sigmas) {
  const double u = sigmas / max_sigmas;
  const double v = std::max(0.0, 1 - u * u);
  return v * v;
}

double SigmasApart(const Vote& vote, double heading_rad) {
  return std::abs(Wrap(vote.heading_rad - heading_rad, kQuarterTurn_rad)) /
         std::hypot(vote.sigma_rad, kSearchSigma_rad);
}

using Images = std::vector<std::vector<Vote>>;

struct Neighbourhood {
  double heading_rad, reach_rad;
};

// The weight of all votes by headings in steps of a quarter turn.
class HeadingHistogram {
 public:
  HeadingHistogram(const Images& images)
      : bins_(static_cast<size_t>(std::ceil(kQuarterTurn_rad / kSearchStep_rad)), 0.0) {
    for (const auto& votes : images) {
      for (const Vote& vote : votes) Add(vote);
    }
  }

  double GetHeading(size_t bin) const {
    return kQuarterTurn_rad * static_cast<double>(bin) / static_cast<double>(bins_.size());
  }
  double weight(size_t bin) const { return bins_[bin]; }

  // The heaviest bin that is not in the neighbourhood of some headings; nothing where all is empty.
  std::optional<size_t> Heaviest(const std::vector<Neighbourhood>& away_from) const {
    std::optional<size_t> best;
    for (size_t bin = 0; bin < bins_.size(); ++bin) {
      if (bins_[bin] <= (best ? bins_[*best] : 0)) continue;
      const double heading_rad = GetHeading(bin);
      const bool near = std::ranges::any_of(away_from, [&](const Neighbourhood& other) {
        return std::abs(Wrap(heading_rad - other.heading_rad, kQuarterTurn_rad)) < other.reach_rad;
      });
      if (!near) best = bin;
    }
    return best;
  }

 private:
  void Add(const Vote& vote) {
    const double step_rad = kQuarterTurn_rad / static_cast<double>(bins_.size());
    const double sigma_rad = std::hypot(vote.sigma_rad, kSearchSigma_rad);
    const int reach = static_cast<int>(kMaxSigmasToDirection * sigma_rad / step_rad) + 1;
    const int centre = static_cast<int>(std::floor(vote.heading_rad / step_rad));
    const int count = static_cast<int>(bins_.size());
    for (int i = centre - reach; i <= centre + reach; ++i) {
      const double sigmas = std::abs(i * step_rad - vote.heading_rad) / sigma_rad;
      bins_[((i % count) + count) % count] +=
          vote.weight_px * Kernel(sigmas, kMaxSigmasToDirection);
    }
  }

  std::vector<double> bins_;
};

// Least squares over the votes for a heading, reweighted; returns the standard deviation too. The
// votes have to come within less than in the search, or objects that stand nearly along the
// building turn it.
std::pair<double, double> Refine(const Images& images, double heading_rad) {
  double information = 0;
  for (double narrowing = 1; narrowing > 0.3; narrowing *= 0.85) {
    double sum = 0;
    information = 0;
    for (const auto& votes : images) {
      for (const Vote& vote : votes) {
        const double apart_rad = Wrap(vote.heading_rad - heading_rad, kQuarterTurn_rad);
        const double sigma_rad = std::hypot(vote.sigma_rad, kSearchSigma_rad);
        const double w = Kernel(apart_rad / (narrowing * sigma_rad), kMaxSigmasToDirection) /
                         (sigma_rad * sigma_rad);
        sum += w * apart_rad;
        information += w;
      }
    }
    if (information > 0) heading_rad += sum / information;
  }
  // The images show the same lines, and share the error of the tilt: they do not average out.
  const double variance = static_cast<double>(images.size()) / std::max(information, 1e-9);
  return {Wrap(heading_rad, kQuarterTurn_rad), std::sqrt(variance)};
}

// What follows a heading, summed over images; index 0: its axis X, 1: Y.
struct Support {
  double weight_px[2] = {0, 0};
  Eigen::Vector2d pencil[2] = {Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()};
  double above_px = 0;
  double length_px() const { return weight_px[0] + weight_px[1]; }

  void Add(const Vote& vote, double heading_rad, double weight) {
    const double from_x_rad = Wrap(vote.heading_rad - heading_rad, 2 * kQuarterTurn_rad);
    const int axis = std::abs(from_x_rad) < 0.5 * kQuarterTurn_rad ? 0 : 1;
    weight_px[axis] += weight;
    if (vote.above) above_px += weight;
    // Planes repeat after half a turn: mean of the doubled angles.
    pencil[axis] +=
        weight * Eigen::Vector2d(std::cos(2 * vote.pencil_rad), std::sin(2 * vote.pencil_rad));
  }
  double Spread() const {
    return length_px() > 0 ? 1 - (pencil[0].norm() + pencil[1].norm()) / length_px() : 0;
  }
};

HeadingEvidence Weigh(const Images& images, double heading_rad) {
  HeadingEvidence evidence;
  Support support;
  double all_px = 0;
  for (const auto& votes : images) {
    const double before_px = support.length_px();
    double image_px = 0;
    for (const Vote& vote : votes) {
      image_px += vote.weight_px;
      const bool follows = SigmasApart(vote, heading_rad) < kMaxSigmasToDirection;
      if (follows) support.Add(vote, heading_rad, vote.weight_px);
    }
    const double share = (support.length_px() - before_px) / std::max(image_px, 1e-9);
    if (share >= kMinImageShare) ++evidence.images;
    all_px += image_px;
  }
  evidence.heading_rad = heading_rad;
  evidence.share = support.length_px() / std::max(all_px, 1e-9);
  evidence.minor_share =
      std::min(support.weight_px[0], support.weight_px[1]) / std::max(all_px, 1e-9);
  evidence.spread = support.Spread();
  evidence.overhead_share = support.above_px / std::max(support.length_px(), 1e-9);
  evidence.mean_length_px = support.length_px() / static_cast<double>(images.size());
  return evidence;
}

}  // namespace

ManhattanDetector::ManhattanDetector(const ManhattanOptions& options, double focal_px)
    : options_(options), end_sigma_(kAloneEndSigma_px / focal_px), focal_px_(focal_px) {}

std::vector<HeadingEvidence> ManhattanDetector::AddImage(const std::vector<LineSegment>& segments,
                                                         const Eigen::Matrix3d& R_world_camera) {
  std::vector<Vote> votes;
  for (const LineSegment& segment : segments) {
    const InterpretationPlane plane = PlaneOfSegment(segment, end_sigma_).Rotated(R_world_camera);
    const auto vote = MakeVote(options_, plane, segment.Length() * focal_px_);
    if (vote) votes.push_back(*vote);
  }
  images_.push_back(std::move(votes));
  if (static_cast<int>(images_.size()) > kMemoryImages) images_.pop_front();

  std::vector<HeadingEvidence> found;
  const auto best = Best();
  if (best && IsCertain(*best)) {
    known_headings_rad_.push_back(best->heading_rad);
    found.push_back(*best);
  }
  return found;
}

void ManhattanDetector::SetKnownHeadings(const std::vector<double>& headings_rad) {
  known_headings_rad_ = headings_rad;
}

bool ManhattanDetector::IsKnown(const Vote& vote) const {
  const auto has_heading = [&](double heading_rad) {
    return SigmasApart(vote, heading_rad) < kMaxSigmasToDirection;
  };
  const auto runs_along = [&](const Eigen::Vector3d& slope) {
    const VanishingAngle v = AngleToVanishingPoint(vote.plane, slope, kTiltSigma_rad);
    return v.angle_rad < kMaxSigmasToDirection * v.sigma_rad;
  };
  return std::ranges::any_of(known_headings_rad_, has_heading) ||
         std::ranges::any_of(known_slopes_world_, runs_along);
}

std::optional<HeadingEvidence> ManhattanDetector::Best() const {
  Images unexplained;
  for (const auto& votes : images_) {
    auto& left_over = unexplained.emplace_back();
    for (const Vote& vote : votes) {
      if (!IsKnown(vote)) left_over.push_back(vote);
    }
  }
  const HeadingHistogram histogram(unexplained);
  std::vector<Neighbourhood> others;
  for (const double known_rad : known_headings_rad_) {
    others.push_back({known_rad, kMinSeparation_rad});
  }
  const auto bin = histogram.Heaviest(others);
  if (!bin) return std::nullopt;
  const auto [heading_rad, sigma_rad] = Refine(unexplained, histogram.GetHeading(*bin));
  HeadingEvidence evidence = Weigh(unexplained, heading_rad);
  evidence.sigma_rad = std::hypot(sigma_rad, kTiltSigma_rad);
  others.push_back({heading_rad, kRunnerUpSeparation_rad});
  const auto runner_up = histogram.Heaviest(others);
  if (runner_up) {
    evidence.runner_up_share =
        evidence.share * histogram.weight(*runner_up) / histogram.weight(*bin);
  }
  return evidence;
}

bool ManhattanDetector::IsCertain(const HeadingEvidence& e) const {
  const bool overhead = e.overhead_share >= kMinOverheadShare;
  if (e.images < (overhead ? options_.min_images : options_.min_images_below) ||
      e.mean_length_px < options_.min_mean_length_px) {
    return false;
  }
  if (e.runner_up_share > kMaxRunnerUp * e.share) return false;
  const bool both_axes = e.share >= options_.min_share && e.minor_share >= options_.min_minor_share;
  const bool all_around = e.share >= kMinOneAxisShare && e.spread >= kMinSpread;
  const bool lasting = known_headings_rad_.empty() && overhead && e.images >= kMinImagesOneAxis &&
                       e.share >= options_.min_share &&
                       e.runner_up_share <= kMaxRunnerUpOneAxis * e.share;
  return both_axes || all_around || lasting;
}

void ManhattanDetector::Reset() {
  images_.clear();
  known_headings_rad_.clear();
  known_slopes_world_.clear();
}

std::vector<StructuralDirection> StructuralDirections(
    const std::vector<std::optional<double>>& headings_rad) {
  std::vector<StructuralDirection> out = {{{LineAxis::kVertical, -1}, Eigen::Vector3d::UnitZ()}};
  for (size_t i = 0; i < headings_rad.size(); ++i) {
    if (!headings_rad[i]) continue;
    const double c = std::cos(*headings_rad[i]), s = std::sin(*headings_rad[i]);
    out.push_back({{LineAxis::kX, static_cast<int>(i)}, {c, s, 0}});
    out.push_back({{LineAxis::kY, static_cast<int>(i)}, {-s, c, 0}});
  }
  return out;
}

std::optional<LineClass> LineClassifier::Classify(
    const LineSegment& segment, const Eigen::Matrix3d& R_world_camera,
    const std::vector<std::optional<double>>& headings_rad) const {
  const InterpretationPlane plane = PlaneOfSegment(segment, end_sigma_).Rotated(R_world_camera);
  std::optional<LineClass> best;
  double best_sigmas = std::numeric_limits<double>::infinity();
  int possible = 0;
  for (const StructuralDirection& direction : StructuralDirections(headings_rad)) {
    const VanishingAngle v = AngleToVanishingPoint(plane, direction.d_world, kDirectionSigma_rad);
    const double sigmas = v.angle_rad / v.sigma_rad;
    if (sigmas < kMinSigmasToOthers) ++possible;
    if (sigmas > kMaxSigmasToDirection || v.angle_rad > kMaxAngleToDirection_rad) continue;
    if (sigmas >= best_sigmas) continue;
    best = direction.line_class;
    best_sigmas = sigmas;
  }
  return possible == 1 ? best : std::nullopt;
}

}  // namespace slcmap::odometry
