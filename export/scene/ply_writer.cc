#include "data/io/ply.h"
#include "export/scene/map_writer.h"
#include "export/scene/scene.h"
#include "mapping/map/landmarks.h"
#include "mapping/map/part_files.h"

namespace slcmap::inline exporting {
namespace {

PlyForm Form(const PlyOptions& options) {
  return options.ascii ? PlyForm::kAscii : PlyForm::kBinary;
}

PlyElement VertexElement(const Vertices& vertices, const Progress& progress) {
  constexpr std::size_t kReportEvery = 65536;
  PlyElement element{"vertex", {}};
  for (const char* name : {"x", "y", "z"}) element.Add(name, PlyType::kFloat);
  for (const char* name : {"red", "green", "blue"}) element.Add(name, PlyType::kUint8);
  element.Reserve(vertices.size());
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    if (i % kReportEvery == 0) {
      progress.ReportOrStop(static_cast<double>(i) / static_cast<double>(vertices.size()));
    }
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

std::vector<std::string> PlySceneWriter::Names() const {
  return {"points.ply",    "lines.ply",  "trajectory.ply",
          "keyframes.ply", "voxels.ply", "line_bars.ply"};
}

std::vector<std::string> PlySceneWriter::WriteScene(const std::string& folder,
                                                    const MapScene& scene,
                                                    const Progress& progress) const {
  std::vector<std::string> paths;
  const std::size_t layers = scene.points.size() + scene.lines.size() + scene.meshes.size();
  const auto vertices_of = [&](const auto& layer) {
    const double done = static_cast<double>(paths.size());
    const double all = static_cast<double>(layers);
    return VertexElement(layer.vertices, progress.Part(done / all, (done + 0.5) / all));
  };
  const auto write = [&](const std::string& name, const PlyFile& file) {
    paths.push_back(folder + "/" + name + ".ply");
    WritePly(paths.back(), file, Form(options_));
  };
  std::vector<std::string> comments = {"slcmap, metres in the world frame, z up"};
  if (!scene.map_id.empty()) {
    comments.push_back("map " + scene.map_id + " of run " + scene.run_id);
  }
  const std::string offset = GeoreferenceNote(scene.georeference);
  if (!offset.empty()) comments.push_back(offset);
  for (const PointLayer& layer : scene.points) {
    write(layer.name, {comments, {vertices_of(layer)}, {}});
  }
  for (const LineLayer& layer : scene.lines) {
    write(layer.name, {comments, {vertices_of(layer), EdgeElement(layer.edges)}, {}});
  }
  for (const MeshLayer& layer : scene.meshes) {
    PlyFile file{comments, {vertices_of(layer)}, {}};
    for (const auto& triangle : layer.triangles) {
      file.faces.emplace_back(triangle.begin(), triangle.end());
    }
    write(layer.name, file);
  }
  return paths;
}

std::vector<std::string> CloudWriter::Names() const {
  return {"points.pcd", "dense.pcd", "dense.ply", "occupancy.bt"};
}

std::vector<std::string> CloudWriter::Write(const std::string& folder, const MapResult& map,
                                            const Progress& progress) const {
  WritePcd(folder + "/points.pcd", map.points);
  progress.ReportOrStop(0.2);
  WriteDensePcd(folder + "/dense.pcd", map);
  progress.ReportOrStop(0.5);
  WriteDensePly(folder + "/dense.ply", map, Form(options_),
                GeoreferenceNote(map.source.georeference));
  progress.ReportOrStop(0.8);
  map.occupancy.Write(folder + "/occupancy.bt");
  std::vector<std::string> paths;
  for (const std::string& name : Names()) paths.push_back(folder + "/" + name);
  return paths;
}

}  // namespace slcmap::exporting
