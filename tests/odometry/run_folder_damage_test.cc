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

class RunFolderDamageTest : public testing::SmallRunFolder {
 protected:
  // Writes a good run, and then another text in the place of one.
  void Change(const std::string& file, const std::string& from, const std::string& to) const {
    WriteRunFolder(folder_, testing::MakeSmallRun());
    std::string text = ReadFile(Path(file));
    ASSERT_NE(text.find(from), text.npos) << from;
    WriteFile(Path(file), text.replace(text.find(from), from.size(), to));
  }
};

TEST_F(RunFolderDamageTest, MissingFilesAreNamed) {
  for (const char* name :
       {"trajectory.tum", "states.csv", "keyframes.csv", "observations.csv", "points.ply",
        "rig.json", "timings.json", "run.json", "imu.csv", "raw_rig.json", "options.yaml",
        "images.csv", "lines.ply", "calibration.csv", "lines.csv", "line_observations.csv",
        "line_points.csv"}) {
    std::filesystem::remove_all(folder_);
    WriteRunFolder(folder_, testing::MakeSmallRun());
    std::filesystem::remove(Path(name));
    ExpectReadError(name, folder_);
  }
}

// Makes row 2 of a table, the first below the columns, another one.
struct Damage {
  const char* file;
  std::string row;
  const char* message;
};

TEST_F(RunFolderDamageTest, DamagedRowsAreNamed) {
  const std::string pose = ",0,0,0,0,0,0,1", rest = ",0,0,0,0,0,0,0,0,0";
  const std::string far = "3,0" + std::string(",1e30,0,0,0,0,0,1") + rest,
                    fast = "3,0" + pose + ",1e30,0,0,0,0,0,0,0,0",
                    unit = "3,0,0,0,0,0.5,0.5,0,0.5" + rest,
                    line = ",0,0,0,1,1,1,0,0,0,0,0,0,3,5,0,0", one = ",nan,nan,nan,nan";
  // A row of zeros but for one value.
  const auto correction = [](int at, const std::string& value) {
    std::string row = "1403636579913555584,1";
    for (int column = 0; column < 56; ++column) row += "," + (column == at ? value : "0");
    return row;
  };
  const Damage damages[] = {
      {"states.csv", far, "x_m: found '1e30', expected -1000000 to 1000000"},
      {"states.csv", fast, "vx_m_s: found '1e30'"},
      {"states.csv", unit, "expected a quaternion of length 1"},
      {"states.csv", "3,-1", "found 2 columns, expected 18"},
      {"keyframes.csv", "-7,0,5,0,0,0,0,0,0,1", "id: found '-7', expected 0 to 2147483647"},
      {"observations.csv", "7,1,abc,2,nan,nan", "left_x_px: found 'abc', expected a finite number"},
      {"observations.csv", "7,1,nan,2,nan,nan", "left_x_px: found 'nan'"},
      {"observations.csv", "7,1,1e9,2,nan,nan", "left_x_px: found '1e9'"},
      {"observations.csv", "7,1,1,2,3,nan", "nan in all of the right image's columns or in none"},
      {"observations.csv", "8,1,1,2,nan,nan", "keyframe_id: found '8'"},
      {"imu.csv", "5,0,0,1e3,0,0,0", "wz_rad_s: found '1e3', expected -100 to 100"},
      {"lines.csv", "7,0,5,-1" + line, "axis: found '5'"},
      {"lines.csv", "7,0,1,2" + line, "world: found '2'"},
      {"lines.csv", "7,0,1,-2" + line, "world: found '-2'"},
      {"lines.csv", "7,0,1,0,0,nan" + line.substr(4), "start_y_m: found 'nan'"},
      {"line_points.csv", "7,3", "line_id: found '7'"},
      {"line_observations.csv", "77,4,1,2,3,4" + one, "keyframe_id: found '77'"},
      {"line_observations.csv", "7,4,1,2,x,4" + one, "left_end_x_px: found 'x'"},
      {"line_observations.csv", "7,4,1,2,3,4,5,nan,nan,nan", "right_start_y_px: found 'nan'"},
      {"calibration.csv", correction(0, "900"), "time_offset_s: found '900', expected -10 to 10"},
      {"calibration.csv", correction(2, "-4"), "imu_rotation_y_rad: found '-4', expected -3.2"},
      {"calibration.csv", correction(5, "200"), "lever_y_m: found '200', expected -100 to 100"},
      {"calibration.csv", correction(7, "4"), "right_rotation_x_rad: found '4', expected -3.2"},
      {"calibration.csv", correction(10, "-2"), "focal_length: found '-2', expected -0.9 to 0.9"}};
  for (const Damage& damage : damages) {
    WriteRunFolder(folder_, testing::MakeSmallRun());
    std::string text = ReadFile(Path(damage.file));
    const std::size_t start = text.find('\n') + 1;
    text.replace(start, text.find('\n', start) - start, damage.row);
    WriteFile(Path(damage.file), text);
    ExpectReadError(std::string(damage.file) + ": row 2: ", damage.message);
    // The same where changes are accepted: values are checked in any case.
    EXPECT_THAT([&] { ReadRunFolder(folder_, {.accept_changed = true}); },
                ThrowsMessage<DataError>(HasSubstr(damage.message)));
  }
  WriteRunFolder(folder_, testing::MakeSmallRun());
  WriteFile(Path("observations.csv"), "a,b\n");
  ExpectReadError("observations.csv: row 1", "found the columns 'a,b'");
}

