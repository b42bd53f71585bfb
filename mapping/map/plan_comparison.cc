#include "mapping/map/plan_comparison.h"

#include <cmath>

#include "data/core/math.h"
#include "data/io/json.h"

namespace slcmap::inline mapping {
namespace {

constexpr char kComparisonFormat[] = "slcmap plan comparison";
constexpr int kComparisonVersion = 1;
constexpr double kFarthest_m = 1e7;
constexpr int64_t kMostPlanned = 100'000'000;

// Millimetres, to a hundredth.
double InMm(double length_m) { return std::round(1e5 * length_m) / 100; }

PlanStatus ParseStatus(const std::string& place, const Json& json) {
  const auto found = json.at("status").get<std::string>();
  for (std::size_t i = 0; i < kPlanStatuses.size(); ++i) {
    if (found == kPlanStatuses[i]) return static_cast<PlanStatus>(i);
  }
  throw DataError(fmt::format("{}: status: found '{}', expected one of: {}", place, found,
                              fmt::join(kPlanStatuses, ", ")));
}

bool WasMeasured(PlanStatus status) {
  return status == PlanStatus::kAsPlanned || status == PlanStatus::kDeviates;
}

Json RowJson(const char* thing, PlanStatus status, int64_t planned, int64_t id,
             const Eigen::Vector2d& start, const Eigen::Vector2d& end) {
  return {{"status", GetName(status)},
          {"planned", planned},
          {thing, id},
          {"start", PointJson(start)},
          {"end", PointJson(end)}};
}

Json WallRow(const WallDeviation& wall) {
  Json json =
      RowJson("plane", wall.status, wall.planned, wall.plane, wall.start_plan, wall.end_plan);
  if (!WasMeasured(wall.status)) return json;
  json["deviation_mm"] = InMm(wall.deviation_m);
  json["sigma_mm"] = InMm(wall.sigma_m);
  json["turn_rad"] = RoundedForJson(wall.turn_rad);
  json["turn_sigma_rad"] = RoundedForJson(wall.turn_sigma_rad);
  return json;
}

Json OpeningRow(const OpeningDeviation& opening) {
  Json json = RowJson("wall", opening.status, opening.planned, opening.wall, opening.start_plan,
                      opening.end_plan);
  if (!WasMeasured(opening.status)) return json;
  json["moved_mm"] = InMm(opening.moved_m);
  json["moved_sigma_mm"] = InMm(opening.moved_sigma_m);
  json["wider_mm"] = InMm(opening.wider_m);
  json["wider_sigma_mm"] = InMm(opening.wider_sigma_m);
  return json;
}

double ParseMm(const std::string& place, const Json& json, const char* key, double least) {
  return 1e-3 * BoundedAt(place, json, key, 1e3 * least, 1e3 * kFarthest_m);
}

template <typename Row>
Row ParseRow(const std::string& place, const Json& json, const char* thing, int64_t Row::*id) {
  Row row;
  row.status = ParseStatus(place, json);
  row.planned = BoundedAt<int64_t>(place, json, "planned", -1, kMostPlanned);
  row.*id = BoundedAt<int64_t>(place, json, thing, -1, kMostPlanned);
  row.start_plan = ParsePoint<Eigen::Vector2d>(place, json.at("start"), kFarthest_m);
  row.end_plan = ParsePoint<Eigen::Vector2d>(place, json.at("end"), kFarthest_m);
  return row;
}

WallDeviation ParseWallRow(const std::string& place, const Json& json) {
  WallDeviation wall = ParseRow(place, json, "plane", &WallDeviation::plane);
  if (!WasMeasured(wall.status)) return wall;
  wall.deviation_m = ParseMm(place, json, "deviation_mm", -kFarthest_m);
  wall.sigma_m = ParseMm(place, json, "sigma_mm", 0);
  wall.turn_rad = BoundedAt(place, json, "turn_rad", -4.0, 4.0);
  wall.turn_sigma_rad = BoundedAt(place, json, "turn_sigma_rad", 0.0, 1e6);
  return wall;
}

OpeningDeviation ParseOpeningRow(const std::string& place, const Json& json) {
  OpeningDeviation opening = ParseRow(place, json, "wall", &OpeningDeviation::wall);
  if (!WasMeasured(opening.status)) return opening;
  opening.moved_m = ParseMm(place, json, "moved_mm", -kFarthest_m);
  opening.moved_sigma_m = ParseMm(place, json, "moved_sigma_mm", 0);
  opening.wider_m = ParseMm(place, json, "wider_mm", -kFarthest_m);
  opening.wider_sigma_m = ParseMm(place, json, "wider_sigma_mm", 0);
  return opening;
}

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
               {"walls", Json::array()},
               {"openings", Json::array()}};
  for (const WallDeviation& wall : comparison.walls) json["walls"].push_back(WallRow(wall));
  for (const OpeningDeviation& opening : comparison.openings) {
    json["openings"].push_back(OpeningRow(opening));
  }
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
    comparison.sigma_m = ParseMm(path, placed, "sigma_mm", 0);
    comparison.yaw_sigma_rad = BoundedAt(path, placed, "turn_sigma_rad", 0.0, 1e6);
    comparison.agreeing_m = BoundedAt(path, json, "agreeing_m", 0.0, kFarthest_m);
    comparison.differing_m = BoundedAt(path, json, "differing_m", 0.0, kFarthest_m);
    comparison.rival_share = BoundedAt(path, json, "rival_share", 0.0, kFarthest_m);
    for (const Json& row : json.at("walls")) {
      const std::string place = fmt::format("{}: wall {}", path, comparison.walls.size());
      comparison.walls.push_back(ParseWallRow(place, row));
    }
    for (const Json& row : json.at("openings")) {
      const std::string place = fmt::format("{}: opening {}", path, comparison.openings.size());
      comparison.openings.push_back(ParseOpeningRow(place, row));
    }
    return comparison;
  });
}

}  // namespace slcmap::mapping
