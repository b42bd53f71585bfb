// Points that belong to lines (PPBL): which tracked points lie on which tracked lines.
#pragma once

#include <compare>
#include <cstdint>
#include <map>
#include <set>
#include <vector>

#include "data/core/types.h"
#include "odometry/structure/options.h"

namespace slcmap::inline odometry {

struct PointOnLine {
  int64_t point_id = 0;
  int64_t line_id = 0;
  auto operator<=>(const PointOnLine&) const = default;
};

// Memberships that hold in both images over several keyframes in a row (SLC-VIO, section 3.5). A
// point at another depth than the line that it projects onto leaves it with the parallax between
// the two cameras or the keyframes, so the tolerance is narrow.
class PointsOnLines {
 public:
  // Of a lone camera, its image is enough.
  explicit PointsOnLines(std::set<int> lone_cameras = {})
      : lone_cameras_(std::move(lone_cameras)) {}

  // The points and lines of one keyframe, in pixels of the rectified images. A keyframe counts for
  // a pair when the point is on the line in both images; it breaks it when the point is off the
  // line in one of them; it says nothing where either was not seen, or far beyond the line's ends.
  void AddKeyframe(const std::vector<PointObservation>& points,
                   const std::vector<LineObservation>& lines);

  // A point is on several lines at once only where they cross.
  const std::set<PointOnLine>& verified() const { return verified_; }
  std::vector<int64_t> CollectPoints(int64_t line_id) const;  // verified, sorted

  // Ends a membership found to be wrong otherwise (in space, say); it won't come back.
  void Release(const PointOnLine& pair);
  // Forgets all about a point or a line that is gone.
  void ReleasePoint(int64_t point_id);
  void ReleaseLine(int64_t line_id);
  // A line turned out to be the same as another one, which takes over its points.
  void MergeLine(int64_t line_id, int64_t into_line_id);

 private:
  struct Record {
    int together = 0;  // keyframes in a row that counted
    int64_t last_keyframe = 0;
    bool barred = false;
  };

  void Count(const PointOnLine& pair);
  void BreakApart(const std::vector<PointObservation>& points,
                  const std::vector<LineObservation>& lines);
  void RemoveUnseen();

  std::set<int> lone_cameras_;
  int64_t keyframe_ = 0;
  std::map<PointOnLine, Record> records_;
  std::set<PointOnLine> verified_;
};

}  // namespace slcmap::odometry
