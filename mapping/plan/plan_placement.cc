#include "mapping/plan/plan_placement.h"

#include <spdlog/fmt/fmt.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "data/core/math.h"
#include "mapping/align/map_agreement.h"
#include "mapping/align/plan_votes.h"

namespace slcmap::inline mapping {

using Eigen::Vector2d;
using Eigen::Vector3d;

bool FreeCells::IsFree(const Vector2d& p) const {
  const Vector2d cell = (p - least) / cell_m;
  if (!(cell.minCoeff() >= 0) || cell.x() >= free.cols || cell.y() >= free.rows) return false;
  return free(static_cast<int>(cell.y()), static_cast<int>(cell.x())) != 0;
}

Vector2d PlanPose::Turn(const Vector2d& v) const {
  const double c = std::cos(yaw_rad), s = std::sin(yaw_rad);
  return {c * v.x() - s * v.y(), s * v.x() + c * v.y()};
}

double PlanPlacement::SigmaAt(const Vector2d& p, const Vector2d& normal) const {
  const Vector2d off = p - middle;
  const Vector3d jacobian(normal.x(), normal.y(), normal.dot(Vector2d(-off.y(), off.x())));
  return std::sqrt(std::max(0.0, jacobian.dot(covariance * jacobian)));
}

namespace {

constexpr double kStep_m = 0.1;         // of samples along faces
constexpr double kAgree_m = 0.1;        // beyond three standard deviations
constexpr double kWellAgreeing = 0.75;  // of a plan in its scale
constexpr AlignmentFitOptions kWideFit{.from_m = 0.4, .to_m = 0.03, .steps = 16};

// Faces as what maps are aligned by. Both have the floor, which lies at z = 0.
AlignmentFeatures MakeFeatures(const std::vector<PlannedFace>& faces) {
  std::vector<SurfaceSample> walls, floor;
  for (const PlannedFace& face : faces) {
    for (double at = 0.5 * kStep_m; at < face.Length(); at += kStep_m) {
      const Vector2d p = face.start + at * face.Along(), n = face.Normal();
      for (const double side : {1.0, -1.0}) {
        if (side < 0 && !face.two_sided) continue;
        walls.push_back({{p.x(), p.y(), 1}, {side * n.x(), side * n.y(), 0}});
      }
      floor.push_back({{p.x(), p.y(), 0}, Vector3d::UnitZ()});
    }
  }
  walls.insert(walls.end(), floor.begin(), floor.end());
  return FindFeatures(std::move(walls));
}

// What a place of the map in the plan is judged by.
class PlaceJudge {
 public:
  PlaceJudge(const BuiltStorey& built, const BuildingPlan& plan)
      : built_(built), plan_(plan), index_(plan.faces) {}

  // Lengths of what agrees, the more the nearer, and of what does not: faces where none is planned,
  // planned ones that the map looks through, and walls that were walked through.
  void Judge(PlanPlacement* place) const {
    place->agreeing_m = place->differing_m = place->score_m = 0;
    for (const MappedFace& built : built_.faces) {
      const double reach_m = 3 * built.face.sigma_m + kAgree_m;
      ForEachSample(built.face, [&](const Vector2d& at, double length_m) {
        const Vector2d normal = place->T_plan_world.Turn(built.face.Normal());
        const Vector2d p = place->T_plan_world * at;
        const auto planned = index_.FindNearest(p, normal, reach_m);
        (planned ? place->agreeing_m : place->differing_m) += length_m;
        if (!planned) return;
        const PlannedFace& face = plan_.faces[*planned];
        const double off = face.Normal().dot(p - face.start) / reach_m;
        place->score_m += length_m * (1 - off * off);
      });
    }
    place->differing_m += SeenThrough(place->T_plan_world) + Walked(place->T_plan_world);
    place->score_m -= place->differing_m;
  }

 private:
  template <typename Visit>
  static void ForEachSample(const PlannedFace& face, Visit visit) {
    const int count = std::max(1, static_cast<int>(std::lround(face.Length() / kStep_m)));
    for (int i = 0; i < count; ++i) {
      visit(face.start + (i + 0.5) / count * (face.end - face.start), face.Length() / count);
    }
  }

