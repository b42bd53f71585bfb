#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <limits>

#include "data/core/error.h"
#include "export/survey/las_file.h"
#include "export/survey/survey_writers.h"

namespace slcmap::inline exporting {
namespace {

LasVersion ChooseVersion(const LasOptions& options, std::size_t points) {
  const bool fits = points <= std::numeric_limits<uint32_t>::max();
  if (!fits) spdlog::info("las: {} points are more than LAS 1.2 can count, written as 1.4", points);
  return fits && options.version == "1.2" ? LasVersion::k12 : LasVersion::k14;
}

}  // namespace

void LasOptions::Check() const {
  if (version == "1.2" || version == "1.4") return;
  throw ConfigError(fmt::format("las version: found '{}', expected 1.2 or 1.4", version));
}

std::vector<std::string> LasWriter::Write(const std::string& folder, const MapResult& map,
                                          const Progress& progress) const {
  options_.Check();
  std::size_t all = 0, done = 0;
  for (const PointSource source : kPointSources) all += CountPoints(map, source);
  const Georeference place = FindPlace(map.source);
  const std::string path = folder + "/cloud.las";
  LasFile file(
      path, ChooseVersion(options_, all),
      {EpsgCode(place.crs), CrsWkt(place), place.origin_m.array().round()});  // as people read them
  for (const PointSource source : kPointSources) {
    for (std::size_t i = 0; i < CountPoints(map, source); ++i, ++done) {
      if (done % kPointsToReport == 0) {
        progress.ReportOrStop(static_cast<double>(done) / static_cast<double>(all));
      }
      SurveyPoint point = PointAt(map, source, i);
      point.p = place * point.p;
      point.normal = TurnedNormal(place, point.normal);
      file.Add(point);
    }
  }
  file.Close();
  progress.ReportOrStop(1);
  return {path};
}

}  // namespace slcmap::exporting
