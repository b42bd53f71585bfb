// The jobs of a site and what each waits for, as the workflow's engine reads them, and whether what
// is there is what they would make.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/batch/site.h"

namespace slcmap::inline batch {

// A job is named by its folder in the site's.
inline constexpr const char* kRecordingJobs = "recordings";
inline constexpr const char* kPlaceJobs = "places";
inline constexpr const char* kMergeJobs = "merges";
inline constexpr const char* kExportJobs = "exports";

struct Job {
  std::string name;                // such as recordings/NAME
  std::vector<std::string> after;  // jobs whose results it takes
  std::string key;  // of a recording: its checksum with its options, and that of its control
  std::optional<SitePlan> plan;  // of an export
};

struct Workflow {
  std::string program;  // slcmap, that runs the jobs
  Site site;
  std::vector<Job> jobs;  // each behind those that it waits for

  // Throws DataError where there is none of that name.
  const Job& Find(const std::string& name) const;
  const SiteRecording& FindRecording(const std::string& name) const;
};

bool IsRecordingJob(const Job& job);
std::string RecordingName(const Job& job);

// A job a recording; one a building that says where its maps lie; a tree of merges a storey, and
// one of the storeys' a building, so that merges go side by side and a new recording redoes few; an
// export a building, and a storey with a plan.
std::vector<Job> PlanJobs(const Site& site);

// Files of a site's folder, all of them in its folder `workflow`.
inline constexpr const char* kWorkflowFile = "workflow/config.json";
inline constexpr const char* kOptionsFile = "workflow/options.yaml";  // a copy of Site::config
inline constexpr const char* kMarksFolder = "workflow/done";  // a mark a job, for the engine

// Throws OutputError.
void WriteWorkflow(const std::string& folder, const Workflow& workflow);

// Throws DataError where there is none.
Workflow ReadWorkflow(const std::string& folder);

// What a building's control points are, of which its maps' places are made; "" of none.
std::string DescribeControl(const Site& site, const std::string& building);

// What a job is made of, by what is there now. `folder` is the site's.
std::string ComputeJobKey(const std::string& folder, const Workflow& workflow, const Job& job);

// What a place job leaves in its folder: where maps lie (see apps/commands/place_stage.h).
inline constexpr const char* kPlacementFile = "placement.json";

// Whether a job's result is what it would make again.
bool IsCurrent(const std::string& folder, const Workflow& workflow, const Job& job);

// The id of the map in a folder; "" of none.
std::string MapIdIn(const std::string& folder);

}  // namespace slcmap::batch
