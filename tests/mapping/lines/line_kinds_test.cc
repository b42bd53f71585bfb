#include "mapping/lines/line_kinds.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "mapping/lines/line_sides.h"
#include "mapping/lines/line_store.h"
#include "tests/mapping/lines/painted_wall.h"

namespace slcmap {
namespace {

const PointAndDirection kLine = {Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitX()};
const std::vector<Interval> kMetre = {{-0.5, 0.5}};

// Points every 4 cm of a half plane that ends at the line, `degrees` from the world's y, moved by
// `off_m` along z; alternately 5 mm off it. Seen from where its angle grows to, or from the other
// side.
void AddHalfPlane(double degrees, double off_m, bool from_above, std::vector<DensePoint>* cloud) {
  const double angle = degrees * M_PI / 180, sense = from_above ? 1 : -1;
  for (int x = -18; x <= 18; ++x) {
    for (int k = 0; k < 8; ++k) {
      const double beside_m = 0.02 + 0.04 * k;
      DensePoint point;
      point.p_world = {0.04 * x, beside_m * std::cos(angle),
                       beside_m * std::sin(angle) + off_m + (k % 2 == 0 ? 0.005 : -0.005)};
      point.normal_world = {0, -sense * std::sin(angle), sense * std::cos(angle)};
      point.sigma_m = 0.005;
      cloud->push_back(point);
    }
  }
}

struct HalfPlane {
  double degrees, off_m;
  bool from_above;
  double beside_m = 0;  // the line, where it starts
};

SurfacesBeside Beside(const std::vector<HalfPlane>& planes) {
  std::vector<DensePoint> cloud;
  for (const HalfPlane& plane : planes) {
    const size_t first = cloud.size();
    AddHalfPlane(plane.degrees, plane.off_m, plane.from_above, &cloud);
    for (size_t i = first; i < cloud.size(); ++i) cloud[i].p_world.y() += plane.beside_m;
  }
  return LineSurfaces(cloud).Beside(kLine, kMetre);
}

TEST(LineSurfaces, AreFlatWhereAPlaneIsOnBothSides) {
  const HalfPlane left{0, 0, true}, right{180, 0, false};
  for (const auto& [what, planes] : std::vector<std::pair<const char*, std::vector<HalfPlane>>>{
           {"a plane", {left, right}},
           {"a sloping one", {{60, 0, true}, {240, 0, false}}},
           {"a leaf of a door, whatever is at its back",
            {left, right, {0, -0.05, false}, {180, -0.05, true}}},
           {"a thing stands on it elsewhere", {left, right, {90, 0, false, 0.08}}}}) {
    EXPECT_NEAR(Beside(planes).flat_m, 1, 1e-9) << what;
  }
  for (const auto& [what, planes] : std::vector<std::pair<const char*, std::vector<HalfPlane>>>{
           {"a crease", {left, {90, 0, false}}},
           {"a blunt one", {left, {150, 0, false}}},
           {"a step", {left, {180, 0.08, false}}},
           {"an end", {left}},
           {"a thing stands at the line", {left, right, {90, 0, false}}}}) {
    EXPECT_NEAR(Beside(planes).relief_m, 1, 1e-9) << what;
  }
}

TEST(LineSurfaces, FarFromAllPointsNothingIsKnown) {
  EXPECT_NEAR(Beside({{0, 1, true}}).unknown_m, 1, 1e-9);
  EXPECT_NEAR(LineSurfaces({}).Beside(kLine, {{0, 0.4}, {1, 1.3}}).unknown_m, 0.7, 1e-9);
}

// As well known as most lines.
TrackedLine WithStep(double step, double lasting, const SurfacesBeside& surfaces) {
  TrackedLine line;
  line.brightness_sum = 1000;
  line.step_sum = 10 * step;
  line.lasting_sum = 10 * step * lasting;
  line.surfaces = surfaces;
  line.fit.views = 12;
  line.fit.spread_px = 0.15;
  line.fit.covariance.setIdentity();
  line.fit.covariance *= 4e-6;
  return line;
}

TEST(LineKinds, WhereSurfacesBendIsAnEdgeAndAmongManyAJoint) {
  EXPECT_GT(ComputeEdgeProbability(WithStep(40, 1, {0.1, 0.9, 0})), 0.8);
  TrackedLine joint = WithStep(15, 0.2, {1, 0, 0});
  joint.parallels = 8;
  joint.sides = {-12, 4};
  EXPECT_LT(ComputeEdgeProbability(joint), 0.2);
}

TEST(LineKinds, EachVoteCounts) {
  const TrackedLine line = WithStep(25, 0.6, {0.6, 0.4, 0});
  const double before = ComputeEdgeProbability(line);
  TrackedLine bent = line, behind = line, strong = line, joint = line, loose = line;
  bent.surfaces = {0.1, 0.9, 0};
  behind.sides = {20, 5};
  strong.step_sum *= 2, strong.lasting_sum *= 2;
  joint.parallels = 6;
  loose.fit.spread_px = 0.4;
  EXPECT_GT(ComputeEdgeProbability(bent), before);
  EXPECT_GT(ComputeEdgeProbability(behind), before);
  EXPECT_GT(ComputeEdgeProbability(strong), before);
  EXPECT_LT(ComputeEdgeProbability(joint), before);
  EXPECT_LT(ComputeEdgeProbability(loose), before);
}

TEST(LineKinds, HowBrightTheLightIsDoesNotMatter) {
  const TrackedLine line = WithStep(25, 0.6, {0.6, 0.4, 0});
  TrackedLine dark = line;
  for (double* sum : {&dark.step_sum, &dark.lasting_sum, &dark.brightness_sum}) *sum *= 0.2;
  EXPECT_DOUBLE_EQ(ComputeEdgeProbability(dark), ComputeEdgeProbability(line));
}

TEST(LineKinds, ALineOfWhichNothingIsKnownHasAProbability) {
  const double probability = ComputeEdgeProbability(TrackedLine());
  EXPECT_GE(probability, 0);
  EXPECT_LE(probability, 1);
}

// A line along x through a place across it.
TrackedLine Along(double y_m, double z_m, double from_m, double to_m) {
  TrackedLine line;
  line.line = {{0, y_m, z_m}, Eigen::Vector3d::UnitX()};
  line.intervals = {{from_m, to_m}};
  line.seen = {from_m, to_m};
  return line;
}

int ParallelsOfFirst(std::vector<TrackedLine> lines) {
  CountParallels(0.4, &lines);
  return lines.front().parallels;
}

std::vector<TrackedLine> AtHeights(const std::vector<double>& y_m, double from_m, double to_m) {
  std::vector<TrackedLine> lines = {Along(0, 0, -1, 1)};
  for (const double y : y_m) lines.push_back(Along(y, 0, from_m, to_m));
  return lines;
}

TEST(LineTexture, CountsThoseBesideMostOfALineInOnePlane) {
  const std::vector<double> four = {0.1, 0.2, 0.3, -0.1};
  std::vector<TrackedLine> at_rim = AtHeights({0.1, 0.2, 0.3, -0.1, -0.2}, -1, 1);
  EXPECT_EQ(ParallelsOfFirst(at_rim), 5);
  std::swap(at_rim[0], at_rim[3]);
  EXPECT_EQ(ParallelsOfFirst(at_rim), 3) << "within reach";
  EXPECT_EQ(ParallelsOfFirst(AtHeights(four, 0.6, 1)), 0) << "an edge that passes bricks";
  EXPECT_EQ(ParallelsOfFirst(AtHeights(four, -0.9, 1)), 4);
  EXPECT_EQ(ParallelsOfFirst(AtHeights({0.5}, -1, 1)), 0) << "far away";
  EXPECT_EQ(ParallelsOfFirst(AtHeights({0.1}, 1.5, 3)), 0) << "elsewhere along it";
  EXPECT_EQ(
      ParallelsOfFirst({Along(0, 0, -1, 1), Along(0.1, 0, -1, 0.05), Along(0.105, 0, -0.05, 1)}), 1)
      << "one in pieces";
  std::vector<TrackedLine> corner = AtHeights({0.1, 0.2}, -1, 1);
  for (const double z_m : {0.1, 0.2, 0.3}) corner.push_back(Along(0, z_m, -1, 1));
  EXPECT_EQ(ParallelsOfFirst(corner), 3) << "the plane with most";
}

TEST(LineTexture, WhatIsTurnedOrOfAnotherSegmentDoesNotCount) {
  std::vector<TrackedLine> crossing = AtHeights({0.1}, -1, 1), other = crossing;
  EXPECT_EQ(ParallelsOfFirst(crossing), 1);
  crossing[1].line.direction_world = Eigen::Vector3d(1, 0.3, 0).normalized();
  EXPECT_EQ(ParallelsOfFirst(crossing), 0);
  other[1].segment = 1;
  EXPECT_EQ(ParallelsOfFirst(other), 0);
}

constexpr double kFront_m = 2;

// A speckled wall up to x = 0, and another, brighter one behind it or beside it from there on, seen
// along the world's y.
class SpeckledWalls : public ViewImages {
 public:
  SpeckledWalls(Views views, double left_m, double right_m)
      : views_(std::move(views)), left_m_(left_m), right_m_(right_m) {
    for (int i = 0; i < 2; ++i) {
      rig_.cameras[i] = testing::PinholeCamera(320, 240, kFocal_px, kCentre.x(), kCentre.y());
      rig_.T_imu_camera[i].translation.x() = 0.11 * i;
    }
    cv::RNG dice(7);
    dice.fill(speckles_, cv::RNG::NORMAL, 0, 60);
    cv::GaussianBlur(speckles_, speckles_, {0, 0}, 1.5);
  }

