#include "mapping/planes/plane_sweep.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace slcmap {
namespace {

using Eigen::Vector3d;
using Values = Eigen::ArrayXf;  // of the samples of a patch, row by row

constexpr double kElsewhere_m = 0.08;  // from the best place
// Neighbouring samples, and images, err alike.
constexpr double kSamplesADegree = 20;
constexpr float kSaturated = 245;       // grey value
constexpr float kMostContrast = 0.12F;  // of a sample against its patch: edges don't outvote all

// The image of a patch in a view: homogeneous pixel = corner + column * step_u + row * step_v.
struct PatchMap {
  Vector3d corner, step_u, step_v;
};

PatchMap MapOf(const PlanePatch& patch, double offset_m, int samples, const SeenPatch& view,
               const Camera& camera, int level) {
  const double scale = 1.0 / (1 << level), step_m = patch.side_m / samples;
  Eigen::Matrix3d K = Eigen::Matrix3d::Identity();
  K(0, 0) = scale * camera.fx_px;
  K(1, 1) = scale * camera.fy_px;
  K(0, 2) = scale * (camera.cx_px + 0.5) - 0.5;
  K(1, 2) = scale * (camera.cy_px + 0.5) - 0.5;
  const Eigen::Matrix3d KR = K * view.T_camera_world.rotation.toRotationMatrix();
  const Vector3d corner_world = patch.middle_world + offset_m * patch.normal -
                                0.5 * (patch.side_m - step_m) * (patch.u + patch.v);
  return {KR * corner_world + K * view.T_camera_world.translation, step_m * (KR * patch.u),
          step_m * (KR * patch.v)};
}

// The size at which a pixel is about as large as a sample.
int LevelOf(const PlanePatch& patch, int samples, const SeenPatch& view, const Camera& camera) {
  const double depth_m = (view.T_camera_world * patch.middle_world).z();
  const double pixels = camera.fx_px * patch.side_m / samples / depth_m;
  const int level = static_cast<int>(std::floor(std::log2(std::max(pixels, 1.0))));
  return std::min(level, DepthPyramid::kLevels - 1);
}

bool Sample(const cv::Mat& image, const PatchMap& map, int samples, Values* values) {
  values->resize(samples * samples);
  const auto last_u = static_cast<float>(image.cols - 1),
             last_v = static_cast<float>(image.rows - 1);
  for (int row = 0; row < samples; ++row) {
    Vector3d h = map.corner + row * map.step_v;
    for (int column = 0; column < samples; ++column, h += map.step_u) {
      const auto inverse = static_cast<float>(1 / h.z());
      const float u = static_cast<float>(h.x()) * inverse, v = static_cast<float>(h.y()) * inverse;
      if (!(u >= 0 && v >= 0 && u < last_u && v < last_v)) return false;
      const int x = static_cast<int>(u), y = static_cast<int>(v);
      const float a = u - static_cast<float>(x), b = v - static_cast<float>(y);
      const float* top = image.ptr<float>(y) + x;
      const float* bottom = image.ptr<float>(y + 1) + x;
      (*values)[row * samples + column] =
          (1 - b) * ((1 - a) * top[0] + a * top[1]) + b * ((1 - a) * bottom[0] + a * bottom[1]);
    }
  }
  return true;
}

// Contrasts against what is around each sample; returns the mean of the patch. Slow changes, as
// light makes them, agree wherever the patch is, and so say nothing.
float Flatten(int samples, Values* values) {
  const int window = 2 * (samples / 8) + 1;
  const float mean = values->mean();
  cv::Mat1f patch(samples, samples, values->data());
  cv::Mat1f around;
  cv::blur(patch, around, {window, window}, {-1, -1}, cv::BORDER_REFLECT_101);
  const float per_grey = 1 / std::max(mean, 1.0F);
  for (int i = 0; i < samples * samples; ++i) {
    const float contrast = per_grey * ((*values)[i] - around.ptr<float>()[i]);
    (*values)[i] = std::clamp(contrast, -kMostContrast, kMostContrast);
  }
  return mean;
}

// How far the images are from their mean, and how alike they are.
struct PatchAgreement {
  double residual = 0;  // as a share of their energy
  double correlation = 0, grey = 0, saturated = 0;
  int images = 0;
};

PatchAgreement AgreementAt(const PlanePatch& patch, double offset_m,
                           const std::vector<SeenPatch>& images, const std::vector<int>& levels,
                           const Camera& camera, const PlaneOptions& options) {
  Values sum = Values::Zero(options.samples * options.samples), values;
  double energy = 0, grey = 0, saturated = 0;
  int count = 0;
  for (size_t i = 0; i < images.size(); ++i) {
    const PatchMap map = MapOf(patch, offset_m, options.samples, images[i], camera, levels[i]);
    if (!Sample(images[i].image->levels[levels[i]], map, options.samples, &values)) continue;
    saturated += (values > kSaturated).cast<double>().mean() / static_cast<double>(images.size());
    grey += Flatten(options.samples, &values);
    sum += values;
    energy += static_cast<double>(values.square().sum());
    ++count;
  }
  if (count < 2 || energy <= 0) return {1, 0, grey / std::max(count, 1), saturated, count};
  const double common = static_cast<double>(sum.square().sum());
  return {1 - common / count / energy, (common - energy) / ((count - 1) * energy), grey / count,
          saturated, count};
}

}  // namespace

