#include "mapping/map/evidence_files.h"

#include <spdlog/fmt/fmt.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cstdint>
#include <iterator>
#include <string>
#include <unordered_map>
#include <vector>

#include "data/io/csv.h"
#include "data/io/file.h"
#include "mapping/map/map.h"
#include "odometry/run/run_rows.h"

namespace slcmap::inline mapping {

// The stamps of a map's poses, which images are named by.
class PoseStamps {
 public:
  explicit PoseStamps(const MapResult& map) {
    for (const Trajectory* poses : {&map.trajectory, &map.keyframes}) {
      for (const StampedPose& pose : *poses) stamps_ns_.push_back(pose.stamp_ns);
    }
    std::sort(stamps_ns_.begin(), stamps_ns_.end());
  }

  // That of a table of one row.
  int64_t At(const CsvTable& row, std::size_t column) const {
    const int64_t stamp_ns = row.Integer(0, column);
    if (!std::binary_search(stamps_ns_.begin(), stamps_ns_.end(), stamp_ns)) {
      row.Fail(0, column, "the stamp of a pose in trajectory.tum or keyframes.tum");
    }
    return stamp_ns;
  }

 private:
  std::vector<int64_t> stamps_ns_;
};

// Adds what follows the last one by its key (MakeKey), which the columns of `order` are.
template <typename Item>
void AddNext(const Item& item, const CsvTable& row, const char* order, std::vector<Item>* items) {
  if (!items->empty() && !(MakeKey(items->back()) < MakeKey(item))) {
    row.Fail(0, 0, fmt::format("rows in the order of {}, each once", order));
  }
  items->push_back(item);
}

namespace {

constexpr std::size_t kFirstCell = 2;  // of the covariances, behind line and piece

using Matrix6d = Eigen::Matrix<double, 6, 6>;

// The cells of the matrix of both ends, in the order of the columns: the upper triangles of start
// and end, and all of what they share.
std::vector<std::pair<int, int>> MakeCells() {
  std::vector<std::pair<int, int>> cells;
  for (const int end : {0, 3}) {
    for (int row = 0; row < 3; ++row) {
      for (int column = row; column < 3; ++column) cells.emplace_back(end + row, end + column);
    }
  }
  for (int i = 0; i < 9; ++i) cells.emplace_back(i / 3, 3 + i % 3);
  return cells;
}

const std::vector<std::pair<int, int>>& Cells() {
  static const std::vector<std::pair<int, int>> cells = MakeCells();
  return cells;
}

constexpr const char* kCellNames[] = {
    "start_xx_m2",     "start_xy_m2",     "start_xz_m2",     "start_yy_m2",     "start_yz_m2",
    "start_zz_m2",     "end_xx_m2",       "end_xy_m2",       "end_xz_m2",       "end_yy_m2",
    "end_yz_m2",       "end_zz_m2",       "start_end_xx_m2", "start_end_xy_m2", "start_end_xz_m2",
    "start_end_yx_m2", "start_end_yy_m2", "start_end_yz_m2", "start_end_zx_m2", "start_end_zy_m2",
    "start_end_zz_m2"};

CsvColumns PieceColumns() {
  return {IntegerColumn("line_id", 0, kMaxId), IntegerColumn("piece", 0, kMaxId)};
}

CsvColumns CovarianceColumns() {
  CsvColumns columns = PieceColumns();
  for (std::size_t i = 0; i < Cells().size(); ++i) {
    const bool is_variance = Cells()[i].first == Cells()[i].second;
    columns.push_back({kCellNames[i], CsvColumn::Kind::kNumber, is_variance ? 0 : -kMaxVariance_m2,
                       kMaxVariance_m2});
  }
  return columns;
}

// Of an image: which of a rig's.
CsvColumn CameraColumn(const Rig& rig) {
  return IntegerColumn("camera", 0, static_cast<double>(rig.cameras.size()) - 1);
}

CsvColumns SupportColumns(const Rig& rig) {
  CsvColumns columns = PieceColumns();
  columns.push_back(IntegerColumn("stamp_ns", -kMaxStamp_ns, kMaxStamp_ns));
  columns.push_back(CameraColumn(rig));
  for (const char* name : {"start_x_px", "start_y_px", "end_x_px", "end_y_px"}) {
    columns.push_back({name, CsvColumn::Kind::kNumber, -kMaxPixel, kMaxPixel});
  }
  return columns;
}

Matrix6d BothEnds(const LineCovariance& covariance) {
  Matrix6d both;
  both << covariance.start_m2, covariance.start_end_m2, covariance.start_end_m2.transpose(),
      covariance.end_m2;
  return both;
}

// Six digits are far more than a covariance is known to.
std::string Row(const LineCovariance& covariance) {
  const Matrix6d both = BothEnds(covariance);
  std::string row = fmt::format("{},{}", covariance.line_id, covariance.piece);
  for (const auto& [r, c] : Cells()) {
    fmt::format_to(std::back_inserter(row), ",{:.6g}", both(r, c) + 0.0);  // no -0
  }
  return row + "\n";
}

std::string Row(const LineSupport& support) {
  const LineSegment& px = support.px;
  return fmt::format("{},{},{},{},{:.2f},{:.2f},{:.2f},{:.2f}\n", support.line_id, support.piece,
                     support.stamp_ns, support.camera, px.start.x(), px.start.y(), px.end.x(),
                     px.end.y());
}

template <typename Items>
std::string FormatRows(const CsvColumns& columns, const Items& items) {
  std::string text = CsvHeader(columns) + "\n";
  for (const auto& item : items) text += Row(item);
  return text;
}

// How many pieces each line has.
class Pieces {
 public:
  explicit Pieces(const MapResult& map) {
    for (const auto* lines : {&map.lines, &map.marks}) {
      for (const MapLine& line : *lines) ++pieces_[line.id];
    }
  }

