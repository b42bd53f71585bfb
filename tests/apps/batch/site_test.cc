#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/batch/workflow.h"
#include "data/core/error.h"
#include "tests/testing/small_sequence.h"

namespace slcmap::inline batch {}  // namespace slcmap::batch

namespace slcmap {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::MessageOf;
using testing::TempFolder;

class SiteFile : public ::testing::Test {
 protected:
  SiteFile() {
    for (const char* name : {"walks/a", "walks/b"}) {
      folder_.Write(std::string(name) + "/mav0/cam0/sensor.yaml", testing::SensorYaml(0));
      folder_.Write(std::string(name) + "/mav0/cam1/sensor.yaml", testing::SensorYaml(-0.1));
      folder_.Write(std::string(name) + "/mav0/cam0/data.csv", "");
      folder_.Write(std::string(name) + "/mav0/cam1/data.csv", "");
      folder_.Write(std::string(name) + "/mav0/imu0/sensor.yaml", testing::kImuYaml);
      folder_.Write(std::string(name) + "/mav0/imu0/data.csv", "");
    }
  }

  Site Read(const std::string& text) const { return ReadSite(folder_.Write("site.yaml", text)); }

  const TempFolder folder_;
};

TEST_F(SiteFile, APatternStandsForAllFoldersThatMatch) {
  folder_.Write("walks/notes.txt", "");
  const Site site = Read("recordings: [{path: walks/*, building: A, storey: 1}]\nmethod: points\n");
  ASSERT_EQ(site.recordings.size(), 2u);
  EXPECT_EQ(site.recordings[0].name, "a");
  EXPECT_EQ(site.recordings[1].path, std::filesystem::canonical(folder_.Path("walks/b")));
  EXPECT_EQ(site.recordings[1].storey, "1");
  EXPECT_EQ(site.method, "points");
}

TEST_F(SiteFile, ALinkIsNamedByItself) {
  std::filesystem::create_symlink(folder_.Path("walks/a"), folder_.Path("monday"));
  const Site site = Read("recordings: [{path: monday/}, {path: walks/b/../b/mav0}]\n");
  ASSERT_EQ(site.recordings.size(), 2u);
  EXPECT_EQ(site.recordings[0].name, "b");
  EXPECT_EQ(site.recordings[1].name, "monday");
  EXPECT_EQ(site.recordings[1].path, std::filesystem::canonical(folder_.Path("walks/a")));
}

TEST_F(SiteFile, BuildingsAndStoreysAreCalledAsPeopleCallThem) {
  const Site site =
      Read("recordings: [{path: walks/*, building: 'Büro Süd, A/B', storey: 1. OG}]\n");
  EXPECT_EQ(site.recordings.at(0).building, "Büro Süd, A/B");
  EXPECT_EQ(site.recordings.at(0).storey, "1. OG");
  EXPECT_THAT(FolderName("Büro Süd, A/B"), ::testing::MatchesRegex("B_ro_S_d__A_B-[0-9a-f]{6}"));
  EXPECT_NE(FolderName("北"), FolderName("南"));
  EXPECT_THAT(FolderName(".."), ::testing::StartsWith("_.-"));
  for (const char* name : {"", "A", "ground-floor_2.b"}) EXPECT_EQ(FolderName(name), name);
}

TEST_F(SiteFile, BagsHaveTopicsAndRecordingsListsOfCalibrations) {
  folder_.Write("walks/c.bag", "#ROSBAG V2.0\n");
  folder_.Write("rig.yaml", "");
  const Site site = Read(
      "recordings:\n- {path: walks/c.*, topics: 'left=/l,imu=/i', calibration: "
      "'rig.yaml,imu.yaml'}\n");
  ASSERT_EQ(site.recordings.size(), 1u);
  const SequenceOptions& opened = site.recordings[0].opened;
  EXPECT_EQ(opened.topics, "left=/l,imu=/i");
  const std::string folder = std::filesystem::canonical(folder_.Path());
  EXPECT_EQ(opened.calibration, folder + "/rig.yaml," + folder + "/imu.yaml");
}

TEST_F(SiteFile, RecordingsAreInTheOrderOfTheirDays) {
  const Site site = Read(
      "recordings:\n- {path: walks/a, date: 2026-03-02}\n- {path: walks/b, date: 2026-03-01}\n");
  EXPECT_EQ(site.recordings[0].name, "b");
}

TEST_F(SiteFile, ControlPointsAreOfABuildingAndCheckedBeforeAnythingRuns) {
  folder_.Write("a.csv", "name,easting,northing,height\nT1,691604.2,5334750.6,515.3\n");
  folder_.Write("swapped.csv", "name,easting,northing,height\nT1,5334750.6,691604.2,515.3\n");
  const std::string walks = "recordings: [{path: walks/*, building: A}]\n";
  const auto entry = [](const std::string& rest) {
    return "{building: A, crs: 'EPSG:25832', points: " + rest + "}";
  };
  const Site site = Read(walks + "control: [" + entry("a.csv") + "]\n");
  ASSERT_NE(FindControl(site, "A"), nullptr);
  EXPECT_EQ(FindControl(site, "A")->points, std::filesystem::canonical(folder_.Path("a.csv")));
  EXPECT_EQ(FindControl(site, "B"), nullptr);
  for (const auto& [control, words] :
       {std::pair("{building: B, points: a.csv}", "control[0].building: found B"),
        {"{building: A, points: none.csv}", "none.csv"},
        {"{building: A}, {building: A}", "control[1]: found a second one of A"}}) {
    EXPECT_THAT(MessageOf<ConfigError>([&] { Read(walks + "control: [" + control + "]\n"); }),
                HasSubstr(words));
  }
  EXPECT_THAT(
      MessageOf<ConfigError>([&] { Read(walks + "control: [" + entry("swapped.csv") + "]\n"); }),
      AllOf(HasSubstr("control[0]: "), HasSubstr("swapped.csv")));
}

TEST_F(SiteFile, OneWalkUnderTwoNamesIsNamed) {
  for (const char* name : {"walks/a", "walks/b"}) {
    folder_.Write(std::string(name) + "/mav0/cam0/data.csv", "#timestamp [ns],filename\n1,1.png\n");
    folder_.Write(std::string(name) + "/mav0/imu0/data.csv", testing::ImuRow(1) + "\n");
  }
  const std::string text = "recordings: [{path: walks/*}]\n";
  EXPECT_THAT(MessageOf<ConfigError>([&] { Read(text); }), HasSubstr("found b to be a copy of a"));
  folder_.Write("walks/b/mav0/imu0/data.csv", testing::ImuRow(2) + "\n");
  EXPECT_EQ(Read(text).recordings.size(), 2u);
}

TEST_F(SiteFile, WhatIsWrongIsNamed) {
  const std::pair<const char*, const char*> kWrong[] = {
      {"method: slc\n", "recordings: found none"},
      {"recording: []\n", "recording: unknown key; did you mean 'recordings'?"},
      {"recordings: [{path: walks/a, story: 1}]\n", "story: unknown key"},
      {"recordings: [{name: a}]\n", "recordings[0].path: found none"},
      {"recordings: [walks/a]\n", "expected keys with values"},
      {"recordings: [{path: walks/none}]\n", "walks/none"},
      {"recordings: [{path: none/*}]\n", "recordings[0].path: found no folder like none/*"},
      {"recordings: [{path: walks}]\n", "recording walks: "},
      {"recordings: [{path: walks/a, calibration: none.yaml}]\n", "none.yaml"},
      {"recordings: [{path: walks/a}, {path: walks/../walks/a, name: c}]\n", "walks/a twice"},
      {"recordings: [{path: walks/a}, {path: walks/b, name: a}]\n", "two of the name a"},
      {"recordings: [{path: walks/*, name: a}]\n", "found 'a' for 2 recordings"},
      {"recordings: [{path: walks/a, name: a/b}]\n", "name: found 'a/b'"},
      {"recordings: [{path: walks/a, name: Süd}]\n", "'Süd', expected up to 80 of a-z"},
      {"recordings: [{path: walks/a, building: ''}]\n", "building: found ''"},
      {"recordings: [{path: walks/a, storey: \"1\\n2\"}]\n", "expected a line of UTF-8"},
      {"recordings: [{path: walks/a, storey: '\xfc'}]\n", "site.yaml"},
      {"recordings: [{path: walks/a, date: today}]\n", "date: found 'today'"},
      {"recordings: [{path: walks/a}]\nplans: [{image: p.png, pixel_m: 0.01}]\n", "p.png"},
      {"recordings: [{path: walks/a}]\nplans: [{image: site.yaml}]\n", "pixel_m: found 0"},
      {"recordings: [{path: walks/a}]\nplans: [{storey: x, image: site.yaml, pixel_m: 0.1}]\n",
       "storey x, of which no recording is"},
  };
  for (const auto& [text, words] : kWrong) {
    SCOPED_TRACE(text);
    EXPECT_THAT(MessageOf<ConfigError>([&] { Read(text); }),
                AllOf(HasSubstr("site.yaml: "), HasSubstr(words)));
  }
}

TEST_F(SiteFile, AllThatIsWrongIsNamedAtOnce) {
  std::filesystem::remove(folder_.Path("walks/b/mav0/cam0/sensor.yaml"));
  EXPECT_THAT(
      MessageOf<ConfigError>([&] { Read("recordings: [{path: none}, {path: walks/*}]\n"); }),
      AllOf(HasSubstr("recording none: "), HasSubstr("recording b: ")));
}

}  // namespace
}  // namespace slcmap
