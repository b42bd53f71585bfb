#include "export/web/cloud_tiles.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numeric>
#include <set>
#include <span>

#include "data/core/error.h"
#include "data/io/file.h"

namespace slcmap::inline exporting {
namespace {

constexpr int kCodeBits = 21;              // of a coordinate, so that three are 63
constexpr int kGridBits = 7;               // cells across a tile
constexpr std::size_t kMostWhole = 30000;  // points of a tile that has no children
constexpr double kErrorOfSpacing = 4;      // as the header says
constexpr int kSubtreeLevels = 4;          // 585 tiles, of 4096 subtrees below
constexpr double kSmallestCube_m = 1e-3;   // of clouds of one point

// The lowest 21 bits of a number with two zeros behind each.
uint64_t SpreadBits(uint64_t value) {
  value = (value | value << 32) & 0x001f00000000ffff;
  value = (value | value << 16) & 0x001f0000ff0000ff;
  value = (value | value << 8) & 0x100f00f00f00f00f;
  value = (value | value << 4) & 0x10c30c30c30c30c3;
  return (value | value << 2) & 0x1249249249249249;
}

// The cube that an octree divides.
struct TiledCube {
  Eigen::Vector3d corner_m = Eigen::Vector3d::Zero();
  double side_m = kSmallestCube_m;

  Eigen::AlignedBox3d box() const {
    return {corner_m, corner_m + Eigen::Vector3d::Constant(side_m)};
  }
  uint64_t CodeAt(const Eigen::Vector3d& p_m) const {
    constexpr double kCells = 1 << kCodeBits;
    std::array<uint64_t, 3> steps{};
    for (int axis = 0; axis < 3; ++axis) {
      const double cell = std::floor((p_m[axis] - corner_m[axis]) / side_m * kCells);
      steps[static_cast<std::size_t>(axis)] =
          static_cast<uint64_t>(std::clamp(cell, 0.0, kCells - 1));
    }
    return MortonCode(steps[0], steps[1], steps[2]);
  }
};

TiledCube CubeAround(const PointsToTile& points) {
  Eigen::AlignedBox3d box;
  for (std::size_t i = 0; i < points.count; ++i) {
    const Eigen::Vector3d p_m = points.position(i);
    if (!p_m.allFinite()) {
      throw DataError(
          fmt::format("{}: found a point {} that is not finite, expected metres", points.name, i));
    }
    box.extend(p_m);
  }
  TiledCube cube;
  cube.side_m = std::max(box.sizes().maxCoeff(), kSmallestCube_m);
  // In the middle, so that flat clouds lie within and not on a border.
  cube.corner_m = box.center() - Eigen::Vector3d::Constant(0.5 * cube.side_m);
  return cube;
}

struct CodedPoint {
  uint64_t code, index;
  auto operator<=>(const CodedPoint&) const = default;
};

struct TilePlace {
  int level = 0;
  uint32_t x = 0, y = 0, z = 0;
  auto operator<=>(const TilePlace&) const = default;

