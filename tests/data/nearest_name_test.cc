#include <gtest/gtest.h>

#include "data/io/yaml.h"

namespace slcmap {
namespace {

const std::vector<std::string> kNames = {"points-mono", "points", "points-lines", "slc"};

TEST(NearestName, IsThatOfTheFewestEdits) {
  EXPECT_EQ(DidYouMean("slk", kNames), "; did you mean 'slc'?");
  EXPECT_EQ(DidYouMean("scl", kNames), "; did you mean 'slc'?");
  EXPECT_EQ(DidYouMean("Points", kNames), "; did you mean 'points'?");
  EXPECT_EQ(DidYouMean("point", kNames), "; did you mean 'points'?");
  EXPECT_EQ(DidYouMean("points_line", kNames), "; did you mean 'points-lines'?");
}

TEST(NearestName, IsNoneWhereNothingIsNear) {
  EXPECT_EQ(DidYouMean("orb", kNames), "");
  EXPECT_EQ(DidYouMean("", kNames), "");
  EXPECT_EQ(DidYouMean("slc", {}), "");
  EXPECT_EQ(DidYouMean(std::string(1000000, 's'), kNames), "");
}

}  // namespace
}  // namespace slcmap
