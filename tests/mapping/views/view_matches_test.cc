#include "mapping/views/view_matches.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "mapping/lines/options.h"
#include "tests/testing/room_views.h"

namespace slcmap {
namespace {

using Eigen::Vector2f;

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
  EXPECT_FALSE(MeasurePoseAgreement({views.front()}, room_)) << "a single view";
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

TEST(LineOptionsForPoses, GrowOnlyWhereImagesAndPosesDisagree) {
  const MapLineOptions options;
  EXPECT_EQ(options.ForPoses(0.1).max_spread_px, options.max_spread_px);
  EXPECT_DOUBLE_EQ(options.ForPoses(0.45).max_spread_px, 3 * options.max_spread_px);
  EXPECT_DOUBLE_EQ(options.ForPoses(0.45).fit.sigma_px, 3 * options.fit.sigma_px);
  EXPECT_DOUBLE_EQ(options.ForPoses(50).max_spread_px, 5 * options.max_spread_px);
}

// Smooth noise, the same at each call.
cv::Mat Texture() {
  cv::Mat noise(200, 300, CV_8UC1), smooth;
  cv::RNG generator(1);
  generator.fill(noise, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(noise, smooth, {0, 0}, 2);
  cv::normalize(smooth, smooth, 0, 255, cv::NORM_MINMAX);
  return smooth;
}

cv::Mat Moved(const cv::Mat& image, const Eigen::Matrix2f& affine, const Vector2f& shift) {
  const cv::Matx23f map(affine(0, 0), affine(0, 1), shift.x(), affine(1, 0), affine(1, 1),
                        shift.y());
  cv::Mat out;
  cv::warpAffine(image, out, map, image.size());
  return out;
}

TEST(PatchSearch, FindsAPlaceBelowThePixel) {
  const cv::Mat from = Texture();
  Eigen::Matrix2f affine;
  affine << 1.1f, -0.05f, 0.05f, 1.1f;
  const Vector2f shift(3.3f, -6.6f), at(150, 100), truth = affine * at + shift;
  const cv::Mat to = Moved(from, affine, shift);
  const PatchWarp expected{truth + Vector2f(7, -5), affine};
  const auto places = SearchPatch(from, at, to, expected, 12);
  ASSERT_FALSE(places.empty());
  EXPECT_LT((places[0] - truth).norm(), 0.1f);
  EXPECT_TRUE(SearchPatch(from, at, to, {truth + Vector2f(30, 0), affine}, 12).empty());
}

TEST(PatchSearch, ARepeatedPatternHasSeveralPlaces) {
  cv::Mat from(200, 300, CV_8UC1, cv::Scalar(40));
  for (int x = 0; x < 300; x += 20) {
    for (int y = 0; y < 200; y += 20) {
      cv::rectangle(from, {x, y, 10, 10}, cv::Scalar(200), cv::FILLED);
    }
  }
  cv::GaussianBlur(from, from, {0, 0}, 1);
  const auto places =
      SearchPatch(from, {140, 100}, from, {{140, 100}, Eigen::Matrix2f::Identity()}, 25);
  EXPECT_EQ(places.size(), 3u);
}

TEST(PatchSearch, NothingIsFoundWithoutTextureOrBeyondTheBorder) {
  const cv::Mat texture = Texture(), grey(200, 300, CV_8UC1, cv::Scalar(90));
  const Eigen::Matrix2f same = Eigen::Matrix2f::Identity();
  EXPECT_TRUE(SearchPatch(grey, {150, 100}, texture, {{150, 100}, same}, 10).empty());
  EXPECT_TRUE(SearchPatch(texture, {2, 100}, texture, {{150, 100}, same}, 10).empty());
  EXPECT_TRUE(SearchPatch(texture, {150, 100}, texture, {{295, 100}, same}, 10).empty());
}

}  // namespace
}  // namespace slcmap
