// A picture of known straight edges.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <opencv2/core.hpp>
#include <utility>
#include <vector>

#include "data/core/types.h"
#include "tests/testing/pinhole_camera.h"

namespace slcmap::testing {

inline Rig LineTestRig() {
  Rig rig;
  rig.cameras.assign(2, PinholeCamera(600, 400, 400, 299.5, 199.5));
  rig.T_imu_camera[1].translation = {0.1, 0, 0};
  return rig;
}

// A bright or dark bar with soft edges, as a lens makes them.
struct Bar {
  LineSegment axis;
  double half_width_px = 6;
  double brightness = 80;  // above its surroundings
};

// Several bars on a grey picture with an uneven ground, moved by `shift`.
inline cv::Mat DrawBars(const std::vector<Bar>& bars, const Eigen::Vector2d& shift = {0, 0},
                        double noise = 1) {
  cv::Mat image(400, 600, CV_8UC1);
  cv::RNG rng(3);
  const auto step = [](double d) { return 0.5 * (1 + std::erf(d / (0.8 * std::sqrt(2)))); };
  for (int v = 0; v < image.rows; ++v) {
    for (int u = 0; u < image.cols; ++u) {
      const Eigen::Vector2d p = Eigen::Vector2d(u, v) - shift;
      double value = 90 + 0.02 * p.x() + 0.03 * p.y() + rng.gaussian(noise);
      for (const auto& bar : bars) {
        const Eigen::Vector2d d = (bar.axis.end - bar.axis.start).normalized();
        const Eigen::Vector2d q = p - bar.axis.start;
        const double across = std::abs(d.x() * q.y() - d.y() * q.x());
        const double along = d.dot(q);
        value += bar.brightness * step(bar.half_width_px - across) * step(along) *
                 step((bar.axis.end - bar.axis.start).norm() - along);
      }
      image.at<uchar>(v, u) = cv::saturate_cast<uchar>(value);
    }
  }
  return image;
}

inline std::vector<Bar> TestBars() {
  return {{{{80, 60}, {90, 330}}, 6, 80},    {{{150, 300}, {330, 320}}, 5, -50},
          {{{200, 60}, {420, 90}}, 9, 60},   {{{300, 130}, {310, 280}}, 12, -40},
          {{{450, 350}, {520, 120}}, 7, 90}, {{{380, 180}, {430, 230}}, 5, 50}};
}

// The long edges of the bars: two each.
inline std::vector<LineSegment> EdgesOf(const std::vector<Bar>& bars,
                                        const Eigen::Vector2d& shift = {0, 0}) {
  std::vector<LineSegment> edges;
  for (const auto& bar : bars) {
    const Eigen::Vector2d d = (bar.axis.end - bar.axis.start).normalized();
    for (const double side : {-bar.half_width_px, bar.half_width_px}) {
      const Eigen::Vector2d offset = shift + side * Eigen::Vector2d(-d.y(), d.x());
      edges.push_back({bar.axis.start + offset, bar.axis.end + offset});
    }
  }
  return edges;
}

// The nearest edge's index, and the larger distance of the segment's ends from it.
inline std::pair<int, double> NearestEdge(const std::vector<LineSegment>& edges,
                                          const LineSegment& segment) {
  std::pair<int, double> best{-1, 1e9};
  for (size_t i = 0; i < edges.size(); ++i) {
    const Eigen::Vector2d d = (edges[i].end - edges[i].start).normalized();
    const auto distance = [&](const Eigen::Vector2d& p) {
      const Eigen::Vector2d q = p - edges[i].start;
      const double beyond = std::max({0.0, -d.dot(q) - 3, d.dot(q) - edges[i].Length() - 3});
      return std::abs(d.x() * q.y() - d.y() * q.x()) + beyond;
    };
    const double largest = std::max(distance(segment.start), distance(segment.end));
    if (largest < best.second) best = {static_cast<int>(i), largest};
  }
  return best;
}

}  // namespace slcmap::testing
