#include "export/web/page_writer.h"

#include <gmock/gmock.h>
#include <zlib.h>

#include <cstring>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <random>

#include "data/core/error.h"
#include "tests/export/web/room_map.h"
#include "tests/testing/forward_rig.h"
#include "tests/testing/memory_source.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;
using slcmap::testing::MakeRoomMap;
using ::testing::HasSubstr;
using testing::MemorySource;
using testing::MessageOf;

// What PackForPage wrote, taken apart by its description.
struct Pack {
  nlohmann::json document;
  std::string arrays;

  template <typename Value>
  std::vector<Value> Get(const std::string& name) const {
    const nlohmann::json& entry = document.at("arrays").at(name);
    std::vector<Value> values(entry.at("count").get<std::size_t>());
    std::memcpy(values.data(), arrays.data() + entry.at("offset").get<std::size_t>(),
                values.size() * sizeof(Value));
    return values;
  }
};

Pack Unpack(const std::string& block) {
  uint32_t length = 0;
  std::memcpy(&length, block.data(), sizeof length);
  return {nlohmann::json::parse(block.substr(sizeof length, length)),
          block.substr(sizeof length + length)};
}

Pack PackOf(const MapResult& map) { return Unpack(PackForPage(map, "title")); }

Vector3d GetOrigin(const Pack& pack) {
  const auto origin = pack.document.at("origin").get<std::vector<double>>();
  return {origin[0], origin[1], origin[2]};
}

TEST(PackForPage, LinesComeBackWithAllThatIsKnownOfThem) {
  const MapResult map = MakeRoomMap();
  const Pack pack = PackOf(map);
  const auto ends = pack.Get<float>("line_ends");
  ASSERT_EQ(ends.size(), 6 * (map.lines.size() + map.marks.size()));
  for (std::size_t i = 0; i < map.lines.size(); ++i) {
    const Vector3d start(ends[6 * i], ends[6 * i + 1], ends[6 * i + 2]);
    EXPECT_LT((start + GetOrigin(pack) - map.lines[i].start_world).norm(), 1e-6);
    EXPECT_EQ(pack.Get<double>("line_id")[i], static_cast<double>(map.lines[i].id));
    EXPECT_EQ(pack.Get<uint8_t>("line_axis")[i], static_cast<uint8_t>(map.lines[i].axis));
    EXPECT_EQ(pack.Get<int32_t>("line_world")[i], map.lines[i].world);
    EXPECT_EQ(pack.Get<int32_t>("line_observations")[i], 7);
    EXPECT_NEAR(pack.Get<float>("line_sigma")[i], 0.003, 1e-8);
  }
  EXPECT_EQ(pack.document.at("marks"), 1);
  EXPECT_EQ(pack.Get<uint8_t>("line_kind").back(), static_cast<uint8_t>(LineKind::kMark));
  // Arrays begin where their types may.
  EXPECT_EQ((PackForPage(map, "title").size() - pack.arrays.size()) % 8, 0u);
  for (const nlohmann::json& entry : pack.document.at("arrays")) {
    EXPECT_EQ(entry.at("offset").get<std::size_t>() % 8, 0u);
  }
  EXPECT_EQ(PackOf({}).Get<float>("line_ends").size(), 0u);
}

TEST(PackForPage, PipesComeBackWithTheirRadius) {
  MapResult map = MakeRoomMap();
  EXPECT_TRUE(PackOf(map).Get<float>("pipes").empty());
  MapPipe pipe;
  pipe.start_world = {101, 202, 0};
  pipe.end_world = {101, 202, 2.5};
  pipe.radius_m = 0.06;
  pipe.sigma_m = 0.002;
  pipe.radius_sigma_m = 0.001;
  map.pipes = {pipe};
  const Pack pack = PackOf(map);
  const auto pipes = pack.Get<float>("pipes");
  ASSERT_EQ(pipes.size(), 9u);
  const Vector3d end(pipes[3], pipes[4], pipes[5]);
  EXPECT_LT((end + GetOrigin(pack) - pipe.end_world).norm(), 1e-5);
  EXPECT_NEAR(pipes[6], 0.06, 1e-7);
  EXPECT_NEAR(pipes[7], 0.002, 1e-8);
  EXPECT_NEAR(pipes[8], 0.001, 1e-8);
}

