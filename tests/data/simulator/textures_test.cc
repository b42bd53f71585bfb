#include "data/simulator/textures.h"

#include <gtest/gtest.h>

#include <cstdlib>

namespace slcmap {
namespace {

class TextureTest : public ::testing::TestWithParam<TextureKind> {};

// The mean step between two columns of level 1.
double StepBetween(const TextureTile& tile, int column, int next) {
  constexpr int kSide = TextureTile::kSide / 2;
  double sum = 0;
  for (int y = 0; y < kSide; ++y) {
    sum += std::abs(tile.levels[1][y * kSide + column] - tile.levels[1][y * kSide + next]);
  }
  return sum / kSide;
}

TEST_P(TextureTest, KeepsItsMeanOnEachLevelAndHasDetailAtAllScales) {
  const TextureTile tile = MakeTexture(GetParam(), 1);
  for (int l = 0; l < TextureTile::kLevels; ++l) {
    const auto& level = tile.levels[l];
    const double count = static_cast<double>(level.size());
    double sum = 0, sum2 = 0;
    for (const double texel : level) {
      sum += texel;
      sum2 += texel * texel;
    }
    const double mean = sum / count;
    EXPECT_NEAR(mean, 128, 3) << "level " << l;
    if (level.size() < 64) continue;
    EXPECT_GT(sum2 / count - mean * mean, 0.5) << "level " << l;
  }
}

TEST_P(TextureTest, RepeatsWithoutASeam) {
  const TextureTile tile = MakeTexture(GetParam(), 1);
  constexpr int kSide = TextureTile::kSide / 2;
  double largest = 0;
  for (int x = 0; x + 1 < kSide; ++x) largest = std::max(largest, StepBetween(tile, x, x + 1));
  EXPECT_LE(StepBetween(tile, kSide - 1, 0), 1.1 * largest);
}

INSTANTIATE_TEST_SUITE_P(Kinds, TextureTest,
                         ::testing::Values(TextureKind::kPlaster, TextureKind::kConcrete,
                                           TextureKind::kWood, TextureKind::kCarpet,
                                           TextureKind::kBrick, TextureKind::kMetal,
                                           TextureKind::kTiles));

TEST(TextureSetTest, PostersOfOtherSeedsShowOtherThings) {
  const std::vector<SurfaceMaterial> materials = {{TextureKind::kPoster, 0.5, 1, 1},
                                                  {TextureKind::kPoster, 0.5, 1, 2}};
  const TextureSet textures(materials);
  EXPECT_NE(textures.Of(materials[0]).levels[3], textures.Of(materials[1]).levels[3]);
}

}  // namespace
}  // namespace slcmap
