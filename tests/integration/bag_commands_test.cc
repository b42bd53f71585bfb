// Recordings in bags, as a user has them: converted both ways, checked, run and mapped.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "data/source/asl_files.h"
#include "tests/integration/slcmap_process.h"
#include "tests/testing/small_sequence.h"
#include "tests/testing/temp_folder.h"
#include "tests/testing/video_writer.h"

namespace slcmap {
namespace {

namespace fs = std::filesystem;
using testing::ExpectError;
using testing::ExpectSuccess;
using ::testing::HasSubstr;
using testing::ProcessResult;
using testing::ReadText;
using testing::RunSlcmap;
using testing::TempFolder;

class BagCommands : public ::testing::Test {
 protected:
  BagCommands() {
    testing::WriteSequence(folder_, {.images = 40, .size = {320, 240}, .still = true});
  }

  std::string Convert(const std::string& from, const std::string& to,
                      const std::string& options = "") {
    ExpectSuccess("convert " + folder_.Path(from) + " " + folder_.Path(to) + " " + options);
    return folder_.Path(to);
  }

  // The files of a run, but for those that tell its times and where it was made.
  std::map<std::string, std::string> Run(const std::string& recording) {
    const std::string run = out_.Path("run");
    fs::remove_all(run);
    ExpectSuccess("-q odometry " + recording + " --method points --force --calibration " +
                  folder_.Path("mav0") + " -o " + run);
    std::map<std::string, std::string> files;
    for (const auto& entry : fs::directory_iterator(run)) {
      const std::string name = entry.path().filename().string();
      if (!entry.is_regular_file() || name == "run.json" || name == "timings.json") continue;
      files[name] = ReadText(entry.path().string());
    }
    EXPECT_GT(files.size(), 5u);
    EXPECT_GT(files["trajectory.tum"].size(), 1000u);
    return files;
  }

