// Where the vertices of a node of a glTF file are, as a reader places them.
#pragma once

#include <tiny_gltf.h>

#include <Eigen/Core>
#include <cstdint>
#include <cstring>
#include <vector>

namespace slcmap::testing {

// Of its mesh's first primitive, in the frame of the node's parent; floats, or quantised by 16
// bits.
inline std::vector<Eigen::Vector3d> ReadPositions(const tinygltf::Model& model,
                                                  const tinygltf::Node& node) {
  const auto& mesh = model.meshes[static_cast<std::size_t>(node.mesh)];
  const auto index = static_cast<std::size_t>(mesh.primitives[0].attributes.at("POSITION"));
  const tinygltf::Accessor& accessor = model.accessors[index];
  const auto& view = model.bufferViews[static_cast<std::size_t>(accessor.bufferView)];
  const bool is_float = accessor.componentType == TINYGLTF_COMPONENT_TYPE_FLOAT;
  std::vector<Eigen::Vector3d> positions;
  for (std::size_t i = 0; i < accessor.count; ++i) {
    const unsigned char* bytes = model.buffers[0].data.data() + view.byteOffset +
                                 i * static_cast<std::size_t>(accessor.ByteStride(view));
    float numbers[3];
    uint16_t steps[3];
    std::memcpy(numbers, bytes, sizeof numbers);
    std::memcpy(steps, bytes, sizeof steps);
    Eigen::Vector3d& p = positions.emplace_back();
    for (int k = 0; k < 3; ++k) {
      const auto d = static_cast<std::size_t>(k);
      p[k] = is_float ? numbers[k] : node.translation[d] + node.scale[d] * steps[k];
    }
  }
  return positions;
}

}  // namespace slcmap::testing
