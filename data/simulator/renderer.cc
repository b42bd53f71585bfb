#include "data/simulator/renderer.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <optional>

#include "data/core/error.h"
#include "data/io/file.h"
#include "data/io/ply.h"
#include "data/simulator/ray_scene.h"
#include "data/simulator/scene/camera_response.h"
#include "data/simulator/scene/inexact_building.h"
#include "data/simulator/shading.h"
#include "data/simulator/truth.h"

namespace slcmap::inline data {
namespace {

constexpr double kEdgeSample_m = 0.02;    // along an edge
constexpr double kEdgeInterval_s = 0.25;  // between the frames that are looked at
constexpr double kEdgeRange_m = 30;       // up to which a camera counts as seeing

constexpr int kLanes = RayScene::kLanes;

// Of a camera at one instant.
struct RayPose {
  Eigen::Matrix3f R_world_camera;
  Eigen::Vector3f origin_world;
};

RayPose ToRayPose(const RigidTransform& T_world_camera) {
  return {T_world_camera.rotation.toRotationMatrix().cast<float>(),
          T_world_camera.translation.cast<float>()};
}

// Of the rows of a block.
using RowPoses = std::array<RayPose, CameraRays::kBlockRows>;

RowPoses AllRowsAt(const RayPose& pose) {
  RowPoses poses;
  poses.fill(pose);
  return poses;
}

// Places a camera's rays in the world. Lanes without a ray stay inactive.
void Aim(const CameraRays::Packet& rays, const RowPoses& poses, RayScene::Packet* packet) {
  RTCRay8& out = packet->rays.ray;
  for (int i = 0; i < kLanes; ++i) {
    const RayPose& pose = poses[CameraRays::Row(i)];
    const Eigen::Matrix3f& R = pose.R_world_camera;
    const float x = rays.x[i], y = rays.y[i], z = rays.z[i];
    out.org_x[i] = pose.origin_world.x();
    out.org_y[i] = pose.origin_world.y();
    out.org_z[i] = pose.origin_world.z();
    out.dir_x[i] = R(0, 0) * x + R(0, 1) * y + R(0, 2) * z;
    out.dir_y[i] = R(1, 0) * x + R(1, 1) * y + R(1, 2) * z;
    out.dir_z[i] = R(2, 0) * x + R(2, 1) * y + R(2, 2) * z;
    packet->rays.hit.geomID[i] = RayScene::kNoQuad;
    const bool has_ray = x * x + y * y + z * z > 0;
    packet->active[i] = has_ray ? -1 : 0;
    out.tfar[i] = (has_ray ? 1 : -1) * std::numeric_limits<float>::infinity();
  }
}

class SceneRenderer : public PairRenderer {
 public:
  SceneRenderer(const Scene& scene, const RendererOptions& options, const RenderTask& task)
      : scene_(scene),
        options_(options),
        task_(task),
        rays_(SeenPatches(scene_)),
        shader_(MakeShader()),
        watch_(scene_, rays_, task_) {
    for (int i = 0; i < CameraCount(task.rig); ++i) {
      const Camera& camera = task.rig.cameras[i];
      camera_rays_.emplace_back(camera);
      responses_.emplace_back(options.camera, camera.width_px, camera.height_px);
    }
    if (!scene_.panes.empty()) panes_.emplace(scene_.panes);
    const Progress progress = task.Stage("metering");
    std::vector<double> radiance;
    for (const double t_s : task.times_s) {
      progress.ReportOrStop(static_cast<double>(radiance.size()) /
                            static_cast<double>(task.times_s.size()));
      radiance.push_back(MeanRadiance(t_s));
    }
    exposures_ = PlanExposures(task.times_s, radiance, options.camera);
  }

  RenderedPair Render(int frame, bool with_depth) override {
    RenderedPair pair;
    for (int i = 0; i < CameraCount(task_.rig); ++i) {
      cv::Mat& image = i == 0 ? pair.left : i == 1 ? pair.right : pair.others.emplace_back();
      image = responses_[i].Develop(LitImage(frame, i), exposures_[frame], frame, i);
    }
    if (with_depth) pair.depth_m = DepthImage(frame, 0);
    watch_.Look(frame);
    return pair;
  }

