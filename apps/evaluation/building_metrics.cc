#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "apps/evaluation/map_metrics.h"
#include "apps/evaluation/report.h"
#include "data/core/error.h"
#include "data/core/math.h"

namespace slcmap::inline evaluation {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kMinSeen_m2 = 2;  // of a true wall that should be found
// of a true wall's points from the plane that shows it
constexpr double kBuildingMaxDistance_m = 0.1;
constexpr double kMaxAngle_deg = 6;        // between their normals
constexpr double kMinLookedThrough = 0.5;  // of an open opening that should be found
constexpr double kAreaShare = 0.02;        // within which a room's area is right

constexpr double kOutlineSlack_m = 0.1;
constexpr double kLeastOverlap = 0.5;   // of the union of what is compared
constexpr double kReveal_m = 0.4;       // of an opening on one face of a wall from that on another
constexpr double kLeastBeside_m = 0.5;  // of opposite walls
constexpr double kMostApart_m = 20;
constexpr double kLeastPoints = 4;  // of a wall under a plane, to be compared with it

// The level direction along an upright plane.
Vector3d ComputeAlong(const Vector3d& normal) {
  return Vector3d::UnitZ().cross(normal).normalized();
}

Interval ComputeExtent(const std::vector<Vector3d>& points, const Vector3d& direction) {
  Interval extent{1e9, -1e9};
  for (const Vector3d& p : points) {
    extent.from_m = std::min(extent.from_m, direction.dot(p));
    extent.to_m = std::max(extent.to_m, direction.dot(p));
  }
  return extent;
}

bool Holds(const Interval& stretch, double place_m) {
  return place_m >= stretch.from_m - kOutlineSlack_m && place_m <= stretch.to_m + kOutlineSlack_m;
}

double LengthInBoth(const Interval& a, const Interval& b) {
  return std::max(0.0, Common(a, b).length_m());
}

bool IsOver(const BuildingPlane& plane, const Vector3d& p, double max_distance_m) {
  if (std::abs(plane.normal.dot(p) - plane.offset_m) > max_distance_m) return false;
  const Vector3d along = ComputeAlong(plane.normal);
  return Holds(ComputeExtent(plane.outline_world, along), along.dot(p)) &&
         Holds(ComputeExtent(plane.outline_world, Vector3d::UnitZ()), p.z());
}

// What a plane is off from the points under it.
struct Sum {
  double distance_m = 0;
  int64_t count = 0;
  double Mean() const { return distance_m / static_cast<double>(count); }
};

class WallComparison {
 public:
  WallComparison(const TrueBuilding& truth, const Building& building)
      : truth_(truth), building_(building) {}

  void AddTo(BuildingMetrics* metrics) {
    for (const TrueWall& wall : truth_.walls) Compare(wall, metrics);
    std::vector<double> offsets_m;
    for (const auto& [wall, distance_m] : found_) offsets_m.push_back(std::abs(distance_m));
    metrics->offset_median_m = QuantileFigure(offsets_m, 0.5);
    metrics->offset_95_m = QuantileFigure(offsets_m, 0.95);
    AddDistances(metrics);
    for (const auto& [plane, sum] : planes_) {
      if (static_cast<double>(sum.count) < kLeastPoints) continue;
      ++metrics->intervals;
      const bool holds = std::abs(sum.Mean()) <= 1.96 * building_.planes[plane].sigma_m;
      metrics->intervals_held += holds ? 1 : 0;
    }
  }

