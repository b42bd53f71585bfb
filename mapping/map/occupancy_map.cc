#include "mapping/map/occupancy_map.h"

#include <octomap/OcTree.h>
#include <octomap/octomap.h>
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <optional>
#include <sstream>

#include "data/core/error.h"
#include "data/io/file.h"

namespace slcmap::inline mapping {
namespace {

constexpr std::string_view kFirstLine = "# Octomap OcTree binary file";
constexpr std::string_view kTreeType = "OcTree";
constexpr std::size_t kMaxShown = 40;  // characters of what was found

template <typename T>
std::optional<T> Parse(std::string_view text) {
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

class HeaderParser {
 public:
  HeaderParser(const std::string& path, std::string_view bytes) : path_(path), bytes_(bytes) {}

  OctreeHeader Parse() {
    if (Line() != kFirstLine) Fail(fmt::format("'{}'", kFirstLine));
    while (Line() != "data") {
      if (!line_.empty() && line_[0] != '#') TakeKey();
    }
    if (!nodes_ || !resolution_m_ || !typed_) Fail("'id', 'size' and 'res' before 'data'");
    return {*nodes_, *resolution_m_, position_};
  }

 private:
  std::string_view Line() {
    ++row_;
    const std::size_t end = bytes_.find('\n', position_);
    line_ = bytes_.substr(position_, end - position_);
    if (end == std::string_view::npos) Fail("more rows of a header, up to 'data'");
    position_ = end + 1;
    return line_;
  }

  void TakeKey() {
    const std::size_t blank = line_.find(' ');
    const std::string_view key = line_.substr(0, blank);
    const std::string_view value =
        blank == std::string_view::npos ? std::string_view() : line_.substr(blank + 1);
    if (key == "id" && !typed_) {
      typed_ = value == kTreeType;
      if (!typed_) Fail(fmt::format("'id {}'", kTreeType));
    } else if (key == "size" && !nodes_) {
      nodes_ = slcmap::Parse<std::size_t>(value);
      if (!nodes_) Fail("'size' with a number of nodes");
    } else if (key == "res" && !resolution_m_) {
      resolution_m_ = slcmap::Parse<double>(value);
      if (resolution_m_ && *resolution_m_ >= kMinVoxel_m && *resolution_m_ <= kMaxVoxel_m) return;
      Fail(fmt::format("'res' with {} to {} m", kMinVoxel_m, kMaxVoxel_m));
    } else {
      Fail("'id', 'size' and 'res', once each, before 'data'");
    }
  }

  // Bytes that are no text would spoil the one line of a message.
  std::string Shown() const {
    std::string shown(line_.substr(0, kMaxShown));
    for (char& c : shown) {
      if (c < ' ' || c > '~') c = '?';
    }
    return shown + (line_.size() > kMaxShown ? "..." : "");
  }

  [[noreturn]] void Fail(const std::string& expected) const {
    throw DataError(
        fmt::format("{}: row {}: found '{}', expected {}", path_, row_, Shown(), expected));
  }

  const std::string& path_;
  std::string_view bytes_, line_;
  std::size_t position_ = 0;
  int row_ = 0;
  bool typed_ = false;
  std::optional<std::size_t> nodes_;
  std::optional<double> resolution_m_;
};

// What two bytes say of a node's eight children.
struct Children {
  explicit Children(std::string_view two_bytes) {
    for (const char byte : two_bytes) {
      for (int shift = 0; shift < 8; shift += 2) {
        const int kind = (static_cast<uint8_t>(byte) >> shift) & 3;
        count += kind != 0;
        inner += kind == 3;
      }
    }
  }
  int count = 0, inner = 0;
};

class NodeWalk {
 public:
  NodeWalk(const std::string& path, std::string_view bytes, std::size_t offset)
      : path_(path), bytes_(bytes), position_(offset) {}

  // Walks one tree; returns the number of its nodes.
  std::size_t Walk() {
    std::size_t nodes = 1;
    std::array<int, kOctreeDepth> waiting{};  // inner nodes of each depth that are still to come
    waiting[0] = 1;
    for (int depth = 0; depth >= 0;) {
      if (waiting[depth] == 0) {
        --depth;
        continue;
      }
      --waiting[depth];
      const Children children = Take();
      nodes += children.count;
      if (children.inner == 0) continue;
      if (++depth == kOctreeDepth) {
        Fail("a node deeper than 16", "a tree of depth 16");
      }
      waiting[depth] = children.inner;
    }
    return nodes;
  }

  [[noreturn]] void Fail(const std::string& found, const std::string& expected) const {
    throw DataError(fmt::format("{}: byte {}: damaged: found {}, expected {}", path_, position_,
                                found, expected));
  }

  std::size_t position() const { return position_; }

 private:
  Children Take() {
    if (bytes_.size() - position_ < 2) Fail("the end of the file", "more nodes");
    const Children children(bytes_.substr(position_, 2));
    if (children.count == 0) Fail("an inner node without children", "at least one");
    position_ += 2;
    return children;
  }

  const std::string& path_;
  std::string_view bytes_;
  std::size_t position_;
};

}  // namespace

std::string OctreeHeaderText(std::size_t nodes, double resolution_m) {
  return fmt::format("{}\nid {}\nsize {}\nres {}\ndata\n", kFirstLine, kTreeType, nodes,
                     resolution_m);
}

OctreeHeader ParseOctreeHeader(const std::string& path, std::string_view bytes) {
  return HeaderParser(path, bytes).Parse();
}

void CheckOctreeNodes(const std::string& path, std::string_view bytes, const OctreeHeader& header) {
  NodeWalk walk(path, bytes, header.data_offset);
  const std::size_t nodes = header.nodes == 0 ? 0 : walk.Walk();
  if (nodes != header.nodes) {
    walk.Fail(fmt::format("{} nodes", nodes), fmt::format("{} as in the header", header.nodes));
  }
  if (walk.position() != bytes.size()) {
    walk.Fail(fmt::format("{} more bytes", bytes.size() - walk.position()), "the end of the file");
  }
}

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

octomap::OcTreeKey MakeKey(const OctreeCell& cell) {
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

namespace {

// Rays take at most as many times fewer voxels as these are larger.
[[noreturn]] void FailForSize(double resolution_m, std::size_t max_voxels, std::size_t done,
                              std::size_t all) {
  const double share = static_cast<double>(done) / static_cast<double>(all);
  throw ConfigError(
      fmt::format("mapping.occupancy.resolution_m: found {}, which takes more than {} voxels "
                  "(mapping.occupancy.max_voxels); expected at least {:.2g}",
                  resolution_m, max_voxels, 1.1 * resolution_m / share));
}

}  // namespace

OccupancyMap::OccupancyMap(double resolution_m) : impl_(std::make_unique<Impl>(resolution_m)) {}
OccupancyMap::~OccupancyMap() = default;
OccupancyMap::OccupancyMap(OccupancyMap&&) noexcept = default;
OccupancyMap& OccupancyMap::operator=(OccupancyMap&&) noexcept = default;

int64_t OccupancyMap::Insert(const std::vector<RayBundle>& bundles, double max_range_m,
                             const Progress& progress, std::size_t max_voxels) {
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
    if (impl_->tree.size() > max_voxels)
      FailForSize(resolution_m(), max_voxels, i + 1, bundles.size());
  }
  Finish();
  return left_out;
}

int64_t OccupancyMap::Update(const CellObservation& observation) {
  int64_t left_out = 0;
  const auto update = [&](const std::vector<OctreeCell>& cells, bool occupied) {
    for (const OctreeCell& cell : cells) {
      if (IsInOctree(cell)) {
        impl_->tree.updateNode(MakeKey(cell), occupied, kLazy);
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
      if (IsInOctree(cell)) impl_->tree.setNodeValue(MakeKey(cell), log_odds, kLazy);
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

}  // namespace slcmap::mapping
