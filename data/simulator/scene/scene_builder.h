// Collects the quads, lamps and true edges of a scene from primitives placed anywhere.
#pragma once

#include <Eigen/Geometry>
#include <random>
#include <string>
#include <vector>

#include "data/core/progress.h"
#include "data/simulator/scene/scene.h"

namespace slcmap::inline data {

// Throws ConfigError, without a place, for a surface without area and where surfaces or edges
// become too many. All lengths in metres. Points are in the frame of the current placement; a
// placement belongs to a wing, whose heading decides the axes of its edges.
class SceneBuilder {
 public:
  // Poses of the wings in world, yaw and translation only; at least one.
  explicit SceneBuilder(std::vector<Eigen::Isometry3d> world_wings);

  uint32_t AddMaterial(const SurfaceMaterial& material);
  void SetPlacement(int wing, const Eigen::Isometry3d& wing_object);
  // A body whose frame is the current placement; what is added from now on belongs to it.
  int AddBody(const std::string& kind, bool is_fitting);
  void SetBody(int body) { body_ = body; }

  // Without edges. `texture_origin`: texture coordinates at a, so that the parts of a wall go on.
  void AddQuad(const Eigen::Vector3d& a, const Eigen::Vector3d& u, const Eigen::Vector3d& v,
               uint32_t material, const Eigen::Vector2d& texture_origin = Eigen::Vector2d::Zero());
  // Shorter ones than 5 cm are left out: no line detector keeps them.
  void AddEdge(const Eigen::Vector3d& a, const Eigen::Vector3d& b);
  // The four sides of a parallelogram.
  void AddBorder(const Eigen::Vector3d& a, const Eigen::Vector3d& u, const Eigen::Vector3d& v);

  // With its twelve edges. u, v, w are right-handed.
  void AddParallelepiped(const Eigen::Vector3d& a, const Eigen::Vector3d& u,
                         const Eigen::Vector3d& v, const Eigen::Vector3d& w, uint32_t material);
  void AddBox(const Eigen::Vector3d& min, const Eigen::Vector3d& max, uint32_t material);
  // A square bar around a line, upright where it can be.
  void AddBar(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double side,
              uint32_t material);
  // A round bar of `sides` quads, open at its ends: its outlines are no edges of the building.
  void AddRoundBar(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double radius, int sides,
                   uint32_t material);
  // One that stands free all around: a pipe of the scene.
  void AddPipe(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double radius, int sides,
               uint32_t material);
  // A round bar with flat ends.
  void AddCylinder(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double radius,
                   uint32_t material);
  // Shines to where u x v points.
  void AddLamp(const Eigen::Vector3d& a, const Eigen::Vector3d& u, const Eigen::Vector3d& v,
               float radiance, uint32_t material);

  // A quad with the tag in its middle, and its border.
  void AddTag(const std::string& name, const Eigen::Vector3d& a, const Eigen::Vector3d& u,
              const Eigen::Vector3d& v, uint32_t material);
  // Of clear glass.
  void AddPane(const Eigen::Vector3d& a, const Eigen::Vector3d& u, const Eigen::Vector3d& v);

  // A side of a wall, whose surfaces are added by themselves: what is true of it as a whole.
  void AddWallFace(const SceneWallFace& face_object);
  int NewOpening() { return openings_++; }

  // The scene; edges that lie on one another become one, unless they are of two fittings that
  // stand apart. Leaves the builder empty. Throws StoppedError where progress ends it.
  Scene Finish(const Progress& progress = {}, bool fittings_apart = false);

 private:
  Scene scene_;
  std::vector<Eigen::Isometry3d> world_wings_;
  Eigen::Isometry3d world_object_ = Eigen::Isometry3d::Identity();
  int wing_ = 0, body_ = -1, openings_ = 0;
};

// Collinear edges (within a millimetre) of one body that overlap become their union.
std::vector<TrueEdge> MergedEdges(const std::vector<TrueEdge>& edges,
                                  const Progress& progress = {});

// Uniform in [low, high); the same on each machine.
double UniformIn(double low, double high, std::mt19937* generator);

}  // namespace slcmap::data
