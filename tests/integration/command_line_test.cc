// The command line: exit codes and one-line messages that name the place.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "tests/integration/slcmap_process.h"
#include "tests/testing/small_sequence.h"

namespace slcmap {
namespace {

using ::testing::AllOf;
using testing::ExpectError;
using testing::ExpectSuccess;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::ProcessResult;
using testing::RunShell;
using testing::RunSlcmap;
using ::testing::StartsWith;
using testing::TempFolder;

TEST(CommandLine, HelpAndVersionSucceed) {
  ExpectSuccess("--version");
  const ProcessResult help = ExpectSuccess("odometry --help");
  EXPECT_THAT(help.output, HasSubstr("Examples:"));
  EXPECT_THAT(help.output, HasSubstr("--duration"));
  const ProcessResult commands = RunSlcmap("--help");
  EXPECT_THAT(commands.output, HasSubstr("odometry"));
  // It is a command too.
  EXPECT_EQ(RunSlcmap("help").output, commands.output);
  EXPECT_EQ(RunSlcmap("help odometry").output, help.output);
  ExpectError("help odometri", 2, "did you mean 'odometry'?");
}

TEST(CommandLine, UsageErrorsAreTwo) {
  const std::pair<const char*, const char*> kWrong[] = {
      {"",
       "found no command, expected one of simulate, check, convert, calibration, "
       "odometry"},
      {"fly", "found command 'fly', expected one of simulate"},
      {"evalaute", "did you mean 'evaluate'?"},
      {"odometry", "odometry: found no sequence, expected one"},
      {"odometry seq -o run --threads many", "--threads: found 'many', expected a whole number"},
      {"odometry seq -o run -o other", "--output: found 2 values"},
      {"odometry seq -o run --config", "--config: found no value"},
      {"odometry seq -o run --config ''", "--config: found an empty text"},
      {"map run -o map --confg a", "did you mean '--config'?"},
      {"map run other -o map", "map: found 'other'"},
      {"run seq -o out --format gltf", "found 'gltf', expected one of glb"},
      {"odometry seq -o run --threads 100000", "--threads: found 100000"},
      {"map run -o map --threads 0", "--threads: found 0"}};
  for (const auto& [command, words] : kWrong) {
    SCOPED_TRACE(command);
    ExpectError(command, 2, words);
  }
}

TEST(CommandLine, VerboseAndQuietStandAnywhereAndAFullOutputIsAnError) {
  const TempFolder folder;
  testing::WriteSequence(folder, {.images = 3});
  const std::string odometry = " odometry " + folder.Path("mav0") + " -o " + folder.Path("run");
  EXPECT_THAT(RunSlcmap(odometry).error, HasSubstr("info: "));
  for (const std::string& command : {"-q" + odometry, odometry + " --quiet"}) {
    EXPECT_THAT(RunSlcmap(command).error, Not(HasSubstr("info: "))) << command;
  }
  EXPECT_EQ(RunSlcmap("check -v " + folder.Path("none")).exit_code, 1);
  ExpectError(RunShell("\\$SLCMAP --version > /dev/full"), 1, "standard output: cannot be written");
}

TEST(Calibration, IsShownAndWrittenAsAKalibrChain) {
  const TempFolder folder;
  const std::string orb = folder.Write(
      "orb.yaml",
      "%YAML:1.0\n---\nCamera.type: Rectified\nCamera1.fx: 400\nCamera1.fy: 400\nCamera1.cx: 320\n"
      "Camera1.cy: 240\nCamera.width: 640\nCamera.height: 480\nStereo.b: 0.05\n");
  const std::string pose = folder.Write(
      "pose.yaml",
      "cam0:\n  T_imu_cam: [[1, 0, 0, 0.02], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n");
  const std::string rig = folder.Path("rig.yaml");
  ExpectError("calibration " + orb, 1, "missing is the left camera's pose to the IMU");
  const ProcessResult shown = ExpectSuccess("calibration " + orb + " " + pose + " -o " + rig);
  EXPECT_THAT(shown.output, HasSubstr("baseline    0.0500 m"));
  EXPECT_THAT(shown.output, HasSubstr("(typical)"));
  const ProcessResult again = RunSlcmap("calibration " + rig);
  EXPECT_THAT(again.output, HasSubstr("baseline    0.0500 m"));
  ExpectError("calibration " + rig + " -o " + rig, 2, "found a file that is read");
  ExpectError("calibration " + folder.Path("none.yaml"), 1, "none.yaml");
}

TEST(Odometry, ErrorsNameThePlace) {
  const TempFolder folder;
  const std::string run = " -o " + folder.Path("run");
  ExpectError("odometry " + folder.Path("none") + run, 1, "none: found no such folder");
  testing::WriteSequence(folder, {.images = 2});
  const std::string sequence = "odometry " + folder.Path("mav0") + run;
  ExpectError(sequence + " --method plane", 2, "structural or slc");
  folder.Write("bad.yaml", "window: {max_keyfraems: 3}\n");
  ExpectError(sequence + " --config " + folder.Path("bad.yaml"), 2,
              "bad.yaml: window.max_keyfraems: unknown key");
  ExpectError(sequence + " --config " + folder.Path("none.yaml"), 2, "none.yaml");
  ExpectError(sequence + " --calibration " + folder.Path("bad.yaml"), 1, "bad.yaml: cam0: missing");
  ExpectError("-q odometry " + folder.Path() + " -o /proc/run", 1, "/proc/run");
}

TEST(Odometry, ASequenceThatShowsNoMotionFailsAndSaysSo) {
  const TempFolder folder;
  testing::WriteSequence(folder, {.images = 5});
  const ProcessResult result =
      RunSlcmap("-q odometry " + folder.Path("mav0") + " -o " + folder.Path("run"));
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.error, HasSubstr("run: the run has failed: start: found no motion that could "
                                      "be estimated, expected at least one pose; remedy: "));
  EXPECT_THAT(testing::ReadText(folder.Path("run/run.json")), HasSubstr("\"level\": \"failed\""));
}

// An accelerometer in g, which the check before the start names.
std::string WriteSequenceInG(const TempFolder& folder) {
  testing::WriteSequence(folder, {.images = 40, .size = {320, 240}, .still = true});
  std::string rows;
  for (int64_t i = -4; i < 400; ++i) {
    rows += fmt::format("{},0.00{},0.00{},-0.00{},0.0{},-0.0{},1.0{}\n",
                        testing::kFirstStamp_ns + i * testing::kImuStep_ns, (i + 9) % 3,
                        (i + 9) % 5, (i + 9) % 7, (i + 9) % 4, (i + 9) % 6, (i + 9) % 8);
  }
  folder.Write("mav0/imu0/data.csv", rows);
  return "odometry " + folder.Path("mav0") + " -o " + folder.Path("run");
}

TEST(Odometry, StopsWhereTheCheckBeforeTheStartFindsAnError) {
  const TempFolder folder;
  const std::string odometry = WriteSequenceInG(folder);
  const ProcessResult stopped = RunSlcmap("-q " + odometry);
  EXPECT_EQ(stopped.exit_code, 1) << stopped.error;
  EXPECT_THAT(stopped.error, AllOf(HasSubstr("imu-units: "), HasSubstr("multiply by 9.80665"),
                                   HasSubstr("--force goes on all the same")));
  EXPECT_FALSE(std::filesystem::exists(folder.Path("run/run.json")));
  // It goes on with force and says what it leaves aside.
  const auto summary = [&] { return testing::ReadText(folder.Path("run/run.json")); };
  EXPECT_THAT(RunSlcmap(odometry + " --force").error, HasSubstr("warning: check: imu-units: "));
  EXPECT_THAT(summary(),
              AllOf(HasSubstr("\"check_errors\": [\n      \"imu-units: "),
                    HasSubstr("\"what\": \"check\""), Not(HasSubstr("\"level\": \"good\""))));
  std::filesystem::remove_all(folder.Path("run"));
  EXPECT_THAT(RunSlcmap(odometry + " --no-check").error, Not(HasSubstr("check:")));
  EXPECT_THAT(summary(), HasSubstr("\"check_errors\": []"));
}

TEST(Odometry, OneCameraIsEnough) {
  const TempFolder folder;
  testing::WriteSequence(folder, {.images = 40, .size = {320, 240}, .still = true});
  std::filesystem::remove_all(folder.Path("mav0/cam1"));
  const std::string command = "-q odometry " + folder.Path("mav0") + " -o " + folder.Path("run");
  const ProcessResult mono = ExpectSuccess(command);
  EXPECT_THAT(mono.error, HasSubstr("found one camera, which is used alone"));
  const ProcessResult said = RunSlcmap(command + " --cameras 0");
  EXPECT_THAT(said.error, Not(HasSubstr("found one camera"))) << "it was asked for";
  ExpectSuccess("-q map " + folder.Path("run") + " -o " + folder.Path("map"));
}

// A room of 6 x 4 x 3 m with a way through it; `lamp` and `more` are YAML.
std::string RoomYaml(const std::string& lamp = "radiance: 30", const std::string& more = "",
                     const std::string& to = "2, 0, 1") {
  return "objects:\n"
         "  - {kind: wall, points: [[-2, -2], [4, -2], [4, 2], [-2, 2]], closed: true, height: 3,\n"
         "     material: brick}\n"
         "  - {kind: slab, at: [-2, -2, 0], size: [6, 4], material: carpet}\n"
         "  - {kind: lamp, at: [1, 0, 2.9], size: [1, 0.5], " +
         lamp + "}\n" + more + "trajectory: {kind: robot, waypoints_m: [[0, 0, 1], [" + to +
         "]], stand_still_s: 0.2}\n";
}

TEST(Simulate, WritesASequenceThatCheckAcceptsAndRefusesToDoSoTwice) {
  const TempFolder folder;
  const std::string scene = folder.Write("scene.yaml", RoomYaml());
  const std::string rig = folder.Write("rig.yaml", testing::RigYaml(1));
  const std::string command =
      "simulate " + scene + " --rig " + rig + " --duration 0.6 -o " + folder.Path("sequence");
  const ProcessResult result = ExpectSuccess(command);
  EXPECT_THAT(result.error, HasSubstr("pairs"));
  for (const char* file : {"mav0/cam0/sensor.yaml", "mav0/imu0/data.csv", "truth/edges.csv"}) {
    EXPECT_TRUE(std::filesystem::exists(folder.Path(std::string("sequence/") + file))) << file;
  }
  EXPECT_THAT(RunSlcmap("check " + folder.Path("sequence")).output, HasSubstr("stereo pairs"));
  ExpectError("-q " + command, 1, "sequence");
  ExpectSuccess(command + "2 --inexact 0");
  ExpectSuccess(command + "3 --inexact 0.5 --inexact-seed 4");
  const auto read = [&](const std::string& path) { return testing::ReadText(folder.Path(path)); };
  EXPECT_EQ(read("sequence2/truth/edges.csv"), read("sequence/truth/edges.csv"));
  EXPECT_EQ(read("sequence2/truth/surfaces.ply"), read("sequence/truth/surfaces.ply"));
  EXPECT_FALSE(std::filesystem::exists(folder.Path("sequence2/truth/inexact.yaml")));
  EXPECT_NE(read("sequence3/truth/edges.csv"), read("sequence/truth/edges.csv"));
  EXPECT_THAT(read("sequence3/truth/inexact.yaml"), HasSubstr("amount: 0.5\nseed: 4\n"));
  ExpectError("simulate " + folder.Path("none.yaml") + " -o " + folder.Path("new"), 2, "none.yaml");
}

TEST(Simulate, RefusesWhatIsAbsurdOrTooLarge) {
  const TempFolder folder;
  const auto simulate = [&](const std::string& scene, const std::string& options = "") {
    return RunSlcmap("simulate " + folder.Write("scene.yaml", scene) + " -o " +
                     folder.Path("sequence") + options);
  };
  ExpectError(simulate(RoomYaml("radiance: 1e25")), 2,
              "scene.yaml: objects[2].radiance: found 1e+25, expected 0.001 to 10000");
  ExpectError(simulate(RoomYaml("radiance: 30", "", "20, 0, 1")), 2, "outside the building");
  for (const auto& [option, words] : {std::pair{" --seed -1", "--seed"},
                                      {" --inexact 5", "inexact.amount: found 5, expected 0 to 2"},
                                      {" --exposure-ms 200", "expected at most the 50 ms"}}) {
    ExpectError(simulate(RoomYaml(), option), 2, words);
  }
  EXPECT_FALSE(std::filesystem::exists(folder.Path("sequence")));
}

TEST(Simulate, SaysWhereItsWayPassesThroughAWall) {
  const TempFolder folder;
  const std::string wall = "  - {kind: wall, points: [[1, -2], [1, 2]], height: 3}\n";
  const ProcessResult result =
      ExpectSuccess("simulate " + folder.Write("scene.yaml", RoomYaml("radiance: 30", wall)) +
                    " -o " + folder.Path("sequence") + " --duration 3.2 --rate 1");
  EXPECT_THAT(result.error,
              AllOf(HasSubstr("passes through surfaces "), HasSubstr(" s into the motion")));
}

TEST(Simulate, CtrlCEndsTheBakingOfLightAtOnce) {
  const TempFolder folder;
  // Light for some minutes.
  const std::string halls = "  - {kind: slab, at: [-2, -2, -9], size: [400, 400], repeat: 2}\n";
  const std::string scene = folder.Write("scene.yaml", RoomYaml("radiance: 30", halls));
  const ProcessResult result =
      RunShell("\\$SLCMAP simulate " + scene + " -o " + folder.Path("sequence") +
               " & pid=\\$!; sleep 3; kill -TERM \\$pid; SECONDS=0; wait \\$pid; code=\\$?; "
               "echo \\$SECONDS; exit \\$code");
  EXPECT_EQ(result.exit_code, 130) << result.error;
  EXPECT_LE(std::stoi(result.output), 5);
  EXPECT_FALSE(std::filesystem::exists(folder.Path("sequence/mav0")));
}

TEST(Check, ASequenceOfNoUseFailsAfterTheReport) {
  const TempFolder folder;
  const ProcessResult result = RunSlcmap("check " + folder.Path());
  ExpectError(result, 1, "not usable");
  EXPECT_THAT(result.output, HasSubstr("remedy: "));
  EXPECT_THAT(RunSlcmap("check --json " + folder.Path()).output, HasSubstr("\"usable\": false"));
}

class StillRig : public ::testing::Test {
 protected:
  void Write(int images) {
    testing::WriteSequence(folder_, {.images = images, .size = {320, 240}, .still = true});
  }
  std::string Command() const {
    return "odometry " + folder_.Path("mav0") + " -o " + folder_.Path("run");
  }
  // Runs it until it has written so many rows, and sends it a signal.
  std::string RunUntil(int rows, const std::string& option, const std::string& signal) const {
    return "\\$SLCMAP " + Command() + " " + option +
           " & pid=\\$!; for i in {1..600}; do sleep 0.1; [ \\$(cat " +
           folder_.Path("run/trajectory.tum") + " 2>/dev/null | wc -l) -gt " +
           std::to_string(rows) + " ] && break; done; kill -" + signal + " \\$pid; wait \\$pid";
  }
  // Of the trajectory, without the header.
  int Rows(const std::string& of = "run") const {
    return testing::CountRows(folder_.Path(of + "/trajectory.tum")) - 1;
  }
  std::string Summary() const { return testing::ReadText(folder_.Path("run/run.json")); }

