#include "mapping/lines/line_fit.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "mapping/lines/line_samples.h"
#include "odometry/geometry/pinhole.h"
#include "tests/mapping/lines/painted_wall.h"

namespace slcmap {
namespace {

using testing::LookingAtWall;
using testing::MovingViews;
using testing::PaintedWall;

const PointAndDirection kTrue{{0.2, 2, 0.1}, Eigen::Vector3d(0.3, 0.1, 1).normalized()};

// Of four samples, so far off the line's image.
EdgePoint PlaceAt(const LineInView& part, double share, double off_px, int view, int camera) {
  const Eigen::Vector2d along = (part.px.end - part.px.start).normalized();
  const Eigen::Vector2d normal(along.y(), -along.x());
  const Eigen::Vector2d px =
      part.px.start + share * (part.px.end - part.px.start) + off_px * normal;
  return {
      view, camera, static_cast<float>(part.AlongAt(share)), px.cast<float>(), normal.cast<float>(),
      4};
}

// Where some views see the line in an interval, off by noise across its image.
std::vector<EdgePoint> CollectPlaces(
    const ViewCameras& cameras, double sigma_px, unsigned seed,
    const std::function<Interval(int view)>& interval =
        [](int) {
          return Interval{-0.5, 0.5};
        },
    const std::vector<double>& shares = {0.1, 0.5, 0.9}, int most_cameras = 2) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, 1);
  std::vector<EdgePoint> places;
  for (int view = 0; view < static_cast<int>(cameras.T_camera_world.size()); ++view) {
    for (int camera = 0; camera < most_cameras; ++camera) {
      const auto part = SeenPart(kTrue, interval(view), cameras.T_camera_world[view][camera],
                                 cameras.cameras[camera], {});
      if (!part) continue;
      for (const double share : shares) {
        places.push_back(PlaceAt(*part, share, sigma_px * noise(random), view, camera));
      }
    }
  }
  return places;
}

std::vector<double> Shares(int count) {
  std::vector<double> shares;
  for (int i = 0; i < count; ++i) shares.push_back((i + 0.5) / count);
  return shares;
}

class LineFitting : public ::testing::Test {
 protected:
  const Views views_ = MovingViews(8);
  const ViewCameras cameras_{views_, PaintedWall(views_).rig()};
  const LineFitOptions options_{.pose_sigma_m = 0, .views_that_count = 1000};
  const PointAndDirection start_{{0.23, 2.05, 0.1}, Eigen::Vector3d(0.33, 0.05, 1).normalized()};

  std::optional<LineFit> Fit(const std::vector<EdgePoint>& places,
                             const std::optional<DirectionPrior>& prior = {}) const {
    return FitLine(start_, places, cameras_, prior, options_);
  }
};

TEST_F(LineFitting, OfExactPlacesIsExact) {
  const auto fit = Fit(CollectPlaces(cameras_, 0, 1));
  ASSERT_TRUE(fit);
  EXPECT_LT((NearestOn(kTrue, fit->line.point_world) - fit->line.point_world).norm(), 1e-6);
  EXPECT_LT(fit->line.direction_world.cross(kTrue.direction_world).norm(), 1e-6);
  EXPECT_EQ(fit->views, 8);
  EXPECT_FALSE(Fit({})) << "of none there is none";
}

TEST_F(LineFitting, ErrsAsItsCovarianceSays) {
  double squared = 0;
  constexpr int kRuns = 200;
  for (unsigned seed = 1; seed <= kRuns; ++seed) {
    const auto fit = Fit(CollectPlaces(cameras_, options_.sigma_px, seed));
    ASSERT_TRUE(fit);
    // Where the true line crosses the plane through the fit's point, and its direction.
    const Eigen::Vector3d& d = fit->line.direction_world;
    const Eigen::Vector3d off = kTrue.point_world - fit->line.point_world;
    const Eigen::Vector3d crossing =
        off - d.dot(off) / d.dot(kTrue.direction_world) * kTrue.direction_world;
    Eigen::Vector4d error;
    error << fit->across.transpose() * crossing,
        fit->across.transpose() * (kTrue.direction_world / d.dot(kTrue.direction_world));
    squared += error.dot(fit->covariance.inverse() * error);
  }
  // The robust loss costs some information, which the covariance tells as less.
  EXPECT_NEAR(squared / kRuns, 4, 1.2);
}

