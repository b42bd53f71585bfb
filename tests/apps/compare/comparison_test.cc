#include "apps/compare/comparison.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "apps/compare/measure.h"
#include "data/core/error.h"
#include "mapping/map/map_folder.h"
#include "mapping/mapping.h"
#include "odometry/run/run_folder.h"
#include "tests/testing/edge_walk.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

MethodResult MadeMethod(const std::string& name, const std::vector<double>& thickness_mm) {
  MethodResult method;
  method.name = name;
  for (const double value : thickness_mm) method.repeats.push_back({{"edge_thickness_mm", value}});
  return method;
}

Comparison TwoMethods(const std::vector<double>& a, const std::vector<double>& b) {
  SequenceResult sequence;
  sequence.name = "hall_1 <west>";
  sequence.methods = {MadeMethod("points", a), MadeMethod("slc", b)};
  Comparison comparison;
  comparison.repeats = static_cast<int>(a.size());
  comparison.sequences = {sequence};
  return comparison;
}

const Comparison kClear = TwoMethods({4, 4.2, 3.8}, {2, 2.1, 1.9});

TEST(Comparison, TheBestIsMarkedWhereTheSpreadBearsIt) {
  EXPECT_THAT(ComparisonTable(kClear),
              AllOf(HasSubstr("2.00 +- 0.10 *"), Not(HasSubstr("4.00 +- 0.20 *"))));
  EXPECT_THAT(ComparisonPage(kClear), HasSubstr("<td class=\"best\">2.00"));
}

TEST(Comparison, NothingIsMarkedOfSingleRunsOrAWideSpread) {
  for (const Comparison& unclear : {TwoMethods({4}, {2}), TwoMethods({4, 1, 7}, {2, 5, 3})}) {
    EXPECT_THAT(ComparisonTable(unclear), Not(HasSubstr(" *\n")));
    EXPECT_THAT(ComparisonPage(unclear), Not(HasSubstr("class=\"best\"")));
  }
  EXPECT_THAT(ComparisonTable(TwoMethods({4}, {2})), HasSubstr("so nothing is ranked"));
}

TEST(Comparison, JsonAndCsvHoldEveryRun) {
  const nlohmann::ordered_json json = ComparisonJson(kClear);
  const auto& sequence = json["sequences"][0];
  EXPECT_EQ(sequence["order"]["edge_thickness_mm"], "slc before points");
  const auto& figure = sequence["methods"][1]["figures"]["edge_thickness_mm"];
  EXPECT_EQ(figure["runs"].size(), 3u);
  EXPECT_NEAR(figure["mean"].get<double>(), 2, 1e-12);
  EXPECT_FALSE(sequence["methods"][1]["figures"].contains("ape_final_m"));
  EXPECT_THAT(ComparisonCsv(kClear), HasSubstr("hall_1 <west>,slc,edge_thickness_mm,mm,2,0.1,3\n"));
}

TEST(Comparison, ThePageNeedsNothingBesideItAndEscapesNames) {
  const std::string page = ComparisonPage(kClear);
  EXPECT_THAT(page, AllOf(HasSubstr("hall_1 &lt;west&gt;"), Not(HasSubstr("<west>")),
                          Not(HasSubstr("http:")), Not(HasSubstr("<script")), HasSubstr("<svg")));
  // The command that made it is longer than a phone is wide.
  EXPECT_THAT(page, HasSubstr("code { font-size: .9em; overflow-wrap: anywhere; }"));
}

TEST(Comparison, ThePageExplainsItsColumnsAndItsPlotsCanBeSaved) {
  EXPECT_THAT(ComparisonPage(kClear),
              AllOf(HasSubstr("<li><b>edges, thickness</b> [mm]: RMS distance of single"),
                    HasSubstr("<a download=\"edges-thickness.svg\" href=\"data:image/svg")));
  EXPECT_THAT(ComparisonTable(kClear), HasSubstr("No truth: made without it are straightness"));
  Comparison known = kClear;
  known.sequences[0].true_poses = true;
  EXPECT_THAT(ComparisonPage(known), HasSubstr("RMSE (root mean square) after alignment by"));
  EXPECT_THAT(ComparisonTable(known), Not(HasSubstr("No truth")));
}

// The widths of the bars in the page.
std::vector<double> BarWidths(const std::string& page) {
  std::vector<double> widths;
  const std::string mark = "<rect x=\"92.0\"";
  for (size_t at = page.find(mark); at != page.npos; at = page.find(mark, at + 1)) {
    widths.push_back(std::stod(page.substr(page.find("width=\"", at) + 7)));
  }
  return widths;
}

