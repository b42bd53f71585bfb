// Views of painted rectangles, as mapping gets them: what images show of walls with openings.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "mapping/building/building_input.h"
#include "mapping/views/view.h"
#include "tests/testing/box_room_renderer.h"

namespace slcmap {

// corner + a u + b v, with a and b in 0 to 1; u and v are square to each other.
struct PaintedRectangle {
  Eigen::Vector3d corner, u, v;
  double grey = 120;
  double contrast = 0.1;  // of its faint spots
  int seed = 1;

  Eigen::Vector3d Normal() const { return u.cross(v).normalized(); }
};

class PaintedViews : public ViewImages {
 public:
  // A walk of 1.5 m along x at y = 0 in a height of 1.5 m, looking along y.
  explicit PaintedViews(std::vector<PaintedRectangle> rectangles, int count = 16)
      : rectangles_(std::move(rectangles)), rig_(SmallRig()) {
    for (RigidTransform& T_imu_camera : rig_.T_imu_camera) T_imu_camera = {};
    rig_.T_imu_camera[1].translation.x() = 0.1;
    Eigen::Matrix3d R_world_camera;
    R_world_camera << 1, 0, 0, 0, 0, 1, 0, -1, 0;
    for (int i = 0; i < count; ++i) {
      const Eigen::Vector3d place(0.1 * i - 0.75, 0.02 * (i % 3), 1.5);
      views_.push_back({i * 100000000, 0, {Eigen::Quaterniond(R_world_camera), place}});
    }
    mask_ = cv::Mat(rig_.cameras[0].height_px, rig_.cameras[0].width_px, CV_8UC1, cv::Scalar(255));
  }

  const Views& views() const { return views_; }
  const Rig& rig() const override { return rig_; }
  const cv::Mat& mask(int) const override { return mask_; }
  int64_t unreadable() const override { return 0; }
  StereoImage Read(size_t view) const override {
    const int index = static_cast<int>(view);
    return {views_[view].stamp_ns, Paint(index, 0), Paint(index, 1)};
  }

  // Rays of every view, to what of the rectangles is named by an index.
  std::vector<Sights> SightsOf(const std::vector<int>& measured) const {
    std::vector<Sights> all;
    for (const View& view : views_) {
      Sights sights{view.T_world_imu.translation, {}, {}};
      for (int v = 5; v < rig_.cameras[0].height_px; v += 10) {
        for (int u = 5; u < rig_.cameras[0].width_px; u += 10) {
          const Hit hit = FirstHit(view, 0, u, v);
          if (std::find(measured.begin(), measured.end(), hit.rectangle) == measured.end())
            continue;
          sights.p_world.push_back(hit.p.cast<float>());
          sights.sigma_m.push_back(0.01F);
        }
      }
      all.push_back(sights);
    }
    return all;
  }

 private:
  struct Hit {
    int rectangle = -1;
    Eigen::Vector3d p = Eigen::Vector3d::Zero();
  };

  Hit FirstHit(const View& view, int index, int u_px, int v_px) const {
    const Camera& camera = rig_.cameras[index];
    const RigidTransform T_world_camera = WorldFromCamera(view, rig_, index);
    const Eigen::Vector3d ray =
        T_world_camera.rotation * Eigen::Vector3d((u_px - camera.cx_px) / camera.fx_px,
                                                  (v_px - camera.cy_px) / camera.fy_px, 1);
    const Eigen::Vector3d& from = T_world_camera.translation;
    Hit first;
    double nearest = std::numeric_limits<double>::infinity();
    for (size_t i = 0; i < rectangles_.size(); ++i) {
      const PaintedRectangle& r = rectangles_[i];
      const double along = r.Normal().dot(ray);
      const double t = r.Normal().dot(r.corner - from) / along;
      if (std::abs(along) < 1e-9 || t <= 0 || t >= nearest) continue;
      const Eigen::Vector3d p = from + t * ray, off = p - r.corner;
      const double a = off.dot(r.u) / r.u.squaredNorm(), b = off.dot(r.v) / r.v.squaredNorm();
      if (a < 0 || b < 0 || a > 1 || b > 1) continue;
      nearest = t;
      first = {static_cast<int>(i), p};
    }
    return first;
  }

  cv::Mat Paint(int index, int camera) const {
    cv::Mat image(rig_.cameras[0].height_px, rig_.cameras[0].width_px, CV_8UC1, cv::Scalar(0));
    for (int v = 0; v < image.rows; ++v) {
      for (int u = 0; u < image.cols; ++u) {
        const Hit hit = FirstHit(views_[index], camera, u, v);
        if (hit.rectangle < 0) continue;
        const PaintedRectangle& r = rectangles_[hit.rectangle];
        const double noise = 3 * (Random({u, v, 2 * index + camera}, 99) - 0.5);
        const double grey = r.grey * (1 + r.contrast * Spots(r, hit.p)) + noise;
        image.at<uint8_t>(v, u) = cv::saturate_cast<uint8_t>(grey);
      }
    }
    return image;
  }

  // -1 to 1, smooth over 4 cm.
  static double Spots(const PaintedRectangle& r, const Eigen::Vector3d& p) {
    constexpr double kSpot_m = 0.04;
    const double a = (p - r.corner).dot(r.u.normalized()) / kSpot_m;
    const double b = (p - r.corner).dot(r.v.normalized()) / kSpot_m;
    const int column = static_cast<int>(std::floor(a)), row = static_cast<int>(std::floor(b));
    const double x = a - column, y = b - row;
    const auto at = [&](int i, int j) { return 2 * Random({column + i, row + j, 0}, r.seed) - 1; };
    return (1 - y) * ((1 - x) * at(0, 0) + x * at(1, 0)) + y * ((1 - x) * at(0, 1) + x * at(1, 1));
  }

  // In [0, 1), by place.
  static double Random(const Eigen::Vector3i& place, int seed) {
    uint64_t h = static_cast<uint64_t>(place.x() + 5000) * 0x9E3779B97F4A7C15U ^
                 static_cast<uint64_t>(place.y() + 5000) * 0xC2B2AE3D27D4EB4FU ^
                 static_cast<uint64_t>(place.z() + 7) * 0x165667B19E3779F9U ^
                 static_cast<uint64_t>(seed) * 0xD6E8FEB86659FD93U;
    h = (h ^ (h >> 29)) * 0xBF58476D1CE4E5B9U;
    h = (h ^ (h >> 32)) * 0x94D049BB133111EBU;
    return static_cast<double>((h ^ (h >> 31)) >> 11) * 0x1p-53;
  }

  std::vector<PaintedRectangle> rectangles_;
  Rig rig_;
  Views views_;
  cv::Mat mask_;
};

}  // namespace slcmap