 private:
  void Compare(const TrueWall& wall, BuildingMetrics* metrics) {
    std::map<size_t, Sum> sums;
    const double least_cosine = std::cos(kMaxAngle_deg * M_PI / 180);
    int64_t covered = 0;
    for (const Vector3d& p : wall.seen_world) {
      bool is_covered = false;
      for (size_t i = 0; i < building_.planes.size(); ++i) {
        const BuildingPlane& plane = building_.planes[i];
        if (plane.kind != PlaneKind::kWall || plane.normal.dot(wall.normal) < least_cosine ||
            !IsOver(plane, p, kBuildingMaxDistance_m)) {
          continue;
        }
        is_covered = true;
        const double distance_m = plane.normal.dot(p) - plane.offset_m;
        for (Sum* sum : {&sums[i], &planes_[i]}) {
          sum->distance_m += distance_m;
          ++sum->count;
        }
      }
      covered += is_covered ? 1 : 0;
    }
    if (wall.seen_m2 < kMinSeen_m2) return;
    ++metrics->walls;
    if (2 * covered <= static_cast<int64_t>(wall.seen_world.size())) return;
    ++metrics->walls_found;
    const auto most = std::max_element(sums.begin(), sums.end(), [](const auto& a, const auto& b) {
      return a.second.count < b.second.count;
    });
    found_[wall.id] = most->second.Mean();
  }

  void AddDistances(BuildingMetrics* metrics) const {
    std::vector<double> errors_m;
    for (const auto& [first, first_m] : found_) {
      for (const auto& [second, second_m] : found_) {
        if (first < second && AreOpposite(truth_.walls[first], truth_.walls[second])) {
          errors_m.push_back(std::abs(first_m + second_m));
        }
      }
    }
    metrics->distances = static_cast<int64_t>(errors_m.size());
    metrics->distance_error_95_m = QuantileFigure(errors_m, 0.95);
  }

  static bool AreOpposite(const TrueWall& a, const TrueWall& b) {
    if (a.normal.dot(b.normal) > -0.995) return false;
    const Vector3d along = ComputeAlong(a.normal);
    if (std::abs(a.offset_m + b.offset_m) > kMostApart_m) return false;
    const auto beside_m = [&](const Vector3d& direction) {
      return LengthInBoth(ComputeExtent(a.seen_world, direction),
                          ComputeExtent(b.seen_world, direction));
    };
    return beside_m(along) >= kLeastBeside_m && beside_m(Vector3d::UnitZ()) >= kLeastBeside_m;
  }

