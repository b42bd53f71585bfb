// A cloud or a mesh as surfaces: cubes of space with the plane of the points around each.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <unordered_map>
#include <vector>

#include "data/external/external_map.h"
#include "mapping/map/point_index.h"

namespace slcmap::inline evaluation {

struct SurfaceCube {
  Eigen::Vector3d p = Eigen::Vector3d::Zero();  // mean of the points in it and in the cubes around
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  double flatness = 1;  // least over middle variance of these; 0 of a plane
  bool is_plane = false;
  std::vector<int32_t> points;  // in it
};

class SurfaceMap {
 public:
  // Where points are dense, some stand for all.
  explicit SurfaceMap(std::vector<Eigen::Vector3d> points);

  const std::vector<Eigen::Vector3d>& points() const { return points_; }
  const std::vector<SurfaceCube>& cubes() const { return cubes_; }
  double cube_m() const { return cube_m_; }
  int planes() const { return planes_; }  // cubes on planes

  // The cubes that touch one, itself left out.
  template <typename Handler>
  void ForEachAround(size_t cube, Handler handle) const {
    for (int i = 0; i < 27; ++i) {
      if (i == 13) continue;
      const int other = FindAt(where_[cube] + Eigen::Vector3i(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1));
      if (other >= 0) handle(static_cast<size_t>(other));
    }
  }

  // Cubes within surfaces, off their corners, evenly over these, in an order that is none of space.
  std::vector<size_t> SomePlanes(size_t most) const;

 private:
  void Fill(const std::vector<Eigen::Vector3d>& points, double cube_m);
  void FitPlanes();
  Eigen::Vector3i Locate(const Eigen::Vector3d& p, double cube_m) const;
  std::vector<Eigen::Vector3d> Thin(std::vector<Eigen::Vector3d> points) const;
  // To the layer that the cube's own points are of, among all those around.
  void RefitPlane(size_t cube);
  bool IsWithinSurface(size_t cube) const;
  int FindAt(const Eigen::Vector3i& place) const;

  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();  // of the cubes
  std::vector<Eigen::Vector3d> points_;
  std::vector<SurfaceCube> cubes_;
  std::vector<Eigen::Vector3i> where_;  // by cube
  std::unordered_map<int64_t, int> index_;
  double cube_m_ = 0;
  int planes_ = 0;
};

// The planes of a map by where they are.
class NearPlanes {
 public:
  explicit NearPlanes(const SurfaceMap& map);

  // Of the nearest planes to a point that which passes nearest, with the signed distance; nothing
  // where there is none within reach_m, or none that faces as `normal` does.
  struct Match {
    size_t cube = 0;
    double off_m = 0;
  };
  std::optional<Match> Find(const Eigen::Vector3d& p, double reach_m,
                            const Eigen::Vector3d* normal = nullptr) const;

  // How far a place is from the map: from that plane, or from the nearest point where that is
  // nearer, as at corners and on what is small. Nothing beyond reach_m.
  std::optional<double> FindOff_m(const Eigen::Vector3d& p, double reach_m) const;

 private:
  const SurfaceMap& map_;
  std::vector<size_t> cubes_;
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
  std::unique_ptr<PointTree> planes_, points_;
};

// The axes of a building as columns, the last one upwards: z where one of them is near it, else
// that along which the map extends least.
struct BuildingAxes {
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  bool is_z_up = true;  // the map's own z is nearly its up
  double tilt_deg = 0;  // of its z against that, where it is
  bool are_found = false;
};
BuildingAxes FindAxes(const std::vector<Eigen::Vector3d>& directions,
                      const std::vector<Eigen::Vector3d>& places);

// The axes with that upwards, where their own is near it.
BuildingAxes WithUp(BuildingAxes axes, const Eigen::Vector3d& upwards);
// Upwards as floors and ceilings have it, which leaning walls do not turn: of the normals of
// surfaces those near the axis. The axes' own where there are few.
Eigen::Vector3d FindUpOfFloors(const BuildingAxes& axes,
                               const std::vector<Eigen::Vector3d>& normals);

// The points of a map that nothing laid on a plane; of a mesh points evenly over its faces.
std::vector<Eigen::Vector3d> SurfacePoints(const ExternalMap& map);

// The extents of most of what there is, along its own axes, ascending. `places` is not empty.
Eigen::Vector3d FindExtents(const std::vector<Eigen::Vector3d>& places);

// A number that is the same for the same input and without any order: for samples.
uint64_t MixBits(uint64_t value);

}  // namespace slcmap::evaluation