  // Planned faces where the map knows that nothing stands, neither there nor behind.
  double SeenThrough(const PlanPose& pose) const {
    double length_m = 0;
    for (const PlannedFace& face : plan_.faces) {
      ForEachSample(face, [&](const Vector2d& p, double part_m) {
        const Vector2d behind = p - kBehindFace_m * face.Normal();
        if (built_.free.IsFree(Back(pose, p)) && built_.free.IsFree(Back(pose, behind))) {
          length_m += part_m;
        }
      });
    }
    return 0.5 * length_m;  // walls have two sides
  }

  double Walked(const PlanPose& pose) const {
    constexpr double kCrossing_m = 1;  // of wall that each stands for
    int crossings = 0;
    const std::vector<Vector2d>& way = built_.trajectory;
    for (std::size_t i = 1; i < way.size(); ++i) {
      const Vector2d a = pose * way[i - 1], b = pose * way[i];
      for (const PlannedFace& face : plan_.faces) crossings += Cross(a, b, face.start, face.end);
    }
    return 0.5 * kCrossing_m * crossings;
  }

  static Vector2d Back(const PlanPose& pose, const Vector2d& p) {
    return PlanPose{-pose.yaw_rad, Vector2d::Zero()}.Turn(p - pose.shift);
  }

  const BuiltStorey& built_;
  const BuildingPlan& plan_;
  const FaceIndex index_;
};

PlanPlacement MakePlace(const AlignmentFit& fit) {
  PlanPlacement place;
  place.T_plan_world = {ComputeYaw(fit.T_first_second), fit.T_first_second.translation.head<2>()};
  place.middle = fit.information.centre_first.head<2>();
  const Eigen::Matrix4d covariance = fit.information.of_turn_and_shift.inverse();
  constexpr std::array kOrder = {1, 2, 0};  // x, y and yaw
  place.covariance = covariance(kOrder, kOrder);
  return place;
}

bool IsOtherPlace(const PlanPlacement& a, const PlanPlacement& b) {
  constexpr double kOther_m = 0.5, kOtherTurn_rad = 5 * kDegree;
  const double turn_rad =
      std::remainder(a.T_plan_world.yaw_rad - b.T_plan_world.yaw_rad, 2 * std::numbers::pi);
  return (a.middle - b.middle).norm() > kOther_m || std::abs(turn_rad) > kOtherTurn_rad;
}

std::vector<PlannedFace> FacesIn(const BuiltStorey& built) {
  std::vector<PlannedFace> faces;
  for (const MappedFace& face : built.faces) faces.push_back(face.face);
  return faces;
}

double Extent(const std::vector<PlannedFace>& faces) {
  Eigen::AlignedBox2d box;
  for (const PlannedFace& face : faces) box.extend(face.start).extend(face.end);
  return box.sizes().maxCoeff();
}

// Finds and judges places of a storey in a plan.
class PlaceFinder {
 public:
  PlaceFinder(const BuiltStorey& built, BuildingPlan plan)
      : plan_(std::move(plan)),
        judge_(built, plan_),
        planned_(MakeFeatures(plan_.faces)),
        mapped_(MakeFeatures(FacesIn(built))),
        index_(planned_) {}

  // By score, the best first.
  std::vector<PlanPlacement> FindAll(const std::optional<RoughStart>& start,
                                     const Progress& progress) const {
    std::vector<PlanPlacement> places;
    for (const auto& candidate : FindCandidates(planned_, mapped_, {start}, progress)) {
      AddFit(candidate.T_first_second, kWideFit, &places);
    }
    std::ranges::stable_sort(places, [](const PlanPlacement& a, const PlanPlacement& b) {
      return a.score_m > b.score_m;
    });
    return places;
  }

  std::optional<PlanPlacement> FindNear(const PlanPose& pose) const {
    std::vector<PlanPlacement> place;
    AddFit(LevelTransform(pose.yaw_rad, {pose.shift.x(), pose.shift.y(), 0}), kWideFit, &place);
    return place.empty() ? std::nullopt : std::optional(place.front());
  }

