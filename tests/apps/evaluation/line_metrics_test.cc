#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>

#include "apps/evaluation/map_metrics.h"
#include "apps/evaluation/report.h"
#include "apps/evaluation/truth.h"
#include "data/core/error.h"
#include "data/core/math.h"
#include "data/io/file.h"
#include "tests/testing/forward_rig.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::AllOf;
using testing::ForwardRig;
using ::testing::HasSubstr;
using testing::Standing;
using testing::WallAtX;

// Seen from end to end.
TrueEdges Seen(const std::vector<PlySegment>& edges) { return {edges, edges}; }

MapLine Mapped(const Eigen::Vector3d& start, const Eigen::Vector3d& end) {
  MapLine line;
  line.start_world = start;
  line.end_world = end;
  return line;
}

const LineScore& At(const LineMetrics& metrics, double tolerance_m) {
  for (const LineScore& score : metrics.scores) {
    if (score.tolerance_m == tolerance_m) return score;
  }
  throw std::logic_error("no such tolerance");
}

const TrueEdges kTwoEdges = Seen({{{0, 0, 0}, {4, 0, 0}}, {{0, 0, 0}, {0, 0, 2}}});

TEST(LineMetrics, APerfectMapIsAllRight) {
  const LineMetrics metrics =
      EvaluateLines(kTwoEdges, {Mapped({4, 0, 0}, {0, 0, 0}), Mapped({0, 0, 0}, {0, 0, 2})});
  EXPECT_EQ(metrics.lines, 2);
  EXPECT_DOUBLE_EQ(metrics.mapped_length_m, 6);
  EXPECT_DOUBLE_EQ(metrics.seen_length_m, 6);
  for (const LineScore& score : metrics.scores) {
    EXPECT_NEAR(score.recall_m, 6, 1e-9);
    EXPECT_NEAR(score.recall, 1, 1e-9);
    EXPECT_NEAR(score.precision, 1, 1e-9);
    EXPECT_NEAR(score.redundancy, 1, 1e-9);
  }
  EXPECT_NEAR(metrics.accuracy.value().length_m, 6, 1e-9);
  EXPECT_NEAR(metrics.accuracy->direction_rms_deg, 0, 1e-9);
  EXPECT_NEAR(metrics.accuracy->offset_rms_m, 0, 1e-9);
  // Mapped three times it is redundant.
  const std::vector<MapLine> thrice(3, Mapped({0, 0.001, 0}, {4, 0.001, 0}));
  const LineMetrics redundant = EvaluateLines(Seen({{{0, 0, 0}, {4, 0, 0}}}), thrice);
  EXPECT_NEAR(At(redundant, 0.05).redundancy, 3, 1e-9);
  EXPECT_NEAR(At(redundant, 0.05).recall_m, 4, 1e-9);
}

TEST(LineMetrics, AnOffsetLineIsRightFromItsOffsetOn) {
  const LineMetrics metrics = EvaluateLines(kTwoEdges, {Mapped({1, 0.03, 0}, {3, 0.03, 0})});
  EXPECT_EQ(At(metrics, 0.02).precision, 0);
  EXPECT_EQ(At(metrics, 0.02).recall_m, 0);
  EXPECT_TRUE(std::isnan(At(metrics, 0.02).redundancy));
  EXPECT_NEAR(At(metrics, 0.05).precision, 1, 1e-9);
  // 2 m, and 4 cm beyond either end: the samples there are 3 and 1 cm along the edge from it, which
  // with 3 cm across is within 5 cm.
  EXPECT_NEAR(At(metrics, 0.05).recall_m, 2.08, 1e-9);
  EXPECT_NEAR(At(metrics, 0.05).recall, 2.08 / 6, 1e-9);
  EXPECT_NEAR(At(metrics, 0.05).redundancy, 2 / 2.08, 1e-9);
  EXPECT_NEAR(metrics.accuracy.value().offset_rms_m, 0.03, 1e-9);
}

