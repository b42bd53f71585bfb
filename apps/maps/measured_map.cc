#include "apps/maps/measured_map.h"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <memory>

#include "data/core/error.h"

namespace slcmap::inline evaluation {
namespace {

using Eigen::Vector3d;

constexpr double kRival = 0.9;  // of the overlap, for another place to be as good

ExternalMap ReadScaled(const std::string& path, double scale) {
  ExternalMap map = ReadExternalMap(path);
  if (scale == 1) return map;
  for (Vector3d& p : map.points) p *= scale;
  for (Vector3d& p : map.filled) p *= scale;
  for (PlySegment& line : map.lines) line.start_world *= scale, line.end_world *= scale;
  for (auto& triangle : map.triangles) {
    for (Vector3d& p : triangle) p *= scale;
  }
  return map;
}

std::unique_ptr<TrueScan> ReadTruth(const MapsToMeasure& maps) {
  if (maps.truth.empty()) return nullptr;
  const ExternalMap scan = ReadScaled(maps.truth, maps.true_scale);
  std::vector<Vector3d> points = SurfacePoints(scan);
  if (points.empty()) {
    throw DataError(
        fmt::format("{} ({}): found lines alone, expected the points or faces of a "
                    "scan; true edges go with --true-edges",
                    maps.truth, scan.format));
  }
  RefuseOtherUnits(maps.truth, points);
  auto truth = std::make_unique<TrueScan>(std::move(points));
  if (truth->map.planes() == 0) {
    throw DataError(fmt::format(
        "{}: found {} points on no surface, expected a scan of a building, with points at most "
        "some 20 cm apart",
        maps.truth, truth->map.points().size()));
  }
  return truth;
}

ScanPlacement Place(const std::string& path, const MapSamples& samples, const TrueScan& truth,
                    bool as_they_are) {
  const ScanPlacement placed = PlaceOnTruth(path, samples, truth, as_they_are);
  if (placed.rival >= kRival * placed.overlap) {
    spdlog::warn(
        "{}: fits the truth elsewhere about as well ({:.0f} against {:.0f} % of it); lay it there "
        "yourself and measure --as-they-are",
        path, 100 * placed.rival, 100 * placed.overlap);
  }
  return placed;
}

MeasuredMap Measure(const NamedMap& named, const TrueScan* truth, bool as_they_are) {
  const ExternalMap map = ReadScaled(named.path, named.scale);
  MeasuredMap measured{named.name, named.path, map.format, {}, {}, {}, {}, {}, {}, {}};
  measured.points = static_cast<int64_t>(map.points.size());
  measured.filled = static_cast<int64_t>(map.filled.size());
  measured.triangles = static_cast<int64_t>(map.triangles.size());
  measured.lines = static_cast<int64_t>(map.lines.size());
  std::vector<Vector3d> points = SurfacePoints(map);
  std::vector<Vector3d> ends;
  for (const PlySegment& line : map.lines) ends.push_back(line.start_world);
  RefuseOtherUnits(named.path, points.empty() ? ends : points);
  MapOnScan placed;
  placed.lines = &map.lines;
  placed.filled = &map.filled;
  MapSamples samples;
  std::optional<SurfaceMap> surfaces;
  std::vector<FoundFace> faces;
  if (!points.empty()) {
    surfaces.emplace(std::move(points));
    samples = SampleSurfaces(*surfaces);
    faces = FindFaces(*surfaces, samples.axes.axes.col(2));
    measured.walls = MeasureWalls(*surfaces, samples.axes, faces);
    placed.map = &*surfaces;
    placed.faces = &faces;
  }
  if (!map.lines.empty()) measured.edges = MeasureLines(map.lines);
  if (samples.places.empty()) {
    if (map.lines.empty()) {
      throw DataError(fmt::format(
          "{}: found {} points on no surface, expected a dense cloud: points of walls at most some "
          "20 cm apart",
          named.path, measured.points));
    }
    samples = SampleLines(map.lines);
    placed.map = nullptr;
  }
  if (truth) {
    placed.placement = Place(named.path, samples, *truth, as_they_are);
    measured.truth = MeasureAgreement(placed, *truth);
  }
  return measured;
}

}  // namespace

std::vector<MeasuredMap> MeasureMaps(const MapsToMeasure& maps, const Progress& progress) {
  std::vector<MeasuredMap> measured;
  const std::unique_ptr<TrueScan> truth = ReadTruth(maps);
  const auto count = static_cast<double>(maps.maps.size());
  for (const NamedMap& named : maps.maps) {
    progress.ReportOrStop(static_cast<double>(measured.size()) / count);
    measured.push_back(Measure(named, truth.get(), maps.as_they_are));
  }
  return measured;
}

}  // namespace slcmap::evaluation
