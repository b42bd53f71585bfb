#include "mapping/adjustment/agreement.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cstdint>

namespace slcmap {
namespace {

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

}  // namespace slcmap
