// A line of the world as a rectified camera sees it, where an image has the edge of one that is
// expected in it, and what surfaces hide from the views.
#pragma once

#include <Eigen/Core>
#include <array>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "data/core/math.h"
#include "data/core/progress.h"
#include "data/core/types.h"
#include "mapping/map/map.h"
#include "mapping/views/view.h"
#include "odometry/geometry/lines.h"

namespace slcmap::inline mapping {

// The part of a line that is in an image, from start to end as the line runs.
struct LineInView {
  LineSegment px;
  double from_m = 0, to_m = 0;  // of its ends, along the line from its point
  double start_depth_m = 0, end_depth_m = 0;

  // The place along the line of what is seen at a share of the way from px.start to px.end, and
  // its depth.
  double AlongAt(double share) const;
  double DepthAt(double share) const;
};

// Nothing where no part of the interval lies in the image (but a margin) and between the depths.
struct ViewLimits {
  double margin_px = 4;
  double min_depth_m = 0.2, max_depth_m = 10;
};
std::optional<LineInView> SeenPart(const PointAndDirection& line, const Interval& interval,
                                   const RigidTransform& T_camera_world, const Camera& camera,
                                   const ViewLimits& limits);

// The image beside one place of a line.
struct LineSample {
  double along_m = 0;  // along the line, from its point
  double reach_m = 0;  // of the line that the sample stands for, to either side
  double depth_m = 0;
  Eigen::Vector2d px = Eigen::Vector2d::Zero();  // where the line is expected
  bool is_edge = false;                          // an edge of the line's orientation is near
  double across_px = 0;  // where it is, along the normal of the line's image
  double gradient = 0;   // of it, grey values a pixel
  // By how much the image is brighter on the left of the edge than on its right, some pixels away
  // from it: a step that lasts, or one that soon ends as those of grain and joints do.
  double lasting_step = 0;
  double step = 0;        // the same, beside the edge
  double brightness = 0;  // the mean of both sides, where the step that lasts is looked at
};

struct LineSampling {
  double step_m = 0.02;     // along the line, but
  double min_step_px = 3;   // no less in the image
  double reach_px = 1.5;    // across, up to which an edge counts
  double min_gradient = 3;  // grey values a pixel
  int max_samples = 200;
};

// Samples along what a view sees of a line, from start to end. The edge nearest to the line counts,
// with brightness rising to the left of the direction from px.start to px.end as one sees it (y is
// down). Places outside the mask have no sample.
std::vector<LineSample> SampleLine(const cv::Mat& image, const cv::Mat& mask,
                                   const LineInView& line, const LineSampling& options);

// The depth of the nearest surface, where one is known, in coarse images of all views.
class VisibilityDepths {
 public:
  VisibilityDepths() = default;  // hides nothing

  // Each point of the cloud is a piece of surface of `size_m`. The same points give the same
  // depths, whatever the number of threads. Once progress says so, nothing is hidden from later
  // views.
  VisibilityDepths(const std::vector<DensePoint>& cloud, double size_m, const ViewCameras& views,
                   const Progress& progress = {});

  // Whether a surface is clearly nearer than depth_m at a pixel of a view's camera (0 left, 1
  // right). What is not known hides nothing.
  bool Hides(int view, int camera, const Eigen::Vector2d& px, double depth_m) const;

  // The same of a place on a surface, in the frame of that camera, whose model is given: what lies
  // on the surface itself does not hide it, however slantingly it is seen.
  bool HidesSurface(int view, int camera, const Camera& model, const Eigen::Vector3d& p_camera,
                    const Eigen::Vector3d& normal_camera) const;

 private:
  using DepthImage = std::vector<float>;  // cell by cell; infinite: not known; or empty

  void Render(const std::vector<DensePoint>& cloud, double size_m, const Camera& camera,
              const RigidTransform& T_camera_world, DepthImage* image) const;

  double size_m_ = 0;
  int columns_ = 0, rows_ = 0;
  std::vector<std::array<DepthImage, 2>> images_;  // by view and camera
};

}  // namespace slcmap::mapping
