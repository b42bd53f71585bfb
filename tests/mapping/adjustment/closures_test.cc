#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>
#include <set>

#include "mapping/adjustment/adjustment_state.h"
#include "mapping/adjustment/closure.h"
#include "tests/testing/forward_rig.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;

constexpr double kTolerance_m = 0.01;
const Shift kShift(0.03, -0.02, 0.01, 0.004);
const ShiftSigma kSigma{0.03, 0.01};

// A corner of the building seen again, of which one direction is not told, and where it is.
ShiftVote VoteAt(const Eigen::Vector3d& place, int untold, const Shift& shift,
                 std::mt19937* generator) {
  Eigen::Matrix<double, 3, 4> moved;
  moved << Eigen::Matrix3d::Identity(), Eigen::Vector3d::UnitZ().cross(place);
  ShiftVote vote;
  vote.by_shift << moved.row((untold + 1) % 3), moved.row((untold + 2) % 3);
  vote.by_shift /= kTolerance_m;
  std::normal_distribution<double> noise(0, 0.1);
  vote.alternatives = {vote.by_shift * shift +
                       Eigen::Vector2d(noise(*generator), noise(*generator))};
  return vote;
}

// So many right votes, and so many that say anything within the gate.
std::vector<ShiftVote> Votes(int right, int wrong) {
  std::mt19937 generator(1);
  std::uniform_real_distribution<double> place(-3, 3), anything(-0.08, 0.08);
  std::vector<ShiftVote> votes;
  for (int i = 0; i < right + wrong; ++i) {
    const Eigen::Vector3d at(place(generator), place(generator), place(generator));
    const Shift shift =
        i < right ? kShift
                  : Shift(anything(generator), anything(generator), anything(generator), 0);
    votes.push_back(VoteAt(at, i % 3, shift, &generator));
  }
  return votes;
}

TEST(Agreement, IsFoundAmongAsManyWrongMatches) {
  const Agreement agreement = FindAgreement(Votes(20, 20), kSigma, 0.025);
  EXPECT_LT((agreement.shift - kShift).head<3>().norm(), 0.005);
  EXPECT_NEAR(agreement.shift[3], kShift[3], 0.002);
  EXPECT_GE(agreement.votes, 19);
  EXPECT_LT(1.5 * agreement.runner_up, agreement.votes);
  for (size_t i = 0; i < 19; ++i) EXPECT_EQ(agreement.chosen[i], 0);
}

TEST(Agreement, WrongMatchesAloneDoNotAgree) {
  const Agreement agreement = FindAgreement(Votes(0, 40), kSigma, 0.025);
  EXPECT_LT(agreement.votes, 20);
}

// Doors one period apart: half of what is seen fits one shift, half another.
TEST(Agreement, ASecondShiftIsToldOf) {
  std::vector<ShiftVote> votes = Votes(20, 0);
  for (ShiftVote& vote : votes) {
    vote.alternatives.push_back(vote.alternatives[0] + vote.by_shift * Shift(-0.06, 0, 0, 0));
  }
  const Agreement agreement = FindAgreement(votes, kSigma, 0.025);
  EXPECT_GE(agreement.votes, 19);
  EXPECT_GE(agreement.runner_up, 19);
}

// All along a corridor: nothing tells how far along it, which is then taken to be zero.
TEST(Agreement, WhatIsNotToldStaysZero) {
  std::mt19937 generator(2);
  std::vector<ShiftVote> votes;
  for (int i = 0; i < 20; ++i) {
    votes.push_back(VoteAt({0, 0.1 * i, 0}, 0, Shift(0, 0.02, 0.01, 0), &generator));
  }
  const Agreement agreement = FindAgreement(votes, kSigma, 0.025);
  EXPECT_LT((agreement.shift - Shift(0, 0.02, 0.01, 0)).head<3>().norm(), 0.003);
  EXPECT_EQ(agreement.runner_up, 0);
}

TEST(Agreement, BeyondTheGateNothingIsFound) {
  std::mt19937 generator(3);
  std::vector<ShiftVote> votes;
  for (int i = 0; i < 30; ++i) {
    votes.push_back(VoteAt({0.2 * i, 1, 2}, i % 3, Shift(1, 1, 1, 0), &generator));
  }
  EXPECT_EQ(FindAgreement(votes, kSigma, 0.025).votes, 0);
  EXPECT_EQ(FindAgreement({}, kSigma, 0.025).votes, 0);
}

// Places that are recognised by the edges of the building that are seen there.

constexpr int kKeyframesOfVisit = 4;
constexpr double kRound_m = 20, kRound_s = 30;  // from visit to visit

// The middles of three verticals and of three edges along Y, seen from x = 0.
const std::vector<std::pair<Vector3d, LineAxis>> kEdges = {
    {{4, -1, 1}, LineAxis::kVertical},  {{4.5, 0.3, 1}, LineAxis::kVertical},
    {{5, 1.4, 1}, LineAxis::kVertical}, {{4, 0, 2.2}, LineAxis::kY},
    {{4.6, 0.5, 0.1}, LineAxis::kY},    {{5.2, 0.2, 1.3}, LineAxis::kY}};

Vector3d Along(LineAxis axis) {
  return axis == LineAxis::kVertical ? Vector3d::UnitZ() : Vector3d::UnitY();
}