  TilePlace Child(uint32_t octant) const {
    return {level + 1, 2 * x + (octant & 1), 2 * y + (octant >> 1 & 1), 2 * z + (octant >> 2)};
  }
  TilePlace Ancestor(int levels) const {
    return {level - levels, x >> levels, y >> levels, z >> levels};
  }
  // Among those of its level below an ancestor, in Morton order.
  uint64_t IndexBelow(int levels) const {
    const uint32_t mask = (1u << levels) - 1;
    return MortonCode(x & mask, y & mask, z & mask);
  }
  std::string Name() const { return fmt::format("{}_{}_{}_{}", level, x, y, z); }
};

// Takes the middle one of each cell's points, in their order, and leaves the others at the
// beginning of the span, which it shortens. All, where they are few or the cells as small as codes
// tell.
std::vector<CodedPoint> TakePoints(int level, std::span<CodedPoint>* points) {
  const int shift = 3 * (kCodeBits - level - kGridBits);
  std::vector<CodedPoint> taken;
  if (points->size() <= kMostWhole || shift <= 0) {
    taken.assign(points->begin(), points->end());
    *points = {};
    return taken;
  }
  std::size_t left = 0;
  for (std::size_t from = 0; from < points->size();) {
    std::size_t to = from;
    while (to < points->size() && (*points)[to].code >> shift == (*points)[from].code >> shift) {
      ++to;
    }
    const std::size_t middle = from + (to - from) / 2;
    taken.push_back((*points)[middle]);
    for (std::size_t i = from; i < to; ++i) {
      if (i != middle) (*points)[left++] = (*points)[i];
    }
    from = to;
  }
  *points = points->first(left);
  return taken;
}

// A stride that visits all of so many places, each beginning spread over them.
std::size_t SpreadStride(std::size_t count) {
  constexpr double kGoldenSection = 0.6180339887;
  auto stride = static_cast<std::size_t>(std::lround(kGoldenSection * static_cast<double>(count)));
  stride = std::max<std::size_t>(stride, 1);
  while (std::gcd(stride, count) != 1) ++stride;
  return stride;
}

class CloudTiler {
 public:
  CloudTiler(const std::string& folder, const PointsToTile& points, std::vector<std::string>* paths,
             const Progress& progress)
      : folder_(folder + "/" + points.name), points_(points), paths_(paths), progress_(progress) {}

  TileOfSet Write() {
    MakeFolder(folder_);
    cube_ = CubeAround(points_);
    progress_.ReportOrStop(0.1);
    std::vector<CodedPoint> coded(points_.count);
    for (std::size_t i = 0; i < coded.size(); ++i) {
      coded[i] = {cube_.CodeAt(points_.position(i)), i};
    }
    std::sort(coded.begin(), coded.end());
    progress_.ReportOrStop(0.3);
    WriteTile({}, coded);
    WriteSubtrees();
    return {Root(), cube_.box()};
  }

 private:
  void WriteTile(const TilePlace& place, std::span<CodedPoint> points) {
    progress_.ReportOrStop(0.3 +
                           0.7 * static_cast<double>(done_) / static_cast<double>(points_.count));
    const std::vector<CodedPoint> taken = TakePoints(place.level, &points);
    done_ += taken.size();
    WriteContent(place, taken);
    tiles_.insert(place);
    const int shift = 3 * (kCodeBits - place.level - 1);
    for (uint32_t octant = 0; octant < 8 && !points.empty(); ++octant) {
      const auto end = std::find_if(points.begin(), points.end(), [&](const CodedPoint& point) {
        return (point.code >> shift & 7) != octant;
      });
      const auto count = static_cast<std::size_t>(end - points.begin());
      if (count > 0) WriteTile(place.Child(octant), points.first(count));
      points = points.subspan(count);
    }
  }

  void WriteContent(const TilePlace& place, const std::vector<CodedPoint>& taken) {
    Vertices vertices;
    const std::size_t stride = SpreadStride(taken.size());
    for (std::size_t k = 0, i = 0; k < taken.size(); ++k, i = (i + stride) % taken.size()) {
      vertices.Add(points_.position(taken[i].index), points_.colour(taken[i].index));
    }
    AddFile(place.Name() + ".glb", MakePointsModel(points_.name, vertices).bytes);
  }

  // Those that hold a tile: the top one, and one every so many levels below.
  void WriteSubtrees() {
    std::map<TilePlace, std::vector<TilePlace>> subtrees;
    for (const TilePlace& tile : tiles_) {
      subtrees[tile.Ancestor(tile.level % kSubtreeLevels)].push_back(tile);
    }
    for (const auto& [root, tiles] : subtrees) {
      AddFile(root.Name() + ".subtree", SubtreeBytes(root, tiles));
    }
  }

