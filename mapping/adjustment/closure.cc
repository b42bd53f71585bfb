#include "mapping/adjustment/closure.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cstdint>
#include <optional>
#include <ranges>
#include <set>

#include "odometry/geometry/lines.h"

namespace slcmap::inline mapping {
namespace {

constexpr double kGate_m_per_m = 0.0006;
constexpr double kGate_rad = 0.002;
constexpr double kGate_rad_per_m = 0.0001;
constexpr double kMinLead = 1.5;  // of its votes over those of any other shift, further off than
constexpr double kEdgeTolerance_m = 0.01;  // of an edge from where the shift has it

constexpr int kPairs = 400;
constexpr int kRefinements = 3;
constexpr double kGateSigmas = 3;

// Numbers that look random and are the same everywhere.
class Sequence {
 public:
  size_t Below(size_t count) {
    state_ = state_ * 6364136223846793005u + 1442695040888963407u;  // Knuth's MMIX
    return static_cast<size_t>(state_ >> 33) % count;
  }

 private:
  uint64_t state_ = 1;
};

// Least squares of the shift, with what is known of it beforehand.
class ShiftFit {
 public:
  explicit ShiftFit(const ShiftSigma& sigma) {
    const double per_m2 = 1 / (sigma.position_m * sigma.position_m);
    information_.diagonal() << per_m2, per_m2, per_m2, 1 / (sigma.yaw_rad * sigma.yaw_rad);
  }
  void Add(const ShiftVote& vote, int alternative) {
    information_ += vote.by_shift.transpose() * vote.by_shift;
    sum_ += vote.by_shift.transpose() * vote.alternatives[static_cast<size_t>(alternative)];
  }
  Shift Solve() const { return information_.ldlt().solve(sum_); }

