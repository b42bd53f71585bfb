#include "data/simulator/shading.h"

#include <spdlog/fmt/fmt.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "data/core/error.h"
#include "data/simulator/scene/camera_response.h"
#include "data/simulator/sequence_writer.h"

namespace slcmap::inline data {
namespace {

// Of RayScene::kLanes rays to the lamps, a texel: most lamps of a storey are behind walls.
constexpr int kPackets = 8;

constexpr float kOffset_m = 0.002f;  // of ray origins from their surface
constexpr float kInset_m = 0.01f;    // of the outermost nodes from the border, where corners shade

constexpr int64_t kMaxNodes = 30'000'000;          // some minutes, and 120 MB
constexpr int64_t kMaxNodeLamps = 20'000'000'000;  // each lamp is looked at from each node
constexpr int64_t kJobNodes = 2000;                // some 50 ms

int Nodes(float side_m, double texel_m) {
  return 2 + static_cast<int>(std::min(side_m / texel_m, 4000.0));
}

// Smooth noise over space: stains and unequal paint, which no two places have alike.
float Noise3(const Eigen::Vector3f& p, uint32_t seed) {
  const Eigen::Vector3f floor = p.array().floor();
  const Eigen::Vector3f f = p - floor;
  const Eigen::Vector3f w = f.cwiseProduct(f).cwiseProduct(Eigen::Vector3f::Constant(3) - 2 * f);
  float sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    uint32_t hash = seed;
    float weight = 1;
    for (int k = 0; k < 3; ++k) {
      const int bit = corner >> k & 1;
      hash = Mixed(hash, static_cast<uint32_t>(static_cast<int>(floor[k]) + bit));
      weight *= bit ? w[k] : 1 - w[k];
    }
    sum += weight * (2 * UnitFloat(hash) - 1);
  }
  return sum;
}

float Stains(const Eigen::Vector3f& p) {
  return 1 + 0.10f * Noise3(p / 1.7f, 1) + 0.06f * Noise3(p / 0.55f, 2);
}

struct SurfacePoint {
  Eigen::Vector3f position, normal;
  uint32_t id;  // of its random numbers
};

}  // namespace

class LightBaker {
 public:
  LightBaker(const Scene& scene, const RayScene& rays, const LightBakingOptions& options)
      : scene_(scene), rays_(rays), options_(options) {
    RequireFeasible();
    uint32_t next = 0;
    for (const SceneQuad& quad : scene.quads) {
      const auto [columns, rows] = MakeGrid(quad);
      const uint32_t nodes = static_cast<uint32_t>(columns * rows);
      maps_.grids_.push_back({columns, rows, {next, next + nodes}});
      next += 2 * nodes;
    }
    maps_.values_.resize(next);
  }

  LightMaps Bake(const Progress& progress) {
    const std::vector<Rows> rows = AllRows();
    const std::vector<size_t> starts = JobStarts(rows);
    const int jobs = static_cast<int>(starts.size()) - 1;
    const auto bake = [&](int job) {
      for (size_t i = starts[job]; i < starts[job + 1]; ++i) BakeRows(rows[i]);
    };
    const auto report = [&](int done) { return progress.Report(1.0 * done / std::max(jobs, 1)); };
    if (MakeFrames(jobs, options_.threads, bake, report) < jobs) throw StoppedError("interrupted");
    for (size_t q = 0; q < scene_.quads.size(); ++q) {
      if (IsLamp(q)) continue;
      const LightMaps::Grid& grid = maps_.grids_[q];
      for (const int side : {0, 1}) Smooth(grid, &maps_.values_[grid.first[side]]);
    }
    return std::move(maps_);
  }

 private:
  // Some rows of nodes of one side of a quad: from `begin` to before `end`.
  struct Rows {
    size_t quad;
    int side, begin, end;
  };

  std::pair<int, int> MakeGrid(const SceneQuad& quad) const {
    return {Nodes(quad.u.norm(), options_.texel_m), Nodes(quad.v.norm(), options_.texel_m)};
  }

  bool IsLamp(size_t q) const {
    return scene_.materials[scene_.quads[q].material].texture == TextureKind::kLamp;
  }

