#include "data/core/coordinate_system.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "data/core/error.h"
#include "data/core/math.h"
#include "data/core/tag_name.h"

namespace slcmap {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::ThrowsMessage;

// Munich's town hall square, by textbook formulas of the projection.
TEST(CoordinateSystem, KnowsPlaceScaleAndNorth) {
  const CoordinateSystem system("EPSG:25832");
  EXPECT_EQ(system.title(), "ETRS89 / UTM zone 32N");
  const auto place = system.At({691607, 5334760, 515});
  ASSERT_TRUE(place);
  EXPECT_NEAR(place->latitude_deg, 48.137, 0.001);
  EXPECT_NEAR(place->longitude_deg, 11.575, 0.001);
  const double east_m = 191607, radius_m = 6.38e6;
  const double projected = 0.9996 * (1 + east_m * east_m / (2 * radius_m * radius_m));
  EXPECT_NEAR(place->scale, projected * (1 - 515 / 6.371e6), 2e-6);
  // The grid's north is to the east of the true one there.
  const double convergence_rad =
      (place->longitude_deg - 9) * kDegree * std::sin(place->latitude_deg * kDegree);
  EXPECT_NEAR(place->true_north_rad, convergence_rad, 1e-4);
}

TEST(CoordinateSystem, IsNotForPlacesBeyondItsArea) {
  const CoordinateSystem system("EPSG:25832");
  EXPECT_FALSE(system.At({5334760, 691607, 0}));
  EXPECT_FALSE(system.At({1e7, 1e7, 0}));
}

TEST(CoordinateSystem, TakesHeightsAndOtherOrdersOfAxes) {
  EXPECT_TRUE(CoordinateSystem("EPSG:25832+7837").At({691607, 5334760, 515}));
  // Gauss-Krueger, which names northing first.
  const auto place = CoordinateSystem("EPSG:31468").At({4468503, 5333317, 515});
  ASSERT_TRUE(place);
  EXPECT_NEAR(place->longitude_deg, 11.576, 0.01);
  EXPECT_NEAR(place->scale, 1 - 515 / 6.371e6 + std::pow(31497 / 6.38e6, 2) / 2, 2e-6);
}

TEST(CoordinateSystem, IsNamedAsListsHaveIt) {
  EXPECT_EQ(CoordinateSystem("epsg:25832").name(), "EPSG:25832");
  EXPECT_EQ(NameOfSystem("EPSG:25832+ESRI:115700"), "EPSG:25832+ESRI:115700");
  EXPECT_EQ(NameOfSystem("none such"), "none such");
  const CoordinateSystem with_heights("EPSG:5555");
  EXPECT_EQ(with_heights.name(), "EPSG:25832+5783");
  EXPECT_EQ(with_heights.name(), CoordinateSystem("EPSG:25832+5783").name());
  EXPECT_THAT(with_heights.title_of_heights(), HasSubstr("height"));
  EXPECT_THAT(with_heights.Wkt(), HasSubstr("COMPD_CS"));
  EXPECT_THAT(with_heights.WktOfPlane(), Not(HasSubstr("COMPD_CS")));
}

TEST(CoordinateSystem, RefusesDegreesFeetAndWhatIsUnknown) {
  EXPECT_THAT([] { CoordinateSystem("EPSG:4326", Eigen::Vector2d(48.1, 11.6)); },
              ThrowsMessage<ConfigError>(AllOf(HasSubstr("WGS 84"), HasSubstr("degrees"),
                                               HasSubstr("at that place EPSG:25832"))));
  EXPECT_THAT([] { CoordinateSystem("EPSG:2263"); }, ThrowsMessage<ConfigError>(HasSubstr("foot")));
  EXPECT_THAT(
      [] { CoordinateSystem("EPSG:99999"); },
      ThrowsMessage<ConfigError>(HasSubstr("found 'EPSG:99999', which PROJ does not know")));
}

TEST(CoordinateSystem, FindsTheUtmZone) {
  EXPECT_EQ(UtmSystemAt(48.1, 11.6), "EPSG:25832");
  EXPECT_EQ(UtmSystemAt(40.7, -74), "EPSG:32618");
  EXPECT_EQ(UtmSystemAt(-33.9, 151.2), "EPSG:32756");
}

TEST(TagNames, SayFamilyAndNumber) {
  ASSERT_TRUE(ParseTagName("tag36h11:5"));
  EXPECT_EQ(ParseTagName("tag36h11:5")->dictionary, 20);
  EXPECT_EQ(ParseTagName("tag36h11:5")->id, 5);
  EXPECT_EQ(ParseTagName("aruco4x4_50:49")->dictionary, 0);
  EXPECT_EQ(ParseTagName("17")->dictionary, -1);
  for (const char* name : {"", "P1", "tag99:1", "tag36h11:", "tag36h11:x", "-5", "123456"}) {
    EXPECT_FALSE(ParseTagName(name)) << name;
  }
}

}  // namespace
}  // namespace slcmap
