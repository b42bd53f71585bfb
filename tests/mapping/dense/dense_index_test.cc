#include <gtest/gtest.h>

#include "mapping/map/point_index.h"

namespace slcmap {
namespace {

DensePoint At(double x_m, double y_m) {
  DensePoint point;
  point.p_world = {x_m, y_m, 1};
  return point;
}

TEST(DenseIndexTest, FindsWhatIsWithinTheRadiusTheNearestFirst) {
  const DenseIndex index({At(0.3, 0), At(5, 5), At(0.1, 0), At(0, -0.2)});
  std::vector<int> found{7};
  index.Find({0, 0, 1}, 0.25, &found);
  EXPECT_EQ(found, (std::vector<int>{2, 3}));
  index.Find({-3, 0, 1}, 0.25, &found);
  EXPECT_TRUE(found.empty());
}

TEST(DenseIndexTest, FindsNothingInAnEmptyCloud) {
  std::vector<int> found{7};
  DenseIndex({}).Find({0, 0, 1}, 10, &found);
  EXPECT_TRUE(found.empty());
}

}  // namespace
}  // namespace slcmap
