// A folder that a stage writes its results into: one process at a time, and all of them or none.
#pragma once

#include <string>
#include <vector>

namespace slcmap {

// The files that a stage writes. The first is its summary: it is put in place last, and says which
// stage a folder belongs to.
struct StageFiles {
  std::string result;              // as in "holds a run"
  std::vector<std::string> names;  // of files and folders
};

// Throws ConfigError where the path is one of the inputs, or lies in one that a stage has written.
void RefuseInputs(const std::string& path, const std::vector<std::string>& inputs);

// While an object lives, no other takes the same folder, in this process or another. What is
// written into staging() replaces the files of earlier results by Commit(), when all of it is
// there; until then, and where it never comes to that, they stay as they were.
class OutputFolder {
 public:
  // Makes the folder where it is missing. `inputs` are folders that must not be written into.
  // Throws ConfigError where the path is empty, or the folder is an input, or holds what another
  // stage wrote or files of the stage's names that are not of it; OutputError where it cannot be
  // made or is in use.
  OutputFolder(const std::string& path, const StageFiles& files,
               const std::vector<std::string>& inputs = {});
  // Removes what was not committed, and the folder where it was made here and is empty.
  ~OutputFolder();
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

  const std::string& path() const { return path_; }

  // A folder within that belongs to the object alone; it is made, empty, by the first call.
  const std::string& staging();

  // Replaces files by those in staging(), once these have reached the disk; the summary is the
  // last. Throws OutputError.
  void Commit();

  // Moves what the stage left here before to a new folder within, "previous-1" or the next that is
  // free, and returns its path; "" where there was nothing. Throws OutputError.
  std::string MoveAside();

  // Removes what MoveAside() ever moved. Throws OutputError.
  void RemoveAside();

 private:
  void Lock();

  std::string path_, staging_;
  StageFiles files_;
  bool made_ = false;
  int lock_ = -1;  // a file descriptor of the folder
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

}  // namespace slcmap
