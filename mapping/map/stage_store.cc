#include "mapping/map/stage_store.h"

#include <spdlog/spdlog.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <type_traits>

#include "data/calibration/mask.h"
#include "data/core/error.h"
#include "data/io/file.h"
#include "data/io/json.h"
#include "data/io/program_files.h"
#include "data/version.h"

namespace slcmap::inline mapping {
namespace {

namespace fs = std::filesystem;

constexpr char kHeader[] = "slcmap stage 1\n";
constexpr size_t kChecksumLength = 16;

// Numbers are packed as the memory holds them: what is kept is for this machine.
template <typename Number>
Json Packed(const std::vector<Number>& numbers) {
  static_assert(std::is_arithmetic_v<Number>);
  Json::binary_t bytes;
  bytes.resize(numbers.size() * sizeof(Number));
  if (!numbers.empty()) std::memcpy(bytes.data(), numbers.data(), bytes.size());
  return Json::binary(std::move(bytes));
}

template <typename Number>
std::vector<Number> Unpacked(const Json& json) {
  const Json::binary_t& bytes = json.get_binary();
  std::vector<Number> numbers(bytes.size() / sizeof(Number));
  if (!numbers.empty()) std::memcpy(numbers.data(), bytes.data(), numbers.size() * sizeof(Number));
  return numbers;
}

template <typename Derived>
void Append(const Eigen::MatrixBase<Derived>& matrix, std::vector<double>* numbers) {
  for (const double number : matrix.reshaped()) numbers->push_back(number);
}

// Takes numbers one after the other; Json's own error where there are too few.
class NumberReader {
 public:
  explicit NumberReader(const Json& json) : numbers_(Unpacked<double>(json)) {}

  bool AtEnd() const { return next_ >= numbers_.size(); }

  double Take() {
    if (AtEnd()) throw Json::out_of_range::create(401, "too few numbers", nullptr);
    return numbers_[next_++];
  }

  template <typename Matrix>
  Matrix TakeMatrix() {
    Matrix matrix;
    for (Eigen::Index i = 0; i < matrix.size(); ++i) matrix(i) = Take();
    return matrix;
  }

  template <typename Integer>
  Integer TakeAs() {
    return static_cast<Integer>(Take());
  }