PatchSweep SweepPatch(const PlanePatch& patch, const std::vector<SeenPatch>& images,
                      const Camera& camera, const PlaneOptions& options) {
  std::vector<int> levels;
  for (const SeenPatch& image : images) {
    levels.push_back(LevelOf(patch, options.samples, image, camera));
  }
  const int reach = static_cast<int>(std::lround(options.sweep_m / options.sweep_step_m));
  PatchSweep sweep;
  double least = 1e9;
  std::vector<double> residuals;
  for (int i = -reach; i <= reach; ++i) {
    const PatchAgreement at =
        AgreementAt(patch, i * options.sweep_step_m, images, levels, camera, options);
    if (at.images < static_cast<int>(images.size())) return {};
    residuals.push_back(std::max(at.residual, 1e-3));
    sweep.correlation.push_back(at.correlation);
    least = std::min(least, residuals.back());
    if (i != 0) continue;
    sweep.grey = at.grey;
    sweep.saturated = at.saturated;
  }
  const double independent =
      static_cast<double>(images.size() - 1) * options.samples * options.samples / kSamplesADegree;
  for (const double residual : residuals) {
    sweep.misfit.push_back(0.5 * independent * std::log(residual / least));
  }
  return sweep;
}

SweptPlace BestPlace(const std::vector<double>& misfit, const PlaneOptions& options) {
  const int last = static_cast<int>(misfit.size()) - 1;
  const int at = static_cast<int>(std::min_element(misfit.begin(), misfit.end()) - misfit.begin());
  SweptPlace place;
  place.offset_m = (at - last / 2) * options.sweep_step_m;
  place.sigma_m = options.sweep_m;
  if (at > 0 && at < last) {
    const double bend = misfit[at - 1] - 2 * misfit[at] + misfit[at + 1];
    const double slope = 0.5 * (misfit[at + 1] - misfit[at - 1]);
    if (bend > 0) {
      place.offset_m -= options.sweep_step_m * std::clamp(slope / bend, -0.5, 0.5);
      place.sigma_m = std::min(place.sigma_m, options.sweep_step_m / std::sqrt(bend));
    }
  }
  place.margin = 1e9;
  for (int i = 0; i <= last; ++i) {
    if (std::abs(i - at) * options.sweep_step_m < kElsewhere_m - 1e-9) continue;
    place.margin = std::min(place.margin, misfit[i] - misfit[at]);
  }
  return place;
}

}  // namespace slcmap
