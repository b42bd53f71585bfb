// Odometry on images: what a camera that hangs, or an IMU that falls silent, does to it.
#include "odometry/odometry.h"

#include <gtest/gtest.h>
#include <spdlog/details/null_mutex.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <stdexcept>
#include <string_view>
#include <thread>

#include "data/simulator/motion.h"
#include "odometry/run/run_folder.h"
#include "tests/testing/box_room_renderer.h"
#include "tests/testing/example.h"
#include "tests/testing/same_run.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

constexpr char kLeftHangs[] = "images dropped that repeat the one before while the rig moves";
constexpr char kRightHangs[] =
    "right images ignored that repeat the one before while the rig moves";
constexpr double kRest_s = 1, kRate_hz = 20;

struct Recording {
  Rig rig;
  OdometryOptions options;
  std::vector<StereoImage> images;
  std::vector<ImuSample> imu;
  std::function<RigidTransform(int64_t)> truth;  // T_world_imu at a stamp
};

// At rest, then flying through a bare room; without any noise, so that images at rest are the same.
Recording MakeRecording(double panel_m = 0, const Rig& rig = SmallRig(), double duration_s = 6) {
  RenderTask task{rig, ExampleFlight(SmallRig(), duration_s, kRest_s), {}};
  for (double t_s = 0.1; t_s < duration_s - 0.1; t_s += 1 / kRate_hz) task.times_s.push_back(t_s);
  Recording recording;
  recording.rig = task.rig;
  recording.options.points.min_distance_px = 10;
  recording.options.keyframes.min_parallax_px = 6;
  BoxRoomRenderer renderer(task, 2.5, panel_m);
  for (size_t i = 0; i < task.times_s.size(); ++i) {
    const RenderedPair pair = renderer.Render(static_cast<int>(i), false);
    recording.images.push_back(
        {ToNanoseconds(task.times_s[i]), pair.left, pair.right, pair.others});
  }
  recording.imu = SimulateImu(task.motion, {}).samples;
  recording.truth = [motion = task.motion](int64_t stamp_ns) {
    return motion.PoseAt(ToSeconds(stamp_ns));
  };
  return recording;
}

struct Result {
  std::vector<OnlineState> states;
  OdometryRun run;
  int64_t Count(const std::string& warning) const {
    const auto it = run.warnings.find(warning);
    return it == run.warnings.end() ? 0 : it->second;
  }
};

Result Play(const Recording& recording, const std::vector<StereoImage>& images, int threads = 1) {
  Odometry odometry(recording.rig, recording.options, threads);
  Result result;
  size_t next = 0;
  const int64_t offset_ns = ToNanoseconds(recording.rig.camera_time_offset_s);
  for (const StereoImage& image : images) {
    while (next < recording.imu.size() &&
           (next == 0 || recording.imu[next - 1].stamp_ns < image.stamp_ns + offset_ns)) {
      odometry.AddImu(recording.imu[next++]);
    }
    for (const OnlineState& state : odometry.AddStereo(image)) result.states.push_back(state);
  }
  for (const OnlineState& state : odometry.Finish()) result.states.push_back(state);
  result.run = odometry.Run();
  return result;
}

// The images with those after from_s, up to to_s, replaced by the one before: left, right or both.
std::vector<StereoImage> Hanging(std::vector<StereoImage> images, double from_s, double to_s,
                                 bool left, bool right) {
  const int64_t start_ns = images.front().stamp_ns;
  for (size_t i = 1; i < images.size(); ++i) {
    const double t_s = ToSeconds(images[i].stamp_ns - start_ns);
    if (t_s <= from_s || t_s > to_s) continue;
    if (left) images[i].left = images[i - 1].left;
    if (right) images[i].right = images[i - 1].right;
  }
  return images;
}

