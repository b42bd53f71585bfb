#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "odometry/window/landmark_information.h"
#include "odometry/window/line_landmarks.h"
#include "odometry/window/line_priors.h"
#include "tests/odometry/window/line_scene.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int64_t kPoint = 3;

class LineMembersTest : public testing::LineScene {
 protected:
  void SetUp() override {
    MakeLine(0.3, &heading_, &line_);
    point_.id = kPoint;
  }

  // `seen(frame, camera)` is what a camera takes for the point.
  template <typename Seen>
  void Look(int frames, const Seen& seen) {
    for (int i = 0; i < frames; ++i) {
      FrameState& frame = *AddFrame(i, &line_);
      frame.measurements[kPoint] = {OnPlane(i, 0, seen(i, 0)), OnPlane(i, 1, seen(i, 1))};
      point_.frames.push_back(&frame);
    }
    SetPoint(seen(0, 0));
  }

  void SetPoint(const Vector3d& p_world) {
    const Vector2d at = OnPlane(0, 0, p_world);
    const RigidTransform T_world_camera = Pose(0) * rig_.T_imu_camera[0];
    point_.point = {at.x(), at.y(), 1 / (T_world_camera.Inverse() * p_world).z()};
    point_.triangulated = true;
  }

  // The same view in all frames and cameras: a point of the world.
  static auto Fixed(const Vector3d& p_world) {
    return [p_world](int, int) { return p_world; };
  }

  // Where a nearer vertical edge hides the line from a camera.
  Vector3d Crossing(int i, int camera) const {
    const Vector3d centre = (Pose(i) * rig_.T_imu_camera[camera]).translation;
    const Vector3d through = T_world_camera_ * Vector3d(0, 0, 0.8 * kDepth_m);
    const Vector3d normal = (through - centre).cross(Vector3d::UnitZ());
    return At(0) + normal.dot(centre - At(0)) / normal.x() * Vector3d::UnitX();
  }

  Membership Judge(const LineLandmarkOptions& options = {}) const {
    return JudgeMembership(options, point_, line_, model_, Prior());
  }

  HeadingState heading_;
  LineLandmark line_;
  PointLandmark point_;
};

TEST_F(LineMembersTest, APointOnTheLineBelongsToIt) {
  Look(4, Fixed(At(0)));
  EXPECT_EQ(Judge(), Membership::kHolds);
}

// Its own observations tell, wherever its line has pulled it.
TEST_F(LineMembersTest, APointBesideTheLineDoesNot) {
  Look(4, Fixed(At(0.12)));
  EXPECT_EQ(Judge(), Membership::kRefuted);
  SetPoint(At(0));
  EXPECT_EQ(Judge(), Membership::kRefuted);
  EXPECT_LT((PlaceByObservations(point_, model_)->p_world - At(0.12)).norm(), 0.005);
}

TEST_F(LineMembersTest, WhatIsNotWellEnoughKnownStaysOpen) {
  Look(4, Fixed(At(0)));
  LineLandmarkOptions strict;
  strict.max_member_sigma_m = 0.002;
  EXPECT_EQ(Judge(strict), Membership::kOpen);
  point_.frames.resize(1);
  EXPECT_EQ(Judge(), Membership::kOpen);  // a single view
  window_.frames[0]->measurements.at(kPoint).right.reset();
  EXPECT_FALSE(PlaceByObservations(point_, model_).has_value());  // a ray
}

TEST_F(LineMembersTest, ObservationsThatDoNotAgreeOnAPlaceRefute) {
  Look(4, Fixed(At(0)));
  for (auto& frame : window_.frames) {
    frame->measurements.at(kPoint).left.x() += 0.003 * static_cast<double>(frame->id * frame->id);
  }
  EXPECT_EQ(Judge(), Membership::kRefuted);
}

TEST_F(LineMembersTest, WhereANearerEdgeCrossesTheLineIsNoPointOfIt) {
  Look(4, [&](int i, int camera) { return Crossing(i, camera); });
  for (int i = 0; i < 4; ++i) {
    const StereoMeasurement& m = window_.frames[static_cast<size_t>(i)]->measurements.at(kPoint);
    EXPECT_NEAR(m.left.y(), OnPlane(i, 0, At(0)).y(), 1e-9);
    EXPECT_NEAR(m.right->y(), OnPlane(i, 1, At(0)).y(), 1e-9);
  }
  EXPECT_EQ(Judge(), Membership::kRefuted);
}

