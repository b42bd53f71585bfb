#include "data/check/force_alignment.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "data/check/step_lags.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;

constexpr int64_t kStart_ns = 1'000'000'000'000;
constexpr int64_t kImuStep_ns = 5'000'000, kStereoStep_ns = 200'000'000;
constexpr int kSteps = 35;

// A rig that turns and moves to and fro along all its axes; camera and IMU have the same frame.
RigidTransform PoseAt(double t_s, double size) {
  const Vector3d turn(0.4 * std::sin(0.9 * t_s), 0.3 * std::sin(1.3 * t_s), 0.5 * std::sin(t_s));
  return {ExpRotation(turn), size * Vector3d(0.3 * std::sin(2.1 * t_s), 0.2 * std::sin(2.9 * t_s),
                                             0.25 * std::cos(2.4 * t_s))};
}

struct ForceRecording {
  std::vector<ImuSample> imu;
  std::vector<StereoStep> steps;
  TurnAlignment turns;
};

// `size` scales the movement, and `claimed_baseline` what the images show of it.
ForceRecording MakeForces(double size, double claimed_baseline) {
  constexpr double kH_s = 1e-3;
  ForceRecording made;
  for (int64_t t_ns = 0; t_ns <= kSteps * kStereoStep_ns; t_ns += kImuStep_ns) {
    const double t_s = ToSeconds(t_ns);
    const RigidTransform before = PoseAt(t_s - kH_s, size), now = PoseAt(t_s, size),
                         after = PoseAt(t_s + kH_s, size);
    const Vector3d acceleration =
        (before.translation - 2 * now.translation + after.translation) / (kH_s * kH_s);
    made.imu.push_back({kStart_ns + t_ns,
                        LogRotation(before.rotation.conjugate() * after.rotation) / (2 * kH_s),
                        now.rotation.conjugate() * (acceleration + Vector3d(0, 0, 9.81))});
  }
  std::mt19937 random(1);
  std::uniform_real_distribution<double> spread(-1, 1);
  for (int i = 0; i < kSteps; ++i) {
    StereoStep step{kStart_ns + i * kStereoStep_ns, kStart_ns + (i + 1) * kStereoStep_ns, {}};
    const RigidTransform first = PoseAt(ToSeconds(i * kStereoStep_ns), size),
                         second = PoseAt(ToSeconds((i + 1) * kStereoStep_ns), size);
    for (int k = 0; k < 60; ++k) {
      const Vector3d p(1.5 * spread(random), spread(random), 3 + spread(random));
      step.rays.push_back({claimed_baseline * p, (second.Inverse() * (first * p)).normalized()});
    }
    made.steps.push_back(step);
  }
  made.turns.enough_motion = true;
  return made;
}

ForceAlignment Align(const ForceRecording& made, const RigidTransform& T_imu_camera = {}) {
  return AlignForces(made.steps, made.imu, made.turns, T_imu_camera);
}

TEST(ForceAlignment, FitsAGoodRecording) {
  const ForceAlignment found = Align(MakeForces(1, 1));
  ASSERT_TRUE(found.enough_motion);
  EXPECT_TRUE(found.best.change.IsNone()) << found.best.change.words;
  EXPECT_NEAR(found.image_scale, 1, 0.03);
  EXPECT_LT(found.lever_m.norm(), 0.05);
}

TEST(ForceAlignment, NamesAChangeOfAxes) {
  ForceRecording made = MakeForces(1, 1);
  for (ImuSample& sample : made.imu) sample.specific_force_m_s2.y() *= -1;
  EXPECT_EQ(Align(made).best.change.words, "y negated");
}

TEST(ForceAlignment, MeasuresTheBaseline) {
  const ForceAlignment found = Align(MakeForces(1, 0.5));
  ASSERT_TRUE(found.enough_motion);
  EXPECT_TRUE(found.best.change.IsNone());
  EXPECT_NEAR(found.image_scale, 2, 0.1);
}

// The rotation inverted fits a little better than as claimed: no reason to change axes, and to
// leave the baseline unjudged.
TEST(ForceAlignment, AChangeThatIsNotClearlyBetterIsNone) {
  ForceRecording made = MakeForces(1, 0.5);
  const Eigen::Quaterniond claimed = ExpRotation({0.004, -0.003, 0.005});
  made.turns.best.change = {claimed.conjugate().toRotationMatrix(), "inverted"};
  const ForceAlignment found = Align(made, {claimed.conjugate(), Vector3d::Zero()});
  EXPECT_TRUE(found.best.change.IsNone()) << found.best.change.words;
  EXPECT_NEAR(found.image_scale, 2, 0.1);
}

TEST(ForceAlignment, SaysWhereThereIsTooLittleMotion) {
  ForceRecording made = MakeForces(1, 1);
  made.steps.resize(5);
  EXPECT_FALSE(Align(made).enough_motion);
  made.turns.enough_motion = false;
  EXPECT_FALSE(Align(made).enough_motion);
}

}  // namespace
}  // namespace slcmap
