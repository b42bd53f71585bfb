#include "data/io/output_folder.h"

#include <fcntl.h>
#include <spdlog/spdlog.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <string_view>

#include "data/core/error.h"
#include "data/io/file.h"
#include "data/io/json.h"

namespace slcmap::inline data {

namespace fs = std::filesystem;

MadeFolder::MadeFolder(const std::string& path) {
  std::error_code error;
  for (fs::path folder = path; !folder.empty() && !fs::exists(folder, error);
       folder = folder.parent_path()) {
    made_.push_back(folder.string());
  }
  MakeFolder(path);
}

MadeFolder::~MadeFolder() {
  std::error_code error;
  for (const std::string& folder : made_) fs::remove(folder, error);  // fails where not empty
}

namespace {

// The format stands at the beginning of the file, which a cut leaves.
SummaryState StateOfBroken(const std::string& text, const StageMark& mark) {
  const bool is_own = text.empty() || text.find(fmt::format("\"{}\"", mark.format)) != text.npos;
  return is_own ? SummaryState::kDamaged : SummaryState::kForeign;
}

SummaryState StateOfJson(const Json& json, const StageMark& mark) {
  const auto has = [&](const char* key, const Json& value) {
    return json.is_object() && json.contains(key) && json.at(key) == value;
  };
  if (!has("format", mark.format)) return SummaryState::kForeign;
  return has("complete", false) ? SummaryState::kPartial : SummaryState::kComplete;
}

}  // namespace

const std::vector<StageMark>& StageMarks() {
  static const std::vector<StageMark> marks = {
      {"run.json", "a run", "slcmap run"},
      {"journal/header.json", "a run", "slcmap run"},
      {"map.json", "a map", "slcmap map"},
      {"export.json", "an export", "slcmap export"},
      {"compare.json", "a comparison", "slcmap comparison"},
      {"maps.json", "a comparison of maps", "slcmap comparison of maps"}};
  return marks;
}

SummaryState GetState(const std::string& folder, const StageMark& mark) {
  const std::string path = folder + "/" + mark.name;
  std::error_code error;
  if (!std::filesystem::exists(path, error)) return SummaryState::kNone;
  if (!std::filesystem::is_regular_file(path, error)) return SummaryState::kForeign;
  const std::string text = ReadFile(path);
  const Json json = Json::parse(text, nullptr, false);
  return json.is_discarded() ? StateOfBroken(text, mark) : StateOfJson(json, mark);
}

bool IsOwn(SummaryState state) {
  return state != SummaryState::kNone && state != SummaryState::kForeign;
}

bool HasResults(const std::string& folder) {
  return std::ranges::any_of(StageMarks(),
                             [&](const StageMark& mark) { return IsOwn(GetState(folder, mark)); });
}

bool HasIntactResults(const std::string& folder, const std::string& result) {
  bool has_own = false;
  for (const StageMark& mark : StageMarks()) {
    if (result != mark.result) continue;
    const SummaryState state = GetState(folder, mark);
    if (state == SummaryState::kDamaged) return false;
    has_own = has_own || IsOwn(state);
  }
  return has_own;
}

namespace {

constexpr char kStaging[] = ".unfinished";
constexpr char kAside[] = "previous-";

[[noreturn]] void FailOutput(const std::string& path, const char* what, const std::string& why) {
  throw OutputError(fmt::format("{}: {}: {}", path, what, why));
}

// Whether a folder is named as MoveAside() names them.
bool IsAside(const std::string& name) {
  const std::size_t length = std::string_view(kAside).size();
  return name.starts_with(kAside) && name.size() > length &&
         name.find_first_not_of("0123456789", length) == name.npos;
}

// Calls a function of std::filesystem that reports by an error code.
template <typename Call>
void Try(const std::string& path, const char* what, Call call) {
  std::error_code error;
  call(error);
  if (error) FailOutput(path, what, error.message());
}

bool Exists(const std::string& path) {
  std::error_code error;
  return fs::exists(path, error);
}

bool IsSame(const fs::path& a, const fs::path& b) {
  std::error_code error;
  return fs::equivalent(a, b, error) && !error;
}

// Whether a folder lies in another one.
bool IsWithin(const fs::path& path, const fs::path& folder) {
  std::error_code error;
  fs::path above = fs::weakly_canonical(fs::absolute(path, error), error);
  while (!error && above.has_relative_path()) {
    above = above.parent_path();
    if (IsSame(above, folder)) return true;
  }
  return false;
}

// Of any kind that the readers of recordings know.
bool IsRecording(const std::string& folder) {
  constexpr const char* kParts[] = {"mav0", "cam0", "imu0", "metadata.yaml"};
  return std::ranges::any_of(kParts, [&](const char* part) { return Exists(folder + "/" + part); });
}

// Whether the stage's files in a folder are its own: a mark of it says so, or what it leaves when
// it is killed.
bool IsOfStage(const std::string& folder, const StageFiles& files) {
  return Exists(folder + "/" + kStaging) ||
         std::ranges::any_of(StageMarks(), [&](const StageMark& mark) {
           return files.result == mark.result && IsOwn(GetState(folder, mark));
         });
}

// Files that the stage would replace, and did not write.
void RefuseFilesOfOthers(const std::string& path, const StageFiles& files) {
  if (IsOfStage(path, files)) return;
  for (const std::string& name : files.names) {
    if (!Exists(path + "/" + name)) continue;
    throw ConfigError(fmt::format(
        "output {}: found {}, which is not of {}, expected a folder of its own: it would be "
        "overwritten",
        path, name, files.result));
  }
}

void RefuseOtherStages(const std::string& path, const std::string& result) {
  for (const StageMark& mark : StageMarks()) {
    if (result == mark.result || !IsOwn(GetState(path, mark))) continue;
    throw ConfigError(fmt::format(
        "output {}: found {} in it ({}), expected a folder of its own for {}: files of the same "
        "names would be overwritten",
        path, mark.result, mark.name, result));
  }
}

// -1 where the folder cannot be opened.
int OpenFolder(const std::string& path) {
  return open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
}

// False where another holds the lock. A file system without locks lets everybody in.
bool TakeLock(int file, int kind) {
  return file < 0 || flock(file, kind | LOCK_NB) == 0 || errno != EWOULDBLOCK;
}

// Waits until the file, or the names in a folder, have reached the disk, as far as can be told.
void Sync(const std::string& path, int flags) {
  const int file = open(path.c_str(), flags | O_RDONLY | O_CLOEXEC);
  if (file < 0) FailOutput(path, "cannot be written", std::strerror(errno));
  const bool synced = fsync(file) == 0 || errno == EINVAL || errno == ENOTSUP;
  const int why = errno;
  close(file);
  if (!synced) FailOutput(path, "cannot be written", std::strerror(why));
}

// Of a folder, sorted: what is done with them is the same everywhere.
std::vector<std::string> NamesIn(const std::string& folder) {
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    names.push_back(it->path().filename().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

// A file, or a folder with all that is in it.
void SyncAll(const std::string& path) {
  for (const std::string& name : NamesIn(path)) SyncAll(path + "/" + name);
  Sync(path, 0);
}

void RemoveNames(const std::string& folder, const std::vector<std::string>& names) {
  for (const std::string& name : names) {
    const std::string path = folder + "/" + name;
    Try(path, "cannot be removed", [&](std::error_code& error) { fs::remove_all(path, error); });
  }
}

// Inputs that a stage would replace by its results, or remove once these are there.
void RefuseReplaced(const std::string& path, const StageFiles& files,
                    const std::vector<std::string>& inputs) {
  std::vector<std::string> replaced = files.names;
  for (const std::string& name : NamesIn(path)) {
    if (IsAside(name) || name == kStaging) replaced.push_back(name);
  }
  for (const std::string& name : replaced) {
    const std::string there = path + "/" + name;
    if (!Exists(there)) continue;
    for (const std::string& input : inputs) {
      if (!IsSame(input, there) && !IsWithin(input, there)) continue;
      throw ConfigError(fmt::format(
          "output {}: found the input {} in it, expected another folder: it would be replaced",
          path, input));
    }
  }
}

}  // namespace

void RefuseInputs(const std::string& path, const std::vector<std::string>& inputs) {
  for (const std::string& input : inputs) {
    if (IsSame(path, input)) {
      throw ConfigError(fmt::format(
          "output {}: found the input {}, expected a folder of its own: it would be overwritten",
          path, input));
    }
    if (!IsWithin(path, input) || !(IsRecording(input) || HasResults(input))) continue;
    throw ConfigError(
        fmt::format("output {}: found the input {} around it, expected a place out of that: "
                    "nothing is written into what is read",
                    path, input));
  }
}

OutputFolder::OutputFolder(const std::string& path, const StageFiles& files,
                           const std::vector<std::string>& inputs)
    : path_(path), files_(files) {
  if (path.empty()) throw ConfigError("output: found an empty path, expected a folder");
  RefuseInputs(path, inputs);
  RefuseReplaced(path, files, inputs);
  RefuseOtherStages(path, files.result);
  RefuseFilesOfOthers(path, files);
}

void OutputFolder::Open() {
  if (made_) return;
  made_.emplace(path_);
  Lock();
}

void OutputFolder::Lock() {
  lock_ = OpenFolder(path_);
  if (TakeLock(lock_, LOCK_EX)) return;
  close(lock_);
  lock_ = -1;
  made_.reset();
  throw OutputError(path_ + ": in use: another slcmap is writing into it or reading from it");
}

OutputFolder::~OutputFolder() {
  std::error_code error;
  if (!staging_.empty()) fs::remove_all(staging_, error);
  made_.reset();
  if (lock_ >= 0) close(lock_);
}

const std::string& OutputFolder::staging() {
  Open();
  if (staging_.empty()) {
    const std::string path = path_ + "/" + kStaging;
    // May be left by a process that was killed.
    Try(path, "cannot be removed", [&](std::error_code& error) { fs::remove_all(path, error); });
    MakeFolder(path);
    staging_ = path;
  }
  return staging_;
}

// What is worth more than the results that are about to take its place.
void OutputFolder::KeepEarlier(bool complete) {
  for (const StageMark& mark : StageMarks()) {
    if (files_.names.front() != mark.name) continue;
    const SummaryState earlier = GetState(path_, mark);
    if (earlier == SummaryState::kComplete && !complete) {
      spdlog::warn("{}: partial results do not replace complete ones: those are in {} now", path_,
                   MoveAside());
    } else if (earlier == SummaryState::kDamaged) {
      spdlog::warn("{}: found a damaged {}: it is in {} now", path_, mark.name, MoveAside());
    }
  }
}

void OutputFolder::Commit(bool complete) {
  std::vector<std::string> names = NamesIn(staging());
  const std::string& summary = files_.names.front();
  if (std::erase(names, summary) > 0) names.push_back(summary);
  for (const std::string& name : names) SyncAll(staging_ + "/" + name);
  KeepEarlier(complete);
  // In between the summary is neither of the old files nor of the new ones.
  RemoveNames(path_, {summary});
  for (const std::string& name : names) {
    const std::string to = path_ + "/" + name;
    if (fs::is_directory(to)) RemoveNames(path_, {name});  // only files are replaced by renaming
    Try(to, "cannot be written",
        [&](std::error_code& error) { fs::rename(staging_ + "/" + name, to, error); });
  }
  Sync(path_, O_DIRECTORY);
  RemoveNames(path_, {kStaging});
  staging_.clear();
  if (complete) RemoveAside();
}

std::string OutputFolder::MoveAside() {
  Open();
  std::string aside;
  // The summary last: as long as it is there, the rest is known to be the stage's.
  for (auto name = files_.names.rbegin(); name != files_.names.rend(); ++name) {
    const std::string from = path_ + "/" + *name;
    if (!Exists(from)) continue;
    for (int i = 1; aside.empty(); ++i) {
      const std::string candidate = fmt::format("{}/{}{}", path_, kAside, i);
      if (!Exists(candidate)) aside = candidate;
    }
    MakeFolder(aside);
    Try(from, "cannot be moved",
        [&](std::error_code& error) { fs::rename(from, aside + "/" + *name, error); });
  }
  if (!aside.empty()) spdlog::info("moved the results of an earlier run to {}", aside);
  return aside;
}

void OutputFolder::RemoveAside() {
  for (const std::string& name : NamesIn(path_)) {
    if (!IsAside(name)) continue;
    const std::string aside = path_ + "/" + name;
    if (!HasIntactResults(aside, files_.result)) continue;  // the user's, or the last of their kind
    RemoveNames(aside, files_.names);
    std::error_code error;
    fs::remove(aside, error);  // fails where the user put something there
  }
}

InputLock::InputLock(const std::string& folder) : lock_(OpenFolder(folder)) {
  if (TakeLock(lock_, LOCK_SH)) return;
  close(lock_);
  throw DataError(folder + ": in use: another slcmap is writing into it");
}

InputLock::~InputLock() {
  if (lock_ >= 0) close(lock_);
}

// Not closed where a program is started.
FolderTurn::FolderTurn(const std::string& folder)
    : lock_(open(folder.c_str(), O_RDONLY | O_DIRECTORY)) {}

bool FolderTurn::Take() { return TakeLock(lock_, LOCK_EX); }

FolderTurn::~FolderTurn() {
  if (lock_ >= 0) close(lock_);
}

}  // namespace slcmap::data
