// Folders that stages write results into, one process at a time, all of them or none; what a stage
// left in one, by its summary; and folders that go away where they stay empty.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace slcmap::inline data {

class MadeFolder {
 public:
  // Makes the folder and those above it, as far as they are missing. Throws OutputError.
  explicit MadeFolder(const std::string& path);

  // Removes those that were made here and are empty.
  ~MadeFolder();
  MadeFolder(const MadeFolder&) = delete;
  MadeFolder& operator=(const MadeFolder&) = delete;

 private:
  std::vector<std::string> made_;  // the deepest first
};

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

SummaryState GetState(const std::string& folder, const StageMark& mark);

// Whether a mark is slcmap's own, damaged or not.
bool IsOwn(SummaryState state);

// Whether a folder holds what a stage wrote, whichever that is.
bool HasResults(const std::string& folder);

// Whether it holds results of one kind, as "a run", and no damaged mark of it.
bool HasIntactResults(const std::string& folder, const std::string& result);

// The files that a stage writes. The first is its summary: it is put in place last, and says which
// stage a folder belongs to.
struct StageFiles {
  std::string result;              // as in "holds a run"
  std::vector<std::string> names;  // of files and folders
};

// Throws ConfigError where the path is one of the inputs, or lies in one that is a recording or
// that a stage has written.
void RefuseInputs(const std::string& path, const std::vector<std::string>& inputs);

// What is written into staging() replaces the files of earlier results by Commit(), when all of it
// is there; until then, and where it never comes to that, they stay as they were.
class OutputFolder {
 public:
  // Looks whether results may be written there; makes nothing. `inputs` are files and folders that
  // are read. Throws ConfigError where the path is empty, is an input or lies in one (see
  // RefuseInputs), where an input is among what would be replaced or removed, or the folder holds
  // what another stage wrote, or files of the stage's names that are not of it.
  OutputFolder(const std::string& path, const StageFiles& files,
               const std::vector<std::string>& inputs = {});
  // Removes what was not committed, and the folders that were made and are empty.
  ~OutputFolder();
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

  const std::string& path() const { return path_; }

  // Makes the folder where it is missing. From then on, while the object lives, no other takes the
  // same folder, in this process or another. Done by the first call, and by the functions below
  // where it has not been called. Throws OutputError where it cannot be made or is in use.
  void Open();

  // A folder within that belongs to the object alone; it is made, empty, by the first call.
  const std::string& staging();

  // Puts the files in staging() in place, once these have reached the disk; the summary is the
  // last. They replace those of earlier results, unless they are not `complete` and those are, or
  // the earlier summary is damaged: then those are moved aside, which is logged. When complete
  // results are in place, what was moved aside is removed. Throws OutputError.
  void Commit(bool complete = true);

  // Moves what the stage left here before to a new folder within, "previous-1" or the next that is
  // free, logs its path and returns it; "" where there was nothing. Throws OutputError.
  std::string MoveAside();

 private:
  void Lock();
  void KeepEarlier(bool complete);
  void RemoveAside();

  std::string path_, staging_;
  StageFiles files_;
  std::optional<MadeFolder> made_;  // once it is open
  int lock_ = -1;                   // a file descriptor of the folder
};

// Keeps writers out of a folder that is read. Throws DataError where one is at work in it.
class InputLock {
 public:
  explicit InputLock(const std::string& folder);
  ~InputLock();
  InputLock(const InputLock&) = delete;
  InputLock& operator=(const InputLock&) = delete;

 private:
  int lock_ = -1;
};

// The turn of one process in a folder that several may work on: not what a stage writes, whose
// folders have their own lock. Programs that it starts hold the turn, too, as long as they run,
// also where the process itself is killed.
class FolderTurn {
 public:
  explicit FolderTurn(const std::string& folder);  // makes nothing, takes nothing
  ~FolderTurn();
  FolderTurn(const FolderTurn&) = delete;
  FolderTurn& operator=(const FolderTurn&) = delete;

  // False where another has it. On a file system without locks everybody has it.
  bool Take();

 private:
  int lock_ = -1;
};

}  // namespace slcmap::data
