#include "mapping/map/building.h"

#include <array>

#include "data/io/json.h"

namespace slcmap::inline mapping {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr char kPlanes[] = "planes.json", kRooms[] = "rooms.json", kPlan[] = "plan.json";
constexpr char kPlanFormat[] = "slcmap plan";
constexpr int kPlanVersion = 1;

// What no building exceeds.
constexpr double kMostLength_m = 1e5, kMostArea_m2 = 1e8, kMostThickness_m = 1e3;
constexpr int64_t kMostId = 100'000'000;

template <typename Kind, size_t N>
Kind ParseKind(const std::string& place, const Json& json,
               const std::array<const char*, N>& names) {
  const auto found = json.at("kind").get<std::string>();
  std::string all;
  for (size_t i = 0; i < N; ++i) {
    if (found == names[i]) return static_cast<Kind>(i);
    all += (i == 0 ? "" : ", ") + std::string(names[i]);
  }
  throw DataError(fmt::format("{}: kind: found '{}', expected one of: {}", place, found, all));
}

int64_t ParseId(const std::string& place, const Json& json, const char* key) {
  return BoundedAt<int64_t>(place, json, key, 0, kMostId);
}

double ParseLength(const std::string& place, const Json& json, const char* key) {
  return BoundedAt(place, json, key, 0.0, kMostLength_m);
}

double ParsePlace(const std::string& place, const Json& json, const char* key) {
  return BoundedAt(place, json, key, -kMostLength_m, kMostLength_m);
}

Json OptionalJson(const std::optional<double>& value) {
  return value ? Json(RoundedForJson(*value)) : Json();
}

std::optional<double> ParseOptional(const std::string& place, const Json& json, const char* key) {
  if (json.at(key).is_null()) return std::nullopt;
  return ParsePlace(place, json, key);
}

// Only those that have one, so that maps without names are as they were.
void AddName(const std::string& name, Json* json) {
  if (!name.empty()) (*json)["name"] = name;
}

std::string ParseName(const Json& json) { return json.value("name", std::string()); }

Json OpeningJson(const PlaneOpening& opening) {
  return {{"kind", GetName(opening.kind)},
          {"walked", opening.walked},
          {"clear_width_m", RoundedForJson(opening.clear_width_m)},
          {"clear_height_m", RoundedForJson(opening.clear_height_m)},
          {"outline", PointsJson(opening.outline_world)}};
}

PlaneOpening ParseOpening(const std::string& place, const Json& json) {
  PlaneOpening opening;
  opening.kind = ParseKind<OpeningKind>(place, json, kOpeningKinds);
  opening.walked = json.at("walked").get<bool>();
  opening.clear_width_m = ParseLength(place, json, "clear_width_m");
  opening.clear_height_m = ParseLength(place, json, "clear_height_m");
  opening.outline_world = ParsePoints<Vector3d>(place, json, "outline", 3, kMostLength_m);
  return opening;
}

Json PlaneJson(const BuildingPlane& plane) {
  Json openings = Json::array();
  for (const PlaneOpening& opening : plane.openings) openings.push_back(OpeningJson(opening));
  return {{"id", plane.id},
          {"kind", GetName(plane.kind)},
          {"storey", plane.storey},
          {"normal", {plane.normal.x(), plane.normal.y(), plane.normal.z()}},
          {"offset_m", RoundedForJson(plane.offset_m)},
          {"sigma_m", RoundedForJson(plane.sigma_m)},
          {"outline", PointsJson(plane.outline_world)},
          {"openings", openings},
          {"room_ids", plane.room_ids},
          {"inferred", plane.inferred}};
}

Vector3d ParseNormal(const std::string& place, const Json& json) {
  constexpr double kSlack = 1e-3;
  const Vector3d normal = ParsePoint<Vector3d>(place, json.at("normal"), 1 + kSlack);
  if (std::abs(normal.norm() - 1) <= kSlack) return normal;
  throw DataError(
      fmt::format("{}: normal: found a length of {}, expected 1", place, normal.norm()));
}

BuildingPlane ParsePlane(const std::string& path, const Json& json) {
  BuildingPlane plane;
  plane.id = ParseId(path, json, "id");
  const std::string place = fmt::format("{}: plane {}", path, plane.id);
  plane.kind = ParseKind<PlaneKind>(place, json, kPlaneKinds);
  plane.storey = ParseId(place, json, "storey");
  plane.normal = ParseNormal(place, json);
  plane.offset_m = ParsePlace(place, json, "offset_m");
  plane.sigma_m = ParseLength(place, json, "sigma_m");
  plane.outline_world = ParsePoints<Vector3d>(place, json, "outline", 3, kMostLength_m);
  for (const Json& opening : json.at("openings")) {
    plane.openings.push_back(ParseOpening(place, opening));
  }
  plane.room_ids = json.at("room_ids").get<std::vector<int64_t>>();
  plane.inferred = json.at("inferred").get<bool>();
  return plane;
}

Json RoomJson(const Room& room) {
  Json json = {{"id", room.id},
               {"storey", room.storey},
               {"area_m2", RoundedForJson(room.area_m2)},
               {"floor_m", RoundedForJson(room.floor_m)},
               {"height_m", OptionalJson(room.height_m)},
               {"bounded", RoundedForJson(room.bounded)},
               {"outline", PointsJson(room.polygon.outline)},
               {"holes", HolesJson(room.polygon)}};
  AddName(room.name, &json);
  return json;
}

Room ParseRoom(const std::string& path, const Json& json) {
  Room room;
  room.id = ParseId(path, json, "id");
  const std::string place = fmt::format("{}: room {}", path, room.id);
  room.storey = ParseId(place, json, "storey");
  room.area_m2 = BoundedAt(place, json, "area_m2", 0.0, kMostArea_m2);
  room.floor_m = ParsePlace(place, json, "floor_m");
  room.height_m = ParseOptional(place, json, "height_m");
  room.bounded = BoundedAt(place, json, "bounded", 0.0, 1.0);
  room.polygon = ParsePolygon(place, json, kMostLength_m);
  room.name = ParseName(json);
  return room;
}

Json PlanOpeningJson(const PlanOpening& opening) {
  Json json = {{"kind", GetName(opening.kind)},
               {"walked", opening.walked},
               {"from_m", RoundedForJson(opening.from_m)},
               {"to_m", RoundedForJson(opening.to_m)},
               {"clear_width_m", RoundedForJson(opening.to_m - opening.from_m)},
               {"sill_m", RoundedForJson(opening.sill_m)},
               {"clear_height_m", RoundedForJson(opening.clear_height_m)}};
  AddName(opening.name, &json);
  return json;
}

PlanOpening ParsePlanOpening(const std::string& place, const Json& json) {
  PlanOpening opening;
  opening.kind = ParseKind<OpeningKind>(place, json, kOpeningKinds);
  opening.walked = json.at("walked").get<bool>();
  opening.from_m = ParsePlace(place, json, "from_m");
  opening.to_m = BoundedAt(place, json, "to_m", opening.from_m, kMostLength_m);
  opening.sill_m = ParseLength(place, json, "sill_m");
  opening.clear_height_m = ParseLength(place, json, "clear_height_m");
  opening.name = ParseName(json);
  return opening;
}

Json WallJson(const PlanWall& wall) {
  Json openings = Json::array();
  for (const PlanOpening& opening : wall.openings) openings.push_back(PlanOpeningJson(opening));
  return {{"id", wall.id},
          {"storey", wall.storey},
          {"start", PointJson(wall.start)},
          {"end", PointJson(wall.end)},
          {"thickness_m", RoundedForJson(wall.thickness_m)},
          {"thickness_assumed", wall.thickness_assumed},
          {"sigma_m", RoundedForJson(wall.sigma_m)},
          {"plane_ids", wall.plane_ids},
          {"openings", openings}};
}

PlanWall ParseWall(const std::string& path, const Json& json) {
  PlanWall wall;
  wall.id = ParseId(path, json, "id");
  const std::string place = fmt::format("{}: wall {}", path, wall.id);
  wall.storey = ParseId(place, json, "storey");
  wall.start = ParsePoint<Vector2d>(place, json.at("start"), kMostLength_m);
  wall.end = ParsePoint<Vector2d>(place, json.at("end"), kMostLength_m);
  wall.thickness_m = BoundedAt(place, json, "thickness_m", 0.0, kMostThickness_m);
  wall.thickness_assumed = json.at("thickness_assumed").get<bool>();
  wall.sigma_m = ParseLength(place, json, "sigma_m");
  wall.plane_ids = json.at("plane_ids").get<std::vector<int64_t>>();
  for (const Json& opening : json.at("openings")) {
    wall.openings.push_back(ParsePlanOpening(place, opening));
  }
  return wall;
}

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
  AddName(building.name, &json);
  json["storeys"] = Json::array();
  for (const Storey& storey : building.storeys) {
    Json rooms = Json::array();
    for (const Room& room : building.rooms) {
      if (room.storey != storey.id) continue;
      rooms.push_back({{"id", room.id},
                       {"area_m2", RoundedForJson(room.area_m2)},
                       {"height_m", OptionalJson(room.height_m)}});
    }
    json["storeys"].push_back({{"id", storey.id},
                               {"floor_m", RoundedForJson(storey.floor_m)},
                               {"ceiling_m", OptionalJson(storey.ceiling_m)},
                               {"rooms", rooms}});
    AddName(storey.name, &json["storeys"].back());
  }
  json["walls"] = Json::array();
  for (const PlanWall& wall : building.walls) json["walls"].push_back(WallJson(wall));
  return json;
}

