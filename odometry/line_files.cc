#include "odometry/line_files.h"

#include <spdlog/fmt/fmt.h>

#include <array>
#include <unordered_map>
#include <utility>

#include "data/csv_table.h"
#include "data/file.h"
#include "odometry/run_lines.h"

namespace slcmap {
namespace {

constexpr char kLineColumns[] =
    "id,segment,axis,world,start_x_m,start_y_m,start_z_m,end_x_m,end_y_m,end_z_m,cov_xx_m2,"
    "cov_xy_m2,cov_xz_m2,cov_yy_m2,cov_yz_m2,cov_zz_m2,observations,last_keyframe_id";
constexpr char kObservationColumns[] =
    "keyframe_id,line_id,left_start_x_px,left_start_y_px,left_end_x_px,left_end_y_px,"
    "right_start_x_px,right_start_y_px,right_end_x_px,right_end_y_px";
constexpr char kPointColumns[] = "line_id,landmark_id";

// The upper triangle of a symmetric matrix, in the order of the columns.
constexpr std::array<std::pair<int, int>, 6> kUpperTriangle = {
    {{0, 0}, {0, 1}, {0, 2}, {1, 1}, {1, 2}, {2, 2}}};

struct LinePaths {
  explicit LinePaths(const std::string& folder)
      : ply(folder + "/lines.ply"),
        lines(folder + "/lines.csv"),
        observations(folder + "/line_observations.csv"),
        points(folder + "/line_points.csv") {}
  std::string ply, lines, observations, points;
};

std::string Columns(const Eigen::Vector3d& v) {
  return fmt::format("{},{},{}", v.x(), v.y(), v.z());
}

std::string Columns(const LineSegment& s) {
  return fmt::format("{:.4f},{:.4f},{:.4f},{:.4f}", s.start.x(), s.start.y(), s.end.x(), s.end.y());
}

std::string LineRow(const Line& line) {
  std::string row =
      fmt::format("{},{},{},{},{},{}", line.id, line.segment, static_cast<int>(line.axis),
                  line.world, Columns(line.start_world), Columns(line.end_world));
  for (const auto& [r, c] : kUpperTriangle) row += fmt::format(",{}", line.covariance_m2(r, c));
  return row + fmt::format(",{},{}\n", line.observations, line.last_keyframe);
}

void WriteLines(const LinePaths& paths, const std::vector<Line>& lines) {
  std::string rows = std::string(kLineColumns) + "\n";
  std::string points = std::string(kPointColumns) + "\n";
  for (const Line& line : lines) {
    rows += LineRow(line);
    for (const int64_t id : line.point_ids) points += fmt::format("{},{}\n", line.id, id);
  }
  WriteFile(paths.lines, rows);
  WriteFile(paths.points, points);
}

void WriteObservations(const std::string& path, const std::vector<Keyframe>& keyframes) {
  std::string rows = std::string(kObservationColumns) + "\n";
  for (const Keyframe& keyframe : keyframes) {
    for (const LineObservation& seen : keyframe.lines) {
      rows += fmt::format("{},{},{},{}\n", keyframe.id, seen.id, Columns(seen.left_px),
                          seen.right_px ? Columns(*seen.right_px) : "nan,nan,nan,nan");
    }
  }
  WriteFile(path, rows);
}

Eigen::Vector2d Pixel(const CsvTable& table, std::size_t row, std::size_t column) {
  return {table.Number(row, column), table.Number(row, column + 1)};
}

Eigen::Vector3d Vector(const CsvTable& table, std::size_t row, std::size_t column) {
  return {table.Number(row, column), table.Number(row, column + 1), table.Number(row, column + 2)};
}

// An integer from `least` to `most`.
int Bounded(const CsvTable& table, std::size_t row, std::size_t column, int64_t least, int64_t most,
            const char* expected) {
  const int64_t value = table.Integer(row, column);
  if (value < least || value > most) table.Fail(row, column, expected);
  return static_cast<int>(value);
}

Line ReadLine(const CsvTable& table, std::size_t row, std::size_t worlds) {
  Line line;
  line.id = table.Integer(row, 0);
  line.segment = static_cast<int>(table.Integer(row, 1));
  line.axis = static_cast<LineAxis>(Bounded(table, row, 2, 0, 3, "0 to 3"));
  line.world = Bounded(table, row, 3, -1, static_cast<int64_t>(worlds) - 1,
                       "-1 or the index of a Manhattan world in run.json");
  line.start_world = Vector(table, row, 4);
  line.end_world = Vector(table, row, 7);
  for (std::size_t i = 0; i < kUpperTriangle.size(); ++i) {
    const auto& [r, c] = kUpperTriangle[i];
    line.covariance_m2(r, c) = line.covariance_m2(c, r) = table.Number(row, 10 + i);
  }
  line.observations = static_cast<int>(table.Integer(row, 16));
  line.last_keyframe = table.Integer(row, 17);
  return line;
}

using IndexById = std::unordered_map<int64_t, std::size_t>;

IndexById ReadLines(const std::string& path, OdometryRun* run) {
  const CsvTable table = CsvTable::Read(path, kLineColumns);
  IndexById index;
  for (std::size_t i = 0; i < table.rows(); ++i) {
    run->lines.push_back(ReadLine(table, i, run->manhattan_worlds.size()));
    if (!index.emplace(run->lines.back().id, i).second) {
      table.Fail(i, 0, "an id that no row before it has");
    }
  }
  return index;
}

void ReadPoints(const std::string& path, const IndexById& index, std::vector<Line>* lines) {
  const CsvTable table = CsvTable::Read(path, kPointColumns);
  for (std::size_t i = 0; i < table.rows(); ++i) {
    const auto line = index.find(table.Integer(i, 0));
    if (line == index.end()) table.Fail(i, 0, "the id of a line in lines.csv");
    (*lines)[line->second].point_ids.push_back(table.Integer(i, 1));
  }
}

void ReadObservations(const std::string& path, std::vector<Keyframe>* keyframes) {
  IndexById index;
  for (std::size_t i = 0; i < keyframes->size(); ++i) index[(*keyframes)[i].id] = i;
  const CsvTable table = CsvTable::Read(path, kObservationColumns);
  for (std::size_t i = 0; i < table.rows(); ++i) {
    const auto keyframe = index.find(table.Integer(i, 0));
    if (keyframe == index.end()) table.Fail(i, 0, "the id of a keyframe in keyframes.csv");
    LineObservation seen;
    seen.id = table.Integer(i, 1);
    seen.left_px = {Pixel(table, i, 2), Pixel(table, i, 4)};
    if (table.OptionalNumber(i, 6)) seen.right_px = {Pixel(table, i, 6), Pixel(table, i, 8)};
    (*keyframes)[keyframe->second].lines.push_back(seen);
  }
}

}  // namespace

void WriteLineFiles(const std::string& folder, const OdometryRun& run) {
  const LinePaths paths(folder);
  WriteLines(paths, run.lines);
  WriteObservations(paths.observations, run.keyframes);
  WriteMapLines(paths.ply, MapLines(run));
}

void ReadLineFiles(const std::string& folder, OdometryRun* run) {
  const LinePaths paths(folder);
  const IndexById index = ReadLines(paths.lines, run);
  ReadPoints(paths.points, index, &run->lines);
  ReadObservations(paths.observations, &run->keyframes);
}

}  // namespace slcmap
