#include "export/obj_writer.h"

#include <spdlog/fmt/fmt.h>

#include <iterator>

#include "data/file.h"
#include "export/map_layers.h"
#include "export/world_offset.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;

// Counts vertices, which OBJ numbers from 1 through the whole file.
class ObjText {
 public:
  explicit ObjText(const std::string& comment) : text_("# " + comment + "\n") {}

  void BeginObject(const std::string& name) { Append("o {}\n", name); }

  // An element, `l` or `f`, with vertices of its own; a closed one ends where it began.
  template <typename Points>
  void Add(char element, const Points& points, bool is_closed = false) {
    for (const Vector3d& p : points) Append("v {:.6f} {:.6f} {:.6f}\n", p.x(), p.y(), p.z());
    Append("{}", element);
    for (std::size_t i = 1; i <= points.size(); ++i) Append(" {}", vertices_ + i);
    if (is_closed) Append(" {}", vertices_ + 1);
    text_ += '\n';
    vertices_ += points.size();
  }

  const std::string& text() const { return text_; }

 private:
  template <typename... Values>
  void Append(fmt::format_string<Values...> format, Values&&... values) {
    fmt::format_to(std::back_inserter(text_), format, std::forward<Values>(values)...);
  }

  std::string text_;
  std::size_t vertices_ = 0;
};

void AddLines(const MapResult& map, ObjText* obj) {
  for (const LinesOfLayer& layer : LineLayers(map)) {
    obj->BeginObject(layer.name);
    for (const auto& line : layer.lines) obj->Add('l', line);
  }
}

void AddPlanes(const Building& building, ObjText* obj) {
  for (const PlanesOfLayer& layer : PlaneLayers(building)) {
    obj->BeginObject(layer.name);
    for (const auto& triangle : layer.triangles) obj->Add('f', triangle);
    obj->BeginObject(layer.name + "_OUTLINE");
    for (const auto& outline : layer.outlines) obj->Add('l', outline, true);
  }
}

void AddTrajectory(const MapResult& map, double max_jump_s, ObjText* obj) {
  const auto pieces = TrajectoryPieces(map.trajectory, max_jump_s);
  if (!pieces.empty()) obj->BeginObject("TRAJECTORY");
  for (const auto& piece : pieces) obj->Add('l', piece);
}

}  // namespace

std::vector<std::string> ObjWriter::Write(const std::string& folder, const MapResult& map,
                                          const Progress& progress) const {
  progress.ReportOrStop(0);
  const std::string offset = WorldOffsetNote(map.source.world_offset_m);
  ObjText obj("slcmap, metres in the world frame, z up" + (offset.empty() ? "" : "\n# " + offset));
  AddLines(map, &obj);
  AddPlanes(map.building, &obj);
  AddTrajectory(map, max_jump_s_, &obj);
  progress.ReportOrStop(0.5);
  const std::string path = folder + "/map.obj";
  WriteFile(path, obj.text());
  progress.ReportOrStop(1);
  return {path};
}

}  // namespace slcmap
