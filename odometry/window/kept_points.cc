#include "odometry/window/kept_points.h"

namespace slcmap {
namespace {

bool WasSeenBefore(const WindowState& window, int64_t id) {
  const auto landmark = window.landmarks.find(id);
  return landmark != window.landmarks.end() &&
         landmark->second.frames.size() + landmark->second.released_frames > 1;
}

}  // namespace

bool KeptPoints::AreFewerThan(double share) const {
  constexpr double kUnproven = 0.5;  // of the share that is asked for, where all points count
  return proven_kept < share * proven || kept < kUnproven * share * all;
}

KeptPoints CountKept(const WindowState& window, const FrameState& frame,
                     const std::optional<std::unordered_set<int64_t>>& followed) {
  KeptPoints points;
  for (const auto& [id, measurement] : window.frames.back()->measurements) {
    const bool proven =
        WasSeenBefore(window, id) || (measurement.right && followed && followed->contains(id));
    const bool kept = frame.measurements.contains(id);
    ++points.all;
    if (kept) ++points.kept;
    if (proven) ++points.proven;
    if (proven && kept) ++points.proven_kept;
  }
  return points;
}

}  // namespace slcmap
