#include "mapping/map/names.h"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <Eigen/LU>
#include <algorithm>

#include "data/core/coordinate_system.h"
#include "data/core/error.h"
#include "data/io/yaml.h"

namespace slcmap::inline mapping {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kUnderFloor_m = 0.3;  // that a point in a room may be by mistake
// A door is that whose middle is as near: rooms' other doors are farther away.
constexpr double kNearDoor_m = 0.6;

void CheckEntry(const PlaceName& entry, bool needs_place) {
  if (entry.name.empty()) throw ConfigError(entry.place + ".name: found none, expected a text");
  if (!IsUtf8(entry.name)) {
    throw ConfigError(entry.place +
                      ".name: found bytes that are no UTF-8, expected a text: save "
                      "the file as UTF-8");
  }
  if (entry.at && entry.id) {
    throw ConfigError(entry.place + ": found both at and id, expected one of them");
  }
  if (needs_place && !entry.at && !entry.id) {
    throw ConfigError(entry.place + ": found no place, expected at: [x, y, z] or an id");
  }
}

PlaceName ReadEntry(YamlSection section, const char* id_key) {
  PlaceName entry;
  entry.place = section.place();
  section.Read("name", &entry.name);
  std::vector<double> at;
  section.Read("at", &at);
  if (section.Has("at")) {
    if (at.size() != 3) {
      throw ConfigError(fmt::format("{}.at: found {} numbers, expected 3: x, y and z in metres",
                                    entry.place, at.size()));
    }
    entry.at = Vector3d(at[0], at[1], at[2]);
  }
  const auto read_number = [&](const char* key, std::optional<int64_t>* number) {
    int value = 0;
    section.Read(key, &value);
    if (section.Has(key)) *number = value;
  };
  read_number(id_key, &entry.id);
  if (std::string(id_key) == "wall") read_number("opening", &entry.opening);
  section.Finish();
  return entry;
}

std::vector<PlaceName> ReadList(YamlSection* root, const char* key, const char* id_key,
                                bool needs_place = true) {
  std::vector<PlaceName> entries;
  for (YamlSection& section : root->List(key)) {
    entries.push_back(ReadEntry(section, id_key));
    CheckEntry(entries.back(), needs_place);
  }
  return entries;
}

std::string SystemName(const MapSource& source) {
  return source.georeference ? source.georeference->crs : "";
}

// Where names are in the world of a map, and which of its parts are there.
class NamedPlaces {
 public:
  NamedPlaces(const Names& names, MapResult* map) : building_(map->building) {
    const std::string found = SystemName(map->source);
    if (!LiesInSystem(names, map->source)) {
      throw ConfigError(fmt::format(
          "crs: found {}, expected {}", names.crs,
          found.empty() ? "none: the map was not placed in a reference system" : found));
    }
    if (names.of_world || (names.crs.empty() && !found.empty())) return;
    const std::array<Vector3d, 4> frame = FrameOfNames(map->source);
    origin_ = frame[3];
    for (int i = 0; i < 3; ++i) axes_.col(i) = frame[static_cast<std::size_t>(i)] - origin_;
  }

  std::string* FindBuilding(const PlaceName& entry) {
    const bool is_here = !entry.at || RoomAt(*entry.at) != nullptr;
    return is_here ? &building_.name : nullptr;
  }

  std::string* FindStorey(const PlaceName& entry) {
    if (entry.id) return FindName(*entry.id, &building_.storeys);
    Storey* storey = StoreyAt(InWorld(*entry.at).z());
    const bool is_here = storey != nullptr && RoomAt(*entry.at) != nullptr;
    return is_here ? &storey->name : nullptr;
  }

  std::string* FindRoom(const PlaceName& entry) {
    if (entry.id) return FindName(*entry.id, &building_.rooms);
    Room* room = RoomAt(*entry.at);
    return room != nullptr ? &room->name : nullptr;
  }

  std::string* FindDoor(const PlaceName& entry) {
    if (entry.id) {
      if (*entry.id < 0 || *entry.id >= std::ssize(building_.walls)) return nullptr;
      std::vector<PlanOpening>& openings =
          building_.walls[static_cast<std::size_t>(*entry.id)].openings;
      const int64_t index = entry.opening.value_or(0);
      const bool is_there = index >= 0 && index < std::ssize(openings);
      return is_there ? &openings[static_cast<std::size_t>(index)].name : nullptr;
    }
    return DoorAt(InWorld(*entry.at));
  }

 private:
  Vector3d InWorld(const Vector3d& at) const { return axes_.inverse() * (at - origin_); }

  template <typename Part>
  static std::string* FindName(int64_t id, std::vector<Part>* parts) {
    const auto found = std::ranges::find(*parts, id, &Part::id);
    return found == parts->end() ? nullptr : &found->name;
  }

  // The highest whose floor is not above.
  Storey* StoreyAt(double z_m) {
    Storey* at = nullptr;
    for (Storey& storey : building_.storeys) {
      if (storey.floor_m <= z_m + kUnderFloor_m) at = &storey;
    }
    return at;
  }

  Room* RoomAt(const Vector3d& at) {
    const Vector3d p = InWorld(at);
    const Storey* storey = StoreyAt(p.z());
    if (storey == nullptr) return nullptr;
    for (Room& room : building_.rooms) {
      if (room.storey == storey->id && Contains(room.polygon, Vector2d(p.head<2>()))) return &room;
    }
    return nullptr;
  }

