// The bytes of OctoMap's .bt files, checked before OctoMap's own reader gets them: that one trusts
// them, and calls itself for each node, however deep.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace slcmap {

// Edge lengths of voxels that maps and their files may have.
inline constexpr double kMinVoxel_m = 1e-3;
inline constexpr double kMaxVoxel_m = 100;

// The depth of the leaves that are not pruned; that of the root is 0. OctoMap knows no other.
inline constexpr int kOctreeDepth = 16;

struct OctreeHeader {
  std::size_t nodes = 0;
  double resolution_m = 0;
  std::size_t data_offset = 0;  // of the first node's byte in the file
};

// The header as OctoMap 1.9 writes it for a tree of log-odds ("OcTree"): its first row, rows of
// comments, `id`, `size` and `res` once each, and `data`.
std::string OctreeHeaderText(std::size_t nodes, double resolution_m);

// Throws DataError naming path and row, what was found and what was expected.
OctreeHeader ParseOctreeHeader(const std::string& path, std::string_view bytes);

// Follows the nodes behind the header: an inner node has two bytes, two bits a child, lowest first
// (00 none, 01 a free leaf, 10 an occupied leaf, 11 an inner node), and is followed by its inner
// children in their order. Throws DataError naming path and byte unless they form one tree of at
// most kOctreeDepth, without inner nodes that have no child, of as many nodes and bytes as there
// should be. A header of no nodes is followed by nothing.
void CheckOctreeNodes(const std::string& path, std::string_view bytes, const OctreeHeader& header);

}  // namespace slcmap
