// The patches of a scene, ready to be hit by rays (Embree); a camera's rays, panes of clear glass
// in their way, and whether a rig's way stays within its building.
#pragma once

#include <embree3/rtcore.h>

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <vector>

#include "data/core/camera.h"
#include "data/simulator/scene/scene.h"
#include "data/simulator/sequence_writer.h"

namespace slcmap::inline data {

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
  explicit RayScene(const std::vector<SceneQuad>& quads) : RayScene(MakePatches(quads)) {}
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

// Of light from air that meets a pane at the given cosine to its normal: the share that its two
// faces mirror, by Fresnel's equations for unpolarised light, and glass that takes nothing away
// (Hecht, Optics, sections 4.6 and 4.11).
float MirroredShare(float cosine);

class GlassPanes {
 public:
  explicit GlassPanes(const std::vector<ScenePane>& panes);

  // What a packet's rays meet at the next pane.
  struct Mirrored {
    RayScene::Packet rays;          // on from the pane, where there is one
    float share[RayScene::kLanes];  // of the light that is mirrored; 0 without a pane
    float way_m[RayScene::kLanes];  // from the ray's origin to the pane
  };

  // Follows the rays of a packet, which has been traced through what is not glass, to the panes
  // before their hits, from near to far.
  class Way {
   public:
    Way(const GlassPanes& panes, const RayScene::Packet& traced);
    // The next pane of each ray. False where none meets one any more.
    bool Next(Mirrored* mirrored);

   private:
    const RayScene& panes_;
    RayScene::Packet packet_;
    float range_m_[RayScene::kLanes];
  };

  // Whether one is between two places.
  bool Between(const Eigen::Vector3f& from, const Eigen::Vector3f& to) const {
    return panes_.Blocked(from, to - from, 1);
  }

 private:
  RayScene panes_;
};

// The rays of a camera's pixels, several a pixel, laid out to be traced in packets.

// The image is cut into blocks of 4 x 4 pixels. The pixels of one colour of a block's chequerboard
// make up a packet; it is traced once for each of the kSamples rays of a pixel, each time at
// another instant of the exposure. Both colours have the same mean instant.
class CameraRays {
 public:
  static constexpr int kSamples = 4;
  static constexpr int kInstants = 2 * kSamples;  // equally long parts of the exposure
  static constexpr int kBlockColumns = 4, kBlockRows = 4;

  // Unit vectors in the camera frame; all zero where the camera has no ray.
  struct Packet {
    float x[RayScene::kLanes], y[RayScene::kLanes], z[RayScene::kLanes];
  };

  // The rays through the pixels' areas, jittered in strata, the same in each image.
  explicit CameraRays(const Camera& camera);

  int blocks_across() const { return across_; }
  int blocks_down() const { return down_; }
  const Packet& Of(int block, int colour, int sample) const {
    return packets_[(block * 2 + colour) * kSamples + sample];
  }
  float pixel_angle_rad() const { return pixel_angle_rad_; }  // near the axis

  static int Instant(int colour, int sample) { return 2 * sample + ((sample + colour) & 1); }
  // Of a lane, from the block's first.
  static int Row(int lane) { return lane >> 1; }
  static int Column(int lane, int colour) { return 2 * (lane & 1) + ((Row(lane) + colour) & 1); }

 private:
  int across_, down_;
  float pixel_angle_rad_;
  std::vector<Packet> packets_;
};

// Where a way passes through surfaces.
struct WayCrossings {
  int count = 0;
  double first_s = 0;  // of the motion
  Eigen::Vector3d first_place_m = Eigen::Vector3d::Zero();
};

// Follows the left camera from the first frame to the last. Throws ConfigError naming time and
// place where it is beside the scene's surfaces, below them or more than 10 m above, and
// StoppedError where the task's stage ends it.
WayCrossings CheckWay(const Scene& scene, const RenderTask& task);

}  // namespace slcmap::data
