// What the jobs of a site left: a result.json in the folder of each, written last and all at once.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "data/io/json.h"

namespace slcmap::inline batch {

enum class JobState {
  kBegun,   // of a recording: the run is there, the map not yet
  kDone,    // perhaps with maps that stay apart
  kFailed,  // for a reason
};

std::string JobStateName(JobState state);

// A map, or an export of one, and the recordings in it. The path is from the site's folder.
struct JobMap {
  std::string path;
  std::vector<std::string> recordings;
};

// Two maps that were not merged, by their paths.
struct MapsApart {
  std::string first, second, reason;
};

struct JobResult {
  std::string key;  // says what it was made of
  JobState state = JobState::kFailed;
  std::string reason, remedy;  // of a failure; where a run was done, also of its verdict
  std::string verdict;         // of a recording's run; "": there is none
  double length_m = 0;         // of a recording's path
  std::vector<JobMap> maps;    // the first has the world of the job's first recording
  std::vector<MapsApart> apart;
  // Of maps that were placed, what later walks found otherwise than earlier ones, by date: `what`
  // (wall or thing), `is_new` (else it is gone), `after` and `by` (dates), `middle_m` and `size_m`
  // in the world of the map of `world_of`, `area_m2`.
  Json changes = Json::array();
};

// `folder` is that of the job. None where no job has ended there, or the file is damaged, as by a
// power failure: then the job is done again.
std::optional<JobResult> ReadJobResult(const std::string& folder);

// All but the key.
Json ResultJson(const JobResult& result);

// Throws OutputError.
void WriteJobResult(const std::string& folder, const JobResult& result);

}  // namespace slcmap::batch
