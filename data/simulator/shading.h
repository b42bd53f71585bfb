// The light that reaches each surface of a scene, computed once (lamps with their shadows, and the
// ambient light), and the radiance of the surfaces towards a camera.
// Procedural textures, baked to mip-mapped 8-bit tiles that repeat without a seam.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <map>
#include <vector>

#include "data/core/progress.h"
#include "data/core/types.h"
#include "data/simulator/ray_scene.h"
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

struct LightBakingOptions {
  double texel_m = 0.15;
  int threads = 2;     // the result is the same with any
  void Check() const;  // throws ConfigError
};

// Per quad a grid of nodes over its area for the front and one for the back. A surface of albedo a
// sends out a times the light there, as radiance.
class LightMaps {
 public:
  // Throws ConfigError naming the number of nodes and the limit where the scene is too large, and
  // StoppedError where progress ends it.
  static LightMaps Bake(const Scene& scene, const RayScene& rays, const LightBakingOptions& options,
                        const Progress& progress = {});

  // s and t in [0, 1]: fractions along the sides of the quad. Bilinear.
  float At(uint32_t quad, bool front, float s, float t) const {
    const Grid& grid = grids_[quad];
    const float x = s * static_cast<float>(grid.columns - 1);
    const float y = t * static_cast<float>(grid.rows - 1);
    const int xi = std::min(static_cast<int>(x), grid.columns - 2);
    const int yi = std::min(static_cast<int>(y), grid.rows - 2);
    const float fx = x - static_cast<float>(xi), fy = y - static_cast<float>(yi);
    const float* p = &values_[grid.first[front ? 0 : 1] + yi * grid.columns + xi];
    const float* q = p + grid.columns;
    return (1 - fy) * (p[0] + fx * (p[1] - p[0])) + fy * (q[0] + fx * (q[1] - q[0]));
  }

  size_t size() const { return values_.size(); }

 private:
  struct Grid {
    int columns, rows;  // nodes, at least 2
    uint32_t first[2];  // of the front and of the back, in values_
  };
  friend class LightBaker;

  std::vector<Grid> grids_;
  std::vector<float> values_;
};

// The radiance of a scene's surfaces towards a camera.

class SurfaceShader {
 public:
  // Bakes the light with the rays of the scene's quads. Throws as LightMaps::Bake does.
  SurfaceShader(const Scene& scene, const RayScene& quad_rays, const LightBakingOptions& options,
                const Progress& progress = {});

  struct Hit {
    uint32_t patch;  // of SeenPatches
    float s, t;      // fractions along the sides of the patch
    float distance_m;
    Eigen::Vector3f ray;  // unit direction
    float footprint_rad;  // angle that the sample stands for
    float dither;         // in [0, 1), constant for a pixel: mixes the texture's levels
  };
  float ComputeRadiance(const Hit& hit) const;

 private:
  struct Surface {
    const TextureTile* tile;
    float scale_s, scale_t;    // texels of level 0 along the sides of the quad
    float offset_s, offset_t;  // texels
    float texels_per_m;
    float base, gain;  // albedo = base + gain * texel
    float emission;    // above 0: a lamp
  };
  struct Patch {
    uint32_t quad;
    float from_s, from_t, size_s, size_t;  // fractions along the sides of the quad
    float normal[3];                       // of the front
  };

  std::vector<Surface> surfaces_;  // by quad
  std::vector<Patch> patches_;
  TextureSet textures_;
  LightMaps light_;
};

// log2 to within 0.1.
inline float CoarseLog2(float x) {
  const uint32_t bits = std::bit_cast<uint32_t>(x);
  return static_cast<float>(bits) * 0x1p-23f - 126.95f;
}

inline float SurfaceTexel(const TextureTile& tile, int level, float x, float y) {
  const int side = TextureTile::kSide >> level;
  const float scale = std::bit_cast<float>(static_cast<uint32_t>(127 - level) << 23);  // 2^-level
  const float xs = x * scale + (static_cast<float>(side) - 0.5f);
  const float ys = y * scale + (static_cast<float>(side) - 0.5f);
  const int xi = static_cast<int>(xs), yi = static_cast<int>(ys), mask = side - 1;
  const float fx = xs - static_cast<float>(xi), fy = ys - static_cast<float>(yi);
  const uint8_t* texels = tile.levels[level].data();
  const uint8_t* p = texels + (yi & mask) * side;
  const uint8_t* q = texels + ((yi + 1) & mask) * side;
  const int a = xi & mask, b = (xi + 1) & mask;
  const float above = static_cast<float>(p[a]) + fx * static_cast<float>(p[b] - p[a]);
  const float below = static_cast<float>(q[a]) + fx * static_cast<float>(q[b] - q[a]);
  return above + fy * (below - above);
}

inline float SurfaceShader::ComputeRadiance(const Hit& hit) const {
  const Patch& patch = patches_[hit.patch];
  const Surface& surface = surfaces_[patch.quad];
  if (surface.emission > 0) return surface.emission;
  const float s = patch.from_s + hit.s * patch.size_s, t = patch.from_t + hit.t * patch.size_t;
  const float cosine =
      patch.normal[0] * hit.ray.x() + patch.normal[1] * hit.ray.y() + patch.normal[2] * hit.ray.z();
  const float light = light_.At(patch.quad, cosine < 0, s, t);
  // The footprint is an ellipse, longer by 1 / cosine; its mean size blurs no direction too much.
  const float texels2 = hit.distance_m * hit.footprint_rad * surface.texels_per_m;
  const float lod =
      CoarseLog2(texels2 * texels2 / std::max(std::abs(cosine), 0.05f) + 1e-6f) * 0.5f + hit.dither;
  const int level = std::clamp(static_cast<int>(lod), 0, TextureTile::kLevels - 1);
  const float texel = SurfaceTexel(*surface.tile, level, surface.offset_s + s * surface.scale_s,
                                   surface.offset_t + t * surface.scale_t);
  return light * (surface.base + surface.gain * texel);
}

// The dots that the emitter of a depth camera throws: adds to a camera's radiance what dots light,
// from a projector in the middle between the cameras that looks as the left one does. depth_m:
// float, along that camera's optical axis, 0: nothing.
void AddDots(const Rig& rig, int camera, const cv::Mat& depth_m, cv::Mat* radiance);

}  // namespace slcmap::data
