#include "apps/evaluate_output.h"

#include <spdlog/fmt/fmt.h>

#include <filesystem>

#include "data/error.h"
#include "data/stage_summary.h"

namespace slcmap {
namespace {

namespace fs = std::filesystem;

bool IsThere(const fs::path& path) {
  std::error_code error;
  return fs::exists(path, error);
}

// What lies in a folder that a stage wrote, or a recorder; "" in any other.
std::string ContentOf(const fs::path& folder) {
  for (const StageMark& mark : StageMarks()) {
    try {
      if (IsOwn(StateOf(folder.string(), mark))) return mark.result;
    } catch (const DataError&) {
      // Somebody else's, in a folder above: it cannot even be read.
    }
  }
  const bool is_recording = IsThere(folder / "cam0" / "data.csv") ||
                            IsThere(folder / "cam0" / "data") || IsThere(folder / "mav0" / "cam0");
  return is_recording ? "a recording" : "";
}

}  // namespace

void RefuseAsResult(const std::string& option, const std::string& path,
                    const std::vector<std::string>& inputs) {
  if (path.empty()) return;
  std::error_code error;
  for (const std::string& input : inputs) {
    if (input.empty() || !fs::equivalent(path, input, error) || error) continue;
    throw ConfigError(fmt::format(
        "{}: found {}, which is read, expected a path of its own: it would be overwritten", option,
        path));
  }
  fs::path folder = fs::weakly_canonical(fs::absolute(path, error), error);
  for (; !error && !folder.empty(); folder = folder.parent_path()) {
    if (const std::string content = ContentOf(folder); !content.empty()) {
      throw ConfigError(fmt::format("{}: found {}, which lies in {} ({}), expected a place outside",
                                    option, path, content, folder.string()));
    }
    if (!folder.has_relative_path()) break;
  }
}

}  // namespace slcmap
