// Odometry on images: what a camera that hangs, or an IMU that falls silent, does to it.
#include "odometry/odometry.h"

#include <gtest/gtest.h>

#include <functional>
#include <memory>

#include "data/sequence.h"
#include "data/simulator/example.h"
#include "data/simulator/imu_simulator.h"
#include "data/stereo_reader.h"
#include "tests/testing/box_room_renderer.h"
#include "tests/testing/shared_data.h"

namespace slcmap {
namespace {

constexpr char kLeftHangs[] = "images dropped that repeat the one before while the rig moves";
constexpr char kRightHangs[] =
    "right images ignored that repeat the one before while the rig moves";
constexpr double kRest_s = 1, kDuration_s = 6, kRate_hz = 20;

Rig SmallRig() {
  Rig rig = ExampleStereoRig();
  for (Camera& camera : rig.cameras) {
    camera.width_px = 300;
    camera.height_px = 192;
    camera.fx_px = camera.fy_px = 174;
    camera.cx_px = 149.5;
    camera.cy_px = 95.5;
  }
  return rig;
}

struct Recording {
  Rig rig;
  OdometryOptions options;
  std::vector<StereoImage> images;
  std::vector<ImuSample> imu;
  std::function<RigidTransform(int64_t)> truth;  // T_world_imu at a stamp
};

// At rest, then flying through a bare room; without any noise, so that images at rest are the same.
Recording MakeRecording() {
  RenderTask task{SmallRig(), ExampleFlight(SmallRig(), kDuration_s, kRest_s), {}};
  for (double t_s = 0.1; t_s < kDuration_s - 0.1; t_s += 1 / kRate_hz) task.times_s.push_back(t_s);
  Recording recording;
  recording.rig = task.rig;
  recording.options.points.min_distance_px = 10;
  recording.options.keyframes.min_parallax_px = 6;
  BoxRoomRenderer renderer(task, 2.5);
  for (size_t i = 0; i < task.times_s.size(); ++i) {
    const RenderedPair pair = renderer.Render(static_cast<int>(i), false);
    recording.images.push_back({ToNanoseconds(task.times_s[i]), pair.left, pair.right});
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

Result Play(const Recording& recording, const std::vector<StereoImage>& images) {
  Odometry odometry(recording.rig, recording.options);
  Result result;
  size_t next = 0;
  for (const StereoImage& image : images) {
    while (next < recording.imu.size() &&
           (next == 0 || recording.imu[next - 1].stamp_ns < image.stamp_ns)) {
      odometry.AddImu(recording.imu[next++]);
    }
    for (const OnlineState& state : odometry.AddStereo(image)) result.states.push_back(state);
  }
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

class OdometryOnImages : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { recording_ = std::make_unique<Recording>(MakeRecording()); }
  static void TearDownTestSuite() { recording_.reset(); }
  static inline std::unique_ptr<Recording> recording_;
};

TEST_F(OdometryOnImages, ImagesThatAreTheSameAtRestAreTaken) {
  const Result result = Play(*recording_, recording_->images);
  EXPECT_EQ(result.Count(kLeftHangs), 0);
  EXPECT_EQ(result.Count(kRightHangs), 0);
  EXPECT_LT(ToSeconds(result.states.front().stamp_ns), kRest_s);
  EXPECT_EQ(result.states.back().segment, 0);
  EXPECT_LT(LargestError_m(*recording_, result), 0.05);
}

TEST_F(OdometryOnImages, ACameraThatHangsForAWhileIsBridged) {
  const Result result = Play(*recording_, Hanging(recording_->images, 2.5, 3.0, true, true));
  EXPECT_EQ(result.Count(kLeftHangs), 10);
  EXPECT_EQ(result.states.back().segment, 0);
  EXPECT_LT(LargestError_m(*recording_, result), 0.1);
}

TEST_F(OdometryOnImages, ACameraThatHangsForLongStartsANewSegment) {
  const Result result = Play(*recording_, Hanging(recording_->images, 2.0, 4.2, true, true));
  EXPECT_EQ(result.Count(kLeftHangs), 44);
  EXPECT_EQ(result.Count("segments ended by a gap in the images"), 1);
  EXPECT_EQ(result.states.back().segment, 1);
}

TEST_F(OdometryOnImages, ARightCameraThatHangsIsDoneWithout) {
  const Result result = Play(*recording_, Hanging(recording_->images, 2.5, 4.0, false, true));
  EXPECT_GE(result.Count(kRightHangs), 1);  // right images are looked at on keyframes only
  EXPECT_LE(result.Count(kRightHangs), 30);
  EXPECT_EQ(result.Count(kLeftHangs), 0);
  EXPECT_EQ(result.states.back().segment, 0);
  EXPECT_LT(LargestError_m(*recording_, result), 0.05);
}

TEST_F(OdometryOnImages, OnlySoManyImagesWaitForTheirImuSamples) {
  Odometry odometry(recording_->rig, recording_->options);
  for (int i = 0; i < 130; ++i) {
    StereoImage image = recording_->images.front();
    image.stamp_ns += i;
    EXPECT_TRUE(odometry.AddStereo(image).empty());
  }
  const auto warnings = odometry.Run().warnings;
  EXPECT_EQ(warnings.at("images dropped whose IMU samples did not arrive"), 30);
  EXPECT_EQ(warnings.at("images whose IMU samples did not arrive"), 100);
}

TEST(OdometryOnTheRealRecording, ACameraThatHangsCostsTheAccuracyOfItsTimeOnly) {
  const std::string path = testing::SharedData("euroc_mh01_8s");
  if (path.empty()) GTEST_SKIP() << "no real recording here";
  const Sequence sequence = OpenSequence(path);
  Recording recording;
  recording.rig = sequence.rig;
  recording.imu = sequence.imu;
  const Trajectory truth = ReadTrajectory(sequence.truth_path);
  recording.truth = [&](int64_t stamp_ns) { return PoseAt(truth, stamp_ns, 0.1).value(); };
  StereoReader reader(sequence);
  while (const auto pair = reader.Next()) {
    recording.images.push_back({pair->stamp_ns, pair->left, pair->decode_right()});
  }
  const Result result = Play(recording, Hanging(recording.images, 4.0, 4.5, true, true));
  EXPECT_EQ(result.Count(kLeftHangs), 10);
  EXPECT_EQ(result.states.back().segment, 0);
  EXPECT_LT(LargestError_m(recording, result), 0.05);
}

}  // namespace
}  // namespace slcmap
