#include "data/simulator/surface_shader.h"

#include <Eigen/Geometry>
#include <cmath>

#include "data/simulator/hashing.h"

namespace slcmap {
namespace {

// Of a lamp's quad: the radiance of the lamp that lies there.
float Emission(const Scene& scene, const SceneQuad& quad) {
  const Eigen::Vector3f centre = quad.a + 0.5f * (quad.u + quad.v);
  const SceneLamp* nearest = nullptr;
  float nearest_m = std::numeric_limits<float>::infinity();
  for (const SceneLamp& lamp : scene.lamps) {
    const float distance_m = (lamp.a + 0.5f * (lamp.u + lamp.v) - centre).norm();
    if (distance_m < nearest_m) {
      nearest_m = distance_m;
      nearest = &lamp;
    }
  }
  return nearest ? nearest->radiance : 0.0f;
}

// Where a quad starts in its tile, in [0, kSide): at random by material, and on from its neighbour.
float OffsetTexels(float origin_m, uint32_t random) {
  const float turns = UnitFloat(random) + origin_m / (TextureTile::kTexel_m * TextureTile::kSide);
  return (turns - std::floor(turns)) * TextureTile::kSide;
}

}  // namespace

SurfaceShader::SurfaceShader(const Scene& scene, const RayScene& quad_rays,
                             const LightBakingOptions& options, const Progress& progress)
    : textures_(scene.materials), light_(LightMaps::Bake(scene, quad_rays, options, progress)) {
  constexpr float kTexelsPerMetre = 1 / TextureTile::kTexel_m;
  for (const SceneQuad& quad : scene.quads) {
    const SurfaceMaterial& material = scene.materials[quad.material];
    Surface s{};
    s.tile = &textures_.Of(material);
    const bool stretched = material.texture == TextureKind::kPoster;
    s.scale_s = stretched ? TextureTile::kSide : kTexelsPerMetre * quad.u.norm();
    s.scale_t = stretched ? TextureTile::kSide : kTexelsPerMetre * quad.v.norm();
    s.offset_s = stretched ? 0 : OffsetTexels(quad.texture_origin.x(), Mixed(material.seed, 1));
    s.offset_t = stretched ? 0 : OffsetTexels(quad.texture_origin.y(), Mixed(material.seed, 2));
    s.texels_per_m =
        stretched ? TextureTile::kSide / std::sqrt(quad.u.cross(quad.v).norm()) : kTexelsPerMetre;
    s.base = material.albedo * (1 - material.contrast);
    s.gain = material.albedo * material.contrast / 128;
    s.emission = material.texture == TextureKind::kLamp ? Emission(scene, quad) : 0;
    surfaces_.push_back(s);
  }
  for (const ScenePatch& seen : SeenPatches(scene)) {
    Patch patch{seen.quad, seen.from.x(), seen.from.y(), seen.size.x(), seen.size.y(), {}};
    Eigen::Vector3f::Map(patch.normal) = seen.normal;
    patches_.push_back(patch);
  }
}

}  // namespace slcmap
