#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <algorithm>

#include "data/io/file.h"
#include "export/cad/ifc_file.h"
#include "export/scene/building_solids.h"
#include "export/scene/formats.h"
#include "export/scene/georeference_note.h"
#include "export/scene/map_layers.h"
#include "export/scene/meshes.h"

namespace slcmap::inline exporting {
namespace {

// What people call it, where that is known.
std::string LongName(const std::string& name) { return name.empty() ? kStepUnset : StepText(name); }

// A part of the building that elements are put into: a storey, or the building itself for what
// belongs to none.
struct IfcPart {
  std::string entity, placement;
  std::string content;  // tells it from others
  double floor_m = 0;   // its z = 0 in world
  std::vector<std::string> elements, spaces;
};

// Project, site, building and storeys.
class IfcStructure {
 public:
  IfcStructure(const MapResult& map, IfcFile* file) : file_(file) {
    const std::string& content = map.source.run_id;
    const std::string contexts = StepList({file_->contexts().model});
    const std::string project =
        file_->AddRooted("IFCPROJECT", content,
                         {StepText("map " + map.id), StepText("Measured by slcmap"), kStepUnset,
                          kStepUnset, kStepUnset, contexts, file_->units()});
    const std::string of_site = file_->LocalPlacement(kStepUnset, {});
    const std::string site =
        file_->AddRooted("IFCSITE", content,
                         {"'Site'", kStepUnset, kStepUnset, of_site, kStepUnset, kStepUnset,
                          ".ELEMENT.", kStepUnset, kStepUnset, kStepUnset, kStepUnset, kStepUnset});
    building_.content = content;
    // Heights of storeys are over the lowest floor; the map's z counts from where odometry began.
    if (!map.building.storeys.empty()) building_.floor_m = map.building.storeys.front().floor_m;
    building_.placement = file_->LocalPlacement(of_site, {.origin = {0, 0, building_.floor_m}});
    building_.entity = file_->AddRooted(
        "IFCBUILDING", content,
        {"'Building'", kStepUnset, kStepUnset, building_.placement, kStepUnset,
         LongName(map.building.name), ".ELEMENT.", kStepUnset, kStepUnset, kStepUnset});
    Aggregate(project, "project " + content, {site});
    Aggregate(site, "site " + content, {building_.entity});
    AddStoreys(map);
  }

  // Of a storey of the building by its index; of none, the building.
  IfcPart& GetPart(std::optional<std::size_t> storey) {
    return storey ? storeys_[*storey] : building_;
  }

  // Relates what was put into the parts. Call it once, at the end.
  void Finish() {
    std::vector<IfcPart*> all = {&building_};
    for (IfcPart& storey : storeys_) all.push_back(&storey);
    for (IfcPart* part : all) {
      if (!part->spaces.empty()) Aggregate(part->entity, part->content + " spaces", part->spaces);
      if (part->elements.empty()) continue;
      file_->AddRooted("IFCRELCONTAINEDINSPATIALSTRUCTURE", part->content,
                       {kStepUnset, kStepUnset, StepList(part->elements), part->entity});
    }
  }

 private:
  void AddStoreys(const MapResult& map) {
    std::vector<std::string> entities;
    for (const Storey& storey : map.building.storeys) {
      IfcPart part;
      part.floor_m = storey.floor_m;
      part.content = fmt::format("{} storey {}", map.source.run_id, storey.id);
      const double elevation_m = storey.floor_m - building_.floor_m;
      part.placement = file_->LocalPlacement(building_.placement, {.origin = {0, 0, elevation_m}});
      part.entity = file_->AddRooted(
          "IFCBUILDINGSTOREY", part.content,
          {StepText(fmt::format("Storey {}", storey.id)), kStepUnset, kStepUnset, part.placement,
           kStepUnset, LongName(storey.name), ".ELEMENT.", StepReal(elevation_m)});
      entities.push_back(part.entity);
      storeys_.push_back(part);
    }
    if (!entities.empty()) Aggregate(building_.entity, building_.content, entities);
  }

  void Aggregate(const std::string& whole, const std::string& content,
                 const std::vector<std::string>& parts) {
    file_->AddRooted("IFCRELAGGREGATES", content, {kStepUnset, kStepUnset, whole, StepList(parts)});
  }

