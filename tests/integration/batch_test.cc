// slcmap batch, and its jobs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>
#include <unistd.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "apps/batch/workflow.h"
#include "data/io/file.h"
#include "mapping/map/map_folder.h"
#include "odometry/run/run_folder.h"
#include "tests/integration/slcmap_process.h"
#include "tests/testing/made_run.h"
#include "tests/testing/reader_program.h"
#include "tests/testing/scanned_map.h"
#include "tests/testing/small_scenes.h"
#include "tests/testing/small_sequence.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::ElementsAre;
using testing::ExpectError;
using testing::ExpectSuccess;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::ProcessResult;
using testing::ReadText;
using testing::RunShell;
using testing::RunSlcmap;
using testing::TempFolder;

JobResult DoneWith(const std::string& key, const std::vector<JobMap>& maps) {
  JobResult result;
  result.key = key;
  result.state = JobState::kDone;
  result.verdict = "good";
  result.maps = maps;
  return result;
}

// A site's folder, whose jobs are started one by one, as Snakemake does it.
class BatchJob : public ::testing::Test {
 protected:
  // A recording whose map is there.
  void AddMapped(const std::string& name, const std::string& storey, const MapResult& map) {
    workflow_.site.recordings.push_back({name, "/walks/" + name, {}, "A", storey, ""});
    WriteMapFolder(site_.Path("recordings/" + name + "/map"), map);
    WriteJobResult(site_.Path("recordings/" + name),
                   DoneWith("", {{"recordings/" + name + "/map", {name}}}));
  }

  ProcessResult Do(const std::string& job) {
    workflow_.jobs = PlanJobs(workflow_.site);
    MakeFolder(site_.Path("workflow"));
    WriteWorkflow(site_.Path(), workflow_);
    return RunShell("cd " + site_.Path() + " && \\$SLCMAP batch . --job " + job);
  }

  JobResult Result(const std::string& job) const { return ReadJobResult(site_.Path(job)).value(); }

  // Of two walks through one room.
  void AddTwo(const std::string& first_storey, const std::string& second_storey) {
    static const Scene room = testing::RoomWithBoxes("[5, 4]", "[[0, 0], [5, 0], [5, 4], [0, 4]]");
    static const MapResult a = testing::ScannedMap(room, {{1.5, 2, 1.5}, {3.5, 2.2, 1.5}});
    static const MapResult b = testing::ScannedMap(room, {{3, 1.5, 1.5}, {2, 2.5, 1.5}},
                                                   LevelTransform(0.7, {2, 1, 0.1}), "b");
    AddMapped("a", first_storey, a);
    AddMapped("b", second_storey, b);
  }

  const TempFolder site_;
  Workflow workflow_;
};

TEST_F(BatchJob, MapsThatFitAreMergedAndOthersStayApart) {
  AddTwo("", "");
  AddMapped("other", "",
            testing::ScannedMap(
                testing::RoomWithBoxes("[9, 7]", "[[0, 0], [9, 0], [9, 3], [6, 7], [0, 7]]"),
                {{5, 5, 1.5}, {6, 2, 1.5}}, {}, "c"));
  const ProcessResult placed = Do("places/A"), merged = Do("merges/A");
  EXPECT_EQ(merged.exit_code, 0) << merged.error;
  const JobResult result = Result("merges/A");
  ASSERT_EQ(result.maps.size(), 2u) << placed.error << merged.error << result.reason;
  EXPECT_THAT(result.maps[0].recordings, ElementsAre("a", "b"));
  EXPECT_EQ(ReadMapFolder(site_.Path(result.maps[0].path)).source.merged.size(), 2u);
  EXPECT_EQ(result.maps[1].path, "recordings/other/map");
  const std::vector<MapsApart> apart = Result("places/A").apart;
  ASSERT_EQ(apart.size(), 2u);
  EXPECT_EQ(apart[0].second, "recordings/other/map");
  EXPECT_THAT(apart[0].reason, HasSubstr("expected"));
  EXPECT_THAT(Do("merges/A").error, HasSubstr("merges/A: kept from before"));
}

