#include "export/export.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>
#include <tiny_gltf.h>

#include <filesystem>
#include <sstream>

#include "data/core/error.h"
#include "data/io/file.h"
#include "data/io/ply.h"
#include "export/scene/scene.h"
#include "mapping/mapping.h"
#include "tests/export/web/room_map.h"
#include "tests/testing/file_size_limit.h"
#include "tests/testing/made_run.h"
#include "tests/testing/reader_program.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::ThrowsMessage;
using ::testing::UnorderedElementsAre;

// clang-format off
const char* const kFiles[] = {
    "scene.glb", "points.ply", "lines.ply", "trajectory.ply", "keyframes.ply", "voxels.ply",
    "line_bars.ply", "plan.pdf", "plan/no_storey.svg", "plan.dxf", "map.dxf", "map.obj",
    "map.mtl", "map.ifc", "colmap/cameras.txt", "colmap/images.txt", "colmap/points3D.txt",
    "limap/alltracks.txt", "limap/lines.txt", "grid/no_storey.pgm", "grid/no_storey.yaml",
    "points.pcd", "dense.pcd", "dense.ply", "occupancy.bt", "cloud.las", "cloud.e57",
    "plan.gpkg", "plan/no_storey.geojson", "tiles/tileset.json"};
// clang-format on

ExportOptions OfFormats(const std::vector<std::string>& formats) {
  ExportOptions options;
  options.formats = formats;
  return options;
}

// What is logged while it is exported.
std::string LogOfExport(const MapResult& map, const std::string& folder,
                        const std::vector<std::string>& formats) {
  std::ostringstream log;
  const auto before = spdlog::default_logger();
  spdlog::set_default_logger(
      std::make_shared<spdlog::logger>("", std::make_shared<spdlog::sinks::ostream_sink_st>(log)));
  ExportMap(map, folder, OfFormats(formats));
  spdlog::set_default_logger(before);
  return log.str();
}

MapResult MakeMap() {
  MapResult map = MapRun(testing::MakeWallRun(), nullptr, {});
  map.lines = {{0, 0, LineAxis::kX, 0, 0, true, {0, 0, 0}, {1, 2.5, 3}}};
  return map;
}

class ExportTest : public ::testing::Test {
 protected:
  std::string Path(const std::string& name) const { return folder_ + "/" + name; }

  tinygltf::Model ReadGltf() const {
    tinygltf::Model model;
    std::string error, warning;
    EXPECT_TRUE(
        tinygltf::TinyGLTF().LoadBinaryFromFile(&model, &error, &warning, Path("scene.glb")))
        << error;
    EXPECT_EQ(warning, "");
    return model;
  }

  testing::TempFolder temp_;
  const std::string folder_ = temp_.Path("made/export");
};

// The number of values that the mesh of that name is drawn from.
std::size_t CountDrawn(const tinygltf::Model& model, const std::string& name) {
  for (const tinygltf::Mesh& mesh : model.meshes) {
    if (mesh.name != name) continue;
    const tinygltf::Primitive& primitive = mesh.primitives[0];
    const int accessor =
        primitive.indices >= 0 ? primitive.indices : primitive.attributes.at("POSITION");
    return model.accessors[static_cast<std::size_t>(accessor)].count;
  }
  return 0;
}

TEST_F(ExportTest, TheLogTellsWhatFilesCannotHold) {
  MapResult map = MakeMap();
  map.building = {};
  EXPECT_THAT(LogOfExport(map, Path("near"), {"limap"}), Not(HasSubstr("world_offset_m")));
  map.source.georeference = Georeference{"", {451200, 5411300, 312}};
  EXPECT_THAT(LogOfExport(map, Path("far"), {"limap", "cloud"}),
              HasSubstr("which export.json says: world_offset_m 451200 5411300 312"));
  EXPECT_THAT(LogOfExport(map, Path("obj"), {"obj"}), Not(HasSubstr("world_offset_m")));
  map.building.storeys = {{0, 0, 2.5}};
  EXPECT_THAT(LogOfExport(map, Path("plan"), {"svg", "pdf"}), HasSubstr("no wall was found"));
  EXPECT_THAT(LogOfExport(map, Path("obj"), {"obj"}), Not(HasSubstr("no wall")));
}

