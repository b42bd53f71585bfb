#include "data/verdict_json.h"

namespace slcmap {

Json VerdictJson(const std::optional<Verdict>& verdict) {
  if (!verdict) return nullptr;
  Json reasons = Json::array();
  for (const VerdictReason& reason : verdict->reasons) {
    reasons.push_back({{"level", VerdictLevelName(reason.level)},
                       {"what", reason.what},
                       {"found", reason.found},
                       {"expected", reason.expected},
                       {"remedy", reason.remedy}});
  }
  return {{"level", VerdictLevelName(verdict->level)}, {"reasons", reasons}};
}

std::optional<Verdict> ParseVerdict(const std::string& path, const Json& summary) {
  if (!summary.contains("verdict") || summary.at("verdict").is_null()) return std::nullopt;
  const Json& json = summary.at("verdict");
  const auto level = [&](const Json& holder) {
    return VerdictLevelFromName(path + ": verdict", holder.at("level").get<std::string>());
  };
  Verdict verdict;
  for (const Json& reason : json.at("reasons")) {
    verdict.Add({level(reason), reason.at("what").get<std::string>(),
                 reason.at("found").get<std::string>(), reason.at("expected").get<std::string>(),
                 reason.at("remedy").get<std::string>()});
  }
  if (level(json) == verdict.level) return verdict;
  throw DataError(fmt::format("{}: verdict: found '{}', expected '{}' as its worst reason", path,
                              json.at("level").get<std::string>(),
                              VerdictLevelName(verdict.level)));
}

}  // namespace slcmap
