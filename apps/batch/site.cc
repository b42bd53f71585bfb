#include <glob.h>
#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <tuple>

#include "apps/batch/workflow.h"
#include "data/bag/bag.h"
#include "data/calibration/calibration.h"
#include "data/core/error.h"
#include "data/io/csv.h"
#include "data/io/yaml.h"
#include "data/source/sequence.h"
#include "mapping/control/control.h"
#include "mapping/map/names.h"

namespace slcmap::inline batch {
namespace {

namespace fs = std::filesystem;

// Of all that is wrong, so that a file is put right in one go.
class Faults {
 public:
  explicit Faults(std::string file) : file_(std::move(file)) {}
  void Add(const std::string& fault) { faults_.push_back(fault); }

  void Refuse() const {
    constexpr std::size_t kMostTold = 8;
    if (faults_.empty()) return;
    const auto told = static_cast<std::ptrdiff_t>(std::min(faults_.size(), kMostTold));
    const std::string more =
        faults_.size() > kMostTold ? fmt::format("; and {} more", faults_.size() - kMostTold) : "";
    throw ConfigError(fmt::format("{}: {}{}", file_,
                                  fmt::join(faults_.begin(), faults_.begin() + told, "; "), more));
  }

 private:
  const std::string file_;
  std::vector<std::string> faults_;
};

// From the folder of the site file.
std::string FullPath(const fs::path& folder, const std::string& path) {
  return path.empty() ? "" : fs::weakly_canonical(folder / path).string();
}

constexpr std::size_t kLongestName = 80;

bool IsNameLetter(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) || c == '.' || c == '_' || c == '-';
}

bool IsFolderName(const std::string& name) {
  return !name.empty() && std::ranges::all_of(name, IsNameLetter) && name.front() != '.' &&
         name.front() != '-';
}

// Names of recordings become folders, and words of commands.
void CheckName(const std::string& key, const std::string& name, Faults* faults) {
  if (name.size() <= kLongestName && IsFolderName(name)) return;
  faults->Add(
      fmt::format("{}: found '{}', expected up to {} of a-z, A-Z, 0-9, '_', '.' and '-', the last "
                  "two not first",
                  key, name, kLongestName));
}

// Those of buildings and storeys are for people.
void CheckTitle(const std::string& key, const std::string& name, Faults* faults) {
  const bool is_line = std::ranges::none_of(
      name, [](char c) { return std::iscntrl(static_cast<unsigned char>(c)) != 0; });
  if (is_line && IsUtf8(name) && !name.empty() && name.size() <= kLongestName) return;
  faults->Add(fmt::format("{}: found '{}', expected a line of UTF-8, of up to {} bytes", key, name,
                          kLongestName));
}

// Whether a text is a day that there is, YYYY-MM-DD.
bool IsDate(const std::string& text) {
  constexpr std::size_t kLength = 10;
  if (text.size() != kLength) return false;
  for (std::size_t i = 0; i < kLength; ++i) {
    const bool is_right =
        i == 4 || i == 7 ? text[i] == '-' : std::isdigit(static_cast<unsigned char>(text[i])) != 0;
    if (!is_right) return false;
  }
  using namespace std::chrono;
  return year_month_day{year(std::stoi(text.substr(0, 4))),
                        month(static_cast<unsigned>(std::stoi(text.substr(5, 2)))),
                        day(static_cast<unsigned>(std::stoi(text.substr(8, 2))))}
      .ok();
}

void CheckDate(const std::string& place, const std::string& date, Faults* faults) {
  if (date.empty() || IsDate(date)) return;
  faults->Add(fmt::format("{}.date: found '{}', expected YYYY-MM-DD", place, date));
}

// The folder's name, or that of the one above mav0, in letters of names. A link counts by its own.
std::string NameOfFolder(const std::string& path) {
  fs::path folder = fs::path(path).lexically_normal();
  if (!folder.has_filename()) folder = folder.parent_path();
  std::string name =
      (folder.filename() == "mav0" ? folder.parent_path() : folder).filename().string();
  for (char& c : name) {
    if (!IsNameLetter(c)) c = '_';
  }
  return name;
}

// Those that the pattern stands for, sorted; others than folders and bags are left out, and said.
std::vector<std::string> MatchingFolders(const std::string& pattern) {
  std::vector<std::string> folders;
  glob_t found{};
  if (glob(pattern.c_str(), 0, nullptr, &found) == 0) {
    for (std::size_t i = 0; i < found.gl_pathc; ++i) {
      const std::string path = found.gl_pathv[i];
      if (fs::is_directory(path) || IsBag(path)) {
        folders.push_back(path);
      } else {
        spdlog::warn("{}: left out, as it is no folder and no bag", path);
      }
    }
  }
  globfree(&found);
  return folders;
}

// An entry of `recordings` as the file has it; the path may stand for several.
SiteRecording ReadEntry(YamlSection section, const fs::path& folder) {
  SiteRecording entry;
  entry.building = kOnlyBuilding;
  section.Read("path", &entry.path);
  section.Read("calibration", &entry.opened.calibration);
  section.Read("cameras", &entry.opened.cameras);
  section.Read("topics", &entry.opened.topics);
  section.Read("name", &entry.name);
  section.Read("building", &entry.building);
  section.Read("storey", &entry.storey);
  section.Read("date", &entry.date);
  section.Finish();
  if (entry.path.empty()) {
    throw ConfigError(section.place() + ".path: found none, expected a recording's folder");
  }
  std::vector<std::string> files = SplitAtCommas(entry.opened.calibration);
  for (std::string& file : files) file = FullPath(folder, file);
  entry.opened.calibration = fmt::format("{}", fmt::join(files, ","));
  return entry;
}

void AddRecordings(const std::string& place, const SiteRecording& entry, const fs::path& folder,
                   Site* site, Faults* faults) {
  const bool is_pattern = entry.path.find_first_of("*?[") != std::string::npos;
  std::vector<std::string> paths = {(folder / entry.path).string()};
  if (is_pattern) paths = MatchingFolders(paths.front());
  if (paths.empty()) {
    faults->Add(fmt::format("{}.path: found no folder like {}, expected some", place, entry.path));
  }
  if (paths.size() > 1 && !entry.name.empty()) {
    faults->Add(
        fmt::format("{}.name: found '{}' for {} recordings, expected none: their folders' "
                    "names are taken",
                    place, entry.name, paths.size()));
  }
  CheckTitle(place + ".building", entry.building, faults);
  if (!entry.storey.empty()) CheckTitle(place + ".storey", entry.storey, faults);
  CheckDate(place, entry.date, faults);
  for (const std::string& path : paths) {
    SiteRecording recording = entry;
    recording.path = FullPath(folder, path);
    if (recording.name.empty()) recording.name = NameOfFolder(path);
    CheckName(place + ".name", recording.name, faults);
    site->recordings.push_back(recording);
  }
}

void ReadPlanEntries(YamlSection* root, const fs::path& folder, Site* site, Faults* faults) {
  for (YamlSection& section : root->List("plans")) {
    SitePlan plan;
    plan.building = kOnlyBuilding;
    section.Read("building", &plan.building);
    section.Read("storey", &plan.storey);
    section.Read("image", &plan.image);
    section.Read("pixel_m", &plan.pixel_m);
    section.Finish();
    const std::string place = fmt::format("plans[{}]", site->plans.size());
    plan.image = FullPath(folder, plan.image);
    if (!fs::is_regular_file(plan.image)) {
      faults->Add(fmt::format("{}.image: found '{}', expected a file", place, plan.image));
    }
    if (!(plan.pixel_m > 0 && plan.pixel_m <= 1)) {
      faults->Add(fmt::format("{}.pixel_m: found {}, expected metres a pixel, at most 1", place,
                              plan.pixel_m));
    }
    site->plans.push_back(plan);
  }
}

void ReadControlEntries(YamlSection* root, const fs::path& folder, Site* site, Faults* faults) {
  for (YamlSection& section : root->List("control")) {
    SiteControl control{kOnlyBuilding, "", ""};
    section.Read("building", &control.building);
    section.Read("points", &control.points);
    section.Read("crs", &control.crs);
    section.Finish();
    control.points = FullPath(folder, control.points);
    const std::string place = fmt::format("control[{}]", site->control.size());
    if (std::ranges::find(site->recordings, control.building, &SiteRecording::building) ==
        site->recordings.end()) {
      faults->Add(
          fmt::format("{}.building: found {}, of which no recording is", place, control.building));
    }
    if (FindControl(*site, control.building)) {
      faults->Add(
          fmt::format("{}: found a second one of {}, expected one", place, control.building));
    }
    try {
      FindGridScale({control.points, ReadControlPoints(control.points), {}, control.crs});
    } catch (const Error& error) {
      faults->Add(fmt::format("{}: {}", place, error.what()));
    }
    site->control.push_back(control);
  }
}

// A recording's folder and calibration, as the program opens them; damage within is for its job to
// tell.
void CheckRecording(const SiteRecording& recording, Faults* faults) {
  try {
    Warnings ignored;
    const std::string folder = LocateRecording(recording.path);
    if (IsBagRecording(recording.path)) return;  // may bring its own, which its job reads
    const SequenceOptions& opened = recording.opened;
    if (opened.calibration.empty()) {
      FindCalibration(folder, &ignored, Mirrored::kRefused, opened.cameras);
    } else {
      ReadCalibration(opened.calibration, &ignored, Mirrored::kRefused, opened.cameras);
    }
  } catch (const Error& error) {
    faults->Add(fmt::format("recording {}: {}", recording.name, error.what()));
  }
}

// What was recorded, by the sizes and beginnings of its files; "" where it is not said so.
std::string DescribeContents(const std::string& path) {
  constexpr std::size_t kBeginning = 65536;
  std::string contents;
  std::error_code error;
  const std::string folder = LocateRecording(path);
  std::vector<std::string> files = {folder + "/imu0/data.csv", folder + "/cam0/data.csv"};
  if (IsBagRecording(path)) files = {folder};
  for (const std::string& file : files) {
    if (!fs::is_regular_file(file, error) || fs::is_empty(file, error)) return "";
    std::string beginning(kBeginning, '\0');
    std::ifstream stream(file, std::ios::binary);
    stream.read(beginning.data(), static_cast<std::streamsize>(kBeginning));
    contents += fmt::format("{} {}\n", fs::file_size(file, error), beginning);
  }
  return contents;
}

// One walk under two names would be merged with itself.
void RefuseCopies(const Site& site, Faults* faults) {
  std::map<std::string, std::string> by_contents;
  for (const SiteRecording& recording : site.recordings) {
    std::string contents;
    try {
      contents = DescribeContents(recording.path);
    } catch (const Error&) {
      continue;  // which CheckRecording tells
    }
    const auto [known, is_new] = by_contents.emplace(std::move(contents), recording.name);
    if (is_new || known->first.empty()) continue;
    faults->Add(fmt::format("recordings: found {} to be a copy of {}, expected each walk once",
                            recording.name, known->second));
  }
}

void RefuseTwins(const Site& site, Faults* faults) {
  std::map<std::string, std::string> by_name, by_path;
  for (const SiteRecording& recording : site.recordings) {
    const auto [named, is_new] = by_name.emplace(recording.name, recording.path);
    if (!is_new) {
      faults->Add(
          fmt::format("recordings: found two of the name {}, {} and {}, expected names of "
                      "their own",
                      recording.name, named->second, recording.path));
    }
    if (!by_path.emplace(recording.path, recording.name).second) {
      faults->Add(fmt::format("recordings: found {} twice, expected once", recording.path));
    }
  }
}

// Each has maps to be laid on, and none has two for the same.
void CheckPlans(const Site& site, Faults* faults) {
  std::set<std::pair<std::string, std::string>> places, planned;
  for (const SiteRecording& recording : site.recordings) {
    places.insert({recording.building, recording.storey});
    places.insert({recording.building, ""});
  }
  for (const SitePlan& plan : site.plans) {
    const std::string place =
        plan.building + (plan.storey.empty() ? "" : ", storey " + plan.storey);
    if (!places.contains({plan.building, plan.storey})) {
      faults->Add(fmt::format("plans: found one of {}, of which no recording is", place));
    }
    if (!planned.insert({plan.building, plan.storey}).second) {
      faults->Add(fmt::format("plans: found two of {}, expected one", place));
    }
  }
}

}  // namespace

