#include "export/dxf/dxf_writer.h"

#include <spdlog/fmt/fmt.h>

#include "data/file.h"
#include "export/dxf/dxf_file.h"
#include "export/map_layers.h"
#include "export/plan/storey_plan.h"
#include "export/section/section_drawing.h"
#include "export/world_offset.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;

constexpr int kBlack = 7, kGrey = 8, kLightGrey = 9, kGreen = 3, kBlue = 5, kCyan = 4;

// What is drawn with a pen is on a layer of its own.
struct PenLayer {
  const char* name;
  int colour;
  DxfLinetype linetype;
};
constexpr std::array<PenLayer, kPenStyles.size()> kPenLayers = {
    {{"WALL", kBlack, DxfLinetype::kContinuous},
     {"WALL_ASSUMED", kGrey, DxfLinetype::kDashed},
     {"OPENING", kBlue, DxfLinetype::kContinuous},
     {"OVERHEAD", kGrey, DxfLinetype::kDashed},
     {"ROOM", kLightGrey, DxfLinetype::kDotted},
     {"DIMENSION", kGreen, DxfLinetype::kContinuous},
     {"FRAME", kBlack, DxfLinetype::kContinuous},
     {"BEYOND", kGrey, DxfLinetype::kContinuous},
     {"LINE", kCyan, DxfLinetype::kContinuous},
     {"SECTION", 1, DxfLinetype::kDashed}}};
constexpr char kTextLayer[] = "TEXT", kRoomTextLayer[] = "ROOM_TEXT";

// Of LineAxis.
constexpr std::array<int, 5> kAxisColours = {1, kGreen, kBlue, 30, 6};

void AddPaths(const std::string& prefix, const Drawing& drawing, DxfFile* file) {
  for (const DrawnPath& path : drawing.paths) {
    const std::string layer = prefix + kPenLayers[static_cast<size_t>(path.pen)].name;
    std::vector<Vector3d> points;
    for (const Eigen::Vector2d& p : path.points) points.emplace_back(p.x(), p.y(), 0);
    if (points.size() == 2)
      file->AddLine(layer, points[0], points[1]);
    else
      file->AddPolyline(layer, points, false);
  }
}

void AddPlanLayers(const std::string& prefix, bool is_on, DxfFile* file) {
  for (const PenLayer& layer : kPenLayers) {
    file->AddLayer({prefix + layer.name, layer.colour, layer.linetype, is_on});
  }
  for (const char* name : {kTextLayer, kRoomTextLayer}) {
    file->AddLayer({prefix + name, kBlack, DxfLinetype::kContinuous, is_on});
  }
}

void AddStorey(const StoreyPlan& plan, bool is_on, DxfFile* file) {
  const std::string prefix = StoreyPrefix(plan.storey.id) + "_";
  AddPlanLayers(prefix, is_on, file);
  for (const Drawing* drawing : {&plan.rooms, &plan.walls, &plan.openings, &plan.sections}) {
    AddPaths(prefix, *drawing, file);
  }
  for (const DrawnText& text : plan.room_texts) file->AddText(prefix + kRoomTextLayer, text);
  for (const DrawnText& text : plan.wall_texts) file->AddText(prefix + kTextLayer, text);
  for (const DrawnText& text : plan.sections.texts) file->AddText(prefix + kTextLayer, text);
  for (const Dimension& dimension : plan.dimensions) {
    file->AddDimension(prefix + "DIMENSION", dimension);
  }
}

std::string PlanDxf(const PlanSet& plans, const MapResult& map) {
  DxfFile file(plans.format.scale);
  file.SetComment(WorldOffsetNote(map.source.world_offset_m));
  for (const StoreyPlan& plan : plans.storeys) {
    AddStorey(plan, &plan == &plans.storeys.front(), &file);
  }
  return file.Text();
}

