#include "mapping/plan/plan_placement.h"

#include <spdlog/fmt/fmt.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "mapping/align/map_agreement.h"
#include "mapping/align/plan_votes.h"

namespace slcmap::inline mapping {

using Eigen::Matrix3d;
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

constexpr double kStep_m = 0.1;   // of samples along faces
constexpr double kAgree_m = 0.1;  // beyond three standard deviations
constexpr double kTurned_rad = std::numbers::pi / 180;

// Directions modulo a quarter turn that faces have, the strongest first.
std::vector<double> FindHeadings(const std::vector<PlannedFace>& faces) {
  constexpr int kBins = 90, kMost = 4;
  constexpr double kLeastShare = 0.15;
  std::vector<double> lengths(kBins);
  const auto heading_of = [](const PlannedFace& face) {
    const double deg = std::atan2(face.Along().y(), face.Along().x()) / kTurned_rad;
    return deg - 90 * std::floor(deg / 90);
  };
  for (const PlannedFace& face : faces) {
    lengths[static_cast<int>(heading_of(face)) % kBins] += face.Length();
  }
  const auto around = [&](int bin) {
    return lengths[(bin + kBins - 1) % kBins] + lengths[bin] + lengths[(bin + 1) % kBins];
  };
  std::vector<std::pair<double, int>> peaks;
  for (int bin = 0; bin < kBins; ++bin) {
    if (around(bin) > 0 && around(bin) >= around((bin + 1) % kBins) &&
        around(bin) >= around((bin + kBins - 1) % kBins)) {
      peaks.emplace_back(-around(bin), bin);
    }
  }
  std::ranges::sort(peaks);
  std::vector<double> headings;
  for (const auto& [length, bin] : peaks) {
    if (-length < kLeastShare * -peaks.front().first || headings.size() == kMost) break;
    double sum = 0, weight = 0;  // of what is off the middle of the bin
    for (const PlannedFace& face : faces) {
      const double off = std::remainder(heading_of(face) - bin - 0.5, 90.0);
      if (std::abs(off) > 2) continue;
      sum += face.Length() * off;
      weight += face.Length();
    }
    headings.push_back((bin + 0.5 + sum / weight) * kTurned_rad);
  }
  return headings;
}

// Faces as what maps are aligned by; the floor, which both have, is at z = 0.
AlignmentFeatures MakeFeatures(const std::vector<PlannedFace>& faces) {
  AlignmentFeatures features;
  for (const PlannedFace& face : faces) {
    for (double at = 0.5 * kStep_m; at < face.Length(); at += kStep_m) {
      const Vector2d p = face.start + at * face.Along(), n = face.Normal();
      for (const double side : {1.0, -1.0}) {
        if (side < 0 && !face.two_sided) continue;
        features.surfaces.push_back({{p.x(), p.y(), 1}, {side * n.x(), side * n.y(), 0}});
      }
    }
  }
  features.surfaces.push_back({features.surfaces.front().p_world - Vector3d::UnitZ()});
  features.headings_rad = FindHeadings(faces);
  return features;
}

// What a place of the map in the plan is judged by.
class PlaceJudge {
 public:
  PlaceJudge(const BuiltStorey& built, const BuildingPlan& plan)
      : built_(built), plan_(plan), index_(plan.faces) {}

  // Lengths of what agrees, and of what does not: faces where none is planned, planned ones that
  // the map looks through, and walls that were walked through.
  void Judge(PlanPlacement* place) const {
    place->agreeing_m = place->differing_m = 0;
    for (const MappedFace& built : built_.faces) {
      const double reach_m = 3 * built.face.sigma_m + kAgree_m;
      ForEachSample(built.face, [&](const Vector2d& p, double length_m) {
        const bool agrees = index_
                                .FindNearest(place->T_plan_world * p,
                                             place->T_plan_world.Turn(built.face.Normal()), reach_m)
                                .has_value();
        (agrees ? place->agreeing_m : place->differing_m) += length_m;
      });
    }
    place->differing_m += SeenThrough(place->T_plan_world) + Walked(place->T_plan_world);
    place->score_m = place->agreeing_m - place->differing_m;
  }