 private:
  Eigen::Matrix4d information_ = Eigen::Matrix4d::Zero();
  Eigen::Vector4d sum_ = Eigen::Vector4d::Zero();
};

bool IsWithin(const Shift& shift, const ShiftSigma& sigma) {
  return shift.head<3>().norm() <= kGateSigmas * sigma.position_m &&
         std::abs(shift[3]) <= kGateSigmas * sigma.yaw_rad;
}

Agreement Count(const std::vector<ShiftVote>& votes, const Shift& shift) {
  Agreement out;
  out.shift = shift;
  for (const ShiftVote& vote : votes) {
    const Eigen::Vector2d expected = vote.by_shift * shift;
    int best = -1;
    double nearest = 1;
    for (int i = 0; i < std::ssize(vote.alternatives); ++i) {
      const double off = (vote.alternatives[static_cast<size_t>(i)] - expected).norm();
      if (off < nearest) {
        nearest = off;
        best = i;
      }
    }
    out.chosen.push_back(best);
    out.votes += best >= 0;
  }
  return out;
}

Agreement Refine(const std::vector<ShiftVote>& votes, const ShiftSigma& sigma, Agreement found) {
  for (int i = 0; i < kRefinements; ++i) {
    ShiftFit fit(sigma);
    for (size_t k = 0; k < votes.size(); ++k) {
      if (found.chosen[k] >= 0) fit.Add(votes[k], found.chosen[k]);
    }
    found = Count(votes, fit.Solve());
  }
  return found;
}

// What a pair of votes and the votes that fit it say.
Agreement FromPair(const std::vector<ShiftVote>& votes, const ShiftSigma& sigma,
                   Sequence* sequence) {
  ShiftFit fit(sigma);
  for (int i = 0; i < 2; ++i) {
    const ShiftVote& vote = votes[sequence->Below(votes.size())];
    if (vote.alternatives.empty()) return {};
    fit.Add(vote, static_cast<int>(sequence->Below(vote.alternatives.size())));
  }
  return Refine(votes, sigma, Count(votes, fit.Solve()));
}

}  // namespace

Agreement FindAgreement(const std::vector<ShiftVote>& votes, const ShiftSigma& sigma,
                        double min_displacement_m) {
  Agreement best;
  if (votes.empty()) return best;
  std::vector<Agreement> found;
  Sequence sequence;
  for (int i = 0; i < kPairs; ++i) {
    Agreement next = FromPair(votes, sigma, &sequence);
    if (next.votes == 0 || !IsWithin(next.shift, sigma)) continue;
    if (next.votes > best.votes) best = next;
    next.chosen.clear();
    found.push_back(std::move(next));
  }
  for (const Agreement& other : found) {
    if ((other.shift - best.shift).head<3>().norm() < min_displacement_m) continue;
    best.runner_up = std::max(best.runner_up, other.votes);
  }
  return best;
}

namespace {

constexpr double kEdgeGateSigmas = 3;

}  // namespace

std::vector<double> PathLengths(const AdjustmentState& state) {
  std::vector<double> lengths;
  for (size_t k = 0; k < state.frames.size(); ++k) {
    const bool goes_on =
        k > 0 && state.frames[k].keyframe->segment == state.frames[k - 1].keyframe->segment;
    const double step_m = goes_on ? (PoseFromBlock(state.frames[k].pose).translation -
                                     PoseFromBlock(state.frames[k - 1].pose).translation)
                                        .norm()
                                  : 0;
    lengths.push_back(goes_on ? lengths.back() + step_m : 0);
  }
  return lengths;
}

ShiftSigma SigmaOver(double path_m, const ClosureOptions& options) {
  return {(options.gate_m + kGate_m_per_m * path_m) / kEdgeGateSigmas,
          (kGate_rad + kGate_rad_per_m * path_m) / kEdgeGateSigmas};
}

bool IsUnique(const Agreement& agreement, int min_votes) {
  return agreement.votes >= min_votes && agreement.votes >= kMinLead * agreement.runner_up;
}

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kPlace_m = 4;         // of path, along which lines that appear are one later visit
constexpr double kTiedToFirst_m = 30;  // of path, between places that are tied to their first visit
constexpr double kMaxGap_m = 0.5;      // along an edge, between what the visits saw of it

// A line that may be an edge of an earlier visit.
struct Candidate {
  size_t newer = 0;
  std::vector<size_t> older;
  ShiftVote vote;
};

// A line with what the search needs of it.
struct SeenLine {
  size_t index = 0;  // of the state
  size_t first_frame = 0, last_frame = 0;
  PointAndDirection in_world;
  Vector3d middle_world;
  double half_length_m = 0;
};

SeenLine Describe(const AdjustmentState& state, size_t index) {
  const AdjustedLine& line = state.lines[index];
  SeenLine out;
  out.index = index;
  out.first_frame = line.observations.front().frame;
  out.last_frame = line.observations.back().frame;
  out.in_world = line.InWorld();
  out.middle_world = NearestOn(out.in_world, 0.5 * (line.line->start_world + line.line->end_world));
  out.half_length_m = 0.5 * (line.line->end_world - line.line->start_world).norm();
  return out;
}

class EdgeSearch {
 public:
  EdgeSearch(const AdjustmentState& state, const ClosureOptions& options)
      : state_(state), options_(options), path_m_(PathLengths(state)) {
    for (size_t i = 0; i < state.lines.size(); ++i) {
      const AdjustedLine& line = state.lines[i];
      const bool has_axis = line.axis != LineAxis::kNone && line.axis != LineAxis::kSloped;
      if (!line.observations.empty() && has_axis) lines_.push_back(Describe(state, i));
    }
    std::ranges::stable_sort(lines_, {}, &SeenLine::first_frame);
  }

  std::vector<Closure> Find() const {
    std::vector<Closure> closures;
    double tied_to_first_m = -kTiedToFirst_m;  // of the path
    for (size_t from = 0; from < lines_.size();) {
      size_t to = from;
      while (to < lines_.size() && IsOnePlace(lines_[from], lines_[to])) ++to;
      AddClosures(from, to, &tied_to_first_m, &closures);
      from = to;
    }
    return closures;
  }

