#include "apps/batch/workflow.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "data/core/error.h"
#include "data/io/file.h"
#include "tests/testing/temp_folder.h"

namespace slcmap::inline batch {}  // namespace slcmap::batch

namespace slcmap {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using testing::ReadText;
using ::testing::SizeIs;
using testing::TempFolder;

SiteRecording Recording(const std::string& name, const std::string& storey) {
  return {name, "/walks/" + name, {}, "A", storey, ""};
}

Site SiteOf(int count) {
  Site site;
  for (int i = 0; i < count; ++i) {
    site.recordings.push_back(Recording(std::string(1, static_cast<char>('a' + i)), ""));
  }
  return site;
}

const std::vector<std::string>& After(const std::vector<Job>& jobs, const std::string& name) {
  return std::ranges::find(jobs, name, &Job::name)->after;
}

TEST(SiteJobs, ManyMapsAreMergedAsATreeThatGrowsAtItsEnd) {
  EXPECT_EQ(PlanJobs(SiteOf(1)).size(), 1u);  // nothing to merge
  const std::vector<Job> jobs = PlanJobs(SiteOf(6)), more = PlanJobs(SiteOf(7));
  EXPECT_THAT(After(jobs, "merges/A~1.1"), ElementsAre("recordings/a", "recordings/b",
                                                       "recordings/c", "recordings/d", "places/A"));
  EXPECT_THAT(After(jobs, "merges/A"), ElementsAre("merges/A~1.1", "merges/A~1.2", "places/A"));
  EXPECT_THAT(After(jobs, "places/A"), SizeIs(6));
  EXPECT_EQ(After(more, "merges/A~1.1"), After(jobs, "merges/A~1.1"));
  EXPECT_EQ(PlanJobs(SiteOf(17)).size(), 17u + 1u + 4u + 2u + 1u - 1u);  // the 17th goes up alone
}

TEST(SiteJobs, StoreysAreMergedBeforeTheBuilding) {
  Site site;
  for (const auto& [name, storey] :
       {std::pair("a", "0"), {"b", "0"}, {"c", "1"}, {"d", "1"}, {"stairs", ""}}) {
    site.recordings.push_back(Recording(name, storey));
  }
  site.plans = {{"A", "1", "/plan.png", 0.01}};
  site.exports = {"ifc"};
  const std::vector<Job> jobs = PlanJobs(site);
  EXPECT_THAT(After(jobs, "merges/A+1"), ElementsAre("recordings/c", "recordings/d", "places/A"));
  EXPECT_THAT(After(jobs, "merges/A"),
              ElementsAre("merges/A+0", "merges/A+1", "recordings/stairs", "places/A"));
  EXPECT_THAT(After(jobs, "exports/A"), ElementsAre("merges/A"));
  EXPECT_THAT(After(jobs, "exports/A+1"), ElementsAre("merges/A+1"));
}

TEST(SiteJobs, NamesOfPeopleAreNoFoldersOfJobs) {
  Site site;
  for (const auto& [name, storey] : {std::pair("a", "EG"), {"b", "EG"}, {"c", "1. OG"}}) {
    site.recordings.push_back(Recording(name, storey));
    site.recordings.back().building = "Büro Süd";
  }
  site.control = {{"Büro Süd", "/points.csv", ""}};
  const std::string folder = FolderName("Büro Süd");
  const std::vector<Job> jobs = PlanJobs(site);
  EXPECT_THAT(After(jobs, "merges/" + folder + "+EG"),
              ElementsAre("recordings/a", "recordings/b", "places/" + folder));
  EXPECT_THAT(After(jobs, "exports/" + folder), ElementsAre("merges/" + folder));
}

// Two recordings and their merge, as jobs leave them.
class SiteFolder : public ::testing::Test {
 protected:
  SiteFolder() {
    workflow_.program = "/usr/bin/slcmap";
    workflow_.site = SiteOf(2);
    workflow_.jobs = PlanJobs(workflow_.site);
    for (Job& job : workflow_.jobs) {
      if (IsRecordingJob(job)) job.key = "key of " + job.name;
    }
    MakeFolder(folder_.Path("workflow"));
  }

