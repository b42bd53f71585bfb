// Shows that this build is free of a miscompilation: g++ 12.2 at -O3 -DNDEBUG, without the
// -fno-ipa-modref that CMakeLists.txt gives, lets the loop below read a stale y, silently and up to
// 29 px wrong at the corners of an image. This test fails in such a build:
//
//   g++ -std=c++20 -O3 -DNDEBUG -DSLCMAP_CONFIG='"Release"' -I/usr/include/eigen3
//       tests/compiler_test.cc -lgtest -lgtest_main
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <string>

namespace slcmap {
namespace {

// What the radial-tangential model adds to a point on z = 1. Written with vectors by reference and
// an output argument, since that is the form that is miscompiled.
void AddedByDistortion(const Eigen::Vector4d& k, const Eigen::Vector2d& p, Eigen::Vector2d& added) {
  const double x2 = p(0) * p(0), y2 = p(1) * p(1), xy = p(0) * p(1), r2 = x2 + y2;
  const double radial = k[0] * r2 + k[1] * r2 * r2;
  added << p(0) * radial + 2 * k[2] * xy + k[3] * (r2 + 2 * x2),
      p(1) * radial + 2 * k[3] * xy + k[2] * (r2 + 2 * y2);
}

}  // namespace

// The point whose distorted image is `distorted`, by fixed-point iteration. Outside the unnamed
// namespace, so that the compiler sees no caller.
Eigen::Vector2d UndistortByIteration(const Eigen::Vector4d& k, const Eigen::Vector2d& distorted) {
  Eigen::Vector2d added;
  AddedByDistortion(k, distorted, added);
  double x = distorted(0) - added(0), y = distorted(1) - added(1);
  for (int i = 1; i < 60; ++i) {
    AddedByDistortion(k, Eigen::Vector2d(x, y), added);
    x = distorted(0) - added(0);
    y = distorted(1) - added(1);
  }
  return {x, y};
}

namespace {

// The model once more, on plain numbers, which no compiler gets wrong.
double RedistortionError(const Eigen::Vector4d& k, double x, double y,
                         const Eigen::Vector2d& expected) {
  const double r2 = x * x + y * y, radial = 1 + k[0] * r2 + k[1] * r2 * r2;
  const double distorted_x = x * radial + 2 * k[2] * x * y + k[3] * (r2 + 2 * x * x);
  const double distorted_y = y * radial + k[2] * (r2 + 2 * y * y) + 2 * k[3] * x * y;
  return std::hypot(distorted_x - expected.x(), distorted_y - expected.y());
}

TEST(Compiler, UndistortsUpToTheCorners) {
  constexpr double kFx_px = 458.654, kFy_px = 457.296, kCx_px = 367.215, kCy_px = 248.375;
  const Eigen::Vector4d k(-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05);
  double worst_px = 0;
  for (const double u_px : {0.0, 188.0, 376.0, 564.0, 751.0}) {
    for (const double v_px : {0.0, 120.0, 240.0, 360.0, 479.0}) {
      const Eigen::Vector2d distorted((u_px - kCx_px) / kFx_px, (v_px - kCy_px) / kFy_px);
      const Eigen::Vector2d p = UndistortByIteration(k, distorted);
      worst_px = std::max(worst_px, kFx_px * RedistortionError(k, p.x(), p.y(), distorted));
    }
  }
  EXPECT_LT(worst_px, 1e-6);
}

TEST(Compiler, TestsAreBuiltAsWhatIsShipped) {
  if (std::string(SLCMAP_CONFIG) != "Release") GTEST_SKIP() << "a build that is not shipped";
#if defined(NDEBUG) && defined(__OPTIMIZE__)
  SUCCEED();
#else
  FAIL() << "a Release build must be optimised and define NDEBUG, else it hides miscompilations";
#endif
}

}  // namespace
}  // namespace slcmap
