#include "mapping/building/faces.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace slcmap {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using ::testing::IsEmpty;
using ::testing::SizeIs;

// A wall along x from 0 to its length at y, looking to +y, as points of 5 cm with noise; `y` gives
// it as a function of x.
template <typename Shape>
std::vector<FaceSample> WallOf(double length_m, double noise_m, uint32_t seed, Shape y) {
  std::mt19937 generator(seed);
  std::normal_distribution<double> normal;
  std::vector<FaceSample> samples;
  for (double x = 0; x < length_m; x += 0.05) {
    for (double z = 0; z < 2.5; z += 0.05) {
      const double turn = 0.1 * normal(generator);
      samples.push_back({{x, y(x) + noise_m * normal(generator), z},
                         {std::sin(turn), std::cos(turn)},
                         Vector2d::Zero(),
                         noise_m});
    }
  }
  return samples;
}

bool AllFree(const Vector2d&) { return true; }

TEST(Faces, IntervalsHoldTheMiddleOfWallsThatBend) {
  // Waves as those of inexact buildings, of all phases.
  int held = 0, all = 0;
  for (int k = 0; k < 40; ++k) {
    const double wave_m = 6 + 0.3 * k, phase = k;
    const auto bend = [&](double x) { return 0.005 * std::sin(2 * M_PI * x / wave_m + phase); };
    const std::vector<Face> faces = FindFaces(WallOf(5, 0.01, k, bend), AllFree, {});
    ASSERT_THAT(faces, SizeIs(1)) << k;
    double mean = 0;
    for (int i = 0; i < 100; ++i) mean += bend(0.05 * i) / 100;
    const double at_middle = faces[0].DistanceTo({2.5, mean});
    ++all;
    held += std::abs(at_middle) <= 1.96 * faces[0].sigma_m ? 1 : 0;
  }
  EXPECT_GE(held, 36);
}

TEST(Faces, HeadingIsThatOfTheWall) {
  const double slope = std::tan(7 * M_PI / 180);
  const std::vector<Face> faces =
      FindFaces(WallOf(5, 0.01, 1, [&](double x) { return slope * x; }), AllFree, {});
  ASSERT_THAT(faces, SizeIs(1));
  const double turn = std::atan2(-faces[0].normal.x(), faces[0].normal.y());
  EXPECT_NEAR(turn * 180 / M_PI, 7, 0.1);
}

TEST(Faces, WallGoesOnBeyondADoorButNotBesideAStep) {
  std::vector<FaceSample> samples = WallOf(6, 0.01, 1, [](double x) { return x > 4 ? 0.06 : 0; });
  std::erase_if(samples, [](const FaceSample& sample) {
    return sample.p_world.x() > 1.5 && sample.p_world.x() < 2.5;
  });
  const std::vector<Face> faces = FindFaces(samples, AllFree, {});
  ASSERT_THAT(faces, SizeIs(2));
  EXPECT_NEAR(faces[0].Length(), 4, 0.1);
  EXPECT_NEAR(faces[1].Length(), 2, 0.1);
  EXPECT_NEAR(faces[1].offset_m, 0.06, 0.005);
}

TEST(Faces, LinesOfABlankWallMakeAFaceOnTheFreeSide) {
  std::vector<FaceSample> samples;
  for (double x = 0; x < 4; x += 0.1) {
    for (const double z : {0.09, 2.7}) {
      samples.push_back({{x, 1, z}, Vector2d::Zero(), Vector2d::UnitX(), 0.005});
    }
  }
  const auto faces = FindFaces(
      samples, [](const Vector2d& p) { return p.y() < 1; }, BuildingOptions{});
  ASSERT_THAT(faces, SizeIs(1));
  EXPECT_NEAR(faces[0].normal.y(), -1, 1e-3);
  EXPECT_NEAR(faces[0].offset_m, -1, 0.005);
  EXPECT_THAT(FindFaces(samples, [](const Vector2d&) { return false; }, {}), IsEmpty());
}

TEST(Faces, ShortFaceGetsTheHeadingOfLongOnes) {
  Face wall;
  wall.heading_sigma_rad = 0.0005;
  wall.to_m = 5;
  Face cheek;
  cheek.normal = Vector2d(std::cos(0.03), std::sin(0.03));
  cheek.heading_sigma_rad = 0.05;
  cheek.to_m = 0.4;
  std::vector<Face> faces = {wall, cheek};
  AgreeHeadings(&faces);
  EXPECT_NEAR(std::atan2(faces[0].normal.y(), faces[0].normal.x()), 0, 1e-3);
  EXPECT_NEAR(std::atan2(faces[1].normal.y(), faces[1].normal.x()), 0, 3e-3);
}

TEST(Faces, MainHeadingIsThatOfMostWalls) {
  Face wall;
  wall.normal = Vector2d(std::cos(0.4), std::sin(0.4));
  wall.to_m = 5;
  Face across = wall;
  across.normal = {-wall.normal.y(), wall.normal.x()};
  Face other;
  other.to_m = 3;
  EXPECT_NEAR(MainHeading({wall, across, other}), 0.4, 1e-9);
}

}  // namespace
}  // namespace slcmap