 private:
  const Keyframe& GetKeyframe(size_t frame) const { return *state_.frames[frame].keyframe; }

  bool IsOnePlace(const SeenLine& a, const SeenLine& b) const {
    return GetKeyframe(a.first_frame).segment == GetKeyframe(b.first_frame).segment &&
           path_m_[b.first_frame] - path_m_[a.first_frame] < kPlace_m;
  }

  bool IsEarlierVisit(const SeenLine& older, const SeenLine& newer) const {
    const Keyframe &a = GetKeyframe(older.last_frame), &b = GetKeyframe(newer.first_frame);
    return a.segment == b.segment && ToSeconds(b.stamp_ns - a.stamp_ns) > options_.min_interval_s &&
           path_m_[newer.first_frame] - path_m_[older.last_frame] > options_.min_path_m;
  }

  // Where they are along each other, and across within the gate.
  bool MayBeOneEdge(const SeenLine& older, const SeenLine& newer) const {
    const AdjustedLine &a = state_.lines[older.index], &b = state_.lines[newer.index];
    if (a.axis != b.axis || a.heading != b.heading || a.exact != b.exact) return false;
    if (!IsEarlierVisit(older, newer)) return false;
    const double along_m =
        std::abs(older.in_world.direction_world.dot(newer.middle_world - older.middle_world));
    if (along_m > older.half_length_m + newer.half_length_m + kMaxGap_m) return false;
    const double path_m = path_m_[newer.last_frame] - path_m_[older.last_frame];
    return ComputeOffset(older, newer).norm() < 3 * SigmaOver(path_m, options_).position_m;
  }

  Matrix32d ComputeAcross(const SeenLine& line) const {
    const AdjustedLine& adjusted = state_.lines[line.index];
    return AxesAcross(adjusted.axis, adjusted.heading ? *adjusted.heading : 0);
  }

  Vector2d ComputeOffset(const SeenLine& older, const SeenLine& newer) const {
    return ComputeAcross(newer).transpose() *
           (NearestOn(older.in_world, newer.middle_world) - newer.middle_world);
  }

  // The lines that may be edges of what appears from `from` to `to`, by visit: odometry drifts
  // between visits, so that each of several earlier ones has a shift of its own, and together none
  // would stand out.
  std::vector<std::vector<size_t>> EarlierVisits(size_t from, size_t to) const {
    std::vector<size_t> older;
    for (size_t o = 0; o < from; ++o) {
      const bool may_be =
          std::any_of(lines_.begin() + from, lines_.begin() + to,
                      [&](const SeenLine& newer) { return MayBeOneEdge(lines_[o], newer); });
      if (may_be) older.push_back(o);
    }
    std::vector<std::vector<size_t>> visits;
    double until_m = 0;  // of the path, the last visit so far
    for (const size_t o : older) {
      if (visits.empty() || path_m_[lines_[o].first_frame] - until_m > options_.min_path_m) {
        visits.emplace_back();
      }
      until_m = std::max(visits.back().empty() ? 0 : until_m, path_m_[lines_[o].last_frame]);
      visits.back().push_back(o);
    }
    return visits;
  }

  std::vector<Candidate> ListCandidates(size_t from, size_t to,
                                        const std::vector<size_t>& visit) const {
    std::vector<Candidate> candidates;
    const Vector3d place_world =
        PoseFromBlock(state_.frames[lines_[from].first_frame].pose).translation;
    for (size_t n = from; n < to; ++n) {
      const SeenLine& newer = lines_[n];
      Candidate candidate;
      candidate.newer = n;
      for (const size_t o : visit) {
        if (!MayBeOneEdge(lines_[o], newer)) continue;
        candidate.older.push_back(o);
        candidate.vote.alternatives.emplace_back(ComputeOffset(lines_[o], newer) /
                                                 kEdgeTolerance_m);
      }
      if (candidate.older.empty()) continue;
      Eigen::Matrix<double, 3, 4> moved;
      moved << Eigen::Matrix3d::Identity(),
          Vector3d::UnitZ().cross(newer.middle_world - place_world);
      candidate.vote.by_shift = ComputeAcross(newer).transpose() * moved / kEdgeTolerance_m;
      candidates.push_back(std::move(candidate));
    }
    return candidates;
  }