  IfcFile* file_;
  IfcPart building_;
  std::vector<IfcPart> storeys_;
};

constexpr double kBeyond_m = 0.05;    // openings reach beyond the faces and borders that they cut
constexpr double kAtBorder_m = 1e-3;  // and are at a border when they are as near
constexpr Colour kWallColour{222, 219, 211};
constexpr Colour kAssumedColour{205, 196, 178};

// A wall in its own frame: x along it, y from its measured face to the one behind, z up.
class WallBuilder {
 public:
  WallBuilder(const PlanWall& wall, const WallHeight& height, const WallBack& back, IfcPart* part,
              IfcFile* file)
      : wall_(wall),
        height_(height),
        back_(back),
        part_(part),
        file_(file),
        length_m_((wall.end - wall.start).norm()),
        content_(fmt::format("{} {} {} {} {}", wall.storey, Text(wall.start), Text(wall.end),
                             StepReal(wall.thickness_m), StepReal(height.height_m))) {}

  void Add() {
    placement_ = file_->LocalPlacement(
        part_->placement,
        {.origin = {wall_.start.x(), wall_.start.y(), height_.floor_m - part_->floor_m},
         .along = wall_.end - wall_.start});
    entity_ = file_->AddRooted(
        "IFCWALL", content_,
        {StepText(fmt::format("Wall {}", wall_.id)), kStepUnset, kStepUnset, placement_, Shape(),
         StepText(fmt::format("{}", wall_.id)), ".NOTDEFINED."});
    part_->elements.push_back(entity_);
    file_->AddQuantities(
        entity_, content_, "Qto_WallBaseQuantities",
        {file_->Length("Length", length_m_), file_->Length("Width", wall_.thickness_m),
         file_->Length("Height", height_.height_m)});
    std::vector<std::string> planes;
    for (const int64_t id : wall_.plane_ids) planes.push_back(fmt::format("{}", id));
    file_->AddProperties(entity_, content_, "Wall",
                         {{"sigma_m", IfcLengthValue(wall_.sigma_m)},
                          {"thickness_assumed", IfcBooleanValue(wall_.thickness_assumed)},
                          {"height_assumed", IfcBooleanValue(height_.assumed)},
                          {"planes", IfcTextValue(fmt::format("{}", fmt::join(planes, " ")))}});
  }

  // False: it is not in the wall.
  bool AddOpening(const PlanOpening& opening) {
    const std::optional<Eigen::AlignedBox2d> hole = ComputeHole(opening, wall_, height_);
    if (!hole) return false;
    const std::string content =
        fmt::format("{} in {} to {}", content_, Text(hole->min()), Text(hole->max()));
    AddHole(opening, *hole, content);
    return true;
  }

 private:
  static std::string Text(const Eigen::Vector2d& p) {
    return fmt::format("{} {}", StepReal(p.x()), StepReal(p.y()));
  }

  std::string Shape() {
    const std::string solid = Solid();
    file_->SetSurface(solid, wall_.thickness_assumed ? kAssumedColour : kWallColour, 0);
    const IfcContexts& contexts = file_->contexts();
    const std::string line = file_->Polyline({{0, 0}, {length_m_, 0}}, false);
    return file_->Shape({file_->Representation(contexts.axis, "Axis", "Curve2D", {line}),
                         file_->Representation(contexts.body, "Body", "SweptSolid", {solid})});
  }

  std::string Solid() {
    if (back_.before_start_m == 0 && back_.beyond_end_m == 0) {
      return file_->Box({0.5 * length_m_, 0.5 * wall_.thickness_m}, {length_m_, wall_.thickness_m},
                        0, height_.height_m);
    }
    const Polygon area = {{{0, 0},
                           {length_m_, 0},
                           {length_m_ + back_.beyond_end_m, wall_.thickness_m},
                           {-back_.before_start_m, wall_.thickness_m}},
                          {}};
    return file_->Prism(area, 0, height_.height_m);
  }

  // The hole is along the wall and over the floor; its solid starts at z = 0 of its own placement.
  void AddHole(const PlanOpening& opening, const Eigen::AlignedBox2d& hole,
               const std::string& content) {
    const Eigen::AlignedBox2d solid = Beyond(hole);
    const std::string placement = file_->LocalPlacement(
        placement_, {.origin = {hole.min().x(), 0.5 * wall_.thickness_m, hole.min().y()}});
    const Eigen::Vector2d size(solid.sizes().x(), wall_.thickness_m + 2 * kBeyond_m);
    const std::string box = file_->Box({solid.center().x() - hole.min().x(), 0}, size,
                                       solid.min().y() - hole.min().y(), solid.sizes().y());
    const std::string entity =
        file_->AddRooted("IFCOPENINGELEMENT", content,
                         {StepText(GetName(opening)), kStepUnset, kStepUnset, placement,
                          file_->SolidShape({box}), kStepUnset, ".OPENING."});
    file_->AddRooted("IFCRELVOIDSELEMENT", content, {kStepUnset, kStepUnset, entity_, entity});
    file_->AddProperties(entity, content, "Opening",
                         {{"walked_through", IfcBooleanValue(opening.walked)}});
    if (opening.kind == OpeningKind::kPassage) return;
    AddFilling(opening, hole, content, placement, entity);
  }

