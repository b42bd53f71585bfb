// Tells what a stage left in a folder: by what its summary says, not by the summary's name alone.
#pragma once

#include <string>
#include <vector>

namespace slcmap {

// A file that only one stage writes, and so says whose folder it is. A run that was killed has no
// summary, but the header of its journal.
struct StageMark {
  const char* name;
  const char* result;  // as in "holds a run"
  const char* format;  // the entry "format" of the file
};
const std::vector<StageMark>& StageMarks();

enum class SummaryState {
  kNone,     // no such file
  kForeign,  // slcmap did not write it
  kDamaged,  // by its beginning slcmap wrote it, or it is empty, as after a full disk; no whole
             // JSON
  kPartial,  // it says that the results are
  kComplete,
};

SummaryState StateOf(const std::string& folder, const StageMark& mark);

// Whether a mark is slcmap's own, damaged or not.
bool IsOwn(SummaryState state);

// Whether a folder holds what a stage wrote, whichever that is.
bool HasResults(const std::string& folder);

// Whether it holds results of one kind, as "a run", and no damaged mark of it.
bool HasIntactResults(const std::string& folder, const std::string& result);

}  // namespace slcmap
