#include "data/core/progress.h"

#include <gmock/gmock.h>

#include <vector>

namespace slcmap {
namespace {

using ::testing::DoubleEq;
using ::testing::ElementsAre;

TEST(ProgressTest, MadeOfNothingNeverEndsTheWork) {
  EXPECT_TRUE(Progress().Report(0.5));
  EXPECT_NO_THROW(Progress().ReportOrStop(0.5));
  EXPECT_TRUE(Progress().Part(0.2, 0.4).Report(1));
}

TEST(ProgressTest, PassesOnWhatTheCallerWants) {
  const Progress stopping([](double done) { return done < 0.5; });
  EXPECT_TRUE(stopping.Report(0.4));
  EXPECT_FALSE(stopping.Report(0.5));
  EXPECT_NO_THROW(stopping.ReportOrStop(0.4));
  EXPECT_THROW(stopping.ReportOrStop(0.5), StoppedError);
}

TEST(ProgressTest, PartCoversItsPartOfTheWhole) {
  std::vector<double> reported;
  const Progress whole([&](double done) {
    reported.push_back(done);
    return true;
  });
  const Progress part = whole.Part(0.2, 0.6);
  part.Report(0);
  part.Report(1);
  part.Part(0.5, 1).Report(0.5);  // a part of the part
  EXPECT_THAT(reported, ElementsAre(DoubleEq(0.2), DoubleEq(0.6), DoubleEq(0.5)));
}

}  // namespace
}  // namespace slcmap
