// The patches of a scene, ready to be hit by rays (Embree).
#pragma once

#include <embree3/rtcore.h>

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <vector>

#include "data/simulator/scene.h"

namespace slcmap {

// Rays of one packet should be neighbours: they are traced together.
class RayScene {
 public:
  static constexpr int kLanes = 8;  // what AVX2 traces as one
  static constexpr uint32_t kNoQuad = RTC_INVALID_GEOMETRY_ID;

  // The first hit of each ray. u and v are the hit's fractions along the sides of its patch.
  struct alignas(64) Packet {
    RTCRayHit8 rays;
    alignas(64) int active[kLanes];  // -1: traced, 0: not

    void Clear();
    void Set(int lane, const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
             float range_m = std::numeric_limits<float>::infinity());
  };

  explicit RayScene(const std::vector<ScenePatch>& patches);
  explicit RayScene(const std::vector<SceneQuad>& quads) : RayScene(PatchesOf(quads)) {}
  RayScene(const RayScene&) = delete;
  RayScene& operator=(const RayScene&) = delete;
  ~RayScene();

  // patch of lane i: packet->rays.hit.primID[i] where geomID[i] is not kNoQuad; distance: ray.tfar
  void Trace(Packet* packet) const;

  // Sets ray.tfar to minus infinity where something is in the way within the range.
  void FindBlocked(Packet* packet) const;

  bool Blocked(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
               float range_m) const;

 private:
  RTCDevice device_;
  RTCScene scene_;
};

inline void RayScene::Packet::Clear() {
  for (int i = 0; i < kLanes; ++i) {
    active[i] = 0;
    rays.ray.tnear[i] = 0;
    rays.ray.time[i] = 0;
    rays.ray.mask[i] = ~0u;
    rays.ray.id[i] = 0;
    rays.ray.flags[i] = 0;
    rays.ray.tfar[i] = -std::numeric_limits<float>::infinity();
    rays.ray.org_x[i] = rays.ray.org_y[i] = rays.ray.org_z[i] = 0;
    rays.ray.dir_x[i] = rays.ray.dir_y[i] = rays.ray.dir_z[i] = 0;
    rays.hit.geomID[i] = kNoQuad;
    rays.hit.instID[0][i] = kNoQuad;
  }
}

inline void RayScene::Packet::Set(int lane, const Eigen::Vector3f& origin,
                                  const Eigen::Vector3f& direction, float range_m) {
  active[lane] = -1;
  rays.ray.org_x[lane] = origin.x();
  rays.ray.org_y[lane] = origin.y();
  rays.ray.org_z[lane] = origin.z();
  rays.ray.dir_x[lane] = direction.x();
  rays.ray.dir_y[lane] = direction.y();
  rays.ray.dir_z[lane] = direction.z();
  rays.ray.tfar[lane] = range_m;
}

}  // namespace slcmap
