// Feeds odometry live, without files: a rig moves along a textured wall three metres in front of
// it. Prints stamp and position of each pose, as estimated and as it was.
#include <cmath>
#include <cstdio>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "odometry/odometry.h"

namespace {

constexpr double kFocal_px = 300, kWall_m = 3, kBaseline_m = 0.11, kImageRate_hz = 20;
constexpr double kTurn_rad_s = 2 * std::numbers::pi / 4;  // 0.3 m to the right and back, in 4 s

// One second at rest, then to and fro.
double Position_m(double t_s) {
  return t_s < 1 ? 0 : 0.3 * (1 - std::cos(kTurn_rad_s * (t_s - 1)));
}
double Acceleration_m_s2(double t_s) {
  return t_s < 1 ? 0 : 0.3 * kTurn_rad_s * kTurn_rad_s * std::cos(kTurn_rad_s * (t_s - 1));
}

// What a camera sees that stands at x_m.
cv::Mat LookAt(const cv::Mat& wall, double x_m) {
  const double shift_px = kFocal_px * x_m / kWall_m;
  const cv::Mat from_image = (cv::Mat_<double>(2, 3) << 1, 0, 100 + shift_px, 0, 1, 0);
  cv::Mat image;
  cv::warpAffine(wall, image, from_image, {640, 480}, cv::INTER_CUBIC | cv::WARP_INVERSE_MAP);
  return image;
}

}  // namespace

int main() {
  slcmap::Rig rig;
  rig.cameras.assign(2, {slcmap::Distortion::kNone, 640, 480, kFocal_px, kFocal_px, 319.5, 239.5});
  rig.T_imu_camera[1].translation.x() = kBaseline_m;  // the IMU sits in the left camera
  slcmap::Odometry odometry(rig, {});

  std::puts("# stamp_s x_m y_m z_m distance_m true_distance_m");
  cv::Mat blocks(60, 120, CV_8U), wall;
  cv::RNG(1).fill(blocks, cv::RNG::UNIFORM, 0, 255);
  cv::resize(blocks, wall, {}, 8, 8, cv::INTER_CUBIC);

  for (int i = 0; i < 1200; ++i) {  // 6 s of IMU at 200 Hz; an image with every tenth sample
    const double t_s = i / 200.0;
    const int64_t stamp_ns = slcmap::ToNanoseconds(t_s);
    odometry.AddImu({stamp_ns,
                     Eigen::Vector3d::Zero(),
                     {Acceleration_m_s2(t_s), -slcmap::kGravity_m_s2, 0}});  // y is down
    if (i % static_cast<int>(200 / kImageRate_hz) != 0) continue;
    const double x_m = Position_m(t_s);
    for (const slcmap::OnlineState& state :
         odometry.AddStereo({stamp_ns, LookAt(wall, x_m), LookAt(wall, x_m + kBaseline_m)})) {
      const double stamp_s = slcmap::ToSeconds(state.stamp_ns);
      const Eigen::Vector3d p_m = state.T_world_imu.translation;
      std::printf("%.2f %.3f %.3f %.3f %.3f %.3f\n", stamp_s, p_m.x(), p_m.y(), p_m.z(), p_m.norm(),
                  Position_m(stamp_s));
    }
  }
}
