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

constexpr double kPatch_m = 0.4;        // longest side: bends by some 0.1 mm within it
constexpr double kOverlap_m = 0.0003;   // of walls, floors and ceilings where their patches differ
constexpr double kPiece_m = 0.5;        // longest straight piece of a bent edge
constexpr double kStraight_m = 0.0002;  // an edge that bends by less stays one
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
  double yaw_rad = 0;
  Vector2d lean_rad = Vector2d::Zero();  // of its upright, towards X and Y of its wing
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();

  Vector3d Moved(const Vector3d& p_world) const {
    return foot_world + rotation * (p_world - foot_world);
  }
};

Eigen::AngleAxisd WingTurn(const Scene& scene, int wing) {
  return {scene.wing_yaw_rad[wing], Vector3d::UnitZ()};
}

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
  own.yaw_rad = amount * turn * std::min(kMaxTurn_rad, shift_m / level_m);
  own.lean_rad = amount * std::sqrt(0.5) * std::min(kMaxLean_rad, shift_m / reach_m) *
                 Vector2d(lean_x, lean_y);
  const Eigen::AngleAxisd wing = WingTurn(scene, body.wing);
  const Vector3d axis = wing * Vector3d(-own.lean_rad.y(), own.lean_rad.x(), 0);
  const double lean_rad = axis.norm();
  own.rotation =
      Eigen::AngleAxisd(lean_rad, lean_rad > 0 ? Vector3d(axis / lean_rad) : Vector3d::UnitX()) *
      Eigen::AngleAxisd(own.yaw_rad, Vector3d::UnitZ());
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

  const OwnTurn& turn(int body) const { return turns_[body]; }
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

double ComputeBend(const std::vector<Vector3d>& points) {
  const Vector3d chord = (points.back() - points.front()).normalized();
  double bend_m = 0;
  for (const Vector3d& point : points) {
    bend_m = std::max(bend_m, (point - points.front()).cross(chord).norm());
  }
  return bend_m;
}

// Of a direction against the one that it had in the exact building.
Vector2d ComputeTurn(const Scene& scene, const TrueEdge& edge, const Vector3d& chord) {
  if (edge.axis < 0) {
    const Vector3d exact = edge.b - edge.a;
    return {kDegreesPerRadian * std::atan2(exact.cross(chord).norm(), exact.dot(chord)), 0};
  }
  const Vector3d direction = WingTurn(scene, edge.wing).inverse() * chord;
  const double along = direction[edge.axis];
  return kDegreesPerRadian * Vector2d(std::atan(direction[(edge.axis + 1) % 3] / along),
                                      std::atan(direction[(edge.axis + 2) % 3] / along));
}

