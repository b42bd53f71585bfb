// The tables of a map folder that tell which image shows what: line_covariances.csv,
// line_supports.csv and point_observations.csv.
#pragma once

#include <string>
#include <vector>

#include "mapping/map/map.h"

namespace slcmap::inline mapping {

inline constexpr char kLineCovarianceFile[] = "line_covariances.csv",
                      kLineSupportFile[] = "line_supports.csv";
std::vector<std::string> LineEvidenceFiles();

// Writes both tables. Throws OutputError.
void WriteLineEvidence(const std::string& folder, const LineEvidence& evidence);

// Reads the tables of a map whose lines, marks and poses were read. Throws DataError, naming file
// and row, for values that cannot be, rows that are not in order or come twice, and lines, pieces
// and images that the map has not.
LineEvidence ReadLineEvidence(const std::string& folder, const MapResult& map);

inline constexpr char kPointObservationFile[] = "point_observations.csv";

// Throws OutputError.
void WritePointObservations(const std::string& path,
                            const std::vector<MapPointObservation>& observations);

// Reads the table of a map whose points and poses were read. Throws DataError, naming file and row,
// for values that cannot be, rows that are not in order or come twice, points and images that the
// map has not, and tracks of a point that do not count from 0.
std::vector<MapPointObservation> ReadPointObservations(const std::string& path,
                                                       const MapResult& map);

}  // namespace slcmap::mapping
