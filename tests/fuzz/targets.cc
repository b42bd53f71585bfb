#include <spdlog/spdlog.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string_view>

#include "apps/evaluation/truth.h"
#include "data/calibration/calibration.h"
#include "data/calibration/other_calibrations.h"
#include "data/core/error.h"
#include "data/external/external_map.h"
#include "data/io/file.h"
#include "data/io/image.h"
#include "data/io/map_line.h"
#include "data/io/ply.h"
#include "data/io/trajectory.h"
#include "data/io/true_building.h"
#include "data/rig/profile.h"
#include "data/simulator/scene/scene.h"
#include "data/source/asl_files.h"
#include "export/export.h"
#include "mapping/map/building.h"
#include "mapping/map/map_folder.h"
#include "mapping/map/occupancy_map.h"
#include "mapping/mapping.h"
#include "mapping/options.h"
#include "mapping/plan/plan_files.h"
#include "odometry/options.h"
#include "odometry/run/run_folder.h"
#include "odometry/run/run_journal.h"
#include "odometry/run/run_json.h"
#include "tests/fuzz/target.h"
#include "tests/testing/made_building.h"
#include "tests/testing/made_run.h"
#include "tests/testing/temp_folder.h"

namespace slcmap::fuzz {
namespace {

namespace fs = std::filesystem;
using testing::TempFolder;
using Inputs = std::vector<std::string>;
using Read = std::function<void(const std::string& path)>;

// Reads, which may refuse what it reads, but only in this project's way: by an Error of one line.
void Refusing(const Read& read, const std::string& path) {
  try {
    read(path);
  } catch (const Error& error) {
    const std::string_view message = error.what();
    if (message.empty() || message.find('\n') != message.npos) {
      Finding("an error that is not one line", error.what());
    }
  } catch (const std::exception& error) {
    Finding("a foreign exception", error.what());
  }
}

// What `write` puts into a folder.
Inputs Written(const std::function<void(const TempFolder& folder)>& write) {
  const TempFolder folder;
  write(folder);
  return CollectFiles(folder.Path());
}

Inputs NoSeeds() { return {}; }

// The bytes as a file of that name, for each of the readers.
Target OfFile(const std::string& name, const std::string& file,
              const std::function<Inputs()>& seeds, const std::vector<Read>& readers) {
  const auto folder = std::make_shared<TempFolder>();
  return {name, seeds, [=](const std::string& bytes) {
            const std::string path = folder->Write(file, bytes);
            for (const Read& read : readers) Refusing(read, path);
          }};
}

// A folder of good files of which one is another: the input's first byte says which.
class GoodFolder {
 public:
  explicit GoodFolder(const Read& write) {
    write(folder_.Path());
    for (const auto& entry : fs::recursive_directory_iterator(folder_.Path())) {
      if (!entry.is_regular_file()) continue;
      names_.push_back(fs::relative(entry.path(), folder_.Path()).string());
    }
    std::sort(names_.begin(), names_.end());
    for (const std::string& name : names_) contents_.push_back(ReadFile(folder_.Path(name)));
  }

  Inputs Seeds() const {
    Inputs seeds;
    for (size_t i = 0; i < names_.size(); ++i) seeds.push_back(static_cast<char>(i) + contents_[i]);
    return seeds;
  }

  void Run(const std::string& bytes, const Read& read) const {
    if (bytes.empty()) return;
    const size_t file = static_cast<uint8_t>(bytes[0]) % names_.size();
    folder_.Write(names_[file], bytes.substr(1));
    Refusing(read, folder_.Path());
    folder_.Write(names_[file], contents_[file]);
  }

