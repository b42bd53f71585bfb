// Maps by any system, read, laid on a laser scan and measured alike.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/maps/truth_agreement.h"
#include "data/core/progress.h"

namespace slcmap::inline evaluation {

// What is measured, as a user names it.
struct NamedMap {
  std::string name, path;
  double scale = 1;  // to metres
};

struct MapsToMeasure {
  std::vector<NamedMap> maps;
  std::string truth;  // a laser scan or a mesh; "": none
  double true_scale = 1;
  bool as_they_are = false;  // not laid on the truth
};

struct MeasuredMap {
  std::string name, path, format;
  int64_t points = 0, filled = 0, triangles = 0, lines = 0;
  std::optional<WallStraightness> walls;  // of a map with surfaces
  std::optional<LineStraightness> edges;  // of a map with lines
  std::optional<TruthAgreement> truth;
};

struct MapMeasures {
  std::vector<MeasuredMap> maps;
  std::string failures;  // why others could not be measured, in one line; "" of none
};

// Throws DataError where no map could be measured, or the truth cannot be read, and StoppedError
// when progress says so.
MapMeasures MeasureMaps(const MapsToMeasure& maps, const Progress& progress = {});

// Measured maps side by side: a table to read, CSV and JSON.

std::string MapTable(const std::vector<MeasuredMap>& maps);
std::string MapCsv(const std::vector<MeasuredMap>& maps);
nlohmann::ordered_json MapsJson(const std::vector<MeasuredMap>& maps);

// In words: which map is the straightest, by its walls and by its lines, under the longest
// straightedge that can be laid on all of them. Those that print the same share a rank.
std::vector<std::string> Ranking(const std::vector<MeasuredMap>& maps);

}  // namespace slcmap::evaluation
