#include "apps/folder_kind.h"

#include <spdlog/fmt/fmt.h>

#include <filesystem>

#include "data/error.h"

namespace slcmap {
namespace {

// A file or folder that only one kind of folder holds. A killed run has no run.json, but poses.
struct Mark {
  const char* name;
  FolderKind kind;
};
constexpr Mark kMarks[] = {{"run.json", FolderKind::kRun},  {"journal", FolderKind::kRun},
                           {"map.json", FolderKind::kMap},  {"mav0", FolderKind::kSequence},
                           {"cam0", FolderKind::kSequence}, {"imu0", FolderKind::kSequence}};

bool Exists(const std::string& path) {
  std::error_code error;
  return std::filesystem::exists(path, error);
}

const char* NameOf(FolderKind kind) {
  switch (kind) {
    case FolderKind::kSequence:
      return "a recorded sequence";
    case FolderKind::kRun:
      return "a run folder";
    case FolderKind::kMap:
      break;
  }
  return "a map folder";
}

// Where a result of `run` holds the folder that was meant.
std::string Hint(const std::string& path, FolderKind expected) {
  const std::string inner = path + (expected == FolderKind::kMap ? "/map" : "/run");
  const bool is_result = Exists(path + "/run/run.json") || Exists(path + "/map/map.json");
  if (expected == FolderKind::kSequence || !is_result || !Exists(inner)) return "";
  return fmt::format("; did you mean '{}'?", inner);
}

}  // namespace

void ExpectFolder(const std::string& path, FolderKind expected) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  const auto fail = [&](const std::string& found) {
    throw DataError(fmt::format("{}: found {}, expected {}", path, found, NameOf(expected)) +
                    Hint(path, expected));
  };
  if (status.type() == std::filesystem::file_type::not_found) fail("no such folder");
  if (error) throw DataError(fmt::format("{}: cannot be opened: {}", path, error.message()));
  if (status.type() != std::filesystem::file_type::directory) fail("a file");
  for (const Mark& mark : kMarks) {
    if (mark.kind == expected && Exists(path + "/" + mark.name)) return;
  }
  for (const Mark& mark : kMarks) {
    if (Exists(path + "/" + mark.name)) fail(NameOf(mark.kind));
  }
  if (const std::string hint = Hint(path, expected); !hint.empty()) fail("the results of run");
}

}  // namespace slcmap
