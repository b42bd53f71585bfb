#include "data/simulator/scene/inexact_building.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "data/core/error.h"
#include "data/core/math.h"
#include "data/io/file.h"
#include "data/io/yaml.h"
#include "data/simulator/scene/scene_builder.h"

namespace slcmap::inline data {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kWaves = 4;  // a coordinate
constexpr double kShortestWave_m = 6, kLongestWave_m = 18;
constexpr double kMaxDisplacement_m[3] = {0.02, 0.02, 0.01};  // of all waves together
constexpr double kMaxTurn_rad = 0.5 / kDegreesPerRadian, kMaxLean_rad = 0.2 / kDegreesPerRadian;
constexpr double kMaxShift_m = 0.01;  // of any part of a fitting by its turn, and by its lean
// Posters and plates are as near to their wall as 6 mm, and have to stay before it.
constexpr double kThin_m = 0.05, kMaxThinShift_m = 0.0025;

constexpr double kPatch_m = 0.4;       // longest side: bends by some 0.1 mm within it
constexpr double kOverlap_m = 0.0003;  // of walls, floors and ceilings where their patches differ
constexpr double kPiece_m = 0.5;       // longest straight piece of a bent edge
constexpr double kStraightEdge_m = 0.0002;  // an edge that bends by less stays one
constexpr size_t kMaxPatches = 3'000'000;

constexpr OptionTable kInexact{Option{"amount", &InexactOptions::amount, 0.0, 2.0},
                               Option{"seed", &InexactOptions::seed, 0, 1'000'000'000}};

Vector3d AnyDirection(std::mt19937* generator) {
  const double z = UniformIn(-1, 1, generator), turn_rad = UniformIn(0, 2 * M_PI, generator);
  const double level = std::sqrt(1 - z * z);
  return {level * std::cos(turn_rad), level * std::sin(turn_rad), z};
}

// How a whole building is displaced.
class DisplacementField {
 public:
  DisplacementField(double amount, std::mt19937* generator) {
    const double ratio = std::log(kLongestWave_m / kShortestWave_m);
    for (std::vector<Wave>& waves : waves_) {
      for (int i = 0; i < kWaves; ++i) {
        // One of each band of lengths: every building bends about alike.
        const double share = (i + UniformIn(0, 1, generator)) / kWaves;
        const double length_m = kShortestWave_m * std::exp(ratio * share);
        waves.push_back(
            {2 * M_PI / length_m * AnyDirection(generator), UniformIn(0, 2 * M_PI, generator)});
      }
    }
    for (int k = 0; k < 3; ++k) amplitude_m_[k] = amount * kMaxDisplacement_m[k] / kWaves;
  }

  Vector3d At(const Vector3d& p_world) const {
    Vector3d displacement = Vector3d::Zero();
    for (int k = 0; k < 3; ++k) {
      for (const Wave& wave : waves_[k]) {
        displacement[k] += amplitude_m_[k] * std::cos(wave.per_m.dot(p_world) + wave.phase_rad);
      }
    }
    return displacement;
  }

 private:
  struct Wave {
    Vector3d per_m;  // its direction, in radians a metre
    double phase_rad;
  };
  std::vector<Wave> waves_[3];  // by coordinate
  double amplitude_m_[3];       // of each
};

// What a fitting does by itself.
struct OwnTurn {
  Vector3d foot_world;
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();

  Vector3d Moved(const Vector3d& p_world) const {
    return foot_world + rotation * (p_world - foot_world);
  }
};

std::vector<Vector3d> FindCorners(const SceneBody& body) {
  std::vector<Vector3d> corners;
  for (int i = 0; i < 8; ++i) {
    const auto corner = static_cast<Eigen::AlignedBox3d::CornerType>(i);
    corners.push_back(body.world_body * body.box_body.corner(corner));
  }
  return corners;
}

Vector3d ComputeFoot(const SceneBody& body) {
  Vector3d foot = body.box_body.center();
  foot.z() = body.box_body.min().z();
  return body.world_body * foot;
}

double MaxShift(const SceneBody& body) {
  return body.box_body.sizes().minCoeff() < kThin_m ? kMaxThinShift_m : kMaxShift_m;
}

OwnTurn DrawOwnTurn(const Scene& scene, const SceneBody& body, double amount,
                    std::mt19937* generator) {
  // All three are drawn for each body, so that one object more changes no other's kind.
  const double turn = UniformIn(-1, 1, generator);
  const double lean_x = UniformIn(-1, 1, generator), lean_y = UniformIn(-1, 1, generator);
  OwnTurn own{ComputeFoot(body)};
  if (!body.is_fitting) return own;
  double level_m = 1e-6, reach_m = 1e-6;
  for (const Vector3d& corner : FindCorners(body)) {
    level_m = std::max(level_m, (corner - own.foot_world).head<2>().norm());
    reach_m = std::max(reach_m, (corner - own.foot_world).norm());
  }
  const double shift_m = MaxShift(body) / std::max(amount, 1.0);
  const double yaw_rad = amount * turn * std::min(kMaxTurn_rad, shift_m / level_m);
  // Of its upright, towards X and Y of its wing.
  const Vector2d slope = amount * std::sqrt(0.5) * std::min(kMaxLean_rad, shift_m / reach_m) *
                         Vector2d(lean_x, lean_y);
  const Eigen::AngleAxisd wing(scene.wing_yaw_rad[body.wing], Vector3d::UnitZ());
  const Vector3d axis = wing * Vector3d(-slope.y(), slope.x(), 0);
  const double lean_rad = axis.norm();
  own.rotation =
      Eigen::AngleAxisd(lean_rad, lean_rad > 0 ? Vector3d(axis / lean_rad) : Vector3d::UnitX()) *
      Eigen::AngleAxisd(yaw_rad, Vector3d::UnitZ());
  return own;
}

class InexactBuilding {
 public:
  InexactBuilding(const InexactOptions& options, const Scene& scene)
      : generator_(static_cast<uint32_t>(options.seed)), field_(options.amount, &generator_) {
    for (const SceneBody& body : scene.bodies) {
      turns_.push_back(DrawOwnTurn(scene, body, options.amount, &generator_));
    }
  }

  const DisplacementField& field() const { return field_; }

  // Where a point of a body of the exact building is; a body of -1 has no turn of its own.
  Vector3d Moved(const Vector3d& p_world, int body) const {
    const Vector3d turned = body < 0 ? p_world : turns_[body].Moved(p_world);
    return turned + field_.At(turned);
  }

 private:
  std::mt19937 generator_;
  DisplacementField field_;
  std::vector<OwnTurn> turns_;  // by body
};

// The patches of a quad: as many as its bending needs.
class QuadCutter {
 public:
  QuadCutter(const InexactBuilding& building, Scene* scene) : building_(building), scene_(*scene) {}

  void Cut(uint32_t index) {
    const SceneQuad& quad = scene_.quads[index];
    const bool stands_apart = quad.body >= 0 && scene_.bodies[quad.body].is_fitting;
    const double overlap_m = stands_apart ? 0 : kOverlap_m;
    const auto across = Shares(quad.u.norm(), overlap_m), up = Shares(quad.v.norm(), overlap_m);
    if (scene_.patches.size() + across.size() * up.size() > kMaxPatches) {
      throw ConfigError("inexact: found more than " + std::to_string(kMaxPatches) +
                        " patches of surfaces, expected at most that: make the scene smaller");
    }
    for (size_t t = 0; t + 1 < up.size(); ++t) {
      for (size_t s = 0; s + 1 < across.size(); ++s) {
        AddPatch(index, Vector2d(across[s], up[t]), Vector2d(across[s + 1], up[t + 1]));
      }
    }
  }

  double max_displacement_m() const { return max_displacement_m_; }

 private:
  // Where a side is cut, in fractions of its length; a little beyond its ends where patches that
  // meet are cut at different places, lest one sees between them.
  static std::vector<double> Shares(double length_m, double overlap_m) {
    const int count = std::max(1, static_cast<int>(std::ceil(length_m / kPatch_m)));
    std::vector<double> shares;
    for (int i = 0; i <= count; ++i) shares.push_back(static_cast<double>(i) / count);
    shares.front() -= overlap_m / length_m;
    shares.back() += overlap_m / length_m;
    return shares;
  }

  void AddPatch(uint32_t index, const Vector2d& from, const Vector2d& to) {
    ScenePatch patch;
    patch.quad = index;
    patch.from = from.cast<float>();
    patch.size = (to - from).cast<float>();
    const Vector3d a = MovedAt(index, from.x(), from.y()), b = MovedAt(index, to.x(), from.y()),
                   c = MovedAt(index, to.x(), to.y()), d = MovedAt(index, from.x(), to.y());
    patch.corners = {a.cast<float>(), b.cast<float>(), c.cast<float>(), d.cast<float>()};
    patch.normal = (c - a).cross(d - b).normalized().cast<float>();
    scene_.patches.push_back(patch);
  }

  Vector3d MovedAt(uint32_t index, double s, double t) {
    const SceneQuad& quad = scene_.quads[index];
    const Vector3d exact =
        quad.a.cast<double>() + s * quad.u.cast<double>() + t * quad.v.cast<double>();
    const Vector3d moved = building_.Moved(exact, quad.body);
    max_displacement_m_ = std::max(max_displacement_m_, (moved - exact).norm());
    return moved;
  }

  const InexactBuilding& building_;
  Scene& scene_;
  double max_displacement_m_ = 0;
};

std::vector<Vector3d> Chain(const TrueEdge& edge, const InexactBuilding& building) {
  const double length_m = (edge.b - edge.a).norm();
  const int pieces = std::max(1, static_cast<int>(std::ceil(length_m / kPiece_m)));
  std::vector<Vector3d> points;
  for (int i = 0; i <= pieces; ++i) {
    const double share = static_cast<double>(i) / pieces;
    points.push_back(building.Moved(edge.a + share * (edge.b - edge.a), edge.body));
  }
  return points;
}

bool Bends(const std::vector<Vector3d>& points) {
  const Vector3d chord = (points.back() - points.front()).normalized();
  return std::any_of(points.begin(), points.end(), [&](const Vector3d& point) {
    return (point - points.front()).cross(chord).norm() >= kStraightEdge_m;
  });
}

void MoveEdges(const InexactBuilding& building, Scene* scene) {
  std::vector<TrueEdge> pieces;
  for (size_t number = 0; number < scene->edges.size(); ++number) {
    const TrueEdge& edge = scene->edges[number];
    std::vector<Vector3d> points = Chain(edge, building);
    if (!Bends(points)) points = {points.front(), points.back()};
    for (size_t i = 0; i + 1 < points.size(); ++i) {
      pieces.push_back(
          {points[i], points[i + 1], edge.axis, edge.wing, edge.body, static_cast<int>(number)});
    }
  }
  scene->edges = pieces;
}

void MovePipes(const InexactBuilding& building, Scene* scene) {
  for (ScenePipe& pipe : scene->pipes) {
    pipe.a = building.Moved(pipe.a, pipe.body);
    pipe.b = building.Moved(pipe.b, pipe.body);
  }
}

}  // namespace

void InexactOptions::Read(YamlSection section) { kInexact.Read(section, this); }

void InexactOptions::Check() const { kInexact.Check("inexact", *this); }

void MakeInexact(const InexactOptions& options, Scene* scene) {
  options.Check();
  const InexactBuilding building(options, *scene);
  QuadCutter cutter(building, scene);
  for (uint32_t i = 0; i < scene->quads.size(); ++i) cutter.Cut(i);
  const DisplacementField& field = building.field();
  scene->inexact = {
      options, cutter.max_displacement_m(),
      [field](const Vector3d& p_world) -> Vector3d { return p_world + field.At(p_world); }};
  MoveEdges(building, scene);
  MovePipes(building, scene);
}

void WriteInexact(const std::string& path, const InexactTruth& truth) {
  WriteFile(path, fmt::format("amount: {}\nseed: {}\nmax_displacement_m: {:.5f}\n",
                              truth.options.amount, truth.options.seed, truth.max_displacement_m));
}

}  // namespace slcmap::data