std::string FolderName(const std::string& name) {
  constexpr std::size_t kEnough = 6;
  if (name.empty() || IsFolderName(name)) return name;
  std::string folder;
  for (const char c : name) {
    const bool is_within_letter = (static_cast<unsigned char>(c) & 0xC0U) == 0x80U;  // of UTF-8
    if (!is_within_letter) folder += IsNameLetter(c) ? c : '_';
  }
  if (folder.front() == '.' || folder.front() == '-') folder.front() = '_';
  return folder + "-" + Checksum(name).substr(0, kEnough);  // others may look the same now
}

const SiteControl* FindControl(const Site& site, const std::string& building) {
  const auto found = std::ranges::find(site.control, building, &SiteControl::building);
  return found == site.control.end() ? nullptr : &*found;
}

Site ReadSite(const std::string& path) {
  YamlSection root = YamlSection::FromFile(path);
  const fs::path folder = fs::absolute(path).parent_path();
  Site site;
  Faults faults(path);
  int index = 0;
  for (YamlSection& section : root.List("recordings")) {
    AddRecordings(fmt::format("recordings[{}]", index++), ReadEntry(section, folder), folder, &site,
                  &faults);
  }
  root.Read("method", &site.method);
  root.Read("config", &site.config);
  root.Read("exports", &site.exports);
  root.Read("names", &site.names);
  ReadPlanEntries(&root, folder, &site, &faults);
  ReadControlEntries(&root, folder, &site, &faults);
  root.Finish();
  if (index == 0) faults.Add("recordings: found none, expected a list of some");
  site.config = FullPath(folder, site.config);
  site.names = FullPath(folder, site.names);
  if (!site.names.empty() && !fs::is_regular_file(site.names)) {
    faults.Add(fmt::format("names: found '{}', expected a file", site.names));
  }
  RefuseTwins(site, &faults);
  RefuseCopies(site, &faults);
  CheckPlans(site, &faults);
  for (const SiteRecording& recording : site.recordings) CheckRecording(recording, &faults);
  faults.Refuse();
  std::ranges::sort(site.recordings, {}, [](const SiteRecording& recording) {
    return std::tie(recording.date, recording.name);
  });
  return site;
}

}  // namespace slcmap::batch
