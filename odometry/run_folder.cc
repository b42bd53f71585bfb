#include "odometry/run_folder.h"

#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <unordered_map>

#include "data/csv_table.h"
#include "data/error.h"
#include "data/file.h"
#include "data/ply.h"
#include "odometry/finite_run.h"
#include "odometry/line_files.h"
#include "odometry/run_json.h"

namespace slcmap {
namespace {

constexpr char kStateColumns[] =
    "stamp_ns,segment,vx_m_s,vy_m_s,vz_m_s,gyro_bias_x_rad_s,gyro_bias_y_rad_s,gyro_bias_z_rad_s,"
    "accel_bias_x_m_s2,accel_bias_y_m_s2,accel_bias_z_m_s2";
constexpr char kKeyframeColumns[] = "id,segment,stamp_ns,x_m,y_m,z_m,qx,qy,qz,qw";
constexpr char kObservationColumns[] =
    "keyframe_id,landmark_id,left_x_px,left_y_px,right_x_px,right_y_px";

// The files of a run folder.
struct RunPaths {
  explicit RunPaths(const std::string& folder)
      : trajectory(folder + "/trajectory.tum"),
        states(folder + "/states.csv"),
        keyframes(folder + "/keyframes.csv"),
        observations(folder + "/observations.csv"),
        points(folder + "/points.ply"),
        rig(folder + "/rig.json"),
        timings(folder + "/timings.json"),
        summary(folder + "/run.json") {}
  std::string trajectory, states, keyframes, observations, points, rig, timings, summary;
};

std::string Columns(const Eigen::Vector3d& v) {
  return fmt::format("{},{},{}", v.x(), v.y(), v.z());
}

Eigen::Vector3d Vector(const CsvTable& table, std::size_t row, std::size_t column) {
  return {table.Number(row, column), table.Number(row, column + 1), table.Number(row, column + 2)};
}

void WriteStates(const RunPaths& paths, const std::vector<OnlineState>& states) {
  Trajectory trajectory;
  std::string text = std::string(kStateColumns) + "\n";
  for (const OnlineState& state : states) {
    trajectory.push_back({state.stamp_ns, state.T_world_imu});
    text += fmt::format("{},{},{},{},{}\n", state.stamp_ns, state.segment,
                        Columns(state.velocity_world_m_s), Columns(state.gyro_bias_rad_s),
                        Columns(state.accel_bias_m_s2));
  }
  WriteTumTrajectory(paths.trajectory, trajectory);
  WriteFile(paths.states, text);
}

std::vector<OnlineState> ReadStates(const RunPaths& paths) {
  const CsvTable table = CsvTable::Read(paths.states, kStateColumns);
  // A run that never initialised has no pose, which a trajectory file read alone may not.
  if (table.rows() == 0) return {};
  const Trajectory trajectory = ReadTumTrajectory(paths.trajectory);
  if (trajectory.size() != table.rows()) {
    throw DataError(fmt::format("{}: found {} rows, expected {} as in trajectory.tum", paths.states,
                                table.rows(), trajectory.size()));
  }
  std::vector<OnlineState> states(table.rows());
  for (std::size_t i = 0; i < states.size(); ++i) {
    states[i].stamp_ns = table.Integer(i, 0);
    states[i].segment = static_cast<int>(table.Integer(i, 1));
    states[i].T_world_imu = trajectory[i].T_world_imu;
    states[i].velocity_world_m_s = Vector(table, i, 2);
    states[i].gyro_bias_rad_s = Vector(table, i, 5);
    states[i].accel_bias_m_s2 = Vector(table, i, 8);
  }
  return states;
}

void WriteKeyframes(const RunPaths& paths, const std::vector<Keyframe>& keyframes) {
  std::string poses = std::string(kKeyframeColumns) + "\n";
  std::string observations = std::string(kObservationColumns) + "\n";
  for (const Keyframe& keyframe : keyframes) {
    const Eigen::Quaterniond& q = keyframe.T_world_imu.rotation;
    poses +=
        fmt::format("{},{},{},{},{},{},{},{}\n", keyframe.id, keyframe.segment, keyframe.stamp_ns,
                    Columns(keyframe.T_world_imu.translation), q.x(), q.y(), q.z(), q.w());
    for (const KeyframeObservation& seen : keyframe.observations) {
      observations += fmt::format(
          "{},{},{:.4f},{:.4f},{}\n", keyframe.id, seen.landmark_id, seen.left_px.x(),
          seen.left_px.y(),
          seen.right_px ? fmt::format("{:.4f},{:.4f}", seen.right_px->x(), seen.right_px->y())
                        : "nan,nan");
    }
  }
  WriteFile(paths.keyframes, poses);
  WriteFile(paths.observations, observations);
}

void ReadObservations(const std::string& path, std::vector<Keyframe>* keyframes) {
  std::unordered_map<int64_t, Keyframe*> by_id;
  for (Keyframe& keyframe : *keyframes) by_id[keyframe.id] = &keyframe;
  const CsvTable table = CsvTable::Read(path, kObservationColumns);
  for (std::size_t i = 0; i < table.rows(); ++i) {
    const auto keyframe = by_id.find(table.Integer(i, 0));
    if (keyframe == by_id.end()) table.Fail(i, 0, "the id of a keyframe in keyframes.csv");
    KeyframeObservation seen;
    seen.landmark_id = table.Integer(i, 1);
    seen.left_px = {table.Number(i, 2), table.Number(i, 3)};
    if (const std::optional<double> right_x = table.OptionalNumber(i, 4)) {
      seen.right_px = Eigen::Vector2d(*right_x, table.Number(i, 5));
    }
    keyframe->second->observations.push_back(seen);
  }
}

std::vector<Keyframe> ReadKeyframes(const RunPaths& paths) {
  const CsvTable table = CsvTable::Read(paths.keyframes, kKeyframeColumns);
  std::vector<Keyframe> keyframes(table.rows());
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    keyframes[i].id = table.Integer(i, 0);
    keyframes[i].segment = static_cast<int>(table.Integer(i, 1));
    keyframes[i].stamp_ns = table.Integer(i, 2);
    keyframes[i].T_world_imu.translation = Vector(table, i, 3);
    Eigen::Quaterniond& q = keyframes[i].T_world_imu.rotation;
    q.coeffs() << Vector(table, i, 6), table.Number(i, 9);
    if (std::abs(q.norm() - 1) > 1e-3) table.Fail(i, 9, "a quaternion of length 1");
    q.normalize();
  }
  ReadObservations(paths.observations, &keyframes);
  return keyframes;
}

void WriteLandmarks(const std::string& path, const std::vector<Landmark>& landmarks) {
  PlyElement vertices{"vertex", {}};
  for (const char* name : {"x", "y", "z", "sigma_m"}) vertices.Add(name, PlyType::kFloat);
  for (const char* name : {"id", "observations", "segment"}) vertices.Add(name, PlyType::kInt32);
  for (const Landmark& landmark : landmarks) {
    vertices.AppendRow({landmark.p_world.x(), landmark.p_world.y(), landmark.p_world.z(),
                        landmark.sigma_m, static_cast<double>(landmark.id),
                        static_cast<double>(landmark.observations),
                        static_cast<double>(landmark.segment)});
  }
  WritePly(path, {{"slcmap landmarks, metres in the world frame"}, {vertices}, {}});
}

std::vector<Landmark> ReadLandmarks(const std::string& path) {
  const PlyFile file = ReadPly(path);
  const PlyElement& vertices = file.Get("vertex", path);
  const auto column = [&](const char* name) -> const std::vector<double>& {
    return vertices.Get(name, path).values;
  };
  const std::vector<Eigen::Vector3d> positions = Positions(vertices, path);
  const auto &sigma_m = column("sigma_m"), &id = column("id"),
             &observations = column("observations"), &segment = column("segment");
  std::vector<Landmark> landmarks(vertices.size());
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    landmarks[i].p_world = positions[i];
    landmarks[i].sigma_m = sigma_m[i];
    landmarks[i].id = static_cast<int64_t>(id[i]);
    landmarks[i].observations = static_cast<int>(observations[i]);
    landmarks[i].segment = static_cast<int>(segment[i]);
  }
  return landmarks;
}

}  // namespace

