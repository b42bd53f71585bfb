#include "export/ifc/ifc_rooms.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "export/storey_at.h"
#include "export/surface_mesh.h"

namespace slcmap {
namespace {

constexpr double kLeastArea_m2 = 1e-4;
constexpr double kLeastHeight_m = 1e-4;
constexpr Colour kSpaceColour{150, 190, 220};
constexpr Colour kSlabColour{190, 188, 184};
constexpr double kSpaceTransparency = 0.8;

std::string ContentOf(const Polygon& polygon) {
  std::string content;
  const auto add = [&](const PlanPoints& points) {
    for (const Eigen::Vector2d& p : points) {
      content += fmt::format("{} {} ", StepReal(p.x()), StepReal(p.y()));
    }
    content += "; ";
  };
  add(polygon.outline);
  for (const PlanPoints& hole : polygon.holes) add(hole);
  return content;
}

bool HasArea(const Polygon& polygon) {
  return polygon.outline.size() >= 3 && Area(polygon) > kLeastArea_m2;
}

std::string SpaceShape(const Room& room, const IfcPart& part, IfcFile* file) {
  const IfcContexts& contexts = file->contexts();
  if (!room.height_m || !(*room.height_m > kLeastHeight_m)) {
    std::vector<std::string> lines = {file->Polyline(room.polygon.outline, true)};
    for (const PlanPoints& hole : room.polygon.holes) lines.push_back(file->Polyline(hole, true));
    return file->Shape({file->Representation(contexts.footprint, "FootPrint", "Curve2D", lines)});
  }
  const std::string prism = file->Prism(room.polygon, room.floor_m - part.floor_m, *room.height_m);
  file->SetSurface(prism, kSpaceColour, kSpaceTransparency);
  return file->SolidShape({prism});
}

void AddSpace(const Room& room, IfcPart* part, IfcFile* file) {
  const std::string content =
      fmt::format("{} {} {}", room.storey, StepReal(room.floor_m), ContentOf(room.polygon));
  const std::string name = StepText(fmt::format("Room {}", room.id + 1));
  const std::string placement = file->LocalPlacement(part->placement, {});
  const std::string space =
      file->AddRooted("IFCSPACE", content,
                      {name, kStepUnset, kStepUnset, placement, SpaceShape(room, *part, file), name,
                       ".ELEMENT.", ".INTERNAL.", StepReal(room.floor_m)});
  part->spaces.push_back(space);
  std::vector<std::string> quantities = {file->Area("NetFloorArea", room.area_m2)};
  if (room.height_m) quantities.push_back(file->Length("FinishCeilingHeight", *room.height_m));
  file->AddQuantities(space, content, "Qto_SpaceBaseQuantities", quantities);
  file->AddProperties(space, content, "Space", {{"coverage", IfcRatioValue(room.bounded)}});
}

bool IsLevel(const BuildingPlane& plane) {
  return (plane.kind == PlaneKind::kFloor || plane.kind == PlaneKind::kCeiling) &&
         plane.normal.z() != 0;
}

double HeightOf(const BuildingPlane& plane) { return plane.offset_m / plane.normal.z(); }

// As options say, or as much as leaves room for the slab of the floor above a ceiling, or of the
// ceiling beneath a floor, and for the rooms there.
double SlabThickness(const BuildingPlane& plane, const Polygon& polygon, const Building& building,
                     const IfcOptions& options) {
  const bool is_floor = plane.kind == PlaneKind::kFloor;
  double thickness_m = options.slab_m;
  const auto keep_within = [&](double free_m, const Polygon& other) {
    if (free_m < kLeastHeight_m || free_m >= thickness_m) return;
    if (IntersectionArea(polygon, other) > kLeastArea_m2) thickness_m = free_m;
  };
  for (const BuildingPlane& other : building.planes) {
    if (!IsLevel(other) || other.kind == plane.kind) continue;
    const double gap_m = (is_floor ? -1 : 1) * (HeightOf(other) - HeightOf(plane));
    keep_within(0.5 * gap_m, LevelOutline(other, building));
  }
  for (const Room& room : building.rooms) {
    if (is_floor && !room.height_m) continue;
    const double gap_m =
        is_floor ? HeightOf(plane) - room.floor_m - *room.height_m : room.floor_m - HeightOf(plane);
    keep_within(gap_m, room.polygon);
  }
  return thickness_m;
}

void AddSlab(const BuildingPlane& plane, const Polygon& polygon, double slab_m, IfcPart* part,
             IfcFile* file) {
  const bool is_floor = plane.kind == PlaneKind::kFloor;
  const double height_m = HeightOf(plane);
  const std::string content =
      fmt::format("{} {} {}", plane.storey, StepReal(height_m), ContentOf(polygon));
  const double low_m = height_m - part->floor_m - (is_floor ? slab_m : 0);
  const std::string prism = file->Prism(polygon, low_m, slab_m);
  file->SetSurface(prism, kSlabColour, 0);
  const std::string placement = file->LocalPlacement(part->placement, {});
  const std::string slab = file->AddRooted(
      "IFCSLAB", content,
      {StepText(fmt::format("{} {}", is_floor ? "Floor" : "Ceiling", plane.id)), kStepUnset,
       is_floor ? kStepUnset : "'CEILING'", placement, file->SolidShape({prism}),
       StepText(fmt::format("{}", plane.id)), is_floor ? ".FLOOR." : ".USERDEFINED."});
  part->elements.push_back(slab);
  file->AddProperties(
      slab, content, "Slab",
      {{"sigma_m", IfcLengthValue(plane.sigma_m)}, {"thickness_assumed", IfcBooleanValue(true)}});
}

}  // namespace

void AddIfcSpaces(const Building& building, IfcStructure* structure, IfcFile* file) {
  for (const Room& room : building.rooms) {
    if (!HasArea(room.polygon)) continue;
    AddSpace(room, &structure->PartOf(StoreyOfId(building, room.storey)), file);
  }
}

int AddIfcSlabs(const Building& building, const IfcOptions& options, IfcStructure* structure,
                IfcFile* file) {
  int left_out = 0;
  for (const BuildingPlane& plane : building.planes) {
    if (plane.kind != PlaneKind::kFloor && plane.kind != PlaneKind::kCeiling) continue;
    const Polygon polygon = LevelOutline(plane, building);
    if (!IsLevel(plane) || !HasArea(polygon)) {
      ++left_out;
      continue;
    }
    const double slab_m = SlabThickness(plane, polygon, building, options);
    AddSlab(plane, polygon, slab_m, &structure->PartOf(StoreyOfId(building, plane.storey)), file);
  }
  return left_out;
}

}  // namespace slcmap
