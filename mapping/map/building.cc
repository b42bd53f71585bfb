#include "mapping/map/building.h"

#include "data/io/json.h"
#include "data/io/json_fields.h"

namespace slcmap::inline mapping {
namespace {

using Eigen::Vector3d;

constexpr char kPlanes[] = "planes.json", kRooms[] = "rooms.json", kPlan[] = "plan.json";
constexpr char kPlanFormat[] = "slcmap plan";
constexpr int kPlanVersion = 1;

// What no building exceeds.
constexpr double kMostLength_m = 1e5, kMostArea_m2 = 1e8, kMostThickness_m = 1e3;
constexpr int64_t kMostId = 100'000'000;

}  // namespace

template <typename Fields>
void Describe(Fields& fields, Of<PlaneOpening> auto& opening) {
  fields.Named("kind", opening.kind, kOpeningKinds);
  fields.Value("walked", opening.walked);
  fields.Number("clear_width_m", opening.clear_width_m, 0, kMostLength_m);
  fields.Number("clear_height_m", opening.clear_height_m, 0, kMostLength_m);
  fields.Points("outline", opening.outline_world, 3, kMostLength_m);
}

template <typename Fields>
void Describe(Fields& fields, Of<BuildingPlane> auto& plane) {
  constexpr double kSlack = 1e-3;
  fields.Integer("id", plane.id, 0, kMostId);
  fields.Place("plane", plane.id);
  fields.Named("kind", plane.kind, kPlaneKinds);
  fields.Integer("storey", plane.storey, 0, kMostId);
  fields.Unit("normal", plane.normal, kSlack);
  fields.Number("offset_m", plane.offset_m, -kMostLength_m, kMostLength_m);
  fields.Number("sigma_m", plane.sigma_m, 0, kMostLength_m);
  fields.Points("outline", plane.outline_world, 3, kMostLength_m);
  fields.List("openings", plane.openings);
  fields.Value("room_ids", plane.room_ids);
  fields.Value("inferred", plane.inferred);
}

template <typename Fields>
void Describe(Fields& fields, Of<Room> auto& room) {
  fields.Integer("id", room.id, 0, kMostId);
  fields.Place("room", room.id);
  fields.Integer("storey", room.storey, 0, kMostId);
  fields.Number("area_m2", room.area_m2, 0, kMostArea_m2);
  fields.Number("floor_m", room.floor_m, -kMostLength_m, kMostLength_m);
  fields.Optional("height_m", room.height_m, -kMostLength_m, kMostLength_m);
  fields.Number("bounded", room.bounded, 0, 1);
  fields.Outline(room.polygon, kMostLength_m);
  fields.Said("name", room.name);  // maps without names are as they were
}

template <typename Fields>
void Describe(Fields& fields, Of<PlanOpening> auto& opening) {
  fields.Named("kind", opening.kind, kOpeningKinds);
  fields.Value("walked", opening.walked);
  fields.Number("from_m", opening.from_m, -kMostLength_m, kMostLength_m);
  fields.Number("to_m", opening.to_m, opening.from_m, kMostLength_m);
  fields.Derived("clear_width_m", opening.to_m - opening.from_m);
  fields.Number("sill_m", opening.sill_m, 0, kMostLength_m);
  fields.Number("clear_height_m", opening.clear_height_m, 0, kMostLength_m);
  fields.Said("name", opening.name);
}

template <typename Fields>
void Describe(Fields& fields, Of<PlanWall> auto& wall) {
  fields.Integer("id", wall.id, 0, kMostId);
  fields.Place("wall", wall.id);
  fields.Integer("storey", wall.storey, 0, kMostId);
  fields.Point("start", wall.start, kMostLength_m);
  fields.Point("end", wall.end, kMostLength_m);
  fields.Number("thickness_m", wall.thickness_m, 0, kMostThickness_m);
  fields.Value("thickness_assumed", wall.thickness_assumed);
  fields.Number("sigma_m", wall.sigma_m, 0, kMostLength_m);
  fields.Value("plane_ids", wall.plane_ids);
  fields.List("openings", wall.openings);
}

// Its rooms are told again beside it.
template <typename Fields>
void Describe(Fields& fields, Of<Storey> auto& storey) {
  fields.Integer("id", storey.id, 0, kMostId);
  fields.Number("floor_m", storey.floor_m, -kMostLength_m, kMostLength_m);
  fields.Optional("ceiling_m", storey.ceiling_m, -kMostLength_m, kMostLength_m);
}

namespace {

// The heading is all that a map's frame differs in.
double GetHeading(const RigidTransform& T_map_world) {
  const Vector3d x = T_map_world.rotation * Vector3d::UnitX();
  return std::atan2(x.y(), x.x());
}

Json PlanJson(const Building& building) {
  Json json = {{"format", kPlanFormat},
               {"version", kPlanVersion},
               {"map_from_world",
                {{"turn_rad", GetHeading(building.T_map_world)},
                 {"translation_m", PointJson(building.T_map_world.translation)}}}};
  if (!building.name.empty()) json["name"] = building.name;
  json["storeys"] = JsonWriter::WriteList(building.storeys);
  for (size_t i = 0; i < building.storeys.size(); ++i) {
    Json& storey = json["storeys"][i];
    storey["rooms"] = Json::array();
    for (const Room& room : building.rooms) {
      if (room.storey != building.storeys[i].id) continue;
      JsonWriter fields;
      fields.Integer("id", room.id, 0, 0);
      fields.Derived("area_m2", room.area_m2);
      fields.Optional("height_m", room.height_m, 0, 0);
      storey["rooms"].push_back(fields.json);
    }
    if (!building.storeys[i].name.empty()) storey["name"] = building.storeys[i].name;
  }
  json["walls"] = JsonWriter::WriteList(building.walls);
  return json;
}

void ParsePlan(const std::string& path, const Json& json, Building* building) {
  CheckFormat(path, json, kPlanFormat, kPlanVersion, kPlanVersion);
  building->name = json.value("name", "");
  const Json& frame = json.at("map_from_world");
  const double turn_rad = BoundedAt(path, frame, "turn_rad", -M_PI, M_PI);
  building->T_map_world.rotation = Eigen::AngleAxisd(turn_rad, Vector3d::UnitZ());
  building->T_map_world.translation =
      ParsePoint<Vector3d>(path, frame.at("translation_m"), kMostLength_m);
  building->storeys = JsonReader::ReadList<Storey>(path, json.at("storeys"));
  for (size_t i = 0; i < building->storeys.size(); ++i) {
    building->storeys[i].name = json.at("storeys")[i].value("name", "");
  }
  building->walls = JsonReader::ReadList<PlanWall>(path, json.at("walls"));
}

// Ids count from 0: each thing's is its place in its list.
template <typename Thing>
void CheckIds(const std::string& path, const char* what, const std::vector<Thing>& things) {
  for (size_t i = 0; i < things.size(); ++i) {
    if (things[i].id == static_cast<int64_t>(i)) continue;
    throw DataError(fmt::format("{}: found {} {} at place {}, expected ids to count from 0", path,
                                what, things[i].id, i));
  }
}

void CheckReference(const std::string& path, const char* what, int64_t id, size_t count) {
  if (id >= 0 && id < static_cast<int64_t>(count)) return;
  throw DataError(
      fmt::format("{}: found a reference to {} {}, expected one of the {} that there are", path,
                  what, id, count));
}

void CheckBuilding(const std::string& folder, const Building& building) {
  const std::string planes = folder + "/" + kPlanes, rooms = folder + "/" + kRooms,
                    plan = folder + "/" + kPlan;
  CheckIds(planes, "plane", building.planes);
  CheckIds(rooms, "room", building.rooms);
  CheckIds(plan, "storey", building.storeys);
  CheckIds(plan, "wall", building.walls);
  for (const BuildingPlane& plane : building.planes) {
    CheckReference(planes, "storey", plane.storey, building.storeys.size());
    for (const int64_t id : plane.room_ids) {
      CheckReference(planes, "room", id, building.rooms.size());
    }
  }
  for (const Room& room : building.rooms) {
    CheckReference(rooms, "storey", room.storey, building.storeys.size());
  }
  for (const PlanWall& wall : building.walls) {
    CheckReference(plan, "storey", wall.storey, building.storeys.size());
    for (const int64_t id : wall.plane_ids) {
      CheckReference(plan, "plane", id, building.planes.size());
    }
  }
}

}  // namespace

std::string GetTitle(const Storey& storey) {
  return storey.name.empty() ? fmt::format("Storey {}", storey.id) : storey.name;
}

std::string GetTitle(const Room& room) {
  return room.name.empty() ? fmt::format("Room {}", room.id + 1) : room.name;
}

std::vector<std::string> BuildingFiles() { return {kPlanes, kRooms, kPlan}; }

void WriteBuilding(const std::string& folder, const Building& building) {
  WriteJsonFile(folder + "/" + kPlanes, JsonWriter::WriteList(building.planes));
  WriteJsonFile(folder + "/" + kRooms, JsonWriter::WriteList(building.rooms));
  WriteJsonFile(folder + "/" + kPlan, PlanJson(building));
}

Building ReadBuilding(const std::string& folder) {
  const std::string planes = folder + "/" + kPlanes, rooms = folder + "/" + kRooms,
                    plan = folder + "/" + kPlan;
  Building building;
  building.planes = ParseJsonFile(
      planes, [&](const Json& json) { return JsonReader::ReadList<BuildingPlane>(planes, json); });
  building.rooms = ParseJsonFile(
      rooms, [&](const Json& json) { return JsonReader::ReadList<Room>(rooms, json); });
  ParseJsonFile(plan, [&](const Json& json) {
    ParsePlan(plan, json, &building);
    return 0;
  });
  CheckBuilding(folder, building);
  return building;
}

}  // namespace slcmap::mapping
