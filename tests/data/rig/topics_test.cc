#include "data/rig/topics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "data/bag/messages.h"
#include "data/core/error.h"
#include "data/rig/profile.h"
#include "tests/data/rig/made_rig_bag.h"
#include "tests/testing/shared_data.h"

namespace slcmap {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::MadeRigBag;
using testing::TempFolder;

using Topics = std::vector<std::pair<std::string, std::string>>;

// A bag with these topics and one message of each.
class MadeTopicsBag {
 public:
  explicit MadeTopicsBag(const Topics& topics) {
    const auto writer = CreateBag(folder_.Path("made.mcap"), {});
    for (const auto& [name, type] : topics) {
      const uint32_t topic = writer->AddTopic({name, type, BagEncoding::kCdr, "cdr"});
      RosImu imu;
      imu.stamp_ns = 1'000'000'000;
      writer->Write(topic, imu.stamp_ns, EncodeMessage(BagEncoding::kCdr, imu));
    }
    writer->Close();
    bag_ = OpenBag(folder_.Path("made.mcap"));
  }
  Bag* bag() const { return bag_.get(); }

 private:
  TempFolder folder_;
  std::unique_ptr<Bag> bag_;
};

constexpr const char *kImage = RosImage::kType, *kPacked = RosCompressedImage::kType,
                     *kImu = RosImu::kType;

TEST(ChooseTopics, TakesTheOnePairByItsNamesAndBothHalvesOfAnImu) {
  const MadeTopicsBag realsense({{"/camera/infra1/image_rect_raw", kImage},
                                 {"/camera/infra2/image_rect_raw", kImage},
                                 {"/camera/color/image_raw", kImage},
                                 {"/camera/gyro/sample", kImu},
                                 {"/camera/accel/sample", kImu}});
  const RecordingTopics topics = ChooseTopics(realsense.bag(), {});
  EXPECT_EQ(topics.left, "/camera/infra1/image_rect_raw");
  EXPECT_EQ(topics.right, "/camera/infra2/image_rect_raw");
  EXPECT_EQ(topics.gyro, "/camera/gyro/sample");
  EXPECT_EQ(topics.accel, "/camera/accel/sample");

  const MadeTopicsBag packed({{"/oak/left/image_raw", kImage},
                              {"/oak/left/image_raw/compressed", kPacked},
                              {"/oak/right/image_raw", kImage},
                              {"/oak/right/image_raw/compressed", kPacked},
                              {"/oak/imu/data", kImu}});
  EXPECT_EQ(ChooseTopics(packed.bag(), {}).right, "/oak/right/image_raw");

  const MadeTopicsBag one({{"/cam/image_raw/compressed", kPacked}, {"/imu", kImu}});
  EXPECT_EQ(ChooseTopics(one.bag(), {}).left, "/cam/image_raw/compressed");
  EXPECT_EQ(ChooseTopics(one.bag(), {}).right, "");
}

std::string Refusal(Bag* bag, const RecordingTopics& said) {
  try {
    ChooseTopics(bag, said);
  } catch (const Error& error) {
    return error.what();
  }
  return "nothing";
}

TEST(ChooseTopics, SaysWhatIsThereWhereNoneOrSeveralCouldBeIt) {
  const MadeTopicsBag many({{"/a/left/image", kImage},
                            {"/a/right/image", kImage},
                            {"/b/left/image", kImage},
                            {"/b/right/image", kImage},
                            {"/imu", kImu}});
  EXPECT_THAT(Refusal(many.bag(), {}), HasSubstr("4 topics of images, 2 pairs"));
  EXPECT_THAT(Refusal(many.bag(), {}), HasSubstr("/b/right/image (sensor_msgs/Image, 1)"));
  EXPECT_EQ(ChooseTopics(many.bag(), ParseTopics("left=/b/left/image,right=/b/right/image")).gyro,
            "/imu");
  EXPECT_THAT(Refusal(many.bag(), ParseTopics("left=/imu")), HasSubstr("a sensor_msgs/Imu"));
  EXPECT_THAT(Refusal(many.bag(), ParseTopics("left=/c")), HasSubstr("/c, which is not in"));
  const MadeTopicsBag no_imu(Topics{{"/a/image", kImage}});
  EXPECT_THAT(Refusal(no_imu.bag(), {}), HasSubstr("no topic of an IMU"));
  const MadeTopicsBag no_images(Topics{{"/imu", kImu}});
  EXPECT_THAT(Refusal(no_images.bag(), {}), HasSubstr("no topic of images"));
}

TEST(ChooseTopics, OfABagThatIsCutOffSaysSo) {
  const TempFolder folder;
  const auto writer = CreateBag(folder.Path("walk.mcap"), {"mcap", "none"});
  const uint32_t topic = writer->AddTopic({"/imu", kImu, BagEncoding::kCdr, "cdr"});
  for (int i = 0; i < 20; ++i) {
    writer->Write(topic, i, EncodeMessage(BagEncoding::kCdr, RosImu()));
  }
  writer->Close();
  std::filesystem::resize_file(folder.Path("walk.mcap"), 4000);
  const auto bag = OpenBag(folder.Path("walk.mcap"));
  try {
    ChooseTopics(bag.get(), {});
    FAIL();
  } catch (const InputFault& fault) {
    EXPECT_THAT(fault.what(), HasSubstr("and that the bag is cut off"));
    EXPECT_THAT(fault.remedy(), HasSubstr("copy the bag again"));
  }
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

// A recording of a rig and what is to be chosen of it.
struct ProfileCase {
  const char* profile;
  cv::Size size;
  std::vector<std::string> images, imus;
  RecordingTopics expected;
};

std::vector<ProfileCase> ProfileCases() {
  const cv::Size vga(640, 480), wide(752, 480);
  return {
      {"realsense",
       vga,
       {"/camera/infra1/image_rect_raw", "/camera/infra2/image_rect_raw", "/camera/color/image_raw",
        "/camera/depth/image_rect_raw"},
       {"/camera/gyro/sample", "/camera/accel/sample"},
       {"/camera/infra1/image_rect_raw", "/camera/infra2/image_rect_raw", "/camera/gyro/sample",
        "/camera/accel/sample"}},
      {"realsense",
       vga,
       {"/camera/camera/infra1/image_rect_raw", "/camera/camera/infra2/image_rect_raw"},
       {"/camera/camera/imu", "/camera/camera/gyro/sample", "/camera/camera/accel/sample"},
       {"/camera/camera/infra1/image_rect_raw", "/camera/camera/infra2/image_rect_raw",
        "/camera/camera/imu", "/camera/camera/imu"}},
      {"kimera_multi",
       vga,
       {"/thoth/forward/infra1/image_rect_raw/compressed",
        "/thoth/forward/infra2/image_rect_raw/compressed"},
       {"/thoth/forward/imu"},
       {"/thoth/forward/infra1/image_rect_raw/compressed",
        "/thoth/forward/infra2/image_rect_raw/compressed", "/thoth/forward/imu",
        "/thoth/forward/imu"}},
      {"realsense_viewer",
       vga,
       {"/device_0/sensor_0/Infrared_1/image/data", "/device_0/sensor_0/Infrared_2/image/data",
        "/device_0/sensor_0/Depth_0/image/data"},
       {"/device_0/sensor_2/Gyro_0/imu/data", "/device_0/sensor_2/Accel_0/imu/data"},
       {"/device_0/sensor_0/Infrared_1/image/data", "/device_0/sensor_0/Infrared_2/image/data",
        "/device_0/sensor_2/Gyro_0/imu/data", "/device_0/sensor_2/Accel_0/imu/data"}},
      {"t265",
       {848, 800},
       {"/camera/fisheye1/image_raw", "/camera/fisheye2/image_raw"},
       {"/camera/gyro/sample", "/camera/accel/sample"},
       {"/camera/fisheye1/image_raw", "/camera/fisheye2/image_raw", "/camera/gyro/sample",
        "/camera/accel/sample"}},
      {"openloris",
       {848, 800},
       {"/t265/fisheye1/image_raw", "/t265/fisheye2/image_raw", "/d400/color/image_raw"},
       {"/t265/gyro/sample", "/t265/accel/sample", "/d400/gyro/sample", "/d400/accel/sample"},
       {"/t265/fisheye1/image_raw", "/t265/fisheye2/image_raw", "/t265/gyro/sample",
        "/t265/accel/sample"}},
      {"zed",
       vga,
       {"/zed2/zed_node/left/image_rect_gray", "/zed2/zed_node/right/image_rect_gray",
        "/zed2/zed_node/left/image_rect_color", "/zed2/zed_node/right/image_rect_color"},
       {"/zed2/zed_node/imu/data", "/zed2/zed_node/imu/data_raw"},
       {"/zed2/zed_node/left/image_rect_gray", "/zed2/zed_node/right/image_rect_gray",
        "/zed2/zed_node/imu/data", "/zed2/zed_node/imu/data"}},
      {"zed_5",
       vga,
       {"/zed/zed_node/left/color/raw/image", "/zed/zed_node/right/color/raw/image"},
       {"/zed/zed_node/imu/data"},
       {"/zed/zed_node/left/color/raw/image", "/zed/zed_node/right/color/raw/image",
        "/zed/zed_node/imu/data", "/zed/zed_node/imu/data"}},
      {"oak_d",
       {640, 400},
       {"/oak/left/image_raw", "/oak/right/image_raw", "/oak/rgb/image_raw"},
       {"/oak/imu/data"},
       {"/oak/left/image_raw", "/oak/right/image_raw", "/oak/imu/data", "/oak/imu/data"}},
      {"mynt_eye",
       wide,
       {"/mynteye/left/image_raw", "/mynteye/right/image_raw", "/mynteye/left_rect/image_rect"},
       {"/mynteye/imu/data_raw"},
       {"/mynteye/left/image_raw", "/mynteye/right/image_raw", "/mynteye/imu/data_raw",
        "/mynteye/imu/data_raw"}},
      {"euroc",
       wide,
       {"/cam0/image_raw", "/cam1/image_raw"},
       {"/imu0"},
       {"/cam0/image_raw", "/cam1/image_raw", "/imu0", "/imu0"}},
      {"tum_vi",
       {512, 512},
       {"/cam0/image_raw", "/cam1/image_raw"},
       {"/imu0"},
       {"/cam0/image_raw", "/cam1/image_raw", "/imu0", "/imu0"}},
      {"vi_sensor",
       vga,
       {"/cam0/image_raw", "/cam1/image_raw"},
       {"/imu0"},
       {"/cam0/image_raw", "/cam1/image_raw", "/imu0", "/imu0"}},
      {"uzh_fpv",
       vga,
       {"/snappy_cam/stereo_l", "/snappy_cam/stereo_r", "/dvs/image_raw"},
       {"/snappy_imu", "/dvs/imu"},
       {"/snappy_cam/stereo_l", "/snappy_cam/stereo_r", "/snappy_imu", "/snappy_imu"}},
      {"ntu_viral",
       wide,
       {"/left/image_raw", "/right/image_raw"},
       {"/imu/imu", "/os1_cloud_node1/imu"},
       {"/left/image_raw", "/right/image_raw", "/imu/imu", "/imu/imu"}},
      {"hilti_2022",
       {720, 540},
       {"/alphasense/cam0/image_raw", "/alphasense/cam1/image_raw", "/alphasense/cam2/image_raw",
        "/alphasense/cam3/image_raw", "/alphasense/cam4/image_raw"},
       {"/alphasense/imu"},
       {"/alphasense/cam0/image_raw", "/alphasense/cam1/image_raw", "/alphasense/imu",
        "/alphasense/imu"}},
      {"hilti_trimble_2026",
       {1472, 1440},
       {"/cam0/image_raw/compressed", "/cam1/image_raw/compressed"},
       {"/imu/data_raw"},
       {"/cam0/image_raw/compressed", "/cam1/image_raw/compressed", "/imu/data_raw",
        "/imu/data_raw"}},
      {"m2dgr",
       {1280, 1024},
       {"/camera/left/image_raw/compressed", "/camera/right/image_raw/compressed",
        "/camera/head/image_raw/compressed"},
       {"/handsfree/imu", "/camera/imu"},
       {"/camera/left/image_raw/compressed", "/camera/right/image_raw/compressed", "/handsfree/imu",
        "/handsfree/imu"}},
      {"newer_college",
       {720, 540},
       {"/alphasense_driver_ros/cam0/compressed", "/alphasense_driver_ros/cam1/compressed",
        "/alphasense_driver_ros/cam3/compressed"},
       {"/alphasense_driver_ros/imu", "/os_cloud_node/imu"},
       {"/alphasense_driver_ros/cam0/compressed", "/alphasense_driver_ros/cam1/compressed",
        "/alphasense_driver_ros/imu", "/alphasense_driver_ros/imu"}},
      {"fusion_portable",
       {1024, 768},
       {"/stereo/frame_left/image_raw/compressed", "/stereo/frame_right/image_raw/compressed"},
       {"/stim300/imu/data_raw", "/os_cloud_node/imu"},
       {"/stereo/frame_left/image_raw/compressed", "/stereo/frame_right/image_raw/compressed",
        "/stim300/imu/data_raw", "/stim300/imu/data_raw"}}};
}

class KnownRig : public ::testing::TestWithParam<ProfileCase> {};

TEST_P(KnownRig, IsToldByItsTopics) {
  const ProfileCase& made = GetParam();
  MadeRigBag bag;
  for (const std::string& name : made.images) bag.AddImage(name, made.size);
  for (const std::string& name : made.imus) bag.AddImu(name);
  const RecordingTopics topics = ChooseTopics(bag.Open().get(), {});
  EXPECT_EQ(topics.profile, made.profile);
  EXPECT_EQ(topics.left, made.expected.left);
  EXPECT_EQ(topics.right, made.expected.right);
  EXPECT_EQ(topics.gyro, made.expected.gyro);
  EXPECT_EQ(topics.accel, made.expected.accel);
  ASSERT_FALSE(topics.reasons.empty());
  EXPECT_THAT(topics.reasons.front(), HasSubstr(topics.left + " is the "));
  EXPECT_THAT(topics.reasons.front(), HasSubstr(std::string("profile ") + made.profile));
}

INSTANTIATE_TEST_SUITE_P(All, KnownRig, ::testing::ValuesIn(ProfileCases()), [](const auto& test) {
  return test.param.profile + std::to_string(test.index);
});

TEST(ProfiledTopics, EachProfileHasACase) {
  std::set<std::string> with_case;
  for (const ProfileCase& made : ProfileCases()) with_case.insert(made.profile);
  for (const auto& [name, profile] : KnownProfiles()) EXPECT_EQ(with_case.count(name), 1u) << name;
  EXPECT_EQ(KnownProfiles().size(), with_case.size());
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
  MadeRigBag bag;
  bag.AddImage("/cam0/image_raw", {64, 48});
  const RecordingTopics topics = ChooseTopics(bag.Open().get(), {}, false);
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
