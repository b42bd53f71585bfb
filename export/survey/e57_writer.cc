#include <spdlog/fmt/fmt.h>

#include "export/survey/e57_file.h"
#include "export/survey/survey_writers.h"

namespace slcmap::inline exporting {
namespace {

std::string Describe(PointSource source) {
  switch (source) {
    case PointSource::kStereo:
      return "surfaces, measured by stereo";
    case PointSource::kFilled:
      return "planes of the building where nothing was measured: derived";
    case PointSource::kLandmark:
      break;
  }
  return "landmarks of the adjustment";
}

// A pose holds no scale: that of a grid is in the points.
RigidTransform MakePose(const Georeference& place) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(place.turn_rad, Eigen::Vector3d::UnitZ())),
          place.origin_m};
}

void WriteScan(const MapResult& map, PointSource source, const Progress& progress, E57File* file) {
  const Georeference place = FindPlace(map.source);
  const std::size_t count = CountPoints(map, source);
  file->Begin({.name = GetName(source),
               .description = Describe(source),
               .guid = E57Guid(fmt::format("{} {}", map.id, GetName(source))),
               .count = count,
               .T_file = MakePose(place),
               .has_surfaces = source != PointSource::kLandmark});
  for (std::size_t i = 0; i < count; ++i) {
    if (i % kPointsToReport == 0) {
      progress.ReportOrStop(static_cast<double>(i) / static_cast<double>(count));
    }
    SurveyPoint point = PointAt(map, source, i);
    point.p.head<2>() *= place.scale;
    file->Add(point);
  }
}

}  // namespace

std::vector<std::string> E57Writer::Write(const std::string& folder, const MapResult& map,
                                          const Progress& progress) const {
  const std::string path = folder + "/cloud.e57";
  E57File file(path, E57Guid(map.id), CrsWkt(FindPlace(map.source)));
  double from = 0;
  for (const PointSource source : kPointSources) {
    const double to = from + 1.0 / kPointSources.size();
    if (CountPoints(map, source) > 0) WriteScan(map, source, progress.Part(from, to), &file);
    from = to;
  }
  file.Close();
  progress.ReportOrStop(1);
  return {path};
}

}  // namespace slcmap::exporting
