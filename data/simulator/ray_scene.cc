#include "data/simulator/ray_scene.h"

#include <algorithm>
#include <string>

#include "data/error.h"

namespace slcmap {
namespace {

RTCIntersectContext Context(RTCIntersectContextFlags flags) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = flags;
  return context;
}

void SetCorners(const std::vector<ScenePatch>& patches, RTCGeometry geometry) {
  auto* corner = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                             RTC_FORMAT_FLOAT3, 3 * sizeof(float),
                                                             4 * patches.size()));
  auto* index = static_cast<uint32_t*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT4, 4 * sizeof(uint32_t), patches.size()));
  if (!corner || !index) throw DataError("scene: too large for the memory");
  for (const ScenePatch& patch : patches) {
    for (const Eigen::Vector3f& p : patch.corners) {
      corner = std::copy(p.data(), p.data() + 3, corner);
    }
  }
  for (uint32_t i = 0; i < 4 * patches.size(); ++i) index[i] = i;
}

}  // namespace

RayScene::RayScene(const std::vector<ScenePatch>& patches)
    : device_(rtcNewDevice("threads=1,set_affinity=0")), scene_(rtcNewScene(device_)) {
  rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_HIGH);
  const RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_QUAD);
  SetCorners(patches, geometry);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene_, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene_);
  const RTCError error = rtcGetDeviceError(device_);
  if (error != RTC_ERROR_NONE) {
    throw DataError("scene: Embree failed with its error " + std::to_string(error));
  }
}

RayScene::~RayScene() {
  rtcReleaseScene(scene_);
  rtcReleaseDevice(device_);
}

void RayScene::Trace(Packet* packet) const {
  RTCIntersectContext context = Context(RTC_INTERSECT_CONTEXT_FLAG_COHERENT);
  rtcIntersect8(packet->active, scene_, &context, &packet->rays);
}

void RayScene::FindBlocked(Packet* packet) const {
  RTCIntersectContext context = Context(RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT);
  rtcOccluded8(packet->active, scene_, &context, &packet->rays.ray);
}

bool RayScene::Blocked(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
                       float range_m) const {
  RTCIntersectContext context = Context(RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT);
  RTCRay ray{};
  ray.org_x = origin.x(), ray.org_y = origin.y(), ray.org_z = origin.z();
  ray.dir_x = direction.x(), ray.dir_y = direction.y(), ray.dir_z = direction.z();
  ray.tfar = range_m;
  ray.mask = ~0u;
  rtcOccluded1(scene_, &context, &ray);
  return ray.tfar < 0;
}

}  // namespace slcmap
