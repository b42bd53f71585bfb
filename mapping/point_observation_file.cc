#include "mapping/point_observation_file.h"

#include <spdlog/fmt/fmt.h>

#include <iterator>

#include "data/csv_table.h"
#include "data/file.h"
#include "mapping/evidence_rows.h"
#include "odometry/run_rows.h"

namespace slcmap {
namespace {

enum Column { kPoint, kTrack, kStamp, kCamera, kX, kY };

CsvColumns ObservationColumns() {
  return {IntegerColumn("point", 0, kMaxId),
          IntegerColumn("track", 0, kMaxId),
          IntegerColumn("stamp_ns", -kMaxStamp_ns, kMaxStamp_ns),
          IntegerColumn("camera", 0, 1),
          {"x_px", CsvColumn::Kind::kNumber, -kMaxPixel, kMaxPixel},
          {"y_px", CsvColumn::Kind::kNumber, -kMaxPixel, kMaxPixel}};
}

void CheckPoint(const CsvTable& row, std::size_t points) {
  if (row.Integer(0, kPoint) < static_cast<int64_t>(points)) return;
  row.Fail(0, kPoint, fmt::format("less than the {} points of points.ply", points));
}

void CheckTrack(const CsvTable& row, const std::vector<MapPointObservation>& before) {
  const bool is_next = !before.empty() && before.back().point == row.Integer(0, kPoint);
  const int most = is_next ? before.back().track + 1 : 0;
  if (row.Int(0, kTrack) <= most) return;
  row.Fail(0, kTrack, fmt::format("at most {}: tracks of a point count from 0", most));
}

}  // namespace

void WritePointObservations(const std::string& path,
                            const std::vector<MapPointObservation>& observations) {
  std::string text = CsvHeader(ObservationColumns()) + "\n";
  for (const MapPointObservation& seen : observations) {
    fmt::format_to(std::back_inserter(text), "{},{},{},{},{:.3f},{:.3f}\n", seen.point, seen.track,
                   seen.stamp_ns, seen.camera, seen.px.x(), seen.px.y());
  }
  WriteFile(path, text);
}

std::vector<MapPointObservation> ReadPointObservations(const std::string& path,
                                                       const MapResult& map) {
  const PoseStamps stamps(map);
  std::vector<MapPointObservation> observations;
  CsvTable::ForEach(path, ObservationColumns(), [&](const CsvTable& row) {
    CheckPoint(row, map.points.size());
    const MapPointObservation seen{row.Integer(0, kPoint),
                                   row.Int(0, kTrack),
                                   stamps.At(row, kStamp),
                                   row.Int(0, kCamera),
                                   {row.Number(0, kX), row.Number(0, kY)}};
    CheckTrack(row, observations);
    AddNext(seen, row, "point, track, stamp_ns and camera", &observations);
  });
  return observations;
}

}  // namespace slcmap
