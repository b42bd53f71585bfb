#include "export/voxel_mesh.h"

#include <algorithm>
#include <cmath>

#include "export/colour_scale.h"

namespace slcmap {
namespace {

constexpr int64_t kFaceVertices = 4;

// A face of a cube of edge 2 about the origin.
struct CubeFace {
  std::array<int64_t, 3> normal;
  std::array<Eigen::Vector3d, 4> corners;  // counter-clockwise seen from outside
  double shade;
};

std::vector<CubeFace> CubeFaces() {
  constexpr double kTopShade = 1, kBottomShade = 0.6, kXShade = 0.88, kYShade = 0.76;
  return {{{0, 0, 1}, {{{-1, -1, 1}, {1, -1, 1}, {1, 1, 1}, {-1, 1, 1}}}, kTopShade},
          {{0, 0, -1}, {{{-1, 1, -1}, {1, 1, -1}, {1, -1, -1}, {-1, -1, -1}}}, kBottomShade},
          {{1, 0, 0}, {{{1, -1, -1}, {1, 1, -1}, {1, 1, 1}, {1, -1, 1}}}, kXShade},
          {{-1, 0, 0}, {{{-1, 1, -1}, {-1, -1, -1}, {-1, -1, 1}, {-1, 1, 1}}}, kXShade},
          {{0, 1, 0}, {{{1, 1, -1}, {-1, 1, -1}, {-1, 1, 1}, {1, 1, 1}}}, kYShade},
          {{0, -1, 0}, {{{-1, -1, -1}, {1, -1, -1}, {1, -1, 1}, {-1, -1, 1}}}, kYShade}};
}

// Where voxels are, each in the grid of its own size.
class VoxelGrid {
 public:
  explicit VoxelGrid(const std::vector<Voxel>& voxels) {
    for (const Voxel& voxel : voxels) cells_.push_back(GetCell(voxel, {0, 0, 0}));
    std::sort(cells_.begin(), cells_.end());
  }

  bool HasNeighbour(const Voxel& voxel, const std::array<int64_t, 3>& direction) const {
    return std::binary_search(cells_.begin(), cells_.end(), GetCell(voxel, direction));
  }

 private:
  using Cell = std::array<int64_t, 4>;  // x, y, z, size in micrometres

  static Cell GetCell(const Voxel& voxel, const std::array<int64_t, 3>& offset) {
    Cell cell;
    for (int axis = 0; axis < 3; ++axis) {
      cell[axis] =
          static_cast<int64_t>(std::floor(voxel.centre_world[axis] / voxel.size_m)) + offset[axis];
    }
    cell[3] = std::llround(voxel.size_m * 1e6);
    return cell;
  }

  std::vector<Cell> cells_;  // sorted
};

// Every face has its own four vertices, as shades differ.
void AddFace(const Voxel& voxel, const CubeFace& face, const Colour& colour, MeshLayer* layer) {
  const auto first = static_cast<uint32_t>(layer->vertices.size());
  for (const Eigen::Vector3d& corner : face.corners) {
    layer->vertices.Add(voxel.centre_world + 0.5 * voxel.size_m * corner,
                        Shade(colour, face.shade));
  }
  layer->triangles.push_back({first, first + 1, first + 2});
  layer->triangles.push_back({first, first + 2, first + 3});
}

// Calls visit(voxel, face) for each face that is not between two voxels.
template <typename Visitor>
void ForEachFace(const std::vector<Voxel>& voxels, const Progress& progress, Visitor visit) {
  constexpr std::size_t kReportEvery = 1024;
  const VoxelGrid grid(voxels);
  const std::vector<CubeFace> faces = CubeFaces();
  for (std::size_t i = 0; i < voxels.size(); ++i) {
    if (i % kReportEvery == 0) {
      progress.ReportOrStop(static_cast<double>(i) / static_cast<double>(voxels.size()));
    }
    for (const CubeFace& face : faces) {
      if (!grid.HasNeighbour(voxels[i], face.normal)) visit(voxels[i], face);
    }
  }
}

}  // namespace

void AddVoxels(const std::vector<Voxel>& voxels,
               const std::function<Colour(const Voxel&)>& colour_of, MeshLayer* layer,
               const Progress& progress) {
  ForEachFace(voxels, progress, [&](const Voxel& voxel, const CubeFace& face) {
    AddFace(voxel, face, colour_of(voxel), layer);
  });
}

int64_t CountVoxelVertices(const std::vector<Voxel>& voxels) {
  int64_t faces = 0;
  ForEachFace(voxels, {}, [&](const Voxel&, const CubeFace&) { ++faces; });
  return kFaceVertices * faces;
}

}  // namespace slcmap