// They would be one map without a word else.
TEST_F(BatchJob, LookAlikeStoreysAreNotLaidOnEachOther) {
  AddTwo("ground", "first");
  EXPECT_EQ(Do("places/A").exit_code, 0);
  EXPECT_EQ(Do("merges/A").exit_code, 0);
  EXPECT_EQ(Result("merges/A").maps.size(), 2u) << Result("merges/A").reason;
  const JobResult result = Result("places/A");
  ASSERT_EQ(result.apart.size(), 1u);
  EXPECT_THAT(result.apart[0].reason,
              AllOf(HasSubstr("a of storey ground and b of storey first 0.0"),
                    HasSubstr("expected more than 1.5 m")));
  EXPECT_FALSE(fs::exists(site_.Path("merges/A/map-1")));
}

TEST_F(BatchJob, AMergeTakesWhatIsThereAndNeedsSome) {
  AddTwo("", "");
  EXPECT_EQ(Do("merges/A").exit_code, 0);
  EXPECT_THAT(Result("merges/A").reason, HasSubstr("found no places/A"));
  JobResult failed;
  failed.reason = "imu-dead";
  WriteJobResult(site_.Path("recordings/b"), failed);
  EXPECT_EQ(Do("merges/A").exit_code, 0);
  EXPECT_EQ(Result("merges/A").maps.front().path, "recordings/a/map");
  WriteJobResult(site_.Path("recordings/a"), failed);
  EXPECT_EQ(Do("merges/A").exit_code, 0);
  EXPECT_EQ(Result("merges/A").state, JobState::kFailed);
}

TEST_F(BatchJob, AMapThatWasBegunGoesOnBehindItsRunAndIsExported) {
  workflow_.site.recordings = {{"w", "/walks/w", {}, "A", "", ""}};
  workflow_.site.exports = {"ply"};
  WriteRunFolder(site_.Path("recordings/w/run"), testing::MakeWallRun());
  JobResult begun = DoneWith("", {});
  begun.state = JobState::kBegun;
  WriteJobResult(site_.Path("recordings/w"), begun);
  const ProcessResult mapped = Do("recordings/w");
  EXPECT_EQ(Result("recordings/w").state, JobState::kDone) << Result("recordings/w").reason;
  EXPECT_FALSE(fs::exists(site_.Path("recordings/w/odometry.log")));
  EXPECT_EQ(Do("exports/A").exit_code, 0);
  EXPECT_TRUE(fs::exists(site_.Path("exports/A/1/export.json"))) << Result("exports/A").reason;
}

TEST_F(BatchJob, AMapThatCannotBeExportedOrNamedDoesNotStopOthers) {
  AddTwo("", "");
  workflow_.site.exports = {"ply"};
  workflow_.site.names = site_.Write("names.yaml", "crs: EPSG:25832\nbuildings: [{name: Süd}]\n");
  const JobMap a{"recordings/a/map", {"a"}}, b{"recordings/b/map", {"b"}};
  WriteJobResult(site_.Path("merges/A"), DoneWith("", {b, a}));
  EXPECT_EQ(Do("exports/A").exit_code, 0);
  const JobResult unnamed = Result("exports/A");
  EXPECT_EQ(unnamed.state, JobState::kDone);
  EXPECT_THAT(unnamed.reason, AllOf(HasSubstr("b: exported without names: "),
                                    HasSubstr("; a: exported without names: ")));
  ASSERT_EQ(unnamed.maps.size(), 2u);
  EXPECT_EQ(unnamed.maps[0].path, "exports/A/1");
  EXPECT_EQ(unnamed.maps[1].path, "exports/A/2");

  fs::remove_all(site_.Path("exports/A"));
  workflow_.site.names = "";
  site_.Write("recordings/b/map/trajectory.tum", "damaged");
  EXPECT_EQ(Do("exports/A").exit_code, 0);
  const JobResult result = Result("exports/A");
  EXPECT_EQ(result.state, JobState::kFailed);
  EXPECT_THAT(result.reason, AllOf(HasSubstr("b: "), Not(HasSubstr("a: "))));
  EXPECT_TRUE(fs::exists(site_.Path("exports/A/2/export.json"))) << result.reason;
}

