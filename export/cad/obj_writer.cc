#include <spdlog/fmt/fmt.h>

#include <iterator>

#include "data/io/file.h"
#include "export/scene/formats.h"
#include "export/scene/georeference_note.h"
#include "export/scene/map_layers.h"

namespace slcmap::inline exporting {
namespace {

using Eigen::Vector3d;

// Colours of materials, by the beginning of their name: kinds of planes as in the GLB, axes of
// lines as in lines.ply.
struct Material {
  const char* name;
  std::array<uint8_t, 3> colour;
};

const std::vector<Material>& Materials() {
  static const std::vector<Material> materials = {
      {"wall", {222, 219, 211}},
      {"floor", {176, 160, 140}},
      {"ceiling", {235, 235, 232}},
      {"other_plane", {200, 198, 192}},
      {"outline", {110, 110, 110}},
      {"lines_x", LineColour(LineAxis::kX, true)},
      {"lines_y", LineColour(LineAxis::kY, true)},
      {"lines_vertical", LineColour(LineAxis::kVertical, true)},
      {"lines_other", LineColour(LineAxis::kNone, true)},
      {"lines_sloped", LineColour(LineAxis::kSloped, true)},
      {"trajectory", {0, 170, 190}}};
  return materials;
}

constexpr std::array<const char*, 4> kPlaneMaterials = {"wall", "floor", "ceiling", "other_plane"};
constexpr std::array<const char*, 5> kLineMaterials = {"lines_x", "lines_y", "lines_vertical",
                                                       "lines_other", "lines_sloped"};

std::string MaterialsText() {
  std::string text = "# slcmap, colours of map.obj\n";
  for (const auto& [name, colour] : Materials()) {
    text += fmt::format("newmtl {}\nKd {:.4f} {:.4f} {:.4f}\nKa 0 0 0\nKs 0 0 0\nillum 1\n", name,
                        colour[0] / 255.0, colour[1] / 255.0, colour[2] / 255.0);
  }
  return text;
}

// Counts vertices, which OBJ numbers from 1 through the whole file.
class ObjText {
 public:
  // `note` is written where there is one.
  ObjText(bool y_up, const std::string& note) : y_up_(y_up) {
    Append("# slcmap, metres, {} up, along the building (turn: export.json)\n", y_up ? "y" : "z");
    Append("# {}\n", y_up ? "--obj-up z writes it with z up, as the other formats of the export"
                          : "--obj-up y writes it with y up");
    if (!note.empty()) Append("# {}\n", note);
    text_ += "mtllib map.mtl\n";
  }

  void BeginObject(const std::string& name, const char* material) {
    Append("o {}\nusemtl {}\n", name, material);
  }

  void AddFace(const std::array<Vector3d, 3>& corners) {
    const std::size_t first = AddVertices(corners);
    Append("f {} {} {}\n", first, first + 1, first + 2);
  }

  // An element for each two points that follow each other: many programs draw none of longer ones.
  template <typename Points>
  void AddLine(const Points& points, bool is_closed = false) {
    const std::size_t first = AddVertices(points);
    for (std::size_t i = 0; i + 1 < points.size(); ++i)
      Append("l {} {}\n", first + i, first + i + 1);
    if (is_closed) Append("l {} {}\n", first + points.size() - 1, first);
  }

  const std::string& text() const { return text_; }

 private:
  template <typename... Values>
  void Append(fmt::format_string<Values...> format, Values&&... values) {
    fmt::format_to(std::back_inserter(text_), format, std::forward<Values>(values)...);
  }

  // The number of the first.
  template <typename Points>
  std::size_t AddVertices(const Points& points) {
    for (const Vector3d& p : points) {
      Append("v {:.6f} {:.6f} {:.6f}\n", p.x(), y_up_ ? p.z() : p.y(), y_up_ ? -p.y() : p.z());
    }
    vertices_ += points.size();
    return vertices_ - points.size() + 1;
  }

  const bool y_up_;
  std::string text_;
  std::size_t vertices_ = 0;
};

void AddLines(const MapResult& map, ObjText* obj) {
  for (const LinesOfLayer& layer : LineLayers(map)) {
    obj->BeginObject(layer.name, kLineMaterials[static_cast<size_t>(layer.axis)]);
    for (const auto& line : layer.lines) obj->AddLine(line);
  }
}

void AddPlanes(const Building& building, ObjText* obj) {
  for (const PlanesOfLayer& layer : PlaneLayers(building)) {
    obj->BeginObject(layer.name, kPlaneMaterials[static_cast<size_t>(layer.kind)]);
    for (const auto& triangle : layer.triangles) obj->AddFace(triangle);
    obj->BeginObject(layer.name + "_OUTLINE", "outline");
    for (const auto& outline : layer.outlines) obj->AddLine(outline, true);
  }
}

void AddTrajectory(const MapResult& map, ObjText* obj) {
  const auto pieces = TrajectoryPieces(map.trajectory);
  if (!pieces.empty()) obj->BeginObject("TRAJECTORY", "trajectory");
  for (const auto& piece : pieces) obj->AddLine(piece);
}

}  // namespace

std::vector<std::string> WriteObj(const std::string& up, const std::string& folder,
                                  const MapResult& map, const Progress& progress) {
  ObjText obj(up == "y", GeoreferenceNote(map.source.georeference));
  AddLines(map, &obj);
  AddPlanes(map.building, &obj);
  AddTrajectory(map, &obj);
  progress.ReportOrStop(0.5);
  const std::string path = folder + "/map.obj";
  const std::string materials = folder + "/map.mtl";
  WriteFile(path, obj.text());
  WriteFile(materials, MaterialsText());
  return {path, materials};
}

}  // namespace slcmap::exporting
