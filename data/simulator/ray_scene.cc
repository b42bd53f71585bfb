#include "data/simulator/ray_scene.h"

#include <spdlog/fmt/fmt.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "data/core/error.h"
#include "data/simulator/scene/camera_response.h"

namespace slcmap::inline data {
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

namespace {

constexpr float kRefractiveIndex = 1.5f;
constexpr float kBehind_m = 1e-4f;  // a pane that was met, where the next is looked for

std::vector<ScenePatch> MakePatches(const std::vector<ScenePane>& panes) {
  std::vector<SceneQuad> quads;
  for (const ScenePane& pane : panes) quads.push_back({pane.a, pane.u, pane.v});
  return slcmap::MakePatches(quads);
}

Eigen::Vector3f GetDirection(const RTCRay8& ray, int lane) {
  return {ray.dir_x[lane], ray.dir_y[lane], ray.dir_z[lane]};
}

Eigen::Vector3f GetOrigin(const RTCRay8& ray, int lane) {
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

GlassPanes::GlassPanes(const std::vector<ScenePane>& panes) : panes_(MakePatches(panes)) {}

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
    const Eigen::Vector3f along = GetDirection(ray, i);
    const Eigen::Vector3f normal =
        Eigen::Vector3f(hit.Ng_x[i], hit.Ng_y[i], hit.Ng_z[i]).normalized();
    const float cosine = normal.dot(along);
    mirrored->share[i] = MirroredShare(std::abs(cosine));
    mirrored->way_m[i] = ray.tfar[i];
    mirrored->rays.Set(i, GetOrigin(ray, i) + ray.tfar[i] * along, along - 2 * cosine * normal);
    ray.tnear[i] = ray.tfar[i] + kBehind_m;
    ray.tfar[i] = range_m_[i];
  }
  return met;
}

namespace {

// Rays at every other pixel border, between which a model of a lens is as good as linear: off by
// 1e-3 px for the strongest distortion in use.
class RayGrid {
 public:
  RayGrid(const Camera& camera, int columns_px, int rows_px)
      : columns_(columns_px / kStep_px + 1), rays_(columns_ * (rows_px / kStep_px + 1)) {
    for (size_t i = 0; i < rays_.size(); ++i) {
      const int x = static_cast<int>(i) % columns_, y = static_cast<int>(i) / columns_;
      const auto ray = camera.Unproject({kStep_px * x - 0.5, kStep_px * y - 0.5});
      rays_[i] = ray ? Eigen::Vector3f(ray->cast<float>()) : Eigen::Vector3f(0, 0, 0);
    }
  }

  // At the pixel position (x - 0.5, y - 0.5); zero where there is none.
  Eigen::Vector3f At(float x, float y) const {
    const int xi = static_cast<int>(x) / kStep_px, yi = static_cast<int>(y) / kStep_px;
    const float fx = x / kStep_px - static_cast<float>(xi);
    const float fy = y / kStep_px - static_cast<float>(yi);
    const Eigen::Vector3f* p = &rays_[yi * columns_ + xi];
    const Eigen::Vector3f* q = p + columns_;
    for (const Eigen::Vector3f& corner : {p[0], p[1], q[0], q[1]}) {
      if (corner.isZero()) return corner;
    }
    return ((1 - fy) * ((1 - fx) * p[0] + fx * p[1]) + fy * ((1 - fx) * q[0] + fx * q[1]))
        .normalized();
  }

