#include "apps/commands/options.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <filesystem>
#include <set>

#include "apps/commands/commands.h"
#include "data/calibration/mask.h"
#include "data/calibration/other_calibrations.h"
#include "data/core/error.h"
#include "data/io/csv.h"

namespace slcmap::inline commands {
namespace {

CLI::Option* AddMilliseconds(CLI::App& command, const std::string& name, double* value_s,
                             const std::string& words) {
  return command
      .add_option_function<double>(
          name, [value_s](const double& value_ms) { *value_s = 1e-3 * value_ms; }, words)
      ->type_name("MS");
}

}  // namespace

std::vector<CLI::Option*> AddSequenceOptions(CLI::App& command, SequenceOptions* options) {
  return {command.add_option("--calibration", options->calibration,
                             "Kalibr camera chain, a folder with sensor.yaml files, or others, "
                             "several by commas, as slcmap calibration takes them (default: the "
                             "sequence's own)"),
          command
              .add_option("--mask", options->masks,
                          "Image of what moves with the rig, white, a camera: it is left out "
                          "(default: what the check finds; none: nothing)")
              ->delimiter(',')
              ->allow_extra_args(false)
              ->type_name("LEFT,RIGHT"),
          command
              .add_option("--cameras", options->cameras,
                          "Which of a rig's cameras are used, the right one of a pair behind its "
                          "left one (default: all)")
              ->delimiter(',')
              ->allow_extra_args(false)
              ->type_name("I,J"),
          command
              .add_option("--topics", options->topics,
                          "Which topics of a bag are the rig's, any of them; other= for each "
                          "further camera; imu= for gyro= and accel= in one (default: by types "
                          "and names)")
              ->type_name("left=A,right=B,imu=C"),
          AddMilliseconds(command, "--pair-tolerance", &options->max_stereo_offset_s,
                          "Between the stamps of a left and a right image, at most (default: 3)"),
          AddMilliseconds(command, "--right-offset", &options->right_offset_s,
                          "That stamps of the right images are late (default: 0)")};
}

std::vector<std::string> SequenceArguments(const SequenceOptions& options) {
  std::vector<std::string> arguments;
  const auto add = [&](const char* name, const std::string& value) {
    if (!value.empty()) arguments.insert(arguments.end(), {name, value});
  };
  const auto milliseconds = [](double value_s, double default_s) {
    return value_s == default_s ? "" : fmt::format("{}", 1e3 * value_s);
  };
  const SequenceOptions defaults;
  add("--calibration", options.calibration);
  add("--mask", fmt::format("{}", fmt::join(options.masks, ",")));
  add("--cameras", fmt::format("{}", fmt::join(options.cameras, ",")));
  add("--topics", options.topics);
  add("--pair-tolerance", milliseconds(options.max_stereo_offset_s, defaults.max_stereo_offset_s));
  add("--right-offset", milliseconds(options.right_offset_s, defaults.right_offset_s));
  return arguments;
}

std::vector<std::string> CollectFiles(const SequenceOptions& options) {
  std::vector<std::string> files;
  if (!options.calibration.empty()) files = SplitCalibrationPaths(options.calibration);
  for (const std::string& mask : options.masks) {
    if (mask != kNoMask) files.push_back(mask);
  }
  return files;
}

std::vector<CLI::Option*> AddPoseOptions(CLI::App& command, PoseForm* form) {
  return {
      command
          .add_option("--poses-of", form->of,
                      "What each row is the pose of: imu or camera (the left one) in the world, or "
                      "the inverse: world-in-imu, world-in-camera")
          ->capture_default_str(),
      command.add_option("--quaternion", form->quaternion,
                         "Order of the quaternions: xyzw or wxyz, with -conjugated behind it for "
                         "inverse rotations (default: as the form of the file has it)"),
      command
          .add_option("--up", form->up,
                      "Where up is in the world of the poses: z, -z, y, -y, x, -x, or x,y,z")
          ->capture_default_str(),
      command.add_option("--poses-scale", form->scale, "Metres a unit of the poses' positions")
          ->capture_default_str(),
      command.add_option("--poses-stamps", form->stamps,
                         "Unit of the poses' stamps: ns, us, ms or s; or a file with the stamp of "
                         "each row (default: told by their rate and times)"),
      command.add_option("--poses-offset", form->offset_s, "Added to the poses' stamps [s]")
          ->capture_default_str()};
}

void AddOdometryOptions(CLI::App& command, OdometryArguments* arguments) {
  command
      .add_option(
          "sequence", arguments->sequence,
          "EuRoC (ASL) or TUM VI folder: the one with cam0, cam1, imu0, or the one above; or "
          "a bag: ROS 1, rosbag2 (file or folder) or MCAP; without cam1, of one camera; run also "
          "takes a video (mp4, mkv, mov, avi) with a log of its IMU")
      ->required();
  command.add_option("--method", arguments->method,
                     "slc (default: points, structural lines, points on lines), structural, "
                     "points-lines, points or points-mono (left camera only)");
  command.add_option("--config", arguments->config, "YAML file that overrides options");
  AddSequenceOptions(command, &arguments->opened);
  command.add_option("--write-calibration", arguments->write_calibration,
                     "Write the calibration as it was found to this file, a Kalibr camera chain");
  command.add_option("--from", arguments->part.from_s,
                     "Start so many seconds after the first image");
  command.add_option("--duration", arguments->part.duration_s,
                     "Seconds of the recording to use; 0: to the end");
  command
      .add_option(
          "--threads", arguments->threads,
          "Threads, beside the one that reads ahead: 1 does everything one after the other; "
          "with 2, points and lines, and window and next image go side by side; more are "
          "not used. Same results with any")
      ->capture_default_str();
  command.add_flag("--force", arguments->start.force,
                   "Go on in spite of errors that the check before the start finds");
  command.add_flag("!--no-check", arguments->start.check,
                   "Start as calibrated, without the check of IMU, calibration and geometry that "
                   "finds the time offset and the right camera's turn");
  command.add_flag(
      "--realtime", arguments->real_time,
      "Play the recording at its own pace; images are skipped where newer ones are due");
}

namespace {

// "a=b" of a map; a path alone is called as its file.
NamedMap ParseNamedMap(const std::string& text) {
  const size_t equals = text.find('=');
  NamedMap map;
  map.path = equals == std::string::npos ? text : text.substr(equals + 1);
  map.name = equals == std::string::npos
                 ? std::filesystem::weakly_canonical(text).filename().string()
                 : text.substr(0, equals);
  if (map.name.empty() || map.path.empty() || map.name.find(',') != std::string::npos) {
    throw ConfigError(fmt::format("--maps: found {}, expected NAME=FILE or NAME=FOLDER", text));
  }
  if (!Exists(map.path)) {
    throw ConfigError(
        fmt::format("--maps: found nothing at {}, expected a file or a folder", map.path));
  }
  return map;
}

void SetScale(const std::string& text, std::vector<NamedMap>* maps) {
  const size_t equals = text.find('=');
  const double scale =
      equals == std::string::npos ? 0 : ParseNumber(text.substr(equals + 1)).value_or(0);
  const auto map = std::find_if(maps->begin(), maps->end(), [&](const NamedMap& m) {
    return equals != std::string::npos && m.name == text.substr(0, equals);
  });
  if (map == maps->end() || !(scale > 0 && scale < 1e6)) {
    throw ConfigError(fmt::format(
        "--map-scale: found {}, expected NAME=S with the name of one of --maps and S in metres a "
        "unit, such as 0.001",
        text));
  }
  map->scale = scale;
}

}  // namespace

CLI::Option* AddExternalMapOptions(CLI::App& command, ExternalMapArguments* arguments) {
  CLI::Option* maps = command.add_option(
      "--maps", arguments->maps,
      "Maps by any system, instead of trajectories: NAME=PATH of a PLY, OBJ, DXF, PCD or LAS file, "
      "of text (limap, Line3D++, points, segments), or of a folder (limap, a map of ours)");
  command
      .add_option("--true-map", arguments->truth,
                  "A laser scan or a mesh of the building, that the maps are laid on")
      ->needs(maps);
  command
      .add_flag("--as-they-are", arguments->as_they_are,
                "The maps are in the world of --true-map and stay where they are")
      ->needs(maps);
  command
      .add_option("--map-scale", arguments->scales,
                  "NAME=S: metres of a unit of that map, such as 0.001")
      ->needs(maps);
  command.add_option("--true-scale", arguments->true_scale, "Metres of a unit of --true-map")
      ->needs(maps)
      ->check(CLI::PositiveNumber);
  return maps;
}

MapsToMeasure CollectMaps(const ExternalMapArguments& arguments) {
  MapsToMeasure maps;
  std::set<std::string> names;
  for (const std::string& text : arguments.maps) {
    maps.maps.push_back(ParseNamedMap(text));
    if (names.insert(maps.maps.back().name).second) continue;
    throw ConfigError(fmt::format("--maps: found {} twice, expected different names: NAME=PATH",
                                  maps.maps.back().name));
  }
  for (const std::string& text : arguments.scales) SetScale(text, &maps.maps);
  maps.truth = arguments.truth;
  maps.true_scale = arguments.true_scale;
  maps.as_they_are = arguments.as_they_are;
  return maps;
}

std::vector<std::string> CollectFiles(const MapsToMeasure& maps) {
  std::vector<std::string> files;
  for (const NamedMap& map : maps.maps) files.push_back(map.path);
  if (!maps.truth.empty()) files.push_back(maps.truth);
  return files;
}

}  // namespace slcmap::commands
