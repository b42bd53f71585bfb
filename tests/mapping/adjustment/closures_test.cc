#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <opencv2/imgproc.hpp>
#include <random>
#include <set>

#include "mapping/adjustment/adjustment_problem.h"
#include "mapping/adjustment/adjustment_state.h"
#include "mapping/adjustment/closure.h"
#include "odometry/geometry/pinhole.h"
#include "tests/testing/box_room_renderer.h"
#include "tests/testing/forward_rig.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;

constexpr double kTolerance_m = 0.01;
const Shift kShift(0.03, -0.02, 0.01, 0.004);
const ShiftSigma kShiftSigma{0.03, 0.01};

// A corner of the building seen again, of which one direction is not told, and where it is.
ShiftVote VoteAt(const Eigen::Vector3d& place, int untold, const Shift& shift,
                 std::mt19937* generator) {
  Eigen::Matrix<double, 3, 4> moved;
  moved << Eigen::Matrix3d::Identity(), Eigen::Vector3d::UnitZ().cross(place);
  ShiftVote vote;
  vote.by_shift << moved.row((untold + 1) % 3), moved.row((untold + 2) % 3);
  vote.by_shift /= kTolerance_m;
  std::normal_distribution<double> noise(0, 0.1);
  vote.alternatives = {vote.by_shift * shift +
                       Eigen::Vector2d(noise(*generator), noise(*generator))};
  return vote;
}

// So many right votes, and so many that say anything within the gate.
std::vector<ShiftVote> Votes(int right, int wrong) {
  std::mt19937 generator(1);
  std::uniform_real_distribution<double> place(-3, 3), anything(-0.08, 0.08);
  std::vector<ShiftVote> votes;
  for (int i = 0; i < right + wrong; ++i) {
    const Eigen::Vector3d at(place(generator), place(generator), place(generator));
    const Shift shift =
        i < right ? kShift
                  : Shift(anything(generator), anything(generator), anything(generator), 0);
    votes.push_back(VoteAt(at, i % 3, shift, &generator));
  }
  return votes;
}

TEST(Agreement, IsFoundAmongAsManyWrongMatches) {
  const Agreement agreement = FindAgreement(Votes(20, 20), kShiftSigma, 0.025);
  EXPECT_LT((agreement.shift - kShift).head<3>().norm(), 0.005);
  EXPECT_NEAR(agreement.shift[3], kShift[3], 0.002);
  EXPECT_GE(agreement.votes, 19);
  EXPECT_LT(1.5 * agreement.runner_up, agreement.votes);
  for (size_t i = 0; i < 19; ++i) EXPECT_EQ(agreement.chosen[i], 0);
  EXPECT_LT(FindAgreement(Votes(0, 40), kShiftSigma, 0.025).votes, 20) << "wrong ones alone";
}

// Doors one period apart: half of what is seen fits one shift, half another.
TEST(Agreement, ASecondShiftIsToldOf) {
  std::vector<ShiftVote> votes = Votes(20, 0);
  for (ShiftVote& vote : votes) {
    vote.alternatives.push_back(vote.alternatives[0] + vote.by_shift * Shift(-0.06, 0, 0, 0));
  }
  const Agreement agreement = FindAgreement(votes, kShiftSigma, 0.025);
  EXPECT_GE(agreement.votes, 19);
  EXPECT_GE(agreement.runner_up, 19);
}

TEST(Agreement, WhatIsNotToldStaysZeroAndBeyondTheGateNothingIsFound) {
  std::mt19937 generator(2);
  std::vector<ShiftVote> along_corridor, far;
  for (int i = 0; i < 30; ++i) {
    along_corridor.push_back(VoteAt({0, 0.1 * i, 0}, 0, Shift(0, 0.02, 0.01, 0), &generator));
    far.push_back(VoteAt({0.2 * i, 1, 2}, i % 3, Shift(1, 1, 1, 0), &generator));
  }
  const Agreement agreement = FindAgreement(along_corridor, kShiftSigma, 0.025);
  EXPECT_LT((agreement.shift - Shift(0, 0.02, 0.01, 0)).head<3>().norm(), 0.003);
  EXPECT_EQ(agreement.runner_up, 0);
  EXPECT_EQ(FindAgreement(far, kShiftSigma, 0.025).votes, 0);
  EXPECT_EQ(FindAgreement({}, kShiftSigma, 0.025).votes, 0);
}

// Places that are recognised by the edges of the building that are seen there.

constexpr int kKeyframesOfVisit = 4;
constexpr double kRound_m = 20, kRound_s = 30;  // from visit to visit

