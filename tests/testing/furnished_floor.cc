#include "tests/testing/furnished_floor.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "data/simulator/scene/scene_builder.h"
#include "tests/testing/scene_scanner.h"

namespace slcmap::testing {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kEye_m = 1.5, kHeight_m = 2.8, kPi = std::numbers::pi;

struct FloorDoor {
  double at_m = 0, width_m = 1, open_deg = 90;
};

// From one place to the next, its front to the left, its back to the right.
struct FloorWall {
  std::vector<Vector2d> points;
  double thickness_m = 0.12;
  bool is_closed = false;                             // around the floor, without a back
  std::vector<std::pair<int, FloorDoor>> doors = {};  // by segment
  std::string more = {};                              // keys
};

// A room is walked along its spine, and around its corners.
struct FloorRoom {
  std::vector<Vector2d> spine, round;
};

struct Passage {
  int from = 0, to = 0;
  Vector2d at = Vector2d::Zero(), way = Vector2d::Zero();
};

Vector2d Left(const Vector2d& way) { return {-way.y(), way.x()}; }

class FloorMaker {
 public:
  explicit FloorMaker(int seed) : random_(static_cast<uint32_t>(seed)) {}

  double Pick(double least, double most) { return UniformIn(least, most, &random_); }

  int AddRoom(const FloorRoom& room) {
    rooms_.push_back(room);
    return static_cast<int>(rooms_.size()) - 1;
  }
  // Between opposite corners; walked along the middle.
  int AddBox(const Vector2d& low, const Vector2d& high,
             const Eigen::Isometry2d& T = Eigen::Isometry2d::Identity()) {
    const double in_m = std::min(1.0, 0.3 * (high - low).minCoeff());
    const Vector2d a = low + Vector2d(in_m, in_m), b = high - Vector2d(in_m, in_m);
    const Vector2d middle = 0.5 * (a + b);
    return AddRoom(
        {{T * middle}, {T * a, T * Vector2d(b.x(), a.y()), T * b, T * Vector2d(a.x(), b.y())}});
  }

  int AddWall(const FloorWall& wall) {
    walls_.push_back(wall);
    return static_cast<int>(walls_.size()) - 1;
  }

  // A door in a wall at that place along its segment, between two rooms; closed ones are not
  // walked.
  void AddDoor(int wall, int segment, const FloorDoor& door, int from, int to) {
    FloorWall& in = walls_[wall];
    in.doors.emplace_back(segment, door);
    const Vector2d a = in.points[segment], b = in.points[segment + 1];
    const Vector2d along = (b - a).normalized();
    const Vector2d at =
        a + (door.at_m + 0.5 * door.width_m) * along - 0.5 * in.thickness_m * Left(along);
    if (door.open_deg > 20) passages_.push_back({from, to, at, Left(along)});
  }
  FloorDoor MakeDoor(double at_m, double closed_share = 0.15) {
    return {at_m, Pick(0.85, 1.05), Pick(0, 1) < closed_share ? 0 : Pick(75, 105)};
  }

  void Add(const std::string& object) { objects_ += "  - " + object + "\n"; }
  void AddColumn(const Vector2d& at, double side_m) {
    Add(fmt::format("{{kind: box, at: [{:.3f}, {:.3f}, 0], size: [{:.3f}, {:.3f}, {}]}}", at.x(),
                    at.y(), side_m, side_m, kHeight_m));
  }
  void AddPartition(const Vector2d& a, const Vector2d& b, double height_m) {
    const Vector2d middle = 0.5 * (a + b), way = b - a;
    Add(fmt::format(
        "{{kind: box, at: [{:.3f}, {:.3f}, 0], size: [{:.3f}, 0.06, {:.3f}], yaw_deg: {:.3f}}}",
        middle.x(), middle.y(), way.norm(), height_m, std::atan2(way.y(), way.x()) * 180 / kPi));
  }