// The largest distance from the truth once the first poses are laid together, within a segment.
double LargestError_m(const Recording& recording, const Result& result) {
  double largest_m = 0;
  const OnlineState& first = result.states.front();
  const RigidTransform gauge = recording.truth(first.stamp_ns) * first.T_world_imu.Inverse();
  for (const OnlineState& state : result.states) {
    if (state.segment != first.segment) break;
    const RigidTransform truth = recording.truth(state.stamp_ns);
    largest_m =
        std::max(largest_m, (gauge * state.T_world_imu.translation - truth.translation).norm());
  }
  return largest_m;
}

const Recording& BareRoom() {
  static const Recording recording = MakeRecording();
  return recording;
}

TEST(OdometryOnImages, ImagesThatAreTheSameAtRestAreTaken) {
  const Result result = Play(BareRoom(), BareRoom().images);
  EXPECT_EQ(result.Count(kLeftHangs) + result.Count(kRightHangs), 0);
  EXPECT_LT(ToSeconds(result.states.front().stamp_ns), kRest_s);
  EXPECT_EQ(result.states.back().segment, 0);
  EXPECT_LT(LargestError_m(BareRoom(), result), 0.05);
}

TEST(OdometryOnImages, ACameraThatHangsForLongStartsANewSegment) {
  const Result result = Play(BareRoom(), Hanging(BareRoom().images, 2.0, 4.2, true, true));
  EXPECT_EQ(result.Count(kLeftHangs), 44);
  EXPECT_EQ(result.Count("segments ended by a gap in the images"), 1);
  EXPECT_EQ(result.states.back().segment, 1);
}

// The run folder, but for the timings.
std::map<std::string, std::string> CollectFiles(const OdometryRun& run) {
  const testing::TempFolder folder;
  WriteRunFolder(folder.Path("run"), run);
  std::map<std::string, std::string> files;
  for (const auto& file : std::filesystem::directory_iterator(folder.Path("run"))) {
    const std::string name = file.path().filename().string();
    if (name != "timings.json") files[name] = testing::ReadText(file.path().string());
  }
  return files;
}

void ExpectSame(const Result& a, const Result& b) {
  const auto files_a = CollectFiles(a.run), files_b = CollectFiles(b.run);
  ASSERT_EQ(files_a.size(), files_b.size());
  for (const auto& [name, bytes] : files_a) EXPECT_TRUE(bytes == files_b.at(name)) << name;
  ASSERT_EQ(a.states.size(), b.states.size());
  for (size_t i = 0; i < a.states.size(); ++i) {
    EXPECT_EQ(a.states[i].stamp_ns, b.states[i].stamp_ns);
    EXPECT_EQ(a.states[i].T_world_imu.translation, b.states[i].T_world_imu.translation);
  }
}

// A room whose walls have edges, and lines although the images are small.
Recording MakeRecordingWithLines(const Rig& rig = SmallRig(), double duration_s = 6) {
  Recording recording = MakeRecording(2.0, rig, duration_s);
  recording.options.method = Method::kSlc;
  recording.options.lines.detector.min_length_px = 20;
  return recording;
}

void AcceptAnyHeading(ManhattanOptions* manhattan) {
  manhattan->min_length_px = 15;
  manhattan->min_images = manhattan->min_images_below = 2;
  manhattan->min_mean_length_px = manhattan->min_share = manhattan->min_minor_share = 0;
}

const Recording& RoomWithLines() {
  static const Recording recording = MakeRecordingWithLines();
  return recording;
}

// Gives the result.
Result PlayWithOneAndTwo(const Recording& recording, const std::vector<StereoImage>& images) {
  Result one = Play(recording, images, 1);
  EXPECT_FALSE(one.states.empty());
  EXPECT_EQ(one.states.size(), one.run.states.size());
  ExpectSame(one, Play(recording, images, 2));
  return one;
}

TEST(ThreadsChangeNothing, WithLines) {
  const Result result = PlayWithOneAndTwo(RoomWithLines(), RoomWithLines().images);
  EXPECT_GT(result.run.keyframes.size(), 10u);
  EXPECT_GT(result.run.lines.size(), 3u);
}

