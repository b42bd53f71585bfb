#include <ceres/sized_cost_function.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <deque>
#include <set>

#include "data/core/error.h"
#include "mapping/adjustment/adjustment_problem.h"

namespace slcmap {
namespace {

// Ties two numbers.
class Difference final : public ceres::SizedCostFunction<1, 1, 1> {
 public:
  bool Evaluate(const double* const* x, double* residuals, double** jacobians) const override {
    residuals[0] = x[0][0] - x[1][0] - 1;
    if (jacobians && jacobians[0]) jacobians[0][0] = 1;
    if (jacobians && jacobians[1]) jacobians[1][0] = -1;
    return true;
  }
};

// Places of a floor that each are tied to the next one north, and to the next one east by a point
// that both see, as rooms of a building that many visits hang together by; and what all see.
struct Floor {
  static constexpr size_t kSide = 20;

  Floor() : places(kSide * kSide), points(kSide * kSide) {
    for (size_t i = 0; i < places.size(); ++i) {
      Tie(&places[i], &common);
      Tie(&points[i], &places[i]);
      if (i % kSide + 1 < kSide) Tie(&points[i], &places[i + 1]);
      if (i + kSide < places.size()) Tie(&places[i], &places[i + kSide]);
    }
  }

  void Tie(double* a, double* b) { problem.AddResidualBlock(new Difference, nullptr, a, b); }

  std::vector<double*> First() {
    std::vector<double*> first;
    for (double& point : points) first.push_back(&point);
    return first;
  }

  ceres::Problem problem;
  std::vector<double> places, points;
  double common = 0;
};

// Numbers of the factor, by eliminating one place after the other.
size_t FillOf(Floor* floor, const ceres::ParameterBlockOrdering& ordering) {
  std::vector<std::set<size_t>> ties(floor->places.size());
  const auto tie = [&](size_t a, size_t b) {
    ties[a].insert(b);
    ties[b].insert(a);
  };
  for (size_t i = 0; i < ties.size(); ++i) {
    if (i % Floor::kSide + 1 < Floor::kSide) tie(i, i + 1);
    if (i + Floor::kSide < ties.size()) tie(i, i + Floor::kSide);
  }
  std::vector<size_t> order(ties.size());
  for (size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::ranges::sort(order, {}, [&](size_t i) { return ordering.GroupId(&floor->places[i]); });
  size_t fill = 0;
  for (const size_t i : order) {
    fill += ties[i].size() + 1;
    for (const size_t a : ties[i]) {
      ties[a].erase(i);
      for (const size_t b : ties[i]) {
        if (a != b) ties[a].insert(b);
      }
    }
  }
  return fill;
}

TEST(EliminationOrder, HasEachBlockOnce) {
  Floor floor;
  const auto ordering = EliminationOrder(floor.problem, floor.First(), {&floor.common});
  EXPECT_EQ(ordering->NumElements(), floor.problem.NumParameterBlocks());
  EXPECT_EQ(ordering->GroupSize(0), static_cast<int>(floor.points.size()));
  std::set<int> groups;
  for (double& place : floor.places) groups.insert(ordering->GroupId(&place));
  EXPECT_EQ(groups.size(), floor.places.size());
  EXPECT_GT(*groups.begin(), 0);
  EXPECT_GT(ordering->GroupId(&floor.common), *groups.rbegin());
}

// Row by row the factor of a grid has as many numbers a place as a row has places.
TEST(EliminationOrder, FillsLittle) {
  Floor floor;
  const auto ordering = EliminationOrder(floor.problem, floor.First(), {&floor.common});
  const size_t by_rows = floor.places.size() * Floor::kSide;
  EXPECT_LT(FillOf(&floor, *ordering), 0.6 * static_cast<double>(by_rows));
}

TEST(EliminationOrder, IsTheSameForTheSameProblem) {
  Floor a, b;
  const auto of_a = EliminationOrder(a.problem, a.First(), {&a.common});
  const auto of_b = EliminationOrder(b.problem, b.First(), {&b.common});
  for (size_t i = 0; i < a.places.size(); ++i) {
    EXPECT_EQ(of_a->GroupId(&a.places[i]), of_b->GroupId(&b.places[i]));
  }
}

TEST(EliminationOrder, RefusesTwoOfATermToBeFirst) {
  Floor floor;
  std::vector<double*> first = floor.First();
  first.push_back(&floor.places[0]);
  EXPECT_THROW(EliminationOrder(floor.problem, first, {}), Error);
}

// METIS has handlers of its own while it runs.
TEST(EliminationOrder, LeavesSignalsAsTheyWere) {
  struct sigaction mine {};
  mine.sa_handler = [](int) {};
  mine.sa_flags = SA_RESTART;
  struct sigaction before, after;
  sigaction(SIGTERM, &mine, &before);
  Floor floor;
  EliminationOrder(floor.problem, floor.First(), {&floor.common});
  sigaction(SIGTERM, &before, &after);
  EXPECT_EQ(after.sa_handler, mine.sa_handler);
  EXPECT_TRUE(after.sa_flags & SA_RESTART);
  EXPECT_FALSE(after.sa_flags & SA_RESETHAND);
}

TEST(EliminationOrder, OfPointsAloneIsThatOfPoints) {
  std::deque<double> points(2);
  ceres::Problem problem;
  for (double& point : points) problem.AddParameterBlock(&point, 1);
  const auto ordering = EliminationOrder(problem, {&points[0], &points[1]}, {});
  EXPECT_EQ(ordering->NumElements(), 2);
  EXPECT_EQ(ordering->NumGroups(), 1);
}

}  // namespace
}  // namespace slcmap