TEST(LineMetrics, DirectionErrorIsWeightedByLength) {
  // 3 m turned by 1 degree and 1 m by 5, each about a place on the edge.
  const auto turned = [](double x, double degrees, double length_m) {
    const Eigen::Vector3d half(0.5 * length_m * std::cos(degrees * kDegree),
                               0.5 * length_m * std::sin(degrees * kDegree), 0);
    return Mapped(Eigen::Vector3d(x, 0, 0) - half, Eigen::Vector3d(x, 0, 0) + half);
  };
  const TrueEdges truth = Seen({{{0, 0, 0}, {40, 0, 0}}});
  const LineMetrics metrics = EvaluateLines(truth, {turned(10, 1, 3), turned(30, -5, 1)});
  ASSERT_TRUE(metrics.accuracy.has_value());
  EXPECT_NEAR(metrics.accuracy->length_m, 4, 1e-9);
  EXPECT_NEAR(metrics.accuracy->direction_mean_deg, 2, 1e-9);
  EXPECT_NEAR(metrics.accuracy->direction_rms_deg, std::sqrt((3 * 1 + 1 * 25) / 4.0), 1e-9);
}

// An arc of 10 m in pieces of half a metre that bends by 30 mm, as one edge, and the parallel edge
// beside it.
TrueEdges BentEdge() {
  TrueEdges truth;
  const auto at = [](double x) { return Eigen::Vector3d(x, 0.03 * (1 - x * x / 25), 0); };
  for (int i = -10; i < 10; ++i) {
    truth.whole.push_back({at(0.5 * i), at(0.5 * (i + 1))});
    truth.edge_of_whole.push_back(3);
  }
  truth.seen = truth.whole;
  truth.whole.push_back({{-5, 2, 0}, {5, 2, 0}});
  truth.edge_of_whole.push_back(4);
  return truth;
}

TEST(LineMetrics, ALineAlongABentEdgeHasTheDirectionOfWhatItCovers) {
  const TrueEdges truth = BentEdge();
  const LineMetrics whole = EvaluateLines(truth, {Mapped({-5, 0.02, 0}, {5, 0.02, 0})});
  EXPECT_NEAR(At(whole, 0.05).precision, 1, 1e-9);
  EXPECT_NEAR(At(whole, 0.05).recall, 1, 1e-9);
  EXPECT_NEAR(whole.accuracy.value().direction_mean_deg, 0, 1e-3);
  // Its second half goes down by 30 mm.
  const LineMetrics half = EvaluateLines(truth, {Mapped({5, 0.02, 0}, {0, 0.02, 0})});
  EXPECT_NEAR(half.accuracy.value().direction_mean_deg, std::atan(0.03 / 5) / kDegree, 1e-3);
  const LineMetrics chord = EvaluateLines(truth, {Mapped({0, 0.03, 0}, {5, 0, 0})});
  EXPECT_NEAR(chord.accuracy.value().direction_mean_deg, 0, 1e-3);
}

TEST(LineMetrics, OtherDirectionsDoNotCount) {
  // Across an edge, and 12 degrees off it: near, but no observations of it.
  const double slope = std::tan(12 * kDegree);
  const LineMetrics metrics = EvaluateLines(
      kTwoEdges, {Mapped({1, -0.1, 0}, {1, 0.1, 0}), Mapped({2, 0, 0}, {2.2, 0.2 * slope, 0})});
  EXPECT_EQ(At(metrics, 0.2).precision, 0);
  EXPECT_EQ(At(metrics, 0.2).recall_m, 0);
  EXPECT_FALSE(metrics.accuracy.has_value());
  const double flatter = std::tan(8 * kDegree);
  EXPECT_GT(
      At(EvaluateLines(kTwoEdges, {Mapped({2, 0, 0}, {2.2, 0.2 * flatter, 0})}), 0.2).precision,
      0.99);
  // Nor do they hide a parallel edge that is further off.
  const TrueEdges crossed = Seen({{{0, 0, 0}, {4, 0, 0}}, {{2, 0.1, -1}, {2, 0.1, 1}}});
  const LineMetrics behind = EvaluateLines(crossed, {Mapped({1.9, 0.08, 0}, {2.1, 0.08, 0})});
  EXPECT_EQ(At(behind, 0.05).precision, 0);
  EXPECT_NEAR(At(behind, 0.1).precision, 1, 1e-9);
}

