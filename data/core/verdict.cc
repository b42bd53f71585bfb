#include "data/core/verdict.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <utility>

#include "data/core/error.h"

namespace slcmap::inline data {
namespace {

constexpr std::pair<VerdictLevel, const char*> kLevels[] = {{VerdictLevel::kGood, "good"},
                                                            {VerdictLevel::kDoubtful, "doubtful"},
                                                            {VerdictLevel::kFailed, "failed"}};

}  // namespace

void Verdict::Add(VerdictReason reason) {
  level = std::max(level, reason.level);
  const auto after = std::find_if(reasons.begin(), reasons.end(), [&](const VerdictReason& other) {
    return other.level < reason.level;
  });
  reasons.insert(after, std::move(reason));
}

void Verdict::Withdraw(const std::string& what) {
  std::erase_if(reasons, [&](const VerdictReason& reason) { return reason.what == what; });
  level = reasons.empty() ? VerdictLevel::kGood : reasons.front().level;
}

std::string VerdictLevelName(VerdictLevel level) {
  for (const auto& [other, name] : kLevels) {
    if (level == other) return name;
  }
  return "";
}

VerdictLevel VerdictLevelFromName(const std::string& place, const std::string& name) {
  for (const auto& [level, level_name] : kLevels) {
    if (name == level_name) return level;
  }
  throw DataError(fmt::format("{}: found '{}', expected good, doubtful or failed", place, name));
}

std::string InWords(const VerdictReason& reason) {
  return fmt::format("{}: found {}, expected {}; remedy: {}", reason.what, reason.found,
                     reason.expected, reason.remedy);
}

}  // namespace slcmap::data
