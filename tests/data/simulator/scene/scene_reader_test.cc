#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include "data/core/error.h"
#include "data/simulator/motion.h"
#include "data/simulator/scene/scene.h"
#include "data/simulator/scene/scene_builder.h"
#include "data/simulator/truth.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;
using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::MessageOf;

const std::string kScenes = SLCMAP_SOURCE_DIR "/config/scenes/";

double DistanceToQuad(const Vector3d& point, const SceneQuad& quad) {
  const Vector3d a = quad.a.cast<double>(), u = quad.u.cast<double>(), v = quad.v.cast<double>();
  // The nearest point of a rectangle; the few sheared quads are taken a little too large.
  const double s = std::clamp((point - a).dot(u) / u.squaredNorm(), 0.0, 1.0);
  const double t = std::clamp((point - a).dot(v) / v.squaredNorm(), 0.0, 1.0);
  return (point - a - s * u - t * v).norm();
}

double Clearance(const Vector3d& point, const Scene& scene) {
  double clearance = 1e9;
  for (const SceneQuad& quad : scene.quads) {
    clearance = std::min(clearance, DistanceToQuad(point, quad));
  }
  return clearance;
}

std::string Written(const std::string& text) {
  static const testing::TempFolder folder;
  return folder.Write("scene_reader_test.yaml", text);
}

std::string ErrorOf(const std::string& text) {
  return MessageOf<ConfigError>([&] { ReadScene(Written(text)); });
}

class SceneFile : public ::testing::TestWithParam<std::string> {};

void CheckIndices(const Scene& scene) {
  for (const SceneQuad& quad : scene.quads) {
    ASSERT_LT(quad.material, scene.materials.size());
    ASSERT_TRUE(quad.a.allFinite());
    ASSERT_GT(quad.u.cross(quad.v).norm(), 1e-7);
  }
  for (const SceneLamp& lamp : scene.lamps) {
    ASSERT_GT(lamp.radiance, 0);
    ASSERT_GT(lamp.u.cross(lamp.v).norm(), 1e-3);
  }
}

void CheckEdge(const TrueEdge& edge, const Scene& scene) {
  ASSERT_TRUE(edge.a.allFinite() && edge.b.allFinite());
  ASSERT_GT((edge.b - edge.a).norm(), 0.049);
  ASSERT_GE(edge.wing, 0);
  ASSERT_LT(edge.wing, static_cast<int>(scene.wing_yaw_rad.size()));
  const Eigen::AngleAxisd turn(-scene.wing_yaw_rad[edge.wing], Vector3d::UnitZ());
  const Vector3d direction = turn * (edge.b - edge.a).normalized();
  int axis = -1;
  for (int k = 0; k < 3; ++k) {
    if (std::abs(direction[k]) > 1 - 1e-8) axis = k;
  }
  ASSERT_EQ(axis, edge.axis);
}

// As far from everything as a rig needs, all along the straight lines between the waypoints.
void CheckTrajectory(const std::string& path, const Scene& scene) {
  MadeMotionOptions options;
  options.Read(YamlSection::FromFile(path).Section("trajectory"));
  for (size_t i = 0; i + 1 < options.waypoints_m.size(); ++i) {
    const Vector3d from = options.waypoints_m[i], way = options.waypoints_m[i + 1] - from;
    const int steps = static_cast<int>(way.norm() / 0.25) + 1;
    for (int k = 0; k <= steps; ++k) {
      const Vector3d point = from + way * k / steps;
      ASSERT_GT(Clearance(point, scene), 0.3) << point.transpose();
    }
  }
}

TEST_P(SceneFile, HasSoundQuadsLampsEdgesAndRoomAlongItsTrajectory) {
  const Scene scene = ReadScene(kScenes + GetParam());
  EXPECT_EQ(scene.name + ".yaml", GetParam());
  EXPECT_GT(scene.quads.size(), 100u);
  EXPECT_LT(scene.quads.size(), 30000u);
  EXPECT_GT(scene.lamps.size(), 2u);
  EXPECT_GT(scene.edges.size(), 100u);
  CheckIndices(scene);
  std::set<std::array<int64_t, 6>> seen;
  for (const TrueEdge& edge : scene.edges) {
    CheckEdge(edge, scene);
    std::array<int64_t, 6> ends;
    const bool forward = std::lexicographical_compare(edge.a.data(), edge.a.data() + 3,
                                                      edge.b.data(), edge.b.data() + 3);
    for (int k = 0; k < 3; ++k) {
      ends[k] = std::llround(1e4 * (forward ? edge.a : edge.b)[k]);
      ends[k + 3] = std::llround(1e4 * (forward ? edge.b : edge.a)[k]);
    }
    EXPECT_TRUE(seen.insert(ends).second) << edge.a.transpose() << " to " << edge.b.transpose();
  }
  CheckTrajectory(kScenes + GetParam(), scene);
}

std::vector<std::string> SceneFiles() {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(kScenes)) {
    names.push_back(entry.path().filename());
  }
  std::sort(names.begin(), names.end());
  return names;
}

