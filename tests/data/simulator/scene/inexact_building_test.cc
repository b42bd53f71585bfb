
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>

#include "data/core/error.h"
#include "data/core/math.h"
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
  EXPECT_EQ(none.edges.back().b, exact.edges.back().b);
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

// Each edge of the exact building as the inexact one has it: from end to end.
std::vector<TrueEdge> WholeEdges(const Scene& scene) {
  std::vector<TrueEdge> whole;
  for (const TrueEdge& piece : scene.edges) {
    if (piece.bent_edge < static_cast<int>(whole.size())) {
      whole.back().b = piece.b;
    } else {
      whole.push_back(piece);
    }
  }
  return whole;
}

// As good as exact, with the edges of an inexact building, which has some in parts.
std::vector<TrueEdge> NearlyExactEdges() { return WholeEdges(Corridor(1e-3)); }

// Of each edge against what it is in the exact building, in degrees.
std::vector<Vector3d> Turns_deg(const Scene& scene) {
  const std::vector<TrueEdge> exact = NearlyExactEdges(), edges = WholeEdges(scene);
  EXPECT_EQ(edges.size(), exact.size());
  std::vector<Vector3d> turns_deg;
  for (size_t i = 0; i < edges.size(); ++i) {
    const Vector3d before = (exact[i].b - exact[i].a).normalized();
    turns_deg.push_back(kDegreesPerRadian * before.cross((edges[i].b - edges[i].a).normalized()));
  }
  return turns_deg;
}

double SquaredNorm(const std::vector<Vector3d>& turns_deg) {
  double sum = 0;
  for (const Vector3d& turn_deg : turns_deg) sum += turn_deg.squaredNorm();
  return sum;
}

TEST(InexactBuilding, DeviatesAsFarAsTolerancesLetPass) {
  for (const int seed : {1, 2, 3}) {
    const Scene scene = Corridor(1, seed);
    EXPECT_GT(scene.inexact->max_displacement_m, 0.01);
    EXPECT_LT(scene.inexact->max_displacement_m, 0.03 + 0.01);  // field, and a fitting's own turn
    const std::vector<Vector3d> turns_deg = Turns_deg(scene);
    const double size_deg =
        std::sqrt(SquaredNorm(turns_deg) / static_cast<double>(turns_deg.size()));
    EXPECT_GT(size_deg, 0.15);
    EXPECT_LT(size_deg, 0.5);
  }
}

TEST(InexactBuilding, AmountsScaleAndSeedsChoose) {
  const Scene whole = Corridor(1), part = Corridor(0.4);
  const std::vector<Vector3d> turns_deg = Turns_deg(whole), less_deg = Turns_deg(part),
                              other_deg = Turns_deg(Corridor(1, 2));
  std::vector<Vector3d> difference, other_difference;
  for (size_t i = 0; i < turns_deg.size(); ++i) {
    difference.push_back(turns_deg[i] - less_deg[i] / 0.4);
    other_difference.push_back(turns_deg[i] - other_deg[i]);
  }
  EXPECT_LT(SquaredNorm(difference), 1e-4 * SquaredNorm(turns_deg));
  EXPECT_GT(SquaredNorm(other_difference), SquaredNorm(turns_deg));
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
  ASSERT_EQ(chains.size(), NearlyExactEdges().size());
  size_t longest = 0;
  for (const auto& [number, pieces] : chains) {
    for (size_t i = 0; i + 1 < pieces.size(); ++i) {
      EXPECT_EQ(pieces[i]->b, pieces[i + 1]->a);
      EXPECT_LT((pieces[i]->b - pieces[i]->a).norm(), 0.51);
    }
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
  const std::vector<TrueEdge> edges = WholeEdges(scene);
  const std::vector<Vector3d> turns_deg = Turns_deg(scene);
  std::vector<double> yaws_deg;
  std::map<int, std::vector<double>> leans_deg;  // of the upright edges of each door
  for (size_t i = 0; i < edges.size(); ++i) {
    if (edges[i].body < 0 || scene.bodies[edges[i].body].kind != "door") continue;
    if (edges[i].axis != 2) {
      yaws_deg.push_back(turns_deg[i].z());
    } else if ((edges[i].b - edges[i].a).norm() > 1.5) {
      leans_deg[edges[i].body].push_back(turns_deg[i].x());
    }
  }
  const auto [left_deg, right_deg] = std::minmax_element(yaws_deg.begin(), yaws_deg.end());
  EXPECT_GT(*right_deg - *left_deg, 0.3);
  ASSERT_EQ(leans_deg.size(), 16u);
  for (const auto& [body, leans] : leans_deg) {
    const auto [low, high] = std::minmax_element(leans.begin(), leans.end());
    EXPECT_LT(*high - *low, 0.15) << body;  // they are of one body, which hardly bends
  }
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
