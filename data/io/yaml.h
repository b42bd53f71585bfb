// The YAML files that configure the stages (--config): their sections, tables of options with
// ranges, and what a mistyped name was probably meant to be.
#pragma once

#include <functional>
#include <initializer_list>
#include <memory>
#include <set>
#include <sstream>
#include <string>
#include <tuple>
#include <vector>

#include "data/core/error.h"

namespace slcmap::inline data {

// "; did you mean 'slc'?" for the name that takes the fewest letters to add, leave out, replace or
// swap with the next, upper or lower case; "" where that is more than a third of them.
std::string DidYouMean(const std::string& found, const std::vector<std::string>& names);

}  // namespace slcmap::data

namespace YAML {
class Node;
}

namespace slcmap::inline data {

// One mapping of a YAML file. Each key is asked for once; Finish() throws ConfigError, naming file
// and key, when the mapping holds a key that nobody asked for.
//
//   YamlSection root = YamlSection::FromFile("rig.yaml");
//   YamlSection points = root.Section("points");
//   points.Read("max_count", &options.max_count);
//   points.Finish();  root.Finish();
class YamlSection {
 public:
  static YamlSection FromFile(const std::string& path);    // throws ConfigError
  YamlSection(const YAML::Node& node, std::string place);  // place: "file.yaml: key.key"

  // The YAML text of everything that `read` asks a section for: with an empty section, the values
  // that the options have.
  static std::string Dump(const std::function<void(YamlSection*)>& read);

  // The mapping under `key`; an empty one where the key is absent.
  YamlSection Section(const std::string& key);

  // The mappings listed under `key`; none where the key is absent. Throws ConfigError if the value
  // is no list of mappings.
  std::vector<YamlSection> List(const std::string& key);
  // The mapping's keys, in the order of the file; all count as asked for.
  std::vector<std::string> Keys();

  bool Has(const std::string& key) const;
  // Takes a key that is no option any more: files of earlier versions may have it.
  void Skip(const std::string& key) { known_.insert(key); }
  // The same for one version, of options that people may have set: ReadConfigFile warns of those
  // that the file has.
  void Retire(std::initializer_list<const char*> keys);
  // The places of keys that Retire took, in this section and those that it was asked for.
  const std::vector<std::string>& retired() const { return *retired_; }

  // Overwrites *value when the key is present; throws ConfigError naming file, key, what was found
  // and the type that was expected. T is bool, int, double, std::string, std::vector of these or
  // std::vector<std::vector<double>>.
  template <typename T>
  void Read(const std::string& key, T* value);

  void Finish() const;
  const std::string& place() const { return place_; }

 private:
  std::shared_ptr<const YAML::Node> node_;  // the parser is a large header
  std::string place_;
  std::set<std::string> known_;
  std::shared_ptr<std::vector<std::string>> retired_ = std::make_shared<std::vector<std::string>>();
  std::shared_ptr<std::string> dump_;  // that is being made, if one is
  int depth_ = 0;
};

// One table for a struct of options: key, member and range of each stand in one place, which serves
// both reading from YAML and checking.
//
//   constexpr OptionTable kTable{Option{"max_points", &PointOptions::max_points, 1, 10000},
//                                Option{"min_distance_px", &PointOptions::min_distance_px, 3.0,
//                                       1e3}};
//   void PointOptions::Check() const { kTable.Check("points", *this); }
//   void PointOptions::Read(YamlSection section) { kTable.Read(section, this); }

// T is bool, int or double, the type of the member; bounds count as allowed.
template <typename Options, typename T>
struct Option {
  const char* key;
  T Options::*member;
  T low;
  T high;
};
template <typename Options, typename T>
Option(const char*, T Options::*, T, T) -> Option<Options, T>;

template <typename... Entries>
class OptionTable {
 public:
  constexpr explicit OptionTable(Entries... entries) : entries_(entries...) {}

  // Throws ConfigError naming section and key, what was found and the range. section: the keys of
  // the file above the table's, joined by dots.
  template <typename Options>
  void Check(const std::string& section, const Options& options) const {
    std::apply(
        [&](const auto&... entry) { (CheckRange(section, entry, options.*entry.member), ...); },
        entries_);
  }

  // Overwrites what the section holds; throws ConfigError for an unknown key or a wrong type.
  // retired: keys that are options no more; see YamlSection::Retire.
  template <typename Options>
  void Read(YamlSection section, Options* options,
            std::initializer_list<const char*> retired = {}) const {
    section.Retire(retired);
    std::apply(
        [&](const auto&... entry) { (section.Read(entry.key, &(options->*entry.member)), ...); },
        entries_);
    section.Finish();
  }

 private:
  template <typename Entry, typename T>
  static void CheckRange(const std::string& section, const Entry& entry, T value) {
    if (value >= entry.low && value <= entry.high) return;
    std::ostringstream message;
    message << section << "." << entry.key << ": found " << value << ", expected " << entry.low
            << " to " << entry.high;
    throw ConfigError(message.str());
  }

  std::tuple<Entries...> entries_;
};

// Throws ConfigError unless the least value of an option is at most the largest.
inline void CheckOrder(const std::string& section, const char* least_key, double least,
                       const char* largest_key, double largest) {
  if (least <= largest) return;
  std::ostringstream message;
  message << section << "." << least_key << ": found " << least << ", expected at most "
          << largest_key << ", which is " << largest;
  throw ConfigError(message.str());
}

// The top-level keys that some stage reads. One file may hold those of all stages: each stage reads
// its own and leaves the others, and what is not in this list nobody reads.
inline constexpr const char* kConfigKeys[] = {
    "method",         "rectifier",          "points",  "window",
    "keyframes",      "initializer",        "failure", "lines",
    "manhattan",      "line_classifier",    "slopes",  "points_on_lines",
    "line_landmarks", "building_deviation", "verdict", "calibration",
    "mapping"};

// Who wrote a configuration. The options that a map keeps hold what there was then, and stay so.
enum class ConfigOrigin { kUser, kKept };

// Calls read(root) and returns its result. Throws ConfigError, always naming the file, when it
// cannot be read, a top-level key is not in kConfigKeys or stands twice, or read throws one. Warns
// once of the retired keys that a user's file has.
template <typename Read>
auto ReadConfigFile(const std::string& path, ConfigOrigin origin, Read read);

// Opens the file and refuses the top-level keys that no stage reads.
YamlSection OpenConfigFile(const std::string& path);

void WarnOfRetiredKeys(const std::string& path, const std::vector<std::string>& places);

// The error with the path before it, unless it is there already.
ConfigError NamingFile(const std::string& path, const ConfigError& error);

template <typename Read>
auto ReadConfigFile(const std::string& path, ConfigOrigin origin, Read read) {
  YamlSection root = OpenConfigFile(path);
  try {
    auto result = read(root);
    if (origin == ConfigOrigin::kUser) WarnOfRetiredKeys(path, root.retired());
    return result;
  } catch (const ConfigError& error) {
    throw NamingFile(path, error);
  }
}

}  // namespace slcmap::data
