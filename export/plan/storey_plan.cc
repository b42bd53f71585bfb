#include <spdlog/fmt/fmt.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "export/plan/drawing.h"
#include "export/plan/section_drawing.h"
#include "export/plan/sheet.h"
#include "export/scene/building_solids.h"
#include "export/scene/map_layers.h"

namespace slcmap::inline exporting {
namespace {

using Eigen::Vector2d;

// Walls and the swings of doors: where no text may stand.
TakenPlaces CollectPlaces(const std::vector<WallSolid>& solids) {
  TakenPlaces taken;
  for (const WallSolid& solid : solids) {
    const double half_m = 0.5 * solid.Thickness();
    taken.AddWall(MakeBox(solid.At(0, half_m), solid.At(solid.Length(), half_m), half_m));
    for (const PlanOpening& opening : solid.wall->openings) {
      if (opening.kind != OpeningKind::kDoor || !opening.walked) continue;
      const double half_width_m = 0.5 * (opening.to_m - opening.from_m);
      taken.AddLine(MakeBox(solid.At(opening.from_m, -half_width_m),
                            solid.At(opening.to_m, -half_width_m), half_width_m));
    }
  }
  return taken;
}

// Dimensions that end at the assumed back of a wall are about so long.
void MarkAssumed(const std::vector<WallEdge>& edges, std::vector<Dimension>* dimensions) {
  const auto ends_at_assumed = [&](const Vector2d& end) {
    const WallEdge* nearest = nullptr;
    double least_m = 0;
    for (const WallEdge& edge : edges) {
      const Vector2d along = edge.end - edge.start;
      const double at = std::clamp(
          (end - edge.start).dot(along) / std::max(along.squaredNorm(), 1e-12), 0.0, 1.0);
      const double distance_m = (edge.start + at * along - end).norm();
      if (nearest == nullptr || distance_m < least_m) nearest = &edge, least_m = distance_m;
    }
    return nearest != nullptr && nearest->assumed;
  };
  for (Dimension& dimension : *dimensions) {
    dimension.is_about = ends_at_assumed(dimension.from) || ends_at_assumed(dimension.to);
  }
}

void AddTexts(const Building& building, const std::vector<WallSolid>& solids,
              const PlanTextSizes& sizes, bool wall_sigma, StoreyPlan* plan) {
  TakenPlaces taken = CollectPlaces(solids);
  std::vector<Polygon> rooms;
  for (const Room& room : building.rooms) {
    if (room.storey == plan->storey.id) rooms.push_back(room.polygon);
  }
  const std::vector<Dimension> chains = OuterChains(solids, rooms, sizes);
  for (const Dimension& chain : chains) taken.AddText(MakeBox(DimensionText(chain, sizes)));
  for (const DrawnPath& path : plan->sections.paths) {
    taken.AddLine(MakeBox(path.points.front(), path.points.back(), sizes.gap_m));
  }
  for (const WallSolid& solid : solids) {
    Append(OpeningTexts(solid, sizes, &taken), &plan->wall_texts);
  }
  for (const WallSolid& solid : solids) Append(WallText(solid, sizes, &taken), &plan->wall_texts);
  for (const Room& room : building.rooms) {
    if (room.storey != plan->storey.id) continue;
    const Drawing label = RoomLabel(room, room.polygon, sizes, &taken);
    Append(label.texts, &plan->room_texts);
    Append(label.paths, &plan->rooms.paths);
  }
  for (const Polygon& room : rooms) {
    Append(RoomDimensions(room, sizes, &taken), &plan->dimensions);
  }
  MarkAssumed(WallEdges(solids), &plan->dimensions);
  Append(chains, &plan->dimensions);
  if (!wall_sigma) return;
  for (const WallSolid& solid : solids) {
    Append(SigmaText(solid, sizes, &taken), &plan->wall_texts);
  }
}

DrawnPath MakeBorder(const PlanPoints& ring) {
  DrawnPath border = {Pen::kRoom, ring};
  border.points.push_back(ring.front());
  return border;
}

void AddBorders(const Polygon& room, Drawing* drawing) {
  drawing->paths.push_back(MakeBorder(room.outline));
  for (const PlanPoints& hole : room.holes) drawing->paths.push_back(MakeBorder(hole));
}

// A line where each section is cut, with an arrow in the direction of view and the section's number
// at both ends.
Drawing SectionMarks(const PlanOptions& options, const Eigen::AlignedBox2d& extent,
                     const PlanTextSizes& sizes) {
  Drawing drawing;
  int number = 0;
  for (const std::string& text : options.sections) {
    const SectionView view = ParseSection(text, ++number);
    const double middle_m = view.At(extent.center()).x();
    const double reach_m = 0.5 * std::abs(view.right.dot(extent.sizes())) + 2 * sizes.gap_m;
    const Vector2d start = view.origin + std::max(view.from_m, middle_m - reach_m) * view.right;
    const Vector2d end = view.origin + std::min(view.to_m, middle_m + reach_m) * view.right;
    drawing.paths.push_back({Pen::kSectionLine, {start, end}});
    for (const double sign : {-1.0, 1.0}) {
      const Vector2d at = sign < 0 ? start : end;
      const Vector2d tip = at + 2 * sizes.figure_m * view.Ahead();
      const Vector2d barb = tip - sizes.gap_m * view.Ahead();
      drawing.paths.push_back({Pen::kFrame, {at, tip}});
      for (const double side : {-0.5, 0.5}) {
        drawing.paths.push_back({Pen::kFrame, {tip, barb + side * sizes.gap_m * view.right}});
      }
      const Vector2d place =
          at + sign * sizes.figure_m * view.right + sizes.figure_m * view.Ahead();
      drawing.texts.push_back(
          {view.mark, place - Vector2d(0, 0.5 * sizes.figure_m), sizes.figure_m});
    }
  }
  return drawing;
}

StoreyPlan MakePlan(const Building& building, const Storey& storey, const PlanTextSizes& sizes,
                    bool wall_sigma, const Drawing& sections) {
  const std::vector<WallSolid> solids = WallSolids(building, storey.id);
  StoreyPlan plan;
  plan.storey = storey;
  plan.sections = sections;
  plan.walls = DrawWalls(solids);
  for (const WallSolid& solid : solids) {
    for (const PlanOpening& opening : solid.wall->openings) {
      plan.openings.Add(OpeningSymbol(solid, opening));
    }
  }
  for (const Room& room : building.rooms) {
    if (room.storey == storey.id) AddBorders(room.polygon, &plan.rooms);
  }
  AddTexts(building, solids, sizes, wall_sigma, &plan);
  return plan;
}

}  // namespace

PlanSet MakePlans(const Building& building, const PlanOptions& options) {
  const Eigen::AlignedBox2d extent = PlanExtent(building);
  PlanSet plans;
  if (!extent.isEmpty()) plans.middle_m = extent.center();
  plans.format =
      ChooseFormat(extent.isEmpty() ? Vector2d::Zero() : Vector2d(extent.sizes()), options);
  const PlanTextSizes sizes(plans.format.scale, options.millimetres);
  const Drawing sections = SectionMarks(options, extent, sizes);
  for (const Storey& storey : building.storeys) {
    plans.storeys.push_back(MakePlan(building, storey, sizes, options.wall_sigma, sections));
  }
  return plans;
}

namespace {

class DeviationDrawing {
 public:
  DeviationDrawing(const RigidTransform& T_sheet_plan, const PlanTextSizes& sizes)
      : T_sheet_plan_(T_sheet_plan), sizes_(sizes) {}

