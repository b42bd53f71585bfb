#include "data/io/ply.h"
#include "export/scene/formats.h"
#include "export/scene/georeference_note.h"
#include "mapping/map/landmarks.h"
#include "mapping/map/part_files.h"

namespace slcmap::inline exporting {
namespace {

PlyForm Form(bool ascii) { return ascii ? PlyForm::kAscii : PlyForm::kBinary; }

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

std::vector<std::string> WriteScenePly(bool ascii, const std::shared_ptr<SceneOfMap>& scene_of_map,
                                       const std::string& folder, const MapResult& map,
                                       const Progress& progress) {
  const MapScene& scene = scene_of_map->Get(map, progress.Part(0, 0.5));
  const Progress writing = progress.Part(0.5, 1);
  std::vector<std::string> comments = {"slcmap, metres in the world frame, z up"};
  if (!map.id.empty()) comments.push_back("map " + map.id + " of run " + map.source.run_id);
  const std::string offset = GeoreferenceNote(map.source.georeference);
  if (!offset.empty()) comments.push_back(offset);
  std::vector<std::string> paths;
  // One of six layers.
  const auto write = [&](const char* name, const Vertices& vertices, PlyFile file) {
    const auto done = static_cast<double>(paths.size());
    file.comments = comments;
    file.elements.insert(file.elements.begin(),
                         VertexElement(vertices, writing.Part(done / 6, (done + 0.5) / 6)));
    paths.push_back(folder + "/" + name + ".ply");
    WritePly(paths.back(), file, Form(ascii));
  };
  write("points", scene.points, {});
  for (const auto& [name, layer] :
       {std::pair("lines", &scene.lines), std::pair("trajectory", &scene.trajectory),
        std::pair("keyframes", &scene.keyframes)}) {
    write(name, layer->vertices, {{}, {EdgeElement(layer->edges)}, {}});
  }
  for (const auto& [name, layer] :
       {std::pair("voxels", &scene.voxels), std::pair("line_bars", &scene.line_bars)}) {
    PlyFile file;
    for (const auto& triangle : layer->triangles) {
      file.faces.emplace_back(triangle.begin(), triangle.end());
    }
    write(name, layer->vertices, std::move(file));
  }
  return paths;
}

std::vector<std::string> WriteClouds(bool ascii, const std::string& folder, const MapResult& map,
                                     const Progress& progress) {
  const std::vector<std::string> paths = {folder + "/points.pcd", folder + "/dense.pcd",
                                          folder + "/dense.ply", folder + "/occupancy.bt"};
  WritePcd(paths[0], map.points);
  progress.ReportOrStop(0.2);
  WriteDensePcd(paths[1], map);
  progress.ReportOrStop(0.5);
  WriteDensePly(paths[2], map, Form(ascii), GeoreferenceNote(map.source.georeference));
  progress.ReportOrStop(0.8);
  map.occupancy.Write(paths[3]);
  return paths;
}

}  // namespace slcmap::exporting
