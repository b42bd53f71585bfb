#include "odometry/run_json.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "data/error.h"
#include "data/json_file.h"
#include "odometry/run_lines.h"

namespace slcmap {
namespace {

constexpr int kRunVersion = 2;
constexpr int kOldestRunVersion = 1;  // without lines

constexpr std::pair<Distortion, const char*> kDistortionNames[] = {
    {Distortion::kNone, "none"},
    {Distortion::kRadialTangential, "radial-tangential"},
    {Distortion::kEquidistant, "equidistant"}};

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

Json WorldsJson(const std::vector<ManhattanWorld>& worlds) {
  Json json = Json::array();
  for (const ManhattanWorld& world : worlds) {
    json.push_back({{"segment", world.segment},
                    {"heading_rad", world.heading_rad},
                    {"sigma_rad", world.sigma_rad},
                    {"found_at_ns", world.found_at_ns}});
  }
  return json;
}

std::vector<ManhattanWorld> ParseWorlds(const Json& json) {
  std::vector<ManhattanWorld> worlds;
  for (const Json& world : json) {
    worlds.push_back({world.at("segment").get<int>(), world.at("heading_rad").get<double>(),
                      world.at("sigma_rad").get<double>(), world.at("found_at_ns").get<int64_t>()});
  }
  return worlds;
}

Json LivesJson(const LineLives& lives) {
  return {{"lines", lives.lines},
          {"median_keyframes", lives.median_keyframes},
          {"mean_keyframes", lives.mean_keyframes},
          {"share_over_10", lives.share_over_10}};
}

Json MatrixJson(const RigidTransform& transform) {
  const Eigen::Matrix4d matrix = transform.Matrix();
  Json rows = Json::array();
  for (int r = 0; r < 4; ++r) {
    rows.push_back({matrix(r, 0), matrix(r, 1), matrix(r, 2), matrix(r, 3)});
  }
  return rows;
}

RigidTransform ParseMatrix(const Json& json, const std::string& name) {
  Eigen::Matrix4d matrix;
  for (int r = 0; r < 4; ++r) {
    for (int c = 0; c < 4; ++c) matrix(r, c) = json.at(r).at(c).get<double>();
  }
  return RigidTransformFromMatrix(matrix, name);
}

Json CameraJson(const Camera& camera, const RigidTransform& T_imu_camera) {
  const auto name =
      std::find_if(std::begin(kDistortionNames), std::end(kDistortionNames),
                   [&](const auto& entry) { return entry.first == camera.distortion; });
  const Eigen::Vector4d& k = camera.coefficients;
  return {{"width_px", camera.width_px},
          {"height_px", camera.height_px},
          {"fx_px", camera.fx_px},
          {"fy_px", camera.fy_px},
          {"cx_px", camera.cx_px},
          {"cy_px", camera.cy_px},
          {"distortion", name->second},
          {"coefficients", {k[0], k[1], k[2], k[3]}},
          {"T_imu_camera", MatrixJson(T_imu_camera)}};
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
  const std::string distortion = json.at("distortion").get<std::string>();
  const auto entry = std::find_if(std::begin(kDistortionNames), std::end(kDistortionNames),
                                  [&](const auto& known) { return known.second == distortion; });
  if (entry == std::end(kDistortionNames)) {
    throw DataError(
        fmt::format("{}: distortion: found '{}', expected none, radial-tangential or "
                    "equidistant",
                    name, distortion));
  }
  camera.distortion = entry->first;
  return camera;
}

}  // namespace

void WriteRunSummary(const std::string& path, const OdometryRun& run) {
  WriteJsonFile(path, {{"format", "slcmap run"},
                       {"version", kRunVersion},
                       {"method", run.method},
                       {"complete", run.complete},
                       {"partial_reason", run.partial_reason},
                       {"warnings", Json(run.warnings)},
                       {"manhattan_worlds", WorldsJson(run.manhattan_worlds)},
                       {"line_lives", LivesJson(MeasureLineLives(run.lines))},
                       {"segments", SegmentsJson(run)}});
}

RunContents ReadRunSummary(const std::string& path, OdometryRun* run) {
  return ParseJsonFile(path, [&](const Json& json) {
    const int version = CheckFormat(path, json, "slcmap run", kOldestRunVersion, kRunVersion);
    run->method = json.at("method").get<std::string>();
    run->complete = json.at("complete").get<bool>();
    run->partial_reason = json.at("partial_reason").get<std::string>();
    run->warnings = json.at("warnings").get<std::map<std::string, int64_t>>();
    if (version == kOldestRunVersion) return RunContents::kPoints;
    run->manhattan_worlds = ParseWorlds(json.at("manhattan_worlds"));
    return RunContents::kPointsAndLines;
  });
}

void WriteRig(const std::string& path, const Rig& rig) {
  const ImuNoise& noise = rig.imu_noise;
  WriteJsonFile(path, {{"cameras",
                        {CameraJson(rig.cameras[0], rig.T_imu_camera[0]),
                         CameraJson(rig.cameras[1], rig.T_imu_camera[1])}},
                       {"imu_noise",
                        {{"gyro_noise_rad_s_sqrthz", noise.gyro_noise_rad_s_sqrthz},
                         {"gyro_walk_rad_s2_sqrthz", noise.gyro_walk_rad_s2_sqrthz},
                         {"accel_noise_m_s2_sqrthz", noise.accel_noise_m_s2_sqrthz},
                         {"accel_walk_m_s3_sqrthz", noise.accel_walk_m_s3_sqrthz},
                         {"rate_hz", noise.rate_hz}}},
                       {"camera_time_offset_s", rig.camera_time_offset_s}});
}

Rig ReadRig(const std::string& path) {
  return ParseJsonFile(path, [&](const Json& json) {
    Rig rig;
    for (int i = 0; i < 2; ++i) {
      const std::string name = fmt::format("{}: cameras[{}]", path, i);
      const Json& camera = json.at("cameras").at(i);
      rig.cameras[i] = ParseCamera(camera, name);
      rig.T_imu_camera[i] = ParseMatrix(camera.at("T_imu_camera"), name + ": T_imu_camera");
    }
    const Json& noise = json.at("imu_noise");
    rig.imu_noise.gyro_noise_rad_s_sqrthz = noise.at("gyro_noise_rad_s_sqrthz").get<double>();
    rig.imu_noise.gyro_walk_rad_s2_sqrthz = noise.at("gyro_walk_rad_s2_sqrthz").get<double>();
    rig.imu_noise.accel_noise_m_s2_sqrthz = noise.at("accel_noise_m_s2_sqrthz").get<double>();
    rig.imu_noise.accel_walk_m_s3_sqrthz = noise.at("accel_walk_m_s3_sqrthz").get<double>();
    rig.imu_noise.rate_hz = noise.at("rate_hz").get<double>();
    rig.camera_time_offset_s = json.at("camera_time_offset_s").get<double>();
    return rig;
  });
}

void WriteTimings(const std::string& path, const RunTimings& timings) {
  Json stages = Json::array();
  for (const StageTiming& stage : timings.stages) {
    stages.push_back({{"name", stage.name}, {"wall_s", stage.wall_s}, {"calls", stage.calls}});
  }
  Json json = {{"cpu_s", timings.cpu_s},
               {"wall_s", timings.wall_s},
               {"peak_memory_mib", timings.peak_memory_mib},
               {"stereo_frames", timings.stereo_frames},
               {"data_s", timings.data_s},
               {"window_iterations", timings.window_iterations},
               {"stages", stages}};
  if (timings.real_time) {
    json["real_time"] = {{"skipped_images", timings.real_time->skipped_images},
                         {"latency_median_s", timings.real_time->latency_median_s},
                         {"latency_95_s", timings.real_time->latency_95_s}};
  }
  WriteJsonFile(path, json);
}

RunTimings ReadTimings(const std::string& path) {
  return ParseJsonFile(path, [](const Json& json) {
    RunTimings timings;
    timings.cpu_s = json.at("cpu_s").get<double>();
    timings.wall_s = json.at("wall_s").get<double>();
    timings.peak_memory_mib = json.at("peak_memory_mib").get<double>();
    timings.stereo_frames = json.at("stereo_frames").get<int64_t>();
    timings.data_s = json.at("data_s").get<double>();
    timings.window_iterations = json.value("window_iterations", int64_t{0});
    for (const Json& stage : json.at("stages")) {
      timings.stages.push_back({stage.at("name").get<std::string>(),
                                stage.at("wall_s").get<double>(),
                                stage.at("calls").get<int64_t>()});
    }
    if (json.contains("real_time")) {
      const Json& real_time = json.at("real_time");
      timings.real_time = {real_time.at("skipped_images").get<int64_t>(),
                           real_time.at("latency_median_s").get<double>(),
                           real_time.at("latency_95_s").get<double>()};
    }
    return timings;
  });
}

}  // namespace slcmap