  void WriteTruth(const std::string& folder, int frames) override {
    if (!task_.stop.stop_requested()) {
      for (int frame = 0; frame < frames; ++frame) watch_.Look(frame);  // if it was not rendered
    }
    WriteEdges(folder, scene_, watch_.Parts());
    WriteSurfaces(folder + "/surfaces.ply");
    WriteTrueBuilding(folder + "/building.json", ObserveBuilding(scene_, rays_, task_, frames));
    WriteTruePipes(folder + "/pipes.csv", ObservePipes(scene_, rays_, task_, frames));
    if (!scene_.tags.empty()) WriteTrueControl(folder + "/control.csv", scene_);
    if (scene_.inexact) WriteInexact(folder + "/inexact.yaml", *scene_.inexact);
  }

 private:
  SurfaceShader MakeShader() const {
    const Progress progress = task_.Stage("baking light");
    if (scene_.patches.empty()) return {scene_, rays_, options_.light, progress};
    return {scene_, RayScene(scene_.quads), options_.light, progress};
  }

  void StopIfAsked() const {
    if (task_.stop.stop_requested()) throw StoppedError("interrupted");
  }

  RayPose PoseAt(double t_s, int camera) const {
    return ToRayPose(task_.motion.PoseAt(t_s) * task_.rig.T_imu_camera[camera]);
  }

  // What automatic exposure looks at: one ray in every few blocks. The square of the mean root
  // lets lamps and windows count less.
  double MeanRadiance(double t_s) const {
    constexpr int kStride = 97;  // of blocks; 752 x 480 has 22560
    const CameraRays& rays = camera_rays_[0];
    const RayPose pose = PoseAt(t_s, 0);
    RayScene::Packet packet;
    packet.Clear();
    float radiance[kLanes];
    double sum = 0;
    int count = 0;
    for (int block = 0; block < rays.blocks_across() * rays.blocks_down(); block += kStride) {
      Aim(rays.Of(block, 0, 0), AllRowsAt(pose), &packet);
      Shade(&packet, 0, block, radiance);
      if (packet.active[0] == 0) continue;
      sum += std::sqrt(radiance[0]);
      ++count;
    }
    return count > 0 ? sum / count * (sum / count) : 0;
  }

  // Radiance of each lane; 0 where nothing is hit.
  void Shade(RayScene::Packet* packet, int camera, int block, float* radiance) const {
    rays_.Trace(packet);
    constexpr float kHere_m[kLanes] = {};
    ShadeHits(*packet, kHere_m, camera, block, radiance);
    if (panes_) AddMirrored(*packet, camera, block, radiance);
  }

  // Of what traced rays have hit, which have gone some way before they began.
  void ShadeHits(const RayScene::Packet& packet, const float* way_m, int camera, int block,
                 float* radiance) const {
    const RTCRay8& ray = packet.rays.ray;
    const RTCHit8& hit = packet.rays.hit;
    const float footprint_rad = 0.7f * camera_rays_[camera].pixel_angle_rad();
    for (int i = 0; i < kLanes; ++i) {
      radiance[i] = 0;
      if (packet.active[i] == 0 || hit.geomID[i] == RayScene::kNoQuad) continue;
      const float dither = UnitFloat(Mixed(static_cast<uint32_t>(block * kLanes + i)));
      radiance[i] = shader_.ComputeRadiance({hit.primID[i],
                                             hit.u[i],
                                             hit.v[i],
                                             way_m[i] + ray.tfar[i],
                                             {ray.dir_x[i], ray.dir_y[i], ray.dir_z[i]},
                                             footprint_rad,
                                             dither});
    }
  }

  // What panes before the hits mirror, and less of what is behind them. Panes are not mirrored in
  // each other.
  void AddMirrored(const RayScene::Packet& traced, int camera, int block, float* radiance) const {
    constexpr int kMostPanes = 4;  // one behind the other
    float through[kLanes], sum[kLanes] = {}, seen[kLanes];
    std::fill(through, through + kLanes, 1.0f);
    GlassPanes::Way way(*panes_, traced);
    GlassPanes::Mirrored mirrored;
    for (int pane = 0; pane < kMostPanes && way.Next(&mirrored); ++pane) {
      rays_.Trace(&mirrored.rays);
      ShadeHits(mirrored.rays, mirrored.way_m, camera, block, seen);
      for (int i = 0; i < kLanes; ++i) {
        sum[i] += through[i] * mirrored.share[i] * seen[i];
        through[i] *= 1 - mirrored.share[i];
      }
    }
    for (int i = 0; i < kLanes; ++i) radiance[i] = sum[i] + through[i] * radiance[i];
  }