// The middles of three verticals and of three edges along Y, seen from x = 0.
const std::vector<std::pair<Vector3d, LineAxis>> kEdges = {
    {{4, -1, 1}, LineAxis::kVertical},  {{4.5, 0.3, 1}, LineAxis::kVertical},
    {{5, 1.4, 1}, LineAxis::kVertical}, {{4, 0, 2.2}, LineAxis::kY},
    {{4.6, 0.5, 0.1}, LineAxis::kY},    {{5.2, 0.2, 1.3}, LineAxis::kY}};

Vector3d Along(LineAxis axis) {
  return axis == LineAxis::kVertical ? Vector3d::UnitZ() : Vector3d::UnitY();
}

// Rounds that come back to the same place, each where odometry has drifted to; at one of them two
// of the edges are seen.
OdometryRun Visits(const std::vector<Vector3d>& drifts, size_t fleeting = 1000) {
  OdometryRun run;
  run.rectified_rig = testing::ForwardRig();
  run.manhattan_worlds.emplace_back();
  run.keyframes.reserve(100);
  for (size_t visit = 0; visit < drifts.size(); ++visit) {
    const int64_t first_id = std::ssize(run.lines);
    const size_t edges = visit == fleeting ? 2 : kEdges.size();
    for (size_t i = 0; i < kEdges.size(); ++i) {
      const auto& [middle, axis] = kEdges[i];
      Line line;
      line.id = first_id + static_cast<int64_t>(i);
      line.axis = axis;
      line.world = axis == LineAxis::kY ? 0 : -1;
      line.start_world = middle + drifts[visit] - 0.5 * Along(axis);
      line.end_world = middle + drifts[visit] + 0.5 * Along(axis);
      run.lines.push_back(line);
    }
    // At the place, and at the other end of the round.
    for (int k = 0; k <= kKeyframesOfVisit; ++k) {
      const bool is_there = k < kKeyframesOfVisit;
      Keyframe keyframe;
      keyframe.id = std::ssize(run.keyframes);
      keyframe.stamp_ns = ToNanoseconds(kRound_s * static_cast<double>(visit) + 0.5 * k +
                                        (is_there ? 0 : kRound_s / 2));
      keyframe.T_world_imu.translation =
          drifts[visit] + Vector3d(is_there ? 0.2 * k : -kRound_m / 2, 0, 1.2);
      for (size_t i = 0; is_there && i < edges; ++i) {
        keyframe.lines.push_back({first_id + static_cast<int64_t>(i), {{1, 1}, {2, 2}}, {}});
      }
      run.keyframes.push_back(std::move(keyframe));
    }
  }
  return run;
}

// By closure, the visit of the older edges and that of the newer ones.
std::vector<std::pair<size_t, size_t>> ClosedVisits(const OdometryRun& run) {
  const AdjustmentState state = StateOfRun(run, {});
  std::vector<std::pair<size_t, size_t>> visits;
  for (const Closure& closure : FindEdgeClosures(state, {})) {
    std::set<size_t> older, newer;
    for (const EdgeMatch& match : closure.edges) {
      EXPECT_EQ(match.older % kEdges.size(), match.newer % kEdges.size());
      older.insert(match.older / kEdges.size());
      newer.insert(match.newer / kEdges.size());
    }
    EXPECT_EQ(older.size(), 1U);
    EXPECT_EQ(newer.size(), 1U);
    visits.emplace_back(*older.begin(), *newer.begin());
  }
  return visits;
}

TEST(EdgeClosures, APlaceIsRecognisedAtItsNextVisits) {
  const Vector3d first = Vector3d::Zero();
  using Closed = std::vector<std::pair<size_t, size_t>>;
  EXPECT_EQ(ClosedVisits(Visits({first, {0.01, -0.02, 0}})), (Closed{{0, 1}}));
  EXPECT_EQ(ClosedVisits(Visits({first})), Closed());
  EXPECT_EQ(ClosedVisits(Visits({first, {0, 0.3, 0}})), Closed()) << "beyond odometry's drift";
  // Against each of the visits before, all edges agree on another shift: none of these would stand
  // out among all edges that were seen before.
  EXPECT_EQ(
      ClosedVisits(Visits({first, {0, 0.027, 0}, {0, 0.054, 0}, {0, 0.081, 0}, {0, 0.108, 0}})),
      (Closed{{0, 1}, {1, 2}, {2, 3}, {3, 4}}));
  // Some places are tied to their first visit.
  EXPECT_EQ(ClosedVisits(Visits({first, {0, 0.004, 0}, {0, 0.008, 0}, {0, 0.012, 0}})),
            (Closed{{0, 1}, {1, 2}, {0, 2}, {2, 3}}));
}

