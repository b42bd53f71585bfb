#include <gtest/gtest.h>

#include <numbers>

#include "data/core/error.h"
#include "data/simulator/shading.h"

namespace slcmap {
namespace {

// A floor of 8 x 8 m with a small lamp 3 m above its middle and, if asked for, a screen between.
Scene LitFloor(bool with_screen) {
  Scene scene;
  scene.ambient = 0.1f;
  scene.materials = {{TextureKind::kPlain, 0.5, 0, 1}, {TextureKind::kLamp, 0, 0, 1}};
  scene.quads = {{{-4, -4, 0}, {8, 0, 0}, {0, 8, 0}, 0, {0, 0}},
                 {{-0.1, -0.1, 3}, {0.2, 0, 0}, {0, 0.2, 0}, 1, {0, 0}}};
  scene.lamps = {{{-0.1, -0.1, 3}, {0.2, 0, 0}, {0, 0.2, 0}, 100}};
  if (with_screen) scene.quads.push_back({{-1, -1, 1.5}, {2, 0, 0}, {0, 2, 0}, 0, {0, 0}});
  return scene;
}

constexpr float kStains = 0.17f;  // the largest part by which paint is uneven

TEST(LightBakingTest, LightFallsOffAsOfASmallLamp) {
  const Scene scene = LitFloor(false);
  const LightMaps light = LightMaps::Bake(scene, RayScene(scene.quads), {});
  for (const float x_m : {0.0f, 2.0f, 3.0f}) {
    const float distance2 = 9 + x_m * x_m;
    const float expected =
        0.1f + 100 * 0.04f * 9 / (distance2 * distance2 * std::numbers::pi_v<float>);
    EXPECT_NEAR(light.At(0, true, 0.5f + x_m / 8, 0.5f), expected, kStains * expected) << x_m;
  }
  EXPECT_NEAR(light.At(0, false, 0.5f, 0.5f), 0.1f, kStains * 0.1f);  // from below
}

TEST(LightBakingTest, AScreenThrowsAShadow) {
  const Scene scene = LitFloor(true);
  const LightMaps light = LightMaps::Bake(scene, RayScene(scene.quads), {});
  EXPECT_NEAR(light.At(0, true, 0.5f, 0.5f), 0.1f, kStains * 0.1f);
  EXPECT_NEAR(light.At(0, true, 0.5f + 1.6f / 8, 0.5f), 0.1f, kStains * 0.1f);
  EXPECT_GT(light.At(0, true, 0.5f + 2.6f / 8, 0.5f), 0.12f);
}

TEST(LightBakingTest, RejectsAbsurdOptions) {
  const Scene scene = LitFloor(false);
  LightBakingOptions options;
  options.texel_m = 0;
  EXPECT_THROW(LightMaps::Bake(scene, RayScene(scene.quads), options), ConfigError);
}

TEST(LightBakingTest, RefusesAFloorWithoutEndNamingNumberAndLimit) {
  Scene scene = LitFloor(false);
  scene.quads[0].u.x() = scene.quads[0].v.y() = 1000;
  try {
    LightMaps::Bake(scene, RayScene(scene.quads), {});
    FAIL() << "expected an error";
  } catch (const ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find("takes 32032026 nodes"), std::string::npos)
        << error.what();
    EXPECT_NE(std::string(error.what()).find("at most 30000000 nodes"), std::string::npos);
  }
}

TEST(LightBakingTest, ReportsHowFarItIsAndCanBeEnded) {
  Scene scene = LitFloor(false);
  scene.quads[0].u.x() = scene.quads[0].v.y() = 100;
  double last = 0;
  const Progress heard([&](double done) {
    EXPECT_GE(done, last);
    last = done;
    return true;
  });
  LightMaps::Bake(scene, RayScene(scene.quads), {.texel_m = 1}, heard);
  EXPECT_EQ(last, 1);
  const Progress ended([](double) { return false; });
  EXPECT_THROW(LightMaps::Bake(scene, RayScene(scene.quads), {}, ended), StoppedError);
}

}  // namespace
}  // namespace slcmap