  FurnishedFloor Finish() {
    std::vector<bool> was_in(rooms_.size(), false);
    WalkRoom(0, &was_in);
    for (const FloorWall& wall : walls_) WriteWall(wall);
    WriteSlabs();
    for (const FloorWall& wall : walls_) {
      if (!wall.more.empty()) continue;  // windows
      const size_t n = wall.points.size();
      for (size_t i = 0; i + 1 < n + (wall.is_closed ? 1 : 0); ++i) {
        const Vector2d a = wall.points[i], b = wall.points[(i + 1) % n];
        std::vector<FloorDoor> doors;
        for (const auto& [segment, door] : wall.doors) {
          if (segment == static_cast<int>(i)) doors.push_back(door);
        }
        Furnish(a, b, doors);
        if (wall.is_closed) continue;
        const Vector2d behind = wall.thickness_m * Left((b - a).normalized());
        for (FloorDoor& door : doors) door.at_m = (b - a).norm() - door.at_m - door.width_m;
        Furnish(b - behind, a - behind, doors);
      }
    }
    FurnishedFloor floor{"name: floor\nobjects:\n" + objects_, {}};
    std::vector<Vector3d> corners;
    for (const Vector2d& p : walk_) corners.emplace_back(p.x(), p.y(), kEye_m);
    floor.places = PlacesAlong(corners, 0.3);
    return floor;
  }

 private:
  void GoTo(const Vector2d& place) {
    if (walk_.empty() || (walk_.back() - place).norm() > 0.05) walk_.push_back(place);
  }

  // The nearest place of a spine, and how far along it.
  static std::pair<double, Vector2d> OnSpine(const std::vector<Vector2d>& spine,
                                             const Vector2d& p) {
    std::pair<double, Vector2d> best{0, spine.front()};
    double along_m = 0;
    for (size_t i = 0; i + 1 < spine.size(); ++i) {
      const Vector2d way = spine[i + 1] - spine[i];
      const double share = std::clamp((p - spine[i]).dot(way) / way.squaredNorm(), 0.0, 1.0);
      const Vector2d at = spine[i] + share * way;
      if ((at - p).norm() < (best.second - p).norm()) best = {along_m + share * way.norm(), at};
      along_m += way.norm();
    }
    return best;
  }

  void GoAlong(const std::vector<Vector2d>& spine, const Vector2d& to) {
    const auto [from_m, from] = OnSpine(spine, walk_.empty() ? spine.front() : walk_.back());
    const auto [to_m, at] = OnSpine(spine, to);
    GoTo(from);
    std::vector<std::pair<double, Vector2d>> between;
    for (const Vector2d& p : spine) {
      const double along_m = OnSpine(spine, p).first;
      if ((along_m - from_m) * (along_m - to_m) < 0) between.emplace_back(along_m, p);
    }
    if (to_m < from_m) std::reverse(between.begin(), between.end());
    for (const auto& [along_m, p] : between) GoTo(p);
    GoTo(at);
    GoTo(to);
  }

  void WalkRoom(int index, std::vector<bool>* was_in) {
    (*was_in)[index] = true;
    const FloorRoom& room = rooms_[index];
    const Vector2d entered = walk_.empty() ? room.spine.front() : walk_.back();
    if (!room.round.empty()) {
      GoAlong(room.spine, room.round.front());
      for (const Vector2d& p : room.round) GoTo(p);
      GoTo(room.round.front());
    }
    std::vector<Passage> out;
    for (Passage passage : passages_) {
      if (passage.to == index) {
        std::swap(passage.from, passage.to);
        passage.way = -passage.way;
      }
      if (passage.from == index) out.push_back(passage);
    }
    std::sort(out.begin(), out.end(), [&](const Passage& a, const Passage& b) {
      return OnSpine(room.spine, a.at).first < OnSpine(room.spine, b.at).first;
    });
    if (room.round.empty()) GoAlong(room.spine, room.spine.front());
    for (const Passage& passage : out) {
      if ((*was_in)[passage.to]) continue;
      const Vector2d from = SideOf(passage, room), to = SideOf(passage, rooms_[passage.to]);
      GoAlong(room.spine, from);
      GoTo(to);
      WalkRoom(passage.to, was_in);
      GoAlong(rooms_[passage.to].spine, to);
      GoTo(from);
    }
    if (room.round.empty()) GoAlong(room.spine, room.spine.back());
    GoAlong(room.spine, entered);
  }