  template <typename Deviation>
  void Add(const Deviation& part) {
    if (part.status == PlanStatus::kAsPlanned) return;
    Add(part.start_plan, part.end_plan, part.status, WriteDeviation(part));
  }

  const Drawing& drawing() const { return drawing_; }

 private:
  // What is new is drawn as built already.
  void Add(const Vector2d& start_plan, const Vector2d& end_plan, PlanStatus status,
           const std::string& text) {
    const Vector2d start = OnSheet(start_plan), end = OnSheet(end_plan);
    if (status != PlanStatus::kNew) drawing_.paths.push_back({Pen::kPlanned, {start, end}});
    const Vector2d along = (end - start).normalized(), before(along.y(), -along.x());
    const double angle_rad = ReadableAngle(along);
    const Vector2d up(-std::sin(angle_rad), std::cos(angle_rad));
    const Vector2d place = 0.5 * (start + end) + (sizes_.gap_m + 0.5 * sizes_.small_m) * before;
    drawing_.texts.push_back({text, place - 0.5 * sizes_.small_m * up, sizes_.small_m, angle_rad});
  }

  Vector2d OnSheet(const Vector2d& p_plan) const {
    return (T_sheet_plan_ * Eigen::Vector3d(p_plan.x(), p_plan.y(), 0)).head<2>();
  }

  const RigidTransform T_sheet_plan_;
  const PlanTextSizes& sizes_;
  Drawing drawing_;
};

}  // namespace

Drawing DrawPlanDeviations(const MapResult& map, const Storey& storey, const PlanTextSizes& sizes) {
  if (!map.plan || map.plan->storey != storey.id) return {};
  DeviationDrawing drawing(map.plan->T_plan_world.Inverse(), sizes);
  for (const WallDeviation& wall : map.plan->walls) drawing.Add(wall);
  for (const OpeningDeviation& opening : map.plan->openings) drawing.Add(opening);
  return drawing.drawing();
}

}  // namespace slcmap::exporting
