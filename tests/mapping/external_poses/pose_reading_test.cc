#include "mapping/external_poses/pose_reading.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "mapping/external_poses/read_poses.h"

namespace slcmap {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// A walk that turns about all axes, at 100 Hz for 20 s.
RigidTransform Walk(double t_s) {
  return {ExpRotation({0.3 * std::sin(0.9 * t_s), 0.25 * std::sin(1.3 * t_s + 1), 0}) *
              ExpRotation({0, 0, 0.4 * t_s + 0.5 * std::sin(0.7 * t_s)}),
          {2 * std::cos(0.3 * t_s), 1.5 * std::sin(0.5 * t_s), 0.2 * std::sin(1.1 * t_s)}};
}

const RigidTransform kT_imu_camera{ExpRotation({-1.2, 1.2, -1.2}), {0.05, -0.02, 0.07}};

// The table as a file with this form would hold the walk.
PoseTable FormatRows(const PoseForm& form, double late_s = 0, int rate_hz = 100) {
  PoseTable table;
  for (int i = 0; i < 20 * rate_hz; ++i) {
    const double t_s = static_cast<double>(i) / rate_hz;
    RigidTransform T = Walk(t_s);
    if (form.IsOfCamera()) T = T * kT_imu_camera;
    if (form.IsInverse()) T = T.Inverse();
    const Eigen::Quaterniond q = form.IsConjugated() ? T.rotation.conjugate() : T.rotation;
    PoseRow row{
        ToNanoseconds(t_s + late_s), T.translation / form.scale, {q.x(), q.y(), q.z(), q.w()}};
    if (form.quaternion.starts_with("wxyz")) row.quaternion = {q.w(), q.x(), q.y(), q.z()};
    table.rows.push_back(row);
  }
  return table;
}

// With the noise that images have, times a number.
std::vector<BodyStep> Steps(double times = 1) {
  std::vector<BodyStep> steps;
  for (int i = 1; i < 38; ++i) {
    const double from_s = 0.5 * i, to_s = from_s + 0.5;
    const RigidTransform noise{
        ExpRotation(times *
                    Eigen::Vector3d(0.002 * std::sin(7.0 * i), 0.002 * std::sin(5.0 * i), 0)),
        times * Eigen::Vector3d(0.01 * std::sin(3.0 * i), 0.01 * std::cos(11.0 * i), 0)};
    steps.push_back(
        {ToNanoseconds(from_s), ToNanoseconds(to_s), Walk(from_s).Inverse() * Walk(to_s) * noise});
  }
  return steps;
}

PoseReading Judge(const PoseTable& table, const PoseForm& form = {}) {
  return ClassifyReading(table, form, Steps(), kT_imu_camera, "steps");
}

TEST(PoseReading, GoodPosesAgree) {
  for (const int rate_hz : {100, 20, 2}) {
    const PoseReading reading = Judge(FormatRows({}, 0, rate_hz));
    EXPECT_TRUE(reading.is_judged) << rate_hz;
    EXPECT_TRUE(reading.agrees) << rate_hz << ": " << reading.words;
    EXPECT_EQ(reading.change, "") << rate_hz;
  }
  PoseTable drifting = FormatRows({});
  for (PoseRow& row : drifting.rows) row.p *= 1.01;
  EXPECT_TRUE(Judge(drifting).agrees) << Judge(drifting).words;
}

Eigen::Quaterniond GetTurn(const PoseRow& row) {
  const auto& q = row.quaternion;
  return {q[3], q[0], q[1], q[2]};
}

void SetTurn(const Eigen::Quaterniond& q, PoseRow* row) {
  row->quaternion = {q.x(), q.y(), q.z(), q.w()};
}

TEST(PoseReading, EachFormIsNamedAndTheRemedyAgrees) {
  for (const PoseForm& form : std::vector<PoseForm>{{.quaternion = "xyzw-conjugated"},
                                                    {.quaternion = "wxyz"},
                                                    {.quaternion = "wxyz-conjugated"},
                                                    {.of = "camera"},
                                                    {.of = "world-in-camera"},
                                                    {.of = "world-in-imu"},
                                                    {.of = "camera", .quaternion = "wxyz"},
                                                    {.scale = 2},
                                                    {.of = "camera", .scale = 0.001},
                                                    {.scale = 1 / 1.05}}) {
    const PoseTable table = FormatRows(form);
    const PoseReading reading = Judge(table);
    const std::string name = FormatOptions(form);
    EXPECT_FALSE(reading.agrees) << name;
    EXPECT_TRUE(reading.is_explained) << name << ": " << reading.words;
    EXPECT_EQ(reading.form.of, form.of) << name;
    EXPECT_EQ(reading.form.quaternion, form.quaternion) << name;
    EXPECT_NEAR(reading.form.scale / form.scale, 1, 0.01) << name;
    EXPECT_EQ(reading.form.offset_s, 0) << name;
    EXPECT_TRUE(Judge(table, reading.form).agrees)
        << name << ": " << Judge(table, reading.form).words;
  }
}

TEST(PoseReading, AScaleIsThatOfPositionsNotOfTheLever) {
  for (const char* of : {"camera", "world-in-camera"}) {
    const PoseReading reading = Judge(FormatRows({.of = of, .scale = 10}));
    EXPECT_EQ(reading.form.of, of);
    EXPECT_EQ(reading.form.scale, 10);
    EXPECT_LT(reading.best.way_m, 0.015);
  }
}

TEST(PoseReading, WhatHasNoRemedyIsNamedOrSaidToFitByNoReading) {
  const PoseTable good = FormatRows({});
  PoseTable mirrored = good, positions = good, other_axes = good, alike = good, others = good;
  for (PoseRow& row : mirrored.rows) {  // y of world and body
    row.p.y() *= -1;
    row.quaternion[0] *= -1;
    row.quaternion[2] *= -1;
  }
  for (PoseRow& row : positions.rows) row.p.x() *= -1;
  for (PoseRow& row : other_axes.rows) {  // forward, right, down
    SetTurn(GetTurn(row) * Eigen::Quaterniond(0, 1, 0, 0), &row);
  }
  for (PoseRow& row : alike.rows) row.quaternion = {0, 0, 0, 1};
  for (size_t i = 0; i < others.rows.size(); ++i) {  // of another walk
    SetTurn(ExpRotation({0, std::sin(0.05 * static_cast<double>(i)), 0}), &others.rows[i]);
  }
  for (const auto& [table, words] :
       {std::pair{mirrored, "the poses are mirrored, in left-handed axes (axes x, y, z that are "},
        {positions, "the positions are mirrored, in left-handed axes (x, y, z are -x, y, z"},
        {other_axes, "a body that is turned (axes x, y, z that are x, -y, -z of"},
        {alike, "their rotations are all the same"},
        {others, "they fit by no reading"}}) {
    const PoseReading reading = Judge(table);
    EXPECT_FALSE(reading.agrees) << words;
    EXPECT_FALSE(reading.is_explained) << words;
    EXPECT_THAT(reading.words, HasSubstr(words));
  }
}

TEST(PoseReading, StampsThatAreLateOrHaveAnotherStartAreNamed) {
  for (const double late_s : {0.06, -0.2, 3.0, 1403636579.758, -400.0}) {
    const PoseTable table = FormatRows({}, late_s);
    const PoseReading reading = Judge(table);
    EXPECT_FALSE(reading.agrees) << late_s;
    EXPECT_NEAR(reading.form.offset_s, -late_s, 0.006) << late_s << ": " << reading.words;
    EXPECT_TRUE(Judge(table, reading.form).agrees) << late_s << Judge(table, reading.form).words;
  }
}

// Half way between two poses their noise is less, and that is no reason to move stamps.
TEST(PoseReading, NoiseOfPositionsIsNoClock) {
  std::mt19937 engine(3);
  std::normal_distribution<double> noise_m(0, 0.01);
  for (int trial = 0; trial < 5; ++trial) {
    PoseTable table = FormatRows({}, 0, 20);
    for (PoseRow& row : table.rows) {
      row.p += Eigen::Vector3d(noise_m(engine), noise_m(engine), noise_m(engine));
    }
    const PoseReading reading = ClassifyReading(table, {}, Steps(0), kT_imu_camera, "steps");
    EXPECT_THAT(reading.words, Not(HasSubstr("stamps")));
  }
}

// Straight on, from rest: only how far it goes tells of the clock, and rests tell no scale.
TEST(PoseReading, OfAWalkThatHardlyTurnsTheStampsAndTheScaleAreNamedToo) {
  const auto walk = [](double t_s) {
    const double moved_s = std::max(0.0, t_s - 3);
    return RigidTransform{ExpRotation({0, 0, 0.01 * std::sin(t_s)}),
                          {0.6 * moved_s + 0.25 * std::sin(moved_s), 0.002 * std::sin(5 * t_s), 0}};
  };
  std::vector<BodyStep> steps;
  for (int i = 1; i < 80; ++i) {
    const double from_s = 0.25 * i, to_s = from_s + 0.5;
    steps.push_back(
        {ToNanoseconds(from_s), ToNanoseconds(to_s), walk(from_s).Inverse() * walk(to_s)});
  }
  for (const auto& [late_s, scale] : {std::pair{-1600000000.7, 1.0}, std::pair{0.0, 0.9}}) {
    PoseTable table;
    for (int i = 0; i < 420; ++i) {
      const RigidTransform T = walk(0.05 * i);
      const Eigen::Quaterniond& q = T.rotation;
      table.rows.push_back(
          {ToNanoseconds(0.05 * i + late_s), scale * T.translation, {q.x(), q.y(), q.z(), q.w()}});
    }
    const PoseReading reading = ClassifyReading(table, {}, steps, kT_imu_camera, "steps");
    EXPECT_NEAR(reading.form.offset_s, -late_s, 0.006) << reading.words;
    EXPECT_NEAR(reading.form.scale * scale, 1, 0.01) << reading.words;
    EXPECT_THAT(reading.change, Not(HasSubstr("scale"))) << late_s;
  }
}

TEST(PoseReading, WhatChangesOnTheWayIsSaid) {
  const std::vector<PoseRow> good = FormatRows({}).rows;
  PoseTable late = FormatRows({}), drifting = late, scaled = late;
  for (size_t i = 0; i < good.size(); ++i) {
    if (i >= 800 && i < 1200) {
      late.rows[i].p = good[i - 25].p;
      late.rows[i].quaternion = good[i - 25].quaternion;
    }
    const double share = static_cast<double>(i) / static_cast<double>(good.size());
    SetTurn(ExpRotation({0, 0, 0.35 * share}) * GetTurn(good[i]), &drifting.rows[i]);  // 20 degrees
    if (i >= 1200) scaled.rows[i].p = good[1200].p + 1.3 * (good[i].p - good[1200].p);
  }
  for (const auto& [table, words] :
       {std::pair{late, " to 12.000 s the poses are off by up to "},
        std::pair{drifting, "they drift by "}, std::pair{scaled, "their scale changes: "}}) {
    const PoseReading reading = Judge(table);
    EXPECT_TRUE(reading.agrees) << words << reading.words;
    EXPECT_THAT(reading.change, HasSubstr(words)) << reading.words;
  }
}

// Where up is by 5 s of turning about all axes; images are stamped 30 ms late.
std::optional<Eigen::Vector3d> FindUp(const Eigen::Quaterniond& R_given_world, double unit,
                                      size_t samples = 1000) {
  Sequence recording;
  recording.rig.camera_time_offset_s = -0.03;
  Trajectory given;
  for (int i = 0; i < 1000; ++i) {
    const double t_s = 0.005 * i;
    const Eigen::Quaterniond R =
        ExpRotation({1.5 * std::sin(t_s), 0, 0}) * ExpRotation({0, 2 * t_s, 0});
    const int64_t stamp_ns = ToNanoseconds(t_s);
    recording.imu.push_back(
        {stamp_ns, Eigen::Vector3d::Zero(), unit * (R.conjugate() * Eigen::Vector3d(0, 0, 9.81))});
    if (i % 10 > 0) continue;
    given.push_back({stamp_ns + ToNanoseconds(0.03), {R_given_world * R, {0, 0, 0}}});
  }
  recording.imu.resize(samples);
  return UpByForce(recording, given);
}

TEST(UpOfPoses, IsToldByTheAccelerometer) {
  const Eigen::Quaterniond none = Eigen::Quaterniond::Identity();
  const auto up = FindUp(none, 1), with_y_down = FindUp(ExpRotation({-M_PI / 2, 0, 0}), 1);
  ASSERT_TRUE(up && with_y_down);
  EXPECT_LT((*up - Eigen::Vector3d::UnitZ()).norm(), 0.01);
  EXPECT_LT((*with_y_down - Eigen::Vector3d::UnitY()).norm(), 0.01);
  EXPECT_FALSE(FindUp(none, 1, 100)) << "few samples";
  EXPECT_FALSE(FindUp(none, 1 / 9.81)) << "of another unit";
}

}  // namespace
}  // namespace slcmap