  // Before a door, on the side of a room.
  static Vector2d SideOf(const Passage& passage, const FloorRoom& room) {
    constexpr double kBefore_m = 0.6;
    const Vector2d to_room = OnSpine(room.spine, passage.at).second - passage.at;
    return passage.at + (to_room.dot(passage.way) > 0 ? kBefore_m : -kBefore_m) * passage.way;
  }

  void WriteWall(const FloorWall& wall) {
    std::string points, doors;
    for (const Vector2d& p : wall.points) points += fmt::format("[{:.4f}, {:.4f}], ", p.x(), p.y());
    for (const auto& [segment, door] : wall.doors) {
      doors += fmt::format("[{}, {:.3f}, {:.3f}, 2.1, {:.1f}], ", segment, door.at_m, door.width_m,
                           door.open_deg);
    }
    Add(fmt::format(
        "{{kind: wall, points: [{}], {}: true, height: {}, thickness: {:.3f}, skirting_height: "
        "0.09{}{}}}",
        points.substr(0, points.size() - 2), wall.is_closed ? "closed" : "has_back", kHeight_m,
        wall.thickness_m,
        doors.empty() ? "" : ", doors: [" + doors.substr(0, doors.size() - 2) + "]", wall.more));
  }

  void WriteSlabs() {
    Eigen::AlignedBox2d box;
    for (const FloorWall& wall : walls_) {
      for (const Vector2d& p : wall.points) box.extend(p);
    }
    for (const char* rest :
         {"0], size: [{:.3f}, {:.3f}], material: carpet}}",
          "2.8], size: [{:.3f}, {:.3f}], material: ceiling, faces_down: true}}"}) {
      Add(fmt::format("{{kind: slab, at: [{:.3f}, {:.3f}, ", box.min().x(), box.min().y()) +
          fmt::format(fmt::runtime(rest), box.sizes().x(), box.sizes().y()));
    }
  }

  double DistanceToWalk(const Vector2d& middle, const Vector2d& along, const Vector2d& half) const {
    double least_m = 1e9;
    for (size_t i = 0; i + 1 < walk_.size(); ++i) {
      const double length_m = (walk_[i + 1] - walk_[i]).norm();
      for (double at_m = 0; at_m <= length_m; at_m += 0.1) {
        const Vector2d p = walk_[i] + at_m / length_m * (walk_[i + 1] - walk_[i]) - middle;
        const Vector2d off(std::abs(along.dot(p)) - half.x(),
                           std::abs(Left(along).dot(p)) - half.y());
        least_m = std::min(least_m, off.cwiseMax(0).norm());
      }
    }
    return least_m;
  }

  bool MeetsWall(const Vector2d& middle, const Vector2d& along, const Vector2d& half) const {
    for (const FloorWall& wall : walls_) {
      const size_t n = wall.points.size();
      for (size_t i = 0; i + 1 < n + (wall.is_closed ? 1 : 0); ++i) {
        const Vector2d a = wall.points[i], b = wall.points[(i + 1) % n];
        const double length_m = (b - a).norm();
        for (double at_m = 0; at_m <= length_m; at_m += 0.05) {
          for (const double behind_m : {0.0, wall.is_closed ? 0.0 : wall.thickness_m}) {
            const Vector2d p =
                a + at_m / length_m * (b - a) - behind_m * Left((b - a) / length_m) - middle;
            if (std::abs(along.dot(p)) < half.x() && std::abs(Left(along).dot(p)) < half.y())
              return true;
          }
        }
      }
    }
    return false;
  }

