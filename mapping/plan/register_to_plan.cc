#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>

#include "mapping/plan/plan_deviations.h"
#include "mapping/plan/plan_files.h"

namespace slcmap::inline mapping {
namespace {

using Eigen::Vector2d;

// At the height of people: doors and desks, no ceilings.
constexpr double kLow_m = 0.3, kHigh_m = 1.8;

// How much of the height over each cell is free and occupied.
class HeightCells {
 public:
  HeightCells(const OccupancyMap& occupancy, double floor_m)
      : low_m_(floor_m + kLow_m), high_m_(floor_m + kHigh_m), cell_m_(occupancy.resolution_m()) {
    const std::vector<Voxel> free = occupancy.FreeVoxels();
    for (const Voxel& voxel : free) {
      if (HeightIn(voxel) <= 0) continue;
      const Vector2d half = Vector2d::Constant(0.5 * voxel.size_m);
      box_.extend(voxel.centre_world.head<2>() - half).extend(voxel.centre_world.head<2>() + half);
    }
    if (box_.isEmpty()) return;
    const Eigen::Vector2i size = (box_.sizes() / cell_m_).array().ceil().cast<int>() + 1;
    free_m_ = cv::Mat1f::zeros(size.y(), size.x());
    taken_m_ = free_m_.clone();
    for (const Voxel& voxel : free) Add(voxel, &free_m_);
    for (const Voxel& voxel : occupancy.OccupiedVoxels()) Add(voxel, &taken_m_);
  }

  FreeCells Find() const {
    constexpr double kLeastShare = 0.5;
    FreeCells cells{box_.isEmpty() ? Vector2d(0, 0) : Vector2d(box_.min()), cell_m_, {}};
    cells.free = (free_m_ > kLeastShare * (high_m_ - low_m_)) & (taken_m_ == 0);
    return cells;
  }

 private:
  double HeightIn(const Voxel& voxel) const {
    const double z = voxel.centre_world.z(), half = 0.5 * voxel.size_m;
    return std::min(high_m_, z + half) - std::max(low_m_, z - half);
  }

  void Add(const Voxel& voxel, cv::Mat1f* heights_m) const {
    const double height_m = HeightIn(voxel);
    if (height_m <= 0) return;
    const Vector2d least = voxel.centre_world.head<2>() -
                           Vector2d::Constant(0.5 * voxel.size_m - 0.5 * cell_m_) - box_.min();
    const int count = static_cast<int>(std::lround(voxel.size_m / cell_m_));
    const cv::Rect all({0, 0}, heights_m->size());
    const cv::Rect covered(static_cast<int>(std::floor(least.x() / cell_m_)),
                           static_cast<int>(std::floor(least.y() / cell_m_)), count, count);
    if ((covered & all).area() > 0) (*heights_m)(covered & all) += height_m;
  }

  const double low_m_, high_m_, cell_m_;
  Eigen::AlignedBox2d box_;
  cv::Mat1f free_m_, taken_m_;
};

std::string InWords(const PlanPose& pose) {
  return fmt::format("{:.2f}, {:.2f} m turned by {:.1f} degrees", pose.shift.x(), pose.shift.y(),
                     pose.yaw_rad / kDegree);
}

// That many metres of walls at least, of a plan of thousands: less fits in many places by chance.
constexpr double kLeastAgreeing_m = 8;
constexpr double kLeastAgreeingShare = 0.5;  // more agrees than does not
constexpr double kMostRivalShare = 0.8;

struct PlacedStorey {
  BuiltStorey built;
  const BuildingPlan* plan = nullptr;
  std::optional<PlanPlacement> placement;

