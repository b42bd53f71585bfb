#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "data/check/force_alignment.h"
#include "data/check/row_alignment.h"
#include "data/check/step_lags.h"
#include "data/check/turn_alignment.h"
#include "data/core/math.h"
#include "tests/testing/pinhole_camera.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;

constexpr int64_t kStart_ns = 1'000'000'000'000;
constexpr int64_t kImuStep_ns = 5'000'000, kImageStep_ns = 50'000'000;
constexpr int kImages = 120;

Eigen::Quaterniond RigRotation() {
  return ExpRotation({0.02, -0.03, 0.01}) * Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ());
}

// Turn rates about all axes, or about one only, in the IMU.
Eigen::Vector3d RateAt(double t_s, double size) {
  return size * Eigen::Vector3d(std::sin(2.3 * t_s), 0.7 * std::cos(3.1 * t_s + 1),
                                0.5 * std::sin(1.3 * t_s) + 0.4 * std::cos(4.7 * t_s));
}

struct TurnRecording {
  std::vector<ImuSample> imu;
  std::vector<ImageTurn> turns;
};

// Images whose stamps are behind the IMU's clock by `offset_s`. The samples cover 4 s more on
// either side.
TurnRecording MakeTurns(double offset_s, double size = 0.5, double noise_rad = 2e-4) {
  TurnRecording made;
  const int64_t end_ns = kStart_ns + kImages * kImageStep_ns;
  constexpr int64_t kMore_ns = 4'000'000'000;
  const Vector3d bias_rad_s(0.01, -0.02, 0.03);
  for (int64_t t_ns = kStart_ns - kMore_ns; t_ns < end_ns + kMore_ns; t_ns += kImuStep_ns) {
    made.imu.push_back(
        {t_ns, RateAt(ToSeconds(t_ns - kStart_ns), size) + bias_rad_s, Vector3d::Zero()});
  }
  const GyroIntegral gyro(made.imu);
  std::mt19937 random(1);
  std::normal_distribution<double> normal(0, noise_rad);
  for (int i = 0; i < kImages; ++i) {
    ImageTurn turn;
    turn.from_ns = kStart_ns + i * kImageStep_ns;
    turn.to_ns = turn.from_ns + kImageStep_ns;
    const int64_t offset_ns = ToNanoseconds(offset_s);
    const Vector3d turned =
        gyro.Between(turn.from_ns + offset_ns, turn.to_ns + offset_ns) - bias_rad_s * 0.05;
    turn.turn_rad = RigRotation().conjugate() * turned +
                    Vector3d(normal(random), normal(random), normal(random));
    turn.covariance = noise_rad * noise_rad * Eigen::Matrix3d::Identity();
    made.turns.push_back(turn);
  }
  return made;
}

TEST(TurnAlignment, FindsTheTimeOffset) {
  for (const double offset_s : {-0.15, 0.0, 0.0033, 0.08}) {
    const TurnRecording made = MakeTurns(offset_s);
    const TurnAlignment found = AlignTurns(made.turns, made.imu, RigRotation(), 0);
    ASSERT_TRUE(found.enough_motion);
    EXPECT_TRUE(found.best.change.IsNone()) << found.best.change.words;
    EXPECT_NEAR(found.time_offset_s, offset_s, 5e-4);
    EXPECT_NEAR(found.time_offset_s, offset_s, 4 * found.time_offset_sigma_s);
  }
  // It is counted from the claimed one.
  const TurnRecording far = MakeTurns(0.45);
  EXPECT_NEAR(AlignTurns(far.turns, far.imu, RigRotation(), 0.4).time_offset_s, 0.45, 5e-4);
}

TEST(TurnAlignment, FindsASmallTurnOfTheCameraAndSurvivesWrongTurns) {
  TurnRecording made = MakeTurns(0.02);
  const Eigen::Quaterniond claimed = ExpRotation({0.02, -0.01, 0.015}) * RigRotation();
  const TurnAlignment found = AlignTurns(made.turns, made.imu, claimed, 0);
  EXPECT_TRUE(found.best.change.IsNone());
  EXPECT_LT(found.R_imu_camera.angularDistance(RigRotation()), 6e-3);
  for (size_t i = 0; i < made.turns.size(); i += 10) made.turns[i].turn_rad *= -3;
  EXPECT_NEAR(AlignTurns(made.turns, made.imu, RigRotation(), 0).time_offset_s, 0.02, 1e-3);
}

