// What people call buildings, storeys, rooms and doors, by the places where these are: names so
// survive new maps of the same place, whose ids are others.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "mapping/map/map.h"

namespace slcmap::inline mapping {

struct PlaceName {
  std::string name;
  // Metres, as Names has it: of a room or storey a point in it, of a door one in its opening.
  std::optional<Eigen::Vector3d> at;
  std::optional<int64_t> id;       // in this map, where no place is said; of a door its wall's
  std::optional<int64_t> opening;  // of a door with an id: its index among the wall's openings
  std::string place;               // of the file, for messages
};

struct Names {
  // Coordinates are of that reference system, as the map's georeference names it; "": those of a
  // grid without a name, or of poses that were given far from their origin, where the map lies in
  // such, else those of the map's world.
  std::string crs;
  bool of_world = false;  // they are those of the map's world, wherever that lies
  std::vector<PlaceName> buildings, storeys, rooms, doors;
};

// A file of names (YAML; mapping/FORMAT.md). Throws ConfigError for keys that are not known, and
// for entries without a name, or with neither or both of a place and an id.
Names ReadNames(const std::string& path);

// What a building, a storey or a room is called has to be.
bool IsUtf8(const std::string& text);

// Whether a map lies in the names' reference system, if they say one.
bool LiesInSystem(const Names& names, const MapSource& source);

// Gives a map its names; those that it had stay where there are no others. Names of which the map
// has no such place are told, and counted: a file may hold those of a whole site. Of two names of
// one place the first stays. Throws ConfigError where the map does not lie in the names' reference
// system.
int ApplyNames(const Names& names, MapResult* map);

// The names that a building has, at places in its world.
Names CollectNames(const Building& building);

// Adds names of places in one world to those in another.
void AddNames(const Names& names, const RigidTransform& T_all_names, Names* all);

// The file's coordinates of the map's x, y and z, each at 1 m from the origin, and of the origin
// itself: what a page needs to write a file of names. The origin comes last.
std::array<Eigen::Vector3d, 4> FrameOfNames(const MapSource& source);

}  // namespace slcmap::mapping