  // With the latest visit that is recognised, and now and then with the first one: what ties a
  // visit to the one before ties it to all, but only far ties show a drift of many rounds within
  // the solver's steps. More of them make the system slow to solve.
  void AddClosures(size_t from, size_t to, double* tied_to_first_m,
                   std::vector<Closure>* closures) const {
    const std::vector<std::vector<size_t>> visits = EarlierVisits(from, to);
    const auto latest = Recognised(from, to, visits | std::views::reverse);
    if (!latest) return;
    closures->push_back(*latest);
    const double here_m = path_m_[lines_[from].first_frame];
    if (here_m - *tied_to_first_m < kTiedToFirst_m) return;
    const auto first = Recognised(from, to, visits);
    if (first->older_frame == latest->older_frame) return;
    closures->push_back(*first);
    *tied_to_first_m = here_m;
  }

  template <typename Visits>
  std::optional<Closure> Recognised(size_t from, size_t to, const Visits& in_order) const {
    for (const std::vector<size_t>& visit : in_order) {
      auto closure = ClosureWith(ListCandidates(from, to, visit));
      if (closure) return closure;
    }
    return std::nullopt;
  }

  std::optional<Closure> ClosureWith(const std::vector<Candidate>& candidates) const {
    if (std::ssize(candidates) < options_.min_edges) return std::nullopt;
    std::vector<ShiftVote> votes;
    double path_m = 0;
    for (const Candidate& candidate : candidates) {
      votes.push_back(candidate.vote);
      for (const size_t o : candidate.older) {
        path_m = std::max(
            path_m, path_m_[lines_[candidate.newer].first_frame] - path_m_[lines_[o].last_frame]);
      }
    }
    const Agreement agreement =
        FindAgreement(votes, SigmaOver(path_m, options_), kClosureMinDisplacement_m);
    if (!IsUnique(agreement, options_.min_edges)) return std::nullopt;
    Closure closure = MakeClosure(candidates, agreement);
    return IsWellSeen(closure) ? std::optional(std::move(closure)) : std::nullopt;
  }

  Closure MakeClosure(const std::vector<Candidate>& candidates, const Agreement& agreement) const {
    Closure closure;
    closure.shift = agreement.shift;
    for (size_t i = 0; i < candidates.size(); ++i) {
      if (agreement.chosen[i] < 0) continue;
      const SeenLine& newer = lines_[candidates[i].newer];
      const SeenLine& older = lines_[candidates[i].older[static_cast<size_t>(agreement.chosen[i])]];
      closure.edges.push_back({older.index, newer.index});
      closure.older_frame = std::max(closure.older_frame, older.last_frame);
      closure.newer_frame = std::max(closure.newer_frame, newer.first_frame);
    }
    return closure;
  }

  // Along two axes, from several keyframes.
  bool IsWellSeen(const Closure& closure) const {
    std::set<LineAxis> axes;
    std::set<size_t> frames;
    for (const EdgeMatch& match : closure.edges) {
      axes.insert(state_.lines[match.newer].axis);
      for (const AdjustedLineObservation& observation : state_.lines[match.newer].observations) {
        frames.insert(observation.frame);
      }
    }
    return axes.size() >= 2 && std::ssize(frames) >= kClosureMinKeyframes;
  }

  const AdjustmentState& state_;
  const ClosureOptions& options_;
  std::vector<double> path_m_;
  std::vector<SeenLine> lines_;  // by the keyframe that saw them first
};

}  // namespace

std::vector<Closure> FindEdgeClosures(const AdjustmentState& state, const ClosureOptions& options) {
  return EdgeSearch(state, options).Find();
}

}  // namespace slcmap::mapping
