#include "odometry/window/run_monitor.h"

namespace slcmap::inline odometry {
namespace {

constexpr int kRowsOfAPoint = 2;
constexpr double kMaxGyroBias_rad_s = 0.5;
constexpr double kMaxAccelBias_m_s2 = 2.5;

double Share(int part, int all) {
  return all > 0 ? static_cast<double>(part) / static_cast<double>(all) : 0;
}

}  // namespace

std::string FindImpossible(const OnlineState& state, const FailureOptions& limits) {
  const bool finite = state.T_world_imu.translation.allFinite() &&
                      state.T_world_imu.rotation.coeffs().allFinite() &&
                      state.velocity_world_m_s.allFinite() && state.gyro_bias_rad_s.allFinite() &&
                      state.accel_bias_m_s2.allFinite();
  if (!finite) return "the optimisation diverged";
  if (state.velocity_world_m_s.norm() > limits.max_speed_m_s) return "an impossible speed";
  if (state.gyro_bias_rad_s.norm() > kMaxGyroBias_rad_s) {
    return "an impossible gyroscope bias";
  }
  if (state.accel_bias_m_s2.norm() > kMaxAccelBias_m_s2) {
    return "an impossible accelerometer bias";
  }
  return {};
}

void FigureCollector::AddImage(int64_t stamp_ns, const FrameFit& fit) {
  turn_rate_rad_s_.Add(stamp_ns, fit.imu.turn_rate_rad_s);
  acceleration_m_s2_.Add(stamp_ns, fit.imu.acceleration_m_s2);
  if (fit.points > 0) points_rejected_.Add(stamp_ns, Share(fit.rejected, fit.points));
  sees_ = sees_ || fit.points > 0;
  if (sees_) blind_.Add(stamp_ns, fit.points > 0 ? 0 : 1);
}

void FigureCollector::AddKeyframe(int64_t stamp_ns, const WindowFit& fit) {
  const PointFit& points = fit.points;
  const int kept = points.observations - points.rejected;
  imu_chi2_.Add(stamp_ns, fit.imu_chi2);
  if (points.observations > 0) {
    observations_rejected_.Add(stamp_ns, Share(points.rejected, points.observations));
  }
  if (kept > 0) reprojection_chi2_.Add(stamp_ns, points.chi2 / (kRowsOfAPoint * kept));
  if (fit.newest_points > 0) seen_right_.Add(stamp_ns, Share(fit.newest_right, fit.newest_points));
}

RunFigures FigureCollector::Figures() const {
  RunFigures figures;
  figures.points_rejected = points_rejected_.Summary();
  figures.observations_rejected = observations_rejected_.Summary();
  figures.reprojection_chi2 = reprojection_chi2_.Summary();
  figures.imu_chi2 = imu_chi2_.Summary();
  figures.turn_rate_rad_s = turn_rate_rad_s_.Summary();
  figures.acceleration_m_s2 = acceleration_m_s2_.Summary();
  figures.seen_right = seen_right_.Summary();
  figures.blind = blind_.Summary();
  return figures;
}

}  // namespace slcmap::odometry