  void RequireFeasible() const {
    int64_t nodes = 0;
    for (const SceneQuad& quad : scene_.quads) {
      const auto [columns, rows] = MakeGrid(quad);
      nodes += int64_t{2} * columns * rows;
    }
    const auto lamps = static_cast<int64_t>(std::max<size_t>(scene_.lamps.size(), 1));
    if (nodes <= kMaxNodes && nodes <= kMaxNodeLamps / lamps) return;
    throw ConfigError(
        fmt::format("scene: found {} surfaces whose light takes "
                    "{} nodes, {} m apart, lit by {} "
                    "lamps; expected at most {} nodes, and {} "
                    "nodes times lamps: make it smaller",
                    scene_.quads.size(), nodes, options_.texel_m, lamps, kMaxNodes, kMaxNodeLamps));
  }

  // In pieces of at most kJobNodes, or one row.
  std::vector<Rows> AllRows() const {
    std::vector<Rows> all;
    for (size_t q = 0; q < scene_.quads.size(); ++q) {
      if (IsLamp(q)) continue;
      const LightMaps::Grid& grid = maps_.grids_[q];
      const int step = std::max(1, static_cast<int>(kJobNodes) / grid.columns);
      for (const int side : {0, 1}) {
        for (int y = 0; y < grid.rows; y += step) {
          all.push_back({q, side, y, std::min(y + step, grid.rows)});
        }
      }
    }
    return all;
  }

  // Where each job of about kJobNodes starts in `rows`, and the end.
  std::vector<size_t> JobStarts(const std::vector<Rows>& rows) const {
    std::vector<size_t> starts = {0};
    int64_t nodes = 0;
    for (size_t i = 0; i < rows.size(); ++i) {
      nodes += int64_t{rows[i].end - rows[i].begin} * maps_.grids_[rows[i].quad].columns;
      if (nodes < kJobNodes && i + 1 < rows.size()) continue;
      starts.push_back(i + 1);
      nodes = 0;
    }
    return starts;
  }

  void BakeRows(const Rows& rows) {
    const SceneQuad& quad = scene_.quads[rows.quad];
    const LightMaps::Grid& grid = maps_.grids_[rows.quad];
    float* const values = &maps_.values_[grid.first[rows.side]];
    const Eigen::Vector3f normal =
        quad.u.cross(quad.v).normalized() * (rows.side == 0 ? 1.0f : -1.0f);
    const float inset_s = std::min(0.25f, kInset_m / quad.u.norm());
    const float inset_t = std::min(0.25f, kInset_m / quad.v.norm());
    for (int y = rows.begin; y < rows.end; ++y) {
      for (int x = 0; x < grid.columns; ++x) {
        const float s = static_cast<float>(x) / static_cast<float>(grid.columns - 1);
        const float t = static_cast<float>(y) / static_cast<float>(grid.rows - 1);
        const Eigen::Vector3f p = quad.a + std::clamp(s, inset_s, 1 - inset_s) * quad.u +
                                  std::clamp(t, inset_t, 1 - inset_t) * quad.v;
        const int node = y * grid.columns + x;
        values[node] = LightAt(
            {p + kOffset_m * normal, normal, grid.first[rows.side] + static_cast<uint32_t>(node)});
      }
    }
  }

  float LightAt(const SurfacePoint& point) const {
    float light = 0;
    const std::vector<float> weights = CumulativeWeights(point);
    if (!weights.empty() && weights.back() > 0) {
      for (int i = 0; i < kPackets; ++i) light += PacketOfLight(point, weights, i);
    }
    return (light / static_cast<float>(kPackets) + scene_.ambient) * Stains(point.position);
  }

  // About the light of each lamp, unshadowed, summed up lamp by lamp: what rays are dealt by.
  std::vector<float> CumulativeWeights(const SurfacePoint& point) const {
    std::vector<float> weights;
    float sum = 0;
    for (const SceneLamp& lamp : scene_.lamps) {
      const Eigen::Vector3f to = lamp.a + 0.5f * (lamp.u + lamp.v) - point.position;
      const Eigen::Vector3f across = lamp.u.cross(lamp.v);
      const float area = across.norm();
      const float reach = 0.5f * (lamp.u.norm() + lamp.v.norm()) / to.norm();
      const float cosine = std::max(point.normal.dot(to.normalized()) + reach, 0.0f);
      const float facing = std::abs(across.dot(to.normalized())) + reach * area;
      sum += lamp.radiance * facing * cosine / (to.squaredNorm() + area);
      weights.push_back(sum);
    }
    return weights;
  }

