// Where an image has the edge of a line that is expected in it.
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "mapping/lines/line_in_view.h"

namespace slcmap {

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

}  // namespace slcmap
