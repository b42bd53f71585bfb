// Panes of clear glass in the way of rays.
#pragma once

#include <vector>

#include "data/simulator/ray_scene.h"
#include "data/simulator/scene.h"

namespace slcmap {

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

}  // namespace slcmap
