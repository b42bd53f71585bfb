#include "mapping/pipes/pipe_fit.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <cmath>
#include <random>

namespace slcmap {
namespace {

using Eigen::Vector3d;

const Cylinder kTrue{{{0.3, 2, 0.1}, Vector3d(0.1, -0.05, 1).normalized()}, 0.05};

// Rays from views on an arc before the pipe that touch it on both sides, at two places along it;
// off by noise across them.
std::vector<TangentRay> CollectRays(const Cylinder& pipe, double sigma_m, unsigned seed) {
  constexpr int kViews = 24;
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, 1);
  const Vector3d first = pipe.axis.direction_world.unitOrthogonal();
  const Vector3d second = pipe.axis.direction_world.cross(first);
  std::vector<TangentRay> rays;
  for (int view = 0; view < kViews; ++view) {
    const double angle_rad = -0.8 + 1.6 * view / (kViews - 1);
    const Vector3d centre =
        pipe.axis.point_world + 2 * (std::cos(angle_rad) * first + std::sin(angle_rad) * second);
    for (const double side : {-1.0, 1.0}) {
      // As seen along the axis, the tangent meets the circle at this angle from the view.
      const double touching_rad = angle_rad + side * std::acos(pipe.radius_m / 2);
      const Vector3d out = std::cos(touching_rad) * first + std::sin(touching_rad) * second;
      const double off_m = sigma_m * noise(random);  // both ends of an outline share it
      for (const double along_m : {-0.5, 0.5}) {
        const Vector3d p = pipe.axis.point_world + (pipe.radius_m + off_m) * out +
                           along_m * pipe.axis.direction_world;
        rays.push_back({centre, (p - centre).normalized(), std::max(sigma_m, 1e-3), view});
      }
    }
  }
  return rays;
}

const Cylinder kStart{{{0.31, 1.99, 0.1}, Vector3d(0.12, -0.03, 1).normalized()}, 0.06};
const PipeFitOptions kOptions{.images_that_count = 1000};

TEST(PipeFit, OfExactRaysIsExact) {
  const auto fit = FitPipe(kStart, CollectRays(kTrue, 0, 1), kOptions);
  ASSERT_TRUE(fit);
  const PointAndDirection& axis = fit->cylinder.axis;
  EXPECT_LT((NearestOn(kTrue.axis, axis.point_world) - axis.point_world).norm(), 1e-6);
  // Held weakly to the direction that it starts with.
  EXPECT_LT(axis.direction_world.cross(kTrue.axis.direction_world).norm(), 1e-4);
  EXPECT_NEAR(fit->cylinder.radius_m, 0.05, 1e-6);
  EXPECT_EQ(fit->images, 24);
}

TEST(PipeFit, ErrsAsItsCovarianceSays) {
  constexpr int kTries = 200;
  constexpr double kSigma_m = 0.001;
  double squared = 0, off_m2 = 0;
  for (unsigned seed = 0; seed < kTries; ++seed) {
    // Without its robust loss, which takes noise for outliers.
    const auto fit = FitPipe(kStart, CollectRays(kTrue, kSigma_m, seed),
                             {.robust_sigmas = 1e3, .images_that_count = 1000});
    ASSERT_TRUE(fit);
    const double off_m = fit->cylinder.radius_m - kTrue.radius_m;
    off_m2 += off_m * off_m;
    squared += std::pow(off_m / fit->radius_sigma_m(), 2);
  }
  EXPECT_LT(std::sqrt(off_m2 / kTries), 0.0005);
  // The two rays to an outline err alike, so there is half of what the fit counts.
  EXPECT_NEAR(std::sqrt(squared / kTries), std::sqrt(2.0), 0.25);
}

TEST(PipeFit, OfRaysAlongTheAxisThereIsNone) {
  std::vector<TangentRay> rays;
  for (int i = 0; i < 20; ++i) {
    rays.push_back({Vector3d(0.3, 2, -3 - i), kTrue.axis.direction_world, 0.001, i});
  }
  EXPECT_FALSE(FitPipe(kStart, rays, kOptions));
}

}  // namespace
}  // namespace slcmap
