// Finds the headings of a building from the segments of its images.
#pragma once

#include <Eigen/Core>
#include <deque>
#include <optional>
#include <vector>

#include "data/types.h"
#include "odometry/structure/options.h"
#include "odometry/structure/interpretation_plane.h"

namespace slcmap {

// A direction of a building's horizontal axes and what speaks for it. Shares are of the length of
// all segments that could be horizontal (those of directions already known left out).
struct HeadingEvidence {
  double heading_rad = 0;  // of one axis; the other is at right angles
  double sigma_rad = 0;
  double share = 0;            // that follows either axis
  double minor_share = 0;      // that follows the axis with less of it
  double runner_up_share = 0;  // of the next best heading
  double spread = 0;           // 0: its lines lie to one side of the camera, 1: all around it
  double overhead_share = 0;   // of its lines: above the camera's height
  double mean_length_px = 0;   // of the segments that follow, an image
  int images = 0;              // in which it has the largest share
};

// One search over the heading, since the vertical is known: a horizontal line in the plane (through
// the camera's centre) with normal n has the heading at which n . (cos h, sin h, 0) = 0 (SLC-VIO,
// section 3.3, has vanishing points instead). Votes of all images of a memory are taken together.
class ManhattanDetector {
 public:
  // end_sigma_px: standard deviation of a segment's ends, across it. focal_px: of the rectified
  // left camera. Throws ConfigError on options out of range.
  ManhattanDetector(const ManhattanOptions& options, double end_sigma_px, double focal_px);

  // The segments of a keyframe's left image on the plane z = 1, the more the better, and the
  // rotation of that camera in a world whose z is up. Returns headings that are now certain and
  // were not before, in (-pi/4, pi/4].
  std::vector<HeadingEvidence> AddImage(const std::vector<LineSegment>& segments,
                                        const Eigen::Matrix3d& R_world_camera);

  // Replaces the known headings, for instance by refined ones. What they explain does not vote.
  void SetKnownHeadings(const std::vector<double>& headings_rad);
  const std::vector<double>& known_headings_rad() const { return known_headings_rad_; }

  // Replaces the known slopes (unit, in the world). What follows them does not vote: it is not
  // level, and would say another heading in each image.
  void SetKnownSlopes(const std::vector<Eigen::Vector3d>& directions_world) {
    known_slopes_world_ = directions_world;
  }

  // The best heading at present, certain or not; nothing where nothing votes.
  std::optional<HeadingEvidence> Best() const;

  // Forgets images and headings: the heading of a new world frame is another one.
  void Reset();

  // What one segment says.
  struct Vote {
    double heading_rad = 0;  // of the line, were it horizontal, in [0, pi)
    double sigma_rad = 0;
    double weight_px = 0;
    InterpretationPlane plane;
    double pencil_rad = 0;  // of its plane, about that heading: 0 level with the camera
    bool above = false;     // the camera's height, or below it
  };

 private:
  bool IsKnown(const Vote& vote) const;
  bool IsCertain(const HeadingEvidence& evidence) const;

  ManhattanOptions options_;
  double end_sigma_;  // on the plane z = 1
  double focal_px_;
  std::deque<std::vector<Vote>> images_;
  std::vector<double> known_headings_rad_;
  std::vector<Eigen::Vector3d> known_slopes_world_;
};

}  // namespace slcmap
