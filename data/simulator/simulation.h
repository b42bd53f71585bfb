// A whole simulated sequence: scene, motion and rig in, a EuRoC folder with its truth out; the rigs
// and IMUs that can be simulated, and rigs that are not as calibrated.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "data/core/types.h"
#include "data/rig/profile.h"
#include "data/simulator/sequence_writer.h"

namespace slcmap::inline data {

// "euroc", "tumvi" (config/rigs) or a file in their form: Kalibr's camera chain with its IMU under
// imu0. Throws ConfigError when there is no such name or file, DataError when the file is absurd.
Rig ReadSimulatedRig(const std::string& name_or_path);

// An IMU by its datasheet: noise, and the spread of its biases at switch-on.
struct ImuModel {
  ImuNoise noise;
  double gyro_bias_rad_s = 0;  // standard deviation of each axis
  double accel_bias_m_s2 = 0;
  bool with_noise = true;
};

// "adis16448" (EuRoC), "bmi160" (TUM VI), "phone" or "perfect" (no noise; told as an adis16448).
// Throws ConfigError naming them.
ImuModel ImuModelFromName(const std::string& name);

// The correction of an IMU that reads 1 + scale times what is there, along axes that are each off
// by axes_deg: in Kalibr's model, the second and third of both sensors out of the right angle, and
// the gyroscope as a whole turned against the accelerometer. Where to is drawn from the seed.
ImuCorrection MisreadingImu(double accel_scale, double gyro_scale, double axes_deg, uint64_t seed);

// A rig that differs from `rig` as a careless calibration does; at scale 1 by standard deviations
// of 0.3 % in focal length, 1.5 px in the principal point, 0.3 degrees and 3 mm in T_imu_camera of
// all cameras alike, and 0.05 degrees and 0.3 mm between the cameras.
Rig Miscalibrated(const Rig& rig, double scale, uint64_t seed);

struct SimulationOptions {
  std::string scene;          // YAML file
  std::string folder;         // of the sequence, new
  std::string trajectory;     // TUM or EuRoC file; "": the scene's section `trajectory`
  double from_s = 0;          // into the motion
  double duration_s = 0;      // 0: to the end
  std::string rig = "euroc";  // see ReadSimulatedRig
  // Of a rig that is to be so, too: images rectified and of its size, its noise and time offset.
  const RigProfile* profile = nullptr;
  std::string imu;  // see ImuModelFromName; "": the rig's own
  double image_rate_hz = 20;
  // Of an IMU that reads too much by these shares, the accelerometer's and the gyroscope's (one
  // number: of both), along axes that are off by so much; see MisreadingImu. Not told in mav0.
  std::vector<double> imu_scale;
  double imu_axes_deg = 0;
  // Stamp on the IMU's clock minus stamp on the camera's; the profile's, or 0, without it.
  std::optional<double> time_offset_s;
  // Of Rig, instead of what the rig's file says; the right images have stamps of their own.
  std::optional<double> right_offset_s, readout_s;
  double miscalibration = 0;  // of what mav0 tells of the rig; see Miscalibrated
  bool with_depth = false;
  std::string emitter = "off";  // of dots: "steady", or "alternating" with every other image
  int threads = 2;
  int64_t seed = 1;
  void Check() const;  // throws ConfigError
};

// How far a simulation has come.
struct SimulationState {
  int pairs = 0, planned_pairs = 0;
  double data_s = 0, distance_m = 0;  // of the motion that the pairs cover
  // The nearest depth in any left image and the pair of it, once all is done; with depth images
  // only.
  double nearest_m = 0;
  int nearest_pair = 0;
};

// Called as pairs get done; false ends the simulation with what is done so far.
using SimulationProgress = std::function<bool(const SimulationState& state)>;

// Throws ConfigError, DataError and OutputError; ConfigError with a number and its limit where the
// sequence would be too long or too large for the disk. The files are the same whatever the
// threads. The work before the first pair reports to what start_stage gives; where that ends it,
// StoppedError is thrown and no file is left.
SimulationState Simulate(const SimulationOptions& options, const PairRendererFactory& make_renderer,
                         const SimulationProgress& progress, const StageStarter& start_stage = {});

}  // namespace slcmap::data