  // One packet of rays to points of the lamps, stratified; the mean of what they bring.
  float PacketOfLight(const SurfacePoint& point, const std::vector<float>& weights,
                      int packet_index) const {
    constexpr int kRays = RayScene::kLanes;
    RayScene::Packet packet;
    packet.Clear();
    float light[kRays] = {};
    const uint32_t seed = Mixed(point.id, static_cast<uint32_t>(packet_index));
    for (int i = 0; i < kRays; ++i) {
      const uint32_t at = Mixed(seed, static_cast<uint32_t>(i));
      const float pick =
          (static_cast<float>(i) + UnitFloat(at)) / static_cast<float>(kRays) * weights.back();
      const auto found = std::upper_bound(weights.begin(), weights.end(), pick);
      const size_t k = std::min<size_t>(found - weights.begin(), weights.size() - 1);
      const float weight = weights[k] - (k > 0 ? weights[k - 1] : 0);
      if (weight <= 0) continue;
      const SceneLamp& lamp = scene_.lamps[k];
      const Eigen::Vector3f target =
          lamp.a + UnitFloat(Mixed(at, 1)) * lamp.u + UnitFloat(Mixed(at, 2)) * lamp.v;
      light[i] = Unshadowed(point, lamp, target) * weights.back() / weight;
      if (light[i] > 0) packet.Set(i, point.position, target - point.position, 0.995f);
    }
    rays_.FindBlocked(&packet);
    float sum = 0;
    for (int i = 0; i < kRays; ++i) sum += packet.rays.ray.tfar[i] > 0 ? light[i] : 0;
    return sum / static_cast<float>(kRays);
  }

  // Irradiance over pi by the whole lamp, as if all of it were at the target. Lamps shine both
  // ways.
  static float Unshadowed(const SurfacePoint& point, const SceneLamp& lamp,
                          const Eigen::Vector3f& target) {
    const Eigen::Vector3f to = target - point.position;
    const float distance2 = std::max(to.squaredNorm(), 0.01f);
    const float cosine = point.normal.dot(to);
    if (cosine <= 0) return 0;
    const float facing = std::abs(lamp.u.cross(lamp.v).dot(to));  // includes the lamp's area
    return lamp.radiance * cosine * facing / (distance2 * distance2 * std::numbers::pi_v<float>);
  }

  // Takes the rays' noise away: binomial over 3 x 3 nodes, the border repeated.
  static void Smooth(const LightMaps::Grid& grid, float* values) {
    std::vector<float> rows(values, values + grid.columns * grid.rows);
    const auto blur = [](float before, float here, float after) {
      return 0.25f * before + 0.5f * here + 0.25f * after;
    };
    for (int y = 0; y < grid.rows; ++y) {
      const float* row = values + y * grid.columns;
      for (int x = 0; x < grid.columns; ++x) {
        rows[y * grid.columns + x] =
            blur(row[std::max(x - 1, 0)], row[x], row[std::min(x + 1, grid.columns - 1)]);
      }
    }
    for (int y = 0; y < grid.rows; ++y) {
      const float* above = &rows[std::max(y - 1, 0) * grid.columns];
      const float* here = &rows[y * grid.columns];
      const float* below = &rows[std::min(y + 1, grid.rows - 1) * grid.columns];
      for (int x = 0; x < grid.columns; ++x) {
        values[y * grid.columns + x] = blur(above[x], here[x], below[x]);
      }
    }
  }

  const Scene& scene_;
  const RayScene& rays_;
  const LightBakingOptions& options_;
  LightMaps maps_;
};

void LightBakingOptions::Check() const {
  if (!(texel_m > 0)) throw ConfigError("light: texel_m: expected more than 0");
  if (threads < 1) throw ConfigError("light: threads: expected at least 1");
}

LightMaps LightMaps::Bake(const Scene& scene, const RayScene& rays,
                          const LightBakingOptions& options, const Progress& progress) {
  options.Check();
  return LightBaker(scene, rays, options).Bake(progress);
}

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
float OffsetTexels(float origin_m, float texels_per_m, uint32_t random) {
  const float turns = UnitFloat(random) + origin_m * texels_per_m / TextureTile::kSide;
  return (turns - std::floor(turns)) * TextureTile::kSide;
}

}  // namespace

