// The light that reaches each surface of a scene, computed once: lamps with their shadows, and the
// ambient light.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "data/progress.h"
#include "data/simulator/ray_scene.h"
#include "data/simulator/scene.h"

namespace slcmap {

struct LightBakingOptions {
  double texel_m = 0.15;
  int packets = 2;     // of RayScene::kLanes rays to the lamps, a texel
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

}  // namespace slcmap
