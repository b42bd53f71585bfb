// The YAML files that configure the stages (--config).
#pragma once

#include <string>

#include "data/yaml_options.h"

namespace slcmap {

// The top-level keys that some stage reads. One file may hold those of all stages: each stage reads
// its own and leaves the others, and what is not in this list nobody reads.
inline constexpr const char* kConfigKeys[] = {"method",
                                              "rectifier",
                                              "points",
                                              "window",
                                              "keyframes",
                                              "initializer",
                                              "failure",
                                              "lines",
                                              "manhattan",
                                              "line_classifier",
                                              "slopes",
                                              "points_on_lines",
                                              "line_landmarks",
                                              "building_deviation",
                                              "verdict",
                                              "calibration",
                                              "mapping"};

// Calls read(root) and returns its result. Throws ConfigError, always naming the file, when it
// cannot be read, a top-level key is not in kConfigKeys or stands twice, or read throws one.
template <typename Read>
auto ReadConfigFile(const std::string& path, Read read);

// Opens the file and refuses the top-level keys that no stage reads.
YamlSection OpenConfigFile(const std::string& path);

// The error with the path before it, unless it is there already.
ConfigError NamingFile(const std::string& path, const ConfigError& error);

template <typename Read>
auto ReadConfigFile(const std::string& path, Read read) {
  YamlSection root = OpenConfigFile(path);
  try {
    return read(root);
  } catch (const ConfigError& error) {
    throw NamingFile(path, error);
  }
}

}  // namespace slcmap