// Rounds that come back to the same place, each where odometry has drifted to; at one of them two
// of the edges are seen.
OdometryRun Visits(const std::vector<Vector3d>& drifts, size_t fleeting = 1000) {
  OdometryRun run;
  run.rectified_rig = testing::ForwardRig();
  run.manhattan_worlds.emplace_back();
  run.keyframes.reserve(100);
  for (size_t visit = 0; visit < drifts.size(); ++visit) {
    const int64_t first_id = std::ssize(run.lines);
    const size_t edges = visit == fleeting ? 2 : kEdges.size();
    for (size_t i = 0; i < kEdges.size(); ++i) {
      const auto& [middle, axis] = kEdges[i];
      Line line;
      line.id = first_id + static_cast<int64_t>(i);
      line.axis = axis;
      line.world = axis == LineAxis::kY ? 0 : -1;
      line.start_world = middle + drifts[visit] - 0.5 * Along(axis);
      line.end_world = middle + drifts[visit] + 0.5 * Along(axis);
      run.lines.push_back(line);
    }
    // At the place, and at the other end of the round.
    for (int k = 0; k <= kKeyframesOfVisit; ++k) {
      const bool is_there = k < kKeyframesOfVisit;
      Keyframe keyframe;
      keyframe.id = std::ssize(run.keyframes);
      keyframe.stamp_ns = ToNanoseconds(kRound_s * static_cast<double>(visit) + 0.5 * k +
                                        (is_there ? 0 : kRound_s / 2));
      keyframe.T_world_imu.translation =
          drifts[visit] + Vector3d(is_there ? 0.2 * k : -kRound_m / 2, 0, 1.2);
      for (size_t i = 0; is_there && i < edges; ++i) {
        keyframe.lines.push_back({first_id + static_cast<int64_t>(i), {{1, 1}, {2, 2}}, {}});
      }
      run.keyframes.push_back(std::move(keyframe));
    }
  }
  return run;
}

// By closure, the visit of the older edges and that of the newer ones.
std::vector<std::pair<size_t, size_t>> ClosedVisits(const OdometryRun& run) {
  const AdjustmentState state = StateOfRun(run, {});
  std::vector<std::pair<size_t, size_t>> visits;
  for (const Closure& closure : FindEdgeClosures(state, {})) {
    std::set<size_t> older, newer;
    for (const EdgeMatch& match : closure.edges) {
      EXPECT_EQ(match.older % kEdges.size(), match.newer % kEdges.size());
      older.insert(match.older / kEdges.size());
      newer.insert(match.newer / kEdges.size());
    }
    EXPECT_EQ(older.size(), 1U);
    EXPECT_EQ(newer.size(), 1U);
    visits.emplace_back(*older.begin(), *newer.begin());
  }
  return visits;
}

TEST(EdgeClosures, APlaceIsRecognisedAtItsNextVisit) {
  using Closed = std::vector<std::pair<size_t, size_t>>;
  EXPECT_EQ(ClosedVisits(Visits({Vector3d::Zero(), {0.01, -0.02, 0}})), (Closed{{0, 1}}));
  EXPECT_EQ(ClosedVisits(Visits({Vector3d::Zero()})), Closed());
}

// Against each of the visits before, all edges agree on another shift: none of these would stand
// out among all edges that were seen before.
TEST(EdgeClosures, ManyVisitsThatDriftAreRecognisedEach) {
  const OdometryRun run =
      Visits({Vector3d::Zero(), {0, 0.027, 0}, {0, 0.054, 0}, {0, 0.081, 0}, {0, 0.108, 0}});
  const std::vector<std::pair<size_t, size_t>> each = {{0, 1}, {1, 2}, {2, 3}, {3, 4}};
  EXPECT_EQ(ClosedVisits(run), each);
}

TEST(EdgeClosures, SomePlacesAreTiedToTheirFirstVisit) {
  const OdometryRun run = Visits({Vector3d::Zero(), {0, 0.004, 0}, {0, 0.008, 0}, {0, 0.012, 0}});
  const std::vector<std::pair<size_t, size_t>> tied = {{0, 1}, {1, 2}, {0, 2}, {2, 3}};
  EXPECT_EQ(ClosedVisits(run), tied);
}

// Lines that no keyframe sees are not of the state: the third visit's are its ninth to fourteenth.
TEST(EdgeClosures, WhereTheLatestVisitSawTooLittleAnEarlierOneCounts) {
  const OdometryRun run = Visits({Vector3d::Zero(), {0, 0.01, 0}, {0, 0.02, 0}}, 1);
  const std::vector<Closure> closures = FindEdgeClosures(StateOfRun(run, {}), {});
  ASSERT_EQ(closures.size(), 1U);
  ASSERT_EQ(closures[0].edges.size(), kEdges.size());
  for (const EdgeMatch& match : closures[0].edges) EXPECT_EQ(match.newer - match.older, 8U);
}

TEST(EdgeClosures, WhatIsBeyondOdometrysDriftIsAnotherPlace) {
  EXPECT_TRUE(ClosedVisits(Visits({Vector3d::Zero(), {0, 0.3, 0}})).empty());
}

}  // namespace
}  // namespace slcmap