  const Rig& rig() const override { return rig_; }
  const cv::Mat& mask(int) const override { return mask_; }
  StereoImage Read(size_t view) const override {
    return {views_[view].stamp_ns, Paint(view, 0), Paint(view, 1)};
  }

 private:
  static constexpr double kFocal_px = 250, kTexel_m = 0.008;
  static inline const Eigen::Vector2d kCentre{159.5, 119.5};

  // A wall's image, with the middle of the speckles at a place of it.
  cv::Mat Wall(const Eigen::Vector3d& camera, double wall_m, double x_m, double grey) const {
    const double px_a_m = kFocal_px / wall_m, px_a_texel = kTexel_m * px_a_m;
    const Eigen::Vector2d middle = kCentre + px_a_m * Eigen::Vector2d(x_m - camera.x(), camera.z());
    const cv::Matx23d map(px_a_texel, 0, middle.x() - px_a_texel * speckles_.cols / 2, 0,
                          px_a_texel, middle.y() - px_a_texel * speckles_.rows / 2);
    cv::Mat wall;
    cv::warpAffine(speckles_ + grey, wall, map, mask_.size());
    return wall;
  }

  cv::Mat Paint(size_t view, int camera) const {
    const Eigen::Vector3d at = WorldFromCamera(views_[view], rig_, camera).translation;
    cv::Mat left = Wall(at, left_m_, 0, 90), image = Wall(at, right_m_, 3, 150);
    const double edge_px = kCentre.x() - kFocal_px / left_m_ * at.x() + 0.5;
    const int column = static_cast<int>(edge_px);
    left.colRange(0, column).copyTo(image.colRange(0, column));
    cv::addWeighted(left.col(column), edge_px - column, image.col(column), 1 - edge_px + column, 0,
                    image.col(column));
    image.convertTo(image, CV_8UC1);
    return image;
  }

