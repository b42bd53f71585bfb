// Segments of known lines as a level or tilted camera sees them, for tests.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <optional>
#include <random>
#include <vector>

#include "data/core/types.h"

namespace slcmap::testing {

inline constexpr double kFocal_px = 400;

// A camera that looks along the heading, pitched down: its z forward, x right, y down.
inline Eigen::Matrix3d CameraLooking(double heading_rad, double pitch_down_rad) {
  const Eigen::Vector3d forward(std::cos(heading_rad) * std::cos(pitch_down_rad),
                                std::sin(heading_rad) * std::cos(pitch_down_rad),
                                -std::sin(pitch_down_rad));
  const Eigen::Vector3d right(std::sin(heading_rad), -std::cos(heading_rad), 0);
  Eigen::Matrix3d R_world_camera;
  R_world_camera << right, forward.cross(right), forward;
  return R_world_camera;
}

struct WorldLine {
  Eigen::Vector3d start, end;  // metres, from the camera's centre
};

// On the plane z = 1, with noise across and along; nothing where an end is not in view.
inline std::optional<LineSegment> Project(const WorldLine& line,
                                          const Eigen::Matrix3d& R_world_camera,
                                          double sigma_px = 0, std::mt19937* random = nullptr) {
  const Eigen::Vector3d s = R_world_camera.transpose() * line.start;
  const Eigen::Vector3d e = R_world_camera.transpose() * line.end;
  if (s.z() < 0.2 || e.z() < 0.2) return std::nullopt;
  LineSegment out{s.head<2>() / s.z(), e.head<2>() / e.z()};
  if (out.start.cwiseAbs().maxCoeff() > 1 || out.end.cwiseAbs().maxCoeff() > 1) {
    return std::nullopt;
  }
  if (random != nullptr) {
    std::normal_distribution<double> noise(0, sigma_px / kFocal_px);
    for (Eigen::Vector2d* end : {&out.start, &out.end})
      *end += Eigen::Vector2d(noise(*random), noise(*random));
  }
  return out;
}

// Lines of a direction scattered in the space before and around the camera.
inline std::vector<WorldLine> ScatteredLines(const Eigen::Vector3d& direction, int count,
                                             std::mt19937* random) {
  std::uniform_real_distribution<double> place(-6, 6), height(-1.5, 1.5), length(0.5, 2);
  std::vector<WorldLine> lines;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d middle(place(*random), place(*random), height(*random));
    const Eigen::Vector3d half = 0.5 * length(*random) * direction.normalized();
    lines.push_back({middle - half, middle + half});
  }
  return lines;
}

inline std::vector<LineSegment> ProjectAll(const std::vector<WorldLine>& lines,
                                           const Eigen::Matrix3d& R_world_camera, double sigma_px,
                                           std::mt19937* random) {
  std::vector<LineSegment> segments;
  for (const WorldLine& line : lines) {
    const auto segment = Project(line, R_world_camera, sigma_px, random);
    if (segment) segments.push_back(*segment);
  }
  return segments;
}

}  // namespace slcmap::testing