void AddLines(const MapResult& map, DxfFile* file) {
  const RigidTransform& T_map_world = map.building.T_map_world;
  for (const LinesOfLayer& layer : LineLayers(map)) {
    file->AddLayer({layer.name, kAxisColours[static_cast<size_t>(layer.axis)]});
    for (const auto& [start, end] : layer.lines) {
      file->AddLine(layer.name, T_map_world * start, T_map_world * end);
    }
  }
}

void AddPlanes(const Building& building, DxfFile* file) {
  const auto in_map = [&](std::vector<Vector3d> points) {
    for (Vector3d& point : points) point = building.T_map_world * point;
    return points;
  };
  for (const PlanesOfLayer& layer : PlaneLayers(building)) {
    const std::string outlines = layer.name + "_OUTLINE";
    file->AddLayer({layer.name, kLightGrey});
    file->AddLayer({outlines, kGrey});
    for (const auto& triangle : layer.triangles) {
      const std::vector<Vector3d> corners = in_map({triangle.begin(), triangle.end()});
      file->AddTriangle(layer.name, {corners[0], corners[1], corners[2]});
    }
    for (const auto& outline : layer.outlines) file->AddPolyline(outlines, in_map(outline), true);
  }
}

std::string SectionDxf(const SectionDrawing& section, const MapResult& map) {
  DxfFile file(section.format.scale);
  file.SetComment(WorldOffsetNote(map.source.world_offset_m));
  AddPlanLayers("", true, &file);
  AddPaths("", section.shape, &file);
  AddPaths("", {{}, section.marks, {}}, &file);
  for (const DrawnText& text : section.texts) file.AddText(kTextLayer, text);
  for (const Dimension& dimension : section.dimensions) file.AddDimension("DIMENSION", dimension);
  return file.Text();
}

std::string StoreyDxf(const StoreyPlan& plan, int scale, const MapResult& map) {
  DxfFile file(scale);
  file.SetComment(WorldOffsetNote(map.source.world_offset_m));
  AddStorey(plan, true, &file);
  return file.Text();
}

std::string MapDxf(const MapResult& map, double max_jump_s) {
  constexpr char kPoints[] = "POINTS", kTrajectory[] = "TRAJECTORY";
  const RigidTransform& T_map_world = map.building.T_map_world;
  DxfFile file(100);
  file.SetComment(WorldOffsetNote(map.source.world_offset_m));
  AddLines(map, &file);
  AddPlanes(map.building, &file);
  file.AddLayer({kPoints, kLightGrey});
  for (const MapPoint& point : map.points) file.AddPoint(kPoints, T_map_world * point.p_world);
  file.AddLayer({kTrajectory, kCyan});
  for (std::vector<Vector3d> piece : TrajectoryPieces(map.trajectory, max_jump_s)) {
    for (Vector3d& point : piece) point = T_map_world * point;
    file.AddPolyline(kTrajectory, piece, false);
  }
  return file.Text();
}

}  // namespace

std::vector<std::string> DxfWriter::Write(const std::string& folder, const MapResult& map,
                                          const Progress& progress) const {
  progress.ReportOrStop(0);
  std::vector<std::string> paths = {folder + "/plan.dxf", folder + "/map.dxf"};
  const PlanSet plans = MakePlans(map.building, options_);
  WriteFile(paths[0], PlanDxf(plans, map));
  const std::vector<SectionDrawing> sections = MakeSections(map, options_);
  if (plans.storeys.size() > 1 || !sections.empty()) MakeFolder(folder + "/plan");
  for (const StoreyPlan& plan : plans.storeys) {
    if (plans.storeys.size() < 2) break;
    paths.push_back(fmt::format("{}/plan/storey_{}.dxf", folder, plan.storey.id));
    WriteFile(paths.back(), StoreyDxf(plan, plans.format.scale, map));
  }
  for (const SectionDrawing& section : sections) {
    paths.push_back(fmt::format("{}/plan/{}.dxf", folder, section.view.name));
    WriteFile(paths.back(), SectionDxf(section, map));
  }
  progress.ReportOrStop(0.5);
  WriteFile(paths[1], MapDxf(map, max_jump_s_));
  progress.ReportOrStop(1);
  return paths;
}

}  // namespace slcmap