TEST_F(RunFolderDamageTest, RowsThatContradictOthersAreNamed) {
  for (const auto& [file, what] :
       {std::pair("states.csv",
                  "stamp_ns: found '1403636579763555584', expected a stamp after "
                  "1403636579963555584"),
        std::pair("keyframes.csv", "id: found '7', expected an id that no row before it has"),
        std::pair("observations.csv", "landmark_id: found '1', expected an id that no row"),
        std::pair("lines.csv", "id: found '4'"),
        std::pair("imu.csv", "stamp_ns: found '5', expected a stamp after 6")}) {
    WriteRunFolder(folder_, testing::MakeSmallRun());
    const std::string path = Path(file), text = ReadFile(path);
    const std::size_t first = text.find('\n') + 1;
    WriteFile(path, text + text.substr(first, text.find('\n', first) + 1 - first));
    ExpectReadError(std::string(file) + ": row ", what);
  }
}

TEST_F(RunFolderDamageTest, ChangedFilesAreRefusedUnlessAccepted) {
  WriteRunFolder(folder_, testing::MakeSmallRun());
  const std::string path = Path("observations.csv"), text = ReadFile(path);
  WriteFile(path, text.substr(0, text.rfind("7,2,")));
  ExpectReadError(folder_ + ": found 1 observations, expected 2 as in run.json",
                  "--accept-changed");
  EXPECT_EQ(ReadRunFolder(folder_, {.accept_changed = true}).keyframes[0].observations.size(), 1u);
  Change("observations.csv", "10.5", "11.5");
  ExpectReadError("observations.csv: found ", "expected ");
  WriteFile(path, text);
  // The file of another run does not belong here.
  OdometryRun other = testing::MakeSmallRun();
  other.landmarks[0].sigma_m = 0.25;
  WriteRunFolder(temp_.Path("other"), other);
  std::filesystem::copy_file(temp_.Path("other/points.ply"), Path("points.ply"),
                             std::filesystem::copy_options::overwrite_existing);
  ExpectReadError("points.ply: found ", "as in run.json: written by another run or changed since");
}

// Runs of the same version from before it was estimated.
TEST_F(RunFolderDamageTest, ARunWithoutItsCalibrationIsRead) {
  WriteRunFolder(folder_, testing::MakeSmallRun());
  std::filesystem::remove(Path("calibration.csv"));
  EXPECT_TRUE(ReadRunFolder(folder_, {.accept_changed = true}).calibration.empty());
}

