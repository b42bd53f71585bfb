#include "tests/export/web/room_map.h"

#include <random>

#include "tests/testing/pinhole_camera.h"

namespace slcmap::testing {
namespace {

using Eigen::Vector3d;

const Vector3d kLow(100, 200, 0), kHigh(104, 205, 2.6);
constexpr int kFirstLineId = 10;

// The corner of the room that takes the upper coordinate where the bit of an axis is set.
Vector3d Corner(int bits) {
  Vector3d corner;
  for (int axis = 0; axis < 3; ++axis) corner[axis] = (bits >> axis & 1 ? kHigh : kLow)[axis];
  return corner;
}

MapLine Line(int64_t id, LineAxis axis, const Vector3d& start, const Vector3d& end) {
  MapLine line;
  line.id = id;
  line.axis = axis;
  line.world = axis == LineAxis::kVertical ? -1 : 0;
  line.sigma_m = 0.003;
  line.observations = 7;
  line.kind = LineKind::kEdge;
  line.start_world = start;
  line.end_world = end;
  return line;
}

// The edges along an axis, the lower ones first.
void AddEdges(int axis, std::vector<MapLine>* lines) {
  for (int bits = 0; bits < 8; ++bits) {
    if (bits >> axis & 1) continue;
    const auto id = kFirstLineId + static_cast<int64_t>(lines->size());
    lines->push_back(Line(id, static_cast<LineAxis>(axis), Corner(bits), Corner(bits | 1 << axis)));
  }
}

class Places {
 public:
  double Share() { return static_cast<double>(generator_()) / generator_.max(); }
  Vector3d InRoom() {
    const Vector3d share(Share(), Share(), Share());
    return kLow + share.cwiseProduct(kHigh - kLow);
  }

 private:
  std::mt19937 generator_;  // unlike the library's distributions, the same everywhere
};

std::vector<MapLine> Lines(int count) {
  std::vector<MapLine> lines;
  for (int axis = 0; axis < 3; ++axis) AddEdges(axis, &lines);
  lines[4].world = 1;
  lines[5].kind = LineKind::kUnknown;
  Places places;
  while (std::ssize(lines) < count) {
    const int axis = static_cast<int>(lines.size() % 3);
    const Vector3d start = places.InRoom();
    const Vector3d end = start + (0.1 + 0.4 * places.Share()) * Vector3d::Unit(axis);
    const auto id = kFirstLineId + static_cast<int64_t>(lines.size());
    lines.push_back(Line(id, static_cast<LineAxis>(axis), start, end));
    lines.back().sigma_m = 0.001 + 0.01 * places.Share();
  }
  return lines;
}

std::vector<DensePoint> Dense(int count) {
  std::vector<DensePoint> points;
  Places places;
  for (int i = 0; i < count; ++i) {
    DensePoint point;
    point.p_world = places.InRoom();
    point.p_world[i % 3] = (i % 2 ? kHigh : kLow)[i % 3];
    point.sigma_m = 0.002 + 0.01 * places.Share();
    point.grey = static_cast<uint8_t>(255 * places.Share());
    points.push_back(point);
  }
  return points;
}

// The rectangle across an axis at the room's lower or upper side, seen from within.
BuildingPlane Side(int64_t id, PlaneKind kind, int axis, bool upper) {
  BuildingPlane plane;
  plane.id = id;
  plane.kind = kind;
  plane.normal = (upper ? -1 : 1) * Vector3d::Unit(axis);
  plane.offset_m = plane.normal[axis] * (upper ? kHigh : kLow)[axis];
  plane.sigma_m = 0.004;
  plane.room_ids = {0};
  const int first = 1 << (axis + 1) % 3, second = 1 << (axis + 2) % 3, own = upper ? 1 << axis : 0;
  for (const int bits : {0, first, first | second, second}) {
    plane.outline_world.push_back(Corner(bits | own));
  }
  return plane;
}

PlaneOpening Door() {
  PlaneOpening door;
  door.kind = OpeningKind::kDoor;
  door.walked = true;
  door.clear_width_m = 0.9;
  door.clear_height_m = 2;
  const double x = kHigh.x(), from = 202, to = 202.9;
  door.outline_world = {{x, from, 0}, {x, to, 0}, {x, to, 2}, {x, from, 2}};
  return door;
}

std::vector<BuildingPlane> Planes(int count) {
  std::vector<BuildingPlane> planes = {Side(0, PlaneKind::kFloor, 2, false),
                                       Side(1, PlaneKind::kCeiling, 2, true)};
  for (int axis = 0; axis < 2; ++axis) {
    for (const bool upper : {false, true}) {
      planes.push_back(Side(std::ssize(planes), PlaneKind::kWall, axis, upper));
    }
  }
  planes[3].openings = {Door()};
  Places places;
  while (std::ssize(planes) < count) {
    BuildingPlane plane = Side(std::ssize(planes), PlaneKind::kOther, 0, false);
    const Vector3d shift = 0.3 * (places.InRoom() - kLow);
    for (Vector3d& point : plane.outline_world) point = kLow + 0.2 * (point - kLow) + shift;
    plane.offset_m = plane.outline_world[0].x();
    planes.push_back(plane);
  }
  return planes;
}

Building MakeBuilding(int planes) {
  Building building;
  building.storeys = {{0, 0, 2.6}};
  building.planes = Planes(planes);
  Room room;
  room.polygon.outline = {Corner(0).head<2>(), Corner(1).head<2>(), Corner(3).head<2>(),
                          Corner(2).head<2>()};
  room.polygon.holes = {{{103.2, 200.5}, {103.7, 200.5}, {103.7, 201}, {103.2, 201}}};
  room.area_m2 = 19.75;
  room.height_m = 2.6;
  room.bounded = 1;
  building.rooms = {room};
  PlanWall wall;
  wall.start = Corner(3).head<2>();  // seen from the room it goes from left to right
  wall.end = Corner(1).head<2>();
  wall.thickness_m = 0.12;
  wall.plane_ids = {3};
  wall.openings = {{OpeningKind::kDoor, true, 2.1, 3, 0, 2}};
  building.walls = {wall};
  return building;
}

}  // namespace

MapResult MakeRoomMap(const RoomMapSize& size) {
  MapResult map;
  map.id = "0123456789abcdef";
  map.method = "slc";
  map.complete = true;
  map.lines = Lines(size.lines);
  map.marks = {Line(5, LineAxis::kX, {101, 200, 1}, {102, 200, 1})};
  map.marks[0].kind = LineKind::kMark;
  map.dense = Dense(size.dense_points);
  map.building = MakeBuilding(size.planes);
  for (int i = 0; i < 4; ++i) {
    map.points.push_back({{101.5 + 0.25 * i, 202.5, 1}, 0.01, 5, {}});
  }
  for (int i = 0; i < 20; ++i) {
    const RigidTransform pose(Eigen::Quaterniond::Identity(), {101 + 0.1 * i, 202.5, 1.2});
    map.trajectory.push_back({i * 100000000, pose});
    if (i % 4 == 0) map.keyframes.push_back(map.trajectory.back());
  }
  map.rectified_rig.cameras.assign(2, testing::PinholeCamera(640, 480, 320, 319.5, 239.5));
  map.occupancy.Mark({{}, {{1030, 2040, 0}}});
  map.occupancy.Finish();
  return map;
}

}  // namespace slcmap::testing