 private:
  static constexpr int kStep_px = 2;
  int columns_;
  std::vector<Eigen::Vector3f> rays_;
};

// Pixels a radian along x, in the middle of the image.
double MiddleFocalX_px(const Camera& camera) {
  return camera.fx_px * (camera.MiddleFocal_px() / std::sqrt(camera.fx_px * camera.fy_px));
}

// Of a pixel's sample, in [0, 1): one in each quarter, in an order that differs by pixel, so that
// the instant of a sample tells nothing about its place.
Eigen::Vector2f Jitter(uint32_t pixel, uint32_t sample) {
  const uint32_t hash = Mixed(pixel, 7);
  const uint32_t stratum = (sample * (hash & 1 ? 1 : 3) + (hash >> 1)) & 3;
  const uint32_t a = Mixed(pixel, 10 + sample), b = Mixed(pixel, 20 + sample);
  return {0.5f * (static_cast<float>(stratum & 1) + UnitFloat(a)),
          0.5f * (static_cast<float>(stratum >> 1 ^ (stratum & 1)) + UnitFloat(b))};
}

}  // namespace

CameraRays::CameraRays(const Camera& camera)
    : across_((camera.width_px + kBlockColumns - 1) / kBlockColumns),
      down_((camera.height_px + kBlockRows - 1) / kBlockRows),
      pixel_angle_rad_(static_cast<float>(1 / MiddleFocalX_px(camera))),
      packets_(across_ * down_ * 2 * kSamples) {
  const RayGrid grid(camera, across_ * kBlockColumns, down_ * kBlockRows);
  for (size_t i = 0; i < packets_.size(); ++i) {
    const int sample = static_cast<int>(i) % kSamples;
    const int colour = static_cast<int>(i) / kSamples % 2;
    const int block = static_cast<int>(i) / kSamples / 2;
    for (int lane = 0; lane < RayScene::kLanes; ++lane) {
      const int x = block % across_ * kBlockColumns + Column(lane, colour);
      const int y = block / across_ * kBlockRows + Row(lane);
      const bool inside = x < camera.width_px && y < camera.height_px;
      const Eigen::Vector2f at =
          Jitter(static_cast<uint32_t>(y * camera.width_px + x), static_cast<uint32_t>(sample));
      const Eigen::Vector3f ray =
          inside ? grid.At(static_cast<float>(x) + at.x(), static_cast<float>(y) + at.y())
                 : Eigen::Vector3f(Eigen::Vector3f::Zero());
      packets_[i].x[lane] = ray.x();
      packets_[i].y[lane] = ray.y();
      packets_[i].z[lane] = ray.z();
    }
  }
}

namespace {

constexpr double kPathStep_s = 0.05;
constexpr float kHeadroom_m = 10;  // a scene may have no ceiling

Eigen::AlignedBox3f ComputeBounds(const Scene& scene) {
  Eigen::AlignedBox3f bounds;
  for (const ScenePatch& patch : SeenPatches(scene)) {
    for (const Eigen::Vector3f& p : patch.corners) bounds.extend(p);
  }
  bounds.max().z() += kHeadroom_m;
  return bounds;
}

std::string Shown(const Eigen::Vector3f& p) {
  return fmt::format("({:.2f}, {:.2f}, {:.2f})", p.x(), p.y(), p.z());
}

}  // namespace

WayCrossings CheckWay(const Scene& scene, const RenderTask& task) {
  const Progress progress = task.Stage("following the way");
  const Eigen::AlignedBox3f bounds = ComputeBounds(scene);
  const RayScene rays(SeenPatches(scene));
  std::optional<GlassPanes> panes;
  if (!scene.panes.empty()) panes.emplace(scene.panes);
  WayCrossings crossings;
  Eigen::Vector3f before = Eigen::Vector3f::Zero();
  const double first_s = task.times_s.front(), last_s = task.times_s.back();
  const auto steps = static_cast<int64_t>((last_s - first_s) / kPathStep_s) + 1;
  for (int64_t i = 0; i <= steps; ++i) {
    if (i % 256 == 0)
      progress.ReportOrStop(static_cast<double>(i) / static_cast<double>(steps + 1));
    const double t_s = std::min(first_s + static_cast<double>(i) * kPathStep_s, last_s);
    const RigidTransform T_world_left = task.motion.PoseAt(t_s) * task.rig.T_imu_camera[0];
    const Eigen::Vector3f place = T_world_left.translation.cast<float>();
    if (!bounds.contains(place)) {
      throw ConfigError(fmt::format(
          "simulate: {:.2f} s into the motion the left camera is at {} m, outside the building, "
          "expected it between {} and {}",
          t_s, Shown(place), Shown(bounds.min()), Shown(bounds.max())));
    }
    if (i > 0 &&
        (rays.Blocked(before, place - before, 1) || (panes && panes->Between(before, place)))) {
      if (crossings.count++ == 0) {
        crossings.first_s = t_s;
        crossings.first_place_m = place.cast<double>();
      }
    }
    before = place;
  }
  return crossings;
}

}  // namespace slcmap::data
