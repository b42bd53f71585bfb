// Procedural textures, baked to mip-mapped 8-bit tiles that repeat without a seam.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "data/simulator/scene/scene.h"

namespace slcmap::inline data {

// Reflectance relative to the mean: 128 is the mean, 0 is black. Level l has (1024 >> l)^2 texels,
// row by row.
struct TextureTile {
  static constexpr int kLevels = 11;
  static constexpr int kSide = 1 << (kLevels - 1);

  float texel_m = 0;  // of level 0, where the texture is neither scaled nor stretched
  std::array<std::vector<uint8_t>, kLevels> levels;
};

TextureTile MakeTexture(TextureKind kind, uint32_t seed);

// Tiles of the materials of a scene. A kind has a few tiles only, which materials share; posters
// have more.
class TextureSet {
 public:
  explicit TextureSet(const std::vector<SurfaceMaterial>& materials);
  const TextureTile& Of(const SurfaceMaterial& material) const;

 private:
  std::map<std::pair<TextureKind, uint32_t>, TextureTile> tiles_;
};

}  // namespace slcmap::data
