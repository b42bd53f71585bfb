#include "export/plan/plan_deviations.h"

#include <spdlog/fmt/fmt.h>

#include <cmath>

namespace slcmap::inline exporting {
namespace {

using Eigen::Vector2d;

class DeviationDrawing {
 public:
  DeviationDrawing(const RigidTransform& T_sheet_plan, const PlanTextSizes& sizes)
      : T_sheet_plan_(T_sheet_plan), sizes_(sizes) {}

  void Add(const WallDeviation& wall) {
    if (wall.status == PlanStatus::kAsPlanned) return;
    const bool is_measured = wall.status == PlanStatus::kDeviates;
    Add(wall.start_plan, wall.end_plan, wall.status,
        is_measured ? fmt::format("{:+.0f} \u00b1{:.0f}", 1e3 * wall.deviation_m,
                                  std::max(1.0, 1e3 * wall.sigma_m))
                    : GetName(wall.status));
  }

  void Add(const OpeningDeviation& opening) {
    if (opening.status == PlanStatus::kAsPlanned) return;
    std::string text = opening.status == PlanStatus::kMissing ? "closed" : GetName(opening.status);
    if (opening.status == PlanStatus::kDeviates) {
      text = fmt::format("{:+.0f}, width {:+.0f}", 1e3 * opening.moved_m, 1e3 * opening.wider_m);
    }
    Add(opening.start_plan, opening.end_plan, opening.status, text);
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
  DeviationDrawing drawing(map.building.T_map_world * map.plan->T_plan_world.Inverse(), sizes);
  for (const WallDeviation& wall : map.plan->walls) drawing.Add(wall);
  for (const OpeningDeviation& opening : map.plan->openings) drawing.Add(opening);
  return drawing.drawing();
}

}  // namespace slcmap::exporting