TEST_F(BatchJob, ABuildingThatControlDoesNotPlaceIsExportedAndFails) {
  AddTwo("ground", "ground");
  workflow_.site.recordings.pop_back();
  workflow_.site.exports = {"ply"};
  workflow_.site.control = {
      {"A", site_.Write("points.csv", "name,easting,northing,height\nT1,691604,5334750,515\n"),
       ""}};
  EXPECT_EQ(Do("exports/A").exit_code, 0);
  const JobResult result = Result("exports/A");
  EXPECT_EQ(result.state, JobState::kFailed);
  EXPECT_NE(result.reason, "");
  EXPECT_TRUE(fs::exists(site_.Path("exports/A/1/export.json"))) << result.reason;
}

TEST_F(BatchJob, ARecordingThatFailsSaysWhyAndIsNoError) {
  const TempFolder walk;
  testing::WriteSequence(walk, {});
  workflow_.site.recordings = {{"w", walk.Path(), {}, "A", "", ""}};
  EXPECT_EQ(Do("recordings/w").exit_code, 0);
  const JobResult result = Result("recordings/w");
  EXPECT_EQ(result.state, JobState::kFailed);
  EXPECT_NE(result.reason, "");
  EXPECT_NE(result.remedy, "");
  EXPECT_TRUE(result.maps.empty());
  ExpectError(Do("recordings/none"), 1, "found no job recordings/none");
}

// Two recordings, too short to be mapped, and one that is mapped but for its map.
class BatchCommand : public ::testing::Test {
 protected:
  BatchCommand() {
    for (const char* name : {"a", "b"}) {
      const TempFolder made;
      testing::WriteSequence(made, {.images = *name == 'a' ? 5 : 6});
      fs::create_directories(walks_.Path());
      fs::copy(made.Path(), walks_.Path(name), fs::copy_options::recursive);
    }
    walks_.Write("site.yaml", "recordings: [{path: a}, {path: b}]\nexports: [ply]\n");
  }

  // Snakemake asks Slurm once a second instead of once in ten.
  std::string Command(const std::string& rest = "") const {
    return "CI=true \\$SLCMAP -q batch " + walks_.Path("site.yaml") + " -o " + site_ + " " + rest;
  }
  ProcessResult Batch(const std::string& rest = "") const { return RunShell(Command(rest)); }

  // As if the job of the recording had been killed while it made the map.
  void BeginMap(const std::string& name) const {
    const Workflow workflow = ReadWorkflow(site_);
    const std::string own = site_ + "/recordings/" + name;
    fs::remove_all(own);
    WriteRunFolder(own + "/run", testing::MakeWallRun());
    JobResult begun = DoneWith(workflow.Find("recordings/" + name).key, {});
    begun.state = JobState::kBegun;
    WriteJobResult(own, begun);
  }

  nlohmann::json Status() const { return nlohmann::json::parse(ReadText(site_ + "/status.json")); }

  const TempFolder walks_, folder_;
  const std::string site_ = folder_.Path("site");
};

TEST_F(BatchCommand, WrongUsageIsToldBeforeAnythingRuns) {
  ExpectError("batch " + walks_.Path("site.yaml"), 2, "--output");
  ExpectError("batch " + walks_.Path("none.yaml") + " -o " + site_, 2, "none.yaml");
  ExpectError("batch " + walks_.Path("site.yaml") + " -o " + walks_.Path("a/x"), 2,
              "found the input");
  ExpectError("batch " + walks_.Path("site.yaml") + " -o " + walks_.Path(), 2, "no site's folder");
  ExpectError("batch " + site_ + " --status", 2, "config.json");
  walks_.Write("site.yaml", "recordings: [{path: a}]\nmethod: beauty\n");
  ExpectError(Batch(), 2, "beauty");
  walks_.Write("site.yaml", "recordings: [{path: a}]\nnames: site.yaml\n");
  ExpectError(Batch(), 2, "site.yaml: recordings: unknown key");
  EXPECT_FALSE(fs::exists(site_));
}

TEST_F(BatchCommand, WithoutSnakemakeItSaysWhatToInstall) {
  const ProcessResult result = RunShell("PATH=/none " + Command().substr(8));
  ExpectError(result, 2, "apt-get install snakemake");
}

