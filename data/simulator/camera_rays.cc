#include "data/simulator/camera_rays.h"

#include <Eigen/Geometry>
#include <cmath>

#include "data/simulator/hashing.h"

namespace slcmap {
namespace {

// Rays at every other pixel border, between which a model of a lens is as good as linear: off by
// 1e-3 px for the strongest distortion in use.
class RayGrid {
 public:
  RayGrid(const Camera& camera, int columns_px, int rows_px)
      : columns_(columns_px / kStep_px + 1), rays_(columns_ * (rows_px / kStep_px + 1)) {
    for (size_t i = 0; i < rays_.size(); ++i) {
      const int x = static_cast<int>(i) % columns_, y = static_cast<int>(i) / columns_;
      const auto ray = camera.Unproject({kStep_px * x - 0.5, kStep_px * y - 0.5});
      rays_[i] = ray ? Eigen::Vector3f(ray->cast<float>()) : Eigen::Vector3f(0, 0, 0);
    }
  }

  // At the pixel position (x - 0.5, y - 0.5); zero where there is none.
  Eigen::Vector3f At(float x, float y) const {
    const int xi = static_cast<int>(x) / kStep_px, yi = static_cast<int>(y) / kStep_px;
    const float fx = x / kStep_px - static_cast<float>(xi);
    const float fy = y / kStep_px - static_cast<float>(yi);
    const Eigen::Vector3f* p = &rays_[yi * columns_ + xi];
    const Eigen::Vector3f* q = p + columns_;
    for (const Eigen::Vector3f& corner : {p[0], p[1], q[0], q[1]}) {
      if (corner.isZero()) return corner;
    }
    return ((1 - fy) * ((1 - fx) * p[0] + fx * p[1]) + fy * ((1 - fx) * q[0] + fx * q[1]))
        .normalized();
  }

 private:
  static constexpr int kStep_px = 2;
  int columns_;
  std::vector<Eigen::Vector3f> rays_;
};

// Pixels a radian along x, in the middle of the image.
double MiddleFocalX_px(const Camera& camera) {
  return camera.fx_px * (camera.MiddleFocal_px() / std::sqrt(camera.fx_px * camera.fy_px));
}

// Of a pixel's sample, in [0, 1): one in each quarter, in an order that differs by pixel, so that
// the instant of a sample tells nothing about its place.
Eigen::Vector2f Jitter(uint32_t pixel, uint32_t sample) {
  const uint32_t hash = Mixed(pixel, 7);
  const uint32_t stratum = (sample * (hash & 1 ? 1 : 3) + (hash >> 1)) & 3;
  const uint32_t a = Mixed(pixel, 10 + sample), b = Mixed(pixel, 20 + sample);
  return {0.5f * (static_cast<float>(stratum & 1) + UnitFloat(a)),
          0.5f * (static_cast<float>(stratum >> 1 ^ (stratum & 1)) + UnitFloat(b))};
}

}  // namespace

CameraRays::CameraRays(const Camera& camera)
    : across_((camera.width_px + kBlockColumns - 1) / kBlockColumns),
      down_((camera.height_px + kBlockRows - 1) / kBlockRows),
      pixel_angle_rad_(static_cast<float>(1 / MiddleFocalX_px(camera))),
      packets_(across_ * down_ * 2 * kSamples) {
  const RayGrid grid(camera, across_ * kBlockColumns, down_ * kBlockRows);
  for (size_t i = 0; i < packets_.size(); ++i) {
    const int sample = static_cast<int>(i) % kSamples;
    const int colour = static_cast<int>(i) / kSamples % 2;
    const int block = static_cast<int>(i) / kSamples / 2;
    for (int lane = 0; lane < RayScene::kLanes; ++lane) {
      const int x = block % across_ * kBlockColumns + Column(lane, colour);
      const int y = block / across_ * kBlockRows + Row(lane);
      const bool inside = x < camera.width_px && y < camera.height_px;
      const Eigen::Vector2f at =
          Jitter(static_cast<uint32_t>(y * camera.width_px + x), static_cast<uint32_t>(sample));
      const Eigen::Vector3f ray =
          inside ? grid.At(static_cast<float>(x) + at.x(), static_cast<float>(y) + at.y())
                 : Eigen::Vector3f(Eigen::Vector3f::Zero());
      packets_[i].x[lane] = ray.x();
      packets_[i].y[lane] = ray.y();
      packets_[i].z[lane] = ray.z();
    }
  }
}

}  // namespace slcmap
