// How far a site has come, by what its jobs left: for people and for programs.
#pragma once

#include <string>
#include <vector>

#include "apps/batch/results.h"
#include "apps/batch/workflow.h"

namespace slcmap::inline batch {

struct JobStatus {
  std::string name;   // of the job
  std::string state;  // waiting, running, done or failed
  JobResult result;   // of a job that is done or failed
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
