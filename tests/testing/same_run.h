// Whether two runs hold the same, field by field.
#pragma once

#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <tuple>
#include <vector>

#include "odometry/run/run.h"

namespace slcmap::testing {

// All that tables hold of an item, but for poses, which they hold rounded, and other items.
inline auto Fields(const OnlineState& s) {
  return std::tie(s.stamp_ns, s.segment, s.velocity_world_m_s, s.gyro_bias_rad_s,
                  s.accel_bias_m_s2);
}
inline auto Fields(const Keyframe& k) {
  return std::tie(k.id, k.segment, k.stamp_ns, k.T_world_imu.translation);
}
inline Eigen::Vector2d Rounded(const Eigen::Vector2d& px) { return (1e4 * px).array().round(); }
inline auto Fields(const KeyframeObservation& o) {
  return std::make_tuple(o.landmark_id, Rounded(o.left_px), o.right_px.has_value(),
                         Rounded(o.right_px.value_or(o.left_px)), o.camera);
}
inline auto Fields(const LineObservation& o) {
  const LineSegment right = o.right_px.value_or(o.left_px);
  return std::make_tuple(o.id, Rounded(o.left_px.start), Rounded(o.left_px.end),
                         o.right_px.has_value(), Rounded(right.start), Rounded(right.end),
                         o.camera);
}
inline auto Fields(const Landmark& l) {
  return std::tie(l.id, l.segment, l.p_world, l.sigma_m, l.observations);
}
inline auto Fields(const Line& l) {
  return std::tie(l.id, l.segment, l.axis, l.world, l.start_world, l.end_world, l.covariance_m2,
                  l.observations, l.last_keyframe, l.deviation_rad, l.deviation_sigma_rad,
                  l.point_ids);
}
inline auto Fields(const ManhattanWorld& w) {
  return std::tie(w.segment, w.heading_rad, w.sigma_rad, w.found_at_ns, w.withdrawn);
}
inline auto Fields(const SlopedDirection& s) {
  return std::tie(s.segment, s.azimuth_rad, s.elevation_rad, s.azimuth_sigma_rad,
                  s.elevation_sigma_rad, s.found_at_ns, s.withdrawn);
}
inline auto Fields(const CalibrationEstimate& e) {
  return std::tie(e.stamp_ns, e.segment, e.time_offset_s, e.imu_rotation_rad, e.lever_m,
                  e.right_rotation_rad, e.focal_length, e.right_centre_px, e.imu_errors,
                  e.time_offset_sigma_s, e.imu_rotation_sigma_rad, e.lever_sigma_m,
                  e.right_rotation_sigma_rad, e.focal_length_sigma, e.right_centre_sigma_px,
                  e.imu_errors_sigma);
}
inline auto Fields(const ImuSample& s) {
  return std::tie(s.stamp_ns, s.angular_velocity_rad_s, s.specific_force_m_s2);
}
inline auto Fields(const Camera& c) {
  return std::tie(c.distortion, c.width_px, c.height_px, c.fx_px, c.fy_px, c.cx_px, c.cy_px,
                  c.coefficients);
}
inline auto Fields(const CheckCorrection& c) { return std::tie(c.name, c.values, c.words); }
inline auto Fields(const StereoEntry& e) { return std::tie(e.stamp_ns, e.left_path, e.right_path); }
inline auto Fields(const PairPiece& p) {
  return std::tie(p.from_ns, p.to_ns, p.later, p.late, p.has_right);
}
inline auto Fields(const VerdictReason& r) {
  return std::tie(r.level, r.what, r.found, r.expected, r.remedy);
}
inline auto Fields(const StageTiming& t) { return std::tie(t.name, t.wall_s, t.calls); }

template <typename Item>
void ExpectSame(const std::vector<Item>& read, const std::vector<Item>& given) {
  SCOPED_TRACE(::testing::internal::GetTypeName<Item>());
  ASSERT_EQ(read.size(), given.size());
  for (size_t i = 0; i < given.size(); ++i) EXPECT_TRUE(Fields(read[i]) == Fields(given[i])) << i;
}

inline void ExpectSamePose(const RigidTransform& read, const RigidTransform& given) {
  EXPECT_TRUE(read.translation.isApprox(given.translation, 1e-8));
  EXPECT_LT(read.rotation.angularDistance(given.rotation), 1e-7);
}

inline void ExpectSameSource(const RunSource& read, const RunSource& given) {
  const auto texts = [](const RunSource& s) {
    return std::tie(s.version, s.sequence, s.calibration, s.options, s.check_errors);
  };
  EXPECT_TRUE(texts(read) == texts(given));
  ExpectSame(read.corrections, given.corrections);
  ExpectSame(read.images, given.images);
  ExpectSame(read.raw_rig.cameras, given.raw_rig.cameras);
  for (const int i : {0, 1}) {
    const cv::Mat &mask = read.raw_rig.masks[i], &of_given = given.raw_rig.masks[i];
    ASSERT_EQ(mask.size(), of_given.size());
    EXPECT_TRUE(mask.empty() || cv::countNonZero(mask != of_given) == 0);
  }
  const auto opened = [](const RunSource& s) {
    return std::tie(s.opened.calibration, s.opened.max_stereo_offset_s, s.opened.right_offset_s,
                    s.opened.masks, s.opened.cameras);
  };
  EXPECT_TRUE(opened(read) == opened(given));
  ExpectSame(read.opened.pieces, given.opened.pieces);
}

// But for whether it is complete, and what it took.
inline void ExpectSameRun(const OdometryRun& read, const OdometryRun& given) {
  const auto texts = [](const OdometryRun& run) {
    return std::tie(run.method, run.warnings, run.line_deviation_rad);
  };
  EXPECT_TRUE(texts(read) == texts(given));
  for (const auto& [name, member] : kRunFigures) {
    const auto values = [member = member](const OdometryRun& run) {
      const FigureSummary& figure = run.figures.*member;
      return std::tie(figure.mean, figure.worst, figure.count);
    };
    EXPECT_TRUE(values(read) == values(given)) << name;
  }
  const auto reasons = [](const OdometryRun& run) {
    return run.verdict.value_or(Verdict()).reasons;
  };
  ExpectSame(reasons(read), reasons(given));
  ExpectSame(read.states, given.states);
  for (size_t i = 0; i < given.states.size(); ++i) {
    ExpectSamePose(read.states[i].T_world_imu, given.states[i].T_world_imu);
  }
  ExpectSame(read.keyframes, given.keyframes);
  for (size_t i = 0; i < given.keyframes.size(); ++i) {
    ExpectSamePose(read.keyframes[i].T_world_imu, given.keyframes[i].T_world_imu);
    ExpectSame(read.keyframes[i].observations, given.keyframes[i].observations);
    ExpectSame(read.keyframes[i].lines, given.keyframes[i].lines);
  }
  ExpectSame(read.landmarks, given.landmarks);
  ExpectSame(read.lines, given.lines);
  ExpectSame(read.manhattan_worlds, given.manhattan_worlds);
  ExpectSame(read.sloped_directions, given.sloped_directions);
  ExpectSame(read.calibration, given.calibration);
  ExpectSame(read.imu, given.imu);
  ExpectSame(read.rectified_rig.cameras, given.rectified_rig.cameras);
  for (size_t i = 0; i < given.rectified_rig.T_imu_camera.size(); ++i) {
    ExpectSamePose(read.rectified_rig.T_imu_camera[i], given.rectified_rig.T_imu_camera[i]);
  }
  EXPECT_EQ(read.rectified_rig.imu_noise.rate_hz, given.rectified_rig.imu_noise.rate_hz);
  EXPECT_EQ(read.rectified_rig.camera_time_offset_s, given.rectified_rig.camera_time_offset_s);
  ASSERT_EQ(read.source.has_value(), given.source.has_value());
  if (given.source) ExpectSameSource(*read.source, *given.source);
}

}  // namespace slcmap::testing
