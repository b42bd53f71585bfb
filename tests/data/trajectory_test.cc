#include "data/io/trajectory.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "data/core/error.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::MessageOf;
using testing::TempFolder;

TEST(Trajectory, TumRowsSurviveWritingAndReading) {
  const TempFolder folder;
  Trajectory written;
  for (int i = 0; i < 20; ++i) {
    written.push_back({1403636584763555585 + i * 50000001LL,
                       {ExpRotation({0.4 * i, -0.1 * i, 0.3}), {1.5 * i, -1.0 * i, 0.25}}});
  }
  WriteTumTrajectory(folder.Path("t.tum"), written);
  const Trajectory read = ReadTrajectory(folder.Path("t.tum"));
  ASSERT_EQ(read.size(), written.size());
  for (size_t i = 0; i < read.size(); ++i) {
    EXPECT_EQ(read[i].stamp_ns, written[i].stamp_ns);
    const RigidTransform d = read[i].T_world_imu.Inverse() * written[i].T_world_imu;
    EXPECT_LT(d.translation.norm(), 1e-8);
    EXPECT_LT(LogRotation(d.rotation).norm(), 1e-8);
  }
}

TEST(Trajectory, ReadsEurocRowsWithMoreColumnsAndCarriageReturns) {
  const TempFolder folder;
  const std::string path = folder.Write(
      "data.csv",
      "#timestamp, p_x, p_y, p_z, q_w, q_x, q_y, q_z, v_x\r\n"
      "1403636580838555648,4.6,-1.7,0.78,0.534108,-0.153029,-0.827383,-0.082152,1\r\n"
      "1403636580843555648,4.7,-1.7,0.78,0.534108,-0.153029,-0.827383,-0.082152,1\r\n");
  const Trajectory read = ReadTrajectory(path);
  ASSERT_EQ(read.size(), 2u);
  EXPECT_EQ(read[0].stamp_ns, 1403636580838555648);
  EXPECT_NEAR(read[0].T_world_imu.rotation.w(), 0.534108, 1e-6);
  EXPECT_NEAR(read[0].T_world_imu.rotation.z(), -0.082152, 1e-6);
  EXPECT_DOUBLE_EQ(read[1].T_world_imu.translation.x(), 4.7);
}

TEST(Trajectory, ErrorsNameFileAndRow) {
  const TempFolder folder;
  const auto message = [&](const std::string& text) {
    const std::string path = folder.Write("bad.tum", text);
    return MessageOf<DataError>([&] { ReadTumTrajectory(path); });
  };
  const std::string good = "1.0 0 0 0 0 0 0 1\n";
  EXPECT_THAT(message(good + "2.0 0 0 nan 0 0 0 1\n"),
              AllOf(HasSubstr("bad.tum: row 2"), HasSubstr("'nan'")));
  EXPECT_THAT(message(good + "2.0 0 0\n"), HasSubstr("row 2: found 3 columns, expected 8"));
  EXPECT_THAT(message(good + "x 0 0 0 0 0 0 1\n"), HasSubstr("row 2: found 'x', expected a stamp"));
  EXPECT_THAT(message(good + good), HasSubstr("row 2: found stamp"));
  EXPECT_THAT(message(good + "2.0 0 0 0 0 0 0 0\n"), HasSubstr("quaternion of norm 0"));
  EXPECT_THAT(message("# nothing\n"), HasSubstr("found no pose"));
}

TEST(Trajectory, AFullDiskIsAnError) {
  const Trajectory trajectory = {{1, {}}};
  EXPECT_THAT(MessageOf<OutputError>([&] { WriteTumTrajectory("/dev/full", trajectory); }),
              HasSubstr("/dev/full: cannot be written"));
  EXPECT_THROW(WriteTumTrajectory("/nonexistent/t.tum", trajectory), OutputError);
}

TEST(PoseAt, InterpolatesInsideAndNotOverGaps) {
  const Trajectory trajectory = {{0, {}},
                                 {100000000, {ExpRotation({0, 0, 0.2}), {1, 0, 0}}},
                                 {900000000, {ExpRotation({0, 0, 0.2}), {2, 0, 0}}}};
  const auto middle = PoseAt(trajectory, 25000000);
  ASSERT_TRUE(middle.has_value());
  EXPECT_NEAR(middle->translation.x(), 0.25, 1e-12);
  EXPECT_NEAR(LogRotation(middle->rotation).z(), 0.05, 1e-12);
  EXPECT_TRUE(PoseAt(trajectory, 0).has_value());
  EXPECT_TRUE(PoseAt(trajectory, 900000000).has_value());
  EXPECT_FALSE(PoseAt(trajectory, 500000000).has_value());
  EXPECT_TRUE(PoseAt(trajectory, 500000000, 1.0).has_value());
  EXPECT_FALSE(PoseAt(trajectory, -1).has_value());
  EXPECT_FALSE(PoseAt(trajectory, 900000001).has_value());
  EXPECT_FALSE(PoseAt({}, 0).has_value());
}

TEST(Trajectory, WholeStampsBetweenBlanksAreTumRowsToo) {
  const TempFolder folder;
  const std::string rest = " 1 2 3 0.1 0.2 0.3 0.9273618\n";
  for (const auto& [stamp, expected_ns] : {std::pair{"1403636584763555585", 1403636584763555585},
                                           {"1403636584", 1403636584000000000},
                                           {"0", 0}}) {
    const Trajectory read = ReadTrajectory(folder.Write("t.tum", stamp + rest));
    ASSERT_EQ(read.size(), 1u);
    EXPECT_EQ(read[0].stamp_ns, expected_ns);
    EXPECT_NEAR(read[0].T_world_imu.rotation.x(), 0.1, 1e-6) << stamp;
    EXPECT_NEAR(read[0].T_world_imu.rotation.w(), 0.9273618, 1e-6) << stamp;
  }
}

TEST(Trajectory, SemicolonsSeparateToo) {
  const TempFolder folder;
  const Trajectory read =
      ReadTrajectory(folder.Write("data.csv",
                                  "\xef\xbb\xbf"
                                  "1403636580838555648;4.6;-1.7;0.78;1;0;0;0\n"));
  ASSERT_EQ(read.size(), 1u);
  EXPECT_EQ(read[0].stamp_ns, 1403636580838555648);
  EXPECT_EQ(read[0].T_world_imu.rotation.w(), 1);
}

TEST(Trajectory, StampsWhoseDifferencesOverflowAreRefused) {
  const TempFolder folder;
  EXPECT_THAT(MessageOf<DataError>([&] {
                ReadTrajectory(folder.Write("t.tum", "-9e18 0 0 0 0 0 0 1\n9e18 0 0 0 0 0 0 1\n"));
              }),
              HasSubstr("expected a stamp"));
}

}  // namespace
}  // namespace slcmap
