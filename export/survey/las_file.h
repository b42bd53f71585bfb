// LAS files of points, as the ASPRS describes them: LAS Specification 1.2 (2008) and 1.4-R15
// (2019).
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <string>

#include "data/io/file.h"
#include "export/survey/survey_points.h"

namespace slcmap::inline exporting {

enum class LasVersion {
  k12,  // points of format 2; at most 2^32 - 1 of them
  k14,  // points of format 7
};

// What a file says of where its points lie.
struct LasPlace {
  // Of a 1.2 file; 0: none, or one that GeoTIFF's keys cannot name.
  int epsg = 0;
  std::string wkt = {};  // of a 1.4 file, which takes no other: the CRS as OGC WKT
  Eigen::Vector3d offset_m = Eigen::Vector3d::Zero();  // coordinates are stored less this
};

// A file that is written point by point; a block of them is in memory. Coordinates are stored in
// tenths of a millimetre, so they may be 214 km from the offset. A point has its grey as intensity
// and as colour, the number of its source (PointSource) as point source id, class 1 and, where it
// was derived, the flag "synthetic"; as extra bytes (floats) `NormalX`, `NormalY`, `NormalZ` and
// `sigma`, the standard deviation in metres.
class LasFile {
 public:
  // Throws OutputError where it cannot be made, as the functions below where it cannot be written.
  LasFile(const std::string& path, LasVersion version, const LasPlace& place);

  // In the coordinates of the place. Throws DataError for one that is too far from the offset.
  void Add(const SurveyPoint& point);

  // To be called at the end: the header says how many points there are, and where.
  void Close();

 private:
  std::string Header() const;
  std::string Records() const;
  void AppendCoordinates(const Eigen::Vector3d& p);
  void Flush();

  std::string path_;
  LasVersion version_;
  LasPlace place_;
  FileWriter file_;
  std::string block_;
  uint64_t count_ = 0;
  Eigen::AlignedBox3d box_;  // of coordinates as they are stored
};

}  // namespace slcmap::exporting