  TempFolder folder_;
};

TEST_F(StillRig, StaysWhereItIsDespiteDamagedImages) {
  Write(60);
  for (const int index : {30, 31, 45}) {
    std::filesystem::remove(
        folder_.Path(fmt::format("mav0/cam1/data/{}.png", testing::ImageStamp(index))));
  }
  const ProcessResult result = ExpectSuccess(Command());
  EXPECT_GT(Rows(), 35);
  EXPECT_THAT(result.error, HasSubstr("images missing"));
  EXPECT_THAT(Summary(),
              AllOf(HasSubstr("\"complete\": true"), HasSubstr("\"images_missing\": 3")));
  EXPECT_THAT(result.error, HasSubstr("path 0.0"));
}

TEST_F(StillRig, RunsThroughAllStages) {
  Write(40);
  const ProcessResult result = ExpectSuccess("-q run " + folder_.Path("mav0") + " -o " +
                                             folder_.Path("out") + " --format glb,ply");
  for (const char* file :
       {"run/trajectory.tum", "map/trajectory.tum", "export/scene.glb", "export/points.ply"}) {
    EXPECT_TRUE(std::filesystem::exists(folder_.Path(std::string("out/") + file))) << file;
  }
  EXPECT_THAT(result.output, AllOf(HasSubstr("cost "), HasSubstr("out/export/scene.glb")));
}

TEST_F(StillRig, TwoRunsDoNotShareAFolderAndARerunMarksWhatIsOutdated) {
  Write(150);
  const std::string out = folder_.Path("out"),
                    run = "-q run " + folder_.Path("mav0") + " -o " + out;
  ExpectSuccess(run);
  const std::string map = testing::ReadText(out + "/map/map.json");
  // At the recording's pace it takes 7.5 s.
  const ProcessResult both = RunShell(
      "\\$SLCMAP " + run + " --realtime & pid=\\$!; for i in {1..300}; do sleep 0.1; [ -e " + out +
      "/export/previous-1 ] && break; done; ls " + out + "/map " + out +
      "/map/previous-1; \\$SLCMAP " + run + "; echo second \\$?; kill -KILL \\$pid; wait");
  EXPECT_THAT(both.output,
              AllOf(HasSubstr("map:\nprevious-1\n"), HasSubstr("map.json"), HasSubstr("second 1")));
  EXPECT_THAT(both.error, HasSubstr(": in use: another slcmap"));
  EXPECT_EQ(testing::ReadText(out + "/map/previous-1/map.json"), map);
  ExpectSuccess(run);
  EXPECT_EQ(testing::ReadText(out + "/map/map.json"), map);
  EXPECT_FALSE(std::filesystem::exists(out + "/map/previous-1"));
  EXPECT_FALSE(std::filesystem::exists(out + "/run/previous-1"));
}

TEST_F(StillRig, AKilledRunIsMappedUpToTheLastSecond) {
  Write(1000);
  const ProcessResult result = RunShell(RunUntil(40, "-q", "KILL"));
  EXPECT_EQ(result.exit_code, 137);
  const ProcessResult map =
      ExpectSuccess("-q map " + folder_.Path("run") + " -o " + folder_.Path("map"));
  EXPECT_THAT(map.error, HasSubstr("the run is partial: "));
  EXPECT_THAT(testing::ReadText(folder_.Path("map/map.json")), HasSubstr("\"complete\": false"));
  EXPECT_GE(Rows("map"), Rows() - 2);  // one half written, and one not yet in the journal
  EXPECT_GT(Rows("map"), 38);
}

TEST_F(StillRig, TheRecordingIsNoOutput) {
  Write(5);
  for (const char* name : {"", "/mav0/cam0/data", "/mav0/out/run"}) {
    ExpectError("odometry " + folder_.Path() + " -o " + folder_.Path() + name, 2,
                "found the input");
  }
}

TEST_F(StillRig, ACalibrationIsWrittenWhereItReplacesNothingThatIsRead) {
  Write(5);
  const TempFolder other;
  const std::string given = other.Path("given.yaml"), run = other.Path("run");
  std::ofstream(given) << "cam0: {}\n";
  const auto expect_refused = [&](const std::string& more, const std::string& words) {
    ExpectError("odometry " + folder_.Path() + " -o " + run + more, 2, words);
    EXPECT_FALSE(std::filesystem::exists(run)) << "before the run";
  };
  expect_refused(" --write-calibration " + folder_.Path("found.yaml"), "expected a file out of");
  expect_refused(" --write-calibration " + other.Path("none/found.yaml"), "folder that exists");
  expect_refused(" --calibration " + given + " --write-calibration " + given, "file that is read");
  const ProcessResult here = RunShell("cd " + other.Path() + " && \\$SLCMAP odometry " +
                                      folder_.Path() + " -o run --write-calibration found.yaml");
  EXPECT_THAT(here.error, Not(HasSubstr("folder that exists"))) << "the name of a file alone";
}

TEST_F(StillRig, APartOfARecordingIsProcessedAlone) {
  Write(80);
  const ProcessResult result = ExpectSuccess(Command() + " --from 1 --duration 2.5");
  EXPECT_THAT(result.error, HasSubstr("51 pairs of images"));
  std::string first = testing::ReadText(folder_.Path("run/trajectory.tum"));
  first = first.substr(first.find('\n') + 1);
  EXPECT_GE(std::stod(first), 1e-9 * static_cast<double>(testing::ImageStamp(20)));
  EXPECT_LE(Rows(), 51);
  EXPECT_GT(Rows(), 20);
  ExpectError("-q " + Command() + " --from 100", 2, "--from 100 --duration 0: found no image");
  ExpectError("-q " + Command() + " --from -1", 2, "--from: found -1");
}

TEST_F(StillRig, PlaysAtItsOwnPaceAndReportsWhatItSkipped) {
  Write(30);
  const ProcessResult result = ExpectSuccess(Command() + " --realtime");
  EXPECT_THAT(result.error, AllOf(HasSubstr("real time: skipped "), HasSubstr(" images (")));
  EXPECT_THAT(Summary(), HasSubstr("\"complete\": true"));
  EXPECT_THAT(testing::ReadText(folder_.Path("run/timings.json")), HasSubstr("skipped_images"));
}

TEST_F(StillRig, CtrlCLeavesTheResultsSoFar) {
  Write(1000);
  for (const auto& [pace, signal] : {std::pair("", "TERM"), {"--realtime", "HUP"}}) {
    std::filesystem::remove_all(folder_.Path("run"));
    const ProcessResult result = RunShell(RunUntil(10, pace, signal));
    EXPECT_EQ(result.exit_code, 130) << result.error;
    EXPECT_GT(Rows(), 9);
    EXPECT_LT(Rows(), 990);
    EXPECT_THAT(Summary(), AllOf(HasSubstr("\"complete\": false"), HasSubstr("interrupted")));
  }
}

TEST_F(StillRig, ADiskThatFillsUpHalfWayLeavesTheResultsSoFar) {
  Write(60);
  // No file may grow beyond 32 KiB.
  const ProcessResult result = RunShell("trap '' XFSZ; ulimit -f 32; \\$SLCMAP -q " + Command() +
                                        " 2>&1 | cat >&2; exit "
                                        "\\${PIPESTATUS[0]}");
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.error,
              AllOf(HasSubstr("slcmap: error: "), HasSubstr("run/journal/finished.csv"),
                    HasSubstr("cannot be written")));
  EXPECT_GT(Rows(), 5);
  EXPECT_THAT(Summary(), HasSubstr("\"complete\": false"));
  const ProcessResult map =
      ExpectSuccess("map " + folder_.Path("run") + " -o " + folder_.Path("map"));
  EXPECT_THAT(map.error, AllOf(HasSubstr("the run is partial: "), HasSubstr("cannot be written")));
}

}  // namespace
}  // namespace slcmap
