#include "mapping/align/line_union.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace slcmap {
namespace {

using Eigen::Vector3d;
using ::testing::SizeIs;

constexpr double kAlignment_m = 0.009;

MapLine Piece(int64_t id, const Vector3d& start, const Vector3d& end,
              LineAxis axis = LineAxis::kVertical, int world = -1) {
  MapLine line;
  line.id = id;
  line.axis = axis;
  line.world = world;
  line.sigma_m = 0.003;
  line.start_world = start;
  line.end_world = end;
  line.observations = 10;
  line.kind = LineKind::kEdge;
  return line;
}

MapLine Upright(int64_t id, double x_m, double from_m = 0, double to_m = 2) {
  return Piece(id, {x_m, 0, from_m}, {x_m, 0, to_m});
}

LineCovariance Known(int64_t id, int piece, const Vector3d& variances_m2) {
  const Eigen::Matrix3d m = variances_m2.asDiagonal();
  return {id, piece, m, m, m};
}

LinesOfMap Unite(const LinesOfMap& first, const LinesOfMap& second) {
  return UniteLines(first, second, kAlignment_m);
}

TEST(UniteLines, WhatBothSawIsOneLineAsLongAsBoth) {
  const LinesOfMap united =
      Unite({{Upright(4, 1.0, 0, 1.5)}, {}}, {{Upright(9, 1.006, 0.5, 2)}, {}});
  ASSERT_THAT(united.lines, SizeIs(1));
  EXPECT_EQ(united.lines[0].id, 0);
  EXPECT_EQ(united.lines[0].observations, 20);
  EXPECT_NEAR((united.lines[0].end_world - united.lines[0].start_world).norm(), 2, 1e-9);
}

// Also where each is near the next one, or one of the other map lies between: what one map has kept
// apart stays so.
TEST(UniteLines, EdgesThatOneMapHasApartStayApart) {
  struct Row {
    std::vector<double> first_m, second_m;
    size_t lines;
    double sigma_m = 0.003;
  };
  for (const Row& row : std::vector<Row>{{{1, 1.06}, {1.004, 1.064}, 2},
                                         {{1, 1.04}, {1.02, 1.06}, 2},
                                         {{1, 1.015}, {1.007}, 2},
                                         {{1, 1.015}, {5}, 3, 0.01}}) {
    LinesOfMap first, second;
    for (const double x_m : row.first_m) {
      first.lines.push_back(Upright(std::ssize(first.lines), x_m));
      first.lines.back().sigma_m = row.sigma_m;
    }
    for (const double x_m : row.second_m) {
      second.lines.push_back(Upright(std::ssize(second.lines), x_m));
    }
    std::vector<double> united_m;
    for (const MapLine& line : Unite(first, second).lines) {
      united_m.push_back(line.start_world.x());
    }
    ASSERT_THAT(united_m, SizeIs(row.lines)) << row.first_m[1];
    EXPECT_NEAR(united_m[1] - united_m[0], row.first_m[1] - row.first_m[0], 0.02);
  }
}

TEST(UniteLines, AGapThatBothHaveStaysOne) {
  const auto level = [](int64_t id, double from_m, double to_m, double y_m) {
    return Piece(id, {from_m, y_m, 0}, {to_m, y_m, 0}, LineAxis::kX, 0);
  };
  const LinesOfMap united = Unite({{level(0, 0, 1, 0), level(0, 2, 3, 0)}, {}},
                                  {{level(5, 0.5, 1.01, 0.003), level(5, 1.99, 4, 0.003)}, {}});
  ASSERT_THAT(united.lines, SizeIs(2));
  EXPECT_EQ(united.lines[0].id, united.lines[1].id);
  EXPECT_NEAR(std::abs(united.lines[1].start_world.x() - united.lines[0].end_world.x()), 0.98,
              1e-9);
}

TEST(UniteLines, CovariancesAndSupportsGetTheNewIds) {
  LinesOfMap first{{Upright(3, 0.0), Upright(7, 1.0)}, {}};
  first.evidence.covariances = {Known(3, 0, {1e-6, 4e-6, 0}), Known(7, 0, {1e-6, 1e-6, 0})};
  first.evidence.supports = {{3, 0, 100, 0, {{1, 1}, {1, 50}}}, {7, 0, 100, 0, {{9, 1}, {9, 50}}}};
  LinesOfMap second{{Upright(2, 1.002)}, {}};
  second.evidence.covariances = {Known(2, 0, {9e-6, 9e-6, 0})};
  second.evidence.supports = {{2, 0, 200, 1, {{5, 1}, {5, 50}}}};
  const LinesOfMap united = Unite(first, second);
  ASSERT_THAT(united.lines, SizeIs(2));
  ASSERT_THAT(united.evidence.covariances, SizeIs(2));
  EXPECT_NEAR(united.evidence.covariances[0].start_m2(1, 1), 4e-6, 1e-9);
  EXPECT_NEAR(united.evidence.covariances[0].start_m2(0, 0), 1e-6, 1e-9);
  ASSERT_THAT(united.evidence.supports, SizeIs(3));
  EXPECT_EQ(united.evidence.supports[0].line_id, 0);
  EXPECT_EQ(united.evidence.supports[1].line_id, 1);
  EXPECT_EQ(united.evidence.supports[2].line_id, 1);
  EXPECT_EQ(united.evidence.supports[2].stamp_ns, 200);
}

TEST(UniteLines, ProbabilitiesAreMeansOverTheLength) {
  MapLine mark = Upright(0, 1.0, 0, 0.5), edge = Upright(0, 1.003, 0, 2);
  mark.SetProbability(0.1);
  edge.SetProbability(0.9);
  const LinesOfMap united = Unite({{mark}, {}}, {{edge}, {}});
  ASSERT_THAT(united.lines, SizeIs(1));
  EXPECT_EQ(united.lines[0].kind, LineKind::kEdge);
  EXPECT_GT(united.lines[0].edge_probability, 0.7);
  EXPECT_LT(united.lines[0].edge_probability, 0.9);
}

// A quarter turn makes X of the second run the Y of the first; a wing of it is a world of its own.
TEST(UniteLines, AxesOfTheSecondGetTheFirstOnesNames) {
  const MapLine x = Piece(0, {0, 0, 0}, {3, 0, 0}, LineAxis::kX, 0);
  const MapLine y = Piece(1, {0, 0, 0}, {0, 3, 0}, LineAxis::kY, 0);
  const MapLine turned = Piece(0, {5, 5, 0}, {5, 8, 0}, LineAxis::kX, 0);
  const MapLine wing = Piece(1, {5, 5, 0}, {7, 6, 0}, LineAxis::kX, 1);
  const LinesOfMap united = Unite({{x, y}, {}}, {{turned, wing}, {}});
  ASSERT_THAT(united.lines, SizeIs(4));
  EXPECT_EQ(united.lines[2].axis, LineAxis::kY);
  EXPECT_EQ(united.lines[2].world, 0);
  EXPECT_EQ(united.lines[3].axis, LineAxis::kX);
  EXPECT_EQ(united.lines[3].world, 1);
}

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
