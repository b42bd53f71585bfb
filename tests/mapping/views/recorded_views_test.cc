#include "mapping/views/recorded_views.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "data/error.h"
#include "tests/testing/shared_data.h"

namespace slcmap {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

TEST(RecordedViews, OfARunWithoutImagesSayHowToMapItAllTheSame) {
  EXPECT_THAT([] { ViewsOfRun(OdometryRun(), ""); },
              ThrowsMessage<DataError>(HasSubstr("--sparse")));
}

class RealPairs : public ::testing::Test {
 protected:
  void SetUp() override {
    if (folder_.empty()) GTEST_SKIP() << "no euroc_v1_01_pairs";
  }
  const std::string folder_ = testing::SharedData("euroc_v1_01_pairs");
};

TEST_F(RealPairs, AreViewsAtTheirPoses) {
  const OdometryRun run = RunAtPoses(folder_, "", ReadTrajectory(folder_ + "/poses.tum"));
  EXPECT_EQ(run.states.size(), 100u);
  EXPECT_GT(run.keyframes.size(), 80u);
  const RecordedViews recorded = ViewsOfRun(run, "");
  ASSERT_EQ(recorded.views.size(), run.keyframes.size());
  const StereoImage pair = recorded.images->Read(3);
  EXPECT_EQ(pair.left.cols, recorded.images->rig().cameras[0].width_px);
  EXPECT_EQ(pair.right.size(), pair.left.size());
  EXPECT_EQ(recorded.images->unreadable(), 0);
}

TEST_F(RealPairs, AreFoundFromAFolderNamedByARelativePath) {
  const auto here = std::filesystem::current_path();
  const std::filesystem::path folder(folder_);
  std::filesystem::current_path(folder.parent_path());
  const OdometryRun run =
      RunAtPoses(folder.filename().string(), "", ReadTrajectory(folder_ + "/poses.tum"));
  std::filesystem::current_path(here);
  const RecordedViews recorded = ViewsOfRun(run, "");
  EXPECT_FALSE(recorded.images->Read(3).left.empty());
}

TEST_F(RealPairs, WithPosesOfAnotherTimeAreRefused) {
  Trajectory elsewhere = ReadTrajectory(folder_ + "/poses.tum");
  for (StampedPose& pose : elsewhere) pose.stamp_ns += int64_t{1000000000} * 3600;
  EXPECT_THAT([&] { RunAtPoses(folder_, "", elsewhere); },
              ThrowsMessage<DataError>(HasSubstr("expected poses at the images")));
}

TEST_F(RealPairs, WithPosesOfAPartAreThoseOfThePart) {
  Trajectory part = ReadTrajectory(folder_ + "/poses.tum");
  part.resize(part.size() / 2);
  const OdometryRun run = RunAtPoses(folder_, "", part);
  EXPECT_EQ(run.states.size(), part.size());
  EXPECT_EQ(run.warnings.at(kImageWithoutPose), 100 - static_cast<int64_t>(part.size()));
}

}  // namespace
}  // namespace slcmap
