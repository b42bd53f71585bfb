#include "odometry/run/run_rows.h"

#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <initializer_list>
#include <set>
#include <string>
#include <type_traits>
#include <unordered_map>
#include <unordered_set>
#include <utility>

namespace slcmap::inline odometry {
namespace {

constexpr CsvColumn Id(const char* name) { return {name, CsvColumn::Kind::kInteger, 0, kMaxId}; }
constexpr CsvColumn Pixel(const char* name) {  // nan where that camera did not see it
  return {name, CsvColumn::Kind::kOptionalNumber, -kMaxPixel, kMaxPixel};
}

struct ColumnMaker {
  CsvColumns columns;

  template <typename T>
  void operator()(std::initializer_list<const char*> names, const T&, double least, double most) {
    constexpr auto kKind =
        std::is_integral_v<T> ? CsvColumn::Kind::kInteger : CsvColumn::Kind::kNumber;
    for (const char* name : names) columns.push_back({name, kKind, least, most});
  }
};

// Those of the fields of an item, behind others.
template <typename Item>
CsvColumns ColumnsFor(CsvColumns first = {}) {
  ColumnMaker maker{std::move(first)};
  const Item item;
  VisitFields(maker, item);
  return maker.columns;
}

std::map<std::string, CsvColumns> MakeColumns(bool names_cameras) {
  std::map<std::string, CsvColumns> columns = {
      {kStateTable, ColumnsFor<OnlineState>()},
      {kKeyframeTable, ColumnsFor<Keyframe>()},
      {kObservationTable,
       {Id("keyframe_id"), Id("landmark_id"), Pixel("left_x_px"), Pixel("left_y_px"),
        Pixel("right_x_px"), Pixel("right_y_px")}},
      {kLandmarkTable, ColumnsFor<Landmark>()},
      {kWorldTable, ColumnsFor<ManhattanWorld>({Id("index")})},
      {kSlopeTable, ColumnsFor<SlopedDirection>({Id("index")})},
      {kLineTable, ColumnsFor<Line>()},
      {kLineObservationTable,
       {Id("keyframe_id"), Id("line_id"), Pixel("left_start_x_px"), Pixel("left_start_y_px"),
        Pixel("left_end_x_px"), Pixel("left_end_y_px"), Pixel("right_start_x_px"),
        Pixel("right_start_y_px"), Pixel("right_end_x_px"), Pixel("right_end_y_px")}},
      {kLinePointTable, {Id("line_id"), Id("landmark_id")}},
      {kLineMergeTable, {Id("line_id"), Id("merged_into_id")}},
      {kImuTable, ColumnsFor<ImuSample>()},
      {kCalibrationTable, ColumnsFor<CalibrationEstimate>()}};
  if (names_cameras) {
    for (const char* table : {kObservationTable, kLineObservationTable}) {
      columns.at(table).push_back(Id("camera"));
    }
  }
  return columns;
}

std::string Cells(const Eigen::Vector2d& v) { return fmt::format("{:.4f},{:.4f}", v.x(), v.y()); }

std::string Cells(const LineSegment& s) { return Cells(s.start) + "," + Cells(s.end); }

// Of what the left (or first) image shows and what the other one does, where each does.
template <typename Observation>
std::string CellsOfBoth(const Observation& seen, const std::string& none, bool names_camera) {
  if (seen.camera == 1 && !names_camera) return none + "," + Cells(seen.left_px);
  return Cells(seen.left_px) + "," + (seen.right_px ? Cells(*seen.right_px) : none) +
         (names_camera ? fmt::format(",{}", seen.camera) : "");
}

struct RowMaker {
  std::string row;

