#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "data/calibration/camera_words.h"
#include "data/core/error.h"
#include "tests/testing/pinhole_camera.h"

namespace slcmap {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

// A camera of the IMU's orientation, turned about y, beside the IMU.
ChainCamera At(int index, double x_m, double turn_rad) {
  return {index,
          testing::PinholeCamera(640, 480, 400, 319.5, 239.5),
          {ExpRotation({0, turn_rad, 0}), {x_m, 0, 0}},
          std::nullopt,
          "chain"};
}

TEST(CameraChoice, ThoseThatSeeTheSameFromTwoPlaces) {
  // Two that look ahead, one to each side and one behind.
  const std::vector<ChainCamera> chain = {At(0, 0, 1.6), At(1, 0, 0), At(2, 0.11, 0),
                                          At(3, 0.1, -1.6), At(4, 0, 3.1)};
  EXPECT_THAT(ChooseCameras(chain, {}), ElementsAre(1, 2));
  EXPECT_THAT(ChooseCameras(chain, {3, 1}), ElementsAre(3, 1));
  EXPECT_THAT(ChooseCameras(chain, {4}), ElementsAre(4));
}

TEST(CameraChoice, TheFirstTwoAreTakenOfManyAlike) {
  EXPECT_THAT(ChooseCameras({At(0, 0, 0), At(1, 0.1, 0), At(2, 0.2, 0)}, {}), ElementsAre(0, 1));
}

TEST(CameraChoice, OneAloneWhereNoTwoSeeTheSame) {
  EXPECT_THAT(ChooseCameras({At(0, 0, 0), At(1, 0.1, 2), At(2, 0.1, -2)}, {}), ElementsAre(0));
}

TEST(CameraChoice, NotThoseThatCannotBeRectified) {
  // One before the other, and wide lenses at right angles.
  std::vector<ChainCamera> chain = {At(0, 0, 0), At(1, 0, 0), At(2, 0.06, 0), At(3, 0.2, 1.3)};
  chain[1].T_imu_camera.translation.z() = 0.2;
  EXPECT_THAT(ChooseCameras(chain, {}), ElementsAre(0, 2));
}

TEST(CameraChoice, OneAboveTheOtherIsAPairToo) {
  std::vector<ChainCamera> chain = {At(0, 0, 1.6), At(1, 0, 0), At(2, 0, 0)};
  chain[2].T_imu_camera.translation.y() = -0.1;
  EXPECT_THAT(ChooseCameras(chain, {}), ElementsAre(1, 2));
}

TEST(CameraChoice, RefusesCamerasThatAreNotThere) {
  const std::vector<ChainCamera> chain = {At(0, 0, 0), At(1, 0.1, 0)};
  for (const std::vector<int>& wanted : {std::vector<int>{0, 2}, {1, 1}, {0, 1, 0}}) {
    EXPECT_THAT(
        [&] { ChooseCameras(chain, wanted); },
        ThrowsMessage<DataError>(HasSubstr("expected one or two different ones of cam0 cam1")));
  }
}

}  // namespace
}  // namespace slcmap
