#include "apps/evaluation/line_gaps.h"

#include <gtest/gtest.h>

namespace slcmap {
namespace {

MapLine LineFrom(const Eigen::Vector3d& start, const Eigen::Vector3d& end) {
  MapLine line;
  line.start_world = start;
  line.end_world = end;
  return line;
}

// A skirting of 5 m with a doorway of 1 m, and a jamb of 6 cm in it.
class LineGapsTest : public ::testing::Test {
 protected:
  LineGapsTest() {
    truth_.whole = {{{0, 0, 0}, {2, 0, 0}},
                    {{3, 0, 0}, {5, 0, 0}},
                    {{2, 0, 0}, {2, 0, 2}},
                    {{2, 0.06, 0}, {2, 0.06, 2}}};
    truth_.seen = truth_.whole;
    truth_.clear = truth_.whole;
    truth_.doorways = {{{2, 0, 0}, {3, 0, 0}, {3, 0, 2}, {2, 0, 2}}};
  }

  const MapLine before_ = LineFrom({0.1, 0.01, 0}, {1.95, 0.01, 0});
  const MapLine behind_ = LineFrom({3.02, 0, 0.01}, {4.9, 0, 0.01});
  const MapLine front_ = LineFrom({2, 0.01, 0.1}, {2, 0.01, 1.9});
  const MapLine back_ = LineFrom({2, 0.055, 1.9}, {2, 0.055, 0.1});
  TrueEdges truth_;
};

TEST_F(LineGapsTest, AreKeptByLinesThatEndThere) {
  const LineGaps gaps = EvaluateLineGaps(truth_, {before_, behind_, front_, back_});
  EXPECT_EQ(gaps.gaps, 1);
  EXPECT_EQ(gaps.gaps_kept, 1);
  EXPECT_EQ(gaps.pairs, 1);
  EXPECT_EQ(gaps.pairs_kept, 1);
}

TEST_F(LineGapsTest, AreOneWhicheverWayTheEdgesRun) {
  for (PlySegment& edge : truth_.whole) std::swap(edge.start_world, edge.end_world);
  EXPECT_EQ(EvaluateLineGaps(truth_, {before_, behind_}).gaps, 1);
  std::swap(truth_.whole[0].start_world, truth_.whole[0].end_world);
  EXPECT_EQ(EvaluateLineGaps(truth_, {before_, behind_}).gaps, 1);
  std::swap(truth_.whole[0].start_world, truth_.whole[0].end_world);
  std::swap(truth_.whole[1].start_world, truth_.whole[1].end_world);
  EXPECT_EQ(EvaluateLineGaps(truth_, {before_, behind_}).gaps, 1);
}

TEST_F(LineGapsTest, AreLostByALineThatGoesThrough) {
  const LineGaps gaps = EvaluateLineGaps(truth_, {LineFrom({0.1, 0, 0}, {4.9, 0, 0})});
  EXPECT_EQ(gaps.gaps, 1);
  EXPECT_EQ(gaps.gaps_kept, 0);
}

TEST_F(LineGapsTest, ThatHoldAnEdgeAreNone) {
  truth_.unseen.push_back({{2, 0.02, 0}, {3, 0.02, 0}});  // a threshold
  EXPECT_EQ(EvaluateLineGaps(truth_, {before_, behind_}).gaps, 0);
}

TEST_F(LineGapsTest, OfClosedDoorsAreNone) {
  truth_.doorways[0] = {{2, 1, 0}, {3, 1, 0}, {3, 1, 2}, {2, 1, 2}};
  EXPECT_EQ(EvaluateLineGaps(truth_, {before_, behind_}).gaps, 0);
}

TEST_F(LineGapsTest, OfEdgesThatTheMapLacksTellNothing) {
  EXPECT_EQ(EvaluateLineGaps(truth_, {before_}).gaps, 0);
  EXPECT_EQ(EvaluateLineGaps(truth_, {before_}).pairs, 0);
  EXPECT_EQ(EvaluateLineGaps(truth_, {}).pairs_kept, 0);
}

TEST_F(LineGapsTest, PairsAtTheSidesOfOpeningsAreJambs) {
  EXPECT_EQ(EvaluateLineGaps(truth_, {front_, back_}).jambs, 0);
  truth_.openings = truth_.doorways;
  EXPECT_EQ(EvaluateLineGaps(truth_, {front_, back_}).jambs, 1);
  EXPECT_EQ(EvaluateLineGaps(truth_, {front_, back_}).jambs_kept, 1);
  EXPECT_EQ(EvaluateLineGaps(truth_, {front_}).jambs_kept, 0);
  for (Eigen::Vector3d& corner : truth_.openings[0]) corner.x() += 0.2;
  EXPECT_EQ(EvaluateLineGaps(truth_, {front_}).jambs, 0);
}

TEST_F(LineGapsTest, OneLineForTwoEdgesKeepsNoPair) {
  const LineGaps one = EvaluateLineGaps(truth_, {front_});
  EXPECT_EQ(one.pairs, 1);
  EXPECT_EQ(one.pairs_kept, 0);
  truth_.clear.reset();
  EXPECT_EQ(EvaluateLineGaps(truth_, {front_}).pairs, 0);
}

}  // namespace
}  // namespace slcmap
