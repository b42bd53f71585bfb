#include "mapping/plan/plan_deviations.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "mapping/align/map_agreement.h"

namespace slcmap::inline mapping {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kLeastShared_m = 0.3;   // of a planned and a built face
constexpr double kLeastStretch_m = 0.5;  // that is missing or new
constexpr double kOpeningNear_m = 0.4;   // across the wall
// Of the side of an opening: frames stand in gaps as they are drawn, and leaves before them.
constexpr double kJambSigma_m = 0.05;
constexpr double kDeviatingSigmas = 2.33;  // one wall in fifty by chance

// What a built and a planned face share: along the planned one.
struct FacePair {
  std::size_t built = 0, planned = 0;
  double from_m = 1e9, to_m = -1e9, shared_m = 0;
};

double Across(const PlannedFace& planned, const Vector2d& p) {
  return planned.Normal().dot(p - planned.start);
}

// A planned face as it is looked at from before the built one.
PlannedFace FacingAlike(PlannedFace planned, const Vector2d& normal) {
  if (planned.Normal().dot(normal) < 0) std::swap(planned.start, planned.end);
  return planned;
}

PlannedFace Placed(const PlannedFace& face, const PlanPose& pose) {
  PlannedFace placed = face;
  placed.start = pose * face.start, placed.end = pose * face.end;
  return placed;
}

class PlanComparer {
 public:
  PlanComparer(const BuiltStorey& built, const BuildingPlan& plan, const PlanPlacement& placement)
      : built_(built), plan_(plan), placement_(placement), index_(plan.faces) {}

  PlanComparison Compare() {
    Refine();
    FindPairs();
    PlanComparison comparison;
    comparison.planned_storey = plan_.name;
    comparison.storey = built_.id;
    const PlanPose& pose = placement_.T_plan_world;
    comparison.T_plan_world = LevelTransform(pose.yaw_rad, {pose.shift.x(), pose.shift.y(), 0});
    comparison.sigma_m = std::sqrt(placement_.covariance.topLeftCorner<2, 2>().trace() / 2);
    comparison.yaw_sigma_rad = std::sqrt(placement_.covariance(2, 2));
    comparison.agreeing_m = placement_.agreeing_m;
    comparison.differing_m = placement_.differing_m;
    comparison.rival_share = placement_.rival_share;
    for (const FacePair& pair : pairs_) comparison.walls.push_back(CompareFaces(pair));
    AddMissing(&comparison.walls);
    AddNew(&comparison.walls);
    AddOpenings(&comparison.openings);
    return comparison;
  }

 private:
  PlannedFace Built(std::size_t i) const {
    return Placed(built_.faces[i].face, placement_.T_plan_world);
  }

  void FindPairs() {
    pairs_.clear();
    covered_.assign(plan_.faces.size(), {});
    matched_.assign(built_.faces.size(), {});
    for (std::size_t i = 0; i < built_.faces.size(); ++i) {
      const PlannedFace built = Built(i);
      std::map<std::size_t, FacePair> of_built;
      const int count = std::max(1, static_cast<int>(std::lround(built.Length() / kPlanSample_m)));
      for (int k = 0; k < count; ++k) {
        const Vector2d p = built.start + (k + 0.5) / count * (built.end - built.start);
        const bool is_measured = built_.faces[i].IsMeasuredAt((k + 0.5) / count);
        const auto match = index_.FindNearest(p, built.Normal(), kSameWall_m);
        // What was not measured is as planned, or as what is before it.
        const bool is_as_before = !is_measured && (matched_[i].empty() || matched_[i].back());
        matched_[i].push_back(match || is_as_before);
        if (!match || !is_measured) continue;
        const PlannedFace planned = FacingAlike(plan_.faces[*match], built.Normal());
        const double half_m = 0.5 * built.Length() / count;
        const double along_m =
            std::clamp(planned.Along().dot(p - planned.start), 0.0, planned.Length());
        FacePair& pair = of_built[*match];
        pair.built = i, pair.planned = *match;
        pair.from_m = std::min(pair.from_m, std::max(0.0, along_m - half_m));
        pair.to_m = std::max(pair.to_m, std::min(planned.Length(), along_m + half_m));
        pair.shared_m += 2 * half_m;
      }
      for (const auto& [planned, pair] : of_built) {
        covered_[planned].push_back({pair.from_m, pair.to_m});
        if (pair.shared_m >= kLeastShared_m) pairs_.push_back(pair);
      }
    }
  }