// A small rig whose second camera looks backwards.
Rig BackToBack() {
  Rig rig = SmallRig();
  rig.T_imu_camera[1] =
      rig.T_imu_camera[0] * RigidTransform(ExpRotation({0, M_PI, 0}), {0, 0, -0.04});
  return rig;
}

const Recording& RoomBackToBack() {
  static const Recording recording = MakeRecordingWithLines(BackToBack());
  return recording;
}

// Observations of keyframes, by camera.
struct Counts {
  explicit Counts(const OdometryRun& run) {
    for (const Keyframe& keyframe : run.keyframes) {
      for (const auto& seen : keyframe.observations) {
        ++points[static_cast<size_t>(seen.camera)];
        in_right[static_cast<size_t>(seen.camera)] += seen.right_px.has_value();
      }
      for (const auto& seen : keyframe.lines) ++lines[static_cast<size_t>(seen.camera)];
    }
  }
  std::array<int, 5> points{}, in_right{}, lines{};
};

TEST(OdometryOnImages, BothOfTwoCamerasThatLookApartAreFollowed) {
  const Recording& recording = RoomBackToBack();
  const Result result = PlayWithOneAndTwo(recording, recording.images);
  EXPECT_EQ(result.states.back().segment, 0);
  EXPECT_LT(LargestError_m(recording, result), 0.1);
  const Counts counts(result.run);
  for (const size_t camera : {0, 1}) {
    EXPECT_GT(counts.points[camera], 200) << camera;
    EXPECT_GT(counts.lines[camera], 20) << camera;
  }
}

// Two stereo pairs that look ahead and back, and one camera more that looks to the side.
Rig FiveCameras() {
  Rig rig = SmallRig();
  rig.Resize(5);
  const auto place = [&](size_t camera, double turn_rad, const Eigen::Vector3d& p_m) {
    rig.cameras[camera] = rig.cameras[0];
    rig.T_imu_camera[camera] =
        rig.T_imu_camera[0] * RigidTransform(ExpRotation({0, turn_rad, 0}), p_m);
  };
  place(2, M_PI, {0.1, 0, -0.05});
  place(3, M_PI, {0, 0, -0.05});
  place(4, 0.5 * M_PI, {0.1, 0, -0.02});
  return rig;
}

TEST(OdometryOnImages, PairsAndLoneCamerasAreAllFollowed) {
  const Recording recording = MakeRecordingWithLines(FiveCameras(), 3.5);
  const Result result = PlayWithOneAndTwo(recording, recording.images);
  EXPECT_EQ(result.states.back().segment, 0);
  EXPECT_LT(LargestError_m(recording, result), 0.05);
  const Counts counts(result.run);
  for (const size_t camera : {0, 2, 4}) {
    EXPECT_GT(counts.points[camera], 100) << camera;
    EXPECT_GT(counts.lines[camera], 20) << camera;
  }
  for (const size_t left : {0, 2}) EXPECT_GT(2 * counts.in_right[left], counts.points[left]);
  EXPECT_EQ(counts.in_right[4] + counts.points[1] + counts.points[3], 0);
}

// What is left is the first camera, and the second one's points while it does not hang.
TEST(OdometryOnImages, ASecondCameraThatHangsIsDoneWithout) {
  const Recording& recording = RoomBackToBack();
  const Result result =
      PlayWithOneAndTwo(recording, Hanging(recording.images, 2.5, 3.5, false, true));
  EXPECT_EQ(result.Count(kRightHangs), 20);
  EXPECT_EQ(result.states.back().segment, 0);
  EXPECT_LT(LargestError_m(recording, result), 0.2);
}

