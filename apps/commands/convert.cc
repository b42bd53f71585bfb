// slcmap convert: a recording in a bag as a folder that the other commands open.
#include <spdlog/spdlog.h>

#include <memory>

#include "apps/commands/commands.h"
#include "apps/commands/progress.h"
#include "data/bag/unpack.h"
#include "data/io/output_folder.h"
#include "data/rig/topics.h"

namespace slcmap::inline commands {
namespace {

struct ConvertArguments {
  std::string bag, output, topics;
};

void LogCounts(const RecordingTopics& topics, const UnpackedCounts& counts) {
  spdlog::info("{}: {} images; {}: {}", topics.left, counts.left,
               topics.right.empty() ? "no second camera" : topics.right, counts.right);
  spdlog::info("{}{}: {} samples", topics.gyro,
               topics.accel == topics.gyro ? "" : " and " + topics.accel, counts.imu);
  for (const auto& [kind, entry] : counts.warnings.entries()) {
    spdlog::warn("{}: {}, first {}", Warnings::InWords(kind), entry.count, entry.first_place);
  }
}

void RequireSome(const std::string& bag, const UnpackedCounts& counts) {
  if (counts.left > 0 && counts.imu > 0) return;
  throw DataError(fmt::format(
      "{}: found {} images and {} samples of the IMU that can be read, expected some of both", bag,
      counts.left, counts.imu));
}

void Convert(const ConvertArguments& arguments) {
  const RecordingTopics said = ParseTopics(arguments.topics);
  OutputFolder output(arguments.output, {"a recording", {"mav0"}}, {arguments.bag});
  const std::unique_ptr<Bag> bag = OpenBag(arguments.bag);
  const RecordingTopics topics = ChooseTopics(bag.get(), said);
  spdlog::info("{}: {}", arguments.bag, bag->form());
  for (const std::string& reason : topics.reasons) spdlog::info("{}", reason);
  const UnpackedCounts counts =
      UnpackRecording(topics, output.staging() + "/mav0", StageProgress("convert"), bag.get());
  LogCounts(topics, counts);
  RequireSome(arguments.bag, counts);
  output.Commit();
  spdlog::info(
      "wrote {}; its calibration is given to what opens it: slcmap run {} --calibration "
      "rig.yaml",
      output.path(), output.path());
}

}  // namespace

void AddConvertCommand(CLI::App& app) {
  CLI::App* command = app.add_subcommand("convert", "Make an EuRoC (ASL) folder of a bag");
  const auto arguments = std::make_shared<ConvertArguments>();
  command
      ->add_option("bag", arguments->bag,
                   "ROS 1 bag, rosbag2 database or MCAP file, or the folder of one")
      ->required();
  command->add_option("-o,--output", arguments->output, "Folder of the recording")->required();
  command
      ->add_option("--topics", arguments->topics,
                   "Which topics are the rig's, any of them; imu= for gyro= and accel= in one "
                   "(default: by types and names)")
      ->type_name("left=A,right=B,imu=C");
  command->footer(
      "Examples:\n  slcmap convert walk.bag -o walk\n"
      "  slcmap convert walk -o rig --topics "
      "left=/oak/left/image_raw,right=/oak/right/image_raw\n\n"
      "Images keep the stamps of their headers. Calibrations in bags are not read: give the rig's\n"
      "with --calibration to what opens the folder.");
  command->callback([arguments] { Convert(*arguments); });
}

}  // namespace slcmap::commands