void ParsePlan(const std::string& path, const Json& json, Building* building) {
  CheckFormat(path, json, kPlanFormat, kPlanVersion, kPlanVersion);
  building->name = ParseName(json);
  const Json& frame = json.at("map_from_world");
  const double turn_rad = BoundedAt(path, frame, "turn_rad", -M_PI, M_PI);
  building->T_map_world.rotation = Eigen::AngleAxisd(turn_rad, Vector3d::UnitZ());
  building->T_map_world.translation =
      ParsePoint<Vector3d>(path, frame.at("translation_m"), kMostLength_m);
  for (const Json& storey : json.at("storeys")) {
    building->storeys.push_back({ParseId(path, storey, "id"), ParsePlace(path, storey, "floor_m"),
                                 ParseOptional(path, storey, "ceiling_m"), ParseName(storey)});
  }
  for (const Json& wall : json.at("walls")) building->walls.push_back(ParseWall(path, wall));
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
  Json planes = Json::array(), rooms = Json::array();
  for (const BuildingPlane& plane : building.planes) planes.push_back(PlaneJson(plane));
  for (const Room& room : building.rooms) rooms.push_back(RoomJson(room));
  WriteJsonFile(folder + "/" + kPlanes, planes);
  WriteJsonFile(folder + "/" + kRooms, rooms);
  WriteJsonFile(folder + "/" + kPlan, PlanJson(building));
}

Building ReadBuilding(const std::string& folder) {
  const std::string planes = folder + "/" + kPlanes, rooms = folder + "/" + kRooms,
                    plan = folder + "/" + kPlan;
  Building building;
  ParseJsonFile(planes, [&](const Json& json) {
    for (const Json& plane : json) building.planes.push_back(ParsePlane(planes, plane));
    return 0;
  });
  ParseJsonFile(rooms, [&](const Json& json) {
    for (const Json& room : json) building.rooms.push_back(ParseRoom(rooms, room));
    return 0;
  });
  ParseJsonFile(plan, [&](const Json& json) {
    ParsePlan(plan, json, &building);
    return 0;
  });
  CheckBuilding(folder, building);
  return building;
}

}  // namespace slcmap::mapping