TEST(ThreadsChangeNothing, WithPointsOfOneCameraAlone) {
  Recording recording = RoomWithLines();
  recording.options.method = Method::kPointsMono;
  const OdometryRun run = PlayWithOneAndTwo(recording, recording.images).run;
  EXPECT_GT(run.keyframes.size(), 10u);
  EXPECT_TRUE(run.calibration.back().right_rotation_sigma_rad.isZero(0)) << "of no camera";
}

// The first gap is bridged, and in the second there are points and lines of the left camera.
TEST(ThreadsChangeNothing, WhereCamerasHang) {
  const auto both = Hanging(RoomWithLines().images, 2.5, 3.0, true, true);
  const Result result = PlayWithOneAndTwo(RoomWithLines(), Hanging(both, 3.5, 4.5, false, true));
  EXPECT_EQ(result.Count(kLeftHangs), 10);
  EXPECT_GE(result.Count(kRightHangs), 1);  // right images are looked at on keyframes only
  EXPECT_LE(result.Count(kRightHangs), 20);
  EXPECT_EQ(result.states.back().segment, 0);
  EXPECT_LT(LargestError_m(RoomWithLines(), result), 0.1);
}

TEST(ThreadsChangeNothing, WhereTheImuFallsSilent) {
  Recording recording = RoomWithLines();
  std::erase_if(recording.imu, [](const ImuSample& sample) {
    const double t_s = ToSeconds(sample.stamp_ns);
    return t_s > 2.5 && t_s < 3.5;
  });
  EXPECT_EQ(PlayWithOneAndTwo(recording, recording.images).run.states.back().segment, 1);
}

TEST(ThreadsChangeNothing, WhereTheEstimateFails) {
  Recording recording = RoomWithLines();
  recording.options.failure.max_speed_m_s = 0.5;
  const Result result = PlayWithOneAndTwo(recording, recording.images);
  EXPECT_GE(result.Count("segments ended by an impossible speed"), 1);
}

Recording WithHeading() {
  Recording recording = RoomWithLines();
  AcceptAnyHeading(&recording.options.manhattan);
  return recording;
}

// The recording as a camera has it whose clock is behind the IMU's by so much.
Recording OnClockBehindBy(int64_t offset_ns) {
  Recording recording = WithHeading();
  recording.rig.camera_time_offset_s = ToSeconds(offset_ns);
  for (StereoImage& image : recording.images) image.stamp_ns -= offset_ns;
  return recording;
}

TEST(OdometryWithTimeOffset, TheWholeRunIsOnTheCamerasClockAndElseTheSame) {
  OdometryRun expected = Play(WithHeading(), WithHeading().images).run;
  EXPECT_FALSE(expected.manhattan_worlds.empty());
  for (const int64_t offset_ns : {20'000'000, -20'000'000}) {  // or it is ahead
    const Recording late = OnClockBehindBy(offset_ns);
    OdometryRun run = Play(late, late.images).run;
    for (OnlineState& state : run.states) state.stamp_ns += offset_ns;
    for (Keyframe& keyframe : run.keyframes) keyframe.stamp_ns += offset_ns;
    for (ManhattanWorld& world : run.manhattan_worlds) world.found_at_ns += offset_ns;
    testing::ExpectSame(run.states, expected.states);
    testing::ExpectSame(run.keyframes, expected.keyframes);
    testing::ExpectSame(run.manhattan_worlds, expected.manhattan_worlds);
  }
}

