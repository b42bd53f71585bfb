#include "mapping/control/control_points.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "data/core/error.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
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
  for (const char* text : {"A,B", "A,B,0", "A,B,-1", "A,A,3", "A,B,x", ""}) {
    EXPECT_THROW(ParseDistance(text), ConfigError) << text;
  }
  EXPECT_THAT(ListNames({.points = {{.name = "B"}}, .distances = {distance}}),
              ElementsAre("B", "A", "tag36h11:5"));
}

}  // namespace
}  // namespace slcmap
