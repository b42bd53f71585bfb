#include "data/io/trajectory.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>

#include "data/core/error.h"
#include "data/io/pose_file.h"
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
  const std::string semicolons =
      "\xef\xbb\xbf"
      "1403636580838555648;4.6;-1.7;0.78;1;0;0;0\n";
  const Trajectory separated = ReadTrajectory(folder.Write("data.csv", semicolons));
  ASSERT_EQ(separated.size(), 1u);
  EXPECT_EQ(separated[0].stamp_ns, 1403636580838555648);
  EXPECT_EQ(separated[0].T_world_imu.rotation.w(), 1);
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
  // Stamps whose differences overflow.
  EXPECT_THAT(message("-9e18 0 0 0 0 0 0 1\n9e18 0 0 0 0 0 0 1\n"), HasSubstr("expected a stamp"));
  EXPECT_THAT(MessageOf<OutputError>([] {
                WriteTumTrajectory("/dev/full", {{1, {}}});
              }),
              HasSubstr("/dev/full: cannot be written"));
  EXPECT_THROW(WriteTumTrajectory("/nonexistent/t.tum", {{1, {}}}), OutputError);
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

constexpr char kRest[] = " 1 2 3 0.1 0.2 0.3 0.9273618";

Trajectory Read(const std::string& text, const PoseForm& form = {}, const Clock& clock = {},
                bool is_of_images = true) {
  const TempFolder folder;
  return CollectPoses(ReadPoseTable(folder.Write("poses.txt", text), form, clock, is_of_images),
                      form, RigidTransform());
}

std::string Message(const std::string& text, const PoseForm& form = {}, const Clock& clock = {},
                    bool is_of_images = true) {
  return MessageOf<DataError>([&] { Read(text, form, clock, is_of_images); });
}

TEST(PoseFile, StampsOfAnyUnitAreToldByTheirSize) {
  for (const auto& [first, second] : {std::pair{"1403636584.763555585", "1403636584.813555585"},
                                      {"1403636584763.555585", "1403636584813.555585"},
                                      {"1403636584763555.585", "1403636584813555.585"},
                                      {"1403636584763555585", "1403636584813555585"},
                                      {"1.403636584763555585e+18", "1.403636584813555585e+18"}}) {
    const Trajectory read = Read(std::string(first) + kRest + "\n" + second + kRest + "\n");
    ASSERT_EQ(read.size(), 2u) << first;
    EXPECT_EQ(read[0].stamp_ns, 1403636584763555585) << first;
    EXPECT_EQ(read[1].stamp_ns, 1403636584813555585) << first;
  }
}

