// What the journal of a run says of the run so far, and of its own files, so that damage is told
// from what was not yet written. Include in .cc files only.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "data/checksum.h"
#include "data/json_file.h"
#include "odometry/run.h"

namespace slcmap {

// How many rows were written, and their checksum.
class WrittenRows {
 public:
  WrittenRows() = default;
  explicit WrittenRows(std::string_view rows) { Add(rows); }
  void Add(std::string_view rows);
  Json ToJson() const;

 private:
  int64_t rows_ = 0, bytes_ = 0;
  RunningChecksum checksum_;
};

// Throw DataError unless a file starts with those rows, or is one of several.
void CheckStart(const std::string& path, const Json& expected);
void CheckWhole(const std::string& path, const Json& one_of);

// Replaces the journal's state.json, which holds the figures, warnings and line deviation of `run`,
// what finished.csv starts with, and what window.csv may be, the newest first. Throws OutputError.
void WriteJournalState(const std::string& path, const OdometryRun& run, const WrittenRows& finished,
                       const std::vector<WrittenRows>& window);

// Fills what WriteJournalState() took from a run; returns the whole. Throws DataError.
Json ReadJournalState(const std::string& path, OdometryRun* run);

// Renames PATH.new: a reader finds the old file or the new one. Throws OutputError.
void PutInPlace(const std::string& path);

}  // namespace slcmap