// Standing still, a gap that ends a segment, and a camera that hangs.
TEST(OdometryWithTimeOffset, KeyframesHaveTheStampsOfImagesWhateverHappens) {
  const Recording late = OnClockBehindBy(20'000'000);
  auto images = Hanging(late.images, 1.5, 2.0, true, true);
  std::erase_if(images, [&](const StereoImage& image) {
    const double t_s = ToSeconds(image.stamp_ns - late.images.front().stamp_ns);
    return t_s > 2.2 && t_s < 4.3;
  });
  const Result result = Play(late, images);
  EXPECT_EQ(result.Count(kLeftHangs), 10);
  EXPECT_EQ(result.run.states.back().segment, 1);
  const auto is_of_image = [&](int64_t stamp_ns) {
    return std::ranges::find(images, stamp_ns, &StereoImage::stamp_ns) != images.end();
  };
  std::map<int, int> matched;  // keyframes with the stamp of a state, by segment
  for (const Keyframe& keyframe : result.run.keyframes) {
    EXPECT_TRUE(is_of_image(keyframe.stamp_ns)) << keyframe.id;
    matched[keyframe.segment] += std::ranges::find(result.states, keyframe.stamp_ns,
                                                   &OnlineState::stamp_ns) != result.states.end();
  }
  EXPECT_GT(matched[0], 1);
  EXPECT_GT(matched[1], 0);
  EXPECT_TRUE(std::ranges::all_of(result.states, is_of_image, &OnlineState::stamp_ns));
}

// Adds to a run what another has more of.
void Append(const OdometryRun& more, OdometryRun* run) {
  const auto append = [](const auto& from, auto* to) {
    to->insert(to->end(), from.begin(), from.end());
  };
  append(more.states, &run->states);
  append(more.imu, &run->imu);
  append(more.keyframes, &run->keyframes);
  append(more.landmarks, &run->landmarks);
  append(more.lines, &run->lines);
}

TEST(OdometryOnImages, PartsTakenOnTheWayMakeUpTheRunAndChangeNothing) {
  Recording recording = BareRoom();
  recording.options.method = Method::kSlc;
  recording.options.failure.max_lost_s = 0.5;  // the gap below starts a new segment
  std::vector<StereoImage> images = recording.images;
  images.erase(images.begin() + 60, images.begin() + 75);
  OdometryRun undisturbed = Play(recording, images).run;
  for (const int threads : {1, 2}) {
    Odometry odometry(recording.rig, recording.options, threads);
    for (const ImuSample& sample : recording.imu) odometry.AddImu(sample);
    OdometryRun taken;
    for (size_t i = 0; i < images.size(); ++i) {
      odometry.AddStereo(images[i]);
      if (i % 10 == 9) odometry.Window();
      Append(odometry.TakeFinished(), &taken);
    }
    EXPECT_LT(taken.keyframes.size(), odometry.Run().keyframes.size());
    const OdometryRun window = odometry.Window();
    Append(odometry.TakeFinished(), &taken);
    Append(window, &taken);
    const OdometryRun run = odometry.Run();
    EXPECT_EQ(taken.states.size(), run.states.size());
    EXPECT_EQ(taken.imu.size(), recording.imu.size());
    const auto same_ids = [](const auto& a, const auto& b) {
      return std::ranges::equal(
          a, b, {}, [](const auto& item) { return item.id; },
          [](const auto& item) { return item.id; });
    };
    EXPECT_TRUE(same_ids(taken.keyframes, run.keyframes));
    EXPECT_TRUE(same_ids(taken.landmarks, run.landmarks));
    EXPECT_TRUE(same_ids(taken.lines, run.lines));
    undisturbed.imu = run.imu;  // fed up to the last image only
    ExpectSame({{}, run}, {{}, undisturbed});
  }
}

TEST(OdometryOnImages, WhatADecoderThrowsComesOutOfAddStereo) {
  Recording recording = BareRoom();
  recording.options.method = Method::kSlc;
  for (const int threads : {1, 2}) {
    Odometry odometry(recording.rig, recording.options, threads);
    for (const ImuSample& sample : recording.imu) odometry.AddImu(sample);
    const auto play = [&] {
      for (size_t i = 0; i < recording.images.size(); ++i) {
        StereoImage image = recording.images[i];
        image.right.release();
        odometry.AddStereo(image, {[&, i]() -> cv::Mat {
                             if (i >= 60) throw std::runtime_error("spoilt");
                             return recording.images[i].right;
                           }});
      }
    };
    EXPECT_EQ(testing::MessageOf<std::runtime_error>(play), "spoilt");
    EXPECT_GT(odometry.Run().states.size(), 20u);
  }
}

