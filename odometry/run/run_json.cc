#include "odometry/run/run_json.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <optional>

#include "data/calibration/calibration.h"
#include "data/calibration/camera_words.h"
#include "data/calibration/imu_calibration.h"
#include "data/calibration/mask.h"
#include "data/core/error.h"
#include "data/io/json.h"
#include "data/source/sequence_options_json.h"
#include "odometry/run/run.h"
#include "odometry/run/run_queries.h"
#include "odometry/run/run_rows.h"

namespace slcmap::inline odometry {
namespace {

constexpr int kRunVersion = 6;
constexpr double kMaxTimeOffset_s = 10;

Json SegmentsJson(const OdometryRun& run) {
  std::map<int, std::vector<const OnlineState*>> segments;
  for (const OnlineState& state : run.states) segments[state.segment].push_back(&state);
  Json json = Json::array();
  for (const auto& [segment, states] : segments) {
    const auto in_segment = [segment = segment](const auto& item) {
      return item.segment == segment;
    };
    json.push_back(
        {{"segment", segment},
         {"first_stamp_ns", states.front()->stamp_ns},
         {"last_stamp_ns", states.back()->stamp_ns},
         {"poses", states.size()},
         {"keyframes", std::count_if(run.keyframes.begin(), run.keyframes.end(), in_segment)},
         {"landmarks", std::count_if(run.landmarks.begin(), run.landmarks.end(), in_segment)},
         {"lines", std::count_if(run.lines.begin(), run.lines.end(), in_segment)}});
  }
  return json;
}

struct DirectionMaker {
  Json json = Json::object();

  template <typename T>
  void operator()(std::initializer_list<const char*> names, const T& value, double, double) {
    json[*names.begin()] = value;
  }
};

struct DirectionReader {
  const std::string place;
  const Json& json;

