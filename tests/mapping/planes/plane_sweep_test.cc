// Patches of painted walls, where images say that they are.
#include "mapping/planes/plane_sweep.h"

#include <gtest/gtest.h>

#include "tests/mapping/planes/painted_views.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;

PaintedRectangle Wall(double y, double contrast) {
  return {{-4, y, 0}, {8, 0, 0}, {0, 0, 3}, 120, contrast, 1};
}

PlanePatch PatchAt(double y) {
  return {{0.2, y, 1.5}, -Vector3d::UnitY(), Vector3d::UnitX(), Vector3d::UnitZ(), 0.3};
}

struct Swept {
  std::vector<PatchImage> images;
  PatchSweep sweep;
  SweptPlace place;
};

Swept Sweep(const PaintedViews& painted, const PlanePatch& patch, const PlaneOptions& options = {},
            const SightDepths& depths = {}) {
  const ViewCameras cameras(painted.views(), painted.rig());
  Swept swept;
  swept.images = ImagesOfPatch(patch, painted.views(), cameras, depths, options);
  std::vector<std::array<DepthPyramid, 2>> pyramids(painted.views().size());
  std::vector<SeenPatch> seen;
  for (const PatchImage& image : swept.images) {
    const StereoImage pair = painted.Read(image.view);
    DepthPyramid& pyramid = pyramids[image.view][image.camera];
    pyramid = DepthPyramid(image.camera == 0 ? pair.left : pair.right);
    seen.push_back({&pyramid, cameras.T_camera_world[image.view][image.camera]});
  }
  if (seen.size() < 2) return swept;
  swept.sweep = SweepPatch(patch, seen, painted.rig().cameras[0], options);
  swept.place = BestPlace(swept.sweep.misfit, options);
  return swept;
}

TEST(SweepPatch, FindsAFaintlyPaintedWall) {
  const Swept swept = Sweep(PaintedViews({Wall(2.5, 0.06)}), PatchAt(2.5));
  EXPECT_NEAR(swept.place.offset_m, 0, 0.015);
  EXPECT_LT(swept.place.sigma_m, 0.03);
  EXPECT_GT(swept.place.margin, 8);
  EXPECT_NEAR(swept.sweep.grey, 120, 5);
}

TEST(SweepPatch, FindsAWallBehindThePatch) {
  const Swept swept = Sweep(PaintedViews({Wall(2.62, 0.06)}), PatchAt(2.5));
  EXPECT_NEAR(swept.place.offset_m, -0.12, 0.02);
}

TEST(SweepPatch, KnowsNothingOfABlankWall) {
  EXPECT_LT(Sweep(PaintedViews({Wall(2.5, 0)}), PatchAt(2.5)).place.margin, 4);
}

TEST(SweepPatch, KnowsNothingWhereAllViewsHaveOnePlace) {
  PlaneOptions options;
  options.min_parallax_deg = 0;
  options.window_views = 1;
  options.max_images = 2;
  const PaintedViews painted({Wall(2.5, 0.3)}, 1);
  EXPECT_GT(Sweep(painted, PatchAt(2.5), options).place.sigma_m, 0.005);
}

TEST(BestPlace, IsTheVertexOfTheMisfit) {
  PlaneOptions options;
  std::vector<double> misfit;
  for (int i = -8; i <= 8; ++i) {
    const double off_m = i * options.sweep_step_m - 0.05;
    misfit.push_back(0.5 * off_m * off_m / (0.02 * 0.02));
  }
  const SweptPlace place = BestPlace(misfit, options);
  EXPECT_NEAR(place.offset_m, 0.05, 1e-9);
  EXPECT_NEAR(place.sigma_m, 0.02, 1e-9);
}

TEST(BestPlace, AtTheEndOfTheSweepIsNotKnown) {
  PlaneOptions options;
  std::vector<double> misfit;
  for (int i = -8; i <= 8; ++i) misfit.push_back(i + 8);
  EXPECT_DOUBLE_EQ(BestPlace(misfit, options).sigma_m, options.sweep_m);
}

TEST(ImagesOfPatch, AreOfThoseThatSeeItsFront) {
  const PaintedViews painted({Wall(2.5, 0.1)});
  EXPECT_GE(Sweep(painted, PatchAt(2.5)).images.size(), 6u);
  PlanePatch back = PatchAt(2.5);
  back.normal = -back.normal;
  EXPECT_TRUE(Sweep(painted, back).images.empty());
  EXPECT_TRUE(Sweep(painted, PatchAt(20)).images.empty());
}

TEST(ImagesOfPatch, AreNotHiddenFromIt) {
  const PaintedViews painted({Wall(2.5, 0.1)});
  std::vector<DensePoint> screen;
  for (double x = -1; x < 1; x += 0.04) {
    for (double z = 0.5; z < 2.5; z += 0.04) {
      screen.push_back({{x, 1.5, z}, -Vector3d::UnitY(), 0.01, 100});
    }
  }
  const SightDepths depths(screen, 0.04, ViewCameras(painted.views(), painted.rig()));
  EXPECT_TRUE(Sweep(painted, PatchAt(2.5), {}, depths).images.empty());
}

}  // namespace
}  // namespace slcmap
