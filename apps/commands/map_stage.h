// The map stage as commands run it, a run folder in, a map folder out, on a plan and on control
// points, and how maps are read.
#pragma once

#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "data/core/error.h"
#include "data/core/progress.h"
#include "data/io/output_folder.h"
#include "data/io/trajectory.h"
#include "data/source/sequence.h"
#include "mapping/align/align_maps.h"
#include "mapping/control/control_points.h"
#include "mapping/map/map.h"
#include "mapping/map/names.h"
#include "mapping/options.h"
#include "mapping/plan/building_plan.h"
#include "odometry/run/run.h"

namespace slcmap::inline commands {

// A rough place by the text X,Y,Z,YAW_DEG, or with two lengths X,Y,YAW_DEG; none of "". Throws
// ConfigError, which names the option.
std::optional<RoughStart> ParseStart(const std::string& option, size_t lengths,
                                     const std::string& at);

struct PlanArguments {
  std::string plan;    // a file or a map folder; "": none
  double pixel_m = 0;  // of an image; 0: not said
  std::string at;      // about where the map's origin is, as --plan-at says it
};

// Adds --plan, --plan-pixel-m and --plan-at; `arguments` must outlive the parsing. Returns --plan.
CLI::Option* AddPlanOptions(CLI::App& command, PlanArguments* arguments);

// The plan is read before the work begins. A map that has no place in it is a map all the same: it
// is kept, and what is wrong is said in the end.
class PlanStage {
 public:
  // Throws ConfigError and DataError for a plan that is none.
  explicit PlanStage(const PlanArguments& arguments);

  // Puts the comparison into the map; nothing where no plan was given.
  void Compare(const Progress& progress, MapResult* map);

  // Throws DataError where the map had no place in the plan.
  void RequirePlaced() const;

 private:
  const PlanArguments arguments_;
  const std::optional<RoughStart> start_;  // of --plan-at
  std::vector<BuildingPlan> plans_;
  std::string fault_;
};

// A map on control points, as commands do it.

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

// What --names brings: "" of none.
class NamesFile {
 public:
  explicit NamesFile(std::string path);  // throws what ReadNames throws
  // Throws what ApplyNames throws, naming the file.
  void Apply(MapResult* map) const;

 private:
  std::string path_;
  Names names_;
};

void AddNamesOption(CLI::App& command, std::string* path);

// Counts runs and maps that were taken although their files were changed since, or they are not of
// the run beside them, as a warning.
inline constexpr const char* kChangedFilesAccepted = "changed_files_accepted";

// Calls and returns read(false), which refuses what was changed; where it is accepted all the same,
// read(true), which counts that among its warnings.
template <typename Read>
auto ReadAccepting(bool accept_changed, Read read) {
  try {
    return read(false);
  } catch (const DataError& error) {
    if (!accept_changed) throw;
    auto accepted = read(true);
    ++accepted.warnings[kChangedFilesAccepted];
    spdlog::warn("{}; accepted all the same", error.what());
    return accepted;
  }
}

// Reads a map folder, and warns where the map is partial; Ctrl-C ends the program meanwhile. Unless
// accept_changed, throws DataError for files that are not as `map` wrote them, and for a map of
// another run than that beside it.
MapResult ReadMapToShow(const std::string& folder, bool accept_changed);

// The options of the section `mapping` of a YAML file; the defaults for "". Throws ConfigError.
MappingOptions ReadMappingOptions(const std::string& config);

// What a map is made of.
struct MapArguments {
  std::string input;       // a run folder or, with poses, a sequence
  std::string poses;       // trajectory file of the sequence's IMU by anyone; "": input is a run
  PoseForm form;           // how that file says them
  SequenceOptions opened;  // how the sequence is opened, with poses
  std::string sequence;    // where the run's recording has moved to; "": it is where it was
  std::string config;
  std::string names;    // file of what rooms and the like are called; "": none
  bool sparse = false;  // from the run alone, without its recording's images
  bool accept_changed = false;
  int threads = 2;  // the results are the same with any
};

// Reads the run (also of files that were changed, if asked to) or the poses and builds the map,
// writes and returns it, and logs what both hold and what they lack. After Ctrl-C the map is what
// is done so far, and says that it is partial. Throws what reading, mapping and writing throw; an
// earlier map then stays as it was.
MapResult RunMapStage(const MapArguments& arguments, const MappingOptions& options, PlanStage* plan,
                      ControlStage* control, OutputFolder* output);

}  // namespace slcmap::commands