  template <typename T>
  void operator()(std::initializer_list<const char*> names, T& value, double least, double most) {
    if constexpr (std::is_same_v<T, bool>) {
      value = json.at(*names.begin()).get<bool>();
    } else {
      value = BoundedAt(place, json, *names.begin(), static_cast<T>(least), static_cast<T>(most));
    }
  }
};

// Of worlds and slopes.
template <typename Direction>
Json DirectionsJson(const std::vector<Direction>& directions) {
  Json json = Json::array();
  for (const Direction& direction : directions) {
    DirectionMaker maker;
    VisitFields(maker, direction);
    json.push_back(std::move(maker.json));
  }
  return json;
}

template <typename Direction>
std::vector<Direction> ParseDirections(const std::string& path, const char* key, const Json& json) {
  std::vector<Direction> directions;
  for (const Json& direction : json.at(key)) {
    DirectionReader reader{fmt::format("{}: {}[{}]", path, key, directions.size()), direction};
    VisitFields(reader, directions.emplace_back());
  }
  return directions;
}

Json ItemJson(double value, double sigma) {
  return {{"value", value}, {"sigma", sigma}, {"estimated", sigma > 0}};
}

template <int kSize>
Json ItemJson(const Eigen::Matrix<double, kSize, 1>& value,
              const Eigen::Matrix<double, kSize, 1>& sigma) {
  return {{"value", std::vector<double>(value.begin(), value.end())},
          {"sigma", std::vector<double>(sigma.begin(), sigma.end())},
          {"estimated", !sigma.isZero(0)}};
}

// As it was known last; null where nothing was estimated.
Json CalibrationJson(const std::vector<CalibrationEstimate>& estimates) {
  if (estimates.empty()) return nullptr;
  const CalibrationEstimate& e = estimates.back();
  const auto part = [&]<int kSize>(int first) {
    return ItemJson<kSize>(e.imu_errors.segment<kSize>(first),
                           e.imu_errors_sigma.segment<kSize>(first));
  };
  return {{"time_offset_s", ItemJson(e.time_offset_s, e.time_offset_sigma_s)},
          {"imu_rotation_rad", ItemJson(e.imu_rotation_rad, e.imu_rotation_sigma_rad)},
          {"lever_m", ItemJson(e.lever_m, e.lever_sigma_m)},
          {"accel_scale", part.operator()<3>(kErrorAccelScale)},
          {"accel_axes_rad", part.operator()<3>(kErrorAccelAxes)},
          {"gyro_scale", part.operator()<3>(kErrorGyroScale)},
          {"gyro_axes_rad", part.operator()<6>(kErrorGyroAxes)},
          {"right_rotation_rad", ItemJson(e.right_rotation_rad, e.right_rotation_sigma_rad)},
          {"focal_length", ItemJson(e.focal_length, e.focal_length_sigma)},
          {"right_centre_px", ItemJson(e.right_centre_px, e.right_centre_sigma_px)}};
}

Json SourceJson(const std::optional<RunSource>& source) {
  if (!source) return nullptr;
  Json corrections = Json::array();
  for (const CheckCorrection& correction : source->corrections) {
    corrections.push_back(
        {{"name", correction.name}, {"values", correction.values}, {"words", correction.words}});
  }
  return {{"slcmap", source->version},
          {"sequence", source->sequence},
          {"calibration", source->calibration},
          {"corrections", corrections},
          {"check_errors", source->check_errors},
          {"opened", OpenedJson(source->opened)}};
}

std::optional<RunSource> ParseSource(const Json& json) {
  if (json.is_null()) return std::nullopt;
  RunSource source;
  source.version = json.at("slcmap").get<std::string>();
  source.sequence = json.at("sequence").get<std::string>();
  source.calibration = json.at("calibration").get<std::string>();
  for (const Json& correction : json.value("corrections", Json::array())) {
    source.corrections.push_back({correction.at("name").get<std::string>(),
                                  correction.at("values").get<std::vector<double>>(),
                                  correction.at("words").get<std::string>()});
  }
  source.check_errors = json.value("check_errors", std::vector<std::string>());
  source.opened = ParseOpened(json);
  return source;
}

Json TrackLengthsJson(const LineTrackLengths& lives) {
  return {{"lines", lives.lines},
          {"median_keyframes", lives.median_keyframes},
          {"mean_keyframes", lives.mean_keyframes},
          {"share_over_10", lives.share_over_10}};
}

Json TrackLengthsJson(const PointTrackLengths& lives) {
  return {{"points", lives.points}, {"seen_once", lives.seen_once}};
}

// Row by row.
template <int kRows, int kColumns>
Json MatrixJson(const Eigen::Matrix<double, kRows, kColumns>& matrix) {
  Json rows = Json::array();
  for (const auto& row : matrix.rowwise())
    rows.push_back(std::vector<double>(row.begin(), row.end()));
  return rows;
}

template <typename Matrix>
Matrix ParseMatrix(const Json& json) {
  Matrix matrix;
  for (int r = 0; r < matrix.rows(); ++r) {
    for (int c = 0; c < matrix.cols(); ++c) matrix(r, c) = json.at(r).at(c).get<double>();
  }
  return matrix;
}

ImuCorrection ParseCorrection(const std::string& place, const Json& json) {
  constexpr double kMaxEntry = 10;
  const auto matrix = [&](const char* key) {
    const auto m = ParseMatrix<Eigen::Matrix3d>(json.at(key));
    if (m.cwiseAbs().maxCoeff() <= kMaxEntry) return m;
    throw DataError(
        fmt::format("{}: {}: found entries beyond {}, expected a matrix near the identity", place,
                    key, kMaxEntry));
  };
  return {matrix("accel"), matrix("gyro")};
}

Json CameraJson(const Camera& camera, const RigidTransform& T_imu_camera) {
  const Eigen::Vector4d& k = camera.coefficients;
  Json json = {{"width_px", camera.width_px},
               {"height_px", camera.height_px},
               {"fx_px", camera.fx_px},
               {"fy_px", camera.fy_px},
               {"cx_px", camera.cx_px},
               {"cy_px", camera.cy_px},
               {"distortion", GetName(camera.distortion)},
               {"coefficients", {k[0], k[1], k[2], k[3]}},
               {"T_imu_camera", MatrixJson(T_imu_camera.Matrix())}};
  const auto& higher = camera.higher_coefficients;
  if (!higher.isZero(0)) {
    json["higher_coefficients"] = std::vector<double>(higher.begin(), higher.end());
  }
  if (!camera.shape.isZero(0)) json["shape"] = {camera.shape[0], camera.shape[1]};
  return json;
}

Camera ParseCamera(const Json& json, const std::string& name) {
  Camera camera;
  camera.width_px = json.at("width_px").get<int>();
  camera.height_px = json.at("height_px").get<int>();
  camera.fx_px = json.at("fx_px").get<double>();
  camera.fy_px = json.at("fy_px").get<double>();
  camera.cx_px = json.at("cx_px").get<double>();
  camera.cy_px = json.at("cy_px").get<double>();
  for (int i = 0; i < 4; ++i) camera.coefficients[i] = json.at("coefficients").at(i).get<double>();
  for (int i = 0; i < 8 && json.contains("higher_coefficients"); ++i) {
    camera.higher_coefficients[i] = json.at("higher_coefficients").at(i).get<double>();
  }
  for (int i = 0; i < 2 && json.contains("shape"); ++i) {
    camera.shape[i] = json.at("shape").at(i).get<double>();
  }
  const std::string distortion = json.at("distortion").get<std::string>();
  const std::optional<Distortion> known = FindDistortion(distortion);
  if (!known) {
    throw DataError(
        fmt::format("{}: distortion: found '{}', expected none, radial-tangential, equidistant, "
                    "omni, eucm, ds or fov",
                    name, distortion));
  }
  camera.distortion = *known;
  return camera;
}

}  // namespace

constexpr double kMaxFigure = 1e300, kMaxTiming = 1e12;
constexpr int64_t kMaxCount = 1'000'000'000'000;

template <typename Fields>
void Describe(Fields& fields, Of<ImuNoise> auto& noise) {
  constexpr double kMaxDensity = 1e3, kMaxRate_hz = 1e6;
  fields.Number("gyro_noise_rad_s_sqrthz", noise.gyro_noise_rad_s_sqrthz, 0, kMaxDensity, kExact);
  fields.Number("gyro_walk_rad_s2_sqrthz", noise.gyro_walk_rad_s2_sqrthz, 0, kMaxDensity, kExact);
  fields.Number("accel_noise_m_s2_sqrthz", noise.accel_noise_m_s2_sqrthz, 0, kMaxDensity, kExact);
  fields.Number("accel_walk_m_s3_sqrthz", noise.accel_walk_m_s3_sqrthz, 0, kMaxDensity, kExact);
  fields.Number("rate_hz", noise.rate_hz, 0, kMaxRate_hz, kExact);
}

template <typename Fields>
void Describe(Fields& fields, Of<FigureSummary> auto& figure) {
  fields.Number("mean", figure.mean, 0, kMaxFigure, kExact);
  fields.Number("worst", figure.worst, 0, kMaxFigure, kExact);
  fields.Integer("count", figure.count, 0, kMaxCount);
}

template <typename Fields>
void Describe(Fields& fields, Of<StageTiming> auto& stage) {
  fields.Value("name", stage.name);
  fields.Number("wall_s", stage.wall_s, 0, kMaxTiming, kExact);
  fields.Integer("calls", stage.calls, 0, kMaxCount);
}

template <typename Fields>
void Describe(Fields& fields, Of<RealTimeReport> auto& report) {
  fields.Integer("skipped_images", report.skipped_images, 0, kMaxCount);
  fields.Number("latency_median_s", report.latency_median_s, 0, kMaxTiming, kExact);
  fields.Number("latency_95_s", report.latency_95_s, 0, kMaxTiming, kExact);
}

template <typename Fields>
void Describe(Fields& fields, Of<RunTimings> auto& timings) {
  fields.Number("cpu_s", timings.cpu_s, 0, kMaxTiming, kExact);
  fields.Number("wall_s", timings.wall_s, 0, kMaxTiming, kExact);
  fields.Number("peak_memory_mib", timings.peak_memory_mib, 0, kMaxTiming, kExact);
  fields.Integer("stereo_frames", timings.stereo_frames, 0, kMaxCount);
  fields.Number("data_s", timings.data_s, 0, kMaxTiming, kExact);
  fields.Integer("window_iterations", timings.window_iterations, 0, kMaxCount);
  fields.List("stages", timings.stages);
}

std::map<std::string, int64_t> ParseWarnings(const std::string& path, const Json& json) {
  auto warnings = json.get<std::map<std::string, int64_t>>();
  for (const auto& [kind, count] : warnings) {
    if (count >= 0) continue;
    throw DataError(
        fmt::format("{}: warnings: {}: found {}, expected at least 0", path, kind, count));
  }
  return warnings;
}

std::vector<std::pair<const char*, std::size_t>> RunCounts(const OdometryRun& run) {
  std::size_t observations = 0, line_observations = 0, line_points = 0;
  for (const Keyframe& keyframe : run.keyframes) {
    observations += keyframe.observations.size();
    line_observations += keyframe.lines.size();
  }
  for (const Line& line : run.lines) line_points += line.point_ids.size();
  return {{"states", run.states.size()},  {"keyframes", run.keyframes.size()},
          {"observations", observations}, {"landmarks", run.landmarks.size()},
          {"lines", run.lines.size()},    {"line_observations", line_observations},
          {"line_points", line_points},   {"line_merges", run.line_merges.size()},
          {"imu_samples", run.imu.size()}};
}

Json FiguresJson(const RunFigures& figures) {
  Json json;
  for (const auto& [name, member] : kRunFigures) json[name] = JsonWriter::Write(figures.*member);
  return json;
}

RunFigures ParseFigures(const std::string& path, const Json& json) {
  RunFigures figures;
  for (const auto& [name, member] : kRunFigures) {
    if (!json.contains(name)) continue;
    const std::string place = fmt::format("{}: figures: {}", path, name);
    figures.*member = JsonReader::Read<FigureSummary>(place, json.at(name));
  }
  return figures;
}

void ParseSoFar(const std::string& path, const Json& json, OdometryRun* run) {
  run->warnings = ParseWarnings(path, json.at("warnings"));
  // Newer than the version.
  if (json.contains("figures")) run->figures = ParseFigures(path, json.at("figures"));
  if (json.contains("line_deviation_rad")) {
    run->line_deviation_rad = BoundedAt(path, json, "line_deviation_rad", 0.0, 1.0);
  }
}

Json HeaderJson(const OdometryRun& run) {
  return {{"format", "slcmap run"},
          {"version", kRunVersion},
          {"method", run.method},
          {"source", SourceJson(run.source)}};
}

void ParseHeader(const std::string& place, const Json& json, OdometryRun* run) {
  CheckFormat(place, json, "slcmap run", kRunVersion, kRunVersion);
  run->method = json.at("method").get<std::string>();
  CheckMethodName(place, run->method);
  run->source = ParseSource(json.at("source"));
}

void WriteRunSummary(const std::string& path, const OdometryRun& run,
                     const std::vector<std::string>& files) {
  Json json = HeaderJson(run);
  json["complete"] = run.complete;
  json["partial_reason"] = run.partial_reason;
  json["verdict"] = VerdictJson(run.verdict);
  json["figures"] = FiguresJson(run.figures);
  json["warnings"] = run.warnings;
  json["manhattan_worlds"] = DirectionsJson(run.manhattan_worlds);
  json["sloped_directions"] = DirectionsJson(run.sloped_directions);
  json["line_deviation_rad"] = run.line_deviation_rad;
  json["point_lives"] = TrackLengthsJson(MeasurePointTracks(run.keyframes));
  json["calibration"] = CalibrationJson(run.calibration);
  json["line_lives"] = TrackLengthsJson(MeasureLineTracks(run.lines));
  json["segments"] = SegmentsJson(run);
  for (const auto& [what, count] : RunCounts(run)) json["counts"][what] = count;
  json["files"] = ListFiles(path.substr(0, path.rfind('/')), files);
  WriteSummaryFile(path, json);
}

Json ReadRunSummary(const std::string& path, OdometryRun* run) {
  return ParseJsonFile(path, [&](const Json& json) {
    ParseHeader(path, json, run);
    run->id = json.at("id").get<std::string>();
    run->complete = json.at("complete").get<bool>();
    run->partial_reason = json.at("partial_reason").get<std::string>();
    run->verdict = ParseVerdict(path, json);
    ParseSoFar(path, json, run);
    run->manhattan_worlds = ParseDirections<ManhattanWorld>(path, "manhattan_worlds", json);
    if (json.contains("sloped_directions")) {  // newer than the version
      run->sloped_directions = ParseDirections<SlopedDirection>(path, "sloped_directions", json);
    }
    return json;
  });
}

void WriteRig(const std::string& path, const Rig& rig) {
  Json cameras = Json::array(), masks = Json::array();
  for (size_t i = 0; i < rig.cameras.size(); ++i) {
    cameras.push_back(CameraJson(rig.cameras[i], rig.T_imu_camera[i]));
    masks.push_back(CollectRuns(rig.masks[i]));
  }
  Json json = {{"cameras", cameras},
               {"imu_noise", JsonWriter::Write(rig.imu_noise)},
               {"camera_time_offset_s", rig.camera_time_offset_s}};
  const auto is_given = [](const cv::Mat& mask) { return !mask.empty(); };
  if (std::ranges::any_of(rig.masks, is_given)) json["masks"] = masks;
  if (!IsTakenAtOnce(rig)) {
    json["right_time_offset_s"] = rig.right_time_offset_s;
    if (!rig.other_time_offsets_s.empty()) {
      json["other_time_offsets_s"] = rig.other_time_offsets_s;
    }
    json["readout_s"] = rig.readout_s;
  }
  if (!IsIdentity(rig.imu_correction)) {
    json["imu_correction"] = {{"accel", MatrixJson(rig.imu_correction.accel)},
                              {"gyro", MatrixJson(rig.imu_correction.gyro)}};
  }
  WriteJsonFile(path, json);
}

Rig ReadRig(const std::string& path) {
  return ParseJsonFile(path, [&](const Json& json) {
    Rig rig;
    rig.Resize(json.at("cameras").size());
    for (size_t i = 0; i < rig.cameras.size(); ++i) {
      const std::string name = fmt::format("{}: cameras[{}]", path, i);
      const Json& camera = json.at("cameras").at(i);
      rig.cameras[i] = ParseCamera(camera, name);
      // The second camera of a rig that has one has no size.
      if (i == 0 || rig.cameras[i].width_px != 0) rig.cameras[i].Check(name);
      rig.T_imu_camera[i] = RigidTransformFromMatrix(
          ParseMatrix<Eigen::Matrix4d>(camera.at("T_imu_camera")), name + ": T_imu_camera");
    }
    rig.imu_noise = JsonReader::Read<ImuNoise>(path + ": imu_noise", json.at("imu_noise"));
    rig.camera_time_offset_s =
        BoundedAt(path, json, "camera_time_offset_s", -kMaxTimeOffset_s, kMaxTimeOffset_s);
    if (json.contains("masks")) {
      for (size_t i = 0; i < rig.masks.size(); ++i) {
        rig.masks[i] = MaskOfRuns(json.at("masks").at(i).get<std::vector<int>>(), rig.cameras[i],
                                  fmt::format("{}: masks[{}]", path, i));
      }
    }
    if (json.contains("readout_s")) {  // of a rig whose rows are not exposed at once
      rig.right_time_offset_s =
          BoundedAt(path, json, "right_time_offset_s", -kMaxTimeOffset_s, kMaxTimeOffset_s);
      rig.readout_s = json.at("readout_s").get<std::vector<double>>();
      rig.readout_s.resize(rig.cameras.size());
      rig.other_time_offsets_s = json.value("other_time_offsets_s", std::vector<double>());
    }
    if (json.contains("imu_correction")) {  // of an IMU that was calibrated so
      rig.imu_correction = ParseCorrection(path + ": imu_correction", json.at("imu_correction"));
    }
    CheckRig(rig, path);
    return rig;
  });
}

void WriteTimings(const std::string& path, const RunTimings& timings) {
  Json json = JsonWriter::Write(timings);
  if (timings.real_time) json["real_time"] = JsonWriter::Write(*timings.real_time);
  WriteJsonFile(path, json);
}

RunTimings ReadTimings(const std::string& path) {
  return ParseJsonFile(path, [&](const Json& json) {
    auto timings = JsonReader::Read<RunTimings>(path, json);
    if (json.contains("real_time")) {
      timings.real_time = JsonReader::Read<RealTimeReport>(path, json.at("real_time"));
    }
    return timings;
  });
}

}  // namespace slcmap::odometry
