#include "data/simulator/sequence_writer.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <future>
#include <mutex>
#include <vector>

#include "data/calibration/calibration.h"
#include "data/calibration/calibration_keys.h"
#include "data/calibration/camera_words.h"
#include "data/core/error.h"
#include "data/core/parallel.h"
#include "data/io/file.h"
#include "data/io/image.h"
#include "data/source/asl_files.h"

namespace slcmap::inline data {

int MakeFrames(int count, int threads, const std::function<void(int)>& make,
               const std::function<bool(int)>& progress) {
  if (!progress(0)) return 0;
  std::atomic<int> next = 0, done = 0;
  std::atomic<bool> stopped = false;
  std::mutex mutex;
  int unmade = count;  // the first frame that was stopped
  const auto work = [&](size_t) {
    if (stopped) return;
    const int frame = next++;  // not the loop's: those that are begun are the first ones
    try {
      make(frame);
    } catch (const StoppedError&) {
      stopped = true;
      const std::lock_guard lock(mutex);
      unmade = std::min(unmade, frame);
    }
    ++done;
  };
  auto made = std::async(std::launch::async, [&] { ParallelFor(0, count, threads, work); });
  while (made.wait_for(std::chrono::milliseconds(100)) != std::future_status::ready) {
    if (!progress(done)) stopped = true;
  }
  progress(done);
  made.get();
  return std::min(done.load(), unmade);
}

namespace {

std::string CameraName(int camera) { return fmt::format("cam{}", camera); }

std::string AslTransform(const RigidTransform& T_body_sensor) {
  const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> m = T_body_sensor.Matrix();
  return fmt::format("T_BS:\n  cols: 4\n  rows: 4\n  data: [{}]\n",
                     fmt::join(m.data(), m.data() + m.size(), ", "));
}

// Nothing for a global shutter.
std::string ReadoutLine(const Rig& rig, int camera) {
  const double readout_s = rig.readout_s[camera];
  return readout_s == 0 ? "" : fmt::format("{}: {}\n", kReadoutKey, readout_s);
}

std::string AslCamera(const Rig& rig, int index, double rate_hz) {
  const Camera& camera = rig.cameras[index];
  const CameraWords words = DescribeCamera(camera);
  return fmt::format(
      "sensor_type: camera\ncomment: simulated\n{}rate_hz: {}\nresolution: [{}, {}]\n"
      "camera_model: {}\nintrinsics: [{}] #fu, fv, cu, cv\ndistortion_model: {}\n"
      "distortion_coefficients: [{}]\n{}",
      AslTransform(rig.T_imu_camera[index]), rate_hz, camera.width_px, camera.height_px,
      words.camera_model, fmt::join(words.intrinsics, ", "),
      words.distortion_model == "radtan" ? "radial-tangential" : words.distortion_model,
      fmt::join(words.coefficients, ", "), ReadoutLine(rig, index));
}

std::string AslImu(const ImuNoise& noise) {
  return fmt::format(
      "sensor_type: imu\ncomment: simulated\n{}rate_hz: {}\n"
      "gyroscope_noise_density: {} # [ rad / s / sqrt(Hz) ]\n"
      "gyroscope_random_walk: {} # [ rad / s^2 / sqrt(Hz) ]\n"
      "accelerometer_noise_density: {} # [ m / s^2 / sqrt(Hz) ]\n"
      "accelerometer_random_walk: {} # [ m / s^3 / sqrt(Hz) ]\n",
      AslTransform({}), noise.rate_hz, noise.gyro_noise_rad_s_sqrthz, noise.gyro_walk_rad_s2_sqrthz,
      noise.accel_noise_m_s2_sqrthz, noise.accel_walk_m_s3_sqrthz);
}

std::string Row(const Eigen::Vector3d& v) {
  return fmt::format(",{:.9f},{:.9f},{:.9f}", v.x(), v.y(), v.z());
}

}  // namespace

SequenceWriter::SequenceWriter(const std::string& folder, int cameras)
    : mav_folder_(folder + "/mav0"), truth_folder_(folder + "/truth"), cameras_(cameras) {
  if (std::filesystem::exists(mav_folder_)) {
    throw OutputError(mav_folder_ + ": found a sequence already, expected a new folder");
  }
  for (int camera = 0; camera < cameras_; ++camera) {
    MakeFolder(mav_folder_ + "/" + CameraName(camera) + "/data");
  }
  MakeFolder(mav_folder_ + "/imu0");
  MakeFolder(mav_folder_ + "/state_groundtruth_estimate0");
  MakeFolder(truth_folder_);
}

void SequenceWriter::WriteCalibration(const Rig& rig, double image_rate_hz) const {
  for (int camera = 0; camera < cameras_; ++camera) {
    WriteFile(mav_folder_ + "/" + CameraName(camera) + "/sensor.yaml",
              AslCamera(rig, camera, image_rate_hz));
  }
  WriteFile(mav_folder_ + "/imu0/sensor.yaml", AslImu(rig.imu_noise));
  WriteFile(mav_folder_ + "/state_groundtruth_estimate0/sensor.yaml",
            "sensor_type: visual-inertial\ncomment: simulated, exact\n" + AslTransform({}));
}

void SequenceWriter::WriteTrueRig(const Rig& rig) const {
  Rig told = rig;
  told.right_time_offset_s = 0;  // right images have stamps of their own
  told.other_time_offsets_s.clear();
  WriteKalibrCalibration(truth_folder_ + "/rig.yaml", told);
}

void SequenceWriter::WriteImu(const std::vector<ImuSample>& samples) const {
  std::string text = kAslImuHead;
  for (const ImuSample& s : samples) {
    text += std::to_string(s.stamp_ns) + Row(s.angular_velocity_rad_s) +
            Row(s.specific_force_m_s2) + "\n";
  }
  WriteFile(mav_folder_ + "/imu0/data.csv", text);
}

void SequenceWriter::WriteTruth(const MotionSpline& motion, const SimulatedImu& imu,
                                int64_t start_stamp_ns, const Progress& progress) const {
  std::string text =
      "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], "
      "q_RS_z [], v_RS_R_x [m s^-1], v_RS_R_y [m s^-1], v_RS_R_z [m s^-1], "
      "b_w_RS_S_x [rad s^-1], b_w_RS_S_y [rad s^-1], b_w_RS_S_z [rad s^-1], "
      "b_a_RS_S_x [m s^-2], b_a_RS_S_y [m s^-2], b_a_RS_S_z [m s^-2]\n";
  Trajectory trajectory;
  for (size_t i = 0; i < imu.samples.size(); ++i) {
    if (i % 1024 == 0) {
      progress.ReportOrStop(static_cast<double>(i) / static_cast<double>(imu.samples.size()));
    }
    const int64_t stamp_ns = imu.samples[i].stamp_ns;
    const double t_s = ToSeconds(stamp_ns - start_stamp_ns);
    trajectory.push_back({stamp_ns, motion.PoseAt(t_s)});
    const Eigen::Quaterniond& q = trajectory.back().T_world_imu.rotation;
    text += std::to_string(stamp_ns) + Row(trajectory.back().T_world_imu.translation) +
            fmt::format(",{:.9f}", q.w()) + Row(q.vec()) + Row(motion.VelocityAt(t_s)) +
            Row(imu.biases[i].gyro_rad_s) + Row(imu.biases[i].accel_m_s2) + "\n";
  }
  WriteFile(mav_folder_ + "/state_groundtruth_estimate0/data.csv", text);
  WriteTumTrajectory(truth_folder_ + "/trajectory.tum", trajectory);
}

void SequenceWriter::Discard() const {
  std::error_code error;
  std::filesystem::remove_all(mav_folder_, error);
  for (const char* name : {"/trajectory.tum", "/rig.yaml", ""}) {
    std::filesystem::remove(truth_folder_ + name, error);  // a folder only where it is empty
  }
}

void SequenceWriter::WriteImage(int camera, int64_t stamp_ns, const cv::Mat& image) const {
  WritePng(fmt::format("{}/{}/data/{}.png", mav_folder_, CameraName(camera), stamp_ns), image);
}

void SequenceWriter::WriteDepth(int64_t stamp_ns, const cv::Mat& depth_m) const {
  cv::Mat depth_mm;
  depth_m.convertTo(depth_mm, CV_16U, 1000.0);
  MakeFolder(truth_folder_ + "/depth");
  WritePng(fmt::format("{}/depth/{}.png", truth_folder_, stamp_ns), depth_mm);
}

void SequenceWriter::WriteImageLists(const std::vector<int64_t>& stamps_ns,
                                     int64_t right_offset_ns) const {
  for (int camera = 0; camera < cameras_; ++camera) {
    std::string text = kAslImagesHead;
    for (const int64_t stamp_ns : stamps_ns) {
      text += fmt::format("{0},{0}.png\n", stamp_ns + (camera == 1 ? right_offset_ns : 0));
    }
    WriteFile(mav_folder_ + "/" + CameraName(camera) + "/data.csv", text);
  }
}

}  // namespace slcmap::data
