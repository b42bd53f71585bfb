// Gathers what a run knows about itself while it goes on.
#pragma once

#include "odometry/verdict/run_figures.h"
#include "odometry/verdict/running_figure.h"
#include "odometry/window/fit.h"

namespace slcmap {

class FigureCollector {
 public:
  void AddImage(int64_t stamp_ns, const FrameFit& fit);
  void AddKeyframe(int64_t stamp_ns, const WindowFit& fit);
  RunFigures Figures() const;

 private:
  RunningFigure points_rejected_, observations_rejected_, reprojection_chi2_, imu_chi2_;
  RunningFigure turn_rate_rad_s_, acceleration_m_s2_, seen_right_;
};

}  // namespace slcmap
