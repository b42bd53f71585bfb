#include "mapping/views/recorded_views.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "data/core/error.h"
#include "mapping/mapping.h"
#include "odometry/frontend/options.h"
#include "tests/testing/shared_data.h"
#include "tests/testing/small_sequence.h"

namespace slcmap {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

TEST(RecordedViews, OfARunWithoutImagesSayHowToMapItAllTheSame) {
  EXPECT_THAT([] { ViewsOfRun(OdometryRun(), ""); },
              ThrowsMessage<DataError>(HasSubstr("--sparse")));
}

// Seven images, 4 cm apart: the first, the fourth and the last become keyframes.
class SmallRecording : public ::testing::Test {
 protected:
  SmallRecording() {
    testing::WriteSequence(folder_, {.images = 7});
    Trajectory trajectory;
    for (int i = 0; i < 7; ++i) {
      trajectory.push_back(
          {testing::ImageStamp(i), {Eigen::Quaterniond::Identity(), {0.04 * i, 0, 0}}});
    }
    run_ = RunAtPoses(folder_.Path(), {}, trajectory);
  }

  // With which the run was made.
  Trajectory Poses(int64_t later_ns = 0) const {
    Trajectory poses;
    for (const OnlineState& state : run_.states) {
      poses.push_back({state.stamp_ns + later_ns, state.T_world_imu});
    }
    return poses;
  }

  void Remove(int image) {
    for (const char* camera : {"cam0", "cam1"}) {
      std::filesystem::remove(folder_.Path(std::string("mav0/") + camera + "/data/" +
                                           std::to_string(testing::ImageStamp(image)) + ".png"));
    }
  }

