#include "data/simulator/glass_panes.h"

#include <algorithm>
#include <cmath>

namespace slcmap {
namespace {

constexpr float kRefractiveIndex = 1.5f;
constexpr float kBehind_m = 1e-4f;  // a pane that was met, where the next is looked for

std::vector<ScenePatch> PatchesOf(const std::vector<ScenePane>& panes) {
  std::vector<SceneQuad> quads;
  for (const ScenePane& pane : panes) quads.push_back({pane.a, pane.u, pane.v});
  return slcmap::PatchesOf(quads);
}

Eigen::Vector3f DirectionOf(const RTCRay8& ray, int lane) {
  return {ray.dir_x[lane], ray.dir_y[lane], ray.dir_z[lane]};
}

Eigen::Vector3f OriginOf(const RTCRay8& ray, int lane) {
  return {ray.org_x[lane], ray.org_y[lane], ray.org_z[lane]};
}

}  // namespace

float MirroredShare(float cosine) {
  const float inside = std::sqrt(1 - (1 - cosine * cosine) / (kRefractiveIndex * kRefractiveIndex));
  const float across = (cosine - kRefractiveIndex * inside) / (cosine + kRefractiveIndex * inside);
  const float along = (kRefractiveIndex * cosine - inside) / (kRefractiveIndex * cosine + inside);
  const float face = 0.5f * (across * across + along * along);
  return 2 * face / (1 + face);  // to and fro between the faces
}

GlassPanes::GlassPanes(const std::vector<ScenePane>& panes) : panes_(PatchesOf(panes)) {}

GlassPanes::Way::Way(const GlassPanes& panes, const RayScene::Packet& traced)
    : panes_(panes.panes_), packet_(traced) {
  std::copy(std::begin(packet_.rays.ray.tfar), std::end(packet_.rays.ray.tfar), range_m_);
}

bool GlassPanes::Way::Next(Mirrored* mirrored) {
  RTCRay8& ray = packet_.rays.ray;
  RTCHit8& hit = packet_.rays.hit;
  std::fill(std::begin(hit.geomID), std::end(hit.geomID), RayScene::kNoQuad);
  panes_.Trace(&packet_);
  mirrored->rays.Clear();
  bool met = false;
  for (int i = 0; i < RayScene::kLanes; ++i) {
    mirrored->share[i] = 0;
    if (packet_.active[i] == 0 || hit.geomID[i] == RayScene::kNoQuad) {
      packet_.active[i] = 0;
      continue;
    }
    met = true;
    const Eigen::Vector3f along = DirectionOf(ray, i);
    const Eigen::Vector3f normal =
        Eigen::Vector3f(hit.Ng_x[i], hit.Ng_y[i], hit.Ng_z[i]).normalized();
    const float cosine = normal.dot(along);
    mirrored->share[i] = MirroredShare(std::abs(cosine));
    mirrored->way_m[i] = ray.tfar[i];
    mirrored->rays.Set(i, OriginOf(ray, i) + ray.tfar[i] * along, along - 2 * cosine * normal);
    ray.tnear[i] = ray.tfar[i] + kBehind_m;
    ray.tfar[i] = range_m_[i];
  }
  return met;
}

}  // namespace slcmap