SurfaceShader::SurfaceShader(const Scene& scene, const RayScene& quad_rays,
                             const LightBakingOptions& options, const Progress& progress)
    : textures_(scene.materials), light_(LightMaps::Bake(scene, quad_rays, options, progress)) {
  for (const SceneQuad& quad : scene.quads) {
    const SurfaceMaterial& material = scene.materials[quad.material];
    Surface s{};
    s.tile = &textures_.Of(material);
    if (IsStretched(material.texture)) {
      s.scale_s = s.scale_t = TextureTile::kSide;
      s.texels_per_m = TextureTile::kSide / std::sqrt(quad.u.cross(quad.v).norm());
    } else {
      s.texels_per_m = 1 / (s.tile->texel_m * material.scale);
      s.scale_s = s.texels_per_m * quad.u.norm();
      s.scale_t = s.texels_per_m * quad.v.norm();
      const auto offset = [&](int k) {
        return OffsetTexels(quad.texture_origin[k], s.texels_per_m, Mixed(material.seed, k + 1));
      };
      s.offset_s = offset(0);
      s.offset_t = offset(1);
    }
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

namespace {

// About those of a RealSense D435: some 5,000 dots in 86 by 57 degrees.
constexpr double kHalfWidth = 0.93, kHalfHeight = 0.54;  // tangents
constexpr double kCell = 0.02;                           // a dot each, tangent
constexpr double kDotSigma = 0.0016;                     // of its brightness, tangent
constexpr double kDotRadiance_m2 = 3;                    // at a metre
constexpr double kNearest_m = 0.3;                       // nearer ones are no brighter

// Between 0 and 1, of a cell.
double Drawn(int64_t column, int64_t row, uint32_t which) {
  const auto number = static_cast<uint32_t>(column * 7919 + row * 104729) * 2 + which;
  return UnitFloat(Mixed(number));
}

// What the pattern lights a surface with, that is there in the projector's frame.
double LightAt(const Eigen::Vector3d& p_projector) {
  if (p_projector.z() <= 0) return 0;
  const double u = p_projector.x() / p_projector.z(), v = p_projector.y() / p_projector.z();
  if (std::abs(u) > kHalfWidth || std::abs(v) > kHalfHeight) return 0;
  const double column = std::floor(u / kCell), row = std::floor(v / kCell);
  const auto place = [&](double at, uint32_t which) {
    constexpr double kMargin = 0.25;  // of a cell, so that a dot stays in its own
    const double drawn = Drawn(static_cast<int64_t>(column), static_cast<int64_t>(row), which);
    return (at + kMargin + (1 - 2 * kMargin) * drawn) * kCell;
  };
  const double off = std::hypot(u - place(column, 0), v - place(row, 1)) / kDotSigma;
  if (off > 4) return 0;
  const double distance_m = std::max(kNearest_m, p_projector.norm());
  return kDotRadiance_m2 / (distance_m * distance_m) * std::exp(-0.5 * off * off);
}

}  // namespace

void AddDots(const Rig& rig, int camera, const cv::Mat& depth_m, cv::Mat* radiance) {
  RigidTransform T_imu_projector = rig.T_imu_camera[0];
  T_imu_projector.translation =
      0.5 * (rig.T_imu_camera[0].translation + rig.T_imu_camera[1].translation);
  const auto index = static_cast<size_t>(camera);
  const RigidTransform T_projector_camera = T_imu_projector.Inverse() * rig.T_imu_camera[index];
  for (int y = 0; y < depth_m.rows; ++y) {
    for (int x = 0; x < depth_m.cols; ++x) {
      const double depth = depth_m.at<float>(y, x);
      if (depth <= 0) continue;
      const auto ray = rig.cameras[index].Unproject(Eigen::Vector2d(x, y));
      if (!ray || ray->z() <= 0) continue;
      const double light = LightAt(T_projector_camera * (*ray * (depth / ray->z())));
      radiance->at<float>(y, x) += static_cast<float>(light);
    }
  }
}

}  // namespace slcmap::data
