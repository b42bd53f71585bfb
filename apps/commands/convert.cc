// slcmap convert: a recording or a video written anew, as an EuRoC (ASL) folder or as a bag.
#include "apps/commands/convert.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "apps/commands/commands.h"
#include "apps/commands/odometry_stage.h"
#include "apps/commands/progress.h"
#include "data/core/error.h"
#include "data/io/csv.h"
#include "data/io/file.h"
#include "data/io/output_folder.h"
#include "data/source/convert_recording.h"
#include "data/video/video.h"

namespace slcmap::inline commands {
namespace {

namespace fs = std::filesystem;

struct ConvertArguments {
  std::string input, output, folder, packing;
  SequenceOptions opened;
  SequencePart part;
  bool keep_files = false;
  VideoRecording video;
};

// What each kind of bag can be packed with.
const std::map<std::string, std::vector<std::string>>& KnownPackings() {
  static const std::map<std::string, std::vector<std::string>> known = {
      {"bag", {"none", "lz4", "bz2"}},
      {"db3", {"none", "zstd"}},
      {"mcap", {"none", "lz4", "zstd", "unchunked"}}};
  return known;
}

}  // namespace

BagPacking ParsePacking(const std::string& output, const std::string& text) {
  BagPacking packing{kFolder, ""};
  std::string ending;
  for (const auto& [form, compressions] : KnownPackings()) {
    if (output.ends_with("." + form)) ending = packing.form = form;
  }
  std::vector<std::string> words = SplitAtCommas(text);
  if (words.back().empty()) words.pop_back();
  for (const std::string& word : words) {
    const bool is_form = word == kFolder || KnownPackings().contains(word);
    (is_form ? packing.form : packing.compression) = word;
  }
  if (!ending.empty() && packing.form != ending) {
    throw ConfigError(fmt::format("--packing: found {} for {}, expected {} by its ending",
                                  packing.form, output, ending));
  }
  if (packing.form == kFolder && !packing.compression.empty()) {
    throw ConfigError(fmt::format(
        "--packing: found {} for the folder {}, expected it for a bag: give OUT the ending .bag, "
        ".db3 or .mcap, or --packing bag, db3 or mcap with it",
        packing.compression, output));
  }
  if (packing.compression.empty()) packing.compression = "none";
  if (packing.form == kFolder) return packing;
  const std::vector<std::string>& known = KnownPackings().at(packing.form);
  if (std::ranges::count(known, packing.compression) > 0) return packing;
  throw ConfigError(fmt::format("--packing: found {} for {}, expected one of {}",
                                packing.compression, packing.form, fmt::join(known, ", ")));
}

namespace {

// Where a bag is made there may be what was left by one that was killed, and nothing else.
void RefuseFilesOfOthers(const std::string& path, const fs::path& aside, const std::string& name,
                         const std::string& input) {
  std::error_code error;
  const fs::path within = fs::weakly_canonical(input, error).lexically_relative(aside);
  bool is_ours = within.empty() || *within.begin() == "..";
  for (const auto& entry : fs::directory_iterator(aside, error)) {
    is_ours = is_ours && entry.path().filename().string().starts_with(name);
  }
  if (is_ours) return;
  throw ConfigError(
      fmt::format("output {}: found files in {}, where it is made, expected none: move them away",
                  path, aside.string()));
}

void RefuseOutput(const std::string& path, bool is_folder) {
  std::error_code error;
  const std::string found = NoFileAt(path);
  if (!fs::exists(path, error)) return;
  const bool is_empty = is_folder ? fs::is_directory(path, error) && fs::is_empty(path, error)
                                  : found.empty() && fs::file_size(path, error) == 0;
  if (is_empty) return;
  throw ConfigError(fmt::format(
      "output {}: found {}, expected {}", path, found.empty() ? "a file" : found,
      is_folder ? "nothing, or an empty folder" : "nothing there: remove it, or name another"));
}

void LogCounts(const ConvertedCounts& counts) {
  for (const auto& [sensor, rows] : counts.rows) {
    spdlog::info("{}: {} {}", sensor, rows, sensor == "imu0" ? "samples" : "images");
  }
  LogWarnings(counts.warnings);
}

std::unique_ptr<RecordingTables> OpenInput(const ConvertArguments& arguments) {
  SequenceOptions opened = arguments.opened;
  opened.needs_imu = false;
  return OpenTables(arguments.input, opened);
}

// Throws ConfigError where there is one already.
OutputFolder FolderForRecording(const std::string& path, const std::vector<std::string>& inputs) {
  RefuseInputs(path, inputs);
  if (fs::exists(path + "/mav0")) {
    throw ConfigError(fmt::format(
        "output {0}: found a recording already, expected none: remove {0}/mav0, or name another",
        path));
  }
  return OutputFolder(path, {"a recording", {"mav0"}}, inputs);
}

void ConvertToFolder(const ConvertArguments& arguments, const std::string& path) {
  OutputFolder output = FolderForRecording(path, ListFolders(arguments.input));
  const auto recording = OpenInput(arguments);
  LogCounts(WriteAslRecording(*recording, arguments.part, output.staging() + "/mav0",
                              StageProgress("convert")));
  output.Commit();
}

void ConvertVideo(const ConvertArguments& arguments, const std::string& path) {
  const SequencePart whole;
  if (arguments.part.from_s != whole.from_s || arguments.part.duration_s != whole.duration_s ||
      !arguments.opened.topics.empty()) {
    throw ConfigError("found --from, --duration or --topics for a video, expected them for others");
  }
  UnpackVideoInto(path, arguments.input, arguments.video);
}

void ConvertToBag(const ConvertArguments& arguments, const std::string& path,
                  const BagPacking& packing) {
  MakeOutputBag(path, packing, arguments.input, [&](const std::string& at) {
    LogCounts(WriteBagRecording(*OpenInput(arguments), arguments.part, packing,
                                arguments.keep_files, at, StageProgress("convert")));
  });
}

void ConvertRecording(const ConvertArguments& arguments, const std::string& path,
                      const BagPacking& packing) {
  ExpectFolder(arguments.input, FolderKind::kSequence);
  if (packing.form == kFolder) {
    ConvertToFolder(arguments, path);
  } else {
    ConvertToBag(arguments, path, packing);
  }
}

void Convert(const ConvertArguments& arguments) {
  if (arguments.output.empty() == arguments.folder.empty()) {
    throw ConfigError("output: found OUT " +
                      std::string(arguments.output.empty() ? "and -o missing" : "and -o") +
                      ", expected one of them");
  }
  const std::string& path = arguments.output.empty() ? arguments.folder : arguments.output;
  arguments.part.Check();
  const BagPacking packing = ParsePacking(path, arguments.packing);
  const bool is_video = CheckVideoOptions(arguments.input, arguments.video);
  if (is_video && packing.form != kFolder) {
    throw ConfigError(arguments.input + ": found a video to become a " + packing.form +
                      ", expected a folder, which can be converted to a bag afterwards");
  }
  if (is_video) {
    ConvertVideo(arguments, path);
  } else {
    ConvertRecording(arguments, path, packing);
  }
  const bool has_calibration =
      packing.form == kFolder && !is_video && !IsBagRecording(arguments.input);
  spdlog::info("wrote {}{}", path,
               has_calibration ? ""
                               : "; a calibration is given to what opens it: slcmap run " + path +
                                     " --calibration rig.yaml" +
                                     (is_video ? ""
                                               : "; slcmap calibration " + arguments.input +
                                                     " -o rig.yaml writes the one that is there"));
}

}  // namespace

bool CheckVideoOptions(const std::string& input, const VideoRecording& video) {
  const bool is_video = IsVideoRecording(input);
  const bool are_said = !video.logs.empty() || !video.frame_times.empty() || !video.right.empty() ||
                        video.side_by_side;
  if (are_said && !is_video) {
    throw ConfigError(input +
                      ": found --imu, --frame-times, --right or --side-by-side, expected them for "
                      "a video alone");
  }
  if (!video.right.empty() && video.side_by_side) {
    throw ConfigError("found --right and --side-by-side, expected one of them");
  }
  return is_video;
}

void RefuseVideo(const std::string& path) {
  if (!IsVideoRecording(path)) return;
  throw DataError(path +
                  ": found a video, expected a recorded sequence: slcmap convert makes a folder of "
                  "one, and slcmap run takes it as it is");
}

void UnpackVideoInto(const std::string& path, const std::string& input,
                     const VideoRecording& said) {
  const VideoRecording recording = FindVideoRecording(input, said);
  std::vector<std::string> inputs = recording.logs;
  for (const std::string& file : {recording.left, recording.right, recording.frame_times}) {
    if (!file.empty()) inputs.push_back(file);
  }
  OutputFolder output = FolderForRecording(path, inputs);
  const VideoCounts counts =
      UnpackVideo(recording, output.staging() + "/mav0", StageProgress("convert"));
  LogCounts(
      {{{"cam0", counts.left}, {"cam1", counts.right}, {"imu0", counts.imu}}, counts.warnings});
  output.Commit();
}

void AddVideoOptions(CLI::App& command, VideoRecording* video) {
  command.add_option("--imu", video->logs,
                     "Log of a video's IMU (.csv or .jsonl), twice where its sensors are apart "
                     "(default: the one called as the video is)");
  command.add_option("--frame-times", video->frame_times,
                     "Table of when a video's frames were taken, on the IMU's clock");
  command.add_option("--right", video->right, "Video of the right camera");
  command.add_flag("--side-by-side", video->side_by_side,
                   "The video holds left and right images beside each other");
}

void MakeOutputBag(const std::string& path, const BagPacking& packing, const std::string& input,
                   const std::function<void(const std::string& at)>& make) {
  // A db3 is a folder, or by its ending the file in it.
  const bool is_in_folder = packing.form == "db3" && path.ends_with(".db3");
  const bool is_folder = packing.form == "db3" && !is_in_folder;
  RefuseInputs(path, {input});
  const fs::path whole = FolderItself(path), aside = whole.string() + ".unfinished";
  const std::string name = (is_in_folder ? whole.stem() : whole.filename()).string();
  RefuseFilesOfOthers(path, aside, name, input);
  RefuseOutput(path, is_folder);
  std::error_code error;
  fs::remove_all(aside, error);  // of one that was killed
  const std::shared_ptr<void> removed(nullptr, [&](void*) { fs::remove_all(aside, error); });
  MakeFolder(aside);
  make(aside / name);
  const fs::path made = is_in_folder ? aside / name / (name + "_0.db3") : aside / name;
  if (is_folder) fs::remove(path, error);  // where it is empty
  fs::rename(made, LinkTarget(path), error);
  if (error) throw OutputError(fmt::format("{}: cannot be written: {}", path, error.message()));
}

void AddConvertCommand(CLI::App& app) {
  CLI::App* command =
      app.add_subcommand("convert", "Write a recording anew, as a folder (ASL) or as a bag");
  const auto arguments = std::make_shared<ConvertArguments>();
  command
      ->add_option(
          "recording", arguments->input,
          "EuRoC (ASL) or TUM VI folder; a bag: ROS 1, rosbag2 (file or folder) or MCAP; or a "
          "video (mp4, mkv, mov, avi) with a log of its IMU")
      ->type_name("IN")
      ->required();
  command->add_option("to", arguments->output, "Folder, or a bag by its ending: .bag, .db3, .mcap")
      ->type_name("OUT");
  command->add_option("-o,--output", arguments->folder, "The same as OUT");
  command
      ->add_option(
          "--packing", arguments->packing,
          "How a bag is packed: none (default); lz4 or bz2 (bag); zstd (db3); lz4, zstd or "
          "unchunked (mcap). Where OUT has no ending, the kind before it: db3,zstd")
      ->type_name("KIND");
  command->add_flag("--keep-files", arguments->keep_files,
                    "Images that are PNG or JPEG files go into bags as they are");
  command
      ->add_option("--topics", arguments->opened.topics,
                   "Which topics are the rig's, any of them; other= for each further camera; imu= "
                   "for gyro= and accel= in one (default: by types and names)")
      ->type_name("left=A,right=B,imu=C");
  command->add_option("--from", arguments->part.from_s,
                      "Start so many seconds after the first image");
  command->add_option("--duration", arguments->part.duration_s,
                      "Seconds of the recording to use; 0: to the end");
  AddVideoOptions(*command, &arguments->video);
  command->footer(
      "Examples:\n  slcmap convert walk.bag walk\n"
      "  slcmap convert MH_01_easy MH_01_easy.mcap --packing zstd --duration 60\n"
      "  slcmap convert walk.mp4 walk --imu imu.csv\n"
      "  slcmap convert walk rig --topics left=/oak/left/image_raw,right=/oak/right/image_raw\n\n"
      "Images keep the stamps of their headers; topics are named as EuRoC's. All commands open\n"
      "bags as they are, and run videos: this is for other programs, and parts of recordings.");
  command->callback([arguments] { Convert(*arguments); });
}

}  // namespace slcmap::commands
