#include "tests/testing/line_track_simulator.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>

#include "data/core/error.h"
#include "tests/testing/example.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

class LineTrackSimulatorTest : public ::testing::Test {
 protected:
  SimulatedTracks Simulate(const LineTrackSimulatorOptions& options) const {
    SimulatedTracks tracks = SimulateTracks(motion_, rig_, {});
    AddLineTracks(rig_, options, &tracks);
    return tracks;
  }

  // Signed distances, in pixels, of a segment's ends from the true edge's image.
  Vector2d OffTheEdge(const SimulatedTrackFrame& frame, const SimulatedEdge& edge, int camera,
                      const SimulatedSegment& seen) const {
    const Camera& model = rig_.cameras[camera];
    const RigidTransform T = (frame.T_world_imu * rig_.T_imu_camera[camera]).Inverse();
    const Vector3d normal = (T * edge.start_world).cross(T * edge.end_world);
    Vector2d out;
    for (int end = 0; end < 2; ++end) {
      const Vector2d& p = end == 0 ? seen.start_px : seen.end_px;
      const Vector3d ray((p.x() - model.cx_px) / model.fx_px, (p.y() - model.cy_px) / model.fy_px,
                         1);
      out[end] = model.fx_px * ray.dot(normal) / normal.head<2>().norm();
    }
    return out;
  }

  const Rig rig_ = ExampleStereoRig();
  const MotionSpline motion_ = ExampleFlight(rig_, 10.0);
};

TEST_F(LineTrackSimulatorTest, WithoutNoiseSegmentsLieOnTheirEdgesInTheImage) {
  const LineTrackSimulatorOptions options;
  const SimulatedTracks tracks = Simulate(options);
  int measured = 0, stereo = 0;
  for (const SimulatedTrackFrame& frame : tracks.frames) {
    EXPECT_EQ(frame.lines.size(), static_cast<size_t>(options.max_lines));
    for (const SimulatedLineTrack& line : frame.lines) {
      const SimulatedEdge& edge = tracks.edges[line.id];
      ++measured;
      EXPECT_LT(OffTheEdge(frame, edge, 0, line.left).norm(), 1e-6);
      EXPECT_GE((line.left.end_px - line.left.start_px).norm(), options.min_length_px);
      EXPECT_TRUE(rig_.cameras[0].Contains(line.left.start_px, options.margin_px - 1e-6));
      EXPECT_TRUE(rig_.cameras[0].Contains(line.left.end_px, options.margin_px - 1e-6));
      if (!line.right) continue;
      ++stereo;
      EXPECT_LT(OffTheEdge(frame, edge, 1, *line.right).norm(), 1e-6);
    }
  }
  EXPECT_GT(stereo, 0.8 * measured);
}

TEST_F(LineTrackSimulatorTest, EdgesRunAlongTheBuildingOrAsTheyPlease) {
  LineTrackSimulatorOptions options;
  options.heading_rad = 0.4;
  options.general_share = 0.25;
  const SimulatedTracks tracks = Simulate(options);
  std::array<int, 4> count{};
  for (const SimulatedEdge& edge : tracks.edges) {
    ++count[edge.axis.value_or(3)];
    if (!edge.axis) continue;
    const Vector3d turned =
        Eigen::AngleAxisd(-0.4, Vector3d::UnitZ()) * Vector3d(edge.end_world - edge.start_world);
    EXPECT_NEAR(turned[*edge.axis], turned.norm(), 1e-9);
  }
  const double share = count[3] / static_cast<double>(tracks.edges.size());
  EXPECT_NEAR(share, 0.25, 0.1);
  EXPECT_GT(std::min({count[0], count[1], count[2]}), 5);
}

TEST_F(LineTrackSimulatorTest, NoiseIsAcrossTheLineAndEndsStopShort) {
  const SimulatedTracks exact = Simulate({});
  LineTrackSimulatorOptions options;
  options.sigma_px = 0.5;
  options.end_shift_px = 4;
  const SimulatedTracks tracks = Simulate(options);
  double squares = 0, length_px = 0, exact_length_px = 0;
  int ends = 0;
  // Only the first frame has the same edges in both: noise takes from the same random numbers.
  for (size_t k = 0; k < tracks.frames[0].lines.size(); ++k) {
    const SimulatedSegment &a = tracks.frames[0].lines[k].left, b = exact.frames[0].lines[k].left;
    length_px += (a.end_px - a.start_px).norm();
    exact_length_px += (b.end_px - b.start_px).norm();
  }
  EXPECT_LT(length_px, exact_length_px);
  for (const SimulatedTrackFrame& frame : tracks.frames) {
    for (const SimulatedLineTrack& line : frame.lines) {
      squares += OffTheEdge(frame, tracks.edges[line.id], 0, line.left).squaredNorm();
      ends += 2;
    }
  }
  EXPECT_NEAR(std::sqrt(squares / ends), 0.5, 0.02);
}