  const TrueBuilding& truth_;
  const Building& building_;
  std::map<int64_t, double> found_;  // wall: mean distance of its points from the plane over most
  std::map<size_t, Sum> planes_;
};

// Two rectangles of upright planes, as seen along the normal of the first.
double ComputeOverlap(const std::vector<Vector3d>& a, const std::vector<Vector3d>& b,
                      const Vector3d& normal) {
  const Vector3d along = ComputeAlong(normal), up = Vector3d::UnitZ();
  const Interval a_along = ComputeExtent(a, along), a_up = ComputeExtent(a, up);
  const Interval b_along = ComputeExtent(b, along), b_up = ComputeExtent(b, up);
  const double apart_m = std::abs(normal.dot(a.front()) - normal.dot(b.front()));
  if (apart_m > kReveal_m) return 0;
  const double common_m2 = LengthInBoth(a_along, b_along) * LengthInBoth(a_up, b_up);
  return common_m2 /
         (a_along.length_m() * a_up.length_m() + b_along.length_m() * b_up.length_m() - common_m2);
}

// How many faces of walls that were seen an opening is in: of panes to the outside one is, and
// behind them nothing may be.
std::map<int64_t, int> FacesOfOpenings(const TrueBuilding& truth, double min_seen_m2) {
  std::map<int64_t, int> faces;
  for (const TrueWall& wall : truth.walls) {
    if (wall.seen_m2 < min_seen_m2) continue;
    for (const TrueOpening& opening : wall.openings) ++faces[opening.id];
  }
  return faces;
}

// From floor to top where no true wall was seen: between two of them, which a drawing tells by
// their ends.
bool IsGap(const PlaneOpening& opening, const BuildingPlane& plane, const TrueBuilding& truth) {
  constexpr double kNear_m = 0.05, kOnPlane_m = 0.1, kAtEnds_m = 0.1;
  const Interval wall = ComputeExtent(plane.outline_world, Vector3d::UnitZ());
  const Interval hole = ComputeExtent(opening.outline_world, Vector3d::UnitZ());
  if (hole.from_m > wall.from_m + kNear_m || hole.to_m < wall.to_m - kNear_m) return false;
  const Vector3d way = Vector3d::UnitZ().cross(plane.normal);
  const Interval along = ComputeExtent(opening.outline_world, way);
  const auto is_in_hole = [&](const Vector3d& p) {
    const double at_m = way.dot(p), z_m = p.z();
    return std::abs(plane.normal.dot(p) - plane.offset_m) < kOnPlane_m && z_m > hole.from_m &&
           z_m < hole.to_m && at_m > along.from_m + kAtEnds_m && at_m < along.to_m - kAtEnds_m;
  };
  return std::ranges::none_of(truth.walls, [&](const TrueWall& each) {
    return std::ranges::any_of(each.seen_world, is_in_hole);
  });
}

void CompareOpenings(const TrueBuilding& truth, const Building& building,
                     BuildingMetrics* metrics) {
  std::set<int64_t> expected, allowed, found;
  const std::map<int64_t, int> faces = FacesOfOpenings(truth, kMinSeen_m2);
  for (const TrueWall& wall : truth.walls) {
    for (const TrueOpening& opening : wall.openings) {
      if (!opening.is_open && !opening.is_clear) continue;
      allowed.insert(opening.id);
      const auto seen = faces.find(opening.id);
      if (!opening.is_open && (seen == faces.end() || seen->second < 2)) continue;
      if (opening.looked_through >= kMinLookedThrough && wall.seen_m2 >= kMinSeen_m2) {
        expected.insert(opening.id);
      }
    }
  }
  std::vector<double> width_errors_m;
  for (const BuildingPlane& plane : building.planes) {
    for (const PlaneOpening& mapped : plane.openings) {
      const TrueOpening* best = nullptr;
      double most = kLeastOverlap;
      for (const TrueWall& wall : truth.walls) {
        if (std::abs(wall.normal.dot(plane.normal)) < 0.98) continue;
        for (const TrueOpening& opening : wall.openings) {
          const double overlap =
              ComputeOverlap(mapped.outline_world, opening.outline_world, plane.normal);
          if (overlap < most) continue;
          most = overlap;
          best = &opening;
        }
      }
      if (best == nullptr && IsGap(mapped, plane, truth)) continue;
      if (best == nullptr || allowed.count(best->id) == 0) {
        ++metrics->openings_false;
        continue;
      }
      found.insert(best->id);
      width_errors_m.push_back(std::abs(mapped.clear_width_m - best->clear_width_m));
    }
  }
  metrics->openings = static_cast<int64_t>(expected.size());
  for (const int64_t id : expected) metrics->openings_found += found.count(id) > 0 ? 1 : 0;
  const auto right = 2.0 * static_cast<double>(metrics->openings_found);
  const auto wrong =
      static_cast<double>(metrics->openings_false + metrics->openings - metrics->openings_found);
  metrics->openings_f1 = ComputeShare(right, right + wrong);
  metrics->clear_width_median_m = QuantileFigure(width_errors_m, 0.5);
}

void CompareRooms(const TrueBuilding& truth, const Building& building, BuildingMetrics* metrics) {
  constexpr double kSameFloor_m = 0.5;
  std::vector<double> errors;
  metrics->rooms_mapped = static_cast<int64_t>(building.rooms.size());
  for (const TrueRoom& room : truth.rooms) {
    if (!room.is_entered) continue;
    ++metrics->rooms;
    const Room* best = nullptr;
    double most = kLeastOverlap;
    for (const Room& mapped : building.rooms) {
      if (std::abs(mapped.floor_m - room.floor_m) > kSameFloor_m) continue;
      const double common_m2 = IntersectionArea(mapped.polygon, room.polygon);
      const double overlap = common_m2 / (mapped.area_m2 + room.area_m2 - common_m2);
      if (overlap < most) continue;
      most = overlap;
      best = &mapped;
    }
    if (best == nullptr) continue;
    ++metrics->rooms_found;
    errors.push_back(std::abs(best->area_m2 - room.area_m2) / room.area_m2);
    metrics->rooms_right += errors.back() <= kAreaShare ? 1 : 0;
  }
  metrics->area_error_median = QuantileFigure(errors, 0.5);
}

}  // namespace

