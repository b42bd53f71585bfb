#include <algorithm>
#include <array>
#include <filesystem>
#include <map>

#include "apps/batch/workflow.h"
#include "data/io/json.h"
#include "data/io/output_folder.h"

namespace slcmap::inline batch {
namespace {

constexpr char kRunning[] = "running", kWaiting[] = "waiting";

constexpr char kStatusStyle[] = R"(
:root { color-scheme: light dark; }
body { margin: 0 auto; padding: 2rem 1.2rem; max-width: 1400px;
  font: 15px/1.5 system-ui, sans-serif; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; width: 100%; }
th, td { padding: 4px 10px; text-align: left; border-bottom: 1px solid #8884; vertical-align: top; }
td:nth-last-child(2) { overflow-wrap: anywhere; min-width: 14rem; }  /* reasons hold long paths */
a { white-space: nowrap; }
td.number { text-align: right; } tr.failed td { background: #d4423322; }
tr.doubtful td { background: #d6a01722; }
)";

bool IsRunning(const std::string& folder) {
  std::error_code error;
  return std::filesystem::is_directory(folder, error) && !FolderTurn(folder).Take();
}

std::vector<std::string> FindPagesAndLogs(const std::string& folder, const std::string& job) {
  namespace fs = std::filesystem;
  std::vector<std::string> files;
  std::error_code error;
  for (fs::directory_iterator it(folder + "/" + job, error), end; !error && it != end;
       it.increment(error)) {
    const fs::path name = it->path().filename();
    if (name.extension() == ".html" || name.extension() == ".log") files.push_back(job / name);
  }
  std::ranges::sort(files);
  const std::string log = fmt::format("workflow/log/{}.log", job);
  if (fs::exists(folder + "/" + log, error)) files.push_back(log);
  return files;
}

void ReadJobStatus(const std::string& folder, const Workflow& workflow, const Job& job,
                   JobStatus* status) {
  const std::string own = folder + "/" + job.name;
  status->name = job.name;
  status->state = kWaiting;
  status->files = FindPagesAndLogs(folder, job.name);
  const auto result = ReadJobResult(own);
  const bool has_ended = result && result->state != JobState::kBegun &&
                         result->key == ComputeJobKey(folder, workflow, job);
  if (has_ended) {
    status->state = JobStateName(result->state);
    status->result = *result;
  } else if (IsRunning(own)) {
    status->state = kRunning;
  }
}

// Of each recording, as later jobs have larger ones.
std::map<std::string, std::string> FindLargestMaps(const SiteStatus& status) {
  std::map<std::string, std::string> maps;
  const auto add = [&](const JobStatus& job) {
    for (const JobMap& map : job.result.maps) {
      for (const std::string& name : map.recordings) maps[name] = map.path;
    }
  };
  for (const RecordingStatus& recording : status.recordings) add(recording);
  for (const JobStatus& job : status.others) {
    if (job.name.starts_with(kMergeJobs)) add(job);
  }
  return maps;
}

// What a row says beside its figures.
std::string Remark(const JobStatus& job) {
  std::string text = job.result.reason;
  if (!job.result.remedy.empty()) text += "; remedy: " + job.result.remedy;
  for (const MapsApart& pair : job.result.apart) {
    text += fmt::format("{}{} and {} stay apart: {}", text.empty() ? "" : "; ", pair.first,
                        pair.second, pair.reason);
  }
  return text;
}

std::string HtmlCells(std::initializer_list<std::string> cells, const char* tag = "td") {
  std::string html;
  for (const std::string& cell : cells) {
    html += fmt::format("<{}>{}</{}>", tag, EscapeMarkup(cell), tag);
  }
  return html;
}

// From the site's folder, where the page is. Names in it are of letters that links may have.
std::string Link(const std::string& path, const std::string& text) {
  return fmt::format("<a href=\"{}\">{}</a>", path, EscapeMarkup(text));
}

std::string LinkedFiles(const JobStatus& job) {
  std::string html = "<td>";
  for (const std::string& file : job.files) {
    html += Link(file, std::filesystem::path(file).filename().string()) + " ";
  }
  return html + "</td>";
}

using ChangeRow = std::array<std::string, 7>;

// Behind a row of heads; none where there are no changes.
std::vector<ChangeRow> ChangeRows(const SiteStatus& status) {
  std::vector<ChangeRow> rows = {
      {"what", "", "after", "by", "middle [m]", "size [m]", "coordinates of"}};
  for (const JobStatus& job : status.others) {
    for (const Json& change : job.result.changes) {
      const auto lengths = [&](const char* key, const char* between) {
        const auto axes = change.at(key).get<std::array<double, 3>>();
        return fmt::format("{:.2f}{}{:.2f}{}{:.2f}", axes[0], between, axes[1], between, axes[2]);
      };
      std::string system = "the world of " + change.at("world_of").get<std::string>();
      if (change.contains("crs")) system = change.at("crs");
      if (system.empty()) system = "the control points";
      rows.push_back({change.at("what"), change.at("is_new") ? "new" : "gone", change.at("after"),
                      change.at("by"), lengths("middle_m", ", "), lengths("size_m", " x "),
                      system});
    }
  }
  if (rows.size() == 1) rows.clear();
  return rows;
}

std::string ChangesTable(const SiteStatus& status) {
  std::string html;
  for (const auto& [what, is_new, after, by, middle, size, system] : ChangeRows(status)) {
    const char* tag = html.empty() ? "th" : "td";
    html += "<tr>" + HtmlCells({what, is_new, after, by, middle, size, system}, tag) + "</tr>\n";
  }
  return html.empty() ? "" : "<h2>Changes</h2>\n<table>" + html + "</table>\n";
}

std::string Length(const RecordingStatus& recording) {
  return recording.result.length_m > 0 ? fmt::format("{:.1f}", recording.result.length_m) : "";
}

// Of several maps also whose it is, and how it lies on control points.
std::string DescribeMap(const JobStatus& job, const JobMap& map) {
  std::vector<std::string> words;
  if (job.result.maps.size() > 1) {
    words.push_back(fmt::format("of {}", fmt::join(map.recordings, ", ")));
  }
  if (map.points_given > 0) {
    words.push_back(fmt::format("on {} of {} control points, {:.1f} mm RMS", map.points_used,
                                map.points_given, map.rms_mm));
  }
  return words.empty() ? "" : fmt::format(" ({})", fmt::join(words, "; "));
}

std::string PathsOfMaps(const JobStatus& job) {
  std::vector<std::string> paths;
  for (const JobMap& map : job.result.maps) paths.push_back(map.path + DescribeMap(job, map));
  return fmt::format("{}", fmt::join(paths, ", "));
}

std::string LinkedMaps(const JobStatus& job) {
  std::string html = "<td>";
  for (const JobMap& map : job.result.maps) {
    html += Link(map.path, map.path) + EscapeMarkup(DescribeMap(job, map)) + "<br>";
  }
  return html + "</td>";
}

// Columns as wide as their widest cell; the last one as it is.
template <std::size_t N>
std::string AlignColumns(const std::vector<std::array<std::string, N>>& rows) {
  std::array<std::size_t, N> widths{};
  for (const auto& row : rows) {
    for (std::size_t i = 0; i < N; ++i) widths[i] = std::max(widths[i], row[i].size());
  }
  std::string text;
  for (const auto& row : rows) {
    std::string line;
    for (std::size_t i = 0; i + 1 < N; ++i) line += fmt::format("{:<{}}  ", row[i], widths[i]);
    line += row.back();
    text += line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
  }
  return text;
}

Json JobStatusJson(const JobStatus& job) {
  Json json = {{"job", job.name}};
  json.update(ResultJson(job.result));
  json["state"] = job.state;
  return json;
}

}  // namespace

std::string SiteStatus::Failures() const {
  const auto failed = [](const JobStatus& job) {
    return job.state == JobStateName(JobState::kFailed);
  };
  const auto count = std::ranges::count_if(recordings, failed);
  if (count > 0) {
    const auto first = std::ranges::find_if(recordings, failed);
    return fmt::format("{} of {} recordings failed, first {}: {}", count, recordings.size(),
                       first->recording.name, first->result.reason);
  }
  const auto other = std::ranges::find_if(others, failed);
  if (other != others.end()) return fmt::format("{} failed: {}", other->name, other->result.reason);
  return "";
}

SiteStatus ReadStatus(const std::string& folder, const Workflow& workflow) {
  SiteStatus status;
  for (const Job& job : workflow.jobs) {
    if (!IsRecordingJob(job)) {
      ReadJobStatus(folder, workflow, job, &status.others.emplace_back());
      continue;
    }
    RecordingStatus& recording = status.recordings.emplace_back();
    ReadJobStatus(folder, workflow, job, &recording);
    recording.recording = workflow.FindRecording(RecordingName(job));
  }
  const std::map<std::string, std::string> maps = FindLargestMaps(status);
  for (RecordingStatus& recording : status.recordings) {
    const auto map = maps.find(recording.recording.name);
    if (map != maps.end()) recording.map = map->second;
  }
  return status;
}

std::string StatusTable(const SiteStatus& status) {
  std::vector<std::array<std::string, 6>> rows = {
      {"recording", "state", "verdict", "length [m]", "map", "reason"}};
  for (const RecordingStatus& recording : status.recordings) {
    rows.push_back({recording.recording.name, recording.state, recording.result.verdict,
                    Length(recording), recording.map, Remark(recording)});
  }
  std::vector<std::array<std::string, 4>> others = {{"job", "state", "made", "reason"}};
  for (const JobStatus& job : status.others) {
    others.push_back({job.name, job.state, PathsOfMaps(job), Remark(job)});
  }
  const std::vector<ChangeRow> changes = ChangeRows(status);
  return AlignColumns(rows) + (status.others.empty() ? "" : "\n" + AlignColumns(others)) +
         (changes.empty() ? "" : "\nchanges\n" + AlignColumns(changes));
}

std::string StatusJson(const SiteStatus& status) {
  Json json = {{"format", "slcmap site status"},
               {"version", 1},
               {"recordings", Json::array()},
               {"jobs", Json::array()}};
  for (const RecordingStatus& recording : status.recordings) {
    Json entry = JobStatusJson(recording);
    entry["name"] = recording.recording.name;
    entry["building"] = recording.recording.building;
    entry["storey"] = recording.recording.storey;
    entry["date"] = recording.recording.date;
    entry["map"] = recording.map;
    json["recordings"].push_back(entry);
  }
  for (const JobStatus& job : status.others) json["jobs"].push_back(JobStatusJson(job));
  return JsonText(json);
}

std::string StatusPage(const SiteStatus& status) {
  std::string html = fmt::format(
      "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><title>Site</title><style>{}"
      "</style>\n<h1>Site</h1>\n<table><tr><th>recording<th>building<th>storey<th>date<th>state"
      "<th>verdict<th>length [m]<th>map<th>reason<th>logs</tr>\n",
      kStatusStyle);
  for (const RecordingStatus& row : status.recordings) {
    const std::string& kind =
        row.state == JobStateName(JobState::kDone) ? row.result.verdict : row.state;
    const SiteRecording& of = row.recording;
    html += fmt::format("<tr class=\"{}\">", kind) +
            HtmlCells({of.name, of.building, of.storey, of.date, row.state, row.result.verdict,
                       Length(row), row.map, Remark(row)}) +
            LinkedFiles(row) + "</tr>\n";
  }
  html +=
      "</table>\n<h2>Merges and exports</h2>\n<table><tr><th>job<th>state<th>made<th>reason"
      "<th>pages and logs</tr>\n";
  for (const JobStatus& job : status.others) {
    html += fmt::format("<tr class=\"{}\">", job.state) + HtmlCells({job.name, job.state}) +
            LinkedMaps(job) + HtmlCells({Remark(job)}) + LinkedFiles(job) + "</tr>\n";
  }
  return html + "</table>\n" + ChangesTable(status) + "</html>\n";
}

}  // namespace slcmap::batch