  // Cut solids that end at a face or border of the wall leave skins there.
  Eigen::AlignedBox2d Beyond(const Eigen::AlignedBox2d& hole) const {
    const Eigen::Vector2d border(length_m_, height_.height_m);
    Eigen::AlignedBox2d solid = hole;
    for (int i = 0; i < 2; ++i) {
      if (hole.min()[i] < kAtBorder_m) solid.min()[i] = -kBeyond_m;
      if (border[i] - hole.max()[i] < kAtBorder_m) solid.max()[i] = border[i] + kBeyond_m;
    }
    return solid;
  }

  static const char* GetName(const PlanOpening& opening) {
    if (opening.kind == OpeningKind::kDoor) return "Doorway";
    return opening.kind == OpeningKind::kWindow ? "Window" : "Passage";
  }

  // A door or a window, without a shape: that there is a hole was seen, a leaf or a pane was not.
  void AddFilling(const PlanOpening& opening, const Eigen::AlignedBox2d& hole,
                  const std::string& content, const std::string& of_hole,
                  const std::string& filled) {
    const bool is_door = opening.kind == OpeningKind::kDoor;
    const std::string placement = file_->LocalPlacement(of_hole, {});
    const std::string entity = file_->AddRooted(
        is_door ? "IFCDOOR" : "IFCWINDOW", content,
        {opening.name.empty() ? (is_door ? "'Door'" : "'Window'") : StepText(opening.name),
         kStepUnset, kStepUnset, placement, kStepUnset, kStepUnset, StepReal(hole.sizes().y()),
         StepReal(hole.sizes().x()), is_door ? ".DOOR." : ".WINDOW.", ".NOTDEFINED.", kStepUnset});
    file_->AddRooted("IFCRELFILLSELEMENT", content, {kStepUnset, kStepUnset, filled, entity});
    if (is_door) {
      file_->AddProperties(entity, content, "Door",
                           {{"walked_through", IfcBooleanValue(opening.walked)}});
    }
    part_->elements.push_back(entity);
  }

