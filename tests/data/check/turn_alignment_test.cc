#include "data/check/turn_alignment.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "data/check/step_lags.h"

namespace slcmap {
namespace {

constexpr int64_t kTurnStart_ns = 1'000'000'000'000;
constexpr int64_t kTurnImuStep_ns = 5'000'000, kImageStep_ns = 50'000'000;
constexpr int kImages = 150;

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
  const int64_t end_ns = kTurnStart_ns + kImages * kImageStep_ns;
  constexpr int64_t kMore_ns = 4'000'000'000;
  for (int64_t t_ns = kTurnStart_ns - kMore_ns; t_ns < end_ns + kMore_ns; t_ns += kTurnImuStep_ns) {
    ImuSample sample;
    sample.stamp_ns = t_ns;
    sample.angular_velocity_rad_s =
        RateAt(ToSeconds(t_ns - kTurnStart_ns), size) + Eigen::Vector3d(0.01, -0.02, 0.03);
    made.imu.push_back(sample);
  }
  const GyroIntegral gyro(made.imu);
  std::mt19937 random(1);
  std::normal_distribution<double> normal(0, noise_rad);
  for (int i = 0; i < kImages; ++i) {
    ImageTurn turn;
    turn.from_ns = kTurnStart_ns + i * kImageStep_ns;
    turn.to_ns = turn.from_ns + kImageStep_ns;
    const int64_t offset_ns = ToNanoseconds(offset_s);
    const Eigen::Vector3d turned = gyro.Between(turn.from_ns + offset_ns, turn.to_ns + offset_ns) -
                                   Eigen::Vector3d(0.01, -0.02, 0.03) * 0.05;
    turn.turn_rad = RigRotation().conjugate() * turned +
                    Eigen::Vector3d(normal(random), normal(random), normal(random));
    turn.covariance = noise_rad * noise_rad * Eigen::Matrix3d::Identity();
    made.turns.push_back(turn);
  }
  return made;
}

TEST(TurnAlignment, FindsTheTimeOffset) {
  for (const double offset_s : {-0.15, -0.0421, 0.0, 0.0033, 0.08, 0.15}) {
    const TurnRecording made = MakeTurns(offset_s);
    const TurnAlignment found = AlignTurns(made.turns, made.imu, RigRotation(), 0);
    ASSERT_TRUE(found.enough_motion);
    EXPECT_TRUE(found.best.change.IsNone()) << found.best.change.words;
    EXPECT_NEAR(found.time_offset_s, offset_s, 5e-4);
    EXPECT_NEAR(found.time_offset_s, offset_s, 4 * found.time_offset_sigma_s);
  }
}

TEST(TurnAlignment, CountsFromTheClaimedOffset) {
  const TurnRecording made = MakeTurns(0.45);
  EXPECT_NEAR(AlignTurns(made.turns, made.imu, RigRotation(), 0.4).time_offset_s, 0.45, 5e-4);
}

TEST(TurnAlignment, FindsASmallTurnOfTheCamera) {
  const TurnRecording made = MakeTurns(0.01);
  const Eigen::Quaterniond claimed = ExpRotation({0.02, -0.01, 0.015}) * RigRotation();
  const TurnAlignment found = AlignTurns(made.turns, made.imu, claimed, 0);
  EXPECT_TRUE(found.best.change.IsNone());
  EXPECT_LT(found.R_imu_camera.angularDistance(RigRotation()), 6e-3);
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

TEST(TurnAlignment, SurvivesWrongTurns) {
  TurnRecording made = MakeTurns(0.02);
  for (size_t i = 0; i < made.turns.size(); i += 10) made.turns[i].turn_rad *= -3;
  EXPECT_NEAR(AlignTurns(made.turns, made.imu, RigRotation(), 0).time_offset_s, 0.02, 1e-3);
}

// Of a recording whose samples begin and end with the images, as far as their stamps tell.
std::optional<double> FarOffsetOf(TurnRecording made) {
  std::erase_if(made.imu, [](const ImuSample& sample) {
    return sample.stamp_ns < kTurnStart_ns ||
           sample.stamp_ns > kTurnStart_ns + kImages * kImageStep_ns;
  });
  return FindFarOffset(made.turns, made.imu, RigRotation(), 0);
}

TEST(TurnAlignment, FindsClocksThatAreSecondsApart) {
  for (const double offset_s : {-3.0, -1.0, 1.7}) {
    const auto found = FarOffsetOf(MakeTurns(offset_s));
    ASSERT_TRUE(found) << offset_s;
    EXPECT_NEAR(*found, offset_s, 0.011);
  }
}

TEST(TurnAlignment, ClocksThatAgreeAreNotApart) {
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

}  // namespace
}  // namespace slcmap
