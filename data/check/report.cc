#include "data/check/report.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace slcmap {
namespace {

const char* SeverityName(Severity severity) {
  return severity == Severity::kError ? "error" : "warning";
}

}  // namespace

bool CheckReport::Usable() const {
  return std::none_of(findings.begin(), findings.end(), [](const CheckFinding& finding) {
    return finding.severity == Severity::kError;
  });
}

std::string CheckTable(const CheckReport& report) {
  std::string text = fmt::format("sequence     {}\ncalibration  {}\n\n", report.sequence,
                                 report.calibration.empty() ? "none" : report.calibration);
  for (const CheckFigure& figure : report.figures) {
    text += fmt::format("{:<34} {:>12.6g} {}\n", figure.name, figure.value, figure.unit);
  }
  if (!report.findings.empty()) text += "\n";
  for (const CheckFinding& finding : report.findings) {
    text += fmt::format("{}: {}: {}\n    remedy: {}\n", SeverityName(finding.severity),
                        finding.name, finding.found, finding.remedy);
  }
  const auto errors = std::count_if(
      report.findings.begin(), report.findings.end(),
      [](const CheckFinding& finding) { return finding.severity == Severity::kError; });
  text += fmt::format("\n{}: {} errors, {} warnings\n", report.Usable() ? "usable" : "not usable",
                      errors, static_cast<std::ptrdiff_t>(report.findings.size()) - errors);
  return text;
}

std::string CheckJson(const CheckReport& report) {
  using Json = nlohmann::ordered_json;
  Json figures = Json::array(), findings = Json::array();
  for (const CheckFigure& figure : report.figures) {
    figures.push_back({{"name", figure.name}, {"value", figure.value}, {"unit", figure.unit}});
  }
  for (const CheckFinding& finding : report.findings) {
    findings.push_back({{"severity", SeverityName(finding.severity)},
                        {"name", finding.name},
                        {"found", finding.found},
                        {"remedy", finding.remedy}});
  }
  const Json json = {{"format", "slcmap check"},    {"version", 1},
                     {"sequence", report.sequence}, {"calibration", report.calibration},
                     {"usable", report.Usable()},   {"figures", figures},
                     {"findings", findings}};
  // Paths and rows of a recording can hold any bytes; JSON holds UTF-8.
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace slcmap