struct LogIsFull {};

// Throws in the thread that says that a heading was found: that of the window's optimisation.
// spdlog keeps what is derived from std::exception to itself.
class ThrowingSink : public spdlog::sinks::base_sink<spdlog::details::null_mutex> {
 public:
  std::optional<std::thread::id> thrown_in() const { return thrown_in_; }

 private:
  void sink_it_(const spdlog::details::log_msg& message) override {
    const std::string_view text(message.payload.data(), message.payload.size());
    if (text.find("found Manhattan world") == std::string_view::npos) return;
    thrown_in_ = std::this_thread::get_id();
    throw LogIsFull();
  }
  void flush_() override {}

  std::optional<std::thread::id> thrown_in_;
};

// Puts a logger in the place of the program's, for as long as it lives.
class LoggerInstead {
 public:
  explicit LoggerInstead(std::shared_ptr<spdlog::sinks::sink> sink)
      : before_(spdlog::default_logger()) {
    const auto logger = std::make_shared<spdlog::logger>("", std::move(sink));
    logger->set_error_handler([](const std::string&) {});
    spdlog::set_default_logger(logger);
  }
  ~LoggerInstead() { spdlog::set_default_logger(before_); }

 private:
  std::shared_ptr<spdlog::logger> before_;
};

TEST(ThreadsChangeNothing, WhatTheOptimisationThrowsComesOutOfAddStereo) {
  Recording recording = RoomWithLines();
  AcceptAnyHeading(&recording.options.manhattan);
  for (const int threads : {1, 2}) {
    const auto sink = std::make_shared<ThrowingSink>();
    const LoggerInstead logger(sink);
    Odometry odometry(recording.rig, recording.options, threads);
    for (const ImuSample& sample : recording.imu) odometry.AddImu(sample);
    const auto play = [&] {
      for (const StereoImage& image : recording.images) odometry.AddStereo(image);
    };
    EXPECT_THROW(play(), LogIsFull);
    ASSERT_TRUE(sink->thrown_in().has_value());
    EXPECT_EQ(*sink->thrown_in() == std::this_thread::get_id(), threads == 1);
    EXPECT_GT(odometry.Run().states.size(), 5u);
  }
}

TEST(OdometryOnImages, TheStateOfAKeyframeComesWithTheNextImageOrWhenAskedFor) {
  Odometry odometry(BareRoom().rig, BareRoom().options, 2);
  for (const ImuSample& sample : BareRoom().imu) odometry.AddImu(sample);
  size_t late = 0;
  bool started = false;
  for (const StereoImage& image : BareRoom().images) {
    const auto at_once = odometry.AddStereo(image), waited_for = odometry.Finish();
    started = started || !at_once.empty();
    EXPECT_EQ(at_once.size() + waited_for.size(), started ? 1u : 0u);
    for (const OnlineState& state : waited_for) EXPECT_EQ(state.stamp_ns, image.stamp_ns);
    late += waited_for.size();
  }
  EXPECT_GT(late, 5u);
  EXPECT_TRUE(odometry.Finish().empty());
}

TEST(OdometryOnImages, OnlySoManyImagesWaitForTheirImuSamples) {
  Odometry odometry(BareRoom().rig, BareRoom().options);
  for (int i = 0; i < 130; ++i) {
    StereoImage image = BareRoom().images.front();
    image.stamp_ns += i;
    EXPECT_TRUE(odometry.AddStereo(image).empty());
  }
  const auto warnings = odometry.Run().warnings;
  EXPECT_EQ(warnings.at("images dropped whose IMU samples did not arrive"), 30);
  EXPECT_EQ(warnings.at("images whose IMU samples did not arrive"), 100);
}

}  // namespace
}  // namespace slcmap
