#include "data/simulator/simulation.h"

#include <spdlog/spdlog.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <opencv2/core.hpp>
#include <random>

#include "data/calibration/calibration.h"
#include "data/calibration/imu_calibration.h"
#include "data/core/error.h"
#include "data/core/math.h"
#include "data/io/file.h"
#include "data/rig/profile.h"
#include "data/simulator/motion.h"
#include "data/simulator/scene/scene.h"
#include "data/simulator/sequence_writer.h"

namespace slcmap::inline data {
namespace {

class Normal {
 public:
  explicit Normal(uint64_t seed) : generator_(seed) {}
  double Draw(double sigma) { return sigma * normal_(generator_); }
  Eigen::Vector3d Draw3(double sigma) {
    const double x = Draw(sigma), y = Draw(sigma);
    return {x, y, Draw(sigma)};
  }
  RigidTransform DrawTransform(double sigma_rad, double sigma_m) {
    const Eigen::Quaterniond rotation = ExpRotation(Draw3(sigma_rad));
    return {rotation, Draw3(sigma_m)};
  }

 private:
  std::mt19937_64 generator_;
  std::normal_distribution<double> normal_;
};

// What an ideal reading becomes: the first axis is kept, the others are off_rad off the right
// angle.
Eigen::Matrix3d AxesOff(double off_rad, Normal* normal) {
  const double sign = normal->Draw(1) < 0 ? -1 : 1;
  const double towards_rad = std::numbers::pi * normal->Draw(1);
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  axes.row(1) << sign * std::sin(off_rad), std::cos(off_rad), 0;
  axes.row(2) << std::sin(off_rad) * std::cos(towards_rad),
      std::sin(off_rad) * std::sin(towards_rad), std::cos(off_rad);
  return axes;
}

}  // namespace

Rig ReadSimulatedRig(const std::string& name_or_path) {
  const std::string named = ConfigFolder() + "/rigs/" + name_or_path + ".yaml";
  std::error_code error;
  const std::string path = std::filesystem::exists(named, error) ? named : name_or_path;
  if (!std::filesystem::is_regular_file(path, error)) {
    throw ConfigError("rig: found '" + name_or_path +
                      "', expected euroc, tumvi, four_cameras, three_cameras or a file");
  }
  Warnings warnings;
  return ReadKalibrCalibration(path, path, &warnings).rig;
}

ImuModel ImuModelFromName(const std::string& name) {
  if (name == "adis16448") return {{1.6968e-4, 1.9393e-5, 2.0e-3, 3.0e-3, 200}, 0.02, 0.05};
  if (name == "bmi160") return {{1.6e-4, 2.2e-5, 2.8e-3, 8.6e-4, 200}, 0.01, 0.06};
  if (name == "phone") return {{3.0e-4, 3.0e-5, 4.0e-3, 1.0e-3, 200}, 0.01, 0.10};
  if (name == "perfect") return {{1.6968e-4, 1.9393e-5, 2.0e-3, 3.0e-3, 200}, 0, 0, false};
  throw ConfigError("imu: found '" + name + "', expected adis16448, bmi160, phone or perfect");
}

ImuCorrection MisreadingImu(double accel_scale, double gyro_scale, double axes_deg, uint64_t seed) {
  Normal normal(seed);
  const double off_rad = axes_deg * kDegree;
  const Eigen::Matrix3d accel = (1 + accel_scale) * AxesOff(off_rad, &normal);
  const Eigen::Quaterniond turn = ExpRotation(off_rad * normal.Draw3(1).normalized());
  const Eigen::Matrix3d gyro =
      (1 + gyro_scale) * AxesOff(off_rad, &normal) * turn.toRotationMatrix();
  return {accel.inverse(), gyro.inverse()};
}

Rig Miscalibrated(const Rig& rig, double scale, uint64_t seed) {
  Normal normal(seed);
  Rig wrong = rig;
  const RigidTransform mounting = normal.DrawTransform(0.3 * kDegree * scale, 0.003 * scale);
  for (int c = 0; c < CameraCount(rig); ++c) {
    const double focal = 1 + normal.Draw(0.003 * scale);
    wrong.cameras[c].fx_px *= focal;
    wrong.cameras[c].fy_px *= focal;
    wrong.cameras[c].cx_px += normal.Draw(1.5 * scale);
    wrong.cameras[c].cy_px += normal.Draw(1.5 * scale);
    wrong.T_imu_camera[c] = mounting * rig.T_imu_camera[c];
  }
  for (int c = 1; c < CameraCount(rig); ++c) {
    wrong.T_imu_camera[c] =
        wrong.T_imu_camera[c] * normal.DrawTransform(0.05 * kDegree * scale, 0.0003 * scale);
  }
  return wrong;
}

namespace {

constexpr int64_t kMadeStart_ns = 1'600'000'000'000'000'000;  // of motions without a date
constexpr double kLeastRate_hz = 0.01, kMostRate_hz = 1000;
constexpr int64_t kMostSeed = 4294967295;  // images take 32 bits
constexpr double kMargin_s = 0.06;  // of IMU samples before the first and after the last image
constexpr double kMostRightOffset_s = 0.03, kMostReadout_s = 0.05;  // rows stay in the margin

struct StartedMotion {
  MotionSpline motion;
  int64_t start_stamp_ns;  // of its time 0
};

StartedMotion FittedMotion(const std::string& path, const Progress& progress) {
  const Trajectory trajectory = ReadTrajectory(path);
  const MotionFit fit = FitMotion(trajectory, {}, progress);
  spdlog::info(
      "{}: fitted to {:.2f} mm and {:.3f} degrees (RMS; at most {:.1f} mm, {:.2f} degrees)", path,
      1e3 * fit.position_rms_m, 57.29578 * fit.rotation_rms_rad, 1e3 * fit.position_max_m,
      57.29578 * fit.rotation_max_rad);
  return {fit.motion, trajectory.front().stamp_ns};
}

StartedMotion MotionOfScene(const std::string& scene_path, const Rig& rig,
                            const Progress& progress) {
  YamlSection scene = YamlSection::FromFile(scene_path);
  if (!scene.Has("trajectory")) {
    throw ConfigError(scene_path +
                      ": trajectory: missing, expected a way to move along (or --trajectory FILE)");
  }
  MadeMotionOptions options;
  options.Read(scene.Section("trajectory"));
  return {MakeMotion(options, rig, progress), kMadeStart_ns};
}

StartedMotion StartMotion(const SimulationOptions& options, const Rig& rig,
                          const Progress& progress) {
  StartedMotion started = options.trajectory.empty() ? MotionOfScene(options.scene, rig, progress)
                                                     : FittedMotion(options.trajectory, progress);
  const double duration_s = options.duration_s > 0 ? options.duration_s : 1e9;
  if (options.from_s >= started.motion.Duration()) {
    throw ConfigError(
        fmt::format("simulate: --from: found {:.6g} s, expected less than the {:.6g} "
                    "s that the motion lasts",
                    options.from_s, started.motion.Duration()));
  }
  started.motion = started.motion.Slice(options.from_s, duration_s);
  started.start_stamp_ns += ToNanoseconds(options.from_s);
  const double least_s = 2 * kMargin_s + 1 / options.image_rate_hz;
  if (started.motion.Duration() < least_s) {
    throw ConfigError(fmt::format(
        "simulate: found a motion of {:.3g} s, expected at least {:.3g} s, which a pair takes at "
        "--rate {:.3g} Hz (--from and --duration choose the part)",
        started.motion.Duration(), least_s, options.image_rate_hz));
  }
  return started;
}

// Of an IMU's noise and biases. Each building has others: methods whose figures hang on one lucky
// draw are not to look good in all of them.
std::mt19937_64 ImuGenerator(int64_t seed, const std::string& building) {
  std::vector<uint32_t> words{static_cast<uint32_t>(seed)};
  for (const char letter : building) words.push_back(static_cast<unsigned char>(letter));
  std::seed_seq mixed(words.begin(), words.end());
  return std::mt19937_64(mixed);
}

SimulatedImu MakeImu(const StartedMotion& started, const ImuModel& model, std::mt19937_64 generator,
                     const Progress& progress) {
  std::normal_distribution<double> normal;
  ImuSimulatorOptions options;
  options.noise = model.noise;
  options.with_noise = model.with_noise;
  for (int k = 0; k < 3; ++k) {
    options.initial_gyro_bias_rad_s[k] = model.gyro_bias_rad_s * normal(generator);
    options.initial_accel_bias_m_s2[k] = model.accel_bias_m_s2 * normal(generator);
  }
  options.start_stamp_ns = started.start_stamp_ns;
  options.seed = generator();
  return SimulateImu(started.motion, options, progress);
}

// What the rig's IMU makes of what an ideal one reads, noise and bias included: corrected, it is
// the same again.
void Misread(const ImuCorrection& correction, std::vector<ImuSample>* samples) {
  Correct({correction.accel.inverse(), correction.gyro.inverse()}, samples);
}

ImuModel MakeModel(const SimulationOptions& options, const Rig& rig) {
  if (!options.imu.empty()) return ImuModelFromName(options.imu);
  return {rig.imu_noise, 0.02, 0.05};  // biases as those of both published rigs
}

// The same view with other pixels.
void Resize(const cv::Size& size_px, Camera* camera) {
  const double wider = 1.0 * size_px.width / camera->width_px;
  const double higher = 1.0 * size_px.height / camera->height_px;
  camera->width_px = size_px.width;
  camera->height_px = size_px.height;
  camera->fx_px *= wider;
  camera->fy_px *= higher;
  camera->cx_px = wider * (camera->cx_px + 0.5) - 0.5;
  camera->cy_px = higher * (camera->cy_px + 0.5) - 0.5;
}

Rig ReadKnownRig(const SimulationOptions& options) {
  Rig rig = ReadSimulatedRig(options.rig);
  if (options.profile == nullptr) return rig;
  if (CameraCount(rig) != 2) {
    throw ConfigError(fmt::format("--as: found the rig {} of {} cameras, expected one of two",
                                  options.rig, CameraCount(rig)));
  }
  const RigProfile& profile = *options.profile;
  if (!profile.resolutions_px.empty()) {
    for (Camera& camera : rig.cameras) Resize(profile.resolutions_px.front(), &camera);
  }
  if (profile.imu_noise) rig.imu_noise = *profile.imu_noise;
  if (profile.camera_time_offset_s) rig.camera_time_offset_s = *profile.camera_time_offset_s;
  return LayoutFor(profile, rig).kind == ImageKind::kRectified ? Rectified(rig) : rig;
}

// As the rig truly is.
Rig MakeTrueRig(const SimulationOptions& options) {
  Rig rig = ReadKnownRig(options);
  rig.imu_noise = MakeModel(options, rig).noise;
  rig.camera_time_offset_s = options.time_offset_s.value_or(rig.camera_time_offset_s);
  rig.right_time_offset_s = options.right_offset_s.value_or(rig.right_time_offset_s);
  rig.other_time_offsets_s.clear();  // all but the right one are triggered together
  if (options.readout_s) std::ranges::fill(rig.readout_s, *options.readout_s);
  const std::vector<double>& scale = options.imu_scale;
  if (!scale.empty() || options.imu_axes_deg != 0) {
    rig.imu_correction =
        MisreadingImu(scale.empty() ? 0 : scale.front(), scale.empty() ? 0 : scale.back(),
                      options.imu_axes_deg, options.seed);
  }
  return rig;
}

// Images in step with the IMU's samples, as a triggered rig takes them.
std::vector<double> ImageTimes(const SimulationOptions& options, const MotionSpline& motion) {
  std::vector<double> times_s;
  const double first_s = kMargin_s, last_s = motion.Duration() - kMargin_s;
  for (int64_t i = static_cast<int64_t>(std::ceil(first_s * options.image_rate_hz));
       static_cast<double>(i) / options.image_rate_hz <= last_s; ++i) {
    times_s.push_back(static_cast<double>(i) / options.image_rate_hz);
  }
  return times_s;
}

// On the camera's clock.
std::vector<int64_t> ImageStamps(const RenderTask& task, const StartedMotion& started) {
  std::vector<int64_t> stamps_ns;
  for (const double t_s : task.times_s) {
    stamps_ns.push_back(started.start_stamp_ns + ToNanoseconds(t_s) -
                        ToNanoseconds(task.rig.camera_time_offset_s));
  }
  return stamps_ns;
}

// Everything but the images. mav0 tells neither the time offset nor what the IMU misreads.
void WriteSensors(const SequenceWriter& writer, const SimulationOptions& options,
                  const RenderTask& task, const StartedMotion& started, const SimulatedImu& imu,
                  const Progress& progress) {
  writer.WriteCalibration(Miscalibrated(task.rig, options.miscalibration, options.seed),
                          options.image_rate_hz);
  writer.WriteTrueRig(task.rig);
  writer.WriteImu(imu.samples);
  writer.WriteTruth(task.motion, imu, started.start_stamp_ns, progress);
}

// Refuses what would fill the disk, or take days.
void RequireFeasible(const SimulationOptions& options, const RenderTask& task) {
  constexpr int64_t kMaxPairs = 500'000;
  constexpr double kImageBytes_px = 0.7, kDepthBytes_px = 1;  // of noisy images as PNG
  const auto pairs = static_cast<int64_t>(task.times_s.size());
  if (pairs > kMaxPairs) {
    throw ConfigError(fmt::format(
        "simulate: found a motion of {:.0f} s, which gives {} pairs at {} Hz, expected at "
        "most {} (--duration and --rate make them fewer)",
        task.motion.Duration(), pairs, options.image_rate_hz, kMaxPairs));
  }
  double pair_bytes = 0;
  for (const Camera& camera : task.rig.cameras) {
    pair_bytes += kImageBytes_px * camera.width_px * camera.height_px;
  }
  const Camera& left = task.rig.cameras[0];
  if (options.with_depth) pair_bytes += kDepthBytes_px * left.width_px * left.height_px;
  const double needed_mb = 1e-6 * pair_bytes * static_cast<double>(pairs);
  std::error_code error;
  std::filesystem::path place = std::filesystem::absolute(options.folder, error);
  while (!std::filesystem::exists(place, error) && place.has_relative_path()) {
    place = place.parent_path();
  }
  const auto space = std::filesystem::space(place, error);
  if (error || needed_mb <= 1e-6 * static_cast<double>(space.available)) return;
  throw ConfigError(fmt::format(
      "simulate: found {} pairs that take about {:.0f} MB, expected at most the {:.0f} MB "
      "that are free in {} (--duration and --rate make them fewer)",
      pairs, needed_mb, 1e-6 * static_cast<double>(space.available), place.string()));
}

double NearestDepth(const cv::Mat& depth_m) {
  double nearest_m = 0;
  cv::minMaxLoc(depth_m, &nearest_m, nullptr, nullptr, nullptr, depth_m > 0);
  return nearest_m;
}

// The lengths of the way from the motion's start to each of the times, which are sorted.
std::vector<double> DistancesAt(const MotionSpline& motion, const std::vector<double>& times_s) {
  constexpr double kStep_s = 0.01;
  std::vector<double> distances_m;
  double t_s = 0, distance_m = 0;
  for (const double until_s : times_s) {
    while (t_s < until_s) {
      const double step_s = std::min(kStep_s, until_s - t_s);
      distance_m += step_s * motion.VelocityAt(t_s + 0.5 * step_s).norm();
      t_s += step_s;
    }
    distances_m.push_back(distance_m);
  }
  return distances_m;
}

}  // namespace

void SimulationOptions::Check() const {
  const auto expect = [](bool holds, const char* message) {
    if (!holds) throw ConfigError(std::string("simulate: ") + message);
  };
  expect(from_s >= 0, "--from: expected zero or more seconds");
  expect(duration_s >= 0, "--duration: expected zero or more seconds");
  if (!(image_rate_hz >= kLeastRate_hz && image_rate_hz <= kMostRate_hz)) {
    throw ConfigError(
        fmt::format("simulate: --rate: found {:.6g}, expected {} to {} pairs a second",
                    image_rate_hz, kLeastRate_hz, kMostRate_hz));
  }
  expect(std::abs(time_offset_s.value_or(0)) <= 0.5,
         "--time-offset-s: expected at most 0.5 either way");
  expect(std::abs(right_offset_s.value_or(0)) <= kMostRightOffset_s,
         "--right-offset-s: expected at most 0.03 either way");
  expect(std::abs(readout_s.value_or(0)) <= kMostReadout_s,
         "--readout-s: expected at most 0.05 either way");
  expect(imu_scale.size() <= 2, "--imu-scale: expected one or two numbers");
  for (const double scale : imu_scale) {
    expect(std::abs(scale) <= 0.2, "--imu-scale: expected -0.2 to 0.2");
  }
  expect(imu_axes_deg >= 0 && imu_axes_deg <= 10, "--imu-axes-deg: expected 0 to 10");
  expect(miscalibration >= 0 && miscalibration <= 100, "--wrong-calibration: expected 0 to 100");
  if (seed < 0 || seed > kMostSeed) {
    throw ConfigError(fmt::format("simulate: --seed: found {}, expected 0 to {}", seed, kMostSeed));
  }
  expect(threads >= 1 && threads <= 64, "--threads: expected 1 to 64");
}

namespace {

Emitter ReadEmitter(const std::string& name) {
  if (name == "off") return Emitter::kOff;
  if (name == "steady") return Emitter::kSteady;
  if (name == "alternating") return Emitter::kAlternating;
  throw ConfigError("simulate: --emitter: found " + name + ", expected off, steady or alternating");
}

}  // namespace

SimulationState Simulate(const SimulationOptions& options, const PairRendererFactory& make_renderer,
                         const SimulationProgress& progress, const StageStarter& start_stage) {
  options.Check();
  const auto stage = [&](const char* label) {
    return start_stage ? start_stage(label) : Progress();
  };
  const Rig rig = MakeTrueRig(options);
  const ImuModel model = MakeModel(options, rig);
  const StartedMotion started = StartMotion(options, rig, stage("planning the motion"));
  std::stop_source stop;
  const RenderTask task{rig,         started.motion,   ImageTimes(options, started.motion),
                        start_stage, stop.get_token(), ReadEmitter(options.emitter)};
  RequireFeasible(options, task);
  SimulatedImu imu = MakeImu(
      started, model, ImuGenerator(options.seed, ReadSceneName(options.scene)), stage("IMU"));
  Misread(rig.imu_correction, &imu.samples);
  const std::unique_ptr<PairRenderer> renderer = make_renderer(task);

  const SequenceWriter writer(options.folder, CameraCount(rig));
  try {
    WriteSensors(writer, options, task, started, imu, stage("truth"));
  } catch (const StoppedError&) {
    writer.Discard();
    throw;
  }
  const std::vector<int64_t> stamps_ns = ImageStamps(task, started);
  const int planned = static_cast<int>(stamps_ns.size());
  const int64_t right_offset_ns = ToNanoseconds(rig.right_time_offset_s);
  std::vector<double> nearest_m(planned);
  const auto make = [&](int frame) {
    const RenderedPair pair = renderer->Render(frame, options.with_depth);
    writer.WriteImage(0, stamps_ns[frame], pair.left);
    if (HasTwoCameras(rig)) {
      writer.WriteImage(1, stamps_ns[frame] + right_offset_ns, pair.right);
    }
    for (size_t i = 0; i < pair.others.size(); ++i) {
      writer.WriteImage(static_cast<int>(i) + 2, stamps_ns[frame], pair.others[i]);
    }
    if (!options.with_depth) return;
    writer.WriteDepth(stamps_ns[frame], pair.depth_m);
    nearest_m[frame] = NearestDepth(pair.depth_m);
  };
  const std::vector<double> distances_m = DistancesAt(task.motion, task.times_s);
  const auto state = [&](int pairs) -> SimulationState {
    if (pairs == 0) return {0, planned};
    return {pairs, planned, task.times_s[pairs - 1], distances_m[pairs - 1]};
  };
  const auto report = [&](int done) {
    const bool goes_on = progress(state(done));
    if (!goes_on) stop.request_stop();
    return goes_on;
  };
  const int pairs = MakeFrames(planned, options.threads, make, report);
  writer.WriteImageLists({stamps_ns.begin(), stamps_ns.begin() + pairs}, right_offset_ns);
  renderer->WriteTruth(writer.truth_folder(), pairs);
  SimulationState end = state(pairs);
  const auto nearest = std::min_element(nearest_m.begin(), nearest_m.begin() + pairs);
  end.nearest_pair = static_cast<int>(nearest - nearest_m.begin());
  if (pairs > 0) end.nearest_m = *nearest;
  return end;
}

}  // namespace slcmap::data
