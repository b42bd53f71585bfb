#include "data/simulator/scene/scene_builder.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "data/core/error.h"

namespace slcmap::inline data {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kSame_m = 1e-3;
constexpr double kShortestEdge_m = 0.05;
constexpr double kMinArea_m2 = 1e-8;
constexpr size_t kMaxQuads = 300'000;
constexpr size_t kMaxEdges = 100'000;

// 0, 1, 2 or -1 for a direction in the frame of a wing.
int FindAxis(const Vector3d& direction) {
  for (int k = 0; k < 3; ++k) {
    if (std::abs(direction.normalized()[k]) > 1 - 1e-9) return k;
  }
  return -1;
}

// Two directions square to `axis` and to each other; the first is level where it can be.
std::pair<Vector3d, Vector3d> Across(const Vector3d& axis) {
  const Vector3d along = axis.normalized();
  const bool upright = std::abs(along.z()) > 0.999;
  const Vector3d side = (upright ? Vector3d::UnitY() : Vector3d::UnitZ()).cross(along).normalized();
  return {side, along.cross(side)};
}

double DistanceToLine(const Vector3d& point, const TrueEdge& edge) {
  const Vector3d direction = (edge.b - edge.a).normalized();
  return (point - edge.a).cross(direction).norm();
}

// By their bounding boxes: settles nearly all pairs cheaply.
bool AreApart(const TrueEdge& first, const TrueEdge& second) {
  for (int k = 0; k < 3; ++k) {
    const auto [first_low, first_high] = std::minmax(first.a[k], first.b[k]);
    const auto [second_low, second_high] = std::minmax(second.a[k], second.b[k]);
    if (first_low > second_high + kSame_m || second_low > first_high + kSame_m) return true;
  }
  return false;
}

// Makes *edge the union of both if they lie on one another.
bool Absorb(const TrueEdge& other, TrueEdge* edge) {
  if (other.axis != edge->axis || other.wing != edge->wing || other.body != edge->body ||
      AreApart(other, *edge)) {
    return false;
  }
  if (DistanceToLine(other.a, *edge) > kSame_m || DistanceToLine(other.b, *edge) > kSame_m) {
    return false;
  }
  const double length = (edge->b - edge->a).norm();
  const Vector3d direction = (edge->b - edge->a) / length;
  const double s = direction.dot(other.a - edge->a), t = direction.dot(other.b - edge->a);
  const double low = std::min(s, t), high = std::max(s, t);
  if (low > length - kSame_m || high < kSame_m) return false;
  const Vector3d& low_end = s < t ? other.a : other.b;
  const Vector3d& high_end = s < t ? other.b : other.a;
  if (low < 0) edge->a = low_end;
  if (high > length) edge->b = high_end;
  return true;
}

}  // namespace

double UniformIn(double low, double high, std::mt19937* generator) {
  return low + (high - low) * static_cast<double>((*generator)()) / 4294967296.0;
}

std::vector<TrueEdge> MergedEdges(const std::vector<TrueEdge>& edges, const Progress& progress) {
  std::vector<TrueEdge> merged;
  size_t done = 0;
  for (TrueEdge edge : edges) {
    if (done++ % 64 == 0) {
      progress.ReportOrStop(static_cast<double>(done) / static_cast<double>(edges.size() + 1));
    }
    // Each union can reach further ones.
    for (size_t i = 0; i < merged.size();) {
      if (Absorb(merged[i], &edge)) {
        merged.erase(merged.begin() + static_cast<int64_t>(i));
        i = 0;
      } else {
        ++i;
      }
    }
    merged.push_back(edge);
  }
  return merged;
}

SceneBuilder::SceneBuilder(std::vector<Eigen::Isometry3d> world_wings)
    : world_wings_(std::move(world_wings)) {
  for (const Eigen::Isometry3d& world_wing : world_wings_) {
    scene_.wing_yaw_rad.push_back(std::atan2(world_wing(1, 0), world_wing(0, 0)));
  }
  SetPlacement(0, Eigen::Isometry3d::Identity());
}

