#include "mapping/control/control_scale.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "data/core/math.h"

namespace slcmap::inline mapping {
namespace {

struct Ratio {
  double times = 1, sigma = 0;  // given over mapped
};

void AddRatio(const PlacedPoint& from, const PlacedPoint& to, double given_m, double sigma_m,
              std::vector<Ratio>* ratios) {
  const double mapped_m = (to.p_world - from.p_world).norm();
  constexpr double kLeastTelling_m = 1;
  if (mapped_m < kLeastTelling_m) return;
  const double all_m = std::hypot(sigma_m, from.sigma_m, to.sigma_m);
  ratios->push_back({given_m / mapped_m, all_m / mapped_m});
}

// Each point counts once, in however many pairs it is.
void AddPairsOfPoints(const Control& control, const std::map<std::string, PlacedPoint>& placed,
                      double grid_scale, std::vector<Ratio>* ratios) {
  std::vector<const ControlPoint*> seen;
  for (const ControlPoint& point : control.points) {
    if (placed.contains(point.name)) seen.push_back(&point);
  }
  if (seen.size() < 3) return;
  const double repeats = std::sqrt(std::max(1.0, static_cast<double>(seen.size()) / 2));
  for (size_t i = 0; i < seen.size(); ++i) {
    for (size_t j = i + 1; j < seen.size(); ++j) {
      Eigen::Vector3d apart_m = seen[j]->p_m - seen[i]->p_m;
      apart_m.head<2>() /= grid_scale;
      const double sigma_m = std::hypot(seen[i]->sigma_m.maxCoeff(), seen[j]->sigma_m.maxCoeff());
      const size_t before = ratios->size();
      AddRatio(placed.at(seen[i]->name), placed.at(seen[j]->name), apart_m.norm(), sigma_m, ratios);
      if (ratios->size() > before) ratios->back().sigma *= repeats;
    }
  }
}

}  // namespace

std::optional<MeasuredScale> MeasureScale(const Control& control,
                                          const std::map<std::string, PlacedPoint>& placed,
                                          double grid_scale) {
  std::vector<Ratio> ratios;
  for (const KnownDistance& known : control.distances) {
    const auto from = placed.find(known.from), to = placed.find(known.to);
    if (from == placed.end() || to == placed.end()) continue;
    AddRatio(from->second, to->second, known.metres, known.sigma_m, &ratios);
  }
  AddPairsOfPoints(control, placed, grid_scale, &ratios);
  if (ratios.empty()) return std::nullopt;
  std::vector<double> times, off;
  double weight = 0;
  for (const Ratio& ratio : ratios) {
    times.push_back(ratio.times);
    weight += 1 / (ratio.sigma * ratio.sigma);
  }
  const double middle = Quantile(times, 0.5);
  for (const Ratio& ratio : ratios) off.push_back(std::abs(ratio.times - middle) / ratio.sigma);
  const double scatter = std::max(1.0, kSigmaOfMedian * Quantile(off, 0.5));
  return MeasuredScale{middle, scatter / std::sqrt(weight)};
}

void ScaleRun(double times, OdometryRun* run) {
  const auto scale_cameras = [times](Rig* rig) {
    const Eigen::Vector3d first = rig->T_imu_camera[0].translation;
    for (RigidTransform& T : rig->T_imu_camera)
      T.translation = first + times * (T.translation - first);
  };
  scale_cameras(&run->rectified_rig);
  if (run->source) scale_cameras(&run->source->raw_rig);
  for (OnlineState& state : run->states) {
    state.T_world_imu.translation *= times;
    state.velocity_world_m_s *= times;
  }
  for (Keyframe& keyframe : run->keyframes) keyframe.T_world_imu.translation *= times;
  for (Landmark& landmark : run->landmarks) {
    landmark.p_world *= times;
    if (landmark.sigma_m < kUnknownSigma_m) landmark.sigma_m *= times;
  }
  for (Line& line : run->lines) {
    line.start_world *= times;
    line.end_world *= times;
    line.covariance_m2 *= times * times;
  }
}

}  // namespace slcmap::mapping