  void Finish(const std::string& name, JobState state, const std::string& map_id) {
    JobResult result;
    result.state = state;
    result.key = ComputeJobKey(folder_.Path(), workflow_, workflow_.Find(name));
    if (state == JobState::kDone) {
      folder_.Write(name + "/map/map.json", "{\"id\": \"" + map_id + "\"}");
      result.maps = {{name + "/map", {name.substr(name.find('/') + 1)}}};
      result.verdict = "good";
      result.length_m = 12.345;
    } else {
      result.reason = "imu-dead: found <nothing>";
      result.remedy = "mend it";
    }
    WriteJobResult(folder_.Path(name), result);
  }

  bool IsDone(const std::string& name) const {
    return IsCurrent(folder_.Path(), workflow_, workflow_.Find(name));
  }

  const TempFolder folder_;
  Workflow workflow_;
};

TEST_F(SiteFolder, ComesBackAsWritten) {
  workflow_.site.recordings[1].opened.cameras = {0, 2};
  workflow_.site.recordings[1].opened.topics = "left=/a,imu=/c";
  workflow_.jobs.back().plan = SitePlan{"", "", "/plan.png", 0.0125};
  WriteWorkflow(folder_.Path(), workflow_);
  const Workflow read = ReadWorkflow(folder_.Path());
  EXPECT_EQ(read.FindRecording("b").opened.cameras, workflow_.site.recordings[1].opened.cameras);
  EXPECT_EQ(read.FindRecording("b").opened.topics, "left=/a,imu=/c");
  EXPECT_EQ(read.Find("merges/A").after, workflow_.Find("merges/A").after);
  EXPECT_EQ(read.jobs.back().plan->pixel_m, 0.0125);
  EXPECT_THROW(read.Find("merges/B"), DataError);
}

TEST_F(SiteFolder, AResultIsKeptWhileWhatItIsMadeOfIsTheSame) {
  EXPECT_FALSE(IsDone("recordings/a"));
  Finish("recordings/a", JobState::kDone, "1");
  Finish("recordings/b", JobState::kDone, "2");
  Finish("merges/A", JobState::kDone, "3");
  EXPECT_TRUE(IsDone("recordings/a"));
  EXPECT_TRUE(IsDone("merges/A"));
  folder_.Write("recordings/b/map/map.json", "{\"id\": \"4\"}");
  EXPECT_FALSE(IsDone("merges/A"));
  workflow_.jobs.front().key = "another calibration";
  EXPECT_FALSE(IsDone("recordings/a"));
}

TEST_F(SiteFolder, WhatFailedOrIsDamagedOrGoneIsDoneAgain) {
  Finish("recordings/a", JobState::kFailed, "");
  EXPECT_FALSE(IsDone("recordings/a"));
  Finish("recordings/b", JobState::kDone, "2");
  std::filesystem::remove_all(folder_.Path("recordings/b/map"));
  EXPECT_FALSE(IsDone("recordings/b"));
  Finish("recordings/b", JobState::kDone, "2");
  folder_.Write("recordings/b/result.json", "{");
  EXPECT_FALSE(IsDone("recordings/b"));
}

TEST_F(SiteFolder, StatusTellsStatesReasonsAndMaps) {
  EXPECT_THAT(StatusTable(ReadStatus(folder_.Path(), workflow_)), HasSubstr("waiting"));
  Finish("recordings/a", JobState::kDone, "1");
  Finish("recordings/b", JobState::kFailed, "");
  Finish("merges/A", JobState::kDone, "3");
  const SiteStatus status = ReadStatus(folder_.Path(), workflow_);
  EXPECT_EQ(status.recordings[0].map, "recordings/a/map");
  EXPECT_EQ(status.recordings[1].map, "");
  EXPECT_EQ(status.Failures(), "1 of 2 recordings failed, first b: imu-dead: found <nothing>");
  EXPECT_THAT(StatusTable(status), AllOf(HasSubstr("good     12.3        recordings/a/map\n"),
                                         HasSubstr("found <nothing>; remedy: mend it\n")));
  const auto json = nlohmann::json::parse(StatusJson(status));
  EXPECT_EQ(json.at("recordings").at(1).at("state"), "failed");
  EXPECT_EQ(json.at("jobs").at(1).at("job"), "merges/A");
  EXPECT_THAT(StatusPage(status),
              AllOf(HasSubstr("found &lt;nothing&gt;"), Not(HasSubstr("<script"))));
}

TEST_F(SiteFolder, MergesAreDoneAnewWhereMapsLieElsewhereNow) {
  Finish("recordings/a", JobState::kDone, "1");
  Finish("recordings/b", JobState::kDone, "2");
  folder_.Write("places/A/placement.json", "{}");
  Finish("merges/A", JobState::kDone, "3");
  EXPECT_TRUE(IsDone("merges/A"));
  folder_.Write("places/A/placement.json", "{ }");
  EXPECT_FALSE(IsDone("merges/A"));
}

TEST_F(SiteFolder, OtherControlPointsAreAReasonToExportAgain) {
  workflow_.site.control = {{"A", folder_.Write("control.csv", "1"), "EPSG:25832"}};
  workflow_.jobs = PlanJobs(workflow_.site);
  const Job& job = workflow_.Find("exports/A");
  const std::string key = ComputeJobKey(folder_.Path(), workflow_, job);
  folder_.Write("control.csv", "2");
  EXPECT_NE(ComputeJobKey(folder_.Path(), workflow_, job), key);
  WriteWorkflow(folder_.Path(), workflow_);
  EXPECT_EQ(ReadWorkflow(folder_.Path()).site.control.at(0).crs, "EPSG:25832");
}

TEST_F(SiteFolder, ChangesComeBackAndAreInThePage) {
  JobResult result;
  result.state = JobState::kDone;
  result.key = ComputeJobKey(folder_.Path(), workflow_, workflow_.Find("places/A"));
  result.changes = Json::parse(R"([{"what": "wall", "is_new": false, "after": "2026-01-05",
      "by": "2026-03-01", "world_of": "a", "middle_m": [1, 2, 1.5], "size_m": [3, 0.1, 2.5]}])");
  WriteJobResult(folder_.Path("places/A"), result);
  EXPECT_EQ(ReadJobResult(folder_.Path("places/A")).value().changes, result.changes);
  SiteStatus status = ReadStatus(folder_.Path(), workflow_);
  EXPECT_THAT(StatusPage(status),
              AllOf(HasSubstr("<td>wall</td><td>gone</td><td>2026-01-05</td><td>2026-03-01</td>"),
                    HasSubstr("3.00 x 0.10 x 2.50"), HasSubstr("the world of a")));
  EXPECT_THAT(StatusTable(status), HasSubstr("wall  gone  2026-01-05  2026-03-01  1.00, 2.00"));
  status.others.front().result.changes[0]["crs"] = "EPSG:25832";
  EXPECT_THAT(StatusTable(status),
              AllOf(HasSubstr("3.00 x 0.10 x 2.50  EPSG:25832\n"), Not(HasSubstr("world"))));
}