TEST(TurnAlignment, NamesEachChangeOfAxes) {
  const TurnRecording made = MakeTurns(-0.03);
  for (const AxisChange& change : AxisChanges()) {
    std::vector<ImuSample> imu = made.imu;
    for (ImuSample& sample : imu) {
      sample.angular_velocity_rad_s = change.matrix.transpose() * sample.angular_velocity_rad_s;
    }
    const TurnAlignment found = AlignTurns(made.turns, imu, RigRotation(), 0);
    EXPECT_EQ(found.best.change.words, change.words);
    EXPECT_LT(found.best.unexplained, 0.01) << change.words;
    EXPECT_NEAR(found.time_offset_s, -0.03, 1e-3) << change.words;
    EXPECT_EQ(found.claimed.unexplained < 0.1, change.IsNone()) << change.words;
  }
}

TEST(TurnAlignment, NamesAnInvertedRotation) {
  const TurnRecording made = MakeTurns(0);
  const Eigen::Quaterniond tilted = ExpRotation({0.4, 0.3, -0.5}) * RigRotation();
  std::vector<ImageTurn> turns = made.turns;
  for (ImageTurn& turn : turns)
    turn.turn_rad = tilted.conjugate() * (RigRotation() * turn.turn_rad);
  const TurnAlignment found = AlignTurns(turns, made.imu, tilted.conjugate(), 0);
  EXPECT_EQ(found.best.change.words, "inverted");
  EXPECT_LT(found.R_imu_camera.angularDistance(tilted), 6e-3);
}

TEST(TurnAlignment, MeasuresTheScaleOfEachAxis) {
  TurnRecording made = MakeTurns(0);
  for (ImageTurn& turn : made.turns) {
    turn.turn_rad.x() *= 0.9;
    turn.turn_rad.y() *= 0.9;
  }
  const TurnAlignment found = AlignTurns(made.turns, made.imu, RigRotation(), 0);
  EXPECT_LT((found.scales - Eigen::Vector3d(0.9, 0.9, 1)).norm(), 0.02);
}

// Of a recording whose samples begin and end with the images, as far as their stamps tell.
std::optional<double> FarOffsetOf(TurnRecording made) {
  std::erase_if(made.imu, [](const ImuSample& sample) {
    return sample.stamp_ns < kStart_ns || sample.stamp_ns > kStart_ns + kImages * kImageStep_ns;
  });
  return FindFarOffset(made.turns, made.imu, RigRotation(), 0);
}

TEST(TurnAlignment, ALevelRigTellsNothingOfTheAxesThatItDoesNotTurnAbout) {
  TurnRecording made = MakeTurns(0);
  const auto turn_rad_s = [](double t_s) { return 0.5 * std::sin(2.3 * t_s); };
  for (ImuSample& sample : made.imu) {
    const double t_s = ToSeconds(sample.stamp_ns - kStart_ns);
    const Vector3d shaken_rad_s(0.003 * std::sin(3.1 * t_s), 0, 0.003 * std::cos(4.7 * t_s));
    sample.angular_velocity_rad_s =
        RigRotation() * (Vector3d(0, turn_rad_s(t_s), 0) + shaken_rad_s);
  }
  // Of the turn about y a little is taken for one about x and z.
  const GyroIntegral gyro(made.imu);
  for (ImageTurn& turn : made.turns) {
    const double about_y = (RigRotation().conjugate() * gyro.Between(turn.from_ns, turn.to_ns)).y();
    turn.turn_rad += Vector3d(0.001, 1, -0.001) * about_y - turn.turn_rad;
    turn.covariance = 1e-8 * Eigen::Matrix3d::Identity();
  }
  const TurnAlignment found = AlignTurns(made.turns, made.imu, RigRotation(), 0);
  ASSERT_TRUE(found.enough_motion);
  EXPECT_NEAR(found.scales.y(), 1, 0.01);
  EXPECT_LT(found.scale_sigmas.y(), 0.005);
  EXPECT_GT(found.scale_sigmas.x(), 0.15);
  EXPECT_GT(found.scale_sigmas.z(), 0.15);
}

TEST(TurnAlignment, FindsClocksThatAreSecondsApart) {
  for (const double offset_s : {-3.0, -1.0, 1.7}) {
    const auto found = FarOffsetOf(MakeTurns(offset_s));
    ASSERT_TRUE(found) << offset_s;
    EXPECT_NEAR(*found, offset_s, 0.011);
  }
  for (const double offset_s : {0.0, 0.03}) EXPECT_FALSE(FarOffsetOf(MakeTurns(offset_s)));
}

