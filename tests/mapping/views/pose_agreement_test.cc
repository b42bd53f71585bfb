#include <gtest/gtest.h>

#include "mapping/lines/options.h"
#include "mapping/views/view_matches.h"
#include "tests/testing/room_views.h"

namespace slcmap {
namespace {

class PoseAgreementTest : public ::testing::Test {
 protected:
  // The views with every second one turned about an axis of the body.
  Views Turned(double angle_rad) const {
    Views views = room_.views();
    for (size_t i = 0; i < views.size(); i += 2) {
      RigidTransform& pose = views[i].T_world_imu;
      pose.rotation = pose.rotation * ExpRotation({0, angle_rad, 0.5 * angle_rad});
    }
    return views;
  }

  RoomViews room_{4, 0.25, 3};
};

TEST_F(PoseAgreementTest, TruePosesAgree) {
  const auto agreement = MeasurePoseAgreement(room_.views(), room_);
  ASSERT_TRUE(agreement);
  EXPECT_GE(agreement->pairs, 5);
  ASSERT_TRUE(agreement->across_px);
  EXPECT_LT(*agreement->across_px, 0.3);
  EXPECT_GT(agreement->found, 0.4);
}

TEST_F(PoseAgreementTest, ATurnIsSeenAsThePixelsThatItMoves) {
  const double focal_px = room_.rig().cameras[0].fx_px;
  const auto agreement = MeasurePoseAgreement(Turned(2 / focal_px), room_);
  ASSERT_TRUE(agreement);
  ASSERT_TRUE(agreement->across_px);
  EXPECT_GT(*agreement->across_px, 0.6);
  EXPECT_LT(*agreement->across_px, 5);
}

TEST_F(PoseAgreementTest, PosesOfAnotherRecordingFindLittle) {
  Views views = room_.views();
  const Views as_given = views;
  for (size_t i = 0; i < views.size(); ++i) {
    views[i].T_world_imu = as_given[(5 * i + 7) % views.size()].T_world_imu;
  }
  const auto agreement = MeasurePoseAgreement(views, room_);
  ASSERT_TRUE(agreement);
  EXPECT_LT(agreement->found, 0.2);
}

TEST_F(PoseAgreementTest, NothingIsSaidOfPosesThatAreAllFarApart) {
  Views views = room_.views();
  for (size_t i = 0; i < views.size(); ++i) {
    views[i].T_world_imu.translation += Eigen::Vector3d(100.0 * static_cast<double>(i), 0, 0);
  }
  EXPECT_FALSE(MeasurePoseAgreement(views, room_));
}

// The room where its plaster is blank: what is left of its images is noise.
class NoisyRoom : public ViewImages {
 public:
  explicit NoisyRoom(const RoomViews& room) : room_(room) {}

  const Rig& rig() const override { return room_.rig(); }
  const cv::Mat& mask(int camera) const override { return room_.mask(camera); }
  StereoImage Read(size_t view) const override {
    StereoImage pair = room_.Read(view);
    cv::RNG random(view + 1);
    for (cv::Mat* image : {&pair.left, &pair.right}) {
      random.fill(*image, cv::RNG::NORMAL, 128, 6);
    }
    return pair;
  }

 private:
  const RoomViews& room_;
};

TEST_F(PoseAgreementTest, NoiseSaysNothingAgainstPoses) {
  const auto agreement = MeasurePoseAgreement(room_.views(), NoisyRoom(room_));
  ASSERT_TRUE(agreement);
  EXPECT_FALSE(agreement->across_px);
  EXPECT_GT(agreement->found, 0.2);
}

TEST_F(PoseAgreementTest, NothingIsSaidOfASingleView) {
  EXPECT_FALSE(MeasurePoseAgreement({room_.views().front()}, room_));
}

TEST(LineOptionsForPoses, GrowOnlyWhereImagesAndPosesDisagree) {
  const MapLineOptions options;
  EXPECT_EQ(options.ForPoses(0.1).max_spread_px, options.max_spread_px);
  EXPECT_DOUBLE_EQ(options.ForPoses(0.45).max_spread_px, 3 * options.max_spread_px);
  EXPECT_DOUBLE_EQ(options.ForPoses(0.45).fit.sigma_px, 3 * options.fit.sigma_px);
  EXPECT_DOUBLE_EQ(options.ForPoses(50).max_spread_px, 5 * options.max_spread_px);
}

}  // namespace
}  // namespace slcmap
