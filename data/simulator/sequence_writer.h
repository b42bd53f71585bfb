// Writes a simulated sequence as a EuRoC (ASL) folder: what is asked of a renderer, and frames made
// in several threads.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <stop_token>
#include <string>
#include <vector>

#include "data/core/progress.h"
#include "data/core/types.h"
#include "data/simulator/motion.h"

namespace slcmap::inline data {

struct RenderedPair {
  cv::Mat left, right;  // 8 bit, one channel, of the size of the rig's cameras
  cv::Mat depth_m;      // of the left image where asked for: float, along the optical axis, 0: none
  std::vector<cv::Mat> others = {};  // of the third camera on
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

// Of a depth camera, which throws dots of light: on all images, or on every other one.
enum class Emitter { kOff, kSteady, kAlternating };

// What is to be rendered: a rig along a motion, at these times of the motion.
struct RenderTask {
  Rig rig;
  MotionSpline motion;
  std::vector<double> times_s;
  StageStarter start_stage = {};  // of the work before the first pair; none: unheard
  std::stop_token stop = {};      // ends the rendering
  Emitter emitter = Emitter::kOff;

  Progress Stage(const std::string& label) const {
    return start_stage ? start_stage(label) : Progress();
  }
};

using PairRendererFactory = std::function<std::unique_ptr<PairRenderer>(const RenderTask&)>;

// Calls make(i) for i = 0, 1, ... count - 1, each from one of `threads` threads that take them up
// in this order, and progress(frames done so far) from the calling thread, ten times a second; no
// further frame is begun once progress returns false. Returns the number of frames made: these are
// the first ones. A StoppedError of make ends the loop too, and its frame and those after it do not
// count as made; any other exception ends the loop and is thrown on.
int MakeFrames(int count, int threads, const std::function<void(int)>& make,
               const std::function<bool(int)>& progress);

// Writes a simulated sequence as a EuRoC (ASL) folder.
//
//   DIR/mav0/cam0, cam1, ...               sensor.yaml, data.csv, data/<stamp>.png
//   DIR/mav0/imu0                          sensor.yaml, data.csv
//   DIR/mav0/state_groundtruth_estimate0   sensor.yaml, data.csv: pose, velocity, biases
//   DIR/truth                              trajectory.tum, rig.yaml and what the renderer knows

class SequenceWriter {
 public:
  // Makes the folders. Throws OutputError where that fails or where mav0 is there already.
  SequenceWriter(const std::string& folder, int cameras);

  const std::string& truth_folder() const { return truth_folder_; }

  // sensor.yaml of the cameras and the IMU: what a user is told of the rig.
  void WriteCalibration(const Rig& rig, double image_rate_hz) const;

  // The rig as it truly is, in Kalibr's form, with its time offset: truth/rig.yaml.
  void WriteTrueRig(const Rig& rig) const;

  void WriteImu(const std::vector<ImuSample>& samples) const;

  // A row an IMU sample; the samples' stamps count from the motion's time 0 at start_stamp_ns.
  // Throws StoppedError where progress ends it.
  void WriteTruth(const MotionSpline& motion, const SimulatedImu& imu, int64_t start_stamp_ns,
                  const Progress& progress = {}) const;

  // Removes what it made, as long as no image was written: what remains would be of no use, and in
  // the way of the next attempt.
  void Discard() const;

  // Encodes and writes one image (8 bit grey). May be called from several threads at a time.
  void WriteImage(int camera, int64_t stamp_ns, const cv::Mat& image) const;

  // Depth along the optical axis of the left camera (float, metres; 0 where there is nothing),
  // stored as 16 bit in millimetres: truth/depth/<stamp>.png.
  void WriteDepth(int64_t stamp_ns, const cv::Mat& depth_m) const;

  // data.csv of all cameras; the images of the second are stamped later by right_offset_ns.
  void WriteImageLists(const std::vector<int64_t>& stamps_ns, int64_t right_offset_ns = 0) const;

 private:
  std::string mav_folder_, truth_folder_;
  int cameras_;
};

}  // namespace slcmap::data
