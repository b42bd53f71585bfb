// The options of what is found of a building: its headings and slopes, and what follows them.
#pragma once

#include "data/io/yaml.h"

namespace slcmap::inline odometry {

// Between a line, or a vote, and the direction of the building that it follows; the angle holds
// however uncertain the line is. And between it and every other direction.
inline constexpr double kMaxSigmasToDirection = 3, kMaxAngleToDirection_rad = 0.05;
inline constexpr double kMinSigmasToOthers = 5;

// Search for the headings of a building; see odometry/structure/manhattan_detector.h.
struct ManhattanOptions {
  // Which segments vote.
  double min_length_px = 25;
  // When a heading is certain: its lines are the greater part, along both of its axes, or nearly
  // all, along one axis but on all sides of the camera, as in a corridor. Where none is known yet
  // one axis will do wherever it is seen, as of a colonnade, if its lines are the greater part for
  // long, not only below the camera, and no other heading comes near it.
  int min_images = 10;              // in which it has 40 % of the voting length
  int min_images_below = 25;        // where its lines are nearly all below the camera, as those
                                    // of things that stand about are
  double min_mean_length_px = 500;  // of the segments for it, an image
  double min_share = 0.55;
  double min_minor_share = 0.12;  // along the axis with fewer lines
};

// Of a segment's ends, across it, where one image alone has to say what the segment follows; of the
// votes for headings too. What lenses and edges leave uncorrected does not average out there, so it
// is more than LineLandmarkOptions::sigma_px, the weight of one observation among many.
inline constexpr double kAloneEndSigma_px = 0.5;

// Search for slopes, directions that lines share without being an axis of the building; see
// odometry/structure/slope_detector.h.
struct SlopeOptions {
  bool enabled = true;
  void Check() const;
  void Read(YamlSection section);
};

// How far lines are off the axes of the building that they follow; see
// odometry/structure/building_deviation.h.
struct BuildingDeviationOptions {
  // Standard deviation of a line's direction, about either axis across it, that is believed before
  // a line is known: DIN 18202 lets a wall be off by 0.1 to 0.2 degrees, a door frame by 0.15 to
  // 0.5, but most lines are well within. 0: lines are exactly along their axes.
  double start_sigma_rad = 0.0017;
  double min_sigma_rad = 0.00017;
  double max_sigma_rad = 0.017;
  // Below it the building is taken to be exact, and so are its lines but for one in so many, which
  // would tell if it were not.
  double exact_below_rad = 0.001;
  // What lines of an axis have in common where they are near each other, as share of the variance.
  double shared_share = 0.5;
  // Walls bend: a line that may deviate is one piece as long as it is seen within this distance
  // along it from where it was first seen from.
  double max_piece_m = 3;
  double max_sigmas = 4;  // further off its axis, a line is given up: it follows none
  void Check() const;
  void Read(YamlSection section);
};

}  // namespace slcmap::odometry
