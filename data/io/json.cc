#include "data/io/json.h"

namespace slcmap::inline data {
namespace {

// A path need not be UTF-8: what is not is replaced, as in the file.
std::string Text(const Json& summary) {
  return summary.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string ComputeChecksum(Json summary) {
  summary.erase("checksum");
  return Checksum(Text(summary));
}

}  // namespace

Json ListFiles(const std::string& folder, const std::vector<std::string>& names) {
  Json files = Json::array();
  for (const std::string& name : names) {
    const std::string bytes = ReadFile(folder + "/" + name);
    files.push_back({{"name", name}, {"bytes", bytes.size()}, {"checksum", Checksum(bytes)}});
  }
  return files;
}

std::string ComputeId(const Json& summary) { return Checksum(Text(summary)); }

std::string WriteSummaryFile(const std::string& path, Json summary) {
  const std::string id = ComputeId(summary);
  summary["id"] = id;
  summary["checksum"] = ComputeChecksum(summary);
  WriteJsonFile(path, summary);
  return id;
}

void CheckFiles(const std::string& folder, const std::string& summary_name, const Json& summary) {
  for (const Json& file : summary.at("files")) {
    const std::string path = folder + "/" + file.at("name").get<std::string>();
    const std::string bytes = ReadFile(path), found = Checksum(bytes);
    const auto expected = file.at("checksum").get<std::string>();
    if (found == expected) continue;
    throw DataError(fmt::format("{}: found {} bytes of checksum {}, expected {} of {} as in {}: {}",
                                path, bytes.size(), found, file.at("bytes").get<std::size_t>(),
                                expected, summary_name, kChangedSince));
  }
  CheckSummary(folder, summary_name, summary);
}

void CheckSummary(const std::string& folder, const std::string& summary_name, const Json& summary) {
  const std::string found = ComputeChecksum(summary);
  if (const auto expected = summary.at("checksum").get<std::string>(); found != expected) {
    throw DataError(fmt::format("{}/{}: found checksum {}, expected {}: {}", folder, summary_name,
                                found, expected, kChangedSince));
  }
}

void CheckCount(const std::string& folder, const std::string& summary_name, const Json& summary,
                const char* what, std::size_t found) {
  const auto expected = summary.at("counts").at(what).get<std::size_t>();
  if (found == expected) return;
  throw DataError(fmt::format("{}: found {} {}, expected {} as in {}: {}", folder, found, what,
                              expected, summary_name, kChangedSince));
}

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

}  // namespace slcmap::data
