#include <gtest/gtest.h>

#include "mapping/align/line_union.h"

namespace slcmap {
namespace {

// Upright at (x, 0) between two heights.
MapPipe UprightPipe(double x, double low_m, double high_m, double radius_m, double sigma_m) {
  MapPipe pipe;
  pipe.id = 7;
  pipe.axis = LineAxis::kVertical;
  pipe.start_world = {x, 0, low_m};
  pipe.end_world = {x, 0, high_m};
  pipe.radius_m = radius_m;
  pipe.sigma_m = sigma_m;
  pipe.images = 10;
  return pipe;
}

MapLine UprightLine() {
  MapLine line;
  line.axis = LineAxis::kVertical;
  line.world = 4;
  line.start_world = {3, 3, 0};
  line.end_world = {3, 3, 2};
  return line;
}

TEST(UnitePipes, MakeOneOfWhatBothSaw) {
  const auto united = UnitePipes({UprightPipe(1, 0, 1.5, 0.05, 0.004)},
                                 {UprightPipe(1.01, 1, 2.5, 0.052, 0.002)}, {UprightLine()});
  ASSERT_EQ(united.size(), 1);
  EXPECT_EQ(united[0].id, 0);
  EXPECT_EQ(united[0].images, 20);
  EXPECT_EQ(united[0].radius_m, 0.052);  // the better known
  EXPECT_NEAR(united[0].start_world.x(), 1.01, 1e-12);
  EXPECT_NEAR(united[0].start_world.z(), 0, 1e-12);
  EXPECT_NEAR(united[0].end_world.z(), 2.5, 1e-12);
}

TEST(UnitePipes, MakeOneOfPiecesThatAnotherPieceBridges) {
  const auto united =
      UnitePipes({UprightPipe(1, 0, 1, 0.05, 0.004), UprightPipe(1, 2, 3, 0.05, 0.004)},
                 {UprightPipe(1, 0.5, 2.5, 0.05, 0.002)}, {UprightLine()});
  ASSERT_EQ(united.size(), 1);
  EXPECT_NEAR((united[0].end_world - united[0].start_world).norm(), 3, 1e-12);
}

TEST(UnitePipes, NameTheAxisOfTheSecondsByTheUnitedLines) {
  const auto united = UnitePipes({}, {UprightPipe(1, 0, 1, 0.05, 0.004)}, {UprightLine()});
  ASSERT_EQ(united.size(), 1);
  EXPECT_EQ(united[0].axis, LineAxis::kVertical);
  EXPECT_EQ(united[0].world, 4);
}

TEST(UnitePipes, KeepNeighboursOtherRadiiAndPipesBehindEachOther) {
  const std::vector<MapPipe> first = {UprightPipe(1, 0, 1, 0.05, 0.004)};
  for (const MapPipe& other :
       {UprightPipe(1.05, 0, 1, 0.05, 0.004), UprightPipe(1, 0, 1, 0.08, 0.004),
        UprightPipe(1, 2, 3, 0.05, 0.004)}) {
    const auto united = UnitePipes(first, {other}, {});
    ASSERT_EQ(united.size(), 2);
    EXPECT_EQ(united[1].id, 1);
    EXPECT_EQ(united[1].axis, LineAxis::kNone);  // no line of the united map is along it
  }
}

}  // namespace
}  // namespace slcmap