TEST_F(ExportTest, AllFormatsAreWrittenOrThoseThatAreWanted) {
  const std::vector<std::string> paths = ExportMap(MakeMap(), folder_, {});
  EXPECT_EQ(paths.size(), std::size(kFiles));
  for (const char* name : kFiles) EXPECT_TRUE(std::filesystem::exists(Path(name))) << name;
  for (const char* name : {"lines/0.glb", "points/0_0_0_0.glb", "points/0_0_0_0.subtree"}) {
    EXPECT_TRUE(std::filesystem::exists(Path(std::string("tiles/") + name))) << name;
  }
  EXPECT_THAT(ExportMap(MakeMap(), folder_, OfFormats({"glb"})),
              UnorderedElementsAre(Path("scene.glb")));
  EXPECT_FALSE(std::filesystem::exists(Path("points.ply"))) << "files of another export";
  EXPECT_THAT(
      [&] { ExportMap(MakeMap(), folder_, OfFormats({"step"})); },
      ThrowsMessage<ConfigError>(HasSubstr("found 'step', expected one of glb, ply, cloud, svg")));
}

TEST_F(ExportTest, FilesSayWhereAMapOfFarPosesLies) {
  MapResult map = MakeMap();
  map.source.georeference = Georeference{"", {451200, 5411300, 312}};
  ExportMap(map, folder_, {});
  for (const char* name : {"points.ply", "lines.ply", "dense.ply", "plan.dxf", "map.dxf", "map.obj",
                           "plan/no_storey.svg", "colmap/images.txt", "grid/no_storey.yaml"}) {
    EXPECT_THAT(ReadFile(Path(name)), HasSubstr("world_offset_m 451200 5411300 312")) << name;
  }
  EXPECT_THAT(ReadFile(Path("scene.glb")), HasSubstr("\"origin_m\""));
  EXPECT_THAT(ReadFile(Path("map.ifc")), HasSubstr("451200.,5411300.,312."));
  EXPECT_EQ(ExportSourceIn(folder_).georeference->origin_m, map.source.georeference->origin_m);
}

TEST_F(ExportTest, FilesSayWhereATurnedMapLies) {
  MapResult map = MakeMap();
  map.source.georeference = Georeference{"EPSG:25832", {691607.25, 5334760.5, 515}, 0.5, 0.99997};
  const Eigen::Vector3d p(3, 4, 1), before = *map.source.georeference * p;
  ExportMap(map, folder_, {});
  for (const char* name : {"points.ply", "plan.dxf", "map.dxf", "map.obj", "colmap/images.txt"}) {
    EXPECT_THAT(ReadFile(Path(name)),
                HasSubstr("EPSG:25832 origin_m 691607.2500 5334760.5000 515.0000 turn_deg "))
        << name;
  }
  // The frame of the export is turned along the walls: the same point is at the same place.
  const Georeference place = *ExportSourceIn(folder_).georeference;
  EXPECT_LT((place * (FrameOfExports(map) * p) - before).norm(), 1e-6);
  const std::string ifc = ReadFile(Path("map.ifc"));
  EXPECT_THAT(ifc, HasSubstr("IFCPROJECTEDCRS('EPSG:25832','ETRS89 / UTM zone 32N'"));
  EXPECT_THAT(ifc, HasSubstr(",691607.25,5334760.5,515.,"));
  EXPECT_THAT(ifc, HasSubstr(",0.99997)"));
  EXPECT_THAT(ReadFile(Path("scene.glb")), HasSubstr("\"crs\":\"EPSG:25832\""));
}

TEST_F(ExportTest, AnExportThatIsEndedLeavesTheEarlierOne) {
  ExportMap(MakeMap(), folder_, {});
  const std::string before = ReadFile(Path("scene.glb"));
  int reports = 0;
  const auto count = [&](double) {
    ++reports;
    return true;
  };
  ExportMap(MakeMap(), folder_, {}, Progress(count));
  EXPECT_GT(reports, 10);
  const int all = reports;
  MapResult map = MakeMap();
  map.points[0].p_world.z() += 1;
  for (const int last : {0, all / 2, all - 1}) {
    reports = 0;
    const Progress stop([&](double) { return reports++ < last; });
    EXPECT_THROW(ExportMap(map, folder_, {}, stop), StoppedError) << last;
    EXPECT_TRUE(ReadFile(Path("scene.glb")) == before);
    EXPECT_FALSE(std::filesystem::exists(Path(".unfinished")));
  }
}

