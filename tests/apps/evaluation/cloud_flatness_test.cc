#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "apps/evaluation/straightness.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;

std::vector<Vector3d> Corner(double sigma_m, double apart_m, double step_m = 0.04) {
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0, sigma_m);
  std::vector<Vector3d> points;
  int odd = 0;
  for (double a = 0; a < 2; a += step_m) {
    for (double b = 0; b < 2; b += step_m) {
      points.emplace_back(noise(random) + (++odd % 2) * apart_m, a, b);
      points.emplace_back(a, noise(random), b);
      points.emplace_back(a, b, noise(random));
    }
  }
  return points;
}

// Without the edges of the corner, where neighbourhoods reach over two faces.
FlatnessOptions SmallRadius() {
  FlatnessOptions options;
  options.radius_m = 0.15;
  return options;
}

TEST(CloudFlatness, OrthogonalPlanesHaveTheVarianceOfTheirNoise) {
  const auto metrics = MeasureFlatness(Corner(0.003, 0), SmallRadius());
  ASSERT_TRUE(metrics);
  ASSERT_TRUE(metrics->mom_m2);
  EXPECT_GT(metrics->on_planes, metrics->looked_at / 2);
  EXPECT_GT(*metrics->mom_m2, 8e-6);
  EXPECT_LT(metrics->mom_m2.value(), metrics->mpv_m2);
}

TEST(CloudFlatness, AWallThatIsThereTwiceIsLessFlat) {
  const auto once = MeasureFlatness(Corner(0.003, 0), SmallRadius());
  const auto twice = MeasureFlatness(Corner(0.003, 0.01), SmallRadius());
  EXPECT_GT(twice->mpv_m2, once->mpv_m2 + 5e-6);
  EXPECT_GT(*twice->mom_m2, *once->mom_m2 + 5e-6);
  EXPECT_GT(twice->mme, once->mme);
}

TEST(CloudFlatness, TheSameTurnedOrThinnedScoresTheSame) {
  const auto as_is = MeasureFlatness(Corner(0.003, 0), SmallRadius());
  std::vector<Vector3d> turned = Corner(0.003, 0), thinned;
  const Eigen::Isometry3d turn =
      Eigen::Translation3d(30, -20, 5) * Eigen::AngleAxisd(0.8, Vector3d(1, 2, 3).normalized());
  for (Vector3d& p : turned) p = turn * p;
  const auto after = MeasureFlatness(turned, SmallRadius());
  EXPECT_NEAR(after->mpv_m2, as_is->mpv_m2, 0.01 * as_is->mpv_m2);
  EXPECT_NEAR(after->mme, as_is->mme, 0.01);
  EXPECT_NEAR(*after->mom_m2, *as_is->mom_m2, 0.03 * *as_is->mom_m2);
  std::mt19937 random(2);
  for (const Vector3d& p : turned) {
    if (random() % 2 == 0) thinned.push_back(p);
  }
  const auto few = MeasureFlatness(thinned, SmallRadius());
  // Near the edges of the corner other neighbourhoods count as planes.
  EXPECT_NEAR(few->mpv_m2, as_is->mpv_m2, 0.1 * as_is->mpv_m2);
  EXPECT_NEAR(*few->mom_m2, *as_is->mom_m2, 0.15 * *as_is->mom_m2);
}

TEST(CloudFlatness, LonelyPointsAreNoCloud) {
  EXPECT_FALSE(MeasureFlatness({}, {}));
  EXPECT_FALSE(MeasureFlatness({{0, 0, 0}, {5, 0, 0}}, {}));
}

}  // namespace
}  // namespace slcmap