  // The nearest opening of the storey that a place is in.
  std::string* DoorAt(const Vector3d& p) {
    const Storey* storey = StoreyAt(p.z());
    std::string* nearest = nullptr;
    double nearest_m = kNearDoor_m;
    for (PlanWall& wall : building_.walls) {
      if (storey == nullptr || wall.storey != storey->id) continue;
      const Vector2d along = (wall.end - wall.start).normalized();
      for (PlanOpening& opening : wall.openings) {
        const Vector2d middle = wall.start + 0.5 * (opening.from_m + opening.to_m) * along;
        const double off_m = (middle - p.head<2>()).norm();
        if (off_m >= nearest_m) continue;
        nearest_m = off_m;
        nearest = &opening.name;
      }
    }
    return nearest;
  }

  Building& building_;
  Vector3d origin_ = Vector3d::Zero();
  Eigen::Matrix3d axes_ = Eigen::Matrix3d::Identity();
};

// Returns how many names have no place.
template <typename Find>
int NameParts(const std::vector<PlaceName>& entries, const char* what, Find find) {
  int lost = 0;
  std::vector<std::pair<std::string*, const PlaceName*>> named;
  for (const PlaceName& entry : entries) {
    std::string* name = find(entry);
    if (name == nullptr) {
      ++lost;
      spdlog::warn("{}: found no {} there for '{}'; this map goes without that name", entry.place,
                   what, entry.name);
      continue;
    }
    const auto earlier = std::ranges::find(named, name, [](const auto& of) { return of.first; });
    if (earlier != named.end()) {
      if (earlier->second->name == entry.name) continue;
      spdlog::warn("{}: found '{}' for the {} that {} calls '{}', which stays", entry.place,
                   entry.name, what, earlier->second->place, earlier->second->name);
      continue;
    }
    named.emplace_back(name, &entry);
    *name = entry.name;
  }
  return lost;
}

// The middle of the largest of its triangles.
Vector2d PointIn(const Polygon& polygon) {
  double largest_m2 = 0;
  Vector2d point = Vector2d::Zero();
  for (const PlanTriangle& triangle : Triangulate(polygon)) {
    const double area_m2 = SignedArea({triangle[0], triangle[1], triangle[2]});
    if (area_m2 <= largest_m2) continue;
    largest_m2 = area_m2;
    point = (triangle[0] + triangle[1] + triangle[2]) / 3;
  }
  return point;
}

}  // namespace

Names ReadNames(const std::string& path) {
  YamlSection root = YamlSection::FromFile(path);
  Names names;
  root.Read("crs", &names.crs);
  names.buildings = ReadList(&root, "buildings", "id", false);
  names.storeys = ReadList(&root, "storeys", "id");
  names.rooms = ReadList(&root, "rooms", "id");
  names.doors = ReadList(&root, "doors", "wall");
  root.Finish();
  return names;
}

bool IsUtf8(const std::string& text) {
  try {
    Json(text).dump();  // refuses what is none
    return true;
  } catch (const Json::exception&) {
    return false;
  }
}

bool LiesInSystem(const Names& names, const MapSource& source) {
  return names.crs.empty() || NameOfSystem(names.crs) == SystemName(source);
}

int ApplyNames(const Names& names, MapResult* map) {
  NamedPlaces places(names, map);
  const auto name = [&](const std::vector<PlaceName>& entries, const char* what, auto find) {
    return NameParts(entries, what, [&](const PlaceName& entry) { return (places.*find)(entry); });
  };
  return name(names.buildings, "building", &NamedPlaces::FindBuilding) +
         name(names.storeys, "storey", &NamedPlaces::FindStorey) +
         name(names.rooms, "room", &NamedPlaces::FindRoom) +
         name(names.doors, "door", &NamedPlaces::FindDoor);
}

Names CollectNames(const Building& building) {
  constexpr double kOverFloor_m = 1;
  const auto entry = [](const std::string& name, const Vector2d& p, double floor_m) {
    return PlaceName{name, Vector3d(p.x(), p.y(), floor_m + kOverFloor_m), {}, {}, "names"};
  };
  Names names;
  names.of_world = true;
  for (const Room& room : building.rooms) {
    const Storey& storey = building.storeys[static_cast<std::size_t>(room.storey)];
    const Vector2d p = PointIn(room.polygon);
    if (!building.name.empty() && names.buildings.empty()) {
      names.buildings.push_back(entry(building.name, p, storey.floor_m));
    }
    if (!storey.name.empty() &&
        std::ranges::find(names.storeys, storey.name, &PlaceName::name) == names.storeys.end()) {
      names.storeys.push_back(entry(storey.name, p, storey.floor_m));
    }
    if (!room.name.empty()) names.rooms.push_back(entry(room.name, p, storey.floor_m));
  }
  for (const PlanWall& wall : building.walls) {
    const Vector2d along = (wall.end - wall.start).normalized();
    for (const PlanOpening& opening : wall.openings) {
      if (opening.name.empty()) continue;
      const Vector2d middle = wall.start + 0.5 * (opening.from_m + opening.to_m) * along;
      const Storey& storey = building.storeys[static_cast<std::size_t>(wall.storey)];
      names.doors.push_back(entry(opening.name, middle, storey.floor_m));
    }
  }
  return names;
}

void AddNames(const Names& names, const RigidTransform& T_all_names, Names* all) {
  for (const auto list : {&Names::buildings, &Names::storeys, &Names::rooms, &Names::doors}) {
    for (PlaceName name : names.*list) {
      if (name.at) name.at = T_all_names * *name.at;
      (all->*list).push_back(std::move(name));
    }
  }
}

std::array<Vector3d, 4> FrameOfNames(const MapSource& source) {
  std::array<Vector3d, 4> frame = {Vector3d::UnitX(), Vector3d::UnitY(), Vector3d::UnitZ(),
                                   Vector3d::Zero()};
  for (Vector3d& p : frame) {
    p = source.georeference ? *source.georeference * p : p;
  }
  return frame;
}

}  // namespace slcmap::mapping