TEST(PoseFile, SmallStampsAreToldByTheirSteps) {
  const auto step_ns = [](const std::string& a, const std::string& b) {
    const Trajectory read = Read(a + kRest + "\n" + b + kRest + "\n");
    return read[1].stamp_ns - read[0].stamp_ns;
  };
  EXPECT_EQ(step_ns("0.0", "0.05"), 50'000'000);
  EXPECT_EQ(step_ns("0", "50000000"), 50'000'000);
  EXPECT_EQ(step_ns("5000000000000", "5000050000000"), 50'000'000);
  EXPECT_EQ(step_ns("1403636580.0", "1403636610.0"), 30'000'000'000);  // sparse, with dates
}

TEST(PoseFile, TheClockTellsAUnitThatSizesDoNot) {
  const Clock clock = {100'000'000'000, 110'000'000'000};  // 100 to 110 s
  const Trajectory read =
      Read(std::string("101000") + kRest + "\n101005" + kRest + "\n", {}, clock);
  EXPECT_EQ(read[0].stamp_ns, 101'000'000'000);
  EXPECT_EQ(Read(std::string("7") + kRest + "\n", {.stamps = "ms"})[0].stamp_ns, 7'000'000);
}

TEST(PoseFile, AHeaderTellsTheColumns) {
  for (const char* header :
       {"timestamp,tx,ty,tz,qx,qy,qz,qw\n", "#timestamp,p_x,p_y,p_z,q_x,q_y,q_z,q_w\n"}) {
    const Trajectory read =
        Read(std::string(header) + "1403636584.5,1,2,3,0.1,0.2,0.3,0.9273618\n");
    EXPECT_NEAR(read[0].T_world_imu.rotation.w(), 0.9273618, 1e-6) << header;
    EXPECT_EQ(read[0].T_world_imu.translation, Eigen::Vector3d(1, 2, 3)) << header;
  }
  const Trajectory scalar_first =
      Read("time,qw,qx,qy,qz,x,y,z\n1403636584.5,0.9273618,0.1,0.2,0.3,1,2,3\n");
  EXPECT_NEAR(scalar_first[0].T_world_imu.rotation.w(), 0.9273618, 1e-6);
  EXPECT_EQ(scalar_first[0].T_world_imu.translation, Eigen::Vector3d(1, 2, 3));
  EXPECT_THAT(Message("some words\n"), HasSubstr("row 1: found 'some', expected a stamp, or the"));
}

TEST(PoseFile, RowsAreSortedAndRepeatedOnesDropped) {
  const std::string rest = std::string(kRest) + "\n";
  const Trajectory read = Read("3.0" + rest + "1.0" + rest + "2.0" + rest + "2.0" + rest);
  ASSERT_EQ(read.size(), 3u);
  EXPECT_EQ(read[0].stamp_ns, 1'000'000'000);
  EXPECT_EQ(read[2].stamp_ns, 3'000'000'000);
  EXPECT_THAT(Message("1.4e9" + rest + "1.4e9" + rest + "1.4e9" + rest), HasSubstr("lost digits"));
}

TEST(PoseFile, MatricesHaveTheStampsOfTheClockOrOfAFile) {
  const std::string row = "0 -1 0 4 1 0 0 5 0 0 1 6\n";
  const Trajectory read = Read(row + row, {}, {10, 20});
  ASSERT_EQ(read.size(), 2u);
  EXPECT_EQ(read[1].stamp_ns, 20);
  EXPECT_EQ(read[1].T_world_imu.translation, Eigen::Vector3d(4, 5, 6));
  EXPECT_NEAR(LogRotation(read[1].T_world_imu.rotation).z(), M_PI / 2, 1e-9);
  EXPECT_THAT(Message(row, {}, {10, 20}),
              AllOf(HasSubstr("1 rows of matrices"), HasSubstr("2 stamps"),
                    HasSubstr("--poses-stamps FILE")));
  const TempFolder folder;
  const std::string times = folder.Write("times.txt", "0.5\n0.6\n");
  EXPECT_EQ(Read(row + row, {.stamps = times})[0].stamp_ns, 500'000'000);
  // They may have their last row, and a stamp.
  const std::string whole = "0 -1 0 5 1 0 0 6 0 0 1 7 0 0 0 1\n";
  const Trajectory last = Read(whole + whole, {}, {7, 9});
  ASSERT_EQ(last.size(), 2u);
  EXPECT_EQ(last[1].stamp_ns, 9);
  EXPECT_EQ(last[1].T_world_imu.translation, Eigen::Vector3d(5, 6, 7));
  EXPECT_EQ(Read("1403636584.5 " + whole)[0].stamp_ns, 1403636584500000000);
}

TEST(PoseFile, RowsWithoutNumbersAreLeftOut) {
  const std::string rest = std::string(kRest) + "\n";
  const Trajectory read = Read("1.0" + rest + "1.1 nan nan nan nan nan nan nan\n" + "1.2" + rest);
  ASSERT_EQ(read.size(), 2u);
  EXPECT_EQ(read[1].stamp_ns, 1'200'000'000);
  EXPECT_THAT(Message("1.0 nan nan nan nan nan nan nan\n"), HasSubstr("found no pose"));
}

TEST(PoseFile, MatricesWithoutNumbersCountAsRows) {
  const std::string row = "0 -1 0 4 1 0 0 5 0 0 1 6\n",
                    lost = "nan nan nan nan nan nan nan nan nan nan nan nan\n";
  const TempFolder folder;
  const std::string times = folder.Write("times.txt", "0.5\n0.6\n0.7\n0.8\n");
  for (const std::string& text : {row + lost + row + row, lost + row + row + row}) {
    const Trajectory read = Read(text, {}, {10, 20, 30, 40});
    ASSERT_EQ(read.size(), 3u);
    EXPECT_EQ(read[0].stamp_ns, text.starts_with("nan") ? 20 : 10);
    EXPECT_EQ(read[1].stamp_ns, 30);
    EXPECT_EQ(Read(text, {.stamps = times})[2].stamp_ns, 800'000'000);
  }
  EXPECT_THAT(Message(row + lost, {}, {10, 20, 30}), HasSubstr("2 rows of matrices"));
  EXPECT_THAT(Message(lost + lost, {}, {10, 20}), HasSubstr("found no pose"));
}

TEST(PoseFile, ColmapsImagesHaveTheStampsOfTheirNames) {
  const Trajectory read = Read(
      "# Image list with two lines of data per image:\n"
      "1 0.9273618 0.1 0.2 0.3 1 2 3 1 left/1403636584763555585.png\n"
      "2362.39 248.498 58396 1784.7 268.254 59027\n"
      "2 0.9273618 0.1 0.2 0.3 1 2 4 1 left/1403636584813555585.png\n\n");
  ASSERT_EQ(read.size(), 2u);
  EXPECT_EQ(read[1].stamp_ns, 1403636584813555585);
  EXPECT_NEAR(read[1].T_world_imu.rotation.w(), 0.9273618, 1e-6);
  EXPECT_EQ(read[1].T_world_imu.translation, Eigen::Vector3d(1, 2, 4));
}

TEST(PoseFile, NumbersOfImagesAreNoTimes) {
  Clock clock;
  for (int i = 0; i < 100; ++i) clock.push_back(1'000'000'000'000 + 50'000'000LL * i);
  std::string rows;
  for (int i = 0; i < 90; ++i) rows += fmt::format("{}{}\n", i, kRest);
  EXPECT_EQ(Read(rows, {}, clock)[89].stamp_ns, clock[89]);
  EXPECT_EQ(Read(rows, {.stamps = "s"}, clock)[89].stamp_ns, 89'000'000'000);
  for (int i = 90; i < 101; ++i) rows += fmt::format("{}{}\n", i, kRest);
  EXPECT_THAT(Message(rows, {}, clock),
              AllOf(HasSubstr("stamps from 0 to 100 one by one"), HasSubstr("100 stamps"),
                    HasSubstr("give --poses-stamps FILE")));
  EXPECT_EQ(Read(rows.substr(rows.find('\n') + 1), {}, clock)[99].stamp_ns, clock[99]);
}

TEST(PoseFile, NumbersOfRowsOfATruthAreThoseOfAsManyOnly) {
  Clock truth;
  for (int i = 0; i < 1000; ++i) truth.push_back(1'000'000'000'000 + 5'000'000LL * i);
  std::string rows;
  for (int i = 0; i < 100; ++i) rows += fmt::format("{}{}\n", i, kRest);
  EXPECT_THAT(Message(rows, {}, truth, false),
              AllOf(HasSubstr("1000 stamps of the truth"), HasSubstr("--poses-stamps FILE")));
  EXPECT_EQ(Read(rows, {}, Clock(truth.begin(), truth.begin() + 100), false)[99].stamp_ns,
            truth[99]);
}

TEST(PoseFile, PosesOfAnotherStartMayLastLongerThanTheClock) {
  const Clock clock = {1'403'636'580'000'000'000, 1'403'636'588'000'000'000};
  for (const auto& [first, step_ns, shift] :
       {std::tuple{100.0, 5e6, 0}, {100.0, 50e6, 0}, {0.0, 5e6, 0}, {1e5, 5e6, 3}, {1e8, 5e6, 6}}) {
    std::string rows;
    for (int i = 0; i < 15000; ++i) {
      rows += fmt::format("{:.4f}{}\n", first + i * step_ns * 1e-9 * std::pow(10, shift), kRest);
    }
    for (const double offset_s : {0.0, 1403636480.0}) {
      const Trajectory read = Read(rows, {.offset_s = offset_s}, clock);
      EXPECT_EQ(read[1].stamp_ns - read[0].stamp_ns, std::llround(step_ns)) << first << offset_s;
    }
  }
}

TEST(PoseFile, AShortPieceInNanosecondsIsNotTakenForMicroseconds) {
  std::string rows;
  for (int i = 0; i < 1000; ++i) {
    rows += fmt::format("{},1,2,3,0.9273618,0.1,0.2,0.3\n", 10'000'000LL * i);
  }
  for (const Clock& clock : {Clock(), Clock{0, 1'000'000'000'000}}) {
    EXPECT_EQ(Read(rows, {}, clock)[1].stamp_ns, 10'000'000);
  }
}

TEST(PoseFile, AStampThatIsNoNumberIsRefused) {
  Clock clock;
  std::string rows;
  for (int i = 0; i < 40; ++i) {
    clock.push_back(50'000'000LL * i);
    rows += (i == 20 ? "nan" : fmt::format("{}", i)) + kRest + "\n";
  }
  EXPECT_THAT(Message(rows, {}, clock), HasSubstr("found 'nan', expected a stamp"));
}

TEST(PoseFile, StampsThatFitInTwoUnitsAreRefused) {
  const Clock clock = {1'403'636'580'000'000'000, 1'403'636'588'000'000'000};
  std::string rows;
  for (int i = 0; i < 250; ++i) rows += fmt::format("{}.5{}\n", i, kRest);
  EXPECT_THAT(Message(rows, {}, clock),
              AllOf(HasSubstr("may be"), HasSubstr("give --poses-stamps with")));
  EXPECT_EQ(Read(rows, {.stamps = "s"}, clock)[1].stamp_ns, 1'500'000'000);
}

TEST(PoseFile, StampsFromZeroDoNotLastLongerThanTheClock) {
  const Clock clock = {1'403'636'580'000'000'000, 1'403'636'590'000'000'000};
  std::string rows;
  for (int i = 0; i < 100; ++i) rows += fmt::format("{}{}\n", 100'000'000LL * i, kRest);
  EXPECT_EQ(Read(rows, {}, clock)[99].stamp_ns, 9'900'000'000);
}

TEST(PoseFile, TheFormIsAppliedToWhatIsRead) {
  const std::string text = "1.0 1 2 3 0.9273618 0.1 0.2 0.3\n";
  const Eigen::Quaterniond q = Eigen::Quaterniond(0.9273618, 0.1, 0.2, 0.3).normalized();
  EXPECT_TRUE(Read(text, {.quaternion = "wxyz"})[0].T_world_imu.rotation.isApprox(q, 1e-9));
  EXPECT_TRUE(Read(text, {.quaternion = "wxyz-conjugated"})[0].T_world_imu.rotation.isApprox(
      q.conjugate(), 1e-9));
  const Trajectory down = Read(text, {.up = "-z", .scale = 2, .offset_s = -0.5});
  EXPECT_NEAR(down[0].T_world_imu.translation.z(), -6, 1e-9);
  EXPECT_EQ(down[0].stamp_ns, 500'000'000);
  const RigidTransform T = Read(text, {.of = "world-in-imu", .quaternion = "wxyz"})[0].T_world_imu;
  EXPECT_LT((T.Inverse().translation - Eigen::Vector3d(1, 2, 3)).norm(), 1e-9);
  EXPECT_EQ(FormatOptions({.of = "camera", .up = "-y"}), "--poses-of camera --up=-y");
  EXPECT_EQ(FormatOptions({.offset_s = 1403636580.838}), "--poses-offset=1403636580.838");
  EXPECT_THROW(PoseForm({.up = "up"}).Check(), ConfigError);
  EXPECT_THROW(PoseForm({.of = "lidar"}).Check(), ConfigError);
}

TEST(PoseFile, PosesFarAwayAreMovedByWholeMetres) {
  Trajectory far = {{0, {Eigen::Quaterniond::Identity(), {451234.6, 5412345.2, 310.5}}}};
  const Eigen::Vector3d offset_m = MoveNearOrigin(&far);
  EXPECT_EQ(offset_m, offset_m.array().round().matrix());
  EXPECT_LT(far[0].T_world_imu.translation.norm(), 1);
  Trajectory near = {{0, {Eigen::Quaterniond::Identity(), {1000, -2000, 30}}}};
  EXPECT_TRUE(MoveNearOrigin(&near).isZero());
}

}  // namespace
}  // namespace slcmap
