// slcmap georeference, and what other commands share with it.
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <set>

#include "apps/commands/commands.h"
#include "apps/commands/map_stage.h"
#include "apps/commands/progress.h"
#include "data/calibration/calibration.h"
#include "data/core/coordinate_system.h"
#include "data/core/error.h"
#include "data/core/math.h"
#include "data/io/output_folder.h"
#include "mapping/control/control.h"
#include "mapping/control/triangulation.h"
#include "mapping/map/map_folder.h"

namespace slcmap::inline commands {
namespace {

constexpr double kMostSigmas = 4;

std::ptrdiff_t CountPoints(const ControlFit& fit, ControlStatus status) {
  return std::ranges::count(fit.points, status, &ControlResidual::status);
}

void LogOutliers(const ControlFit& fit) {
  for (const ControlResidual& point : fit.points) {
    const Eigen::Vector3d off_mm = 1e3 * point.off_m;
    if (point.status == ControlStatus::kUnseen) {
      spdlog::warn("control point '{}' was not seen well enough to be placed", point.name);
    } else if (point.status == ControlStatus::kUsed && point.over_sigma > kMostSigmas) {
      spdlog::warn(
          "control point '{}' is used though it is {:.1f} sigma off: is it right, and are all "
          "sigmas?",
          point.name, point.over_sigma);
    } else if (point.status == ControlStatus::kOutlier) {
      spdlog::warn(
          "control point '{}' is left out: the map has it {:.0f} mm to the east, {:.0f} mm to the "
          "north and {:.0f} mm above where it was given, {:.1f} sigma",
          point.name, off_mm.x(), off_mm.y(), off_mm.z(), point.over_sigma);
    }
  }
}

void LogScale(const ControlFit& fit) {
  constexpr double kTelling = 1e-3;
  const double too_long = fit.map_scale - 1;
  if (std::abs(too_long) < std::max(kTelling, kMostSigmas * fit.map_scale_sigma)) return;
  spdlog::warn(
      "by the control points the map is {:.2f} % too {}: the calibration of the cameras may be "
      "off, "
      "or the grid has another scale",
      100 * std::abs(too_long), too_long > 0 ? "large" : "small");
}

void LogFit(const ControlFit& fit, const std::optional<Georeference>& place) {
  for (const DistanceResidual& d : fit.distances) {
    const double off_m = d.mapped_m - d.given_m;
    const bool is_off = std::abs(off_m) > kMostSigmas * d.sigma_m;
    spdlog::log(
        is_off ? spdlog::level::warn : spdlog::level::info,
        "from '{}' to '{}': given {:.4f} m, mapped {:.4f} m, {:+.1f} mm ({:.1f} mm 1 sigma){}",
        d.from, d.to, d.given_m, d.mapped_m, 1e3 * off_m, 1e3 * d.sigma_m,
        is_off ? ": were these two points measured, in metres, and do both tags have one place?"
               : "");
  }
  if (fit.points.empty() || !place) return;
  LogOutliers(fit);
  LogScale(fit);
  const auto used = CountPoints(fit, ControlStatus::kUsed);
  spdlog::info(
      "{} of {} control points place the map, off by {:.1f} mm (RMS): its origin is at {:.3f}, "
      "{:.3f}, {:.3f} m{}, turned by {:.4f} degrees, grid scale {:.6f}",
      used, fit.points.size(), 1e3 * fit.rms_m, place->origin_m.x(), place->origin_m.y(),
      place->origin_m.z(), place->crs.empty() ? "" : " in " + place->crs,
      place->turn_rad * kDegreesPerRadian, place->scale);
  if (used == 2) spdlog::warn("two control points check neither each other nor the map");
}

void WarnOfOtherNames(const Control& control) {
  const std::vector<std::string> names = ListNames(control);
  std::set<std::string> others;
  for (const Sighting& sighting : control.sightings) {
    if (std::ranges::find(names, sighting.name) == names.end()) others.insert(sighting.name);
  }
  if (others.empty()) return;
  spdlog::warn("--marks: {} are of no control point or distance: are names written alike?",
               fmt::join(others, ", "));
}

Control ReadControl(const ControlArguments& arguments) {
  Control control{.path = arguments.control, .crs = arguments.crs};
  if (!arguments.control.empty()) control.points = ReadControlPoints(arguments.control);
  for (const std::string& text : arguments.distances) {
    control.distances.push_back(ParseDistance(text));
  }
  if (!arguments.marks.empty()) control.sightings = ReadMarks(arguments.marks);
  WarnOfOtherNames(control);
  FindGridScale(control);  // refuses systems and points that cannot be
  control.crs = NameOfSystem(control.crs);
  return control;
}

}  // namespace

std::vector<std::string> ControlArguments::Files() const {
  std::vector<std::string> files;
  for (const std::string& file : {control, marks}) {
    if (!file.empty()) files.push_back(file);
  }
  return files;
}

void AddControlOptions(CLI::App& command, ControlArguments* arguments) {
  CLI::Option* control =
      command
          .add_option(
              "--control", arguments->control,
              "Control points: name,easting_m,northing_m,height_m and perhaps sigma_m; a "
              "name is that of an AprilTag or ArUco tag that images show, as tag36h11:5, or "
              "of marks")
          ->type_name("CSV");
  command
      .add_option("--crs", arguments->crs,
                  "Coordinate system of the control points, in metres, as EPSG:25832 (default: a "
                  "grid without a name)")
      ->type_name("EPSG")
      ->needs(control);
  command
      .add_option("--marks", arguments->marks,
                  "Where images of the recording show points: name,stamp_ns,camera,x_px,y_px; 0 is "
                  "the left camera")
      ->type_name("CSV");
  command
      .add_option("--distance", arguments->distances,
                  "A known distance between two tags or marks, and perhaps how well it is known "
                  "(default: 0.003 m): map and run pull the map to it; can be repeated")
      ->type_name("NAME1,NAME2,METRES[,SIGMA_M]")
      ->allow_extra_args(false);
}

ControlStage::ControlStage(const ControlArguments& arguments) : control_(ReadControl(arguments)) {
  if (!arguments.marks.empty() && !IsWanted()) {
    throw ConfigError("--marks: found no --control or --distance, expected one that names points");
  }
}

std::optional<Control> ControlStage::FindInRun(const OdometryRun& run, const std::string& sequence,
                                               const Progress& progress) {
  if (!IsWanted()) return std::nullopt;
  try {
    given_rig_ = AddTags(ControlRecordingOfRun(run, sequence), progress, &control_);
  } catch (const DataError& error) {
    fault_ = error.what();
    return std::nullopt;
  }
  if (run.source) given_rig_ = run.source->raw_rig;
  return control_;
}

void ControlStage::FindInMap(const MapResult& map, const std::string& folder,
                             const std::string& sequence, const Progress& progress) {
  const std::vector<ControlRecording> recordings = ListControlRecordings(map, sequence);
  for (size_t i = 0; i < recordings.size(); ++i) {
    const double from = static_cast<double>(i), count = static_cast<double>(recordings.size());
    const Rig rig =
        AddTags(recordings[i], progress.Part(from / count, (from + 1) / count), &control_);
    if (i == 0) given_rig_ = rig;
  }
  const std::string calibration = folder + "/calibration.yaml";
  if (Exists(calibration)) {
    Warnings of_no_imu;
    calibrated_rig_ = ReadKalibrCalibration(calibration, "", &of_no_imu).rig;
  }
}

void ControlStage::Place(MapResult* map) {
  if (!IsWanted() || !fault_.empty()) return;
  if (map->calibrated_rig) calibrated_rig_ = map->calibrated_rig;
  try {
    PlaceOnControl(control_, CamerasOfMap(given_rig_, calibrated_rig_), map);
    LogFit(*map->control, map->source.georeference);
  } catch (const DataError& error) {
    fault_ = error.what();
  }
}

void ControlStage::RequirePlaced() const {
  if (!fault_.empty()) throw DataError(fault_);
}

namespace {

struct GeoreferenceArguments {
  std::string map, output, sequence;
  ControlArguments control;
  bool accept_changed = false;
};

void PlaceMap(const GeoreferenceArguments& arguments) {
  ExpectFolder(arguments.map, FolderKind::kMap);
  if (arguments.control.control.empty() && arguments.control.distances.empty()) {
    throw ConfigError("georeference: found no points, expected --control or --distance");
  }
  ControlStage control(arguments.control);
  std::vector<std::string> inputs = arguments.control.Files();
  inputs.push_back(arguments.map);
  OutputFolder output(arguments.output, MapFiles(), inputs);
  MapResult map = ReadMapToShow(arguments.map, arguments.accept_changed);
  control.FindInMap(map, arguments.map, arguments.sequence, StageProgress("tags"));
  control.Place(&map);
  control.RequirePlaced();
  output.Open();
  WriteMapFolder(&output, map);
  spdlog::info("wrote {}: the map with {}", output.path(), fmt::join(kControlFiles, " and "));
}

}  // namespace

void AddGeoreferenceCommand(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "georeference", "Place a map on control points, and tell how it lies on them");
  const auto arguments = std::make_shared<GeoreferenceArguments>();
  command->add_option("map", arguments->map, "Map folder")->type_name("MAP")->required();
  AddControlOptions(*command, &arguments->control);
  command->add_option("-o,--output", arguments->output, "Map folder to write, with the place")
      ->type_name("MAP")
      ->required();
  command->add_option("--sequence", arguments->sequence,
                      "Where the recording of the map is, if it has moved since");
  command->add_flag("--accept-changed", arguments->accept_changed,
                    "Also take a map whose files are not as map wrote them");
  command->footer(
      "Examples:\n  slcmap georeference OUT/map --control control.csv --crs EPSG:25832 -o PLACED\n"
      "  slcmap georeference OUT/map --distance tag36h11:1,tag36h11:2,12.345 -o CHECKED\n\n"
      "The map stays as it is; slcmap map with the same options also pulls it to points and "
      "distances.\n"
      "georeference.json and control_points.csv say how far each point is off, in mm.");
  command->callback([arguments] { PlaceMap(*arguments); });
}

}  // namespace slcmap::commands