  // Lines beside each other, of windows or of both sides of a wall, hold a place that is off by as
  // much as they are apart: the best of those around it.
  PlanPlacement Improve(const PlanPlacement& found) const {
    constexpr AlignmentFitOptions kNearFit{.from_m = 0.1, .to_m = 0.03, .steps = 8};
    std::vector<PlanPlacement> places = {found};
    for (const double x_m : {-0.2, -0.1, 0.0, 0.1, 0.2}) {
      for (const double y_m : {-0.2, -0.1, 0.0, 0.1, 0.2}) {
        const Vector2d shift = found.T_plan_world.shift + Vector2d(x_m, y_m);
        AddFit(LevelTransform(found.T_plan_world.yaw_rad, {shift.x(), shift.y(), 0}), kNearFit,
               &places);
      }
    }
    return *std::ranges::max_element(places, {}, &PlanPlacement::score_m);
  }

 private:
  void AddFit(const RigidTransform& T_plan_world, const AlignmentFitOptions& options,
              std::vector<PlanPlacement>* places) const {
    const auto fit = FitAlignment(index_, mapped_, T_plan_world, options);
    if (!fit) return;  // walls that lie along each other hold none
    places->push_back(MakePlace(*fit));
    judge_.Judge(&places->back());
  }

  const BuildingPlan plan_;
  const PlaceJudge judge_;
  const AlignmentFeatures planned_, mapped_;
  const FeatureIndex index_;
};

}  // namespace

std::optional<PlanPlacement> FindPlacement(const BuiltStorey& built, const BuildingPlan& plan,
                                           const std::optional<RoughStart>& start,
                                           const Progress& progress) {
  if (built.faces.empty() || plan.faces.empty()) return std::nullopt;
  const PlaceFinder finder(built, plan);
  const std::vector<PlanPlacement> places = finder.FindAll(start, progress);
  if (places.empty()) return std::nullopt;
  PlanPlacement best = finder.Improve(places.front());
  for (const PlanPlacement& place : places) {
    if (!IsOtherPlace(best, place)) continue;
    PlanPlacement rival = finder.Improve(place);
    if (rival.score_m > best.score_m) std::swap(best, rival);
    best.rival = rival.T_plan_world;
    best.rival_share = best.score_m > 0 ? std::max(0.0, rival.score_m / best.score_m) : 0;
    break;
  }
  return best;
}

std::optional<double> FindBetterScale(const BuiltStorey& built, const BuildingPlan& plan,
                                      const PlanPlacement& placement) {
  constexpr double kBetter = 0.1;                        // more that agrees
  constexpr double kLeastLarger = 0.6, kMostLarger = 6;  // than what was walked
  std::optional<double> best;
  double best_m = placement.score_m + kBetter * placement.agreeing_m;
  const auto compare = [&](double scale, const std::optional<PlanPlacement>& place) {
    if (!place || place->AgreeingShare() < kWellAgreeing || place->score_m <= best_m) return;
    best = scale, best_m = place->score_m;
  };
  for (const double scale : {0.97, 0.98, 0.99, 1.01, 1.02, 1.03}) {
    PlanPose pose = placement.T_plan_world;
    pose.shift += (scale - 1) * placement.middle;  // where the map's middle comes to lie
    compare(scale, PlaceFinder(built, StretchPlan(plan, {scale, scale})).FindNear(pose));
  }
  const double larger = Extent(plan.faces) / Extent(FacesIn(built));
  for (const double scale : {0.001, 0.01, 0.0254, 0.1, 0.3048, 10.0, 39.37, 100.0, 1000.0}) {
    if (scale * larger < kLeastLarger || scale * larger > kMostLarger) continue;
    const auto places = PlaceFinder(built, StretchPlan(plan, {scale, scale})).FindAll({}, {});
    if (!places.empty()) compare(scale, places.front());
  }
  return best;
}

}  // namespace slcmap::mapping