TEST_F(BatchCommand, FailuresDoNotStopOthersAndAreTriedAgain) {
  SLCMAP_NEEDS_READER("snakemake");
  EXPECT_EQ(Batch("-n").exit_code, 0);
  BeginMap("b");
  const ProcessResult first = Batch();
  ExpectError(first, 1, "1 of 2 recordings failed, first a: ");
  EXPECT_THAT(first.output, HasSubstr("merges/building"));
  EXPECT_EQ(Status().at("recordings").at(1).at("map"), "recordings/b/map");
  EXPECT_TRUE(fs::exists(site_ + "/exports/building/1/export.json"));
  const std::string map = ReadText(site_ + "/recordings/b/map/map.json");
  const auto made = fs::last_write_time(site_ + "/recordings/b/map/map.json");

  BeginMap("a");  // with another result now, which is merged
  const ProcessResult second = RunSlcmap("batch " + walks_.Path("site.yaml") + " -o " + site_);
  EXPECT_THAT(second.error, HasSubstr("2 recordings, 4 of 5 jobs are to be done"));
  EXPECT_EQ(second.exit_code, 0) << second.error;
  EXPECT_EQ(fs::last_write_time(site_ + "/recordings/b/map/map.json"), made);
  EXPECT_THAT(RunSlcmap("batch " + walks_.Path("site.yaml") + " -o " + site_).error,
              HasSubstr("0 of 5 jobs are to be done"));
  ExpectSuccess("batch " + site_ + " --status");

  walks_.Write("b/mav0/cam0/sensor.yaml", testing::SensorYaml(0.01));
  EXPECT_THAT(RunSlcmap("-q batch " + walks_.Path("site.yaml") + " -o " + site_).error,
              HasSubstr("first b: "));
}

// The jobs wait for who holds a recording's folder.
TEST_F(BatchCommand, NothingIsLostWhereItIsKilledOrStartedTwice) {
  SLCMAP_NEEDS_READER("snakemake");
  EXPECT_EQ(Batch("-n").exit_code, 0);
  BeginMap("a");
  BeginMap("b");
  const std::string log = site_ + "/workflow/log/recordings/a.log";
  const ProcessResult result = RunShell(
      "flock " + site_ + "/recordings/a sleep 600 & holder=\\$!; " + Command() + " & batch=\\$!; " +
      "for i in {1..300}; do grep -q 'another process' " + log + " && break; sleep 0.1; done; " +
      Command() + "; echo \\\"second: \\$?\\\"; kill -9 \\$batch; " +
      // The Snakemake of the killed one goes on with its jobs.
      Command() + "; echo \\\"third: \\$?\\\"; " +
      "kill -9 \\$(cat /proc/\\$holder/task/\\$holder/children) \\$holder; wait; " +
      "for i in {1..300}; do " + Command() + " && echo last: done && break; sleep 0.2; done");
  EXPECT_THAT(result.output,
              AllOf(HasSubstr("second: 1"), HasSubstr("third: 1"), HasSubstr("last: done")));
  EXPECT_THAT(result.error, HasSubstr("in use"));
  for (const auto& recording : Status().at("recordings")) EXPECT_EQ(recording.at("state"), "done");
}

// A cluster of three nodes on this machine.
class SlurmCommand : public BatchCommand {
 protected:
  void TearDown() override { std::system((script_ + " stop " + cluster_.Path()).c_str()); }

  const TempFolder cluster_;
  const std::string script_ = SLCMAP_SOURCE_DIR "/tests/integration/slurm_on_one_host.sh";
};

TEST_F(SlurmCommand, GivesTheSameBytes) {
  SLCMAP_NEEDS_READER("snakemake");
  SLCMAP_NEEDS_READER("slurmctld");
  SLCMAP_NEEDS_READER("munged");
  if (geteuid() != 0) GTEST_SKIP() << "takes root, to start nodes";
  ASSERT_EQ(RunShell(script_ + " start " + cluster_.Path() + " 3 26950").exit_code, 0);
  const auto run = [&](const std::string& rest) {
    EXPECT_EQ(Batch("-n").exit_code, 0);
    BeginMap("b");
    ExpectError(RunShell("export SLURM_CONF=" + cluster_.Path("slurm.conf") + "; " + Command(rest)),
                1, "1 of 2 recordings failed");
    std::string text = ReadText(site_ + "/status.json");
    for (const char* file : {"recordings/b/map/map.json", "recordings/a/result.json"}) {
      text += ReadText(site_ + "/" + file);
    }
    fs::remove_all(site_);
    return text;
  };
  EXPECT_EQ(run("--profile slurm"), run(""));
}

}  // namespace
}  // namespace slcmap
