#include "data/camera_choice.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "data/input_fault.h"

namespace slcmap {
namespace {

constexpr double kUsualDistance_m = 4;   // of what both see
constexpr double kGoodBaseline_m = 0.1;  // less of it tells less of distances
constexpr double kLeastCosine = 0.5;     // between the optical axes
constexpr double kClearlyBetter = 1.05;  // than a pair that comes first

// The share of the first camera's image that the second one sees.
double Overlap(const ChainCamera& first, const ChainCamera& second) {
  constexpr int kSteps = 16;
  const RigidTransform T_second_first = second.T_imu_camera.Inverse() * first.T_imu_camera;
  int seen = 0;
  for (int i = 0; i < kSteps * kSteps; ++i) {
    const Eigen::Vector2d pixel_px((i % kSteps + 0.5) / kSteps * first.camera.width_px,
                                   (i / kSteps + 0.5) / kSteps * first.camera.height_px);
    const auto ray = first.camera.Unproject(pixel_px);
    const auto there =
        ray ? second.camera.Project(T_second_first * (kUsualDistance_m * *ray)) : std::nullopt;
    seen += there && second.camera.Contains(*there);
  }
  return static_cast<double>(seen) / (kSteps * kSteps);
}

// None where one looks another way or stands before the other: they cannot be rectified.
double Usefulness(const ChainCamera& first, const ChainCamera& second) {
  const Eigen::Vector3d z_first = first.T_imu_camera.rotation * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d z_second = second.T_imu_camera.rotation * Eigen::Vector3d::UnitZ();
  if (z_first.dot(z_second) < kLeastCosine) return 0;
  const double baseline_m = (first.T_imu_camera.translation - second.T_imu_camera.translation)
                                .cross((z_first + z_second).normalized())
                                .norm();
  return Overlap(first, second) * std::min(1.0, baseline_m / kGoodBaseline_m);
}

std::vector<size_t> FindWanted(const std::vector<ChainCamera>& chain,
                               const std::vector<int>& wanted) {
  std::vector<size_t> chosen;
  for (const int index : wanted) {
    const auto camera = std::ranges::find(chain, index, &ChainCamera::index);
    if (camera == chain.end() || std::ranges::count(wanted, index) > 1 || wanted.size() > 2) {
      std::string names;
      for (const ChainCamera& known : chain) names += fmt::format(" cam{}", known.index);
      throw InputFault("cameras",
                       fmt::format("--cameras: found {}, expected one or two different ones of{}",
                                   fmt::join(wanted, ","), names),
                       "name cameras that the calibration has, as --cameras 0,1");
    }
    chosen.push_back(static_cast<size_t>(camera - chain.begin()));
  }
  return chosen;
}

}  // namespace

std::vector<size_t> ChooseCameras(const std::vector<ChainCamera>& chain,
                                  const std::vector<int>& wanted) {
  if (!wanted.empty()) return FindWanted(chain, wanted);
  if (chain.size() == 1) return {0};
  if (chain.size() == 2 && chain[0].index == 0 && chain[1].index == 1) return {0, 1};
  std::vector<size_t> best;
  double most = 0;
  for (size_t i = 0; i < chain.size(); ++i) {
    for (size_t j = i + 1; j < chain.size(); ++j) {
      const double useful = Usefulness(chain[i], chain[j]);
      if (useful <= kClearlyBetter * most) continue;
      most = useful;
      best = {i, j};
    }
  }
  return best.empty() ? std::vector<size_t>{0} : best;
}

}  // namespace slcmap
