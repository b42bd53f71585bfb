#include "mapping/occupancy_map.h"

#include <octomap/OcTree.h>
#include <octomap/octomap.h>

#include <algorithm>
#include <sstream>

#include "data/file.h"
#include "mapping/octree_file.h"

namespace slcmap {
namespace {

constexpr double kReachVoxels = 32767;  // OctoMap's keys are of 16 bits
constexpr int kKeyOfOrigin = 32768;
constexpr std::size_t kKeptNodes = 1000000;  // of work that is ended: finishing takes a second
// The inner nodes are updated once, at the end.
constexpr bool kLazy = true;

octomap::point3d ToOctomap(const Eigen::Vector3d& p) {
  return octomap::point3d(p.cast<float>().x(), p.cast<float>().y(), p.cast<float>().z());
}

bool IsInOctree(const OctreeCell& cell) { return cell.cwiseAbs().maxCoeff() < kReachVoxels; }

octomap::OcTreeKey KeyOf(const OctreeCell& cell) {
  const auto key = [](int index) { return static_cast<octomap::key_type>(index + kKeyOfOrigin); };
  return {key(cell.x()), key(cell.y()), key(cell.z())};
}

// The points of a bundle whose rays stay within `reach_m` of the origin along each axis. OctoMap
// says on the console of each of the others that it is left out.
octomap::Pointcloud PointsInReach(const RayBundle& bundle, double max_range_m, double reach_m) {
  octomap::Pointcloud points;
  const auto reaches = [&](const Eigen::Vector3d& p) { return p.cwiseAbs().maxCoeff() < reach_m; };
  if (!reaches(bundle.p_world_camera)) return points;
  for (const Eigen::Vector3d& p : bundle.p_world) {
    const Eigen::Vector3d way = p - bundle.p_world_camera;
    const double part = std::min(1.0, max_range_m / way.norm());
    if (p.allFinite() && reaches(bundle.p_world_camera + part * way))
      points.push_back(ToOctomap(p));
  }
  return points;
}

}  // namespace

class OccupancyMap::Impl {
 public:
  explicit Impl(double resolution_m) : tree(resolution_m) {}

  std::vector<Voxel> Voxels(bool occupied) const {
    std::vector<Voxel> voxels;
    for (auto leaf = tree.begin_leafs(); leaf != tree.end_leafs(); ++leaf) {
      if (tree.isNodeOccupied(*leaf) != occupied) continue;
      voxels.push_back({{leaf.getX(), leaf.getY(), leaf.getZ()}, leaf.getSize()});
    }
    return voxels;
  }

  octomap::OcTree tree;
};

OccupancyMap::OccupancyMap(double resolution_m) : impl_(std::make_unique<Impl>(resolution_m)) {}
OccupancyMap::~OccupancyMap() = default;
OccupancyMap::OccupancyMap(OccupancyMap&&) noexcept = default;
OccupancyMap& OccupancyMap::operator=(OccupancyMap&&) noexcept = default;

int64_t OccupancyMap::Insert(const std::vector<RayBundle>& bundles, double max_range_m,
                             const Progress& progress) {
  const double reach_m = kReachVoxels * resolution_m();
  int64_t left_out = 0;
  for (std::size_t i = 0; i < bundles.size(); ++i) {
    if (!progress.Report(static_cast<double>(i) / static_cast<double>(bundles.size()))) {
      if (impl_->tree.size() > kKeptNodes) impl_->tree.clear();
      break;
    }
    const octomap::Pointcloud points = PointsInReach(bundles[i], max_range_m, reach_m);
    left_out += static_cast<int64_t>(bundles[i].p_world.size() - points.size());
    impl_->tree.insertPointCloud(points, ToOctomap(bundles[i].p_world_camera), max_range_m, kLazy);
  }
  Finish();
  return left_out;
}

int64_t OccupancyMap::Update(const CellObservation& observation) {
  int64_t left_out = 0;
  const auto update = [&](const std::vector<OctreeCell>& cells, bool occupied) {
    for (const OctreeCell& cell : cells) {
      if (IsInOctree(cell)) {
        impl_->tree.updateNode(KeyOf(cell), occupied, kLazy);
      } else {
        ++left_out;
      }
    }
  };
  update(observation.free, false);
  update(observation.occupied, true);
  return left_out;
}

void OccupancyMap::Mark(const CellObservation& cells) {
  const auto mark = [&](const std::vector<OctreeCell>& marked, float log_odds) {
    for (const OctreeCell& cell : marked) {
      if (IsInOctree(cell)) impl_->tree.setNodeValue(KeyOf(cell), log_odds, kLazy);
    }
  };
  mark(cells.free, impl_->tree.getClampingThresMinLog());
  mark(cells.occupied, impl_->tree.getClampingThresMaxLog());
}

void OccupancyMap::Finish() {
  impl_->tree.updateInnerOccupancy();
  impl_->tree.prune();
}

double OccupancyMap::resolution_m() const { return impl_->tree.getResolution(); }

std::vector<Voxel> OccupancyMap::OccupiedVoxels() const { return impl_->Voxels(true); }

std::vector<Voxel> OccupancyMap::FreeVoxels() const { return impl_->Voxels(false); }

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
  bytes << OctreeHeaderText(impl_->tree.size(), impl_->tree.getResolution());
  impl_->tree.writeBinaryData(bytes);
  WriteFile(path, bytes.str());
}

void OccupancyMap::WriteProbabilities(const std::string& path) const {
  std::ostringstream bytes;
  bytes << "# Octomap OcTree file\nid OcTree\nsize " << impl_->tree.size() << "\nres "
        << impl_->tree.getResolution() << "\ndata\n";
  impl_->tree.writeData(bytes);
  WriteFile(path, bytes.str());
}

std::vector<uint8_t> OccupancyMap::Nodes() const {
  std::ostringstream bytes;
  if (impl_->tree.size() > 0) impl_->tree.writeData(bytes);
  const std::string text = bytes.str();
  return {text.begin(), text.end()};
}

OccupancyMap OccupancyMap::FromNodes(double resolution_m, const std::vector<uint8_t>& nodes) {
  OccupancyMap map(resolution_m);
  if (nodes.empty()) return map;
  std::istringstream bytes(std::string(nodes.begin(), nodes.end()));
  map.impl_->tree.readData(bytes);
  return map;
}

OccupancyMap OccupancyMap::Read(const std::string& path) {
  const std::string bytes = ReadFile(path);
  const OctreeHeader header = ParseOctreeHeader(path, bytes);
  CheckOctreeNodes(path, bytes, header);
  OccupancyMap map(header.resolution_m);
  if (header.nodes == 0) return map;
  std::istringstream nodes(bytes.substr(header.data_offset));
  map.impl_->tree.readBinaryData(nodes);
  return map;
}

}  // namespace slcmap