TEST_F(LineFitting, SurvivesPlacesOfAnotherEdge) {
  std::vector<EdgePoint> places = CollectPlaces(cameras_, 0.1, 1);
  for (size_t i = 0; i < places.size(); i += 5) places[i].px += 5 * places[i].normal;
  const auto fit = Fit(places);
  ASSERT_TRUE(fit);
  EXPECT_LT((NearestOn(kTrue, fit->line.point_world) - fit->line.point_world).norm(), 0.01);
}

// From afar an edge beside the lower half runs together with it.
TEST(LineFitFromAfar, IsLedByWhatIsSeenFromNear) {
  Views views = MovingViews(8);
  for (View view : MovingViews(8)) {
    view.T_world_imu.translation.y() = -4;
    views.push_back(view);
  }
  const ViewCameras cameras(views, PaintedWall(views).rig());
  std::vector<EdgePoint> places = CollectPlaces(cameras, 0.02, 1);
  for (EdgePoint& place : places) {
    if (place.view >= 8 && place.along_m < 0) place.px += 0.8F * place.normal;
  }
  const auto off_rad = [&](double far_power) {
    const LineFitOptions options{.far_power = far_power};
    const auto fit = FitLine(kTrue, places, cameras, std::nullopt, options);
    return fit ? fit->line.direction_world.cross(kTrue.direction_world).norm() : std::nan("");
  };
  EXPECT_LT(off_rad(2), 0.002);
  EXPECT_GT(off_rad(0), 0.004);
}

// Passing a jamb, a few images show its upper end from near, a little beside where it is.
TEST(LineFitFromAfar, IsNotLedByGlimpsesOfOneEnd) {
  const auto far_end_sigma_m = [](int glimpses, const LineFitOptions& options = {}) {
    Views views = MovingViews(8);
    for (View& view : views) view.T_world_imu.translation.y() = -2;
    for (int i = 0; i < glimpses; ++i) {
      views.push_back(testing::LookingAtWall({0.2, 0.8, 1.2}, 200 + i));
    }
    const ViewCameras cameras(views, PaintedWall(views).rig());
    std::vector<EdgePoint> places = CollectPlaces(
        cameras, 0, 1,
        [](int view) {
          return view < 8 ? Interval{-1.2, 1.2} : Interval{0.9, 1.2};
        },
        Shares(10));
    for (EdgePoint& place : places) place.px += (place.view < 8 ? 0 : 0.5F) * place.normal;
    const auto fit = FitLine(kTrue, places, cameras, std::nullopt, options);
    if (!fit) return std::nan("");
    const double end_m = -1.2 - fit->shift_m;
    return std::hypot(fit->SigmaTowards_m(fit->across.col(0), end_m),
                      fit->SigmaTowards_m(fit->across.col(1), end_m));
  };
  const double without_m = far_end_sigma_m(0);
  for (const int glimpses : {1, 2, 3}) EXPECT_LT(far_end_sigma_m(glimpses), 2.5 * without_m);
  EXPECT_GT(far_end_sigma_m(3, {.most_times_farther = 1000}), 4 * without_m);
}

// A line of places 5 cm apart, and what is told of it.
class WhatIsTold : public LineFitting {
 protected:
  LineFit Fit(const LineFitOptions& options,
              const std::optional<DirectionPrior>& prior = std::nullopt) const {
    const auto whole = [](int) { return Interval{-0.5, 0.5}; };
    return FitLine(kTrue, CollectPlaces(cameras_, 0, 1, whole, Shares(20), 1), cameras_, prior,
                   options)
        .value();
  }
};

