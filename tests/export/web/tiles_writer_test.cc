#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tiny_gltf.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <map>
#include <random>
#include <set>

#include "data/core/error.h"
#include "data/core/math.h"
#include "data/io/json.h"
#include "export/scene/formats.h"
#include "export/web/cloud_tiles.h"
#include "export/web/page_writer.h"
#include "tests/export/web/glb_positions.h"
#include "tests/export/web/room_map.h"
#include "tests/testing/node_reader.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;
using testing::MessageOf;
using testing::TempFolder;

tinygltf::Model LoadGlb(const std::string& path) {
  tinygltf::Model model;
  std::string error, warning;
  EXPECT_TRUE(tinygltf::TinyGLTF().LoadBinaryFromFile(&model, &error, &warning, path)) << error;
  return model;
}

// The points of a tile, z up.
std::vector<Vector3d> PointsOfGlb(const std::string& path) {
  const tinygltf::Model model = LoadGlb(path);
  std::vector<Vector3d> points;
  for (const tinygltf::Node& node : model.nodes) {
    if (node.mesh < 0) continue;
    const std::vector<Vector3d> of_node = testing::ReadPositions(model, node);
    points.insert(points.end(), of_node.begin(), of_node.end());
  }
  return points;
}

// Points on the floor and a wall of a hall, always the same.
std::vector<Vector3d> HallPoints(int count) {
  std::mt19937 generator(7);
  const auto share = [&] { return static_cast<double>(generator()) / generator.max(); };
  std::vector<Vector3d> points;
  for (int i = 0; i < count; ++i) {
    const double u = share(), v = share();
    points.push_back(i % 2 ? Vector3d(40 * u, 15 * v, 0) : Vector3d(40 * u, 0, 4 * v));
  }
  return points;
}

PointsToTile Cloud(const std::vector<Vector3d>& points) {
  return {"dense", points.size(), [&points](std::size_t i) { return points[i]; },
          [](std::size_t i) {
            return Colour{static_cast<uint8_t>(i), 0, 0};
          }};
}

// The place of a tile by its file's name.
struct Place {
  int level = 0, x = 0, y = 0, z = 0;
  auto operator<=>(const Place&) const = default;
};

Place PlaceIn(const std::filesystem::path& path) {
  Place place;
  EXPECT_EQ(
      std::sscanf(path.stem().c_str(), "%d_%d_%d_%d", &place.level, &place.x, &place.y, &place.z),
      4)
      << path;
  return place;
}

Eigen::AlignedBox3d BoxIn(const Json& volume) {
  const auto box = volume.at("box").get<std::vector<double>>();
  const Vector3d centre(box[0], box[1], box[2]), half(box[3], box[7], box[11]);
  return {centre - half, centre + half};
}

class CloudTiles : public ::testing::Test {
 protected:
  void Write(const std::vector<Vector3d>& points) {
    root_ = WriteCloudTiles(folder_.Path(), Cloud(points), &paths_).json;
  }

  // The box of an implicit tile.
  Eigen::AlignedBox3d BoxAt(const Place& place) const {
    const Eigen::AlignedBox3d root = BoxIn(root_.at("boundingVolume"));
    const Vector3d size = root.sizes() / std::exp2(place.level);
    const Vector3d low = root.min() + size.cwiseProduct(Vector3d(place.x, place.y, place.z));
    return {low, low + size};
  }

  TempFolder folder_;
  std::vector<std::string> paths_;
  Json root_;
};

TEST_F(CloudTiles, HoldEachPointOnceWithinTheBoxOfItsTile) {
  const std::vector<Vector3d> points = HallPoints(200000);
  Write(points);
  std::vector<Vector3d> found;
  int tiles = 0;
  for (const std::string& path : paths_) {
    if (!path.ends_with(".glb")) continue;
    ++tiles;
    Eigen::AlignedBox3d box = BoxAt(PlaceIn(path));
    box.min().array() -= 1e-5;  // floats
    box.max().array() += 1e-5;
    for (const Vector3d& p : PointsOfGlb(path)) {
      ASSERT_TRUE(box.contains(p)) << path << ": " << p.transpose();
      found.push_back(p);
    }
  }
  EXPECT_GT(tiles, 4);
  ASSERT_EQ(found.size(), points.size());
  // Sorted by what distinguishes them, as 16 bits move them by up to a quarter of a millimetre.
  const auto sum = [](const std::vector<Vector3d>& all) {
    Vector3d total = Vector3d::Zero();
    for (const Vector3d& p : all) total += p;
    return Vector3d(total / static_cast<double>(all.size()));
  };
  EXPECT_LT((sum(found) - sum(points)).norm(), 1e-4);
}