  using InstantPoses = std::array<RowPoses, CameraRays::kInstants>;

  // Over the exposure of a block's rows, which is centred on the time of each.
  InstantPoses PosesOfBlock(int frame, int camera, int first_row) const {
    const double exposure_s = 1e-3 * exposures_[frame].time_ms;
    const bool rolls = task_.rig.readout_s[camera] != 0;
    InstantPoses poses;
    for (int k = 0; k < CameraRays::kInstants; ++k) {
      const double part = (k + 0.5) / CameraRays::kInstants - 0.5;
      const auto pose_of = [&](int row) {
        return PoseAt(task_.times_s[frame] + RowTime_s(task_.rig, camera, row) + part * exposure_s,
                      camera);
      };
      poses[k] = AllRowsAt(pose_of(first_row));
      for (int r = 1; rolls && r < CameraRays::kBlockRows; ++r)
        poses[k][r] = pose_of(first_row + r);
    }
    return poses;
  }

  // Mean over the pixels' areas and over the exposure.
  cv::Mat RadianceImage(int frame, int camera) const {
    const Camera& model = task_.rig.cameras[camera];
    cv::Mat image(model.height_px, model.width_px, CV_32F);
    const CameraRays& rays = camera_rays_[camera];
    const bool rolls = task_.rig.readout_s[camera] != 0;
    InstantPoses poses = PosesOfBlock(frame, camera, 0);
    RayScene::Packet packet;
    packet.Clear();
    for (int block = 0; block < rays.blocks_across() * rays.blocks_down(); ++block) {
      if (block % 1024 == 0) StopIfAsked();
      if (rolls && block % rays.blocks_across() == 0) {
        poses = PosesOfBlock(frame, camera, block / rays.blocks_across() * CameraRays::kBlockRows);
      }
      for (const int colour : {0, 1}) PaintHalf(camera, block, colour, poses, &packet, &image);
    }
    return image;
  }

  // With the dots of an emitter that is on.
  cv::Mat LitImage(int frame, int camera) const {
    cv::Mat radiance = RadianceImage(frame, camera);
    const bool is_on = task_.emitter == Emitter::kSteady ||
                       (task_.emitter == Emitter::kAlternating && frame % 2 == 0);
    if (is_on) AddDots(task_.rig, camera, DepthImage(frame, camera), &radiance);
    return radiance;
  }

  // The pixels of one colour of a block.
  void PaintHalf(int camera, int block, int colour, const InstantPoses& poses,
                 RayScene::Packet* packet, cv::Mat* image) const {
    const CameraRays& rays = camera_rays_[camera];
    float sum[kLanes] = {}, radiance[kLanes];
    for (int sample = 0; sample < CameraRays::kSamples; ++sample) {
      Aim(rays.Of(block, colour, sample), poses[CameraRays::Instant(colour, sample)], packet);
      Shade(packet, camera, block, radiance);
      for (int i = 0; i < kLanes; ++i) sum[i] += radiance[i];
    }
    const int x0 = block % rays.blocks_across() * CameraRays::kBlockColumns;
    const int y0 = block / rays.blocks_across() * CameraRays::kBlockRows;
    for (int i = 0; i < kLanes; ++i) {
      const int x = x0 + CameraRays::Column(i, colour), y = y0 + CameraRays::Row(i);
      if (x < image->cols && y < image->rows)
        image->at<float>(y, x) = sum[i] / CameraRays::kSamples;
    }
  }

