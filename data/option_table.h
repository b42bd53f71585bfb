// One table for a struct of options: key, member and range of each stand in one place, which serves
// both reading from YAML and checking.
//
//   constexpr OptionTable kTable{Option{"max_points", &PointOptions::max_points, 1, 10000},
//                                Option{"min_distance_px", &PointOptions::min_distance_px, 3.0,
//                                       1e3}};
//   void PointOptions::Check() const { kTable.Check("points", *this); }
//   void PointOptions::Read(YamlSection section) { kTable.Read(section, this); }
#pragma once

#include <sstream>
#include <string>
#include <tuple>

#include "data/error.h"
#include "data/yaml_options.h"

namespace slcmap {

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
  template <typename Options>
  void Read(YamlSection section, Options* options) const {
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

}  // namespace slcmap
