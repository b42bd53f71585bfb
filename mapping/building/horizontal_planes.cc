#include "mapping/building/horizontal_planes.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "mapping/building/storeys.h"

namespace slcmap::inline mapping {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kPlaneBin_m = 0.02, kPeak_m = 0.05;
constexpr double kFloorReach_m = 0.3;  // of a room's floor from its storey's
constexpr double kLeastRoomHeight_m = 1.8;
constexpr double kAboveTop_m = 0.3;
constexpr double kStoreySigma_m = 0.03;  // of a room's floor that was not seen: its storey's
constexpr double kLeastShare = 0.05;     // of a room's area, of which a ceiling must be seen
constexpr double kRimAbove_m = 0.15;     // less than there is to the floor of the storey above
constexpr double kSureShare = 0.4;       // of which what is seen is no lamp
constexpr double kLeastRim = 0.3;  // of the walls around a room, along which lines tell its ceiling

struct Height {
  double z_m = 0, sigma_m = 0;
  double area_m2 = 0;  // on which it was measured
};

using HeightHistogram = std::map<int, std::set<PlanColumn>>;  // columns by height

bool HasLess(const HeightHistogram::value_type& a, const HeightHistogram::value_type& b) {
  return a.second.size() < b.second.size();
}

// Lamps and ducts have more texture than the ceiling that they hang from: the strongest peak above
// the most common height that a quarter as many columns have, with a valley in between.
int BehindWhatHangs(const HeightHistogram& histogram, HeightHistogram::const_iterator most) {
  constexpr double kValley = 0.7;  // of the peak, at most
  const size_t hanging = most->second.size();
  int best = most->first;
  size_t best_columns = 0, valley = hanging;
  for (int bin = most->first + 1; bin <= most->first + static_cast<int>(kHung_m / kPlaneBin_m);
       ++bin) {
    const auto found = histogram.find(bin);
    const size_t here = found == histogram.end() ? 0 : found->second.size();
    valley = std::min(valley, here);
    const bool is_peak = static_cast<double>(valley) <= kValley * static_cast<double>(here);
    if (!is_peak || kHungOver * here < hanging || here <= best_columns) continue;
    best = bin;
    best_columns = here;
  }
  return best;
}

// The height that surfaces have in most columns; of ceilings that above what hangs from them.
std::optional<Height> MostCommon(const std::vector<Vector3d>& points, bool is_ceiling,
                                 double least_m2) {
  HeightHistogram histogram;
  for (const Vector3d& p : points) {
    const int bin = static_cast<int>(std::floor(p.z() / kPlaneBin_m));
    for (int k = -1; k <= 1; ++k) histogram[bin + k].insert(FindColumn(p.head<2>()));
  }
  const auto most = std::max_element(histogram.begin(), histogram.end(), HasLess);
  if (most == histogram.end()) return std::nullopt;
  const auto best = is_ceiling ? histogram.find(BehindWhatHangs(histogram, most)) : most;
  const double area_m2 = static_cast<double>(best->second.size()) * kColumn_m * kColumn_m;
  if (area_m2 < least_m2) return std::nullopt;
  const double middle_m = (best->first + 0.5) * kPlaneBin_m;
  double sum = 0, squares = 0, count = 0;
  for (const Vector3d& p : points) {
    const double d = p.z() - middle_m;
    if (std::abs(d) > kPeak_m) continue;
    sum += d;
    squares += d * d;
    ++count;
  }
  const double mean = sum / count, variance = std::max(0.0, squares / count - mean * mean);
  const double bends = std::max(1.0, area_m2 / (kBuildingBendLength_m * kBuildingBendLength_m));
  return Height{middle_m + mean, std::hypot(kBuildingSharedSigma_m, std::sqrt(variance / bends)),
                area_m2};
}

// Where level lines lie along a side of a room: metres along it from its start.
struct RimPart {
  size_t side = 0;
  double from_m = 0, to_m = 0;
  double z_m = 0, sigma_m = 0;
};

std::vector<RimPart> RimParts(const PlanPoints& outline, const MapLine& line) {
  constexpr double kNear_m = 0.06, kParallel = 0.998, kLevel = 0.01;
  const Vector3d way = line.end_world - line.start_world;
  if (std::abs(way.z()) > kLevel * way.norm()) return {};
  const Vector2d a = line.start_world.head<2>(), b = line.end_world.head<2>();
  std::vector<RimPart> parts;
  for (size_t i = 0; i < outline.size(); ++i) {
    const Vector2d &from = outline[i], side = outline[(i + 1) % outline.size()] - from;
    const Vector2d along = side.normalized(), across(-along.y(), along.x());
    if (std::abs(along.dot(b - a)) < kParallel * (b - a).norm()) continue;
    if (std::abs(across.dot(0.5 * (a + b) - from)) > kNear_m) continue;
    const auto [low_m, high_m] = std::minmax({along.dot(a - from), along.dot(b - from)});
    const RimPart part{i, std::max(low_m, 0.0), std::min(high_m, side.norm()),
                       0.5 * (line.start_world.z() + line.end_world.z()), line.sigma_m};
    if (part.to_m > part.from_m) parts.push_back(part);
  }
  return parts;
}

// The length of the border that parts cover, each place once.
double CoveredRim(std::vector<RimPart> parts) {
  std::sort(parts.begin(), parts.end(), [](const RimPart& a, const RimPart& b) {
    return a.side != b.side ? a.side < b.side : a.from_m < b.from_m;
  });
  double length_m = 0, reached_m = 0;
  for (size_t i = 0; i < parts.size(); ++i) {
    if (i == 0 || parts[i].side != parts[i - 1].side) reached_m = 0;
    length_m += std::max(0.0, parts[i].to_m - std::max(parts[i].from_m, reached_m));
    reached_m = std::max(reached_m, parts[i].to_m);
  }
  return length_m;
}

// No better than the best of the parts, which may err alike.
Height MeanHeight(const std::vector<RimPart>& parts) {
  double weights = 0, sum = 0, squares = 0, least_sigma_m = parts.front().sigma_m;
  for (const RimPart& part : parts) {
    const double sigma_m = std::hypot(part.sigma_m, kBuildingSharedSigma_m);
    const double weight = (part.to_m - part.from_m) / (sigma_m * sigma_m);
    weights += weight;
    sum += weight * part.z_m;
    squares += weight * part.z_m * part.z_m;
    least_sigma_m = std::min(least_sigma_m, part.sigma_m);
  }
  const double z_m = sum / weights;
  const double scatter_m = std::sqrt(std::max(0.0, squares / weights - z_m * z_m));
  return {z_m, std::hypot(kBuildingSharedSigma_m, std::hypot(scatter_m, least_sigma_m))};
}

// The highest place at which lines lie along enough of the border of a room, where its walls meet
// the ceiling: those are seen where the ceiling itself is too dark or too plain.
std::optional<Height> RimHeight(const std::vector<MapLine>& lines, const Room& room, double low_m,
                                double high_m) {
  std::map<int, std::vector<RimPart>> by_height;
  for (const MapLine& line : lines) {
    for (const RimPart& part : RimParts(room.polygon.outline, line)) {
      if (part.z_m < low_m || part.z_m > high_m) continue;
      const int bin = static_cast<int>(std::floor(part.z_m / kPlaneBin_m));
      for (int k = bin - 1; k <= bin + 1; ++k) by_height[k].push_back(part);
    }
  }
  constexpr double kLeast = 0.03;  // of all of its border: a single line tells little
  const double least_m =
      std::max(kLeastRim * room.bounded, kLeast) * Perimeter(room.polygon.outline);
  double most_m = 0;
  const std::vector<RimPart>* best = nullptr;
  for (auto bin = by_height.rbegin(); bin != by_height.rend(); ++bin) {
    const double covered_m = CoveredRim(bin->second);
    if (best && covered_m <= most_m) break;  // down from the first peak
    if (covered_m < least_m) continue;
    most_m = covered_m;
    best = &bin->second;
  }
  if (!best) return std::nullopt;
  return MeanHeight(*best);
}

// Points of level surfaces that face a way, between two heights within a room.
std::vector<Vector3d> LevelPoints(const std::vector<SurfacePoint>& points, const Room& room,
                                  double way, double low_m, double high_m) {
  Eigen::AlignedBox2d box;
  for (const Vector2d& p : room.polygon.outline) box.extend(p);
  std::vector<Vector3d> inside;
  for (const SurfacePoint& point : points) {
    const Vector3d& p = point.p_world;
    if (way * point.normal_world.z() < kLevelCosine || p.z() < low_m || p.z() > high_m) continue;
    if (!box.contains(p.head<2>()) || !Contains(room.polygon, p.head<2>())) continue;
    inside.push_back(p);
  }
  return inside;
}

// What little is seen of a level surface may hang beneath the ceiling. Where nothing is, that of
// the storey may go on.
std::optional<Height> LocateCeiling(const BuildingInput& input, const Level& level,
                                    const Room& room) {
  const auto seen =
      MostCommon(LevelPoints(input.points, room, -1, room.floor_m + kLeastRoomHeight_m,
                             level.top_m + kAboveTop_m),
                 true, kLeastShare * room.area_m2);
  if (!seen && !level.ceiling_m) return std::nullopt;
  if (!seen) {
    return RimHeight(input.lines, room, *level.ceiling_m - kPeak_m, *level.ceiling_m + kRimAbove_m);
  }
  if (seen->area_m2 > kSureShare * room.area_m2) return seen;
  const double most_m = std::min(seen->z_m + kHung_m, level.top_m + kRimAbove_m);
  const auto rim = RimHeight(input.lines, room, seen->z_m - kPlaneBin_m, most_m);
  return rim ? rim : seen;
}

BuildingPlane LevelPlane(const Room& room, const Height& height, bool is_floor, size_t id) {
  BuildingPlane plane;
  plane.id = static_cast<int64_t>(id);
  plane.kind = is_floor ? PlaneKind::kFloor : PlaneKind::kCeiling;
  plane.storey = room.storey;
  plane.normal = is_floor ? Vector3d::UnitZ() : Vector3d(-Vector3d::UnitZ());
  plane.offset_m = is_floor ? height.z_m : -height.z_m;
  plane.sigma_m = height.sigma_m;
  for (const Vector2d& p : room.polygon.outline) {
    plane.outline_world.emplace_back(p.x(), p.y(), height.z_m);
  }
  plane.room_ids = {room.id};
  return plane;
}

}  // namespace

void AddFloorAndCeiling(const BuildingInput& input, const Level& level, Room* room,
                        std::vector<BuildingPlane>* planes) {
  const double least_m2 = kLeastShare * room->area_m2;
  room->floor_m = level.floor_m;
  const auto floor = MostCommon(LevelPoints(input.points, *room, 1, level.floor_m - kFloorReach_m,
                                            level.floor_m + kFloorReach_m),
                                false, least_m2);
  if (floor) room->floor_m = floor->z_m;
  planes->push_back(LevelPlane(*room, floor.value_or(Height{level.floor_m, kStoreySigma_m}), true,
                               planes->size()));
  planes->back().inferred = !floor;
  const auto ceiling = LocateCeiling(input, level, *room);
  if (!ceiling) return;
  room->height_m = ceiling->z_m - room->floor_m;
  planes->push_back(LevelPlane(*room, *ceiling, false, planes->size()));
}

}  // namespace slcmap::mapping
