// The map stage as commands run it: a run folder in, a map folder out.
#pragma once

#include <string>

#include "data/output_folder.h"
#include "data/pose_form.h"
#include "data/sequence.h"
#include "mapping/map.h"
#include "mapping/options.h"

namespace slcmap {

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
  std::string into;     // a map folder that the run's map is merged into; "": into none
  std::string at;       // with it: about where, as --at says it
  bool sparse = false;  // from the run alone, without its recording's images
  bool accept_changed = false;
  int threads = 2;  // the results are the same with any
};

// Reads the run (also of files that were changed, if asked to) or the poses and builds the map,
// writes and returns it, and logs what both hold and what they lack. After Ctrl-C the map is what
// is done so far, and says that it is partial; what is merged into another is none then. Throws
// what reading, mapping, merging and writing throw; an earlier map then stays as it was.
MapResult RunMapStage(const MapArguments& arguments, MappingOptions options, OutputFolder* output);

}  // namespace slcmap