 private:
  const std::vector<double> numbers_;
  size_t next_ = 0;
};

std::string Bytes(const Json& json) {
  std::string bytes;
  Json::to_cbor(json, bytes);
  return bytes;
}

// Calls parse(json); nothing where the bytes are of another form.
template <typename Parse>
auto Parsed(const std::string& bytes, Parse parse)
    -> std::optional<decltype(parse(std::declval<const Json&>()))> {
  try {
    return parse(Json::from_cbor(bytes));
  } catch (const nlohmann::json::exception& error) {
    spdlog::debug("what a stage left cannot be read: {}", error.what());
    return std::nullopt;
  }
}

Json DensePointsJson(const std::vector<DensePoint>& points) {
  std::vector<double> numbers;
  for (const DensePoint& point : points) {
    Append(point.p_world, &numbers);
    Append(point.normal_world, &numbers);
    numbers.insert(numbers.end(), {point.sigma_m, static_cast<double>(point.grey)});
  }
  return Packed(numbers);
}

std::vector<DensePoint> ParseDensePoints(const Json& json) {
  std::vector<DensePoint> points;
  for (NumberReader reader(json); !reader.AtEnd();) {
    DensePoint& point = points.emplace_back();
    point.p_world = reader.TakeMatrix<Eigen::Vector3d>();
    point.normal_world = reader.TakeMatrix<Eigen::Vector3d>();
    point.sigma_m = reader.Take();
    point.grey = reader.TakeAs<uint8_t>();
  }
  return points;
}

Json ViewRaysJson(const std::vector<ViewRays>& rays) {
  Json json = Json::array();
  for (const ViewRays& view : rays) {
    std::vector<double> centre;
    Append(view.p_world_camera, &centre);
    std::vector<float> points;
    for (const Eigen::Vector3f& p : view.p_world)
      points.insert(points.end(), {p.x(), p.y(), p.z()});
    json.push_back(
        {{"centre", Packed(centre)}, {"points", Packed(points)}, {"sigmas", Packed(view.sigma_m)}});
  }
  return json;
}

std::vector<ViewRays> ParseViewRays(const Json& json) {
  std::vector<ViewRays> rays;
  for (const Json& view : json) {
    ViewRays& seen = rays.emplace_back();
    seen.p_world_camera = NumberReader(view.at("centre")).TakeMatrix<Eigen::Vector3d>();
    const std::vector<float> points = Unpacked<float>(view.at("points"));
    for (size_t i = 0; i + 2 < points.size(); i += 3) {
      seen.p_world.emplace_back(points[i], points[i + 1], points[i + 2]);
    }
    seen.sigma_m = Unpacked<float>(view.at("sigmas"));
  }
  return rays;
}

Json LinesJson(const std::vector<MapLine>& lines) {
  std::vector<double> numbers;
  for (const MapLine& line : lines) {
    for (const auto number :
         {line.id, static_cast<int64_t>(line.segment), static_cast<int64_t>(line.axis),
          static_cast<int64_t>(line.world), static_cast<int64_t>(line.recent),
          static_cast<int64_t>(line.observations), static_cast<int64_t>(line.kind)}) {
      numbers.push_back(static_cast<double>(number));
    }
    Append(line.start_world, &numbers);
    Append(line.end_world, &numbers);
    numbers.insert(numbers.end(), {line.sigma_m, line.deviation_rad, line.deviation_sigma_rad,
                                   line.edge_probability});
  }
  return Packed(numbers);
}

std::vector<MapLine> ParseLines(const Json& json) {
  std::vector<MapLine> lines;
  for (NumberReader reader(json); !reader.AtEnd();) {
    MapLine& line = lines.emplace_back();
    line.id = reader.TakeAs<int64_t>();
    line.segment = reader.TakeAs<int>();
    line.axis = static_cast<LineAxis>(reader.TakeAs<int>());
    line.world = reader.TakeAs<int>();
    line.recent = reader.Take() != 0;
    line.observations = reader.TakeAs<int>();
    line.kind = static_cast<LineKind>(reader.TakeAs<int>());
    line.start_world = reader.TakeMatrix<Eigen::Vector3d>();
    line.end_world = reader.TakeMatrix<Eigen::Vector3d>();
    line.sigma_m = reader.Take();
    line.deviation_rad = reader.Take();
    line.deviation_sigma_rad = reader.Take();
    line.edge_probability = reader.Take();
  }
  return lines;
}

Json EvidenceJson(const LineEvidence& evidence) {
  std::vector<double> covariances, supports;
  std::vector<int64_t> stamps_ns;  // too large for a double
  for (const LineCovariance& covariance : evidence.covariances) {
    covariances.push_back(static_cast<double>(covariance.line_id));
    covariances.push_back(covariance.piece);
    for (const auto* m : {&covariance.start_m2, &covariance.end_m2, &covariance.start_end_m2}) {
      Append(*m, &covariances);
    }
  }
  for (const LineSupport& support : evidence.supports) {
    stamps_ns.push_back(support.stamp_ns);
    supports.push_back(static_cast<double>(support.line_id));
    supports.push_back(support.piece);
    supports.push_back(support.camera);
    Append(support.px.start, &supports);
    Append(support.px.end, &supports);
  }
  return {{"covariances", Packed(covariances)},
          {"supports", Packed(supports)},
          {"stamps_ns", Packed(stamps_ns)}};
}

LineEvidence ParseEvidence(const Json& json) {
  LineEvidence evidence;
  for (NumberReader reader(json.at("covariances")); !reader.AtEnd();) {
    LineCovariance& covariance = evidence.covariances.emplace_back();
    covariance.line_id = reader.TakeAs<int64_t>();
    covariance.piece = reader.TakeAs<int>();
    for (auto* m : {&covariance.start_m2, &covariance.end_m2, &covariance.start_end_m2}) {
      *m = reader.TakeMatrix<Eigen::Matrix3d>();
    }
  }
  const std::vector<int64_t> stamps_ns = Unpacked<int64_t>(json.at("stamps_ns"));
  NumberReader reader(json.at("supports"));
  for (const int64_t stamp_ns : stamps_ns) {
    LineSupport& support = evidence.supports.emplace_back();
    support.stamp_ns = stamp_ns;
    support.line_id = reader.TakeAs<int64_t>();
    support.piece = reader.TakeAs<int>();
    support.camera = reader.TakeAs<int>();
    support.px.start = reader.TakeMatrix<Eigen::Vector2d>();
    support.px.end = reader.TakeMatrix<Eigen::Vector2d>();
  }
  return evidence;
}

std::string PoseText(const RigidTransform& T) {
  const Eigen::Vector3d& p = T.translation;
  const Eigen::Quaterniond& q = T.rotation;
  return fmt::format("{} {} {} {} {} {} {}\n", p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w());
}

std::string RigText(const Rig& rig) {
  std::string text;
  for (size_t c = 0; c < rig.cameras.size(); ++c) {
    const Camera& camera = rig.cameras[c];
    const Eigen::Vector4d& k = camera.coefficients;
    text += fmt::format("{} {} {} {} {} {} {} {} {} {} {} ", static_cast<int>(camera.distortion),
                        camera.width_px, camera.height_px, camera.fx_px, camera.fy_px, camera.cx_px,
                        camera.cy_px, k[0], k[1], k[2], k[3]);
    if (!camera.higher_coefficients.isZero(0) || !camera.shape.isZero(0)) {
      text += fmt::format("{} {} {} ", fmt::join(camera.higher_coefficients, " "), camera.shape[0],
                          camera.shape[1]);
    }
    text += PoseText(rig.T_imu_camera[c]);
    for (const int run : CollectRuns(rig.masks[c])) text += fmt::format("{} ", run);
  }
  return text;
}

// Images are rectified with what was found of the cameras.
std::string CalibrationText(const OdometryRun& run) {
  std::string text = RigText(run.rectified_rig);
  if (run.source) text += RigText(run.source->raw_rig);
  if (run.calibration.empty()) return text;
  const CalibrationEstimate& found = run.calibration.back();
  const Eigen::Vector3d& turn = found.right_rotation_rad;
  const Eigen::Vector2d& centre_px = found.right_centre_px;
  return text + fmt::format("{} {} {} {} {} {} {}\n", turn.x(), turn.y(), turn.z(),
                            found.focal_length, centre_px.x(), centre_px.y(), found.time_offset_s);
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
  RunningChecksum checksum;
  for (const std::string& text : {run.id, images, options, program}) {
    checksum.Add(text + '\n');
  }
  checksum.Add(CalibrationText(run));
  for (const OnlineState& state : run.states) checksum.Add(PoseText(state.T_world_imu));
  for (const Keyframe& keyframe : run.keyframes) checksum.Add(PoseText(keyframe.T_world_imu));
  for (const ManhattanWorld& world : run.manhattan_worlds) {
    checksum.Add(fmt::format("{}\n", world.heading_rad));
  }
  return checksum.Text();
}

std::string PackDense(const MapResult& map, const std::vector<ViewRays>& rays,
                      const CountedWarnings& warnings) {
  return Bytes({{"dense", DensePointsJson(map.dense)},
                {"resolution_m", map.occupancy.resolution_m()},
                {"occupancy", Json::binary(map.occupancy.Nodes())},
                {"sights", ViewRaysJson(rays)},
                {"warnings", warnings}});
}

std::optional<DenseStage> UnpackDense(const std::string& bytes) {
  return Parsed(bytes, [](const Json& json) {
    const auto resolution_m = json.at("resolution_m").get<double>();
    return DenseStage{ParseDensePoints(json.at("dense")),
                      OccupancyMap::FromNodes(resolution_m, json.at("occupancy").get_binary()),
                      ParseViewRays(json.at("sights")), json.at("warnings").get<CountedWarnings>()};
  });
}

std::string PackLines(const LineStage& stage) {
  return Bytes({{"lines", LinesJson(stage.lines)},
                {"evidence", EvidenceJson(stage.evidence)},
                {"warnings", stage.warnings}});
}

std::optional<LineStage> UnpackLines(const std::string& bytes) {
  return Parsed(bytes, [](const Json& json) {
    return LineStage{ParseLines(json.at("lines")), ParseEvidence(json.at("evidence")),
                     json.at("warnings").get<CountedWarnings>()};
  });
}

}  // namespace slcmap::mapping
