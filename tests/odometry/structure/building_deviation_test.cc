#include "odometry/structure/building_deviation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace slcmap {
namespace {

// Lines of a building, each measured with a standard deviation of its own, as an estimate shows
// them that is tied to the axis.
class MadeBuilding {
 public:
  explicit MadeBuilding(double true_sigma_rad) : true_sigma_rad_(true_sigma_rad) {}

  void AddLines(int count, BuildingDeviation* deviation) {
    for (int i = 0; i < count; ++i) {
      const double noise_rad = std::uniform_real_distribution<double>(2e-4, 3e-3)(generator_);
      const double tie_rad = deviation->sigma_rad();
      LineDeviation line;
      for (int k = 0; k < 2; ++k) {
        const double off_rad =
            true_sigma_rad_ * normal_(generator_) + noise_rad * normal_(generator_);
        const double own = tie_rad * tie_rad / (tie_rad * tie_rad + noise_rad * noise_rad);
        line.off_rad[k] = own * off_rad;
        line.covariance_rad2(k, k) = own * noise_rad * noise_rad;
      }
      deviation->Add(next_id_, line, tie_rad);
      deviation->Close({next_id_++});
      deviation->Solve();
    }
  }

 private:
  int64_t next_id_ = 0;
  double true_sigma_rad_;
  std::mt19937 generator_{5};
  std::normal_distribution<double> normal_;
};

TEST(BuildingDeviation, LearnsHowFarLinesAreOffWithinItsLimits) {
  const BuildingDeviationOptions options;
  EXPECT_EQ(BuildingDeviation({}).sigma_rad(), options.start_sigma_rad) << "before it knows a line";
  for (const double true_sigma_rad : {0.0, 0.0015, 0.005, 0.012, 0.2}) {
    BuildingDeviation deviation({});
    MadeBuilding(true_sigma_rad).AddLines(300, &deviation);
    const double most_rad = std::min(true_sigma_rad, options.max_sigma_rad);
    EXPECT_NEAR(deviation.sigma_rad(), most_rad, std::max(0.25 * most_rad, 0.0005))
        << true_sigma_rad;
    EXPECT_LE(deviation.sigma_rad(), options.max_sigma_rad + 1e-5);
  }
}

TEST(BuildingDeviation, IsNotMovedByLinesThatFollowNoAxis) {
  BuildingDeviation deviation({});
  MadeBuilding building(0.002), grain(0.03);
  for (int i = 0; i < 30; ++i) {
    building.AddLines(8, &deviation);
    grain.AddLines(2, &deviation);
  }
  EXPECT_GT(deviation.sigma_rad(), 0.0015);
  EXPECT_LT(deviation.sigma_rad(), 0.004);
}

TEST(BuildingDeviation, AFewLinesAskAnExactBuildingWhetherItIs) {
  const BuildingDeviationOptions options;
  const double own = std::sqrt(1 - options.shared_share);
  BuildingDeviation deviation(options);
  MadeBuilding(0).AddLines(100, &deviation);
  int probes = 0;
  for (int64_t id = 0; id < 100; ++id) {
    const bool is_probe = deviation.OfNewLine(id) > 0;
    probes += is_probe;
    EXPECT_EQ(deviation.OfLine(id), is_probe ? own * deviation.sigma_rad() : options.min_sigma_rad);
  }
  EXPECT_EQ(probes, 25);
  MadeBuilding(0.005).AddLines(200, &deviation);
  for (int64_t id = 0; id < 100; ++id) {
    EXPECT_EQ(deviation.OfNewLine(id), own * deviation.sigma_rad());
    EXPECT_EQ(deviation.OfLine(id), own * deviation.sigma_rad());
  }
  BuildingDeviationOptions exact;
  exact.start_sigma_rad = 0;
  EXPECT_EQ(BuildingDeviation(exact).OfNewLine(0), 0);
}

// What lines share with their neighbours pulls them too, and is taken out as well.
TEST(BuildingDeviation, LearnsFromLinesThatShareWhatTheyAreOff) {
  constexpr double kTrue_rad = 0.004, kNoise_rad = 0.001;
  BuildingDeviation deviation({});
  std::mt19937 generator(7);
  std::normal_distribution<double> normal;
  for (int64_t id = 0; id < 400; ++id) {
    const double tie_rad = std::sqrt(0.5) * deviation.sigma_rad();
    // On (c, e), each of variance t^2 before, y = c + e with its noise is observed.
    const double t2 = tie_rad * tie_rad, gain = t2 / (2 * t2 + kNoise_rad * kNoise_rad);
    LineDeviation line;
    for (int k = 0; k < 2; ++k) {
      const double y_rad = kTrue_rad * normal(generator) + kNoise_rad * normal(generator);
      line.shared_rad[k] = gain * y_rad;
      line.off_rad[k] = 2 * gain * y_rad;
      line.shared_variance_rad2[k] = t2 - gain * t2;
      line.cross_covariance_rad2[k] = t2 - 2 * gain * t2;
      line.covariance_rad2(k, k) = 2 * t2 - 4 * gain * t2;
    }
    deviation.Add(id, line, tie_rad);
    deviation.Close({id});
    deviation.Solve();
  }
  EXPECT_NEAR(deviation.sigma_rad(), kTrue_rad, 0.1 * kTrue_rad);
}

TEST(BuildingDeviation, LearnsFromLinesThatAreStillInTheWindow) {
  BuildingDeviation deviation({});
  const double tie_rad = deviation.sigma_rad();
  LineDeviation line;
  line.covariance_rad2 = 1e-8 * Eigen::Matrix2d::Identity();
  for (const bool off : {false, true}) {
    line.off_rad.setConstant(off ? 0.004 : 0);
    for (int i = 0; i < 20; ++i) deviation.Add(i, line, tie_rad);
    deviation.Solve();
    EXPECT_EQ(deviation.sigma_rad() > 0.003, off) << "each line has replaced what it said before";
  }
  // Tied as tightly as this they say nothing new.
  line.off_rad.setZero();
  line.covariance_rad2 = 9.9e-9 * Eigen::Matrix2d::Identity();
  const double learned_rad = deviation.sigma_rad();
  for (int i = 0; i < 20; ++i) deviation.Add(i, line, 1e-4);
  deviation.Close({0, 1, 2, 3, 4, 5, 6, 7, 8, 9});
  deviation.Solve();
  EXPECT_EQ(deviation.sigma_rad(), learned_rad);
}

// Nobody knows of a building's handrails, however exact its walls are.
TEST(LineDeviations, SlopesHaveTheirOwn) {
  LineDeviations deviations{BuildingDeviationOptions{}};
  MadeBuilding(0).AddLines(300, &deviations.Of(LineAxis::kX));
  EXPECT_LT(deviations.Of(LineAxis::kVertical).sigma_rad(), 0.0005);
  MadeBuilding(0).AddLines(300, &deviations.Of(LineAxis::kSloped));
  EXPECT_NEAR(deviations.Of(LineAxis::kSloped).sigma_rad(),
              BuildingDeviationOptions().start_sigma_rad, 1e-6);
}

}  // namespace
}  // namespace slcmap
