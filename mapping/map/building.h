// A building as planes, storeys, rooms and walls: what mapping/building makes of a map, from what,
// and its files in a map folder. Metres, in the world of the map, z up.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "data/core/polygon.h"
#include "data/core/rigid_transform.h"
#include "data/io/map_line.h"

namespace slcmap::inline mapping {

enum class PlaneKind { kWall, kFloor, kCeiling, kOther };
enum class OpeningKind { kDoor, kWindow, kPassage };

// A region of a wall's plane that was seen through: a door's or a passage's reaches the floor.
struct PlaneOpening {
  OpeningKind kind = OpeningKind::kPassage;
  bool walked = false;  // the trajectory went through it
  double clear_width_m = 0, clear_height_m = 0;
  std::vector<Eigen::Vector3d> outline_world;
};

// A bounded plane normal . p = offset_m; the normal points to where it was seen from.
struct BuildingPlane {
  int64_t id = 0;
  PlaneKind kind = PlaneKind::kOther;
  int64_t storey = 0;
  Eigen::Vector3d normal = Eigen::Vector3d::UnitX();
  double offset_m = 0;
  // Standard deviation of the distance from the plane to the middle of the surface, of which walls
  // that bend have some by themselves.
  double sigma_m = 0;
  std::vector<Eigen::Vector3d> outline_world;
  std::vector<PlaneOpening> openings;
  std::vector<int64_t> room_ids;  // that it bounds
  // Of a wall: nobody saw this side of it, only the other one and the room before it; it stands
  // where its thickness, or that of the building's walls, puts it. Of a floor: hardly anything of
  // it was measured; it is at its storey's height.
  bool inferred = false;
};

struct Storey {
  int64_t id = 0;
  double floor_m = 0;
  std::optional<double> ceiling_m;  // nothing where it was not seen
  std::string name = {};            // as people call it (mapping/map/names.h); "": by its id
};

struct Room {
  int64_t id = 0;
  int64_t storey = 0;
  Polygon polygon;  // between the faces of its walls; corridors may run around holes
  double area_m2 = 0;
  double floor_m = 0;
  std::optional<double> height_m;  // nothing where its ceiling was not seen
  double bounded = 0;              // share of its border on which a wall was measured
  // As MapResult's, of its surfaces, furniture among them; none where little was seen of it.
  std::optional<double> seen_share = {};
  std::string name = {};  // as that of a storey
};

// An opening of a wall in the plan: metres along the wall from its start.
struct PlanOpening {
  OpeningKind kind = OpeningKind::kPassage;
  bool walked = false;
  double from_m = 0, to_m = 0;  // to_m - from_m is the clear width
  double sill_m = 0;            // over the floor of its storey
  double clear_height_m = 0;
  std::string name = {};  // as that of a storey
};

// A wall in the plan: its measured face, seen from which it goes from left to right, and behind it
// its thickness.
struct PlanWall {
  int64_t id = 0;
  int64_t storey = 0;
  Eigen::Vector2d start = Eigen::Vector2d::Zero(), end = Eigen::Vector2d::Zero();
  double thickness_m = 0;
  bool thickness_assumed = false;  // only one face was seen
  double sigma_m = 0;              // of the face's offset
  std::vector<int64_t> plane_ids;  // the face's, then those behind it, inferred ones last
  std::vector<PlanOpening> openings;
  std::optional<double> seen_share = {};  // as MapResult's, of its faces; none of small ones
};

struct Building {
  std::vector<Storey> storeys;        // from the lowest
  std::vector<BuildingPlane> planes;  // ids count from 0, as those of all the others
  std::vector<Room> rooms;
  std::vector<PlanWall> walls;
  // To a frame with x and y along the main heading; z stays.
  RigidTransform T_map_world;
  std::string name = {};  // as that of a storey
};

// What storeys and rooms are called: their names, else "Storey 0" and, for the first, "Room 1".
std::string GetTitle(const Storey& storey);
std::string GetTitle(const Room& room);

// A point on a surface, of a dense cloud or a landmark. Metres, in world.
struct SurfacePoint {
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal_world = Eigen::Vector3d::Zero();  // to the cameras; zero: unknown
  double sigma_m = 0.01;
};

// What one view saw: rays from its centre to points, each with the standard deviation of its
// distance. Floats, as there are many.
struct ViewRays {
  Eigen::Vector3d p_world_camera = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3f> p_world;
  std::vector<float> sigma_m;  // as many
};

struct BuildingInput {
  std::vector<SurfacePoint> points;
  std::vector<MapLine> lines;
  std::vector<ViewRays> rays;
  std::vector<Eigen::Vector3d> trajectory_world;  // places of the rig, in their order
};

// In the order of the enumerations.
inline constexpr std::array<const char*, 4> kPlaneKinds = {"wall", "floor", "ceiling", "other"};
inline constexpr std::array<const char*, 3> kOpeningKinds = {"door", "window", "passage"};

inline const char* GetName(PlaneKind kind) { return kPlaneKinds[static_cast<size_t>(kind)]; }
inline const char* GetName(OpeningKind kind) { return kOpeningKinds[static_cast<size_t>(kind)]; }

// The building in a map folder: planes.json, rooms.json and plan.json. mapping/FORMAT.md
// describes them.

// The names of the files.
std::vector<std::string> BuildingFiles();

// Writes them into a folder that is there. Throws OutputError.
void WriteBuilding(const std::string& folder, const Building& building);

// Reads what WriteBuilding wrote; coordinates come back to a hundredth of a millimetre. Throws
// DataError naming the file and what is wrong in it: a missing key, a value out of its range, an id
// of nothing.
Building ReadBuilding(const std::string& folder);

}  // namespace slcmap::mapping