TEST(LineMetrics, RecallOfWhatWasSeenClearlyStandsBesideThatOfAll) {
  // Recall is of seen parts, precision of whole edges.
  const LineMetrics part = EvaluateLines({{{{0, 0, 0}, {4, 0, 0}}}, {{{1, 0, 0}, {3, 0, 0}}}},
                                         {Mapped({2, 0, 0}, {4, 0, 0})});
  EXPECT_NEAR(part.seen_length_m, 2, 1e-12);
  EXPECT_NEAR(At(part, 0.01).precision, 1, 1e-9);
  EXPECT_NEAR(At(part, 0.01).recall, 0.5, 0.011);
  TrueEdges truth = kTwoEdges;
  EXPECT_FALSE(At(EvaluateLines(truth, {}), 0.05).clear_recall.has_value());
  truth.clear = {{{{1, 0, 0}, {3, 0, 0}}}};
  const std::vector<MapLine> lines = {Mapped({2, 0, 0}, {4, 0, 0})};
  const LineMetrics metrics = EvaluateLines(truth, lines);
  EXPECT_NEAR(At(metrics, 0.01).clear_recall.value(), 0.5, 0.011);
  EXPECT_NEAR(At(metrics, 0.01).recall, 2.0 / 6, 0.011);
  EXPECT_NEAR(metrics.clear_length_m.value(), 2, 1e-12);
  const ComparedFiles inputs{"edges.csv", "lines.ply"};
  EXPECT_NEAR(LineJson(inputs, metrics)["scores"][0]["clear_recall"].get<double>(), 0.5, 0.011);
}

TEST(LineMetrics, MarksAreToBeOnNoEdge) {
  // Of 4 m on edges 1 m is called a mark; of 3 m on none, 2 m are not.
  LineMetrics metrics =
      EvaluateLines(kTwoEdges, {Mapped({0, 0, 0}, {3, 0, 0}), Mapped({0, 1, 0}, {2, 1, 0})});
  EvaluateMarks(kTwoEdges, {Mapped({0, 0, 1}, {0, 0, 2}), Mapped({0, 1, 0}, {0, 1, 1})},
                kMostLineSamples, &metrics);
  ASSERT_EQ(metrics.kinds.size(), metrics.scores.size());
  EXPECT_NEAR(metrics.marks_length_m, 2, 1e-9);
  EXPECT_NEAR(metrics.kinds[2].edges_called_marks, 1.0 / 4, 1e-9);
  EXPECT_NEAR(metrics.kinds[2].marks_called_edges, 2.0 / 3, 1e-9);
  const ComparedFiles inputs{"edges.csv", "lines.ply"};
  EXPECT_NEAR(LineJson(inputs, metrics)["kinds"]["scores"][2]["edges_called_marks"].get<double>(),
              0.25, 1e-9);
}

TEST(LineMetrics, NoLinesAndLinesWithoutExtentAreNoDivisionByZero) {
  const LineMetrics none = EvaluateLines(kTwoEdges, {});
  EXPECT_EQ(At(none, 0.2).recall, 0);
  EXPECT_TRUE(std::isnan(At(none, 0.2).precision));
  const ComparedFiles inputs{"edges.csv", "lines.ply"};
  EXPECT_TRUE(LineJson(inputs, none)["scores"][0]["precision"].dump() == "null");
  TrueEdges unseen = kTwoEdges;
  unseen.seen.clear();
  EXPECT_TRUE(std::isnan(At(EvaluateLines(unseen, {}), 0.2).recall));
  const LineMetrics dot = EvaluateLines(kTwoEdges, {Mapped({1, 0, 0}, {1, 0, 0})});
  EXPECT_EQ(dot.lines, 1);
  EXPECT_EQ(dot.without_extent, 1);
  EXPECT_TRUE(std::isnan(At(dot, 0.2).precision));
}