  // A mixture: faces are where they were planned, within what is known of them, or anywhere near.
  void Refine() {
    constexpr int kSteps = 14;
    constexpr double kFrom_m = 0.03;
    double planned_share = 0.7;
    for (int step = 0; step < kSteps; ++step) {
      FindPairs();
      const double scale_m = step + 4 < kSteps ? kFrom_m * std::pow(0.6, step) : 0;
      if (!RefineStep(scale_m, &planned_share)) return;
    }
  }

  bool RefineStep(double scale_m, double* planned_share) {
    Matrix3d information = Matrix3d::Zero();
    Vector3d gradient = Vector3d::Zero();
    double planned_sum = 0, square_sum = 0;
    for (const FacePair& pair : pairs_) {
      const PlannedFace built = Built(pair.built);
      const PlannedFace planned = FacingAlike(plan_.faces[pair.planned], built.Normal());
      const double variance = Variance(pair) + scale_m * scale_m;
      const double middle_m = Across(planned, Shared(pair, built, planned));
      const double likely = *planned_share * std::exp(-0.5 * middle_m * middle_m / variance) /
                            std::sqrt(2 * std::numbers::pi * variance);
      const double weight = likely / (likely + (1 - *planned_share) / (2 * kSameWall_m));
      planned_sum += weight;
      square_sum += weight * middle_m * middle_m / variance;
      // Both ends of the middle two thirds say as much as all of a line that was fitted.
      for (const double side : {-1.0, 1.0}) {
        const Vector2d p =
            Shared(pair, built, planned) + side * pair.shared_m / std::sqrt(12.0) * built.Along();
        const Vector2d n = planned.Normal(), off = p - placement_.middle;
        const Vector3d jacobian(n.x(), n.y(), n.dot(Vector2d(-off.y(), off.x())));
        information += 0.5 * weight / variance * jacobian * jacobian.transpose();
        gradient += 0.5 * weight / variance * Across(planned, p) * jacobian;
      }
    }
    constexpr double kLeastInformation = 100;  // a standard deviation of 10 cm
    Eigen::SelfAdjointEigenSolver<Matrix3d> solver(information);
    if (solver.eigenvalues()[0] < kLeastInformation) return false;
    const Matrix3d inverse = information.inverse();
    const Vector3d step = -inverse * gradient;
    PlanPose& pose = placement_.T_plan_world;
    pose.shift = placement_.middle + step.head<2>() +
                 PlanPose{step.z(), Vector2d::Zero()}.Turn(pose.shift - placement_.middle);
    pose.yaw_rad = std::remainder(pose.yaw_rad + step.z(), 2 * std::numbers::pi);
    *planned_share = std::clamp(planned_sum / static_cast<double>(pairs_.size()), 0.3, 0.95);
    placement_.covariance = std::max(1.0, square_sum / std::max(planned_sum, 1e-9)) * inverse;
    return true;
  }

  double Variance(const FacePair& pair) const {
    const double built_m = built_.faces[pair.built].face.sigma_m;
    const double planned_m = plan_.faces[pair.planned].sigma_m;
    return built_m * built_m + planned_m * planned_m;
  }

  // The place of the built face in the middle of what it shares with the planned one.
  static Vector2d Shared(const FacePair& pair, const PlannedFace& built,
                         const PlannedFace& planned) {
    const Vector2d middle = planned.start + 0.5 * (pair.from_m + pair.to_m) * planned.Along();
    return built.start + built.Along().dot(middle - built.start) * built.Along();
  }

  WallDeviation CompareFaces(const FacePair& pair) const {
    const PlannedFace built = Built(pair.built);
    const PlannedFace planned = FacingAlike(plan_.faces[pair.planned], built.Normal());
    WallDeviation row;
    row.planned = static_cast<int64_t>(pair.planned);
    row.plane = built_.faces[pair.built].plane;
    row.start_plan = planned.start + pair.from_m * planned.Along();
    row.end_plan = planned.start + pair.to_m * planned.Along();
    const Vector2d middle = Shared(pair, built, planned);
    row.deviation_m = Across(planned, middle);
    const double placed_m = placement_.SigmaAt(middle, planned.Normal());
    row.sigma_m = std::sqrt(Variance(pair) + placed_m * placed_m);
    const Vector2d a = planned.Along(), b = built.Along();
    row.turn_rad = std::asin(std::clamp(a.x() * b.y() - a.y() * b.x(), -1.0, 1.0));
    row.turn_sigma_rad =
        std::hypot(std::sqrt(12.0) * std::hypot(built.sigma_m / built.Length(),
                                                planned.sigma_m / planned.Length()),
                   std::sqrt(placement_.covariance(2, 2)));
    const bool deviates = std::abs(row.deviation_m) > kDeviatingSigmas * row.sigma_m;
    row.status = deviates ? PlanStatus::kDeviates : PlanStatus::kAsPlanned;
    return row;
  }