TEST_F(LineMembersTest, LinesTakeWhatHoldsAndKeepWhatHasLeftButNotWhatIsForgotten) {
  Look(4, Fixed(At(0)));
  PointLandmark beside = point_;
  beside.id = 4;
  for (auto& frame : window_.frames) {
    const int i = static_cast<int>(frame->id);
    frame->measurements[4] = {OnPlane(i, 0, At(0.12)), OnPlane(i, 1, At(0.12))};
  }
  beside.point[1] = OnPlane(0, 0, At(0.12)).y();
  window_.landmarks = {{kPoint, point_}, {4, beside}};
  window_.lines = {{kLine, line_}};
  PointsOnLines memberships;
  const std::vector<LineObservation> lines = {
      {kLine, {{300, 100}, {300, 300}}, LineSegment{{280, 100}, {280, 300}}}};
  const std::vector<PointObservation> points = {{kPoint, {300, 150}, Vector2d(280, 150)},
                                                {4, {300, 200}, Vector2d(280, 200)},
                                                {5, {300, 250}, Vector2d(280, 250)}};
  for (int i = 0; i < 4; ++i) memberships.AddKeyframe(points, lines);
  const std::vector<int64_t>& members = window_.lines.at(kLine).points;
  UpdateMembers({}, model_, &memberships, &window_);
  EXPECT_EQ(members, std::vector<int64_t>{kPoint});
  EXPECT_EQ(memberships.CollectPoints(kLine), (std::vector<int64_t>{kPoint, 5}));
  window_.landmarks.clear();
  UpdateMembers({}, model_, &memberships, &window_);
  EXPECT_EQ(members, std::vector<int64_t>{kPoint});
  RemoveMembers({kPoint}, &memberships, &window_);
  EXPECT_TRUE(members.empty());
  UpdateMembers({}, model_, &memberships, &window_);
  EXPECT_TRUE(members.empty());
}

// Memberships that hold in the images: three points on each of the lines.
PointsOnLines InImages(const std::vector<int64_t>& line_ids) {
  PointsOnLines memberships;
  for (const int64_t id : line_ids) {
    const std::vector<LineObservation> lines = {
        {id, {{300, 100}, {300, 300}}, LineSegment{{280, 100}, {280, 300}}}};
    const std::vector<PointObservation> points = {{kPoint, {300, 150}, Vector2d(280, 150)},
                                                  {5, {300, 200}, Vector2d(280, 200)},
                                                  {6, {300, 250}, Vector2d(280, 250)}};
    for (int i = 0; i < 4; ++i) memberships.AddKeyframe(points, lines);
  }
  return memberships;
}

TEST_F(LineMembersTest, AMergedLineHandsOnItsPointsButNotWhatWasRefuted) {
  line_.extent.Add(0, 2);
  LineLandmark newer = line_;
  newer.id = kLine + 1;
  line_.points = {6};
  newer.points = {kPoint, 5, 6};
  window_.lines = {{line_.id, line_}, {newer.id, newer}};
  PointsOnLines memberships = InImages({kLine, newer.id});
  memberships.Release({5, kLine});
  ASSERT_EQ(MergeLines(model_, &window_).size(), 1u);
  MergeMembers(newer.id, kLine, &memberships, &window_);
  EXPECT_EQ(window_.lines.at(kLine).points, (std::vector<int64_t>{6, kPoint}));
  EXPECT_EQ(memberships.CollectPoints(kLine), (std::vector<int64_t>{kPoint, 6}));
  EXPECT_TRUE(memberships.CollectPoints(newer.id).empty());
  EXPECT_TRUE(window_.lines.at(newer.id).points.empty());
}

TEST_F(LineMembersTest, ALineThatAWrongPointPlacedStandsOnItsViewsOrNotAtAll) {
  Look(4, [&](int i, int camera) { return Crossing(i, camera); });
  line_.placed_by = kPoint;
  line_.points = {kPoint};
  window_.landmarks = {{kPoint, point_}};
  window_.lines = {{kLine, line_}};
  PointsOnLines memberships = InImages({kLine});
  const auto misplaced = UpdateMembers({}, model_, &memberships, &window_);
  EXPECT_EQ(misplaced, std::unordered_set<int64_t>{kLine});
  EXPECT_EQ(memberships.CollectPoints(kLine), (std::vector<int64_t>{5, 6}));
  LineLandmark& line = window_.lines.at(kLine);
  EXPECT_TRUE(RetireMisplaced({}, misplaced, model_, &window_).empty());
  EXPECT_FALSE(line.retired);
  EXPECT_FALSE(line.placed_by);
  line.frames.resize(1);
  window_.frames[0]->lines.at(kLine).right.reset();
  EXPECT_EQ(RetireMisplaced({}, misplaced, model_, &window_), misplaced);
  EXPECT_TRUE(line.retired);
  EXPECT_FALSE(window_.frames[0]->lines.contains(kLine));
}

}  // namespace
}  // namespace slcmap