INSTANTIATE_TEST_SUITE_P(All, SceneFile, ::testing::ValuesIn(SceneFiles()),
                         [](const ::testing::TestParamInfo<std::string>& test) {
                           return test.param.substr(0, test.param.find('.'));
                         });

TEST(SceneCamera, IsOverriddenByKeyAndRejectsWhatIsNoOption) {
  const std::string object = "objects: [{kind: box, size: [1, 1, 1]}]\n";
  const std::string path = Written(object + "camera: {read_noise_grey: 1.5}\n");
  EXPECT_EQ(ReadSceneCamera(path).read_noise_grey, 1.5);
  EXPECT_EQ(ReadSceneCamera(path).full_well_electrons, CameraResponseOptions().full_well_electrons);
  for (const auto& [camera, what] :
       {std::pair{"{read_nois: 1.5}", "read_nois"}, {"{max_gain: 0.5}", "max_gain"}}) {
    const std::string wrong = Written(object + "camera: " + camera + "\n");
    EXPECT_THAT(MessageOf<ConfigError>([&] { ReadSceneCamera(wrong); }),
                AllOf(HasSubstr("scene_reader_test.yaml"), HasSubstr(what)));
  }
}

TEST(ReadScene, NamesFileAndKeyOfWhatItDoesNotKnow) {
  for (const auto& [text, what] : std::initializer_list<std::pair<std::string, std::string>>{
           {"colour: 1\nobjects: []\n", "scene_reader_test.yaml: colour: unknown key"},
           {"objects: [{kind: box, size: [1, 1, 1], colour: 2}]", "objects[0].colour: unknown key"},
           {"objects: [{kind: bax}]", "objects[0].kind: found 'bax'"},
           {"objects: [{kind: box}]", "objects[0].size"},
           {"objects: [{kind: box, size: [1, 1, 1], material: gold}]",
            "objects[0].material: found 'gold'"},
           {"materials: {a: {texture: silk}}\n", "materials.a.texture"},
           {"objects: 3\n", "objects: found '3', expected a list"},
           {"objects: [{kind: wall, points: [[0, 0], [4, 0]], doors: [[3, 1, 1, 2, 0]]}]",
            "objects[0].doors"}}) {
    EXPECT_THAT(ErrorOf(text), HasSubstr(what));
  }
}

TEST(ReadScene, BuildsABoxInATurnedWing) {
  const Scene scene =
      ReadScene(Written("wings: [[0, 0, 0], [30, 1, 0]]\n"
                        "objects: [{kind: box, wing: 1, at: [2, 0, 0], size: [1, 2, 3]}]\n"));
  EXPECT_EQ(scene.quads.size(), 6u);
  ASSERT_EQ(scene.edges.size(), 12u);
  int of_axis[3] = {0, 0, 0};
  Vector3d middle = Vector3d::Zero();
  for (const TrueEdge& edge : scene.edges) {
    EXPECT_EQ(edge.wing, 1);
    ASSERT_GE(edge.axis, 0);
    ++of_axis[edge.axis];
    EXPECT_NEAR((edge.b - edge.a).norm(), edge.axis + 1, 1e-9);
    middle += (edge.a + edge.b) / 24;
  }
  EXPECT_THAT(of_axis, ::testing::ElementsAre(4, 4, 4));
  EXPECT_NEAR((middle - Vector3d(1 + std::sqrt(3.0), 1, 1.5)).norm(), 0, 1e-9);
  // Front faces look out of a box: light falls on them from there.
  for (const SceneQuad& quad : scene.quads) {
    const Vector3d face = (quad.a + 0.5f * (quad.u + quad.v)).cast<double>();
    EXPECT_GT(quad.u.cross(quad.v).cast<double>().dot(face - middle), 0);
  }
}

TEST(ReadScene, CutsADoorOutOfAWall) {
  const Scene scene = ReadScene(
      Written("objects: [{kind: wall, points: [[0, 0], [4, 0]], height: 3, skirting_height: 0,\n"
              "  material: brick, doors: [[0, 1, 1, 2, 0]]}]"));
  float wall_area = 0;
  for (const SceneQuad& quad : scene.quads) {
    if (scene.materials[quad.material].texture != TextureKind::kBrick) continue;
    EXPECT_NEAR(quad.u.cross(quad.v).normalized().y(), 1, 1e-5);  // to the left of the way
    wall_area += quad.u.cross(quad.v).norm();
  }
  EXPECT_NEAR(wall_area, 12 - 2, 1e-4);
}

// Where a pane meets its frame one sees an edge, unless one sees through the pane.
TEST(ReadScene, HasTheBordersOfPanesAmongItsEdges) {
  const auto edges_in_pane = [](const std::string& wall, const std::string& pane) {
    const Scene scene =
        ReadScene(Written("objects: [{kind: wall, points: [[0, 0], [4, 0]], thickness: 0.2, " +
                          wall + "windows: [[0, 1, 1, 1, 1" + pane + "]]}]"));
    return std::ranges::count_if(scene.edges, [](const TrueEdge& edge) {
      return std::abs(edge.a.y() + 0.12) < 1e-6 && std::abs(edge.b.y() + 0.12) < 1e-6;
    });
  };
  EXPECT_EQ(edges_in_pane("", ", 7"), 4);
  EXPECT_EQ(edges_in_pane("", ""), 4);
  EXPECT_EQ(edges_in_pane("clear_glass: true, ", ""), 0);
}