TEST_F(LineTrackSimulatorTest, ALostEdgeStaysLost) {
  std::set<int64_t> before, lost;
  for (const SimulatedTrackFrame& frame : Simulate({}).frames) {
    std::set<int64_t> now;
    for (const SimulatedLineTrack& line : frame.lines) {
      EXPECT_EQ(lost.count(line.id), 0u);
      now.insert(line.id);
    }
    for (const int64_t id : before) {
      if (!now.count(id)) lost.insert(id);
    }
    before = now;
  }
  EXPECT_GT(lost.size(), 5u);
}

TEST_F(LineTrackSimulatorTest, LandmarksLieOnTheirEdgesAndAreTracked) {
  LineTrackSimulatorOptions options;
  options.points_per_edge = 2;
  const SimulatedTracks tracks = Simulate(options);
  std::set<int64_t> on_edges;
  for (const SimulatedEdge& edge : tracks.edges) {
    ASSERT_EQ(edge.landmarks.size(), 2u);
    for (const int64_t id : edge.landmarks) {
      on_edges.insert(id);
      const Vector3d along = (edge.end_world - edge.start_world).normalized();
      EXPECT_LT((tracks.landmarks_world[id] - edge.start_world).cross(along).norm(), 1e-9);
    }
  }
  int tracked = 0;
  for (const SimulatedTrackFrame& frame : tracks.frames) {
    for (size_t k = 0; k < frame.tracks.size(); ++k) {
      if (k > 0) {
        EXPECT_LT(frame.tracks[k - 1].id, frame.tracks[k].id);
      }
      if (!on_edges.count(frame.tracks[k].id)) continue;
      ++tracked;
      const RigidTransform T = (frame.T_world_imu * rig_.T_imu_camera[0]).Inverse();
      const auto pixel = rig_.cameras[0].Project(T * tracks.landmarks_world[frame.tracks[k].id]);
      EXPECT_LT((*pixel - frame.tracks[k].left_px).norm(), 1e-9);
    }
  }
  EXPECT_GT(tracked, 20 * static_cast<int>(tracks.frames.size()));
}

TEST_F(LineTrackSimulatorTest, LandmarksScatterAboutTheirEdges) {
  LineTrackSimulatorOptions options;
  options.points_per_edge = 10;
  options.scatter_m = 0.02;
  const SimulatedTracks tracks = Simulate(options);
  double squares = 0;
  for (const SimulatedEdge& edge : tracks.edges) {
    const Vector3d along = (edge.end_world - edge.start_world).normalized();
    for (const int64_t id : edge.landmarks) {
      squares += (tracks.landmarks_world[id] - edge.start_world).cross(along).squaredNorm();
    }
  }
  // Two axes across.
  EXPECT_NEAR(std::sqrt(squares / (2 * 10.0 * static_cast<double>(tracks.edges.size()))), 0.02,
              0.002);
}

TEST_F(LineTrackSimulatorTest, CrossingsLieOnTheirEdgesInBothImagesAndSlide) {
  LineTrackSimulatorOptions options;
  options.crossings_per_edge = 1;
  const SimulatedTracks tracks = Simulate(options);
  std::map<int64_t, const SimulatedEdge*> edge_of;
  for (const SimulatedEdge& edge : tracks.edges) {
    ASSERT_EQ(edge.crossings.size(), 1u);
    edge_of[edge.crossings[0]] = &edge;
  }
  int measured = 0, slid = 0;
  for (const SimulatedTrackFrame& frame : tracks.frames) {
    for (const SimulatedTrack& track : frame.tracks) {
      const auto edge = edge_of.find(track.id);
      if (edge == edge_of.end()) continue;
      ++measured;
      EXPECT_LT(OffTheEdge(frame, *edge->second, 0, {track.left_px, track.left_px}).norm(), 1e-6);
      if (track.right_px) {
        const SimulatedSegment right = {*track.right_px, *track.right_px};
        EXPECT_LT(OffTheEdge(frame, *edge->second, 1, right).norm(), 1e-6);
      }
      const RigidTransform T = (frame.T_world_imu * rig_.T_imu_camera[0]).Inverse();
      const auto fixed = rig_.cameras[0].Project(T * tracks.landmarks_world[track.id]);
      slid += !fixed || (*fixed - track.left_px).norm() > 3;
    }
  }
  EXPECT_GT(measured, 10 * static_cast<int>(tracks.frames.size()));
  EXPECT_GT(slid, measured / 3);
}

TEST_F(LineTrackSimulatorTest, WrongOptionsAreNamed) {
  LineTrackSimulatorOptions options;
  options.general_share = 2;
  EXPECT_THROW(Simulate(options), ConfigError);
  Rig fisheye = rig_;
  fisheye.cameras[1].distortion = Distortion::kEquidistant;
  SimulatedTracks none;
  EXPECT_THROW(AddLineTracks(fisheye, {}, &none), ConfigError);
}

}  // namespace
}  // namespace slcmap
