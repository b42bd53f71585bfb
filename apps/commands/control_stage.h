// A map on control points, as commands do it.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "data/core/progress.h"
#include "mapping/control/control_points.h"
#include "mapping/map/map.h"
#include "odometry/run/run.h"

namespace slcmap::inline commands {

struct ControlArguments {
  std::string control, marks, crs;     // files, and a system's name; "": none
  std::vector<std::string> distances;  // as --distance says them

  std::vector<std::string> Files() const;
};

// Adds --control, --crs, --marks and --distance; `arguments` must outlive the parsing.
void AddControlOptions(CLI::App& command, ControlArguments* arguments);

// Points and marks are read before the work begins. A map that they do not place is a map all the
// same: it is kept, and what is wrong is said in the end.
class ControlStage {
 public:
  // Throws ConfigError and DataError for points, marks and systems that are none.
  explicit ControlStage(const ControlArguments& arguments);

  // Looks for tags in the images of a run that is to be mapped. Nothing where no points were
  // given, or its recording is not there.
  std::optional<Control> FindInRun(const OdometryRun& run, const std::string& sequence,
                                   const Progress& progress);

  // Looks for tags in the recordings of a map. `folder`: of the map, with its calibration.
  void FindInMap(const MapResult& map, const std::string& folder, const std::string& sequence,
                 const Progress& progress);

  // Places the map by what was found, and logs how it lies.
  void Place(MapResult* map);

  // Throws DataError where the map has no place.
  void RequirePlaced() const;

 private:
  bool IsWanted() const { return !control_.points.empty() || !control_.distances.empty(); }

  Control control_;
  Rig given_rig_;                      // of the recording
  std::optional<Rig> calibrated_rig_;  // as the map has found it
  std::string fault_;
};

}  // namespace slcmap::commands