  // Along the optical axis of a camera in the middle of a row's exposure, at pixel centres.
  cv::Mat DepthImage(int frame, int index) const {
    const Camera& camera = task_.rig.cameras[index];
    cv::Mat depth_m = cv::Mat::zeros(camera.height_px, camera.width_px, CV_32F);
    RayScene::Packet packet;
    CameraRays::Packet rays;
    packet.Clear();
    for (int y = 0; y < depth_m.rows; ++y) {
      StopIfAsked();
      const RowPoses pose =
          AllRowsAt(PoseAt(task_.times_s[frame] + RowTime_s(task_.rig, index, y), index));
      for (int x0 = 0; x0 < depth_m.cols; x0 += kLanes) {
        const int count = std::min(kLanes, depth_m.cols - x0);
        for (int i = 0; i < kLanes; ++i) {
          const auto ray = i < count ? camera.Unproject(Eigen::Vector2d(x0 + i, y)) : std::nullopt;
          rays.x[i] = ray ? static_cast<float>(ray->x()) : 0;
          rays.y[i] = ray ? static_cast<float>(ray->y()) : 0;
          rays.z[i] = ray ? static_cast<float>(ray->z()) : 0;
        }
        Aim(rays, pose, &packet);
        rays_.Trace(&packet);
        for (int i = 0; i < count; ++i) {
          if (packet.active[i] == 0 || packet.rays.hit.geomID[i] == RayScene::kNoQuad) continue;
          depth_m.at<float>(y, x0 + i) = std::max(packet.rays.ray.tfar[i] * rays.z[i], 0.0f);
        }
      }
    }
    return depth_m;
  }

  void WriteSurfaces(const std::string& path) const {
    PlyFile file;
    PlyElement vertices{"vertex", {}};
    for (const char* name : {"x", "y", "z"}) vertices.Add(name, PlyType::kFloat);
    for (const ScenePatch& patch : SeenPatches(scene_)) {
      const int32_t first = static_cast<int32_t>(vertices.size());
      for (const Eigen::Vector3f& p : patch.corners) vertices.AppendRow({p.x(), p.y(), p.z()});
      file.faces.push_back({first, first + 1, first + 2, first + 3});
    }
    file.elements.push_back(std::move(vertices));
    WritePly(path, file);
  }

