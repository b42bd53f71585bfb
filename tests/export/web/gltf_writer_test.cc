#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tiny_gltf.h>

#include <set>

#include "export/scene/formats.h"
#include "tests/export/web/glb_positions.h"
#include "tests/testing/hand_made_building.h"
#include "tests/testing/node_reader.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::Contains;
using ::testing::IsSupersetOf;
using ::testing::Not;

class GltfWriterTest : public ::testing::Test {
 protected:
  tinygltf::Model Write(const MapResult& map, const GltfOptions& options = {},
                        int max_vertices = 1000000) const {
    WriteGlb(options, max_vertices, std::make_shared<SceneOfMap>(max_vertices), nullptr,
             temp_.Path(), map);
    tinygltf::Model model;
    std::string error, warning;
    EXPECT_TRUE(
        tinygltf::TinyGLTF().LoadBinaryFromFile(&model, &error, &warning, temp_.Path("scene.glb")))
        << error;
    EXPECT_EQ(warning, "");
    return model;
  }

  void ExpectValid() const {
    const auto output = testing::RunNodeReader("validate_gltf.mjs", temp_.Path("scene.glb"));
    EXPECT_EQ(output.status, 0) << output.text;
  }

  testing::TempFolder temp_;
};

MapResult MakeTwoStoreysWithPoints() {
  MapResult map = testing::MakeTwoStoreys();
  for (int i = 0; i < 1000; ++i) {
    map.dense.push_back({{0.01 * i, 1, 2}, Eigen::Vector3d::UnitZ(), 0.01, 100});
  }
  return map;
}

std::set<std::string> NamesIn(const tinygltf::Model& model) {
  std::set<std::string> names;
  for (const tinygltf::Node& node : model.nodes) names.insert(node.name);
  return names;
}

const tinygltf::Node& NodeOf(const tinygltf::Model& model, const std::string& name) {
  for (const tinygltf::Node& node : model.nodes) {
    if (node.name == name) return node;
  }
  throw std::runtime_error("no node " + name);
}

// In world.
std::vector<Eigen::Vector3d> PositionsOf(const tinygltf::Model& model, const std::string& name) {
  return testing::ReadPositions(model, NodeOf(model, name));
}

TEST_F(GltfWriterTest, NodesAreByStoreyLayerAndKind) {
  const tinygltf::Model model = Write(MakeTwoStoreysWithPoints());
  EXPECT_THAT(NamesIn(model),
              IsSupersetOf({"lines", "lines/storey 0", "lines/storey 0/along x",
                            "lines/storey 0/vertical", "lines/storey 1/of no axis", "dense",
                            "walls/storey 0", "walls/storey 0/wall 0", "walls/storey 1/wall 3",
                            "planes/storey 0/floor/plane 0", "planes/storey 0/ceiling/plane 1"}));
  EXPECT_EQ(NodeOf(model, "walls/storey 0").children.size(), 3u);
  EXPECT_THAT(NamesIn(model), Not(Contains("line_bars")));
  EXPECT_THAT(NamesIn(Write(MakeTwoStoreysWithPoints(), {.tubes = true})), Contains("line_bars"));
}

TEST_F(GltfWriterTest, ExtrasHoldIdsKindsAndUnits) {
  const tinygltf::Model model = Write(MakeTwoStoreysWithPoints());
  EXPECT_EQ(model.nodes[0].extras.Get("unit").Get<std::string>(), "metre");
  const tinygltf::Value& wall = NodeOf(model, "walls/storey 0/wall 2").extras;
  EXPECT_EQ(wall.Get("id").GetNumberAsInt(), 2);
  EXPECT_TRUE(wall.Get("thickness_assumed").Get<bool>());
  EXPECT_NEAR(wall.Get("sigma_m").GetNumberAsDouble(), 0.004, 1e-12);
  const tinygltf::Value& lines = NodeOf(model, "lines/storey 1/of no axis").extras;
  EXPECT_EQ(lines.Get("ids").Get(0).GetNumberAsInt(), 2);
  EXPECT_EQ(lines.Get("kinds").ArrayLen(), 1u);
  EXPECT_EQ(NodeOf(model, "planes/storey 0/floor/plane 0").extras.Get("kind").Get<std::string>(),
            "floor");
}