TEST(LineMetrics, LinesAreLaidOverTheTruthLikeTheTrajectory) {
  const Alignment alignment{
      1, {Eigen::Quaterniond(Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ())), {1, 2, 3}}};
  const MapLine line = Aligned(alignment, {Mapped({1, 0, 0}, {0, 1, 1})}).front();
  EXPECT_TRUE(line.start_world.isApprox(Eigen::Vector3d(1, 3, 3), 1e-12));
  EXPECT_TRUE(line.end_world.isApprox(Eigen::Vector3d(0, 2, 4), 1e-12));
}

constexpr char kHeader[] = "edge,axis,wing,ax_m,ay_m,az_m,bx_m,by_m,bz_m,seen_from_m,seen_to_m\n";

TEST(TrueEdges, TableGivesWholeEdgesAndSeenParts) {
  const testing::TempFolder folder;
  const TrueEdges edges = ReadTrueEdges(folder.Write(
      "edges.csv", std::string(kHeader) + "0,0,0,1,0,0,5,0,0,0.5,1\n0,0,0,1,0,0,5,0,0,2,4\n"
                                          "1,1,0,0,0,0,0,9,0,0,0\n2,-1,0,0,0,0,0,3,4,0,5\n"));
  ASSERT_EQ(edges.whole.size(), 2u);
  EXPECT_EQ(edges.whole[1].end_world, Eigen::Vector3d(0, 3, 4));
  ASSERT_EQ(edges.seen.size(), 3u);
  EXPECT_EQ(edges.seen[0].start_world, Eigen::Vector3d(1.5, 0, 0));
  EXPECT_EQ(edges.seen[1].end_world, Eigen::Vector3d(5, 0, 0));
  // Those of a PLY file are seen whole.
  WriteLinesPly(folder.Path("edges.ply"), {{{0, 0, 0}, {1, 0, 0}}, {{2, 0, 0}, {2, 0, 0}}});
  EXPECT_EQ(ReadTrueEdges(folder.Path("edges.ply")).seen.size(), 1u);
  EXPECT_EQ(ReadTrueEdges(folder.Path("edges.ply")).whole.size(), 1u);
}

TEST(TrueEdges, PiecesOfABentEdgeAreOfOneSeenOrNot) {
  const testing::TempFolder folder;
  const TrueEdges edges = ReadTrueEdges(
      folder.Write("edges.csv", std::string(kHeader) +
                                    "0,0,0,0,0,0,1,0,0,0.5,1\n0,0,0,1,0,0,2,0.1,0,0,0\n"
                                    "1,1,0,0,0,0,0,9,0,0,0\n1,1,0,0,9,0,0,9,9,0,0\n"
                                    "2,0,0,2,0.1,0,3,0.2,0,0,0.2\n2,0,0,2,0.1,0,3,0.2,0,0.4,1\n"));
  ASSERT_EQ(edges.whole.size(), 3u);
  EXPECT_EQ(edges.edge_of_whole, (std::vector<int64_t>{0, 0, 2}));
  EXPECT_EQ(edges.whole[1].end_world, Eigen::Vector3d(2, 0.1, 0));
  EXPECT_EQ(edges.seen.size(), 3u);
}

TEST(TrueEdges, DamagedFilesAreNamed) {
  const testing::TempFolder folder;
  const auto expect_error = [&](const std::string& rows, const std::string& what) {
    const std::string path = folder.Write("edges.csv", rows);
    EXPECT_THAT(testing::MessageOf<DataError>([&] { ReadTrueEdges(path); }),
                AllOf(HasSubstr("edges.csv: "), HasSubstr(what)));
  };
  expect_error(kHeader, "found no edge");
  expect_error(std::string(kHeader) + "0,0,0,1,0,0,5,0,0,2,1\n", "row 2: seen_to_m: found '1'");
  expect_error(std::string(kHeader) + "0,0,0,1,0,0,5,0,nan,0,1\n", "row 2: bz_m: found 'nan'");
  expect_error("x,y\n", "row 1");
}

