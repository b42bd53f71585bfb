#include "mapping/occupancy_map.h"

#include <octomap/OcTree.h>
#include <octomap/octomap.h>
#include <spdlog/fmt/fmt.h>

#include <sstream>

#include "data/error.h"
#include "data/file.h"

namespace slcmap {
namespace {

constexpr char kFirstLine[] = "# Octomap OcTree binary file";
constexpr char kTreeType[] = "OcTree";

octomap::point3d ToOctomap(const Eigen::Vector3d& p) {
  return octomap::point3d(p.cast<float>().x(), p.cast<float>().y(), p.cast<float>().z());
}

}  // namespace

class OccupancyMap::Impl {
 public:
  explicit Impl(double resolution_m) : tree(resolution_m) {}
  octomap::OcTree tree;
};

OccupancyMap::OccupancyMap(double resolution_m) : impl_(std::make_unique<Impl>(resolution_m)) {}
OccupancyMap::~OccupancyMap() = default;
OccupancyMap::OccupancyMap(OccupancyMap&&) noexcept = default;
OccupancyMap& OccupancyMap::operator=(OccupancyMap&&) noexcept = default;

void OccupancyMap::Insert(const std::vector<RayBundle>& bundles, double max_range_m) {
  for (const RayBundle& bundle : bundles) {
    octomap::Pointcloud points;
    for (const Eigen::Vector3d& p : bundle.p_world) points.push_back(ToOctomap(p));
    // The inner nodes are updated once, at the end.
    constexpr bool kLazy = true;
    impl_->tree.insertPointCloud(points, ToOctomap(bundle.p_world_camera), max_range_m, kLazy);
  }
  impl_->tree.updateInnerOccupancy();
  impl_->tree.prune();
}

double OccupancyMap::resolution_m() const { return impl_->tree.getResolution(); }

std::vector<Voxel> OccupancyMap::OccupiedVoxels() const {
  std::vector<Voxel> voxels;
  for (auto leaf = impl_->tree.begin_leafs(); leaf != impl_->tree.end_leafs(); ++leaf) {
    if (!impl_->tree.isNodeOccupied(*leaf)) continue;
    voxels.push_back({{leaf.getX(), leaf.getY(), leaf.getZ()}, leaf.getSize()});
  }
  return voxels;
}

bool OccupancyMap::IsOccupied(const Eigen::Vector3d& p_world) const {
  const octomap::OcTreeNode* node = impl_->tree.search(ToOctomap(p_world));
  return node && impl_->tree.isNodeOccupied(node);
}

bool OccupancyMap::IsFree(const Eigen::Vector3d& p_world) const {
  const octomap::OcTreeNode* node = impl_->tree.search(ToOctomap(p_world));
  return node && !impl_->tree.isNodeOccupied(node);
}

// The header is written and read here, as OctoMap's own functions report to the console.
void OccupancyMap::Write(const std::string& path) const {
  std::ostringstream bytes;
  bytes << fmt::format("{}\nid {}\nsize {}\nres {}\ndata\n", kFirstLine, kTreeType,
                       impl_->tree.size(), impl_->tree.getResolution());
  impl_->tree.writeBinaryData(bytes);
  WriteFile(path, bytes.str());
}

OccupancyMap OccupancyMap::Read(const std::string& path) {
  std::istringstream bytes(ReadFile(path));
  std::string line, id;
  std::size_t size = 0;
  double resolution_m = 0;
  if (!std::getline(bytes, line) || line != kFirstLine) {
    throw DataError(fmt::format("{}: row 1: expected '{}'", path, kFirstLine));
  }
  for (std::string key; bytes >> key && key != "data";) {
    if (key == "id") bytes >> id;
    if (key == "size") bytes >> size;
    if (key == "res") bytes >> resolution_m;
  }
  if (!bytes || bytes.get() != '\n' || id != kTreeType || !(resolution_m > 0)) {
    throw DataError(fmt::format("{}: expected a header with 'id {}', 'size', 'res' and 'data'",
                                path, kTreeType));
  }
  OccupancyMap map(resolution_m);
  if (size > 0) map.impl_->tree.readBinaryData(bytes);
  if (!bytes || map.impl_->tree.size() != size) {
    throw DataError(fmt::format("{}: damaged: found {} nodes, expected {}", path,
                                map.impl_->tree.size(), size));
  }
  return map;
}

}  // namespace slcmap