  // Moves a place to where offsets of faces fit best: robustly, as walls are not where they were
  // planned, and from a wide reach down to the scatter of what was measured.
  void Fit(PlanPlacement* place) const {
    constexpr double kFrom_m = 0.4, kTo_m = 0.01;
    constexpr int kSteps = 16;
    for (int step = 0; step < kSteps; ++step) {
      const double share = static_cast<double>(step) / (kSteps - 1);
      if (!FitStep(kFrom_m * std::pow(kTo_m / kFrom_m, share), place)) return;
    }
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
    constexpr double kBehind_m = 0.12;
    double length_m = 0;
    for (const PlannedFace& face : plan_.faces) {
      ForEachSample(face, [&](const Vector2d& p, double part_m) {
        const Vector2d behind = p - kBehind_m * face.Normal();
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

  bool FitStep(double scale_m, PlanPlacement* place) const;

  const BuiltStorey& built_;
  const BuildingPlan& plan_;
  const FaceIndex index_;
};

bool PlaceJudge::FitStep(double scale_m, PlanPlacement* place) const {
  Vector2d middle = Vector2d::Zero();
  for (const MappedFace& built : built_.faces) middle += built.face.Middle();
  place->middle = place->T_plan_world * (middle / static_cast<double>(built_.faces.size()));
  Matrix3d information = Matrix3d::Zero(), scatter = Matrix3d::Zero();
  Vector3d gradient = Vector3d::Zero();
  for (const MappedFace& built : built_.faces) {
    const Vector2d normal = place->T_plan_world.Turn(built.face.Normal());
    // What all of a face is off is one measurement, so its samples share its weight.
    Matrix3d of_face = Matrix3d::Zero();
    Vector3d to_plan = Vector3d::Zero();
    double matched = 0, square_sum = 0, samples = 0;
    ForEachSample(built.face, [&](const Vector2d& p_world, double) {
      ++samples;
      const Vector2d p = place->T_plan_world * p_world;
      const auto match = index_.FindNearest(p, normal, std::min(FaceIndex::kReach_m, 3 * scale_m));
      if (!match) return;
      const double planned_m = plan_.faces[match->face].sigma_m;
      const double variance = built.face.sigma_m * built.face.sigma_m + planned_m * planned_m;
      const double spread = variance + scale_m * scale_m;
      const double ratio = match->off_m * match->off_m / spread;
      const double robust = 1 / ((1 + ratio) * (1 + ratio));
      const Vector2d off = p - place->middle;
      const Vector3d jacobian(match->normal.x(), match->normal.y(),
                              match->normal.dot(Vector2d(-off.y(), off.x())));
      const double weight = robust / spread;
      of_face += weight * jacobian * jacobian.transpose();
      to_plan += weight * match->off_m * jacobian;
      square_sum += match->off_m * match->off_m;
      ++matched;
    });
    if (matched == 0) continue;
    // Long walls say more of the turn, by their samples' places, and a little more of the offset.
    const double share = std::sqrt(matched * kStep_m) / matched;
    information += share * of_face;
    gradient += share * to_plan;
    scatter += share * share * to_plan * to_plan.transpose();
  }
  constexpr double kLeastInformation = 1;  // a standard deviation of a metre
  Eigen::SelfAdjointEigenSolver<Matrix3d> solver(information);
  if (solver.eigenvalues()[0] < kLeastInformation) return false;
  const Matrix3d inverse = information.inverse();
  const Vector3d step = -inverse * gradient;
  const PlanPose turned{step.z(), Vector2d::Zero()};
  PlanPose& pose = place->T_plan_world;
  pose.shift = place->middle + step.head<2>() + turned.Turn(pose.shift - place->middle);
  pose.yaw_rad = std::remainder(pose.yaw_rad + step.z(), 2 * std::numbers::pi);
  // By how much faces pull in different directions, which is at least what they are known to.
  place->covariance = inverse * (scatter + gradient * gradient.transpose()) * inverse;
  return true;
}

bool IsOtherPlace(const PlanPlacement& a, const PlanPlacement& b) {
  constexpr double kOther_m = 0.5, kOtherTurn_rad = 5 * kTurned_rad;
  const double turn_rad =
      std::remainder(a.T_plan_world.yaw_rad - b.T_plan_world.yaw_rad, 2 * std::numbers::pi);
  return (a.middle - b.middle).norm() > kOther_m || std::abs(turn_rad) > kOtherTurn_rad;
}

std::vector<PlannedFace> FacesIn(const BuiltStorey& built) {
  std::vector<PlannedFace> faces;
  for (const MappedFace& face : built.faces) faces.push_back(face.face);
  return faces;
}

}  // namespace

std::optional<PlanPlacement> FindPlacement(const BuiltStorey& built, const BuildingPlan& plan,
                                           const std::optional<RoughStart>& start,
                                           const Progress& progress) {
  if (built.faces.empty() || plan.faces.empty()) return std::nullopt;
  const PlaceJudge judge(built, plan);
  std::vector<PlanPlacement> places;
  for (const AlignmentCandidate& candidate :
       FindCandidates(MakeFeatures(plan.faces), MakeFeatures(FacesIn(built)), {start}, progress)) {
    PlanPlacement place;
    place.T_plan_world = {ComputeYaw(candidate.T_first_second),
                          candidate.T_first_second.translation.head<2>()};
    judge.Fit(&place);
    judge.Judge(&place);
    places.push_back(place);
  }
  if (places.empty()) return std::nullopt;
  std::ranges::stable_sort(
      places, [](const PlanPlacement& a, const PlanPlacement& b) { return a.score_m > b.score_m; });
  PlanPlacement& best = places.front();
  for (const PlanPlacement& place : places) {
    if (!IsOtherPlace(best, place)) continue;
    best.rival = place.T_plan_world;
    best.rival_share = std::max(0.0, place.score_m / best.score_m);
    break;
  }
  return best;
}

}  // namespace slcmap::mapping
