#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <tuple>

#include "data/core/error.h"
#include "data/io/file.h"
#include "data/io/ply.h"
#include "tests/testing/small_run_folder.h"

namespace slcmap {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

class RunFolderDamageTest : public testing::SmallRunFolder {};

TEST_F(RunFolderDamageTest, MissingFilesAreNamed) {
  for (const char* name :
       {"trajectory.tum", "states.csv", "keyframes.csv", "observations.csv", "points.ply",
        "rig.json", "timings.json", "run.json", "imu.csv", "raw_rig.json", "options.yaml",
        "images.csv", "lines.ply", "calibration.csv", "lines.csv", "line_observations.csv",
        "line_points.csv"}) {
    std::filesystem::remove_all(folder_);
    WriteRunFolder(folder_, testing::MakeSmallRun());
    std::filesystem::remove(folder_ + "/" + name);
    ExpectReadError(name, folder_);
  }
}

// Makes row 2 of a table, the first below the columns, another one.
struct Damage {
  const char* file;
  const char* row;
  const char* message;
};

TEST_F(RunFolderDamageTest, DamagedRowsAreNamed) {
  const std::string pose = ",0,0,0,0,0,0,1", rest = ",0,0,0,0,0,0,0,0,0";
  const std::string far = "3,0" + std::string(",1e30,0,0,0,0,0,1") + rest,
                    fast = "3,0" + pose + ",1e30,0,0,0,0,0,0,0,0",
                    late = "1403636579763555584,0" + pose + rest,
                    unit = "3,0,0,0,0,0.5,0.5,0,0.5" + rest, twice = "9,0,5" + pose;
  const Damage damages[] = {
      {"states.csv", far.c_str(), "x_m: found '1e30', expected -1000000 to 1000000"},
      {"states.csv", fast.c_str(), "vx_m_s: found '1e30'"},
      {"states.csv", unit.c_str(), "expected a quaternion of length 1"},
      {"states.csv", "3,-1", "found 2 columns, expected 18"},
      {"keyframes.csv", "-7,0,5,0,0,0,0,0,0,1", "id: found '-7', expected 0 to 2147483647"},
      {"observations.csv", "7,1,abc,2,nan,nan", "left_x_px: found 'abc', expected a finite number"},
      {"observations.csv", "7,1,nan,2,nan,nan", "left_x_px: found 'nan'"},
      {"observations.csv", "7,1,1e9,2,nan,nan", "left_x_px: found '1e9'"},
      {"observations.csv", "7,1,1,2,3,nan", "nan in all of the right image's columns or in none"},
      {"observations.csv", "8,1,1,2,nan,nan", "keyframe_id: found '8'"},
      {"imu.csv", "5,0,0,1e3,0,0,0", "wz_rad_s: found '1e3', expected -100 to 100"}};
  for (const Damage& damage : damages) {
    WriteRunFolder(folder_, testing::MakeSmallRun());
    std::string text = ReadFile(folder_ + "/" + damage.file);
    const std::size_t start = text.find('\n') + 1;
    text.replace(start, text.find('\n', start) - start, damage.row);
    WriteFile(folder_ + "/" + damage.file, text);
    ExpectReadError(std::string(damage.file) + ": row 2: ", damage.message);
    // The same where changes are accepted: values are checked in any case.
    EXPECT_THAT([&] { ReadRunFolder(folder_, {.accept_changed = true}); },
                ThrowsMessage<DataError>(HasSubstr(damage.message)));
  }
  WriteRunFolder(folder_, testing::MakeSmallRun());
  WriteFile(folder_ + "/observations.csv", "a,b\n");
  ExpectReadError("observations.csv: row 1", "found the columns 'a,b'");
}

TEST_F(RunFolderDamageTest, RowsThatContradictOthersAreNamed) {
  for (const auto& [file, what] :
       {std::pair("states.csv",
                  "stamp_ns: found '1403636579763555584', expected a stamp after "
                  "1403636579963555584"),
        std::pair("keyframes.csv", "id: found '7', expected an id that no row before it has"),
        std::pair("observations.csv", "landmark_id: found '1', expected an id that no row"),
        std::pair("imu.csv", "stamp_ns: found '5', expected a stamp after 6")}) {
    WriteRunFolder(folder_, testing::MakeSmallRun());
    const std::string path = folder_ + "/" + file, text = ReadFile(path);
    const std::size_t first = text.find('\n') + 1;
    WriteFile(path, text + text.substr(first, text.find('\n', first) + 1 - first));
    ExpectReadError(std::string(file) + ": row ", what);
  }
}

TEST_F(RunFolderDamageTest, ChangedFilesAreRefusedUnlessAccepted) {
  WriteRunFolder(folder_, testing::MakeSmallRun());
  const std::string path = folder_ + "/observations.csv", text = ReadFile(path);
  WriteFile(path, text.substr(0, text.rfind("7,2,")));
  ExpectReadError(folder_ + ": found 1 observations, expected 2 as in run.json",
                  "--accept-changed");
  EXPECT_EQ(ReadRunFolder(folder_, {.accept_changed = true}).keyframes[0].observations.size(), 1u);
  std::string moved = text;
  moved.replace(text.find("10.5"), 4, "11.5");
  WriteFile(path, moved);
  ExpectReadError("observations.csv: found ", "expected ");
  WriteFile(path, text);
  // The file of another run does not belong here.
  OdometryRun other = testing::MakeSmallRun();
  other.landmarks[0].sigma_m = 0.25;
  WriteRunFolder(temp_.Path("other"), other);
  std::filesystem::copy_file(temp_.Path("other/points.ply"), folder_ + "/points.ply",
                             std::filesystem::copy_options::overwrite_existing);
  ExpectReadError("points.ply: found ", "as in run.json: written by another run or changed since");
}

// Runs of the same version from before it was estimated.
TEST_F(RunFolderDamageTest, ARunWithoutItsCalibrationIsRead) {
  WriteRunFolder(folder_, testing::MakeSmallRun());
  std::filesystem::remove(folder_ + "/calibration.csv");
  EXPECT_TRUE(ReadRunFolder(folder_, {.accept_changed = true}).calibration.empty());
}

// Nothing depends on it.
TEST_F(RunFolderDamageTest, DamagedTimingsAreLeftOutWhereChangesAreAccepted) {
  WriteRunFolder(folder_, testing::MakeSmallRun());
  for (const char* text : {"{\"cpu_s\": -1}", "{", ""}) {
    WriteFile(folder_ + "/timings.json", text);
    ExpectReadError("timings.json: ", "expected");
    const OdometryRun read = ReadRunFolder(folder_, {.accept_changed = true});
    EXPECT_EQ(read.states.size(), 5u);
    EXPECT_EQ(read.warnings.at("timings_unreadable"), 1);
    EXPECT_EQ(read.timings.cpu_s, 0);
  }
}

TEST_F(RunFolderDamageTest, AbsurdCorrectionsOfTheCalibrationAreRefused) {
  WriteRunFolder(folder_, testing::MakeSmallRun());
  const std::string path = folder_ + "/calibration.csv", text = ReadFile(path);
  for (const auto& [from, to, what] :
       {std::tuple(",-0.0125,", ",900,", "time_offset_s: found '900', expected -10 to 10"),
        std::tuple(",-0.02,", ",-4,", "imu_rotation_y_rad: found '-4', expected -3.2 to 3.2"),
        std::tuple(",0.002,", ",200,", "lever_y_m: found '200', expected -100 to 100"),
        std::tuple(",0.004,", ",4,", "right_rotation_x_rad: found '4', expected -3.2 to 3.2"),
        std::tuple(",0.0035,", ",-2,", "focal_length: found '-2', expected -0.9 to 0.9")}) {
    std::string damaged = text;
    ASSERT_NE(text.find(from), text.npos) << from;
    damaged.replace(text.find(from), std::string(from).size(), to);
    WriteFile(path, damaged);
    EXPECT_THAT([&] { ReadRunFolder(folder_, {.accept_changed = true}); },
                ThrowsMessage<DataError>(HasSubstr(what)));
  }
}

TEST_F(RunFolderDamageTest, TheSummaryCountsPointsOfShortLives) {
  WriteRunFolder(folder_, testing::MakeSmallRun());
  const std::string text = ReadFile(folder_ + "/run.json");
  EXPECT_THAT(text, AllOf(HasSubstr("\"points\": 2"), HasSubstr("\"seen_once\": 2")));
}

TEST_F(RunFolderDamageTest, AChangedSummaryIsRefused) {
  WriteRunFolder(folder_, testing::MakeSmallRun());
  const std::string path = folder_ + "/run.json", text = ReadFile(path);
  const auto change = [&](const std::string& from, const std::string& to) {
    std::string changed = text;
    ASSERT_NE(text.find(from), std::string::npos) << from;
    changed.replace(text.find(from), from.size(), to);
    WriteFile(path, changed);
  };
  change("\"method\": \"points\"", "\"method\": \"plane\"");
  ExpectReadError("run.json: method: found 'plane'", "expected points-mono");
  change("\"imu_gap\": 2", "\"imu_gap\": -2");
  ExpectReadError("run.json: warnings: imu_gap: found -2", "at least 0");
  change("\"imu_gap\": 2", "\"imu_gap\": 3");
  ExpectReadError("run.json: found checksum", "--accept-changed");
  change("\"states\": 5", "\"states\": 6");
  ExpectReadError("found 5 states, expected 6", "run.json");
}

TEST_F(RunFolderDamageTest, DamagedPlyAndJsonAreNamed) {
  WriteRunFolder(folder_, testing::MakeSmallRun());
  const std::string points = folder_ + "/points.ply";
  std::string bytes = ReadFile(points);
  bytes.resize(bytes.size() - 5);
  WriteFile(points, bytes);
  ExpectReadError("points.ply", "cut short: found 2 rows of element vertex, expected 3");

  WriteRunFolder(folder_, testing::MakeSmallRun());
  WriteFile(folder_ + "/rig.json", "{\"cameras\": [");
  ExpectReadError("rig.json: found no valid JSON at byte 14", "expected");
  WriteFile(folder_ + "/rig.json", "{\"cameras\": [1, 2]}");
  ExpectReadError("rig.json: found a value of a wrong type", "expected");
  WriteFile(folder_ + "/rig.json", "{}");
  ExpectReadError("rig.json: cameras: missing", "expected");
  for (const int version : {1, 2, 99}) {
    WriteFile(folder_ + "/run.json",
              "{\"format\": \"slcmap run\", \"version\": " + std::to_string(version) + "}");
    ExpectReadError("run.json",
                    "version " + std::to_string(version) + ", expected 'slcmap run' of version 6");
  }
}

TEST_F(RunFolderDamageTest, AnAbsurdRigIsRefused) {
  WriteRunFolder(folder_, testing::MakeSmallRun());
  const std::string path = folder_ + "/rig.json", text = ReadFile(path);
  for (const auto& [from, to] :
       {std::pair("\"fx_px\": 458.5", "\"fx_px\": 0.0"),
        std::pair("\"fx_px\": 458.5", "\"fx_px\": -458.5"),
        std::pair("\"rate_hz\": 100", "\"rate_hz\": -100"),
        std::pair("\"camera_time_offset_s\": 0.0125", "\"camera_time_offset_s\": 1e9")}) {
    std::string damaged = text;
    ASSERT_NE(text.find(from), std::string::npos) << from;
    damaged.replace(text.find(from), std::string(from).size(), to);
    WriteFile(path, damaged);
    EXPECT_THAT([&] { ReadRunFolder(folder_, {.accept_changed = true}); },
                ThrowsMessage<DataError>(AllOf(HasSubstr("rig.json: "), HasSubstr("expected"))));
  }
}

}  // namespace
}  // namespace slcmap
