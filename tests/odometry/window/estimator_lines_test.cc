// The estimator with lines, on simulated tracks.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <numbers>
#include <set>

#include "data/core/math.h"
#include "odometry/run/run_queries.h"
#include "odometry/window/estimator.h"
#include "tests/odometry/window/line_runs.h"
#include "tests/testing/simulated_odometry.h"

namespace slcmap {
namespace {

SimulatedRunOptions PerfectLines(Method method) {
  SimulatedRunOptions options = Building(method, 10);
  options.imu_rate_hz = 1000;  // the integration's error falls with the square of the step
  return options;
}

// Sees no lines; keeps the axes that it was given last.
class AxesSpy final : public LineSource {
 public:
  void Track(const Eigen::Quaterniond&, const std::vector<LinePrediction>&,
             const std::vector<Eigen::Vector3d>& axes_camera) override {
    axes = axes_camera;
  }
  const std::vector<LineObservation>& observations() const override { return none_; }
  void Remove(const std::unordered_set<int64_t>&) override {}
  void Reset() override {}
  std::vector<Eigen::Vector3d> axes;

 private:
  std::vector<LineObservation> none_;
};

// The axes that a resting estimator prefers lines along before it is initialised.
std::vector<Eigen::Vector3d> FirstAxes(Method method, const Eigen::Vector3d& specific_force_m_s2) {
  OdometryOptions options;
  options.method = method;
  SimulatedPoints points;
  AxesSpy lines;
  Estimator estimator(options, ExampleStereoRig(), &points, &lines);
  constexpr int64_t kStep_ns = 5'000'000, kImage_ns = 50'000'000;
  for (int64_t stamp_ns = 0; stamp_ns <= 2 * kImage_ns; stamp_ns += kStep_ns) {
    estimator.AddImu({stamp_ns, Eigen::Vector3d::Zero(), specific_force_m_s2});
  }
  for (const int64_t stamp_ns : {kImage_ns, 2 * kImage_ns}) estimator.AddImage(stamp_ns);
  return lines.axes;
}

// How far a world's heading is from the building's, once turned by the gauge.
double HeadingErrorOf(const ManhattanWorld& world, const RigidTransform& gauge) {
  const double turn_rad = 2 * std::atan2(gauge.rotation.z(), gauge.rotation.w());
  const double off_rad = world.heading_rad + turn_rad - kHeading_rad;
  return std::abs(std::remainder(off_rad, std::numbers::pi / 2));
}

double DistanceToEdge(const SimulatedEdge& edge, const Eigen::Vector3d& p_world) {
  const Eigen::Vector3d direction = (edge.end_world - edge.start_world).normalized();
  return direction.cross(p_world - edge.start_world).norm();
}

// Largest distance in metres of a line's ends from the edge that it is an observation of.
double DistanceToItsEdge(const SimulatedRun& run, const Line& line, const RigidTransform& gauge) {
  const SimulatedEdge& edge = run.edges.at(static_cast<size_t>(line.id));
  return std::max(DistanceToEdge(edge, gauge * line.start_world),
                  DistanceToEdge(edge, gauge * line.end_world));
}

// The run holds all lines that were estimated. Here those that are known to 7 mm, as maps have
// them.
std::vector<Line> WellKnownLines(const OdometryRun& run) {
  std::vector<Line> lines;
  std::ranges::copy_if(run.lines, std::back_inserter(lines), [](const Line& line) {
    return LargestSigma(line) <= 0.007 && line.observations >= 4;
  });
  return lines;
}

struct Members {
  size_t all = 0, wrong = 0;  // wrong: not of the edge that the line is an observation of
};

Members FindMembers(const SimulatedRun& run) {
  Members members;
  for (const Line& line : run.run.lines) {
    const SimulatedEdge& edge = run.edges.at(static_cast<size_t>(line.id));
    members.all += line.point_ids.size();
    for (const int64_t id : line.point_ids) {
      members.wrong += std::count(edge.landmarks.begin(), edge.landmarks.end(), id) == 0;
    }
  }
  return members;
}

class PerfectLinesTest : public ::testing::TestWithParam<Method> {};

TEST_P(PerfectLinesTest, GiveThePerfectPathAndTheEdges) {
  const bool structural = GetParam() != Method::kPointsLines;
  SimulatedRunOptions options = PerfectLines(GetParam());
  if (!structural) options.lines->general_share = 0.3;
  const SimulatedRun run = RunOnSimulatedTracks(options);
  ASSERT_GT(run.states.size(), 150u);
  EXPECT_EQ(run.states.back().segment, 0);
  EXPECT_LT(LargestPositionError(run), 3e-4);
  EXPECT_EQ(run.removed_points, 0u);

  const RigidTransform gauge = GaugeFromFirst(run);
  ASSERT_EQ(run.run.manhattan_worlds.size(), structural ? 1u : 0u);
  for (const ManhattanWorld& world : run.run.manhattan_worlds) {
    EXPECT_LT(HeadingErrorOf(world, gauge), 0.05 * kDegree);
  }
  const std::vector<Line> lines = WellKnownLines(run.run);
  ASSERT_GT(lines.size(), 10u);
  for (const Line& line : lines) {
    EXPECT_LT(DistanceToItsEdge(run, line, gauge), 0.01) << line.id;
    EXPECT_EQ(line.axis != LineAxis::kNone, structural) << line.id;
    const auto axis = run.edges.at(static_cast<size_t>(line.id)).axis;
    if (structural) {
      EXPECT_EQ(line.axis == LineAxis::kVertical, axis == 2) << line.id;
    }
  }
  if (!structural) return;
  const Members members = FindMembers(run);
  EXPECT_GT(members.all, 5u);
  EXPECT_EQ(members.wrong, 0u) << "points on lines are found as such";
}

INSTANTIATE_TEST_SUITE_P(Methods, PerfectLinesTest,
                         ::testing::Values(Method::kPointsLines, Method::kSlc));

// How often each keyframe's observations name a line, or one that never became one.
std::map<int64_t, int> CountObservations(const OdometryRun& run) {
  std::map<int64_t, int> count;
  for (const Keyframe& keyframe : run.keyframes) {
    std::set<int64_t> seen;
    for (const LineObservation& observation : keyframe.lines) {
      EXPECT_TRUE(seen.insert(observation.id).second) << "twice in keyframe " << keyframe.id;
      ++count[observation.id];
    }
  }
  return count;
}

// Those that are little known too, which the run has to say.
TEST(EstimatorWithLines, AllThatAreEstimatedAreReportedWithTheirQuality) {
  const SimulatedRun run = RunOnSimulatedTracks(NoisyLines(Method::kStructural, 3));
  EXPECT_GT(WellKnownLines(run.run).size(), 5u);
  const auto little_known = [](const Line& line) { return LargestSigma(line) > 0.007; };
  EXPECT_TRUE(std::ranges::any_of(run.run.lines, little_known));
  EXPECT_TRUE(IsFinite(run.run));
}

// Tracks break off and start again under new ids: the edges are the same.
TEST(EstimatorWithLines, OfMergedLinesNothingIsLost) {
  SimulatedRunOptions options = PerfectLines(Method::kStructural);
  options.line_life = 8;
  const SimulatedRun run = RunOnSimulatedTracks(options);
  ASSERT_GT(run.run.line_merges.size(), 10u);
  std::map<int64_t, int> observations = CountObservations(run.run);
  int taken_over = 0;
  for (const Line& line : run.run.lines) {
    EXPECT_EQ(line.observations, observations[line.id]) << line.id;
    EXPECT_FALSE(run.run.line_merges.contains(line.id)) << line.id;
    taken_over += line.observations > options.line_life;
  }
  EXPECT_GT(taken_over, 0);
  for (const auto& [id, survivor] : run.run.line_merges) {
    EXPECT_FALSE(run.run.line_merges.contains(survivor)) << id;
    EXPECT_EQ(observations[id], 0) << "is of the one that remains";
    const auto& edge = run.edges.at(static_cast<size_t>(id % kLineIdStep));
    const auto& other = run.edges.at(static_cast<size_t>(survivor % kLineIdStep));
    EXPECT_LT(DistanceToEdge(other, edge.start_world), 0.05) << id;
  }
}

TEST(EstimatorWithLines, PrefersVerticalsFromTheFirstImagesOn) {
  const Eigen::Vector3d up_imu = Eigen::Vector3d(0.2, 0.9, -0.3).normalized();
  const auto axes = FirstAxes(Method::kStructural, 9.81 * up_imu);
  ASSERT_EQ(axes.size(), 1u);
  EXPECT_LT((ExampleStereoRig().T_imu_camera[0].rotation * axes[0] - up_imu).norm(), 1e-6);
  EXPECT_TRUE(FirstAxes(Method::kPointsLines, 9.81 * up_imu).empty());
  EXPECT_TRUE(FirstAxes(Method::kStructural, Eigen::Vector3d::Zero()).empty());
}

TEST(EstimatorWithLines, LinesMakePathAndHeadingBetterWherePointsAreFew) {
  std::map<Method, Errors> sum;
  for (const uint64_t seed : {200, 201, 203}) {
    for (const Method method : {Method::kPoints, Method::kSlc}) {
      SimulatedRunOptions options = NoisyLines(method, seed);
      options.odometry.points.max_points = 25;
      const Errors errors = GetErrors(RunOnSimulatedTracks(options));
      sum[method].position_m += errors.position_m;
      sum[method].heading_rad += errors.heading_rad;
    }
  }
  EXPECT_LT(sum[Method::kSlc].position_m, 0.8 * sum[Method::kPoints].position_m);
  EXPECT_LT(sum[Method::kSlc].heading_rad, 0.8 * sum[Method::kPoints].heading_rad);
}

// Root mean square over some runs of the angle between the vertical and where the first state of a
// segment that starts in motion has it.
double FirstTiltError_rad(Method method) {
  constexpr int kRuns = 6;
  double sum = 0;
  for (int i = 0; i < kRuns; ++i) {
    SimulatedRunOptions options = NoisyLines(method, 300 + i, 2);
    options.stand_still_s = 0;
    const SimulatedRun run = RunOnSimulatedTracks(options);
    const Eigen::Vector3d up_estimated =
        run.states.at(0).T_world_imu.rotation.conjugate() * Eigen::Vector3d::UnitZ();
    const Eigen::Vector3d up = run.truth.at(0).rotation.conjugate() * Eigen::Vector3d::UnitZ();
    sum += up_estimated.cross(up).squaredNorm();
  }
  return std::sqrt(sum / kRuns);
}

// After half a second a bias of the accelerometer and a tilt look the same to points.
TEST(EstimatorWithLines, VerticalLinesLevelTheFirstState) {
  const double points_rad = FirstTiltError_rad(Method::kPoints);
  EXPECT_GT(points_rad, 0.3 * kDegree);
  EXPECT_LT(FirstTiltError_rad(Method::kSlc), 0.5 * points_rad);
}

TEST(EstimatorWithLines, LinesThatSlideDoNotSpoilThePath) {
  SimulatedRunOptions options = NoisyLines(Method::kSlc, 9);
  options.line_outlier_share = 0.2;
  const SimulatedRun run = RunOnSimulatedTracks(options);
  EXPECT_EQ(run.states.back().segment, 0);
  EXPECT_LT(LargestPositionError(run), 0.04);
  const RigidTransform gauge = GaugeFromFirst(run);
  ASSERT_EQ(run.run.manhattan_worlds.size(), 1u);
  EXPECT_LT(HeadingErrorOf(run.run.manhattan_worlds[0], gauge), 0.2 * kDegree);
  for (const Line& line : WellKnownLines(run.run)) {
    EXPECT_LT(DistanceToItsEdge(run, line, gauge), 0.1) << line.id;
  }

  // That they are there, and would spoil it.
  LineLandmarkOptions& lines = options.odometry.line_landmarks;
  lines.max_chi2 = lines.max_new_chi2 = lines.max_median_chi2 = lines.max_tracking_chi2 = 1e9;
  lines.loss_sigma = 1e9;
  EXPECT_GT(LargestPositionError(RunOnSimulatedTracks(options)), 2 * LargestPositionError(run));
}

// Whatever is retired, merged or refuted.
TEST(EstimatorWithLines, LinesHaveNoPointsThatDoNotBelongToThemInTheImages) {
  SimulatedRunOptions options = NoisyLines(Method::kSlc, 13);
  options.lines->crossings_per_edge = 1;
  options.line_outlier_share = 0.1;
  options.line_life = 8;
  size_t members = 0;
  RunOnSimulatedTracks(options, nullptr, [&](Estimator* estimator) {
    const auto& verified = estimator->window().structure().memberships().verified();
    for (const auto& [id, line] : estimator->window().state().lines) {
      if (line.retired || !line.estimated) {
        EXPECT_TRUE(line.points.empty()) << id;
      }
      for (const int64_t point : line.points) EXPECT_TRUE(verified.contains({point, id})) << id;
      members += line.points.size();
    }
  });
  EXPECT_GT(members, 100u);
}

TEST(EstimatorWithLines, CrossingsThatSlideAlongLinesDoNotBelongToThem) {
  SimulatedRunOptions options = NoisyLines(Method::kSlc, 11);
  options.lines->crossings_per_edge = 2;
  const SimulatedRun run = RunOnSimulatedTracks(options);
  EXPECT_LT(LargestPositionError(run), 0.04);
  const Members checked = FindMembers(run);
  options.odometry.line_landmarks.max_member_sigma_m = 100;
  options.odometry.line_landmarks.point_sigma_m = 10;
  const Members unchecked = FindMembers(RunOnSimulatedTracks(options));
  EXPECT_GT(checked.all, 10u);
  // Those left hardly slid while they were seen.
  EXPECT_LT(5 * checked.wrong, checked.all);
  EXPECT_GT(unchecked.wrong, checked.wrong);
}

TEST(EstimatorWithLines, ARestartForgetsHeadingsAndLines) {
  SimulatedRunOptions options = NoisyLines(Method::kSlc, 8, 16);
  options.image_gap_from_s = 7;
  options.image_gap_to_s = 9.5;
  bool had_structure = false;
  std::optional<bool> forgotten;  // once it has restarted
  const SimulatedRun run = RunOnSimulatedTracks(options, nullptr, [&](Estimator* estimator) {
    const WindowState& window = estimator->window().state();
    had_structure |= !window.headings.empty() && !window.lines.empty();
    if (forgotten || !had_structure || !window.frames.empty()) return;
    forgotten = window.headings.empty() && window.lines.empty();
  });
  EXPECT_EQ(forgotten, true);
  EXPECT_EQ(run.states.back().segment, 1);
  ASSERT_EQ(run.run.manhattan_worlds.size(), 2u);
  for (int segment = 0; segment < 2; ++segment) {
    const auto first = std::ranges::find(run.states, segment, &OnlineState::segment);
    const RigidTransform gauge =
        GaugeFrom(run, static_cast<size_t>(std::distance(run.states.begin(), first)));
    const ManhattanWorld& world = run.run.manhattan_worlds[static_cast<size_t>(segment)];
    EXPECT_EQ(world.segment, segment);
    EXPECT_LT(HeadingErrorOf(world, gauge), 0.3 * kDegree);
    int lines = 0;
    for (const Line& line : WellKnownLines(run.run)) {
      if (line.segment != segment) continue;
      ++lines;
      EXPECT_LT(DistanceToItsEdge(run, line, gauge), 0.1) << line.id;
      if (line.axis != LineAxis::kVertical) {
        EXPECT_EQ(line.world, segment);
      }
    }
    EXPECT_GT(lines, 5);
  }
}

}  // namespace
}  // namespace slcmap
