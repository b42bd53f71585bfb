// Point tracks without images, for tests of an estimator: landmarks on the walls of a box around a
// motion, seen by the cameras of a rig.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "data/core/types.h"
#include "data/simulator/motion.h"

namespace slcmap {

struct TrackSimulatorOptions {
  int max_tracks = 150;
  double sigma_px = 0;  // of each coordinate, left and right alike
  double image_rate_hz = 20;
  double margin_px = 5;  // of the image's border, where nothing is seen
  uint64_t seed = 1;
};

struct SimulatedTrack {
  int64_t id = 0;  // row in SimulatedTracks::landmarks_world
  Eigen::Vector2d left_px = Eigen::Vector2d::Zero();
  std::optional<Eigen::Vector2d> right_px;  // where the right camera sees it too
  int camera = 0;                           // whose left_px it is
};

// A straight edge, and the landmarks that lie on it.
struct SimulatedEdge {
  std::optional<int> axis;  // of the building: X, Y, vertical; none for a slope or a random one
  bool is_sloped = false;   // along the slope that such edges share
  Eigen::Vector3d start_world = Eigen::Vector3d::Zero();
  Eigen::Vector3d end_world = Eigen::Vector3d::Zero();
  std::vector<int64_t> landmarks;  // rows in SimulatedTracks::landmarks_world
  std::vector<int64_t> crossings;  // the same: see line_track_simulator.h
};

struct SimulatedSegment {
  Eigen::Vector2d start_px = Eigen::Vector2d::Zero();
  Eigen::Vector2d end_px = Eigen::Vector2d::Zero();
};

struct SimulatedLineTrack {
  int64_t id = 0;  // row in SimulatedTracks::edges
  SimulatedSegment left;
  std::optional<SimulatedSegment> right;  // where the right camera sees it too
};

struct SimulatedTrackFrame {
  int64_t stamp_ns = 0;  // on the camera's clock, which the rig's offset relates to the IMU's
  RigidTransform T_world_imu;
  std::vector<SimulatedTrack> tracks;     // sorted by id
  std::vector<SimulatedLineTrack> lines;  // sorted by id; see line_track_simulator.h
};

struct SimulatedTracks {
  std::vector<SimulatedTrackFrame> frames;
  std::vector<Eigen::Vector3d> landmarks_world;  // metres
  std::vector<SimulatedEdge> edges;
};

// Tracks over the whole motion. A landmark is tracked while the left camera sees it; where fewer
// than max_tracks are left, new landmarks with new ids are taken up at random pixels.
// Those of a rig of two cameras that look apart are of each camera alone: of the first with even
// ids.
SimulatedTracks SimulateTracks(const MotionSpline& motion, const Rig& rig,
                               const TrackSimulatorOptions& options);

}  // namespace slcmap
