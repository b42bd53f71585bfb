// Small geometry of oriented segments in an image: start to end has the bright side on its left.
#pragma once

#include <Eigen/Core>

#include "data/types.h"

namespace slcmap {

// The unit vector from start to end.
Eigen::Vector2d Direction(const LineSegment& segment);

// The unit vector across the segment, to the left of its direction as one sees it (y is down).
Eigen::Vector2d Normal(const LineSegment& segment);

LineSegment Reversed(const LineSegment& segment);

// The angle between the directions, 0 to pi: pi for the same segment reversed.
double AngleBetween_rad(const LineSegment& a, const LineSegment& b);

// The signed distance of a point from the infinite line, positive on its left.
double DistanceAcross_px(const LineSegment& line, const Eigen::Vector2d& point_px);

// Where a point lies along the segment, in pixels from its start.
double PlaceAlong_px(const LineSegment& line, const Eigen::Vector2d& point_px);

// How far two nearly parallel segments lie beside each other, along `a`; negative: the gap.
double Overlap_px(const LineSegment& a, const LineSegment& b);

// The largest distance of `b` from the infinite line `a`, over the part of `b` that lies beside `a`
// (over its nearer end where no part does).
double LargestDistance_px(const LineSegment& a, const LineSegment& b);

}  // namespace slcmap
