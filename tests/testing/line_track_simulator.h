// Line tracks without images, for tests of an estimator: straight edges along the axes of a
// building and in other directions, with landmarks on them.
#pragma once

#include <cstdint>

#include "tests/testing/track_simulator.h"

namespace slcmap {

struct LineTrackSimulatorOptions {
  int max_lines = 30;            // in a frame
  double heading_rad = 0;        // of the building's X axis, from the world's x
  double general_share = 0;      // of the edges, whose direction is random
  double sloped_share = 0;       // of the others, that rise by slope_elevation_rad towards
  double slope_azimuth_rad = 0;  // this from the world's x
  double slope_elevation_rad = 0.5;
  double deviation_rad = 0;    // standard deviation of an edge's direction from its axis, about
                               // either axis across it
  int points_per_edge = 0;     // landmarks on it, beside those there are
  int crossings_per_edge = 0;  // tracks of where a nearer edge crosses it in the image: they lie
                               // on it in every image, but slide along it
  double sigma_px = 0;         // of each end across the line, and of each coordinate of a point
  double end_shift_px = 0;     // standard deviation of how far an end stops short
  double min_length_px = 40;   // of what the left camera sees
  double margin_px = 5;        // of the image's border, where nothing is seen
  double max_length_m = 3;     // of an edge; at least a third of it
  double min_depth_m = 1.5;    // of its middle, in the camera that sees it first
  double max_depth_m = 8;
  uint64_t seed = 1;
};

// Adds edges, their tracks and those of the landmarks on them to all frames. An edge is tracked
// while the left camera sees enough of it, and for good given up afterwards; where there are fewer
// than max_lines, new ones are taken up. A track that slides has where it was first in
// landmarks_world, and is on its edge's list of crossings. For cameras without distortion, in which
// lines are straight.
void AddLineTracks(const Rig& rig, const LineTrackSimulatorOptions& options,
                   SimulatedTracks* tracks);

}  // namespace slcmap
