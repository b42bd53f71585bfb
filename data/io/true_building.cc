#include "data/io/true_building.h"

#include "data/io/json.h"

namespace slcmap::inline data {
namespace {

using Eigen::Vector3d;

constexpr char kFormat[] = "slcmap true building";
constexpr int kVersion = 1;
constexpr double kMaxCoordinate_m = 1e5, kMaxArea_m2 = 1e8;

Json OpeningJson(const TrueOpening& opening) {
  return {{"id", opening.id},
          {"kind", opening.is_door ? "door" : "window"},
          {"is_open", opening.is_open},
          {"is_clear", opening.is_clear},
          {"looked_through", RoundedForJson(opening.looked_through)},
          {"clear_width_m", RoundedForJson(opening.clear_width_m)},
          {"outline", PointsJson(opening.outline_world)}};
}

TrueOpening ParseOpening(const std::string& place, const Json& json) {
  TrueOpening opening;
  opening.id = json.at("id").get<int64_t>();
  opening.is_door = json.at("kind").get<std::string>() == "door";
  opening.is_open = json.at("is_open").get<bool>();
  opening.is_clear = json.value("is_clear", false);  // earlier recordings know of no clear glass
  opening.looked_through = BoundedAt(place, json, "looked_through", 0.0, 1.0);
  opening.clear_width_m = BoundedAt(place, json, "clear_width_m", 0.0, kMaxCoordinate_m);
  opening.outline_world = ParsePoints<Vector3d>(place, json, "outline", 3, kMaxCoordinate_m);
  return opening;
}

Json WallJson(const TrueWall& wall) {
  Json json = {{"id", wall.id},
               {"normal", {wall.normal.x(), wall.normal.y(), wall.normal.z()}},
               {"offset_m", RoundedForJson(wall.offset_m)},
               {"seen_m2", RoundedForJson(wall.seen_m2)},
               {"outline", PointsJson(wall.outline_world)},
               {"seen", PointsJson(wall.seen_world)}};
  json["openings"] = Json::array();
  for (const TrueOpening& opening : wall.openings) json["openings"].push_back(OpeningJson(opening));
  return json;
}

TrueWall ParseWall(const std::string& path, const Json& json) {
  TrueWall wall;
  wall.id = json.at("id").get<int64_t>();
  const std::string place = fmt::format("{}: wall {}", path, wall.id);
  wall.normal = ParsePoint<Vector3d>(place, json.at("normal"), 1.001);
  wall.offset_m = BoundedAt(place, json, "offset_m", -kMaxCoordinate_m, kMaxCoordinate_m);
  wall.seen_m2 = BoundedAt(place, json, "seen_m2", 0.0, kMaxArea_m2);
  wall.outline_world = ParsePoints<Vector3d>(place, json, "outline", 3, kMaxCoordinate_m);
  wall.seen_world = ParsePoints<Vector3d>(place, json, "seen", 0, kMaxCoordinate_m);
  for (const Json& opening : json.at("openings")) {
    wall.openings.push_back(ParseOpening(place, opening));
  }
  return wall;
}

Json RoomJson(const TrueRoom& room) {
  return {{"id", room.id},
          {"area_m2", RoundedForJson(room.area_m2)},
          {"floor_m", RoundedForJson(room.floor_m)},
          {"height_m", RoundedForJson(room.height_m)},
          {"is_entered", room.is_entered},
          {"outline", PointsJson(room.polygon.outline)},
          {"holes", HolesJson(room.polygon)}};
}

TrueRoom ParseRoom(const std::string& path, const Json& json) {
  TrueRoom room;
  room.id = json.at("id").get<int64_t>();
  const std::string place = fmt::format("{}: room {}", path, room.id);
  room.area_m2 = BoundedAt(place, json, "area_m2", 0.0, kMaxArea_m2);
  room.floor_m = BoundedAt(place, json, "floor_m", -kMaxCoordinate_m, kMaxCoordinate_m);
  room.height_m = BoundedAt(place, json, "height_m", 0.0, kMaxCoordinate_m);
  room.is_entered = json.at("is_entered").get<bool>();
  room.polygon = ParsePolygon(place, json, kMaxCoordinate_m);
  return room;
}

}  // namespace

void WriteTrueBuilding(const std::string& path, const TrueBuilding& building) {
  Json json = {{"format", kFormat}, {"version", kVersion}, {"cell_m", building.cell_m}};
  json["walls"] = Json::array();
  json["rooms"] = Json::array();
  for (const TrueWall& wall : building.walls) json["walls"].push_back(WallJson(wall));
  for (const TrueRoom& room : building.rooms) json["rooms"].push_back(RoomJson(room));
  WriteFile(path, json.dump() + "\n");
}

TrueBuilding ReadTrueBuilding(const std::string& path) {
  return ParseJsonFile(path, [&](const Json& json) {
    CheckFormat(path, json, kFormat, kVersion, kVersion);
    TrueBuilding building;
    building.cell_m = BoundedAt(path, json, "cell_m", 1e-3, 10.0);
    for (const Json& wall : json.at("walls")) building.walls.push_back(ParseWall(path, wall));
    for (const Json& room : json.at("rooms")) building.rooms.push_back(ParseRoom(path, room));
    return building;
  });
}

}  // namespace slcmap::data