TEST_F(WhatIsTold, CountsPlacesThatErrAlikeOnce) {
  const LineFit each = Fit({.stretch_m = 0.01, .shared_sigma_m = 0});
  EXPECT_LT((each.world_covariance - each.covariance).norm(), 1e-9 * each.covariance.norm());
  const LineFit alike = Fit({.stretch_m = 0.25, .shared_sigma_m = 0});
  const double times = alike.world_covariance(0, 0) / alike.covariance(0, 0);
  EXPECT_GT(times, 3.5);
  EXPECT_LT(times, 5.5);
}

TEST_F(WhatIsTold, HasWhatViewsShareAndThePrior) {
  const LineFit without = Fit({.shared_sigma_m = 0}), with = Fit({.shared_sigma_m = 0.003});
  EXPECT_NEAR(with.world_covariance(0, 0) - without.world_covariance(0, 0), 9e-6, 1e-9);
  EXPECT_NEAR(with.world_covariance(2, 2), without.world_covariance(2, 2), 1e-12);
  const LineFit known = Fit({}, DirectionPrior{kTrue.direction_world, 1e-4});
  EXPECT_LE(std::sqrt(known.world_covariance(2, 2)), 1e-4);
}

// Places of one stretch of an image err alike: more of them know no more against a prior.
TEST_F(LineFitting, WeighsAPriorAgainstWhatErrsAlike) {
  const std::vector<EdgePoint> places = CollectPlaces(cameras_, 0, 1);
  std::vector<EdgePoint> more;
  for (int i = 0; i < 10; ++i) more.insert(more.end(), places.begin(), places.end());
  const Eigen::Vector3d turned =
      (kTrue.direction_world + 0.01 * kTrue.direction_world.unitOrthogonal()).normalized();
  const DirectionPrior prior{turned, 0.002};
  const auto few = Fit(places, prior), many = Fit(more, prior);
  ASSERT_TRUE(few && many);
  const auto off_rad = [](const LineFit& fit) {
    return fit.line.direction_world.cross(kTrue.direction_world).norm();
  };
  EXPECT_GT(off_rad(*few), 1e-4);
  EXPECT_NEAR(off_rad(*many), off_rad(*few), 0.02 * off_rad(*few));
  EXPECT_LT((many->world_covariance - few->world_covariance).norm(),
            0.02 * few->world_covariance.norm());
}

TEST_F(LineFitting, TellsALineWithPlacesOfAnotherEdgeFromPlacesOfNone) {
  std::vector<EdgePoint> of_two = CollectPlaces(cameras_, 0.1, 1),
                         of_none = CollectPlaces(cameras_, 0.6, 2);
  for (size_t i = 0; i < of_two.size(); i += 4) of_two[i].px += 1.3 * of_two[i].normal;
  const auto two = Fit(of_two), none = Fit(of_none);
  ASSERT_TRUE(two && none);
  EXPECT_GT(two->rms_px, 0.45);
  EXPECT_LT(two->spread_px, 0.25);
  EXPECT_NEAR(none->spread_px, none->rms_px, 0.15);
}

TEST_F(LineFitting, KeepsToAnAxisThatIsKnownWell) {
  const auto fit = Fit(CollectPlaces(cameras_, 0, 1), {{Eigen::Vector3d::UnitZ(), 1e-7}});
  ASSERT_TRUE(fit);
  EXPECT_LT(fit->line.direction_world.cross(Eigen::Vector3d::UnitZ()).norm(), 1e-4);
}

TEST_F(LineFitting, KeepsLevelWithAnyHeading) {
  // The true line, seen in a world whose z leans so that it is level, and off that by a little.
  const Eigen::Vector3d level_axis =
      (kTrue.direction_world.unitOrthogonal() + 0.02 * kTrue.direction_world).normalized();
  const auto fit = Fit(CollectPlaces(cameras_, 0, 1), {{level_axis, 1e-7, true}});
  ASSERT_TRUE(fit);
  EXPECT_NEAR(fit->line.direction_world.dot(level_axis), 0, 1e-5);
  const Eigen::Vector3d heading = level_axis.cross(kTrue.direction_world).normalized();
  EXPECT_NEAR(fit->line.direction_world.dot(heading), 0, 0.02);
}

constexpr double kEdge_px = 40.3;

