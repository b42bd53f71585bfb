// The map stage as commands run it, a run folder in, a map folder out, and how maps are read.
#pragma once

#include <spdlog/spdlog.h>

#include <string>

#include "data/core/error.h"
#include "data/io/output_folder.h"
#include "data/io/trajectory.h"
#include "data/source/sequence.h"
#include "mapping/map/map.h"
#include "mapping/map/names.h"
#include "mapping/options.h"

namespace CLI {
class App;
}

namespace slcmap::inline commands {

class PlanStage;
class ControlStage;

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

// The map stage as commands run it: a run folder in, a map folder out.

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
