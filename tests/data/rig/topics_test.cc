#include "data/rig/topics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "data/bag/messages.h"
#include "data/core/error.h"
#include "data/rig/profile.h"
#include "tests/data/rig/made_rig_bag.h"
#include "tests/testing/caught.h"
#include "tests/testing/shared_data.h"

namespace slcmap {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::MadeRigBag;
using testing::TempFolder;

std::string Refusal(Bag* bag, const RecordingTopics& said) {
  try {
    ChooseTopics(bag, said);
  } catch (const Error& error) {
    return error.what();
  }
  return "nothing";
}

// A bag with images and IMU samples of these names.
std::unique_ptr<Bag> BagOf(const std::vector<std::string>& images,
                           const std::vector<std::string>& imus, const cv::Size& size = {64, 48}) {
  MadeRigBag bag;
  for (const std::string& name : images) bag.AddImage(name, size);
  for (const std::string& name : imus) bag.AddImu(name);
  return bag.Open();
}

TEST(ChooseTopics, SaysWhatIsThereWhereNoneOrSeveralCouldBeIt) {
  const auto many =
      BagOf({"/a/left/image", "/a/right/image", "/b/left/image", "/b/right/image"}, {"/imu"});
  EXPECT_THAT(Refusal(many.get(), {}), HasSubstr("4 topics of images, 2 pairs"));
  EXPECT_THAT(Refusal(many.get(), {}), HasSubstr("/b/right/image (sensor_msgs/Image, 1)"));
  EXPECT_EQ(ChooseTopics(many.get(), ParseTopics("left=/b/left/image,right=/b/right/image")).gyro,
            "/imu");
  EXPECT_THAT(Refusal(many.get(), ParseTopics("left=/imu")), HasSubstr("a sensor_msgs/Imu"));
  EXPECT_THAT(Refusal(many.get(), ParseTopics("left=/c")), HasSubstr("/c, which is not in"));
  EXPECT_THAT(Refusal(BagOf({"/a/image"}, {}).get(), {}), HasSubstr("no topic of an IMU"));
  EXPECT_THAT(Refusal(BagOf({}, {"/imu"}).get(), {}), HasSubstr("no topic of images"));
}

TEST(ChooseTopics, OneCameraMayBeCompressed) {
  const auto one = BagOf({"/cam/image_raw/compressed"}, {"/imu"});
  EXPECT_EQ(TopicsText(ChooseTopics(one.get(), {})), "left=/cam/image_raw/compressed,imu=/imu");
}

TEST(ChooseTopics, OfABagThatIsCutOffSaysSo) {
  const TempFolder folder;
  const auto writer = CreateBag(folder.Path("walk.mcap"), {"mcap", "none"});
  const uint32_t topic = writer->AddTopic({"/imu", RosImu::kType, BagEncoding::kCdr, "cdr"});
  for (int i = 0; i < 20; ++i) {
    writer->Write(topic, i, EncodeMessage(BagEncoding::kCdr, RosImu()));
  }
  writer->Close();
  std::filesystem::resize_file(folder.Path("walk.mcap"), 4000);
  const auto bag = OpenBag(folder.Path("walk.mcap"));
  const auto fault = testing::Caught<InputFault>([&] { ChooseTopics(bag.get(), {}); });
  EXPECT_THAT(fault.what(), HasSubstr("and that the bag is cut off"));
  EXPECT_THAT(fault.remedy(), HasSubstr("copy the bag again"));
}

TEST(ParseTopics, RefusesWhatItDoesNotKnow) {
  EXPECT_EQ(ParseTopics("imu=/i").accel, "/i");
  for (const char* text : {"left", "middle=/a", "left=", "right=/a", "gyro=/g", "left=/a,left=/b",
                           "left=/a,right=/a"}) {
    EXPECT_THROW(ParseTopics(text), ConfigError) << text;
  }
}

TEST(ParseTopics, ReadsWhatTopicsTextWrites) {
  for (const char* text : {"left=/a,right=/b,imu=/c", "left=/a,imu=/c", "left=/a,gyro=/c,accel=/d",
                           "left=/a,right=/b", "left=/a,right=/b,other=/e,other=/f"}) {
    EXPECT_EQ(TopicsText(ParseTopics(text)), text);
  }
}

// Of what there is beside a rig's images and samples nothing is taken. Each profile's own topics
// are chosen of the bags that simulator/rig_bag makes of it.
TEST(KnownRig, IsToldByItsTopicsAmongOthers) {
  const struct {
    const char* profile;
    cv::Size size;
    std::vector<std::string> images, imus;
    const char* chosen;
  } kRigs[] = {
      {"realsense",
       {640, 480},
       {"/camera/infra1/image_rect_raw", "/camera/infra2/image_rect_raw", "/camera/color/image_raw",
        "/camera/depth/image_rect_raw"},
       {"/camera/gyro/sample", "/camera/accel/sample"},
       "left=/camera/infra1/image_rect_raw,right=/camera/infra2/image_rect_raw,"
       "gyro=/camera/gyro/sample,accel=/camera/accel/sample"},
      {"realsense",
       {640, 480},
       {"/camera/camera/infra1/image_rect_raw", "/camera/camera/infra2/image_rect_raw"},
       {"/camera/camera/imu", "/camera/camera/gyro/sample", "/camera/camera/accel/sample"},
       "left=/camera/camera/infra1/image_rect_raw,right=/camera/camera/infra2/image_rect_raw,"
       "imu=/camera/camera/imu"},
      {"realsense_viewer",
       {640, 480},
       {"/device_0/sensor_0/Infrared_1/image/data", "/device_0/sensor_0/Infrared_2/image/data",
        "/device_0/sensor_0/Depth_0/image/data"},
       {"/device_0/sensor_2/Gyro_0/imu/data", "/device_0/sensor_2/Accel_0/imu/data"},
       "left=/device_0/sensor_0/Infrared_1/image/data,"
       "right=/device_0/sensor_0/Infrared_2/image/data,"
       "gyro=/device_0/sensor_2/Gyro_0/imu/data,accel=/device_0/sensor_2/Accel_0/imu/data"},
      {"openloris",
       {848, 800},
       {"/t265/fisheye1/image_raw", "/t265/fisheye2/image_raw", "/d400/color/image_raw"},
       {"/t265/gyro/sample", "/t265/accel/sample", "/d400/gyro/sample", "/d400/accel/sample"},
       "left=/t265/fisheye1/image_raw,right=/t265/fisheye2/image_raw,gyro=/t265/gyro/sample,"
       "accel=/t265/accel/sample"},
      {"zed",
       {640, 480},
       {"/zed2/zed_node/left/image_rect_gray", "/zed2/zed_node/right/image_rect_gray",
        "/zed2/zed_node/left/image_rect_color", "/zed2/zed_node/right/image_rect_color"},
       {"/zed2/zed_node/imu/data", "/zed2/zed_node/imu/data_raw"},
       "left=/zed2/zed_node/left/image_rect_gray,right=/zed2/zed_node/right/image_rect_gray,"
       "imu=/zed2/zed_node/imu/data"},
      {"oak_d",
       {640, 400},
       {"/oak/left/image_raw", "/oak/left/image_raw/compressed", "/oak/right/image_raw",
        "/oak/right/image_raw/compressed", "/oak/rgb/image_raw"},
       {"/oak/imu/data"},
       "left=/oak/left/image_raw,right=/oak/right/image_raw,imu=/oak/imu/data"},
      {"mynt_eye",
       {752, 480},
       {"/mynteye/left/image_raw", "/mynteye/right/image_raw", "/mynteye/left_rect/image_rect"},
       {"/mynteye/imu/data_raw"},
       "left=/mynteye/left/image_raw,right=/mynteye/right/image_raw,imu=/mynteye/imu/data_raw"},
      {"uzh_fpv",
       {640, 480},
       {"/snappy_cam/stereo_l", "/snappy_cam/stereo_r", "/dvs/image_raw"},
       {"/snappy_imu", "/dvs/imu"},
       "left=/snappy_cam/stereo_l,right=/snappy_cam/stereo_r,imu=/snappy_imu"},
      {"m2dgr",
       {1280, 1024},
       {"/camera/left/image_raw/compressed", "/camera/right/image_raw/compressed",
        "/camera/head/image_raw/compressed"},
       {"/handsfree/imu", "/camera/imu"},
       "left=/camera/left/image_raw/compressed,right=/camera/right/image_raw/compressed,"
       "imu=/handsfree/imu"}};
  for (const auto& rig : kRigs) {
    const RecordingTopics topics = ChooseTopics(BagOf(rig.images, rig.imus, rig.size).get(), {});
    EXPECT_EQ(topics.profile, rig.profile);
    RecordingTopics pair = topics;
    pair.others.clear();
    EXPECT_EQ(TopicsText(pair), rig.chosen);
    ASSERT_FALSE(topics.reasons.empty());
    EXPECT_THAT(topics.reasons.front(), HasSubstr(topics.left + " is the "));
    EXPECT_THAT(topics.reasons.front(), HasSubstr(std::string("profile ") + rig.profile));
  }
}

TEST(ProfiledTopics, TwoKnownRigsAreListedAndOneOfThemIsNamed) {
  MadeRigBag bag;
  for (const std::string robot : {"/a", "/b"}) {
    bag.AddImage(robot + "/forward/infra1/image_rect_raw", {64, 48});
    bag.AddImage(robot + "/forward/infra2/image_rect_raw", {64, 48});
    bag.AddImu(robot + "/forward/imu");
  }
  const auto opened = bag.Open();
  EXPECT_THAT(Refusal(opened.get(), {}),
              HasSubstr("2 rigs that are known, by their left cameras "
                        "/a/forward/infra1/image_rect_raw (kimera_multi), /b/forward"));
  const RecordingTopics said = ParseTopics("imu=/b/forward/imu");
  const RecordingTopics chosen = ChooseTopics(opened.get(), said);
  EXPECT_EQ(chosen.right, "/b/forward/infra2/image_rect_raw");
  EXPECT_THAT(chosen.reasons[2], HasSubstr("/b/forward/imu is the IMU: named with --topics"));
  const RecordingTopics one =
      ChooseTopics(opened.get(), ParseTopics("left=/b/forward/infra1/image_rect_raw"));
  EXPECT_EQ(one.right, "");
  EXPECT_EQ(one.gyro, "/b/forward/imu");
}

TEST(ProfiledTopics, ImagesOfOtherSizesAndDepthsAreNoPair) {
  MadeRigBag bag;
  bag.AddImage("/rig/image0", {64, 48});
  bag.AddImage("/rig/image1", {32, 24});
  bag.AddImage("/rig/other_left", {64, 48});
  bag.AddImage("/rig/other_right", {64, 48});
  bag.AddImage("/rig/far_left", {64, 48}, "", "16UC1");
  bag.AddImage("/rig/far_right", {64, 48});
  bag.AddImu("/rig/imu");
  const RecordingTopics topics = ChooseTopics(bag.Open().get(), {});
  EXPECT_EQ(topics.profile, "");
  EXPECT_EQ(topics.left, "/rig/other_left");
  EXPECT_EQ(TopicsText(topics), "left=/rig/other_left,right=/rig/other_right,imu=/rig/imu");
  EXPECT_THAT(topics.reasons,
              ElementsAre(HasSubstr("whose names differ"), HasSubstr("/rig/other_r"),
                          HasSubstr("the only topic of an IMU")));
}

TEST(ProfiledTopics, FurtherCamerasAreThoseOfOtherNumbers) {
  MadeRigBag bag;
  for (const char* name :
       {"/head/cam0/image", "/head/cam1/image", "/head/cam2/image", "/head/cam10/image"}) {
    bag.AddImage(name, {64, 48});
  }
  bag.AddImage("/head/cam3/image", {32, 24});
  bag.AddImu("/imu");
  const auto opened = bag.Open();
  const std::string all =
      "left=/head/cam0/image,right=/head/cam1/image,other=/head/cam2/image,"
      "other=/head/cam10/image,imu=/imu";
  EXPECT_EQ(TopicsText(ChooseTopics(opened.get(), {})), all);
  EXPECT_EQ(TopicsText(ChooseTopics(opened.get(), ParseTopics(all))), all);
  const RecordingTopics two =
      ChooseTopics(opened.get(), ParseTopics("left=/head/cam0/image,right=/head/cam2/image"));
  EXPECT_EQ(TopicsText(two), "left=/head/cam0/image,right=/head/cam2/image,imu=/imu");
}

TEST(ProfiledTopics, WithoutAnImuTheyMayBeChosenAllTheSame) {
  const RecordingTopics topics = ChooseTopics(BagOf({"/cam0/image_raw"}, {}).get(), {}, false);
  EXPECT_EQ(topics.left, "/cam0/image_raw");
  EXPECT_EQ(topics.gyro, "");
}

// None of them is of a stereo rig with an IMU; one has a camera's colour and depth.
TEST(ProfiledTopics, GenuineBagsAreRefusedWithWhatIsInThem) {
  const std::string shared = testing::SharedData("bags");
  if (shared.empty()) GTEST_SKIP() << "no bags of others are here";
  int bags = 0;
  for (const auto& entry : std::filesystem::directory_iterator(shared)) {
    const std::string path = entry.path().string();
    const std::string extension = entry.path().extension().string();
    if (!entry.is_regular_file() || extension == ".yaml" || !IsBag(path)) continue;
    ++bags;
    const auto bag = OpenBag(path);
    EXPECT_THAT(Refusal(bag.get(), {}), HasSubstr("expected one rig's; there are ")) << path;
  }
  EXPECT_GT(bags, 10);
  const auto camera = OpenBag(shared + "/realsense_depth_color_lz4.bag");
  EXPECT_THAT(Refusal(camera.get(), {}), HasSubstr("found no topic of an IMU"));
  EXPECT_THAT(Refusal(camera.get(), {}), HasSubstr(" of other kinds"));
}

TEST(RigProfile, RefusesWhatItDoesNotKnow) {
  const TempFolder folder;
  const auto refusal = [&](const std::string& text) {
    const std::string path = folder.Write("a.yaml", text);
    return testing::MessageOf<Error>([&] { ReadProfile(path); });
  };
  const std::string topics = "topics:\n  - {left: /l, imu: /i}\n";
  EXPECT_EQ(refusal(topics), "");
  EXPECT_THAT(refusal(topics + "offset: 3\n"), HasSubstr("offset: unknown key"));
  EXPECT_THAT(refusal("rig: a\n"), HasSubstr("topics: missing"));
  EXPECT_THAT(refusal("topics:\n  - {right: /r, imu: /i}\n"), HasSubstr("without left"));
  EXPECT_THAT(refusal(topics + "images: blue\n"), HasSubstr("expected rectified or raw"));
  EXPECT_THAT(refusal(topics + "imu_noise: {gyroscope_noise_density: 1}\n"),
              HasSubstr("gyroscope_random_walk: missing"));
}

}  // namespace
}  // namespace slcmap
