// Finds the headings of a building from the segments of its images, by planes through the camera's
// centre, and which of the building's directions a line follows.
#pragma once

#include <Eigen/Core>
#include <deque>
#include <optional>
#include <vector>

#include "data/core/types.h"
#include "odometry/run/run.h"
#include "odometry/structure/options.h"

namespace slcmap::inline odometry {

// All lines in space that project onto the segment lie in this plane. Of the three axes (unit, at
// right angles, all in the frame that the plane was made in) `middle` points to the segment's
// middle, `along` along the segment, and `normal` = middle x along. The plane is known up to a turn
// about `middle`.
struct InterpretationPlane {
  Eigen::Vector3d middle = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d along = Eigen::Vector3d::UnitX();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitY();
  double length_rad = 0;  // that the segment is seen under
  double sigma_rad = 0;   // of the turn about `middle`

  // The same plane in another frame.
  InterpretationPlane Rotated(const Eigen::Matrix3d& R_other_this) const;
};

// segment: on the plane z = 1 of a camera; the plane is in that camera's frame. end_sigma: standard
// deviation of an end across the segment, on z = 1 (pixels over focal length).
InterpretationPlane PlaneOfSegment(const LineSegment& segment, double end_sigma);

// The angle at the segment between it and the ray from its middle to the vanishing point of a
// direction (SLC-VIO, section 3.4; here on the sphere, where it does not depend on the place in the
// image), in [0, pi/2], and its standard deviation, when the direction (unit, in the plane's frame)
// is known to direction_sigma_rad about both axes. It is large near the vanishing point, where the
// angle means nothing.
struct VanishingAngle {
  double angle_rad = 0;
  double sigma_rad = 0;
};
VanishingAngle AngleToVanishingPoint(const InterpretationPlane& plane,
                                     const Eigen::Vector3d& direction, double direction_sigma_rad);

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
  // focal_px: of the rectified left camera.
  ManhattanDetector(const ManhattanOptions& options, double focal_px);

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

struct LineClass {
  LineAxis axis = LineAxis::kNone;
  int world = -1;  // index into the headings; -1 for the vertical, which all worlds share
  bool operator==(const LineClass&) const = default;
};

// The directions of the axes of Manhattan worlds, in the (gravity aligned, z up) world frame: the
// vertical, then X and Y of each heading (radians from the world's x about z), by world; worlds
// without one have no direction.
struct StructuralDirection {
  LineClass line_class;
  Eigen::Vector3d d_world = Eigen::Vector3d::UnitZ();
};
std::vector<StructuralDirection> StructuralDirections(
    const std::vector<std::optional<double>>& headings_rad);

// A class is given only when one direction fits and no other one could: a line that is taken for
// another axis bends all that it touches. Two more places ask which direction a segment follows,
// and are less strict on purpose. The votes of the ManhattanDetector are cast where no direction is
// known yet, and many decide together. The frontend's FindAxis() only prefers segments to track;
// this class judges them once they have been seen often enough.
class LineClassifier {
 public:
  // focal_px: of the rectified left camera.
  explicit LineClassifier(double focal_px) : end_sigma_(kAloneEndSigma_px / focal_px) {}

  // The class of a segment on the plane z = 1 of a camera (SLC-VIO, section 3.4). Without headings
  // only the vertical is recognised.
  std::optional<LineClass> Classify(const LineSegment& segment,
                                    const Eigen::Matrix3d& R_world_camera,
                                    const std::vector<std::optional<double>>& headings_rad) const;

 private:
  double end_sigma_;  // on the plane z = 1
};

}  // namespace slcmap::odometry