  // Things before a wall with its front to the left, with gaps between them; pictures beside doors.
  void Furnish(const Vector2d& a, const Vector2d& b, const std::vector<FloorDoor>& doors) {
    const Vector2d along = (b - a).normalized();
    const double length_m = (b - a).norm();
    for (const FloorDoor& door : doors) {
      const double at_m = door.at_m + door.width_m + Pick(0.25, 0.45);
      if (at_m + 0.6 < length_m - 0.1)
        AddThing("poster", a + (at_m + 0.3) * along, along, {0.6, 0.02, 0.84});
    }
    double at_m = Pick(0.1, 0.6);
    while (true) {
      const Vector3d size(Pick(0.7, 2.0), Pick(0.3, 0.5), Pick(0.9, 2.2));
      const double end_m = at_m + size.x();
      if (end_m > length_m - 0.1) break;
      const bool is_at_door = std::any_of(doors.begin(), doors.end(), [&](const FloorDoor& door) {
        return end_m > door.at_m - 0.2 && at_m < door.at_m + door.width_m + 1.2;
      });
      const int choice = static_cast<int>(Pick(0, 5));
      const Vector2d foot = a + 0.5 * (at_m + end_m) * along;
      if (!is_at_door && choice < 2) AddThing("shelf", foot, along, size);
      if (!is_at_door && choice == 2) AddThing("cabinet", foot, along, size);
      if (!is_at_door && choice == 3)
        AddThing("board", foot, along, {std::min(size.x(), 1.6), 0.02, 1.0});
      at_m = end_m + Pick(0.05, 0.8);
    }
  }

  void AddThing(const std::string& kind, const Vector2d& foot, const Vector2d& along,
                const Vector3d& size) {
    const bool is_flat = size.y() < 0.1;
    const Vector2d half(0.5 * size.x(), 0.5 * size.y());
    const Vector2d middle = foot + (half.y() + 0.03) * Left(along);
    if (MeetsWall(middle, along, half) ||
        DistanceToWalk(middle, along, half) < (is_flat ? 0.1 : 0.35))
      return;
    const Vector2d at = foot + (is_flat ? 0.006 : 0.02) * Left(along);
    const std::string measures =
        is_flat ? fmt::format("[{:.3f}, {:.3f}]", size.x(), size.z())
                : fmt::format("[{:.3f}, {:.3f}, {:.3f}]", size.x(), size.y(), size.z());
    Add(fmt::format("{{kind: {}, at: [{:.3f}, {:.3f}, {}], size: {}, yaw_deg: {:.3f}, seed: {}}}",
                    kind, at.x(), at.y(), is_flat ? 1.1 : 0.0, measures,
                    std::atan2(along.y(), along.x()) * 180 / kPi + 180,
                    static_cast<int>(Pick(1, 1000))));
  }

