// Whether states, slopes and landmarks are as far from the truth as their covariances claim.
// Landmarks are counted from the keyframes that their covariances refer to.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <map>

#include "data/core/math.h"
#include "odometry/window/estimator.h"
#include "tests/odometry/window/line_runs.h"

namespace slcmap {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

// A mean of normalised squared errors, each over its freedoms: 1 where the claims are honest.
struct Nees {
  double sum = 0;
  int count = 0;
  void Add(double chi2, int freedoms) {
    // A landmark that is wrong as a whole is no matter of its covariance.
    sum += std::min(chi2 / freedoms, 25.0);
    ++count;
  }
  double Mean() const { return sum / count; }
};

// What the simulation of one run says of its landmarks' claims.
class Judge {
 public:
  // Notes the hosts of the landmarks that are in the window.
  void Look(const WindowState& window) {
    for (const auto& [id, landmark] : window.landmarks) {
      if (landmark.triangulated) host_[id] = landmark.host()->id;
    }
  }

  // Along the ray of the host.
  void JudgePoints(const SimulatedRun& run, Nees* nees) const {
    for (const Landmark& landmark : run.run.landmarks) {
      const RigidTransform estimate = Estimate(run, host_.at(landmark.id));
      const RigidTransform off = estimate * Truth(run, host_.at(landmark.id)).Inverse();
      const Vector3d camera = (estimate * run.rig.T_imu_camera[0]).translation;
      const Vector3d ray = (landmark.p_world - camera).normalized();
      const Vector3d truth = off * run.landmarks_world[static_cast<size_t>(landmark.id)];
      nees->Add(std::pow(ray.dot(landmark.p_world - truth) / landmark.sigma_m, 2), 1);
    }
  }

  // Across the line at its middle, counted from the last keyframe that saw it.
  void JudgeLines(const SimulatedRun& run, Nees* nees) const {
    for (const Line& line : run.run.lines) {
      const RigidTransform off =
          Estimate(run, line.last_keyframe) * Truth(run, line.last_keyframe).Inverse();
      const SimulatedEdge& edge = run.edges[static_cast<size_t>(line.id)];
      const Vector3d start = off * edge.start_world, end = off * edge.end_world;
      const Vector3d normal = (line.end_world - line.start_world).normalized();
      const Vector3d middle = 0.5 * (line.start_world + line.end_world);
      const double along = normal.dot(middle - start) / normal.dot(end - start);
      const Vector3d error = start + along * (end - start) - middle;
      const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(line.covariance_m2);
      EXPECT_LT(eigen.eigenvalues()[0], 1e-6 * eigen.eigenvalues()[2]);
      const Vector2d off_axes = eigen.eigenvectors().rightCols<2>().transpose() * error;
      nees->Add(off_axes.cwiseAbs2().dot(eigen.eigenvalues().tail<2>().cwiseInverse()), 2);
    }
  }

 private:
  static const Keyframe& Find(const SimulatedRun& run, int64_t id) {
    return *std::find_if(run.run.keyframes.begin(), run.run.keyframes.end(),
                         [&](const Keyframe& keyframe) { return keyframe.id == id; });
  }
  static RigidTransform Estimate(const SimulatedRun& run, int64_t id) {
    return Find(run, id).T_world_imu;
  }
  static RigidTransform Truth(const SimulatedRun& run, int64_t id) {
    return run.motion->PoseAt(ToSeconds(Find(run, id).stamp_ns));
  }
  std::map<int64_t, int64_t> host_;
};

struct Claims {
  const char* name;
  Method method;
  double deviation_rad, sloped_share;
};

SimulatedRunOptions NoisyBuilding(const Claims& claims, uint64_t seed) {
  SimulatedRunOptions options = NoisyLines(claims.method, seed);
  options.lines->deviation_rad = claims.deviation_rad;
  if (claims.method == Method::kPointsLines) options.lines->general_share = 0.3;
  if (claims.sloped_share > 0) AddStairs(claims.sloped_share, &options);
  if (claims.deviation_rad > 0) options.lines->max_lines = 40;
  return options;
}

class CovarianceTest : public ::testing::TestWithParam<Claims> {};

TEST_P(CovarianceTest, IsWhatTheErrorsAre) {
  Nees pose, all, slope, points, lines;
  for (const uint64_t seed : {21, 22, 23, 24, 25, 26}) {
    Judge judge;
    const SimulatedRun run = RunOnSimulatedTracks(
        NoisyBuilding(GetParam(), seed), nullptr,
        [&](Estimator* estimator) { judge.Look(estimator->window().state()); });
    pose.Add(run.final_pose_nees, 6);
    all.Add(run.final_nees, 15);
    if (GetParam().sloped_share > 0) {
      EXPECT_GT(run.final_slope_nees, 0) << "it is known";
      slope.Add(run.final_slope_nees, 2);
    }
    judge.JudgePoints(run, &points);
    judge.JudgeLines(run, &lines);
  }
  // The means of six are known to 0.24 and 0.15.
  EXPECT_GT(pose.Mean(), 0.5);
  EXPECT_LT(pose.Mean(), 1.67);
  EXPECT_GT(all.Mean(), 0.6);
  EXPECT_LT(all.Mean(), 1.47);
  ASSERT_GT(points.count, 500);
  EXPECT_GT(points.Mean(), 0.75);
  EXPECT_LT(points.Mean(), 1.3);
  if (GetParam().sloped_share > 0) {
    EXPECT_LT(slope.Mean(), 2.75);
  }
  if (!UsesLines(GetParam().method)) return;
  ASSERT_GT(lines.count, 100);
  EXPECT_GT(lines.Mean(), 0.6);
  EXPECT_LT(lines.Mean(), 1.5);
}

INSTANTIATE_TEST_SUITE_P(Methods, CovarianceTest,
                         ::testing::Values(Claims{"points", Method::kPoints, 0, 0},
                                           Claims{"pointslines", Method::kPointsLines, 0, 0},
                                           Claims{"structural", Method::kStructural, 0, 0},
                                           Claims{"slc_off", Method::kSlc, 0.3 * kDegree, 0},
                                           Claims{"slc_crooked", Method::kSlc, 1 * kDegree, 0},
                                           Claims{"slc_sloped", Method::kSlc, 0.1 * kDegree, 0.3}),
                         [](const auto& tested) { return tested.param.name; });

}  // namespace
}  // namespace slcmap
