// Maps for surveyors and geographic information systems: clouds as LAS and E57, plans as GeoPackage
// and GeoJSON. Coordinates are those of the map's place (FindPlace), in metres where nothing else
// is said.
#pragma once

#include <string>
#include <vector>

#include "export/scene/map_writer.h"
#include "export/scene/options.h"

namespace slcmap::inline exporting {

// Writes cloud.las, as LasFile describes it: surfaces that were measured, then those that were
// derived, then landmarks.
class LasWriter : public MapWriter {
 public:
  explicit LasWriter(const LasOptions& options = {}) : options_(options) {}
  std::string Format() const override { return "las"; }
  std::vector<std::string> Names() const override { return {"cloud.las"}; }

  // Throws also DataError for points that are not finite or too far apart.
  std::vector<std::string> Write(const std::string& folder, const MapResult& map,
                                 const Progress& progress) const override;

 private:
  LasOptions options_;
};

// Writes cloud.e57, as E57File describes it: a scan (Data3D) each for surfaces that were measured,
// those that were derived, and landmarks, where there are any.
class E57Writer : public MapWriter {
 public:
  std::string Format() const override { return "e57"; }
  std::vector<std::string> Names() const override { return {"cloud.e57"}; }

  // Throws also DataError for points that are not finite.
  std::vector<std::string> Write(const std::string& folder, const MapResult& map,
                                 const Progress& progress) const override;
};

// Writes plan.gpkg, a GeoPackage with the layers of MakeFeatureLayers, for all storeys, in the CRS
// of the map or an engineering one.
class GeoPackageWriter : public MapWriter {
 public:
  std::string Format() const override { return "gpkg"; }
  std::vector<std::string> Names() const override { return {"plan.gpkg"}; }
  std::vector<std::string> Write(const std::string& folder, const MapResult& map,
                                 const Progress& progress) const override;
};

// Writes plan/storey_N.geojson for each storey with the features of MakeFeatureLayers, each of
// which says in `feature` what it is; of a map without storeys one, `plan/no_storey`. Coordinates
// are degrees of WGS 84, or metres of a map that has no place on Earth: then `crs` says so. Throws
// also DataError for a map that is not where its system is.
class GeoJsonWriter : public MapWriter {
 public:
  std::string Format() const override { return "geojson"; }
  std::vector<std::string> Names() const override { return {"plan"}; }
  std::vector<std::string> Write(const std::string& folder, const MapResult& map,
                                 const Progress& progress) const override;
};

}  // namespace slcmap::exporting