// Dark on the right of an upright edge at kEdge_px and `bright` on its left, seen through a lens
// and clipped to 8 bits.
cv::Mat BlurredStep(double bright) {
  constexpr double kDark = 60, kBlur_px = 0.7;
  cv::Mat image(60, 80, CV_8UC1);
  for (int u = 0; u < image.cols; ++u) {
    const double share = 0.5 * std::erfc((u - kEdge_px) / (kBlur_px * std::sqrt(2.0)));
    const double grey = kDark + share * (bright - kDark);
    image.col(u).setTo(std::clamp(std::round(grey), 0.0, 255.0));
  }
  return image;
}

// Where samples along a line that is expected half a pixel beside the edge find it, on average.
double MeanEdge_px(const cv::Mat& image) {
  const cv::Mat mask(image.size(), CV_8UC1, 255);
  // Upwards, so that the bright side is on the left.
  const LineInView line{{{kEdge_px + 0.5, 50}, {kEdge_px + 0.5, 10}}, 0, 1, 2, 2};
  double sum = 0, count = 0;
  for (const LineSample& sample : SampleLine(image, mask, line, LineSampling())) {
    if (!sample.is_edge) continue;
    const Eigen::Vector2d normal(-1, 0);  // to the left
    sum += (sample.px + sample.across_px * normal).x();
    ++count;
  }
  EXPECT_GT(count, 5);
  return sum / count;
}

// Beside a window it is saturated: one shift for all leaves some of it; unshifted they are off by
// up to 0.8 px.
TEST(LineSamples, FindAnEdgeBelowThePixel) {
  for (const auto& [bright, off_px] :
       {std::pair(200, 0.08), std::pair(450, 0.4), std::pair(600, 0.4), std::pair(800, 0.4)}) {
    EXPECT_NEAR(MeanEdge_px(BlurredStep(bright)), kEdge_px, off_px) << bright;
  }
}

// A screen of 1 m x 1 m at 2 m, in points every 4 cm that face the camera.
std::vector<DensePoint> DenseScreen(double normal_y = -1) {
  std::vector<DensePoint> points;
  for (int x = -12; x <= 12; ++x) {
    for (int z = -12; z <= 12; ++z) {
      points.push_back({{0.04 * x, 2, 0.04 * z}, {0, normal_y, 0}, 0, 0});
    }
  }
  return points;
}

ViewCameras OneView() {
  const Views views = {LookingAtWall({0, 0, 0}, 100)};
  return ViewCameras(views, PaintedWall(views).rig());
}

const Eigen::Vector2d kMiddle_px(239.5, 159.5);

TEST(VisibilityDepths, ASurfaceHidesWhatIsBehindIt) {
  const VisibilityDepths depths(DenseScreen(), 0.04, OneView());
  EXPECT_TRUE(depths.Hides(0, 0, kMiddle_px, 3));
  EXPECT_TRUE(depths.Hides(0, 1, kMiddle_px, 3));
  EXPECT_FALSE(depths.Hides(0, 0, kMiddle_px, 2.05)) << "a line on it";
  EXPECT_FALSE(depths.Hides(0, 0, kMiddle_px, 1)) << "before it";
  // Its border is 75 px from the middle.
  EXPECT_TRUE(depths.Hides(0, 0, kMiddle_px + Eigen::Vector2d(60, 0), 3));
  EXPECT_FALSE(depths.Hides(0, 0, kMiddle_px + Eigen::Vector2d(90, 0), 3));
  EXPECT_FALSE(depths.Hides(0, 0, {-5, 20}, 3)) << "outside the image";
}

TEST(VisibilityDepths, BacksAndUnknownSurfacesHideNothing) {
  EXPECT_FALSE(VisibilityDepths(DenseScreen(1), 0.04, OneView()).Hides(0, 0, kMiddle_px, 3));
  EXPECT_FALSE(VisibilityDepths().Hides(0, 0, kMiddle_px, 3));
  const Progress stop([](double) { return false; });
  EXPECT_FALSE(VisibilityDepths(DenseScreen(), 0.04, OneView(), stop).Hides(0, 0, kMiddle_px, 3));
}

}  // namespace
}  // namespace slcmap
