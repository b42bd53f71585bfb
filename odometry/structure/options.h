// The options of what is found of a building: its headings and slopes, and what follows them.
#pragma once

#include "data/io/yaml.h"

namespace slcmap::inline odometry {

// Search for the headings of a building; see odometry/structure/manhattan_detector.h.
struct ManhattanOptions {
  double tilt_sigma_rad = 0.003;  // of the camera's poses against the vertical
  // Which segments vote.
  double min_length_px = 25;
  double full_weight_px = 200;        // a longer segment counts as this long
  double min_vertical_sigmas = 4;     // closer to the vertical than this it may be vertical
  double max_vote_sigma_rad = 0.035;  // of the heading that a segment says
  // The search.
  int memory_images = 30;            // keyframes whose votes are taken together
  double search_step_rad = 0.002;    // of the histogram
  double search_sigma_rad = 0.004;   // added to that of a vote
  double max_sigmas = 3;             // between a heading and a vote for it
  double min_separation_rad = 0.04;  // between headings
  // Closer to a heading, what is next to it are flanks of its own.
  double runner_up_separation_rad = 0.14;
  // When a heading is certain: its lines are the greater part, along both of its axes, or nearly
  // all, along one axis but on all sides of the camera, as in a corridor. Where none is known yet
  // one axis will do wherever it is seen, as of a colonnade, if its lines are the greater part for
  // long, not only below the camera, and no other heading comes near it.
  int min_images = 10;               // in which it has min_image_share
  int min_images_below = 25;         // where its lines are nearly all below the camera, as those
                                     // of things that stand about are
  double min_image_share = 0.4;      // of the segments that vote, by length
  double min_mean_length_px = 500;   // of the segments for it, an image
  double min_overhead_share = 0.05;  // above the camera; less is nearly all below
  double max_runner_up = 0.6;        // share of the next best heading over its own
  double min_share = 0.55;
  double min_minor_share = 0.12;  // along the axis with fewer lines
  double min_one_axis_share = 0.75;
  double min_spread = 0.45;  // 0: lines all to one side, 1: all around
  int min_images_one_axis = 25;
  double max_runner_up_one_axis = 0.3;
  // A heading is withdrawn when so many lines, and this share of all that were taken to follow it,
  // turned out not to.
  int min_given_up = 8;
  double max_given_up_share = 0.7;
  void Check() const;
  void Read(YamlSection section);
};

// To which direction of a building a line belongs; see odometry/structure/manhattan_detector.h.
struct LineClassifierOptions {
  // Of a segment's ends, across it, where one image alone has to say what the segment follows; of
  // the votes for headings too. What lenses and edges leave uncorrected does not average out there,
  // so it is more than LineLandmarkOptions::sigma_px, the weight of one observation among many.
  double end_sigma_px = 0.5;
  double direction_sigma_rad = 0.004;  // of the building's directions in the camera
  double max_sigmas = 3;               // between a line and the direction that it belongs to
  double max_angle_rad = 0.05;         // the same, however uncertain the line
  double min_other_sigmas = 5;         // between it and every other direction
  void Check() const;
  void Read(YamlSection section);
};

// Search for slopes, directions that lines share without being an axis of the building; see
// odometry/structure/slope_detector.h.
struct SlopeOptions {
  bool enabled = true;
  // Which lines vote: as their own observations have them.
  double min_length_m = 0.7;         // crates that lie about are shorter
  double max_line_sigma_rad = 0.02;  // of its direction
  // From the vertical, the level, the axes of the building and other slopes, and at least so many
  // standard deviations.
  double min_separation_rad = 0.05;
  double min_other_sigmas = 5;
  int memory_keyframes = 30;  // a line is remembered so long since it was last seen
  // Which lines agree.
  double search_sigma_rad = 0.005;  // of lines' own deviation from what they share
  double max_sigmas = 3;
  double max_angle_rad = 0.05;
  // When a slope is certain.
  int min_lines = 5;
  int min_objects = 3;        // that they belong to, and
  double min_apart_m = 0.25;  // these are so far from each other: a box has edges all around
  double max_sigma_rad = 0.01;
  // A slope is withdrawn when so many lines, and this share of all that were taken to follow it,
  // turned out not to.
  int min_given_up = 4;
  double max_given_up_share = 0.7;
  void Check() const;
  void Read(YamlSection section);
};

// Which points are taken to lie on lines; see odometry/structure/points_on_lines.h.
struct PointsOnLinesOptions {
  double max_distance_px = 1.2;    // across the line, in both images
  double min_apart_px = 2.0;       // farther away, a point is not on the line
  double max_beyond_px = 8;        // along the line, from its nearer end
  double min_crossing_rad = 0.35;  // between lines that share a point
  int min_keyframes = 4;           // in a row, until a membership is verified
  int max_unseen_keyframes = 20;   // then a candidate is forgotten
  double area_px = 48;             // side of the areas that points and lines are sorted into
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
  double start_lines = 0.5;  // so many known lines weigh as much as the start
  double min_sigma_rad = 0.00017;
  double max_sigma_rad = 0.017;
  // Below it the building is taken to be exact, and so are its lines but for one in so many, which
  // would tell if it were not.
  double exact_below_rad = 0.001;
  int probe_every = 4;
  // What lines of an axis have in common where they are near each other, as share of the variance.
  double shared_share = 0.5;
  double shared_radius_m = 3;
  // Walls bend: a line that may deviate is one piece as long as it is seen within this distance
  // along it from where it was first seen from.
  double max_piece_m = 3;
  double loss_sigma = 2;  // of a line's deviation, where the Cauchy loss turns
  double max_sigmas = 4;  // further off its axis, a line is given up: it follows none
  void Check() const;
  void Read(YamlSection section);
};

}  // namespace slcmap::odometry