// Across several chunks, one of them below the origin.
TEST(PackForPage, DensePointsComeBackToHalfAMillimetre) {
  MapResult map = MakeRoomMap({.lines = 12, .dense_points = 500});
  for (int i = 0; i < 100; ++i) {
    (i % 2 == 0 ? map.dense : map.filled)
        .push_back({Vector3d(90.0 - i, 203.0 + i, 0.5), Vector3d::UnitZ(), 0.003, 77});
  }
  const Pack pack = PackOf(map);
  const auto x = pack.Get<uint16_t>("dense_x"), y = pack.Get<uint16_t>("dense_y"),
             z = pack.Get<uint16_t>("dense_z");
  const auto source = pack.Get<uint8_t>("dense_source");
  ASSERT_EQ(x.size(), CountDense(map));
  const double step_m = pack.document.at("chunk_m").get<double>() / 65535;
  std::vector<bool> found(CountDense(map));
  for (const nlohmann::json& chunk : pack.document.at("dense_chunks")) {
    const auto corner = chunk.at("corner").get<std::vector<double>>();
    const auto from = chunk.at("from").get<std::size_t>();
    for (std::size_t i = from; i < from + chunk.at("count").get<std::size_t>(); ++i) {
      const Vector3d p_world = GetOrigin(pack) + Vector3d(corner[0], corner[1], corner[2]) +
                               step_m * Vector3d(x[i], y[i], z[i]);
      for (std::size_t k = 0; k < CountDense(map); ++k) {
        if ((DenseAt(map, k).p_world - p_world).norm() >= 0.5e-3) continue;
        found[k] = true;
        EXPECT_EQ(source[i] == 1, IsFilled(map, k));
      }
    }
  }
  EXPECT_THAT(found, ::testing::Each(true));
  EXPECT_GT(pack.document.at("dense_chunks").size(), 2u);
}

TEST(PackForPage, PlanesRoomsAndWallsAreRelativeToTheOrigin) {
  const Pack pack = PackOf(MakeRoomMap());
  const nlohmann::json& building = pack.document.at("building");
  const nlohmann::json& wall = building.at("planes")[3];
  EXPECT_EQ(wall.at("kind"), "wall");
  EXPECT_NEAR(wall.at("offset_m").get<double>(), -(104 - GetOrigin(pack).x()), 1e-9);
  EXPECT_EQ(wall.at("openings")[0].at("kind"), "door");
  for (const nlohmann::json& corner : wall.at("outline")) {
    EXPECT_NEAR(corner[0].get<double>() + GetOrigin(pack).x(), 104, 1e-5);
  }
  EXPECT_EQ(building.at("rooms")[0].at("area_m2"), 19.75);
  EXPECT_EQ(building.at("walls")[0].at("openings")[0].at("to_m"), 3.0);
}

TEST(PackForPage, HowMuchOfWhatWasSeenIsHeldIsToldWhereItIsKnown) {
  MapResult map = MakeRoomMap();
  map.seen_share = 0.75;
  map.building.rooms.at(0).seen_share = 0.5;
  const Pack pack = PackOf(map);
  EXPECT_EQ(pack.document.at("seen_share"), 0.75);
  EXPECT_EQ(pack.document.at("building").at("rooms")[0].at("seen_share"), 0.5);
  EXPECT_TRUE(pack.document.at("building").at("walls")[0].at("seen_share").is_null());
}

TEST(PackForPage, WhatIsNotAsPlannedIsToldWhereItIs) {
  MapResult map = MakeRoomMap();
  PlanComparison& plan = map.plan.emplace();
  plan.T_plan_world.translation = {-100, 0, 0};
  plan.walls.resize(2);
  plan.walls[1] = {PlanStatus::kDeviates, 1, 3, {4, 0}, {4, 3}, -0.021, 0.004};
  plan.openings.resize(1);
  plan.openings[0].status = PlanStatus::kMissing;
  const Pack pack = PackOf(map);
  const nlohmann::json& told = pack.document.at("deviations");
  ASSERT_EQ(told.size(), 2u);
  EXPECT_EQ(told[0].at("text"), "-21 \u00b14");
  EXPECT_EQ(told[1].at("text"), "closed");
  EXPECT_NEAR(told[0].at("end")[0].get<double>() + GetOrigin(pack).x(), 104, 1e-9);
}

