#include "odometry/options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "data/core/error.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class OdometryOptionsTest : public ::testing::Test {
 protected:
  OdometryOptions Read(const std::string& text) {
    return OdometryOptions::FromYaml(folder_.Write("odometry.yaml", text));
  }
  std::string ErrorOf(const std::string& text) {
    return testing::MessageOf<ConfigError>([&] { Read(text); });
  }

  testing::TempFolder folder_;
};

TEST_F(OdometryOptionsTest, ReadsWhatTheFileHoldsAndLeavesTheRest) {
  const OdometryOptions options = Read(
      "method: points-mono\npoints: {max_points: 77}\nwindow: {point_sigma_px: 0.7}\n"
      "line_landmarks: {sigma_px: 0.3}\nmanhattan: {min_images: 1}\n"
      "mapping: {cloud: {voxel_m: 0.1}}\n");
  EXPECT_EQ(options.method, Method::kPointsMono);
  EXPECT_EQ(options.points.max_points, 77);
  EXPECT_EQ(options.points.min_distance_px, PointTrackerOptions().min_distance_px);
  EXPECT_EQ(options.window.point_sigma_px, 0.7);
  EXPECT_EQ(options.line_landmarks.sigma_px, 0.3);
  EXPECT_EQ(options.manhattan.min_images, ManhattanOptions().min_images) << "is no option any more";
}

TEST_F(OdometryOptionsTest, AllThatIsInEffectIsAFileThatGivesTheSame) {
  const OdometryOptions options = Read(
      "method: points-lines\nlines: {detector: {kind: fld, min_length_px: 12}}\n"
      "line_landmarks: {anchor_at_origin: true}\nwindow: {point_sigma_px: 0.30000000000000004}\n");
  const std::string text = options.ToYaml();
  const OdometryOptions read = Read(text);
  EXPECT_EQ(read.ToYaml(), text);
  EXPECT_EQ(read.method, Method::kPointsLines);
  EXPECT_EQ(read.lines.detector.kind, LineDetectorKind::kFld);
  EXPECT_EQ(read.lines.detector.min_length_px, 12);
  EXPECT_TRUE(read.line_landmarks.anchor_at_origin);
  EXPECT_EQ(read.window.point_sigma_px, 0.30000000000000004);
  EXPECT_NE(text.find("failure:\n  max_lost_s: 2\n"), std::string::npos) << text;
}

TEST_F(OdometryOptionsTest, NamesSectionKeyValueAndWhatWasExpected) {
  for (const auto& [text, message] :
       {std::pair("points: {max_points: 0}", "points.max_points: found 0, expected 1 to 10000"),
        std::pair("rectifier: {max_field_of_view_rad: 4}", "expected 0.2 to 2.8"),
        std::pair("rectifier: {scale: 0.05}", "rectifier.scale: found 0.05, expected 0.1 to 4"),
        std::pair("lines: {detector: {kind: x}}",
                  "lines.detector.kind: found 'x', expected lsd, fld or ed"),
        std::pair("building_deviation: {start_sigma_rad: 1e-5}",
                  "building_deviation.start_sigma_rad: found 1e-05, expected 0, or 0.00017 to "
                  "0.017"),
        std::pair("failure: {max_sped_m_s: 3}", "failure.max_sped_m_s: unknown key"),
        std::pair("points: {max_points: 7.5}", "expected a whole number"),
        std::pair("method: lines", "expected points")}) {
    EXPECT_THAT(ErrorOf(text),
                AllOf(StartsWith(folder_.Path("odometry.yaml")), HasSubstr(message)));
  }
  EXPECT_EQ(Read("building_deviation: {start_sigma_rad: 0}").building_deviation.start_sigma_rad, 0);
}

}  // namespace
}  // namespace slcmap