  template <typename T>
  void operator()(std::initializer_list<const char*>, const T& value, double, double) {
    if (!row.empty()) row += ',';
    if constexpr (std::is_same_v<T, bool>) {
      row += value ? '1' : '0';
    } else if constexpr (std::is_arithmetic_v<T>) {
      row += fmt::format("{}", value);
    } else if constexpr (std::is_same_v<T, Eigen::Vector2d>) {
      row += Cells(value);
    } else {
      row += fmt::format("{}", fmt::join(value.begin(), value.end(), ","));
    }
  }
};

template <typename Item>
std::string FormatFields(const Item& item, std::string first = "") {
  RowMaker maker{std::move(first)};
  VisitFields(maker, item);
  return maker.row + "\n";
}

Eigen::Vector2d PixelAt(const CsvTable& table, std::size_t row, std::size_t column) {
  return {table.Number(row, column), table.Number(row, column + 1)};
}

// Of which all cells are numbers, or none.
bool Has(const CsvTable& table, std::size_t row, std::size_t first, std::size_t last) {
  const bool has = table.OptionalNumber(row, first).has_value();
  for (std::size_t i = first + 1; i <= last; ++i) {
    if (table.OptionalNumber(row, i).has_value() == has) continue;
    table.Fail(row, i, "nan in all of the right image's columns or in none");
  }
  return has;
}

// Whose the pixels of a row are: `count` cells of the left or first image, then as many of the
// other one; 1 where the second camera alone saw it. Of more than two cameras a row says it.
int CameraOfRow(const CsvTable& table, std::size_t row, std::size_t first, std::size_t count) {
  if (table.columns() > first + 2 * count) return table.Int(row, first + 2 * count);
  const bool has_right = Has(table, row, first + count, first + 2 * count - 1);
  std::size_t missing = 0;
  for (std::size_t i = first; i < first + count; ++i) missing += !table.OptionalNumber(row, i);
  if (missing == count && has_right) return 1;
  for (std::size_t i = first; missing > 0 && i < first + count; ++i) {
    if (!table.OptionalNumber(row, i)) table.Fail(row, i, "a finite number");
  }
  return 0;
}

struct RowReader {
  const CsvTable& table;
  std::size_t row = 0, column = 0;

  template <typename T>
  void operator()(std::initializer_list<const char*>, T& value, double, double) {
    if constexpr (std::is_same_v<T, bool>) {
      value = table.Integer(row, column++) != 0;
    } else if constexpr (std::is_same_v<T, int>) {
      value = table.Int(row, column++);
    } else if constexpr (std::is_integral_v<T>) {
      value = table.Integer(row, column++);
    } else if constexpr (std::is_same_v<T, double>) {
      value = table.Number(row, column++);
    } else {
      for (double& number : value) number = table.Number(row, column++);
    }
    if constexpr (std::is_same_v<T, Eigen::Vector4d>) {
      if (std::abs(value.norm() - 1) > 1e-3) {
        table.Fail(row, column - 1, "a quaternion of length 1");
      }
      value.normalize();
    }
  }
};

template <typename Item>
Item ItemAt(const CsvTable& table, std::size_t row, std::size_t first_column = 0) {
  RowReader reader{table, row, first_column};
  Item item;
  VisitFields(reader, item);
  return item;
}

// Items by their ids, and what refers to them.
template <typename Item>
class Index {
 public:
  Index(std::vector<Item>* items, const char* expected) : items_(*items), expected_(expected) {
    for (std::size_t i = 0; i < items_.size(); ++i) by_id_[items_[i].id] = i;
  }
  Item& At(const CsvTable& table, std::size_t row, std::size_t column) const {
    const auto found = by_id_.find(table.Integer(row, column));
    if (found == by_id_.end()) table.Fail(row, column, expected_);
    return items_[found->second];
  }

 private:
  std::vector<Item>& items_;
  const char* expected_;
  std::unordered_map<int64_t, std::size_t> by_id_;
};

// Ids that must not come twice.
class OnceOnly {
 public:
  void Add(int64_t id, const CsvTable& table, std::size_t row, std::size_t column) {
    if (!seen_.insert(id).second) table.Fail(row, column, "an id that no row before it has");
  }

