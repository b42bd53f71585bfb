#include "data/io/true_building.h"

#include <array>

#include "data/io/json_fields.h"

namespace slcmap::inline data {
namespace {

constexpr char kFormat[] = "slcmap true building";
constexpr int kVersion = 1;
constexpr double kMostLength_m = 1e5, kMostArea_m2 = 1e8;

}  // namespace

template <typename Fields>
void Describe(Fields& fields, Of<TrueOpening> auto& opening) {
  constexpr std::array<const char*, 2> kKinds = {"window", "door"};
  fields.Value("id", opening.id);
  fields.Named("kind", opening.is_door, kKinds);
  fields.Value("is_open", opening.is_open);
  fields.Said("is_clear", opening.is_clear);  // earlier recordings know of no clear glass
  fields.Number("looked_through", opening.looked_through, 0, 1);
  fields.Number("clear_width_m", opening.clear_width_m, 0, kMostLength_m);
  fields.Points("outline", opening.outline_world, 3, kMostLength_m);
}

template <typename Fields>
void Describe(Fields& fields, Of<TrueWall> auto& wall) {
  fields.Value("id", wall.id);
  fields.Place("wall", wall.id);
  fields.Unit("normal", wall.normal, 1e-3);
  fields.Number("offset_m", wall.offset_m, -kMostLength_m, kMostLength_m);
  fields.Number("seen_m2", wall.seen_m2, 0, kMostArea_m2);
  fields.Points("outline", wall.outline_world, 3, kMostLength_m);
  fields.Points("seen", wall.seen_world, 0, kMostLength_m);
  fields.List("openings", wall.openings);
}

template <typename Fields>
void Describe(Fields& fields, Of<TrueRoom> auto& room) {
  fields.Value("id", room.id);
  fields.Place("room", room.id);
  fields.Number("area_m2", room.area_m2, 0, kMostArea_m2);
  fields.Number("floor_m", room.floor_m, -kMostLength_m, kMostLength_m);
  fields.Number("height_m", room.height_m, 0, kMostLength_m);
  fields.Value("is_entered", room.is_entered);
  fields.Outline(room.polygon, kMostLength_m);
}

template <typename Fields>
void Describe(Fields& fields, Of<TrueBuilding> auto& building) {
  fields.Number("cell_m", building.cell_m, 1e-3, 10, kExact);
  fields.List("walls", building.walls);
  fields.List("rooms", building.rooms);
}

void WriteTrueBuilding(const std::string& path, const TrueBuilding& building) {
  Json json = {{"format", kFormat}, {"version", kVersion}};
  json.update(JsonWriter::Write(building));
  WriteFile(path, json.dump() + "\n");
}

TrueBuilding ReadTrueBuilding(const std::string& path) {
  return ParseJsonFile(path, [&](const Json& json) {
    CheckFormat(path, json, kFormat, kVersion, kVersion);
    return JsonReader::Read<TrueBuilding>(path, json);
  });
}

}  // namespace slcmap::data