// Lines that no keyframe sees are not of the state: the third visit's are its ninth to fourteenth.
TEST(EdgeClosures, WhereTheLatestVisitSawTooLittleAnEarlierOneCounts) {
  const OdometryRun run = Visits({Vector3d::Zero(), {0, 0.01, 0}, {0, 0.02, 0}}, 1);
  const std::vector<Closure> closures = FindEdgeClosures(StateOfRun(run, {}), {});
  ASSERT_EQ(closures.size(), 1U);
  ASSERT_EQ(closures[0].edges.size(), kEdges.size());
  for (const EdgeMatch& match : closures[0].edges) EXPECT_EQ(match.newer - match.older, 8U);
}

// Revisits of a textured room, recognised by the points of its walls.

constexpr int kViews = 19;

// Along a wall and back, looking at it all the time.
MotionSpline OutAndBack() {
  constexpr double kKnot_s = 0.1, kDuration_s = 20, kReach_m = 1.5;
  const Eigen::Quaterniond attitude =
      CameraLookingAlong(Vector3d::UnitY()) * SmallRig().T_imu_camera[0].rotation.conjugate();
  std::vector<RigidTransform> control;
  for (double t_s = 0; t_s < kDuration_s + 0.5; t_s += kKnot_s) {
    const double x_m = kReach_m * (1 - std::cos(2 * M_PI * t_s / kDuration_s));
    control.emplace_back(attitude, Vector3d(x_m, 0, 0));
  }
  return MotionSpline(kKnot_s, control);
}

// Dots as far apart in all images, whatever they look at.
cv::Mat Dots(const cv::Size& size) {
  constexpr int kPeriod_px = 8;
  cv::Mat image(size, CV_8UC1, cv::Scalar(40));
  for (int x = 0; x < size.width; x += kPeriod_px) {
    for (int y = 0; y < size.height; y += kPeriod_px) {
      cv::rectangle(image, {x, y, kPeriod_px / 2, kPeriod_px / 2}, cv::Scalar(200), cv::FILLED);
    }
  }
  cv::GaussianBlur(image, image, {0, 0}, 0.8);
  return image;
}

class WallImages final : public ViewImages {
 public:
  WallImages() : task_{SmallRig(), OutAndBack(), {}} {
    for (int i = 0; i < kViews; ++i) task_.times_s.push_back(0.5 + i);
    renderer_ = std::make_unique<BoxRoomRenderer>(task_, 3.0);
  }

  RigidTransform TruePose(size_t view) const { return task_.motion.PoseAt(task_.times_s[view]); }
  RenderedPair Render(size_t view) const { return renderer_->Render(static_cast<int>(view), true); }
  void ShowDots() { shows_dots_ = true; }

  const Rig& rig() const override { return task_.rig; }
  const cv::Mat& mask(int) const override { return mask_; }
  StereoImage Read(size_t view) const override {
    const RenderedPair pair = Render(view);
    if (!shows_dots_) return {ToNanoseconds(task_.times_s[view]), pair.left, pair.right};
    return {ToNanoseconds(task_.times_s[view]), Dots(pair.left.size()), {}};
  }

 private:
  RenderTask task_;
  std::unique_ptr<BoxRoomRenderer> renderer_;
  cv::Mat mask_;
  bool shows_dots_ = false;
};

// The corners of a view, seen in it and in the next one.
void AddCorners(const WallImages& images, size_t view, OdometryRun* run) {
  const Camera& camera = images.rig().cameras[0];
  const RenderedPair pair = images.Render(view);
  std::vector<cv::Point2f> corners;
  cv::goodFeaturesToTrack(pair.left, corners, 80, 0.01, 8);
  const auto T_world_camera = [&](size_t of) {
    return images.TruePose(of) * images.rig().T_imu_camera[0];
  };
  for (const cv::Point2f& corner : corners) {
    const Eigen::Vector2d px(corner.x, corner.y);
    const double depth_m = pair.depth_m.at<float>(static_cast<int>(std::lround(corner.y)),
                                                  static_cast<int>(std::lround(corner.x)));
    if (!(depth_m > 0.5)) continue;
    const Vector3d p_true =
        T_world_camera(view) * Vector3d(depth_m * PlaneFromPixel(camera, px).homogeneous());
    const int64_t id = std::ssize(run->landmarks);
    const size_t next = std::min<size_t>(view + 1, kViews - 1);
    run->landmarks.push_back({id, 0, p_true, 0.01, 2});
    run->keyframes[view].observations.push_back({id, px, {}});
    if (next == view) continue;
    const Vector3d p_next = T_world_camera(next).Inverse() * p_true;
    run->keyframes[next].observations.push_back(
        {id, PixelFromPlane(camera, p_next.hnormalized()), {}});
  }
}

