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
}

TEST(Trajectory, ErrorsNameFileAndRow) {
  const TempFolder folder;
  const auto message = [&](const std::string& text) {
    const std::string path = folder.Write("bad.tum", text);
    return MessageOf<DataError>([&] { ReadTrajectory(path); });
  };
  const std::string good = "1.0 0 0 0 0 0 0 1\n";
  EXPECT_THAT(message(good + "2.0 0 0 inf 0 0 0 1\n"),
              AllOf(HasSubstr("bad.tum: row 2"), HasSubstr("'inf'")));
  EXPECT_THAT(message(good + "2.0 0 0\n"), HasSubstr("row 2: found 3 columns, expected 8"));
  EXPECT_THAT(message(good + "x 0 0 0 0 0 0 1\n"), HasSubstr("row 2: found 'x', expected a stamp"));
  EXPECT_THAT(message(good + good), HasSubstr("found 1 stamps of 2 that are those of another"));
  EXPECT_THAT(message(good + "2.0 0 0 0 0 0 0 0\n"), HasSubstr("quaternion of norm 0"));
  EXPECT_THAT(message("1,0;0,5;0,1;1,0;0,1;0,1;0,1;0,9\n"), HasSubstr("decimal point"));
  EXPECT_THAT(message("# nothing\n"), HasSubstr("found no pose"));
  // Stamps whose differences overflow.
  EXPECT_THAT(message("-9e18 0 0 0 0 0 0 1\n9e18 0 0 0 0 0 0 1\n"), HasSubstr("expected a stamp"));
  EXPECT_THROW(WriteTumTrajectory("/dev/full", {{1, {}}}), OutputError);
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
                                           {"1403636584", 1403636584000000000}}) {
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

// A row for each number, of what `stamp` makes of it.
template <typename Stamp>
std::string Rows(int first, int end, const Stamp& stamp) {
  std::string rows;
  for (int i = first; i < end; ++i) rows += fmt::format("{}{}\n", stamp(i), kRest);
  return rows;
}
int Itself(int i) { return i; }

// As many stamps from 1000 s on.
Clock ClockOf(int count, int64_t step_ns) {
  Clock clock;
  for (int i = 0; i < count; ++i) clock.push_back(1'000'000'000'000 + step_ns * i);
  return clock;
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

// Rows, what is known of their time, and the stamp of one of them.
TEST(PoseFile, OtherStampsAreToldByTheirStepsAndTheClock) {
  const Clock images = ClockOf(100, 50'000'000), truth = ClockOf(100, 5'000'000);
  const auto steps_of = [](auto step) { return [=](int i) { return step * i; }; };
  std::string short_piece;
  for (int i = 0; i < 1000; ++i) {
    short_piece += fmt::format("{},1,2,3,0.9273618,0.1,0.2,0.3\n", 10'000'000LL * i);
  }
  const struct {
    const char* what;
    std::string rows;
    Clock clock;
    size_t row;
    int64_t stamp_ns;
    std::string stamps = "";
    bool is_of_images = true;
  } kCases[] = {
      {"seconds by their steps", Rows(0, 2, steps_of(0.05)), {}, 1, 50'000'000},
      {"nanoseconds by theirs", Rows(0, 2, steps_of(50'000'000)), {}, 1, 50'000'000},
      {"since a start",
       Rows(0, 2, [](int i) { return 5'000'000'000'000 + 50'000'000 * i; }),
       {},
       1,
       5'000'050'000'000},
      {"sparse, with dates",
       Rows(0, 2, [](int i) { return 1403636580.0 + 30 * i; }),
       {},
       1,
       1'403'636'610'000'000'000},
      {"by the clock, from 100 to 110 s",
       Rows(0, 2, [](int i) { return 101000 + 5 * i; }),
       {100'000'000'000, 110'000'000'000},
       0,
       101'000'000'000},
      {"as one says", Rows(7, 8, Itself), {}, 0, 7'000'000, "ms"},
      {"numbers of images", Rows(0, 90, Itself), images, 89, images[89]},
      {"from one on", Rows(1, 101, Itself), images, 99, images[99]},
      {"seconds, as one says", Rows(0, 90, Itself), images, 89, 89'000'000'000, "s"},
      {"numbers of rows of a truth", Rows(0, 100, Itself), truth, 99, truth[99], "", false},
      {"a short piece in nanoseconds", short_piece, {}, 1, 10'000'000},
      {"that fits the clock in microseconds", short_piece, {0, 1'000'000'000'000}, 1, 10'000'000},
      {"from zero, not longer than the clock",
       Rows(0, 100, steps_of(100'000'000LL)),
       {1'403'636'580'000'000'000, 1'403'636'590'000'000'000},
       99,
       9'900'000'000}};
  for (const auto& made : kCases) {
    const Trajectory read = Read(made.rows, {.stamps = made.stamps}, made.clock, made.is_of_images);
    ASSERT_GT(read.size(), made.row) << made.what;
    EXPECT_EQ(read[made.row].stamp_ns, made.stamp_ns) << made.what;
  }
}

TEST(PoseFile, StampsThatTellNoTimeAreRefusedWithTheOption) {
  const auto refuse = [](const std::string& rows, const Clock& clock, const std::string& what,
                         const std::string& remedy = "", bool is_of_images = true) {
    EXPECT_THAT(Message(rows, {}, clock, is_of_images), AllOf(HasSubstr(what), HasSubstr(remedy)));
  };
  refuse("some words\n", {}, "row 1: found 'some', expected a stamp, or the");
  refuse(Rows(0, 3, [](int) { return "1.4e9"; }), {}, "lost digits");
  refuse(Rows(0, 101, Itself), ClockOf(100, 50'000'000), "stamps from 0 to 100 one by one",
         "give --poses-stamps FILE");
  refuse(Rows(0, 100, Itself), ClockOf(1000, 5'000'000), "1000 stamps of the truth",
         "--poses-stamps FILE", false);
  refuse(Rows(0, 40, [](int i) { return i == 20 ? "nan" : std::to_string(i); }),
         ClockOf(40, 50'000'000), "found 'nan', expected a stamp");
  refuse(Rows(0, 250, [](int i) { return i + 0.5; }),
         {1'403'636'580'000'000'000, 1'403'636'588'000'000'000}, "may be",
         "give --poses-stamps with");
}

TEST(PoseFile, AHeaderTellsTheColumns) {
  for (const char* table :
       {"timestamp,tx,ty,tz,qx,qy,qz,qw\n1403636584.5,1,2,3,0.1,0.2,0.3,0.9273618\n",
        "#timestamp,p_x,p_y,p_z,q_x,q_y,q_z,q_w\n1403636584.5,1,2,3,0.1,0.2,0.3,0.9273618\n",
        "time,qw,qx,qy,qz,x,y,z\n1403636584.5,0.9273618,0.1,0.2,0.3,1,2,3\n"}) {
    const RigidTransform read = Read(table)[0].T_world_imu;
    EXPECT_NEAR(read.rotation.w(), 0.9273618, 1e-6) << table;
    EXPECT_EQ(read.translation, Eigen::Vector3d(1, 2, 3)) << table;
  }
}

TEST(PoseFile, RowsAreSortedAndRepeatedOnesDropped) {
  const std::string rest = std::string(kRest) + "\n";
  const Trajectory read = Read("3.0" + rest + "1.0" + rest + "2.0" + rest + "2.0" + rest);
  ASSERT_EQ(read.size(), 3u);
  EXPECT_EQ(read[0].stamp_ns, 1'000'000'000);
  EXPECT_EQ(read[2].stamp_ns, 3'000'000'000);
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

TEST(PoseFile, PosesOfAnotherStartMayLastLongerThanTheClock) {
  const Clock clock = {1'403'636'580'000'000'000, 1'403'636'588'000'000'000};
  for (const auto& [first, step_ns, shift] :
       {std::tuple{100.0, 5e6, 0}, {100.0, 50e6, 0}, {0.0, 5e6, 0}, {1e5, 5e6, 3}, {1e8, 5e6, 6}}) {
    const std::string rows = Rows(0, 15000, [&](int i) {
      return fmt::format("{:.4f}", first + i * step_ns * 1e-9 * std::pow(10, shift));
    });
    for (const double offset_s : {0.0, 1403636480.0}) {
      const Trajectory read = Read(rows, {.offset_s = offset_s}, clock);
      EXPECT_EQ(read[1].stamp_ns - read[0].stamp_ns, std::llround(step_ns)) << first << offset_s;
    }
  }
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