TEST_F(CloudTiles, EachLevelIsASubsampleOnAGrid) {
  Write(HallPoints(100000));
  const double spacing_m = BoxIn(root_.at("boundingVolume")).sizes().x() / 128;
  EXPECT_NEAR(root_.at("geometricError").get<double>(), 4 * spacing_m, 1e-12);
  EXPECT_EQ(root_.at("refine"), "ADD");
  std::set<std::array<int64_t, 3>> cells;
  const auto points = PointsOfGlb(folder_.Path("dense/0_0_0_0.glb"));
  const Vector3d corner = BoxIn(root_.at("boundingVolume")).min();
  for (const Vector3d& p : points) {
    const Vector3d cell = (p - corner) / spacing_m;
    cells.insert({std::lround(std::floor(cell.x())), std::lround(std::floor(cell.y())),
                  std::lround(std::floor(cell.z()))});
  }
  // One a cell, but for those that rounding moved over a border.
  EXPECT_GT(cells.size(), 0.99 * static_cast<double>(points.size()));
}

// A subtree, by its description in 3D Tiles 1.1.
struct Subtree {
  Json json;
  std::string binary;

  bool Has(const char* what, int64_t bit) const {
    const Json& available = json.at(what).is_array() ? json.at(what)[0] : json.at(what);
    const Json& view = json.at("bufferViews")[available.at("bitstream").get<std::size_t>()];
    const auto at = view.at("byteOffset").get<std::size_t>() + static_cast<std::size_t>(bit / 8);
    return binary[at] >> bit % 8 & 1;
  }
};

Subtree ReadSubtree(const std::string& path) {
  const std::string bytes = testing::ReadText(path);
  uint32_t version = 0;
  uint64_t json_length = 0, binary_length = 0;
  std::memcpy(&version, bytes.data() + 4, sizeof version);
  std::memcpy(&json_length, bytes.data() + 8, sizeof json_length);
  std::memcpy(&binary_length, bytes.data() + 16, sizeof binary_length);
  EXPECT_EQ(bytes.substr(0, 4), "subt");
  EXPECT_EQ(version, 1u);
  EXPECT_EQ(json_length % 8, 0u);
  EXPECT_EQ(binary_length % 8, 0u);
  EXPECT_EQ(bytes.size(), 24 + json_length + binary_length);
  return {Json::parse(bytes.substr(24, json_length)), bytes.substr(24 + json_length)};
}

int64_t Morton(int x, int y, int z) {
  int64_t code = 0;
  for (int bit = 0; bit < 10; ++bit) {
    code |= int64_t{x >> bit & 1} << 3 * bit | int64_t{y >> bit & 1} << (3 * bit + 1) |
            int64_t{z >> bit & 1} << (3 * bit + 2);
  }
  return code;
}

TEST_F(CloudTiles, SubtreesTellWhichFilesThereAre) {
  // Close together in one corner, and one far away: many levels.
  std::vector<Vector3d> points = HallPoints(100000);
  for (Vector3d& p : points) p *= 0.005;
  points.emplace_back(30, 30, 30);
  Write(points);
  std::set<Place> files, told;
  std::map<Place, Subtree> subtrees;
  for (const std::string& path : paths_) {
    if (path.ends_with(".glb")) files.insert(PlaceIn(path));
    if (path.ends_with(".subtree")) subtrees[PlaceIn(path)] = ReadSubtree(path);
  }
  EXPECT_GT(subtrees.size(), 1u);
  for (const auto& [root, subtree] : subtrees) {
    int64_t first = 0;
    for (int level = 0; level < 4; first += int64_t{1} << 3 * level++) {
      for (int z = 0; z < 1 << level; ++z) {
        for (int y = 0; y < 1 << level; ++y) {
          for (int x = 0; x < 1 << level; ++x) {
            const int64_t bit = first + Morton(x, y, z);
            EXPECT_EQ(subtree.Has("tileAvailability", bit),
                      subtree.Has("contentAvailability", bit));
            if (!subtree.Has("tileAvailability", bit)) continue;
            told.insert({root.level + level, (root.x << level) + x, (root.y << level) + y,
                         (root.z << level) + z});
          }
        }
      }
    }
    for (int z = 0; z < 16; ++z) {
      for (int y = 0; y < 16; ++y) {
        for (int x = 0; x < 16; ++x) {
          const Place below = {root.level + 4, root.x * 16 + x, root.y * 16 + y, root.z * 16 + z};
          EXPECT_EQ(subtree.Has("childSubtreeAvailability", Morton(x, y, z)),
                    subtrees.contains(below));
        }
      }
    }
  }
  EXPECT_EQ(told, files);
  EXPECT_EQ(root_.at("implicitTiling").at("availableLevels").get<int>(), files.rbegin()->level + 1);
}

TEST_F(CloudTiles, PointsAtOnePlaceAreKept) {
  Write(std::vector<Vector3d>(40000, Vector3d(1, 2, 3)));
  std::size_t count = 0;
  for (const std::string& path : paths_) {
    if (path.ends_with(".glb")) count += PointsOfGlb(path).size();
  }
  EXPECT_EQ(count, 40000u);
}

TEST_F(CloudTiles, WhatIsNotFiniteIsRefused) {
  EXPECT_THAT(MessageOf<DataError>([&] {
                Write({{0, 0, 0}, {0, NAN, 0}});
              }),
              HasSubstr("found a point 1 that is not finite"));
}

