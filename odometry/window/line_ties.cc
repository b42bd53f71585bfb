#include "odometry/window/line_ties.h"

#include <cmath>

namespace slcmap {

using Eigen::Vector3d;

namespace {

// The one that lines around there share, made where there is none.
SharedDeviation* SharedBy(const LineLandmark& line, double max_distance_m, WindowState* window) {
  const Vector3d p_world = line.InWorld().point_world;
  for (SharedDeviation& shared : window->shared_deviations) {
    if (shared.axis == line.axis && shared.heading == line.heading &&
        (shared.p_world - p_world).norm() < max_distance_m) {
      return &shared;
    }
  }
  return &window->shared_deviations.emplace_back(
      SharedDeviation{line.axis, line.heading, p_world, {}, 0});
}

// Those that no line has but those of `gone`.
std::unordered_set<const SharedDeviation*> SharedByNone(const std::unordered_set<int64_t>& gone,
                                                        const WindowState& window) {
  std::unordered_set<const SharedDeviation*> unused;
  for (const SharedDeviation& shared : window.shared_deviations) unused.insert(&shared);
  for (const auto& [id, line] : window.lines) {
    if (!gone.contains(id)) unused.erase(line.shared);
  }
  return unused;
}

}  // namespace

bool IsOffAxis(const LineLandmark& line, double max_deviation_rad) {
  if (!line.MayDeviate()) return false;
  const Vector3d direction = line.InWorld().direction_world;
  return (line.AcrossAxisInWorld().transpose() * direction).norm() > max_deviation_rad;
}

void TieLines(const LineDeviations& deviations, WindowState* window) {
  for (auto& [id, line] : window->lines) {
    if (line.retired || !line.estimated || !line.MayDeviate()) continue;
    const BuildingDeviation& deviation = deviations.Of(line.axis);
    line.deviation_sigma_rad = deviation.OfLine(id);
    if (deviation.IsShared() && !line.shared) {
      line.shared = SharedBy(line, deviation.shared_radius_m(), window);
    }
  }
  for (SharedDeviation& shared : window->shared_deviations) {
    shared.sigma_rad = deviations.Of(shared.axis).shared_sigma_rad();
  }
}

void ReleaseShared(const std::unordered_set<int64_t>& gone, WindowState* window,
                   std::vector<Term>* terms, std::vector<double*>* dropped) {
  const auto unused = SharedByNone(gone, *window);
  for (SharedDeviation& shared : window->shared_deviations) {
    if (!unused.contains(&shared)) continue;
    AddSharedDeviationTerm(&shared, terms);
    dropped->push_back(shared.off_rad.data());
  }
}

void ForgetShared(WindowState* window) {
  const auto unused = SharedByNone({}, *window);
  window->shared_deviations.remove_if(
      [&](const SharedDeviation& shared) { return unused.contains(&shared); });
}

std::unordered_set<int64_t> FinishPieces(const LineDeviations& deviations, const CostModel& model,
                                         WindowState* window) {
  std::unordered_set<int64_t> finished;
  const Vector3d eye_world =
      window->frames.back()->T_world_imu() * model.geometry.T_imu_camera[0].translation;
  for (auto& [id, line] : window->lines) {
    if (!line.estimated || line.retired || line.finished || line.IsExact()) continue;
    if (line.slope) continue;  // rails and rafters do not bend as walls do
    const Vector3d from_first = eye_world - line.anchor_world;
    const double moved_m = std::abs(line.InWorld().direction_world.dot(from_first));
    if (moved_m <= deviations.Of(line.axis).max_piece_m()) continue;
    line.finished = true;
    finished.insert(id);
  }
  return finished;
}

}  // namespace slcmap