 private:
  std::unordered_set<int64_t> seen_;
};

// Fails where the stamp of a row is not after that of the row before.
void RequireRising(const CsvTable& table, std::size_t row, std::size_t column) {
  if (row == 0) return;
  const int64_t last_ns = table.Integer(row - 1, column);
  if (table.Integer(row, column) > last_ns) return;
  table.Fail(row, column, fmt::format("a stamp after {}, that of the row before", last_ns));
}

// Of a pair of ids, as of an observation.
int64_t PairKey(int64_t a, int64_t b) { return a << 32 | b; }

}  // namespace

const std::map<std::string, CsvColumns>& RunColumns(bool names_cameras) {
  static const std::map<std::string, CsvColumns> of_two = MakeColumns(false);
  static const std::map<std::string, CsvColumns> of_more = MakeColumns(true);
  return names_cameras ? of_more : of_two;
}

std::string Row(const OnlineState& state) { return FormatFields(state); }
std::string Row(const Keyframe& keyframe) { return FormatFields(keyframe); }
std::string Row(const Landmark& landmark) { return FormatFields(landmark); }
std::string Row(const Line& line) { return FormatFields(line); }
std::string Row(const ImuSample& sample) { return FormatFields(sample); }
std::string Row(const CalibrationEstimate& estimate) { return FormatFields(estimate); }

std::string Row(int64_t index, const ManhattanWorld& world) {
  return FormatFields(world, std::to_string(index));
}

std::string Row(int64_t index, const SlopedDirection& slope) {
  return FormatFields(slope, std::to_string(index));
}

std::string Row(int64_t keyframe_id, const KeyframeObservation& seen, bool names_camera) {
  return fmt::format("{},{},{}\n", keyframe_id, seen.landmark_id,
                     CellsOfBoth(seen, "nan,nan", names_camera));
}

std::string Row(int64_t keyframe_id, const LineObservation& seen, bool names_camera) {
  return fmt::format("{},{},{}\n", keyframe_id, seen.id,
                     CellsOfBoth(seen, "nan,nan,nan,nan", names_camera));
}

std::string Row(int64_t line_id, int64_t id) { return fmt::format("{},{}\n", line_id, id); }

std::set<int> CollectSegments(const OdometryRun& run) {
  std::set<int> segments;
  for (const OnlineState& state : run.states) segments.insert(state.segment);
  for (const Keyframe& keyframe : run.keyframes) segments.insert(keyframe.segment);
  return segments;
}

void ReadStates(const CsvTable& table, OdometryRun* run) {
  for (std::size_t i = 0; i < table.rows(); ++i) {
    RequireRising(table, i, 0);
    run->states.push_back(ItemAt<OnlineState>(table, i));
  }
}

void ReadKeyframes(const CsvTable& table, OdometryRun* run) {
  OnceOnly ids;
  for (std::size_t i = 0; i < table.rows(); ++i) {
    ids.Add(table.Integer(i, 0), table, i, 0);
    RequireRising(table, i, 2);
    run->keyframes.push_back(ItemAt<Keyframe>(table, i));
  }
}

void ReadObservations(const CsvTable& table, OdometryRun* run) {
  const Index keyframes(&run->keyframes, "the id of a keyframe in keyframes.csv");
  OnceOnly pairs;
  for (std::size_t i = 0; i < table.rows(); ++i) {
    Keyframe& keyframe = keyframes.At(table, i, 0);
    KeyframeObservation seen;
    seen.landmark_id = table.Integer(i, 1);
    pairs.Add(PairKey(keyframe.id, seen.landmark_id), table, i, 1);
    seen.camera = CameraOfRow(table, i, 2, 2);
    const bool in_right_cells = seen.camera == 1 && !NamesCameras(*run);
    seen.left_px = PixelAt(table, i, in_right_cells ? 4 : 2);
    if (!in_right_cells && Has(table, i, 4, 5)) seen.right_px = PixelAt(table, i, 4);
    keyframe.observations.push_back(seen);
  }
}

void ReadLandmarks(const CsvTable& table, OdometryRun* run) {
  OnceOnly ids;
  for (std::size_t i = 0; i < table.rows(); ++i) {
    ids.Add(table.Integer(i, 0), table, i, 0);
    run->landmarks.push_back(ItemAt<Landmark>(table, i));
  }
}

// Of worlds and slopes: a row tells one again, or a new one.
template <typename Item>
void ReadDirections(const CsvTable& table, std::vector<Item>* items) {
  for (std::size_t i = 0; i < table.rows(); ++i) {
    const auto index = static_cast<std::size_t>(table.Integer(i, 0));
    if (index > items->size()) table.Fail(i, 0, fmt::format("at most {}", items->size()));
    if (index == items->size()) items->emplace_back();
    (*items)[index] = ItemAt<Item>(table, i, 1);
  }
}

void ReadWorlds(const CsvTable& table, OdometryRun* run) {
  ReadDirections(table, &run->manhattan_worlds);
}

void ReadSlopes(const CsvTable& table, OdometryRun* run) {
  ReadDirections(table, &run->sloped_directions);
}

void ReadLines(const CsvTable& table, OdometryRun* run) {
  OnceOnly ids;
  const auto worlds = static_cast<int>(run->manhattan_worlds.size());
  const auto slopes = static_cast<int>(run->sloped_directions.size());
  for (std::size_t i = 0; i < table.rows(); ++i) {
    const Line& line = run->lines.emplace_back(ItemAt<Line>(table, i));
    ids.Add(line.id, table, i, 0);
    const bool sloped = line.axis == LineAxis::kSloped;
    if (line.world >= (sloped ? slopes : worlds) || (sloped && line.world < 0)) {
      table.Fail(i, 3,
                 sloped ? "the index of a sloped direction in run.json"
                        : "-1 or the index of a Manhattan world in run.json");
    }
    if (sloped && run->sloped_directions[line.world].segment != line.segment) {
      table.Fail(i, 3, "a sloped direction of the line's segment");
    }
  }
}

void ReadLineObservations(const CsvTable& table, OdometryRun* run) {
  const Index keyframes(&run->keyframes, "the id of a keyframe in keyframes.csv");
  OnceOnly pairs;
  for (std::size_t i = 0; i < table.rows(); ++i) {
    Keyframe& keyframe = keyframes.At(table, i, 0);
    LineObservation seen;
    seen.id = table.Integer(i, 1);
    pairs.Add(PairKey(keyframe.id, seen.id), table, i, 1);
    seen.camera = CameraOfRow(table, i, 2, 4);
    const auto segment_at = [&](std::size_t column) -> LineSegment {
      return {PixelAt(table, i, column), PixelAt(table, i, column + 2)};
    };
    const bool in_right_cells = seen.camera == 1 && !NamesCameras(*run);
    seen.left_px = segment_at(in_right_cells ? 6 : 2);
    if (!in_right_cells && Has(table, i, 6, 9)) seen.right_px = segment_at(6);
    keyframe.lines.push_back(seen);
  }
}

void ReadLinePoints(const CsvTable& table, OdometryRun* run) {
  const Index lines(&run->lines, "the id of a line in lines.csv");
  OnceOnly pairs;
  for (std::size_t i = 0; i < table.rows(); ++i) {
    Line& line = lines.At(table, i, 0);
    pairs.Add(PairKey(line.id, table.Integer(i, 1)), table, i, 1);
    line.point_ids.push_back(table.Integer(i, 1));
  }
}

void ReadLineMerges(const CsvTable& table, OdometryRun* run) {
  for (std::size_t i = 0; i < table.rows(); ++i) {
    // As odometry merges them, which keeps chains from going round.
    if (table.Integer(i, 1) >= table.Integer(i, 0)) table.Fail(i, 1, "the id of an older line");
    run->line_merges[table.Integer(i, 0)] = table.Integer(i, 1);
  }
}

void ReadImu(const CsvTable& table, OdometryRun* run) {
  for (std::size_t i = 0; i < table.rows(); ++i) {
    RequireRising(table, i, 0);
    run->imu.push_back(ItemAt<ImuSample>(table, i));
  }
}

void ReadCalibration(const CsvTable& table, OdometryRun* run) {
  const std::set<int> segments = CollectSegments(*run);
  for (std::size_t i = 0; i < table.rows(); ++i) {
    RequireRising(table, i, 0);
    run->calibration.push_back(ItemAt<CalibrationEstimate>(table, i));
    if (!segments.contains(run->calibration.back().segment)) {
      table.Fail(i, 1, "a segment that a state or a keyframe is of");
    }
  }
}

}  // namespace slcmap::odometry
