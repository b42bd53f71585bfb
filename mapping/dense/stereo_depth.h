// First depth of a view: semi-global matching of its rectified pair.
#pragma once

#include "data/types.h"
#include "mapping/dense/dense_options.h"
#include "mapping/dense/depth_grid.h"

namespace slcmap {

// Between the cameras of a stereo rig.
double Baseline_m(const Rig& rig);

// Matches the pair at half size (H. Hirschmueller, "Stereo processing by semiglobal matching and
// mutual information", PAMI 2008, as OpenCV has it), checks left against right, and fits a plane of
// disparities around each node of the grid. Nodes at depth edges, on surfaces seen at a grazing
// angle, outside of the mask (255 where there are pixels) and beyond the range of depth stay
// unknown. Sigma is that of matching: about a third of a pixel.
DepthGrid StereoDepth(const StereoImage& pair, const cv::Mat& mask, const Rig& rig,
                      const DenseOptions& options);

}  // namespace slcmap
