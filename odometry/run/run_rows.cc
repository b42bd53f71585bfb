#include "odometry/run/run_rows.h"

#include <spdlog/fmt/fmt.h>

#include <array>
#include <cmath>
#include <set>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "data/core/types.h"

namespace slcmap::inline odometry {
namespace {

constexpr CsvColumn Id(const char* name) { return {name, CsvColumn::Kind::kInteger, 0, kMaxId}; }
constexpr CsvColumn Stamp(const char* name) {
  return IntegerColumn(name, -kMaxStamp_ns, kMaxStamp_ns);
}
constexpr CsvColumn Segment() { return IntegerColumn("segment", 0, kMaxSegment); }
constexpr CsvColumn Number(const char* name, double limit) {
  return {name, CsvColumn::Kind::kNumber, -limit, limit};
}
constexpr CsvColumn Pixel(const char* name) {  // nan where that camera did not see it
  return {name, CsvColumn::Kind::kOptionalNumber, -kMaxPixel, kMaxPixel};
}
constexpr CsvColumn Sigma(const char* name, double most) {
  return {name, CsvColumn::Kind::kNumber, 0, most};
}

CsvColumns operator+(CsvColumns columns, const CsvColumns& more) {
  columns.insert(columns.end(), more.begin(), more.end());
  return columns;
}

CsvColumns Numbers(std::initializer_list<const char*> names, double limit) {
  CsvColumns columns;
  for (const char* name : names) columns.push_back(Number(name, limit));
  return columns;
}

CsvColumns Sigmas(std::initializer_list<const char*> names, double most) {
  CsvColumns columns;
  for (const char* name : names) columns.push_back(Sigma(name, most));
  return columns;
}

CsvColumns Pose() {
  return Numbers({"x_m", "y_m", "z_m"}, kMaxCoordinate_m) + Numbers({"qx", "qy", "qz", "qw"}, 1.01);
}

std::map<std::string, CsvColumns> MakeColumns() {
  return {
      {kStateTable, CsvColumns{Stamp("stamp_ns"), Segment()} + Pose() +
                        Numbers({"vx_m_s", "vy_m_s", "vz_m_s"}, kMaxSpeed_m_s) +
                        Numbers({"gyro_bias_x_rad_s", "gyro_bias_y_rad_s", "gyro_bias_z_rad_s",
                                 "accel_bias_x_m_s2", "accel_bias_y_m_s2", "accel_bias_z_m_s2"},
                                kMaxBias)},
      {kKeyframeTable, CsvColumns{Id("id"), Segment(), Stamp("stamp_ns")} + Pose()},
      {kObservationTable,
       {Id("keyframe_id"), Id("landmark_id"), Pixel("left_x_px"), Pixel("left_y_px"),
        Pixel("right_x_px"), Pixel("right_y_px")}},
      {kLandmarkTable, CsvColumns{Id("id"), Segment(), Id("observations")} +
                           Numbers({"x_m", "y_m", "z_m"}, kMaxCoordinate_m) +
                           CsvColumns{Sigma("sigma_m", kMaxSigma_m)}},
      {kWorldTable,
       {Id("index"), Segment(), Number("heading_rad", kMaxHeading_rad),
        Sigma("sigma_rad", kMaxHeading_rad), Stamp("found_at_ns"),
        IntegerColumn("withdrawn", 0, 1)}},
      {kSlopeTable, CsvColumns{Id("index"), Segment(), Number("azimuth_rad", kMaxHeading_rad),
                               Sigma("elevation_rad", kMaxElevation_rad)} +
                        Sigmas({"azimuth_sigma_rad", "elevation_sigma_rad"}, kMaxHeading_rad) +
                        CsvColumns{Stamp("found_at_ns"), IntegerColumn("withdrawn", 0, 1)}},
      {kLineTable,
       CsvColumns{Id("id"), Segment(), IntegerColumn("axis", 0, 4),
                  IntegerColumn("world", -1, kMaxId)} +
           Numbers({"start_x_m", "start_y_m", "start_z_m", "end_x_m", "end_y_m", "end_z_m"},
                   kMaxCoordinate_m) +
           Numbers({"cov_xx_m2", "cov_xy_m2", "cov_xz_m2", "cov_yy_m2", "cov_yz_m2", "cov_zz_m2"},
                   kMaxVariance_m2) +
           CsvColumns{Id("observations"), Id("last_keyframe_id"),
                      Sigma("deviation_rad", kMaxHeading_rad),
                      Sigma("deviation_sigma_rad", kUnknownSigma_rad)}},
      {kLineObservationTable,
       {Id("keyframe_id"), Id("line_id"), Pixel("left_start_x_px"), Pixel("left_start_y_px"),
        Pixel("left_end_x_px"), Pixel("left_end_y_px"), Pixel("right_start_x_px"),
        Pixel("right_start_y_px"), Pixel("right_end_x_px"), Pixel("right_end_y_px")}},
      {kLinePointTable, {Id("line_id"), Id("landmark_id")}},
      {kLineMergeTable, {Id("line_id"), Id("merged_into_id")}},
      {kImuTable, CsvColumns{Stamp("stamp_ns")} +
                      Numbers({"wx_rad_s", "wy_rad_s", "wz_rad_s"}, kMaxGyro_rad_s) +
                      Numbers({"ax_m_s2", "ay_m_s2", "az_m_s2"}, kMaxAccel_m_s2)},
      {kCalibrationTable,
       CsvColumns{Stamp("stamp_ns"), Segment()} +
           CsvColumns{Number("time_offset_s", kMaxTimeCorrection_s)} +
           Numbers({"imu_rotation_x_rad", "imu_rotation_y_rad", "imu_rotation_z_rad"},
                   kMaxTurn_rad) +
           Numbers({"lever_x_m", "lever_y_m", "lever_z_m"}, kMaxLever_m) +
           Numbers({"right_rotation_x_rad", "right_rotation_y_rad", "right_rotation_z_rad"},
                   kMaxTurn_rad) +
           CsvColumns{Number("focal_length", kMaxFocalShare)} +
           Numbers({"right_centre_x_px", "right_centre_y_px"}, kMaxCentre_px) +
           Numbers(
               {"accel_scale_x", "accel_scale_y", "accel_scale_z", "accel_axes_yx", "accel_axes_zx",
                "accel_axes_zy", "gyro_scale_x", "gyro_scale_y", "gyro_scale_z", "gyro_axes_xy",
                "gyro_axes_xz", "gyro_axes_yx", "gyro_axes_yz", "gyro_axes_zx", "gyro_axes_zy"},
               kMaxImuError) +
           Sigmas({"time_offset_sigma_s", "imu_rotation_x_sigma_rad", "imu_rotation_y_sigma_rad",
                   "imu_rotation_z_sigma_rad", "lever_x_sigma_m", "lever_y_sigma_m",
                   "lever_z_sigma_m", "right_rotation_x_sigma_rad", "right_rotation_y_sigma_rad",
                   "right_rotation_z_sigma_rad", "focal_length_sigma"},
                  kMaxCorrectionSigma) +
           Sigmas({"right_centre_x_sigma_px", "right_centre_y_sigma_px"}, kMaxCentre_px) +
           Sigmas({"accel_scale_x_sigma", "accel_scale_y_sigma", "accel_scale_z_sigma",
                   "accel_axes_yx_sigma", "accel_axes_zx_sigma", "accel_axes_zy_sigma",
                   "gyro_scale_x_sigma", "gyro_scale_y_sigma", "gyro_scale_z_sigma",
                   "gyro_axes_xy_sigma", "gyro_axes_xz_sigma", "gyro_axes_yx_sigma",
                   "gyro_axes_yz_sigma", "gyro_axes_zx_sigma", "gyro_axes_zy_sigma"},
                  kMaxCorrectionSigma)}};
}

// The upper triangle of a symmetric matrix, in the order of the columns.
constexpr std::array<std::pair<int, int>, 6> kUpperTriangle = {
    {{0, 0}, {0, 1}, {0, 2}, {1, 1}, {1, 2}, {2, 2}}};

std::string Cells(const Eigen::Vector3d& v) { return fmt::format("{},{},{}", v.x(), v.y(), v.z()); }

std::string Cells(const Eigen::Vector2d& v) { return fmt::format("{:.4f},{:.4f}", v.x(), v.y()); }

std::string Cells(const ImuErrors& e) {
  return fmt::format("{}", fmt::join(e.begin(), e.end(), ","));
}

std::string Cells(const LineSegment& s) { return Cells(s.start) + "," + Cells(s.end); }

// Of what the left (or first) image shows and what the other one does, where each does.
template <typename Observation>
std::string CellsOfBoth(const Observation& seen, const std::string& none) {
  if (seen.camera == 1) return none + "," + Cells(seen.left_px);
  return Cells(seen.left_px) + "," + (seen.right_px ? Cells(*seen.right_px) : none);
}

std::string Cells(const RigidTransform& pose) {
  const Eigen::Quaterniond& q = pose.rotation;
  return fmt::format("{},{},{},{},{}", Cells(pose.translation), q.x(), q.y(), q.z(), q.w());
}

Eigen::Vector2d PixelAt(const CsvTable& table, std::size_t row, std::size_t column) {
  return {table.Number(row, column), table.Number(row, column + 1)};
}

Eigen::Vector3d VectorAt(const CsvTable& table, std::size_t row, std::size_t column) {
  return {table.Number(row, column), table.Number(row, column + 1), table.Number(row, column + 2)};
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
// other one; 1 where the second camera alone saw it.
int CameraOfRow(const CsvTable& table, std::size_t row, std::size_t first, std::size_t count) {
  const bool has_right = Has(table, row, first + count, first + 2 * count - 1);
  std::size_t missing = 0;
  for (std::size_t i = first; i < first + count; ++i) missing += !table.OptionalNumber(row, i);
  if (missing == count && has_right) return 1;
  for (std::size_t i = first; missing > 0 && i < first + count; ++i) {
    if (!table.OptionalNumber(row, i)) table.Fail(row, i, "a finite number");
  }
  return 0;
}

RigidTransform PoseAt(const CsvTable& table, std::size_t row, std::size_t column) {
  RigidTransform pose;
  pose.translation = VectorAt(table, row, column);
  pose.rotation.coeffs() << VectorAt(table, row, column + 3), table.Number(row, column + 6);
  if (std::abs(pose.rotation.norm() - 1) > 1e-3) {
    table.Fail(row, column + 6, "a quaternion of length 1");
  }
  pose.rotation.normalize();
  return pose;
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

// Stamps that must rise.
class Rising {
 public:
  int64_t Next(const CsvTable& table, std::size_t row, std::size_t column) {
    const int64_t stamp_ns = table.Integer(row, column);
    if (last_ns_ && stamp_ns <= *last_ns_) {
      table.Fail(row, column, fmt::format("a stamp after {}, that of the row before", *last_ns_));
    }
    last_ns_ = stamp_ns;
    return stamp_ns;
  }

 private:
  std::optional<int64_t> last_ns_;
};

// Of a pair of ids, as of an observation.
int64_t PairKey(int64_t a, int64_t b) { return a << 32 | b; }

}  // namespace

const std::map<std::string, CsvColumns>& RunColumns() {
  static const std::map<std::string, CsvColumns> columns = MakeColumns();
  return columns;
}

std::string Row(const OnlineState& state) {
  return fmt::format("{},{},{},{},{},{}\n", state.stamp_ns, state.segment, Cells(state.T_world_imu),
                     Cells(state.velocity_world_m_s), Cells(state.gyro_bias_rad_s),
                     Cells(state.accel_bias_m_s2));
}

std::string Row(const Keyframe& keyframe) {
  return fmt::format("{},{},{},{}\n", keyframe.id, keyframe.segment, keyframe.stamp_ns,
                     Cells(keyframe.T_world_imu));
}

std::string Row(int64_t keyframe_id, const KeyframeObservation& seen) {
  return fmt::format("{},{},{}\n", keyframe_id, seen.landmark_id, CellsOfBoth(seen, "nan,nan"));
}

std::string Row(int64_t keyframe_id, const LineObservation& seen) {
  return fmt::format("{},{},{}\n", keyframe_id, seen.id, CellsOfBoth(seen, "nan,nan,nan,nan"));
}

std::string Row(const Landmark& landmark) {
  return fmt::format("{},{},{},{},{}\n", landmark.id, landmark.segment, landmark.observations,
                     Cells(landmark.p_world), landmark.sigma_m);
}

std::string Row(int64_t index, const ManhattanWorld& world) {
  return fmt::format("{},{},{},{},{},{}\n", index, world.segment, world.heading_rad,
                     world.sigma_rad, world.found_at_ns, world.withdrawn ? 1 : 0);
}

std::string Row(int64_t index, const SlopedDirection& slope) {
  return fmt::format("{},{},{},{},{},{},{},{}\n", index, slope.segment, slope.azimuth_rad,
                     slope.elevation_rad, slope.azimuth_sigma_rad, slope.elevation_sigma_rad,
                     slope.found_at_ns, slope.withdrawn ? 1 : 0);
}

std::string Row(const Line& line) {
  std::string row =
      fmt::format("{},{},{},{},{},{}", line.id, line.segment, static_cast<int>(line.axis),
                  line.world, Cells(line.start_world), Cells(line.end_world));
  for (const auto& [r, c] : kUpperTriangle) row += fmt::format(",{}", line.covariance_m2(r, c));
  return row + fmt::format(",{},{},{},{}\n", line.observations, line.last_keyframe,
                           line.deviation_rad, line.deviation_sigma_rad);
}

std::string Row(int64_t line_id, int64_t id) { return fmt::format("{},{}\n", line_id, id); }

std::string Row(const ImuSample& sample) {
  return fmt::format("{},{},{}\n", sample.stamp_ns, Cells(sample.angular_velocity_rad_s),
                     Cells(sample.specific_force_m_s2));
}

std::string Row(const CalibrationEstimate& e) {
  return fmt::format(
      "{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n", e.stamp_ns, e.segment, e.time_offset_s,
      Cells(e.imu_rotation_rad), Cells(e.lever_m), Cells(e.right_rotation_rad), e.focal_length,
      Cells(e.right_centre_px), Cells(e.imu_errors), e.time_offset_sigma_s,
      Cells(e.imu_rotation_sigma_rad), Cells(e.lever_sigma_m), Cells(e.right_rotation_sigma_rad),
      e.focal_length_sigma, Cells(e.right_centre_sigma_px), Cells(e.imu_errors_sigma));
}

std::set<int> CollectSegments(const OdometryRun& run) {
  std::set<int> segments;
  for (const OnlineState& state : run.states) segments.insert(state.segment);
  for (const Keyframe& keyframe : run.keyframes) segments.insert(keyframe.segment);
  return segments;
}

void ReadStates(const CsvTable& table, OdometryRun* run) {
  Rising stamps;
  for (std::size_t i = 0; i < table.rows(); ++i) {
    OnlineState& state = run->states.emplace_back();
    state.stamp_ns = stamps.Next(table, i, 0);
    state.segment = table.Int(i, 1);
    state.T_world_imu = PoseAt(table, i, 2);
    state.velocity_world_m_s = VectorAt(table, i, 9);
    state.gyro_bias_rad_s = VectorAt(table, i, 12);
    state.accel_bias_m_s2 = VectorAt(table, i, 15);
  }
}

void ReadKeyframes(const CsvTable& table, OdometryRun* run) {
  OnceOnly ids;
  Rising stamps;
  for (std::size_t i = 0; i < table.rows(); ++i) {
    Keyframe& keyframe = run->keyframes.emplace_back();
    keyframe.id = table.Integer(i, 0);
    ids.Add(keyframe.id, table, i, 0);
    keyframe.segment = table.Int(i, 1);
    keyframe.stamp_ns = stamps.Next(table, i, 2);
    keyframe.T_world_imu = PoseAt(table, i, 3);
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
    seen.left_px = PixelAt(table, i, seen.camera == 0 ? 2 : 4);
    if (seen.camera == 0 && Has(table, i, 4, 5)) seen.right_px = PixelAt(table, i, 4);
    keyframe.observations.push_back(seen);
  }
}

void ReadLandmarks(const CsvTable& table, OdometryRun* run) {
  OnceOnly ids;
  for (std::size_t i = 0; i < table.rows(); ++i) {
    Landmark& landmark = run->landmarks.emplace_back();
    landmark.id = table.Integer(i, 0);
    ids.Add(landmark.id, table, i, 0);
    landmark.segment = table.Int(i, 1);
    landmark.observations = table.Int(i, 2);
    landmark.p_world = VectorAt(table, i, 3);
    landmark.sigma_m = table.Number(i, 6);
  }
}

// The one of a row, which may be told again, or be new.
template <typename Item>
Item& ItemOfRow(const CsvTable& table, std::size_t row, std::vector<Item>* items) {
  const auto index = static_cast<std::size_t>(table.Integer(row, 0));
  if (index > items->size()) table.Fail(row, 0, fmt::format("at most {}", items->size()));
  if (index == items->size()) items->emplace_back();
  return (*items)[index];
}

void ReadWorlds(const CsvTable& table, OdometryRun* run) {
  for (std::size_t i = 0; i < table.rows(); ++i) {
    ItemOfRow(table, i, &run->manhattan_worlds) = {table.Int(i, 1), table.Number(i, 2),
                                                   table.Number(i, 3), table.Integer(i, 4),
                                                   table.Integer(i, 5) != 0};
  }
}

void ReadSlopes(const CsvTable& table, OdometryRun* run) {
  for (std::size_t i = 0; i < table.rows(); ++i) {
    ItemOfRow(table, i, &run->sloped_directions) = {
        table.Int(i, 1),    table.Number(i, 2),  table.Number(i, 3),      table.Number(i, 4),
        table.Number(i, 5), table.Integer(i, 6), table.Integer(i, 7) != 0};
  }
}

void ReadLines(const CsvTable& table, OdometryRun* run) {
  OnceOnly ids;
  const auto worlds = static_cast<int>(run->manhattan_worlds.size());
  const auto slopes = static_cast<int>(run->sloped_directions.size());
  for (std::size_t i = 0; i < table.rows(); ++i) {
    Line& line = run->lines.emplace_back();
    line.id = table.Integer(i, 0);
    ids.Add(line.id, table, i, 0);
    line.segment = table.Int(i, 1);
    line.axis = static_cast<LineAxis>(table.Int(i, 2));
    line.world = table.Int(i, 3);
    const bool sloped = line.axis == LineAxis::kSloped;
    if (line.world >= (sloped ? slopes : worlds) || (sloped && line.world < 0)) {
      table.Fail(i, 3,
                 sloped ? "the index of a sloped direction in run.json"
                        : "-1 or the index of a Manhattan world in run.json");
    }
    if (sloped && run->sloped_directions[line.world].segment != line.segment) {
      table.Fail(i, 3, "a sloped direction of the line's segment");
    }
    line.start_world = VectorAt(table, i, 4);
    line.end_world = VectorAt(table, i, 7);
    for (std::size_t k = 0; k < kUpperTriangle.size(); ++k) {
      const auto& [r, c] = kUpperTriangle[k];
      line.covariance_m2(r, c) = line.covariance_m2(c, r) = table.Number(i, 10 + k);
    }
    line.observations = table.Int(i, 16);
    line.last_keyframe = table.Integer(i, 17);
    line.deviation_rad = table.Number(i, 18);
    line.deviation_sigma_rad = table.Number(i, 19);
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
    seen.left_px = segment_at(seen.camera == 0 ? 2 : 6);
    if (seen.camera == 0 && Has(table, i, 6, 9)) seen.right_px = segment_at(6);
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
  Rising stamps;
  for (std::size_t i = 0; i < table.rows(); ++i) {
    run->imu.push_back({stamps.Next(table, i, 0), VectorAt(table, i, 1), VectorAt(table, i, 4)});
  }
}

void ReadCalibration(const CsvTable& table, OdometryRun* run) {
  Rising stamps;
  const std::set<int> segments = CollectSegments(*run);
  for (std::size_t i = 0; i < table.rows(); ++i) {
    CalibrationEstimate& estimate = run->calibration.emplace_back();
    estimate.stamp_ns = stamps.Next(table, i, 0);
    estimate.segment = table.Int(i, 1);
    if (!segments.contains(estimate.segment)) {
      table.Fail(i, 1, "a segment that a state or a keyframe is of");
    }
    estimate.time_offset_s = table.Number(i, 2);
    estimate.imu_rotation_rad = VectorAt(table, i, 3);
    estimate.lever_m = VectorAt(table, i, 6);
    estimate.right_rotation_rad = VectorAt(table, i, 9);
    estimate.focal_length = table.Number(i, 12);
    estimate.right_centre_px = {table.Number(i, 13), table.Number(i, 14)};
    estimate.time_offset_sigma_s = table.Number(i, 30);
    estimate.imu_rotation_sigma_rad = VectorAt(table, i, 31);
    estimate.lever_sigma_m = VectorAt(table, i, 34);
    estimate.right_rotation_sigma_rad = VectorAt(table, i, 37);
    estimate.focal_length_sigma = table.Number(i, 40);
    estimate.right_centre_sigma_px = {table.Number(i, 41), table.Number(i, 42)};
    for (int k = 0; k < kImuErrorsSize; ++k) {
      estimate.imu_errors[k] = table.Number(i, 15 + k);
      estimate.imu_errors_sigma[k] = table.Number(i, 43 + k);
    }
  }
}

}  // namespace slcmap::odometry