// Nothing depends on it.
TEST_F(RunFolderDamageTest, DamagedTimingsAreLeftOutWhereChangesAreAccepted) {
  WriteRunFolder(folder_, testing::MakeSmallRun());
  for (const char* text : {"{\"cpu_s\": -1}", "{", ""}) {
    WriteFile(Path("timings.json"), text);
    ExpectReadError("timings.json: ", "expected");
    const OdometryRun read = ReadRunFolder(folder_, {.accept_changed = true});
    EXPECT_EQ(read.states.size(), 5u);
    EXPECT_EQ(read.warnings.at("timings_unreadable"), 1);
    EXPECT_EQ(read.timings.cpu_s, 0);
  }
}

TEST_F(RunFolderDamageTest, TheSummaryCountsPointsOfShortLives) {
  WriteRunFolder(folder_, testing::MakeSmallRun());
  const std::string text = ReadFile(Path("run.json"));
  EXPECT_THAT(text, AllOf(HasSubstr("\"points\": 2"), HasSubstr("\"seen_once\": 2")));
}

TEST_F(RunFolderDamageTest, AChangedSummaryIsRefused) {
  Change("run.json", "\"method\": \"points\"", "\"method\": \"plane\"");
  ExpectReadError("run.json: method: found 'plane'", "expected points-mono");
  Change("run.json", "\"level\": \"failed\"", "\"level\": \"good\"");
  ExpectReadError("run.json: verdict", "expected 'failed'");
  Change("run.json", "\"level\": \"failed\"", "\"level\": \"great\"");
  ExpectReadError("run.json: verdict", "found 'great'");
  Change("run.json", "\"imu_gap\": 2", "\"imu_gap\": -2");
  ExpectReadError("run.json: warnings: imu_gap: found -2", "at least 0");
  Change("run.json", "\"imu_gap\": 2", "\"imu_gap\": 3");
  ExpectReadError("run.json: found checksum", "--accept-changed");
  Change("run.json", "\"states\": 5", "\"states\": 6");
  ExpectReadError("found 5 states, expected 6", "run.json");
}

TEST_F(RunFolderDamageTest, DamagedPlyAndJsonAreNamed) {
  WriteRunFolder(folder_, testing::MakeSmallRun());
  const std::string points = Path("points.ply");
  std::string bytes = ReadFile(points);
  bytes.resize(bytes.size() - 5);
  WriteFile(points, bytes);
  ExpectReadError("points.ply", "cut short: found 2 rows of element vertex, expected 3");

  WriteRunFolder(folder_, testing::MakeSmallRun());
  WriteFile(Path("rig.json"), "{\"cameras\": [");
  ExpectReadError("rig.json: found no valid JSON at byte 14", "expected");
  WriteFile(Path("rig.json"), "{\"cameras\": [1, 2]}");
  ExpectReadError("rig.json: found a value of a wrong type", "expected");
  WriteFile(Path("rig.json"), "{}");
  ExpectReadError("rig.json: cameras: missing", "expected");
  for (const int version : {1, 2, 99}) {
    WriteFile(Path("run.json"),
              "{\"format\": \"slcmap run\", \"version\": " + std::to_string(version) + "}");
    ExpectReadError("run.json",
                    "version " + std::to_string(version) + ", expected 'slcmap run' of version 6");
  }
}

TEST_F(RunFolderDamageTest, AnAbsurdRigIsRefused) {
  for (const auto& [from, to] :
       {std::pair("\"fx_px\": 458.5", "\"fx_px\": 0.0"),
        std::pair("\"fx_px\": 458.5", "\"fx_px\": -458.5"),
        std::pair("\"rate_hz\": 100", "\"rate_hz\": -100"),
        std::pair("\"camera_time_offset_s\": 0.0125", "\"camera_time_offset_s\": 1e9")}) {
    Change("rig.json", from, to);
    EXPECT_THAT([&] { ReadRunFolder(folder_, {.accept_changed = true}); },
                ThrowsMessage<DataError>(AllOf(HasSubstr("rig.json: "), HasSubstr("expected"))));
  }
}

}  // namespace
}  // namespace slcmap
