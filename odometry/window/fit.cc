#include "odometry/window/fit.h"

#include "odometry/residuals/imu_residual.h"

namespace slcmap {

ImuFit MeasureImuFit(const CostModel& model, const FrameState& from, const FrameState& to) {
  constexpr int kRows = 15;
  using Residual = Eigen::Matrix<double, kRows, 1>;
  const Preintegration& imu = *to.from_previous;
  const ImuResidual factor(&imu, from.cut, to.cut);
  const double* const blocks[] = {from.pose.data(), from.speed_bias.data(), to.pose.data(),
                                  to.speed_bias.data(), model.calibration->imu.data()};
  Residual whitened;
  factor.Evaluate(blocks, whitened.data(), nullptr);
  ImuFit fit;
  fit.chi2 = whitened.squaredNorm() / kRows;
  if (imu.duration_s() <= 0) return fit;
  // With the covariance C and C^-1 = W^T W, C W^T turns W r into r again.
  const Residual r = imu.covariance() * (imu.SqrtInformation().transpose() * whitened);
  fit.turn_rate_rad_s = r.segment<3>(kRowRotation).norm() / imu.duration_s();
  fit.acceleration_m_s2 = r.segment<3>(kRowVelocity).norm() / imu.duration_s();
  return fit;
}

WindowFit MeasureWindowFit(const CostModel& model, const WindowState& window) {
  WindowFit fit;
  const size_t intervals = window.frames.size() - 1;
  for (size_t i = 0; i < intervals; ++i) {
    fit.imu_chi2 += MeasureImuFit(model, *window.frames[i], *window.frames[i + 1]).chi2 /
                    static_cast<double>(intervals);
  }
  for (const auto& [id, measurement] : window.frames.back()->measurements) {
    ++fit.newest_points;
    fit.newest_right += measurement.right.has_value();
  }
  return fit;
}

}  // namespace slcmap