 private:
  TempFolder folder_;
  Inputs names_, contents_;
};

// `write` fills the folder; it is made when it is asked for.
Target OfFolder(const std::string& name, const Read& write, const std::vector<Read>& readers) {
  const auto made = std::make_shared<std::unique_ptr<GoodFolder>>();
  const auto folder = [=]() -> const GoodFolder& {
    if (!*made) *made = std::make_unique<GoodFolder>(write);
    return **made;
  };
  return {name, [=] { return folder().Seeds(); },
          [=](const std::string& bytes) {
            for (const Read& read : readers) folder().Run(bytes, read);
          }};
}

// ASL's sensor.yaml, as that of every sensor.
void ReadAsEverySensor(const std::string& bytes) {
  static const TempFolder folder;
  for (const char* sensor : {"cam0", "cam1", "imu0"}) {
    folder.Write(std::string("mav0/") + sensor + "/sensor.yaml", bytes);
  }
  Warnings warnings;
  Refusing([&](const std::string& path) { ReadAslCalibration(path, &warnings); },
           folder.Path("mav0"));
}

Inputs Images() {
  cv::Mat image(12, 16, CV_8U);
  cv::randu(image, 0, 255);
  Inputs seeds;
  for (const char* ending : {".jpg", ".tiff", ".bmp"}) {
    std::vector<uint8_t> bytes;
    cv::imencode(ending, image, bytes);
    seeds.emplace_back(bytes.begin(), bytes.end());
  }
  return seeds;
}

void ReadDeferred(const std::string& path) {
  const DeferredImageRead read = ReadGrayImageDeferred(*FileImages(), path, {16, 12});
  if (read.decode) read.decode();
}

void WritePipes(const TempFolder& folder) {
  std::vector<TruePipe> pipes(3);
  for (size_t i = 0; i < pipes.size(); ++i) {
    pipes[i].id = static_cast<int64_t>(i);
    pipes[i].start_world.x() = 0.5 * static_cast<double>(i);
    pipes[i].end_world = pipes[i].start_world + Eigen::Vector3d(0, 0, 3);
    pipes[i].radius_m = 0.05;
  }
  pipes[0].seen = {{0, 1.5}, {2, 2.5}};
  pipes[1].seen = {{0.25, 3}};
  WriteTruePipes(folder.Path("pipes.csv"), pipes);
}

void WriteRoomSurfaces(const TempFolder& folder) {
  PlyElement vertices{"vertex", {}};
  for (const char* name : {"x", "y", "z"}) vertices.Add(name, PlyType::kFloat);
  for (const double z : {0, 3}) {
    for (const auto& [x, y] : {std::pair{0, 0}, {4, 0}, {4, 4}, {0, 4}}) {
      vertices.AppendRow({static_cast<double>(x), static_cast<double>(y), z});
    }
  }
  WritePly(folder.Path("room.ply"),
           {{}, {vertices}, {{0, 1, 2, 3}, {4, 5, 6, 7}, {0, 1, 5, 4}, {2, 3, 7}}});
}

void WriteOctrees(const TempFolder& folder) {
  for (const double size_m : {0.4, 3.0}) {
    OccupancyMap map(0.1);
    map.Insert({{{0, 0, 0}, {{size_m, 0, 0}, {size_m, 1, 0}, {size_m, 1, 1}}}}, 10);
    map.Write(folder.Path(std::to_string(size_m) + ".bt"));
  }
}

Inputs RunJsonFiles() {
  const TempFolder folder;
  WriteRunFolder(folder.Path(), testing::MakeLineRun());
  Inputs seeds;
  for (const char* name : {"run.json", "rig.json", "timings.json"}) {
    seeds.push_back(ReadFile(folder.Path(name)));
  }
  return seeds;
}

void WriteRun(const std::string& folder) {
  OdometryRun run = testing::MakeLineRun();
  run.source = testing::MakeSource(run);
  WriteRunFolder(folder, run);
}

// The journal of a run that was ended, half of which has left the window.
void WriteJournal(const std::string& folder) {
  spdlog::set_level(spdlog::level::off);  // of what is left out where changes are accepted
  OdometryRun window = testing::MakeLineRun(), finished;
  window.source = testing::MakeSource(window);
  window.warnings = {{"images_missing", 5}};
  window.line_deviation_rad = 0.002;
  window.figures.points_rejected = {0.1, 0.2, 30};
  window.sloped_directions = {{0, 0.25, 0.5, 0.001, 0.002, 7, false}};
  window.line_merges = {{900, 103}};
  window.calibration.push_back({window.keyframes[4].stamp_ns, 0, 0.001});
  RunJournal journal(folder, window);
  finished.states = std::move(window.states);
  finished.imu = {{1, {1, 2, 3}, {4, 5, 6}}, {2, {1, 2, 3}, {4, 5, 6}}};
  finished.keyframes = {window.keyframes[0], window.keyframes[1]};
  finished.landmarks = {window.landmarks[0]};
  finished.manhattan_worlds = window.manhattan_worlds;
  finished.lines = {window.lines[0], window.lines[22]};
  journal.Append(finished);
  journal.SetWindow(window);
}

void WriteMap(const std::string& folder) {
  MappingOptions options;
  options.occupancy.resolution_m = 0.5;
  MapResult map = MapRun(testing::MakeLineRun(), nullptr, options);
  map.building = testing::MakeBuilding(2);
  map.pipes.emplace_back();
  map.pipes[0].end_world = {0, 0, 2};
  map.pipes[0].radius_m = 0.05;
  const int64_t first_ns = map.trajectory.front().stamp_ns;
  const int64_t last_ns = map.trajectory.back().stamp_ns;
  map.source.merged = {{"", "a", "0.1.0", 0, {}, StampSpan{first_ns, last_ns - 1}},
                       {"b", "b", "0.1.0", 5, {}, StampSpan{last_ns, last_ns}}};
  WriteMapFolder(folder, map);
}

Inputs BuildingJsonFiles() {
  const TempFolder folder;
  WriteBuilding(folder.Path(), testing::MakeBuilding(2));
  WriteTrueBuilding(folder.Path("building.json"), {});
  Inputs seeds;
  for (const std::string& name : BuildingFiles()) seeds.push_back(ReadFile(folder.Path(name)));
  seeds.push_back(ReadFile(folder.Path("building.json")));
  return seeds;
}

// As each of a building's files.
void ReadAsBuilding(const std::string& path) {
  const std::string bytes = ReadFile(path);
  for (const std::string& name : BuildingFiles()) {
    const TempFolder folder;
    WriteBuilding(folder.Path(), testing::MakeBuilding(2));
    folder.Write(name, bytes);
    Refusing([](const std::string& whole) { ReadBuilding(whole); }, folder.Path());
  }
}

// One of each other program's, short.
Inputs OtherCalibrations() {
  const std::string matrix =
      "\n   rows: 4\n   cols: 4\n   dt: f\n   data: [1, 0, 0, 0.1, 0, 1, 0, 0, "
      "0, 0, 1, 0, 0, 0, 0, 1]\n";
  const std::string camera = "fx: 400\n   fy: 400\n   cx: 320\n   cy: 240\n";
  const std::string size = "image_width: 640\nimage_height: 480\n";
  const std::string pose = R"({"px": 0, "py": 0, "pz": 0, "qx": 0, "qy": 0, "qz": 0, "qw": 1})";
  return {
      "Camera.type: PinHole\nCamera1.fx: 400\nCamera1.fy: 400\nCamera1.cx: 320\nCamera1.cy: 240\n"
      "Camera.width: 640\nCamera.height: 480\nIMU.T_b_c1: !!opencv-matrix" +
          matrix,
      "model_type: PINHOLE\n" + size +
          "distortion_parameters:\n   k1: 0.1\n   k2: 0\n   p1: 0\n"
          "   p2: 0\nprojection_parameters:\n   " +
          camera + "body_T_cam0: !!opencv-matrix" + matrix + "td: 0.01\n",
      R"({"value0": {"T_imu_cam": [)" + pose +
          R"(], "intrinsics": [{"camera_type": "ds", "intrinsics": {"fx": 300, "fy": 300,
 "cx": 320, "cy": 240, "xi": -0.2, "alpha": 0.6}}], "resolution": [[640, 480]]}})",
      size +
          "distortion_model: plumb_bob\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: [400, 0, "
          "320, 0, 400, 240, 0, 0, 1]\ndistortion_coefficients:\n  data: [0.1, 0, 0, 0, 0]\n"
          "rectification_matrix:\n  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]\nprojection_matrix:\n"
          "  data: [400, 0, 320, 0, 0, 400, 240, 0, 0, 0, 1, 0]\n",
      "cam0:\n  T_imu_cam: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n"};
}