TEST_F(ExportTest, FilesOfOthersInItsFoldersStay) {
  ExportMap(MakeMap(), folder_, OfFormats({"glb", "colmap"}));
  const std::string others = temp_.Write("made/export/colmap/database.db", "of the user");
  EXPECT_THAT(
      [&] {
        ExportMap(MakeMap(), folder_, OfFormats({"glb", "colmap"}));
      },
      ThrowsMessage<ConfigError>(HasSubstr("found colmap/database.db")));
  EXPECT_TRUE(std::filesystem::exists(Path("colmap/cameras.txt")));
  ExportMap(MakeMap(), folder_, OfFormats({"glb"}));
  EXPECT_EQ(ReadFile(others), "of the user");
  EXPECT_FALSE(std::filesystem::exists(Path("colmap/cameras.txt")));
}

TEST_F(ExportTest, GltfHoldsTheLayers) {
  const MapResult map = MakeMap();
  ExportMap(map, folder_, {});
  const tinygltf::Model model = ReadGltf();
  EXPECT_EQ(CountDrawn(model, "points"), map.points.size());
  EXPECT_EQ(CountDrawn(model, "lines/along x"), 2u);
  EXPECT_EQ(CountDrawn(model, "trajectory"), 2u * 50);
  EXPECT_EQ(CountDrawn(model, "voxels"), 0u);
  EXPECT_THAT(model.extensionsUsed, UnorderedElementsAre("KHR_materials_unlit"));
  EXPECT_EQ(model.nodes[0].children.size(), 4u);
  // Up is turned to y.
  const std::vector<double> q = model.nodes[0].rotation;
  const Eigen::Quaterniond rotation(q[3], q[0], q[1], q[2]);
  EXPECT_LT((rotation * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitY()).norm(), 1e-9);
  EXPECT_LT((rotation * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitX()).norm(), 1e-9);
  ExportOptions options = OfFormats({"glb"});
  options.gltf.voxels = true;
  ExportMap(map, folder_, options);
  EXPECT_EQ(CountDrawn(ReadGltf(), "voxels"), 3 * MakeScene(map).voxels.triangles.size());
}

TEST_F(ExportTest, GltfHoldsPositionsAndLinearColours) {
  MapResult map;
  map.lines = {{0, 0, LineAxis::kX, 0, 0, true, {0.5, 0, 0}, {1, 2.5, 3}}};
  ExportMap(map, folder_, OfFormats({"glb"}));
  const tinygltf::Model model = ReadGltf();
  const auto& attributes = model.meshes[0].primitives[0].attributes;
  const auto data_of = [&](const char* name) {
    const auto& accessor = model.accessors[static_cast<std::size_t>(attributes.at(name))];
    return model.buffers[0].data.data() +
           model.bufferViews[static_cast<std::size_t>(accessor.bufferView)].byteOffset;
  };
  float positions[6];
  std::memcpy(positions, data_of("POSITION"), sizeof positions);
  EXPECT_THAT(positions, ::testing::ElementsAre(0.5f, 0, 0, 1, 2.5f, 3));
  const unsigned char* colour = data_of("COLOR_0");
  EXPECT_THAT(std::vector<int>(colour, colour + 4), ::testing::ElementsAre(255, 26, 20, 255));
}

TEST_F(ExportTest, PlyFilesAreTextOnRequest) {
  MapResult map = MakeMap();
  map.lines[0].end_world = {123.4567, -98.7654, 12.3456};
  map.dense = {{{123.4567, 0, 1}, {0, 0, 1}, 0.01}};
  ExportOptions options;
  options.ascii_ply = true;
  for (const std::string& path : ExportMap(map, folder_, options)) {
    if (!path.ends_with(".ply")) continue;
    EXPECT_THAT(ReadFile(path), ::testing::StartsWith("ply\nformat ascii 1.0\n")) << path;
    ReadPly(path);
  }
  EXPECT_LT((ReadLinesPly(Path("lines.ply")).at(0).end_world - map.lines[0].end_world).norm(),
            1e-4);
  EXPECT_NEAR(ReadPly(Path("dense.ply")).Get("vertex", "").Get("x", "").values[0], 123.4567, 1e-4);
  EXPECT_NEAR(ReadPly(Path("points.ply")).Get("vertex", "").Get("x", "").values[5],
              map.points[5].p_world.x(), 1e-6);
}

TEST_F(ExportTest, AnEmptyMapReplacesTheFilesOfAnEarlierOne) {
  ExportMap(MakeMap(), folder_, {});
  ExportMap(MapResult(), folder_, {});
  EXPECT_TRUE(ReadGltf().meshes.empty());
  EXPECT_EQ(ReadPly(Path("points.ply")).Get("vertex", "").size(), 0u);
  EXPECT_TRUE(ReadLinesPly(Path("trajectory.ply")).empty());
}

