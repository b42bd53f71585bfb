// A site: recordings of buildings, and what is to be made of them, as a YAML file says it.
#pragma once

#include <string>
#include <vector>

#include "data/source/sequence_source.h"

namespace slcmap::inline batch {

struct SiteRecording {
  std::string name;        // of its folder: letters, digits, '.', '_' and '-'
  std::string path;        // in full: an EuRoC (ASL) or TUM VI folder, or a bag
  SequenceOptions opened;  // calibration (paths in full), cameras and topics
  std::string building;
  std::string storey;  // "": not said, as of a walk through several
  std::string date;    // YYYY-MM-DD; "": not said
};

// An image of a storey's plan, or of a building's of one storey.
struct SitePlan {
  std::string building, storey;
  std::string image;  // in full
  double pixel_m = 0;
};

// Control points of a building, as `georeference --control` takes them.
struct SiteControl {
  std::string building;
  std::string points;  // a file, in full
  std::string crs;     // "": a grid without a name
};

struct Site {
  std::vector<SiteRecording> recordings;  // by date and name: the first of a building has its world
  std::string method;                     // "": the configuration's
  std::string config;                     // a file; "": the defaults
  std::vector<std::string> exports;       // formats of `export`, and "page"
  std::vector<SitePlan> plans;
  std::vector<SiteControl> control;  // one a building at most
  std::string names;  // file of what rooms and the like are called, in full; "": none
};

// Beside the formats of `export`.
inline constexpr const char* kPageFormat = "page";

// The building of recordings that do not say one.
inline constexpr const char* kOnlyBuilding = "building";

// Null of a building that has none.
const SiteControl* FindControl(const Site& site, const std::string& building);

// Reads a site file; paths are from its folder, and those of recordings may have wildcards, for
// which all folders stand that match. Throws ConfigError for keys and values that cannot be; of
// what is wrong with names, files, recordings' folders and calibrations it names all that there is.
Site ReadSite(const std::string& path);

}  // namespace slcmap::batch