  double Score() const { return placement ? placement->score_m : -1e9; }
};

PlacedStorey PlaceBest(const MapResult& map, const std::vector<BuildingPlan>& plans,
                       const std::optional<RoughStart>& start, const Progress& progress) {
  PlacedStorey best;
  const double count = static_cast<double>(map.building.storeys.size() * plans.size());
  double done = 0;
  for (const Storey& storey : map.building.storeys) {
    const BuiltStorey built = MakeBuiltStorey(map, storey);
    for (const BuildingPlan& plan : plans) {
      PlacedStorey placed{
          {},
          &plan,
          FindPlacement(built, plan, start, progress.Part(done / count, (done + 1) / count))};
      ++done;
      if (best.plan != nullptr && placed.Score() <= best.Score()) continue;
      best = std::move(placed);
      best.built = built;
    }
  }
  return best;
}

// By part of a wall's face, whether more of what was measured within reach is on it than beside it.
std::vector<bool> FindMeasured(const BuildingPlane& plane, const PlannedFace& face,
                               const std::vector<DensePoint>& dense) {
  constexpr double kOn_m = 0.05, kAlike = 0.7;  // cosine
  Interval heights_m{1e9, -1e9};
  for (const Eigen::Vector3d& p : plane.outline_world) {
    heights_m = {std::min(heights_m.from_m, p.z()), std::max(heights_m.to_m, p.z())};
  }
  const double length_m = face.Length(), on_m = std::max(kOn_m, 2 * face.sigma_m);
  const Vector2d along = face.Along(), normal = face.Normal();
  const auto count = static_cast<std::size_t>(std::max(1.0, std::round(length_m / kPlanSample_m)));
  std::vector<int> on(count), beside(count);
  for (const DensePoint& point : dense) {
    const Vector2d offset = point.p_world.head<2>() - face.start;
    const double across_m = std::abs(normal.dot(offset));
    if (!(across_m <= kSameWall_m)) continue;
    const double share = along.dot(offset) / length_m, z_m = point.p_world.z();
    if (!(share >= 0 && share < 1) || z_m < heights_m.from_m || z_m > heights_m.to_m ||
        point.normal_world.dot(plane.normal) < kAlike) {
      continue;
    }
    auto& counts = across_m < on_m ? on : beside;
    ++counts[static_cast<std::size_t>(share * static_cast<double>(count))];
  }
  std::vector<bool> measured(count);
  for (std::size_t i = 0; i < count; ++i) measured[i] = on[i] > beside[i];
  return measured;
}

}  // namespace

void RequirePlacement(const BuiltStorey& built, const BuildingPlan& plan,
                      const std::optional<PlanPlacement>& placement, bool is_told) {
  double seen_m = 0;
  for (const MappedFace& face : built.faces) seen_m += face.face.Length();
  if (!placement || seen_m < kLeastAgreeing_m) {
    throw DataError(fmt::format(
        "found {:.1f} m of walls in the map, expected at least {} m, in two directions, to be "
        "found in the plan: walk more of the building",
        seen_m, kLeastAgreeing_m));
  }
  const double share = placement->AgreeingShare();
  std::optional<PlanPlacement> mirrored;
  if (!is_told || share < kLeastAgreeingShare) {
    mirrored = FindPlacement(built, StretchPlan(plan, {-1, 1}), std::nullopt);
  }
  if (mirrored && mirrored->score_m > placement->score_m &&
      mirrored->AgreeingShare() > std::max(share + 0.1, kLeastAgreeingShare)) {
    throw DataError(fmt::format(
        "found that {:.0f} % of the walls agree with the plan, and {:.0f} % with its mirror "
        "image, expected x to the right and y up as seen from above: mirror the plan",
        100 * share, 100 * mirrored->AgreeingShare()));
  }
  const auto scale = is_told ? std::nullopt : FindBetterScale(built, plan, *placement);
  if (scale) {
    throw DataError(fmt::format(
        "found that {:.0f} % of the walls agree with the plan, and more where it is about {:.3g} "
        "times as large, expected plan and map in one scale: correct the size of the plan's "
        "pixels, its unit, or the calibration of the map, or say with --plan-at X,Y,YAW_DEG "
        "where it lies as it is",
        100 * share, *scale));
  }
  if (share < kLeastAgreeingShare || placement->agreeing_m < kLeastAgreeing_m) {
    throw DataError(fmt::format(
        "found that at the best place, {}, {:.0f} % of what the map knows of walls agrees with the "
        "plan, expected {:.0f} %: is it the plan of another floor, or of another scale?",
        InWords(placement->T_plan_world), 100 * share, 100 * kLeastAgreeingShare));
  }
  if (placement->rival_share < kMostRivalShare) return;
  throw DataError(fmt::format(
      "found two places where the map fits into the plan, {} and {}, of which the second fits "
      "{:.0f} "
      "% as well, expected one: say about where the map's origin is in the plan with --plan-at "
      "X,Y,YAW_DEG, or walk more of the building",
      InWords(placement->T_plan_world), InWords(*placement->rival), 100 * placement->rival_share));
}

BuiltStorey MakeBuiltStorey(const MapResult& map, const Storey& storey) {
  BuiltStorey built;
  built.id = storey.id;
  for (const BuildingPlane& plane : map.building.planes) {
    if (plane.kind != PlaneKind::kWall || plane.inferred || plane.storey != storey.id) continue;
    const PlannedFace face = FaceFrom(plane);
    built.faces.push_back({face, plane.id, FindMeasured(plane, face, map.dense)});
  }
  for (const PlanWall& wall : map.building.walls) {
    if (wall.storey != storey.id) continue;
    for (const PlannedOpening& opening : OpeningsIn(wall)) {
      built.openings.push_back({opening, wall.id});
    }
  }
  const double above_m = storey.ceiling_m.value_or(storey.floor_m + 4);
  for (const StampedPose& pose : map.keyframes) {
    const Eigen::Vector3d& p = pose.T_world_imu.translation;
    if (p.z() > storey.floor_m && p.z() < above_m) built.trajectory.push_back(p.head<2>());
  }
  built.free = HeightCells(map.occupancy, storey.floor_m).Find();
  return built;
}

PlanComparison RegisterToPlan(const MapResult& map, const std::vector<BuildingPlan>& plans,
                              const std::optional<RoughStart>& start, const Progress& progress) {
  if (map.building.storeys.empty()) {
    throw DataError("found no storey in the map, expected walls: a map without images has none");
  }
  const PlacedStorey placed = PlaceBest(map, plans, start, progress);
  RequirePlacement(placed.built, *placed.plan, placed.placement, start.has_value());
  return CompareWithPlan(placed.built, *placed.plan, *placed.placement);
}

}  // namespace slcmap::mapping
