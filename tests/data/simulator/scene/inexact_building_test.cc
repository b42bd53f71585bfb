#include "data/simulator/scene/inexact_building.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>

#include "data/core/error.h"
#include "data/io/file.h"
#include "data/simulator/ray_scene.h"
#include "data/simulator/scene/scene_builder.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;
using ::testing::AllOf;
using ::testing::HasSubstr;

const std::string kExactScenes = SLCMAP_SOURCE_DIR "/config/scenes/";

Scene Corridor(double amount, int seed = 1) {
  return ReadScene(kExactScenes + "office_corridor.yaml", {}, InexactOptions{amount, seed});
}

// A room of 9 x 6 x 3 m without openings, whose floor is of two parts that are cut elsewhere than
// the walls; three posters on each of two walls.
Scene Room(double amount, int seed) {
  const testing::TempFolder folder;
  const std::string path = folder.Write(
      "room.yaml",
      "objects:\n"
      "  - {kind: wall, points: [[0, 0], [9, 0], [9, 6], [0, 6]], closed: true, height: 3}\n"
      "  - {kind: slab, size: [4.3, 6]}\n"
      "  - {kind: slab, at: [4.3, 0, 0], size: [4.7, 6]}\n"
      "  - {kind: slab, at: [0, 0, 3], size: [9, 6], faces_down: true}\n"
      "  - {kind: poster, at: [2, 0, 1], yaw_deg: 180, repeat: 3, step: [2, 0, 0]}\n"
      "  - {kind: poster, at: [2, 6, 1], size: [1, 1.2], repeat: 3, step: [2, 0, 0]}\n");
  return ReadScene(path, {}, InexactOptions{amount, seed});
}

double Triangle(const Vector3d& p, const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const Vector3d u = b - a, v = c - a, w = p - a;
  const double uu = u.dot(u), uv = u.dot(v), vv = v.dot(v), wu = w.dot(u), wv = w.dot(v);
  const double area = uu * vv - uv * uv;
  const double s = std::clamp((wu * vv - wv * uv) / area, 0.0, 1.0);
  const double t = std::clamp((wv * uu - wu * uv) / area, 0.0, 1.0 - s);
  return (w - s * u - t * v).norm();
}

double Distance(const Vector3d& p, const ScenePatch& patch) {
  std::array<Vector3d, 4> c;
  for (int i = 0; i < 4; ++i) c[i] = patch.corners[i].cast<double>();
  return std::min(Triangle(p, c[0], c[1], c[3]), Triangle(p, c[2], c[3], c[1]));
}

TEST(InexactBuilding, OfNoAmountIsTheExactBuilding) {
  const Scene exact = ReadScene(kExactScenes + "office_corridor.yaml"), none = Corridor(0, 7);
  EXPECT_TRUE(none.patches.empty());
  EXPECT_FALSE(none.inexact.has_value());
  ASSERT_EQ(none.edges.size(), exact.edges.size());
  for (size_t i = 0; i < exact.edges.size(); ++i) {
    EXPECT_EQ(none.edges[i].a, exact.edges[i].a);
    EXPECT_EQ(none.edges[i].b, exact.edges[i].b);
    EXPECT_EQ(none.edges[i].bent_edge, -1);
  }
  const std::vector<ScenePatch> patches = SeenPatches(none);
  ASSERT_EQ(patches.size(), exact.quads.size());
  for (size_t i = 0; i < patches.size(); ++i) {
    const SceneQuad& quad = exact.quads[i];
    EXPECT_EQ(patches[i].quad, i);
    EXPECT_EQ(patches[i].corners[2], quad.a + quad.u + quad.v);
    EXPECT_EQ(patches[i].from, Eigen::Vector2f(0, 0));
    EXPECT_EQ(patches[i].size, Eigen::Vector2f(1, 1));
  }
}

double RootMeanSquareTurn(const InexactTruth& truth) {
  double sum = 0, length_m = 0;
  for (const EdgeDeviation& edge : truth.edges) {
    if (edge.axis < 0) continue;
    sum += 0.5 * edge.length_m * edge.turn_deg.squaredNorm();
    length_m += edge.length_m;
  }
  return std::sqrt(sum / length_m);
}