TEST(Comparison, AnOutlierLeavesOtherBarsReadable) {
  const std::string page = ComparisonPage(TwoMethods({4000}, {2}));
  EXPECT_THAT(page, HasSubstr("logarithmic"));
  const std::vector<double> widths = BarWidths(page);
  ASSERT_EQ(widths.size(), 2u);
  EXPECT_GT(widths[1], 10);
  EXPECT_GT(widths[0], 2 * widths[1]);
  EXPECT_LT(92 + widths[0], 340);
  EXPECT_THAT(ComparisonPage(kClear), Not(HasSubstr("logarithmic")));
}

TEST(Comparison, AMethodWhoseRunsAllFailedIsShownWithoutFigures) {
  Comparison comparison = kClear;
  comparison.sequences[0].methods.push_back(MadeMethod("structural", {}));
  comparison.sequences[0].methods.back().remarks = {"run 1 failed: no pose"};
  EXPECT_THAT(ComparisonTable(comparison), HasSubstr("structural: run 1 failed: no pose"));
  EXPECT_THAT(ComparisonPage(comparison), HasSubstr("<td>structural</td><td>-</td>"));
}

Ranked Of(const std::string& name, const std::vector<double>& values) {
  return {name, evaluation::ComputeSpread(values)};
}

TEST(Spread, IsMeanAndStandardDeviation) {
  const Spread spread = evaluation::ComputeSpread({1, 2, 3});
  EXPECT_EQ(spread.count, 3);
  EXPECT_DOUBLE_EQ(spread.mean, 2);
  EXPECT_DOUBLE_EQ(spread.deviation, 1);
  EXPECT_EQ(SpreadText(spread, 1), "2.0 +- 1.0");
  EXPECT_EQ(SpreadText(evaluation::ComputeSpread({4}), 2), "4.00");
  EXPECT_EQ(SpreadText(evaluation::ComputeSpread({}), 2), "-");
}

TEST(Spread, NothingIsRankedThatTheSpreadDoesNotBear) {
  const Ranked a = Of("a", {1.0, 1.1, 0.9}), b = Of("b", {2.0, 2.1, 1.9}),
               wide = Of("wide", {0.5, 1.6, 2.7}), single = Of("single", {0.1});
  EXPECT_TRUE(IsBelow(a.spread, b.spread));
  EXPECT_FALSE(IsBelow(b.spread, a.spread));
  EXPECT_FALSE(IsBelow(a.spread, wide.spread));
  EXPECT_FALSE(IsBelow(single.spread, b.spread));
  EXPECT_EQ(FindBestMethod({b, a}, true), 1u);
  EXPECT_EQ(FindBestMethod({b, a}, false), 0u);
  EXPECT_FALSE(FindBestMethod({a, b, wide}, true));
  EXPECT_FALSE(FindBestMethod({a, b, single}, true));
  EXPECT_FALSE(FindBestMethod({a}, true));
  // The same twice.
  EXPECT_FALSE(FindBestMethod({Of("a", {1, 1}), Of("b", {1, 1})}, true));
  EXPECT_EQ(FindBestMethod({Of("a", {1, 1}), Of("b", {1.5, 1.5})}, true), 0u);
}

TEST(Spread, OrderIsToldInWords) {
  const Ranked a = Of("a", {1.0, 1.1, 0.9}), b = Of("b", {2.0, 2.1, 1.9}),
               wide = Of("wide", {0.5, 1.6, 2.7});
  EXPECT_EQ(OrderInWords({b, a, wide}, true), "a before b");
  EXPECT_EQ(OrderInWords({b, a}, false), "b before a");
  EXPECT_EQ(OrderInWords({a, wide}, true), "the spread bears no order");
  EXPECT_EQ(OrderInWords({Of("a", {1}), Of("b", {2})}, true),
            "single runs: nothing says how far they scatter, so no order");
}

// A run over a walk, and trajectories that others made of it.
class MeasureTest : public ::testing::Test {
 protected:
  MeasureTest() {
    const OdometryRun run = testing::RunOver(kWalk);
    WriteRunFolder(folder_.Path("run"), run);
    WriteMapFolder(folder_.Path("map"), MapRun(run, nullptr, {}));
    WriteTumTrajectory(folder_.Path("truth.tum"), kWalk);
    sequence_.name = "walk";
    sequence_.methods = {{"slc", {{folder_.Path("run"), folder_.Path("map")}}, {}, {}}};
    sequence_.reference = 0;
  }

  void Give(const std::string& name, const Trajectory& trajectory) {
    const std::string path = folder_.Path(name + ".tum");
    WriteTumTrajectory(path, trajectory);
    sequence_.methods.push_back({name, {}, ReadTrajectory(path), {}});
  }

