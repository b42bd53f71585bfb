#include "data/stage_summary.h"

#include <algorithm>
#include <filesystem>

#include "data/json_file.h"

namespace slcmap {
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
      {"compare.json", "a comparison", "slcmap comparison"}};
  return marks;
}

SummaryState StateOf(const std::string& folder, const StageMark& mark) {
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
                             [&](const StageMark& mark) { return IsOwn(StateOf(folder, mark)); });
}

bool HasIntactResults(const std::string& folder, const std::string& result) {
  bool has_own = false;
  for (const StageMark& mark : StageMarks()) {
    if (result != mark.result) continue;
    const SummaryState state = StateOf(folder, mark);
    if (state == SummaryState::kDamaged) return false;
    has_own = has_own || IsOwn(state);
  }
  return has_own;
}

}  // namespace slcmap
