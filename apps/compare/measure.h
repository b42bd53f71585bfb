// Measures what methods made of one sequence, all with the same observations.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/compare/comparison.h"
#include "apps/evaluation/straightness.h"
#include "data/core/progress.h"

namespace slcmap::inline evaluation {

// The folders of one finished run.
struct RunFolders {
  std::string run;
  std::string map;  // made without images
};

struct MeasuredMethod {
  std::string name;
  std::vector<RunFolders> runs;      // by repeat; none of a given trajectory
  Trajectory given;                  // another system's; none of a method that has runs
  std::vector<std::string> remarks;  // on runs that gave nothing
};

struct MeasuredSequence {
  std::string name, path;
  // Files: where there are none, "".
  std::string true_poses, true_edges;
  std::vector<MeasuredMethod> methods;
  // Of `methods`, whose first run gives the observations; nothing: straightness is not measured.
  std::optional<size_t> reference;
};

// The files of true poses and edges of a sequence: those of a simulated one in truth/ beside or in
// its folder, or EuRoC's and TUM VI's own. "" where there are none.
std::string FindTruePoses(const std::string& sequence);
std::string FindTrueEdges(const std::string& sequence);

// The first method with runs that tracked lines by both cameras, `slc` before others.
std::optional<size_t> ReferenceAmong(const std::vector<MeasuredMethod>& methods);

// Throws DataError where files cannot be read, and StoppedError when progress says so.
SequenceResult MeasureSequence(const MeasuredSequence& sequence, const Progress& progress = {});

}  // namespace slcmap::evaluation