TEST(LineReport, TableJsonAndPlanHoldTheFigures) {
  const std::vector<MapLine> lines = {Mapped({1, 0.03, 0}, {3, 0.03, 0})};
  const LineMetrics metrics = EvaluateLines(kTwoEdges, lines);
  const ComparedFiles inputs{"edges.csv", "lines.ply"};
  const nlohmann::ordered_json json = LineJson(inputs, metrics);
  EXPECT_THAT(FiguresText(json),
              AllOf(HasSubstr("seen_length_m              6\n"),
                    HasSubstr("  tolerance_m  recall_m    recall  precision  redundancy\n"),
                    HasSubstr("         0.05      2.08   0.34667          1     0.96154\n")));
  EXPECT_EQ(json["lines"], 1);
  EXPECT_EQ(json["scores"][2]["tolerance_m"], 0.05);
  EXPECT_NEAR(json["scores"][2]["precision"].get<double>(), 1, 1e-9);
  EXPECT_NEAR(json["accuracy"]["offset_rms_m"].get<double>(), 0.03, 1e-9);
  EXPECT_TRUE(LineJson(inputs, EvaluateLines(kTwoEdges, {}))["accuracy"].is_null());
}

double Length(const std::vector<PlySegment>& parts) {
  return std::accumulate(parts.begin(), parts.end(), 0.0, [](double sum, const PlySegment& part) {
    return sum + (part.end_world - part.start_world).norm();
  });
}

// Of edges that are seen from end to end; on a wall behind them all, with a pillar 1 m wide before.
std::vector<PlySegment> Clear(const std::vector<PlySegment>& edges, double seconds) {
  std::vector<Triangle> surfaces = WallAtX(20, 20);
  const std::vector<Triangle> pillar = WallAtX(2, 0.5);
  surfaces.insert(surfaces.end(), pillar.begin(), pillar.end());
  return ClearlySeen({edges, edges}, TriangleTree(surfaces), Standing(seconds), ForwardRig());
}

const std::vector<PlySegment> kBehindPillar = {{{4, -2, 0}, {4, 2, 0}}};

TEST(ClearEdges, WhatIsHiddenIsLeftOut) {
  const std::vector<PlySegment> parts = Clear(kBehindPillar, 2);
  ASSERT_EQ(parts.size(), 2u);
  // The pillar's half metre at 2 m hides one at 4 m.
  EXPECT_NEAR(parts[0].end_world.y(), -1, 0.041);
  EXPECT_NEAR(parts[1].start_world.y(), 1, 0.041);
  EXPECT_NEAR(Length(parts), 2, 0.081);
}

TEST(ClearEdges, ASurfaceHidesWhatIsBuriedInItButNotWhatIsOnIt) {
  EXPECT_NEAR(Length(Clear({{{2, -0.4, 0.1}, {2, 0.4, 0.1}}}, 2)), 0.8, 1e-9);
  EXPECT_TRUE(Clear({{{2.01, -0.4, 0.1}, {2.01, 0.4, 0.1}}}, 2).empty());
}

TEST(ClearEdges, TwentyFramesAreNeeded) {
  EXPECT_TRUE(Clear(kBehindPillar, 0.9).empty());  // 19 of them
  EXPECT_FALSE(Clear(kBehindPillar, 0.95).empty());
}

TEST(ClearEdges, FarPlacesAndThoseOutsideTheImageAreLeftOut) {
  EXPECT_TRUE(Clear({{{9, 5, 0}, {9, 6, 0}}}, 2).empty());
  // At 4 m the image ends at 3.2 m from its middle.
  EXPECT_NEAR(Length(Clear({{{4, 2, 0}, {4, 6, 0}}}, 2)), 1.2, 0.05);
}

TEST(ClearEdges, ShortEdgesAreLeftOutButNotThePiecesOfABentOne) {
  const std::vector<PlySegment> pieces = {{{4, 1.5, 0}, {4, 1.7, 0}},
                                          {{4, 1.7, 0}, {4, 1.9, 0.01}}};
  EXPECT_TRUE(Clear(pieces, 2).empty());
  TrueEdges bent{pieces, pieces, {7, 7}};
  EXPECT_NEAR(Length(ClearlySeen(bent, TriangleTree(WallAtX(20, 20)), Standing(2), ForwardRig())),
              0.4, 1e-3);
}

}  // namespace
}  // namespace slcmap
