// What Simulate asks of a renderer.
#pragma once

#include <functional>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <stop_token>
#include <string>
#include <vector>

#include "data/progress.h"
#include "data/simulator/motion.h"
#include "data/types.h"

namespace slcmap {

struct RenderedPair {
  cv::Mat left, right;  // 8 bit, one channel, of the size of the rig's cameras
  cv::Mat depth_m;      // of the left image where asked for: float, along the optical axis, 0: none
};

class PairRenderer {
 public:
  virtual ~PairRenderer() = default;

  // The pair whose exposure has its middle at the frame's time. Called once a frame, from several
  // threads, in any order: the pixels depend on nothing but the frame. Throws StoppedError soon
  // after the task's stop was requested.
  virtual RenderedPair Render(int frame, bool with_depth) = 0;

  // Writes what is true of the scene, given that the first `frames` were rendered.
  virtual void WriteTruth(const std::string& folder, int frames) = 0;
};

// Gives what a stage of long work, called by a label, reports to.
using StageStarter = std::function<Progress(const std::string& label)>;

// What is to be rendered: a rig along a motion, at these times of the motion.
struct RenderTask {
  Rig rig;
  MotionSpline motion;
  std::vector<double> times_s;
  StageStarter start_stage = {};  // of the work before the first pair; none: unheard
  std::stop_token stop = {};      // ends the rendering

  Progress Stage(const std::string& label) const {
    return start_stage ? start_stage(label) : Progress();
  }
};

using PairRendererFactory = std::function<std::unique_ptr<PairRenderer>(const RenderTask&)>;

}  // namespace slcmap
