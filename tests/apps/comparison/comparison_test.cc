#include "apps/compare/comparison.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "apps/compare/comparison_page.h"

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
  EXPECT_THAT(ComparisonLatex(kClear),
              AllOf(HasSubstr("$\\mathbf{2.00} \\pm 0.10$"), HasSubstr("hall\\_1")));
  EXPECT_THAT(ComparisonPage(kClear), HasSubstr("<td class=\"best\">2.00"));
}

TEST(Comparison, NothingIsMarkedOfSingleRunsOrAWideSpread) {
  for (const Comparison& unclear : {TwoMethods({4}, {2}), TwoMethods({4, 1, 7}, {2, 5, 3})}) {
    EXPECT_THAT(ComparisonTable(unclear), Not(HasSubstr(" *\n")));
    EXPECT_THAT(ComparisonLatex(unclear), Not(HasSubstr("mathbf")));
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

TEST(Comparison, WithoutTruthItSaysWhatWasMeasured) {
  EXPECT_THAT(ComparisonTable(kClear), HasSubstr("No truth: made without it are straightness"));
  Comparison known = kClear;
  known.sequences[0].true_poses = true;
  EXPECT_THAT(ComparisonTable(known), Not(HasSubstr("No truth")));
}

TEST(Comparison, ThePageNeedsNothingBesideItAndEscapesNames) {
  const std::string page = ComparisonPage(kClear);
  EXPECT_THAT(page, AllOf(HasSubstr("hall_1 &lt;west&gt;"), Not(HasSubstr("<west>")),
                          Not(HasSubstr("http:")), Not(HasSubstr("<script")), HasSubstr("<svg")));
  // The command that made it is longer than a phone is wide.
  EXPECT_THAT(page, HasSubstr("code { font-size: .9em; overflow-wrap: anywhere; }"));
}

TEST(Comparison, ThePageExplainsItsColumnsAndItsPlotsCanBeSaved) {
  const std::string page = ComparisonPage(kClear);
  EXPECT_THAT(page, AllOf(HasSubstr("<li><b>edges, thickness</b> [mm]: RMS distance of single"),
                          HasSubstr("<a download=\"edges-thickness.svg\" href=\"data:image/svg")));
  Comparison known = kClear;
  known.sequences[0].true_poses = true;
  EXPECT_THAT(ComparisonPage(known), HasSubstr("RMSE (root mean square) after alignment by"));
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

TEST(Figures, KeysAreDistinctAndKnown) {
  for (const FigureInfo& figure : AllFigures()) {
    EXPECT_EQ(&FindFigure(figure.key), &figure);
    EXPECT_FALSE(DescribeFigure(figure.key).empty());
  }
  EXPECT_THROW(FindFigure("beauty"), std::out_of_range);
}

}  // namespace
}  // namespace slcmap