  TempFolder folder_, out_;
};

TEST_F(BagCommands, ARunHasTheSameBytesOfAFolderAndOfAnyBag) {
  const auto of_folder = Run(folder_.Path("mav0"));
  for (const auto& [to, options] :
       {std::pair{"a.bag", "--packing bz2"}, {"b", "--packing db3,zstd"}, {"c.mcap", ""}}) {
    SCOPED_TRACE(to);
    EXPECT_EQ(Run(Convert("mav0", to, options)), of_folder);
  }
  EXPECT_EQ(Run(Convert("c.mcap", "again")), of_folder);
}

TEST_F(BagCommands, ARunOfAVideoIsThatOfItsImages) {
  std::string times = "timestamp\n";
  {
    testing::VideoWriter video(folder_.Path("walk.mkv"), {640, 240});
    Warnings warnings;
    for (const ImageFile& left : ReadAslImages(folder_.Path("mav0/cam0"), &warnings)) {
      cv::Mat both;
      const std::string name = fs::path(left.path).filename();
      cv::hconcat(cv::imread(left.path, cv::IMREAD_GRAYSCALE),
                  cv::imread(folder_.Path("mav0/cam1/data/" + name), cv::IMREAD_GRAYSCALE), both);
      video.Add(both, static_cast<int64_t>(std::count(times.begin(), times.end(), '\n')));
      times += fmt::format("{}\n", left.stamp_ns);
    }
  }
  folder_.Write("times.csv", times);
  folder_.Write("walk.csv", ReadText(folder_.Path("mav0/imu0/data.csv")));
  const std::string video = folder_.Path("walk.mkv"), rig = folder_.Path("mav0");
  const std::string options = " --method points --force --format ply -o " + out_.Path("out");
  const std::string of_video = " --side-by-side --frame-times " + folder_.Path("times.csv");
  ExpectError("-q run " + video + options + of_video, 2, "expected --calibration");
  ExpectError("-q run " + video + options + of_video + " --topics left=/a --calibration " + rig, 2,
              "expected them for a bag");
  EXPECT_FALSE(fs::exists(out_.Path("out/recording")));
  for (const std::string command : {"odometry ", "map --poses x.tum ", "check "}) {
    ExpectError("-q " + command + video + (command == "check " ? "" : " -o " + out_.Path("x")), 1,
                "slcmap run takes it as it is");
  }
  ExpectSuccess("-q run " + video + options + of_video + " --calibration " + rig);
  const std::string poses = ReadText(out_.Path("out/run/trajectory.tum"));
  EXPECT_GT(poses.size(), 1000u);
  EXPECT_TRUE(fs::exists(out_.Path("out/map/map.json")));
  ExpectError("-q run " + video + options + of_video + " --calibration " + rig, 2,
              "found images of a video already");
  ExpectSuccess("-q run " + rig + options);
  EXPECT_EQ(ReadText(out_.Path("out/run/trajectory.tum")), poses);
}

TEST_F(BagCommands, CheckListsTheTopicsAndTheMapOpensTheBagAgain) {
  const std::string bag = Convert("mav0", "walk.bag", "--packing lz4");
  const std::string calibration = " --calibration " + folder_.Path("mav0");
  const ProcessResult check = RunSlcmap("check --json " + bag + calibration);
  const auto report = nlohmann::json::parse(check.output);
  ASSERT_EQ(report.at("topics").size(), 3u);
  EXPECT_EQ(report.at("topics").at(0).at("name"), "/cam0/image_raw");
  EXPECT_EQ(report.at("topics").at(0).at("messages"), 40);
  EXPECT_EQ(report.at("topics").at(0).at("taken_as"), "left images");
  EXPECT_THAT(RunSlcmap("check " + bag + calibration).output,
              HasSubstr("sensor_msgs/Imu: gyroscope and accelerometer"));
  Run(bag);
  EXPECT_THAT(ReadText(out_.Path("run/run.json")), HasSubstr("left=/cam0/image_raw"));
  const auto map = [&](const std::string& options) {
    return RunSlcmap("-q map " + out_.Path("run") + " -o " + out_.Path("map") + options);
  };
  EXPECT_EQ(map("").exit_code, 0);
  fs::rename(bag, folder_.Path("moved.bag"));
  EXPECT_THAT(map("").error, HasSubstr("--sequence"));
  EXPECT_EQ(map(" --sequence " + folder_.Path("moved.bag")).exit_code, 0);
  EXPECT_EQ(map(" --sequence " + folder_.Path("mav0")).exit_code, 0) << "it was made of that";
}

TEST_F(BagCommands, PartsAndFoldersAreConvertedWithWhatBelongsToThem) {
  folder_.Write("mav0/state_groundtruth_estimate0/data.csv", "#timestamp\n");
  folder_.Write("truth/edges.csv", "a,b\n");
  const std::string part = Convert("mav0", "part", "--from 0.5 --duration 0.25");
  EXPECT_EQ(ReadText(part + "/mav0/cam0/sensor.yaml"),
            ReadText(folder_.Path("mav0/cam0/sensor.yaml")));
  EXPECT_EQ(ReadText(part + "/mav0/imu0/sensor.yaml"), testing::kImuYaml);
  EXPECT_TRUE(fs::exists(part + "/mav0/state_groundtruth_estimate0/data.csv"));
  EXPECT_TRUE(fs::exists(part + "/mav0/truth/edges.csv"));
  EXPECT_EQ(std::distance(fs::directory_iterator(part + "/mav0/cam1/data"), {}), 6);
  ExpectError("-q convert " + folder_.Path("mav0") + " " + part, 2,
              "found a recording already, expected none: remove ");
}

TEST_F(BagCommands, TheSimulatorWritesBagsAsARigWould) {
  folder_.Write("rig.yaml", testing::RigYaml(4));
  folder_.Write(
      "scene.yaml",
      "objects: [{kind: slab, at: [-5, -5, 0], size: [20, 10], material: carpet}]\n"
      "trajectory: {kind: robot, waypoints_m: [[0, 0, 1], [1, 0, 1]], stand_still_s: 0.5}\n");
  const std::string bag = folder_.Path("walk.mcap");
  const std::string command = "-q simulate " + folder_.Path("scene.yaml") + " --rate 4 --rig " +
                              folder_.Path("rig.yaml") + " -o ";
  ExpectSuccess(command + bag + " --as oak_d");
  EXPECT_TRUE(fs::exists(folder_.Path("walk_truth/trajectory.tum")));
  const ProcessResult shown = RunSlcmap("calibration " + bag);
  EXPECT_THAT(shown.output, HasSubstr("/oak/left/camera_info of rectified images"));
  EXPECT_THAT(shown.output, HasSubstr("pinhole none"));
  ExpectError(command + bag + " --as oak_d", 2, "walk_truth: found something there");
  ExpectError(command + folder_.Path("b.bag") + " --as oak", 2, "oak_d");
  ExpectError(command + folder_.Path("c") + " --as oak_d", 2, "ends with .bag");
}

TEST_F(BagCommands, WrongUsageOfConvertIsTold) {
  const std::string in = folder_.Path("mav0"), out = folder_.Path("out");
  const std::pair<std::string, const char*> kWrong[] = {
      {in, "expected one of them"},
      {in + " " + out + " -o " + out, "expected one of them"},
      {in + " " + out + " --packing lz4", "expected it for a bag"},
      {in + " " + out + ".bag --packing zstd", "zstd"},
      {in + " " + out + ".db3 --packing zstd_file", "expected one of none, zstd"},
      {in + " " + out + ".bag --from 1000", "found no image"},
      {in + " " + in, "would be overwritten"},
      {in + " " + out + " --topics left=/a", "no bag"}};
  for (const auto& [arguments, words] : kWrong) {
    SCOPED_TRACE(arguments);
    ExpectError("-q convert " + arguments, 2, words);
  }
  folder_.Write("full/notes.txt", "mine");
  ExpectError("-q convert " + in + " " + folder_.Path("full") + " --packing db3", 2,
              "expected nothing, or an empty folder");
  EXPECT_EQ(ReadText(folder_.Path("full/notes.txt")), "mine");
  // Nothing that is there is written over or taken away.
  const std::string mine = folder_.Write("mine.bag", "mine");
  ExpectError("-q convert " + in + " " + mine, 2, "expected nothing there");
  EXPECT_EQ(ReadText(mine), "mine");
  const std::string aside = folder_.Write("kept.bag.unfinished/notes.txt", "mine");
  ExpectError("-q convert " + in + " " + folder_.Path("kept.bag"), 2, "move them away");
  EXPECT_EQ(ReadText(aside), "mine");
  fs::remove_all(folder_.Path("kept.bag.unfinished"));
  ExpectError("-q convert " + in + " " + out + " --side-by-side", 2, "a video alone");
  ExpectError("-q convert " + folder_.Path("none") + " " + out, 1, "none: found no such");
  for (const auto& entry : fs::directory_iterator(folder_.Path())) {
    EXPECT_THAT(entry.path().filename().string(), ::testing::Not(HasSubstr("unfinished")));
  }
}

}  // namespace
}  // namespace slcmap