  Vector2d InWorld(const Vector2d& p_plan) const {
    const PlanPose& pose = placement_.T_plan_world;
    return PlanPose{-pose.yaw_rad, Vector2d::Zero()}.Turn(p_plan - pose.shift);
  }

  bool IsFree(const Vector2d& p_plan) const { return built_.free.IsFree(InWorld(p_plan)); }

  // Stretches of a face for whose samples something holds.
  template <typename Holds>
  static std::vector<PlannedFace> Stretches(const PlannedFace& face, Holds holds) {
    std::vector<PlannedFace> stretches;
    const int count = std::max(1, static_cast<int>(std::lround(face.Length() / kPlanSample_m)));
    const auto at = [&](int k) {
      return Vector2d(face.start + k * (face.end - face.start) / count);
    };
    int from = 0;
    for (int k = 0; k <= count; ++k) {
      if (k < count && holds(k, 0.5 * (at(k) + at(k + 1)))) continue;
      PlannedFace stretch = face;
      stretch.start = at(from), stretch.end = at(k);
      if (stretch.Length() >= kLeastStretch_m) stretches.push_back(stretch);
      from = k + 1;
    }
    return stretches;
  }

  void AddMissing(std::vector<WallDeviation>* rows) const {
    for (std::size_t i = 0; i < plan_.faces.size(); ++i) {
      const PlannedFace& face = plan_.faces[i];
      const auto is_missing = [&](int, const Vector2d& p) {
        const double along_m = (p - face.start).norm();
        return IsFree(p) && IsFree(p - kBehindFace_m * face.Normal()) &&
               std::ranges::none_of(covered_[i], [&](const std::pair<double, double>& part) {
                 return along_m > part.first && along_m < part.second;
               });
      };
      for (const PlannedFace& stretch : Stretches(face, is_missing)) {
        rows->push_back(
            {PlanStatus::kMissing, static_cast<int64_t>(i), -1, stretch.start, stretch.end});
      }
    }
  }

  void AddNew(std::vector<WallDeviation>* rows) const {
    for (std::size_t i = 0; i < built_.faces.size(); ++i) {
      const PlannedFace built = Built(i);
      const auto is_new = [&](int k, const Vector2d& p) {
        return !matched_[i][static_cast<std::size_t>(k)] && !IsInPlannedOpening(p);
      };
      for (const PlannedFace& stretch : Stretches(built, is_new)) {
        rows->push_back({PlanStatus::kNew, -1, built_.faces[i].plane, stretch.start, stretch.end});
      }
    }
  }

  static bool IsWithin(const PlannedOpening& opening, const Vector2d& p) {
    const Vector2d along = opening.end - opening.start, off = p - opening.start;
    const double share = off.dot(along) / along.squaredNorm();
    return share > -0.1 && share < 1.1 &&
           std::abs(along.x() * off.y() - along.y() * off.x()) < kOpeningNear_m * along.norm();
  }

  bool IsInPlannedOpening(const Vector2d& p) const {
    return std::ranges::any_of(plan_.openings,
                               [&](const PlannedOpening& opening) { return IsWithin(opening, p); });
  }

  // A built opening in the plan, from the start of the planned one to its end.
  PlannedOpening PlacedLike(const PlannedOpening& planned, const PlannedOpening& opening) const {
    const PlanPose& pose = placement_.T_plan_world;
    PlannedOpening placed{pose * opening.start, pose * opening.end};
    if ((placed.end - placed.start).dot(planned.end - planned.start) < 0) {
      std::swap(placed.start, placed.end);
    }
    return placed;
  }