  const Views views_;
  const double left_m_, right_m_;
  Rig rig_;
  cv::Mat mask_ = cv::Mat(240, 320, CV_8UC1, cv::Scalar(255));
  cv::Mat1f speckles_ = cv::Mat1f(1024, 2048);
};

// What is said of the line at x = 0, in front, with walls at these distances.
SideVotes VotesAt(double left_m, double right_m, int count = 5) {
  Views views;
  TrackedLine line;
  line.line = {{0, kFront_m, 0}, -Eigen::Vector3d::UnitZ()};
  line.intervals = {{-0.3, 0.3}};
  for (int view = 0; view < count; ++view) {
    views.push_back(testing::LookingAtWall({0.1 * view - 0.1, 0, 0}, view));
    line.places.push_back({.view = view, .samples = 10, .from_m = -0.3F, .to_m = 0.3F});
  }
  std::vector<TrackedLine> lines{line};
  CompareSides(views, SpeckledWalls(views, left_m, right_m), {}, &lines, {});
  return lines[0].sides;
}

TEST(LineSides, AMarkIsOnOnePlaneAndBehindAnEdgeLiesAnotherSurface) {
  const SideVotes mark = VotesAt(kFront_m, kFront_m), edge = VotesAt(kFront_m, 2.6);
  ASSERT_GT(mark.pieces, 0);
  EXPECT_LT(mark.behind, -2 * mark.pieces);
  ASSERT_GT(edge.pieces, 0);
  EXPECT_GT(edge.behind, 2 * edge.pieces);
  EXPECT_EQ(VotesAt(kFront_m, kFront_m, 1).pieces, 0) << "one view says nothing";
}

}  // namespace
}  // namespace slcmap