  const Scene scene_;
  const RendererOptions options_;
  const RenderTask task_;
  const RayScene rays_;              // of what is not glass
  std::optional<GlassPanes> panes_;  // where there are any
  const SurfaceShader shader_;
  EdgeWatch watch_;
  std::vector<CameraRays> camera_rays_;  // by camera
  std::vector<CameraResponse> responses_;
  std::vector<Exposure> exposures_;  // by frame
};

}  // namespace

namespace {

constexpr int64_t kMaxPixels = 16'000'000;  // of a camera

void RequireFeasible(const RendererOptions& options, const RenderTask& task) {
  for (const Camera& camera : task.rig.cameras) {
    const int64_t pixels = int64_t{camera.width_px} * camera.height_px;
    if (pixels <= kMaxPixels) continue;
    throw ConfigError(fmt::format("rig: resolution: found {} x {} = {} pixels, expected at most {}",
                                  camera.width_px, camera.height_px, pixels, kMaxPixels));
  }
  if (task.times_s.size() < 2) return;
  const double step_ms = 1e3 * (task.times_s[1] - task.times_s[0]);
  const double exposure_ms = options.camera.exposure_ms;  // 0: automatic
  if (exposure_ms <= step_ms) return;
  throw ConfigError(
      fmt::format("camera.exposure_ms: found {:.6g} ms, expected at most the {:.6g} ms from image "
                  "to image",
                  exposure_ms, step_ms));
}

}  // namespace

void RendererOptions::Check() const {
  light.Check();
  camera.Check();
}

std::unique_ptr<PairRenderer> MakeSceneRenderer(const Scene& scene, const RendererOptions& options,
                                                const RenderTask& task) {
  options.Check();
  if (scene.quads.empty()) throw DataError("scene: found no surfaces, expected at least one");
  RequireFeasible(options, task);
  return std::make_unique<SceneRenderer>(scene, options, task);
}

namespace {

constexpr int64_t kEdgeMaxSamples = 20'000'000;

// Of the origin from a segment.
double Distance(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Vector3d d = b - a;
  const double length2 = d.squaredNorm();
  const double u = length2 > 0 ? std::clamp(-a.dot(d) / length2, 0.0, 1.0) : 0.0;
  return (a + u * d).norm();
}

bool IsSet(uint8_t& flag) { return std::atomic_ref(flag).load(std::memory_order_relaxed) != 0; }
void Set(uint8_t& flag, uint8_t value) {
  std::atomic_ref(flag).store(value, std::memory_order_relaxed);
}

}  // namespace

EdgeWatch::EdgeWatch(const Scene& scene, const RayScene& rays, const RenderTask& task)
    : scene_(scene), rays_(rays), task_(task) {
  int64_t samples = 0;
  for (const TrueEdge& edge : scene.edges) {
    const double length_m = (edge.b - edge.a).norm();
    const int64_t count = std::max(1l, std::lround(length_m / kEdgeSample_m));
    samples += count;
    if (samples > kEdgeMaxSamples) {
      throw ConfigError(
          fmt::format("scene: found edges of more than {:.0f} m in all, "
                      "expected at most that: make it smaller",
                      static_cast<double>(kEdgeMaxSamples) * kEdgeSample_m));
    }
    seen_.emplace_back(count, 0);
  }
  double next_s = 0;
  for (const double t_s : task.times_s) {
    is_due_.push_back(t_s >= next_s);
    if (is_due_.back()) next_s = t_s + kEdgeInterval_s;
  }
}

void EdgeWatch::Look(int frame) {
  if (!IsSet(is_due_[frame])) return;
  const RigidTransform T_world_imu = task_.motion.PoseAt(task_.times_s[frame]);
  for (int c = 0; c < CameraCount(task_.rig); ++c) {
    LookThrough(task_.rig.cameras[c], T_world_imu * task_.rig.T_imu_camera[c]);
  }
  Set(is_due_[frame], 0);
}

void EdgeWatch::LookThrough(const Camera& camera, const RigidTransform& T_world_camera) {
  const RigidTransform T_camera_world = T_world_camera.Inverse();
  for (size_t e = 0; e < seen_.size(); ++e) {
    if (task_.stop.stop_requested()) throw StoppedError("interrupted");
    const TrueEdge& edge = scene_.edges[e];
    const Eigen::Vector3d a = T_camera_world * edge.a, b = T_camera_world * edge.b;
    if (Distance(a, b) > kEdgeRange_m) continue;
    for (size_t i = 0; i < seen_[e].size(); ++i) {
      if (IsSet(seen_[e][i])) continue;
      const double along = (static_cast<double>(i) + 0.5) / static_cast<double>(seen_[e].size());
      if (IsInSight(rays_, camera, T_world_camera, a + along * (b - a), kEdgeRange_m,
                    kSightMargin_m)) {
        Set(seen_[e][i], 1);
      }
    }
  }
}

std::vector<SeenPart> EdgeWatch::Parts() const {
  std::vector<SeenPart> parts;
  for (size_t e = 0; e < seen_.size(); ++e) {
    const double length_m = (scene_.edges[e].b - scene_.edges[e].a).norm();
    for (const Interval& stretch : SeenStretches(seen_[e], length_m)) {
      parts.push_back({static_cast<int>(e), stretch.from_m, stretch.to_m});
    }
  }
  return parts;
}

void WriteEdges(const std::string& folder, const Scene& scene, const std::vector<SeenPart>& seen) {
  std::vector<PlySegment> segments;
  std::vector<std::vector<SeenPart>> parts(scene.edges.size());
  for (const SeenPart& part : seen) {
    const TrueEdge& edge = scene.edges[part.edge];
    const Eigen::Vector3d direction = (edge.b - edge.a).normalized();
    segments.push_back({edge.a + part.from_m * direction, edge.a + part.to_m * direction});
    parts[part.edge].push_back(part);
  }
  // Pieces of bent edges are short: their directions need more.
  const int decimals = scene.inexact ? 6 : 4;
  std::string rows = "edge,axis,wing,ax_m,ay_m,az_m,bx_m,by_m,bz_m,seen_from_m,seen_to_m\n";
  for (size_t e = 0; e < scene.edges.size(); ++e) {
    const TrueEdge& edge = scene.edges[e];
    if (parts[e].empty()) parts[e].push_back({static_cast<int>(e), 0, 0});
    const int number = edge.bent_edge >= 0 ? edge.bent_edge : static_cast<int>(e);
    for (const SeenPart& part : parts[e]) {
      rows += fmt::format("{},{},{}", number, edge.axis, edge.wing);
      for (const double value : {edge.a.x(), edge.a.y(), edge.a.z(), edge.b.x(), edge.b.y(),
                                 edge.b.z(), part.from_m, part.to_m}) {
        rows += fmt::format(",{:.{}f}", value, decimals);
      }
      rows += "\n";
    }
  }
  WriteLinesPly(folder + "/edges.ply", segments);
  WriteFile(folder + "/edges.csv", rows);
}

}  // namespace slcmap::data