BuildingMetrics EvaluateBuilding(const TrueBuilding& truth, const Building& building) {
  BuildingMetrics metrics;
  WallComparison(truth, building).AddTo(&metrics);
  CompareOpenings(truth, building, &metrics);
  CompareRooms(truth, building, &metrics);
  return metrics;
}

Building Aligned(const Alignment& alignment, Building building) {
  const auto move = [&](std::vector<Vector3d>* points) {
    for (Vector3d& p : *points) p = alignment.Position(p);
  };
  for (BuildingPlane& plane : building.planes) {
    const Vector3d on_plane = alignment.Position(plane.offset_m * plane.normal);
    plane.normal = alignment.T_truth_estimate.rotation * plane.normal;
    plane.offset_m = plane.normal.dot(on_plane);
    move(&plane.outline_world);
    for (PlaneOpening& opening : plane.openings) move(&opening.outline_world);
  }
  for (Room& room : building.rooms) {
    const double floor_m = room.floor_m;
    const auto moved = [&](const Vector2d& p) {
      return alignment.Position(Vector3d(p.x(), p.y(), floor_m));
    };
    room.floor_m = moved(room.polygon.outline.front()).z();
    for (Vector2d& p : room.polygon.outline) p = moved(p).head<2>();
    for (PlanPoints& hole : room.polygon.holes) {
      for (Vector2d& p : hole) p = moved(p).head<2>();
    }
  }
  return building;
}

nlohmann::ordered_json BuildingJson(const ComparedFiles& inputs, const BuildingMetrics& metrics) {
  return {{"planes", inputs.mapped},
          {"true_building", inputs.truth},
          {"walls", metrics.walls},
          {"walls_found", metrics.walls_found},
          {"offset_median_m", metrics.offset_median_m},
          {"offset_95_m", metrics.offset_95_m},
          {"distances", metrics.distances},
          {"distance_error_95_m", metrics.distance_error_95_m},
          {"intervals", metrics.intervals},
          {"intervals_held", metrics.intervals_held},
          {"openings", metrics.openings},
          {"openings_found", metrics.openings_found},
          {"openings_false", metrics.openings_false},
          {"openings_f1", metrics.openings_f1},
          {"clear_width_median_m", metrics.clear_width_median_m},
          {"rooms", metrics.rooms},
          {"rooms_found", metrics.rooms_found},
          {"rooms_right", metrics.rooms_right},
          {"rooms_mapped", metrics.rooms_mapped},
          {"area_error_median", metrics.area_error_median}};
}