TEST(MergedEdges, UnitesOnlyWhatOverlaps) {
  const auto edge = [](double from, double to, double y) {
    return TrueEdge{{from, y, 0}, {to, y, 0}, 0, 0};
  };
  const std::vector<TrueEdge> merged =
      MergedEdges({edge(0, 1, 0), edge(2, 3, 0), edge(2.5, 0.5, 0), edge(0, 1, 0.01)});
  ASSERT_EQ(merged.size(), 2u);
  double longest = 0;
  for (const TrueEdge& each : merged) longest = std::max(longest, (each.b - each.a).norm());
  EXPECT_NEAR(longest, 3, 1e-9);
}

TEST(ReadScene, RefusesNumbersOutOfRangeNamingFileAndKey) {
  for (const auto& [object, place] :
       {std::pair{"{kind: lamp, radiance: 1e25}", "radiance: found 1e+25"},
        {"{kind: lamp, radiance: -3}", "radiance: found -3"},
        {"{kind: lamp, size: [0, 1]}", "size: found 0"},
        {"{kind: box, size: [1, 1, 1e6]}", "size: found 1"},
        {"{kind: box, size: [1, 1, 1], at: [0, 1e9, 0]}", "at: found 1"},
        {"{kind: pipe, points: [[0, 0, 0], [0, 0, 1e5]]}", "points: found 100000"},
        {"{kind: pipe, points: [[0, 0, 0], [0, 0, 0]]}", "a surface without area"},
        {"{kind: pipe, points: [[0, 0, 0], [0, 0, 1]], sides: 7}", "sides: expected 8"},
        {"{kind: half_round, points: [[0, 0, 0], [0, 0, 1]], radius: 0}", "radius: found 0"},
        {"{kind: box, size: [1, 1, 1], yaw_deg: 1e30}", "yaw_deg: found 1e+30"},
        {"{kind: box, size: [1, 1, 1], seed: -1}", "seed: expected 0"},
        {"{kind: clutter, size: [900, 900], count: 10000, repeat: 10000}", "in the scene"}}) {
    EXPECT_THAT(ErrorOf(std::string("objects: [") + object + "]"),
                AllOf(HasSubstr("objects[0]"), HasSubstr(place)))
        << object;
  }
  EXPECT_THROW(ReadScene(Written("ambient: 1e30\nobjects: [{kind: box, size: [1, 1, 1]}]")),
               ConfigError);
  for (const std::string wrong : {"seed: -1", "scale: 0", "texture: paving"}) {
    EXPECT_THAT(
        ErrorOf("materials: {white: {" + wrong + "}}\nobjects: [{kind: box, size: [1, 1, 1]}]"),
        HasSubstr("materials.white." + wrong.substr(0, wrong.find(':'))));
  }
}

TEST(SceneTags, AreControlPointsInTheGridOfTheScene) {
  const std::string tag = "objects: [{kind: tag, name: 'tag36h11:5', at: [1, 2, 3], size: 0.16}]\n";
  const std::string place = "georeference: {origin_m: [1000, 2000, 30], turn_deg: 90}\n";
  const testing::TempFolder folder;
  const auto truth_of = [&](const std::string& text) {
    WriteTrueControl(folder.Path("control.csv"), ReadScene(Written(text)));
    return testing::ReadText(folder.Path("control.csv"));
  };
  const std::string header = "name,easting_m,northing_m,height_m,sigma_m\n";
  EXPECT_EQ(truth_of(tag), header + "tag36h11:5,1.00000,1.99400,3.00000,0.001\n");
  EXPECT_EQ(truth_of(place + tag), header + "tag36h11:5,998.00600,2001.00000,33.00000,0.001\n");
  const Scene scene = ReadScene(Written(tag));
  ASSERT_EQ(scene.tags.size(), 1u);
  EXPECT_NEAR(scene.quads[scene.tags[0].quad].u.norm(), 0.2, 1e-6);  // with its white border
}

TEST(SceneTags, RefuseWhatIsNone) {
  EXPECT_THAT(ErrorOf("objects: [{kind: tag, name: pillar}]"),
              HasSubstr("name: found 'pillar', expected a tag such as tag36h11:5"));
  EXPECT_THAT(ErrorOf("objects: [{kind: tag, name: 'tag36h11:9000'}]"), HasSubstr("9000"));
  EXPECT_THAT(ErrorOf("georeference: {crs: 'EPSG:25832', origin_m: [5, 5, 0]}\n"
                      "objects: [{kind: tag}]"),
              HasSubstr("georeference.origin_m: expected a place that EPSG:25832 is for"));
}

}  // namespace
}  // namespace slcmap