TEST(InexactBuilding, DeviatesAsFarAsTolerancesLetPass) {
  for (const int seed : {1, 2, 3}) {
    const Scene scene = Corridor(1, seed);
    const InexactTruth& truth = scene.inexact.value();
    EXPECT_GT(truth.max_displacement_m, 0.01);
    EXPECT_LT(truth.max_displacement_m, 0.03 + 0.01);  // a fitting's own turn beside the field
    EXPECT_GT(RootMeanSquareTurn(truth), 0.1);
    EXPECT_LT(RootMeanSquareTurn(truth), 0.35);
    double bend_m = 0;
    for (const EdgeDeviation& edge : truth.edges) bend_m = std::max(bend_m, edge.bend_m);
    EXPECT_GT(bend_m, 0.005);
    EXPECT_LT(bend_m, 0.035);
    double yaw_deg = 0;
    for (const BodyDeviation& body : truth.bodies) {
      EXPECT_LE(std::abs(body.own_yaw_deg), 0.5);
      EXPECT_LE(body.own_lean_deg.norm(), 0.2 + 1e-9);
      const SceneBody& of = scene.bodies[body.body];
      EXPECT_TRUE(of.is_fitting || body.own_yaw_deg == 0);
      EXPECT_TRUE(of.kind != "wall" || std::abs(body.yaw_deg) < 0.4);
      yaw_deg = std::max(yaw_deg, std::abs(body.own_yaw_deg));
    }
    EXPECT_GT(yaw_deg, 0.3);
  }
}

TEST(InexactBuilding, AmountsScaleAndSeedsChoose) {
  const Scene whole = Corridor(1), part = Corridor(0.4), other = Corridor(1, 2);
  ASSERT_EQ(part.inexact->edges.size(), whole.inexact->edges.size());
  double difference = 0, other_difference = 0, size = 0;
  for (size_t i = 0; i < whole.inexact->edges.size(); ++i) {
    const Eigen::Vector2d turn_deg = whole.inexact->edges[i].turn_deg;
    size += turn_deg.squaredNorm();
    difference += (turn_deg - part.inexact->edges[i].turn_deg / 0.4).squaredNorm();
    other_difference += (turn_deg - other.inexact->edges[i].turn_deg).squaredNorm();
  }
  EXPECT_LT(difference, 1e-4 * size);
  EXPECT_GT(other_difference, size);
  EXPECT_NEAR(part.inexact->max_displacement_m, 0.4 * whole.inexact->max_displacement_m, 1e-3);
  EXPECT_EQ(whole.patches[5].corners[0], Corridor(1).patches[5].corners[0]);
}

TEST(InexactBuilding, EdgesLieOnItsSurfaces) {
  const Scene scene = Corridor(1);
  double worst_m = 0;
  for (size_t i = 0; i < scene.edges.size(); i += 17) {
    const Vector3d middle = 0.5 * (scene.edges[i].a + scene.edges[i].b);
    double nearest_m = 1;
    for (const ScenePatch& patch : scene.patches) {
      if ((patch.corners[0].cast<double>() - middle).norm() > nearest_m + 0.6) continue;
      nearest_m = std::min(nearest_m, Distance(middle, patch));
    }
    worst_m = std::max(worst_m, nearest_m);
  }
  EXPECT_LT(worst_m, 5e-4);
}