TEST(PackForPage, FloorsAndCeilingsHaveTheHolesOfTheirRoom) {
  const Pack pack = PackOf(MakeRoomMap());
  const nlohmann::json& planes = pack.document.at("building").at("planes");
  for (const auto& [id, z_m] : {std::pair(0, 0.0), std::pair(1, 2.6)}) {
    const auto holes = planes[id].at("holes").get<std::vector<std::vector<std::vector<double>>>>();
    ASSERT_EQ(holes.size(), 1u) << id;
    ASSERT_EQ(holes[0].size(), 4u);
    const Vector3d corner(holes[0][2][0], holes[0][2][1], holes[0][2][2]);
    EXPECT_LT((corner + GetOrigin(pack) - Vector3d(103.7, 201, z_m)).norm(), 1e-5) << id;
  }
  EXPECT_TRUE(planes[3].at("holes").empty());
}

TEST(PackForPage, PicturesAreOneBehindTheOther) {
  EXPECT_EQ(PackOf(MakeRoomMap()).Get<int32_t>("image_end").size(), 0u);
  const Pack pack = Unpack(PackForPage(MakeRoomMap(), "title", {{1, "first"}, {3, "second"}}));
  EXPECT_THAT(pack.Get<int32_t>("image_keyframe"), ::testing::ElementsAre(1, 3));
  EXPECT_THAT(pack.Get<int32_t>("image_end"), ::testing::ElementsAre(5, 11));
  const std::vector<uint8_t> bytes = pack.Get<uint8_t>("image_bytes");
  EXPECT_EQ(std::string(bytes.begin(), bytes.end()), "firstsecond");
}

TEST(PackForPage, SigmasHoldToTwoPercent) {
  for (const double sigma_m : {1e-4, 0.0035, 0.02, 0.9, 5.0}) {
    EXPECT_NEAR(1e-4 * std::exp2(SigmaCode(sigma_m) / 16.0) / sigma_m, 1, 0.022);
  }
  EXPECT_EQ(SigmaCode(0), 0);
  EXPECT_EQ(SigmaCode(1e9), 255);
}

std::string FromBase64(const std::string& text) {
  std::string bytes;
  uint32_t bits = 0;
  int count = 0;
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  for (const char c : text) {
    if (c == '=') break;
    bits = bits << 6 | static_cast<uint32_t>(digits.find(c));
    if ((count += 6) < 8) continue;
    count -= 8;
    bytes.push_back(static_cast<char>(bits >> count));
  }
  return bytes;
}

std::string Inflated(const std::string& compressed, size_t expected_bytes) {
  std::string bytes(expected_bytes + 1, '\0');
  uLongf size = bytes.size();
  EXPECT_EQ(uncompress(reinterpret_cast<Bytef*>(bytes.data()), &size,
                       reinterpret_cast<const Bytef*>(compressed.data()), compressed.size()),
            Z_OK);
  bytes.resize(size);
  return bytes;
}

TEST(MakePage, TheMapTakesThePlaceOfTheMark) {
  const MapResult map = MakeRoomMap();
  const std::string page = MakePage(map, "<before>@SLCMAP_MAP@<after>", "title");
  ASSERT_TRUE(page.starts_with("<before>") && page.ends_with("<after>"));
  const std::string expected = PackForPage(map, "title");
  EXPECT_EQ(Inflated(FromBase64(page.substr(8, page.size() - 8 - 7)), expected.size()), expected);
}

TEST(MakePage, HoldsAllOfWhatDoesNotCompress) {
  std::mt19937 random(1);
  std::string bytes(5 << 20, '\0');
  for (size_t i = 0; i < bytes.size(); ++i) {
    const bool is_sparse = i / 300000 % 3 == 0;
    if (!is_sparse || random() % 64 == 0) bytes[i] = static_cast<char>(random());
  }
  const std::vector<PageImage> images = {{1, bytes}};
  const MapResult map = MakeRoomMap();
  const std::string page = MakePage(map, "@SLCMAP_MAP@", "title", images);
  const std::string expected = PackForPage(map, "title", images);
  EXPECT_TRUE(Inflated(FromBase64(page), expected.size()) == expected);
}

TEST(MakePage, WrongTemplatesAreNamed) {
  const auto message = [](const std::string& page) {
    return MessageOf<ConfigError>([&] { MakePage({}, page, ""); });
  };
  EXPECT_EQ(message("@SLCMAP_MAP@"), "") << "of an empty map too";
  EXPECT_THAT(message("<html>"), HasSubstr("without the mark @SLCMAP_MAP@"));
  EXPECT_THAT(message("@SLCMAP_MAP@ @SLCMAP_MAP@"), HasSubstr("several"));
  const Progress stop([](double) { return false; });
  EXPECT_THROW(MakePage(MakeRoomMap(), "@SLCMAP_MAP@", "", {}, stop), StoppedError);
}