  const testing::TempFolder folder_;
  OdometryRun run_;
};

TEST_F(SmallRecording, WithTheSamePosesIsTheSameRun) {
  Trajectory poses = Poses();
  EXPECT_FALSE(run_.id.empty());
  EXPECT_EQ(RunAtPoses(folder_.Path(), {}, poses).id, run_.id);
  poses[3].T_world_imu.translation.z() += 1e-6;
  EXPECT_NE(RunAtPoses(folder_.Path(), {}, poses).id, run_.id);
}

TEST_F(SmallRecording, TellsImagesThatWereChanged) {
  const std::string states = StatesOfImages(run_, "");
  EXPECT_EQ(StatesOfImages(run_, folder_.Path()), states);
  Remove(3);
  EXPECT_NE(StatesOfImages(run_, ""), states);
}

TEST_F(SmallRecording, WithPosesThatJumpWhereImagesAreIsPartial) {
  EXPECT_TRUE(run_.complete);
  Trajectory poses = Poses(), before = poses, late = Poses(-1'000'000);
  for (size_t i = 4; i < poses.size(); ++i) poses[i].T_world_imu.translation.y() += 0.5;
  const OdometryRun jumping = RunAtPoses(folder_.Path(), {}, poses);
  EXPECT_FALSE(jumping.complete);
  EXPECT_THAT(jumping.partial_reason,
              HasSubstr("poses jump 1 times, besides their motion: first by 0.50 m"));
  // What nobody maps may jump; the last image is between the poses that it happens between.
  StampedPose earlier = before.front(), beyond = late.back();
  for (int i = 1; i < 4; ++i) {
    earlier.stamp_ns -= 10'000'000;
    if (i == 2) earlier.T_world_imu.translation.y() += 5;
    before.insert(before.begin(), earlier);
  }
  for (int i = 0; i < 2; ++i) {
    beyond.stamp_ns += 50'000'000;
    beyond.T_world_imu.translation.y() += i == 0 ? 5 : 0;
    late.push_back(beyond);
  }
  EXPECT_TRUE(RunAtPoses(folder_.Path(), {}, before).complete);
  EXPECT_FALSE(RunAtPoses(folder_.Path(), {}, late).complete);
}

TEST_F(SmallRecording, WithPosesOfAPartIsThatPartAndOfAnotherTimeNone) {
  Trajectory part = Poses();
  part.resize(4);
  const OdometryRun run = RunAtPoses(folder_.Path(), {}, part);
  EXPECT_EQ(run.states.size(), 4u);
  EXPECT_EQ(run.warnings.at(kImageWithoutPose), 3);
  EXPECT_THAT([&] { RunAtPoses(folder_.Path(), {}, Poses(3600'000'000'000)); },
              ThrowsMessage<DataError>(HasSubstr("expected poses at the images")));
}

TEST_F(SmallRecording, IsFoundFromAFolderNamedByARelativePath) {
  const auto here = std::filesystem::current_path();
  const std::filesystem::path folder(folder_.Path("mav0"));
  std::filesystem::current_path(folder);
  const OdometryRun run = RunAtPoses("..", {}, Poses());
  std::filesystem::current_path(here);
  EXPECT_FALSE(ViewsOfRun(run, "").images->Read(1).left.empty());
}

TEST_F(SmallRecording, HasAFrameForEachImageAtItsRefinedPose) {
  ASSERT_EQ(run_.keyframes.size(), 3u);
  // Moved up by 1 cm at the second keyframe: half as much half-way.
  run_.keyframes[1].T_world_imu.translation.z() += 0.01;
  run_.keyframes[2].T_world_imu.translation.z() += 0.01;
  const RecordedViews recorded = ViewsOfRun(run_, "");
  ASSERT_EQ(recorded.frames.size(), 7u);
  EXPECT_NEAR(recorded.frames[1].T_world_imu.translation.z(), 0.01 / 3, 1e-9);
  EXPECT_NEAR(recorded.frames[1].T_world_imu.translation.x(), 0.04, 1e-9);
  EXPECT_EQ(recorded.frames[3].T_world_imu.translation, recorded.views[1].T_world_imu.translation);
  EXPECT_NEAR(recorded.frames[5].T_world_imu.translation.z(), 0.01, 1e-9);
  // Finer, and of the same place: the image is that of the keyframe more than those beside it are.
  const cv::Mat of_view = recorded.images->Read(1).left;
  EXPECT_NEAR(recorded.frame_images->Read(3).left.cols, of_view.cols / RectifierOptions().scale, 4);
  const auto unlike = [&](size_t frame) {
    cv::Mat image;
    cv::resize(recorded.frame_images->Read(frame).left, image, of_view.size(), 0, 0,
               cv::INTER_AREA);
    return cv::norm(of_view, image, cv::NORM_L1);
  };
  EXPECT_LT(unlike(3), 0.9 * unlike(2));
  EXPECT_LT(unlike(3), 0.9 * unlike(4));
}

TEST_F(SmallRecording, HasNoFramesOfImagesThatAreNotThere) {
  Remove(1);
  Remove(3);  // of a keyframe
  const RecordedViews recorded = ViewsOfRun(run_, "");
  EXPECT_EQ(recorded.views.size(), 3u);
  ASSERT_EQ(recorded.frames.size(), 5u);
  for (size_t i = 0; i < recorded.frames.size(); ++i) {
    EXPECT_FALSE(recorded.frame_images->Read(i).left.empty());
  }
  EXPECT_TRUE(recorded.images->Read(1).left.empty());
  EXPECT_EQ(recorded.lost->paths().size(), 3u)
      << "each once: of one pair the left one alone was looked for";
}

TEST_F(SmallRecording, IsDecodedOnceForAllThatLookAtIt) {
  const auto cache = std::make_shared<ImageCache>();
  const cv::Mat first = KeyframeImages(run_, "", cache)->Read(1).left;
  const RecordedViews recorded = ViewsOfRun(run_, "", cache);
  Remove(3);
  const cv::Mat again = recorded.images->Read(1).left;
  ASSERT_EQ(again.size(), first.size());
  EXPECT_EQ(cv::norm(first, again, cv::NORM_INF), 0);
  EXPECT_FALSE(recorded.frame_images->Read(3).right.empty());
  EXPECT_THAT(recorded.lost->paths(), ::testing::IsEmpty());
}

TEST_F(SmallRecording, LosesNothingWhereARunHasNoRightImage) {
  for (StereoEntry& images : run_.source->images) images.right_path = "";
  const RecordedViews recorded = ViewsOfRun(run_, "");
  const StereoImage pair = recorded.images->Read(1);
  EXPECT_FALSE(pair.left.empty());
  EXPECT_TRUE(pair.right.empty());
  EXPECT_THAT(recorded.lost->paths(), ::testing::IsEmpty());
}

TEST_F(SmallRecording, HasViewsOfEachPairOfCameras) {
  Rig& rig = run_.source->raw_rig;
  rig.Resize(4);
  const RigidTransform& T_imu_left = rig.T_imu_camera[0];
  const RigidTransform about =
      T_imu_left * RigidTransform(ExpRotation({0, M_PI, 0}), {0, 0, -0.1}) * T_imu_left.Inverse();
  for (size_t i = 0; i < 2; ++i) {
    rig.cameras[i + 2] = rig.cameras[i];
    rig.T_imu_camera[i + 2] = about * rig.T_imu_camera[i];
  }
  for (StereoEntry& images : run_.source->images) {
    images.other_paths = {images.left_path, images.right_path};
  }
  run_.source->images[3].other_paths = {"", ""};  // of a keyframe
  const RecordedViews recorded = ViewsOfRun(run_, "");
  ASSERT_EQ(recorded.views.size(), 5u);
  ASSERT_EQ(recorded.frames.size(), 13u);
  const View &ahead = recorded.views[2], &back = recorded.views[4];
  EXPECT_EQ(back.left_camera, 2);
  EXPECT_EQ(back.stamp_ns, ahead.stamp_ns);
  const Rig& rectified = recorded.images->rig();
  EXPECT_LT((WorldFromCamera(ahead, rectified).rotation * Eigen::Vector3d::UnitZ())
                .dot(WorldFromCamera(back, rectified).rotation * Eigen::Vector3d::UnitZ()),
            -0.99);
  const StereoImage pair = recorded.images->Read(4);
  EXPECT_FALSE(pair.left.empty());
  EXPECT_FALSE(pair.right.empty());
  EXPECT_EQ(recorded.images->mask_of(4, 1).size(), pair.right.size());
  EXPECT_THAT(recorded.lost->paths(), ::testing::IsEmpty());
}

// Odometry knows the poses of its first keyframes only later than it tells its first state.
TEST_F(SmallRecording, HasFramesOfKeyframesWithoutAStateUpToTheLastKeyframe) {
  run_.states.erase(run_.states.begin(), run_.states.begin() + 2);
  const RecordedViews recorded = ViewsOfRun(run_, "");
  ASSERT_EQ(recorded.frames.size(), 6u);
  EXPECT_EQ(recorded.frames[0].stamp_ns, run_.keyframes[0].stamp_ns);
  EXPECT_EQ(recorded.frames[0].T_world_imu.translation, recorded.views[0].T_world_imu.translation);
  EXPECT_EQ(recorded.frames[1].stamp_ns, testing::ImageStamp(2));
  run_.keyframes.pop_back();
  const Views frames = ViewsOfRun(run_, "").frames;
  ASSERT_EQ(frames.size(), 3u);
  EXPECT_EQ(frames.back().stamp_ns, run_.keyframes.back().stamp_ns);
}

// Pixels of lines and points are those of images that were rectified with what the run has found.
TEST_F(SmallRecording, IsMappedWithTheCamerasOfItsImages) {
  CalibrationEstimate found;
  found.focal_length = 0.01;
  run_.calibration = {found};
  const RecordedViews recorded = ViewsOfRun(run_, "");
  const MapResult map = MapRun(run_, &recorded, {});
  const double fx_px = map.rectified_rig.cameras[0].fx_px;
  EXPECT_EQ(fx_px, recorded.images->rig().cameras[0].fx_px);
  EXPECT_NEAR(fx_px, 1.01 * run_.rectified_rig.cameras[0].fx_px, 0.1);
}

TEST(RealPairs, AreViewsAtTheirPoses) {
  const std::string folder = testing::SharedData("euroc_v1_01_pairs");
  if (folder.empty()) GTEST_SKIP() << "no euroc_v1_01_pairs";
  const OdometryRun run = RunAtPoses(folder, {}, ReadTrajectory(folder + "/poses.tum"));
  EXPECT_EQ(run.states.size(), 100u);
  EXPECT_GT(run.keyframes.size(), 80u);
  const RecordedViews recorded = ViewsOfRun(run, "");
  ASSERT_EQ(recorded.views.size(), run.keyframes.size());
  const StereoImage pair = recorded.images->Read(3);
  EXPECT_EQ(pair.left.cols, recorded.images->rig().cameras[0].width_px);
  EXPECT_EQ(pair.right.size(), pair.left.size());
  EXPECT_THAT(recorded.lost->paths(), ::testing::IsEmpty());
}

}  // namespace
}  // namespace slcmap
