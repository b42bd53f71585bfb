// A site, the jobs of it, what each waits for, as the workflow's engine reads them, and whether
// what is there is what they would make.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "data/io/json.h"
#include "data/source/sequence_source.h"

namespace slcmap::inline batch {

struct SiteRecording {
  std::string name;        // of its folder: a-z, A-Z, digits, '.', '_' and '-'
  std::string path;        // in full: an EuRoC (ASL) or TUM VI folder, or a bag
  SequenceOptions opened;  // calibration (paths in full), cameras and topics
  std::string building;    // any text, as of the storey
  std::string storey;      // "": not said, as of a walk through several
  std::string date;        // YYYY-MM-DD; "": not said
};

// An image of a storey's plan, or of a building's of one storey.
struct SitePlan {
  std::string building, storey;
  std::string image;  // in full
  double pixel_m = 0;
};

// Control points of a building, as `georeference --control` takes them.
struct SiteControl {
  std::string building;
  std::string points;  // a file, in full
  std::string crs;     // "": a grid without a name
};

struct Site {
  std::vector<SiteRecording> recordings;  // by date and name: the first of a building has its world
  std::string method;                     // "": the configuration's
  std::string config;                     // a file; "": the defaults
  std::vector<std::string> exports;       // formats of `export`, and "page"
  std::vector<SitePlan> plans;
  std::vector<SiteControl> control;  // one a building at most
  std::string names;  // file of what rooms and the like are called, in full; "": none
};

// Beside the formats of `export`.
inline constexpr const char* kPageFormat = "page";

// The building of recordings that do not say one.
inline constexpr const char* kOnlyBuilding = "building";

// Null of a building that has none.
const SiteControl* FindControl(const Site& site, const std::string& building);

// Reads a site file; paths are from its folder, and those of recordings may have wildcards, for
// which all folders stand that match. Throws ConfigError for keys and values that cannot be; of
// what is wrong with names, files, recordings' folders and calibrations it names all that there is.
Site ReadSite(const std::string& path);

// What the jobs of a site left: a result.json in the folder of each, written last and all at once.

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
  // Of the control points that were given, those that place it, and how far they are off; none
  // given: it was not placed on such.
  int points_used = 0, points_given = 0;
  double rms_mm = 0;
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
  // (wall or thing), `is_new` (else it is gone), `after` and `by` (dates), `area_m2`, `size_m`
  // along the axes of the map of `world_of`, and `middle_m` in its world, or with `crs` in that
  // system ("" of a grid without a name).
  Json changes = Json::array();
};

// `folder` is that of the job. None where no job has ended there, or the file is damaged, as by a
// power failure: then the job is done again.
std::optional<JobResult> ReadJobResult(const std::string& folder);

// All but the key.
Json ResultJson(const JobResult& result);

// Throws OutputError.
void WriteJobResult(const std::string& folder, const JobResult& result);

// The jobs of a site and what each waits for, as the workflow's engine reads them, and whether what
// is there is what they would make.

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

// What stands for a building or storey in names of jobs: its name where that is of letters that
// those have.
std::string FolderName(const std::string& name);

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

// How far a site has come, by what its jobs left: for people and for programs.

struct JobStatus {
  std::string name;                // of the job
  std::string state;               // waiting, running, done or failed
  JobResult result;                // of a job that is done or failed
  std::vector<std::string> files;  // its pages and logs, from the site's folder
};

struct RecordingStatus : JobStatus {
  SiteRecording recording;
  std::string map;  // the largest that it is in, from the site's folder; "": none yet
};

struct SiteStatus {
  std::vector<RecordingStatus> recordings;
  std::vector<JobStatus> others;  // merges and exports

  // Of the jobs that failed, in words: "2 of 30 recordings, first NAME: REASON"; "" where none did.
  std::string Failures() const;
};

// Reads results alone; `folder` is the site's.
SiteStatus ReadStatus(const std::string& folder, const Workflow& workflow);

std::string StatusTable(const SiteStatus& status);  // for a terminal
std::string StatusJson(const SiteStatus& status);
std::string StatusPage(const SiteStatus& status);  // HTML that needs no other file

}  // namespace slcmap::batch