void MoveEdges(const InexactBuilding& building, Scene* scene, InexactTruth* truth) {
  std::vector<TrueEdge> pieces;
  for (const TrueEdge& edge : scene->edges) {
    std::vector<Vector3d> points = Chain(edge, building);
    EdgeDeviation deviation;
    deviation.edge = static_cast<int>(truth->edges.size());
    deviation.body = edge.body;
    deviation.axis = edge.axis;
    deviation.wing = edge.wing;
    deviation.length_m = (points.back() - points.front()).norm();
    deviation.turn_deg = ComputeTurn(*scene, edge, points.back() - points.front());
    deviation.bend_m = ComputeBend(points);
    truth->edges.push_back(deviation);
    if (deviation.bend_m < kStraight_m) points = {points.front(), points.back()};
    for (size_t i = 0; i + 1 < points.size(); ++i) {
      pieces.push_back({points[i], points[i + 1], edge.axis, edge.wing, edge.body, deviation.edge});
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

// By the chords through the middle of its box, along the axes of its wing.
BodyDeviation MeasureDeviation(const Scene& scene, int index, const InexactBuilding& building) {
  constexpr double kLeastHalf_m = 0.05;
  const SceneBody& body = scene.bodies[index];
  const Eigen::AngleAxisd world_wing = WingTurn(scene, body.wing);
  const Vector3d middle = body.world_body * body.box_body.center();
  Vector3d half = Vector3d::Constant(kLeastHalf_m);
  for (const Vector3d& corner : FindCorners(body)) {
    half = half.cwiseMax((world_wing.inverse() * (corner - middle)).cwiseAbs());
  }
  const auto chord = [&](int k) -> Vector3d {
    const Vector3d to_end = world_wing * Vector3d(half[k] * Vector3d::Unit(k));
    return world_wing.inverse() *
           (building.Moved(middle + to_end, index) - building.Moved(middle - to_end, index));
  };
  const Vector3d longer = half.x() >= half.y() ? chord(0) : chord(1), upright = chord(2);
  const OwnTurn& own = building.turn(index);
  BodyDeviation deviation{index, own.foot_world};
  deviation.yaw_deg =
      kDegreesPerRadian * (half.x() >= half.y() ? std::atan2(longer.y(), longer.x())
                                                : std::atan2(-longer.x(), longer.y()));
  deviation.lean_deg = kDegreesPerRadian * Vector2d(std::atan(upright.x() / upright.z()),
                                                    std::atan(upright.y() / upright.z()));
  deviation.own_yaw_deg = kDegreesPerRadian * own.yaw_rad;
  deviation.own_lean_deg = kDegreesPerRadian * own.lean_rad;
  return deviation;
}

}  // namespace

void InexactOptions::Read(YamlSection section) { kInexact.Read(section, this); }

void InexactOptions::Check() const { kInexact.Check("inexact", *this); }

void MakeInexact(const InexactOptions& options, Scene* scene) {
  options.Check();
  const InexactBuilding building(options, *scene);
  QuadCutter cutter(building, scene);
  for (uint32_t i = 0; i < scene->quads.size(); ++i) cutter.Cut(i);
  InexactTruth truth{options, cutter.max_displacement_m(), nullptr, {}, {}};
  const DisplacementField& field = building.field();
  truth.Displaced = [field](const Vector3d& p_world) -> Vector3d {
    return p_world + field.At(p_world);
  };
  for (size_t i = 0; i < scene->bodies.size(); ++i) {
    if (scene->bodies[i].box_body.isEmpty()) continue;
    truth.bodies.push_back(MeasureDeviation(*scene, static_cast<int>(i), building));
  }
  MoveEdges(building, scene, &truth);
  MovePipes(building, scene);
  scene->inexact = truth;
}

namespace {

// Root mean squares, each value counted by its weight.
class RootMeanSquare {
 public:
  void Add(double value, double weight) {
    sum_ += weight * value * value;
    weight_ += weight;
  }
  double Value() const { return weight_ > 0 ? std::sqrt(sum_ / weight_) : 0; }

 private:
  double sum_ = 0, weight_ = 0;
};

std::string BodyRows(const Scene& scene) {
  std::string rows =
      "body,kind,is_fitting,wing,foot_x_m,foot_y_m,foot_z_m,yaw_deg,lean_x_deg,lean_y_deg,"
      "own_yaw_deg,own_lean_x_deg,own_lean_y_deg\n";
  for (const BodyDeviation& row : scene.inexact->bodies) {
    const SceneBody& body = scene.bodies[row.body];
    rows += fmt::format(
        "{},{},{:d},{},{:.4f},{:.4f},{:.4f},{:.5f},{:.5f},{:.5f},{:.5f},{:.5f},{:.5f}\n", row.body,
        body.kind, body.is_fitting, body.wing, row.foot_world.x(), row.foot_world.y(),
        row.foot_world.z(), row.yaw_deg, row.lean_deg.x(), row.lean_deg.y(), row.own_yaw_deg,
        row.own_lean_deg.x(), row.own_lean_deg.y());
  }
  return rows;
}

std::string EdgeRows(const InexactTruth& truth) {
  std::string rows = "edge,body,axis,wing,length_m,turn_1_deg,turn_2_deg,bend_mm\n";
  for (const EdgeDeviation& edge : truth.edges) {
    rows += fmt::format("{},{},{},{},{:.4f},{:.5f},{:.5f},{:.3f}\n", edge.edge, edge.body,
                        edge.axis, edge.wing, edge.length_m, edge.turn_deg.x(), edge.turn_deg.y(),
                        1e3 * edge.bend_m);
  }
  return rows;
}

std::string Summary(const InexactTruth& truth) {
  RootMeanSquare along[3];
  double bend_m = 0;
  for (const EdgeDeviation& edge : truth.edges) {
    bend_m = std::max(bend_m, edge.bend_m);
    if (edge.axis < 0) continue;
    along[edge.axis].Add(edge.turn_deg.x(), 0.5 * edge.length_m);
    along[edge.axis].Add(edge.turn_deg.y(), 0.5 * edge.length_m);
  }
  return fmt::format(
      "amount: {}\nseed: {}\nmax_displacement_m: {:.5f}\n# of edges from the axes of their wings, "
      "in either direction across: root mean square by length\nedges_along_x_deg: {:.4f}\n"
      "edges_along_y_deg: {:.4f}\nedges_upright_deg: {:.4f}\nmax_bend_m: {:.5f}\n",
      truth.options.amount, truth.options.seed, truth.max_displacement_m, along[0].Value(),
      along[1].Value(), along[2].Value(), bend_m);
}

}  // namespace

void WriteDeviations(const std::string& folder, const Scene& scene) {
  WriteFile(folder + "/inexact.yaml", Summary(*scene.inexact));
  WriteFile(folder + "/deviations.csv", BodyRows(scene));
  WriteFile(folder + "/edge_deviations.csv", EdgeRows(*scene.inexact));
}

}  // namespace slcmap::data
