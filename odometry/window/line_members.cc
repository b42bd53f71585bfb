#include "odometry/window/line_members.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>

namespace slcmap {
namespace {

// A membership that is given up needlessly costs next to nothing, one that is wrong bends the line.
constexpr double kMaxChi2 = 6.0;  // of two dimensions: 95 %
constexpr size_t kMinViews = 3;   // fewer may agree on a place by chance

}  // namespace

bool IsAtRest(const PointPlace& place) {
  return place.chi2 <= place.freedoms + 3 * std::sqrt(2.0 * place.freedoms);
}

Membership JudgeMembership(const LineLandmarkOptions& options, const PointLandmark& point,
                           const LineLandmark& line, const CostModel& model, const Prior& prior) {
  using Eigen::Matrix2d;
  if (point.frames.size() < kMinViews) return Membership::kOpen;
  const std::optional<PointPlace> place = PlaceByObservations(point, model);
  if (!place) return Membership::kOpen;
  if (!IsAtRest(*place)) return Membership::kRefuted;
  const Matrix32d across = line.AcrossAxisInWorld();
  const Eigen::Vector2d off =
      across.transpose() * (place->p_world - NearestOn(line.InWorld(), place->p_world));
  const Eigen::Matrix3d in_world =
      place->covariance_m2 + ConditionalCovarianceAcross(line, place->p_world, model, prior);
  const Matrix2d known = across.transpose() * in_world * across;
  const Matrix2d scatter = options.point_sigma_m * options.point_sigma_m * Matrix2d::Identity();
  if (!(off.dot((known + scatter).ldlt().solve(off)) <= kMaxChi2)) return Membership::kRefuted;
  const Eigen::SelfAdjointEigenSolver<Matrix2d> eigen(known, Eigen::EigenvaluesOnly);
  const double limit_m2 = options.max_member_sigma_m * options.max_member_sigma_m;
  return eigen.eigenvalues()[1] <= limit_m2 ? Membership::kHolds : Membership::kOpen;
}

std::unordered_set<int64_t> AdoptMembers(const LineLandmarkOptions& options, const CostModel& model,
                                         PointsOnLines* memberships, WindowState* window) {
  std::unordered_set<int64_t> misplaced;
  for (auto& [id, line] : window->lines) {
    if (!line.estimated || line.retired || !line.IsStructural()) continue;
    const std::vector<int64_t> before = std::exchange(line.points, {});
    for (const int64_t point_id : memberships->PointsOf(id)) {
      const auto it = window->landmarks.find(point_id);
      const bool in_window = it != window->landmarks.end() && it->second.triangulated;
      Membership judged = Membership::kOpen;
      if (in_window) {
        judged = JudgeMembership(options, it->second, line, model, window->prior);
      } else if (std::find(before.begin(), before.end(), point_id) != before.end()) {
        judged = Membership::kHolds;
      }
      if (judged == Membership::kHolds) line.points.push_back(point_id);
      if (judged != Membership::kRefuted) continue;
      memberships->Release({point_id, id});
      if (line.placed_by == point_id) misplaced.insert(id);
    }
  }
  return misplaced;
}

void MergeMembers(int64_t line_id, int64_t into_line_id, PointsOnLines* memberships,
                  WindowState* window) {
  memberships->MergeLine(line_id, into_line_id);
  const std::vector<int64_t> verified = memberships->PointsOf(into_line_id);  // sorted
  std::erase_if(window->lines.at(into_line_id).points, [&](int64_t id) {
    return !std::binary_search(verified.begin(), verified.end(), id);
  });
}

void ForgetMembers(const std::unordered_set<int64_t>& point_ids, PointsOnLines* memberships,
                   WindowState* window) {
  for (const int64_t id : point_ids) memberships->ReleasePoint(id);
  for (auto& [line_id, line] : window->lines) {
    std::erase_if(line.points, [&](int64_t id) { return point_ids.contains(id); });
  }
}

}  // namespace slcmap