// What a map is exported as that plans and maps by others are read from.
const Inputs& MakeExports(const std::string& format) {
  static std::map<std::string, Inputs> of_format;
  Inputs& exports = of_format[format];
  if (!exports.empty()) return exports;
  const TempFolder folder;
  MapResult map = MapRun(testing::MakeLineRun(), nullptr, {});
  map.building = testing::MakeBuilding(2);
  ExportOptions options;
  options.formats = {format};
  for (const std::string& path : ExportMap(map, folder.Path("export"), options)) {
    if (fs::path(path).extension() == "." + format) exports.push_back(ReadFile(path));
  }
  return exports;
}

Target OfExports(const std::string& name, const std::string& format, const Read& read) {
  return OfFile(name + "_" + format, "file." + format, [=] { return MakeExports(format); }, {read});
}

// Rows as others write maps: of points, of segments, of a marker, a cloud of PCL.
Inputs TextMaps() {
  return {"1 2 3\n4 5 6.5\n7 8 9\n", "x1,y1,z1,x2,y2,z2\n1,2,3,4,5,6.5\n",
          "1\n0 2 2\n1 2 3\n4 5 6.5\n0 1 \n3 4 \n",
          "scale:\n  x: 0.03\npoints:\n- x: 1.0\n  y: 2.0\n  z: 3.0\n- x: 4.0\n  y: 5.0\n  z: "
          "6.5\ncolors: []\n---\n",
          "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\n"
          "HEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA ascii\n1 2 3\n4 5 6\n"};
}

std::vector<Target> MapTargets() {
  const Read read_plan = [](const auto& path) { ReadPlans(path, 0); };
  const Read read_map = [](const auto& path) { ReadExternalMap(path); };
  return {OfExports("plan", "dxf", read_plan),
          OfExports("plan", "ifc", read_plan),
          OfExports("plan", "geojson", read_plan),
          OfExports("external_map", "dxf", read_map),
          OfExports("external_map", "obj", read_map),
          OfExports("external_map", "las", read_map),
          OfFile("external_map_text", "map.txt", TextMaps, {read_map})};
}