namespace {

constexpr double kMinSeen_m = 0.5;           // of a true pipe that counts as one to be found
constexpr double kPipeMaxDistance_m = 0.05;  // between the axes, where both are
constexpr double kPipeMaxTurn_rad = 0.0873;  // 5 degrees
constexpr double kMaxRadiusError = 0.15;     // of the true radius

// How far the axis of a mapped pipe is from a true one where both are; nothing where they are
// nowhere side by side, or not parallel.
std::optional<double> AxisDistance(const TruePipe& truth, const MapPipe& pipe) {
  const Vector3d along = (truth.end_world - truth.start_world).normalized();
  const Vector3d way = pipe.end_world - pipe.start_world;
  const double length_m = (truth.end_world - truth.start_world).norm();
  if (std::abs(along.dot(way.normalized())) < std::cos(kPipeMaxTurn_rad)) return std::nullopt;
  const double start_m = along.dot(pipe.start_world - truth.start_world);
  const double end_m = along.dot(pipe.end_world - truth.start_world);
  const double from_m = std::max(0.0, std::min(start_m, end_m));
  const double to_m = std::min(length_m, std::max(start_m, end_m));
  if (to_m <= from_m) return std::nullopt;
  const double share = (0.5 * (from_m + to_m) - start_m) / (end_m - start_m);
  const Vector3d middle = pipe.start_world + share * way;
  return (middle - truth.start_world).cross(along).norm();
}

bool HasRadius(const TruePipe& truth, const MapPipe& pipe) {
  return std::abs(pipe.radius_m - truth.radius_m) <= kMaxRadiusError * truth.radius_m;
}

// The pipe that is nearest to a true one, of those with its axis and perhaps its radius.
struct Match {
  const MapPipe* pipe = nullptr;
  double distance_m = 0;
};
std::optional<Match> FindMatch(const TruePipe& truth, const std::vector<MapPipe>& pipes,
                               bool with_radius) {
  std::optional<Match> best;
  for (const MapPipe& pipe : pipes) {
    if (with_radius && !HasRadius(truth, pipe)) continue;
    const auto distance_m = AxisDistance(truth, pipe);
    if (!distance_m || *distance_m > kPipeMaxDistance_m) continue;
    if (!best || *distance_m < best->distance_m) best = {&pipe, *distance_m};
  }
  return best;
}

bool IsTrue(const MapPipe& pipe, const std::vector<TruePipe>& truth) {
  return std::ranges::any_of(truth, [&](const TruePipe& true_pipe) {
    return FindMatch(true_pipe, {pipe}, true).has_value();
  });
}

}  // namespace

std::vector<MapPipe> Aligned(const Alignment& alignment, std::vector<MapPipe> pipes) {
  for (MapPipe& pipe : pipes) {
    pipe.start_world = alignment.Position(pipe.start_world);
    pipe.end_world = alignment.Position(pipe.end_world);
    pipe.radius_m *= alignment.scale;
  }
  return pipes;
}

PipeMetrics EvaluatePipes(const std::vector<TruePipe>& truth, const std::vector<MapPipe>& pipes) {
  PipeMetrics metrics;
  std::vector<double> radius_errors_m, distances_m;
  for (const TruePipe& pipe : truth) {
    if (pipe.SeenLength_m() < kMinSeen_m) continue;
    ++metrics.pipes;
    metrics.seen_m += pipe.SeenLength_m();
    metrics.found_axes += FindMatch(pipe, pipes, false).has_value();
    const auto match = FindMatch(pipe, pipes, true);
    if (!match) continue;
    ++metrics.found;
    metrics.found_m += pipe.SeenLength_m();
    radius_errors_m.push_back(std::abs(match->pipe->radius_m - pipe.radius_m));
    distances_m.push_back(match->distance_m);
  }
  metrics.mapped = std::ssize(pipes);
  metrics.false_pipes =
      std::ranges::count_if(pipes, [&](const MapPipe& pipe) { return !IsTrue(pipe, truth); });
  metrics.radius_median_m = QuantileFigure(radius_errors_m, 0.5);
  metrics.radius_95_m = QuantileFigure(radius_errors_m, 0.95);
  metrics.axis_median_m = QuantileFigure(distances_m, 0.5);
  return metrics;
}

nlohmann::ordered_json PipeJson(const ComparedFiles& inputs, const PipeMetrics& metrics) {
  return {{"pipes", inputs.mapped},
          {"true_pipes", inputs.truth},
          {"true", metrics.pipes},
          {"found", metrics.found},
          {"found_axes", metrics.found_axes},
          {"mapped", metrics.mapped},
          {"false", metrics.false_pipes},
          {"seen_m", metrics.seen_m},
          {"found_m", metrics.found_m},
          {"radius_error_median_m", metrics.radius_median_m},
          {"radius_error_95_m", metrics.radius_95_m},
          {"axis_error_median_m", metrics.axis_median_m}};
}

}  // namespace slcmap::evaluation
