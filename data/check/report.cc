#include "data/check/report.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>
#include <string_view>

namespace slcmap::inline data {
namespace {

const char* SeverityName(Severity severity) {
  if (severity == Severity::kNote) return "note";
  return severity == Severity::kError ? "error" : "warning";
}

std::ptrdiff_t CountMatching(const CheckReport& report, Severity severity) {
  return std::count_if(
      report.findings.begin(), report.findings.end(),
      [severity](const CheckFinding& finding) { return finding.severity == severity; });
}

std::string TopicTable(const std::vector<RecordedTopic>& topics) {
  std::string text;
  for (const RecordedTopic& topic : topics) {
    text += fmt::format("{:<34} {:>12} {}{}\n", topic.name,
                        topic.messages < 0 ? "?" : std::to_string(topic.messages), topic.type,
                        topic.taken_as.empty() ? "" : ": " + topic.taken_as);
  }
  return topics.empty() ? text : text + "\n";
}

}  // namespace

bool CheckReport::Usable() const {
  return std::none_of(findings.begin(), findings.end(), [](const CheckFinding& finding) {
    return finding.severity == Severity::kError;
  });
}

std::string CheckReport::Named(const std::string& remedy) const {
  std::string named;
  for (size_t at = 0; at < remedy.size();) {
    const std::string_view word = std::string_view(remedy).substr(at, 4);
    const bool is_longer = at + 4 < remedy.size() && std::isdigit(remedy[at + 4]) != 0;  // cam10
    const bool is_camera = !is_longer && (word == "cam0" || word == "cam1");
    named += is_camera ? cameras[word == "cam1" ? 1 : 0] : std::string(word.substr(0, 1));
    at += is_camera ? 4 : 1;
  }
  return named;
}

bool TurnRight(const std::vector<CheckCorrection>& corrections) {
  return std::ranges::any_of(
      corrections, [](const CheckCorrection& c) { return c.name == kRightTurnCorrection; });
}

Rig Corrected(const Rig& rig, const CheckReport& report) {
  Rig corrected = rig;
  for (const CheckCorrection& correction : report.corrections) {
    if (correction.name == kTimeOffsetCorrection) {
      corrected.camera_time_offset_s = correction.values[0];
    } else if (correction.name == kRightTurnCorrection) {
      Eigen::Quaterniond& rotation = corrected.T_imu_camera[1].rotation;
      const Eigen::Vector3d turn_rad(correction.values.data());
      rotation = (rotation * ExpRotation(turn_rad)).normalized();
    } else if (correction.name == kFocalCorrection) {
      for (size_t c = 0; c < 2; ++c) {
        corrected.cameras[c].fx_px *= 1 + correction.values[c];
        corrected.cameras[c].fy_px *= 1 + correction.values[c];
      }
    }
  }
  return corrected;
}

std::string CheckTable(const CheckReport& report) {
  std::string text =
      fmt::format("sequence     {}{}\n{}{}\n\n", report.sequence,
                  report.topics.empty() || report.form.empty() ? "" : " (" + report.form + ")",
                  report.calibration.empty() ? "" : "calibration  ", report.calibration) +
      TopicTable(report.topics);
  for (const CheckFigure& figure : report.figures) {
    text += fmt::format("{:<34} {:>12.6g} {}\n", figure.name, figure.value, figure.unit);
  }
  if (!report.findings.empty()) text += "\n";
  for (const CheckFinding& finding : report.findings) {
    text += fmt::format("{}: {}: {}\n    remedy: {}\n", SeverityName(finding.severity),
                        finding.name, finding.found, finding.remedy);
  }
  for (const CheckCorrection& correction : report.corrections) {
    text += fmt::format("odometry starts from the {}\n", correction.words);
  }
  text += fmt::format("\n{}: {} errors, {} warnings\n", report.Usable() ? "usable" : "not usable",
                      CountMatching(report, Severity::kError),
                      CountMatching(report, Severity::kWarning));
  return text;
}

std::string CheckJson(const CheckReport& report) {
  using Json = nlohmann::ordered_json;
  Json figures = Json::array(), findings = Json::array(), corrections = Json::array();
  for (const CheckFigure& figure : report.figures) {
    figures.push_back({{"name", figure.name}, {"value", figure.value}, {"unit", figure.unit}});
  }
  for (const CheckFinding& finding : report.findings) {
    findings.push_back({{"severity", SeverityName(finding.severity)},
                        {"name", finding.name},
                        {"found", finding.found},
                        {"remedy", finding.remedy}});
  }
  for (const CheckCorrection& correction : report.corrections) {
    corrections.push_back({{"name", correction.name}, {"values", correction.values}});
  }
  Json topics = Json::array();
  for (const RecordedTopic& topic : report.topics) {
    topics.push_back({{"name", topic.name},
                      {"type", topic.type},
                      {"messages", topic.messages < 0 ? Json() : Json(topic.messages)},
                      {"taken_as", topic.taken_as}});
  }
  Json json = {{"format", "slcmap check"},    {"version", 1},
               {"sequence", report.sequence}, {"calibration", report.calibration},
               {"usable", report.Usable()},   {"figures", figures},
               {"findings", findings},        {"corrections", corrections}};
  if (!topics.empty()) json["topics"] = topics;
  // Paths and rows of a recording can hold any bytes; JSON holds UTF-8.
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace slcmap::data