TEST_F(SiteFolder, WhatAJobMadeIsToldByItsPlaceAndLinked) {
  JobResult result;
  result.state = JobState::kDone;
  result.key = ComputeJobKey(folder_.Path(), workflow_, workflow_.Find("merges/A"));
  result.maps = {{"merges/A/1", {"a"}, 5, 7, 4.12}, {"merges/A/2", {"b"}}};
  WriteJobResult(folder_.Path("merges/A"), result);
  folder_.Write("merges/A/1.html", "");
  folder_.Write("merges/A/export-1.log", "");
  folder_.Write("workflow/log/merges/A.log", "");
  const SiteStatus status = ReadStatus(folder_.Path(), workflow_);
  EXPECT_THAT(
      StatusTable(status),
      HasSubstr("merges/A/1 (of a; on 5 of 7 control points, 4.1 mm RMS), merges/A/2 (of b)"));
  EXPECT_THAT(
      StatusPage(status),
      AllOf(HasSubstr("<a href=\"merges/A/1\">merges/A/1</a> (of a; on 5 of 7 control points"),
            HasSubstr("<a href=\"merges/A/1.html\">1.html</a>"),
            HasSubstr("<a href=\"merges/A/export-1.log\">"),
            HasSubstr("<a href=\"workflow/log/merges/A.log\">")));
  const auto map = nlohmann::json::parse(StatusJson(status)).at("jobs").at(1).at("maps").at(0);
  EXPECT_EQ(map.at("points_used"), 5);
  EXPECT_EQ(map.at("points_given"), 7);
  EXPECT_EQ(map.at("rms_mm"), 4.12);
}

}  // namespace
}  // namespace slcmap
