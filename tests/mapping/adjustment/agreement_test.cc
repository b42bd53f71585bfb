#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "mapping/adjustment/closure.h"

namespace slcmap {
namespace {

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

TEST(Agreement, TheSameVotesGiveTheSameAnswer) {
  const Agreement a = FindAgreement(Votes(20, 20), kSigma, 0.025);
  const Agreement b = FindAgreement(Votes(20, 20), kSigma, 0.025);
  EXPECT_EQ(a.shift, b.shift);
}

}  // namespace
}  // namespace slcmap