TEST(InexactBuilding, BentEdgesAreChainsOfPieces) {
  const Scene scene = Corridor(1);
  std::map<int, std::vector<const TrueEdge*>> chains;
  int last = 0;
  for (const TrueEdge& piece : scene.edges) {
    EXPECT_GE(piece.bent_edge, last);
    last = piece.bent_edge;
    chains[piece.bent_edge].push_back(&piece);
  }
  ASSERT_EQ(chains.size(), scene.inexact->edges.size());
  size_t longest = 0;
  for (const auto& [number, pieces] : chains) {
    for (size_t i = 0; i + 1 < pieces.size(); ++i) {
      EXPECT_EQ(pieces[i]->b, pieces[i + 1]->a);
      EXPECT_LT((pieces[i]->b - pieces[i]->a).norm(), 0.51);
    }
    const EdgeDeviation& deviation = scene.inexact->edges[number];
    EXPECT_EQ(deviation.edge, number);
    EXPECT_NEAR((pieces.back()->b - pieces.front()->a).norm(), deviation.length_m, 1e-9);
    EXPECT_EQ(pieces.size() > 1, deviation.bend_m >= 2e-4);
    longest = std::max(longest, pieces.size());
  }
  EXPECT_GE(longest, 36u);  // the outer wall's of 18 m
}

// The first patch from a place on, if any.
const ScenePatch* FirstHit(const RayScene& rays, const std::vector<ScenePatch>& patches,
                           const Vector3f& from, const Vector3f& direction) {
  RayScene::Packet packet;
  packet.Clear();
  packet.Set(0, from, direction);
  rays.Trace(&packet);
  if (packet.rays.hit.geomID[0] == RayScene::kNoQuad) return nullptr;
  return &patches[packet.rays.hit.primID[0]];
}

TEST(InexactBuilding, WallsFloorsAndCeilingsStayClosed) {
  for (const int seed : {1, 2, 3}) {
    const Scene scene = Room(2, seed);
    const RayScene rays(scene.patches);
    std::mt19937 generator(seed);
    const auto any = [&](double low, double high) { return UniformIn(low, high, &generator); };
    int misses = 0;
    for (int i = 0; i < 20000; ++i) {
      // At the edges, where one could see between two surfaces.
      const TrueEdge& edge = scene.edges[generator() % scene.edges.size()];
      const double beside_m = 3e-4;
      const Vector3d target =
          edge.a + any(0, 1) * (edge.b - edge.a) +
          Vector3d(any(-beside_m, beside_m), any(-beside_m, beside_m), any(-beside_m, beside_m));
      const Vector3d eye(any(2, 7), any(2, 4), any(1, 2));
      misses += !FirstHit(rays, scene.patches, eye.cast<float>(), (target - eye).cast<float>());
    }
    EXPECT_EQ(misses, 0) << "seed " << seed;
  }
}

TEST(InexactBuilding, WhatHangsOnAWallStaysBeforeIt) {
  for (int seed = 1; seed <= 20; ++seed) {
    const Scene scene = Room(seed % 2 == 0 ? 1 : 2, seed);
    const RayScene rays(scene.patches);
    int posters = 0;
    for (const ScenePatch& patch : scene.patches) {
      const uint32_t material = scene.quads[patch.quad].material;
      if (scene.materials[material].texture != TextureKind::kPoster) continue;
      ++posters;
      // Within it, and beside the diagonal where its two triangles meet.
      const Vector3f inside =
          0.5f * patch.corners[0] + 0.2f * patch.corners[1] + 0.3f * patch.corners[2];
      for (const Vector3f& corner : patch.corners) {
        const Vector3f target = 0.99f * corner + 0.01f * inside;
        const ScenePatch* hit =
            FirstHit(rays, scene.patches, target + 0.5f * patch.normal, -patch.normal);
        ASSERT_NE(hit, nullptr);
        EXPECT_EQ(scene.quads[hit->quad].material, material) << "seed " << seed;
        // The wall is close behind.
        EXPECT_TRUE(rays.Blocked(target - 1e-4f * patch.normal, -patch.normal, 0.03f));
      }
    }
    EXPECT_GT(posters, 6);
  }
}

