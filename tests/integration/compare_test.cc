// slcmap compare, as a user runs it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
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

// A run without a pose is a whole result too, and quick to have.
TEST_F(CompareTest, RunsAreKeptWhileProgramAndImagesAreTheSame) {
  EXPECT_THAT(Compare("--methods points").error, Not(HasSubstr("kept")));
  EXPECT_THAT(Compare("--methods points").error, HasSubstr("points-0-"));
  EXPECT_THAT(Compare("--methods points").error, HasSubstr("kept from before"));
  // Another build of the same version.
  const std::string other = folder_.Path("other_slcmap");
  const ProcessResult rebuilt = testing::RunShell(
      "cp \\$SLCMAP " + other + " && echo >> " + other + " && " + other + " compare " +
      sequence_.Path() + " -o " + folder_.Path("report") + " --methods points");
  EXPECT_THAT(rebuilt.error, AllOf(HasSubstr("no method gave a result"), Not(HasSubstr("kept"))));
  // The same names and tables, another image.
  const std::string image =
      sequence_.Path(fmt::format("mav0/cam1/data/{}.png", testing::ImageStamp(2)));
  std::ofstream(image, std::ios::binary | std::ios::app) << " ";
  EXPECT_THAT(Compare("--methods points").error, Not(HasSubstr("kept")));
}

TEST_F(CompareTest, DamagedRunsAreMadeAnew) {
  Compare("--methods points");
  const std::string runs = folder_.Path("report/runs");
  std::string folder;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(runs)) {
    if (entry.path().filename() == "run.json") folder = entry.path().parent_path().parent_path();
  }
  ASSERT_NE(folder, "");
  std::ofstream(folder + "/run/imu.csv", std::ios::app) << "1,2,damaged\n";
  const ProcessResult run = Compare("--methods points");
  EXPECT_THAT(run.error, AllOf(HasSubstr(folder + "/run: found damaged what was kept from before"),
                               Not(HasSubstr("--accept-changed"))));
  EXPECT_THAT(run.output, HasSubstr("points: a run has no pose at all"));
  EXPECT_THAT(Compare("--methods points").error, Not(HasSubstr("damaged")));

  std::ofstream(folder + "/map/map.json") << "{";
  EXPECT_THAT(Compare("--methods points").error, HasSubstr(folder + "/map: found damaged"));
  // What is left without its summary would be taken for files of another.
  std::filesystem::remove(folder + "/map/map.json");
  const ProcessResult map = Compare("--methods points");
  EXPECT_THAT(map.output,
              AllOf(HasSubstr("points: a run has no pose at all"), Not(HasSubstr("run 1 failed"))));
  EXPECT_TRUE(std::filesystem::exists(folder + "/map/map.json"));
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
