#include "export/ifc/ifc_walls.h"

#include <spdlog/fmt/fmt.h>

#include "export/plan/wall_solids.h"
#include "export/storey_at.h"
#include "export/wall_shape.h"

namespace slcmap {
namespace {

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
    const std::optional<Eigen::AlignedBox2d> hole = HoleOf(opening, wall_, height_);
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
                         {StepText(NameOf(opening)), kStepUnset, kStepUnset, placement,
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

  static const char* NameOf(const PlanOpening& opening) {
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
        {is_door ? "'Door'" : "'Window'", kStepUnset, kStepUnset, placement, kStepUnset, kStepUnset,
         StepReal(hole.sizes().y()), StepReal(hole.sizes().x()), is_door ? ".DOOR." : ".WINDOW.",
         ".NOTDEFINED.", kStepUnset});
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

}  // namespace

int AddIfcWalls(const Building& building, const IfcOptions& options, IfcStructure* structure,
                IfcFile* file) {
  int left_out = 0;
  const std::map<const PlanWall*, WallSolid> solids = SolidsOfWalls(building);
  for (const PlanWall& wall : building.walls) {
    IfcPart& part = structure->GetPart(StoreyOfId(building, wall.storey));
    const WallHeight height = HeightOfWall(wall, building, options.assumed_height_m);
    if (!IsSolid(wall, height)) {
      ++left_out;
      continue;
    }
    const auto solid = solids.find(&wall);
    const WallBack back = solid == solids.end() ? WallBack() : BackOf(solid->second);
    WallBuilder builder(wall, height, back, &part, file);
    builder.Add();
    for (const PlanOpening& opening : wall.openings) {
      if (!builder.AddOpening(opening)) ++left_out;
    }
  }
  return left_out;
}

}  // namespace slcmap
