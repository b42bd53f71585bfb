#include "export/ifc/ifc_rooms.h"

#include <spdlog/fmt/fmt.h>

#include "export/slab_shape.h"
#include "export/storey_at.h"

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

void AddSlab(const Slab& solid, IfcPart* part, IfcFile* file) {
  const BuildingPlane& plane = *solid.plane;
  const std::string content =
      fmt::format("{} {} {}", plane.storey, StepReal(plane.offset_m / plane.normal.z()),
                  ContentOf(solid.polygon));
  const std::string prism =
      file->Prism(solid.polygon, solid.low_m - part->floor_m, solid.high_m - solid.low_m);
  file->SetSurface(prism, kSlabColour, 0);
  const std::string placement = file->LocalPlacement(part->placement, {});
  const std::string slab = file->AddRooted(
      "IFCSLAB", content,
      {StepText(fmt::format("{} {}", solid.IsFloor() ? "Floor" : "Ceiling", plane.id)), kStepUnset,
       solid.IsFloor() ? kStepUnset : "'CEILING'", placement, file->SolidShape({prism}),
       StepText(fmt::format("{}", plane.id)), solid.IsFloor() ? ".FLOOR." : ".USERDEFINED."});
  part->elements.push_back(slab);
  file->AddProperties(
      slab, content, "Slab",
      {{"sigma_m", IfcLengthValue(plane.sigma_m)}, {"thickness_assumed", IfcBooleanValue(true)}});
}

}  // namespace

void AddIfcSpaces(const Building& building, IfcStructure* structure, IfcFile* file) {
  for (const Room& room : building.rooms) {
    if (!HasArea(room.polygon)) continue;
    AddSpace(room, &structure->GetPart(StoreyOfId(building, room.storey)), file);
  }
}

int AddIfcSlabs(const Building& building, const IfcOptions& options, IfcStructure* structure,
                IfcFile* file) {
  int left_out = 0;
  for (const Slab& slab : SlabsOf(building, options.slab_m, &left_out)) {
    AddSlab(slab, &structure->GetPart(StoreyOfId(building, slab.plane->storey)), file);
  }
  return left_out;
}

}  // namespace slcmap