StageFiles RunFiles() {
  return {"a run",
          {"run.json", "trajectory.tum", "states.csv", "keyframes.csv", "observations.csv",
           "points.ply", "lines.csv", "line_observations.csv", "line_points.csv", "lines.ply",
           "rig.json", "timings.json"}};
}

void WriteRunFolder(const std::string& folder, const OdometryRun& run) {
  OutputFolder output(folder, RunFiles());
  WriteRunFolder(&output, run);
}

void WriteRunFolder(OutputFolder* folder, const OdometryRun& run) {
  // The copy of a long run is worth avoiding.
  if (!IsFinite(run)) return WriteRunFolder(folder, WithoutNonFinite(run));
  const RunPaths paths(folder->staging());
  WriteStates(paths, run.states);
  WriteKeyframes(paths, run.keyframes);
  WriteLandmarks(paths.points, run.landmarks);
  WriteLineFiles(folder->staging(), run);
  WriteRig(paths.rig, run.rectified_rig);
  WriteTimings(paths.timings, run.timings);
  WriteRunSummary(paths.summary, run);
  folder->Commit();
}

OdometryRun ReadRunFolder(const std::string& folder) {
  const InputLock lock(folder);
  const RunPaths paths(folder);
  OdometryRun run;
  const RunContents contents = ReadRunSummary(paths.summary, &run);
  run.rectified_rig = ReadRig(paths.rig);
  run.states = ReadStates(paths);
  run.keyframes = ReadKeyframes(paths);
  run.landmarks = ReadLandmarks(paths.points);
  if (contents == RunContents::kPointsAndLines) ReadLineFiles(folder, &run);
  run.timings = ReadTimings(paths.timings);
  return run;
}

}  // namespace slcmap