  static double Figure(const SequenceResult& result, size_t method, const std::string& key) {
    return result.methods.at(method).repeats.at(0).at(key);
  }

  const Trajectory kWalk = testing::Walk(40);
  testing::TempFolder folder_;
  MeasuredSequence sequence_;
};

// Bent sideways as an arc of a sagitta over the whole way.
Trajectory Bent(Trajectory walk, double sagitta_m) {
  const auto last = static_cast<double>(walk.size() - 1);
  for (size_t i = 0; i < walk.size(); ++i) {
    const double u = static_cast<double>(i) / last;
    walk[i].T_world_imu.translation.y() += 4 * sagitta_m * u * (1 - u);
  }
  return walk;
}

TEST_F(MeasureTest, ABentTrajectoryRanksBehindAStraightOne) {
  Give("bent", Bent(kWalk, 0.01));
  const SequenceResult result = MeasureSequence(sequence_);
  EXPECT_LT(Figure(result, 0, "edge_thickness_mm"), 0.01);
  EXPECT_GT(Figure(result, 1, "edge_thickness_mm"), 2);
  EXPECT_LT(Figure(result, 1, "edge_thickness_mm"), 10);
  EXPECT_FALSE(result.true_poses);
  EXPECT_FALSE(result.methods[1].repeats[0].contains("ape_final_m"));
  EXPECT_THAT(result.reference, HasSubstr("by slc"));
}

TEST_F(MeasureTest, TruePosesGiveErrorsAndTheFloor) {
  sequence_.true_poses = folder_.Path("truth.tum");
  Give("bent", Bent(kWalk, 0.01));
  // The start may go without poses: that is no fault, but it is counted.
  Give("later", Trajectory(kWalk.begin() + 2, kWalk.end()));
  const SequenceResult result = MeasureSequence(sequence_);
  EXPECT_LT(Figure(result, 0, "ape_final_m"), 1e-5);
  EXPECT_GT(Figure(result, 1, "ape_final_m"), 0.002);
  EXPECT_LT(result.with_true_poses.at("edge_thickness_mm"), 0.01);
  EXPECT_NEAR(result.length_m, 39 * testing::kWalkStep_m, 1e-6);
  EXPECT_NEAR(Figure(result, 0, "coverage_percent"), 100, 1e-9);
  EXPECT_NEAR(Figure(result, 2, "coverage_percent"), 95, 1e-9);
  EXPECT_THAT(result.methods[2].remarks, Not(::testing::Contains(HasSubstr("covers"))));
  // Where they are the worst they are no floor.
  WriteTumTrajectory(sequence_.true_poses, Bent(kWalk, 0.01));
  const SequenceResult worst = MeasureSequence(sequence_);
  EXPECT_FALSE(worst.truth_is_floor);
  EXPECT_FALSE(worst.methods[0].repeats[0].contains("edge_thickness_beyond_mm"));
}

TEST_F(MeasureTest, AShortTrajectoryDoesNotDecideWhatIsMeasured) {
  Give("short", Trajectory(kWalk.begin(), kWalk.begin() + 20));
  const SequenceResult result = MeasureSequence(sequence_);
  EXPECT_THAT(result.reference, HasSubstr("160 observations of edges"));
  ASSERT_EQ(result.methods[1].remarks.size(), 1u);
  EXPECT_THAT(result.methods[1].remarks[0], HasSubstr("no pose for many"));
  EXPECT_TRUE(result.methods[0].remarks.empty());
}

TEST_F(MeasureTest, ATrajectoryOfAnotherTimeIsAMethodThatFails) {
  sequence_.true_poses = folder_.Path("truth.tum");
  Trajectory late = kWalk;
  for (StampedPose& pose : late) pose.stamp_ns += 1000000000000;
  Give("late", late);
  const SequenceResult result = MeasureSequence(sequence_);
  EXPECT_FALSE(result.methods[1].repeats[0].contains("ape_final_m"));
  EXPECT_FALSE(result.methods[1].remarks.empty());
}

TEST_F(MeasureTest, RunsWithoutLinesGiveNoObservations) {
  EXPECT_EQ(ReferenceAmong(sequence_.methods), 0u);
  OdometryRun points = testing::RunOver(kWalk);
  for (Keyframe& keyframe : points.keyframes) keyframe.lines.clear();
  WriteRunFolder(folder_.Path("points"), points);
  EXPECT_FALSE(ReferenceAmong({{"points", {RunFolders{folder_.Path("points"), ""}}, {}, {}}}));
}

}  // namespace
}  // namespace slcmap
