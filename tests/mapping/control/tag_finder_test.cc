#include "mapping/control/tag_finder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/aruco.hpp>
#include <opencv2/imgproc.hpp>

#include "data/core/tag_name.h"
#include "tests/testing/memory_source.h"
#include "tests/testing/pinhole_camera.h"

namespace slcmap {
namespace {

using ::testing::IsEmpty;

// An image with a tag that is seen from the side, and where its middle is.
struct TagImage {
  explicit TagImage(const std::string& name, double shift_px = 0) {
    constexpr int kFiner = 4, kSide = 400, kBorder = 60;
    const auto tag = ParseTagName(name);
    cv::Mat sheet, fine(kFiner * 480, kFiner * 640, CV_8U, cv::Scalar(120));
    cv::aruco::drawMarker(cv::aruco::getPredefinedDictionary(tag->dictionary), tag->id, kSide,
                          sheet);
    cv::copyMakeBorder(sheet, sheet, kBorder, kBorder, kBorder, kBorder, cv::BORDER_CONSTANT, 255);
    const float x = kFiner * static_cast<float>(200 + shift_px), y = kFiner * 150, w = kFiner * 60;
    const float side = static_cast<float>(sheet.cols);
    const cv::Mat to_image = cv::getPerspectiveTransform(
        std::vector<cv::Point2f>{{0, 0}, {side, 0}, {side, side}, {0, side}},
        std::vector<cv::Point2f>{{x, y}, {x + w, y + 0.2f * w}, {x + w, y + 0.9f * w}, {x, y + w}});
    cv::warpPerspective(sheet, fine, to_image, fine.size(), cv::INTER_LINEAR,
                        cv::BORDER_TRANSPARENT);
    cv::resize(fine, image, {640, 480}, 0, 0, cv::INTER_AREA);
    std::vector<cv::Point2f> middle = {{0.5f * side - 0.5f, 0.5f * side - 0.5f}};
    cv::perspectiveTransform(middle, middle, to_image);
    // Centres of pixels, of which four by four became one.
    middle_px = {(middle[0].x + 0.5) / kFiner - 0.5, (middle[0].y + 0.5) / kFiner - 0.5};
  }

  cv::Mat image;
  Eigen::Vector2d middle_px;
};

testing::MemorySource Record(const std::vector<TagImage>& lefts, const TagImage& right) {
  Rig rig;
  rig.cameras.assign(2, testing::PinholeCamera(640, 480, 500, 319.5, 239.5));
  std::vector<StereoImage> pairs;
  for (const TagImage& left : lefts) {
    pairs.push_back(
        {static_cast<int64_t>(1000000000 * (pairs.size() + 1)), left.image, right.image});
  }
  return {rig, pairs, {}};
}

TEST(TagFinder, FindsTheMiddleOfTagsToAFractionOfAPixel) {
  const TagImage left("tag36h11:5"), right("tag36h11:5", -31.3);
  const auto source = Record({left}, right);
  const auto seen = FindTags(source, {1000000007}, 7, {"tag36h11:5", "tag36h11:6", "pillar"});
  ASSERT_EQ(seen.size(), 2u);
  EXPECT_EQ(seen[0].name, "tag36h11:5");
  EXPECT_EQ(seen[0].stamp_ns, 1000000007);
  EXPECT_EQ(seen[1].camera, 1);
  EXPECT_LT((seen[0].px - left.middle_px).norm(), 0.15);
  EXPECT_LT((seen[1].px - right.middle_px).norm(), 0.15);
}

TEST(TagFinder, TellsTheFamilyOfBareNumbers) {
  const TagImage tag("aruco5x5_100:17");
  const auto seen = FindTags(Record({tag, tag}, tag), {1000000000, 2000000000}, 0, {"17", "3"});
  ASSERT_EQ(seen.size(), 4u);
  EXPECT_EQ(seen[3].name, "17");
}

TEST(TagFinder, FindsNothingThatIsNotAskedFor) {
  const TagImage tag("tag36h11:5");
  const auto source = Record({tag}, tag);
  EXPECT_THAT(FindTags(source, {1000000000}, 0, {"tag36h11:6"}), IsEmpty());
  EXPECT_THAT(FindTags(source, {1000000000}, 0, {"pillar"}), IsEmpty());
  EXPECT_THAT(FindTags(source, {3000000000}, 0, {"tag36h11:5"}), IsEmpty());
  EXPECT_THROW(
      FindTags(source, {1000000000}, 0, {"tag36h11:5"}, Progress([](double) { return false; })),
      StoppedError);
}

}  // namespace
}  // namespace slcmap
