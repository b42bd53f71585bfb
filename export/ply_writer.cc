#include "export/ply_writer.h"

#include "data/ply.h"

namespace slcmap {
namespace {

PlyElement VertexElement(const Vertices& vertices) {
  PlyElement element{"vertex", {}};
  for (const char* name : {"x", "y", "z"}) element.Add(name, PlyType::kFloat);
  for (const char* name : {"red", "green", "blue"}) element.Add(name, PlyType::kUint8);
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const Eigen::Vector3d& p = vertices.positions[i];
    const Colour& c = vertices.colours[i];
    element.AppendRow({p.x(), p.y(), p.z(), static_cast<double>(c.red),
                       static_cast<double>(c.green), static_cast<double>(c.blue)});
  }
  return element;
}

PlyElement EdgeElement(const std::vector<std::array<uint32_t, 2>>& edges) {
  PlyElement element{"edge", {}};
  for (const char* name : {"vertex1", "vertex2"}) element.Add(name, PlyType::kInt32);
  for (const auto& [start, end] : edges) {
    element.AppendRow({static_cast<double>(start), static_cast<double>(end)});
  }
  return element;
}

}  // namespace

std::vector<std::string> PlySceneWriter::Write(const std::string& folder,
                                               const MapScene& scene) const {
  std::vector<std::string> paths;
  const auto write = [&](const std::string& name, const PlyFile& file) {
    paths.push_back(folder + "/" + name + ".ply");
    WritePly(paths.back(), file);
  };
  const std::vector<std::string> comments = {"slcmap, metres in the world frame, z up"};
  for (const PointLayer& layer : scene.points) {
    write(layer.name, {comments, {VertexElement(layer.vertices)}, {}});
  }
  for (const LineLayer& layer : scene.lines) {
    write(layer.name, {comments, {VertexElement(layer.vertices), EdgeElement(layer.edges)}, {}});
  }
  for (const MeshLayer& layer : scene.meshes) {
    PlyFile file{comments, {VertexElement(layer.vertices)}, {}};
    for (const auto& triangle : layer.triangles) {
      file.faces.emplace_back(triangle.begin(), triangle.end());
    }
    write(layer.name, file);
  }
  return paths;
}

}  // namespace slcmap
