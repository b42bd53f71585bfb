#include "tests/testing/track_simulator.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>

#include "tests/testing/example.h"
#include "tests/testing/line_track_simulator.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

class TrackSimulatorTest : public ::testing::Test {
 protected:
  // Calls visit(track, exact left pixel, exact right pixel where in view) for every measurement.
  template <typename Visit>
  void ForEach(const SimulatedTracks& tracks, Visit visit) const {
    for (const SimulatedTrackFrame& frame : tracks.frames) {
      for (const SimulatedTrack& track : frame.tracks) {
        std::optional<Eigen::Vector2d> pixel[2];
        for (int c = 0; c < 2; ++c) {
          const RigidTransform T_world_camera = frame.T_world_imu * rig_.T_imu_camera[c];
          pixel[c] =
              rig_.cameras[c].Project(T_world_camera.Inverse() * tracks.landmarks_world[track.id]);
        }
        visit(track, *pixel[0], pixel[1]);
      }
    }
  }

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

TEST_F(TrackSimulatorTest, WithoutNoisePointsReprojectExactly) {
  const SimulatedTracks tracks = SimulateTracks(motion_, rig_, {});
  ASSERT_EQ(tracks.frames.size(), 201u);
  EXPECT_EQ(tracks.frames[20].stamp_ns, 1'000'000'000);
  int measurements = 0, stereo = 0;
  ForEach(tracks, [&](const SimulatedTrack& track, const auto& left, const auto& right) {
    ++measurements;
    EXPECT_LT((track.left_px - left).norm(), 1e-9);
    if (!track.right_px) return;
    ++stereo;
    EXPECT_LT((*track.right_px - *right).norm(), 1e-9);
    EXPECT_NEAR(track.right_px->y(), track.left_px.y(), 1e-6);  // a rectified rig
    EXPECT_LT(track.right_px->x(), track.left_px.x());
  });
  EXPECT_EQ(measurements, 201 * 150);
  EXPECT_GT(stereo, 0.85 * measurements);
}

TEST_F(TrackSimulatorTest, WithoutNoiseSegmentsLieOnTheirEdgesInTheImage) {
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

TEST_F(TrackSimulatorTest, LandmarksLieOnTheirEdgesAndAreTracked) {
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

TEST_F(TrackSimulatorTest, CrossingsLieOnTheirEdgesInBothImagesAndSlide) {
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

}  // namespace
}  // namespace slcmap