// Keyframes at rest, ten a second.
MapResult StandingMap(int keyframes) {
  MapResult map;
  map.rectified_rig = testing::ForwardRig();
  for (int i = 0; i < keyframes; ++i) {
    map.keyframes.push_back({100000000 * int64_t{i}, RigidTransform()});
  }
  return map;
}

// A camera with distortion that is turned by 6 degrees against the map's.
Rig RawRig() {
  Rig rig = testing::ForwardRig();
  Camera& camera = rig.cameras[0];
  camera.distortion = Distortion::kRadialTangential;
  camera.coefficients = {-0.2, 0.05, 0, 0};
  rig.T_imu_camera[0].rotation =
      rig.T_imu_camera[0].rotation *
      Eigen::Quaterniond(Eigen::AngleAxisd(0.1, Eigen::Vector3d(1, 2, 0).normalized()));
  return rig;
}

// Pairs at the stamps of StandingMap, with that image on the left.
std::vector<StereoImage> Pairs(int count, const cv::Mat& left) {
  std::vector<StereoImage> pairs(count);
  for (int i = 0; i < count; ++i) {
    pairs[i].stamp_ns = 100000000 * int64_t{i};
    pairs[i].left = left;
  }
  return pairs;
}

cv::Mat Decoded(const PageImage& image) {
  const std::vector<uint8_t> bytes(image.jpeg.begin(), image.jpeg.end());
  return cv::imdecode(bytes, cv::IMREAD_UNCHANGED);
}

TEST(ReadPageImages, ShowWhatTheMapsCameraWouldSee) {
  const MapResult map = StandingMap(1);
  const Rig raw = RawRig();
  const Eigen::Vector3d spot_imu(2, 0.5, 0.3);
  const auto pixel_of = [&](const Rig& rig) {
    return *rig.cameras[0].Project(rig.T_imu_camera[0].Inverse() * spot_imu);
  };
  cv::Mat left = cv::Mat::zeros(240, 320, CV_8U);
  const Eigen::Vector2d raw_px = pixel_of(raw);
  cv::circle(left, {cvRound(raw_px.x()), cvRound(raw_px.y())}, 8, 255, cv::FILLED);
  const MemorySource recording(raw, Pairs(1, left), {});
  const auto images = ReadPageImages(map, recording, {.width_px = 160});
  ASSERT_EQ(images.size(), 1u);
  const cv::Mat seen = Decoded(images[0]);
  ASSERT_EQ(seen.size(), cv::Size(160, 120));
  const cv::Moments spot = cv::moments(seen > 128, true);
  // A pixel of the smaller picture is two by two of the camera's.
  const Eigen::Vector2d at_px(2 * spot.m10 / spot.m00 + 0.5, 2 * spot.m01 / spot.m00 + 0.5);
  EXPECT_LT((at_px - pixel_of(map.rectified_rig)).norm(), 1.5) << at_px.transpose();
  EXPECT_GT((raw_px - pixel_of(map.rectified_rig)).norm(), 10);  // else it tells nothing
}

TEST(ReadPageImages, AreOfEveryNthKeyframeAndNotMadeLarger) {
  std::vector<StereoImage> pairs = Pairs(7, cv::Mat(240, 320, CV_8U, 99));
  const MemorySource recording(testing::ForwardRig(), pairs, {});
  const auto images = ReadPageImages(StandingMap(7), recording, {.most = 3});
  std::vector<std::size_t> keyframes;
  for (const PageImage& image : images) keyframes.push_back(image.keyframe);
  EXPECT_THAT(keyframes, ::testing::ElementsAre(0, 3, 6));
  EXPECT_EQ(Decoded(images[0]).cols, 320);
  // Those that cannot be read are left out.
  pairs[1].left.release();
  const MemorySource damaged(testing::ForwardRig(), pairs, {});
  EXPECT_EQ(ReadPageImages(StandingMap(7), damaged, {}).size(), 6u);
}

TEST(ReadPageImages, AnotherRecordingIsRefused) {
  std::vector<StereoImage> pairs = Pairs(3, cv::Mat(240, 320, CV_8U, 99));
  for (StereoImage& pair : pairs) pair.stamp_ns += 5000000000;
  const MemorySource recording(testing::ForwardRig(), pairs, {});
  EXPECT_THAT(MessageOf<DataError>([&] { ReadPageImages(StandingMap(3), recording, {}); }),
              HasSubstr("memory: found none of the images of the map's 3 keyframes"));
  EXPECT_TRUE(ReadPageImages(StandingMap(0), recording, {}).empty());
}

}  // namespace
}  // namespace slcmap
