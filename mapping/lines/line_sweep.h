// How far away a segment of an image lies, by the views around it, whose images are kept while they
// are needed.
#pragma once

#include <optional>
#include <vector>

#include "data/core/parallel.h"
#include "mapping/lines/line_samples.h"
#include "mapping/lines/options.h"
#include "mapping/views/view.h"
#include "odometry/frontend/options.h"

namespace slcmap::inline mapping {

// An image that a line may be seen in.
struct SweepImage {
  int view = 0, camera = 0;
  cv::Mat edges;  // EdgeDirections
};

struct SweptLine {
  PointAndDirection line;  // its point is seen in the middle of the segment
  Interval seen;           // between the ends of the segment
  double score = 0;        // images that show it, less those that do not
};

// A line through the middle of a segment (on the plane z = 1 of the left camera of a view; bright
// side on the left) along `direction_world`, at the depth at which most images show it. Nothing
// where no depth stands out. Depths are steps of inverse depth.
std::optional<SweptLine> SweepAlongAxis(const LineSegment& segment, int view,
                                        const Eigen::Vector3d& direction_world,
                                        const std::vector<SweepImage>& images,
                                        const ViewCameras& views, const LineSweepOptions& options);

// The same for a line of any direction: of those that the right image of the view shows, at any
// depths of its two ends, the one that most images show.
std::optional<SweptLine> SweepAnyDirection(const LineSegment& segment, int view,
                                           const std::vector<SweepImage>& images,
                                           const ViewCameras& views,
                                           const LineSweepOptions& options);

// A view's images, their edges, and the segments of its left one; of images that could not be read
// they are empty.
struct EdgeView {
  StereoImage images;
  cv::Mat edges[2];
  std::vector<LineSegment> segments;  // px

  const cv::Mat& image(int camera) const { return camera == 0 ? images.left : images.right; }
};

using EdgeViews = ItemsAround<EdgeView>;

// Of all views, with up to `reach` to either side; `images` must outlive it.
EdgeViews MakeEdgeViews(const ViewImages& images, size_t views, double min_gradient,
                        const LineDetectorOptions& detector, int reach);

// The images that a segment of a view is looked for in: its own right one, and both of up to
// seven others, those with different baselines first.
std::vector<SweepImage> ImagesAround(const EdgeViews& window, int view, const Views& all,
                                     const ViewCameras& cameras);

}  // namespace slcmap::mapping
