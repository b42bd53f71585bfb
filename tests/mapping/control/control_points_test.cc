#include "mapping/control/control_points.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/aruco.hpp>
#include <opencv2/imgproc.hpp>

#include "data/core/error.h"
#include "data/core/tag_name.h"
#include "mapping/control/tag_finder.h"
#include "tests/testing/memory_source.h"
#include "tests/testing/pinhole_camera.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::ThrowsMessage;

class ControlPointsTest : public ::testing::Test {
 protected:
  std::vector<ControlPoint> Read(const std::string& text) const {
    return ReadControlPoints(temp_.Write("control.csv", text));
  }
  void ExpectRefused(const std::string& text, const std::string& words) const {
    EXPECT_THAT([&] { Read(text); }, ThrowsMessage<DataError>(HasSubstr(words))) << text;
  }

  testing::TempFolder temp_;
};

TEST_F(ControlPointsTest, HaveSigmasForAllAxesForEachOrNone) {
  const auto all = Read("name,x,y,z,sigma_m\nP1,1,2,3,0.004\ntag36h11:5,4,5,6,0.006\n");
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all[1].name, "tag36h11:5");
  EXPECT_EQ(all[1].p_m, Eigen::Vector3d(4, 5, 6));
  EXPECT_EQ(all[1].sigma_m, Eigen::Vector3d::Constant(0.006));
  const auto each = Read(
      "point;height;northing;easting;sigma_height_m;sigma_easting_m\n# a "
      "comment\nA;3;2;1;0.02;0.001\n");
  EXPECT_EQ(each.at(0).p_m, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(each.at(0).sigma_m, Eigen::Vector3d(0.001, 0.01, 0.02));
  EXPECT_EQ(Read("name e n h\nA 1 2 3\n").at(0).sigma_m, Eigen::Vector3d::Constant(0.01));
  const auto some = Read("name;e;n;h;sigma\nA;1,5;2;3;\nB;1;2;3;0,02\n");
  EXPECT_EQ(some.at(0).p_m.x(), 1.5);
  EXPECT_EQ(some.at(0).sigma_m.x(), 0.01);
  EXPECT_EQ(some.at(1).sigma_m.x(), 0.02);
}

TEST_F(ControlPointsTest, ThatCannotBeAreRefusedByRowAndColumn) {
  ExpectRefused("name,latitude,longitude,height\nA,48.1,11.6,500\n", "column of latitudes");
  ExpectRefused("name,x,y\nA,1,2\n", "expected one named height");
  ExpectRefused("name,x,y,z\n", "found no row");
  ExpectRefused("name,x,y,z\nA,1,2\n", "row 2: found 3 fields, expected 4: name,x,y,z");
  ExpectRefused("name,x,y,z\nA,1,nan,2\n", "row 2: y: found 'nan'");
  ExpectRefused("name,x,y,z\nA,1,2,3\nA,1,2,3\n",
                "row 3: name: found 'A', expected a name that no");
  ExpectRefused("name,x,y,z,sigma_m\nA,1,2,3,0\n", "row 2: sigma_m: found '0'");
}

TEST_F(ControlPointsTest, MarksKeepTheirStamps) {
  const auto marks = ReadMarks(temp_.Write(
      "marks.csv", "name,stamp_ns,camera,x_px,y_px\nP1,1403636579763555584,1,100.25,20\n"));
  ASSERT_EQ(marks.size(), 1u);
  EXPECT_EQ(marks[0].stamp_ns, 1403636579763555584);
  EXPECT_EQ(marks[0].camera, 1);
  EXPECT_EQ(marks[0].px, Eigen::Vector2d(100.25, 20));
  EXPECT_THAT(
      [&] {
        ReadMarks(temp_.Write("bad.csv", "name,stamp_ns,camera,x_px,y_px\nP1,1.5e9,2,1,2\n"));
      },
      ThrowsMessage<DataError>(HasSubstr("row 2: camera: found '2'")));
}

TEST_F(ControlPointsTest, DistancesAndAllNames) {
  const KnownDistance distance = ParseDistance("A,tag36h11:5,12.345");
  EXPECT_EQ(distance.from, "A");
  EXPECT_EQ(distance.metres, 12.345);
  EXPECT_EQ(ParseDistance("A,B,12,0.02").sigma_m, 0.02);
  for (const char* text : {"A,B", "A,B,3,0", "A,B,3,x", "A,B,3,4", "A,B,3,1,1", "A,B,0", "A,B,-1",
                           "A,A,3", "A,B,x", ""}) {
    EXPECT_THROW(ParseDistance(text), ConfigError) << text;
  }
  EXPECT_THAT(ListNames({.points = {{.name = "B"}}, .distances = {distance}}),
              ElementsAre("B", "A", "tag36h11:5"));
}

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

TEST(TagFinder, FindsTheMiddleOfTagsThatAreAskedForToAFractionOfAPixel) {
  const TagImage left("tag36h11:5"), right("tag36h11:5", -31.3);
  const auto source = Record({left}, right);
  const auto seen = FindTags(source, {1000000007}, 7, {"tag36h11:5", "tag36h11:6", "pillar"});
  ASSERT_EQ(seen.size(), 2u);
  EXPECT_EQ(seen[0].name, "tag36h11:5");
  EXPECT_EQ(seen[0].stamp_ns, 1000000007);
  EXPECT_EQ(seen[1].camera, 1);
  EXPECT_LT((seen[0].px - left.middle_px).norm(), 0.15);
  EXPECT_LT((seen[1].px - right.middle_px).norm(), 0.15);
  EXPECT_THAT(FindTags(source, {1000000000}, 0, {"tag36h11:6"}), IsEmpty());
  EXPECT_THAT(FindTags(source, {1000000000}, 0, {"pillar"}), IsEmpty());
  EXPECT_THAT(FindTags(source, {3000000000}, 0, {"tag36h11:5"}), IsEmpty());
  EXPECT_THROW(
      FindTags(source, {1000000000}, 0, {"tag36h11:5"}, Progress([](double) { return false; })),
      StoppedError);
}

TEST(TagFinder, TellsTheFamilyOfBareNumbers) {
  const TagImage tag("aruco5x5_100:17");
  const auto seen = FindTags(Record({tag, tag}, tag), {1000000000, 2000000000}, 0, {"17", "3"});
  ASSERT_EQ(seen.size(), 4u);
  EXPECT_EQ(seen[3].name, "17");
}

}  // namespace
}  // namespace slcmap
