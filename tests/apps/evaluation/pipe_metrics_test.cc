#include "apps/evaluation/pipe_metrics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "data/core/error.h"
#include "data/io/file.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

TruePipe TruePipeAt(int64_t id, double x_m, double radius_m, double seen_m) {
  return {id, {x_m, 0, 0}, {x_m, 0, 3}, radius_m, {{0.5, 0.5 + seen_m}}};
}

MapPipe PipeAt(double x_m, double radius_m) {
  MapPipe pipe;
  pipe.start_world = {x_m, 0, 2};
  pipe.end_world = {x_m, 0, 0.4};
  pipe.radius_m = radius_m;
  return pipe;
}

TEST(PipeMetrics, FoundAreThoseWithAxisAndRadius) {
  const std::vector<TruePipe> truth = {TruePipeAt(0, 0, 0.05, 2), TruePipeAt(1, 1, 0.1, 2),
                                       TruePipeAt(2, 2, 0.1, 1), TruePipeAt(3, 3, 0.1, 0.2)};
  // Found, with a wrong radius, too far off, one that was hardly seen, and one that is nowhere.
  const std::vector<MapPipe> pipes = {PipeAt(0.01, 0.052), PipeAt(1.02, 0.13), PipeAt(2.06, 0.1),
                                      PipeAt(3, 0.1), PipeAt(9, 0.1)};
  const PipeMetrics metrics = EvaluatePipes(truth, pipes);
  EXPECT_EQ(metrics.pipes, 3);
  EXPECT_EQ(metrics.found, 1);
  EXPECT_EQ(metrics.found_axes, 2);
  EXPECT_EQ(metrics.mapped, 5);
  EXPECT_EQ(metrics.false_pipes, 3);
  EXPECT_NEAR(metrics.radius_median_m, 0.002, 1e-9);
  EXPECT_NEAR(metrics.axis_median_m, 0.01, 1e-9);
  EXPECT_NEAR(metrics.found_m, 2, 1e-9);
  EXPECT_NEAR(metrics.seen_m, 5, 1e-9);
}

TEST(PipeMetrics, PipesThatAreTurnedOrElsewhereAlongTheAxisAreOthers) {
  MapPipe turned = PipeAt(0, 0.05);
  turned.start_world.x() = 0.2;
  turned.end_world.x() = -0.2;
  MapPipe beyond = PipeAt(0, 0.05);
  beyond.start_world.z() = 4;
  beyond.end_world.z() = 5;
  const PipeMetrics metrics = EvaluatePipes({TruePipeAt(0, 0, 0.05, 2)}, {turned, beyond});
  EXPECT_EQ(metrics.found, 0);
  EXPECT_EQ(metrics.false_pipes, 2);
}

TEST(PipeMetrics, OfNothingThereIsNothing) {
  const PipeMetrics metrics = EvaluatePipes({}, {});
  EXPECT_EQ(metrics.pipes, 0);
  EXPECT_TRUE(std::isnan(metrics.radius_95_m));
  EXPECT_THAT(PipeTable({"pipes.json", "pipes.csv"}, metrics), HasSubstr("0 of 0 (- %)"));
}

TEST(TruePipes, AreReadAsTheyWereWritten) {
  const testing::TempFolder temp;
  const std::string path = temp.Path("pipes.csv");
  TruePipe pipe = TruePipeAt(0, 1, 0.05, 2), unseen = TruePipeAt(4, 2, 0.1, 0);
  pipe.seen.push_back({2.7, 3});
  unseen.seen.clear();
  WriteTruePipes(path, {pipe, unseen});
  const std::vector<TruePipe> read = ReadTruePipes(path);
  ASSERT_EQ(read.size(), 2u);
  EXPECT_EQ(read[0].seen.size(), 2u);
  EXPECT_NEAR(read[0].SeenLength_m(), 2.3, 1e-9);
  EXPECT_EQ(read[1].id, 4);
  EXPECT_EQ(read[1].radius_m, 0.1);
  EXPECT_TRUE(read[1].seen.empty());
}

TEST(TruePipes, DamagedRowsAreNamed) {
  const testing::TempFolder temp;
  const std::string path = temp.Path("pipes.csv");
  const std::string header = "pipe,ax_m,ay_m,az_m,bx_m,by_m,bz_m,radius_m,seen_from_m,seen_to_m\n";
  const auto refused = [&](const std::string& row, const std::string& message) {
    WriteFile(path, header + row + "\n");
    EXPECT_THAT([&] { ReadTruePipes(path); }, ThrowsMessage<DataError>(HasSubstr(message)));
  };
  refused("0,0,0,0,0,0,1,-0.1,0,1", "radius_m: found '-0.1', expected 0 to");
  refused("0,0,0,0,0,0,1,0.1,1,0.5", "seen_to_m: found '0.5', expected at least seen_from_m");
  refused("0,0,0,0,0,0,nan,0.1,0,1", "bz_m: found 'nan'");
  refused("0,0,0", "found 3 columns");
}

}  // namespace
}  // namespace slcmap