MapResult WithPipe(MapResult map) {
  MapPipe pipe;
  pipe.axis = LineAxis::kX;
  pipe.start_world = {1, 2, 1};
  pipe.end_world = {3, 2, 1};
  pipe.radius_m = 0.06;
  pipe.radius_sigma_m = 0.001;
  map.pipes = {pipe};
  return map;
}

TEST_F(GltfWriterTest, PipesAreTubesWithTheirRadius) {
  const tinygltf::Model model = Write(WithPipe(MakeTwoStoreysWithPoints()));
  const std::string name = "pipes/storey 0/pipe 0";
  const tinygltf::Value& extras = NodeOf(model, name).extras;
  EXPECT_NEAR(extras.Get("radius_m").GetNumberAsDouble(), 0.06, 1e-12);
  EXPECT_EQ(extras.Get("axis").Get<std::string>(), "along x");
  int on_rim = 0;
  for (const Eigen::Vector3d& p : PositionsOf(model, name)) {
    EXPECT_TRUE(p.x() == 1 || p.x() == 3);
    const double off_m = (p - Eigen::Vector3d(p.x(), 2, 1)).norm();
    on_rim += std::abs(off_m - 0.06) < 1e-6;
  }
  EXPECT_EQ(on_rim, 48);
}

TEST_F(GltfWriterTest, DensePointsAreThinnedToTheLimit) {
  EXPECT_EQ(PositionsOf(Write(MakeTwoStoreysWithPoints()), "dense").size(), 1000u);
  const tinygltf::Model thinned =
      Write(MakeTwoStoreysWithPoints(), {}, 430);  // of which others take 30
  EXPECT_EQ(PositionsOf(thinned, "dense").size(), 334u);
  EXPECT_EQ(NodeOf(thinned, "dense").extras.Get("one_of").GetNumberAsInt(), 3);
}

TEST_F(GltfWriterTest, QuantisedPositionsAreWithinAStep) {
  const MapResult map = MakeTwoStoreysWithPoints();
  const tinygltf::Model model = Write(map, {.quantised = true});
  EXPECT_THAT(model.extensionsRequired, ::testing::ElementsAre("KHR_mesh_quantization"));
  const std::vector<Eigen::Vector3d> dense = PositionsOf(model, "dense");
  for (std::size_t i = 0; i < map.dense.size(); ++i) {
    EXPECT_LT((dense[i] - map.dense[i].p_world).norm(), 10.0 / 65535);
  }
  const std::vector<Eigen::Vector3d> exact = PositionsOf(Write(map), "walls/storey 0/wall 2");
  const std::vector<Eigen::Vector3d> wall = PositionsOf(model, "walls/storey 0/wall 2");
  ASSERT_EQ(wall.size(), exact.size());
  for (std::size_t i = 0; i < wall.size(); ++i) EXPECT_LT((wall[i] - exact[i]).norm(), 1e-4);
}

TEST_F(GltfWriterTest, TheValidatorFindsNeitherErrorsNorWarnings) {
  if (!testing::HasNodeReader("gltf-validator")) {
    GTEST_SKIP() << testing::NodeReaderMissing("gltf-validator");
  }
  const GltfOptions all = {.tubes = true, .quantised = true};
  for (const GltfOptions& options : {GltfOptions(), all}) {
    Write(WithPipe(MakeTwoStoreysWithPoints()), options);
    ExpectValid();
    Write(MapResult(), options);
    ExpectValid();
  }
}

}  // namespace
}  // namespace slcmap
