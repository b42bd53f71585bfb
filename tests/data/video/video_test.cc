#include "data/video/video.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>

#include <opencv2/core.hpp>

#include "data/io/file.h"
#include "data/io/image.h"
#include "data/source/asl_files.h"
#include "tests/testing/caught.h"
#include "tests/testing/temp_folder.h"
#include "tests/testing/video_writer.h"

namespace slcmap {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::TempFolder;
using testing::VideoWriter;

constexpr int kWidth_px = 64, kHeight_px = 32;

// A frame whose pixels tell its number, and left from right.
cv::Mat MakeVideoFrame(int number) {
  cv::Mat frame(kHeight_px, kWidth_px, CV_8UC1, cv::Scalar(10 * number));
  frame.colRange(kWidth_px / 2, kWidth_px).setTo(10 * number + 5);
  return frame;
}

constexpr int64_t kTimes_ms[] = {1000, 1033, 1070, 1100, 1190};

std::string WriteVideo(const TempFolder& folder, const std::string& name) {
  VideoWriter writer(folder.Path(name), {kWidth_px, kHeight_px});
  for (int i = 0; i < 5; ++i) writer.Add(MakeVideoFrame(i), kTimes_ms[i]);
  return folder.Path(name);
}

// At 200 Hz from one to two seconds.
std::string CsvLog(const std::string& header, double unit_s) {
  std::string text = header;
  for (int i = 0; i < 200; ++i) {
    text += fmt::format("{:.9g},{},0.2,0.3,{},0,9.8\n", (1 + 0.005 * i) / unit_s, 0.1 * i, i);
  }
  return text;
}

std::vector<int64_t> StampsIn(const std::string& camera) {
  Warnings warnings;
  std::vector<int64_t> stamps_ns;
  for (const ImageFile& image : ReadAslImages(camera, &warnings)) {
    stamps_ns.push_back(image.stamp_ns);
  }
  return stamps_ns;
}

TEST(Video, WhatIsCutOffIsLeftOut) {
  const TempFolder folder;
  const std::string path = WriteVideo(folder, "walk.mkv");
  const std::string bytes = ReadFile(path);
  for (size_t kept = 0; kept < bytes.size(); kept += 97) {
    folder.Write("cut.mkv", bytes.substr(0, kept));
    try {
      VideoFile file(folder.Path("cut.mkv"));
      int frames = 0;
      while (file.Next()) ++frames;
      EXPECT_LE(frames, 5);
    } catch (const DataError& error) {
      EXPECT_THAT(error.what(), HasSubstr("cut.mkv: found"));
    }
  }
}

TEST(Video, IsUnpackedWithTheLogBesideIt) {
  const TempFolder folder;
  const std::string video = WriteVideo(folder, "walk.mkv");
  folder.Write("walk.csv", CsvLog("time_s,gyro_x,gyro_y,gyro_z,acc_x,acc_y,acc_z\n", 1));
  const VideoRecording recording = FindVideoRecording(video, {});
  const VideoCounts counts = UnpackVideo(recording, folder.Path("out"), {});
  EXPECT_EQ(counts.left, 5);
  EXPECT_EQ(counts.right, 0);
  EXPECT_EQ(counts.imu, 200);
  EXPECT_THAT(
      StampsIn(folder.Path("out/cam0")),
      ElementsAre(1'000'000'000, 1'033'000'000, 1'070'000'000, 1'100'000'000, 1'190'000'000));
  Warnings warnings;
  const auto samples = ReadAslImu(folder.Path("out/imu0/data.csv"), &warnings);
  ASSERT_EQ(samples.size(), 200u);
  EXPECT_EQ(samples[3].stamp_ns, 1'015'000'000);
  EXPECT_DOUBLE_EQ(samples[3].angular_velocity_rad_s.x(), 0.1 * 3);
  EXPECT_DOUBLE_EQ(samples[3].specific_force_m_s2.x(), 3);
}

TEST(Video, SideBySideIsSplit) {
  const TempFolder folder;
  const std::string video = WriteVideo(folder, "walk.mkv");
  folder.Write("walk.csv", CsvLog("", 1e-3));
  const VideoRecording recording = FindVideoRecording(video, {.side_by_side = true});
  const VideoCounts counts = UnpackVideo(recording, folder.Path("out"), {});
  EXPECT_EQ(counts.left, 5);
  EXPECT_EQ(counts.right, 5);
  const ImageRead right = ReadGrayImage(folder.Path("out/cam1/data/1033000000.png"), {});
  ASSERT_EQ(right.image.size(), cv::Size(kWidth_px / 2, kHeight_px));
  EXPECT_EQ(right.image.at<uchar>(3, 3), 15);
}

TEST(Video, ATagToTurnItIsTold) {
  const TempFolder folder;
  for (const double turned_deg : {0, 90}) {
    const std::string path = folder.Path("walk.mov");
    {
      VideoWriter writer(path, {kWidth_px, kHeight_px}, turned_deg);
      writer.Add(MakeVideoFrame(1), 1000);
    }
    VideoFile video(path);
    EXPECT_EQ(video.warnings().entries().size(), turned_deg == 0 ? 0u : 1u);
  }
}

TEST(Video, LogsOfPhonesAndOfRosNameTheirColumnsOtherwise) {
  const TempFolder folder;
  const std::string video = WriteVideo(folder, "walk.mkv");
  const auto unpack = [&](const std::vector<std::string>& logs) {
    UnpackVideo(FindVideoRecording(video, {.logs = logs}), folder.Path("out"), {});
    return ReadFile(folder.Path("out/imu0/data.csv"));
  };
  const std::string plain = unpack({folder.Write("a.csv", CsvLog("t,wx,wy,wz,ax,ay,az\n", 1e-9))});
  for (const char* header : {"time_ns,gyro_x_rad_s,gyro_y_rad_s,gyro_z_rad_s,acc_x_m_s2,acc_y_m_s2,"
                             "acc_z_m_s2\n",
                             "%time,field.angular_velocity.x,field.angular_velocity.y,"
                             "field.angular_velocity.z,field.linear_acceleration.x,"
                             "field.linear_acceleration.y,field.linear_acceleration.z,"
                             "field.angular_velocity_covariance0\n",
                             "time,body_gyroX,body_gyroY,body_gyroZ,acc_x,acc_y,acc_z,x,y,z,"
                             "gyro_x_std\n",
                             "loggingTime,gyroRotationX(rad/s),gyroRotationY(rad/s),gyroRotationZ("
                             "rad/s),accelX(m/s^2),accelY(m/s^2),accelZ(m/s^2)\n"}) {
    EXPECT_EQ(unpack({folder.Write("b.csv", CsvLog(header, 1e-9))}), plain) << header;
  }
  std::string gyro = "time,seconds_elapsed,z,y,x\n", total = gyro;
  for (int i = 0; i < 200; ++i) {
    const int64_t stamp_ns = 1'000'000'000 + 5'000'000LL * i;
    gyro += fmt::format("{},{},0.3,0.2,{}\n", stamp_ns, 0.005 * i, 0.1 * i);
    total += fmt::format("{},{},9.8,0,{}\n", stamp_ns, 0.005 * i, i);
  }
  const std::string apart =
      unpack({folder.Write("Gyroscope.csv", gyro), folder.Write("TotalAcceleration.csv", total)});
  EXPECT_THAT(apart, HasSubstr("1005000000,0.1,0.2,0.3,,,\n"));
  EXPECT_THAT(apart, HasSubstr("1005000000,,,,1,0,9.8\n"));
}

TEST(Video, JsonLinesTellTheTimesOfFrames) {
  const TempFolder folder;
  WriteVideo(folder, "data.mkv");
  WriteVideo(folder, "data2.mkv");
  std::string lines;
  for (int i = 0; i < 100; ++i) {
    const double t = 7 + 0.005 * i;
    lines += fmt::format("{{\"time\":{},\"sensor\":{{\"type\":\"{}\",\"values\":[{},0,1]}}}}\n", t,
                         i % 2 == 0 ? "gyroscope" : "accelerometer", i);
  }
  for (int i = 0; i < 5; ++i) {
    lines += fmt::format(
        "{{\"time\":{0},\"number\":{1},\"frames\":[{{\"cameraInd\":0,\"time\":{0}}},"
        "{{\"cameraInd\":1,\"time\":{2}}}]}}\n",
        7 + 0.03 * i, i, 7.001 + 0.03 * i);
  }
  folder.Write("data.jsonl", lines + "{\"time\": 7.5, \"sens\n");
  ASSERT_TRUE(IsVideoRecording(folder.Path("")));
  const VideoCounts counts =
      UnpackVideo(FindVideoRecording(folder.Path(""), {}), folder.Path("out"), {});
  EXPECT_EQ(counts.warnings.Count(kRowUnreadable), 1);
  EXPECT_THAT(
      StampsIn(folder.Path("out/cam1")),
      ElementsAre(7'001'000'000, 7'031'000'000, 7'061'000'000, 7'091'000'000, 7'121'000'000));
  EXPECT_EQ(counts.imu, 100);
}

TEST(Video, ListedTimesThatDoNotFitAreCounted) {
  const TempFolder folder;
  const std::string video = WriteVideo(folder, "walk.mkv");
  folder.Write("walk.csv", CsvLog("t,wx,wy,wz,ax,ay,az\n", 1e-9));
  folder.Write("frames.csv", "frame,timestamp\n0,1010000000\n1,1040000000\n2,1080000000\n");
  const VideoRecording recording =
      FindVideoRecording(video, {.frame_times = folder.Path("frames.csv")});
  const VideoCounts counts = UnpackVideo(recording, folder.Path("out"), {});
  EXPECT_EQ(counts.left, 3);
  EXPECT_EQ(counts.warnings.Count("frames_that_no_list_has"), 2);
}

TEST(Video, WhatIsMissingIsAskedFor) {
  const TempFolder folder;
  const std::string video = WriteVideo(folder, "walk.mkv");
  const auto message = [&](const VideoRecording& said) {
    const auto fault = testing::Caught<InputFault>(
        [&] { UnpackVideo(FindVideoRecording(video, said), folder.Path("out"), {}); });
    return fault.what() + ("; " + fault.remedy());
  };
  EXPECT_THAT(message({}), HasSubstr("there are walk.mkv; name the log: --imu walk.csv"));
  std::string late;
  for (int i = 0; i < 100; ++i) late += fmt::format("{},0,0,0,0,0,9.8\n", 100 + 0.005 * i);
  for (const auto& [log, found] :
       {std::pair<std::string, std::string>{
            late, "found the first frame at 1.000 s, expected it on the clock of the IMU"},
        {"time,height\n1,2\n2,3\n", "head the table: time_s"},
        {"time,gx,gy,gz,gyro_x,ax,ay,az\n1,0,0,0,0,0,0,9\n", "like 'gyro_x'"},
        {CsvLog("time,gx,gy,mag_z,ax,ay,az\n", 1), "a part of the axes"},
        {CsvLog("time,mag_x,mag_y,mag_z,ax,ay,az\n", 1), "found no gyroscope"},
        {"1,0,0,0,0,0,9\n1.1,0,0,0,0,0,9\n1.2,0,0,0,0,0,9\n", "found stamps 0.1"}}) {
    EXPECT_THAT(message({.logs = {folder.Write("log.csv", log)}}), HasSubstr(found));
  }
}

}  // namespace
}  // namespace slcmap
