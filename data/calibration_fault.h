// A key of a calibration that cannot be used, said with its file and a remedy.
#pragma once

#include <spdlog/fmt/fmt.h>

#include <string>

#include "data/input_fault.h"
#include "data/yaml_options.h"

namespace slcmap {

// "a.yaml: cam0" and "intrinsics" -> "cam0.intrinsics in a.yaml", for remedies.
inline std::string KeyInFile(const std::string& place, const std::string& key) {
  const size_t colon = place.find(": ");
  if (colon == std::string::npos) return key + " in " + place;
  return place.substr(colon + 2) + "." + key + " in " + place.substr(0, colon);
}

// "a.yaml: cam0: intrinsics: PROBLEM", to throw.
inline InputFault CalibrationFault(const YamlSection& section, const std::string& key,
                                   const std::string& problem, const std::string& remedy) {
  return InputFault("calibration", fmt::format("{}: {}: {}", section.place(), key, problem),
                    remedy);
}

}  // namespace slcmap