// A run that has drifted by so much when it comes back.
OdometryRun RunWithDrift(const WallImages& images, const Vector3d& drift_m) {
  OdometryRun run;
  run.rectified_rig = images.rig();
  for (size_t k = 0; k < kViews; ++k) {
    run.keyframes.push_back({static_cast<int64_t>(k),
                             0,
                             ToNanoseconds(0.5 + static_cast<double>(k)),
                             images.TruePose(k),
                             {},
                             {}});
  }
  for (size_t k = 0; k < kViews; ++k) {
    const size_t first = run.landmarks.size();
    AddCorners(images, k, &run);
    if (k <= kViews / 2) continue;
    run.keyframes[k].T_world_imu.translation += drift_m;
    for (size_t i = first; i < run.landmarks.size(); ++i) run.landmarks[i].p_world += drift_m;
  }
  return run;
}

// The images are small: what is 2 px in others is less in them.
ClosureOptions ForSmallImages() {
  ClosureOptions options;
  options.min_path_m = 2;
  options.min_interval_s = 5;
  options.point_tolerance_px = 0.5;
  return options;
}

std::vector<Closure> Find(const WallImages& images, const OdometryRun& run,
                          const ClosureOptions& closures = ForSmallImages()) {
  AdjustmentOptions options;
  options.closures = closures;
  const AdjustmentModel model(run, options);
  return FindPointClosures(StateOfRun(run, options), images, model.points, options.closures);
}

std::vector<Closure> Find(const WallImages& images, const Vector3d& drift_m,
                          const ClosureOptions& closures = ForSmallImages()) {
  return Find(images, RunWithDrift(images, drift_m), closures);
}

TEST(PointClosures, TellHowFarVisitsAreApart) {
  const Vector3d drift_m(0.012, 0.004, -0.008);
  const WallImages images;
  const std::vector<Closure> closures = Find(images, drift_m);
  ASSERT_GE(closures.size(), 3u);
  for (const Closure& closure : closures) {
    EXPECT_LT((closure.shift.head<3>() + drift_m).norm(), 0.005) << closure.shift.transpose();
    EXPECT_GE(closure.points.size(), 15u);
    EXPECT_LT(closure.older_frame, closure.newer_frame);
  }
  EXPECT_TRUE(Find(images, {0.3, 0, 0.1}).empty()) << "beyond what odometry may have drifted";
}

TEST(PointClosures, OfManySomeAreKeptEvenlyAlongTheWay) {
  const WallImages images;
  const OdometryRun run = RunWithDrift(images, Vector3d::Zero());
  const std::vector<Closure> all = Find(images, run);
  ASSERT_GE(all.size(), 4u);
  ClosureOptions options = ForSmallImages();
  options.max_point_closures = 2;
  const std::vector<Closure> some = Find(images, run, options);
  ASSERT_EQ(some.size(), 2u);
  EXPECT_EQ(some[0].newer_frame, all[0].newer_frame);
  EXPECT_EQ(some[1].newer_frame, all[(all.size() + 1) / 2].newer_frame);
}

// What repeats within the gate, as doors one period apart would, fits several shifts alike.
TEST(PointClosures, OfWhatLooksAlikeThereAreNone) {
  WallImages images;
  ClosureOptions options = ForSmallImages();
  options.gate_m = 0.3;
  const Vector3d drift_m(0.05, 0, 0.02);
  EXPECT_FALSE(Find(images, drift_m, options).empty());
  images.ShowDots();
  EXPECT_TRUE(Find(images, drift_m, options).empty());
}

// As if the run had followed the points of the way out all the way back.
void FollowAll(const WallImages& images, OdometryRun* run) {
  const Camera& camera = images.rig().cameras[0];
  for (size_t k = kViews / 2 + 1; k < kViews; ++k) {
    const RigidTransform T_world_camera = images.TruePose(k) * images.rig().T_imu_camera[0];
    auto& observations = run->keyframes[k].observations;
    std::set<int64_t> seen;
    for (const auto& observation : observations) seen.insert(observation.landmark_id);
    for (const Landmark& landmark : run->landmarks) {
      const Vector3d p = T_world_camera.Inverse() * landmark.p_world;
      if (p.z() < 0.5 || !seen.insert(landmark.id).second) continue;
      observations.push_back({landmark.id, PixelFromPlane(camera, p.hnormalized()), {}});
    }
  }
}

TEST(PointClosures, WhatOdometryFollowedAllTheWayIsNoRevisit) {
  const WallImages images;
  OdometryRun run = RunWithDrift(images, Vector3d::Zero());
  FollowAll(images, &run);
  EXPECT_TRUE(Find(images, run).empty());
}

}  // namespace
}  // namespace slcmap