class TilesWriterTest : public ::testing::Test {
 protected:
  void Write(const MapResult& map, const std::string& page = "") {
    paths_ = WriteTiles(page, folder_.Path(), map);
    if (!paths_.empty())
      tileset_ = Json::parse(testing::ReadText(folder_.Path("tiles/tileset.json")));
  }

  TempFolder folder_;
  std::vector<std::string> paths_;
  Json tileset_;
};

// Calls visit(tile, parent) for all that a tileset names.
void VisitTiles(const Json& tile, const Json* parent,
                const std::function<void(const Json&, const Json*)>& visit) {
  visit(tile, parent);
  if (!tile.contains("children")) return;
  for (const Json& child : tile.at("children")) VisitTiles(child, &tile, visit);
}

TEST_F(TilesWriterTest, LayersAreNamedAndLieWithinTheirParents) {
  MapResult map = testing::MakeRoomMap({.lines = 25000});
  map.filled = map.dense;
  Write(map);
  std::set<std::string> layers;
  std::size_t lines = 0;
  VisitTiles(tileset_.at("root"), nullptr, [&](const Json& tile, const Json* parent) {
    if (tile.contains("extras")) layers.insert(tile.at("extras").at("layer").get<std::string>());
    if (!parent) return;
    EXPECT_LE(tile.at("geometricError").get<double>(), parent->at("geometricError").get<double>());
    Eigen::AlignedBox3d box = BoxIn(parent->at("boundingVolume"));
    box.min().array() -= 1e-6;
    box.max().array() += 1e-6;
    EXPECT_TRUE(box.contains(BoxIn(tile.at("boundingVolume"))));
    const std::string uri = tile.at("content").at("uri").get<std::string>();
    if (!uri.starts_with("lines/")) return;
    const tinygltf::Model model = LoadGlb(folder_.Path("tiles/" + uri));
    for (const tinygltf::Node& node : model.nodes) {
      if (node.mesh >= 0) lines += node.extras.Get("ids").ArrayLen();
    }
  });
  EXPECT_EQ(layers, (std::set<std::string>{"dense", "filled", "points", "lines", "structure"}));
  EXPECT_EQ(lines, 25000u);
  EXPECT_EQ(tileset_.at("asset").at("version"), "1.1");
  EXPECT_EQ(tileset_.at("extras").at("storeys")[0].at("ceiling_m"), 2.6);
}

TEST_F(TilesWriterTest, ContentIsValidGltf) {
  Write({});
  EXPECT_TRUE(paths_.empty());
  Write(testing::MakeRoomMap());
  if (!testing::HasNodeReader("gltf-validator")) {
    GTEST_SKIP() << testing::NodeReaderMissing("gltf-validator");
  }
  for (const std::string& path : paths_) {
    if (!path.ends_with(".glb")) continue;
    const auto output = testing::RunNodeReader("validate_gltf.mjs", path);
    EXPECT_EQ(output.status, 0) << path << ": " << output.text;
  }
}

TEST_F(TilesWriterTest, APlacedMapSaysWhereOnEarthItLies) {
  MapResult map = testing::MakeRoomMap();
  // At 50 degrees north, 9 degrees east, its x to the north.
  map.source.georeference = {"EPSG:25832", {500000, 5538630.703, 100}, 90 * kDegree, 0.9996};
  Write(map);
  const auto values = tileset_.at("root").at("transform").get<std::vector<double>>();
  const Eigen::Map<const Eigen::Matrix4d> matrix(values.data());
  const Vector3d origin = matrix.topRightCorner<3, 1>(), x_axis = matrix.topLeftCorner<3, 1>();
  EXPECT_LT((origin - Vector3d(4057352.955, 642621.577, 4862865.642)).norm(), 0.01);
  const double latitude = 50 * kDegree, longitude = 9 * kDegree;
  const Vector3d north(-std::sin(latitude) * std::cos(longitude),
                       -std::sin(latitude) * std::sin(longitude), std::cos(latitude));
  EXPECT_LT((x_axis - north).norm(), 1e-6);
  EXPECT_EQ(tileset_.at("extras").at("georeference").at("crs"), "EPSG:25832");
  map.source.georeference->crs = "";
  Write(map);
  EXPECT_FALSE(tileset_.at("root").contains("transform"));
}

TEST_F(TilesWriterTest, ThePageNamesItsTilesetsAndCannotBeEndedByThem) {
  Write(testing::MakeRoomMap(), "<script>@SLCMAP_MAP@</script>");
  EXPECT_EQ(testing::ReadText(folder_.Path("tiles/index.html")),
            "<script>[\"tileset.json\"]</script>");
  EXPECT_THAT(MakeTilesPage("@SLCMAP_MAP@", {"</script>/tileset.json"}),
              HasSubstr("\\u003c/script>/tileset.json"));
}

}  // namespace
}  // namespace slcmap