  void AddOpenings(std::vector<OpeningDeviation>* rows) const {
    std::vector<bool> taken(built_.openings.size());
    for (std::size_t i = 0; i < plan_.openings.size(); ++i) {
      const PlannedOpening& planned = plan_.openings[i];
      std::optional<std::size_t> nearest;
      double least_m = 0.5 * (planned.end - planned.start).norm() + 0.3;
      for (std::size_t k = 0; k < built_.openings.size(); ++k) {
        const PlannedOpening built = PlacedLike(planned, built_.openings[k].opening);
        const Vector2d middle = 0.5 * (built.start + built.end);
        const double off_m = (middle - 0.5 * (planned.start + planned.end)).norm();
        const double turned =
            (built.end - built.start).normalized().dot((planned.end - planned.start).normalized());
        if (taken[k] || !IsWithin(planned, middle) || turned < 0.97 || off_m > least_m) continue;
        nearest = k, least_m = off_m;
      }
      if (nearest) {
        taken[*nearest] = true;
        rows->push_back(CompareOpenings(i, *nearest));
      } else if (IsClosed(planned)) {
        rows->push_back(
            {PlanStatus::kMissing, static_cast<int64_t>(i), -1, planned.start, planned.end});
      }
    }
    for (std::size_t k = 0; k < taken.size(); ++k) {
      if (!taken[k]) AddNewOpening(built_.openings[k], rows);
    }
  }

  OpeningDeviation CompareOpenings(std::size_t i, std::size_t k) const {
    const PlannedOpening& planned = plan_.openings[i];
    const PlannedOpening built = PlacedLike(planned, built_.openings[k].opening);
    const Vector2d along = (planned.end - planned.start).normalized();
    OpeningDeviation row{PlanStatus::kAsPlanned, static_cast<int64_t>(i), built_.openings[k].wall,
                         planned.start, planned.end};
    row.moved_m = along.dot(0.5 * (built.start + built.end) - 0.5 * (planned.start + planned.end));
    row.wider_m = along.dot(built.end - built.start) - (planned.end - planned.start).norm();
    row.moved_sigma_m =
        std::hypot(kJambSigma_m / std::sqrt(2.0), placement_.SigmaAt(planned.start, along));
    row.wider_sigma_m = kJambSigma_m * std::sqrt(2.0);
    if (std::abs(row.moved_m) > kDeviatingSigmas * row.moved_sigma_m ||
        std::abs(row.wider_m) > kDeviatingSigmas * row.wider_sigma_m) {
      row.status = PlanStatus::kDeviates;
    }
    return row;
  }

  // Whether a wall was seen to go over all of an opening.
  bool IsClosed(const PlannedOpening& planned) const {
    const Vector2d across = planned.end - planned.start;
    return std::ranges::any_of(built_.faces, [&](const MappedFace& face) {
      const PlannedFace built = Placed(face.face, placement_.T_plan_world);
      return std::ranges::all_of(std::vector{0.1, 0.5, 0.9}, [&](double share) {
        const Vector2d p = planned.start + share * across;
        const double along_m = built.Along().dot(p - built.start);
        return std::abs(Across(built, p)) < kOpeningNear_m && along_m > 0 &&
               along_m < built.Length() && !IsFree(p - Across(built, p) * built.Normal());
      });
    });
  }

  void AddNewOpening(const BuiltOpening& opening, std::vector<OpeningDeviation>* rows) const {
    const PlanPose& pose = placement_.T_plan_world;
    const Vector2d a = pose * opening.opening.start, b = pose * opening.opening.end;
    const Vector2d along = (b - a).normalized(), normal(along.y(), -along.x());
    for (const double side : {1.0, -1.0}) {
      if (!index_.FindNearest(0.5 * (a + b), side * normal, kOpeningNear_m)) continue;
      rows->push_back({PlanStatus::kNew, -1, opening.wall, a, b});
      return;
    }
  }

  const BuiltStorey& built_;
  const BuildingPlan& plan_;
  PlanPlacement placement_;
  const FaceIndex index_;
  std::vector<FacePair> pairs_;
  std::vector<std::vector<std::pair<double, double>>> covered_;  // of planned faces
  std::vector<std::vector<bool>> matched_;                       // by sample of built faces
};

}  // namespace

PlanComparison CompareWithPlan(const BuiltStorey& built, const BuildingPlan& plan,
                               const PlanPlacement& placement) {
  return PlanComparer(built, plan, placement).Compare();
}

}  // namespace slcmap::mapping