TEST(TurnAlignment, DoesNotGuessClocksThatAreApart) {
  EXPECT_FALSE(FarOffsetOf(MakeTurns(-3, 0.001)));     // without motion
  EXPECT_FALSE(FarOffsetOf(MakeTurns(-3, 0.5, 0.1)));  // nothing fits
  TurnRecording periodic = MakeTurns(0);
  for (ImuSample& sample : periodic.imu) {
    sample.angular_velocity_rad_s =
        std::sin(M_PI * ToSeconds(sample.stamp_ns)) * Eigen::Vector3d(1, 0.5, 0.2);
  }
  const GyroIntegral gyro(periodic.imu);
  for (ImageTurn& turn : periodic.turns) {
    turn.turn_rad = RigRotation().conjugate() * gyro.Between(turn.from_ns, turn.to_ns);
  }
  EXPECT_FALSE(FarOffsetOf(periodic));  // many fit
}

TEST(TurnAlignment, DoesNotGuessWithoutMotion) {
  const TurnRecording still = MakeTurns(0, 0.001);
  EXPECT_FALSE(AlignTurns(still.turns, still.imu, RigRotation(), 0).enough_motion);
  TurnRecording shaken = MakeTurns(0, 0.5, 0.03);  // images that show noise more than turns
  EXPECT_FALSE(AlignTurns(shaken.turns, shaken.imu, RigRotation(), 0).enough_motion);
  EXPECT_FALSE(AlignTurns({}, still.imu, RigRotation(), 0).enough_motion);
  EXPECT_FALSE(AlignTurns(still.turns, {}, RigRotation(), 0).enough_motion);
}

constexpr int64_t kStereoStep_ns = 200'000'000;
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

TEST(ForceAlignment, FitsAGoodRecordingAndNamesAChangeOfAxes) {
  ForceRecording made = MakeForces(1, 1);
  const ForceAlignment found = Align(made);
  ASSERT_TRUE(found.enough_motion);
  EXPECT_TRUE(found.best.change.IsNone()) << found.best.change.words;
  EXPECT_NEAR(found.image_scale, 1, 0.03);
  EXPECT_LT(found.lever_m.norm(), 0.05);
  for (ImuSample& sample : made.imu) sample.specific_force_m_s2.y() *= -1;
  EXPECT_EQ(Align(made).best.change.words, "y negated");
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

// Where readings hardly tell how large accelerations are, they tell the lever no better.
TEST(ForceAlignment, TheLeverIsKnownAsWellAsTheScaleItIsDividedBy) {
  for (const unsigned seed : {1, 2, 3, 4, 5, 6}) {
    ForceRecording made = MakeForces(0.3, 1);
    std::mt19937 random(seed);
    std::normal_distribution<double> noise(0, 3);
    for (ImuSample& sample : made.imu) {
      for (double& value : sample.specific_force_m_s2) value += noise(random);
    }
    const ForceAlignment found = Align(made);
    if (!found.enough_motion) continue;
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_LT(std::abs(found.lever_m[axis]), 4 * found.lever_sigma_m[axis]) << seed << axis;
      EXPECT_GE(found.lever_sigma_m[axis] * found.image_scale,
                0.9 * std::abs(found.lever_m[axis]) * found.image_scale_sigma);
    }
  }
}

TEST(ForceAlignment, SaysWhereThereIsTooLittleMotion) {
  ForceRecording made = MakeForces(1, 1);
  made.steps.resize(5);
  EXPECT_FALSE(Align(made).enough_motion);
  made.turns.enough_motion = false;
  EXPECT_FALSE(Align(made).enough_motion);
}

constexpr double kFocal_px = 450;

RigidTransform LeftRight() { return {Eigen::Quaterniond::Identity(), {0.11, 0.002, -0.001}}; }

// Rays of points before the rig, some of them wrong, as seen by a right camera that is turned more
// than LeftRight() says.
std::vector<RayPair> Matches(const Eigen::Vector3d& turn_rad, double noise_px) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> across(-0.7, 0.7), depth(1, 8);
  std::normal_distribution<double> noise(0, noise_px / kFocal_px);
  const RigidTransform T_left_right = {LeftRight().rotation * ExpRotation(turn_rad),
                                       LeftRight().translation};
  std::vector<RayPair> matches;
  for (int i = 0; i < 1500; ++i) {
    const double z = depth(random);
    const Eigen::Vector3d p(across(random) * z, 0.6 * across(random) * z, z);
    const Eigen::Vector3d wrong(0, i % 10 == 0 ? across(random) : 0, 0);
    const Eigen::Vector3d error(noise(random), noise(random), 0);
    matches.push_back({(p / z).normalized(),
                       ((T_left_right.Inverse() * p).normalized() + error + wrong).normalized()});
  }
  return matches;
}

