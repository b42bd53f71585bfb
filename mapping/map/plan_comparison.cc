#include "mapping/map/plan_comparison.h"

#include <cmath>

#include "data/core/math.h"
#include "data/io/json.h"
#include "data/io/json_fields.h"

namespace slcmap::inline mapping {
namespace {

constexpr char kComparisonFormat[] = "slcmap plan comparison";
constexpr int kComparisonVersion = 1;
constexpr double kFarthest_m = 1e7;
constexpr int64_t kMostPlanned = 100'000'000;

// Millimetres, to a hundredth.
double InMm(double length_m) { return std::round(1e5 * length_m) / 100; }

bool WasMeasured(PlanStatus status) {
  return status == PlanStatus::kAsPlanned || status == PlanStatus::kDeviates;
}

template <typename Fields>
void DescribeRow(Fields& fields, const char* thing, auto& row, auto& id) {
  fields.Named("status", row.status, kPlanStatuses);
  fields.Integer("planned", row.planned, -1, kMostPlanned);
  fields.Integer(thing, id, -1, kMostPlanned);
  fields.Point("start", row.start_plan, kFarthest_m);
  fields.Point("end", row.end_plan, kFarthest_m);
}

}  // namespace

template <typename Fields>
void Describe(Fields& fields, Of<WallDeviation> auto& wall) {
  DescribeRow(fields, "plane", wall, wall.plane);
  if (!WasMeasured(wall.status)) return;
  fields.Millimetres("deviation_mm", wall.deviation_m, -kFarthest_m, kFarthest_m);
  fields.Millimetres("sigma_mm", wall.sigma_m, 0, kFarthest_m);
  fields.Number("turn_rad", wall.turn_rad, -4, 4);
  fields.Number("turn_sigma_rad", wall.turn_sigma_rad, 0, 1e6);
}

template <typename Fields>
void Describe(Fields& fields, Of<OpeningDeviation> auto& opening) {
  DescribeRow(fields, "wall", opening, opening.wall);
  if (!WasMeasured(opening.status)) return;
  fields.Millimetres("moved_mm", opening.moved_m, -kFarthest_m, kFarthest_m);
  fields.Millimetres("moved_sigma_mm", opening.moved_sigma_m, 0, kFarthest_m);
  fields.Millimetres("wider_mm", opening.wider_m, -kFarthest_m, kFarthest_m);
  fields.Millimetres("wider_sigma_mm", opening.wider_sigma_m, 0, kFarthest_m);
}

namespace {

double YawIn(const RigidTransform& transform) {
  const Eigen::Vector3d x = transform.rotation * Eigen::Vector3d::UnitX();
  return std::atan2(x.y(), x.x());
}

// Columns that have no meaning in a row are empty.
std::string DeviationTable(const PlanComparison& comparison) {
  const auto ends = [](const auto& row, int64_t id) {
    return fmt::format("{},{},{},{:.4f},{:.4f},{:.4f},{:.4f}", GetName(row.status), row.planned, id,
                       row.start_plan.x(), row.start_plan.y(), row.end_plan.x(), row.end_plan.y());
  };
  std::string table =
      "what,status,planned,built,start_x_m,start_y_m,end_x_m,end_y_m,deviation_mm,sigma_mm,"
      "turn_deg,turn_sigma_deg,wider_mm,wider_sigma_mm\n";
  for (const WallDeviation& wall : comparison.walls) {
    table += "wall," + ends(wall, wall.plane);
    table += WasMeasured(wall.status)
                 ? fmt::format(",{:.1f},{:.1f},{:.3f},{:.3f},,\n", 1e3 * wall.deviation_m,
                               1e3 * wall.sigma_m, kDegreesPerRadian * wall.turn_rad,
                               kDegreesPerRadian * wall.turn_sigma_rad)
                 : ",,,,,,\n";
  }
  for (const OpeningDeviation& opening : comparison.openings) {
    table += "opening," + ends(opening, opening.wall);
    table += WasMeasured(opening.status)
                 ? fmt::format(",{:.1f},{:.1f},,,{:.1f},{:.1f}\n", 1e3 * opening.moved_m,
                               1e3 * opening.moved_sigma_m, 1e3 * opening.wider_m,
                               1e3 * opening.wider_sigma_m)
                 : ",,,,,,\n";
  }
  return table;
}

}  // namespace

void WritePlanComparison(const std::string& folder, const PlanComparison& comparison) {
  const RigidTransform& T = comparison.T_plan_world;
  Json json = {{"format", kComparisonFormat},
               {"version", kComparisonVersion},
               {"plan", comparison.plan},
               {"planned_storey", comparison.planned_storey},
               {"storey", comparison.storey},
               {"plan_from_world",
                {{"turn_rad", YawIn(T)},
                 {"translation_m", PointJson(T.translation)},
                 {"sigma_mm", InMm(comparison.sigma_m)},
                 {"turn_sigma_rad", comparison.yaw_sigma_rad}}},
               {"agreeing_m", RoundedForJson(comparison.agreeing_m)},
               {"differing_m", RoundedForJson(comparison.differing_m)},
               {"rival_share", RoundedForJson(comparison.rival_share)},
               {"walls", JsonWriter::WriteList(comparison.walls)},
               {"openings", JsonWriter::WriteList(comparison.openings)}};
  WriteJsonFile(folder + "/" + kPlanComparisonFiles[0], json);
  WriteFile(folder + "/" + kPlanComparisonFiles[1], DeviationTable(comparison));
}

PlanComparison ReadPlanComparison(const std::string& folder) {
  const std::string path = folder + "/" + kPlanComparisonFiles[0];
  return ParseJsonFile(path, [&](const Json& json) {
    CheckFormat(path, json, kComparisonFormat, kComparisonVersion, kComparisonVersion);
    PlanComparison comparison;
    comparison.plan = json.at("plan").get<std::string>();
    comparison.planned_storey = json.at("planned_storey").get<std::string>();
    comparison.storey = BoundedAt<int64_t>(path, json, "storey", 0, kMostPlanned);
    const Json& placed = json.at("plan_from_world");
    const double turn_rad = BoundedAt(path, placed, "turn_rad", -4.0, 4.0);
    comparison.T_plan_world.rotation = Eigen::AngleAxisd(turn_rad, Eigen::Vector3d::UnitZ());
    comparison.T_plan_world.translation =
        ParsePoint<Eigen::Vector3d>(path, placed.at("translation_m"), kFarthest_m);
    comparison.sigma_m = 1e-3 * BoundedAt(path, placed, "sigma_mm", 0.0, 1e3 * kFarthest_m);
    comparison.yaw_sigma_rad = BoundedAt(path, placed, "turn_sigma_rad", 0.0, 1e6);
    comparison.agreeing_m = BoundedAt(path, json, "agreeing_m", 0.0, kFarthest_m);
    comparison.differing_m = BoundedAt(path, json, "differing_m", 0.0, kFarthest_m);
    comparison.rival_share = BoundedAt(path, json, "rival_share", 0.0, kFarthest_m);
    comparison.walls = JsonReader::ReadList<WallDeviation>(path + ": walls", json.at("walls"));
    comparison.openings =
        JsonReader::ReadList<OpeningDeviation>(path + ": openings", json.at("openings"));
    return comparison;
  });
}

}  // namespace slcmap::mapping