uint32_t SceneBuilder::AddMaterial(const SurfaceMaterial& material) {
  scene_.materials.push_back(material);
  return static_cast<uint32_t>(scene_.materials.size() - 1);
}

void SceneBuilder::SetPlacement(int wing, const Eigen::Isometry3d& wing_object) {
  wing_ = wing;
  world_object_ = world_wings_.at(wing) * wing_object;
}

int SceneBuilder::AddBody(const std::string& kind, bool is_fitting) {
  body_ = static_cast<int>(scene_.bodies.size());
  scene_.bodies.push_back({kind, wing_, is_fitting, world_object_});
  return body_;
}

void SceneBuilder::AddQuad(const Vector3d& a, const Vector3d& u, const Vector3d& v,
                           uint32_t material, const Vector2d& texture_origin) {
  if (!(u.cross(v).norm() >= kMinArea_m2) || !a.allFinite()) {
    throw ConfigError("found a surface without area, expected one that can be seen");
  }
  if (scene_.quads.size() >= kMaxQuads) {
    throw ConfigError("found more than " + std::to_string(kMaxQuads) +
                      " surfaces in the scene, expected at most that");
  }
  const Eigen::Matrix3d rotation = world_object_.linear();
  scene_.quads.push_back({(world_object_ * a).cast<float>(), (rotation * u).cast<float>(),
                          (rotation * v).cast<float>(), material, texture_origin.cast<float>(),
                          body_});
  if (body_ < 0) return;
  SceneBody& body = scene_.bodies[body_];
  const Eigen::Isometry3d body_object = body.world_body.inverse() * world_object_;
  for (const Vector3d& corner : {a, Vector3d(a + u), Vector3d(a + v), Vector3d(a + u + v)}) {
    body.box_body.extend(body_object * corner);
  }
}

void SceneBuilder::AddEdge(const Vector3d& a, const Vector3d& b) {
  if ((b - a).norm() < kShortestEdge_m) return;
  if (scene_.edges.size() >= kMaxEdges) {
    throw ConfigError("found more than " + std::to_string(kMaxEdges) +
                      " edges in the scene, expected at most that");
  }
  TrueEdge edge{world_object_ * a, world_object_ * b, -1, wing_};
  if (body_ >= 0 && scene_.bodies[body_].is_fitting) edge.body = body_;
  edge.axis = FindAxis(world_wings_[wing_].linear().transpose() * (edge.b - edge.a));
  scene_.edges.push_back(edge);
}

void SceneBuilder::AddBorder(const Vector3d& a, const Vector3d& u, const Vector3d& v) {
  AddEdge(a, a + u);
  AddEdge(a + v, a + u + v);
  AddEdge(a, a + v);
  AddEdge(a + u, a + u + v);
}

void SceneBuilder::AddParallelepiped(const Vector3d& a, const Vector3d& u, const Vector3d& v,
                                     const Vector3d& w, uint32_t material) {
  AddQuad(a + w, u, v, material);
  AddQuad(a + v, u, -v, material);
  AddQuad(a, u, w, material);
  AddQuad(a + u + v, -u, w, material);
  AddQuad(a + u, v, w, material);
  AddQuad(a + v, -v, w, material);
  AddBorder(a, u, v);
  AddBorder(a + w, u, v);
  for (const Vector3d& corner : {a, Vector3d(a + u), Vector3d(a + v), Vector3d(a + u + v)}) {
    AddEdge(corner, corner + w);
  }
}

void SceneBuilder::AddBox(const Vector3d& min, const Vector3d& max, uint32_t material) {
  const Vector3d size = max - min;
  AddParallelepiped(min, {size.x(), 0, 0}, {0, size.y(), 0}, {0, 0, size.z()}, material);
}

