// What a run knows about itself, in figures.
#pragma once

#include <array>
#include <cstdint>
#include <utility>

namespace slcmap {

// Of a figure that is measured again and again.
struct FigureSummary {
  double mean = 0;
  double worst = 0;  // the highest mean over two seconds
  int64_t count = 0;
};

struct RunFigures {
  // Share of the points followed to an image that are far from where its state has them.
  FigureSummary points_rejected;
  // Share of the window's observations of points that do not fit once it is optimised.
  FigureSummary observations_rejected;
  // Squared residual, by its variance, of a coordinate of those that fit; 1 as claimed.
  FigureSummary reprojection_chi2;
  // The same of a row of the IMU's measurements between the window's keyframes.
  FigureSummary imu_chi2;
  // From the last keyframe to an image: how much the state's turn differs from the gyroscope's, and
  // its change of velocity from the accelerometer's, over the time between.
  FigureSummary turn_rate_rad_s;
  FigureSummary acceleration_m_s2;
  // Share of a keyframe's points that its right image shows.
  FigureSummary seen_right;
};

// By the names of run.json.
inline constexpr std::array<std::pair<const char*, FigureSummary RunFigures::*>, 7> kRunFigures = {
    {{"points_rejected", &RunFigures::points_rejected},
     {"observations_rejected", &RunFigures::observations_rejected},
     {"reprojection_chi2", &RunFigures::reprojection_chi2},
     {"imu_chi2", &RunFigures::imu_chi2},
     {"turn_rate_rad_s", &RunFigures::turn_rate_rad_s},
     {"acceleration_m_s2", &RunFigures::acceleration_m_s2},
     {"seen_right", &RunFigures::seen_right}}};

}  // namespace slcmap
