// Writes a simulated sequence as a EuRoC (ASL) folder.
//
//   DIR/mav0/cam0, cam1                    sensor.yaml, data.csv, data/<stamp>.png
//   DIR/mav0/imu0                          sensor.yaml, data.csv
//   DIR/mav0/state_groundtruth_estimate0   sensor.yaml, data.csv: pose, velocity, biases
//   DIR/truth                              trajectory.tum, rig.yaml and what the renderer knows
#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "data/simulator/imu_simulator.h"
#include "data/simulator/motion.h"
#include "data/types.h"

namespace slcmap {

class SequenceWriter {
 public:
  // Makes the folders. Throws OutputError where that fails or where mav0 is there already.
  explicit SequenceWriter(const std::string& folder);

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

  // data.csv of both cameras.
  void WriteImageLists(const std::vector<int64_t>& stamps_ns) const;

 private:
  std::string mav_folder_, truth_folder_;
};

}  // namespace slcmap