void SceneBuilder::AddBar(const Vector3d& from, const Vector3d& to, double side,
                          uint32_t material) {
  const auto [first, second] = Across(to - from);
  const Vector3d corner = from - 0.5 * side * (first + second);
  AddParallelepiped(corner, side * first, side * second, to - from, material);
}

void SceneBuilder::AddRoundBar(const Vector3d& from, const Vector3d& to, double radius, int sides,
                               uint32_t material) {
  const auto [first, second] = Across(to - from);
  const auto rim = [&, first = first, second = second](int i) {
    const double angle_rad = 2 * M_PI * i / sides;
    return Vector3d(radius * (std::cos(angle_rad) * first + std::sin(angle_rad) * second));
  };
  for (int i = 0; i < sides; ++i) {
    const Vector3d chord = rim(i + 1) - rim(i);
    AddQuad(from + rim(i), chord, to - from, material, {i * chord.norm(), 0});
  }
}

void SceneBuilder::AddPipe(const Vector3d& from, const Vector3d& to, double radius, int sides,
                           uint32_t material) {
  AddRoundBar(from, to, radius, sides, material);
  scene_.pipes.push_back({world_object_ * from, world_object_ * to, radius, body_});
}

void SceneBuilder::AddCylinder(const Vector3d& from, const Vector3d& to, double radius,
                               uint32_t material) {
  constexpr int kSides = 48;
  AddPipe(from, to, radius, kSides, material);
  // Strips, each from a side of the rim to the opposite one, make up the polygon; 0.1 mm apart.
  const auto [first, second] = Across(to - from);
  const Vector3d along = (to - from).normalized();
  for (int i = 0; i < kSides / 2; ++i) {
    const Eigen::AngleAxisd turn((2 * i + 1) * M_PI / kSides, along);
    const Vector3d u = turn * (2 * radius * std::cos(M_PI / kSides) * first);
    const Vector3d v = turn * (2 * radius * std::sin(M_PI / kSides) * second);
    const Vector3d inset = i * 1e-4 * along;
    AddQuad(to - 0.5 * (u + v) - inset, u, v, material);
    AddQuad(from - 0.5 * (u + v) + v + inset, u, -v, material);
  }
}

void SceneBuilder::AddLamp(const Vector3d& a, const Vector3d& u, const Vector3d& v, float radiance,
                           uint32_t material) {
  AddQuad(a, u, v, material);
  const SceneQuad& quad = scene_.quads.back();
  scene_.lamps.push_back({quad.a, quad.u, quad.v, radiance});
}

void SceneBuilder::AddTag(const std::string& name, const Vector3d& a, const Vector3d& u,
                          const Vector3d& v, uint32_t material) {
  scene_.tags.push_back({name, static_cast<uint32_t>(scene_.quads.size())});
  AddQuad(a, u, v, material);
  AddBorder(a, u, v);
}

void SceneBuilder::AddPane(const Vector3d& a, const Vector3d& u, const Vector3d& v) {
  const Eigen::Matrix3d rotation = world_object_.linear();
  scene_.panes.push_back({(world_object_ * a).cast<float>(), (rotation * u).cast<float>(),
                          (rotation * v).cast<float>()});
}

void SceneBuilder::AddWallFace(const SceneWallFace& face_object) {
  SceneWallFace face = face_object;
  face.foot_world = world_object_ * face.foot_world;
  face.end_world = world_object_ * face.end_world;
  face.normal = world_object_.linear() * face.normal;
  scene_.wall_faces.push_back(face);
}

Scene SceneBuilder::Finish(const Progress& progress, bool fittings_apart) {
  Scene scene = std::move(scene_);
  scene_ = Scene();
  body_ = -1;
  if (!fittings_apart) {
    for (TrueEdge& edge : scene.edges) edge.body = -1;
  }
  scene.edges = MergedEdges(scene.edges, progress);
  return scene;
}

}  // namespace slcmap::data
