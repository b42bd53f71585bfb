// Upright faces of a storey: planes that points and lines of it agree on.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "mapping/building/options.h"

namespace slcmap::inline mapping {

// A measured place on something upright. Metres, in world.
struct FaceSample {
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();
  Eigen::Vector2d normal = Eigen::Vector2d::Zero();  // level, of length 1; zero: of a line
  // Of a line: its direction in the plan, of length 1; zero where it is upright.
  Eigen::Vector2d direction = Eigen::Vector2d::Zero();
  double sigma_m = 0.01;
};

// Of a line against the face that it lies on, 5 degrees.
inline constexpr double kLineTurn_rad = 0.09;

// A straight upright face as the plan has it: normal . p = offset_m. Metres, in world.
struct Face {
  Eigen::Vector2d normal = Eigen::Vector2d::UnitX();  // towards the room
  double offset_m = 0;
  double sigma_m = 0;            // of offset_m at its middle
  double heading_sigma_rad = 0;  // of the normal
  double from_m = 0, to_m = 0;   // where it was measured, along Along()
  double low_m = 0, high_m = 0;  // heights between which it was measured,
  double mostly_above_m = 0;     // and above which nine tenths of that are
  double area_m2 = 0;            // on which it was measured, in cells of 10 cm
  int level = 0;                 // its storey

  Eigen::Vector2d Along() const { return {-normal.y(), normal.x()}; }
  double DistanceTo(const Eigen::Vector2d& p) const { return normal.dot(p) - offset_m; }
  double MeasureAlong(const Eigen::Vector2d& p) const { return Along().dot(p); }
  Eigen::Vector2d PointAt(double along_m) const { return offset_m * normal + along_m * Along(); }
  Eigen::Vector2d Middle() const { return PointAt(0.5 * (from_m + to_m)); }
  double Length() const { return to_m - from_m; }

  // Brings its middle to a place and turns it about that; its ends stay as far from there.
  void MoveTo(const Eigen::Vector2d& middle, const Eigen::Vector2d& new_normal) {
    const double half_m = 0.5 * Length();
    normal = new_normal;
    offset_m = normal.dot(middle);
    from_m = MeasureAlong(middle) - half_m;
    to_m = from_m + 2 * half_m;
  }
};

// Whether the place before a face in the plan is known to be free.
using IsFreeAt = std::function<bool(const Eigen::Vector2d&)>;

// The faces of the samples of a storey, strongest first. Samples vote for headings; along each, in
// strips of 20 cm, mean shift finds offsets, which are followed from strip to strip, so that walls
// may bend and be turned a little against the heading that they were found by; each face is then
// fitted by itself. What one heading explains does not vote for the next. Lines have no side: they
// count for that which is free.
std::vector<Face> FindFaces(const std::vector<FaceSample>& samples, const IsFreeAt& is_free,
                            const BuildingOptions& options);

// Brings the headings of faces that agree within three standard deviations of theirs together, by
// as much as they are uncertain: short faces have that of long ones, long ones keep their own.
void AgreeHeadings(std::vector<Face>* faces);

// The heading that most of the faces have, by their length: of the normal or a direction square to
// it, from 0 to pi / 2 (radians).
double MainHeading(const std::vector<Face>& faces);

}  // namespace slcmap::mapping