  std::mt19937 random_;
  std::vector<FloorWall> walls_;
  std::vector<FloorRoom> rooms_;
  std::vector<Passage> passages_;
  std::vector<Vector2d> walk_;
  std::string objects_;
};

// Rooms along the back of a wall with doors, between two places along x and one beyond.
struct RoomRow {
  double low_m, high_m, end_m;  // end_m: of y
  double wall_m;                // its front
  double wall_high_m;           // to where it goes
};

constexpr double kRowWall_m = 0.15;

void AddRow(const RoomRow& row, int corridor, FloorMaker* maker,
            const Eigen::Isometry2d& T = Eigen::Isometry2d::Identity()) {
  const bool is_up = row.end_m > row.wall_m;
  const double face_m = row.wall_m + (is_up ? kRowWall_m : -kRowWall_m);
  const Vector2d low_end(row.low_m, row.wall_m), high_end(row.wall_high_m, row.wall_m);
  const int wall = maker->AddWall({is_up ? std::vector<Vector2d>{T * high_end, T * low_end}
                                         : std::vector<Vector2d>{T * low_end, T * high_end},
                                   kRowWall_m});
  double from_m = row.low_m;
  while (true) {
    const double thickness_m = maker->Pick(0.08, 0.2);
    double to_m = from_m + maker->Pick(2.8, 5.5);
    const bool is_last = to_m + 3 > row.high_m;
    if (is_last) to_m = row.high_m;
    const double y0 = std::min(face_m, row.end_m), y1 = std::max(face_m, row.end_m);
    const int room = maker->AddBox({from_m, y0}, {to_m, y1}, T);
    FloorDoor door = maker->MakeDoor(maker->Pick(from_m + 0.4, to_m - 1.6));
    door.at_m = is_up ? row.wall_high_m - door.at_m - door.width_m : door.at_m - row.low_m;
    maker->AddDoor(wall, 0, door, corridor, room);
    if (is_last) return;
    maker->AddWall({{T * Vector2d(to_m, y0), T * Vector2d(to_m, y1)}, thickness_m});
    from_m = to_m + thickness_m;
  }
}

void AddOutside(std::vector<Vector2d> corners, FloorMaker* maker, const std::string& more = "") {
  FloorWall wall{std::move(corners), 0.2, true};
  wall.more = more;
  maker->AddWall(wall);
}

void MakeOffices(FloorMaker* maker) {
  const double length_m = maker->Pick(14, 20), width_m = maker->Pick(1.8, 2.5);
  const double top_m = width_m + maker->Pick(4, 5.5), low_m = -maker->Pick(3.5, 5);
  AddOutside({{0, low_m}, {length_m, low_m}, {length_m, top_m}, {0, top_m}}, maker,
             fmt::format(", windows: [[0, 1, 2, 1.5, 0.9, 6], [2, {:.2f}, 3, 1.5, 0.9, 6]]",
                         length_m - 6));
  const int corridor =
      maker->AddRoom({{{0.8, 0.5 * width_m}, {length_m - 0.8, 0.5 * width_m}}, {}});
  AddRow({0, length_m, top_m, width_m, length_m}, corridor, maker);
  AddRow({0, length_m, low_m, 0, length_m}, corridor, maker);
}

// With columns, a corner cut off at 45 degrees, a round one, and a store behind a slanting wall.
void MakeHall(FloorMaker* maker) {
  const double w = maker->Pick(13, 17), h = maker->Pick(8.5, 10.5), cut = maker->Pick(1.5, 2.5);
  const double top_m = h + kRowWall_m + maker->Pick(3.5, 4.5), store = maker->Pick(3.2, 4);
  std::vector<Vector2d> corners = {{cut, 0}, {w, 0}, {w, top_m}, {0, top_m}, {0, cut}};
  if (maker->Pick(0, 1) < 0.5) {  // round
    corners.pop_back();
    for (int i = 0; i < 8; ++i) {
      const double angle = kPi + 0.5 * kPi * i / 8;
      corners.emplace_back(cut + cut * std::cos(angle), cut + cut * std::sin(angle));
    }
  }
  AddOutside(corners, maker);
  const int hall = maker->AddRoom({{{2, h - 1.6},
                                    {2, 2.4},
                                    {w - store - 1.6, 2.4},
                                    {w - 1.8, store + 1.6},
                                    {w - 1.8, h - 1.6},
                                    {2, h - 1.6}},
                                   {}});
  AddRow({0, w, top_m, h, w}, hall, maker);
  for (double x = 4; x < w - 3; x += 4) maker->AddColumn({x, 0.5 * h}, 0.4);
  // Its front is to the hall.
  const int slanting = maker->AddWall({{{w - store, 0}, {w, store}}, 0.12});
  const double in_m = 0.3 * store;
  const int room = maker->AddRoom({{{w - in_m, in_m}}, {}});
  FloorDoor door = maker->MakeDoor(0.5 * store * std::sqrt(2.0) - 0.5, 0);
  maker->AddDoor(slanting, 0, door, hall, room);
}

// Desks between partitions of half height, a meeting room behind glass, rooms.
void MakeOpenPlan(FloorMaker* maker) {
  const double w = maker->Pick(12, 15), h = maker->Pick(8, 10);
  const double top_m = h + kRowWall_m + maker->Pick(3.5, 4.5);
  AddOutside({{0, 0}, {w, 0}, {w, top_m}, {0, top_m}}, maker,
             fmt::format(", windows: [[0, 1, {:.2f}, 2.0, 0.5, 6]]", w - 6));
  const double mx = w - maker->Pick(3.5, 4.5), my = maker->Pick(3.2, 4.2);
  const int plan = maker->AddRoom({{{1.2, 1.2},
                                    {mx - 1.1, 1.2},
                                    {mx - 1.1, my + 1.2},
                                    {w - 1.2, my + 1.2},
                                    {w - 1.2, h - 1.2},
                                    {1.2, h - 1.2},
                                    {1.2, 1.2}},
                                   {}});
  AddRow({0, w, top_m, h, w}, plan, maker);
  // The meeting room's fronts are to the open plan.
  FloorWall glass{{{mx, 0}, {mx, my}}, 0.1};
  glass.more =
      fmt::format(", clear_glass: true, windows: [[0, {:.2f}, {:.2f}, 1.8, 0.3]]", 1.4, my - 1.8);
  const int side = maker->AddWall(glass);
  maker->AddWall({{{mx, my}, {w, my}}, 0.1});
  const int meeting = maker->AddBox({mx + 0.1, 0}, {w, my - 0.1});
  maker->AddDoor(side, 0, {0.3, 0.9, 90}, plan, meeting);
  for (double x = 3; x < mx - 2.5; x += 2.2) {
    maker->AddPartition({x, 2.2}, {x, h - 2.4}, maker->Pick(1.2, 1.6));
  }
}

// A corridor that turns with its wing, a lobby at the bend.
void MakeWing(FloorMaker* maker) {
  const double turn = maker->Pick(10, 30) * kPi / 180, depth = maker->Pick(6, 7.5),
               wc = maker->Pick(1.8, 2.4);
  const double first = maker->Pick(9, 12), second = maker->Pick(9, 12),
               lobby = maker->Pick(2.5, 3.5);
  const double bend = depth * std::tan(0.5 * turn);
  Eigen::Isometry2d T = Eigen::Isometry2d::Identity();
  T.translation() << first + lobby, 0;
  T.rotate(Eigen::Rotation2Dd(turn));
  const double end = lobby + second;
  AddOutside({{0, 0},
              {first + lobby, 0},
              T * Vector2d(end, 0),
              T * Vector2d(end, depth),
              {first + lobby - bend, depth},
              {0, depth}},
             maker);
  const Vector2d at_bend(first + lobby - 0.5 * wc * std::tan(0.5 * turn), 0.5 * wc);
  const int corridor =
      maker->AddRoom({{{0.8, 0.5 * wc}, at_bend, T * Vector2d(end - 0.8, 0.5 * wc)}, {}});
  AddRow({0, first - 0.12, depth, wc, first}, corridor, maker);
  maker->AddWall({{{first, depth}, {first, wc}}, 0.12});
  AddRow({lobby + 0.12, end, depth, wc, end}, corridor, maker, T);
  maker->AddWall({{T * Vector2d(lobby, wc), T * Vector2d(lobby, depth)}, 0.12});
}

// A corridor that widens, with a double door across it.
void MakeWidening(FloorMaker* maker) {
  const double w1 = maker->Pick(1.7, 2.2), w2 = w1 + maker->Pick(1, 1.6),
               length = maker->Pick(18, 22);
  const double x1 = maker->Pick(5, 6.5), x2 = x1 + maker->Pick(4, 5),
               top = w2 + maker->Pick(3.5, 4.5), low = -maker->Pick(3.5, 4.5);
  AddOutside({{0, low}, {length, low}, {length, top}, {0, top}}, maker);
  const double across = x2 + maker->Pick(1.2, 2);
  const int a = maker->AddRoom({{{0.8, 0.5 * w1}, {across - 0.7, 0.5 * w1}}, {}});
  const int b = maker->AddRoom({{{across + 0.8, 0.5 * w1}, {length - 0.8, 0.5 * w1}}, {}});
  const int wall = maker->AddWall({{{across, 0}, {across, w1}}, 0.1});
  maker->AddDoor(wall, 0, {0.5 * (w1 - 1.5), 1.5, 90}, a, b);
  AddRow({0, x1 - 0.12, top, w1, x1}, a, maker);
  maker->AddWall({{{x1, top}, {x1, w1}}, 0.12});
  AddRow({x1, x2, top, w2, x2}, a, maker);
  maker->AddWall({{{x2, w1}, {x2, top}}, 0.12});
  AddRow({across + 0.1, length, low, 0, length}, b, maker);
  AddRow({0, across, low, 0, across + 0.1}, a, maker);
  AddRow({x2 + 0.12, length, top, w1, length}, b, maker);
}

struct FloorBox {
  Vector2d low, high;
  int room = -1;
};

// Halves a box by walls until rooms are left; a door in each of the walls.
std::vector<FloorBox> Halve(const FloorBox& box, FloorMaker* maker) {
  const Vector2d size = box.high - box.low;
  const int k = size.x() > size.y() ? 0 : 1;
  if (size[k] < 5.5) {
    FloorBox room = box;
    room.room = maker->AddBox(box.low, box.high);
    return {room};
  }
  const double at = box.low[k] + maker->Pick(0.38, 0.62) * size[k],
               thickness = maker->Pick(0.08, 0.2);
  FloorBox first = box, second = box;
  first.high[k] = k == 0 ? at : at - thickness;
  second.low[k] = k == 0 ? at + thickness : at;
  std::vector<FloorBox> rooms = Halve(first, maker), others = Halve(second, maker);
  const Vector2d from = k == 0 ? Vector2d(at, box.low.y()) : Vector2d(box.low.x(), at);
  const Vector2d to = k == 0 ? Vector2d(at, box.high.y()) : Vector2d(box.high.x(), at);
  const int wall = maker->AddWall({{from, to}, thickness});
  double most = 0;
  std::pair<FloorBox, FloorBox> best;
  for (const FloorBox& a : rooms) {
    for (const FloorBox& b : others) {
      if (std::abs(a.high[k] - first.high[k]) > 0.01 || std::abs(b.low[k] - second.low[k]) > 0.01)
        continue;
      const double common =
          std::min(a.high[1 - k], b.high[1 - k]) - std::max(a.low[1 - k], b.low[1 - k]);
      if (common < most) continue;
      most = common;
      best = {a, b};
    }
  }
  const double start = std::max(best.first.low[1 - k], best.second.low[1 - k]);
  FloorDoor door = maker->MakeDoor(start - box.low[1 - k] + maker->Pick(0.3, most - 1.3), 0);
  maker->AddDoor(wall, 0, door, best.first.room, best.second.room);
  rooms.insert(rooms.end(), others.begin(), others.end());
  return rooms;
}

void MakeApartment(FloorMaker* maker) {
  const FloorBox box{{0, 0}, {maker->Pick(10, 13), maker->Pick(8, 10)}};
  AddOutside({box.low, {box.high.x(), 0}, box.high, {0, box.high.y()}}, maker);
  Halve(box, maker);
}

}  // namespace

FurnishedFloor MakeFurnishedFloor(const std::string& kind, int seed) {
  FloorMaker maker(seed);
  if (kind == "offices") MakeOffices(&maker);
  if (kind == "hall") MakeHall(&maker);
  if (kind == "openplan") MakeOpenPlan(&maker);
  if (kind == "wing") MakeWing(&maker);
  if (kind == "widening") MakeWidening(&maker);
  if (kind == "apartment") MakeApartment(&maker);
  return maker.Finish();
}

MappedFloor MapFloor(const Scene& scene, const std::vector<Vector3d>& places) {
  ScanOptions options;
  options.noise_m = 0.005;
  options.noise_per_m = 0.002;
  options.line_noise_m = 0.004;
  options.blank_share = 0.7;
  options.lines_seen = 0.6;
  options.stray_cones = 8;
  options.rays = 6000;
  options.lowest_deg = -32;
  options.highest_deg = 32;
  options.half_width_deg = 45;
  return {Scan(scene, places, options), SeenFrom(scene, places, options)};
}

}  // namespace slcmap::testing