std::vector<Target> DataTargets() {
  const auto warnings = std::make_shared<Warnings>();  // nobody looks at them
  const auto rigs = [] { return CollectFiles(SLCMAP_SOURCE_DIR "/config/rigs"); };
  const auto scenes = [] { return CollectFiles(SLCMAP_SOURCE_DIR "/config/scenes"); };
  return {
      OfFile("options", "options.yaml", NoSeeds,
             {[](const auto& path) { OdometryOptions::FromYaml(path).Check(); },
              [](const auto& path) { MappingOptions::FromYaml(path).Check(); }}),
      OfFile("kalibr_calibration", "camchain.yaml", rigs,
             {[=](const auto& path) { ReadKalibrCalibration(path, path, warnings.get()); },
              [=](const auto& path) { ReadCalibration(path, warnings.get()); }}),
      OfFile("other_calibration", "calibration.yaml", OtherCalibrations,
             {[=](const auto& path) { ReadRigParts({path}, Mirrored::kRefused, warnings.get()); },
              [=](const auto& path) { ReadCalibration(path, warnings.get()); }}),
      OfFile("profile", "profile.yaml",
             [] { return CollectFiles(SLCMAP_SOURCE_DIR "/config/profiles"); },
             {[](const auto& path) { ReadProfile(path); }}),
      {"asl_calibration", NoSeeds, ReadAsEverySensor},
      OfFile(
          "asl_tables", "cam0/data.csv", NoSeeds,
          {[=](const auto& path) { ReadAslImages(fs::path(path).parent_path(), warnings.get()); },
           [=](const auto& path) { ReadAslImu(path, warnings.get()); }}),
      OfFile("trajectory", "trajectory.txt", NoSeeds,
             {[](const auto& path) { ReadTrajectory(path); }}),
      OfFile("image", "image", Images,
             {[](const auto& path) {
                ReadGrayImage(path, {16, 12});
              },
              ReadDeferred}),
      OfFile("ply", "lines.ply", NoSeeds,
             {[](const auto& path) { Positions(ReadPly(path).Get("vertex", path), path); },
              [](const auto& path) { ReadMapLines(path); }}),
      OfFile("scene", "scene.yaml", scenes, {[](const auto& path) { ReadScene(path); }})};
}

}  // namespace

std::vector<Target> Targets() {
  std::vector<Target> targets = DataTargets();
  const Target more[] = {
      OfFile("true_edges", "edges.csv", NoSeeds, {[](const auto& path) { ReadTrueEdges(path); }}),
      OfFile("true_pipes", "pipes.csv", [] { return Written(WritePipes); },
             {[](const auto& path) { ReadTruePipes(path); }}),
      OfFile("surfaces", "surfaces.ply", [] { return Written(WriteRoomSurfaces); },
             {[](const auto& path) { ReadSurfaces(path); }}),
      OfFile(
          "run_json", "run.json", RunJsonFiles,
          {[](const auto& path) {
             OdometryRun run;
             ReadRunSummary(path, &run);
           },
           [](const auto& path) { ReadRig(path); }, [](const auto& path) { ReadTimings(path); }}),
      OfFolder("run_folder", WriteRun, {[](const auto& path) { ReadRunFolder(path); }}),
      // As changes are accepted, too: otherwise the checksums refuse most of what is read.
      OfFolder("journal", WriteJournal,
               {[](const auto& path) { ReadRunFolder(path, {.accept_changed = false}); },
                [](const auto& path) { ReadRunFolder(path, {.accept_changed = true}); }}),
      OfFolder("map_folder", WriteMap, {[](const auto& path) { ReadMapFolder(path); }}),
      OfFile("occupancy", "occupancy.bt", [] { return Written(WriteOctrees); },
             {[](const auto& path) { OccupancyMap::Read(path).OccupiedVoxels(); }}),
      OfFile("building", "building.json", BuildingJsonFiles,
             {[](const auto& path) { ReadTrueBuilding(path); }, ReadAsBuilding})};
  targets.insert(targets.end(), std::begin(more), std::end(more));
  for (Target& target : MapTargets()) targets.push_back(std::move(target));
  return targets;
}

std::vector<std::string> CollectFiles(const std::string& folder) {
  std::vector<std::string> paths, files;
  for (const auto& entry : fs::directory_iterator(folder)) paths.push_back(entry.path().string());
  std::sort(paths.begin(), paths.end());
  for (const std::string& path : paths) files.push_back(ReadFile(path));
  return files;
}

void Finding(const char* what, const char* message) {
  std::fprintf(stderr, "finding: %s: '%s'\n", what, message);
  std::abort();
}

}  // namespace slcmap::fuzz