TEST(InexactBuilding, FittingsAreTurnedEachByItselfAndAsOne) {
  const Scene scene = Corridor(1);
  const auto own_yaw_deg = [&](const std::string& kind) {
    std::vector<double> yaws_deg;
    for (const BodyDeviation& body : scene.inexact->bodies) {
      if (scene.bodies[body.body].kind == kind) yaws_deg.push_back(body.own_yaw_deg);
    }
    return yaws_deg;
  };
  EXPECT_EQ(own_yaw_deg("door").size(), 16u);
  EXPECT_EQ(own_yaw_deg("wall").size(), 8u);
  const std::vector<double> lamps_deg = own_yaw_deg("lamp");  // repeated ones too
  ASSERT_EQ(lamps_deg.size(), 14u);
  EXPECT_GT(*std::max_element(lamps_deg.begin(), lamps_deg.end()) -
                *std::min_element(lamps_deg.begin(), lamps_deg.end()),
            0.3);
  // The upright edges of a door lean alike: they are of one body, which hardly bends.
  std::map<int, std::vector<double>> leans_deg;
  for (const EdgeDeviation& edge : scene.inexact->edges) {
    if (edge.body < 0 || scene.bodies[edge.body].kind != "door" || edge.axis != 2) continue;
    if (edge.length_m > 1.5) leans_deg[edge.body].push_back(edge.turn_deg.x());
  }
  ASSERT_EQ(leans_deg.size(), 16u);
  for (const auto& [body, leans] : leans_deg) {
    const auto [low, high] = std::minmax_element(leans.begin(), leans.end());
    EXPECT_LT(*high - *low, 0.15) << body;
  }
}

TEST(InexactBuilding, TruthSaysWhatWasDone) {
  const testing::TempFolder folder;
  const Scene scene = Room(0.5, 3);
  WriteDeviations(folder.Path(), scene);
  EXPECT_THAT(ReadFile(folder.Path("inexact.yaml")),
              AllOf(HasSubstr("amount: 0.5\nseed: 3\n"), HasSubstr("edges_upright_deg: 0.")));
  EXPECT_THAT(
      ReadFile(folder.Path("deviations.csv")),
      AllOf(HasSubstr("body,kind,is_fitting"), HasSubstr(",wall,0,0,"), HasSubstr(",poster,1,0,")));
  const std::string edges = ReadFile(folder.Path("edge_deviations.csv"));
  EXPECT_EQ(std::count(edges.begin(), edges.end(), '\n'),
            1 + static_cast<int>(scene.inexact->edges.size()));
}

TEST(InexactBuilding, TheSceneSaysHowFarAndAbsurditiesAreRefused) {
  const testing::TempFolder folder;
  const auto scene = [&](const std::string& inexact) {
    return folder.Write("scene.yaml",
                        "inexact: " + inexact + "\nobjects: [{kind: box, size: [1, 1, 1]}]\n");
  };
  EXPECT_EQ(ReadSceneInexact(scene("{amount: 0.4, seed: 9}")).seed, 9);
  EXPECT_TRUE(ReadScene(scene("{amount: 0.4}")).inexact.has_value());
  EXPECT_FALSE(ReadScene(scene("{seed: 4}")).inexact.has_value());
  const auto expect_error = [&](const std::string& inexact, const std::string& what) {
    EXPECT_THAT(testing::MessageOf<ConfigError>([&] { ReadScene(scene(inexact)); }),
                AllOf(HasSubstr("scene.yaml"), HasSubstr(what)));
  };
  expect_error("{amount: -1}", "inexact.amount: found -1, expected 0 to 2");
  expect_error("{amount: 3}", "inexact.amount: found 3");
  expect_error("{amount: .nan}", "inexact.amount");
  expect_error("{seed: -1}", "inexact.seed: found -1");
  expect_error("{amout: 1}", "amout");
  expect_error("1", "inexact");
  folder.Write("base.yaml",
               "inexact: {amount: 1, seed: 5}\nobjects: [{kind: box, size: [1, 1, 1]}]");
  const InexactOptions based =
      ReadSceneInexact(folder.Write("based.yaml", "base: base.yaml\ninexact: {amount: 0.5}\n"));
  EXPECT_EQ(based.amount, 0.5);
  EXPECT_EQ(based.seed, 5);
}

}  // namespace
}  // namespace slcmap