  const PlanWall& wall_;
  const WallHeight height_;
  const WallBack back_;
  IfcPart* part_;
  IfcFile* file_;
  const double length_m_;
  const std::string content_;
  std::string entity_, placement_;
};

// Adds the walls of a building: each from its storey's floor to the ceiling, behind its measured
// face, with backs that meet those of its neighbours at corners; its openings; and a door or a
// window, without a shape, in each that is one: passages stay open. Returns how many walls without
// length and openings beside their wall were left out.
int AddIfcWalls(const Building& building, IfcStructure* structure, IfcFile* file) {
  int left_out = 0;
  const std::map<const PlanWall*, WallSolid> solids = SolidsOfWalls(building);
  for (const PlanWall& wall : building.walls) {
    IfcPart& part = structure->GetPart(StoreyOfId(building, wall.storey));
    const WallHeight height = HeightOfWall(wall, building);
    if (!IsSolid(wall, height)) {
      ++left_out;
      continue;
    }
    WallBuilder builder(wall, height, ComputeBack(wall, solids), &part, file);
    builder.Add();
    for (const PlanOpening& opening : wall.openings) {
      if (!builder.AddOpening(opening)) ++left_out;
    }
  }
  return left_out;
}

constexpr Colour kSpaceColour{150, 190, 220};
constexpr Colour kSlabColour{190, 188, 184};
constexpr double kSpaceTransparency = 0.8;

std::string DescribeContent(const Polygon& polygon) {
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

std::string SpaceShape(const Room& room, const IfcPart& part, IfcFile* file) {
  const IfcContexts& contexts = file->contexts();
  if (!room.height_m || !(*room.height_m > kLeastSolid_m)) {
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
      fmt::format("{} {} {}", room.storey, StepReal(room.floor_m), DescribeContent(room.polygon));
  const std::string name = StepText(fmt::format("Room {}", room.id + 1));
  const std::string placement = file->LocalPlacement(part->placement, {});
  const std::string space = file->AddRooted(
      "IFCSPACE", content,
      {name, kStepUnset, kStepUnset, placement, SpaceShape(room, *part, file),
       StepText(GetTitle(room)), ".ELEMENT.", ".INTERNAL.", StepReal(room.floor_m)});
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
                  DescribeContent(solid.polygon));
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

// Adds a space for each room, with its area and, where its ceiling was seen, its height and volume;
// rooms without are footprints.
void AddIfcSpaces(const Building& building, IfcStructure* structure, IfcFile* file) {
  for (const Room& room : building.rooms) {
    if (!HasArea(room.polygon)) continue;
    AddSpace(room, &structure->GetPart(StoreyOfId(building, room.storey)), file);
  }
}

// Adds a slab of assumed thickness under each floor and over each ceiling, with the outline of its
// room, whose holes it has too. Where less than two such thicknesses are between a ceiling and the
// floor above it, both take half of what there is. Returns how many had no area and were left out.
int AddIfcSlabs(const Building& building, IfcStructure* structure, IfcFile* file) {
  int left_out = 0;
  for (const Slab& slab : MakeSlabs(building, &left_out)) {
    AddSlab(slab, &structure->GetPart(StoreyOfId(building, slab.plane->storey)), file);
  }
  return left_out;
}

using Lines = std::vector<const MapLine*>;

// In the order of storeys and axes.
using LineGroups = std::map<std::pair<std::optional<std::size_t>, LineAxis>, Lines>;

double MedianSigma(const Lines& lines) {
  std::vector<double> sigmas_m;
  for (const MapLine* line : lines) sigmas_m.push_back(line->sigma_m);
  const auto middle = sigmas_m.begin() + static_cast<std::ptrdiff_t>(sigmas_m.size() / 2);
  std::nth_element(sigmas_m.begin(), middle, sigmas_m.end());
  return *middle;
}

// A value a line, in the order of the curves.
template <typename Value>
IfcProperty MakeList(const char* name, const Lines& lines, Value value) {
  std::vector<std::string> values;
  for (const MapLine* line : lines) values.push_back(value(*line));
  return {name, StepList(values), true};
}

// The lines of one storey and axis.
class LineGroup {
 public:
  LineGroup(LineAxis axis, const Lines& lines, IfcPart* part, IfcFile* file)
      : lines_(lines),
        part_(part),
        file_(file),
        name_(fmt::format("Lines {}", AxisName(axis))),
        content_(fmt::format("{} {}", part->content, name_)) {
    const auto [red, green, blue] = LineColour(axis, true);
    colour_ = {red, green, blue};
  }

  void AddCurves() {
    std::vector<std::string> curves;
    for (const MapLine* line : lines_) {
      const std::string start = file_->Point(Local(line->start_world));
      const std::string end = file_->Point(Local(line->end_world));
      curves.push_back(file_->Add("IFCPOLYLINE", {StepList({start, end})}));
    }
    const std::string set = file_->Add("IFCGEOMETRICCURVESET", {StepList(curves)});
    file_->SetCurve(set, colour_);
    AddElement("IFCANNOTATION",
               file_->Shape({file_->Representation(file_->contexts().annotation, "Annotation",
                                                   "GeometricCurveSet", {set})}),
               {});
  }

  void AddBars(double width_m) {
    std::vector<std::string> bars;
    for (const MapLine* line : lines_) {
      bars.push_back(file_->Bar(Local(line->start_world), Local(line->end_world), width_m));
      file_->SetSurface(bars.back(), colour_, 0);
    }
    AddElement("IFCBUILDINGELEMENTPROXY", file_->SolidShape(bars), {kStepUnset, ".NOTDEFINED."});
  }

 private:
  Eigen::Vector3d Local(const Eigen::Vector3d& p_world) const {
    return p_world - part_->floor_m * Eigen::Vector3d::UnitZ();
  }

  void AddElement(const char* type, const std::string& shape,
                  const std::vector<std::string>& others) {
    std::vector<std::string> attributes = {StepText(name_), kStepUnset, "'StructuralLines'",
                                           file_->LocalPlacement(part_->placement, {}), shape};
    attributes.insert(attributes.end(), others.begin(), others.end());
    const std::string element = file_->AddRooted(type, content_, attributes);
    part_->elements.push_back(element);
    file_->AddProperties(
        element, type + content_, "Lines",
        {{"lines", IfcIntegerValue(std::ssize(lines_))},
         {"median_sigma_m", IfcLengthValue(MedianSigma(lines_))},
         MakeList("ids", lines_, [](const MapLine& line) { return IfcIntegerValue(line.id); }),
         MakeList("kinds", lines_,
                  [](const MapLine& line) { return IfcLabelValue(GetName(line.kind)); }),
         MakeList("sigmas_m", lines_,
                  [](const MapLine& line) { return IfcLengthValue(line.sigma_m); })});
  }

  const Lines& lines_;
  IfcPart* part_;
  IfcFile* file_;
  const std::string name_, content_;
  Colour colour_;
};

// Adds an annotation for the lines of a storey and an axis, as one set of curves, and with
// line_solids a proxy for the same lines as bars; both say of each line its id, kind and sigma, in
// the order of the curves. Returns how many lines without length were left out.
int AddIfcLines(const MapResult& map, bool line_solids, IfcStructure* structure, IfcFile* file,
                const Progress& progress) {
  constexpr double kSolid_m = 0.02;  // width of these
  LineGroups groups;
  int left_out = 0;
  for (const MapLine& line : map.lines) {
    if ((line.end_world - line.start_world).norm() < kLeastSolid_m) {
      ++left_out;
      continue;
    }
    groups[{StoreyAtMiddle(map.building, line), line.axis}].push_back(&line);
  }
  double done = 0;
  for (const auto& [key, lines] : groups) {
    progress.ReportOrStop(done++ / static_cast<double>(groups.size()));
    LineGroup group(key.second, lines, &structure->GetPart(key.first), file);
    group.AddCurves();
    if (line_solids) group.AddBars(kSolid_m);
  }
  return left_out;
}

void AddPipe(const MapPipe& pipe, IfcPart* part, IfcFile* file) {
  const Eigen::Vector3d floor = part->floor_m * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d start = pipe.start_world - floor, end = pipe.end_world - floor;
  const std::string solid = file->RoundBar(start, end, pipe.radius_m);
  file->SetSurface(solid, kPipeColour, 0);
  const std::string content = fmt::format("{} pipe {}", part->content, pipe.id);
  const std::string element =
      file->AddRooted("IFCPIPESEGMENT", content,
                      {StepText(fmt::format("Pipe {}", pipe.id)), kStepUnset, kStepUnset,
                       file->LocalPlacement(part->placement, {}), file->SolidShape({solid}),
                       StepText(fmt::format("{}", pipe.id)), ".NOTDEFINED."});
  part->elements.push_back(element);
  file->AddProperties(element, content, "Pipe",
                      {{"radius_m", IfcLengthValue(pipe.radius_m)},
                       {"radius_sigma_m", IfcLengthValue(pipe.radius_sigma_m)},
                       {"sigma_m", IfcLengthValue(pipe.sigma_m)},
                       {"images", IfcIntegerValue(pipe.images)}});
}

// Adds an IfcPipeSegment for each pipe, a circle extruded along its axis, to the storey in which
// its middle is. What it is used for is not known: columns and drums are among them. Returns how
// many without length were left out.
int AddIfcPipes(const MapResult& map, IfcStructure* structure, IfcFile* file) {
  int left_out = 0;
  for (const MapPipe& pipe : map.pipes) {
    if ((pipe.end_world - pipe.start_world).norm() < kLeastSolid_m) {
      ++left_out;
      continue;
    }
    AddPipe(pipe, &structure->GetPart(StoreyAtMiddle(map.building, pipe)), file);
  }
  return left_out;
}

}  // namespace

std::vector<std::string> WriteIfc(bool line_solids, const std::string& folder, const MapResult& map,
                                  const Progress& progress) {
  const std::string path = folder + "/map.ifc";
  IfcFile file(FindNorth_rad(map.source));
  IfcStructure structure(map, &file);
  if (const auto& place = map.source.georeference) {
    const auto system =
        place->crs.empty() ? nullptr : std::make_unique<CoordinateSystem>(place->crs);
    file.AddMapConversion(*place, system ? system->title() : "",
                          system ? system->title_of_heights() : "");
  }
  int left_out = AddIfcWalls(map.building, &structure, &file);
  left_out += AddIfcSlabs(map.building, &structure, &file);
  AddIfcSpaces(map.building, &structure, &file);
  left_out += AddIfcPipes(map, &structure, &file);
  progress.ReportOrStop(0.2);
  left_out += AddIfcLines(map, line_solids, &structure, &file, progress.Part(0.2, 0.9));
  structure.Finish();
  if (left_out > 0) {
    spdlog::warn("map.ifc: {} walls, openings, slabs, pipes or lines without extent are left out",
                 left_out);
  }
  WriteFile(path, file.Text());
  return {path};
}

}  // namespace slcmap::exporting
