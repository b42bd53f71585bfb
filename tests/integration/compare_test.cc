// slcmap compare, as a user runs it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/integration/slcmap_process.h"
#include "tests/testing/shared_data.h"
#include "tests/testing/small_sequence.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::AllOf;
using testing::ExpectError;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::ProcessResult;
using testing::RunSlcmap;
using testing::TempFolder;

class CompareTest : public ::testing::Test {
 protected:
  CompareTest() { testing::WriteSequence(sequence_, {}); }

  ProcessResult Compare(const std::string& arguments) const {
    return RunSlcmap("compare " + sequence_.Path() + " -o " + folder_.Path("report") + " " +
                     arguments);
  }

  TempFolder sequence_, folder_;
};

TEST_F(CompareTest, WrongUsageIsToldBeforeAnythingRuns) {
  ExpectError(Compare("--methods beauty"), 2, "beauty");
  ExpectError(Compare("--methods slc,slc"), 2, "slc twice");
  ExpectError(Compare("--repeats 0"), 2, "--repeats: found 0");
  ExpectError(Compare("--with orbslam"), 2, "expected NAME=file");
  ExpectError(Compare("--with orbslam=nowhere.tum"), 2, "nowhere.tum");
  ExpectError(Compare("--variant a/b=" + folder_.Write("few.yaml", "")), 2, "without '/'");
  ExpectError(Compare("--variant few=" + folder_.Write("few.yaml", "point: 3\n")), 2, "point");
  ExpectError(RunSlcmap("compare " + folder_.Path() + " -o " + folder_.Path("report")), 1,
              folder_.Path());
  EXPECT_FALSE(std::filesystem::exists(folder_.Path("report/compare.json")));
}

TEST_F(CompareTest, RunsThatFailAreToldWithTheirReason) {
  const ProcessResult result = Compare("--methods points");
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.error, HasSubstr("no method gave a result"));
  EXPECT_THAT(result.output, HasSubstr("points: a run has no pose at all"));
  EXPECT_TRUE(std::filesystem::exists(folder_.Path("report/report.html")));
}

TEST(Compare, FinishedRunsAreKept) {
  const std::string sequence = testing::SharedData("euroc_mh01_8s");
  if (sequence.empty()) GTEST_SKIP() << "needs the shared recording euroc_mh01_8s";
  const TempFolder folder;
  const std::string command =
      "compare " + sequence + " --methods points -o " + folder.Path("report");
  const ProcessResult first = RunSlcmap(command);
  ASSERT_EQ(first.exit_code, 0) << first.error;
  EXPECT_THAT(first.error, Not(HasSubstr("kept")));
  const std::string csv = testing::ReadText(folder.Path("report/compare.csv"));
  EXPECT_THAT(csv, AllOf(HasSubstr("euroc_mh01_8s,points,ape_final_m,m,0.00"),
                         HasSubstr("points,cpu_ms_a_pair,ms,")));
  // A trajectory that is given is measured beside the runs that are there.
  std::string truth = sequence + "/mav0/state_groundtruth_estimate0/data.csv";
  const ProcessResult second = RunSlcmap(command + " --with truth=" + truth);
  EXPECT_EQ(second.exit_code, 0) << second.error;
  EXPECT_THAT(second.error, HasSubstr("kept"));
  EXPECT_THAT(testing::ReadText(folder.Path("report/compare.csv")),
              AllOf(HasSubstr(csv.substr(csv.find("euroc"))), HasSubstr(",truth,ape_final_m,m,")));
}

}  // namespace
}  // namespace slcmap
