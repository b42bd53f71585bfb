#include "mapping/map/stage_store.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <concepts>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <tuple>
#include <type_traits>

#include "data/calibration/mask.h"
#include "data/core/error.h"
#include "data/io/file.h"
#include "data/io/json.h"
#include "data/version.h"

namespace slcmap::inline mapping {
namespace {

namespace fs = std::filesystem;

constexpr char kHeader[] = "slcmap stage 1\n";
constexpr size_t kChecksumLength = 16;

template <typename T, typename Type>
concept Is = std::same_as<std::remove_const_t<T>, Type>;

// What is packed of a struct, in its order.
auto Members(Is<DensePoint> auto& p) {
  return std::tie(p.p_world, p.normal_world, p.sigma_m, p.grey);
}
auto Members(Is<ViewRays> auto& rays) {
  return std::tie(rays.p_world_camera, rays.p_world, rays.sigma_m);
}
auto Members(Is<MapLine> auto& line) {
  return std::tie(line.id, line.segment, line.axis, line.world, line.recent, line.observations,
                  line.kind, line.start_world, line.end_world, line.sigma_m, line.deviation_rad,
                  line.deviation_sigma_rad, line.edge_probability);
}
auto Members(Is<LineCovariance> auto& covariance) {
  return std::tie(covariance.line_id, covariance.piece, covariance.start_m2, covariance.end_m2,
                  covariance.start_end_m2);
}
auto Members(Is<LineSupport> auto& support) {
  return std::tie(support.line_id, support.piece, support.stamp_ns, support.camera,
                  support.px.start, support.px.end);
}
auto Members(Is<RigidTransform> auto& T) { return std::tie(T.rotation.coeffs(), T.translation); }
auto Members(Is<Camera> auto& camera) {
  return std::tie(camera.distortion, camera.width_px, camera.height_px, camera.fx_px, camera.fy_px,
                  camera.cx_px, camera.cy_px, camera.coefficients, camera.higher_coefficients,
                  camera.shape);
}

template <typename T>
concept Number = std::is_arithmetic_v<T> || std::is_enum_v<T>;
template <typename T>
concept Matrix = requires(T& matrix) {
  matrix.reshaped();
};
template <typename T>
concept Dictionary = requires {
  typename T::mapped_type;
};
template <typename T>
concept List = requires(T& list) {
  list.resize(1);
};

// Numbers as the memory holds them: what is kept is for this machine.
template <typename T>
void Pack(const T& value, std::string* bytes) {
  if constexpr (Number<T>) {
    bytes->append(reinterpret_cast<const char*>(&value), sizeof(value));
  } else if constexpr (Matrix<T>) {
    for (const auto number : value.reshaped()) Pack(number, bytes);
  } else if constexpr (Dictionary<T>) {
    Pack(value.size(), bytes);
    for (const auto& [key, item] : value) Pack(key, bytes), Pack(item, bytes);
  } else if constexpr (List<T>) {
    Pack(value.size(), bytes);
    for (const auto& item : value) Pack(item, bytes);
  } else {
    std::apply([&](const auto&... member) { (Pack(member, bytes), ...); }, Members(value));
  }
}

template <typename... Values>
std::string Packed(const Values&... values) {
  std::string bytes;
  (Pack(values, &bytes), ...);
  return bytes;
}

// Takes what Pack added from the front of the bytes; false where they are of another form.
template <typename T>
bool Take(std::string_view* bytes, T* value) {
  if constexpr (Number<T>) {
    if (bytes->size() < sizeof(T)) return false;
    std::memcpy(value, bytes->data(), sizeof(T));
    bytes->remove_prefix(sizeof(T));
    return true;
  } else if constexpr (Matrix<T>) {
    return std::ranges::all_of(value->reshaped(),
                               [&](auto& number) { return Take(bytes, &number); });
  } else if constexpr (Dictionary<T>) {
    size_t size = 0;
    if (!Take(bytes, &size)) return false;
    for (; size > 0; --size) {
      typename T::key_type key;
      if (!Take(bytes, &key) || !Take(bytes, &(*value)[key])) return false;
    }
    return true;
  } else if constexpr (List<T>) {
    size_t size = 0;
    if (!Take(bytes, &size) || size > bytes->size()) return false;  // an item has a byte at least
    value->resize(size);
    return std::ranges::all_of(*value, [&](auto& item) { return Take(bytes, &item); });
  } else {
    return std::apply([&](auto&... member) { return (Take(bytes, &member) && ...); },
                      Members(*value));
  }
}

template <typename... Values>
bool Unpack(std::string_view bytes, Values*... values) {
  return (Take(&bytes, values) && ...) && bytes.empty();
}

std::string PackRig(const Rig& rig) {
  std::string bytes;
  for (size_t c = 0; c < rig.cameras.size(); ++c) {
    bytes += Packed(rig.cameras[c], rig.T_imu_camera[c], CollectRuns(rig.masks[c]));
  }
  return bytes;
}

// Images are rectified with what was found of the cameras.
std::string PackCalibration(const OdometryRun& run) {
  std::string bytes = PackRig(run.rectified_rig);
  if (run.source) bytes += PackRig(run.source->raw_rig);
  if (run.calibration.empty()) return bytes;
  const CalibrationEstimate& found = run.calibration.back();
  return bytes + Packed(found.right_rotation_rad, found.focal_length, found.right_centre_px,
                        found.time_offset_s);
}

}  // namespace

std::string StageStore::MakePath(const std::string& stage) const { return folder_ + "/" + stage; }

std::optional<std::string> StageStore::Load(const std::string& stage) const {
  std::error_code error;
  if (folder_.empty() || !fs::is_regular_file(MakePath(stage), error)) return std::nullopt;
  try {
    const std::string file = ReadFile(MakePath(stage)), begin = kHeader + key_;
    const size_t contents_at = begin.size() + kChecksumLength;
    if (file.size() < contents_at || !file.starts_with(begin)) return std::nullopt;
    std::string contents = file.substr(contents_at);
    if (file.substr(begin.size(), kChecksumLength) != Checksum(contents)) return std::nullopt;
    return contents;
  } catch (const DataError&) {
    return std::nullopt;
  }
}

void StageStore::Save(const std::string& stage,
                      const std::function<std::string()>& contents) const {
  if (folder_.empty()) return;
  try {
    fs::create_directories(folder_);
    const std::string bytes = contents();
    ReplaceFile(MakePath(stage), kHeader + key_ + Checksum(bytes) + bytes);
  } catch (const OutputError& error) {
    spdlog::warn("the stage {} is not kept: {}", stage, error.what());
  } catch (const fs::filesystem_error& error) {
    spdlog::warn("the stage {} is not kept: {}: {}", stage, folder_, error.code().message());
  }
}

void StageStore::Remove(const std::string& folder) {
  std::error_code ignored;  // what stays is of no harm
  std::vector<fs::path> saved;
  fs::directory_iterator entries(folder, ignored);
  for (; !ignored && entries != fs::directory_iterator(); entries.increment(ignored)) {
    if (!entries->is_regular_file(ignored)) continue;
    std::string begin(sizeof(kHeader) - 1, '\0');
    std::ifstream(entries->path(), std::ios::binary).read(begin.data(), std::ssize(begin));
    if (begin == kHeader) saved.push_back(entries->path());
  }
  for (const fs::path& path : saved) fs::remove(path, ignored);
  fs::remove(folder, ignored);
}

std::string ProgramId() { return kVersion + (" " + Checksum(ReadFile(ProgramFile()))); }

std::string StageKey(const OdometryRun& run, const std::string& images, const std::string& options,
                     const std::string& program) {
  std::string bytes = Packed(run.id, images, options, program) + PackCalibration(run);
  for (const OnlineState& state : run.states) Pack(state.T_world_imu, &bytes);
  for (const Keyframe& keyframe : run.keyframes) Pack(keyframe.T_world_imu, &bytes);
  for (const ManhattanWorld& world : run.manhattan_worlds) Pack(world.heading_rad, &bytes);
  return Checksum(bytes);
}

std::string PackDense(const MapResult& map, const std::vector<ViewRays>& rays,
                      const CountedWarnings& warnings) {
  return Packed(map.dense, map.occupancy.resolution_m(), map.occupancy.Nodes(), rays, warnings);
}

std::optional<DenseStage> UnpackDense(const std::string& bytes) {
  DenseStage stage;
  double resolution_m = 0;
  std::vector<uint8_t> nodes;
  if (!Unpack(bytes, &stage.dense, &resolution_m, &nodes, &stage.rays, &stage.warnings)) {
    return std::nullopt;
  }
  stage.occupancy = OccupancyMap::FromNodes(resolution_m, nodes);
  return stage;
}

std::string PackLines(const LineStage& stage) {
  return Packed(stage.lines, stage.evidence.covariances, stage.evidence.supports, stage.warnings);
}

std::optional<LineStage> UnpackLines(const std::string& bytes) {
  LineStage stage;
  LineEvidence& evidence = stage.evidence;
  if (!Unpack(bytes, &stage.lines, &evidence.covariances, &evidence.supports, &stage.warnings)) {
    return std::nullopt;
  }
  return stage;
}

}  // namespace slcmap::mapping