  // One availability of tiles, which all have content, and one of the subtrees below.
  std::string SubtreeBytes(const TilePlace& root, const std::vector<TilePlace>& tiles) const {
    constexpr uint64_t kTiles = ((1ull << 3 * kSubtreeLevels) - 1) / 7;
    constexpr uint64_t kBelow = 1ull << 3 * kSubtreeLevels;
    std::string here((kTiles + 63) / 64 * 8, '\0'), below(kBelow / 8, '\0');
    std::size_t count_below = 0;
    for (const TilePlace& tile : tiles) {
      const int levels = tile.level - root.level;
      SetBit(((1ull << 3 * levels) - 1) / 7 + tile.IndexBelow(levels), &here);
      if (levels + 1 < kSubtreeLevels) continue;
      for (uint32_t octant = 0; octant < 8; ++octant) {
        const TilePlace child = tile.Child(octant);
        if (!tiles_.contains(child)) continue;
        SetBit(child.IndexBelow(kSubtreeLevels), &below);
        ++count_below;
      }
    }
    const auto view = [](std::size_t offset, std::size_t length) {
      return Json{{"buffer", 0}, {"byteOffset", offset}, {"byteLength", length}};
    };
    const Json available = {{"bitstream", 0}, {"availableCount", tiles.size()}};
    const Json json = {
        {"buffers", Json::array({Json{{"byteLength", here.size() + below.size()}}})},
        {"bufferViews", Json::array({view(0, (kTiles + 7) / 8), view(here.size(), below.size())})},
        {"tileAvailability", available},
        {"contentAvailability", Json::array({available})},
        {"childSubtreeAvailability", {{"bitstream", 1}, {"availableCount", count_below}}}};
    return WithHeader(json.dump(), here + below);
  }

  static void SetBit(uint64_t bit, std::string* bytes) {
    char& byte = (*bytes)[bit / 8];
    byte = static_cast<char>(byte | 1 << bit % 8);
  }

  // As 3D Tiles 1.1 has it: both parts begin at multiples of 8 bytes.
  static std::string WithHeader(std::string json, const std::string& binary) {
    json.append((8 - json.size() % 8) % 8, ' ');
    std::string bytes = "subt";
    AppendBytes(uint32_t{1}, &bytes);
    AppendBytes(uint64_t{json.size()}, &bytes);
    AppendBytes(uint64_t{binary.size()}, &bytes);
    return bytes + json + binary;
  }

  void AddFile(const std::string& name, const std::string& bytes) {
    paths_->push_back(folder_ + "/" + name);
    WriteFile(paths_->back(), bytes);
  }

  Json Root() const {
    const std::string names = points_.name + "/{level}_{x}_{y}_{z}";
    const int levels = tiles_.rbegin()->level + 1;
    return {{"boundingVolume", BoundingVolume(cube_.box())},
            {"geometricError", kErrorOfSpacing * cube_.side_m / (1 << kGridBits)},
            {"refine", "ADD"},
            {"content", {{"uri", names + ".glb"}}},
            {"implicitTiling",
             {{"subdivisionScheme", "OCTREE"},
              {"availableLevels", levels},
              {"subtreeLevels", kSubtreeLevels},
              {"subtrees", {{"uri", names + ".subtree"}}}}},
            {"extras", {{"layer", points_.name}, {"points", points_.count}}}};
  }

  const std::string folder_;
  const PointsToTile& points_;
  std::vector<std::string>* paths_;
  const Progress& progress_;
  TiledCube cube_;
  std::set<TilePlace> tiles_;
  std::size_t done_ = 0;
};

}  // namespace

uint64_t MortonCode(uint64_t x, uint64_t y, uint64_t z) {
  return SpreadBits(x) | SpreadBits(y) << 1 | SpreadBits(z) << 2;
}

TileOfSet WriteCloudTiles(const std::string& folder, const PointsToTile& points,
                          std::vector<std::string>* paths, const Progress& progress) {
  return CloudTiler(folder, points, paths, progress).Write();
}

Json BoundingVolume(const Eigen::AlignedBox3d& box) {
  const Eigen::Vector3d centre = box.center(), half = 0.5 * box.sizes();
  return {{"box",
           {centre.x(), centre.y(), centre.z(), half.x(), 0, 0, 0, half.y(), 0, 0, 0, half.z()}}};
}

}  // namespace slcmap::exporting