  // The line and piece of a row.
  std::pair<int64_t, int> At(const CsvTable& row) const {
    const auto found = pieces_.find(row.Integer(0, 0));
    if (found == pieces_.end()) row.Fail(0, 0, "the id of a line in lines.ply or marks.ply");
    const int piece = row.Int(0, 1);
    if (piece >= found->second) {
      row.Fail(0, 1, fmt::format("less than the {} pieces that the line has", found->second));
    }
    return {found->first, piece};
  }

 private:
  std::unordered_map<int64_t, int> pieces_;
};

LineCovariance CovarianceAt(const CsvTable& row) {
  constexpr double kRounding = 1e-4;  // of the largest eigenvalue
  Matrix6d both;
  for (std::size_t i = 0; i < Cells().size(); ++i) {
    const auto& [r, c] = Cells()[i];
    both(r, c) = both(c, r) = row.Number(0, kFirstCell + i);
  }
  const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(both, Eigen::EigenvaluesOnly);
  const double least = solver.eigenvalues()(0), most = solver.eigenvalues()(5);
  if (!(least >= -kRounding * most)) {
    row.Fail(0, kFirstCell,
             fmt::format("columns that are a covariance: its least eigenvalue is {:.3g}", least));
  }
  return {0, 0, both.topLeftCorner<3, 3>(), both.bottomRightCorner<3, 3>(),
          both.topRightCorner<3, 3>()};
}

std::vector<LineCovariance> ReadCovariances(const std::string& path, const Pieces& pieces) {
  std::vector<LineCovariance> covariances;
  CsvTable::ForEach(path, CovarianceColumns(), [&](const CsvTable& row) {
    const auto [line_id, piece] = pieces.At(row);
    LineCovariance covariance = CovarianceAt(row);
    covariance.line_id = line_id;
    covariance.piece = piece;
    AddNext(covariance, row, "line_id and piece", &covariances);
  });
  return covariances;
}

std::vector<LineSupport> ReadSupports(const std::string& path, const MapResult& map,
                                      const Pieces& pieces) {
  const PoseStamps stamps(map);
  std::vector<LineSupport> supports;
  CsvTable::ForEach(path, SupportColumns(map.rectified_rig), [&](const CsvTable& row) {
    const auto [line_id, piece] = pieces.At(row);
    const LineSegment px{{row.Number(0, 4), row.Number(0, 5)},
                         {row.Number(0, 6), row.Number(0, 7)}};
    const LineSupport support{line_id, piece, stamps.At(row, 2), row.Int(0, 3), px};
    AddNext(support, row, "line_id, piece, stamp_ns and camera", &supports);
  });
  return supports;
}

}  // namespace

std::vector<std::string> LineEvidenceFiles() { return {kLineCovarianceFile, kLineSupportFile}; }

void WriteLineEvidence(const std::string& folder, const LineEvidence& evidence) {
  WriteFile(folder + "/" + kLineCovarianceFile,
            FormatRows(CovarianceColumns(), evidence.covariances));
  WriteFile(folder + "/" + kLineSupportFile, FormatRows(SupportColumns(Rig()), evidence.supports));
}

LineEvidence ReadLineEvidence(const std::string& folder, const MapResult& map) {
  const Pieces pieces(map);
  return {ReadCovariances(folder + "/" + kLineCovarianceFile, pieces),
          ReadSupports(folder + "/" + kLineSupportFile, map, pieces)};
}

namespace {

enum Column { kPoint, kTrack, kStamp, kCamera, kX, kY };

CsvColumns ObservationColumns(const Rig& rig) {
  return {IntegerColumn("point", 0, kMaxId),
          IntegerColumn("track", 0, kMaxId),
          IntegerColumn("stamp_ns", -kMaxStamp_ns, kMaxStamp_ns),
          CameraColumn(rig),
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
  std::string text = CsvHeader(ObservationColumns(Rig())) + "\n";
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
  CsvTable::ForEach(path, ObservationColumns(map.rectified_rig), [&](const CsvTable& row) {
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

}  // namespace slcmap::mapping