TEST_F(ExportTest, FilesSayOfWhichMapTheyAre) {
  MapResult map = MakeMap();
  map.id = "0123456789abcdef";
  map.source.run_id = "fedcba9876543210";
  ExportMap(map, folder_, OfFormats({"glb", "ply"}));
  EXPECT_THAT(ReadPly(Path("points.ply")).comments,
              ::testing::Contains("map 0123456789abcdef of run fedcba9876543210"));
  const tinygltf::Value extras = ReadGltf().asset.extras;
  EXPECT_EQ(extras.Get("map").Get<std::string>(), map.id);
  EXPECT_EQ(extras.Get("run").Get<std::string>(), map.source.run_id);
  EXPECT_THAT(ReadFile(Path("export.json")), HasSubstr("\"map\": \"0123456789abcdef\""));
}

TEST_F(ExportTest, ItsSummarySaysWhereTheRunsOfAMergedMapAre) {
  MapResult map = MakeMap();
  map.source.run_id = "monday";
  map.source.T_world_run.rotation = ExpRotation({0, 0, 0.2});
  MergedRun first, second;
  first.run_id = "monday";
  first.T_world_run = map.source.T_world_run;
  second.run_id = "tuesday";
  second.T_world_run = {ExpRotation({0, 0, -0.5}), {1, 2, 3}};
  map.source.merged = {first, second};
  ExportMap(map, folder_, OfFormats({"glb"}));
  const MapSource source = ExportSourceIn(folder_);
  ASSERT_EQ(source.merged.size(), 2u);
  EXPECT_EQ(source.merged[1].run_id, "tuesday");
  EXPECT_LT((source.merged[1].T_world_run.translation - Eigen::Vector3d(1, 2, 3)).norm(), 1e-9);
  EXPECT_NEAR(LogRotation(source.merged[1].T_world_run.rotation).z(), -0.5, 1e-9);
  map.source.merged.clear();
  ExportMap(map, folder_, OfFormats({"glb"}));
  EXPECT_TRUE(ExportSourceIn(folder_).merged.empty());
}

TEST_F(ExportTest, TheSameMapGivesTheSameBytes) {
  ExportMap(MakeMap(), folder_ + "/a", {});
  ExportMap(MakeMap(), folder_ + "/b", {});
  for (const std::string name : kFiles) {
    EXPECT_EQ(ReadFile(Path("a/" + name)), ReadFile(Path("b/" + name))) << name;
  }
}

TEST_F(ExportTest, AFullDiskNamesTheFileAndLeavesTheOldExport) {
  ExportMap(MapResult(), folder_, {});
  const std::string before = ReadFile(Path("scene.glb"));
  {
    const testing::FileSizeLimit full(1000);
    EXPECT_THAT([&] { ExportMap(MakeMap(), folder_, {}); },
                ThrowsMessage<OutputError>(HasSubstr("scene.glb: cannot be written")));
  }
  EXPECT_EQ(ReadFile(Path("scene.glb")), before);
}

// Binary and as text.
TEST_F(ExportTest, Open3dReadsThePlyFiles) {
  const std::string python = "/usr/bin/python3";  // that for which Debian has packages
  int status = 0;
  testing::OutputOf(python + " -c 'import open3d'", &status);
  if (status != 0) GTEST_SKIP() << "Open3D is not here: tests/install_readers.sh";
  const std::pair<std::string, std::string> kFound[] = {
      {"points.ply", " 4 101.500 202.500 1.000 102.250 202.500 1.000 coloured"},
      {"dense.ply", " 400 100.0"},
      {"lines.ply", " 12 100.000 200.000 0.000 104.000 205.000 2.600"},
      {"trajectory.ply", " 19 101.000 202.500"},
      {"voxels.ply", " 12 103.000 204.000 0.000 103.100 204.100 0.100 coloured"},
      {"line_bars.ply", " 144 "}};
  std::string paths;
  for (const std::string form : {"binary", "ascii"}) {
    ExportOptions options = OfFormats({"ply", "cloud"});
    options.ascii_ply = form == "ascii";
    ExportMap(testing::MakeRoomMap(), Path(form), options);
    for (const auto& [file, found] : kFound) paths += " " + Path(form + "/" + file);
  }
  const std::string read =
      testing::OutputOf(python + " " SLCMAP_SOURCE_DIR "/tests/readers/read_ply.py" + paths);
  for (const std::string form : {"binary/", "ascii/"}) {
    for (const auto& [file, found] : kFound) EXPECT_THAT(read, HasSubstr(form + file + found));
  }
}

}  // namespace
}  // namespace slcmap
