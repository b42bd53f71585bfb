#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "data/core/error.h"
#include "data/io/json.h"
#include "mapping/map/part_files.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

std::vector<MapPipe> TwoPipes() {
  MapPipe pipe{0, 1, LineAxis::kVertical, -1, {1, 2, 0}, {1, 2, 2.5}, 0.0612, 0.0021, 0.00047, 40};
  MapPipe other{1, 0, LineAxis::kX, 2, {-1, 2, 2}, {4, 2, 2}, 0.1, 0.003, 0.001, 7};
  return {pipe, other};
}

class PipeFile : public ::testing::Test {
 protected:
  // What is said of the file once a text in it is another.
  void ExpectRefused(const std::string& before, const std::string& after,
                     const std::string& message) const {
    WritePipes(path_, TwoPipes());
    std::string text = ReadFile(path_);
    const size_t at = text.find(before);
    ASSERT_NE(at, std::string::npos) << before;
    WriteFile(path_, text.replace(at, before.size(), after));
    EXPECT_THAT([&] { ReadPipes(path_); }, ThrowsMessage<DataError>(HasSubstr(message)));
  }

  testing::TempFolder temp_;
  const std::string path_ = temp_.Path("pipes.json");
};

TEST_F(PipeFile, IsReadAsItWasWritten) {
  WritePipes(path_, TwoPipes());
  const std::string text = ReadFile(path_);
  const std::vector<MapPipe> read = ReadPipes(path_);
  WritePipes(path_, read);
  EXPECT_EQ(ReadFile(path_), text);
  ASSERT_EQ(read.size(), 2u);
  EXPECT_EQ(read[0].axis, LineAxis::kVertical);
  EXPECT_EQ(read[0].end_world, Eigen::Vector3d(1, 2, 2.5));
  EXPECT_EQ(read[0].radius_m, 0.0612);
  EXPECT_EQ(read[0].images, 40);
  WritePipes(path_, {});
  EXPECT_TRUE(ReadPipes(path_).empty());
}

TEST_F(PipeFile, WhatCannotBeIsNamed) {
  ExpectRefused("\"segment\": 0", "\"segment\": 4294967296",
                "segment: found 4294967296, expected 0 to");
  ExpectRefused("\"segment\": 0", "\"segment\": 0.7", "segment: found 0.7, expected 0 to");
  ExpectRefused("0.0612", "-0.0612", "pipe 0: radius_m: found -0.0612, expected 0.0001 to");
  ExpectRefused("0.0612", "1e999", "pipes.json: ");
  ExpectRefused("0.0612", "null", "radius_m: found null, expected 0.0001 to");
  ExpectRefused("\"vertical\"", "\"up\"", "pipe 0: axis: found 'up', expected one of: x, y");
  ExpectRefused("\"id\": 1", "\"id\": 0", "pipe 0: found it at place 1, expected ids to count");
  ExpectRefused("\"images\": 40", "\"images\": -1", "pipe 0: images: found -1, expected 0 to");
  ExpectRefused("\"radius_sigma_m\": 0.00047,", "", "radius_sigma_m: missing");
  ExpectRefused("2.5", "0", "pipe 0: found an end that is its start");
  ExpectRefused("2.5", "2e6", "pipe 0: found the point");
  WriteFile(path_, "{}");
  EXPECT_THAT([&] { ReadPipes(path_); }, ThrowsMessage<DataError>(HasSubstr("found no list")));
}

}  // namespace
}  // namespace slcmap
