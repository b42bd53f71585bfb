// The true edges and surfaces of a building, and which of them the cameras saw.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "data/core/progress.h"
#include "data/core/types.h"
#include "data/io/ply.h"
#include "data/io/trajectory.h"

namespace slcmap::inline evaluation {

double Length(const PlySegment& segment);
double Distance_m(const PlySegment& segment, const Eigen::Vector3d& p);  // to its nearest point

struct TrueEdges {
  // Edges of which the cameras saw a part, from end to end; of those that are bent, their straight
  // pieces.
  std::vector<PlySegment> whole;
  std::vector<PlySegment> seen;  // the parts that they saw
  // Which edge each of `whole` is of: pieces of one have the same. Empty: each is an edge.
  std::vector<int64_t> edge_of_whole = {};
  // The parts that they saw well, where that is known.
  std::optional<std::vector<PlySegment>> clear = {};
};

// A row of edges.csv: a part of an edge, or of a straight piece of a bent one, that the cameras
// saw; or, where they did not see any of it, none.
struct EdgeRow {
  int64_t edge = 0;
  int64_t axis = -1;  // 0 X, 1 Y, 2 vertical, of its wing; -1 none
  PlySegment whole;   // the edge or the piece from end to end, in world
  double from_m = 0, to_m = 0;

  PlySegment Seen() const;
};

// Reads edges.csv as the simulator writes it (data/simulator/renderer.h). Throws DataError
// naming file and row.
std::vector<EdgeRow> ReadEdgeTable(const std::string& path);

// Reads edges.csv, or the edges of an edge-PLY (a path that ends in ".ply"), all seen. Throws
// DataError naming file and row, also when there is no edge with an extent.
TrueEdges ReadTrueEdges(const std::string& path);

// Triangles in a tree of boxes: what a ray hits first, and how far a point is from the nearest.

using Triangle = std::array<Eigen::Vector3d, 3>;  // metres in world

class TriangleTree {
 public:
  explicit TriangleTree(std::vector<Triangle> triangles);

  // The distance along a ray (unit direction) to the first triangle, seen from either side;
  // infinite where there is none up to max_m.
  double FirstHit_m(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                    double max_m = std::numeric_limits<double>::infinity()) const;

  // The distance of a point to the nearest triangle; max_m where none is nearer.
  double Distance_m(const Eigen::Vector3d& p, double max_m) const;

 private:
  // Leaves hold the triangles [first, first + count); inner nodes have count 0, their left child
  // next to them, and the right one at `first`.
  struct Node {
    Eigen::AlignedBox3d box;
    int32_t first = 0, count = 0;
  };

  void Build(int32_t begin, int32_t end);

  std::vector<Triangle> triangles_;
  std::vector<Node> nodes_;
};

// The faces of a PLY mesh, cut into triangles. Throws DataError naming file and face when there are
// none, or one refers to no vertex.
std::vector<Triangle> ReadSurfaces(const std::string& path);

// Which parts of a building's true surfaces the cameras saw, from true poses.

struct VisibilityOptions {
  double interval_s = 0.25;  // between the poses that are looked from
  int stride_px = 6;         // between the rays of an image
  void Check() const;        // throws ConfigError
};

// A point of a surface, and the least distance from which a camera saw it.
struct SeenSample {
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  double range_m = 0;
};

// What one image saw: rays from its camera (metres, world), whose ends lie on surfaces.
struct ReferenceView {
  Eigen::Vector3d p_camera = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3d> ends;
};

// The poses that are at least interval_s apart, from the first one on.
Trajectory PosesApart(const Trajectory& poses, double interval_s);

// The rays of the left camera up to max_range_m, at poses interval_s apart. Throws StoppedError
// when progress says so.
std::vector<ReferenceView> ReferenceViews(const TriangleTree& surfaces, const Trajectory& truth,
                                          const Rig& rig, const VisibilityOptions& options,
                                          const Progress& progress = {});

// The surfaces that the views saw, a sample a cell: evenly over them, however often they were seen.
std::vector<SeenSample> SeenSurfaces(const std::vector<ReferenceView>& views, double cell_m);

// Which parts of a building's true edges the cameras saw well, from true poses.

// The parts of the edges that the left camera saw in 20 frames from up to 8 m, not hidden by the
// surfaces. Throws StoppedError when progress says so.
std::vector<PlySegment> ClearlySeen(const TrueEdges& edges, const TriangleTree& surfaces,
                                    const Trajectory& truth, const Rig& rig,
                                    const Progress& progress = {});

}  // namespace slcmap::evaluation