TEST(RowAlignment, FindsTheTurnOfTheRightCamera) {
  for (const Eigen::Vector3d& turn :
       {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(0.05, 0, -0.02), Eigen::Vector3d(-3, 0, 1)}) {
    const RowAlignment found = AlignRows(Matches(turn * kDegree, 0.2), LeftRight(), kFocal_px);
    EXPECT_NEAR(found.turn_rad.x() / kDegree, turn.x(), 0.005);
    EXPECT_NEAR(found.turn_rad.z() / kDegree, turn.z(), 0.01);
    EXPECT_LT(std::abs(found.turn_rad.x() - turn.x() * kDegree), 4 * found.turn_sigma_rad.x());
    EXPECT_LT(found.mended_rows_px, 0.25);
    EXPECT_NEAR(found.agreeing_share, 0.9, 0.05);
  }
}

TEST(RowAlignment, TurnsAboutYOnlyWhereThatIsClear) {
  const RowAlignment small =
      AlignRows(Matches(Eigen::Vector3d(0, 0.03, 0) * kDegree, 0.2), LeftRight(), kFocal_px);
  EXPECT_NEAR(small.turn_rad.y(), 0, 1e-5);
  const RowAlignment large =
      AlignRows(Matches(Eigen::Vector3d(0.1, 0.5, 0) * kDegree, 0.2), LeftRight(), kFocal_px);
  EXPECT_NEAR(large.turn_rad.y() / kDegree, 0.5, 0.1);
  EXPECT_NEAR(large.turn_rad.x() / kDegree, 0.1, 0.01);
  EXPECT_EQ(AlignRows({}, LeftRight(), kFocal_px).matches, 0);
}

// The same features as a right camera shows them whose focal length is told as another one.
std::vector<RayPair> ToldLonger(std::vector<RayPair> matches, const Camera& told, double share) {
  Camera is = told;
  is.fx_px /= 1 + share;
  is.fy_px /= 1 + share;
  for (RayPair& rays : matches)
    rays.second = told.Unproject(*is.Project(rays.second))->normalized();
  return matches;
}

TEST(RowAlignment, FindsTheFocalLengthOfTheRightCameraBesideItsTurn) {
  const Camera right = testing::PinholeCamera(752, 480, kFocal_px, 376, 240);
  for (const double share : {0.004, -0.01, 0.0003, 0.0}) {
    const std::vector<RayPair> matches =
        ToldLonger(Matches(Eigen::Vector3d(0.05, 0, -0.02) * kDegree, 0.2), right, share);
    const RowAlignment found =
        AlignRows(matches, LeftRight(), kFocal_px, LongerRays(matches, right));
    // What is too little to be clear is not told.
    EXPECT_NEAR(found.right_focal, std::abs(share) < 0.001 ? 0 : 1 / (1 + share) - 1, 2e-4);
    EXPECT_NEAR(found.turn_rad.x() / kDegree, 0.05, 0.005) << share;
    EXPECT_NEAR(found.turn_rad.z() / kDegree, -0.02, 0.01) << share;
    EXPECT_LT(found.mended_rows_px, 0.25) << share;
    // Without the rays that tell of it, rows stay as far apart as it has them.
    if (std::abs(share) > 0.005) {
      EXPECT_GT(AlignRows(matches, LeftRight(), kFocal_px).mended_rows_px, 0.4);
    }
  }
}

// Pairs of a rig that hardly moves show the same features with the same errors.
TEST(RowAlignment, IsNotSureOfATurnAboutYBecauseAViewIsRepeated) {
  for (int view = 0; view < 12; ++view) {
    const std::vector<RayPair> all = Matches(Eigen::Vector3d::Zero(), 0.3);
    std::vector<RayPair> repeated;
    for (int i = 0; i < 24; ++i) {
      repeated.insert(repeated.end(), all.begin() + 30 * view, all.begin() + 30 * (view + 1));
    }
    const RowAlignment found = AlignRows(repeated, LeftRight(), kFocal_px);
    EXPECT_LT(std::abs(found.turn_rad.y()), 1e-3 * kDegree + 1e-5) << view;
  }
}

}  // namespace
}  // namespace slcmap
