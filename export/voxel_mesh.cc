#include "export/voxel_mesh.h"

#include <algorithm>
#include <cmath>

#include "export/colour_scale.h"

namespace slcmap {
namespace {

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
    for (const Voxel& voxel : voxels) cells_.push_back(CellOf(voxel, {0, 0, 0}));
    std::sort(cells_.begin(), cells_.end());
  }

  bool HasNeighbour(const Voxel& voxel, const std::array<int64_t, 3>& direction) const {
    return std::binary_search(cells_.begin(), cells_.end(), CellOf(voxel, direction));
  }

 private:
  using Cell = std::array<int64_t, 4>;  // x, y, z, size in micrometres

  static Cell CellOf(const Voxel& voxel, const std::array<int64_t, 3>& offset) {
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

}  // namespace

void AddVoxels(const std::vector<Voxel>& voxels,
               const std::function<Colour(const Voxel&)>& colour_of, MeshLayer* layer) {
  const VoxelGrid grid(voxels);
  const std::vector<CubeFace> faces = CubeFaces();
  for (const Voxel& voxel : voxels) {
    const Colour colour = colour_of(voxel);
    for (const CubeFace& face : faces) {
      if (!grid.HasNeighbour(voxel, face.normal)) AddFace(voxel, face, colour, layer);
    }
  }
}

}  // namespace slcmap
